remark-outside_training = vstup { $name } (jeho změna od reference) leží v { FIXED($share_percent, decimals: 0) } % řádků mimo rozsah záznamů, až o { FIXED($beyond_percent, decimals: 0) } % jeho šířky: tam se model extrapoluje
remark-start_steady = { $channel } nezačal v klidu: volný běh začíná v ustáleném stavu prvního řádku, podle { $rows } měřených řádků mnohem pravděpodobnějším (--start rest: jak začíná stroj)
remark-start_fitted = { $channel } nezačal v klidu: stavy zpoždění a nula záznamu ({ FIXED($zero_um, decimals: 2) } um) jsou přizpůsobeny { $rows } měřeným řádkům; tak žádný stroj nezačíná (--start rest: jak začíná)
remark-input_failed = v { $rows } řádcích ({ FIXED($share_percent, decimals: 1) } %) byl vstup příliš dlouho vypadlý: nepočítají se
remark-gap = { outcome-gap } ({ $count }krát)
remark-clock_backward = { outcome-clock_backward } ({ $count }krát)
remark-limits_too_narrow = meze jsou příliš úzké: kompenzace přejde { $count }krát do stavu Porucha; zde se každá ihned potvrdí
remark-touches_untimely = { $channel }: z dotyků ({ $touches }) se nepočítá žádný: není známo, co při nich působilo, neboť chyběly vstupy nebo model mezi řádky začal znovu; cena dotyků se zde neukáže
remark-touches_excluded = { $channel }: vyloučeno { $excluded } z { $touches } dotyků: jak často se dotýkat, neříkají. Jsou mimo o { $far }: třísky, nově nastavený vztažný bod nebo jiný obrobek (oznamte stroji: datum_node, nebo ask datum; záznam tam rozdělte: --span, --mask), nebo model, který už neplatí
remark-touches_far = { $channel }: vyloučeno { $excluded } z { $touches } dotyků, neboť jsou mimo o { $far }: tříska, nebo, kde s nimi pozdější souhlasí, nově nastavený vztažný bod či jiný obrobek, za kterým posun šel (oznamte stroji: datum_node, nebo ask datum)
remark-touches_contradict = { $channel }: většina dotyků modelu odporuje: chybné může být i znaménko sloupce (kladné od obrobku), jeho jednotka (um, ne mm) nebo hodiny
remark-touches_datum = { $channel }: byl během záznamu nově nastaven vztažný bod? To, co dotyky ukazují, skočí o { $touches }: jde-li posun za tím, nejsou drift a odchylka stroje a jak často se dotýkat, se neříká (oznamte stroji: datum_node, nebo ask datum; záznam tam rozdělte: --span, --mask)
remark-touches_touched = { $channel } byl měřen v { FIXED($share_percent, decimals: 0) } % řádků: jsou-li to dotyky, vezme je --touches { $channel } tak, jak jsou; zde se k jejich šumu přidává další
touches-likeliest = drift { $drift_um } um za hodinu a odchylku { $discrepancy_um } um neukazují; nejpravděpodobnější je drift_um_per_root_h = { $likely_drift_um } a discrepancy_um = { $likely_discrepancy_um } (--touch-drift-um, --touch-discrepancy-um): to patří do [probe] v konfiguraci
remark-touches_worse = { $channel }: posun podle dotyků výsledek zhoršuje (střední absolutní chyba { $offset_um } um, samotný model { $model_um }), neboť { $likeliest }
remark-touches_beyond = { $channel }: jen { $percent } % toho, co dotyky přidávají, leží do dvou sigma (mělo by 95 %), neboť { $likeliest }

log-never_measured = { $name }: v žádném řádku není hodnota
    .remedy = Kanál vynechte, nebo zkontrolujte zapojení a export.
log-out_of_range = { $name }: počet hodnot, které nejsou měřením: { $count }, například { $example } { $unit }, první v řádku { $row }
    .remedy = Zkontrolujte snímač a zapojení a před identifikací tyto hodnoty označte jako chybějící.
log-swapped = { $name }: v řádku { $row } si vymění místa ({ $first_before } a { $second_before } { $unit } se změní na { $first_after } a { $second_after })
    .remedy = Zkontrolujte konektory a pořadí kanálů; od tohoto řádku je prohoďte, nebo použijte řádky před ním.
log-swapped_names = { $name }: pohybují se s ostatními kanály, jako by jejich jména byla proti { $reference } prohozena
    .remedy = Ohřejte jeden ze snímačů rukou a sledujte, který kanál se pohne.
log-stuck = { $name }: zůstává na { $value } { $unit } po dobu { $lasts_s } s od řádku { $row }
    .remedy = Zkontrolujte snímač a záznam a tyto řádky vynechte.
log-constant = { $name }: { $value } { $unit } ve všech řádcích ({ $rows })
    .remedy = Jako vstup ho vynechte; měl-li se měnit, zkontrolujte snímač.
log-jump = { $name }: { $count ->
        [one] jeden skok
        [few] { $count } skoky, největší
       *[other] { $count } skoků, největší
    } o { $size } { $unit } z řádku { $row } na řádek { $next_row }, kde je obvyklé { $usual }
    .remedy = Teplo to nedokáže: zkontrolujte snímač, jeho kontakt, a zda stroj nebyl přesunut.
log-noisy = { $name }: šum { $noise } { $unit }, { FIXED($times, decimals: 0) }krát větší než u ostatních kanálů
    .remedy = Zkontrolujte stínění a kontakt; zvolte jako vstup jiný snímač, nebo více filtrujte.
log-clock = časy v řádku { $row } přeskočí o hodinu, { $at_s } s od začátku
    .remedy = Pokud záznam běžel dál, byly hodiny posunuty dopředu (letní čas): exportujte časy s pásmem.
log-gap = { $count ->
        [one] { $count } mezera
        [few] { $count } mezery
       *[other] { $count } mezer
    }, celkem { $lost_s } s, nejdelší { $longest_s } s za řádkem { $row }
    .remedy = Nic se nedoplňuje: ověřte, že stroj v mezeře dělal totéž co kolem ní.
log-missing = { $name }: chybí na { $count ->
        [one] { $count } místě
        [few] { $count } místech
       *[other] { $count } místech
    }, celkem { $lost_s } s, nejdéle za řádkem { $row }
    .remedy = Nic se nedoplňuje; řádky bez vstupu nebo výstupu se při odhadu vynechají.
log-quantised = { $name }: hodnoty přicházejí po krocích { $step } { $unit }
    .remedy = Použijte průměry mnoha řádků, zde i v běžící kompenzaci, nebo jemnější výstup snímače.
log-held = { $name }: hodnoty se mění jen každých { $rows } řádků: záznam je drží asi { $lasts_s } s
    .remedy = Zvolte periodu vzorkování alespoň { $lasts_s } s.
log-rare = { $name }: měřeno { $count }krát asi po { $lasts_s } s
    .remedy = Použije se tam, kde byl změřen, a neinterpoluje se.
log-uneven = { FIXED($percent, decimals: 0) } % časů mezi řádky se liší od obvyklých { $usual_s } s o více než pětinu
    .remedy = Zvolte periodu vzorkování o několika obvyklých krocích: průměry časy srovnají.
