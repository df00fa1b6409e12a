"""Alarms: what a person should know, why, and what to do. States are not alarms."""

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import replace
from datetime import UTC, date, datetime, timedelta
from typing import Final, NamedTuple, TypeAlias

from thermaxis.codes import NOWHERE, Message, Value, printable
from thermaxis.compensation import Compensation, Outcome, Reason, SampleQuality, SupervisorState
from thermaxis.runtime._connection import CERTIFICATE_WARNED_DAYS
from thermaxis.runtime._offsets import FOLLOWS_S, OffsetMismatch
from thermaxis.runtime._ports import NOT_READ
from thermaxis.runtime.status._status import Alarm, OutputTouches, RuntimeStatus

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
NOTED_WEIGHT = 0.95
"""A weight below this is told, and then until it is whole: a sensor at the end of its range comes
and goes. Default: a quarter of a kelvin at five of margin. [1]"""
_LONGEST_STATUS = 200
_SILENT: Final = Message("error-machine_silent")


class AlarmKind(NamedTuple):
    """One alarm; its sentences stand in the catalogues."""

    key: str
    """Short name; that of its output, sensor or certificate follows."""
    priority: str
    when_off: str = ""
    """How grave it is while the compensation is not enabled; empty: the same."""


ALARMS: Final[Mapping[str, AlarmKind]] = {
    "fault_read_back_differs": AlarmKind("fault READ_BACK_DIFFERS", "critical"),
    "fault_long_at_limit": AlarmKind("fault LONG_AT_LIMIT", "critical"),
    "fault_offset_outside": AlarmKind("fault OFFSET_OUTSIDE", "critical"),
    "fault_double_compensation": AlarmKind("fault DOUBLE_COMPENSATION", "critical"),
    "hold_expired": AlarmKind("hold expired", "medium"),
    "sink_lost": AlarmKind("sink lost", "critical", "low"),
    "write_refused": AlarmKind("write refused", "high"),
    "offset_unread": AlarmKind("offset unread", "critical", "low"),
    "source_lost": AlarmKind("source lost", "high", "low"),
    "self_test": AlarmKind("self-test", "high"),
    "sensor_redundant": AlarmKind("sensor", "medium"),
    "sensor_bad": AlarmKind("sensor", "high"),
    "sensor_unread": AlarmKind("sensor", "high"),
    "witness_bad": AlarmKind("sensor", "medium"),
    "standing_offset": AlarmKind("standing offset", "medium"),
    "offset_mismatch": AlarmKind("offset mismatch", "high"),
    "another_writer": AlarmKind("offset mismatch", "high"),
    "no_effect": AlarmKind("no effect", "high"),
    "limit": AlarmKind("limit", "critical"),
    "touch_excluded": AlarmKind("touch", "medium"),
    "touch_limit": AlarmKind("touch limit", "medium"),
    "touch_void": AlarmKind("touch void", "high"),
    "soft_limit": AlarmKind("soft limit", "medium"),
    "validity": AlarmKind("validity", "medium"),
    "behind": AlarmKind("behind", "medium"),
    "trim_ends": AlarmKind("trim", "low"),
    "diameter_held": AlarmKind("diameter", "low"),
    "diameter_unknown": AlarmKind("diameter", "low"),
    "historian": AlarmKind("historian", "medium"),
    "historian_unstated": AlarmKind("historian", "medium"),
    "history_lost": AlarmKind("history lost", "medium"),
    "late": AlarmKind("late", "low"),
    "model_old": AlarmKind("model old", "low"),
    "certificate_expires": AlarmKind("certificate", "medium"),
    "certificate_expired": AlarmKind("certificate", "high"),
    "state_version": AlarmKind("saved state", "high"),
}
"""Every alarm, by its code."""

_Found: TypeAlias = Iterator[tuple[str, str, Mapping[str, Value]]]
"""Code, name of the output, sensor or certificate, and what stands in the sentences."""


def alarms_of(
    status: RuntimeStatus,
    compensation: Compensation,
    forbidden: Sequence[Message] = (),
    elsewhere: Sequence[OffsetMismatch] = (),
    *,
    standing: Collection[str] = (),
    unread: bool = False,
    other_state: Message | None = None,
) -> tuple[Alarm, ...]:
    """Return what a person should know of a status.

    Parameters
    ----------
    status : RuntimeStatus
        Status after a cycle; its alarms are those that stood before, whose times are kept.
    elsewhere : sequence of OffsetMismatch
        Offsets that were not where the loop had left them, as long as they are to be told.
    standing : collection of str
        Outputs of which what acts has stopped to follow.
    unread : bool
        Whether a machine that is there has not told its offsets for too long.
    other_state : Message, optional
        Why a saved state of another version was not used, until a person has decided.
    """
    found = [
        *_of_state(status),
        *_of_connections(status, compensation, unread=unread),
        *_of_self_test(forbidden),
        *_of_sensors(status, compensation),
        *_of_outputs(status, compensation, standing),
        *_of_touches(status, compensation),
        *_of_the_loop(status),
        *_of_model(status, compensation),
        *_of_certificates(status),
        *_of_found(elsewhere),
    ]
    if other_state is not None:
        found.append(("state_version", "", other_state.values))
    came = {one.key: one.utc for one in elsewhere if one.utc}
    came |= {alarm.key: alarm.since for alarm in status.alarms}
    told = (_alarm(*one, status.utc, enabled=status.enabled) for one in found)
    unique = {one.key: replace(one, since=came.get(one.key, one.since)) for one in told}
    return tuple(sorted(unique.values(), key=lambda one: PRIORITIES.index(one.priority)))


def alarms_of_found(elsewhere: Sequence[OffsetMismatch], utc: datetime) -> tuple[Alarm, ...]:
    """Return the alarms for offsets that have just been found elsewhere."""
    return tuple(_alarm(*one, utc, enabled=True) for one in _of_found(elsewhere))


def is_mismatch(alarm: Alarm) -> bool:
    """Whether an alarm was made of an offset mismatch: it is told when that was found."""
    return alarm.code in {"offset_mismatch", "another_writer"}


def sensor_key(name: str) -> str:
    """Return the key of the alarm of a sensor."""
    return f"sensor {name}"


def _alarm(
    code: str, of: str, values: Mapping[str, Value], utc: datetime, *, enabled: bool
) -> Alarm:
    kind = ALARMS[code]
    priority = kind.priority if enabled else kind.when_off or kind.priority
    return Alarm(f"{kind.key} {of}".rstrip(), priority, utc, code, values)


def _duration(name: str, time_s: float) -> dict[str, Value]:
    """Return a time as number and unit, as it is told."""
    number, unit = (time_s / 60.0, "min") if time_s >= 120.0 else (time_s, "s")
    return {name: number, f"{name}_unit": unit}


def _of_state(status: RuntimeStatus) -> _Found:
    for reason in status.output.reasons:
        code = f"fault_{reason.value}"
        if status.output.state is SupervisorState.FAULT and code in ALARMS:
            yield code, "", {}
        elif reason is Reason.HOLD_EXPIRED:
            yield "hold_expired", "", {}


def _of_connections(status: RuntimeStatus, compensation: Compensation, *, unread: bool) -> _Found:
    hold = _duration("hold", compensation.supervisor.hold_connection_s)
    if not status.sink_connected:
        yield "sink_lost", "", {**hold, "reason": status.sink_reason or _SILENT}
    elif status.output.state is not SupervisorState.OFF and status.sink_reason is not None:
        yield "write_refused", "", {"reason": status.sink_reason}
    elif unread:
        yield "offset_unread", "", hold
    if not status.source_connected:
        yield "source_lost", "", {**hold, "reason": status.source_reason or _SILENT}


def _of_self_test(forbidden: Sequence[Message]) -> _Found:
    for i, finding in enumerate(forbidden, 1):
        remedy = replace(finding, code=f"{finding.code}.remedy", place=NOWHERE)
        yield "self_test", str(i), {"finding": finding, "advice": remedy}


def _of_sensors(status: RuntimeStatus, compensation: Compensation) -> _Found:
    hold = _duration("hold", compensation.supervisor.hold_input_s)
    for name, quality in zip(compensation.judged, status.output.qualities, strict=False):
        if quality is SampleQuality.GOOD or not status.source_connected:
            continue
        outputs = compensation.model.outputs
        acting = [o.name for o in outputs if any(name in {p.plus, p.minus} for p in o.parts)]
        values: dict[str, Value] = {"name": name, "acts_on": ", ".join(acting)}
        if quality is SampleQuality.REDUNDANT:
            yield "sensor_redundant", name, values
            continue
        values |= {"quality": quality.value, "sensor_cause": quality.value, **hold}
        sample = status.samples.get(name, NOT_READ)
        values["status"] = printable(sample.status, _LONGEST_STATUS)
        if name not in status.channels:
            yield "witness_bad", name, values
        elif sample.value is None:
            yield "sensor_unread", name, values
        else:
            yield "sensor_bad", name, {**values, "read_c": sample.value}


def _of_outputs(
    status: RuntimeStatus, compensation: Compensation, standing: Collection[str]
) -> _Found:
    stood = {alarm.key for alarm in status.alarms}
    for i, (name, limits) in enumerate(zip(status.outputs, compensation.bounds, strict=True)):
        output, of = status.output, {"name": name}
        correction_um, rate_um_per_s = output.correction_um[i], limits.largest_rate_um_per_s
        tolerance_um = compensation.supervisor.read_back_tolerance_um
        off = output.state is SupervisorState.OFF and status.acting_known(name)
        if off and abs(correction_um) > tolerance_um:
            yield "standing_offset", name, {**of, "correction_um": correction_um}
        said = status.offsets_of(name)
        accepted_um, effective_um = said.accepted.um, said.effective.um
        if name in standing and accepted_um is not None and effective_um is not None:
            acting = {**of, "accepted_um": accepted_um, "effective_um": effective_um}
            if abs(effective_um - accepted_um) > tolerance_um + FOLLOWS_S * rate_um_per_s:
                yield "no_effect", name, acting
        if status.enabled and output.at_limit[i]:
            yield "limit", name, {**of, "largest_um": limits.largest_um}
        elif abs(correction_um) > limits.soft_um:
            values = {"correction_um": correction_um, "soft_um": limits.soft_um}
            yield "soft_limit", name, of | values
        least = 1.0 if f"validity {name}" in stood else NOTED_WEIGHT
        if status.enabled and output.weight[i] < least:
            yield "validity", name, {**of, "weight_percent": 100.0 * output.weight[i]}
        behind_um = abs(output.wanted_um[i] - correction_um) - limits.deadband_um
        if output.state is SupervisorState.ACTIVE and behind_um > BEHIND_S * rate_um_per_s:
            yield "behind", name, {**of, "behind_um": behind_um}
        left_s = status.trim_left_s.get(name, 0.0)
        if output.trim_um[i] and left_s < TRIM_ENDS_S:
            left = _duration("left", left_s)
            yield "trim_ends", name, {**of, "trim_um": output.trim_um[i], **left}


def _of_touches(status: RuntimeStatus, compensation: Compensation) -> _Found:
    for name, rules in compensation.touches.items():
        touched, largest_um = status.touches.get(name, OutputTouches()), rules.limits.largest_um
        known_um = touched.known_um or 0.0
        if touched.void:
            yield "touch_void", name, {"name": name, "outcome": touched.void}
        elif touched.again:
            yield "touch_excluded", name, {"name": name, "value_um": touched.value_um or 0.0}
        if rules.acts and abs(known_um) > largest_um:
            values = {"name": name, "known_um": known_um, "largest_um": largest_um}
            yield "touch_limit", name, values


def _of_the_loop(status: RuntimeStatus) -> _Found:
    for outcome in (Outcome.DIAMETER_HELD, Outcome.DIAMETER_UNKNOWN):
        if status.enabled and outcome in status.output.outcomes:
            yield outcome.value, "", {}
    historian = status.historian
    if not historian.storing and historian.failure is None:
        yield "historian_unstated", "", {"waiting": historian.waiting}
    elif not historian.storing and historian.failure is not None:
        yield "historian", "", {"waiting": historian.waiting, "failure": historian.failure}
    if historian.lost:
        yield "history_lost", "", {"lost": historian.lost}
    if status.lateness_s > status.cycle_s:
        yield "late", "", {"lateness_s": status.lateness_s}


def _of_model(status: RuntimeStatus, compensation: Compensation) -> _Found:
    try:  # it may have no date, or one in words
        made = date.fromisoformat(compensation.model.provenance.date[:10])
    except ValueError:
        return
    began = datetime(made.year, made.month, made.day, tzinfo=UTC)
    age_days = (status.utc - began) / timedelta(days=1)
    if age_days > MODEL_AGE_DAYS:
        yield "model_old", "", {"age_months": age_days / 30.44}


def _of_certificates(status: RuntimeStatus) -> _Found:
    for key, end in status.certificates.items():
        days = (end - status.utc) / timedelta(days=1)
        if days < CERTIFICATE_WARNED_DAYS:
            code = "certificate_expired" if days < 0.0 else "certificate_expires"
            yield code, key, {"key": key, "date": f"{end:%Y-%m-%d}"}


def _of_found(elsewhere: Sequence[OffsetMismatch]) -> _Found:
    for one in elsewhere:
        values = {"name": one.output, "found_um": one.found_um, "left_um": one.left_um}
        code = "another_writer" if one.another else "offset_mismatch"
        yield code, f"{one.output} {one.number}", values
