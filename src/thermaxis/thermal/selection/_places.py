"""Which few of many places of sensors a model needs: every subset is compared."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import final

import numpy as np

from thermaxis.errors import ConfigurationError, require_range
from thermaxis.thermal._arrays import FloatArray
from thermaxis.thermal.log import Experiment
from thermaxis.thermal.selection._bank import Bank, IndexArray, banks_of, record_parts

LAGS_S = (300.0, 1200.0, 3600.0, 10800.0)
"""Lags of every place beside its direct gain. [s]"""
RIDGES = (1e-4, 1e-3, 1e-2, 1e-1)
"""Ridges that are tried, relative to the mean square of a column. [1]"""
PARTS = 6
"""Parts of the records that are held out in turn. [1]"""
MOST_SUBSETS = 20_000
_AT_ONCE = 500
_OFFSET_RIDGE = 1e-3
_MEAN_S = 300.0


@final
@dataclass(frozen=True, slots=True)
class PlacesError:
    """Some places, and how far free runs from them are off in parts of the record held out."""

    places: tuple[str, ...]
    error_um: float
    """Root mean square over outputs. [µm]"""


@final
@dataclass(frozen=True, slots=True)
class PlacesResult:
    """What places are worth."""

    every: PlacesError
    """All candidates together."""
    best: PlacesError
    """The best subset of the number that was asked for."""
    median_um: float
    """Median error of all subsets of this number. [µm]"""
    compared: int
    """Number of these subsets. [1]"""
    without: Mapping[str, float]
    """Error without one of the best places, by its name. [µm]"""


def best_places(
    outputs: Mapping[str, Sequence[Experiment]], names: Sequence[str], count: int
) -> PlacesResult:
    """Return the best places for sensors, by free runs over parts of the records held out.

    Parameters
    ----------
    outputs : mapping
        Experiments by output; their inputs are the candidates, the same for all.
    names : sequence of str
        Names of the candidates.
    count : int
        Number of places wanted. [1]

    Returns
    -------
    PlacesResult
        The subset with the least error, and what the loss of each of its places costs.

    Raises
    ------
    ConfigurationError
        If there are not more candidates than places wanted, or too many subsets to compare.

    Notes
    -----
    Every subset has a ridge regression on its inputs and four lags of each; one matrix of products
    for each part gives all of them. Of several ridges that with the least error over the parts
    held out is taken, for each subset its own. Outputs count relative to their spread.
    """
    require_range("--places", count, 1, len(names) - 1)
    subsets = math.comb(len(names), count)
    if subsets > MOST_SUBSETS:
        raise ConfigurationError(
            "too_many_subsets", subsets=subsets, most=MOST_SUBSETS, key="--places"
        )
    experiments = next(iter(outputs.values()))
    parts = record_parts(experiments, PARTS)
    step_s = max(e.sample_time_s for e in experiments)
    columns = range(len(names))
    banks = banks_of(outputs, columns, np.array(LAGS_S), max(_MEAN_S, step_s), parts)
    every = np.array(list(combinations(columns, count)), dtype=np.intp)
    errors = _errors_um(banks, every, len(names))
    best: list[int] = every[int(np.argmin(errors))].tolist()

    def error_um(places: Sequence[int]) -> float:
        return float(_errors_um(banks, np.array([places], dtype=np.intp), len(names))[0])

    without = {names[p]: error_um([q for q in best if q != p]) for p in best if count > 1}
    return PlacesResult(
        every=PlacesError((*names,), error_um(list(columns))),
        best=PlacesError(tuple(names[p] for p in best), float(errors.min())),
        median_um=float(np.median(errors)),
        compared=subsets,
        without=without,
    )


def _errors_um(banks: Sequence[Bank], subsets: IndexArray, places: int) -> FloatArray:
    """Return the error of subsets, (m,): that relative to the spreads, in their mean square."""
    total, spreads = np.zeros(len(subsets)), list[float]()
    for bank in banks:
        spread = np.sqrt(np.mean(np.square(bank.displacement), axis=0))
        squares = _held_out(bank, subsets, places)
        total += np.sum(squares / np.maximum(spread, 1e-12) ** 2, axis=1)
        spreads += spread.tolist()
    return np.asarray(np.sqrt(total / len(spreads)) * float(np.sqrt(np.mean(np.square(spreads)))))


def _held_out(bank: Bank, subsets: IndexArray, places: int) -> FloatArray:
    """Return mean squares of what is left of parts held out, the best ridge, (m, o). [µm²]"""
    x = bank.regressors / np.sqrt(np.maximum(np.mean(np.square(bank.regressors), axis=0), 1e-24))
    lags = np.arange(1 + len(LAGS_S)) * places
    offset = np.full((len(subsets), 1), x.shape[1] - 1)
    columns = np.hstack([(subsets[:, :, None] + lags).reshape(len(subsets), -1), offset])
    rows = [bank.part == part for part in np.unique(bank.part)]
    grams = [(x[r] * bank.weight[r, None]).T @ x[r] for r in rows]
    rights = [(x[r] * bank.weight[r, None]).T @ bank.displacement[r] for r in rows]
    squares = [bank.weight[r] @ np.square(bank.displacement[r]) for r in rows]
    weight, own = float(np.sum(bank.weight)), np.arange(int(columns.shape[1]))
    gram_of_all: FloatArray = np.sum(grams, axis=0)
    right_of_all: FloatArray = np.sum(rights, axis=0)
    left = np.full((len(RIDGES), len(subsets), bank.displacement.shape[1]), 0.0)
    for k, ridge in enumerate(RIDGES):
        added = weight * np.where(own < own.size - 1, ridge, _OFFSET_RIDGE)
        for begin in range(0, len(subsets), _AT_ONCE):
            some = slice(begin, begin + _AT_ONCE)
            at = columns[some]
            for gram, right, square in zip(grams, rights, squares, strict=True):
                others: FloatArray = (gram_of_all - gram)[at[:, :, None], at[:, None, :]]
                others[:, own, own] += added
                wanted: FloatArray = (right_of_all - right)[at]
                gains = np.asarray(np.linalg.inv(others) @ wanted, dtype=np.float64)
                answered: FloatArray = gram[at[:, :, None], at[:, None, :]] @ gains
                left[k, some] += square + np.sum(gains * (answered - 2.0 * right[at]), axis=1)
    return np.maximum(left.min(axis=0), 0.0) / weight
