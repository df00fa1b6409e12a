### Bemerkungen zur Nacht einer Maschine

remark-nothing_measured = am Tag wurden weniger als zwei Verlagerungen gemessen: das Modell ist nicht geprüft
remark-clock_went_back = die Uhr ging { $count }-mal zurück: Minuten, die zweimal kamen, sind zusammengelegt
remark-night_failed = zweimal gescheitert und zurückgestellt: { $failure }
