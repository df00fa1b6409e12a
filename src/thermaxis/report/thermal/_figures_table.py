"""Tables of a verification: figures of every output, the paper's Table 3, ranges of the inputs."""

from collections.abc import Mapping, Sequence

import numpy as np

from thermaxis.compensation import STATED, CompensationModel
from thermaxis.report._document import Block, Column, Paragraph, Table, columns_of
from thermaxis.report._text import as_given
from thermaxis.report.thermal._conditions import relative_values
from thermaxis.report.thermal._words import DASH, fold, micrometres, name_text, percent, significant
from thermaxis.thermal import ThermalLog, Verification, VerificationFigures, VerifiedLog

_MOST_PARTS = 60


def table_3(model: CompensationModel, result: Verification) -> Table:
    """Return fit and reduction of every measuring position with their mean.

    References
    ----------
    Mareš and Horejš 2021, Table 3.
    """
    measured = {o.measured.name: o.measured for log in result.logs for o in log.outputs}
    with_place = any(m.diameter_mm is not None for m in measured.values())
    rows: list[tuple[str, ...]] = [
        (
            name_text(name),
            name_text(measured[name].output, 30),
            *((_place(measured[name].diameter_mm),) if with_place else ()),
            percent(figures.fit_percent),
            fold(figures.reduction),
        )
        for name, figures in result.pooled.items()
    ]
    if len(rows) > 1:
        folds = [figures.reduction for figures in result.pooled.values()]
        spread = f"{fold(min(folds))} to {fold(max(folds))}"
        gaps = ("",) * (2 if with_place else 1)
        mean = percent(result.mean_fit_percent)
        rows.append(("Mean of the fits, range of the reductions", *gaps, mean, spread))
    columns = (
        Column("Measured output", "left", wide=True),
        Column("Model output", "left"),
        *((Column("Measured at"),) if with_place else ()),
        Column("Fit [%]"),
        Column("Peak-to-peak reduced"),
    )
    strong = (len(rows) - 1,) if len(result.pooled) > 1 else ()
    channels = {part.name for output in model.outputs for part in output.parts}
    words = (
        f"Approximation quality over {_count(len(result.logs), 'log')} with"
        f" {_count(len(channels), 'input')} (Table 3 of the paper)."
    )
    return Table(columns, tuple(rows), words, strong_rows=strong)


def _count(number: int, what: str) -> str:
    return f"{number} {what}{'' if number == 1 else 's'}"


def _place(diameter_mm: float | None) -> str:
    return "tool centre point" if diameter_mm is None else f"D = {as_given(diameter_mm)} mm"


def figure_tables(figures: Mapping[str, VerificationFigures], words: str) -> tuple[Block, ...]:
    """Return all figures of a log, or of all logs together."""
    columns = columns_of(
        "*Output | Rows | p-p measured | p-p residual | RMSE | MAE | Largest"
        " | Static RMSE | Persistence RMSE"
    )
    rows = tuple(
        (
            name_text(name),
            str(f.rows),
            micrometres(f.uncompensated_um),
            micrometres(f.residual_um),
            micrometres(f.rmse_um),
            micrometres(f.mae_um),
            micrometres(f.max_um),
            micrometres(f.static_rmse_um),
            micrometres(f.persistence_rmse_um),
        )
        for name, f in figures.items()
    )
    main = Table(columns, rows, f"{words}: residual of the free run beside simple rules, in µm.")
    after = {name: f.after_60_min_um or (None, None) for name, f in figures.items()}
    later = tuple(
        (name_text(name), *map(micrometres, after[name]), *map(micrometres, f.at_end_um))
        for name, f in figures.items()
    )
    columns = columns_of(
        "*Output | 60 min: measured | 60 min: residual | End: measured | End: residual"
    )
    ends = "Displacement after 60 minutes and at the end (as ISO 230-3 asks), in µm."
    return main, Table(columns, later, ends)


def baseline_words(figures: Mapping[str, VerificationFigures]) -> Paragraph:
    """Return in words where the model is worth no more than a simple rule."""
    beaten = [
        name_text(name)
        for name, f in figures.items()
        if f.static_rmse_um is not None and f.rmse_um >= f.static_rmse_um
    ]
    if beaten:
        listed = ", ".join(beaten[:12])
        words = f"No better than a static regression on the same inputs: {listed}."
        return Paragraph(words, strong=True)
    compared = [f for f in figures.values() if f.static_rmse_um is not None]
    if not compared:
        return Paragraph("There is no static regression to compare with.")
    return Paragraph("Every output that has one beside it is better than the static regression.")


def validity_table(
    model: CompensationModel, logs: Sequence[ThermalLog], verified: Sequence[VerifiedLog]
) -> Table:
    """Return the ranges of the inputs in the training and in the logs."""
    parts = {part.name: part for output in model.outputs for part in output.parts}
    stated = dict(model.reference_c) if model.reference == STATED else {}
    rows: list[tuple[str, ...]] = []
    strong: list[int] = []
    for log, found in zip(logs, verified, strict=True):
        for name, part in list(parts.items())[:_MOST_PARTS]:
            u = relative_values(log, part.plus, found.reference_s, stated.get(part.plus))
            if part.minus:
                u = u - relative_values(log, part.minus, found.reference_s, stated.get(part.minus))
            known = u[~np.isnan(u)]
            seen = (None, None) if not known.size else (float(known.min()), float(known.max()))
            share, beyond = found.outside.get(name, (0.0, 0.0))
            if share > 0:
                strong.append(len(rows))
            unknown = part.lowest_k is None
            rows.append(
                (
                    name_text(found.name, 30),
                    name_text(name, 30),
                    _range(part.lowest_k, part.highest_k),
                    _range(*seen),
                    DASH if unknown else f"{100.0 * share:.1f} %",
                    DASH if unknown else f"{100.0 * beyond:.1f} %",
                )
            )
    words = (
        "Range of every input relative to its reference, in K (or the unit of its channel): in the"
        " training and in the log; share of the rows outside; largest excess, of the width of the"
        " training range."
    )
    if len(parts) > _MOST_PARTS:
        words += f" The first {_MOST_PARTS} of {len(parts)} inputs."
    columns = columns_of("<Log | *Input | Training | Log | Rows outside | Excess")
    return Table(columns, tuple(rows), words, strong_rows=tuple(strong))


def _range(low: float | None, high: float | None) -> str:
    if low is None or high is None:
        return "not stated"
    return f"{significant(low, 3)} to {significant(high, 3)}"
