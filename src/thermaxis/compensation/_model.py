"""The model that may act on a machine: gains and time constants, and what it was made from."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from itertools import accumulate, pairwise
from types import MappingProxyType
from typing import final

from thermaxis.errors import (
    ConfigurationError,
    require_count,
    require_known,
    require_positive,
    require_range,
    require_unique,
)

LARGEST_GAIN_UM_PER_K = 1e5
"""Largest magnitude of a gain; a machine ten metres long grows by 120 µm/K. [µm/K]"""
LONGEST_TIME_CONSTANT_S = 1e8
"""Longest time constant: three years. [s]"""
LONGEST_DELAY_S = 86400.0
"""Longest delay of an input: a day. [s]"""
MOST_PARTS = 200
"""Largest number of parts of an output, and of outputs. [1]"""

START = "start"
"""Reference: the temperatures when the model starts, as in the paper."""
STATED = "stated"
"""Reference: temperatures that the model states."""


@final
@dataclass(frozen=True, slots=True)
class Section:
    """A first-order lag: x += alpha (u - x), alpha = 1 - exp(-T / time constant)."""

    gain_um_per_k: float
    """Gain c of its state. [µm/K]"""
    time_constant_s: float
    """Time constant, positive: a section is stable whatever its numbers. [s]"""

    def __post_init__(self) -> None:
        """Check the numbers."""
        largest = LARGEST_GAIN_UM_PER_K
        require_range("gain_um_per_k", self.gain_um_per_k, -largest, largest)
        require_positive("time_constant_s", self.time_constant_s, LONGEST_TIME_CONSTANT_S)


@final
@dataclass(frozen=True, slots=True)
class GainPoint:
    """Gain g of a part at one clamping diameter of the workpiece."""

    diameter_mm: float
    """Clamping diameter. [mm]"""
    gain: float
    """Factor of the part. [1]"""


@final
@dataclass(frozen=True, slots=True)
class Part:
    """What one input contributes to an output: direct gain and sections side by side.

    Raises
    ------
    ConfigurationError
        If a number is not finite or out of its range, or diameters do not increase.

    References
    ----------
    Mareš and Horejš 2021, equations (5) and (6): difference of two temperatures, times a gain.
    """

    name: str
    """Name of the input."""
    plus: str
    """Channel of the temperature."""
    minus: str = ""
    """Channel that is subtracted; empty where there is none."""
    direct_gain_um_per_k: float = 0.0
    """Gain without a lag. [µm/K]"""
    sections: tuple[Section, ...] = ()
    """The lags."""
    delay_s: float = 0.0
    """Time that the input needs to act at all. [s]"""
    gain_by_diameter: tuple[GainPoint, ...] = ()
    """Factor by clamping diameter, linear in between; empty where it is 1 throughout."""
    tool_gain: float = 1.0
    """Factor at the tool centre point, used where no diameter is stated. [1]"""
    lowest_k: float | None = None
    """Lowest value of the input in the training logs, relative to its reference. [K]"""
    highest_k: float | None = None
    """Highest value in the training logs. [K]"""
    static_gain_um_per_k: float | None = None
    """Gain of the best static regression on the training logs: the baseline of a verification,
    never used by the cycle. [µm/K]"""

    def __post_init__(self) -> None:
        """Check the numbers."""
        if not self.name or not self.plus:
            raise ConfigurationError("no_channel", key="plus", channel=self.name)
        if self.plus == self.minus:
            raise ConfigurationError("channel_minus_itself", key="minus", channel=self.name)
        points, largest = self.gain_by_diameter, LARGEST_GAIN_UM_PER_K
        require_count("sections", len(self.sections), 0, MOST_PARTS, self.name)
        for key, value, least, most in (
            ("direct_gain_um_per_k", self.direct_gain_um_per_k, -largest, largest),
            ("delay_s", self.delay_s, 0.0, LONGEST_DELAY_S),
            ("static_gain_um_per_k", self.static_gain_um_per_k, -1e6, 1e6),
            ("tool_gain", self.tool_gain, -1e3, 1e3),
            *(("gain_by_diameter", p.gain, -1e3, 1e3) for p in points),
            *(("gain_by_diameter", p.diameter_mm, -1e6, 1e6) for p in points),
        ):
            if value is not None:
                require_range(key, value, least, most, self.name)
        if not all(a.diameter_mm < b.diameter_mm for a, b in pairwise(points)):
            raise ConfigurationError("not_rising", key="gain_by_diameter", channel=self.name)
        if (self.lowest_k is None) != (self.highest_k is None):
            raise ConfigurationError("half_range", key="lowest_k, highest_k", channel=self.name)
        if self.lowest_k is not None and self.highest_k is not None:
            require_range("lowest_k", self.lowest_k, -1e6, 1e6, self.name)
            require_range("highest_k", self.highest_k, self.lowest_k, 1e6, self.name)

    @property
    def range_k(self) -> tuple[float, float]:
        """Range of its input in the training logs; without bounds where it is not known. [K]"""
        if self.lowest_k is None or self.highest_k is None:
            return -math.inf, math.inf
        return self.lowest_k, self.highest_k

    @property
    def dc_gain_um_per_k(self) -> float:
        """What a lasting change of one kelvin does in the end, before any gain. [µm/K]"""
        return self.direct_gain_um_per_k + math.fsum(s.gain_um_per_k for s in self.sections)


@final
@dataclass(frozen=True, slots=True)
class Output:
    """One displacement: the sum of its parts and an offset.

    Positive means: the tool point moves away from the workpiece. The correction is minus this.
    """

    name: str
    """Name, with its unit: ``Z_um``."""
    parts: tuple[Part, ...]
    """Its parts."""
    offset_um: float = 0.0
    """Displacement where every input is at its reference for long. [µm]"""

    def __post_init__(self) -> None:
        """Check name and parts."""
        if not self.name:
            raise ConfigurationError("output_without_name", key="name")
        require_count("parts", len(self.parts), 1, MOST_PARTS, self.name)
        require_unique("parts", [part.name for part in self.parts], self.name)
        require_range("offset_um", self.offset_um, -1e6, 1e6, self.name)


@final
@dataclass(frozen=True, slots=True)
class TrainingLog:
    """A log that the model was made from."""

    name: str
    """Name of the file, without its folder."""
    sha256: str
    """Hash of the file; empty where it was no file."""
    rows: int
    """Rows that were used. [1]"""
    first_row: int = 0
    """First of them, from 0. [1]"""


@final
@dataclass(frozen=True, slots=True)
class Layout:
    """A model as flat rows: parts in the order of the outputs, sections in that of the parts.

    An input is a channel, or the difference of two; parts that share it are driven by one number.
    """

    parts: tuple[Part, ...]
    wires: tuple[tuple[int, int], ...]  # by input: its channel, and the subtracted one or -1
    ranges: tuple[tuple[float, float], ...]  # by input: where no part leaves its range [K]
    driven: tuple[int, ...]  # by part: number of its input
    taus_s: tuple[float, ...]  # by section: time constant
    drives: tuple[int, ...]  # by section: number of its input
    owners: tuple[int, ...]  # by section: number of its part
    spans: tuple[tuple[int, int, float], ...]  # by output: first part, part behind, offset [µm]
    gained: tuple[int, ...]  # numbers of the parts with a gain by diameter
    delayed: tuple[int, ...]  # numbers of the parts with a delay
    longest_delay_s: float


def _layout_of(outputs: tuple[Output, ...], channels: tuple[str, ...]) -> Layout:
    parts = tuple(part for output in outputs for part in output.parts)
    number = {channel: k for k, channel in enumerate(channels)} | {"": -1}
    wired = [(number[part.plus], number[part.minus]) for part in parts]
    wires = tuple(dict.fromkeys(wired))
    sharing = [[part.range_k for part, w in zip(parts, wired) if w == wire] for wire in wires]
    driven = tuple(wires.index(wire) for wire in wired)
    owners = tuple(k for k, part in enumerate(parts) for _ in part.sections)
    behind = accumulate(len(output.parts) for output in outputs)
    return Layout(
        parts=parts,
        wires=wires,
        ranges=tuple((max(low for low, _ in r), min(high for _, high in r)) for r in sharing),
        driven=driven,
        taus_s=tuple(s.time_constant_s for part in parts for s in part.sections),
        drives=tuple(driven[k] for k in owners),
        owners=owners,
        spans=tuple((k - len(o.parts), k, o.offset_um) for k, o in zip(behind, outputs)),
        gained=tuple(k for k, part in enumerate(parts) if part.gain_by_diameter),
        delayed=tuple(k for k, part in enumerate(parts) if part.delay_s > 0.0),
        longest_delay_s=max(part.delay_s for part in parts),
    )


def _no_mapping() -> Mapping[str, float]:
    return MappingProxyType({})


@final
@dataclass(frozen=True, slots=True)
class Provenance:
    """Where the model comes from."""

    method: str = ""
    """Estimator, in words."""
    program: str = ""
    """Name and version of the program."""
    date: str = ""
    """Date of the identification, as stated by whoever made it; may be empty."""
    logs: tuple[TrainingLog, ...] = ()
    """The training logs."""
    figures: Mapping[str, float] = field(default_factory=_no_mapping)
    """Figures by name, such as ``Z_um.fit_percent``; the unit ends the name."""

    def __post_init__(self) -> None:
        """Check and freeze the figures."""
        for name, value in self.figures.items():
            if not math.isfinite(value):
                raise ConfigurationError("not_finite", key=f"figures.{name}")
        object.__setattr__(self, "figures", MappingProxyType(dict(self.figures)))

    @property
    def condemned(self) -> tuple[str, ...]:
        """Outputs of which the identification says ``NAME.condemned``: not to be used."""
        names = (name.rpartition(".") for name, value in self.figures.items() if value)
        return tuple(output for output, _, figure in names if figure == "condemned")


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class CompensationModel:
    """Outputs with their parts, references, and when the model may be believed.

    Not protected: limits of the correction are not set by the identification; `limits_set` says
    so, and nothing may act on a machine before they are. The model knows neither whether its
    channels are wired to the sensors that it was made with, nor whether the machine was changed.

    Raises
    ------
    ConfigurationError
        If names repeat, a number is out of its range, or a stated reference lacks a channel.
    """

    outputs: tuple[Output, ...]
    """The displacements."""
    sample_time_s: float = 1.0
    """Nominal time from reading to reading. [s]"""
    reference: str = START
    """``start`` or ``stated``."""
    reference_c: Mapping[str, float] = field(default_factory=_no_mapping)
    """Reference by channel where it is stated; with ``start`` those of training, for
    information. [degC]"""
    input_filter_s: float = 0.0
    """Time constant of a first-order filter of every input, 0 for none; it is part of the
    identified model. [s]"""
    longest_gap_s: float = 3600.0
    """After a longer gap between readings the model starts anew. Default: an hour, of the order
    of the time constants that matter. [s]"""
    longest_hold_s: float = 60.0
    """An input that fails is held so long before the output is bad. Default: a minute, in which
    no temperature of a machine moves by more than some tenths of a kelvin. [s]"""
    provenance: Provenance = field(default_factory=Provenance)
    """Where it comes from."""
    warnings: tuple[str, ...] = ()
    """What its user must know, in words."""
    channels: tuple[str, ...] = field(init=False)
    """Every channel that it needs, in the order of first use."""
    layout: "Layout" = field(init=False, repr=False, compare=False)
    """The same model as flat rows of numbers, for the cycle."""

    def __post_init__(self) -> None:
        """Check the model and collect its channels."""
        require_count("outputs", len(self.outputs), 1, MOST_PARTS)
        require_unique("outputs", [output.name for output in self.outputs])
        require_positive("sample_time_s", self.sample_time_s, 86400.0)
        require_range("input_filter_s", self.input_filter_s, 0.0, 86400.0)
        require_positive("longest_gap_s", self.longest_gap_s, 1e8)
        require_range("longest_hold_s", self.longest_hold_s, 0.0, 1e6)
        require_known("reference", [self.reference], (START, STATED), "unknown_choice")
        used: dict[str, None] = {}
        for output in self.outputs:
            for part in output.parts:
                used[part.plus] = None
                if part.minus:
                    used[part.minus] = None
        object.__setattr__(self, "channels", tuple(used))
        object.__setattr__(self, "layout", _layout_of(self.outputs, tuple(used)))
        object.__setattr__(self, "reference_c", MappingProxyType(dict(self.reference_c)))
        for channel, value in self.reference_c.items():
            require_range("reference_c", value, -1e6, 1e6, channel)
        lacking = tuple(channel for channel in used if channel not in self.reference_c)
        if self.reference == STATED and lacking:
            raise ConfigurationError("reference_missing", names=lacking, key="reference_c")
