"""The own probe of the virtual lathe: value and counter of a touch program, and what fails."""

import math

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from tests.proofs import quick_first
from thermaxis.virtual import (
    FAULTY,
    LatheReading,
    LatheSettings,
    OffsetRules,
    VirtualLathe,
    log_lathe,
    parse_fault,
)

HOUR = 3600.0
EXACT = LatheSettings(touch_every_s=HOUR, touch_noise_um=0.0, offset=OffsetRules(watchdog_s=None))


def lathe_with(*sentences: str, every_s: float | None = HOUR, noise_um: float = 0.0):
    own = LatheSettings(touch_every_s=every_s, touch_noise_um=noise_um)
    return VirtualLathe("day", 1, own, [parse_fault(text, FAULTY) for text in sentences])


def touches_of(lathe: VirtualLathe, hours: float) -> list[tuple[LatheReading, float, float]]:
    """Return each touch as it was read a minute later at most, its counter, and the truth."""
    found, count = [], 0.0
    begin_s = lathe.time_s
    for minute in range(int(60.0 * hours)):
        lathe.step_to(begin_s + 60.0 * minute)
        shown = lathe.readings()
        if shown["touch_count"].value != count:
            count = shown["touch_count"].value
            found.append((shown["touch_um"], count, float(lathe.true_um[0])))
    return found


def test_it_touches_each_hour_as_soon_as_the_axis_may_move_and_the_table_stands() -> None:
    lathe = VirtualLathe("day", 1, EXACT)
    found = touches_of(lathe, 48.0)
    hours = [0.0833, *range(1, 16), 24.0833, *range(25, 40)]  # after homing; never at night
    assert [one.stamp_s / HOUR for one, _, _ in found] == pytest.approx(hours, abs=1e-3)
    assert [count for _, count, _ in found] == list(range(1, len(found) + 1))
    for one, _, true_um in found:
        assert one.good
        assert one.value == pytest.approx(true_um, abs=0.06)


def test_a_touch_shows_what_the_offset_that_acts_leaves() -> None:
    lathe = VirtualLathe("day", 1, EXACT)
    lathe.write_offset(0.03)
    lathe.step(1.5 * HOUR)
    shown = lathe.readings()
    assert shown["touch_count"].value == 2.0
    assert shown["touch_count"].stamp_s == shown["touch_um"].stamp_s == HOUR
    unmoved = VirtualLathe("day", 1, EXACT)
    unmoved.step(1.5 * HOUR)
    assert shown["touch_um"].value == pytest.approx(
        unmoved.readings()["touch_um"].value + 30.0, abs=0.15
    )


@settings(max_examples=10)
@given(cuts=st.lists(st.floats(1.0, 9000.0), min_size=1, max_size=8))
def test_touches_do_not_depend_on_how_time_is_divided(cuts: list[float]) -> None:
    divided, whole = (lathe_with(every_s=900.0, noise_um=1.0) for _ in range(2))
    for seconds in cuts:
        divided.step(seconds)
        divided.readings()
    whole.step(sum(cuts))
    for name in ("touch_um", "touch_count"):
        assert divided.readings()[name] == whole.readings()[name]


def test_touches_change_nothing_else() -> None:
    with_them, without = lathe_with(every_s=600.0, noise_um=1.0), lathe_with(every_s=None)
    for lathe in (with_them, without):
        lathe.step(5.3 * HOUR)
    of_touches = {"touch_um", "touch_count"}
    shown, usual = with_them.readings(), without.readings()
    assert {name for name in shown if shown[name] != usual[name]} == of_touches
    assert usual["touch_count"].value == 0.0


def test_its_noise_is_what_is_stated() -> None:
    lathe = lathe_with(every_s=30.0, noise_um=1.0)
    left = [one.value - true_um for one, _, true_um in touches_of(lathe, 16.0)]
    assert np.std(left) == pytest.approx(1.0, rel=0.15)
    assert abs(np.mean(left)) < 0.2


def test_it_touches_soon_when_it_is_asked() -> None:
    lathe = lathe_with(every_s=None)
    lathe.ask_touch()
    assert lathe.readings()["touch_asked"].value is True  # off at first, then it looks for home
    lathe.step(HOUR)
    shown = lathe.readings()
    assert (shown["touch_count"].value, shown["touch_asked"].value) == (1.0, False)
    assert shown["touch_um"].stamp_s == pytest.approx(300.0, abs=1e-6)
    lathe.step_to(1.02 * HOUR)
    lathe.ask_touch()  # the table turns: it is stopped at the next full ten minutes
    lathe.step(600.0)
    assert lathe.readings()["touch_um"].stamp_s == pytest.approx(4200.0, abs=1e-6)
    lathe.ask_touch()
    lathe.set_flag("emergency_stop", value=True)
    lathe.step(HOUR)
    assert lathe.readings()["touch_asked"].value is True


@pytest.mark.parametrize(
    ("sentence", "shown"),
    quick_first(
        2,
        [
            ("jump touch_um by 50 at 150min for 1h", lambda um, k: um + 50.0 * (k == 3)),
            ("jump touch_um by 50 at 150min", lambda um, k: um + 50.0 * (k >= 3)),
            ("scale touch_um by -1 at 150min", lambda um, k: -um if k >= 3 else um),
            ("scale touch_um by 1000 at 150min", lambda um, k: 1000.0 * um if k >= 3 else um),
            ("drift touch_um by 6 at 150min", lambda um, k: um + max(0.0, 6.0 * (k - 2.5))),
        ],
    ),
)
def test_a_fault_acts_on_the_touches_of_its_time(sentence, shown) -> None:
    rows = zip(touches_of(lathe_with(sentence), 8.0), touches_of(lathe_with(), 8.0), strict=True)
    for k, ((one, *_), (well, *_)) in enumerate(rows):
        assert one.value == pytest.approx(shown(well.value, k), abs=1e-6)
        assert one.good


def test_a_chip_stays_in_the_control_until_the_next_touch() -> None:
    lathe, well = lathe_with("jump touch_um by 50 at 3h for 1min"), lathe_with()
    for each in (lathe, well):
        each.step(3.5 * HOUR)
    assert lathe.readings()["touch_um"].value == well.readings()["touch_um"].value + 50.0


def test_a_probe_that_repeats_itself_counts_on() -> None:
    found = touches_of(lathe_with("stuck touch_um at 150min"), 6.0)
    values = [one.value for one, _, _ in found]
    assert values[3:] == [values[2]] * 3
    assert [one.stamp_s for one, _, _ in found][3:] == [3 * HOUR, 4 * HOUR, 5 * HOUR]


def test_a_touch_may_be_counted_twice_or_be_no_number() -> None:
    found = touches_of(lathe_with("jump touch_count by 1 at 90min"), 3.0)
    assert [count for _, count, _ in found] == [1.0, 2.0, 3.0, 4.0]
    assert found[2][0] == found[1][0]
    value = touches_of(lathe_with("nan touch_um at 150min"), 4.0)[3][0].value
    assert isinstance(value, float)
    assert math.isnan(value)


def test_the_log_of_production_has_touches_alone() -> None:
    lathe = lathe_with("missing touch_um at 150min for 1h")
    log = log_lathe(lathe, 8.0, every_s=60.0, truth=True)
    assert [name for name in log.columns if name.startswith("Z_")][:2] == [
        "Z_um",
        "Z_uncorrected_um",
    ]
    rows = np.flatnonzero(~np.isnan(log.columns["Z_um"]))
    assert rows.tolist() == [5, 60, 120, 240, 300, 360, 420]
    assert log.columns["Z_um"][rows] == pytest.approx(
        log.columns["Z_uncorrected_um"][rows], abs=0.06
    )
