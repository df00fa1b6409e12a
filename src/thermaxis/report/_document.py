"""The content of a certificate, before it is PDF or HTML: strings only, in a few kinds of block."""

from dataclasses import dataclass
from typing import Literal, TypeAlias, final

Align: TypeAlias = Literal["left", "right", "center"]


@final
@dataclass(frozen=True, slots=True)
class Column:
    """A column of a table."""

    label: str
    align: Align = "right"
    """Side to which its cells go."""
    wide: bool = False
    """Whether it takes the width that others leave."""


def columns_of(labels: str) -> tuple[Column, ...]:
    """Return columns by their labels between bars.

    A label behind ``<`` goes to the left, one behind ``*`` as well and takes the width left over.
    """
    return tuple(
        Column(label.lstrip("<*"), "left" if label[:1] in {"<", "*"} else "right", label[:1] == "*")
        for label in labels.split(" | ")
    )


@final
@dataclass(frozen=True, slots=True)
class Paragraph:
    """Running text."""

    text: str
    strong: bool = False
    """Whether it must not be overlooked."""
    kind: Literal["paragraph"] = "paragraph"


@final
@dataclass(frozen=True, slots=True)
class ItemList:
    """Numbered notes, or points."""

    items: tuple[str, ...]
    numbered: bool = False
    kind: Literal["list"] = "list"


@final
@dataclass(frozen=True, slots=True)
class Table:
    """A table; every row has one cell per column."""

    columns: tuple[Column, ...]
    rows: tuple[tuple[str, ...], ...]
    caption: str = ""
    strong_rows: tuple[int, ...] = ()
    """Rows, from 0, that stand out."""
    dense: bool = False
    """Whether it is long and printed small."""
    kind: Literal["table"] = "table"


@final
@dataclass(frozen=True, slots=True)
class Fields:
    """A group of labelled values."""

    title: str
    fields: tuple[tuple[str, str], ...]
    code: bool = False
    """Whether values are codes of one line each, such as check sums."""
    kind: Literal["fields"] = "fields"


@final
@dataclass(frozen=True, slots=True)
class Picture:
    """A chart."""

    svg: str
    caption: str
    fills: bool = False
    """Whether it takes what the first page has left."""
    kind: Literal["picture"] = "picture"


@final
@dataclass(frozen=True, slots=True)
class Verdict:
    """Pass, fail or not decided, with the rule."""

    word: str
    sentence: str
    reservation: str = ""
    """What must be read with it."""
    kind: Literal["verdict"] = "verdict"


@final
@dataclass(frozen=True, slots=True)
class Signature:
    """Lines on which somebody writes."""

    labels: tuple[str, ...]
    """What each line is for."""
    kind: Literal["signature"] = "signature"


Block: TypeAlias = Paragraph | ItemList | Table | Fields | Picture | Verdict | Signature


@final
@dataclass(frozen=True, slots=True)
class Section:
    """A heading with what belongs to it."""

    heading: str
    blocks: tuple[Block, ...]


@final
@dataclass(frozen=True, slots=True)
class Document:
    """A whole certificate."""

    title: str
    subtitle: str
    date: str | None
    """ISO date, for the properties of the file."""
    footer: str
    """Stands at the foot of every page."""
    author: str
    """Program and version, for the properties of the file."""
    opening: tuple[Block, ...]
    """What comes before the first heading."""
    sections: tuple[Section, ...]
    issuer: tuple[str, ...] = ()
    """Lines that stand above the title: who issues it."""
    end: str = ""
