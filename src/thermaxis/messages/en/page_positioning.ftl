### Words of the page that evaluates positioning runs.

positioning-title = Evaluate a positioning run

## form

positioning-file = Measured run (.rtl, .csv, .dat, .xlsx, .xls, .md, .txt; at most { $megabytes } MB)
positioning-choose = Choose
positioning-no_file = no file chosen
positioning-file_first = Choose a measured run first.
positioning-cycle = Kind of cycle
positioning-from_file = as the file says
positioning-cycle_standard = standard
positioning-cycle_pilgrim = pilgrim step
positioning-cycle_step = step cycle
positioning-edition = Standard
positioning-edition_beside = { $name } beside ISO 230-2:2014
positioning-reference_cycle = Refer to the thermal state of cycle (number; empty: the evaluation chooses)
positioning-reference_hours = or after so many hours
positioning-drift = Separate the drift
positioning-full = s, R and A also on an axis over 2000 mm
positioning-head = Head of the certificate (TOML)
positioning-limits = Limits of the figures (TOML)
positioning-submit = Evaluate
positioning-needs_engineer = Files are evaluated for those who have logged in as engineer.
positioning-kept = Evaluated here (kept for an hour, at most { $most })
positioning-nothing_yet = No run has been evaluated yet.

## refusals

positioning-table_too_large = Head and limits may have at most { $largest } kB each.
positioning-runs_wrong = A trend needs 2 to { $most } runs of one axis.
positioning-no_toml = The file is no TOML: it does not state keys and values.

## result

positioning-figures = Figures
positioning-report = Report
positioning-download = Certificate (PDF)
positioning-runs = { $targets } targets from { $first } to { $last } { $unit }, { $cycles } runs, { $cycle }
positioning-both_ways = both directions
positioning-one_way = one direction
positioning-axis = Axis { $axis }
positioning-begun = begun { $time } (time of the file)
positioning-content = SHA-256 of the file: { $sha256 }
positioning-figure = Figure
positioning-measured = As measured
positioning-within = U (95.45 %)
positioning-drift_free = Drift eliminated
positioning-limit = Limit
positioning-decision = Decision
positioning-passed = passes
positioning-failed = fails
positioning-not_decided = not decided
positioning-rule_simple = Decision: value against limit, uncertainty not counted
positioning-rule_iso14253 = Decision by ISO 14253-1: the uncertainty counts
positioning-verdict = All limits together:
positioning-not_the_standard = Figures with the drift eliminated are no result of ISO 230-2.
positioning-uncertainty_without = U without: { $terms }
positioning-coverage = ± U: coverage 95.45 %, k from { $low } to { $high }; the certificate states k of each figure.
positioning-coverage_doubted = ± U: may cover less than 95.45 % ({ $doubts }).
positioning-absent = A dash: this figure does not exist for this run; the warnings say why.
positioning-drift_title = Drift
positioning-drift_none = No drift is seen ({ $p }).
positioning-drift_line = The drift is significant ({ $p }): a straight line in time.
positioning-drift_smooth = The drift is significant ({ $p }): a smooth curve in time.
positioning-drift_total = Over the run: shift of the whole axis { $shift } { $unit }, thermal growth { $growth } { $unit_per } ({ $grown } { $unit } over { $length } { $unit_length }).
positioning-less_than = less than { $limit }
positioning-drift_state = The drift-free figures are those of the thermal state after { $hours } h.
positioning-anomalies = Targets that stand out
positioning-anomaly = { $approach } position { $position } ({ $target } { $unit }): its spread is { $ratio } times that of the others
positioning-diagnosis = Diagnosis
positioning-warnings = Warnings
positioning-other = Figures of { $name }

## figures by name

positioning-figure_b = reversal value
positioning-figure_b_mean = mean reversal value
positioning-figure_m = range of the mean bidirectional deviation
positioning-figure_e_forward = systematic deviation, forward
positioning-figure_e_backward = systematic deviation, backward
positioning-figure_e = systematic deviation, bidirectional
positioning-figure_r_forward = repeatability, forward
positioning-figure_r_backward = repeatability, backward
positioning-figure_r = repeatability, bidirectional
positioning-figure_a_forward = accuracy, forward
positioning-figure_a_backward = accuracy, backward
positioning-figure_a = accuracy, bidirectional

## files, forms, tables and plans

positioning-drop = Or drop files anywhere on this page: a run is evaluated at once; a head, limits, a budget (TOML) and a plan (JSON) go where they belong.
positioning-reading = How the file is read
positioning-decimal = Decimal sign
positioning-decimal_point = point
positioning-decimal_comma = comma
positioning-date_order = First in 03/04/2026
positioning-date_order_day = day
positioning-date_order_month = month
positioning-date_order_year = year
positioning-units = Units of position, deviation
positioning-target_tolerance = Targets closer than this are one, mm or °
positioning-encoding = Encoding of the text
positioning-map = What the columns hold (TOML)
positioning-budget = Uncertainty budget (TOML)
positioning-plan = Plan to compare with (JSON)
positioning-form = Fill in
positioning-form_used = from the form
positioning-form_kept = Kept for the next time, as the file that the commands read.
positioning-form_keep = Use
positioning-form_drop = Drop what was filled in?
positioning-form_save = Save as file
positioning-form_empty = Empty
positioning-downloads = More files
positioning-download_page = Certificate (HTML)
positioning-download_dcc = Digital Calibration Certificate
positioning-download_charts = Charts
positioning-download_csv = Tidy CSV
positioning-download_json = All results (JSON)
positioning-chart_levels = Mean deviations
positioning-chart_spread = Standard deviation at each target
positioning-chart_position = position
positioning-control = Control
positioning-axis_name = Axis on the control
positioning-axis_first = Write the axis on the control first: a table without it would be for a guessed one.
positioning-points = Number of points
positioning-table_title = Table for a control
positioning-table_drift_free = mean deviations without drift
positioning-backlash = mean reversal apart
positioning-table_make = Make the table
positioning-save_file = Save { $name }
positioning-plan_title = Plan a run
positioning-plan_length = Length, mm or °
positioning-plan_targets = Targets
positioning-plan_start = Begins at
positioning-plan_pitch = Pitch of the screw
positioning-plan_feed = Feed, mm/min or °/min
positioning-plan_dwell = Dwell, s
positioning-plan_cycles = Cycles
positioning-plan_rotary = rotary axis
positioning-plan_make = Make the plan
positioning-travel = Travel, such as -10:510
positioning-warm_up = Travels before the first stop
positioning-program_make = Write the NC program
positioning-program_title = NC program
positioning-trend_title = Figures of several runs
positioning-trend_run = Run
positioning-trend_begun = Begun
positioning-picture_run = A measured run
positioning-picture_run_more = gives the figures of ISO 230-2 with their uncertainty, with and without drift, findings and a certificate.
positioning-picture_trend = Several runs of one axis
positioning-picture_trend_more = give the trend of their figures.
positioning-picture_plan = A run with its plan
positioning-picture_plan_more = is held against it; what differs is said.
positioning-picture_log = A log of temperatures and displacements
positioning-picture_log_more = gives a model of the thermal error, under Thermal model.
positioning-picture_model = A second log
positioning-picture_model_more = verifies the model; several models are compared, and one is taken along as a block for a PLC.
