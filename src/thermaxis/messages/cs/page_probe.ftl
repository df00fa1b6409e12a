probe-unknown = Na tomto stroji není taková sonda.
probe-which = Sonda
probe-none = Na tomto stroji není nastavena žádná sonda.
probe-how = Pokud řízení ukazuje, co sonda měří, doplňte její uzel do souboru { $file } a spusťte kompenzaci znovu. Jméno je jméno výstupu. Sonda se jen zobrazuje a zaznamenává, ledaže podle její tabulky platí dotyky.
probe-now = Nyní
probe-compensated = S kompenzací (měřeno)
probe-uncompensated = Bez kompenzace (bez posunu)
probe-model = Model
probe-chart = Posunutí bodu nástroje, kladné směrem od obrobku
probe-range_compensated = Rozpětí s kompenzací
probe-range_uncompensated = Rozpětí bez kompenzace
probe-range_model = Rozpětí modelu
probe-ratio = Z chyby zbývá
probe-told_values = Z { $count } hodnot mezi { $first } a { $last } ({ $length }). Počítají se jen časy, kdy sonda měřila a posun je znám; šum sondy je v každém čísle.
probe-told_means = Z { $count } průměrů přes { $step } mezi { $first } a { $last } ({ $length }); rozpětí jednotlivých hodnot je o něco větší. Počítají se jen kroky, kdy sonda měřila a posun je znám.
probe-told_nothing = V tomto období není čas, kdy sonda měřila a posun je znám.
probe-sign = Bez kompenzace = sonda − účinný posun (přijatý, pokud řízení účinný neuvádí). Mezery: sonda nic neměří, nebo je kompenzace vypnutá a posun se nečte.
