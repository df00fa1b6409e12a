### Words of the app: its first page, its end.

app-end = End
app-end_sure = End the program? Everything on its pages that was not taken along goes.
app-ended = The program has ended. This page can be closed.
app-no_token = This page opens only at the address that the program has printed, with its token. Start thermaxis app anew if the address is lost.

## what is at work in a room

room-step_waiting = At work:
room-step_reading = Reading and evaluating:
room-step_checking = Checking the sensors:
room-step_identifying = Identifying:
room-step_simulating = Simulating:
room-step_joining = Joining:
room-step_report = Writing the report:
room-refused = This cannot be done: { $said }
room-too_long = This took longer than { $limit } s and was stopped. Shorten the file, or take it to another computer.
room-too_much = This wrote more than it may and was stopped. Shorten the file, or take it to another computer.
room-too_hungry = This needed more memory than it may take, and ended. Shorten the file, or take it to another computer.
room-too_large = The file is larger than { $megabytes } MB. Shorten it, or record less often.
room-too_slow = The file has not arrived within { $limit } s. Check the connection and send it again.
room-empty = The file is empty.
room-not_stored = The file could not be stored: the disk may be full. Make room, then try again.
room-crashed = This failed. What the program prints, or its log, says more.
room-busy = Something else is being worked on. Try again in a minute.
room-own = What you asked for before is still at work. Wait for it, or cancel it.
room-gone = That is no longer there. Load the page anew.
room-bad_option = The option is not known or has no sense: { $option }
room-no_answer = The program does not answer. See that it still runs, then try again.
room-cancelled = Cancelled. Everything that was there before is still there.
room-cancel = Cancel
room-field = “{ $name }”
