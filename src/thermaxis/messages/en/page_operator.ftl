### Words of the operator's page and of every request to the loop.

## state

operator-state_label = State of the compensation
operator-reason = What is the matter
operator-look_no_data = No data
operator-look_another_writer = Other writer
operator-look_at_limit = At the limit
operator-look_hold_lost = Not held
operator-look_input_lost = Sensor lost
operator-look_inputs_unreachable = No sensors
operator-look_interlock = Interlock
operator-look_not_released = { operator-look_interlock }
operator-look_not_acting = Not acting
operator-look_on_its_way = On its way
operator-look_starting = Starting
operator-look_unreachable = Disconnected
operator-since = since { $time }
operator-since_start = since at least { $time }
operator-for = ({ $time })
operator-no_data_remedy = The machine's watchdog may have set the offset to zero: look at the control. If this lasts, call the engineer.
operator-before = Before: { $state }.

## alarms

operator-alarms = Alarms:
operator-alarm_list = Alarms
operator-no_alarm = No alarm
operator-no_alarm_more = Nothing is out of the ordinary.
operator-critical = Critical
operator-high = High
operator-medium = Medium
operator-low = Low
operator-cause = Cause
operator-remedy = What to do
operator-came = since { $time }

## corrections

operator-corrections = Offset of every axis [µm]
operator-sign = + moves the tool away from the workpiece
operator-at_limit = at the limit ±{ $limit } µm
operator-over_limit = model over the limit ±{ $limit } µm
operator-at_soft_limit = near the limit ±{ $limit } µm
operator-limits = Limits
operator-limits_of = ±{ $hard } µm; warning from ±{ $soft } µm
operator-helps = Does it help?
operator-helps_by = { $axis } moves { $with } µm, without it { $without } µm
operator-helps_unknown = not measured
operator-rate = Change
operator-rate_of = at most ±{ $limit } µm/s
operator-commanded = Commanded
operator-sum = Sum
operator-accepted = Accepted
operator-effective = Effective
operator-acts_now = acts now
operator-last_read = last read { $value } µm, { $age } ago
operator-aged = { $value }, { $age } ago
operator-never_read = never read
operator-trim = Trim
operator-trim_none = none
operator-trim_manual = Trim (manual)
operator-trim_by = { $owner }, { $left } left
operator-weight = Weight of the model
operator-weight_full = { $weight } %, inside the tested range
operator-weight_less = { $weight } %, outside the tested range
operator-parts = Parts of the model
operator-part_gain = × { $gain } at { $diameter }
operator-wanted = Wanted
operator-wanted_full = Wanted, within limits, with trim
operator-rest = Not from the model
operator-others = { $count } others
operator-model_asks = Model asks for
operator-more_axes = +{ $count } more axes
operator-more_trimmed = +{ $count } more axes, trim (manual): { $trims } µm
operator-all_corrections = Corrections in full

## inputs

operator-all_inputs = All inputs
operator-inputs_good = { $count } inputs good
operator-inputs_bad = { $bad } of { $count } inputs not good: { $names }

## trend

operator-trend_waits = The history is being read.
operator-trend_fails = The history cannot be read now.
operator-trend_more = +{ $count }: History
operator-trend_label = What acted, and temperatures, of up to 8 hours

## connections

operator-connections = Connections
operator-beat = Cycle { $number }, { $time }
operator-source_good = Temperatures
operator-source_lost = Temperatures: DISCONNECTED
operator-sink_good = Control
operator-sink_lost = Control: DISCONNECTED
operator-history_good = History
operator-history_bad = History: NOT STORED
operator-model_good = Model { $file }
operator-model_held = Model { $file }: input failed
operator-model_bad = Model { $file }: NOT USABLE
operator-model_outside = Model { $file }: weight { $weight } %, outside its range
operator-diameter_is = Diameter { $diameter }
operator-tool_centre = tool centre point

## interventions

operator-interventions = Interventions
operator-enable = Enable
operator-disable = Disable
operator-hold = Hold
operator-resume = Resume
operator-trim_ask = Trim
operator-diameter_ask = Diameter
operator-acknowledge = Acknowledge
operator-why_role = Only to look at: log in as operator to intervene.
operator-why_no_data = No data: this cannot be asked now.
operator-why_only_disable = No data: only Disable can be asked.
operator-why_enabled = is enabled
operator-why_fault = acknowledge first
operator-why_disabled = is not enabled
operator-why_held = is held
operator-why_hold_lost = resume first
operator-why_not_held = is not held
operator-why_writer = other writer: in { DURATION($left_s) }
operator-why_calm = nothing waits
operator-why_no_trim = no trim is set
operator-why_no_output = this output is no more

## confirmation

operator-enable_text = The compensation begins as soon as everything that it needs is there.
operator-enable_axis = { $axis }: the correction goes from { $now } µm to { $wanted } µm, at most { $rate } µm/s: about { $time }.
operator-enable_unknown = { $axis }: where the correction of { $now } µm goes is not known, for an input or the control is not read. At most { $rate } µm/s.
operator-asks_model = The model asks for { $model } µm now.
operator-asks_over = The model asks for { $model } µm now, more than the limit of ±{ $largest } µm.
operator-asks_trim = The trim of { $owner } adds { $trim } µm.
operator-ask_interlock = { $opened } While the drives stand the offset stays where it is; this moves it once they run.
operator-disable_axis = { $axis }: the correction of { $now } µm fades to zero at { $rate } µm/s: about { $time }.
operator-disable_zero = { $axis }: the correction is zero already.
operator-disable_text = It does not jump. It stays off until somebody enables it.
operator-disable_blind = NO DATA: this page does not see what the compensation does now. It is asked all the same to fade the correction to zero.
operator-disable_unseen = Whether it takes effect is not seen here while there are no data: look at the control's own offset.
operator-ask_unreached = This page does not reach the screen's program: the request may never have been sent
operator-hold_axis = { $axis }: the correction stays at { $now } µm.
operator-hold_text = It is held for at most { $time }; then it fades to zero.
operator-hold_interlock = { $opened } This may end the hold before: then the offset goes to zero and stays there until you resume.
operator-hold_none = Nothing is held: the offset goes to zero and stays there until you resume.
operator-resume_text = The correction follows the model again, with the trims that are set.
operator-acknowledge_fault = You say that the cause is removed: { $reason }
operator-acknowledge_after = The correction fades to zero. The compensation stays off until somebody enables it.
operator-acknowledge_found = You say that you have seen it: { $found } This moves nothing.
operator-acknowledge_sensors = The present values of these sensors are accepted as right: { NAME($names) }
operator-continue = Continue
operator-trim_title = Trim by hand
operator-trim_axis = Axis
operator-trim_now = Set now: none
operator-trim_now_by = Set now: { $trim } µm by { $owner }, { $left } left
operator-trim_bound = from { $low } to { $high } µm
operator-trim_expires = Expires after
operator-trim_owner = Owner: { $name }
operator-trim_zero = Take the trim back (0)
operator-trim_step = Change by { $step } µm
operator-trim_text = { $axis }: a trim of { $after } µm is added and expires at { $until }.
operator-trim_replaces = { $axis }: the trim of { $owner }, { $trim } µm, is replaced by { $after } µm, which expires at { $until }.
operator-trim_back = { $axis }: the trim of { $owner }, { $trim } µm, is taken back.
operator-trim_moves = The correction moves by { $change } µm, at most { $rate } µm/s.
operator-trim_waits = It acts as soon as the compensation is active.
operator-diameter_title = Diameter of the workpiece
operator-diameter_now = Now: { $diameter }
operator-diameter_range = The model knows { $low } to { $high } mm; beyond that the end value counts.
operator-diameter_machine = The machine states the diameter too: when it changes there, that one counts.
operator-diameter_wrong = Write a number from 0 to 100000 mm.
operator-diameter_clear = Delete
operator-diameter_centre = Tool centre point
operator-diameter_text = The diameter becomes { $diameter }; before: { $before }.
operator-gain_counts = { $axis } { $part }: its share counts × { $gain } at { $diameter }.
operator-gain_end_counts = { $axis } { $part }: { $diameter } lies beyond the model's table; its share counts × { $gain }, as at its end at { $end }.
operator-diameter_follows = The correction goes there at the allowed rate.
operator-gain_none = The model does not depend on the diameter: nothing changes.
operator-gain_not_known = How the diameter counts is not known here: another model is in force than this screen was started with.
operator-asks_under = Recorded with your name: { $name }

## how far a request came

operator-request = Last request
operator-requested_at = requested { $time }
operator-accepted_at = accepted { $time }
operator-refused_at = refused { $time }
operator-effective_at = effective { $time }
operator-effective_waits = not yet effective
operator-effective_late = not seen effective within { $time }: look at state and alarms
operator-effective_unknown = effect not known
operator-as_asked_at = the state is as asked { $time }
operator-effect_replaced = not watched any more: something else was asked after it
operator-effect_restarted = effect not known: the compensation was started again
operator-answer_waits = waits for the answer
operator-answer_none = no answer; it may still take effect
operator-page_cannot_read = This page cannot read the status. Call the engineer.
operator-ask_form = This is no request.
operator-ask_method = Nobody can ask for that.
operator-ask_arguments = The request has other values than it needs.
operator-alarms_unknown = Alarms: unknown
operator-alarms_before_none = Before: none.
operator-alarms_before = Before: { $count }, first of them { $priority }: { $text }
operator-alarms_old = Whether there are alarms now is unknown. At { $time } it was so:
operator-detail = Detail
operator-inputs_old = before: { $said }
operator-nothing_to_ask = There is nothing to ask for any more: { $why }.

## touches

operator-touch_ask = Touch
operator-touches = Touches
operator-touches_of = Touches ± { $std } µm
operator-touches_shown = Touches: { $known } ± { $std }
operator-touched = Touch { $axis } { $time }: { $outcome }
operator-touch_showed = { $time }, { $value } µm: { $outcome }
operator-touch_none = none yet
operator-touch_renewed = renewed
operator-touch_again = does not fit, see the alarm
operator-touch_off = off: acknowledge
operator-touch_unused = not used
operator-touch_when = Time since then
operator-touch_now = TOUCH { $axis } NOW (± { $std } µm)
operator-touches_void = Touches: off
operator-touches_off = off until acknowledged
operator-touches_only_shown = only shown
operator-touches_unproven = only shown, for sign and size are not proven
operator-touch_known = the model lacks { $known } ± { $std } µm
operator-touch_last = Last touch
operator-trend_touches = { $axis } touches
operator-why_no_touches = no touches are taken
operator-touch_title = Touch by hand
operator-touch_value = What the touch showed
operator-touch_wrong = Write a number from −10000 to 10000 µm.
operator-touch_just = just now
operator-touch_text = { $axis }: the touch shows { $value } µm. What model and correction lack of it renews the offset, up to ±{ $largest } µm, at most { $rate } µm/s.
operator-touch_shown = { $axis }: the touch shows { $value } µm. Touches are only shown: nothing moves.
operator-touch_excluded = A touch that does not fit what is known changes nothing: touch a second time then.
operator-datum = Datum set anew
operator-datum_text = What touches have shown is forgotten; their offset goes to zero at the allowed rate.
operator-acknowledge_touches = { $axis }: touches count again, from the beginning. You say that probe, sign and datum are right.
