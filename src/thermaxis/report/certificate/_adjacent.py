"""The certificate's section on the adjacent-difference method."""

from itertools import pairwise

import numpy as np

from thermaxis.positioning import APPROACHES, AdjacentDifferenceResult
from thermaxis.positioning.standard import MOST_POSITIONS, SMALLEST_RATIO
from thermaxis.report._document import Block, ItemList, Paragraph, Picture, Section, Table
from thermaxis.report._positioning_report import PositioningReport
from thermaxis.report._style import ARROWS
from thermaxis.report._text import positions
from thermaxis.report.certificate._number_tables import number_table
from thermaxis.report.charts import at_position, detail_decimals, pair_labels

_HEADING = "adjacent-difference method (not results of ISO 230-2)"
_WHAT_IT_IS = (
    "The values of this section are not results of ISO 230-2 and do not replace them. Method:"
    " Stejskal et al. 2017, equations (4) to (6): differences of two neighbouring positions of the"
    " same run, from which slow thermal drift drops out. The chart of means is the classical mean"
    " curve, moved to the reference; what the method gains is the spread without the drift."
)
_ON_THE_TEST = (
    f"Named are spreads of at least {SMALLEST_RATIO:g} times that of the other positions. The test"
    " is exact, with at most 5 % false alarms per run, for normal and independent readings whose"
    " scatter is equal at all positions; another distribution, or a scatter that varies along the"
    " axis, raises the alarms."
)
_UNTESTED = (
    f"Too few positions or complete cycles (or more than {MOST_POSITIONS} positions) to tell"
    " whether a position stands out by its spread."
)


def adjacent_section(report: PositioningReport, pictures: dict[str, Picture]) -> list[Section]:
    """Return the section on the adjacent-difference method; none if it was not evaluated."""
    result = report.adjacent_difference
    if result is None:
        return []
    charts = [
        pictures[name]
        for name in ("figure_10_standard_deviation", "figure_12_deviation_chart")
        if name in pictures
    ]
    points = (_reference(report, result), _factor(result), _anomalies(report, result))
    blocks: tuple[Block, ...] = (
        Paragraph(_WHAT_IT_IS),
        ItemList(points),
        _pair_table(report, result),
        *charts,
    )
    return [Section(_HEADING, blocks)]


def _reference(report: PositioningReport, result: AdjacentDifferenceResult) -> str:
    p = result.reference_position
    where = at_position(report, float(result.target[p - 1]))
    return (
        f"Reference of the deviation chart: position {p} ({where}) in cycle"
        f" {result.reference_cycle}."
    )


def _factor(result: AdjacentDifferenceResult) -> str:
    factor = result.student_factor
    if factor is None:
        return "One cycle only: no spread and no bounds."
    if factor == 2.0:
        return "Bounds of the chart: ±2s of the mean, equation (6) (30 cycles or more)."
    return (
        f"Bounds of the chart: ±t·s of the mean, equation (6), with Student's factor t ="
        f" {factor:.3f} (95.45 %) in place of 2, as there are fewer than 30 cycles."
    )


def _anomalies(report: PositioningReport, result: AdjacentDifferenceResult) -> str:
    named = [
        f"position {a.position} ({at_position(report, a.target)}) {APPROACHES[approach]}, spread"
        f" {'far above' if not np.isfinite(a.statistic) else f'{a.statistic:.2f} times'} that of"
        " the other positions"
        for approach, found in result.measured
        for a in found.anomalies
    ]
    if not any(found.anomalies_tested for _, found in result.measured):
        return _UNTESTED
    if not named:
        return f"No position stands out by its spread. {_ON_THE_TEST}"
    return (
        f"A prompt to look, not a verdict: the spread stands out at {'; '.join(named)}."
        f" {_ON_THE_TEST}"
    )


def _pair_table(report: PositioningReport, result: AdjacentDifferenceResult) -> Table:
    units, decimals = report.test.kind.units, detail_decimals(report)
    names = (f"{first} – {second}" for first, second in pairwise(positions(result.target)))
    numbers = [
        column
        for a, found in result.measured
        for column in (
            (f"*x̄ {ARROWS[a]}", found.mean_difference, decimals),
            (f"*s {ARROWS[a]}", found.standard_uncertainty, decimals),
            (f"s(x) {ARROWS[a]}", found.standard_deviation, decimals),
            (f"ratio {ARROWS[a]}", found.s_ratio, 2),
        )
    ]
    caption = (
        f"Pairs of adjacent positions, in {units.deviation}. *x̄: mean mutual deviation, equation"
        " (4), first minus second position; *s: its standard uncertainty, equation (6), divisor"
        " n(n - 1); s(x): sample standard deviation of the difference, divisor n - 1; ratio: the"
        " standard's s at the second position over s(x), without unit."
    )
    cells = zip(pair_labels(result.target.size), names, strict=True)
    return number_table(f"<Pair | <Targets [{units.position}]", cells, numbers, caption)
