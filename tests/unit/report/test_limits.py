import re
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from tests.refusals import refusal_of
from tests.unit.report.builders import check_stated, make_run
from thermaxis.files import DecisionRule, FigureLimits, read_figure_limits
from thermaxis.positioning import FIGURE_KEYS, Iso230_2Result, evaluate_iso230_2
from thermaxis.quantities import AxisKind
from thermaxis.report import Verdict, check_limits


def limits_of(folder: Path, text: str, kind: AxisKind = AxisKind.LINEAR) -> FigureLimits:
    path = folder / "limits.toml"
    path.write_text(text, encoding="utf-8")
    return read_figure_limits(path, kind)


@pytest.fixture(scope="module")
def result() -> Iso230_2Result:
    return evaluate_iso230_2(make_run())


def with_figure(result: Iso230_2Result, **figures: float | None) -> Iso230_2Result:
    return replace(result, **{key: np.nan if v is None else v for key, v in figures.items()})


def test_every_figure_can_have_a_limit(tmp_path: Path) -> None:
    lines = "".join(f"{key}_um = {i + 1}\n" for i, key in enumerate(FIGURE_KEYS))
    limits = limits_of(tmp_path, "[limits]\n" + lines)
    assert list(limits.limit.items()) == [(key, i + 1.0) for i, key in enumerate(FIGURE_KEYS)]
    assert limits.decision_rule is DecisionRule.SIMPLE
    assert limits.source_name == "limits.toml"


def test_a_rotary_axis_has_limits_in_arcsec(tmp_path: Path) -> None:
    limits = limits_of(tmp_path, "[limits]\nA_arcsec = 8\n", AxisKind.ROTARY)
    assert limits.limit == {"A": 8.0}
    said = refusal(tmp_path, "[limits]\nA_um = 8\n", AxisKind.ROTARY)
    assert said == "line 2, limits.A_um: unknown_key"


def refusal(folder: Path, text: str, kind: AxisKind = AxisKind.LINEAR) -> str:
    path = folder / "limits.toml"
    path.write_text(text, encoding="utf-8")
    return refusal_of(partial(read_figure_limits, kind=kind), path)


def test_wrong_limits_are_an_error_that_names_file_and_key(tmp_path: Path) -> None:
    for text, said in [
        ("[limits]\nA_mm = 1\n", "limits.A_mm: unknown_key_near"),
        *(
            (f"[limits]\nA_um = {value}\n", f"limits.A_um: {code}")
            for value, code in (
                *(("0", "not_positive"), ("-1.0", "not_positive"), ("inf", "not_finite")),
                *(("nan", "not_finite"), ("true", "no_number"), ("'12'", "no_number")),
            )
        ),
        ("[limits]\n", "limits: no_limits"),
        ("", "limits: no_limits"),
        ("[limits\n", "not_toml"),
        ("limits = 3\n", "limits: not_a_table"),
        ("[limit]\nA_um = 1\n", "limit: unknown_key_near"),
        (
            "[limits]\nA_um = 1\ndecision_rule = 'iso14253'\n",
            "limits.decision_rule: value_unknown",
        ),
        ("[limits]\nA_um = 1\ndecision_rule = 5\n", "limits.decision_rule: value_unknown"),
        (
            "[limits]\nA_um = 1\n[expanded_uncertainty]\nQ = 0.1\n",
            "expanded_uncertainty.Q: unknown_key",
        ),
    ]:
        assert refusal(tmp_path, text).endswith(said)


def test_simple_acceptance_passes_up_to_the_limit(result: Iso230_2Result) -> None:
    for value, verdict in [
        (12.0, Verdict.PASS),
        (12.0000001, Verdict.FAIL),
        (None, Verdict.NOT_DECIDED),
    ]:
        limits = FigureLimits({"A": 12.0}, DecisionRule.SIMPLE, {"A": 5.0}, "limits.toml")
        check = check_stated(limits, with_figure(result, A=value))
        assert check.verdict is verdict
        assert check.figures[0].expanded_uncertainty == 5.0


def test_the_uncertainty_counts_on_both_sides_of_the_limit(result: Iso230_2Result) -> None:
    for value, verdict in [
        (11.0, Verdict.PASS),
        (11.25, Verdict.PASS),
        (11.26, Verdict.NOT_DECIDED),
        (12.0, Verdict.NOT_DECIDED),
        (12.75, Verdict.NOT_DECIDED),
        (12.76, Verdict.FAIL),
        (None, Verdict.NOT_DECIDED),
    ]:
        limits = FigureLimits({"A": 12.0}, DecisionRule.ISO14253_1, {"A": 0.75}, "limits.toml")
        assert check_stated(limits, with_figure(result, A=value)).verdict is verdict


def test_the_mean_reversal_value_is_compared_by_its_magnitude(result: Iso230_2Result) -> None:
    limits = FigureLimits({"B_mean": 3.0}, DecisionRule.SIMPLE, {}, "limits.toml")
    assert check_limits(limits, with_figure(result, B_mean=-3.5)).verdict is Verdict.FAIL
    assert check_limits(limits, with_figure(result, B_mean=-2.5)).verdict is Verdict.PASS


def test_one_failure_fails_the_run_and_one_gap_leaves_it_open(result: Iso230_2Result) -> None:
    for b, e, overall in [
        (1.0, 1.0, Verdict.PASS),
        (9.0, None, Verdict.FAIL),
        (None, 9.0, Verdict.FAIL),
        (1.0, None, Verdict.NOT_DECIDED),
    ]:
        limits = FigureLimits({"B": 2.0, "E": 2.0}, DecisionRule.SIMPLE, {}, "limits.toml")
        check = check_limits(limits, with_figure(result, B=b, E=e))
        assert check.verdict is overall
        assert check.of("B") is check.figures[0]
        assert check.of("A") is None


def test_the_limits_of_the_how_to_and_of_the_example_read(root: Path, tmp_path: Path) -> None:
    page = (root / "docs" / "how-to" / "certificate-header.md").read_text(encoding="utf-8")
    example = next(t for t in re.findall(r"```toml\n(.*?)```", page, re.DOTALL) if "[limits]" in t)
    assert limits_of(tmp_path, example).decision_rule is DecisionRule.ISO14253_1
    shipped = read_figure_limits(root / "examples" / "limits.toml", AxisKind.LINEAR)
    assert set(shipped.limit) == {"B", "E", "R", "A"}
