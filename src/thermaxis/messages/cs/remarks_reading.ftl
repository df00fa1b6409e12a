### Čeho si čtení nebo spojení teplotního záznamu všimlo

remark-heading_cut = nadpis sloupce { $column } byl zkrácen na první znaky
remark-values_beyond = sloupec { $name }: hodnoty větší než 1e9 ({ $count }) nejsou naměřené a berou se jako chybějící
remark-word_in_cells = '{ $word }' stojí { $count ->
        [one] v jedné buňce, kde má být číslo: bere
        [few] ve { $count } buňkách, kde mají být čísla: berou
       *[other] v { $count } buňkách, kde mají být čísla: berou
    } se jako chybějící
remark-line_cut_short = poslední řádek souboru je useknutý a byl vynechán
remark-variables_left_out = proměnné, které nejsou tak dlouhé jako časy, byly vynechány: { $names }
remark-values_no_measurement = hodnoty { $name }, které nejsou měřením: { $count }, například { $example }; berou se jako chybějící (řádky { $row } až { $last })
remark-rows_masked = zakryto podle požadavku: řádky { $name } od { $row } do { $last } ({ $rows }) se berou jako chybějící
remark-all_rows_masked = zakryto podle požadavku: řádky všech kanálů od { $row } do { $last } ({ $rows }) se berou jako chybějící
remark-rows_stuck = { $name } zůstává { $lasts_s } s na { $value } { $unit }, ačkoli se měl změnit: řádky od { $row } do { $last } ({ $rows }) se berou jako chybějící
remark-touches_repeated = { $name } ukazuje v řádcích ({ $rows }) jen málo hodnot ({ $touches }), jako když řídicí systém opakuje poslední dotyk sondy, a každý řádek platí za změřený: jsou-li to dotyky, ponechte jen první řádek každé hodnoty a ostatní vyprázdněte (record: counter_node)
remark-displacement_joined = { $name } v řádku { $row }, { $at_s } s od začátku, skočí o { $size } ± { $within } { $unit }, což teplo nedokáže (vynulovaná sonda, přesunutý stroj): řádky odtud dál navazují na předchozí nulu
remark-displacements_late = { $names } následují teploty, jako by byly označeny o { $shift_s } s pozdě: byly posunuty zpět; odpovídá-li tak pozdě sám stroj, ponechte je volbou --as-logged
remark-displacements_early = { $names } předcházejí teploty, jako by byly označeny o { $shift_s } s dříve: byly posunuty dál, o více, než se opožďují snímače daleko od tepla
remark-displacements_seem_late = { $names } následují teploty, jako by byly označeny o { $shift_s } ± { $within_s } s pozdě: nic se neposunulo (identifikace to dělá od 400 s a bez --delay); porovnejte hodiny zapisovačů (totéž způsobí teplo, které má před sebou cestu)
remark-displacements_seem_early = { $names } předcházejí teploty, jako by byly označeny o { $shift_s } ± { $within_s } s dříve: nic se neposunulo (identifikace to dělá od 400 s a bez --delay); porovnejte hodiny zapisovačů (totéž způsobí snímače daleko od tepla)
remark-channel_drifts = snímač zřejmě trvale driftuje, jeden z { $sensors } během záznamu, nebo samo { $output }, o { SIGNED($um_per_h) } ± { $within_um_per_h } um/h: s takovým růstem je záznam mnohem pravděpodobnější (používá se tak, jak je; porovnejte s jiným snímačem)

## Pořadí a časy

remark-seconds_assumed = sloupec { $column } neuvádí jednotku: berou se sekundy, takže záznam trvá { $lasts }; jinou uveďte v nadpisu (time_min) nebo v přiřazení (time.unit)
remark-rows_without_time = řádky bez času ({ $count }) byly vynechány
remark-rows_in_bursts = řádky přicházejí v dávkách asi po { $rows } každých { $step_s } s: model se učí z průměrů za takovou dobu
remark-rows_turned_round = řádky jdou od nejpozdějšího k nejdřívějšímu: byly obráceny
remark-midnights_passed = denní časy neuvádějí datum: pokračují přes půlnoc (kolikrát: { $count })
remark-times_repeated = řádky se stejným časem jako jiný ({ $count }), první { $at_s } s od začátku: v každém sloupci platí první hodnota
remark-clock_too_coarse = řádky se stejným časem jako jiný ({ $count }), první { $at_s } s od začátku: v každém sloupci platí první hodnota; hodiny jsou pro tento zapisovač příliš hrubé a většina hodnot se ztrácí
remark-rows_sorted = řádky mimo časové pořadí: { $count }; byly seřazeny podle času
remark-rows_sorted_in = řádky mimo časové pořadí ({ $count }) byly zařazeny
remark-rows_repeat_times = řádky od { $row } ({ $count }) opakují časy, které už byly (hodiny se vrátily o { $back_s } s): byly vynechány
remark-clock_set_back = hodiny byly v řádku { $row } vráceny o { $back_s } s: pozdější časy pokračují obvyklým krokem { $usual_s } s
remark-clock_set_back_one_hour = hodiny byly v řádku { $row } vráceny o { $back_s } s (jedna hodina): pozdější časy pokračují obvyklým krokem { $usual_s } s
remark-daylight_saving_ended = hodiny byly v řádku { $row } vráceny o { $back_s } s (jedna hodina, jako na konci letního času): pozdější časy pokračují obvyklým krokem { $usual_s } s

## Dva zapisovače

remark-joined_by_shift = { $log } byl připojen se zadaným posunem { $shift_s } s
remark-joined_by_channels = { $log } byl připojen s posunem { $shift_s } s, nalezeným z { $names } (znám na { $within_s } s, korelace { FIXED($correlation, decimals: 4) })
remark-joined_by_times_of_day = { $log } byl připojen podle denních časů: žádný společný kanál je neověří
remark-columns_renamed = sloupce { $log } byly přejmenovány: { $names }
