"""Where in a configuration file a mistake stands: the line of a table or a key."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from thermaxis.codes import Message

_TABLE = re.compile(r"""^\s*\[\s*((?:[\w-]+|"[^"]*"|'[^']*'|\s*\.\s*)+)\s*\]\s*(?:\#.*)?$""")
_KEY = re.compile(r"""^\s*([\w-]+|"[^"]*"|'[^']*')\s*=""")


def with_lines(problems: Sequence[Message], file: Path) -> tuple[Message, ...]:
    """Name the file and the line of every mistake, where they can be found."""
    try:
        text = file.read_text(encoding="utf-8-sig")
    except (OSError, ValueError):
        text = ""
    lines = {} if '"""' in text or "'''" in text else _lines_of(text)
    return tuple(_with_line(problem, str(file), lines) for problem in problems)


def _lines_of(text: str) -> dict[str, int]:
    """Return the line of every table and every key, by its name with its tables."""
    found: dict[str, int] = {}
    table = ""
    for number, line in enumerate(text.splitlines(), start=1):
        head = _TABLE.match(line)
        if head is not None:
            table = _plain(head[1])
            found.setdefault(table, number)
            continue
        key = _KEY.match(line)
        if key is not None:
            found.setdefault(f"{table}.{_plain(key[1])}".strip("."), number)
    return found


def _plain(name: str) -> str:
    return re.sub(r"\s*\.\s*", ".", name).replace('"', "").replace("'", "").strip()


def _with_line(problem: Message, file: str, lines: Mapping[str, int]) -> Message:
    place = problem.place
    if place.file:
        return problem
    key = place.key
    while key and key not in lines:
        key = key.rpartition(".")[0]
    return replace(problem, place=place._replace(file=file, line=lines.get(key)))
