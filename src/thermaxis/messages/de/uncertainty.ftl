left_out-no_budget = Messgerät und Umgebung: es wurde kein Unsicherheitsbudget angegeben
left_out-not_stated = { CODE($term, "term") }: im Unsicherheitsbudget nicht angegeben
left_out-keys_not_stated = { $keys }: im Unsicherheitsbudget weder angegeben noch durch eine 0 als nichtig erklärt
left_out-in_scatter = Umgebungseinfluss (die Streuung der Ablesungen ist größer und enthält ihn)
left_out-drift_unknown = Drift (sie ist nicht bekannt und zählt als Streuung)
left_out-drift_not_described = Drift der Zielposition { $targets }, die das Driftmodell nicht beschreibt
left_out-everything = alles, woraus sie bestehen könnte: nichts wurde ausgewertet
left_out-one_reading = Streuung: eine einzelne Ablesung sagt sie nicht

term-device = Messgerät
term-misalignment = Ausrichtung des Strahls
term-material_temperature = Temperatur des Materials
term-expansion_coefficient = Ausdehnungskoeffizient
term-environmental_variation = Umgebungseinfluss
term-noise = Streuung der Ablesungen
term-resolution = Rundung der Ablesungen
term-extremes = Abweichung größter und kleinster Werte, nicht korrigiert
term-nonlinearity = Nichtlinearität: alle Terme zusammen, über die Wurzel der Quadratsumme hinaus
