"""What a report says of the residuals of a model, along its training or another test."""

from collections.abc import Mapping, Sequence

import numpy as np

from thermaxis.errors import DataError
from thermaxis.messages import sentence_of, text_of
from thermaxis.positioning import FloatArray
from thermaxis.report._document import Block, ItemList, Table, columns_of
from thermaxis.report._text import fixed, plain_text
from thermaxis.report.thermal._panels import (
    Area,
    Look,
    Panel,
    PanelGrid,
    ThermalChart,
    Trace,
    panel_chart,
)
from thermaxis.report.thermal._words import hours, name_text
from thermaxis.thermal import IdentifiedOutput, LeftOver, VerifiedOutput, left_over

_MOST_CROSS = 5
"""Inputs whose correlation with the residual is drawn. [1]"""
_STEMS = Look("#0072b2", width=0.9, stems=True)


def by_channel(outputs: Sequence[IdentifiedOutput]) -> dict[str, list[VerifiedOutput]]:
    """Return the free runs along the training logs by measured channel."""
    found: dict[str, list[VerifiedOutput]] = {}
    for run in (run for output in outputs for run in output.runs):
        found.setdefault(run.measured.name, []).append(run)
    return found


def leftover_of(runs: Sequence[VerifiedOutput]) -> LeftOver | str:
    """Analyse what a model left over, or say why that says nothing."""
    try:
        return left_over(runs)
    except DataError as error:
        return sentence_of(error.message).rstrip(".")


def leftover_blocks(runs: Mapping[str, Sequence[VerifiedOutput]]) -> list[Block]:
    """Return the table of the residual analyses of outputs, and what they mean."""
    said: list[str] = []
    rows: list[tuple[str, ...]] = []
    for name, along in runs.items():
        left = leftover_of(along)
        if isinstance(left, str):
            said.append(f"{name_text(name)}: {plain_text(left)}.")
            continue
        said += [plain_text(text_of(message), 400) for message in left.messages]
        found = left.analysis
        rows += [
            (
                name_text(name),
                hours(left.step_s),
                fixed(float(found.autocorrelation[1]), 2),
                fixed(found.residual_effective_rows, 0),
                name_text(input_name, 30),
                f"{p:.2g}" if p > 1e-6 else "< 1e-6",
                "may be" if independent else "no",
            )
            for input_name, p, independent in zip(
                left.inputs, found.input_p.tolist(), found.independent, strict=True
            )
        ]
    columns = columns_of(
        "*Output | Means over | Neighbours | Worth rows | *Input | p | All explained"
    )
    words = (
        "Residual analysis at the 1 % level: correlation of neighbouring means; the independent"
        " ones that they are worth; probability that an input without influence tells so much of"
        " the residual beyond the residual's own past."
    )
    tables: list[Block] = [Table(columns, tuple(rows), words)] if rows else []
    return [*tables, ItemList(tuple(said))]


def leftover_chart(name: str, runs: Sequence[VerifiedOutput]) -> ThermalChart | None:
    """Return the correlations of the residual of an output; None where too little was measured."""
    left = leftover_of(runs)
    if isinstance(left, str):
        return None
    analysis, names = left.analysis, left.inputs
    chosen = sorted(np.argsort(analysis.input_p, kind="stable")[:_MOST_CROSS].tolist())
    lag_s = analysis.lags * left.step_s
    panels = [
        _correlation_panel(
            "residual with itself", lag_s, analysis.autocorrelation, analysis.autocorrelation_band
        )
    ]
    panels += [
        _correlation_panel(
            f"residual with {names[k]}",
            lag_s,
            analysis.input_correlation[:, k],
            np.full(lag_s.size, analysis.input_band[k]),
        )
        for k in chosen
    ]
    grid = PanelGrid(
        heading=f"What the model left over, on means over {hours(left.step_s)}",
        source=left.channel,
        panels=tuple(panels),
        axis="residual later by [h]",
        columns=2 if len(panels) in {2, 4} else 3,
        one_scale=True,
        one_legend=True,
    )
    caption = (
        f"{name_text(left.channel)}: autocorrelation of the residual, and correlation of what its"
        " own past does not tell with the inputs. Pale: 99 % band of a white residual, and of one"
        " that is independent of the input; an input is judged by all lags together."
    )
    if len(chosen) < len(names):
        caption += f" The {len(chosen)} of {len(names)} inputs that tell most."
    return panel_chart(name, caption, grid)


def _correlation_panel(
    title: str, lag_s: FloatArray, values: FloatArray, band: FloatArray
) -> Panel:
    lag_h = lag_s / 3600.0
    return Panel(
        title=title,
        quantity="correlation",
        traces=(Trace("correlation", lag_h, values, _STEMS),),
        areas=(Area("99 % band", lag_h, -band, band),),
        height_in=1.6,
    )
