"""The drift, its uncertainty and the diagnosis in figures and certificates."""

import csv
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.figure import Figure

from tests.unit.report.builders import make_report, make_run
from thermaxis.codes import Message
from thermaxis.files import DecisionRule, FigureLimits
from thermaxis.messages import sentence_of
from thermaxis.positioning import (
    FIGURE_KEYS,
    DriftModel,
    Finding,
    PositioningTest,
    TimeSource,
    UncertaintyBudget,
    diagnose,
    evaluate_drift,
    evaluate_uncertainty,
    figures_by_key,
)
from thermaxis.quantities import AxisKind
from thermaxis.report import (
    FIGURE_SYMBOLS,
    PositioningReport,
    Verdict,
    budget_table,
    check_limits,
    figure_table,
)
from thermaxis.report._document import Document, ItemList, Paragraph, Picture, Section, Table
from thermaxis.report._style import drawing, png_bytes, svg_bytes, write_chart
from thermaxis.report._text import two_digits
from thermaxis.report.certificate import render_html
from thermaxis.report.certificate._certificate import build_certificate
from thermaxis.report.charts import charts_of, time_words
from thermaxis.report.charts._drift_model import drift_at
from thermaxis.report.charts._figures import Chart
from thermaxis.report.charts._iso230_2 import draw_iso230_2
from thermaxis.report.dcc import dcc_xml
from thermaxis.report.tables import as_json, as_text, describe_evaluation, summary_of

HEADING = "Drift eliminated (not results of ISO 230-2)"
DIGITS = 2e-9
"""Numbers in files are rounded to nine decimals."""
HOSTILE = (
    "<script>alert(1)</script>",
    '"><img src=x onerror=alert(1)>',
    "#panic() $\\frac{$ *_`@label<label>",
    "=cmd|' /C calc'!A0",
    "\u202egnp.exe\u2066 \u0000\u001b]0;owned\u0007",
    "x" * 5000,
)


def drifting(test: PositioningTest, **fields: Any) -> PositioningReport:
    """Return a report with everything that the command evaluates of the drift."""
    drift = evaluate_drift(test)
    evaluated = {
        "drift": drift,
        "uncertainty": evaluate_uncertainty(test, drift, samples=200),
        "diagnosis": diagnose(test, drift),
    }
    return make_report(test, **{**evaluated, **fields})


def still(seed: int = 3) -> PositioningTest:
    """Return a run that does not drift."""
    test = make_run()
    noise = np.random.default_rng(seed).normal(0.0, 0.3, test.deviation.shape)
    level = 4.0 * np.sin(test.target / 60.0)[:, None, None]
    return replace(test, deviation=level + noise)


def bowing() -> PositioningTest:
    """Return a run whose axis bows in proportion to the time."""
    test = make_run(9, 8)
    share = test.time_s / np.max(test.time_s)
    x = (test.target / 150.0 - 1.0)[:, None, None]
    noise = np.random.default_rng(4).normal(0.0, 0.1, test.deviation.shape)
    return replace(test, deviation=share * (3.0 + 2.0 * x - 6.0 * x**2) + noise)


def document_of(report: PositioningReport) -> Document:
    return build_certificate(report, {})


def section_of(report: PositioningReport, heading: str = HEADING) -> Section:
    return next(s for s in document_of(report).sections if s.heading == heading)


def tables_of(section: Section) -> list[Table]:
    return [block for block in section.blocks if isinstance(block, Table)]


def words_of(section: Section) -> str:
    said: list[str] = []
    for block in section.blocks:
        if isinstance(block, ItemList):
            said += block.items
        elif isinstance(block, Paragraph):
            said.append(block.text)
    return " ".join(said)


def notes_of(report: PositioningReport) -> str:
    return words_of(document_of(report).sections[0])


def words_beside(report: PositioningReport) -> str:
    return " ".join(map(sentence_of, figure_table(report).legend))


def drift_chart(report: PositioningReport) -> Chart:
    return next(chart for chart in charts_of(report) if chart.name == "drift")


def draw(report: PositioningReport) -> Figure:
    chart = drift_chart(report)
    with drawing(chart.name):
        figure = chart.draw(report)
        figure.draw_without_rendering()
    return figure


def legend_of(figure: Figure) -> list[str]:
    return [text.get_text() for text in figure.legends[0].get_texts()]


def columns(content: bytes) -> dict[str, list[str]]:
    rows = list(csv.reader(content.decode("utf-8").splitlines()))
    return {name: [row[i] for row in rows[1:]] for i, name in enumerate(rows[0])}


def readings_table(report: PositioningReport) -> dict[str, list[str]]:
    return columns(drift_chart(report).numbers(report).as_csv())


def curves_table(report: PositioningReport) -> dict[str, list[str]]:
    return columns(drift_chart(report).more_numbers["curves"](report).as_csv())


def numbers(cells: list[str]) -> np.ndarray:
    return np.array([float(cell) if cell else np.nan for cell in cells])


def places(table: dict[str, list[str]], report: PositioningReport) -> tuple[np.ndarray, ...]:
    """Return target, cycle and approach of each row, from 0."""
    target = numbers(next(cells for name, cells in table.items() if name.startswith("target_")))
    i = np.searchsorted(report.test.target, target - 1e-6)
    j = numbers(table["cycle"]).astype(int) - 1
    return i, j, np.array([("forward", "backward").index(word) for word in table["direction"]])


@pytest.fixture(scope="module")
def report() -> PositioningReport:
    return drifting(make_run())


@pytest.fixture(scope="module")
def figure(report: PositioningReport) -> Figure:
    return draw(report)


# ---- the figure ----------------------------------------------------------------------------------


def test_the_figure_is_written_with_the_numbers_behind_it_and_the_same_bytes(
    report: PositioningReport, tmp_path: Path
) -> None:
    chart = drift_chart(report)
    tables = {"": chart.numbers(report)}
    tables |= {f"_{more}": table(report) for more, table in chart.more_numbers.items()}
    paths = write_chart(tmp_path, chart.name, lambda: chart.draw(report), tables)
    written = {path.name: path.read_bytes() for path in paths}
    assert sorted(written) == ["drift.csv", "drift.png", "drift.svg", "drift_curves.csv"]
    with drawing(chart.name):
        again = chart.draw(report)
        assert png_bytes(again) == written["drift.png"]
        assert svg_bytes(again) == written["drift.svg"]
    assert chart.numbers(report).as_csv() == written["drift.csv"]
    assert chart.more_numbers["curves"](report).as_csv() == written["drift_curves.csv"]
    svg = written["drift.svg"].decode("utf-8")
    assert "<text" not in svg
    assert "<image" not in svg


def test_the_numbers_of_the_readings_are_the_results_in_time_order(
    report: PositioningReport,
) -> None:
    test, drift = report.test, report.drift
    table = readings_table(report)
    at = places(table, report)
    assert len(table["cycle"]) == test.deviation.size
    time_s = numbers(table["time_s"])
    assert np.all(np.diff(time_s) > 0.0)
    np.testing.assert_array_equal(time_s, test.time_s[at])
    assert table["order"] == [str(n) for n in range(1, test.deviation.size + 1)]
    i, _, approach = at
    level = drift.level[i, approach]
    for name, expected in (
        ("deviation_um", test.deviation[at]),
        ("level_um", level),
        ("drift_um", drift.drift[at]),
        ("drift_free_um", drift.deviation[at]),
        ("deviation_less_level_um", test.deviation[at] - level),
        ("drift_free_less_level_um", drift.deviation[at] - level),
    ):
        np.testing.assert_allclose(numbers(table[name]), expected, rtol=0.0, atol=DIGITS)


def test_the_numbers_of_the_curves_are_the_results(report: PositioningReport) -> None:
    drift = report.drift
    table = curves_table(report)
    for name, expected in (
        ("time_s", drift.time_s),
        ("a_um", drift.common),
        ("a_std_um", drift.common_std),
        ("b_um_per_m", 1000.0 * drift.slope),
        ("b_std_um_per_m", 1000.0 * drift.slope_std),
    ):
        np.testing.assert_allclose(numbers(table[name]), expected, rtol=1e-11, atol=DIGITS)
    assert "bow_um" not in table


def test_the_drift_at_a_target_is_that_of_its_readings_and_a_bow_is_drawn_and_stated(
    report: PositioningReport,
) -> None:
    bowed = drifting(bowing())
    for one in (report, bowed):
        drift, time_s = one.drift, one.test.time_s
        assert (drift.bow is not None) == (one is bowed)
        for i, target in enumerate(one.test.target.tolist()):
            curve = np.interp(time_s[i], drift.time_s, drift_at(one, target))
            np.testing.assert_allclose(curve, drift.drift[i], atol=0.01 * np.ptp(drift.drift))
    table = curves_table(bowed)
    np.testing.assert_allclose(numbers(table["bow_um"]), drift.bow, atol=DIGITS)
    labels = [axes.get_ylabel() for axes in draw(bowed).axes]
    assert sum("bow" in label for label in labels) == 1
    rows = tables_of(section_of(bowed))[0].rows
    assert [row[0][:3] for row in rows] == ["a, ", "b, ", "bow"]
    assert "with a bow of the axis" in words_of(section_of(bowed))


def test_the_panes_hold_the_readings_the_drift_at_three_places_and_t0(
    report: PositioningReport, figure: Figure
) -> None:
    drift = report.drift
    raw, free, common, slope = figure.axes[:4]
    labels = legend_of(figure)
    assert labels[:2] == ["readings forward ↑", "readings backward ↓"]
    assert [label.split(",")[1][:10] for label in labels[2:5]] == [
        " first tar",
        " mid-axis ",
        " last targ",
    ]
    assert {"±2 standard uncertainties", "t₀, thermal state of the figures"} < set(labels)
    for axes in (raw, free):
        drawn = [line for line in axes.get_lines() if line.get_marker() in ("^", "v")]
        assert sum(np.size(line.get_xdata()) for line in drawn) == report.test.deviation.size
        faces = {line.get_marker(): line.get_markerfacecolor() == "white" for line in drawn}
        assert faces == {"^": False, "v": True}
    spans = [np.ptp(axes.get_ylim()) / axes.get_position().height for axes in (raw, free)]
    assert spans[0] == pytest.approx(spans[1], rel=0.02)  # the same scale
    for axes in (raw, free, common, slope):
        places_x = [np.asarray(line.get_xdata(), dtype=float) for line in axes.get_lines()]
        t0 = drift.reference_time_s / 60.0
        assert any(x.size == 2 and np.allclose(x, t0) for x in places_x)
    assert [axes.get_ylabel().split("\n")[1] for axes in (common, slope)] == ["[µm]", "[µm/m]"]
    (second,) = raw.child_axes
    assert second.get_xlabel() == "number of the reading"
    # readings are eight seconds apart
    assert np.diff(second.get_xlim()) == pytest.approx(np.diff(raw.get_xlim()) * 60.0 / 8.0)


def test_the_bands_are_two_standard_uncertainties(
    report: PositioningReport, figure: Figure
) -> None:
    drift = report.drift
    common = figure.axes[2]
    (band,) = common.collections
    vertices = band.get_paths()[0].vertices
    assert np.max(vertices[:, 1]) == pytest.approx(np.max(drift.common + 2.0 * drift.common_std))
    assert np.min(vertices[:, 1]) == pytest.approx(np.min(drift.common - 2.0 * drift.common_std))


@pytest.mark.proof
def test_temperatures_are_drawn_below_and_other_channels_are_not() -> None:
    test = make_run()
    values = np.full(test.deviation.shape, 20.0)
    values[0, 0, 0] = np.nan
    channels = {"scale_temperature_c": values, "room_C": values + 1.0, "force_n": values}
    deviation = test.deviation.copy()
    deviation[2, 3, 1] = np.nan  # a missing reading is in no row
    test = replace(test, deviation=deviation, time_source=TimeSource.INTERPOLATED)
    report = drifting(replace(test, channels=channels))
    figure = draw(report)
    assert figure.axes[4].get_ylabel() == "temperature\n[°C]"
    labels = legend_of(figure)
    assert {"scale_temperature_c", "room_C"} < set(labels)
    assert "force_n" not in labels
    table = readings_table(report)
    assert table["channel_1_scale_temperature_c"][0] == ""
    assert set(table["channel_2_room_C"][1:]) == {"21.0"}
    assert len([name for name in table if name.startswith("channel")]) == 2
    assert len(table["cycle"]) == test.deviation.size - 1
    assert "" not in table["drift_free_um"]
    words = "times interpolated between start and end, one reading every 8 s"
    assert time_words(report) == words
    assert words in figure.axes[4].get_xlabel()
    assert words[1:] in words_of(section_of(report))


@pytest.mark.proof
def test_a_long_run_is_drawn_in_part_and_the_chart_says_so() -> None:
    long = make_run(9, 150)
    report = make_report(long, drift=evaluate_drift(long))
    figure = draw(report)
    assert "1998 of 2700 readings drawn" in figure.get_suptitle()
    assert len(readings_table(report)["cycle"]) == 2700


# ---- runs of other kinds -------------------------------------------------------------------------


def test_without_a_drift_nothing_is_said_of_it() -> None:
    report = make_report(make_run())
    assert "drift" not in {chart.name for chart in charts_of(report)}
    headings = [section.heading for section in document_of(report).sections]
    assert HEADING not in headings
    assert "Diagnosis" not in headings
    assert "The measurement uncertainty was not evaluated." in notes_of(report)
    annex = section_of(report, "Annex A: results of each target")
    assert len(tables_of(annex)) == 1


def test_a_run_that_does_not_drift_is_left_as_it_was() -> None:
    report = drifting(still(5))
    drift = report.drift
    assert drift.model is DriftModel.NONE
    words = words_of(section_of(report))
    assert "No drift is seen (p = " in words
    assert "the run is left as it was" in words
    assert "the later visit" not in words
    assert "Model:" not in words
    figure = draw(report)
    std = drift.common_std
    (band,) = figure.axes[2].collections
    assert np.max(band.get_paths()[0].vertices[:, 1]) == pytest.approx(3.0 * np.max(std))
    assert "±3 standard uncertainties" in legend_of(figure)
    assert "± 3 standard uncertainties" in tables_of(section_of(report))[0].caption
    rows = figure_table(report)
    places = [rows.labels.index(label) for label in ("value", "drift-free")]
    assert all(cells[places[0]] == cells[places[1]] for cells in rows.cells)
    assert "Drift: none is seen" in figure.get_suptitle()
    assert [label for label in legend_of(figure) if label.startswith("drift")] == [
        "drift: none is seen"
    ]
    table = readings_table(report)
    assert table["deviation_um"] == table["drift_free_um"]
    assert all(row[1].startswith("0.0") for row in tables_of(section_of(report))[0].rows)


@pytest.mark.proof
def test_the_order_as_time_is_named_in_figure_and_certificate() -> None:
    timed = make_run()
    test = replace(timed, time_source=TimeSource.ORDER, time_s=None)
    report = drifting(test)
    figure = draw(report)
    assert figure.axes[0].child_axes == []
    words = "no times: the order of the readings serves as time"
    assert figure.axes[3].get_xlabel() == f"number of the reading ({words})"
    said = words_of(section_of(report))
    assert words[1:] in said
    assert "t₀, at reading 45.5 in the order of acquisition." in said
    for deduced, word in ((False, "known"), (True, "assumed")):
        one = replace(report, test=replace(test, order_deduced=deduced))
        (table, *_) = [b for b in document_of(one).opening if isinstance(b, Table)]
        assert ("The order of the readings is assumed" in table.caption) is deduced
        assert f"no times, order {word}" in " ".join(summary_of(one).split())
        assert f"the order of readings is {word}" in str(document_of(one).sections)
        assert ("the assumed order" in draw(one).axes[3].get_xlabel()) is deduced
    assert "time_s" not in readings_table(report)
    assert float(curves_table(report)["order"][-1]) == test.deviation.size


@pytest.mark.proof
def test_a_unidirectional_run_has_one_direction_and_no_reversal() -> None:
    report = drifting(make_run(cycles=8, approaches="backward"))
    labels = [label for label in legend_of(draw(report)) if label.startswith("readings")]
    assert labels == ["readings backward ↓"]
    levels = tables_of(section_of(report, "Annex A: results of each target"))[1]
    assert len(levels.columns) == 4
    row = figure_table(report).cells[0]
    assert (row[0], *row[2:]) == ("B", "absent", "", "", "", "", "")
    assert set(readings_table(report)["direction"]) == {"backward"}


@pytest.mark.proof
def test_a_rotary_axis_drifts_in_arcseconds() -> None:
    report = drifting(make_run(kind=AxisKind.ROTARY, length=360.0))
    for table in (readings_table(report), curves_table(report)):
        assert not any("_um" in name or "_mm" in name for name in table)
    assert "b_arcsec_per_1000_deg" in curves_table(report)
    section = section_of(report)
    assert "µm" not in str(section)
    assert "b, change of scale [arcsec per 1000°]" in str(tables_of(section)[0].rows)
    assert draw(report).axes[2].get_ylabel().endswith("[arcsec]")


@pytest.mark.proof
def test_an_outlier_is_named_in_the_certificate_and_marked_in_the_figure() -> None:
    test = make_run(9, 10)
    deviation = test.deviation.copy()
    deviation[6, 4, 1] += 40.0
    report = drifting(replace(test, deviation=deviation))
    words = words_of(section_of(report))
    assert "The reading of target 7 backward in cycle 5 lies" in words
    figure = draw(report)
    assert "outliers, left out (on the edge: farther out)" in legend_of(figure)
    (first_page, *_) = [b for b in document_of(report).opening if isinstance(b, Table)]
    (outlier,) = report.drift.outliers
    named = f"target 7 backward in cycle 5 ({outlier.residual:+.2f} µm off)"
    assert named in first_page.caption
    assert "left out of the drift-free ones" in first_page.caption
    low, high = figure.axes[0].get_ylim()
    assert high - low < 20.0
    (cross,) = [line for line in figure.axes[0].get_lines() if line.get_marker() == "x"]
    assert np.asarray(cross.get_ydata()) == pytest.approx(high)
    table = readings_table(report)
    row = table["drift_um"].index("")
    assert (table["cycle"][row], table["direction"][row]) == ("5", "backward")
    assert float(table["deviation_um"][row]) == deviation[6, 4, 1]


# ---- the certificate -----------------------------------------------------------------------------


def test_the_section_follows_the_standards_results_and_says_that_it_is_none(
    report: PositioningReport,
) -> None:
    headings = [section.heading for section in document_of(report).sections]
    results = next(k for k, h in enumerate(headings) if h.startswith("Notes to the results"))
    adjacent = next(k for k, h in enumerate(headings) if "adjacent-difference" in h)
    assert results < headings.index(HEADING) < headings.index("Diagnosis") < adjacent
    assert "are not results of ISO 230-2" in words_of(section_of(report))


def test_one_table_has_the_measured_and_the_drift_free_figures_with_their_u(
    report: PositioningReport,
) -> None:
    drift, uncertainty = report.drift, report.uncertainty
    (table, *_) = [b for b in document_of(report).opening if isinstance(b, Table)]
    labels = [column.label for column in table.columns]
    assert labels[2:] == [*("value", "U", "k", "drift-free", "its U", "effect of drift")]
    without = figures_by_key(drift.figures)
    measured, free = uncertainty.measured, uncertainty.drift_free
    for key, row in zip(FIGURE_KEYS, table.rows, strict=True):
        figure = getattr(report.iso230_2, key)
        assert (row[0], *row[3:5], row[6]) == (
            FIGURE_SYMBOLS[key],
            two_digits(measured.expanded_uncertainty[key]),
            f"{measured.coverage_factor[key]:.2f}",
            two_digits(free.expanded_uncertainty[key]),
        )
        for value, text, u in ((figure, *row[2:4]), (without[key], *row[5:7])):
            decimals = len(u.partition(".")[2])
            assert text == f"{value:.{decimals}f}"
        effect, band = row[7].split(" ± ")
        assert float(effect) == pytest.approx(figure - without[key], abs=0.06)
        assert float(band) == pytest.approx(uncertainty.drift_effect[key], abs=0.05, rel=0.06)
    assert "expanded uncertainty by Monte Carlo (JCGM 101, 200 draws, seed 1)" in notes_of(report)
    assert "with a probability of 95.45 %. U contains: scatter of the readings" in table.caption
    assert "U is without: instrument and environment: no budget was given." in table.caption
    assert "Drift-free figures are no results of ISO 230-2." in table.caption
    assert "at its time and with its drift" in notes_of(report)
    alone = notes_of(replace(report, drift=None))
    assert "at its time and with its drift" not in alone
    assert "counts as scatter" in alone


def test_a_u_larger_than_its_figure_is_remarked_upon(report: PositioningReport) -> None:
    figures = report.uncertainty.measured
    large = {**figures.expanded_uncertainty, "R": 1e3, "B_mean": 1e3}
    found = replace(report.uncertainty, measured=replace(figures, expanded_uncertainty=large))
    assert "U of R is larger than the figure" in notes_of(replace(report, uncertainty=found))
    assert "is larger than the figure" not in notes_of(report)


def test_where_a_swing_or_a_jump_makes_u_doubtful_no_coverage_is_claimed(
    report: PositioningReport,
) -> None:
    swing = Message("warning-swing_too_fast", {"time": 9.0, "unit": "min", "cycles": 1.0})
    for code, doubted in (
        ("doubt-swing", replace(report.drift, warnings=(swing,))),
        ("doubt-jump", replace(report.drift, changes=(object(),))),
    ):
        doubtful = replace(report, drift=doubted)
        assert "Here U may be too small: the axis" in words_beside(doubtful)
        assert "with a probability of 95.45 %." not in words_beside(doubtful)
        if code == "doubt-swing":
            uncertainty = as_json(describe_evaluation(doubtful))["uncertainty"]
            assert uncertainty["may_be_too_small_codes"][0]["code"] == code
            assert "± U: may cover less than 95.45 % (the axis swings" in summary_of(doubtful)
    assert as_json(describe_evaluation(report))["uncertainty"]["may_be_too_small"] == []


def test_the_numbers_of_the_table_are_the_same_in_pdf_html_terminal_and_json(
    report: PositioningReport,
) -> None:
    table = figure_table(report)
    page, described = render_html(document_of(report)), describe_evaluation(report)
    text, written = as_text(described), as_json(described)
    for row, cells, entry in zip(table.rows, table.cells, written["figure_table"], strict=True):
        assert all(f">{cell}</td>" in page for cell in cells)
        line = next(one for one in text.splitlines() if one.split()[:2] == [cells[0], cells[2]])
        assert all(cell in line for cell in (cells[0], *cells[2:]))
        assert entry["figure"] == row.key
        for name, value in entry.items():
            if name != "figure":
                assert value == getattr(row, name)
        assert row.drift_effect == row.value - row.drift_free


def test_the_drift_is_stated_with_bands_that_hold_both_ends(report: PositioningReport) -> None:
    drift = report.drift
    common, slope = tables_of(section_of(report))[0].rows
    for cell, value, std in (
        (common[1], drift.common[0], drift.common_std[0]),
        (common[2], drift.common[-1], drift.common_std[-1]),
        (slope[1], 1e3 * drift.slope[0], 1e3 * drift.slope_std[0]),
    ):
        stated, band = cell.split(" ± ")
        assert band == two_digits(2.0 * float(std))
        assert float(stated) == pytest.approx(float(value), abs=0.5)
    total, band = common[3].split(" ± ")
    assert float(total) == pytest.approx(drift.total, abs=0.05 * abs(drift.total))
    both = 2.0 * float(drift.common_std[0] + drift.common_std[-1])
    assert band == two_digits(both)


def test_model_state_and_noise_are_stated(report: PositioningReport) -> None:
    drift = report.drift
    words = words_of(section_of(report))
    kind = {"line": "a straight line in time", "smooth": "a smooth curve in time"}
    assert f"Model: {kind[str(drift.model)]}" in words
    assert f"{drift.reference_time_s / 60.0:.1f} min after the first reading" in words
    assert f"↑ {drift.noise_std[0]:.3f}, ↓ {drift.noise_std[1]:.3f} µm" in words
    assert f"of all residuals: {drift.residual_std:.3f} µm" in words


def test_the_annex_has_the_levels_with_their_standard_uncertainties(
    report: PositioningReport,
) -> None:
    drift = report.drift
    levels = tables_of(section_of(report, "Annex A: results of each target"))[1]
    assert [column.label for column in levels.columns[2:]] == ["mean ↑", "u ↑", "mean ↓", "u ↓"]
    for i, row in enumerate(levels.rows):
        expected = [f"{v:.3f}" for a in (0, 1) for v in (drift.level[i, a], drift.level_std[i, a])]
        assert list(row[2:]) == expected


def test_uncertainties_of_the_limits_file_come_first_and_decide(report: PositioningReport) -> None:
    limits = FigureLimits({"B": 4.0}, DecisionRule.ISO14253_1, {"B": 0.37}, "limits.toml")
    uncertainty = report.uncertainty.with_stated(limits.expanded_uncertainty)
    check = check_limits(limits, report.iso230_2, uncertainty.measured)
    limited = replace(report, limits=check, uncertainty=uncertainty)
    row = figure_table(limited).rows[0]
    assert (row.expanded_uncertainty, row.guard_band, row.coverage_factor) == (0.37, 0.37, 2.0)
    assert as_json(describe_evaluation(limited))["uncertainty"]["measured"]["stated"] == ["B"]
    assert "U of B is stated in the limits file (k = 2)" in words_beside(limited)
    assert check.reservation is None


def test_the_evaluated_uncertainty_decides_where_no_other_is_stated(
    report: PositioningReport,
) -> None:
    lacking, limited = report.uncertainty.measured, report
    partly = with_budget(report, UncertaintyBudget(device=0.5)).uncertainty.measured
    nil = {key: 0.0 for key in UncertaintyBudget.__dataclass_fields__ if "device" not in key}
    report = with_budget(report, UncertaintyBudget(device=0.5, **nil))
    measured = report.uncertainty.measured
    u, b = measured.expanded_uncertainty["B"], float(report.iso230_2.B)
    for rule, limit, verdict, guard_band in (
        (DecisionRule.ISO14253_1, b + 1.01 * u, Verdict.PASS, u),
        (DecisionRule.ISO14253_1, b + 0.99 * u, Verdict.NOT_DECIDED, u),
        (DecisionRule.ISO14253_1, b - 0.99 * u, Verdict.NOT_DECIDED, u),
        (DecisionRule.ISO14253_1, b - 1.01 * u, Verdict.FAIL, u),
        (DecisionRule.SIMPLE, b + 0.01 * u, Verdict.PASS, 0.0),
        (DecisionRule.SIMPLE, b - 0.01 * u, Verdict.FAIL, 0.0),
    ):
        limits = FigureLimits({"B": limit}, rule, {}, "limits.toml")
        check = check_limits(limits, report.iso230_2, measured)
        row = figure_table(replace(report, limits=check)).rows[0]
        assert (row.verdict, row.guard_band) == (verdict, guard_band)
        assert check.reservation is None
        for uncertainty in (None, partly, lacking):  # not every term is known
            bare = check_limits(limits, report.iso230_2, uncertainty)
            simple = rule is DecisionRule.SIMPLE
            assert bare.verdict is (verdict if simple else Verdict.NOT_DECIDED)
            assert bare.reservation.code == "verdict-u_lacks"
            if uncertainty is partly:
                assert "[material] temperature_interval_k" in sentence_of(bare.reservation)
                assert "[device]" not in sentence_of(bare.reservation)
    for said in (
        render_html(document_of(replace(limited, limits=bare))),
        summary_of(replace(limited, limits=bare)),
        as_json(describe_evaluation(replace(limited, limits=bare)))["limits"]["reservation"],
        dcc_xml(replace(limited, limits=bare)).decode(),
    ):
        assert "U of B is without instrument and environment: no budget was given" in said


def with_budget(report: PositioningReport, budget: UncertaintyBudget) -> PositioningReport:
    found = evaluate_uncertainty(report.test, report.drift, budget=budget, samples=200)
    return replace(report, uncertainty=found)


def test_a_budget_is_a_table_of_quantities_that_adds_up(report: PositioningReport) -> None:
    budget = UncertaintyBudget(device=0.5, environmental_variation=4.0)
    budgeted = with_budget(report, budget)
    (table,) = tables_of(section_of(budgeted, "Uncertainty budget (GUM)"))
    rows = [row[1:] for row in table.rows if row[0] == "E"]
    assert [row[0] for row in rows[:-1]] == [
        *("scatter of the readings", "bias of maxima and minima, not corrected", "instrument"),
        "environmental variation",
        "rounding of the readings",
    ]
    assert rows[2][1:4] == ("0.50 µm", "normal", "0.25 µm")
    figure = next(row for row in figure_table(budgeted).rows if row.key == "E")
    assert rows[-1][0] == (
        f"U = {two_digits(figure.expanded_uncertainty)} µm (k = {figure.coverage_factor:.2f})"
    )
    total = np.sqrt(sum(float(row[5]) ** 2 for row in rows[:-1]))
    assert float(rows[-1][5]) == pytest.approx(total, rel=0.1)  # two digits each, few draws
    assert "misalignment of the beam: not stated in the budget" in words_beside(budgeted)
    within = with_budget(report, UncertaintyBudget(device=0.5, environmental_variation=1e-3))
    contained, _, lacking = words_beside(within).partition("U is without")
    assert "environmental variation (the scatter" in contained
    assert "environmental variation" not in lacking
    assert budget_table(replace(report, uncertainty=None)) is None


def test_the_diagnosis_is_printed_in_its_order(report: PositioningReport) -> None:
    assert report.diagnosis
    listed = next(b for b in section_of(report, "Diagnosis").blocks if isinstance(b, ItemList))
    assert listed.items == tuple(sentence_of(one.message) for one in report.diagnosis)
    assert listed.numbered


def followed(channel: str) -> Message:
    values = {"channel": channel, "correlation": 0.95, "gain": 1.0, "unit": "µm"}
    return Message("finding-temperature_channel", values)


def test_hostile_names_of_channels_and_findings_are_shown_and_not_obeyed() -> None:
    test = make_run(5, 4)
    channels = {f"{text} temp": np.full(test.deviation.shape, 21.0) for text in HOSTILE}
    findings = tuple(
        Finding("temperature_channel", 1.0, "µm/K", followed(text), None) for text in HOSTILE
    )
    report = drifting(replace(test, channels=channels), diagnosis=findings)
    chart = drift_chart(report)
    with drawing(chart.name):
        figure = chart.draw(report)
        svg = svg_bytes(figure)
    picture = Picture(svg.decode("utf-8"), "Drift.")
    page = render_html(build_certificate(report, {"drift": picture}))
    assert "<script" not in page.lower()
    assert "<img" not in page.lower()
    named = [name for name in readings_table(report) if name.startswith("channel_")]
    assert len(named) == len(HOSTILE)
    assert all(name.replace("_", "").isalnum() and len(name) < 60 for name in named)
    labels = legend_of(figure)
    assert not any(c in label for label in labels for c in "\x1b\x00\u202e")
    assert max(map(len, labels)) < 50


def test_labels_of_the_chart_have_the_digits_of_the_table(report: PositioningReport) -> None:
    with drawing("iso230_2"):
        axes = draw_iso230_2(report).axes
    labels = " ".join(text.get_text() for one in axes for text in one.texts)
    cells = {row[0]: row[2] for row in figure_table(report).cells}
    for symbol in "BRMEA":
        assert f"{symbol} {cells[symbol]} µm" in labels
