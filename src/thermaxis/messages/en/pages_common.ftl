### Words that stand on every page, or on several.

## pages

common-page_login = Log in
common-page_operator = Machine
common-page_model = Model
common-page_sensors = Sensors
common-page_history = History
common-page_probe = Probe
common-page_positioning = Positioning
common-page_thermal = Thermal model
common-too_many_pages = Too many pages are open. Close some that nobody looks at; this one tries again by itself.
common-navigation = Pages

## who looks

common-log_in = Log in
common-log_out = Log out
common-role_viewer = viewer
common-role_operator = operator
common-role_engineer = engineer
common-role_none = without a role

## language and look

common-language = Language
common-language_en = English
common-language_de = Deutsch
common-language_cs = Čeština
common-theme = Brightness of the page

## data that are missing

common-no_data = NO DATA
common-no_data_since = NO DATA since { $time }
common-no_connection_to_screen = This page has lost the connection to the screen's program. It is tried again.

## a configuration that was changed

common-differs = The compensation runs with another configuration than these pages show. Start the screen again; if this stays, the file is newer than the start of the compensation.
common-differs_version = The compensation is version { $told } of the program, these pages are version { $own }, and the configuration is understood differently: what these pages show of it may be wrong. Install the same version for both, and start both again.

## what is not translated

common-details_english = Details come in English: they are the program's own words.

## requests

common-cancel = Cancel
common-close = Close

## the head of every page

common-alarms = alarms: { $count }

## what cannot be shown, or is refused before any page is made

common-not_shown = This cannot be shown
common-to_the_first_page = To the first page
common-no_page = There is no such page.
common-mistake = The screen's program has made a mistake. Tell an engineer the reference { $reference }; the screen's log says more.
common-refused_origin = The request does not come from a page of this screen.
common-refused_long = The address is too long.
common-refused_method = Pages are asked for, or something is sent to them; this is neither.
common-refused_kind = The request is not sent as JSON.
common-refused_large = The request is larger than it may be.
common-refused_slow = The request took too long to come.
