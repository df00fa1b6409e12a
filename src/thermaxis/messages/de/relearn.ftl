### Warum ein anderes Modell vorgeschlagen wird, oder keines

relearn-better = besser an { $judged } Antastungen, die keines der beiden Modelle gesehen hat: was eine Antastung hinzufügt, sinkt von { FIXED($old_um, decimals: 2) } auf { FIXED($new_um, decimals: 2) } µm, gelernt aus { $learnt } Antastungen davor
relearn-no_better = nichts ist besser als das Modell in Kraft an den neuesten { $judged } Antastungen (gelernt wurde aus { $learnt } davor)
relearn-few_touches = zu wenige Antastungen: { $learnt } zum Lernen, { $judged } zum Urteilen; öfter antasten
relearn-sensors_first = ein anderes Modell lässt weniger übrig, aber zuerst die Sensoren ansehen: { $names }
relearn-condemned = ein anderes Modell lässt weniger übrig als das in Kraft, taugt aber nicht: { CODE($rule, "unfit") }
unfit-nothing = ganz ohne Modell bleibt ebenso wenig
unfit-averages = feste Mittel der Eingänge leisten dasselbe
unfit-static = eine statische Regression leistet dasselbe
unfit-warning-not_fit = die Identifikation verwirft es
unfit-warning-explains_nothing = die Identifikation verwirft es
