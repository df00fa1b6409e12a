### Words of the probe's page.

probe-unknown = There is no such probe on this machine.
probe-which = Probe
probe-none = No probe is configured on this machine.
probe-how = Where the control shows what a probe measures, add its node to { $file } and start the loop again. The name is that of the output. A probe is only shown and recorded, unless its table says that touches of it count.
probe-now = Now
probe-compensated = Compensated (measured)
probe-uncompensated = Uncompensated (without the offset)
probe-model = Model
probe-chart = Displacement of the tool point, positive away from the workpiece
probe-range_compensated = Peak to peak, compensated
probe-range_uncompensated = Peak to peak, uncompensated
probe-range_model = Peak to peak, model
probe-ratio = Left of the error
probe-told_values = From { $count } values between { $first } and { $last } ({ $length }). Only times count at which the probe measured and the offset is known; the probe's noise is in every figure.
probe-told_means = From { $count } means over { $step } between { $first } and { $last } ({ $length }); peak to peak of single values is a little larger. Only steps count at which the probe measured and the offset is known.
probe-told_nothing = In this span there is no time at which the probe measured and the offset is known.
probe-sign = Uncompensated = probe − effective offset (the accepted one where the control does not say which acts). Gaps: the probe measures nothing, or the compensation is off and the offset is not read.
