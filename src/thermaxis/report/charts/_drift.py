"""Charts of single cycles: the drift that the means hide (figures 6, 7 and 13 of the paper)."""

# matplotlib leaves the types of keyword arguments open
# pyright: reportUnknownMemberType=false

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import ListedColormap, Normalize
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from thermaxis.positioning import APPROACHES, FloatArray
from thermaxis.report._positioning_report import PositioningReport
from thermaxis.report._style import (
    ARROWS,
    legend_below,
    mark_targets,
    new_figure,
    style_of,
    zero_line,
)
from thermaxis.report.charts._parts import (
    add_scale,
    at_position,
    drawn_cycles,
    position_label,
    put_heading,
)

_COLOUR_MAP = ListedColormap(colormaps["cividis"](np.linspace(0.0, 0.86, 40)))
"""Its lightness grows steadily: readable without colour; its palest part is left out. Few enough
steps that the scale beside the chart is drawn and not an image."""


def draw_all_cycles(report: PositioningReport) -> Figure:
    """Draw every cycle over position; the paper's figure 6."""
    return _draw_cycles(report, report.test.deviation, "All cycles", "deviation")


def shifted_to_first_position(report: PositioningReport) -> FloatArray:
    """Return the deviations of every cycle relative to its reading at position 1, (m, n, 2).

    A cycle without that reading is missing throughout. [µm or arcsec]
    """
    return report.test.deviation - report.test.deviation[:1]


def draw_shifted_to_first_position(report: PositioningReport) -> Figure:
    """Draw every cycle shifted to zero in position 1; the paper's figure 13."""
    shifted = shifted_to_first_position(report)
    what = "All cycles shifted to zero in position 1"
    return _draw_cycles(report, shifted, what, "deviation relative to position 1")


def _draw_cycles(
    report: PositioningReport, deviation: FloatArray, what: str, quantity: str
) -> Figure:
    approaches = report.test.approaches
    figure = new_figure(3.2)
    panels: list[Axes] = figure.subplots(
        1, len(approaches), sharex=True, sharey=True, squeeze=False
    )[0].tolist()
    cycles = drawn_cycles(report.test.cycles)
    scale = Normalize(1, max(2, report.test.cycles))
    colours = ScalarMappable(scale, _COLOUR_MAP)
    for axes, approach in zip(panels, approaches, strict=True):
        for cycle in cycles:
            axes.plot(
                report.test.target,
                deviation[:, cycle, approach],
                color=colours.to_rgba(cycle + 1),
                linewidth=0.6,
                marker="." if cycles.size <= 10 else "",
                markersize=2.0,
            )
        _emphasise_first_and_last(axes, report.test.target, deviation[:, cycles, approach], cycles)
        axes.set_title(f"{APPROACHES[approach]} {ARROWS[approach]}")
        axes.set_xlabel(position_label(report))
        mark_targets(axes, report.test.target.tolist())
        zero_line(axes)
    panels[0].set_ylabel(f"{quantity} [{report.test.kind.units.deviation}]")
    if report.test.cycles > 2:
        bar = figure.colorbar(colours, ax=panels, pad=0.02, fraction=0.05, aspect=30)
        bar.set_label("cycle")
        if bar.solids is not None:
            bar.solids.set_edgecolor("face")
        bar.locator = MaxNLocator(integer=True)
        bar.update_ticks()
    part = "" if cycles.size == report.test.cycles else f"{cycles.size} cycles drawn"
    put_heading(figure, report, what, after=part)
    legend_below(figure, panels[0], 2)
    return figure


def _emphasise_first_and_last(
    axes: Axes, target: FloatArray, deviation: FloatArray, cycles: NDArray[np.int64]
) -> None:
    styles = ((0, "--", "o", "white"), (-1, "-", "s", "black"))
    for column, line, marker, face in styles[: cycles.size]:
        axes.plot(
            target,
            deviation[:, column],
            color="black",
            linestyle=line,
            linewidth=0.9,
            marker=marker,
            markerfacecolor=face,
            markersize=3.2,
            markevery=max(1, target.size // 20),
            zorder=4,
            label=f"cycle {int(cycles[column]) + 1}",
        )


def widest_position(report: PositioningReport) -> int:
    """Return the position, from 0, whose readings range most over the cycles of one approach."""
    deviation = report.test.deviation
    present = ~np.isnan(deviation)
    high = np.max(np.where(present, deviation, -np.inf), axis=1)
    low = np.min(np.where(present, deviation, np.inf), axis=1)
    extent = np.where(np.any(present, axis=1), high - low, -1.0)
    return int(np.argmax(np.max(extent, axis=1)))


def draw_one_position(report: PositioningReport) -> Figure:
    """Draw one position over the cycles; the paper's figure 7."""
    test = report.test
    position = widest_position(report)
    approaches = report.test.approaches
    figure = new_figure(2.6)
    panels: list[Axes] = figure.subplots(1, len(approaches), squeeze=False)[0].tolist()
    cycle = np.arange(1, test.cycles + 1)
    for axes, approach in zip(panels, approaches, strict=True):
        axes.plot(
            cycle,
            test.deviation[position, :, approach],
            **style_of(approach),
            markersize=3.2 if test.cycles > 30 else 4.5,
            markeredgewidth=0.7,
            linewidth=0.7,
        )
        axes.set_title(f"{APPROACHES[approach]} {ARROWS[approach]}")
        axes.set_xlabel("cycle")
        axes.xaxis.set_major_locator(MaxNLocator(integer=True))
        _add_time(axes, report, position, approach)
    _same_span(panels)
    panels[0].set_ylabel(f"deviation [{test.kind.units.deviation}]")
    where = at_position(report, float(test.target[position]))
    what = f"Position {position + 1} ({where}) over the cycles"
    put_heading(figure, report, what)
    return figure


def _same_span(panels: list[Axes]) -> None:
    """Give all panels the same extent in y, each about its own data."""
    bounds = [axes.get_ylim() for axes in panels]
    span = max(high - low for low, high in bounds)
    for axes, (low, high) in zip(panels, bounds, strict=True):
        centre = (low + high) / 2.0
        axes.set_ylim(centre - span / 2.0, centre + span / 2.0)


def _add_time(axes: Axes, report: PositioningReport, position: int, approach: int) -> None:
    """Add a second scale with the time of the readings, where it is known and increases.

    A cycle without a time lies between those that have one.
    """
    if report.test.time_s is None:
        return
    time_s = report.test.time_s[position, :, approach]
    known = np.flatnonzero(np.isfinite(time_s)).astype(np.float64) + 1.0
    time_s = time_s[np.isfinite(time_s)]
    if time_s.size < 2 or not bool(np.all(np.diff(time_s) > 0)):
        return
    unit, unit_s = ("h", 3600.0) if float(time_s[-1]) >= 3600.0 else ("min", 60.0)
    add_scale(axes, known, time_s / unit_s, f"time since the first reading [{unit}]")
