"""The standard's chart as metrologists know it."""

# matplotlib leaves the types of keyword arguments open
# pyright: reportUnknownMemberType=false

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from thermaxis.positioning import APPROACHES, BACKWARD, FORWARD, FloatArray, figures_by_key
from thermaxis.report._names import FIGURE_SYMBOLS, edition_name
from thermaxis.report._positioning_report import PositioningReport
from thermaxis.report._style import (
    ARROWS,
    BOUND_STYLES,
    COLOURS,
    DARK,
    GREY,
    legend_below,
    mark_targets,
    new_figure,
    style_of,
    zero_line,
)
from thermaxis.report.charts._parts import (
    at_position,
    drawn_cycles,
    position_label,
    put_heading,
    value_label,
)


def draw_iso230_2(report: PositioningReport, height_in: float = 4.1) -> Figure:
    """Draw means, bands, runs, and the extents of M, E, A, R and B."""
    result = report.iso230_2
    figure = new_figure(height_in)
    axes, margin = figure.subplots(1, 2, sharey=True, width_ratios=(1.0, 0.17))
    _draw_means(axes, report)
    _draw_bands(axes, report)
    _draw_runs(axes, report)
    zero_line(axes)
    _draw_extremes(axes, report)
    _draw_limit(axes, report)
    _draw_brackets(margin, report)
    axes.set_xlabel(position_label(report))
    axes.set_ylabel(f"deviation [{report.test.kind.units.deviation}]")
    mark_targets(axes, report.test.target.tolist())
    note = "bands ±2s" if bool(np.any(np.isfinite(result.s))) else _no_bands(report)
    before = f"{edition_name(result.edition)} · {note}"
    put_heading(figure, report, "Accuracy and repeatability of positioning", before=before)
    legend_below(figure, axes, 4)
    return figure


def _no_bands(report: PositioningReport) -> str:
    if report.test.cycles == 1:
        return "single run, no repeatability"
    return "axis over 2000 mm: means of all runs, no repeatability"


def _bounds(report: PositioningReport) -> tuple[FloatArray, FloatArray]:
    """Return mean - 2s and mean + 2s, (m, 2); the means where s was not evaluated."""
    result = report.iso230_2
    two_s = np.where(np.isnan(result.s), 0.0, 2.0 * result.s)
    return result.mean - two_s, result.mean + two_s


def _draw_means(axes: Axes, report: PositioningReport) -> None:
    result = report.iso230_2
    for approach in report.test.approaches:
        axes.plot(
            result.target,
            result.mean[:, approach],
            **style_of(approach),
            markersize=4.5,
            zorder=4,
            label=f"mean {APPROACHES[approach]} {ARROWS[approach]}",
        )
    if not report.test.unidirectional:
        axes.plot(
            result.target,
            result.mean_bidirectional,
            color="black",
            linestyle="--",
            linewidth=1.0,
            zorder=3.5,
            label="mean bidirectional",
        )


def _draw_bands(axes: Axes, report: PositioningReport) -> None:
    if not bool(np.any(np.isfinite(report.iso230_2.s))):
        return
    low, high = _bounds(report)
    for approach in report.test.approaches:
        axes.fill_between(
            report.iso230_2.target,
            low[:, approach],
            high[:, approach],
            color=COLOURS[approach],
            alpha=0.10,
            linewidth=0.0,
            zorder=2,
        )
        for number, edge in enumerate((low, high)):
            axes.plot(
                report.iso230_2.target,
                edge[:, approach],
                color=COLOURS[approach],
                linestyle=BOUND_STYLES[approach],
                linewidth=0.6,
                zorder=3,
                label=f"±2s {APPROACHES[approach]}" if number == 0 else None,
            )


def _draw_runs(axes: Axes, report: PositioningReport) -> None:
    cycles = drawn_cycles(report.test.cycles)
    few = cycles.size <= 10
    name = "single runs" if cycles.size == report.test.cycles else f"{cycles.size} of the runs"
    first = True
    for approach in report.test.approaches:
        lines = axes.plot(
            report.test.target,
            report.test.deviation[:, cycles, approach],
            color=GREY,
            linewidth=0.5 if few else 0.3,
            alpha=0.8 if few else 0.35,
            marker="." if few else "",
            markersize=1.5,
            zorder=1.8,
        )
        if first:
            lines[0].set_label(name)
            first = False


def _draw_extremes(axes: Axes, report: PositioningReport) -> None:
    """Mark the target with the largest R_i and the one with the largest B_i."""
    result, target = report.iso230_2, report.test.target
    low, high = _bounds(report)
    span = float(np.ptp(target)) or 1.0
    axes.set_xlim(float(target[0]) - 0.03 * span, float(target[-1]) + 0.03 * span)
    marks: list[tuple[int, str, FloatArray]] = []
    figures, spreads = figures_by_key(result), [("B", np.abs(result.B_i)), ("R", result.R_i)]
    if report.test.unidirectional:
        (one,) = report.test.approaches
        spreads.append((f"R_{APPROACHES[one]}", result.R_i_unidirectional[:, one]))
    for key, spread in spreads:
        if figures[key] is not None:
            i = int(np.nanargmax(spread))
            extent = result.mean[i] if key == "B" else np.concatenate((low[i], high[i]))
            marks.append((i, value_label(report, key), extent))
    words: dict[int, list[str]] = {}
    for i, text, _ in marks:
        words.setdefault(i, []).append(text)
    for number, (i, _, values) in enumerate(marks):
        aside = (2 * number - 1) * 0.007 * span if len(words[i]) > 1 else 0.0
        _draw_extent(axes, float(target[i]) + aside, values)
    for row, (i, texts) in enumerate(words.items()):
        share = float(target[i] - target[0]) / span
        axes.text(
            float(target[i]),
            1.015 + 0.052 * row,
            f"{', '.join(texts)} at {at_position(report, float(target[i]))}",
            transform=axes.get_xaxis_transform(),
            ha="left" if share < 0.25 else "right" if share > 0.75 else "center",
            va="bottom",
            fontsize=7.0,
        )


def _draw_extent(axes: Axes, x: float, values: FloatArray) -> None:
    """Draw the extent of some values with end strokes, and a thin line up to its text."""
    low, high = float(np.nanmin(values)), float(np.nanmax(values))
    axes.plot(
        [x, x],
        [low, high],
        color="black",
        linewidth=1.1,
        marker="_",
        markersize=7.0,
        markeredgewidth=1.1,
        zorder=5,
    )
    axes.annotate(
        "",
        xy=(x, high),
        xytext=(x, 1.0),
        textcoords=axes.get_xaxis_transform(),
        arrowprops={
            "arrowstyle": "-",
            "linewidth": 0.6,
            "linestyle": ":",
            "color": DARK,
            "shrinkA": 0.0,
            "shrinkB": 0.0,
        },
    )


def _limited_extent(report: PositioningReport) -> tuple[str, float, float, float] | None:
    """Return the limited figure to draw: symbol, limit, and the bounds of its extent."""
    if report.limits is None:
        return None
    low, high = _bounds(report)
    mean = report.iso230_2.mean
    edges = {"A": (low, high), "E": (mean, mean)}
    for name, (lower, upper) in edges.items():
        for key in (name, f"{name}_forward", f"{name}_backward"):
            check = report.limits.of(key)
            if check is None or check.value is None:
                continue
            which = {"forward": [FORWARD], "backward": [BACKWARD]}.get(key[2:], [FORWARD, BACKWARD])
            bounds = float(np.nanmin(lower[:, which])), float(np.nanmax(upper[:, which]))
            return FIGURE_SYMBOLS[key], check.limit, *bounds
    return None


def _draw_limit(axes: Axes, report: PositioningReport) -> None:
    extent = _limited_extent(report)
    if extent is None:
        return
    symbol, limit, low, high = extent
    centre = (low + high) / 2.0
    unit = report.test.kind.units.deviation
    for number, edge in enumerate((centre - limit / 2.0, centre + limit / 2.0)):
        axes.axhline(
            edge,
            color="black",
            linestyle=(0, (8, 3)),
            linewidth=1.0,
            zorder=2.5,
            label=f"limit of {symbol}: {limit:g} {unit}, centred" if number == 0 else None,
        )


def _draw_brackets(margin: Axes, report: PositioningReport) -> None:
    """Draw the extents that have a bracket: M, E, A, or those of the only approach."""
    result = report.iso230_2
    low, high = _bounds(report)
    margin.axis("off")
    margin.set_xlim(0.0, 1.0)
    extents: list[tuple[str, FloatArray, FloatArray]] = []
    index = ""
    if report.test.unidirectional:
        index = "_" + APPROACHES[report.test.approaches[0]]
    centre, figures = result.mean_bidirectional, figures_by_key(result)
    for key, lower, upper in (
        ("M", centre, centre),
        (f"E{index}", result.mean, result.mean),
        (f"A{index}", low, high),
    ):
        if figures[key] is not None:
            extents.append((value_label(report, key), lower, upper))
    for number, (label, lower, upper) in enumerate(extents):
        x = 0.10 + 0.34 * number
        bottom, top = float(np.nanmin(lower)), float(np.nanmax(upper))
        margin.plot(
            [x - 0.08, x, x, x - 0.08],
            [top, top, bottom, bottom],
            color="black",
            linewidth=1.0,
            clip_on=False,
        )
        margin.text(
            x + 0.05,
            (bottom + top) / 2.0,
            label,
            rotation=90,
            ha="left",
            va="center",
            fontsize=7.5,
            fontweight="bold",
        )
