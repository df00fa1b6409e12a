## What must be known before runs of one axis are compared

warning-no_drift_free_figures = no figures without drift: { $cause }
warning-no_start_time = { NAME($runs) } state no start time: the runs stand in the order given
warning-zones_mixed = some runs state a time zone and some do not: the latter are taken as UTC
warning-one_run = one run has no trend
warning-machines_differ = the runs differ in machine: { $groups }: is it one machine?
warning-serial_numbers_differ = the runs differ in serial number: { $groups }: is it one machine?
warning-axes_differ = the runs differ in axis: { $groups }: is it one axis?
warning-target_counts_differ = the runs differ in number of targets: { $groups }: more targets find larger extremes
warning-test_cycles_differ = the runs differ in kind of test cycle: { $groups }: it drifts otherwise while measured
warning-approaches_differ = the runs differ in approaches: { $groups }: one direction has no B, E, R and A
warning-cycle_counts_differ = the runs differ in number of cycles: { $groups }: R and A of few cycles scatter more
warning-rules_differ = the runs differ in rule of the standard: { $groups }: axes over 2000 mm have no R and A
warning-time_sources_differ = the runs differ in source of the times: { $groups }: drift is not told apart equally well
warning-other_part = { NAME($runs) } measured another part of the axis than { $reference }: E, M and A grow with the length
warning-targets_moved = the targets of { NAME($runs) } lie elsewhere than those of { $reference }: a periodic error is caught at other phases
warning-conditions_not_met = not all conditions of the standard are met in { NAME($runs) }: the command evaluate says which
warning-air_differs = the air differs by { FIXED($difference_k, decimals: 1) } K between { $coldest } and { $warmest }: E, M and A change with it where expansion is not compensated

## What of an axis changes over the years

axis-slope = { $axis }: { $figure } changes by { SIGNED($per_year) } { $unit } a year (95 %: { SIGNED($low) } to { SIGNED($high) }): wear, or a foundation that settles. Look before it passes its limit.
axis-step = { $axis }: { $figure } is { SIGNED($size) } { $unit } away since { $start }: what happened before it? A collision, a repair, another compensation table or another instrument.
axis-new_fault = { $axis }: { $name } is the first run with this: { $fault }
