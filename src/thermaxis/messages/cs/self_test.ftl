### Nálezy vlastního testu

## Connections

self_test-not_connected = Není spojení: { $why }
    .remedy = Bez stroje se nic nekoriguje; čeká se na něj.
self_test-no_more_answers = Server už neodpovídá: { $why }
    .remedy = Zkontrolujte server a síť.
self_test-failed = Vlastní test sám selhal: { $cause }
    .remedy = Příčinu nahlaste tomu, kdo tento program udržuje.
self_test-server_without_time = Server neudává svůj čas: stáří hodnot není známo.
    .remedy = Nechte server udávat čas, nebo zapište time_stamp_required = false.
self_test-clock_ahead = Spojeno; hodiny serveru jdou proti tomuto počítači o { FIXED($difference_s, decimals: 1) } s napřed.
    .remedy = Seřiďte jedny hodiny; stáří hodnot se posuzuje podle serveru, záznamy podle tohoto počítače.
self_test-clock_behind = Spojeno; hodiny serveru jdou proti tomuto počítači o { FIXED($difference_s, decimals: 1) } s pozadu.
    .remedy = Seřiďte jedny hodiny; stáří hodnot se posuzuje podle serveru, záznamy podle tohoto počítače.
self_test-connected = Spojeno; hodiny se liší o { FIXED($difference_s, decimals: 1) } s (mnohé servery nastavují udávaný čas jednou za sekundu).
self_test-linuxcnc = LinuxCNC běží, je správně uspořádán a osy jsou referencovány.
self_test-pins = LinuxCNC běží a jeho piny lze číst.
self_test-pins_unread = Piny LinuxCNC nelze číst: { $why }
    .remedy = Spusťte LinuxCNC jako uživatel tohoto programu.
self_test-linuxcnc_unusable = Do LinuxCNC nelze zapisovat: { $why }
    .remedy = Spusťte jej se souborem HAL, který zapisuje thermaxis hal, a referencujte osy.

## Nodes

self_test-no_node = Server nemá uzel { $node } ({ $status }).
    .remedy = Vyhledejte uzel v prohlížeči serveru a opravte konfiguraci.
self_test-node_no_number = Uzel { $node } je typu { $type }, potřebné je číslo.
    .remedy = Vyhledejte uzel v prohlížeči serveru a opravte konfiguraci.
self_test-node_no_flag = Uzel { $node } je typu { $type }, potřebná je logická hodnota nebo celé číslo.
    .remedy = Vyhledejte uzel v prohlížeči serveru a opravte konfiguraci.
self_test-node_no_bit = Uzel { $node } je typu { $type }, který takový bit nemá; potřebné je celé číslo s dostatkem bitů.
    .remedy = Vyhledejte uzel v prohlížeči serveru a opravte konfiguraci.
self_test-node_no_beat = Uzel { $node } je typu { $type }, potřebné je číslo nebo logická hodnota.
self_test-node_no_token = Uzel { $node } je typu { $type }, potřebné je číslo o 32 bitech nebo více.
    .remedy = Vyhledejte uzel v prohlížeči serveru a opravte konfiguraci.

## Inputs

self_test-input = { FIXED($value_c, decimals: 1) } °C.
self_test-input_age = { FIXED($value_c, decimals: 1) } °C, stáří { FIXED($age_s, decimals: 1) } s.
self_test-input_no_value = Není hodnota: { $status }.
    .remedy = Zkontrolujte snímač; bez dobré hodnoty se nic nekoriguje.
self_test-no_time_stamp = Hodnota nemá použitelné časové razítko, její stáří není známo.
    .remedy = Nechte server razítko udávat, nebo zapište time_stamp_required = false; zamrzlou hodnotu pak pozná jen frozen_s.
self_test-value_old = Hodnota je stará { FIXED($age_s, decimals: 0) } s, dovoleno je { $longest_age_s } s.
    .remedy = Zkontrolujte snímač; některé servery razítkují hodnotu jen při změně: pak zvyšte longest_age_s.
self_test-input_other_unit = Hodnota { $raw } je podle konfigurace { $value_c } °C, což není věrohodné ({ $lowest_c } až { $highest_c } °C); věrohodná by byla s { $others }.
    .remedy = Zkontrolujte jednotku uzlu a případně zapište { $first }.
self_test-input_zero = { FIXED($value_c, decimals: 1) } °C není věrohodné ({ $lowest_c } až { $highest_c } °C); nezapojený vstup často čte 0.
    .remedy = Zkontrolujte snímač, jednotku a věrohodný rozsah.
self_test-input_implausible = { FIXED($value_c, decimals: 1) } °C není věrohodné ({ $lowest_c } až { $highest_c } °C).
    .remedy = Zkontrolujte snímač, jednotku a věrohodný rozsah.
self_test-redundant_differs = Redundantní snímač se liší o { SIGNED($difference_k, decimals: 1) } K, dovoleno je { $largest_k } K.
    .remedy = Zkontrolujte oba snímače: jeden je vadný, nebo nejsou na stejném místě.

## Flags and diameter

self_test-flag_no_truth = Hodnota je { $value }, příznak je 0 nebo 1.
    .remedy = Uveďte uzel, který je pravda nebo nepravda, 0 nebo 1; jiné číslo se bere jako žádná hodnota.
self_test-interlock_met = Je splněna.
self_test-interlock_open = Není nyní splněna.
    .remedy = Dokud není splněna, nic se nekoriguje.
self_test-interlock_no_value = Není hodnota: { $status }.
    .remedy = Bez hodnoty se blokování bere jako ztracený vstup: nic se nezapne a působící korekce se chvíli drží a pak odezní.
self_test-other_compensation_no_value = Není hodnota: { $status }.
    .remedy = Zajistěte jinak, že kompenzace výrobce je vypnutá.
self_test-other_compensation_active = Na stroji je aktivní jiná kompenzace: obě dohromady jsou chybné.
    .remedy = Vypněte kompenzaci výrobce, nebo nechte vypnutý thermaxis.
self_test-other_compensation_off = Žádná jiná kompenzace není aktivní.
self_test-diameter = { $diameter_mm } mm.
self_test-diameter_no_value = Není hodnota: { $status }.
    .remedy = Obsluha ji může zadat.
self_test-diameter_implausible = { $diameter_mm } mm není pro obrobek věrohodné.
    .remedy = Zkontrolujte uzel a jednotku.
self_test-diameter_outside = { $diameter_mm } mm leží mimo zesílení modelu, { $least_mm } až { $most_mm } mm: použije se krajní.
    .remedy = Zkontrolujte uzel a jednotku.

## Probes

self_test-probe = { SIGNED($value_um, decimals: 1) } µm, neznámé stáří.
self_test-probe_age = { SIGNED($value_um, decimals: 1) } µm, stáří { FIXED($age_s, decimals: 1) } s.
self_test-probe_counter = Čítač je na { $count }.
self_test-probe_no_value = Není hodnota: { $status }.
    .remedy = Kompenzace sondu nepotřebuje.
self_test-probe_unusable = Sondu nelze použít: { $why }
    .remedy = Kompenzace se bez ní obejde; opravte konfiguraci.
self_test-probe_not_asked = Sondy se nelze dotázat, její vlastní spojení se serverem vstupů neodpovídá: { $why }
    .remedy = Kompenzace se bez ní obejde; zkouší se znovu samo.

## Outputs

self_test-output = Ve stroji je offset { FIXED($found_um, decimals: 1) } µm.
self_test-output_not_writable = Server nedovolí tomuto uživateli zapsat offset.
    .remedy = Dejte uživateli právo zápisu; na SINUMERIKu metodou GiveUserAccess.
self_test-output_unreadable = Offset ve stroji nelze přečíst: { $status }.
    .remedy = Umožněte jej číst: korekce začíná tam, kde offset je.
self_test-output_always_zero = Uzel přijímá jen celé { $unit }: korekce do { $total_um } µm se vždy zapíše jako 0.
    .remedy = Zkontrolujte jednotku, nebo ať PLC nabídne jemnější.
self_test-output_too_narrow = Korekce { $total_um } µm se v { $unit } nevejde do { $type }.
    .remedy = Zkontrolujte jednotku, nebo snižte meze.
self_test-output_coarse = Uzel přijímá jen celé { $unit }: korekce se pohybuje po krocích { $step_um } µm, což může poznamenat povrch.
    .remedy = Ať PLC nabídne jemnější jednotku; nepočítá již jemněji, třeba po 0.1 um?
self_test-output_other_unit = Nalezený offset je { $raw }, v { $unit } { $found_um } µm: daleko za mezí { $total_um } µm, ale věrohodný v { $others }.
    .remedy = Zkontrolujte jednotku; je-li správná, nastavte offset ručně na nulu.
self_test-output_beyond = Ve stroji je offset { FIXED($found_um, decimals: 1) } µm, za mezí { $total_um } µm.
    .remedy = Zjistěte, kdo jej zapsal; po zapnutí je to porucha a dovolenou rychlostí půjde na nulu.
self_test-read_back = Stroj hlásí { FIXED($reported_um, decimals: 1) } µm.
self_test-read_back_no_value = Není hodnota: { $status }.
    .remedy = Nečte-li se příliš dlouho nic zpět, je to porucha.
self_test-read_back_differs = Stroj hlásí { FIXED($reported_um, decimals: 1) } µm, { SIGNED($difference_um, decimals: 1) } µm od posledního zápisu.
    .remedy = Bez známky života mohl stroj offset vzít zpět; jinak zkontrolujte uzel.
self_test-heartbeat = Lze ji zapsat.
self_test-life = Čítač života je k dispozici.
self_test-heartbeat_not_writable = Server nedovolí tomuto uživateli zapsat známku života.
    .remedy = Dejte uživateli právo zápisu.
self_test-offset_gone = Offset už nemá hodnotu: { $status }.
    .remedy = Zkuste to znovu.
self_test-offset_not_written_back = Nalezený offset nelze zapsat zpět: { $status }.
    .remedy = Dejte uživateli právo zápisu a zkontrolujte, zda stroj v nynějším režimu zápis dovolí.
self_test-offset_written_back = Nalezený offset byl zapsán zpět: lze jej zapsat.
self_test-history_unreachable = Databáze historie není nyní dostupná: { $cause }. Záznamy zatím čekají v paměti.
self_test-port_unusable = Na portu { $port } nyní nelze naslouchat: { $cause }. Pokud obrazovka tohoto stroje běží, drží jej sama; pokud ne, nespustí se.
