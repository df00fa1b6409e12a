"""Find how far the clock of the displacements is from that of the temperatures, without a model.

Gains over a grid of time constants answer any lag, but not a shift of time: the record's evidence,
sizes and gains averaged out, is highest where the two clocks are one. The noise has no line and no
walk here: they would pass for what a shift or a drift is known by. A small shift cannot be told
from the machine: sensors away from the heat answer after the tool point, and coolant brings heat
late.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.linalg import qr  # pyright: ignore[reportUnknownVariableType]

from thermaxis.codes import remark
from thermaxis.errors import DataError
from thermaxis.thermal._arrays import FloatArray
from thermaxis.thermal.identification._records import has_output, records_of
from thermaxis.thermal.log import Experiment, InputDefinition, ThermalLog, shift_displacements
from thermaxis.thermal.modal import response_evidence
from thermaxis.thermal.verification import REFERENCE_S

LEAST_EVIDENCE = 10.0
"""Gain of the logarithm of the evidence from which a shift is believed. [1]"""
LEAST_SHIFT_S = 400.0
"""A smaller shift is left, not told. Default: with one clock a real machining centre, whose sensors
are away from the heat, shows 240 s, and rods that conduct heat 120 s. [s]"""
RAMP_EVIDENCE = 7.0
"""The same gain, by a steady rise beside the inputs, from which a drift is told. [1]"""
LARGEST_SHIFT_S = 7200.0
"""Largest shift that is looked for. [s]"""
_STEP_S = 90.0
_SHORTEST_S = 7200.0
_FEWEST_ROWS = 100
_MOST_INPUTS = 4
_MOST_NAMED = 6
_MOST_STEP_S = 120.0


def with_one_clock(
    log: ThermalLog,
    inputs: Sequence[InputDefinition],
    outputs: Sequence[str],
    *,
    reference_s: float = REFERENCE_S,
    told_only: bool = False,
) -> ThermalLog:
    """Return a log whose displacements are stamped by the clock of its temperatures.

    Parameters
    ----------
    log : ThermalLog
        The log.
    inputs : sequence of InputDefinition
        What heats the machine.
    outputs : sequence of str
        Channels of the displacements; the first that the log has is looked at.
    reference_s : float
        As of `records_of`. [s]
    told_only : bool
        Whether the remark alone is made: what judges a model is not changed.

    Returns
    -------
    ThermalLog
        The log itself where its clocks are one, or where it is too short to tell (two hours, a
        hundred rows). With displacements off by 400 s or more they are shifted; less is left, as
        the machine may answer so. A remark says a shift, or else that a channel drifts: a steady
        rise beside the inputs makes the record much more likely.
    """
    names = [name for name in outputs if has_output(log, name)]
    if not names or log.duration_s < _SHORTEST_S:
        return log
    step_s = min(max(log.usual_step_s, log.duration_s / 5000.0), _MOST_STEP_S)
    try:
        rows, gained = _found(log, inputs, names[0], step_s, reference_s)
    except DataError:  # too little was measured: estimators and verification say what
        return log
    if not rows and gained >= RAMP_EVIDENCE:
        channels = dict.fromkeys([names[0], *(c for d in inputs for c in d.channels)])
        told = remark("channel_drifts", names=", ".join(list(channels)[:_MOST_NAMED]))
        return replace(log, remarks=(*log.remarks, told))
    shift_s = round(round(rows * step_s / log.usual_step_s) * log.usual_step_s, 3)
    if gained < LEAST_EVIDENCE or abs(shift_s) < LEAST_SHIFT_S + 2.0 * step_s:
        return log
    if not told_only:
        return shift_displacements(log, outputs, shift_s)
    code = "displacements_seem_late" if shift_s > 0.0 else "displacements_seem_early"
    told = remark(code, names=names[0], shift_s=abs(shift_s))
    return replace(log, remarks=(*log.remarks, told))


def _found(
    log: ThermalLog,
    inputs: Sequence[InputDefinition],
    output: str,
    step_s: float,
    reference_s: float,
) -> tuple[int, float]:
    records = records_of([log], inputs, [output], sample_time_s=step_s, reference_s=reference_s)
    (experiment,) = records.experiments[output]
    u = _independent(experiment.u)
    if np.count_nonzero(~np.isnan(experiment.y)) < _FEWEST_ROWS or not u.shape[1]:
        return 0, 0.0
    search = _Search(step_s, u, experiment.y)
    rows, gained = search.found()
    return (rows, gained) if rows else (0, search.gained_by_ramp())


def _independent(u: FloatArray) -> FloatArray:
    """Return the few inputs that say most of all, in rows in which each is measured or held."""
    moving = np.nanstd(u, axis=0) > 0.0
    u = u[:, moving]
    if u.shape[1] <= _MOST_INPUTS:
        return u
    centred = np.nan_to_num(u - np.nanmean(u, axis=0))
    order = np.asarray(qr(centred, mode="economic", pivoting=True)[-1], dtype=np.intp)
    return u[:, order[:_MOST_INPUTS]]


class _Search:
    """Evidence of a record whose displacement is so many rows late, by the number."""

    def __init__(self, step_s: float, u: FloatArray, y: FloatArray) -> None:
        self._step_s, self._u, self._y = step_s, u, y
        self._use_sizes_at(0)

    def _use_sizes_at(self, rows: int) -> None:
        """Find the sizes of gains and noise anew: elsewhere they cost much and change little."""
        self._found = response_evidence([self._experiment(rows)], lasting_drift=False)
        self._known = {rows: self._found.log_evidence()}

    def _experiment(self, rows: int) -> Experiment:
        """Return the record with the displacement so many rows earlier."""
        gap = np.full(abs(rows), np.nan)
        late, early = self._y[max(rows, 0) :], self._y[: self._y.size + min(rows, 0)]
        y = np.concatenate((late, gap)) if rows > 0 else np.concatenate((gap, early))
        return Experiment(self._step_s, self._u, y)

    def _at(self, rows: int) -> float:
        """Return the logarithm of the evidence per block. [1]"""
        if rows not in self._known:
            self._known[rows] = self._found.log_evidence([self._experiment(rows)])
        return self._known[rows]

    def _near(self, best: int, step: int) -> int:
        while step:
            best = max((best, best - step, best + step), key=self._at)
            step //= 2
        return best

    def gained_by_ramp(self) -> float:
        """Return the evidence that a steady rise beside the inputs gains. [1]"""
        ramp = np.linspace(0.0, 1.0, self._y.size)[:, None]
        risen = Experiment(self._step_s, np.hstack([self._u, ramp]), self._y)
        own = response_evidence([risen], lasting_drift=False).log_evidence()
        return self._found.design.readings * (own - self._at(0))

    def found(self) -> tuple[int, float]:
        """Return rows, and the evidence they gain.

        The best of steps that double is refined by steps that halve, with sizes found anew where
        evidence is gained.
        """
        step = max(round(_STEP_S / self._step_s), 1)
        farthest = int(min(LARGEST_SHIFT_S / self._step_s, self._y.size / 4))
        doubled = [step << k for k in range(farthest.bit_length()) if step << k <= farthest]
        best = max((0, *doubled, *(-rows for rows in doubled)), key=self._at)
        best = self._near(best, max(abs(best) // 2, step // 2))
        blocks, unshifted = self._found.design.readings, self._at(0)
        if blocks * (self._at(best) - unshifted) < 0.5 * LEAST_EVIDENCE:
            return 0, 0.0
        self._use_sizes_at(best)
        best = self._near(best, 2 * step)
        return best, blocks * (self._at(best) - unshifted)
