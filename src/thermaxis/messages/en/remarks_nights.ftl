### Remarks on a machine's night

remark-nothing_measured = fewer than two displacements were measured on the day: the model was not verified
remark-clock_went_back = the clock went back { $count } times: minutes that came twice are joined
remark-night_failed = failed twice and is set aside: { $failure }
