"""A certificate as PDF."""

import datetime as dt
import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from importlib import resources
from typing import Literal, final

import typst

from thermaxis.report._document import Document
from thermaxis.report.certificate._showable import with_boxes


@final
@dataclass(frozen=True, slots=True)
class Attachment:
    """A file inside a PDF."""

    name: str
    text: str
    mime_type: str
    description: str
    relationship: Literal["source", "data", "alternative", "supplement"]
    """What it is to the page that people read, in the words of PDF/A-3."""


def document_pdf(
    document: Document, date: dt.date | None, attachments: Sequence[Attachment] = ()
) -> bytes:
    """Return a document as PDF; the same document with the same date gives the same bytes.

    It is PDF/A-3b where it has a date: an archive asks for the date of what is attached.
    """
    template = resources.files("thermaxis.report").joinpath("certificate.typ").read_bytes()
    text = json.dumps(asdict(document), ensure_ascii=False)
    files = json.dumps([asdict(one) for one in attachments], ensure_ascii=False)
    day = date or dt.date(1970, 1, 1)

    def compiled(shown: str) -> bytes:
        return typst.compile(
            template,
            font_paths=typst.Fonts(include_system_fonts=False),
            sys_inputs={"document": shown, "attachments": files},
            timestamp=dt.datetime(day.year, day.month, day.day, tzinfo=dt.UTC),
            format="pdf",
            pdf_standards=[] if date is None else ["a-3b"],
        )

    try:
        return compiled(with_boxes(text))
    except (
        typst.TypstError
    ):  # an archive takes no character without a sign: be strict with rare ones
        return compiled(with_boxes(text, strictly=True))
