"""Chart of the figures against the number of cycles."""

# matplotlib leaves the types of keyword arguments open
# pyright: reportUnknownMemberType=false

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from thermaxis.positioning import APPROACHES
from thermaxis.report._names import FIGURE_SYMBOLS
from thermaxis.report._positioning_report import PositioningReport
from thermaxis.report._style import ARROWS, new_figure, style_of
from thermaxis.report.charts._parts import put_heading

_CURVES = (
    ("A", "-", "s", "black"),
    ("R", "--", "o", "white"),
    ("E", "-.", "D", "black"),
    ("M", ":", "x", "black"),
    ("B", (0, (5, 1, 1, 1, 1, 1)), "+", "black"),
)


def draw_against_cycles(report: PositioningReport) -> Figure:
    """Draw the figures evaluated from the first k cycles, for k = 2 ... n."""
    against = report.against_cycles
    assert against is not None  # noqa: S101 - the chart is drawn only then
    unit = report.test.kind.units.deviation
    figure = new_figure(3.7)
    upper, lower = figure.subplots(2, 1, sharex=True)
    every = max(1, against.cycles.size // 12)
    approaches = report.test.approaches
    index = f"_{APPROACHES[approaches[0]]}" if len(approaches) == 1 else ""
    for symbol, line, marker, face in _CURVES:
        key = symbol + index if symbol + index in against.figures else symbol
        if not bool(np.any(np.isfinite(against.figures[key]))):
            continue
        upper.plot(
            against.cycles,
            against.figures[key],
            color="black",
            linestyle=line,
            linewidth=0.9,
            marker=marker,
            markerfacecolor=face,
            markersize=3.5,
            markevery=every,
            label=FIGURE_SYMBOLS[key],
        )
    for values, name, line in (
        (against.s_rms, "standard's s", "-"),
        (against.difference_rms, "adjacent difference", "--"),
    ):
        for approach in approaches:
            lower.plot(
                against.cycles,
                values[:, approach],
                **style_of(approach),
                linestyle=line,
                markersize=4.0,
                markevery=every,
                label=f"{name} {ARROWS[approach]}",
            )
    upper.set_title("figures of ISO 230-2 from the first cycles only")
    lower.set_title("standard deviation, root mean square over the axis")
    for axes in (upper, lower):
        axes.set_ylim(bottom=0.0)
        axes.set_ylabel(f"[{unit}]")
        axes.legend(loc="center left", bbox_to_anchor=(1.01, 0.5))
    lower.set_xlabel("number of cycles used")
    lower.xaxis.set_major_locator(MaxNLocator(integer=True))
    put_heading(figure, report, "Figures against the number of cycles")
    return figure
