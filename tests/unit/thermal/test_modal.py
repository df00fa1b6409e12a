"""The default estimator: exact where a record is, honest where it is not."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter

from benchmarks.virtual_thermal_test import ThermalTestPlan, generate_thermal_test
from tests.refusals import refused
from thermaxis.codes import Message
from thermaxis.thermal import (
    Experiment,
    ModalOptions,
    ModalPart,
    ModalResult,
    ThermalModel,
    modal,
    simulate_modal,
)
from thermaxis.thermal.modal import response_evidence

NAMES = ("spindle", "table")
TRUTH = ThermalModel(
    (
        ModalPart("spindle", 2.0, np.array([14.0, 26.0]), np.array([400.0, 3000.0])),
        ModalPart("table", -5.0, np.array([12.0, 20.0]), np.array([400.0, 3000.0])),
    )
)


def steps(rows: int, seed: int, inputs: int = 2, hold: int = 40) -> np.ndarray:
    """Return inputs that jump now and then."""
    rng = np.random.default_rng(seed)
    return 3.0 * np.repeat(rng.normal(size=(-(-rows // hold), inputs)), hold, axis=0)[:rows]


def exact(model: ThermalModel = TRUTH, seed: int = 3, step_s: float = 10.0) -> Experiment:
    u = steps(1440, seed)
    return Experiment(step_s, u, simulate_modal(model, step_s, u))


def virtual(seed: int = 1, step_s: float = 10.0, **plan: object) -> Experiment:
    test = generate_thermal_test(
        replace(ThermalTestPlan(hours=8.0, sample_time_s=step_s), **plan), seed
    )
    return Experiment(step_s, test.u_k, test.z_um)


@pytest.fixture(scope="module")
def cold() -> ModalResult:
    return modal([virtual()], input_names=NAMES)


def test_a_record_without_noise_gives_the_model_that_made_it():
    result = modal([exact()], input_names=NAMES)
    for found, true in zip(result.model.parts, TRUTH.parts, strict=True):
        assert found.direct_gain == pytest.approx(true.direct_gain, abs=5e-4)
        assert found.gains == pytest.approx(true.gains, rel=3e-4)
        assert found.time_constants_s == pytest.approx(true.time_constants_s, rel=3e-4)
    assert result.fit_percent == pytest.approx(100.0, abs=1e-2)
    assert result.validation.chosen == 2


def test_an_offset_and_a_free_start_do_not_disturb_an_exact_record():
    u = steps(1440, 4)
    starts = [np.array([3.0, -2.0]), np.array([1.0, 4.0])]
    y = simulate_modal(TRUTH, 10.0, u, starts) - 37.0
    result = modal([Experiment(10.0, u, y)], input_names=NAMES)
    assert [p.dc_gain for p in result.model.parts] == pytest.approx([42.0, 27.0], rel=1e-4)
    assert result.offsets_um == pytest.approx((-37.0,), abs=0.01)
    assert result.model.offset_um == 0.0


def test_a_delay_that_is_given_is_part_of_an_exact_model():
    late = ThermalModel(
        (replace(TRUTH.parts[0], delay_s=90.0), replace(TRUTH.parts[1], delay_s=30.0))
    )
    options = ModalOptions(delays_s=(90.0, 30.0))
    result = modal([exact(late)], input_names=NAMES, options=options)
    for found, true in zip(result.model.parts, late.parts, strict=True):
        assert found.time_constants_s == pytest.approx(true.time_constants_s, rel=1e-4)
        assert found.delay_s == true.delay_s


@pytest.mark.proof
def test_missing_rows_leave_an_exact_record_exact_and_a_long_gap_in_an_input_cuts_it():
    whole = exact()
    y, u = whole.y.copy(), whole.u.copy()
    y[np.random.default_rng(5).random(y.size) < 0.3] = np.nan
    # Inside a hold a missing input is what its neighbours are.
    u[10:15, 0], u[1210:1230, 1] = np.nan, np.nan
    result = modal([Experiment(10.0, u, y)], input_names=NAMES)
    assert [p.dc_gain for p in result.model.parts] == pytest.approx([42.0, 27.0], rel=1e-4)
    u[1000:1300, 0] = np.nan
    experiment = Experiment(10.0, u, whole.y)
    assert len(response_evidence([experiment]).segments) == 2
    result = modal([experiment], input_names=NAMES)
    assert [p.dc_gain for p in result.model.parts] == pytest.approx([42.0, 27.0], rel=1e-3)


def test_a_displacement_that_is_seen_now_and_then_is_used_where_it_is():
    whole = exact()
    y = np.full(whole.y.size, np.nan)
    y[::60] = whole.y[::60]
    result = modal([Experiment(10.0, whole.u, y)], input_names=NAMES)
    assert [p.dc_gain for p in result.model.parts] == pytest.approx([42.0, 27.0], rel=1e-2)


@pytest.mark.proof
def test_experiments_at_different_sample_times_join_in_any_order():
    both = [exact(seed=6), exact(seed=7, step_s=20.0)]
    for parts in (both, both[::-1]):
        result = modal(parts, input_names=NAMES, options=ModalOptions(block_s=180.0))
        assert [p.dc_gain for p in result.model.parts] == pytest.approx([42.0, 27.0], rel=1e-4)


def test_one_input_is_enough():
    u = steps(2000, 8, inputs=1)
    model = ThermalModel((ModalPart("spindle", 0.0, np.array([20.0]), np.array([1500.0])),))
    y = simulate_modal(model, 10.0, u)
    y += np.random.default_rng(1).normal(0.0, 0.1, y.size)
    result = modal([Experiment(10.0, u, y)], input_names=("spindle",))
    assert result.model.parts[0].dc_gain == pytest.approx(20.0, abs=0.2)
    assert result.noise_std_um == pytest.approx(0.1, rel=0.3)


@pytest.mark.proof
def test_units_scale_the_gains_and_an_offset_and_the_order_of_inputs_do_not_matter(cold):
    e = virtual()
    u = (e.u * np.array([1.0, 1e3]))[:, ::-1]
    other = modal([Experiment(10.0, u, (e.y + 500.0) / 25.4)], input_names=NAMES[::-1])
    for a, b, unit in zip(cold.model.parts, other.model.parts[::-1], (1.0, 1e3), strict=True):
        assert a.input_name == b.input_name
        assert b.dc_gain * 25.4 * unit == pytest.approx(a.dc_gain, rel=1e-3)
    assert other.fit_percent == pytest.approx(cold.fit_percent, abs=1e-3)
    assert 25.4 * other.offsets_um[0] - cold.offsets_um[0] == pytest.approx(500.0, abs=0.01)


def test_another_clock_scales_the_time_constants_of_an_exact_record():
    slow = exact()
    fast = Experiment(1.0, slow.u, slow.y)
    result = modal([fast], input_names=NAMES)
    assert result.model.parts[0].time_constants_s == pytest.approx([40.0, 300.0], rel=1e-4)


def test_a_cold_test_of_eight_hours_is_simulated_well_on_another_one(cold):
    other = generate_thermal_test(ThermalTestPlan(hours=8.0, sample_time_s=10.0), 5001)
    simulated = simulate_modal(cold.model, 10.0, other.u_k)
    spread = np.linalg.norm(other.clean_um - np.mean(other.clean_um))
    fit = 100.0 * (1.0 - np.linalg.norm(other.clean_um - simulated) / spread)
    assert fit > 92.0
    assert cold.stable
    assert all(np.all(p.time_constants_s > 0) for p in cold.model.parts)
    assert 0.4 < cold.slow_noise_std_um < 1.5
    assert cold.slow_noise_correlation_s > 1000.0


def test_a_time_constant_beyond_a_third_of_the_record_has_a_flag_and_no_interval(cold):
    for part, std in zip(cold.model.parts, cold.std, strict=True):
        for tau_s, known in zip(part.time_constants_s, std.time_constants_s, strict=True):
            if tau_s > 8.0 * 3600.0 / 3.0:
                assert known is None
                assert Message("flag-time_constant", {"time_constant_s": tau_s}) in std.flags
        assert np.max(part.time_constants_s) <= 0.8 * 8.0 * 3600.0


def test_one_lag_explains_a_record_of_two_as_well_as_one_lag_can():
    """By a search over the time constant with plain least squares."""
    record = virtual(3)
    result = modal([record], input_names=NAMES, options=ModalOptions(most_lags=1))
    best = 0.0
    for tau_s in np.geomspace(300.0, 6000.0, 40):
        parts = [(1.0, 0.0), (0.0, 1.0)]
        columns = [
            simulate_modal(
                ThermalModel(
                    tuple(
                        ModalPart(n, d * w, np.array([g * w]), np.array([tau_s]))
                        for n, w in zip(NAMES, which, strict=True)
                    )
                ),
                10.0,
                record.u,
            )
            for which in parts
            for d, g in ((1.0, 0.0), (0.0, 1.0))
        ]
        table = np.column_stack([*columns, np.ones(record.y.size)])
        left = record.y - table @ np.linalg.lstsq(table, record.y, rcond=None)[0]
        best = max(
            best, 100.0 * (1.0 - np.linalg.norm(left) / np.linalg.norm(record.y - record.y.mean()))
        )
    assert best - 8.0 < result.fit_percent < best + 0.5


def test_the_level_of_a_long_hot_stretch_is_heat_and_not_the_zero_of_the_log():
    """Heat that comes in the first rows and stays: only the zero of the log tells its level."""
    rng = np.random.default_rng(5)
    u = np.where(np.arange(1440) < 3, 0.0, 60.0 + np.repeat(rng.normal(size=36), 40))[:, None]
    truth = ThermalModel((ModalPart("bed", 0.0, np.array([1.5]), np.array([500.0])),))
    drift = lfilter([0.3], [1.0, -0.98], rng.normal(size=1440))
    y = simulate_modal(truth, 15.0, u) + drift - drift[:4].mean() + rng.normal(size=1440)
    result = modal([Experiment(15.0, u, y)], input_names=("bed",))
    assert result.model.parts[0].dc_gain == pytest.approx(1.5, abs=0.1)
    assert abs(result.offsets_um[0]) < 5.0
    assert Message("warning-no_steady_start") not in result.warnings


def test_a_warm_test_alone_says_what_it_cannot_show():
    result = modal([virtual(1, warm_up_h=5.0)], input_names=NAMES)
    assert any(result.flags)
    assert result.warnings == (Message("warning-dc_gains_not_supported"),)


@pytest.mark.proof
def test_a_warm_test_beside_a_cold_one_does_not_spoil_what_the_cold_one_knows():
    # Tests whose warm part began far from any steady state: its transients are large and opposed.
    cold, warm = virtual(9), virtual(2009, warm_up_h=5.0)
    other = generate_thermal_test(ThermalTestPlan(hours=8.0, sample_time_s=10.0), 5009)
    result = modal([cold, warm], input_names=NAMES)
    at_rest = [np.zeros(part.gains.size) for part in result.model.parts]
    simulated = simulate_modal(result.model, 10.0, other.u_k, at_rest)
    spread = np.linalg.norm(other.clean_um - np.mean(other.clean_um))
    assert np.linalg.norm(other.clean_um - simulated) < 0.04 * spread


def test_an_input_that_did_not_move_has_no_dc_gain():
    e = virtual()
    idle = np.column_stack([e.u[:, 0], np.random.default_rng(0).normal(0.0, 0.02, e.y.size)])
    result = modal([Experiment(10.0, idle, e.y)], input_names=NAMES)
    assert result.std[1].dc_gain is None
    assert Message("flag-dc_gain") in result.std[1].flags


@pytest.mark.proof
def test_white_noise_alone_is_covered_by_the_intervals():
    scaled = []
    u = steps(1440, 9)
    clean = simulate_modal(TRUTH, 20.0, u)
    for seed in range(4):
        y = clean + np.random.default_rng(seed).normal(0.0, 1.0, clean.size)
        result = modal([Experiment(20.0, u, y)], input_names=NAMES)
        for part, std, true in zip(result.model.parts, result.std, TRUTH.parts, strict=True):
            assert std.dc_gain is not None
            scaled.append((part.dc_gain - true.dc_gain) / std.dc_gain)
    assert np.sqrt(np.mean(np.square(scaled))) < 1.5
    assert np.mean(np.abs(scaled) < 1.96) >= 0.85


@pytest.mark.proof
def test_a_number_of_lags_and_a_steady_start_may_be_asked_for():
    result = modal([exact()], input_names=NAMES, options=ModalOptions(most_lags=1))
    assert result.model.parts[0].gains.size == 1
    result = modal([exact()], input_names=NAMES, options=ModalOptions(steady_start=True))
    assert [p.dc_gain for p in result.model.parts] == pytest.approx([42.0, 27.0], rel=1e-5)


def test_options_names_and_records_that_cannot_be_are_refused():
    for says, options in (
        ("outside_range", {"most_lags": 9}),
        ("lags_too_close", {"time_constants_s": ((600.0, 700.0), (600.0,))}),
        ("lags_not_possible", {"time_constants_s": ((600.0,), ())}),
        ("not_a_time", {"delays_s": (-1.0, 0.0)}),
        ("not_a_time", {"block_s": 0.0}),
    ):
        with refused(says):
            ModalOptions(**options)
    with refused("count_not_inputs", key="delays_s"):
        modal([exact()], input_names=NAMES, options=ModalOptions(delays_s=(90.0,)))
    with refused("count_not_inputs", key="input_names"):
        modal([exact()], input_names=("spindle",))
    with refused("displacement_constant"):
        modal([Experiment(10.0, steps(200, 1), np.ones(200))], input_names=NAMES)


def test_evidence_of_a_record_with_ramps_is_that_of_the_record_made_with_them() -> None:
    rng = np.random.default_rng(11)
    u = np.cumsum(rng.normal(0.0, 0.1, (900, 2)), axis=0)
    y = 3.0 * u[:, 0] + rng.normal(0.0, 0.3, 900)
    record = Experiment(20.0, u, y)
    found = response_evidence([record], lasting_drift=False)
    added = np.array([[0.0, 0.0, 0.0], [2.0, -1.0, 0.0], [0.5, 0.0, 4.0]])
    ramp = np.linspace(0.0, 1.0, 900)
    made = [
        found.log_evidence([Experiment(20.0, u + np.outer(ramp, row[:2]), y + ramp * row[2])])
        for row in added
    ]
    np.testing.assert_allclose(found.with_ramps(record, added), made, rtol=1e-6)
