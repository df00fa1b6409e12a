### What must be known of an identification

warning-no_steady_start = no experiment begins in a steady state: what the machine did before the start is estimated, and slow time constants and DC gains with it (add a test that starts cold)
warning-dc_gains_not_supported = the record does not support every DC gain: the model holds for changes that last as long as the record's, not for longer ones (add a longer test, or one that starts cold)
warning-pole_unstable = { $inputs }: unstable, a pole has the modulus { FIXED($modulus, decimals: 6) }; the model must not act on a machine
warning-pole_oscillates = { $inputs }: a pole oscillates, which is no heat conduction
warning-extrapolated = { $inputs }: the slowest time constant, { FIXED($time_constant_s, decimals: 0) } s, is longer than a third of the longest test ({ FIXED($longest_s, decimals: 0) } s); it and the DC gain are extrapolated
warning-sample_time_short = the slowest time constant is { FIXED($rows, decimals: 0) } rows: an equation error at so short a sample time is biased; take block means of about { FIXED($better_s, decimals: 0) } s, or the method oe
warning-residuals_not_white = the residuals are not white (correlation { FIXED($correlation, decimals: 2) } within { $lags } rows): the coefficients are biased and their standard deviations do not hold; compare with the method oe
warning-parameters_open = the rows leave { $count } combinations of parameters open: standard deviations do not count them; lower the orders
warning-iteration_not_settled = the iteration did not settle in { $steps } steps: the rows hardly determine the coefficients; lower the orders or use the method modal
warning-inputs_held = { $count } missing inputs were held at their last value
warning-time_constant_at_bound = { $input }: a time constant lies at its bound, twenty times the longest test; the record does not show it
warning-dc_gain_undetermined = { $input }: the DC gain is { $gain_um_per_k } µm/K with a standard deviation of { $std_um_per_k } µm/K; the record does not determine it
warning-largest_lag_chosen = the largest time constant tried, { $time_constant_s } s, belongs to the best model: the record may be too short for the slowest one of the machine
warning-parts_short = the parts held out are { FIXED($duration_min, decimals: 0) } min long: what is slower was not judged
warning-gains_held_small = the gains were held as small as was allowed: the temperatures hardly explain the displacement
warning-inputs_opposed = { $first } and { $second } move together (correlation { FIXED($correlation, decimals: 3) }) and act against each other ({ SIGNED($first_um_per_k, decimals: 2) } and { SIGNED($second_um_per_k, decimals: 2) } µm/K): only their sum is known well
warning-explains_nothing = do not use it, it explains nothing: on rows held out the model leaves { $model_um } um, no less than a constant that was known before ({ $constant_um } um); check sensors, inputs and rows first, or give another test
warning-probe_drift = the displacement of the log drifts by { SIGNED($um_per_h) } um/h ({ SIGNED($drift_um) } um in { $span_h } h), as a probe does and no input explains; the model leaves it out
warning-drift_held_out = what the model leaves of rows held out is less than the probe drifts: they do not judge it, only a log without this drift can
warning-lags_against_record = the record speaks against the lags that were given: with its own ({ $own_s } s) it is e^{ $less } times as likely; gains and DC gains have no intervals, as these hold if the lags do
warning-candidates_left_out = not learnt from, as their sensors cannot be trusted (the findings say why): { $names }
warning-outputs_without_unit = no known unit is stated for { $names }: the values are taken as µm; end the name of the column in its unit, such as _um or _mm
warning-touches_excluded = { $count ->
        [one] a touch is
        *[other] { $count } touches are
    } so far off what the others tell that it is not learnt from: { $touches }. A chip?
warning-datum_moved = the datum was set anew while the log ran, as what the touches show steps by { $touches }: later ones are taken back by it
touches-far = { SIGNED($um) } um, { $at_h } h after the first row
touches-far_at = { SIGNED($um) } um at { $at }
warning-two_regimes_by = two regimes in { $log }: gains and time constants change with { $column } ({ $low } or { $high }), which is { $high } in rows { $rows } (stretches in all: { $stretches }). Train and run the model at one of the two, interlocked with it: nothing on the machine switches models
warning-two_regimes_gains = DC gains in um/K at { $column } { $low } / { $high } in { $log }: { $gains }; gains and lags that switch leave { $rmse_um } um of the last 30 % of its measured rows, gains and lags that do not { $one_um } um (both from rest and about the mean of what they leave before, unlike the table of errors)
two_regimes-rows = { $first }..{ $last }
two_regimes-gains = { $input } { $low_um_per_k } / { $high_um_per_k }
warning-two_regimes = two regimes: { $log } is much more likely with gains and time constants that change while it runs, so no one model fits it; in which rows it does not show. What switches there (coolant, a door, a table)? Log it as a column of 0 and 1
warning-delay_rounded = { $input }: the delay of { $given_s } s is taken as { $used_s } s, whole rows
warning-no_lags = no model file can hold this model, and none of its figures is shown: { $cause }

## The test that would help most

next_test-unmoved = Next test: { $inputs } never moved in the logs, so that nothing is known of the gain: check the sensor, run what heats it, or leave the input out
next_test-no_interval = Next test: run what heats { $input } alone (at the most by { FIXED($level_k, decimals: 1) } K in the logs) for { DURATION($on_s) }, then let it cool for as long. The logs support no interval of its DC gain
next_test-run = Next test: run what heats { $input } alone (at the most by { FIXED($level_k, decimals: 1) } K in the logs) for { DURATION($on_s) }, then let it cool for as long. What it does at that level, settled, is known to ± { $open_um } um (95 %)
next_test-none = Next test: none of one source alone would help much

## Rows that an identification held out

held_out-later_part = Held out: the last { $percent } % of each run, by a model of the rows before (no promise for another run)
held_out-other_runs = Held out: each of { $runs } runs, by a model of the others
held_out-stretches = Held out: one of { $count } stretches of the measured rows after the other, by a model of the others (no promise for another run)

## What the residual of a free run says

residual-white = { $channel }: what is left is white, means over { FIXED($step_min, decimals: 1) } min do not follow each other
residual-few_rows = { $channel }: too few rows count to say what is left
residual-slow = { $channel }: what is left is slow, { $rows } means over { FIXED($step_min, decimals: 1) } min are worth { FIXED($worth, decimals: 0) } (neighbours correlate by { FIXED($correlation, decimals: 2) })
residual-input = { $channel }: what { $name } does is not all explained, most clearly from { FIXED($from_min, decimals: 0) } to { FIXED($to_min, decimals: 0) } min later
