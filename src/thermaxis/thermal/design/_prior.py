"""What is known of gains before a test: moments over a grid of time constants, from draws.

Lags are drawn, each with its gain, and put onto the grid. Mean and covariance of the draws are all
that linear prediction needs: its mean square error over the draws is exactly what the Gaussian
with these moments says.
"""

from dataclasses import dataclass
from typing import final

import numpy as np
from scipy.linalg import block_diag  # pyright: ignore[reportUnknownVariableType] - no types

from thermaxis.compensation import CompensationModel, Part
from thermaxis.errors import ConfigurationError
from thermaxis.thermal._arrays import FloatArray
from thermaxis.thermal.design._conditions import (
    HeatingConditions,
    HeatSource,
    KnownModel,
    LagRange,
)

GRID = 12
"""Time constants of the grid. [1]"""
DRAWS = 4000
"""Draws of lags and gains: moments within about 2 %. [1]"""
_SEED = 1
_LEAST_SHARE = 1e-6


@final
@dataclass(frozen=True, slots=True, eq=False)
class GainsPrior:
    """Moments of what all sources do: gains at the highest level, source after source."""

    time_constants_s: FloatArray
    """The grid, (j,). [s]"""
    mean_um: FloatArray
    """Mean gains, direct and at each lag, (s (1 + j),). [µm]"""
    factor_um: FloatArray
    """Factor L of their covariance L L', (s (1 + j), r). [µm]"""


def prior_of(
    conditions: HeatingConditions, model: CompensationModel | None = None, *, draws: int = DRAWS
) -> GainsPrior:
    """Return what is known: nothing but orders of magnitude, or a model and how far it may be off.

    Notes
    -----
    Nothing known: `lags.number` time constants, log-uniform between the stated ones, and a direct
    gain, each gain normal around zero with displacement_um / sqrt(1 + number). A model: its gains
    times normals around one, its time constants log-normal.

    Raises
    ------
    ConfigurationError
        If a model is known that has no part with the name of a source.
    """
    low_s, high_s = (60.0 * end for end in conditions.lags.between_min)
    known = conditions.known
    parts = dict[str, Part]()
    if known is not None:
        if model is None:
            raise ConfigurationError("missing_key", key="known.model")
        own = [one for one in model.outputs if one.name == conditions.output]
        parts = {part.name: part for one in own for part in one.parts}
        for name in conditions.sources:
            if name not in parts:
                output = conditions.output
                raise ConfigurationError(
                    "source_not_in_model", name=name, output=output, file=known.model, key=name
                )
        taus_s = [x.time_constant_s for n in conditions.sources for x in parts[n].sections]
        low_s = min(low_s, min(taus_s, default=low_s) * float(np.exp(-2.0 * known.spread)))
        high_s = max(high_s, max(taus_s, default=high_s) * float(np.exp(2.0 * known.spread)))
    grid_s = np.geomspace(low_s, max(high_s, low_s * 1.01), GRID)
    rng = np.random.default_rng(_SEED)
    means, factors = list[FloatArray](), list[FloatArray]()
    for name, source in conditions.sources.items():
        if known is not None:
            drawn = _around(rng, draws, parts[name], source, known)
        else:
            drawn = _unknown(rng, draws, source, conditions.lags)
        gains = _on_grid(*drawn, grid_s)
        covariance = np.asarray(np.cov(gains.T), dtype=np.float64)
        size = _LEAST_SHARE * float(np.trace(covariance)) / len(covariance)
        mean = np.mean(gains, axis=0) if name in parts else np.zeros(1 + GRID)
        means.append(np.asarray(mean, dtype=np.float64))
        covariance += size * np.eye(1 + GRID)
        factors.append(np.asarray(np.linalg.cholesky(covariance), dtype=np.float64))
    factor = np.asarray(block_diag(*factors), dtype=np.float64)
    return GainsPrior(grid_s, np.concatenate(means), factor)


_Drawn = tuple[FloatArray, FloatArray, FloatArray]
"""Direct gains, (d,), gains, (d, j), and logarithms of their time constants, (d, j)."""


def _unknown(rng: np.random.Generator, draws: int, source: HeatSource, lags: LagRange) -> _Drawn:
    low, high = np.log(np.array(lags.between_min) * 60.0)
    std_um, shape = source.displacement_um / np.sqrt(1.0 + lags.number), (draws, lags.number)
    taus = rng.uniform(low, high, shape)
    return rng.normal(0.0, std_um, draws), rng.normal(0.0, std_um, shape), taus


def _around(
    rng: np.random.Generator, draws: int, part: Part, source: HeatSource, known: KnownModel
) -> _Drawn:
    share, spread = known.gains_percent / 100.0, known.spread
    gains_um = source.temperature_k * np.array([one.gain_um_per_k for one in part.sections])
    log_taus = np.log([one.time_constant_s for one in part.sections])
    direct_um = source.temperature_k * part.direct_gain_um_per_k
    # a sister may have a direct gain where this model has none, of the size that gains have
    size_um = share * float(np.sqrt(np.sum(gains_um**2) + direct_um**2) + 1e-9)
    direct = direct_um + rng.normal(0.0, size_um / np.sqrt(1.0 + gains_um.size), draws)
    gains = gains_um * (1.0 + rng.normal(0.0, share, (draws, gains_um.size)))
    return direct, gains, log_taus + rng.normal(0.0, spread, gains.shape)


def _on_grid(
    direct: FloatArray, gains: FloatArray, log_taus: FloatArray, grid_s: FloatArray
) -> FloatArray:
    """Return gains put onto the grid, each onto both neighbours, (d, 1 + j). [µm]"""
    grid, rows = np.log(grid_s), np.arange(len(gains))
    found = np.zeros((len(gains), 1 + grid.size))
    found[:, 0] = direct
    left = np.clip(np.searchsorted(grid, log_taus) - 1, 0, grid.size - 2)
    share = np.clip((log_taus - grid[left]) / (grid[left + 1] - grid[left]), 0.0, 1.0)
    for j in range(gains.shape[1]):
        np.add.at(found, (rows, 1 + left[:, j]), gains[:, j] * (1.0 - share[:, j]))
        np.add.at(found, (rows, 2 + left[:, j]), gains[:, j] * share[:, j])
    return found
