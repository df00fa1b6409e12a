state-Off = Vypnuto
state-Warming = Náběh
state-Active = Kompenzuje
state-Holding = Podržení
state-Fading = Dobíhá
state-Fault = Porucha

reason-disabled = není zapnuta
reason-settling = model ještě neběží dost dlouho
reason-recovering = vše je opět k dispozici; musí to chvíli vydržet
reason-input_bad = vstup nemá použitelnou hodnotu
reason-connection_lost = spojení se strojem je přerušeno
reason-interlock_open = není splněno blokování
reason-operator_hold = drží ji obsluha
reason-hold_expired = byla podržena nejdelší povolenou dobu
reason-read_back_differs = stroj nehlásí zpět zapsaný posun
reason-long_at_limit = korekce byla příliš dlouho na své mezi
reason-double_compensation = je aktivní jiná kompenzace, nebo posun zapisuje něco jiného
reason-offset_outside = posun nalezený ve stroji leží mimo meze

model_quality-good = dobrý
model_quality-held = podržený
model_quality-bad = nepoužitelný

outcome-started = model byl spuštěn
outcome-waiting = model čeká, až bude mít každý vstup dobrou hodnotu
outcome-clock_backward = hodiny se vrátily: model začal znovu v ustáleném stavu
outcome-clock_unusable = čas odečtu není číslo: výpočet se neposunul
outcome-clock_still = hodiny stojí: výpočet se neposunul
outcome-state_unusable = uložený stav nepatří k tomuto modelu: model začíná znovu
outcome-gap = příliš dlouho bez odečtu: model začal znovu v ustáleném stavu
outcome-input_held = vstup vypadl: drží se jeho poslední dobrá hodnota
outcome-input_failed = vstup vypadl na delší dobu, než smí být podržen
outcome-diameter_held = průměr obrobku leží mimo rozsah zesílení: platí krajní hodnota
outcome-diameter_unknown = není zadán průměr obrobku: platí zesílení ve středu nástroje
outcome-outside_validity = vstup leží mimo rozsah, ze kterého model vznikl
