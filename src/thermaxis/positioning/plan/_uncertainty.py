"""What uncertainty a plan will reach once the drift is separated from the levels.

The covariance of the levels needs times and positions only. How freely the drift may curve is
taken from an assumed warming, amplitude · (1 - exp(-t / time constant)), which begins with the
first reading and is half as large again at one end of the axis, half as large at the other.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields, replace
from types import MappingProxyType
from typing import final

import numpy as np

from thermaxis.codes import Place
from thermaxis.errors import ConfigurationError, require_known, require_positive, require_range
from thermaxis.positioning.drift import (
    Readings,
    Sums,
    evaluate_drift,
    fit,
    levels_at,
    parameters_of,
    penalty_of,
    rows_at,
    sums_of,
)
from thermaxis.positioning.plan._plan import MOST_STOPS, TestPlan, evaluate_duration, planned_test
from thermaxis.positioning.run import BACKWARD, FORWARD, FloatArray, PositioningTest, placed
from thermaxis.positioning.standard import FIGURE_KEYS, arrays_by_key, figures_of

MOST_LEVELS = 1000
"""Largest number of levels whose covariance is worked out. [1]"""
MOST_SIMULATED_STOPS, MOST_SIMULATED_LEVELS = 5000, 100
"""Largest plan that is also tried on simulated runs, a matter of a second. [1]"""
SAMPLES, FEWEST_SAMPLES = 1000, 100
"""Random draws for the figures: up to a hundred levels, and where there are many. [1]"""
LONGEST_RUN_S = 86400.0
"""Longest run that the search for a plan allows unless stated: a day. [s]"""
FEWEST_CYCLES = 2
"""Cycles below which drift and levels cannot be told apart. [1]"""
LEVEL_KEY = "level"
"""Key of the largest standard uncertainty of a level, beside the keys of the figures."""

_FEWEST_FREE = 6  # as the drift evaluation asks
_LEAST_DEPARTURE = 0.02  # of the noise; less cannot be seen


@final
@dataclass(frozen=True, slots=True)
class RunAssumptions:
    """What is assumed of an axis that was not measured yet.

    Raises
    ------
    ConfigurationError
        If a number is not finite, the noise or the time constant is not positive, or another
        number is negative.
    """

    noise: float = 0.4
    """Standard deviation of one approach. Default: a good milling machine. [µm or arcsec]"""
    drift: float = 10.0
    """Drift at mid-axis after infinite time. Default: of the paper's order. [µm or arcsec]"""
    time_constant_s: float = 3600.0
    """Time to 63 % of the drift. Default: order of magnitude of a machine's structure. [s]"""
    systematic: float = 3.0
    """Range of the assumed forward levels, one wave over the axis. [µm or arcsec]"""
    reversal: float = 1.0
    """Reversal value of the assumed axis. [µm or arcsec]"""

    def __post_init__(self) -> None:
        for entry in fields(self):
            value: float = getattr(self, entry.name)
            least = 0.0 if entry.name in {"drift", "systematic", "reversal"} else 1e-9
            require_range(entry.name, value, least, 1e9)


@final
@dataclass(frozen=True, slots=True)
class ExpectedFigure:
    """What is expected of a figure of the run without its drift."""

    standard_uncertainty: float
    """Standard deviation of the figure over many runs. [µm or arcsec]"""
    bias: float
    """By how much it will be too large on average, as a maximum over scatter is. [µm or arcsec]"""


@final
@dataclass(frozen=True, slots=True, eq=False)
class ExpectedUncertainty:
    """What a plan will reach, by the drift model and the assumptions."""

    assumptions: RunAssumptions
    """What was assumed of the axis."""
    reference_time_s: float
    """Mean time of the readings, t0, from the first reading. [s]"""
    level_std: FloatArray
    """Standard uncertainties of the levels at t0, (m, 2); NaN in an approach that is not planned.
    [µm or arcsec]"""
    figures: Mapping[str, ExpectedFigure]
    """Figures by their key, those that the plan gives."""
    mean_std: float
    """Standard uncertainty of a level if there were no drift at all. [µm or arcsec]"""
    drift_in_means: float
    """Largest error that the assumed drift would leave in a plain mean, referred to the state of
    t0. [µm or arcsec]"""

    @property
    def largest_level_std(self) -> float:
        """Largest standard uncertainty of a level. [µm or arcsec]"""
        return float(np.nanmax(self.level_std))

    def of(self, key: str) -> float | None:
        """Return a standard uncertainty by `level` or the key of a figure that the plan gives.

        [µm or arcsec]
        """
        if key == LEVEL_KEY:
            return self.largest_level_std
        expected = self.figures.get(key)
        return None if expected is None else expected.standard_uncertainty


def why_nothing_is_expected(plan: TestPlan) -> ConfigurationError | None:
    """Return why the uncertainty of a plan cannot be foretold, not raised; None if it can."""
    levels, place = plan.target.size * len(plan.approaches), Place(key="expected uncertainty")
    if plan.cycles < FEWEST_CYCLES or plan.stops - levels < _FEWEST_FREE:
        return ConfigurationError(
            "drift_and_levels_alike", readings=plan.stops, levels=levels, place=place
        )
    if levels > MOST_LEVELS:
        return ConfigurationError("too_many_levels", levels=levels, most=MOST_LEVELS, place=place)
    return None


@final
@dataclass(frozen=True, slots=True, eq=False)
class _Separation:
    """The drift model at the stops of a plan."""

    test: PositioningTest
    sums: Sums
    penalty: FloatArray
    departure: FloatArray
    level_covariance: FloatArray
    reference_s: float
    """Mean time of the readings. [s]"""


def _warming(assumptions: RunAssumptions, time_s: FloatArray) -> FloatArray:
    """Return the assumed drift at mid-axis."""
    return -assumptions.drift * np.expm1(-time_s / assumptions.time_constant_s)


def _assumed_drift(test: PositioningTest, assumptions: RunAssumptions) -> FloatArray:
    """Return the assumed drift of every stop, (m, n, 2); NaN where nothing is planned."""
    assert test.time_s is not None  # noqa: S101 - a plan has times
    return _warming(assumptions, test.time_s) * _along(test.target)[:, None, None]


def _along(target: FloatArray) -> FloatArray:
    """Return the assumed drift of each target in units of that at mid-axis, 0.5 ... 1.5."""
    return 1.0 + (target - 0.5 * (target[0] + target[-1])) / (target[-1] - target[0])


def _departure(assumptions: RunAssumptions, at: FloatArray, shape: FloatArray) -> FloatArray:
    """Return how far the assumed drift departs from a straight line, in units of the noise."""
    drift = _warming(assumptions, at)
    line, _ = np.linalg.qr(np.stack((np.ones_like(at), at / np.max(at)), axis=1))
    rest = float(np.sqrt(np.mean((drift - line @ (line.T @ drift)) ** 2))) / assumptions.noise
    ends = 0.5 / float(np.max(np.abs(shape[1])))
    return np.maximum(rest * np.array([1.0, ends]), _LEAST_DEPARTURE)


def _separate(plan: TestPlan, assumptions: RunAssumptions) -> _Separation:
    test, m, approaches = planned_test(plan), plan.target.size, np.array(plan.approaches)
    assert test.time_s is not None  # noqa: S101 - a plan has times
    i, j, a = np.nonzero(~np.isnan(test.deviation))
    at = test.time_s[i, j, a]
    of_target = np.stack((np.ones(m), (plan.target - plan.target.mean()) / plan.target.std()))
    shape = np.tile(of_target, approaches.size)
    readings = Readings(
        value=np.zeros(i.size),
        level=i + m * np.searchsorted(approaches, a),
        time=at / np.max(at),
        shape=of_target[:, i],
        weight=np.ones(i.size),
        levels=m * approaches.size,
    )
    intervals = int(np.clip(2 * plan.cycles, 6, 60))
    sums, penalty = sums_of(readings, intervals, 0.0), penalty_of(intervals)
    departure = _departure(assumptions, at, shape)
    fitted = fit(sums, penalty, departure)
    fitted = replace(fitted, variance=assumptions.noise**2)  # the assumed one: nothing was read
    reference = float(np.mean(readings.time))
    _, covariance = levels_at(fitted, rows_at(sums, np.array([reference]))[0], shape)
    reference_s = reference * float(np.max(at))
    return _Separation(test, sums, penalty, departure, covariance, reference_s)


def assumed_levels(plan: TestPlan, assumptions: RunAssumptions) -> FloatArray:
    """Return the levels of the assumed axis: one wave along it, and the reversal value."""
    wave = 0.5 * assumptions.systematic * np.sin(2.0 * np.pi * (_along(plan.target) - 0.5))
    half = 0.5 * assumptions.reversal
    level = np.empty((plan.target.size, 2))
    level[:, FORWARD], level[:, BACKWARD] = wave + half, wave - half
    return level


def _expected_figures(
    plan: TestPlan, separation: _Separation, assumptions: RunAssumptions, samples: int, seed: int
) -> Mapping[str, ExpectedFigure]:
    """Draw levels and standard deviations as many runs of this plan would give them."""
    from scipy.special import gammaincinv  # noqa: PLC0415  it takes longer to import than a whole run

    random = np.random.default_rng(seed)
    levels = plan.target.size * len(plan.approaches)
    root = np.linalg.cholesky(separation.level_covariance)
    normal = random.standard_normal((samples, levels))
    drawn = placed(np.asarray(normal @ root.T, dtype=np.float64), plan.approaches)
    parameters = parameters_of(separation.sums, separation.penalty, separation.departure)
    share = 1.0 - parameters / (plan.stops - levels)
    free = max((plan.cycles - 1.0) * share, 0.5)
    # by the inverse distribution, so that plans that differ little draw numbers that differ little
    rank = random.random((samples, levels))
    variance = np.asarray(gammaincinv(free / 2.0, rank), dtype=np.float64) * (2.0 / free)
    s = np.asarray(assumptions.noise * np.sqrt(variance), dtype=np.float64)
    true = assumed_levels(plan, assumptions)
    noise = placed(np.full(levels, assumptions.noise, dtype=np.float64), plan.approaches)
    truth = arrays_by_key(figures_of(true + 0.0 * noise, noise))
    seen = arrays_by_key(figures_of(true + drawn, placed(s, plan.approaches)))
    return MappingProxyType(
        {
            key: ExpectedFigure(float(np.std(values)), float(np.mean(values) - truth[key]))
            for key, values in seen.items()
            if bool(np.isfinite(truth[key]))
        }
    )


def expected_uncertainty(
    plan: TestPlan,
    assumptions: RunAssumptions | None = None,
    *,
    samples: int | None = None,
    seed: int = 1,
) -> ExpectedUncertainty:
    """Foretell the uncertainty of the drift-free levels and figures that a plan will give.

    Parameters
    ----------
    assumptions : RunAssumptions, optional
        Noise, drift and shape of the axis. Default: those that `RunAssumptions` states.
    samples : int, optional
        Random draws for the figures. Default: 1000, which gives their standard deviation to about
        2 %; fewer where there are more than a hundred levels. [1]
    seed : int
        Seed of the draws. Default: 1. [1]

    Returns
    -------
    ExpectedUncertainty
        Standard uncertainties (k = 1) of noise and drift alone; instrument and environment come
        on top. The levels by the covariance of the drift model at the planned stops, the figures
        by seeded Monte Carlo on the assumed axis.

    Raises
    ------
    ConfigurationError
        If the plan does not allow it: fewer than two cycles, or too many levels.
    """
    reason = why_nothing_is_expected(plan)
    if reason is not None:
        raise reason
    assumptions = RunAssumptions() if assumptions is None else assumptions
    if samples is None:
        levels = plan.target.size * len(plan.approaches)
        samples = max(FEWEST_SAMPLES, min(SAMPLES, 100 * SAMPLES // levels))
    separation = _separate(plan, assumptions)
    drift = _assumed_drift(separation.test, assumptions)
    reference_s = separation.reference_s
    at_reference = _warming(assumptions, np.array(reference_s)) * _along(plan.target)
    planned = list(plan.approaches)
    error = np.mean(drift[..., planned], axis=1) - at_reference[:, None]
    return ExpectedUncertainty(
        assumptions=assumptions,
        reference_time_s=reference_s,
        level_std=placed(np.sqrt(np.diag(separation.level_covariance)), plan.approaches),
        figures=_expected_figures(plan, separation, assumptions, samples, seed),
        mean_std=assumptions.noise / float(np.sqrt(plan.cycles)),
        drift_in_means=float(np.max(np.abs(error))),
    )


# ---- simulated runs -----------------------------------------------------------------------------


@final
@dataclass(frozen=True, slots=True)
class SimulatedUncertainty:
    """What the drift evaluation makes of simulated runs of a plan."""

    runs: int
    """Number of simulated runs. [1]"""
    level_error: float
    """Root mean square error of the levels at t0. [µm or arcsec]"""
    level_std: float
    """Root mean square of the standard uncertainties that the evaluation states for them.
    [µm or arcsec]"""


def simulate_uncertainty(
    plan: TestPlan, assumptions: RunAssumptions | None = None, *, runs: int = 4, seed: int = 1
) -> SimulatedUncertainty | None:
    """Try a plan on simulated runs of the assumed axis, with the whole drift evaluation.

    Parameters
    ----------
    assumptions : RunAssumptions, optional
        Noise, drift and shape of the axis. Default: those that `RunAssumptions` states.
    runs : int
        Number of runs. Default: four, so that it takes less than a second. [1]
    seed : int
        Seed of the noise. Default: 1. [1]

    Returns
    -------
    SimulatedUncertainty or None
        Error and stated uncertainty of the levels; None where nothing can be expected of the
        plan, or it has more than five thousand stops or a hundred levels.
    """
    levels = plan.target.size * len(plan.approaches)
    if plan.stops > MOST_SIMULATED_STOPS or levels > MOST_SIMULATED_LEVELS:
        return None
    if why_nothing_is_expected(plan) is not None:
        return None
    assumptions = RunAssumptions() if assumptions is None else assumptions
    random = np.random.default_rng(seed)
    test = planned_test(plan)
    true = assumed_levels(plan, assumptions)
    noiseless = true[:, None, :] + _assumed_drift(test, assumptions)
    error: list[float] = []
    stated: list[float] = []
    for _ in range(runs):
        noise = assumptions.noise * random.standard_normal(noiseless.shape)
        result = evaluate_drift(replace(test, deviation=noiseless + noise))
        reference_s = np.array(0.0 if result.reference_time_s is None else result.reference_time_s)
        level = true + (_warming(assumptions, reference_s) * _along(plan.target))[:, None]
        error.append(float(np.nanmean((result.level - level) ** 2)))
        stated.append(float(np.nanmean(result.level_std**2)))
    return SimulatedUncertainty(
        runs=runs,
        level_error=float(np.sqrt(np.mean(error))),
        level_std=float(np.sqrt(np.mean(stated))),
    )


# ---- the shortest plan --------------------------------------------------------------------------


@final
@dataclass(frozen=True, slots=True, eq=False)
class ShortestPlan:
    """The smallest number of cycles that reaches an uncertainty, or the limit."""

    plan: TestPlan
    """The plan with the cycles that were found; where none reaches it, the longest one."""
    reached: bool
    """Whether the plan reaches the uncertainty."""
    standard_uncertainty: float
    """What it reaches. [µm or arcsec]"""
    tried: Mapping[int, float]
    """What was worked out on the way: standard uncertainty by number of cycles.
    [µm or arcsec]"""


def _reaches(plan: TestPlan, assumptions: RunAssumptions, key: str) -> float:
    if key == LEVEL_KEY:
        covariance = _separate(plan, assumptions).level_covariance
        return float(np.sqrt(np.max(np.diag(covariance))))
    value = expected_uncertainty(plan, assumptions).of(key)
    if value is None:
        raise ConfigurationError("figure_not_given", figure=key, key="target_figure")
    return value


def _most_cycles(plan: TestPlan, fewest: int, longest_s: float) -> int:
    """Return the largest number of cycles within the time and the number of stops."""
    most = MOST_STOPS // (plan.stops // plan.cycles)

    def fits(cycles: int) -> bool:
        return evaluate_duration(replace(plan, cycles=cycles)).total_s <= longest_s

    if fewest > most or not fits(fewest):
        raise ConfigurationError(
            "cycles_take_longer", cycles=fewest, longest_h=longest_s / 3600.0, key="longest"
        )
    longer = _smallest(fewest, most, lambda cycles: not fits(cycles))
    return longer if fits(longer) else longer - 1


def _smallest(low: int, most: int, holds: Callable[[int], bool]) -> int:
    """Return the first number from `low` from which on a condition holds; `most` if it never does.

    The numbers are doubled until it holds, and the last step is bisected.
    """
    high = low
    while not holds(high) and high < most:
        low, high = high, min(2 * high, most)
    while high - low > 1 and holds(high):
        middle = (low + high) // 2
        low, high = (low, middle) if holds(middle) else (middle, high)
    return high


def shortest_plan(
    plan: TestPlan,
    target_uncertainty: float,
    assumptions: RunAssumptions | None = None,
    *,
    key: str = LEVEL_KEY,
    fewest_cycles: int = FEWEST_CYCLES,
    longest_s: float = LONGEST_RUN_S,
) -> ShortestPlan:
    """Find the smallest number of cycles that reaches a standard uncertainty.

    Parameters
    ----------
    plan : TestPlan
        The plan whose number of cycles is changed, nothing else.
    target_uncertainty : float
        Standard uncertainty (k = 1) to be reached. [µm or arcsec]
    assumptions : RunAssumptions, optional
        Noise, drift and shape of the axis. Default: those that `RunAssumptions` states.
    key : str
        `level` for the largest standard uncertainty of a level, or the key of a figure, without
        its bias. Default: the levels, of which all figures are made.
    fewest_cycles : int
        Smallest number of cycles. Default: two, without which nothing can be separated; the
        standard asks for five. [1]
    longest_s : float
        Longest run. Default: a day. [s]

    Returns
    -------
    ShortestPlan
        The plan, and whether it reaches the uncertainty.

    Raises
    ------
    ConfigurationError
        If the uncertainty is not positive, the plan gives no such figure, or the smallest number
        of cycles takes longer than the longest run or has too many stops or levels.
    """
    require_positive("target_uncertainty", target_uncertainty, 1e9)
    require_known("target_figure", [key], (LEVEL_KEY, *FIGURE_KEYS), "unknown_choice")
    assumptions = RunAssumptions() if assumptions is None else assumptions
    smallest = replace(plan, cycles=max(fewest_cycles, FEWEST_CYCLES))
    while why_nothing_is_expected(smallest) is not None and smallest.cycles < 8:
        smallest = replace(smallest, cycles=smallest.cycles + 1)
    reason = why_nothing_is_expected(smallest)
    if reason is not None:
        raise reason
    most = _most_cycles(plan, smallest.cycles, longest_s)
    tried: dict[int, float] = {}

    def reaches(cycles: int) -> bool:
        if cycles not in tried:
            tried[cycles] = _reaches(replace(plan, cycles=cycles), assumptions, key)
        return tried[cycles] <= target_uncertainty

    found = _smallest(smallest.cycles, most, reaches)
    return ShortestPlan(
        plan=replace(plan, cycles=found),
        reached=reaches(found),
        standard_uncertainty=tried[found],
        tried=MappingProxyType(dict(sorted(tried.items()))),
    )
