"""Find positions whose spread stands out from that of the rest of the axis.

Of every cycle, each position is compared with the straight line through its two neighbours
(at the ends with the line through the next positions), so that whatever the neighbours share,
the thermal drift above all, drops out. The spread of this local deviation over the cycles is
compared with that of all positions. If every position scatters alike and normally, the ratio is
one of quadratic forms in normal variables, whose distribution is known exactly for any number
of positions and cycles and for any spacing (Imhof 1961).
"""

from dataclasses import dataclass
from typing import final

import numpy as np

from thermaxis.positioning.run import FloatArray

MINIMUM_POSITIONS = 5
"""With fewer positions the local deviations are too few to tell them apart. [1]"""
SMALLEST_RATIO = 1.5
"""A spread that is less above that of the other positions is not named, however certain: with
many cycles any real axis would get names. Own choice. [1]"""
MOST_POSITIONS = 500
"""With more positions the exact distribution takes too long (cost: third power). [1]"""
MINIMUM_CYCLES = 3
"""With fewer complete cycles a spread says nothing. [1]"""


def spread_can_be_tested(deviation: FloatArray) -> bool:
    """Return whether there are enough positions and complete cycles to test for anomalies."""
    complete = int(np.sum(~np.any(np.isnan(deviation), axis=0)))
    return MINIMUM_POSITIONS <= deviation.shape[0] <= MOST_POSITIONS and complete >= MINIMUM_CYCLES


@final
@dataclass(frozen=True, slots=True)
class SpreadAnomaly:
    """A position whose spread stands out."""

    position: int
    """Number of the position, from 1. [1]"""
    target: float
    """The target position. [mm or deg]"""
    statistic: float
    """Estimated spread of the position over that of the others. [1]"""
    p_value: float
    """Probability of such a ratio at this one position if all scatter alike. [1]"""


def local_deviation_contrasts(target: FloatArray) -> FloatArray:
    """Return the weights that turn one cycle's readings into local deviations."""
    m = target.size
    contrast = np.zeros((m, m))
    for p in range(1, m - 1):
        span = target[p + 1] - target[p - 1]
        contrast[p, p - 1] = -(target[p + 1] - target[p]) / span
        contrast[p, p + 1] = -(target[p] - target[p - 1]) / span
        contrast[p, p] = 1.0
    for end, neighbour, step in ((0, 1, 1), (m - 1, m - 2, -1)):
        beyond = [end + step * k for k in range(1, min(5, m))]
        offset = target[beyond] - np.mean(target[beyond])
        contrast[end, beyond] -= (target[end] - target[neighbour]) * offset / np.sum(offset**2)
        contrast[end, end] += 1.0
        contrast[end, neighbour] -= 1.0
    return contrast


def probability_positive(weight: FloatArray, degrees_of_freedom: int) -> float:
    """Return the probability that a weighted sum of independent chi-squared variables is positive.

    References
    ----------
    J. P. Imhof, Computing the distribution of quadratic forms in normal variables, Biometrika
    48 (1961) 419, equation (3.2); the integral is taken over the logarithm of its variable.
    """
    scale = float(np.max(np.abs(weight)))
    if scale == 0.0:
        return 0.0
    relative = weight[np.abs(weight) > 1e-12 * scale] / scale
    v = np.linspace(-26.0, 14.0, 4001)
    argument = np.outer(np.exp(v), relative)
    theta = 0.5 * degrees_of_freedom * np.sum(np.arctan(argument), axis=1)
    log_rho = 0.25 * degrees_of_freedom * np.sum(np.log1p(argument**2), axis=1)
    integral = np.sum(np.sin(theta) * np.exp(-log_rho)) * (v[1] - v[0])
    return float(np.clip(0.5 + integral / np.pi, 0.0, 1.0))


def _spread_ratio(variance: FloatArray, p: int, *, own_share: float) -> float:
    """Return the spread of position p over that of the others.

    A local deviation holds the position's own scatter to a share only; the rest is that of the
    positions it is compared with, taken to scatter like all others.
    """
    others = (float(np.sum(variance)) - float(variance[p])) / (variance.size - 1)
    if others <= 0.0:
        return float("inf")
    own = (float(variance[p]) / others - (1.0 - own_share)) / own_share
    return float(np.sqrt(max(own, 0.0)))


def find_spread_anomalies(
    target: FloatArray, deviation: FloatArray, *, level: float
) -> tuple[SpreadAnomaly, ...]:
    """Name the positions whose spread stands out, one approach of one run.

    The position with the largest ratio is named if its probability is below `level` divided by
    the number of positions and its spread is at least 1.5 times that of the others; it is then
    left out and the rest is tested again.

    Parameters
    ----------
    target : FloatArray
        Target positions, (m,). [mm or deg]
    deviation : FloatArray
        Deviations of one approach, (m, n); cycles with a missing reading are left out.
        [µm or arcsec]
    level : float
        Probability of naming any position when all scatter alike, at most. [1]

    Returns
    -------
    tuple of SpreadAnomaly
        In the order in which they were found; empty also where `spread_can_be_tested` says no.

    Notes
    -----
    The probability is exact for readings that are independent, normal and scatter alike at all
    positions. Heavier tails, or a spread that changes along the axis, name more.

    References
    ----------
    Stejskal et al. 2017, figure 10 (the idea); W. G. Cochran 1941 (largest variance as a
    fraction of all), here for correlated differences.
    """
    if not spread_can_be_tested(deviation):
        return ()
    complete = deviation[:, ~np.any(np.isnan(deviation), axis=0)]
    n = complete.shape[1]
    kept = np.arange(target.size)
    found: list[SpreadAnomaly] = []
    while kept.size >= MINIMUM_POSITIONS:
        m = kept.size
        contrast = local_deviation_contrasts(target[kept])
        contrast /= np.sqrt(np.sum(contrast**2, axis=1, keepdims=True))
        local = contrast @ complete[kept]
        variance = np.var(local, axis=1, ddof=1)
        total = float(np.sum(variance))
        if total == 0.0:
            break
        p = int(np.argmax(variance))
        share = float(variance[p]) / total
        form = np.outer(contrast[p], contrast[p]) - share * (contrast.T @ contrast)
        probability = probability_positive(
            np.asarray(np.linalg.eigvalsh(form), dtype=np.float64), n - 1
        )
        ratio = _spread_ratio(variance, p, own_share=float(contrast[p, p] ** 2))
        if probability * m >= level or ratio < SMALLEST_RATIO:
            break
        found.append(
            SpreadAnomaly(
                position=int(kept[p]) + 1,
                target=float(target[kept[p]]),
                statistic=ratio,
                p_value=probability,
            )
        )
        kept = np.delete(kept, p)
    return tuple(found)
