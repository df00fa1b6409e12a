"""The certificate as PDF."""

import datetime as dt
import json
from dataclasses import asdict
from importlib import resources

import typst

from thermaxis.report._positioning_report import PositioningReport
from thermaxis.report._progress import Progress, silent
from thermaxis.report.certificate._certificate import build_certificate, draw_pictures


def certificate_pdf(report: PositioningReport, *, progress: Progress | None = None) -> bytes:
    """Return the certificate as PDF."""
    tell = progress or silent
    pictures = draw_pictures(report, tell)
    document = build_certificate(report, pictures)
    template = resources.files("thermaxis.report").joinpath("certificate.typ").read_bytes()
    date = report.document_date or dt.date(1970, 1, 1)
    pdf = typst.compile(
        template,
        font_paths=typst.Fonts(include_system_fonts=False),
        sys_inputs={"document": json.dumps(asdict(document), ensure_ascii=False)},
        timestamp=dt.datetime(date.year, date.month, date.day, tzinfo=dt.UTC),
        format="pdf",
    )
    tell("certificate", len(pictures) + 1, len(pictures) + 1)
    return pdf
