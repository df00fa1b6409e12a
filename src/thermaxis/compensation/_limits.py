"""Limits of a correction: how large it may become and how fast it may change."""

import math
from dataclasses import dataclass

from thermaxis.errors import require_positive, require_range

LARGEST_LIMIT_UM = 1e4
"""Largest output limit and total limit: ten millimetres. [µm]"""
FASTEST_LIMIT_UM_PER_S = 1e3
"""Fastest change that a limit may allow. [µm/s]"""
COARSE_TRIM_UM = 5.0
"""Coarse step of the operator's screen. [µm]"""
SETTLED_UM = 1.0
"""A correction that is no further beyond its deadband from what is wanted has settled. [µm]"""


@dataclass(frozen=True, slots=True)
class Limits:
    """Limits of one output. Output limit and rate have no default: they must be stated.

    Not protected: a limit bounds what is asked of the machine; whether the machine does what it
    is asked is shown by reading back only.

    Raises
    ------
    ConfigurationError
        If output limit or rate is not a positive number of at most 10 mm, or 1 mm/s, the total
        limit is smaller than the output limit, or deadband, soft limit or trim lie beyond it.
    """

    largest_um: float
    """Output limit: the correction without trim is no larger, up or down; up to 10 000. [µm]"""
    largest_rate_um_per_s: float
    """Fastest change of the correction, also while it fades, up to 1000. [µm/s]"""
    total_um: float = 0.0
    """Total limit: of correction and trim together. Default: a trim is no way around the limit.
    Without it: that of `largest_um`. [µm]"""
    deadband_um: float = 0.0
    """The correction stays until the model asks for something that differs by more. Default:
    none. [µm]"""
    soft_um: float = 0.0
    """Magnitude from which the operator is warned. Without it: four fifths of `largest_um`. [µm]"""
    largest_trim_um: float = COARSE_TRIM_UM
    """Largest trim. Default: one coarse step of the operator's screen, but no more than the
    total. [µm]"""

    def __post_init__(self) -> None:
        """Check the numbers and fill in what follows from the output limit."""
        for name, value, largest in (
            ("largest_um", self.largest_um, LARGEST_LIMIT_UM),
            ("largest_rate_um_per_s", self.largest_rate_um_per_s, FASTEST_LIMIT_UM_PER_S),
        ):
            require_positive(name, value, largest)
        if self.total_um == 0.0:
            object.__setattr__(self, "total_um", self.largest_um)
        if self.soft_um == 0.0:
            object.__setattr__(self, "soft_um", 0.8 * self.largest_um)
        require_range("total_um", self.total_um, self.largest_um, LARGEST_LIMIT_UM)
        if self.largest_trim_um == COARSE_TRIM_UM:
            object.__setattr__(self, "largest_trim_um", min(COARSE_TRIM_UM, self.total_um))
        for name, value in (
            ("deadband_um", self.deadband_um),
            ("soft_um", self.soft_um),
            ("largest_trim_um", self.largest_trim_um),
        ):
            require_range(name, value, 0.0, self.total_um)


def limit_step(limits: Limits, before_um: float, wanted_um: float, elapsed_s: float) -> float:
    """Return the correction that is allowed next.

    Not protected: where the correction in force lies outside the total, as after the limits were
    narrowed, it lies outside until the rate has brought it back. Whether the machine follows is
    shown by reading back only.

    Parameters
    ----------
    limits : Limits
        The limits.
    before_um : float
        Correction in force; counts as zero if it is no finite number. [µm]
    wanted_um : float
        Correction that is asked for; if it is no finite number, the one in force is kept. [µm]
    elapsed_s : float
        Time since the correction in force was set; below zero or no number counts as zero. [s]

    Returns
    -------
    float
        The wanted correction within the total, reached as fast as the rate allows and never
        faster. [µm]
    """
    before = before_um if math.isfinite(before_um) else 0.0
    step = limits.largest_rate_um_per_s * elapsed_s if 0.0 < elapsed_s < math.inf else 0.0
    goal = wanted_um if math.isfinite(wanted_um) else before
    goal = min(max(goal, -limits.total_um), limits.total_um)
    return min(max(goal, before - step), before + step)


def goal_step(limits: Limits, before_um: float, wanted_um: float, in_force_um: float) -> float:
    """Return where the correction goes: the last goal, until another differs by more.

    Zero and the correction in force are goals that no deadband keeps away.
    """
    near = abs(wanted_um - before_um) <= limits.deadband_um
    return before_um if near and wanted_um not in {0.0, in_force_um} else wanted_um
