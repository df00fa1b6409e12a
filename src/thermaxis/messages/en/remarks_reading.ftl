### What was noticed when a thermal log was read or joined

remark-heading_cut = the heading of column { $column } was cut to its first characters
remark-values_beyond = column { $name }: { $count } values beyond 1e9 in magnitude are no measured values and count as missing
remark-word_in_cells = '{ $word }' stands in { $count ->
        [one] one cell that should hold a number: it counts
       *[other] { $count } cells that should hold numbers: they count
    } as missing
remark-line_cut_short = the last line of the file is cut short and was left out
remark-variables_left_out = variables that are not as long as the times were left out: { $names }
remark-values_no_measurement = { $count } values of { $name } are no measurement, such as { $example }: they count as missing (rows { $row } to { $last })
remark-rows_masked = masked as asked for: { $rows } rows of { $name }, from { $row } to { $last }, count as missing
remark-all_rows_masked = masked as asked for: { $rows } rows of all channels, from { $row } to { $last }, count as missing
remark-rows_stuck = { $name } stays at { $value } { $unit } for { $lasts_s } s while it should have moved: { $rows } rows, from { $row } to { $last }, count as missing
remark-touches_repeated = { $name } shows { $touches } values in { $rows } rows, as where a control repeats the last touch of a probe, and each row counts as measured: where these are touches, keep the first row of each value alone and empty the others (record: counter_node)
remark-displacement_joined = { $name } leaps by { $size } ± { $within } { $unit } at row { $row }, { $at_s } s after the start, which heat cannot do (a probe set to zero, a machine moved): the rows from there on were carried on from the zero before
remark-displacements_late = { $names } follow the temperatures as if stamped { $shift_s } s too late: they were shifted back; where the machine itself answers so late, keep them by --as-logged
remark-displacements_early = { $names } go before the temperatures as if stamped { $shift_s } s too early: they were shifted on, by more than sensors away from the heat are late
remark-displacements_seem_late = { $names } follow the temperatures as if stamped { $shift_s } ± { $within_s } s too late: nothing was shifted (identify does, from 400 s on and without --delay); compare the clocks of the recorders (heat that has a way to go does the same)
remark-displacements_seem_early = { $names } go before the temperatures as if stamped { $shift_s } ± { $within_s } s too early: nothing was shifted (identify does, from 400 s on and without --delay); compare the clocks of the recorders (sensors away from the heat do the same)
remark-channel_drifts = a sensor seems to drift steadily, one of { $sensors } over the log, or else { $output } itself, by { SIGNED($um_per_h) } ± { $within_um_per_h } um/h: with such a rise the record is much more likely (it is used as it is; check them against another sensor)

## Order and times

remark-seconds_assumed = column { $column } states no unit: taken as seconds, so that the log lasts { $lasts }; state another one by its heading (time_min) or a mapping (time.unit)
remark-rows_without_time = { $count } rows have no time and were left out
remark-rows_in_bursts = rows come in bursts of about { $rows } every { $step_s } s: a model is learnt from means over such a time
remark-rows_turned_round = the rows run from the latest to the earliest: they were turned round
remark-midnights_passed = the times of day state no date: they were carried on past midnight (times passed: { $count })
remark-times_repeated = { $count } rows have the time of another row, the first of them { $at_s } s after the start: of each column the first value counts
remark-clock_too_coarse = { $count } rows have the time of another row, the first of them { $at_s } s after the start: of each column the first value counts; the clock is too coarse for this recorder, and most readings are lost
remark-rows_sorted = { $count } rows are out of order of time: the rows were sorted by time
remark-rows_sorted_in = { $count } rows were out of order of time and were sorted in
remark-rows_repeat_times = { $count } rows from row { $row } on repeat times that were there before (the clock went back by { $back_s } s): they were left out
remark-clock_set_back = the clock was set back by { $back_s } s at row { $row }: later times were carried on by the usual step of { $usual_s } s
remark-clock_set_back_one_hour = the clock was set back by { $back_s } s at row { $row } (one hour): later times were carried on by the usual step of { $usual_s } s
remark-daylight_saving_ended = the clock was set back by { $back_s } s at row { $row } (one hour, as at the end of daylight saving time): later times were carried on by the usual step of { $usual_s } s

## Two recorders

remark-joined_by_shift = { $log } was joined with the given shift of { $shift_s } s
remark-joined_by_channels = { $log } was joined with a shift of { $shift_s } s, found from { $names } (known within { $within_s } s, correlation { FIXED($correlation, decimals: 4) })
remark-joined_by_times_of_day = { $log } was joined by the times of day: no channel is common to check them
remark-columns_renamed = columns of { $log } were renamed: { $names }
