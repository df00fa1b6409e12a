"""Types of quantities of machine axes: where they stand in the results, and their units."""

from dataclasses import dataclass, replace
from typing import final

from thermaxis.positioning import Edition
from thermaxis.quantities import AxisKind
from thermaxis.report._names import FIGURE_NAMES, FIGURE_SYMBOLS

NORMAL = "normal"
"""Distribution that k = 2 and 95.45 % belong to."""
_DRAWN = "empirical"
"""Distribution of what is drawn: no formula."""


@final
@dataclass(frozen=True, slots=True)
class QuantityType:
    """A type of quantity of machine axes."""

    name: str
    """Its name in the namespace ``thermaxis``."""
    key: str
    """Key of the results, within their part."""
    meaning: str
    """What it is, in words."""
    unit: str = "deviation"
    """`deviation`, `position`, `growth`, `time` or `one`."""
    uncertainty: str = ""
    """Key of its uncertainty; empty without one."""
    factor: str = ""
    """Key of the coverage factor; empty: the uncertainty is a standard uncertainty."""
    distribution: str = NORMAL
    """Distribution of what the value may be."""

    @property
    def ref_type(self) -> str:
        """Its name with the namespace."""
        return self.name if self.name.startswith("basic_") else f"thermaxis_{self.name}"

    def of_figure(self, figure: str, edition: Edition) -> "QuantityType":
        """Return the type of one figure of ISO 230-2."""
        words = f"{FIGURE_SYMBOLS[figure]}, {FIGURE_NAMES[edition][figure]}"
        return replace(self, name=figure + self.name, meaning=self.meaning.format(words))


_Q = QuantityType


def _figure(name: str, key: str, meaning: str, of: str = "") -> QuantityType:
    """Return a type whose U and k stand beside it in the table of figures."""
    u, k = f"{of}expanded_uncertainty", f"{of}coverage_factor"
    return QuantityType(name, key, meaning, "deviation", u, k, _DRAWN)


FIGURES = (
    _figure("", "value", "{}"),
    _Q("_bias", "bias", "bias of {}; contained in its U"),
)
"""What a figure of ISO 230-2 has in `figure_table`; `{}` is its symbol and name."""
DRIFT_FREE_FIGURES = (
    _figure("_driftFree", "drift_free", "{}, without drift", "drift_free_"),
    _Q("_driftFreeWithOutliers", "drift_free_with_outliers", "{}, without drift, of all readings"),
    _figure("_driftEffect", "drift_effect", "effect of the drift on {}", "drift_effect_"),
)
"""What it has there where the drift is known."""
TARGET = _Q("basic_nominalValue", "position", "target position", "position")
TARGETS = (
    _Q("mean_forward", "mean_forward", "mean deviation x̄↑"),
    _Q("mean_backward", "mean_backward", "mean deviation x̄↓"),
    _Q("mean", "mean", "mean bidirectional deviation x̄"),
    _Q("s_forward", "s_forward", "standard deviation s↑"),
    _Q("s_backward", "s_backward", "standard deviation s↓"),
    _Q("B_target", "B", "reversal value B of the target"),
    _Q("R_target_forward", "R_forward", "repeatability R↑ of the target"),
    _Q("R_target_backward", "R_backward", "repeatability R↓ of the target"),
    _Q("R_target", "R", "repeatability R of the target"),
)
"""Lists over the targets, in `iso230_2.targets` and `drift.iso230_2.targets`."""
LEVELS = tuple(
    _Q(f"level_{way}", f"levels_{way}", f"level at t0 {arrow}", uncertainty=f"levels_std_{way}")
    for way, arrow in (("forward", "↑"), ("backward", "↓"))
)
"""Lists over the targets, in `drift`."""
DRIFT = (
    _Q("drift_p", "p_no_drift", "p value of no drift", "one"),
    _Q("drift_shift", "total", "shift of the whole axis over the run"),
    _Q("drift_shift_bound", "total_within", "bound of the error of this shift"),
    _Q("drift_growth", "total_per_m", "thermal growth over the run", "growth"),
    _Q("drift_growth_bound", "total_per_m_within", "bound of the error of this growth", "growth"),
    _Q("drift_bound_factor", "coverage_factor", "standard uncertainties in these bounds", "one"),
    _Q("reference_time", "reference_time_s", "time t0 of the thermal state", "time"),
    _Q("noise_forward", "noise_std_forward", "standard deviation of the noise ↑"),
    _Q("noise_backward", "noise_std_backward", "standard deviation of the noise ↓"),
    _Q("residual", "residual_std", "residual standard deviation"),
)
"""Numbers in `drift`."""
CHANGES = (
    _Q("change_time", "time_s", "time of the change", "time"),
    _Q("change_cycle", "cycle", "cycle of the change", "one"),
    _Q("change_size", "size_{}", "size of the change", uncertainty="std_{}"),
)
"""Lists over the steps of the drift in `drift.changes`; `{}` is the unit."""

_UNITS = {
    "deviation": (r"\micro\metre", r"\arcsecond"),
    "position": (r"\milli\metre", r"\degree"),
    "growth": (r"\micro\metre\metre\tothe{-1}", r"\arcsecond\degree\tothe{-1}"),
    "time": (r"\second",) * 2,
    "one": (r"\one",) * 2,
}


def unit_of(axis: AxisKind, unit: str) -> tuple[str, int]:
    """Return a unit in D-SI, and the power of ten to it: rotary growth is stated per 1000°."""
    rotary = axis is AxisKind.ROTARY
    return _UNITS[unit][rotary], -3 if rotary and unit == "growth" else 0
