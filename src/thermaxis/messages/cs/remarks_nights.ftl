### Poznámky k noci stroje

remark-nothing_measured = v ten den byla změřena méně než dvě posunutí: model není ověřen
remark-clock_went_back = hodiny šly { $count }krát zpět: minuty, které přišly dvakrát, jsou spojeny
remark-night_failed = dvakrát selhalo a je odloženo: { $failure }
