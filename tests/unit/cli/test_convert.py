from pathlib import Path

import numpy as np
import pytest

from tests.unit.cli.refusals import code_of, refusal
from tests.unit.files.nasty import CASES
from thermaxis.cli import execute, main
from thermaxis.files import RunMapping, format_tidy_csv, read_positioning, write_rtl
from thermaxis.messages import sentence_of
from thermaxis.positioning import PositioningTest
from thermaxis.quantities import AxisKind

WIDE = "target_mm;1;2;3;4\n0;1,5;2;1;2\n10;2;3;2,25;3\n"


def run(*words: object) -> int:
    return execute(["convert", *map(str, words)])


@pytest.fixture
def wide(tmp_path: Path) -> Path:
    path = tmp_path / "wide.csv"
    path.write_text(WIDE, encoding="utf-8")
    return path


def test_a_file_becomes_a_tidy_file_with_the_same_run(wide, tmp_path):
    output = tmp_path / "tidy.csv"
    assert run(wide, "-o", output) == 0
    first, again = read_positioning(wide), read_positioning(output)
    np.testing.assert_array_equal(again.deviation, first.deviation)
    np.testing.assert_array_equal(again.order, first.order)
    assert again.order_deduced


def test_an_rtl_file_keeps_that_its_times_were_not_measured(tmp_path):
    test = PositioningTest(AxisKind.LINEAR, np.array([0.0, 1.0]), np.ones((2, 2, 2)))
    write_rtl(test, tmp_path / "run.rtl")
    assert run(tmp_path / "run.rtl", "-o", tmp_path / "tidy.csv") == 0
    first, again = (read_positioning(tmp_path / name) for name in ("run.rtl", "tidy.csv"))
    assert again.time_source is first.time_source
    assert [*map(sentence_of, again.remarks)] == [*map(sentence_of, first.remarks)]


def test_remarks_go_to_standard_error_and_the_table_to_standard_output(wide, capfdbinary):
    assert run(wide, "-o", "-") == 0
    printed = capfdbinary.readouterr()
    assert printed.out == format_tidy_csv(read_positioning(wide)).encode()
    assert "µm was assumed".encode() in printed.err


def test_the_input_is_never_overwritten(wide, tmp_path):
    link = tmp_path / "link.csv"
    link.hardlink_to(wide)
    for output in (wide, wide.parent / "." / wide.name, link):
        assert code_of("convert", wide, "-o", output) == "output_is_input"
    assert wide.read_text(encoding="utf-8") == WIDE


def test_an_older_output_is_replaced_only_by_a_good_one(wide, tmp_path):
    output = tmp_path / "tidy.csv"
    output.write_text("older", encoding="utf-8")
    wide.write_text(WIDE.replace("2,25", "2,2s"), encoding="utf-8")
    assert refusal("convert", wide, "-o", output).place.line == 3
    assert output.read_text(encoding="utf-8") == "older"
    wide.write_text(WIDE, encoding="utf-8")
    assert run(wide, "-o", output) == 0
    assert output.read_text(encoding="utf-8").startswith("# kind: linear\n")


def test_the_encoding_can_be_named(tmp_path, capsys):
    path = tmp_path / "run.csv"
    path.write_bytes("# machine: 车床\n".encode("gbk") + WIDE.encode())
    assert run(path, "-o", tmp_path / "tidy.csv", "--encoding", "gbk") == 0
    assert read_positioning(tmp_path / "tidy.csv").header["machine"] == "车床"
    assert "gbk" in capsys.readouterr().err


def test_a_remark_cannot_steer_the_terminal(tmp_path, capsys):
    path = tmp_path / "run.csv"
    path.write_text('# remark: "\\u001b[31mred"\n' + WIDE, encoding="utf-8")
    run(path, "-o", tmp_path / "tidy.csv")
    assert "\x1b" not in capsys.readouterr().err


def test_bad_input_ends_with_exit_code_2_and_one_line(tmp_path, capsys):
    path = tmp_path / "run.csv"
    path.write_bytes(b"\x89PNG\r\n\x1a\n")
    assert main(["convert", str(path), "-o", "-"]) == 2
    printed = capsys.readouterr()
    assert printed.out == ""
    assert "a picture" in printed.err
    assert printed.err.count("\n") == 1


@pytest.mark.parametrize(
    ("name", "options"),
    [
        ("targets of an encoder", ["--target-tolerance", "0.001"]),
        ("no unit at all", ["--units", "mm,um"]),
        ("03/04/2026", ["--date-order", "day"]),
        ("1.100 and 1.125 only", ["--decimal", "point", "--map", "map.toml"]),
    ],
)
def test_what_the_file_leaves_open_is_said_by_an_option(tmp_path, monkeypatch, name, options):
    monkeypatch.chdir(tmp_path)
    case = next(case for case in CASES if case.name == name)
    run_file = tmp_path / "run.csv"
    run_file.write_bytes(case.content)
    (tmp_path / "map.toml").write_text('decimal = "comma"\n', encoding="utf-8")
    assert refusal("convert", run_file, "-o", tmp_path / "tidy.csv").code == case.refused
    assert run(run_file, "-o", tmp_path / "tidy.csv", *options) == 0
    mapping = RunMapping(decimal="point") if "--decimal" in options else case.mapping
    expected = read_positioning(run_file, mapping=mapping)
    again = read_positioning(tmp_path / "tidy.csv")
    np.testing.assert_array_equal(again.deviation, expected.deviation)
