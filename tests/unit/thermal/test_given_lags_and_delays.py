"""Time constants and dead times that are given or looked for, and the test to make next."""

import numpy as np
import pytest

from tests.refusals import refused
from tests.thermal_machines import Log, log
from thermaxis.thermal import (
    Experiment,
    InputDefinition,
    Method,
    ModalOptions,
    ModalPart,
    ThermalLog,
    ThermalModel,
    identify,
    modal,
    records_of,
    simulate_modal,
    verify,
)
from thermaxis.thermal.design import next_test
from thermaxis.thermal.modal import response_evidence
from thermaxis.thermal.modal._delays import likely_delays

pytestmark = pytest.mark.usefixtures("one_clock_and_regime")

NAMES = ("spindle", "table")
STEP_S = 30.0


def made_by(model: ThermalModel, noise_um: float = 0.05) -> Experiment:
    rng = np.random.default_rng(11)
    u = np.repeat(rng.normal(size=(48, 2)), 20, axis=0)
    u[:20] = 0.0
    y = simulate_modal(model, STEP_S, u, [np.zeros(part.gains.size) for part in model.parts])
    return Experiment(STEP_S, u, y + rng.normal(0.0, noise_um, y.size))


def experiment(test: Log) -> Experiment:
    return Experiment(test.step_s, test.u_k, test.z_um)


def test_given_lags_are_those_of_the_model_and_their_gains_come_back() -> None:
    truth = ThermalModel(
        (
            ModalPart("spindle", 2.0, [14.0, 26.0], [600.0, 3000.0]),
            ModalPart("table", -5.0, [12.0], [1200.0]),
        )
    )
    given = ((3000.0, 600.0), (1200.0,))
    options = ModalOptions(time_constants_s=given, most_lags=2)
    result = modal([made_by(truth)], input_names=NAMES, options=options)
    for found, std, true in zip(result.model.parts, result.std, truth.parts, strict=True):
        assert list(found.time_constants_s) == list(true.time_constants_s)
        assert std.time_constants_s == (None,) * found.gains.size
        assert found.gains == pytest.approx(true.gains, abs=0.3)
        assert std.dc_gain is not None
        assert abs(found.dc_gain - true.dc_gain) < 4.0 * std.dc_gain < 1.0
    asked = result.trials[-1]
    assert (asked.given, asked.chosen, asked.time_constants_s) == (True, True, (600, 1200, 3000))
    assert all(asked.log_evidence > other.log_evidence for other in result.trials[:-1])
    assert not result.warnings


def test_the_record_speaks_against_lags_that_are_not_the_machines() -> None:
    truth = ThermalModel(tuple(ModalPart(n, 1.0, [20.0], [1500.0]) for n in NAMES))
    options = ModalOptions(time_constants_s=((300.0,),) * 2, most_lags=2)
    result = modal([made_by(truth)], input_names=NAMES, options=options)
    assert [warning.code for warning in result.warnings] == ["warning-lags_against_record"]
    assert all(s.dc_gain is None and s.direct_gain is None for s in result.std)
    own = next(trial for trial in result.trials if len(trial.time_constants_s) == 1)
    assert own.time_constants_s[0] == pytest.approx(1500.0, rel=0.02)
    held_out = [trial.held_out_um for trial in (result.trials[-1], own)]
    assert held_out[0] > 10.0 * held_out[1]  # the given lags miss what the record shows
    assert held_out[1] < 0.1


def test_a_dead_time_is_the_mean_of_its_likelihood_and_none_where_its_interval_holds_none() -> None:
    """Of a normal likelihood counted to a third: mean, and 1.96 standard deviations about it."""
    for true, std in ((40.0, 4.0), (31.0, 6.0), (5.0, 3.0)):
        (late,), (ends,) = likely_delays(
            lambda d, t=true, s=std: -1.5 * ((d[0] - t) / s) ** 2, [0], [True], 90, 8
        )
        half = 1.96 * std
        assert ends == pytest.approx((max(true - half, 0.0), true, true + half), abs=1.1)
        assert late == (round(true) if true > half + 1.0 else 0)
    (late, given), ends = likely_delays(
        lambda d: float(min(d[0], 30)), [0, 7], [True, False], 60, 6
    )
    assert (given, ends[1]) == (7, None)  # from 30 rows on all are alike
    assert late == pytest.approx(43, abs=2)
    assert ends[0][::2] == (24, 60)


@pytest.mark.parametrize("given_s", [(0.1,), (29.0, 600.0), (360_000.0,)])
def test_lags_shorter_than_a_row_or_longer_than_the_log_are_refused(
    given_s: tuple[float, ...],
) -> None:
    record = Experiment(STEP_S, np.ones((960, 1)), np.arange(960.0))
    with refused("lags_not_possible", key="lags"):
        modal([record], input_names=["a"], options=ModalOptions(time_constants_s=(given_s,)))


def test_a_dead_time_is_found_with_its_interval_and_none_where_there_is_none() -> None:
    parts = (
        ModalPart("spindle", 3.0, [20.0], [1500.0], 480.0),
        ModalPart("table", 2.0, [9.0], [700.0]),
    )
    record = made_by(ThermalModel(parts))
    options = ModalOptions(delays_s=(None, None), most_lags=2)
    result = modal([record], input_names=NAMES, options=options)
    late, prompt = result.std
    assert result.model.parts[0].delay_s == pytest.approx(480.0, abs=STEP_S)
    assert late.delay_interval_s[0] <= 480.0 <= late.delay_interval_s[1]
    assert result.model.parts[1].delay_s == prompt.delay_interval_s[0] == 0.0
    (not_shown,) = (flag for flag in prompt.flags if flag.code == "flag-delay_not_shown")
    assert 0.0 <= not_shown.values["likeliest_s"] <= prompt.delay_interval_s[1]
    (given,) = (flag for flag in late.flags if "delay" in flag.code)
    assert given.code == "flag-gains_given_delay"
    assert given.values["used_s"] == result.model.parts[0].delay_s
    with refused("delay_beyond_record", key="delay"):
        modal([record], input_names=NAMES, options=ModalOptions(delays_s=(20_000.0, None)))


def test_a_given_delay_is_in_the_written_model_and_in_its_figures() -> None:
    parts = (ModalPart("a", 3.0, [20.0], [1500.0], 480.0), ModalPart("b", 2.0, [9.0], [1500.0]))
    record = made_by(ThermalModel(parts))
    columns = {"a_C": record.u[:, 0], "b_C": record.u[:, 1], "Z_um": record.y}
    test = ThermalLog.from_columns(columns, sample_time_s=STEP_S)
    inputs = [InputDefinition("a", "a_C"), InputDefinition("b", "b_C")]
    records = records_of([test], inputs, ["Z_um"])
    options = ModalOptions(delays_s=(480.0 + 0.3 * STEP_S, 0.0), most_lags=1)
    found = identify(records, modal_options=options)
    (said,) = (w for w in found.outputs[0].warnings if w.code == "warning-delay_rounded")
    assert said.values == {"input": "a", "given_s": 489.0, "used_s": 480.0}
    model = found.to_compensation_model(records)
    assert [part.delay_s for part in model.outputs[0].parts] == [480.0, 0.0]
    assert [part.delay_s for part in found.outputs[0].model.parts] == [480.0, 0.0]
    assert found.outputs[0].fit_percent > 98.0
    free_run = verify(model, [test]).pooled["Z_um"]
    assert free_run.fit_percent == pytest.approx(found.outputs[0].fit_percent)


def test_the_source_that_hardly_ran_is_the_one_to_run_and_what_it_tells_is_foreseen() -> None:
    rng = np.random.default_rng(5)
    switched = np.repeat(rng.random((24, 2)), 40, axis=0)
    first = experiment(log("coupled", 8.0, 1, step_s=STEP_S, heat=switched * [1.0, 0.1]))
    evidence = response_evidence([first])
    asked = next_test(evidence, NAMES, ("K", "K"))
    best = asked.tests[0]
    assert best.input == "table"
    assert best.own_um > 0.9 * asked.before_um
    assert asked.message.code == "next_test-no_interval"  # of the grid alone
    assert best.after_um < 0.3 * asked.before_um
    assert best.level_k < 0.2 * next(t.level_k for t in asked.tests if t.input == "spindle")
    # The same test, made: what the table does is known as well as was foreseen of all.
    rows = round(best.on_s / STEP_S)
    heat = np.zeros((2 * rows, 2))
    heat[:rows, 1] = 1.0
    second = experiment(log("coupled", 2 * best.on_s / 3600.0, 2, step_s=STEP_S, heat=heat))
    both = next_test(response_evidence([first, second]), NAMES, ("K", "K"))
    assert next(test for test in both.tests if test.input == "table").own_um < best.after_um


@pytest.mark.proof
def test_what_never_moved_is_named_and_a_hall_is_not_to_be_heated() -> None:
    truth = ThermalModel(tuple(ModalPart(n, 1.0, [9.0], [1500.0]) for n in NAMES))
    made = made_by(truth, 0.5)
    rng = np.random.default_rng(3)
    dead = 20.0 + rng.normal(0.0, 1e-3, made.y.size)
    columns = {"a_C": made.u[:, 0], "hall_C": made.u[:, 1], "dead_C": dead, "Z_um": made.y}
    test = ThermalLog.from_columns(columns, sample_time_s=STEP_S)
    inputs = [InputDefinition("a", "a_C"), InputDefinition("hall", "hall_C")]
    found = identify(records_of([test], inputs, ["Z_um"]))
    asked, std = found.outputs[0].next_test, found.outputs[0].posterior.dc_std
    assert "hall" in asked.not_asked
    half_um = 1.96 * std[0] * np.max(np.abs(made.u[:, 0] - made.u[0, 0]))
    assert asked.settled_um["a"] == pytest.approx(half_um, rel=0.2)
    with_dead = records_of([test], [*inputs, InputDefinition("dead", "dead_C")], ["Z_um"])
    asked = identify(with_dead).outputs[0].next_test
    assert asked.unmoved == ("dead",)
    assert asked.message.code == "next_test-unmoved"
    assert identify(with_dead, method=Method.STATIC).outputs[0].next_test is None
