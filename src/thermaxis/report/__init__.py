"""Show results: charts as PNG and SVG, certificates as PDF and HTML."""

from collections.abc import Mapping
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING

from thermaxis.errors import ConfigurationError
from thermaxis.report._names import (
    FIGURE_NAMES,
    FIGURE_SYMBOLS,
    OTHER_NAMES,
    absence_reason,
    edition_name,
    other_standard_name,
)
from thermaxis.report._positioning_report import PositioningReport
from thermaxis.report._progress import Progress
from thermaxis.report._text import fixed

if TYPE_CHECKING:
    from thermaxis.positioning import DifferenceMonteCarlo, Iso230_2Result, UncertaintyBudget
    from thermaxis.quantities import AxisKind
    from thermaxis.report._chart_trend import write_trend_figures
    from thermaxis.report._field_figures import write_field_figures
    from thermaxis.report._field_regions import read_regions
    from thermaxis.report._limits import Limits, LimitsCheck
    from thermaxis.report._output import write_bytes
    from thermaxis.report._thermal_output import (
        write_identification_figures,
        write_identification_report,
        write_verification_figures,
        write_verification_report,
    )
    from thermaxis.report._trend import (
        Trend,
        TrendChange,
        TrendFigure,
        TrendRun,
        evaluate_trend,
        trend_table,
    )

__all__ = [
    "FIGURE_NAMES",
    "FIGURE_SYMBOLS",
    "OTHER_NAMES",
    "PositioningReport",
    "Progress",
    "Trend",
    "TrendChange",
    "TrendFigure",
    "TrendRun",
    "absence_reason",
    "check_limits",
    "edition_name",
    "evaluate_trend",
    "fixed",
    "other_standard_name",
    "read_budget",
    "read_header",
    "read_limits",
    "read_regions",
    "trend_table",
    "unshowable",
    "write_bytes",
    "write_certificate_html",
    "write_certificate_pdf",
    "write_field_figures",
    "write_figures",
    "write_identification_figures",
    "write_identification_report",
    "write_montecarlo_figures",
    "write_report",
    "write_trend_figures",
    "write_verification_figures",
    "write_verification_report",
]

# Every function imports its module when it is called: matplotlib and typst take longer to import
# than a run takes to evaluate, and most calls of the program write no report.


def unshowable(report: PositioningReport) -> tuple[str, ...]:
    """Return which texts of a run have characters that its certificate cannot show.

    Parameters
    ----------
    report : PositioningReport
        What was evaluated.

    Returns
    -------
    tuple of str
        Sentences that name the fields; empty if every character has a sign in the fonts of the
        PDF and of the charts, as those of Latin, Greek and Cyrillic scripts have. Other scripts
        show in the text of the HTML page, with the fonts of the reader's machine.
    """
    from thermaxis.report import _showable  # noqa: PLC0415  see above

    return _showable.unshowable(report)


def read_header(path: Path, *, kind: "AxisKind | None" = None) -> Mapping[str, str]:
    """Read a file with fields of the certificate's head.

    Parameters
    ----------
    path : Path
        TOML with a table for each group, such as ``[machine]`` with ``name = "..."``.
    kind : AxisKind, optional
        Kind of the axis; a field that only the other kind has is an error. Default: both kinds.

    Returns
    -------
    Mapping
        Text by the key of the field; numbers are in the unit that the key names. An empty text
        counts as not stated and is left out.

    Raises
    ------
    ConfigurationError
        If the file cannot be read, a table or key is unknown or of the other kind of axis, a value
        is of a wrong kind, negative where it is a size, no date where it is one, or too long, or
        the end lies before the start.
    """
    from thermaxis.report import _header  # noqa: PLC0415  see above

    return _header.read_header(path, kind=kind)


def read_limits(path: Path, kind: "AxisKind") -> "Limits":
    """Read a file of limits.

    Parameters
    ----------
    path : Path
        TOML with a table ``[limits]`` (keys of the figures with the unit as suffix, such as
        ``A_um``, and ``decision_rule``) and, where uncertainties are known, a table
        ``[expanded_uncertainty]`` with the same keys.
    kind : AxisKind
        Kind of the axis, which fixes the unit.

    Returns
    -------
    Limits
        The limits. The default rule is simple acceptance.

    Raises
    ------
    ConfigurationError
        If the file cannot be read, a key is unknown, a value is not a positive number, no figure
        is limited, or the rule needs an uncertainty that is not there.
    """
    from thermaxis.report import _limits  # noqa: PLC0415  see above

    return _limits.read_limits(path, kind)


def read_budget(path: Path, kind: "AxisKind") -> "UncertaintyBudget":
    """Read a file with the terms of instrument and environment.

    Parameters
    ----------
    path : Path
        TOML with a table for each term.
    kind : AxisKind
        Kind of the axis, which fixes the unit.

    Returns
    -------
    UncertaintyBudget
        The terms that the file states.

    Raises
    ------
    ConfigurationError
        If the file cannot be read, a table or key is unknown, or a value is not possible.
    """
    from thermaxis.report import _budget  # noqa: PLC0415  see above

    return _budget.read_budget(path, kind)


def check_limits(limits: "Limits", iso230_2: "Iso230_2Result") -> "LimitsCheck":
    """Compare the figures of a run with their limits.

    Parameters
    ----------
    limits : Limits
        The limits and the decision rule.
    iso230_2 : Iso230_2Result
        The figures. The mean reversal value is compared by its magnitude.

    Returns
    -------
    LimitsCheck
        A verdict per figure and one for the run. An absent figure is not decided.

    References
    ----------
    ISO 14253-1 (decision rules), its principle from general knowledge.
    """
    from thermaxis.report import _limits  # noqa: PLC0415  see above

    return _limits.check_limits(limits, iso230_2)


def write_figures(
    report: PositioningReport, folder: Path, *, progress: Progress | None = None
) -> tuple[Path, ...]:
    """Write every chart of a run as PNG and SVG, and the numbers behind it as CSV.

    Parameters
    ----------
    report : PositioningReport
        What was evaluated.
    folder : Path
        Where the files go; it is made if it does not exist.
    progress : callable, optional
        Called before each chart and at the end.

    Returns
    -------
    tuple of Path
        The files. The same report gives the same bytes.

    Raises
    ------
    ConfigurationError
        If the folder or a file cannot be written.

    References
    ----------
    Stejskal et al. 2017, figures 6, 7, 10 to 13 (their numbers are in the names of the files).
    """
    from thermaxis.report import _figures  # noqa: PLC0415  see above

    return _figures.write_figures(report, folder, progress=progress)


def write_montecarlo_figures(result: "DifferenceMonteCarlo", folder: Path) -> tuple[Path, ...]:
    """Write the distributions of the Monte Carlo as PNG and SVG, and their counts as CSV.

    Parameters
    ----------
    result : DifferenceMonteCarlo
        Outcome of the experiments.
    folder : Path
        Where the files go; it is made if it does not exist.

    Returns
    -------
    tuple of Path
        The files.

    Raises
    ------
    ConfigurationError
        If the folder or a file cannot be written.

    References
    ----------
    Stejskal et al. 2017, figure 1.
    """
    from thermaxis.report import _figures  # noqa: PLC0415  see above

    return _figures.write_montecarlo_figures(result, folder)


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
    from thermaxis.report import _certificate_pdf, _output  # noqa: PLC0415  see above

    _output.write_bytes(path, _certificate_pdf.certificate_pdf(report, progress=progress))


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
    from thermaxis.report import _certificate_html, _output  # noqa: PLC0415  see above

    page = _certificate_html.certificate_html(report, progress=progress)
    _output.write_bytes(path, page.encode("utf-8"))


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
                f"a certificate cannot be written as '{path.suffix}'",
                where=str(path),
                remedy="End the name in .pdf or .html",
            )


_MODULES = {
    "Trend": "_trend",
    "TrendChange": "_trend",
    "TrendFigure": "_trend",
    "TrendRun": "_trend",
    "evaluate_trend": "_trend",
    "read_regions": "_field_regions",
    "trend_table": "_trend",
    "write_bytes": "_output",
    "write_field_figures": "_field_figures",
    "write_identification_figures": "_thermal_output",
    "write_identification_report": "_thermal_output",
    "write_trend_figures": "_chart_trend",
    "write_verification_figures": "_thermal_output",
    "write_verification_report": "_thermal_output",
}


def __getattr__(name: str) -> object:
    """Import what only some commands need when it is first asked for."""
    if name not in _MODULES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_MODULES[name]}"), name)
