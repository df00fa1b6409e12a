"""Limits of the figures and the rule by which they decide."""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from types import MappingProxyType
from typing import final

from thermaxis.errors import ConfigurationError
from thermaxis.files.settings._reading import as_table, read_toml, settings_of, unknown_key
from thermaxis.positioning import FIGURE_KEYS
from thermaxis.quantities import AxisKind

_LARGEST = 1e9
"""A limit is below a kilometre. [µm or arcsec]"""


class DecisionRule(StrEnum):
    """How a figure and its limit give a verdict."""

    SIMPLE = "simple"
    """Figure at most the limit; the measurement uncertainty is not taken into account."""
    ISO14253_1 = "iso14253-1"
    """The expanded uncertainty counts against whoever proves: ISO 14253-1."""

    @property
    def in_words(self) -> str:
        """The rule as certificates and terminals word it."""
        if self is DecisionRule.SIMPLE:
            return (
                "simple acceptance: a figure passes if it is not larger than its limit; the"
                " measurement uncertainty is not taken into account, the guard band is zero"
            )
        return (
            "ISO 14253-1: a figure passes if figure + U is not larger than its limit, fails if"
            " figure - U is larger, and is not decided in between (the guard band is its expanded"
            " uncertainty U)"
        )


@final
@dataclass(frozen=True, slots=True)
class FigureLimits:
    """Limits of figures; the kind of axis fixes the unit: linear µm, rotary arcsec."""

    limit: Mapping[str, float]
    """Largest magnitude allowed, by key of the figure. [µm or arcsec]"""
    decision_rule: DecisionRule
    expanded_uncertainty: Mapping[str, float]
    """Expanded uncertainty (k = 2) by key of the figure, where it is to count in place of the
    evaluated one. [µm or arcsec]"""
    source_name: str
    """Name of the file without its folder."""


def _numbers(file: str, table: str, content: object, kind: AxisKind) -> Mapping[str, float]:
    suffix = "_" + kind.units.deviation_suffix
    known = {key + suffix: key for key in FIGURE_KEYS}
    stated = settings_of(dict[str, float], content, file=file, key=table)
    for key, value in stated.items():
        if key not in known:
            raise unknown_key(file, f"{table}.{key}", known)
        if not 0.0 < value < _LARGEST:
            raise ConfigurationError("not_positive", value=value, file=file, key=f"{table}.{key}")
    numbers = {known[key]: value for key, value in stated.items()}
    return MappingProxyType({key: numbers[key] for key in FIGURE_KEYS if key in numbers})


def read_figure_limits(path: Path, kind: AxisKind) -> FigureLimits:
    """Read a file of limits.

    Parameters
    ----------
    path : Path
        TOML with a table ``[limits]`` (keys of the figures with the unit as suffix, such as
        ``A_um``, and ``decision_rule``) and, where uncertainties are known otherwise than by the
        evaluation, a table ``[expanded_uncertainty]`` with the same keys.

    Returns
    -------
    FigureLimits
        The limits. The default rule is simple acceptance.

    Raises
    ------
    ConfigurationError
        If the file cannot be read, a key is unknown, a value is not a positive number, or no
        figure is limited.
    """
    file = str(path)
    content = read_toml(path)
    for key in content:
        if key not in ("limits", "expanded_uncertainty"):
            raise unknown_key(file, key, ("limits", "expanded_uncertainty"))
    table = dict(as_table(file, "limits", content.get("limits", {})))
    stated_rule = table.pop("decision_rule", "simple")
    rule = settings_of(DecisionRule, stated_rule, file=file, key="limits.decision_rule")
    limit = _numbers(file, "limits", table, kind)
    stated = content.get("expanded_uncertainty", {})
    uncertainty = _numbers(file, "expanded_uncertainty", stated, kind)
    if not limit:
        raise ConfigurationError("no_limits", file=file, key="limits")
    return FigureLimits(limit, rule, uncertainty, path.name)
