"""How figures are called: symbols, and names by edition of ISO 230-2."""

from collections.abc import Mapping
from types import MappingProxyType

from thermaxis.positioning import (
    FIGURE_KEYS,
    Cycle,
    Edition,
    Iso230_2_1988Result,
    Iso230_2Result,
    PositioningTest,
    Vdi3441Result,
)

FIGURE_SYMBOLS: Mapping[str, str] = MappingProxyType(
    {
        key: key.replace("_forward", "↑").replace("_backward", "↓").replace("_mean", "\u0304")
        for key in FIGURE_KEYS
    }
)
"""Symbols of ISO 230-2 by key of the figure."""

_OLDER_WORDS = (
    ("reversal error", "reversal value"),
    ("positioning error", "positional deviation"),
    ("positioning repeatability", "repeatability of positioning"),
    ("positioning accuracy", "accuracy of positioning"),
)
_NAMES_2014: Mapping[str, str] = MappingProxyType(
    {
        "B": "reversal error",
        "B_mean": "mean reversal error",
        "M": "range of the mean bidirectional positioning error",
        "E_forward": "unidirectional systematic positioning error, forward",
        "E_backward": "unidirectional systematic positioning error, backward",
        "E": "bidirectional systematic positioning error",
        "R_forward": "unidirectional positioning repeatability, forward",
        "R_backward": "unidirectional positioning repeatability, backward",
        "R": "bidirectional positioning repeatability",
        "A_forward": "unidirectional positioning accuracy, forward",
        "A_backward": "unidirectional positioning accuracy, backward",
        "A": "bidirectional positioning accuracy",
    }
)


def _older(name: str) -> str:
    for present, former in _OLDER_WORDS:
        name = name.replace(present, former)
    return name


_NAMES_OLDER: Mapping[str, str] = MappingProxyType(
    {key: _older(name) for key, name in _NAMES_2014.items()}
)
FIGURE_NAMES: Mapping[Edition, Mapping[str, str]] = MappingProxyType(
    {Edition.E1997: _NAMES_OLDER, Edition.E2006: _NAMES_OLDER, Edition.E2014: _NAMES_2014}
)
"""Names of the figures by edition and key, from memory: 2014 says error where older ones say
deviation or value."""

OTHER_NAMES: Mapping[str, tuple[str, str]] = MappingProxyType(
    {
        "U_max": ("Umax", "largest reversal error"),
        "U_mean": ("Ū", "mean reversal error, mean of magnitudes"),
        "Ps_max": ("Ps max", "largest positional scatter"),
        "Ps_mean": ("P̄s", "mean positional scatter"),
        "Pa": ("Pa", "positional deviation"),
        "P": ("P", "positional uncertainty"),
        "B": ("B", "reversal value"),
        "B_mean": ("B̄", "mean reversal value"),
        "R_forward": ("R↑", "repeatability, forward"),
        "R_backward": ("R↓", "repeatability, backward"),
        "R": ("R", "bidirectional repeatability"),
        "A_forward": ("A↑", "accuracy, forward"),
        "A_backward": ("A↓", "accuracy, backward"),
        "A": ("A", "bidirectional accuracy"),
    }
)
"""Symbol and name of the figures of the other standards, by key."""


CYCLE_NAMES: Mapping[Cycle, str] = MappingProxyType(
    {
        Cycle.STANDARD: "standard test cycle",
        Cycle.PILGRIM: "pilgrim-step cycle",
        Cycle.STEP: "step cycle (Annex B)",
    }
)
"""Kinds of test cycle in words."""


def edition_name(edition: Edition) -> str:
    """Return the edition as a certificate names it, such as ISO 230-2:2014."""
    return f"ISO 230-2:{edition}"


def other_standard_name(result: Iso230_2_1988Result | Vdi3441Result) -> str:
    """Return the name of another standard and its year."""
    return "VDI/DGQ 3441:1977" if isinstance(result, Vdi3441Result) else "ISO 230-2:1988"


def absence_reason(key: str, result: Iso230_2Result, test: PositioningTest) -> str:
    """Return in words why a figure does not exist."""
    forward, backward = test.measured_approaches
    if not (forward and backward) and not key.endswith("_forward" if forward else "_backward"):
        return f"measured {'forward' if forward else 'backward'} only"
    if result.single_run_rule and key[0] in "RA":
        return "axis longer than 2000 mm: one run per direction is the rule"
    return "too few readings"
