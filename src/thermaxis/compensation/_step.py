"""One step of the thermal model: a reading in, the displacement and its correction out.

The same function verifies a model on a log, runs in every cycle on the machine, and is part of
the reference of the text that is exported to a PLC. No clock, no input or output, no exception.
"""

import math
from bisect import bisect_right
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from itertools import pairwise
from types import MappingProxyType
from typing import NamedTuple, final

from thermaxis.compensation._model import START, STATED, CompensationModel, Layout, Part

LARGEST_VALUE = 1e6
"""A reading of larger magnitude is no temperature and no speed: it counts as missing."""
LATEST_S = 1e15
"""Largest magnitude of a time; seconds since 1970 are a good time. [s]"""
MOST_HISTORY = 200_000
"""Readings that a delay looks back at most; more of them shorten it. [1]"""
_SAME_TIME_S = 1e-6

_Floats = tuple[float, ...]


def _no_values() -> Mapping[str, float | None]:
    return MappingProxyType({})


class Quality(StrEnum):
    """Whether an output may be used."""

    GOOD = "good"
    """Every input was read."""
    HELD = "held"
    """An input failed a moment ago; its last value stands for it."""
    BAD = "bad"
    """An input failed for too long, or was never read: the output must not drive anything."""


class Outcome(StrEnum):
    """What was out of the ordinary in a cycle."""

    STARTED = "started"
    """The model started."""
    WAITING = "waiting"
    """The model waits until every input has a good value."""
    CLOCK_BACKWARD = "clock_backward"
    """The clock went backward: the model started anew at the steady state."""
    CLOCK_UNUSABLE = "clock_unusable"
    """The time of the reading is no number: nothing was advanced."""
    CLOCK_STILL = "clock_still"
    """The clock stands still: nothing was advanced."""
    STATE_UNUSABLE = "state_unusable"
    """The stored state does not belong to this model: the model starts anew."""
    GAP = "gap"
    """No reading for longer than the longest gap: the model started anew at the steady state."""
    INPUT_HELD = "input_held"
    """An input failed: its last good value is held."""
    INPUT_FAILED = "input_failed"
    """An input failed for longer than it may be held."""
    DIAMETER_HELD = "diameter_held"
    """The workpiece's diameter lies outside the gains' range: the end value is held."""
    DIAMETER_UNKNOWN = "diameter_unknown"
    """No workpiece diameter is stated: the gain at the tool centre point is used."""
    OUTSIDE_VALIDITY = "outside_validity"
    """An input lies outside the range that the model was made from."""


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
    jumps. That a temperature is a finite number makes it plausible here.

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
    fresh = [number(values.get(channel), LARGEST_VALUE) for channel in model.channels]
    outcomes: list[Outcome] = []
    if not _fits(model, state):
        outcomes.append(Outcome.STATE_UNUSABLE)
        state = initial_state(model)
    now_s, diameter_mm = number(reading.time_s), reading.diameter_mm
    if now_s is None:
        return state, _unmoved(model, state, diameter_mm)
    value, good_s, quality = _held(model, state, fresh, now_s, outcomes)
    start = _start_reason(model, state, now_s, outcomes)
    reference = state.reference
    if start is not None:
        if quality is Quality.BAD:
            waiting = ThermalState(None, reference, value, good_s, warm=state.warm)
            return waiting, _idle(model, now_s, (*outcomes, Outcome.WAITING))
        reference = tuple(v if math.isnan(r) else r for r, v in zip(reference, value))
    raw = _inputs(model, value, reference, outcomes)
    if start is None:
        filtered, sections, history = _advanced(model, state, raw, now_s)
    else:
        outcomes.append(start)
        # The reference, a mean over some time, knows the start better than one noisy reading.
        rest = start is Outcome.STARTED and model.reference == START and not state.warm
        sections = tuple(0.0 if rest else raw[k] for k in model.layout.drives)
        filtered, history = raw, ((now_s, raw),)
    new = ThermalState(now_s, reference, value, good_s, filtered, raw, sections, history)
    output = _output(model, new, diameter_mm, quality, outcomes)
    if not math.isfinite(sum(output.model_um)):
        return initial_state(model), _idle(model, now_s, (Outcome.STATE_UNUSABLE,))
    return new, output


def _fits(model: CompensationModel, state: ThermalState) -> bool:
    """Whether a state of any origin has the shape of the model; numbers are validated later."""
    channels, inputs = len(model.channels), len(model.layout.wires)
    if len(state.reference) != channels:
        return False
    if state.time_s is None:
        return {len(state.value), len(state.good_s)} <= {0, channels}
    return (
        len(state.value) == len(state.good_s) == channels
        and len(state.filtered) == len(state.raw) == inputs
        and len(state.sections) == len(model.layout.taus_s)
        and {len(row) for _, row in state.history} == {inputs}
        and all(before < after for (before, _), (after, _) in pairwise(state.history))
    )


# ---- reading ------------------------------------------------------------------------------------


def number(value: object, largest: float = LATEST_S) -> float | None:
    """Return a usable number, or None: NaN, infinite, huge, or no number at all."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        return None
    return float(value) if abs(value) <= largest else None


def _held(
    model: CompensationModel,
    state: ThermalState,
    fresh: Sequence[float | None],
    time_s: float,
    outcomes: list[Outcome],
) -> tuple[_Floats, _Floats, Quality]:
    """Return the value of every channel, held where it fails, and when each was last good."""
    unknown = (math.nan,) * len(fresh)
    known = zip(fresh, state.value or unknown, state.good_s or unknown)
    rows = [(last, last_s) if v is None else (v, time_s) for v, last, last_s in known]
    value, good_s = tuple(v for v, _ in rows), tuple(t for _, t in rows)
    lost_s = [last_s for v, last_s in zip(fresh, good_s) if v is None]
    if not lost_s:
        return value, good_s, Quality.GOOD
    if all(0.0 <= time_s - last_s <= model.longest_hold_s for last_s in lost_s):
        outcomes.append(Outcome.INPUT_HELD)
        return value, good_s, Quality.HELD
    outcomes.append(Outcome.INPUT_FAILED)
    return value, good_s, Quality.BAD


def _inputs(
    model: CompensationModel, value: _Floats, reference: _Floats, outcomes: list[Outcome]
) -> _Floats:
    """Return every input relative to its reference."""
    rise = [v - r for v, r in zip(value, reference)]
    wires, ranges = model.layout.wires, model.layout.ranges
    raw = tuple(rise[plus] - rise[minus] if minus >= 0 else rise[plus] for plus, minus in wires)
    if not all(low <= u <= high for u, (low, high) in zip(raw, ranges)):
        outcomes.append(Outcome.OUTSIDE_VALIDITY)
    return raw


# ---- sections -----------------------------------------------------------------------------------


def _start_reason(
    model: CompensationModel, state: ThermalState, time_s: float, outcomes: list[Outcome]
) -> Outcome | None:
    """Return why the model starts, or None where it goes on."""
    if state.time_s is None:
        return Outcome.STARTED
    elapsed_s = time_s - state.time_s
    if elapsed_s < 0.0:
        return Outcome.CLOCK_BACKWARD
    if elapsed_s > model.longest_gap_s:
        return Outcome.GAP
    if elapsed_s == 0.0:
        outcomes.append(Outcome.CLOCK_STILL)
    return None


_Row = tuple[float, _Floats]


def _advanced(
    model: CompensationModel, state: ThermalState, raw: _Floats, time_s: float
) -> tuple[_Floats, _Floats, tuple[_Row, ...]]:
    """Return filtered inputs, sections and history at the time of the reading."""
    before_s = time_s if state.time_s is None else state.time_s
    elapsed_s, layout, filtered = time_s - before_s, model.layout, raw
    if model.input_filter_s > 0.0:
        alpha = -math.expm1(-elapsed_s / model.input_filter_s)
        filtered = tuple(f + alpha * (u - f) for f, u in zip(state.filtered, state.raw))
    sections: list[float] = []
    for x, tau_s, k, owner in zip(state.sections, layout.taus_s, layout.drives, layout.owners):
        delay_s = layout.parts[owner].delay_s
        pieces = [(state.filtered[k], elapsed_s)]
        if delay_s > 0.0:
            pieces = _pieces(state.history, before_s - delay_s, time_s - delay_s, k)
        after = x
        for u, seconds in pieces:
            after += -math.expm1(-seconds / tau_s) * (u - after)
        sections.append(after)
    history = ((time_s, filtered),)
    if layout.delayed:
        earlier = state.history[:-1] if elapsed_s == 0.0 else state.history
        history = _kept((*earlier, *history), time_s - layout.longest_delay_s)
    return filtered, tuple(sections), history


def _pieces(
    history: tuple[_Row, ...], first_s: float, last_s: float, wire: int
) -> list[tuple[float, float]]:
    """Return the input that was held over a past stretch of time, as (value, seconds)."""
    pieces: list[tuple[float, float]] = []
    at_s = first_s
    for k in range(_index(history, first_s), len(history)):
        until_s = min(history[k + 1][0], last_s) if k + 1 < len(history) else last_s
        if until_s > at_s:
            pieces.append((history[k][1][wire], until_s - at_s))
            at_s = until_s
        if until_s >= last_s:
            break
    return pieces


def _kept(history: tuple[_Row, ...], oldest_s: float) -> tuple[_Row, ...]:
    """Return the history without what no delay reaches any more."""
    first = 0
    while first + 2 < len(history) and history[first + 1][0] <= oldest_s - _SAME_TIME_S:
        first += 1
    return history[max(first, len(history) - MOST_HISTORY) :]


def _index(history: tuple[_Row, ...], time_s: float) -> int:
    """Return the number of the row that was held at a time; before the first reading the first."""
    later = bisect_right(history, time_s + _SAME_TIME_S, key=lambda row: row[0])
    return max(later - 1, 0)


# ---- output -------------------------------------------------------------------------------------


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
    points = part.gain_by_diameter
    if not points:
        return 1.0
    if diameter_mm is None:
        return part.tool_gain
    if diameter_mm <= points[0].diameter_mm:
        return points[0].gain
    for low, high in pairwise(points):
        if diameter_mm <= high.diameter_mm:
            share = (diameter_mm - low.diameter_mm) / (high.diameter_mm - low.diameter_mm)
            return low.gain + share * (high.gain - low.gain)
    return points[-1].gain


def _output(
    model: CompensationModel,
    state: ThermalState,
    diameter_mm: float | None,
    quality: Quality,
    outcomes: list[Outcome],
) -> ModelOutput:
    """Return direct gain times input plus gains times sections, times g; and their sums."""
    layout, time_s = model.layout, state.time_s or 0.0
    diameter_mm = _diameter(layout, diameter_mm, outcomes)
    sections = iter(state.sections)
    contribution_um: list[float] = []
    for part, k in zip(layout.parts, layout.driven):
        u = state.filtered[k]
        if part.delay_s > 0.0:
            u = state.history[_index(state.history, time_s - part.delay_s)][1][k]
        y_um = part.direct_gain_um_per_k * u
        for section in part.sections:
            y_um += section.gain_um_per_k * next(sections)
        contribution_um.append(y_um * gain_of(part, diameter_mm))
    rows = tuple(tuple(contribution_um[first:behind]) for first, behind, _ in layout.spans)
    model_um = tuple(offset_um + _sum(row) for row, (_, _, offset_um) in zip(rows, layout.spans))
    return ModelOutput(time_s, model_um, rows, quality, tuple(outcomes))


def _sum(row: _Floats) -> float:
    """Return the sum as a PLC rounds it, which `sum` does not from Python 3.12 on."""
    total = 0.0
    for value in row:
        total += value
    return total


def _diameter(layout: Layout, diameter_mm: float | None, outcomes: list[Outcome]) -> float | None:
    """Return the diameter where it is a number, and say where the gains do not know it."""
    if diameter_mm is None or not layout.gained:
        return None
    diameter = number(diameter_mm)
    if diameter is None:
        outcomes.append(Outcome.DIAMETER_UNKNOWN)
        return None
    ends = [layout.parts[k].gain_by_diameter for k in layout.gained]
    if not all(p[0].diameter_mm <= diameter <= p[-1].diameter_mm for p in ends):
        outcomes.append(Outcome.DIAMETER_HELD)
    return diameter


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
