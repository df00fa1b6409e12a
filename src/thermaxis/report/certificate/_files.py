"""The certificate as a file, in the format that its name asks for."""

from collections.abc import Callable
from pathlib import Path
from typing import TypeVar

from thermaxis.codes import Place
from thermaxis.errors import ConfigurationError
from thermaxis.report._document import Document
from thermaxis.report._output import write_bytes
from thermaxis.report._positioning_report import PositioningReport
from thermaxis.report._progress import Progress, silent
from thermaxis.report.certificate._certificate import build_certificate, draw_pictures
from thermaxis.report.certificate._html import render_html
from thermaxis.report.certificate._pdf import document_pdf

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


def certificate_pdf(report: PositioningReport, *, progress: Progress | None = None) -> bytes:
    """Return the certificate as PDF."""
    return _rendered(report, lambda made: document_pdf(made, report.document_date), progress)


def certificate_html(report: PositioningReport, *, progress: Progress | None = None) -> str:
    """Return the certificate as one HTML page."""
    return _rendered(report, render_html, progress)


def write_certificate_pdf(
    report: PositioningReport, path: Path, *, progress: Progress | None = None
) -> None:
    """Write the certificate of a run as PDF.

    Parameters
    ----------
    report : PositioningReport
        What was evaluated.
    path : Path
        The file; it is replaced if it exists.
    progress : callable, optional
        Called before each step and at the end.

    Raises
    ------
    ConfigurationError
        If the file cannot be written.
    """
    write_bytes(path, certificate_pdf(report, progress=progress))


def write_certificate_html(
    report: PositioningReport, path: Path, *, progress: Progress | None = None
) -> None:
    """Write the certificate of a run as one HTML page that needs no other file.

    Parameters
    ----------
    report : PositioningReport
        What was evaluated.
    path : Path
        The file; it is replaced if it exists.
    progress : callable, optional
        Called before each step and at the end.

    Raises
    ------
    ConfigurationError
        If the file cannot be written.
    """
    write_bytes(path, certificate_html(report, progress=progress).encode("utf-8"))


def write_report(
    report: PositioningReport, path: Path, *, progress: Progress | None = None
) -> None:
    """Write the certificate of a run in the format that the file's suffix names.

    Parameters
    ----------
    report : PositioningReport
        What was evaluated.
    path : Path
        A file that ends in ``.pdf``, ``.html`` or ``.htm``.
    progress : callable, optional
        Called before each step and at the end.

    Raises
    ------
    ConfigurationError
        If the suffix is another one, or the file cannot be written.
    """
    match path.suffix.lower():
        case ".pdf":
            write_certificate_pdf(report, path, progress=progress)
        case ".html" | ".htm":
            write_certificate_html(report, path, progress=progress)
        case _:
            raise ConfigurationError(
                "report_suffix", place=Place(file=str(path)), suffix=path.suffix
            )
