### Was verhindert, dass eine Maschine erreicht oder beschrieben wird

## Connections to OPC UA servers

error-certificate_not_trusted = Der Server vertraut dem eigenen Zertifikat nicht.
    .remedy = { $certificate } an der Maschine als vertrauenswürdig einstufen (dort liegt es oft unter den abgelehnten); danach verbindet sich das Programm selbst.
error-other_server_certificate = Der Server antwortet mit einem anderen Zertifikat als dem gespeicherten.
    .remedy = Wurde die Maschine wirklich erneuert, ihr Zertifikat mit thermaxis certificate fetch holen und den Fingerabdruck vergleichen; sonst wird die Verbindung vielleicht abgefangen.
error-user_refused = Der Server weist den Benutzer { $user } ab.
    .remedy = Name und Passwort sowie die Rechte des Benutzers an der Maschine prüfen.
error-log_in_refused = Der Server weist diese Art der Anmeldung ab.
    .remedy = Name und Passwort prüfen; manche Steuerungen verlangen von Benutzern ein Zertifikat.
error-log_in_way_refused = Der Server weist diese Art der Anmeldung ab, etwa ohne Benutzer.
    .remedy = Benutzer und Passwort mit Verschlüsselung angeben oder anonymen Zugriff an der Maschine erlauben.
error-application_uri_refused = Die Adresse im eigenen Zertifikat ist nicht { $application_uri }.
    .remedy = application_uri auf die Adresse setzen, die thermaxis certificate show ausgibt, oder ein neues Zertifikat erstellen.
error-certificate_not_valid_now = Der Server meldet, dass ein Zertifikat zurzeit nicht gültig ist.
    .remedy = Die Daten mit thermaxis certificate show und die Uhren beider Rechner prüfen.
error-host_not_in_certificate = Dem Server fehlt sein oder unser Name in einem Zertifikat.
    .remedy = Ein neues eigenes Zertifikat mit --host und dem Namen dieses Rechners erstellen.
error-no_session_left = Der Server hat keine Sitzung mehr frei.
    .remedy = Andere Clients schließen oder warten, bis verwaiste Sitzungen ablaufen.
error-security_not_offered = Der Server bietet security = "{ $security }" nicht an.
    .remedy = Es an der Maschine einschalten, oder Angebotenes mit Zertifikaten angeben: docs/how-to/opc-ua-security.md.
error-address_refused = Der Server kennt die Adresse { $url } nicht.
    .remedy = Die Adresse so schreiben, wie die Maschine sie zeigt, mit Pfad.
error-too_many_nodes = Der Server nimmt in einer Anfrage weniger Knoten an, als verlangt werden.
    .remedy = Weniger Knoten lesen oder die Grenze an der Maschine anheben.
error-no_answer_in_time = Innerhalb von { $timeout_s } s kam keine Antwort.
    .remedy = Prüfen, ob der Server noch läuft, und das Netz.
error-answer_not_understood = Die Antwort des Servers ist nicht verständlich ({ $kind }).
    .remedy = Prüfen, ob die Adresse zu einem OPC-UA-Server gehört.
error-server_answers = Der Server antwortet { $status }.
    .remedy = Den Namen im Handbuch der Steuerung nachschlagen.
error-connection_failed = Die Verbindung ist gescheitert: { $cause }.
    .remedy = Prüfen, ob die Adresse zu einem OPC-UA-Server gehört.
error-nothing_listens = An Port { $port } von { $host } antwortet nichts.
    .remedy = Den Server an der Maschine starten oder die Adresse berichtigen.
error-unknown_host = Der Name { $host } ist im Netz nicht bekannt.
    .remedy = Die Adresse berichtigen oder eine Nummer angeben.
error-connection_closed = Der Server hat die Verbindung geschlossen.
    .remedy = Bleibt es so, hat der Server vielleicht keine Verbindung mehr frei oder vertraut dem eigenen Zertifikat nicht.
error-network_failed = Das Netz ist gestört: { $cause }.
    .remedy = Kabel, Adresse und Firewall prüfen.
error-another_program_writes = Ein anderes Programm schreibt die Offsets dieser Maschine: sein Token wird erneuert.
    .remedy = Jenes Programm beenden oder dieses.

error-machine_silent = Die Maschine hat nicht geantwortet.
    .remedy = Maschine und Netz prüfen.

## Offsets that are not written

error-offsets_not_read_yet = Es wird nichts geschrieben, bevor die Offsets der Maschine gelesen sind.
error-token_not_old_yet = Es wird nichts geschrieben, bevor das Token in der Maschine eine Weile unverändert ist: Ein anderes Programm könnte es erneuern.
error-token_unread = Das Token, das andere Programme zeigt, kann nicht gelesen werden, daher wird nichts geschrieben.
    .remedy = token_node und die Rechte des Benutzers prüfen.
error-no_finite_correction = Für { $names } gibt es keine endliche Korrektur: Es wurde nichts geschrieben.
error-offset_of_unreadable = Der Offset von { $names } kann nicht gelesen werden, daher wird nichts geschrieben.
    .remedy = Knoten und Rechte des Benutzers prüfen.
error-unit_too_coarse = Die Maschine zählt den Offset von { $names } in ganzen Einheiten, die gröber als ein Mikrometer sind; daher wird nichts geschrieben.
    .remedy = Die Einheit berichtigen.
error-write_refused = Die Maschine hat { $refused } abgewiesen.
    .remedy = Den Knoten prüfen.
error-write_right_missing = Die Maschine hat { $refused } abgewiesen.
    .remedy = Dem Benutzer das Schreibrecht geben.
error-node_not_writable = Die Maschine hat { $refused } abgewiesen.
    .remedy = Den Knoten an der Maschine schreibbar machen.
error-no_such_node = Die Maschine hat { $refused } abgewiesen.
    .remedy = Den Knoten berichtigen.
error-node_no_number = Die Maschine hat { $refused } abgewiesen.
    .remedy = Einen Knoten mit einer Zahl angeben.
error-write_out_of_range = Die Maschine hat { $refused } abgewiesen.
    .remedy = Den Bereich an der Maschine und die Einheit prüfen.

## LinuxCNC

error-linuxcnc_not_running = LinuxCNC läuft auf diesem Rechner nicht.
    .remedy = Es wird darauf gewartet. In einem Container muss der gemeinsame Speicher der des Rechners sein.
error-linuxcnc_of_other_user = LinuxCNC wurde vom Benutzer mit der Nummer { $user } gestartet.
    .remedy = thermaxis als der Benutzer ausführen, der LinuxCNC startet.
error-linuxcnc_changed = LinuxCNC wurde gerade beendet oder gestartet.
error-no_halcmd = Es gibt kein Programm { $program }.
    .remedy = Es gehört zu LinuxCNC; seinen Pfad angeben.
error-halcmd_not_started = halcmd kann nicht gestartet werden: { $cause }.
error-halcmd_silent = halcmd hat nicht innerhalb von { $deadline_s } s geantwortet.
    .remedy = Es wird neu gestartet; bleibt es so, prüfen, ob LinuxCNC noch antwortet.
error-halcmd_ended = halcmd wurde beendet: { $said }
error-halcmd_pipe_broken = Die Verbindung zu halcmd ist gerissen: { $cause }.
error-halcmd_out_of_step = Die Verbindung zu halcmd ist außer Takt.
error-hal_too_slow = Die Zeit war um, bevor alles gefragt war.
error-hal_answers = HAL antwortet: { $said }.
    .remedy = Die HAL-Datei der Maschine mit der vergleichen, die thermaxis hal schreibt.
error-hal_arrangement = HAL ist nicht so eingerichtet, wie seine Datei es verlangt: { $faults }
    .remedy = Die HAL-Datei der Maschine mit der vergleichen, die thermaxis hal schreibt.
error-hal_value_differs = { $set } wurde gesetzt, und { $found } ist da.
error-hal_bit_differs = { $set } wurde gesetzt und ist nicht da.
error-servo_thread_off = Der Servo-Thread läuft nicht.
error-servo_thread_stands_still = Der Servo-Thread steht still.
error-watchdog_not_started = Der Watchdog läuft nicht an.
error-watchdog_tripped = Der Watchdog hat ausgelöst: Es kam rechtzeitig kein Schreibzugriff.
error-life_stands = Der Lebenszähler { $node } hat sich seit { $within_s } s nicht geändert: Was für die Steuerung antwortet, läuft ohne sie weiter. Prüfen Sie, ob ihr Programm läuft.
error-joint_not_homed = Nicht referenziert: Achse (Joint) { $joints }.
