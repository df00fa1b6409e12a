"""What an operator may ask of the compensation, and how it is answered."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from enum import StrEnum
from types import MappingProxyType
from typing import NamedTuple, final

from thermaxis.compensation._compensation import Compensation
from thermaxis.compensation._sensors import LARGEST_RULE
from thermaxis.compensation._step import number
from thermaxis.compensation._supervisor import FADING, FAULT, Memory, Reason

LARGEST_DIAMETER_MM = 1e5
"""Largest clamping diameter: a hundred metres. [mm]"""


class RequestKind(StrEnum):
    """What is asked."""

    ENABLE = "enable"
    """Compensate as soon as everything that it needs is there."""
    DISABLE = "disable"
    """Fade the correction out and stay off."""
    HOLD = "hold"
    """Keep the correction as it is."""
    RESUME = "resume"
    """End a hold."""
    TRIM = "trim"
    """Add a bounded amount to one output, until it expires."""
    DIAMETER = "diameter"
    """State the clamping diameter of the workpiece; no value means the tool centre point."""
    ACKNOWLEDGE = "acknowledge"
    """Say that a fault was seen and its cause removed; also accepts the present values of sensors
    that had jumped."""
    DATUM = "datum"
    """Say that a datum was set, or an axis referenced, anew: touches have taught nothing yet."""
    TOUCH = "touch"
    """Take a touch that was read by hand."""
    MODEL = "model"
    """Take another model of the configured folder."""


@final
@dataclass(frozen=True, slots=True)
class Request:
    """One request. An equal request that comes again is a new request: every one is an edge."""

    kind: RequestKind
    """What is asked."""
    who: str = ""
    """Name of the person or program that asks."""
    output: str = ""
    """Output that a trim or a touch is for."""
    value: float | None = None
    """Trim [µm], touch [µm] or diameter [mm]."""
    duration_s: float | None = None
    """Time after which a trim expires, or since it was touched. [s]"""
    text: str = ""
    """File name of a model, or a remark."""
    identity: int = 0
    """Number by which the answer is found. [1]"""


class AnswerCode(StrEnum):
    """How a request was answered: why it was refused, or what follows from it."""

    NOT_SUPPORTED = "not_supported"
    """No such request is known."""
    ACKNOWLEDGE_FIRST = "acknowledge_first"
    """It is in the state Fault: the cause must be removed and acknowledged first."""
    IN_FAULT = "in_fault"
    """It is in the state Fault."""
    OTHER_COMPENSATION_UNREAD = "other_compensation_unread"
    """Whether another compensation is active cannot be read."""
    DOUBLE_COMPENSATION = "double_compensation"
    """Another compensation is active on the axis."""
    OFFSET_OUTSIDE = "offset_outside"
    """The offset found in the machine lies outside the limits."""
    ALREADY_ENABLED = "already_enabled"
    ENABLED = "enabled"
    """It is active as soon as everything is there."""
    DISABLED = "disabled"
    """The correction fades at the allowed rate."""
    NOTHING_TO_HOLD = "nothing_to_hold"
    """It is not enabled, or in the state Fault."""
    HELD = "held"
    """It is held, for at most ``longest_s``."""
    RESUMED = "resumed"
    """The hold is ended."""
    UNKNOWN_OUTPUT = "unknown_output"
    """Outputs are ``names``."""
    TRIM_RANGE = "trim_range"
    """A trim is a number from ``lowest_um`` to ``largest_um``."""
    TRIM_CLEARED = "trim_cleared"
    """The trim is taken back."""
    TRIM_DURATION = "trim_duration"
    """A trim expires within ``longest_s``."""
    TRIM_SET = "trim_set"
    """The trim is added."""
    TRIM_REPLACED = "trim_replaced"
    """The trim of ``who`` is replaced."""
    DIAMETER_RANGE = "diameter_range"
    """A diameter is a number from 0 to ``largest_mm``."""
    DIAMETER_SET = "diameter_set"
    """The gain follows at the allowed rate."""
    NO_FAULT = "no_fault"
    """There is no fault; alarms of offsets are seen, and the values of the sensors are accepted."""
    ACKNOWLEDGED = "acknowledged"
    """The fault is acknowledged; it is off until it is enabled."""
    DOUBLE_COMPENSATION_STILL = "double_compensation_still"
    """The fault's cause is still there: another compensation is active."""
    OFFSET_OUTSIDE_STILL = "offset_outside_still"
    """The fault's cause is still there: the offset lies outside the limits, and comes back."""
    TOUCHED = "touched"
    """What became of a touch is ``outcome``."""
    TOUCHES_FORGOTTEN = "touches_forgotten"
    """What touches have taught is forgotten; their offset leaves at its rate."""
    READ_BACK_DIFFERS_STILL = "read_back_differs_still"
    """The fault's cause is still there: the machine does not report what was written."""


class Answer(NamedTuple):
    """How a request was answered."""

    request: Request
    """The request."""
    accepted: bool
    """Whether it takes effect."""
    code: AnswerCode
    """Why it was refused, or what follows from it."""
    values: Mapping[str, float | str | tuple[str, ...]] = MappingProxyType({})
    """Values that belong to the code, each with its unit in its name."""


class Trim(NamedTuple):
    """A person's addition to one output."""

    value_um: float = 0.0
    """The addition. [µm]"""
    who: str = ""
    """Who set it."""
    left_s: float = 0.0
    """Time until it expires. [s]"""


def aged(trim: Trim, elapsed_s: float) -> Trim:
    """Return what is left of a trim."""
    return trim._replace(left_s=trim.left_s - elapsed_s) if trim.left_s > elapsed_s else Trim()


class Asked(NamedTuple):
    """What requests change."""

    memory: Memory
    trims: tuple[Trim, ...]
    diameter_mm: float | None
    accepts_sensors: bool = False
    """Whether the present values of all sensors are accepted."""
    forgets_touches: bool = False
    """Whether what touches have taught counts no more."""


class Machine(NamedTuple):
    """What the machine says, by which requests are answered."""

    follows: bool  # it can be reached, and reports what was written
    offset_outside: bool
    other_compensation: bool | None


_Values = Mapping[str, float | str | tuple[str, ...]]
_Answered = tuple[Asked, bool, AnswerCode] | tuple[Asked, bool, AnswerCode, _Values]


def answer_request(
    compensation: Compensation, asked: Asked, machine: Machine, request: Request
) -> tuple[Asked, Answer]:
    """Answer one request, whatever was sent; return what is changed by it."""
    respond = None
    if isinstance(request, Request) and isinstance(request.kind, str):  # pyright: ignore[reportUnnecessaryIsInstance] - whatever is sent
        respond = _ANSWERS.get(request.kind)
    if respond is None:
        return asked, Answer(request, accepted=False, code=AnswerCode.NOT_SUPPORTED)
    asked, accepted, code, *values = respond(compensation, asked, machine, request)
    return asked, Answer(request, accepted, code, *values)


def _enable(_: Compensation, asked: Asked, machine: Machine, __: Request) -> _Answered:
    memory = asked.memory
    if memory.state is FAULT:
        return asked, False, AnswerCode.ACKNOWLEDGE_FIRST
    if machine.other_compensation is None:
        return asked, False, AnswerCode.OTHER_COMPENSATION_UNREAD
    if machine.other_compensation is not False:
        return asked, False, AnswerCode.DOUBLE_COMPENSATION
    if machine.offset_outside:
        return asked, False, AnswerCode.OFFSET_OUTSIDE
    if memory.enabled:
        return asked, True, AnswerCode.ALREADY_ENABLED
    memory = memory._replace(enabled=True, held=False, ready_s=0.0)
    return asked._replace(memory=memory), True, AnswerCode.ENABLED


def _disable(_: Compensation, asked: Asked, __: Machine, ___: Request) -> _Answered:
    memory = asked.memory._replace(enabled=False, held=False)
    return asked._replace(memory=memory), True, AnswerCode.DISABLED


def _hold(compensation: Compensation, asked: Asked, _: Machine, __: Request) -> _Answered:
    memory = asked.memory
    if not memory.enabled or memory.state is FAULT:
        return asked, False, AnswerCode.NOTHING_TO_HOLD
    if not memory.held:
        asked = asked._replace(memory=memory._replace(held=True, held_s=0.0))
    longest_s = compensation.supervisor.hold_operator_s
    return asked, True, AnswerCode.HELD, {"longest_s": longest_s}


def _resume(_: Compensation, asked: Asked, __: Machine, ___: Request) -> _Answered:
    return asked._replace(memory=asked.memory._replace(held=False)), True, AnswerCode.RESUMED


def _trim(compensation: Compensation, asked: Asked, _: Machine, request: Request) -> _Answered:
    names = [output.name for output in compensation.model.outputs]
    if request.output not in names:
        return asked, False, AnswerCode.UNKNOWN_OUTPUT, {"names": tuple(names)}
    k = names.index(request.output)
    value, duration_s = number(request.value, LARGEST_RULE), number(request.duration_s)
    largest_um = compensation.bounds[k].largest_trim_um
    longest_s = compensation.supervisor.longest_trim_s
    replaced = asked.trims[k]
    if value == 0.0:  # to take back is always allowed
        trim, code, values = Trim(), AnswerCode.TRIM_CLEARED, {}
    elif asked.memory.state is FAULT:
        return asked, False, AnswerCode.IN_FAULT
    elif value is None or abs(value) > largest_um:
        bounds_um = {"lowest_um": -largest_um, "largest_um": largest_um}
        return asked, False, AnswerCode.TRIM_RANGE, bounds_um
    elif duration_s is None or not 0.0 < duration_s <= longest_s:
        return asked, False, AnswerCode.TRIM_DURATION, {"longest_s": longest_s}
    else:
        trim = Trim(value, str(request.who), duration_s)
        code, values = AnswerCode.TRIM_SET, {}
        if replaced.value_um and replaced.who:
            code, values = AnswerCode.TRIM_REPLACED, {"who": replaced.who}
    asked = asked._replace(trims=(*asked.trims[:k], trim, *asked.trims[k + 1 :]))
    return asked, True, code, values


def _diameter(_: Compensation, asked: Asked, __: Machine, request: Request) -> _Answered:
    value = number(request.value, LARGEST_DIAMETER_MM)
    if request.value is not None and (value is None or value < 0.0):
        return asked, False, AnswerCode.DIAMETER_RANGE, {"largest_mm": LARGEST_DIAMETER_MM}
    return asked._replace(diameter_mm=value), True, AnswerCode.DIAMETER_SET


def _datum(compensation: Compensation, asked: Asked, _: Machine, __: Request) -> _Answered:
    if not compensation.touches:
        return asked, False, AnswerCode.NOT_SUPPORTED
    return asked._replace(forgets_touches=True), True, AnswerCode.TOUCHES_FORGOTTEN


def _acknowledge(_: Compensation, asked: Asked, machine: Machine, __: Request) -> _Answered:
    memory, fault = asked.memory, asked.memory.fault
    if memory.state is not FAULT:
        return asked._replace(accepts_sensors=True), True, AnswerCode.NO_FAULT
    if fault is Reason.DOUBLE_COMPENSATION and machine.other_compensation is not False:
        return asked, False, AnswerCode.DOUBLE_COMPENSATION_STILL
    if fault is Reason.OFFSET_OUTSIDE and machine.offset_outside:
        return asked, False, AnswerCode.OFFSET_OUTSIDE_STILL
    if fault is Reason.READ_BACK_DIFFERS and not machine.follows:
        return asked, False, AnswerCode.READ_BACK_DIFFERS_STILL
    memory = memory._replace(
        state=FADING, since_s=math.nan, enabled=False, held=False, fault=None, differs_s=0.0
    )
    return asked._replace(memory=memory, accepts_sensors=True), True, AnswerCode.ACKNOWLEDGED


_ANSWERS: Mapping[str, Callable[[Compensation, Asked, Machine, Request], _Answered]] = {
    RequestKind.ENABLE: _enable,
    RequestKind.DISABLE: _disable,
    RequestKind.HOLD: _hold,
    RequestKind.RESUME: _resume,
    RequestKind.TRIM: _trim,
    RequestKind.DIAMETER: _diameter,
    RequestKind.DATUM: _datum,
    RequestKind.ACKNOWLEDGE: _acknowledge,
}
