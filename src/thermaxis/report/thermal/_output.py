"""Thermal reports and figures as files."""

import datetime as dt
from collections.abc import Sequence
from pathlib import Path

from thermaxis.codes import Place
from thermaxis.compensation import CompensationModel, Provenance
from thermaxis.errors import ConfigurationError
from thermaxis.report._document import Document
from thermaxis.report._output import make_folder, write_bytes
from thermaxis.report._style import write_chart
from thermaxis.report.certificate import document_pdf, render_html
from thermaxis.report.thermal._comparison import verification_charts
from thermaxis.report.thermal._identification import identification_document
from thermaxis.report.thermal._identification_charts import identification_charts
from thermaxis.report.thermal._panels import ThermalChart
from thermaxis.report.thermal._verification import verification_document
from thermaxis.thermal import Identification, Records, ThermalLog, Verification


def _check_suffix(path: Path) -> bool:
    """Return whether the file is to be a PDF."""
    suffix = path.suffix.lower()
    if suffix not in {".pdf", ".html", ".htm"}:
        raise ConfigurationError("report_suffix", place=Place(file=str(path)), suffix=path.suffix)
    return suffix == ".pdf"


def _check_same(logs: Sequence[ThermalLog], result: Verification) -> None:
    if len(logs) != len(result.logs) or any(
        log.rows != found.time_s.size for log, found in zip(logs, result.logs, strict=True)
    ):
        raise ConfigurationError("other_logs_than_verified", place=Place(key="logs"))


def write_verification_report(
    model: CompensationModel, logs: Sequence[ThermalLog], result: Verification, path: Path
) -> None:
    """Write the report of a verification in the format that the file's suffix names.

    Parameters
    ----------
    model : CompensationModel
        The model.
    logs : sequence of ThermalLog
        The logs, in the order of the result.
    result : Verification
        What `verify` found.
    path : Path
        A file that ends in ``.pdf``, ``.html`` or ``.htm``; it is replaced if it exists.

    Raises
    ------
    ConfigurationError
        If the suffix is another one, the logs are not those of the result, or the file cannot be
        written.

    References
    ----------
    Mareš and Horejš 2021, figures 4 and 7 to 13, Table 3.
    """
    as_pdf = _check_suffix(path)
    _check_same(logs, result)
    _write(verification_document(model, logs, result), path, as_pdf=as_pdf)


def write_identification_report(
    result: Identification,
    records: Records,
    logs: Sequence[ThermalLog],
    provenance: Provenance,
    path: Path,
    *,
    reference_s: float,
) -> None:
    """Write the report of an identification in the format that the file's suffix names.

    Parameters
    ----------
    result : Identification
        What `identify` found.
    records : Records
        The records that it was given.
    logs : sequence of ThermalLog
        The logs that the records were made of.
    provenance : Provenance
        Where everything comes from.
    path : Path
        A file that ends in ``.pdf``, ``.html`` or ``.htm``; it is replaced if it exists.
    reference_s : float
        Inputs and outputs are relative to their mean over this first time. [s]

    Raises
    ------
    ConfigurationError
        If the suffix is another one, or the file cannot be written.

    References
    ----------
    Mareš and Horejš 2021, figures 3 and 4, Tables 1 and 2.
    """
    as_pdf = _check_suffix(path)
    document = identification_document(result, records, logs, provenance, reference_s=reference_s)
    _write(document, path, as_pdf=as_pdf)


def _write(document: Document, path: Path, *, as_pdf: bool) -> None:
    if as_pdf:
        date = None if document.date is None else dt.date.fromisoformat(document.date)
        write_bytes(path, document_pdf(document, date))
    else:
        write_bytes(path, render_html(document).encode("utf-8"))


def write_verification_figures(
    model: CompensationModel, logs: Sequence[ThermalLog], result: Verification, folder: Path
) -> tuple[Path, ...]:
    """Write every chart of a verification as PNG and SVG, and what is drawn as CSV.

    Parameters
    ----------
    model : CompensationModel
        The model.
    logs : sequence of ThermalLog
        The logs, in the order of the result.
    result : Verification
        What `verify` found.
    folder : Path
        Where the files go; it is made if it does not exist.

    Returns
    -------
    tuple of Path
        The files. The same result gives the same bytes.

    Raises
    ------
    ConfigurationError
        If the logs are not those of the result, or the folder or a file cannot be written.

    References
    ----------
    Mareš and Horejš 2021, figures 4 and 7 to 13 (their numbers are in the names of the files).
    """
    _check_same(logs, result)
    return write_charts(verification_charts(model, tuple(logs), result), folder)


def write_identification_figures(
    result: Identification,
    records: Records,
    logs: Sequence[ThermalLog],
    folder: Path,
    *,
    reference_s: float,
) -> tuple[Path, ...]:
    """Write every chart of an identification as PNG and SVG, and what is drawn as CSV.

    Parameters
    ----------
    result : Identification
        What `identify` found.
    records : Records
        The records that it was given.
    logs : sequence of ThermalLog
        The logs that the records were made of.
    folder : Path
        Where the files go; it is made if it does not exist.
    reference_s : float
        Inputs and outputs are relative to their mean over this first time. [s]

    Returns
    -------
    tuple of Path
        The files. The same result gives the same bytes.

    Raises
    ------
    ConfigurationError
        If the folder or a file cannot be written.

    References
    ----------
    Mareš and Horejš 2021, figures 3 and 4 (their numbers are in the names of the files).
    """
    charts = identification_charts(result, records, logs, reference_s=reference_s)
    return write_charts(charts, folder)


def write_charts(charts: Sequence[ThermalChart], folder: Path) -> tuple[Path, ...]:
    """Write charts as PNG and SVG, and what they draw as CSV."""
    make_folder(folder)
    return tuple(
        path
        for chart in charts
        for path in write_chart(folder, chart.name, chart.draw, {"": chart.numbers})
    )
