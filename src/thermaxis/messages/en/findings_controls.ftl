### What looks wrong or would surprise in a control's table

finding-line_ended_by_return_alone = The line is ended by a carriage return alone, without a line feed: a control may take it and the next for one line, or refuse the file; save it with the control's own ends of lines.
finding-byte_order_mark_first = The file begins with a byte order mark, which a control may not skip.
finding-letters_outside_ascii = The line has letters outside of ASCII, which a control may not read.

## A table beside a run

finding-axis_of_run_differs = The table is of axis { $axis }, the run of { $of_run }: if these are two names of one axis, say --axis { $axis }.
finding-axis_differs = The table is of axis { $axis }, not of { $wanted }.
finding-points_not_read = The file seems to hold { $in_file } points, the control reads { $points } of them.
finding-targets_not_covered = The table reaches from { $first } to { $last } { $unit } and does not cover { $outside } of { $targets } targets, from { $first_outside } to { $last_outside } { $unit }: there its end values are held.
finding-sign_wrong = The sign is wrong for this run: with the table the range of the mean deviations goes from { FIXED($before, decimals: 2) } to { FIXED($after, decimals: 2) } { $unit } ({ FIXED($times, decimals: 1) } times); the opposite sign would leave { FIXED($opposite, decimals: 2) } { $unit }.
finding-does_not_fit = The table does not fit this run: with the table the range of the mean deviations goes from { FIXED($before, decimals: 2) } to { FIXED($after, decimals: 2) } { $unit }; the opposite sign would leave { FIXED($opposite, decimals: 2) } { $unit }.

## Fanuc

finding-unread_behind_end = What follows this % is not read.
finding-simulated_linear = The table is simulated as linear between the points; a control that puts out each value at once adds up to { $most } { $unit } [S].
finding-points_comment_unreadable = The comment on the points is no longer readable.
finding-comment_of_other_reference = The comment of the file has the reference position at { $reference }.
finding-reference_unknown = The file does not state the reference position: 0 is taken; state --set reference_coordinate if it is elsewhere.
finding-second_table_not_simulated = The file has a second table (3626), which is not simulated: state --set bidirectional=1 if the control uses it.
finding-turn_ends_differ = The first and the last point of the turn differ.
finding-turn_adds_up = The values of a turn add up to { $sum }, not to 0: the position shifts with every turn.
finding-backlash_beside_second_table = The backlash (1851) acts beside the second table: it should be 0 [M].
finding-no_axis_number = The parameters have no axis number.
finding-axis_by_number = Axis number { $number } is taken for { $axis }: state --set axis_number if the axes of the control count otherwise.
finding-comment_of_other_axis = The comment names axis { $axis }, and axis number { $number } is usually { $usual }: check it, and state --set axis_number.

## HEIDENHAIN

finding-other_axes_not_simulated = Columns of other axes are not simulated: { $axes } (sag and cross compensation).
finding-axis_by_column = The table's name has no axis: column { $axis } is taken for its own.
finding-no_power_of_two = The distance { $spacing_mm } is not 0.0001 mm times a power of two.

## LinuxCNC

finding-reading_stops = '{ $text }' is not three numbers: LinuxCNC stops reading here and reports nothing; { $points } points are read, { $left } behind it are left out.
finding-reading_stops_at_comma = '{ $text }' has a decimal comma: LinuxCNC stops reading here and reports nothing; { $points } points are read, { $left } behind it are left out.
finding-passed_over = '{ $text }' behind the three numbers is passed over.
finding-passed_over_by_return = '{ $text }' behind the three numbers is passed over. To LinuxCNC a carriage return ends no line. End every line by a newline.
finding-value_off_neighbours = The { $side } value { $value } lies { $off } { $unit } from what its neighbours suggest: a typing error?
finding-more_values_off = { $count } more values lie far from their neighbours.

## SINUMERIK

finding-index_twice = Index { $index } appears twice, first in line { $first_line }: the control takes the last one.
finding-more_values_twice = { $count } more values appear twice.
finding-not_activated = The file does not set MD32700 ENC_COMP_ENABLE: set it to 1 for the table to act.
finding-activation_off = The file sets ENC_COMP_ENABLE to 0: its table does not activate itself: set MD32700 to 1.
finding-activates_itself = The file activates its table by itself.
finding-other_encoder = The table is for encoder { $encoder } of the axis.
finding-modulo_not_written = IS_MODULO is not written: the control keeps what it holds.
finding-modulo_differs = IS_MODULO is { $value }; the table is read with --set modulo={ $modulo }.
finding-modulo_though_linear = The file calls its axis modulo, the run is of a linear one.
finding-line_passed_over = '{ $text }' is passed over.
finding-more_lines_passed_over = { $count } more lines are passed over.
