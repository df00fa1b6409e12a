"""Figures against their limits."""

from dataclasses import dataclass
from enum import StrEnum
from typing import final

from thermaxis.codes import Message
from thermaxis.files import DecisionRule, FigureLimits
from thermaxis.positioning import FigureUncertainty, Iso230_2Result, figures_by_key
from thermaxis.report._names import FIGURE_SYMBOLS

_ESSENTIAL = {"left_out-one_reading", "left_out-no_budget"}
"""Without one of these an uncertainty is too small to decide by."""
_BUDGET_KEYS = {
    "device": "[device]",
    "misalignment": "[alignment] misalignment_mm",
    "material_temperature": "[material] temperature_interval_k",
    "expansion_coefficient": "[material] expansion_coefficient_interval_ppm_per_k",
    "environmental_variation": "[environment]",
}
"""Where the file of the budget states each term; a stated 0 is a statement, too."""


class Verdict(StrEnum):
    """What a limit says."""

    PASS = "pass"  # noqa: S105  a verdict, not a password
    FAIL = "fail"
    NOT_DECIDED = "not decided"


@final
@dataclass(frozen=True, slots=True)
class FigureCheck:
    """One figure against its limit; the kind of axis fixes the unit: linear µm, rotary arcsec."""

    key: str
    value: float | None
    """The figure; None if it is absent. [µm or arcsec]"""
    limit: float
    """Its limit. [µm or arcsec]"""
    expanded_uncertainty: float | None
    """Its expanded uncertainty; None if nothing tells it. [µm or arcsec]"""
    guard_band: float | None
    """How far below the limit it must be to pass, and above it to fail: its expanded uncertainty,
    or 0 for simple acceptance; None if that is not known or lacks something. [µm or arcsec]"""
    verdict: Verdict


@final
@dataclass(frozen=True, slots=True)
class LimitsCheck:
    """A run against its limits."""

    limits: FigureLimits
    figures: tuple[FigureCheck, ...]
    """Every figure that has a limit, in the order of tables."""
    verdict: Verdict
    """Fail if any figure fails; else not decided if any is not decided or absent; else pass."""
    reservation: Message | None
    """What the uncertainty of limited figures lacks; None if nothing that matters. By ISO 14253-1
    these figures are then not decided."""

    def of(self, key: str) -> FigureCheck | None:
        """Return the check of one figure; None if it has no limit."""
        return next((check for check in self.figures if check.key == key), None)


def _verdict(value: float | None, limit: float, guard_band: float | None) -> Verdict:
    if value is None or guard_band is None:
        return Verdict.NOT_DECIDED
    magnitude = abs(value)
    if magnitude + guard_band <= limit:
        return Verdict.PASS
    return Verdict.FAIL if magnitude - guard_band > limit else Verdict.NOT_DECIDED


def _lacking(uncertainty: FigureUncertainty) -> tuple[Message, ...]:
    found = [one for one in uncertainty.left_out if one.code in _ESSENTIAL]
    terms = [one.values for one in uncertainty.left_out if one.code == "left_out-not_stated"]
    if terms:
        keys = ", ".join(_BUDGET_KEYS[str(values["term"])] for values in terms)
        found.append(Message("left_out-keys_not_stated", {"keys": keys}))
    return tuple(found)


def check_limits(
    limits: FigureLimits, iso230_2: Iso230_2Result, uncertainty: FigureUncertainty | None = None
) -> LimitsCheck:
    """Compare the figures of a run with their limits.

    Parameters
    ----------
    iso230_2 : Iso230_2Result
        The figures. The mean reversal value is compared by its magnitude.
    uncertainty : FigureUncertainty, optional
        Their expanded uncertainties, with those that the limits state (`with_stated`). Default:
        none are known.

    Returns
    -------
    LimitsCheck
        A verdict per figure and one for the run. An absent figure is not decided, nor by ISO
        14253-1 one whose uncertainty is neither stated nor contains scatter and every term
        that a budget of this axis has.

    References
    ----------
    ISO 14253-1 (decision rules) and ILAC-G8 (guard band w = U, simple acceptance), their
    principles from memory.
    """
    checks: list[FigureCheck] = []
    figures = figures_by_key(iso230_2)
    lacking, stated = (Message("left_out-everything"),), ()
    if uncertainty is not None:
        stated, lacking = uncertainty.stated, _lacking(uncertainty)
    incomplete = [key for key in limits.limit if lacking and key not in stated]
    simple = limits.decision_rule is DecisionRule.SIMPLE
    for key, limit in limits.limit.items():
        u = uncertainty.expanded_uncertainty.get(key) if uncertainty is not None else None
        guard_band, value = 0.0 if simple else None if key in incomplete else u, figures[key]
        verdict = _verdict(value, limit, guard_band)
        checks.append(FigureCheck(key, value, limit, u, guard_band, verdict))
    verdicts = {check.verdict for check in checks}
    overall = next(v for v in (Verdict.FAIL, Verdict.NOT_DECIDED, Verdict.PASS) if v in verdicts)
    symbols = ", ".join(FIGURE_SYMBOLS[key] for key in incomplete if figures[key] is not None)
    values = {"symbols": symbols, "terms": lacking}
    reservation = Message("verdict-u_lacks", values) if symbols else None
    return LimitsCheck(limits, tuple(checks), overall, reservation)
