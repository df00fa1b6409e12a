### What the user of a control's compensation table must know

## Fanuc

advice-fanuc_sign = A value is an increment of the correction, minus the deviation, seen from the negative side: positive where the axis must be moved further in positive direction [S]
advice-fanuc_unit = Values are whole numbers of the detection unit times the magnification
advice-fanuc_limits = values up to { $largest }, point numbers up to { $highest } for all axes together; the axis is zero at its reference position
advice-fanuc_rounding = Detection unit { $detection_unit } { $unit }, magnification { $magnification }: one is { $step } { $unit }; the sum of the values departs by at most { $half } { $unit } from the correction at any point.
advice-fanuc_magnified = With the magnification 1 a value would pass { $largest }: the rounding grew from { $before } to { $half } { $unit }; more points, or largest_value=127 on a newer control, win it back.
advice-fanuc_at_once = Between the points some controls put out a value at once in the middle of its section [S]: that adds up to { FIXED($most, decimals: 2) } { $unit } to a linear course.
advice-fanuc_numbers = It is for the axis with number { $number }, and takes the point numbers { $first } to { $last }, which no other axis may use; the reference position, at { $reference } { $position_unit }, is point { $reference_point }.
advice-fanuc_activation = It acts after switching off and on and returning to the reference position [S]; the control asks for the parameter write switch. Save its parameters first.
advice-fanuc_increments = Interval and turn are in 0.001 mm or deg, increment system IS-B [M]: check 3624 [M].
advice-fanuc_second_table_bit = Set bit 0 of parameter 3605 by hand: the file does not, for it holds other bits too.
advice-fanuc_backlash_by_hand = The reversal is in the second table: set the backlash, 1851 and 1852, to 0 by hand [M]. If it was not 0 during the run, the table lacks it: give --backlash-in-force or --merge.
advice-fanuc_backlash_moved = All reversal is in the two tables, { SIGNED($moved, decimals: 2) } { $unit } that were apart included: 1851 is written as 0; set 1852 to 0 by hand [M].
advice-fanuc_backlash_zero = All reversal is in the two tables: 1851 is written as 0; set 1852 to 0 by hand [M].
advice-fanuc_offset = Parameter 3627 is { $offset }: what the other direction differs by at the reference position, in detection units and with this sign [M].
advice-fanuc_backlash = Parameter 1851 is minus the mean reversal of { SIGNED($backlash, decimals: 2) } { $unit }: positive for lost motion [M]. It replaces what 1851 held: that must be in it (--backlash-in-force, --merge). 1852 for rapid traverse is not written.
advice-fanuc_no_backlash = Reversal is parameter 1851 (and 1852 in rapid traverse) [M], which is not written: what it holds stays in force beside this table.
advice-fanuc_ends = The rotary axis is taken as one with ends; with roll over give --set modulo=1.
advice-fanuc_comments = The head has comments in parentheses; that the control skips them in a parameter file is not certain [M]: --set comments=0 leaves them out.

## HEIDENHAIN

advice-heidenhain_unit = Values are in mm, of a rotary axis in deg, with four decimals (0.1 µm or 0.36 arcsec)
advice-heidenhain_no_zero = The values were not set to zero at a reference point.
advice-heidenhain_zero = The mean of both directions is zero at { $position } { $unit }, to be the reference point of the machine.
advice-heidenhain_activation = Store it on the control as { $name }; it acts only when a .CMA table names it in the column of this axis and that line is the active one [V, manual]: the file activates nothing by itself.
advice-heidenhain_no_comment = No comment is written into the file: that the control skips one is not known; keep this summary with it.
advice-heidenhain_degrees = Values of a rotary axis are in degrees [M]: confirm it on the machine.
advice-itnc530_sign = A value is plus the mean deviation: positive where the axis travels too far, and the control then moves it back [S]
advice-itnc530_distance = the distance must be 0.0001 mm times a power of two, such as 6.5536 mm
advice-itnc530_older_models = older models read distances of 0.0001 mm times a power of two only [V, TNC 407]
advice-itnc530_one_value = One value stands for both directions; reversal is machine parameter MP 710 [M], set by hand, its sign to be proven by a measurement.
advice-itnc530_reversal = The mean reversal, forward minus backward, is { SIGNED($reversal, decimals: 2) } { $unit }: it is not in the file.
advice-tnc640_sign = A value is plus the deviation: positive where the axis travels too far, and the control then moves it back [S]; BACKLASH holds the values measured in negative direction [V]
advice-tnc640_distances = every row states its position, so that distances may differ [M]; the manual's example has equal ones: give --points to be on the safe side
advice-tnc640_two_columns = Column { $axis } is for the positive direction, BACKLASH for the negative one.
advice-tnc640_one_column = Both directions have the same values: the column BACKLASH is empty.

## LinuxCNC

advice-linuxcnc_sign = A table of type 0 holds actual positions, nominal plus deviation; one of type 1 holds what is added to the motor command, minus the deviation [V, code of LinuxCNC]
advice-linuxcnc_unit = Values and positions are in machine units, mm (0.000001) or inch (0.00000001), of a rotary axis always deg (0.0000001)
advice-linuxcnc_backlash = BACKLASH of the joint is ignored as soon as COMP_FILE is given
advice-linuxcnc_positions = Columns 2 and 3 hold actual positions, nominal plus deviation: a positive deviation makes LinuxCNC command less [V].
advice-linuxcnc_trims = Columns 2 and 3 hold trims, minus the deviation: what LinuxCNC adds to the motor command [V].
advice-linuxcnc_rounding = All numbers are in { $name }, rounded to { $digit } { $name } ({ $step } { $unit }).
advice-linuxcnc_no_comment = The file can hold no comment: it names neither its sign, nor its run, nor its type.
advice-linuxcnc_activation = It acts with COMP_FILE and COMP_FILE_TYPE = { $type } in the [JOINT_n] section, from the next start of LinuxCNC on; BACKLASH there is then ignored [V]: what it was during the run must be in the table (--backlash-in-force).
advice-linuxcnc_reserve = Give the joint some reserve of speed and acceleration: the correction may add half of both [V].

## SINUMERIK

advice-sinumerik_sign = A value is plus the mean deviation: a positive value makes the axis move in negative direction [V, manual K3]
advice-sinumerik_unit = Values are in mm (0.000001), of a rotary axis in deg (0.0000001); positions likewise
advice-sinumerik_points = MD38000 MM_ENC_COMP_MAX_POINTS must be at least the number of points
advice-sinumerik_memory = MD38000 MM_ENC_COMP_MAX_POINTS of the axis must be at least { $points } (changing it reorganises the memory: back it up first [M]).
advice-sinumerik_activation = The file does not activate its table: reference the axis, set MD32700 ENC_COMP_ENABLE[{ $encoder },{ $axis }] = 1, NEWCONF; write tables only while it is 0 [V].
advice-sinumerik_access = Writing machine data needs the access level of the service [M]; the numbers are meant for a metric basic system.
advice-sinumerik_backlash = MD32450 BACKLASH is minus the mean reversal value, { FIXED($backlash, decimals: 3) } { $unit }: positive where the table lags behind the encoder [V, manual of the 808D]; check it by a second measurement. It acts on the referenced axis from the next NEWCONF on, whether the table is on or not. It replaces what MD32450 held: that must be in it (--backlash-in-force, --merge).
advice-sinumerik_no_backlash = MD32450 BACKLASH is not written: what it holds stays in force beside this table.
advice-sinumerik_ini = The ini form does not switch MD32700 off: do it before loading.
advice-sinumerik_turn = First and last point are the same place; their values differ by { FIXED($jump, decimals: 3) } { $unit }, a step of the compensation there.
