## States of the compensation

state-Off = Off
state-Warming = Warming up
state-Active = Compensating
state-Holding = Hold
state-Fading = Fading out
state-Fault = Fault

## What is the matter, in one line, and what the operator can do

headline-off = The compensation is off.
headline-warming = It begins by itself in { DURATION($left_s) }.
    .remedy = Wait.
headline-active = The correction follows the model.
headline-on_its_way = { NAME($name) } on its way: { FIXED($left_um, decimals: 0) } µm to go, about { DURATION($left_s) }.
    .remedy = Wait: what acts is not what the model asks for yet.
headline-at_limit = The model asks for more than the limit of { NAME($name) } allows.
    .remedy = Compare with a probe measurement before going on.
headline-held_by_person = Held by a person ({ $who }).
    .remedy = Resume to go on.
headline-hold_lost = The hold keeps no offset: { CODE($cause, "lost") }.
    .remedy = The offset goes to zero and stays there until you resume.
headline-hold_expired = Held for too long: the correction fades out.
    .remedy = Resume, or disable.
headline-held_for_input = Held: { NAME($name) } gives no usable value.
    .remedy = Check sensor and wire; { CODE($then, "then") }.
headline-input_lost = { NAME($name) } gives no usable value.
    .remedy = Check sensor and wire; { CODE($then, "then") }.
headline-interlock = Interlock open: { NAME($names) }.
    .remedy = Release it at the machine; { CODE($then, "then") }.
headline-not_released = Not released yet.
    .remedy = Do what the alarms say.
headline-starting = The program was started: it reads and tests the control.
    .remedy = Wait.
headline-another_writer = Something else has set the offset of { NAME($name) }.
    .remedy = Find out who writes it and end that; see the alarm.
headline-fading = Switched off: the correction fades out.
    .remedy = Enable to compensate again.
headline-unreachable = The control cannot be read: what acts is not known.
    .remedy = The machine's watchdog may have set the offset to zero. Check network and control.
headline-not_acting = Not acting as commanded: { NAME($names) }.
    .remedy = Look at the control: release, watchdog, who else writes.
headline-inputs_unreachable = The temperatures cannot be read.
    .remedy = Check network and control; { CODE($then, "then") }.
headline-fault = { CODE($reason, "reason") }
    .remedy = Remove the cause, then acknowledge.

## What it takes to go on once the cause is gone

then-wait = it goes on by itself
then-resume = then resume to go on
then-resume_anew = the hold is over: it fades, then resume
then-enable = then enable to compensate again

## Why a hold keeps no offset

lost-restart = the program was restarted
lost-other = there was none, or it was interrupted

## Why the compensation is not active

reason-disabled = it is not enabled
reason-settling = the model has not run for long enough
reason-recovering = everything is there again; it must stay so for a moment
reason-input_bad = an input has no usable value
reason-connection_lost = the connection to the machine is lost
reason-interlock_open = an interlock is not met
reason-operator_hold = an operator holds it
reason-hold_expired = it was held for as long as it may be
reason-read_back_differs = the machine does not report the offset that was written
reason-long_at_limit = the correction stood at its limit for too long
reason-double_compensation = another compensation is active, or something else writes the offset
reason-offset_outside = the offset found in the machine lies outside the limits

## Whether an output of the model may be used

model_quality-good = good
model_quality-held = held
model_quality-bad = bad

## What was out of the ordinary in a cycle

outcome-started = the model started
outcome-waiting = the model waits until every input has a good value
outcome-clock_backward = the clock went backward: the model started anew at the steady state
outcome-clock_unusable = the time of the reading is no number: nothing was advanced
outcome-clock_still = the clock stands still: nothing was advanced
outcome-state_unusable = the stored state does not belong to this model: the model starts anew
outcome-gap = no reading for longer than the longest gap: the model started anew at the steady state
outcome-input_held = an input failed: its last good value is held
outcome-input_failed = an input failed for longer than it may be held
outcome-diameter_held = the workpiece's diameter lies outside the gains' range: the end value is held
outcome-diameter_unknown = no workpiece diameter is stated: the gain at the tool centre point is used
outcome-outside_validity = an input lies outside the range that the model was made from

## What became of a touch

touch-believed = the touch renews the offset
touch-confirmed = two touches agree and renew the offset: touch again when it has arrived
touch-excluded = the touch does not fit what is known: touch a second time
touch-repeated = this touch was known already
touch-untimely = what was in force when it was touched is not known
touch-unusable = the touch is no number that a machine can show
touch-unknown_output = no touches are looked at for this output
touch-no_effect = touches do not see the correction, or with the wrong sign: their offset is off until somebody acknowledges
touch-too_far = touches show more than one and a half times what their offset may mend: it is off until somebody acknowledges
touch-too_many_excluded = ten more touches did not fit than did: their offset is off until somebody acknowledges
