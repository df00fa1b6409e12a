"""The machines that estimators are tried on are what they say."""

import numpy as np
import pytest

from tests.simple_rules import simulate_baseline
from tests.thermal_machines import KINDS, TRUE_TAU_S, log, machine
from thermaxis.thermal import (
    Baseline,
    Experiment,
    ModalOptions,
    ThermalLog,
    fit_baseline,
    identify,
    modal,
    parse_input,
    records_of,
    simulate_from_rest,
    with_one_clock,
)

pytestmark = pytest.mark.usefixtures("one_clock_and_regime")


def test_the_direct_machine_is_a_sum_of_its_three_lags() -> None:
    for s in (1e-5j, 1e-4j, 1e-3j):
        shares = 1.0 / (1.0 + s * np.array(TRUE_TAU_S))
        wanted = [np.dot((10.0, 30.0, -16.0), shares), np.dot((6.0, 9.0, 17.0), shares)]
        assert machine("direct").response(s) == pytest.approx(wanted, rel=1e-9)


@pytest.mark.parametrize("kind", KINDS)
def test_a_lasting_heat_ends_at_the_ratio_at_rest(kind: str) -> None:
    found = machine(kind)
    assert np.all(np.linalg.eigvals(found.a).real < 0)
    # Implicit Euler steps of an hour, an independent way to where the machine settles.
    x = np.zeros(len(found.a))
    step = np.linalg.inv(np.eye(len(x)) - 3600.0 * found.a)
    for _ in range(500):
        x = step @ (x + 3600.0 * found.b @ np.array([0.3, 0.9]))
    spindle, table, column, z = found.c @ x
    wanted = found.dc_gain @ np.array([spindle - column, table - column])
    assert z == pytest.approx(wanted, rel=1e-9)


@pytest.mark.parametrize("kind", KINDS)
def test_the_ratio_of_the_responses_is_stable(kind: str) -> None:
    assert np.all(machine(kind).ratio_poles.real < 0)


def test_sensors_away_from_the_heat_give_complex_poles_and_a_wrong_start() -> None:
    remote = machine("remote")
    assert np.max(np.abs(remote.ratio_poles.imag)) > 1e-4
    early = remote.response(1.0).real
    assert np.all(early[1] * remote.dc_gain[1] < 0)
    assert np.max(np.abs(machine("coolant").ratio_poles.imag)) > 1e-4
    assert np.max(np.abs(machine("coupled").ratio_poles.imag)) < 1e-12


def test_a_log_shows_the_heat_the_hall_and_the_probe() -> None:
    still = log("coolant", 2.0, 3, step_s=10.0)
    moved = log("coolant", 2.0, 3, step_s=10.0, probe_um_per_h=1.0)
    hours = 10.0 * np.arange(len(still.z_um)) / 3600.0
    assert moved.z_um - still.z_um == pytest.approx(hours, abs=1e-9)
    assert still.temperatures_c == pytest.approx(np.round(still.temperatures_c, 1), abs=1e-9)


def _errors(
    kind: str, hours: float = 72.0, seed: int = 7, step_s: float = 300.0, **more: float
) -> tuple[np.ndarray, np.ndarray]:
    test = log(kind, hours, seed, step_s=step_s, **more)
    column = test.temperatures_c[:, 2] - test.temperatures_c[0, 2]
    experiment = Experiment(step_s, test.u_k, test.z_um, ambient_k=column)
    result = modal([experiment], input_names=("spindle", "table"))
    dc = np.array([part.dc_gain for part in result.model.parts])
    std = np.array([std.dc_gain or np.nan for std in result.std])
    return dc / test.dc_gain - 1.0, std / test.dc_gain


@pytest.mark.proof
def test_a_probe_that_drifts_does_not_move_dc_gains() -> None:
    """72 um of drift in 72 h; left out of the noise they moved the gains by half and more."""
    errors, stds = _errors("direct", probe_um_per_h=1.0)
    assert np.all(np.abs(errors) < np.minimum(0.1, 3.0 * stds))


def test_intervals_of_a_short_test_allow_for_a_drift_that_a_slow_lag_explains() -> None:
    """8 um in 8 h: the record does not show the line, and the gain is half as large again."""
    errors, stds = _errors("direct", 8.0, 6, 10.0, probe_um_per_h=1.0)
    assert errors[0] > 0.5
    assert np.all(np.abs(errors) < 2.5 * stds)


@pytest.mark.proof
def test_without_intervals_the_model_is_the_same_and_nothing_is_flagged_for_it() -> None:
    test = log("coupled", 8.0, 1, step_s=60.0)
    experiment, names = Experiment(60.0, test.u_k, test.z_um), ("spindle", "table")
    whole = modal([experiment], input_names=names)
    brief = modal([experiment], input_names=names, options=ModalOptions(intervals=False))
    assert [p.dc_gain for p in brief.model.parts] == [p.dc_gain for p in whole.model.parts]
    assert [std.dc_gain for std in brief.std] == [None, None]
    assert not any(flag.code == "flag-dc_gain" for flags in brief.flags for flag in flags)


def test_intervals_hold_on_a_machine_with_complex_poles_and_a_drift_that_follows_the_hall() -> None:
    errors, stds = _errors("remote", hall_um_per_k=1.0)
    assert np.all(np.abs(errors) < 3.0 * stds)


@pytest.mark.proof
def test_heat_that_lags_do_not_hold_is_no_drift_of_days() -> None:
    """Taken for a random walk, what complex poles leave cost more than half of the slow heat."""
    learnt, other = (log("coolant", 72.0, seed, step_s=120.0) for seed in (4, 50_004))
    experiment = Experiment(120.0, learnt.u_k, learnt.z_um)
    result = modal([experiment], input_names=("spindle", "table"))
    averages = fit_baseline(Baseline.AVERAGES_RIDGE, [experiment], offset=False)
    runs = (
        simulate_from_rest(result.model, 120.0, other.u_k),
        simulate_baseline(averages, other.u_k, 120.0),
    )
    own, simple = (float(np.mean(np.abs(other.z_um - run))) for run in runs)
    assert own < 1.1 * simple


def test_the_channel_that_all_inputs_are_relative_to_is_the_ambient() -> None:
    test = ThermalLog.from_columns(log("direct", 1.0, 0, step_s=10.0).columns())
    inputs = [parse_input("s=T_spindle_c-T_column_c"), parse_input("t=T_table_c-T_column_c")]
    (experiment,) = records_of([test], inputs, ["Z_um"]).experiments["Z_um"]
    column = test.columns["T_column_c"]
    assert experiment.ambient_k == pytest.approx(column - column[:6].mean(), abs=1e-9)
    mixed = [inputs[0], parse_input("t=T_table_c-T_hall_c")]
    (experiment,) = records_of([test], mixed, ["Z_um"]).experiments["Z_um"]
    assert experiment.ambient_k is None


@pytest.mark.proof
def test_a_model_far_worse_on_its_own_rows_than_averages_is_told_with_what_drifts() -> None:
    test = log("coupled", 12.0, 3, step_s=60.0, probe_um_per_h=8.0)
    inputs = [parse_input(f"T_{name}_c-T_column_c") for name in ("spindle", "table")]
    made = with_one_clock(ThermalLog.from_columns(test.columns()), inputs, ["Z_um"])
    quick = ModalOptions(intervals=False, delays_s=(0.0, 0.0))
    (found,) = identify(records_of([made], inputs, ["Z_um"]), modal_options=quick).outputs
    (said,) = [w for w in found.warnings if w.code == "warning-trained_badly"]
    left = found.training_rmse_um
    assert left["model"] > 2.0 * left["averages"]
    assert said.values["simple_um"] == pytest.approx(left["averages"], rel=5e-3)
    assert said.values["drifts"] == "yes"


@pytest.mark.proof
@pytest.mark.parametrize("um_per_h", [1.0, 0.0])
def test_a_probe_that_drifts_is_told_with_its_speed_and_condemns_no_model(um_per_h: float) -> None:
    test = log("direct", 72.0, 3, step_s=300.0, probe_um_per_h=um_per_h)
    inputs = [parse_input(f"T_{name}_c-T_column_c") for name in ("spindle", "table")]
    records = records_of([ThermalLog.from_columns(test.columns())], inputs, ["Z_um"])
    quick = ModalOptions(intervals=False, delays_s=(0.0, 0.0))  # no search for two regimes
    (found,) = identify(records, modal_options=quick).outputs
    told = {w.code: w for w in found.warnings}
    wrong = {"warning-not_fit", "warning-explains_nothing", "warning-trained_badly"}
    assert not told.keys() & wrong
    assert ("warning-probe_drift" in told) == bool(um_per_h)
    if um_per_h:
        assert told["warning-probe_drift"].values["um_per_h"] == pytest.approx(1.0, abs=0.05)
        assert found.held_out is not None
        left = found.held_out.rmse_um
        assert left["model"] > 1.1 * left["averages"], "these rows would have condemned it"
        assert "warning-drift_held_out" in told
