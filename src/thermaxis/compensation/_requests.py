"""What an operator may ask of the compensation, and how it is answered."""

from dataclasses import dataclass
from enum import StrEnum
from typing import NamedTuple, final


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
