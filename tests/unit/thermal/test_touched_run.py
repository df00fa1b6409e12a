"""What touches are worth along a log, against laws and a displacement that is known."""

import math
from dataclasses import replace

import numpy as np
import pytest

from tests.proofs import quick_first
from thermaxis.codes import Message
from thermaxis.compensation import (
    CompensationModel,
    Limits,
    Output,
    Part,
    Section,
    TouchOutcome,
    TouchRules,
)
from thermaxis.thermal import (
    MeasuredOutput,
    ThermalLog,
    TouchFigures,
    TouchPlan,
    likeliest_drift,
    touch_interval_s,
    verify,
)

MODEL = CompensationModel(
    outputs=(Output("Z_um", (Part("spindle", "T_C", "", 1.0, (Section(4.0, 1800.0),)),)),)
)
FINE = TouchRules(limits=Limits(1e4, 1e3), noise_um=0.01, acts=True)
EXACT = TouchPlan(every_s=3600.0, rules=FINE)


def warmed(offset_um: np.ndarray, **columns: np.ndarray) -> ThermalLog:
    """Return minutes of what the model says of a machine that rests, then warms, and an offset."""
    time_s = 60.0 * np.arange(offset_um.size)
    u = 8.0 * (1.0 - np.exp(-np.maximum(time_s - 300.0, 0.0) / 7200.0))
    x = np.zeros_like(u)
    alpha = -math.expm1(-60.0 / 1800.0)
    for k in range(1, u.size):
        x[k] = x[k - 1] + alpha * (u[k - 1] - x[k - 1])
    values = {"T_C": 20.0 + u, "Z_um": 3.0 + u + 4.0 * x + offset_um, **columns}
    return ThermalLog.from_columns(values, sample_time_s=60.0, name="warm")


def touched(log: ThermalLog, plan: TouchPlan, **options: object) -> TouchFigures:
    figures = verify(MODEL, [log], touches=plan, **options).logs[0].outputs[0].touched
    assert figures is not None
    return figures


def test_a_perfect_model_needs_no_touches_and_loses_nothing_by_them() -> None:
    found = touched(warmed(np.zeros(600)), EXACT, rows=(60, 600))
    assert found.free_run.mae_um < 1e-9
    assert found.with_offset.mae_um < 0.02
    assert found.probe_and_hold.mae_um > 0.5
    assert (found.touches, found.excluded) == (10, 0)


def test_an_offset_is_gone_after_a_touch_and_a_second_one_where_it_is_large() -> None:
    offset_um = np.where(np.arange(600) < 90, 0.0, 30.0)
    found = touched(warmed(offset_um), EXACT, rows=(300, 600))
    assert found.free_run.mae_um == pytest.approx(30.0, abs=1e-9)
    assert found.with_offset.mae_um < 0.02
    assert (found.touches, found.excluded) == (12, 1), "one more when the offset has arrived"


def test_the_first_row_of_the_log_and_the_first_that_counts_are_touched() -> None:
    offset_um = np.where(np.arange(600) < 75, 0.0, 2.0)
    found = touched(warmed(offset_um), EXACT, rows=(75, 600))
    assert found.touches == 2 + 9, "at 0, 15, 75, 135, ... min"
    assert found.with_offset.mae_um == pytest.approx(2.0 / 525, abs=0.02), "gone after one row"


def test_what_each_rule_leaves_is_what_it_is_called() -> None:
    offset_um = 0.02 * np.arange(600.0)
    log = warmed(offset_um)
    found = touched(log, EXACT, rows=(60, 600))
    z_um = log.column("Z_um") - np.mean(log.column("Z_um")[:2])
    held = np.concatenate([np.zeros(1), np.repeat(z_um[::60], 60)])[:600]
    left = (z_um - held)[60:]
    assert found.nothing.rmse_um == pytest.approx(np.sqrt(np.mean(z_um[60:] ** 2)))
    assert found.probe_and_hold.mae_um == pytest.approx(np.mean(np.abs(left)), abs=0.01)
    assert found.probe_and_hold.max_um == pytest.approx(np.max(np.abs(left)), abs=0.05)
    beyond = np.mean(np.abs(z_um[60:]) > 5.0)
    assert found.nothing.beyond_share == pytest.approx(beyond)
    assert found.with_offset.mae_um == pytest.approx(0.02 * 30.5, abs=0.02)


def test_touches_in_a_column_are_those_of_the_log_and_judge_what_was_known_before() -> None:
    offset_um = 0.02 * np.arange(600.0)
    whole = warmed(offset_um)
    probed = np.full(600, np.nan)
    probed[::60] = whole.column("Z_um")[::60]
    log = warmed(offset_um, probe_um=probed)
    plan = TouchPlan(channels={"Z_um": "probe_um"}, rules=FINE)
    found = touched(log, plan, rows=(60, 600))
    assert found.with_offset.mae_um == pytest.approx(0.02 * 30.5, abs=0.02)
    own = MeasuredOutput("probe_um", "Z_um")
    sparse = verify(MODEL, [log], [own], touches=plan, rows=(61, 600)).logs[0].outputs[0].touched
    assert sparse is not None
    assert sparse.with_offset.mae_um == pytest.approx(0.02 * 60, abs=0.02), "not by its own touch"


def test_an_output_without_touches_has_no_figures_of_them() -> None:
    log = warmed(np.zeros(100))
    assert verify(MODEL, [log]).logs[0].outputs[0].touched is None
    plan = TouchPlan()
    assert verify(MODEL, [log], touches=plan).logs[0].outputs[0].touched is None


@pytest.mark.parametrize("row_s", [3600.0, 7200.0])
def test_touches_count_where_rows_are_hours_long(row_s: float) -> None:
    values = {"T_C": np.full(20, 20.0), "Z_um": 4.0 * (np.arange(20) > 0)}
    log = ThermalLog.from_columns(values, sample_time_s=row_s, name="rare")
    figures = touched(log, replace(EXACT, every_s=row_s))
    assert (figures.touches, figures.excluded) == (19, 0)
    assert figures.untimely == 1, "the model starts in the first row"
    assert figures.with_offset.mae_um < 0.25 < figures.free_run.mae_um


def test_a_log_of_which_no_touch_can_be_used_says_so() -> None:
    model = replace(MODEL, longest_gap_s=30.0)  # every row of a minute starts it anew
    log = warmed(np.full(600, 4.0))
    found = verify(model, [log], touches=EXACT)
    figures = found.logs[0].outputs[0].touched
    assert figures is not None
    assert (figures.touches, figures.untimely) == (10, 10)
    assert "remark-touches_untimely" in {warning.code for warning in found.warnings}


def walked(minutes: int, drift_um: float, step_um: float = 0.0) -> ThermalLog:
    """Return minutes of what drifts beside the model, touched each hour, stepping in the middle."""
    rng = np.random.default_rng(6)
    offset_um = drift_um * np.sqrt(1.0 / 60.0) * np.cumsum(rng.standard_normal(minutes))
    offset_um += step_um * (np.arange(minutes) >= minutes // 2)
    probe = warmed(offset_um).column("Z_um") + rng.standard_normal(minutes)
    return warmed(offset_um, probe_um=np.where(np.arange(minutes) % 60, np.nan, probe))


def remarks(log: ThermalLog, plan: TouchPlan, measured: str = "Z_um") -> dict[str, Message]:
    found = verify(MODEL, [log], [MeasuredOutput(measured, "Z_um")], touches=plan)
    return {one.code: one for one in found.warnings}


@pytest.mark.proof
def test_touches_that_stay_excluded_tell_no_schedule_but_when_they_began_to_be() -> None:
    log, plan = walked(6000, 0.05, step_um=40.0), TouchPlan(channels={"Z_um": "probe_um"})
    plan = replace(plan, rules=replace(plan.rules, confirm_s=600.0))
    found = touched(log, plan)
    assert found.excluded > 40
    assert found.interval_s is None
    said = remarks(log, plan)
    (far,) = said["remark-touches_excluded"].values["far"]
    assert isinstance(far, Message)
    assert far.values["at_h"] == 50.0
    assert far.values["um"] == pytest.approx(40.0, abs=2.0)
    followed = remarks(log, TouchPlan(channels={"Z_um": "probe_um"}))["remark-touches_far"]
    assert followed.values["excluded"] == 1
    (first,) = followed.values["far"]
    assert first.values["at_h"] == 50.0
    assert touched(walked(6000, 0.3), plan).interval_s is not None


def test_an_offset_that_touches_ended_says_why_though_none_was_excluded() -> None:
    plan = replace(EXACT, rules=replace(FINE, gate=1000.0))
    offset_um = np.where(np.arange(600) < 90, 0.0, 30.0)
    options = {"touches": plan, "limits": {"Z_um": Limits(15.0, 1.0)}}
    result = verify(MODEL, [warmed(offset_um)], **options)
    found = result.logs[0].outputs[0].touched
    assert found is not None
    assert (found.off, found.excluded, found.interval_s) == (TouchOutcome.TOO_FAR, 0, None)
    (why,) = (one for one in result.warnings if one.code == "touch-too_far")
    assert (why.place.file, why.place.channel) == ("warm", "Z_um")


@pytest.mark.proof
@pytest.mark.parametrize(("drift_um", "how"), [(0.0, "worse"), (5.0, "beyond")])
def test_a_drift_that_touches_do_not_show_is_said_with_the_likeliest(
    drift_um: float, how: str
) -> None:
    log, plan = walked(6000, drift_um), TouchPlan(channels={"Z_um": "probe_um"})
    plan = replace(plan, rules=replace(plan.rules, gate=6.0))
    told = remarks(log, plan)[f"remark-touches_{how}"].values["likeliest"]
    assert isinstance(told, Message)
    likely = touched(log, plan).likely
    assert likely is not None
    assert told.values["likely_drift_um"] == pytest.approx(likely.drift_um_per_root_h, rel=0.1)
    fitting = replace(likely, drift_um_per_root_h=max(likely.drift_um_per_root_h, 0.1))
    assert f"remark-touches_{how}" not in remarks(log, replace(plan, rules=fitting))


def test_noise_on_touches_is_not_added_unsaid() -> None:
    log = walked(600, 1.0)
    assert "remark-touches_touched" in remarks(log, EXACT, "probe_um")
    assert "remark-touches_touched" not in remarks(log, EXACT)
    assert "remark-touches_touched" not in remarks(log, TouchPlan(channels={"Z_um": "probe_um"}))


def test_limits_hold_for_model_and_offset_together() -> None:
    offset_um = np.where(np.arange(600) < 90, 0.0, 30.0)
    limits = {"Z_um": Limits(45.0, 1.0)}
    found = touched(warmed(offset_um), EXACT, rows=(300, 600), limits=limits)
    total_um = float(np.mean(warmed(offset_um).column("Z_um")[300:])) - 3.0
    assert found.with_offset.mae_um == pytest.approx(total_um - 45.0, rel=0.1)


@pytest.mark.proof
@pytest.mark.parametrize(("within_um", "discrepancy_um"), [(2.0, 0.0), (1.0, 0.0), (3.0, 2.0)])
def test_touches_by_need_come_as_often_as_the_law_says_and_keep_the_tool_point_known(
    within_um: float, discrepancy_um: float
) -> None:
    rng = np.random.default_rng(5)
    walk = 1.5 * np.sqrt(1.0 / 60.0) * np.cumsum(rng.standard_normal(9000))
    walk += discrepancy_um * rng.standard_normal(walk.size)
    log = ThermalLog.from_columns(
        {"T_C": np.full(walk.size, 20.0), "Z_um": walk}, sample_time_s=60.0, name="walk"
    )
    rules = replace(FINE, noise_um=1.0, drift_um_per_root_h=1.5, discrepancy_um=discrepancy_um)
    found = touched(log, TouchPlan(within_um=within_um, rules=replace(rules, gate=5.0)))
    interval_s = touch_interval_s(rules, within_um)
    rows = interval_s // 60.0 + 1.0  # the first row beyond
    assert found.touches == pytest.approx(walk.size / rows, rel=0.1)
    least_um = math.hypot(0.6 * within_um, discrepancy_um)
    assert least_um < found.with_offset.rmse_um < 1.1 * within_um


def test_no_touches_are_needed_where_the_model_is_good_enough_and_none_help_where_e_is_more() -> (
    None
):
    rules = replace(FINE, noise_um=1.0, start_um=4.0, discrepancy_um=2.0)
    assert touch_interval_s(rules, 1.9) == 0.0
    assert touch_interval_s(rules, 4.5) == math.inf
    assert 0.0 < touch_interval_s(rules, 2.5) < touch_interval_s(rules, 3.0) < math.inf


@pytest.mark.parametrize("discrepancy_um", quick_first(1, [0.0, 3.0]))
def test_what_is_likeliest_is_true_and_innovations_lie_where_they_should(
    discrepancy_um: float,
) -> None:
    rng = np.random.default_rng(3)
    walk = 1.5 * np.sqrt(1.0 / 60.0) * np.cumsum(rng.standard_normal(12_000))
    walk += discrepancy_um * rng.standard_normal(walk.size)
    values = {"T_C": np.full(walk.size, 20.0), "Z_um": walk}
    log = ThermalLog.from_columns(values, sample_time_s=60.0, name="walk")
    rules = replace(FINE, noise_um=1.0, drift_um_per_root_h=1.5, discrepancy_um=discrepancy_um)
    found = touched(log, TouchPlan(every_s=900.0, rules=rules, seed=2))
    assert found.likely is not None
    assert found.likely.drift_um_per_root_h == pytest.approx(1.5, rel=0.3)
    assert found.likely.discrepancy_um == pytest.approx(discrepancy_um, abs=0.4)
    assert found.within_two_sigma is not None
    assert 0.91 < found.within_two_sigma < 0.98
    assert found.with_offset.mae_um < found.probe_and_hold.mae_um < found.free_run.mae_um


def test_chips_and_another_datum_make_no_drift_likelier() -> None:
    rng = np.random.default_rng(4)
    time_s = 3600.0 * np.arange(200.0)
    left_um = np.cumsum(rng.normal(0.0, 0.5, 200)) + rng.normal(0.0, math.hypot(1.0, 2.0), 200)
    known = likeliest_drift(time_s, left_um, 1.0)
    assert known == (pytest.approx(0.5, rel=0.6), pytest.approx(2.0, abs=0.4))
    far_um = left_um + 30.0 * (time_s > 120.0 * 3600.0)
    far_um[[20, 60, 61, 150]] += (50.0, -40.0, 50.0, -30.0)
    assert likeliest_drift(time_s, far_um, 1.0) == (
        pytest.approx(known[0], abs=0.3),
        pytest.approx(known[1], abs=0.3),
    )


@pytest.mark.proof
def test_a_datum_that_the_offset_followed_is_told_and_no_drift_is_taken_from_it() -> None:
    plan = TouchPlan(channels={"Z_um": "probe_um"})
    plan = replace(plan, rules=replace(plan.rules, gate=30.0))  # so wide that none is excluded
    log = walked(6600, 0.3, step_um=35.0)
    found, said = touched(log, plan), remarks(log, plan)
    assert (found.excluded, found.interval_s) == (0, None)
    (moved,) = said["remark-touches_datum"].values["touches"]
    assert isinstance(moved, Message)
    assert moved.values["at_h"] == 55.0
    assert moved.values["um"] == pytest.approx(35.0, abs=3.0)
    assert not {"remark-touches_worse", "remark-touches_beyond"} & said.keys()
    assert "remark-touches_datum" not in remarks(walked(6600, 0.3), plan)


@pytest.mark.proof
def test_touches_of_the_wrong_sign_are_not_blamed_on_a_datum_alone() -> None:
    log, plan = walked(6000, 0.05), TouchPlan(channels={"Z_um": "probe_um"})
    plan = replace(plan, rules=replace(plan.rules, confirm_s=600.0))
    wrong = replace(log, columns={**log.columns, "probe_um": -log.column("probe_um")})
    assert "remark-touches_contradict" in remarks(wrong, plan)
    assert "remark-touches_contradict" not in remarks(log, plan)


def test_an_input_that_stands_beside_touches_hinders_nothing() -> None:
    log = walked(1800, 0.3)
    still = replace(log, columns={**log.columns, "T_C": np.full(log.rows, 23.0)})
    assert touched(still, TouchPlan(channels={"Z_um": "probe_um"})).touches > 20
