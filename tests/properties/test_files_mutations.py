"""Whatever happens to a file: a run is read, or one of the project's errors says why not."""

import io
import random
import re
import time
import zipfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from tests.unit.files import mutated as changes
from tests.unit.files.builders import MADE
from thermaxis.errors import ThermaxisError
from thermaxis.files import (
    format_tidy_csv,
    read_positioning,
)
from thermaxis.positioning import PositioningTest

TOKENS = (
    *("nan", "NaN", "inf", "-inf", "1e400", "-1e308", "1e-400", "99999999999999999999", "1_000"),
    *("-", "+", "=cmd|' /C calc'!A0", "@SUM(1)", "0x1F", "1,5", "1.2.3", "--5", "5-", "e5", "."),
    *("0", "-1", "1000000000", "2147483648", "9223372036854775808", "0.0000001", "10e8", "١٢"),
    *("", " ", "\t", '"', "'", '""', "\\", "µ", "\ufeff", "\u2028", "\x0b", "\x1f", "\ud7ff"),
    *("#", "# cycle: pilgrim", "# start: 9999-12-31T23:59:59", "# environment a: 1", "::", "EOF::"),
    *('# header "\\ud800": "\\u0000"', "# unit: mm", "# kind: rotary", "# time_source: none"),
    *(
        "forward",
        "up",
        "hin",
        "cycle",
        "run",
        "target_deg",
        "deviation_nm",
        "measured_mm",
        "time_s",
    ),
    *(
        "#DIV/0!",
        "]",
        "[1,1]",
        "TGT_DATA[1000000000]",
        "CYCLES=1000000000",
        "Run-count:1000000000",
        "-0",
    ),
)
WORDS = re.compile(r"[^\s,;:=\[\]<>\"/]+")

Mutation = Callable[[bytes, random.Random], bytes]
Reader = Callable[[Path], PositioningTest]


def _place(content: bytes, rng: random.Random) -> int:
    return rng.randrange(len(content) + 1)


def _some_line(content: bytes, rng: random.Random) -> tuple[list[bytes], int]:
    lines = content.splitlines(keepends=True) or [b""]
    return lines, rng.randrange(len(lines))


def flip_bytes(content: bytes, rng: random.Random) -> bytes:
    changed = bytearray(content)
    for _ in range(rng.choice((1, 1, 2, 8))):
        if changed:
            changed[rng.randrange(len(changed))] = rng.randrange(256)
    return bytes(changed)


def truncate(content: bytes, rng: random.Random) -> bytes:
    return content[: _place(content, rng)]


def cut_out(content: bytes, rng: random.Random) -> bytes:
    place = _place(content, rng)
    return content[:place] + content[place + rng.randrange(1, 40) :]


def repeat_a_piece(content: bytes, rng: random.Random) -> bytes:
    place = _place(content, rng)
    piece = content[place : place + rng.randrange(1, 200)]
    return content[:place] + piece * rng.choice((2, 3, 50)) + content[place:]


def insert_nul(content: bytes, rng: random.Random) -> bytes:
    place = _place(content, rng)
    return content[:place] + b"\x00" + content[place:]


def insert_token(content: bytes, rng: random.Random) -> bytes:
    place = _place(content, rng)
    return content[:place] + rng.choice(TOKENS).encode() + content[place:]


def delete_line(content: bytes, rng: random.Random) -> bytes:
    lines, k = _some_line(content, rng)
    return b"".join(lines[:k] + lines[k + 1 :])


def double_line(content: bytes, rng: random.Random) -> bytes:
    lines, k = _some_line(content, rng)
    return b"".join(lines[:k] + [lines[k]] * rng.choice((2, 2, 30)) + lines[k + 1 :])


def exchange_lines(content: bytes, rng: random.Random) -> bytes:
    lines, k = _some_line(content, rng)
    other = rng.randrange(len(lines))
    lines[k], lines[other] = lines[other], lines[k]
    return b"".join(lines)


def shuffle_lines(content: bytes, rng: random.Random) -> bytes:
    lines, _ = _some_line(content, rng)
    rng.shuffle(lines)
    return b"".join(lines)


def insert_line(content: bytes, rng: random.Random) -> bytes:
    lines, k = _some_line(content, rng)
    return b"".join([*lines[:k], rng.choice(TOKENS).encode() + b"\n", *lines[k:]])


def replace_words(content: bytes, rng: random.Random) -> bytes:
    text = content.decode("utf-8", errors="surrogateescape")
    for _ in range(rng.choice((1, 1, 1, 3))):
        words = list(WORDS.finditer(text))
        if not words:
            break
        word = rng.choice(words)
        other = rng.choice((rng.choice(TOKENS), rng.choice(words)[0]))
        text = text[: word.start()] + other + text[word.end() :]
    return text.encode("utf-8", errors="surrogateescape")


def replace_word_everywhere(content: bytes, rng: random.Random) -> bytes:
    text = content.decode("utf-8", errors="surrogateescape")
    words = sorted({match[0] for match in WORDS.finditer(text)})
    if words:
        text = text.replace(rng.choice(words), rng.choice(TOKENS))
    return text.encode("utf-8", errors="surrogateescape")


def other_encoding(content: bytes, rng: random.Random) -> bytes:
    text = content.decode("utf-8", errors="replace")
    return text.encode(rng.choice(("utf-16", "utf-16-le", "utf-32", "cp1250", "utf-7")), "replace")


def other_separator(content: bytes, rng: random.Random) -> bytes:
    pairs = ((b",", b";"), (b",", b"\t"), (b".", b","), (b";", b","), (b"\n", b"\r"), (b" ", b""))
    return content.replace(*rng.choice(pairs))


TEXT_MUTATIONS: tuple[Mutation, ...] = (
    *(flip_bytes, truncate, cut_out, repeat_a_piece, insert_nul, insert_token, delete_line),
    *(double_line, exchange_lines, shuffle_lines, insert_line, replace_words, replace_words),
    *(replace_words, replace_word_everywhere, other_encoding, other_separator),
)


def mutate_part(content: bytes, rng: random.Random) -> bytes:
    """Change one part inside the archive, and pack it anew."""
    stream = io.BytesIO()
    with zipfile.ZipFile(io.BytesIO(content)) as old, zipfile.ZipFile(stream, "w") as new:
        names = old.namelist()
        sheet = next(name for name in names if "worksheets/sheet" in name)
        chosen = rng.choice((sheet, rng.choice(names)))
        for name in names:
            part = old.read(name)
            if name == chosen:
                if rng.random() < 0.05:
                    continue
                for _ in range(rng.choice((1, 1, 3))):
                    part = rng.choice(TEXT_MUTATIONS)(part, rng)
            new.writestr(name, part)
    return stream.getvalue()


def mutate_text(content: bytes, rng: random.Random) -> bytes:
    for _ in range(rng.choice((1, 1, 2, 5))):
        content = rng.choice(TEXT_MUTATIONS)(content, rng)
    return content


def mutate_archive(content: bytes, rng: random.Random) -> bytes:
    if rng.random() < 0.3:
        return rng.choice((flip_bytes, truncate, cut_out, repeat_a_piece))(content, rng)
    return mutate_part(content, rng)


def mutate_bytes(content: bytes, rng: random.Random) -> bytes:
    for _ in range(rng.choice((1, 1, 3))):
        content = rng.choice((flip_bytes, flip_bytes, truncate, cut_out))(content, rng)
    return content


def check_mutants(
    content: bytes, reader: Reader, path: Path, mutate: Mutation, count: int
) -> tuple[int, int]:
    """Read mutants of a file; return how many were read and how many refused."""
    read = refused = 0
    places: list[str] = []
    for seed in range(count):
        rng = random.Random(seed)  # noqa: S311  repeatable, no secret
        path.write_bytes(mutate(content, rng))
        begin = time.process_time()
        try:
            test = rng.choice((reader, read_positioning))(path)
        except ThermaxisError as error:
            refused += 1
            places.append(error.place.file)
        else:
            assert isinstance(test, PositioningTest), f"seed {seed}"
            check_that_it_can_be_written(test, path.with_suffix(".written"))
            read += 1
        assert time.process_time() - begin < 20.0, (
            f"seed {seed}"
        )  # a few milliseconds, traced or not
    assert set(places) <= {str(path)}
    return read, refused


def test_no_changed_file_gives_other_readings_without_a_word(tmp_path: Path, root: Path) -> None:
    path = tmp_path / "run"
    known = [
        (base, changes.read(path, base.text.encode(), base.mapping)) for base in changes.bases(root)
    ]
    assert len(known) > 50
    words: set[str] = set()
    for k in range(300):
        rng = random.Random(f"test-{k}")  # noqa: S311  repeatable, no secret
        base, test = rng.choice(known)
        mutant = rng.choice(changes.MUTATIONS)(base.text, rng)
        verdict = changes.judged(test, mutant, path, base.mapping)
        assert verdict.word != "WRONG", f"{k} {base.name}: {mutant.shown}: {verdict.why}"
        words.add(verdict.word)
    assert words == {"same", "refused", "told", "literal"}


def test_the_judge_of_changed_files_sees_a_wrong_reading(tmp_path: Path, root: Path) -> None:
    base = next(one for one in changes.bases(root) if one.name == "F1 B1")
    path = tmp_path / "run"
    test = changes.read(path, base.text.encode(), base.mapping)
    exchanged = base.text.replace("F1;B1", "B1;F1").encode()  # as if the reader had mixed them up
    mutant = changes.Mutant(exchanged, frozenset(), "directions exchanged")
    assert changes.judged(test, mutant, path, base.mapping).word == "WRONG"


def check_that_it_can_be_written(test: PositioningTest, path: Path) -> None:
    """What was read from a damaged file is as good as any run: it is written and read again."""
    try:
        path.write_text(format_tidy_csv(test), encoding="utf-8", newline="")
    except ThermaxisError:
        return
    again = read_positioning(path)
    np.testing.assert_array_equal(again.deviation, test.deviation)
    assert again.header == test.header


READERS: dict[str, Reader] = {
    "tidy": read_positioning,
    "foreign tidy": read_positioning,
    "wide": read_positioning,
    "dat": read_positioning,
    "rtl": read_positioning,
    "tidy workbook": read_positioning,
    "wide workbook": read_positioning,
    "old workbook": read_positioning,
}


@pytest.mark.proof
@pytest.mark.parametrize("name", READERS)
def test_a_damaged_file_gives_a_run_or_one_of_our_errors(tmp_path: Path, name: str) -> None:
    content, reader = MADE[name](), READERS[name]
    path = tmp_path / "run"
    path.write_bytes(content)
    assert isinstance(reader(path), PositioningTest)
    mutate, count = mutate_text, 160
    if "workbook" in name:
        mutate, count = (mutate_bytes if "old" in name else mutate_archive), 90
    read, refused = check_mutants(content, reader, path, mutate, count)
    assert read > 10
    assert refused > 40
