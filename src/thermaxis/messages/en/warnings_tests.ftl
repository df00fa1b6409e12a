### What must be known of a thermal test

warning-thermal_test_short = the test lasts { $hours } h; at least { $least_h } h are usual, often 24 h [M]
warning-thermal_test_ended_early = it ran for { $hours } h: shorter than { $least_h } h, and not until the last 60 min change less than { $percent } % of the first 60 min [M]
warning-thermal_test_highest_passed = the speed went up to { $highest }, above the stated highest one of { $stated }: shares in the spectrum are of { $highest }
warning-thermal_test_moves_at_once = the machine already moves in the first row: the zero may not be that of a machine at rest, and then ranges are too small
warning-thermal_test_cooling_short = { $minutes } min were recorded after the motion; at least 60 min at rest are usual [M]
warning-thermal_test_turned = { $channel } is above standstill in { $percent } % of the rows: this is no environmental temperature variation error
warning-thermal_test_probes_missing = not measured: { $probes }; what they show is not part of this test
warning-thermal_test_without_ambient = no ambient temperature is named: its range and gradient are missing
warning-thermal_test_not_stated = not stated in [uncertainty]: { $keys }; U is without their terms
warning-thermal_test_gap = { $quantity } has no value for { $minutes } min from minute { $at_min } on: what happened there is in no range
warning-thermal_test_model_failed = in { $percent } % of the rows an input of the model had failed for too long
warning-thermal_test_of_training = the model was identified on this log: what it leaves is no proof of it, another test is
