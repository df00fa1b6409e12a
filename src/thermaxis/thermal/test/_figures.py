"""Figures of a thermal test: ranges with their uncertainty, temperatures, speeds."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import final

from thermaxis.codes import Message
from thermaxis.thermal._arrays import FloatArray
from thermaxis.thermal.test._setup import ThermalTestKind

HOUR_S = 3600.0
"""ISO 230-3 states what happens within the first 60 min. [s]"""
COVERAGE = 2.0
"""Coverage factor k of all expanded uncertainties. [1]"""
END_SHARE = 0.15
"""A test by motion may end once the last 60 min change less than this of the first [M]. [1]"""
CUSTOMARY_H = 4.0
"""Shortest duration of a test [M]. [h]"""


@final
class UncertaintyCause(StrEnum):
    """What makes a range of a test uncertain."""

    PROBE = "probe"
    """The probe, as it is stated."""
    TEMPERATURE = "temperature"
    """Expansion of fixture and mandrel with ambient temperature."""
    RESOLUTION = "resolution"
    """Two readings, each rounded."""
    SAMPLING = "sampling"
    """What happened between the rows beside the two extremes."""
    DISTANCE = "distance"
    """The distance of the probes."""


@final
@dataclass(frozen=True, slots=True)
class RangeFigure:
    """A range with its uncertainty."""

    value: float
    """Largest less smallest value. [µm or µm/m]"""
    standard_uncertainties: Mapping[UncertaintyCause, float]
    """By what makes it uncertain; what nobody stated is not there. [µm or µm/m]"""

    @property
    def expanded_uncertainty(self) -> float:
        """U with k = 2, independent terms (GUM). [µm or µm/m]"""
        return COVERAGE * math.sqrt(sum(u**2 for u in self.standard_uncertainties.values()))


@final
@dataclass(frozen=True, slots=True, eq=False)
class ThermalTestQuantity:
    """A displacement or a tilt over the test."""

    name: str
    """`X1`, `X2`, `Y1`, `Y2`, `Z`; `A` about X, `B` about Y; at the targets of a linear axis `P1+`,
    `P1-`, `P2+`, `P2-`, and the distance between them `D+`, `D-`."""
    unit: str
    """`um` or `um/m`."""
    values: FloatArray
    """Values as measured, (n,); NaN where there is none. [unit]"""
    first_hour: RangeFigure
    """Within the first 60 min of the test, or of the motion. [unit]"""
    whole: RangeFigure
    """Within the whole of it. [unit]"""
    last_hour: float
    """Range within its last 60 min. [unit]"""
    cooling: RangeFigure | None
    """After the motion; None without rows there. [unit]"""
    drift_per_h: tuple[float, ...]
    """Slope by least squares within each whole hour; NaN with fewer than two values. [unit/h]"""
    last_hour_drift_per_h: float
    """The same within its last 60 min. [unit/h]"""
    within_spans: tuple[float, ...]
    """Largest range in any span of each length: ETVE(D, t). [unit]"""

    @property
    def is_tilt(self) -> bool:
        """Whether it is an angle."""
        return self.unit != "um"


@final
@dataclass(frozen=True, slots=True)
class ThermalTestTemperature:
    """A temperature over the test, or over the motion."""

    channel: str
    """Its channel."""
    ambient: bool
    """Whether it is one of the room."""
    start_c: float
    """First measured value; NaN without any. [degC]"""
    end_c: float
    """Last one. [degC]"""
    range_k: float
    """Range within the whole of it. [K]"""
    first_hour_range_k: float
    """Range within the first 60 min. [K]"""
    gradient_k_per_h: float
    """Largest range within any 60 min of the test. [K/h]"""


@final
@dataclass(frozen=True, slots=True)
class SpeedClass:
    """Rows of a test with speeds that are alike."""

    from_percent: float
    """Above this share of the highest speed; 0 to 0 is standstill. [%]"""
    to_percent: float
    """Up to this share. [%]"""
    mean: float
    """Mean speed over time. [unit of the channel]"""
    time_s: float
    """How long. [s]"""


@final
@dataclass(frozen=True, slots=True)
class EndCriterion:
    """Whether a test by motion may end: the last 60 min against the first 60 min [M]."""

    first_hour: float
    """Largest range of a displacement within the first 60 min. [µm]"""
    last_hour: float
    """The same within the last 60 min. [µm]"""

    @property
    def share(self) -> float:
        """The last over the first; NaN where nothing moved. [1]"""
        return self.last_hour / self.first_hour if self.first_hour > 0.0 else math.nan

    @property
    def reached(self) -> bool:
        """Whether it is below `END_SHARE`."""
        return self.share < END_SHARE


@final
@dataclass(frozen=True, slots=True, eq=False)
class ThermalTest:
    """An evaluated thermal test."""

    kind: ThermalTestKind
    """Which of the four."""
    name: str
    """Name of the log."""
    time_s: FloatArray
    """Times, (n,). [s]"""
    begin_s: float
    """Begin of the motion, or of the test. [s]"""
    end_s: float
    """Its end. [s]"""
    quantities: tuple[ThermalTestQuantity, ...]
    """Displacements and tilts."""
    temperatures: tuple[ThermalTestTemperature, ...]
    """Temperatures, ambient ones first."""
    room_spread_k: float | None
    """Largest difference of two ambient temperatures at one time; None with fewer than two. [K]"""
    spans_h: tuple[float, ...]
    """Lengths of the spans of `within_spans`; none but for ETVE. [h]"""
    spectrum: tuple[SpeedClass, ...]
    """Speeds during the motion; empty where none was recorded."""
    end_criterion: EndCriterion | None
    """None for ETVE, and where less than 2 h were run: the two hours would overlap."""
    warnings: tuple[Message, ...]
    """What the reader of the figures must know."""

    @property
    def cooling_s(self) -> float:
        """Time from the end of the motion to that of the log. [s]"""
        return float(self.time_s[-1]) - self.end_s
