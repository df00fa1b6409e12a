"""All charts of a run: PNG, SVG and the numbers behind them."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from types import MappingProxyType
from typing import final

from matplotlib.figure import Figure

from thermaxis import __version__
from thermaxis.errors import require_known
from thermaxis.positioning import (
    DifferenceMonteCarlo,
    PositioningTest,
    evaluate_adjacent_difference,
    evaluate_against_cycles,
    evaluate_drift,
    evaluate_iso230_2,
)
from thermaxis.report._output import NumberTable, make_folder
from thermaxis.report._positioning_report import PositioningReport
from thermaxis.report._progress import Progress
from thermaxis.report._style import drawing, svg_bytes, write_chart
from thermaxis.report.charts import _numbers as numbers
from thermaxis.report.charts._adjacent import (
    draw_deviation_chart,
    draw_mean_mutual_deviation,
    draw_standard_deviation,
)
from thermaxis.report.charts._against_cycles import draw_against_cycles
from thermaxis.report.charts._drift import (
    draw_all_cycles,
    draw_one_position,
    draw_shifted_to_first_position,
    shifted_to_first_position,
    widest_position,
)
from thermaxis.report.charts._drift_model import draw_drift, drift_curve_numbers, drift_numbers
from thermaxis.report.charts._iso230_2 import draw_iso230_2
from thermaxis.report.charts._montecarlo import draw_montecarlo


@final
@dataclass(frozen=True, slots=True)
class Chart:
    """One chart of a run."""

    name: str
    """Name of its files, without suffix."""
    draw: Callable[..., Figure]
    numbers: Callable[[PositioningReport], NumberTable]
    more_numbers: Mapping[str, Callable[[PositioningReport], NumberTable]] = field(
        default_factory=lambda: MappingProxyType({})
    )
    """Further tables of numbers, by the ending of their name."""

    def svg(self, report: PositioningReport, **size: float) -> bytes:
        """Return the chart as SVG."""
        with drawing(self.name):
            return svg_bytes(self.draw(report, **size))


_ISO230_2 = Chart("iso230_2", draw_iso230_2, numbers.iso230_2_numbers)
_ALL_CYCLES = Chart(
    "figure_06_all_cycles",
    draw_all_cycles,
    lambda r: numbers.reading_numbers(r, r.test.deviation, "deviation"),
)
_ONE_POSITION = Chart(
    "figure_07_one_position",
    draw_one_position,
    lambda r: numbers.one_position_numbers(r, widest_position(r)),
)
_ADJACENT = (
    Chart(
        "figure_10_standard_deviation",
        draw_standard_deviation,
        partial(
            numbers.pair_numbers, keys=("standard_uncertainty", "standard_deviation", "s_ratio")
        ),
    ),
    Chart(
        "figure_11_mean_mutual_deviation",
        draw_mean_mutual_deviation,
        partial(numbers.pair_numbers, keys=("mean_difference", "standard_uncertainty")),
    ),
    Chart("figure_12_deviation_chart", draw_deviation_chart, numbers.deviation_chart_numbers),
)
_SHIFTED = Chart(
    "figure_13_shifted_to_first_position",
    draw_shifted_to_first_position,
    lambda r: numbers.reading_numbers(r, shifted_to_first_position(r), "shifted_deviation"),
)
_AGAINST_CYCLES = Chart("against_cycles", draw_against_cycles, numbers.against_cycles_numbers)
_DRIFT = Chart(
    "drift", draw_drift, drift_numbers, MappingProxyType({"curves": drift_curve_numbers})
)


def charts_of(report: PositioningReport) -> tuple[Chart, ...]:
    """Return the charts that a run has, in the order in which a report shows them."""
    charts = [_ISO230_2, _ALL_CYCLES]
    if report.test.cycles > 1:
        charts.append(_ONE_POSITION)
    if report.drift is not None:
        charts.append(_DRIFT)
    if report.adjacent_difference is not None:
        charts += _ADJACENT if report.test.cycles > 1 else _ADJACENT[1:]
        charts += [_SHIFTED] if report.test.cycles > 1 else []
    if report.against_cycles is not None:
        charts.append(_AGAINST_CYCLES)
    return tuple(charts)


def write_figures(
    report: PositioningReport, folder: Path, *, progress: Progress | None = None
) -> tuple[Path, ...]:
    """Write every chart of a run as PNG and SVG, and the numbers behind it as CSV.

    Parameters
    ----------
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
    make_folder(folder)
    written: list[Path] = []
    charts = charts_of(report)
    for done, chart in enumerate(charts):
        if progress is not None:
            progress(f"figure {chart.name}", done, len(charts))
        more = {f"_{ending}": table(report) for ending, table in chart.more_numbers.items()}
        draw = partial(chart.draw, report)
        written += write_chart(folder, chart.name, draw, {"": chart.numbers(report), **more})
    if progress is not None:
        progress("figures", len(charts), len(charts))
    return tuple(written)


def draw_figure(test: PositioningTest, name: str) -> Figure:
    """Evaluate a run by default and draw one of its charts.

    Parameters
    ----------
    name : str
        As of the files that `write_figures` writes, such as ``figure_12_deviation_chart``, or
        ``drift``.

    Returns
    -------
    Figure
        The chart, as in the certificate.

    Raises
    ------
    ConfigurationError
        If the run has no such chart; it names those that it has.
    DataError
        If the run does not allow what the chart shows.
    """
    several, apart = test.cycles > 1, test.target.size > 1
    report = PositioningReport(
        test=test,
        iso230_2=evaluate_iso230_2(test),
        adjacent_difference=evaluate_adjacent_difference(test) if apart else None,
        against_cycles=evaluate_against_cycles(test) if several else None,
        drift=evaluate_drift(test) if name == _DRIFT.name else None,
        other_standard=None,
        limits=None,
        warnings=(),
        header=test.header,
        source_name="",
        source_sha256="",
        version=__version__,
    )
    charts = {chart.name: chart for chart in charts_of(report)}
    require_known("name", [name], (*charts, _DRIFT.name), "unknown_choice")
    with drawing(name):
        return charts[name].draw(report)


def write_montecarlo_figures(result: DifferenceMonteCarlo, folder: Path) -> tuple[Path, ...]:
    """Write the distributions of the Monte Carlo as PNG and SVG, and their counts as CSV.

    Folder, result and errors are those of `write_figures`.

    References
    ----------
    Stejskal et al. 2017, figure 1.
    """
    make_folder(folder)
    table = numbers.montecarlo_numbers(result)
    draw = partial(draw_montecarlo, result)
    return tuple(write_chart(folder, "figure_01_montecarlo", draw, {"": table}))
