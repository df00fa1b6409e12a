"""What a model would have left of a thermal test."""

from dataclasses import replace

from thermaxis.codes import Message, Place
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
    """Return a log whose displacements are those that a model leaves in free run.

    Parameters
    ----------
    log : ThermalLog
        The log of the test, measured without compensation.
    kind : ThermalTestKind
        Which test it is.
    setup : ThermalTestSetup
        Its set-up. An output of the model belongs to the channel of its name. A correction moves
        the axis as a whole: what the model says of X1 is taken off X2 as well, and tilts stay.
    model : CompensationModel
        The model.
    reference_s : float, optional
        The first time, as of `simulate_log`. [s]

    Returns
    -------
    ThermalLog
        The log less the free run, in µm; channels without an output are as they were.
    tuple of Message
        How many rows had no input.

    Raises
    ------
    ConfigurationError
        If no output of the model is a channel of the test.
    DataError
        If the log lacks a channel of the model or of the set-up.
    """
    probes = setup.probes
    groups = [(probes.x1, probes.x2), (probes.y1, probes.y2), (probes.z,)]
    if kind is ThermalTestKind.LINEAR and setup.targets is not None:
        groups = [(channel,) for channel in (*setup.targets.first, *setup.targets.second)]
    groups = [tuple(log.name_of(channel) for channel in group if channel) for group in groups]
    outputs = {output.name.casefold(): output.name for output in model.outputs}
    known = [[c for c in group if c.casefold() in outputs] for group in groups]
    if not any(known):
        channels = ", ".join(channel for group in groups for channel in group)
        names = ", ".join(outputs.values())
        place = Place(key="--model")
        raise ConfigurationError("model_not_of_test", names=names, channels=channels, place=place)
    free_run = simulate_log(model, log, reference_s=reference_s)
    columns, units = dict(log.columns), dict(log.units)
    for group, own in zip(groups, known, strict=True):
        for channel in group if own else ():
            said_um = free_run.outputs[outputs[own[0].casefold()]].displacement_um
            columns[channel] = log.column(channel, unit="um") - said_um
            units[channel] = "um"
    warnings: tuple[Message, ...] = ()
    if free_run.bad_share > 0.0:
        values = {"percent": significant(100.0 * free_run.bad_share, 2)}
        warnings = (Message("warning-thermal_test_model_failed", values),)
    return replace(log, columns=columns, units=units), warnings
