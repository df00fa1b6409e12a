"""Everything that was evaluated from one run, as charts and certificates show it."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, final

from thermaxis.codes import Message
from thermaxis.positioning import (
    AdjacentDifferenceResult,
    FiguresAgainstCycles,
    Iso230_2_1988Result,
    Iso230_2Result,
    PositioningTest,
    Vdi3441Result,
    figures_by_key,
)
from thermaxis.report._certified_report import CertifiedReport
from thermaxis.report._text import decimals_of_figures

if TYPE_CHECKING:
    from thermaxis.positioning import DriftResult, Finding, UncertaintyResult
    from thermaxis.report._limits_check import LimitsCheck


@final
@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class PositioningReport(CertifiedReport):
    """Results of one positioning run with what a certificate says about them."""

    test: PositioningTest
    iso230_2: Iso230_2Result
    """Figures after ISO 230-2."""
    adjacent_difference: AdjacentDifferenceResult | None
    """The adjacent-difference method; None if not evaluated."""
    against_cycles: FiguresAgainstCycles | None
    """Figures against the number of cycles; None if not evaluated."""
    other_standard: Iso230_2_1988Result | Vdi3441Result | None
    """Figures after another standard; None if not asked for."""
    warnings: tuple[Message, ...]
    """What the reader of the results must know."""
    limits: "LimitsCheck | None"
    """The figures against their limits; None without limits."""
    conditions: "tuple[Message, ...]" = ()
    """Test conditions of the standard that the run does not meet; also in `warnings`."""
    drift: "DriftResult | None" = None
    """The run without its drift; None if not evaluated (the reason stands in `warnings`)."""
    uncertainty: "UncertaintyResult | None" = None
    """Expanded uncertainties of the figures; None if not evaluated."""
    diagnosis: "tuple[Finding, ...]" = ()
    """What is wrong with the axis, ranked; empty also where nothing was diagnosed."""
    plan_differences: "tuple[Message, ...] | None" = None
    """How the run departs from its plan; None if it was not compared with one."""
    options: Mapping[str, object] = field(default_factory=dict[str, object])
    """How the file was read and the run evaluated, where not as by default; as JSON."""

    @property
    def read_head(self) -> PositioningTest:
        """The run, which states some of the head."""
        return self.test

    @property
    def figure_decimals(self) -> int:
        """Decimals with which all figures of the run are printed. [1]"""
        figures = figures_by_key(self.iso230_2).values()
        largest = max((abs(f) for f in figures if f is not None), default=0.0)
        return decimals_of_figures(self.test.deviation, largest)
