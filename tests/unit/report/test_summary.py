"""What one sees first of an evaluated run: 20 lines of 80 columns, and nothing claimed in them."""

import re
from collections import Counter
from dataclasses import replace

import numpy as np
import pytest

from tests.proofs import quick_first
from tests.unit.report.builders import make_report, make_run
from tests.unit.report.test_drift_in_report import drifting, still
from thermaxis.codes import Message
from thermaxis.files import DecisionRule, FigureLimits
from thermaxis.messages import sentence_of
from thermaxis.positioning import FIGURE_KEYS, Finding, figures_by_key
from thermaxis.quantities import AxisKind
from thermaxis.report import check_limits
from thermaxis.report.tables import summary_of

HOSTILE = "\x1b[31m" + "x" * 300 + " " + "word " * 80


def words(text: str) -> str:
    """Return a text in one line."""
    return " ".join(text.split())


def said(summary: str, head: str) -> str:
    """Return a sentence of the summary: from its head to the next line that is not indented."""
    (found,) = re.findall(rf"^{head}.*(?:\n  .*)*", summary, re.MULTILINE)
    return words(found)


def messages(count: int) -> tuple[Message, ...]:
    return tuple(
        Message("warning-cycle_of_option", {"stated": HOSTILE, "cycle": k}) for k in range(count)
    )


@pytest.mark.parametrize("approaches", ["both", "backward"])
@pytest.mark.parametrize("kind", AxisKind)
def test_it_fits_a_small_terminal_whatever_there_is_to_say(kind: AxisKind, approaches: str) -> None:
    test = replace(make_run(kind=kind, approaches=approaches), header={"axis": HOSTILE})
    limits = FigureLimits(dict.fromkeys(FIGURE_KEYS, 1.0), DecisionRule.SIMPLE, {}, "l.toml")
    report = drifting(test, limits=limits, source_name=HOSTILE)
    assert report.drift
    outlier = {"target": 1, "approach": "forward", "cycle": 2, "residual": 3.0, "unit": "µm"}
    for count in (0, 1, 2, 30):
        finding = Finding("backlash", 1.0, "µm", messages(1)[0], None)
        events = tuple(
            Message("warning-outlier_left_out", {**outlier, "cycle": k}) for k in range(count)
        )
        full = replace(
            report,
            warnings=(*events, *messages(count)),
            drift=replace(report.drift, warnings=events),
            diagnosis=count * (finding,),
        )
        lines = summary_of(full).splitlines()
        assert len(lines) <= 20
        assert max(map(len, lines)) <= 80
        assert not any("\x1b" in line for line in lines)
        shown = Counter(line.partition(":")[0] for line in lines)
        hidden = [count - shown["finding"], 2 * count - shown["warning"] - shown["outlier"]]
        counted = [re.search(rf"(\d+) {kind}", lines[-1]) for kind in ("finding", "warning")]
        assert [int(one[1]) if one else 0 for one in counted] == hidden


def test_the_figures_are_those_of_the_result_with_their_uncertainty_and_without_drift() -> None:
    report = drifting(make_run())
    assert report.drift
    assert report.uncertainty
    shown = {line.split()[0]: line for line in summary_of(report).splitlines() if line[:2] == "  "}
    measured, free = figures_by_key(report.iso230_2), figures_by_key(report.drift.figures)
    for key in "AEMRB":
        numbers = [float(one) for one in re.findall(r"\d+\.\d+", shown[key])]
        u = [
            one.expanded_uncertainty[key]
            for one in (report.uncertainty.measured, report.uncertainty.drift_free)
            if one
        ]
        assert numbers == pytest.approx([measured[key], u[0], free[key], u[1]], abs=0.005, rel=0.05)


@pytest.mark.parametrize("approach", ["forward", "backward"])
def test_one_approach_has_its_own_three_figures(approach: str) -> None:
    report = make_report(make_run(approaches=approach))
    arrow = "↑" if approach == "forward" else "↓"
    heads = [line.split()[0] for line in summary_of(report).splitlines() if line[:2] == "  "]
    first = heads.index("ISO") + 1
    assert heads[first : first + 3] == [f"E{arrow}", f"R{arrow}", f"A{arrow}"]


def test_the_verdict_names_what_does_not_pass() -> None:
    report = make_report(make_run())
    limit = {"B": 1e3, "A": 0.5, "A_forward": 0.25}
    limits = FigureLimits(limit, DecisionRule.SIMPLE, {}, "l.toml")
    failed = replace(report, limits=check_limits(limits, report.iso230_2))
    verdict = said(summary_of(failed), "verdict: ")
    assert verdict == "verdict: FAIL by simple acceptance (guard band 0): A↑ fail; A fail"
    passing = FigureLimits({"B": 1e3}, DecisionRule.SIMPLE, {}, "l.toml")
    passed = replace(report, limits=check_limits(passing, report.iso230_2))
    assert said(summary_of(passed), "verdict: ").startswith("verdict: PASS")


def test_a_drift_that_was_found_is_said_with_its_growth_over_the_run_and_over_the_axis() -> None:
    report = drifting(make_run(9, 30))
    assert report.drift
    assert report.drift.significant
    sentence = said(summary_of(report), "drift: ")
    growth, over_axis, shift = (
        float(one.replace("−", "-")) for one in re.findall(r"([+−]?\d[\d.]*) ±", sentence)
    )
    assert growth == pytest.approx(report.drift.total_per_m, rel=0.1)
    assert over_axis == pytest.approx(0.3 * report.drift.total_per_m, rel=0.1)
    assert shift == pytest.approx(report.drift.total, rel=0.1, abs=0.1)


@pytest.mark.parametrize("seed", quick_first(2, range(3, 9)))
def test_where_no_drift_is_seen_no_growth_is_claimed_but_a_bound_that_holds(seed: int) -> None:
    test, shift, growth = still(seed), 0.15, 1.0
    x = (test.target - test.target.mean())[:, None, None]
    late = test.time_s / np.max(test.time_s)
    drift = late * (shift + 1e-3 * growth * x)
    report = drifting(replace(test, deviation=test.deviation + drift))
    assert report.drift
    assert not report.drift.significant
    sentence = said(summary_of(report), "drift: ")
    assert sentence.startswith("drift: not significant (p = ")
    assert "±" not in sentence
    bounds = [float(one) for one in re.findall(r"less than ([\d.]+)", sentence)]
    assert bounds[0] > growth
    assert bounds[1] == pytest.approx(0.3 * bounds[0], rel=0.06)
    assert bounds[2] > shift


def test_an_axis_that_moves_and_comes_back_is_said_to_swing() -> None:
    test = make_run(9, 10)
    noise = np.random.default_rng(8).normal(0.0, 0.2, test.deviation.shape)
    swing = 2.0 * np.sin(2.0 * np.pi * test.time_s / np.max(test.time_s))
    report = drifting(replace(test, deviation=noise + swing))
    (size,) = re.findall(r"[\d.]+", said(summary_of(report), "swing: "))
    assert float(size) == pytest.approx(4.0, abs=0.5)
    assert "swing" not in summary_of(drifting(make_run(9, 30)))


def test_an_assumed_unit_is_the_first_warning_whatever_else_there_is_to_say() -> None:
    report = drifting(make_run(9, 8))
    assumed = Message("remark-unit_assumed", {"unit": "µm", "word": "um"})
    summary = summary_of(replace(report, warnings=(*messages(4), assumed)))
    first = next(line for line in summary.splitlines() if line.startswith("warning"))
    assert first == "warning: no unit of the deviations is stated: µm was assumed"


def test_a_jump_and_an_outlier_stand_below_the_drift_and_not_among_the_warnings() -> None:
    test = replace(make_run(9, 8), remarks=())
    noise = np.random.default_rng(6).normal(0.0, 0.3, test.deviation.shape)
    deviation = (
        4.0 * np.sin(test.target / 60.0)[:, None, None] + noise + 5.0 * (test.time_s > 500.0)
    )
    deviation[3, 1, 0] += 6.0
    report = drifting(replace(test, deviation=deviation))
    assert report.drift
    report = replace(report, warnings=report.drift.warnings)
    (change,), (outlier,) = report.drift.changes, report.drift.outliers
    summary = summary_of(report)
    assert f"cycle {change.cycle}, all targets by +{change.size:.2f} ± " in said(summary, "jump: ")
    named = said(summary, "outlier: ")
    assert named.startswith(f"outlier: target 4 forward in cycle 2, +{outlier.residual:.2f} µm off")
    assert "warning" not in summary


def test_what_the_drift_lacks_stands_in_its_place_and_not_among_the_warnings() -> None:
    why = Message("warning-no_drift_model", {"error": "no order", "remedy": ""})
    report = replace(make_report(make_run()), warnings=(why,))
    assert words(summary_of(report)).count(words(sentence_of(why))) == 1
    assert "not evaluated" in summary_of(make_report(make_run()))


def test_missing_values_are_dashes_and_no_figure_is_made_up() -> None:
    test = make_run(9, 1, length=2500.0)
    shown = summary_of(make_report(test))
    assert not re.search(r"\bnan\b|\binf\b|None", shown)
    assert np.all([f"  {key}  " not in shown for key in "AR"])
