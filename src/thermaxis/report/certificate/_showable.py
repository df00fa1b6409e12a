"""Which characters of a run the fonts of a certificate cannot show."""

from collections.abc import Iterable

from matplotlib.ft2font import FT2Font

from thermaxis.codes import Message
from thermaxis.files.settings import HEADER_GROUPS
from thermaxis.messages import sentence_of
from thermaxis.report._positioning_report import PositioningReport
from thermaxis.report._style import chart_font, typeface
from thermaxis.report._text import plain_text

_MOST_FIELDS = 8
_SHARED = ("Name", "Serial number")
"""Labels that several groups have."""
_BLOCKS = (
    (0x0300, 0x052F),
    (0x0590, 0x05FF),
    (0x0900, 0x097F),
    (0x1E00, 0x1EFF),
    (0x2000, 0x2BFF),
    (0x1D400, 0x1D7FF),
)
"""Blocks that other typefaces inside the typesetter show: combining marks, Greek and Cyrillic,
Hebrew, Devanagari, more Latin, symbols, letters of mathematics. First and last code point."""
_NAMES = {
    field.key: f"{field.label} ({group.title.lower()})" if field.label in _SHARED else field.label
    for group in HEADER_GROUPS
    for field in group.fields
}


def unshowable(report: PositioningReport) -> tuple[Message, ...]:
    """Return what names the texts of a run whose characters its certificate cannot show.

    Empty if every character has a sign in the fonts of the PDF and of the charts, as those of
    Latin, Greek and Cyrillic scripts have. Other scripts show in the text of the HTML page, with
    the fonts of the reader's machine.
    """
    header = report.header
    texts = [(_NAMES.get(key, "further lines"), key + value) for key, value in header.items()]
    texts += [("name of the measurement file", report.source_name)]
    texts += [("names of channels", name) for name in report.test.channels]
    texts += [("further lines", name) for name in report.test.environment]
    texts += [("remarks", sentence_of(warning)) for warning in report.warnings]
    if report.limits is not None:
        texts.append(("name of the limits file", report.limits.limits.source_name))
    drawn = [
        (_NAMES["axis"], header.get("axis", "")),
        (_NAMES["title"], header.get("title", "")),
        ("name of the measurement file", report.source_name),
    ]
    return (
        *_absent_from(texts, typeface("DejaVuSansMono"), _BLOCKS, "warning-not_in_pdf"),
        *_absent_from(drawn, chart_font(), (), "warning-not_in_charts"),
    )


def with_boxes(text: str, *, strictly: bool = False) -> str:
    """Return text with a box in the place of each character that the fonts of the PDF lack.

    Strictly: also of those that the fonts inside the typesetter may have.
    """
    if text.isascii():
        return text
    absent = _absent(text, typeface("DejaVuSansMono"), () if strictly else _BLOCKS)
    return text.translate(dict.fromkeys(map(ord, absent), "□"))


def _absent_from(
    texts: Iterable[tuple[str, str]],
    font: FT2Font,
    blocks: tuple[tuple[int, int], ...],
    code: str,
) -> list[Message]:
    found: dict[str, set[str]] = {}
    for name, text in texts:
        if not text.isascii() and (absent := _absent(plain_text(text, 2000), font, blocks)):
            found.setdefault(name, set()).update(absent)
    if not found:
        return []
    names = list(found)
    listed = ", ".join(names[:_MOST_FIELDS]) + (", ..." if len(names) > _MOST_FIELDS else "")
    return [Message(code, {"count": len(set[str]().union(*found.values())), "names": listed})]


def _absent(text: str, font: FT2Font, blocks: tuple[tuple[int, int], ...]) -> set[str]:
    return {
        c
        for c in set(text)
        if not any(first <= ord(c) <= last for first, last in blocks)
        and not font.get_char_index(ord(c))
    }
