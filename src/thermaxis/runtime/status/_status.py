"""What the loop tells the world: one frozen value per cycle."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from datetime import datetime
from functools import partial
from typing import NamedTuple, final

from thermaxis.codes import Message, Value, printable
from thermaxis.compensation import (
    SETTLED_UM,
    Compensation,
    CycleOutput,
    Limits,
    Reason,
    SampleQuality,
)
from thermaxis.messages import AlarmSentences, alarm_sentences
from thermaxis.runtime._offsets import SHORTEST_SILENCE_S, SILENCE_CYCLES
from thermaxis.runtime._ports import OTHER_COMPENSATION, HistorianStatus, SourceSample

_LONGEST_TEXT = 300
_USABLE = frozenset({SampleQuality.GOOD, SampleQuality.REDUNDANT})
LOOK_S = 1.0
"""What was read so long before the machine may have taken an offset back still tells it. [s]"""


@final
@dataclass(frozen=True, slots=True)
class Alarm:
    """Something that a person should know, with its cause and what to do."""

    key: str
    """Short name, the same as long as the alarm stands."""
    priority: str
    """``critical``, ``high``, ``medium`` or ``low``."""
    since: datetime
    """When it came, aware, in UTC."""
    code: str
    values: Mapping[str, Value] = field(default_factory=dict[str, Value], hash=False)
    """Numbers and texts that stand in its sentences, each with its unit in its name."""

    @property
    def message(self) -> Message:
        """What is wrong."""
        return Message(f"alarm-{self.code}", self.values)

    @property
    def sentences(self) -> AlarmSentences:
        """What is wrong, why, and what to do, in English."""
        said = alarm_sentences(self.code, self.values)
        return AlarmSentences(*(printable(one, _LONGEST_TEXT) for one in said))


class AgedOffset(NamedTuple):
    """An offset, and how old it is; both None while it is not known."""

    um: float | None = None
    """The offset. [µm]"""
    age_s: float | None = None
    """Time since it was written, or since the machine said it. [s]"""


class OutputOffsets(NamedTuple):
    """One output's offset at the three places where it is known."""

    commanded: AgedOffset = AgedOffset()
    """What this program wrote last, whether or not the machine took it."""
    accepted: AgedOffset = AgedOffset()
    """What the machine reports as set."""
    effective: AgedOffset = AgedOffset()
    """What the machine reports as acting."""
    acting: AgedOffset = AgedOffset()
    """What acted when it was last read: effective where the machine tells that, else accepted."""
    tells_effective: bool = False
    """Whether the machine is asked for what acts."""


class OutputTouches(NamedTuple):
    """What is known of the touches at one output, and what they do."""

    offset_um: float | None = None
    """What they add to the correction; None where none are looked at. [µm]"""
    known_um: float | None = None
    """Displacement that the model lacks, as they show it; None where none was believed. [µm]"""
    std_um: float | None = None
    """Standard uncertainty of the tool point. [µm]"""
    outcome: str = ""
    """What became of the last one; empty before the first."""
    value_um: float | None = None
    """What it showed. [µm]"""
    touched: datetime | None = None
    """When it was taken, aware, in UTC."""
    again: bool = False
    """Whether it was excluded, so that a second one is wanted."""
    acts: bool = False
    """Whether the offset is added, and not only shown."""
    now: bool = False
    """Whether it is time to touch: what is wanted of the uncertainty is passed, or the last touch
    asks for another one."""
    void: str = ""
    """Outcome by which the offset is off until an Acknowledge; empty where it is not."""


class OutputFacts(NamedTuple):
    """What does not change with the cycle: limits and parts of one output."""

    limits: Limits
    parts: tuple[str, ...]
    wires: tuple[tuple[str, str], ...] = ()
    """Channel that drives each part, and the one that is subtracted; empty where there is none."""


def facts_of(compensation: Compensation) -> dict[str, OutputFacts]:
    """Return limits and parts by output.

    Returns
    -------
    dict of str to OutputFacts
        By output of the model.
    """
    return {
        output.name: OutputFacts(
            limits,
            tuple(part.name for part in output.parts),
            tuple((part.plus, part.minus) for part in output.parts),
        )
        for output, limits in zip(compensation.model.outputs, compensation.bounds, strict=True)
    }


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class RuntimeStatus:
    """Status of the loop after a cycle."""

    machine: str
    started: datetime
    """When the loop was started, aware, in UTC."""
    utc: datetime
    """Time of the cycle, aware, in UTC."""
    number: int
    """Number of the cycle; it moves as long as the loop lives: the heartbeat. [1]"""
    cycle_s: float
    """Nominal cycle. [s]"""
    lateness_s: float
    """How late the cycle began. [s]"""
    overruns: int
    """Cycles that were missed since the start. [1]"""
    state_since: datetime
    """Since when the compensation is in its state, aware, in UTC."""
    enabled: bool
    """Whether somebody has enabled it."""
    output: CycleOutput
    outputs: tuple[str, ...]
    channels: tuple[str, ...]
    """Names of the model's channels."""
    samples: Mapping[str, SourceSample]
    source_connected: bool
    """Whether the values' machine was reached."""
    sink_connected: bool
    """Whether the offsets' machine can be written to."""
    model_file: str
    """File name of the model."""
    model_sha256: str
    diameter_mm: float | None
    """Clamping diameter of the workpiece. [mm]"""
    reference_c: Mapping[str, float] = field(default_factory=dict[str, float])
    """Temperature that each channel counts from; NaN before its first value. [degC]"""
    trim_owner: Mapping[str, str] = field(default_factory=dict[str, str])
    """Who set a trim, by output."""
    trim_left_s: Mapping[str, float] = field(default_factory=dict[str, float])
    """Time until it expires, by output. [s]"""
    alarms: tuple[Alarm, ...] = ()
    """What a person should know, the gravest first."""
    historian: HistorianStatus = field(default_factory=HistorianStatus)
    facts: Mapping[str, OutputFacts] = field(default_factory=dict[str, OutputFacts])
    """Limits and parts by output."""
    offsets: Mapping[str, OutputOffsets] = field(default_factory=dict[str, OutputOffsets])
    """Commanded, accepted and effective offset of every output, each with its age."""
    touches: Mapping[str, OutputTouches] = field(default_factory=dict[str, OutputTouches])
    """What is known of touches, by the outputs at which they are looked at."""
    interlocks: Mapping[str, bool | None] = field(default_factory=dict[str, bool | None])
    """Whether each interlock is met, by its name; None where that could not be read."""
    held_by: str = ""
    """Who holds it; empty where that is not known."""
    held_s: float = 0.0
    """For how long it has been held, also before a restart. [s]"""
    active_in_s: float = 0.0
    """Time after which it is active if nothing else blocks. [s]"""
    differing: tuple[str, ...] = ()
    """Outputs that are not read back as they were written, or where what acts does not follow."""
    headline: Message = field(default_factory=partial(Message, "headline-off"))
    """What is the matter, in one line."""
    headline_since: datetime | None = None
    """Since when that is so, aware, in UTC; `started` for what may have been so before."""
    source_reason: Message | None = None
    """Why the values' machine is not reached; None while it is."""
    sink_reason: Message | None = None
    """Why the offsets' machine cannot be written to, or what it refused last; None while nothing
    is wrong."""
    certificates: Mapping[str, datetime] = field(default_factory=dict[str, datetime])
    """Until when each certificate is valid, aware, in UTC, by its key in the configuration."""
    configuration_sha256: str = ""
    """Hash of the configuration's rules, as `configuration_sha256` says; empty where the loop was
    not started with a configuration."""

    @property
    def left_um(self) -> Mapping[str, float]:
        """Way that is left, by output, where what is asked or what acts has not settled. [µm]"""
        left_um = dict(zip(self.outputs, self.output.to_go_um, strict=True))
        for name, wanted_um in zip(self.outputs, self.output.wanted_um, strict=True):
            acting_um = self.offsets_of(name).acting.um
            if acting_um is not None:
                left_um[name] = max(left_um[name], abs(wanted_um - acting_um))
        near_um = {name: one.limits.deadband_um + SETTLED_UM for name, one in self.facts.items()}
        return {name: um for name, um in left_um.items() if um > near_um[name]}

    @property
    def settled(self) -> bool:
        """Whether the cycle has settled, and what acts was there, too, at the last look."""
        known = all(map(self.acting_known, self.outputs))
        return self.output.settled and known and not self.left_um

    @property
    def open_interlocks(self) -> tuple[str, ...]:
        """Names of the interlocks that are not met."""
        return tuple(name for name, met in self.interlocks.items() if met is False)

    @property
    def lost_inputs(self) -> tuple[str, ...]:
        """Names of everything that the correction needs and that cannot be read."""
        rows = zip(self.channels, self.output.qualities, strict=False)
        lost = [name for name, quality in rows if quality not in _USABLE]
        lost += [name for name, met in self.interlocks.items() if met is None]
        other = self.samples.get(OTHER_COMPENSATION)
        if other is not None and (other.value is None or not other.good):
            lost.append(OTHER_COMPENSATION)
        return tuple(lost)

    @property
    def patience_s(self) -> float:
        """Time for which a look may fail before what it told may be so no more. [s]"""
        return max(SILENCE_CYCLES * self.cycle_s, SHORTEST_SILENCE_S) + LOOK_S

    def offsets_of(self, output: str) -> OutputOffsets:
        """Return what is known of an output's offsets: nothing where nothing was read yet."""
        return self.offsets.get(output, OutputOffsets())

    def acting_known(self, output: str) -> bool:
        """Whether what acts at an output was read at the last look: else it may be gone."""
        age_s = self.offsets_of(output).acting.age_s
        return self.sink_connected and age_s is not None and age_s <= self.patience_s


def state_message(status: RuntimeStatus) -> Message:
    """Return the state with its reasons, and the names of interlocks and inputs that matter."""
    output = status.output
    values: dict[str, Value] = {"state": output.state.value}
    if not output.reasons:
        return Message("event-state", values)
    values["reasons"] = tuple(reason.value for reason in output.reasons)
    names = status.open_interlocks if Reason.INTERLOCK_OPEN in output.reasons else ()
    if Reason.INPUT_BAD in output.reasons and status.source_connected:
        names += status.lost_inputs
    if not names:
        return Message("event-state_reasons", values)
    return Message("event-state_named", {**values, "names": names})
