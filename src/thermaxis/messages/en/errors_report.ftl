### Errors of reports and of the settings that they show

error-output_is_pipe = This output is a pipe, which would wait for a reader.
    .remedy = Name a file.
error-not_a_date = '{ $text }' is not a date.
    .remedy = Write it as 2026-03-31.
error-other_logs_than_verified = The logs are not those that were verified.
    .remedy = Give the logs of the verification in their order.
error-runs_of_two_kinds = Linear and rotary axes have no figures in common.
    .remedy = Give runs of one axis.
error-key_of_other_axis = The key belongs to a { $kind } axis, and this axis is { $axis }.
error-not_a_number_from_zero = '{ $text }' is not a number from zero.
    .remedy = Write it in the unit that the key names.
error-budget_without_terms = No term of the uncertainty is stated.
    .remedy = Write a table [device] with a line such as { $example } = 0.5.
error-number_needed = { $label } is not a number.
    .remedy = Write it in { $unit }.
error-header_value_needed = { $label } is not a text, a number, a date or yes/no.
error-text_too_long = The text has { $characters } characters.
    .remedy = Shorten it to { $most }.
error-not_a_moment = '{ $text }' is not a date with or without a time.
    .remedy = Write it as 2026-03-31T07:30:00, or with its zone behind, such as +01:00.
error-end_before_start = The end lies before time.start.
    .remedy = Correct one of the two.
error-wrong_number_of_regions = The file has { $regions } regions, not 1 to { $most }.
    .remedy = Write a table such as [regions.left] with x_px = [0, 20] and y_px = [0, 60].
error-region_edges = The region needs its edges along { $axis } once, in pixels or in mm.
    .remedy = Write either { $axis }_px = [from, to] or { $axis }_mm = [from, to].
error-scale_needed = Edges in mm need the scale of the image.
    .remedy = Give --scale with the millimetres of one pixel, or state the region in pixels.
error-not_a_pair = This is not a pair of numbers.
    .remedy = Write it as [from, to], such as [0, 20].
error-no_limit_stated = No figure has a limit.
    .remedy = Write a table [limits] with lines such as { $example }.
error-rule_needs_uncertainty = The rule iso14253-1 needs the expanded uncertainty of { $figures }.
    .remedy = Write it below [expanded_uncertainty], or choose the rule simple.
