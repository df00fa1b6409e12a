"""A model from touches alone: what is held out, what is said of it, and how sure it is."""

from dataclasses import replace
from datetime import UTC, datetime

import numpy as np
import pytest

from tests.thermal_machines import log, machine
from tests.touched_machine import HISTORY, INPUTS as MACHINE_INPUTS, Machine, history
from thermaxis.thermal import (
    IdentifiedOutput,
    Method,
    ModalOptions,
    Records,
    ThermalLog,
    identify,
    modal,
    parse_input,
    records_of,
    verify,
    without_far_touches,
)

pytestmark = pytest.mark.usefixtures("one_clock_and_regime")

INPUTS = [parse_input(f"T_{name}_c-T_column_c") for name in ("spindle", "table")]
QUICK = ModalOptions(intervals=False, time_constants_s=((400.0, 3000.0, 12000.0),) * 2)
WRONG = {"warning-not_fit", "warning-explains_nothing", "warning-trained_badly"}
EVERY = 12
"""Rows of five minutes from touch to touch."""


def touched(seed: int, hours: float = 48.0, kind: str = "direct") -> ThermalLog:
    """Return a log of a machine, touched each hour with a noise of a micrometre."""
    columns = dict(log(kind, hours, seed, step_s=300.0).columns())
    z, random = columns["Z_um"], np.random.default_rng(seed)
    touches = np.full_like(z, np.nan)
    touches[::EVERY] = z[::EVERY] + random.standard_normal(z[::EVERY].size)
    return ThermalLog.from_columns({**columns, "Z_um": touches}, name="touches")


def records(one: ThermalLog) -> Records:
    return records_of([one], INPUTS, ["Z_um"])


def said(output: IdentifiedOutput) -> set[str]:
    return {warning.code for warning in output.warnings}


def test_each_quarter_of_the_touches_is_judged_by_a_model_of_the_others() -> None:
    whole = touched(1)
    (found,) = identify(records(whole), method=Method.STATIC).outputs
    assert found.held_out is not None
    assert found.held_out.in_stretches
    z = whole.columns["Z_um"]
    rows = np.flatnonzero(~np.isnan(z))[1:]
    squares: list[float] = []
    for hidden in np.array_split(rows, 4):
        kept = z.copy()
        kept[hidden] = np.nan
        part = records(replace(whole, columns={**whole.columns, "Z_um": kept}))
        model = identify(part, method=Method.STATIC).to_compensation_model(part)
        judge = (int(hidden[0]), int(hidden[-1]) + 1)
        figures = verify(model, [whole], rows=judge).pooled["Z_um"]
        squares.append(figures.rmse_um**2 * figures.rows)
    rmse_um = np.sqrt(np.sum(squares) / rows.size)
    assert found.held_out.rmse_um["model"] == pytest.approx(rmse_um, rel=1e-9)


@pytest.mark.proof
def test_a_good_model_of_few_touches_is_not_condemned_by_rules_that_fit_their_noise() -> None:
    few = touched(2, hours=28.0)
    random = np.random.default_rng(2)
    walks = {f"T_{k}_c": 22.0 + np.cumsum(random.normal(0.0, 0.1, few.rows)) for k in range(16)}
    log_of_many = replace(few, columns={**few.columns, **walks}, units={})
    inputs = [*INPUTS, *(parse_input(name) for name in walks)]
    made = records_of([log_of_many], inputs, ["Z_um"])
    (found,) = identify(made, choose=True).outputs
    left = found.training_rmse_um
    assert left["model"] > 2.0 * left["averages"], "these rows would have condemned it"
    assert not said(found) & WRONG


@pytest.mark.proof
def test_touches_that_follow_no_input_are_told_so() -> None:
    one = touched(3)
    z = one.columns["Z_um"]
    noise = np.where(np.isnan(z), np.nan, np.random.default_rng(3).normal(0.0, 9.0, z.size))
    other = replace(one, columns={**one.columns, "Z_um": noise})
    (found,) = identify(records(other), modal_options=QUICK).outputs
    assert found.held_out is not None
    assert found.held_out.in_stretches
    assert said(found) & {*WRONG, "warning-dc_gains_not_supported"}


def test_too_few_touches_promise_nothing() -> None:
    (found,) = identify(records(touched(4, hours=15.0)), modal_options=QUICK).outputs
    assert found.held_out is None
    assert not said(found) & WRONG, "nor do they condemn"


def test_as_few_touches_as_numbers_tell_neither_noise_nor_gains() -> None:
    (found,) = identify(records(touched(3, hours=10.0))).outputs
    assert found.noise_std_um is None
    assert all(one.dc_gain is None and one.direct_gain is None for one in found.std)
    assert "warning-dc_gains_not_supported" in said(found)


@pytest.mark.parametrize("every", [30, 120])
def test_noise_of_touches_has_what_they_do_not_tell_from_it(every: int) -> None:
    one = history(Machine(days=7, every=every), 3)
    found = modal(
        records_of([one], MACHINE_INPUTS, ["Z_um"]).experiments["Z_um"],
        input_names=["spindle", "table"],
        options=QUICK,
    )
    assert found.noise_std_um is not None
    assert 0.7 < found.noise_std_um < 1.8, "a touch has 1 um, the walk adds 0.5 an hour"
    assert (found.slow_noise_std_um is None) == (every == 120)


@pytest.mark.proof
def test_dc_gains_from_touches_lie_within_their_intervals() -> None:
    true = machine("direct").dc_gain
    (found,) = identify(records(touched(0))).outputs
    assert found.model is not None
    assert found.posterior is not None
    gains = np.array([part.dc_gain for part in found.model.parts])
    assert np.all(np.abs(gains - true) < 3.0 * found.posterior.dc_std)
    assert np.all(found.posterior.dc_std < 0.2 * true), "wider, it would say nothing"
    assert not said(found) & WRONG


@pytest.mark.proof
def test_a_segment_of_its_first_touch_alone_tells_nothing_of_a_drift() -> None:
    whole = touched(1, hours=24.0)
    columns = {name: values.copy() for name, values in whole.columns.items()}
    columns["Z_um"] += 2.0 * np.arange(whole.rows) / EVERY
    for name in ("T_spindle_c", "T_table_c", "T_column_c"):
        columns[name][1:EVERY] = np.nan
    options = replace(QUICK, time_constants_s=((2000.0,),) * 2)
    one = records(replace(whole, columns=columns))
    (found,) = identify(one, modal_options=options).outputs
    (drift,) = (w for w in found.warnings if w.code == "warning-probe_drift")
    assert drift.values["span_h"] == pytest.approx(24.0, rel=0.02)


def far(one: ThermalLog, chip: int, datum: int) -> ThermalLog:
    """Return a log with one touch 50 um off, and a datum that was set 30 um lower."""
    z = one.columns["Z_um"].copy()
    rows = np.flatnonzero(~np.isnan(z))
    z[rows[chip]] += 50.0
    z[rows[datum] :] -= 30.0
    return replace(
        one, columns={**one.columns, "Z_um": z}, start=datetime(2026, 11, 23, 6, 30, tzinfo=UTC)
    )


@pytest.mark.proof
def test_a_chip_and_another_datum_are_named_with_their_times_and_not_learnt_from() -> None:
    seed = 6
    truth = ThermalLog.from_columns(dict(log("direct", 48.0, seed, step_s=300.0).columns()))
    left_um: list[float] = []
    for one in (touched(seed), far(touched(seed), 12, 30)):
        made = records(one)
        found = identify(made, modal_options=QUICK)
        judged = verify(found.to_compensation_model(made), [truth])
        left_um.append(judged.pooled["Z_um"].mae_um)
    assert left_um[1] < 1.5 * left_um[0] + 1.0, "learnt from, they leave ten times as much"
    told = {w.code: w for w in found.outputs[0].warnings}
    (chip,) = told["warning-touches_excluded"].values["touches"]
    (moved,) = told["warning-datum_moved"].values["touches"]
    assert chip.values["at"] == "2026-11-23 18:30"
    assert chip.values["um"] == pytest.approx(50.0, abs=8.0)
    assert moved.values["at"] == "2026-11-24 12:30"
    assert moved.values["um"] == pytest.approx(-30.0, abs=8.0)


@pytest.mark.parametrize("kind", ["coupled", "remote", "coolant"])
def test_no_touch_of_another_machine_is_far(kind: str) -> None:
    for seed in range(4):
        made = records(touched(seed, kind=kind))
        kept, said = without_far_touches(made)
        assert kept is made
        assert not said


def test_one_of_two_chips_in_a_thousand_touches_is_as_far_as_the_other() -> None:
    whole = history(Machine(days=HISTORY + 20), 3)
    z = whole.columns["Z_um"].copy()
    rows = np.flatnonzero(~np.isnan(z))
    assert rows.size > 900
    z[rows[[150, 800]]] += 40.0
    one = replace(whole, columns={**whole.columns, "Z_um": z})
    kept, said = without_far_touches(records_of([one], MACHINE_INPUTS, ["Z_um"]))
    (message,) = said["Z_um"]
    assert message.values["count"] == 2
    left = kept.logs[0].columns["Z_um"]
    assert np.flatnonzero(np.isnan(left[rows])).tolist() == [150, 800]
