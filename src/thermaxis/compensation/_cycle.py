"""One cycle of the compensation: inputs with their quality and requests in, a limited correction out.

The only function that acts on a machine: it judges the inputs, advances the model, asks the
supervisor and limits the correction. Standard library only, no clock, no input or output, no
exception. The exported PLC block does the same.
"""

import math
from typing import NamedTuple

from thermaxis.compensation._compensation import LONGEST_STEP_CYCLES, Compensation
from thermaxis.compensation._limits import limit_step
from thermaxis.compensation._model_step import (
    ModelOutput,
    Reading,
    ThermalState,
    initial_state,
    model_step,
)
from thermaxis.compensation._quality import (
    Outcome,
    Quality,
    Sample,
    SampleQuality,
    SensorState,
)
from thermaxis.compensation._requests import Answer, Request, RequestKind
from thermaxis.compensation._supervisor import (
    Memory,
    Reason,
    SupervisorState,
)

_Floats = tuple[float, ...]


class Trim(NamedTuple):
    """A person's addition to one output."""

    value_um: float = 0.0
    """The addition. [µm]"""
    who: str = ""
    """Who set it."""
    left_s: float = 0.0
    """Time until it expires. [s]"""


class CycleReading(NamedTuple):
    """What one cycle gets. Whatever a source sends, `cycle` survives it."""

    time_s: float
    """Time of the cycle, of a clock that only goes forward. [s]"""
    samples: tuple[Sample, ...]
    """One per channel of the model, in its order."""
    spares: tuple[Sample | None, ...] = ()
    """The second sensors, in the same order; None where there is none; may be empty."""
    interlocks: tuple[bool, ...] = ()
    """Whether each interlock is met, in the order of the compensation; a missing one is not."""
    connected: bool = True
    """Whether the machine can be written to."""
    read_back_um: tuple[float | None, ...] | None = None
    """What the machine reports as the offset that was written in the last cycle, one per output;
    None where nothing could be read. [µm]"""
    found_um: tuple[float | None, ...] | None = None
    """Offsets found in the machine at the start and after a lost connection: the correction goes
    on from there. None where the last one written still stands. [µm]"""
    other_compensation: bool = False
    """Whether another compensation is active on an axis."""
    requests: tuple[Request, ...] = ()
    """What is asked, oldest first."""


class CycleState(NamedTuple):
    """What a cycle leaves for the next one: numbers and words only, so that it can be stored."""

    thermal: ThermalState
    """The model's state."""
    sensors: tuple[SensorState, ...]
    """Memory of the sensors, in the order of the channels."""
    spares: tuple[SensorState, ...]
    """Memory of the second sensors, in the same order."""
    memory: Memory
    """Memory of the supervisor."""
    time_s: float
    """Time of the last cycle; NaN before the first. [s]"""
    correction_um: _Floats
    """Corrections in force, by output. [µm]"""
    goal_um: _Floats
    """Where they go. [µm]"""
    trims: tuple[Trim, ...]
    """Trims, by output."""
    diameter_mm: float | None = None
    """Clamping diameter of the workpiece; None for the tool centre point. [mm]"""


class CycleOutput(NamedTuple):
    """What one cycle says."""

    time_s: float
    """Time of the cycle. [s]"""
    state: SupervisorState
    """State of the compensation."""
    in_state_s: float
    """For how long it has been in that state. [s]"""
    reasons: tuple[Reason, ...]
    """Why it is not active, the gravest first; empty while it is active."""
    correction_um: _Floats
    """What is to be written, by output: minus the model, weighted, trimmed and limited. [µm]"""
    wanted_um: _Floats
    """The same before rate and supervisor. [µm]"""
    model_um: _Floats
    """Displacement by output: tool point relative to workpiece, positive away from it. [µm]"""
    contribution_um: tuple[_Floats, ...]
    """What every part contributes, by output. [µm]"""
    weight: _Floats
    """Weight of the model by output; below 1 outside the range of its training logs. [1]"""
    trim_um: _Floats
    """Trims in force, by output. [µm]"""
    rate_um_per_s: _Floats
    """Change of the correction in this cycle. [µm/s]"""
    at_limit: tuple[bool, ...]
    """Whether the model asks for more than the magnitude allows, by output."""
    at_soft_limit: tuple[bool, ...]
    """Whether the correction stands beyond the soft limit, by output."""
    values: tuple[float | None, ...]
    """Values that the model was given, by channel; None where there was none. [degC]"""
    qualities: tuple[SampleQuality, ...]
    """What was wrong with each, by channel."""
    quality: Quality
    """Whether the model's output may be used."""
    outcomes: tuple[Outcome, ...]
    """What was out of the ordinary in the model."""
    answers: tuple[Answer, ...]
    """Answers to the requests, in their order."""


def cycle_state(
    compensation: Compensation, reference_c: "dict[str, float] | None" = None
) -> CycleState:
    """Return the state before the first cycle: off, nothing written, nothing read."""
    raise NotImplementedError


def cycle(
    compensation: Compensation, state: CycleState, reading: CycleReading
) -> tuple[CycleState, CycleOutput]:
    """Advance by one cycle."""
    raise NotImplementedError


def with_compensation(
    new: Compensation, old: Compensation, state: CycleState
) -> CycleState:
    """Change the model."""
    raise NotImplementedError
