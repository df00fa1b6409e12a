"""Charts of the adjacent-difference method (figures 10, 11 and 12 of the paper)."""

# matplotlib leaves the types of keyword arguments open
# pyright: reportUnknownMemberType=false

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from thermaxis.positioning import APPROACHES, AdjacentDifferenceResult, FloatArray
from thermaxis.report._positioning_report import PositioningReport
from thermaxis.report._style import (
    ARROWS,
    BOUND_STYLES,
    COLOURS,
    legend_below,
    mark_targets,
    new_figure,
    style_of,
    zero_line,
)
from thermaxis.report.charts._parts import adjacent_of, pair_labels, position_label, put_heading

_MOST_PAIR_LABELS = 15


def bound_words(result: AdjacentDifferenceResult) -> str:
    """Return what the bounds of the deviation chart are, in words."""
    if result.student_factor is None:
        return "no bounds: one cycle only"
    if result.student_factor == 2.0:
        return "±2s of the mean (equation 6)"
    return f"±t·s of the mean (equation 6), t = {result.student_factor:.3f}"


def _plot(axes: Axes, x: FloatArray, y: FloatArray, approach: int, label: str) -> None:
    axes.plot(x, y, **style_of(approach), markersize=4.5, label=label, zorder=3)


def _pair_axis(axes: Axes, targets: int) -> FloatArray:
    """Label the x axis with the pairs of neighbours; return their places."""
    labels = pair_labels(targets)
    step = -(-len(labels) // _MOST_PAIR_LABELS)
    axes.set_xticks(range(0, len(labels), step), labels[::step])
    return np.arange(len(labels), dtype=np.float64)


def draw_standard_deviation(report: PositioningReport) -> Figure:
    """Draw the spread between neighbours; the paper's figure 10."""
    result = adjacent_of(report)
    unit = report.test.kind.units.deviation
    figure = new_figure(4.1)
    upper, lower = figure.subplots(2, 1, sharex=True)
    places = _pair_axis(lower, result.target.size)
    for approach, found in result.measured:
        name = f"{APPROACHES[approach]} {ARROWS[approach]}"
        _plot(upper, places, found.standard_uncertainty, approach, name)
        _plot(lower, places, found.standard_deviation, approach, f"of the difference, {name}")
        lower.plot(
            places,
            report.iso230_2.s[1:, approach],
            **style_of(approach),
            linestyle=":",
            linewidth=1.3,
            markersize=2.5,
            label=f"standard's s at the second position, {name}",
        )
    for axes in (upper, lower):
        axes.set_ylim(0.0, 1.25 * axes.dataLim.ymax or 1.0)
    stars = _mark_anomalies(upper, result)
    upper.set_title("standard uncertainty of the mean, equation (6)")
    lower.set_title("sample standard deviation (divisor n - 1)")
    upper.set_ylabel(f"standard\nuncertainty [{unit}]")
    lower.set_ylabel(f"standard\ndeviation [{unit}]")
    lower.set_xlabel("pair of adjacent positions")
    put_heading(figure, report, "Spread between adjacent positions")
    entries, labels = lower.get_legend_handles_labels()
    entries[2:2] = stars
    labels[2:2] = [str(star.get_label()) for star in stars]
    figure.legend(entries, labels, loc="outside lower center", ncols=2)
    return figure


def _mark_anomalies(axes: Axes, result: AdjacentDifferenceResult) -> list[Line2D]:
    """Ring the pairs that touch a position whose spread stands out, and name it.

    Return the mark for the legend, if there is any.
    """
    rings: list[Line2D] = []
    arrows: dict[int, str] = {}
    tops: dict[int, tuple[int, float]] = {}
    last = result.target.size - 2
    for approach, found in result.measured:
        for anomaly in found.anomalies:
            position = anomaly.position
            pairs = [p for p in (position - 2, position - 1) if 0 <= p < found.cycles.size]
            values = found.standard_uncertainty[pairs]
            rings += axes.plot(
                pairs,
                values,
                linestyle="none",
                marker="o",
                markersize=11.0,
                markerfacecolor="none",
                markeredgecolor="black",
                markeredgewidth=1.2,
                zorder=4,
                label="pairs of a position that stands out, named above",
            )
            arrows[position] = arrows.get(position, "") + ARROWS[approach]
            pair = pairs[int(np.argmax(values))]
            top = (
                pair,
                max(float(other.standard_uncertainty[pair]) for _, other in result.measured),
            )
            tops[position] = max(top, tops.get(position, top), key=lambda place: place[1])
    for place in sorted(set(tops.values())):
        named = sorted(position for position, top in tops.items() if top == place)
        share = place[0] / max(1, last)
        axes.annotate(
            ", ".join(f"position {position} {arrows[position]}" for position in named),
            place,
            xytext=(0.0, 8.0),
            textcoords="offset points",
            ha="left" if share < 0.15 else "right" if share > 0.85 else "center",
            fontsize=7.5,
            fontweight="bold",
        )
    return rings[:1]


def draw_mean_mutual_deviation(report: PositioningReport) -> Figure:
    """Draw the mean mutual deviation of neighbours; the paper's figure 11."""
    result = adjacent_of(report)
    figure = new_figure(3.2)
    axes = figure.subplots()
    places = _pair_axis(axes, result.target.size)
    factor = result.student_factor
    for approach, found in result.measured:
        offset = (approach - 0.5) * 0.16 if len(result.measured) > 1 else 0.0
        axes.errorbar(
            places + offset,
            found.mean_difference,
            yerr=None if factor is None else factor * found.standard_uncertainty,
            **style_of(approach),
            markersize=4.5,
            linestyle="none",
            capsize=2.5,
            linewidth=0.9,
            label=f"{APPROACHES[approach]} {ARROWS[approach]}",
        )
    zero_line(axes)
    axes.set_xlabel("pair of adjacent positions")
    axes.set_ylabel(f"mean of xᵢ - xᵢ₊₁ [{report.test.kind.units.deviation}]")
    put_heading(figure, report, "Mean mutual deviation, equation (4)", before=bound_words(result))
    legend_below(figure, axes, 2)
    return figure


def draw_deviation_chart(report: PositioningReport) -> Figure:
    """Draw the deviation chart by progressive addition with its bounds; the paper's figure 12."""
    result = adjacent_of(report)
    figure = new_figure(3.3)
    axes = figure.subplots()
    for approach, found in result.measured:
        name = f"{APPROACHES[approach]} {ARROWS[approach]}"
        _plot(axes, result.target, found.chart, approach, f"deviation {name}")
        if result.student_factor is None:
            continue
        for number, sign in enumerate((-1.0, 1.0)):
            axes.plot(
                result.target,
                found.chart + sign * found.bound,
                color=COLOURS[approach],
                linestyle=BOUND_STYLES[approach],
                linewidth=0.8,
                label=f"{bound_words(result)} {ARROWS[approach]}" if number == 0 else None,
            )
    p, cycle = result.reference_position, result.reference_cycle
    for number, (_, found) in enumerate(result.measured):
        axes.plot(
            [result.target[p - 1]],
            [found.chart[p - 1]],
            linestyle="none",
            marker="s",
            markersize=9.0,
            markerfacecolor="none",
            markeredgecolor="black",
            label=f"reference: position {p} in cycle {cycle}" if number == 0 else None,
            zorder=4,
        )
    zero_line(axes)
    axes.set_xlabel(position_label(report))
    axes.set_ylabel(f"deviation [{report.test.kind.units.deviation}]")
    mark_targets(axes, result.target.tolist())
    entries, labels = axes.get_legend_handles_labels()
    each, last = (1 if result.student_factor is None else 2), len(entries) - 1
    places = [*range(each), last, *range(each, last)]
    what = "Deviation chart by adjacent differences (no result of ISO 230-2)"
    put_heading(figure, report, what)
    figure.legend(
        [entries[i] for i in places],
        [labels[i] for i in places],
        loc="outside lower center",
        ncols=2,
    )
    return figure
