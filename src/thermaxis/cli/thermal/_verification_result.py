"""A verification, described once for terminal and JSON."""

from collections.abc import Sequence

from thermaxis import __version__
from thermaxis.codes import message_as_json
from thermaxis.messages import text_of
from thermaxis.report.tables import Part, Section, Table, Value, as_json, without_text
from thermaxis.thermal import Verification, VerificationFigures, VerifiedLog, VerifiedOutput

_EXPLAINED = (
    "p-p: range of the measured displacement; left: of measured minus simulated (free run)."
    " persist.: RMSE of 'nothing changes from row to row', one step ahead; static: RMSE of the"
    " static regression that the model carries from its training, or else of one fitted to this"
    " very log. All in um."
)


def figures_of(figures: VerificationFigures) -> list[Value]:
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


def _row(name: str, figures: VerificationFigures) -> list[Value]:
    return [Value("", name[:40], "output"), *figures_of(figures)]


def described(
    result: Verification, title: str, model_hash: str, remarks: Sequence[str] = ()
) -> list[Part]:
    """Return a verification for terminal and JSON."""
    logs, pooled = result.logs, result.pooled
    etve = _etve(logs[0]) if len(logs) == 1 else ", all logs"
    rows = [_row(name, figures) for name, figures in pooled.items()]
    folds = [figures.reduction for figures in pooled.values()]
    mean = (
        f"mean fit {result.mean_fit_percent:.1f} %, peak-to-peak reduced {min(folds):.1f} to"
        f" {max(folds):.1f}-fold"
    )
    return [
        Value("version", __version__),
        Value("model_sha256", model_hash),
        *(_log_table(log) for log in logs if len(logs) > 1),
        Table(f"{title}{etve}", rows, key="outputs", names=list(pooled), words=1),
        *([mean] if len(pooled) > 1 else []),
        Value("mean_fit_percent", result.mean_fit_percent),
        Table("With the correction within its limits", list(_limited(result)), words=1),
        Section("", [_EXPLAINED]),
        Value("logs", [as_json(_log(log)) for log in logs]),
        Value("", remarks, "reading"),
        Value("", [*map(text_of, result.warnings)], "warning"),
        Value("warnings", [*remarks, *map(text_of, result.warnings)]),
        Value("warning_codes", [*map(message_as_json, result.warnings)]),
    ]


def _log_table(log: VerifiedLog) -> Table:
    rows = [_row(output.measured.name, output.figures) for output in log.outputs]
    return Table(f"{log.name[:60]}{_etve(log)}", rows, words=1)


def _limited(result: Verification) -> list[list[Value]]:
    several = len(result.logs) > 1
    return [
        _row(f"{o.measured.name} ({log.name})" if several else o.measured.name, o.limited)
        for log in result.logs
        for o in log.outputs
        if o.limited is not None
    ]


def _etve(log: VerifiedLog) -> str:
    return " (nothing turned: ranges are ETVE, ISO 230-3)" if log.environmental else ""


def _log(log: VerifiedLog) -> list[Part]:
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
        Value("warnings", [*map(text_of, log.warnings)]),
        Value("warning_codes", [*map(message_as_json, log.warnings)]),
    ]


def _output(output: VerifiedOutput) -> list[Value]:
    ranges: dict[str, float] = {}
    for name, values in zip(output.parts, output.contribution_um.T.tolist(), strict=True):
        known = [v for v in values if v == v]  # noqa: PLR0124 - without NaN
        ranges[name] = max(known) - min(known) if known else 0.0
    limited = None if output.limited is None else as_json(figures_of(output.limited))
    return without_text(
        *figures_of(output.figures),
        Value("model_output", output.measured.output),
        Value("diameter_mm", output.measured.diameter_mm),
        Value("limited", limited),
        Value("contribution_peak_to_peak_um", ranges),
    )
