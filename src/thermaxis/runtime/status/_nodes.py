"""What the status server shows: every value with its name, its unit, its quality and its time.

No OPC UA here: a table of leaves, each with a path and a function from the status to a value. The
server turns paths into node ids and qualities into status codes; the metrics and the screen read
the same.
"""

import json
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from datetime import UTC, datetime
from enum import Enum
from typing import NamedTuple, final

from thermaxis import __version__
from thermaxis.codes import Message, value_as_json, values_as_json
from thermaxis.compensation import Compensation, CycleOutput, Limits, SampleQuality, SupervisorState
from thermaxis.messages import sentence_of
from thermaxis.runtime._ports import NOT_READ, Applied, HistorianStatus, SourceSample
from thermaxis.runtime.status._status import Alarm, RuntimeStatus

Value = str | float | int | bool | datetime | tuple[str, ...] | tuple[float, ...] | None
"""What a leaf may hold."""

STATE_NUMBERS = {
    SupervisorState.OFF: 0,
    SupervisorState.WARMING: 1,
    SupervisorState.ACTIVE: 2,
    SupervisorState.HOLDING: 3,
    SupervisorState.FADING: 4,
    SupervisorState.FAULT: 5,
}
"""The states as numbers, for controls that compare no texts. [1]"""
_HEARTBEAT_MODULUS = 2**32
SIGN = "Positive moves the tool point away from the workpiece."
"""Sign of every correction and displacement."""

GOOD = "Good"
NONE_STATED = "GoodNoData"
"""There is no value, and nothing is wrong with that."""
_BAD_BY_QUALITY = {
    SampleQuality.MISSING: "BadNoData",
    SampleQuality.STATUS_BAD: "BadSensorFailure",
    SampleQuality.OLD: "BadNoCommunication",
    SampleQuality.NO_TIME_STAMP: "BadNoCommunication",
    SampleQuality.OUT_OF_RANGE: "BadOutOfRange",
    SampleQuality.TOO_FAST: "BadSensorFailure",
    SampleQuality.FROZEN: "BadSensorFailure",
    SampleQuality.DISAGREES: "BadSensorFailure",
}


class Kind(Enum):
    """Kind of a value."""

    NUMBER = "Double"
    COUNT = "UInt32"
    FLAG = "Boolean"
    TEXT = "String"
    TIME = "DateTime"
    TEXTS = "String[]"
    NUMBERS = "Double[]"


class StatusValue(NamedTuple):
    """What a leaf says now."""

    value: Value
    """The value."""
    quality: str = GOOD
    """Name of its OPC UA status code."""
    time: datetime | None = None
    """When it was measured, aware; None: at the cycle."""


@final
@dataclass(frozen=True, slots=True)
class OutputFacts:
    """What does not change with the cycle: limits and parts of one output."""

    limits: Limits
    """Its limits."""
    parts: tuple[str, ...]
    """Names of its parts."""


def facts_of(compensation: Compensation) -> dict[str, OutputFacts]:
    """Return limits and parts by output.

    Parameters
    ----------
    compensation : Compensation
        What the machine is compensated with.

    Returns
    -------
    dict of str to OutputFacts
        By output of the model.
    """
    return {
        output.name: OutputFacts(limits, tuple(part.name for part in output.parts))
        for output, limits in zip(compensation.model.outputs, compensation.bounds, strict=True)
    }


@final
@dataclass(frozen=True, slots=True)
class Snapshot:
    """The status of one cycle, with what is known beside it."""

    status: RuntimeStatus
    """The status."""
    facts: Mapping[str, OutputFacts] = field(default_factory=dict[str, OutputFacts])
    """Limits and parts by output."""


@final
@dataclass(frozen=True, slots=True)
class Leaf:
    """One value that is shown."""

    path: str
    """Path, its parts separated by ``/``; the string of the node's id."""
    kind: Kind
    """Kind of its value."""
    text: str
    """What it means, with its unit in brackets."""
    read: Callable[[Snapshot], StatusValue] = field(repr=False)
    """What it says now."""
    prompt: bool = False
    """Whether a change is told at once rather than within a second."""


class Shape(NamedTuple):
    """What decides which leaves there are."""

    outputs: tuple[str, ...]
    """Names of the outputs."""
    channels: tuple[str, ...]
    """Names of the model's channels."""
    signals: tuple[str, ...]
    """Names of everything else that is read."""


def shape_of(status: RuntimeStatus) -> Shape:
    """Return what decides which leaves a status has."""
    others = (name for name in status.samples if name not in status.channels)
    return Shape(status.outputs, status.channels, tuple(others))


def leaves_of(shape: Shape) -> tuple[Leaf, ...]:
    """Return every leaf of a status of this shape.

    Parameters
    ----------
    shape : Shape
        Names of outputs, channels and signals.

    Returns
    -------
    tuple of Leaf
        In the order in which they are shown.
    """
    leaves = [*_OF_THE_LOOP]
    for i, name in enumerate(shape.outputs):
        leaves += _of_output(i, name)
    for i, name in enumerate(shape.channels):
        leaves += _of_input(i, name)
    for name in shape.signals:
        leaves += _of_signal(name)
    return tuple(leaves)


def segment(name: str) -> str:
    """Return a name as one part of a path: a slash in it is written ``%2F``."""
    return name.replace("%", "%25").replace("/", "%2F")


def _plain(read: Callable[[RuntimeStatus], Value]) -> Callable[[Snapshot], StatusValue]:
    return lambda now: StatusValue(read(now.status))


def state_text(status: RuntimeStatus) -> str:
    """Return the state and its reasons as an English sentence, unless the loop has one."""
    if status.text:
        return status.text
    return f"{sentence_of(state_message(status.output))}."


def state_message(output: CycleOutput) -> Message:
    """Return the state with its reasons."""
    state, reasons = output.state.value, tuple(reason.value for reason in output.reasons)
    if not reasons:
        return Message("event-state", {"state": state})
    return Message("event-state_reasons", {"state": state, "reasons": reasons})


def _alarm_line(alarm: Alarm) -> str:
    cause = f" {alarm.cause}" if alarm.cause else ""
    return f"{alarm.priority}: {alarm.text}{cause} {alarm.remedy}".strip()


def _diameter(now: Snapshot) -> StatusValue:
    diameter_mm = now.status.diameter_mm
    return StatusValue(diameter_mm, GOOD if diameter_mm is not None else NONE_STATED)


_OF_THE_LOOP = (
    Leaf(
        "Status/State",
        Kind.TEXT,
        "State of the compensation: Off, Warming, Active, Holding, Fading, Fault.",
        _plain(lambda s: s.output.state.value),
        prompt=True,
    ),
    Leaf(
        "Status/StateNumber",
        Kind.COUNT,
        "The same as a number: 0 Off, 1 Warming, 2 Active, 3 Holding, 4 Fading, 5 Fault.",
        _plain(lambda s: STATE_NUMBERS[s.output.state]),
        prompt=True,
    ),
    Leaf(
        "Status/StateSince",
        Kind.TIME,
        "Since when it is in this state.",
        _plain(lambda s: s.state_since),
        prompt=True,
    ),
    Leaf(
        "Status/Text",
        Kind.TEXT,
        "The state in an English sentence.",
        _plain(state_text),
        prompt=True,
    ),
    Leaf(
        "Status/Reasons",
        Kind.TEXTS,
        "Why it is not active, the gravest first: codes.",
        _plain(lambda s: tuple(r.value for r in s.output.reasons)),
        prompt=True,
    ),
    Leaf(
        "Status/Enabled",
        Kind.FLAG,
        "Whether somebody has enabled it.",
        _plain(lambda s: s.enabled),
        prompt=True,
    ),
    Leaf(
        "Status/Quality",
        Kind.TEXT,
        "Whether the model's output may be used: good, held, bad.",
        _plain(lambda s: s.output.quality.value),
        prompt=True,
    ),
    Leaf(
        "Status/Outcomes",
        Kind.TEXTS,
        "What was out of the ordinary in the model: codes.",
        _plain(lambda s: tuple(o.value for o in s.output.outcomes)),
    ),
    Leaf(
        "Status/SourceConnected",
        Kind.FLAG,
        "Whether the machine of the temperatures was reached.",
        _plain(lambda s: s.source_connected),
        prompt=True,
    ),
    Leaf(
        "Status/SinkConnected",
        Kind.FLAG,
        "Whether the machine of the offsets can be written to.",
        _plain(lambda s: s.sink_connected),
        prompt=True,
    ),
    Leaf("Status/Machine", Kind.TEXT, "Name of the machine.", _plain(lambda s: s.machine)),
    Leaf("Status/Started", Kind.TIME, "When the loop was started.", _plain(lambda s: s.started)),
    Leaf("Status/Time", Kind.TIME, "Time of the cycle.", _plain(lambda s: s.utc)),
    Leaf(
        "Status/Heartbeat",
        Kind.COUNT,
        "Number of the cycle; it moves as long as the loop lives. [1]",
        _plain(lambda s: s.number % _HEARTBEAT_MODULUS),
    ),
    Leaf("Status/Cycle", Kind.NUMBER, "Nominal cycle. [s]", _plain(lambda s: s.cycle_s)),
    Leaf("Status/Lateness", Kind.NUMBER, "How late it began. [s]", _plain(lambda s: s.lateness_s)),
    Leaf(
        "Status/Overruns",
        Kind.COUNT,
        "Cycles that were missed since the start. [1]",
        _plain(lambda s: s.overruns % _HEARTBEAT_MODULUS),
    ),
    Leaf(
        "Status/ConfigurationSha256",
        Kind.TEXT,
        "Hash of the configuration's rules: a screen with another one shows other rules.",
        _plain(lambda s: s.configuration_sha256),
    ),
    Leaf(
        "Status/Everything",
        Kind.TEXT,
        "All of it in one text, JSON: what a screen reads.",
        lambda now: StatusValue(as_json(now)),
    ),
    Leaf(
        "Alarms/Count",
        Kind.COUNT,
        "Number of alarms that stand. [1]",
        _plain(lambda s: len(s.alarms)),
        prompt=True,
    ),
    Leaf(
        "Alarms/Priority",
        Kind.TEXT,
        "Priority of the gravest: critical, high, medium, low; empty without an alarm.",
        _plain(lambda s: s.alarms[0].priority if s.alarms else ""),
        prompt=True,
    ),
    Leaf(
        "Alarms/Texts",
        Kind.TEXTS,
        "Each alarm in a line of English: priority, what, cause, what to do; the gravest first.",
        _plain(lambda s: tuple(_alarm_line(a) for a in s.alarms)),
        prompt=True,
    ),
    Leaf(
        "Alarms/Codes",
        Kind.TEXTS,
        "Their codes, in the same order.",
        _plain(lambda s: tuple(a.code for a in s.alarms)),
        prompt=True,
    ),
    Leaf("Model/File", Kind.TEXT, "File name of the model.", _plain(lambda s: s.model_file)),
    Leaf("Model/Sha256", Kind.TEXT, "Its hash.", _plain(lambda s: s.model_sha256)),
    Leaf(
        "Workpiece/Diameter",
        Kind.NUMBER,
        "Clamping diameter; no value means the tool centre point. [mm]",
        _diameter,
    ),
    Leaf(
        "Historian/Storing",
        Kind.FLAG,
        "Whether the last attempt to store succeeded.",
        _plain(lambda s: s.historian.storing),
    ),
    Leaf(
        "Historian/Waiting",
        Kind.COUNT,
        "Records that are kept until they can be stored. [1]",
        _plain(lambda s: s.historian.waiting),
    ),
    Leaf(
        "Historian/Lost",
        Kind.COUNT,
        "Records that were lost since the start. [1]",
        _plain(lambda s: s.historian.lost),
    ),
    Leaf(
        "Historian/Text",
        Kind.TEXT,
        "Why nothing can be stored; empty while it can. Losses stand in Lost.",
        _plain(lambda s: sentence_of(s.historian.failure) if s.historian.failure else ""),
    ),
)

_NOT_APPLIED = Applied(None, None, None)


def _number(value: float | None, missing: str) -> StatusValue:
    """Return a finite number, or its absence with a quality."""
    if value is None or not math.isfinite(value):
        return StatusValue(None, missing)
    return StatusValue(value)


def _of_output(index: int, name: str) -> list[Leaf]:
    """Return the leaves of one output."""

    def leaf(
        short: str,
        kind: Kind,
        text: str,
        read: Callable[[Snapshot], StatusValue],
        *,
        prompt: bool = False,
    ) -> Leaf:
        return Leaf(f"Outputs/{segment(name)}/{short}", kind, text, read, prompt)

    def number(short: str, text: str, read: Callable[[CycleOutput], float]) -> Leaf:
        return leaf(
            short, Kind.NUMBER, text, lambda now: _number(read(now.status.output), "BadNoData")
        )

    def flag(short: str, text: str, read: Callable[[CycleOutput], bool]) -> Leaf:
        return leaf(
            short, Kind.FLAG, text, lambda now: StatusValue(read(now.status.output)), prompt=True
        )

    def applied(now: Snapshot) -> Applied:
        return now.status.applied.get(name, _NOT_APPLIED)

    def limit(short: str, text: str, read: Callable[[Limits], float]) -> Leaf:
        def told(now: Snapshot) -> StatusValue:
            facts = now.facts.get(name)
            return (
                StatusValue(None, NONE_STATED) if facts is None else StatusValue(read(facts.limits))
            )

        return leaf(short, Kind.NUMBER, text, told)

    def soft(now: Snapshot) -> StatusValue:
        facts = now.facts.get(name)
        if facts is None:
            return StatusValue(None, NONE_STATED)
        return StatusValue(abs(now.status.output.correction_um[index]) > facts.limits.soft_um)

    def parts(now: Snapshot) -> StatusValue:
        facts = now.facts.get(name)
        return StatusValue(None, NONE_STATED) if facts is None else StatusValue(facts.parts)

    return [
        number("Correction", f"Correction in force. {SIGN} [µm]", lambda o: o.correction_um[index]),
        number(
            "Wanted",
            "Correction before rate and supervisor. [µm]",
            lambda o: o.wanted_um[index],
        ),
        number("Rate", "Change of the correction. [µm/s]", lambda o: o.rate_um_per_s[index]),
        leaf(
            "Requested",
            Kind.NUMBER,
            "What was written last. [µm]",
            lambda now: _number(applied(now).requested_um, NONE_STATED),
        ),
        leaf(
            "Accepted",
            Kind.NUMBER,
            "What the machine reports as set. [µm]",
            lambda now: _number(applied(now).accepted_um, "BadNoCommunication"),
        ),
        leaf(
            "Effective",
            Kind.NUMBER,
            "What the machine reports as acting now; no value where it does not say. [µm]",
            lambda now: _number(applied(now).effective_um, NONE_STATED),
        ),
        number(
            "Model",
            f"Displacement by the model. {SIGN} [µm]",
            lambda o: o.model_um[index],
        ),
        number(
            "Weight",
            "Weight of the model; below 1 outside the range of its training logs. [1]",
            lambda o: o.weight[index],
        ),
        flag(
            "AtLimit",
            "Whether the model asks for more than the output limit allows.",
            lambda o: o.at_limit[index],
        ),
        leaf(
            "AtSoftLimit",
            Kind.FLAG,
            "Whether the correction stands beyond the soft limit.",
            soft,
            prompt=True,
        ),
        number("Trim", "A person's addition. [µm]", lambda o: o.trim_um[index]),
        leaf(
            "TrimOwner",
            Kind.TEXT,
            "Who set the trim; empty without one.",
            lambda now: StatusValue(now.status.trim_owner.get(name, "")),
        ),
        leaf(
            "TrimLeft",
            Kind.NUMBER,
            "Time until the trim expires; 0 without one. [s]",
            lambda now: StatusValue(now.status.trim_left_s.get(name, 0.0)),
        ),
        leaf(
            "Parts",
            Kind.NUMBERS,
            "What every part of the model contributes. [µm]",
            lambda now: StatusValue(now.status.output.contribution_um[index]),
        ),
        leaf("PartNames", Kind.TEXTS, "Names of the parts, in the same order.", parts),
        limit("Limit", "Output limit of the correction. [µm]", lambda x: x.largest_um),
        limit("SoftLimit", "Magnitude from which is warned. [µm]", lambda x: x.soft_um),
        limit("TotalLimit", "Largest correction and trim together. [µm]", lambda x: x.total_um),
        limit("RateLimit", "Largest change. [µm/s]", lambda x: x.largest_rate_um_per_s),
        limit("TrimLimit", "Largest trim. [µm]", lambda x: x.largest_trim_um),
    ]


def _of_input(index: int, name: str) -> list[Leaf]:
    """Return the leaves of one channel of the model."""

    def sample(now: Snapshot) -> SourceSample:
        return now.status.samples.get(name, NOT_READ)

    def value(now: Snapshot) -> StatusValue:
        output = now.status.output
        quality = output.qualities[index]
        number = output.values[index]
        time = sample(now).source_time
        if number is None or not math.isfinite(number):
            return StatusValue(None, _BAD_BY_QUALITY.get(quality, "BadNoData"), time)
        if quality is SampleQuality.GOOD:
            return StatusValue(number, GOOD, time)
        redundant = quality is SampleQuality.REDUNDANT
        return StatusValue(
            number, "UncertainSubNormal" if redundant else "UncertainLastUsableValue", None
        )

    prefix = f"Inputs/{segment(name)}"
    return [
        Leaf(f"{prefix}/Value", Kind.NUMBER, "Value that the model was given. [°C]", value),
        Leaf(
            f"{prefix}/Quality",
            Kind.TEXT,
            "What is wrong with it, a code; good if nothing is.",
            lambda now: StatusValue(now.status.output.qualities[index].value),
            prompt=True,
        ),
        *_of_sample(prefix, name),
    ]


def _of_signal(name: str) -> list[Leaf]:
    """Return the leaves of a redundant sensor, an interlock or a flag."""
    return _of_sample(f"Signals/{segment(name)}", name)


def _of_sample(prefix: str, name: str) -> list[Leaf]:
    def sample(now: Snapshot) -> SourceSample:
        return now.status.samples.get(name, NOT_READ)

    def read(now: Snapshot) -> StatusValue:
        found = sample(now)
        if found.value is None or not math.isfinite(found.value):
            return StatusValue(None, "BadNoData", found.source_time)
        return StatusValue(
            found.value, GOOD if found.good else "BadSensorFailure", found.source_time
        )

    return [
        Leaf(f"{prefix}/Read", Kind.NUMBER, "What was read, in the channel's unit.", read),
        Leaf(
            f"{prefix}/Status",
            Kind.TEXT,
            "Name of the status with which it was read.",
            lambda now: StatusValue(sample(now).status),
        ),
        Leaf(
            f"{prefix}/Age",
            Kind.NUMBER,
            "Time since its source stamped it; no value without a time stamp. [s]",
            lambda now: _number(sample(now).age_s, "BadNoData"),
        ),
    ]


def as_json(now: Snapshot) -> str:
    """Return the whole status as one JSON object, for a screen that reads one node.

    Parameters
    ----------
    now : Snapshot
        The status.

    Returns
    -------
    str
        JSON in one line; numbers that are not finite are null, times are UTC in ISO 8601, lists
        by output, channel or part are objects by name.
    """
    s = now.status
    o = s.output
    return json.dumps(
        {
            "format": "thermaxis-status",
            "version": 2,
            "program_version": __version__,
            "machine": s.machine,
            "started": _iso(s.started),
            "utc": _iso(s.utc),
            "number": s.number,
            "cycle_s": s.cycle_s,
            "lateness_s": _finite(s.lateness_s),
            "overruns": s.overruns,
            "state": o.state.value,
            "state_since": _iso(s.state_since),
            "in_state_s": _finite(o.in_state_s),
            "enabled": s.enabled,
            "reasons": [r.value for r in o.reasons],
            "text": state_text(s),
            "quality": o.quality.value,
            "outcomes": [x.value for x in o.outcomes],
            "source_connected": s.source_connected,
            "sink_connected": s.sink_connected,
            "model_file": s.model_file,
            "model_sha256": s.model_sha256,
            "configuration_sha256": s.configuration_sha256,
            "diameter_mm": s.diameter_mm,
            "outputs": {name: _output_json(now, i, name) for i, name in enumerate(s.outputs)},
            "inputs": {
                name: {
                    "value_c": _finite(o.values[i]),
                    "reference_c": _finite(s.reference_c.get(name)),
                    "quality": o.qualities[i].value,
                    **_sample_json(s.samples.get(name, NOT_READ)),
                }
                for i, name in enumerate(s.channels)
            },
            "signals": {
                name: _sample_json(sample)
                for name, sample in s.samples.items()
                if name not in s.channels
            },
            "alarms": [
                {
                    "key": a.key,
                    "priority": a.priority,
                    "text": a.text,
                    "cause": a.cause,
                    "remedy": a.remedy,
                    "since": _iso(a.since),
                    "code": a.code,
                    "values": values_as_json(a.values),
                }
                for a in s.alarms
            ],
            "historian": _historian_json(s.historian),
        },
        allow_nan=False,
        separators=(",", ":"),
    )


def _historian_json(status: HistorianStatus) -> dict[str, object]:
    failure = status.failure
    return {
        "storing": status.storing,
        "waiting": status.waiting,
        "lost": status.lost,
        "text": "" if failure is None else sentence_of(failure),
        "failure": None if failure is None else value_as_json(failure),
    }


def _output_json(now: Snapshot, i: int, name: str) -> dict[str, object]:
    s = now.status
    o = s.output
    applied = s.applied.get(name, _NOT_APPLIED)
    facts = now.facts.get(name)
    contribution = [_finite(c) for c in o.contribution_um[i]]
    named = facts is not None and len(facts.parts) == len(contribution)
    parts = facts.parts if facts is not None and named else range(1, len(contribution) + 1)
    limits = None if facts is None else facts.limits
    return {
        "correction_um": _finite(o.correction_um[i]),
        "wanted_um": _finite(o.wanted_um[i]),
        "rate_um_per_s": _finite(o.rate_um_per_s[i]),
        "requested_um": _finite(applied.requested_um),
        "accepted_um": _finite(applied.accepted_um),
        "effective_um": _finite(applied.effective_um),
        "model_um": _finite(o.model_um[i]),
        "weight": _finite(o.weight[i]),
        "at_limit": o.at_limit[i],
        "at_soft_limit": None if limits is None else abs(o.correction_um[i]) > limits.soft_um,
        "trim_um": _finite(o.trim_um[i]),
        "trim_owner": s.trim_owner.get(name, ""),
        "trim_left_s": _finite(s.trim_left_s.get(name, 0.0)),
        "parts_um": {str(part): c for part, c in zip(parts, contribution, strict=True)},
        "limits": None
        if limits is None
        else {
            "largest_um": limits.largest_um,
            "soft_um": limits.soft_um,
            "total_um": limits.total_um,
            "largest_rate_um_per_s": limits.largest_rate_um_per_s,
            "deadband_um": limits.deadband_um,
            "largest_trim_um": limits.largest_trim_um,
        },
    }


def _sample_json(sample: SourceSample) -> dict[str, object]:
    return {
        "read": _finite(sample.value),
        "status": sample.status,
        "good": sample.good,
        "age_s": _finite(sample.age_s),
        "source_time": None if sample.source_time is None else _iso(sample.source_time),
    }


def _finite(value: float | None) -> float | None:
    return value if value is not None and math.isfinite(value) else None


def _iso(time: datetime) -> str:
    return time.astimezone(UTC).isoformat(timespec="milliseconds")
