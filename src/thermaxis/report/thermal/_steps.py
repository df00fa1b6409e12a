"""Charts of what a model is: step responses, time constants, poles."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import final

import numpy as np

from thermaxis.compensation import CompensationModel, Output
from thermaxis.positioning import FloatArray
from thermaxis.report.thermal._conditions import HOUR_S
from thermaxis.report.thermal._lines import span_of
from thermaxis.report.thermal._panels import (
    LOOKS,
    MOST_LINES,
    Area,
    ErrorBar,
    Panel,
    PanelGrid,
    ThermalChart,
    Trace,
    panel_chart,
)
from thermaxis.thermal import (
    IdentifiedOutput,
    ModalPart,
    PolynomialResult,
    ThermalModel,
    step_response,
    step_responses,
)

INTERVAL = 1.96
"""Standard deviations of a 95 % interval. [1]"""
MOST_PANELS = 6
"""Panels of one chart. [1]"""
_SETTLED = 4.0
"""Steps are drawn for so many of the longest time constants. [1]"""
_POINTS = 400
_BAND_ROOM = 1.5
"""A band that leaves the responses by more than this share of them is cut. [1]"""
_MOST_ROWS = 20_000
"""Rows for which the band of a polynomial model is computed. [row]"""


@final
@dataclass(frozen=True, slots=True, eq=False)
class Steps:
    """Step responses of one output."""

    name: str
    """The output."""
    times_s: FloatArray
    """Times since the step, (n,). [s]"""
    response: Mapping[str, FloatArray]
    """Response by input, (n,) each. [µm/K]"""
    std: Mapping[str, FloatArray]
    """Its standard deviation by input where it is known, (n,) each. [µm/K]"""
    dc_gain: Mapping[str, tuple[float, float]]
    """Lasting response and its standard deviation by input where it is known. [µm/K]"""


def thermal_model_of_output(output: Output) -> ThermalModel:
    """Return an output of a compensation model in the form of the identification."""
    return ThermalModel(
        tuple(
            ModalPart(
                part.name,
                part.direct_gain_um_per_k,
                np.array([section.gain_um_per_k for section in part.sections]),
                np.array([section.time_constant_s for section in part.sections]),
                part.delay_s,
            )
            for part in output.parts
        ),
        output.offset_um,
    )


def step_chart(model: CompensationModel, *, record_s: float, record_name: str) -> ThermalChart:
    """Return the step responses of a compensation model; the right part of figure 4."""
    models = [(output.name, thermal_model_of_output(output)) for output in model.outputs]
    horizon = _horizon([m for _, m in models], record_s)
    steps = [_modal_steps(name, m, horizon) for name, m in models]
    gains = any(part.gain_by_diameter for output in model.outputs for part in output.parts)
    note = " Gains by diameter are not applied." if gains else ""
    return _chart(steps, record_s, record_name, note)


def identified_step_chart(
    outputs: Sequence[IdentifiedOutput], *, record_s: float
) -> ThermalChart | None:
    """Return the step responses of identified models with what is known of their uncertainty."""
    stable = [(o, o.model) for o in outputs if o.model is not None]
    if not stable:
        return None
    horizon = _horizon([m for _, m in stable], record_s)
    steps = [
        _modal_steps(o.name, m, horizon, o)
        if o.polynomials is None
        else _polynomial_steps(o.name, o.polynomials, horizon)
        for o, m in stable
    ]
    if any(s.std for s in steps):
        note = " Pale: 95 % band, white residual assumed."
    elif any(s.dc_gain for s in steps):
        note = " Bars at the right end: 95 % interval of the lasting response."
    else:
        note = " No interval: this choice of inputs and lags supports none."
    return _chart(steps, record_s, "length of the record", note)


def _horizon(models: Sequence[ThermalModel], record_s: float) -> float:
    longest = [
        float(np.max(part.time_constants_s)) + part.delay_s
        for model in models
        for part in model.parts
        if part.time_constants_s.size
    ]
    return _SETTLED * max(longest) if longest else record_s


def _modal_steps(
    name: str, model: ThermalModel, horizon_s: float, output: IdentifiedOutput | None = None
) -> Steps:
    times = np.linspace(0.0, horizon_s, _POINTS)
    response = step_response(model, times)
    known = [] if output is None else list(zip(model.parts, output.std, strict=False))
    return Steps(
        name,
        times,
        {part.input_name: response[:, k] for k, part in enumerate(model.parts)},
        {},
        {p.input_name: (p.dc_gain, s.dc_gain) for p, s in known if s.dc_gain is not None},
    )


def _polynomial_steps(name: str, result: PolynomialResult, horizon_s: float) -> Steps:
    rows = int(np.clip(horizon_s / result.model.sample_time_s, 2, _MOST_ROWS))
    found = step_responses(result, rows)
    names = result.model.input_names
    return Steps(
        name,
        found.times_s,
        {n: found.response[:, k] for k, n in enumerate(names)},
        {n: found.std[:, k] for k, n in enumerate(names)},
        {},
    )


def _shown_inputs(steps: Sequence[Steps]) -> tuple[list[str], int]:
    """Return the inputs that act most on some output, and how many there are."""
    weight: dict[str, float] = {}
    for output in steps:
        most = max(float(np.max(np.abs(r))) for r in output.response.values()) or 1.0
        for name, response in output.response.items():
            own = max(float(np.max(np.abs(response))), span_of(response)) / most
            weight[name] = max(weight.get(name, 0.0), own)
    order = sorted(weight, key=lambda name: -weight[name])[:MOST_LINES]
    return [name for name in weight if name in order], len(weight)


def _chart(steps: Sequence[Steps], record_s: float, record_name: str, note: str) -> ThermalChart:
    shown, count = _shown_inputs(steps)
    looks = dict(zip(shown, LOOKS, strict=False))
    drawn = steps[:MOST_PANELS]
    panels = tuple(_step_panel(output, looks, record_s, record_name) for output in drawn)
    side_by_side = len(panels) > 1
    grid = PanelGrid(
        heading="Response to a lasting step of 1 K in one input"
        + (f": the {len(shown)} of {count} inputs that act most" if count > len(shown) else ""),
        source="behind the mark the response is extrapolated"
        if any(p.mark is not None for p in panels)
        else "",
        panels=panels,
        axis="time since the step [h]",
        columns=2 if side_by_side else 1,
        one_legend=side_by_side,
    )
    more = f" The first {len(drawn)} of {len(steps)} outputs." if len(steps) > len(drawn) else ""
    caption = f"Step responses of the model (right part of figure 4 of the paper).{note}{more}"
    return panel_chart("figure_04_step_responses", caption, grid)


def _step_panel(
    output: Steps, looks: Mapping[str, object], record_s: float, record_name: str
) -> Panel:
    hours = output.times_s / HOUR_S
    traces: list[Trace] = []
    areas: list[Area] = []
    bars: list[ErrorBar] = []
    for number, look in enumerate(LOOKS):
        name = list(looks)[number] if number < len(looks) else ""
        if name not in output.response:
            continue
        response = output.response[name]
        traces.append(Trace(name, hours, response, look))
        if name in output.std:
            half = INTERVAL * output.std[name]
            areas.append(Area("95 % band", hours, response - half, response + half))
        if name in output.dc_gain:
            gain, std = output.dc_gain[name]
            place = float(hours[-1]) * (1.02 + 0.015 * number)
            bars.append(ErrorBar(place, gain, INTERVAL * std, look))
    low = min(float(np.min(trace.y)) for trace in traces)
    high = max(float(np.max(trace.y)) for trace in traces)
    room = _BAND_ROOM * max(high - low, abs(low), abs(high))
    cut = any(bool(np.any((a.low < low - room) | (a.high > high + room))) for a in areas)
    shown = tuple(
        Area(
            "95 % band, cut" if cut else "95 % band",
            area.x,
            np.maximum(area.low, low - room),
            np.minimum(area.high, high + room),
        )
        for area in areas
    )
    within = record_s < float(output.times_s[-1])
    return Panel(
        title=output.name,
        quantity="response [µm/K]",
        traces=tuple(traces),
        areas=shown,
        bars=tuple(bars),
        mark=record_s / HOUR_S if within else None,
        mark_label=record_name,
        height_in=1.8,
    )
