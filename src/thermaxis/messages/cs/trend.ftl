## Co je třeba vědět, než se porovnají běhy jedné osy

warning-no_drift_free_figures = žádné hodnoty bez driftu: { $cause }
warning-no_start_time = { NAME($runs) } neuvádějí čas začátku: běhy stojí v daném pořadí
warning-zones_mixed = některé běhy uvádějí časové pásmo a některé ne: ty se berou jako UTC
warning-one_run = jeden běh nemá vývoj
warning-machines_differ = běhy se liší strojem: { $groups }: je to jeden stroj?
warning-serial_numbers_differ = běhy se liší výrobním číslem: { $groups }: je to jeden stroj?
warning-axes_differ = běhy se liší osou: { $groups }: je to jedna osa?
warning-target_counts_differ = běhy se liší počtem cílových poloh: { $groups }: více cílů najde větší krajní hodnoty
warning-test_cycles_differ = běhy se liší druhem zkušebního cyklu: { $groups }: během měření driftuje jinak
warning-approaches_differ = běhy se liší směry najíždění: { $groups }: jeden směr nemá B, E, R a A
warning-cycle_counts_differ = běhy se liší počtem cyklů: { $groups }: R a A z mála cyklů mají větší rozptyl
warning-rules_differ = běhy se liší pravidlem normy: { $groups }: osy přes 2000 mm nemají R a A
warning-time_sources_differ = běhy se liší původem časů: { $groups }: drift nelze oddělit stejně dobře
warning-other_part = { NAME($runs) } měřily jinou část osy než { $reference }: E, M a A rostou s délkou
warning-targets_moved = cílové polohy { NAME($runs) } leží jinde než u { $reference }: periodická chyba se zachytí v jiných fázích
warning-conditions_not_met = ne všechny podmínky normy jsou splněny v { NAME($runs) }: vyhodnocení řekne které
warning-air_differs = vzduch se mezi { $coldest } a { $warmest } liší o { FIXED($difference_k, decimals: 1) } K: E, M a A se s tím mění tam, kde roztažnost není kompenzována

## Co se na ose mění během let

axis-slope = { $axis }: { $figure } se mění o { SIGNED($per_year) } { $unit } za rok (95 %: { SIGNED($low) } až { SIGNED($high) }): opotřebení, nebo si sedá základ. Podívejte se dříve, než překročí mez.
axis-step = { $axis }: { $figure } se od { $start } liší o { SIGNED($size) } { $unit }: co se předtím stalo? Kolize, oprava, jiná kompenzační tabulka nebo jiný přístroj.
axis-new_fault = { $axis }: { $name } je první běh s tímto: { $fault }
