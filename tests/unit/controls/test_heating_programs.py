"""NC programs of thermal tests, read back: what runs when, and for how long."""

import re
from dataclasses import replace

import pytest

from tests.refusals import refused
from thermaxis.controls import (
    HeatingRequest,
    check_options,
    control_by_name,
    control_names,
)
from thermaxis.errors import ConfigurationError
from thermaxis.thermal import (
    HeatingConditions,
    HeatSource,
    SourceSwitch,
    SwitchKind,
    ThermalTestPlan,
    planned,
    prior_of,
)
from thermaxis.thermal.design import CustomaryTest, PlannedKnowledge

SPINDLE = SourceSwitch(SwitchKind.SPINDLE)
AXIS = SourceSwitch(SwitchKind.AXIS, axis="X", from_mm=10.0, to_mm=310.0)
PUMP = SourceSwitch(SwitchKind.FUNCTION, on=8, off=9)
SOURCES = {
    "spindle": HeatSource(levels=(0.0, 1000.0, 3000.0), switch=SPINDLE),
    "slide": HeatSource(levels=(0.0, 6000.0), switch=AXIS),
    "pump": HeatSource(switch=PUMP),
}
BLOCKS = (
    *((3000.0, 0.0, 0.0), (3000.0, 6000.0, 1.0), (0.0, 6000.0, 1.0), (1000.0, 0.0, 0.0)),
    *((1000.0, 0.0, 0.0), (1000.0, 0.0, 0.0)),
)


def plan_of(
    sources: dict[str, HeatSource], blocks: tuple[tuple[float, ...], ...]
) -> ThermalTestPlan:
    return ThermalTestPlan(
        conditions=HeatingConditions(sources=sources),
        blocks=blocks,
        foreseen_um=(1.0,) * len(blocks),
        settled_um=(1.0,) * len(sources),
        customary_um={CustomaryTest.HEATING: 2.0},
        knowledge=PlannedKnowledge((1.0,), (0.0, 0.0), ((1.0, 0.0), (0.0, 1.0))),
    )


def program_of(
    name: str, plan: ThermalTestPlan, *stated: str, travel: tuple[float, float] | None = None
) -> str:
    control = control_by_name(name)
    options = check_options(control, stated, purpose="heating")
    return control.format_heating(HeatingRequest(plan, "ab" * 32, options, travel))


def read_back(text: str) -> list[tuple[float, float, bool, float]]:
    """Return time, spindle speed, pump and way of the axis of each stretch of waiting. [s, mm]"""
    lines = [re.sub(r"^\d+ (?=\S)", "", line).strip() for line in text.splitlines()]
    lines = [re.sub(r"\(.*\)|;.*", "", line).strip() for line in lines]
    found: list[tuple[float, float, bool, float]] = []
    speed, pump, times, place, pending = 0.0, False, 1, 10.0, 0.0
    for k, line in enumerate(lines):
        if dwell := re.fullmatch(r"G0?4 ([FP])([\d.]+)|CYCL DEF 9\.1 DWELL ([\d.]+)", line):
            seconds = float(dwell[2] or dwell[3])
            seconds /= 1000.0 if line.startswith("G04") else 1.0
            found.append((seconds, speed, pump, 0.0))
        elif re.search(r"\bM(1=)?0?5\b", line):
            speed = 0.0
        elif turned := re.search(r"(?:TOOL CALL )?S(?:1=)?(\d+)", line):
            pending = float(turned[1])
            speed = pending if "M" in line else speed
        elif re.match(r"M0?3", line):
            speed = pending
        elif line in {"M8", "M9"}:
            pump = line == "M8"
        elif loop := re.search(r"repeat \[(\d+)\]|TO (\d+)|#1LE(\d+)", line):
            times = int(next(one for one in loop.groups() if one))
        elif moved := re.search(r"(?:G1|L) X=?\+?(-?[\d.]+)(?: R0)? F(\d+)", line):
            if line.startswith("L"):
                again = next(one for one in lines[k:] if one.startswith("CALL LBL"))
                times = int(again.rpartition(" ")[2]) + 1
            way = times * abs(float(moved[1]) - (place if place != float(moved[1]) else 10.0))
            place = float(moved[1])
            found.append((60.0 * way / float(moved[2]), speed, pump, way))
    return found


@pytest.mark.parametrize("name", control_names())
def test_every_control_waits_as_long_as_planned_at_the_planned_levels(name: str) -> None:
    plan = plan_of(SOURCES, BLOCKS)
    done = read_back(program_of(name, plan, travel=(0.0, 400.0)))
    assert sum(one[0] for one in done) == pytest.approx(plan.duration_s, abs=1.0)
    expected = {(0.0, False): 600.0, (3000.0, False): 1800.0, (3000.0, True): 1800.0}
    expected |= {(0.0, True): 1800.0, (1000.0, False): 5400.0}
    for (speed, pump), seconds in expected.items():
        own = sum(one[0] for one in done if one[1:3] == (speed, pump))
        assert own == pytest.approx(seconds, abs=1.0), (speed, pump)
    assert sum(one[3] for one in done) == pytest.approx(2 * 1800.0 * 6000.0 / 60.0, rel=1e-6)


@pytest.mark.parametrize("name", control_names())
def test_all_stands_still_at_begin_and_end(name: str) -> None:
    text = program_of(name, plan_of(SOURCES, BLOCKS))
    lines = [re.sub(r"^\d+ (?=\S)", "", line) for line in text.splitlines()]
    stops = [k for k, line in enumerate(lines) if re.match(r"M(1=)?0?5\b", line)]
    first = next(k for k, line in enumerate(lines) if re.search(r"\bM(1=)?0?3\b|M1=3", line))
    last = max(k for k, line in enumerate(lines) if "DWELL" in line or re.match("G0?4", line))
    assert stops[0] < first
    assert stops[-1] > last
    assert "WARNING travel of the axis was not stated" in text.replace("TRAVEL", "travel").replace(
        "OF THE AXIS WAS NOT STATED", "of the axis was not stated"
    )


@pytest.mark.parametrize("name", control_names())
def test_names_of_sources_stay_in_their_comments(name: str) -> None:
    hostile = "x) M3 S9000\n; %"
    plan = plan_of({hostile: SOURCES["pump"]}, ((1.0,), (0.0,)))
    text = program_of(name, plan)
    assert "\nM3 S9000" not in text
    assert all(")" not in line[:-1] for line in text.splitlines() if line.startswith("("))


def test_a_program_is_refused_that_could_not_be_run() -> None:
    two = {name: SOURCES[name] for name in ("spindle", "slide")}
    other = replace(AXIS, axis="Y")
    two_axes = {"a": SOURCES["slide"], "b": replace(SOURCES["slide"], switch=other)}
    cases = [
        ({"a": HeatSource()}, "source_without_switch", "fanuc"),
        ({"a": HeatSource(switch=replace(SPINDLE, spindle=2))}, "no_such_spindle", "fanuc"),
        ({"a": HeatSource(levels=(0.0, 1.0), switch=AXIS)}, "feed_too_slow", "linuxcnc"),
        ({"a": HeatSource(levels=(0.0, 1e6), switch=AXIS)}, "too_many_repetitions", "linuxcnc"),
        (two_axes, "axes_together", "sinumerik"),
    ]
    for sources, code, name in cases:
        on = tuple(source.levels[-1] for source in sources.values())
        with pytest.raises(ConfigurationError) as caught:
            program_of(name, plan_of(sources, (on, on)))
        assert caught.value.code == code
    with refused("heating_beyond_travel"):
        program_of("sinumerik", plan_of(two, ((3000.0, 0.0),)), travel=(0.0, 300.0))
    for name, stated in (
        ("fanuc", "program_number=M30"),
        ("heidenhain-tnc640", "program_name=A B"),
    ):
        with pytest.raises(ConfigurationError):
            program_of(name, plan_of({"a": SOURCES["pump"]}, ((1.0,), (0.0,))), stated)


def test_a_second_spindle_has_its_number() -> None:
    both = {
        "one": HeatSource(levels=(0.0, 900.0), switch=SPINDLE),
        "two": HeatSource(levels=(0.0, 500.0), switch=replace(SPINDLE, spindle=2)),
    }
    plan = plan_of(both, ((900.0, 500.0), (0.0, 500.0)))
    sinumerik, linuxcnc = program_of("sinumerik", plan), program_of("linuxcnc", plan)
    assert "S1=900 M1=3" in sinumerik
    assert "S2=500 M2=3" in sinumerik
    assert sinumerik.index("M1=5", sinumerik.index("M1=3")) < sinumerik.rindex("M2=5")
    assert "M3 $1" in linuxcnc
    assert "M5 $0" in linuxcnc


def test_what_is_planned_is_what_is_written() -> None:
    conditions = HeatingConditions(sources={"spindle": SOURCES["spindle"]})
    plan = planned(conditions, prior_of(conditions), 2 * 3600.0)
    done = read_back(program_of("linuxcnc", plan))
    runs = [(step.duration_s, step.levels[0]) for step in plan.steps]
    assert [(one[0], one[1]) for one in done] == runs
