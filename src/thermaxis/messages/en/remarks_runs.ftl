### What was noticed when the file of a run was read

remark-of_file = { $said }
remark-not_utf8 = the file is not UTF-8: its texts were read as { $encoding }, numbers are not affected
remark-characters_lost = the file is not UTF-8: its texts were read as { $encoding }, numbers are not affected; { $count ->
        [one] { $count } character
       *[other] { $count } characters
    } could not be read in this way ({ $where }): name the right encoding to see them, with --encoding on the command line or fallback_encoding in Python
remark-utf16_without_mark = the file is UTF-16 without a byte order mark, and was read as such
remark-no_line_end = the last line of the file has no line end: check that the file is complete
remark-cells_beside = cells to the right of the headings were left out
remark-columns_left_out = columns without numbers were left out: { $names }
remark-channels_with_unit = kept as channels: { $names }
remark-channels_kept = kept as channels without unit: { $names }
remark-rows_left_out = { $count ->
        [one] row { $rows } of the file holds no reading and was left out: { $names }
       *[other] rows { $rows } of the file hold no readings and were left out: { $names }
    }
remark-blocks_joined = the readings stand in { $blocks ->
        [one] one block
       *[other] { $blocks } blocks
    } below words that say the pass: they were joined
remark-transposed = the headings stand in the first column: rows and columns were exchanged
remark-thousands_removed = the decimal sign is the { $sign }: signs between thousands were taken off { $count ->
        [one] one number
       *[other] { $count } numbers
    }
remark-beyond_travel = most deviations are larger than the whole travel: check that { $unit } were made of the right unit
remark-cycles_empty = { $count ->
        [one] cycle
       *[other] cycles
    } without any reading: { $cycles }
remark-readings_missing = { $missing } of { $stops } readings are missing: { $names }

## Order and times

remark-order_incomplete = some readings have no order number: the column order is not used
remark-times_incomplete = some readings have no time: the column of times is not used
remark-order_counted_anew = the order numbers were counted anew from 1
remark-times_against_order = the times do not rise with the order numbers: the run has no time axis
remark-times_out_of_line = the times rise from row to row, but { $text } in { $where } lies { FIXED($off, decimals: 0) } s outside those of the rows beside it{ $more ->
        [0] {""}
        [one] , and one more does so
       *[other] , and { $more } more do so
    }: if it is a typing error, correct it
remark-same_times = some readings have the same time: only their order in the file is used, and the run has no time axis
remark-same_times_unordered = some readings have the same time and no order is stated: times are not used
remark-order_of_cycle_unknown = the file does not state the order of visits of a { $cycle } cycle: readings have no time
remark-times_interpolated = times are interpolated: the file states the start and the end of the run, to the minute, and the readings were spread evenly between them in the order of the standard cycle
remark-times_in_intervals = several readings have the same time, which is stated to { FIXED($interval_s, decimals: 0) } s: each lies within that interval, and they were spread evenly over it in their order
remark-past_midnight = the times of day pass midnight: what follows was taken as the next day
remark-clock_unclear = the times of day neither rise nor lie within twelve hours: they are not used
remark-times_not_stated = the file gives no time of the readings: only their order is known
remark-start_and_end_unclear = the start and end in Date Time are not understood: { $text }
remark-ends_before_start = the run ends before it starts: { $text }
remark-same_minute = the run starts and ends in the same minute

## Passes, directions and targets

remark-directions_from_targets = no column says the direction: it was taken from the order in which the targets were visited
remark-directions_from_runs = directions come from the run numbers: odd runs are forward, even runs are backward
remark-runs_not_alternating = every run has one direction only and the directions do not alternate with the run numbers: each run is a cycle of its own, without readings in the other direction
remark-runs_paired = runs { $run } and { $second } are cycle 1, runs { $third } and { $fourth } cycle 2, and so on
remark-order_from_runs = odd runs were taken as forward and even runs as backward; the order of the readings was deduced from the run numbers
remark-order_from_passes = the order of the readings was deduced from the numbers of the passes in the headings, as a standard test cycle takes them
remark-one_direction = the file has { $direction } readings only
remark-no_flags = the file has no Flags: the run was taken as bidirectional
remark-wide_targets_falling = the file lists the targets in falling order: the runs called forward travel in the negative direction
remark-rtl_targets_falling = the targets are listed from the largest to the smallest: the odd runs, called forward, travel in the negative direction of the axis
remark-dat_targets_falling = the targets are listed from the largest to the smallest: forward is what the file calls forward, and probably travels in the negative direction of the axis
remark-rows_against_travel = the rows of { $count ->
        [one] run
       *[other] runs
    } { $runs } are not in the order of travel (first in line { $line }): the acquisition order was taken from run and target numbers
remark-forward_downwards = the rows of the forward passes run downwards: if they stand in the order of measurement, the directions are named the wrong way round (neither an order nor times are stated)
remark-both_downwards = the rows of the forward passes run downwards and those of the backward passes upwards: if they stand in the order of measurement, the directions are named the wrong way round (neither an order nor times are stated)
remark-targets_merged = { $targets } target positions were taken as { $fewer } targets: within one they differ by up to { FIXED($largest, decimals: 6) } mm or deg
remark-through_a_turn = the travel passes 360°: the targets rise from { $begin }° through 360°, so a turn was added to { $moved } of them ({ $before }° is { $after }°)

## Deviations

remark-turns_taken_off = whole turns were taken off the measured position of { $count } readings
remark-deviations_disagree = the column of deviations disagrees with measured minus target in { $count } readings, first in { $where } ({ $stated } and { $computed }): measured minus target is used
remark-not_measured = { $count ->
        [one] { $count } reading has
       *[other] { $count } readings have
    } no measured position, first in { $where }: there the column of deviations is used
remark-unit_elsewhere = the column { $name } states no unit: { $unit } was stated elsewhere
remark-unit_assumed = no unit of the deviations is stated: { $unit } was assumed; to state it, write a line '# unit: { $word }' above the headings, or head the runs as run_1_{ $word }
    .short = no unit of the deviations is stated: { $unit } was assumed
remark-columns_of_no_run = columns that hold no run were left out: { $names }

## Sections and environment

remark-section_unknown = the section { $section } is not known and was not read
remark-unread_behind_eof = what follows EOF:: from line { $line } on was not read
remark-no_eof = the file has no EOF::, but all readings are there
remark-section_cut = { $section } was read up to its line { $most } only
remark-lists_unknown = lists that are not known were not read: { $names }
remark-sensors_absent = { $count ->
        [one] material sensor
       *[other] material sensors
    } { $sensors } marked absent
remark-reduced_to_20_c = the environment factor of the file holds the expansion of the material: the deviations are already reduced to 20 °C, with { $reduction }, and must not be corrected for temperature again (the rule was found from one published file)
remark-air_impossible = at the { $moment } of the run the air cannot have had the values stated: { $values }
remark-factor_off = the environment factor at the { $moment } of the run is { $off_ppm } ppm off what air, material and expansion coefficient give: check the sensors and values entered by hand
