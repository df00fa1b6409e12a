### Why another model is proposed, or none

relearn-better = better on { $judged } touches that neither model had seen: what a touch adds falls from { FIXED($old_um, decimals: 2) } to { FIXED($new_um, decimals: 2) } µm, learnt from { $learnt } touches before
relearn-no_better = nothing is better than the model in force on the newest { $judged } touches ({ $learnt } before them were learnt from)
relearn-few_touches = too few touches: { $learnt } to learn from, { $judged } that judge; touch more often
relearn-sensors_first = another model leaves less, but look at the sensors first: { $names }
relearn-condemned = another model leaves less than the one in force, and is not fit: { CODE($rule, "unfit") }
unfit-nothing = no model at all leaves as little
unfit-averages = fixed averages of the inputs do as well
unfit-static = a static regression does as well
unfit-warning-not_fit = identification condemns it
unfit-warning-explains_nothing = identification condemns it
