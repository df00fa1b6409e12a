"""A verification as text and as JSON."""

from collections.abc import Mapping, Sequence

from thermaxis import __version__
from thermaxis.cli._text_table import text_table
from thermaxis.errors import printable
from thermaxis.thermal import Verification, VerificationFigures, VerifiedLog


def _number(value: float | None, decimals: int = 2) -> str:
    return "–" if value is None else f"{value:.{decimals}f}"


def _fold(figures: VerificationFigures) -> str:
    return f"{figures.reduction:.1f}" if figures.reduction < 1e4 else "> 9999"


_HEADS = (
    *("output", "fit %", "p-p um", "left um", "-fold", "RMSE", "MAE", "max"),
    *("60 min", "left", "end", "left", "persist.", "static"),
)


def _row(name: str, figures: VerificationFigures) -> list[str]:
    after = figures.after_60_min_um or (None, None)
    return [
        printable(name, 30),
        _number(figures.fit_percent, 1),
        _number(figures.uncompensated_um),
        _number(figures.residual_um),
        _fold(figures),
        _number(figures.rmse_um),
        _number(figures.mae_um),
        _number(figures.max_um),
        *(_number(v) for v in after),
        *(_number(v) for v in figures.at_end_um),
        _number(figures.persistence_rmse_um),
        _number(figures.static_rmse_um),
    ]


def verification_as_text(result: Verification, title: str, remarks: Sequence[str] = ()) -> str:
    """Return a verification as tables for a terminal."""
    parts: list[str] = []
    if len(result.logs) > 1:
        for log in result.logs:
            rows = [_row(o.measured.name, o.figures) for o in log.outputs]
            parts.append(
                text_table(f"{printable(log.name, 60)}{_etve(log)}", _HEADS, rows, words=1)
            )
    etve = _etve(result.logs[0]) if len(result.logs) == 1 else ", all logs"
    rows = [_row(name, figures) for name, figures in result.pooled.items()]
    table = text_table(f"{title}{etve}", _HEADS, rows, words=1)
    if len(result.pooled) > 1:
        folds = [f.reduction for f in result.pooled.values()]
        mean = _number(result.mean_fit_percent, 1)
        table += f"\nmean fit {mean} %, peak-to-peak reduced {min(folds):.1f} to {max(folds):.1f}"
        table += "-fold\n"
    parts.append(table)
    rows = [
        _row(
            f"{o.measured.name} ({log.name})" if len(result.logs) > 1 else o.measured.name,
            o.limited,
        )
        for log in result.logs
        for o in log.outputs
        if o.limited is not None
    ]
    if rows:
        parts.append(text_table("With the correction within its limits", _HEADS, rows, words=1))
    parts.append(
        "p-p: range of the measured displacement; left: of measured minus simulated (free run)."
        " persist.: RMSE of 'nothing changes from row to row', one step ahead; static: RMSE of the"
        " static regression that the model carries from its training, or else of one fitted to"
        " this very log. All in um.\n"
    )
    said = [f"reading: {printable(remark, 400)}\n" for remark in remarks]
    said += [f"warning: {printable(w, 400)}\n" for w in result.warnings]
    if said:
        parts.append("".join(said))
    return "\n".join(parts)


def _etve(log: VerifiedLog) -> str:
    return " (nothing turned: ranges are ETVE, ISO 230-3)" if log.environmental else ""


# ---- JSON ---------------------------------------------------------------------------------------


def _finite(value: float) -> float | None:
    return value if abs(value) < 1e300 else None


def figures_as_json(figures: VerificationFigures) -> dict[str, object]:
    """Return figures with the keys of the command's JSON."""
    after = figures.after_60_min_um
    return {
        "rows": figures.rows,
        "fit_percent": figures.fit_percent,
        "peak_to_peak_um": {
            "uncompensated": figures.uncompensated_um,
            "residual": figures.residual_um,
            "reduction": _finite(figures.reduction),
        },
        "rmse_um": figures.rmse_um,
        "mae_um": figures.mae_um,
        "max_um": figures.max_um,
        "after_60_min_um": None if after is None else _pair(after),
        "at_end_um": _pair(figures.at_end_um),
        "persistence_rmse_um": figures.persistence_rmse_um,
        "static_rmse_um": figures.static_rmse_um,
    }


def _pair(values: tuple[float, float]) -> dict[str, float]:
    return {"uncompensated": values[0], "residual": values[1]}


def verification_as_json(
    result: Verification, model_hash: str, remarks: Sequence[str] = ()
) -> dict[str, object]:
    """Return a verification with the keys of the command's JSON."""
    return {
        "version": __version__,
        "model_sha256": model_hash,
        "outputs": _outputs(result.pooled),
        "mean_fit_percent": result.mean_fit_percent,
        "logs": [_log(log) for log in result.logs],
        "warnings": [*remarks, *result.warnings],
    }


def _outputs(figures: Mapping[str, VerificationFigures]) -> dict[str, object]:
    return {name: figures_as_json(f) for name, f in figures.items()}


def _log(log: VerifiedLog) -> dict[str, object]:
    return {
        "name": log.name,
        "environmental_test": log.environmental,
        "outputs": {
            o.measured.name: {
                **figures_as_json(o.figures),
                "model_output": o.measured.output,
                "diameter_mm": o.measured.diameter_mm,
                "limited": None if o.limited is None else figures_as_json(o.limited),
                "contribution_peak_to_peak_um": _ranges(o.parts, o.contribution_um.T.tolist()),
            }
            for o in log.outputs
        },
        "outside_training_range": {
            name: {"share_of_rows": share, "beyond_share_of_range": beyond}
            for name, (share, beyond) in log.outside.items()
        },
        "warnings": list(log.warnings),
    }


def _ranges(names: Sequence[str], columns: Sequence[Sequence[float]]) -> dict[str, float]:
    ranges: dict[str, float] = {}
    for name, values in zip(names, columns, strict=True):
        known = [v for v in values if v == v]  # noqa: PLR0124 - without NaN
        ranges[name] = max(known) - min(known) if known else 0.0
    return ranges
