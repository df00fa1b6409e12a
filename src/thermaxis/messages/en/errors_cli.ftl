### Errors of commands

## Options

error-options_exclude = { $one } and { $other } exclude each other.
    .remedy = Leave one of them out.
error-either_option = Either { $one } or { $other } is needed, and not both.
error-option_needs = { $option } has a meaning only together with { $needed }.
    .remedy = Give { $needed } as well, or leave it out.
error-option_belongs_to = This option belongs to { $what }.
    .remedy = Leave it out.
error-span_of_several_logs = A span is of one log, and there are { $logs }.
error-span_without_rows = No row lies in { $typed }: the log has { $rows } rows and lasts { $lasts_h } h.
error-span_ends_before_it_begins = The span ends before it begins.

## Outputs

error-no_name = The output has no name.
    .remedy = Name a file.
error-folder_missing = The folder of this output does not exist.
    .remedy = Make it first, or name another one.
error-is_a_folder = This is a folder.
    .remedy = Name a file in it.
error-report_suffix = A report cannot be written as '{ $suffix }'.
    .remedy = End its name in .pdf or .html; that of a certificate also in .xml.
error-output_is_input = This output would overwrite a file that is read, such as the measured run.
    .remedy = Give it another name.
error-outputs_have_one_name = Two outputs have the same name.
    .remedy = Rename one of them.
error-charts_need_folder = The charts need a folder, and this is a file.
    .remedy = Name a folder; it is made if it does not exist.
error-written_as_csv = A thermal log is written as CSV.
    .remedy = End the name in .csv.
error-unknown_run_suffix = '{ $suffix }' is no file type that a run can be written as.
    .remedy = End the name in .csv (with the time of every reading) or .rtl.
error-history_suffix = '{ $suffix }' names no format.
    .remedy = End the name in .parquet or .csv.
error-older_table_not_kept = The table that this one replaces cannot be kept: { $cause }.
    .remedy = Give the new table another name.
error-too_many_older_tables = { $tables } older tables are kept beside it already.
    .remedy = Move them to another place.

## Plans, tables and thermal fields

error-uncertainty_not_reached = No run of at most { $hours } h reaches { $wanted } { $unit }: its { $cycles } cycles come to { $standard_uncertainty } { $unit }.
    .remedy = Ask for less, allow a longer run, or lower the noise (a longer recording).
error-not_an_axis_name = '{ $name }' is no name of an axis.
    .remedy = Write a letter and up to 15 letters, digits or underscores, such as X or AX1.
error-no_regular_file = This is not a regular file.
    .remedy = Name the file of the table.
error-not_plain_text = The file is no plain text (UTF-16, or binary).
    .remedy = Save it as plain ASCII text, as the control reads it.
error-table_value_too_large = A position or value is above { $most }, larger than any axis has.
    .remedy = Look for a missing decimal point.
error-table_of_another_axis = The older table is of axis { $stated }, the new one would be of { $wanted }.
    .remedy = Give --axis { $stated } if the run was measured on that axis.
error-reversal_in_points = { $control } has a value for each direction: the reversal is in its points, and a reversal value beside them counts as 0 or as the older file states it.
    .remedy = Leave it out.
error-no_place_for_reversal = The table of { $control } has no place for the reversal: the control's own value stays in force.
    .remedy = Leave it out; the summary says which reversal remains, to be set on the control by hand.
error-reversal_stays_in_force = The file does not write the control's reversal value, which stays in force.
    .remedy = Give --backlash as well, or leave it out.
error-reversal_not_measured = Only one approach was measured: the reversal is not known.
    .remedy = Leave it out, or measure both directions.
error-no_drift_free_levels = There are no mean deviations without drift: { $cause }
    .remedy = Leave --drift-free out, or measure at least two cycles with times.
error-older_table_has_two_values = { $control } has one value per point; the older table has two.
error-read_back_points_differ = The control would read { $points } points of { $meant }: nothing was written.
    .remedy = This is a defect of the program: report it with the run.
error-read_back_values_differ = The control would read values that differ by { $difference } { $unit } from those that were meant, more than the { $allowed } { $unit } of rounding: nothing was written.
    .remedy = This is a defect of the program: report it with the run.
error-table_too_steep = The deviation changes by { $slope } { $unit } from { $low } to { $high } { $position_unit }: { $percent } % of the way, which no axis does; nothing was written.
    .remedy = Check that the deviations of the run are in { $deviation_unit } and its targets in { $position_unit }.
error-points_count_from_reference = The older table counts its points from its reference point, { $known } { $unit }; from { $stated } { $unit } they would act elsewhere.
    .remedy = Leave it out; or state --set reference_coordinate if that of the older table is not the one of the control.
error-too_few_images = A difference needs two images or more, not { $images }.
    .remedy = Name an image before and one after.
error-run_without_times = The readings of the run have no times, only an order.
    .remedy = Give a run with times, or two images without --times.

## Thermal models

error-no_input_named = No input is named.
    .remedy = Write --input spindle=T_spindle_c-T_column_c, or --candidates "T*_c".
error-joint_gains_need_one_output = Joint gains are for one output, the method modal and named inputs.
error-sample_time_too_short = { $sample_time_s } s are shorter than the time between the rows, { $step_s } s.
    .remedy = Leave it out, or give a longer time.
error-reference_too_long = { $reference_s } s are longer than the log, { $duration_s } s.
    .remedy = Give the time over which the machine rested at first, or leave it out.
error-input_is_displacement = The input { $name } is made of a measured displacement.
    .remedy = Name temperatures: displacements are not measured when the machine works.
error-same_log_twice = The same log is given twice: it would count as two experiments.
    .remedy = Give it once.
error-no_channel_fits = No channel fits the pattern '{ $pattern }'.
    .remedy = Channels are { $known }.
error-two_gains_of_one_part = Two gains name the same part.

## At the machine

error-fingerprint_not_confirmed = The fingerprint was not confirmed; nothing was stored.
    .remedy = Look it up on the machine itself, then answer yes or give --fingerprint.
error-no_server_certificate = The server has no certificate.
    .remedy = Enable an encrypted endpoint on the machine.
error-several_server_certificates = The server has several certificates: { $fingerprints }.
    .remedy = State by --fingerprint which one the machine shows as its own.
error-other_fingerprint = The server has another fingerprint, SHA-256 { $fingerprints }.
    .remedy = If it is typed as the machine shows it, the connection is intercepted: store nothing.
error-dry_run_has_no_offset = A dry run has no offset to prove.
error-touches_not_read = No touches are read: state node, counter_node, largest_um and largest_rate_um_per_s.
error-self_test_forbids = The self-test forbids it: { $reasons }.
    .remedy = Run thermaxis check.
error-machine_not_reached = The machine is not reached: { $cause }.
    .remedy = Run thermaxis check.
error-no_gauge_reading = The gauge is no longer read out: the offset goes back.
error-probe_not_measuring = The probe does not measure: { $readings } good readings, { $needed } are needed.
error-sink_not_linuxcnc = The sink is not LinuxCNC.
    .remedy = Write kind = "linuxcnc" there, and the joint of each output.
error-rows_not_written = The last rows could not be written: { $cause }.
    .remedy = Make room on the disk, and record again.
error-not_the_lathes = The virtual lathe has one offset and the channels { $known }; here are { $outputs } outputs, and channels that it does not have: { $channels }.
    .remedy = Another machine is rehearsed by a log of its own: kind = "replay" in [source], kind = "dry" in [sink], then thermaxis run --enable.
error-request_refused = { $request } was refused: { $cause }
error-no_terminal = There is no terminal to ask for the password.
    .remedy = Give --stdin to read it from standard input.
error-passwords_differ = The two passwords differ.

## Export to a PLC

error-direction_not_stated = Where a positive motion of the axis moves the tool point is not stated, and there is no default.
    .remedy = Write --positive away or --positive towards, seen from the workpiece.
error-not_a_folder = This is no folder, or a link to one.
    .remedy = Name a new or empty folder.
error-folder_not_empty = { $name } lies in the folder.
    .remedy = Name a new folder, or an empty one.
error-folder_holds_foreign_file = { $name } lies in the folder, which is no part of an older export.
    .remedy = Name a new or empty folder.
error-exported_file_changed = { $name } was changed since it was exported.
    .remedy = Keep it elsewhere first. Name a new or empty folder.
error-models_begin_differently = The model refers to its { $reference } temperatures with a filter of { $filter_s } s, the first one to its { $first_reference } ones with { $first_filter_s } s.
    .remedy = Identify all positions in the same way.
error-models_and_positions_differ = There are { $models } models and { $positions } positions.
    .remedy = State --at MM once for every MODEL, in their order.
error-model_has_several_outputs = This model has { $outputs } outputs.
    .remedy = Give models with one output each, or one model with all of them.
error-line_needs_two_positions = A line needs two outputs of the model or more, each with its position.
    .remedy = State --at OUTPUT=MM for each; the model has { $known }. Or give several models with --at MM for each.
error-reference_temperatures_differ = The model refers to { $value_c } °C, another one to { $other_c } °C.
    .remedy = Identify all positions with the same references.
error-block_has_one_model = There are { $models } models, and the block has one.
    .remedy = Combine them first with thermaxis combine; positions of an axis are for --dialect sinumerik-tempcomp.
error-no_limits_of_output = There are no limits of output { $outputs }.
    .remedy = The machine has { $known }.
error-not_stated_for = Nothing is stated of { $names }, and there is no default.
    .remedy = Write { $option } { $form } for each, or one without a name for all, such as { $option } { $example }; or take all rules of a machine by --machine MACHINE.toml.
