import io
import re
import zipfile
from collections.abc import Callable, Sequence
from datetime import datetime, timedelta
from pathlib import Path

import numpy as np
import openpyxl
import pytest

from tests.refusals import refusal_of
from tests.unit.files.builders import remarks_of
from thermaxis.files import read_positioning
from thermaxis.positioning import BACKWARD, FORWARD, PositioningTest, TimeSource

HEADING = ("cycle", "direction", "target_mm", "deviation_um")
ROWS = tuple(
    (cycle, ("forward", "backward")[a], target, cycle + target / 8 - a)
    for cycle in (1, 2)
    for a in (0, 1)
    for target in (0.0, 12.5)
)
SHEET = "xl/worksheets/sheet1.xml"


def save(tmp_path: Path, *sheets: Sequence[Sequence[object]]) -> Path:
    book = openpyxl.Workbook()
    book.remove(book.worksheets[0])
    for rows in sheets:
        sheet = book.create_sheet()
        for row in rows:
            sheet.append(list(row))
    path = tmp_path / "run.xlsx"
    book.save(path)
    return path


def with_part(path: Path, name: str, change: Callable[[bytes], bytes]) -> Path:
    """Change one part of a workbook."""
    content = path.read_bytes()
    stream = io.BytesIO()
    with zipfile.ZipFile(io.BytesIO(content)) as old, zipfile.ZipFile(stream, "w") as new:
        for part in old.namelist():
            data = old.read(part)
            new.writestr(part, change(data) if part == name else data)
    path.write_bytes(stream.getvalue())
    return path


def refusal(path: Path) -> str:
    return refusal_of(read_positioning, path)


def assert_the_run(test: PositioningTest) -> None:
    np.testing.assert_array_equal(test.target, [0.0, 12.5])
    for cycle, word, target, deviation in ROWS:
        a = BACKWARD if word == "backward" else FORWARD
        assert test.deviation[int(target > 0), cycle - 1, a] == deviation


def test_a_wide_sheet_is_read(tmp_path: Path) -> None:
    rows = [("Target (mm)", 1, 2, 3, 4), (0, 1, 0, 2, 1), (12.5, 2.5625, 1.5625, 3.5625, 2.5625)]
    test = read_positioning(save(tmp_path, rows))
    assert_the_run(test)
    assert test.time_source is TimeSource.ORDER


def with_value(value: object) -> list[Sequence[object]]:
    return [HEADING, *ROWS[:3], (*ROWS[3][:3], value), *ROWS[4:]]


def test_what_is_wrong_is_an_error_that_names_the_cell(tmp_path: Path) -> None:
    for sheets, said in (
        *(
            ([with_value(value)], "column deviation_um, cell Sheet!D5: ")
            for value in ("abc", "nano", "0x1F", True, datetime(2026, 3, 2), 1e300)  # noqa: DTZ001  a workbook has no zones
        ),
        ([with_value("=1+2")], "column deviation_um, cell Sheet!D5: formula_without_value"),
        (
            [[(*HEADING, "time"), *((*row, "noon") for row in ROWS)]],
            "column time, cell Sheet!E2: not_a_moment",
        ),
        ([[HEADING, *ROWS, ROWS[1]]], "cell Sheet!A10: reading_twice"),
        ([[("a", 1)], [("b", 2)]], "cell Sheet!A1: run_headings_incomplete"),
        ([[("a", 1)], [("b",), ("x", "target_mm")]], "cell Sheet1!A2: run_headings_incomplete"),
    ):
        assert said in refusal(save(tmp_path, *sheets))


def test_a_tidy_sheet_is_read_wherever_the_table_stands(tmp_path: Path) -> None:
    test = read_positioning(save(tmp_path, [HEADING, *ROWS]))
    assert_the_run(test)
    assert remarks_of(test) == ()
    moved = [(), (), *((None, None, *row) for row in (HEADING, *ROWS))]
    assert_the_run(read_positioning(save(tmp_path, moved)))
    third = [(3, *row[1:]) for row in ROWS[:4]]
    rows = [(*ROWS[0][:3], None), *ROWS[1:], *third]
    assert np.isnan(read_positioning(save(tmp_path, [HEADING, *rows])).deviation[0, 0, FORWARD])


def test_the_first_visible_sheet_with_a_run_is_read(tmp_path: Path) -> None:
    path = save(tmp_path, [("notes",), ("x", 1)], [HEADING, *ROWS])
    assert_the_run(read_positioning(path))
    book = openpyxl.load_workbook(path)
    hidden = book.create_sheet("hidden", 0)
    hidden.append(HEADING)
    hidden.sheet_state = "hidden"
    book.save(path)
    assert_the_run(read_positioning(path))


def test_cells_with_a_date_are_times(tmp_path: Path) -> None:
    begin = datetime(2026, 3, 2, 8, 0)  # noqa: DTZ001  workbooks know no zones
    rows = [(*row, begin + timedelta(seconds=10 * k)) for k, row in enumerate(ROWS)]
    test = read_positioning(save(tmp_path, [(*HEADING, "time"), *rows]))
    assert test.time_source is TimeSource.FILE
    assert test.start == begin
    assert test.time_s is not None
    assert test.time_s[1, 1, BACKWARD] == 70.0


def test_a_formula_counts_with_its_stored_value(tmp_path: Path) -> None:
    path = save(tmp_path, [HEADING, *ROWS])
    deviation = ROWS[0][3]
    plain = f"<v>{deviation:g}</v>".encode()
    path = with_part(
        path, SHEET, lambda part: part.replace(b'D2" t="n">' + plain, b'D2"><f>A2*1</f>' + plain)
    )
    with zipfile.ZipFile(path) as archive:
        assert b"<f>" in archive.read(SHEET)
    assert_the_run(read_positioning(path))


def test_formulas_beside_the_table_do_no_harm(tmp_path: Path) -> None:
    rows = [(*row, None, "=SUM(D2:D9)") for row in ROWS]
    test = read_positioning(save(tmp_path, [HEADING, *rows]))
    assert_the_run(test)
    assert remarks_of(test) == ("cells to the right of the headings were left out",)


def test_what_the_sheet_says_of_its_size_is_not_trusted(tmp_path: Path) -> None:
    for size in (b"A1", b"A1:XFD1048576", b"B5:C6"):
        path = save(tmp_path, [HEADING, *ROWS])
        stated = b'<dimension ref="%s"'
        path = with_part(
            path, SHEET, lambda part, s=stated, n=size: part.replace(s % b"A1:D9", s % n)
        )
        with zipfile.ZipFile(path) as archive:
            assert stated % size in archive.read(SHEET)
        assert_the_run(read_positioning(path))


def test_a_damaged_or_dangerous_part_is_an_error(tmp_path: Path) -> None:
    for name, old, new, said in (
        (SHEET, b"<worksheet", b"<!DOCTYPE worksheet><worksheet", "unusual_workbook"),
        (
            "xl/styles.xml",
            b"<styleSheet",
            b'<!DOCTYPE s [<!ENTITY a "b">]><styleSheet',
            "unusual_workbook",
        ),
        (SHEET, b"</row>", b"", "damaged"),
        (SHEET, b"<sheetData>", b'<?xml version="1.0" encoding="utf-16"?><sheetData>', "damaged"),
        ("xl/workbook.xml", b"<sheets>", b"<sheets", "damaged"),
        ("xl/workbook.xml", b"r:id", b"r:if", "no_run_headings"),
        ("[Content_Types].xml", b"sheet.main+xml", b"sheet.other+xml", "damaged"),
        (SHEET, b'r="A2"', b'r="2A"', "damaged"),
        (
            SHEET,
            b"<worksheet",
            b'<?xml version="1.0" encoding="UTF-7"?><worksheet',
            "unusual_workbook",
        ),
    ):
        path = save(tmp_path, [HEADING, *ROWS])
        with zipfile.ZipFile(path) as archive:
            assert old in archive.read(name)
        changed = with_part(path, name, lambda part, a=old, b=new: part.replace(a, b, 1))
        assert said in refusal(changed), new
    for encoding in ("utf-16", "utf-16-le", "utf-16-be"):
        path = save(tmp_path, [HEADING, *ROWS])
        path = with_part(path, SHEET, lambda part, e=encoding: part.decode().encode(e))
        assert refusal(path) == "unusual_workbook"


def test_a_password_an_old_workbook_and_other_files_are_told_apart(tmp_path: Path) -> None:
    path = save(tmp_path, [HEADING, *ROWS])
    content = bytearray(path.read_bytes())
    place = content.find(b"PK\x01\x02")
    content[place + 8] |= 1
    (tmp_path / "locked.xlsx").write_bytes(content)
    assert refusal(tmp_path / "locked.xlsx") == "workbook_has_password"
    (tmp_path / "old.xls").write_bytes(b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1" + bytes(600))
    assert refusal(tmp_path / "old.xls") == "not_a_workbook"
    with zipfile.ZipFile(tmp_path / "archive.xlsx", "w") as archive:
        archive.writestr("a.txt", "a")
    assert refusal(tmp_path / "archive.xlsx") == "not_a_workbook"
    with zipfile.ZipFile(tmp_path / "sheet.ods", "w") as archive:
        archive.writestr("mimetype", "application/vnd.oasis.opendocument.spreadsheet")
    assert refusal(tmp_path / "sheet.ods") == "not_a_workbook"
    (tmp_path / "short.xlsx").write_bytes(path.read_bytes()[:-300])
    assert refusal(tmp_path / "short.xlsx") == "file_damaged"


def test_a_part_without_a_name_is_damage(tmp_path: Path) -> None:
    path = save(tmp_path, [HEADING, *ROWS])
    with zipfile.ZipFile(path, "a") as archive:
        archive.writestr("nameless", b"")
    path.write_bytes(path.read_bytes().replace(b"nameless", b"\x00ameless"))
    assert refusal(path) == "file_damaged"


def test_two_parts_of_the_same_name_are_refused(tmp_path: Path) -> None:
    path = save(tmp_path, [HEADING, *ROWS])
    with zipfile.ZipFile(path, "a") as archive, pytest.warns(UserWarning, match="Duplicate"):
        archive.writestr(SHEET, b"<worksheet/>")
    assert refusal(path) == "part_twice"


def test_rows_and_cells_that_do_not_rise_are_refused_not_lost(tmp_path: Path) -> None:
    for old, new, said in (
        (rb'<row r="4"', b'<row r="2"', "cell xl/worksheets/sheet1.xml row 2: cells_out_of_order"),
        (
            rb'<row r="4"',
            b"<row spans=\"1:4\" r = '3'",
            "cell xl/worksheets/sheet1.xml row 3: cells_out_of_order",
        ),
        (rb'<row r="1"', b'<row r="0"', "cell xl/worksheets/sheet1.xml row 0: cells_out_of_order"),
        (rb'r="D3"', b'r="A3"', "cell xl/worksheets/sheet1.xml A3: cells_out_of_order"),
        (rb'r="B3"', b'r="F3"', "cell xl/worksheets/sheet1.xml C3: cells_out_of_order"),
        (rb'r="D3"', b'r="XFE3"', "cell row 3: too_many_columns"),
    ):
        path = save(tmp_path, [HEADING, *ROWS])
        changed = with_part(path, SHEET, lambda data, a=old, b=new: re.sub(a, b, data))
        assert refusal(changed) == said


def test_rows_out_of_order_are_found_wherever_they_stand(tmp_path: Path) -> None:
    """Tags that lie across two pieces of the stream count as well."""
    comments = [[f"# {k:0{20 + k % 7}d}"] for k in range(4000)]
    path = save(tmp_path, [*comments[:50], HEADING, *ROWS, *comments])
    content = path.read_bytes()
    assert_the_run(read_positioning(path))
    for row in (2001, 3321):
        path.write_bytes(content)
        found, wrong = b'<row r="%d"' % row, b'<row r="7"'
        with_part(path, SHEET, lambda data, f=found, w=wrong: data.replace(f, w))
        assert f"cell {SHEET} row 7: cells_out_of_order" == refusal(path)


def test_empty_tags_of_cells_count_as_cells(tmp_path: Path) -> None:
    path = save(tmp_path, [HEADING, *ROWS])
    cells = b"<row>" + b"<c/>" * 1000 + b"</row>"
    with_part(
        path, SHEET, lambda data: data.replace(b"</sheetData>", cells * 1001 + b"</sheetData>")
    )
    assert refusal(path) == "too_many_cells"
