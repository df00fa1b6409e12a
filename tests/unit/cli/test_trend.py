"""The command ``trend``: runs of one axis in the order of time, and what makes them unequal."""

import csv
import io
import json
import math
from dataclasses import replace
from datetime import UTC, datetime, timedelta, timezone

import numpy as np
import pytest

from tests.unit.cli.refusals import code_of, refusal
from thermaxis.cli import execute
from thermaxis.files import read_positioning, write_tidy_csv
from thermaxis.positioning import FIGURE_KEYS, Cycle, StartEnd, evaluate_drift, evaluate_iso230_2
from thermaxis.quantities import AxisKind
from thermaxis.virtual import PAPER_X_AXIS, ReadingScatter, generate_positioning_run

PLAN = replace(PAPER_X_AXIS.plan, targets=8, interval=40.0, cycles=5)


def made(seed=1, *, year=2024, **changes):
    axis = replace(PAPER_X_AXIS, plan=replace(PLAN, **changes), scatter=ReadingScatter(noise=0.3))
    start = datetime(year, 3, 2, 8)  # noqa: DTZ001 - files state no zone
    test = generate_positioning_run(axis, seed=seed).test
    return replace(test, target=np.round(test.target), start=start, end=None)


@pytest.fixture
def write(tmp_path):
    def write(name, test):
        path = tmp_path / name
        write_tidy_csv(test, path)
        return path

    return write


@pytest.fixture
def years(write):
    return [write(f"{year}.csv", made(7, year=year)) for year in (2022, 2023, 2025)]


def run(*words: object) -> int:
    return execute(["trend", *map(str, words)])


def as_json(capsys, *words):
    capsys.readouterr()
    assert run(*words, "--json", "-") == 0
    return json.loads(capsys.readouterr().out)


def test_the_figures_are_those_of_each_run(years, capsys):
    found = as_json(capsys, *years)
    for path, one in zip(years, found["runs"], strict=True):
        test = read_positioning(path)
        figures, drift = evaluate_iso230_2(test), evaluate_drift(test)
        assert one["iso230_2"] == {key: getattr(figures, key) for key in FIGURE_KEYS}
        assert one["drift"]["model"] == str(drift.model)
        assert one["drift"]["total"] == drift.total
        free = one["drift"]["iso230_2"]
        assert free["A"] == float(drift.figures.A)
        assert free["E_backward"] == float(drift.figures.E_unidirectional[1])
        assert set(free) == set(FIGURE_KEYS)
        for uncertainty in (one["uncertainty"], one["drift"]["uncertainty"]):
            assert all(0.0 < uncertainty[key] < 20.0 for key in ("B", "E", "R", "A"))


def test_runs_are_sorted_by_their_start_whatever_the_order_given(years, capsys):
    found = as_json(capsys, years[2], years[0], years[1])
    assert [one["name"] for one in found["runs"]] == ["2022.csv", "2023.csv", "2025.csv"]
    assert found["sorted_by"] == "start"


def test_runs_with_the_same_start_keep_the_order_given(write, capsys):
    paths = [write(name, made(seed)) for seed, name in enumerate(("b.csv", "c.csv", "a.csv"))]
    found = as_json(capsys, *paths, "--no-drift")
    assert [one["name"] for one in found["runs"]] == ["b.csv", "c.csv", "a.csv"]


def test_a_run_without_a_start_leaves_all_in_the_order_given_and_this_is_said(years, write, capsys):
    undated = write("undated.csv", replace(made(3), start=None, end=None))
    found = as_json(capsys, years[2], undated, years[0], "--no-drift")
    assert [one["name"] for one in found["runs"]] == ["2025.csv", "undated.csv", "2022.csv"]
    assert found["sorted_by"] == "order given"
    assert any("undated.csv" in w and "order given" in w for w in found["warnings"])
    run(years[2], undated, years[0], "--no-drift")
    assert "–" in capsys.readouterr().out


def test_time_zones_are_brought_together(write, capsys):
    east = timezone(timedelta(hours=10))
    later = write("later.csv", replace(made(1), start=datetime(2024, 3, 2, 9, tzinfo=UTC)))
    sooner = write("sooner.csv", replace(made(1), start=datetime(2024, 3, 2, 12, tzinfo=east)))
    found = as_json(capsys, later, sooner, "--no-drift")
    assert [one["name"] for one in found["runs"]] == ["sooner.csv", "later.csv"]
    naive = write("naive.csv", made(1))
    mixed = as_json(capsys, later, naive, "--no-drift")
    assert any("time zone" in warning for warning in mixed["warnings"])


def test_equal_runs_change_by_nothing_and_have_no_warnings(years, capsys):
    found = as_json(capsys, *years)
    assert found["warnings"] == []
    for change in found["changes"]:
        assert change["change"] == 0.0
        assert change["significant"] is False
        assert change["drift_free"] is True


@pytest.mark.proof
def test_a_change_is_compared_with_the_root_of_the_sum_of_squares(write, capsys):
    first, last = made(7, year=2022), made(8, year=2026)
    last = replace(last, deviation=last.deviation + 0.05 * last.target[:, None, None])
    paths = [write("first.csv", first), write("last.csv", last)]
    found = as_json(capsys, *paths)
    change = next(one for one in found["changes"] if one["figure"] == "E")
    free = [one["drift"] for one in found["runs"]]
    assert change["change"] == pytest.approx(free[1]["iso230_2"]["E"] - free[0]["iso230_2"]["E"])
    assert change["change"] > 10.0
    assert change["expanded_uncertainty"] == pytest.approx(
        math.hypot(*(one["uncertainty"]["E"] for one in free))
    )
    assert change["significant"] is True
    run(*paths)
    assert "more than its U of" in capsys.readouterr().out


def other(**changes):
    return replace(made(7, year=2026), **changes)


def without_backward():
    deviation = made(7).deviation.copy()
    deviation[..., 1] = np.nan
    return other(deviation=deviation)


def elsewhere_in_every_respect():
    test = replace(made(7, cycles=3, targets=9), cycle=Cycle.PILGRIM)
    return replace(
        test,
        target=test.target * 1.5,
        header={"axis": "Y", "machine": "another one"},
        environment={"air_temperature_c": StartEnd(19.0, 20.0)},
    )


@pytest.mark.parametrize(
    ("second", "what"),
    [
        (
            elsewhere_in_every_respect,
            (
                "number of cycles: 5 (first.csv); 3 (second.csv)",
                "number of targets: 8 (first.csv); 9 (second.csv)",
                "another part of the axis",
                "kind of test cycle: standard",
                "axis: X (first.csv); Y (second.csv)",
                "machine: virtual milling machine",
                "not all conditions of the standard are met in second.csv",
                "the air differs by 4.5 K between second.csv and first.csv",
            ),
        ),
        (lambda: other(target=made(7).target * 1.002 + 1), ("lie elsewhere",)),
        (without_backward, ("approaches: both (first.csv); forward only",)),
    ],
)
def test_what_makes_runs_unequal_is_said_and_never_refused(write, capsys, second, what):
    paths = [write("first.csv", made(7, year=2023)), write("second.csv", second())]
    said = as_json(capsys, *paths, "--no-drift")["warnings"]
    assert [text for text in what if not any(text in warning for warning in said)] == [], said


def test_linear_and_rotary_axes_are_not_mixed(write):
    rotary = write("rotary.csv", other(kind=AxisKind.ROTARY))
    error = refusal("trend", write("linear.csv", made(1)), rotary)
    assert (error.code, error.place.file) == ("runs_of_two_kinds", "rotary.csv")


def test_rotary_axes_have_their_own_unit(write, capsys):
    paths = [write(f"{k}.csv", replace(made(k), kind=AxisKind.ROTARY)) for k in (1, 2)]
    run(*paths, "--no-drift")
    assert "as measured, arcsec" in capsys.readouterr().out


def test_a_run_without_order_has_no_figures_without_drift_and_this_is_said(write, tmp_path, capsys):
    lines = ["cycle,direction,target_mm,deviation_um"]
    rng = np.random.default_rng(1)
    for cycle in range(1, 6):
        for word in ("forward", "backward"):
            lines += [f"{cycle},{word},{40 * i},{rng.normal():.2f}" for i in range(8)]
    plain = tmp_path / "plain.csv"
    plain.write_text("\n".join(lines) + "\n", encoding="utf-8")
    found = as_json(capsys, plain, write("dated.csv", made(1)))
    assert found["runs"][0]["drift"] is None
    assert any("plain.csv: no figures without drift" in w for w in found["warnings"])
    assert all(not change["drift_free"] for change in found["changes"])


def test_without_drift_nothing_of_it_is_shown(years, capsys):
    run(*years, "--no-drift")
    shown = capsys.readouterr().out
    assert "Figures without drift" not in shown
    assert "±" in shown
    assert all(one["drift"] is None for one in as_json(capsys, *years, "--no-drift")["runs"])


def test_unidirectional_runs_show_the_figures_that_they_have(write, capsys):
    paths = [write(f"{k}.csv", without_backward()) for k in (1, 2)]
    run(*paths, "--no-drift")
    shown = capsys.readouterr().out
    assert "E↑" in shown
    assert "A↑" in shown
    assert "E↓" not in shown


def test_the_csv_holds_every_figure_and_no_formula(write, capsys, tmp_path):
    path = write("=cmd.csv", made(7))
    run(path, "--csv", "-")
    rows = list(csv.DictReader(io.StringIO(capsys.readouterr().out)))
    assert rows[0]["run"] == "'=cmd.csv"
    figures = evaluate_iso230_2(read_positioning(path))
    for key in FIGURE_KEYS:
        assert float(rows[0][f"{key}_um"]) == pytest.approx(getattr(figures, key), abs=1e-9)
        assert {f"U_{key}_um", f"{key}_drift_free_um", f"U_{key}_drift_free_um"} <= set(rows[0])
    run(path, "--csv", tmp_path / "trend.csv", "--no-drift")
    assert (tmp_path / "trend.csv").read_bytes().startswith(b"run,start,targets,")
    shown = capsys.readouterr().out
    assert "Figures of ISO 230-2" in shown
    assert "one run has no trend" in shown


def test_outputs_that_cannot_be_are_refused_before_anything_is_read(years, tmp_path, capsys):
    nothing = tmp_path / "nothing.csv"
    for options, code in (
        (("--csv", "-", "--json", "-"), "options_exclude"),
        (("--csv", years[1]), "output_is_input"),
        (("--json", years[1]), "output_is_input"),
        (("--figures", years[0]), "charts_need_folder"),
    ):
        assert code_of("trend", *years, nothing, *options) == code


@pytest.mark.proof
def test_the_chart_is_drawn_of_one_run_and_of_runs_without_dates_or_one_direction(
    write, tmp_path, capsys
):
    hostile = {"axis": "$\\frac{ \u202e\x00", "title": "<script>"}
    one = write("one.csv", other(header=hostile))
    single = write("single.csv", replace(without_backward(), start=None))
    for number, paths in enumerate(((one,), (one, single, single))):
        folder = tmp_path / f"charts_{number}"
        run(*paths, "--no-drift", "--figures", folder)
        assert {p.name for p in folder.iterdir()} == {"trend.png", "trend.svg", "trend.csv"}
