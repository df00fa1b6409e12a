"""What several charts share."""

# matplotlib leaves the types of keyword arguments open
# pyright: reportUnknownMemberType=false

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import ArrayLike, NDArray

from thermaxis.positioning import FIGURE_KEYS, AdjacentDifferenceResult, FloatArray
from thermaxis.report._figure_table import figure_table
from thermaxis.report._names import FIGURE_SYMBOLS
from thermaxis.report._positioning_report import PositioningReport
from thermaxis.report._style import drawable, set_heading
from thermaxis.report._text import FINEST_DECIMALS, plain_text

_MOST_DRAWN = 200
"""More runs than these are one grey area, and a file of many megabytes. [1]"""
_LONGEST_TITLE = 190
"""A longer title does not fit two lines above a chart. [1]"""


def adjacent_of(report: PositioningReport) -> AdjacentDifferenceResult:
    """Return the adjacent differences of a report that has them."""
    assert report.adjacent_difference is not None  # noqa: S101 - asked for only then
    return report.adjacent_difference


def detail_decimals(report: PositioningReport) -> int:
    """Return the decimals of the tables that let a reader follow the figures: one more. [1]"""
    return min(report.figure_decimals + 1, FINEST_DECIMALS)


def value_label(report: PositioningReport, key: str) -> str:
    """Return a figure as the table of figures prints it, with its unit."""
    table = figure_table(report)
    text = table.cells[FIGURE_KEYS.index(key)][table.labels.index("value")]
    return f"{FIGURE_SYMBOLS[key]} {text} {table.unit}"


def position_label(report: PositioningReport) -> str:
    """Return the label of an axis of target positions."""
    return f"target position [{report.test.kind.units.position}]"


def at_position(report: PositioningReport, target: float) -> str:
    """Return a target position with its unit."""
    unit = report.test.kind.units.position
    return f"{target:g}{'' if unit == '°' else ' '}{unit}"


def put_heading(
    figure: Figure, report: PositioningReport, what: str, *, before: str = "", after: str = ""
) -> None:
    """Put the lines above a chart: what it shows, of which axis, and in which test."""
    axis, title = report.header.get("axis", ""), plain_text(report.header.get("title", ""), 400)
    first = f"{what} · axis {drawable(axis, 20)}" if axis else what
    shown = drawable(title, 400) if len(title) <= _LONGEST_TITLE else ""
    second = " · ".join(part for part in (before, _describe_run(report), after) if part)
    set_heading(figure, first, second, title=shown)


def cycles_with_readings(report: PositioningReport) -> int:
    """Return how many cycles have a reading at all. [1]"""
    return int(np.sum(np.any(~np.isnan(report.test.deviation), axis=(0, 2))))


def runs_of_targets(report: PositioningReport) -> str:
    """Return how many readings a target has in each direction, as a number or from-to."""
    readings = report.test.readings[:, report.test.approaches]
    least, most = int(np.min(readings)), int(np.max(readings))
    return str(most) if least == most else f"{least} to {most}"


def _describe_run(report: PositioningReport) -> str:
    """Return size and source of a run in a few words."""
    test, cycles = report.test, cycles_with_readings(report)
    approach = "" if not test.unidirectional else ", one direction"
    targets = f"{test.target.size} target{'s' * (test.target.size > 1)}"
    size = f"{targets}, {cycles} cycle{'s' * (cycles > 1)}{approach}"
    return " · ".join(part for part in (size, drawable(report.source_name, 60)) if part)


def drawn_cycles(cycles: int) -> NDArray[np.int64]:
    """Return the cycles that are drawn one by one, from 0: all, or 200 spread evenly."""
    return np.unique(
        np.round(np.linspace(0, cycles - 1, min(cycles, _MOST_DRAWN))).astype(np.int64)
    )


def add_scale(axes: Axes, place: FloatArray, number: FloatArray, label: str) -> None:
    """Add a second scale of x above, on which each place has its number; straight beyond them."""
    far = 1e6
    slope = np.diff(number)[[0, -1]] / np.diff(place)[[0, -1]]
    number = np.concatenate(([number[0] - far * slope[0]], number, [number[-1] + far * slope[1]]))
    place = np.concatenate(([place[0] - far], place, [place[-1] + far]))

    def number_at(places: ArrayLike) -> FloatArray:
        return np.interp(np.asarray(places, dtype=np.float64), place, number)

    def place_of(numbers: ArrayLike) -> FloatArray:
        return np.interp(np.asarray(numbers, dtype=np.float64), number, place)

    scale = axes.secondary_xaxis("top", functions=(number_at, place_of))
    scale.set_xlabel(label, fontsize=7.0)


def pair_labels(targets: int) -> list[str]:
    """Return the names of the pairs of neighbours, from 1."""
    return [f"{i}–{i + 1}" for i in range(1, targets)]
