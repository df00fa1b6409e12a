"""The evaluation of a positioning run, described once; its keys stand in docs/json.md."""

import hashlib
import json
from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from thermaxis.codes import value_as_json
from thermaxis.messages import sentence_of
from thermaxis.positioning import (
    APPROACHES,
    BACKWARD,
    FIGURE_KEYS,
    FORWARD,
    AdjacentDifferenceApproach,
    AdjacentDifferenceResult,
    DriftResult,
    FigureUncertainty,
    Finding,
    Iso230_2_1988Result,
    Iso230_2Figures,
    PositioningTest,
    Vdi3441Result,
    figures_by_key,
)
from thermaxis.report._names import (
    FIGURE_NAMES,
    FIGURE_SYMBOLS,
    OTHER_NAMES,
    absence_reason,
    edition_name,
    other_standard_name,
)
from thermaxis.report._positioning_report import PositioningReport
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
_UNCERTAINTIES = ("expanded_uncertainty", "bias", "standard_uncertainty", "closed_form")


def describe_evaluation(report: PositioningReport) -> list[Part]:
    """Return everything that was evaluated: the standard's figures first, the others after them.

    Parameters
    ----------
    report : PositioningReport
        The run with what was evaluated of it.

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
        _limits(report),
        *_other(report.test, other, report.figure_decimals),
        _adjacent(report.test, report.adjacent_difference, report.figure_decimals),
        _drift(report),
        *([] if report.drift or uncertainty is None else _uncertainty_alone(report)),
        Value("uncertainty", None) if uncertainty is None else _uncertainty(report),
        *(["plan: the run follows it"] if differences == () else []),
        Value("plan_differences", differences and tuple(map(sentence_of, differences))),
        Value("plan_difference_codes", differences and tuple(map(value_as_json, differences))),
        Section("", _diagnosis(report.diagnosis)),
        Section("", messages_of("warnings", report.warnings, "warning", say=sentence_of)),
    ]


def results_json(report: PositioningReport) -> bytes:
    """Return the results of a run as JSON that depends on them alone.

    Parameters
    ----------
    report : PositioningReport
        The run with what was evaluated of it.

    Returns
    -------
    bytes
        What ``thermaxis evaluate --json`` writes, as one line of ASCII: keys in alphabetical
        order, no blanks.
    """
    content = as_json(describe_evaluation(report))
    plain = json.dumps(content, sort_keys=True, separators=(",", ":"), allow_nan=False)
    return plain.encode("ascii")


def results_sha256(report: PositioningReport) -> str:
    """Return the SHA-256 of the results of a run, which every form of its certificate bears.

    Parameters
    ----------
    report : PositioningReport
        The run with what was evaluated of it.

    Returns
    -------
    str
        Hash of `results_json`: 64 hexadecimal digits.
    """
    return hashlib.sha256(results_json(report)).hexdigest()


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
    rows: list[list[Value]] = []
    values = figures_by_key(result)
    for key, value in values.items():
        name = FIGURE_NAMES[result.edition][key]
        if value is None:
            name += f" (absent: {absence_reason(key, result, report.test)})"
        row = [Value("", FIGURE_SYMBOLS[key], ""), Value("", name, "figure")]
        row.append(Value("", value, unit, _figure_form(key, report.figure_decimals)))
        if limits is not None:
            check = limits.of(key)
            row.append(Value("", "" if check is None else f"{check.limit:g}", "limit"))
            row.append(Value("", "" if check is None else str(check.verdict), "verdict"))
        rows.append(row)
    parts: list[Part] = [
        Value("edition", str(result.edition)),
        *(Value(key, value) for key, value in values.items()),
        Table(edition_name(result.edition), rows, words=2),
    ]
    if limits is not None:
        parts.append(limits.limits.decision_rule.in_words)
    title = f"Targets, {unit}"
    targets = _targets(report.test, result, report.figure_decimals)
    return Section("iso230_2", [*parts, Table(title, targets, key="targets")])


def _figure_form(key: str, decimals: int) -> str:
    return f"{'+' if key == 'B_mean' else ''}.{decimals}f"


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
    figures = [
        {"figure": figure.key}
        | as_json(values_of(figure, "value", "limit", "expanded_uncertainty", "verdict"))
        for figure in check.figures
    ]
    return Section(
        "limits",
        [
            Value("verdict", str(check.verdict)),
            Value("decision_rule", str(check.limits.decision_rule)),
            Value("figures", figures),
        ],
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
    drift, uncertainty, unit = report.drift, report.uncertainty, report.test.kind.units.deviation
    if drift is None:
        return Value("drift", None)
    decimals = report.figure_decimals
    measured = None if uncertainty is None else uncertainty.measured
    free = None if uncertainty is None else uncertainty.drift_free
    as_measured, figures = figures_by_key(report.iso230_2), figures_by_key(drift.figures)
    rows = [
        [
            Value("", FIGURE_SYMBOLS[key], ""),
            Value("", as_measured[key], "measured", _figure_form(key, decimals)),
            Value("", _expanded(measured, key), "U (k = 2)", f".{decimals}f"),
            Value("", figures[key], "drift-free", _figure_form(key, decimals)),
            Value("", _expanded(free, key), "U (k = 2)", f".{decimals}f"),
        ]
        for key in FIGURE_KEYS
    ]
    targets = _targets(report.test, drift.figures, decimals)
    free_figures: list[Part] = [
        *(Value(key, figures[key]) for key in FIGURE_KEYS),
        Value("targets", [as_json(row) for row in targets]),
    ]
    return Section(
        "drift",
        [
            Table(f"Drift eliminated, {unit} {_NOT_OF_THE_STANDARD}", rows, words=1),
            *_state_and_noise(report.test, drift),
            *_left_out(free),
            *values_of(drift, "model", "significant", "p_no_drift", "residual_std"),
            *values_of(drift, "effective_parameters", "total", "total_within", "total_per_m"),
            *values_of(drift, "total_per_m_within", "reference_time_s", "outliers", "suspects"),
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


def _expanded(figures: FigureUncertainty | None, key: str) -> float | None:
    return None if figures is None else figures.expanded_uncertainty.get(key)


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


def _left_out(figures: FigureUncertainty | None) -> list[str]:
    if figures is None or not figures.left_out:
        return []
    return [f"U by Monte Carlo (GUM), without: {'; '.join(map(sentence_of, figures.left_out))}"]


def _uncertainty_alone(report: PositioningReport) -> Iterator[Part]:
    """Return the uncertainties where no drift was asked for, in whose table they stand."""
    if report.uncertainty is None:
        return
    measured, form = report.uncertainty.measured, f".{report.figure_decimals}f"
    rows = [
        [Value("", FIGURE_SYMBOLS[key], ""), Value("", _expanded(measured, key), "U (k = 2)", form)]
        for key in FIGURE_KEYS
    ]
    title = f"Uncertainty of the figures, {report.test.kind.units.deviation}"
    yield Table(title, rows, words=1)
    yield from _left_out(measured)


def _uncertainty(report: PositioningReport) -> Part:
    result = report.uncertainty
    if result is None:
        return Value("uncertainty", None)
    parts: list[Part] = [Value("label", result.label)]
    for key, figures in (("measured", result.measured), ("drift_free", result.drift_free)):
        if figures is None:
            parts.append(Value(key, None))
            continue
        numbers = [Value(name, _by_figure(getattr(figures, name))) for name in _UNCERTAINTIES]
        others = [
            *values_of(figures, "closed_form_mark", "included"),
            Value("left_out", tuple(map(sentence_of, figures.left_out))),
            Value("left_out_codes", tuple(map(value_as_json, figures.left_out))),
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
