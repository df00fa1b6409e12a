### What was noticed of displacements when a thermal log was read

remark-displacement_leaps = { $name } leaps { $count } times, by up to { $size } { $unit }, between rows { $row } and { $last }, and { $why ->
        [back] comes back, as when something is switched
        [alike] by the same few sizes, as a coarse display or something that is switched
       *[often] too often for a probe set to zero
    }: it was left as it is; cut the log by --span, or mask rows by --mask
remark-displacement_drifts = { $output } drifts steadily by { SIGNED($um_per_h) } ± { $within_um_per_h } um/h, which no input explains: a probe or a clamping that creeps; { $sensors ->
    [none] a sensor that drifts explains it far less
   *[other] or else a sensor drifts, one of { $sensors } over the log
    } (the rows are used as they are: DC gains and slow lags may be wrong; check the probe, and sensors against another)
