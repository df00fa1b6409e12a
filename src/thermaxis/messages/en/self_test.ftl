### Findings of the self-test

## Connections

self_test-not_connected = Not connected: { $why }
    .remedy = Nothing is corrected before the machine is there; it is waited for.
self_test-no_more_answers = The server does not answer any more: { $why }
    .remedy = Look at the server and the network.
self_test-failed = The self-test itself failed: { $cause }
    .remedy = Report the cause to who maintains this program.
self_test-server_without_time = The server does not state its time: how old values are is not known.
    .remedy = Let it state its time; or write time_stamp_required = false.
self_test-clock_ahead = Connected; the server's clock is { FIXED($difference_s, decimals: 1) } s ahead of this computer's.
    .remedy = Set one of the clocks; ages are judged by the server's, records by this computer's.
self_test-clock_behind = Connected; the server's clock is { FIXED($difference_s, decimals: 1) } s behind this computer's.
    .remedy = Set one of the clocks; ages are judged by the server's, records by this computer's.
self_test-connected = Connected; the clocks differ by { FIXED($difference_s, decimals: 1) } s (many servers set the time they tell once a second).
self_test-linuxcnc = LinuxCNC runs, is arranged as it must be, and its joints are homed.
self_test-pins = LinuxCNC runs, and its pins can be read.
self_test-pins_unread = Pins of LinuxCNC cannot be read: { $why }
    .remedy = Start LinuxCNC, as the user of this program.
self_test-linuxcnc_unusable = LinuxCNC cannot be written to: { $why }
    .remedy = Start it with the HAL file that thermaxis hal writes, and home its joints.

## Nodes

self_test-no_node = The server has no node { $node } ({ $status }).
    .remedy = Look for the node with the server's own browser and correct the configuration.
self_test-node_no_number = The node { $node } is of the type { $type }, and a number is needed.
    .remedy = Look for the node with the server's own browser and correct the configuration.
self_test-node_no_flag = The node { $node } is of the type { $type }, and a Boolean or a whole number is needed.
    .remedy = Look for the node with the server's own browser and correct the configuration.
self_test-node_no_bit = The node { $node } is of the type { $type }, which has no such bit: a whole number with enough bits is needed.
    .remedy = Look for the node with the server's own browser and correct the configuration.
self_test-node_no_beat = The node { $node } is of the type { $type }, and a number or a Boolean is needed.
self_test-node_no_token = The node { $node } is of the type { $type }, and a number of 32 bits or more is needed.
    .remedy = Look for the node with the server's own browser and correct the configuration.

## Inputs

self_test-input = { FIXED($value_c, decimals: 1) } °C.
self_test-input_age = { FIXED($value_c, decimals: 1) } °C, { FIXED($age_s, decimals: 1) } s old.
self_test-input_no_value = There is no value: { $status }.
    .remedy = Look at the sensor; nothing is corrected before it has a good value.
self_test-no_time_stamp = The value has no time stamp that can be used, so that its age is not known.
    .remedy = Let the server stamp it; or write time_stamp_required = false, and a frozen value is found by frozen_s only.
self_test-value_old = The value is { FIXED($age_s, decimals: 0) } s old, and { $longest_age_s } s are allowed.
    .remedy = Look at the sensor; some servers stamp a value only when it changes: then raise longest_age_s.
self_test-input_other_unit = The value { $raw } is { $value_c } °C as configured, which is not plausible ({ $lowest_c } to { $highest_c } °C); it would be with { $others }.
    .remedy = Check the node's unit, and write { $first } if it is so.
self_test-input_zero = { FIXED($value_c, decimals: 1) } °C is not plausible ({ $lowest_c } to { $highest_c } °C); an input that is not connected often reads 0.
    .remedy = Look at sensor, unit and plausible range.
self_test-input_implausible = { FIXED($value_c, decimals: 1) } °C is not plausible ({ $lowest_c } to { $highest_c } °C).
    .remedy = Look at sensor, unit and plausible range.
self_test-redundant_differs = The redundant sensor differs by { SIGNED($difference_k, decimals: 1) } K, and { $largest_k } K are allowed.
    .remedy = Look at both sensors: one of them is wrong, or they are not at the same place.

## Flags and diameter

self_test-flag_no_truth = Its value is { $value }, and a flag is 0 or 1.
    .remedy = Name a node that is true or false, or 0 or 1; any other number counts as no value.
self_test-interlock_met = It is met.
self_test-interlock_open = It is not met at present.
    .remedy = Until it is met, nothing is corrected.
self_test-interlock_no_value = There is no value: { $status }.
    .remedy = Without a value the interlock counts as a lost input: nothing is enabled, and a correction at work is held for a while and then fades.
self_test-other_compensation_no_value = There is no value: { $status }.
    .remedy = Make sure by other means that the builder's own compensation is off.
self_test-other_compensation_active = Another compensation is active on the machine: together they are wrong.
    .remedy = Switch the builder's own compensation off; or leave thermaxis off.
self_test-other_compensation_off = No other compensation is active.
self_test-diameter = { $diameter_mm } mm.
self_test-diameter_no_value = There is no value: { $status }.
    .remedy = An operator can state it.
self_test-diameter_implausible = { $diameter_mm } mm is not plausible for a workpiece.
    .remedy = Check node and unit.
self_test-diameter_outside = { $diameter_mm } mm lies outside the model's gains, { $least_mm } to { $most_mm } mm: the gain at the end is taken.
    .remedy = Check node and unit.

## Probes

self_test-probe = { SIGNED($value_um, decimals: 1) } µm, of unknown age.
self_test-probe_age = { SIGNED($value_um, decimals: 1) } µm, { FIXED($age_s, decimals: 1) } s old.
self_test-probe_counter = The counter stands at { $count }.
self_test-probe_no_value = There is no value: { $status }.
    .remedy = The compensation does not need the probe.
self_test-probe_unusable = The probe cannot be used: { $why }
    .remedy = The compensation does without it; correct the configuration.
self_test-probe_not_asked = The probe cannot be asked, its own connection to the server of the inputs gives no answer: { $why }
    .remedy = The compensation does without it; it is tried again by itself.

## Outputs

self_test-output = An offset of { FIXED($found_um, decimals: 1) } µm stands in the machine.
self_test-output_not_writable = The server does not let this user write the offset.
    .remedy = Give the user the right to write; on a SINUMERIK with the method GiveUserAccess.
self_test-output_unreadable = The offset that stands in the machine cannot be read: { $status }.
    .remedy = Let it be readable: a correction begins where the offset stands.
self_test-output_always_zero = The node takes whole { $unit } only: a correction of up to { $total_um } µm is always written as 0.
    .remedy = Check the unit, or let the PLC offer a finer one.
self_test-output_too_narrow = A correction of { $total_um } µm does not fit into { $type } in { $unit }.
    .remedy = Check the unit, or lower the limits.
self_test-output_coarse = The node takes whole { $unit } only: the correction moves in steps of { $step_um } µm, which may mark the surface.
    .remedy = Let the PLC offer a finer unit; is it one already, such as 0.1 um?
self_test-output_other_unit = The offset found is { $raw }, in { $unit } { $found_um } µm: far beyond the limit of { $total_um } µm, but plausible in { $others }.
    .remedy = Check the unit; if it is right, set the offset to zero by hand.
self_test-output_beyond = An offset of { FIXED($found_um, decimals: 1) } µm stands in the machine, beyond the limit of { $total_um } µm.
    .remedy = Find out who wrote it; once enabled it is a fault and goes to zero at the allowed rate.
self_test-read_back = The machine reports { FIXED($reported_um, decimals: 1) } µm.
self_test-read_back_no_value = There is no value: { $status }.
    .remedy = Nothing that is read back for too long is a fault.
self_test-read_back_differs = The machine reports { FIXED($reported_um, decimals: 1) } µm, { SIGNED($difference_um, decimals: 1) } µm from what was written last.
    .remedy = Without a heartbeat the machine may have taken the offset back; else check the node.
self_test-heartbeat = It can be written.
self_test-life = The life counter is there.
self_test-heartbeat_not_writable = The server does not let this user write the heartbeat.
    .remedy = Give the user the right to write.
self_test-offset_gone = The offset has no value any more: { $status }.
    .remedy = Try again.
self_test-offset_not_written_back = The offset that was found cannot be written back: { $status }.
    .remedy = Give the user the right to write, and look whether the machine lets it be written in its present mode.
self_test-offset_written_back = The offset that was found was written back: it can be written.
self_test-history_unreachable = The database of the history cannot be reached now: { $cause }. Records wait in memory meanwhile.
self_test-port_unusable = Port { $port } cannot be listened at now: { $cause }. If this machine's screen runs, it is the one that holds it; if not, it will not start.
