### What the user of a compensation table must know

## The run

warning-axis_assumed = Neither the run nor --axis names the axis: { $axis } was assumed. Check it.
warning-axis_name_unusable = The run names its axis '{ $stated }', which is no name of an axis on a control: { $axis } was assumed. Check it, or give --axis.
warning-axis_of_table_unnamed = The table does not name its axis: whether both are of the same axis was not checked.
warning-axis_of_run_unnamed = The run does not name its axis: whether both are of the same axis was not checked.
warning-axis_of_run_unusable = The run names its axis '{ $stated }', which is no name of an axis on a control: whether both are of the same axis was not checked.
warning-drift_left_out = --no-drift leaves the drift model out.
warning-drift_unknown = Whether the run drifts is not known: { $cause }
warning-drift_in_levels = The run drifts: the whole axis by { SIGNED($total, decimals: 2) } { $unit }, and its length by { SIGNED($per_m, decimals: 1) } { $unit } per 1000 { $position_unit }; the measured mean deviations differ from those without drift by up to { FIXED($apart, decimals: 2) } { $unit }: consider --drift-free.
warning-drift_not_removed = The run drifts: the whole axis by { SIGNED($total, decimals: 2) } { $unit }, and its length by { SIGNED($per_m, decimals: 1) } { $unit } per 1000 { $position_unit }: no table removes that; see the figures without drift.
warning-temperature_of_run = Temperature of the run: { $temperature }.

## What was in force

warning-no_table_in_force = The run counts as measured without any table in force; if one was, give it with --merge.
warning-not_in_force_during_run = The run counts as measured without this table in force; if it was in force, what the run shows is what the table leaves, and the column before says it.
warning-older_table_lost = The new points are too few for the older table: up to { FIXED($lost, decimals: 2) } { $unit } of it are lost between them, { FIXED($lost_at_point, decimals: 2) } { $unit } at its point at { $position } { $position_unit }; leave --points and --spacing out.
warning-reversal_counts_as_zero = The reversal value of the control (MD32450, 1851) counts as 0 during the run; if it was not, give --backlash-in-force: the file replaces it.
warning-reversal_may_be_ignored = The reversal value of the control counts as 0 during the run; if it was not, and this table makes the control ignore it (BACKLASH of the joint on LinuxCNC) or asks for 0 (1851 on Fanuc with two tables), give --backlash-in-force: what it corrected comes back otherwise.
warning-reversal_in_points = The reversal value that the control had during the run is in the points now: set it to 0 on a control that does not ignore it beside a table.
warning-reversal_differs = The older table states a reversal of { SIGNED($of_table, decimals: 3) } { $unit }, --backlash-in-force { SIGNED($stated, decimals: 3) } { $unit }: the latter counts as in force during the run.
warning-reference_taken = The file of the older table does not state its reference point: { $position } { $position_unit } was taken, where it is zero. If the axis has another one, give --reference.
warning-zero_moves = The older table is { SIGNED($value, decimals: 2) } { $unit } at { $position } { $position_unit }, the new one zero: all positions of the axis move by as much against what was set with the older table, zero points of workpieces included.

## The table

warning-steep = The deviations change by { $slope } { $unit } from { $low } to { $high } { $position_unit }: check the unit of the run, few axes are that wrong.
warning-large = The deviations reach { $largest } { $unit }: check the unit of the run, few axes are that wrong.
warning-points_outside_targets = Points of the table lie outside the targets, which reach from { $first } to { $last } { $position_unit }: the first of them continues the line through the last target where it is long enough, else its value is held; nothing was measured there: { $points }.
warning-table_ends_within_targets = The table reaches from { $first } to { $last } { $position_unit } only: outside it the control holds the end values.
warning-nothing_gained = The simulated table does not make the measured deviations smaller: do not use it.
warning-sign_to_be_proven = A wrong sign doubles the error: load the table, measure two points with and without it, and only then use it.
warning-drift_stays = A table removes the systematic deviations at the thermal state of the run; it does not remove drift.
warning-table_not_in_force = The table is not in force: nothing was sent to the control or activated.
