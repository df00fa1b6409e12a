"""Files that something happened to: the same readings, a refusal, or a remark about what is gone.

A change is made by chance and a file is read again. What the changed text itself says counts: where
a digit is gone, the number without it is what stands in the file, for that reading alone.
"""

import random
import re
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple, TypeAlias

import numpy as np

from tests.unit.files.nasty import CASES
from thermaxis.errors import ThermaxisError
from thermaxis.files import RunMapping, read_positioning
from thermaxis.positioning import PositioningTest

Key: TypeAlias = tuple[float, int, int]
TELLING = frozenset(
    f"remark-{code}"
    for code in (
        *(
            "readings_missing",
            "rows_left_out",
            "cycles_empty",
            "columns_of_no_run",
            "no_eof",
            "no_line_end",
        ),
        *(
            "columns_left_out",
            "channels_kept",
            "one_direction",
            "beyond_travel",
            "runs_not_alternating",
        ),
    )
)
"""Codes that say which readings are not there."""


class Base(NamedTuple):
    """A file that is read as it should be."""

    name: str
    text: str
    mapping: RunMapping = RunMapping()
    encoding: str = "utf-8"


class Mutant(NamedTuple):
    """A changed file."""

    content: bytes
    lines: frozenset[str]
    """Lines that were changed, as they are now."""
    shown: str
    """What was done."""


@dataclass(frozen=True)
class Verdict:
    """What became of a mutant."""

    word: str
    why: str = ""


def bases(root: Path) -> Iterator[Base]:
    """Yield real files, where they are there, and all forms of the one run that are read."""
    data = root.parent / "shared" / "data" / "positioning"
    for name in (
        "ess_target_b02_x/x_positioning_with_times.csv",
        "ess_target_b02_x/target_x_ISO230.dat",
        "psi_ecmccfg/ess_mcu1025_2021/report.md_ISO230.dat",
    ):
        if (data / name).is_file():
            yield Base(name.rpartition("/")[2], (data / name).read_text("utf-8"))
    for case in CASES:
        if not case.other and (not case.refused or case.mapping != RunMapping()):
            try:
                text = case.content.decode("utf-8")
            except UnicodeDecodeError:
                continue
            if "\0" not in text:
                yield Base(case.name, text, case.mapping)


def _line(text: str, rng: random.Random) -> tuple[list[str], int]:
    lines = text.split("\n")
    return lines, rng.choice([k for k, line in enumerate(lines) if line.strip()])


def _mutant(lines: list[str], touched: set[int], shown: str) -> Mutant:
    whole = frozenset(lines[k] for k in touched if k < len(lines))
    return Mutant("\n".join(lines).encode(), whole, shown)


def drop_characters(text: str, rng: random.Random) -> Mutant:
    lines, k = _line(text, rng)
    place = rng.randrange(len(lines[k]))
    gone = lines[k][place : place + rng.choice((1, 1, 1, 2, 5))]
    lines[k] = lines[k][:place] + lines[k][place + len(gone) :]
    return _mutant(lines, {k}, f"line {k + 1} without '{gone}'")


def exchange_characters(text: str, rng: random.Random) -> Mutant:
    lines, k = _line(text, rng)
    line = lines[k]
    place = rng.randrange(max(1, len(line) - 1))
    lines[k] = line[:place] + line[place : place + 2][::-1] + line[place + 2 :]
    return _mutant(lines, {k}, f"line {k + 1} '{line[place : place + 2]}' turned")


def swap_separators(text: str, rng: random.Random) -> Mutant:
    old, new = rng.choice(
        (
            (";", ","),
            (";", "\t"),
            (",", ";"),
            (";", "|"),
            (".", ","),
            (",", "."),
            ("\t", ";"),
            (";", " "),
        )
    )
    if rng.random() < 0.5:
        lines, k = _line(text, rng)
        lines[k] = lines[k].replace(old, new, rng.choice((1, 99)))
        return _mutant(lines, {k}, f"line {k + 1} '{old}' to '{new}'")
    return Mutant(text.replace(old, new).encode(), frozenset(), f"'{old}' to '{new}'")


def delete_row(text: str, rng: random.Random) -> Mutant:
    lines, k = _line(text, rng)
    gone = lines.pop(k)
    return Mutant("\n".join(lines).encode(), frozenset(), f"line {k + 1} deleted: {gone}")


def repeat_row(text: str, rng: random.Random) -> Mutant:
    lines, k = _line(text, rng)
    lines.insert(rng.randrange(len(lines)), lines[k])
    return Mutant("\n".join(lines).encode(), frozenset(), f"line {k + 1} repeated")


def cut_off(text: str, rng: random.Random) -> Mutant:
    lines, k = _line(text, rng)
    cut = "\n".join([*lines[:k], lines[k][: rng.randrange(len(lines[k]) + 1)]])
    return Mutant(cut.encode(), frozenset({cut.rpartition("\n")[2]}), f"cut off in line {k + 1}")


def _cells(line: str) -> tuple[list[str], str]:
    delimiter = max(";\t,|", key=line.count)
    return line.split(delimiter), delimiter


def delete_cell(text: str, rng: random.Random) -> Mutant:
    lines, k = _line(text, rng)
    cells, delimiter = _cells(lines[k])
    c = rng.randrange(len(cells))
    emptied = rng.random() < 0.6
    cells[c : c + 1] = [""] if emptied else []
    lines[k] = delimiter.join(cells)
    return _mutant(lines, {k}, f"line {k + 1} cell {c + 1} {'emptied' if emptied else 'deleted'}")


def insert_cell(text: str, rng: random.Random) -> Mutant:
    lines, k = _line(text, rng)
    cells, delimiter = _cells(lines[k])
    c = rng.randrange(len(cells) + 1)
    cells.insert(c, rng.choice(("", "7", "x", "-")))
    lines[k] = delimiter.join(cells)
    return _mutant(lines, {k}, f"line {k + 1} cell {c + 1} inserted")


def shift_column(text: str, rng: random.Random) -> Mutant:
    """Shift one column of all rows by a row, or move a column to another place."""
    lines = text.split("\n")
    if rng.random() < 0.5:
        split = [_cells(line) for line in lines]
        width = Counter(len(cells) for cells, _ in split).most_common(1)[0][0]
        c, to = rng.randrange(width), rng.randrange(width)
        for cells, _ in split:
            if len(cells) == width:
                cells.insert(to, cells.pop(c))
        moved = "\n".join(delimiter.join(cells) for cells, delimiter in split)
        return Mutant(moved.encode(), frozenset(), f"column {c + 1} moved to {to + 1}")
    lines, k = _line(text, rng)
    lines[k] = rng.choice((";", " ;", ",", "\t")) + lines[k]
    return _mutant(lines, {k}, f"line {k + 1} shifted")


def change_encoding(text: str, rng: random.Random) -> Mutant:
    name = rng.choice(
        ("utf-8-sig", "utf-16", "utf-16-le", "utf-16-be", "cp1250", "latin-1", "cp437")
    )
    content = text.encode(name, errors="replace")
    ends = rng.choice(("\n", "\r\n", "\r"))
    if not name.startswith("utf-16"):
        content = content.replace(b"\n", ends.encode())
    return Mutant(content, frozenset(text.split("\n")) if "?" in name else frozenset(), name)


def change_word(text: str, rng: random.Random) -> Mutant:
    lines, k = _line(text, rng)
    words = list(re.finditer(r"[^\s;,|\t]+", lines[k]))
    word, other = (
        rng.choice(words),
        rng.choice(("nan", "-", "x", "Mean", "1", "forward", "n/a", "0")),
    )
    lines[k] = lines[k][: word.start()] + other + lines[k][word.end() :]
    return _mutant(lines, {k}, f"line {k + 1} '{word[0]}' to '{other}'")


MUTATIONS: tuple[Callable[[str, random.Random], Mutant], ...] = (
    *(drop_characters, drop_characters, exchange_characters, swap_separators, swap_separators),
    *(delete_row, repeat_row, cut_off, delete_cell, delete_cell, insert_cell, shift_column),
    *(change_encoding, change_word),
)


def readings_of(test: PositioningTest) -> dict[Key, float]:
    """Return the deviations by target, cycle and approach."""
    return {
        (round(float(test.target[i]), 3), j, a): float(test.deviation[i, j, a])
        for i, j, a in np.argwhere(~np.isnan(test.deviation)).tolist()
    }


def read(path: Path, content: bytes, mapping: RunMapping) -> PositioningTest:
    """Read a content."""
    path.write_bytes(content)
    return read_positioning(path, mapping=mapping)


def _numbers_in(lines: frozenset[str]) -> set[float]:
    """Return whatever numbers can be found in lines, however they are written."""
    found: set[float] = set()
    for line in lines:
        for word in re.findall(r"[-+−]?[0-9.,'\u00a0\u202f]+", line):
            plain = re.sub(r"['\u00a0\u202f]", "", word.replace("−", "-"))
            for text in (
                plain,
                plain.replace(",", "."),
                plain.replace(".", "").replace(",", "."),
                plain.replace(",", ""),
            ):
                for part in (text, *re.split(r"[,;]", plain)):
                    try:
                        found.add(float(part))
                    except ValueError:
                        continue
    return found


def _whole(lost: set[Key], before: dict[Key, float]) -> bool:
    """Say whether whole targets or the last cycles are gone: what is left is a run of its own."""
    targets, cycles = {key[0] for key in lost}, {key[1] for key in lost}
    by_target = {key for key in before if key[0] in targets}
    by_cycle = {key for key in before if key[1] in cycles}
    last = max(key[1] for key in before)
    return bool(lost) and (lost == by_target or (lost == by_cycle and max(cycles) == last))


def _is_stated(values: set[float], stated: set[float]) -> bool:
    """Say whether values stand among numbers, in one unit or another."""
    scaled = [one * scale for one in stated for scale in (1.0, 1e-3, 1e3)]
    return all(
        any(np.isclose(value, one, rtol=1e-6, atol=1e-9) for one in scaled) for value in values
    )


def _scale(before: dict[Key, float], after: dict[Key, float]) -> float | None:
    """Return by how much all targets were multiplied, None if not by the same."""
    pairs = zip(sorted({k[0] for k in after}), sorted({k[0] for k in before}), strict=False)
    factors = {round(new / old, 6) for new, old in pairs if old}
    return factors.pop() if len(factors) == 1 else None


def judged(base: PositioningTest, mutant: Mutant, path: Path, mapping: RunMapping) -> Verdict:
    """Say what became of a mutant."""
    try:
        test = read(path, mutant.content, mapping)
    except ThermaxisError as error:
        return Verdict("refused", error.code)
    before, after = readings_of(base), readings_of(test)
    lost, gained = before.keys() - after.keys(), after.keys() - before.keys()
    other = {key for key in before.keys() & after.keys() if abs(before[key] - after[key]) > 1e-6}
    said = {one.code for one in test.remarks if one not in base.remarks}
    told, kept = bool(said & TELLING), not lost and not gained
    stated = _numbers_in(mutant.lines)
    targets = {key[0] for key in gained}
    written = _is_stated({after[key] for key in other}, stated)
    # a measured position is another one: its target was taken off
    positions = b"TEST_DATA" in mutant.content or b"measured_mm" in mutant.content
    ends = mutant.shown.startswith("cut off") or _whole(lost, before)
    rules: tuple[tuple[bool, str], ...] = (
        (kept and not other, "same"),
        (not gained and not other and told, "told"),
        (not gained and not other and ends, "literal"),
        (not said.isdisjoint({"remark-beyond_travel", "remark-runs_not_alternating"}), "told"),
        (kept and "remark-unit_assumed" in said, "told"),
        (kept and positions and len(other) == 1, "literal"),
        (
            not gained and bool(other) and len(other) <= 6 and written and (told or not lost),
            "literal",
        ),
        (not other and len(targets) <= 2 and targets <= stated, "literal"),
        (bool(mutant.lines) and _scale(before, after) in {1e3, 1e-3, 1e6, 1e-6, 25.4}, "literal"),
    )
    word = next((word for holds, word in rules if holds), "WRONG")
    return Verdict(word, f"lost {len(lost)}, gained {len(gained)}, other {len(other)}")
