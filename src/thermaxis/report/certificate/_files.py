"""The certificate as a file, in the format that its name asks for."""

from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

from thermaxis.errors import ConfigurationError, DataError
from thermaxis.files import format_tidy_csv
from thermaxis.report._certified_report import CertifiedReport
from thermaxis.report._document import Document
from thermaxis.report._output import write_bytes
from thermaxis.report._positioning_report import PositioningReport
from thermaxis.report._progress import Progress, silent
from thermaxis.report.certificate._certificate import build_certificate, draw_pictures
from thermaxis.report.certificate._header import statements
from thermaxis.report.certificate._html import render_html
from thermaxis.report.certificate._pdf import Attachment, document_pdf
from thermaxis.report.dcc import dcc_xml
from thermaxis.report.tables import results_json


def certificate_document(
    report: PositioningReport, *, progress: Progress | None = None
) -> Document:
    """Return the certificate of a run with its charts, for any format."""
    tell = progress or silent
    pictures = draw_pictures(report, tell)
    made = build_certificate(report, pictures)
    tell("certificate", len(pictures) + 1, len(pictures) + 1)
    return made


def certificate_pdf(
    report: CertifiedReport, document: Document, *, attachments: bool = True
) -> bytes:
    """Return a certificate as PDF/A-3b, or as plain PDF where no date is known.

    Readings, results and a Digital Calibration Certificate are attached unless told otherwise.
    """
    files = _attachments(report) if attachments else ()
    return document_pdf(document, report.document_date, files)


def _attachments(report: CertifiedReport) -> tuple[Attachment, ...]:
    """Return what a program needs of the certificate: what was read, and what came out."""
    results = results_json(report).decode("ascii")
    dcc = dcc_xml(report, statements=statements(report)).decode("utf-8")
    files = [
        Attachment("results.json", results, "application/json", "All results", "data"),
        Attachment("dcc.xml", dcc, "application/xml", "Digital Calibration Certificate", "data"),
    ]
    if not isinstance(report, PositioningReport):
        return tuple(files)
    with suppress(DataError):  # targets so near each other that no file can tell them apart
        readings = format_tidy_csv(report.test)
        files.append(Attachment("readings.csv", readings, "text/csv", "All readings", "source"))
    return tuple(files)


def certificate_dcc(report: CertifiedReport, document: Document) -> bytes:
    """Return the Digital Calibration Certificate, which carries the PDF without attachments."""
    pdf = certificate_pdf(report, document, attachments=False)
    return dcc_xml(report, statements=statements(report), document=pdf)


def write_report(report: PositioningReport, *paths: Path, progress: Progress | None = None) -> None:
    """Write the certificate of a run in the formats that the files' suffixes name.

    Parameters
    ----------
    paths : Path
        Files that end in ``.pdf``, ``.html``, ``.htm``, or ``.xml``: PTB's Digital Calibration
        Certificate with the PDF inside. The charts are drawn once for all.
    progress : callable, optional
        Called before each step and at the end.

    Raises
    ------
    ConfigurationError
        If a suffix is another one, or a file cannot be written.
    """
    write_certificate(report, lambda: certificate_document(report, progress=progress), *paths)


def write_certificate(report: CertifiedReport, make: Callable[[], Document], *paths: Path) -> None:
    """Write any certificate in the formats that the files' suffixes name, as `write_report`."""
    for path in paths:
        if path.suffix.lower() not in _FORMATS:
            raise ConfigurationError("report_suffix", file=path, suffix=path.suffix)
    document = make()
    for path in paths:
        write_bytes(path, _FORMATS[path.suffix.lower()](report, document))


_FORMATS: dict[str, Callable[[CertifiedReport, Document], bytes]] = {
    ".pdf": certificate_pdf,
    ".html": lambda _, document: render_html(document).encode("utf-8"),
    ".htm": lambda _, document: render_html(document).encode("utf-8"),
    ".xml": certificate_dcc,
}
