"""Limits of the figures and the rule by which they decide."""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from types import MappingProxyType
from typing import final

from thermaxis.codes import Place
from thermaxis.errors import ConfigurationError
from thermaxis.files.settings import as_table, read_toml, unknown_key
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
                " measurement uncertainty is not taken into account"
            )
        return (
            "ISO 14253-1: a figure passes if figure + U is not larger than its limit, fails if"
            " figure - U is larger, and is not decided in between (U: expanded uncertainty,"
            " k = 2, as stated in the limits file)"
        )


@final
@dataclass(frozen=True, slots=True)
class FigureLimits:
    """Limits of figures; the kind of axis fixes the unit: linear µm, rotary arcsec."""

    limit: Mapping[str, float]
    """Largest magnitude allowed, by key of the figure. [µm or arcsec]"""
    decision_rule: DecisionRule
    """How they decide."""
    expanded_uncertainty: Mapping[str, float]
    """Expanded uncertainty (k = 2) by key of the figure. [µm or arcsec]"""
    source_name: str
    """Name of the file without its folder."""


def _numbers(
    path: Path, table: str, values: Mapping[str, object], kind: AxisKind
) -> Mapping[str, float]:
    suffix = "_" + kind.units.deviation_suffix
    known = {key + suffix: key for key in FIGURE_KEYS}
    numbers: dict[str, float] = {}
    for key, value in values.items():
        if key not in known:
            raise unknown_key(path, f"{table}.{key}", [f"{table}.{k}" for k in known])
        number = value if isinstance(value, int | float) and not isinstance(value, bool) else 0.0
        if not 0.0 < number < _LARGEST:
            raise ConfigurationError(
                "not_positive", place=Place(file=str(path), key=f"{table}.{key}"), value=str(value)
            )
        numbers[known[key]] = float(number)
    return MappingProxyType({key: numbers[key] for key in FIGURE_KEYS if key in numbers})


def _decision_rule(path: Path, value: object) -> DecisionRule:
    choices = [str(rule) for rule in DecisionRule]
    if not isinstance(value, str) or value not in choices:
        raise ConfigurationError(
            "unknown_choice",
            place=Place(file=str(path), key="limits.decision_rule"),
            name=str(value),
            known=", ".join(choices),
        )
    return DecisionRule(value)


def read_figure_limits(path: Path, kind: AxisKind) -> FigureLimits:
    """Read a file of limits.

    Parameters
    ----------
    path : Path
        TOML with a table ``[limits]`` (keys of the figures with the unit as suffix, such as
        ``A_um``, and ``decision_rule``) and, where uncertainties are known, a table
        ``[expanded_uncertainty]`` with the same keys.
    kind : AxisKind
        Kind of the axis, which fixes the unit.

    Returns
    -------
    FigureLimits
        The limits. The default rule is simple acceptance.

    Raises
    ------
    ConfigurationError
        If the file cannot be read, a key is unknown, a value is not a positive number, no figure
        is limited, or the rule needs an uncertainty that is not there.
    """
    suffix = kind.units.deviation_suffix
    content = read_toml(path, remedy=f"Write [limits] on a line and A_{suffix} = 12.0 below it")
    for key in content:
        if key not in ("limits", "expanded_uncertainty"):
            raise unknown_key(path, key, ("limits", "expanded_uncertainty"))
    table = dict(as_table(path, "limits", content.get("limits", {})))
    rule = _decision_rule(path, table.pop("decision_rule", "simple"))
    limit = _numbers(path, "limits", table, kind)
    stated = as_table(path, "expanded_uncertainty", content.get("expanded_uncertainty", {}))
    uncertainty = _numbers(path, "expanded_uncertainty", stated, kind)
    if not limit:
        raise ConfigurationError(
            "no_limit_stated",
            place=Place(file=str(path), key="limits"),
            example=f"A_{suffix} = 12.0",
        )
    without = [key for key in limit if key not in uncertainty]
    if rule is DecisionRule.ISO14253_1 and without:
        raise ConfigurationError(
            "rule_needs_uncertainty",
            place=Place(file=str(path), key="expanded_uncertainty"),
            figures=", ".join(without),
        )
    return FigureLimits(limit, rule, uncertainty, path.name)
