"""What the diagnosis names on generated axes, and what it keeps silent about."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from scipy import signal, stats

from thermaxis.codes import Message, Value
from thermaxis.messages import sentence_of
from thermaxis.positioning import (
    Finding,
    PositioningTest,
    StartEnd,
    TimeSource,
    diagnose,
    evaluate_drift,
)
from thermaxis.positioning.diagnosis import (
    COMMON_PITCHES_MM,
    LEAST_EFFECT,
    LEAST_SCALE_UM_PER_M,
    SPREAD_LEVEL,
)
from thermaxis.quantities import AxisKind
from thermaxis.virtual import (
    AxisGeometry,
    AxisThermal,
    LocalSpread,
    ReadingScatter,
    RunPlan,
    VirtualAxis,
    WarmUp,
    generate_positioning_run,
    paper_x_axis,
)

from .builders import run, stop_times

NOISE = 0.4
HEALTHY = VirtualAxis(
    plan=RunPlan(random_part=4.0, cycles=5, recording_s=2.0),
    geometry=AxisGeometry(
        straight_line_um_per_m=1.0,
        pitch_error=0.3,
        periodic_error=0.1,
        reversal=-0.5,
        reversal_variation=0.05,
    ),
    thermal=AxisThermal(
        structure=(WarmUp(6.0, 1800.0),),
        screw_expansion_um_per_m=20.0,
        screw_time_constant_s=3600.0,
        fixed_bearing=-40.0,
        hall_swing_k=0.2,
        hall_sensitivity=0.4,
    ),
    scatter=ReadingScatter(noise=NOISE),
)
COLD = replace(HEALTHY, thermal=AxisThermal())


def measured(axis: VirtualAxis, seed: int, *, cycles: int = 5) -> PositioningTest:
    return generate_positioning_run(
        replace(axis, plan=replace(axis.plan, cycles=cycles)), seed=seed
    ).test


def with_geometry(axis: VirtualAxis, **changes: float) -> VirtualAxis:
    return replace(axis, geometry=replace(axis.geometry, **changes))


def without_drift_model(test: PositioningTest) -> tuple[Finding, ...]:
    return diagnose(test, None)


def with_drift_model(test: PositioningTest) -> tuple[Finding, ...]:
    return diagnose(test, evaluate_drift(test))


def keys(found: tuple[Finding, ...]) -> list[str]:
    return [finding.finding for finding in found]


def only(found: tuple[Finding, ...], key: str) -> Finding:
    (one,) = [finding for finding in found if finding.finding == key]
    return one


def text(finding: Finding) -> str:
    return sentence_of(finding.message)


def periods(finding: Finding) -> list[Value]:
    """Return the period that a periodic error has, those that would fit as well behind it."""
    values = finding.message.values
    others = values.get("others", ())
    assert isinstance(others, tuple)
    return [values["period"], *(o.values["amount"] for o in others if isinstance(o, Message))]


def step_of_backlash(test: PositioningTest, first: int, size: float = 3.0) -> PositioningTest:
    deviation = test.deviation.copy()
    deviation[first:, :, 1] += size
    return replace(test, deviation=deviation)


# ---- planted faults -----------------------------------------------------------------------------


@pytest.mark.proof
def test_a_healthy_axis_that_warms_up_is_not_accused() -> None:
    accused = [seed for seed in range(8) if with_drift_model(measured(HEALTHY, seed))]
    assert len(accused) <= 1


def test_a_scale_error_is_named_first() -> None:
    axis = with_geometry(HEALTHY, straight_line_um_per_m=-20.0)
    for seed in range(2):
        found = with_drift_model(measured(axis, seed))
        assert keys(found)[0] == "scale_error"
        assert found[0].value == pytest.approx(-20.0, abs=5.0)


def test_a_periodic_error_is_named_first_with_its_period() -> None:
    for seed, pitch in enumerate(COMMON_PITCHES_MM[::4]):
        axis = with_geometry(HEALTHY, periodic_error=2.0, period=pitch)
        found = with_drift_model(measured(axis, seed))
        assert keys(found)[0] == "periodic_error"
        assert pitch in periods(found[0])


def test_a_step_of_the_backlash_is_named_first_with_its_place() -> None:
    for seed in range(2):
        first = 2 + 11 * seed
        test = step_of_backlash(measured(HEALTHY, seed), first)
        found = with_drift_model(test)
        assert keys(found)[0] == "backlash_step"
        assert found[0].value == pytest.approx(-3.0, abs=0.6)
        values = found[0].message.values
        assert (values["before"], values["behind"]) == tuple(test.target[first - 1 : first + 1])


def test_a_doubled_spread_is_named_first_from_twenty_cycles_on() -> None:
    for seed in range(2):
        local = (LocalSpread(1 + seed, NOISE * np.sqrt(3.0)),)
        axis = replace(HEALTHY, scatter=replace(HEALTHY.scatter, local=local))
        found = with_drift_model(measured(axis, seed, cycles=20))
        assert keys(found)[0] == "spread"
        assert found[0].message.values["target"] == 1 + seed
        assert found[0].value == pytest.approx(2.0 * NOISE, rel=0.35)


def test_the_same_faults_are_found_from_plain_means_where_the_order_is_unknown() -> None:
    for axis, key in (
        (with_geometry(COLD, straight_line_um_per_m=20.0), "scale_error"),
        (with_geometry(COLD, periodic_error=2.0, period=10.0), "periodic_error"),
        (with_geometry(COLD, reversal=-4.0), "backlash"),
        (with_geometry(COLD, reversal=-0.2, reversal_variation=2.5), "backlash_variation"),
    ):
        test = replace(measured(axis, 3), time_source=TimeSource.NONE, time_s=None, order=None)
        found = without_drift_model(test)
        assert keys(found)[0] == key


def test_a_spread_is_found_without_the_drift_model_though_the_axis_drifts() -> None:
    axis = replace(HEALTHY, scatter=ReadingScatter(noise=0.2, local=(LocalSpread(7, 0.8),)))
    found = without_drift_model(measured(axis, 1, cycles=10))
    message = only(found, "spread").message
    assert (message.code, message.values["target"]) == ("finding-spread_drift_included", 7)


# ---- numbers, by a second way -------------------------------------------------------------------


def test_the_straight_line_error_is_that_of_the_first_reading_not_of_the_warm_screw() -> None:
    axis = with_geometry(HEALTHY, straight_line_um_per_m=30.0, pitch_error=0.0)
    axis = replace(axis, thermal=replace(axis.thermal, screw_expansion_um_per_m=60.0))
    test = measured(axis, 2, cycles=20)
    with_model = only(with_drift_model(test), "scale_error").value
    from_means = only(without_drift_model(test), "scale_error").value
    assert with_model == pytest.approx(30.0, abs=3.0)
    assert from_means > 50.0


def test_the_temperature_error_follows_from_the_coefficient_of_the_file_or_from_steel() -> None:
    test = measured(with_geometry(COLD, straight_line_um_per_m=40.0, pitch_error=0.0), 5)
    steel = only(without_drift_model(test), "scale_error")
    assert f"an error of {abs(steel.value) / 11.5:.2f} K" in text(steel)
    assert "steel; the file states no coefficient" in text(steel)
    environment = {"expansion_coefficient_ppm_per_k": StartEnd(10.0, 10.0)}
    stated = only(without_drift_model(replace(test, environment=environment)), "scale_error")
    assert f"an error of {abs(steel.value) / 10.0:.2f} K" in text(stated)
    assert "10 ppm/K (stated in the file)" in text(stated)


def test_the_amplitude_agrees_with_the_periodogram_of_another_program() -> None:
    geometry = AxisGeometry(periodic_error=2.0, period=8.0)
    test = measured(replace(COLD, geometry=geometry, scatter=ReadingScatter(noise=0.1)), 4)
    found = only(without_drift_model(test), "periodic_error")
    mean = np.mean(test.deviation, axis=(1, 2))
    power = signal.lombscargle(
        test.target, mean, np.array([2.0 * np.pi / 8.0]), floating_mean=True, normalize="amplitude"
    )
    assert found.value == pytest.approx(2.0, rel=0.05)
    assert found.value == pytest.approx(float(np.abs(power).item()), rel=0.05)


def test_the_probability_of_a_spread_is_that_of_the_f_distribution() -> None:
    random = np.random.default_rng(3)
    deviation = random.normal(size=(8, 6, 2))
    deviation[2] *= 4.0
    test = run(deviation, time_s=stop_times(8, 6))
    drift = evaluate_drift(test)
    square = np.sum(
        (drift.deviation - np.mean(drift.deviation, axis=1, keepdims=True)) ** 2, (1, 2)
    )
    free = 10.0 * (1.0 - drift.drift_parameters / 80.0)
    ratio = (square[2] / free) / ((np.sum(square) - square[2]) / (7.0 * free))
    expected = 8.0 * stats.f.sf(ratio, free, 7.0 * free)
    assert only(diagnose(test, drift), "spread").p_value == pytest.approx(expected, rel=1e-9)


@pytest.mark.proof
def test_the_spread_test_keeps_its_level_on_targets_that_scatter_alike() -> None:
    named = 0
    for seed in range(60):
        random = np.random.default_rng([11, seed])
        test = run(random.normal(size=(9, 4, 2)))
        named += "spread" in keys(without_drift_model(test))
    assert named <= stats.binom.ppf(0.999, 60, SPREAD_LEVEL)


# ---- laws ---------------------------------------------------------------------------------------


def faulty() -> PositioningTest:
    axis = with_geometry(COLD, straight_line_um_per_m=25.0, periodic_error=1.5, reversal=-4.0)
    return step_of_backlash(measured(axis, 8), 9)


def test_what_is_named_first_has_the_largest_effect_and_is_ordered_so() -> None:
    found = without_drift_model(faulty())
    assert set(keys(found)) >= {"scale_error", "periodic_error", "backlash_step", "backlash"}
    length = faulty().measured_length
    effect = {
        "scale_error": lambda v: v * length / 1000.0,
        "periodic_error": lambda v: 2.0 * v,
        "backlash_step": lambda v: v,
    }
    sizes = [abs(effect[f.finding](f.value)) for f in found if f.finding in effect]
    assert sizes == sorted(sizes, reverse=True)


def test_a_constant_changes_nothing_and_signs_and_approaches_change_as_the_readings_do() -> None:
    test = faulty()
    deviation = test.deviation
    for other, sign_of in (
        (deviation + 250.0, dict[str, float]()),
        (-deviation, dict.fromkeys(("scale_error", "backlash", "backlash_step"), -1.0)),
        (deviation[..., ::-1], dict.fromkeys(("backlash", "backlash_step"), -1.0)),
    ):
        found = without_drift_model(replace(test, deviation=other))
        for before, after in zip(without_drift_model(test), found, strict=True):
            assert after.finding == before.finding
            sign = sign_of.get(before.finding, 1.0)
            assert after.value == pytest.approx(sign * before.value, rel=1e-6)
            if after.finding == "backlash":
                cause = "lost_motion" if sign > 0.0 else "too_much_compensation"
                assert after.message.values["cause"].code == f"diagnosis-{cause}"


@settings(max_examples=25, deadline=None, derandomize=True)
@given(
    seed=st.integers(0, 10_000),
    m=st.integers(1, 9),
    n=st.integers(1, 4),
    missing=st.integers(0, 6),
    size=st.sampled_from([0.0, 1e-6, 1.0, 1e4]),
)
def test_any_run_gives_finite_numbers_and_whole_sentences(
    seed: int, m: int, n: int, missing: int, size: float
) -> None:
    random = np.random.default_rng(seed)
    deviation = size * random.normal(size=(m, n, 2))
    for _ in range(missing):
        i, a = random.integers(m), random.integers(2)
        if np.sum(~np.isnan(deviation[i, :, a])) > 1:
            deviation[i, random.integers(n), a] = np.nan
    for finding in without_drift_model(run(deviation)):
        assert np.isfinite(finding.value)
        assert text(finding).endswith(".")
        assert "–" not in text(finding)
        assert finding.p_value is None or 0.0 <= finding.p_value < 0.05


# ---- thresholds ---------------------------------------------------------------------------------


def test_what_nobody_would_repair_is_no_finding_however_sure_it_is() -> None:
    below = AxisGeometry(
        straight_line_um_per_m=0.8 * LEAST_SCALE_UM_PER_M,
        reversal=-0.8 * LEAST_EFFECT,
        periodic_error=0.3,
        reversal_variation=0.3,
    )
    axis = replace(COLD, geometry=below, scatter=ReadingScatter(noise=0.02))
    assert without_drift_model(measured(axis, 1, cycles=30)) == ()
    above = AxisGeometry(straight_line_um_per_m=1.3 * LEAST_SCALE_UM_PER_M, reversal=-1.3)
    axis = replace(axis, geometry=above)
    assert set(keys(without_drift_model(measured(axis, 1)))) == {"scale_error", "backlash"}


# ---- periods that hide --------------------------------------------------------------------------


def test_equidistant_targets_hide_the_pitches_of_which_they_are_multiples() -> None:
    test = measured(COLD, 2)
    assert without_drift_model(test) == ()  # their random part hides no common pitch
    assert without_drift_model(replace(test, header={"pitch_mm": "10 mm"})) == ()
    test = replace(test, target=20.0 * np.arange(test.target.size))
    hidden = only(without_drift_model(test), "hidden_period")
    assert "common for drives (2 mm; 2.5 mm; 4 mm; 5 mm; 10 mm; 20 mm)" in text(hidden)
    assert hidden.p_value is None
    assert keys(without_drift_model(test))[-1] == "hidden_period"
    hidden = only(without_drift_model(replace(test, header={"pitch_mm": "10"})), "hidden_period")
    assert hidden.value == 10.0
    assert "multiples of 10 mm (stated in the file)" in text(hidden)


def test_periods_that_equidistant_targets_cannot_tell_apart_are_all_named() -> None:
    test = measured(replace(COLD, geometry=AxisGeometry()), 2)
    test = replace(test, target=20.0 * np.arange(test.target.size))
    wave = 2.0 * np.sin(2.0 * np.pi * test.target / 8.0 + 0.8)
    deviation = test.deviation + wave[:, None, None]
    found = only(without_drift_model(replace(test, deviation=deviation)), "periodic_error")
    assert set(periods(found)) >= {8.0, 40.0}
    assert "others would fit about as well: " in text(found)


def test_a_smooth_error_rounded_at_distant_targets_is_neither_periodic_nor_scatter() -> None:
    rng = np.random.default_rng(23)
    target = 100.0 * np.arange(11) + rng.uniform(-2.5, 2.5, 11)
    smooth = 3.0 * np.sin(2.0 * np.pi * target / 800.0) + 0.006 * target
    deviation = smooth[:, None, None] - [0.0, 2.0] + rng.normal(0.0, 0.15, (11, 5, 2))
    test = run(np.round(deviation), target)
    assert {"periodic_error", "spread"}.isdisjoint(keys(without_drift_model(test)))


def test_a_target_that_repeats_exactly_is_named_where_the_display_would_show_the_scatter() -> None:
    deviation = np.random.default_rng(6).normal(0.0, 0.3, (9, 5, 2))
    for step, named in ((1e-3, True), (0.1, True), (1.0, False)):
        shown = np.round(deviation / step) * step
        assert "frozen_readings" not in keys(without_drift_model(run(shown)))
        shown[4] = 2.0
        found = keys(without_drift_model(run(shown)))
        assert (found[:1] == ["frozen_readings"]) == named


def test_only_the_stated_pitch_and_its_half_are_tried() -> None:
    test = measured(with_geometry(COLD, periodic_error=2.0, period=6.35), 3)
    stated = only(without_drift_model(replace(test, header={"pitch_mm": "6,35"})), "periodic_error")
    assert "6.35 mm, as the file states" in text(stated)
    half = only(without_drift_model(replace(test, header={"pitch_mm": "12.7"})), "periodic_error")
    assert "6.35 mm, half the pitch" in text(half)


def test_a_pitch_that_is_no_length_is_passed_over() -> None:
    for word in ("", "nan", "inf", "-5", "0", "five", "1e-300", "1e300", "=1+1", " "):
        test = measured(COLD, 2)
        header = {"pitch_mm": word, "encoder_period_mm": word}
        assert without_drift_model(replace(test, header=header)) == without_drift_model(test)


# ---- other kinds of runs ------------------------------------------------------------------------


def test_a_unidirectional_run_has_no_backlash() -> None:
    axis = with_geometry(COLD, straight_line_um_per_m=30.0, reversal=-5.0)
    for approach in (0, 1):
        one = replace(axis, plan=replace(axis.plan, approaches=(approach,)))
        found = with_drift_model(measured(one, 4))
        assert keys(found) == ["scale_error"]


def test_a_rotary_axis_is_told_in_arcseconds_and_without_temperatures() -> None:
    axis = VirtualAxis(
        kind=AxisKind.ROTARY,
        plan=RunPlan(targets=18, interval=20.0, random_part=4.0, feed=3600.0),
        geometry=AxisGeometry(periodic_error=3.0, period=4.0, reversal=-6.0),
        scatter=ReadingScatter(noise=0.4),
    )
    test = measured(axis, 4)
    eccentric = 5.0 * np.sin(np.deg2rad(test.target)) + 10.0 / 360.0 * test.target
    tilted = replace(test, deviation=test.deviation + eccentric[:, None, None])
    found = with_drift_model(tilted)
    named = {"scale_error", "once_per_turn_error", "periodic_error", "backlash"}
    assert set(keys(found)) == named
    scale = only(found, "scale_error")
    assert scale.unit == "arcsec per turn"
    assert scale.value == pytest.approx(10.0, abs=2.0)
    assert "temperature" not in text(scale)
    assert "period of 4 °" in text(only(found, "periodic_error"))


def test_an_error_that_repeats_with_the_turn_is_no_slope_of_an_axis_that_closes() -> None:
    target, rng = np.arange(0.0, 361.0, 30.0), np.random.default_rng(3)
    turn = np.deg2rad(target)
    eccentric = 5.0 * np.sin(turn) + 2.0 * np.sin(2.0 * turn)
    for slope, named in (
        (0.0, ["once_per_turn_error"]),
        (6.0, ["once_per_turn_error", "scale_error"]),
    ):
        levels = eccentric + slope * target / 360.0
        noise = 0.4 * rng.standard_normal((13, 5, 2))
        test = run(levels[:, None, None] + noise, target, kind=AxisKind.ROTARY)
        found = [f for f in without_drift_model(test) if f.finding != "hidden_period"]
        assert sorted(keys(found)) == named
        if slope == 0.0:
            assert found[0].value == pytest.approx(5.0, abs=0.3)
        else:
            assert only(found, "scale_error").value == pytest.approx(6.0, abs=1.0)


def test_few_targets_are_asked_for_the_line_and_the_mean_backlash_only() -> None:
    plan = RunPlan(targets=4, interval=80.0, random_part=4.0)
    axis = replace(with_geometry(COLD, straight_line_um_per_m=30.0, reversal=-4.0), plan=plan)
    test = step_of_backlash(measured(axis, 4), 2)
    assert set(keys(without_drift_model(test))) <= {"scale_error", "backlash"}
    assert "scale_error" in keys(without_drift_model(test))
    assert (
        without_drift_model(
            replace(
                test,
                target=test.target[:2],
                deviation=test.deviation[:2],
                time_source=TimeSource.NONE,
                time_s=None,
                order=None,
            )
        )
        == ()
    )


def test_one_cycle_is_judged_by_how_smoothly_the_axis_runs() -> None:
    axis = replace(
        COLD,
        plan=RunPlan(targets=21, interval=100.0, random_part=20.0, cycles=1),
        geometry=AxisGeometry(straight_line_um_per_m=20.0, reversal=-6.0, pitch_error=0.5),
    )
    found = without_drift_model(measured(axis, 4, cycles=1))
    assert keys(found) == ["scale_error", "backlash"]


def test_readings_without_scatter_are_diagnosed_all_the_same() -> None:
    target = np.arange(12.0) * 23.0
    deviation = np.repeat((0.03 * target)[:, None, None], 5, axis=1) + np.array([-2.0, 2.0])
    found = without_drift_model(run(deviation, target))
    assert keys(found) == ["scale_error", "backlash"]  # the line of least squares, and the mean
    assert found[0].value == pytest.approx(30.0)
    assert found[1].value == pytest.approx(-4.0)
    dust = run(1.7 * deviation, target)  # means of equal readings differ from them by rounding
    assert keys(without_drift_model(dust)) == ["scale_error", "backlash"]


# ---- drift and temperature ----------------------------------------------------------------------


def test_a_drift_that_turns_back_is_told_after_the_faults_of_the_axis() -> None:
    found = with_drift_model(paper_x_axis().test)
    assert keys(found)[-1] == "drift_reversal"
    assert "reverses its direction" in text(found[-1])
    assert "drift_reversal" not in keys(with_drift_model(measured(HEALTHY, 0, cycles=30)))


def screw_temperature(test: PositioningTest, lead_s: float) -> np.ndarray:
    """Return a temperature that the structure's drift follows after a while."""
    warm = 2.0 * -np.expm1(-(test.time_s + lead_s) / 1800.0)
    return 22.0 + warm + 0.01 * np.random.default_rng(1).standard_normal(warm.shape)


STRUCTURE_ONLY = replace(
    HEALTHY, geometry=AxisGeometry(), thermal=AxisThermal(structure=(WarmUp(9.0, 1800.0),))
)


def test_a_temperature_that_runs_like_the_drift_is_named_with_its_gain() -> None:
    test = measured(STRUCTURE_ONLY, 3, cycles=25)
    test = replace(test, channels={"nut_temp": screw_temperature(test, 0.0)})
    found = only(with_drift_model(test), "temperature_channel")
    assert found.unit == "µm/K"
    assert found.value == pytest.approx(4.5, rel=0.1)
    assert "'nut_temp'" in text(found)
    order_alone = replace(test, time_source=TimeSource.ORDER, time_s=None)
    assert " min" not in text(only(with_drift_model(order_alone), "temperature_channel"))


def test_a_temperature_ahead_of_the_drift_is_named_with_its_lag() -> None:
    axis = replace(
        STRUCTURE_ONLY,
        thermal=AxisThermal(hall_swing_k=2.0, hall_sensitivity=2.0, hall_period_s=7200.0),
    )
    test = measured(axis, 3, cycles=40)
    ahead = 20.0 + np.sin(2.0 * np.pi * (test.time_s + 900.0) / 7200.0)
    found = only(with_drift_model(replace(test, channels={"hall_c": ahead})), "temperature_channel")
    delay = found.message.values["delay"]
    assert isinstance(delay, Message)
    assert delay.values == {"amount": pytest.approx(15.0, abs=2.5), "unit": "min"}


def test_temperatures_of_another_course_and_other_channels_are_not_named() -> None:
    test = measured(STRUCTURE_ONLY, 3, cycles=25)
    warm = screw_temperature(test, 0.0)
    wandering = np.cumsum(np.random.default_rng(5).standard_normal(test.time_s.size))
    channels = {
        "straight_c": 20.0 + test.time_s / 3600.0,
        "swing_temp": 20.0 + np.sin(2.0 * np.pi * test.time_s / 1500.0),
        "wandering_c": wandering.reshape(test.time_s.shape),
        "constant_c": np.full(test.time_s.shape, 20.0),
        "absent_c": np.full(test.time_s.shape, np.nan),
        "humidity_percent": warm,
    }
    assert "temperature_channel" not in keys(with_drift_model(replace(test, channels=channels)))
