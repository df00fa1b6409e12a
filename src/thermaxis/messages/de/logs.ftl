remark-outside_training = Eingang { $name } liegt in { FIXED($share_percent, decimals: 0) } % der Zeilen außerhalb des Bereichs der Aufzeichnungen, um bis zu { FIXED($beyond_percent, decimals: 0) } % seiner Breite: dort wird das Modell extrapoliert
remark-input_failed = in { FIXED($share_percent, decimals: 1) } % der Zeilen war ein Eingang zu lange ausgefallen
remark-gap = { outcome-gap } ({ $count }-mal)
remark-clock_backward = { outcome-clock_backward } ({ $count }-mal)
remark-limits_too_narrow = die Grenzen sind zu eng: die Kompensation geht { $count }-mal in Störung; hier wird jede sofort quittiert
