"""Output error: transfer functions whose free run is nearest to the measured displacement."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import final

import numpy as np
from scipy.linalg import solve_toeplitz  # pyright: ignore[reportUnknownVariableType] - no types

from thermaxis.codes import Message
from thermaxis.errors import ConfigurationError, DataError
from thermaxis.thermal._arrays import FloatArray, frozen_array, significant
from thermaxis.thermal.log import FEWEST_READINGS, Experiment, common_shape
from thermaxis.thermal.transfer_function._arx import (
    block_means,
    per_input,
    pole_warnings,
    triangle,
)
from thermaxis.thermal.transfer_function._cascade import (
    basis_polynomials,
    cascade_of,
    filtered,
    later,
    output_of,
    stage_outputs,
)
from thermaxis.thermal.transfer_function._figures import fit_percent
from thermaxis.thermal.transfer_function._oe_start import (
    OeOrders,
    denominators_to_start,
    lags_are_one,
    stabilised,
)
from thermaxis.thermal.transfer_function._order_search import (
    HIGHEST_ORDER,
    Block,
    blocks_of_rows,
    search_orders,
)
from thermaxis.thermal.transfer_function._polynomial_model import (
    OrderTrial,
    PolynomialModel,
    PolynomialResult,
    Start,
    TransferFunction,
    common_sample_time_s,
    held,
    names_of_inputs,
)
from thermaxis.thermal.transfer_function._residuals import correlation
from thermaxis.thermal.transfer_function._roots import distances_from_one

MOST_ITERATIONS = 100
"""Steps of the iteration. [1]"""
FIRST_ITERATIONS = 6
"""Steps from each of the best starts before one is chosen. [1]"""
SEARCH_ITERATIONS = 20
"""Steps of each fit of the search of orders. [1]"""
LEFT_OUT_ITERATIONS = 4
"""Steps by which a fit changes where a block is left out. [1]"""
STARTS_TRIED = 3
"""Starts from which the iteration begins. [1]"""
COARSE_ROWS = 1000
"""Rows to which block means bring long tests, at least, for the start of the iteration. [row]"""
SEARCH_ROWS = 500
"""Rows to which block means bring the tests for the search of orders. [row]"""
LONGEST_TIME_CONSTANT = 20.0
"""Time constants end here, in durations of the longest test. [1]"""
COVARIANCE_BLOCKS = 2000
"""Block means from which the colour of the residual is taken, at most. [1]"""
HIGHEST_COLOUR = 12
"""Highest order of the autoregression that describes the colour of the residual. [1]"""
LARGEST_RELATIVE_STD = 0.25
"""Standard deviation over DC gain above which the record does not determine it. [1]"""
_FEWEST_BLOCKS = 20
_CONVERGED = 1e-12
_EXACT = 1e-28
_RANK = 1e-11
_LEAST_DAMPING, _FIRST_DAMPING, _MOST_DAMPING = 1e-15, 1e-3, 1e8


@final
@dataclass(frozen=True, slots=True)
class OeOptions:
    """What else output error is told."""

    start: Start = Start.STEADY
    """What is known of the time before the first row of every test."""
    noise_order: int = 0
    """Order p of an autoregression of the noise (Box-Jenkins structure); 0 is white noise. [1]"""
    constant: bool = False
    """Whether the displacement has an offset."""
    lead_in_rows: int = 0
    """Rows at the start of every test that are simulated and not compared. [row]"""


@final
@dataclass(frozen=True, slots=True, eq=False)
class _Problem:
    """Tests and structure; `theta` holds a and b of every input, offset, phi, initial states."""

    tests: tuple[tuple[FloatArray, FloatArray], ...]
    """Held inputs and displacement of every test."""
    orders: OeOrders
    options: OeOptions
    noise: int
    """Order of the noise's autoregression. [1]"""
    slowest: float
    """Largest modulus of a pole. [1]"""
    states: tuple[int, ...] = field(default=())
    """Free states of every input in every test."""
    lags: bool = False
    """Whether every pole is to be a lag, as in the search of orders."""

    @property
    def inputs(self) -> int:
        return len(self.orders.nb)

    def above(self, i: int) -> slice:
        """Return where the coefficients of a numerator stand."""
        first = sum(self.orders.nb[:i]) + sum(self.orders.nf[:i])
        return slice(first, first + self.orders.nb[i])

    def below(self, i: int) -> slice:
        """Return where those of a denominator stand: behind the numerator's."""
        first = self.above(i).stop
        return slice(first, first + self.orders.nf[i])

    def numerator(self, theta: FloatArray, i: int) -> FloatArray:
        return np.concatenate([np.zeros(self.orders.nk[i]), theta[self.above(i)]])

    def denominator(self, theta: FloatArray, i: int) -> FloatArray:
        return np.concatenate([[1.0], theta[self.below(i)]])

    @property
    def coefficients(self) -> int:
        return sum(self.orders.nb) + sum(self.orders.nf)

    @property
    def structural(self) -> int:
        """Parameters without initial states."""
        return self.coefficients + self.options.constant + self.noise

    @property
    def size(self) -> int:
        return self.structural + len(self.tests) * sum(self.states)

    def phi(self, theta: FloatArray) -> FloatArray:
        return theta[self.structural - self.noise : self.structural]

    def initial(self, test: int, i: int) -> slice:
        """Return where the initial states of an input in a test stand."""
        first = self.structural + test * sum(self.states) + sum(self.states[:i])
        return slice(first, first + self.states[i])


def _first(problem: _Problem, values: FloatArray) -> float:
    return float(values[0]) if problem.options.start is Start.STEADY else 0.0


def _part_output(problem: _Problem, theta: FloatArray, test: int, i: int) -> FloatArray:
    u = np.ascontiguousarray(problem.tests[test][0][:, i])
    a, b = problem.numerator(theta, i), problem.denominator(theta, i)
    y = output_of(a, b, u, _first(problem, u))
    initial = theta[problem.initial(test, i)]
    if initial.size:
        impulse = np.zeros(u.size)
        impulse[: initial.size] = initial[: u.size]
        y = y + output_of(np.ones(1), b, impulse, 0.0)
    return y


def _simulated(problem: _Problem, theta: FloatArray, test: int) -> FloatArray:
    offset = theta[problem.coefficients] if problem.options.constant else 0.0
    y = np.full(problem.tests[test][1].size, float(offset))
    for i in range(problem.inputs):
        y += _part_output(problem, theta, test, i)
    return y


def _innovations(problem: _Problem, theta: FloatArray, test: int) -> FloatArray:
    """Return what the model leaves of each row, NaN where a row does not count, (n,)."""
    v = problem.tests[test][1] - _simulated(problem, theta, test)
    e = v.copy()
    for j, phi in enumerate(problem.phi(theta), start=1):
        e -= phi * later(v, j, np.nan)
    e[: problem.options.lead_in_rows + problem.noise] = np.nan
    return e


def _sum_of_squares(problem: _Problem, theta: FloatArray) -> float:
    with np.errstate(over="ignore", invalid="ignore"):
        total = sum(
            float(np.nansum(_innovations(problem, theta, t) ** 2))
            for t in range(len(problem.tests))
        )
    return total if np.isfinite(total) else float("inf")


def _gradient(
    problem: _Problem, theta: FloatArray, test: int, *, linear: bool = False
) -> tuple[FloatArray, FloatArray]:
    """Return columns of the simulated displacement by the parameters, and the innovations.

    Numerators and denominators are taken in the polynomials of the cascade; `_to_coefficients`
    turns a step in their weights into one of the coefficients. With `linear` the denominators'
    columns are zero.
    """
    u_all, measured = problem.tests[test]
    n = measured.size
    columns = np.zeros((n, problem.size))
    for i in range(problem.inputs):
        b = problem.denominator(theta, i)
        u = np.ascontiguousarray(u_all[:, i])
        cascade = cascade_of(b)
        u = later(u, problem.orders.nk[i], _first(problem, u))
        nb, nf, states = problem.orders.nb[i], problem.orders.nf[i], problem.states[i]
        found = stage_outputs(cascade, u, _first(problem, u), nb)
        if nf and not linear:
            y = -_part_output(problem, theta, test, i)
            y = later(y, 1, _first(problem, y))
            found += stage_outputs(cascade, y, _first(problem, y), nf)
        for j, column in enumerate(found, start=problem.above(i).start):
            columns[:, j] = column
        if states:
            impulse = np.zeros(n)
            impulse[0] = 1.0
            response = output_of(np.ones(1), b, impulse, 0.0)
            for j in range(states):
                columns[:, problem.initial(test, i).start + j] = later(response, j, 0.0)
    if problem.options.constant:
        columns[:, problem.coefficients] = 1.0
    phi = problem.phi(theta)
    whitened = columns.copy()
    for j, value in enumerate(phi, start=1):
        whitened[j:] -= value * columns[:-j]
    v = measured - _simulated(problem, theta, test) if phi.size else measured
    for j in range(phi.size):
        whitened[:, problem.structural - phi.size + j] = later(v, j + 1, np.nan)
    return whitened, _innovations(problem, theta, test)


def _to_coefficients(problem: _Problem, theta: FloatArray) -> FloatArray:
    """Return the matrix that turns a step in the cascade's weights into one of coefficients."""
    matrix = np.eye(problem.size)
    for i in range(problem.inputs):
        cascade = cascade_of(problem.denominator(theta, i))
        for at in (problem.above(i), problem.below(i)):
            matrix[at, at] = basis_polynomials(cascade, at.stop - at.start)
    return matrix


def _factor(
    problem: _Problem, theta: FloatArray, *, linear: bool = False
) -> tuple[FloatArray, int]:
    """Return the triangular factor of gradient and innovations and the number of rows."""
    factor, rows = np.zeros((problem.size + 1, problem.size + 1)), 0
    for test in range(len(problem.tests)):
        columns, e = _gradient(problem, theta, test, linear=linear)
        counted = ~np.isnan(e)
        table = np.column_stack([columns[counted], e[counted]])
        factor = triangle([factor, table])
        rows += table.shape[0]
    return factor, rows


@final
@dataclass(frozen=True, slots=True, eq=False)
class _Decomposed:
    """Singular value decomposition of the scaled gradient."""

    scale: FloatArray
    values: FloatArray
    vectors: FloatArray
    right: FloatArray

    def step(self, damping: float) -> FloatArray:
        kept = self.values > _RANK * self.values[0]
        square = np.where(kept, self.values**2 + damping * self.values[0] ** 2, np.inf)
        return (self.vectors.T @ (self.values / square * self.right)) / self.scale

    def inverse_root(self) -> FloatArray:
        """Return P with P P' the inverse of the sum of products, where the rows determine it."""
        kept = self.values > _RANK * self.values[0]
        return (self.vectors[kept].T / self.values[kept]) / self.scale[:, None]


def _decompose(factor: FloatArray) -> _Decomposed:
    matrix, right = factor[:, :-1], factor[:, -1]
    norm = np.linalg.norm(matrix, axis=0)
    scale = np.where(norm > 0, norm, 1.0)
    left, values, vectors = np.linalg.svd(matrix / scale, full_matrices=False)
    return _Decomposed(scale, np.maximum(values, 1e-300), vectors, left.T @ right)


def _with_best_numerators(problem: _Problem, denominators: Sequence[FloatArray]) -> FloatArray:
    """Return the parameters whose linear ones fit best for given denominators."""
    theta, free = np.zeros(problem.size), np.ones(problem.size, dtype=np.bool_)
    for i, b in enumerate(denominators):
        theta[problem.below(i)], free[problem.below(i)] = b[1:], False
    factor, _ = _factor(problem, theta, linear=True)
    step = np.zeros(problem.size)
    step[free] = _decompose(factor[:, np.append(free, True)]).step(0.0)
    return theta + _to_coefficients(problem, theta) @ step


def _lags_are_one(problem: _Problem, theta: FloatArray) -> bool:
    return any(lags_are_one(problem.denominator(theta, i)) for i in range(problem.inputs))


def _stable(problem: _Problem, theta: FloatArray) -> FloatArray:
    moved = theta.copy()
    for i in range(problem.inputs):
        below = stabilised(problem.denominator(theta, i), problem.slowest, lags=problem.lags)
        moved[problem.below(i)] = below[1:]
    return moved


@final
@dataclass(frozen=True, slots=True, eq=False)
class _Iterated:
    theta: FloatArray
    cost: float
    converged: bool


def _iterate(problem: _Problem, theta: FloatArray, steps: int) -> _Iterated:
    """Damped Gauss-Newton; a step that leaves the stable region is brought back into it."""
    cost = _sum_of_squares(problem, theta)
    exact = _EXACT * sum(float(np.nansum(y**2)) for _, y in problem.tests)
    damping, quiet = _FIRST_DAMPING, 0
    for _ in range(steps):
        if cost <= exact:
            return _Iterated(theta, cost, converged=True)
        decomposed = _decompose(_factor(problem, theta)[0])
        matrix = _to_coefficients(problem, theta)
        while True:
            tried = _stable(problem, theta + matrix @ decomposed.step(damping))
            new_cost = _sum_of_squares(problem, tried)
            if new_cost < cost or damping > _MOST_DAMPING:
                break
            damping *= 10.0
        if new_cost >= cost:
            return _Iterated(theta, cost, converged=True)
        quiet = quiet + 1 if cost - new_cost <= _CONVERGED * cost else 0
        theta, cost = tried, new_cost
        damping = max(damping / 10.0, _LEAST_DAMPING)
        if quiet >= 2:
            return _Iterated(theta, cost, converged=True)
    return _Iterated(theta, cost, converged=False)


def _best_fit(
    problem: _Problem, experiments: Sequence[Experiment], steps: int = MOST_ITERATIONS
) -> _Iterated:
    """Iterate from the best starts, without colour first, then with it."""
    white = replace(problem, noise=0)
    starts = _coarse_start(problem, experiments) or denominators_to_start(
        experiments, problem.orders, problem.slowest, steady=problem.options.start is Start.STEADY
    )
    if problem.lags:
        starts = [[stabilised(b, problem.slowest, lags=True) for b in one] for one in starts]
    thetas = [_with_best_numerators(white, denominators) for denominators in starts]
    thetas.sort(key=lambda theta: _sum_of_squares(white, theta))
    first = [_iterate(white, theta, FIRST_ITERATIONS) for theta in thetas[:STARTS_TRIED]]
    best = min(first, key=lambda fit: fit.cost)
    if problem.noise:  # the best start under white noise need not be the best under coloured
        thetas = [*thetas, *(fit.theta for fit in first)]
        first = [_iterate(problem, _with_colour(problem, white, theta), 2) for theta in thetas]
        first.sort(key=lambda fit: fit.cost)
        first = [_iterate(problem, f.theta, FIRST_ITERATIONS) for f in first[:STARTS_TRIED]]
        best = min(first, key=lambda fit: fit.cost)
    return best if best.converged else _iterate(problem, best.theta, steps)


def _coarse_start(
    problem: _Problem, experiments: Sequence[Experiment]
) -> list[list[FloatArray]] | None:
    """Return the denominators that block means of long tests give; None for tests that are short.

    A mean over r rows of an input behind p is a mean behind p^r: poles near one are seen by means.
    """
    rows = max(e.y.size for e in experiments) // COARSE_ROWS
    if rows < 2 or not all(_long_enough(e, rows) for e in experiments):
        return None
    short = [block_means(e, rows) for e in experiments]
    orders = replace(problem.orders, nk=tuple(round(k / rows) for k in problem.orders.nk))
    options = replace(
        problem.options, noise_order=0, lead_in_rows=-(-problem.options.lead_in_rows // rows)
    )
    coarse = replace(_problem(short, orders, options), lags=problem.lags)
    theta = _best_fit(coarse, short).theta
    return [
        [
            np.asarray(
                np.poly(np.power(1.0 - distances_from_one(b), 1.0 / rows)), dtype=np.complex128
            ).real
            if (b := coarse.denominator(theta, i)).size > 1
            else b
            for i in range(coarse.inputs)
        ]
    ]


def _with_colour(problem: _Problem, white: _Problem, theta: FloatArray) -> FloatArray:
    """Add to the parameters an autoregression of what they leave over."""
    residuals = [_innovations(white, theta, t) for t in range(len(white.tests))]
    at = white.structural
    return np.concatenate([theta[:at], _autoregression(residuals, problem.noise), theta[at:]])


def _autoregression(series: Sequence[FloatArray], order: int) -> FloatArray:
    """Return the coefficients of an autoregression by the Yule-Walker equations, stable."""
    values, _ = correlation(series, series, order)
    own = values[order:].copy()
    if own[0] <= 0.0:
        return np.zeros(order)
    own[0] *= 1.0 + 1e-9
    phi = np.asarray(solve_toeplitz(own[:-1], own[1:]), dtype=np.float64)
    for _ in range(200):
        if np.all(np.abs(np.roots(np.concatenate([[1.0], -phi]))) < 1.0):
            break
        phi = phi * 0.98 ** np.arange(1, order + 1)
    return phi


def oe(
    experiments: Sequence[Experiment],
    nf: int | Sequence[int] | None = None,
    nb: int | Sequence[int] | None = None,
    nk: int | Sequence[int] = 0,
    *,
    input_names: Sequence[str] = (),
    options: OeOptions | None = None,
) -> PolynomialResult:
    """Identify transfer functions by output error: the free run is fitted.

    Parameters
    ----------
    experiments : sequence of Experiment
        Tests, fitted together; each starts anew.
    nf : int or sequence of int, optional
        Coefficients of the denominator per input (paper: m). Default: searched, 0 to 3. [1]
    nb : int or sequence of int, optional
        Coefficients of the numerator per input (paper: n + 1). Default: searched, m and m + 1. [1]
    nk : int or sequence of int
        Delay per input. Default: 0. [row]
    input_names : sequence of str
        Names of the inputs. Default: u1, u2, ...
    options : OeOptions, optional
        Start, colour of the noise, offset, rows that are not compared.

    Returns
    -------
    PolynomialResult
        One transfer function per input, always stable. The covariance allows for a coloured
        residual.

    Raises
    ------
    DataError
        If fewer rows count than there are parameters, or sample times or inputs differ.
    ConfigurationError
        If an order is negative, too large, or only one of nf and nb is given.

    Notes
    -----
    Missing displacements leave their rows out; missing inputs are held at their last value, so
    rows without an input still count. Starts: ARX, instrumental variables, both also with a common
    denominator of all inputs from which the strongest poles are kept, and real poles chosen on
    a logarithmic grid. From the best of them a damped Gauss-Newton iteration runs; poles that
    leave the stable region are reflected into it, and time constants end at twenty times the
    longest test. The optimum is local; that several starts lead to it is no proof.

    The default search is that of `arx`, with every pole a lag no slower than half the longest
    test, on block means of at most 500 rows per test. Long tests are fitted to block means first,
    whose poles p give those of the rows, p^(1/rows of a block).

    References
    ----------
    Mareš and Horejš 2021, equations (2) and (3). L. Ljung, System Identification (OE and BJ
    structures); K. Levenberg 1944, D. Marquardt 1963 (from memory).
    """
    chosen = options or OeOptions()
    inputs = common_shape(experiments)
    names = names_of_inputs(experiments, input_names)
    sample_time_s = common_sample_time_s(experiments)
    delays = per_input(nk, inputs, "nk")
    if not 0 <= chosen.noise_order <= HIGHEST_COLOUR or chosen.lead_in_rows < 0:
        raise ConfigurationError(
            "oe_options_outside",
            noise_order=chosen.noise_order,
            lead_in_rows=chosen.lead_in_rows,
            most=HIGHEST_COLOUR,
            key="options",
        )
    search: tuple[OrderTrial, ...] = ()
    searched = nf is None and nb is None
    if searched:
        search, orders = _search(experiments, delays, chosen)
    elif nf is None or nb is None:
        raise ConfigurationError("half_orders", names=("nf", "nb"), key="orders")
    else:
        orders = OeOrders(per_input(nf, inputs, "nf"), per_input(nb, inputs, "nb"), delays)
    problem = replace(_problem(experiments, orders, chosen), lags=searched)
    _check_rows(problem)
    fit = _best_fit(problem, experiments)
    while searched and _lags_are_one(problem, fit.theta):
        search, orders = _search(experiments, delays, chosen, barred_from=orders.nf[0])
        problem = replace(_problem(experiments, orders, chosen), lags=True)
        fit = _best_fit(problem, experiments)
    return _result(problem, fit, experiments, names, sample_time_s, search)


def _problem(experiments: Sequence[Experiment], orders: OeOrders, options: OeOptions) -> _Problem:
    longest_rows = max(e.y.size for e in experiments)
    states: tuple[int, ...] = (0,) * len(orders.nb)
    if options.start is Start.FREE:
        states = tuple(
            max(f, b + k - 1, 0) for f, b, k in zip(orders.nf, orders.nb, orders.nk, strict=True)
        )
    return _Problem(
        tests=tuple((held(e.u)[0], e.y) for e in experiments),
        orders=orders,
        options=options,
        noise=options.noise_order,
        slowest=float(np.exp(-1.0 / (LONGEST_TIME_CONSTANT * longest_rows))),
        states=states,
    )


def _check_rows(problem: _Problem) -> None:
    lead = problem.options.lead_in_rows + problem.noise
    rows = sum(int(np.count_nonzero(~np.isnan(y[lead:]))) for _, y in problem.tests)
    if problem.coefficients == 0:
        raise ConfigurationError("no_coefficient", key="orders")
    if rows <= problem.size:
        raise DataError("rows_not_enough", rows=rows, parameters=problem.size)


def _search(
    experiments: Sequence[Experiment],
    delays: tuple[int, ...],
    options: OeOptions,
    barred_from: int = HIGHEST_ORDER + 1,
) -> tuple[tuple[OrderTrial, ...], OeOrders]:
    """Try every n and m by the free run in blocks that the fit did not see, on block means."""
    inputs = len(delays)
    longest = max(e.y.size for e in experiments)
    rows = max(-(-longest // SEARCH_ROWS), 1)
    if not any(_long_enough(e, rows) for e in experiments):
        rows = 1
    short = [block_means(e, rows) for e in experiments if _long_enough(e, rows)]
    short_delays = tuple(round(d / rows) for d in delays)
    plain = OeOptions(options.start, 0, options.constant, -(-options.lead_in_rows // rows))
    blocks = blocks_of_rows(short)
    barred: set[tuple[int, int]] = set()

    def left_out(n: int, m: int) -> FloatArray:
        orders = OeOrders((m,) * inputs, (n + 1,) * inputs, short_delays)
        errors, one = _errors_left_out(short, blocks, orders, plain)
        if one or m >= barred_from:
            barred.add((n, m))
        return errors

    trials, n, m = search_orders(blocks, inputs, left_out, barred)
    return trials, OeOrders((m,) * inputs, (n + 1,) * inputs, delays)


def _long_enough(experiment: Experiment, rows: int) -> bool:
    """Return whether enough block means of a test are left."""
    if rows == 1:
        return True
    count = experiment.y.size // rows
    present = ~np.isnan(experiment.y[: count * rows]).reshape(count, rows)
    return int(np.count_nonzero(np.any(present, axis=1))) >= FEWEST_READINGS


def _errors_left_out(
    experiments: Sequence[Experiment],
    blocks: Sequence[Block],
    orders: OeOrders,
    options: OeOptions,
) -> tuple[FloatArray, bool]:
    """Return the sum of squares in each block by fits without it; whether lags are one."""
    whole = replace(_problem(experiments, orders, options), lags=True)
    if sum(int(np.count_nonzero(~np.isnan(y))) for _, y in whole.tests) <= 2 * whole.size:
        return np.full(len(blocks), np.inf), False
    fit = _best_fit(whole, experiments, SEARCH_ITERATIONS)
    errors, one = np.zeros(len(blocks)), _lags_are_one(whole, fit.theta)
    for j, (experiment, first, last) in enumerate(blocks):
        test = next(i for i, e in enumerate(experiments) if e is experiment)
        y = experiment.y.copy()
        y[first:last] = np.nan
        tests = list(whole.tests)
        tests[test] = (tests[test][0], y)
        without = replace(whole, tests=tuple(tests))
        theta = _iterate(without, fit.theta, LEFT_OUT_ITERATIONS).theta
        one = one or _lags_are_one(whole, theta)
        left = experiment.y[first:last] - _simulated(whole, theta, test)[first:last]
        errors[j] = float(np.nansum(left**2))
    return errors, one


def _coloured_root(problem: _Problem, theta: FloatArray, root: FloatArray) -> FloatArray:
    """Return the root of the covariance of the estimates where the residual is not white.

    Sums of gradient times residual scatter by the residual's autocovariance. Its slow part is
    taken from an autoregression of block means, its fast part from what varies within the blocks.
    """
    longest = max(y.size for _, y in problem.tests)
    block = max(-(-longest // COVARIANCE_BLOCKS), 1)
    while _share_of_blocks(problem, block) < 0.5 and longest // block > _FEWEST_BLOCKS:
        block *= 2  # rare outputs: the colour is seen from one group of rows to the next
    means: list[FloatArray] = []
    gradients: list[FloatArray] = []
    within = np.zeros((root.shape[1], root.shape[1]))
    left, free = 0.0, 0.0
    for test in range(len(problem.tests)):
        gradient, e = _gradient(problem, theta, test)
        counted = ~np.isnan(e)
        columns = np.where(counted[:, None], gradient, 0.0) @ root
        filled = np.where(counted, e, 0.0)
        starts = np.arange(0, e.size, block)
        present = np.add.reduceat(counted.astype(np.float64), starts)
        sums = np.add.reduceat(columns, starts, axis=0)
        mean = np.add.reduceat(filled, starts) / np.maximum(present, 1.0)
        within += columns.T @ columns - (sums / np.maximum(present, 1.0)[:, None]).T @ sums
        left += float(np.sum(filled**2) - np.sum(present * mean**2))
        free += float(np.sum(np.maximum(present - 1.0, 0.0)))
        means.append(np.where(present > 0, mean, np.nan))
        gradients.append(sums)
    phi, variance = _colour(means)
    middle = (left / free if free > 0 else 0.0) * within
    denominator, rest = np.concatenate([[1.0], -phi]), np.zeros(phi.size)
    for sums in gradients:  # backwards in time: the transpose of what colours the residual
        backwards = np.ascontiguousarray(sums[::-1].T)
        shaped = np.stack([filtered(np.ones(1), denominator, row, rest) for row in backwards])
        middle += variance * shaped @ shaped.T
    values, vectors = np.linalg.eigh(middle)
    return root @ (vectors * np.sqrt(np.maximum(values, 0.0)))


def _share_of_blocks(problem: _Problem, block: int) -> float:
    """Return the share of the blocks in which something was measured."""
    filled, count = 0, 0
    for _, y in problem.tests:
        present = np.add.reduceat(~np.isnan(y), np.arange(0, y.size, block), dtype=np.int64)
        filled += int(np.count_nonzero(present))
        count += present.size
    return filled / count


def _colour(series: Sequence[FloatArray]) -> tuple[FloatArray, float]:
    """Return an autoregression and the variance of its innovations, order by Schwarz."""
    present = np.concatenate([values[~np.isnan(values)] for values in series])
    power = float(np.mean(present**2))
    highest = min(HIGHEST_COLOUR, present.size // 10)
    best, phi, variance = present.size * float(np.log(max(power, 1e-300))), np.zeros(0), power
    for order in range(1, highest + 1):
        tried = _autoregression(series, order)
        left, rows = _innovation_power(series, tried)
        if rows < 5 * order + _FEWEST_BLOCKS:
            break  # gaps: too few rows show what such an order leaves
        criterion = present.size * float(np.log(max(left, 1e-300))) + order * float(
            np.log(present.size)
        )
        if criterion < best:
            best, phi, variance = criterion, tried, left
    return phi, variance


def _innovation_power(series: Sequence[FloatArray], phi: FloatArray) -> tuple[float, int]:
    """Return the mean square that an autoregression leaves, and the rows that show it."""
    total, rows = 0.0, 0
    for values in series:
        left = values.copy()
        for j, coefficient in enumerate(phi, start=1):
            left -= coefficient * later(values, j, np.nan)
        total += float(np.nansum(left**2))
        rows += int(np.count_nonzero(~np.isnan(left)))
    return total / max(rows, 1), rows


def _result(
    problem: _Problem,
    fit: _Iterated,
    experiments: Sequence[Experiment],
    names: tuple[str, ...],
    sample_time_s: float,
    search: tuple[OrderTrial, ...],
) -> PolynomialResult:
    theta, used = fit.theta, problem.structural
    factor, rows = _factor(problem, theta)
    root = _decompose(factor).inverse_root()
    variance = fit.cost / (rows - problem.size)
    if problem.noise == 0 and rows > 4 * problem.size:
        spread = _coloured_root(problem, theta, root) * np.sqrt(rows / (rows - problem.size))
    else:
        spread = np.sqrt(variance) * root
    spread = (_to_coefficients(problem, theta) @ spread)[:used]
    parts: list[TransferFunction] = []
    for i in range(problem.inputs):
        above = problem.numerator(theta, i)
        below = problem.denominator(theta, i)
        parts.append(TransferFunction(above if above.size else np.zeros(1), below))
    offset = float(theta[problem.coefficients]) if problem.options.constant else 0.0
    model = PolynomialModel(names, tuple(parts), sample_time_s, offset)
    simulated = tuple(frozen_array(_simulated(problem, theta, t)) for t in range(len(experiments)))
    places = [(problem.above(i), problem.below(i)) for i in range(problem.inputs)]
    result = PolynomialResult(
        method="oe",
        model=model,
        parameter_names=_names(problem, names),
        parameters=frozen_array(theta[:used]),
        covariance_root=frozen_array(spread),
        numerator_at=tuple(tuple(range(a.start, a.stop)) for a, _ in places),
        denominator_at=tuple(tuple(range(b.start, b.stop)) for _, b in places),
        delays=problem.orders.nk,
        noise_coefficients=frozen_array(problem.phi(theta)),
        noise_variance=variance,
        mean_square=fit.cost / rows,
        rows=rows,
        simulated_um=simulated,
        fit_percent=fit_percent(
            np.concatenate([e.y for e in experiments]), np.concatenate(simulated)
        ),
        search=search,
        warnings=_warnings(
            problem, fit, model, experiments, undetermined=problem.size - root.shape[1]
        ),
    )
    return replace(result, warnings=(*result.warnings, *_unsupported_gains(result)))


def _unsupported_gains(result: PolynomialResult) -> list[Message]:
    gains = zip(result.model.input_names, result.dc_gain, result.dc_gain_std, strict=True)
    return [
        Message(
            "warning-dc_gain_undetermined",
            {
                "input": name,
                "gain_um_per_k": significant(gain),
                "std_um_per_k": significant(std, 3),
            },
        )
        for name, gain, std in gains
        if std > LARGEST_RELATIVE_STD * abs(gain)
    ]


def _names(problem: _Problem, names: Sequence[str]) -> tuple[str, ...]:
    said: list[str] = []
    for name, b, f, k in zip(
        names, problem.orders.nb, problem.orders.nf, problem.orders.nk, strict=True
    ):
        said += [f"a_{k + i} {name}" for i in range(b)]
        said += [f"b_{i} {name}" for i in range(1, f + 1)]
    if problem.options.constant:
        said.append("offset")
    return (*said, *(f"phi_{i}" for i in range(1, problem.noise + 1)))


def _warnings(
    problem: _Problem,
    fit: _Iterated,
    model: PolynomialModel,
    experiments: Sequence[Experiment],
    *,
    undetermined: int,
) -> tuple[Message, ...]:
    said = pole_warnings(model, experiments)
    if undetermined:
        said.append(Message("warning-parameters_open", {"count": undetermined}))
    if not fit.converged:
        said.append(Message("warning-iteration_not_settled", {"steps": MOST_ITERATIONS}))
    missing = sum(held(e.u)[1] for e in experiments)
    if missing:
        said.append(Message("warning-inputs_held", {"count": missing}))
    for name, part in zip(model.input_names, model.transfer_functions, strict=True):
        if part.poles.size and np.max(np.abs(part.poles)) >= problem.slowest * (1.0 - 1e-12):
            said.append(Message("warning-time_constant_at_bound", {"input": name}))
    return tuple(said)
