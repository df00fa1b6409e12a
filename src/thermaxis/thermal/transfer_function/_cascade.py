"""Simulation of slow transfer functions pole after pole.

Behind three poles near one, an input and its shifted copies are the same signal to ten digits:
numerators do not stay apart in them. The signals between the poles are a basis in which they do,
and sums of coefficients that nearly cancel are never formed from the signals.
"""

from dataclasses import dataclass
from functools import lru_cache
from typing import final

import numpy as np

from thermaxis.thermal._arrays import FloatArray
from thermaxis.thermal.transfer_function._roots import distances_from_one

FAST = 0.5
"""A pole further than this from one needs no stage of its own. [1]"""
_REMEMBERED = 64


@final
@dataclass(frozen=True, slots=True, eq=False)
class Cascade:
    """A denominator as a product: fast poles together, then one slow pole or pair after another."""

    fast: FloatArray
    """Product of the fast factors, 1 first. [1]"""
    slow: tuple[FloatArray, ...]
    """Slow factors, (2,) or (3,) each, 1 first, fastest first. [1]"""
    slow_sums: tuple[float, ...]
    """Sum of each slow factor, to full relative precision. [1]"""


def filtered(
    numerator: FloatArray, denominator: FloatArray, values: FloatArray, state: FloatArray
) -> FloatArray:
    """Return values behind a transfer function whose first denominator coefficient is one."""
    if state.size == 0:
        return values * numerator[0]
    from scipy.signal import (  # noqa: PLC0415  half a second, and for ARX and output error alone
        lfilter,  # pyright: ignore[reportUnknownVariableType] - no types
    )

    y, _ = lfilter(numerator, denominator, values, zi=state)
    return np.asarray(y, dtype=np.float64)


def cascade_of(denominator: FloatArray) -> Cascade:
    """Factor a denominator into fast and slow poles."""
    return _cascade(tuple(float(b) for b in denominator))


@lru_cache(maxsize=_REMEMBERED)
def _cascade(denominator: tuple[float, ...]) -> Cascade:
    distances = distances_from_one(np.array(denominator))
    fast, slow, sums = np.ones(1), list[FloatArray](), list[float]()
    for w in distances[::-1]:
        if w.imag < 0.0:
            continue
        if w.imag == 0.0:
            factor, total = np.array([1.0, w.real - 1.0]), float(w.real)
        else:
            total = float(abs(w)) ** 2
            modulus_squared = 1.0 - 2.0 * float(w.real) + total
            factor = np.array([1.0, 2.0 * (float(w.real) - 1.0), modulus_squared])
        if abs(w) > FAST:
            fast = np.convolve(fast, factor)
        else:
            slow.append(factor)
            sums.append(total)
    return Cascade(fast, tuple(slow), tuple(sums))


def later(values: FloatArray, rows: int, before: float) -> FloatArray:
    """Return values some rows later."""
    if rows == 0:
        return values
    count = min(rows, values.size)
    return np.concatenate([np.full(count, before), values[: values.size - count]])


def stage_outputs(
    cascade: Cascade, values: FloatArray, first: float, count: int
) -> list[FloatArray]:
    """Return what stands between the poles, slowest first."""
    stages = [_stage(cascade.fast, float(np.sum(cascade.fast)), values, first)]
    levels = [first / float(np.sum(cascade.fast))]
    for factor, total in zip(cascade.slow, cascade.slow_sums, strict=True):
        stages.append(_stage(factor, total, stages[-1], levels[-1]))
        levels.append(levels[-1] / total)
    columns: list[FloatArray] = []
    for k in range(len(cascade.slow), 0, -1):
        columns.append(stages[k])
        if cascade.slow[k - 1].size == 3:
            columns.append(stages[k] - later(stages[k], 1, levels[k]))
    values, before = stages[0], levels[0]
    while len(columns) < count:
        columns.append(values)
        values, before = values - later(values, 1, before), 0.0
    return columns[:count]


def _stage(factor: FloatArray, total: float, values: FloatArray, first: float) -> FloatArray:
    shifted = values - first if first != 0.0 else values
    y = filtered(np.ones(1), factor, shifted, np.zeros(factor.size - 1))
    return y + first / total if first != 0.0 else y


def basis_polynomials(cascade: Cascade, count: int) -> FloatArray:
    """Return the numerators whose outputs `stage_outputs` gives."""
    step = np.array([1.0, -1.0])
    product, polynomials = np.ones(1), list[FloatArray]()
    for factor in cascade.slow[::-1]:
        polynomials.append(product)
        if factor.size == 3:
            polynomials.append(np.convolve(product, step))
        product = np.convolve(product, factor)
    while len(polynomials) < count:
        polynomials.append(product)
        product = np.convolve(product, step)
    matrix = np.zeros((count, count))
    for j, polynomial in enumerate(polynomials[:count]):
        matrix[: polynomial.size, j] = polynomial
    return matrix


def output_of(
    numerator: FloatArray, denominator: FloatArray, values: FloatArray, first: float
) -> FloatArray:
    """Return values behind a transfer function, one pole after the other."""
    nonzero = np.flatnonzero(numerator)
    if nonzero.size == 0:
        return np.zeros(values.size)
    delay, last = int(nonzero[0]), int(nonzero[-1])
    cascade = cascade_of(denominator)
    count = last - delay + 1
    weights = np.linalg.solve(basis_polynomials(cascade, count), numerator[delay : last + 1])
    y = np.zeros(values.size)
    for weight, series in zip(
        weights, stage_outputs(cascade, later(values, delay, first), first, count), strict=True
    ):
        y += weight * series
    return y
