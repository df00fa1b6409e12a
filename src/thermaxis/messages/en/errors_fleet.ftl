### Errors of a fleet: its lake, its registry, its nights

error-lake_protocol = This kind of lake cannot be reached: { $cause }.
    .remedy = Name a folder, or install what the message says.
error-lake_out_of_reach = The lake cannot be read or written: { $cause }.
    .remedy = Make room or bring it back, and call the command again: it goes on where it stopped.
error-lake_not_read_back = What the lake gives back is not what was written.
    .remedy = Check its disk or its server, and call the command again.
error-lake_damaged = The file in the lake is not what its sum says.
    .remedy = Ship it again from the machine: what was cut is replaced. If the machine has the day no more, the rest of the lake is not touched by it.
