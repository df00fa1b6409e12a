### Co je třeba vědět o změřeném běhu

## Podmínky zkoušky podle ISO 230-2

warning-few_targets_linear = { $targets } cílových poloh je méně než { $required }, které ISO 230-2 žádá u lineární osy měřené na { $length } mm
warning-few_targets_rotary = { $targets } cílových poloh je méně než { $required }, které ISO 230-2 žádá u rotační osy měřené na { $length }° (pravidlo po paměti)
warning-few_cycles = { $cycles } cyklů, { $cycles } odečtů každé cílové polohy, je méně než { $required }, které ISO 230-2 žádá
warning-few_readings = cílová poloha { $target } má { $readings } odečtů { $approach }, méně než { $required }, které ISO 230-2 žádá
warning-many_cycles = { $cycles } cyklů je více než { $required }, které ISO 230-2 žádá: hodnoty se řídí jejími vzorci, ale z delší zkoušky, při níž se stroj více zahřeje
warning-targets_equidistant = cílové polohy jsou rovnoměrné ({ $mean } { $unit }), bez náhodné složky rovnice (1): periodické chyby osy mohou zůstat skryty
warning-interval_too_long = největší rozestup cílových poloh je { $interval } mm; ISO 230-2 žádá nejvýše { $most_mm } mm na ose přes { $length_mm } mm
warning-interval_uneven = rozestup za cílovou polohou { $target } ({ $interval } { $unit }) je více než dvojnásobek středního ({ $mean } { $unit }): osa je vzorkována nerovnoměrně
warning-step_cycle = krokový cyklus (příloha B ISO 230-2:2014): ne pro přejímku, není-li dohodnut; skrývá část driftu, kterou normální cyklus ukáže
warning-pilgrim_cycle = poutnický cyklus: není normálním cyklem ISO 230-2; ne pro přejímku, není-li dohodnut
warning-readings_missing = chybí { $count } odečtů { $approach }, první u cílové polohy { $target } v cyklu { $cycle }: každá cílová poloha si ponechá svůj počet odečtů
warning-travel_reversed = odečty { $approach } v cyklu { $cycles } nebyly vzaty po sobě v tomto směru, jak to dělá normální cyklus: zkontrolujte směry, nebo uveďte druh cyklu
warning-cycles_interleave = odečty jednoho cyklu byly vzaty mezi odečty jiného, jako v krokovém a ne v normálním cyklu: uveďte druh cyklu

## Sousední rozdíly

warning-one_cycle = jen jeden cyklus: sousední rozdíly nemají rozptyl a graf nemá meze
warning-no_pair_twice = žádná dvojice nemá dva úplné cykly: graf nemá meze
warning-pair_without_spread = polohy { $position } a { $next } { $approach } mají jen jeden úplný cyklus: jejich rozdíl nemá rozptyl
warning-student_factor = { $cycles } cyklů je méně než { $enough }: meze v grafu odchylek jsou rozšířeny Studentovým činitelem ({ FIXED($factor, decimals: 3) } místo 2)
warning-student_factor_of_pair = { $cycles } úplných cyklů v polohách { $position } a { $next } { $approach } je méně než { $enough }: meze v grafu odchylek jsou rozšířeny Studentovým činitelem ({ FIXED($factor, decimals: 3) } místo 2)
warning-anchor_outlying = odečet v poloze { $position } { $approach } v cyklu { $cycle }, na němž graf odchylek visí, leží daleko od ostatních: celý graf je posunut; zvolte jiný vztažný cyklus

## Drift

warning-outlier_left_out = odečet u cílové polohy { $target } { $approach } v cyklu { $cycle } leží { SIGNED($residual, decimals: 2) } { $unit } od modelu driftu: byl vynechán z modelu a jeho hodnot; naměřené hodnoty jej obsahují
    .short = odlehlý odečet: cílová poloha { $target } { $approach } v cyklu { $cycle }, { SIGNED($residual, decimals: 2) } { $unit } mimo; bez driftu vynechán
warning-more_outliers = { $count } dalších odečtů leží mimo a bylo vynecháno stejně
    .short = odlehlé odečty: { $count } dalších, bez driftu vynecháno
warning-outliers_in_model = nejméně { $count } dalších odečtů leží mimo, ale z modelu se vynechává nejvýše { $most } (5 % odečtů): co se uvádí bez driftu, ostatní obsahuje; hledejte, co ruší jednotlivé odečty
    .short = odlehlé odečty: nejméně { $count } dalších, v hodnotách bez driftu, protože se vynechává nejvýše { $most }
warning-most_changes = je uvedeno { $most } skoků a více se nehledá: může být dalších, a co se uvádí bez driftu, může být chybné
    .short = skoky: { $most }, více se nehledá
warning-heavy_tailed_noise = { $far } z { $readings } odečtů leží dále než { $limit } robustních směrodatných odchylek od modelu driftu, kde by jich při normálním šumu bylo { FIXED($expected) }: šum má těžké konce; jeho směrodatná odchylka je uvedena jako u normálního šumu se stejnými kvartily a pásma patří zbylým odečtům; hledejte, co ruší jednotlivé odečty (krátká prodleva, chvění, vzduch v paprsku)
    .short = šum: těžké konce, { $far } z { $readings } odečtů za { $limit } robustními směrodatnými odchylkami
warning-change_common = { $when } se všechny cílové polohy posunuly skokem o { SIGNED($size, decimals: 2) } ± { FIXED($within) } { $unit }: přístroj znovu vynulován nebo dotčena optika, prokluz ve stroji, nebo přepnuto chlazení, dveře či pohon; co se uvádí bez driftu, platí pro stranu t0
    .short = skok: { $when } všechny cílové polohy o { SIGNED($size, decimals: 2) } ± { FIXED($within) } { $unit }
warning-change_stretch = { $when } poslední cílová poloha poskočila o { SIGNED($size, decimals: 2) } ± { FIXED($within) } { $unit } proti první, ostatní v poměru: jiná kompenzace teploty vzduchu či materiálu, znovu nastavený paprsek nebo pravítko, nebo pootočená optika; co se uvádí bez driftu, platí pro stranu t0
    .short = skok: { $when } poslední cílová poloha o { SIGNED($size, decimals: 2) } ± { FIXED($within) } { $unit } proti první
warning-change_unsure = { $when } se všechny cílové polohy posunuly o { SIGNED($size, decimals: 2) } ± { FIXED($within) } { $unit } vedle driftu před tím a potom: běh neodliší skok od driftu přes pauzu; co se uvádí bez driftu, platí pro stranu t0
    .short = pauza: { $when } všechny cílové polohy o { SIGNED($size, decimals: 2) } ± { FIXED($within) } { $unit }
change-at = po { FIXED($time_min, decimals: 1) } min, v cyklu { $cycle },
change-in_order = v cyklu { $cycle }
change-in_pause = během { FIXED($pause_min, decimals: 1) } min bez odečtu kolem { FIXED($time_min, decimals: 1) } min, než cyklus { $cycle } pokračoval, naráz nebo pomalu,
warning-order_as_time = odečty nemají časy: za čas slouží jejich pořadí
warning-axis_bows = osa se s časem prohýbá: k driftu byla přidána parabola polohy
warning-swing_too_fast = celá osa kmitá s periodou asi { FIXED($time, decimals: 1) } { $unit }, { FIXED($cycles, decimals: 1) } cyklů: příliš rychle, aby se to dalo spolehlivě odlišit od středních odchylek, jejichž nejistoty mohou být příliš malé; pomohly by kratší cykly s méně cílovými polohami nebo kratšími zastávkami
warning-noise_correlated = šum po sobě jdoucích odečtů je si podobný asi { FIXED($time, decimals: 0) } { $time_unit } (směrodatná odchylka této části { FIXED($std, decimals: 2) } { $unit }), jako při neklidném vzduchu nebo rušení příliš rychlém na sledování: nejistoty jsou o to rozšířeny; pomohou další cykly, další odečty v cyklu sotva
    .short = šum: asi { FIXED($time, decimals: 0) } { $time_unit } podobný v po sobě jdoucích odečtech ({ FIXED($std, decimals: 2) } { $unit }), jako při neklidném vzduchu; U je rozšířena
warning-visits_hide_drift = každá cílová poloha byla měřena v krátké části běhu: toto pořadí skrývá drift ve středních odchylkách a jen jejich nejistoty ukazují, kolik
warning-target_drifts_otherwise = cílová poloha { $targets } driftuje jinak než zbytek osy: model driftu tam neplatí a jeho pásma jsou příliš úzká
warning-targets_drift_otherwise = cílové polohy driftují jinak než společným driftem a růstem, žádná z nich zřetelně sama: model driftu neplatí a jeho pásma jsou příliš úzká

## Běh proti svému plánu

warning-other_kind = běh byl změřen na ose druhu { $kind }; plán je pro druh { $planned }
warning-other_axis = běh uvádí osu „{ $axis }“; plán je pro osu { $planned }
warning-other_cycle = běh má cyklus { $cycle }; plán žádá { $planned }
warning-other_number_of_cycles = bylo změřeno { $cycles } cyklů; plán žádá { $planned }
warning-approach_not_planned = nájezdy { $approach } byly změřeny, aniž byly plánovány
warning-approach_not_measured = plánované nájezdy { $approach } nebyly změřeny
warning-target_elsewhere = cílová poloha { $target } je v { FIXED($position, decimals: 3) } { $unit } místo v { FIXED($planned, decimals: 3) } { $unit }
warning-more_targets_elsewhere = { $count } dalších cílových poloh je jinde, než bylo plánováno
warning-other_number_of_targets = bylo změřeno { $targets } cílových poloh; plán jich má { $planned }
warning-targets_not_measured = plánováno a nezměřeno cílových poloh: { $count }, první v { FIXED($position, decimals: 3) } { $unit }
warning-targets_not_planned = změřeno a neplánováno cílových poloh: { $count }, první v { FIXED($position, decimals: 3) } { $unit }
warning-targets_differ = cílové polohy se liší od plánu: odečty, pořadí a časy s ním nebyly porovnány
warning-planned_readings_missing = chybí { $count } plánovaných odečtů { $approach }, první u cílové polohy { $target } v cyklu { $cycle }
warning-order_not_known = pořadí odečtů není známo: pořadí a prodleva nebyly porovnány
warning-order_deduced = pořadí bylo odvozeno z čísel průchodů: pořadí a prodleva nebyly porovnány
warning-order_differs = pořadí odečtů opouští plán u odečtu { $reading }: cílová poloha { $target } { $approach } v cyklu { $cycle }, kde byla plánována cílová poloha { $planned_target } { $planned_approach } v cyklu { $planned_cycle }; { $count } z { $readings } odečtů není na svém místě, prodleva nebyla porovnána
warning-times_not_stated = soubor neuvádí čas každého odečtu: prodleva nebyla porovnána
warning-stops_shorter = odečty následují o { FIXED($shorter_s, decimals: 1) } s dříve, než bylo plánováno (medián): z plánovaných { $planned_s } s zbývá na každé zastávce { FIXED($left_s, decimals: 1) } s, nebyl-li posuv vyšší než { $feed } { $unit }/min
warning-stops_longer = odečty následují o { FIXED($longer_s, decimals: 1) } s později, než bylo plánováno (medián): rozjezd nebo záznam trvá déle, nebo byly zastávky delší než { $planned_s } s
warning-run_paused = přerušení běhu: { $count }; nejdelší, { FIXED($longest_min, decimals: 1) } min, nastalo před cílovou polohou { $target } { $approach } v cyklu { $cycle }

## Vyhodnocení

warning-no_drift_model = bez modelu driftu: { $error } { $remedy }
warning-no_adjacent_differences = bez sousedních rozdílů: { $error } { $remedy }
warning-no_figures_of_other_standard = bez hodnot druhé normy: { $error } { $remedy }
warning-cycle_of_option = soubor uvádí cyklus { $stated }, volba cyklus { $cycle }
warning-single_run_rule = osa je delší než 2000 mm: s, R a A se nevyhodnocují{ $cycles ->
        [one] {""}
        [few] , ačkoli jsou k dispozici { $cycles } běhy (střední hodnoty ze všech)
       *[other] , ačkoli je k dispozici { $cycles } běhů (střední hodnoty ze všech)
    }; vyžádejte si je pomocí --full
warning-draft = digitální kalibrační certifikát je koncept: soubor --header neuvádí { $missing }
warning-not_in_pdf = { $count ->
        [one] { $count } znak
        [few] { $count } znaky
       *[other] { $count } znaků
    } v { $names } nelze ukázat v PDF; stránka, kterou píše --report NAME.html, je ve svém textu ukazuje
warning-not_in_charts = { $count ->
        [one] { $count } znak
        [few] { $count } znaky
       *[other] { $count } znaků
    } v { $names } nelze ukázat v grafech; za každý tam stojí prázdný rámeček
