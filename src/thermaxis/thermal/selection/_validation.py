"""Free-run errors of ridge models on parts of a record that they did not see.

A model is linear in its gains, so that every fit needs only sums over the parts it learns from.
Nothing measured of the displacement enters a simulation, so that what is held out is predicted
as on the machine: from temperatures alone.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import final

import numpy as np

from thermaxis.thermal._arrays import FloatArray
from thermaxis.thermal.selection._bank import Bank, IndexArray


@final
@dataclass(frozen=True, slots=True)
class Split:
    """Parts of the record to learn from, and one to be judged by."""

    learn: tuple[int, ...]
    """Numbers of the parts. [1]"""
    judge: int
    """Number of the part that is held out. [1]"""


@final
@dataclass(frozen=True, slots=True)
class Structure:
    """What a model may consist of."""

    lags: tuple[int, ...]
    """Positions of its time constants, from zero. [1]"""
    channels: tuple[int, ...]
    """Positions of its channels. [1]"""
    offset: bool
    """Whether it has an offset; else it is zero at the reference."""


@final
@dataclass(frozen=True, slots=True)
class Member:
    """A structure that takes part in an average of models."""

    structure: Structure
    """What the model consists of."""
    position: int
    """Position of the uncertainty of the temperatures. [1]"""
    weight: float
    """Its share; the shares of all members add to one. [1]"""


@final
@dataclass(frozen=True, slots=True, eq=False)
class Sums:
    """Sums over the parts of one bank."""

    bank: Bank
    square: FloatArray
    """Weighted products of regressors, (parts, p, p)."""
    product: FloatArray
    """Weighted products with displacements, (parts, p, o)."""
    weight: FloatArray
    """Sum of weights, (parts,)."""
    rows: tuple[IndexArray, ...]


def splits_of(count: int) -> tuple[Split, ...]:
    """Return how parts are held out."""
    every = tuple(
        Split(learn=tuple(j for j in range(count) if j != i), judge=i) for i in range(count)
    )
    later = tuple(Split(learn=tuple(range(i)), judge=i) for i in range(max(1, count // 2), count))
    return every + later


@final
@dataclass(frozen=True, slots=True, eq=False)
class Validation:
    """A record, summed up so that any structure can be judged on its splits."""

    noise_variance_k2: FloatArray
    """Squared noise of every channel, (k,). [K²]"""
    variance_k2: FloatArray
    """Squared uncertainties of the temperatures that are tried, (s,). [K²]"""
    splits: tuple[Split, ...]
    """How parts are held out."""
    sums: tuple[Sums, ...]
    """Sums over the parts, one per bank."""

    @property
    def output_names(self) -> tuple[str, ...]:
        """Names of the outputs in the order of the errors, (o,)."""
        return tuple(name for sums in self.sums for name in sums.bank.output_names)

    def _columns(self, structure: Structure) -> IndexArray:
        channels = np.array(structure.channels, dtype=np.intp)
        count = self.noise_variance_k2.size
        blocks = [channels] + [channels + (1 + lag) * count for lag in structure.lags]
        if structure.offset:
            blocks.append(np.array([self.sums[0].square.shape[1] - 1], dtype=np.intp))
        return np.concatenate(blocks)

    def _penalties(self, structure: Structure) -> FloatArray:
        """Return the price of a squared gain, (s, p). [K²]"""
        own = self.noise_variance_k2[list(structure.channels)]
        lags = np.zeros(own.size * len(structure.lags))
        noise = np.concatenate([own, lags])
        penalty = self.variance_k2[:, None] + noise
        if structure.offset:
            penalty = np.column_stack([penalty, np.zeros(self.variance_k2.size)])
        return penalty

    def errors(self, structure: Structure) -> FloatArray:
        """Return mean absolute errors in free run, (s, splits, o), NaN without held-out rows."""
        columns, penalties = self._columns(structure), self._penalties(structure)
        per_bank: list[FloatArray] = []
        for sums in self.sums:
            found = [_residuals(sums, s, columns, penalties) for s in self.splits]
            means = [_mean_absolute(sums, s, r) for s, r in zip(self.splits, found, strict=True)]
            per_bank.append(np.stack(means, axis=1))
        return np.concatenate(per_bank, axis=2)

    def average_errors(self, members: Sequence[Member]) -> FloatArray:
        """Return mean absolute errors of an average of models in free run, (splits, o)."""
        chosen = [
            (self._columns(m.structure), self._penalties(m.structure)[[m.position]], m.weight)
            for m in members
        ]
        per_bank: list[FloatArray] = []
        for sums in self.sums:
            means: list[FloatArray] = []
            for split in self.splits:
                shares = [weight * _residuals(sums, split, c, p) for c, p, weight in chosen]
                means.append(_mean_absolute(sums, split, np.sum(shares, axis=0))[0])
            per_bank.append(np.stack(means))
        return np.concatenate(per_bank, axis=1)

    def hold_errors(self) -> FloatArray:
        """Return the errors of repeating the last displacement before each part, (splits, o)."""
        per_bank = [np.stack([_hold_errors(sums, s) for s in self.splits]) for sums in self.sums]
        return np.concatenate(per_bank, axis=1)

    def fit(self, structure: Structure, position: int) -> FloatArray:
        """Return the gains from all parts, (p, o), for one uncertainty of the temperatures."""
        columns = self._columns(structure)
        penalty = self._penalties(structure)[position : position + 1]
        every = tuple(range(self.sums[0].weight.size))
        fits = [_gains(sums, every, columns, penalty) for sums in self.sums]
        return np.concatenate([f[0] for f in fits if f is not None], axis=1)

    def correlation(self, channels: Sequence[int]) -> FloatArray:
        """Return how the channels move together over all parts, (c, c). [1]"""
        square = np.sum(self.sums[0].square, axis=0)
        columns = [*channels, square.shape[0] - 1]
        moments = square[np.ix_(columns, columns)]
        moments = moments / moments[-1, -1]
        mean = moments[:-1, -1]
        covariance = moments[:-1, :-1] - np.outer(mean, mean)
        scale = np.sqrt(np.maximum(np.diag(covariance), np.finfo(np.float64).tiny))
        return np.asarray(covariance / np.outer(scale, scale))


def validation_of(
    banks: Sequence[Bank],
    parts: int,
    noise_k: FloatArray,
    sensor_uncertainties_k: FloatArray,
) -> Validation:
    """Sum up a record."""
    return Validation(
        noise_variance_k2=noise_k**2,
        variance_k2=sensor_uncertainties_k**2,
        splits=splits_of(parts),
        sums=tuple(_sums(bank, parts) for bank in banks),
    )


def _sums(bank: Bank, parts: int) -> Sums:
    rows = tuple(np.flatnonzero(bank.part == i) for i in range(parts))
    size, outputs = bank.regressors.shape[1], bank.displacement.shape[1]
    square = np.zeros((parts, size, size))
    product = np.zeros((parts, size, outputs))
    weight = np.zeros(parts)
    for i, own in enumerate(rows):
        weighted = bank.regressors[own] * bank.weight[own, None]
        square[i] = weighted.T @ bank.regressors[own]
        product[i] = weighted.T @ bank.displacement[own]
        weight[i] = float(np.sum(bank.weight[own]))
    return Sums(bank=bank, square=square, product=product, weight=weight, rows=rows)


def _gains(
    sums: Sums, learn: Sequence[int], columns: IndexArray, penalties: FloatArray
) -> FloatArray | None:
    """Return the gains of every penalty, (s, p, o), or None where there is nothing to learn from.

    Ridge regression: the smallest mean square error plus penalty times squared gains, which is
    the mean square error to be expected where every temperature is uncertain by the square root
    of the penalty.
    """
    chosen = list(learn)
    weight = float(np.sum(sums.weight[chosen]))
    if weight == 0.0:
        return None
    square = np.sum(sums.square[chosen][:, columns[:, None], columns[None, :]], axis=0) / weight
    product = np.sum(sums.product[chosen][:, columns], axis=0) / weight
    left = np.repeat(square[None], penalties.shape[0], axis=0)
    diagonal = np.arange(columns.size)
    left[:, diagonal, diagonal] += penalties
    right = np.repeat(product[None], penalties.shape[0], axis=0)
    return np.asarray(np.linalg.solve(left, right), dtype=np.float64)


def _residuals(sums: Sums, split: Split, columns: IndexArray, penalties: FloatArray) -> FloatArray:
    """Return simulated less measured on the part held out, (s, n, o); NaN without a model."""
    rows = sums.rows[split.judge]
    gains = _gains(sums, split.learn, columns, penalties) if rows.size else None
    if gains is None:
        shape = (penalties.shape[0], rows.size, sums.bank.displacement.shape[1])
        return np.full(shape, np.nan)
    return sums.bank.regressors[rows][:, columns] @ gains - sums.bank.displacement[rows]


def _mean_absolute(sums: Sums, split: Split, residual: FloatArray) -> FloatArray:
    """Return mean absolute residuals, (s, o); NaN where nothing is held out."""
    if residual.shape[1] == 0:
        return np.full((residual.shape[0], residual.shape[2]), np.nan)
    weight = sums.bank.weight[sums.rows[split.judge]]
    share = weight / float(np.sum(weight))
    return np.einsum("n,sno->so", share, np.abs(residual), dtype=np.float64)


def _hold_errors(sums: Sums, split: Split) -> FloatArray:
    bank, rows = sums.bank, sums.rows[split.judge]
    if rows.size == 0:
        return np.full((bank.displacement.shape[1],), np.nan)
    before = np.flatnonzero(
        (bank.part < split.judge) & (bank.experiment == bank.experiment[rows[0]])
    )
    held = bank.displacement[before[-1]] if before.size else np.zeros(bank.displacement.shape[1])
    return _mean_absolute(sums, split, np.abs(bank.displacement[rows] - held)[None])[0]
