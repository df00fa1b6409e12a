### Errors of controls: options, NC programs and compensation tables

## Options of a control

error-unknown_control_option = The control has no option '{ $name }' for its { $purpose }.
    .remedy = Its options, with their defaults, are: { $known }. One of them without a value shows its meaning.
error-option_without_value = The option has no value. { $meaning }
    .remedy = Write NAME=VALUE.
error-not_whole_number = { $value } is not a whole number.
error-unknown_axis = '{ $name }' is not an axis of the control.
    .remedy = Give --axis with one of { $known }.
error-axis_name_unfit = '{ $name }' cannot be the name of an axis of { $control }.
    .remedy = Name the axis as the machine does, such as X.
error-program_name_unfit = '{ $name }' cannot be the name of a program.
    .remedy = Write up to 16 letters, digits, - and _.

## NC programs

error-feed_too_small = A feed of { $feed } { $unit } is too small to be written.
    .remedy = Plan a feed of at least 0.001.
error-feed_too_large = A feed of { $feed } { $unit } is more than the { $largest } of the control's word F.
    .remedy = Plan a lower feed.
error-dwell_too_long = A stop of { $stop_s } s is longer than the { $longest_s } s of { $word }.
    .remedy = Plan a shorter dwell.
error-overrun_too_short = The overrun is shorter than the { $decimals } decimals that the control reads.
    .remedy = Plan a wider overrun.
error-position_too_large = A position is larger than the { $largest } that the control's word can hold.
    .remedy = Check the unit of the targets.
error-too_many_repetitions = { $repetitions } repetitions of { $block } are more than the { $most } of one call.
    .remedy = Plan fewer.
error-program_number_too_high = The last subprogram would be O{ $last }, beyond O{ $highest }.
    .remedy = State a lower number, or plan fewer targets for the step cycle.
error-source_without_switch = The plan does not say how the program switches this source.
    .remedy = State switch = {"{"} kind = "spindle" {"}"}, or the kind "axis" or "function", and plan the test again.
error-no_such_spindle = The program can name { $most } of the spindles of this control.
    .remedy = Switch it by an M function or as an axis.
error-axes_together = Two axes would move at the same time.
    .remedy = Lower most_at_once, or state one of them as an M function, and plan the test again.
error-feed_too_slow = Going to and fro once takes { $round_s } s, longer than the step.
    .remedy = Shorten its way, or raise the feed.
error-too_many_labels = The program needs more than the { $most } labels of the control.
    .remedy = Plan fewer targets for the step cycle, or the standard cycle.

error-surface_outside_search = The surface at { $surface_mm } mm does not lie between { $start_mm } and { $end_mm } mm, at least { $least_mm } mm from both.
    .remedy = Begin further away (--from), or search further.

## Tables to be written

error-too_many_table_points = The table has { $points } points; { $control } reads at most { $most }.
    .remedy = Ask for --points { $most } or fewer, or a wider --spacing.
error-too_few_table_points = The table needs at least two points.
error-points_not_equidistant = The control reads equidistant points only.
    .remedy = Give --points or --spacing.
error-one_value_per_point = { $control } has one value per point, and the table has one for each direction.
error-points_too_fine = A point of the table has more than the { $decimals } decimals of the control.
    .remedy = Give --points or --spacing, which are rounded to them.
error-points_fall_together = Two points fall together at { $decimals } decimals.
error-interval_too_fine = The interval { $interval } has more than { $decimals } decimals.
    .remedy = Give --spacing with { $decimals } decimals at most.
error-rounded_steps_off = Rounded to { $decimals } decimals the steps end { $off } { $unit } off the last point.
    .remedy = Give --spacing with few decimals.
error-spacing_no_power_of_two = The distance { $spacing_mm } is not 0.0001 mm times a power of two.
    .remedy = Give --spacing { FIXED($below_mm, decimals: 4) } or { FIXED($above_mm, decimals: 4) }.
error-value_wider_than_column = { $value } is larger than the { $largest } that a column of the table holds.
    .remedy = Check the unit.
error-modulo_of_linear_axis = Only a rotary axis is modulo.
error-modulo_table_unfit = The table of a modulo axis begins at the reference position, spans at most one turn, and its interval divides the turn.
    .remedy = Give --reference with the first target and such a --spacing.
error-turn_not_covered = The table of a modulo axis spans one turn; this one spans { $span_deg } deg.
    .remedy = Measure targets from 0 to 360 deg and give a spacing that divides the turn.
error-turn_not_closed = The corrections at the start and at the end of the turn differ: each turn would shift the axis.
    .remedy = Leave out the target at 360 deg: it is the same place as that at 0 deg.
error-no_reference_position = The table has no reference position.
    .remedy = State the machine coordinate of the reference position.
error-other_reference_position = The table is zero at { $stated }; the reference position of the control is { $reference }.
    .remedy = Give --reference { $reference }.
error-no_point_at_reference = No point of the table lies at the reference position { $reference } { $unit }.
    .remedy = Give --reference with that position, or --spacing that leads to it.
error-reference_needs_comment = Without comments the file cannot state the reference position.
    .remedy = State --set reference_coordinate={ $reference } too when the file is read again.
error-reversal_too_large = The reversal of { $reversal_units } detection units is beyond the { $largest_units } of parameter 1851.
    .remedy = Check the unit of the run.
error-too_many_point_numbers = The table takes { $points } point numbers; there is room for { $most }. The way to the reference position counts.
    .remedy = { $spacing ->
        [0] Ask for fewer points or a wider --spacing.
       *[other] Give --spacing { FIXED($spacing, decimals: 3) } or wider.
    }
error-point_numbers_outside = The point numbers would be { $first } to { $last }; they are 0 to { $highest }.
    .remedy = State another number of the reference position, or highest_point.
error-increment_too_large = An increment of { $increment } is larger than the { $largest } that a point can hold, with the magnification { $magnification }.
    .remedy = Ask for more points; or --set largest_value=127 on a newer control, or another magnification.

## Tables to be read

error-table_cut_short = The last line is not { $end }: the table is cut short.
    .remedy = Copy the whole file.
error-table_line_too_long = The line is longer than { $most } characters.
    .remedy = Name the file of the table alone.
error-table_line_empty = The line is empty within the table.
    .remedy = Delete the line.
error-table_line_has_tab = The line has a tab, and columns are known by their places.
    .remedy = Put spaces in place of the tabs.
error-table_decimal_comma = '{ $text }' has a decimal comma, which the control does not read.
    .remedy = Write decimal points.
error-not_a_whole_word = '{ $text }' is not a whole number.
    .remedy = Write the value in steps of the control, digits only.
error-number_too_large = '{ $text }' is larger than { $largest }.
    .remedy = Check unit and digits.
error-number_not_loadable = A value is not a finite number of at most { $largest }.
    .remedy = Never load this table.
error-byte_order_mark = LinuxCNC reads no point of this file: its first line begins with a byte order mark.
    .remedy = Save it as plain ASCII text, without a byte order mark.
error-first_line_no_triplet = LinuxCNC reads no point of this file: its first line is not three numbers.
    .remedy = Write nominal, forward and reverse from the first line on, without a head.
error-line_ended_by_return = The line is longer than { $most } characters: a carriage return does not end a line for LinuxCNC.
    .remedy = End every line by a newline.
error-first_line_unfit = The first line is not { $form }.
    .remedy = Give a table of this control, or name another control.
error-table_not_in_mm = The table is in { $unit }, not in MM.
    .remedy = Convert it to millimetres.
error-headings_missing = The second line lacks the headings { $headings } and the axes.
    .remedy = Restore the headings.
error-heading_stated_twice = A heading appears twice.
    .remedy = Correct the headings.
error-axis_heading_missing = No column of an axis has a heading.
    .remedy = Restore the headings.
error-axis_not_named = The name of the table has no axis, and its columns are { $columns }.
    .remedy = Name it AXIS-X.COM or AXIS_X.COM in its first line.
error-other_axis_columns = The table is named for axis { $axis }, and its columns are { $columns }.
    .remedy = Give the table of this axis; columns of other axes are cross compensation.
error-table_without_rows = The table has no rows.
    .remedy = Give the whole table.
error-too_many_rows = The control reads at most { $most } rows, and this is one more.
    .remedy = Write a table of at most { $most } points.
error-row_without_number = The row begins with '{ $text }' instead of its number.
    .remedy = Number the rows from 0 up.
error-row_out_of_order = This row has the number { $number } where { $expected } comes next: a row is missing, doubled or moved.
    .remedy = Number the rows from 0 up without a gap.
error-row_too_short = The row lacks its position or its value.
    .remedy = Write number, position, value.
error-row_value_missing = The row has no value in this column.
    .remedy = Write it; BACKLASH is filled in every row or in none.
error-rows_not_equidistant = The position { FIXED($position, decimals: 4) } of row { $row } should be { FIXED($expected, decimals: 4) } by DATUM and DISTANCE: the rows are not equidistant.
    .remedy = Write the table again on equidistant points.
error-position_not_rising = The position { $position } does not follow { $before }: positions must rise.
    .remedy = Sort the rows by their positions and remove repeated ones.
error-positions_too_near = The position { $position } lies nearer than { $nearest } to the one before.
    .remedy = Remove one of the two lines.
error-value_without_heading = '{ $text }' is in no column of its own.
    .remedy = Put each number under its heading.
error-lines_behind_end = Lines follow the end of the table.
    .remedy = Delete them.
error-other_table_type = The table was read as type { $stated }, and its values look like those of type { $other }: read so, the deviations would be as large as the positions.
    .remedy = State --set type={ $other }, as COMP_FILE_TYPE of the machine does.
error-no_assignment = '{ $text }' is not an assignment that the control reads.
    .remedy = Write it as $AA_ENC_COMP[0,5,X1]=0.001.
error-no_point_index = '{ $text }' is not the index of a point.
    .remedy = Write whole numbers from 0 on.
error-no_encoder_table = The file has no $AA_ENC_COMP table.
    .remedy = Give the file of one axis' encoder error compensation.
error-several_tables = The file has { $count } tables: { $tables }.
    .remedy = State which one is meant, such as --set table=1.
error-assignment_missing = { $name } of axis { $axis } is missing.
    .remedy = Write STEP, MIN and MAX into the same file.
error-max_not_reached = MAX is not MIN + { $steps } * STEP = { $reached }: it is off by { $off }.
    .remedy = Points are missing or too many, or one of the three numbers is wrong.
error-table_of_one_point = The table has only one point.
    .remedy = Write all points.
error-table_point_missing = Point { $point } is missing: the control would keep its old value.
    .remedy = Write every point.
error-no_parameter_file = The file does not begin with %.
    .remedy = Give a Fanuc parameter file.
error-no_parameter_line = '{ $text }' is not a line of a parameter file.
    .remedy = Write N with the number and P with the value.
error-word_stated_twice = { $name } appears twice, first in line { $first_line }.
    .remedy = Delete one of them.
error-no_pitch_error_table = Parameter 3620 is missing: the file has no pitch error compensation.
    .remedy = Give a file with the parameters 3620 to 3624 and the points N10000 and on.
error-several_axes = The file has the axes { $axes }.
    .remedy = State one with --set axis_number=NUMBER.
error-other_axis_number = The file is for axis { $axes }, not for { $wanted }.
    .remedy = Give the file of this axis, or another axis_number.
error-parameter_missing = The parameter of the axis is missing.
    .remedy = Give the whole file.
error-no_second_table = The file has no second table.
    .remedy = Leave --set bidirectional=1 out, for a new table beside this one too.
error-turn_not_360 = The turn is not 360 deg.
error-turn_not_spanned = The points of a turn do not begin at 3620 and span 360 deg.
error-points_miss_reference = The points { $first } to { $last } do not lead to the reference point { $reference_point }.
error-point_value_too_large = The value { $value } is beyond the { $largest } that a point can hold.
    .remedy = State --set largest_value if the control holds more.
