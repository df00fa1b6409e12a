## What the reader of a result must know of a log

remark-outside_training = input { $name } (its change since the reference) lies outside the range of the training in { FIXED($share_percent, decimals: 0) }% of the rows, by up to { FIXED($beyond_percent, decimals: 0) }% of its width: the model is extrapolated there
remark-start_steady = { $channel } did not begin at rest: the free run starts in the steady state of the first row, far more likely by { $rows } measured rows (verify --start rest: as the machine would start)
remark-start_fitted = { $channel } did not begin at rest: the states of the lags and the zero of the log ({ FIXED($zero_um, decimals: 2) } um) are fitted to { $rows } measured rows, so its figures are not those of a machine that starts so (verify --start rest: as it would start)
remark-input_failed = an input had failed for too long in { $rows } rows ({ FIXED($share_percent, decimals: 1) }%): they do not count
remark-gap = { outcome-gap } ({ $count } times)
remark-clock_backward = { outcome-clock_backward } ({ $count } times)
remark-limits_too_narrow = the limits are too narrow: the compensation goes to the state Fault { $count } times; here each is acknowledged at once
remark-touches_untimely = { $channel }: none of { $touches } touches counts: what was in force at their times is not known, as inputs were missing or the model started anew between rows; what touches are worth does not show here
remark-touches_excluded = { $channel }: { $excluded } of { $touches } touches were excluded: they do not tell how often to touch. They are off by { $far }: chips, a datum that was set anew or another workpiece (tell the machine: datum_node, or ask datum; cut the log there: --span, --mask), or a model that no longer holds
remark-touches_far = { $channel }: { $excluded } of { $touches } touches were excluded, as they are off by { $far }: a chip, or where the later ones agree a datum that was set anew or another workpiece, which the offset followed (tell the machine: datum_node, or ask datum)
remark-touches_contradict = { $channel }: most touches contradict the model: the sign of the column (positive away from the workpiece), its unit (um, not mm) or its clock may be wrong, too
remark-touches_datum = { $channel }: was the datum set anew while the log ran? What the touches show steps by { $touches }: where the offset follows that, drift and discrepancy are not those of the machine, and no schedule is told (tell the machine: datum_node, or ask datum; cut the log there: --span, --mask)
remark-touches_touched = { $channel } was measured in { FIXED($share_percent, decimals: 0) } % of the rows: where these are touches, --touches { $channel } takes them as they are; here noise is added to theirs
touches-likeliest = a drift of { $drift_um } um in an hour and a discrepancy of { $discrepancy_um } um is not what they show; the likeliest is drift_um_per_root_h = { $likely_drift_um } and discrepancy_um = { $likely_discrepancy_um } (--touch-drift-um, --touch-discrepancy-um): it belongs into [probe] of the configuration
remark-touches_worse = { $channel }: the offset of the touches makes it worse ({ $offset_um } um mean absolute error, the model alone { $model_um }), for { $likeliest }
remark-touches_beyond = { $channel }: only { $percent } % of what touches add lies within two sigma (95 % should), for { $likeliest }

## What is suspicious about a log

log-never_measured = { $name }: no value in any row
    .remedy = Leave the channel out, or check its wiring and the export.
log-out_of_range = { $name }: { $count } values are no measurement, such as { $example } { $unit }, the first in row { $row }
    .remedy = Check the sensor and its wiring, and make these values missing before a model is identified.
log-swapped = { $name }: exchange places at row { $row } ({ $first_before } and { $second_before } { $unit } become { $first_after } and { $second_after })
    .remedy = Check the plugs and the order of the channels; exchange them from this row on, or use the rows before it.
log-swapped_names = { $name }: move with the other channels as if their names were exchanged against { $reference }
    .remedy = Warm one of the sensors by hand and see which channel moves.
log-stuck = { $name }: stays at { $value } { $unit } for { $lasts_s } s from row { $row } on
    .remedy = Check the sensor and the recorder, and leave these rows out.
log-constant = { $name }: { $value } { $unit } in all { $rows } rows
    .remedy = Leave it out as an input; if it should have moved, check the sensor.
log-jump = { $name }: { $count ->
        [one] one jump
       *[other] { $count } jumps, the largest
    } of { $size } { $unit } from row { $row } to row { $next_row }, where { $usual } is usual
    .remedy = Heat cannot make it: check the sensor, its contact, or whether the machine was moved.
log-noisy = { $name }: a noise of { $noise } { $unit }, { FIXED($times, decimals: 0) } times that of the other channels
    .remedy = Check its shield and contact; prefer another sensor as an input, or filter more.
log-clock = the times jump by one hour at row { $row }, { $at_s } s after the start
    .remedy = If the recorder ran on, its clock was set forward (daylight saving time): export times with a zone.
log-gap = { $count ->
        [one] { $count } gap
       *[other] { $count } gaps
    } of { $lost_s } s in all, the longest of { $longest_s } s after row { $row }
    .remedy = Nothing is filled in: check that the machine did the same in a gap as around it.
log-missing = { $name }: missing in { $count ->
        [one] { $count } place
       *[other] { $count } places
    } for { $lost_s } s in all, the longest after row { $row }
    .remedy = Nothing is filled in; rows without an input or output are left out of the fit.
log-quantised = { $name }: values come in steps of { $step } { $unit }
    .remedy = Take block means of many rows, here and in the running compensation, or a finer output of the sensor.
log-held = { $name }: values change every { $rows } rows only: the recorder holds them for about { $lasts_s } s
    .remedy = Choose a sample time of at least { $lasts_s } s.
log-rare = { $name }: seen { $count } times for about { $lasts_s } s
    .remedy = It is used where it was measured, and not interpolated.
log-uneven = { FIXED($percent, decimals: 0) }% of the times between rows differ from the usual { $usual_s } s by more than a fifth
    .remedy = Choose a sample time of several usual steps: block means make the times even.
