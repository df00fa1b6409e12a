### Was beim Lesen oder Verbinden eines thermischen Protokolls auffiel

remark-heading_cut = die Überschrift der Spalte { $column } wurde auf ihre ersten Zeichen gekürzt
remark-values_beyond = Spalte { $name }: { $count } Werte mit einem Betrag über 1e9 sind keine Messwerte und gelten als fehlend
remark-word_in_cells = '{ $word }' steht in { $count ->
        [one] einer Zelle, die eine Zahl enthalten sollte: sie gilt
       *[other] { $count } Zellen, die Zahlen enthalten sollten: sie gelten
    } als fehlend
remark-line_cut_short = die letzte Zeile der Datei ist abgeschnitten und wurde weggelassen
remark-variables_left_out = Variablen, die nicht so lang wie die Zeiten sind, wurden weggelassen: { $names }
remark-values_no_measurement = { $count } Werte von { $name } sind keine Messung, etwa { $example }: sie gelten als fehlend (Zeilen { $row } bis { $last })
remark-rows_masked = wie verlangt ausgeblendet: { $rows } Zeilen von { $name }, von { $row } bis { $last }, gelten als fehlend
remark-all_rows_masked = wie verlangt ausgeblendet: { $rows } Zeilen aller Kanäle, von { $row } bis { $last }, gelten als fehlend
remark-rows_stuck = { $name } bleibt { $lasts_s } s lang bei { $value } { $unit }, obwohl er sich hätte ändern sollen: { $rows } Zeilen, von { $row } bis { $last }, gelten als fehlend
remark-touches_repeated = { $name } zeigt { $touches } Werte in { $rows } Zeilen, wie wo eine Steuerung die letzte Antastung wiederholt, und jede Zeile gilt als gemessen: sind das Antastungen, nur die erste Zeile jedes Werts behalten und die anderen leeren (record: counter_node)
remark-displacement_joined = { $name } springt in Zeile { $row }, { $at_s } s nach dem Anfang, um { $size } ± { $within } { $unit }, was Wärme nicht kann (ein Taster auf null gesetzt, eine Maschine bewegt): Die Zeilen ab dort wurden vom Nullpunkt davor weitergeführt
remark-displacements_late = { $names } folgen den Temperaturen, als wären sie { $shift_s } s zu spät gestempelt: Sie wurden zurückgeschoben; antwortet die Maschine selbst so spät, mit --as-logged behalten
remark-displacements_early = { $names } gehen den Temperaturen voraus, als wären sie { $shift_s } s zu früh gestempelt: Sie wurden weitergeschoben, um mehr, als Sensoren abseits der Wärme zu spät sind
remark-displacements_seem_late = { $names } folgen den Temperaturen, als wären sie { $shift_s } ± { $within_s } s zu spät gestempelt: Nichts wurde verschoben (die Identifikation tut es ab 400 s und ohne --delay); die Uhren der Schreiber vergleichen (Wärme, die einen Weg hat, bewirkt dasselbe)
remark-displacements_seem_early = { $names } gehen den Temperaturen voraus, als wären sie { $shift_s } ± { $within_s } s zu früh gestempelt: Nichts wurde verschoben (die Identifikation tut es ab 400 s und ohne --delay); die Uhren der Schreiber vergleichen (Sensoren abseits der Wärme bewirken dasselbe)
remark-channel_drifts = ein Sensor scheint stetig zu driften, einer von { $sensors } über das Protokoll, oder aber { $output } selbst, um { SIGNED($um_per_h) } ± { $within_um_per_h } um/h: Mit einem solchen Anstieg ist die Aufzeichnung viel wahrscheinlicher (sie wird benutzt, wie sie ist; gegen einen anderen Sensor prüfen)

## Reihenfolge und Zeiten

remark-seconds_assumed = Spalte { $column } nennt keine Einheit: als Sekunden genommen, sodass das Protokoll { $lasts } dauert; eine andere in der Überschrift (time_min) oder in einer Zuordnung angeben (time.unit)
remark-rows_without_time = { $count } Zeilen haben keine Zeit und wurden weggelassen
remark-rows_in_bursts = Zeilen kommen in Schüben von etwa { $rows } alle { $step_s } s: Ein Modell wird aus Mitteln über eine solche Zeit gelernt
remark-rows_turned_round = die Zeilen laufen von der spätesten zur frühesten: Sie wurden umgekehrt
remark-midnights_passed = die Uhrzeiten nennen kein Datum: Sie wurden über Mitternacht weitergeführt (so oft: { $count })
remark-times_repeated = { $count } Zeilen haben die Zeit einer anderen, die erste davon { $at_s } s nach dem Anfang: Von jeder Spalte zählt der erste Wert
remark-clock_too_coarse = { $count } Zeilen haben die Zeit einer anderen, die erste davon { $at_s } s nach dem Anfang: Von jeder Spalte zählt der erste Wert; die Uhr ist für diesen Schreiber zu grob, und die meisten Messwerte gehen verloren
remark-rows_sorted = { $count } Zeilen stehen nicht in der Reihenfolge der Zeit: Die Zeilen wurden nach der Zeit geordnet
remark-rows_sorted_in = { $count } Zeilen standen nicht in der Reihenfolge der Zeit und wurden eingeordnet
remark-rows_repeat_times = { $count } Zeilen von Zeile { $row } an wiederholen Zeiten, die schon da waren (die Uhr ging um { $back_s } s zurück): Sie wurden weggelassen
remark-clock_set_back = die Uhr wurde in Zeile { $row } um { $back_s } s zurückgestellt: Spätere Zeiten wurden mit dem üblichen Schritt von { $usual_s } s weitergeführt
remark-clock_set_back_one_hour = die Uhr wurde in Zeile { $row } um { $back_s } s zurückgestellt (eine Stunde): Spätere Zeiten wurden mit dem üblichen Schritt von { $usual_s } s weitergeführt
remark-daylight_saving_ended = die Uhr wurde in Zeile { $row } um { $back_s } s zurückgestellt (eine Stunde, wie am Ende der Sommerzeit): Spätere Zeiten wurden mit dem üblichen Schritt von { $usual_s } s weitergeführt

## Zwei Schreiber

remark-joined_by_shift = { $log } wurde mit der angegebenen Verschiebung von { $shift_s } s verbunden
remark-joined_by_channels = { $log } wurde mit einer Verschiebung von { $shift_s } s verbunden, gefunden aus { $names } (auf { $within_s } s bekannt, Korrelation { FIXED($correlation, decimals: 4) })
remark-joined_by_times_of_day = { $log } wurde nach den Uhrzeiten verbunden: Kein Kanal ist gemeinsam, um sie zu prüfen
remark-columns_renamed = Spalten von { $log } wurden umbenannt: { $names }
