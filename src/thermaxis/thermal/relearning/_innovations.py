"""What a touch adds to what the touches before it have told, and whether another model adds less.

The offset between a model and the touches is a random walk, as in `cycle` (`TouchFilter`): what is
left of it from touch to touch, the innovations, hardly depend on each other, and a drift that no
model explains, such as wear, is hardly in them. The filter is linear, so that the difference of two
models' innovations is what it makes of the difference of the models.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import final

import numpy as np
from numpy.typing import NDArray

from thermaxis.thermal._arrays import FloatArray

CLIPPED = 4.0
"""An innovation counts as no more than so many standard deviations: chips, another datum. [1]"""
_UNKNOWN_UM2 = 1e8


@final
@dataclass(frozen=True, slots=True, eq=False)
class Innovations:
    """The filter of touches at given times, with a gain and a size for each."""

    gain: FloatArray
    """Kalman gain of each touch, (m,). [1]"""
    std_um: FloatArray
    """Standard deviation of each innovation, (m,). [µm]"""

    def of(self, left_um: FloatArray) -> FloatArray:
        """Return what touches leave of a model, (m,) or (m, c), as innovations in their sizes."""
        found = np.empty_like(left_um)
        offset = np.zeros(left_um.shape[1:])
        for k, gain in enumerate(self.gain.tolist()):
            found[k] = left_um[k] - offset
            offset = offset + gain * found[k]
        return (found.T / self.std_um).T


def innovations_of(
    time_s: FloatArray,
    noise_um: float,
    drift_um_per_root_h: float,
    anew: NDArray[np.bool_] | None = None,
) -> Innovations:
    """Return the filter of touches at times, (m,); nothing is known before the first, or anew."""
    grown_um2 = drift_um_per_root_h**2 * np.diff(time_s, prepend=time_s[:1]) / 3600.0
    if anew is not None:
        grown_um2[anew] = _UNKNOWN_UM2
    gain, std_um = np.empty_like(time_s), np.empty_like(time_s)
    p_um2 = _UNKNOWN_UM2
    for k, q in enumerate(grown_um2.tolist()):
        p_um2 += q
        s_um2 = p_um2 + noise_um**2
        gain[k], std_um[k] = p_um2 / s_um2, s_um2**0.5
        p_um2 *= 1.0 - gain[k]
    return Innovations(gain, std_um)


@final
@dataclass(frozen=True, slots=True)
class Comparison:
    """Two models on the same touches."""

    share: float
    """How far the truth lies from the old model (0) to the new one (1). [1]"""
    least_share: float
    """The lower end of its one-sided interval: beyond zero the old one is not right. [1]"""
    old_um: float
    """Root mean square innovation of the old model. [µm]"""
    new_um: float
    """That of the new one. [µm]"""
    blocks: int
    """Independent blocks that touches were grouped in. [1]"""


def compared(
    old: FloatArray, new: FloatArray, std_um: FloatArray, block: Sequence[int], false_rate: float
) -> Comparison | None:
    """Return whether a new model leaves less of the same touches; None where nothing can be said.

    Notes
    -----
    With the innovations e of the old model, in their sizes and clipped, and what the new one takes
    from them, g = e(old) - e(new), let e = b g + noise: b is 0 where the old model is right, 1
    where the new one is, and the squares fall where b > 1/2. Over blocks k

        b = sum C_k / sum G_k    C_k = sum e g    G_k = sum g^2
        var b = K / (K - 1) sum (C_k - b G_k)^2 / (sum G_k)^2

    and b is normal by the blocks: Student's t with K - 1 degrees of freedom.

    References
    ----------
    Harvey, Leybourne and Newbold 1998 (forecast encompassing); Liang and Zeger 1986 (variance from
    independent blocks). From memory.
    """
    from scipy.special import stdtrit  # noqa: PLC0415  scipy is slow to import

    e, g = np.clip(old, -CLIPPED, CLIPPED), old - new
    number = np.unique(np.asarray(block), return_inverse=True)[1]
    c, weight = np.bincount(number, e * g), np.bincount(number, g * g)
    count, total = c.size, float(np.sum(weight))
    if count < 2 or total <= 0.0:
        return None
    share = float(np.sum(c)) / total
    spread = float(np.sum((c - share * weight) ** 2)) * count / (count - 1)
    least = share - float(stdtrit(count - 1, 1.0 - false_rate)) * spread**0.5 / total
    rms = [
        float(np.sqrt(np.mean((np.clip(r, -CLIPPED, CLIPPED) * std_um) ** 2))) for r in (old, new)
    ]
    return Comparison(share, least, rms[0], rms[1], count)
