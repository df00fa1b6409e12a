"""The certificate as PDF."""

import datetime as dt
import json
from dataclasses import asdict
from importlib import resources

import typst

from thermaxis.report._document import Document
from thermaxis.report._positioning_report import PositioningReport
from thermaxis.report._progress import Progress, silent
from thermaxis.report.certificate._certificate import build_certificate, draw_pictures


def certificate_pdf(report: PositioningReport, *, progress: Progress | None = None) -> bytes:
    """Return the certificate as PDF."""
    tell = progress or silent
    pictures = draw_pictures(report, tell)
    pdf = document_pdf(build_certificate(report, pictures), report.document_date)
    tell("certificate", len(pictures) + 1, len(pictures) + 1)
    return pdf


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
