"""Expanded uncertainty of the figures of ISO 230-2 by Monte Carlo.

What is uncertain of a figure is what it would be without the noise of its readings. A figure of the
run as it was measured keeps the drift of that run; s stands for its expectation over the noise. A
drift-free figure is of the levels in one thermal state, with the true noise.

B, M, E, R and A are extremes over the targets. An extreme of noisy values is too large on average:
noise adds to every one of them, and the largest is the one to which it added most. So the noise is
not added to the estimates once more. What is drawn instead is where the true levels and standard
deviations may lie, given the estimates:

levels
    The mean of the approaches differs from a straight line, the reversal value from a constant, by
    errors that are independent from target to target and by others that are smooth along the axis,
    in amounts that the run itself tells (restricted likelihood). The
    estimates scatter about them by the noise and by what is not known of the drift; of the run as
    it was measured, by the noise alone.
standard deviations
    Those of the targets scatter about a common one of their approach by an amount that the run
    itself tells; the estimates scatter about them as chi does for their degrees of freedom.

The figures of each draw are where the true figures may lie. The expanded uncertainty U is half the
shortest interval that is symmetric about the figure and holds 95.45 % of them, what a coverage
factor k = 2 means for a normal distribution: it contains the bias of the figure. The bias is what
noise adds on average to the figures of the mean of the draws.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import TYPE_CHECKING, final

import numpy as np

from thermaxis.codes import Message
from thermaxis.errors import ConfigurationError, require_range
from thermaxis.positioning.run import FloatArray, PositioningTest, placed
from thermaxis.positioning.standard import (
    FIGURE_KEYS,
    Iso230_2Figures,
    arrays_by_key,
    figures_of,
    mean_and_s,
)
from thermaxis.positioning.uncertainty._budget import (
    COVERAGE_FACTOR,
    ENVIRONMENT,
    OWN,
    RESOLUTION,
    Terms,
    UncertaintyBudget,
    terms_of,
)
from thermaxis.positioning.uncertainty._rounding import rounding_of
from thermaxis.positioning.uncertainty._true_values import (
    Estimate,
    draw_levels,
    draw_spread,
    draw_std,
    expected_s,
    root_of,
)

if TYPE_CHECKING:
    from thermaxis.positioning.drift import DriftResult

LABEL = "GUM"
"""How the uncertainties were evaluated; they are not those of the annex of ISO 230-2."""
PROBABILITY = 0.954499736
"""What k = 2 encloses of a normal distribution. [1]"""

_FEWEST_SAMPLES, _MOST_SAMPLES = 100, 1_000_000
_NUMBERS_AT_A_TIME = 2_000_000
"""Levels that are drawn at a time, so that memory is bounded. [1]"""
_NEGLIGIBLE = 0.1
"""Share of u up to which what is beyond the straight line is left out. [1]"""


@final
@dataclass(frozen=True, slots=True)
class BudgetRow:
    """What one input quantity contributes to the uncertainty of one figure."""

    figure: str
    quantity: str
    """`noise` (scatter of the readings, with the estimate of the drift where that is taken away),
    `resolution` (their rounding), `extremes` (bias of maxima and minima, not corrected), a term of
    the budget, or `nonlinearity` (what all terms drawn together give beyond the root of the sum of
    squares of the others)."""
    value: float
    """What is known of it: standard deviation of a reading; bias; expanded uncertainty (k = 2) of
    the instrument; half width of an interval. [unit]"""
    unit: str
    distribution: str
    """`t`, `normal`, `rectangular`, or empty for a bias."""
    standard_uncertainty: float
    """Its standard uncertainty. [unit]"""
    sensitivity: float
    """Change of the figure for a unit of it, mean over the draws. [µm or arcsec per unit]"""
    contribution: float
    """Their product: what it contributes to the combined standard uncertainty. [µm or arcsec]"""
    mark: str
    """Origin of the formula of this quantity: `own` or `M` (from memory)."""


@final
@dataclass(frozen=True, slots=True)
class FigureUncertainty:
    """Uncertainties of the figures of one run; figures without a statement are absent."""

    expanded_uncertainty: Mapping[str, float]
    """U: the true figure lies within figure ± U in 95.45 % of cases, although the figure is biased.
    [µm or arcsec]"""
    coverage_factor: Mapping[str, float]
    """k = U / u, with u the combined standard uncertainty, bias included. [1]"""
    bias: Mapping[str, float]
    """Figure minus true figure, the mean over many such runs: how much noise makes the figure too
    large. It is contained in U. [µm or arcsec]"""
    corrected_standard_uncertainty: Mapping[str, float]
    """Standard uncertainty of figure - bias, the corrected figure; its expanded uncertainty is
    twice this. [µm or arcsec]"""
    budget: tuple[BudgetRow, ...]
    """What U consists of, by figure and quantity. The root of the sum of squares of the
    contributions is the combined standard uncertainty."""
    left_out: tuple[Message, ...]
    """What is not in it."""
    stated: tuple[str, ...] = ()
    """Figures whose U was stated by a person in place of the evaluated one."""

    def combined(self, key: str) -> float:
        """Return the combined standard uncertainty u = U / k of a figure. [µm or arcsec]"""
        return self.expanded_uncertainty[key] / self.coverage_factor[key]


@final
@dataclass(frozen=True, slots=True)
class UncertaintyResult:
    """Uncertainties of the measured and of the drift-free figures."""

    measured: FigureUncertainty
    """Of the figures as measured. The true figure is that of the same run without noise: with its
    drift at the times of the readings, and s replaced by its expectation."""
    drift_free: FigureUncertainty | None
    """Of the figures of the run without its drift, in one thermal state and with the true noise;
    None where the drift is not known."""
    drift_effect: Mapping[str, float]
    """Expanded uncertainty of what the drift did to each figure, which is estimated by measured
    minus drift-free, both of all readings; empty where the drift is not known. [µm or arcsec]"""
    drift_effect_coverage_factor: Mapping[str, float]
    """Its k = U / u; a figure that no drift moves has none. [1]"""
    samples: int
    """Number of draws. [1]"""
    seed: int
    """Seed of the draws. [1]"""
    label: str = LABEL
    """Method, as it is printed beside the numbers."""

    def with_stated(self, stated: Mapping[str, float]) -> "UncertaintyResult":
        """Return the result with uncertainties of measured figures that a person states instead.

        Parameters
        ----------
        stated : mapping of str to float
            Expanded uncertainties (k = 2) by key of the figure. [µm or arcsec]

        Returns
        -------
        UncertaintyResult
            What was evaluated of these figures, bias and budget, is no longer in it.
        """
        old, values = self.measured, dict.fromkeys
        measured = replace(
            old,
            expanded_uncertainty=_with(old.expanded_uncertainty, stated),
            coverage_factor=_with(old.coverage_factor, values(stated, COVERAGE_FACTOR)),
            bias=_with(old.bias, values(stated, 0.0)),
            corrected_standard_uncertainty=_with(
                old.corrected_standard_uncertainty,
                {key: u / COVERAGE_FACTOR for key, u in stated.items()},
            ),
            budget=tuple(row for row in old.budget if row.figure not in stated),
            stated=tuple(key for key in FIGURE_KEYS if key in stated),
        )
        return replace(self, measured=measured)


def _with(values: Mapping[str, float], other: Mapping[str, float]) -> Mapping[str, float]:
    both = {**values, **other}
    return MappingProxyType({key: both[key] for key in FIGURE_KEYS if key in both})


# ---- levels and standard deviations of a run ---------------------------------------------------


def _noise_of_levels(
    test: PositioningTest, drift: "DriftResult", variance: FloatArray, count: FloatArray
) -> FloatArray:
    """Return the covariance of the levels whose readings have these variances, (L, L).

    A part of the noise is correlated as exp(-time / noise_time), so that of two means is as the
    mean over all pairs of their readings.
    """
    time = test.order if test.time_s is None else test.time_s
    independent = np.diag((1.0 - drift.noise_share) * variance / count)
    if drift.noise_time is None or time is None:
        return independent
    times: list[FloatArray] = [
        time[i, ~np.isnan(drift.deviation[i, :, a]), a]
        for a in test.approaches
        for i in range(test.target.size)
    ]
    decay = drift.noise_time
    alike = np.zeros((len(times), len(times)))
    for k, one in enumerate(times):
        alike[k] = [np.mean(np.exp(-np.abs(one[:, None] - other) / decay)) for other in times]
    std = np.sqrt(drift.noise_share * variance)
    return independent + np.outer(std, std) * alike


def _beyond(covariance: FloatArray, noise: FloatArray) -> FloatArray:
    """Return what a covariance of levels holds beyond the noise.

    Both know the noise by their own estimate of its variance; as much of it is subtracted as
    leaves no direction negative, so that what is left is as smooth as the drift.
    """
    if not np.all(np.diag(noise) > 0.0):
        return covariance - noise
    root = np.linalg.inv(np.linalg.cholesky(noise))
    least = float(np.linalg.eigvalsh(root @ covariance @ root.T)[0])
    return covariance - max(least, 0.0) * noise


def _estimate(test: PositioningTest, drift: "DriftResult | None", environment: float) -> Estimate:
    """Return what is known of levels and noise; s is NaN where the readings do not tell it.

    The scatter of the readings contains the environment during the run, so that the larger counts.
    It contains the rounding, too, but for what all readings of a level share.
    """

    def flat(values: FloatArray) -> FloatArray:
        return np.concatenate([values[:, a] for a in test.approaches])

    step, still = test.resolution, 0.0 * test.deviation
    if drift is None:
        count = flat(test.readings)
        level, s = (flat(values) for values in mean_and_s(test.deviation))
        if float(np.min(count)) < 2.0 or (test.repeats_exactly and step == 0.0):
            step, s, free, common = 0.0, np.full_like(s, np.nan), np.ones_like(s), np.zeros_like(s)
        else:
            free = count - 1.0
            square, number = (np.split(v, len(test.approaches)) for v in (free * s**2, free))
            common = np.repeat(np.sum(square, axis=1) / np.sum(number, axis=1), test.target.size)
        own = np.diag(common / np.maximum(count, 1.0))
        by_drift = np.zeros_like(own)
    else:
        still = drift.drift
        readings = np.asarray(np.sum(~np.isnan(drift.deviation), axis=1), dtype=np.float64)
        count = flat(readings)
        spare = float(np.sum(count) - count.size)
        level, s, weight = (flat(v) for v in (drift.level, drift.figures.s, drift.weight))
        free = (count - 1.0) * (1.0 - drift.drift_parameters / spare)
        # the variance of a reading of weight one
        common = float(np.nansum(weight * (count - 1.0) * s**2)) / spare
        own = _noise_of_levels(test, drift, common / weight, count)
        by_drift = _beyond(drift.level_covariance, own)
    moved, spread = (flat(values) for values in mean_and_s(still))
    seen = np.diag(own)
    total = np.maximum(seen, environment / np.maximum(count, 1.0))
    noise, alike, variance = seen, np.zeros_like(seen), s**2
    rounding = rounding_of(step, flat(np.swapaxes(still, 1, 2)))
    if rounding is not None:
        parts = np.split(np.arange(s.size), len(test.approaches))
        told = [rounding.told_together(variance[i], free[i], count[i]) for i in parts]
        variance, free = (np.concatenate(both) for both in zip(*told, strict=True))
        alike = rounding.of_mean(variance)
        noise = np.maximum(seen - (rounding.variance - alike) / count, 0.0)
    shares = {"noise": noise, ENVIRONMENT: total - seen, RESOLUTION: seen - noise + alike}
    largest = max(float(np.sum(total + alike)), 1e-300)
    return Estimate(
        position=test.target,
        approaches=test.approaches,
        level=level,
        noise_covariance=own + np.diag(total - seen + alike),
        reading_variance=(noise + total - seen) * count,
        share={key: float(np.sum(part)) / largest for key, part in shares.items()},
        rounding=rounding,
        drift_covariance=by_drift,
        drift=moved,
        spread=np.where(np.isnan(spread), 0.0, spread**2),
        s=np.sqrt(variance),
        free=free,
        readings=count,
    )


# ---- figures ------------------------------------------------------------------------------------


@final
@dataclass(frozen=True, slots=True, eq=False)
class _Draws:
    """Where the true figures may lie, (S,) each."""

    truth: dict[str, FloatArray]
    exact: dict[str, FloatArray]
    """The same, were the instrument and the temperatures without error."""
    by_noise: dict[str, FloatArray]
    """What noise adds to the figures of the most likely levels."""


def _ramp(estimate: Estimate) -> FloatArray:
    """Return the error of every level for an error of one from end to end, (L,)."""
    position = estimate.position - np.mean(estimate.position)
    length = max(float(np.ptp(estimate.position)), 1e-300)
    return np.tile(position / length, len(estimate.approaches))


def _draw_s(
    std: FloatArray, spread: FloatArray, free: FloatArray, rng: np.random.Generator
) -> FloatArray:
    """Return the s of readings with this standard deviation and this variance of the drift."""
    scale = std / np.sqrt(free)
    along = np.sqrt(spread) + scale * rng.standard_normal(std.shape)
    across = 2.0 * rng.standard_gamma(np.maximum(0.5 * (free - 1.0), 0.0), std.shape)
    return np.sqrt(along**2 + scale**2 * across)


def _draw_figures(
    estimate: Estimate, length_error: FloatArray, seeds: list[np.random.SeedSequence]
) -> tuple[_Draws, _Draws, dict[str, FloatArray]]:
    """Return the measured and the drift-free figures, and the effect of drift on each figure."""
    level_rng, std_rng, _, noise_rng = (np.random.default_rng(seed) for seed in seeds)

    def figures(level: FloatArray, std: FloatArray) -> dict[str, FloatArray]:
        places = estimate.approaches
        level = np.broadcast_to(level, std.shape)
        return arrays_by_key(figures_of(placed(level, places), placed(std, places)))

    def less(one: dict[str, FloatArray], other: dict[str, FloatArray]) -> dict[str, FloatArray]:
        return {key: one[key] - other[key] for key in FIGURE_KEYS}

    def drawn(
        level: FloatArray, std: FloatArray, ramp: FloatArray, noise: FloatArray, seen: FloatArray
    ) -> tuple[dict[str, FloatArray], ...]:
        likely = np.mean(level, axis=0)
        by_noise = less(figures(likely + noise, seen), figures(likely, std))
        return figures(level + ramp, std), figures(level, std), by_noise

    at_once = max(_FEWEST_SAMPLES, _NUMBERS_AT_A_TIME // estimate.level.size)
    by_noise, by_estimate = root_of(estimate.noise_covariance), root_of(estimate.drift_covariance)
    readings = estimate.readings
    parts: list[tuple[dict[str, FloatArray], ...]] = []
    for start in range(0, length_error.size, at_once):
        ramp = length_error[start : start + at_once, None] * _ramp(estimate)
        std, rounded = draw_std(estimate, len(ramp), std_rng)
        level, by_drift = draw_levels(estimate, len(ramp), level_rng)
        drifted = level + by_drift + estimate.drift
        spread = draw_spread(estimate, len(ramp), std_rng)
        s, still_s = (expected_s(std, v, readings) for v in (spread, np.zeros_like(spread)))
        half = noise_rng.standard_normal((2, (len(ramp) + 1) // 2, level.shape[1]))
        whole = np.concatenate((half, -half), axis=1)[:, : len(ramp)]  # the mean of noise is zero
        noise, error = whole[0] @ by_noise.T, whole[1] @ by_estimate.T
        free = np.maximum(estimate.free, 1.0)
        seen_s = _draw_s(rounded, spread, free, noise_rng)
        seen_std = _draw_s(rounded, np.zeros_like(std), free, noise_rng)
        of_measured = drawn(drifted, s, ramp, noise, seen_s)
        of_drift_free = drawn(level, std, ramp, noise + error, seen_std)
        effect = less(of_measured[0], figures(level + ramp, still_s))
        parts.append((*of_measured, *of_drift_free, effect))
    found = [
        {key: np.concatenate([part[key] for part in kind]) for key in FIGURE_KEYS}
        for kind in zip(*parts, strict=True)
    ]
    return _Draws(*found[:3]), _Draws(*found[3:6]), found[6]


_Shared = tuple[Estimate, Terms, FloatArray]


def _rms(values: FloatArray) -> float:
    return float(np.sqrt(np.mean(values**2)))


def _half_width(truth: FloatArray, figure: float) -> float:
    """Return half the shortest interval, symmetric about a figure, that holds the coverage."""
    return float(np.quantile(np.abs(truth - figure), PROBABILITY))


def _evaluated(
    figures: Iso230_2Figures,
    draws: _Draws,
    shared: _Shared,
    left_out: tuple[Message, ...],
) -> FigureUncertainty:
    """Return the uncertainties of every figure to which something contributes."""
    expanded: dict[str, float] = {}
    factor: dict[str, float] = {}
    bias: dict[str, float] = {}
    standard: dict[str, float] = {}
    rows: list[BudgetRow] = []
    for key, value in arrays_by_key(figures).items():
        figure, truth = float(value), draws.truth[key]
        if np.isnan(figure) or np.isnan(truth[0]):
            continue
        u = _half_width(truth, figure)
        if u <= 1e-9 * (abs(figure) + 1e-9):  # nothing that is known moves this figure
            continue
        bias[key] = round(float(np.mean(draws.by_noise[key])), 9) + 0.0  # not "-0"
        own = _budget_rows(key, figure - bias[key], bias[key], draws, shared)
        rows += own
        combined = float(np.sqrt(sum(row.contribution**2 for row in own)))
        standard[key] = float(np.sqrt(max(combined**2 - bias[key] ** 2, 0.0)))
        expanded[key] = max(u, combined)  # where bias is nearly all of u, k would be below one
        factor[key] = expanded[key] / combined
    return FigureUncertainty(
        expanded_uncertainty=MappingProxyType(expanded),
        coverage_factor=MappingProxyType(factor),
        bias=MappingProxyType(bias),
        corrected_standard_uncertainty=MappingProxyType(standard),
        budget=tuple(rows),
        left_out=left_out,
    )


def _budget_rows(
    key: str, corrected: float, bias: float, draws: _Draws, shared: _Shared
) -> list[BudgetRow]:
    """Return what contributes to one figure.

    Notes
    -----
    The sensitivity to an error e from end to end is that of the straight line by least squares,
    sum(e d) / sum(e^2), to what it does to the figure of each draw, d. The rest of d makes the
    figure non-linear: GUM 5.1.2, note.
    """
    estimate, terms, length_error = shared
    exact, by_terms = draws.exact[key], draws.truth[key] - draws.exact[key]
    slope = float(by_terms @ length_error) / max(float(length_error @ length_error), 1e-300)
    slope = round(slope, 9)  # a figure in which the terms cancel
    by_noise, share = _rms(exact - corrected), estimate.share
    rows: list[BudgetRow] = []
    if share["noise"] > 0.0:
        own = share["noise"] / (share["noise"] + share[ENVIRONMENT])
        u = float(np.sqrt(own * np.mean(estimate.reading_variance)))
        contribution = by_noise * np.sqrt(share["noise"])
        named = key, "noise", u, terms.unit, "t"
        rows.append(BudgetRow(*named, u, contribution / u, contribution, OWN))
    rows.append(BudgetRow(key, "extremes", bias, terms.unit, "", abs(bias), 1.0, abs(bias), OWN))
    for term in (*terms.systematic, *terms.of_readings):
        u, ratio = term.standard_uncertainty, slope * term.effect
        if term.key in share:
            ratio = by_noise * np.sqrt(share[term.key]) / u if u > 0.0 else 0.0
        named = key, term.key, term.value, term.unit, term.distribution
        rows.append(BudgetRow(*named, u, ratio, abs(ratio) * u, term.mark))
    bent = _rms(draws.truth[key] - slope * length_error - corrected) ** 2 - by_noise**2
    if bent > (_NEGLIGIBLE * _rms(draws.truth[key] - corrected)) ** 2:
        rest = float(np.sqrt(bent))
        rows.append(BudgetRow(key, "nonlinearity", rest, terms.unit, "", rest, 1.0, rest, OWN))
    return rows


def _left_out(
    terms: Terms, estimate: Estimate, drift: "DriftResult | None", *, budget: bool
) -> tuple[Message, ...]:
    found: list[Message] = []
    if np.all(np.isnan(estimate.s)):
        found.append(Message("left_out-one_reading"))
    if not budget:
        found.append(Message("left_out-no_budget"))
    else:
        found += [Message("left_out-not_stated", {"term": key}) for key in terms.not_stated]
        if terms.reading_error > 0.0 and estimate.share[ENVIRONMENT] <= 0.0:
            found.append(Message("left_out-in_scatter"))
    if drift is None:
        found.append(Message("left_out-drift_unknown"))
    elif drift.suspects:
        named = ", ".join(str(i) for i in drift.suspects)
        found.append(Message("left_out-drift_not_described", {"targets": named}))
    return tuple(found)


def evaluate_uncertainty(
    test: PositioningTest,
    drift: "DriftResult | None",
    *,
    budget: UncertaintyBudget | None = None,
    samples: int = 2000,
    seed: int = 1,
) -> UncertaintyResult:
    """Evaluate the expanded uncertainties of the figures of a run.

    Parameters
    ----------
    drift : DriftResult or None
        Its drift and levels; None where they are not known.
    budget : UncertaintyBudget, optional
        Terms of instrument and environment. Default: none; the result says that they are left
        out.
    samples : int
        Number of draws, 100 to 1,000,000. Default: U is then known to about 3 %. [1]
    seed : int
        Seed of the draws; the same seed gives the same result. [1]

    Returns
    -------
    UncertaintyResult
        Of the figures as measured, without the drift, and of their difference. A figure to which
        no known term contributes is absent, as are figures that the run does not have. Where the
        drift is not known, it counts as noise of the readings.

    Raises
    ------
    ConfigurationError
        If the number of samples is out of its range, the seed is negative, or the budget has
        terms that a rotary axis does not have.
    DataError
        If a term needs the expansion coefficient or the material's temperature and neither the
        budget nor the run states it.

    References
    ----------
    JCGM 100:2008 (GUM), clause 6, and JCGM 101:2008 (propagation of distributions); ISO 230-2,
    annex on uncertainty, terms from memory. G. K. Smyth 2004 (moderated variances) and A. Gelman
    2006 (prior of a scatter), from memory.
    """
    require_range("samples", samples, _FEWEST_SAMPLES, _MOST_SAMPLES)
    if seed < 0:
        raise ConfigurationError("negative", value=seed, key="seed")
    terms = terms_of(test, budget or UncertaintyBudget())
    estimate = _estimate(test, drift, terms.reading_error**2)
    seeds = np.random.SeedSequence(seed).spawn(4)
    length_error = terms.length_error * np.random.default_rng(seeds[2]).standard_normal(samples)
    of_measured, of_drift_free, of_effect = _draw_figures(estimate, length_error, seeds)
    shared = estimate, terms, length_error
    left_out = _left_out(terms, estimate, drift, budget=budget is not None)
    as_measured = figures_of(*mean_and_s(test.deviation))
    measured = _evaluated(as_measured, of_measured, shared, left_out)
    if drift is None:
        nothing = MappingProxyType[str, float]({})
        return UncertaintyResult(measured, None, nothing, nothing, samples, seed)
    drift_free = _evaluated(drift.figures, of_drift_free, shared, left_out)
    before, after = (
        arrays_by_key(figures) for figures in (as_measured, drift.figures_of_all or drift.figures)
    )
    effect: dict[str, float] = {}
    factor: dict[str, float] = {}
    for key in drift_free.expanded_uncertainty:
        estimated = float(before[key] - after[key])
        effect[key] = _half_width(of_effect[key], estimated)
        u = _rms(of_effect[key] - estimated)
        if u > 0.0:
            factor[key] = effect[key] / u
    effects = MappingProxyType(effect), MappingProxyType(factor)
    return UncertaintyResult(measured, drift_free, *effects, samples, seed)
