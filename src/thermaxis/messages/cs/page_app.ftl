### Slova aplikace: její první stránka a konec.

app-end = Ukončit
app-end_sure = Ukončit program? Vše na jeho stránkách, co nebylo uloženo, se ztratí.
app-ended = Program skončil. Tuto stránku lze zavřít.
app-no_token = Tato stránka se otevře jen na adrese, kterou program vypsal, s jejím klíčem. Je-li adresa ztracena, spusťte thermaxis app znovu.

## co se v oddílu dělá

room-step_waiting = Pracuje se:
room-step_reading = Čtení a vyhodnocení:
room-step_checking = Kontrola snímačů:
room-step_identifying = Identifikace:
room-step_simulating = Simulace:
room-step_joining = Spojování:
room-step_report = Píše se zpráva:
room-refused = To nelze provést: { $said }
room-too_long = Trvalo to déle než { $limit } s a bylo to zastaveno. Zkraťte soubor, nebo použijte jiný počítač.
room-too_much = Zapisovalo to více, než smí, a bylo to zastaveno. Zkraťte soubor, nebo použijte jiný počítač.
room-too_hungry = Potřebovalo to více paměti, než smí mít, a skončilo to. Zkraťte soubor, nebo použijte jiný počítač.
room-too_large = Soubor je větší než { $megabytes } MB. Zkraťte jej, nebo zaznamenávejte méně často.
room-too_slow = Soubor nedorazil do { $limit } s. Zkontrolujte spojení a odešlete jej znovu.
room-empty = Soubor je prázdný.
room-not_stored = Soubor nelze uložit: disk je možná plný. Uvolněte místo a zkuste to znovu.
room-crashed = Nepodařilo se to. Více říká výpis programu nebo jeho záznam.
room-busy = Pracuje se na něčem jiném. Zkuste to za minutu.
room-own = To, co jste žádali předtím, ještě běží. Počkejte, nebo to zrušte.
room-gone = To už zde není. Načtěte stránku znovu.
room-bad_option = Volba není známa nebo nemá smysl: { $option }
room-no_answer = Program neodpovídá. Ověřte, že ještě běží, a zkuste to znovu.
room-cancelled = Zrušeno. Vše předchozí zůstalo.
room-cancel = Zrušit
room-field = „{ $name }“
