"""The English of every alarm, by its code: the one place where an alarm's words stand.

A screen says the same alarm in another language by code and values. So that a page's script can
fill a sentence as this program does, its gaps hold only names with the formats ``+.1f``, ``.1f``,
``.0f`` or none; what depends on a case is a code, or a word among the values.
"""

from collections.abc import Mapping
from typing import Final, NamedTuple

from thermaxis.compensation import Reason, SampleQuality


class AlarmWords(NamedTuple):
    """Sentences of an alarm, with gaps for its values."""

    text: str
    """What is wrong."""
    cause: str
    """Why, as far as is known."""
    remedy: str
    """What to do."""

    def filled(self, values: Mapping[str, float | str]) -> "AlarmWords":
        """Return the sentences with their gaps filled.

        Parameters
        ----------
        values : mapping
            Number or text by name of a gap.

        Returns
        -------
        AlarmWords
            The sentences.

        Raises
        ------
        KeyError
            If a gap's value is missing.
        """
        return AlarmWords(*(template.format_map(values) for template in self))


SENSOR_CAUSES: Final = {
    SampleQuality.MISSING: "The source has no value for it.",
    SampleQuality.STATUS_BAD: "A broken wire, a failed module, or a channel that is switched off.",
    SampleQuality.OLD: "The source has stopped refreshing it.",
    SampleQuality.NO_TIME_STAMP: "The source does not say how old the value is.",
    SampleQuality.OUT_OF_RANGE: "A broken or short-circuited sensor, or another unit.",
    SampleQuality.TOO_FAST: "A loose contact, or sensors that were swapped.",
    SampleQuality.FROZEN: "The sensor or its module stands still.",
    SampleQuality.DISAGREES: "One of the two sensors is wrong or has come off.",
}
"""What may be behind a value that is not believed; the value ``sensor_cause`` of an alarm."""

FAULT_CODES: Final = {
    Reason.READ_BACK_DIFFERS: "fault_read_back_differs",
    Reason.LONG_AT_LIMIT: "fault_long_at_limit",
    Reason.OFFSET_OUTSIDE: "fault_offset_outside",
    Reason.DOUBLE_COMPENSATION: "fault_double_compensation",
}
"""Code of the alarm of each fault."""

_SENSOR_REMEDY = (
    "The correction of {acts_on} is held for {hold:.0f} {hold_unit}, then it fades. Check wire and"
    " sensor; acknowledge if its present value is right."
)
_TRY_AGAIN = "Check network and control; it is tried again without an end."
_DIAMETER_CAUSE = "The gain of the model depends on the workpiece's diameter."

ALARM_WORDS: Final[Mapping[str, AlarmWords]] = {
    "fault_read_back_differs": AlarmWords(
        "The machine does not report the offset that was written.",
        "The connection, the sign or unit of the node, or somebody else who writes the offset.",
        "The correction fades out. Check the connection and who else writes the offset, "
        "reference the axis again if in doubt, then acknowledge.",
    ),
    "fault_long_at_limit": AlarmWords(
        "The correction stood at its limit for too long.",
        "The machine is warmer than ever before, or model or sensor is wrong.",
        "Compare with a probe measurement before going on, then acknowledge.",
    ),
    "fault_offset_outside": AlarmWords(
        "The offset found in the machine lies outside the limits.",
        "Something else has written the offset, or the limits were made smaller.",
        "Find out who wrote it, set it to zero on the machine if nobody needs it, "
        "then acknowledge.",
    ),
    "fault_double_compensation": AlarmWords(
        "Another compensation is active on the axis.",
        "The machine's own thermal compensation is on.",
        "Switch one of the two off, then acknowledge.",
    ),
    "hold_expired": AlarmWords(
        "An operator's hold has lasted for as long as it may: the correction fades.",
        "Nobody has ended the hold.",
        "Resume, or disable the compensation.",
    ),
    "sink_lost": AlarmWords(
        "The control cannot be written to.",
        "The connection is lost, or the control has ended its session.",
        "The last offset stands in the machine; after {hold:.0f} {hold_unit} the correction fades"
        f" as soon as it can be written. {_TRY_AGAIN}",
    ),
    "offset_unread": AlarmWords(
        "The offset that stands in the control cannot be read, so that nothing is written.",
        "The control answers too late or not at all, or what it tells is no offset.",
        "The last offset stands in the machine; after {hold:.0f} {hold_unit} the correction fades"
        " as soon as the offset can be read. Check network, control and the offset itself; it is"
        " read again in every cycle.",
    ),
    "source_lost": AlarmWords(
        "The temperatures cannot be read.",
        "The connection is lost, or the source has ended.",
        f"The correction is held for {{hold:.0f}} {{hold_unit}}, then it fades. {_TRY_AGAIN}",
    ),
    "self_test": AlarmWords(
        "{finding}",
        "The self-test found it; it forbids a correction.",
        "Put it right; the self-test is repeated by itself.",
    ),
    "sensor_spare": AlarmWords(
        "Sensor {name}: the spare sensor stands in.",
        "The first sensor gives no usable value.",
        "Replace the first sensor; without the spare one {acts_on} would be held.",
    ),
    "sensor_bad": AlarmWords(
        "Sensor {name}: {quality}.",
        "{sensor_cause} {read_c:.1f} was read, status {status}.",
        _SENSOR_REMEDY,
    ),
    "sensor_unread": AlarmWords("Sensor {name}: {quality}.", "{sensor_cause}", _SENSOR_REMEDY),
    "standing_offset": AlarmWords(
        "An offset of {correction_um:+.1f} µm stands in {name}, and the compensation is off.",
        "It stood there when the program was started, and the machine has not taken it back.",
        "Enable the compensation and go on from it, or enable and disable to fade it out.",
    ),
    "found_elsewhere": AlarmWords(
        "The offset of {name} was found at {found_um:+.1f} µm; it had been left at "
        "{left_um:+.1f} µm.",
        "This program stood still or the connection was lost, and the machine's watchdog took the "
        "offset back, or somebody else has written it.",
        "The correction goes on from there, and a hold holds that. Judge what was cut meanwhile, "
        "find out why it stood still, then acknowledge.",
    ),
    "no_effect": AlarmWords(
        "{name} was taken over as {accepted_um:+.1f} µm, but {effective_um:+.1f} µm acts.",
        "The machine's watchdog, its own rate, or a release that is missing.",
        "Look at the control; compare the cycle with the time of its watchdog.",
    ),
    "limit": AlarmWords(
        "The model asks for more than {name} may be corrected, {largest_um:.1f} µm.",
        "The machine is warmer than ever before, or model or sensor is wrong.",
        "Hold; compare with a probe measurement before going on.",
    ),
    "soft_limit": AlarmWords(
        "The correction of {name} is {correction_um:+.1f} µm, beyond its soft limit of "
        "{soft_um:.1f} µm.",
        "The machine is unusually warm or cold, or model or sensor is wrong.",
        "Watch it; compare with a probe measurement.",
    ),
    "validity": AlarmWords(
        "A temperature lies outside the range that the model was made from: the weight of "
        "{name} is {weight_percent:.0f} %.",
        "The machine works as it did in none of the training logs.",
        "Measure, or extend the model by a log of this work.",
    ),
    "behind": AlarmWords(
        "The correction of {name} is {behind_um:.1f} µm behind what the model asks for.",
        "The rate limit is smaller than the machine moves, or model or sensor is wrong.",
        "Watch it; look at the sensors, then at the rate limit.",
    ),
    "trim_ends": AlarmWords(
        "The trim of {name}, {trim_um:+.1f} µm, expires in {left:.0f} {left_unit}.",
        "Its time is over.",
        "Set it again, or let it expire.",
    ),
    "diameter_held": AlarmWords(
        "The workpiece's diameter lies outside the gains' range: the end value is held.",
        _DIAMETER_CAUSE,
        "State the right diameter, or measure at this one.",
    ),
    "diameter_unknown": AlarmWords(
        "No workpiece diameter is stated: the gain at the tool centre point is used.",
        _DIAMETER_CAUSE,
        "State the diameter of the workpiece.",
    ),
    "historian": AlarmWords(
        "{failure}",
        "{waiting:.0f} records are kept until they can be.",
        "Check disk and database; the compensation goes on.",
    ),
    "historian_unstated": AlarmWords(
        "The history cannot be stored.",
        "{waiting:.0f} records are kept until they can be.",
        "Check disk and database; the compensation goes on.",
    ),
    "history_lost": AlarmWords(
        "{lost:.0f} records of the history were lost since the start.",
        "It could not be stored for longer than records can be kept.",
        "Check disk and database; the gap is marked in the history.",
    ),
    "late": AlarmWords(
        "A cycle came {lateness_s:.1f} s late.",
        "The computer was busy, or stood still.",
        "Look for other work on this computer.",
    ),
    "model_old": AlarmWords(
        "The model is {age_months:.0f} months old.",
        "Machines change with wear and repair.",
        "Verify it with a new log, and identify it again if it has become worse.",
    ),
}
"""Sentences by code."""
