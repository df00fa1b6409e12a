"""Every value that the loop tells, declared once: its names, type, unit, and where it is from.

The nodes of the status server, the JSON of a screen and what a screen checks of it, the page of
metrics and the page of the documentation are made of `FIELDS`. No OPC UA here: the server turns
paths into node ids and qualities into status codes.
"""

import json
import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from datetime import UTC, datetime
from enum import Enum
from functools import lru_cache
from operator import attrgetter
from typing import Any, Final, NamedTuple, cast, final

from thermaxis import __version__
from thermaxis.codes import Message, value_as_json, values_as_json
from thermaxis.compensation import Outcome, SampleQuality, SupervisorState
from thermaxis.messages import as_sentence, sentence, sentence_of
from thermaxis.runtime._ports import NOT_READ
from thermaxis.runtime.status._status import (
    Alarm,
    OutputOffsets,
    OutputTouches,
    RuntimeStatus,
)

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
_SILENT = "BadNoCommunication"
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
    """Type of a value: the name of its OPC UA type, or what stands in the JSON alone."""

    NUMBER = "Double"
    COUNT = "UInt32"
    FLAG = "Boolean"
    TEXT = "String"
    TIME = "DateTime"
    TEXTS = "String[]"
    NUMBERS = "Double[]"
    MESSAGE = "code and values, or null"
    TABLE = "numbers by name"


class StatusValue(NamedTuple):
    """What a field says now."""

    value: object
    """The value: of the field's type, or None."""
    quality: str = GOOD
    """Name of its OPC UA status code."""
    time: datetime | None = None
    """When it was measured, aware; None: at the cycle."""


class Owner(NamedTuple):
    """Which output, channel or signal a value belongs to."""

    name: str = ""
    """Its name; empty for the loop itself."""
    number: int = 0
    """Its number among the outputs or channels, from 0. [1]"""


@final
@dataclass(frozen=True, slots=True)
class Field:
    """One value that is told, of the loop or of each output, channel or signal."""

    node: str
    """Node, below the folder of its group; empty: none."""
    key: str
    """Key in the JSON, a key within a table behind ``/``; empty: not there."""
    metric: str
    """Name for Prometheus, that of a counter with ``_total`` at its end; empty: none."""
    kind: Kind
    """Type of the value."""
    unit: str
    """Its unit; empty where it has none."""
    source: "str | Callable[[RuntimeStatus, Owner], object]"
    """Where it is from: the way to it from the status, with a ``*`` in place of the output, channel
    or signal; or what computes it."""
    meaning: str
    """What it means."""
    prompt: bool = False
    """Whether a change is told at once rather than within a second."""
    missing: str = "BadNoData"
    """Name of the status code where there is no value, or no finite one."""

    @property
    def text(self) -> str:
        """The meaning with the unit in brackets."""
        return f"{self.meaning} [{self.unit}]" if self.unit else self.meaning


def state_text(status: RuntimeStatus) -> str:
    """Return the state and what is the matter in English."""
    return (
        f"{sentence(f'state-{status.output.state}')}. {as_sentence(sentence_of(status.headline))}"
    )


def _alarm_line(alarm: Alarm) -> str:
    return f"{alarm.priority}: {' '.join(filter(None, alarm.sentences))}"


def _code(reason: Message | None) -> str:
    return "" if reason is None else reason.code


def _sentence(failure: Message | None) -> str:
    return "" if failure is None else sentence_of(failure)


def _input(status: RuntimeStatus, owner: Owner) -> StatusValue:
    quality, value = status.output.qualities[owner.number], status.output.values[owner.number]
    time = status.samples.get(owner.name, NOT_READ).source_time
    if value is None or not math.isfinite(value):
        return StatusValue(None, _BAD_BY_QUALITY.get(quality, "BadNoData"), time)
    if quality is SampleQuality.GOOD:
        return StatusValue(value, GOOD, time)
    redundant = quality is SampleQuality.REDUNDANT
    return StatusValue(value, "UncertainSubNormal" if redundant else "UncertainLastUsableValue")


def _sample(status: RuntimeStatus, owner: Owner) -> StatusValue:
    found = status.samples.get(owner.name, NOT_READ)
    if found.value is None or not math.isfinite(found.value):
        return StatusValue(None, "BadNoData", found.source_time)
    return StatusValue(found.value, GOOD if found.good else "BadSensorFailure", found.source_time)


def _beyond_soft_limit(status: RuntimeStatus, owner: Owner) -> bool | None:
    facts = status.facts.get(owner.name)
    return facts and abs(status.output.correction_um[owner.number]) > facts.limits.soft_um


def _is_void(status: RuntimeStatus, owner: Owner) -> bool:
    return owner.name in status.touches and bool(status.touches[owner.name].void)


def _is_silent(status: RuntimeStatus) -> bool:
    """Whether the model says nothing: it waits for its first values, or has led to no number."""
    outcomes = status.output.outcomes
    return Outcome.WAITING in outcomes or outcomes == (Outcome.STATE_UNUSABLE,)


def _of_model(key: str) -> Callable[[RuntimeStatus, Owner], object]:
    """Return what reads a value of the model, which is not known while that says nothing."""
    return lambda s, o: None if _is_silent(s) else getattr(s.output, key)[o.number]


def _parts_um(status: RuntimeStatus, owner: Owner) -> dict[str, float]:
    """Return what every part contributes, by its name, or by its number where that is not known."""
    contribution, facts = status.output.contribution_um[owner.number], status.facts.get(owner.name)
    if _is_silent(status):
        contribution = (math.nan,) * len(contribution)
    named = facts is not None and len(facts.parts) == len(contribution)
    parts = facts.parts if facts is not None and named else range(1, len(contribution) + 1)
    return {str(part): um for part, um in zip(parts, contribution, strict=True)}


def _sources_um(status: RuntimeStatus, owner: Owner) -> dict[str, float]:
    """Return the share of every part in the correction, by its name."""
    weight = status.output.weight[owner.number]
    return {part: -weight * um for part, um in _parts_um(status, owner).items()}


def _rest_um(status: RuntimeStatus, owner: Owner) -> float:
    """Return what is left of the correction without sources, trim and touches."""
    output, k = status.output, owner.number
    shares_um = (
        *_sources_um(status, owner).values(),
        output.trim_um[k],
        *output.offset_um[k : k + 1],
    )
    return output.correction_um[k] - math.fsum(shares_um)


def _differences_k(status: RuntimeStatus, owner: Owner) -> dict[str, float]:
    """Return the input of every part: how far its channels have risen from their references."""
    rise_k = {"": 0.0}
    for name, value in zip(status.channels, status.output.values, strict=False):
        value_c = math.nan if value is None else value
        rise_k[name] = value_c - status.reference_c.get(name, math.nan)
    facts = status.facts.get(owner.name)
    rows = zip(facts.parts, facts.wires, strict=True) if facts else ()
    return {part: rise_k[plus] - rise_k[minus] for part, (plus, minus) in rows}


def _acting(status: RuntimeStatus, owner: Owner) -> StatusValue:
    """Return what acted when it was last read; bad where that may be so no more."""
    um = status.offsets_of(owner.name).acting.um
    return StatusValue(um, GOOD if status.acting_known(owner.name) else _SILENT)


def _effective(key: str) -> Callable[[RuntimeStatus, Owner], StatusValue]:
    """Return what reads a value of the effective offset, which not every machine tells."""

    def read(status: RuntimeStatus, owner: Owner) -> StatusValue:
        said = status.offsets_of(owner.name)
        value = getattr(said.effective, key)
        missing = _SILENT if said.tells_effective else NONE_STATED
        return StatusValue(value, missing if value is None else GOOD)

    return read


_F, _K = Field, Kind
_OF_THE_LOOP = (
    _F("Status/State", "state", "", _K.TEXT, "", "output.state",
       "State of the compensation: Off, Warming, Active, Holding, Fading, Fault.", prompt=True),
    _F("Status/StateNumber", "", "", _K.COUNT, "", lambda s, _: STATE_NUMBERS[s.output.state],
       "The same as a number: 0 Off, 1 Warming, 2 Active, 3 Holding, 4 Fading, 5 Fault.",
       prompt=True),
    _F("Status/StateSince", "state_since", "", _K.TIME, "", "state_since",
       "Since when it is in this state.", prompt=True),
    _F("", "in_state_s", "", _K.NUMBER, "s", "output.in_state_s", "... how long."),
    _F("Status/Text", "text", "", _K.TEXT, "", lambda s, _: state_text(s),
       "The state and what is the matter in English.", prompt=True),
    _F("Status/Headline", "", "", _K.TEXT, "", "headline.code",
       "What is the matter, a code: the cause goes before the state.", prompt=True),
    _F("", "headline", "", _K.MESSAGE, "", "headline", "The same, with its values."),
    _F("Status/HeadlineSince", "headline_since", "", _K.TIME, "", "headline_since",
       "Since when that is so; the start of the loop where it may have been so before.",
       prompt=True),
    _F("Status/OpenInterlocks", "open_interlocks", "", _K.TEXTS, "", "open_interlocks",
       "Names of the interlocks that are not met.", prompt=True),
    _F("Status/Reasons", "reasons", "", _K.TEXTS, "", "output.reasons",
       "Why it is not active, the gravest first: codes.", prompt=True),
    _F("Status/Enabled", "enabled", "enabled", _K.FLAG, "", "enabled",
       "Whether somebody has enabled it.", prompt=True),
    _F("Status/Settled", "settled", "settled", _K.FLAG, "", "settled",
       "Whether what acts is what the model asks for, to 1 µm beyond the deadband: not while it is"
       " held, fades or catches up, at a limit or not Active, nor where what acts cannot be read.",
       prompt=True),
    _F("Status/Quality", "quality", "", _K.TEXT, "", "output.quality",
       "Whether the model's output may be used: good, held, bad.", prompt=True),
    _F("Status/Outcomes", "outcomes", "", _K.TEXTS, "", "output.outcomes",
       "What was out of the ordinary in the model: codes."),
    _F("Status/SourceConnected", "source_connected", "", _K.FLAG, "", "source_connected",
       "Whether the machine of the temperatures was reached.", prompt=True),
    _F("Status/SourceReason", "", "", _K.TEXT, "", lambda s, _: _code(s.source_reason),
       "Why it was not reached, a code; empty while it is.", prompt=True),
    _F("", "source_reason", "", _K.MESSAGE, "", "source_reason", "The same, with its values."),
    _F("Status/SinkConnected", "sink_connected", "", _K.FLAG, "", "sink_connected",
       "Whether the machine of the offsets can be written to.", prompt=True),
    _F("Status/SinkReason", "", "", _K.TEXT, "", lambda s, _: _code(s.sink_reason),
       "Why it cannot, or what it refused last, a code; empty while nothing is wrong.",
       prompt=True),
    _F("", "sink_reason", "", _K.MESSAGE, "", "sink_reason", "The same, with its values."),
    _F("Status/Machine", "machine", "", _K.TEXT, "", "machine", "Name of the machine."),
    _F("Status/Started", "started", "start_time_seconds", _K.TIME, "", "started",
       "When the loop was started."),
    _F("Status/Time", "utc", "", _K.TIME, "", "utc", "Time of the cycle."),
    _F("Status/Heartbeat", "number", "cycles_total", _K.COUNT, "1", "number",
       "Number of the cycle; it moves as long as the loop lives."),
    _F("Status/Cycle", "cycle_s", "cycle_seconds", _K.NUMBER, "s", "cycle_s", "Nominal cycle."),
    _F("Status/Lateness", "lateness_s", "lateness_seconds", _K.NUMBER, "s", "lateness_s",
       "How late it began."),
    _F("Status/Overruns", "overruns", "overruns_total", _K.COUNT, "1", "overruns",
       "Cycles that were missed since the start."),
    _F("Status/ConfigurationSha256", "configuration_sha256", "", _K.TEXT, "",
       "configuration_sha256",
       "Hash of the configuration's rules: a screen with another one shows other rules."),
    _F("Status/Everything", "", "", _K.TEXT, "", lambda s, _: as_json(s),
       "All of it in one text, JSON: what a screen reads."),
    _F("Alarms/Count", "", "", _K.COUNT, "1", lambda s, _: len(s.alarms),
       "Number of alarms that stand.", prompt=True),
    _F("Alarms/Priority", "", "", _K.TEXT, "",
       lambda s, _: s.alarms[0].priority if s.alarms else "",
       "Priority of the gravest: critical, high, medium, low; empty without an alarm.",
       prompt=True),
    _F("Alarms/Texts", "", "", _K.TEXTS, "", lambda s, _: tuple(map(_alarm_line, s.alarms)),
       "Each alarm in a line of English: priority, what, cause, what to do; the gravest first.",
       prompt=True),
    _F("Alarms/Codes", "", "", _K.TEXTS, "", lambda s, _: tuple(a.code for a in s.alarms),
       "Their codes, in the same order.", prompt=True),
    _F("Model/File", "model_file", "", _K.TEXT, "", "model_file", "File name of the model."),
    _F("Model/Sha256", "model_sha256", "", _K.TEXT, "", "model_sha256", "Its hash."),
    _F("Workpiece/Diameter", "diameter_mm", "workpiece_diameter_millimetres", _K.NUMBER, "mm",
       "diameter_mm", "Clamping diameter; no value means the tool centre point.",
       missing=NONE_STATED),
    _F("Historian/Storing", "historian/storing", "historian_storing", _K.FLAG, "",
       "historian.storing", "Whether the last attempt to store succeeded."),
    _F("Historian/Waiting", "historian/waiting", "historian_waiting_records", _K.COUNT, "1",
       "historian.waiting", "Records that are kept until they can be stored."),
    _F("Historian/Lost", "historian/lost", "historian_lost_records_total", _K.COUNT, "1",
       "historian.lost", "Records that were lost since the start."),
    _F("Historian/Text", "historian/text", "", _K.TEXT, "",
       lambda s, _: _sentence(s.historian.failure),
       "Why nothing can be stored; empty while it can. Losses stand in Lost."),
    _F("", "historian/failure", "", _K.MESSAGE, "", "historian.failure", "The same as a code."),
)  # fmt: skip
_OF_AN_OUTPUT = (
    _F("Acting", "acting_um", "acting_micrometres", _K.NUMBER, "µm", _acting,
       f"What acts, as last read: effective where the machine tells that, else accepted. {SIGN}"),
    _F("ActingAge", "acting_age_s", "acting_age_seconds", _K.NUMBER, "s",
       "offsets.*.acting.age_s", "Time since that was read.", missing=_SILENT),
    _F("ActingKnown", "acting_known", "acting_known", _K.FLAG, "",
       lambda s, o: s.acting_known(o.name),
       "Whether that was the last look; else a watchdog may have taken it back.", prompt=True),
    _F("Correction", "correction_um", "computed_micrometres", _K.NUMBER, "µm",
       "output.correction_um.*", "Correction that is commanded now, whether or not it acts."),
    _F("Wanted", "wanted_um", "wanted_micrometres", _K.NUMBER, "µm", "output.wanted_um.*",
       "Correction before rate and supervisor."),
    _F("ToGo", "to_go_um", "to_go_micrometres", _K.NUMBER, "µm", "output.to_go_um.*",
       "Distance of the correction from what is wanted, whatever the state."),
    _F("Rate", "rate_um_per_s", "", _K.NUMBER, "µm/s", "output.rate_um_per_s.*",
       "Change of the correction."),
    _F("Requested", "requested_um", "commanded_micrometres", _K.NUMBER, "µm",
       "offsets.*.commanded.um", "What was written last, whether or not the machine took it.",
       missing=NONE_STATED),
    _F("RequestedAge", "requested_age_s", "commanded_age_seconds", _K.NUMBER, "s",
       "offsets.*.commanded.age_s", "Time since it was written.", missing=NONE_STATED),
    _F("Accepted", "accepted_um", "accepted_micrometres", _K.NUMBER, "µm",
       "offsets.*.accepted.um", "What the machine reports as set.", missing=_SILENT),
    _F("AcceptedAge", "accepted_age_s", "accepted_age_seconds", _K.NUMBER, "s",
       "offsets.*.accepted.age_s", "Time since the machine said it.", missing=_SILENT),
    _F("Effective", "effective_um", "effective_micrometres", _K.NUMBER, "µm", _effective("um"),
       "What the machine reports as acting now; no value where it does not say."),
    _F("EffectiveAge", "effective_age_s", "effective_age_seconds", _K.NUMBER, "s",
       _effective("age_s"), "Time since the machine said it."),
    _F("Model", "model_um", "model_micrometres", _K.NUMBER, "µm", _of_model("model_um"),
       f"Displacement by the model. {SIGN}"),
    _F("Weight", "weight", "weight_ratio", _K.NUMBER, "1", "output.weight.*",
       "Weight of the model; below 1 outside the range of its training logs."),
    _F("AtLimit", "at_limit", "at_limit", _K.FLAG, "", "output.at_limit.*",
       "Whether the model asks for more than the output limit allows.", prompt=True),
    _F("AtSoftLimit", "at_soft_limit", "", _K.FLAG, "", _beyond_soft_limit,
       "Whether the correction stands beyond the soft limit.", prompt=True, missing=NONE_STATED),
    _F("Trim", "trim_um", "trim_micrometres", _K.NUMBER, "µm", "output.trim_um.*",
       "A person's addition."),
    _F("TrimOwner", "trim_owner", "", _K.TEXT, "", "trim_owner.*",
       "Who set the trim; empty without one."),
    _F("TrimLeft", "trim_left_s", "", _K.NUMBER, "s", "trim_left_s.*",
       "Time until the trim expires; 0 without one."),
    _F("Offset", "offset_um", "offset_micrometres", _K.NUMBER, "µm", "touches.*.offset_um",
       "What touches of a probe add; no value where none are looked at.", missing=NONE_STATED),
    _F("OffsetKnown", "offset_known_um", "offset_known_micrometres", _K.NUMBER, "µm",
       "touches.*.known_um", "Displacement that the model lacks, as touches show it; no value"
       " before one was believed.", missing=NONE_STATED),
    _F("OffsetStd", "offset_std_um", "offset_std_micrometres", _K.NUMBER, "µm", "touches.*.std_um",
       "Standard uncertainty of the tool point, as it grows since the last touch, without what lies"
       " beyond the limit of the offset.",
       missing=NONE_STATED),
    _F("OffsetActs", "offset_acts", "", _K.FLAG, "", "touches.*.acts",
       "Whether touches are added to the correction, and not only shown."),
    _F("OffsetVoid", "offset_void", "offset_void", _K.FLAG, "", _is_void,
       "Whether touches contradict the offset that they gave: it is off until an Acknowledge.",
       prompt=True),
    _F("TouchNow", "touch_now", "touch_now", _K.FLAG, "", "touches.*.now",
       "Whether to touch now: the uncertainty passes `wanted_std_um`, or the last touch asks for"
       " another one.", prompt=True),
    _F("Touch", "touch_um", "", _K.NUMBER, "µm", "touches.*.value_um",
       "What the last touch showed.", missing=NONE_STATED),
    _F("TouchOutcome", "touch_outcome", "", _K.TEXT, "", "touches.*.outcome",
       "What became of it, a code; empty before the first.", prompt=True),
    _F("TouchTime", "touch_time", "touch_time_seconds", _K.TIME, "", "touches.*.touched",
       "When it was taken.", missing=NONE_STATED),
    _F("Parts", "", "", _K.NUMBERS, "µm", _of_model("contribution_um"),
       "What every part of the model contributes."),
    _F("PartNames", "", "", _K.TEXTS, "", "facts.*.parts",
       "Names of the parts, in the same order.", missing=NONE_STATED),
    _F("", "parts_um", "", _K.TABLE, "µm", _parts_um, "Both together."),
    _F("", "differences_k", "", _K.TABLE, "K", _differences_k,
       "Difference that drives each part, of temperatures from their references."),
    _F("", "sources_um", "", _K.TABLE, "µm", _sources_um,
       "Share of each part in the correction: minus what it contributes, weighted."),
    _F("", "rest_um", "", _K.NUMBER, "µm", _rest_um,
       "What sources, trim and touches lack of the correction: held back or added by limits and"
       " states."),
    _F("Limit", "limits/largest_um", "", _K.NUMBER, "µm", "facts.*.limits.largest_um",
       "Output limit of the correction.", missing=NONE_STATED),
    _F("SoftLimit", "limits/soft_um", "", _K.NUMBER, "µm", "facts.*.limits.soft_um",
       "Magnitude from which is warned.", missing=NONE_STATED),
    _F("TotalLimit", "limits/total_um", "", _K.NUMBER, "µm", "facts.*.limits.total_um",
       "Largest correction and trim together.", missing=NONE_STATED),
    _F("RateLimit", "limits/largest_rate_um_per_s", "", _K.NUMBER, "µm/s",
       "facts.*.limits.largest_rate_um_per_s", "Largest change.", missing=NONE_STATED),
    _F("", "limits/deadband_um", "", _K.NUMBER, "µm", "facts.*.limits.deadband_um",
       "Smallest change that is written."),
    _F("TrimLimit", "limits/largest_trim_um", "", _K.NUMBER, "µm",
       "facts.*.limits.largest_trim_um", "Largest trim.", missing=NONE_STATED),
)  # fmt: skip
_OF_A_SIGNAL = (
    _F("Read", "read", "", _K.NUMBER, "", _sample,
       "What was read, in the channel's unit."),
    _F("Status", "status", "", _K.TEXT, "", "samples.*.status",
       "Name of the status with which it was read."),
    _F("", "good", "", _K.FLAG, "", "samples.*.good", "Whether that is a good one."),
    _F("Age", "age_s", "", _K.NUMBER, "s", "samples.*.age_s",
       "Time since its source stamped it; no value without a time stamp."),
    _F("", "source_time", "", _K.TIME, "", "samples.*.source_time", "That time stamp."),
)  # fmt: skip
_OF_AN_INPUT = (
    _F("Value", "value_c", "input_celsius", _K.NUMBER, "°C", _input,
       "Value that the model was given."),
    _F("", "reference_c", "", _K.NUMBER, "°C", "reference_c.*",
       "Temperature that it counts from."),
    _F("Quality", "quality", "", _K.TEXT, "", "output.qualities.*",
       "What is wrong with it, a code; good if nothing is.", prompt=True),
    *(replace(one, metric="input_age_seconds") if one.key == "age_s" else one
      for one in _OF_A_SIGNAL),
)  # fmt: skip


class Fields(NamedTuple):
    """All fields by what they belong to; the names are those of the tables in the JSON."""

    loop: tuple[Field, ...] = _OF_THE_LOOP
    """The loop itself."""
    outputs: tuple[Field, ...] = _OF_AN_OUTPUT
    """Each output."""
    inputs: tuple[Field, ...] = _OF_AN_INPUT
    """Each channel of the model."""
    signals: tuple[Field, ...] = _OF_A_SIGNAL
    """Each redundant sensor, interlock or flag."""


FIELDS: Final = Fields()
"""Every field that is told."""
_ABSENT: Final[Mapping[str, object]] = {
    "samples": NOT_READ,
    "offsets": OutputOffsets(),
    "touches": OutputTouches(),
    "trim_owner": "",
    "trim_left_s": 0.0,
}


@final
class Leaf:
    """A field at its place: of the loop, or of one output, channel or signal."""

    def __init__(self, of: Field, folder: str = "", owner: Owner = Owner()) -> None:  # noqa: B008 - it never changes
        self.field = of
        self.owner = owner
        within = f"{folder}/{segment(owner.name)}/" if folder else ""
        self.path = f"{within}{of.node}" if of.node else ""
        """The string of the node's id; empty where it has none."""
        self._read = of.source if callable(of.source) else _reader(of.source)

    def read(self, status: RuntimeStatus) -> StatusValue:
        """Return the value with its quality."""
        found = self._read(status, self.owner)
        if isinstance(found, StatusValue):
            return found
        if found is None or (isinstance(found, float) and not math.isfinite(found)):
            return StatusValue(None, self.field.missing)
        return StatusValue(_without_enum(found))


def _without_enum(value: object) -> object:
    if isinstance(value, tuple):
        return tuple(map(_without_enum, cast("tuple[object, ...]", value)))
    return value.value if isinstance(value, Enum) else value


def _reader(way: str) -> Callable[[RuntimeStatus, Owner], object]:
    """Return what goes a way from the status; a ``*`` takes from a tuple or a mapping."""
    before, star, after = way.partition(".*")
    get = attrgetter(before)
    if not star:
        return lambda status, _: get(status)
    rest = attrgetter(after[1:]) if after else None
    absent = _ABSENT.get(before)

    def found(status: RuntimeStatus, owner: Owner) -> object:
        table = get(status)
        one = table.get(owner.name, absent) if hasattr(table, "get") else table[owner.number]
        return one if one is None or rest is None else rest(one)

    return found


def segment(name: str) -> str:
    """Return a name as one part of a path: a slash in it is written ``%2F``."""
    return name.replace("%", "%25").replace("/", "%2F")


class Shape(NamedTuple):
    """What decides which leaves there are."""

    outputs: tuple[str, ...] = ()
    """Names of the outputs."""
    inputs: tuple[str, ...] = ()
    """Names of the model's channels."""
    signals: tuple[str, ...] = ()
    """Names of everything else that is read."""


def shape_of(status: RuntimeStatus) -> Shape:
    """Return what decides which leaves a status has."""
    others = (name for name in status.samples if name not in status.channels)
    return Shape(status.outputs, status.channels, tuple(others))


class Leaves(NamedTuple):
    """Every leaf of a status."""

    loop: tuple[Leaf, ...]
    """Those of the loop itself."""
    tables: Mapping[str, Mapping[str, Sequence[Leaf]]]
    """Those of each output, input and signal, by the table of the JSON and by name."""
    shown: Mapping[str, Leaf]
    """Those that have a node, by path, in the order in which they are shown."""


@lru_cache(maxsize=8)
def leaves_of(shape: Shape) -> Leaves:
    """Return every leaf of a status of this shape."""
    loop = tuple(map(Leaf, FIELDS.loop))
    tables = {
        table: {
            name: [Leaf(one, table.capitalize(), Owner(name, i)) for one in getattr(FIELDS, table)]
            for i, name in enumerate(names)
        }
        for table, names in shape._asdict().items()
    }
    named = (leaf for of in tables.values() for leaves in of.values() for leaf in leaves)
    return Leaves(loop, tables, {leaf.path: leaf for leaf in (*loop, *named) if leaf.path})


def as_json(status: RuntimeStatus) -> str:
    """Return the whole status as one JSON object, for a screen that reads one node.

    Returns
    -------
    str
        JSON in one line; numbers that are not finite are null, times are UTC in ISO 8601, lists
        by output, channel or part are objects by name.
    """
    leaves = leaves_of(shape_of(status))
    whole: dict[str, Any] = {
        "format": "thermaxis-status",
        "version": 3,
        "program_version": __version__,
        **_table_of(leaves.loop, status),
    }
    for table, of in leaves.tables.items():
        whole[table] = {name: _table_of(some, status) for name, some in of.items()}
    for name, table in whole["outputs"].items():
        if name not in status.facts:
            table["limits"] = None
    whole["alarms"] = [_alarm_table(alarm) for alarm in status.alarms]
    return json.dumps(whole, allow_nan=False, separators=(",", ":"))


def _table_of(leaves: Iterable[Leaf], status: RuntimeStatus) -> dict[str, Any]:
    """Return the values of leaves by their keys."""
    found: dict[str, Any] = {}
    for leaf in leaves:
        if leaf.field.key:
            above, _, key = leaf.field.key.rpartition("/")
            table = found.setdefault(above, {}) if above else found
            table[key] = _plain(leaf.read(status).value)
    return found


def _plain(value: object) -> object:
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, datetime):
        return value.astimezone(UTC).isoformat(timespec="milliseconds")
    if isinstance(value, Message):
        return value_as_json(value)
    if isinstance(value, dict):
        return {name: _plain(one) for name, one in cast("dict[str, object]", value).items()}
    return value


def _alarm_table(alarm: Alarm) -> dict[str, object]:
    table = {one.name: getattr(alarm, one.name) for one in fields(alarm)}
    said = alarm.sentences._asdict()
    return table | said | {"since": _plain(alarm.since), "values": values_as_json(alarm.values)}
