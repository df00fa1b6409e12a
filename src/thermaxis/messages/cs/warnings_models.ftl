### Co je třeba vědět o identifikaci

warning-no_steady_start = žádná zkouška nezačíná v ustáleném stavu: co stroj dělal před začátkem, je odhad, a s ním pomalé časové konstanty a statická zesílení (přidejte zkoušku, která začíná za studena)
warning-dc_gains_not_supported = záznam nedokládá každé statické zesílení: model platí pro změny tak dlouhé, jako jsou v záznamu, ne pro delší (přidejte delší zkoušku nebo takovou, která začíná za studena)
warning-pole_unstable = { $inputs }: nestabilní, pól má velikost { FIXED($modulus, decimals: 6) }; model nesmí působit na stroj
warning-pole_oscillates = { $inputs }: pól kmitá, což není vedení tepla
warning-extrapolated = { $inputs }: nejpomalejší časová konstanta, { FIXED($time_constant_s, decimals: 0) } s, je delší než třetina nejdelší zkoušky ({ FIXED($longest_s, decimals: 0) } s); ona i statické zesílení jsou extrapolovány
warning-sample_time_short = nejpomalejší časová konstanta má { FIXED($rows, decimals: 0) } řádků: chyba rovnice je při tak krátkém vzorkování zkreslená; vezměte průměry bloků asi { FIXED($better_s, decimals: 0) } s, nebo metodu oe
warning-residuals_not_white = rezidua nejsou bílá (korelace { FIXED($correlation, decimals: 2) } do { $lags } řádků): koeficienty jsou zkreslené a jejich směrodatné odchylky neplatí; porovnejte s metodou oe
warning-parameters_open = řádky nechávají otevřených { $count } kombinací parametrů: směrodatné odchylky je nepočítají; snižte řády
warning-iteration_not_settled = iterace se v { $steps } krocích neustálila: řádky koeficienty sotva určují; snižte řády, nebo použijte metodu modal
warning-inputs_held = { $count } chybějících hodnot vstupů bylo drženo na poslední hodnotě
warning-time_constant_at_bound = { $input }: časová konstanta leží na své mezi, dvacetinásobku nejdelší zkoušky; záznam ji neukazuje
warning-dc_gain_undetermined = { $input }: statické zesílení je { $gain_um_per_k } µm/K se směrodatnou odchylkou { $std_um_per_k } µm/K; záznam je neurčuje
warning-largest_lag_chosen = největší zkoušená časová konstanta, { $time_constant_s } s, patří nejlepšímu modelu: záznam je možná příliš krátký pro nejpomalejší konstantu stroje
warning-parts_short = odložené části trvají { FIXED($duration_min, decimals: 0) } min: co je pomalejší, nebylo posouzeno
warning-gains_held_small = zesílení byla držena tak malá, jak bylo dovoleno: teploty posunutí sotva vysvětlují
warning-inputs_opposed = { $first } a { $second } se mění společně (korelace { FIXED($correlation, decimals: 3) }) a působí proti sobě ({ SIGNED($first_um_per_k, decimals: 2) } a { SIGNED($second_um_per_k, decimals: 2) } µm/K): dobře je znám jen jejich součet
warning-explains_nothing = nepoužívat, nic nevysvětluje: na odložených řádcích nechává model { $model_um } um, ne méně než předem známá konstanta ({ $constant_um } um); nejprve zkontrolujte snímače, vstupy a řádky, nebo přidejte další zkoušku
warning-probe_drift = posunutí v záznamu driftuje o { SIGNED($um_per_h) } um/h ({ SIGNED($drift_um) } um za { $span_h } h), jak to dělá sonda a žádný vstup nevysvětluje; model to vynechává
warning-drift_held_out = co model z odložených řádků nechává, je méně, než sonda driftuje: neposuzují jej, to může jen záznam bez tohoto driftu
warning-lags_against_record = záznam mluví proti zadaným časovým konstantám: s vlastními ({ $own_s } s) je e^{ $less }krát pravděpodobnější; zesílení nemají intervaly, protože ty platí, jen platí-li konstanty
warning-candidates_left_out = nenaučeno, protože jejich snímačům nelze věřit (nálezy říkají proč): { $names }
warning-outputs_without_unit = pro { $names } není uvedena známá jednotka: hodnoty se berou jako µm; zakončete název sloupce jednotkou, například _um nebo _mm
warning-touches_excluded = { $count ->
        [one] jeden dotyk leží
        [few] { $count } dotyky leží
        *[other] { $count } dotyků leží
    } tak daleko od toho, co říkají ostatní, že se z toho model neučí: { $touches }. Tříska?
warning-datum_moved = vztažný bod byl během záznamu nastaven znovu, neboť to, co dotyky ukazují, skočí o { $touches }: pozdější se o to vracejí zpět
touches-far = { SIGNED($um) } um, { $at_h } h po prvním řádku
touches-far_at = { SIGNED($um) } um v { $at }
warning-two_regimes_by = dva režimy v { $log }: zesílení a časové konstanty se mění s { $column } ({ $low } nebo { $high }), což je { $high } v řádcích { $rows } (úseků celkem: { $stretches }). Model učte a provozujte v jednom z nich a s ním jej zablokujte: na stroji modely nic nepřepíná
warning-two_regimes_gains = statická zesílení v um/K při { $column } { $low } / { $high } v { $log }: { $gains }; zesílení a konstanty, které se přepínají, nechávají { $rmse_um } um z posledních 30 % měřených řádků, ty, které se nepřepínají, { $one_um } um (obojí z klidu a kolem průměru toho, co nechávají předtím, na rozdíl od tabulky chyb)
two_regimes-rows = { $first }..{ $last }
two_regimes-gains = { $input } { $low_um_per_k } / { $high_um_per_k }
warning-two_regimes = dva režimy: { $log } je mnohem pravděpodobnější se zesíleními a časovými konstantami, které se za běhu mění, takže jeden model nesedí; ve kterých řádcích, se neukazuje. Co se tam přepíná (chlazení, dveře, stůl)? Zaznamenávejte to jako sloupec z 0 a 1
warning-delay_rounded = { $input }: dopravní zpoždění { $given_s } s se bere jako { $used_s } s, celé řádky
warning-no_lags = tento model neudrží žádný soubor modelu a žádná jeho hodnota se neukazuje: { $cause }

## Zkouška, která by nejvíce pomohla

next_test-unmoved = Příští zkouška: { $inputs } se v záznamech nikdy nepohnul, takže o zesílení není nic známo: zkontrolujte snímač, spusťte, co jej ohřívá, nebo vstup vynechte
next_test-no_interval = Příští zkouška: spusťte jen to, co ohřívá { $input } (v záznamech nejvýše o { FIXED($level_k, decimals: 1) } K), na { DURATION($on_s) }, pak nechte stejně dlouho chladnout. Záznamy nedokládají interval jeho statického zesílení
next_test-run = Příští zkouška: spusťte jen to, co ohřívá { $input } (v záznamech nejvýše o { FIXED($level_k, decimals: 1) } K), na { DURATION($on_s) }, pak nechte stejně dlouho chladnout. Co na této úrovni po ustálení způsobí, je známo na ± { $open_um } um (95 %)
next_test-none = Příští zkouška: žádná s jediným zdrojem by příliš nepomohla

## Řádky, které identifikace odložila

held_out-later_part = Odloženo: posledních { $percent } % každého běhu, podle modelu řádků předtím (není to příslib pro jiný běh)
held_out-other_runs = Odloženo: každý z { $runs } běhů, podle modelu ostatních
held_out-stretches = Odloženo: postupně každý z { $count } úseků změřených řádků, podle modelu ostatních (není to příslib pro jiný běh)

## Co říká zbytek volného běhu

residual-white = { $channel }: co zbývá, je bílé, průměry přes { FIXED($step_min, decimals: 1) } min na sebe nenavazují
residual-few_rows = { $channel }: příliš málo řádků se počítá, aby šlo říci, co zbývá
residual-slow = { $channel }: co zbývá, je pomalé, { $rows } průměrů přes { FIXED($step_min, decimals: 1) } min má cenu { FIXED($worth, decimals: 0) } (sousedé korelují { FIXED($correlation, decimals: 2) })
residual-input = { $channel }: co dělá { $name }, není celé vysvětleno, nejzřetelněji { FIXED($from_min, decimals: 0) } až { FIXED($to_min, decimals: 0) } min poté
