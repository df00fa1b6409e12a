"""What the loop tells of a cycle: every value once, with its names, its unit and its quality.

No OPC UA here: a table of leaves, each with a function from the status to a value. A leaf says
under which path the status server shows it, under which key the JSON of a screen, and under which
name the page of metrics; the server turns paths into node ids and qualities into status codes.
"""

import json
import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, fields
from datetime import UTC, datetime
from enum import Enum
from functools import lru_cache
from typing import Any, NamedTuple, final

from thermaxis import __version__
from thermaxis.codes import Message, value_as_json, values_as_json
from thermaxis.compensation import Compensation, CycleOutput, Limits, SampleQuality, SupervisorState
from thermaxis.messages import sentence_of
from thermaxis.runtime._ports import NOT_READ, Applied, SourceSample
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
    """One value that is told."""

    path: str
    """Path, its parts separated by ``/``; the string of the node's id. Empty: in the JSON alone."""
    kind: Kind
    """Kind of its value."""
    text: str
    """What it means, with its unit in brackets."""
    value: Callable[[Snapshot], Value] = field(repr=False)
    """What it says now."""
    key: str = ""
    """Key in the JSON, a key within a table behind ``/``; empty: not there."""
    metric: str = ""
    """Name for Prometheus, that of a counter with ``_total`` at its end; empty: none."""
    prompt: bool = False
    """Whether a change is told at once rather than within a second."""
    missing: str = "BadNoData"
    """Name of the status code where there is no value, or no finite one."""
    judged: Callable[[Snapshot], StatusValue] | None = field(default=None, repr=False)
    """What it says with a quality and a time of its own."""

    @property
    def meaning(self) -> str:
        """The text without its unit."""
        return self.text.partition(" [")[0]

    def read(self, now: Snapshot) -> StatusValue:
        """Return the value with its quality."""
        if self.judged is not None:
            return self.judged(now)
        value = self.value(now)
        if value is None or (isinstance(value, float) and not math.isfinite(value)):
            return StatusValue(None, self.missing)
        return StatusValue(value)


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


class Leaves(NamedTuple):
    """Every leaf of a status."""

    loop: tuple[Leaf, ...]
    """Those of the loop itself."""
    outputs: Mapping[str, Sequence[Leaf]]
    """Those of each output."""
    inputs: Mapping[str, Sequence[Leaf]]
    """Those of each channel of the model."""
    signals: Mapping[str, Sequence[Leaf]]
    """Those of each redundant sensor, interlock or flag."""

    def shown(self) -> dict[str, Leaf]:
        """Return those that have a path, by path, in the order in which they are shown."""
        groups = (table.values() for table in (self.outputs, self.inputs, self.signals))
        named = (leaf for group in groups for leaves in group for leaf in leaves)
        return {leaf.path: leaf for leaf in (*self.loop, *named) if leaf.path}


@lru_cache(maxsize=8)
def leaves_of(shape: Shape) -> Leaves:
    """Return every leaf of a status of this shape."""
    return Leaves(
        _OF_THE_LOOP,
        {name: _of_output(i, name) for i, name in enumerate(shape.outputs)},
        {name: _of_input(i, name) for i, name in enumerate(shape.channels)},
        {name: _of_sample(f"Signals/{segment(name)}", name) for name in shape.signals},
    )


def segment(name: str) -> str:
    """Return a name as one part of a path: a slash in it is written ``%2F``."""
    return name.replace("%", "%25").replace("/", "%2F")


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


def _history_text(now: Snapshot) -> str:
    failure = now.status.historian.failure
    return "" if failure is None else sentence_of(failure)


def _of_status(
    path: str, kind: Kind, text: str, name: str, *, metric: str = "", prompt: bool = False
) -> Leaf:
    """Return the leaf of a field of the status, whose name is its key."""
    return Leaf(path, kind, text, lambda now: getattr(now.status, name), name, metric, prompt)


def _of_historian(path: str, kind: Kind, text: str, name: str, metric: str) -> Leaf:
    """Return the leaf of a field of the historian's status."""
    key = f"historian/{name}"
    return Leaf(path, kind, text, lambda now: getattr(now.status.historian, name), key, metric)


_OF_THE_LOOP = (
    Leaf(
        "Status/State",
        Kind.TEXT,
        "State of the compensation: Off, Warming, Active, Holding, Fading, Fault.",
        lambda now: now.status.output.state.value,
        "state",
        prompt=True,
    ),
    Leaf(
        "Status/StateNumber",
        Kind.COUNT,
        "The same as a number: 0 Off, 1 Warming, 2 Active, 3 Holding, 4 Fading, 5 Fault.",
        lambda now: STATE_NUMBERS[now.status.output.state],
        prompt=True,
    ),
    _of_status(
        "Status/StateSince",
        Kind.TIME,
        "Since when it is in this state.",
        "state_since",
        prompt=True,
    ),
    Leaf(
        "", Kind.NUMBER, "... how long. [s]", lambda now: now.status.output.in_state_s, "in_state_s"
    ),
    Leaf(
        "Status/Text",
        Kind.TEXT,
        "The state in an English sentence.",
        lambda now: state_text(now.status),
        "text",
        prompt=True,
    ),
    Leaf(
        "Status/Reasons",
        Kind.TEXTS,
        "Why it is not active, the gravest first: codes.",
        lambda now: tuple(r.value for r in now.status.output.reasons),
        "reasons",
        prompt=True,
    ),
    _of_status(
        "Status/Enabled",
        Kind.FLAG,
        "Whether somebody has enabled it.",
        "enabled",
        metric="enabled",
        prompt=True,
    ),
    Leaf(
        "Status/Quality",
        Kind.TEXT,
        "Whether the model's output may be used: good, held, bad.",
        lambda now: now.status.output.quality.value,
        "quality",
        prompt=True,
    ),
    Leaf(
        "Status/Outcomes",
        Kind.TEXTS,
        "What was out of the ordinary in the model: codes.",
        lambda now: tuple(o.value for o in now.status.output.outcomes),
        "outcomes",
    ),
    _of_status(
        "Status/SourceConnected",
        Kind.FLAG,
        "Whether the machine of the temperatures was reached.",
        "source_connected",
        prompt=True,
    ),
    _of_status(
        "Status/SinkConnected",
        Kind.FLAG,
        "Whether the machine of the offsets can be written to.",
        "sink_connected",
        prompt=True,
    ),
    _of_status("Status/Machine", Kind.TEXT, "Name of the machine.", "machine"),
    _of_status(
        "Status/Started",
        Kind.TIME,
        "When the loop was started.",
        "started",
        metric="start_time_seconds",
    ),
    _of_status("Status/Time", Kind.TIME, "Time of the cycle.", "utc"),
    _of_status(
        "Status/Heartbeat",
        Kind.COUNT,
        "Number of the cycle; it moves as long as the loop lives. [1]",
        "number",
        metric="cycles_total",
    ),
    _of_status(
        "Status/Cycle", Kind.NUMBER, "Nominal cycle. [s]", "cycle_s", metric="cycle_seconds"
    ),
    _of_status(
        "Status/Lateness",
        Kind.NUMBER,
        "How late it began. [s]",
        "lateness_s",
        metric="lateness_seconds",
    ),
    _of_status(
        "Status/Overruns",
        Kind.COUNT,
        "Cycles that were missed since the start. [1]",
        "overruns",
        metric="overruns_total",
    ),
    _of_status(
        "Status/ConfigurationSha256",
        Kind.TEXT,
        "Hash of the configuration's rules: a screen with another one shows other rules.",
        "configuration_sha256",
    ),
    Leaf(
        "Status/Everything",
        Kind.TEXT,
        "All of it in one text, JSON: what a screen reads.",
        lambda now: as_json(now),  # noqa: PLW0108 - it stands below
    ),
    Leaf(
        "Alarms/Count",
        Kind.COUNT,
        "Number of alarms that stand. [1]",
        lambda now: len(now.status.alarms),
        prompt=True,
    ),
    Leaf(
        "Alarms/Priority",
        Kind.TEXT,
        "Priority of the gravest: critical, high, medium, low; empty without an alarm.",
        lambda now: now.status.alarms[0].priority if now.status.alarms else "",
        prompt=True,
    ),
    Leaf(
        "Alarms/Texts",
        Kind.TEXTS,
        "Each alarm in a line of English: priority, what, cause, what to do; the gravest first.",
        lambda now: tuple(_alarm_line(a) for a in now.status.alarms),
        prompt=True,
    ),
    Leaf(
        "Alarms/Codes",
        Kind.TEXTS,
        "Their codes, in the same order.",
        lambda now: tuple(a.code for a in now.status.alarms),
        prompt=True,
    ),
    _of_status("Model/File", Kind.TEXT, "File name of the model.", "model_file"),
    _of_status("Model/Sha256", Kind.TEXT, "Its hash.", "model_sha256"),
    Leaf(
        "Workpiece/Diameter",
        Kind.NUMBER,
        "Clamping diameter; no value means the tool centre point. [mm]",
        lambda now: now.status.diameter_mm,
        "diameter_mm",
        "workpiece_diameter_millimetres",
        missing=NONE_STATED,
    ),
    _of_historian(
        "Historian/Storing",
        Kind.FLAG,
        "Whether the last attempt to store succeeded.",
        "storing",
        "historian_storing",
    ),
    _of_historian(
        "Historian/Waiting",
        Kind.COUNT,
        "Records that are kept until they can be stored. [1]",
        "waiting",
        "historian_waiting_records",
    ),
    _of_historian(
        "Historian/Lost",
        Kind.COUNT,
        "Records that were lost since the start. [1]",
        "lost",
        "historian_lost_records_total",
    ),
    Leaf(
        "Historian/Text",
        Kind.TEXT,
        "Why nothing can be stored; empty while it can. Losses stand in Lost.",
        _history_text,
        "historian/text",
    ),
)
_NOT_APPLIED = Applied(None, None, None)


def _of_output(i: int, name: str) -> list[Leaf]:
    """Return the leaves of one output."""

    def path(short: str) -> str:
        return f"Outputs/{segment(name)}/{short}"

    def number(short: str, text: str, key: str, metric: str = "") -> Leaf:
        def told(now: Snapshot) -> float:
            return getattr(now.status.output, key)[i]

        return Leaf(path(short), Kind.NUMBER, text, told, key, metric)

    def applied(short: str, text: str, key: str, missing: str, metric: str = "") -> Leaf:
        def told(now: Snapshot) -> float | None:
            return getattr(now.status.applied.get(name, _NOT_APPLIED), key)

        return Leaf(path(short), Kind.NUMBER, text, told, key, metric, missing=missing)

    def limit(short: str, text: str, key: str) -> Leaf:
        def told(now: Snapshot) -> float | None:
            return getattr(now.facts[name].limits, key) if name in now.facts else None

        shown = path(short) if short else ""
        return Leaf(shown, Kind.NUMBER, text, told, f"limits/{key}", missing=NONE_STATED)

    def soft(now: Snapshot) -> bool | None:
        facts = now.facts.get(name)
        return facts and abs(now.status.output.correction_um[i]) > facts.limits.soft_um

    def parts(now: Snapshot) -> tuple[str, ...] | None:
        return now.facts[name].parts if name in now.facts else None

    return [
        number(
            "Correction",
            f"Correction in force. {SIGN} [µm]",
            "correction_um",
            "correction_micrometres",
        ),
        number(
            "Wanted",
            "Correction before rate and supervisor. [µm]",
            "wanted_um",
            "wanted_micrometres",
        ),
        number("Rate", "Change of the correction. [µm/s]", "rate_um_per_s"),
        applied("Requested", "What was written last. [µm]", "requested_um", NONE_STATED),
        applied(
            "Accepted",
            "What the machine reports as set. [µm]",
            "accepted_um",
            "BadNoCommunication",
            "accepted_micrometres",
        ),
        applied(
            "Effective",
            "What the machine reports as acting now; no value where it does not say. [µm]",
            "effective_um",
            NONE_STATED,
            "effective_micrometres",
        ),
        number("Model", f"Displacement by the model. {SIGN} [µm]", "model_um", "model_micrometres"),
        number(
            "Weight",
            "Weight of the model; below 1 outside the range of its training logs. [1]",
            "weight",
            "weight_ratio",
        ),
        Leaf(
            path("AtLimit"),
            Kind.FLAG,
            "Whether the model asks for more than the output limit allows.",
            lambda now: now.status.output.at_limit[i],
            "at_limit",
            "at_limit",
            prompt=True,
        ),
        Leaf(
            path("AtSoftLimit"),
            Kind.FLAG,
            "Whether the correction stands beyond the soft limit.",
            soft,
            "at_soft_limit",
            prompt=True,
            missing=NONE_STATED,
        ),
        number("Trim", "A person's addition. [µm]", "trim_um", "trim_micrometres"),
        Leaf(
            path("TrimOwner"),
            Kind.TEXT,
            "Who set the trim; empty without one.",
            lambda now: now.status.trim_owner.get(name, ""),
            "trim_owner",
        ),
        Leaf(
            path("TrimLeft"),
            Kind.NUMBER,
            "Time until the trim expires; 0 without one. [s]",
            lambda now: now.status.trim_left_s.get(name, 0.0),
            "trim_left_s",
        ),
        Leaf(
            path("Parts"),
            Kind.NUMBERS,
            "What every part of the model contributes. [µm]",
            lambda now: now.status.output.contribution_um[i],
        ),
        Leaf(
            path("PartNames"),
            Kind.TEXTS,
            "Names of the parts, in the same order.",
            parts,
            missing=NONE_STATED,
        ),
        limit("Limit", "Output limit of the correction. [µm]", "largest_um"),
        limit("SoftLimit", "Magnitude from which is warned. [µm]", "soft_um"),
        limit("TotalLimit", "Largest correction and trim together. [µm]", "total_um"),
        limit("RateLimit", "Largest change. [µm/s]", "largest_rate_um_per_s"),
        limit("", "Smallest change that is written. [µm]", "deadband_um"),
        limit("TrimLimit", "Largest trim. [µm]", "largest_trim_um"),
    ]


def _of_input(i: int, name: str) -> list[Leaf]:
    """Return the leaves of one channel of the model."""

    def judged(now: Snapshot) -> StatusValue:
        quality, value = now.status.output.qualities[i], now.status.output.values[i]
        time = now.status.samples.get(name, NOT_READ).source_time
        if value is None or not math.isfinite(value):
            return StatusValue(None, _BAD_BY_QUALITY.get(quality, "BadNoData"), time)
        if quality is SampleQuality.GOOD:
            return StatusValue(value, GOOD, time)
        redundant = quality is SampleQuality.REDUNDANT
        return StatusValue(value, "UncertainSubNormal" if redundant else "UncertainLastUsableValue")

    prefix = f"Inputs/{segment(name)}"
    return [
        Leaf(
            f"{prefix}/Value",
            Kind.NUMBER,
            "Value that the model was given. [°C]",
            lambda now: now.status.output.values[i],
            "value_c",
            "input_celsius",
            judged=judged,
        ),
        Leaf(
            "",
            Kind.NUMBER,
            "Temperature that it counts from. [°C]",
            lambda now: now.status.reference_c.get(name),
            "reference_c",
        ),
        Leaf(
            f"{prefix}/Quality",
            Kind.TEXT,
            "What is wrong with it, a code; good if nothing is.",
            lambda now: now.status.output.qualities[i].value,
            "quality",
            prompt=True,
        ),
        *_of_sample(prefix, name, age="input_age_seconds"),
    ]


def _of_sample(prefix: str, name: str, *, age: str = "") -> list[Leaf]:
    """Return the leaves of what was read of a channel, or of any other signal."""

    def sample(now: Snapshot) -> SourceSample:
        return now.status.samples.get(name, NOT_READ)

    def judged(now: Snapshot) -> StatusValue:
        found = sample(now)
        if found.value is None or not math.isfinite(found.value):
            return StatusValue(None, "BadNoData", found.source_time)
        good = GOOD if found.good else "BadSensorFailure"
        return StatusValue(found.value, good, found.source_time)

    return [
        Leaf(
            f"{prefix}/Read",
            Kind.NUMBER,
            "What was read, in the channel's unit.",
            lambda now: sample(now).value,
            "read",
            judged=judged,
        ),
        Leaf(
            f"{prefix}/Status",
            Kind.TEXT,
            "Name of the status with which it was read.",
            lambda now: sample(now).status,
            "status",
        ),
        Leaf("", Kind.FLAG, "Whether that is a good one.", lambda now: sample(now).good, "good"),
        Leaf(
            f"{prefix}/Age",
            Kind.NUMBER,
            "Time since its source stamped it; no value without a time stamp. [s]",
            lambda now: sample(now).age_s,
            "age_s",
            age,
        ),
        Leaf("", Kind.TIME, "That time stamp.", lambda now: sample(now).source_time, "source_time"),
    ]


# ---- all of it in one text ----------------------------------------------------------------------


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
    leaves, failure = leaves_of(shape_of(now.status)), now.status.historian.failure
    whole: dict[str, Any] = {
        "format": "thermaxis-status",
        "version": 2,
        "program_version": __version__,
        **_table_of(leaves.loop, now),
        "outputs": {name: _table_of(some, now) for name, some in leaves.outputs.items()},
        "inputs": {name: _table_of(some, now) for name, some in leaves.inputs.items()},
        "signals": {name: _table_of(some, now) for name, some in leaves.signals.items()},
        "alarms": [_alarm_table(alarm) for alarm in now.status.alarms],
    }
    whole["historian"]["failure"] = None if failure is None else value_as_json(failure)
    for i, (name, table) in enumerate(whole["outputs"].items()):
        table["parts_um"] = _parts_um(now, i, name)
        if name not in now.facts:
            table["limits"] = None
    return json.dumps(whole, allow_nan=False, separators=(",", ":"))


def _table_of(leaves: Iterable[Leaf], now: Snapshot) -> dict[str, Any]:
    """Return the values of leaves by their keys."""
    found: dict[str, Any] = {}
    for leaf in leaves:
        if leaf.key:
            above, _, key = leaf.key.rpartition("/")
            table = found.setdefault(above, {}) if above else found
            table[key] = _plain(leaf.value(now))
    return found


def _plain(value: Value) -> object:
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, datetime):
        return value.astimezone(UTC).isoformat(timespec="milliseconds")
    return value


def _alarm_table(alarm: Alarm) -> dict[str, object]:
    table = {one.name: getattr(alarm, one.name) for one in fields(alarm)}
    return table | {"since": _plain(alarm.since), "values": values_as_json(alarm.values)}


def _parts_um(now: Snapshot, i: int, name: str) -> dict[str, object]:
    """Return what every part contributes, by its name, or by its number where that is not known."""
    contribution, facts = now.status.output.contribution_um[i], now.facts.get(name)
    named = facts is not None and len(facts.parts) == len(contribution)
    parts = facts.parts if facts is not None and named else range(1, len(contribution) + 1)
    return {str(part): _plain(c) for part, c in zip(parts, contribution, strict=True)}
