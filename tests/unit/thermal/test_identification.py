"""What identification refuses, and that what it says of a model is what the model does."""

from collections.abc import Mapping

import numpy as np
import pytest
from numpy.typing import NDArray

from tests.refusals import refused
from thermaxis.thermal import (
    Method,
    Records,
    ThermalLog,
    identify,
    identify_joint,
    parse_input,
    records_of,
    verify,
)
from thermaxis.thermal.transfer_function import held, section_response

pytestmark = pytest.mark.usefixtures("one_clock_and_regime")

Array = NDArray[np.float64]
ROWS = 400
WALK = 0.1 * np.cumsum(np.random.default_rng(0).normal(size=ROWS))
OTHER = 0.1 * np.cumsum(np.random.default_rng(1).normal(size=ROWS))
LAST_ROW = np.where(np.arange(ROWS) == ROWS - 1, 1.0, 0.0)


def records(a_c: Array, b_c: Array, outputs: Mapping[str, Array]) -> Records:
    time_s = 10.0 * np.arange(float(ROWS))
    columns = {"A_c": a_c, "B_c": b_c, **outputs}
    log = ThermalLog.from_columns(columns, time_s=time_s)
    return records_of([log], [parse_input("a=A_c"), parse_input("b=B_c")], list(outputs))


@pytest.mark.filterwarnings("ignore::RuntimeWarning")
def test_numbers_that_cannot_be_solved_for_are_an_error_in_words() -> None:
    for temperature_c, method in ((1e160 * WALK, Method.MODAL), (LAST_ROW, Method.OE)):
        with refused("rows_not_determining"):
            identify(records(temperature_c, np.zeros(ROWS), {"Z_um": WALK}), method=method)
    seen = records(WALK, 1e160 * OTHER, {"Z0_um": WALK, "Z1_um": 2.0 * WALK})
    with refused("rows_not_determining"):
        identify_joint(seen, "Z_um", "a", {"Z0_um": 0.0, "Z1_um": 1500.0})


def warmed(seed: int, tau_s: float = 600.0) -> ThermalLog:
    """Return a test of two sources that rest at first, 20 um/K behind a lag on the first."""
    random = np.random.default_rng(seed)
    steps = [np.repeat(random.uniform(0.0, 8.0, ROWS // 40), 40) for _ in range(2)]
    a, b = (np.where(np.arange(ROWS) < 10, 0.0, v) for v in steps)
    a = section_response(a, 300.0, 10.0, 0.0)
    y = 20.0 * section_response(a, tau_s, 10.0, 0.0) + random.normal(0.0, 0.1, ROWS)
    columns = {"A_c": 20.0 + a, "B_c": 20.0 + b, "Z_um": y}
    return ThermalLog.from_columns(columns, sample_time_s=10.0, name=f"test {seed}")


INPUTS = [parse_input("a=A_c"), parse_input("b=B_c")]


@pytest.mark.parametrize("method", list(Method))
def test_figures_are_those_that_verify_finds_on_the_same_logs(method: Method) -> None:
    logs = [warmed(1), warmed(2)]
    records = records_of(logs, INPUTS, ["Z_um"])
    orders = (1, 2, 0) if method in (Method.OE, Method.ARX) else None
    found = identify(records, method=method, orders=orders)
    own, done = found.outputs[0], verify(found.to_compensation_model(records), logs).pooled["Z_um"]
    assert own.fit_percent == done.fit_percent
    assert own.training_rmse_um["model"] == done.rmse_um
    assert own.training_rmse_um["static"] == done.static_rmse_um
    assert own.training_rmse_um["one_step"] == done.persistence_rmse_um


def test_other_runs_are_judged_by_fits_that_never_saw_them() -> None:
    """Two machines under one name: each model leaves much of the other's test."""
    logs, orders = [warmed(1), warmed(2, 3000.0)], (1, 2, 0)
    both = identify(records_of(logs, INPUTS, ["Z_um"]), method=Method.ARX, orders=orders)
    held = both.outputs[0].held_out
    assert held is not None
    assert held.what.code == "held_out-other_runs"
    left = []
    for own, other in (logs, logs[::-1]):
        records = records_of([own], INPUTS, ["Z_um"])
        model = identify(records, method=Method.ARX, orders=orders).to_compensation_model(records)
        left.append(verify(model, [other]).pooled["Z_um"].rmse_um)
    assert held.rmse_um["model"] == pytest.approx(np.sqrt(np.mean(np.square(left))))
    assert held.rmse_um["model"] > 5.0


@pytest.mark.proof
def test_one_run_is_judged_by_its_later_part_and_promises_no_other() -> None:
    log = warmed(3)
    own = identify(records_of([log], INPUTS, ["Z_um"])).outputs[0]
    assert own.held_out is not None
    assert own.held_out.what.code == "held_out-later_part"
    cut = int(0.7 * ROWS)
    part = records_of([log.span(0, cut)], INPUTS, ["Z_um"])
    model = identify(part).to_compensation_model(part)
    figures = verify(model, [log], rows=(cut, ROWS)).pooled["Z_um"]
    assert own.held_out.rmse_um["model"] == figures.rmse_um
    assert own.held_out.fit_percent == figures.fit_percent
    y = log.column("Z_um")
    hold = float(np.sqrt(np.mean((y[cut:] - y[cut - 1]) ** 2)))
    assert own.held_out.rmse_um["hold"] == pytest.approx(hold)
    assert not {w.code for w in own.warnings} & {"warning-not_fit"}
    few = ThermalLog.from_columns({k: v[:60] for k, v in log.columns.items()}, sample_time_s=10.0)
    assert identify(records_of([few], INPUTS, ["Z_um"])).outputs[0].held_out is None


@pytest.mark.proof
def test_rows_in_which_an_input_had_failed_judge_nothing_and_are_counted() -> None:
    log = warmed(3)
    name = next(channel for channel in log.columns if channel != "Z_um")
    stopped = {k: v.copy() for k, v in log.columns.items()}
    stopped[name][ROWS // 2 :] = np.nan
    stopped["Z_um"][ROWS // 2 + 30 :] += 500.0
    log = ThermalLog.from_columns(stopped, time_s=log.time_s, name="stopped")
    made = records_of([log], INPUTS, ["Z_um"])
    (own,) = identify(made).outputs
    assert own.trained is not None
    assert own.held_out is not None
    assert max(own.training_rmse_um["model"], own.held_out.rmse_um["model"]) < 5.0
    (failed,) = [w for w in own.warnings if w.code == "remark-input_failed"]
    assert failed.values["rows"] == ROWS - own.trained.rows > ROWS // 3
    (run,) = own.runs
    left = run.measured_um - held(run.input_k)[0] @ own.static_gains_um_per_k
    static = (left - np.mean(left[:7]))[run.counted]
    assert own.training_rmse_um["static"] == pytest.approx(np.sqrt(np.mean(static**2)))


@pytest.mark.proof
def test_a_model_of_inputs_that_say_nothing_is_not_to_be_used() -> None:
    random = np.random.default_rng(4)
    z = warmed(4).columns["Z_um"]
    noise = 20.0 + random.normal(size=(2, ROWS))
    made = records(noise[0], noise[1], {"Z_um": z})
    (own,) = identify(made).outputs
    assert own.held_out is not None
    assert own.held_out.fit_percent <= 0.0
    condemned = {w.code for w in own.warnings} & {"warning-explains_nothing", "warning-not_fit"}
    assert condemned == {"warning-explains_nothing"}, "no rule explains anything either"
    (said,) = (w for w in own.warnings if w.code == "warning-explains_nothing")
    cut = int(0.7 * ROWS)
    constants = (np.sqrt(np.mean((z[cut:] - one) ** 2)) for one in (z[cut - 1], np.mean(z[:cut])))
    assert said.values["constant_um"] == pytest.approx(min(constants), rel=0.01)
    for method in (Method.STATIC, Method.AVERAGES):
        (rule,) = identify(made, method=method).outputs
        assert str(method) not in [w.values.get("method") for w in rule.warnings]
    true = identify(records_of([warmed(3)], INPUTS, ["Z_um"])).outputs[0]
    assert "warning-explains_nothing" not in {w.code for w in true.warnings}


@pytest.mark.proof
def test_a_model_that_leaves_less_than_all_that_was_known_before_is_not_condemned() -> None:
    random = np.random.default_rng(6)
    a = np.append(np.repeat(random.uniform(0.0, 4.0, 13), 20), np.zeros(20))
    a = np.append(a, np.full(ROWS - a.size, 5.0))
    z = 20.0 * a + random.normal(0.0, 0.1, ROWS) + np.where(np.arange(ROWS) < 0.7 * ROWS, 0.0, 25.0)
    a[0] = z[0] = 0.0
    (own,) = identify(records(20.0 + a, 20.0 + OTHER, {"Z_um": z})).outputs
    assert own.held_out is not None
    assert own.held_out.fit_percent < 0.0, "those rows hardly move, which was not known before"
    assert own.held_out.rmse_um["model"] < own.held_out.constant_um
    assert not {w.code for w in own.warnings} & {"warning-explains_nothing", "warning-not_fit"}


@pytest.mark.proof
def test_what_is_advised_can_be_done_and_leaves_what_was_said() -> None:
    """Gains without a lag on a machine with lags: averages leave far less, and are a method."""
    records = records_of([warmed(6, 900.0), warmed(7, 900.0)], INPUTS, ["Z_um"])
    (told,) = identify(records, method=Method.STATIC).outputs
    (message,) = [w for w in told.warnings if w.code == "warning-not_fit"]
    (better,) = identify(records, method=Method(message.values["method"])).outputs
    assert better.held_out is not None
    assert better.held_out.rmse_um["model"] == pytest.approx(message.values["simple_um"], rel=5e-3)
    assert better.held_out.rmse_um["averages"] == better.held_out.rmse_um["model"]
    assert not better.warnings
    assert "warning-not_fit" not in {w.code for w in identify(records).outputs[0].warnings}


@pytest.mark.proof
def test_polynomials_that_lags_cannot_follow_are_refused_with_the_reason() -> None:
    """A pair of poles that rings fast is left out of a model file: rows that show it refuse it."""
    random = np.random.default_rng(5)
    u = random.normal(size=ROWS)
    y = np.zeros(ROWS)
    for k in range(2, ROWS):
        y[k] = 0.6 * y[k - 1] - 0.45 * y[k - 2] + 5.0 * u[k - 1]
    log = ThermalLog.from_columns({"A_c": u, "Z_um": y}, sample_time_s=10.0)
    records = records_of([log], [parse_input("a=A_c")], ["Z_um"])
    found = identify(records, method=Method.OE, orders=(2, 1, 1))
    (said,) = [w for w in found.outputs[0].warnings if w.code == "warning-no_lags"]
    assert found.outputs[0].model is None
    assert found.outputs[0].fit_percent is None
    assert found.outputs[0].training_rmse_um == {}
    assert getattr(said.values["cause"], "code", "") == "error-lags_differ"
    with refused("model_not_stable_lags"):
        found.to_compensation_model(records)
    assert identify(records, method=Method.OE).outputs[0].model is not None


@pytest.mark.parametrize("method", [Method.AVERAGES, Method.ARX])
def test_an_output_whose_unit_is_not_known_is_warned_of(method: Method) -> None:
    found = identify(records(WALK, OTHER, {"ch1_in": WALK, "Z_mm": WALK}), method=method)
    told = {warning.code: warning.values for warning in found.warnings}
    assert told == {"warning-outputs_without_unit": {"names": "ch1_in"}}
    assert identify(records(WALK, OTHER, {"Z_mm": WALK}), method=method).warnings == ()
