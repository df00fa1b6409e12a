"""Denominators from which output error starts."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import final

import numpy as np

from thermaxis.errors import DataError
from thermaxis.thermal._arrays import FloatArray
from thermaxis.thermal.log import Experiment
from thermaxis.thermal.transfer_function._arx import (
    ArxOrders,
    block_means,
    parts_of,
    regressors,
    solve_triangle,
    triangle,
)
from thermaxis.thermal.transfer_function._conversion import modal_form
from thermaxis.thermal.transfer_function._polynomial_model import (
    TransferFunction,
    held,
    simulate_transfer_function,
)
from thermaxis.thermal.transfer_function._roots import (
    LEAST_LOG_RATIO,
    ComplexArray,
    distances_from_one,
)
from thermaxis.thermal.transfer_function._thermal_model import section_response

GRID_TIME_CONSTANTS = 24
"""Time constants of the grid, from two rows to the longest test. [1]"""
GRID_ROWS = 2000
"""Rows to which block means bring each test for the grid. [row]"""
_INSTRUMENT_ROUNDS = 2
_PAIR_APART = float(np.expm1(LEAST_LOG_RATIO))
_SAME, _SAME_LAG = 1e-9, 1e-3
_FASTEST, _FASTER = 0.9, 0.75
_SLOWEST_LAG = 40.0
"""Lags end at half the longest test: so many times faster than other poles. [1]"""


@final
@dataclass(frozen=True, slots=True)
class OeOrders:
    """Orders of an output error structure, in Ljung's letters."""

    nf: tuple[int, ...]
    """Coefficients b_1 ... b_m of the denominator of every input. [1]"""
    nb: tuple[int, ...]
    """Coefficients of the numerator of every input. [1]"""
    nk: tuple[int, ...]
    """Delay of every input. [row]"""


def stabilised(denominator: FloatArray, slowest: float, *, lags: bool = False) -> FloatArray:
    """Return a denominator whose poles have at most a given modulus, and are lags if wanted."""
    if denominator.size == 1:
        return denominator
    distances = distances_from_one(denominator)
    if lags:
        near = _nearest_lags(distances, slowest)
        if bool(np.all(np.abs(near - distances) <= _SAME * np.abs(near))):
            return denominator
        return np.asarray(np.poly(1.0 - near), dtype=np.complex128).real
    modulus = np.abs(1.0 - distances)
    if bool(np.all(modulus <= slowest)):
        return denominator
    poles: ComplexArray = 1.0 - distances
    reflected = np.where(modulus > 1.0, poles / np.maximum(modulus, 1.0) ** 2, poles)
    modulus = np.abs(reflected)
    drawn = np.where(
        modulus > slowest, reflected * (slowest / np.maximum(modulus, 1e-300)), reflected
    )
    return np.asarray(np.poly(drawn), dtype=np.complex128).real


def lags_are_one(denominator: FloatArray) -> bool:
    """Whether two lags of a fit lie as near as they may: fewer do the same."""
    if denominator.size < 3:
        return False
    distances = np.sort(distances_from_one(denominator).real)
    return bool(np.any(distances[1:] < distances[:-1] * (1.0 + _PAIR_APART) * (1.0 + _SAME_LAG)))


def _nearest_lags(distances: ComplexArray, slowest: float) -> ComplexArray:
    """Return real poles between zero and one near others, slowest first and apart."""
    near = np.sort(np.abs(distances) * (1.0 + np.sign(distances.imag) * _PAIR_APART))
    near[0] = max(near[0], _SLOWEST_LAG * (1.0 - slowest))
    for k in range(1, near.size):
        near[k] = max(near[k], near[k - 1] * (1.0 + _PAIR_APART))
    fastest = _FASTEST * _FASTER ** np.arange(near.size - 1, -1, -1)
    return np.minimum(near, fastest).astype(np.complex128)


def denominators_to_start(
    experiments: Sequence[Experiment], orders: OeOrders, slowest: float, *, steady: bool
) -> list[list[FloatArray]]:
    """Return denominators of every input from which an iteration may start."""
    starts = [_grid_start(experiments, orders, steady=steady)]
    inputs = len(orders.nb)
    structures = [
        ArxOrders(
            sum(orders.nf),
            tuple(
                b + sum(orders.nf) - f if b else 0
                for b, f in zip(orders.nb, orders.nf, strict=True)
            ),
            orders.nk,
        )
    ]
    if inputs > 1 and len(set(orders.nf)) == 1:
        structures.append(ArxOrders(orders.nf[0], orders.nb, orders.nk))
    for structure in structures:
        if structure.na == 0:
            continue
        for model in _equation_errors(experiments, structure, slowest):
            kept = _strongest_poles(model, orders)
            if kept is not None:
                starts.append(kept)
    return [[stabilised(b, slowest) for b in start] for start in starts]


def _equation_errors(
    experiments: Sequence[Experiment], orders: ArxOrders, slowest: float
) -> list[tuple[TransferFunction, ...]]:
    """Return ARX and instrumental-variable estimates; none where the rows do not suffice."""
    tables = [regressors(e.u, e.y, orders, constant=False) for e in experiments]
    if sum(t.shape[0] for t in tables) <= orders.parameters + 1:
        return []
    models = [_parts(solve_triangle(triangle(tables)).parameters, orders, slowest)]
    for _ in range(_INSTRUMENT_ROUNDS):
        refined = _instrumental_variables(experiments, orders, models[-1])
        if refined is None:
            break
        models.append(_parts(refined, orders, slowest))
    return models


def _parts(
    parameters: FloatArray, orders: ArxOrders, slowest: float
) -> tuple[TransferFunction, ...]:
    below = stabilised(np.concatenate([[1.0], parameters[: orders.na]]), slowest)
    return parts_of(parameters, orders, below)


def _instrumental_variables(
    experiments: Sequence[Experiment], orders: ArxOrders, parts: Sequence[TransferFunction]
) -> FloatArray | None:
    """Return coefficients by instruments: past displacements as the last model simulates them."""
    d = orders.parameters
    product, right = np.zeros((d, d)), np.zeros(d)
    for experiment in experiments:
        u, _ = held(experiment.u)
        y = sum(
            (
                simulate_transfer_function(part, column)
                for part, column in zip(parts, u.T, strict=True)
            ),
            start=np.zeros(experiment.y.size),
        )
        # a missing displacement must drop the row of both tables
        marked = np.where(np.isnan(experiment.y), np.nan, 0.0)
        shadow = regressors(experiment.u, y + marked, orders, constant=False)
        table = regressors(experiment.u, experiment.y, orders, constant=False)
        product += shadow[:, :-1].T @ table[:, :-1]
        right += shadow[:, :-1].T @ table[:, -1]
    scale = np.sqrt(np.maximum(np.abs(np.diag(product)), 1e-300))
    scaled = product / scale[:, None] / scale
    if not bool(np.all(np.isfinite(scaled))) or np.linalg.cond(scaled) > 1e14:
        return None
    return np.linalg.solve(scaled, right / scale) / scale


def _strongest_poles(
    parts: Sequence[TransferFunction], orders: OeOrders
) -> list[FloatArray] | None:
    """Return for every input a denominator of the poles that contribute most to it."""
    denominators: list[FloatArray] = []
    for part, wanted in zip(parts, orders.nf, strict=True):
        try:
            form = modal_form(part, 1.0)
        except DataError:
            return None
        found: list[tuple[float, list[complex]]] = [
            (abs(float(gain)), [complex(np.exp(-1.0 / tau))])
            for gain, tau in zip(form.gains, form.time_constants_s, strict=True)
        ]
        for mode in form.other_modes:
            both = [mode.pole, mode.pole.conjugate()]
            found.append((abs(mode.gain), both if mode.pair else both[:1]))
        found.sort(key=lambda entry: -entry[0])
        kept: list[complex] = []
        for _, poles in found:
            room = wanted - len(kept)
            if room >= len(poles):
                kept += poles
            elif room == 1:
                kept.append(complex(abs(poles[0])))
        kept += [0.5 + 0.0j] * (wanted - len(kept))
        denominators.append(
            np.asarray(np.poly(np.array(kept)), dtype=np.complex128).real if kept else np.ones(1)
        )
    return denominators


def _grid_start(
    experiments: Sequence[Experiment], orders: OeOrders, *, steady: bool
) -> list[FloatArray]:
    """Return real poles chosen one after the other on a logarithmic grid, then exchanged."""
    longest = max(e.y.size for e in experiments)
    block = max(-(-longest // GRID_ROWS), 1)
    short = [block_means(e, block) if e.y.size >= 16 * block else e for e in experiments]
    taus = np.geomspace(2.0, max(float(longest), 4.0), GRID_TIME_CONSTANTS)
    gram, limits = _grid_products(short, taus, block, steady=steady)
    inputs = len(orders.nb)
    fixed = [limits[i] for i in range(inputs)]
    slots = [i for i in range(inputs) for _ in range(orders.nf[i])]
    chosen: list[tuple[int, int]] = []

    def left(extra: Sequence[tuple[int, int]]) -> float:
        columns = fixed + [limits[i] + 1 + j for i, j in extra]
        return _left_over(gram, columns)

    remaining = list(slots)
    while remaining:
        options = [
            (i, j) for i in sorted(set(remaining)) for j in range(taus.size) if (i, j) not in chosen
        ]
        best = min(options, key=lambda option: left([*chosen, option]))
        chosen.append(best)
        remaining.remove(best[0])
    for k in range(len(chosen)):
        others = chosen[:k] + chosen[k + 1 :]
        options = [(chosen[k][0], j) for j in range(taus.size) if (chosen[k][0], j) not in others]
        chosen[k] = min(options, key=lambda option: left([*others, option]))
    denominators: list[FloatArray] = []
    for i in range(inputs):
        poles = [np.exp(-1.0 / taus[j]) for own, j in chosen if own == i]
        denominators.append(np.asarray(np.poly(poles), dtype=np.float64) if poles else np.ones(1))
    return denominators


def _grid_products(
    experiments: Sequence[Experiment], taus: FloatArray, block: int, *, steady: bool
) -> tuple[FloatArray, list[int]]:
    """Return sums of products of inputs, lagged inputs and displacement; places of the inputs."""
    inputs = experiments[0].inputs
    width = inputs * (taus.size + 1) + 1
    gram = np.zeros((width, width))
    for experiment in experiments:
        u, _ = held(experiment.u)
        rows = 1.0 if experiment.sample_time_s == experiments[0].sample_time_s else 0.0
        step = float(block) if rows else 1.0
        columns: list[FloatArray] = []
        for column in u.T:
            own = np.ascontiguousarray(column)
            start = float(own[0]) if steady else 0.0
            columns.append(own)
            columns += [section_response(own, float(tau), step, start) for tau in taus]
        table = np.stack([*columns, experiment.y], axis=1)
        table = table[~np.isnan(experiment.y)]
        gram += table.T @ table
    return gram, [i * (taus.size + 1) for i in range(inputs)]


def _left_over(gram: FloatArray, columns: Sequence[int]) -> float:
    """Return the sum of squares that the columns leave of the last one."""
    chosen = list(columns)
    matrix, right = gram[np.ix_(chosen, chosen)], gram[chosen, -1]
    scale = np.sqrt(np.maximum(np.diag(matrix), 1e-300))
    scaled = matrix / scale[:, None] / scale
    scaled[np.diag_indices_from(scaled)] += 1e-10
    return float(gram[-1, -1] - (right / scale) @ np.linalg.solve(scaled, right / scale))
