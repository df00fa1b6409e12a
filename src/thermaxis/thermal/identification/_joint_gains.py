"""Estimate parts jointly with their gains by workpiece diameter, from one test at all diameters."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import final

import numpy as np

from thermaxis.codes import Place
from thermaxis.compensation import GainPoint
from thermaxis.errors import ConfigurationError, DataError
from thermaxis.thermal.identification._records import Records
from thermaxis.thermal.log import Experiment
from thermaxis.thermal.modal import ModalOptions, ModalResult, modal
from thermaxis.thermal.transfer_function import (
    DiameterGain,
    ThermalModel,
    held,
    simulate_from_rest,
)

MOST_ROUNDS = 12
"""Rounds of parts and gains in turn; three or four suffice. [1]"""
_SAME = 1e-4


@final
@dataclass(frozen=True, slots=True, eq=False)
class JointGains:
    """Parts that all diameters share, and the gain of one of them."""

    result: ModalResult
    """Parts at the gain 1, from all displacements together."""
    part: str
    """Name of the part that has gains."""
    gain: DiameterGain
    """Its gain by diameter; 1 at the reference."""
    reference: str
    """Channel at which the gain is 1."""
    gain_by_channel: Mapping[str, float]
    """Gain of every channel. [1]"""
    diameters_mm: Mapping[str, float | None]
    """Diameter of every channel; None for the tool centre point. [mm]"""


def joint_gains(
    records: Records,
    part: str,
    diameters_mm: Mapping[str, float | None],
    *,
    options: ModalOptions | None = None,
) -> JointGains:
    """Estimate the parts of displacements at several diameters, and the gain of one part.

    All displacements share the transfer functions; one part acts g times at each diameter. Parts
    and gains are estimated in turn: the parts with `modal` from all displacements, the gained
    input times its gain; then each gain by least squares of what the other parts leave.

    Parameters
    ----------
    records : Records
        Experiments with the displacements of all diameters as outputs.
    part : str
        Name of the input whose part has gains.
    diameters_mm : mapping of str to float or None
        Diameter by channel; None for the tool centre point. The gain is 1 at the tool centre
        point if it is there, else at the smallest diameter. [mm]
    options : ModalOptions, optional
        As of `modal`.

    Returns
    -------
    JointGains
        Parts and gains.

    Raises
    ------
    ConfigurationError
        If there is no such input, a channel is no output of the records, or fewer than two
        channels are named.
    DataError
        If the part does nothing at the reference, so that no gain can be told.

    References
    ----------
    Mareš and Horejš 2021, equations (6) and (8).
    """
    names = [definition.name for definition in records.inputs]
    if part not in names:
        raise ConfigurationError(
            "unknown_name", name=part, known=tuple(names), place=Place(key="joint")
        )
    lacking = [channel for channel in diameters_mm if channel not in records.experiments]
    if lacking:
        known = tuple(records.experiments)
        raise ConfigurationError(
            "unknown_name", name=lacking[0], known=known, place=Place(key="joint")
        )
    if len(diameters_mm) < 2:
        raise ConfigurationError("too_few_joint_channels", place=Place(key="joint"))
    column = names.index(part)
    known = {c: d for c, d in diameters_mm.items() if d is not None}
    tool = [c for c, d in diameters_mm.items() if d is None]
    reference = tool[0] if tool else min(known, key=lambda c: known[c])
    gains = dict.fromkeys(diameters_mm, 1.0)
    result = _parts(records, column, gains, names, options)
    for _ in range(MOST_ROUNDS):
        before = dict(gains)
        gains = {c: _gain(records.experiments[c], result.model, column) for c in diameters_mm}
        if abs(gains[reference]) < 1e-6:
            raise DataError("part_without_effect", part=part, place=Place(channel=reference))
        scale = gains[reference]
        gains = {c: g / scale for c, g in gains.items()}
        result = _parts(records, column, gains, names, options)
        if max(abs(gains[c] - before[c]) for c in gains) < _SAME:
            break
    points = tuple(GainPoint(known[c], gains[c]) for c in sorted(known, key=lambda c: known[c]))
    tool_gain = gains[tool[0]] if tool else 1.0
    return JointGains(
        result, part, DiameterGain(points, tool_gain), reference, gains, dict(diameters_mm)
    )


def _parts(
    records: Records,
    column: int,
    gains: Mapping[str, float],
    names: list[str],
    options: ModalOptions | None,
) -> ModalResult:
    """Return the parts from all displacements, the gained input times its gain."""
    scaled: list[Experiment] = []
    for channel, gain in gains.items():
        for experiment in records.experiments[channel]:
            u = np.array(experiment.u)
            u[:, column] *= gain
            scaled.append(replace(experiment, u=u, name=f"{experiment.name} {channel}".strip()))
    return modal(scaled, input_names=names, options=options)


def _gain(experiments: tuple[Experiment, ...], model: ThermalModel, column: int) -> float:
    """Return by how much the part acts, by least squares with a constant per experiment.

    Notes
    -----
    With the part's displacement x and the others' z, both less their mean over the rows e of an
    experiment that were measured, g = sum over e of x (y - z) / sum over e of x^2.
    """
    product = square = 0.0
    for experiment in experiments:
        u, _ = held(experiment.u)
        step_s, parts = experiment.sample_time_s, model.parts
        part, rest = parts[column], (*parts[:column], *parts[column + 1 :])
        alone = simulate_from_rest(ThermalModel((part,)), step_s, u[:, [column]])
        others = simulate_from_rest(ThermalModel(rest), step_s, np.delete(u, column, axis=1))
        seen = ~np.isnan(experiment.y)
        x, y = alone[seen], (experiment.y - others)[seen]
        x, y = x - np.mean(x), y - np.mean(y)
        product += float(x @ y)
        square += float(x @ x)
    return product / square if square > 0 else 0.0
