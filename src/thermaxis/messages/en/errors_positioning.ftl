### Errors of runs, figures, drift, uncertainty, plans and tables of positioning

## Runs

error-no_readings = The run has no readings.
error-value_missing_for_reading = A value is missing for a reading that was measured.
error-time_source_unfit = Times and order do not fit the time source { $time_source }.
error-too_few_targets = { $targets } targets with readings are too few; at least { $needed } are needed.
error-too_few_cycles = { $cycles } cycles are too few; at least { $needed } are needed.
error-too_few_at_target = Target { $target } at { $position } { $unit } has { $readings } readings { $approach }; { $needed } are needed.
    .remedy = Measure the missing stops, or leave this target or approach out.
error-readings_without_times = The readings have no times.
    .remedy = Leave the reference time out; a cycle can be chosen by its number.

## Adjacent differences

error-cycle_without_reference = Cycle { $cycle } has no reading at position { $position } in every approach.
    .remedy = Choose another cycle.
error-no_cycle_after = No cycle with a reading at position { $position } starts after { $time_h } h.
    .remedy = The run lasts { FIXED($duration_h, decimals: 2) } h; choose an earlier time.
error-reference_never_read = Position { $position } was never read in every approach of one cycle.
    .remedy = The chart cannot be anchored; measure the missing stops.
error-no_pair = No cycle has readings { $approach } at both positions { $position } and { $next }.
    .remedy = The adjacent differences cannot be formed; measure the missing stops.

## Drift

error-too_few_readings = { $readings } readings at { $targets } targets are too few to tell drift from noise.
    .remedy = Measure more targets or more cycles.
error-readings_repeat_exactly = The readings of every target repeat without any scatter: nothing tells their noise, so no U, spread or drift is evaluated.
    .remedy = Check the resolution and the source of the file: no machine does that.
error-no_order = The order in which the readings were taken is not known.
    .remedy = Give the file a column 'time_s', 'time' or 'order'.
error-one_time = All readings have the same time.
    .remedy = Correct the times of the file.
error-reference_outside_run = { $reference_h } h lies outside the run, which ends at { $end_h } h.
    .remedy = Choose a time within the run; a drift is not extrapolated.

## Uncertainty

error-instrument_twice = The instrument is stated by its expanded uncertainty and by its range of errors.
    .remedy = State one of them, else it counts twice.
error-no_expansion_coefficient = The expansion coefficient is stated neither in the budget nor in the run.
    .remedy = State it beside the interval of the material's temperature.
error-no_material_temperature = The material's temperature is stated neither in the budget nor in the run.
    .remedy = State the largest difference to 20 °C beside the interval of the expansion coefficient.
error-linear_axis_only = A rotary axis has no such contribution.
    .remedy = Leave it out: angles neither expand nor have a length.

## Plans

error-targets_not_rising = The targets are not strictly increasing at three decimals.
    .remedy = Take a wider interval or a smaller random part.
error-no_approaches = The approaches are not forward, backward, or both in this order.
error-too_many_stops = The run would have { $stops } stops, more than { $most }.
    .remedy = Ask for fewer cycles or targets.
error-no_axis_name = '{ $name }' is no name of an axis.
    .remedy = Write a letter and up to 15 letters, digits or underscores, such as X or B1.
error-title_too_long = The title has { $characters } characters, more than { $most }.
error-title_not_printable = Character { $at } of the title, { $character }, cannot be printed.
    .remedy = Write letters, digits, signs and plain spaces in one line.
error-random_share_outside = A random part of { $share } is not from 0 to less than half the interval.
    .remedy = Neighbouring targets must not change places.
error-targets_change_places = { $targets } targets do not keep their order within { $length }.
    .remedy = Take fewer targets or a smaller random part.
error-too_many_moves = The program would spell out { $moves } moves, more than { $most }.
    .remedy = Ask for fewer cycles or targets, or for the standard cycle.
error-drift_and_levels_alike = { $readings } readings of { $levels } targets and approaches cannot tell drift from the errors of the axis.
    .remedy = Plan more cycles.
error-too_many_levels = The covariance of { $levels } mean deviations is too large to be calculated; at most { $most } are possible.
error-figure_not_given = This plan gives no figure { $figure }.
    .remedy = B, M, E, R and A without a direction need both approaches.
error-cycles_take_longer = { $cycles } cycles already take longer than { $longest_h } h.
    .remedy = Allow more time, or plan fewer targets or a shorter dwell.

## Tables of compensation

error-points_too_near = The points lie nearer than the { $decimals } decimals that the control reads.
    .remedy = Take fewer points or a wider spacing.
error-too_many_points = { $count } points are more than { $most }.
    .remedy = Take a wider spacing.
error-axes_differ = The older table is of a { $older } axis, the run of a { $kind } one.
