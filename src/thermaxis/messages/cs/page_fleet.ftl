### Ranní přehled strojů a příběh jednoho stroje.

common-page_fleet = Stroje
fleet-title = Noc na { $day }
fleet-no_nights = Zatím žádná noc
fleet-named = { $count } z { $all } strojů je třeba prohlédnout
fleet-quiet = Ostatní: { $count }
fleet-more = Dalších { $count }: vyberte podle druhu nebo jména.
fleet-all = Všechny stroje
fleet-look = Co je třeba prohlédnout

fleet-need_set_aside = Odloženo
fleet-do_set_aside = Noc tohoto stroje dvakrát selhala: řekněte tomu, kdo se o stroje stará.
fleet-since = od { $day }
fleet-need_sensors = Snímač
fleet-need_proposal = Je navržen model
fleet-do_proposal = Porovnejte, co zbývá předtím a potom, pak přijměte nebo odmítněte.

fleet-kind = Druh
fleet-every_kind = každý druh
fleet-text = Jméno obsahuje
fleet-choose = Vybrat
fleet-machine = Stroj
fleet-day = Noc na
fleet-outcome = Stav modelu
fleet-outcome_verified = ověřen
fleet-outcome_unverified = neověřen
fleet-outcome_set_aside = odloženo
fleet-outcome_none = zatím žádná noc
fleet-touches = Dotyky
fleet-rmse = Zbývá [µm]
fleet-mean = Průměr [µm]
fleet-offset_mae = S dotyky [µm]
fleet-found = Nález

fleet-model = model
fleet-models = Modely, které platily
fleet-nights = Noci
fleet-residual = Co model každou noc ponechá
fleet-rmse_of_night = Střední kvadratická hodnota
fleet-mean_of_night = Průměr
fleet-offset_of_night = Střední velikost s dotyky
fleet-no_figures = Žádná noc ještě model neověřila.
fleet-mark_model = model { $sha256 }: { $why }
fleet-mark_proposed = navržen model { $sha256 }
fleet-mark_accepted = { $who }: přijato { $sha256 }: { $why }
fleet-mark_rejected = { $who }: odmítnuto { $sha256 }: { $why }
fleet-mark_withdrawn = { $who }: odvoláno { $sha256 }: { $why }

fleet-axis = Osa { $axis }: hodnoty podle ISO 230-2 [{ $unit }]
fleet-start = Začátek
fleet-run = Běh
fleet-drift_free = { $figure } bez driftu

fleet-proposals = Návrhy
fleet-proposed = Model { $sha256 }, navržený nocí na { $day }
fleet-open = nikdo nerozhodl
fleet-why = Proč
fleet-accept = Přijmout
fleet-reject = Odmítnout
fleet-nothing_written = Na stroj se nic nezapíše: co je přijato, patří do jeho složky modelů a tam se vybere.
fleet-download = Stáhnout
fleet-who_decides = Rozhoduje přihlášený technolog.
fleet-nobody_decides = Tato stránka byla spuštěna bez souboru uživatelů: zde nikdo nerozhoduje.
fleet-decided_before = Neprovedeno: někdo už rozhodl, nebo je navržen novější model. Načtěte stránku znovu.
fleet-no_why = Uveďte důvod.
fleet-no_decision = To není rozhodnutí o návrhu.
fleet-no_machine = Registr takový stroj nemá.
fleet-no_model = Žádný přijatý návrh nemá tento otisk.
fleet-no_registry = Registr neodpovídá: { $said }
