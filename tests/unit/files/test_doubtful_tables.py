"""Tables that can be read in two ways: what is certain is read, the rest is refused."""

from pathlib import Path

import numpy as np
import pytest

from tests.refusals import refused
from tests.unit.files.builders import dat, remarks_of, rtl, workbook
from thermaxis.files import RunMapping, read_positioning
from thermaxis.files.table import RunColumn
from thermaxis.positioning import PositioningTest, TimeSource

TIDY = "cycle;direction;target_mm;deviation_um"
PASSES = [(c, d, t) for c in (1, 2) for d in ("forward", "backward") for t in (0, 100, 200)]
DEVIATION = [round(0.25 + 0.5 * k, 2) for k in range(len(PASSES))]


def read(
    tmp_path: Path, content: str | bytes, mapping: RunMapping | None = None
) -> PositioningTest:
    path = tmp_path / "run"
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return read_positioning(path, mapping=mapping or RunMapping())


def wide(above: str, heads: str) -> str:
    rows = [f"{t};1.1;1.2;1.3;1.4" for t in (0, 100, 200)]
    return "\n".join([*above.splitlines(), heads, *rows, ""])


def tidy(heading: str = "", cells: list[str] | None = None) -> str:
    rows = [f"{c};{d};{t};{dev}" for (c, d, t), dev in zip(PASSES, DEVIATION, strict=True)]
    if cells is not None:
        rows = [f"{row};{cell}" for row, cell in zip(rows, cells, strict=True)]
    return "\n".join([f"{TIDY};{heading}" if heading else TIDY, *rows, ""])


BARE, WITH_TARGET = "Target;Run 1;Run 2;Run 3;Run 4", "Target [mm];1;2;3;4"


@pytest.mark.parametrize(
    ("above", "heads", "size"),
    [
        ("Unit: mm", BARE, "unit_not_stated"),
        ("Unit: um", BARE, "unit_not_stated"),
        ("Unit: um", "Target [mm];1;2;3;4", 1.1),
        ("Unit: nm", WITH_TARGET, 1.1e-3),
        ("Unit of measurement: nm", WITH_TARGET, 1.1e-3),
        ("Deviation unit: nm", WITH_TARGET, 1.1e-3),
        ("Units: mm/µm", BARE, 1.1),
        ("Units: mm/nm", BARE, 1.1e-3),
        ("Unit: mm", "Target;1 [µm];2 [µm];3 [µm];4 [µm]", 1.1),
        ("Target unit: mm\nDeviation unit: nm", BARE, 1.1e-3),
        ("Jednotka odchylky: nm", WITH_TARGET, "unit_not_stated"),
        ("Temperature unit: °C", WITH_TARGET, 1.1),
        ("Name of customer: Foo\n# Date of calibration: May\n# Unit: nm", WITH_TARGET, 1.1e-3),
    ],
)
def test_one_unit_serves_targets_or_deviations_never_both(
    tmp_path: Path, above: str, heads: str, size: float | str
) -> None:
    if isinstance(size, str):
        with refused(size):
            read(tmp_path, wide(above, heads))
        return
    test = read(tmp_path, wide(above, heads))
    assert test.target[-1] == 200.0
    assert test.deviation[0, 0, 0] == pytest.approx(size)


def test_a_comma_that_may_be_of_either_kind_is_refused(tmp_path: Path) -> None:
    cells = ",".join(f'"{k},234"' for k in range(1, 5))
    quoted = "\n".join(["target_mm,1,2,3,4", *(f"{t},{cells}" for t in (0, 100, 200)), ""])
    heads: list[object] = ["target_mm", "run_1_um", "run_2_um"]
    sheet = workbook([heads, [0, "1,234", 0.5], [100, "2,345", 0.5], [200, "1,234", 0.5]])
    for content in (quoted, sheet):
        with refused("decimal_sign_unclear"):
            read(tmp_path, content)
    comma = read(tmp_path, quoted, RunMapping(decimal="comma"))
    assert comma.deviation[0, 0, 0] == pytest.approx(1.234)


@pytest.mark.parametrize("cell", ["2 m", "2 min", "2n"])
def test_a_number_with_a_unit_is_no_summary(tmp_path: Path, cell: str) -> None:
    rows = [f"{t};1.1;1.2" for t in ("0", "1", cell, "3")]
    with refused("not_a_number"):
        read(tmp_path, "\n".join(["target [m];run_1_um;run_2_um", *rows, ""]))


@pytest.mark.parametrize("word", ["2s", "±2σ", "3 sigma", "Mean", "s"])
def test_words_of_summaries_are_known(tmp_path: Path, word: str) -> None:
    rows = [f"{t};1.1;1.2;1.3;1.4" for t in ("0", "1", "2", word)]
    test = read(tmp_path, "\n".join(["target [m];1 [um];2 [um];3 [um];4 [um]", *rows, ""]))
    assert test.target.tolist() == [0.0, 1000.0, 2000.0]


def test_a_year_of_two_digits_may_stand_first(tmp_path: Path) -> None:
    cells = [f"26/03/04 10:00:{k:02}" for k in range(len(PASSES))]
    with refused("date_order_unclear"):
        read(tmp_path, tidy("time", cells))
    stated = RunMapping(date_order="year"), RunMapping(date_order="day")
    for mapping, date in zip(stated, ("2026-03-04", "2004-03-26"), strict=True):
        test = read(tmp_path, tidy("time", cells), mapping)
        assert test.start is not None
        assert test.start.date().isoformat() == date
    for written in ("04.03.26", "3/14/26", "5/13/26"):
        year = read(tmp_path, tidy("time", [c.replace("26/03/04", written) for c in cells]))
        assert year.start is not None
        assert year.start.year == 2026


def test_a_clock_of_twelve_hours_is_not_taken_for_one_of_24(tmp_path: Path) -> None:
    minutes = [12 * 60 + 30 + 5 * k for k in range(len(PASSES))]
    cells = [f"{(m // 60 - 1) % 12 + 1}:{m % 60:02}:05" for m in minutes]
    test = read(tmp_path, tidy("time", cells))
    assert test.time_source is not TimeSource.FILE
    assert any("times of day" in said for said in remarks_of(test))
    mixed = [f"22:{k:02}" for k in range(40, 46)] + [f"1:00:{k}" for k in range(10, 16)]
    with refused("hours_or_minutes"):
        read(tmp_path, tidy("time", mixed))


def test_numbered_positions_are_no_passes(tmp_path: Path) -> None:
    with refused("run_headings_incomplete"):
        read(tmp_path, wide("", "Target [mm];Pos 1;Pos 2;Pos 3;Pos 4"))
    test = read(tmp_path, wide("", "Target [mm];1 pos;1 neg;2 pos;2 neg"))
    np.testing.assert_allclose(test.deviation[0], [[1.1, 1.2], [1.3, 1.4]])


def test_a_mapping_names_columns_that_are_there(tmp_path: Path) -> None:
    with refused("no_such_column"):
        read(tmp_path, tidy(), RunMapping(columns={"Temp": RunColumn(leave_out=True)}))
    cells = [f"{20 + 0.1 * k:.1f}" for k in range(len(PASSES))]
    out = RunMapping(columns={"Temp": RunColumn(leave_out=True)})
    test = read(tmp_path, tidy("Temp", cells), out)
    assert not test.channels
    assert any("'Temp'" in said for said in remarks_of(test))
    assert list(read(tmp_path, tidy("Temp", cells)).channels) == ["Temp"]


def test_options_without_a_meaning_for_the_format_are_refused(tmp_path: Path) -> None:
    for content in (rtl(), dat()):
        with refused("reading_option_unused"):
            read(tmp_path, content, RunMapping(decimal="comma"))
    with refused("reading_option_unused"):
        read(tmp_path, wide("", WITH_TARGET), RunMapping(target_tolerance=0.01))


def test_columns_of_one_run_below_one_word_are_no_two_runs(tmp_path: Path) -> None:
    for word in ("pos", "forward", "Forward:"):
        with refused("run_twice"):
            read(tmp_path, wide(f";{word};;;", "Target [mm];1;2;1;2"))


def test_an_exchanged_table_that_ends_inside_a_number_is_cut_short(tmp_path: Path) -> None:
    rows = [f"Run {k} (µm);1.25;2.25;3.25;4.25" for k in range(1, 5)]
    content = "\n".join(["Target (mm);0;100;200;300", *rows])
    assert read(tmp_path, f"{content}\n").cycles == 2
    with refused("cut_short"):
        read(tmp_path, content[:-2])
