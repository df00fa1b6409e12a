### What keeps a machine from being reached or written to

## Connections to OPC UA servers

error-certificate_not_trusted = The server does not trust the own certificate.
    .remedy = Trust { $certificate } on the machine (it often lies among the rejected ones there), then it connects by itself.
error-other_server_certificate = The server answers with another certificate than the stored one.
    .remedy = If the machine was really renewed, fetch its certificate with thermaxis certificate fetch and compare the fingerprint; otherwise the connection may be intercepted.
error-user_refused = The server refuses the user { $user }.
    .remedy = Check name and password, and the rights of the user on the machine.
error-log_in_refused = The server refuses the way of logging in.
    .remedy = Check name and password; some controls want a certificate from their users.
error-log_in_way_refused = The server refuses the way of logging in, such as coming without a user.
    .remedy = State a user and password with encryption, or allow anonymous access on the machine.
error-application_uri_refused = The address in the own certificate is not { $application_uri }.
    .remedy = Set application_uri to the address that thermaxis certificate show prints, or make a new certificate.
error-certificate_not_valid_now = The server reports that a certificate is not valid at this time.
    .remedy = Look at the dates with thermaxis certificate show, and at the clocks of both computers.
error-host_not_in_certificate = The server misses its name or ours in a certificate.
    .remedy = Make a new own certificate with --host and the name of this computer.
error-no_session_left = The server has no session left.
    .remedy = Close other clients, or wait until the sessions of dead ones expire.
error-security_not_offered = The server does not offer security = "{ $security }".
    .remedy = Enable it on the machine, or state what it offers and certificates: docs/how-to/opc-ua-security.md.
error-address_refused = The server does not know the address { $url }.
    .remedy = Write the address as the machine shows it, path included.
error-too_many_nodes = The server takes fewer nodes in one request than are asked for.
    .remedy = Read fewer nodes, or raise the limit on the machine.
error-no_answer_in_time = There was no answer within { $timeout_s } s.
    .remedy = Check whether the server still runs, and the network.
error-answer_not_understood = The server's answer is not understood ({ $kind }).
    .remedy = Check that the address belongs to an OPC UA server.
error-server_answers = The server answers { $status }.
    .remedy = Look the name up in the control's manual.
error-connection_failed = The connection failed: { $cause }.
    .remedy = Check that the address belongs to an OPC UA server.
error-nothing_listens = Nothing listens on port { $port } of { $host }.
    .remedy = Start the server on the machine, or correct the address.
error-unknown_host = The name { $host } is not known in the network.
    .remedy = Correct the address, or give a number.
error-connection_closed = The server closed the connection.
    .remedy = If it stays so, the server may have no connection left, or does not trust the own certificate.
error-network_failed = The network failed: { $cause }.
    .remedy = Check cables, address and firewall.
error-another_program_writes = Another program writes the offsets of this machine: its token is renewed.
    .remedy = End that program, or this one.

error-machine_silent = The machine has not answered.
    .remedy = Look at the machine and the network.

## Offsets that are not written

error-offsets_not_read_yet = Nothing is written before the offsets in the machine were read.
error-token_not_old_yet = Nothing is written before the token in the machine was seen to stand still: another program may renew it.
error-token_unread = The token that tells of other programs cannot be read, so that nothing is written.
    .remedy = Look at token_node and the rights of the user.
error-no_finite_correction = There is no finite correction for { $names }: nothing was written.
error-offset_of_unreadable = The offset of { $names } cannot be read, so that nothing is written.
    .remedy = Look at the nodes and the rights of the user.
error-unit_too_coarse = The machine counts the offset of { $names } in whole units that are coarser than a micrometre, so that nothing is written.
    .remedy = Correct the unit.
error-write_refused = The machine refused { $refused }.
    .remedy = Look at the node.
error-write_right_missing = The machine refused { $refused }.
    .remedy = Give the user the right to write it.
error-node_not_writable = The machine refused { $refused }.
    .remedy = Make the node writable on the machine.
error-no_such_node = The machine refused { $refused }.
    .remedy = Correct the node.
error-node_no_number = The machine refused { $refused }.
    .remedy = Name a node that holds a number.
error-write_out_of_range = The machine refused { $refused }.
    .remedy = Look at its range on the machine, and at the unit.

## LinuxCNC

error-linuxcnc_not_running = LinuxCNC is not running on this computer.
    .remedy = It is waited for. In a container its shared memory must be the computer's.
error-linuxcnc_of_other_user = LinuxCNC was started by the user with the number { $user }.
    .remedy = Run thermaxis as the user who starts LinuxCNC.
error-linuxcnc_changed = LinuxCNC has just ended or started.
error-no_halcmd = There is no program { $program }.
    .remedy = It comes with LinuxCNC; name its path.
error-halcmd_not_started = halcmd cannot be started: { $cause }.
error-halcmd_silent = halcmd did not answer within { $deadline_s } s.
    .remedy = It is started anew; if this stays, look whether LinuxCNC still responds.
error-halcmd_ended = halcmd has ended: { $said }
error-halcmd_pipe_broken = The pipe to halcmd broke: { $cause }.
error-halcmd_out_of_step = The pipe to halcmd is out of step.
error-hal_too_slow = The time was over before everything was asked.
error-hal_answers = HAL answers: { $said }.
    .remedy = Compare the machine's HAL file with the one that thermaxis hal writes.
error-hal_arrangement = HAL is not arranged as its file says: { $faults }
    .remedy = Compare the machine's HAL file with the one that thermaxis hal writes.
error-hal_value_differs = { $set } was set and { $found } is there.
error-hal_bit_differs = { $set } was set and is not there.
error-servo_thread_off = The servo thread does not run.
error-servo_thread_stands_still = The servo thread stands still.
error-watchdog_not_started = The watchdog does not start.
error-watchdog_tripped = The watchdog has tripped: no write came in time.
error-life_stands = The life counter { $node } has not changed for { $within_s } s: what answers for the controller goes on without it. Look whether its program runs.
error-joint_not_homed = Not homed: joint { $joints }.
