"""What touches of a probe are worth along a log: the same `cycle`, touched now and then."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from datetime import timedelta
from itertools import groupby
from typing import NamedTuple, final

import numpy as np
from numpy.typing import NDArray

from thermaxis.codes import Message, Value
from thermaxis.compensation import (
    FASTEST_LIMIT_UM_PER_S,
    LARGEST_LIMIT_UM,
    CompensationModel,
    CycleOutput,
    CycleState,
    Limits,
    Touch,
    TouchOutcome,
    TouchRules,
)
from thermaxis.thermal._arrays import FloatArray, significant
from thermaxis.thermal.log import ThermalLog
from thermaxis.thermal.verification._limited_run import compensation_along, cycles_along

_WIDE = Limits(LARGEST_LIMIT_UM, FASTEST_LIMIT_UM_PER_S)
_RULES = TouchRules(limits=_WIDE, acts=True)
_WANT_MORE = {TouchOutcome.EXCLUDED, TouchOutcome.CONFIRMED}
_EXCLUDED = {TouchOutcome.EXCLUDED, TouchOutcome.TOO_MANY_EXCLUDED}
_EVERYWHERE_K = 1e6
_DRIFTS_UM, _DISCREPANCIES_UM = np.meshgrid(
    np.geomspace(0.05, 50.0, 61), [0.0, *np.geomspace(0.1, 20.0, 31)], indexing="ij"
)
"""Drifts and discrepancies among which the likeliest are looked for. [µm/√h, µm]"""
_ROUNDING = 1e-9
_FAR = 0.01
_FEWEST = 8
"""Fewer touches say nothing of a drift. [1]"""
LEAST_FAR_UM = 5.0
"""Less is no chip. [µm]"""
MOST_FAR_SHARE = 0.125
"""Where more of the touches than this share are far, the model or its inputs do not explain them:
they do not tell how often to touch, and none is left out of what a model is learnt from. [1]"""


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class TouchPlan:
    """When a log is touched, and how touches are believed."""

    every_s: float | None = None
    """The measured displacement is touched so often, at once again where another touch is wanted;
    None where it is touched by need, or columns hold the touches. [s]"""
    within_um: float | None = None
    """It is touched, likewise, when the standard uncertainty of the tool point has grown beyond
    that. [µm]"""
    first_s: float = 0.0
    """Time after the first row that counts in the figures from which on the intervals count, before
    and after; the first row of the log is touched, too. [s]"""
    channels: Mapping[str, str] = field(default_factory=dict[str, str])
    """Column of touches by output: displacements, with the zero of the measured one."""
    rules: TouchRules = _RULES
    """How touches are believed, within the limits of the verification; the noise is added to the
    measured displacement, too."""
    seed: int = 0
    tolerance_um: float = 5.0
    """An error beyond that is counted. [µm]"""

    @property
    def by_itself(self) -> bool:
        """Whether the measured displacement is touched, and no column holds the touches."""
        return self.every_s is not None or self.within_um is not None

    @property
    def wanted_um(self) -> float:
        """Standard uncertainty that is wanted: as stated, or half of the tolerance. [µm]"""
        return 0.5 * self.tolerance_um if self.within_um is None else self.within_um


@final
@dataclass(frozen=True, slots=True)
class TouchError:
    """What one rule leaves of the displacement."""

    mae_um: float
    """Mean absolute error. [µm]"""
    rmse_um: float
    """Root mean square error. [µm]"""
    max_um: float
    """Largest absolute error. [µm]"""
    beyond_share: float
    """Share of the rows beyond the tolerance. [1]"""


@final
@dataclass(frozen=True, slots=True)
class TouchFigures:
    """What touches are worth for one output."""

    nothing: TouchError
    """The machine as it is, with the zero of its first row."""
    probe_and_hold: TouchError
    """Corrected by what the last touch has shown."""
    free_run: TouchError
    """Corrected by the model alone."""
    with_offset: TouchError
    """Corrected by model and offset of the touches."""
    touches: int
    """Touches along the log, but for one in its last row. [1]"""
    excluded: int
    """Of them excluded by the gate, or after it had excluded too many. [1]"""
    untimely: int
    """Of them not used, as what was in force at their time is not known, such as one in the first
    row, where the model starts. [1]"""
    off: TouchOutcome | None
    """Why touches ended the offset that they gave, so that it was off at the end; None: on."""
    within_two_sigma: float | None
    """Share of the innovations in the rows that count within two standard deviations; None where
    there are none. [1]"""
    judged: int
    """Innovations in the rows that count. [1]"""
    likely: TouchRules | None
    """The rules with the drift and the discrepancy that make the touches before the rows that count
    likeliest, or all where there are few; None where there are few at all."""
    wanted_um: float
    """Standard uncertainty of the tool point that is wanted. [µm]"""
    told_s: float
    """From the first touch to the last: of a longer time they tell nothing. [s]"""
    rules: TouchRules
    """The rules by which they were believed."""
    far: tuple[tuple[float, float], ...]
    """Since when, in the first of those that were excluded one after the other, and by how much
    they are off: the longest such runs first. [s, µm]"""
    moved: tuple[tuple[float, float], ...] = ()
    """Since when touches of a column show another datum, and by how much. [s, µm]"""

    @property
    def interval_s(self) -> float | None:
        """How often to touch for what is wanted, by the likeliest rules and as far as is told.

        None where that is not known, or many touches were excluded; as `touch_interval_s`. [s]
        """
        if self.likely is None or self.tell_little:
            return None
        interval_s = touch_interval_s(self.likely, self.wanted_um)
        return interval_s if math.isinf(interval_s) else min(interval_s, self.told_s)

    @property
    def tell_little(self) -> bool:
        """Whether they tell no drift: many were excluded, or a datum was set anew among them."""
        return self.many_excluded or bool(self.moved)

    @property
    def many_excluded(self) -> bool:
        """Whether so many touches were excluded that the rest tells little, or the offset off."""
        return self.off is not None or self.excluded > MOST_FAR_SHARE * self.touches


class _Seen(NamedTuple):
    """A touch: when, the offset that it shows, its innovation and what that is expected to be."""

    row: int
    time_s: float
    offset_um: float
    innovation_um: float
    std_um: float


class Displaced(NamedTuple):
    """A displacement along a log, (n,), NaN where there is none, and the rows that count."""

    touched_um: FloatArray
    """What a touch shows where one is taken. [µm]"""
    measured_um: FloatArray
    """What is judged by. [µm]"""
    level_um: float
    """Where both begin: what the model says there. [µm]"""
    counted: NDArray[np.bool_]


def touch_interval_s(rules: TouchRules, within_um: float) -> float:
    """Return how often to touch for a tool point that is known well enough just before a touch.

    Touch by touch the variance settles at the A^2 = within^2 - d^2 to which it grows again after a
    touch has taken away its part: A^2 = A^2 R / (A^2 + R) + q T (equations 3 and 4 of touches).

    Parameters
    ----------
    within_um : float
        Largest standard uncertainty. [µm]

    Returns
    -------
    float
        T; 0 where no touches are enough, as the discrepancy alone is more, and infinite where none
        are needed. [s]
    """
    largest_um2 = within_um**2 - rules.discrepancy_um**2
    if largest_um2 >= rules.start_um**2:
        return math.inf
    noise_um2 = rules.noise_um**2 + rules.discrepancy_um**2
    settled_um2 = max(0.0, largest_um2) ** 2 / (largest_um2 + noise_um2)
    return 3600.0 * settled_um2 / rules.drift_um_per_root_h**2


def far_message(log: ThermalLog, since_s: float, um: float) -> Message:
    """Return by how much a touch is off, and when, some time after the first row."""
    size: dict[str, Value] = {"um": significant(um, 2)}
    if log.start is None:
        return Message("touches-far", {**size, "at_h": significant(since_s / 3600.0, 3)})
    at = f"{log.start + timedelta(seconds=since_s):%F %R}"
    return Message("touches-far_at", {**size, "at": at})


def touched_run(
    plan: TouchPlan,
    model: CompensationModel,
    log: ThermalLog,
    shown: Displaced,
    limits: Limits | None,
    *,
    diameter_mm: float | None,
    reference_s: float | None,
) -> TouchFigures:
    """Run the compensation of one output along a log that is touched.

    A touch is known after its row: each is judged by what was known before its own touch. The
    machine obeys. Without limits there are none, and the model is believed everywhere.
    """
    touched_um, measured_um, level_um, counted = shown
    (output,) = model.outputs
    own = limits or _WIDE
    rules = replace(plan.rules, limits=own)
    options = {} if limits else {"validity_margin_k": _EVERYWHERE_K}
    compensation = compensation_along(
        log, model, {output.name: own}, touches={output.name: rules}, **options
    )
    first, behind = (int(np.flatnonzero(counted)[k]) for k in (0, -1))
    due = _due(plan, log.time_s - log.time_s[first], ~np.isnan(touched_um))
    model_um, correction_um, held_um = (np.zeros(log.rows) for _ in range(3))
    held_um += level_um
    seen: list[_Seen] = []
    outcomes: list[TouchOutcome] = []
    off: TouchOutcome | None = None

    def touching(row: int | None, state: CycleState, said: CycleOutput) -> tuple[Touch, ...]:
        nonlocal off
        outcomes.extend(said.touch_outcomes)
        off = off or state.offsets[0].off
        if row is None:
            return ()
        again = plan.by_itself and not _WANT_MORE.isdisjoint(outcomes[-1:])
        shown_um, std_um = float(touched_um[row]), said.offset_std_um[0] or 0.0
        wanted = again or (plan.within_um is not None and std_um > plan.within_um)
        if math.isnan(shown_um) or not (due[row] or wanted):
            return ()
        held_um[row + 1 :] = shown_um
        belief = state.offsets[0].belief
        z_um = shown_um - said.weight[0] * said.model_um[0]
        r_um = z_um - (belief.offset_um if belief else 0.0)
        sigma_um = math.hypot(std_um, rules.noise_um)
        seen.append(_Seen(row, said.time_s, z_um, r_um, sigma_um))
        value_um = shown_um + said.correction_um[0]
        return (Touch(output.name, value_um, said.time_s, len(seen)),)

    for row, said in cycles_along(
        compensation, log, diameter_mm=diameter_mm, reference_s=reference_s, touching=touching
    ):
        if row is not None:
            model_um[row], correction_um[row] = said.model_um[0], said.correction_um[0]
    left = (
        measured_um - level_um,
        measured_um - held_um,
        measured_um - model_um,
        measured_um + correction_um,
    )
    judged = [abs(t.innovation_um) <= 2.0 * t.std_um for t in seen if first <= t.row <= behind]
    before = [one for one in seen if one.row < first]
    errors = [_error(e[counted], plan.tolerance_um) for e in left]
    return TouchFigures(
        *errors,
        touches=len(outcomes),
        excluded=sum(one in _EXCLUDED for one in outcomes),
        untimely=outcomes.count(TouchOutcome.UNTIMELY),
        off=off,
        within_two_sigma=float(np.mean(judged)) if judged else None,
        judged=len(judged),
        likely=_likeliest(rules, before if len(before) >= _FEWEST else seen),
        wanted_um=plan.wanted_um,
        told_s=seen[-1].time_s - seen[0].time_s if seen else 0.0,
        rules=rules,
        far=_far(outcomes, seen),
    )


def _far(
    outcomes: Sequence[TouchOutcome], seen: Sequence[_Seen]
) -> tuple[tuple[float, float], ...]:
    """Return when touches in a row began to be excluded, and by how much they are off."""
    runs: list[list[_Seen]] = [
        [seen[k] for k, _ in each]
        for far, each in groupby(enumerate(outcomes), key=lambda one: one[1] in _EXCLUDED)
        if far
    ]
    runs.sort(key=len, reverse=True)
    return tuple(
        (run[0].time_s, float(np.median([one.innovation_um for one in run]))) for run in runs
    )


def _due(plan: TouchPlan, time_s: FloatArray, able: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return the rows in which a touch is due: the first able one of every interval, or all."""
    if plan.every_s is None:
        return np.zeros_like(able) if plan.by_itself else able
    rows = np.flatnonzero(able)
    interval = np.floor((time_s[rows] - plan.first_s) / plan.every_s + _ROUNDING)
    due = np.zeros_like(able)
    due[rows[np.unique(interval, return_index=True)[1]]] = True
    return due


def _error(left_um: FloatArray, tolerance_um: float) -> TouchError:
    size = np.abs(left_um)
    return TouchError(
        mae_um=float(np.mean(size)),
        rmse_um=float(np.sqrt(np.mean(size**2))),
        max_um=float(np.max(size)),
        beyond_share=float(np.mean(size > tolerance_um)),
    )


def _likeliest(rules: TouchRules, seen: Sequence[_Seen]) -> TouchRules | None:
    """Return the rules by which the innovations are likeliest, where there are enough touches."""
    if len(seen) < _FEWEST:
        return None
    time_s, offset_um = (np.array([one[k] for one in seen]) for k in (1, 2))
    drift_um, discrepancy_um = likeliest_drift(time_s, offset_um, rules.noise_um)
    return replace(rules, drift_um_per_root_h=drift_um, discrepancy_um=discrepancy_um)


def likeliest_drift(
    time_s: FloatArray, left_um: FloatArray, noise_um: float
) -> tuple[float, float]:
    """Return drift [µm/√h] and discrepancy [µm] by which what a model leaves is likeliest.

    An innovation is N(0, S), or with a hundredth of probability anywhere in the range of them all:
    a chip, another datum. Such a one changes nothing, and the second in a row is the new datum.

    Parameters
    ----------
    time_s, left_um : array
        Times of touches, rising, and what the model leaves of them, (m,) each. [s, µm]
    noise_um : float
        Standard deviation of one touch, to which the discrepancy adds. [µm]
    """
    noise_um2 = noise_um**2 + _DISCREPANCIES_UM**2
    farthest = float(np.log((np.ptp(left_um) + noise_um) / _FAR))
    b_um: FloatArray = np.full_like(noise_um2, left_um[0])
    p_um2 = noise_um2
    cost, apart = np.zeros_like(noise_um2), np.zeros(noise_um2.shape, dtype=np.bool_)
    for passed_s, one_um in zip(np.diff(time_s).tolist(), left_um[1:].tolist(), strict=True):
        p_um2 = p_um2 + _DRIFTS_UM**2 * passed_s / 3600.0
        s_um2, r_um = p_um2 + noise_um2, one_um - b_um
        own = 0.5 * (np.log(2.0 * np.pi * s_um2) + r_um**2 / s_um2)
        cost += np.minimum(own, farthest)
        far = own > farthest
        anew = far & apart
        gain = np.where(anew, 1.0, np.where(far, 0.0, p_um2 / s_um2))
        b_um += gain * r_um
        apart = far & ~anew
        p_um2 = np.where(apart, p_um2, gain * noise_um2)
    best = np.unravel_index(np.argmin(cost), cost.shape)
    return float(_DRIFTS_UM[best]), float(_DISCREPANCIES_UM[best])
