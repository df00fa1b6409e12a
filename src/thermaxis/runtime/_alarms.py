"""Alarms: what a person should know, why, and what to do. States are not alarms."""

from collections.abc import Iterable, Iterator, Sequence
from datetime import UTC, date, datetime
from typing import Final, NamedTuple

from thermaxis.compensation import Compensation, Outcome, Reason, SampleQuality, SupervisorState
from thermaxis.errors import printable
from thermaxis.runtime._ports import NOT_READ
from thermaxis.runtime._status import Alarm, RuntimeStatus

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


FOLLOWS_S: Final = 10.0
"""What acts may be behind what was accepted by so long at the allowed rate. [s]"""


class _Found(NamedTuple):
    """An alarm before its time is known."""

    key: str
    priority: str
    text: str
    cause: str
    remedy: str


_FAULTS = {
    Reason.READ_BACK_DIFFERS: (
        "critical",
        "The connection, the sign or unit of the node, or somebody else who writes the offset.",
        (
            "The correction fades out. Check the connection and who else writes the offset, "
            "reference the axis again if in doubt, then acknowledge."
        ),
    ),
    Reason.LONG_AT_LIMIT: (
        "critical",
        "The machine is warmer than ever before, or model or sensor is wrong.",
        "Compare with a probe measurement before going on, then acknowledge.",
    ),
    Reason.OFFSET_OUTSIDE: (
        "critical",
        "Something else has written the offset, or the limits were made smaller.",
        (
            "Find out who wrote it, set it to zero on the machine if nobody needs it, "
            "then acknowledge."
        ),
    ),
    Reason.DOUBLE_COMPENSATION: (
        "high",
        "The machine's own thermal compensation is on.",
        "Switch one of the two off, then acknowledge.",
    ),
}
_SENSOR_CAUSES = {
    SampleQuality.MISSING: "The source has no value for it.",
    SampleQuality.STATUS_BAD: "A broken wire, a failed module, or a channel that is switched off.",
    SampleQuality.OLD: "The source has stopped refreshing it.",
    SampleQuality.NO_TIME_STAMP: "The source does not say how old the value is.",
    SampleQuality.OUT_OF_RANGE: "A broken or short-circuited sensor, or another unit.",
    SampleQuality.TOO_FAST: "A loose contact, or sensors that were swapped.",
    SampleQuality.FROZEN: "The sensor or its module stands still.",
    SampleQuality.DISAGREES: "One of the two sensors is wrong or has come off.",
}


def alarms_of(
    status: RuntimeStatus, compensation: Compensation, forbidden: Sequence[str] = ()
) -> tuple[Alarm, ...]:
    """Return what a person should know of a status.

    Parameters
    ----------
    status : RuntimeStatus
        Status after a cycle; its alarms are those that stood before, whose times are kept.
    compensation : Compensation
        Limits, rules and model in force.
    forbidden : sequence of str
        Why the self-test forbids a correction, each a sentence.

    Returns
    -------
    tuple of Alarm
        The gravest first.
    """
    came = {alarm.key: alarm.since for alarm in status.alarms}
    found = sorted(
        _unique(_all(status, compensation, forbidden)), key=lambda f: PRIORITIES.index(f.priority)
    )
    return tuple(
        Alarm(f.key, f.priority, f.text, f.cause, f.remedy, came.get(f.key, status.utc))
        for f in found
    )


def _unique(found: Iterable[_Found]) -> list[_Found]:
    return list({one.key: one for one in found}.values())


def _all(
    status: RuntimeStatus, compensation: Compensation, forbidden: Sequence[str]
) -> Iterator[_Found]:
    yield from _of_state(status)
    yield from _of_connections(status, compensation)
    for i, sentence in enumerate(forbidden):
        yield _Found(
            f"self-test {i + 1}",
            "high",
            printable(_sentence(sentence), _LONGEST_TEXT),
            "The self-test found it; it forbids a correction.",
            "Put it right; the self-test is repeated by itself.",
        )
    if status.source_connected:
        for i, name in enumerate(status.channels):
            yield from _of_sensor(status, compensation, i, name)
    for i, name in enumerate(status.outputs):
        yield from _of_output(status, compensation, i, name)
    yield from _of_workpiece(status)
    yield from _of_the_loop(status)
    yield from _of_model(status, compensation)


def _sentence(text: str) -> str:
    """Return a text with a capital letter and a full stop."""
    text = text.strip()
    return text[:1].upper() + text[1:] + ("" if text.endswith((".", "!", "?")) else ".")


def _minutes(time_s: float) -> str:
    """Return a time in words."""
    return f"{time_s / 60.0:.0f} min" if time_s >= 120.0 else f"{time_s:.0f} s"


def _percent(share: float) -> str:
    return f"{100.0 * share:.0f} %"


def _of_state(status: RuntimeStatus) -> Iterator[_Found]:
    output = status.output
    for reason in output.reasons:
        if output.state is SupervisorState.FAULT and reason in _FAULTS:
            priority, cause, remedy = _FAULTS[reason]
            yield _Found(f"fault {reason.name}", priority, _sentence(reason.value), cause, remedy)
        elif reason is Reason.HOLD_EXPIRED:
            yield _Found(
                "hold expired",
                "medium",
                "An operator's hold has lasted for as long as it may: the correction fades.",
                "Nobody has ended the hold.",
                "Resume, or disable the compensation.",
            )


def _of_connections(status: RuntimeStatus, compensation: Compensation) -> Iterator[_Found]:
    hold = _minutes(compensation.supervisor.hold_connection_s)
    remedy = "Check network and control; it is tried again without an end."
    if not status.sink_connected:
        yield _Found(
            "sink lost",
            "critical" if status.enabled else "low",
            "The control cannot be written to.",
            "The connection is lost, or the control has ended its session.",
            f"The last offset stands in the machine; after {hold} the correction fades as soon "
            f"as it can be written. {remedy}",
        )
    if not status.source_connected:
        yield _Found(
            "source lost",
            "high" if status.enabled else "low",
            "The temperatures cannot be read.",
            "The connection is lost, or the source has ended.",
            f"The correction is held for {hold}, then it fades. {remedy}",
        )


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
    if quality is SampleQuality.SPARE:
        yield _Found(
            f"sensor {name}",
            "medium",
            f"Sensor {name}: {quality.value}.",
            "The first sensor gives no usable value.",
            f"Replace the first sensor; without the spare one {acts_on} would be held.",
        )
        return
    sample = status.samples.get(name, NOT_READ)
    read = "" if sample.value is None else f" {sample.value:.1f} was read, status {sample.status}."
    hold = _minutes(compensation.supervisor.hold_input_s)
    yield _Found(
        f"sensor {name}",
        "high",
        f"Sensor {name}: {quality.value}.",
        printable(_SENSOR_CAUSES.get(quality, "") + read, _LONGEST_TEXT),
        f"The correction of {acts_on} is held for {hold}, then it fades. Check wire and sensor; "
        "acknowledge if its present value is right.",
    )


def _of_output(
    status: RuntimeStatus, compensation: Compensation, index: int, name: str
) -> Iterator[_Found]:
    output, limits = status.output, compensation.bounds[index]
    correction_um = output.correction_um[index]
    tolerance_um = compensation.supervisor.read_back_tolerance_um
    if output.state is SupervisorState.OFF and abs(correction_um) > tolerance_um:
        yield _Found(
            f"standing offset {name}",
            "medium",
            f"An offset of {correction_um:+.1f} µm stands in {name}, and the compensation is off.",
            "It stood there when the program was started, and the machine has not taken it back.",
            "Enable the compensation and go on from it, or enable and disable to fade it out.",
        )
    applied = status.applied.get(name)
    if applied is not None and applied.accepted_um is not None and applied.effective_um is not None:
        behind_um = abs(applied.effective_um - applied.accepted_um)
        if behind_um > tolerance_um + FOLLOWS_S * limits.largest_rate_um_per_s:
            yield _Found(
                f"no effect {name}",
                "high",
                f"{name} was taken over as {applied.accepted_um:+.1f} µm, but"
                f" {applied.effective_um:+.1f} µm acts.",
                "The machine's watchdog, its own rate, or a release that is missing.",
                "Look at the control; compare the cycle with the time of its watchdog.",
            )
    if status.enabled and output.at_limit[index]:
        yield _Found(
            f"limit {name}",
            "critical",
            f"The model asks for more than {name} may be corrected, {limits.largest_um:.1f} µm.",
            "The machine is warmer than ever before, or model or sensor is wrong.",
            "Hold; compare with a probe measurement before going on.",
        )
    elif abs(correction_um) > limits.soft_um:
        yield _Found(
            f"soft limit {name}",
            "medium",
            f"The correction of {name} is {correction_um:+.1f} µm, beyond its soft limit of "
            f"{limits.soft_um:.1f} µm.",
            "The machine is unusually warm or cold, or model or sensor is wrong.",
            "Watch it; compare with a probe measurement.",
        )
    if status.enabled and output.weight[index] < 1.0:
        yield _Found(
            f"validity {name}",
            "medium",
            f"A temperature lies outside the range that the model was made from: the weight of "
            f"{name} is {_percent(output.weight[index])}.",
            "The machine works as it did in none of the training logs.",
            "Measure, or extend the model by a log of this work.",
        )
    behind_um = abs(output.wanted_um[index] - correction_um) - limits.deadband_um
    if (
        output.state is SupervisorState.ACTIVE
        and behind_um > BEHIND_S * limits.largest_rate_um_per_s
    ):
        yield _Found(
            f"behind {name}",
            "medium",
            f"The correction of {name} is {behind_um:.1f} µm behind what the model asks for.",
            "The rate limit is smaller than the machine moves, or model or sensor is wrong.",
            "Watch it; look at the sensors, then at the rate limit.",
        )
    left_s = status.trim_left_s.get(name, 0.0)
    if output.trim_um[index] and left_s < TRIM_ENDS_S:
        yield _Found(
            f"trim {name}",
            "low",
            f"The trim of {name}, {output.trim_um[index]:+.1f} µm, expires in {_minutes(left_s)}.",
            "Its time is over.",
            "Set it again, or let it expire.",
        )


def _of_workpiece(status: RuntimeStatus) -> Iterator[_Found]:
    for outcome, remedy in (
        (Outcome.DIAMETER_HELD, "State the right diameter, or measure at this one."),
        (Outcome.DIAMETER_UNKNOWN, "State the diameter of the workpiece."),
    ):
        if status.enabled and outcome in status.output.outcomes:
            yield _Found(
                "diameter",
                "low",
                _sentence(outcome.value),
                "The gain of the model depends on the workpiece's diameter.",
                remedy,
            )


def _of_the_loop(status: RuntimeStatus) -> Iterator[_Found]:
    historian = status.historian
    if not historian.storing:
        yield _Found(
            "historian",
            "medium",
            printable(historian.text or "The history cannot be stored.", _LONGEST_TEXT),
            f"{historian.waiting} records are kept until they can be.",
            "Check disk and database; the compensation goes on.",
        )
    if historian.lost:
        yield _Found(
            "history lost",
            "medium",
            f"{historian.lost} records of the history were lost since the start.",
            "It could not be stored for longer than records can be kept.",
            "Check disk and database; the gap is marked in the history.",
        )
    if status.lateness_s > status.cycle_s:
        yield _Found(
            "late",
            "low",
            f"A cycle came {status.lateness_s:.1f} s late.",
            "The computer was busy, or stood still.",
            "Look for other work on this computer.",
        )


def _of_model(status: RuntimeStatus, compensation: Compensation) -> Iterator[_Found]:
    made = _date_of(compensation.model.provenance.date)
    if made is None:
        return
    age_days = (status.utc - made).total_seconds() / 86_400.0
    if age_days > MODEL_AGE_DAYS:
        yield _Found(
            "model old",
            "low",
            f"The model is {age_days / 30.44:.0f} months old.",
            "Machines change with wear and repair.",
            "Verify it with a new log, and identify it again if it has become worse.",
        )


def _date_of(text: str) -> datetime | None:
    """Return the day that a model's date begins with, if it is one."""
    try:
        day = date.fromisoformat(text[:10])
    except ValueError:
        return None
    return datetime(day.year, day.month, day.day, tzinfo=UTC)
