"""Faults of the virtual lathe: their sentences, and what each one shows."""

import math

import pytest
from hypothesis import given, strategies as st

from tests.refusals import refused
from thermaxis.errors import ConfigurationError
from thermaxis.virtual import FAULTY, Fault, FaultKind, VirtualLathe, parse_fault
from thermaxis.virtual.lathe import parse_seconds

HOUR = 3600.0


def fault(text: str) -> Fault:
    return parse_fault(text, FAULTY)


def lathe_with(*sentences: str, scenario: str = "calibration-spindle") -> VirtualLathe:
    return VirtualLathe(scenario, 1, faults=[fault(s) for s in sentences])


# ---- sentences ----------------------------------------------------------------------------------


def test_a_sentence_is_read_as_what_it_says() -> None:
    for text, expected in (
        (
            "stuck T_spindle at 2h for 10min",
            Fault(FaultKind.STUCK, ("T_spindle_C",), at_s=7200.0, for_s=600.0),
        ),
        ("NaN t_table_c", Fault(FaultKind.NAN, ("T_table_C",))),
        (
            "jump T_table_C by -5 K at 90min for 60 every 3h",
            Fault(FaultKind.JUMP, ("T_table_C",), 5400.0, 60.0, 10_800.0, -5.0),
        ),
        (
            "swap T_spindle T_table at .5h",
            Fault(FaultKind.SWAP, ("T_spindle_C", "T_table_C"), at_s=1800.0),
        ),
        (
            "set emergency_stop to 1 at 1d for 500ms",
            Fault(FaultKind.SET, ("emergency_stop",), 86_400.0, 0.5, None, 1.0),
        ),
        ("restart at 10min for 3s every 5min", Fault(FaultKind.RESTART, (), 600.0, 3.0, 300.0)),
        ("pause for 5s", Fault(FaultKind.PAUSE, (), 0.0, 5.0)),
        ("bad Z_um", Fault(FaultKind.BAD, ("Z_um",))),
    ):
        assert fault(text) == expected


def test_what_is_no_sentence_is_refused_with_its_reason() -> None:
    for text, code in (
        ("", "unknown_choice"),
        ("broken T_spindle", "unknown_choice"),
        ("stuck", "fault_channel_count"),
        ("stuck T_turret at 1h", "unknown_name"),
        ("stuck T_spindle T_table", "fault_channel_count"),
        ("swap T_spindle", "fault_channel_count"),
        ("swap T_spindle T_spindle_C", "fault_channel_count"),
        ("stuck T_spindle at noon", "not_a_duration"),
        ("stuck T_spindle at -5s", "not_a_duration"),
        ("stuck T_spindle at", "fault_word_without_value"),
        ("stuck T_spindle at 1h at 2h", "fault_word_unexpected"),
        ("stuck T_spindle by 5", "fault_word_unexpected"),
        ("jump T_spindle at 1h", "fault_without_amount"),
        ("jump T_spindle by warm", "not_a_number"),
        ("jump T_spindle by nan", "not_a_number"),
        ("set emergency_stop by 1", "fault_word_unexpected"),
        ("restart at 5s", "fault_without_end"),
        ("restart T_spindle for 5s", "fault_channel_count"),
        ("nan T_spindle for 10min every 5min", "fault_repeats_too_soon"),
        ("nan T_spindle every 5min", "fault_repeats_too_soon"),
        ("nan T_spindle for 0s", "not_positive"),
        ("nan Z_true_um", "unknown_name"),
        ("nan T_spindle at 9" + "9" * 12, "not_a_duration"),
    ):
        with refused(code):
            fault(text)


def test_a_fault_that_the_machine_cannot_have_is_refused() -> None:
    with refused("unknown_name"):
        VirtualLathe(faults=[Fault(FaultKind.SET, ("T_spindle_C",), amount=3.0)])
    with refused("fault_of_flag"):
        VirtualLathe(faults=[Fault(FaultKind.NAN, ("homing",))])
    with refused("unknown_name"):
        VirtualLathe(faults=[Fault(FaultKind.NAN, ("Z_true_um",))])


WORDS = [*FaultKind, "T_spindle", "T_table_C", "homing", "at", "for", "every", "by", "to"]


@given(words=st.lists(st.sampled_from([*WORDS, "2h", "90", "5min", "1", "K", "-3"]), max_size=9))
def test_any_words_are_a_fault_or_an_error_in_words(words: list[str]) -> None:
    try:
        found = fault(" ".join(words))
    except ConfigurationError:
        return
    assert found.kind == words[0]
    assert found.for_s > 0.0


def test_times_are_read_with_their_units() -> None:
    seconds = {"90": 90.0, "1.5h": 5400.0, "250ms": 0.25, "2d": 172_800.0, "": None, "h": None}
    assert {text: parse_seconds(text) for text in seconds} == seconds


@given(
    at=st.floats(0.0, 100.0),
    length=st.floats(0.1, 10.0),
    pause=st.floats(0.1, 10.0),
    time=st.floats(0.0, 500.0),
)
def test_a_fault_acts_until_its_next_change_and_not_after(
    at: float, length: float, pause: float, time: float
) -> None:
    repeated = Fault(FaultKind.NAN, ("T_spindle_C",), at, length, length + pause)
    change = repeated.next_change_s(time)
    assert change > time - 1e-9
    acts = repeated.begin_s(time) is not None
    middle = (time + change) / 2.0
    assert (repeated.begin_s(middle) is not None) is acts or change - time < 1e-6
    once = Fault(FaultKind.NAN, ("T_spindle_C",), at, length)
    assert (once.begin_s(time) is not None) is (at <= time and time - at < length)


# ---- what they show -----------------------------------------------------------------------------


def test_a_stuck_sensor_stays_with_fresh_stamps_and_comes_back() -> None:
    lathe, well = lathe_with("stuck T_spindle at 1h for 30min"), lathe_with()
    for each in (lathe, well):
        each.step(HOUR)
    held = well.readings()["T_spindle_C"].value
    for minutes in (0.0, 1.0, 20.0):
        lathe.step_to(HOUR + 60.0 * minutes)
        shown = lathe.readings()["T_spindle_C"]
        assert (shown.value, shown.status, shown.stamp_s) == (held, "Good", lathe.time_s)
    lathe.step_to(1.5 * HOUR)
    well.step_to(1.5 * HOUR)
    assert lathe.readings() == well.readings()
    assert lathe.readings()["T_spindle_C"].value > held + 1.0


def test_what_is_held_does_not_depend_on_the_steps() -> None:
    coarse, fine = (lathe_with("stuck T_spindle at 1h for 1h") for _ in range(2))
    coarse.step(1.7 * HOUR)
    for _ in range(int(1.7 * 60)):
        fine.step(60.0)
    assert fine.readings()["T_spindle_C"].value == coarse.readings()["T_spindle_C"].value


def test_a_stale_value_keeps_its_old_stamp() -> None:
    lathe = lathe_with("stale T_table at 1h for 10min every 1h")
    lathe.step(HOUR + 300.0)
    assert lathe.readings()["T_table_C"].stamp_s == HOUR
    assert lathe.readings()["T_table_C"].good
    lathe.step(HOUR)
    assert lathe.readings()["T_table_C"].stamp_s == 2.0 * HOUR
    lathe.step(600.0)
    assert lathe.readings()["T_table_C"].stamp_s == lathe.time_s


def test_jump_nan_bad_uncertain_and_missing_show_what_their_names_say() -> None:
    well = lathe_with()
    lathe = lathe_with(
        "jump T_spindle by 5",
        "nan T_table",
        "bad T_column",
        "uncertain T_hall",
        "missing T_bed",
    )
    for each in (well, lathe):
        each.step(1000.0)
    good, shown = well.readings(), lathe.readings()
    assert shown["T_spindle_C"].value == pytest.approx(good["T_spindle_C"].value + 5.0)
    assert math.isnan(shown["T_table_C"].value)
    assert shown["T_table_C"].good
    assert shown["T_column_C"][:2] == (0.0, "BadSensorFailure")
    assert shown["T_hall_C"] == good["T_hall_C"]._replace(status="UncertainSensorNotAccurate")
    assert shown["T_bed_C"][:2] == (None, "BadNoCommunication")
    untouched = [n for n in shown if shown[n] == good[n]]
    assert len(untouched) == len(shown) - 5


def test_swapped_sensors_show_each_others_values() -> None:
    well, lathe = lathe_with(), lathe_with("swap T_spindle T_table at 1h for 1h")
    for each in (well, lathe):
        each.step(1.5 * HOUR)
    good, shown = well.readings(), lathe.readings()
    assert shown["T_spindle_C"] == good["T_table_C"]
    assert shown["T_table_C"] == good["T_spindle_C"]
    assert good["T_spindle_C"].value > good["T_table_C"].value + 3.0


def test_a_fault_of_a_sensor_leaves_the_machine_as_it_is() -> None:
    well, lathe = lathe_with(), lathe_with("jump T_spindle by 30", "swap T_column T_table")
    for each in (well, lathe):
        each.step(5.0 * HOUR)
    assert lathe.temperature_c == pytest.approx(well.temperature_c, abs=1e-9)


def test_the_network_is_away_while_it_restarts_or_pauses() -> None:
    lathe = lathe_with("restart at 100s for 3s every 60s", "pause at 110s for 20s")
    seen = {}
    for second in range(90, 180):
        lathe.step_to(float(second))
        seen[second] = lathe.network_fault
    assert [s for s, f in seen.items() if f is FaultKind.RESTART] == [100, 101, 102, 160, 161, 162]
    assert [s for s, f in seen.items() if f is FaultKind.PAUSE] == list(range(110, 130))
    lathe.step_to(115.0 + 120.0)
    assert lathe.reachable
    both = lathe_with("pause at 0s for 100s", "restart at 10s for 5s")
    both.step(12.0)
    assert both.network_fault is FaultKind.RESTART


def test_setting_the_coolant_off_changes_the_heat_and_not_only_the_flag() -> None:
    on = lathe_with(scenario="calibration-table")
    off = lathe_with("set coolant_on to 0 at 1h for 2h", scenario="calibration-table")
    off.step(2.0 * HOUR)
    assert off.readings()["coolant_on"].value is False
    for each in (on, off):
        each.step_to(3.0 * HOUR)
    warmer = off.readings()["T_table_C"].value - on.readings()["T_table_C"].value
    assert warmer > 0.4
    assert off.readings()["coolant_on"].value is True


def test_faults_come_and_go_while_the_machine_lives() -> None:
    lathe = lathe_with()
    lathe.step(HOUR)
    lathe.set_faults([fault("stuck T_spindle"), fault("set emergency_stop to 1")])
    held = lathe.readings()["T_spindle_C"].value
    assert lathe.flag("emergency_stop")
    lathe.step(HOUR)
    assert lathe.readings()["T_spindle_C"].value == held
    assert lathe.spindle_rpm == 0.0
    lathe.set_faults([])
    assert not lathe.flag("emergency_stop")
    lathe.step(HOUR)
    lathe.set_faults([fault("stuck T_spindle")])  # what it held before is no more
    assert lathe.readings()["T_spindle_C"].value not in {held, None}
    lathe.set_faults([fault("pause for 1h")])
    assert lathe.network_fault is None  # its hour is over
    with refused("unknown_name"):
        lathe.set_faults([Fault(FaultKind.NAN, ("Z_true_um",))])
