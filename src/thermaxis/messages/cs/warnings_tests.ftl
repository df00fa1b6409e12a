### Co je třeba vědět o tepelné zkoušce

warning-thermal_test_short = zkouška trvá { $hours } h; obvyklé jsou nejméně { $least_h } h, často 24 h [M]
warning-thermal_test_ended_early = běželo to { $hours } h: kratší než { $least_h } h, a ne dokud se posledních 60 min nezmění o méně než { $percent } % prvních 60 min [M]
warning-thermal_test_highest_passed = rychlost dosáhla { $highest }, nad uvedenou nejvyšší { $stated }: podíly ve spektru jsou z { $highest }
warning-thermal_test_moves_at_once = stroj se pohybuje již v prvním řádku: nula nemusí být nulou stroje v klidu, a pak jsou rozpětí příliš malá
warning-thermal_test_cooling_short = po pohybu bylo zaznamenáno { $minutes } min; obvyklých je nejméně 60 min klidu [M]
warning-thermal_test_turned = { $channel } je v { $percent } % řádků nad klidem: toto není chyba změnou teploty prostředí (ETVE)
warning-thermal_test_probes_missing = neměřeno: { $probes }; co ukazují, do této zkoušky nepatří
warning-thermal_test_without_ambient = není uvedena teplota prostředí: její rozpětí a gradient chybějí
warning-thermal_test_not_stated = v [uncertainty] není uvedeno: { $keys }; U je bez jejich příspěvků
warning-thermal_test_gap = { $quantity } nemá od minuty { $at_min } po { $minutes } min žádnou hodnotu: co se tam stalo, není v žádném rozpětí
warning-thermal_test_model_failed = v { $percent } % řádků měl vstup modelu příliš dlouhý výpadek
warning-thermal_test_of_training = model byl identifikován na tomto záznamu: co nechává, nic nedokazuje, to dokáže až jiná zkouška
