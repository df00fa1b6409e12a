"""What several charts share."""

import numpy as np
from numpy.typing import NDArray

from thermaxis.positioning import BACKWARD, FORWARD
from thermaxis.report._positioning_report import PositioningReport
from thermaxis.report._style import drawable
from thermaxis.report._text import FINEST_DECIMALS, fixed

_MOST_DRAWN = 200
"""More runs than these are one grey area, and a file of many megabytes. [1]"""


def measured_approaches(report: PositioningReport) -> list[int]:
    """Return the indices of the approaches that were measured, forward first."""
    return [a for a in (FORWARD, BACKWARD) if report.test.measured_approaches[a]]


def detail_decimals(report: PositioningReport) -> int:
    """Return the decimals of the tables that let a reader follow the figures: one more. [1]"""
    return min(report.figure_decimals + 1, FINEST_DECIMALS)


def value_label(report: PositioningReport, value: float) -> str:
    """Return a figure as charts print it, with its unit."""
    return f"{fixed(value, report.figure_decimals)} {report.test.kind.units.deviation}"


def position_label(report: PositioningReport) -> str:
    """Return the label of an axis of target positions."""
    return f"target position [{report.test.kind.units.position}]"


def at_position(report: PositioningReport, target: float) -> str:
    """Return a target position with its unit."""
    unit = report.test.kind.units.position
    return f"{target:g}{'' if unit == '°' else ' '}{unit}"


def heading_line(report: PositioningReport, what: str) -> str:
    """Return the first line above a chart: what it shows, of which axis, in which test."""
    parts = [what]
    axis, title = report.header.get("axis", ""), report.header.get("title", "")
    if axis:
        parts.append(f"axis {drawable(axis, 20)}")
    if title:
        parts.append(drawable(title))
    return " · ".join(parts)


def describe_run(report: PositioningReport) -> str:
    """Return size and source of a run in a few words."""
    test = report.test
    approach = "" if not test.unidirectional else ", one direction"
    size = f"{test.target.size} targets, {test.cycles} cycle{'s' * (test.cycles > 1)}{approach}"
    return f"{size} · {drawable(report.source_name, 60)}"


def drawn_cycles(cycles: int) -> NDArray[np.int64]:
    """Return the cycles that are drawn one by one, from 0: all, or 200 spread evenly."""
    return np.unique(
        np.round(np.linspace(0, cycles - 1, min(cycles, _MOST_DRAWN))).astype(np.int64)
    )


def pair_labels(targets: int) -> list[str]:
    """Return the names of the pairs of neighbours, from 1."""
    return [f"{i}–{i + 1}" for i in range(1, targets)]
