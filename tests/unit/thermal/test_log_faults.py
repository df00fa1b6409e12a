"""Faults that a log shows by itself are acted upon, said with their rows, and nothing else is."""

from functools import cache

import numpy as np
import pytest
from scipy.signal import lfilter

from benchmarks.virtual_thermal_test import Heating, ThermalTestPlan, generate_thermal_test
from tests.proofs import quick_first
from tests.thermal_machines import log as machine_log
from thermaxis.errors import DataError
from thermaxis.thermal import (
    InputDefinition,
    ModalOptions,
    ThermalLog,
    identify,
    mask_rows,
    parse_input,
    records_of,
    with_one_clock,
    without_faults,
)

pytestmark = pytest.mark.usefixtures("one_clock_and_regime")

PLANS = (
    ThermalTestPlan(sample_time_s=10.0),
    ThermalTestPlan(sample_time_s=60.0, hours=24.0),
    ThermalTestPlan(sample_time_s=10.0, heating=Heating.RODS, missing_share=0.05),
    ThermalTestPlan(sample_time_s=10.0, warm_up_h=3.0, resolution_k=0.0),
)


@cache
def made(plan: int, seed: int) -> ThermalLog:
    return ThermalLog.from_columns(generate_thermal_test(PLANS[plan], seed).columns())


def changed(name: str, rows: slice, values: object, seed: int = 0) -> ThermalLog:
    log = made(0, seed)
    columns = {n: np.array(v) for n, v in log.columns.items()}
    columns[name][rows] = values
    return ThermalLog.from_columns(columns, time_s=log.time_s)


def codes(log: ThermalLog) -> list[tuple[str, str]]:
    return [(one.code, one.place.channel) for one in log.remarks]


@pytest.mark.parametrize("plan", range(len(PLANS)))
def test_a_healthy_log_stays_as_it_is(plan: int) -> None:
    for seed in range(2):
        log = made(plan, seed)
        assert without_faults(log) is log


@pytest.mark.parametrize("seed", range(3))
def test_a_sensor_that_is_stuck_from_mid_test_is_masked_but_for_its_last_reading(seed: int) -> None:
    held = made(0, seed).columns["T_spindle_c"][1440]
    log = without_faults(changed("T_spindle_c", slice(1440, None), held, seed))
    assert codes(log) == [("remark-rows_stuck", "T_spindle_c")]
    missing = np.flatnonzero(np.isnan(log.columns["T_spindle_c"]))
    assert missing[-1] == log.rows - 1
    assert missing[0] == log.remarks[0].values["row"]
    assert 1380 < missing[0] <= 1441  # equal readings before cannot be told from it
    assert missing.size == log.remarks[0].values["rows"]


@pytest.mark.parametrize("first", [0, 60, 1440])
def test_850_degrees_are_masked_however_often_they_come(first: int) -> None:
    log = without_faults(changed("T_spindle_c", slice(first, None), 850.0))
    assert codes(log) == [("remark-values_no_measurement", "T_spindle_c")]
    assert np.isnan(log.columns["T_spindle_c"][first:]).all()
    own = made(0, 0).columns["T_spindle_c"][:first]
    assert (log.columns["T_spindle_c"][:first] == own).all()


def test_values_that_differ_and_are_all_impossible_are_of_another_unit_and_stay() -> None:
    kelvins = made(0, 0).columns["T_spindle_c"] + 273.15
    log = changed("T_spindle_c", slice(None), kelvins)
    assert without_faults(log) is log


@pytest.mark.parametrize("size_um", [37.0, 5.0, -5.0])
@pytest.mark.parametrize("row", [700, 1440, 2200])
def test_a_probe_that_was_set_to_zero_is_carried_on(size_um: float, row: int) -> None:
    z = made(0, 1).columns["Z_um"]
    log = without_faults(changed("Z_um", slice(row, None), z[row:] + size_um, seed=1))
    assert codes(log) == [("remark-displacement_joined", "Z_um")]
    said = log.remarks[0].values
    assert said["row"] == row
    assert said["size"] == pytest.approx(size_um, abs=1.5 * float(said["within"]))
    left = log.columns["Z_um"] - z
    assert (left[:row] == 0.0).all()
    assert np.abs(left[row:]).max() < 1.0


@pytest.mark.parametrize("every", [240, 360])
def test_a_probe_set_to_zero_time_and_again_is_carried_on_each_time(every: int) -> None:
    z = np.array(made(0, 3).columns["Z_um"])
    rows = range(every, z.size - 20, every)
    for row in rows:
        z[row:] -= z[row]
    log = without_faults(changed("Z_um", slice(None), z, seed=3))
    assert {one.code for one in log.remarks} == {"remark-displacement_joined"}
    joined = {one.values["row"] for one in log.remarks}
    assert joined <= set(rows)
    assert len(joined) >= len(rows) - 2  # less than the noise, or beside a switch
    assert np.ptp(log.columns["Z_um"] - made(0, 3).columns["Z_um"]) < 5.0


def test_leaps_that_cancel_are_no_new_zero_and_are_told() -> None:
    columns = {n: np.array(v) for n, v in made(0, 2).columns.items() if "rpm" not in n}
    columns["Z_um"] += 6.0 * (made(0, 2).columns["spindle_rpm"] > 0.0)
    log = without_faults(ThermalLog.from_columns(columns, time_s=made(0, 2).time_s))
    (said,) = log.remarks
    assert (said.code, said.values["why"]) == ("remark-displacement_leaps", "back")
    assert said.values["size"] == pytest.approx(6.0, abs=1.0)
    assert (log.columns["Z_um"] == columns["Z_um"]).all()


@pytest.mark.parametrize("step_um", [5.0, 10.0])
@pytest.mark.parametrize("grown_um", [10.0, 60.0, -60.0])
def test_steps_of_a_display_are_no_leaps(step_um: float, grown_um: float) -> None:
    grown = np.linspace(0.0, grown_um, 720)
    columns = {"Z_um": np.round(grown / step_um) * step_um, "T_c": 20.0 + np.sin(grown)}
    log = ThermalLog.from_columns(columns, time_s=60.0 * np.arange(720))
    assert without_faults(log) is log


def test_leaps_of_few_sizes_are_told_and_left() -> None:
    rng = np.random.default_rng(0)
    z = 0.05 * rng.normal(size=1440)
    for number, row in enumerate(range(60, 1440, 60)):
        z[row:] += -9.0 if number % 3 == 2 else 6.0
    columns = {"Z_um": z, "T_c": 20.0 + np.sin(np.arange(1440) / 200.0)}
    log = without_faults(ThermalLog.from_columns(columns, time_s=60.0 * np.arange(1440)))
    (said,) = log.remarks
    assert (said.code, said.values["why"]) == ("remark-displacement_leaps", "alike")
    assert (log.columns["Z_um"] == z).all()


def test_a_channel_that_switches_all_the_time_forbids_no_joining() -> None:
    z = made(0, 1).columns["Z_um"]
    columns = dict(changed("Z_um", slice(900, None), z[900:] + 37.0, seed=1).columns)
    columns["heater_percent"] = np.where(np.arange(z.size) % 7 < 3, 100.0, 0.0)
    log = without_faults(ThermalLog.from_columns(columns, time_s=made(0, 1).time_s))
    assert [one.values["row"] for one in log.remarks] == [900]


def test_a_mean_over_both_zeros_is_masked() -> None:
    z = np.array(made(0, 1).columns["Z_um"])
    z[1000:] += 37.0
    z[1000] -= 18.0
    log = without_faults(changed("Z_um", slice(None), z, seed=1))
    assert [one.values["row"] for one in log.remarks] == [1001]
    left = log.columns["Z_um"] - made(0, 1).columns["Z_um"]
    assert np.flatnonzero(np.isnan(left)).tolist() == [1000]
    assert np.nanmax(np.abs(left)) < 1.0


def test_a_leap_that_comes_with_a_switch_or_comes_back_is_no_new_zero() -> None:
    log = made(0, 2)
    columns = {n: np.array(v) for n, v in log.columns.items()}
    switches = np.flatnonzero(np.abs(np.diff(columns["spindle_rpm"])) > 1000.0)
    row = int(switches[switches > 500][0]) + 1
    columns["Z_um"][row:] += 8.0
    columns["Z_um"][2000] += 60.0
    assert without_faults(ThermalLog.from_columns(columns, time_s=log.time_s)).remarks == ()


def on_and_off(unit: str, leap_um: float, step_s: float = 300.0) -> ThermalLog:
    """Return 48 h of coarse rows whose temperature leaps with the heat, and a leap hours later."""
    random = np.random.default_rng(5)
    time_s = np.arange(0.0, 48 * 3600.0, step_s)
    since, after = (np.maximum(time_s - edge_s, 0.0) for edge_s in (3600.0, 24 * 3600.0))
    tau_s = np.array([120.0, 3000.0, 150.0, 4000.0])[:, None]
    rise = np.exp(-after / tau_s) - np.exp(-since / tau_s)
    t = 20.0 + np.array([10.0, 6.0]) @ rise[:2] + random.normal(0.0, 0.05, time_s.size)
    z = np.array([12.0, 24.0]) @ rise[2:] + random.normal(0.0, 0.2, time_s.size)
    z[time_s > 36 * 3600.0] += leap_um
    columns = {
        "T": t,
        f"Z_{unit}": z * {"um": 1.0, "mm": 1e-3}[unit],
        "X_um": np.full(t.size, np.nan),
    }
    return ThermalLog.from_columns(columns, time_s=time_s, units={"T": "degC"})


@pytest.mark.parametrize("unit", ["um", "mm"])
def test_a_leap_with_the_temperature_is_heat_and_one_without_is_a_new_zero(unit: str) -> None:
    assert without_faults(on_and_off(unit, 0.0)).remarks == ()
    (said,) = without_faults(on_and_off(unit, 37.0)).remarks
    assert (said.code, said.values["unit"]) == ("remark-displacement_joined", unit)
    assert said.values["row"] == 433


def test_as_logged_masks_what_is_no_measurement_only() -> None:
    z = made(0, 1).columns["Z_um"]
    log = changed("Z_um", slice(900, None), z[900:] + 37.0, seed=1)
    assert without_faults(log, as_logged=True) is log


def test_rows_are_masked_by_hand_of_one_channel_or_of_all() -> None:
    log = mask_rows(made(0, 0), 10, 20, "t_table_C")
    assert np.isnan(log.columns["T_table_c"][10:20]).all()
    assert np.isfinite(log.columns["Z_um"]).all()
    assert codes(log) == [("remark-rows_masked", "T_table_c")]
    everything = mask_rows(log, 2870, 9999)
    assert all(np.isnan(values[2870:]).all() for values in everything.columns.values())
    assert everything.remarks[1].values == {"rows": 10, "row": 2870, "last": 2879}
    with pytest.raises(DataError):
        mask_rows(log, 20, 20)


INPUTS = tuple(map(parse_input, ("spindle=T_spindle_c-T_column_c", "table=T_table_c-T_column_c")))


def stamped(shift_s: float, seed: int = 3) -> ThermalLog:
    """Return a log whose displacements are stamped so much too late."""
    columns = {n: np.array(v) for n, v in made(0, seed).columns.items()}
    rows = round(abs(shift_s) / 10.0)
    for name, values in columns.items():
        first = (name == "Z_um") == (shift_s > 0)
        columns[name] = values[:-rows] if first else values[rows:]
    return ThermalLog.from_columns(columns, sample_time_s=10.0)


@pytest.mark.parametrize("shift_s", [900.0, -900.0])
def test_displacements_by_another_clock_are_shifted_by_what_it_is_off(shift_s: float) -> None:
    log = stamped(shift_s)
    found = with_one_clock(log, INPUTS, ["Z_um"])
    (said,) = found.remarks
    word = "late" if shift_s > 0 else "early"
    assert said.code == f"remark-displacements_{word}"
    assert said.values["shift_s"] == pytest.approx(abs(shift_s), abs=45.0)
    assert (found.columns["T_table_c"] == log.columns["T_table_c"]).all()
    rows = round(said.values["shift_s"] / 10.0)
    z = found.columns["Z_um"]
    moved = (z[:-rows], log.columns["Z_um"][rows:]) if shift_s > 0 else (
        z[rows:], log.columns["Z_um"][:-rows])  # fmt: skip
    assert (moved[0] == moved[1]).all()
    assert np.isnan(z).sum() == rows


@pytest.mark.proof
@pytest.mark.parametrize("gap", [slice(20, 60), slice(1400, 1430)])
def test_an_input_with_a_gap_near_an_end_of_the_log_is_identified(gap: slice) -> None:
    rng = np.random.default_rng(1)
    heated = np.repeat(rng.random(24) * 10.0, 60)
    warm = lfilter([0.02], [1.0, -0.98], heated)
    z_um = 3.0 * warm + lfilter([0.3], [1.0, -0.98], warm) + rng.normal(0.0, 0.2, 1440)
    warm[gap] = np.nan
    inputs = [InputDefinition("spindle", "T_C")]
    late = np.append(np.full(20, np.nan), z_um[:-20])  # 20 minutes
    log = ThermalLog.from_columns({"T_C": 20.0 + warm, "Z_um": late}, sample_time_s=60.0)
    (said,) = (shifted := with_one_clock(log, inputs, ["Z_um"])).remarks
    assert said.values["shift_s"] == 1200.0
    options = ModalOptions(intervals=False, most_lags=1)
    found = identify(records_of([shifted], inputs, ["Z_um"]), modal_options=options)
    # The free run begins anew behind the gap, as the machine's does, so its fit says little.
    assert found.outputs[0].model.parts[0].dc_gain == pytest.approx(18.0, rel=0.01)


@pytest.mark.parametrize("plan", quick_first(1, range(len(PLANS))))
def test_displacements_by_the_same_clock_stay(plan: int) -> None:
    log = made(plan, 1)
    assert with_one_clock(log, INPUTS, ["Z_um"]).columns["Z_um"] is log.columns["Z_um"]


@pytest.mark.parametrize("shift_s", [90.0, -90.0, -200.0])
def test_a_smaller_shift_may_be_the_machine_and_is_told_and_left(shift_s: float) -> None:
    log = stamped(shift_s, seed=2)
    (said,) = (told := with_one_clock(log, INPUTS, ["Z_um"])).remarks
    assert said.code.endswith("seem_late" if shift_s > 0 else "seem_early")
    assert said.values["shift_s"] == pytest.approx(abs(shift_s), abs=45.0)
    assert told.columns["Z_um"] is log.columns["Z_um"]


def test_displays_of_one_kelvin_are_late_by_themselves_and_tell_no_clock() -> None:
    columns = dict(made(1, 2).columns)
    columns |= {n: np.round(v) for n, v in columns.items() if n.startswith("T_")}
    log = ThermalLog.from_columns(columns, time_s=made(1, 2).time_s)
    assert with_one_clock(log, INPUTS, ["Z_um"]) is log  # 180 s early by the evidence


def test_what_judges_a_model_is_told_of_its_clock_and_stays() -> None:
    log = stamped(900.0)
    (said,) = (told := with_one_clock(log, INPUTS, ["Z_um"], told_only=True)).remarks
    assert said.code == "remark-displacements_seem_late"
    assert said.values["shift_s"] == pytest.approx(900.0, abs=75.0)
    assert told.columns["Z_um"] is log.columns["Z_um"]


@pytest.mark.parametrize("seed", quick_first(1, [1, 4]))
def test_a_sensor_that_drifts_by_three_kelvins_is_named_among_the_channels(seed: int) -> None:
    rows = slice(None)
    spindle = made(0, seed).columns["T_spindle_c"] + np.linspace(0.0, 3.0, made(0, seed).rows)
    log = changed("T_spindle_c", rows, spindle, seed)
    (said,) = with_one_clock(log, INPUTS, ["Z_um"]).remarks
    assert said.code == "remark-channel_drifts"
    rises = dict(one.split(" (") for one in str(said.values["sensors"]).split(" K)")[:-1])
    rises = {name.strip(", "): float(rise) for name, rise in rises.items()}
    assert rises["T_spindle_c"] == pytest.approx(3.0, abs=1.0)
    assert with_one_clock(made(0, seed), INPUTS, ["Z_um"]) is made(0, seed)


@pytest.mark.parametrize("um_per_h", quick_first(1, [12.0, -20.0]))
def test_a_displacement_that_drifts_is_told_by_its_rate(um_per_h: float) -> None:
    columns = machine_log("coupled", 8.0, 1, step_s=10.0, probe_um_per_h=um_per_h).columns()
    (said,) = with_one_clock(ThermalLog.from_columns(columns), INPUTS, ["Z_um"]).remarks
    assert said.code == "remark-displacement_drifts"
    within = float(said.values["within_um_per_h"])
    assert within < 5.0
    assert said.values["um_per_h"] == pytest.approx(um_per_h, abs=within)


def test_a_log_that_is_too_short_or_says_nothing_is_not_asked_for_its_clock() -> None:
    short = made(0, 0).between(0.0, 3600.0)
    assert with_one_clock(short, INPUTS, ["Z_um"]) is short
    still = changed("Z_um", slice(None), 0.0)
    assert with_one_clock(still, INPUTS, ["Z_um"]) is still
    assert with_one_clock(still, INPUTS, ["X_um"]) is still


def test_bursts_of_readings_are_read_by_their_own_rows() -> None:
    rows = made(0, 4)
    kept = np.concatenate([np.arange(k, k + 3) for k in range(0, rows.rows - 6, 9)])
    columns = {name: values[kept] for name, values in rows.columns.items()}
    log = without_faults(ThermalLog.from_columns(columns, time_s=rows.time_s[kept]))
    assert [one.code for one in log.remarks] == ["remark-rows_in_bursts"]
    assert log.remarks[0].values == {"rows": 3, "step_s": 90.0}
    records = records_of([log], INPUTS, ["Z_um"])
    assert records.sample_time_s == 90.0
    (experiment,) = records.experiments["Z_um"]
    assert np.isfinite(experiment.u).all()
    assert np.isfinite(experiment.y).all()


def test_single_gaps_and_even_rows_are_no_bursts() -> None:
    rows = made(0, 4)
    kept = np.delete(np.arange(rows.rows), np.arange(400, 2400, 300))
    columns = {name: values[kept] for name, values in rows.columns.items()}
    log = without_faults(ThermalLog.from_columns(columns, time_s=rows.time_s[kept]))
    assert log.remarks == ()
    assert records_of([log], INPUTS, ["Z_um"]).sample_time_s == 10.0


def test_lone_displacements_far_from_all_others_are_masked_and_no_others() -> None:
    rng = np.random.default_rng(3)
    time_s = 20.0 * np.arange(600)
    z_um = 40.0 * (1.0 - np.exp(-time_s / 3000.0)) + rng.normal(0.0, 0.4, time_s.size)
    healthy = ThermalLog.from_columns({"z_um": z_um.copy(), "t_C": 20.0 + z_um}, time_s=time_s)
    assert without_faults(healthy).remarks == ()
    wrong = [14, 15, 75, 400]
    z_um[wrong] += 4300.0
    log = without_faults(ThermalLog.from_columns({"z_um": z_um}, time_s=time_s))
    assert np.flatnonzero(np.isnan(log.columns["z_um"])).tolist() == wrong
    assert [m.code for m in log.remarks] == ["remark-values_no_measurement"]


def test_touches_that_a_control_repeats_are_told_and_a_coarse_or_steady_display_is_not() -> None:
    rng = np.random.default_rng(7)
    time_s = 60.0 * np.arange(7194)
    z_um = 30.0 * (1.0 - np.exp(-time_s / 40_000.0)) + rng.normal(0.0, 1.0, time_s.size)
    touches = np.round(z_um[::60], 1)
    temperature = 20.0 + z_um / 3.0
    count = 1 + np.count_nonzero(np.diff(touches))
    for held, expected in (
        (np.repeat(touches, 60)[: time_s.size], {"touches": count, "rows": 7194}),
        (np.where(np.arange(time_s.size) % 60, np.nan, np.round(z_um, 1)), None),
        (np.round(np.sort(z_um)), None),
        (np.round(z_um, 1), None),
    ):
        log = ThermalLog.from_columns({"Z_um": held, "T_C": temperature}, time_s=time_s)
        told = [m.values for m in without_faults(log).remarks if "repeated" in m.code]
        assert [{k: v for k, v in one.items() if k != "name"} for one in told] == (
            [expected] if expected else []
        )
