"""Expanded uncertainty of the figures of ISO 230-2 by Monte Carlo, free of the bias of maxima.

B, M, E, R and A are extremes over the targets. An extreme of noisy values is too large on average:
noise adds to every one of them, and the largest is the one to which it added most. So the noise is
not added to the estimates once more. What is drawn instead is where the true levels and standard
deviations may lie, given the estimates:

levels
    The mean of the approaches scatters from target to target about a straight line, the reversal
    value about a constant, by amounts that the run itself tells (restricted likelihood), and the
    estimates scatter about them by the covariance of the levels.
standard deviations
    Those of the targets scatter about a common one of their approach by an amount that the run
    itself tells; the estimates scatter about them as chi does for their degrees of freedom.

The figures of each draw are where the true figures may lie. The expanded uncertainty U is half the
shortest interval that is symmetric about the figure and holds 95.45 % of them, what a coverage
factor k = 2 means for a normal distribution.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import TYPE_CHECKING, final

import numpy as np

from thermaxis.codes import Message, Place
from thermaxis.errors import ConfigurationError, DataError, require_range
from thermaxis.positioning.run import FloatArray, PositioningTest, placed
from thermaxis.positioning.standard import (
    FIGURE_KEYS,
    Iso230_2Figures,
    arrays_by_key,
    figures_of,
    mean_and_s,
)
from thermaxis.positioning.uncertainty._true_values import Estimate, draw_levels, draw_std
from thermaxis.quantities import AxisKind

if TYPE_CHECKING:
    from thermaxis.positioning.drift import DriftResult

LABEL = "GUM"
"""How the uncertainties were evaluated; they are not those of the annex of ISO 230-2."""
COVERAGE_FACTOR = 2.0
"""Factor k of expanded uncertainties. [1]"""
PROBABILITY = 0.954499736
"""What k = 2 encloses of a normal distribution. [1]"""
RECTANGULAR = 0.6
"""Expanded uncertainty (k = 2) of a rectangular interval of unit width: 2 / (2 sqrt(3)) = 0.577,
rounded as the annex of ISO 230-2 does (from memory). [1]"""
OWN = "own"
"""Mark of a formula that was derived for this program."""
FROM_MEMORY = "M"
"""Mark of a formula that is from memory and was not read in the standard."""

_FEWEST_SAMPLES, _MOST_SAMPLES = 100, 1_000_000
_NUMBERS_AT_A_TIME = 2_000_000
"""Levels that are drawn at a time, so that memory is bounded. [1]"""


@final
@dataclass(frozen=True, slots=True)
class UncertaintyBudget:
    """What is known of the instrument and the environment; None where it is not known.

    Raises
    ------
    ConfigurationError
        If a number is negative or not finite, or the device is stated in two ways.
    """

    device: float | None = None
    """Expanded uncertainty (k = 2) of the instrument, of its certificate. [µm or arcsec]"""
    device_um_per_m: float | None = None
    """Part of it in proportion to the measured length; it is added. [µm/m]"""
    device_range: float | None = None
    """Width of the interval of the instrument's errors, in place of `device`. [µm or arcsec]"""
    device_range_um_per_m: float | None = None
    """Part of it in proportion to the measured length; it is added. [µm/m]"""
    misalignment_mm: float | None = None
    """Largest lateral misalignment of the beam over the measured length. [mm]"""
    material_temperature_interval_k: float | None = None
    """Width of the interval that holds the error of the material's temperature. [K]"""
    expansion_coefficient_interval_ppm_per_k: float | None = None
    """Width of the interval that holds the error of the expansion coefficient. [ppm/K]"""
    expansion_coefficient_ppm_per_k: float | None = None
    """Expansion coefficient of the machine. Default: what the run's environment says. [ppm/K]"""
    largest_difference_to_20_c_k: float | None = None
    """Largest difference of the material's temperature to 20 °C, without its sign. Default: what
    the run's environment says. [K]"""
    environmental_variation: float | None = None
    """Range E_VE of a drift test with the axis at rest. [µm or arcsec]"""

    def __post_init__(self) -> None:
        """Check the numbers."""
        for name in self.__dataclass_fields__:
            value: float | None = getattr(self, name)
            if value is not None and not 0.0 <= value < 1e9:
                raise ConfigurationError(
                    "outside_range", value=value, least=0.0, most=1e9, place=Place(key=name)
                )
        certified = (self.device, self.device_um_per_m)
        ranges = (self.device_range, self.device_range_um_per_m)
        if any(v is not None for v in certified) and any(v is not None for v in ranges):
            raise ConfigurationError("instrument_twice")


@final
@dataclass(frozen=True, slots=True)
class UncertaintyTerm:
    """One contribution to the uncertainty."""

    key: str
    """`noise`, `drift`, `device`, `misalignment`, `material_temperature`,
    `expansion_coefficient` or `environmental_variation`."""
    text: str
    """What it is, in words."""
    expanded: float | None
    """Expanded uncertainty (k = 2) over the measured length, of `environmental_variation` of one
    reading; None for terms that are different for every figure. [µm or arcsec]"""
    mark: str
    """Origin of its formula: `own` or `M` (from memory)."""


@final
@dataclass(frozen=True, slots=True)
class FigureUncertainty:
    """Uncertainties of the figures of one run; figures without a statement are absent."""

    expanded_uncertainty: Mapping[str, float]
    """U, k = 2: the true figure lies within figure ± U in 95 % of cases, although the figure is
    biased. [µm or arcsec]"""
    bias: Mapping[str, float]
    """How much the figure is too large on average: figure - bias is the better estimate.
    [µm or arcsec]"""
    standard_uncertainty: Mapping[str, float]
    """Standard uncertainty of figure - bias; its expanded uncertainty is twice this.
    [µm or arcsec]"""
    closed_form: Mapping[str, float]
    """Expanded uncertainty (k = 2) from the terms of the budget alone, by plain formulas; empty
    without a budget. [µm or arcsec]"""
    closed_form_mark: Mapping[str, str]
    """Origin of each of these formulas: `own` or `M` (from memory)."""
    terms: tuple[UncertaintyTerm, ...]
    """What is in it."""
    left_out: tuple[Message, ...]
    """What is not in it."""

    @property
    def included(self) -> tuple[str, ...]:
        """What is in it, in words."""
        return tuple(term.text for term in self.terms)


@final
@dataclass(frozen=True, slots=True)
class UncertaintyResult:
    """Uncertainties of the measured and of the drift-free figures."""

    measured: FigureUncertainty
    """Of the figures as measured. What is uncertain is how far they are from those of the axis
    in one thermal state, so that the drift of the run is part of the bias where it is known."""
    drift_free: FigureUncertainty | None
    """Of the figures of the run without its drift; None where the drift is not known."""
    samples: int
    """Number of draws. [1]"""
    seed: int
    """Seed of the draws. [1]"""
    label: str = LABEL
    """Method, as it is printed beside the numbers."""


# ---- terms of the budget ------------------------------------------------------------------------


_SYSTEMATIC = {
    "device": "instrument",
    "misalignment": "misalignment of the beam",
    "material_temperature": "temperature of the material",
    "expansion_coefficient": "expansion coefficient",
}
"""Terms that are the same for all readings, in words."""
_LINEAR_ONLY = (
    "device_um_per_m",
    "device_range_um_per_m",
    "misalignment_mm",
    "material_temperature_interval_k",
    "expansion_coefficient_interval_ppm_per_k",
)


@final
@dataclass(frozen=True, slots=True)
class _Terms:
    """Terms of the budget, evaluated for one run."""

    systematic: tuple[UncertaintyTerm, ...]
    environment: UncertaintyTerm | None
    left_out: tuple[str, ...]
    """Keys of the systematic terms that the budget does not state."""

    @property
    def systematic_expanded(self) -> float:
        """Root sum of squares of the systematic terms."""
        return float(np.sqrt(sum((term.expanded or 0.0) ** 2 for term in self.systematic)))

    @property
    def environment_expanded(self) -> float:
        """U_EVE of one reading."""
        return 0.0 if self.environment is None else (self.environment.expanded or 0.0)


def _stated_in_run(test: PositioningTest, prefix: str) -> list[float]:
    return [
        value
        for key, both in test.environment.items()
        if key.startswith(prefix)
        for value in (both.start, both.end)
        if value is not None
    ]


def _expansion_coefficient_ppm_per_k(test: PositioningTest, budget: UncertaintyBudget) -> float:
    if budget.expansion_coefficient_ppm_per_k is not None:
        return budget.expansion_coefficient_ppm_per_k
    stated = _stated_in_run(test, "expansion_coefficient_ppm_per_k")
    if not stated:
        raise DataError("no_expansion_coefficient")
    return max(stated)


def _difference_to_20_c_k(test: PositioningTest, budget: UncertaintyBudget) -> float:
    if budget.largest_difference_to_20_c_k is not None:
        return budget.largest_difference_to_20_c_k
    stated = _stated_in_run(test, "material_temperature_")
    if not stated:
        raise DataError("no_material_temperature")
    return max(abs(value - 20.0) for value in stated)


def _systematic_terms(
    test: PositioningTest, budget: UncertaintyBudget
) -> Iterator[UncertaintyTerm]:
    """Yield the terms that a budget states; a rotary axis has no length.

    Notes
    -----
    With the length L and an interval of width w, U = 0.6 w; the cosine error of a beam that is
    misaligned by b is b^2 / (2 L).
    """
    linear = test.kind is AxisKind.LINEAR
    length_m = test.measured_length / 1000.0 if linear else 0.0
    for fixed, per_m, factor, mark, source in (
        (budget.device, budget.device_um_per_m, 1.0, OWN, "certificate"),
        (
            *(budget.device_range, budget.device_range_um_per_m),
            *(RECTANGULAR, FROM_MEMORY, "range of errors"),
        ),
    ):
        if fixed is not None or per_m is not None:
            text = f"instrument, by its {source}, in full over the measured length"
            expanded = factor * ((fixed or 0.0) + (per_m or 0.0) * length_m)
            yield UncertaintyTerm("device", text, expanded, mark)
    expanded_um: dict[str, float] = {}
    if budget.misalignment_mm is not None and length_m > 0.0:
        cosine_error_um = 1000.0 * budget.misalignment_mm**2 / (2.0 * 1000.0 * length_m)
        expanded_um["misalignment"] = RECTANGULAR * cosine_error_um
    width = budget.material_temperature_interval_k
    if width is not None:
        largest = _expansion_coefficient_ppm_per_k(test, budget)
        expanded_um["material_temperature"] = RECTANGULAR * largest * length_m * width
    width = budget.expansion_coefficient_interval_ppm_per_k
    if width is not None:
        largest = _difference_to_20_c_k(test, budget)
        expanded_um["expansion_coefficient"] = RECTANGULAR * largest * length_m * width
    for key, expanded in expanded_um.items():
        yield UncertaintyTerm(key, _SYSTEMATIC[key], expanded, FROM_MEMORY)


def _terms(test: PositioningTest, budget: UncertaintyBudget) -> _Terms:
    rotary = test.kind is AxisKind.ROTARY
    for name in _LINEAR_ONLY if rotary else ():
        if getattr(budget, name) is not None:
            raise ConfigurationError("linear_axis_only", place=Place(key=name))
    systematic = tuple(_systematic_terms(test, budget))
    environment = None
    if budget.environmental_variation is not None:
        expanded = RECTANGULAR * budget.environmental_variation
        text = "environmental variation, as independent noise of every reading"
        environment = UncertaintyTerm("environmental_variation", text, expanded, FROM_MEMORY)
    known = {term.key for term in systematic}
    possible = ["device"] if rotary else list(_SYSTEMATIC)
    left_out = tuple(key for key in possible if key not in known)
    return _Terms(systematic, environment, left_out)


def _closed_form(terms: _Terms, readings: float, targets: int) -> dict[str, float]:
    """Return the expanded uncertainties that the terms of the budget alone give.

    Noise u = U_EVE / 2 of every reading moves a mean by u / sqrt(n) and an s by u / sqrt(n - 1).
    A figure is made of the two means, or the two means and the two s, where its extremes lie.
    """
    systematic, noise = terms.systematic_expanded, terms.environment_expanded
    of_mean = noise / np.sqrt(readings)
    of_s = noise / np.sqrt(readings - 1.0) if readings > 1.0 else np.nan
    e = np.sqrt(systematic**2 + 2.0 * of_mean**2)
    a = np.sqrt(e**2 + 2.0 * (2.0 * of_s) ** 2)
    values = {
        "B": np.sqrt(2.0) * of_mean,
        "B_mean": np.sqrt(2.0 / targets) * of_mean,
        "M": np.sqrt(systematic**2 + of_mean**2),
        "E_forward": e,
        "E_backward": e,
        "E": e,
        "R_forward": 4.0 * of_s,
        "R_backward": 4.0 * of_s,
        "R": np.sqrt(2.0 * of_mean**2 + 2.0 * (2.0 * of_s) ** 2),
        "A_forward": a,
        "A_backward": a,
        "A": a,
    }
    return {key: float(value) for key, value in values.items()}


_CLOSED_FORM_MARK = MappingProxyType(
    {key: OWN if key[0] in "BR" else FROM_MEMORY for key in FIGURE_KEYS}
)
"""M, E and A combine terms whose formulas are from memory; their combination is own algebra."""


# ---- levels and standard deviations of a run ---------------------------------------------------


def _flat(values: FloatArray, approaches: tuple[int, ...]) -> FloatArray:
    """Return values per target and approach, (m, 2), as values per level, (L,)."""
    return np.concatenate([values[:, a] for a in approaches])


def _estimate_with_drift(test: PositioningTest, drift: "DriftResult") -> Estimate:
    approaches = test.approaches
    readings = np.sum(~np.isnan(drift.deviation), axis=1)
    count = _flat(np.asarray(readings, dtype=np.float64), approaches)
    spare = float(np.sum(count) - count.size)
    return Estimate(
        position=test.target,
        approaches=approaches,
        level=_flat(drift.level, approaches),
        covariance=drift.level_covariance,
        s=_flat(drift.figures.s, approaches),
        free=(count - 1.0) * (1.0 - drift.drift_parameters / spare),
        readings=count,
    )


def _estimate_without_drift(test: PositioningTest) -> Estimate:
    """Return plain means and s, NaN where one reading tells nothing of the noise."""
    approaches, targets = test.approaches, test.target.size
    count = _flat(test.readings, approaches)
    mean, s = (_flat(values, approaches) for values in mean_and_s(test.deviation))
    if float(np.min(count)) < 2.0:
        free, s, variance = np.ones(count.size), np.full(count.size, np.nan), np.zeros(count.size)
    else:
        free = count - 1.0
        parts = np.split(np.arange(count.size), len(approaches))
        common = [np.sum(free[own] * s[own] ** 2) / np.sum(free[own]) for own in parts]
        variance = np.repeat(common, targets)
    return Estimate(
        position=test.target,
        approaches=approaches,
        level=mean,
        covariance=np.diag(variance / np.maximum(count, 1.0)),
        s=s,
        free=free,
        readings=count,
    )


# ---- figures ------------------------------------------------------------------------------------


def _with_terms(
    estimate: Estimate,
    draws: tuple[FloatArray, FloatArray],
    systematic: float,
    environment: float,
    rng: np.random.Generator,
) -> dict[str, FloatArray]:
    """Return the figures of drawn levels and s, (S, L) each, with the terms of the budget."""
    position = estimate.position - np.mean(estimate.position)
    length = float(np.ptp(estimate.position))
    level, std = draws
    if systematic > 0.0 and length > 0.0:
        ramp = np.tile(position / length, len(estimate.approaches))
        error = systematic / COVERAGE_FACTOR * rng.standard_normal((level.shape[0], 1))
        level = level + error * ramp
    if environment > 0.0:
        noise = environment / COVERAGE_FACTOR
        level = level + noise / np.sqrt(estimate.readings) * rng.standard_normal(level.shape)
        spare = np.maximum(estimate.readings - 1.0, 1.0)
        std = np.abs(std + noise / np.sqrt(spare) * rng.standard_normal(std.shape))
    approaches = estimate.approaches
    return arrays_by_key(figures_of(placed(level, approaches), placed(std, approaches)))


def _joined(parts: list[dict[str, FloatArray]]) -> dict[str, FloatArray]:
    return {key: np.concatenate([part[key] for part in parts]) for key in FIGURE_KEYS}


def _draw_figures(
    estimate: Estimate, terms: _Terms, samples: int, seed: int
) -> tuple[dict[str, FloatArray], dict[str, FloatArray]]:
    """Return where the true figures may lie, (S,) each: against the measured, the drift-free."""
    level_rng, std_rng, term_rng = (
        np.random.default_rng(s) for s in np.random.SeedSequence(seed).spawn(3)
    )
    at_once = max(_FEWEST_SAMPLES, _NUMBERS_AT_A_TIME // estimate.level.size)
    change: list[dict[str, FloatArray]] = []
    drift_free: list[dict[str, FloatArray]] = []
    systematic, environment = terms.systematic_expanded, terms.environment_expanded
    for start in range(0, samples, at_once):
        count = min(at_once, samples - start)
        std = draw_std(estimate, count, std_rng)
        draws = draw_levels(estimate, count, level_rng), std
        drift_free.append(_with_terms(estimate, draws, systematic, 0.0, term_rng))
        if environment > 0.0:
            moved = _with_terms(estimate, draws, 0.0, environment, term_rng)
            still = _with_terms(estimate, draws, 0.0, 0.0, term_rng)
            change.append({key: moved[key] - still[key] for key in FIGURE_KEYS})
    free = _joined(drift_free)
    return _widened(free, _joined(change)) if change else free, free


def _widened(truths: dict[str, FloatArray], change: dict[str, FloatArray]) -> dict[str, FloatArray]:
    """Return the truths with what the environment may have changed, without its mean.

    The environment scattered the readings already, so it makes a true figure uncertain; that
    extremes of scattered values are larger must not count a second time.
    """
    return {key: truths[key] + change[key] - np.mean(change[key]) for key in FIGURE_KEYS}


def _compared(
    figures: Iso230_2Figures, truths: dict[str, FloatArray]
) -> tuple[dict[str, float], dict[str, float], dict[str, float]]:
    """Return U, bias and standard uncertainty of every figure to which something contributes."""
    expanded: dict[str, float] = {}
    bias: dict[str, float] = {}
    standard: dict[str, float] = {}
    for key, value in arrays_by_key(figures).items():
        figure, truth = float(value), truths[key]
        if np.isnan(figure) or np.isnan(truth[0]):
            continue
        u = float(np.quantile(np.abs(truth - figure), PROBABILITY))
        if u <= 1e-9 * (abs(figure) + 1e-9):  # nothing that is known moves this figure
            continue
        expanded[key] = u
        bias[key] = figure - float(np.mean(truth))
        standard[key] = float(np.std(truth, ddof=1))
    return expanded, bias, standard


_NOISE = UncertaintyTerm("noise", "scatter of the readings", None, OWN)
_DRIFT_FREE = UncertaintyTerm("drift", "estimate of the drift", None, OWN)
_DRIFT_MEASURED = UncertaintyTerm(
    "drift", "drift during the run, as part of the bias, and its estimate", None, OWN
)


def _left_out(
    terms: _Terms, drift: "DriftResult | None", *, budget: bool, drift_free: bool
) -> tuple[Message, ...]:
    found: list[Message] = []
    if not budget:
        found.append(Message("left_out-no_budget"))
    else:
        unstated = not drift_free and terms.environment is None
        missing = (*terms.left_out, *(("environmental_variation",) if unstated else ()))
        found += [Message("left_out-not_stated", {"term": key}) for key in missing]
        if drift_free and terms.environment is not None:
            found.append(Message("left_out-counted_twice"))
    if drift is None:
        found.append(Message("left_out-drift_unknown"))
    elif drift.suspects:
        named = ", ".join(str(i) for i in drift.suspects)
        found.append(Message("left_out-drift_not_described", {"targets": named}))
    return tuple(found)


def _figure_uncertainty(
    figures: Iso230_2Figures,
    truths: dict[str, FloatArray],
    terms: tuple[UncertaintyTerm, ...],
    closed_form: dict[str, float],
    left_out: tuple[Message, ...],
) -> FigureUncertainty:
    expanded, bias, standard = _compared(figures, truths)
    stated = {k: v for k, v in closed_form.items() if k in expanded and np.isfinite(v)}
    return FigureUncertainty(
        expanded_uncertainty=MappingProxyType(expanded),
        bias=MappingProxyType(bias),
        standard_uncertainty=MappingProxyType(standard),
        closed_form=MappingProxyType(stated),
        closed_form_mark=MappingProxyType({key: _CLOSED_FORM_MARK[key] for key in stated}),
        terms=terms,
        left_out=left_out,
    )


def evaluate_uncertainty(
    test: PositioningTest,
    drift: "DriftResult | None",
    *,
    budget: UncertaintyBudget | None = None,
    samples: int = 2000,
    seed: int = 1,
) -> UncertaintyResult:
    """Evaluate the expanded uncertainties (k = 2) of the figures of a run.

    Parameters
    ----------
    test : PositioningTest
        The measured run.
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
        Of the figures as measured and without the drift. A figure to which no known term
        contributes is absent, as are figures that the run does not have.

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
        raise ConfigurationError("negative", value=seed, place=Place(key="seed"))
    terms = _terms(test, budget or UncertaintyBudget())
    estimate = _estimate_without_drift(test) if drift is None else _estimate_with_drift(test, drift)
    truths, drift_free_truths = _draw_figures(estimate, terms, samples, seed)
    noise_known = not np.all(np.isnan(estimate.s))
    noise = (_NOISE,) if noise_known else ()
    no_noise = () if noise_known else (Message("left_out-one_reading"),)
    closed = (float(np.min(estimate.readings)), test.target.size)
    given = budget is not None
    environment = () if terms.environment is None else (terms.environment,)
    measured = _figure_uncertainty(
        figures_of(*mean_and_s(test.deviation)),
        truths,
        (*noise, *(() if drift is None else (_DRIFT_MEASURED,)), *terms.systematic, *environment),
        _closed_form(terms, *closed) if given else {},
        (*no_noise, *_left_out(terms, drift, budget=given, drift_free=False)),
    )
    if drift is None:
        return UncertaintyResult(measured, None, samples, seed)
    without = _Terms(terms.systematic, None, terms.left_out)
    drift_free = _figure_uncertainty(
        drift.figures,
        drift_free_truths,
        (_NOISE, _DRIFT_FREE, *terms.systematic),
        _closed_form(without, *closed) if given else {},
        _left_out(terms, drift, budget=given, drift_free=True),
    )
    return UncertaintyResult(measured, drift_free, samples, seed)
