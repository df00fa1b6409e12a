"""Charts of thermal tests: panels of lines, each told apart by its marker as well as its colour."""

# matplotlib leaves the types of keyword arguments open
# pyright: reportUnknownMemberType=false

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Literal, TypeAlias, final

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import FormatStrFormatter, LogLocator

from thermaxis.files.table import protected
from thermaxis.positioning import FloatArray
from thermaxis.report._output import NumberTable
from thermaxis.report._style import (
    DARK,
    GREY,
    drawable,
    drawing,
    new_figure,
    set_heading,
    svg_bytes,
)
from thermaxis.report.thermal._lines import drawn_line, marked

Dash: TypeAlias = Literal["-"] | tuple[float, tuple[float, ...]]

MOST_LINES = 6
"""More lines than these in one panel cannot be told apart. [1]"""
_LABEL = 22
"""Longest label of a line; a longer name is cut. [1]"""
_LEGEND_WIDTH = 110
"""Width of a legend below a chart. [characters]"""
_SHADE: dict[str, Any] = {
    "facecolor": "#f4f4f4",
    "edgecolor": "#d4d4d4",
    "hatch": "//",
    "linewidth": 0.0,
}
_MARK: dict[str, Any] = {
    "color": "black",
    "linewidth": 0.8,
    "linestyle": (0, (5.0, 2.0, 1.0, 2.0)),
}
_SAMPLE_WIDTH = 11
"""Width of what stands before a label, and of the gap behind it. [characters]"""


@final
@dataclass(frozen=True, slots=True)
class Look:
    """How a line looks."""

    colour: str
    line: Dash = "-"
    width: float = 1.1
    """Width. [pt]"""
    marker: str = ""
    """Marker, a few along the line."""
    filled: bool = True
    """Whether its markers are filled."""
    stems: bool = False
    """Whether values stand on stems and are not joined."""
    points: bool = False
    """Whether every value has its marker."""


LOOKS = (
    Look("#0072b2", marker="o"),
    Look("#c84e00", marker="s", filled=False),
    Look("#1b7f5c", marker="^"),
    Look("#7b3294", marker="D", filled=False),
    Look("#8a6d00", marker="v"),
    Look(DARK, marker="P", filled=False),
)
"""Lines of one kind: colour, marker, filled and open by turns."""
MEASURED = Look(GREY, width=2.4)
"""The machine as it is: broad and pale."""
SIMULATED = Look("black", line=(0, (4.0, 1.6)), width=1.1)
"""Free run of the model: dashed."""
RESIDUAL = Look("#0072b2", width=0.9, marker="o", filled=False)
"""Measured minus simulated."""
REST = Look(GREY, line=(0, (1.0, 1.2)), width=1.6)
"""What is not drawn one by one."""


@final
@dataclass(frozen=True, slots=True, eq=False)
class Trace:
    """A line of a panel."""

    label: str
    """Its name; text from files as it is."""
    x: FloatArray
    """Times, lags or counts, (n,). [unit of the panel]"""
    y: FloatArray
    """Values, (n,); NaN where there is none. [unit of the panel]"""
    look: Look


@final
@dataclass(frozen=True, slots=True, eq=False)
class Area:
    """A pale area behind the lines: a band, or the extent of what is not drawn."""

    label: str
    x: FloatArray
    """Times or lags, (n,). [unit of the panel]"""
    low: FloatArray
    """Lower edge, (n,). [unit of the panel]"""
    high: FloatArray
    """Upper edge, (n,). [unit of the panel]"""
    colour: str = ""
    """That of its line; none for grey."""
    of: str = ""
    """Name of its line, where there are several."""


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class Panel:
    """Lines with common axes."""

    title: str
    """What it shows; text from files as it is."""
    quantity: str
    """Label of the upright axis, with the unit."""
    traces: tuple[Trace, ...]
    areas: tuple[Area, ...] = ()
    shaded: tuple[tuple[float, float], ...] = ()
    """Parts of the level axis that do not count. [unit of the panel]"""
    mark: float | None = None
    """Place of an upright line. [unit of the panel]"""
    mark_label: str = ""
    height_in: float = 1.55
    """Height. [in]"""
    log_y: bool = False
    """Whether its upright axis is logarithmic."""
    own_scale: bool = False
    """Whether its upright axis is its own in a chart that has one scale."""


@final
@dataclass(frozen=True, slots=True, eq=False)
class ThermalChart:
    """A chart of a report."""

    name: str
    """Name of its files, without suffix."""
    caption: str
    """What it shows and how to read it."""
    draw: Callable[[], Figure]
    numbers: NumberTable
    """What is drawn, in numbers."""

    def svg(self) -> bytes:
        """Return the chart as SVG."""
        with drawing(self.name):
            return svg_bytes(self.draw())


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class PanelGrid:
    """Panels that stand together."""

    heading: str
    source: str
    """Second line: the log; text from files as it is."""
    panels: tuple[Panel, ...]
    """From left to right, then down."""
    axis: str = "time [h]"
    """Label of the level axis, with the unit."""
    columns: int = 1
    """Panels side by side. [1]"""
    one_axis: bool = True
    """Whether the level axes are the same."""
    log_x: bool = False
    """Whether the level axes are logarithmic."""
    one_scale: bool = False
    """Whether the upright axes are the same."""
    one_legend: bool = False
    """Whether one legend below holds for all panels."""


def panel_chart(name: str, caption: str, grid: PanelGrid) -> ThermalChart:
    """Return panels as a chart of a report."""
    return ThermalChart(name, caption, lambda: draw_panels(grid), panel_numbers(grid))


def shown_text(text: str) -> str:
    """Return text from a file as a cell of CSV that a spreadsheet does not obey."""
    return protected(drawable(text, 80))


def panel_numbers(grid: PanelGrid) -> NumberTable:
    """Return the points that are drawn: long lines are reduced to their extremes."""
    rows: list[tuple[str | float, ...]] = []
    for panel in grid.panels:
        lines = [(t.label, t.x, t.y) for t in panel.traces]
        for area in panel.areas:
            name = f"{area.label} of {area.of}" if area.of else area.label
            lines += [(f"{name}, low", area.x, area.low), (f"{name}, high", area.x, area.high)]
        for label, x, y in lines:
            line = drawn_line(np.log10(x) if grid.log_x else x, y)
            at = np.concatenate([line.x, line.alone_x])
            at = 10.0**at if grid.log_x else at
            values = np.concatenate([line.y, line.alone_y])
            known = ~np.isnan(values)
            words = (shown_text(panel.title), panel.quantity, shown_text(label))
            rows += [
                (*words, float(a), float(v)) for a, v in zip(at[known], values[known], strict=True)
            ]
    return NumberTable(("panel", "quantity", "line", grid.axis, "value"), rows)


def draw_panels(grid: PanelGrid) -> Figure:
    """Draw panels."""
    down = -(-len(grid.panels) // grid.columns)
    heights = [
        max(p.height_in for p in grid.panels[k * grid.columns : (k + 1) * grid.columns])
        for k in range(down)
    ]
    figure = new_figure(0.75 + sum(heights) + (0.25 if grid.one_legend else 0.0))
    table: list[list[Axes]] = figure.subplots(
        down,
        grid.columns,
        squeeze=False,
        sharex=grid.one_axis,
        gridspec_kw={"height_ratios": heights},
    ).tolist()
    axes = [a for row in table for a in row]
    for place, panel in zip(axes, grid.panels, strict=False):
        _draw_panel(place, panel, log_x=grid.log_x)
    for unused in axes[len(grid.panels) :]:
        unused.set_visible(False)
    if grid.one_scale:
        alike = [a for a, p in zip(axes, grid.panels, strict=False) if not p.own_scale]
        limits = [a.get_ylim() for a in alike]
        for place in alike:
            place.set_ylim(min(low for low, _ in limits), max(high for _, high in limits))
    for k, place in enumerate(axes[: len(grid.panels)]):
        if k + grid.columns >= len(grid.panels):
            place.set_xlabel(grid.axis)
            place.tick_params(axis="x", labelbottom=True)
        if grid.one_scale and k % grid.columns:
            place.set_ylabel("")
    _put_legends(figure, axes, grid)
    if grid.source:
        set_heading(figure, grid.heading, drawable(grid.source, 100))
    else:
        figure.suptitle(grid.heading)
    return figure


def _put_legends(figure: Figure, axes: Sequence[Axes], grid: PanelGrid) -> None:
    if grid.one_legend:
        entries, labels = _legend(grid.panels)
        columns = legend_columns(labels)
        figure.legend(entries, labels, loc="outside lower center", ncols=columns)
        return
    for place, panel in zip(axes, grid.panels, strict=False):
        entries, labels = _legend((panel,))
        place.legend(
            entries, labels, loc="upper left", bbox_to_anchor=(1.01, 1.03), borderaxespad=0.0
        )


def legend_columns(labels: Sequence[str]) -> int:
    """Return how many columns of a legend fit side by side, all lines filled alike."""
    widest = max(len(line) for label in labels for line in label.split("\n"))
    most = max(1, int(_LEGEND_WIDTH / (_SAMPLE_WIDTH + widest)))
    return -(-len(labels) // -(-len(labels) // most))


def line_label(label: str) -> str:
    """Return the name of a line as a legend shows it."""
    text = "\n".join(_shortened(drawable(line)) for line in label.split("\n")[:2])
    return f" {text}" if text.startswith("_") else text  # the library hides such names


def _shortened(text: str) -> str:
    if len(text) <= _LABEL:
        return text
    end = _LABEL // 2 - 1
    return f"{text[: _LABEL - 1 - end]}…{text[-end:]}"


def _legend(panels: Sequence[Panel]) -> tuple[list[Artist], list[str]]:
    found: dict[str, Artist] = {}
    for panel in panels:
        for trace in panel.traces:
            found.setdefault(trace.label, _sample(trace.look))
        for area in panel.areas:
            found.setdefault(area.label, Patch(facecolor="#d9d9d9"))
        if panel.shaded:
            found.setdefault("does not count", Patch(**_SHADE))
        if panel.mark is not None:
            found.setdefault(panel.mark_label, Line2D([], [], **_MARK))
    return list(found.values()), [line_label(label) for label in found]


def _style(look: Look, marker: str = "", **more: object) -> dict[str, Any]:
    """Return colour and marker of a line; another marker where it has none of its own."""
    face = look.colour if look.filled else "white"
    return {"color": look.colour, "marker": look.marker or marker, "markerfacecolor": face, **more}


def _sample(look: Look) -> Line2D:
    line, marker = ("", ".") if look.stems else (look.line, "")
    style = _style(look, marker)
    return Line2D([], [], **style, linestyle=line, linewidth=look.width, markersize=3.6)


def _draw_panel(axes: Axes, panel: Panel, *, log_x: bool) -> None:
    if log_x:
        axes.set_xscale("log")
        axes.xaxis.set_major_formatter(FormatStrFormatter("%g"))  # the default one is a formula
    if panel.log_y:
        axes.set_yscale("log", subs=[])
        axes.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        axes.yaxis.set_major_formatter(FormatStrFormatter("%g"))
    for first, last in panel.shaded:
        axes.axvspan(first, last, **_SHADE)
    for area in panel.areas:
        axes.fill_between(area.x, area.low, area.high, **_pale(area), zorder=1.2)
    for number, trace in enumerate(panel.traces):
        if trace.look.stems:
            axes.vlines(trace.x, 0.0, trace.y, color=trace.look.colour, linewidth=trace.look.width)
            axes.plot(trace.x, trace.y, ".", color=trace.look.colour, markersize=2.5)
        else:
            _draw_line(axes, trace, (number + 0.5) / len(panel.traces), log_x=log_x)
    if panel.mark is not None:
        axes.axvline(panel.mark, **_MARK)
    if not panel.log_y:
        axes.axhline(0.0, color="black", linewidth=0.6, zorder=1.5)
    axes.set_title(drawable(panel.title, 90), loc="left")
    axes.set_ylabel(panel.quantity)
    axes.margins(x=0.01)


def _pale(area: Area) -> dict[str, Any]:
    if not area.colour:
        return {"color": "#d9d9d9", "linewidth": 0.0}
    edge = {"edgecolor": (area.colour, 0.6), "linewidth": 0.4}
    return {"facecolor": (area.colour, 0.16), **edge}


def _draw_line(axes: Axes, trace: Trace, turn: float, *, log_x: bool) -> None:
    look, line = trace.look, drawn_line(np.log10(trace.x) if log_x else trace.x, trace.y)
    x, alone_x = (10.0**at if log_x else at for at in (line.x, line.alone_x))
    if line.x.size:
        style = _style(look, linestyle=look.line, linewidth=look.width)
        places = None if look.points else marked(line, turn)
        axes.plot(x, line.y, **style, markersize=3.6, markeredgewidth=0.8, markevery=places)
    if line.alone_x.size:
        style = _style(look, "o", linestyle="", markeredgewidth=0.7)
        size = 3.0 if look.marker else 1.8 * look.width
        axes.plot(alone_x, line.alone_y, **style, markersize=size)
