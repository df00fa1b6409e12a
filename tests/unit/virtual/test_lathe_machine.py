"""The virtual lathe in time: reproducible, indifferent to steps, seen through coarse sensors."""

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from tests.refusals import refused
from thermaxis.virtual import (
    SCENARIOS,
    SENSORS,
    SIGNALS,
    LatheSettings,
    OffsetRules,
    Scenario,
    Stage,
    VirtualLathe,
)
from thermaxis.virtual.lathe import PROBES
from thermaxis.virtual.lathe._physics import Node
from thermaxis.virtual.lathe._scenarios import scenario_named, seen_at
from thermaxis.virtual.lathe._signals import counted

HOUR = 3600.0


@settings(max_examples=20)
@given(
    cuts=st.lists(st.floats(0.001, 4000.0), min_size=1, max_size=8),
    name=st.sampled_from(sorted(SCENARIOS)),
)
def test_the_machine_does_not_depend_on_how_its_time_is_divided(
    cuts: list[float], name: str
) -> None:
    divided, whole = VirtualLathe(name, 3), VirtualLathe(name, 3)
    for seconds in cuts:
        divided.step(seconds)
    whole.step(sum(cuts))
    assert divided.temperature_c == pytest.approx(whole.temperature_c, abs=1e-8)
    assert divided.true_um == pytest.approx(whole.true_um, abs=1e-6)


def test_the_same_seed_shows_the_same_and_another_another_hall_and_noise() -> None:
    first, again, other = (VirtualLathe("verification", seed) for seed in (5, 5, 6))
    shown = []
    for lathe in (first, again, other):
        rows = []
        for _ in range(200):
            lathe.step(100.0)
            rows.append([r.value for r in lathe.readings().values()])
        shown.append(rows)
    assert shown[0] == shown[1]
    assert shown[0] != shown[2]
    assert first.hall_c != other.hall_c


def test_another_scenario_of_the_same_seed_has_another_day() -> None:
    one, other = VirtualLathe("calibration-spindle", 1), VirtualLathe("calibration-table", 1)
    one.step(3 * HOUR)
    other.step(3 * HOUR)
    assert abs(one.hall_c - other.hall_c) > 0.01


def test_temperatures_come_in_counts_of_a_tenth_with_noise_of_their_own() -> None:
    lathe = VirtualLathe("calibration-spindle", 1)
    errors: dict[str, list[float]] = {name: [] for name in SENSORS}
    for _ in range(3000):
        lathe.step(5.0)
        true, readings = lathe.temperature_c, lathe.readings()
        for name, node in SENSORS.items():
            value = readings[name].value
            assert isinstance(value, float)
            assert value == round(value, 1)
            errors[name].append(value - (lathe.hall_c if node < 0 else true[node]))
    # rounding to 0.1 K (0.029 K) and noise of 0.02 K together
    for name, found in errors.items():
        assert abs(np.mean(found)) < 0.01, name
        assert np.std(found) == pytest.approx(np.hypot(0.1 / np.sqrt(12.0), 0.02), rel=0.15), name
    first, second = np.array(errors["T_spindle_C"]), np.array(errors["T_spindle_2_C"])
    assert not np.array_equal(first, second)


def test_noise_belongs_to_the_second_and_not_to_the_call() -> None:
    lathe = VirtualLathe("calibration-spindle", 1)
    lathe.step(10.0)
    once = lathe.readings()
    assert [r.value for r in lathe.readings().values()] == [r.value for r in once.values()]
    later = []
    for _ in range(3):
        lathe.step(1024.0)
        later.append(lathe.readings()["Z_um"].value - lathe.true_um[0])
    assert np.ptp(later) > 0.15  # rounding alone could make 0.1
    fine = VirtualLathe("calibration-spindle", 1)
    for _ in range(100):
        fine.step(0.1)
        fine.readings()
    assert [fine.readings()[p].value for p in PROBES] == [once[p].value for p in PROBES]


def test_probes_measure_what_is_true_with_noise_of_their_own() -> None:
    lathe = VirtualLathe(
        "calibration-spindle", 1, LatheSettings(offset=OffsetRules(watchdog_s=None))
    )
    lathe.write_offset(0.05)
    errors = []
    for _ in range(2000):
        lathe.step(7.0)
        shown = lathe.readings()
        errors.append([shown[p].value - t for p, t in zip(PROBES, lathe.true_um, strict=True)])
    assert np.abs(np.mean(errors, axis=0)).max() < 0.03
    assert np.std(errors, axis=0) == pytest.approx([0.3] * 4, rel=0.1)


def test_a_turning_table_is_seen_for_seven_seconds_every_ten_minutes() -> None:
    lathe = VirtualLathe("calibration-table", 1)
    lathe.step(900.0)
    seen = []
    for _ in range(3600):
        shown = lathe.readings()
        assert (shown["Z_um"].value is not None) is shown["table_seen"].value
        assert shown["Z_um"].good is shown["table_seen"].value
        assert (shown["n_table_rpm"].value == 0.0) is shown["table_seen"].value
        seen.append(shown["table_seen"].value)
        lathe.step(1.0)
    assert sum(seen) == 6 * 7
    assert seen[300:307] == [True] * 7
    assert not seen[307]
    assert seen_at(1200.0) == (True, 1207.0)
    assert seen_at(1207.0) == (False, 1800.0)


def test_the_verification_changes_gear_with_the_spindle_at_rest() -> None:
    lathe = VirtualLathe("verification", 1)
    gears, speeds = [], []
    for _ in range(int(4.5 * 60)):
        lathe.step(60.0)
        gears.append(lathe.readings()["gear"].value)
        speeds.append(lathe.spindle_rpm)
    change = next(k for k in range(len(gears)) if gears[k] == 2.0)
    assert gears[change - 1] == 1.0
    assert speeds[change - 1] == 900.0
    assert speeds[change] == 0.0
    assert 3000.0 in speeds[change:]


def test_spindle_and_table_never_turn_together_in_the_verification() -> None:
    lathe = VirtualLathe("verification", 1)
    turned = set()
    for _ in range(16 * 60):
        lathe.step(60.0)
        turned.add((lathe.spindle_rpm > 0.0, lathe._stage.table_rpm > 0.0))
    assert turned == {(False, False), (True, False), (False, True)}


def test_the_coolant_is_kept_between_its_two_temperatures() -> None:
    lathe = VirtualLathe("calibration-table", 1)
    lathe.step(2 * HOUR)
    values, running = [], set()
    for _ in range(360):
        lathe.step(60.0)
        values.append(lathe.temperature_c[Node.COOLANT])
        running.add(lathe._cooler)
    assert running == {False, True}
    assert 19.9 < min(values) < max(values) < 21.1


def test_a_day_begins_with_homing_and_comes_again() -> None:
    lathe = VirtualLathe("day", 1)
    assert [lathe.flag(f) for f in ("machine_on", "referenced", "homing")] == [False, False, False]
    lathe.step(150.0)
    assert [lathe.flag(f) for f in ("machine_on", "referenced", "homing")] == [True, False, True]
    lathe.step(200.0)
    assert [lathe.flag(f) for f in ("machine_on", "referenced", "homing")] == [True, True, False]
    assert lathe.diameter_mm == 1500.0
    lathe.step(86_400.0 - 350.0 - 600.0)
    assert [lathe.flag(f) for f in ("machine_on", "coolant_on")] == [False, False]
    lathe.step(600.0 + 350.0)
    assert [lathe.flag(f) for f in ("machine_on", "referenced", "homing")] == [True, True, False]


def test_a_flag_that_is_set_within_a_minute_leaves_the_hall_as_it_is() -> None:
    lathe = VirtualLathe("day", 1)
    lathe.step(3.0 * HOUR + 37.0)
    before = lathe.hall_c
    lathe.set_flag("own_compensation", value=True)
    assert lathe.hall_c == before
    lathe.step(30.0)
    assert 0.0 < abs(lathe.hall_c - before) < 0.05


def test_a_written_diameter_stays_until_the_scenario_changes_it() -> None:
    lathe = VirtualLathe("day", 1)
    lathe.step(HOUR)
    assert lathe.write_diameter(2000.0)
    assert not lathe.write_diameter(-1.0)
    assert not lathe.write_diameter(float("nan"))
    lathe.step(HOUR)
    assert lathe.readings()["diameter_mm"].value == 2000.0
    lathe.step(2.5 * HOUR)
    assert lathe.diameter_mm == 3000.0


def test_a_scenario_stays_in_its_last_stage_or_begins_anew() -> None:
    short = Scenario("short", "x", (Stage(10.0, spindle_rpm=500.0), Stage(10.0)))
    assert short.stage_at(5.0) == (0, short.stages[0], 10.0)
    assert short.stage_at(1e6)[1:] == (short.stages[1], float("inf"))
    lathe = VirtualLathe(short, 1)
    lathe.step(9.0)
    assert lathe.spindle_rpm == 500.0
    lathe.step(1.0)
    assert lathe.spindle_rpm == 0.0
    lathe.step(1e5)
    assert lathe.spindle_rpm == 0.0
    day = scenario_named("day")  # counts its rounds
    assert day.stage_at(86_400.0 * 3 + 60.0) == (
        3 * len(day.stages),
        day.stages[0],
        86_400.0 * 3 + 120.0,
    )


def test_every_signal_is_shown_in_its_order_and_with_its_type() -> None:
    lathe = VirtualLathe()
    shown = lathe.readings()
    assert list(shown) == list(SIGNALS)
    for name, reading in shown.items():
        assert isinstance(reading.value, bool) is (SIGNALS[name].unit == "bool")
        assert reading.good
        assert reading.stamp_s == 0.0


def test_a_count_has_no_dirt_and_no_negative_zero() -> None:
    assert counted(20.7499, 0.1) == 20.7
    assert str(counted(-0.04, 0.1)) == "0.0"
    assert counted(-3.26, 0.1) == -3.3


@pytest.mark.proof
def test_weeks_keep_their_memory_and_stay_sane() -> None:
    lathe = VirtualLathe("day", 1)
    for _ in range(12 * 24):
        lathe.step(HOUR)
    assert len(lathe._networks) < 100
    assert np.all((lathe.temperature_c > 15.0) & (lathe.temperature_c < 45.0))


def test_a_step_that_is_none_is_refused() -> None:
    for wrong in (-1.0, float("nan"), float("inf")):
        with refused("outside_range"):
            VirtualLathe().step(wrong)


def test_what_is_no_scenario_and_no_seed_is_refused() -> None:
    with refused("unknown_choice"):
        VirtualLathe("turret")
    with refused("negative"):
        VirtualLathe("day", -1)
    with refused("scenario_without_stage"):
        Scenario("none", "x", ())
    with refused("scenario_without_stage"):
        Scenario("none", "x", (Stage(0.0),))
