import codecs
import os
import tracemalloc
from pathlib import Path

from hypothesis import given, settings, strategies as st

from tests.refusals import answer_of, check_refusals, refusal_of
from tests.unit.files.builders import remarks_of
from thermaxis.codes import Place
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


def test_text_is_read_in_every_encoding_and_a_fallback_is_told(tmp_path: Path):
    for content, encoding in (
        (CZECH.encode("cp1250"), "cp1250"),
        (CZECH.encode("utf-8"), "utf-8"),
        (codecs.BOM_UTF8 + CZECH.encode("utf-8"), "utf-8"),
        (CZECH.encode("utf-16"), "utf-16"),
        (codecs.BOM_UTF16_BE + CZECH.encode("utf-16-be"), "utf-16"),
    ):
        source = read_text(written(tmp_path, content))
        assert (source.text, source.encoding) == (CZECH, encoding)
        told = ["remark-not_utf8"] if encoding == "cp1250" else []
        assert [one.code for one in source.remarks] == told


def test_a_wrong_fallback_leaves_numbers_alone_and_says_what_it_lost(tmp_path: Path):
    # 0x81 begins a letter of GBK; cp1250 does not define it
    source = read_text(written(tmp_path, b"TITLE:\x81\xa1\n1.25"))
    assert source.lines[1] == "1.25"
    assert "1 character could not be read in this way (line 1)" in remarks_of(source)[0]
    assert "--encoding" in remarks_of(source)[0]


def test_a_fallback_that_does_not_contain_ascii_is_refused(tmp_path: Path):
    path = written(tmp_path, b"1 2 3")
    for name in ("no-such-encoding", "utf-16", "hex", "unicode_escape", "a\x00b"):
        assert answer_of(read_text, path, fallback_encoding=name).endswith("unusable_encoding")


def test_every_line_end_separates_lines(tmp_path: Path):
    lines = ["one", "two\x0bb\x0cc\x1cd\x85e\u2028f", "three"]  # nothing else ends a line
    for end in ("\r\n", "\n", "\r"):
        assert read_text(written(tmp_path, end.join(lines).encode())).lines == lines


def test_what_is_no_text_is_named(tmp_path: Path):
    starts = (
        *(b"\x89PNG\r\n\x1a\n", b"\xff\xd8\xff\xe0", b"GIF89a", b"RIFF1234WEBPVP8 "),
        *(b"%PDF-1.7\n", b"PK\x03\x04\x14\x00", b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1"),
        *(b"\x1f\x8b\x08", b"1,2\x003", "1,2,3".encode("utf-16-le")),
    )
    wrong = {start + b" and some more ": "not_text" for start in starts}
    wrong[codecs.BOM_UTF16_LE + b"a\x00\x00\xd8 and some more "] = "cut_short"
    blanks = (b"", codecs.BOM_UTF8, codecs.BOM_UTF16_LE, b" \r\n\t")
    wrong |= dict.fromkeys(blanks, "file_empty")
    check_refusals(read_text, tmp_path / "run.txt", wrong)


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
    assert refusal_of(read_text, path) == "file_too_large"
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 1_000_000


@settings(derandomize=True)
@given(st.floats(min_value=-NUMBER_LIMIT, max_value=NUMBER_LIMIT))
def test_every_printed_number_reads_as_itself(value: float):
    assert parse_number(repr(value), Place("run.csv")) == value
    assert parse_number(f" {value!r}\t".replace(".", ","), Place("run.csv"), decimal=",") == value


def test_short_forms_of_numbers_are_read():
    for text, value in (("-.047", -0.047), ("5.", 5.0), ("+1E3", 1000.0), ("1e-400", 0.0)):
        assert parse_number(text, Place("run.csv")) == value
        assert is_number(text)


def test_what_is_no_number_is_refused_with_its_place():
    texts = (
        *("nan", "inf", "-Infinity", "1_000", "0x1F", "1,5", "1 2", "--1", "1e", ".", "٣", "−1"),
        *("1" * 200, "=1", "1e99999"),
    )
    place = Place("run.csv", 7, "deviation_um")
    for text in ("", " ", *texts):
        said = answer_of(parse_number, text, place)
        assert said.startswith("line 7, column deviation_um: "), text
        assert not is_number(text)
    for text in ("", "-1", "1.0", "1e3", "²", "12345678901", "x"):
        said = answer_of(parse_whole_number, text, Place("run.csv", 2))
        assert said == "line 2: not_a_whole_number", text
    cell = Place("run.xlsx", cell="Sheet1!B7")
    for text in ("1e10", "-1000000001", "1e400"):
        assert answer_of(parse_number, text, cell) == "cell Sheet1!B7: magnitude_too_large"
    said = answer_of(parse_number, "1.000,5", cell, decimal=",")
    assert said == "cell Sheet1!B7: not_a_number"


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
