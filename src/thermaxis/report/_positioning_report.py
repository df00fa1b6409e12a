"""Everything that was evaluated from one run, as charts and certificates show it."""

import datetime as dt
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import TYPE_CHECKING, final

from thermaxis.codes import Message, Place
from thermaxis.errors import ConfigurationError
from thermaxis.files.settings import day_of
from thermaxis.positioning import (
    AdjacentDifferenceResult,
    FiguresAgainstCycles,
    Iso230_2_1988Result,
    Iso230_2Result,
    PositioningTest,
    Vdi3441Result,
    figures_by_key,
)
from thermaxis.report._moments import in_file
from thermaxis.report._text import decimals_of_figures

if TYPE_CHECKING:
    from thermaxis.positioning import DriftResult, Finding, UncertaintyResult
    from thermaxis.report._limits_check import LimitsCheck


@final
@dataclass(frozen=True, slots=True, eq=False)
class PositioningReport:
    """Results of one positioning run with what a certificate says about them.

    Raises
    ------
    ConfigurationError
        If `date` is not an ISO date.
    """

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
    header: Mapping[str, str]
    """Fields of the head by key: those of the file, replaced by stated ones."""
    limits: "LimitsCheck | None"
    """The figures against their limits; None without limits."""
    source_name: str
    """Name of the measurement file without its folder."""
    source_sha256: str
    """SHA-256 of its bytes, 64 hexadecimal digits."""
    version: str
    date: str | None = None
    """ISO date of issue, in place of that of the head; None: that of the head."""
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

    def __post_init__(self) -> None:
        """Check the date and freeze the header."""
        object.__setattr__(self, "header", MappingProxyType(dict(self.header)))
        if self.date is None:
            return
        try:
            dt.date.fromisoformat(self.date)
        except ValueError:
            raise ConfigurationError(
                "not_a_date", place=Place(key="date"), text=self.date
            ) from None

    @property
    def performed(self) -> tuple[dt.date, dt.date] | None:
        """First and last day of the measurement; None if nothing states one."""
        days = [self._day(which) for which in ("start", "end", "date")]
        known = [day for day in days if day is not None]
        return (days[0] or known[0], days[1] or known[0]) if known else None

    def _day(self, which: str) -> dt.date | None:
        """Return a day as the head states it, else as the measured file has it."""
        if stated := day_of(self.header.get(which, "")):
            return stated
        moment = None if which == "date" else in_file(self.test, which)
        return None if moment is None else moment.date()

    @property
    def issued(self) -> dt.date | None:
        """Stated date of issue; None if nobody stated one."""
        return day_of(self.date or self.header.get("date_of_issue", ""))

    @property
    def document_date(self) -> dt.date | None:
        """Date of issue, else last day of the measurement; None without either."""
        return self.issued or (self.performed or (None, None))[1]

    @property
    def impossible_dates(self) -> tuple[Message, ...]:
        """Stated dates that cannot be, beside the days of the measurement."""
        if self.performed is None:
            return ()
        first, last = self.performed
        calibrated, received = (
            day_of(self.header.get(key, ""))
            for key in ("instrument_calibration_date", "date_of_receipt")
        )
        issue = "certificate.date_of_issue" if self.date is None else "--date"
        stated = (
            ("instrument.calibration_date", calibrated, "after", first),
            ("machine.received", received, "after", first),
            ("time.end", last, "before", first),
            (issue, self.issued, "before", last),
        )
        return tuple(
            Message(
                "warning-date_impossible",
                {"key": key, "day": str(day), "side": side, "tested": str(tested)},
            )
            for key, day, side, tested in stated
            if day is not None and (day > tested if side == "after" else day < tested)
        )

    @property
    def missing_fields(self) -> tuple[str, ...]:
        """Places in the header file that a certificate needs and nobody stated; empty: no draft."""
        from thermaxis.files.settings import HEADER_FIELDS  # noqa: PLC0415  a run alone needs none

        stated = {key: text for key, text in self.header.items() if text.strip()}
        if not re.fullmatch("[A-Z]{2}", stated.get("laboratory_country", "")):
            stated.pop("laboratory_country", None)  # a line of the measured file may be anything
        fields = HEADER_FIELDS.values()
        missing = [field.place for field in fields if field.needed and field.key not in stated]
        places = {HEADER_FIELDS[key].place for key in stated if key in HEADER_FIELDS}
        if not self.test.environment and not any(p.startswith("environment.") for p in places):
            missing.append("environment.air_temperature_c")
        return (*missing, *([] if self.performed else ["time.date"]))

    @property
    def missing_labels(self) -> str:
        """The same as a certificate names them; empty if nothing is missing."""
        from thermaxis.files.settings import HEADER_FIELDS  # noqa: PLC0415  a run alone needs none

        labels = {field.place: field.label for field in HEADER_FIELDS.values()}
        return ", ".join(labels[place] for place in self.missing_fields)

    @property
    def figure_decimals(self) -> int:
        """Decimals with which all figures of the run are printed. [1]"""
        figures = figures_by_key(self.iso230_2).values()
        largest = max((abs(f) for f in figures if f is not None), default=0.0)
        return decimals_of_figures(self.test.deviation, largest)
