### Co brání spojení se strojem nebo zápisu

## Connections to OPC UA servers

error-certificate_not_trusted = Server nedůvěřuje vlastnímu certifikátu.
    .remedy = Označte { $certificate } na stroji jako důvěryhodný (bývá tam mezi odmítnutými); pak se program připojí sám.
error-other_server_certificate = Server odpovídá jiným certifikátem, než je uložený.
    .remedy = Pokud byl stroj opravdu obnoven, načtěte jeho certifikát pomocí thermaxis certificate fetch a porovnejte otisk; jinak může být spojení odposloucháváno.
error-user_refused = Server odmítá uživatele { $user }.
    .remedy = Zkontrolujte jméno a heslo a práva uživatele na stroji.
error-log_in_refused = Server odmítá tento způsob přihlášení.
    .remedy = Zkontrolujte jméno a heslo; některé řídicí systémy chtějí od uživatelů certifikát.
error-log_in_way_refused = Server odmítá tento způsob přihlášení, například bez uživatele.
    .remedy = Zadejte uživatele a heslo se šifrováním, nebo na stroji povolte anonymní přístup.
error-application_uri_refused = Adresa ve vlastním certifikátu není { $application_uri }.
    .remedy = Nastavte application_uri na adresu, kterou vypíše thermaxis certificate show, nebo vytvořte nový certifikát.
error-certificate_not_valid_now = Server hlásí, že certifikát v tuto dobu neplatí.
    .remedy = Zkontrolujte data pomocí thermaxis certificate show a hodiny obou počítačů.
error-host_not_in_certificate = Serveru chybí v certifikátu jeho nebo naše jméno.
    .remedy = Vytvořte nový vlastní certifikát s --host a jménem tohoto počítače.
error-no_session_left = Server nemá volnou relaci.
    .remedy = Zavřete jiné klienty, nebo počkejte, až osiřelé relace vyprší.
error-security_not_offered = Server nenabízí security = "{ $security }".
    .remedy = Zapněte to na stroji, nebo uveďte nabízené s certifikáty: docs/how-to/opc-ua-security.md.
error-address_refused = Server nezná adresu { $url }.
    .remedy = Zapište adresu tak, jak ji ukazuje stroj, včetně cesty.
error-too_many_nodes = Server přijímá v jednom požadavku méně uzlů, než je žádáno.
    .remedy = Čtěte méně uzlů, nebo zvyšte mez na stroji.
error-no_answer_in_time = Do { $timeout_s } s nepřišla odpověď.
    .remedy = Zkontrolujte, zda server ještě běží, a síť.
error-answer_not_understood = Odpovědi serveru nelze rozumět ({ $kind }).
    .remedy = Zkontrolujte, zda adresa patří serveru OPC UA.
error-server_answers = Server odpovídá { $status }.
    .remedy = Vyhledejte název v příručce řídicího systému.
error-connection_failed = Spojení selhalo: { $cause }.
    .remedy = Zkontrolujte, zda adresa patří serveru OPC UA.
error-nothing_listens = Na portu { $port } počítače { $host } nic neodpovídá.
    .remedy = Spusťte server na stroji, nebo opravte adresu.
error-unknown_host = Jméno { $host } není v síti známo.
    .remedy = Opravte adresu, nebo zadejte číslo.
error-connection_closed = Server uzavřel spojení.
    .remedy = Pokud to trvá, server možná nemá volné spojení, nebo nedůvěřuje vlastnímu certifikátu.
error-network_failed = Síť selhala: { $cause }.
    .remedy = Zkontrolujte kabely, adresu a firewall.
error-another_program_writes = Offsety tohoto stroje zapisuje jiný program: jeho token se obnovuje.
    .remedy = Ukončete onen program, nebo tento.

error-machine_silent = Stroj neodpověděl.
    .remedy = Zkontrolujte stroj a síť.

## Offsets that are not written

error-offsets_not_read_yet = Nic se nezapisuje, dokud nejsou přečteny offsety stroje.
error-token_not_old_yet = Nic se nezapisuje, dokud token ve stroji nezůstane chvíli beze změny: mohl by ho obnovovat jiný program.
error-token_unread = Token, který ukazuje jiné programy, nelze přečíst, proto se nic nezapisuje.
    .remedy = Zkontrolujte token_node a práva uživatele.
error-no_finite_correction = Pro { $names } není konečná korekce: nic nebylo zapsáno.
error-offset_of_unreadable = Offset { $names } nelze přečíst, proto se nic nezapisuje.
    .remedy = Zkontrolujte uzly a práva uživatele.
error-unit_too_coarse = Stroj počítá offset { $names } v celých jednotkách hrubších než mikrometr, proto se nic nezapisuje.
    .remedy = Opravte jednotku.
error-write_refused = Stroj odmítl { $refused }.
    .remedy = Zkontrolujte uzel.
error-write_right_missing = Stroj odmítl { $refused }.
    .remedy = Dejte uživateli právo zápisu.
error-node_not_writable = Stroj odmítl { $refused }.
    .remedy = Umožněte na stroji zápis do uzlu.
error-no_such_node = Stroj odmítl { $refused }.
    .remedy = Opravte uzel.
error-node_no_number = Stroj odmítl { $refused }.
    .remedy = Uveďte uzel, který obsahuje číslo.
error-write_out_of_range = Stroj odmítl { $refused }.
    .remedy = Zkontrolujte rozsah na stroji a jednotku.

## LinuxCNC

error-linuxcnc_not_running = LinuxCNC na tomto počítači neběží.
    .remedy = Čeká se na něj. V kontejneru musí být sdílená paměť pamětí počítače.
error-linuxcnc_of_other_user = LinuxCNC spustil uživatel s číslem { $user }.
    .remedy = Spouštějte thermaxis jako uživatel, který spouští LinuxCNC.
error-linuxcnc_changed = LinuxCNC právě skončil nebo začal.
error-no_halcmd = Program { $program } neexistuje.
    .remedy = Patří k LinuxCNC; uveďte jeho cestu.
error-halcmd_not_started = halcmd nelze spustit: { $cause }.
error-halcmd_silent = halcmd neodpověděl do { $deadline_s } s.
    .remedy = Spustí se znovu; pokud to trvá, zkontrolujte, zda LinuxCNC ještě odpovídá.
error-halcmd_ended = halcmd skončil: { $said }
error-halcmd_pipe_broken = Spojení s halcmd se přerušilo: { $cause }.
error-halcmd_out_of_step = Spojení s halcmd vypadlo z taktu.
error-hal_too_slow = Čas vypršel dříve, než bylo na vše dotázáno.
error-hal_answers = HAL odpovídá: { $said }.
    .remedy = Porovnejte soubor HAL stroje s tím, který zapisuje thermaxis hal.
error-hal_arrangement = HAL není uspořádán podle svého souboru: { $faults }
    .remedy = Porovnejte soubor HAL stroje s tím, který zapisuje thermaxis hal.
error-hal_value_differs = Bylo nastaveno { $set } a je tam { $found }.
error-hal_bit_differs = Bylo nastaveno { $set } a není tam.
error-servo_thread_off = Vlákno servo neběží.
error-servo_thread_stands_still = Vlákno servo stojí.
error-watchdog_not_started = Watchdog se nespouští.
error-watchdog_tripped = Watchdog zasáhl: zápis nepřišel včas.
error-life_stands = Čítač života { $node } se { $within_s } s nezměnil: co odpovídá za řídicí systém, běží dál bez něj. Zkontrolujte, zda jeho program běží.
error-joint_not_homed = Není referencováno: osa (joint) { $joints }.
