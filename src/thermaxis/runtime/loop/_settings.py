"""What a loop is made with."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Protocol, final

from thermaxis.compensation import Compensation
from thermaxis.runtime._ports import Clock, Historian, Sink, Source


class AtStop(StrEnum):
    """What becomes of the offset when the loop is ended."""

    FADE = "fade"
    """It fades to zero first, within a bounded time."""
    LEAVE = "leave"
    """It stays; the machine's own watchdog decides."""


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class LoopSettings:
    """What the loop needs besides the compensation."""

    machine: str
    """Name of the machine."""
    model_file: str
    """File name of the model."""
    model_sha256: str
    """Its hash."""
    interlocks_met: Mapping[str, bool] = field(default_factory=dict[str, bool])
    """Value that means met, by interlock."""
    other_active: bool | None = None
    """Value that means that another compensation is active; None where no node tells."""
    reads_diameter: bool = False
    """Whether the machine states the workpiece's diameter."""
    resume_enabled: bool = True
    """Whether a compensation that was enabled is enabled again after a restart."""
    resume_within_s: float = 3600.0
    """The restart must follow so soon. Default: an hour. [s]"""
    at_stop: AtStop = AtStop.FADE
    """What becomes of the offset when the loop is ended."""
    stop_within_s: float = 120.0
    """A fade at the end lasts at most so long. [s]"""
    latch_offset_mismatch: bool = False
    """Whether the correction stays off once an offset was not where it had been left, until
    somebody acknowledges it."""
    replayed: bool = False
    """Whether a log is replayed, whose machine was not corrected."""
    touch_delay_s: Mapping[str, float] = field(default_factory=dict[str, float])
    """By how much a touch is older than its counter, by output. [s]"""
    wanted_std_um: Mapping[str, float] = field(default_factory=dict[str, float])
    """Standard uncertainty of the tool point from which a touch is wanted, by output. [µm]"""
    configuration_sha256: str = ""
    """Hash of the configuration's rules, told with every status; empty where there is none."""


@final
@dataclass(frozen=True, slots=True)
class Ports:
    """What ties the loop to the world."""

    source: Source
    """Where values come from."""
    sink: Sink
    """Where corrections go."""
    historian: Historian
    """Who remembers."""
    clock: Clock
    """Time."""


class Models(Protocol):
    """Where another model comes from."""

    def __call__(self, name: str) -> tuple[Compensation, str]:
        """Return the compensation with a model of the configured folder, and the file's hash."""
        ...
