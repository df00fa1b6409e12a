### What the reader of a run's results, of a plan or of a table must know

## Plans

remark-pitch_not_stated = no pitch is stated: whether the interval is a multiple of it was not asked
remark-interval_made_smaller = the interval was made smaller, from { $before } to { $interval }: it was a multiple of the pitch { $pitch } within a tenth of it, and periodic errors would have been met in the same phase; { $left } of the length at its far end stay without a target
remark-random_part_limited = the random part is { $share } of the interval and less than half the pitch { $pitch }: with half the pitch neighbours would come too near to each other
warning-periodic_error_hidden = a periodic error of the pitch { $pitch } { $unit } may show only { FIXED($visible_percent, decimals: 0) }% of its size at these targets: take another seed, more targets or another interval
warning-simulated_runs_worse = simulated runs come to { FIXED($simulated, decimals: 3) } { $unit } at the targets, not to the { FIXED($foretold, decimals: 3) } { $unit } that the covariance foretells: in this order of visits drift and errors of the axis are hard to tell apart
warning-simulated_levels_wrong = in simulated runs the mean deviations are wrong by { FIXED($error, decimals: 3) } { $unit } where the drift evaluation states { FIXED($stated, decimals: 3) } { $unit }: in this order of visits a drift may pass for an error of the axis

## Mean deviations of a table

remark-one_approach_for_both = only { $approach } approaches were measured: they stand for both directions
remark-targets_left_out = targets without readings were left out: { $targets }

## An evaluation

warning-date_impossible = { $key } ({ $day }) lies { $side ->
        [after] after
       *[before] before
    } the test ({ $tested })

## What stands below a table of figures

note-u_measured = U = k u is the expanded uncertainty by Monte Carlo (JCGM 101, { $samples } draws, seed { $seed }), not by the annex of ISO 230-2.
note-u_of_run = The true figure as measured is that of this run without the noise of its readings, at its time and with its drift.
note-u_without_drift = The drift of this run is not known and counts as scatter: the true figure is that of the mean deviations which many such runs would have. With the times or the order of the readings the drift would belong to the true figure, so that U of the same readings would be another, as a rule smaller.
note-u_larger = U of { $symbols } is larger than the figure, which cannot be negative: the readings only say that it is not larger than figure + U.
note-u_bias = The largest of noisy values is too large on average: the bias of a figure is the mean of figure minus true figure. The figures are not corrected for it; U contains it. Of the main figures it is largest for { $symbol }: { SIGNED($bias, decimals: 3) } { $unit }.
note-drift_effect = The drift-free figures are of the mean deviations in one thermal state, with their own U. The effect of drift is the figure less the drift-free one of the same readings, with the U of this difference.
note-u_stated = U of { $symbols } is stated in the limits file (k = 2) in place of the evaluated one.
note-u_none = The measurement uncertainty was not evaluated.
note-u = U is the expanded uncertainty: the true figure lies within figure ± U with a probability of 95.45 %.
note-u_doubted = U is the expanded uncertainty, meant for a probability of 95.45 % that the true figure lies within figure ± U. Here U may be too small: { $doubts }.
doubt-jump = the axis jumped during the run
doubt-swing = the axis swings too fast to be followed
note-u_contains = U contains: { $terms }.
note-u_without = U is without: { $terms }.
note-drift_free = Drift-free figures are no results of ISO 230-2.
note-order_assumed = The order of the readings is assumed, not stated by the file: U and drift-free figures hold if they were taken in the order of the standard test cycle.
note-outliers = { $count ->
        [1] Outlier
       *[other] { $count } outliers
    }, in the measured figures but left out of the drift-free ones: { $readings }{ $more ->
        [0] {""}
       *[other] ; { $more } more
    }. 'With outliers': drift-free figures of all readings; the effect of drift is the value less these.
outlier-reading = target { $target } { $approach } in cycle { $cycle } ({ SIGNED($residual, decimals: 2) } { $unit } off)
verdict-u_lacks = U of { $symbols } is without { $terms }
