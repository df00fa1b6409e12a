"""How sure a model will be after a sequence of heating, before anything is measured."""

from dataclasses import dataclass
from typing import final

import numpy as np

from thermaxis.thermal._arrays import FloatArray
from thermaxis.thermal.design._conditions import HeatingConditions, Wanted
from thermaxis.thermal.design._prior import GainsPrior
from thermaxis.thermal.design._responses import noise_covariance, pulses

ROW_S = 300.0
"""Rows over which readings are averaged, about. [s]"""
RISES = 4
"""Draws of the time constant with which inputs rise: middles of equal shares. [1]"""
SPECTRA, USE_STEP_S = 40, 300.0
"""Spectra of use that the mean is taken over [1], and the steps of their holds. [s]"""
_SEED = 2


@final
@dataclass(frozen=True, slots=True, eq=False)
class Foresight:
    """What the value of any sequence of some length needs, computed once.

    Notes
    -----
    Displacements of a sequence with heat h are y = F g + e, F the means over rows of what h does
    through the lags of the grid, e noise and drift of covariance K, and the gains g have mean and
    covariance L L'. After the test L (1 + L' F' K^-1 F L)^-1 L' is left of it, whatever is
    measured. With the rows U of spectra of use, n of them, the mean square of the error predicted
    is trace(Q (1 + L' F' K^-1 F L)^-1), Q = L' U' U L / n; it is averaged over draws of how fast
    the inputs rise.

    References
    ----------
    Atkinson, Donev and Tobias 2007, chapters 10 and 18 (I-optimality, designs under a prior);
    Chaloner and Verdinelli 1995.
    """

    whitened: tuple[FloatArray, ...]
    """K^-1/2 times the pulses of every source and block, one (s, b, n, 1 + j) per draw."""
    use: tuple[FloatArray, ...]
    """Q, one (r, r) per draw. [µm²]"""
    settled: FloatArray
    """Rows of what each source does at its highest level when it has settled, (s, r). [µm]"""
    factor: FloatArray
    """L, (s (1 + j), r). [µm]"""
    rows: int
    """Rows per block. [1]"""

    def informations(self, heat: FloatArray, blocks: int | None = None) -> tuple[FloatArray, ...]:
        """Return 1 + L' F' K^-1 F L after sequences, one (c, r, r) per draw.

        Parameters
        ----------
        heat : ndarray
            Heat as shares of the highest level, (c, b, s). [1]
        blocks : int, optional
            The readings of the first so many blocks alone. Default: all. [1]
        """
        found: list[FloatArray] = []
        last = None if blocks is None else blocks * self.rows
        for one in self.whitened:
            answers = np.einsum("cbs,sbng->cnsg", heat, one[:, :, :last], optimize=True)
            answers = answers.reshape(*answers.shape[:2], -1) @ self.factor
            gram = np.swapaxes(answers, 1, 2) @ answers
            found.append(gram + np.eye(len(self.factor.T)))
        return tuple(found)

    def variances_um2(self, heat: FloatArray, blocks: int | None = None) -> FloatArray:
        """Return the mean squares of the error in use after sequences, (c,). [µm²]"""
        each = zip(self.informations(heat, blocks), self.use, strict=True)
        left = [np.einsum("cij,ji->c", np.linalg.inv(a), q) for a, q in each]
        return np.mean(left, axis=0)

    def foreseen_um(self, heat: FloatArray, blocks: int | None = None) -> float:
        """Return the standard deviation of the displacement predicted in use. [µm]"""
        return float(np.sqrt(self.variances_um2(heat[None], blocks)[0]))

    def settled_um(self, heat: FloatArray) -> FloatArray:
        """Return the standard deviations of what each source does when it has settled, (s,)."""
        squares = [
            np.sum((self.settled @ np.linalg.inv(a)[0]) * self.settled, axis=1)
            for a in self.informations(heat[None])
        ]
        return np.asarray(np.sqrt(np.mean(squares, axis=0)))


def foresight(conditions: HeatingConditions, prior: GainsPrior, blocks: int) -> Foresight:
    """Return what the value of any sequence of so many blocks needs."""
    block_s, noise = 60.0 * conditions.block_min, conditions.noise
    rows = max(1, round(block_s / ROW_S))
    row_s = block_s / rows
    covariance = noise_covariance(
        row_s * (np.arange(blocks * rows, dtype=np.float64) + 0.5),
        noise.reading_um**2 * min(1.0, noise.every_s / row_s),
        noise.reading_um**2 * min(1.0, noise.every_s / (60.0 * conditions.rest_min)),
        noise.drift_um**2,
        3600.0 * noise.drift_h,
    )
    rises_s = _rises_s(conditions)
    use = uses_of(conditions, prior)
    return foresight_of(prior, covariance, use, rises_s, (blocks, block_s, rows))


def foresight_of(
    prior: GainsPrior,
    covariance: FloatArray,
    use: tuple[FloatArray, ...],
    rises_s: FloatArray,
    length: tuple[int, float, int],
) -> Foresight:
    """Return the same of any noise and use.

    Parameters
    ----------
    covariance : ndarray
        Of the noise of means over rows, (n, n). [µm²]
    use : tuple of ndarray
        Q, one per draw. [µm²]
    rises_s : ndarray
        Time constants with which the inputs rise, (d, s). [s]
    length : tuple
        Blocks [1], their length [s], and rows per block [1].
    """
    white = np.linalg.inv(np.linalg.cholesky(covariance))
    grid_s, whitened = prior.time_constants_s, list[FloatArray]()
    for rises in rises_s.tolist():
        each = [pulses(*length, grid_s, rise_s) for rise_s in rises]
        whitened.append(np.einsum("mn,sbng->sbmg", white, np.stack(each), optimize=True))
    settled = np.kron(np.eye(rises_s.shape[1]), np.ones(1 + grid_s.size)) @ prior.factor_um
    return Foresight(tuple(whitened), use, settled, prior.factor_um, length[2])


def _rises_s(conditions: HeatingConditions) -> FloatArray:
    """Return draws of the time constants of all inputs, (d, s): log-uniform, paired at random."""
    middles = (np.arange(RISES) + 0.5) / RISES
    rng = np.random.default_rng(_SEED)
    columns: list[FloatArray] = []
    for source in conditions.each:
        low, high = (max(60.0 * end, 1e-3) for end in source.rise_min)
        columns.append(np.asarray(rng.permutation(low * (high / low) ** middles), np.float64))
    found = np.column_stack(columns)
    return found[:1] if bool(np.all(found == found[0])) else found


def spectra_of_use(conditions: HeatingConditions, seed: int, count: int = SPECTRA) -> FloatArray:
    """Return heat in use, (count, steps of 300 s, s): levels at random, each held at random. [1]"""
    use, rng = conditions.use, np.random.default_rng(seed)
    steps = round(3600.0 * use.hours / USE_STEP_S)
    held = [max(1, round(60.0 * end / USE_STEP_S)) for end in use.hold_min]
    numbers = np.zeros((count, steps, len(conditions.sources)), dtype=np.intp)
    for spectrum in numbers:
        for s, source in enumerate(conditions.each):
            begin = 0
            while begin < steps:
                end = begin + int(rng.integers(held[0], held[1] + 1))
                spectrum[begin:end, s] = rng.integers(len(source.levels))
                begin = end
    return conditions.heat(numbers)


def uses_of(conditions: HeatingConditions, prior: GainsPrior) -> tuple[FloatArray, ...]:
    """Return Q, or its like for what else is wanted, one (r, r) per draw of rises. [µm²]"""
    sources, factor = len(conditions.sources), prior.factor_um
    wide = 1 + prior.time_constants_s.size
    rises_s = _rises_s(conditions)
    if conditions.wanted is Wanted.DC_GAINS:
        rows = np.kron(np.eye(sources), np.ones(wide)) @ factor
        return tuple(rows.T @ rows / sources for _ in rises_s)
    heat = spectra_of_use(conditions, _SEED)
    count, steps = heat.shape[:2]
    found: list[FloatArray] = []
    for rises in rises_s:
        rows = np.empty((count * steps, sources, wide))
        for s, rise_s in enumerate(rises.tolist()):
            step = pulses(steps, USE_STEP_S, 1, prior.time_constants_s, rise_s)
            rows[:, s] = np.einsum("cb,bng->cng", heat[:, :, s], step, optimize=True).reshape(
                -1, wide
            )
        used = rows.reshape(len(rows), -1) @ factor
        found.append(used.T @ used / len(rows))
    return tuple(found)
