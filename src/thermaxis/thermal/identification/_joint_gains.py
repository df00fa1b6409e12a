"""Estimate parts jointly with their gains by workpiece diameter, from one test at all diameters."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import final

import numpy as np

from thermaxis.compensation import GainPoint
from thermaxis.errors import ConfigurationError, DataError, require_known
from thermaxis.thermal._arrays import FloatArray
from thermaxis.thermal.identification._records import Records
from thermaxis.thermal.log import Experiment
from thermaxis.thermal.modal import ModalOptions, ModalResult, modal
from thermaxis.thermal.transfer_function import DiameterGain, held, section_response

MOST_ROUNDS = 50
"""Rounds of gains and coefficients in turn; six to ten suffice. [1]"""
_SAME = 1e-5
_LAGS_S = (300.0, 600.0, 1200.0, 2400.0, 4800.0, 9600.0)
_RIDGE = 1e-5
_TINY = 1e-300


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

    All displacements share the transfer functions; one part acts g times at each diameter. The
    gains are found first, without a choice of lags; then the parts with `modal` from all
    displacements, the gained input times its gain.

    Parameters
    ----------
    part : str
        Name of the input whose part has gains.
    diameters_mm : mapping of str to float or None
        Diameter by channel; None for the tool centre point. The gain is 1 at the tool centre
        point if it is there, else at the smallest diameter. [mm]
    options : ModalOptions, optional
        As of `modal`.

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
    require_known("joint", [part], names)
    require_known("joint", diameters_mm, records.experiments)
    if len(diameters_mm) < 2:
        raise ConfigurationError("too_few_joint_channels", key="joint")
    column = names.index(part)
    known = {c: d for c, d in diameters_mm.items() if d is not None}
    tool = [c for c, d in diameters_mm.items() if d is None]
    reference = tool[0] if tool else min(known, key=lambda c: known[c])
    gains = _gains(records, column, tuple(diameters_mm), part, reference)
    result = modal(_scaled(records, column, gains), input_names=names, options=options)
    points = tuple(GainPoint(known[c], gains[c]) for c in sorted(known, key=lambda c: known[c]))
    tool_gain = gains[tool[0]] if tool else 1.0
    return JointGains(
        result, part, DiameterGain(points, tool_gain), reference, gains, dict(diameters_mm)
    )


def _scaled(records: Records, column: int, gains: Mapping[str, float]) -> list[Experiment]:
    """Return all displacements as experiments, the gained input times its gain."""
    scaled: list[Experiment] = []
    for channel, gain in gains.items():
        for experiment in records.experiments[channel]:
            u = np.array(experiment.u)
            u[:, column] *= gain
            scaled.append(replace(experiment, u=u, name=f"{experiment.name} {channel}".strip()))
    return scaled


def _gains(
    records: Records, column: int, channels: tuple[str, ...], part: str, reference: str
) -> dict[str, float]:
    """Return by how much the part acts at every channel, 1 at the reference.

    Notes
    -----
    With the regressors X of the part and Z of the other inputs (each input and its lags of five
    minutes to nearly three hours), all and y less their means over an experiment, the gains are
    those of the least sum over channels c of

        |y_c - g_c X a - Z b|^2,

    found from products of columns: in turn a and b at given gains, with a ridge so small that it
    only matters where inputs repeat each other, and every g_c at given a and b.
    """
    every = {c: [_products(e, column) for e in records.experiments[c]] for c in channels}
    products: dict[str, FloatArray] = {c: np.sum(p, axis=0) for c, p in every.items()}
    x = slice(0, 1 + len(_LAGS_S))
    z = slice(x.stop, -1)
    gains = dict.fromkeys(channels, 1.0)
    for _ in range(MOST_ROUNDS):
        total = np.zeros_like(products[reference])
        for c, gain in gains.items():
            scale = np.ones(total.shape[0])
            scale[x] = gain
            total += scale[:, None] * products[c] * scale
        total += np.diag(_RIDGE * np.diag(total))
        solved = np.linalg.lstsq(total[:-1, :-1], total[:-1, -1])[0]
        a, b = solved[x], solved[x.stop :]
        found = {
            c: float(a @ (p[x, -1] - p[x, z] @ b)) / max(float(a @ p[x, x] @ a), _TINY)
            for c, p in products.items()
        }
        if abs(found[reference]) < 1e-6:
            raise DataError("part_without_effect", part=part, channel=reference)
        before, gains = gains, {c: g / found[reference] for c, g in found.items()}
        if max(abs(gains[c] - before[c]) for c in gains) < _SAME:
            break
    return gains


def _products(experiment: Experiment, column: int) -> FloatArray:
    """Return the products of all columns of [X Z y] less their means over measured rows."""
    u, step_s = held(experiment.u)[0].T, experiment.sample_time_s
    columns = [
        part
        for values in (u[column], *np.delete(u, column, axis=0))
        for part in (values, *(section_response(values, lag, step_s, 0.0) for lag in _LAGS_S))
    ]
    rows = np.stack([*columns, experiment.y], axis=1)[~np.isnan(experiment.y)]
    rows -= np.mean(rows, axis=0)
    return np.asarray(rows.T @ rows)
