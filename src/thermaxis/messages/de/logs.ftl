remark-outside_training = Eingang { $name } (seine Änderung seit dem Bezug) liegt in { FIXED($share_percent, decimals: 0) } % der Zeilen außerhalb des Bereichs der Aufzeichnungen, um bis zu { FIXED($beyond_percent, decimals: 0) } % seiner Breite: dort wird das Modell extrapoliert
remark-start_steady = { $channel } begann nicht in Ruhe: der freie Lauf beginnt im stationären Zustand der ersten Zeile, nach { $rows } gemessenen Zeilen weit wahrscheinlicher (--start rest: wie die Maschine beginnt)
remark-start_fitted = { $channel } begann nicht in Ruhe: Zustände der Verzögerungen und Nullpunkt der Aufzeichnung ({ FIXED($zero_um, decimals: 2) } um) sind an { $rows } gemessene Zeilen angepasst; so beginnt keine Maschine (--start rest: wie sie beginnt)
remark-input_failed = in { $rows } Zeilen ({ FIXED($share_percent, decimals: 1) } %) war ein Eingang zu lange ausgefallen: sie zählen nicht
remark-gap = { outcome-gap } ({ $count }-mal)
remark-clock_backward = { outcome-clock_backward } ({ $count }-mal)
remark-limits_too_narrow = die Grenzen sind zu eng: die Kompensation geht { $count }-mal in Störung; hier wird jede sofort quittiert
remark-touches_untimely = { $channel }: keine von { $touches } Antastungen zählt: was dabei wirkte, ist nicht bekannt, da Eingänge fehlten oder das Modell zwischen Zeilen neu begann; was Antastungen wert sind, zeigt sich hier nicht
remark-touches_excluded = { $channel }: { $excluded } von { $touches } Antastungen waren ausgeschlossen: wie oft anzutasten ist, sagen sie nicht. Sie liegen daneben um { $far }: Späne, ein neu gesetzter Bezugspunkt oder ein anderes Werkstück (der Maschine melden: datum_node, oder ask datum; das Protokoll dort teilen: --span, --mask), oder ein Modell, das nicht mehr gilt
remark-touches_far = { $channel }: { $excluded } von { $touches } Antastungen waren ausgeschlossen, denn sie liegen daneben um { $far }: ein Span, oder, wo spätere ihnen gleichen, ein neu gesetzter Bezugspunkt oder ein anderes Werkstück, dem der Versatz folgte (der Maschine melden: datum_node, oder ask datum)
remark-touches_contradict = { $channel }: die meisten Antastungen widersprechen dem Modell: auch das Vorzeichen der Spalte (positiv vom Werkstück weg), ihre Einheit (um, nicht mm) oder ihre Uhr kann falsch sein
remark-touches_datum = { $channel }: wurde der Bezugspunkt neu gesetzt, während das Protokoll lief? Was die Antastungen zeigen, springt um { $touches }: folgt der Versatz dem, sind Drift und Abweichung nicht die der Maschine, und wie oft anzutasten ist, wird nicht gesagt (der Maschine melden: datum_node, oder ask datum; das Protokoll dort teilen: --span, --mask)
remark-touches_touched = { $channel } wurde in { FIXED($share_percent, decimals: 0) } % der Zeilen gemessen: sind das Antastungen, nimmt sie --touches { $channel }, wie sie sind; hier kommt zu ihrem Rauschen weiteres hinzu
touches-likeliest = eine Drift von { $drift_um } um in einer Stunde und eine Abweichung von { $discrepancy_um } um zeigen sie nicht; am wahrscheinlichsten sind drift_um_per_root_h = { $likely_drift_um } und discrepancy_um = { $likely_discrepancy_um } (--touch-drift-um, --touch-discrepancy-um): das gehört in [probe] der Konfiguration
remark-touches_worse = { $channel }: der Versatz der Antastungen verschlechtert das Ergebnis ({ $offset_um } um mittlerer Betrag des Fehlers, das Modell allein { $model_um }), denn { $likeliest }
remark-touches_beyond = { $channel }: nur { $percent } % dessen, was Antastungen hinzufügen, liegt innerhalb zweier Sigma (richtig wären 95 %), denn { $likeliest }

log-never_measured = { $name }: in keiner Zeile ein Wert
    .remedy = Kanal weglassen, oder Verdrahtung und Export prüfen.
log-out_of_range = { $name }: { $count } Werte sind keine Messung, etwa { $example } { $unit }, der erste in Zeile { $row }
    .remedy = Sensor und Verdrahtung prüfen und diese Werte vor der Identifikation als fehlend kennzeichnen.
log-swapped = { $name }: tauschen in Zeile { $row } die Plätze ({ $first_before } und { $second_before } { $unit } werden { $first_after } und { $second_after })
    .remedy = Stecker und Reihenfolge der Kanäle prüfen; ab dieser Zeile tauschen, oder die Zeilen davor verwenden.
log-swapped_names = { $name }: bewegen sich mit den anderen Kanälen, als wären ihre Namen gegenüber { $reference } vertauscht
    .remedy = Einen der Sensoren mit der Hand wärmen und sehen, welcher Kanal sich bewegt.
log-stuck = { $name }: bleibt { $lasts_s } s lang bei { $value } { $unit }, von Zeile { $row } an
    .remedy = Sensor und Aufzeichnung prüfen und diese Zeilen weglassen.
log-constant = { $name }: { $value } { $unit } in allen { $rows } Zeilen
    .remedy = Als Eingang weglassen; hätte er sich bewegen sollen, den Sensor prüfen.
log-jump = { $name }: { $count ->
        [one] ein Sprung
       *[other] { $count } Sprünge, der größte
    } um { $size } { $unit } von Zeile { $row } auf Zeile { $next_row }, wo { $usual } üblich ist
    .remedy = Wärme kann das nicht: Sensor und Kontakt prüfen, und ob die Maschine bewegt wurde.
log-noisy = { $name }: ein Rauschen von { $noise } { $unit }, { FIXED($times, decimals: 0) }-mal das der anderen Kanäle
    .remedy = Schirm und Kontakt prüfen; einen anderen Sensor als Eingang nehmen, oder stärker filtern.
log-clock = die Zeiten springen in Zeile { $row } um eine Stunde, { $at_s } s nach dem Anfang
    .remedy = Lief die Aufzeichnung weiter, wurde die Uhr vorgestellt (Sommerzeit): Zeiten mit Zone exportieren.
log-gap = { $count ->
        [one] { $count } Lücke
       *[other] { $count } Lücken
    } von zusammen { $lost_s } s, die längste von { $longest_s } s nach Zeile { $row }
    .remedy = Nichts wird aufgefüllt: prüfen, ob die Maschine in der Lücke dasselbe tat wie davor und danach.
log-missing = { $name }: fehlt an { $count ->
        [one] { $count } Stelle
       *[other] { $count } Stellen
    } für zusammen { $lost_s } s, am längsten nach Zeile { $row }
    .remedy = Nichts wird aufgefüllt; Zeilen ohne Eingang oder Ausgang bleiben beim Schätzen weg.
log-quantised = { $name }: Werte kommen in Stufen von { $step } { $unit }
    .remedy = Mittelwerte über viele Zeilen nehmen, hier und in der laufenden Kompensation, oder eine feinere Ausgabe des Sensors.
log-held = { $name }: Werte ändern sich nur alle { $rows } Zeilen: die Aufzeichnung hält sie etwa { $lasts_s } s lang
    .remedy = Eine Abtastzeit von mindestens { $lasts_s } s wählen.
log-rare = { $name }: { $count }-mal für etwa { $lasts_s } s zu sehen
    .remedy = Er wird dort verwendet, wo er gemessen wurde, und nicht interpoliert.
log-uneven = { FIXED($percent, decimals: 0) } % der Zeiten zwischen den Zeilen weichen von den üblichen { $usual_s } s um mehr als ein Fünftel ab
    .remedy = Eine Abtastzeit von mehreren üblichen Schritten wählen: Mittelwerte machen die Zeiten gleichmäßig.
