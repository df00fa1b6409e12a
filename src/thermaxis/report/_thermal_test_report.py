"""A thermal test as tables, charts and certificates show it."""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import final

from thermaxis.codes import Message
from thermaxis.thermal import ThermalTest, ThermalTestSetup


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
@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class ThermalTestReport:
    """An evaluated thermal test, with and without compensation."""

    cases: Mapping[CompensationCase, ThermalTest]
    """The test in each case; as measured first."""
    setup: ThermalTestSetup
    """What was stated of it."""
    model_sha256: str | None
    """Hash of the model; None without one."""
    warnings: tuple[Message, ...]
    """What the reader of the results must know."""
    source_name: str
    """Name of the log without its folder."""
    source_sha256: str
    """SHA-256 of its bytes, 64 hexadecimal digits."""
    version: str
    """Version of this program."""

    @property
    def measured(self) -> ThermalTest:
        """The test as measured."""
        return self.cases[CompensationCase.MEASURED]
