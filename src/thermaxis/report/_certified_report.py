"""What every certificate has, whatever was measured: its head, its file, its dates."""

import datetime as dt
import re
from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

from thermaxis.codes import Message
from thermaxis.errors import ConfigurationError
from thermaxis.files.settings import day_of
from thermaxis.report._moments import ReadHead, in_file


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class CertifiedReport(ABC):
    """Results with the head of their certificate.

    Raises
    ------
    ConfigurationError
        If `date` is not an ISO date.
    """

    header: Mapping[str, str]
    """Fields of the head by key: those of the file, replaced by stated ones."""
    source_name: str
    """Name of the measurement file without its folder."""
    source_sha256: str
    """SHA-256 of its bytes, 64 hexadecimal digits."""
    version: str
    date: str | None = None
    """ISO date of issue, in place of that of the head; None: that of the head."""

    def __post_init__(self) -> None:
        """Check the date and freeze the header."""
        object.__setattr__(self, "header", MappingProxyType(dict(self.header)))
        if self.date is None:
            return
        try:
            dt.date.fromisoformat(self.date)
        except ValueError:
            raise ConfigurationError("not_a_date", key="date", text=self.date) from None

    @property
    @abstractmethod
    def read_head(self) -> ReadHead:
        """What the measured file states of the head."""

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
        moment = None if which == "date" else in_file(self.read_head, which)
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
        if not self.read_head.environment and not any(p.startswith("environment.") for p in places):
            missing.append("environment.air_temperature_c")
        return (*missing, *([] if self.performed else ["time.date"]))

    @property
    def missing_labels(self) -> str:
        """The same as a certificate names them; empty if nothing is missing."""
        from thermaxis.files.settings import HEADER_FIELDS  # noqa: PLC0415  a run alone needs none

        labels = {field.place: field.label for field in HEADER_FIELDS.values()}
        return ", ".join(labels[place] for place in self.missing_fields)
