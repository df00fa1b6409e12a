"""Charts of an identification: the paper's figures 3 and 4, residuals, poles, the choice."""

from collections.abc import Sequence

import numpy as np

from thermaxis.report.thermal._comparison import (
    by_part,
    comparison_panel,
    contribution_panel,
)
from thermaxis.report.thermal._conditions import (
    displacement_panel,
    input_panels,
    speed_panel,
)
from thermaxis.report.thermal._fit import by_channel, leftover_chart
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
from thermaxis.report.thermal._steps import identified_response_charts
from thermaxis.report.thermal._words import name_text
from thermaxis.thermal import Identification, IdentifiedOutput, Records, SelectionResult, ThermalLog

MOST_LOGS = 4
"""Records that are drawn; the tables hold all. [1]"""
MOST_OUTPUTS = 6
"""Outputs that have charts of their own; the tables hold all. [1]"""


def identification_charts(
    result: Identification,
    records: Records,
    logs: Sequence[ThermalLog],
    *,
    reference_s: float | None,
) -> tuple[ThermalChart, ...]:
    """Return the charts of an identification in the order in which a report shows them."""
    record_s = record_length_s(records)
    outputs = result.outputs[:MOST_OUTPUTS]
    charts: list[ThermalChart | None] = [_fit(k, o) for k, o in enumerate(outputs) if o.runs]
    if result.selection is not None:
        charts.append(_selection(result.selection))
    charts += identified_response_charts(
        result.outputs, record_s=record_s, sample_time_s=records.sample_time_s
    )
    charts.append(
        time_constant_chart(result.outputs, sample_time_s=records.sample_time_s, record_s=record_s)
        if all(output.polynomials is None for output in result.outputs)
        else pole_zero_chart(result.outputs)
    )
    charts += [
        leftover_chart(f"residuals_output_{k + 1}", runs)
        for k, runs in enumerate(list(by_channel(outputs).values())[:MOST_OUTPUTS])
    ]
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
    log: ThermalLog, records: Records, number: int, count: int, reference_s: float | None
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


def _fit(number: int, output: IdentifiedOutput) -> ThermalChart:
    runs = output.runs
    order = sorted(range(len(runs)), key=lambda k: -float(runs[k].time_s[-1]))[:MOST_LOGS]
    drawn = [runs[k] for k in sorted(order)]
    panels = [
        comparison_panel(f"{r.measured.name}, {r.log}", r.time_s, r.measured_um, r.simulated_um)
        for r in drawn
    ]
    if len(drawn[0].parts) > 1:
        panels.append(contribution_panel(drawn[0].time_s, by_part(drawn[0])))
    grid = PanelGrid(
        heading="Measured, simulated and residual displacement in the training",
        source="",
        panels=tuple(panels),
    )
    caption = (
        f"{name_text(output.name)}: free run over the training"
        f" record{'s' if len(runs) > 1 else ''} (left part of figure 4 of the paper)."
    )
    if len(drawn) < len(runs):
        caption += f" The {len(drawn)} longest of {len(runs)} records."
    return panel_chart(f"figure_04_fit_output_{number + 1}", caption, grid)


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
