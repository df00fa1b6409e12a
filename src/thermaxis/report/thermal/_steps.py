"""Charts of what a model does to a step and to a sine, with what is known of the uncertainty."""

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
    Look,
    Panel,
    PanelGrid,
    ThermalChart,
    Trace,
    panel_chart,
)
from thermaxis.thermal import (
    IdentifiedOutput,
    ModalPart,
    ThermalModel,
    frequency_deviations,
    frequency_response,
    step_response,
    step_responses,
)
from thermaxis.thermal.transfer_function import ComplexArray

INTERVAL = 1.96
"""Standard deviations of a 95 % interval. [1]"""
MOST_PANELS = 6
"""Panels of one chart. [1]"""
_SETTLED = 4.0
"""Steps are drawn for so many of the longest time constants. [1]"""
_POINTS = 400
_BODE = ("gain [µm/K]", "phase [deg]")
_LEAST_GAIN = 1e-9
_LOG_ROOM = 3.0
"""A band of a gain that leaves the gains by more than this factor is cut. [1]"""
_BAND_ROOM = 1.5
"""A band that leaves the responses by more than this share of them is cut. [1]"""
_MOST_ROWS = 20_000
"""Rows for which the band of a polynomial model is computed. [row]"""


@final
@dataclass(frozen=True, slots=True, eq=False)
class Responses:
    """Curves of one output: the response to a step, or the gain or phase of that to a sine."""

    name: str
    x: FloatArray
    """Times since the step, or frequencies, (n,). [h or 1/h]"""
    curve: Mapping[str, FloatArray]
    """Curve by input, (n,) each. [µm/K or deg]"""
    std: Mapping[str, FloatArray]
    """Its standard deviation by input where it is known, (n,) each. [µm/K or deg]"""


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


def response_charts(
    model: CompensationModel, *, record_s: float, record_name: str
) -> tuple[ThermalChart, ...]:
    """Return step responses (the right part of figure 4) and Bode diagrams of a model file."""
    models = [(output.name, thermal_model_of_output(output), None) for output in model.outputs]
    gains = any(part.gain_by_diameter for output in model.outputs for part in output.parts)
    note = " No bands: a model file says nothing of its uncertainty." + (
        " Gains by diameter are not applied." if gains else ""
    )
    return _charts(models, record_s, record_name, model.sample_time_s, (note, note))


def identified_response_charts(
    outputs: Sequence[IdentifiedOutput], *, record_s: float, sample_time_s: float
) -> tuple[ThermalChart, ...]:
    """Return step responses and Bode diagrams of identified models, with bands where known."""
    stable = [(o.name, o.model, o) for o in outputs if o.model is not None]
    if not stable:
        return ()
    banded = (
        " Pale, where it is known: 95 % band, by all sets of lags that the record leaves open; it"
        " can be too narrow at periods of an hour and less."
    )
    if any(o.polynomials is not None for o in outputs):
        banded = " Pale, where it is known: 95 % band of the polynomials, white residual assumed."
    notes = banded, " No bands: none is known of these inputs and lags."
    return _charts(stable, record_s, "length of the record", sample_time_s, notes)


_Model = tuple[str, ThermalModel, IdentifiedOutput | None]


def _charts(
    models: Sequence[_Model],
    record_s: float,
    record_name: str,
    sample_time_s: float,
    notes: tuple[str, str],
) -> tuple[ThermalChart, ...]:
    """Return both charts; of the notes the first where a band is drawn, else the second."""
    taus_s = np.concatenate([p.time_constants_s for _, m, _ in models for p in m.parts])
    delay_s = max(p.delay_s for _, m, _ in models for p in m.parts)
    longest_s = float(np.max(taus_s)) if taus_s.size else record_s / _SETTLED
    shortest_s = float(np.min(taus_s)) if taus_s.size else longest_s
    times_s = np.linspace(0.0, _SETTLED * longest_s + delay_s, _POINTS)
    highest_hz = max(min(1.0 / shortest_s, 0.5 / sample_time_s), 1.0 / longest_s)
    hz = np.geomspace(0.02 / longest_s, highest_hz, _POINTS)
    steps = [_step(name, model, output, times_s) for name, model, output in models]
    bodes = [_bode(name, model, output, hz) for name, model, output in models]
    note = notes[not any(one.std for one in steps[:MOST_PANELS])]
    shown, count = _shown_inputs(steps)
    looks = dict(zip(shown, LOOKS, strict=False))
    drawn, records_h = len(models[:MOST_PANELS]), max(record_s, 1.0) / HOUR_S
    more = f" The first {drawn} of {len(models)} outputs." if len(models) > drawn else ""
    few = f": the {len(shown)} of {count} inputs that act most" if count > len(shown) else ""
    step_panels = tuple(
        _panel(one, looks, "response [µm/K]", mark=records_h, mark_label=record_name)
        for one in steps[:MOST_PANELS]
    )
    step_grid = PanelGrid(
        heading=f"Response to a lasting step of 1 K in one input{few}",
        source="behind the mark the response is extrapolated"
        if any(p.mark is not None for p in step_panels)
        else "",
        panels=step_panels,
        axis="time since the step [h]",
        columns=2 if drawn > 1 else 1,
        one_legend=drawn > 1,
    )
    period = f"period = {record_name.rpartition(' ')[2]}"
    bode_panels = [
        _panel(one, looks, quantity, mark=1.0 / records_h, mark_label=period, log_y=log_y)
        for both in bodes[:MOST_PANELS]
        for one, quantity, log_y in zip(both, _BODE, (True, False), strict=True)
    ]
    bode_grid = PanelGrid(
        heading=f"Bode diagram: gain and phase of each input{few}",
        source="",
        panels=tuple(bode_panels),
        axis="frequency [1/h]",
        columns=2,
        one_legend=True,
        log_x=True,
    )
    caption = f"Step responses of the model (right part of figure 4 of the paper).{note}{more}"
    bode_caption = (
        f"Gain and phase of what a sine in one input does.{note} Left of the mark the record is"
        f" shorter than one period.{more}"
    )
    return (
        panel_chart("figure_04_step_responses", caption, step_grid),
        panel_chart("bode", bode_caption, bode_grid),
    )


def _step(
    name: str, model: ThermalModel, output: IdentifiedOutput | None, times_s: FloatArray
) -> Responses:
    response = step_response(model, times_s)
    std: FloatArray | None = None
    if output is not None and output.posterior is not None:
        square, _ = output.posterior.deviations(lambda tau_s: -np.expm1(-times_s[:, None] / tau_s))
        late = [times_s - part.delay_s for part in model.parts]
        std = _interpolated(late, times_s, np.sqrt(np.maximum(square, 0.0)))
    elif output is not None and output.polynomials is not None:
        step_s = output.polynomials.model.sample_time_s
        rows = int(np.clip(times_s[-1] / step_s + 1, 2, _MOST_ROWS))
        found = step_responses(output.polynomials, rows)
        std = _interpolated([times_s] * len(model.parts), found.times_s, found.std)
    return _responses(name, model, times_s / HOUR_S, response, std)


def _interpolated(
    at_s: Sequence[FloatArray], times_s: FloatArray, columns: FloatArray
) -> FloatArray:
    each = zip(at_s, columns.T, strict=True)
    return np.stack([np.asarray(np.interp(t, times_s, c), np.float64) for t, c in each], axis=1)


def _bode(
    name: str, model: ThermalModel, output: IdentifiedOutput | None, hz: FloatArray
) -> tuple[Responses, Responses]:
    """Return gain and phase; of a negative gain it begins at the 180 degrees that keep it small.

    With d the deviation of a response G of phase factor e = G / |G|, to first order gain and phase
    vary by Re(d / e) and Im(d / e) / |G|.
    """
    response = frequency_response(model, hz)
    gain = np.maximum(np.abs(response), _LEAST_GAIN)
    phase = np.asarray(np.degrees(np.unwrap(np.angle(response), axis=0)), dtype=np.float64)
    turns = np.asarray(np.floor(np.mean(phase, axis=0) / 360.0 + 0.5), dtype=np.float64)
    phase = phase - 360.0 * turns * (np.abs(phase[0]) > 90.0)
    both: tuple[FloatArray, FloatArray] | None = None
    if output is not None and output.posterior is not None:
        plain, square = output.posterior.deviations(
            lambda taus_s: 1.0 / (1.0 + 2j * np.pi * hz[:, None] * taus_s)
        )
        square = square * np.exp(
            -4j * np.pi * hz[:, None] * np.array([p.delay_s for p in model.parts])
        )
        both = _gain_and_phase_std(response, plain, square)
    elif output is not None and output.polynomials is not None:
        both = _gain_and_phase_std(response, *frequency_deviations(output.polynomials, hz))
    stds = (None, None) if both is None else both
    per_hour = hz * HOUR_S
    return (
        _responses(name, model, per_hour, gain, stds[0]),
        _responses(name, model, per_hour, phase, stds[1]),
    )


def _gain_and_phase_std(
    response: ComplexArray, plain: FloatArray, square: ComplexArray
) -> tuple[FloatArray, FloatArray]:
    gain = np.maximum(np.abs(response), 1e-300)
    along = (square * np.conj(response / gain) ** 2).real
    of_gain, of_phase = (np.sqrt(np.maximum(plain + s * along, 0.0) / 2.0) for s in (1.0, -1.0))
    return of_gain, np.minimum(np.degrees(of_phase / gain), 180.0 / INTERVAL)


def _responses(
    name: str, model: ThermalModel, x: FloatArray, curves: FloatArray, std: FloatArray | None
) -> Responses:
    names = model.input_names
    each = zip(names, std.T, strict=True) if std is not None else ()
    by_input = {n: one for n, one in each if not np.any(np.isnan(one))}
    return Responses(name, x, {n: curves[:, k] for k, n in enumerate(names)}, by_input)


def _shown_inputs(steps: Sequence[Responses]) -> tuple[list[str], int]:
    """Return the inputs that act most on some output, and how many there are."""
    weight: dict[str, float] = {}
    for output in steps:
        most = max(float(np.max(np.abs(r))) for r in output.curve.values()) or 1.0
        for name, response in output.curve.items():
            own = max(float(np.max(np.abs(response))), span_of(response)) / most
            weight[name] = max(weight.get(name, 0.0), own)
    order = sorted(weight, key=lambda name: -weight[name])[:MOST_LINES]
    return [name for name in weight if name in order], len(weight)


def _panel(
    output: Responses,
    looks: Mapping[str, Look],
    quantity: str,
    *,
    mark: float,
    mark_label: str,
    log_y: bool = False,
) -> Panel:
    traces = tuple(
        Trace(name, output.x, output.curve[name], look)
        for name, look in looks.items()
        if name in output.curve
    )
    low = min(float(np.min(trace.y)) for trace in traces)
    high = max(float(np.max(trace.y)) for trace in traces)
    room = _BAND_ROOM * max(high - low, abs(low), abs(high))
    least, most = (low / _LOG_ROOM, high * _LOG_ROOM) if log_y else (low - room, high + room)
    areas: list[Area] = []
    for trace in traces:
        if trace.label not in output.std:
            continue
        half = INTERVAL * output.std[trace.label]
        low, high = trace.y - half, trace.y + half
        cut = bool(np.any((low < least) | (high > most)))
        low, high = np.maximum(low, least), np.minimum(high, most)
        label = "95 % band, cut" if cut else "95 % band"
        areas.append(Area(label, output.x, low, high, trace.look.colour, trace.label))
    return Panel(
        title=output.name,
        quantity=quantity,
        traces=traces,
        areas=tuple(areas),
        mark=mark if output.x[0] < mark < output.x[-1] else None,
        mark_label=mark_label,
        height_in=1.8,
        log_y=log_y,
    )
