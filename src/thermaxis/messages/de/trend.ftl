## Was man wissen muss, bevor Läufe einer Achse verglichen werden

warning-no_drift_free_figures = keine Kenngrößen ohne Drift: { $cause }
warning-no_start_time = { NAME($runs) } nennen keine Anfangszeit: Die Läufe stehen in der gegebenen Reihenfolge
warning-zones_mixed = manche Läufe nennen eine Zeitzone und manche nicht: Diese gelten als UTC
warning-one_run = ein Lauf allein hat keinen Verlauf
warning-machines_differ = die Läufe unterscheiden sich in der Maschine: { $groups }: Ist es eine Maschine?
warning-serial_numbers_differ = die Läufe unterscheiden sich in der Seriennummer: { $groups }: Ist es eine Maschine?
warning-axes_differ = die Läufe unterscheiden sich in der Achse: { $groups }: Ist es eine Achse?
warning-target_counts_differ = die Läufe unterscheiden sich in der Zahl der Zielpositionen: { $groups }: Mehr Ziele finden größere Extreme
warning-test_cycles_differ = die Läufe unterscheiden sich in der Art des Prüfzyklus: { $groups }: Er driftet anders, während gemessen wird
warning-approaches_differ = die Läufe unterscheiden sich in den Anfahrrichtungen: { $groups }: Eine Richtung hat kein B, E, R und A
warning-cycle_counts_differ = die Läufe unterscheiden sich in der Zahl der Zyklen: { $groups }: R und A aus wenigen Zyklen streuen mehr
warning-rules_differ = die Läufe unterscheiden sich in der Regel der Norm: { $groups }: Achsen über 2000 mm haben kein R und A
warning-time_sources_differ = die Läufe unterscheiden sich in der Herkunft der Zeiten: { $groups }: Die Drift ist nicht gleich gut zu trennen
warning-other_part = { NAME($runs) } maßen einen anderen Teil der Achse als { $reference }: E, M und A wachsen mit der Länge
warning-targets_moved = die Zielpositionen von { NAME($runs) } liegen anders als die von { $reference }: Ein periodischer Fehler wird in anderen Phasen getroffen
warning-conditions_not_met = nicht alle Bedingungen der Norm sind erfüllt in { NAME($runs) }: Die Auswertung sagt, welche
warning-air_differs = die Luft unterscheidet sich um { FIXED($difference_k, decimals: 1) } K zwischen { $coldest } und { $warmest }: E, M und A ändern sich damit, wo die Ausdehnung nicht kompensiert ist

## Was sich an einer Achse über die Jahre ändert

axis-slope = { $axis }: { $figure } ändert sich um { SIGNED($per_year) } { $unit } im Jahr (95 %: { SIGNED($low) } bis { SIGNED($high) }): Verschleiß, oder ein Fundament, das sich setzt. Nachsehen, bevor die Grenze erreicht ist.
axis-step = { $axis }: { $figure } liegt seit { $start } um { SIGNED($size) } { $unit } anders: Was war davor? Eine Kollision, eine Reparatur, eine andere Kompensationstabelle oder ein anderes Messgerät.
axis-new_fault = { $axis }: { $name } ist der erste Lauf damit: { $fault }
