### Was man über einen gemessenen Lauf wissen muss

## Prüfbedingungen nach ISO 230-2

warning-few_targets_linear = { $targets } Zielpositionen sind weniger als die { $required }, die ISO 230-2 von einer Linearachse über { $length } mm verlangt
warning-few_targets_rotary = { $targets } Zielpositionen sind weniger als die { $required }, die ISO 230-2 von einer Drehachse über { $length }° verlangt (Regel aus dem Gedächtnis)
warning-few_cycles = { $cycles } Zyklen, { $cycles } Ablesungen jeder Zielposition, sind weniger als die { $required }, die ISO 230-2 verlangt
warning-few_readings = Zielposition { $target } hat { $readings } Ablesungen { $approach }, weniger als die { $required }, die ISO 230-2 verlangt
warning-many_cycles = { $cycles } Zyklen sind mehr als die { $required }, die ISO 230-2 verlangt: Die Kenngrößen folgen ihren Formeln, aber aus einer längeren Prüfung, in der sich die Maschine stärker erwärmt
warning-targets_equidistant = die Zielpositionen liegen gleichmäßig ({ $mean } { $unit }), ohne den Zufallsanteil der Gleichung (1): Periodische Fehler der Achse können verborgen bleiben
warning-interval_too_long = der größte Abstand der Zielpositionen ist { $interval } mm; ISO 230-2 verlangt höchstens { $most_mm } mm auf einer Achse über { $length_mm } mm
warning-interval_uneven = der Abstand nach Zielposition { $target } ({ $interval } { $unit }) ist mehr als doppelt so groß wie der mittlere ({ $mean } { $unit }): Die Achse ist ungleichmäßig abgetastet
warning-step_cycle = Stufenzyklus (Anhang B von ISO 230-2:2014): nicht zur Abnahme, wenn nicht vereinbart; er verbirgt einen Teil der Drift, die ein Standardzyklus zeigt
warning-pilgrim_cycle = Pilgerschrittzyklus: nicht der Standardzyklus von ISO 230-2; nicht zur Abnahme, wenn nicht vereinbart
warning-readings_missing = { $count } Ablesung(en) { $approach } fehlen, die erste an Zielposition { $target } in Zyklus { $cycle }: Jede Zielposition behält ihre eigene Zahl von Ablesungen
warning-travel_reversed = die Ablesungen { $approach } in Zyklus { $cycles } wurden nicht nacheinander in dieser Richtung genommen, wie es ein Standardzyklus tut: Richtungen prüfen oder die Art des Zyklus nennen
warning-cycles_interleave = Ablesungen eines Zyklus wurden zwischen denen eines anderen genommen, wie in einem Stufenzyklus und nicht in einem Standardzyklus: die Art des Zyklus nennen

## Benachbarte Differenzen

warning-one_cycle = nur ein Zyklus: Die benachbarten Differenzen haben keine Streuung und das Diagramm keine Grenzen
warning-no_pair_twice = kein Paar hat zwei vollständige Zyklen: Das Diagramm hat keine Grenzen
warning-pair_without_spread = die Positionen { $position } und { $next } { $approach } haben nur einen vollständigen Zyklus: Ihre Differenz hat keine Streuung
warning-student_factor = { $cycles } Zyklen sind weniger als { $enough }: Die Grenzen im Diagramm der Abweichungen sind mit dem Faktor von Student aufgeweitet ({ FIXED($factor, decimals: 3) } statt 2)
warning-student_factor_of_pair = { $cycles } vollständige Zyklen an den Positionen { $position } und { $next } { $approach } sind weniger als { $enough }: Die Grenzen im Diagramm der Abweichungen sind mit dem Faktor von Student aufgeweitet ({ FIXED($factor, decimals: 3) } statt 2)
warning-anchor_outlying = die Ablesung an Position { $position } { $approach } in Zyklus { $cycle }, an der das Diagramm der Abweichungen hängt, liegt weit von den anderen: Das ganze Diagramm ist verschoben; einen anderen Bezugszyklus wählen

## Drift

warning-outlier_left_out = die Ablesung an Zielposition { $target } { $approach } in Zyklus { $cycle } liegt { SIGNED($residual, decimals: 2) } { $unit } neben dem Driftmodell: Sie blieb aus dem Modell und seinen Kenngrößen; die gemessenen enthalten sie
    .short = Ausreißer: Zielposition { $target } { $approach } in Zyklus { $cycle }, { SIGNED($residual, decimals: 2) } { $unit } daneben; ohne Drift weggelassen
warning-more_outliers = { $count } weitere Ablesungen liegen daneben und wurden ebenso weggelassen
    .short = Ausreißer: { $count } weitere, ohne Drift weggelassen
warning-outliers_in_model = mindestens { $count } weitere Ablesungen liegen daneben, aber höchstens { $most } (5 % der Ablesungen) bleiben aus dem Modell: Was ohne Drift genannt wird, enthält die übrigen; suchen, was einzelne Ablesungen stört
    .short = Ausreißer: mindestens { $count } weitere, in den driftfreien Kenngrößen, da höchstens { $most } wegbleiben
warning-most_changes = { $most } Sprünge sind genannt, nach mehr wird nicht gesucht: Es kann weitere geben, und was ohne Drift genannt wird, kann falsch sein
    .short = Sprünge: { $most }, nach mehr wird nicht gesucht
warning-heavy_tailed_noise = { $far } von { $readings } Ablesungen liegen weiter als { $limit } robuste Standardabweichungen vom Driftmodell, wo es bei normalem Rauschen { FIXED($expected) } wären: Das Rauschen hat schwere Enden; seine Standardabweichung ist die eines normalen Rauschens mit denselben Quartilen, und die Bänder sind die der übrigen Ablesungen; suchen, was einzelne Ablesungen stört (kurze Haltezeit, Schwingung, Luft im Strahl)
    .short = Rauschen: schwere Enden, { $far } von { $readings } Ablesungen jenseits von { $limit } robusten Standardabweichungen
warning-change_common = { $when } sprangen alle Zielpositionen um { SIGNED($size, decimals: 2) } ± { FIXED($within) } { $unit }: Gerät neu genullt oder Optik berührt, ein Schlupf in der Maschine, oder Kühlmittel, Tür oder Antrieb geschaltet; was ohne Drift genannt wird, gilt für die Seite von t0
    .short = Sprung: { $when } alle Zielpositionen um { SIGNED($size, decimals: 2) } ± { FIXED($within) } { $unit }
warning-change_stretch = { $when } sprang die letzte Zielposition um { SIGNED($size, decimals: 2) } ± { FIXED($within) } { $unit } gegen die erste, die anderen im Verhältnis: eine andere Kompensation von Luft- oder Materialtemperatur, ein Strahl oder Maßstab neu gesetzt, oder verdrehte Optik; was ohne Drift genannt wird, gilt für die Seite von t0
    .short = Sprung: { $when } die letzte Zielposition um { SIGNED($size, decimals: 2) } ± { FIXED($within) } { $unit } gegen die erste
warning-change_unsure = { $when } wanderten alle Zielpositionen um { SIGNED($size, decimals: 2) } ± { FIXED($within) } { $unit } neben der Drift davor und danach: Der Lauf kann einen Sprung nicht von einer Drift über die Pause unterscheiden; was ohne Drift genannt wird, gilt für die Seite von t0
    .short = Pause: { $when } alle Zielpositionen um { SIGNED($size, decimals: 2) } ± { FIXED($within) } { $unit }
change-at = nach { FIXED($time_min, decimals: 1) } min, in Zyklus { $cycle },
change-in_order = in Zyklus { $cycle }
change-in_pause = in den { FIXED($pause_min, decimals: 1) } min ohne Ablesung um { FIXED($time_min, decimals: 1) } min, bevor Zyklus { $cycle } weiterging, sofort oder langsam,
warning-order_as_time = die Ablesungen haben keine Zeiten: Ihre Reihenfolge dient als Zeit
warning-axis_bows = die Achse biegt sich mit der Zeit: Der Drift wurde eine Parabel der Position hinzugefügt
warning-swing_too_fast = die ganze Achse schwingt mit einer Periode von etwa { FIXED($time, decimals: 1) } { $unit }, { FIXED($cycles, decimals: 1) } Zyklen: zu schnell, um sie sicher von den mittleren Abweichungen zu trennen, deren Unsicherheiten zu klein sein können; kürzere Zyklen mit weniger Zielpositionen oder kürzerem Halten würden helfen
warning-noise_correlated = das Rauschen aufeinanderfolgender Ablesungen ähnelt sich etwa { FIXED($time, decimals: 0) } { $time_unit } lang (Standardabweichung dieses Teils { FIXED($std, decimals: 2) } { $unit }), wie bei unruhiger Luft oder einer Störung, die zu schnell zum Verfolgen ist: Die Unsicherheiten sind darum aufgeweitet; mehr Zyklen helfen dagegen, mehr Ablesungen in einem Zyklus kaum
    .short = Rauschen: etwa { FIXED($time, decimals: 0) } { $time_unit } lang ähnlich in aufeinanderfolgenden Ablesungen ({ FIXED($std, decimals: 2) } { $unit }), wie bei unruhiger Luft; U ist aufgeweitet
warning-visits_hide_drift = jede Zielposition wurde in einem kurzen Teil des Laufs gemessen: Diese Reihenfolge verbirgt Drift in den mittleren Abweichungen, und nur deren Unsicherheiten zeigen, wie viel
warning-target_drifts_otherwise = Zielposition { $targets } driftet anders als die übrige Achse: Das Driftmodell gilt dort nicht, und seine Bänder sind zu schmal
warning-targets_drift_otherwise = die Zielpositionen driften anders als durch eine gemeinsame Drift und ein Wachsen, keine davon klar allein: Das Driftmodell gilt nicht, und seine Bänder sind zu schmal

## Ein Lauf gegen seinen Plan

warning-other_kind = der Lauf wurde an einer Achse der Art { $kind } gemessen; der Plan ist für die Art { $planned }
warning-other_axis = der Lauf nennt die Achse „{ $axis }“; der Plan ist für Achse { $planned }
warning-other_cycle = der Lauf ist vom Zyklus { $cycle }; der Plan verlangt { $planned }
warning-other_number_of_cycles = { $cycles } Zyklen wurden gemessen; der Plan verlangt { $planned }
warning-approach_not_planned = Anfahrten { $approach } wurden gemessen, ohne geplant zu sein
warning-approach_not_measured = die geplanten Anfahrten { $approach } wurden nicht gemessen
warning-target_elsewhere = Zielposition { $target } liegt bei { FIXED($position, decimals: 3) } { $unit } statt bei { FIXED($planned, decimals: 3) } { $unit }
warning-more_targets_elsewhere = { $count } weitere Zielpositionen liegen anderswo als geplant
warning-other_number_of_targets = { $targets } Zielpositionen wurden gemessen; der Plan hat { $planned }
warning-targets_not_measured = { $count } Zielposition(en) geplant und nicht gemessen, die erste bei { FIXED($position, decimals: 3) } { $unit }
warning-targets_not_planned = { $count } Zielposition(en) gemessen und nicht geplant, die erste bei { FIXED($position, decimals: 3) } { $unit }
warning-targets_differ = Zielpositionen weichen vom Plan ab: Ablesungen, Reihenfolge und Zeiten wurden nicht mit ihm verglichen
warning-planned_readings_missing = { $count } geplante Ablesung(en) { $approach } fehlen, die erste an Zielposition { $target } in Zyklus { $cycle }
warning-order_not_known = die Reihenfolge der Ablesungen ist nicht bekannt: Reihenfolge und Haltezeit wurden nicht verglichen
warning-order_deduced = die Reihenfolge wurde aus Nummern der Durchgänge erschlossen: Reihenfolge und Haltezeit wurden nicht verglichen
warning-order_differs = die Reihenfolge der Ablesungen verlässt den Plan bei Ablesung { $reading }: Zielposition { $target } { $approach } in Zyklus { $cycle }, wo Zielposition { $planned_target } { $planned_approach } in Zyklus { $planned_cycle } geplant war; { $count } von { $readings } Ablesungen stehen nicht an ihrem Platz, die Haltezeit wurde nicht verglichen
warning-times_not_stated = die Datei nennt nicht die Zeit jeder Ablesung: Die Haltezeit wurde nicht verglichen
warning-stops_shorter = Ablesungen folgen einander { FIXED($shorter_s, decimals: 1) } s früher als geplant (Median): Von den geplanten { $planned_s } s bleiben an jedem Halt { FIXED($left_s, decimals: 1) } s, wenn nicht der Vorschub höher als { $feed } { $unit }/min war
warning-stops_longer = Ablesungen folgen einander { FIXED($longer_s, decimals: 1) } s später als geplant (Median): Beschleunigen oder Aufzeichnen dauert länger, oder das Halten war länger als { $planned_s } s
warning-run_paused = der Lauf pausierte { $count } Mal; die längste Pause, { FIXED($longest_min, decimals: 1) } min, kam vor Zielposition { $target } { $approach } in Zyklus { $cycle }

## Eine Auswertung

warning-no_drift_model = kein Driftmodell: { $error } { $remedy }
warning-no_adjacent_differences = keine benachbarten Differenzen: { $error } { $remedy }
warning-no_figures_of_other_standard = keine Kenngrößen der anderen Norm: { $error } { $remedy }
warning-cycle_of_option = die Datei nennt den Zyklus { $stated }, die Option den Zyklus { $cycle }
warning-single_run_rule = die Achse ist länger als 2000 mm: s, R und A werden nicht ausgewertet{ $cycles ->
        [one] {""}
       *[other] , obwohl es { $cycles } Läufe gibt (Mittel aus allen)
    }; verlangen mit --full
warning-draft = das digitale Kalibrierzertifikat ist ein Entwurf: Die Datei von --header nennt nicht { $missing }
warning-not_in_pdf = { $count ->
        [one] { $count } Zeichen
       *[other] { $count } Zeichen
    } in { $names } kann das PDF nicht zeigen; die Seite, die --report NAME.html schreibt, zeigt sie in ihrem Text
warning-not_in_charts = { $count ->
        [one] { $count } Zeichen
       *[other] { $count } Zeichen
    } in { $names } können die Diagramme nicht zeigen; dort steht für jedes ein leeres Kästchen
