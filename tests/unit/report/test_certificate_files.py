"""Certificates as files: PDF and HTML."""

import hashlib
import re
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pypdfium2
import pytest

from tests.proofs import quick_first
from tests.refusals import refused
from tests.unit.report.builders import PageReader, make_report, make_run
from thermaxis.codes import Message
from thermaxis.errors import ConfigurationError
from thermaxis.files import DecisionRule, FigureLimits, read_positioning
from thermaxis.files.settings import HEADER_FIELDS, HEADER_GROUPS
from thermaxis.positioning import FIGURE_KEYS, StartEnd, evaluate_iso230_2
from thermaxis.quantities import AxisKind
from thermaxis.report import FIGURE_NAMES, FIGURE_SYMBOLS, PositioningReport, write_report
from thermaxis.report._document import Document, ItemList, Picture, Section, Table, columns_of
from thermaxis.report.certificate import render_html
from thermaxis.report.certificate._certificate import build_certificate
from thermaxis.report.certificate._files import certificate_document, certificate_pdf
from thermaxis.report.certificate._pdf import document_pdf
from thermaxis.report.tables import results_sha256

HOSTILE = (
    '<script>alert(1)</script>"><img src=x onerror=alert(1)>]]> --> <!-- &amp; &#60;b&#62;',
    "#panic() $\\frac{$ *_`@label<label> =cmd|' /C calc'!A0",
    '#import "x" javascript:alert(1) {{7*7}} ${7*7} %s %n',
    "\u202egnp.exe\u2066 \u0000\u001b]0;owned\u0007 😀 主轴 العربية עברית" + "x" * 5000,
)
STATED = {
    key: "2026-03-02" if field.takes in {"day", "moment"} else f"<{key}>"
    for key, field in HEADER_FIELDS.items()
    if key not in {"machine", "axis", "title", "start", "end"} and field.only is not AxisKind.ROTARY
}
"""A text for every field that a linear axis has."""
HIDDEN = {"authorised_as", "reproduction", *(key for key in STATED if key.startswith("laborat"))}
"""Fields whose values stand on the first page without their labels."""
LIMITS = FigureLimits({"B": 4.0}, DecisionRule.SIMPLE, {}, "limits.toml")


def pdf_of(report: PositioningReport) -> bytes:
    return certificate_pdf(report, certificate_document(report))


def page_of(report: PositioningReport) -> str:
    return render_html(certificate_document(report))


def squeezed(text: str) -> str:
    """Return text without anything that the breaking of lines may change."""
    return "".join(text.replace("\u200b", "").replace("\ufffe", "-").split())


def pdf_pages(pdf: bytes) -> list[str]:
    document = pypdfium2.PdfDocument(pdf)
    pages = [page.get_textpage().get_text_range() for page in document]
    document.close()
    return pages


def assert_harmless(page: str) -> None:
    reader = PageReader(page)
    active = {"script", "iframe", "object", "embed", "link", "base", "form", "img", "a", "video"}
    assert not reader.tags & active
    for name, value in reader.attributes:
        assert not name.startswith("on")
        if name in {"href", "xlink:href", "src", "srcset", "action", "data", "poster"}:
            assert value.startswith("#")
        if not name.startswith("xmlns"):
            assert "://" not in value
            assert "url(" not in value.replace("url(#", "")
    assert len(reader.identifiers) == len(set(reader.identifiers))
    style = page[page.index("<style>") : page.index("</style>")]
    assert "url(" not in style
    assert "@import" not in style


@pytest.fixture(scope="module")
def small() -> PositioningReport:
    return make_report(make_run(), limits=LIMITS, header=STATED)


@pytest.fixture(scope="module")
def small_files(
    small: PositioningReport, tmp_path_factory: pytest.TempPathFactory
) -> tuple[bytes, str]:
    paths = [tmp_path_factory.mktemp("small") / f"certificate.{kind}" for kind in ("pdf", "html")]
    write_report(small, *paths)
    return paths[0].read_bytes(), paths[1].read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def small_pdf(small_files: tuple[bytes, str]) -> bytes:
    return small_files[0]


@pytest.fixture(scope="module")
def small_page(small_files: tuple[bytes, str]) -> str:
    return small_files[1]


def printed_figures(report: PositioningReport) -> list[tuple[str, str, str]]:
    """Return symbol, name and value of each figure as they are printed."""
    result = report.iso230_2
    names = FIGURE_NAMES[result.edition]
    return [(FIGURE_SYMBOLS[k], names[k], f"{getattr(result, k):.2f}") for k in FIGURE_KEYS]


@pytest.mark.usefixtures("no_charts")  # test_figures asks it of them
def test_two_renderings_of_a_report_are_the_same_bytes(small: PositioningReport) -> None:
    assert pdf_of(small) == pdf_of(small)
    assert page_of(small) == page_of(small)


def test_the_pdf_holds_every_label_every_figure_and_the_hash(
    small: PositioningReport, small_pdf: bytes
) -> None:
    text = squeezed(" ".join(pdf_pages(small_pdf)))
    for group in HEADER_GROUPS[2:]:
        assert squeezed(group.title) in text
        for field in group.fields:
            if field.only is not AxisKind.ROTARY:
                assert squeezed(field.label) in text
    assert all(squeezed(value) in text for value in STATED.values())
    for symbol, name, value in printed_figures(small):
        assert squeezed(symbol + name + value.replace("-", "−")) in text
    assert small.source_sha256 in text
    assert "notstated" not in text.replace("zonenotstated", "")
    assert results_sha256(small) in text
    assert "PASS" in text
    assert "Endofthecertificate." in text


def test_the_pdf_shows_czech_greek_and_the_symbols_of_the_standard(small_pdf: bytes) -> None:
    text = squeezed(" ".join(pdf_pages(small_pdf)))
    assert "Přejímkapoopravě:přílišžluťoučkýkůň" in text
    assert "FrézkaFNG32" in text
    for sign in ("µm", "E↑", "A↓", "B̄", "±", "x̄", "°C"):
        assert sign in text


def test_every_page_has_its_number_and_the_hash(small_pdf: bytes) -> None:
    pages = pdf_pages(small_pdf)
    assert 4 <= len(pages) <= 6
    for number, page in enumerate(pages, 1):
        assert f"page {number} of {len(pages)}" in page
        assert "Certificate <certificate_number>" in page
        assert "SHA-256 0123456789ab" in page
        assert "thermaxis 1.2.3" in page


@pytest.mark.usefixtures("no_charts")
def test_the_pdf_embeds_its_fonts_and_states_its_date(small: PositioningReport) -> None:
    pdf = pdf_of(replace(small, date="2026-11-20"))
    document = pypdfium2.PdfDocument(pdf)
    metadata = document.get_metadata_dict()
    size = document[0].get_size()
    document.close()
    assert metadata["Title"] == "Accuracy and repeatability of positioning, axis X"
    assert metadata["Author"] == "thermaxis 1.2.3"
    assert metadata["CreationDate"].startswith("D:20261120")
    assert size == pytest.approx((595.3, 841.9), abs=0.1)
    assert pdf.count(b"/FontFile3") + pdf.count(b"/FontFile2") > 0


def attachments_of(pdf: bytes) -> dict[str, bytes]:
    """Return the files inside a PDF as another library (PDFium) finds them."""
    document = pypdfium2.PdfDocument(pdf)
    files = [document.get_attachment(k) for k in range(document.count_attachments())]
    found = {one.get_name(): bytes(one.get_data()) for one in files}
    document.close()
    return found


def test_the_pdf_is_an_archive_that_carries_readings_and_results(
    small: PositioningReport, small_pdf: bytes, tmp_path: Path
) -> None:
    assert b"<pdfaid:part>3</pdfaid:part>" in small_pdf
    assert b"<pdfaid:conformance>B</pdfaid:conformance>" in small_pdf
    files = attachments_of(small_pdf)
    assert hashlib.sha256(files["results.json"]).hexdigest() == results_sha256(small)
    for borne in (results_sha256(small), "&lt;certificate_number&gt;"):
        assert borne.encode() in files["dcc.xml"]
    assert b"<dcc:document" not in files["dcc.xml"]
    path = tmp_path / "readings.csv"
    path.write_bytes(files["readings.csv"])
    assert evaluate_iso230_2(read_positioning(path)).A == small.iso230_2.A
    for relationship in (b"/AFRelationship/Source", b"/AFRelationship/Data"):
        assert relationship in small_pdf.replace(b"/AFRelationship /", b"/AFRelationship/")


@pytest.mark.usefixtures("no_charts")
def test_a_pdf_without_attachments_or_without_a_date_is_made_too(small: PositioningReport) -> None:
    alone = certificate_pdf(small, certificate_document(small), attachments=False)
    assert attachments_of(alone) == {}
    assert b"<pdfaid:part>3</pdfaid:part>" in alone
    undated = replace(small, header={}, test=replace(small.test, start=None, end=None))
    pdf = pdf_of(undated)
    assert b"pdfaid" not in pdf
    assert set(attachments_of(pdf)) >= {"results.json", "readings.csv"}


@pytest.mark.proof
@pytest.mark.usefixtures("no_charts")
def test_every_character_can_stand_in_an_archive(small: PositioningReport) -> None:
    blocks = [(0xA0, 0x530), (0x590, 0xA00), (0x1E00, 0x2C00), (0x4E00, 0x4E10), (0x1D400, 0x1D800)]
    texts = [
        "".join(map(chr, range(k, k + 300)))
        for first, end in blocks
        for k in range(first, end, 300)
    ]
    header = {**small.header, **{f"text {k}": text for k, text in enumerate(texts)}}
    pdf = pdf_of(replace(small, header=header))
    assert b"<pdfaid:part>3</pdfaid:part>" in pdf
    assert "□" in squeezed(" ".join(pdf_pages(pdf)))


@pytest.mark.proof
@pytest.mark.usefixtures("no_charts")
def test_a_hundred_cycles_fill_a_reasonable_number_of_pages(
    hundred_cycles: PositioningReport,
) -> None:
    pages = pdf_pages(pdf_of(hundred_cycles))
    assert 5 <= len(pages) <= 10  # without charts
    targets = f"{hundred_cycles.test.target[-1]:.3f}"
    assert sum("Cycle" in page and targets in page for page in pages) >= 2
    text = squeezed(" ".join(pages))
    last = hundred_cycles.test.deviation[:, -1, 1]
    row = "".join(f"{value:.2f}".replace("-", "−") for value in last)
    assert f"100↓{row}" in text


@pytest.mark.parametrize("lines", quick_first(2, range(0, 60, 9)))
def test_charts_follow_their_heading_in_order_and_rows_of_a_group_share_a_page(lines: int) -> None:
    svg = '<svg xmlns="http://www.w3.org/2000/svg" width="490" height="210"></svg>'
    groups = [[f"group{g}row{r}" for r in range(6)] for g in range(12)]
    rows = [(group[0][:-4], name) for group in groups for name in group]
    table = Table(columns_of("<group | name"), tuple(rows), "", tuple(range(5, 72, 6)), dense=True)
    charts = tuple(Picture(svg, f"Caption{k}.") for k in range(3))
    sections = (
        Section("Before", (ItemList(("a line",) * lines),)),
        Section("Charts", charts),
        Section("Budget", (table,)),
    )
    document = Document("title", "subtitle", None, "footer", "author", (), sections)
    pages = pdf_pages(document_pdf(document, None))
    text = " ".join(pages)
    places = [text.index(word) for word in ("Charts", "Caption0.", "Caption1.", "Caption2.")]
    assert places == sorted(places)
    for group in groups:
        assert sum(all(name in page for name in group) for page in pages) == 1


@pytest.mark.usefixtures("no_charts")
@pytest.mark.parametrize("text", quick_first(2, HOSTILE))
def test_hostile_text_is_shown_and_not_obeyed(text: str) -> None:
    test = replace(
        make_run(3, 1, length=2750.0),
        channels={text: np.zeros((3, 1, 2))},
        environment={text: StartEnd(1.0, 2.0)},
    )
    header = {**dict.fromkeys(HEADER_FIELDS, text), text: text}
    said = Message("remark-of_file", {"said": text})
    report = make_report(
        test, header=header, source_name=text, warnings=(said,), adjacent_difference=None
    )
    page = render_html(build_certificate(report, {}))
    assert_harmless(page)
    shown = PageReader(page).text
    pdf = squeezed(" ".join(pdf_pages(pdf_of(report))))
    for sign in ("\x00", "\x1b", "\u202e", "\u2066"):
        assert sign not in page
        assert sign not in pdf
    if text.isascii() and text.isprintable() and len(text) < 100:
        assert text in shown
        assert squeezed(text).replace("-", "") in pdf.replace("-", "").replace("−", "")
    assert "accuracy" in pdf


def test_the_page_needs_nothing_from_outside(small: PositioningReport, small_page: str) -> None:
    page = small_page
    assert_harmless(page)
    assert page.startswith('<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">')
    foot = page[page.index("@bottom-left") :]
    foot = foot[foot.index('content: "') + 10 : foot.index('"; }')]
    printed = re.sub(r"\\([0-9a-f]+) ", lambda found: chr(int(found[1], 16)), foot)
    assert printed == build_certificate(small, {}).footer
    policy = "default-src 'none'; style-src 'unsafe-inline'; img-src data:"
    assert f'http-equiv="Content-Security-Policy" content="{policy}"' in page
    reader = PageReader(page)
    assert page.count("<svg") == page.count("<figure>") == 3
    assert not {"html:script", "foreignobject", "use:script"} & reader.tags
    for symbol in FIGURE_SYMBOLS.values():
        assert symbol in reader.text
    for key, value in STATED.items():
        assert value in reader.text
        assert HEADER_FIELDS[key].label in reader.text or key in HIDDEN
    assert small.source_sha256 in reader.text
    text = squeezed(reader.text)
    for symbol, name, value in printed_figures(small):
        assert squeezed(symbol + name + value) in text


@pytest.mark.usefixtures("not_laid_out")
@pytest.mark.parametrize(
    ("targets", "cycles", "options"),
    quick_first(
        1,
        [
            (8, 3, {"approaches": "backward", "kind": AxisKind.ROTARY, "length": 360.0}),
            (12, 1, {"length": 2750.0}),
            (5, 2, {"times": False, "decimals": 6}),
        ],
    ),
)
def test_every_kind_of_run_has_a_certificate(
    targets: int, cycles: int, options: dict[str, object]
) -> None:
    report = make_report(make_run(targets, cycles, **options), against_cycles=None)
    document = certificate_document(report)
    assert len(pdf_pages(certificate_pdf(report, document))) >= 3
    assert_harmless(render_html(document))


@pytest.mark.usefixtures("no_charts")
def test_the_suffix_chooses_the_format_and_progress_ends_at_its_total(tmp_path: Path) -> None:
    report = make_report(make_run(3, 2), against_cycles=None)
    told: list[tuple[int, int]] = []
    for name, start in (("a.PDF", b"%PDF-"), ("a.html", b"<!DOCTYPE"), ("a.htm", b"<!DOCTYPE")):
        told.clear()
        write_report(report, tmp_path / name, progress=lambda _, *counts: told.append(counts))
        assert (tmp_path / name).read_bytes().startswith(start)
        assert told == [(done, told[0][1]) for done in range(told[0][1] + 1)]
    with refused("file_unwritable"):
        write_report(report, tmp_path / "no" / "such" / "folder.html")
    for name in ("certificate", "certificate.docx"):
        with pytest.raises(ConfigurationError, match=r"\.pdf or \.html"):
            write_report(report, tmp_path / name)
        assert not (tmp_path / name).exists()


def test_importing_the_package_brings_no_chart_library_and_no_typesetter() -> None:
    code = (
        "import sys, thermaxis.report;"
        "print([m for m in ('matplotlib', 'typst', 'tomllib', 'scipy') if m in sys.modules])"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, encoding="utf-8", check=True
    )
    assert done.stdout.strip() == "[]"
