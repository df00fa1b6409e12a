### What the diagnosis finds on an axis

## Findings

finding-scale_error_linear = Straight-line error of { SIGNED($slope_um_per_m) } µm/m ({ SIGNED($over_length_um) } µm over { $length_mm } mm), { $state }; an error of { FIXED($temperature_error_K) } K in the temperature of the material would explain it, at { $expansion_ppm_per_K } ppm/K ({ $source }).
    .short = Straight-line error of { SIGNED($slope_um_per_m) } µm/m ({ SIGNED($over_length_um) } µm over { $length_mm } mm), { $state }.
finding-scale_error_rotary = Straight-line error of { SIGNED($slope_arcsec_per_turn) } arcsec per turn ({ SIGNED($over_length_arcsec) } arcsec over { $length_deg } °), { $state }.
finding-once_per_turn_error = Once-per-turn error with an amplitude of { FIXED($amplitude) } { $unit } (for example eccentricity).
finding-periodic_error = Periodic error with an amplitude of { FIXED($amplitude) } { $unit } and a period of { $period } { $position_unit }, { $source }.
finding-periodic_error_ambiguous = Periodic error with an amplitude of { FIXED($amplitude) } { $unit } and a period of { $period } { $position_unit }, { $source }; on these targets others would fit about as well: { $others }.
finding-backlash = Mean reversal value of { SIGNED($mean) } { $unit }, { $state } ({ $cause }).
    .short = Mean reversal value of { SIGNED($mean) } { $unit }, { $state }.
finding-backlash_step = The reversal value steps by { SIGNED($step) } { $unit } between { $before } { $position_unit } and { $behind } { $position_unit }, from { SIGNED($first) } { $unit } to { SIGNED($last) } { $unit }.
finding-backlash_variation = The reversal value varies by { FIXED($range) } { $unit } along the axis, from { SIGNED($lowest) } { $unit } at { $lowest_at } { $position_unit } to { SIGNED($highest) } { $unit } at { $highest_at } { $position_unit }.
finding-spread = Target { $target } ({ $position } { $position_unit }) scatters { $compared }, with a standard deviation of { FIXED($std) } { $unit }.
finding-spread_drift_included = Target { $target } ({ $position } { $position_unit }) scatters { $compared }, with a standard deviation of { FIXED($std) } { $unit }, drift included.
finding-spread_drifts_otherwise = Target { $target } ({ $position } { $position_unit }) scatters { $compared }, with a standard deviation of { FIXED($std) } { $unit }; it also drifts otherwise than the rest of the axis.
finding-frozen_readings = Target { $target } ({ $position } { $position_unit }) repeats exactly in all { $readings } readings, where the others have a standard deviation of { FIXED($others) } { $unit }: a frozen display?
finding-drift_reversal = The drift reverses its direction at { $position } { $position_unit }: { SIGNED($there) } { $unit } up to { $after }, then { SIGNED($back) } { $unit }; two parts of the machine warm up against each other.
finding-temperature_channel = The drift follows the channel '{ $channel }' without delay: correlation { SIGNED($correlation, decimals: 3) }, { SIGNED($gain) } { $unit }/K.
finding-temperature_channel_delayed = The drift follows the channel '{ $channel }' { $delay } later: correlation { SIGNED($correlation, decimals: 3) }, { SIGNED($gain) } { $unit }/K.
finding-hidden_period_stated = The intervals between the targets are nearly multiples of { $periods } (stated in the file): an error with such a period stays hidden; measure with a random part of the targets.
    .short = An error with a period of { $periods } (stated in the file) stays hidden at these targets.
finding-hidden_period_common = The intervals between the targets are nearly multiples of periods that are common for drives ({ $periods }): an error with such a period stays hidden; measure with a random part of the targets.
    .short = An error with a period of { $periods } stays hidden at these targets.

## Phrases in them

diagnosis-amount = { $amount } { $unit }
diagnosis-readings = { $readings } readings
diagnosis-drift_included = with the drift of the run in it
diagnosis-without_drift = without drift
diagnosis-first_reading = at the first reading
diagnosis-coefficient_stated = stated in the file
diagnosis-coefficient_of_steel = steel; the file states no coefficient
diagnosis-half_the_pitch = half the pitch that the file states
diagnosis-period_stated = as the file states for the drive or the encoder
diagnosis-screw_pitch = a common pitch of screws
diagnosis-worm_wheel_pitch = a common pitch of worm wheels
diagnosis-lost_motion = for example lost motion
diagnosis-too_much_compensation = for example too much compensation, or a sign or direction exchanged
diagnosis-times_others = { FIXED($ratio) } times as much as the others
diagnosis-unlike_others = unlike the others
