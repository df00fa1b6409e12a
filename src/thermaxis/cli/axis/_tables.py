"""The results of ``evaluate`` as tables on the terminal."""

import sys

import numpy as np

from thermaxis.cli._text_table import text_table
from thermaxis.errors import printable
from thermaxis.positioning import (
    FIGURE_KEYS,
    AdjacentDifferenceApproach,
    AdjacentDifferenceResult,
    DriftResult,
    FigureUncertainty,
    Iso230_2_1988Result,
    Iso230_2Result,
    PositioningTest,
    Vdi3441Result,
    figures_by_key,
)
from thermaxis.report import (
    FIGURE_NAMES,
    FIGURE_SYMBOLS,
    OTHER_NAMES,
    PositioningReport,
    absence_reason,
    edition_name,
    fixed,
    other_standard_name,
)


def print_report(report: PositioningReport) -> None:
    """Print what was evaluated: the standard's figures first, the others after them."""
    decimals = report.figure_decimals
    test = report.test
    parts = [
        _head(report),
        _figures(report, decimals),
        _targets(test, report.iso230_2, decimals),
    ]
    if report.other_standard is not None:
        parts.append(_other(test, report.other_standard, decimals))
    if report.adjacent_difference is not None:
        parts.append(_adjacent(test, report.adjacent_difference, decimals))
    if report.drift is not None:
        parts.append(_drift(report, report.drift, decimals))
    elif report.uncertainty is not None:
        parts.append(_uncertainty_alone(report, report.uncertainty.measured, decimals))
    if report.plan_differences == ():
        parts.append("plan: the run follows it\n")
    if report.diagnosis:
        found = "\n".join(
            f"  {number}. {printable(finding.text, 400)}"
            for number, finding in enumerate(report.diagnosis, start=1)
        )
        parts.append(f"Diagnosis\n\n{found}\n")
    parts += [f"warning: {printable(warning, 400)}" for warning in report.warnings]
    sys.stdout.write("\n".join(parts) + "\n")


def _number(value: float | None, decimals: int, *, signed: bool = False) -> str:
    finite = value is not None and bool(np.isfinite(value))
    text = fixed(value if finite else None, decimals, absent="–")
    return f"+{text}" if signed and value is not None and value > 0.0 and finite else text


def _head(report: PositioningReport) -> str:
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
    name = printable(report.source_name) + (f", axis {axis}" if axis else "")
    run = (
        f"{test.kind} axis, {test.target.size} targets from {test.target[0]:g} to"
        f" {test.target[-1]:g} {unit}, {test.cycles} {test.cycle} cycles, {approaches}"
        f"{duration} ({times})"
    )
    return f"{name}\n{run}\n"


def _figures(report: PositioningReport, decimals: int) -> str:
    result, limits = report.iso230_2, report.limits
    heads = ["", "figure", report.test.kind.units.deviation]
    if limits is not None:
        heads += ["limit", "verdict"]
    rows: list[list[str]] = []
    for key, value in figures_by_key(result).items():
        name = FIGURE_NAMES[result.edition][key]
        if value is None:
            name += f" (absent: {absence_reason(key, result, report.test)})"
        row = [FIGURE_SYMBOLS[key], name, _number(value, decimals, signed=key == "B_mean")]
        if limits is not None:
            check = limits.of(key)
            row += ["", ""] if check is None else [f"{check.limit:g}", str(check.verdict)]
        rows.append(row)
    table = text_table(edition_name(result.edition), heads, rows, words=2)
    if limits is None:
        return table
    return f"{table}\nverdict: {limits.verdict} ({limits.limits.decision_rule.in_words})\n"


def _targets(test: PositioningTest, result: Iso230_2Result, decimals: int) -> str:
    units = test.kind.units
    heads = (units.position, "mean ↑", "mean ↓", "mean", "s ↑", "s ↓", "B", "R ↑", "R ↓", "R")
    rows: list[tuple[str, ...]] = []
    for i, target in enumerate(result.target.tolist()):
        means = (*result.mean[i].tolist(), float(result.mean_bidirectional[i]))
        repeatability = (*result.R_i_unidirectional[i].tolist(), float(result.R_i[i]))
        rows.append(
            (
                f"{target:.3f}",
                *(_number(v, decimals, signed=True) for v in means),
                *(_number(v, decimals + 1) for v in result.s[i].tolist()),
                _number(float(result.B_i[i]), decimals, signed=True),
                *(_number(v, decimals) for v in repeatability),
            )
        )
    return text_table(f"Targets, {units.deviation}", heads, rows)


def _other(
    test: PositioningTest, result: Iso230_2_1988Result | Vdi3441Result, decimals: int
) -> str:
    title = f"{other_standard_name(result)} ({result.mark})"
    keys = [key for key in type(result).__slots__ if key != "mark"]
    rows = [(*OTHER_NAMES[key], _number(getattr(result, key), decimals)) for key in keys]
    return text_table(title, ("", "figure", test.kind.units.deviation), rows, words=2)


def _drift(report: PositioningReport, drift: DriftResult, decimals: int) -> str:
    unit = report.test.kind.units.deviation
    uncertainty = report.uncertainty
    measured = None if uncertainty is None else uncertainty.measured.expanded_uncertainty
    free = None if uncertainty is None or uncertainty.drift_free is None else uncertainty.drift_free
    as_measured, without = figures_by_key(report.iso230_2), figures_by_key(drift.figures)
    rows = [
        (
            FIGURE_SYMBOLS[key],
            _number(as_measured[key], decimals, signed=key == "B_mean"),
            _number(None if measured is None else measured.get(key), decimals),
            _number(without[key], decimals, signed=key == "B_mean"),
            _number(None if free is None else free.expanded_uncertainty.get(key), decimals),
        )
        for key in FIGURE_KEYS
    ]
    table = text_table(
        f"Drift eliminated, {unit} (not a result of ISO 230-2)",
        ("", "measured", "U (k = 2)", "drift-free", "U (k = 2)"),
        rows,
        words=1,
    )
    return "\n".join((table, *_drift_in_words(report.test, drift), *_left_out(free), ""))


def _uncertainty_alone(
    report: PositioningReport, measured: FigureUncertainty, decimals: int
) -> str:
    expanded = measured.expanded_uncertainty
    rows = [(FIGURE_SYMBOLS[key], _number(expanded.get(key), decimals)) for key in FIGURE_KEYS]
    title = f"Uncertainty of the figures, {report.test.kind.units.deviation}"
    table = text_table(title, ("", "U (k = 2)"), rows, words=1)
    return "\n".join((table, *_left_out(measured), ""))


def _left_out(free: FigureUncertainty | None) -> list[str]:
    if free is None or not free.left_out:
        return []
    return [f"U by Monte Carlo (GUM), without: {'; '.join(free.left_out)}"]


def _drift_in_words(test: PositioningTest, drift: DriftResult) -> list[str]:
    unit = test.kind.units.deviation
    noise = ", ".join(
        f"{arrow} {value:.3g}"
        for arrow, value in zip("↑↓", drift.noise_std.tolist(), strict=True)
        if np.isfinite(value)
    )
    said = [f"noise {noise} {unit}; residual standard deviation {drift.residual_std:.3g} {unit}"]
    if not drift.significant:
        return [f"no drift is seen (p = {drift.p_no_drift:.2g}): the run is left as it was", *said]
    when = ""
    if drift.reference_time_s is not None:
        when = f" at {drift.reference_time_s / 3600.0:.2f} h"
    model = "a straight line" if str(drift.model) == "line" else "a smooth curve"
    growth = "µm/m" if unit == "µm" else "arcsec per 1000°"
    grown = f"{drift.total_per_m:+.1f} ± {drift.total_per_m_within:.2g} {growth} of growth"
    common = f"{drift.total:+.2f} ± {drift.total_within:.2g} {unit} in common"
    run = f"over the run {common} and {grown}"
    state = f"levels are those of the thermal state{when}"
    return [f"drift: {model}; {run}; {state}", *said]


def _adjacent(test: PositioningTest, result: AdjacentDifferenceResult, decimals: int) -> str:
    tables = [
        _pairs(test, approach, arrow, decimals)
        for arrow, approach in zip("↑↓", result.approaches, strict=True)
        if approach is not None
    ]
    factor = "none" if result.student_factor is None else f"{result.student_factor:.3f}"
    start = ", ".join(
        f"{arrow} {_number(float(approach.chart[0]), decimals, signed=True)}"
        for arrow, approach in zip("↑↓", result.approaches, strict=True)
        if approach is not None
    )
    chart = (
        f"deviation chart anchored at position {result.reference_position} in cycle"
        f" {result.reference_cycle} (position 1: {start} {test.kind.units.deviation}), bounds"
        f" ±{factor} u; u is the standard uncertainty of the mean difference (6), s its sample"
        " standard deviation"
    )
    return "\n".join((*tables, chart, *_ratio_and_anomalies(test, result), ""))


def _pairs(
    test: PositioningTest, approach: AdjacentDifferenceApproach, arrow: str, decimals: int
) -> str:
    units = test.kind.units
    title = f"Adjacent differences {arrow}, {units.deviation} (not a result of ISO 230-2)"
    ends = (f"from {units.position}", f"to {units.position}")
    heads = ("pair", *ends, "mean difference", "u", "s", "s of standard / s", "chart", "± bound")
    rows = [
        (
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
        for i, mean in enumerate(approach.mean_difference.tolist())
    ]
    return text_table(title, heads, rows)


def _ratio_and_anomalies(test: PositioningTest, result: AdjacentDifferenceResult) -> list[str]:
    unit = test.kind.units.position
    said: list[str] = []
    for word, approach in zip(("forward", "backward"), result.approaches, strict=True):
        if approach is None:
            continue
        ratio = approach.s_ratio[np.isfinite(approach.s_ratio)]
        if ratio.size:
            said.append(
                f"{word}: the standard's s is {float(np.median(ratio)):.2f} times the s of the"
                " adjacent differences (median)"
            )
        said += [
            f"{word}: position {anomaly.position} ({anomaly.target:g} {unit}) stands out:"
            f" its spread is {anomaly.statistic:.2f} times that of the others"
            for anomaly in approach.anomalies
        ]
        if not approach.anomalies_tested:
            said.append(
                f"{word}: not tested which position stands out (5 to 500, 3 cycles or more)"
            )
        elif not approach.anomalies:
            said.append(f"{word}: no position stands out")
    return said
