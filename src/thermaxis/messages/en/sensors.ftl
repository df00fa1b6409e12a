## What was read of a channel

quality-good = good
quality-redundant = the redundant sensor stands in
quality-missing = there is no value
quality-status_bad = the status is not good
quality-old = the value is too old
quality-no_time_stamp = the value has no time stamp
quality-out_of_range = the value is not plausible
quality-too_fast = the value jumped
quality-frozen = the value does not change at all
quality-disagrees = the two sensors disagree

## What may be behind a value that is not accepted

sensor_cause-missing = The source gives no number for it.
sensor_cause-status_bad = A broken wire, a failed module, or a channel that is switched off.
sensor_cause-old = The source has stopped refreshing it.
sensor_cause-no_time_stamp = The source does not say how old the value is.
sensor_cause-out_of_range = A broken or short-circuited sensor, or another unit.
sensor_cause-too_fast = A loose contact, or sensors that were swapped.
sensor_cause-frozen = The sensor or its module stands still.
sensor_cause-disagrees = One of the two sensors is wrong or has come off.
