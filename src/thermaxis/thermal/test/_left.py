"""What a model would have left of a thermal test."""

from dataclasses import replace

from thermaxis.codes import Message
from thermaxis.compensation import CompensationModel
from thermaxis.errors import ConfigurationError
from thermaxis.thermal._arrays import significant
from thermaxis.thermal.log import ThermalLog
from thermaxis.thermal.test._setup import ThermalTestKind, ThermalTestSetup
from thermaxis.thermal.verification import simulate_log


def left_by_model(
    log: ThermalLog,
    kind: ThermalTestKind,
    setup: ThermalTestSetup,
    model: CompensationModel,
    *,
    reference_s: float | None = None,
) -> tuple[ThermalLog, tuple[Message, ...]]:
    """Return a log less what a model says in free run, and how many rows had no input.

    An output of the model belongs to the channel of its name. A correction moves the axis as a
    whole: what the model says of X1 is taken off X2 as well, and tilts stay. Channels without an
    output are as they were; the others are in µm. `reference_s` is that of `simulate_log`.

    Raises
    ------
    ConfigurationError
        If no output of the model is a channel of the test.
    DataError
        If the log lacks a channel of the model or of the set-up.
    """
    groups: dict[str, list[str]] = {}
    for name, channel in setup.named(kind):
        axis = name if kind is ThermalTestKind.LINEAR else name[0]
        groups.setdefault(axis, []).append(log.name_of(channel))
    outputs = {output.name.casefold(): output.name for output in model.outputs}
    known = [[c for c in group if c.casefold() in outputs] for group in groups.values()]
    if not any(known):
        channels = ", ".join(channel for group in groups.values() for channel in group)
        names = ", ".join(outputs.values())
        raise ConfigurationError("model_not_of_test", names=names, channels=channels, key="model")
    free_run = simulate_log(model, log, reference_s=reference_s)
    columns, units = dict(log.columns), dict(log.units)
    for group, own in zip(groups.values(), known, strict=True):
        for channel in group if own else ():
            said_um = free_run.outputs[outputs[own[0].casefold()]].displacement_um
            columns[channel] = log.column(channel, unit="um") - said_um
            units[channel] = "um"
    warnings: tuple[Message, ...] = ()
    if free_run.bad_share > 0.0:
        values = {"percent": significant(100.0 * free_run.bad_share, 2)}
        warnings = (Message("warning-thermal_test_model_failed", values),)
    return replace(log, columns=columns, units=units), warnings
