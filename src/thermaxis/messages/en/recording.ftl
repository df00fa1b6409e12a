## What happens while a log is recorded; lines of the log say it as well

recording-began = began: thermaxis { $version } records
recording-ended = ended
recording-clock_set_back = clock: the time of day was set back by { FIXED($by_s, decimals: 3) } s; times of the log go on and are { FIXED($ahead_s, decimals: 3) } s ahead of it
recording-clock_jumped = clock: the time of day jumped forward by { FIXED($by_s, decimals: 3) } s: the clock was set, or the computer slept
recording-clock_jumped_partly = { recording-clock_jumped }; times of the log jump by { FIXED($log_by_s, decimals: 3) } s and are { FIXED($ahead_s, decimals: 3) } s ahead of it
recording-connected = connection { $name } is there
recording-connected_ahead = { recording-connected }; its clock is { FIXED($by_s, decimals: 3) } s ahead of this one
recording-connected_behind = { recording-connected }; its clock is { FIXED($by_s, decimals: 3) } s behind this one
recording-connection_lost = connection { $name } is not there: { $why }
recording-gap = gap: no row since { $since }, { FIXED($lasted_s, decimals: 3) } s before
recording-repaired = repaired: { $bytes } bytes of a torn last line are gone
recording-lost = lost: { $rows } rows from { $first } to { $last } could not be written and no longer be kept in memory
recording-rows_unwritten = rows cannot be written ({ $cause }): they are kept in memory
recording-rows_written_again = rows are written again
recording-parquet_unwritten = { $file } cannot be written as Parquet ({ $cause })
recording-not_good = { $name }: { $status }; its cells stay empty while it is so
recording-unstamped = { $name }: the server sends no source time stamps for it
recording-stands_still = { $name }: its source time stamp stands still for { FIXED($lasts_s, decimals: 0) } s, so that nothing new is measured and its cells are empty. If the server stamps a value only when it changes, set repeat_unchanged_s for it

## What is out of the ordinary when a node is tried

remark-stamp_stood_still = source time stamp stood still for { $lasts_s } s
remark-no_stamp = no source time stamp
remark-beside_value = { $said }
recording-plan_reached = thermal test, { FIXED($time_h, decimals: 2) } h: { FIXED($reached_um, decimals: 2) } um are reached, { FIXED($foreseen_um, decimals: 2) } um were foreseen; { FIXED($left_h, decimals: 1) } h are left
recording-plan_enough = thermal test, { FIXED($time_h, decimals: 2) } h: enough, stop: { FIXED($reached_um, decimals: 2) } um are reached, { FIXED($foreseen_um, decimals: 2) } um were foreseen
recording-plan_unread = thermal test: what is reached cannot be told ({ $cause })
recording-plan_over_files = thermal test: the log is in several files, what is reached is told of one alone; raise days_per_file
