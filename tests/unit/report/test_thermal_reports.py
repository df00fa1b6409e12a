"""Reports of identification and verification say what the results say, and obey no file."""

import csv
import io
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
import pypdfium2
import pytest

from tests.unit.report.builders import PageReader
from thermaxis.codes import Message, Place
from thermaxis.compensation import (
    CompensationModel,
    GainPoint,
    Output,
    Part,
    Provenance,
    Section,
    TrainingLog,
)
from thermaxis.errors import ConfigurationError
from thermaxis.files import model_sha256
from thermaxis.messages import text_of
from thermaxis.report import (
    write_identification_figures,
    write_identification_report,
    write_verification_figures,
    write_verification_report,
)
from thermaxis.report._document import Document, Fields, ItemList, Paragraph, Picture, Table
from thermaxis.report.thermal._comparison import MOST_OUTPUTS, verification_charts
from thermaxis.report.thermal._figures_table import baseline_words
from thermaxis.report.thermal._identification import identification_document
from thermaxis.report.thermal._identification_charts import identification_charts
from thermaxis.report.thermal._output import write_charts
from thermaxis.report.thermal._panels import ThermalChart
from thermaxis.report.thermal._verification import verification_document
from thermaxis.report.thermal._words import log_sha256, micrometres, significant, with_interval
from thermaxis.thermal import (
    Identification,
    InputDefinition,
    MeasuredOutput,
    Method,
    Records,
    ThermalLog,
    Verification,
    identify,
    records_of,
    verify,
)

pytestmark = pytest.mark.usefixtures("one_clock_and_regime")

PARTS = (
    Part("spindle", "T_spindle_C", "T_column_C", 3.0, (Section(26.0, 3000.0),),
         lowest_k=-0.5, highest_k=2.0, static_gain_um_per_k=24.0),
    Part("table", "T_table_C", "T_column_C", 0.0, (Section(-12.0, 1500.0), Section(-8.0, 9000.0)),
         gain_by_diameter=(GainPoint(0.0, 1.0), GainPoint(3000.0, 2.2)),
         lowest_k=-9.0, highest_k=9.0, static_gain_um_per_k=-15.0),
)  # fmt: skip
MODEL = CompensationModel(
    outputs=(Output("Z_um", PARTS),),
    provenance=Provenance(
        method="modal", program="thermaxis", logs=(TrainingLog("cal.csv", "ab" * 32, 400),)
    ),
)
MEASURED = (MeasuredOutput("Z_um", "Z_um"), MeasuredOutput("Z_D_um", "Z_um", 3000.0))
HOSTILE = (
    "<script>alert(1)</script>_um",
    '"><img src=x onerror=alert(1)>_um',
    "#panic() $\\frac{$ *_`@label<label>_um",
    "_hidden_um",
    "=cmd|' /C calc'!A0_um",
    "\u202egnp.exe\u2066\u001b]0;owned\u0007_um",
    "主轴😀" + "x" * 300 + "_um",
)


def lagged(u: np.ndarray, tau_s: float, step_s: float) -> np.ndarray:
    x = np.zeros(u.size)
    alpha = 1.0 - np.exp(-step_s / tau_s)
    for k in range(1, u.size):
        x[k] = x[k - 1] + alpha * (u[k - 1] - x[k - 1])
    return x


def make_log(
    seed: int = 1, rows: int = 500, step_s: float = 60.0, names: Mapping[str, str] | None = None
) -> ThermalLog:
    """Return a test of both heat sources: spindle first, then the table; each cools at the end."""
    random = np.random.default_rng(seed)
    t = step_s * np.arange(rows)
    end = t[-1]
    spindle = lagged(np.where((t > 0.05 * end) & (t < 0.5 * end), 6.0, 0.0), 1800.0, step_s)
    table = lagged(np.where((t > 0.4 * end) & (t < 0.8 * end), 4.0, 0.0), 2400.0, step_s)
    column = 0.4 * np.sin(2 * np.pi * t / 86_400.0)
    by_spindle, by_table = spindle - column, table - column
    z_spindle = 3.0 * by_spindle + 26.0 * lagged(by_spindle, 3000.0, step_s)
    z_table = -12.0 * lagged(by_table, 1500.0, step_s) - 8.0 * lagged(by_table, 9000.0, step_s)
    columns = {
        "T_spindle_C": 22.0 + spindle,
        "T_table_C": 22.5 + table,
        "T_column_C": 21.0 + column,
        "n_spindle_rpm": np.where((t > 0.05 * end) & (t < 0.5 * end), 3500.0, 0.0),
        "Z_um": 7.0 + z_spindle + z_table + random.normal(0.0, 0.3, rows),
        "Z_D_um": -2.0 + z_spindle + 2.2 * z_table + random.normal(0.0, 0.3, rows),
    }
    columns["Z_D_um"][: rows // 5] = np.nan
    renamed = {(names or {}).get(name, name): values for name, values in columns.items()}
    return ThermalLog.from_columns(renamed, sample_time_s=step_s, name=f"test {seed}")


def texts_of(document: Document) -> list[str]:
    """Return every text of a document but the charts."""
    found = [document.title, document.subtitle, document.footer]
    blocks = [*document.opening, *(b for s in document.sections for b in s.blocks)]
    for block in blocks:
        match block:
            case Paragraph():
                found.append(block.text)
            case ItemList():
                found += block.items
            case Table():
                found += [block.caption, *(c for row in block.rows for c in row)]
                found += [column.label for column in block.columns]
            case Fields():
                found += [word for pair in block.fields for word in pair]
            case Picture():
                found.append(block.caption)
            case _:
                pass
    return found


def tables_of(document: Document) -> list[Table]:
    return [b for s in document.sections for b in s.blocks if isinstance(b, Table)]


def table_with(document: Document, words: str) -> Table:
    return next(table for table in tables_of(document) if words in table.caption)


def captions_of(document: Document) -> list[str]:
    return [b.caption for s in document.sections for b in s.blocks if isinstance(b, Picture)]


def points_of(chart_csv: bytes) -> dict[tuple[str, str], list[tuple[float, float]]]:
    """Return the points of a chart by panel and line."""
    rows = list(csv.reader(io.StringIO(chart_csv.decode())))
    assert rows[0][:3] == ["panel", "quantity", "line"]
    found: dict[tuple[str, str], list[tuple[float, float]]] = {}
    for panel, _, line, x, y in rows[1:]:
        found.setdefault((panel, line), []).append((float(x), float(y)))
    return found


@pytest.fixture(scope="module")
def log() -> ThermalLog:
    return make_log()


@pytest.fixture(scope="module")
def result(log: ThermalLog) -> Verification:
    return verify(MODEL, [log], MEASURED)


@pytest.fixture(scope="module")
def charts(log: ThermalLog, result: Verification) -> dict[str, ThermalChart]:
    return {chart.name: chart for chart in verification_charts(MODEL, (log,), result)}


@pytest.fixture(scope="module")
def document(log: ThermalLog, result: Verification) -> Document:
    with pytest.MonkeyPatch.context() as patch:  # its words are the subject
        patch.setattr("thermaxis.report.thermal._panels.svg_bytes", lambda _: b"<svg/>")
        return verification_document(MODEL, [log], result)


@pytest.fixture(scope="module")
def records(log: ThermalLog) -> Records:
    inputs = [
        InputDefinition("spindle", "T_spindle_C", "T_column_C"),
        InputDefinition("table", "T_table_C", "T_column_C"),
    ]
    return records_of([log, make_log(2)], inputs, ["Z_um"])


@pytest.fixture(scope="module")
def found(records: Records) -> Identification:
    return identify(records)


# ---- verification -------------------------------------------------------------------------------


def test_the_tables_print_the_figures_of_the_result(
    document: Document, result: Verification
) -> None:
    rows = {row[0]: row for row in table_with(document, "beside simple rules").rows}
    for name, figures in result.pooled.items():
        assert rows[name][1] == str(figures.rows)
        assert float(rows[name][2]) == pytest.approx(figures.uncompensated_um, abs=0.005)
        assert float(rows[name][3]) == pytest.approx(figures.residual_um, abs=0.005)
        assert float(rows[name][4]) == pytest.approx(figures.rmse_um, abs=0.005)
        assert figures.static_rmse_um is not None
        assert float(rows[name][7]) == pytest.approx(figures.static_rmse_um, abs=0.005)
    table_3 = table_with(document, "Table 3")
    mean = result.mean_fit_percent
    assert mean is not None
    assert float(table_3.rows[-1][-2]) == pytest.approx(mean, abs=0.05)
    assert table_3.rows[1][2] == "D = 3000 mm"


def test_the_chart_of_one_output_draws_measured_simulated_and_their_difference(
    log: ThermalLog, result: Verification, charts: dict[str, ThermalChart]
) -> None:
    points = points_of(charts["figure_10_output_1"].numbers.as_csv())
    drawn = {line: np.array(p) for (_, line), p in points.items()}
    verified = result.logs[0].outputs[0]
    assert drawn["measured"][:, 0] == pytest.approx(log.time_s / 3600.0)
    assert drawn["measured"][:, 1] == pytest.approx(verified.measured_um)
    difference = drawn["measured"][:, 1] - drawn["simulated"][:, 1]
    assert drawn["residual"][:, 1] == pytest.approx(difference, abs=1e-8)
    total = drawn["spindle"][:, 1] + drawn["table"][:, 1]
    assert total == pytest.approx(drawn["simulated"][:, 1], abs=1e-8)


def test_after_one_part_alone_the_other_part_is_left(
    log: ThermalLog, result: Verification, charts: dict[str, ThermalChart]
) -> None:
    points = points_of(charts["figure_11_12_residuals"].numbers.as_csv())
    verified = result.logs[0].outputs[0]
    alone = np.array(points["After spindle alone", "Z_um"])[:, 1]
    expected = verified.residual_um + verified.contribution_um[:, 1]
    assert alone == pytest.approx(expected)
    after_all = np.array(points["After all parts", "Z_D_um (g = 2.2)"])[:, 1]
    other = result.logs[0].outputs[1].residual_um
    assert after_all == pytest.approx(other[~np.isnan(other)])


def test_inputs_are_drawn_relative_to_their_start_in_kelvin(
    log: ThermalLog, result: Verification, charts: dict[str, ThermalChart]
) -> None:
    points = points_of(charts["figure_07_08_09_conditions"].numbers.as_csv())
    spindle = np.array(points["Inputs relative to the start", "T_spindle_C"])[:, 1]
    start = float(np.mean(log.columns["T_spindle_C"][log.time_s <= 60.0]))
    assert spindle == pytest.approx(log.columns["T_spindle_C"] - start)
    assert ("Speeds", "n_spindle_rpm") in points


def test_an_input_outside_its_training_range_is_read_first(
    document: Document, result: Verification
) -> None:
    assert result.warnings
    first = document.opening[0], document.opening[1]
    assert isinstance(first[0], Paragraph)
    assert first[0].strong
    assert isinstance(first[1], ItemList)
    assert any("spindle" in text and "outside" in text for text in first[1].items)
    validity = table_with(document, "Range of every input")
    assert validity.rows[0][1] == "spindle"
    assert validity.rows[0][2] == "-0.500 to 2.00"
    assert validity.strong_rows == (0,)


def test_provenance_states_hashes_of_model_training_and_logs(
    document: Document, log: ThermalLog
) -> None:
    texts = texts_of(document)
    assert model_sha256(MODEL) in texts
    assert "ab" * 32 in texts
    assert log_sha256(log) in texts


def test_the_hash_of_a_log_is_of_its_content(log: ThermalLog) -> None:
    backwards = {name: log.columns[name] for name in sorted(log.columns, reverse=True)}
    same = ThermalLog.from_columns(backwards, sample_time_s=60.0, name="other")
    assert log_sha256(same) == log_sha256(log)
    values = {name: np.array(column) for name, column in log.columns.items()}
    values["Z_um"][7] += 1e-9
    assert log_sha256(ThermalLog.from_columns(values, sample_time_s=60.0)) != log_sha256(log)


def test_a_static_regression_that_is_better_is_said_in_strong_words(
    log: ThermalLog, result: Verification
) -> None:
    wrong = tuple(replace(part, direct_gain_um_per_k=90.0) for part in PARTS)
    model = CompensationModel(outputs=(Output("Z_um", wrong),))
    said = baseline_words(verify(model, [log], MEASURED[:1]).pooled)
    assert said == Paragraph(
        "No better than a static regression on the same inputs: Z_um.", strong=True
    )
    assert not baseline_words(result.pooled).strong


@pytest.mark.proof
def test_several_logs_have_their_own_figures_and_charts(
    log: ThermalLog, monkeypatch: pytest.MonkeyPatch
) -> None:
    logs = [log, *(make_log(seed, rows=90) for seed in range(2, 6))]
    result = verify(MODEL, logs, MEASURED[:1])
    charts = verification_charts(MODEL, tuple(logs), result)
    names = [chart.name for chart in charts]
    assert len(set(names)) == len(names)
    monkeypatch.setattr("thermaxis.report.thermal._panels.svg_bytes", lambda _: b"<svg/>")
    assert sum(name.startswith("figure_13") for name in names) == 4
    document = verification_document(MODEL, logs, result)
    headings = [section.heading for section in document.sections]
    assert [h for h in headings if h.startswith("Log ")] == [f"Log test {k}" for k in range(1, 6)]
    assert any("Only the first 4 logs are drawn" in text for text in texts_of(document))


@pytest.mark.proof
def test_many_outputs_and_parts_stay_readable(log: ThermalLog) -> None:
    names = [f"Z{k}_um" for k in range(9)]
    columns = {
        **log.columns,
        **{name: (k + 1) * log.columns["Z_um"] for k, name in enumerate(names)},
    }
    many = ThermalLog.from_columns(columns, sample_time_s=60.0, name="many")
    parts = tuple(
        Part(f"input {k}", "T_spindle_C", "T_table_C", 0.1 * k, (Section(0.2 * k, 600.0),))
        for k in range(1, 17)
    )
    model = CompensationModel(outputs=tuple(Output(name, parts) for name in names))
    result = verify(model, [many])
    charts = verification_charts(model, (many,), result)
    assert sum(chart.name.startswith("figure_10") for chart in charts) == MOST_OUTPUTS
    for chart in charts:
        points = points_of(chart.numbers.as_csv())
        panels = {panel for panel, _ in points}
        for panel in panels:
            lines = {line for p, line in points if p == panel and ", low" not in line}
            assert len({line.removesuffix(", high") for line in lines}) <= 6
    fig_10 = next(c for c in charts if c.name.startswith("figure_10"))
    points = points_of(fig_10.numbers.as_csv())
    drawn = {line: np.array(p)[:, 1] for (_, line), p in points.items()}
    shares = [v for line, v in drawn.items() if line.startswith(("input", "rest"))]
    assert len(shares) == 6
    assert np.sum(shares, axis=0) == pytest.approx(drawn["simulated"], abs=1e-7)


def test_logs_that_were_not_verified_are_refused(
    log: ThermalLog, result: Verification, tmp_path: Path
) -> None:
    for logs in ([log, log], [make_log(rows=100)]):
        with pytest.raises(ConfigurationError) as caught:
            write_verification_report(MODEL, logs, result, tmp_path / "r.html")
        assert caught.value.code == "other_logs_than_verified"


# ---- identification -----------------------------------------------------------------------------


@pytest.mark.usefixtures("not_laid_out")  # the same charts stand in the files below
def test_the_report_of_an_identification_prints_its_numbers(
    found: Identification, records: Records, log: ThermalLog
) -> None:
    logs = [log, make_log(2)]
    document = identification_document(found, records, logs, MODEL.provenance, reference_s=60.0)
    parts = table_with(document, "Parts of Z_um")
    output = found.outputs[0]
    assert output.model is not None
    for row, part in zip(parts.rows, output.model.parts, strict=True):
        assert float(row[1].split(" ±")[0]) == pytest.approx(part.dc_gain, rel=0.02)
    row = table_with(document, "Training rows").rows[0]
    assert float(row[1]) == pytest.approx(output.fit_percent, abs=0.05)
    assert float(row[3]) == pytest.approx(output.training_rmse_um["static"], abs=0.005)
    said = " ".join(captions_of(document))
    assert "figure 3 of the paper" in said
    assert "left part of figure 4" in said
    assert "right part of figure 4" in said
    assert any("heating" in text for text in texts_of(document))
    assert "ab" * 32 in texts_of(document)


def test_the_step_response_that_is_drawn_ends_near_the_dc_gain(
    found: Identification, records: Records, log: ThermalLog
) -> None:
    charts = identification_charts(found, records, [log, make_log(2)], reference_s=60.0)
    chart = next(c for c in charts if c.name == "figure_04_step_responses")
    points = points_of(chart.numbers.as_csv())
    output = found.outputs[0]
    assert output.model is not None
    for part in output.model.parts:
        drawn = np.array(points["Z_um", part.input_name])
        assert drawn[0, 1] == pytest.approx(part.direct_gain)
        assert drawn[-1, 1] == pytest.approx(part.dc_gain, rel=0.05)
    low, high = (
        np.array(points["Z_um", f"95 % band of spindle, {end}"]) for end in ("low", "high")
    )
    assert np.all(low[:, 1] < high[:, 1])
    bode = next(c for c in charts if c.name == "bode")
    gains = np.array(points_of(bode.numbers.as_csv())["Z_um", "spindle"])
    assert gains[0, 1] == pytest.approx(abs(output.model.parts[0].dc_gain), rel=0.02)


def test_a_model_file_has_its_responses_without_bands_and_says_so(
    charts: dict[str, ThermalChart],
) -> None:
    for name in ("figure_04_step_responses", "bode"):
        assert "No bands: a model file" in charts[name].caption
        assert b"band" not in charts[name].numbers.as_csv()


@pytest.mark.usefixtures("not_laid_out")
def test_polynomials_are_printed_with_their_poles(records: Records, log: ThermalLog) -> None:
    result = identify(records, method=Method.ARX, orders=(1, 1, 0))
    logs = [log, make_log(2)]
    document = identification_document(result, records, logs, Provenance(), reference_s=60.0)
    polynomials = result.outputs[0].polynomials
    assert polynomials is not None
    row = table_with(document, "Coefficients of Z_um").rows[0]
    assert float(row[1].split(";")[0]) == pytest.approx(polynomials.numerators[0][0], rel=1e-8)
    assert float(row[2].split(";")[1]) == pytest.approx(polynomials.denominators[0][1], rel=1e-8)
    pole = float(table_with(document, "Poles in z").rows[0][1])
    assert pole == pytest.approx(-polynomials.denominators[0][1], abs=1e-6)
    assert any("plane of z" in caption for caption in captions_of(document))


@pytest.mark.usefixtures("not_laid_out")
def test_an_unstable_model_is_reported_as_such(
    found: Identification, records: Records, log: ThermalLog
) -> None:
    said = (Message("warning-pole_unstable", {"inputs": ("spindle",), "modulus": 1.5}),)
    output = replace(found.outputs[0], model=None, std=(), warnings=said)
    unstable = replace(found, outputs=(output,), stable=False)
    document = identification_document(unstable, records, [log], MODEL.provenance, reference_s=60.0)
    texts = texts_of(document)
    assert "NOT STABLE: must not run anywhere" in texts
    assert text_of(replace(said[0], place=Place(channel="Z_um"))) in texts
    assert any("nothing was simulated" in text for text in texts)


@pytest.mark.usefixtures("not_laid_out")
def test_a_choice_among_candidates_shows_its_curve(log: ThermalLog) -> None:
    inputs = [InputDefinition(n, n) for n in ("T_spindle_C", "T_table_C", "T_column_C")]
    records = records_of([log], inputs, ["Z_um"])
    result = identify(records, choose=True)
    assert result.selection is not None
    document = identification_document(result, records, [log], Provenance(), reference_s=60.0)
    table = table_with(document, "by the number of channels")
    assert len(table.rows) == len(result.selection.curve)
    assert any("held out" in t.caption for t in tables_of(document))
    assert any("Choice among the candidates" in caption for caption in captions_of(document))


# ---- files --------------------------------------------------------------------------------------


@pytest.mark.usefixtures("not_laid_out")
def test_the_same_result_gives_the_same_bytes(log: ThermalLog, tmp_path: Path) -> None:
    result = verify(MODEL, [log], MEASURED[1:])
    paths = [tmp_path / name for name in ("0.pdf", "0.html", "1.pdf", "1.html")]
    write_verification_report(MODEL, [log], result, *paths)
    for suffix in (".pdf", ".html"):
        assert (tmp_path / f"0{suffix}").read_bytes() == (tmp_path / f"1{suffix}").read_bytes()
    pdf = pypdfium2.PdfDocument(tmp_path / "0.pdf")
    text = " ".join(page.get_textpage().get_text_range() for page in pdf)
    pdf.close()
    assert "Verification of a thermal compensation model" in text
    assert "page 1 of" in text
    assert "Z_D_um" in text


@pytest.mark.proof
def test_an_identification_is_written_as_pdf_and_html(
    found: Identification, records: Records, log: ThermalLog, tmp_path: Path
) -> None:
    logs = [log, make_log(2)]
    provenance = replace(MODEL.provenance, date="2026-03-31")
    paths = [tmp_path / name for name in ("i.pdf", "i.HTML")]
    write_identification_report(found, records, logs, provenance, *paths, reference_s=60.0)
    assert all(path.stat().st_size > 20_000 for path in paths)
    assert (tmp_path / "i.pdf").read_bytes().startswith(b"%PDF")
    assert "2026-03-31" in PageReader((tmp_path / "i.HTML").read_text("utf-8")).text


def test_another_suffix_is_refused_before_anything_is_drawn(
    log: ThermalLog, result: Verification, found: Identification, records: Records, tmp_path: Path
) -> None:
    with pytest.raises(ConfigurationError, match=r"\.docx.*\.pdf or \.html"):
        write_verification_report(MODEL, [log], result, tmp_path / "r.docx")
    with pytest.raises(ConfigurationError, match=r"\.pdf or \.html"):
        write_identification_report(
            found, records, [log], Provenance(), tmp_path / "r", reference_s=60.0
        )
    assert not list(tmp_path.iterdir())


@pytest.mark.proof
def test_hostile_names_show_themselves_and_are_never_obeyed(tmp_path: Path) -> None:
    names = {"T_spindle_C": HOSTILE[1].removesuffix("_um") + "_C", "Z_D_um": HOSTILE[3]}
    log = replace(make_log(rows=90, names=names), name=HOSTILE[2])
    columns = {**log.columns, **dict.fromkeys(HOSTILE, log.columns["Z_um"])}
    log = replace(log, columns=columns, units={**log.units, **dict.fromkeys(HOSTILE, "um")})
    parts = (
        replace(PARTS[0], plus=names["T_spindle_C"], name=HOSTILE[4]),
        replace(PARTS[1], name=HOSTILE[0]),
    )
    model = CompensationModel(
        outputs=(Output(HOSTILE[0], parts),),
        provenance=Provenance(method=HOSTILE[2], logs=(TrainingLog(HOSTILE[1], "x", 1),)),
        warnings=HOSTILE,
    )
    measured = [MeasuredOutput(name, HOSTILE[0]) for name in HOSTILE[3:5]]
    result = verify(model, [log], measured)
    write_verification_report(model, [log], result, tmp_path / "r.html", tmp_path / "r.pdf")
    page = (tmp_path / "r.html").read_text("utf-8")
    reader = PageReader(page)
    assert not reader.tags & {"script", "img", "iframe", "object", "a", "link"}
    assert not any(name.startswith("on") for name, _ in reader.attributes)
    assert "<script>alert(1)</script>" in reader.text
    assert "\u202e" not in page
    assert "\u001b" not in page
    pdf = pypdfium2.PdfDocument(tmp_path / "r.pdf")
    text = "".join(page.get_textpage().get_text_range() for page in pdf)
    pdf.close()
    assert "#panic()" in text
    for chart in verification_charts(model, (log,), result):
        for row in csv.reader(io.StringIO(chart.numbers.as_csv().decode())):
            assert not any(cell.startswith(("=", "+", "@")) for cell in row[:3])


@pytest.mark.proof
def test_figures_are_written_as_png_svg_and_csv_and_repeat(
    charts: dict[str, ThermalChart], tmp_path: Path
) -> None:
    one = [charts["figure_10_output_1"]]
    written, again = write_charts(one, tmp_path / "a"), write_charts(one, tmp_path / "b")
    assert {path.suffix for path in written} == {".png", ".svg", ".csv"}
    for path in again:
        assert path.read_bytes() == (tmp_path / "a" / path.name).read_bytes()


def test_every_figure_of_a_verification_and_an_identification_is_written(
    log: ThermalLog,
    result: Verification,
    found: Identification,
    records: Records,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def only_named(folder: Path, name: str, *_: object) -> list[Path]:
        return [folder / name]

    monkeypatch.setattr("thermaxis.report.thermal._output.write_chart", only_named)
    verified = write_verification_figures(MODEL, [log], result, tmp_path)
    assert len({path.stem for path in verified}) == len(verified) == 9
    identified = write_identification_figures(found, records, [log], tmp_path, reference_s=60.0)
    assert [path.stem for path in identified] == [
        "figure_04_fit_output_1",
        "figure_04_step_responses",
        "bode",
        "poles",
        "residuals_output_1",
        "figure_03_conditions",
    ]


@pytest.mark.usefixtures("not_laid_out")
def test_the_shortest_logs_and_one_without_speeds_are_shown(log: ThermalLog) -> None:
    quiet = log.select([name for name in log.columns if not name.endswith("rpm")])
    for short in (log.span(0, 1), quiet.span(0, 2)):
        result = verify(MODEL, [short], MEASURED[:1])
        captions = captions_of(verification_document(MODEL, [short], result))
        assert len(captions) == 6
    assert any("no speeds" in caption for caption in captions)


def test_a_long_log_gives_a_small_chart() -> None:
    long = make_log(rows=50_000, step_s=10.0)
    result = verify(MODEL, [long], MEASURED[:1])
    chart = next(
        c for c in verification_charts(MODEL, (long,), result) if c.name == "figure_10_output_1"
    )
    assert len(chart.svg()) < 400_000
    measured = np.array(points_of(chart.numbers.as_csv())["Z_um", "measured"])[:, 1]
    assert measured.size < 1100
    whole = result.logs[0].outputs[0].measured_um
    assert (measured.min(), measured.max()) == pytest.approx((whole.min(), whole.max()))


# ---- words --------------------------------------------------------------------------------------


def test_numbers_have_four_significant_digits_without_an_exponent() -> None:
    for value, words in [
        (0.0, "0"),
        (39.8149, "39.81"),
        (-0.6665880889, "-0.6666"),
        (6603.01, "6603"),
        (25_899.49, "25899"),
        (0.00012345, "0.0001234"),
        (1e12, "1.000e+12"),
        (float("nan"), "–"),
        (None, "–"),
    ]:
        assert significant(value) == words


def test_a_number_has_no_more_digits_than_its_interval() -> None:
    assert with_interval(39.8149, 0.1684, 1.96) == "39.81 ± 0.33"
    assert with_interval(6603.01, 429.0, 1.96) == "6603 ± 841"
    assert with_interval(6603.01, None, 1.96) == "6603"


def test_a_displacement_that_rounds_to_nothing_is_said_to_be_small() -> None:
    assert micrometres(0.0004) == "< 0.01"
    assert micrometres(0.0) == "0.00"
    assert micrometres(-0.0004) == "0.00"
    assert micrometres(12.344) == "12.34"
