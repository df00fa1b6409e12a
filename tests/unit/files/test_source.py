import codecs
import os
import time
import tracemalloc
from pathlib import Path

import pytest
from hypothesis import given, settings, strategies as st

from thermaxis.errors import ConfigurationError, MeasurementFileError
from thermaxis.files.table import (
    NUMBER_LIMIT,
    clean_text,
    first_few,
    is_number,
    parse_number,
    parse_whole_number,
    read_text,
)
from thermaxis.files.table._source import TEXT_LIMIT_BYTES

CZECH = "Název: Přímost osy Ž, příliš žluťoučký kůň"


def written(folder: Path, content: bytes) -> Path:
    path = folder / "run.txt"
    path.write_bytes(content)
    return path


@pytest.mark.parametrize(
    ("content", "encoding"),
    [
        (CZECH.encode("utf-8"), "utf-8"),
        (codecs.BOM_UTF8 + CZECH.encode("utf-8"), "utf-8"),
        (CZECH.encode("utf-16"), "utf-16"),
        (codecs.BOM_UTF16_BE + CZECH.encode("utf-16-be"), "utf-16"),
    ],
)
def test_unicode_is_read_without_a_remark(tmp_path: Path, content: bytes, encoding: str):
    source = read_text(written(tmp_path, content))

    assert source.text == CZECH
    assert source.encoding == encoding
    assert source.remarks == ()


def test_a_file_of_czech_windows_is_read_through_the_default_fallback(tmp_path: Path):
    source = read_text(written(tmp_path, CZECH.encode("cp1250")))

    assert source.text == CZECH
    assert source.encoding == "cp1250"
    assert "cp1250" in source.remarks[0]


def test_the_caller_names_the_fallback(tmp_path: Path):
    source = read_text(written(tmp_path, "机床 X".encode("gbk")), fallback_encoding="gbk")

    assert source.text == "机床 X"
    assert "gbk" in source.remarks[0]


def test_a_wrong_fallback_leaves_numbers_alone_and_says_what_it_lost(tmp_path: Path):
    # 0x81 begins a letter of GBK; cp1250 does not define it
    source = read_text(written(tmp_path, b"TITLE:\x81\xa1\n1.25"))

    assert source.lines[1] == "1.25"
    assert "1 character could not be read in this way (line 1)" in source.remarks[0]
    assert "--encoding" in source.remarks[0]


def test_the_lines_that_hold_lost_characters_are_named(tmp_path: Path):
    lines = [b"a\x81\x81" if k in {2, 5} else b"a" for k in range(1, 9)]

    few = read_text(written(tmp_path, b"\r\n".join(lines))).remarks[0]
    many = read_text(written(tmp_path, b"a\x81\r\n" * 9)).remarks[0]

    assert "4 characters could not be read in this way (lines 2, 5)" in few
    assert "(lines 1, 2, 3, 4, 5 and others)" in many


@pytest.mark.parametrize("name", ["no-such-encoding", "utf-16", "hex", "unicode_escape", "a\x00b"])
def test_a_fallback_that_does_not_contain_ascii_is_refused(tmp_path: Path, name: str):
    path = written(tmp_path, b"1 2 3")

    with pytest.raises(ConfigurationError, match="not a usable text encoding"):
        read_text(path, fallback_encoding=name)


@pytest.mark.parametrize("end", ["\r\n", "\n", "\r"])
def test_every_line_end_separates_lines(tmp_path: Path, end: str):
    source = read_text(written(tmp_path, end.join(["one", "two", "three"]).encode()))

    assert source.lines == ["one", "two", "three"]


def test_only_line_ends_separate_lines(tmp_path: Path):
    text = "a\x0bb\x0cc\x1cd\x85e\u2028f"

    assert read_text(written(tmp_path, text.encode())).lines == [text]


@pytest.mark.parametrize(
    ("start", "seems"),
    [
        (b"\x89PNG\r\n\x1a\n", "a picture"),
        (b"\xff\xd8\xff\xe0", "a picture"),
        (b"GIF89a", "a picture"),
        (b"RIFF1234WEBPVP8 ", "a picture"),
        (b"%PDF-1.7\n", "a PDF"),
        (b"PK\x03\x04\x14\x00", "a workbook"),
        (b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1", "a workbook of the old kind"),
        (b"\x1f\x8b\x08", "a compressed file"),
        (b"1,2\x003", "zero bytes"),
        ("1,2,3".encode("utf-16-le"), "zero bytes"),
    ],
)
def test_what_is_no_text_is_named(tmp_path: Path, start: bytes, seems: str):
    path = written(tmp_path, start + b" and some more")

    with pytest.raises(MeasurementFileError, match=seems) as caught:
        read_text(path)
    assert str(path) in str(caught.value)
    assert caught.value.remedy


def test_damaged_utf16_is_refused(tmp_path: Path):
    path = written(tmp_path, codecs.BOM_UTF16_LE + b"a\x00\x00\xd8")

    with pytest.raises(MeasurementFileError, match="UTF-16"):
        read_text(path)


@pytest.mark.parametrize(
    "content", [b"", codecs.BOM_UTF8, codecs.BOM_UTF16_LE, b" \r\n\t\r\n"], ids=repr
)
def test_an_empty_file_is_refused(tmp_path: Path, content: bytes):
    path = written(tmp_path, content)

    with pytest.raises(MeasurementFileError, match="empty"):
        read_text(path)


def test_a_file_that_does_not_exist_is_an_error_of_ours(tmp_path: Path):
    with pytest.raises(MeasurementFileError, match="no such file"):
        read_text(tmp_path / "missing.rtl")


def test_a_folder_is_refused(tmp_path: Path):
    with pytest.raises(MeasurementFileError, match="folder"):
        read_text(tmp_path)


@pytest.mark.parametrize("name", ["a\x00b", "x" * 5000])
def test_a_name_that_cannot_be_is_an_error_of_ours(name: str):
    with pytest.raises(MeasurementFileError):
        read_text(name)


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="this system has no named pipes")
def test_a_pipe_is_refused_and_not_waited_for(tmp_path: Path):
    os.mkfifo(tmp_path / "pipe")

    with pytest.raises(MeasurementFileError, match="not a regular file"):
        read_text(tmp_path / "pipe")


def test_a_file_over_the_limit_is_refused_before_it_is_read(tmp_path: Path):
    path = tmp_path / "large.rtl"
    with path.open("wb") as stream:
        stream.truncate(TEXT_LIMIT_BYTES + 1)

    tracemalloc.start()
    began = time.process_time()
    with pytest.raises(MeasurementFileError, match="more than the limit of 100 MB"):
        read_text(path)
    seconds = time.process_time() - began
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()

    assert seconds < 1.0
    assert peak < 1_000_000


@settings(derandomize=True)
@given(st.floats(min_value=-NUMBER_LIMIT, max_value=NUMBER_LIMIT))
def test_every_printed_number_reads_as_itself(value: float):
    assert parse_number(repr(value), path="run.csv") == value
    assert parse_number(f" {value!r}\t".replace(".", ","), path="run.csv", decimal=",") == value


@pytest.mark.parametrize(
    ("text", "value"), [("-.047", -0.047), ("5.", 5.0), ("+1E3", 1000.0), ("1e-400", 0.0)]
)
def test_short_forms_of_numbers_are_read(text: str, value: float):
    assert parse_number(text, path="run.csv") == value
    assert is_number(text)


@pytest.mark.parametrize(
    "text",
    [
        "",
        " ",
        "nan",
        "inf",
        "-Infinity",
        "1_000",
        "0x1F",
        "1,5",
        "1 2",
        "--1",
        "1e",
        ".",
        "٣",
        "−1",
        "1" * 200,
        "=1",
        "1e99999",
    ],
)
def test_what_is_no_decimal_number_is_refused(text: str):
    with pytest.raises(MeasurementFileError) as caught:
        parse_number(text, path="run.csv", line=7, column="deviation_um")
    assert caught.value.where == "run.csv, line 7, column deviation_um"
    assert not is_number(text)


@pytest.mark.parametrize("text", ["1e10", "-1000000001", "1e400"])
def test_a_number_beyond_any_axis_is_refused(text: str):
    with pytest.raises(MeasurementFileError, match="too large"):
        parse_number(text, path="run.xlsx", cell="Sheet1!B7")


def test_a_point_beside_a_decimal_comma_is_refused():
    with pytest.raises(MeasurementFileError, match="not a number"):
        parse_number("1.000,5", path="run.csv", decimal=",")


@pytest.mark.parametrize("text", ["", "-1", "1.0", "1e3", "²", "12345678901", "x"])
def test_what_is_no_whole_number_is_refused(text: str):
    with pytest.raises(MeasurementFileError, match="whole number"):
        parse_whole_number(text, path="run.csv", line=2)


def test_a_whole_number_is_read():
    assert parse_whole_number(" 042 ", path="run.csv") == 42


def test_header_text_keeps_its_letters_and_loses_what_is_not_writing():
    assert clean_text("<b>Přímost</b> #1\x1b[31m\x00\u202e\u2028") == "<b>Přímost</b> #1 [31m"


def test_long_header_text_is_cut():
    assert clean_text("x" * 50, limit=10) == "xxxxxxx..."


@settings(derandomize=True)
@given(st.text())
def test_clean_text_is_one_printable_line(text: str):
    cleaned = clean_text(text)

    assert clean_text(cleaned) == cleaned
    assert not any(ord(c) < 32 or c in "\x7f\u2028\u2029" for c in cleaned)


def test_many_names_are_counted():
    assert first_few(["a", "b"]) == "a, b"
    assert first_few([str(k) for k in range(9)]) == "0, 1, 2, 3, 4 and 4 more"
