### Errors of the compensation's model, rules and limits

error-no_range = { $lowest } to { $highest } is no range.
error-moves_with_itself = By moves_with, { $name } moves with itself, through others.
    .remedy = Let each sensor move with one that changes more often, and the liveliest with none.
error-witness_may_stand = Nothing can move with { $name }: its frozen_s is 0, so it may stand still.
    .remedy = State another input in moves_with, or a frozen_s.
error-entries_missing = There is no entry for { $names }.
error-no_channel = The part has no name or no channel.
error-channel_minus_itself = A channel is subtracted from itself.
error-half_range = Only one end of the range is stated.
error-output_without_name = An output has no name.
error-reference_missing = The reference temperature of { $names } is missing.
    .remedy = State it, or let the model refer to its start.
