### Die Morgentafel einer Flotte und die Geschichte einer Maschine.

common-page_fleet = Flotte
fleet-title = Nacht zum { $day }
fleet-no_nights = Es gibt noch keine Nacht
fleet-named = { $count } von { $all } Maschinen sind anzusehen
fleet-quiet = Die übrigen: { $count }
fleet-more = { $count } weitere: nach Art oder Name auswählen.
fleet-all = Alle Maschinen
fleet-look = Was anzusehen ist

fleet-need_set_aside = Zurückgestellt
fleet-do_set_aside = Die Nacht dieser Maschine ist zweimal gescheitert: wer die Flotte betreut, muss es wissen.
fleet-since = seit { $day }
fleet-need_sensors = Sensor
fleet-need_proposal = Ein Modell ist vorgeschlagen
fleet-do_proposal = Vergleichen, was vorher und nachher bleibt, dann annehmen oder ablehnen.

fleet-kind = Art
fleet-every_kind = jede Art
fleet-text = Name enthält
fleet-choose = Auswählen
fleet-machine = Maschine
fleet-day = Nacht zum
fleet-outcome = Modell
fleet-outcome_verified = geprüft
fleet-outcome_unverified = nicht geprüft
fleet-outcome_set_aside = zurückgestellt
fleet-outcome_none = noch keine Nacht
fleet-touches = Antastungen
fleet-rmse = Bleibt [µm]
fleet-mean = Mittel [µm]
fleet-offset_mae = Mit Antastungen [µm]
fleet-found = Befund

fleet-model = Modell
fleet-models = Modelle, die in Kraft waren
fleet-nights = Nächte
fleet-residual = Was das Modell jede Nacht übrig lässt
fleet-rmse_of_night = Quadratisches Mittel
fleet-mean_of_night = Mittel
fleet-offset_of_night = Mittlerer Betrag mit Antastungen
fleet-no_figures = Noch keine Nacht hat das Modell geprüft.
fleet-mark_model = Modell { $sha256 }: { $why }
fleet-mark_proposed = Modell { $sha256 } vorgeschlagen
fleet-mark_accepted = { $who } hat { $sha256 } angenommen: { $why }
fleet-mark_rejected = { $who } hat { $sha256 } abgelehnt: { $why }
fleet-mark_withdrawn = { $who } hat { $sha256 } zurückgezogen: { $why }

fleet-axis = Achse { $axis }: Kenngrößen nach ISO 230-2 [{ $unit }]
fleet-start = Beginn
fleet-run = Lauf
fleet-drift_free = { $figure } ohne Drift

fleet-proposals = Vorschläge
fleet-proposed = Modell { $sha256 }, vorgeschlagen von der Nacht zum { $day }
fleet-open = niemand hat entschieden
fleet-why = Warum
fleet-accept = Annehmen
fleet-reject = Ablehnen
fleet-nothing_written = Auf die Maschine wird nichts geschrieben: was angenommen ist, kommt in ihren Ordner der Modelle und wird dort gewählt.
fleet-download = Herunterladen
fleet-who_decides = Ein angemeldeter Einrichter entscheidet.
fleet-nobody_decides = Diese Seite wurde ohne Benutzerdatei gestartet: hier entscheidet niemand.
fleet-decided_before = Nicht ausgeführt: jemand hat schon entschieden, oder ein neueres Modell ist vorgeschlagen. Die Seite neu laden.
fleet-no_why = Den Grund angeben.
fleet-no_decision = Das ist keine Entscheidung über einen Vorschlag.
fleet-no_machine = Die Maschine steht nicht im Register.
fleet-no_model = Kein angenommener Vorschlag hat diesen Hash.
fleet-no_registry = Das Register antwortet nicht: { $said }
