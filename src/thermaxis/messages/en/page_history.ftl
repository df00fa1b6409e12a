### Words of the history page and of what the history answers.

## answers

history-unreadable = The history cannot be read: { $why }
history-no_database = the database cannot be reached or read.
history-fails = it fails.
history-hangs = The history has not answered within { $limit } s. The database may be busy or out of reach; try again.
history-busy = Too many questions wait for the history. Try again in a moment.
history-no_span = This is no span of time. Choose an end after the begin, and at most ten years.
history-no_series = No series is chosen.
history-too_many = At most { $most } series can be shown at once.
history-unknown_series = The history has no series { $name }.
history-no_answer = The screen's program does not answer. Try again.

## span

history-span = Span
history-length_1h = 1 h
history-length_8h = 8 h
history-length_1d = 1 day
history-length_7d = 7 days
history-length_30d = 30 days
history-length_all = All
history-from = From
history-to = To
history-show = Show
history-former = Chart, numbers and events are still those of before, from { $first } to { $last }.
history-loading = The history is being read ...
history-told = { $first } to { $last }, { $length }. One step: { $step }; line: mean, band: lowest to highest value.
history-told_cycles = { $first } to { $last }, { $length }. Every cycle is shown.
history-nothing_recorded = Nothing has been recorded yet.

## series

history-series = Series
history-series_hint = At most { $most } series with two units.
history-two_units = A chart has two axes: choose series with at most two units.
history-group_inputs = Inputs
history-group_others = Others
history-correction = correction
history-wanted = wanted correction
history-model = model
history-weight = weight of the model
history-trim = trim
history-commanded = commanded offset
history-accepted = accepted offset
history-effective = effective offset
history-part = part { $name }
history-probe = probe
history-active = share of time compensating
history-limited = share of time at the limit

## second span

history-second = Compared with an earlier time
history-second_days = days before (dashed)
history-second_told = Dashed: what was recorded from { $first } to { $last }.

## export

history-export = Export of the span
history-export_csv = As CSV
history-export_parquet = As Parquet
history-export_told = All series of the span, every cycle, times in UTC. At most { $limit } s of work and { $size } MB.
history-export_log_in = Log in to export.
history-export_works = The export is being written ...
history-export_done = The export is ready: { $name }
history-export_format = There are exports as CSV and as Parquet.
history-export_busy = Another export is being written. Try again in a moment.
history-export_late = The export took longer than { $limit } s and was ended. Choose a shorter span, or Parquet; thermaxis history export has no limit.
history-export_large = The export is larger than { $size } MB. Choose a shorter span, or Parquet; thermaxis history export has no limit.
history-export_empty = There is no cycle in this span.
history-export_failed = The export has failed. The reason stands in the log of the screen's program.

## events

history-events = Events
history-events_none = There are no events in this span.
history-events_more = Only the { $count } newest events of the span are shown.
history-time = Time
history-kind = Kind
history-who = Who
history-what = What
history-asked_accepted = { $what }: accepted; { $reason }
history-asked_refused = { $what }: refused; { $reason }
history-ask_trim = Trim { NAME($output) } { SIGNED($value, decimals: 1) } µm for { DURATION($length) }
history-ask_diameter = Workpiece diameter { $value } mm
history-ask_no_diameter = No workpiece diameter
history-ask_model = Choose the model { $file }
history-second_empty = Nothing was recorded from { $first } to { $last }: there is no dashed line.
history-group_loop = Loop and workpiece
history-lateness = lateness of the cycle
history-diameter = workpiece diameter
history-other_compensation = another compensation
history-interlock = interlock ({ $name })
