### What the reader of a measured run must know

## Test conditions of ISO 230-2

warning-few_targets_linear = { $targets } targets are fewer than the { $required } that ISO 230-2 asks of a linear axis measured over { $length } mm
warning-few_targets_rotary = { $targets } targets are fewer than the { $required } that ISO 230-2 asks of a rotary axis measured over { $length }° (rule from memory)
warning-few_cycles = { $cycles } cycles, { $cycles } readings of every target, are fewer than the { $required } that ISO 230-2 asks for
warning-few_readings = target { $target } has { $readings } readings { $approach }, fewer than the { $required } that ISO 230-2 asks for
warning-many_cycles = { $cycles } cycles are more than the { $required } that ISO 230-2 asks for: the figures follow its formulas, but on a longer test, in which the machine warms up more
warning-targets_equidistant = the targets are equidistant ({ $mean } { $unit }), without the random part of equation (1): periodic errors of the axis may stay hidden
warning-interval_too_long = the largest interval between targets is { $interval } mm; ISO 230-2 asks for at most { $most_mm } mm on an axis over { $length_mm } mm
warning-interval_uneven = the interval after target { $target } ({ $interval } { $unit }) is more than twice the mean interval ({ $mean } { $unit }): the axis is sampled unevenly
warning-step_cycle = step cycle (Annex B of ISO 230-2:2014): not for acceptance unless agreed; it hides part of the drift that a standard cycle shows
warning-pilgrim_cycle = pilgrim-step cycle: not the standard test cycle of ISO 230-2; not for acceptance unless agreed
warning-readings_missing = { $count } reading(s) { $approach } are missing, the first at target { $target } in cycle { $cycle }: every target keeps its own number of readings
warning-travel_reversed = the { $approach } readings of cycle { $cycles } were not taken one after the other in this direction, as a standard test cycle does: check the directions, or name the kind of cycle
warning-cycles_interleave = readings of one cycle were taken among those of another, as in a step cycle and not in a standard test cycle: name the kind of cycle

## Adjacent differences

warning-one_cycle = one cycle only: the adjacent differences have no spread and the chart no bounds
warning-no_pair_twice = no pair has two complete cycles: the chart has no bounds
warning-pair_without_spread = positions { $position } and { $next } { $approach } have one complete cycle only: their difference has no spread
warning-student_factor = { $cycles } cycles are fewer than { $enough }: the bounds of the deviation chart are widened by Student's factor ({ FIXED($factor, decimals: 3) } in place of 2)
warning-student_factor_of_pair = { $cycles } cycles complete at positions { $position } and { $next } { $approach } are fewer than { $enough }: the bounds of the deviation chart are widened by Student's factor ({ FIXED($factor, decimals: 3) } in place of 2)
warning-anchor_outlying = the reading of position { $position } { $approach } in cycle { $cycle }, which anchors the deviation chart, lies far from the others: the whole chart is shifted; choose another reference cycle

## Drift

warning-outlier_left_out = the reading of target { $target } { $approach } in cycle { $cycle } lies { SIGNED($residual, decimals: 2) } { $unit } from the drift model: it was left out of the model and of its figures; the measured figures hold it
    .short = outlier: target { $target } { $approach } in cycle { $cycle }, { SIGNED($residual, decimals: 2) } { $unit } off; left out without drift
warning-more_outliers = { $count } more readings lie out and were left out in the same way
    .short = outliers: { $count } more, left out without drift
warning-outliers_in_model = at least { $count } more readings lie out, but at most { $most } (5 % of the readings) are left out of the model: what is stated without drift holds the others; look for what disturbs single readings
    .short = outliers: at least { $count } more, in the drift-free figures, as at most { $most } are left out
warning-most_changes = { $most } jumps are named, and no more than that are looked for: there may be others, and what is stated without drift may be wrong
    .short = jumps: { $most }, and no more than that are looked for
warning-heavy_tailed_noise = { $far } of { $readings } readings lie further than { $limit } robust standard deviations from the drift model, where { FIXED($expected) } of normal noise would: the noise has heavy tails: its standard deviation is stated as that of normal noise with the same quartiles, and the bands are those of the readings that are left; look for what disturbs single readings (a short dwell, vibration, air in the beam)
    .short = noise: heavy tails, { $far } of { $readings } readings beyond { $limit } robust standard deviations
warning-change_common = { $when } all targets jumped by { SIGNED($size, decimals: 2) } ± { FIXED($within) } { $unit }: the instrument set to zero anew or its optics touched, a slip in the machine, or coolant, a door or a drive switched; what is stated without drift is of the side of t0
    .short = jump: { $when } all targets by { SIGNED($size, decimals: 2) } ± { FIXED($within) } { $unit }
warning-change_stretch = { $when } the last target jumped by { SIGNED($size, decimals: 2) } ± { FIXED($within) } { $unit } against the first, the others in proportion: another compensation of air or material temperature, a beam or a scale set anew, or optics turned; what is stated without drift is of the side of t0
    .short = jump: { $when } the last target by { SIGNED($size, decimals: 2) } ± { FIXED($within) } { $unit } against the first
warning-change_unsure = { $when } all targets moved by { SIGNED($size, decimals: 2) } ± { FIXED($within) } { $unit } beside the drift before and after: the run cannot tell a jump from a drift over the pause; what is stated without drift is of the side of t0
    .short = pause: { $when } all targets by { SIGNED($size, decimals: 2) } ± { FIXED($within) } { $unit }
change-at = at { FIXED($time_min, decimals: 1) } min, in cycle { $cycle },
change-in_order = in cycle { $cycle }
change-in_pause = in the { FIXED($pause_min, decimals: 1) } min without a reading about { FIXED($time_min, decimals: 1) } min, before cycle { $cycle } went on, at once or slowly,
warning-order_as_time = the readings have no times: their order serves as time
warning-axis_bows = the axis bows with time: a parabola of the position was added to the drift
warning-swing_too_fast = the whole axis swings with a period of about { FIXED($time, decimals: 1) } { $unit }, { FIXED($cycles, decimals: 1) } cycles: too fast to be told surely from the mean deviations, whose uncertainties may be too small; shorter cycles would help, with fewer targets or shorter stops
warning-noise_correlated = the noise of successive readings is alike for about { FIXED($time, decimals: 0) } { $time_unit } (standard deviation of this part { FIXED($std, decimals: 2) } { $unit }), as by turbulent air or a disturbance too fast to follow: the uncertainties are widened by it, which more cycles help against, but more readings in a cycle hardly
    .short = noise: alike for about { FIXED($time, decimals: 0) } { $time_unit } in successive readings ({ FIXED($std, decimals: 2) } { $unit }), as by turbulent air; U is widened
warning-visits_hide_drift = each target was measured in a short part of the run: this order of visits hides drift in the mean deviations, and only their uncertainties show how much
warning-target_drifts_otherwise = target { $targets } drifts otherwise than the rest of the axis: the drift model does not hold there, and its bands are too narrow
warning-targets_drift_otherwise = the targets drift otherwise than by a common drift and a growth, none of them clearly alone: the drift model does not hold, and its bands are too narrow

## A run against its plan

warning-other_kind = the run was measured on a { $kind } axis; the plan is for a { $planned } one
warning-other_axis = the run names the axis '{ $axis }'; the plan is for axis { $planned }
warning-other_cycle = the run is of the { $cycle } cycle; the plan asks for the { $planned } one
warning-other_number_of_cycles = { $cycles } cycles were measured; the plan asks for { $planned }
warning-approach_not_planned = { $approach } approaches were measured without being planned
warning-approach_not_measured = the planned { $approach } approaches were not measured
warning-target_elsewhere = target { $target } is at { FIXED($position, decimals: 3) } { $unit } in place of { FIXED($planned, decimals: 3) } { $unit }
warning-more_targets_elsewhere = { $count } more targets are elsewhere than planned
warning-other_number_of_targets = { $targets } targets were measured; the plan has { $planned }
warning-targets_not_measured = { $count } target(s) planned and not measured, the first at { FIXED($position, decimals: 3) } { $unit }
warning-targets_not_planned = { $count } target(s) measured and not planned, the first at { FIXED($position, decimals: 3) } { $unit }
warning-targets_differ = targets differ from the plan: readings, order and times were not compared with it
warning-planned_readings_missing = { $count } planned reading(s) { $approach } are missing, the first at target { $target } in cycle { $cycle }
warning-order_not_known = the order of the readings is not known: order and dwell were not compared
warning-order_deduced = the order was deduced from run numbers: order and dwell were not compared
warning-order_differs = the order of the readings leaves the plan at reading { $reading }: target { $target } { $approach } in cycle { $cycle }, where target { $planned_target } { $planned_approach } in cycle { $planned_cycle } was planned; { $count } of { $readings } readings are out of their place, the dwell was not compared
warning-times_not_stated = the file does not state the time of each reading: the dwell was not compared
warning-stops_shorter = readings follow each other { FIXED($shorter_s, decimals: 1) } s sooner than planned (median): { FIXED($left_s, decimals: 1) } s are left of the planned { $planned_s } s at each stop, unless the feed was higher than { $feed } { $unit }/min
warning-stops_longer = readings follow each other { FIXED($longer_s, decimals: 1) } s later than planned (median): acceleration or recording take longer, or the stops were longer than { $planned_s } s
warning-run_paused = the run paused { $count } time(s); the longest pause, { FIXED($longest_min, decimals: 1) } min, came before target { $target } { $approach } in cycle { $cycle }

## An evaluation

warning-no_drift_model = no drift model: { $error } { $remedy }
warning-no_adjacent_differences = no adjacent differences: { $error } { $remedy }
warning-no_figures_of_other_standard = no figures of the other standard: { $error } { $remedy }
warning-cycle_of_option = the file names a { $stated } cycle, the option a { $cycle } cycle
warning-single_run_rule = the axis is longer than 2000 mm: s, R and A are not evaluated{ $cycles ->
        [one] {""}
       *[other] {" "}although { $cycles } runs exist (means of all of them)
    }; ask for them with --full
warning-draft = the digital calibration certificate is a draft: the file of --header does not state { $missing }
warning-not_in_pdf = { $count ->
        [one] { $count } character
       *[other] { $count } characters
    } in { $names } cannot be shown in the PDF; the page that --report NAME.html writes shows them in its text
warning-not_in_charts = { $count ->
        [one] { $count } character
       *[other] { $count } characters
    } in { $names } cannot be shown in the charts; there each is drawn as an empty box
