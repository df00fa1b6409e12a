## What the reader of a result must know of a log

remark-outside_training = input { $name } lies outside the range of the training in { FIXED($share_percent, decimals: 0) }% of the rows, by up to { FIXED($beyond_percent, decimals: 0) }% of its width: the model is extrapolated there
remark-input_failed = an input had failed for too long in { FIXED($share_percent, decimals: 1) }% of the rows
remark-gap = { outcome-gap } ({ $count } times)
remark-clock_backward = { outcome-clock_backward } ({ $count } times)
remark-limits_too_narrow = the limits are too narrow: the compensation goes to the state Fault { $count } times; here each is acknowledged at once
