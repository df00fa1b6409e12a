"""Levels of targets plus smooth functions of time, by banded linear algebra.

The model of a reading k at position p, taken at time t, is

    y = level + sum over c of shape_c(p) f_c(t) + noise

with f_c cubic splines on equal intervals. Their curvature is penalised; as random functions they
are integrated random walks. Straight lines are not penalised, nor are steps at stated times. The
penalty is stated as the prior root mean square departure of f_c from its straight line, in units
of the noise.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cache
from typing import Any, TypeAlias, final

import numpy as np
from numpy.typing import NDArray

from thermaxis.positioning.run import FloatArray

IntArray: TypeAlias = NDArray[np.intp]

ORDER = 4
"""Splines that overlap on an interval: cubic. [1]"""
_PIECES = (
    np.array(
        [[1.0, -3.0, 3.0, -1.0], [4.0, 0.0, -6.0, 3.0], [1.0, 3.0, 3.0, -3.0], [0.0, 0.0, 0.0, 1.0]]
    )
    / 6.0
)
"""The four splines of an interval as polynomials of the place in it, powers 0 ... 3. [1]"""
_COARSE_INTERVALS = 48
_ROUND_OFF = 1e-14
"""Share of the sum of squares that rounding alone leaves over. [1]"""
_TINY = 1e-300
_SAME_TIME = 1e-9
"""Times that differ by less, as a share of the run, are one. [1]"""
_LEAST_GAP = 1e-3
"""Readings at one time are taken to be this share of the mean gap apart. [1]"""
_BLOCK = 512
"""Readings that are made white together. [1]"""
_TAIL = 1e-17
"""Share of a column below which what it leaves to later readings is rounding. [1]"""
_AT_ONCE = 2000
"""Readings whose leverages are worked out together. [1]"""


@cache
def _lapack() -> Any:
    """Return the module without its annotations, which are incomplete."""
    from scipy.linalg import lapack  # noqa: PLC0415 - it takes longer to import than most runs take

    return lapack


def _found(result: FloatArray, status: int) -> FloatArray:
    if status:
        raise np.linalg.LinAlgError(f"not positive definite: {status}")
    return result


def _banded_factor(band: FloatArray) -> FloatArray:
    """Return the Cholesky factor of a matrix in lower banded storage."""
    return _found(*_lapack().dpbtrf(band, lower=1))


def _banded_solve(factor: FloatArray, right: FloatArray) -> FloatArray:
    return _found(*_lapack().dpbtrs(factor, right, lower=1))


def _full_factor(matrix: FloatArray) -> FloatArray:
    return _found(*_lapack().dpotrf(matrix, lower=1, clean=0))


def _full_solve(factor: FloatArray, right: FloatArray) -> FloatArray:
    return _found(*_lapack().dpotrs(factor, right, lower=1))


def generalised_eigenvalues(
    matrix: FloatArray, metric: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return the eigenvalues of a matrix, rising, and vectors of unit length by the metric."""
    value, vector, status = _lapack().dsygvd(matrix, metric, uplo="L")
    return value, _found(vector, status)


def dense_of(band: FloatArray) -> FloatArray:
    """Return a symmetric matrix in lower banded storage as a full one."""
    size = band.shape[1]
    lower = sum(np.diag(band[k, : size - k], -k) for k in range(1, band.shape[0]))
    return np.diag(band[0]) + lower + np.asarray(lower).T


def sums_per(index: IntArray, value: FloatArray, size: int) -> FloatArray:
    """Return the sum of the values of every index."""
    return np.asarray(np.bincount(index, value, size), dtype=np.float64)


@final
@dataclass(frozen=True, slots=True)
class Step:
    """A step of one function of time, of any size."""

    time: float
    """When, as a fraction of the run. [1]"""
    shape: int
    """Index of the function that jumps. [1]"""
    sure: bool = True
    """Whether the run tells it from a drift over a pause."""

    def at(self, time: FloatArray) -> FloatArray:
        """Return one after the step and zero before; a time that is the step's lies before it."""
        return np.asarray(time > self.time + _SAME_TIME, dtype=np.float64)


@final
@dataclass(frozen=True, slots=True)
class Correlation:
    """Noise with a part that all positions share and whose correlation decays with time."""

    length: float
    """Time in which it falls to 1/e, as a fraction of the run. [1]"""
    ratio: float
    """Its variance over that of the independent part. [1]"""
    gain: float = 0.0
    """What it takes from minus twice the logarithm of the restricted likelihood."""


@final
@dataclass(frozen=True, slots=True, eq=False)
class Readings:
    """Readings of one run in any order."""

    value: FloatArray
    """What was read, (N,). [µm or arcsec]"""
    level: IntArray
    """Index of the level of each reading, 0 ... L - 1, (N,). [1]"""
    time: FloatArray
    """Time of each reading as a fraction of the run, 0 ... 1, (N,). [1]"""
    shape: FloatArray
    """Value of every shape at the position of each reading, (C, N); alike for all readings of a
    level. [1]"""
    weight: FloatArray
    """Weight of each reading, inverse to its variance, (N,). [1]"""
    levels: int
    """Number L of levels. [1]"""
    steps: tuple[Step, ...] = ()
    """Steps of the functions, (E,)."""
    correlation: Correlation | None = None
    """That of the noise, unless it is independent."""

    def of(self, chosen: IntArray) -> "Readings":
        """Return some of the readings."""
        rows = {
            k: getattr(self, k)[..., chosen] for k in ("value", "level", "time", "shape", "weight")
        }
        return replace(self, **rows)

    @property
    def columns(self) -> list[FloatArray]:
        """What each reading has of every step of unit size, (N,) each."""
        return [self.shape[step.shape] * step.at(self.time) for step in self.steps]


def spline_values(time: FloatArray, intervals: int) -> tuple[IntArray, FloatArray]:
    """Return the four cubic B-splines that do not vanish at each time."""
    first, x = _within(time, intervals)
    return first, np.stack((np.ones_like(x), x, x**2, x**3), axis=1) @ _PIECES.T


def _within(time: FloatArray, intervals: int) -> tuple[IntArray, FloatArray]:
    """Return the interval of each time and the place in it, 0 ... 1."""
    scaled = time * intervals
    first: IntArray = np.clip(np.floor(scaled).astype(np.intp), 0, intervals - 1)
    return first, scaled - first


def warped(time: FloatArray, warm_up: float, plain: float = 0.5) -> FloatArray:
    """Return the time in which the functions are smooth, 0 ... 1.

    Warming is fast at first and slow later. In logarithmic time a sum of such relaxations is
    smooth throughout, in plain time it is not; what else happens later is smooth in plain time.
    """
    if warm_up == 0.0:
        return time
    return (1.0 - plain) * (np.log1p(warm_up * time) / np.log1p(warm_up)) + plain * time


def slowest_rate(warm_up: float, plain: float = 0.5) -> float:
    """Return how fast the time of `warped` runs at the end of the run, where it is slowest."""
    if warm_up == 0.0:
        return 1.0
    rate = warm_up / ((1.0 + warm_up) * float(np.log1p(warm_up)))
    return (1.0 - plain) * rate + plain


def curvature_energy(intervals: int) -> FloatArray:
    """Return the integral of the squared second derivative as a form of spline coefficients."""
    return _curvature(intervals) * _mean_square_departure()


def _curvature(intervals: int) -> FloatArray:
    h = 1.0 / intervals
    x = 0.5 + 0.5 * np.array([-1.0, 1.0]) / np.sqrt(3.0)  # Gauss, exact for this integrand
    second = np.stack((1 - x, 3 * x - 2, 1 - 3 * x, x), axis=1) / h**2
    energy = 0.5 * h * (second.T @ second)
    band = np.zeros((ORDER, intervals + 3))
    for i in range(ORDER):
        for j in range(i + 1):
            band[i - j, j : j + intervals] += energy[i, j]
    return band


@cache
def _mean_square_departure() -> float:
    """Return the mean square departure from a straight line of the unscaled random function."""
    n = _COARSE_INTERVALS
    energy = dense_of(_curvature(n))
    value, vector = np.linalg.eigh(energy)
    covariance = (vector[:, 2:] / value[2:]) @ vector[:, 2:].T
    time = np.linspace(0.0, 1.0, 4 * n + 1)
    rows = _spline_rows(time, n)
    line, _ = np.linalg.qr(np.stack((np.ones_like(time), time), axis=1))
    rows -= line @ (line.T @ rows)
    return float(np.sum((rows @ covariance) * rows)) / time.size


def _spline_rows(time: FloatArray, intervals: int) -> FloatArray:
    """Return the values of all splines of one function at each time, (N, K + 3)."""
    first, values = spline_values(time, intervals)
    rows = np.zeros((time.size, intervals + 3))
    rows[np.arange(time.size)[:, None], first[:, None] + np.arange(ORDER)] = values
    return rows


@final
@dataclass(frozen=True, slots=True, eq=False)
class Sums:
    """All that a fit needs of the readings: their number does not matter any more."""

    intervals: int
    """Number K of intervals. [1]"""
    warm_up: float
    """Of the time in which the functions are smooth. [1]"""
    plain: float
    """Share of plain time in it. [1]"""
    shapes: int
    """Number C of shapes. [1]"""
    readings: int
    """Number N of readings. [1]"""
    levels: int
    """Number L of levels. [1]"""
    steps: tuple[Step, ...]
    """Steps of the functions, (E,)."""
    normal: FloatArray
    """Levels and steps against each other, (L + E, L + E)."""
    level_sum: FloatArray
    """Levels and steps against readings, (L + E,)."""
    square: float
    """Weighted sum of squared readings."""
    gram: FloatArray
    """Splines against splines, lower banded, (4 C, C (K + 3)); coefficient k of shape c has
    the index C k + c."""
    right: FloatArray
    """Splines against readings, (C (K + 3),)."""
    cross: FloatArray
    """Levels and steps against splines, (L + E, C (K + 3))."""
    pinned: IntArray
    """Coefficients held at zero, one per shape: a constant f_c cannot be told from levels."""
    log_noise: float = 0.0
    """Logarithm of the determinant of the noise's correlation."""


def _add_moments(
    readings: Readings,
    time: FloatArray,
    shape: FloatArray,
    into: tuple[FloatArray, FloatArray, FloatArray],
) -> None:
    """Add the sums of a run from the moments of time in every interval and level.

    Within an interval a spline is a cubic, and a level has one position. So eleven sums per
    interval and level hold all that products of splines and shapes need.
    """
    gram, right, cross = into
    c_all = shape.shape[0]
    intervals = right.size // c_all - 3
    first, x = _within(time, intervals)
    cell = readings.level * intervals + first
    place = c_all * np.arange(intervals, dtype=np.intp)
    products = np.einsum("cl,dl->cdl", shape, shape).reshape(c_all**2, -1)
    by_power: list[FloatArray] = []
    power = readings.weight.copy()
    for p in range(2 * ORDER - 1):
        moment = sums_per(cell, power, readings.levels * intervals).reshape(-1, intervals)
        by_power.append((products @ moment).reshape(c_all, c_all, intervals))
        if p < ORDER:
            reading = sums_per(cell, power * readings.value, readings.levels * intervals)
            weighted = shape @ reading.reshape(-1, intervals)
            for i in range(ORDER):
                for c in range(c_all):
                    at = place + c_all * i + c
                    right[at] += _PIECES[i, p] * weighted[c]
                    cross[:, at] += _PIECES[i, p] * shape[c][:, None] * moment
        power *= x
    for i in range(ORDER):
        for j in range(i + 1):
            pieces = np.convolve(_PIECES[i], _PIECES[j])
            block = sum(k * moment for k, moment in zip(pieces, by_power, strict=True))
            for c in range(c_all):
                for d in range(c_all):
                    row = c_all * (i - j) + c - d
                    if row >= 0:
                        gram[row, place + c_all * j + d] += np.asarray(block)[c, d]


def sums_of(readings: Readings, intervals: int, warm_up: float, plain: float = 0.5) -> Sums:
    """Return the sums of the normal equations; the cost is proportional to the readings."""
    if readings.correlation is not None:
        return _correlated_sums(readings, intervals, warm_up, plain)
    shape = np.zeros((readings.shape.shape[0], readings.levels))
    shape[:, readings.level] = readings.shape
    c_all, size = shape.shape[0], shape.shape[0] * (intervals + 3)
    w, y = readings.weight, readings.value
    n_levels, fixed = readings.levels, readings.levels + len(readings.steps)
    gram = np.zeros((ORDER * c_all, size))
    right = np.zeros(size)
    cross = np.zeros((fixed, size))
    time = warped(readings.time, warm_up, plain)
    _add_moments(readings, time, shape, (gram, right, cross[:n_levels]))
    normal, level_sum = np.zeros((fixed, fixed)), np.zeros(fixed)
    normal[range(n_levels), range(n_levels)] = sums_per(readings.level, w, n_levels)
    level_sum[:n_levels] = sums_per(readings.level, w * y, n_levels)
    columns = readings.columns
    for k, step in enumerate(columns, start=n_levels):
        column = w * step
        normal[k, :n_levels] = normal[:n_levels, k] = sums_per(readings.level, column, n_levels)
        normal[k, n_levels:] = [column @ other for other in columns]
        level_sum[k] = column @ y
        within, all_one = spline_values(time, intervals), np.zeros_like(readings.level)
        cross[k] = against_splines(readings, within, column, all_one, 1)[:, 0]
    pinned = _pinned(c_all, intervals)
    _pin(gram, right, cross, pinned)
    return Sums(
        intervals=intervals,
        warm_up=warm_up,
        plain=plain,
        shapes=c_all,
        readings=y.size,
        levels=n_levels,
        steps=readings.steps,
        normal=normal,
        level_sum=level_sum,
        square=float(np.sum(w * y * y)),
        gram=gram,
        right=right,
        cross=cross,
        pinned=pinned,
    )


def against_splines(
    readings: Readings,
    within: tuple[IntArray, FloatArray],
    column: FloatArray,
    part: IntArray,
    parts: int,
) -> FloatArray:
    """Return the products of a weighted column with all splines, per part, (C (K + 3), parts).

    `within` are the spline values at the times of the readings.
    """
    first, values = within
    c_all = readings.shape.shape[0]
    size = c_all * (int(np.max(first)) + ORDER) * parts
    products = np.zeros(size)
    for c in range(c_all):
        for i in range(ORDER):
            at = (c_all * (first + i) + c) * parts + part
            products += sums_per(at, column * readings.shape[c] * values[:, i], size)
    return products.reshape(-1, parts)


def _products(
    readings: Readings, intervals: int, time: FloatArray, own: Callable[[IntArray], FloatArray]
) -> tuple[FloatArray, float]:
    """Return the products of all columns with correlated noise, and its log|R|.

    The columns are those of `_columns`, then what `own` returns for some of the readings.

    Notes
    -----
    With the weights W, the ratio q and K = exp(-|t_i - t_j| / length) the noise has the covariance
    R = W^-1 + q K. With A x = x_i - exp(-(t_i - t_(i-1)) / length) x_(i-1) and A K A' = D,

        M = A W^-1 A' + q D = L E L',    R^-1 = A' M^-1 A,    |R| = |M| = |E|,

    where M has three diagonals and L two. So E^-1/2 L^-1 A x follows reading by reading from x, and
    forgets what lies far back: in a block of readings few splines differ from zero. The constant
    |W| is left out.
    """
    correlation = readings.correlation or Correlation(1.0, 1.0)
    order = np.argsort(readings.time, kind="stable")
    w, at = readings.weight[order], readings.time[order]
    gap = np.maximum(np.diff(at), _LEAST_GAP / w.size) / correlation.length
    decay, left = np.append(0.0, np.exp(-gap)), np.append(1.0, -np.expm1(-2.0 * gap))
    three = 1.0 / w + decay**2 / np.roll(w, 1) + correlation.ratio * left
    diagonal, below, status = _lapack().dpttrf(three, -decay[1:] / w[:-1])
    scale, below = np.sqrt(_found(diagonal, status)), np.append(below, 0.0)
    product = carried = np.zeros((0, 0))
    for start in range(0, w.size, _BLOCK):
        part = slice(start, start + _BLOCK)
        rows = order[part]
        columns = np.column_stack((_columns(readings.of(rows), intervals, time[rows]), own(rows)))
        if start == 0:
            product, carried = np.zeros((columns.shape[1],) * 2), np.zeros((2, columns.shape[1]))
        active = np.flatnonzero(np.any(columns, axis=0) | np.any(np.abs(carried) > _TAIL, axis=0))
        before, last = carried[:, active]
        own_columns = columns[:, active]
        carried = np.zeros_like(carried)
        carried[0, active] = own_columns[-1]
        own_columns[1:] -= decay[part][1:, None] * columns[:-1, active]
        own_columns[0] -= decay[start] * before + below[start - 1] * last
        lower = np.stack((np.ones(rows.size), below[part]))
        white = _found(*_lapack().dtbtrs(lower, own_columns, uplo="L", diag="U"))
        carried[1, active] = white[-1]
        white /= scale[part, None]
        product[np.ix_(active, active)] += white.T @ white
    return product, float(np.sum(np.log(diagonal)) + np.sum(np.log(w)))


def _pinned(shapes: int, intervals: int) -> IntArray:
    return shapes * ((intervals + 3) // 2) + np.arange(shapes, dtype=np.intp)


def _columns(part: Readings, intervals: int, time: FloatArray) -> FloatArray:
    """Return levels, steps, splines and values of readings as columns."""
    c_all, number = part.shape.shape[0], part.value.size
    rows = _spline_rows(time, intervals)
    fixed = part.levels + len(part.steps)
    columns = np.zeros((number, fixed + c_all * rows.shape[1] + 1))
    columns[np.arange(number), part.level] = 1.0
    for e, step in enumerate(part.columns, start=part.levels):
        columns[:, e] = step
    for c in range(c_all):
        columns[:, fixed + c : -1 : c_all] = rows * part.shape[c][:, None]
    columns[:, fixed + _pinned(c_all, intervals)] = 0.0
    columns[:, -1] = part.value
    return columns


def _correlated_sums(readings: Readings, intervals: int, warm_up: float, plain: float) -> Sums:
    c_all, fixed = readings.shape.shape[0], readings.levels + len(readings.steps)
    time = warped(readings.time, warm_up, plain)
    product, log_noise = _products(readings, intervals, time, lambda _: np.zeros((_.size, 0)))
    gram = product[fixed:-1, fixed:-1]
    pinned = _pinned(c_all, intervals)
    gram[pinned, pinned] = 1.0
    return Sums(
        intervals=intervals,
        warm_up=warm_up,
        plain=plain,
        shapes=c_all,
        readings=readings.value.size,
        levels=readings.levels,
        steps=readings.steps,
        normal=product[:fixed, :fixed],
        level_sum=product[:fixed, -1],
        square=float(product[-1, -1]),
        gram=_band_of(gram, ORDER * c_all),
        right=product[fixed:-1, -1],
        cross=product[:fixed, fixed:-1],
        pinned=pinned,
        log_noise=log_noise,
    )


def _band_of(matrix: FloatArray, fewest: int) -> FloatArray:
    """Return a symmetric matrix in lower banded storage, without what is rounding."""
    row, column = np.nonzero(np.abs(matrix) > _ROUND_OFF * np.max(np.abs(matrix)))
    width = max(fewest, int(np.max(row - column)) + 1)
    band = np.zeros((width, matrix.shape[0]))
    for k in range(width):
        band[k, : matrix.shape[0] - k] = np.diag(matrix, -k)
    return band


def _pin(gram: FloatArray, right: FloatArray, cross: FloatArray, pinned: IntArray) -> None:
    right[pinned] = 0.0
    cross[:, pinned] = 0.0
    _pin_band(gram, pinned, diagonal=1.0)


def _pin_band(band: FloatArray, pinned: IntArray, *, diagonal: float) -> None:
    for p in pinned.tolist():
        band[:, p] = 0.0
        for row in range(1, band.shape[0]):
            if p - row >= 0:
                band[row, p - row] = 0.0
        band[0, p] = diagonal


def penalty_of(intervals: int) -> FloatArray:
    """Return the energy of one function with its pinned coefficient left out, (4, K + 3)."""
    band = curvature_energy(intervals)
    _pin_band(band, np.array([(intervals + 3) // 2]), diagonal=0.0)
    return band


@final
@dataclass(frozen=True, slots=True, eq=False)
class Fit:
    """Levels and splines for one smoothness."""

    sums: Sums
    spline_factor: FloatArray
    """Cholesky factor of splines against splines with penalty, lower banded."""
    spline_of_level: FloatArray
    """What the splines take from the levels, (C (K + 3), L)."""
    level_factor: FloatArray
    """Cholesky factor of what is left to the levels."""
    level: FloatArray
    """Levels where all splines vanish, and sizes of steps, (L + E,)."""
    spline: FloatArray
    """Spline coefficients, (C (K + 3),)."""
    variance: float
    """Estimated variance of a reading of weight one."""
    criterion: float
    """Minus twice the restricted log-likelihood."""
    log_determinant: float
    """Logarithm of the determinant of the normal equations."""


def fit(sums: Sums, penalty: FloatArray, departure: FloatArray) -> Fit:
    """Fit levels and splines for a given smoothness.

    Notes
    -----
    Splines s of C functions and levels l solve, with the readings' sums G = S'S, X = L'S and the
    penalty P of rank r (the number of splines less two),

        B = G + P / departure^2,    (L'L - X B^-1 X') l = L'y - X B^-1 S'y,    B s = S'y - X' l.

    E steps are columns of L of their own. With f = readings - levels - C and
    v = (y'y - l'L'y - s'S'y) / (f - E), minus twice the restricted log-likelihood is, but for a
    constant,

        criterion = f log v + log|B| + log|L'L - X B^-1 X'| + 2 r sum over C of log departure.

    With correlated noise log|R| joins it. A step's size in units of the noise has a flat prior:
    hence f, not f - E, before log v.
    """
    c_all = sums.shapes
    band = sums.gram.copy()
    for c in range(c_all):
        band[: ORDER * c_all : c_all, c::c_all] += penalty / departure[c] ** 2
    factor = _banded_factor(band)
    solved = _banded_solve(factor, np.vstack((sums.right, sums.cross)).T)
    spline_right, spline_of_level = solved[:, 0], solved[:, 1:]
    left = sums.normal - sums.cross @ spline_of_level
    level_factor = _full_factor(left)
    level = _full_solve(level_factor, sums.level_sum - sums.cross @ spline_right)
    spline = spline_right - spline_of_level @ level
    free = sums.readings - sums.levels - c_all
    left_over = sums.square - float(level @ sums.level_sum) - float(spline @ sums.right)
    variance = max(left_over, _ROUND_OFF * sums.square, _TINY) / (free - len(sums.steps))
    log_determinant = 2.0 * float(np.sum(np.log(factor[0])) + np.sum(np.log(np.diag(level_factor))))
    rank = sums.intervals + 1
    prior = -2.0 * rank * float(np.sum(np.log(departure)))
    return Fit(
        sums=sums,
        spline_factor=factor,
        spline_of_level=spline_of_level,
        level_factor=level_factor,
        level=level,
        spline=spline,
        variance=variance,
        criterion=free * float(np.log(variance)) + log_determinant - prior + sums.log_noise,
        log_determinant=log_determinant,
    )


def parameters_of(sums: Sums, penalty: FloatArray, departure: FloatArray) -> float:
    """Return the effective number of parameters of the functions for a given smoothness.

    Notes
    -----
    The trace of the inverse normal equations times the penalty is the derivative of the logarithm
    of their determinant by that of the penalty's factor; it is taken by central differences.
    """
    step = 0.01
    total = sums.shapes * (sums.intervals + 2.0)
    for c in range(sums.shapes):
        change = np.ones(sums.shapes)
        change[c] = np.exp(-0.5 * step)  # the penalty's factor is departure to the power -2
        up = fit(sums, penalty, departure * change).log_determinant
        down = fit(sums, penalty, departure / change).log_determinant
        total -= (up - down) / (2.0 * step)
    return total


def rows_at(sums: Sums, time: FloatArray, reference: float | None = None) -> FloatArray:
    """Return the values of all splines of one function, then of all steps, (T, K + 3 + E).

    With a reference time they are relative to those at it.
    """
    splines = _spline_rows(warped(time, sums.warm_up, sums.plain), sums.intervals)
    rows = np.column_stack((splines, *(step.at(time) for step in sums.steps)))
    return rows if reference is None else rows - rows_at(sums, np.array([reference]))


def _combined(sums: Sums, rows: FloatArray, shape: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return rows times shapes, (C, T), as combinations of levels with steps and of splines."""
    n = sums.intervals + 3
    level = np.zeros((sums.level_sum.size, rows.shape[0]))
    spline = np.zeros((sums.right.size, rows.shape[0]))
    for c in range(sums.shapes):
        spline[c :: sums.shapes] = rows[:, :n].T * shape[c]
    spline[sums.pinned] = 0.0
    for e, step in enumerate(sums.steps):
        level[sums.levels + e] = rows[:, n + e] * shape[step.shape]
    return level, spline


def solved(
    fitted: Fit, level: FloatArray, spline: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return three parts of the covariance of linear combinations, without the noise's variance.

    With combinations l of levels and steps, (L + E, T), and s of splines, (C (K + 3), T), and the
    matrices of `fit`: B^-1 s, t = l - X B^-1 s and M^-1 t. The covariance is s' B^-1 s + t' M^-1 t.
    """
    through_splines = _banded_solve(fitted.spline_factor, spline)
    through = level - fitted.sums.cross @ through_splines
    return through_splines, through, _full_solve(fitted.level_factor, through)


def levels_at(
    fitted: Fit, row: FloatArray, shape_of_level: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return the levels at the time of a row of spline values, and their covariance.

    Notes
    -----
    With the splines R of the levels at that time, the product of the row and of their shapes, and
    I the unit matrix above the steps at that time, the levels are I'l + R's. With T = I - X B^-1 R
    and M the matrix that `fit` solves for l, their covariance is the noise's variance times
    R' B^-1 R + T' M^-1 T.
    """
    sums = fitted.sums
    rows = np.broadcast_to(row, (sums.levels, row.size))
    own, spline = _combined(sums, rows, shape_of_level)
    own[range(sums.levels), range(sums.levels)] = 1.0
    level = own.T @ fitted.level + spline.T @ fitted.spline
    through_splines, through, back = solved(fitted, own, spline)
    return level, fitted.variance * (spline.T @ through_splines + through.T @ back)


def functions_at(fitted: Fit, rows: FloatArray) -> FloatArray:
    """Return the functions of time for rows of spline values, (C, T)."""
    sums, n = fitted.sums, fitted.sums.intervals + 3
    value = np.stack([rows[:, :n] @ fitted.spline[c :: sums.shapes] for c in range(sums.shapes)])
    for e, step in enumerate(sums.steps):
        value[step.shape] += rows[:, n + e] * fitted.level[sums.levels + e]
    return value


def variances_at(fitted: Fit, rows: FloatArray) -> FloatArray:
    """Return the variances of the functions of time for rows of spline values, (C, T)."""
    sums = fitted.sums
    variance = np.empty((sums.shapes, rows.shape[0]))
    few = rows.shape[0] < rows.shape[1]
    own = rows if few else np.eye(rows.shape[1])  # each spline and step by itself
    for c in range(sums.shapes):
        alone = np.zeros((sums.shapes, own.shape[0]))
        alone[c] = 1.0
        level, spline = _combined(sums, own, alone)
        through_splines, through, back = solved(fitted, level, spline)
        if few:
            variance[c] = np.sum(spline * through_splines, axis=0) + np.sum(through * back, axis=0)
        else:
            covariance = spline.T @ through_splines + through.T @ back
            variance[c] = np.sum((rows @ covariance) * rows, axis=1)
    return fitted.variance * np.maximum(variance, 0.0)


def drift_of(fitted: Fit, readings: Readings, reference: float | None) -> FloatArray:
    """Return the drift of every reading relative to a reference time, or to the levels of `fit`."""
    sums = fitted.sums
    first, values = spline_values(warped(readings.time, sums.warm_up, sums.plain), sums.intervals)
    start = np.zeros((sums.shapes, 1))
    if reference is not None:
        start = functions_at(fitted, rows_at(sums, np.array([reference])))
    drift = np.zeros(readings.value.size)
    for c in range(sums.shapes):
        own = fitted.spline[c :: sums.shapes]
        value = np.full(first.size, -start[c, 0])
        for i in range(ORDER):
            value += values[:, i] * own[first + i]
        for e, step in enumerate(sums.steps):
            if step.shape == c:
                value += fitted.level[sums.levels + e] * step.at(readings.time)
        drift += readings.shape[c] * value
    return drift


def residual_of(fitted: Fit, readings: Readings) -> FloatArray:
    """Return what the levels and the functions of a fit leave of the readings, (N,)."""
    return readings.value - fitted.level[readings.level] - drift_of(fitted, readings, None)


def left_by(
    fitted: Fit, readings: Readings, part: IntArray, rows: Sequence[FloatArray]
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return what k rows hold in every part of the readings, without the noise's variance.

    These are their products with each other, (parts, k, k), and with what the fit leaves,
    (parts, k), and what the fit takes of the former.
    """
    parts = int(np.max(part)) + 1
    own = _of_parts if readings.correlation is None else _of_correlated_parts
    product, right, level, spline = own(fitted.sums, readings, part, rows)
    score = np.empty((parts, len(rows)))
    taken = np.empty_like(product)
    through = [solved(fitted, level[k], spline[k]) for k in range(len(rows))]
    for k in range(len(rows)):
        score[:, k] = right[:, k] - fitted.level @ level[k] - fitted.spline @ spline[k]
        for j in range(len(rows)):
            taken[:, j, k] = np.sum(spline[j] * through[k][0], axis=0)
            taken[:, j, k] += np.sum(through[j][1] * through[k][2], axis=0)
    return product, score, taken


_Parts: TypeAlias = tuple[FloatArray, FloatArray, list[FloatArray], list[FloatArray]]
"""Products of rows with each other, (parts, k, k), with the values, (parts, k), and for each row
with levels and steps, (L + E, parts), and splines, (C (K + 3), parts)."""


def _of_parts(sums: Sums, readings: Readings, part: IntArray, rows: Sequence[FloatArray]) -> _Parts:
    parts = int(np.max(part)) + 1
    within = spline_values(warped(readings.time, sums.warm_up, sums.plain), sums.intervals)
    product = np.empty((parts, len(rows), len(rows)))
    right = np.empty((parts, len(rows)))
    levels: list[FloatArray] = []
    splines: list[FloatArray] = []
    for k, row in enumerate(rows):
        weighted = readings.weight * row
        right[:, k] = sums_per(part, weighted * readings.value, parts)
        for j, other in enumerate(rows):
            product[:, j, k] = sums_per(part, weighted * other, parts)
        level = sums_per(part * sums.levels + readings.level, weighted, parts * sums.levels)
        steps = [sums_per(part, weighted * step, parts) for step in readings.columns]
        levels.append(np.vstack((level.reshape(parts, -1).T, *steps)))
        splines.append(against_splines(readings, within, weighted, part, parts))
        splines[-1][sums.pinned] = 0.0
    return product, right, levels, splines


def _of_correlated_parts(
    sums: Sums, readings: Readings, part: IntArray, rows: Sequence[FloatArray]
) -> _Parts:
    parts, k_all = int(np.max(part)) + 1, len(rows)

    def own(chosen: IntArray) -> FloatArray:
        alone = np.zeros((chosen.size, parts, k_all))
        alone[np.arange(chosen.size), part[chosen]] = np.stack([row[chosen] for row in rows], 1)
        return alone.reshape(chosen.size, -1)

    product = with_correlated_noise(sums, readings, own)
    end = product.shape[0] - parts * k_all
    of_own = product[end:, end:].reshape(parts, k_all, parts, k_all)
    number = np.arange(parts)
    through = product[:end, end:].reshape(end, parts, k_all)
    fixed = sums.level_sum.size
    levels = [through[:fixed, :, k] for k in range(k_all)]
    splines = [through[fixed:-1, :, k] for k in range(k_all)]
    return of_own[number, :, number], through[-1], levels, splines


def with_correlated_noise(
    sums: Sums, readings: Readings, own: Callable[[IntArray], FloatArray]
) -> FloatArray:
    """Return the products of levels, steps, splines, values and the columns of `own`."""
    time = warped(readings.time, sums.warm_up, sums.plain)
    return _products(readings, sums.intervals, time, own)[0]


def leverages_of(fitted: Fit, readings: Readings) -> FloatArray:
    """Return how far the fit follows each reading: 0 not at all, 1 wherever it goes."""
    sums = fitted.sums
    leverage = np.empty(readings.value.size)
    for start in range(0, leverage.size, _AT_ONCE):
        part = slice(start, start + _AT_ONCE)
        rows = rows_at(sums, readings.time[part])
        level, spline = _combined(sums, rows, readings.shape[:, part])
        level[readings.level[part], np.arange(rows.shape[0])] = 1.0
        through_splines, through, back = solved(fitted, level, spline)
        leverage[part] = np.sum(spline * through_splines, axis=0) + np.sum(through * back, axis=0)
    variance = 1.0 if readings.correlation is None else 1.0 + readings.correlation.ratio
    return np.clip(leverage * readings.weight / variance, 0.0, 1.0)
