"""What is exported: a compensation at a fixed cycle, in the numbers of a PLC."""

import re
from dataclasses import dataclass, field, replace
from itertools import pairwise
from math import expm1, frexp
from typing import final

from thermaxis.compensation import Compensation, CompensationModel, Part
from thermaxis.errors import ConfigurationError
from thermaxis.plc.tree import REMARK, PlcNames, names_of, noted, remark_text, stored

INTERLOCK = "plc"
"""Name of the one interlock of the block."""
CYCLE_TOLERANCE = 0.1
"""Share by which a measured cycle may differ from the exported one. Default: a tenth. [1]"""
LONGEST_DELAY_CYCLES = 10_000
"""Longest delay: the elements of an array that an old PLC has room for. [1]"""
MOST_OUTPUTS = 8
"""Most outputs of a program. [1]"""
MOST_PARTS = 50
"""Most parts of a program. [1]"""
MOST_SECTIONS = 100
"""Most sections of a program. [1]"""
MOST_CHANNELS = 32
"""Most channels of a program: the terminals of some modules. [1]"""
COUNTED_PER_S = 128
"""Cycles in REAL are multiples of a second by this, so that times up to a day are counted exactly:
a day has less than 2**24 of them. [1/s]"""
LEAST_STEP_ULPS = 1000
"""Least change in a cycle that a rate may allow in REAL, in units in the last place of the total:
rounding then changes the rate by less than a thousandth. [1]"""
LARGEST_STALL = 1e-3
"""Largest share of a step in which a section in REAL may come to rest too early. [1]"""

_HASH = re.compile(r"[0-9a-f]{64}")


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class PlcSettings:
    """What `build_program` builds.

    Not protected: whether the limits suit the machine; whether the PLC calls the block as often
    as stated is checked by the block itself, from the cycle time that it is told.

    Raises
    ------
    ConfigurationError
        If there are redundant sensors or other interlocks than `INTERLOCK`, too many outputs,
        parts, sections or channels, a delay that is no whole number of cycles or too long, a gap
        that is shorter than the longest cycle, a name that cannot be made legal, a note with
        signs that no remark may have, or a number that the target's numbers cannot hold. In REAL
        also if the cycle is no multiple of 1/128 s, a time is too long to be counted exactly, or
        a rate is lost in the rounding of its total.
    """

    compensation: Compensation
    """Model, rules and limits; its cycle is that of the PLC."""
    double: bool = True
    """Whether numbers are LREAL, or REAL."""
    name: str = "compensation"
    """Name of the block, before it is made legal."""
    model_sha256: str = ""
    """Hash of the model's file, in 64 hexadecimal digits; empty where there is none."""
    notes: tuple[str, ...] = ()
    """What the export has changed in the model, in sentences that may stand in a remark: what
    people have written in them has passed `remark_text`, once."""
    names: PlcNames = field(init=False, repr=False, compare=False)
    """Names of everything."""

    def __post_init__(self) -> None:
        """Check what a PLC can hold."""
        compensation = self.compensation
        model = compensation.model
        if compensation.redundant:
            raise ConfigurationError(
                "the block has no redundant sensors",
                where="redundant",
                remedy="Choose the better one before the block, and clear its ok where they differ",
            )
        if compensation.interlocks != (INTERLOCK,):
            raise ConfigurationError(
                f"the block has the one interlock {INTERLOCK}",
                where="interlocks",
                remedy="Combine the conditions before the block",
            )
        _require_size(model)
        for part in model.layout.parts:
            _require_delay(part, compensation.cycle_s)
        if model.longest_gap_s < self.longest_cycle_s:
            raise ConfigurationError(
                f"the model starts anew after {model.longest_gap_s:g} s, within a cycle",
                where="longest_gap_s",
                remedy="Export it with a shorter cycle",
            )
        if self.model_sha256 and not _HASH.fullmatch(self.model_sha256):
            raise ConfigurationError("not 64 hexadecimal digits", where="model_sha256")
        if not all(REMARK.fullmatch(text) for text in self.notes):
            raise ConfigurationError(
                "a note has signs that no remark may have",
                where="notes",
                remedy="Let what people have written pass remark_text",
            )
        object.__setattr__(self, "names", names_of(model, self.name))
        _require_numbers(self)

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
        """Return the delay of a part.

        Parameters
        ----------
        part : Part
            A part of the model.

        Returns
        -------
        int
            Its delay in cycles. [1]
        """
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

    The redundant sensors are left out, the interlocks are one, and every delay is the nearest whole
    number of cycles; `notes` says which were changed.

    Parameters
    ----------
    compensation : Compensation
        Model, rules and limits.
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
        compensation, cycle_s=cycle_s, redundant=frozenset[str](), interlocks=(INTERLOCK,)
    )
    notes: list[str] = []
    outputs = tuple(
        replace(output, parts=tuple(_in_cycles(part, cycle_s, notes) for part in output.parts))
        for output in compensation.model.outputs
    )
    if notes:
        changed = replace(changed, model=replace(compensation.model, outputs=outputs))
    return PlcSettings(
        compensation=changed,
        double=double,
        name=name,
        model_sha256=model_sha256,
        notes=tuple(notes),
    )


def _in_cycles(part: Part, cycle_s: float, notes: list[str]) -> Part:
    delay_s = round(part.delay_s / cycle_s) * cycle_s
    if delay_s == part.delay_s:
        return part
    seconds = f"{noted(part.delay_s)} s in the model, {noted(delay_s)} s here"
    notes.append(f"delay of {remark_text(part.name)}: {seconds}")
    return replace(part, delay_s=delay_s)


# ---- checks -------------------------------------------------------------------------------------


def _require_size(model: CompensationModel) -> None:
    layout = model.layout
    for what, number, most in (
        ("outputs", len(model.outputs), MOST_OUTPUTS),
        ("parts", len(layout.parts), MOST_PARTS),
        ("sections", len(layout.taus_s), MOST_SECTIONS),
        ("channels", len(model.channels), MOST_CHANNELS),
    ):
        if number > most:
            raise ConfigurationError(
                f"the model has {number} {what}, of which a block takes {most}",
                where=what,
                remedy="Export its outputs one by one",
            )


def _require_delay(part: Part, cycle_s: float) -> None:
    cycles = part.delay_s / cycle_s
    where = f"part {part.name}"
    if cycles > LONGEST_DELAY_CYCLES:
        raise ConfigurationError(
            f"its delay is {cycles:.0f} cycles, longer than {LONGEST_DELAY_CYCLES}",
            where=where,
            remedy="Export it with a longer cycle",
        )
    if part.delay_s != round(cycles) * cycle_s:
        raise ConfigurationError(
            f"its delay of {part.delay_s:g} s is no whole number of cycles",
            where=where,
            remedy="Round it, as the export does",
        )


def compensated_stall(alpha: float) -> float:
    """Return the share of a step at which a section in REAL comes to rest too early.

    A compensated increment keeps what the sum loses in a second state of at most half a unit in
    the last place of the first, a share of 2**-24; an increment is lost only where it is less
    than half a unit in the last place of that one.
    """
    return 2.0**-48 / alpha


def require_no_stall(alpha: float, *, where: str) -> None:
    """Refuse a section that would come to rest too early in REAL."""
    if not alpha > 0.0 or compensated_stall(alpha) > LARGEST_STALL:
        raise ConfigurationError(
            "the section is too slow for its cycle in REAL",
            where=where,
            remedy="Export it with a longer cycle, or with LREAL",
        )


def _require_lag(settings: PlcSettings, tau_s: float, where: str) -> None:
    alpha = -expm1(-settings.cycle_s / tau_s)
    stored(alpha, double=settings.double, where=where)
    if not settings.double:
        require_no_stall(alpha, where=where)


def _require_counted(settings: PlcSettings) -> None:
    """Refuse in REAL what cannot be counted exactly, cycle by cycle."""
    cycle_s = settings.cycle_s
    nearest_s = max(1, round(cycle_s * COUNTED_PER_S)) / COUNTED_PER_S
    if cycle_s != nearest_s:
        raise ConfigurationError(
            f"in REAL times are not counted exactly with a cycle of {cycle_s:g} s",
            where="cycle_s",
            remedy=f"Choose a multiple of 1/{COUNTED_PER_S} s, such as {nearest_s!r}, or LREAL",
        )
    whole, parts = cycle_s.as_integer_ratio()
    longest_s = 2**24 * (whole & -whole) / parts
    compensation = settings.compensation
    rules = compensation.supervisor
    for where, seconds in (
        ("supervisor", rules.max_hold_s),
        ("supervisor", rules.input_timeout_s + rules.hold_input_s),
        ("longest_hold_s", compensation.model.longest_hold_s),
        *(
            (f"frozen_s of {channel}", sensor.frozen_s)
            for channel, sensor in compensation.sensors.items()
        ),
    ):
        if seconds + cycle_s > longest_s:
            raise ConfigurationError(
                f"{seconds:g} s are more than the {longest_s:g} s that REAL counts exactly",
                where=where,
                remedy="Choose shorter times or a cycle of whole seconds, or LREAL",
            )


def _require_rates(settings: PlcSettings) -> None:
    """Refuse in REAL a rate that rounding would change."""
    compensation = settings.compensation
    for output, bounds in zip(compensation.model.outputs, compensation.bounds, strict=True):
        step_um = bounds.largest_rate_um_per_s * settings.cycle_s
        ulp_um = 2.0 ** (frexp(bounds.total_um)[1] - 24)
        if step_um < LEAST_STEP_ULPS * ulp_um:
            raise ConfigurationError(
                f"in REAL its rate is lost in rounding: {step_um:g} um in a cycle, of a total of"
                f" {bounds.total_um:g} um",
                where=f"rate of {output.name}",
                remedy=(
                    f"Allow {LEAST_STEP_ULPS * ulp_um:.3g} um in a cycle or more: a longer cycle,"
                    " a higher rate or a smaller total; or LREAL"
                ),
            )


def _require_numbers(settings: PlcSettings) -> None:
    model, double = settings.compensation.model, settings.double
    if not double:
        _require_counted(settings)
        _require_rates(settings)
    if model.input_filter_s > 0.0:
        _require_lag(settings, model.input_filter_s, "input_filter_s")
    for part in model.layout.parts:
        where = f"part {part.name}"
        numbers = [part.direct_gain_um_per_k, part.tool_gain]
        numbers += [section.gain_um_per_k for section in part.sections]
        numbers += [x for p in part.gain_by_diameter for x in (p.diameter_mm, p.gain)]
        for value in numbers:
            stored(value, double=double, where=where)
        for section in part.sections:
            _require_lag(settings, section.time_constant_s, where)
        held = [stored(p.diameter_mm, double=double, where=where) for p in part.gain_by_diameter]
        if any(a >= b for a, b in pairwise(held)):
            raise ConfigurationError(
                "two diameters of its gains are one number in REAL",
                where=where,
                remedy="Export it with LREAL",
            )
