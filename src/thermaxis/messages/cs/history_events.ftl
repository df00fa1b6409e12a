event_kind-start = spuštění
event_kind-stop = ukončení
event_kind-state = stav
event_kind-request = požadavek
event_kind-connection = spojení
event_kind-alarm = alarm
event_kind-commission = uvedení do provozu
event_kind-touch = dotyk
event_kind-loss = mezera

priority-critical = kritický
priority-high = vysoký
priority-medium = střední
priority-low = nízký

event-state_reasons = { CODE($state, "state") }: { CODE($reasons, "reason") }
event-state_named = { CODE($state, "state") }: { CODE($reasons, "reason") } ({ NAME($names) })
event-state = { CODE($state, "state") }
event-request_accepted = { CODE($request, "request") }: přijato, { $answer }
event-request_refused = { CODE($request, "request") }: odmítnuto, { $answer }
event-role_refused = { $method } odmítnuto: { CODE($role, "role") } nesmí, nutná role je { CODE($needed, "role") }
event-loop_started = kompenzace stroje { $machine } byla spuštěna
event-self_test_passed = vlastní test proběhl v pořádku
event-no_saved_state = žádný uložený stav: { $why }
event-saved_state = stav uložený před { DURATION($age_s) }: { $resumed }
event-saved_state_newer = uložený stav je novější než současný čas: nepoužije se
event-saved_state_newer_fault = uložený stav je novější než současný čas: nepoužije se, kromě poruchy, která trvá: { CODE($reason, "reason") }
event-source_connected = spojení se strojem naměřených hodnot je navázáno
event-source_lost = spojení se strojem naměřených hodnot je přerušeno
event-sink_connected = spojení se strojem posunů je navázáno
event-sink_lost = spojení se strojem posunů je přerušeno
event-source_reason = stroj naměřených hodnot: { $reason }
event-sink_reason = stroj posunů: { $reason }
event-logged_in = { $name }: přihlášení ke stavovému serveru
event-log_in_refused = { $name }: stavový server přihlášení odmítl
event-not_stored = Historii nebylo možné zapisovat po dobu { DURATION($lasted_s) }: { $why }
event-history_damaged = Historie { $file } je poškozena ({ $detail }): byla odložena jako { $aside } a začala nová
event-part_unwritten = hotové hodiny zůstávají řádky databáze, protože jejich soubor nelze zapsat ({ $detail })
event-old_days_kept = dny nad dobu uchování zůstávají, protože jejich soubory nelze smazat ({ $detail })
event-unshipped_kept = dny nad dobu uchování ({ $days }) zůstávají, dokud nebudou odeslány (thermaxis history ship)
event-unshipped_deleted = smazány neodeslané dny, protože je jich dvakrát více, než se má uchovat ({ $detail })
event-day_unjoined = soubory hotových dnů zůstávají oddělené, protože je nelze spojit ({ $detail })
event-self_test = vlastní test: { $finding }
event-touch = dotyk { NAME($name) }, { SIGNED($value_um, decimals: 1) } µm: { CODE($outcome, "touch") }
event-alarm_gone = pominulo: { $alarm }
event-alarm = { CODE($priority, "priority") }: { $alarm }
event-offset_unusable = ve stroji není platný posun: nic se nezapisuje
event-state_saved_again = pominulo: stav lze opět ukládat
event-state_unsaved = stav nelze uložit do { $file }: { $detail }
event-users_unreadable = nikdo není znám: { $problem }
event-users_readable = soubor uživatelů se opět čte
event-publisher_ended = program se stavovým serverem, metrikami a historií skončil: spouští se znovu
event-server_unopened = server programu vedle smyčky je zavřený a zkouší se znovu každou minutu: { $reason }
event-status_server_ended = stavový server nemůže informovat své odběratele ({ $detail }): je ukončen, a s ním každé spojení; do minuty začne nový
event-certificate_not_yet_valid = certifikát { $file } platí až od { $date }: zkontrolujte hodiny
event-certificate_expired = certifikát { $file } vypršel { $date }: servery jej odmítnou; obnovte jej
event-certificate_expires = certifikát { $file } vyprší { $date }: obnovte jej
failure-history_unwritable = Historii nelze uložit: { $detail }.
failure-part_unwritten = Hotové hodiny zůstávají řádky databáze, protože jejich soubor nelze zapsat: { $detail }.
failure-history_opening = Historie se otevírá už { FIXED($lasts_s, decimals: 0) } s.
failure-database_silent = Databáze neodpovídá už { FIXED($lasts_s, decimals: 0) } s.
failure-history_replaced = Soubor historie byl odstraněn nebo nahrazen.
failure-historian_ended = Záznam historie skončil.
failure-publisher_ended = Program vedle smyčky se stavovým serverem, metrikami a historií skončil; spouští se znovu.
failure-publisher_silent = Program vedle smyčky se stavovým serverem, metrikami a historií mlčí už { FIXED($lasts_s, decimals: 0) } s.
event-records_lost =
        v historii chybí { $cycles ->
            [one] { $cycles } cyklus
            [few] { $cycles } cykly
           *[other] { $cycles } cyklů
        } a { $events ->
            [one] { $events } událost
            [few] { $events } události
           *[other] { $events } událostí
        }
event-step_proven = znaménko a velikost jsou správné: { FIXED($moved_um, decimals: 1) } um na { SIGNED($asked_um, decimals: 1) } um
event-step_not_measured = změřená hodnota není číslo: nic není prokázáno
event-step_without_effect = bod nástroje se posunul o { FIXED($moved_um, decimals: 1) } um místo o { SIGNED($asked_um, decimals: 1) } um: posun nepůsobí, nebo až po povolení v řídicím systému
event-step_other_way = bod nástroje se posunul opačným směrem, o { FIXED($moved_um, decimals: 1) } um: chybné je znaménko tohoto výstupu, nebo toho, co měřilo; než jedno změníte, podívejte se, kam se nástroj pohybuje
event-step_other_size = bod nástroje se posunul o { FIXED($moved_um, decimals: 1) } um místo o { SIGNED($asked_um, decimals: 1) } um, { FIXED($times, decimals: 2) }krát tolik: jednotka tohoto výstupu je chybná
event-step_not_back = po návratu zbylo { FIXED($left_um, decimals: 1) } um: tření, drift, nebo osou hýbe něco jiného
event-loop_ended = kompenzace stroje { $machine } byla ukončena
event-loop_ended_standing = kompenzace stroje { $machine } byla ukončena; ve stroji zůstává: { $standing }
resumed-enabled = { $kept }; je zapnuta jako dříve
resumed-off = { $kept }; je vypnuta
resumed-fault = { $kept }; porucha trvá: { CODE($reason, "reason") }

kept-sections = členy a vztažné teploty se přebírají
kept-steady_state = model začíná v ustáleném stavu, s uloženými vztažnými teplotami
kept-other_model = je od jiného modelu, { $file }; vztažné teploty se přebírají a někdo musí zapnout


why-no_file = soubor neexistuje
why-damaged = { $file } je poškozen ({ $detail })
why-other_version = { $file } je od jiné verze programu ({ $version }): nepoužije se
