"""What a model left over: autocorrelation, correlation with the inputs, poles, step responses."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from math import prod
from statistics import NormalDist
from typing import TypeAlias, final

import numpy as np
from scipy.fft import irfft, next_fast_len, rfft  # pyright: ignore[reportUnknownVariableType] - no types
from scipy.special import fdtrc, gammaincc

from thermaxis.errors import DataError
from thermaxis.thermal._arrays import FloatArray
from thermaxis.thermal.transfer_function._cascade import later, output_of
from thermaxis.thermal.transfer_function._polynomial_model import (
    PolynomialResult,
    TransferFunction,
    held,
)
from thermaxis.thermal.transfer_function._roots import ComplexArray

DEFAULT_LAGS = 25
"""Lags of the correlations, unless others are asked for. [row]"""
LEVEL = 0.99
"""Probability with which a correlation of an independent residual lies within its band. [1]"""
CANCELLING = 0.02
"""A pole and a zero that are closer than this share of the pole's distance from one are said to
cancel. [1]"""
LEAST_OWN_LAGS, MOST_OWN_LAGS, INPUT_LAGS = 5, 15, (0, 1, 2, 4, 8, 16)
"""Fewest and most lags of the residual's own past, and those of the inputs, in the test of their
influence. [row]"""
_LEAST_NEW = 1e-9
_LARGEST_SHARE_OF_ROWS = 0.25


def correlation(
    first: Sequence[FloatArray], second: Sequence[FloatArray], lags: int
) -> tuple[FloatArray, FloatArray]:
    """Return the correlation of two series that several tests share, with missing values."""
    products, pairs = np.zeros(2 * lags + 1), np.zeros(2 * lags + 1)
    possible, rows = np.zeros(2 * lags + 1), 0
    distance = np.abs(np.arange(-lags, lags + 1))
    for a, b in zip(first, second, strict=True):
        length = int(next_fast_len(a.size + lags + 1, real=True) or 0)
        products += _lagged(np.nan_to_num(a), np.nan_to_num(b), lags, length)
        pairs += np.round(
            _lagged(
                (~np.isnan(a)).astype(np.float64), (~np.isnan(b)).astype(np.float64), lags, length
            )
        )
        possible += np.maximum(a.size - distance, 0)
        rows += a.size
    scale = _root_mean_square(first) * _root_mean_square(second)
    means = np.divide(products, pairs, out=np.zeros_like(products), where=pairs > 0)
    drawn = means * possible / rows
    return (drawn / scale if scale > 0 else np.zeros_like(drawn)), pairs


def _lagged(a: FloatArray, b: FloatArray, lags: int, length: int) -> FloatArray:
    spectrum = np.asarray(rfft(a, length)) * np.conj(np.asarray(rfft(b, length)))
    circular = np.asarray(irfft(spectrum, length), dtype=np.float64)
    reach = min(lags, a.size - 1)
    values = np.zeros(2 * lags + 1)
    values[lags : lags + reach + 1] = circular[: reach + 1]
    if reach:
        values[lags - reach : lags] = circular[-reach:]
    return values


def _root_mean_square(series: Sequence[FloatArray]) -> float:
    total = sum(float(np.nansum(values**2)) for values in series)
    count = sum(int(np.count_nonzero(~np.isnan(values))) for values in series)
    return float(np.sqrt(total / count)) if count else 0.0


def portmanteau_p(autocorrelation: FloatArray, pairs: FloatArray, parameters: int = 0) -> float:
    """Return how likely so large autocorrelations are where the residual is white.

    References
    ----------
    G. Ljung and G. Box 1978 (from memory), with the pairs of each lag in place of n - lag.
    """
    rows = float(np.max(pairs))
    present = pairs > 0
    statistic = rows * (rows + 2.0) * np.sum(autocorrelation[present] ** 2 / pairs[present])
    free = max(int(np.count_nonzero(present)) - parameters, 1)
    return float(gammaincc(0.5 * free, 0.5 * float(statistic)))


@final
@dataclass(frozen=True, slots=True, eq=False)
class ResidualAnalysis:
    """Correlations of a residual with itself and with the past of the inputs."""

    lags: FloatArray
    """0 ... L: the residual is so much later. [row]"""
    autocorrelation: FloatArray
    """Of the residual, (L + 1,). [1]"""
    autocorrelation_band: FloatArray
    """Half width of the band of a white residual, (L + 1,). [1]"""
    white_p: float
    """Probability of such autocorrelations of a white residual. [1]"""
    input_correlation: FloatArray
    """Of what the residual's own past does not tell with every input, both through the filter that
    makes that white, (L + 1, k). [1]"""
    input_band: FloatArray
    """Half width of the band of a residual that is independent of the input, (k,). [1]"""
    input_p: FloatArray
    """Probability that an input without influence tells so much of the residual, (k,). [1]"""
    residual_effective_rows: float
    """Independent rows that the mean of the residual is worth. [1]"""
    rows: int
    """Rows with a residual. [1]"""

    @property
    def white(self) -> bool:
        """Whether the residual may be white, at the 1 % level."""
        return self.white_p > 1.0 - LEVEL

    @property
    def independent(self) -> tuple[bool, ...]:
        """Whether the residual may be independent of each input's past, 1 % level of all inputs."""
        return tuple((self.input_p * self.input_p.size > 1.0 - LEVEL).tolist())

    @property
    def input_lags(self) -> FloatArray:
        """Lag at which each input's correlation is the largest, (k,). [row]"""
        return self.lags[np.argmax(np.abs(self.input_correlation), axis=0)]


def analyse_residuals(
    residuals_um: Sequence[FloatArray],
    inputs: Sequence[FloatArray],
    *,
    lags: int = DEFAULT_LAGS,
    parameters: int = 0,
) -> ResidualAnalysis:
    """Evaluate what a model left over.

    Parameters
    ----------
    residuals_um : sequence of FloatArray
        Measured minus simulated (or innovations) of every test, (n,) each; NaN where missing. [µm]
    inputs : sequence of FloatArray
        Inputs of every test, (n, k) each; missing ones are held. [K]
    lags : int
        Largest lag. Default: 25. [row]
    parameters : int
        Coefficients of a noise model that the residual has behind it. Default: none. [1]

    Returns
    -------
    ResidualAnalysis
        Correlations with bands that hold 99 % of the values of an independent residual.

    Raises
    ------
    DataError
        If there is no test, shapes do not fit, or too few rows have a residual.

    Notes
    -----
    A drift that no input explains is slow, and so are inputs: two such series correlate by chance.
    So every input u is asked what it adds to the residual's own past (Granger's test):

        e(t) = c + sum over k = 1 ... m of a_k e(t - k) + sum over k = 0, 1, 2, 4, 8, 16
               of b_k u(t - k) + white noise,

    with one c per test and m from 5 to 15 by the AIC; all b zero or not, by the F distribution.
    The correlations that are shown are those of e(t) - sum a_k e(t - k) and
    u(t) - sum a_k u(t - k); they scatter by 1/sqrt(n).

    References
    ----------
    C. Granger 1969; H. Akaike 1974; Ljung 1999, section 16.6; M. S. Bartlett 1946 (from memory);
    C. Geyer 1992 (initial positive sequence; from memory).
    """
    _check_series(residuals_um, inputs, lags)
    residuals = _centred(residuals_um)
    rows = sum(int(np.count_nonzero(~np.isnan(e))) for e in residuals)
    own, pairs = correlation(residuals, residuals, lags)
    reach = max(int(_LARGEST_SHARE_OF_ROWS * max(e.size for e in residuals)), 1)
    wide, _ = correlation(residuals, residuals, reach)
    # about their own mean correlations sum to nothing: only those before the first negative count
    positive = np.cumprod(wide[reach + 1 :] > 0.0)
    alike = 1.0 + 2.0 * float(np.sum(wide[reach + 1 :] * positive))
    quantile = NormalDist().inv_cdf(0.5 + 0.5 * LEVEL)
    p: list[float] = []
    bands: list[float] = []
    found: list[FloatArray] = []
    for column in range(inputs[0].shape[1]):
        series = _centred([held(u)[0][:, column] for u in inputs])
        added_p, past = _beyond_own_past(residuals, series)
        whitened = [
            [np.convolve(values, np.append(1.0, -past), "valid") for values in each]
            for each in (residuals, series)
        ]
        values, both = correlation(whitened[0], whitened[1], lags)
        p.append(added_p)
        found.append(values[lags:])
        bands.append(quantile / np.sqrt(max(both[lags], 1.0)))
    return ResidualAnalysis(
        lags=np.arange(lags + 1, dtype=np.float64),
        autocorrelation=own[lags:],
        autocorrelation_band=quantile / np.sqrt(np.maximum(pairs[lags:], 1.0)),
        white_p=portmanteau_p(own[lags + 1 :], pairs[lags + 1 :], parameters),
        input_correlation=np.stack(found, axis=1),
        input_band=np.array(bands),
        input_p=np.array(p),
        residual_effective_rows=rows / alike,
        rows=rows,
    )


def _beyond_own_past(
    residuals: Sequence[FloatArray], series: Sequence[FloatArray]
) -> tuple[float, FloatArray]:
    """Return the probability that an input adds nothing, and what the residual's own past does."""
    first = max(MOST_OWN_LAGS, *INPUT_LAGS)
    tables = [
        np.column_stack(
            [e[first - k : e.size - k] for k in range(1, MOST_OWN_LAGS + 1)]
            + [u[first - k : u.size - k] for k in INPUT_LAGS]
            + [e[first:]]
        )
        for e, u in zip(residuals, series, strict=True)
        if e.size > first
    ]
    tables = [table[~np.any(np.isnan(table), axis=1)] for table in tables]
    tables = [table - np.mean(table, axis=0) for table in tables if table.size]
    table = np.vstack(tables) if tables else np.zeros((0, MOST_OWN_LAGS + len(INPUT_LAGS) + 1))
    rows = table.shape[0] - len(tables)  # a constant each
    if rows < 2 * (table.shape[1] - 1):
        raise DataError("too_few_residuals", rows=table.shape[0], lags=first)
    # the triangle's last column is what each lag tells beyond those before it
    _, own = np.linalg.qr(np.column_stack((table[:, :MOST_OWN_LAGS], table[:, -1])))
    left = np.cumsum(own[::-1, -1] ** 2)[::-1]
    aic = rows * np.log(np.maximum(left, 1e-300)) + 2.0 * np.arange(left.size)
    known = LEAST_OWN_LAGS + int(np.argmin(aic[LEAST_OWN_LAGS:]))
    table = np.delete(table, np.s_[known:MOST_OWN_LAGS], axis=1)
    free = rows - table.shape[1] + 1
    basis, triangle = np.linalg.qr(table[:, :-1])
    there = np.abs(np.diag(triangle)) > _LEAST_NEW * np.linalg.norm(table[:, :-1], axis=0)
    told = np.where(there, basis.T @ table[:, -1], 0.0)
    lost = float(np.sum(table[:, -1] ** 2) - np.sum(told**2))
    added, count = float(np.sum(told[known:] ** 2)), int(np.sum(there[known:]))
    past = np.linalg.lstsq(triangle, told, rcond=None)[0][:known]
    if count == 0 or added == 0.0:
        return 1.0, past
    f = (added / count) / max(lost / free, 1e-300)
    return float(fdtrc(count, free, f)), past


def _check_series(residuals: Sequence[FloatArray], inputs: Sequence[FloatArray], lags: int) -> None:
    if not residuals or len(residuals) != len(inputs):
        raise DataError(
            "wrong_shape",
            shape=f"({len(residuals)},), ({len(inputs)},)",
            expected="(tests,), (tests,)",
        )
    for e, u in zip(residuals, inputs, strict=True):
        if e.ndim != 1 or u.ndim != 2 or u.shape[0] != e.size or u.shape[1] != inputs[0].shape[1]:
            raise DataError("wrong_shape", shape=f"{e.shape}, {u.shape}", expected="(n,), (n, k)")
        if u.shape[0] == 0 or bool(np.any(np.all(np.isnan(u), axis=0))):
            raise DataError("never_measured", key="inputs")
    rows = sum(int(np.count_nonzero(~np.isnan(e))) for e in residuals)
    if lags < 1 or rows <= lags:
        raise DataError("too_few_residuals", rows=rows, lags=lags)


def _centred(series: Sequence[FloatArray]) -> list[FloatArray]:
    """Return each test about its own mean: levels of tests tell nothing of one another."""
    return [
        np.asarray(values - np.mean(values[~np.isnan(values)]), dtype=np.float64)
        if np.any(~np.isnan(values))
        else values
        for values in series
    ]


_Places: TypeAlias = tuple[int, ...]


@final
@dataclass(frozen=True, slots=True, eq=False)
class StepResponses:
    """Responses to a lasting step of one kelvin in every input, with bands."""

    times_s: FloatArray
    """Time since the step, (r,). [s]"""
    response: FloatArray
    """Displacement, (r, k). [µm/K]"""
    std: FloatArray
    """Its standard deviation to first order in the coefficients, (r, k). [µm/K]"""


def _parts(result: PolynomialResult) -> Iterator[tuple[TransferFunction, _Places, _Places, int]]:
    """Return every part with the places of its free coefficients a and b, and its delay."""
    at = (result.numerator_at, result.denominator_at, result.delays)
    return zip(result.model.transfer_functions, *at, strict=True)


def step_responses(result: PolynomialResult, rows: int) -> StepResponses:
    """Return the step responses of a result of `arx` or `oe` over some rows, and how sure they are.

    Fewer rows than one are a DataError.
    """
    if rows < 1:
        raise DataError("not_positive", value=rows, key="rows")
    step = np.ones(rows)
    responses: list[FloatArray] = []
    deviations: list[FloatArray] = []
    for part, a_at, b_at, delay in _parts(result):
        y, gradient = _step_and_gradient(part, step, delay, (len(a_at), len(b_at)))
        at = [*a_at, *b_at]
        responses.append(y)
        deviations.append(np.linalg.norm(gradient @ result.covariance_root[at], axis=1))
    return StepResponses(
        times_s=np.arange(rows, dtype=np.float64) * np.float64(result.model.sample_time_s),
        response=np.stack(responses, axis=1),
        std=np.stack(deviations, axis=1),
    )


def _step_and_gradient(
    part: TransferFunction, u: FloatArray, delay: int, counts: tuple[int, int]
) -> tuple[FloatArray, FloatArray]:
    """Return the output and its gradient by the free coefficients a and b."""
    b = part.denominator
    one = np.ones(1)
    y = output_of(part.numerator, b, u, 0.0)
    behind, again = output_of(one, b, u, 0.0), output_of(one, b, y, 0.0)
    columns = [later(behind, delay + i, 0.0) for i in range(counts[0])]
    columns += [-later(again, i + 1, 0.0) for i in range(counts[1])]
    return y, np.stack(columns, axis=1) if columns else np.zeros((u.size, 0))


def frequency_deviations(
    result: PolynomialResult, frequencies_hz: FloatArray
) -> tuple[FloatArray, ComplexArray]:
    """Return the means of |d|^2 and d^2 of the deviations d of frequency responses, (f, k) each.

    Of a result of `arx` or `oe`, to first order in its coefficients. [µm²/K²]

    Notes
    -----
    With G = a(z) / b(z) z^-delay at z = exp(2 pi i f T), dG/da_j = z^-(delay + j) / b(z) and
    dG/db_j = -z^-j G / b(z).
    """
    back = np.exp(-2j * np.pi * frequencies_hz * result.model.sample_time_s)[:, None]
    plain: list[FloatArray] = []
    square: list[ComplexArray] = []
    for part, a_at, b_at, delay in _parts(result):
        below = np.polynomial.polynomial.polyval(back, part.denominator)
        response = np.polynomial.polynomial.polyval(back, part.numerator) / below
        by_a = back ** (delay + np.arange(len(a_at))) / below
        by_b = -(back ** np.arange(1, 1 + len(b_at))) * response / below
        spread = np.hstack([by_a, by_b]) @ result.covariance_root[[*a_at, *b_at]]
        plain.append(np.sum(np.abs(spread) ** 2, axis=1))
        square.append(np.sum(spread**2, axis=1))
    return np.stack(plain, axis=1), np.stack(square, axis=1)


@final
@dataclass(frozen=True, slots=True, eq=False)
class PoleZeroMap:
    """Poles and zeros of the part of one input."""

    input_name: str
    poles: ComplexArray
    """Poles in z, slowest first, (m,). [1]"""
    time_constants_s: FloatArray
    """Time constant of each pole by its modulus, (m,). [s]"""
    time_constants_std_s: FloatArray
    """Standard deviation to first order, (m,); NaN for a pole that is no lag. [s]"""
    zeros: ComplexArray
    """Zeros in z. [1]"""
    cancelling: tuple[tuple[int, int], ...]
    """Pole and zero, by their place, that nearly cancel: the order may be too high."""


def pole_zero_map(result: PolynomialResult) -> tuple[PoleZeroMap, ...]:
    """Return poles and zeros of every part of a result of `arx` or `oe`, one map per input."""
    maps: list[PoleZeroMap] = []
    sample_time_s = result.model.sample_time_s
    for name, part, at in zip(
        result.model.input_names,
        result.model.transfer_functions,
        result.denominator_at,
        strict=True,
    ):
        distances = part.distances_from_one
        zeros = part.zeros
        root = result.covariance_root[list(at)]
        gaps = np.abs(zeros[None, :] - part.poles[:, None])
        near = np.argwhere(gaps < CANCELLING * np.abs(distances)[:, None])
        maps.append(
            PoleZeroMap(
                input_name=name,
                poles=part.poles,
                time_constants_s=part.time_constants_s(sample_time_s),
                time_constants_std_s=_time_constant_std(distances, root, sample_time_s),
                zeros=zeros,
                cancelling=tuple((int(i), int(j)) for i, j in near),
            )
        )
    return tuple(maps)


def _time_constant_std(
    distances: ComplexArray, root: FloatArray, sample_time_s: float
) -> FloatArray:
    """Return the standard deviations of the time constants of real poles between 0 and 1."""
    m = root.shape[0]
    deviations = np.full(distances.size, np.nan)
    for i, w in enumerate(distances):
        if w.imag != 0.0 or not 0.0 < w.real < 1.0:
            continue
        pole = 1.0 - w.real
        slope = prod(complex(v) for v in np.delete(distances, i) - w).real  # of the denominator
        if slope == 0.0:
            continue
        by_b = -(pole ** np.arange(m - 1, -1, -1.0)) / slope
        by_pole = sample_time_s / (pole * np.log1p(-w.real) ** 2)
        deviations[i] = by_pole * float(np.linalg.norm(by_b @ root))
    return deviations
