"""Charts of a model against measured displacements: the paper's figures 4 and 9 to 13."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from thermaxis.compensation import STATED, CompensationModel, Output, gain_of
from thermaxis.positioning import FloatArray
from thermaxis.report._text import as_given
from thermaxis.report.thermal._conditions import (
    HOUR_S,
    displacement_panel,
    input_panels,
    lines_panel,
    speed_panel,
)
from thermaxis.report.thermal._fit import leftover_chart
from thermaxis.report.thermal._lines import largest, shaded_spans, span_of
from thermaxis.report.thermal._panels import (
    LOOKS,
    MEASURED,
    MOST_LINES,
    RESIDUAL,
    REST,
    SIMULATED,
    Panel,
    PanelGrid,
    ThermalChart,
    Trace,
    panel_chart,
)
from thermaxis.report.thermal._steps import response_charts
from thermaxis.report.thermal._words import hours, name_text
from thermaxis.thermal import ThermalLog, Verification, VerifiedLog, VerifiedOutput
from thermaxis.thermal.log import block_means, block_numbers
from thermaxis.thermal.verification import runs_of

MOST_LOGS = 4
"""Logs that are drawn; the tables hold all. [1]"""
MOST_OUTPUTS = 6
"""Outputs that have a chart of their own; the tables hold all. [1]"""
_MOST_PARTS = 3
"""Parts that are applied alone, one panel each. [1]"""
_ENLARGED = 0.25
"""Residuals below this share of what was measured are drawn once more, enlarged. [1]"""
_MEANS = 240
"""Means along a log where residuals are enlarged. [1]"""
_REST = "rest"


def verification_charts(
    model: CompensationModel, logs: tuple[ThermalLog, ...], result: Verification
) -> tuple[ThermalChart, ...]:
    """Return the charts of a verification in the order in which a report shows them."""
    charts: list[ThermalChart] = []
    several = len(result.logs) > 1
    for number, (log, verified) in enumerate(zip(logs, result.logs, strict=True)):
        if number == MOST_LOGS:
            break
        ending = f"_log_{number + 1}" if several else ""
        of_log = (
            _with_and_without(verified),
            _conditions(model, log, verified),
            *(_one_output(verified, output) for output in worst_outputs(verified)),
            _after_parts(model, verified),
        )
        charts += [replace(chart, name=chart.name + ending) for chart in of_log]
    for number, name in enumerate(list(result.pooled)[:MOST_OUTPUTS]):
        chart = leftover_chart(f"residuals_output_{number + 1}", runs_of(result, name))
        charts += [] if chart is None else [chart]
    horizon = max(float(log.time_s[-1]) for log in logs)
    return (*charts, *response_charts(model, record_s=horizon, record_name="length of the log"))


def worst_outputs(verified: VerifiedLog) -> tuple[VerifiedOutput, ...]:
    """Return the outputs that have a chart of their own: all, or those with the largest RMSE."""
    order = sorted(verified.outputs, key=lambda o: -o.figures.rmse_um)[:MOST_OUTPUTS]
    return tuple(o for o in verified.outputs if any(o is chosen for chosen in order))


def _conditions(model: CompensationModel, log: ThermalLog, verified: VerifiedLog) -> ThermalChart:
    stated = dict(model.reference_c) if model.reference == STATED else None
    speeds = speed_panel(log)
    panels = [] if speeds is None else [speeds]
    panels += input_panels(log, model.channels, reference_s=verified.reference_s, stated=stated)
    panels.append(displacement_panel(log.time_s, _measured(verified)))
    grid = PanelGrid(heading="Verification test", source=verified.name, panels=tuple(panels))
    caption = "Speeds, temperature inputs and measured outputs (figures 7, 8 and 9 of the paper)."
    if speeds is None:
        caption = (
            "Temperature inputs and measured outputs (figures 8 and 9 of the paper); the log has"
            " no speeds (figure 7)."
        )
    return panel_chart("figure_07_08_09_conditions", caption, grid)


def _measured(verified: VerifiedLog) -> dict[str, FloatArray]:
    return {output.measured.name: output.measured_um for output in verified.outputs}


def _shaded(verified: VerifiedLog) -> tuple[tuple[float, float], ...]:
    counted = np.any([output.counted for output in verified.outputs], axis=0)
    return shaded_spans(verified.time_s / HOUR_S, counted)


def place_of(output: VerifiedOutput) -> str:
    """Return where an output was measured, in words."""
    diameter = output.measured.diameter_mm
    return "" if diameter is None else f"D = {as_given(diameter)} mm"


def comparison_panel(
    title: str, time_s: FloatArray, measured_um: FloatArray, simulated_um: FloatArray
) -> Panel:
    """Return measured, simulated and residual displacement; the left part of figure 4."""
    time_h = time_s / HOUR_S
    return Panel(
        title=title,
        quantity="displacement [µm]",
        traces=(
            Trace("measured", time_h, measured_um, MEASURED),
            Trace("simulated", time_h, simulated_um, SIMULATED),
            Trace("residual", time_h, measured_um - simulated_um, RESIDUAL),
        ),
        height_in=1.9,
    )


def contribution_panel(time_s: FloatArray, contributions: Mapping[str, FloatArray]) -> Panel:
    """Return the contribution of every part; the lower part of figure 10."""
    time_h = time_s / HOUR_S
    drawn, others = largest(contributions, MOST_LINES)
    traces = [
        Trace(name, time_h, contributions[name], look)
        for name, look in zip(drawn, LOOKS, strict=False)
    ]
    title = "Contribution of every part"
    if others:
        total = np.sum([contributions[name] for name in others], axis=0)
        traces.append(Trace(f"{_REST}: sum of {len(others)}", time_h, total, REST))
        title = f"Contributions: the {len(drawn)} of {len(contributions)} parts with the most"
    return Panel(title=title, quantity="displacement [µm]", traces=tuple(traces), height_in=1.7)


def by_part(output: VerifiedOutput) -> dict[str, FloatArray]:
    """Return what every part contributes, by its name."""
    return dict(zip(output.parts, output.contribution_um.T, strict=True))


def _one_output(verified: VerifiedLog, output: VerifiedOutput) -> ThermalChart:
    place = place_of(output)
    name = f"{output.measured.name}{', ' if place else ''}{place}"
    comparison = comparison_panel(name, verified.time_s, output.measured_um, output.simulated_um)
    shaded = shaded_spans(verified.time_s / HOUR_S, output.counted)
    grid = PanelGrid(
        heading="Measured, simulated and residual displacement, and what each part contributes",
        source=verified.name,
        panels=(
            replace(comparison, shaded=shaded),
            replace(contribution_panel(verified.time_s, by_part(output)), shaded=shaded),
        ),
    )
    number = next(k for k, o in enumerate(verified.outputs) if o is output)
    caption = (
        f"{name_text(name)}: measured displacement, free run of the model, residual (the"
        " compensated machine), and the contribution of every part (figure 10 of the paper)."
    )
    return panel_chart(f"figure_10_output_{number + 1}", caption, grid)


def _with_and_without(verified: VerifiedLog) -> ThermalChart:
    before = _measured(verified)
    drawn, others = largest(before, MOST_LINES)
    after = {o.measured.name: o.residual_um for o in verified.outputs}
    titles = ("Without compensation", "With compensation")
    if others:
        before, after = ({n: s[n] for n in drawn} for s in (before, after))
        titles = tuple(f"{title}: {len(drawn)} of {len(verified.outputs)}" for title in titles)
    panels = tuple(
        replace(
            lines_panel(title, "displacement [µm]", verified.time_s, series, height_in=2.2),
            shaded=_shaded(verified),
        )
        for title, series in zip(titles, (before, after), strict=True)
    )
    grid = PanelGrid(
        heading="The machine without and with compensation",
        source=verified.name,
        panels=panels,
        columns=2,
        one_scale=True,
        one_legend=True,
    )
    caption = (
        "All outputs without and with compensation on one scale (figure 13 of the paper); with"
        " compensation means measured minus free run of the model."
    )
    return panel_chart("figure_13_with_and_without", caption, grid)


def _after_parts(model: CompensationModel, verified: VerifiedLog) -> ThermalChart:
    drawn, others = largest(_measured(verified), MOST_LINES)
    shown = [output for output in verified.outputs if output.measured.name in drawn]
    parts = list(dict.fromkeys(name for output in shown for name in output.parts))
    alone = _alone_panels(verified, shown, parts)
    of_model = {output.name: output for output in model.outputs}
    left = {_with_gain(o, of_model[o.measured.output]): o.residual_um for o in shown}
    title = "After all parts" if len(parts) > 1 else f"After {parts[0]}"
    panels = [*alone, _residual_panel(title, verified, left)]
    widest = max(span_of(output.measured_um) for output in shown)
    notes: list[str] = []
    if max(map(span_of, left.values())) < _ENLARGED * widest:
        panels.append(replace(_enlarged_panel(verified, left), own_scale=True))
        notes.append("the last panel has a scale of its own")
    grid = PanelGrid(
        heading="Residuals of all outputs after one part alone and after all parts",
        source=verified.name,
        panels=tuple(panels),
        one_scale=True,
    )
    if others:
        notes.append(f"the {len(shown)} of {len(verified.outputs)} outputs with the largest range")
    if 0 < len(alone) < len(parts):
        notes.append(f"the {len(alone)} of {len(parts)} parts that contribute most")
    caption = (
        "Residuals of all outputs after one part alone and after all parts, on one scale (figures"
        f" 11 and 12 of the paper){': ' if notes else ''}{', '.join(notes)}."
    )
    return panel_chart("figure_11_12_residuals", caption, grid)


def _alone_panels(
    verified: VerifiedLog, shown: Sequence[VerifiedOutput], parts: Sequence[str]
) -> list[Panel]:
    """Return the residuals after each of the largest parts alone; none where there is one part."""
    if len(parts) < 2:
        return []
    shares = [by_part(output) for output in shown]
    weight = {n: max(span_of(s[n]) for s in shares if n in s) for n in parts}
    chosen = sorted(parts, key=lambda name: -weight[name])[:_MOST_PARTS]
    return [
        _residual_panel(
            f"After {name} alone",
            verified,
            {
                output.measured.name: output.measured_um - share.get(name, 0.0)
                for output, share in zip(shown, shares, strict=True)
            },
        )
        for name in parts
        if name in chosen
    ]


def _enlarged_panel(verified: VerifiedLog, left: Mapping[str, FloatArray]) -> Panel:
    """Return residuals at their own scale, as means: noise of one line would cover the others."""
    step_s = float(verified.time_s[-1]) / _MEANS
    if verified.time_s.size < 2 * _MEANS:
        return _residual_panel("The same, enlarged", verified, left)
    block = block_numbers(verified.time_s, step_s)
    blocks = int(block[-1]) + 1
    title = f"The same, enlarged: means over {hours(step_s)}"
    series = {name: block_means(values, block, blocks) for name, values in left.items()}
    time_s = (np.arange(blocks) + 0.5) * np.float64(step_s)
    panel = lines_panel(title, "residual [µm]", time_s, series, height_in=1.6)
    return replace(panel, shaded=_shaded(verified))


def _residual_panel(title: str, verified: VerifiedLog, series: Mapping[str, FloatArray]) -> Panel:
    panel = lines_panel(title, "residual [µm]", verified.time_s, series, height_in=1.6)
    return replace(panel, shaded=_shaded(verified))


def gains_of(output: VerifiedOutput, of_model: Output) -> dict[str, float]:
    """Return the gain g by part, for the parts that have one by diameter."""
    return {
        part.name: gain_of(part, output.measured.diameter_mm)
        for part in of_model.parts
        if part.gain_by_diameter
    }


def _with_gain(output: VerifiedOutput, of_model: Output) -> str:
    gains = gains_of(output, of_model)
    if not gains:
        return output.measured.name
    words = ", ".join(f"{gain:.3g}" for gain in gains.values())
    return f"{output.measured.name}\n(g = {words})"
