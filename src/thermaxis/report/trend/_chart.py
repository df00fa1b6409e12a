"""Chart of one axis over the years."""

# matplotlib leaves the types of keyword arguments open
# pyright: reportUnknownMemberType=false

import math
from collections.abc import Mapping, Sequence
from datetime import datetime, timedelta
from functools import partial
from pathlib import Path

from matplotlib.axes import Axes
from matplotlib.dates import AutoDateLocator, ConciseDateFormatter
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from thermaxis.report._names import FIGURE_SYMBOLS
from thermaxis.report._output import make_folder
from thermaxis.report._style import (
    COLOURS,
    drawable,
    legend_below,
    new_figure,
    set_heading,
    write_chart,
)
from thermaxis.report.trend._trend import Trend, TrendFigure, trend_table

_SERIES = (
    ("as measured", COLOURS[0], "o", COLOURS[0], "-"),
    ("without drift", COLOURS[1], "s", "white", "--"),
)
_APART = 0.006
"""Shift of each series as a share of the width, so that error bars do not cover each other. [1]"""


def write_trend_figures(trend: Trend, folder: Path) -> tuple[Path, ...]:
    """Write the chart of a trend and its numbers, as `write_figures` writes those of a run."""
    make_folder(folder)
    numbers = {"": trend_table(trend)}
    return tuple(write_chart(folder, "trend", partial(draw_trend, trend), numbers))


def draw_trend(trend: Trend) -> Figure:
    """Draw the figures of every run over the date, or over the number of the run."""
    keys = trend.figures
    down = -(-len(keys) // 2)
    figure = new_figure(1.1 + 1.75 * down)
    grid: list[list[Axes]] = figure.subplots(down, 2, squeeze=False, sharex=True).tolist()
    panels = [axes for line in grid for axes in line]
    unit = trend.runs[0].test.kind.units.deviation
    place = _places(trend)
    width = max(place) - min(place) or 1.0
    for axes, key in zip(panels, keys, strict=False):
        for side, (style, figures) in enumerate(
            zip(
                _SERIES,
                ([r.measured for r in trend.runs], [r.drift_free for r in trend.runs]),
                strict=True,
            )
        ):
            shift = (2 * side - 1) * _APART * width
            _draw_series(axes, [x + shift for x in place], figures, key, style)
        axes.set_title(FIGURE_SYMBOLS[key])
        axes.set_ylabel(f"[{unit}]")
        low, high = axes.get_ylim()
        low = min(low, 0.0)
        axes.set_ylim(low, high + 0.06 * (high - low))
    for axes in panels[len(keys) :]:
        axes.set_visible(False)
    _label_places(trend, panels[: len(keys)])
    legend_below(figure, panels[0], 2)
    axis = next((r.test.header["axis"] for r in trend.runs if r.test.header.get("axis")), "")
    named = f"axis {drawable(axis, 20)} · " if axis else ""
    notes: list[str] = []
    if any(f.expanded_uncertainty is not None for r in trend.runs for f in r.measured.values()):
        notes.append("bars: expanded uncertainty U (95.45 %) from noise and drift")
    if any(run.drift_free for run in trend.runs):
        notes.append("what is without drift is no result of ISO 230-2")
    what = f"Figures of ISO 230-2 over time · {named}{len(trend.runs)} runs"
    set_heading(figure, what, " · ".join(notes))
    return figure


def _day(date: datetime) -> float:
    """Return a date as the charts' scale counts it: days since the start of 1970."""
    return (date - datetime(1970, 1, 1)) / timedelta(days=1)  # noqa: DTZ001 - naive or all in UTC


def _places(trend: Trend) -> list[float]:
    if trend.dates is None:
        return [float(k + 1) for k in range(len(trend.runs))]
    return [_day(date) for date in trend.dates]


def _draw_series(
    axes: Axes,
    place: Sequence[float],
    figures: Sequence[Mapping[str, TrendFigure]],
    key: str,
    style: tuple[str, str, str, str, str],
) -> None:
    label, colour, marker, face, line = style
    known = [(x, run[key]) for x, run in zip(place, figures, strict=True) if key in run]
    if not known:
        return
    bars = [
        math.nan if f.expanded_uncertainty is None else f.expanded_uncertainty for _, f in known
    ]
    axes.errorbar(
        [x for x, _ in known],
        [f.value for _, f in known],
        yerr=None if all(map(math.isnan, bars)) else bars,
        color=colour,
        linestyle=line,
        marker=marker,
        markerfacecolor=face,
        markersize=4.5,
        linewidth=1.0,
        elinewidth=0.9,
        capsize=2.5,
        label=label,
    )


def _label_places(trend: Trend, panels: Sequence[Axes]) -> None:
    for axes in panels:
        if trend.dates is None:
            axes.xaxis.set_major_locator(MaxNLocator(integer=True, nbins=8))
            axes.set_xlim(0.5, len(trend.runs) + 0.5)
            continue
        locator = AutoDateLocator(minticks=3, maxticks=7)
        axes.xaxis.set_major_locator(locator)
        axes.xaxis.set_major_formatter(ConciseDateFormatter(locator))
        first, last = trend.dates[0], trend.dates[-1]
        margin = max(0.05 * (last - first), timedelta(hours=12))
        axes.set_xlim(_day(first - margin), _day(last + margin))
    for axes in panels[-2:]:
        axes.set_xlabel("number of the run" if trend.dates is None else "start of the run")
        axes.tick_params(axis="x", labelbottom=True)
