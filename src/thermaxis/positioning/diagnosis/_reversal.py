"""How the reversal value runs along the axis: constant, with a step, or smoothly."""

from dataclasses import dataclass, replace
from typing import final

import numpy as np

from thermaxis.positioning.diagnosis._levels import (
    FEWEST_TARGETS,
    LEAST_EFFECT,
    LEVEL,
    Axis,
    f_tail,
    smooth_basis,
)
from thermaxis.positioning.run import FloatArray


@final
@dataclass(frozen=True, slots=True, eq=False)
class Shape:
    """How the reversal value runs along the axis."""

    fitted: FloatArray
    """(m,). [µm or arcsec]"""
    p_value: float
    step_after: int | None
    """Number of targets before the step; None where it varies smoothly. [1]"""


def _solved(matrix: FloatArray, right: FloatArray) -> FloatArray:
    return np.asarray(np.linalg.solve(matrix, right), dtype=np.float64)


def _weighted_square(columns: FloatArray, value: FloatArray) -> tuple[float, FloatArray]:
    solved, *_ = np.linalg.lstsq(columns, value, rcond=None)
    return float(np.sum((value - columns @ solved) ** 2)), np.asarray(solved, dtype=np.float64)


def _shape_probability(axis: Axis, gained: float, more: int, left: float) -> float:
    """Return the probability of a gain by chance; what the noise does not explain is noise too."""
    free = axis.target.size - 1 - more
    scatter = left / free
    if scatter <= 1.0:
        return f_tail(gained / more, more, axis.free)
    return f_tail(gained / more / scatter, more, free)


def reversal_shape(axis: Axis, reversal: FloatArray) -> Shape:
    """Choose between a constant, a step anywhere, and polynomials up to the third degree."""
    m = reversal.size
    flat = Shape(np.full(m, float(np.mean(reversal))), 1.0, None)
    if m < FEWEST_TARGETS:
        return flat
    covariance = axis.reversal_covariance + 1e-12 * np.eye(m)
    root = np.asarray(np.linalg.cholesky(covariance), dtype=np.float64)
    columns = _solved(root, smooth_basis(axis.target, 3))
    value = _solved(root, reversal)
    ones = _solved(root, np.ones((m, 1)))
    constant, _ = _weighted_square(ones, value)
    steps = _solved(root, np.tri(m, k=-1)[:, : m - 1])  # column k: one after target k + 1
    trials: list[tuple[float, Shape]] = []
    unit = ones / np.linalg.norm(ones)
    own, rest = steps - unit @ (unit.T @ steps), value - unit[:, 0] * float(unit[:, 0] @ value)
    k = int(np.argmax((rest @ own) ** 2 / np.sum(own**2, axis=0)))
    square, solved = _weighted_square(np.column_stack((ones, steps[:, k])), value)
    p_value = min(1.0, (m - 1) * _shape_probability(axis, constant - square, 1, square))
    fitted = solved[0] + solved[1] * (np.arange(m) > k)
    trials.append((_criterion(axis, square, 2), Shape(fitted, p_value, k + 1)))
    for degree in range(1, min(3, m - 3) + 1):
        square, solved = _weighted_square(columns[:, : degree + 1], value)
        p_value = min(1.0, 3.0 * _shape_probability(axis, constant - square, degree, square))
        fitted = smooth_basis(axis.target, 3)[:, : degree + 1] @ solved
        trials.append((_criterion(axis, square, degree), Shape(fitted, p_value, None)))
    _, best = min(trials, key=lambda trial: trial[0])
    if best.p_value >= LEVEL or float(np.ptp(best.fitted)) < LEAST_EFFECT:
        return flat
    return best


def _criterion(axis: Axis, square: float, more: int) -> float:
    """Return Schwarz's criterion; a fit better than the noise earns nothing."""
    m = axis.target.size
    return m * float(np.log(max(square, m - 1.0 - more))) + float(np.log(m)) * more


def without_step(axis: Axis, shape: Shape | None) -> Axis:
    """Take a step of one approach alone out of the mean of both, where that makes it smoother."""
    if shape is None or shape.step_after is None:
        return axis
    smooth = smooth_basis(axis.target, min(3, axis.target.size - 2))
    step = shape.fitted - shape.fitted[0]
    tried = [axis.mean - share * step for share in (0.0, 0.5, -0.5)]
    left = [float(np.sum((mean - smooth @ (smooth.T @ mean)) ** 2)) for mean in tried]
    return replace(axis, mean=tried[int(np.argmin(left))])
