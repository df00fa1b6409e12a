import csv
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.unit.report.builders import make_report, make_run
from thermaxis.errors import ConfigurationError
from thermaxis.positioning import PositioningTest, montecarlo_difference
from thermaxis.quantities import AxisKind
from thermaxis.report import PositioningReport, write_figures, write_montecarlo_figures
from thermaxis.report._output import NumberTable
from thermaxis.report._style import drawing
from thermaxis.report.charts import charts_of
from thermaxis.report.charts._drift import draw_one_position, widest_position
from thermaxis.report.charts._iso230_2 import draw_iso230_2

ALL_NAMES = (
    "iso230_2",
    "figure_06_all_cycles",
    "figure_07_one_position",
    "figure_10_standard_deviation",
    "figure_11_mean_mutual_deviation",
    "figure_12_deviation_chart",
    "figure_13_shifted_to_first_position",
    "against_cycles",
)
HOSTILE = (
    r"$\frac{$ $\undefined$",
    "<script>alert(1)</script> --> ]]> <!--",
    "\u202efdp\u0000\u001b[31m 主轴 😀",
    "x" * 5000,
)


def columns(path: Path) -> dict[str, list[str]]:
    with path.open(encoding="utf-8", newline="") as file:
        rows = list(csv.reader(file))
    return {name: [row[i] for row in rows[1:]] for i, name in enumerate(rows[0])}


def table_of(report: PositioningReport, name: str, folder: Path) -> dict[str, list[str]]:
    """Return the numbers behind one chart, without drawing any."""
    chart = next(chart for chart in charts_of(report) if chart.name == name)
    (folder / "table.csv").write_bytes(chart.numbers(report).as_csv())
    return columns(folder / "table.csv")


def numbers(cells: list[str]) -> np.ndarray:
    return np.array([float(cell) if cell else np.nan for cell in cells])


@pytest.fixture(scope="module")
def written(
    tmp_path_factory: pytest.TempPathFactory,
) -> tuple[PositioningReport, Path, tuple[Path, ...]]:
    folder = tmp_path_factory.mktemp("figures") / "made" / "here"
    report = make_report(make_run())
    return report, folder, write_figures(report, folder)


Written = tuple[PositioningReport, Path, tuple[Path, ...]]


def test_every_chart_is_written_as_png_svg_and_csv(written: Written) -> None:
    _, folder, paths = written
    expected = [f"{name}.{suffix}" for name in ALL_NAMES for suffix in ("png", "svg", "csv")]
    assert [path.name for path in paths] == expected
    assert all(path.parent == folder and path.stat().st_size > 100 for path in paths)
    assert (folder / "iso230_2.png").read_bytes()[:8] == b"\x89PNG\r\n\x1a\n"


@pytest.mark.proof
def test_the_same_report_gives_the_same_bytes(
    written: Written, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.undo()  # laid out once more
    report, folder, _ = written
    few = write_figures(replace(report, adjacent_difference=None, against_cycles=None), tmp_path)
    assert len(few) >= 9
    different = [p.name for p in few if p.read_bytes() != (folder / p.name).read_bytes()]
    assert different == []
    assert (folder / "iso230_2.svg").read_bytes().count(b"date") == 0


def test_an_svg_has_letters_as_paths_and_nothing_from_outside(written: Written) -> None:
    for path in written[2]:
        if path.suffix == ".svg":
            text = path.read_text(encoding="utf-8")
            assert "<text" not in text
            assert "<!--" not in text
            assert "<metadata" not in text
            assert all(link.startswith("#") for link in re.findall(r'href="([^"]*)"', text))


def test_the_numbers_behind_the_standards_chart_are_the_results(written: Written) -> None:
    report, folder, _ = written
    table = columns(folder / "iso230_2.csv")
    assert next(iter(table)) == "target_mm"
    result = report.iso230_2
    for name, values in (
        ("target_mm", result.target),
        ("mean_forward_um", result.mean[:, 0]),
        ("mean_backward_um", result.mean[:, 1]),
        ("mean_um", result.mean_bidirectional),
        ("s_forward_um", result.s[:, 0]),
        ("s_backward_um", result.s[:, 1]),
        ("B_um", result.B_i),
        ("R_forward_um", result.R_i_unidirectional[:, 0]),
        ("R_um", result.R_i),
    ):
        np.testing.assert_allclose(numbers(table[name]), values, rtol=0, atol=5.1e-10)


def test_the_numbers_behind_the_adjacent_difference_charts_are_the_results(
    written: Written,
) -> None:
    report, folder, _ = written
    adjacent = report.adjacent_difference
    spread = columns(folder / "figure_10_standard_deviation.csv")
    mean = columns(folder / "figure_11_mean_mutual_deviation.csv")
    chart = columns(folder / "figure_12_deviation_chart.csv")
    for table, name, values in (
        (spread, "standard_uncertainty_backward_um", adjacent.backward.standard_uncertainty),
        (spread, "standard_deviation_backward_um", adjacent.backward.standard_deviation),
        (spread, "s_ratio_backward", adjacent.backward.s_ratio),
        (mean, "mean_difference_backward_um", adjacent.backward.mean_difference),
        (chart, "chart_backward_um", adjacent.backward.chart),
        (chart, "bound_backward_um", adjacent.backward.bound),
    ):
        np.testing.assert_allclose(numbers(table[name]), values, rtol=0, atol=5.1e-10)
    assert spread["first_position"] == [str(i) for i in range(1, report.test.target.size)]
    np.testing.assert_array_equal(numbers(spread["second_target_mm"]), report.test.target[1:])


def test_the_numbers_behind_the_charts_of_cycles_are_the_readings(written: Written) -> None:
    report, folder, _ = written
    test = report.test
    table = columns(folder / "figure_06_all_cycles.csv")
    shifted = columns(folder / "figure_13_shifted_to_first_position.csv")
    for row in (0, 7, test.deviation.size - 1):
        cycle = int(table["cycle"][row]) - 1
        approach = ("forward", "backward").index(table["direction"][row])
        i = int(np.flatnonzero(test.target == float(table["target_mm"][row]))[0])
        reading = test.deviation[i, cycle, approach]
        assert float(table["deviation_um"][row]) == reading
        first = test.deviation[0, cycle, approach]
        assert shifted["shifted_deviation_um"][row] == str(round(reading - first, 2) + 0.0)
    assert len(table["cycle"]) == test.deviation.size
    one = columns(folder / "figure_07_one_position.csv")
    np.testing.assert_array_equal(
        numbers(one["backward_um"]), test.deviation[widest_position(report), :, 1]
    )
    against = columns(folder / "against_cycles.csv")
    assert float(against["A_um"][-1]) == pytest.approx(report.iso230_2.A, abs=1e-9)
    assert against["cycles"] == ["2", "3", "4", "5"]


def test_a_missing_reading_is_an_empty_cell_and_a_gap(tmp_path: Path) -> None:
    test = make_run()
    deviation = test.deviation.copy()
    deviation[4, 2, 0] = np.nan
    deviation[6, 3, 1] += 50.0
    report = make_report(replace(test, deviation=deviation))
    assert widest_position(report) == 6  # the one with the largest range
    table = table_of(report, "figure_06_all_cycles", tmp_path)
    assert table["deviation_um"].count("") == 1
    with drawing("test"):
        lines = draw_iso230_2(report).axes[0].get_lines()
        drawn = [np.asarray(line.get_ydata(), dtype=float) for line in lines]
    assert any(np.isnan(values).sum() == 1 and np.isnan(values[4]) for values in drawn)


def test_a_unidirectional_run_has_one_curve_and_no_figures_of_both_directions(
    tmp_path: Path,
) -> None:
    report = make_report(make_run(approaches="backward"))
    assert {chart.name for chart in charts_of(report)} == set(ALL_NAMES)
    with drawing("test"):
        figure = draw_iso230_2(report)
        axes, margin = figure.axes
        labels = axes.get_legend_handles_labels()[1]
        brackets = [text.get_text() for text in margin.texts]
        words = " ".join(text.get_text() for text in axes.texts)
    assert labels == ["mean backward ↓", "±2s backward", "single runs"]
    assert [text[:2] for text in brackets] == ["E↓", "A↓"]
    assert "R↓" in words
    assert "B " not in words
    table = table_of(report, "iso230_2", tmp_path)
    assert set(table["mean_forward_um"]) == {""}


def test_a_single_run_has_no_bands_and_says_so() -> None:
    report = make_report(make_run(12, 1, length=2750.0))
    names = {chart.name for chart in charts_of(report)}
    absent = {
        "figure_07_one_position",
        "figure_10_standard_deviation",
        "figure_13_shifted_to_first_position",
        "against_cycles",
    }
    assert names == set(ALL_NAMES) - absent
    with drawing("test"):
        figure = draw_iso230_2(report)
        labels = figure.axes[0].get_legend_handles_labels()[1]
        heading = figure.get_suptitle()
        brackets = [text.get_text()[0] for text in figure.axes[1].texts]
    assert not any("2s" in label for label in labels)
    assert "single run, no repeatability" in heading
    assert brackets == ["M", "E"]
    several = make_report(make_run(12, 3, length=2750.0))
    assert "means of all runs, no repeatability" in heading_of(several)
    one_way = make_report(make_run(12, 1, length=2750.0, approaches="forward"))
    chart = next(c for c in charts_of(one_way) if c.name == "figure_12_deviation_chart")
    with drawing(chart.name):
        labels = [text.get_text() for text in chart.draw(one_way).legends[0].get_texts()]
    assert labels == ["deviation forward ↑", "reference: position 1 in cycle 1"]


@pytest.mark.proof
def test_readings_without_any_spread_are_drawn() -> None:
    for targets in (1, 3):
        deviation = np.full((targets, 2, 2), 7.5)
        target = np.arange(float(targets))
        report = make_report(PositioningTest(AxisKind.LINEAR, target, deviation))
        for chart in charts_of(report):
            assert chart.svg(report).startswith(b"<?xml")


def test_the_figures_stand_on_the_chart_with_their_extents(written: Written) -> None:
    report, *_ = written
    result = report.iso230_2
    with drawing("test"):
        figure = draw_iso230_2(report)
    axes, margin = figure.axes
    for line, text, lower, upper, value in zip(
        margin.get_lines(),
        margin.texts,
        (result.mean_bidirectional, result.mean, result.mean - 2 * result.s),
        (result.mean_bidirectional, result.mean, result.mean + 2 * result.s),
        (result.M, result.E, result.A),
        strict=True,
    ):
        y = np.asarray(line.get_ydata(), dtype=float)
        assert y.min() == np.min(lower)
        assert y.max() == np.max(upper)
        assert y.max() - y.min() == pytest.approx(value, rel=1e-12)
        assert text.get_text().endswith(f"{value:.2f} µm")
    words = " ".join(text.get_text() for text in axes.texts)
    assert f"B {result.B:.2f} µm" in words
    assert f"R {result.R:.2f} µm" in words
    np.testing.assert_array_equal(axes.get_lines()[0].get_xdata(), report.test.target)
    np.testing.assert_array_equal(axes.get_xticks(minor=True), report.test.target)


def test_a_rotary_axis_is_drawn_in_degrees_and_arcseconds(tmp_path: Path) -> None:
    report = make_report(make_run(kind=AxisKind.ROTARY, length=360.0))
    for chart in charts_of(report):
        names = list(table_of(report, chart.name, tmp_path))
        assert not any(name.endswith(("_um", "_mm")) for name in names)
        assert any(name.endswith("_arcsec") for name in names)
    with drawing("test"):
        axes = draw_iso230_2(report).axes[0]
    assert axes.get_xlabel() == "target position [°]"
    assert axes.get_ylabel() == "deviation [arcsec]"


@pytest.mark.proof
def test_hostile_text_is_drawn_as_text() -> None:
    for text in HOSTILE:
        header = {"title": text, "axis": text}
        report = make_report(make_run(5, 3), header=header, source_name=text)
        chart = charts_of(report)[0]
        assert "script" not in chart.svg(report).decode("utf-8")
        with drawing(chart.name):
            figure = chart.draw(report)
            heading = figure.get_suptitle()
            width = figure._suptitle.get_window_extent().width
        assert width <= figure.get_figwidth() * figure.dpi
        assert "\x1b" not in heading
        assert "\u202e" not in heading
        if text.startswith("$"):
            assert text in heading


def heading_of(report: PositioningReport) -> str:
    with drawing("test"):
        return draw_iso230_2(report).get_suptitle()


def test_a_title_stands_whole_above_a_chart_or_not_at_all() -> None:
    test = make_run(5, 3)
    own_line = "Generated run, seed 26: a virtual axis, no machine was measured"
    two_lines = f"{own_line}, and this title is longer than one line above a chart can ever hold"
    for title, lines in (("short", 2), (own_line, 3), (two_lines, 4)):
        heading = heading_of(make_report(test, header={"title": title}))
        assert title in heading.replace("\n", " ")
        assert heading.count("\n") + 1 == lines
        assert "…" not in heading
    deviation = test.deviation.copy()
    deviation[:, 2] = np.nan  # a cycle without readings does not count
    holed = make_report(replace(test, deviation=deviation), against_cycles=None)
    assert "5 targets, 2 cycles" in heading_of(holed)
    for title in ("too long to show " * 20, "x" * 180):
        heading = heading_of(make_report(test, header={"title": title}))
        assert title[:10] not in heading
        assert heading.count("\n") == 1


def test_the_time_scale_stays_where_a_reading_is_missing() -> None:
    test = make_run(5, 12)
    position = widest_position(make_report(test))
    deviation, time_s, order = test.deviation.copy(), test.time_s.copy(), test.order.copy()
    for values in (deviation, time_s, order):
        values[position, [0, 6], 0] = np.nan
    gap = make_report(replace(test, deviation=deviation, time_s=time_s, order=order))
    places: list[float] = []
    for report in (make_report(test), gap):
        with drawing("test"):
            axes = draw_one_position(report).axes[0]
            (scale,) = axes.child_axes
            assert scale.get_xlabel().startswith("time since the first reading")
            time_of = scale._functions[0]
        places.append(float(time_of(np.array([7.0]))[0]))
    assert places[1] == pytest.approx(places[0], rel=1e-9)


def test_numbers_have_no_round_off_behind_their_last_digit() -> None:
    rows = [[0.1 + 0.2, 3, -1e-17, 1234.5678901234567, float("nan"), "forward"]]
    columns_of = ("a", "b", "c", "d", "e", "f")
    fine = NumberTable(columns_of, rows).as_csv().decode().splitlines()[1]
    assert fine == "0.3,3,0.0,1234.56789012,,forward"
    small = NumberTable(("a",), [[2.5e-13]], decimals=None).as_csv().decode()
    assert small == "a\n2.5e-13\n"


def test_progress_is_told_before_each_chart_and_at_the_end(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for save in ("png_bytes", "svg_bytes"):  # drawn they are above
        monkeypatch.setattr(f"thermaxis.report._style.{save}", lambda _: b"chart")
    told: list[tuple[int, int]] = []
    report = make_report(make_run(3, 2))
    write_figures(report, tmp_path, progress=lambda _, done, total: told.append((done, total)))
    assert told == [(done, len(ALL_NAMES)) for done in range(len(ALL_NAMES) + 1)]


def test_a_folder_that_cannot_be_made_is_an_error_in_words(tmp_path: Path) -> None:
    (tmp_path / "file").write_bytes(b"")
    with pytest.raises(ConfigurationError, match="cannot be written"):
        write_figures(make_report(make_run(3, 2)), tmp_path / "file" / "folder")


@pytest.mark.proof
def test_the_monte_carlo_chart_has_its_counts_beside_it(tmp_path: Path) -> None:
    result = montecarlo_difference(samples=500, repetitions=50, sigma_a=2.0)
    paths = write_montecarlo_figures(result, tmp_path)
    assert [path.suffix for path in paths] == [".png", ".svg", ".csv"]
    table = columns(paths[2])
    assert sum(numbers(table["source_count"])) == 500
    assert sum(numbers(table["derived_count"])) == 499
    np.testing.assert_allclose(numbers(table["class_to"]), result.histogram_edges[1:], rtol=1e-11)
    assert all(cell.isdigit() for cell in table["source_count"])
    again = write_montecarlo_figures(result, tmp_path / "again")
    assert [p.read_bytes() for p in paths] == [p.read_bytes() for p in again]
