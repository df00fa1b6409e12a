### Was man über eine Identifikation wissen muss

warning-no_steady_start = kein Versuch beginnt in einem stationären Zustand: Was die Maschine vor dem Beginn tat, ist geschätzt, und damit langsame Zeitkonstanten und stationäre Verstärkungen (einen Versuch hinzufügen, der kalt beginnt)
warning-dc_gains_not_supported = die Aufzeichnung stützt nicht jede stationäre Verstärkung: Das Modell gilt für Änderungen, die so lange dauern wie die der Aufzeichnung, nicht für längere (einen längeren Versuch hinzufügen oder einen, der kalt beginnt)
warning-pole_unstable = { $inputs }: instabil, ein Pol hat den Betrag { FIXED($modulus, decimals: 6) }; das Modell darf nicht auf eine Maschine wirken
warning-pole_oscillates = { $inputs }: Ein Pol schwingt, was keine Wärmeleitung ist
warning-extrapolated = { $inputs }: Die langsamste Zeitkonstante, { FIXED($time_constant_s, decimals: 0) } s, ist länger als ein Drittel des längsten Versuchs ({ FIXED($longest_s, decimals: 0) } s); sie und die stationäre Verstärkung sind extrapoliert
warning-sample_time_short = die langsamste Zeitkonstante ist { FIXED($rows, decimals: 0) } Zeilen lang: Ein Gleichungsfehler bei so kurzer Abtastzeit ist verzerrt; Blockmittel von etwa { FIXED($better_s, decimals: 0) } s nehmen oder das Verfahren oe
warning-residuals_not_white = die Residuen sind nicht weiß (Korrelation { FIXED($correlation, decimals: 2) } innerhalb von { $lags } Zeilen): Die Koeffizienten sind verzerrt, und ihre Standardabweichungen gelten nicht; mit dem Verfahren oe vergleichen
warning-parameters_open = die Zeilen lassen { $count } Kombinationen von Parametern offen: Standardabweichungen zählen sie nicht mit; die Ordnungen senken
warning-iteration_not_settled = die Iteration kam in { $steps } Schritten nicht zur Ruhe: Die Zeilen bestimmen die Koeffizienten kaum; die Ordnungen senken oder das Verfahren modal nehmen
warning-inputs_held = { $count } fehlende Werte der Eingänge wurden auf ihrem letzten Wert gehalten
warning-time_constant_at_bound = { $input }: Eine Zeitkonstante liegt an ihrer Grenze, dem Zwanzigfachen des längsten Versuchs; die Aufzeichnung zeigt sie nicht
warning-dc_gain_undetermined = { $input }: Die stationäre Verstärkung ist { $gain_um_per_k } µm/K mit einer Standardabweichung von { $std_um_per_k } µm/K; die Aufzeichnung bestimmt sie nicht
warning-largest_lag_chosen = die größte versuchte Zeitkonstante, { $time_constant_s } s, gehört zum besten Modell: Die Aufzeichnung ist vielleicht zu kurz für die langsamste der Maschine
warning-parts_short = die zurückgehaltenen Teile sind { FIXED($duration_min, decimals: 0) } min lang: Was langsamer ist, wurde nicht beurteilt
warning-gains_held_small = die Verstärkungen wurden so klein gehalten, wie es erlaubt war: Die Temperaturen erklären die Verlagerung kaum
warning-inputs_opposed = { $first } und { $second } bewegen sich gemeinsam (Korrelation { FIXED($correlation, decimals: 3) }) und wirken gegeneinander ({ SIGNED($first_um_per_k, decimals: 2) } und { SIGNED($second_um_per_k, decimals: 2) } µm/K): Nur ihre Summe ist gut bekannt
warning-explains_nothing = nicht benutzen, es erklärt nichts: Auf zurückgehaltenen Zeilen lässt das Modell { $model_um } um übrig, nicht weniger als eine vorher bekannte Konstante ({ $constant_um } um); zuerst Sensoren, Eingänge und Zeilen prüfen oder einen weiteren Versuch machen
warning-probe_drift = die Verlagerung des Protokolls driftet um { SIGNED($um_per_h) } um/h ({ SIGNED($drift_um) } um in { $span_h } h), wie ein Taster es tut und kein Eingang erklärt; das Modell lässt es weg
warning-drift_held_out = was das Modell von zurückgehaltenen Zeilen übrig lässt, ist weniger, als der Taster driftet: Sie beurteilen es nicht, das kann nur ein Protokoll ohne diese Drift
warning-lags_against_record = die Aufzeichnung spricht gegen die angegebenen Zeitkonstanten: Mit ihren eigenen ({ $own_s } s) ist sie e^{ $less } Mal so wahrscheinlich; Verstärkungen haben keine Intervalle, da diese nur mit den Zeitkonstanten gelten
warning-candidates_left_out = nicht gelernt, weil ihren Sensoren nicht zu trauen ist (die Befunde sagen, warum): { $names }
warning-outputs_without_unit = für { $names } ist keine bekannte Einheit angegeben: die Werte gelten als µm; den Namen der Spalte mit der Einheit enden lassen, etwa _um oder _mm
warning-touches_excluded = { $count ->
        [one] eine Antastung liegt
        *[other] { $count } Antastungen liegen
    } so weit neben dem, was die anderen sagen, dass daraus nicht gelernt wird: { $touches }. Ein Span?
warning-datum_moved = der Bezugspunkt wurde während des Protokolls neu gesetzt, denn was die Antastungen zeigen, springt um { $touches }: Spätere werden um so viel zurückgenommen
touches-far = { SIGNED($um) } um, { $at_h } h nach der ersten Zeile
touches-far_at = { SIGNED($um) } um um { $at }
warning-two_regimes_by = zwei Betriebsarten in { $log }: Verstärkungen und Zeitkonstanten ändern sich mit { $column } ({ $low } oder { $high }), das in den Zeilen { $rows } { $high } ist (Abschnitte insgesamt: { $stretches }). Das Modell in einer von beiden trainieren und betreiben, mit ihr verriegelt: Nichts an der Maschine schaltet Modelle um
warning-two_regimes_gains = stationäre Verstärkungen in um/K bei { $column } { $low } / { $high } in { $log }: { $gains }; Verstärkungen und Zeitkonstanten, die umschalten, lassen { $rmse_um } um der letzten 30 % der gemessenen Zeilen übrig, solche, die es nicht tun, { $one_um } um (beide aus der Ruhe und um das Mittel dessen, was sie vorher übrig lassen, anders als in der Tabelle der Fehler)
two_regimes-rows = { $first }..{ $last }
two_regimes-gains = { $input } { $low_um_per_k } / { $high_um_per_k }
warning-two_regimes = zwei Betriebsarten: { $log } ist viel wahrscheinlicher mit Verstärkungen und Zeitkonstanten, die sich währenddessen ändern, sodass kein einzelnes Modell passt; in welchen Zeilen, zeigt sich nicht. Was schaltet dort (Kühlmittel, eine Tür, ein Tisch)? Als Spalte aus 0 und 1 aufzeichnen
warning-delay_rounded = { $input }: Die Totzeit von { $given_s } s wird als { $used_s } s genommen, ganze Zeilen
warning-no_lags = keine Modelldatei kann dieses Modell aufnehmen, und keine seiner Kenngrößen wird gezeigt: { $cause }

## Der Versuch, der am meisten hülfe

next_test-unmoved = Nächster Versuch: { $inputs } bewegte sich in den Protokollen nie, sodass von der Verstärkung nichts bekannt ist: den Sensor prüfen, laufen lassen, was ihn erwärmt, oder den Eingang weglassen
next_test-no_interval = Nächster Versuch: nur laufen lassen, was { $input } erwärmt (in den Protokollen höchstens um { FIXED($level_k, decimals: 1) } K), für { DURATION($on_s) }, dann ebenso lange abkühlen lassen. Die Protokolle stützen kein Intervall seiner stationären Verstärkung
next_test-run = Nächster Versuch: nur laufen lassen, was { $input } erwärmt (in den Protokollen höchstens um { FIXED($level_k, decimals: 1) } K), für { DURATION($on_s) }, dann ebenso lange abkühlen lassen. Was es auf dieser Stufe eingeschwungen bewirkt, ist auf ± { $open_um } um bekannt (95 %)
next_test-none = Nächster Versuch: Keiner mit einer Quelle allein hülfe viel

## Zeilen, die eine Identifikation zurückhielt

held_out-later_part = Zurückgehalten: die letzten { $percent } % jedes Laufs, von einem Modell der Zeilen davor (kein Versprechen für einen anderen Lauf)
held_out-other_runs = Zurückgehalten: jeder von { $runs } Läufen, von einem Modell der anderen
held_out-stretches = Zurückgehalten: nacheinander jede von { $count } Strecken der gemessenen Zeilen, von einem Modell der anderen (kein Versprechen für einen anderen Lauf)

## Was der Rest eines freien Laufs sagt

residual-white = { $channel }: Was übrig bleibt, ist weiß, Mittel über { FIXED($step_min, decimals: 1) } min folgen einander nicht
residual-few_rows = { $channel }: zu wenige Zeilen zählen, um zu sagen, was übrig bleibt
residual-slow = { $channel }: Was übrig bleibt, ist langsam, { $rows } Mittel über { FIXED($step_min, decimals: 1) } min sind { FIXED($worth, decimals: 0) } wert (Nachbarn korrelieren mit { FIXED($correlation, decimals: 2) })
residual-input = { $channel }: Was { $name } tut, ist nicht ganz erklärt, am deutlichsten { FIXED($from_min, decimals: 0) } bis { FIXED($to_min, decimals: 0) } min später
