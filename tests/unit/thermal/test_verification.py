"""Verification simulates with the cycle, and its figures are those of the paper."""

from dataclasses import replace

import numpy as np
import pytest

from tests.refusals import refused
from thermaxis.compensation import (
    CompensationModel,
    GainPoint,
    Limits,
    Outcome,
    Output,
    Part,
    Quality,
    Reading,
    Section,
    initial_state,
    model_step,
)
from thermaxis.thermal import (
    LogStart,
    MeasuredOutput,
    ModalPart,
    ThermalLog,
    ThermalModel,
    left_over_messages,
    simulate_log,
    simulate_modal,
    verify,
)

PARTS = (
    Part("spindle", "T_spindle_C", "T_column_C", 3.0, (Section(26.0, 3000.0),)),
    Part("table", "T_table_C", "T_column_C", 0.0, (Section(12.0, 1500.0), Section(20.0, 9000.0)),
         gain_by_diameter=(GainPoint(0.0, 1.0), GainPoint(3000.0, 2.2))),
)  # fmt: skip
MODEL = CompensationModel(outputs=(Output("Z_um", PARTS),))


def log(seed: int = 1, rows: int = 400, step_s: float = 60.0, noise_um: float = 0.0) -> ThermalLog:
    random = np.random.default_rng(seed)
    names = ("T_spindle_C", "T_table_C", "T_column_C")
    warm = {n: 20.0 + np.cumsum(random.normal(0.02, 0.1, rows)) for n in names}
    u = np.stack(
        [warm["T_spindle_C"] - warm["T_column_C"], warm["T_table_C"] - warm["T_column_C"]], axis=1
    )
    first = u[:2].mean(axis=0)  # the first minute: two rows
    z = vectorised(u - first, step_s)
    columns = {
        **warm,
        "Z_um": 7.0 + z + random.normal(0.0, noise_um, rows),
        "n_rpm": np.full(rows, 500.0),
    }
    return ThermalLog.from_columns(columns, sample_time_s=step_s, name=f"test {seed}")


def vectorised(u: np.ndarray, step_s: float, gain: float = 1.0) -> np.ndarray:
    spindle = ModalPart("spindle", 3.0, np.array([26.0]), np.array([3000.0]))
    table = ModalPart("table", 0.0, gain * np.array([12.0, 20.0]), np.array([1500.0, 9000.0]))
    at_rest = [np.zeros(1), np.zeros(2)]
    return simulate_modal(ThermalModel((spindle, table)), step_s, u, at_rest)


def test_the_free_run_equals_the_vectorised_simulation() -> None:
    record = log(seed=2)
    run = simulate_log(MODEL, record, diameter_mm=3000.0)
    u = np.stack(
        [record.column(c) - record.column("T_column_C") for c in ("T_spindle_C", "T_table_C")],
        axis=1,
    )
    expected = vectorised(u - u[:2].mean(axis=0), 60.0, gain=2.2)
    assert np.max(np.abs(run.outputs["Z_um"].displacement_um - expected)) < 1e-9
    assert np.allclose(run.outputs["Z_um"].contribution_um.sum(axis=1), expected)


HOSTILE = ("lost", "lost at first", "lost over a gap", "torn")


@pytest.mark.parametrize("case", ["even", "uneven", "delay", "part of a row", "gap", *HOSTILE])
def test_the_free_run_is_the_step_of_the_cycle_on_every_row(case: str) -> None:
    """The laws of held inputs hold in both: no row, no outcome and no start differs."""
    random = np.random.default_rng(11)
    record, delay_s = log(seed=3, rows=300), {"delay": 180.0, "part of a row": 90.0}.get(case, 0.0)
    time_s = 60.0 * np.arange(300)
    if case == "uneven":
        time_s = np.cumsum(random.uniform(1.0, 120.0, 300))
    if case in {"gap", "lost over a gap", "torn"}:
        time_s[150:] += 2e4
    columns = {name: np.array(values) for name, values in record.columns.items()}
    if case == "lost":
        columns["T_spindle_C"][120:130] = np.nan
    if case == "lost at first":
        columns["T_table_C"][:40] = np.nan
        columns["T_column_C"][41:43] = 1e7
    if case == "lost over a gap":
        columns["T_spindle_C"][148:160] = np.nan
    if case == "torn":
        time_s += np.cumsum(random.choice([0.0, 1.0, 9000.0], 300, p=[0.9, 0.08, 0.02]))
        for name in ("T_spindle_C", "T_column_C"):
            columns[name][random.random(300) < 0.4] = np.nan
    record = ThermalLog.from_columns(columns, time_s=time_s, name=case)
    parts = tuple(replace(p, delay_s=delay_s, lowest_k=-1.0, highest_k=2.0) for p in PARTS)
    outputs = (Output("Z_um", parts, 5.0), Output("Y_um", parts[:1]))
    model = CompensationModel(outputs=outputs, input_filter_s=45.0, longest_hold_s=120.0)
    first_s = time_s <= 60.0 + time_s[0]
    means = {c: record.start_of(columns[c]) for c in model.channels}
    reference = {c: mean for c, mean in means.items() if not np.all(np.isnan(columns[c][first_s]))}
    state, said = initial_state(model, reference), []
    outcomes: dict[Outcome, int] = {}
    waiting: list[bool] = []
    bad: list[bool] = []
    for k, now_s in enumerate(record.time_s):
        values = {c: float(columns[c][k]) for c in model.channels}
        state, output = model_step(model, state, Reading(float(now_s), values, 4000.0))
        said.append((*output.model_um, *output.contribution_um[0]))
        waiting.append(state.time_s is None)
        bad.append(output.quality is Quality.BAD)
        for outcome in output.outcomes:
            outcomes[outcome] = outcomes.get(outcome, 0) + 1
    run = simulate_log(model, record, diameter_mm=4000.0)
    z, y = run.outputs["Z_um"], run.outputs["Y_um"]
    found = np.column_stack([z.displacement_um, y.displacement_um, z.contribution_um])
    told = np.where(np.array(waiting)[:, None] & [1, 1, 0, 0], np.nan, said)
    np.testing.assert_allclose(found, told, atol=1e-10)
    assert run.outcomes == outcomes
    assert run.bad.tolist() == bad
    assert outcomes[Outcome.OUTSIDE_VALIDITY] > 10
    assert outcomes[Outcome.DIAMETER_HELD] == waiting.count(False)
    assert case not in HOSTILE or Outcome.INPUT_FAILED in outcomes
    assert case not in HOSTILE[1:] or Outcome.WAITING in outcomes


def test_figures_are_those_of_equation_4_and_of_the_definitions() -> None:
    record = log(seed=3, noise_um=2.0)
    output = verify(MODEL, [record]).logs[0].outputs[0]
    y = record.column("Z_um") - record.column("Z_um")[:2].mean()
    e = output.residual_um
    figures = output.figures
    assert figures.fit_percent == pytest.approx(
        100.0 * (1.0 - np.sqrt(np.sum(e**2)) / np.sqrt(np.sum((y - y.mean()) ** 2)))
    )
    assert figures.uncompensated_um == pytest.approx(y.max() - y.min())
    assert figures.residual_um == pytest.approx(e.max() - e.min())
    assert figures.rmse_um == pytest.approx(np.sqrt(np.mean(e**2)))
    assert (figures.mae_um, figures.max_um) == pytest.approx((np.abs(e).mean(), np.abs(e).max()))
    assert figures.after_60_min_um == pytest.approx((y[60], e[60]))
    assert figures.at_end_um == pytest.approx((y[-1], e[-1]))
    assert figures.persistence_rmse_um == pytest.approx(np.sqrt(np.mean(np.diff(y) ** 2)))
    assert figures.static_rmse_um is not None
    assert figures.static_rmse_um > figures.rmse_um


def test_a_true_model_leaves_nothing_of_an_output_that_is_seen_rarely() -> None:
    record = log(seed=4)
    z = np.full(record.rows, np.nan)
    z[37::50] = record.column("Z_um")[37::50]
    rare = ThermalLog.from_columns({**record.columns, "Z_um": z}, time_s=record.time_s)
    figures = verify(MODEL, [rare]).pooled["Z_um"]
    assert figures.rows == len(range(37, record.rows, 50))
    assert figures.fit_percent == pytest.approx(100.0, abs=1e-6)
    assert figures.rmse_um < 1e-9
    assert figures.reduction > 1e6


def test_several_outputs_at_diameters_give_table_3_with_its_mean() -> None:
    record = log(seed=5)
    u = np.stack(
        [record.column(c) - record.column("T_column_C") for c in ("T_spindle_C", "T_table_C")],
        axis=1,
    )
    wide = vectorised(u - u[:2].mean(axis=0), 60.0, gain=2.2)
    both = ThermalLog.from_columns({**record.columns, "Z_D3000_um": wide}, time_s=record.time_s)
    measured = [MeasuredOutput("Z_um", "Z_um"), MeasuredOutput("Z_D3000_um", "Z_um", 3000.0)]
    result = verify(MODEL, [both], measured)
    assert list(result.pooled) == ["Z_um", "Z_D3000_um"]
    assert result.mean_fit_percent == pytest.approx(100.0, abs=1e-6)


def test_an_input_that_a_model_does_not_explain_is_named_at_its_lag_and_no_other() -> None:
    test = log(3, rows=1200, noise_um=0.3)
    (said,) = left_over_messages(verify(MODEL, [test]))
    assert said.code in {"residual-white", "residual-slow"}
    late = np.concatenate([np.zeros(24), test.columns["T_table_C"][:-24] - 20.0])
    columns = {**test.columns, "Z_um": test.columns["Z_um"] + 2.0 * late}
    other = ThermalLog.from_columns(columns, sample_time_s=60.0, name="late")
    _, said = left_over_messages(verify(MODEL, [other], start=LogStart.REST))
    assert (said.code, said.values["name"]) == ("residual-input", "table")
    assert said.values["from_min"] == pytest.approx(24.0, abs=3.0)
    (refused_,) = left_over_messages(verify(MODEL, [test.span(0, 30)]))
    assert refused_.code == "residual-few_rows"


def test_logs_are_pooled_about_their_own_means() -> None:
    records = [log(seed=6, noise_um=1.0), log(seed=7, noise_um=1.0, rows=200)]
    result = verify(MODEL, records)
    e = np.concatenate([o.outputs[0].residual_um for o in result.logs])
    y = [o.outputs[0].measured_um for o in result.logs]
    spread = np.sqrt(sum(np.sum((v - v.mean()) ** 2) for v in y))
    pooled = result.pooled["Z_um"]
    assert pooled.fit_percent == pytest.approx(100.0 * (1.0 - np.linalg.norm(e) / spread))
    assert pooled.rows == 600


def test_rows_that_count_do_not_change_the_free_run() -> None:
    record = log(seed=8, noise_um=1.0)
    whole, part = verify(MODEL, [record]), verify(MODEL, [record], rows=(300, 400))
    a, b = whole.logs[0].outputs[0], part.logs[0].outputs[0]
    assert np.array_equal(a.simulated_um, b.simulated_um)
    assert b.figures.rmse_um == pytest.approx(np.sqrt(np.mean(a.residual_um[300:400] ** 2)))


def test_a_log_outside_the_range_of_the_training_is_named() -> None:
    part = Part("spindle", "T_spindle_C", "", 3.0, (), lowest_k=-0.1, highest_k=0.1)
    narrow = CompensationModel(outputs=(Output("Z_um", (part,)),))
    result = verify(narrow, [log(seed=9)])
    codes = [(w.code, w.values.get("name")) for w in result.warnings]
    assert ("remark-outside_training", "spindle") in codes
    assert "spindle" in result.logs[0].outside


def test_a_log_at_standstill_is_an_environmental_test() -> None:
    record = log(seed=10)
    still = ThermalLog.from_columns(
        {**record.columns, "n_rpm": np.zeros(record.rows)}, time_s=record.time_s
    )
    assert verify(MODEL, [still]).logs[0].environmental
    assert not verify(MODEL, [record]).logs[0].environmental


def test_a_constant_output_has_no_fit_and_says_the_rest() -> None:
    record = log(seed=11)
    flat = ThermalLog.from_columns(
        {**record.columns, "Z_um": np.full(record.rows, 5.0)}, time_s=record.time_s
    )
    figures = verify(MODEL, [flat]).pooled["Z_um"]
    assert figures.fit_percent is None
    assert figures.rmse_um > 0


def test_what_cannot_be_compared_is_refused_in_words() -> None:
    record = log()
    with refused("no_log", key="logs"):
        verify(MODEL, [])
    with refused("unknown_column", file="test 1"):
        verify(MODEL, [record.select(["Z_um", "T_spindle_C", "T_column_C"])])
    with refused("no_output_column", file="test 1"):
        verify(MODEL, [record.select(["T_table_C", "T_spindle_C", "T_column_C"])])
    with refused("unknown_name", key="measured", channel="Z_um"):
        verify(MODEL, [record], [MeasuredOutput("Z_um", "X_um")])


@pytest.mark.parametrize("reference", ["start", "stated"])
def test_logs_in_kelvin_and_fahrenheit_give_the_figures_of_those_in_celsius(reference: str) -> None:
    time_s = np.arange(0.0, 9000.0, 60.0)
    t = 20.0 + 5.0 * (1.0 - np.exp(-time_s / 1500.0))
    part = Part("spindle", "T", "", 3.0, (Section(8.0, 900.0),), lowest_k=-0.5, highest_k=6.0)
    model = CompensationModel(
        outputs=(Output("Z_um", (part,)),), reference=reference, reference_c={"T": 20.0}
    )
    figures = []
    for unit, values in (("degC", t), ("K", t + 273.15), ("degF", t * 1.8 + 32.0)):
        columns = {"T": values, "Z_um": 4.0 * (t - 20.0)}
        record = ThermalLog.from_columns(columns, time_s=time_s, units={"T": unit})
        result = verify(model, [record], start=LogStart.REST)
        assert not result.warnings
        figures.append(result.pooled["Z_um"].rmse_um)
    assert figures == pytest.approx([figures[0]] * 3)


def test_a_value_hours_later_is_not_that_after_60_minutes() -> None:
    record = log(seed=13)
    z = np.array(record.column("Z_um"))
    z[3:200] = np.nan
    late = ThermalLog.from_columns({**record.columns, "Z_um": z}, time_s=record.time_s)
    assert verify(MODEL, [late]).pooled["Z_um"].after_60_min_um is None


def test_limits_stand_beside_the_free_run_and_do_what_they_say() -> None:
    record = log(seed=12)
    wide = verify(MODEL, [record], limits={"Z_um": Limits(9000.0, 900.0)})
    narrow = verify(MODEL, [record], limits={"Z_um": Limits(5.0, 900.0)})
    free = wide.logs[0].outputs[0]
    assert free.limited is not None
    # the correction begins at zero: the first row, and with it the datum, is a little off
    assert free.limited.rmse_um == pytest.approx(free.figures.rmse_um, abs=0.2)
    limited = narrow.logs[0].outputs[0]
    assert limited.limited is not None
    expected = free.measured_um - np.clip(free.simulated_um, -5.0, 5.0)
    assert limited.limited.rmse_um == pytest.approx(np.sqrt(np.mean(expected**2)), rel=1e-2)
    assert verify(MODEL, [record]).logs[0].outputs[0].limited is None


def test_a_slow_rate_lags_by_what_the_rate_cannot_follow() -> None:
    time_s = np.arange(0.0, 6000.0, 60.0)
    ramp = np.where(time_s > 60.0, 1.0, 0.0)
    part = Part("spindle", "T_C", "", 10.0)
    model = CompensationModel(outputs=(Output("Z_um", (part,)),))
    record = ThermalLog.from_columns({"T_C": 20.0 + ramp, "Z_um": 10.0 * ramp}, time_s=time_s)
    figures = (
        verify(model, [record], limits={"Z_um": Limits(50.0, 0.01)}).logs[0].outputs[0].limited
    )
    steps = np.minimum(10.0, np.cumsum(np.where(ramp > 0, 0.6, 0.0)))
    assert figures is not None
    assert figures.rmse_um == pytest.approx(np.sqrt(np.mean((10.0 * ramp - steps) ** 2)))


def test_the_magnitude_and_not_the_total_bounds_what_the_model_may_take_away() -> None:
    time_s = np.arange(0.0, 1800.0, 10.0)
    rise_k = np.where(time_s > 300.0, 3.0, 0.0)
    model = CompensationModel(outputs=(Output("Z_um", (Part("spindle", "T_C", "", 10.0),)),))
    columns = {"T_C": 20.0 + rise_k, "Z_um": 10.0 * rise_k}
    record = ThermalLog.from_columns(columns, time_s=time_s)
    limits = {"Z_um": Limits(10.0, 900.0, total_um=20.0)}
    result = verify(model, [record], limits=limits)
    limited = result.logs[0].outputs[0].limited
    assert limited is not None
    assert limited.at_end_um == pytest.approx((30.0, 20.0))
    assert result.pooled["Z_um"].rmse_um == pytest.approx(0.0, abs=1e-9)
    # after 600 s at the limit, and again
    (warning,) = result.warnings
    assert (warning.code, warning.values) == ("remark-limits_too_narrow", {"count": 2})


def test_a_model_outside_its_training_loses_its_weight_with_limits_and_not_without() -> None:
    time_s = np.arange(0.0, 600.0, 10.0)
    rise_k = np.where(time_s > 100.0, 4.5, 0.0)
    part = Part("spindle", "T_C", "", 10.0, lowest_k=0.0, highest_k=2.0)
    model = CompensationModel(outputs=(Output("Z_um", (part,)),))
    record = ThermalLog.from_columns({"T_C": 20.0 + rise_k, "Z_um": 10.0 * rise_k}, time_s=time_s)
    result = verify(model, [record], limits={"Z_um": Limits(900.0, 900.0)})
    assert result.pooled["Z_um"].max_um == pytest.approx(0.0, abs=1e-9)
    limited = result.logs[0].outputs[0].limited
    assert limited is not None
    assert limited.at_end_um == pytest.approx((45.0, 0.5 * 45.0))


def test_rows_that_are_minutes_apart_are_several_cycles_each() -> None:
    time_s = np.arange(0.0, 6000.0, 300.0)
    rise_k = np.where(time_s > 0.0, 1.0, 0.0)
    model = CompensationModel(outputs=(Output("Z_um", (Part("spindle", "T_C", "", 10.0),)),))
    record = ThermalLog.from_columns({"T_C": 20.0 + rise_k, "Z_um": 10.0 * rise_k}, time_s=time_s)
    limited = (
        verify(model, [record], limits={"Z_um": Limits(50.0, 0.005)}).logs[0].outputs[0].limited
    )
    assert limited is not None
    # the row at 300 s is the first that is warm; from then on 1.5 um in every row
    left = 10.0 * rise_k - np.minimum(10.0, np.maximum(0.0, 0.005 * (time_s - 240.0) * rise_k))
    assert limited.rmse_um == pytest.approx(np.sqrt(np.mean(left**2)), rel=1e-3)


PART = Part("spindle", "T", "", 2.0, (Section(8.0, 900.0), Section(12.0, 5000.0)))
TWO_LAGS = CompensationModel(outputs=(Output("Z_um", (PART,)),))


def began(states_k: tuple[float, float], first_c: float = 20.0) -> ThermalLog:
    """Return a log whose lags began in given states, by their closed form on a step."""
    random = np.random.default_rng(3)
    time_s = np.arange(0.0, 6 * 3600.0, 30.0)
    t = np.where((time_s >= 3600.0) & (time_s < 3.5 * 3600.0), 26.0, 20.0)
    t[0] = first_c
    y = 2.0 * (t - 20.0) + random.normal(0.0, 0.3, time_s.size)
    for section, start_k in zip(PART.sections, states_k, strict=True):
        tau_s = section.time_constant_s
        on, off = (np.maximum(time_s - edge_s, 0.0) for edge_s in (3600.0, 3.5 * 3600.0))
        heated = 6.0 * (np.exp(-off / tau_s) - np.exp(-on / tau_s))
        y += section.gain_um_per_k * (heated + start_k * np.exp(-time_s / tau_s))
    return ThermalLog.from_columns({"T": t, "Z_um": y}, time_s=time_s, units={"T": "degC"})


def test_a_log_that_began_at_rest_is_run_from_rest() -> None:
    (output,) = verify(TWO_LAGS, [began((0.0, 0.0))]).logs[0].outputs
    assert output.start.start is LogStart.REST
    assert output.figures.rmse_um == pytest.approx(0.3, rel=0.3)


def test_a_log_that_began_warm_gets_the_states_that_it_had_and_says_so() -> None:
    log = began((3.0, 5.0))
    result = verify(TWO_LAGS, [log])
    (output,) = result.logs[0].outputs
    assert output.start.start is LogStart.FITTED
    assert output.start.states_k == pytest.approx([3.0, 5.0], abs=0.3)
    assert output.start.zero_um == pytest.approx(0.0, abs=0.6)
    assert output.figures.rmse_um == pytest.approx(0.3, rel=0.1)
    assert "remark-start_fitted" in [w.code for w in result.warnings]
    slightly = verify(TWO_LAGS, [began((0.05, 0.05))])
    assert slightly.logs[0].outputs[0].start.start is LogStart.FITTED
    assert slightly.warnings == ()  # 0.4 um of 60 um say nothing of the machine
    parts = output.contribution_um.sum(axis=1) + output.start.zero_um
    assert parts == pytest.approx(output.simulated_um, abs=1e-9)
    (asked,) = verify(TWO_LAGS, [log], start=LogStart.REST).logs[0].outputs
    assert asked.figures.rmse_um > 20.0


def test_a_fitted_start_sees_no_row_that_counts() -> None:
    log = began((3.0, 5.0))
    spoilt = np.array(log.columns["Z_um"])
    spoilt[400:] += np.linspace(0.0, 500.0, spoilt.size - 400)
    other = ThermalLog.from_columns(
        {"T": log.columns["T"], "Z_um": spoilt}, time_s=log.time_s, units={"T": "degC"}
    )
    starts = [verify(TWO_LAGS, [e], rows=(400, 700)).logs[0].outputs[0] for e in (log, other)]
    assert starts[0].start_rows == starts[1].start_rows == 400
    assert list(starts[0].start.states_k) == list(starts[1].start.states_k)
    assert starts[0].figures.rmse_um < 1.0


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("start", [None, *LogStart])
def test_an_input_that_is_missing_at_first_counts_from_its_first_value(
    start: LogStart | None,
) -> None:
    part = replace(PART, static_gain_um_per_k=15.0)
    model = CompensationModel(outputs=(Output("Z_um", (part,)),))
    log = began((0.0, 0.0))
    t = np.array(log.columns["T"])
    t[:5] = np.nan
    late = ThermalLog.from_columns({"T": t, "Z_um": log.columns["Z_um"]}, time_s=log.time_s)
    figures = [verify(model, [e], start=start).pooled["Z_um"] for e in (log, late)]
    assert figures[1].rmse_um == pytest.approx(figures[0].rmse_um, rel=0.1)
    assert figures[1].static_rmse_um == pytest.approx(figures[0].static_rmse_um, rel=0.05)
