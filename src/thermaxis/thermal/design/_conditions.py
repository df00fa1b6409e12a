"""What is stated of a thermal test before it is planned: what may be switched, what is known."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import final

import numpy as np

from thermaxis.codes import Place
from thermaxis.errors import (
    ConfigurationError,
    require_count,
    require_positive,
    require_range,
    require_unique,
)
from thermaxis.thermal._arrays import FloatArray

LOSS_EXPONENT = 1.5
"""Losses of bearings grow with this power of the speed [S]. [1]"""
MOST_SOURCES, MOST_LEVELS, MOST_BLOCKS = 6, 8, 200
"""More would take minutes to plan. [1]"""
NO_SWITCH = frozenset({0, 1, 2, 3, 4, 5, 6, 17, 19, 30, 98, 99})
"""M functions that stop, end or call a program, turn a spindle or change a tool. [1]"""
_LONGEST_MIN = 10_000.0
_LARGEST = 1e6


def _require_span(key: str, span: tuple[float, float], least: float) -> None:
    if not least <= span[0] <= span[1] <= _LONGEST_MIN:
        first, last = span
        raise ConfigurationError(
            "span_not_possible", first=first, last=last, least=least, most=_LONGEST_MIN, key=key
        )


@final
class SwitchKind(StrEnum):
    """How an NC program switches a source of heat."""

    SPINDLE = "spindle"
    """By the speed of a spindle; levels in 1/min."""
    AXIS = "axis"
    """An axis goes to and fro; levels are feeds in mm/min."""
    FUNCTION = "function"
    """By M functions; the levels are off and on."""


@final
@dataclass(frozen=True, slots=True)
class SourceSwitch:
    """How the NC program switches a source."""

    kind: SwitchKind
    spindle: int = 1
    """Number of the spindle. [1]"""
    axis: str = ""
    """Axis that moves."""
    from_mm: float | None = None
    """One end of its motion; stated for an axis. [mm]"""
    to_mm: float | None = None
    """The other end; stated for an axis. [mm]"""
    on: int | None = None
    """Number of the M function that switches on; stated for a function. [1]"""
    off: int | None = None
    """Number of the one that switches off; stated for a function. [1]"""

    def __post_init__(self) -> None:
        require_range("switch.spindle", self.spindle, 1, 8)
        for key, number in (("on", self.on), ("off", self.off)):
            place = Place(key=f"switch.{key}")
            if number is None:
                if self.kind is SwitchKind.FUNCTION:
                    raise ConfigurationError("function_without_number", place=place)
                continue
            require_range(f"switch.{key}", number, 0, 9999)
            if number in NO_SWITCH:
                raise ConfigurationError("function_no_switch", number=number, place=place)
        if self.on is not None:
            require_unique("switch.off", [f"M{self.on}", f"M{self.off}"])
        ends = {self.from_mm, self.to_mm}
        if self.kind is SwitchKind.AXIS and (not self.axis or None in ends or len(ends) < 2):
            raise ConfigurationError("axis_without_way", key="switch.axis")

    @property
    def ends_mm(self) -> tuple[float, ...]:
        """Both ends of the motion of an axis, none of what does not move. [mm]"""
        moves = self.kind is SwitchKind.AXIS
        return (self.from_mm or 0.0, self.to_mm or 0.0) if moves else ()

    @property
    def acts_on(self) -> str:
        """What it acts on: two sources may not share it."""
        if self.kind is SwitchKind.SPINDLE:
            return f"spindle {self.spindle}"
        return f"axis {self.axis}" if self.kind is SwitchKind.AXIS else f"M{self.on} M{self.off}"


@final
@dataclass(frozen=True, slots=True)
class HeatSource:
    """What may be switched: a spindle, an axis, a pump."""

    levels: tuple[float, ...] = (0.0, 1.0)
    """Levels that it may have, rising, the first one standstill. [unit of the source]"""
    heat: tuple[float, ...] = ()
    """Heat at each level as a share of that at the highest; none: (level/highest)^1.5. [1]"""
    input: str = ""
    """Input of the model that it heats, as `identify` takes it, such as T_spindle_C-T_column_C."""
    temperature_k: float = 10.0
    """By how much this input rises at the highest level. [K]"""
    displacement_um: float = 30.0
    """What it does at the highest level when it has settled, order of magnitude. [µm]"""
    rise_min: tuple[float, float] = (5.0, 40.0)
    """Between which the time constant of this rise lies. [min]"""
    shortest_on_min: float = 0.0
    shortest_off_min: float = 0.0
    """It keeps a level, and stands, for at least so long. [min]"""
    longest_on_min: float = _LONGEST_MIN
    """It runs for at most so long, at whatever levels. [min]"""
    switch: SourceSwitch | None = None
    """How an NC program switches it; none is needed for a plan alone."""

    def __post_init__(self) -> None:
        require_count("levels", len(self.levels), 2, MOST_LEVELS)
        rising = all(a < b for a, b in zip(self.levels, self.levels[1:], strict=False))
        if not rising or self.levels[0] != 0.0:
            raise ConfigurationError("levels_not_from_zero", key="levels")
        if self.heat and (len(self.heat) != len(self.levels) or self.heat[0] != 0.0):
            raise ConfigurationError("levels_not_from_zero", key="heat")
        for share in self.heat:
            require_range("heat", share, 0.0, 1.0)
        require_positive("temperature_k", self.temperature_k, _LARGEST)
        require_positive("displacement_um", self.displacement_um, _LARGEST)
        _require_span("rise_min", self.rise_min, 0.0)
        for key in ("shortest_on_min", "shortest_off_min", "longest_on_min"):
            require_range(key, getattr(self, key), 0.0, _LONGEST_MIN)

    @property
    def shares(self) -> tuple[float, ...]:
        """Heat at each level as a share of that at the highest. [1]"""
        highest = self.levels[-1]
        return self.heat or tuple((level / highest) ** LOSS_EXPONENT for level in self.levels)


@final
@dataclass(frozen=True, slots=True)
class LagRange:
    """Lags of the displacement behind an input, before anything is known: log-uniform."""

    between_min: tuple[float, float] = (3.0, 300.0)
    """The time constants lie between these. [min]"""
    number: int = 3
    """Lags of an input beside its direct gain. [1]"""

    def __post_init__(self) -> None:
        _require_span("lags.between_min", self.between_min, 0.01)
        require_range("lags.number", self.number, 1, 6)


@final
@dataclass(frozen=True, slots=True)
class ReadingNoise:
    """What is in the displacement beside what the sources do."""

    reading_um: float = 0.4
    """White noise of a reading, standard deviation. [µm]"""
    every_s: float = 10.0
    """Time between readings. [s]"""
    drift_um: float = 0.8
    """Slow drift at rest of displacement and inputs together, standard deviation. [µm]"""
    drift_h: float = 2.0
    """Time in which its correlation falls to 1/e. [h]"""

    def __post_init__(self) -> None:
        require_positive("noise.reading_um", self.reading_um, _LARGEST)
        require_positive("noise.every_s", self.every_s, 3600.0)
        require_range("noise.drift_um", self.drift_um, 0.0, _LARGEST)
        require_positive("noise.drift_h", self.drift_h, 1000.0)


@final
class Wanted(StrEnum):
    """What the test is to make certain."""

    PREDICTION = "prediction"
    """Displacement predicted over spectra of use: I-optimal."""
    DC_GAINS = "dc_gains"
    """What each source does at its highest level when it has settled."""


@final
@dataclass(frozen=True, slots=True)
class UseSpectrum:
    """How the machine will work: every source changes its level at random."""

    hours: float = 8.0
    """Length of a spectrum, from cold. [h]"""
    hold_min: tuple[float, float] = (10.0, 60.0)
    """A level lasts between these. [min]"""

    def __post_init__(self) -> None:
        require_range("use.hours", self.hours, 0.5, 72.0)
        _require_span("use.hold_min", self.hold_min, 1.0)


@final
@dataclass(frozen=True, slots=True)
class KnownModel:
    """A model that something is known from: a sister's, or an older one."""

    model: str
    """File of the model; its inputs have the names of the sources."""
    gains_percent: float = 30.0
    """By how much gains may differ from it, standard deviation: 30 for a sister [M], 10 for the
    machine's own older model [M]. [%]"""
    time_constants_percent: float = 30.0
    """The same of time constants. [%]"""

    def __post_init__(self) -> None:
        require_range("known.gains_percent", self.gains_percent, 0.1, 300.0)
        require_range("known.time_constants_percent", self.time_constants_percent, 0.1, 300.0)

    @property
    def spread(self) -> float:
        """Standard deviation of the logarithm of a time constant. [1]"""
        return math.log1p(self.time_constants_percent / 100.0)


@final
@dataclass(frozen=True, slots=True)
class HeatingConditions:
    """What a person states of a test that is to be planned: the keys of ``heat.toml``.

    Raises
    ------
    ConfigurationError
        If a number is not possible, levels do not rise from zero, or no source is stated.
    """

    sources: Mapping[str, HeatSource]
    """What may be switched, by name."""
    output: str = "Z_um"
    """Displacement that is measured."""
    block_min: float = 30.0
    """Levels change at multiples of it. [min]"""
    rest_min: float = 10.0
    """Rest before the first block: the zero. [min]"""
    cool_min: float = 0.0
    """All sources stand at the end for at least so long. [min]"""
    most_at_once: int = MOST_SOURCES
    """Sources that may run at the same time. [1]"""
    lags: LagRange = LagRange()
    noise: ReadingNoise = ReadingNoise()
    use: UseSpectrum = UseSpectrum()
    wanted: Wanted = Wanted.PREDICTION
    enough_um: float | None = None
    """Uncertainty with which a test may stop; None: not stated. [µm]"""
    known: KnownModel | None = None

    def __post_init__(self) -> None:
        require_count("sources", len(self.sources), 1, MOST_SOURCES)
        require_range("block_min", self.block_min, 1.0, 1440.0)
        require_range("rest_min", self.rest_min, 1.0, 1440.0)
        require_range("cool_min", self.cool_min, 0.0, _LONGEST_MIN)
        require_range("most_at_once", self.most_at_once, 1, MOST_SOURCES)
        for source in self.each:  # of a shorter one it would never run
            least, longest = max(self.block_min, source.shortest_on_min), source.longest_on_min
            require_range("longest_on_min", longest, least, _LONGEST_MIN)
        switches = [one.switch.acts_on for one in self.each if one.switch is not None]
        require_unique("sources", switches)
        if self.enough_um is not None:
            require_positive("enough_um", self.enough_um, _LARGEST)

    def blocks(self, duration_s: float) -> int:
        """Return the number of blocks of a duration."""
        block_h = self.block_min / 60.0
        require_range("duration_h", duration_s / 3600.0, 2.0 * block_h, MOST_BLOCKS * block_h)
        return int(duration_s / (60.0 * self.block_min) + 1e-9)

    def heat(self, sequence: Sequence[Sequence[int]] | np.ndarray) -> FloatArray:
        """Return the heat of levels by number, (..., b, s), as shares of the highest, alike. [1]"""
        numbers = np.asarray(sequence, dtype=np.intp)
        shares = [np.array(one.shares)[numbers[..., s]] for s, one in enumerate(self.each)]
        return np.stack(shares, axis=-1)

    def whole_blocks(self, time_min: float) -> int:
        """Return the fewest blocks that last for a time."""
        return math.ceil(time_min / self.block_min - 1e-9)

    @property
    def each(self) -> tuple[HeatSource, ...]:
        """The sources in their order."""
        return tuple(self.sources.values())
