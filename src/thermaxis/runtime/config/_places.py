"""Where in a configuration file a mistake stands: the line of a table or a key."""

import re
from collections.abc import Sequence
from pathlib import Path

from thermaxis.runtime.config._connection import Problem

_TABLE = re.compile(r"""^\s*\[\s*((?:[\w-]+|"[^"]*"|'[^']*'|\s*\.\s*)+)\s*\]\s*(?:\#.*)?$""")
_KEY = re.compile(r"""^\s*([\w-]+|"[^"]*"|'[^']*')\s*=""")
_PLACE = re.compile(r"^\[(?P<table>[^\]]+)\](?:, (?P<key>.+))?$")
_UNKNOWN = re.compile(r"^'(?P<key>.+)' is not a key here$")


def with_lines(problems: Sequence[Problem], file: Path) -> tuple[Problem, ...]:
    """Name the line of every mistake, where it can be found.

    Parameters
    ----------
    problems : sequence of Problem
        What is wrong, with table and key.
    file : Path
        The file; it has been read before.

    Returns
    -------
    tuple of Problem
        The same with ``line N`` in front of the place. Where a key is missing, the line is that
        of its table. Nothing is added where the text has forms that only a whole reader of TOML
        follows, such as texts over several lines.
    """
    try:
        text = file.read_text(encoding="utf-8-sig")
    except (OSError, ValueError):
        return tuple(problems)
    if '"""' in text or "'''" in text:
        return tuple(problems)
    lines = _lines_of(text)
    return tuple(_with_line(problem, lines) for problem in problems)


def _lines_of(text: str) -> dict[tuple[str, str], int]:
    """Return the line of every table (key empty) and of every key in it."""
    found: dict[tuple[str, str], int] = {}
    table = ""
    for number, line in enumerate(text.splitlines(), start=1):
        head = _TABLE.match(line)
        if head is not None:
            table = _plain(head[1])
            found.setdefault((table, ""), number)
            continue
        key = _KEY.match(line)
        if key is not None:
            found.setdefault((table, _plain(key[1])), number)
    return found


def _plain(name: str) -> str:
    return re.sub(r"""\s*\.\s*""", ".", name).replace('"', "").replace("'", "").strip()


def _with_line(problem: Problem, lines: dict[tuple[str, str], int]) -> Problem:
    place = _PLACE.match(problem.place)
    table, keys = (place["table"], place["key"] or "") if place else (problem.place, "")
    key = keys.partition(",")[0]
    shown = problem.place
    unknown = _UNKNOWN.match(problem.what)
    if unknown is not None:
        table, key = f"{table}.{key}".strip("."), unknown["key"]
        shown = f"[{table}]" if table else f"[{key}]"
    inner = f"{table}.{key}".strip(".")
    number = lines.get((table, key)) or lines.get((inner, "")) or lines.get((table, ""))
    if number is None:
        return Problem(shown, problem.what, problem.remedy)
    where = f"line {number}, {shown}" if shown else f"line {number}"
    return Problem(where, problem.what, problem.remedy)
