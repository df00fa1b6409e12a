### Wörter der App: ihre erste Seite, ihr Ende.

app-end = Beenden
app-ended = Das Programm ist beendet. Diese Seite kann geschlossen werden.
app-no_token = Diese Seite öffnet sich nur unter der Adresse, die das Programm gedruckt hat, mit ihrem Schlüssel. Ist die Adresse verloren, starten Sie thermaxis app neu.
