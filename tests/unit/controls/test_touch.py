"""Touch programs of every control, run by interpreters of our own."""

import math

import pytest
from hypothesis import given, settings, strategies as st

from tests.refusals import refused
from tests.unit.controls.touch_interpreters import AlarmError, Machine, run, run_sinumerik
from thermaxis.controls import TouchRequest, check_options, control_by_name, control_names

KLARTEXT = {"TCH PROBE 4.0 MEASURING IN 3-D"}
MODES = {
    "fanuc": {"G21", "G91", "G94", "G40", "G61", "G90", "G64"},
    "heidenhain-itnc530": KLARTEXT,
    "heidenhain-tnc640": KLARTEXT,
    "linuxcnc": {"M73", "G21", "G90", "G94", "G40", "G61.1"},
    "sinumerik": {"G710", "G90", "G94", "G40", "D0", "TRAFOOF", "DIAMOF", "G60"},
}
NO_TOUCH = {"fanuc": "81", "linuxcnc": "no touch within the search", "sinumerik": "65001"}


def touch_program(name: str, *sets: str, **changes: object) -> str:
    control = control_by_name(name)
    stated = {"axis": "Z", "surface_mm": 10.0, "start_mm": 15.0, "search_mm": 10.0}
    fields = {**stated, "feed_mm_per_min": 60.0, **changes}
    options = check_options(control, sets, purpose="touch")
    return control.format_touch(TouchRequest(**fields, options=options))


@pytest.mark.parametrize("name", control_names())
@given(
    axis=st.sampled_from("XYZ"),
    start=st.integers(-400_000, 400_000),
    ahead=st.integers(500, 40_000),
    behind=st.integers(500, 40_000),
    side=st.sampled_from([-1, 1]),
    shares=st.lists(st.floats(0.02, 0.9), min_size=1, max_size=4),
    shift=st.floats(-500.0, 500.0),
    feed=st.floats(1.0, 2000.0),
    counter=st.integers(0, 10_000),
)
@settings(max_examples=30, deadline=None)
def test_every_touch_leaves_where_the_surface_is_whatever_offset_is_in_force(  # noqa: PLR0917 - what hypothesis draws
    name: str,
    axis: str,
    start: int,
    ahead: int,
    behind: int,
    side: int,
    shares: list[float],
    shift: float,
    feed: float,
    counter: int,
) -> None:
    begin, search = start / 1000.0, (ahead + behind) / 1000.0
    stated = begin + side * ahead / 1000.0
    inner = [0.1 + share * (search - 0.2) for share in shares]  # not within 0.1 mm of an end
    surfaces = [begin + side * way for way in inner]
    fed = round(feed, 2)
    program = touch_program(
        name,
        axis=axis,
        surface_mm=stated,
        start_mm=begin,
        search_mm=search,
        feed_mm_per_min=fed,
        touches=len(shares),
        pause_s=1800.0 if len(shares) > 1 else 0.0,
    )
    machine = Machine(list(surfaces), axis, shift=shift, counter=float(counter))
    done = run(name, program, machine)
    assert (done.alarm, done.spindle) == ("", False)
    assert done.modes >= MODES[name]
    for k, (result, surface) in enumerate(zip(done.results, surfaces, strict=True)):
        value_um, number, reading_mm = result
        assert reading_mm == pytest.approx(surface, abs=1e-8)
        assert value_um == pytest.approx(1000.0 * (stated - surface), abs=1e-5)
        assert number == counter + k + 1
    assert done.places[::3] == pytest.approx([begin] * len(shares), abs=1e-9)
    assert done.places[2::3] == pytest.approx([begin] * len(shares), abs=1e-9)
    way = [side * (place - begin) for place in done.places]
    assert -1e-9 <= min(way) <= max(way) <= search + 1e-9
    assert sorted(done.feeds) == pytest.approx([fed], rel=1e-5)
    assert done.dwell_s == [1800.0] * (len(shares) - 1)


@pytest.mark.parametrize("says", [True, False])
@pytest.mark.parametrize("name", control_names())
def test_without_a_touch_the_axis_goes_back_and_nothing_is_left_behind(
    name: str, *, says: bool
) -> None:
    program = touch_program(name, touches=3, pause_s=1.0)
    done = run(name, program, Machine([10.001, None, 10.0], counter=7.0, says=says))
    assert done.alarm == NO_TOUCH.get(name, "100")
    assert done.results == [pytest.approx((-1.0, 8.0, 10.001))]
    assert done.places == pytest.approx([15.0, 9.981, 15.0, 15.0, 5.0, 15.0])


@pytest.mark.parametrize("name", control_names())
def test_a_probe_that_is_deflected_before_gives_no_value(name: str) -> None:
    done = run(name, touch_program(name), Machine([], deflected=True))
    assert done.alarm in {"82", "65002", "deflected", "the probe was deflected before"}
    assert done.results == []
    assert min(done.places) > 14.9


def test_the_software_limits_of_a_sinumerik_are_asked_before_anything_moves() -> None:
    program = touch_program("sinumerik")
    for limits in ((5.001, 100.0), (0.0, 14.999)):
        machine = Machine([10.0])
        with pytest.raises(AlarmError, match="65000"):
            run_sinumerik(program, machine, limits)
        assert machine.places == []


def test_a_fanuc_axis_of_another_number_never_searches() -> None:
    lost = run("fanuc", touch_program("fanuc", "axis_number=1"), Machine([10.0]))
    assert (lost.alarm, lost.results, lost.places) == ("83", [], [105.0])


@pytest.mark.parametrize(
    ("changes", "code", "option"),
    [
        ({"travel": (5.1, 20.0)}, "program_beyond_travel", "--travel"),
        ({"travel": (0.0, 14.9)}, "program_beyond_travel", "--travel"),
        ({"surface_mm": 4.9}, "surface_outside_search", "--touch"),
        ({"surface_mm": 14.6}, "surface_outside_search", "--touch"),
        ({"surface_mm": 15.0}, "surface_outside_search", "--touch"),
        ({"search_mm": 101.0}, "outside_range", "--search"),
        ({"search_mm": -10.0}, "outside_range", "--search"),
        ({"search_mm": math.nan}, "outside_range", "--search"),
        ({"feed_mm_per_min": 2000.1}, "outside_range", "--feed"),
        ({"feed_mm_per_min": 0.0}, "outside_range", "--feed"),
        ({"start_mm": 1e5, "surface_mm": 99_995.0}, "outside_range", "--from"),
        ({"touches": 0}, "outside_range", "--times"),
        ({"pause_s": 1e5}, "outside_range", "--every"),
        ({"axis": "?"}, None, "--axis"),
    ],
)
def test_a_touch_that_cannot_be_is_refused(
    changes: dict[str, object], code: str | None, option: str
) -> None:
    for name in control_names():
        own = code or ("axis_name_unfit" if name == "sinumerik" else "unknown_axis")
        with refused(own, key=option):
            touch_program(name, **changes)
        assert touch_program(name, travel=(5.0, 15.0))


@pytest.mark.parametrize("name", control_names())
def test_the_head_says_what_the_program_does_and_whether_the_travel_was_checked(name: str) -> None:
    head = touch_program(name).upper()
    for words in (
        *("searches from 15.000 to 5.000 mm machine coordinates", "feed 60 mm per min"),
        *("value is surface 10.000 mm minus reading in um", "counter", "Prove with reduced feed"),
        "WARNING travel of the axis was not stated",
    ):
        assert words.upper() in head
    assert "WARNING" not in touch_program(name, travel=(0.0, 20.0)).upper()
