"""Whatever happens to a file: a run is read, or one of the project's errors says why not."""

import io
import random
import re
import tempfile
import time
import zipfile
from collections.abc import Callable
from datetime import datetime
from pathlib import Path

import numpy as np
import openpyxl
import pytest

from thermaxis.errors import ThermaxisError
from thermaxis.files import (
    format_tidy_csv,
    read_iso230_dat,
    read_positioning,
    read_rtl,
    read_tidy_csv,
    read_wide_csv,
    read_xlsx,
    write_rtl,
)
from thermaxis.positioning import PositioningTest, StartEnd, TimeSource
from thermaxis.quantities import AxisKind

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
    *("0001-01-01T00:00:00+23:59", "2022-02-30", "2022-04-06T12:48:40Z", "TRUE", "#DIV/0!"),
    *("]", "[1,1]", "TGT_DATA[1000000000]", "CYCLES=1000000000", "Run-count:1000000000", "-0"),
)
WORDS = re.compile(r"[^\s,;:=\[\]<>\"/]+")

Mutation = Callable[[bytes, random.Random], bytes]
Reader = Callable[[Path], PositioningTest]


def example(kind: AxisKind = AxisKind.LINEAR) -> PositioningTest:
    """A small run with everything that a file can say."""
    targets, cycles = 6, 3
    random_part = np.random.default_rng(11).normal(0.0, 1.5, (targets, cycles, 2))
    deviation = np.round(random_part + np.linspace(-4, 9, targets)[:, None, None], 3)
    place = np.stack((np.arange(targets), 2 * targets - 1 - np.arange(targets)), axis=-1)
    order = place[:, None, :] + 2 * targets * np.arange(cycles)[None, :, None] + 1.0
    return PositioningTest(
        kind=kind,
        target=np.array([-40.0, -10.5, 0.0, 31.25, 60.0, 95.0]),
        deviation=deviation,
        time_source=TimeSource.FILE,
        time_s=(order - 1) * 7.5,
        order=order,
        start=datetime(2026, 3, 2, 8, 0),  # noqa: DTZ001  files state local time
        end=datetime(2026, 3, 2, 8, 5),  # noqa: DTZ001  files state local time
        channels={"motor temperature": np.round(20 + order / 50, 2)},
        environment={"air_temperature_c": StartEnd(20.3, 20.6)},
        header={"machine": "Čapek & söhne", "axis": "X", "title": '=1+2, "quoted"'},
    )


def tidy() -> bytes:
    return format_tidy_csv(example()).encode()


def foreign_tidy() -> bytes:
    """As another program might write it: semicolons, decimal commas, units in brackets."""
    test = example()
    lines = [
        "Machine: MCV 750",
        "Serial No;12-345",
        "",
        "Run;Target (mm);Error (µm);Measured [mm];Time",
    ]
    for run in range(1, 7):
        for k in range(6):
            i = k if run % 2 else 5 - k
            target, deviation = test.target[i], test.deviation[i, (run - 1) // 2, (run + 1) % 2]
            numbers = f"{target:.2f};{deviation:.3f};{target + deviation / 1000:.6f}"
            moment = f"2026-03-02 08:{run:02}:{6 * k:02}"
            lines.append(f"{run};{numbers.replace('.', ',')};{moment}")
    return "\r\n".join(lines).encode("cp1250")


def wide() -> bytes:
    test = example(AxisKind.ROTARY)
    lines = ["# unit: arcsec", "# header title: wide", "target_deg,1,2,3,4,5,6,note"]
    for target, row in zip(test.target, test.deviation.reshape(6, 6), strict=True):
        lines.append(f"{target}," + ",".join(map(str, row)) + ",")
    return "\n".join(lines).encode()


def dat() -> bytes:
    test = example()
    lines = ["TEST_DATA=# made for a test", "UNIT=mm", "CYCLES=3", "POSITIONS=6", "DEC=5"]
    lines += [f"TGT_DATA[{i + 1}]={target}" for i, target in enumerate(test.target)]
    for name, approach in (("FWD", 0), ("BWD", 1)):
        for (i, j), value in np.ndenumerate(test.deviation[:, :, approach]):
            lines.append(f"REF_DATA_{name}[{i + 1},{j + 1}]={test.target[i] + value / 1000:.9f}")
    return "\n".join(lines).encode()


def rtl() -> bytes:
    path = Path(tempfile.mkdtemp()) / "run.rtl"
    write_rtl(example(), path)
    content = path.read_bytes()
    path.unlink()
    path.parent.rmdir()
    return content


def workbook(rows: list[list[object]], *, formula: bool = False) -> bytes:
    book = openpyxl.Workbook()
    sheet = book.active
    for row in rows:
        sheet.append(row)
    if formula:
        sheet["J2"] = "=SUM(A2:A9)"
    stream = io.BytesIO()
    book.save(stream)
    return stream.getvalue()


def tidy_workbook() -> bytes:
    test = example()
    rows: list[list[object]] = [["cycle", "direction", "target_mm", "deviation_um", "time"]]
    for i, j, a in np.ndindex(6, 3, 2):
        moment = datetime(2026, 3, 2, 8, j, 6 * (i if a == 0 else 5 - i), 500_000 * a)  # noqa: DTZ001  files state local time
        rows.append([j + 1, ("+", "-")[a], test.target[i], test.deviation[i, j, a], moment])
    return workbook(rows, formula=True)


def wide_workbook() -> bytes:
    test = example()
    rows: list[list[object]] = [["Target (mm)", *(f"Run {run} (µm)" for run in range(1, 7))]]
    runs = test.deviation.reshape(6, 6).tolist()
    rows += [[target, *row] for target, row in zip(test.target, runs, strict=True)]
    return workbook(rows)


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


def check_that_it_can_be_written(test: PositioningTest, path: Path) -> None:
    """What was read from a damaged file is as good as any run: it is written and read again."""
    try:
        path.write_text(format_tidy_csv(test), encoding="utf-8", newline="")
    except ThermaxisError:
        return
    again = read_tidy_csv(path)
    np.testing.assert_array_equal(again.deviation, test.deviation)
    assert again.header == test.header


TEXT_FORMATS: dict[str, tuple[Callable[[], bytes], Reader]] = {
    "tidy": (tidy, read_tidy_csv),
    "foreign tidy": (foreign_tidy, read_tidy_csv),
    "wide": (wide, read_wide_csv),
    "dat": (dat, read_iso230_dat),
    "rtl": (rtl, read_rtl),
}


@pytest.mark.parametrize("name", TEXT_FORMATS)
def test_a_damaged_text_file_gives_a_run_or_one_of_our_errors(tmp_path: Path, name: str) -> None:
    make, reader = TEXT_FORMATS[name]
    path = tmp_path / "run.txt"
    path.write_bytes(make())
    assert isinstance(reader(path), PositioningTest)
    read, refused = check_mutants(make(), reader, path, mutate_text, 250)
    assert read > 15
    assert refused > 50


@pytest.mark.parametrize("make", [tidy_workbook, wide_workbook])
def test_a_damaged_workbook_gives_a_run_or_one_of_our_errors(
    tmp_path: Path, make: Callable[[], bytes]
) -> None:
    path = tmp_path / "run.xlsx"
    content = make()
    path.write_bytes(content)
    assert isinstance(read_xlsx(path), PositioningTest)
    read, refused = check_mutants(content, read_xlsx, path, mutate_archive, 120)
    assert read > 10
    assert refused > 40
