### Errors of files: runs, logs, thermal images, models, plans and settings

## Any file

error-not_a_file = This is a folder, a pipe or a device, not a file.
    .remedy = Name a file.
error-not_text = This is { $kind ->
        [picture] a picture
        [pdf] a PDF document
        [workbook] a workbook or another zip archive
        [old_workbook] a workbook of the old kind (.xls), or encrypted
        [archive] a compressed archive
        [database] a database
        [program] a program
       *[binary] a binary file
    }, not text.
    .remedy = Name the measurement file itself, or export the measurement as text.
error-unusable_encoding = '{ $name }' is not a usable text encoding.
    .remedy = Name one that contains ASCII, such as cp1250, cp1252 or gbk.
error-package_missing = Such files need the package { $package }, which is not installed.
    .remedy = Install { $package }, or export the data as CSV.

## Sizes

error-too_many_lines = The file has more than { $most } lines.
    .remedy = Export one run per file, with one row per reading or per target.
error-too_many_rows_to_read = There are more than { $most } rows.
    .remedy = Export one run per file, or split the log into several files.
error-too_many_columns = There are more than { $most } columns.
    .remedy = Export one channel per column and one row per time.
error-log_too_large = The file has more than { $most } values.
    .remedy = Split it into several files, or read it with a sample time such as 60 s.
error-too_many_cells = The sheet spans more than { $most } cells.
    .remedy = Clear the cells far from the table, or export the table as CSV.
error-too_many_groups = The file has { $groups } groups; at most { $most } are read.
    .remedy = Export the log as CSV.
error-line_too_long = The line is longer than { $most } characters.
    .remedy = Export one row per reading, target or time.

## Cells

error-row_incomplete = A number is missing: the row may be a reading that lacks it, or something that was computed from readings.
    .remedy = Write the number; if the readings end above this row, write last_row = { NUMBER($last, useGrouping: 0) } in a file for --map.
error-magnitude_too_large = The number is larger than { $most } in magnitude.
    .remedy = Check the unit and the digits.
error-not_a_whole_number = '{ $text }' is not a whole number.
    .remedy = Write digits only.
error-not_a_country = '{ $text }' is not a country. Write its two capital letters of ISO 3166-1, such as CZ.
error-formula_without_value = The formula of this cell has no stored value.
    .remedy = Open the workbook in a spreadsheet program and save it again.
error-column_of_no_numbers = The column holds something that is not a number.
    .remedy = Remove it.
error-not_start_and_end = '{ $text }' is not a value at the start and a value at the end.
    .remedy = Write two numbers with a blank between them, or the word none.

## Workbooks

error-not_a_workbook = This is { $kind ->
        [open_document] an OpenDocument file
        [archive] a zip archive
        [old_workbook] an encrypted workbook, or another file of an old kind
       *[other] another kind of file
    }, not a workbook of the kind .xlsx or .xls.
    .remedy = Save it as .xlsx without a password, or as CSV.
error-workbook_has_password = The workbook has a password.
    .remedy = Save it without a password.
error-workbook_too_large = The workbook has too many parts.
    .remedy = Save only the sheet with the measurement, or export it as CSV.
error-unpacked_too_large = The workbook unpacks to { $size_mb } MB; at most { $most_mb } MB are read.
    .remedy = Save only the sheet with the measurement, or export it as CSV.
error-part_too_large = The part { $part } of the workbook is far larger than its cells.
    .remedy = Save only the sheet with the measurement, or export it as CSV.
error-part_twice = The workbook has two parts named { $part }.
    .remedy = Save it again in a spreadsheet program.
error-unusual_workbook = The part { $part } of the workbook is written as no spreadsheet program writes it.
    .remedy = Save it again in a spreadsheet program.
error-cells_out_of_order = Rows or cells are not in rising order: some would be lost.
    .remedy = Open the workbook in a spreadsheet program and save it again.

## Tables of a run

error-run_headings_incomplete = No column headings of a positioning run were found in the first { $rows } rows; nearest to them is { $nearest }, which lacks { $missing }.
    .remedy = Name the columns cycle, direction, target_mm and deviation_um, or target_mm and the numbers of the runs (docs/files.md lists the words that are understood), or say what each holds in a file for --map, beginning with: { $start }
error-column_like_runs = The column { $name } holds numbers like those of the runs, but its heading names no run; { $count ->
        [one] it is the only one
       *[other] there are { $count } such columns
    }.
    .remedy = Give it a heading if it has none, and say what it holds in a file for --map, under [columns]: "{ $name }" = { "{" } cycle = 1, direction = "backward" { "}" }, or { "{" } leave_out = true { "}" }.
error-run_is_table = This looks like the compensation table of a control: it has no column headings of a positioning run.
    .remedy = Give the run that was measured; thermaxis check-table reads such a table. If these are readings, give their columns headings.
error-run_is_report = This is the report of the ecmc tools about a run.
    .remedy = Give the file with the readings that the tools write beside it: { $file }_ISO230.dat.
error-runs_or_targets = The headings may be the numbers of { $runs } runs above { $targets } targets, or { $runs } targets beside the numbers of { $targets } runs.
    .remedy = Write Run before each number, or transposed = false or true in a file for --map.
error-other_layout = This is a { $layout } table, not one of the other layout.
    .remedy = Read it as a { $layout } table.
error-blocks_unlike = The words above this block of readings, or its units, say something else than those of the first block.
    .remedy = Write the same above each block: its direction, its number, or both, and the same units.
error-blocks_of_other_targets = This block of readings has other targets than another one: it may be another run.
    .remedy = Write each run into a file of its own.
error-no_target_column = There is no column of target positions.
    .remedy = Name it target_mm, or target_deg for a rotary axis.
error-no_deviation_column = There is no column of deviations and none of measured positions; headings that were not understood: { $unknown }.
    .remedy = Name it deviation_um or measured_mm, or deviation_arcsec or measured_deg.
error-no_cycle_column = There is no column of cycle numbers; headings that were not understood: { $unknown }.
    .remedy = Name it cycle: 1 for the first time through all targets, 2 for the second.
error-no_direction_column = There is no column that says the direction of approach; headings that were not understood: { $unknown }.
    .remedy = Name it direction, with the words forward and backward.
error-two_columns_of_a_role = The columns '{ $first }' and '{ $second }' both look like the { $role }.
    .remedy = Rename or remove one of them.
error-not_a_direction = '{ $text }' is not a direction.
    .remedy = Write forward or backward, or + or -.
error-cycle_and_run_disagree = The cycle number does not fit the run number, and no column says the direction.
    .remedy = Add a column direction with the words forward and backward.
error-run_twice = Two columns are headed as run { $run }.
    .remedy = Number the runs 1, 2, 3 and so on, or write the direction into each heading: forward 1, backward 1.
error-run_of_other_direction = Run { $run } is headed as { $direction }, but runs alternate from forward.
    .remedy = Number the passes in the order in which they were taken, odd ones forward.
error-order_number_twice = This reading has the order number of the one in row { $first }.
    .remedy = Number the readings 1, 2, 3 in the order in which they were taken.
error-end_before_start = The end of the run is before its start, or only one of them states a zone.
    .remedy = Correct one of the two.

## Units

error-unknown_unit = The unit '{ $unit }' is not known.
    .remedy = Write one such as mm, um, deg, arcsec, degC, K or rpm.
error-unknown_length_or_angle = The unit '{ $unit }' is not known.
    .remedy = Write mm, um, nm, m, inch or uin of a length, deg, arcmin, arcsec, rad, mrad or urad of an angle.
error-unit_not_stated = No unit is stated.
    .remedy = Name the column { $example }, or state the units with --units, such as --units mm,um.
error-unit_implausible = No unit of the deviations is stated, and for { $unit } they are too small: the largest would be { FIXED($largest, decimals: 6) } { $unit }; in { $other } it is { FIXED($converted, decimals: 2) } { $unit }.
    .remedy = State the units of positions and deviations with --units { $other_word },{ $other_word } or --units { $other_word },{ $word }, or in the file.
error-unit_of_other_kind = The unit { $unit } does not fit the targets of a { $kind } axis.
    .remedy = Name the column { $example }, if that is its unit, or convert it.
error-unit_of_deviations = '{ $unit }' is no unit of the deviations of a { $kind } axis.
    .remedy = Write # unit: um, or # unit: arcsec, above the headings.
error-units_of_runs_differ = The runs have different units, { $first } and { $second }.
    .remedy = Give the deviations of all runs in one unit.
error-kind_and_unit_disagree = The file says that the axis is { $kind }, and this column has the unit { $unit }.
    .remedy = Correct the one that is wrong.
error-positions_not_deviations = The runs seem to hold measured positions in { $unit }, not deviations.
    .remedy = Write one reading per row, with columns of targets and of measured positions.

## Readings of a run

error-too_many_targets = There are { $targets } different target positions; at most { $most } are read.
    .remedy = Check that each target has the same position in every cycle, and export one reading per stop instead of a continuous record.
error-targets_nearly_equal = { $targets } target positions lie close together in groups, such as { $first } { $unit } and { $second } { $unit }: with a tolerance of { $tolerance } { $unit } they are { $fewer } targets.
    .remedy = If they are the same targets, each time as measured, read the file with --target-tolerance { $tolerance }; if not, with --target-tolerance 0.
error-targets_not_apart = The tolerance makes one target of { $first } { $unit } and { $second } { $unit }, which are further apart.
    .remedy = Give a smaller --target-tolerance.
error-one_target = The run has only one target position ({ $target }).
    .remedy = A positioning run needs at least two targets.
error-one_cycle = The run has one cycle; ISO 230-2 needs at least { $needed } readings per target and direction, except on a linear axis longer than 2 m.
    .remedy = Measure more cycles (ISO 230-2 asks for five), or add those of the other files to this one.
error-too_few_readings_of_target = Target { $target } has { $readings ->
        [one] { $readings } reading
       *[other] { $readings } readings
    } { $direction }, and { $others } more have too few; ISO 230-2 needs at least { $needed } per target and direction.
    .remedy = Measure the missing readings, or take the target out of the file.
error-cycle_below_one = Cycle { $cycle } is none: cycles count from 1.
    .remedy = Number the cycles 1, 2, 3 and so on.
error-table_too_sparse = { $targets } targets and cycle numbers up to { $cycles } do not fit { $readings } readings.
    .remedy = Check that each target has the same position in every cycle, and the cycle numbers.
error-too_many_channels = { $channels } columns of further readings are too many for so many targets and cycles.
    .remedy = Remove the columns that are not needed.
error-reading_twice = The reading of cycle { $cycle }, { $direction }, target { $target } was given before, in row { $first }.
    .remedy = Remove one of the two.
error-error_code_as_reading = { $count } readings are { $value } each (rows { $rows }), all others lie within { FIXED($others, decimals: 2) } of their median: an error code of the instrument, not a deviation.
    .remedy = Leave these cells empty: the readings then count as missing.
error-targets_not_in_order = Target { $target } does not follow target { $before }: targets neither rise nor fall throughout.
    .remedy = List every target once, in the order along the axis.
error-target_count = { $stated } targets are stated, but { $listed } are listed, or not each of them.
    .remedy = List every target, and state their number.
error-readings_cut_short = The file is cut short: it has { $readings } of { $expected } readings.
    .remedy = Copy or export it again; if the run was stopped early, state the number of cycles that was measured.

## Renishaw .rtl

error-no_rtl_header = The file does not begin with HEADER::.
    .remedy = Name an .rtl file as the capture software saved it.
error-section_twice = The section { $section } appears a second time.
    .remedy = Keep one measurement per file.
error-section_missing = The section { $section }:: is missing.
    .remedy = Export the measurement again.
error-not_linear_rtl = This is not a linear measurement (File type '{ $file_type }', Owner '{ $owner }'), and such a file does not state the unit of its deviations.
    .remedy = Write the readings as tidy CSV with the unit in the column name, such as target_deg and deviation_arcsec.
error-unreadable_flags = Flags '{ $text }' do not say whether the run is bidirectional (second number 0 or 1).
    .remedy = Export the measurement again.
error-unknown_run = Run { $run } does not exist: the file states { $runs } runs.
    .remedy = Export the measurement again, or correct the number.
error-unknown_target = Target { $target } does not exist: { $targets } targets are listed.
    .remedy = Export the measurement again, or correct the number.
error-words_in_row = The row has { $words } words instead of { $needed } (run, target, deviation).
    .remedy = Export the measurement again, or correct the row.
error-readings_in_return_run = Flags call the run unidirectional, but run { $run }, a return run, has readings.
    .remedy = Set the second number of Flags to 0 if the return was measured too.
error-rtl_is_linear = An .rtl file holds linear axes only.
    .remedy = Write a rotary axis as tidy CSV.
error-rtl_cycle = An .rtl file cannot state the order of visits of a { $cycle } cycle.
    .remedy = Write it as tidy CSV.
error-targets_same_when_printed = Targets are the same when printed with { $decimals } decimals of a millimetre.
    .remedy = Write the run as tidy CSV.
error-targets_too_close = Two targets are closer together than { $least } mm or deg.
    .remedy = A tidy file cannot tell them apart: remove one of them.

## _ISO230.dat

error-not_key_and_value = '{ $text }' is neither a comment nor KEY=value.
    .remedy = Start comments with #, or name an _ISO230.dat file.
error-stated_differently = { $name } is stated in line { $first } with another value.
    .remedy = Keep one of the two.
error-number_of_indices = { $name } has { $indices } indices.
    .remedy = Write TGT_DATA[target] and REF_DATA_FWD[target,cycle].
error-reading_outside_plan = There is no target { $target } in cycle { $cycle }: the file has { $targets } targets and { $cycles } cycles, stated or by default.
    .remedy = Correct the indices, or state POSITIONS and CYCLES of the run.
error-cycles_cut_short = { $stated } cycles are stated, and readings are there of { $measured } only.
    .remedy = Copy or export the file again; if the run was stopped early, set CYCLES to the number that was measured.

## Thermal logs

error-reading_option_unused = { $name } is stated, by an option or a file for --map, and has no meaning for { $what ->
        [wide] a table of one target per row
       *[other] a { $what } file
    }.
    .remedy = Leave it out.
error-times_not_apart = The times are too large to be told apart.
    .remedy = Write times in seconds from the start of the log.
error-time_too_large = The first time, { $time_s } s, is more than three thousand years.
    .remedy = State the unit of the times, such as time_ms or time_us.
error-no_vector = The file has no vector of numbers.
    .remedy = Save times and channels as numeric vectors; a table or timetable is stored in a form that only MATLAB reads.

## Thermal images

error-image_too_small = The image has { $columns } x { $rows } pixels: it is no matrix.
    .remedy = Export the matrix of temperatures in degrees Celsius as CSV, one line per row of pixels.
error-image_too_large = The image has { $columns } x { $rows } pixels or more; at most { $most_pixels }, and 100000 in a row or column, are read.
    .remedy = Export a smaller image, or average pixels.
error-no_temperature_in_image = No pixel of the image has a temperature.
    .remedy = Export the matrix of temperatures in degrees Celsius as CSV, one line per row of pixels.
error-row_of_other_length = This row has { $pixels } pixels, the first one { $expected }.
    .remedy = Make all rows equally long; leave the cell of a missing pixel empty.
error-not_radiometric = This is no radiometric JPEG of a FLIR camera: it holds no temperatures.
    .remedy = Give the camera's original file, or export the temperatures as CSV.
error-pixels_without_temperature = The thermal image of this file has pixels without a temperature.
    .remedy = Export the temperatures as CSV with the camera's own software.
error-not_an_emissivity = { $value } is no emissivity.
    .remedy = Give a number above 0, at most 1.

## Settings, models and plans

error-not_a_line = This is no printable line of at most { $most } characters.
    .remedy = Shorten it, and write it in one line.
error-list_too_long = The list has more than { $most } entries.
error-impossible_value = The value { $text } cannot be used here.
error-other_version = Version { $found } of the format is not known; this program reads version { $expected }.
    .remedy = Make the plan or identify the model again, or use a newer program.
error-hash_mismatch = The hash does not fit the content: the file was changed after it was written.
    .remedy = Restore it, or leave the hash out: the changed one has its own.
error-other_sign_convention = The sign convention is another one than this program's.
    .remedy = It must be: { $expected }
error-limits_in_model = Limits are not part of a model.
    .remedy = Write null; limits belong to the configuration of a machine.
error-targets_too_fine = The targets are stated to more than { $decimals } decimals.
    .remedy = Round them.
error-no_limits = No limit is stated.
    .remedy = Write a table for each output, such as [Z_um] with largest_um = 100.0 and largest_rate_um_per_s = 0.05, or [limits] with a line such as A_um = 12.0.
error-times_stated_twice = The column of times is stated beside the sample time.
    .remedy = Leave one of them out.
error-pass_incomplete = A column of one pass needs its cycle, from 1, and its direction.
    .remedy = Write both, such as { "{" } cycle = 2, direction = "forward" { "}" }.
error-factor_zero = The factor is zero.
    .remedy = Write leave_out = true to leave a column out.
error-other_kind_of_axis = A { $kind } axis does not have this key.
    .remedy = Leave it out, or write the one that has the unit of this axis.
error-no_uncertainty_term = No term of the uncertainty is stated.
    .remedy = Write a table [device] with a line such as expanded_uncertainty_um = 0.5.
error-number_of_regions = The file has { $regions } regions, not 1 to { $most }.
    .remedy = Write a table such as [regions.left] with x_px = [0, 20] and y_px = [0, 60].
error-edges_missing = The edges are not stated.
    .remedy = Write either _px = [from, to] or _mm = [from, to].
error-edges_stated_twice = The edges are stated in pixels and in millimetres.
    .remedy = Leave one of them out.
error-edges_not_rising = The edges do not rise.
    .remedy = Write the smaller edge first; x counts from the left, y from the top.
error-scale_missing = An edge in millimetres needs the scale of the image.
    .remedy = Give --scale with the millimetres of one pixel, or state the region in pixels.
error-text_too_long = The text has { $characters } characters; at most { $most } fit.
    .remedy = Shorten it.
error-not_a_date = '{ $text }' is not a date.
    .remedy = Write it as 2026-03-31.
