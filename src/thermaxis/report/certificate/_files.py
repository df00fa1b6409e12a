"""The certificate as a file, in the format that its name asks for."""

from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import TypeVar

from thermaxis.codes import Place
from thermaxis.errors import ConfigurationError, DataError
from thermaxis.files import format_tidy_csv
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

_Rendered = TypeVar("_Rendered")


def _rendered(
    report: PositioningReport, render: Callable[[Document], _Rendered], progress: Progress | None
) -> _Rendered:
    """Return the certificate of a run, drawn and rendered."""
    tell = progress or silent
    pictures = draw_pictures(report, tell)
    made = render(build_certificate(report, pictures))
    tell("certificate", len(pictures) + 1, len(pictures) + 1)
    return made


def certificate_pdf(
    report: PositioningReport, *, attachments: bool = True, progress: Progress | None = None
) -> bytes:
    """Return the certificate as PDF/A-3b.

    Parameters
    ----------
    report : PositioningReport
        What was evaluated.
    attachments : bool
        Whether readings, results and a Digital Calibration Certificate are attached.
    progress : callable, optional
        Called before each step and at the end.

    Returns
    -------
    bytes
        The file. A run without any date gives a plain PDF: PDF/A asks for one.
    """
    files = _attachments(report) if attachments else ()
    date = report.document_date
    return _rendered(report, lambda made: document_pdf(made, date, files), progress)


def _attachments(report: PositioningReport) -> tuple[Attachment, ...]:
    """Return what a program needs of the certificate: what was read, and what came out."""
    results = results_json(report).decode("ascii")
    dcc = dcc_xml(report, statements=statements(report)).decode("utf-8")
    files = [
        Attachment("results.json", results, "application/json", "All results", "data"),
        Attachment("dcc.xml", dcc, "application/xml", "Digital Calibration Certificate", "data"),
    ]
    with suppress(DataError):  # targets so near each other that no file can tell them apart
        readings = format_tidy_csv(report.test)
        files.append(Attachment("readings.csv", readings, "text/csv", "All readings", "source"))
    return tuple(files)


def certificate_dcc(report: PositioningReport, *, progress: Progress | None = None) -> bytes:
    """Return the Digital Calibration Certificate, which carries the PDF without attachments."""
    pdf = certificate_pdf(report, attachments=False, progress=progress)
    return dcc_xml(report, statements=statements(report), document=pdf)


def certificate_html(report: PositioningReport, *, progress: Progress | None = None) -> str:
    """Return the certificate as one HTML page."""
    return _rendered(report, render_html, progress)


def write_report(
    report: PositioningReport, path: Path, *, progress: Progress | None = None
) -> None:
    """Write the certificate of a run in the format that the file's suffix names.

    Parameters
    ----------
    report : PositioningReport
        What was evaluated.
    path : Path
        A file that ends in ``.pdf``, ``.html``, ``.htm``, or ``.xml``: PTB's Digital Calibration
        Certificate with the PDF inside.
    progress : callable, optional
        Called before each step and at the end.

    Raises
    ------
    ConfigurationError
        If the suffix is another one, or the file cannot be written.
    """
    match path.suffix.lower():
        case ".pdf":
            write_bytes(path, certificate_pdf(report, progress=progress))
        case ".html" | ".htm":
            write_bytes(path, certificate_html(report, progress=progress).encode("utf-8"))
        case ".xml":
            write_bytes(path, certificate_dcc(report, progress=progress))
        case _:
            raise ConfigurationError(
                "report_suffix", place=Place(file=str(path)), suffix=path.suffix
            )
