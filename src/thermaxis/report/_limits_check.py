"""Figures against their limits."""

from dataclasses import dataclass
from enum import StrEnum
from typing import final

from thermaxis.files import DecisionRule, FigureLimits
from thermaxis.positioning import Iso230_2Result, figures_by_key


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
    """Key of the figure."""
    value: float | None
    """The figure; None if it is absent. [µm or arcsec]"""
    limit: float
    """Its limit. [µm or arcsec]"""
    expanded_uncertainty: float | None
    """Its expanded uncertainty (k = 2); None if not stated. [µm or arcsec]"""
    verdict: Verdict
    """What the rule says."""


@final
@dataclass(frozen=True, slots=True)
class LimitsCheck:
    """A run against its limits."""

    limits: FigureLimits
    """The limits."""
    figures: tuple[FigureCheck, ...]
    """Every figure that has a limit, in the order of tables."""
    verdict: Verdict
    """Fail if any figure fails; else not decided if any is not decided or absent; else pass."""

    def of(self, key: str) -> FigureCheck | None:
        """Return the check of one figure; None if it has no limit."""
        return next((check for check in self.figures if check.key == key), None)


def _verdict(value: float | None, limit: float, uncertainty: float) -> Verdict:
    if value is None:
        return Verdict.NOT_DECIDED
    magnitude = abs(value)
    if magnitude + uncertainty <= limit:
        return Verdict.PASS
    return Verdict.FAIL if magnitude - uncertainty > limit else Verdict.NOT_DECIDED


def check_limits(limits: FigureLimits, iso230_2: Iso230_2Result) -> LimitsCheck:
    """Compare the figures of a run with their limits.

    Parameters
    ----------
    limits : FigureLimits
        The limits and the decision rule.
    iso230_2 : Iso230_2Result
        The figures. The mean reversal value is compared by its magnitude.

    Returns
    -------
    LimitsCheck
        A verdict per figure and one for the run. An absent figure is not decided.

    References
    ----------
    ISO 14253-1 (decision rules), its principle from general knowledge.
    """
    checks: list[FigureCheck] = []
    figures = figures_by_key(iso230_2)
    for key, limit in limits.limit.items():
        value = figures[key]
        stated = limits.expanded_uncertainty.get(key)
        counted = stated if limits.decision_rule is DecisionRule.ISO14253_1 else None
        checks.append(
            FigureCheck(key, value, limit, stated, _verdict(value, limit, counted or 0.0))
        )
    verdicts = {check.verdict for check in checks}
    overall = next(v for v in (Verdict.FAIL, Verdict.NOT_DECIDED, Verdict.PASS) if v in verdicts)
    return LimitsCheck(limits, tuple(checks), overall)
