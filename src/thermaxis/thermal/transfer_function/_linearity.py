"""Does the machine answer heating and cooling alike? The paper checks it before it identifies."""

from collections.abc import Sequence
from dataclasses import dataclass
from statistics import NormalDist
from typing import final

import numpy as np

from thermaxis.errors import DataError
from thermaxis.thermal._arrays import FloatArray
from thermaxis.thermal.log import Experiment
from thermaxis.thermal.transfer_function._polynomial_model import held
from thermaxis.thermal.transfer_function._residuals import correlation

LINEARITY_LEVEL = 0.01
"""Probability below which a difference of the gains counts as found. [1]"""
LINEARITY_BLOCKS = 400
"""Block means of each test on which the gains are estimated, at most. [1]"""
LEAST_SHARE = 0.1
"""Share of the whole change of the simulated displacement that each phase must have. [1]"""
_MOST_CORRELATION = 0.98
_TURNS = 3


@final
@dataclass(frozen=True, slots=True)
class Linearity:
    """Gains of the heating and of the cooling phases, relative to the model."""

    heating_gain: float
    """Measured over simulated change while the machine heats. [1]"""
    heating_gain_std: float
    """Its standard deviation. [1]"""
    cooling_gain: float
    """Measured over simulated change while the machine cools. [1]"""
    cooling_gain_std: float
    """Its standard deviation. [1]"""
    difference_std: float
    """Standard deviation of heating minus cooling gain. [1]"""
    p_linear: float
    """Probability of so large a difference where both gains are the same. [1]"""
    heating_um: float
    """Simulated change during all heating, sum of magnitudes. [µm]"""
    cooling_um: float
    """Simulated change during all cooling, sum of magnitudes. [µm]"""
    residual_correlation: float
    """Correlation of neighbouring block means of the residual, which the test allows for. [1]"""

    @property
    def difference(self) -> float:
        """Heating minus cooling gain. [1]"""
        return self.heating_gain - self.cooling_gain

    @property
    def linear(self) -> bool:
        """Whether no difference was found at the 1 % level; that is no proof that there is none."""
        return self.p_linear > LINEARITY_LEVEL


def check_linearity(
    experiments: Sequence[Experiment], simulated_um: Sequence[FloatArray]
) -> Linearity:
    """Compare the gains in heating and in cooling.

    Parameters
    ----------
    simulated_um : sequence of FloatArray
        Free run of a model for each test, (n,) each. [µm]

    Returns
    -------
    Linearity
        Both gains with a test of their difference.

    Raises
    ------
    DataError
        If the simulated displacement does not belong to the tests, or one phase has less than
        a tenth of all change.

    Notes
    -----
    The machine heats where the simulated displacement moves away from where it began. Changes of
    it are summed over heating and cooling separately; the measured displacement is a constant per
    test plus one gain times each sum, by least squares on block means. The
    residual is taken for a first-order autoregression (Cochrane-Orcutt, twice), its correlation
    raised by what the fit took from it. The model was fitted to both phases, so it is the ratio of
    both gains that says something.

    References
    ----------
    Mareš and Horejš 2021, section 3.3: a linear dependency in heating and cooling. F.
    Marriott and J. Pope 1954 (bias of a correlation of neighbours, from memory).
    """
    if len(experiments) != len(simulated_um) or not experiments:
        raise DataError(
            "wrong_shape",
            shape=f"({len(simulated_um)},)",
            expected=f"({len(experiments)},)",
            key="simulated_um",
        )
    tables: list[FloatArray] = []
    totals = np.zeros(2)
    for number, (experiment, simulated) in enumerate(zip(experiments, simulated_um, strict=True)):
        if simulated.shape != experiment.y.shape:
            raise DataError(
                "wrong_shape",
                shape=str(simulated.shape),
                expected=str(experiment.y.shape),
                file=experiment.name,
                key="simulated_um",
            )
        sums, moved = _phases(held(simulated[:, None])[0][:, 0])
        totals += moved
        own = np.zeros((experiment.y.size, len(experiments)))
        own[:, number] = 1.0
        tables.append(_block_means(np.column_stack([sums, own, experiment.y])))
    if float(np.min(totals)) < LEAST_SHARE * float(np.sum(totals)):
        raise DataError("phase_too_short", heating_um=float(totals[0]), cooling_um=float(totals[1]))
    return _tested(tables, totals)


def _phases(simulated: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the summed changes of heating and cooling, (n, 2), and their totals, (2,)."""
    step = np.diff(simulated, prepend=simulated[0])
    before = np.concatenate([[simulated[0]], simulated[:-1]]) - simulated[0]
    middle = before + 0.5 * step
    heats = step * middle >= 0.0
    split = np.stack([np.where(heats, step, 0.0), np.where(heats, 0.0, step)], axis=1)
    return np.cumsum(split, axis=0), np.sum(np.abs(split), axis=0)


def _block_means(table: FloatArray) -> FloatArray:
    """Return block means of the rows; NaN in the last column where nothing was measured."""
    block = max(-(-table.shape[0] // LINEARITY_BLOCKS), 1)
    count = table.shape[0] // block
    blocks = table[: count * block].reshape(count, block, -1)
    present = ~np.isnan(blocks[:, :, -1])
    number = np.count_nonzero(present, axis=1)
    sums = np.sum(np.where(present[:, :, None], blocks, 0.0), axis=1)
    means = sums / np.maximum(number, 1)[:, None]
    means[number == 0] = np.nan
    return means


def _tested(tables: Sequence[FloatArray], totals: FloatArray) -> Linearity:
    rho = 0.0
    estimate, covariance = np.zeros(2), np.eye(2)
    for turn in range(_TURNS):
        rows = np.concatenate([_whitened(table, rho) for table in tables])
        rows = rows[~np.any(np.isnan(rows), axis=1)]
        matrix, right = rows[:, :-1], rows[:, -1]
        free = matrix.shape[0] - matrix.shape[1]
        if free < 4:
            raise DataError("too_few_means", means=matrix.shape[0])
        solution, *_ = np.linalg.lstsq(matrix, right, rcond=None)
        left = right - matrix @ solution
        inverse = np.linalg.pinv(matrix.T @ matrix)
        estimate, covariance = solution[:2], inverse[:2, :2] * float(left @ left) / free
        if turn < _TURNS - 1:
            plain = [table[:, -1] - table[:, :-1] @ solution for table in tables]
            values, _ = correlation(plain, plain, 1)
            rho = _unbiased(float(values[2]), matrix.shape)
    variance = float(covariance[0, 0] + covariance[1, 1] - 2.0 * covariance[0, 1])
    difference_std = float(np.sqrt(max(variance, 0.0)))
    difference = abs(float(estimate[0] - estimate[1]))
    ratio = difference / difference_std if difference_std > 0.0 else 0.0
    return Linearity(
        heating_gain=float(estimate[0]),
        heating_gain_std=float(np.sqrt(max(covariance[0, 0], 0.0))),
        cooling_gain=float(estimate[1]),
        cooling_gain_std=float(np.sqrt(max(covariance[1, 1], 0.0))),
        difference_std=difference_std,
        p_linear=2.0 * (1.0 - NormalDist().cdf(ratio)),
        heating_um=float(totals[0]),
        cooling_um=float(totals[1]),
        residual_correlation=rho,
    )


def _unbiased(rho: float, shape: tuple[int, ...]) -> float:
    """Return the correlation of neighbours before the fit took its slow part.

    A fit of q slow columns to n rows lowers it by about (q + (q + 2) rho) / n; with q = 1, a mean,
    this is the formula of Marriott and Pope.
    """
    rows, columns = shape
    raised = (rho * rows + columns) / max(rows - columns - 2.0, 1.0)
    return min(max(raised, 0.0), _MOST_CORRELATION) if rho > 0.0 else 0.0


def _whitened(table: FloatArray, rho: float) -> FloatArray:
    if rho == 0.0:
        return table
    rest = table[1:] - rho * table[:-1]
    first = np.sqrt(1.0 - rho**2) * table[:1]
    return np.concatenate([first, rest])
