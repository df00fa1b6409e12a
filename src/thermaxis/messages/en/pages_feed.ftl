### Why the screen shows nothing of the loop.

feed-starting = The screen is connecting to the compensation.
feed-no_connection = No connection to the compensation; it is tried again.
feed-stands_still = The compensation is connected, but its cycle stands still.
feed-old = What the compensation says is too old to be shown as present.
feed-not_a_viewer = The screen's own account may do more than look, so it is not used. An engineer gives it the role viewer.
feed-no_answer = The compensation does not answer; it is tried again.
feed-no_status = The compensation has not finished its first cycle yet.
feed-not_understood = What the compensation says is not understood. Screen and compensation have to be of the same version.
feed-ended = The screen's program is being ended.
