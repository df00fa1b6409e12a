left_out-no_budget = přístroj a prostředí: nebyl zadán rozpočet nejistot
left_out-not_stated = { CODE($term, "term") }: v rozpočtu nejistot neuvedeno
left_out-keys_not_stated = { $keys }: v rozpočtu nejistot neuvedeno ani označeno nulou jako nulové
left_out-in_scatter = vliv prostředí (rozptyl čtení je větší a obsahuje jej)
left_out-drift_unknown = drift (není znám a počítá se jako rozptyl)
left_out-drift_not_described = drift cílové polohy { $targets }, který model driftu nepopisuje
left_out-everything = vše, z čeho by mohla sestávat: nic nebylo vyhodnoceno
left_out-one_reading = rozptyl: jediné čtení jej neurčí

term-device = přístroj
term-misalignment = seřízení paprsku
term-material_temperature = teplota materiálu
term-expansion_coefficient = součinitel roztažnosti
term-environmental_variation = vliv prostředí
term-noise = rozptyl čtení
term-resolution = zaokrouhlení čtení
term-extremes = vychýlení maxim a minim, nekorigované
term-nonlinearity = nelinearita: všechny členy společně, nad odmocninu součtu čtverců
