"""Which candidate channels cannot be trusted: constant, stuck, exchanged or noisy ones.

A wrong sensor is found before a model is blamed. Only what no temperature does counts: a reading
that stands still while its noise is known, or two readings that exchange their values.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import final

import numpy as np

from thermaxis.codes import Message, Value
from thermaxis.thermal._arrays import FloatArray
from thermaxis.thermal.log import Experiment

SHORTEST_STUCK_S = 900.0
"""A reading that stands still for less may be a calm temperature. [s]"""
STUCK_TIMES = 5.0
"""A stuck reading stands still so many times longer than ever else. [1]"""
LEAST_NOISE_K = 5e-4
"""Noise above which a reading is known to move all the time. [K]"""
LEAST_MOTION_K = 0.1
"""Another channel has moved where its range is larger. [K]"""
LEAST_JUMP_K = 0.3
"""A smaller step between two rows is no evidence of exchanged sensors. [K]"""
JUMP_TIMES = 4.0
"""A jump is so many times larger than the largest steps but one in a hundred. [1]"""
MOST_JUMPS = 6
"""A channel that jumps more often does so by its nature. [1]"""
NOISY_TIMES = 5.0
"""A noisy channel has so many times the median noise of all channels. [1]"""
LONGEST_NOISE_STEP_S = 60.0
"""Rows farther apart do not tell noise from a cooler that switches, and no channel is called
noisy. [s]"""
MOST_MISSING = 0.2
"""Share of rows without a value from which a channel is missing. [1]"""
_CLIPPED = 5.0
"""Second differences beyond so many standard deviations are steps or spikes. [1]"""
_NORMAL_MEDIAN = 1.4826
_ROWS_BESIDE_JUMP = 5


class SensorFault(StrEnum):
    """What is wrong with a channel."""

    CONSTANT = "constant"
    """It never changes."""
    STUCK = "stuck"
    """It stands still for long, though its noise is known to move it."""
    EXCHANGED = "exchanged"
    """It jumps against another channel as if both had been exchanged."""
    MISSING = "missing"
    """It was not measured in a large part of the rows."""
    NOISY = "noisy"
    """It has much more noise than the others; it stays a candidate, at a price."""


@final
@dataclass(frozen=True, slots=True)
class SensorFinding:
    """A candidate channel with a fault."""

    name: str
    """Name of the channel."""
    fault: SensorFault
    """What is wrong."""
    experiment: str
    """Name or number of the experiment."""
    start_s: float
    """Where it begins, from the experiment's first row. [s]"""
    duration_s: float
    """How long it lasts. [s]"""
    message: Message
    """The finding with its numbers."""

    @property
    def left_out(self) -> bool:
        """Whether a channel with this fault is no candidate."""
        return self.fault is not SensorFault.NOISY


def sensor_noise_k(experiments: Sequence[Experiment]) -> FloatArray:
    """Return the white noise of every input, standard deviation, (k,). [K]

    Notes
    -----
    Second differences of white noise have six times its variance, and neighbouring ones a
    covariance of minus four times. What a temperature does between rows makes the first larger
    and the second less negative, so that the smaller of both estimates is taken: a cooler that
    switches every few rows is less of a noise. Steps and spikes are clipped at five standard
    deviations.
    """
    return np.array(
        [_noise_of([e.u[:, i] for e in experiments]) for i in range(experiments[0].inputs)]
    )


def _noise_of(series: Sequence[FloatArray]) -> float:
    seconds = [np.diff(values, 2) for values in series]
    every = np.concatenate(seconds)
    every = np.abs(every[~np.isnan(every)])
    if every.size == 0:
        return 0.0
    scale = _NORMAL_MEDIAN * float(np.median(every))
    limit = _CLIPPED * scale if scale > 0 else float(np.max(every))
    clipped = [np.clip(second, -limit, limit) for second in seconds]
    own = np.concatenate([c**2 for c in clipped])
    neighbours = np.concatenate([c[1:] * c[:-1] for c in clipped])
    if bool(np.all(np.isnan(neighbours))):
        return 0.0
    variance = min(float(np.nanmean(own)) / 6.0, -float(np.nanmean(neighbours)) / 4.0)
    return max(variance, 0.0) ** 0.5


def _still_runs(values: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return first row and length in rows of every run of equal values, longest first."""
    changed = np.flatnonzero(np.diff(values) != 0.0) + 1
    edges = np.concatenate([[0], changed, [values.size]])
    length = np.diff(edges)
    order = np.argsort(-length, kind="stable")
    return edges[:-1][order], length[order]


def _others_move(u: FloatArray, column: int, first: int, last: int) -> bool:
    """Return whether most other channels change in these rows; true where there is no other."""
    others = np.delete(u[first:last], column, axis=1)
    if others.shape[1] == 0:
        return True
    others = others[:, np.any(~np.isnan(others), axis=0)]
    if others.shape[1] == 0:
        return False
    motion = np.nanmax(others, axis=0) - np.nanmin(others, axis=0)
    return float(np.median(motion)) > LEAST_MOTION_K


def _stuck(
    experiment: Experiment, label: str, column: int, name: str, noise_k: float
) -> SensorFinding | None:
    measured = np.flatnonzero(~np.isnan(experiment.u[:, column]))
    values = experiment.u[measured, column]
    begins, lengths = _still_runs(values)
    if lengths.size == 1:
        return None
    first, rows = int(begins[0]), int(lengths[0])
    begin, end = int(measured[first]), int(measured[first + rows - 1]) + 1
    duration_s = (end - begin) * experiment.sample_time_s
    if duration_s < SHORTEST_STUCK_S or rows <= STUCK_TIMES * int(lengths[1]):
        return None
    after = first + rows
    freed_k = abs(float(values[after] - values[after - 1])) if after < values.size else 0.0
    known_to_move = noise_k >= LEAST_NOISE_K or freed_k >= LEAST_JUMP_K
    if not known_to_move or not _others_move(experiment.u, column, begin, end):
        return None
    start_s = begin * experiment.sample_time_s
    values = {
        "start_h": start_s / 3600,
        "duration_h": duration_s / 3600,
        "next_s": int(lengths[1]) * experiment.sample_time_s,
    }
    return _finding(name, SensorFault.STUCK, (label, start_s, duration_s), values)


def _finding(
    name: str, fault: SensorFault, place: tuple[str, float, float], values: Mapping[str, Value]
) -> SensorFinding:
    """Return a finding at a place: experiment, begin and duration."""
    return SensorFinding(
        name, fault, *place, Message(f"candidate-{fault}", {"name": name, **values})
    )


def _jump_limit(step: FloatArray) -> FloatArray:
    """Return the size from which a step of each channel is a jump, (k,). [K]"""
    ordinary = np.nanquantile(np.abs(step), 0.99, axis=0)
    return np.maximum(LEAST_JUMP_K, JUMP_TIMES * ordinary)


def _lasting_step(u: FloatArray, row: int, column: int) -> float:
    """Return the step between the medians of some rows before and after. [K]"""
    before = u[max(0, row - _ROWS_BESIDE_JUMP + 1) : row + 1, column]
    after = u[row + 1 : row + 1 + _ROWS_BESIDE_JUMP, column]
    if np.all(np.isnan(before)) or np.all(np.isnan(after)):
        return 0.0
    return float(np.nanmedian(after) - np.nanmedian(before))


def _exchanged(experiment: Experiment, label: str, names: Sequence[str]) -> list[SensorFinding]:
    step = np.diff(experiment.u, axis=0)
    if step.shape[0] < 2 * _ROWS_BESIDE_JUMP or bool(np.any(np.all(np.isnan(step), axis=0))):
        return []
    limit = _jump_limit(step)
    jumping = np.nan_to_num(np.abs(step)) > limit
    jumping[:, np.count_nonzero(jumping, axis=0) > MOST_JUMPS] = False
    found: dict[int, SensorFinding] = {}
    for row in np.flatnonzero(np.count_nonzero(jumping, axis=1) >= 2).tolist():
        columns = np.flatnonzero(jumping[row]).tolist()
        lasting = {c: _lasting_step(experiment.u, row, c) for c in columns}
        for i in columns:
            for j in columns:
                apart = abs(lasting[i] + lasting[j])
                size = min(abs(lasting[i]), abs(lasting[j]))
                if i == j or i in found or size <= LEAST_JUMP_K or apart > 0.2 * size:
                    continue
                start_s = (row + 1) * experiment.sample_time_s
                values = {"start_h": start_s / 3600, "step_k": lasting[i]}
                values |= {"other": names[j], "other_step_k": lasting[j]}
                place = (label, start_s, experiment.duration_s - start_s)
                found[i] = _finding(names[i], SensorFault.EXCHANGED, place, values)
    return [found[i] for i in sorted(found)]


def _useless(experiments: Sequence[Experiment], column: int, name: str) -> SensorFinding | None:
    """Return that a channel never changes or is mostly missing."""
    values, place = np.concatenate([e.u[:, column] for e in experiments]), _throughout(experiments)
    if not float(np.nanmax(values)) > float(np.nanmin(values)):
        return _finding(name, SensorFault.CONSTANT, place, {})
    absent = int(np.count_nonzero(np.isnan(values)))
    if absent <= MOST_MISSING * values.size:
        return None
    counts = {"missing": absent, "rows": values.size}
    return _finding(name, SensorFault.MISSING, place, counts)


def _throughout(experiments: Sequence[Experiment]) -> tuple[str, float, float]:
    return "all", 0.0, sum(e.duration_s for e in experiments)


def _noisy(
    experiments: Sequence[Experiment], names: Sequence[str], noise_k: FloatArray
) -> list[SensorFinding]:
    if max(e.sample_time_s for e in experiments) > LONGEST_NOISE_STEP_S:
        return []
    usual, place = float(np.median(noise_k)), _throughout(experiments)
    return [
        _finding(name, SensorFault.NOISY, place, {"noise_mk": 1e3 * own, "median_mk": 1e3 * usual})
        for name, own in zip(names, noise_k.tolist(), strict=True)
        if usual > 0 and own > NOISY_TIMES * usual
    ]


def check_candidates(
    experiments: Sequence[Experiment], names: Sequence[str]
) -> tuple[SensorFinding, ...]:
    """Find candidate channels that a model must not learn from.

    Parameters
    ----------
    experiments : sequence of Experiment
        With the candidates as inputs.
    names : sequence of str
        Their names, (k,).

    Returns
    -------
    tuple of SensorFinding
        At most one per channel and fault, in the order of the channels.

    Notes
    -----
    A channel of a coarse count that stands still is found only where it comes back with a jump,
    since calm temperatures stand still as well. Sensors that were exchanged before the record
    begins cannot be seen in it.
    """
    noise_k = sensor_noise_k(experiments)
    findings: list[SensorFinding] = []
    for i, name in enumerate(names):
        useless = _useless(experiments, i, name)
        if useless is not None:
            findings.append(useless)
            continue
        for number, experiment in enumerate(experiments):
            stuck = _stuck(experiment, experiment.name or str(number + 1), i, name, noise_k[i])
            if stuck is not None:
                findings.append(stuck)
                break
    seen: set[str] = set()
    for number, experiment in enumerate(experiments):
        for finding in _exchanged(experiment, experiment.name or str(number + 1), names):
            if finding.name not in seen:
                seen.add(finding.name)
                findings.append(finding)
    findings += _noisy(experiments, names, noise_k)
    order = {name: i for i, name in enumerate(names)}
    return tuple(sorted(findings, key=lambda f: order[f.name]))
