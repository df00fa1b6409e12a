"""NC programs of thermal tests: sources of heat are switched, and it is waited between.

Every control states its words (`HeatingWords`); what is written with them is the same.
"""

import re
from collections.abc import Iterator
from typing import TYPE_CHECKING

from thermaxis.codes import Place
from thermaxis.controls._control import (
    Control,
    HeatingRequest,
    HeatingWords,
    axis_letter,
    comment_text,
    plain_number,
    whole_option,
)
from thermaxis.controls._program import LARGEST_REPETITIONS, check_travel, travel_line
from thermaxis.errors import ConfigurationError

if TYPE_CHECKING:
    from thermaxis.thermal import PlannedStep, SourceSwitch, ThermalTestPlan

_LARGEST_POSITION_MM = 99_999.0
_HIGHEST_PROGRAM = 7999
_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9_-]{0,15}")


def heating_program(control: Control, request: HeatingRequest) -> str:
    """Return the NC program of a thermal test, see `Control.format_heating`."""
    words = control.heating
    sources = _switches(request.plan, words.spindles)
    _check(request, list(sources.values()))
    lines = [line.format(**request.options) for line in words.first]
    lines += [words.comment.format(comment_text(line, 100)) for line in _head(control, request)]
    lines += [line.format(**request.options) for line in words.begin]
    stop = [line for switch in sources.values() for line in _switched(switch, 0.0, words)]
    lines += stop
    before = (0.0,) * len(sources)
    for number, step in enumerate(request.plan.steps, start=1):
        pairs = zip(sources, step.levels, strict=True)
        shown = " ".join(f"{name} {level:g}" for name, level in pairs)
        text = comment_text(f"{step.begin_s / 60.0:.0f} min {shown}", 100)
        lines.append(words.comment.format(text))
        for switch, level, old in zip(sources.values(), step.levels, before, strict=True):
            if level != old:
                lines += _switched(switch, level, words)
        lines += _waited(tuple(sources.values()), step, words, number)
        before = step.levels
    lines += [*stop, *(line.format(**request.options) for line in words.end)]
    if words.numbered:
        lines = [f"{number} {line}" for number, line in enumerate(lines)]
    text = "".join(line + control.newline for line in lines)
    return text.upper() if words.upper_case else text


def _switches(plan: "ThermalTestPlan", spindles: int) -> "dict[str, SourceSwitch]":
    found: dict[str, SourceSwitch] = {}
    for name, source in plan.conditions.sources.items():
        place = Place(key=f"sources.{name}.switch")
        if source.switch is None:
            raise ConfigurationError("source_without_switch", place=place)
        if source.switch.kind == "spindle" and source.switch.spindle > spindles:
            raise ConfigurationError("no_such_spindle", most=spindles, place=place)
        found[name] = source.switch
    return found


def _check(request: HeatingRequest, switches: "list[SourceSwitch]") -> None:
    ends = _ends_mm(switches)
    if ends:
        check_travel(ends, request.travel, "mm", "heating_beyond_travel")
    if any(abs(end) > _LARGEST_POSITION_MM for end in ends):
        raise ConfigurationError(
            "position_too_large", largest=_LARGEST_POSITION_MM, key="switch.from_mm"
        )
    for name, value in request.options.items():
        if _NAME.fullmatch(value) is None:
            raise ConfigurationError("program_name_unfit", name=value, key=f"--set {name}")
    if "program_number" in request.options:
        whole_option(request.options, "program_number", lowest=1, highest=_HIGHEST_PROGRAM)


def _ends_mm(switches: "list[SourceSwitch]") -> list[float]:
    return [end for switch in switches for end in switch.ends_mm]


def _head(control: Control, request: HeatingRequest) -> Iterator[str]:
    plan = request.plan
    yield f"thermaxis thermal test for {control.title}"
    yield f"plan sha256 {request.plan_sha256}"
    yield f"duration {plan.duration_s / 3600.0:.2f} h. rest and {len(plan.blocks)} blocks"
    for name, source in plan.conditions.sources.items():
        on = "" if source.switch is None else source.switch.acts_on
        yield f"source {name} {on} highest level {source.levels[-1]:g}"
    if _ends_mm([one.switch for one in plan.conditions.each if one.switch is not None]):
        yield travel_line(request.travel, "mm")
    yield "Prove before the test. The speeds must suit spindle tool and clamping."


def _switched(switch: "SourceSwitch", level: float, words: HeatingWords) -> Iterator[str]:
    if switch.kind == "spindle":
        values = {"n": switch.spindle, "k": switch.spindle - 1, "speed": f"{level:g}"}
        lines = words.spindle if level else words.spindle_stop
        yield from (line.format(**values) for line in lines)
    elif switch.kind == "function":
        yield f"M{switch.on if level else switch.off}"


def _waited(
    switches: "tuple[SourceSwitch, ...]",
    step: "PlannedStep",
    words: HeatingWords,
    number: int,
) -> Iterator[str]:
    """Yield the lines of a step: motion of one axis to and fro, and a dwell for the rest."""
    left_s = step.duration_s
    pairs = zip(switches, step.levels, strict=True)
    moving = [(switch, feed) for switch, feed in pairs if switch.kind == "axis" and feed]
    if len(moving) > 1:
        raise ConfigurationError("axes_together", key="blocks")
    for switch, feed in moving:
        axis = axis_letter(switch.axis, "XYZABCUVW")
        from_mm, to_mm = switch.ends_mm
        round_s = 120.0 * abs(to_mm - from_mm) / feed
        times = int(left_s / round_s)
        if times < 1:
            raise ConfigurationError("feed_too_slow", round_s=round_s, key="levels")
        if times > LARGEST_REPETITIONS:
            raise ConfigurationError(
                "too_many_repetitions",
                repetitions=times,
                block=f"step {number}",
                most=LARGEST_REPETITIONS,
                key="switch",
            )
        values = {"number": number, "times": times, "more": times - 1}
        before, after = words.loop if times > 1 else ((), ())
        yield from (line.format(**values) for line in before)
        for end_mm in (to_mm, from_mm):
            yield words.move.format(axis=axis, mm=end_mm, feed=f"{feed:g}")
        yield from (line.format(**values) for line in after)
        left_s -= times * round_s
    while left_s > 1e-3:
        dwell_s = min(left_s, words.longest_dwell_s)
        values = {"s": plain_number(dwell_s, 3), "ms": f"{1000.0 * dwell_s:.0f}"}
        yield from (line.format(**values) for line in words.dwell)
        left_s -= dwell_s
