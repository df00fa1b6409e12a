"""What an operator may ask of the compensation, and how it is answered."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from enum import StrEnum
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
    """Output that a trim is for."""
    value: float | None = None
    """Trim [µm] or diameter [mm]."""
    duration_s: float | None = None
    """Time after which a trim expires. [s]"""
    text: str = ""
    """File name of a model, or a remark."""
    identity: int = 0
    """Number by which the answer is found. [1]"""


class Answer(NamedTuple):
    """How a request was answered."""

    request: Request
    """The request."""
    accepted: bool
    """Whether it takes effect."""
    reason: str
    """Why it was refused, or what follows from it, as a sentence without its full stop."""


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


class Machine(NamedTuple):
    """What the machine says, by which requests are answered."""

    connected: bool
    read_back_agrees: bool
    offset_outside: bool
    other_compensation: bool | None


_Answered = tuple[Asked, bool, str]


def answer_request(
    compensation: Compensation, asked: Asked, machine: Machine, request: Request
) -> tuple[Asked, Answer]:
    """Answer one request, whatever was sent; return what is changed by it."""
    respond = None
    if isinstance(request, Request) and isinstance(request.kind, str):  # pyright: ignore[reportUnnecessaryIsInstance] - whatever is sent
        respond = _ANSWERS.get(request.kind)
    if respond is None:
        return asked, Answer(request, accepted=False, reason="nobody here can do that")
    asked, accepted, reason = respond(compensation, asked, machine, request)
    return asked, Answer(request, accepted, reason)


def _enable(_: Compensation, asked: Asked, machine: Machine, __: Request) -> _Answered:
    memory = asked.memory
    if memory.state is FAULT:
        return asked, False, "it is in the state Fault: remove the cause and acknowledge first"
    if machine.other_compensation is None:
        return asked, False, "whether another compensation is active cannot be read"
    if machine.other_compensation is not False:
        return asked, False, f"{Reason.DOUBLE_COMPENSATION}: switch one off"
    if machine.offset_outside:
        return asked, False, f"{Reason.OFFSET_OUTSIDE}: bring it back within them first"
    if memory.enabled:
        return asked, True, "it was enabled already"
    memory = memory._replace(enabled=True, held=False, ready_s=0.0)
    return asked._replace(memory=memory), True, "it is active as soon as everything is there"


def _disable(_: Compensation, asked: Asked, __: Machine, ___: Request) -> _Answered:
    memory = asked.memory._replace(enabled=False, held=False)
    return asked._replace(memory=memory), True, "the correction fades at the allowed rate"


def _hold(compensation: Compensation, asked: Asked, _: Machine, __: Request) -> _Answered:
    memory = asked.memory
    if not memory.enabled or memory.state is FAULT:
        return asked, False, "there is nothing to hold: it is not enabled, or in the state Fault"
    if not memory.held:
        asked = asked._replace(memory=memory._replace(held=True, held_s=0.0))
    longest_s = compensation.supervisor.hold_operator_s
    return asked, True, f"it is held, for at most {longest_s:g} s"


def _resume(_: Compensation, asked: Asked, __: Machine, ___: Request) -> _Answered:
    return asked._replace(memory=asked.memory._replace(held=False)), True, "the hold is ended"


def _trim(compensation: Compensation, asked: Asked, _: Machine, request: Request) -> _Answered:
    names = [output.name for output in compensation.model.outputs]
    if request.output not in names:
        return asked, False, f"outputs are {', '.join(names)}"
    k = names.index(request.output)
    value, duration_s = number(request.value, LARGEST_RULE), number(request.duration_s)
    largest_um = compensation.bounds[k].largest_trim_um
    longest_s = compensation.supervisor.longest_trim_s
    replaced = asked.trims[k]
    if value == 0.0:  # to take back is always allowed
        trim, said = Trim(), "the trim is taken back"
    elif asked.memory.state is FAULT:
        return asked, False, "it is in the state Fault"
    elif value is None or abs(value) > largest_um:
        return asked, False, f"a trim is a number from {-largest_um:g} to {largest_um:g} um"
    elif duration_s is None or not 0.0 < duration_s <= longest_s:
        return asked, False, f"a trim expires within {longest_s:g} s: state when"
    else:
        trim, said = Trim(value, str(request.who), duration_s), "the trim is added"
        if replaced.value_um:
            said = f"the trim of {replaced.who or 'nobody'} is replaced"
    return asked._replace(trims=(*asked.trims[:k], trim, *asked.trims[k + 1 :])), True, said


def _diameter(_: Compensation, asked: Asked, __: Machine, request: Request) -> _Answered:
    value = number(request.value, LARGEST_DIAMETER_MM)
    if request.value is not None and (value is None or value < 0.0):
        return asked, False, f"a diameter is a number from 0 to {LARGEST_DIAMETER_MM:g} mm"
    return asked._replace(diameter_mm=value), True, "the gain follows at the allowed rate"


def _acknowledge(_: Compensation, asked: Asked, machine: Machine, __: Request) -> _Answered:
    memory, fault = asked.memory, asked.memory.fault
    if memory.state is not FAULT:
        said = "there is no fault; the present values of the sensors are accepted"
        return asked._replace(accepts_sensors=True), True, said
    if fault is Reason.DOUBLE_COMPENSATION and machine.other_compensation is not False:
        return asked, False, f"{fault} still: switch one off"
    if fault is Reason.OFFSET_OUTSIDE and machine.offset_outside:
        return asked, False, f"{fault} still; it comes back at the allowed rate"
    follows = machine.read_back_agrees and machine.connected
    if fault is Reason.READ_BACK_DIFFERS and not follows:
        return asked, False, f"{fault} still: check the connection and the axis"
    memory = memory._replace(
        state=FADING, since_s=math.nan, enabled=False, held=False, fault=None, differs_s=0.0
    )
    said = "the fault is acknowledged; it is off until it is enabled"
    return asked._replace(memory=memory, accepts_sensors=True), True, said


_ANSWERS: Mapping[str, Callable[[Compensation, Asked, Machine, Request], _Answered]] = {
    RequestKind.ENABLE: _enable,
    RequestKind.DISABLE: _disable,
    RequestKind.HOLD: _hold,
    RequestKind.RESUME: _resume,
    RequestKind.TRIM: _trim,
    RequestKind.DIAMETER: _diameter,
    RequestKind.ACKNOWLEDGE: _acknowledge,
}
