### Errors that several packages raise

## Files

error-file_unreadable = The file cannot be read: { $cause }.
error-file_unwritable = The file cannot be written: { $cause }.
error-folder_unwritable = The folder cannot be written to: { $cause }.
error-file_not_found = There is no such file.
    .remedy = Check the path.
error-file_exists = The file exists already.
    .remedy = Name another one, or remove it.
error-file_too_large = The file has { $size_mb } MB; at most { $most_mb } MB are read.
error-not_utf8 = The file is not UTF-8 text.
    .remedy = Save it as UTF-8.
error-not_toml = The file is not TOML: { $cause }.
error-not_json = The file is not JSON: { $cause }.

## Settings

error-unknown_key = '{ $name }' is not a key here.
    .remedy = Keys are { $known }.
error-missing_key = The key is missing.
error-not_a_table = This is not a table.
error-not_a_list = This is not a list.
error-not_a_text = This is not a text in quotation marks.
error-unknown_choice = '{ $name }' is not known here.
    .remedy = Choose one of { $known }.
error-unknown_name = There is no '{ $name }'.
    .remedy = There are { $known }.
error-stated_twice = '{ $name }' is stated twice.

error-only_one_of = Only one of { $names } can be given.

## Numbers

error-not_finite = The number is not finite.
error-not_positive = { $value } is not above zero.
error-negative = { $value } is negative.
error-not_positive_up_to = { $value } is not above 0 and at most { $most }.
error-outside_count = There are { $count } entries; from { $least } to { $most } are allowed.
error-outside_range = { $value } is not from { $least } to { $most }.
error-wrong_shape = The shape is { $shape }; { $expected } is needed.
error-not_rising = The values do not rise.
