### Errors of the runtime: configuration, connections, history, certificates, users

## Configuration

error-several_problems = There are { $count } problems: { $problems }
error-key_needed = The key { $name } is missing.
    .remedy = It means: { $meaning }.
error-key_needed_here = The key { $name } is missing.
    .remedy = Add it; docs/machine-toml.md says what it means.
error-unknown_key_near = '{ $name }' is not a key here.
    .remedy = Did you mean { $near }?
error-key_of_other_kind = { $name } has no meaning where the kind is { $kind }.
    .remedy = Leave it out, or choose another kind.
error-value_unknown = This value is not known.
    .remedy = Write { $known }.
error-value_refused = { $said }.
    .remedy = It means: { $meaning }.
error-no_number = This is not a number.
    .remedy = Write digits without quotation marks.
error-no_whole_number = This is not a whole number.
    .remedy = Write digits only.
error-no_boolean = This is neither true nor false.
    .remedy = Write true or false, without quotation marks.
error-below_bound = This is less than { $bound }.
    .remedy = It means: { $meaning }.
error-above_bound = This is more than { $bound }.
    .remedy = It means: { $meaning }.
error-not_above_bound = This is not more than { $bound }.
    .remedy = It means: { $meaning }.
error-not_below_bound = This is not less than { $bound }.
    .remedy = It means: { $meaning }.
error-text_short = This is empty or shorter than { $bound } characters.
    .remedy = It means: { $meaning }.
error-text_long = This is longer than { $bound } characters.
    .remedy = It means: { $meaning }.
error-control_character = The text has a control character.
    .remedy = Write plain text.
error-scale_zero = A factor of zero makes every value zero.
    .remedy = Write another factor, or leave the table out.
error-secret_in_file = The { $name } itself is in the file.
    .remedy = Write it into a file that only its owner can read and name that as { $name }_file, or a variable as { $name }_environment; and change the { $name }.
error-variable_not_set = The environment variable { $name } is not set, or empty.
    .remedy = Set it before the program starts.
error-no_secret_in_file = The file does not hold a secret.
    .remedy = Write the secret as its first line, as UTF-8.
error-file_overwritten = It would be written over the file of { $other }.
    .remedy = Name a file of its own.
error-no_state_file = This file is there, and is no state of the loop: it would be overwritten.
    .remedy = Name a file that is not there yet. If this one is a damaged state, move it away.
error-folder_not_found = There is no such folder.
    .remedy = Make it, or name another one.
error-file_too_long = The file is longer than { $most_bytes } bytes.
    .remedy = Name the file itself.
error-file_open_to_others = The file can be read or changed by others than its owner.
    .remedy = Run chmod 600 on it, and replace the secret: others may know it.
error-reserved_name = The name { $name } is that of something else that is read.
    .remedy = Choose another name.
error-interlock_name = The name has other characters than letters, digits, _ and -, or is too long.
    .remedy = Choose another name.
error-node_twice = The node is the same as that of { $first }.
    .remedy = Check both nodes.
error-no_node_id = '{ $text }' is not a node id.
    .remedy = Write it as ns=2;s=Name, nsu=urn:of:the:machine;s=Name, or i=85.
error-no_hal_pin = '{ $text }' is no pin of HAL.
    .remedy = Write hal: and a name that 'halcmd show pin' prints, such as hal:motion.motion-enabled.
error-hal_pin = '{ $text }' is a pin of HAL, and this is not read from LinuxCNC.
    .remedy = Write a node of the server, or kind = "linuxcnc" in the table [source].
error-unknown_sign = The sign '{ $sign }' is not one of the two sentences.
    .remedy = Write "{ $away }" or "{ $towards }"; thermaxis commission proves which is right.
error-replay_moves_machine = A replayed log would move the machine by temperatures that it does not have.
    .remedy = Write kind = "dry"; or, where the sink is a simulation, may_move_a_machine = true in the table [source].
error-not_of_model = The model { $model } has no output { $name }.
    .remedy = There are { $known }.
error-channel_without_table = The model { $model } has a channel without the table [{ $table }].
    .remedy = Add the table, or correct the name of another one.
error-output_without_table = The model { $model } has an output without the table [{ $table }].
    .remedy = Add the table, or correct the name of another one.
error-no_output_named = There is no output.
error-joint_twice = Two outputs act on joint { $joint }.
    .remedy = Give every output a joint of its own.
error-no_linear_unit = { $unit } is not a unit of a linear joint.
    .remedy = State mm or inch, as LINEAR_UNITS in the machine's INI file does.
error-watchdog_outside = { $value_s } s is not from one and a half cycles of { $cycle_s } s to { $most_s } s.
    .remedy = Two cycles let one late write pass.
error-no_hal_thread = This is not the name of a HAL thread.
error-scale_unusable = The scale is not a finite number other than zero.
    .remedy = Leave it out where the node holds the value itself.

## Models to choose

error-no_model_folder = No other model may be chosen on this machine.
    .remedy = State model_folder in the table [machine].
error-proposal_of_other_model = Another model is in force now than the one that this proposal was compared with.
    .remedy = Relearn again, or choose the model on the page of models.
error-nothing_to_roll_back = The model in force was not accepted from a proposal of this folder.
    .remedy = Choose another model on the page of models.
error-no_model_name = This is not a name in the folder of the models.
    .remedy = Name a file in the folder of the models.
error-no_such_model = There is no such model: { $cause }.
    .remedy = Name a file in the folder of the models.
error-model_outside_folder = This is not a file inside the folder of the models.
    .remedy = Name a file in the folder of the models.

## Servers and pages

error-pair_incomplete = The key { $name } is missing.
    .remedy = Certificate and private key go together.
error-users_needed = The server can be reached from other computers, and has no users.
    .remedy = Write users, certificate and private_key, or take the address 127.0.0.1.
error-certificate_for_users_missing = Users have passwords, which need an encrypted connection, and the certificate is missing.
    .remedy = Make one with thermaxis certificate new, and write certificate and private_key.
error-anonymous_from_outside = The server can be reached from other computers without a user's name.
    .remedy = Write anonymous_role = "none", or take the address 127.0.0.1.
error-nobody_can_connect = No client could connect: there are no users and no anonymous role.
    .remedy = Write users with a certificate, or anonymous_role = "viewer".
error-token_unusable = The token is not plain text of at least { $fewest } characters.
    .remedy = Make one with openssl rand -hex 32.
error-token_needed = An address that others can reach needs a certificate and a token.
    .remedy = State certificate, private_key and token_file, or take 127.0.0.1.
error-publisher_unbegun = The program beside the loop, with status server, metrics and history, did not begin.
    .remedy = See what it has printed; is there memory left?
error-cannot_listen = Port { $port } cannot be listened at: { $cause }.
    .remedy = Take another port, or end the program that has it.
error-no_screen_table = The table [server] or the table [screen] is missing.
    .remedy = Add it; docs/machine-toml.md says what every key means.
error-screen_without_server = The pages show the status server's values, and the table [server] is missing.
    .remedy = Add a table [server], such as one with anonymous_role = "viewer".
error-screen_unencrypted = The pages can be reached from other computers, and the certificate is missing: passwords would be sent without encryption.
    .remedy = Make one with thermaxis certificate new, and write certificate and private_key, or take the address 127.0.0.1.
error-screen_without_name = The pages are served at every address of this computer, and no name is stated by which browsers reach them: each would be refused.
    .remedy = Write the names that people type, such as hosts = ["lathe-3.shop"].
error-no_host_name = '{ $name }' is not the name of a computer.
    .remedy = Write names alone, such as "lathe-3.shop", "10.0.0.5:8450" or "[fd00::5]".
error-no_address = '{ $name }' is no address of a computer.
    .remedy = Write numbers, such as "10.0.0.7" or "fd00::7".
error-idle_too_long = A log-in ends after { $longest_s } s in any case, and idle_s is longer.
    .remedy = Lower idle_s, or raise longest_login_s.
error-password_without_user = There is a password and no user.
    .remedy = Write the user as well.
error-user_needs_password = There is a user and no password.
    .remedy = Name password_file or password_environment.
error-port_twice = The port is that of [{ $table }] at the same address.
    .remedy = Take another one, such as 8450.
error-server_port_changes = A free port is taken at every start, and the pages would not know which.
    .remedy = Write the port, such as 4850.
error-screen_sees_nothing = The status server shows nothing without a user's name, and no user is stated: the pages would be empty.
    .remedy = Make a user with thermaxis user and the role viewer, and write user and password_file, or anonymous_role = "viewer" in the table [server].
error-server_without_users = The status server has no users.
    .remedy = Leave the user out, or write users in the table [server].
error-nobody_can_look = The status server has no users who could log in, and the pages are not open.
    .remedy = Write view_without_login = true, or users in the table [server].
error-server_without_certificate = The status server has no certificate, so that connections to it are not encrypted.
    .remedy = Leave it out, or write certificate and private_key in the table [server].
error-client_certificate_missing = Every log-in is an encrypted connection to the status server, and client_certificate is missing.
    .remedy = Make one with thermaxis certificate new, and write client_certificate and client_private_key.

## Connections

error-no_opcua_address = This is not the address of an OPC UA server.
    .remedy = Write it as opc.tcp://host:4840/path.
error-user_in_address = The address contains a user or a password.
    .remedy = Write user and password_file as keys of their own.
error-user_unencrypted = A password is never sent over a connection that is not encrypted.
    .remedy = Choose a policy such as Basic256Sha256 with certificates, or leave the user out.
error-certificate_missing = The key { $name } is missing, and the connection shall be encrypted.
    .remedy = Make and fetch certificates with thermaxis certificate, and name the files.
error-certificate_unused = The connection is not encrypted, and a certificate is stated.
    .remedy = Choose a policy such as Basic256Sha256, or leave the certificates out.

## Certificates and users

error-no_certificate = This is not a certificate.
    .remedy = Give a certificate as DER or PEM; thermaxis certificate new makes one, fetch stores that of a server.
error-key_locked = The private key is locked by a password.
    .remedy = Store it without one, readable by its owner only.
error-no_rsa_key = This is not a private RSA key.
    .remedy = Make certificate and key with thermaxis certificate new.
error-pair_differs = Certificate and private key do not belong together.
    .remedy = Name the two files that were made together.
error-pair_unusable = The certificate and the key { $key_file } cannot be used together: { $cause }.
    .remedy = Give a certificate and its own key, without a password, as thermaxis certificate new --use server makes them.
error-application_uri_differs = The certificate is for the address { $found }, not { $stated }.
    .remedy = Set application_uri to it, or make a certificate with --uri.
error-no_application_uri = This cannot be the address of an application.
    .remedy = Write it as urn:company:machine:thermaxis.
error-same_file_twice = Certificate and key would be the same file.
    .remedy = Name two files.
error-file_kept = The file exists already.
    .remedy = Choose another name, or say --replace to renew it.
error-password_short = The password has fewer than { $fewest } characters.
    .remedy = Take several words.
error-no_pin = A PIN has at least { $fewest } digits and nothing else, 32 at most.
error-pin_of_operators = '{ $name }' is no operator: nobody else has a PIN.
error-no_user_name = '{ $name }' is not a name for a user.
    .remedy = Take at most { $most } letters, digits, spaces and - _ . @
error-not_a_user_table = '{ $name }' is not a list of users.
    .remedy = Each user is one table [[user]].
error-too_many_users = There are more than { $most } users.
error-user_keys = A user has name, role and hash, each a text.
error-no_argon2id_hash = The hash is not an argon2id hash of reasonable cost.
    .remedy = Write it with thermaxis user add.

## One program at a time

error-machine_in_use = Another program (process { $pid }) already runs { $machine }.
    .remedy = End it first: two would write the same offset.
error-offset_in_use = Another program (process { $pid }) already writes the offset { $offset }.
    .remedy = End it first, or give each configuration an offset of its own.
error-disk_without_locks = A second program at the machine cannot be excluded: the disk keeps no locks ({ $cause }).
    .remedy = Put the file on a disk of this computer.
error-connection_not_alone = The file needs one table [connection.NAME], and no second one.
    .remedy = docs/machine-toml.md says what stands in it.
error-loop_not_asked = The loop cannot be asked: { $cause }.
    .remedy = Is it running on this computer? Ask as the user that it runs as.
error-history_in_use = Another program writes to this history.
    .remedy = Give each machine a history of its own, or end the other program.
error-recording_in_use = Another recording (process { $pid }) writes logs named { $name } here.
    .remedy = End it, or choose another folder or another name.

## History

error-no_database_url = This is not the URL of a database.
    .remedy = Write sqlite:///lathe.history.db, or postgresql+psycopg://user@host/database with the password apart from it.
error-no_file_in_url = The URL names no file of SQLite.
    .remedy = Write sqlite:///lathe.history.db.
error-unknown_database = The history is not kept in databases of the kind { $kind }.
    .remedy = Write sqlite:///lathe.history.db, or postgresql+psycopg://user@host/database with the password apart from it.
error-sqlite_without_password = SQLite has no password.
    .remedy = Leave it out; the permissions of its folder decide who may read the file.
error-database_unencrypted = The connection to another computer is not encrypted for certain.
    .remedy = End the address with ?sslmode=verify-full, and with &sslrootcert=FILE where the database's certificate comes from an authority of your own.
error-password_in_address = The address contains a password.
    .remedy = Write it into a file that only its owner can read, name that as password_file (--password-file for a command), and change the password.
error-text_no_database = This is a text, not a database: it is left as it is.
    .remedy = Name the file of the history in the URL.
error-history_damaged = The file is damaged: { $detail }.
    .remedy = Copy it away; the loop puts it aside and begins a new one when it starts.
error-history_version = The history has version { $found } of its tables, this program has { $known }.
    .remedy = Use the program that wrote it, or name another database.
error-history_unreadable = The history cannot be read: { $cause }.
    .remedy = Check it with thermaxis history check.
error-no_history = There is no history in this database.
    .remedy = Check the URL.
error-history_not_there = There is no such file: no loop has written this history yet.
    .remedy = Start the loop (thermaxis run MACHINE.toml), or check the path.
error-history_empty = The history has no cycles.
error-no_cycle_in_span = There is no cycle in this span.
    .remedy = The history reaches from { $first } to { $last }.
error-no_matching_column = No column has such a name.
    .remedy = There are { $known }.
error-server_history_copied = A history on a server is not copied here.
    .remedy = Use pg_dump.
error-question_interrupted = The question was interrupted.
error-trend_without_span = The span of a trend is empty.
error-history_earlier = This history was written by an earlier kind of this program, which packed its cycles.
    .remedy = Name another database in the configuration; read the old one with the program that wrote it.
error-history_folder_missing = A history on a server needs a folder for its finished days.
    .remedy = State the folder.
error-history_folder_lost = The folder with the finished days of this history is not there: mount it or move it back; if it is lost, make an empty one.
    .remedy = Bring the folder back beside the database, or state its new place as historian.folder and start the loop once.
error-history_files_foreign = The folder has finished cycles that this database has never handed over: another database has written them.
    .remedy = Give each database a folder of its own, or bring back the database that belongs to this one.
error-database_encoding = The database stores text as { $found }, not as UTF8: it cannot keep a history.
    .remedy = Make one with createdb --encoding=UTF8 --template=template0.
error-part_incomplete = Cycles are missing from what was to become a file: the rows stay where they are.
    .remedy = Check the history with thermaxis history check.
error-part_not_read_back = The file that was written does not hold what it should: it is given up, and the rows stay where they are.
    .remedy = Check the disk.

## Commissioning

error-step_moved_otherwise = The tool point moved by { SIGNED($moved_um, decimals: 1) } µm where { SIGNED($asked_um, decimals: 2) } µm was asked for: the offset goes back.
    .remedy = Check the units of this output and of what measured, before anything else.
error-step_untold = The machine reports no part of the step before the whole: it cannot be tried by little, and is not made.
    .remedy = Take a larger step.
error-offset_unreadable = The offset in the machine cannot be read.
    .remedy = Run thermaxis check.
error-step_outside_limits = The offset found, { FIXED($found_um, decimals: 1) } µm, and the step lie outside of the limits.
    .remedy = Bring the offset to zero on the machine, or step the other way.
error-offset_not_back = The offset did not come back to { FIXED($goal_um, decimals: 2) } µm; the machine reports { FIXED($found_um, decimals: 2) } µm.
    .remedy = Take it back on the control before anything is machined.
error-offset_differs = The machine reports an offset of { FIXED($reported_um, decimals: 2) } µm where { FIXED($written_um, decimals: 2) } µm was written: it goes back.
    .remedy = Check unit and limits on the machine, and who else writes the offset.
error-offset_refused = The machine did not take an offset of { FIXED($written_um, decimals: 2) } µm.
    .remedy = Look at the control.

## Recording

error-no_file_name = This cannot begin a file name.
    .remedy = Write up to 60 letters, digits, _ - and points.
error-no_connection = There is no connection.
    .remedy = Write a table such as [connection.control].
error-channels = There are { $channels } channels, and 1 to { $most } can be recorded.
    .remedy = Write a table such as [channel.T_spindle_C] for each.
error-same_but_case = The name differs from { $other } in upper and lower case only.
    .remedy = Rename one of them.
error-no_whole_milliseconds = This is not a whole number of milliseconds.
    .remedy = Round it to 0.001.
error-output_unstated = There are several outputs, and one is proven at a time.
    .remedy = Name one of { $known }.
error-connection_unstated = There are several connections, and the channel names none.
    .remedy = Write one of { $known }.
error-no_channel_name = This cannot be the name of a column.
    .remedy = Begin with a letter, and write up to 100 letters, digits, _ - and points.
error-unit_differs = The name ends in the unit { $in_name }, and the unit is { $unit }.
    .remedy = Rename the channel, or convert with factor and offset.
error-name_of_times = A reader of the log would take this column for times.
    .remedy = Rename the channel.
error-name_read_otherwise = A reader of the log would find another name or unit.
    .remedy = Rename the channel.

## HAL of LinuxCNC, compared with its file

error-hal_not_run = { $thread } does not run { $functions }.
error-hal_too_late = { $function } must run before { $motion }.
error-hal_too_early = { $function } must run after { $motion }.
error-hal_order = The order in { $thread } is not { $functions }.
error-hal_unread = { $pin } cannot be read.
error-hal_watchdog_long = The watchdog's time is { $found_s } s, more than { $most_s } s.
error-hal_watchdog_short = The watchdog's time is { $found_s } s, too short for cycles of { $cycle_s } s.
error-hal_bound = { $pin } is { $found }, not within { $bound }.
error-hal_unconnected = Not connected with each other: { $pins }.
error-hal_leads_nowhere = { $pin } leads nowhere.
error-hal_load_used = { $pin } is used: the offset would jump.
