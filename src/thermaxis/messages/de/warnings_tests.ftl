### Was über eine thermische Prüfung bekannt sein muss

warning-thermal_test_short = die Prüfung dauert { $hours } h; üblich sind mindestens { $least_h } h, oft 24 h [M]
warning-thermal_test_ended_early = es lief { $hours } h: kürzer als { $least_h } h und nicht, bis die letzten 60 min weniger als { $percent } % der ersten 60 min ändern [M]
warning-thermal_test_highest_passed = die Geschwindigkeit ging bis { $highest }, über die angegebene höchste von { $stated }: die Anteile im Spektrum sind solche von { $highest }
warning-thermal_test_moves_at_once = die Maschine bewegt sich schon in der ersten Zeile: der Nullpunkt ist vielleicht nicht der einer ruhenden Maschine, und dann sind die Spannen zu klein
warning-thermal_test_cooling_short = nach der Bewegung wurden { $minutes } min aufgezeichnet; üblich sind mindestens 60 min Stillstand [M]
warning-thermal_test_turned = { $channel } liegt in { $percent } % der Zeilen über dem Stillstand: das ist keine Abweichung durch Umgebungstemperatur (ETVE)
warning-thermal_test_probes_missing = nicht gemessen: { $probes }; was sie zeigen, gehört nicht zu dieser Prüfung
warning-thermal_test_without_ambient = keine Umgebungstemperatur ist benannt: ihre Spanne und ihr Gradient fehlen
warning-thermal_test_not_stated = in [uncertainty] nicht angegeben: { $keys }; U ist ohne ihre Beiträge
warning-thermal_test_gap = { $quantity } hat ab Minute { $at_min } für { $minutes } min keinen Wert: was dort geschah, steht in keiner Spanne
warning-thermal_test_model_failed = in { $percent } % der Zeilen war ein Eingang des Modells zu lange ausgefallen
warning-thermal_test_of_training = das Modell wurde an diesem Log identifiziert: was es übrig lässt, beweist nichts, das tut erst eine andere Prüfung
