"""One step of the thermal model: a reading in, the displacement and its correction out.

The same function verifies a model on a log, runs in every cycle on the machine, and is part of
the reference of the text that is exported to a PLC. No clock, no input or output, no exception.
"""

import math
from bisect import bisect_right
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from math import expm1
from types import MappingProxyType
from typing import NamedTuple, final

from thermaxis.compensation._quality import Outcome, Quality
from thermaxis.compensation._thermal_model import (
    START,
    STATED,
    CompensationModel,
    GainPoint,
    Layout,
    Part,
)

LARGEST_VALUE = 1e6
"""A reading of larger magnitude is no temperature and no speed: it counts as missing."""

LATEST_S = 1e15
"""Largest magnitude of a time; seconds since 1970 are a good time. [s]"""
MOST_HISTORY = 200_000
"""Readings that a delay looks back at most; more of them shorten it. [1]"""
_SAME_TIME_S = 1e-6
_NO_SECTION = (0.0,)
_COLD = False
_NO_PACE: tuple[float, tuple[float, ...]] = (0.0, ())

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
class ThermalState(NamedTuple):
    """What a cycle leaves for the next one. Numbers only: it can be stored and restored."""

    time_s: float | None = None
    """Time of the last reading; None before the first good one. [s]"""
    reference: _Floats = ()
    """Reference by channel. [degC]"""
    value: _Floats = ()
    """Last good value by channel. [degC]"""
    good_s: _Floats = ()
    """Time of the last good value by channel. [s]"""
    filtered: _Floats = ()
    """Every input, in the order of the layout, as it acts until the next reading. [K]"""
    raw: _Floats = ()
    """The same before the filter. [K]"""
    sections: _Floats = ()
    """States of the sections, in the order of the parts. [K]"""
    history: tuple[tuple[float, _Floats], ...] = ()
    """Past readings, time and inputs, as far back as the longest delay."""
    warm: bool = False
    """Whether the machine is warm at the start: the first reading is then a steady state, even
    of a model that refers to its start."""
    pace: tuple[float, _Floats] = (0.0, ())
    """Time between the last readings [s], and alpha of every section for it: computed anew only
    when it changes. [1]"""
    model: CompensationModel | None = None
    """Model whose cycle made the state; a state of any other origin is checked before its use."""


@final
class ModelOutput(NamedTuple):
    """What the model says after a reading."""

    time_s: float
    """Time of the reading. [s]"""
    model_um: _Floats
    """Displacement by output: tool point relative to workpiece, positive away from it. [µm]"""
    contribution_um: tuple[_Floats, ...]
    """What every part contributes, by output; the offset is not in it. [µm]"""
    quality: Quality
    """Whether it may be used."""
    outcomes: tuple[Outcome, ...]
    """What was out of the ordinary."""

    @property
    def correction_um(self) -> _Floats:
        """Minus the displacement, by output. [µm]"""
        return tuple([-y for y in self.model_um])


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
    values: Mapping[str, object] = reading.values if isinstance(reading.values, Mapping) else {}  # pyright: ignore[reportUnnecessaryIsInstance] - whatever a source sends
    fresh = [_value(values.get(channel)) for channel in model.channels]
    return advance(model, state, reading.time_s, fresh, reading.diameter_mm)


def advance(
    model: CompensationModel,
    state: ThermalState,
    time_s: float,
    fresh: Sequence[float | None],
    diameter_mm: float | None,
) -> tuple[ThermalState, ModelOutput]:
    """Advance the model as `model_step` does, with the values in the order of its channels.

    Parameters
    ----------
    model : CompensationModel
        The model.
    state : ThermalState
        What `initial_state` or the last step returned.
    time_s : float
        Time of the reading. [s]
    fresh : sequence of float or None
        One finite value per channel, None where there is none. [degC]
    diameter_mm : float or None
        Clamping diameter of the workpiece. [mm]

    Returns
    -------
    state : ThermalState
        For the next step.
    output : ModelOutput
        What the model says.
    """
    outcomes: list[Outcome] = []
    if state.model is not model:
        if _fits(model, state):
            state = state._replace(pace=(0.0, ()))
        else:
            outcomes.append(Outcome.STATE_UNUSABLE)
            state = initial_state(model)
    now_s = _number(time_s)
    if now_s is None:
        return state, _unmoved(model, state, diameter_mm)
    value, good_s, quality = _present(model, state, fresh, now_s, outcomes)
    start = _start_reason(model, state, now_s, outcomes)
    reference = state.reference
    if start is not None:
        if quality is Quality.BAD:
            waiting = ThermalState(
                reference=reference, value=value, good_s=good_s, warm=state.warm, model=model
            )
            return waiting, _idle(model, now_s, (*outcomes, Outcome.WAITING))
        reference = tuple([v if r != r else r for r, v in zip(reference, value)])  # noqa: PLR0124 - NaN: takes the first value
    raw = _inputs(model.layout, value, reference, outcomes)
    if start is None:
        filtered, sections, history, pace = _advanced(model, state, raw, now_s)
    else:
        outcomes.append(start)
        rest = start is Outcome.STARTED and model.reference == START and not state.warm
        filtered, sections, history, pace = _steady(model.layout, raw, now_s, at_reference=rest)
    new = ThermalState(
        now_s,
        reference,
        value,
        good_s,
        filtered,
        raw,
        sections,
        history,
        _COLD,
        pace,
        model,
    )
    output = _output(model, new, diameter_mm, quality, outcomes)
    total_um = sum(output.model_um)
    if total_um - total_um != 0.0:  # not zero for NaN and infinite alone
        return initial_state(model), _idle(model, now_s, (Outcome.STATE_UNUSABLE,))
    return new, output


def _fits(model: CompensationModel, state: ThermalState) -> bool:
    """Whether a state of unknown origin has the shape of the model; numbers are judged later."""
    channels, layout = len(model.channels), model.layout
    if len(state.reference) != channels:
        return False
    if state.time_s is None:
        return {len(state.value), len(state.good_s)} <= {0, channels}
    if len(state.value) != channels or len(state.good_s) != channels or not state.history:
        return False
    inputs = [state.filtered, state.raw, *(row for _, row in state.history)]
    if any(len(row) != len(layout.wires) for row in inputs):
        return False
    if len(state.sections) != len(layout.taus_s):
        return False
    times = [time_s for time_s, _ in state.history]
    return all(a < b for a, b in pairwise(times))


# ---- reading ------------------------------------------------------------------------------------


def _number(value: object) -> float | None:
    """Return a usable number, or None: NaN, infinite, huge, or no number at all."""
    if type(value) is float:
        return value if -LATEST_S <= value <= LATEST_S else None
    if isinstance(value, bool) or not isinstance(value, int | float):
        return None
    return float(value) if abs(value) <= LATEST_S else None


def _value(value: object) -> float | None:
    """Return a usable temperature or speed, or None."""
    number = _number(value)
    return number if number is not None and abs(number) <= LARGEST_VALUE else None


def _present(
    model: CompensationModel,
    state: ThermalState,
    fresh: Sequence[float | None],
    time_s: float,
    outcomes: list[Outcome],
) -> tuple[_Floats, _Floats, Quality]:
    """Return the value of every channel, when each was last good, and what that is worth."""
    if None in fresh:
        return _held(model, state, fresh, time_s, outcomes)
    value: _Floats = tuple(fresh)  # pyright: ignore[reportAssignmentType] - None is not in it
    return value, (time_s,) * len(value), Quality.GOOD


def _held(
    model: CompensationModel,
    state: ThermalState,
    fresh: Sequence[float | None],
    time_s: float,
    outcomes: list[Outcome],
) -> tuple[_Floats, _Floats, Quality]:
    """Return the value of every channel, held where it fails, and when each was last good."""
    channels = len(model.channels)
    last = state.value or (math.nan,) * channels
    last_s = state.good_s or (math.nan,) * channels
    value: list[float] = []
    good_s: list[float] = []
    failed = False
    for k, v in enumerate(fresh):
        if v is not None:
            value.append(v)
            good_s.append(time_s)
        else:
            value.append(last[k])
            good_s.append(last_s[k])
            failed = failed or not 0.0 <= time_s - last_s[k] <= model.longest_hold_s
    outcomes.append(Outcome.INPUT_FAILED if failed else Outcome.INPUT_HELD)
    return tuple(value), tuple(good_s), Quality.BAD if failed else Quality.HELD


def _inputs(layout: Layout, value: _Floats, reference: _Floats, outcomes: list[Outcome]) -> _Floats:
    """Return every input relative to its reference."""
    raw: list[float] = []
    inside = True
    for (plus, minus), (lowest, highest) in zip(layout.wires, layout.ranges):
        u = value[plus] - reference[plus]
        if minus >= 0:
            u -= value[minus] - reference[minus]
        if not lowest <= u <= highest:
            inside = False
        raw.append(u)
    if not inside:
        outcomes.append(Outcome.OUTSIDE_VALIDITY)
    return tuple(raw)


# ---- sections -----------------------------------------------------------------------------------


def _start_reason(
    model: CompensationModel, state: ThermalState, time_s: float, outcomes: list[Outcome]
) -> Outcome | None:
    before_s = state.time_s
    if before_s is None:
        return Outcome.STARTED
    elapsed_s = time_s - before_s
    if 0.0 < elapsed_s <= model.longest_gap_s:
        return None
    if elapsed_s < 0.0:
        return Outcome.CLOCK_BACKWARD
    if elapsed_s > model.longest_gap_s:
        return Outcome.GAP
    if elapsed_s == 0.0:
        outcomes.append(Outcome.CLOCK_STILL)
    return None


_Row = tuple[float, _Floats]
_Pace = tuple[float, _Floats]
_Advanced = tuple[_Floats, _Floats, tuple[_Row, ...], _Pace]


def _steady(layout: Layout, raw: _Floats, time_s: float, *, at_reference: bool) -> _Advanced:
    """Return the steady state of the inputs; at the reference every section is at rest.

    A model that refers to its start knows the start better from the reference, a mean over some
    time, than from the noise of one reading.
    """
    sections = tuple([0.0 if at_reference else raw[k] for k in layout.drives])
    return raw, sections, ((time_s, raw),), (0.0, ())


def _advanced(
    model: CompensationModel, state: ThermalState, raw: _Floats, time_s: float
) -> _Advanced:
    """Return filtered inputs, sections and history at the time of the reading."""
    last_s, _, _, _, acting, raw_before, states, _, _, pace, _ = state
    before_s = last_s if last_s is not None else time_s
    elapsed_s = time_s - before_s
    layout = model.layout
    filtered = raw
    if model.input_filter_s > 0.0:
        alpha = -expm1(-elapsed_s / model.input_filter_s)
        filtered = tuple([f + alpha * (u - f) for f, u in zip(acting, raw_before)])
    if pace[0] != elapsed_s or not pace[1]:
        pace = elapsed_s, tuple([-expm1(-elapsed_s / tau_s) for tau_s in layout.taus_s])
    if layout.delayed:
        return (*_advanced_with_delays(layout, state, filtered, time_s, before_s), pace)
    sections = tuple(
        [x + alpha * (acting[k] - x) for x, alpha, k in zip(states, pace[1], layout.drives)]
    )
    return filtered, sections, ((time_s, filtered),), pace


def _advanced_with_delays(
    layout: Layout, state: ThermalState, filtered: _Floats, time_s: float, before_s: float
) -> tuple[_Floats, _Floats, tuple[_Row, ...]]:
    """Advance every section with what has arrived behind its part's delay."""
    history, elapsed_s = state.history, time_s - before_s
    sections: list[float] = []
    for i, x in enumerate(state.sections):
        delay_s, tau_s, k = (
            layout.parts[layout.owners[i]].delay_s,
            layout.taus_s[i],
            layout.drives[i],
        )
        if delay_s > 0.0:
            pieces = _pieces(history, before_s - delay_s, time_s - delay_s, k)
        else:
            pieces = [(state.filtered[k], elapsed_s)]
        after = x
        for u, seconds in pieces:
            after += -expm1(-seconds / tau_s) * (u - after)
        sections.append(after)
    if history[-1][0] == time_s:
        history = history[:-1]
    history = _kept((*history, (time_s, filtered)), time_s - layout.longest_delay_s)
    return filtered, tuple(sections), history


def _pieces(
    history: tuple[_Row, ...], first_s: float, last_s: float, wire: int
) -> list[tuple[float, float]]:
    """Return the input that was held over a past stretch of time, as (value, seconds)."""
    begin = max(bisect_right(history, first_s + _SAME_TIME_S, key=_time_of) - 1, 0)
    pieces: list[tuple[float, float]] = []
    at_s = first_s
    for k in range(begin, len(history)):
        later = k + 1 < len(history)
        until_s = min(history[k + 1][0], last_s) if later else last_s
        if until_s > at_s:
            pieces.append((history[k][1][wire], until_s - at_s))
            at_s = until_s
        if later and history[k + 1][0] >= last_s:
            break
    return pieces


def _kept(history: tuple[_Row, ...], oldest_s: float) -> tuple[_Row, ...]:
    """Return the history without what no delay reaches any more."""
    first = 0
    while first + 2 < len(history) and history[first + 1][0] <= oldest_s - _SAME_TIME_S:
        first += 1
    return history[max(first, len(history) - MOST_HISTORY) :]


def _time_of(entry: _Row) -> float:
    return entry[0]


def _delayed(history: tuple[_Row, ...], time_s: float, wire: int) -> float:
    """Return the input that was held at a time; before the first reading its first value."""
    later = bisect_right(history, time_s + _SAME_TIME_S, key=_time_of)
    return history[max(later - 1, 0)][1][wire]


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
    diameter_mm: float | None,
    quality: Quality,
    outcomes: list[Outcome],
) -> ModelOutput:
    layout, time_s, inputs = model.layout, state.time_s or 0.0, state.filtered
    x = state.sections or _NO_SECTION
    said = [d * inputs[k] + gain * x[i] for d, k, gain, i in layout.first_terms]
    for k in layout.delayed:
        d, wire, gain, i = layout.first_terms[k]
        u = _delayed(state.history, time_s - layout.parts[k].delay_s, wire)
        said[k] = d * u + gain * x[i]
    for k, gain, i in layout.further_terms:
        said[k] += gain * x[i]
    if layout.gained:
        _multiply(layout, said, diameter_mm, outcomes)
    row = tuple(said)
    contribution_um = [row[span] for span in layout.slices]
    model_um: list[float] = []
    for part, offset_um in zip(contribution_um, layout.offsets_um):
        y_um = 0.0
        for c_um in part:  # from Python 3.12 on sum() rounds otherwise than a PLC does
            y_um += c_um
        model_um.append(offset_um + y_um)
    return ModelOutput(time_s, tuple(model_um), tuple(contribution_um), quality, tuple(outcomes))


def _multiply(
    layout: Layout, said: list[float], diameter_mm: float | None, outcomes: list[Outcome]
) -> None:
    """Multiply the parts that have a gain by diameter with it."""
    diameter = None if diameter_mm is None else _number(diameter_mm)
    if diameter_mm is not None and diameter is None:
        outcomes.append(Outcome.DIAMETER_UNKNOWN)
    for k in layout.gained:
        said[k] *= _part_gain(layout.parts[k], diameter, outcomes)


def _unmoved(
    model: CompensationModel, state: ThermalState, diameter_mm: float | None
) -> ModelOutput:
    """Return the last output again, as bad: a reading without a time says nothing."""
    if state.time_s is None or not math.isfinite(state.time_s):
        return _idle(model, 0.0, (Outcome.CLOCK_UNUSABLE,))
    return _output(model, state, diameter_mm, Quality.BAD, [Outcome.CLOCK_UNUSABLE])


def _idle(model: CompensationModel, when_s: float, why: tuple[Outcome, ...]) -> ModelOutput:
    """Return the output of a cycle in which the model could say nothing."""
    nothing = (0.0,) * len(model.outputs)
    parts = tuple((0.0,) * len(output.parts) for output in model.outputs)
    return ModelOutput(when_s, nothing, parts, Quality.BAD, why)
