"""The lines of a file in which its keys stand."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from thermaxis.codes import Message

_TABLE = re.compile(r"""^\s*\[\s*+((?:[\w-]++|"[^"]*+"|'[^']*+'|\s*+\.\s*+)++)\s*\]\s*(?:\#.*)?$""")
_KEY = re.compile(r"""^\s*([\w-]+|"[^"]*"|'[^']*')\s*=""")


def with_lines(problems: Sequence[Message], file: Path) -> tuple[Message, ...]:
    """Name the file and the line of every mistake, where they can be found.

    Where a key is missing, the line is that of its table. There is none where the text has forms
    that only a whole reader of TOML follows, such as texts over several lines.
    """
    try:
        text = file.read_text(encoding="utf-8-sig")
    except (OSError, ValueError):
        text = ""
    lines: dict[str, int] = {}
    table, long = "", '"""' in text or "'''" in text
    for number, line in enumerate(() if long else text.splitlines(), start=1):
        if (head := _TABLE.match(line)) is not None:
            table = name = _plain(head[1])
        elif (key := _KEY.match(line)) is not None:
            name = f"{table}.{_plain(key[1])}".strip(".")
        else:
            continue
        lines.setdefault(name, number)
    return tuple(_with_line(problem, str(file), lines) for problem in problems)


def _plain(name: str) -> str:
    return re.sub(r"\s*\.\s*", ".", name).replace('"', "").replace("'", "").strip()


def _with_line(message: Message, file: str, lines: Mapping[str, int]) -> Message:
    place = message.place
    if place.file:
        return message
    key = place.key
    while key and key not in lines:
        key = key[: max(key.rfind("."), key.rfind("["), 0)]
    return replace(message, place=place._replace(file=file, line=lines.get(key)))
