### Errors of a fleet: its lake, its registry, its nights

error-lake_protocol = This kind of lake cannot be reached: { $cause }.
    .remedy = Name a folder, or install what the message says.
error-lake_out_of_reach = The lake cannot be read or written: { $cause }.
    .remedy = Make room or bring it back, and call the command again: it goes on where it stopped.
error-lake_not_read_back = What the lake gives back is not what was written.
    .remedy = Check its disk or its server, and call the command again.
error-no_registry = There is no registry in this database.
    .remedy = Make one with thermaxis fleet init.
error-registry_older = The registry has version { $found } of its tables, this program has { $known }.
    .remedy = Call thermaxis fleet init: nothing of what is there is lost.
error-registry_newer = The registry has version { $found } of its tables, this program has { $known }.
    .remedy = Use the program that wrote it, or a newer one.
error-registry_out_of_reach = The registry cannot be read or written: { $cause }.
    .remedy = Bring it back and call the command again: what was stored is not done again.
error-no_proposal = Nothing is proposed for the model that { $name } has in force.
    .remedy = thermaxis fleet machine shows what was.
error-proposal_decided = The newest proposal for { $name } was decided on already.
    .remedy = thermaxis fleet machine shows by whom, and why.
error-scheduler_out_of_reach = The scheduler cannot be reached: { $cause }.
    .remedy = Check its address, and that it runs the same versions.
error-scheduler_lost = The scheduler has gone.
    .remedy = Start it and call the command again: what was stored is not done again.
error-day_not_over = The day is not over.
    .remedy = Name an earlier one; days are UTC.
error-lake_damaged = The file in the lake is not what its sum says.
    .remedy = Ship it again from the machine: what was cut is replaced. If the machine has the day no more, the rest of the lake is not touched by it.
