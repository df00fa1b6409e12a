"""Charts of an identification: the paper's figures 3 and 4, residuals, poles, the choice."""

from collections.abc import Sequence

import numpy as np

from thermaxis.positioning import FloatArray
from thermaxis.report.thermal._comparison import comparison_panel, contribution_panel
from thermaxis.report.thermal._conditions import (
    displacement_panel,
    input_panels,
    speed_panel,
)
from thermaxis.report.thermal._fit import (
    FittedExperiment,
    fitted_experiments,
    input_names_of,
    leftover_of,
)
from thermaxis.report.thermal._panels import (
    LOOKS,
    Area,
    Look,
    Panel,
    PanelGrid,
    ThermalChart,
    Trace,
    panel_chart,
)
from thermaxis.report.thermal._poles import pole_zero_chart, time_constant_chart
from thermaxis.report.thermal._steps import identified_step_chart
from thermaxis.report.thermal._words import hours, name_text
from thermaxis.thermal import Identification, IdentifiedOutput, Records, SelectionResult, ThermalLog

MOST_LOGS = 4
"""Records that are drawn; the tables hold all. [1]"""
MOST_OUTPUTS = 6
"""Outputs that have charts of their own; the tables hold all. [1]"""
_MOST_CROSS = 5
"""Inputs whose correlation with the residual is drawn. [1]"""
_STEMS = Look("#0072b2", width=0.9, stems=True)


def identification_charts(
    result: Identification, records: Records, logs: Sequence[ThermalLog], *, reference_s: float
) -> tuple[ThermalChart, ...]:
    """Return the charts of an identification in the order in which a report shows them."""
    record_s = record_length_s(records)
    outputs = result.outputs[:MOST_OUTPUTS]
    fitted = {output.name: fitted_experiments(output, records) for output in outputs}
    charts: list[ThermalChart | None] = [
        _fit(k, o, fitted[o.name]) for k, o in enumerate(outputs) if fitted[o.name]
    ]
    if result.selection is not None:
        charts.append(_selection(result.selection))
    charts.append(identified_step_chart(result.outputs, record_s=record_s))
    charts.append(
        time_constant_chart(result.outputs, sample_time_s=records.sample_time_s, record_s=record_s)
        if all(output.polynomials is None for output in result.outputs)
        else pole_zero_chart(result.outputs)
    )
    charts += [_residuals(k, o, fitted[o.name]) for k, o in enumerate(outputs) if fitted[o.name]]
    charts += [
        _conditions(log, records, number, len(logs), reference_s)
        for number, log in enumerate(logs[:MOST_LOGS])
    ]
    return tuple(chart for chart in charts if chart is not None)


def record_length_s(records: Records) -> float:
    """Return the length of the longest record. [s]"""
    rows = max(e.y.size for experiments in records.experiments.values() for e in experiments)
    return (rows - 1) * records.sample_time_s


def _conditions(
    log: ThermalLog, records: Records, number: int, count: int, reference_s: float
) -> ThermalChart:
    speeds = speed_panel(log)
    channels = [channel for definition in records.inputs for channel in definition.channels]
    panels = [] if speeds is None else [speeds]
    panels += input_panels(log, channels, reference_s=reference_s)
    known = {column.casefold() for column in log.columns}
    read = {n: log.column(n, unit="um") for n in records.experiments if n.casefold() in known}
    measured = {
        name: values - log.start_of(values, reference_s)
        for name, values in read.items()
        if not bool(np.all(np.isnan(values)))
    }
    if measured:
        panels.append(displacement_panel(log.time_s, measured))
    grid = PanelGrid(heading="Calibration test", source=log.name, panels=tuple(panels))
    missing = "" if speeds is not None else " The log has no speeds."
    caption = (
        "Speeds, temperature inputs and measured outputs of the calibration test (figure 3 of the"
        f" paper).{missing}"
    )
    ending = f"_log_{number + 1}" if count > 1 else ""
    return panel_chart(f"figure_03_conditions{ending}", caption, grid)


def _fit(number: int, output: IdentifiedOutput, fitted: Sequence[FittedExperiment]) -> ThermalChart:
    order = sorted(range(len(fitted)), key=lambda k: -float(fitted[k].time_s[-1]))[:MOST_LOGS]
    drawn = [fitted[k] for k in sorted(order)]
    panels = [
        comparison_panel(f"{output.name}, {e.name}", e.time_s, e.measured_um, e.simulated_um)
        for e in drawn
    ]
    if len(drawn[0].contributions_um) > 1:
        panels.append(contribution_panel(drawn[0].time_s, drawn[0].contributions_um))
    grid = PanelGrid(
        heading="Measured, simulated and residual displacement in the training",
        source="",
        panels=tuple(panels),
    )
    caption = (
        f"{name_text(output.name)}: free run over the training"
        f" record{'s' if len(fitted) > 1 else ''} (left part of figure 4 of the paper)."
    )
    if len(drawn) < len(fitted):
        caption += f" The {len(drawn)} longest of {len(fitted)} records."
    return panel_chart(f"figure_04_fit_output_{number + 1}", caption, grid)


def _residuals(
    number: int, output: IdentifiedOutput, fitted: Sequence[FittedExperiment]
) -> ThermalChart | None:
    left = leftover_of(fitted)
    if isinstance(left, str):
        return None
    names = input_names_of(output)
    analysis = left.analysis
    over = np.max(np.abs(analysis.cross_correlation), axis=0) / analysis.cross_band
    chosen = sorted(np.argsort(-over)[:_MOST_CROSS].tolist())
    panels = [
        _correlation_panel(
            "residual with itself",
            analysis.lags * left.step_s,
            analysis.autocorrelation,
            analysis.autocorrelation_band,
        )
    ]
    panels += [
        _correlation_panel(
            f"residual with {names[k]}",
            analysis.cross_lags * left.step_s,
            analysis.cross_correlation[:, k],
            np.full(analysis.cross_lags.size, analysis.cross_band[k]),
        )
        for k in chosen
    ]
    grid = PanelGrid(
        heading=f"What the model left over, on means over {hours(left.step_s)}",
        source=output.name,
        panels=tuple(panels),
        axis="lag [h]",
        columns=3 if len(panels) > 2 else 2,
        one_axis=False,
        one_scale=True,
        one_legend=True,
    )
    caption = (
        f"{name_text(output.name)}: autocorrelation of the residual, and its correlation with the"
        " inputs (the residual is later at positive lags). Pale: 99 % band of a white residual, and"
        " of one that is independent of the input."
    )
    if len(chosen) < len(names):
        caption += f" The {len(chosen)} of {len(names)} inputs that reach furthest."
    return panel_chart(f"residuals_output_{number + 1}", caption, grid)


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


def _selection(selection: SelectionResult) -> ThermalChart | None:
    curve = selection.curve
    if len(curve) < 2:
        return None
    count = np.array([float(len(entry.channels)) for entry in curve])
    score = np.array([entry.score for entry in curve])
    half = np.array([entry.excess_se for entry in curve])
    look = Look(LOOKS[0].colour, marker="o", points=True)
    panel = Panel(
        title="Free run on parts held out",
        quantity="error over the best [1]",
        traces=(Trace("mean of outputs", count, score, look),),
        areas=(Area("± 1 standard error\nof the excess", count, score - half, score + half),),
        mark=float(len(selection.channels)),
        mark_label="chosen",
        height_in=1.7,
    )
    grid = PanelGrid(
        heading="Error against the number of channels",
        source="",
        panels=(panel,),
        axis="channels [1]",
    )
    caption = (
        "Choice among the candidates: error in free run on parts that were held out, by the number"
        " of channels, the most useful ones first."
    )
    return panel_chart("selection", caption, grid)
