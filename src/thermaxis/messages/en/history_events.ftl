## Kinds of events

event_kind-start = start
event_kind-stop = stop
event_kind-state = state
event_kind-request = request
event_kind-connection = connection
event_kind-alarm = alarm
event_kind-commission = commission
event_kind-touch = touch
event_kind-loss = loss

## Priorities of alarms

priority-critical = critical
priority-high = high
priority-medium = medium
priority-low = low

## Events

event-state_reasons = { CODE($state, "state") }: { CODE($reasons, "reason") }
event-state_named = { CODE($state, "state") }: { CODE($reasons, "reason") } ({ NAME($names) })
event-state = { CODE($state, "state") }
event-request_accepted = { CODE($request, "request") }: accepted, { $answer }
event-request_refused = { CODE($request, "request") }: refused, { $answer }
event-role_refused = { $method } refused: { CODE($role, "role") } may not, it needs { CODE($needed, "role") }
event-loop_started = the loop of { $machine } started
event-self_test_passed = the self-test passed
event-no_saved_state = no saved state: { $why }
event-saved_state = a state saved { DURATION($age_s) } ago: { $resumed }
event-saved_state_newer = the saved state is newer than now: it is not used
event-saved_state_newer_fault = the saved state is newer than now: it is not used, but for the fault, which stands: { CODE($reason, "reason") }
event-source_connected = the connection to the values' machine is there
event-source_lost = the connection to the values' machine is lost
event-sink_connected = the connection to the offsets' machine is there
event-sink_lost = the connection to the offsets' machine is lost
event-source_reason = the values' machine: { $reason }
event-sink_reason = the offsets' machine: { $reason }
event-logged_in = { $name } logged in to the status server
event-log_in_refused = { $name } was refused by the status server
event-not_stored = The history could not be written for { DURATION($lasted_s) }: { $why }
event-history_damaged = The history { $file } is damaged ({ $detail }): it was put aside as { $aside } and a new one begun
event-part_unwritten = finished hours stay rows of the database, for their file cannot be written ({ $detail })
event-old_days_kept = days beyond those to be kept stay, for their files cannot be deleted ({ $detail })
event-unshipped_kept = { $days } days beyond those to be kept stay until they are shipped (thermaxis history ship)
event-unshipped_deleted = days that were not shipped are deleted, as there are twice as many as are to be kept ({ $detail })
event-day_unjoined = the files of finished days stay apart, for they cannot be joined ({ $detail })
event-self_test = self-test: { $finding }
event-touch = touch of { NAME($name) }, { SIGNED($value_um, decimals: 1) } µm: { CODE($outcome, "touch") }
event-alarm_gone = gone: { $alarm }
event-alarm = { CODE($priority, "priority") }: { $alarm }
event-offset_unusable = what stands in the machine is no offset: nothing is written
event-state_saved_again = gone: the state can be saved again
event-state_unsaved = the state cannot be saved in { $file }: { $detail }
event-users_unreadable = nobody is known: { $problem }
event-users_readable = the file of users is read again
event-publisher_ended = the program beside the loop, with status server, metrics and history, has ended: it is begun anew
event-server_unopened = a server of the program beside the loop is closed, and tried again every minute: { $reason }
event-status_server_ended = the status server cannot tell its subscribers ({ $detail }): it is ended, and every connection with it; another one is begun within a minute
event-certificate_not_yet_valid = the certificate { $file } is valid from { $date } on only: check the clocks
event-certificate_expired = the certificate { $file } expired on { $date }: servers will refuse it; renew it
event-certificate_expires = the certificate { $file } expires on { $date }: renew it
failure-history_unwritable = The history cannot be written: { $detail }.
failure-part_unwritten = Finished hours stay rows of the database, for their file cannot be written: { $detail }.
failure-history_opening = The history has been opening for { FIXED($lasts_s, decimals: 0) } s.
failure-database_silent = The database has not answered for { FIXED($lasts_s, decimals: 0) } s.
failure-history_replaced = The file of the history was removed or replaced.
failure-historian_ended = The historian has ended.
failure-publisher_ended = The program beside the loop, with status server, metrics and history, has ended; it is begun anew.
failure-publisher_silent = The program beside the loop, with status server, metrics and history, has said nothing for { FIXED($lasts_s, decimals: 0) } s.
event-records_lost =
        { $cycles ->
            [one] { $cycles } cycle
           *[other] { $cycles } cycles
        } and { $events ->
            [one] { $events } event
           *[other] { $events } events
        } are not in the history
event-step_proven = sign and size are right: { FIXED($moved_um, decimals: 1) } um for { SIGNED($asked_um, decimals: 1) } um
event-step_not_measured = what was measured is no number: nothing is proven
event-step_without_effect = the tool point moved by { FIXED($moved_um, decimals: 1) } um instead of { SIGNED($asked_um, decimals: 1) } um: the offset does not act, or only after a release on the control
event-step_other_way = the tool point moved the other way, by { FIXED($moved_um, decimals: 1) } um: the sign of this output is wrong, or that of what measured; see which way the tool goes before you change either
event-step_other_size = the tool point moved by { FIXED($moved_um, decimals: 1) } um instead of { SIGNED($asked_um, decimals: 1) } um, { FIXED($times, decimals: 2) } times as far: the unit of this output is wrong
event-step_not_back = the way back left { FIXED($left_um, decimals: 1) } um: friction, drift, or something else moves the axis
event-loop_ended = the loop of { $machine } ended
event-loop_ended_standing = the loop of { $machine } ended; left in the machine: { $standing }
resumed-enabled = { $kept }; it is enabled as before
resumed-off = { $kept }; it is off
resumed-fault = { $kept }; the fault stands: { CODE($reason, "reason") }

## What a restart goes on from

kept-sections = sections and references are taken up
kept-steady_state = the model starts at the steady state, with the saved references
kept-other_model = it is of another model, { $file }; the references are taken up, and somebody must enable it


## Why a saved state is not used

why-no_file = there is no file
why-damaged = { $file } is damaged ({ $detail })
why-other_version = { $file } is of another version of the program ({ $version }): it is not used
