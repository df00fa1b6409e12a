### Errors of an export to a PLC

## What a block holds

error-no_redundant_in_block = A block has no redundant sensors.
    .remedy = Choose the better one before the block, and clear its ok where they differ.
error-no_oldest_touch_in_block = A block knows what stood at the time of a touch for 64 calls, whatever oldest_s says.
    .remedy = Leave oldest_s out, as the export does.
error-one_interlock_in_block = A block has the one interlock { $interlock }.
    .remedy = Combine the conditions before the block.
error-no_sha256 = The hash has not 64 hexadecimal digits.
error-delay_no_whole_cycles = The delay of { $delay_s } s is no whole number of cycles of { $cycle_s } s.
    .remedy = Round it, as the export does.
error-block_name_taken = { $name } is a name that the program needs itself.
    .remedy = Name the block after its axis (--name).
error-block_name_ending = A name may not end in { $endings }.
    .remedy = Name the block after its axis (--name).
error-name_without_letters = The name has no letter and no digit that every control knows.
    .remedy = Name it with the letters a to z.

## Numbers

error-too_large_for_plc = { $value } is too large for { $kind }.
    .remedy = Export with LREAL (--real 64), or choose a unit that suits it.
error-too_small_for_plc = { $value } is too small for { $kind }.
    .remedy = Export with LREAL (--real 64), or choose a unit that suits it.
    .remedy = Export with a longer cycle (--cycle-s), or with LREAL (--real 64).
error-cycle_not_counted = REAL does not count times exactly with a cycle of { $cycle_s } s.
    .remedy = Choose a multiple of 1/{ $parts } s, such as { FIXED($nearest_s, decimals: 7) }, or LREAL (--real 64).
error-time_not_counted = { $seconds } s are more than the { $longest_s } s that REAL counts exactly.
    .remedy = Choose shorter times, a cycle of whole seconds (--cycle-s), or LREAL (--real 64).
error-rate_lost_in_real = The rate is lost in the rounding of REAL: { $step_um } µm in a cycle, of a total of { $total_um } µm.
    .remedy = Allow { $least_um } µm in a cycle or more: a longer cycle (--cycle-s), a higher rate (--rate), a smaller total (--limit), or LREAL (--real 64).
error-diameters_equal_in_real = Two diameters of the gains are one number in REAL.
    .remedy = Export with LREAL (--real 64).
error-no_lreal_in_cpu = CPUs of the S7-300 class, as in SINUMERIK 840D sl, know no LREAL.
    .remedy = Export with --real 32; sections are compensated there, so that little is lost.

## Line through corrections at positions

error-too_few_positions = A line needs corrections at two positions or more.
    .remedy = Give a model and a position for each.
error-positions_too_close = Two positions are closer together than { $closest_mm } mm.
    .remedy = Identify the models further apart.
error-no_line_in_model_only = The model alone lays no line.
    .remedy = Export the whole block, or with another --dialect.
error-one_position_per_output = There is not one position for every output.
error-slope_too_large = The limits allow a slope of { $slope } mm/mm, more than the { $largest } of its velocity that the control adds.
    .remedy = State narrower limits, or take positions that lie further apart.
