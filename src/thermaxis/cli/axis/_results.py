"""The results of ``evaluate`` as JSON; its keys are documented in docs/json.md."""

import math
from collections.abc import Iterable
from dataclasses import asdict

from thermaxis.positioning import (
    BACKWARD,
    FIGURE_KEYS,
    FORWARD,
    AdjacentDifferenceApproach,
    AdjacentDifferenceResult,
    FigureUncertainty,
    FloatArray,
    Iso230_2_1988Result,
    Iso230_2Figures,
    Iso230_2Result,
    PositioningTest,
    UncertaintyResult,
    Vdi3441Result,
    figures_by_key,
)
from thermaxis.report import PositioningReport


def finite_or_none(value: float | None) -> float | None:
    """Return a number for JSON: None where it does not exist."""
    return None if value is None or not math.isfinite(value) else float(value)


def _numbers(values: Iterable[float]) -> list[float | None]:
    return [finite_or_none(value) for value in values]


def report_as_json(report: PositioningReport) -> dict[str, object]:
    """Return everything that was evaluated, by the documented keys."""
    other = report.other_standard
    return {
        "version": report.version,
        "input": {"name": report.source_name, "sha256": report.source_sha256},
        "test": _test(report.test, dict(report.header)),
        "iso230_2": _iso230_2(report.iso230_2),
        "iso230_2_1988": asdict(other) if isinstance(other, Iso230_2_1988Result) else None,
        "vdi3441": asdict(other) if isinstance(other, Vdi3441Result) else None,
        "adjacent_difference": _adjacent_difference(report.adjacent_difference),
        "drift": _drift(report),
        "uncertainty": _uncertainty(report.uncertainty),
        "limits": _limits(report),
        "plan_differences": (
            None if report.plan_differences is None else list(report.plan_differences)
        ),
        "warnings": list(report.warnings),
    }


def _test(test: PositioningTest, header: dict[str, str]) -> dict[str, object]:
    return {
        "kind": str(test.kind),
        "targets": _numbers(test.target.tolist()),
        "cycles": test.cycles,
        "unidirectional": test.unidirectional,
        "cycle": str(test.cycle),
        "start": test.start.isoformat() if test.start else None,
        "end": test.end.isoformat() if test.end else None,
        "time_source": str(test.time_source),
        "header": header,
        "environment": {key: asdict(value) for key, value in test.environment.items()},
        "channels": list(test.channels),
    }


def _iso230_2(result: Iso230_2Result) -> dict[str, object]:
    targets = _targets(result.target, result)
    return {"edition": str(result.edition), **figures_by_key(result), "targets": targets}


def _targets(target: FloatArray, result: Iso230_2Figures) -> list[dict[str, float | None]]:
    columns = {
        "position": target,
        "mean_forward": result.mean[:, FORWARD],
        "mean_backward": result.mean[:, BACKWARD],
        "mean": result.mean_bidirectional,
        "s_forward": result.s[:, FORWARD],
        "s_backward": result.s[:, BACKWARD],
        "B": result.B_i,
        "R_forward": result.R_i_unidirectional[:, FORWARD],
        "R_backward": result.R_i_unidirectional[:, BACKWARD],
        "R": result.R_i,
    }
    rows = zip(*(_numbers(column.tolist()) for column in columns.values()), strict=True)
    return [dict(zip(columns, row, strict=True)) for row in rows]


def _adjacent_difference(result: AdjacentDifferenceResult | None) -> dict[str, object] | None:
    if result is None:
        return None
    return {
        "reference_cycle": result.reference_cycle,
        "reference_position": result.reference_position,
        "student_factor": result.student_factor,
        "forward": _approach(result.forward),
        "backward": _approach(result.backward),
    }


def _approach(approach: AdjacentDifferenceApproach | None) -> dict[str, object] | None:
    if approach is None:
        return None
    return {
        "mean_difference": _numbers(approach.mean_difference.tolist()),
        "standard_uncertainty": _numbers(approach.standard_uncertainty.tolist()),
        "standard_deviation": _numbers(approach.standard_deviation.tolist()),
        "s_ratio": _numbers(approach.s_ratio.tolist()),
        "chart": _numbers(approach.chart.tolist()),
        "bound": _numbers(approach.bound.tolist()),
        "anomalies": [
            {
                "position": anomaly.position,
                "position_mm": anomaly.target,
                "statistic": finite_or_none(anomaly.statistic),
                "p_value": anomaly.p_value,
            }
            for anomaly in approach.anomalies
        ],
        "anomalies_tested": approach.anomalies_tested,
    }


def _drift(report: PositioningReport) -> dict[str, object] | None:
    drift, uncertainty = report.drift, report.uncertainty
    if drift is None:
        return None
    figures = figures_by_key(drift.figures)
    free = None if uncertainty is None else uncertainty.drift_free
    return {
        "model": str(drift.model),
        "significant": drift.significant,
        "p_no_drift": drift.p_no_drift,
        "noise_std_forward": finite_or_none(float(drift.noise_std[FORWARD])),
        "noise_std_backward": finite_or_none(float(drift.noise_std[BACKWARD])),
        "residual_std": finite_or_none(drift.residual_std),
        "effective_parameters": drift.effective_parameters,
        "total": drift.total,
        "total_within": drift.total_within,
        "total_per_m": drift.total_per_m,
        "total_per_m_within": drift.total_per_m_within,
        "reference_time_s": drift.reference_time_s,
        "levels_forward": _numbers(drift.level[:, FORWARD].tolist()),
        "levels_backward": _numbers(drift.level[:, BACKWARD].tolist()),
        "levels_std_forward": _numbers(drift.level_std[:, FORWARD].tolist()),
        "levels_std_backward": _numbers(drift.level_std[:, BACKWARD].tolist()),
        "iso230_2": {
            **{key: finite_or_none(figures[key]) for key in FIGURE_KEYS},
            "targets": _targets(report.test.target, drift.figures),
        },
        "uncertainty": None if free is None else _figure_uncertainty(free)["expanded_uncertainty"],
        "diagnosis": [asdict(finding) for finding in report.diagnosis],
        "outliers": [asdict(outlier) for outlier in drift.outliers],
        "suspects": list(drift.suspects),
    }


def _uncertainty(uncertainty: UncertaintyResult | None) -> dict[str, object] | None:
    if uncertainty is None:
        return None
    free = uncertainty.drift_free
    return {
        "label": uncertainty.label,
        "measured": _figure_uncertainty(uncertainty.measured),
        "drift_free": None if free is None else _figure_uncertainty(free),
    }


def _figure_uncertainty(figures: FigureUncertainty) -> dict[str, object]:
    return {
        "expanded_uncertainty": {
            key: finite_or_none(figures.expanded_uncertainty.get(key)) for key in FIGURE_KEYS
        },
        "bias": {key: finite_or_none(figures.bias.get(key)) for key in FIGURE_KEYS},
        "standard_uncertainty": {
            key: finite_or_none(figures.standard_uncertainty.get(key)) for key in FIGURE_KEYS
        },
        "closed_form": {key: finite_or_none(figures.closed_form.get(key)) for key in FIGURE_KEYS},
        "closed_form_mark": dict(figures.closed_form_mark),
        "included": list(figures.included),
        "left_out": list(figures.left_out),
    }


def _limits(report: PositioningReport) -> dict[str, object] | None:
    check = report.limits
    if check is None:
        return None
    return {
        "verdict": str(check.verdict),
        "decision_rule": str(check.limits.decision_rule),
        "figures": [
            {
                "figure": figure.key,
                "value": finite_or_none(figure.value),
                "limit": figure.limit,
                "expanded_uncertainty": figure.expanded_uncertainty,
                "verdict": str(figure.verdict),
            }
            for figure in check.figures
        ],
    }
