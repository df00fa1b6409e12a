### Wörter der App: ihre erste Seite, ihr Ende.

app-end = Beenden
app-end_sure = Programm beenden? Alles auf seinen Seiten, was nicht mitgenommen wurde, geht verloren.
app-ended = Das Programm ist beendet. Diese Seite kann geschlossen werden.
app-no_token = Diese Seite öffnet sich nur unter der Adresse, die das Programm gedruckt hat, mit ihrem Schlüssel. Ist die Adresse verloren, starten Sie thermaxis app neu.

## woran in einem Raum gearbeitet wird

room-step_waiting = In Arbeit:
room-step_reading = Lesen und Auswerten:
room-step_checking = Sensoren werden geprüft:
room-step_identifying = Identifizieren:
room-step_simulating = Simulieren:
room-step_joining = Verbinden:
room-step_report = Bericht wird geschrieben:
room-refused = Das geht nicht: { $said }
room-too_long = Das dauerte länger als { $limit } s und wurde angehalten. Kürzen Sie die Datei, oder nehmen Sie einen anderen Rechner.
room-too_much = Das schrieb mehr, als es darf, und wurde angehalten. Kürzen Sie die Datei, oder nehmen Sie einen anderen Rechner.
room-too_hungry = Das brauchte mehr Speicher, als es nehmen darf, und endete. Kürzen Sie die Datei, oder nehmen Sie einen anderen Rechner.
room-too_large = Die Datei ist größer als { $megabytes } MB. Kürzen Sie sie, oder zeichnen Sie seltener auf.
room-too_slow = Die Datei ist nicht innerhalb von { $limit } s angekommen. Verbindung prüfen und erneut senden.
room-empty = Die Datei ist leer.
room-not_stored = Die Datei konnte nicht abgelegt werden: Der Datenträger ist vielleicht voll. Platz schaffen, dann erneut versuchen.
room-crashed = Das ist fehlgeschlagen. Mehr sagt, was das Programm ausgibt, oder sein Protokoll.
room-busy = Es wird an etwas anderem gearbeitet. Versuchen Sie es in einer Minute erneut.
room-own = Was Sie zuvor verlangten, läuft noch. Warten Sie darauf oder brechen Sie es ab.
room-gone = Das ist nicht mehr da. Laden Sie die Seite neu.
room-bad_option = Die Option ist unbekannt oder ergibt keinen Sinn: { $option }
room-no_answer = Das Programm antwortet nicht. Nachsehen, ob es noch läuft, dann erneut versuchen.
room-cancelled = Abgebrochen. Alles Vorherige ist noch da.
room-cancel = Abbrechen
room-field = „{ $name }“
