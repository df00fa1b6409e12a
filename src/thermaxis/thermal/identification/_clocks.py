"""Find how far the clock of the displacements is from that of the temperatures, and what drifts.

Gains over a grid of time constants answer any lag, but not a shift of time, nor a steady rise of
one sensor: the record's evidence, sizes and gains averaged out, is highest where the two clocks are
one and nothing drifts. The noise has no line and no walk here: they would pass for what a shift or
a drift is known by. Inputs are shifted, and the blocks of the displacement stay. What a shift is
due to cannot be told: sensors away from the heat answer after the tool point, and coolant brings
heat late.
"""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.linalg import qr  # pyright: ignore[reportUnknownVariableType] - no types

from thermaxis.codes import Message, remark
from thermaxis.errors import DataError
from thermaxis.thermal._arrays import FloatArray, significant
from thermaxis.thermal.identification._records import has_output, records_of
from thermaxis.thermal.log import (
    Experiment,
    InputDefinition,
    ThermalLog,
    evaluate_input,
    shift_displacements,
    start_of_input,
)
from thermaxis.thermal.modal import ModalOptions, response_evidence, segments_of

LEAST_EVIDENCE = 10.0
"""Gain of the logarithm of the evidence from which a shift is believed. [1]"""
LEAST_SHIFT_S = 400.0
"""A smaller shift is told, and left. Default: with one clock a real machining centre, whose sensors
are away from the heat, shows 240 s. [s]"""
TOLD_EVIDENCE, TOLD_SHIFT_S = 3.0, 60.0
"""The same gain, and the shift, beyond which one is told. [1, s]"""
DRIFT_EVIDENCE = 9.0
"""The same gain, by a steady rise in a channel, from which a drift is told. [1]"""
DRIFT_WITHIN = 4.0
"""Standard deviations within which a drift is told. Default: two held 15 of 20 drifts of five
machines, as their slow noise has no walk here, and four all. [1]"""
LARGEST_SHIFT_S = 7200.0
"""Largest shift that is looked for. [s]"""
_RISES_K = np.linspace(-6.0, 6.0, 25)
LEAST_RISE_K, LEAST_RISE = 2.0, 0.1
"""Smaller rises of a sensor [K], or of the displacement over its range [1], are not looked for."""
_RISES_OF_OUTPUT = np.linspace(-2.0, 2.0, 161)
"""Drifts of the displacement that are tried beside, as shares of its range. [1]"""
_COLD = 0.1
"""Inputs that begin below this share of their range tell a cold start. [1]"""
_LONGEST_S = 30.0 * 86400.0
_STEP_S = 90.0
_FAST_S = 600.0
_REACH_S = 300.0
_SHORTEST_S = 7200.0
_FEWEST_ROWS = 100
_MOST_INPUTS = 4
_MOST_STEP_S = 120.0


def with_one_clock(
    log: ThermalLog,
    inputs: Sequence[InputDefinition],
    outputs: Sequence[str],
    *,
    reference_s: float | None = None,
    told_only: bool = False,
) -> ThermalLog:
    """Return a log whose displacements are stamped by the clock of its temperatures.

    Parameters
    ----------
    outputs : sequence of str
        Channels of the displacements; the first that the log has is looked at.
    reference_s : float, optional
        As of `records_of`. [s]
    told_only : bool
        Whether the remark alone is made: what judges a model is not changed.

    Returns
    -------
    ThermalLog
        The log itself where its clocks are one, or where it is too short to tell (two hours, a
        hundred rows). With displacements off by 400 s or more they are shifted; less is told and
        left, as the machine may answer so. A remark says a shift, or else that the displacement
        or a channel drifts: a rise of 2 K and more in it makes the record much more likely.
    """
    names = [name for name in outputs if has_output(log, name)]
    if not names or log.duration_s < _SHORTEST_S:
        return log
    step_s = min(max(log.usual_step_s, log.duration_s / 5000.0), _MOST_STEP_S)
    try:
        records = records_of(
            [log], inputs, [names[0]], sample_time_s=step_s, reference_s=reference_s
        )
        (record,) = records.experiments[names[0]]
        kept = _independent(record.u)
        if np.count_nonzero(~np.isnan(record.y)) < _FEWEST_ROWS or not kept:
            return log
        record, chosen = replace(record, u=record.u[:, kept]), [inputs[k] for k in kept]
        shift_s, within_s = _shift(log, record, chosen)
        told = None if shift_s else _drift(log, record, chosen, names[0])
    except DataError:  # too little was measured: estimators and verification say what
        return log
    if abs(shift_s) >= LEAST_SHIFT_S and not told_only:
        return shift_displacements(log, outputs, shift_s)
    if shift_s:
        code = "displacements_seem_late" if shift_s > 0.0 else "displacements_seem_early"
        told = remark(code, names=names[0], shift_s=abs(shift_s), within_s=within_s)
    return log if told is None else replace(log, remarks=(*log.remarks, told))


def _shift(
    log: ThermalLog, record: Experiment, inputs: Sequence[InputDefinition]
) -> tuple[float, float]:
    """Return how late the displacements seem, zero where that is not shown, and within. [s]"""
    record = _without_gaps(record)
    if record.duration_s < _SHORTEST_S:
        return 0.0, 0.0
    rows, within, gained = _Search(record).found()
    shift_s = round(round(rows * record.sample_time_s / log.usual_step_s) * log.usual_step_s, 3)
    large = abs(shift_s) >= LEAST_SHIFT_S
    least_s = max(TOLD_SHIFT_S, min(_display_s(log, one) for one in inputs))
    within_s = significant(2.0 * within * record.sample_time_s, 2)
    evidence = LEAST_EVIDENCE if large else TOLD_EVIDENCE
    if abs(shift_s) <= max(least_s, within_s) or gained < evidence:
        return 0.0, 0.0
    return shift_s, within_s


def _without_gaps(record: Experiment) -> Experiment:
    """Return the stretch of most displacements without a long gap in the inputs, a month at most.

    Every stretch has a start of its own, and a short one may be shifted out of its displacements.
    """
    every = segments_of([record], record.sample_time_s, (0.0,) * record.u.shape[1])
    longest = max(every, key=lambda segment: float(np.sum(segment.count)))
    first = round(longest.start_s / record.sample_time_s)
    rows = slice(first, first + min(longest.blocks, int(_LONGEST_S / record.sample_time_s)))
    return replace(record, u=record.u[rows], y=record.y[rows], ambient_k=None)


def _display_s(log: ThermalLog, definition: InputDefinition) -> float:
    """Return how long a display stays at a step while its input changes fast: so late it may be."""
    values = log.plain_column(definition.plus)
    steps = np.diff(np.unique(np.round(values[~np.isnan(values)], 6)))
    rows = max(round(_FAST_S / log.usual_step_s), 1)
    u = evaluate_input(log, definition)
    fast = float(np.nanquantile(np.abs(u[rows:] - u[:-rows]), 0.95))
    return _FAST_S * float(np.median(steps)) / fast if steps.size and fast > 0.0 else np.inf


def _drift(
    log: ThermalLog, record: Experiment, inputs: Sequence[InputDefinition], name: str
) -> Message | None:
    """Return a remark on what drifts steadily, the displacement or a channel, the likelier first.

    Sizes are found for the record as it is, and with the likeliest drift of a channel and of the
    displacement; every drift has those that suit it best, none too.
    """
    channels = list(dict.fromkeys(c for d in inputs for c in d.channels))
    sign = [[float(d.plus == c) - float(d.minus == c) for d in inputs] for c in channels]
    rises = np.kron(np.array(sign), -_RISES_K[:, None])
    range_um = float(np.ptp(record.y[~np.isnan(record.y)]))
    behind = len(rises)
    added = np.zeros((behind + _RISES_OF_OUTPUT.size, len(inputs) + 1))
    added[:behind, :-1] = rises
    added[behind:, -1] = -range_um * _RISES_OF_OUTPUT
    options = ModalOptions(steady_start=_began_cold(log, inputs))
    ramp = np.linspace(0.0, 1.0, record.y.size)
    first = response_evidence([record], options, lasting_drift=False)
    blocks, found = first.design.readings, first.with_ramps(record, added)
    large = np.append(
        np.tile(np.abs(_RISES_K) >= LEAST_RISE_K, len(channels)),
        np.abs(_RISES_OF_OUTPUT) >= LEAST_RISE,
    )
    seen = np.where(large, found, -np.inf)
    for likely in (np.argmax(seen[:behind]), behind + np.argmax(seen[behind:])):
        u, y = record.u + np.outer(ramp, added[likely, :-1]), record.y + ramp * added[likely, -1]
        sizes = response_evidence([replace(record, u=u, y=y)], options, lasting_drift=False)
        found = np.maximum(found, sizes.with_ramps(record, added))
    gained = blocks * (found - found[behind + _RISES_OF_OUTPUT.size // 2])
    share, share_std, own = _peak(_RISES_OF_OUTPUT, gained[behind:], LEAST_RISE)
    peaks = [_peak(_RISES_K, g, LEAST_RISE_K) for g in np.split(gained[:behind], len(channels))]
    if max(gain for _, _, gain in peaks) < DRIFT_EVIDENCE:
        return None
    best = max(own, *(gain for _, _, gain in peaks))
    order = sorted(zip(channels, peaks, strict=True), key=lambda one: -one[1][-1])
    near = [f"{c} ({rise:+.2g} K)" for c, (rise, _, g) in order if g > best - DRIFT_EVIDENCE]
    per_h = range_um / (log.duration_s / 3600.0)
    within = significant(DRIFT_WITHIN * share_std * per_h, 2)
    return remark(
        "displacement_drifts" if own == best else "channel_drifts",
        output=name,
        sensors=", ".join(near) or "none",
        um_per_h=round(share * per_h, 1 - math.floor(math.log10(within))),
        within_um_per_h=within,
    )


def _peak(rises: FloatArray, gained: FloatArray, least: float) -> tuple[float, float, float]:
    """Return the likeliest rise that is large enough, by a parabola, its std, and what it gains."""
    at = int(np.argmax(np.where(np.abs(rises) >= least, gained, -np.inf)))
    middle = min(max(at, 1), gained.size - 2)
    before, here, behind = gained[middle - 1 : middle + 2].tolist()
    bend, step = max(2.0 * here - before - behind, 1e-6), float(rises[1] - rises[0])
    moved = float(np.clip(0.5 * (behind - before) / bend, -0.5, 0.5)) if at == middle else 0.0
    return float(rises[at]) + step * moved, step / math.sqrt(bend), float(gained[at])


def _began_cold(log: ThermalLog, inputs: Sequence[InputDefinition]) -> bool:
    for definition in inputs:
        values = evaluate_input(log, definition)
        start_k, known = start_of_input(log, definition), values[~np.isnan(values)]
        if definition.minus is None or abs(start_k) > _COLD * float(np.ptp(known)):
            return False
    return True


def _independent(u: FloatArray) -> list[int]:
    """Return which few inputs say most of all, in rows in which each is measured or held."""
    moving = np.flatnonzero(np.nanstd(u, axis=0) > 0.0)
    if moving.size <= _MOST_INPUTS:
        return [int(k) for k in moving]
    centred = np.nan_to_num(u[:, moving] - np.nanmean(u[:, moving], axis=0))
    order = np.asarray(qr(centred, mode="economic", pivoting=True)[-1], dtype=np.intp)
    return [int(k) for k in np.sort(moving[order[:_MOST_INPUTS]])]


class _Search:
    """Evidence of a record whose displacement is so many rows late, by the number."""

    def __init__(self, record: Experiment) -> None:
        self._record = record
        self._use_sizes_at(0)

    def _use_sizes_at(self, rows: int) -> None:
        """Find the sizes of gains and noise anew: elsewhere they cost much and change little."""
        self._sizes = response_evidence([self._shifted(rows, rows)], lasting_drift=False)
        self._known: dict[tuple[int, int], float] = {}

    def _shifted(self, rows: int, earliest: int) -> Experiment:
        """Return the record with its inputs so many rows later.

        The displacements stay, but for those at the end whose inputs came later than the log.
        """
        front, count = max(-earliest, 0), self._record.y.size
        y = np.concatenate((np.full(front, np.nan), self._record.y))
        y[count:] = np.nan
        inputs = np.clip(np.arange(count + front) - front - rows, 0, count - 1)
        return replace(self._record, u=self._record.u[inputs], y=y, ambient_k=None)

    def _at(self, rows: int, earliest: int) -> float:
        """Return the logarithm of the evidence per block. [1]"""
        at = rows, max(-earliest, 0)
        if at not in self._known:
            self._known[at] = self._sizes.log_evidence([self._shifted(rows, earliest)])
        return self._known[at]

    def found(self) -> tuple[int, float, float]:
        """Return rows, their standard deviation, and the evidence they gain.

        The best of steps that double is refined by steps that halve, with sizes found anew and over
        the same rows of the displacement.
        """
        step_s, count = self._record.sample_time_s, self._record.y.size
        step = max(round(_STEP_S / step_s), 1)
        farthest = int(min(LARGEST_SHIFT_S / step_s, count / 4))
        doubled = [step << k for k in range(farthest.bit_length()) if step << k <= farthest]
        best = max((0, *doubled, *(-r for r in doubled)), key=lambda r: self._at(r, r))
        if best:
            self._use_sizes_at(best)
        reach = max(abs(best) // 2, round(_REACH_S / step_s), 1)
        earliest, share = min(best - reach, 0), max(reach // 2, 1)
        while share:
            near = (best, best - share, best + share)
            best = max((r for r in near if r >= earliest), key=lambda r: self._at(r, earliest))
            share //= 2
        blocks = self._sizes.design.readings
        gained = blocks * (self._at(best, earliest) - self._at(0, earliest))
        apart = max(step // 2, 1)
        sides = [self._at(max(best + k, earliest), earliest) for k in (apart, -apart)]
        bend = blocks * (2.0 * self._at(best, earliest) - sum(sides)) / apart**2
        return best, float(np.sqrt(1.0 / max(bend, 1e-6))), gained
