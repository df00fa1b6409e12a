### Proč je stroj flotily jmenován a co dělat

cause-sensor_frozen = snímač stojí
cause-sensors_swapped = snímače jsou zaměněny
cause-sensor_offset = snímač ukazuje vedle
cause-gain = odpovídá na teplo více nebo méně
cause-time_constant = odpovídá na teplo rychleji nebo pomaleji
cause-drift = pohybuje se bez tepla
cause-unknown = model odpovídá hůře

fault-sensor_frozen = { NAME($name) } dává stále stejnou hodnotu, zatímco ostatní snímače se mění.
    .remedy = Zkontrolujte snímač, jeho kabel a modul.
fault-sensors_swapped = { NAME($name) } jsou zřejmě zaměněny: obráceně vysvětlují, co ukazují doteky.
    .remedy = Zkontrolujte zapojení a přiřazení snímačů.
fault-sensor_offset = V klidu leží { NAME($name) } vůči sousedům o { SIGNED($departure_k, decimals: 1) } K jinak než dříve.
    .remedy = Porovnejte snímač s jiným a podívejte se, zda ještě sedí na stroji.
fault-gain = Posunutí způsobené { NAME($name) } se od modelu liší o { SIGNED($departure_percent, decimals: 0) } %.
    .remedy = Podívejte se, co se změnilo: chlazení, upnutí, ložiska. Je-li stroj v pořádku, přijměte navržený model.
fault-time_constant = Časová konstanta { NAME($name) } se od modelu liší o { SIGNED($departure_percent, decimals: 0) } %.
    .remedy = Podívejte se, co se změnilo: chlazení, ventilátory, kryty. Je-li stroj v pořádku, přijměte navržený model.
fault-drift = Bod nástroje se bez tepla posunul o { SIGNED($departure_um, decimals: 1) } µm.
    .remedy = Byla vztažná poloha nastavena znovu? Jinak hledejte opotřebení, kolizi nebo uvolněnou sondu; změřte osu.
fault-unknown = To, co model na dotecích nevysvětlí, vzrostlo na { FIXED($times, decimals: 1) }násobek.
    .remedy = Podívejte se na doteky a teploty posledních dnů.
