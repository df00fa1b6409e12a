"""What is exported: a compensation at a fixed cycle, in the numbers of a PLC."""

import re
from dataclasses import dataclass, field, replace
from itertools import pairwise
from math import frexp
from typing import final

from thermaxis.codes import Message, Place
from thermaxis.compensation import (
    LONGEST_REST,
    LONGEST_STEP_CYCLES,
    MOST_EXPECTED,
    Compensation,
    Part,
)
from thermaxis.errors import ConfigurationError, require_count
from thermaxis.plc._names import PlcNames, names_of
from thermaxis.plc._numbers import stored

INTERLOCK = "plc"
"""Name of the one interlock of the block."""
CYCLE_TOLERANCE = 0.1
"""Share by which a measured cycle may differ from the exported one. Default: a tenth. [1]"""
LONGEST_DELAY_CYCLES = 10_000
"""Longest delay: the elements of an array that an old PLC has room for. [1]"""
MOST = {"outputs": 8, "parts": 50, "sections": 100, "channels": 32}
"""Most of each in a program; 32 channels are the terminals of some modules. [1]"""
COUNTED_PER_S = 128
"""Cycles in REAL are multiples of a second by this, so that times up to a day are counted exactly:
a day has less than 2**24 of them. [1/s]"""
LEAST_STEP_ULPS = 1000
"""Least change in a cycle that a rate may allow in REAL, in units in the last place of the total:
rounding then changes the rate by less than a thousandth. [1]"""

_HASH = re.compile(r"[0-9a-f]{64}")


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class PlcSettings:
    """What is exported, and what is refused because no block can carry it.

    Not protected: whether the limits suit the machine; whether the PLC calls the block as often
    as stated is checked by the block itself, from the cycle time that it is told.

    Raises
    ------
    ConfigurationError
        If there are redundant sensors or other interlocks than `INTERLOCK`, too many outputs,
        parts, sections or channels, a delay that is no whole number of cycles or too long, a gap
        that is shorter than two cycles, or a name that cannot be made legal. In REAL also if the
        cycle is no multiple of 1/128 s, a time is too long to be counted exactly, a rate is lost
        in the rounding of its total, or two diameters are the same. Other numbers that the target
        cannot hold are refused by `Block`.
    """

    compensation: Compensation
    """Model, rules and limits; its cycle is that of the PLC."""
    double: bool = True
    """Whether numbers are LREAL, or REAL."""
    name: str = "compensation"
    """Name of the block, before it is made legal."""
    model_sha256: str = ""
    """Hash of the model's file, in 64 hexadecimal digits; empty where there is none."""
    notes: tuple[Message, ...] = ()
    """What the export has changed in the model."""
    names: PlcNames = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        """Check what a PLC can hold."""
        compensation = self.compensation
        model = compensation.model
        if compensation.redundant:
            raise ConfigurationError("no_redundant_in_block", key="redundant")
        if any(own.oldest_s for own in compensation.touches.values()):
            raise ConfigurationError("no_oldest_touch_in_block", key="oldest_s")
        if compensation.interlocks != (INTERLOCK,):
            raise ConfigurationError(
                "one_interlock_in_block", interlock=INTERLOCK, key="interlocks"
            )
        layout = model.layout
        for key, counted in (
            ("outputs", model.outputs),
            ("parts", layout.parts),
            ("sections", layout.taus_s),
            ("channels", compensation.judged),
        ):
            require_count(key, len(counted), 0, MOST[key])
        for part in model.layout.parts:
            _require_delay(part, compensation.cycle_s)
        if model.longest_gap_s < LONGEST_STEP_CYCLES * self.cycle_s:
            raise ConfigurationError(
                "gap_within_cycle", gap_s=model.longest_gap_s, key="longest_gap_s"
            )
        if self.model_sha256 and not _HASH.fullmatch(self.model_sha256):
            raise ConfigurationError("no_sha256", key="model_sha256")
        object.__setattr__(self, "names", names_of(model, self.name, compensation.judged))
        _require_apart(self)
        if not self.double:
            _require_counted(self)
            _require_rates(self)

    @property
    def cycle_s(self) -> float:
        """Time from call to call. [s]"""
        return self.compensation.cycle_s

    @property
    def shortest_cycle_s(self) -> float:
        """Shortest measured cycle in which the block advances. [s]"""
        return self.cycle_s * (1.0 - CYCLE_TOLERANCE)

    @property
    def longest_cycle_s(self) -> float:
        """Longest measured cycle in which the block advances. [s]"""
        return self.cycle_s * (1.0 + CYCLE_TOLERANCE)

    @property
    def steps_um(self) -> tuple[float, ...]:
        """Largest change of the correction in one call, by output: rate times cycle. [µm]"""
        bounds = self.compensation.bounds
        return tuple([b.largest_rate_um_per_s * self.cycle_s for b in bounds])

    def delay_cycles(self, part: Part) -> int:
        """Return the delay of a part in cycles. [1]"""
        return round(part.delay_s / self.cycle_s)


def export_settings(
    compensation: Compensation,
    *,
    cycle_s: float,
    name: str,
    double: bool = True,
    model_sha256: str = "",
) -> PlcSettings:
    """Return what a PLC gets of a compensation.

    The redundant sensors are left out, the interlocks are one, every delay is the nearest whole
    number of cycles, and what touches refer to is remembered for 64 cycles; `notes` says which
    were changed.

    Parameters
    ----------
    cycle_s : float
        Time from call to call. [s]
    name : str
        Name of the block.
    double : bool
        Whether the PLC's numbers are LREAL. Default: they are.
    model_sha256 : str
        Hash of the model's file. Default: none is stated.

    Returns
    -------
    PlcSettings
        The settings; `cycle` with their compensation is what the block does.

    Raises
    ------
    ConfigurationError
        If the cycle is not from 0.1 to 60 s, or as `PlcSettings` says.
    """
    changed = replace(
        compensation,
        cycle_s=cycle_s,
        redundant=frozenset[str](),
        interlocks=(INTERLOCK,),
        touches={n: replace(own, oldest_s=0.0) for n, own in compensation.touches.items()},
    )
    notes: list[Message] = []
    outputs = tuple(
        replace(output, parts=tuple(_in_cycles(part, cycle_s, notes) for part in output.parts))
        for output in compensation.model.outputs
    )
    if notes:
        changed = replace(changed, model=replace(compensation.model, outputs=outputs))
    if any(own.oldest_s for own in compensation.touches.values()):
        values = {"calls": MOST_EXPECTED, "here_s": MOST_EXPECTED * cycle_s}
        notes.append(Message("change-touches_of_calls", values))
    return PlcSettings(
        compensation=changed,
        double=double,
        name=name,
        model_sha256=model_sha256,
        notes=tuple(notes),
    )


def _in_cycles(part: Part, cycle_s: float, notes: list[Message]) -> Part:
    delay_s = round(part.delay_s / cycle_s) * cycle_s
    if delay_s == part.delay_s:
        return part
    values = {"part": part.name, "model_s": part.delay_s, "here_s": delay_s}
    notes.append(Message("change-delay_in_whole_cycles", values))
    return replace(part, delay_s=delay_s)


# ---- checks -------------------------------------------------------------------------------------


def _require_delay(part: Part, cycle_s: float) -> None:
    cycles = part.delay_s / cycle_s
    if cycles > LONGEST_DELAY_CYCLES:
        raise ConfigurationError(
            "delay_too_long",
            cycles=round(cycles),
            most=LONGEST_DELAY_CYCLES,
            key="parts",
            channel=part.name,
        )
    if part.delay_s != round(cycles) * cycle_s:
        raise ConfigurationError(
            "delay_no_whole_cycles",
            delay_s=part.delay_s,
            cycle_s=cycle_s,
            key="parts",
            channel=part.name,
        )


def compensated_stall(alpha: float) -> float:
    """Return the share of a step at which a section in REAL comes to rest too early.

    A compensated increment keeps what the sum loses in a second state of at most half a unit in
    the last place of the first, a share of 2**-24; an increment is lost only where it is less
    than half a unit in the last place of that one.
    """
    return 2.0**-48 / alpha


def _require_counted(settings: PlcSettings) -> None:
    """Refuse in REAL what cannot be counted exactly, cycle by cycle."""
    cycle_s = settings.cycle_s
    nearest_s = max(1, round(cycle_s * COUNTED_PER_S)) / COUNTED_PER_S
    if cycle_s != nearest_s:
        raise ConfigurationError(
            "cycle_not_counted",
            cycle_s=cycle_s,
            parts=COUNTED_PER_S,
            nearest_s=nearest_s,
            key="cycle_s",
        )
    whole, parts = cycle_s.as_integer_ratio()
    longest_s = 2**24 * (whole & -whole) / parts
    compensation = settings.compensation
    rules = compensation.supervisor
    for place, seconds in (
        (Place(key="supervisor"), rules.max_hold_s),
        (Place(key="supervisor"), rules.input_timeout_s + rules.hold_input_s),
        (Place(key="longest_hold_s"), compensation.model.longest_hold_s),
        *(
            (
                Place(key="frozen_s", channel=channel),
                sensor.frozen_s * (LONGEST_REST if sensor.moves_with else 1.0),
            )
            for channel, sensor in compensation.sensors.items()
        ),
    ):
        if seconds + cycle_s > longest_s:
            raise ConfigurationError(
                "time_not_counted", seconds=seconds, longest_s=longest_s, place=place
            )


def _require_rates(settings: PlcSettings) -> None:
    """Refuse in REAL a rate that rounding would change."""
    compensation = settings.compensation
    touches = ((name, own.limits) for name, own in compensation.touches.items())
    for name, bounds in (*compensation.limits.items(), *touches):
        step_um = bounds.largest_rate_um_per_s * settings.cycle_s
        ulp_um = 2.0 ** (frexp(bounds.total_um)[1] - 24)
        if step_um < LEAST_STEP_ULPS * ulp_um:
            raise ConfigurationError(
                "rate_lost_in_real",
                step_um=step_um,
                total_um=bounds.total_um,
                least_um=LEAST_STEP_ULPS * ulp_um,
                key="largest_rate_um_per_s",
                channel=name,
            )


def _require_apart(settings: PlcSettings) -> None:
    """Refuse diameters that the target's numbers do not tell apart."""
    for part in settings.compensation.model.layout.parts:
        place = Place(key="parts", channel=part.name)
        held_mm = [
            stored(p.diameter_mm, double=settings.double, place=place)
            for p in part.gain_by_diameter
        ]
        if any(a >= b for a, b in pairwise(held_mm)):
            raise ConfigurationError("diameters_equal_in_real", place=place)
