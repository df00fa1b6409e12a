"""The parts of a result's description, and what terminal and JSON make of them."""

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import fields, is_dataclass
from datetime import datetime
from typing import NamedTuple, TypeAlias, cast

import numpy as np

from thermaxis.codes import Message, message_as_json, printable
from thermaxis.messages import text_of
from thermaxis.report import _document as page
from thermaxis.report.tables._text_table import filled, text_table

_ABSENT = "–"
_LONGEST = 600
_LONGEST_LINE = 2000


class Value(NamedTuple):
    """One number or text of a result; an interval is one line, several texts one each."""

    key: str
    """Key in the JSON; dots lead into objects; empty: for the terminal only."""
    value: object
    """What it is; NaN and infinity become null and a dash."""
    head: str | None = None
    """Label of its line or head of its column; None: for the JSON only."""
    form: str = ""
    """How a number is formatted, such as ``+.2f``."""
    unit: str = ""
    """Written behind the number in a line."""


class Table(NamedTuple):
    """Rows with the same heads; in the JSON an array, or an object by name."""

    title: str
    """Line above it; empty: for the JSON only."""
    rows: Sequence[Sequence[Value]]
    key: str = ""
    """Key in the JSON; empty: for the terminal only."""
    names: Sequence[str] | None = None
    """Names of the rows, where the JSON is an object."""
    words: int = 0
    """So many columns from the left hold words."""


class Section(NamedTuple):
    """Parts of a result that belong together."""

    key: str
    """Key of the object in the JSON; empty: its parts stand where it stands."""
    parts: "Sequence[Part]"


Part: TypeAlias = Value | Table | Section | str
"""Part of a description; a text is a line for the terminal only."""


def rows_of(*columns: Value) -> list[list[Value]]:
    """Return rows of a table whose columns are sequences of the same length."""
    return [
        [column._replace(value=value) for column, value in zip(columns, row, strict=True)]
        for row in zip(*(cast("Sequence[object]", c.value) for c in columns), strict=True)
    ]


def values_of(source: object, *keys: str) -> list[Value]:
    """Return attributes of a result, which are keys of the JSON alone."""
    return [Value(key, getattr(source, key)) for key in keys]


def without_text(*values: Value) -> list[Value]:
    """Return values for the JSON alone."""
    return [value._replace(head=None) for value in values]


def messages_of(
    key: str,
    messages: Sequence[Message],
    head: str | None = None,
    *,
    before: Sequence[str] = (),
    say: Callable[[Message], str] = text_of,
) -> list[Value]:
    """Return messages as sentences, behind others, and as data: ``warnings``, ``warning_codes``."""
    return [
        Value(key, [*before, *map(say, messages)], head),
        Value(f"{key.removesuffix('s')}_codes", [*map(message_as_json, messages)]),
    ]


def as_json(parts: Sequence[Part]) -> dict[str, object]:
    """Return a described result as objects, arrays, texts and numbers of JSON.

    Returns
    -------
    dict
        Values by their keys; numbers that are not finite, and other values that do not exist, are
        None.
    """
    content: dict[str, object] = {}
    for part in parts:
        if isinstance(part, Section):
            inner = as_json(part.parts)
            if part.key:
                _put(content, part.key, inner)
            else:
                content |= inner
        elif isinstance(part, Table) and part.key:
            rows = [as_json(row) for row in part.rows]
            named = part.names is not None
            _put(
                content, part.key, dict(zip(part.names or (), rows, strict=True)) if named else rows
            )
        elif isinstance(part, Value) and part.key:
            _put(content, part.key, _plain(part.value))
    return content


def _put(content: dict[str, object], key: str, value: object) -> None:
    first, _, rest = key.partition(".")
    if rest:
        _put(cast("dict[str, object]", content.setdefault(first, {})), rest, value)
    else:
        content[first] = value


def _plain(value: object) -> object:  # noqa: PLR0911 - one per type
    if isinstance(value, np.ndarray | np.generic):
        return _plain(cast("object", value.tolist()))
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, datetime):
        return value.isoformat()
    if isinstance(value, str):
        return str(value)
    if isinstance(value, Mapping):
        entries = cast("Mapping[object, object]", value).items()
        return {str(key): _plain(one) for key, one in entries}
    if isinstance(value, Sequence):
        return [_plain(one) for one in cast("Sequence[object]", value)]
    if is_dataclass(value):
        return {field.name: _plain(getattr(value, field.name)) for field in fields(value)}
    return value


def as_text(parts: Sequence[Part]) -> str:
    """Return a described result as paragraphs and tables for a terminal.

    Parameters
    ----------
    parts : sequence of Part
        The description; lines that follow each other make a paragraph.

    Returns
    -------
    str
        Text from files cannot act on the terminal.
    """
    return "\n".join(_paragraphs(parts))


def _paragraphs(parts: Sequence[Part]) -> Iterator[str]:
    lines: list[str] = []
    for part in parts:
        if isinstance(part, str):
            lines.append(filled(printable(part, _LONGEST_LINE), hanging=True) if part else "")
        elif isinstance(part, Value):
            lines += _lines(part)
        else:
            if lines:
                yield "\n".join(lines) + "\n"
                lines = []
            if isinstance(part, Section):
                yield from _paragraphs(part.parts)
            elif part.rows and part.title:
                yield _table(part)
    if lines:
        yield "\n".join(lines) + "\n"


def _lines(value: Value) -> list[str]:
    if value.head is None:
        return []
    shown = value.value
    values: Sequence[object] = [shown]
    if isinstance(shown, Sequence) and not isinstance(shown, str):
        values = cast("Sequence[object]", shown)
    cells = [_cell(one, value.form, _LONGEST) for one in values]
    if len(cells) > 1 and not all(isinstance(one, str) for one in values):
        cells = [" to ".join(cells)]
    unit = f" {value.unit}" if value.unit else ""
    head = f"{value.head}: " if value.head else ""
    return [filled(f"{head}{cell}{unit}", hanging=True) for cell in cells]


def _table(table: Table) -> str:
    columns = [k for k, value in enumerate(table.rows[0]) if value.head is not None]
    heads = [table.rows[0][k].head or "" for k in columns]
    rows = [[_cell(row[k].value, row[k].form) for k in columns] for row in table.rows]
    return text_table(printable(table.title, _LONGEST), heads, rows, words=table.words)


def as_page_table(table: Table) -> page.Table:
    """Return a table as a certificate has it, its title as caption."""
    columns = [k for k, value in enumerate(table.rows[0]) if value.head is not None]
    heads: Iterable[str] = [table.rows[0][k].head or "" for k in columns]
    rows = (tuple(_cell(row[k].value, row[k].form) for k in columns) for row in table.rows)
    heads = (f"<{head}" if k < table.words else head for k, head in enumerate(heads))
    return page.Table(page.columns_of(" | ".join(heads)), tuple(rows), table.title)


def _cell(value: object, form: str, longest: int = 60) -> str:
    if isinstance(value, str):
        return printable(value, longest)
    if value is None:
        return _ABSENT
    if isinstance(value, int | float | np.floating):
        number = cast("float", value)
        if not math.isfinite(number):
            return _ABSENT
        text = format(number, form)
        return text if text.strip("+-0.") else text.lstrip("+-")
    return printable(str(value), longest)
