"""What positioning runs over the years say of an axis, and that chance says nothing."""

import json
import shutil
from dataclasses import replace
from datetime import datetime

import numpy as np
import pytest

from tests.proofs import quick_first
from tests.unit.fleet.axis_histories import AXIS_RUN, U_UM, history, spread_at
from tests.unit.fleet.fleet_machines import machine_of
from thermaxis.cli import main
from thermaxis.files import write_rtl, write_tidy_csv
from thermaxis.fleet import AxisTrend, Registry, axis_run, axis_trends
from thermaxis.virtual import paper_x_axis

NOISE_UM = U_UM / 2.0


def trend_of(b_um, **options) -> AxisTrend:
    (trend,) = axis_trends(history(b_um, **options))
    return trend


def codes(trend: AxisTrend) -> list[str]:
    return [one.code for one in trend.remarks]


def test_the_slope_of_a_figure_lies_in_its_interval_as_often_as_the_interval_says():
    rng, inside = np.random.default_rng(1), 0
    for _ in range(400):
        change = trend_of(5.0 + 0.2 * np.arange(6) + rng.normal(0.0, 3.0 * NOISE_UM, 6)).changes[0]
        inside += change.per_year_low <= 0.2 <= change.per_year_high
    assert 372 <= inside <= 392  # 380 are expected, with a standard deviation of 4.4


def test_a_steady_change_and_a_step_are_told_apart():
    rng = np.random.default_rng(2)
    for _ in range(20):
        noise = rng.normal(0.0, NOISE_UM, 8)
        wear = trend_of(5.0 + np.arange(8) + noise)
        assert codes(wear) == ["axis-slope"]
        assert wear.remarks[0].values["per_year"] == pytest.approx(1.0, abs=0.25)
        hit = trend_of(5.0 + 4.0 * (np.arange(8) >= 5) + noise)
        assert codes(hit) == ["axis-step"]
        assert hit.remarks[0].values["size"] == pytest.approx(4.0, abs=0.6)
        assert hit.remarks[0].values["start"].startswith("2025")


@pytest.mark.parametrize("runs", quick_first(1, [3, 12]))
def test_an_axis_that_does_not_change_is_hardly_ever_named(runs):
    rng = np.random.default_rng(runs)
    for scatter_um in (NOISE_UM, 4.0 * NOISE_UM):
        named = sum(bool(trend_of(rng.normal(9.0, scatter_um, runs)).remarks) for _ in range(200))
        assert named <= 5  # one is expected at most: only B scatters here


def test_runs_that_agree_by_chance_prove_no_change_smaller_than_their_uncertainty():
    assert codes(trend_of([5.0, 5.0, 5.0, 5.1])) == []
    assert codes(trend_of([5.0, 5.01, 5.02, 5.03])) == []


def test_two_runs_have_a_change_and_no_slope():
    trend = trend_of([5.0, 6.0])
    (change, *_) = trend.changes
    assert (change.ends.change, change.ends.significant) == (1.0, True)
    assert (change.per_year, change.step, codes(trend)) == (None, None, [])
    assert trend_of([5.0]).changes == ()


def test_figures_without_drift_are_compared_where_both_ends_have_them():
    runs = history([5.0, 9.0, 7.0, 6.0])
    runs = [
        replace(one, drift_free=history([k])[0].measured if k != 1 else {})
        for k, one in enumerate(runs)
    ]
    change = axis_trends(runs)[0].changes[0]
    assert change.ends.drift_free
    assert change.per_year == pytest.approx(1.0)


def test_what_another_part_of_the_axis_shows_is_not_compared():
    runs = history([5.0, 5.1, 5.0, 5.2])
    runs[1] = replace(runs[1], last_target=900.0)
    runs[2] = replace(runs[2], air_c=26.0)
    (trend,) = axis_trends([*reversed(runs), replace(AXIS_RUN, axis="C", kind="rotary")][:-1])
    assert [one.name for one in trend.runs] == ["2020.csv", "2022.csv", "2023.csv"]
    assert [one.name for one in trend.apart] == ["2021.csv"]
    assert codes(trend) == ["warning-other_part", "warning-air_differs"]
    both = axis_trends([replace(AXIS_RUN, axis="C", kind="rotary"), *runs])
    assert [(one.axis, one.kind) for one in both] == [("C", "rotary"), ("X", "linear")]


def test_a_fault_is_told_by_the_first_run_that_shows_it():
    runs = history([5.0, 5.1, 5.0])
    assert codes(axis_trends(runs)[0]) == []
    again = replace(runs[-1], findings=(spread_at(40.0), spread_at(80.0)))
    (remark,) = axis_trends([*runs[:-1], again])[0].remarks
    assert (remark.code, remark.values["name"]) == ("axis-new_fault", "2022.csv")
    assert remark.values["fault"].values["position"] == 80.0


@pytest.fixture(scope="module")
def measured(tmp_path_factory):
    """Return a folder with a registry of a machine, two of its runs and what is none."""
    folder = tmp_path_factory.mktemp("axes")
    with Registry.make(f"sqlite:///{folder / 'registry.db'}", "lake") as registry:
        registry.add(machine_of("Mill 1"), "first")
    (folder / "runs" / "later").mkdir(parents=True)
    for year, seed, name in ((2024, 1, "2024.csv"), (2026, 2, "later/2026.csv")):
        test = paper_x_axis(seed, cycles=5).test
        header = {**test.header, "machine": "Mill 1"}
        test = replace(test, start=datetime(year, 3, 2, 8, 0, 13), end=None, header=header)  # noqa: DTZ001 - as files state it
        write_tidy_csv(test, folder / "runs" / name)
        write_rtl(replace(test, end=datetime(year, 3, 2, 9)), folder / f"{year}.rtl")  # noqa: DTZ001 - as files state it
    (folder / "runs" / "photo.png").write_bytes(b"no run")
    return folder


def collect(capsys, *words: str, code: int = 0) -> dict:
    capsys.readouterr()
    assert main(["fleet", "collect", "registry.db", *words, "--json", "-"]) == code
    return json.loads(capsys.readouterr().out)


def test_runs_are_collected_once_and_shown_with_the_machine(
    measured, tmp_path, monkeypatch, capsys
):
    shutil.copytree(measured, tmp_path, dirs_exist_ok=True)
    monkeypatch.chdir(tmp_path)
    found = collect(capsys, "runs")
    assert found == {"runs": 2, "stored": 2, "known": 0, "unread": [], "others": []}
    assert collect(capsys, "runs", "2024.rtl")["known"] == 3  # the same run in another format
    for name in ("log.csv", "broken.rtl"):
        (tmp_path / "runs" / name).write_text("1,2\n")
    found = collect(capsys, "runs", code=1)
    assert (found["runs"], found["known"]) == (3, 2)
    assert ["log.csv" in found["others"][0], "broken.rtl" in found["unread"][0]] == [True, True]
    assert len(collect(capsys, "runs/log.csv", code=1)["unread"]) == 1
    (tmp_path / "runs" / "broken.rtl").unlink()
    assert main(["fleet", "collect", "registry.db", "runs"]) == 0
    assert "no positioning runs: 1\n" in capsys.readouterr().out
    assert main(["fleet", "collect", "registry.db", "runs", "--machine", "Mill 2"]) == 2
    assert "Mill 1" in capsys.readouterr().err
    assert collect(capsys, "runs/2024.csv", "--axis", "Y")["known"] == 1
    assert main(["fleet", "machine", "registry.db", "Mill 1"]) == 0
    assert "2026.csv" in capsys.readouterr().out


def test_a_run_without_its_machine_its_axis_or_its_start_is_not_stored(
    measured, tmp_path, monkeypatch, capsys
):
    shutil.copytree(measured, tmp_path, dirs_exist_ok=True)
    monkeypatch.chdir(tmp_path)
    test = paper_x_axis(1, cycles=5).test
    write_tidy_csv(replace(test, header={}), tmp_path / "nameless.csv")
    write_tidy_csv(replace(test, start=None, end=None), tmp_path / "timeless.csv")
    for words, said in (
        (("nameless.csv",), "--machine"),
        (("nameless.csv", "--machine", "Mill 1"), "--axis"),
        (("timeless.csv", "--machine", "Mill 1"), "no start"),
    ):
        (why,) = collect(capsys, *words, code=1)["unread"]
        assert said in why


def test_a_start_with_a_zone_is_brought_to_utc():
    test = paper_x_axis(1, cycles=5).test
    start = datetime.fromisoformat("2026-03-02T08:00:30+01:00")
    run = axis_run("A", "X", test, start, "run.csv", "0")
    assert run.start.isoformat() == "2026-03-02T07:00:00+00:00"
    assert run.drift_free.keys() == run.measured.keys()
