"""The evaluation of a positioning run, described once; its keys stand in docs/json.md."""

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import fields

import numpy as np

from thermaxis.codes import value_as_json
from thermaxis.files.settings import LONGEST_TEXT
from thermaxis.messages import sentence_of
from thermaxis.positioning import (
    APPROACHES,
    BACKWARD,
    FIGURE_KEYS,
    FORWARD,
    AdjacentDifferenceApproach,
    AdjacentDifferenceResult,
    BudgetRow,
    Change,
    DriftResult,
    Finding,
    Iso230_2_1988Result,
    Iso230_2Figures,
    PositioningTest,
    Vdi3441Result,
    figures_by_key,
)
from thermaxis.report._figure_table import (
    FigureRow,
    budget_table,
    doubts_of_u,
    figure_table,
    terms_of_u,
)
from thermaxis.report._names import (
    OTHER_NAMES,
    edition_name,
    other_standard_name,
)
from thermaxis.report._positioning_report import PositioningReport
from thermaxis.report._text import plain_text
from thermaxis.report.tables._described import (
    Part,
    Section,
    Table,
    Value,
    as_json,
    messages_of,
    rows_of,
    values_of,
    without_text,
)

_NOT_OF_THE_STANDARD = "(not a result of ISO 230-2)"
_UNCERTAINTIES = (
    *("expanded_uncertainty", "coverage_factor", "bias"),
    "corrected_standard_uncertainty",
)
_WORDS = {"key", "symbol", "name", "absent", "strong"}
_OF_FIGURES = tuple(one.name for one in fields(FigureRow) if one.name not in _WORDS)
_OF_BUDGET = tuple(one.name for one in fields(BudgetRow))


def describe_evaluation(report: PositioningReport) -> list[Part]:
    """Return everything that was evaluated: the standard's figures first, the others after them.

    Returns
    -------
    list of Part
        What ``thermaxis evaluate`` shows and writes.
    """
    other, uncertainty = report.other_standard, report.uncertainty
    differences = report.plan_differences
    return [
        Value("version", report.version),
        *_run(report),
        _figures(report),
        _figure_table(report),
        _limits(report),
        *_other(report.test, other, report.figure_decimals),
        _adjacent(report.test, report.adjacent_difference, report.figure_decimals),
        _drift(report),
        Value("uncertainty", None) if uncertainty is None else _uncertainty(report),
        *(["plan: the run follows it"] if differences == () else []),
        Value("plan_differences", differences and tuple(map(sentence_of, differences))),
        Value("plan_difference_codes", differences and tuple(map(value_as_json, differences))),
        Section("", _diagnosis(report.diagnosis)),
        Section("", messages_of("warnings", report.warnings, "warning", say=sentence_of)),
    ]


def options_in_words(report: PositioningReport) -> str:
    """Return how the file was read and the run evaluated, as a certificate states it."""
    stated = ((k, json.dumps(v, ensure_ascii=False)) for k, v in report.options.items())
    words = "; ".join(f"{k.replace('_', ' ')} {text.strip(chr(34))}" for k, text in stated)
    return plain_text(words, LONGEST_TEXT)


def _diagnosis(findings: Sequence[Finding]) -> list[str]:
    said = [f"{k}. {sentence_of(one.message)}" for k, one in enumerate(findings, start=1)]
    return ["Diagnosis", "", *said] if said else []


def _finding(finding: Finding) -> dict[str, object]:
    return {
        **as_json(values_of(finding, "finding", "value", "unit", "p_value")),
        "text": sentence_of(finding.message),
        "message": value_as_json(finding.message),
    }


def _run(report: PositioningReport) -> Iterator[Part]:
    test = report.test
    yield Value("input.name", report.source_name)
    yield Value("input.sha256", report.source_sha256)
    yield Value("options", report.options)
    yield Section(
        "test",
        [
            *values_of(test, "kind", "cycles", "unidirectional", "cycle", "start", "end"),
            *values_of(test, "time_source", "environment"),
            Value("targets", test.target),
            Value("header", report.header),
            Value("channels", tuple(test.channels)),
        ],
    )


def _figures(report: PositioningReport) -> Section:
    result, limits = report.iso230_2, report.limits
    unit = report.test.kind.units.deviation
    values, table = figures_by_key(result), figure_table(report)
    rows = [
        [
            Value("", cell, label)
            for cell, label in zip(row, table.labels, strict=True)
            if label != "figure"
        ]
        for row in table.cells
    ]
    parts: list[Part] = [
        Value("edition", str(result.edition)),
        *(Value(key, value) for key, value in values.items()),
        Table(f"{edition_name(result.edition)}, {unit}", rows, words=1),
    ]
    absent = {row.absent: None for row in table.rows if row.absent}
    parts += [f"absent: {why}" for why in absent]
    if limits is not None:
        parts.append(limits.limits.decision_rule.in_words)
    parts += map(sentence_of, (*table.legend, *table.notes))
    title = f"Targets, {unit}"
    targets = _targets(report.test, result, report.figure_decimals)
    return Section("iso230_2", [*parts, Table(title, targets, key="targets")])


def _targets(test: PositioningTest, result: Iso230_2Figures, decimals: int) -> list[list[Value]]:
    signed, plain, finer = f"+.{decimals}f", f".{decimals}f", f".{decimals + 1}f"
    return rows_of(
        Value("position", test.target, test.kind.units.position, ".3f"),
        Value("mean_forward", result.mean[:, FORWARD], "mean ↑", signed),
        Value("mean_backward", result.mean[:, BACKWARD], "mean ↓", signed),
        Value("mean", result.mean_bidirectional, "mean", signed),
        Value("s_forward", result.s[:, FORWARD], "s ↑", finer),
        Value("s_backward", result.s[:, BACKWARD], "s ↓", finer),
        Value("B", result.B_i, "B", signed),
        Value("R_forward", result.R_i_unidirectional[:, FORWARD], "R ↑", plain),
        Value("R_backward", result.R_i_unidirectional[:, BACKWARD], "R ↓", plain),
        Value("R", result.R_i, "R", plain),
    )


def _limits(report: PositioningReport) -> Part:
    check = report.limits
    if check is None:
        return Value("limits", None)
    return Section(
        "limits",
        [
            Value("verdict", str(check.verdict)),
            Value("decision_rule", str(check.limits.decision_rule)),
            Value("reservation", check.reservation and sentence_of(check.reservation)),
            Value("reservation_code", check.reservation and value_as_json(check.reservation)),
        ],
    )


def _figure_table(report: PositioningReport) -> Table:
    """Return the one table of figures as objects; its text stands with the standard's figures."""
    rows = figure_table(report).rows
    return Table(
        "",
        [[Value("figure", row.key), *values_of(row, *_OF_FIGURES)] for row in rows],
        key="figure_table",
    )


def _other(
    test: PositioningTest, result: Iso230_2_1988Result | Vdi3441Result | None, decimals: int
) -> Iterator[Part]:
    yield Value("iso230_2_1988", result if isinstance(result, Iso230_2_1988Result) else None)
    yield Value("vdi3441", result if isinstance(result, Vdi3441Result) else None)
    if result is None:
        return
    rows = [
        [
            Value("", OTHER_NAMES[key][0], ""),
            Value("", OTHER_NAMES[key][1], "figure"),
            Value("", getattr(result, key), test.kind.units.deviation, f".{decimals}f"),
        ]
        for key in type(result).__slots__
        if key != "mark"
    ]
    yield Table(f"{other_standard_name(result)} ({result.mark})", rows, words=2)


# ---- drift and uncertainty ----------------------------------------------------------------------


def _drift(report: PositioningReport) -> Part:
    drift, uncertainty = report.drift, report.uncertainty
    if drift is None:
        return Value("drift", None)
    decimals = report.figure_decimals
    free = None if uncertainty is None else uncertainty.drift_free
    figures = figures_by_key(drift.figures)
    targets = _targets(report.test, drift.figures, decimals)
    free_figures: list[Part] = [
        *(Value(key, figures[key]) for key in FIGURE_KEYS),
        Value("targets", [as_json(row) for row in targets]),
    ]
    return Section(
        "drift",
        [
            *_state_and_noise(report.test, drift),
            *values_of(drift, "model", "significant", "p_no_drift", "residual_std"),
            *values_of(drift, "effective_parameters", "total", "total_within", "total_per_m"),
            *values_of(drift, "total_per_m_within", "coverage_factor", "reference_time_s"),
            *values_of(drift, "outliers", "suspects"),
            Value("changes", [_change(change, report.test) for change in drift.changes]),
            Value("noise_std_forward", drift.noise_std[FORWARD]),
            Value("noise_std_backward", drift.noise_std[BACKWARD]),
            Value("levels_forward", drift.level[:, FORWARD]),
            Value("levels_backward", drift.level[:, BACKWARD]),
            Value("levels_std_forward", drift.level_std[:, FORWARD]),
            Value("levels_std_backward", drift.level_std[:, BACKWARD]),
            Section("iso230_2", free_figures),
            Value("uncertainty", None if free is None else _by_figure(free.expanded_uncertainty)),
            Value("diagnosis", [*map(_finding, report.diagnosis)]),
        ],
    )


def _change(change: Change, test: PositioningTest) -> dict[str, object]:
    unit = test.kind.units.deviation_suffix
    return {
        "time_s": change.time_s,
        "cycle": change.cycle,
        f"size_{unit}": change.size,
        f"std_{unit}": change.std,
        "kind": str(change.kind),
    }


def _by_figure(values: Mapping[str, float]) -> dict[str, float | None]:
    return {key: values.get(key) for key in FIGURE_KEYS}


def _state_and_noise(test: PositioningTest, drift: DriftResult) -> Iterator[str]:
    unit = test.kind.units.deviation
    if drift.reference_time_s is not None:
        yield f"drift-free: in the thermal state at {drift.reference_time_s / 3600.0:.2f} h"
    noise = ", ".join(
        f"{arrow} {value:.3g}"
        for arrow, value in zip("↑↓", drift.noise_std.tolist(), strict=True)
        if np.isfinite(value)
    )
    yield f"noise {noise} {unit}; residual standard deviation {drift.residual_std:.3g} {unit}"


def _uncertainty(report: PositioningReport) -> Part:
    result, budget = report.uncertainty, budget_table(report)
    if result is None:
        return Value("uncertainty", None)
    parts: list[Part] = [Value("label", result.label)]
    if budget is not None:
        rows = [
            [Value("", cell, label) for cell, label in zip(row, budget.labels, strict=True)]
            for row in budget.cells
        ]
        parts.append(Table("Uncertainty budget (GUM) of the figures as measured", rows, words=4))
    doubts = doubts_of_u(report)
    parts.append(Value("may_be_too_small", tuple(map(sentence_of, doubts))))
    parts.append(Value("may_be_too_small_codes", tuple(map(value_as_json, doubts))))
    parts.append(Value("drift_effect", _by_figure(result.drift_effect)))
    for key, figures in (("measured", result.measured), ("drift_free", result.drift_free)):
        if figures is None:
            parts.append(Value(key, None))
            continue
        contained, lacking = terms_of_u(figures)
        numbers = [Value(name, _by_figure(getattr(figures, name))) for name in _UNCERTAINTIES]
        others = [
            Table("", [values_of(row, *_OF_BUDGET) for row in figures.budget], key="budget"),
            Value("stated", figures.stated),
            Value("contained", tuple(map(sentence_of, contained))),
            Value("contained_codes", tuple(map(value_as_json, contained))),
            Value("left_out", tuple(map(sentence_of, lacking))),
            Value("left_out_codes", tuple(map(value_as_json, lacking))),
        ]
        parts.append(Section(key, [*numbers, *others]))
    return Section("uncertainty", parts)


# ---- adjacent differences -----------------------------------------------------------------------


def _adjacent(
    test: PositioningTest, result: AdjacentDifferenceResult | None, decimals: int
) -> Part:
    if result is None:
        return Value("adjacent_difference", None)
    measured = [
        (arrow, approach)
        for arrow, approach in zip("↑↓", result.approaches, strict=True)
        if approach is not None
    ]
    factor = "none" if result.student_factor is None else f"{result.student_factor:.3f}"
    start = ", ".join(f"{arrow} {a.chart[0]:+.{decimals}f}" for arrow, a in measured)
    return Section(
        "adjacent_difference",
        [
            *values_of(result, "reference_cycle", "reference_position", "student_factor"),
            *(
                Value(name, None)
                if approach is None
                else Section(name, list(_approach(test, approach, arrow, decimals)))
                for name, arrow, approach in zip(APPROACHES, "↑↓", result.approaches, strict=True)
            ),
            (
                "deviation chart anchored at position"
                f" {result.reference_position} in cycle {result.reference_cycle} (position 1:"
                f" {start} {test.kind.units.deviation}), bounds ±{factor} u; u is the standard"
                " uncertainty of the mean difference (6), s its sample standard deviation"
            ),
            *_ratio_and_anomalies(test, result),
        ],
    )


def _approach(
    test: PositioningTest, approach: AdjacentDifferenceApproach, arrow: str, decimals: int
) -> Iterator[Part]:
    units = test.kind.units
    signed, finer = f"+.{decimals}f", f".{decimals + 1}f"
    differences = (
        Value("mean_difference", approach.mean_difference, "mean difference", signed),
        Value("standard_uncertainty", approach.standard_uncertainty, "u", finer),
        Value("standard_deviation", approach.standard_deviation, "s", finer),
        Value("s_ratio", approach.s_ratio, "s of standard / s", ".2f"),
    )
    chart = Value("chart", approach.chart, "chart", signed)
    bound = Value("bound", approach.bound, "± bound", finer)
    rows = rows_of(
        Value("", [f"{i}-{i + 1}" for i in range(1, test.target.size)], "pair"),
        Value("", test.target[:-1], f"from {units.position}", ".3f"),
        Value("", test.target[1:], f"to {units.position}", ".3f"),
        *differences,
        chart._replace(value=approach.chart[1:]),
        bound._replace(value=approach.bound[1:]),
    )
    yield Table(f"Adjacent differences {arrow}, {units.deviation} {_NOT_OF_THE_STANDARD}", rows)
    yield from without_text(*differences, chart, bound)
    yield Value(
        "anomalies",
        [
            {
                "position": anomaly.position,
                "position_mm": anomaly.target,
                "statistic": anomaly.statistic,
                "p_value": anomaly.p_value,
            }
            for anomaly in approach.anomalies
        ],
    )
    yield Value("anomalies_tested", approach.anomalies_tested)


def _ratio_and_anomalies(test: PositioningTest, result: AdjacentDifferenceResult) -> Iterator[str]:
    unit = test.kind.units.position
    for word, approach in zip(APPROACHES, result.approaches, strict=True):
        if approach is None:
            continue
        ratio = approach.s_ratio[np.isfinite(approach.s_ratio)]
        if ratio.size:
            yield (
                f"{word}: the standard's s is {float(np.median(ratio)):.2f} times the s of the"
                " adjacent differences (median)"
            )
        for anomaly in approach.anomalies:
            yield (
                f"{word}: position {anomaly.position} ({anomaly.target:g} {unit}) stands out:"
                f" its spread is {anomaly.statistic:.2f} times that of the others"
            )
        if not approach.anomalies_tested:
            yield f"{word}: not tested which position stands out (5 to 500, 3 cycles or more)"
        elif not approach.anomalies:
            yield f"{word}: no position stands out"
