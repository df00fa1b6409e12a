remark-outside_training = vstup { $name } leží v { FIXED($share_percent, decimals: 0) } % řádků mimo rozsah záznamů, až o { FIXED($beyond_percent, decimals: 0) } % jeho šířky: tam se model extrapoluje
remark-input_failed = v { FIXED($share_percent, decimals: 1) } % řádků byl vstup příliš dlouho vypadlý
remark-gap = { outcome-gap } ({ $count }krát)
remark-clock_backward = { outcome-clock_backward } ({ $count }krát)
remark-limits_too_narrow = meze jsou příliš úzké: kompenzace přejde { $count }krát do stavu Porucha; zde se každá ihned potvrdí
