"""Simple models that stand beside every identified one: what is gained must be seen."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import final

import numpy as np

from thermaxis.errors import ConfigurationError, DataError
from thermaxis.thermal._arrays import FloatArray, frozen_array
from thermaxis.thermal.log import Experiment, common_shape
from thermaxis.thermal.transfer_function import (
    held,
    section_response,
    solve_triangle,
    triangle,
)

AVERAGE_LAGS_S = (300.0, 1200.0, 3600.0, 10_800.0)
"""Time constants of the fixed exponential averages: 5 min to 3 h, what machines have. [s]"""
DEFAULT_RIDGE = 1e-3
"""Penalty of the ridge on standardised columns, times the rows. [1]"""


class Baseline(StrEnum):
    """Which simple model."""

    PERSISTENCE = "persistence"
    """The last measured displacement stays."""
    STATIC = "static"
    """A gain per input, no lag: multiple linear regression."""
    RIDGE = "ridge"
    """The same with a penalty on large gains, for inputs that repeat each other."""
    AVERAGES = "averages"
    """Gains on every input and on its exponential averages with fixed lags."""
    AVERAGES_RIDGE = "averages_ridge"
    """The same with a penalty on large gains."""


@final
@dataclass(frozen=True, slots=True, eq=False)
class BaselineModel:
    """A fitted simple model."""

    baseline: Baseline
    offset_um: float
    """Displacement where every input is at its reference; all there is of persistence. [µm]"""
    gains_um_per_k: FloatArray
    """Gain of every input and lag, (k, 1 + lags), the direct gain first; (k, 0) for persistence.
    [µm/K]"""
    lags_s: tuple[float, ...]
    """Time constants of the averages; empty where there are none. [s]"""
    rows: int
    """Rows that were used. [1]"""


def fit_baseline(
    baseline: Baseline,
    experiments: Sequence[Experiment],
    *,
    ridge: float = DEFAULT_RIDGE,
    lags_s: Sequence[float] = AVERAGE_LAGS_S,
    offset: bool = True,
) -> BaselineModel:
    """Fit a simple model.

    Parameters
    ----------
    experiments : sequence of Experiment
        Tests; sample times may differ. Missing displacements leave their rows out, missing inputs
        are held.
    ridge : float
        Penalty per row on the squares of the standardised gains; for the ridges only. Default:
        0.001. [1]
    lags_s : sequence of float
        Time constants of the averages; for these only. Default: 300, 1200, 3600 and 10,800 s. [s]
    offset : bool
        Whether the displacement at the reference is free; else it is zero, as for a model that is
        run from the start of a log. Default: free.

    Returns
    -------
    BaselineModel
        Gains and offset. Persistence holds the last measured displacement of the last test.

    Raises
    ------
    DataError
        If the numbers of inputs differ or the rows do not determine the gains.
    ConfigurationError
        If the penalty is negative or a lag is not positive.
    """
    inputs = common_shape(experiments)
    if not (np.isfinite(ridge) and ridge >= 0):
        raise ConfigurationError("outside_range", value=ridge, least=0.0, most=np.inf, key="ridge")
    if any(not (np.isfinite(lag) and lag > 0) for lag in lags_s):
        raise ConfigurationError("not_positive", value=min(lags_s), key="lags_s")
    rows = sum(int(np.count_nonzero(~np.isnan(e.y))) for e in experiments)
    if baseline is Baseline.PERSISTENCE:
        last = experiments[-1].y
        value = float(last[np.flatnonzero(~np.isnan(last))[-1]])
        return BaselineModel(baseline, value, frozen_array(np.zeros((inputs, 0))), (), rows)
    lags = tuple(lags_s) if baseline in _WITH_AVERAGES else ()
    penalty = ridge if baseline in _WITH_PENALTY else 0.0
    width = inputs * (1 + len(lags)) + 2
    factor = np.zeros((width, width))
    for experiment in experiments:
        measured = ~np.isnan(experiment.y)
        columns = (one[measured] for one in _columns(experiment.u, experiment.sample_time_s, lags))
        y = experiment.y[measured]
        factor = triangle([factor, np.column_stack([np.ones(y.size), *columns, y])])
    offset_um, gains = _solved(factor, penalty, rows, offset=offset)
    return BaselineModel(
        baseline, offset_um, frozen_array(gains.reshape(inputs, 1 + len(lags))), lags, rows
    )


_WITH_AVERAGES = (Baseline.AVERAGES, Baseline.AVERAGES_RIDGE)
_WITH_PENALTY = (Baseline.RIDGE, Baseline.AVERAGES_RIDGE)


def _columns(u: FloatArray, sample_time_s: float, lags_s: Sequence[float]) -> Iterator[FloatArray]:
    """Yield every input followed by its averages, k (1 + lags) columns."""
    values, _ = held(u)
    for column in values.T:
        own = np.ascontiguousarray(column)
        yield own
        for lag in lags_s:
            yield section_response(own, lag, sample_time_s, float(own[0]))


def _solved(
    factor: FloatArray, penalty: float, rows: int, *, offset: bool
) -> tuple[float, FloatArray]:
    """Return offset and gains; the offset is not penalised."""
    # the first row of the factor is the mean, the rest is about it
    about_mean = factor[1:, 1:] if offset else triangle([factor[:, 1:]])
    spread = np.linalg.norm(about_mean[:, :-1], axis=0) / np.sqrt(rows)
    if penalty > 0.0:
        root = np.sqrt(penalty * rows) * spread
        extra = np.column_stack([np.diag(root), np.zeros(root.size)])
        about_mean = triangle([about_mean, extra])
    elif rows < factor.shape[1]:
        raise DataError("rows_not_enough", rows=rows, parameters=factor.shape[1] - 1)
    gains = solve_triangle(about_mean).parameters
    if not offset:
        return 0.0, gains
    return float(factor[0, -1] - factor[0, 1:-1] @ gains) / float(factor[0, 0]), gains
