"""Thermal tests of ISO 230-3: closed forms, a second way, and what cannot be evaluated."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from thermaxis.compensation import CompensationModel, Output, Part
from thermaxis.errors import ConfigurationError, DataError
from thermaxis.thermal import (
    FloatArray,
    MotionTargets,
    Probes,
    ThermalLog,
    ThermalTest,
    ThermalTestBudget,
    ThermalTestKind,
    ThermalTestMotion,
    ThermalTestQuantity,
    ThermalTestSetup,
    evaluate_thermal_test,
    largest_ranges,
    left_by_model,
)

ETVE, SPINDLE, LINEAR, ROTARY = ThermalTestKind
EXACT = {"rel": 1e-9, "abs": 1e-9}
FIVE = Probes("X1_um", "X2_um", "Y1_um", "Y2_um", "Z_um", 125.0)
SETUP = ThermalTestSetup(
    FIVE, ambient=("T_room_C",), motion=ThermalTestMotion("n_rpm"), spans_h=(0.25, 1.0, 2.0, 30.0)
)


def log_of(hours: float, step_s: float = 60.0, **columns: Any) -> ThermalLog:
    time_s = np.arange(0.0, 3600.0 * hours + 1.0, step_s)
    values = {name: column(time_s / 3600.0) for name, column in columns.items()}
    return ThermalLog.from_columns(values, time_s=time_s, name="log.csv")


def ramp(slope_per_h: float) -> Any:
    return lambda t: 3.0 + slope_per_h * t


def warming(amplitude: float, tau_h: float, begin_h: float = 0.5, run_h: float = 4.0) -> Any:
    def of(t: FloatArray) -> FloatArray:
        on, off = np.clip(t - begin_h, 0.0, run_h), np.clip(t - begin_h - run_h, 0.0, None)
        return amplitude * -np.expm1(-on / tau_h) * np.exp(-off / tau_h)

    return of


def speed(t: FloatArray) -> FloatArray:
    return np.where((t >= 0.5) & (t <= 4.5), 6000.0, 0.0)


SPINDLE_COLUMNS: Mapping[str, Any] = {
    "n_rpm": speed,
    "X1_um": warming(12.0, 0.8),
    "X2_um": warming(7.0, 0.8),
    "Y1_um": warming(-4.0, 0.6),
    "Y2_um": warming(-2.5, 0.6),
    "Z_um": warming(30.0, 1.1),
    "T_room_C": ramp(0.2),
}


def spindle_log(**columns: Any) -> ThermalLog:
    return log_of(6.0, **{**SPINDLE_COLUMNS, **columns})


def of(test: ThermalTest) -> dict[str, ThermalTestQuantity]:
    return {one.name: one for one in test.quantities}


# ---- closed forms -------------------------------------------------------------------------------


def test_etve_of_ramps_is_slope_times_span() -> None:
    slopes = {"X1_um": 2.0, "X2_um": -1.0, "Y1_um": 0.5, "Y2_um": 0.25, "Z_um": -4.0}
    columns = {name: ramp(slope) for name, slope in slopes.items()}
    log = log_of(6.0, **columns, T_room_C=ramp(-0.7), T_floor_C=ramp(0.3))
    test = evaluate_thermal_test(log, ETVE, replace(SETUP, ambient=("T_room_C", "T_floor_C")))
    expected = {name.removesuffix("_um"): abs(slope) for name, slope in slopes.items()}
    expected |= {"A": abs(0.5 - 0.25) * 8.0, "B": abs(2.0 + 1.0) * 8.0}  # 1000 / 125 mm
    assert test.spans_h == (0.25, 1.0, 2.0)
    for name, slope in expected.items():
        one = of(test)[name]
        assert one.within_spans == pytest.approx([0.25 * slope, slope, 2.0 * slope], **EXACT)
        assert [one.first_hour.value, one.last_hour, one.whole.value] == pytest.approx(
            [slope, slope, 6.0 * slope], **EXACT
        )
        assert np.abs(one.drift_per_h) == pytest.approx([slope] * 6, **EXACT)
        assert one.cooling is None
    room, floor = test.temperatures
    assert (room.range_k, room.gradient_k_per_h) == pytest.approx((4.2, 0.7), **EXACT)
    assert (floor.start_c, floor.end_c) == pytest.approx((3.0, 4.8), **EXACT)
    assert test.room_spread_k == pytest.approx(6.0, **EXACT)
    assert [w.code for w in test.warnings] == ["warning-thermal_test_not_stated"]


def test_a_spindle_that_warms_by_one_lag_has_the_ranges_of_its_exponential() -> None:
    test = evaluate_thermal_test(spindle_log(), SPINDLE, SETUP)
    assert (test.begin_s, test.end_s, test.cooling_s) == (1800.0, 16200.0, 5400.0)
    for name, amplitude, tau_h in (
        ("X1", 12.0, 0.8),
        ("Y1", 4.0, 0.6),
        ("Z", 30.0, 1.1),
        ("A", 1.5 * 8.0, 0.6),
        ("B", 5.0 * 8.0, 0.8),
    ):
        one, hot = of(test)[name], amplitude * -np.expm1(-4.0 / tau_h)
        assert one.first_hour.value == pytest.approx(amplitude * -np.expm1(-1.0 / tau_h), **EXACT)
        assert one.whole.value == pytest.approx(hot, **EXACT)
        last = amplitude * (np.exp(-3.0 / tau_h) - np.exp(-4.0 / tau_h))
        assert one.last_hour == pytest.approx(last, **EXACT)
        assert one.cooling is not None
        assert one.cooling.value == pytest.approx(hot * -np.expm1(-1.5 / tau_h), **EXACT)
        assert len(one.drift_per_h) == 4
    end = test.end_criterion
    assert end is not None
    assert end.share == pytest.approx(np.exp(-3.0 / 1.1), **EXACT)
    assert end.reached


def test_a_tilt_is_that_of_a_rigid_mandrel_turned_in_space() -> None:
    angles = np.linspace(0.0, 1e-5, 121)  # about X and Y, small enough to be linear to 1e-9 um
    bottom, top = np.array([0.0, 0.0, 0.0]), np.array([0.0, 0.0, 125.0])
    probes = np.empty((121, 4))
    for k, angle in enumerate(angles):
        a, b = 2.0 * angle, -angle
        about_x = np.array([[1, 0, 0], [0, np.cos(a), np.sin(a)], [0, -np.sin(a), np.cos(a)]])
        about_y = np.array([[np.cos(b), 0, np.sin(b)], [0, 1, 0], [-np.sin(b), 0, np.cos(b)]])
        low, high = (1e3 * (about_y @ about_x @ p) + [3.0, -2.0, 1.0] for p in (bottom, top))
        probes[k] = high[0], low[0], high[1], low[1]  # the first probe is the upper one
    names = ("X1_um", "X2_um", "Y1_um", "Y2_um")
    columns = dict(zip(names, probes.T, strict=True))
    log = ThermalLog.from_columns(columns, sample_time_s=60.0)
    test = evaluate_thermal_test(log, ETVE, replace(SETUP, probes=replace(FIVE, z=""), ambient=()))
    heights_m = np.array([0.125, 0.0])
    second = [[np.polyfit(heights_m, row[k : k + 2], 1)[0] for row in probes] for k in (2, 0)]
    for name, fitted, degree in (("A", second[0], 20.0), ("B", second[1], -10.0)):
        values = of(test)[name].values
        assert values == pytest.approx(fitted, abs=1e-9)
        assert values == pytest.approx(degree * np.linspace(0.0, 1.0, 121), abs=1e-7)


def test_a_linear_axis_that_grows_shows_it_at_both_targets_and_between_them() -> None:
    grown = {"P1f_um": 1.0, "P1b_um": 1.2, "P2f_um": 9.0, "P2b_um": 8.0}
    columns = {name: warming(um, 0.9) for name, um in grown.items()}
    setup = ThermalTestSetup(
        targets=MotionTargets(("P1f_um", "P1b_um"), ("P2f_um", "P2b_um")),
        motion=ThermalTestMotion(running_min=(30.0, 270.0)),
    )
    test = evaluate_thermal_test(log_of(5.5, 300.0, **columns), LINEAR, setup)
    own = {"P1+": 1.0, "P1-": 1.2, "P2+": 9.0, "P2-": 8.0, "D+": 8.0, "D-": 6.8}
    assert {name: one.whole.value for name, one in of(test).items()} == pytest.approx(
        {name: um * -np.expm1(-4.0 / 0.9) for name, um in own.items()}, **EXACT
    )
    assert {name: one.first_hour.value for name, one in of(test).items()} == pytest.approx(
        {name: um * -np.expm1(-1.0 / 0.9) for name, um in own.items()}, **EXACT
    )
    assert test.spectrum == ()


def test_a_rotary_axis_is_evaluated_as_a_spindle_is() -> None:
    rotary = evaluate_thermal_test(spindle_log(), ROTARY, SETUP)
    spindle = evaluate_thermal_test(spindle_log(), SPINDLE, SETUP)
    ranges = [[(one.name, one.whole) for one in test.quantities] for test in (rotary, spindle)]
    assert ranges[0] == ranges[1]


def test_speeds_are_told_by_tenths_of_the_highest_one() -> None:
    steps = np.array([0.0, 3000.0, 3000.0, 12000.0, 0.0, 6000.0])

    def stepped(t: FloatArray) -> FloatArray:
        return steps[np.minimum((t * 2).astype(int), 5)]

    motion = ThermalTestMotion("n_rpm", highest=15000.0)
    log = spindle_log(n_rpm=stepped)
    test = evaluate_thermal_test(log, SPINDLE, replace(SETUP, motion=motion))
    told = [(c.from_percent, c.to_percent, c.mean, c.time_s / 1800.0) for c in test.spectrum]
    last = 7.0  # half hours to the end of the log
    expected = [
        (0.0, 0.0, 0.0, 1.0),
        (10.0, 20.0, 3000.0, 2.0),
        (30.0, 40.0, 6000.0, last),
        (70.0, 80.0, 12000.0, 1.0),
    ]
    assert told == expected
    seldom = log.columns["n_rpm"].copy()
    seldom[np.arange(log.rows) % 5 != 0] = np.nan  # as where recorders of two rates are joined
    joined = replace(log, columns={**log.columns, "n_rpm": seldom})
    again = evaluate_thermal_test(joined, SPINDLE, replace(SETUP, motion=motion)).spectrum
    assert [(c.mean, c.time_s / 1800.0) for c in again] == [one[2:] for one in expected]


# ---- a second way -------------------------------------------------------------------------------


def test_the_largest_range_in_a_span_is_that_of_every_pair_of_rows() -> None:
    rng = np.random.default_rng(3)
    time_s = np.cumsum(rng.uniform(0.5, 9.0, 90))
    values = np.cumsum(rng.normal(0.0, 1.0, 90))
    values[rng.uniform(size=90) < 0.2] = np.nan
    spans_s = (0.1, 3.0, 20.0, 77.7, 1e4)
    apart_s = np.abs(time_s[:, None] - time_s)
    pairs = np.abs(values[:, None] - values)
    brute = [np.nanmax(np.where(apart_s <= span_s, pairs, 0.0)) for span_s in spans_s]
    assert largest_ranges(time_s, values, spans_s) == pytest.approx(brute, abs=1e-12)


def test_drift_per_hour_is_the_slope_of_the_rows_of_each_hour() -> None:
    test = evaluate_thermal_test(spindle_log(), SPINDLE, SETUP)
    time_h, z = test.time_s / 3600.0, of(test)["Z"].values
    for k, drift in enumerate(of(test)["Z"].drift_per_h):
        rows = (time_h >= 0.5 + k - 1e-9) & (time_h <= 1.5 + k + 1e-9)
        assert drift == pytest.approx(np.polyfit(time_h[rows], z[rows], 1)[0], rel=1e-9)


def test_drift_of_the_last_hour_is_that_of_the_last_60_min_of_the_motion() -> None:
    log = spindle_log(n_rpm=lambda t: speed(t) * (t < 2.3))  # 1.8 h
    test = evaluate_thermal_test(log, SPINDLE, SETUP)
    rows = (test.time_s >= test.end_s - 3600.0) & (test.time_s <= test.end_s)
    z = of(test)["Z"]
    slope = np.polyfit(test.time_s[rows] / 3600.0, z.values[rows], 1)[0]
    assert z.last_hour_drift_per_h == pytest.approx(slope, rel=1e-9)
    assert z.last_hour_drift_per_h < 0.6 * z.drift_per_h[-1]  # of the first hour


def test_probes_that_are_read_one_after_another_give_the_tilt_of_the_same_moment() -> None:
    log = log_of(3.0, X1_um=ramp(5.0), X2_um=ramp(1.0))
    odd = np.arange(log.rows) % 2 == 1
    columns = {"X1_um": np.where(odd, np.nan, log.columns["X1_um"])}
    columns["X2_um"] = np.where(odd, log.columns["X2_um"], np.nan)
    by_turns = ThermalLog.from_columns(columns, time_s=log.time_s)
    setup = ThermalTestSetup(Probes("X1_um", "X2_um", distance_mm=200.0))
    tilt = of(evaluate_thermal_test(by_turns, ETVE, setup))["B"].values
    assert tilt[1:-1] == pytest.approx(20.0 * log.time_s[1:-1] / 3600.0, abs=1e-9)


def test_uncertainty_has_the_terms_that_are_stated() -> None:
    budget = ThermalTestBudget(0.4, 0.12, 0.3, 1.0)
    log = log_of(6.0, **{n: c for n, c in SPINDLE_COLUMNS.items() if n != "n_rpm"})
    test = evaluate_thermal_test(log, ETVE, replace(SETUP, uncertainty=budget))
    x1, b = (of(test)[name].whole for name in ("X1", "B"))
    terms: dict[str, float] = dict(x1.standard_uncertainties)
    steps = np.abs(np.diff(of(test)["X1"].values))
    high = 0.5 * steps[269:271].max()  # as it stops
    assert terms.pop("sampling") == pytest.approx(np.hypot(steps[0] / 2, high) / 3**0.5, rel=1e-9)
    assert terms == pytest.approx(
        {"probe": 0.2, "temperature": 0.3 * 1.2 / 3**0.5, "resolution": 0.12 / 6**0.5}, rel=1e-9
    )
    scale = 8.0 * 2**0.5
    tilt: dict[str, float] = dict(b.standard_uncertainties)
    assert tilt.pop("distance") == pytest.approx(b.value * 0.5 / 125.0, rel=1e-9)
    tilt.pop("sampling")
    assert tilt == pytest.approx({cause: scale * u for cause, u in terms.items()}, rel=1e-9)
    squares = sum(u**2 for u in b.standard_uncertainties.values())
    assert b.expanded_uncertainty == pytest.approx(2.0 * squares**0.5, rel=1e-12)


@pytest.mark.parametrize(
    ("probes", "stated", "keys"),
    [
        (FIVE, {}, "probe_um, fixture_um_per_k, distance_mm"),
        (FIVE, {"probe_um": 0.2, "distance_mm": 0.5}, "fixture_um_per_k"),
        (Probes(z="Z_um"), {"fixture_um_per_k": 0.0}, "probe_um"),
        (FIVE, {"probe_um": 0.2, "distance_mm": 0.5, "fixture_um_per_k": 0.3}, None),
    ],
)
def test_every_term_that_is_not_stated_is_told(
    probes: Probes, stated: dict[str, float], keys: str | None
) -> None:
    setup = replace(SETUP, probes=probes, uncertainty=ThermalTestBudget(**stated))
    warnings = evaluate_thermal_test(spindle_log(), SPINDLE, setup).warnings
    told = [w.values["keys"] for w in warnings if w.code == "warning-thermal_test_not_stated"]
    assert told == ([] if keys is None else [keys])


def test_what_is_left_is_measured_less_free_run_and_tilts_stay() -> None:
    part = Part("spindle", "T_spindle_C", direct_gain_um_per_k=2.0)
    model = CompensationModel(outputs=(Output("X1_um", (part,)),))
    log = spindle_log(T_spindle_C=lambda t: 20.0 + warming(6.0, 0.8)(t))
    left, told = left_by_model(log, SPINDLE, SETUP, model)
    assert told == ()
    before, after = (evaluate_thermal_test(one, SPINDLE, SETUP) for one in (log, left))
    rise_um = 2.0 * (log.columns["T_spindle_C"] - 20.0)
    assert of(after)["X1"].values == pytest.approx(of(before)["X1"].values - rise_um, abs=1e-6)
    assert of(after)["X1"].whole.value == pytest.approx(0.0, abs=1e-6)
    for name in ("A", "B", "Y1", "Z"):
        assert of(after)[name].values == pytest.approx(of(before)[name].values, abs=1e-9)


# ---- what cannot be evaluated -------------------------------------------------------------------


@pytest.mark.parametrize(
    ("code", "changes"),
    [
        ("probe_without_first", {"x1": ""}),
        ("probe_distance_missing", {"distance_mm": None}),
        ("not_positive_up_to", {"distance_mm": 0.0}),
        ("stated_twice", {"z": "X1_um"}),
    ],
)
def test_probes_that_make_no_tilt_are_refused(code: str, changes: dict[str, Any]) -> None:
    with pytest.raises(ConfigurationError) as caught:
        replace(FIVE, **changes)
    assert caught.value.code == code


def gap(t: FloatArray) -> FloatArray:
    return np.where((t > 2.0) & (t < 2.7), np.nan, t)


@pytest.mark.parametrize(
    ("code", "log", "kind", "setup"),
    [
        ("probes_missing", spindle_log(), SPINDLE, ThermalTestSetup()),
        ("targets_missing", spindle_log(), LINEAR, SETUP),
        ("motion_missing", spindle_log(), SPINDLE, replace(SETUP, motion=ThermalTestMotion())),
        ("never_moved", spindle_log(n_rpm=np.zeros_like), SPINDLE, SETUP),
        ("unknown_column", spindle_log(), ETVE, replace(SETUP, ambient=("T_hall_C",))),
        ("never_measured", spindle_log(Z_um=lambda t: np.nan * t), ETVE, SETUP),
        ("thermal_test_gap", spindle_log(Z_um=gap), ETVE, SETUP),
        ("thermal_test_too_short", spindle_log().span(0, 50), ETVE, SETUP),
        ("thermal_test_too_short", spindle_log().span(0, 60), SPINDLE, SETUP),
        (
            "wrong_unit",
            spindle_log(),
            ETVE,
            replace(SETUP, probes=replace(FIVE, z="T_room_C")),
        ),
        (
            "motion_beyond_log",
            spindle_log(),
            SPINDLE,
            replace(SETUP, motion=ThermalTestMotion(running_min=(0.0, 400.0))),
        ),
    ],
)
def test_what_is_no_test_is_refused(
    code: str, log: ThermalLog, kind: ThermalTestKind, setup: ThermalTestSetup
) -> None:
    with pytest.raises((DataError, ConfigurationError)) as caught:
        evaluate_thermal_test(log, kind, setup)
    assert caught.value.code == code


def test_the_set_up_refuses_an_expansion_without_ambient_and_a_span_of_nothing() -> None:
    for code, make in (
        ("fixture_without_ambient", lambda: replace(SETUP, ambient=(), uncertainty=FIXTURE)),
        ("not_positive_up_to", lambda: replace(SETUP, spans_h=(0.0,))),
        ("motion_not_rising", lambda: ThermalTestMotion(running_min=(5.0, 5.0))),
        ("outside_range", lambda: ThermalTestBudget(probe_um=-1.0)),
    ):
        with pytest.raises(ConfigurationError) as caught:
            make()
        assert caught.value.code == code


FIXTURE = ThermalTestBudget(fixture_um_per_k=0.3)


def test_what_departs_from_a_usual_test_is_told() -> None:
    def turned(t: FloatArray) -> FloatArray:
        return np.where(t > 2.4, 100.0, 0.0)

    def hole(t: FloatArray) -> FloatArray:
        return np.where((t > 1.0) & (t < 1.3), np.nan, t)

    log = log_of(3.0, n_rpm=turned, Z_um=hole)
    told = {
        w.code.removeprefix("warning-thermal_test_"): w.values
        for w in evaluate_thermal_test(log, ETVE, ThermalTestSetup(Probes(z="Z_um"))).warnings
    }
    assert told["short"] == {"hours": 3.0, "least_h": 4.0}
    assert told["turned"] == {"channel": "n_rpm", "percent": 20.0}
    assert told["probes_missing"] == {"probes": "X1, X2, Y1, Y2"}
    assert told["gap"] == {"quantity": "Z", "minutes": 18.0, "at_min": 60.0}
    assert {"without_ambient", "not_stated"} < set(told)
    early = spindle_log(n_rpm=lambda t: speed(t) * (t < 2.6)).span(0, 200)
    told_of = evaluate_thermal_test(early, SPINDLE, SETUP).warnings
    codes = {w.code.removeprefix("warning-thermal_test_") for w in told_of}
    assert codes == {"ended_early", "cooling_short", "not_stated"}


def codes_of(test: ThermalTest) -> set[str]:
    return {w.code.removeprefix("warning-thermal_test_") for w in test.warnings}


def test_a_log_without_a_row_at_rest_before_the_motion_is_told() -> None:
    cut = spindle_log().span(50, 361)
    assert "moves_at_once" not in codes_of(evaluate_thermal_test(spindle_log(), SPINDLE, SETUP))
    assert "moves_at_once" in codes_of(evaluate_thermal_test(cut, SPINDLE, SETUP))
    unknown = cut.columns["n_rpm"].copy()
    unknown[:3] = np.nan  # the recorder of the speed began later
    late = replace(cut, columns={**cut.columns, "n_rpm": unknown})
    assert "moves_at_once" in codes_of(evaluate_thermal_test(late, SPINDLE, SETUP))


def test_the_noise_of_an_encoder_at_standstill_is_no_motion() -> None:
    noise = np.random.default_rng(2).uniform(-2.0, 2.0, 361)
    noisy = spindle_log(n_rpm=lambda t: speed(t) + noise)
    motion = ThermalTestMotion("n_rpm", highest=6000.0)
    test = evaluate_thermal_test(noisy, SPINDLE, replace(SETUP, motion=motion))
    assert (test.begin_s, test.end_s) == (1800.0, 16200.0)
    assert codes_of(test).isdisjoint({"moves_at_once", "highest_passed"})
    table = spindle_log(n_rpm=lambda t: speed(t) / 1200.0)  # 5 rpm
    slow = evaluate_thermal_test(table, ROTARY, SETUP)
    assert (slow.begin_s, slow.end_s) == (1800.0, 16200.0)


def test_a_stated_highest_speed_that_was_passed_is_told() -> None:
    motion = ThermalTestMotion("n_rpm", highest=4500.0)
    test = evaluate_thermal_test(spindle_log(), SPINDLE, replace(SETUP, motion=motion))
    told = {w.code: w.values for w in test.warnings}
    expected = {"stated": 4500.0, "highest": 6000.0}
    assert told["warning-thermal_test_highest_passed"] == expected
