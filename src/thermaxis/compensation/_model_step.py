"""One step of the thermal model: a reading in, the displacement and its correction out.

The same function verifies a model on a log, runs in every cycle on the machine, and is part of
the reference of the text that is exported to a PLC. No clock, no input or output, no exception.
"""

import math
from bisect import bisect_right
from collections.abc import Mapping
from dataclasses import dataclass, field
from itertools import pairwise
from types import MappingProxyType
from typing import final

from thermaxis.compensation._quality import Outcome, Quality
from thermaxis.compensation._thermal_model import START, STATED, CompensationModel, GainPoint, Part

LARGEST_VALUE = 1e6
"""A reading of larger magnitude is no temperature and no speed: it counts as missing."""

MOST_HISTORY = 200_000
"""Readings that a delay looks back at most; more of them shorten it. [1]"""
_SAME_TIME_S = 1e-6

_Floats = tuple[float, ...]


def _no_values() -> Mapping[str, float | None]:
    return MappingProxyType({})


@final
@dataclass(frozen=True, slots=True)
class Reading:
    """What was read at one time."""

    time_s: float
    """Time of the reading, of a clock that only goes forward. [s]"""
    values: Mapping[str, float | None] = field(default_factory=_no_values)
    """Value by channel; missing, None or not finite where there is no good value. [degC]"""
    diameter_mm: float | None = None
    """Clamping diameter of the workpiece; None for the tool centre point. [mm]"""


@final
@dataclass(frozen=True, slots=True)
class ThermalState:
    """What a cycle leaves for the next one. Numbers only: it can be stored and restored."""

    time_s: float | None = None
    """Time of the last reading; None before the first good one. [s]"""
    reference: _Floats = ()
    """Reference by channel. [degC]"""
    value: _Floats = ()
    """Last good value by channel. [degC]"""
    good_s: _Floats = ()
    """Time of the last good value by channel. [s]"""
    filtered: tuple[_Floats, ...] = ()
    """Input of every part, by output, that acts until the next reading. [K]"""
    raw: tuple[_Floats, ...] = ()
    """The same before the filter. [K]"""
    sections: tuple[tuple[_Floats, ...], ...] = ()
    """States of the sections, by output and part. [K]"""
    history: tuple[tuple[float, tuple[_Floats, ...]], ...] = ()
    """Past readings, time and inputs, as far back as the longest delay."""
    warm: bool = False
    """Whether the machine is warm at the start: the first reading is then a steady state, even
    of a model that refers to its start."""
    model: CompensationModel | None = field(default=None, repr=False, compare=False)
    """Model whose cycle made the state; a state of any other origin is checked before its use."""


@final
@dataclass(frozen=True, slots=True)
class ModelOutput:
    """What the model says after a reading."""

    time_s: float
    """Time of the reading. [s]"""
    model_um: _Floats
    """Displacement by output: tool point relative to workpiece, positive away from it. [µm]"""
    correction_um: _Floats
    """Minus the displacement, by output. [µm]"""
    contribution_um: tuple[_Floats, ...]
    """What every part contributes, by output; the offset is not in it. [µm]"""
    quality: Quality
    """Whether it may be used."""
    outcomes: tuple[Outcome, ...]
    """What was out of the ordinary."""


def initial_state(
    model: CompensationModel, reference_c: Mapping[str, float] | None = None
) -> ThermalState:
    """Return the state before the first reading.

    Parameters
    ----------
    model : CompensationModel
        The model.
    reference_c : mapping, optional
        Reference by channel, such as the mean of the first minute. Default: what the model
        states, or else the first good value of each channel. [degC]

    Returns
    -------
    ThermalState
        A state in which no time has passed; channels without a reference take the first value.
    """
    given: Mapping[str, float] = {}
    if reference_c is not None:
        given = reference_c
    elif model.reference == STATED:
        given = model.reference_c
    return ThermalState(reference=tuple(given.get(c, math.nan) for c in model.channels))


def model_step(
    model: CompensationModel, state: ThermalState, reading: Reading
) -> tuple[ThermalState, ModelOutput]:
    """Advance the model to a reading and return what it says.

    First every section is advanced with the input that has acted since the last reading, then the
    output is read with the present input: exact for inputs that are held from reading to reading.
    The model starts once every channel has a value that is no older than it may be held: at rest
    where it refers to its start, else at the steady state of the reading. It starts anew at the
    steady state after a gap or when the clock goes backward, and as if for the first time where a
    state does not fit the model or has led to no number.

    Not protected: the correction is neither limited nor ramped here, and after a new start it
    jumps. Whether a temperature is plausible is judged by its being a finite number only.

    Parameters
    ----------
    model : CompensationModel
        The model.
    state : ThermalState
        What `initial_state` or the last step returned.
    reading : Reading
        Time, values and workpiece.

    Returns
    -------
    state : ThermalState
        For the next cycle.
    output : ModelOutput
        Displacement, correction, contributions, quality and outcomes.

    References
    ----------
    Mareš and Horejš 2021, equations (3) and (8), in parallel form.
    """
    outcomes: list[Outcome] = []
    if state.model is not model and not _fits(model, state):
        outcomes.append(Outcome.STATE_UNUSABLE)
        state = initial_state(model)
    time_s = _number(reading.time_s)
    if time_s is None:
        return state, _unmoved(model, state, reading)
    value, good_s, quality = _read(model, state, reading, time_s, outcomes)
    start = _start_reason(model, state, time_s)
    if start is not None and quality is Quality.BAD:
        waiting = ThermalState(
            reference=state.reference, value=value, good_s=good_s, warm=state.warm, model=model
        )
        return waiting, _idle(model, time_s, (*outcomes, Outcome.WAITING))
    reference = state.reference
    if any(r != r for r in reference):  # noqa: PLR0124 - NaN: takes the first value
        reference = tuple(v if r != r else r for r, v in zip(reference, value, strict=True))  # noqa: PLR0124 - as above
    raw = _inputs(model, value, reference, outcomes)
    if start is None:
        if time_s == state.time_s:
            outcomes.append(Outcome.CLOCK_STILL)
        advanced = _advance(model, state, raw, time_s)
    else:
        outcomes.append(start)
        at_reference = start is Outcome.STARTED and model.reference == START and not state.warm
        advanced = _steady(model, raw, time_s, at_reference=at_reference)
    filtered, sections, history = advanced
    new = ThermalState(
        time_s, reference, value, good_s, filtered, raw, sections, history, model=model
    )
    output = _output(model, new, reading, quality, outcomes)
    if all(map(math.isfinite, output.model_um)):
        return new, output
    fresh = initial_state(model)
    return fresh, _idle(model, time_s, (Outcome.STATE_UNUSABLE,))


def _fits(model: CompensationModel, state: ThermalState) -> bool:
    """Whether a state of unknown origin has the shape of the model; numbers are judged later."""
    channels = len(model.channels)
    if len(state.reference) != channels:
        return False
    if state.time_s is None:
        return {len(state.value), len(state.good_s)} <= {0, channels}
    if len(state.value) != channels or len(state.good_s) != channels or not state.history:
        return False
    parts = [len(output.parts) for output in model.outputs]
    inputs = [state.filtered, state.raw, *(rows for _, rows in state.history)]
    if any([len(row) for row in rows] != parts for rows in inputs):
        return False
    lags = [[len(part.sections) for part in output.parts] for output in model.outputs]
    if [[len(x) for x in rows] for rows in state.sections] != lags:
        return False
    times = [time_s for time_s, _ in state.history]
    return all(a < b for a, b in pairwise(times))


# ---- reading ------------------------------------------------------------------------------------


def _number(value: object) -> float | None:
    """Return a usable number, or None: NaN, infinite, huge, or no number at all."""
    if type(value) is float:
        return value if -LARGEST_VALUE <= value <= LARGEST_VALUE else _large_time(value)
    if isinstance(value, bool) or not isinstance(value, int | float):
        return None
    if abs(value) > 1e15:
        return None
    return float(value)


def _large_time(value: float) -> float | None:
    return value if abs(value) <= 1e15 else None  # seconds since 1970 are a good time


def _read(
    model: CompensationModel,
    state: ThermalState,
    reading: Reading,
    time_s: float,
    outcomes: list[Outcome],
) -> tuple[_Floats, _Floats, Quality]:
    """Return the value of every channel, held where it fails, and when each was last good."""
    values: Mapping[str, object] = reading.values if isinstance(reading.values, Mapping) else {}  # pyright: ignore[reportUnnecessaryIsInstance] - whatever a source sends
    channels = model.channels
    fresh = [_number(values.get(c)) for c in channels]
    if None not in fresh and all(abs(v) <= LARGEST_VALUE for v in fresh if v is not None):
        return tuple(v for v in fresh if v is not None), (time_s,) * len(channels), Quality.GOOD
    last = state.value or (math.nan,) * len(channels)
    last_s = state.good_s or (math.nan,) * len(channels)
    value: list[float] = []
    good_s: list[float] = []
    failed = False
    for k, v in enumerate(fresh):
        if v is not None and abs(v) <= LARGEST_VALUE:
            value.append(v)
            good_s.append(time_s)
        else:
            value.append(last[k])
            good_s.append(last_s[k])
            failed = failed or not 0.0 <= time_s - last_s[k] <= model.longest_hold_s
    outcomes.append(Outcome.INPUT_FAILED if failed else Outcome.INPUT_HELD)
    return tuple(value), tuple(good_s), Quality.BAD if failed else Quality.HELD


def _inputs(
    model: CompensationModel, value: _Floats, reference: _Floats, outcomes: list[Outcome]
) -> tuple[_Floats, ...]:
    """Return the relative input of every part, by output."""
    relative = {c: v - r for c, v, r in zip(model.channels, value, reference, strict=True)}
    outside = False
    inputs: list[_Floats] = []
    for output in model.outputs:
        row: list[float] = []
        for part in output.parts:
            u = relative[part.plus]
            if part.minus:
                u -= relative[part.minus]
            row.append(u)
            if part.lowest_k is not None and part.highest_k is not None:
                outside = outside or not part.lowest_k <= u <= part.highest_k
        inputs.append(tuple(row))
    if outside:
        outcomes.append(Outcome.OUTSIDE_VALIDITY)
    return tuple(inputs)


# ---- sections -----------------------------------------------------------------------------------


def _start_reason(model: CompensationModel, state: ThermalState, time_s: float) -> Outcome | None:
    if state.time_s is None:
        return Outcome.STARTED
    elapsed_s = time_s - state.time_s
    if elapsed_s < 0.0:
        return Outcome.CLOCK_BACKWARD
    return Outcome.GAP if elapsed_s > model.longest_gap_s else None


_Advanced = tuple[
    tuple[_Floats, ...],
    tuple[tuple[_Floats, ...], ...],
    tuple[tuple[float, tuple[_Floats, ...]], ...],
]


def _steady(
    model: CompensationModel, raw: tuple[_Floats, ...], time_s: float, *, at_reference: bool
) -> _Advanced:
    """Return the steady state of the inputs; at the reference every section is at rest.

    A model that refers to its start knows the start better from the reference, a mean over some
    time, than from the noise of one reading.
    """
    sections = tuple(
        tuple(
            (0.0 if at_reference else u,) * len(part.sections)
            for part, u in zip(output.parts, row, strict=True)
        )
        for output, row in zip(model.outputs, raw, strict=True)
    )
    return raw, sections, ((time_s, raw),)


def _advance(
    model: CompensationModel, state: ThermalState, raw: tuple[_Floats, ...], time_s: float
) -> _Advanced:
    """Return filtered inputs, sections and history at the time of the reading."""
    before_s = state.time_s if state.time_s is not None else time_s
    elapsed_s = time_s - before_s
    filtered = raw
    if model.input_filter_s > 0.0:
        alpha = -math.expm1(-elapsed_s / model.input_filter_s)
        filtered = tuple(
            tuple(f + alpha * (u - f) for f, u in zip(f_row, u_row, strict=True))
            for f_row, u_row in zip(state.filtered, state.raw, strict=True)
        )
    history, longest_s = state.history, _longest_delay(model)
    sections: list[tuple[_Floats, ...]] = []
    acting = state.filtered
    for o, output in enumerate(model.outputs):
        rows: list[_Floats] = []
        for p, part in enumerate(output.parts):
            x = state.sections[o][p]
            if part.delay_s > 0.0:
                pieces = _pieces(history, before_s - part.delay_s, time_s - part.delay_s, o, p)
            else:
                pieces = ((acting[o][p], elapsed_s),)
            for u, seconds in pieces:
                x = tuple(
                    v - math.expm1(-seconds / section.time_constant_s) * (u - v)
                    for v, section in zip(x, part.sections, strict=True)
                )
            rows.append(x)
        sections.append(tuple(rows))
    if longest_s > 0.0:
        if history[-1][0] == time_s:
            history = history[:-1]
        history = _kept((*history, (time_s, filtered)), time_s - longest_s)
    else:
        history = ((time_s, filtered),)
    return filtered, tuple(sections), history


def _pieces(
    history: tuple[tuple[float, tuple[_Floats, ...]], ...],
    first_s: float,
    last_s: float,
    o: int,
    p: int,
) -> list[tuple[float, float]]:
    """Return the input that was held over a past stretch of time, as (value, seconds)."""
    begin = max(bisect_right(history, first_s + _SAME_TIME_S, key=_time_of) - 1, 0)
    pieces: list[tuple[float, float]] = []
    at_s = first_s
    for k in range(begin, len(history)):
        later = k + 1 < len(history)
        until_s = min(history[k + 1][0], last_s) if later else last_s
        if until_s > at_s:
            pieces.append((history[k][1][o][p], until_s - at_s))
            at_s = until_s
        if later and history[k + 1][0] >= last_s:
            break
    return pieces


def _longest_delay(model: CompensationModel) -> float:
    return max(part.delay_s for output in model.outputs for part in output.parts)


def _kept(
    history: tuple[tuple[float, tuple[_Floats, ...]], ...], oldest_s: float
) -> tuple[tuple[float, tuple[_Floats, ...]], ...]:
    """Return the history without what no delay reaches any more."""
    first = 0
    while first + 2 < len(history) and history[first + 1][0] <= oldest_s - _SAME_TIME_S:
        first += 1
    return history[max(first, len(history) - MOST_HISTORY) :]


def _time_of(entry: tuple[float, tuple[_Floats, ...]]) -> float:
    return entry[0]


def _delayed(
    history: tuple[tuple[float, tuple[_Floats, ...]], ...], time_s: float, o: int, p: int
) -> float:
    """Return the input that was held at a time; before the first reading its first value."""
    later = bisect_right(history, time_s + _SAME_TIME_S, key=_time_of)
    return history[max(later - 1, 0)][1][o][p]


# ---- output -------------------------------------------------------------------------------------


def _gain_at(points: tuple[GainPoint, ...], diameter_mm: float) -> float:
    """Return the gain at a diameter, linear between the points, end values held."""
    if diameter_mm <= points[0].diameter_mm:
        return points[0].gain
    for low, high in pairwise(points):
        if diameter_mm <= high.diameter_mm:
            share = (diameter_mm - low.diameter_mm) / (high.diameter_mm - low.diameter_mm)
            return low.gain + share * (high.gain - low.gain)
    return points[-1].gain


def gain_of(part: Part, diameter_mm: float | None) -> float:
    """Return the gain g of a part for a workpiece.

    Parameters
    ----------
    part : Part
        The part.
    diameter_mm : float or None
        Clamping diameter, None for the tool centre point. [mm]

    Returns
    -------
    float
        The gain, linear between the stated diameters, their end values outside; 1 for a part
        without gains. [1]

    References
    ----------
    Mareš and Horejš 2021, equation (6).
    """
    if not part.gain_by_diameter:
        return 1.0
    return part.tool_gain if diameter_mm is None else _gain_at(part.gain_by_diameter, diameter_mm)


def _part_gain(part: Part, diameter_mm: float | None, outcomes: list[Outcome]) -> float:
    points = part.gain_by_diameter
    if diameter_mm is None:
        return part.tool_gain
    inside = points[0].diameter_mm <= diameter_mm <= points[-1].diameter_mm
    if not inside and Outcome.DIAMETER_HELD not in outcomes:
        outcomes.append(Outcome.DIAMETER_HELD)
    return _gain_at(points, diameter_mm)


def _output(
    model: CompensationModel,
    state: ThermalState,
    reading: Reading,
    quality: Quality,
    outcomes: list[Outcome],
) -> ModelOutput:
    time_s = state.time_s if state.time_s is not None else 0.0
    diameter = None if reading.diameter_mm is None else _number(reading.diameter_mm)
    if reading.diameter_mm is not None and diameter is None:
        outcomes.append(Outcome.DIAMETER_UNKNOWN)
    model_um: list[float] = []
    contribution_um: list[_Floats] = []
    for o, output in enumerate(model.outputs):
        row: list[float] = []
        for p, part in enumerate(output.parts):
            u = state.filtered[o][p]
            if part.delay_s > 0.0:
                u = _delayed(state.history, time_s - part.delay_s, o, p)
            y = part.direct_gain_um_per_k * u
            for x, section in zip(state.sections[o][p], part.sections, strict=True):
                y += section.gain_um_per_k * x
            if part.gain_by_diameter:
                y *= _part_gain(part, diameter, outcomes)
            row.append(y)
        contribution_um.append(tuple(row))
        model_um.append(output.offset_um + sum(row))
    return ModelOutput(
        time_s,
        tuple(model_um),
        tuple(-y for y in model_um),
        tuple(contribution_um),
        quality,
        tuple(outcomes),
    )


def _unmoved(model: CompensationModel, state: ThermalState, reading: Reading) -> ModelOutput:
    """Return the last output again, as bad: a reading without a time says nothing."""
    if state.time_s is None or not math.isfinite(state.time_s):
        return _idle(model, 0.0, (Outcome.CLOCK_UNUSABLE,))
    return _output(model, state, reading, Quality.BAD, [Outcome.CLOCK_UNUSABLE])


def _idle(model: CompensationModel, when_s: float, why: tuple[Outcome, ...]) -> ModelOutput:
    """Return the output of a cycle in which the model could say nothing."""
    nothing = (0.0,) * len(model.outputs)
    parts = tuple((0.0,) * len(output.parts) for output in model.outputs)
    return ModelOutput(when_s, nothing, nothing, parts, Quality.BAD, why)
