"""Thermal reports and figures as files."""

import datetime as dt
from collections.abc import Sequence
from pathlib import Path

from thermaxis.compensation import CompensationModel, Provenance
from thermaxis.errors import ConfigurationError
from thermaxis.report._document import Document
from thermaxis.report._output import make_folder, write_bytes
from thermaxis.report._style import write_chart
from thermaxis.report.certificate import document_pdf, render_html
from thermaxis.report.thermal._compared import comparison_charts, comparison_document
from thermaxis.report.thermal._compared_model import ComparedModel
from thermaxis.report.thermal._comparison import verification_charts
from thermaxis.report.thermal._identification import identification_document
from thermaxis.report.thermal._identification_charts import identification_charts
from thermaxis.report.thermal._panels import ThermalChart
from thermaxis.report.thermal._verification import verification_document
from thermaxis.thermal import Identification, Records, ThermalLog, Verification


def _check_suffixes(paths: Sequence[Path]) -> None:
    for path in paths:
        suffix = path.suffix.lower()
        if suffix not in {".pdf", ".html", ".htm"}:
            raise ConfigurationError("report_suffix", file=path, suffix=path.suffix)


def _check_same(logs: Sequence[ThermalLog], result: Verification) -> None:
    if len(logs) != len(result.logs) or any(
        log.rows != found.time_s.size for log, found in zip(logs, result.logs, strict=True)
    ):
        raise ConfigurationError("other_logs_than_verified", key="logs")


def write_verification_report(
    model: CompensationModel, logs: Sequence[ThermalLog], result: Verification, *paths: Path
) -> None:
    """Write the report of a verification as PDF or HTML, as the suffix of each file says.

    The logs are those of the result, in its order; charts are drawn once for all files. A file
    that exists is replaced.

    Raises
    ------
    ConfigurationError
        If the suffix is none of ``.pdf``, ``.html`` and ``.htm``, the logs are not those of the
        result, or the file cannot be written.

    References
    ----------
    Mareš and Horejš 2021, figures 4 and 7 to 13, Table 3.
    """
    _check_suffixes(paths)
    _check_same(logs, result)
    _write(verification_document(model, logs, result), paths)


def write_identification_report(
    result: Identification,
    records: Records,
    logs: Sequence[ThermalLog],
    provenance: Provenance,
    *paths: Path,
    reference_s: float | None,
) -> None:
    """Write the report of an identification as PDF or HTML, as the suffix of each file says.

    The logs are those that the records were made of; inputs and outputs are relative to their mean
    over the first time, `reference_s`. A file that exists is replaced.

    Raises
    ------
    ConfigurationError
        If the suffix is none of ``.pdf``, ``.html`` and ``.htm``, or the file cannot be written.

    References
    ----------
    Mareš and Horejš 2021, figures 3 and 4, Tables 1 and 2.
    """
    _check_suffixes(paths)
    document = identification_document(result, records, logs, provenance, reference_s=reference_s)
    _write(document, paths)


def _write(document: Document, paths: Sequence[Path]) -> None:
    date = None if document.date is None else dt.date.fromisoformat(document.date)
    for path in paths:
        if path.suffix.lower() == ".pdf":
            write_bytes(path, document_pdf(document, date))
        else:
            write_bytes(path, render_html(document).encode("utf-8"))


def write_verification_figures(
    model: CompensationModel, logs: Sequence[ThermalLog], result: Verification, folder: Path
) -> tuple[Path, ...]:
    """Write every chart of a verification as PNG and SVG, and what is drawn as CSV.

    The logs are those of the result, in its order; the folder is made if it does not exist, and the
    same result gives the same bytes. The numbers of figures 4 and 7 to 13 of Mareš and Horejš 2021
    are in the names of the files.

    Raises
    ------
    ConfigurationError
        If the logs are not those of the result, or the folder or a file cannot be written.
    """
    _check_same(logs, result)
    return write_charts(verification_charts(model, tuple(logs), result), folder)


def write_identification_figures(
    result: Identification,
    records: Records,
    logs: Sequence[ThermalLog],
    folder: Path,
    *,
    reference_s: float | None,
) -> tuple[Path, ...]:
    """Write every chart of an identification as PNG and SVG, and what is drawn as CSV.

    Inputs and outputs are relative to their mean over the first time, `reference_s`. The folder is
    made if it does not exist, and the same result gives the same bytes. The numbers of figures 3
    and 4 of Mareš and Horejš 2021 are in the names of the files.

    Raises
    ------
    ConfigurationError
        If the folder or a file cannot be written.
    """
    charts = identification_charts(result, records, logs, reference_s=reference_s)
    return write_charts(charts, folder)


def write_comparison_report(models: Sequence[ComparedModel], *paths: Path) -> None:
    """Write the report of models on one log, as `write_identification_report` does."""
    _check_suffixes(paths)
    _write(comparison_document(models), paths)


def write_comparison_figures(models: Sequence[ComparedModel], folder: Path) -> tuple[Path, ...]:
    """Write a chart of all models per output, as `write_identification_figures` writes its own."""
    return write_charts(comparison_charts(models), folder)


def write_charts(charts: Sequence[ThermalChart], folder: Path) -> tuple[Path, ...]:
    """Write charts as PNG and SVG, and what they draw as CSV."""
    make_folder(folder)
    return tuple(
        path
        for chart in charts
        for path in write_chart(folder, chart.name, chart.draw, {"": chart.numbers})
    )
