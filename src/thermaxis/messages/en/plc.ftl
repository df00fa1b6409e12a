### What an export to a PLC has changed, and what it warns of: in signs that a remark may have

change-delay_in_whole_cycles = delay of { $part }: { $model_s } s in the model, { $here_s } s here
change-touches_of_calls = touches: what stood at their time is known for { $calls } calls, { $here_s } s
change-references_stated = references: those that the model states, in place of those at the start

warning-large_step = { $output } may move by { $step_um } um in one call, rate times cycle: a finished surface shows it. Take a shorter cycle or a smaller rate
warning-never_corrects = { $output } never corrects: all its gains are zero
warning-open_input_plausible = 0.0 degC lies in the plausible range of { $channel }: an open input that reads 0.0 is not told from a temperature by it. Wire ok_ to its diagnosis
warning-restart_at_zero = This model counts from its start. After a restart of a machine that is warm it begins at zero and at rest: what had grown before is not corrected. Let it run through, let the machine cool before a restart, or export with --reference stated.
warning-restart_at_zero_lasts = This model counts from its start. After a restart of a machine that is warm it begins at zero and at rest: the correction is wrong for about three of its slowest time constants, { $hours } h, and what had grown before is not corrected. Let it run through, let the machine cool before a restart, or export with --reference stated.
warning-cycle_of_machine = the cycle is { $cycle_s } s here and { $machine_cycle_s } s in the configuration of the machine: with its rate a call may move the correction { $times } times as far
warning-model_of_machine = the configuration of the machine is for the model { $model }, exported is { $exported }: its limits and rules may not suit it
text-model_with_hash = { $name } ({ $sha256 })

remark-frozen_by_default = a temperature without any change for { $hours } h counts as frozen, and the corrections go to zero, also where a good sensor of coarse steps rests in an even room. State --frozen-s or --moves-with: what thermaxis channels tells from logs
remark-large_instance = the instance data take { $size } bytes, which small CPUs of the S7-300 class have no data block for: choose a longer cycle where delays are long
remark-no_redundant_in_block = the block has no redundant sensors: choose between two before it
remark-one_interlock = interlocks_met is one input for { $interlocks }
