"""Limits of a correction: how large it may become and how fast it may change."""

import math
from dataclasses import dataclass
from typing import final

from thermaxis.errors import ConfigurationError

LARGEST_LIMIT_UM = 1e4
"""Largest magnitude that a limit may allow: ten millimetres. [µm]"""
FASTEST_LIMIT_UM_PER_S = 1e3
"""Fastest change that a limit may allow. [µm/s]"""


@final
@dataclass(frozen=True, slots=True)
class Limits:
    """Limits of one output. There is no default: both must be stated.

    Not protected: a limit bounds what is asked of the machine; whether the machine does what it
    is asked is shown by reading back only.

    Raises
    ------
    ConfigurationError
        If a limit is not a positive number of at most 10 mm, or 1 mm/s.
    """

    largest_um: float
    """Largest magnitude of the correction. [µm]"""
    largest_rate_um_per_s: float
    """Largest change of the correction in a second. [µm/s]"""

    def __post_init__(self) -> None:
        """Check the numbers."""
        for name, value, largest in (
            ("largest_um", self.largest_um, LARGEST_LIMIT_UM),
            ("largest_rate_um_per_s", self.largest_rate_um_per_s, FASTEST_LIMIT_UM_PER_S),
        ):
            if not 0.0 < value <= largest:
                raise ConfigurationError(
                    f"the limit is no positive number of at most {largest:g}", where=name
                )


def limit_step(limits: Limits, before_um: float, wanted_um: float, elapsed_s: float) -> float:
    """Return the correction that is allowed next.

    Not protected: where the correction in force lies outside the magnitude, or is no number, the
    step back is made at once, whatever the rate.

    Parameters
    ----------
    limits : Limits
        The limits.
    before_um : float
        Correction in force. [µm]
    wanted_um : float
        Correction that the model asks for; if it is no finite number, the one in force is kept.
        [µm]
    elapsed_s : float
        Time since the correction in force was set; below zero or no number counts as zero. [s]

    Returns
    -------
    float
        The wanted correction within the magnitude, reached as fast as the rate allows. It never
        leaves the magnitude; where the one in force lies outside it, it comes back at once, as
        a limit that was narrowed must hold. [µm]
    """
    largest = limits.largest_um
    kept = min(max(before_um, -largest), largest) if math.isfinite(before_um) else 0.0
    if not math.isfinite(wanted_um):
        return kept
    goal = min(max(wanted_um, -largest), largest)
    seconds = elapsed_s if math.isfinite(elapsed_s) and elapsed_s > 0.0 else 0.0
    step = limits.largest_rate_um_per_s * seconds
    return min(max(goal, kept - step), kept + step)
