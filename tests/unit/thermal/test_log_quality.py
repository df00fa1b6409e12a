"""Wrong sensors and clocks are found and named; good ones are left alone."""

from functools import cache
from pathlib import Path

import numpy as np
import pytest
from scipy.signal import lfilter

from thermaxis.files import read_thermal_log
from thermaxis.thermal import FindingKind, LogFinding, ThermalLog, check_log

ROWS, STEP_S = 4000, 10.0
GAINS = {"T1_C": 8.0, "T2_C": 5.0, "T3_C": 3.0, "T4_C": 1.5}


def columns(seed: int = 0) -> dict[str, np.ndarray]:
    """Make a test that warms up in steps, with a displacement that follows."""
    return {name: values.copy() for name, values in made_columns(seed).items()}


@cache
def made_columns(seed: int) -> dict[str, np.ndarray]:
    rng = np.random.default_rng(seed)
    time_s = np.arange(ROWS) * STEP_S
    speed = np.repeat(rng.uniform(0.0, 1.0, 10), ROWS // 10)
    made: dict[str, np.ndarray] = {}
    for k, (name, gain) in enumerate(GAINS.items()):
        share = STEP_S / (1500.0 * (k + 1))
        warm = lfilter([share], [1.0, share - 1.0], speed)
        hall = 0.5 * np.sin(2 * np.pi * time_s / 86_400.0)
        made[name] = 20.0 + k + gain * warm + hall + rng.normal(0.0, 0.02, ROWS)
    made["Z_um"] = 6.0 * (made["T1_C"] - made["T4_C"]) + rng.normal(0.0, 0.4, ROWS)
    made["speed_rpm"] = 3000.0 * speed
    return made


def found(
    changed: dict[str, np.ndarray], time_s: np.ndarray | None = None
) -> tuple[LogFinding, ...]:
    times = np.arange(ROWS) * STEP_S if time_s is None else time_s
    return check_log(ThermalLog.from_columns(changed, time_s=times))


def only(findings: tuple[LogFinding, ...]) -> LogFinding:
    assert len(findings) == 1, [f.message for f in findings]
    return findings[0]


def test_good_channels_give_no_finding() -> None:
    for seed in range(5):
        assert found(columns(seed)) == ()


def test_a_real_machine_gives_no_false_alarm_but_the_noisy_sensor(real_data: Path) -> None:
    log = read_thermal_log(real_data / "thermal/fl_thermal/fl_thermal_15s_rows_0_8891.csv")
    finding = only(check_log(log))
    assert (finding.kind, finding.channel) == (FindingKind.NOISY, "t16_C")


@pytest.mark.real_data
def test_faults_put_into_the_real_record_are_found(real_data: Path) -> None:
    log = read_thermal_log(real_data / "thermal/fl_thermal/fl_thermal_15s_rows_0_8891.csv")
    changed = {name: values.copy() for name, values in log.columns.items()}
    changed["t4_C"][3000:4500] = changed["t4_C"][3000]
    changed["t7_C"][100:105] = 850.0
    changed["t5_C"][5000:] = log.columns["t9_C"][5000:]
    changed["t9_C"][5000:] = log.columns["t5_C"][5000:]
    changed["t3_C"] = np.round(changed["t3_C"], 1)
    findings = check_log(ThermalLog.from_columns(changed, time_s=log.time_s))
    assert [(f.kind, f.channel) for f in findings if f.channel != "t16_C"] == [
        (FindingKind.OUT_OF_RANGE, "t7_C"),
        (FindingKind.SWAPPED, "t5_C,t9_C"),
        (FindingKind.STUCK, "t4_C"),
        (FindingKind.QUANTISED, "t3_C"),
    ]


def test_values_that_stand_for_a_fault_are_named_with_their_place() -> None:
    for sentinel in (-999.0, 850.0, 85.0, 0.0, -127.0):
        changed = columns()
        changed["T2_C"][700:705] = sentinel
        changed["T2_C"][2000] = sentinel
        finding = only(found(changed))
        assert (finding.kind, finding.channel) == (FindingKind.OUT_OF_RANGE, "T2_C")
        assert finding.rows == (700, 2001)
        values = finding.message.values
        assert (values["name"], values["count"], values["example"]) == ("T2_C", 6, sentinel)
        assert finding.serious


def test_a_temperature_that_passes_through_zero_is_no_fault() -> None:
    changed = {name: np.round(values - 21.0, 1) for name, values in columns().items()}
    kinds = {f.kind for f in found(changed)}
    assert kinds <= {FindingKind.QUANTISED}


def test_the_step_of_a_quantised_channel_is_stated() -> None:
    changed = columns()
    changed["T3_C"] = np.round(changed["T3_C"], 1)
    finding = only(found(changed))
    assert finding.kind is FindingKind.QUANTISED
    assert finding.message.values["step"] == pytest.approx(0.1)
    assert finding.message.values["unit"] == "degC"
    assert not finding.serious
    changed["T3_C"] = np.round(columns()["T3_C"] * 16) / 16
    assert only(found(changed)).message.values["step"] == pytest.approx(0.0625)


def test_a_channel_that_is_stuck_while_others_move_is_named_with_its_rows() -> None:
    changed = columns()
    changed["T1_C"][1000:1500] = changed["T1_C"][1000]
    finding = only(found(changed))
    assert (finding.kind, finding.channel) == (FindingKind.STUCK, "T1_C")
    assert finding.rows == (1000, 1500)
    assert finding.time_s == (10_000.0, 14_990.0)


def with_a_slow_channel() -> dict[str, np.ndarray]:
    """Make a coarse channel that flickers, then rests between two steps as its machine warms."""
    time_s = np.arange(1500) * STEP_S
    rng = np.random.default_rng(3)
    warm = 1.0 - np.exp(-np.maximum(time_s - 4000.0, 0.0) / 2500.0)
    slow = 20.05 - 0.04 * (time_s > 3000.0) - 0.25 * np.maximum(time_s - 12_000.0, 0.0) / 3000.0
    return {
        "T_fast_C": np.round(20.0 + 8.0 * warm + rng.normal(0.0, 0.02, 1500), 1),
        "T_slow_C": np.round(slow + rng.normal(0.0, 0.01, 1500), 1),
    }


def test_a_coarse_channel_that_barely_moves_is_not_called_stuck() -> None:
    changed = with_a_slow_channel()
    rest = changed["T_slow_C"][400:900]
    assert np.ptp(rest) == 0.0
    assert np.ptp(changed["T_fast_C"][400:900]) > 5.0
    time_s = np.arange(1500) * STEP_S
    assert {f.kind for f in found(changed, time_s)} == {FindingKind.QUANTISED}


@pytest.mark.parametrize("phase", [0.2, 0.4])
@pytest.mark.parametrize("step_k", [0.1, 1.0])
def test_a_display_of_coarse_steps_that_rests_overnight_is_not_called_stuck(
    step_k: float, phase: float
) -> None:
    random = np.random.default_rng(3)
    hours = np.arange(0.0, 24.0, 1 / 60)
    hall = 1.2 * np.sin(2 * np.pi * (hours / 24 + phase))
    heat = np.exp(-np.maximum(hours - 8, 0.0) / 0.6) - np.exp(-np.maximum(hours - 1, 0.0) / 0.6)
    true = {"T1_C": hall + 9.0 * heat, "T2_C": hall + 5.0 * heat, "T3_C": hall}
    noisy = {n: 20.0 + v + random.normal(0.0, 0.002, v.size) for n, v in true.items()}
    shown = {n: step_k * np.round(v / step_k) for n, v in noisy.items()}
    kinds = {f.kind for f in found(shown, 3600.0 * hours)}
    assert kinds == {FindingKind.QUANTISED}


def test_a_channel_of_two_values_is_stuck_where_the_others_move_by_three_steps() -> None:
    for seed in range(3):
        changed = {n: np.round(v) if n.startswith("T") else v for n, v in columns(seed).items()}
        for finding in found(changed):
            if finding.kind is FindingKind.STUCK:
                assert finding.rows is not None
                rows = slice(*finding.rows)
                others = [np.ptp(changed[n][rows]) for n in GAINS if n != finding.channel]
                assert np.median(others) >= 3.0
    fast = np.round(20.0 + 10.0 * np.sin(np.arange(1000) / 120.0), 1)
    frozen = np.where(np.arange(1000) < 100, 20.0, 21.0)
    findings = found({"T1_C": fast, "T2_C": fast + 1.0, "T3_C": frozen}, np.arange(1000) * STEP_S)
    assert (findings[0].kind, findings[0].channel) == (FindingKind.STUCK, "T3_C")


@pytest.mark.parametrize("name", ["lathe_spindle", "lathe_table", "lathe_verification"])
def test_rounded_temperatures_of_the_virtual_lathe_are_not_called_stuck(
    root: Path, name: str
) -> None:
    whole = read_thermal_log(root / f"examples/{name}.csv")
    for channels in (("T_table_C",), ("T_spindle_C", "T_table_C")):
        log = whole.select(["T_column_C", *channels])
        for own in (log, log.resample(30.0), log.resample(60.0)):
            assert FindingKind.STUCK not in {f.kind for f in check_log(own)}, channels


@pytest.mark.parametrize(("name", "step_k"), [("T1_C", 0.1), ("T2_C", 0.2), ("T3_C", 0.1)])
def test_a_coarse_channel_that_froze_while_the_others_moved_by_many_steps_is_named(
    name: str, step_k: float
) -> None:
    changed = {
        n: np.round(np.round(v / step_k) * step_k, 3) if n.startswith("T") else v
        for n, v in columns().items()
    }
    assert {f.kind for f in found(changed)} == {FindingKind.QUANTISED}
    begin = int(np.argmax(np.abs(changed[name][600:] - changed[name][:-600])))
    others = [np.ptp(changed[n][begin : begin + 600]) for n in GAINS if n != name]
    assert np.median(others) > 3.0 * step_k
    changed[name][begin : begin + 600] = changed[name][begin]
    first = found(changed)[0]
    assert (first.kind, first.channel) == (FindingKind.STUCK, name)


def test_a_constant_channel_and_one_without_values_are_named_and_come_first() -> None:
    changed = columns()
    changed["T4_C"] = np.full(ROWS, 20.0)
    changed["T3_C"] = np.full(ROWS, np.nan)
    changed["T2_C"] = np.round(changed["T2_C"], 1)
    kinds = [(f.kind, f.channel) for f in found(changed)]
    assert kinds == [
        (FindingKind.NEVER_MEASURED, "T3_C"),
        (FindingKind.CONSTANT, "T4_C"),
        (FindingKind.QUANTISED, "T2_C"),
    ]


def test_two_channels_that_exchange_places_are_named_with_the_row() -> None:
    changed = columns()
    first, second = changed["T1_C"].copy(), changed["T4_C"].copy()
    row = 2500
    changed["T1_C"][row:], changed["T4_C"][row:] = second[row:], first[row:]
    finding = only(found(changed))
    assert (finding.kind, finding.channel) == (FindingKind.SWAPPED, "T1_C,T4_C")
    assert finding.rows == (row, ROWS)


def test_names_exchanged_against_an_earlier_log_are_found() -> None:
    earlier, later = columns(11), columns(12)
    reference = ThermalLog.from_columns(earlier, sample_time_s=STEP_S, name="before")
    right = ThermalLog.from_columns(later, sample_time_s=STEP_S)
    assert check_log(right, reference=reference) == ()
    later["T1_C"], later["T4_C"] = later["T4_C"], later["T1_C"]
    finding = only(check_log(right.from_columns(later, sample_time_s=STEP_S), reference=reference))
    assert (finding.kind, finding.channel) == (FindingKind.SWAPPED, "T1_C,T4_C")
    assert finding.message.code == "log-swapped_names"
    assert finding.message.values["reference"] == "before"


@pytest.mark.real_data
def test_names_exchanged_in_the_real_record_are_found_against_its_other_half(
    real_data: Path,
) -> None:
    log = read_thermal_log(real_data / "thermal/fl_thermal/fl_thermal_15s_rows_0_8891.csv")
    reference, later = log.span(0, 4400), log.span(4400, 8892)
    swaps = [f for f in check_log(later, reference=reference) if f.kind is FindingKind.SWAPPED]
    assert swaps == []
    changed = dict(later.columns)
    changed["t5_C"], changed["t6_C"] = changed["t6_C"], changed["t5_C"]
    exchanged = ThermalLog.from_columns(changed, time_s=later.time_s)
    kinds = [(f.kind, f.channel) for f in check_log(exchanged, reference=reference)]
    assert kinds[0] == (FindingKind.SWAPPED, "t5_C,t6_C")


def test_a_jump_that_heat_cannot_make_is_named() -> None:
    changed = columns()
    changed["T2_C"][1800:] += 5.0
    finding = only(found(changed))
    assert (finding.kind, finding.channel) == (FindingKind.JUMP, "T2_C")
    assert finding.rows == (1799, 1801)
    changed = columns()
    changed["Z_um"][900] += 80.0
    finding = only(found(changed))
    assert (finding.kind, finding.channel) == (FindingKind.JUMP, "Z_um")


def test_a_noisy_channel_is_named() -> None:
    changed = columns()
    changed["T3_C"] = changed["T3_C"] + np.random.default_rng(3).normal(0.0, 0.3, ROWS)
    finding = only(found(changed))
    assert (finding.kind, finding.channel) == (FindingKind.NOISY, "T3_C")


def test_gaps_of_the_record_are_counted_and_one_of_an_hour_may_be_the_clock() -> None:
    time_s = np.arange(ROWS) * STEP_S
    time_s[1000:] += 500.0
    time_s[3000:] += 90.0
    finding = only(found(columns(), time_s))
    assert finding.kind is FindingKind.GAP
    assert finding.message.values == {"count": 2, "lost_s": 590.0, "longest_s": 510.0, "row": 999}
    time_s = np.arange(ROWS) * STEP_S
    time_s[1000:] += 3600.0
    assert [f.kind for f in found(columns(), time_s)] == [FindingKind.CLOCK, FindingKind.GAP]


def test_missing_values_of_one_channel_are_named() -> None:
    changed = columns()
    changed["T1_C"][500:900] = np.nan
    finding = only(found(changed))
    assert (finding.kind, finding.channel) == (FindingKind.MISSING, "T1_C")
    assert finding.rows == (499, 901)


def test_a_channel_that_is_seen_now_and_then_is_rare_not_missing() -> None:
    changed = columns()
    seen = np.arange(ROWS) % 200 < 7
    changed["Z_um"] = np.where(seen, changed["Z_um"], np.nan)
    finding = only(found(changed))
    assert finding.kind is FindingKind.RARE
    assert finding.message.values == {"name": finding.channel, "count": 20, "lasts_s": 60.0}


def test_a_channel_at_a_slower_rate_is_not_missing_and_one_held_meanwhile_is_named() -> None:
    changed = columns()
    changed["T2_C"] = np.where(np.arange(ROWS) % 6 == 0, changed["T2_C"], np.nan)
    assert found(changed) == ()
    changed["T2_C"] = np.repeat(columns()["T2_C"][::10], 10)
    findings = tuple(f for f in found(changed) if f.kind is FindingKind.HELD)
    assert only(findings).message.values["rows"] == 10


def test_uneven_times_are_named() -> None:
    time_s = np.arange(ROWS) * STEP_S + np.random.default_rng(0).uniform(0, 6.0, ROWS)
    assert FindingKind.UNEVEN in {f.kind for f in found(columns(), time_s - time_s[0])}


def test_short_logs_are_checked_without_a_word() -> None:
    for rows in (1, 2, 3, 5, 12):
        short = {name: values[:rows] for name, values in columns().items()}
        kinds = {f.kind for f in found(short, np.arange(rows) * STEP_S)}
        assert kinds <= {FindingKind.CONSTANT}


def test_what_stands_without_noise_until_the_machine_moves_is_not_called_stuck() -> None:
    time_s = np.arange(0.0, 4 * 3600.0, 10.0)
    rise = -np.expm1(-np.clip(time_s - 600.0, 0.0, None) / 3000.0)
    noise = np.random.default_rng(5).normal(0.0, 0.02, time_s.size)
    changed = {"Z_um": 30.0 * rise, "T1_C": 22.0 + 12.0 * rise, "T2_C": 21.0 + 2.0 * rise + noise}
    assert found(changed, time_s) == ()
    changed["Z_um"][:200] = 0.0  # dead until then, it shows at once what it missed
    assert {(f.kind, f.channel) for f in found(changed, time_s)} >= {(FindingKind.STUCK, "Z_um")}
