"""Alarms: what a person should know, why, and what to do. States are not alarms."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from datetime import UTC, date, datetime, timedelta
from enum import StrEnum
from typing import Final, NamedTuple

from thermaxis.codes import NOWHERE, Message, Value, printable
from thermaxis.compensation import Compensation, Outcome, Reason, SampleQuality, SupervisorState
from thermaxis.messages import alarm_sentences
from thermaxis.runtime._connection import CERTIFICATE_WARNED_DAYS
from thermaxis.runtime._offsets import OffsetMismatch
from thermaxis.runtime._ports import NOT_READ
from thermaxis.runtime.status._status import Alarm, OutputOffsets, RuntimeStatus

PRIORITIES = ("critical", "high", "medium", "low")
"""Priorities, the gravest first."""
BEHIND_S = 300.0
"""The correction is called behind when the allowed rate needs longer than this to catch up. Longer
than an ordinary start, in which it comes from zero. [s]"""
TRIM_ENDS_S = 300.0
"""A trim that expires within this time is told. [s]"""
MODEL_AGE_DAYS = 365.0
"""A model older than this should be measured again. Default: the year after which instruments are
calibrated. [d]"""
_LONGEST_TEXT = 300
_SILENT: Final = Message("error-machine_silent")
_LONGEST_STATUS = 200


FOLLOWS_S: Final = 10.0
"""What acts may be behind what was accepted by so long at the allowed rate. [s]"""


class AlarmCode(StrEnum):
    """What an alarm says; its sentences stand in the catalogues."""

    FAULT_READ_BACK_DIFFERS = "fault_read_back_differs"
    FAULT_LONG_AT_LIMIT = "fault_long_at_limit"
    FAULT_OFFSET_OUTSIDE = "fault_offset_outside"
    FAULT_DOUBLE_COMPENSATION = "fault_double_compensation"
    HOLD_EXPIRED = "hold_expired"
    SINK_LOST = "sink_lost"
    WRITE_REFUSED = "write_refused"
    OFFSET_UNREAD = "offset_unread"
    SOURCE_LOST = "source_lost"
    SELF_TEST = "self_test"
    SENSOR_REDUNDANT = "sensor_redundant"
    SENSOR_BAD = "sensor_bad"
    SENSOR_UNREAD = "sensor_unread"
    STANDING_OFFSET = "standing_offset"
    OFFSET_MISMATCH = "offset_mismatch"
    ANOTHER_WRITER = "another_writer"
    NO_EFFECT = "no_effect"
    LIMIT = "limit"
    SOFT_LIMIT = "soft_limit"
    VALIDITY = "validity"
    BEHIND = "behind"
    TRIM_ENDS = "trim_ends"
    DIAMETER_HELD = "diameter_held"
    DIAMETER_UNKNOWN = "diameter_unknown"
    HISTORIAN = "historian"
    HISTORIAN_UNSTATED = "historian_unstated"
    HISTORY_LOST = "history_lost"
    LATE = "late"
    MODEL_OLD = "model_old"
    CERTIFICATE_EXPIRES = "certificate_expires"
    CERTIFICATE_EXPIRED = "certificate_expired"
    STATE_VERSION = "state_version"


_FAULTS: Final = {
    Reason.READ_BACK_DIFFERS: AlarmCode.FAULT_READ_BACK_DIFFERS,
    Reason.LONG_AT_LIMIT: AlarmCode.FAULT_LONG_AT_LIMIT,
    Reason.OFFSET_OUTSIDE: AlarmCode.FAULT_OFFSET_OUTSIDE,
    Reason.DOUBLE_COMPENSATION: AlarmCode.FAULT_DOUBLE_COMPENSATION,
}


def message_of(alarm: Alarm) -> Message:
    """Return what is wrong as a message."""
    return Message(f"alarm-{alarm.code}", alarm.values)


class _Found(NamedTuple):
    """An alarm before its words and its time are known."""

    key: str
    priority: str
    code: AlarmCode
    values: Mapping[str, Value] = {}

    def at(self, since: datetime) -> Alarm:
        """Return the alarm with its words."""
        said = alarm_sentences(self.code, self.values)
        text, cause, remedy = (printable(sentence, _LONGEST_TEXT) for sentence in said)
        return Alarm(self.key, self.priority, text, cause, remedy, since, self.code, self.values)


_FAULT_PRIORITIES = {Reason.DOUBLE_COMPENSATION: "high"}


def alarms_of(
    status: RuntimeStatus,
    compensation: Compensation,
    forbidden: Sequence[Message] = (),
    elsewhere: Sequence[OffsetMismatch] = (),
    *,
    unread: bool = False,
    other_state: Message | None = None,
) -> tuple[Alarm, ...]:
    """Return what a person should know of a status.

    Parameters
    ----------
    status : RuntimeStatus
        Status after a cycle; its alarms are those that stood before, whose times are kept.
    compensation : Compensation
        Limits, rules and model in force.
    forbidden : sequence of Message
        Why the self-test forbids a correction.
    elsewhere : sequence of OffsetMismatch
        Offsets that were not where the loop had left them, as long as they are to be told.
    unread : bool
        Whether a machine that is there has not told its offsets for too long.
    other_state : Message, optional
        Why a saved state of another version was not used, until a person has decided.

    Returns
    -------
    tuple of Alarm
        The gravest first.
    """
    came = {alarm.key: alarm.since for alarm in status.alarms}
    every = (
        *_all(status, compensation, forbidden, unread=unread),
        *_of_found(elsewhere),
        *_of_saved_state(other_state),
    )
    found = sorted(_unique(every), key=lambda f: PRIORITIES.index(f.priority))
    return tuple(one.at(came.get(one.key, status.utc)) for one in found)


def alarms_of_found(elsewhere: Sequence[OffsetMismatch], utc: datetime) -> tuple[Alarm, ...]:
    """Return the alarms for offsets that have just been found elsewhere."""
    return tuple(one.at(utc) for one in _of_found(elsewhere))


def is_mismatch(alarm: Alarm) -> bool:
    """Whether an alarm was made of an offset mismatch: it is told when that was found."""
    return alarm.code in {AlarmCode.OFFSET_MISMATCH, AlarmCode.ANOTHER_WRITER}


def sensor_key(name: str) -> str:
    """Return the key of the alarm of a sensor."""
    return f"sensor {name}"


def _unique(found: Iterable[_Found]) -> list[_Found]:
    return list({one.key: one for one in found}.values())


def _all(
    status: RuntimeStatus, compensation: Compensation, forbidden: Sequence[Message], *, unread: bool
) -> Iterator[_Found]:
    yield from _of_state(status)
    yield from _of_connections(status, compensation, unread=unread)
    for i, finding in enumerate(forbidden):
        remedy = replace(finding, code=f"{finding.code}.remedy", place=NOWHERE)
        values = {"finding": finding, "advice": remedy}
        yield _Found(f"self-test {i + 1}", "high", AlarmCode.SELF_TEST, values)
    if status.source_connected:
        for i, name in enumerate(status.channels):
            yield from _of_sensor(status, compensation, i, name)
    for i, name in enumerate(status.outputs):
        yield from _of_output(status, compensation, i, name)
    yield from _of_workpiece(status)
    yield from _of_the_loop(status)
    yield from _of_model(status, compensation)
    yield from _of_certificates(status)


def _of_found(elsewhere: Sequence[OffsetMismatch]) -> Iterator[_Found]:
    for one in elsewhere:
        values = {"name": one.output, "found_um": one.found_um, "left_um": one.left_um}
        code = AlarmCode.ANOTHER_WRITER if one.another else AlarmCode.OFFSET_MISMATCH
        yield _Found(one.key, "high", code, values)


def _of_saved_state(other: Message | None) -> Iterator[_Found]:
    if other is not None:
        yield _Found("saved state", "high", AlarmCode.STATE_VERSION, other.values)


def _duration(name: str, time_s: float) -> dict[str, Value]:
    """Return a time as number and unit, as it is told."""
    number, unit = (time_s / 60.0, "min") if time_s >= 120.0 else (time_s, "s")
    return {name: number, f"{name}_unit": unit}


def _of_state(status: RuntimeStatus) -> Iterator[_Found]:
    output = status.output
    for reason in output.reasons:
        if output.state is SupervisorState.FAULT and reason in _FAULTS:
            priority = _FAULT_PRIORITIES.get(reason, "critical")
            yield _Found(f"fault {reason.name}", priority, _FAULTS[reason])
        elif reason is Reason.HOLD_EXPIRED:
            yield _Found("hold expired", "medium", AlarmCode.HOLD_EXPIRED)


def _of_connections(
    status: RuntimeStatus, compensation: Compensation, *, unread: bool
) -> Iterator[_Found]:
    hold = _duration("hold", compensation.supervisor.hold_connection_s)
    gravest = "critical" if status.enabled else "low"
    sink = status.sink_reason
    if not status.sink_connected:
        because: dict[str, Value] = {"reason": sink or _SILENT}
        yield _Found("sink lost", gravest, AlarmCode.SINK_LOST, hold | because)
    elif status.enabled and sink is not None:
        yield _Found("write refused", "high", AlarmCode.WRITE_REFUSED, {"reason": sink})
    elif unread:
        yield _Found("offset unread", gravest, AlarmCode.OFFSET_UNREAD, hold)
    if not status.source_connected:
        because = {"reason": status.source_reason or _SILENT}
        priority = "high" if status.enabled else "low"
        yield _Found("source lost", priority, AlarmCode.SOURCE_LOST, hold | because)


def _of_sensor(
    status: RuntimeStatus, compensation: Compensation, index: int, name: str
) -> Iterator[_Found]:
    quality = status.output.qualities[index]
    if quality is SampleQuality.GOOD:
        return
    acts_on = ", ".join(
        output.name
        for output in compensation.model.outputs
        if any(name in {part.plus, part.minus} for part in output.parts)
    )
    values: dict[str, Value] = {"name": name, "acts_on": acts_on}
    if quality is SampleQuality.REDUNDANT:
        yield _Found(sensor_key(name), "medium", AlarmCode.SENSOR_REDUNDANT, values)
        return
    sample = status.samples.get(name, NOT_READ)
    values |= {"quality": quality.value, "sensor_cause": quality.value}
    values |= _duration("hold", compensation.supervisor.hold_input_s)
    code = AlarmCode.SENSOR_UNREAD
    if sample.value is not None:
        code = AlarmCode.SENSOR_BAD
        values |= {"read_c": sample.value, "status": printable(sample.status, _LONGEST_STATUS)}
    yield _Found(sensor_key(name), "high", code, values)


def _of_output(
    status: RuntimeStatus, compensation: Compensation, index: int, name: str
) -> Iterator[_Found]:
    output, limits = status.output, compensation.bounds[index]
    correction_um = output.correction_um[index]
    tolerance_um = compensation.supervisor.read_back_tolerance_um
    if output.state is SupervisorState.OFF and abs(correction_um) > tolerance_um:
        values = {"name": name, "correction_um": correction_um}
        yield _Found(f"standing offset {name}", "medium", AlarmCode.STANDING_OFFSET, values)
    yield from _of_effect(status, name, tolerance_um, limits.largest_rate_um_per_s)
    if status.enabled and output.at_limit[index]:
        values = {"name": name, "largest_um": limits.largest_um}
        yield _Found(f"limit {name}", "critical", AlarmCode.LIMIT, values)
    elif abs(correction_um) > limits.soft_um:
        values = {"name": name, "correction_um": correction_um, "soft_um": limits.soft_um}
        yield _Found(f"soft limit {name}", "medium", AlarmCode.SOFT_LIMIT, values)
    if status.enabled and output.weight[index] < 1.0:
        values = {"name": name, "weight_percent": 100.0 * output.weight[index]}
        yield _Found(f"validity {name}", "medium", AlarmCode.VALIDITY, values)
    behind_um = abs(output.wanted_um[index] - correction_um) - limits.deadband_um
    if (
        output.state is SupervisorState.ACTIVE
        and behind_um > BEHIND_S * limits.largest_rate_um_per_s
    ):
        values = {"name": name, "behind_um": behind_um}
        yield _Found(f"behind {name}", "medium", AlarmCode.BEHIND, values)
    left_s = status.trim_left_s.get(name, 0.0)
    if output.trim_um[index] and left_s < TRIM_ENDS_S:
        values = {"name": name, "trim_um": output.trim_um[index], **_duration("left", left_s)}
        yield _Found(f"trim {name}", "low", AlarmCode.TRIM_ENDS, values)


def _of_effect(
    status: RuntimeStatus, name: str, tolerance_um: float, rate_um_per_s: float
) -> Iterator[_Found]:
    _, accepted, effective = status.offsets.get(name, OutputOffsets())
    if accepted.um is None or effective.um is None:
        return
    behind_um = abs(effective.um - accepted.um)
    if behind_um > tolerance_um + FOLLOWS_S * rate_um_per_s:
        values: dict[str, Value] = {
            "name": name,
            "accepted_um": accepted.um,
            "effective_um": effective.um,
        }
        yield _Found(f"no effect {name}", "high", AlarmCode.NO_EFFECT, values)


def _of_workpiece(status: RuntimeStatus) -> Iterator[_Found]:
    for outcome, code in (
        (Outcome.DIAMETER_HELD, AlarmCode.DIAMETER_HELD),
        (Outcome.DIAMETER_UNKNOWN, AlarmCode.DIAMETER_UNKNOWN),
    ):
        if status.enabled and outcome in status.output.outcomes:
            yield _Found("diameter", "low", code)


def _of_the_loop(status: RuntimeStatus) -> Iterator[_Found]:
    historian = status.historian
    if not historian.storing:
        values: dict[str, Value] = {"waiting": historian.waiting}
        if historian.failure is not None:
            values["failure"] = historian.failure
        code = AlarmCode.HISTORIAN if historian.failure else AlarmCode.HISTORIAN_UNSTATED
        yield _Found("historian", "medium", code, values)
    if historian.lost:
        yield _Found("history lost", "medium", AlarmCode.HISTORY_LOST, {"lost": historian.lost})
    if status.lateness_s > status.cycle_s:
        yield _Found("late", "low", AlarmCode.LATE, {"lateness_s": status.lateness_s})


def _of_model(status: RuntimeStatus, compensation: Compensation) -> Iterator[_Found]:
    made = _date_of(compensation.model.provenance.date)
    if made is None:
        return
    age_days = (status.utc - made).total_seconds() / 86_400.0
    if age_days > MODEL_AGE_DAYS:
        yield _Found("model old", "low", AlarmCode.MODEL_OLD, {"age_months": age_days / 30.44})


def _of_certificates(status: RuntimeStatus) -> Iterator[_Found]:
    for key, end in status.certificates.items():
        days = (end - status.utc) / timedelta(days=1)
        if days >= CERTIFICATE_WARNED_DAYS:
            continue
        values: dict[str, Value] = {"key": key, "date": f"{end:%Y-%m-%d}"}
        priority, code = "high", AlarmCode.CERTIFICATE_EXPIRED
        if days >= 0.0:
            priority, code = "medium", AlarmCode.CERTIFICATE_EXPIRES
        yield _Found(f"certificate {key}", priority, code, values)


def _date_of(text: str) -> datetime | None:
    """Return the day that a model's date begins with, if it is one."""
    try:
        day = date.fromisoformat(text[:10])
    except ValueError:
        return None
    return datetime(day.year, day.month, day.day, tzinfo=UTC)
