## What is asked

request-enable = enable
request-disable = disable
request-hold = hold
request-resume = resume
request-trim = trim
request-diameter = diameter
request-acknowledge = acknowledge
request-touch = touch
request-datum = datum set anew
request-model = model

## How a request was answered

answer-not_supported = nobody here can do that
answer-acknowledge_first = it is in the state Fault: remove the cause and acknowledge first
answer-in_fault = it is in the state Fault
answer-other_compensation_unread = whether another compensation is active cannot be read
answer-double_compensation = { reason-double_compensation }: switch one off
answer-offset_outside = { reason-offset_outside }: bring it back within them first
answer-already_enabled = it was enabled already
answer-enabled = it is active as soon as everything is there
answer-disabled = the correction fades at the allowed rate
answer-nothing_to_hold = there is nothing to hold: it is not enabled, or in the state Fault
answer-held = it is held, for at most { DURATION($longest_s) }
answer-resumed = the hold is ended
answer-unknown_output = outputs are { NAME($names) }
answer-trim_range = a trim is a number from { $lowest_um } to { $largest_um } µm
answer-trim_cleared = the trim is taken back
answer-trim_duration = a trim expires within { DURATION($longest_s) }: state when
answer-trim_set = the trim is added
answer-trim_replaced = the trim of { $who } is replaced
answer-diameter_range = a diameter is a number from 0 to { $largest_mm } mm
answer-diameter_set = the diameter is taken over
answer-no_fault = there is no fault; the present values of the sensors are taken as right; alarms taken as seen: { $alarms }
answer-acknowledged = the fault is acknowledged; it is off until it is enabled; alarms taken as seen: { $alarms }
answer-double_compensation_still = another compensation or writer is still there: switch one off, or wait a minute
answer-offset_outside_still = the offset still lies outside the limits; it comes back at the allowed rate
answer-read_back_differs_still = the machine still reports another offset: check the connection and the axis
answer-touched = { CODE($outcome, "touch") }
answer-touches_forgotten = what touches have taught is forgotten; their offset leaves at the allowed rate
answer-sensor_alarm_meanwhile = an alarm of a sensor came meanwhile: look at it, then acknowledge
answer-ending = the loop is being ended
answer-ended = the loop has ended
answer-no_model_folder = no folder of models is configured
answer-model_unusable = the model cannot be used: { $why }
answer-model_outputs = the model gives { NAME($names) }; the machine needs { NAME($needed) }
answer-model_settles = the new model takes over once it has settled
answer-name_unusable = a name has signs that cannot be shown, or is too long
answer-number_not_finite = a number is not finite
answer-not_at_computer = the configuration does not allow this at the computer itself: see ask_enables
answer-no_answer = the loop has not answered; the request may still take effect

## What a user may do

role-none = none
role-viewer = viewer
role-operator = operator
role-engineer = engineer
