"""A thermal test as tables, charts and certificates show it."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from datetime import datetime, timedelta
from enum import StrEnum
from typing import final

from thermaxis.codes import Message
from thermaxis.positioning import StartEnd
from thermaxis.report._certified_report import CertifiedReport
from thermaxis.thermal import ThermalLog, ThermalTest, ThermalTestSetup


@final
class CompensationCase(StrEnum):
    """With or without compensation."""

    MEASURED = "measured"
    """The log."""
    LEFT_BY_MODEL = "left_by_model"
    """The log less what a model says of it in free run."""
    IN_FORCE = "in_force"
    """Another log of the same test, with compensation in force."""


@final
@dataclass(frozen=True, slots=True)
class _LogHead:
    """What a log states of the head of a certificate: times, and air at its first sensor."""

    start: datetime | None
    end: datetime | None
    environment: Mapping[str, StartEnd]
    header: Mapping[str, str] = field(default_factory=dict[str, str])


@final
@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class ThermalTestReport(CertifiedReport):
    """An evaluated thermal test, with and without compensation."""

    cases: Mapping[CompensationCase, ThermalTest]
    """The test in each case; as measured first."""
    log: ThermalLog
    """The log as measured."""
    setup: ThermalTestSetup
    """What was stated of it."""
    model_sha256: str | None = None
    """Hash of the model; None without one."""
    warnings: tuple[Message, ...] = ()
    """What the reader of the results must know, of reading as well."""

    @property
    def measured(self) -> ThermalTest:
        """The test as measured."""
        return self.cases[CompensationCase.MEASURED]

    @property
    def read_head(self) -> _LogHead:
        """The log, which may state its times."""
        start = self.log.start
        lasts = timedelta(seconds=self.log.duration_s)
        air = [StartEnd(t.start_c, t.end_c) for t in self.measured.temperatures if t.ambient]
        return _LogHead(
            start,
            None if start is None else start + lasts,
            dict(zip(("air_temperature_c",), air, strict=False)),
        )
