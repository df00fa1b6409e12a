"""A certificate as PDF."""

import datetime as dt
import json
from dataclasses import asdict
from importlib import resources

import typst

from thermaxis.report._document import Document


def document_pdf(document: Document, date: dt.date | None) -> bytes:
    """Return a document as PDF; the same document with the same date gives the same bytes."""
    template = resources.files("thermaxis.report").joinpath("certificate.typ").read_bytes()
    day = date or dt.date(1970, 1, 1)
    return typst.compile(
        template,
        font_paths=typst.Fonts(include_system_fonts=False),
        sys_inputs={"document": json.dumps(asdict(document), ensure_ascii=False)},
        timestamp=dt.datetime(day.year, day.month, day.day, tzinfo=dt.UTC),
        format="pdf",
    )
