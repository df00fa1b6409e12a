"""ARX: autoregression with inputs, by least squares on rows."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import final

import numpy as np

from thermaxis.codes import Message
from thermaxis.errors import ConfigurationError, DataError, require_range
from thermaxis.thermal._arrays import FloatArray, frozen_array
from thermaxis.thermal.log import Experiment, common_shape
from thermaxis.thermal.transfer_function._figures import fit_percent
from thermaxis.thermal.transfer_function._order_search import (
    HIGHEST_ORDER,
    blocks_of_rows,
    search_orders,
)
from thermaxis.thermal.transfer_function._polynomial_model import (
    MOST_COEFFICIENTS,
    OrderTrial,
    PolynomialModel,
    PolynomialResult,
    Start,
    TransferFunction,
    common_sample_time_s,
    held,
    names_of_inputs,
    simulate_polynomial,
)
from thermaxis.thermal.transfer_function._residuals import correlation, portmanteau_p
from thermaxis.thermal.transfer_function._roots import only_lags

SLOWEST_ROWS = 40.0
"""A time constant of more rows than this is too slow for an equation error. [row]"""
LONGEST_SHARE = 1.0 / 3.0
"""A time constant longer than this share of the longest experiment is not supported. [1]"""
WHITENESS_LAGS = 10
"""Lags at which the one-step residuals are tested. [row]"""
WHITENESS_LEVEL = 0.001
"""Probability below which the residuals do not count as white. [1]"""
LEAST_CORRELATION = 0.05
"""Correlations below this do no harm, however sure they are. [1]"""
_CHUNK_ROWS = 1 << 15
_RANK = 1e-11
_ROUND_OFF = 1e-18
"""Residuals below this share of the squares are rounding. [1]"""


@final
@dataclass(frozen=True, slots=True)
class ArxOrders:
    """Orders of an ARX structure, in Ljung's letters."""

    na: int
    """Coefficients b_1 ... b_m of the denominator: m of the paper. [1]"""
    nb: tuple[int, ...]
    """Coefficients of the numerator of every input: n + 1 of the paper without delay. [1]"""
    nk: tuple[int, ...]
    """Delay of every input: leading zeros of its numerator. [row]"""

    @property
    def longest_lag(self) -> int:
        """Rows that an equation reaches back. [row]"""
        reach = [k + b - 1 for b, k in zip(self.nb, self.nk, strict=True) if b]
        return max([self.na, *reach])

    @property
    def parameters(self) -> int:
        """Number of coefficients. [1]"""
        return self.na + sum(self.nb)


def per_input(orders: int | Sequence[int], inputs: int, name: str) -> tuple[int, ...]:
    """Return an order for every input."""
    values = (orders,) * inputs if isinstance(orders, int) else tuple(orders)
    if len(values) != inputs:
        raise ConfigurationError("count_not_inputs", count=len(values), inputs=inputs, key=name)
    limit = MOST_COEFFICIENTS // 2
    for value in values:
        require_range(name, value, 0, limit)
    return values


def regressors(u: FloatArray, y: FloatArray, orders: ArxOrders, *, constant: bool) -> FloatArray:
    """Return the rows of the least-squares problem of one experiment."""
    first, n = orders.longest_lag, y.size
    if n <= first:
        return np.zeros((0, orders.parameters + constant + 1))
    columns = [-y[first - i : n - i] for i in range(1, orders.na + 1)]
    for j, (count, delay) in enumerate(zip(orders.nb, orders.nk, strict=True)):
        columns += [u[first - delay - i : n - delay - i, j] for i in range(count)]
    if constant:
        columns.append(np.ones(n - first))
    rows = np.stack([*columns, y[first:]], axis=1)
    return rows[np.isfinite(rows @ np.ones(rows.shape[1]))]


def triangle(blocks: Sequence[FloatArray]) -> FloatArray:
    """Return the triangular factor of rows stacked below each other."""
    columns = blocks[0].shape[1]
    factor = np.zeros((columns, columns))
    for block in blocks:
        for start in range(0, block.shape[0], _CHUNK_ROWS):
            stacked = np.vstack([factor, block[start : start + _CHUNK_ROWS]])
            factor = np.asarray(np.linalg.qr(stacked, mode="r"), dtype=np.float64)
    return factor


@final
@dataclass(frozen=True, slots=True, eq=False)
class LeastSquares:
    """Solution of a least-squares problem by its triangular factor."""

    parameters: FloatArray
    """Solution, (d,). [any]"""
    inverse_root: FloatArray
    """Root of the inverse of the sum of products of the regressors, (d, d). [any]"""
    sum_of_squares: float
    """What is left. [µm²]"""
    weak: tuple[int, ...]
    """Regressors of the directions that the rows do not determine; empty if they do. [1]"""


def solve_triangle(factor: FloatArray, columns: Sequence[int] | None = None) -> LeastSquares:
    """Solve a least-squares problem whose last column is the right side."""
    chosen = list(range(factor.shape[1] - 1)) if columns is None else list(columns)
    matrix, right = factor[:, chosen], factor[:, -1]
    norm = np.linalg.norm(matrix, axis=0)
    scale = np.where(norm > 0, norm, 1.0)
    left, values, right_vectors = np.linalg.svd(matrix / scale, full_matrices=False)
    kept = values > _RANK * (values[0] if values.size else 0.0)
    inverse_values = np.where(kept, 1.0 / np.where(kept, values, 1.0), 0.0)
    parameters = (right_vectors.T @ (inverse_values * (left.T @ right))) / scale
    vectors = (right_vectors.T * inverse_values) / scale[:, None]
    weak = {int(np.argmax(np.abs(v))) for v in right_vectors[~kept]}
    residual = right - matrix @ parameters
    return LeastSquares(
        parameters=parameters,
        inverse_root=vectors,
        sum_of_squares=float(residual @ residual),
        weak=tuple(sorted(weak)),
    )


def parameter_names(orders: ArxOrders, names: Sequence[str], *, constant: bool) -> tuple[str, ...]:
    """Return names of the coefficients in the order of the regressors."""
    said = [f"b_{i}" for i in range(1, orders.na + 1)]
    for name, count, delay in zip(names, orders.nb, orders.nk, strict=True):
        said += [f"a_{delay + i} {name}" for i in range(count)]
    return (*said, "constant") if constant else tuple(said)


def arx(
    experiments: Sequence[Experiment],
    na: int | None = None,
    nb: int | Sequence[int] | None = None,
    nk: int | Sequence[int] = 0,
    *,
    input_names: Sequence[str] = (),
    constant: bool = False,
) -> PolynomialResult:
    """Identify an ARX model: one denominator for all inputs, by least squares.

    Parameters
    ----------
    experiments : sequence of Experiment
        Tests; their rows are stacked test by test, so no equation reaches over a border.
    na : int, optional
        Coefficients of the denominator (paper: m). Default: searched, 0 to 3. [1]
    nb : int or sequence of int, optional
        Coefficients of the numerator per input (paper: n + 1). Default: searched, m and m + 1. [1]
    nk : int or sequence of int
        Delay per input. Default: 0, the present input acts at once. [row]
    input_names : sequence of str
        Names of the inputs. Default: u1, u2, ...
    constant : bool
        Estimate a constant too. Default: no, the coordinates are relative (paper).

    Returns
    -------
    PolynomialResult
        Coefficients, their covariance for white residuals, the free run and warnings; `stable`
        says whether every pole lies inside the unit circle. It need not.

    Raises
    ------
    DataError
        If there are too few complete rows, the rows do not determine the coefficients, or sample
        times or inputs differ.
    ConfigurationError
        If an order is negative, too large, or only one of na and nb is given.

    Notes
    -----
    The default search takes every m up to three with n = m and m - 1, fits without one block of
    rows after the other (a fifth of the record, or a whole test where there are five), runs free
    from the first row and compares in the block left out. Of the orders whose mean square error
    exceeds the least one by no more than one standard error of the difference, those with the
    fewest coefficients are taken. A fit with a pole that is no lag, outside 0 < z < 1, is never
    taken: conduction has none, and a model that runs holds none.

    An equation error weighs what changes from row to row. At short sample times that is noise, and
    slow poles come out too fast: fits to `block_means` of several lengths show how far it
    depends on the sample time.

    References
    ----------
    Mareš and Horejš 2021, equations (2) and (3): numerator a, denominator b. L. Ljung, System
    Identification, writes B and A for them (from memory).
    """
    inputs = common_shape(experiments)
    names = names_of_inputs(experiments, input_names)
    sample_time_s = common_sample_time_s(experiments)
    delays = per_input(nk, inputs, "nk")
    search: tuple[OrderTrial, ...] = ()
    if na is None and nb is None:
        search, orders = _search(experiments, delays, constant=constant)
    elif na is None or nb is None:
        raise ConfigurationError("half_orders", names=("na", "nb"), key="orders")
    else:
        (order,) = per_input(na, 1, "na")
        orders = ArxOrders(order, per_input(nb, inputs, "nb"), delays)
    count = orders.parameters + constant
    if count == 0:
        raise ConfigurationError("no_coefficient", key="orders")
    tables = [regressors(e.u, e.y, orders, constant=constant) for e in experiments]
    rows = sum(table.shape[0] for table in tables)
    if rows <= count:
        raise DataError("rows_not_enough", rows=rows, parameters=count)
    solution = solve_triangle(triangle(tables))
    labels = parameter_names(orders, names, constant=constant)
    if solution.weak:
        weak = tuple(labels[i] for i in solution.weak)
        raise DataError("coefficients_undetermined", names=weak)
    model = _model(solution.parameters, orders, names, sample_time_s, constant=constant)
    variance = solution.sum_of_squares / (rows - solution.parameters.size)
    simulated = tuple(_free_run(model, e) for e in experiments)
    fit = fit_percent(np.concatenate([e.y for e in experiments]), np.concatenate(simulated))
    return PolynomialResult(
        method="arx",
        model=model,
        parameter_names=labels,
        parameters=frozen_array(solution.parameters),
        covariance_root=frozen_array(np.sqrt(variance) * solution.inverse_root),
        numerator_at=_numerator_at(orders),
        denominator_at=(tuple(range(orders.na)),) * inputs,
        delays=orders.nk,
        noise_coefficients=frozen_array([]),
        noise_variance=variance,
        mean_square=solution.sum_of_squares / rows,
        rows=rows,
        simulated_um=simulated,
        fit_percent=fit,
        search=search,
        warnings=_warnings(model, experiments, solution.parameters, orders, constant=constant),
    )


def parts_of(
    parameters: FloatArray, orders: ArxOrders, denominator: FloatArray
) -> tuple[TransferFunction, ...]:
    """Return the transfer function of every input, all of one denominator."""
    parts: list[TransferFunction] = []
    for at, delay in zip(_numerator_at(orders), orders.nk, strict=True):
        above = np.concatenate([np.zeros(delay), parameters[list(at)]])
        parts.append(TransferFunction(above if above.size else np.zeros(1), denominator))
    return tuple(parts)


def _numerator_at(orders: ArxOrders) -> tuple[tuple[int, ...], ...]:
    ends = orders.na + np.cumsum(orders.nb)
    return tuple(
        tuple(range(int(end) - count, int(end))) for end, count in zip(ends, orders.nb, strict=True)
    )


def _model(
    parameters: FloatArray,
    orders: ArxOrders,
    names: tuple[str, ...],
    sample_time_s: float,
    *,
    constant: bool,
) -> PolynomialModel:
    below = np.concatenate([[1.0], parameters[: orders.na]])
    level = float(np.sum(below))
    offset = float(parameters[-1]) / level if constant and level != 0.0 else 0.0
    return PolynomialModel(names, parts_of(parameters, orders, below), sample_time_s, offset)


def _free_run(model: PolynomialModel, experiment: Experiment) -> FloatArray:
    """Return the free run, at rest where there is no steady state, without overflow."""
    start = Start.STEADY
    if any(not np.isfinite(part.dc_gain) for part in model.transfer_functions):
        start = Start.REST
    with np.errstate(over="ignore", invalid="ignore"):
        y = simulate_polynomial(model, experiment.u, start=start)
    return frozen_array(np.where(np.isfinite(y), np.clip(y, -1e100, 1e100), 1e100))


def _search(
    experiments: Sequence[Experiment], delays: tuple[int, ...], *, constant: bool
) -> tuple[tuple[OrderTrial, ...], ArxOrders]:
    """Try every n and m up to the highest by the free run in blocks that the fit did not see."""
    inputs = len(delays)
    largest = ArxOrders(HIGHEST_ORDER, (HIGHEST_ORDER + 1,) * inputs, delays)
    blocks = blocks_of_rows(experiments)
    factors = [
        triangle([regressors(e.u[a:b], e.y[a:b], largest, constant=constant)]) for e, a, b in blocks
    ]
    kept = [triangle([f for j, f in enumerate(factors) if j != i]) for i in range(len(blocks))]
    filled = [(held(e.u)[0][:b], e.y[:b], a) for e, a, b in blocks]

    def left_out(n: int, m: int) -> FloatArray:
        orders = ArxOrders(m, (n + 1,) * inputs, delays)
        columns = _columns_within(largest, orders, constant=constant)
        solutions = [solve_triangle(factor, columns) for factor in kept]
        pairs = zip(solutions, filled, strict=True)
        return np.array([_left_out_error(s, orders, rows, constant=constant) for s, rows in pairs])

    trials, n, m = search_orders(blocks, inputs, left_out)
    return trials, ArxOrders(m, (n + 1,) * inputs, delays)


def _columns_within(largest: ArxOrders, orders: ArxOrders, *, constant: bool) -> list[int]:
    """Return where the regressors of lower orders stand among those of the largest."""
    columns = list(range(orders.na))
    start = largest.na
    for all_of_input, wanted in zip(largest.nb, orders.nb, strict=True):
        columns += list(range(start, start + wanted))
        start += all_of_input
    return [*columns, start] if constant else columns


def _left_out_error(
    solution: LeastSquares,
    orders: ArxOrders,
    rows: tuple[FloatArray, FloatArray, int],
    *,
    constant: bool,
) -> float:
    """Return the sum of squares of the free run in a block that the fit did not see."""
    if solution.weak:
        return float("inf")
    names = tuple(f"u{i + 1}" for i in range(len(orders.nb)))
    model = _model(solution.parameters, orders, names, 1.0, constant=constant)
    if not only_lags(model.transfer_functions[0].denominator):
        return float("inf")
    u, y, first = rows
    error = y[first:] - simulate_polynomial(model, u)[first:]
    return float(np.nansum(error**2))


def _warnings(
    model: PolynomialModel,
    experiments: Sequence[Experiment],
    parameters: FloatArray,
    orders: ArxOrders,
    *,
    constant: bool,
) -> tuple[Message, ...]:
    said = pole_warnings(model, experiments)
    rows = model.transfer_functions[0].time_constants_s(1.0)
    if rows.size and np.isfinite(rows[0]) and rows[0] > SLOWEST_ROWS:
        better_s = float(rows[0]) / 30.0 * model.sample_time_s
        values = {"rows": float(rows[0]), "better_s": better_s}
        said.append(Message("warning-sample_time_short", values))
    errors: list[FloatArray] = []
    for experiment in experiments:
        table = regressors(experiment.u, experiment.y, orders, constant=constant)
        errors.append(table[:, -1] - table[:, :-1] @ parameters)
    size = sum(float(np.nansum(e.y**2)) for e in experiments)
    if sum(float(e @ e) for e in errors) <= _ROUND_OFF * size:
        return tuple(said)
    values, pairs = correlation(errors, errors, WHITENESS_LAGS)
    own, pairs = values[WHITENESS_LAGS + 1 :], pairs[WHITENESS_LAGS + 1 :]
    largest = float(np.max(np.abs(own)))
    if largest > LEAST_CORRELATION and portmanteau_p(own, pairs) < WHITENESS_LEVEL:
        values = {"correlation": largest, "lags": WHITENESS_LAGS}
        said.append(Message("warning-residuals_not_white", values))
    return tuple(said)


def pole_warnings(model: PolynomialModel, experiments: Sequence[Experiment]) -> list[Message]:
    """Return what must be said about the poles of a model."""
    longest_s = max(e.duration_s for e in experiments)
    said: list[Message] = []
    shared: dict[tuple[float, ...], list[str]] = {}
    for name, part in zip(model.input_names, model.transfer_functions, strict=True):
        shared.setdefault(tuple(float(b) for b in part.denominator), []).append(name)
    for denominator, names in shared.items():
        part = TransferFunction(np.ones(1), np.array(denominator))
        poles, inputs = part.poles, {"inputs": tuple(names)}
        if poles.size == 0:
            continue
        if not part.stable:
            modulus = float(np.max(np.abs(poles)))
            said.append(Message("warning-pole_unstable", {**inputs, "modulus": modulus}))
        if bool(np.any((poles.imag != 0.0) | (poles.real < 0.0))):
            said.append(Message("warning-pole_oscillates", inputs))
        slowest_s = float(part.time_constants_s(model.sample_time_s)[0])
        if part.stable and slowest_s > LONGEST_SHARE * longest_s:
            values = {"time_constant_s": slowest_s, "longest_s": longest_s}
            said.append(Message("warning-extrapolated", inputs | values))
    return said


def block_means(experiment: Experiment, rows: int) -> Experiment:
    """Return an experiment at a longer sample time, each row the mean of what a block of rows has.

    Rows that are left over at the end are dropped; a block without a value is NaN.

    Raises
    ------
    ConfigurationError
        If a block has less than one row.
    DataError
        If fewer than eight blocks with a displacement are left.
    """
    if rows < 1:
        raise ConfigurationError("not_positive", value=rows, key="rows")
    if rows == 1:
        return experiment
    count = experiment.y.size // rows
    u = experiment.u[: count * rows].reshape(count, rows, -1)
    y = experiment.y[: count * rows].reshape(count, rows)
    return Experiment(
        sample_time_s=experiment.sample_time_s * rows,
        u=_mean_of_present(u),
        y=_mean_of_present(y),
        name=experiment.name,
    )


def _mean_of_present(blocks: FloatArray) -> FloatArray:
    present = np.count_nonzero(~np.isnan(blocks), axis=1)
    return np.where(present > 0, np.nansum(blocks, axis=1) / np.maximum(present, 1), np.nan)
