"""Monte Carlo of differences, equations (7) to (10): how much more a difference scatters."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import final

import numpy as np

from thermaxis.errors import ConfigurationError, require_range
from thermaxis.positioning.run import FloatArray, freeze_arrays

PAPER_RATIO = 1.4076
"""s_b/s_a that the paper found with 1000 numbers. [1]"""

_NORMAL_QUANTILE = 1.959963984540054
"""Two-sided 95 % of the normal distribution. [1]"""
_NUMBERS_AT_A_TIME = 1_000_000
"""Normal numbers of one sequence that are kept in memory. [1]"""
_MOST_SAMPLES = 1_000_000
_FEWEST_SAMPLES = 3
_FEWEST_REPETITIONS = 40
"""Below this, 2.5 % of the repetitions are less than one. [1]"""
_MOST_NUMBERS = 2_000_000_000
"""Largest samples times repetitions: about a minute. [1]"""
_ONE_SEQUENCE_BIAS = 0.375
"""Relative bias of s_b/s_a times the length: as in `_difference_to_source`, with the relative
variances 3/n of D and 2/n of S, the covariance 2/n, and 1/n because the differences telescope. [1]
"""
_SMALLEST_SIGMA, _LARGEST_SIGMA = 1e-9, 1e9


@final
@dataclass(frozen=True, slots=True)
class RatioEstimate:
    """Ratio of two standard deviations over all repetitions of an experiment."""

    theory: float
    """What the ratio tends to with the length of the sequences, equation (10). [1]"""
    expected: float
    """What the mean tends to for sequences of this length, to the first order of its inverse:
    a ratio of two sample standard deviations is a little too large on average. [1]"""
    first: float
    """Ratio of the first experiment alone, comparable with the paper's one. [1]"""
    mean: float
    """Mean of all experiments. [1]"""
    mean_interval: tuple[float, float]
    """95 % confidence interval of the mean. [1]"""
    scatter: float
    """Sample standard deviation of single experiments. [1]"""
    single_interval: tuple[float, float]
    """Interval in which 95 % of the single experiments fell. [1]"""

    def allows(self, ratio: float) -> bool:
        """Whether a ratio of a single experiment of the same length lies in `single_interval`."""
        return self.single_interval[0] <= ratio <= self.single_interval[1]


@final
@dataclass(frozen=True, slots=True, eq=False)
class DifferenceMonteCarlo:
    """Scatter of differences against the scatter of what they are made of."""

    samples: int
    """Numbers in one sequence. [1]"""
    repetitions: int
    """Number of experiments. [1]"""
    sigma_a: float
    """True standard deviation of a. [any]"""
    sigma_b: float
    """True standard deviation of b, for two sequences. [as sigma_a]"""
    seed: int
    """Seed of the numbers. [1]"""
    one_sequence: RatioEstimate
    """s of a_k - a_(k+1) over s of a."""
    two_sequences: RatioEstimate
    """s of a_k - b_k over s of a."""
    to_larger: RatioEstimate
    """s of a_k - b_k over s of the sequence with the larger sigma: sqrt(2) at most."""
    to_smaller: RatioEstimate
    """s of a_k - b_k over s of the sequence with the smaller sigma: sqrt(2) at least."""
    histogram_edges: FloatArray
    """Edges of the classes of both histograms, symmetric about zero, (k + 1,). [as sigma_a]"""
    source_counts: FloatArray
    """Numbers a of the first experiment per class, (k,). [1]"""
    derived_counts: FloatArray
    """Differences a_k - a_(k+1) of the first experiment per class, (k,). [1]"""
    source_deviation: float
    """s of a in the first experiment. [as sigma_a]"""
    derived_deviation: float
    """s of a_k - a_(k+1) in the first experiment. [as sigma_a]"""
    paper_ratio: float = PAPER_RATIO
    """s_b/s_a of the paper's one experiment with 1000 numbers. [1]"""

    def __post_init__(self) -> None:
        freeze_arrays(self)


def _check(samples: int, repetitions: int, sigmas: tuple[float, float], seed: int) -> None:
    require_range("samples", samples, _FEWEST_SAMPLES, _MOST_SAMPLES)
    # fewer cannot show an interval of 95 %
    require_range("repetitions", repetitions, _FEWEST_REPETITIONS, _MOST_NUMBERS / samples)
    for name, sigma in zip(("sigma_a", "sigma_b"), sigmas, strict=True):
        require_range(name, sigma, _SMALLEST_SIGMA, _LARGEST_SIGMA)
    if seed < 0:
        raise ConfigurationError("negative", value=seed, key="seed")


def _estimate(ratios: FloatArray, theory: float, bias: float) -> RatioEstimate:
    mean = float(np.mean(ratios))
    scatter = float(np.std(ratios, ddof=1))
    half = _NORMAL_QUANTILE * scatter / math.sqrt(ratios.size)
    low, high = np.quantile(ratios, (0.025, 0.975)).tolist()
    return RatioEstimate(
        theory=theory,
        expected=theory * (1.0 + bias),
        first=float(ratios[0]),
        mean=mean,
        mean_interval=(mean - half, mean + half),
        scatter=scatter,
        single_interval=(low, high),
    )


def _difference_to_source(
    ratios: FloatArray, other_to_source: float, samples: int
) -> RatioEstimate:
    """Estimate s of a difference of two sequences over s of one of them, the source.

    The bias comes from expanding sqrt(D/S): -var(D)/8 + 3 var(S)/8 - cov(D, S)/4, with relative
    variances 2/n of both dispersions and the relative covariance 2/n · S/D.
    """
    theory = math.hypot(1.0, other_to_source)
    return _estimate(ratios, theory, 0.5 * (1.0 - theory**-2) / samples)


def _histograms(a: FloatArray, difference: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Count both sequences in the same classes; about the square root of their length."""
    reach = max(float(np.max(np.abs(a))), float(np.max(np.abs(difference))))
    classes = 2 * min(30, max(5, round(math.sqrt(a.size) / 2)))
    edges = np.linspace(-reach, reach, classes + 1)
    counts = [np.histogram(values, edges)[0].astype(np.float64) for values in (a, difference)]
    return edges, counts[0], counts[1]


def montecarlo_difference(
    *,
    samples: int = 1000,
    repetitions: int = 2000,
    sigma_a: float = 1.0,
    sigma_b: float | None = None,
    seed: int = 2017,
    on_progress: Callable[[str, int, int], None] | None = None,
) -> DifferenceMonteCarlo:
    """Repeat the experiment behind equation (10) with normal random numbers.

    Each repetition takes one sequence a and its differences b_k = a_k - a_(k+1), equation (7),
    and two independent sequences a and b and their differences a_k - b_k.

    Parameters
    ----------
    samples : int
        Numbers in one sequence, 3 to 1 000 000. Default: the paper's. [1]
    repetitions : int
        Number of experiments, at least 40. Default: enough to see the mean ratio to 0.001. [1]
    sigma_a : float
        Standard deviation of a. Default: one, for only ratios count. [any]
    sigma_b : float, optional
        Standard deviation of b, in two sequences. Default: as a. [as sigma_a]
    seed : int
        Seed; the same arguments give the same result. Default: the paper's year. [1]
    on_progress : callable, optional
        Called with the name of the step, the experiments done, and their number.

    Returns
    -------
    DifferenceMonteCarlo
        The ratios s_b/s_a with their intervals, and the histograms of the first experiment.

    Raises
    ------
    ConfigurationError
        If there are too few or too many numbers, a standard deviation is not within 1e-9 to 1e9,
        or the seed is negative.

    References
    ----------
    Stejskal et al. 2017, equations (7) to (10) and figure 1.
    """
    sigma_b = sigma_a if sigma_b is None else sigma_b
    _check(samples, repetitions, (sigma_a, sigma_b), seed)
    random_a, random_b = (np.random.default_rng(s) for s in np.random.SeedSequence(seed).spawn(2))
    s_a, s_one, s_b, s_two = (np.empty(repetitions) for _ in range(4))
    histograms: tuple[FloatArray, FloatArray, FloatArray] | None = None
    rows = max(1, _NUMBERS_AT_A_TIME // samples)
    for begin in range(0, repetitions, rows):
        now = slice(begin, min(begin + rows, repetitions))
        a = sigma_a * random_a.standard_normal((now.stop - begin, samples))
        b = sigma_b * random_b.standard_normal(a.shape)
        difference = a[:, :-1] - a[:, 1:]
        s_a[now] = np.std(a, axis=1, ddof=1)
        s_b[now] = np.std(b, axis=1, ddof=1)
        s_one[now] = np.std(difference, axis=1, ddof=1)
        s_two[now] = np.std(a - b, axis=1, ddof=1)
        if histograms is None:
            histograms = _histograms(a[0], difference[0])
        if on_progress is not None:
            on_progress("Monte Carlo", now.stop, repetitions)
    assert histograms is not None  # noqa: S101 - there is at least one repetition
    larger, smaller = (s_a, s_b) if sigma_a >= sigma_b else (s_b, s_a)
    ratio = min(sigma_a, sigma_b) / max(sigma_a, sigma_b)
    return DifferenceMonteCarlo(
        samples=samples,
        repetitions=repetitions,
        sigma_a=sigma_a,
        sigma_b=sigma_b,
        seed=seed,
        one_sequence=_estimate(s_one / s_a, math.sqrt(2.0), _ONE_SEQUENCE_BIAS / samples),
        two_sequences=_difference_to_source(s_two / s_a, sigma_b / sigma_a, samples),
        to_larger=_difference_to_source(s_two / larger, ratio, samples),
        to_smaller=_difference_to_source(s_two / smaller, 1.0 / ratio, samples),
        histogram_edges=histograms[0],
        source_counts=histograms[1],
        derived_counts=histograms[2],
        source_deviation=float(s_a[0]),
        derived_deviation=float(s_one[0]),
    )
