"""The results of ``evaluate`` as tables on the terminal."""

from typing import TYPE_CHECKING

import numpy as np
from rich import box
from rich.console import Console
from rich.table import Table
from rich.text import Text

from thermaxis.errors import printable
from thermaxis.positioning import (
    FIGURE_KEYS,
    AdjacentDifferenceApproach,
    AdjacentDifferenceResult,
    Iso230_2_1988Result,
    Iso230_2Result,
    PositioningTest,
    Vdi3441Result,
)
from thermaxis.report import (
    FIGURE_NAMES,
    FIGURE_SYMBOLS,
    OTHER_NAMES,
    absence_reason,
    edition_name,
    fixed,
    other_standard_name,
)

if TYPE_CHECKING:
    from thermaxis.report import PositioningReport

WIDEST_TABLE = 110
"""Columns that the widest table takes; a narrower terminal wraps its lines. [1]"""


def print_report(report: "PositioningReport") -> None:
    """Print what was evaluated: the standard's figures first, the others after them.

    Parameters
    ----------
    report : PositioningReport
        The evaluated run.
    """
    width = max(Console().width, WIDEST_TABLE)
    console = Console(highlight=False, soft_wrap=True, width=width)
    decimals = report.figure_decimals
    _print_head(console, report)
    _print_figures(console, report, decimals)
    _print_targets(console, report.test, report.iso230_2, decimals)
    if report.other_standard is not None:
        _print_other(console, report.test, report.other_standard, decimals)
    if report.adjacent_difference is not None:
        _print_adjacent(console, report.test, report.adjacent_difference, decimals)
    for warning in report.warnings:
        console.print(Text(f"warning: {printable(warning, 400)}"))


def _number(value: float | None, decimals: int, *, signed: bool = False) -> str:
    finite = value is not None and bool(np.isfinite(value))
    text = fixed(value if finite else None, decimals, absent="–")
    return f"+{text}" if signed and value is not None and value > 0.0 and finite else text


def _table(title: str, *columns: str, words: int = 0) -> Table:
    table = Table(title=title, title_justify="left", title_style="bold", box=box.SIMPLE_HEAD)
    for i, column in enumerate(columns):
        table.add_column(column, justify="left" if i < words else "right", no_wrap=True)
    return table


def _print_head(console: Console, report: "PositioningReport") -> None:
    test = report.test
    unit = test.kind.units.position
    axis = printable(report.header.get("axis", ""), 40)
    approaches = "unidirectional" if test.unidirectional else "bidirectional"
    times = {
        "file": "times from the file",
        "interpolated": "times spread between start and end",
        "order": "no times, order known",
        "none": "no times",
    }[str(test.time_source)]
    duration = ""
    if test.time_s is not None:
        duration = f", {float(np.nanmax(test.time_s)) / 3600.0:.2f} h"
    console.print(Text(f"{printable(report.source_name)}{', axis ' + axis if axis else ''}"))
    console.print(
        Text(
            f"{test.kind} axis, {test.target.size} targets from {test.target[0]:g} to"
            f" {test.target[-1]:g} {unit}, {test.cycles} {test.cycle} cycles, {approaches}"
            f"{duration} ({times})"
        )
    )
    console.print()


def _print_figures(console: Console, report: "PositioningReport", decimals: int) -> None:
    unit = report.test.kind.units.deviation
    result = report.iso230_2
    columns = ["", "figure", unit]
    if report.limits is not None:
        columns += ["limit", "verdict"]
    table = _table(edition_name(result.edition), *columns, words=2)
    for key in FIGURE_KEYS:
        value: float | None = getattr(result, key)
        name = FIGURE_NAMES[result.edition][key]
        if value is None:
            name += f" (absent: {absence_reason(key, result, report.test)})"
        row = [FIGURE_SYMBOLS[key], name, _number(value, decimals, signed=key == "B_mean")]
        if report.limits is not None:
            check = report.limits.of(key)
            row += ["", ""] if check is None else [f"{check.limit:g}", str(check.verdict)]
        table.add_row(*row)
    console.print(table)
    if report.limits is not None:
        rule = report.limits.limits.decision_rule.in_words
        console.print(Text(f"verdict: {report.limits.verdict} ({rule})"))
        console.print()


def _print_targets(
    console: Console, test: PositioningTest, result: Iso230_2Result, decimals: int
) -> None:
    units = test.kind.units
    table = _table(
        f"Targets, {units.deviation}",
        units.position,
        "mean ↑",
        "mean ↓",
        "mean",
        "s ↑",
        "s ↓",
        "B",
        "R ↑",
        "R ↓",
        "R",
    )
    for i, target in enumerate(result.target.tolist()):
        means = (*result.mean[i].tolist(), float(result.mean_bidirectional[i]))
        spread = result.s[i].tolist()
        repeatability = (*result.R_i_unidirectional[i].tolist(), float(result.R_i[i]))
        table.add_row(
            f"{target:.3f}",
            *(_number(v, decimals, signed=True) for v in means),
            *(_number(v, decimals + 1) for v in spread),
            _number(float(result.B_i[i]), decimals, signed=True),
            *(_number(v, decimals) for v in repeatability),
        )
    console.print(table)


def _print_other(
    console: Console,
    test: PositioningTest,
    result: Iso230_2_1988Result | Vdi3441Result,
    decimals: int,
) -> None:
    name = f"{other_standard_name(result)} ({result.mark})"
    table = _table(name, "", "figure", test.kind.units.deviation, words=2)
    for key in type(result).__slots__:
        if key != "mark":
            value: float | None = getattr(result, key)
            table.add_row(*OTHER_NAMES[key], _number(value, decimals))
    console.print(table)


def _print_adjacent(
    console: Console, test: PositioningTest, result: AdjacentDifferenceResult, decimals: int
) -> None:
    for arrow, approach in zip("↑↓", result.approaches, strict=True):
        if approach is not None:
            console.print(_adjacent_table(test, approach, arrow, decimals))
    factor = "none" if result.student_factor is None else f"{result.student_factor:.3f}"
    console.print(
        Text(
            f"deviation chart from position {result.reference_position} in cycle"
            f" {result.reference_cycle}, bounds ±{factor} u; u is the standard uncertainty of the"
            " mean difference (6), s its sample standard deviation"
        )
    )
    _print_ratio_and_anomalies(console, test, result)


def _adjacent_table(
    test: PositioningTest, approach: AdjacentDifferenceApproach, arrow: str, decimals: int
) -> Table:
    units = test.kind.units
    table = _table(
        f"Adjacent differences {arrow}, {units.deviation} (not a result of ISO 230-2)",
        "pair",
        f"from {units.position}",
        f"to {units.position}",
        "mean difference",
        "u",
        "s",
        "s of standard / s",
        "chart",
        "± bound",
    )
    for i, mean in enumerate(approach.mean_difference.tolist()):
        table.add_row(
            f"{i + 1}-{i + 2}",
            f"{test.target[i]:.3f}",
            f"{test.target[i + 1]:.3f}",
            _number(mean, decimals, signed=True),
            _number(float(approach.standard_uncertainty[i]), decimals + 1),
            _number(float(approach.standard_deviation[i]), decimals + 1),
            _number(float(approach.s_ratio[i]), 2),
            _number(float(approach.chart[i + 1]), decimals, signed=True),
            _number(float(approach.bound[i + 1]), decimals + 1),
        )
    return table


def _print_ratio_and_anomalies(
    console: Console, test: PositioningTest, result: AdjacentDifferenceResult
) -> None:
    unit = test.kind.units.position
    for word, approach in zip(("forward", "backward"), result.approaches, strict=True):
        if approach is None:
            continue
        ratio = approach.s_ratio[np.isfinite(approach.s_ratio)]
        if ratio.size:
            console.print(
                Text(
                    f"{word}: the standard's s is {float(np.median(ratio)):.2f} times the s of the"
                    " adjacent differences (median)"
                )
            )
        for anomaly in approach.anomalies:
            console.print(
                Text(
                    f"{word}: position {anomaly.position} ({anomaly.target:g} {unit}) stands out:"
                    f" its local spread is {anomaly.statistic:.2f} times that of the others"
                )
            )
        if not approach.anomalies:
            console.print(Text(f"{word}: no position stands out"))
    console.print()
