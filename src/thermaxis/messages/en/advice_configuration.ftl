### Advice about a configuration, read by those who write it

advice-said_of_model = { $said }
    .remedy = It was said when the model was made.
advice-range_unknown = The model does not state from which temperatures it was made for { $parts }: nothing tells when it is used outside of them.
    .remedy = Identify it from logs with thermaxis identify.
advice-reference_at_start = Temperatures count from those at the first start; what the machine had grown by then is not corrected.
    .remedy = Start it with a machine that has stood still for hours, or state references in the model.
advice-diameter_unread = The model has gains by the workpiece's diameter, and no node states it.
    .remedy = Let operators state the diameter, or name the control's node.
advice-input_unused = The model does not use it: it is only recorded.
advice-zero_plausible = 0 °C counts as plausible, and an input that is not connected often reads 0.
    .remedy = Raise lowest_c, if the machine is never that cold.
advice-frozen_unseen = A sensor that stands still is believed for ever: frozen_s is 0.
    .remedy = State a time in which the value must move, such as 14400, unless the sensor may stand still.
advice-rests_wide = The input that it moves with may go { $rests_k } K: this sensor may stick unnoticed.
    .remedy = State rests_k as `thermaxis channels` tells it from logs.
advice-time_long = It may last { $value_s } s, and the correction goes on meanwhile.
    .remedy = Choose seconds, for a hold minutes: what lasts longer is no short loss.
advice-tolerance_wide = What the machine reports may differ by { $tolerance_um } µm: a wrong unit or another writer would not be noticed.
    .remedy = Lower read_back_tolerance_um to what the machine rounds to, such as 0.5.
advice-disk_short = The history grows by about { FIXED($day_mb, decimals: 0) } MB a day and is kept for { $days } days; the disk has room for { FIXED($left_days, decimals: 0) }.
    .remedy = Lower retention_days, or keep it on a larger disk.
advice-age_below_cycle = A value older than { $longest_age_s } s is refused, and the cycle is { $cycle_s } s.
    .remedy = Raise longest_age_s to two cycles at least.
advice-no_interlock = There is no interlock: a correction goes on while the machine is off, homing or not referenced.
    .remedy = Name the nodes of the machine's states.
advice-no_heartbeat = There is no heartbeat_node: if this program dies, the machine keeps the last offset.
    .remedy = Let the PLC take the offset back when a heartbeat stands still, and name its node.
advice-other_compensation_unread = No node tells whether the builder's own compensation is active, and both together are wrong.
    .remedy = Make sure by other means that it is off.
advice-no_read_back = There is no read_back_node: what the machine made of an offset is not seen.
    .remedy = Name the node at which it reports the accepted offset.
advice-visible_step = The correction may move by { $step_um } µm from one cycle to the next, which may mark the surface.
    .remedy = Lower largest_rate_um_per_s, or shorten the cycle.
advice-fade_too_long = To fade from the limit takes { FIXED($longest_s, decimals: 0) } s, and the end of the program waits for { $stop_within_s } s: what is left stays in the machine.
    .remedy = Raise stop_within_s, and leave the rest to the machine's watchdog.
advice-limit_below_model = In the range of its training the model asks for up to { FIXED($largest_um, decimals: 0) } µm, and { $limit_um } µm are allowed.
    .remedy = Look whether the machine grows so far, and raise largest_um if it does; long at the limit is a fault.
advice-limit_wide = { $limit_um } µm are allowed, and in the range of its training the model asks for { FIXED($largest_um, decimals: 0) } µm at most.
    .remedy = Lower largest_um: a narrow limit protects.
advice-connection_unencrypted = Every computer of the network can read and change what is sent: it is not encrypted.
    .remedy = Choose security = "Basic256Sha256", with certificates of thermaxis certificate.
advice-timeout_long = A request may take { $timeout_s } s, more than half a cycle.
    .remedy = Lower timeout_s.
advice-database_unproven = sslmode=require encrypts and does not prove who answers: another computer in between would get the password and the history.
    .remedy = Write sslmode=verify-full with sslrootcert.
advice-touches_unproven = Touches of { $name } are shown only: sign and size were not proven with this configuration.
    .remedy = Run `thermaxis commission MACHINE.toml --output { $name } --touch` while the loop does not run.
advice-everybody_may_look = The pages are open to the whole network, the history included.
    .remedy = Write view_without_login = false, and make users with the role viewer.
advice-host_not_in_certificate = The pages are called { $name }, and the certificate is for { $hosts }: browsers will warn of it.
    .remedy = Make one with thermaxis certificate new and --host for every name.
