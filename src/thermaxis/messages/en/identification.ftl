## What the reader of an identification must know

warning-not_fit = not fit, do not use it: on rows held out the model leaves { $model_um } um, a ridge on the inputs { $method ->
    [averages] and their exponential averages
   *[static] alone
    } { $simple_um } um; use --method { $method } with these inputs, or check sensors, inputs and rows and give another test
warning-simple_left_less = on rows held out a ridge on the inputs { $method ->
    [averages] and their exponential averages
   *[static] alone
    } leaves { $simple_um } um, the model { $model_um } um: on another log it is as often the other way round. Write both (--method { $method } for the other) and let compare rank them on one
warning-trained_badly = on its own training rows the model leaves { $model_um } um, a ridge on the inputs and their exponential averages { $simple_um } um: do not trust its DC gains and slow lags; { $drifts ->
    [yes] what drifts (told with the reading of the log) is no answer of an input, so mend it and identify anew
   *[no] look for what no input explains (a drift, a switch, a missing sensor), or give other inputs or methods
    }

## What the record does not support of a part

flag-time_constant = time constant not supported by the record: { FIXED($time_constant_s, decimals: 0) } s
flag-delay_not_shown = delay indistinguishable from 0 (95 %: up to { $highest_s } s): none is used, and the intervals of gains hold for none{ $likeliest_s ->
    [0] {""}
   *[other] . The likeliest is { $likeliest_s } s: try --delay { $input }={ $likeliest_s } and keep what leaves less of rows held out
    }
flag-gains_given_delay = the intervals of gains hold for the delay used ({ $used_s } s), without its own uncertainty
flag-delay_may_be_longer = the delay may be longer than { $highest_s } s, the longest that was looked for
flag-dc_gain = DC gain not supported by the record

## How inputs and orders were chosen

rule-modal = number of lags by blocked cross-validation of the free run, time constants by variable projection, gains held small where a mode is weakly excited
rule-averages = ridge on every input and its exponential averages over 300, 1200, 3600 and 10,800 s
rule-static = ridge on the inputs alone, without a lag
rule-orders_stated = orders na, nb, nk = { $na }, { $nb }, { $nk } as stated
rule-orders_searched = orders up to three, with lags only, by the free run in parts that the fit did not see
rule-joint = parts common to all diameters, gain of the part { $part } by least squares over fixed lags; errors on the training rows are those at { $reference }
rule-averaged = The record is cut into { $parts } parts of { FIXED($part_h, decimals: 1) } h. Each is predicted in free run from the temperatures by models learned from all other parts, each of the later half also from the parts before it. Models with the time constants { NAME($lag_sets_s) } s, common to all channels, are averaged. Their score is the mean absolute error over that of each output's best, mean over all outputs; their weight is the score to the power of -{ $parts }, one independent observation per part, and less than { $least_percent } % is left out. Each takes the uncertainty of the temperatures ({ NAME($uncertainties_k) } K, as ridge penalty, with the noise of each sensor on its direct gain) with the best score. The displacement at the reference is { $reference }; { $channels }.
rule-all_kept = all { $healthy } healthy candidates are kept
rule-some_kept = { $kept } of { $healthy } healthy candidates are kept, the least useful left out one by one
