"""The certificate as a file, in the format that its name asks for."""

from pathlib import Path

from thermaxis.codes import Place
from thermaxis.errors import ConfigurationError
from thermaxis.report._output import write_bytes
from thermaxis.report._positioning_report import PositioningReport
from thermaxis.report._progress import Progress
from thermaxis.report.certificate._html import certificate_html
from thermaxis.report.certificate._pdf import certificate_pdf


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
