"""Events of the history as pages show them, and the operator's trend that is marked with them."""

from collections.abc import Mapping, Sequence
from datetime import datetime, timedelta
from typing import TYPE_CHECKING, Any, Final, cast

from thermaxis.codes import Message, Value, values_as_json, values_of_json
from thermaxis.messages import LANGUAGES, sentence, sentence_of
from thermaxis.runtime import EventRecord
from thermaxis.screen._words import free_text
from thermaxis.screen.pages.history._series import Json, lines_of, shortened, to_ms

if TYPE_CHECKING:
    from thermaxis.runtime.historian import HistoryReader

EVENT_KINDS: Final = (
    "start",
    "stop",
    "state",
    "request",
    "connection",
    "alarm",
    "commission",
    "loss",
)
"""Kinds of events."""
MARKED: Final = ("state", "request", "alarm")
"""Kinds of events that the operator's trend marks."""
TREND_H: Final = 8.0
"""Length of the operator's trend. [h]"""
TREND_POINTS: Final = 480
"""Its steps: minutes, which the history keeps ready. [1]"""
TREND_KEPT_S: Final = 15.0
"""Time for which the operator's trend is not asked for again. [s]"""
MOST_EVENTS: Final = 500
"""Events of one answer: the newest. [1]"""


def event_json(event: EventRecord) -> Json:
    """Return an event for a page."""
    values = event.values
    found: Json = {
        "t": to_ms(event.utc),
        "kind": event.kind,
        "who": event.who,
        "text": event.text,
        "code": event.code,
        "values": values_as_json(values),
    }
    alarm, answer = values.get("alarm"), values.get("answer")
    if event.kind == "state":
        found |= {"state": values.get("state", ""), "reasons": list(_several(values, "reasons"))}
    elif isinstance(alarm, Message):
        priority = "" if event.code == "event-alarm_gone" else str(values.get("priority", ""))
        found |= {"priority": priority, "alarm": sentence_of(alarm)}
    elif event.kind == "request" and "accepted" in event.details:
        details = event.details
        found |= {
            "request": str(details.get("kind") or ""),
            "output": str(details.get("output") or ""),
            "value": _number(details.get("value")),
            "duration_s": _number(details.get("duration_s")),
            "file": str(details.get("text") or ""),
            "accepted": details["accepted"] is True,
            "reason": sentence_of(answer) if isinstance(answer, Message) else "",
        }
    return found


def said_in(language: str, events: Sequence[Json]) -> list[Json]:
    """Return events with what happened in a language as well."""
    found: list[Json] = []
    for event in events:
        code, values = str(event["code"]), values_of_json(event["values"])
        said = sentence(code, values, language=language) if code else event["text"]
        found.append({**event, "said": said})
        foreign = language != LANGUAGES[0]
        english = free_text(language, values) if code else [event["text"]] * foreign
        answer = values.get("answer")
        if isinstance(answer, Message):
            found[-1]["said_reason"] = sentence_of(answer, language=language)
            english = free_text(language, answer.values)
        if english:
            found[-1]["english"] = english
    return found


def _several(values: Mapping[str, Value], name: str) -> tuple[str, ...]:
    found = values.get(name, ())
    return tuple(map(str, found)) if isinstance(found, tuple) else ()


def _number(value: object) -> float | None:
    return shortened(float(value)) if isinstance(value, int | float) else None


def events_of(
    reader: "HistoryReader",
    span: tuple[datetime, datetime],
    kinds: Sequence[str] = (),
    newest: int = MOST_EVENTS,
) -> tuple[list[Json], bool]:
    """Return the events of a span."""
    found = reader.events(*span, kinds=kinds, newest=newest + 1)
    return [event_json(event) for event in found[-newest:]], len(found) > newest


# ---- the operator's trend -----------------------------------------------------------------------


def trend8(
    reader: "HistoryReader",
    now: datetime,
    cycle_s: float,
    outputs: Sequence[str],
    channels: Sequence[str],
) -> Json:
    """Return the last hours of corrections and key temperatures, with events."""
    span = now - timedelta(hours=TREND_H), now
    names = [*(f"{output}.correction" for output in outputs), *channels]
    series = lines_of(reader, names, span, cycle_s, TREND_POINTS)
    events, more = events_of(reader, span, MARKED, 200)
    return {
        "first": to_ms(span[0]),
        "last": to_ms(now),
        "series": series,
        "events": events,
        "more_events": more,
    }


def names_now(status: Mapping[str, Any], table: str, configured: Sequence[str]) -> tuple[str, ...]:
    """Return the names of outputs or inputs, of the loop or, while it is silent, of the file."""
    told = status.get(table)
    if isinstance(told, Mapping) and told:
        return tuple(str(name) for name in cast("Mapping[object, object]", told))
    return tuple(configured)
