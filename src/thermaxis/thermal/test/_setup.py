"""What is stated of a thermal test: channels of its probes, its motion, what is known of U."""

from dataclasses import dataclass, fields
from enum import StrEnum
from typing import final

from thermaxis.codes import Place
from thermaxis.errors import ConfigurationError, require_positive, require_range, require_unique

_LONGEST_H = 1000.0
_LARGEST = 1e6


@final
class ThermalTestKind(StrEnum):
    """The four tests of ISO 230-3:2020 [V]."""

    ETVE = "etve"
    """Environmental temperature variation error: the machine is on and does not move."""
    SPINDLE = "spindle"
    """Thermal distortion caused by a rotating spindle."""
    LINEAR = "linear"
    """Thermal distortion caused by linear motion of a component."""
    ROTARY = "rotary"
    """Thermal distortion caused by rotary motion of a component."""


@final
@dataclass(frozen=True, slots=True)
class Probes:
    """Channels of the five displacement probes at the mandrel or the table [M]."""

    x1: str = ""
    """Along X; empty where there is none."""
    x2: str = ""
    """Along X, at the distance from the first."""
    y1: str = ""
    """Along Y."""
    y2: str = ""
    """Along Y, at the distance from the first."""
    z: str = ""
    """Along Z."""
    distance_mm: float | None = None
    """Distance l from X1 to X2 and from Y1 to Y2. [mm]"""

    def __post_init__(self) -> None:
        require_unique("probes", [channel for _, channel in self.named])
        if self.distance_mm is not None:
            require_positive("probes.distance_mm", self.distance_mm, _LARGEST)
        for first, second, axis in ((self.x1, self.x2, "x"), (self.y1, self.y2, "y")):
            if second and not first:
                place, missing = Place(key=f"probes.{axis}2"), f"{axis}1"
                raise ConfigurationError("probe_without_first", missing=missing, place=place)
            if second and self.distance_mm is None:
                raise ConfigurationError(
                    "probe_distance_missing", second=f"{axis}2", key="probes.distance_mm"
                )

    @property
    def named(self) -> tuple[tuple[str, str], ...]:
        """Name and channel of the probes that there are."""
        pairs = ((one.name.upper(), getattr(self, one.name)) for one in fields(self)[:5])
        return tuple((name, channel) for name, channel in pairs if channel)


@final
@dataclass(frozen=True, slots=True)
class MotionTargets:
    """Channels of the deviations at the two targets of a linear axis, from both sides."""

    first: tuple[str, str]
    """At the first target, approached forward and backward."""
    second: tuple[str, str]
    """At the second one."""

    def __post_init__(self) -> None:
        require_unique("targets", [*self.first, *self.second])


@final
@dataclass(frozen=True, slots=True)
class ThermalTestMotion:
    """When something moved, and how fast."""

    speed: str = ""
    """Channel of the speed: it moved from its first row above 1, and above 1 % of the highest speed
    of the log, to its last one."""
    highest: float | None = None
    """Highest speed of the machine; None: the highest of the test. [unit of the channel]"""
    running_min: tuple[float, float] | None = None
    """Begin and end where no speed was recorded, since the first row. [min]"""

    def __post_init__(self) -> None:
        if self.highest is not None:
            require_positive("motion.highest", self.highest, _LARGEST)
        if self.running_min is not None and not 0.0 <= self.running_min[0] < self.running_min[1]:
            first, last = self.running_min
            raise ConfigurationError(
                "motion_not_rising", first=first, last=last, key="motion.running_min"
            )


@final
@dataclass(frozen=True, slots=True)
class ThermalTestBudget:
    """What is known of the uncertainty of the probes."""

    probe_um: float | None = None
    """Expanded uncertainty (k = 2) of a displacement by one probe. [µm]"""
    resolution_um: float | None = None
    """Its resolution; None: as the values show. [µm]"""
    fixture_um_per_k: float | None = None
    """By how much fixture and mandrel expand at most with ambient temperature. [µm/K]"""
    distance_mm: float | None = None
    """Expanded uncertainty (k = 2) of the distance of the probes. [mm]"""

    def __post_init__(self) -> None:
        for one in fields(self):
            if (value := getattr(self, one.name)) is not None:
                require_range(f"uncertainty.{one.name}", value, 0.0, _LARGEST)


@final
@dataclass(frozen=True, slots=True)
class ThermalTestSetup:
    """What a person states of a thermal test: the keys of its file.

    Raises
    ------
    ConfigurationError
        If a number is not possible, a channel stands twice, a second probe has no first one or no
        distance to it, or an expansion is stated without ambient temperature.
    """

    probes: Probes = Probes()
    """The probes; all tests but the linear one."""
    targets: MotionTargets | None = None
    """The two targets; the linear test alone."""
    ambient: tuple[str, ...] = ()
    """Channels of ambient temperature."""
    motion: ThermalTestMotion = ThermalTestMotion()
    """When something moved."""
    uncertainty: ThermalTestBudget = ThermalTestBudget()
    """What is known of the probes."""
    spans_h: tuple[float, ...] = (0.25, 0.5, 1.0, 2.0, 4.0, 8.0, 24.0)
    """Spans t of ETVE(D, t); those longer than the test are left out. [h]"""

    def __post_init__(self) -> None:
        for span_h in self.spans_h:
            require_positive("spans_h", span_h, _LONGEST_H)
        if self.uncertainty.fixture_um_per_k and not self.ambient:
            raise ConfigurationError("fixture_without_ambient", key="ambient")

    def named(self, kind: ThermalTestKind) -> tuple[tuple[str, str], ...]:
        """Return name and channel of what is measured in a test."""
        if kind is not ThermalTestKind.LINEAR:
            return self.probes.named
        if self.targets is None:
            raise ConfigurationError("targets_missing", key="targets")
        channels = (*self.targets.first, *self.targets.second)
        return tuple(zip(("P1+", "P1-", "P2+", "P2-"), channels, strict=True))
