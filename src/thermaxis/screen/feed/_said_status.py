"""The loop's status with what it says in codes put into sentences."""

from collections.abc import Mapping
from contextlib import suppress
from dataclasses import replace
from datetime import datetime
from typing import Any, Final

from thermaxis.codes import Message, Value, values_of_json
from thermaxis.messages import (
    LANGUAGES,
    alarm_sentences,
    as_sentence,
    isolated,
    keys,
    named_values,
    remedy_of,
    sentence,
    sentence_of,
)
from thermaxis.runtime import OTHERS_WITHIN_S, EventRecord

NO_NAMES: Final[Mapping[str, str]] = {}
"""Where nothing has a name of its own."""
_BESIDE: Final = ("headline-off", "headline-fault")
_UNSTATED: Final = {"historian": "historian_unstated"}
"""Alarms whose cause is for who looks at the details, and what is said of them at first."""


def said_status(
    status: Mapping[str, Any], language: str, names: Mapping[str, str] = NO_NAMES
) -> dict[str, Any]:
    """Return a status for a page: state, reasons, qualities and alarms in its language as well.

    So is said why an acknowledgement would be refused now. What people call by a name of their own
    is called so in sentences.
    """
    opened = _said_opened(status.get("open_interlocks"), language, names)
    return {
        **status,
        "state_said": _said_look(status, language),
        "opened_said": opened,
        "headline_said": _said_headline(status.get("headline") or {}, opened, language, names),
        "acknowledge_said": _said_wait(status, language),
        "reasons_said": [
            as_sentence(said_code("reason-", reason, language)) for reason in status["reasons"]
        ],
        "inputs": {
            name: {**sample, "quality_said": said_code("quality-", sample["quality"], language)}
            for name, sample in status["inputs"].items()
        },
        "outputs": {
            name: {**output, "touch_said": said_code("touch-", output["touch_outcome"], language)}
            if output.get("touch_outcome")
            else output
            for name, output in status.get("outputs", {}).items()
        },
        "alarms": [_said_alarm(alarm, language, names) for alarm in status["alarms"]],
    }


def called(said: EventRecord | Message, names: Mapping[str, str]) -> Any:
    """Return an event or a message with what people call what its sentences name."""
    named = named_values(said.code)
    values = {
        key: _called(value, names, names if key in named else NO_NAMES)
        for key, value in said.values.items()
    }
    return replace(said, values=values)


def _called(value: Value, names: Mapping[str, str], own: Mapping[str, str]) -> Any:
    if isinstance(value, Message):
        return called(value, names)
    if isinstance(value, tuple):
        return tuple(_called(one, names, own) for one in value)
    if isinstance(value, str):
        return ", ".join(own.get(one, one) for one in value.split(", "))
    return value


def _message(code: str, values: object, names: Mapping[str, str]) -> Message:
    return called(Message(code, values_of_json(values)), names)


def _said_headline(
    headline: Mapping[str, Any], opened: str, language: str, names: Mapping[str, str]
) -> dict[str, str]:
    """Return what is the matter and what to do; the code itself where it is newer than this.

    Where that does not say so, an open interlock is named in the place of what to do: in Fault the
    alarm says that, too.
    """
    told = _message(str(headline.get("code", "")), headline.get("values"), names)
    if told.code not in keys(LANGUAGES[0]):
        return {"text": told.code, "remedy": ""}
    text = as_sentence(sentence_of(told, language=language))
    remedy = remedy_of(told, language=language)
    return {"text": text, "remedy": opened if opened and told.code in _BESIDE else remedy}


def _said_opened(opened: object, language: str, names: Mapping[str, str]) -> str:
    """Return which interlocks are open; empty where none is."""
    if not opened:
        return ""
    told = _message("headline-interlock", {"names": opened}, names)
    return as_sentence(sentence_of(told, language=language))


def _said_look(status: Mapping[str, Any], language: str) -> str:
    """Return the one word for a state on all pages: that of what is the matter goes before."""
    headline: Mapping[str, Any] = status.get("headline") or {}
    look = str(headline.get("code", "")).removeprefix("headline-")
    if f"operator-look_{look}" in keys(LANGUAGES[0]):
        return said_code("operator-look_", look, language)
    return said_code("state-", status["state"], language)


def _said_wait(status: Mapping[str, Any], language: str) -> str:
    """Return for how long a fault cannot be acknowledged as another writer was seen of late."""
    alarms: list[dict[str, Any]] = status["alarms"]
    if "double_compensation" not in status["reasons"]:
        return ""
    with suppress(ValueError, TypeError):  # no times, or none was seen
        found = max(one["since"] for one in alarms if one.get("code") == "another_writer")
        passed = datetime.fromisoformat(status["utc"]) - datetime.fromisoformat(found)
        left_s = OTHERS_WITHIN_S - passed.total_seconds()
        if left_s > 0.0:
            return sentence("operator-why_writer", {"left_s": left_s}, language=language)
    return ""


def said_code(begin: str, code: str, language: str) -> str:
    """Return the sentence of a code; the code itself where it is newer than this program."""
    key = f"{begin}{code}"
    return sentence(key, language=language) if key in keys(LANGUAGES[0]) else code


def _said_alarm(
    alarm: Mapping[str, Any], language: str, names: Mapping[str, str]
) -> dict[str, Any]:
    """Return an alarm with its sentences; the loop's English where its code is not known here."""
    code = str(alarm.get("code", ""))
    values = _message(f"alarm-{code}", alarm.get("values"), names).values
    said = {**alarm, "priority_said": said_code("operator-", alarm["priority"], language)}
    if f"alarm-{code}" not in keys(LANGUAGES[0]):
        if language != LANGUAGES[0]:
            said |= {part: isolated(alarm[part]) for part in ("text", "cause", "remedy")}
        return said
    if code in _UNSTATED:
        said["detail"] = sentence("ask-told", {"said": values.get("failure")}, language=language)
    shown = alarm_sentences(_UNSTATED.get(code, code), values, language=language)
    return said | shown._asdict()
