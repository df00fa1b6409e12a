"""Files beyond the limits of size are refused at once: within a second and 200 MB."""

import io
import json
import re
import struct
import subprocess
import sys
import zipfile
from collections.abc import Iterable
from functools import cache
from pathlib import Path

import openpyxl
import pytest

from tests.refusals import refusal_of, said as found
from thermaxis.errors import MeasurementFileError
from thermaxis.files import read_positioning
from thermaxis.files.runs import _assemble
from thermaxis.files.table import (
    _columns,
    _csv_rows,
    _metadata,
    _source,
    _table,
    _workbook_parts,
)

SHEET = "xl/worksheets/sheet1.xml"
MAIN = b'xmlns="http://schemas.openxmlformats.org/spreadsheetml/2006/main"'
BEGIN = b'<?xml version="1.0"?><worksheet ' + MAIN + b"><sheetData>"
END = b"</sheetData></worksheet>"
SHARED = b"""<Override PartName="/xl/sharedStrings.xml" ContentType="application/vnd.openxml\
formats-officedocument.spreadsheetml.sharedStrings+xml"/>"""

CHILD = """
import json, sys, time
import thermaxis.files as files
from thermaxis.errors import MeasurementFileError
results = {}
for path in sys.argv[1:]:
    begin = time.process_time()
    try:
        files.read_positioning(path)
        said = "read"
    except MeasurementFileError as error:
        said = error.code
    results[path] = [time.process_time() - begin, said]
peak = None
try:  # not from resource: that peak is inherited from the process that started this one
    with open("/proc/self/status", encoding="ascii") as status:
        peak = next(int(l.split()[1]) * 1024e-6 for l in status if l.startswith("VmHWM"))
except OSError:
    pass
print(json.dumps([results, peak]))
"""


@cache
def empty_workbook() -> bytes:
    stream = io.BytesIO()
    book = openpyxl.Workbook()
    book.save(stream)
    return stream.getvalue()


def workbook(
    path: Path,
    sheet: Iterable[bytes],
    *,
    method: int = zipfile.ZIP_DEFLATED,
    more: dict[str, Iterable[bytes]] | None = None,
) -> Path:
    """Pack a workbook whose sheet, and further parts, come in pieces."""
    with (
        zipfile.ZipFile(path, "w", method) as archive,
        zipfile.ZipFile(io.BytesIO(empty_workbook())) as empty,
    ):
        parts = {name: [empty.read(name)] for name in empty.namelist()}
        types = parts["[Content_Types].xml"][0].replace(b"</Types>", SHARED + b"</Types>")
        parts |= {"[Content_Types].xml": [types], "xl/sharedStrings.xml": [b"<sst ", MAIN, b"/>"]}
        for name, pieces in {**parts, SHEET: [BEGIN, *sheet, END], **(more or {})}.items():
            with archive.open(name, "w") as part:
                for piece in pieces:
                    part.write(piece)
    return path


def sparse(path: Path, size: int, *, start: bytes = b"") -> Path:
    with path.open("wb") as stream:
        stream.write(start)
        stream.seek(size - 1)
        stream.write(b"1")
    return path


def filled(path: Path, piece: bytes, size: int) -> Path:
    path.write_bytes(piece * (size // len(piece)))
    return path


def lying(path: Path, source: Path) -> Path:
    """State that the sheet unpacks to 5000 bytes."""
    content = bytearray(source.read_bytes())
    place = content.find(b"PK\x01\x02")
    while place >= 0:
        (length,) = struct.unpack_from("<H", content, place + 28)
        if content[place + 46 : place + 46 + length] == SHEET.encode():
            struct.pack_into("<I", content, place + 24, 5000)
        place = content.find(b"PK\x01\x02", place + 4)
    path.write_bytes(content)
    return path


def large_directory(path: Path, source: Path) -> Path:
    content = bytearray(source.read_bytes())
    struct.pack_into("<I", content, content.rfind(b"PK\x05\x06") + 12, 50_000_000)
    path.write_bytes(content)
    return path


def hostile_files(folder: Path) -> dict[Path, str]:
    """Make each file, with a word of the error that it has to get."""
    row = b"<row>" + b"<c><v>-49.226</v></c>" * 1000 + b"</row>"
    many = [row] * (_workbook_parts.CELL_LIMIT // 1000 + 1)
    far = b'<row r="1048576"><c r="XFD1048576"><v>1</v></c></row>'
    wide = (b'<row r="%d"><c r="XFD%d"/></row>' % (k, k) for k in range(1, 2000))
    bomb = workbook(folder / "bomb.xlsx", [b" " * 10_000_000] * 9)
    return {
        sparse(folder / "large.csv", 100_000_001): "file_too_large",
        sparse(folder / "large.xlsx", 60_000_000): "not_text",
        filled(
            folder / "lines.csv", b"1,forward,0,1\n", _source.TEXT_LIMIT_BYTES
        ): "too_many_lines",
        filled(folder / "endless.csv", b"1,forward,0,1 ", 10_000_000): "line_too_long",
        sparse(folder / "packed.xlsx", 60_000_000, start=b"PK"): "file_too_large",
        bomb: "unpacked_too_large",
        lying(folder / "lying.xlsx", bomb): "file_damaged",
        large_directory(folder / "directory.xlsx", bomb): "workbook_too_large",
        workbook(folder / "far.xlsx", [far]): "too_many_cells",
        workbook(folder / "row.xlsx", [far.replace(b"1048576", b"99999999999")]): "too_many_cells",
        workbook(folder / "wide.xlsx", wide): "too_many_cells",
        workbook(folder / "cells.xlsx", many): "too_many_cells",
        workbook(folder / "tags.xlsx", [b"<a/>" * 100_000] * 10): "part_too_large",
        workbook(folder / "lzma.xlsx", [], method=zipfile.ZIP_LZMA): "unusual_workbook",
        workbook(folder / "texts.xlsx", [], more=texts(3_000_000)): "part_too_large",
        workbook(folder / "styles.xlsx", [], more=styles(2_000_000)): "part_too_large",
        workbook(
            folder / "parts.xlsx", [], more={f"a/{k}": [b"a"] for k in range(3000)}
        ): "workbook_too_large",
        workbook(
            folder / "entities.xlsx",
            [],
            more={SHEET: [b'<!DOCTYPE a [<!ENTITY b "cc"><!ENTITY d "&b;&b;">]><a>&d;</a>']},
        ): "unusual_workbook",
    }


def texts(count: int) -> dict[str, Iterable[bytes]]:
    pieces = [b"<si><t>a</t></si>" * 100_000] * (count // 100_000)
    return {"xl/sharedStrings.xml": [b"<sst ", MAIN, b">", *pieces, b"</sst>"]}


def styles(count: int) -> dict[str, Iterable[bytes]]:
    return {"xl/styles.xml": [b"<styleSheet ", MAIN, b">", b"<a/>" * count, b"</styleSheet>"]}


@pytest.mark.proof
def test_what_is_too_large_is_refused_soon_and_within_200_mb(tmp_path: Path) -> None:
    files = hostile_files(tmp_path)
    result = subprocess.run(
        [sys.executable, "-c", CHILD, *map(str, files)],
        capture_output=True,
        text=True,
        check=True,
        timeout=500,
    )
    results, peak_mb = json.loads(result.stdout)
    for path, word in files.items():
        seconds, said = results[str(path)]
        assert said == word, path.name
        assert seconds < 10.0, path.name  # of the processor; what is not refused takes minutes
    assert peak_mb is None or peak_mb < 200


def test_a_workbook_just_below_the_limit_of_cells_is_read(tmp_path: Path) -> None:
    """The limits leave room: tens of thousands of cells, and texts kept apart from them."""
    words = (b"cycle", b"direction", b"target_mm", b"deviation_um", b"forward", b"backward")
    shared = b"".join(b"<si><t>%s</t></si>" % word for word in words)
    shared = shared.replace(b"<t>target_mm</t>", b"<r><t>target</t></r><r><t>_mm</t></r>")
    heading = b"<row r='1'>" + b"".join(b"<c t='s'><v>%d</v></c>" % k for k in range(4)) + b"</row>"
    cell = b"<c><v>%d</v></c><c t='s'><v>%d</v></c><c><v>%d</v></c><c><v>%g</v></c>"
    rows = [
        b"<row>" + cell % (cycle, 4 + a, i, cycle / 8) + b"</row>"
        for cycle in range(1, 101)
        for a in (0, 1)
        for i in range(20)
    ]
    more = {"xl/sharedStrings.xml": [b"<sst ", MAIN, b">", shared, b"</sst>"]}
    path = workbook(tmp_path / "run.xlsx", [heading, *rows], more=more)
    test = read_positioning(path)
    assert test.deviation.shape == (20, 100, 2)
    assert test.deviation[3, 7, 1] == 1.0


def test_long_lines_cells_and_tables_are_errors_of_our_own(tmp_path: Path) -> None:
    path = tmp_path / "run.csv"
    heading = b"cycle,direction,target_mm,deviation_um"
    for content, said in (
        (heading + b"\n" + b"\n" * 2_000_001, "too_many_lines"),
        (heading + b"\n" + b'"a\n,"\n' * 2_000_001, "too_many_lines"),
        (b"1," * 1_000_000, "line 1: line_too_long"),
        (heading + b"\n" + b"1," * 1_000_000, "line 2: line_too_long"),
        (
            b"target_mm," + b",".join(b"%d" % k for k in range(1, 5000)) + b"\n",
            "line 1: run_headings_incomplete",
        ),
        *(
            (heading + b"\n1,forward,0," + cell + b"\n", "line 2")
            for cell in (b"9" * 200_000, b'"' + b"9" * 200_000 + b'"', b'"' + b"a" * 200_000)
        ),
        *(
            (heading + b"," + name + b"\n", "")  # in no time: nothing is looked for twice
            for name in (b"(" * 300_000, b"a" + b" " * 300_000 + b"(", b"=" * 300_000)
        ),
        (heading + b"," + b'"' * 300_000 + b"\n", ""),
    ):
        path.write_bytes(content)
        with pytest.raises(MeasurementFileError) as caught:
            read_positioning(path)
        assert len(str(caught.value)) < 1500
        assert said in found(caught.value)


def test_thousands_of_columns_of_the_same_name_take_no_time(tmp_path: Path) -> None:
    path = tmp_path / "run.csv"
    rows = [f"{c},{w},{t},1" for c in (1, 2) for w in "+-" for t in (0, 1)]
    lines = ["cycle,direction,target_mm,deviation_um" + ",t" * 4000]
    lines += [row + ",7" * 4000 for row in rows]
    path.write_text("\n".join([*lines, ""]), encoding="utf-8")
    test = read_positioning(path)
    assert len(test.channels) == 4000
    assert "t (4000)" in test.channels


def test_every_limit_stands_in_the_page_of_files(root: Path) -> None:
    page = (root / "docs" / "files.md").read_text(encoding="utf-8")
    limits = page.partition("## 6. Limits")[2].partition("## 7.")[0]
    said = limits.replace(",", "")
    megabytes = (
        _source.TEXT_LIMIT_BYTES,
        _source.LONGEST_LINE_BYTES,
        _source.WORKBOOK_LIMIT_BYTES,
        _workbook_parts.UNPACKED_LIMIT_BYTES,
    )
    for size in megabytes:
        assert f" {size // 1_000_000} MB" in said
    numbers = (
        _workbook_parts.CELL_LIMIT,
        _table.MAX_ROWS,
        _source.MAX_LINES,
        _table.MAX_COLUMNS,
        _table.HEADER_ROWS,
        _csv_rows.LONGEST_LINE,
        _assemble.MAX_TARGETS,
        _assemble.MAX_CELLS,
        _assemble.MAX_CHANNEL_CELLS,
        _assemble.CELLS_PER_READING,
        _assemble.SMALL_TABLE,
        _metadata.MAX_FIELDS,
        _columns.LONGEST_HEADING,
        _source.HEADER_TEXT_LIMIT,
    )
    for number in numbers:
        assert re.search(rf"(?<![0-9]){number}(?![0-9])", said), number
    assert f"{_source.NUMBER_LIMIT:.0e}".replace("+0", "") in said


def test_a_workbook_inside_a_comment_of_the_archive_deceives_nobody(tmp_path: Path) -> None:
    """An archive's end may be found in its comment: every candidate is checked."""
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w") as archive:
        archive.writestr("a", "b")
        archive.comment = b"PK\x05\x06" + bytes(8) + struct.pack("<I", 90_000_000) + bytes(6)
    path = tmp_path / "run.xlsx"
    path.write_bytes(stream.getvalue())
    assert refusal_of(read_positioning, path) == "workbook_too_large"
