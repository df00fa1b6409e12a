import codecs
import os
import time
import tracemalloc
from pathlib import Path

import pytest
from hypothesis import given, settings, strategies as st

from tests.refusals import refusal_of, said
from thermaxis.codes import Place
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
        (CZECH.encode("cp1250"), "cp1250"),
        (CZECH.encode("utf-8"), "utf-8"),
        (codecs.BOM_UTF8 + CZECH.encode("utf-8"), "utf-8"),
        (CZECH.encode("utf-16"), "utf-16"),
        (codecs.BOM_UTF16_BE + CZECH.encode("utf-16-be"), "utf-16"),
    ],
)
def test_text_is_read_in_every_encoding_and_a_fallback_is_told(
    tmp_path: Path, content: bytes, encoding: str
):
    source = read_text(written(tmp_path, content))
    assert source.text == CZECH
    assert source.encoding == encoding
    assert ["cp1250" in remark for remark in source.remarks] == [True] * (encoding == "cp1250")


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
    with pytest.raises(ConfigurationError) as caught:
        read_text(path, fallback_encoding=name)
    assert caught.value.code == "unusable_encoding"


@pytest.mark.parametrize("end", ["\r\n", "\n", "\r"])
def test_every_line_end_separates_lines(tmp_path: Path, end: str):
    lines = ["one", "two\x0bb\x0cc\x1cd\x85e\u2028f", "three"]  # nothing else ends a line
    assert read_text(written(tmp_path, end.join(lines).encode())).lines == lines


@pytest.mark.parametrize(
    ("start", "seems"),
    [
        (b"\x89PNG\r\n\x1a\n", "not_text"),
        (b"\xff\xd8\xff\xe0", "not_text"),
        (b"GIF89a", "not_text"),
        (b"RIFF1234WEBPVP8 ", "not_text"),
        (b"%PDF-1.7\n", "not_text"),
        (b"PK\x03\x04\x14\x00", "not_text"),
        (b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1", "not_text"),
        (b"\x1f\x8b\x08", "not_text"),
        (b"1,2\x003", "not_text"),
        ("1,2,3".encode("utf-16-le"), "not_text"),
        (codecs.BOM_UTF16_LE + b"a\x00\x00\xd8", "cut_short"),
        *(
            (blank, "file_empty")
            for blank in (b"", codecs.BOM_UTF8, codecs.BOM_UTF16_LE, b" \r\n\t")
        ),
    ],
)
def test_what_is_no_text_is_named(tmp_path: Path, start: bytes, seems: str):
    more = b"" if seems == "file_empty" else b" and some more "
    path = written(tmp_path, start + more)
    assert refusal_of(read_text, path) == seems


def test_what_is_no_file_is_refused_and_not_waited_for(tmp_path: Path):
    expected = {tmp_path: "not_a_file", tmp_path / "missing": "file_not_found"}
    if hasattr(os, "mkfifo"):
        os.mkfifo(tmp_path / "pipe")
        expected[tmp_path / "pipe"] = "not_a_file"
    expected |= dict.fromkeys((Path("a\0b"), Path("x" * 5000)), "file_unreadable")
    for path, code in expected.items():
        assert refusal_of(read_text, path) == code


def test_a_file_over_the_limit_is_refused_before_it_is_read(tmp_path: Path):
    path = tmp_path / "large.rtl"
    with path.open("wb") as stream:
        stream.truncate(TEXT_LIMIT_BYTES + 1)
    tracemalloc.start()
    began = time.process_time()
    assert refusal_of(read_text, path) == "file_too_large"
    seconds = time.process_time() - began
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert seconds < 1.0
    assert peak < 1_000_000


@settings(derandomize=True)
@given(st.floats(min_value=-NUMBER_LIMIT, max_value=NUMBER_LIMIT))
def test_every_printed_number_reads_as_itself(value: float):
    assert parse_number(repr(value), Place("run.csv")) == value
    assert parse_number(f" {value!r}\t".replace(".", ","), Place("run.csv"), decimal=",") == value


@pytest.mark.parametrize(
    ("text", "value"), [("-.047", -0.047), ("5.", 5.0), ("+1E3", 1000.0), ("1e-400", 0.0)]
)
def test_short_forms_of_numbers_are_read(text: str, value: float):
    assert parse_number(text, Place("run.csv")) == value
    assert is_number(text)


@pytest.mark.parametrize(
    "text",
    [
        *("", " ", "nan", "inf", "-Infinity", "1_000", "0x1F", "1,5", "1 2", "--1", "1e", ".", "٣"),
        *("−1", "1" * 200, "=1", "1e99999"),
    ],
)
def test_what_is_no_decimal_number_is_refused(text: str):
    with pytest.raises(MeasurementFileError) as caught:
        parse_number(text, Place("run.csv", 7, "deviation_um"))
    assert caught.value.place == Place("run.csv", 7, "deviation_um")
    assert not is_number(text)


@pytest.mark.parametrize("text", ["", "-1", "1.0", "1e3", "²", "12345678901", "x"])
def test_what_is_no_whole_number_is_refused(text: str):
    with pytest.raises(MeasurementFileError) as caught:
        parse_whole_number(text, Place("run.csv", 2))
    assert said(caught.value) == "line 2: not_a_whole_number"


@pytest.mark.parametrize(
    ("text", "decimal", "code"),
    [
        *((text, ".", "magnitude_too_large") for text in ("1e10", "-1000000001", "1e400")),
        ("1.000,5", ",", "not_a_number"),
    ],
)
def test_a_number_that_cannot_be_measured_is_refused(text: str, decimal: str, code: str):
    with pytest.raises(MeasurementFileError) as caught:
        parse_number(text, Place("run.xlsx", cell="Sheet1!B7"), decimal=decimal)
    assert said(caught.value) == f"cell Sheet1!B7: {code}"


def test_header_text_keeps_its_letters_and_loses_what_is_not_writing():
    assert clean_text("<b>Přímost</b> #1\x1b[31m\x00\u202e\u2028") == "<b>Přímost</b> #1 [31m"
    assert clean_text("x" * 50, limit=10) == "xxxxxxx..."
    assert parse_whole_number(" 042 ", Place("run.csv")) == 42


@settings(derandomize=True)
@given(st.text())
def test_clean_text_is_one_printable_line(text: str):
    cleaned = clean_text(text)
    assert clean_text(cleaned) == cleaned
    assert not any(ord(c) < 32 or c in "\x7f\u2028\u2029" for c in cleaned)


def test_many_names_are_counted():
    assert first_few(["a", "b"]) == "a, b"
    assert first_few([str(k) for k in range(9)]) == "0, 1, 2, 3, 4 and 4 more"
