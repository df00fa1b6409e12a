## What an uncertainty is without

left_out-no_budget = instrument and environment: no budget was given
left_out-not_stated = { CODE($term, "term") }: not stated in the budget
left_out-keys_not_stated = { $keys }: neither stated in the budget nor declared nil by a 0
left_out-in_scatter = environmental variation (the scatter of the readings is larger and contains it)
left_out-drift_unknown = drift (it is not known and counts as scatter)
left_out-drift_not_described = drift of target { $targets }, which the drift model does not describe
left_out-everything = all that it could consist of: nothing was evaluated
left_out-one_reading = scatter: the readings do not tell it

## Terms of an uncertainty budget

term-device = instrument
term-misalignment = misalignment of the beam
term-material_temperature = temperature of the material
term-expansion_coefficient = expansion coefficient
term-environmental_variation = environmental variation
term-noise = scatter of the readings
term-resolution = rounding of the readings
term-extremes = bias of maxima and minima, not corrected
term-nonlinearity = non-linearity: terms together, beyond the root of squares
