event_kind-start = Start
event_kind-stop = Ende
event_kind-state = Zustand
event_kind-request = Anforderung
event_kind-connection = Verbindung
event_kind-alarm = Alarm
event_kind-commission = Inbetriebnahme
event_kind-touch = Antastung
event_kind-loss = Lücke

priority-critical = kritisch
priority-high = hoch
priority-medium = mittel
priority-low = niedrig

event-state_reasons = { CODE($state, "state") }: { CODE($reasons, "reason") }
event-state_named = { CODE($state, "state") }: { CODE($reasons, "reason") } ({ NAME($names) })
event-state = { CODE($state, "state") }
event-request_accepted = { CODE($request, "request") }: angenommen, { $answer }
event-request_refused = { CODE($request, "request") }: abgelehnt, { $answer }
event-role_refused = { $method } abgelehnt: als { CODE($role, "role") } nicht erlaubt, nötig ist { CODE($needed, "role") }
event-loop_started = die Kompensation von { $machine } wurde gestartet
event-self_test_passed = der Selbsttest ist bestanden
event-no_saved_state = kein gespeicherter Zustand: { $why }
event-saved_state = ein vor { DURATION($age_s) } gespeicherter Zustand: { $resumed }
event-saved_state_newer = der gespeicherte Zustand ist neuer als jetzt: er wird nicht verwendet
event-saved_state_newer_fault = der gespeicherte Zustand ist neuer als jetzt: er wird nicht verwendet, außer der Störung, die bestehen bleibt: { CODE($reason, "reason") }
event-source_connected = die Verbindung zur Maschine der Messwerte besteht
event-source_lost = die Verbindung zur Maschine der Messwerte ist unterbrochen
event-sink_connected = die Verbindung zur Maschine der Versätze besteht
event-sink_lost = die Verbindung zur Maschine der Versätze ist unterbrochen
event-source_reason = die Maschine der Messwerte: { $reason }
event-sink_reason = die Maschine der Versätze: { $reason }
event-logged_in = { $name } hat sich am Statusserver angemeldet
event-log_in_refused = { $name } wurde vom Statusserver abgewiesen
event-not_stored = Der Verlauf konnte { DURATION($lasted_s) } lang nicht geschrieben werden: { $why }
event-history_damaged = Der Verlauf { $file } ist beschädigt ({ $detail }): er wurde als { $aside } beiseitegelegt und ein neuer begonnen
event-part_unwritten = fertige Stunden bleiben Zeilen der Datenbank, denn ihre Datei kann nicht geschrieben werden ({ $detail })
event-old_days_kept = Tage jenseits der Aufbewahrung bleiben, denn ihre Dateien können nicht gelöscht werden ({ $detail })
event-unshipped_kept = { $days } Tage jenseits der Aufbewahrung bleiben, bis sie verschickt sind (thermaxis history ship)
event-unshipped_deleted = nicht verschickte Tage sind gelöscht, denn es sind doppelt so viele da, wie aufbewahrt werden sollen ({ $detail })
event-day_unjoined = die Dateien fertiger Tage bleiben einzeln, denn sie können nicht zusammengefügt werden ({ $detail })
event-self_test = Selbsttest: { $finding }
event-touch = Antastung von { NAME($name) }, { SIGNED($value_um, decimals: 1) } µm: { CODE($outcome, "touch") }
event-alarm_gone = gegangen: { $alarm }
event-alarm = { CODE($priority, "priority") }: { $alarm }
event-offset_unusable = was in der Maschine steht, ist kein Versatz: es wird nichts geschrieben
event-state_saved_again = gegangen: der Zustand kann wieder gespeichert werden
event-state_unsaved = der Zustand kann in { $file } nicht gespeichert werden: { $detail }
event-users_unreadable = niemand ist bekannt: { $problem }
event-users_readable = die Benutzerdatei wird wieder gelesen
event-publisher_ended = das Programm mit Statusserver, Messwerten und Verlauf ist beendet: es wird neu gestartet
event-server_unopened = ein Server des Programms neben der Regelung ist geschlossen und wird jede Minute wieder versucht: { $reason }
event-status_server_ended = der Statusserver kann seinen Abonnenten nichts mitteilen ({ $detail }): er wird beendet, und mit ihm jede Verbindung; innerhalb einer Minute beginnt ein neuer
event-certificate_not_yet_valid = das Zertifikat { $file } gilt erst ab { $date }: Uhren prüfen
event-certificate_expired = das Zertifikat { $file } ist am { $date } abgelaufen: Server weisen es ab; erneuern
event-certificate_expires = das Zertifikat { $file } läuft am { $date } ab: erneuern
failure-history_unwritable = Der Verlauf kann nicht gespeichert werden: { $detail }.
failure-part_unwritten = Fertige Stunden bleiben Zeilen der Datenbank, denn ihre Datei kann nicht geschrieben werden: { $detail }.
failure-history_opening = Der Verlauf wird seit { FIXED($lasts_s, decimals: 0) } s geöffnet.
failure-database_silent = Die Datenbank antwortet seit { FIXED($lasts_s, decimals: 0) } s nicht.
failure-history_replaced = Die Datei des Verlaufs wurde entfernt oder ersetzt.
failure-historian_ended = Die Aufzeichnung des Verlaufs ist beendet.
failure-publisher_ended = Das Programm neben der Regelung, mit Statusserver, Messwerten und Verlauf, ist beendet; es wird neu gestartet.
failure-publisher_silent = Das Programm neben der Regelung, mit Statusserver, Messwerten und Verlauf, antwortet seit { FIXED($lasts_s, decimals: 0) } s nicht.
event-records_lost =
        nicht im Verlauf: { $cycles ->
            [one] { $cycles } Zyklus
           *[other] { $cycles } Zyklen
        } und { $events ->
            [one] { $events } Ereignis
           *[other] { $events } Ereignisse
        }
event-step_proven = Vorzeichen und Größe stimmen: { FIXED($moved_um, decimals: 1) } um auf { SIGNED($asked_um, decimals: 1) } um
event-step_not_measured = was gemessen wurde, ist keine Zahl: nichts ist bewiesen
event-step_without_effect = der Werkzeugpunkt bewegte sich um { FIXED($moved_um, decimals: 1) } um statt um { SIGNED($asked_um, decimals: 1) } um: der Versatz wirkt nicht, oder erst nach einer Freigabe an der Steuerung
event-step_other_way = der Werkzeugpunkt bewegte sich in die andere Richtung, um { FIXED($moved_um, decimals: 1) } um: das Vorzeichen dieses Ausgangs ist falsch oder das der Messung; sehen Sie nach, wohin das Werkzeug geht, bevor Sie eines ändern
event-step_other_size = der Werkzeugpunkt bewegte sich um { FIXED($moved_um, decimals: 1) } um statt um { SIGNED($asked_um, decimals: 1) } um, { FIXED($times, decimals: 2) }-mal so weit: die Einheit dieses Ausgangs ist falsch
event-step_not_back = der Rückweg ließ { FIXED($left_um, decimals: 1) } um übrig: Reibung, Drift, oder etwas anderes bewegt die Achse
event-loop_ended = die Kompensation von { $machine } wurde beendet
event-loop_ended_standing = die Kompensation von { $machine } wurde beendet; in der Maschine bleibt: { $standing }
resumed-enabled = { $kept }; sie ist eingeschaltet wie zuvor
resumed-off = { $kept }; sie ist aus
resumed-fault = { $kept }; die Störung besteht weiter: { CODE($reason, "reason") }

kept-sections = Glieder und Bezugstemperaturen werden übernommen
kept-steady_state = das Modell beginnt im eingeschwungenen Zustand, mit den gespeicherten Bezugstemperaturen
kept-other_model = er ist von einem anderen Modell, { $file }; die Bezugstemperaturen werden übernommen, und jemand muss einschalten


why-no_file = es gibt keine Datei
why-damaged = { $file } ist beschädigt ({ $detail })
why-other_version = { $file } stammt von einer anderen Version des Programms ({ $version }): er wird nicht verwendet
