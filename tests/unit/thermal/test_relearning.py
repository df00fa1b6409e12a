"""A model is learnt anew from touches, and proposed where newer ones show that it is better."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from tests.touched_machine import DAY, HISTORY, Machine, history
from thermaxis.compensation import (
    CompensationModel,
    Limits,
    OffsetState,
    Output,
    Part,
    Section,
    Touch,
    TouchRules,
    touch_step,
)
from thermaxis.errors import ConfigurationError, DataError
from thermaxis.thermal import (
    Proposal,
    RelearnOptions,
    ThermalLog,
    compared,
    innovations_of,
    relearn,
)

SPINDLE = Part("spindle", "T_spindle_C", "T_column_C", 0.4, (Section(2.2, 2400.0),))
TABLE = Part("table", "T_table_C", "T_column_C", 0.0, (Section(-2.0, 7200.0),))
MODEL = CompensationModel(outputs=(Output("Z_um", (SPINDLE, TABLE)),))
"""The machine as it was, but for what no input explains."""


def seen(machine: Machine, seed: int, night: int) -> ThermalLog:
    """Return the last 14 days of a machine, some days after it may have changed."""
    last = (HISTORY + night) * DAY
    return history(replace(machine, days=HISTORY + night), seed).span(last - HISTORY * DAY, last)


@cache
def slower() -> tuple[ThermalLog, Proposal]:
    """Return a machine whose spindle is slower since three days, and what is proposed."""
    log = seen(Machine(slower=1.4), 4, night=3)
    return log, relearn(log, MODEL)


def why(proposal: Proposal) -> str:
    (output,) = proposal.outputs
    return output.why.code


def test_a_slower_spindle_is_proposed_with_about_its_time_constant() -> None:
    _, found = slower()
    assert why(found) == "relearn-better"
    assert found.model is not None
    (output,) = found.model.outputs
    assert output.parts[0].sections[0].time_constant_s == pytest.approx(3360.0, rel=0.25)
    (one,) = found.outputs
    assert one.taken is not None
    assert one.taken.comparison.new_um < 0.95 * one.taken.comparison.old_um
    assert one.taken.comparison.least_share > 0.0
    assert found.model.reference_c == MODEL.reference_c


@pytest.mark.proof
def test_what_is_right_stays_though_the_tool_wears_and_chips_are_touched() -> None:
    found = relearn(seen(Machine(wear_um=4.0, chips=0.03), 4, night=3), MODEL)
    assert found.model is None
    assert why(found) == "relearn-no_better"
    assert len(found.outputs[0].candidates) >= 3


@pytest.mark.proof
def test_a_datum_that_is_said_to_be_set_anew_is_as_good_as_none() -> None:
    log, proposal = slower()
    day = (log.time_s - log.time_s[0]) // 86_400.0
    moved = log.columns["Z_um"] + 40.0 * (day % 3.0)
    anew = np.diff(day, prepend=0.0)
    plain = proposal.outputs[0].taken
    told = replace(log, columns={**log.columns, "Z_um": moved, "datum": anew})
    found = relearn(told, MODEL).outputs[0].taken
    assert plain is not None
    assert found is not None
    assert found.comparison.old_um == pytest.approx(plain.comparison.old_um, rel=0.1)
    assert found.comparison.new_um == pytest.approx(plain.comparison.new_um, rel=0.1)


@pytest.mark.proof
def test_a_change_needs_no_margin_and_a_model_that_was_always_as_wrong_does() -> None:
    wide = RelearnOptions(margin=0.3)
    found = relearn(slower()[0], MODEL, wide)
    assert why(found) == "relearn-better"
    (one,) = found.outputs
    assert one.taken is not None
    better = [c for c in one.candidates if c.better]
    assert one.taken.comparison.new_um == min(c.comparison.new_um for c in better)
    slow = replace(SPINDLE, sections=(Section(2.2, 3000.0),))
    wrong = CompensationModel(outputs=(Output("Z_um", (slow, TABLE)),))
    found = relearn(seen(Machine(), 4, night=3), wrong, wide)
    assert why(found) == "relearn-no_better"
    each = [c.comparison for c in found.outputs[0].candidates]
    assert min(one.new_um / one.old_um for one in each) < 0.95


@pytest.mark.proof
def test_a_datum_just_before_a_stretch_that_judges_mixes_no_zeros() -> None:
    log, proposal = slower()
    rows = np.flatnonzero(~np.isnan(log.columns["Z_um"]))
    newest = int(np.searchsorted(log.time_s[rows], log.time_s[-1] - 86_400.0))
    anew = rows[newest - 1]
    z = log.columns["Z_um"] + 4.5 * (np.arange(log.rows) >= anew)
    told = replace(log, columns={**log.columns, "Z_um": z, "datum": np.eye(1, log.rows, anew)[0]})
    plain, found = (one.outputs[0].candidates for one in (proposal, relearn(told, MODEL)))
    for one, other in zip(plain, found, strict=True):
        assert other.free_run_um == pytest.approx(one.free_run_um, rel=0.1)


@pytest.mark.proof
def test_touches_that_judge_change_no_candidate() -> None:
    log, proposal = slower()
    newest = log.time_s > log.time_s[-1] - 86_400.0  # the last stretch that judges
    other = np.where(newest, log.columns["Z_um"] + 5.0 * np.sin(log.time_s), log.columns["Z_um"])
    changed = replace(log, columns={**log.columns, "Z_um": other})
    a, b = (one.outputs[0].candidates for one in (proposal, relearn(changed, MODEL)))
    assert [one.output for one in a] == [one.output for one in b]
    assert [one.comparison for one in a] != [one.comparison for one in b]


def test_few_touches_are_told_and_none_are_refused() -> None:
    log = seen(Machine(every=300), 5, night=2)
    assert why(relearn(log, MODEL)) == "relearn-few_touches"
    with pytest.raises(DataError):
        relearn(log.select(list(MODEL.channels)), MODEL)
    with pytest.raises(ConfigurationError):
        RelearnOptions(margin=1.0)


def test_a_stuck_sensor_is_looked_at_before_a_model_is_proposed() -> None:
    log, _ = slower()
    spindle = log.columns["T_spindle_C"].copy()
    spindle[DAY : 3 * DAY] = spindle[DAY]
    stuck = replace(log, columns={**log.columns, "T_spindle_C": spindle})
    assert why(relearn(stuck, MODEL)) == "relearn-sensors_first"


def test_a_constant_and_what_was_before_leave_innovations_as_they_are() -> None:
    random = np.random.default_rng(1)
    time_s = np.cumsum(random.uniform(600.0, 7200.0, 200))
    left_um = np.cumsum(random.normal(0.0, 1.0, 200)) + random.normal(0.0, 1.0, 200)
    own = innovations_of(time_s, 1.0, 1.0)
    np.testing.assert_allclose(own.of(left_um)[1:], own.of(left_um + 40.0)[1:], atol=1e-2)
    both = own.of(np.column_stack([left_um, np.ones(200)]))
    np.testing.assert_allclose(both[:, 0], own.of(left_um))


def test_innovations_are_those_of_the_cycles_own_filter() -> None:
    random = np.random.default_rng(2)
    time_s = np.cumsum(random.uniform(600.0, 7200.0, 60))
    left_um = np.cumsum(random.normal(0.0, 1.0, 60)) + random.normal(0.0, 1.0, 60)
    rules = TouchRules(
        limits=Limits(1e4, 1e3), drift_um_per_root_h=1.5, noise_um=0.8, start_um=1000.0, gate=1000.0
    )
    state, expected = OffsetState(), []
    for at_s, um in zip(time_s.tolist(), left_um.tolist(), strict=True):
        known_um = state.belief.offset_um if state.belief else 0.0
        expected.append(um - known_um)
        state, _ = touch_step(rules, state, Touch("Z_um", um, at_s), 0.0)
    filter_ = innovations_of(time_s, 0.8, 1.5)
    np.testing.assert_allclose(
        (filter_.of(left_um) * filter_.std_um)[2:], expected[2:], rtol=1e-4, atol=1e-4
    )


def test_the_share_of_a_comparison_is_known_and_a_right_model_is_seldom_doubted() -> None:
    random = np.random.default_rng(3)
    g = random.normal(0.0, 1.0, 400)
    blocks = list(range(400))
    found = compared(0.7 * g, -0.3 * g, np.ones(400), blocks, 0.01)
    assert found is not None
    assert found.share == pytest.approx(0.7)
    assert found.old_um == pytest.approx(0.7 * np.sqrt(np.mean(g**2)))
    assert found.blocks == 400
    doubted = 0
    for _ in range(1000):
        g, noise = random.normal(0.0, 0.5, 24), random.normal(0.0, 1.0, 24)
        one = compared(noise, noise - g, np.ones(24), list(range(24)), 0.05)
        assert one is not None
        doubted += one.least_share > 0.0
    assert 30 <= doubted <= 75
    assert compared(g, g, np.ones(24), list(range(24)), 0.05) is None
