"""Compare a compensation model in free run with measured logs."""

import argparse
import math
from collections.abc import Sequence
from dataclasses import replace
from itertools import combinations
from pathlib import Path

from thermaxis import __version__, report, thermal
from thermaxis.cli._arguments import (
    add_figures,
    add_json,
    add_report,
    adder,
    count,
    number,
    positive_seconds,
    refuse_alone,
    refuse_both,
)
from thermaxis.cli._json import show
from thermaxis.cli._outputs import check_outputs
from thermaxis.cli._progress import Progress
from thermaxis.cli.thermal._series import add_series, write_run_series
from thermaxis.cli.thermal._thermal_logs import (
    add_log_options,
    add_start,
    logs_of,
    measured_output,
    reading_codes,
    remarks_of,
    rows_of_span,
    sensor_warnings,
    span,
    with_clocks_told,
)
from thermaxis.codes import printable
from thermaxis.compensation import Limits
from thermaxis.errors import ConfigurationError, require_known
from thermaxis.files import model_sha256, read_correction_limits, read_model
from thermaxis.messages import text_of
from thermaxis.report.tables import Part, Section, Table, Value, as_json, messages_of, without_text

_EXPLAINED = (
    "p-p: range of the measured displacement; left: of measured minus simulated (free run)."
    " persist.: RMSE of 'nothing changes from row to row', one step ahead; static: RMSE of the"
    " static regression that the model carries from its training, or else of one fitted to this"
    " very log. All in um."
)

_RULES = {
    "nothing": "nothing", "probe_and_hold": "probe and hold",
    "free_run": "model alone", "with_offset": "model and offset",
}  # fmt: skip
_LIMITED = "With the correction within its limits, begun at rest as the machine begins"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of the command."""
    add = adder(parser)
    add("model MODEL", "compensation model (JSON)", Path)
    add("logs LOG", "independent tests: CSV, Parquet, .xlsx, .mat or .tdms", Path, nargs="+")
    add(
        "--measured CHANNEL[=OUTPUT[@MM]]",
        "measured channel, the model's output it is compared with, and the workpiece"
        " diameter: Z_D3000_um=Z_um@3000; may be given more than once (default: channels"
        " named as the outputs, at the tool centre point)",
        measured_output,
        action="append",
    )
    add(
        "--span A:B",
        "rows (0:6669) or times (0:8h) that count in the figures; the free run begins at the"
        " first row all the same",
        span,
    )
    add_start(parser, spans=True)
    add(
        "--limits FILE",
        "limits of the correction by output (TOML: [Z_um] with largest_um and"
        " largest_rate_um_per_s); the figures with the correction within them stand beside"
        " the others",
        Path,
    )
    add(
        "--touch-every TIME",
        "touch the measured displacement with the machine's probe so often, and print what that is"
        " worth: model alone, with an offset that each touch renews, probe and hold, nothing",
        positive_seconds,
    )
    add(
        "--touch-within-um UM",
        "the same, touched only when the standard uncertainty of the tool point has grown beyond"
        " that",
        number("standard uncertainty from 0.01 to 1000 um", 0.01, 1000.0),
    )
    add(
        "--touches CHANNEL[=OUTPUT]",
        "the same with touches that the log holds, a column that is mostly empty; may be given"
        " more than once",
        measured_output,
        action="append",
    )
    add(
        "--touch-noise-um UM",
        "standard deviation of a touch, added to what is measured (default: 1)",
        number("noise from 0.01 to 1000 um", 0.01, 1000.0),
    )
    add(
        "--touch-drift-um UM",
        "standard deviation by which the offset drifts in an hour (default: 2; the likeliest is"
        " printed)",
        number("drift from 0.01 to 1000 um", 0.01, 1000.0),
    )
    add(
        "--touch-discrepancy-um UM",
        "standard deviation of what the model leaves anew at every touch (default: 0; the likeliest"
        " is printed)",
        number("discrepancy from 0 to 1000 um", 0.0, 1000.0),
    )
    add(
        "--tolerance-um UM",
        "errors beyond that are counted (default: 5)",
        number("tolerance in um", 0.0, 1e6),
    )
    add("--seed N", "where the noise of the touches begins (default: 0)", count("number", 0))
    add_json(parser)
    add_series(parser)
    add_report(parser)
    add_figures(parser)
    add_log_options(parser)


def run(arguments: argparse.Namespace) -> int:
    """Verify, show and write."""
    for one, other in combinations(("--touch-every", "--touches", "--touch-within-um"), 2):
        refuse_both(arguments, one, other)
    if arguments.touches is None and arguments.touch_within_um is None:
        refuse_alone(
            arguments,
            "--touch-every",
            *("--touch-noise-um", "--touch-drift-um", "--touch-discrepancy-um"),
            *("--tolerance-um", "--seed"),
        )
    check_outputs(
        [
            ("--json", arguments.json),
            ("--series", arguments.series),
            *(("--report", path) for path in arguments.report),
        ],
        [arguments.model, *arguments.logs, arguments.mapping, arguments.limits],
        charts=arguments.figures,
    )
    with Progress() as progress:
        progress("reading", 0, 0)
        model = read_model(arguments.model)
        limits = _limits(arguments.limits, [output.name for output in model.outputs])
        logs = logs_of(arguments, arguments.logs)
        logs = with_clocks_told(logs, [model], arguments.measured, arguments.reference)
        progress("simulating", 0, 0)
        rows = None if arguments.span is None else rows_of_span(logs, arguments.span)
        result = thermal.verify(
            model,
            logs,
            arguments.measured,
            reference_s=arguments.reference,
            rows=rows,
            limits=limits,
            start=arguments.start,
            touches=_touches(arguments, [output.name for output in model.outputs]),
        )
        written = [*arguments.report]
        if arguments.series is not None:
            write_run_series([run for log in result.logs for run in log.outputs], arguments.series)
            written.append(arguments.series)
        if arguments.report or arguments.figures is not None:
            progress("report", 0, 0)
        if arguments.report:
            report.write_verification_report(model, logs, result, *arguments.report)
        if arguments.figures is not None:
            report.write_verification_figures(model, logs, result, arguments.figures)
            written.append(arguments.figures)
    remarks = (*remarks_of(logs), *sensor_warnings(logs, model.channels))
    counted = "" if arguments.span is None else f", {arguments.span.text}"
    title = f"Verification of {printable(arguments.model.name, 60)}{counted}"
    shown = described(result, title, model_sha256(model), remarks)
    first = remarks_of(logs, assumed=True)
    show([*first, *shown, reading_codes(logs)], arguments.json, written)
    return 0


def _touches(arguments: argparse.Namespace, outputs: list[str]) -> thermal.TouchPlan | None:
    """Return how the log is touched, None where it is not."""
    if not (arguments.touch_every or arguments.touch_within_um or arguments.touches):
        return None
    channels = {entry.output: entry.channel for entry in arguments.touches or ()}
    require_known("--touches", channels, outputs)
    plan = thermal.TouchPlan(
        every_s=arguments.touch_every, within_um=arguments.touch_within_um, channels=channels
    )
    rules = {
        "noise_um": arguments.touch_noise_um,
        "drift_um_per_root_h": arguments.touch_drift_um,
        "discrepancy_um": arguments.touch_discrepancy_um,
    }  # fmt: skip
    others = {"tolerance_um": arguments.tolerance_um, "seed": arguments.seed}
    return replace(
        plan,
        rules=replace(plan.rules, **{k: v for k, v in rules.items() if v is not None}),
        **{k: v for k, v in others.items() if v is not None},
    )


def _limits(path: Path | None, outputs: list[str]) -> dict[str, Limits]:
    """Return the limits by output; each must be one of the model."""
    if path is None:
        return {}
    limits = read_correction_limits(path)
    for name in limits:
        if name not in outputs:
            raise ConfigurationError(
                "unknown_name", file=path, key=name, name=name, known=", ".join(outputs)
            )
    return limits


def figures_of(figures: thermal.VerificationFigures) -> list[Value]:
    """Return the figures of one output as a row of a table."""
    after = figures.after_60_min_um
    there, left = after or (None, None)
    return [
        Value("rows", figures.rows),
        Value("fit_percent", figures.fit_percent, "fit %", ".1f"),
        Value("peak_to_peak_um.uncompensated", figures.uncompensated_um, "p-p um", ".2f"),
        Value("peak_to_peak_um.residual", figures.residual_um, "left um", ".2f"),
        Value("peak_to_peak_um.reduction", figures.reduction),
        Value("", f"{r:.1f}" if (r := figures.reduction) < 1e4 else "> 9999", "-fold"),
        Value("rmse_um", figures.rmse_um, "RMSE", ".2f"),
        Value("mae_um", figures.mae_um, "MAE", ".2f"),
        Value("max_um", figures.max_um, "max", ".2f"),
        Value("", there, "60 min", ".2f"),
        Value("", left, "left", ".2f"),
        Value("after_60_min_um", None if after is None else _pair(after)),
        Value("at_end_um.uncompensated", figures.at_end_um[0], "end", ".2f"),
        Value("at_end_um.residual", figures.at_end_um[1], "left", ".2f"),
        Value("persistence_rmse_um", figures.persistence_rmse_um, "persist.", ".2f"),
        Value("static_rmse_um", figures.static_rmse_um, "static", ".2f"),
    ]


def _pair(values: tuple[float, float]) -> dict[str, float]:
    return {"uncompensated": values[0], "residual": values[1]}


def _row(name: str, figures: thermal.VerificationFigures) -> list[Value]:
    return [Value("", name[:40], "output"), *figures_of(figures)]


def described(
    result: thermal.Verification, title: str, model_hash: str, remarks: Sequence[str] = ()
) -> list[Part]:
    """Return a verification for terminal and JSON."""
    logs, pooled = result.logs, result.pooled
    etve = _etve(logs[0]) if len(logs) == 1 else ", all logs"
    rows = [_row(name, figures) for name, figures in pooled.items()]
    folds = [figures.reduction for figures in pooled.values()]
    fit = result.mean_fit_percent
    mean = (
        f"mean fit {'–' if fit is None else f'{fit:.1f} %'}, peak-to-peak reduced"
        f" {min(folds):.1f} to {max(folds):.1f}-fold"
    )
    return [
        Value("version", __version__),
        Value("model_sha256", model_hash),
        *(_log_table(log) for log in logs if len(logs) > 1),
        Table(f"{title}{etve}", rows, key="outputs", names=list(pooled), words=1),
        *([mean] if len(pooled) > 1 else []),
        Value("mean_fit_percent", result.mean_fit_percent),
        Table(_LIMITED, list(_limited(result)), words=1),
        *_touched(result),
        Section("", [_EXPLAINED]),
        *messages_of("left_over", thermal.left_over_messages(result), "left over"),
        Value("logs", [as_json(_log(log)) for log in logs]),
        Value("", remarks, "reading"),
        Value("", [*map(text_of, result.warnings)], "warning"),
        *messages_of("warnings", result.warnings, before=remarks),
    ]


def _log_table(log: thermal.VerifiedLog) -> Table:
    rows = [_row(output.measured.name, output.figures) for output in log.outputs]
    return Table(f"{log.name[:60]}{_etve(log)}", rows, words=1)


def _limited(result: thermal.Verification) -> list[list[Value]]:
    several = len(result.logs) > 1
    return [
        _row(f"{o.measured.name} ({log.name})" if several else o.measured.name, o.limited)
        for log in result.logs
        for o in log.outputs
        if o.limited is not None
    ]


def _touched(result: thermal.Verification) -> list[Part]:
    """Return what touches are worth, as two tables and for JSON."""
    several = len(result.logs) > 1
    found = {
        f"{o.measured.name} ({log.name})" if several else o.measured.name: o.touched
        for log in result.logs
        for o in log.outputs
        if o.touched is not None
    }
    if not found:
        return [Value("touches", None)]
    errors = [
        [
            Value("", name[:40], "output"),
            Value("", words, "corrected by"),
            Value("", (error := getattr(figures, rule)).mae_um, "MAE", ".2f"),
            Value("", error.rmse_um, "RMSE", ".2f"),
            Value("", error.max_um, "max", ".2f"),
            Value("", 100.0 * error.beyond_share, "beyond %", ".1f"),
        ]
        for name, figures in found.items()
        for rule, words in _RULES.items()
    ]
    touches = [
        [
            Value("", name[:40], "output"),
            Value("touches", f.touches, "touches"),
            Value("excluded", f.excluded, "excluded"),
            Value("untimely", f.untimely, "untimely"),
            Value("off", f.off is not None),
            Value("", "off" if f.off else "on", "offset"),
            Value("within_two_sigma", f.within_two_sigma, "in 2 sigma", ".2f"),
            Value(
                "likely_drift_um_per_root_h",
                f.likely and f.likely.drift_um_per_root_h,
                *("drift um/√h", ".2f"),
            ),
            Value(
                "likely_discrepancy_um", f.likely and f.likely.discrepancy_um, "discrepancy", ".2f"
            ),
            Value("wanted_um", f.wanted_um),
            Value("interval_s", s if 0.0 < (s := f.interval_s or 0.0) < math.inf else None),
            *(
                Value(f"{rule}_{field}", getattr(getattr(f, rule), field))
                for rule in _RULES
                for field in ("mae_um", "rmse_um", "max_um", "beyond_share")
            ),
        ]
        for name, f in found.items()
    ]
    means = [
        f"{words} {sum(getattr(f, rule).mae_um for f in found.values()) / len(found):.2f}"
        for rule, words in _RULES.items()
    ]
    return [
        Table("What touches of a probe are worth, um", errors, words=2),
        *([f"mean MAE: {', '.join(means)} um"] if len(found) > 1 else []),
        Table(
            "Touches: innovations within two sigma, drift and discrepancy that make them likeliest",
            touches,
            key="touches",
            names=list(found),
            words=1,
        ),
        *(f"{name}: {_interval(f)}" for name, f in found.items() if f.interval_s is not None),
    ]


def _interval(figures: thermal.TouchFigures) -> str:
    """Return how often to touch, in words, by the likeliest rules and by those that were used."""
    each = (figures.interval_s or 0.0, thermal.touch_interval_s(figures.rules, figures.wanted_um))
    likely, used = (_often(s) for s in each)
    longer = " or less often" if each[0] == figures.told_s else ""
    rules = figures.rules
    return (
        f"for a standard uncertainty of at most {figures.wanted_um:g} um {likely}{longer} by the"
        f" likeliest drift and discrepancy; {used} by those that were used,"
        f" {rules.drift_um_per_root_h:g} and {rules.discrepancy_um:g}"
    )


def _often(interval_s: float) -> str:
    if interval_s < 60.0:
        return "no touches are enough (what the model leaves anew at each is more)"
    if interval_s == math.inf:
        return "no touches are needed"
    hours = interval_s / 3600.0
    return f"touch every {f'{hours:.0f} h' if hours >= 10.0 else f'{60.0 * hours:.0f} min'}"


def _etve(log: thermal.VerifiedLog) -> str:
    return " (nothing turned: ranges are ETVE, ISO 230-3)" if log.environmental else ""


def _log(log: thermal.VerifiedLog) -> list[Part]:
    outputs = [_output(output) for output in log.outputs]
    return [
        Value("name", log.name),
        Value("environmental_test", log.environmental),
        Table("", outputs, key="outputs", names=[o.measured.name for o in log.outputs]),
        Value(
            "outside_training_range",
            {
                name: {"share_of_rows": share, "beyond_share_of_range": beyond}
                for name, (share, beyond) in log.outside.items()
            },
        ),
        *messages_of("warnings", log.warnings),
    ]


def _output(output: thermal.VerifiedOutput) -> list[Value]:
    ranges: dict[str, float] = {}
    for name, values in zip(output.parts, output.contribution_um.T.tolist(), strict=True):
        known = [v for v in values if v == v]  # noqa: PLR0124 - without NaN
        ranges[name] = max(known) - min(known) if known else 0.0
    limited = None if output.limited is None else as_json(figures_of(output.limited))
    return without_text(
        *figures_of(output.figures),
        Value("model_output", output.measured.output),
        Value("diameter_mm", output.measured.diameter_mm),
        Value("start", str(output.start.start)),
        Value("start_zero_um", output.start.zero_um),
        Value("start_rows", output.start_rows),
        Value("limited", limited),
        Value("contribution_peak_to_peak_um", ranges),
    )
