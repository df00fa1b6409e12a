### Proč je navržen jiný model, nebo žádný

relearn-better = lepší na { $judged } dotycích, které žádný z obou modelů neviděl: co dotyk přidá, klesne z { FIXED($old_um, decimals: 2) } na { FIXED($new_um, decimals: 2) } µm, naučeno z { $learnt } dotyků předtím
relearn-no_better = nic není lepší než platný model na nejnovějších { $judged } dotycích (učilo se z { $learnt } předtím)
relearn-few_touches = příliš málo dotyků: { $learnt } k učení, { $judged } k posouzení; dotýkejte se častěji
relearn-sensors_first = jiný model ponechá méně, ale nejprve se podívejte na snímače: { $names }
relearn-condemned = jiný model ponechá méně než platný, ale nehodí se: { CODE($rule, "unfit") }
unfit-nothing = bez modelu zbude stejně málo
unfit-averages = pevné průměry vstupů zvládnou totéž
unfit-static = statická regrese zvládne totéž
unfit-warning-not_fit = identifikace jej zavrhla
unfit-warning-explains_nothing = identifikace jej zavrhla
