### Errors of logs, identification, verification and thermal images

## Logs

error-no_log = There is no log.
    .remedy = Give at least one.
error-no_times = No row has a time.
    .remedy = Check which column holds the times, or name it in a mapping.
error-times_not_rising = The times are not finite and strictly increasing.
    .remedy = Sort the rows by time and leave out those that are there twice.
error-first_time_not_zero = The first time is { $first_s } s, not zero.
    .remedy = Use ThermalLog.from_columns, which counts from the first row.
error-times_twice = Times are given twice.
    .remedy = Give either time_s (or a column time_s), or sample_time_s.
error-times_missing = No times are given.
    .remedy = Give either time_s (or a column time_s), or sample_time_s.
error-frame_without_times = The frame has no times.
    .remedy = Give it a column time_s, a column of dates with time, or an index of either.
error-frame_times_as_text = The frame has no times, and this column is text.
    .remedy = If it holds the times, make dates of it: to_datetime of pandas, str.to_datetime of polars.
error-frame_without_rows = The frame has no rows.
error-no_frame = { $type } is no log.
    .remedy = Give a ThermalLog or a frame of pandas or polars; collect a lazy frame first, and give an array to ThermalLog.from_columns.
error-no_columns = The log has no column beside the times.
    .remedy = Record at least one temperature or displacement.
error-too_many_values = { $rows } rows of { $columns } columns are more than { $most_million } million values.
    .remedy = Reduce the log while reading it, with a sample time such as 60 s.
error-too_many_blocks = A record of { $duration_s } s has { $blocks } blocks of { $sample_time_s } s, more than { $most }.
    .remedy = Choose a longer sample time.
error-infinite_value = A value is infinite.
    .remedy = Write NaN where nothing was measured.
error-not_numbers = The column does not hold numbers.
    .remedy = Give an array of numbers, with NaN where nothing was measured.
error-column_ambiguous = Several columns are named { $name } but for upper and lower case.
    .remedy = Write one of { $known }.
error-unknown_column = There is no column { $name }.
    .remedy = The nearest are { $known }.
error-wrong_unit = The unit is { $unit }, and { $needed } is needed.
    .remedy = Choose another column, or correct the unit at the end of its name.
error-no_row_in_span = No row lies from row { $first } up to row { $last }: the log has { $rows } rows.
    .remedy = Rows are counted from zero, and the last one is not included.
error-no_row_between = No row lies between { $first_s } s and { $last_s } s; the log ends at { $duration_s } s.
    .remedy = Times are counted from the first row.
error-output_never_measured = No log has a value of { $output }: it has no such channel, or all its values are missing or masked.
    .remedy = Measured channels are { $channels }.

## Inputs

error-no_input_definition = '{ $text }' does not define an input.
    .remedy = Write name=channel or name=channel-channel, such as spindle=T_spindle_c-T_column_c.
error-input_minus_itself = The input { $name } is { $channel } minus itself.
    .remedy = Write name=channel or name=channel-channel, such as spindle=T_spindle_c-T_column_c.
error-ambiguous_difference = '{ $text }' does not say which channel is subtracted from which.
    .remedy = Write name=channel or name=channel-channel, such as spindle=T_spindle_c-T_column_c.
error-no_input = No input is defined.
    .remedy = Write name=channel or name=channel-channel, such as spindle=T_spindle_c-T_column_c.
error-input_without_value = The input { $name } ({ $expression }) has no value in any row.
    .remedy = Both channels of a difference are needed in the same rows: choose a longer sample time, or other channels.
error-units_differ = The input { $name } subtracts { $minus } from { $plus }, and their units differ: { $units }.
    .remedy = Subtract channels of the same unit.
error-input_never_measured = Input { $input } was never measured.
error-input_missing = An input is missing or infinite.
    .remedy = Hold or interpolate missing inputs first.
error-never_measured = It was never measured.
error-too_few_measured = The displacement was measured { $measured } times; at least { $needed } are needed.
error-inputs_differ = The experiments have different numbers of inputs: { $counts }.
    .remedy = Every experiment needs the same inputs in the same order.
error-count_not_inputs = There are { $count } entries for { $inputs } inputs.
    .remedy = State each input once.
error-sample_times_differ = The sample times { $first_s } s and { $sample_time_s } s differ.
    .remedy = Resample the logs to one sample time; coefficients hold for one only.

## Joining two logs

error-no_channel_varies = No common channel varies, so that the shift between the logs cannot be found.
    .remedy = Give the shift (what is added to the second recorder's clock), such as 0 s for equal clocks.
error-channels_unrelated = The common channels ({ $names }) do not follow each other at any shift; the best correlation is { FIXED($correlation, decimals: 2) }.
    .remedy = Give the shift (what is added to the second recorder's clock), such as 0 s for equal clocks.
error-shift_ambiguous = The common channels ({ $names }) do not determine the shift: anything from { $earliest_s } s to { $latest_s } s fits.
    .remedy = Give the shift (what is added to the second recorder's clock), such as 0 s for equal clocks.
error-no_shift = A shift of { $shift_s } s is not possible.
    .remedy = Give a time in seconds.
error-no_clock_and_no_common_channel = The logs have no common channel and not both state the time of day, so that the shift cannot be found.
    .remedy = Give the shift (what is added to the second recorder's clock), such as 0 s for equal clocks, or name channels that measure the same.
error-no_common_channel = The logs have no common channel, so that the shift cannot be found.
    .remedy = Give the shift (what is added to the second recorder's clock), such as 0 s for equal clocks, or name channels that measure the same.
error-zone_in_one_log = One log states times with a zone, the other without.
    .remedy = Export both with a zone, or both in local time.
error-measured_once = The common channels were measured less than twice, so that the shift cannot be found.
    .remedy = Give the shift (what is added to the second recorder's clock), such as 0 s for equal clocks.

## Identification

error-model_not_stable_lags = The model of { $output } is no sum of stable lags and cannot be written. { $cause }
    .remedy = Use the method modal, which gives such sums; or leave the orders to the search, which takes lags only.
error-method_without_choice = The method { $method } does not choose among candidates.
    .remedy = Name the inputs, or use the method modal.
error-method_without_orders = The method { $method } has no orders.
    .remedy = Leave them out.
error-rows_not_determining = The rows do not determine a model ({ $cause }).
    .remedy = Check that inputs and displacement are measured values and that no input follows another exactly.
error-too_few_joint_channels = One channel alone cannot be estimated jointly.
    .remedy = Name at least two measured channels with their diameters.
error-part_without_effect = The part { $part } does nothing here: its gain cannot be estimated.
    .remedy = Name a test in which its source was active.
error-lags_not_possible = The time constants { $given_s } s of one input cannot be: more than { $most }, shorter than a row ({ $shortest_s } s) or longer than the longest log ({ $longest_s } s).
    .remedy = Give those that the machine has, mostly one to four, minutes to hours (600,2h); what is shorter is in the direct gain, what is longer needs a longer log.
error-lags_too_close = Lags of { $first_s } s and { $second_s } s of one input are one: their gains would be large and opposite.
    .remedy = Give one of them, or lags of which the longer is at least { FIXED($ratio, decimals: 2) } times the shorter.
error-lags_missing = No lags are given for { $names }.
    .remedy = Give them too, or lags without a name for all other inputs: --lags 600,3600.
error-lags_of_modal_only = Lags and delays are given for named inputs, with the method modal.
    .remedy = Name the sources by --input; ARX and output error take a delay in rows by --orders NA,NB,NK.
error-delay_beyond_record = A delay of { $delay_s } s is more than half of the longest record ({ $longest_s } s).
    .remedy = Check its unit: seconds, or 5min, 1h.
error-not_a_time = A delay or the block is not a time.
error-displacement_constant = The displacement never changes.
    .remedy = Check the probe, or leave the output out.
error-too_few_blocks = { $blocks } blocks with a displacement are too few; at least { $needed } are needed.
    .remedy = Use smaller blocks.
error-no_complete_row = There is no displacement where all inputs were measured.
error-no_coefficient = No coefficient is asked for.
error-half_orders = Only one of { $names } is given.
    .remedy = Give both, or none to have them searched.
error-rows_not_enough = { $rows } rows do not determine { $parameters } parameters.
    .remedy = Use lower orders, a longer log, or a method that needs no complete rows.
error-coefficients_undetermined = The rows do not determine the coefficients; the first are { $names }.
    .remedy = Lower the orders, or leave out an input that does not change or repeats another.
error-no_stable_orders = No orders up to three give a stable fit of lags only in every block.
    .remedy = State the orders, take block means of the log, or use the method modal.
error-oe_options_outside = A noise order of { $noise_order } and { $lead_in_rows } rows of lead-in are not possible.
    .remedy = Neither is negative, and the noise order is at most { $most }.

## Choice of inputs

error-inputs_not_shared = The inputs are not those of output { $first }.
    .remedy = Outputs that are identified together need the same logs and candidates.
error-too_few_parts = { $parts } parts cannot be held out in turn.
    .remedy = Ask for at least two parts.
error-no_lag_sets = There is no set of time constants, or one is not positive.
error-several_outputs = There are models of { $outputs } outputs.
    .remedy = Ask for one by its name.
error-no_healthy_candidate = No healthy candidate is left of { $names }.
    .remedy = Repair the sensors, or name other candidates.
error-no_output = There is no output.
    .remedy = Name at least one displacement.
error-measured_in_one_part = The displacement was measured in one part of the record only.
    .remedy = Measure it at least twice, hours apart, or ask for more parts.

## Transfer functions

error-leading_coefficient_zero = The coefficient b_0 is zero: the present output is not defined.
    .remedy = Shift the equation in time until b_0 is not zero.
error-pole_at_one = A pole lies at z = 1: the response to a step never ends.
    .remedy = A thermal model needs a pole inside the unit circle; identify it again.
error-no_steady_state = A pole at z = 1 has no steady state.
    .remedy = Start at rest, with inputs relative to the first row.
error-poles_coincide = Two poles coincide: they are no sum of lags.
    .remedy = Identify with a lower order.
error-pole_unstable = A pole has the modulus { FIXED($modulus, decimals: 6) }: the model is unstable and has no equivalent.
    .remedy = Identify with the method modal or oe, which give stable models.
error-mode_no_lag = { $what ->
    [oscillates] A pair of poles oscillates
    [alternates] A negative pole alternates from row to row
   *[late] Single coefficients act late
    } for { FIXED($lasts_s, decimals: 0) } s ({ FIXED($rows, decimals: 0) } rows): first-order lags side by side, which a model file holds, cannot do that.
    .remedy = Use the method modal; or state lower orders, or leave them to the search, which takes lags only.
error-lags_differ = Without its fast modes, which are no lags, the model differs from itself by { FIXED($apart_um, decimals: 2) } um rms on its own rows, where it leaves { FIXED($left_um, decimals: 2) } um.
    .remedy = Use the method modal; or state lower orders, or leave them to the search, which takes lags only.
    .remedy = Choose a sample time that divides the delay.
error-free_start_unmeasured = A free start needs a measured displacement.
    .remedy = Use simulate_from_fitted_start.
error-phase_too_short = The tests heat over { $heating_um } µm and cool over { $cooling_um } µm: one phase is too short to compare.
    .remedy = Use logs that hold a heating and a cooling phase.
error-too_few_means = { $means } block means do not tell heating from cooling.
    .remedy = Use longer logs.
error-too_few_residuals = { $rows } residuals do not show correlations up to lag { $lags }.
    .remedy = Ask for fewer lags, at least one.

## Superposition

error-no_gain_by_diameter = '{ $text }' is no gain by diameter.
    .remedy = Write table=0:1,1500:1.6,3000:2.2, and tcp:1 for the tool centre point.
error-no_new_diameter = '{ $text }' is no new diameter with its gain.
    .remedy = Write table=0:1,1500:1.6,3000:2.2, and tcp:1 for the tool centre point.
error-no_diameter = No diameter is stated.
    .remedy = Write table=0:1,1500:1.6,3000:2.2, and tcp:1 for the tool centre point.
error-no_model = There is no model to combine.
error-gain_stated_already = Part { $part } has a gain by diameter already.
    .remedy = Take the model without gain, or leave the new gain out.
error-references_differ = The models do not refer to the same temperatures.
    .remedy = Identify both with the same reference.
error-filters_differ = The inputs of the models are filtered differently ({ $first_s } s and { $other_s } s).
    .remedy = Identify both with the same filter.
error-heat_counted_twice = Part { $part } has the same channels as part { $other }: its heat would count twice.
    .remedy = Estimate both in one call of identify, or leave one out.
error-part_name_twice = Two parts are named { $part }.
    .remedy = Name the inputs differently when identifying.

## Verification

error-no_span = { $first }:{ $last } is no span of rows.
    .remedy = Count rows from zero; the last one is not included.
error-no_output_column = The log has no column named as an output of the model ({ $names }).
    .remedy = Say which channel is which output: --measured CHANNEL=OUTPUT.
error-not_measured_with_model = It was measured in no row in which the model runs.
error-not_measured_in_rows = It was measured in no row from { $first } to { $last }.
error-no_row_to_compare = No row has both a measured and a simulated displacement.
    .remedy = Choose rows in which the displacement was measured.
error-fit_undefined = The measured displacement is constant: { $rows } rows at { $value_um } µm have no fit.
    .remedy = Choose rows in which the displacement changes, or judge by RMSE.

## Thermal tests

error-probes_missing = The set-up names no probe.
    .remedy = Name the channels in [probes]: x1, x2, y1, y2 and z, as far as they were measured.
error-probe_without_first = The second probe has no first one, { $missing }: a tilt needs both.
    .remedy = Name its channel as { $missing }, or call the only probe of this axis so.
error-probe_distance_missing = The distance l of the probes is missing; the tilt by { $second } needs it.
    .remedy = State distance_mm in [probes], from the first probe to the second, such as 150.
error-targets_missing = The set-up names no targets.
    .remedy = Name in [targets] the channels at both targets, each from both sides: first = ["...", "..."], second = ["...", "..."].
error-fixture_without_ambient = An expansion of the fixture with ambient temperature is stated, and no ambient temperature.
    .remedy = Name the channels of ambient temperature: ambient = ["..."].
error-motion_missing = Nothing says when something moved.
    .remedy = Name the channel of the speed in [motion], speed = "...", or state running_min = [begin, end].
error-motion_not_rising = { $first } to { $last } min is no span of time.
    .remedy = Count minutes from the first row of the log, the begin first.
error-motion_beyond_log = The motion ends behind the log, which ends after { $minutes } min.
    .remedy = Count minutes from the first row of the log.
error-never_moved = It is never above { $least }: nothing ran.
    .remedy = Name the channel of the speed that made the heat, or choose --kind etve.
error-thermal_test_too_short = { $minutes } min are too short: ISO 230-3 states what happens within 60 min.
    .remedy = Give the whole log of the test; the motion lasts from the first row with speed to the last one.
error-thermal_test_gap = { $quantity } has no value for { $minutes } min from minute { $at_min } on; { $most_min } min are the most.
    .remedy = Give a log without this gap, or join the recorders' logs by thermaxis merge.
error-thermal_test_values_set_aside = Values that the file has were set aside, and { $most_min } min without one are the most: { $finding }.
    .remedy = Check the sensor and leave it out of the set-up if it failed. What rightly stood still is kept by --as-logged; what no sensor measures never is.
error-model_not_of_test = No output of the model ({ $names }) is a channel of the test ({ $channels }).
    .remedy = Identify the model with the channels of the probes as its outputs.

## Thermal images

error-too_many_pixels = The image has { $columns } x { $rows } pixels, more than { $most_million } million.
error-image_empty = No pixel of the image has a temperature.
error-pixel_out_of_range = The image has a pixel of { $lowest_c } °C and one of { $highest_c } °C.
error-region_outside = Columns { $left_px } to { $right_px } and rows { $top_px } to { $bottom_px } are no part of an image of { $columns } x { $rows } pixels.
    .remedy = Give edges from small to large within the image.
error-region_empty = The region holds the centre of no pixel.
    .remedy = Make it larger.
error-no_emissivity = { $emissivity } is no emissivity.
    .remedy = Give a number above 0, at most 1; 0.97 is typical of a matt paint.
error-reflection_exceeds = The reflection of surroundings at { $reflected_c } °C exceeds what the camera saw.
    .remedy = Check the emissivity, the reflected temperature and the unit of the image.
error-one_image = A difference needs two images.
    .remedy = Give an image before and one after.
error-image_sizes_differ = The image has { $columns } x { $rows } pixels, the first one { $first_columns } x { $first_rows }.
    .remedy = Take all images with one camera from one place, and cut none.
error-no_common_pixel = No pixel is present in the first image and in the last one.
error-times_not_images = There are { $times } times for { $images } images.
    .remedy = Give one time for each image.

## Planned thermal tests

error-axis_without_way = An axis that heats needs its name and two different ends of its way.
    .remedy = State axis, from_mm and to_mm.
error-function_without_number = An M function that switches heat needs both numbers.
    .remedy = State on and off: what is switched on must be switched off by its own function.
error-function_no_switch = M{ $number } is no switch: it stops, ends or calls a program, turns a spindle or changes a tool.
    .remedy = Name the M functions that switch this source on and off.
error-levels_not_from_zero = The values do not rise from zero, one for each level.
    .remedy = Write them rising, the first one 0: standstill.
error-span_not_possible = { $first } to { $last } is no span from { $least } to { $most }.
    .remedy = Write the smaller number first.
error-source_not_in_model = The model has no input { $name } of { $output }.
    .remedy = Name the sources as the inputs of the model, or leave the table known out.
error-no_sequence_allowed = No source can run within what is stated.
    .remedy = Plan a longer test, or shorten shortest_on_min or cool_min.
error-sequence_not_allowed = The sequence breaks what the plan states of its sources.
    .remedy = Plan it again.
error-plan_incomplete = Not every block has its value.
    .remedy = Plan it again.
error-no_such_level = A source has no such level, or the block not one level for each.
    .remedy = Plan it again.
error-too_many_subsets = { $subsets } subsets are more than the { $most } that are compared.
    .remedy = Name fewer candidates with --place, or want fewer places.
