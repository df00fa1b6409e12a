"""Events of the history as pages show them, and the operator's trend that is marked with them."""

from collections.abc import Iterable, Mapping, Sequence
from datetime import datetime, timedelta
from textwrap import shorten
from typing import TYPE_CHECKING, Any, Final, cast

from thermaxis.codes import Message
from thermaxis.messages import LANGUAGES, isolated, sentence, sentence_of
from thermaxis.runtime import EventRecord, MachineConfiguration
from thermaxis.screen.feed import NO_NAMES, called, said_code
from thermaxis.screen.pages.history._series import Json, lines_of, to_ms

if TYPE_CHECKING:
    from thermaxis.runtime.history import HistoryReader

EVENT_KINDS: Final = (
    "start",
    "stop",
    "state",
    "request",
    "connection",
    "alarm",
    "commission",
    "loss",
    "touch",
)
"""Kinds of events."""
MARKED: Final = ("state", "request", "alarm", "touch")
"""Kinds of events that the operator's trend marks."""
MARK_LENGTH: Final = 44
"""Letters of an event's name in a chart. [1]"""
_RENEWS: Final = ("believed", "confirmed")
_GRAVE: Final = ("critical", "high")
_RANKS: Final = {"loss": 1, "start": 2, "stop": 2, "commission": 2, "connection": 3}
_SHORTEST, _FINE, _MARGIN = timedelta(minutes=5), timedelta(hours=1), timedelta(minutes=1)
TREND_H: Final = 8.0
"""Length of the operator's trend. [h]"""
TREND_POINTS: Final = 480
"""Its steps: minutes, which the history keeps ready. [1]"""
TREND_KEPT_S: Final = 15.0
"""Time for which the operator's trend is not asked for again. [s]"""
MOST_EVENTS: Final = 500
"""Events of one answer: the newest. [1]"""


def said_event(event: EventRecord, language: str, names: Mapping[str, str] = NO_NAMES) -> Json:
    """Return an event for a page, in its language and with what people call what it names."""
    event = called(event, names)
    code = event.code
    message = Message(code, event.values)
    said = sentence_of(message, language=language) if code else event.text
    if not code and language != LANGUAGES[0]:
        said = isolated(said)  # of a program that said it in English alone
    found: Json = {
        "t": to_ms(event.utc),
        "kind": event.kind,
        "kind_said": said_code("event_kind-", event.kind, language),
        "who": event.who,
        "said": said,
        "mark": said,
        "rank": _RANKS.get(event.kind, 3),
    }
    if event.kind == "state":
        found |= _said_state(event, language)
    elif event.kind == "alarm":
        found |= _said_alarm(event, said, language)
    elif event.kind == "request":
        found |= _said_request(event, said, language)
    elif event.kind == "touch":
        found["rank"] = 5 if event.values.get("outcome") in _RENEWS else 2
    found["mark"] = shorten(found["mark"], MARK_LENGTH, placeholder=" …")
    return found


def _said_state(event: EventRecord, language: str) -> Json:
    state = str(event.values.get("state", ""))
    mark = said_code("state-", state, language)
    return {"state": state, "mark": mark, "rank": 0 if state == "Fault" else 1}


def _said_alarm(event: EventRecord, said: str, language: str) -> Json:
    """Return how grave an alarm is, one that is gone least, and its name without the priority."""
    alarm, priority = event.values.get("alarm"), str(event.values.get("priority", ""))
    if event.code == "event-alarm_gone":
        return {"priority": "", "rank": 5}
    named = sentence_of(alarm, language=language) if isinstance(alarm, Message) else said
    return {"priority": priority, "mark": named, "rank": 0 if priority in _GRAVE else 2}


def _said_request(event: EventRecord, said: str, language: str) -> Json:
    """Return a request with what was asked for, and how it was answered."""
    details, answer = event.details, event.values.get("answer")
    kind = str(details.get("kind") or "")
    if "accepted" not in details:
        return {"mark": said, "rank": 4}
    asked = said_code("request-", kind, language)
    accepted = details["accepted"] is True
    if isinstance(answer, Message):
        key = "history-asked_accepted" if accepted else "history-asked_refused"
        values = {"what": _what(kind, details) or asked, "reason": answer}
        said = sentence(key, values, language=language)
    mark = f"{'' if accepted else '✕ '}{asked}{f' ({event.who})' if event.who else ''}"
    return {"request": kind, "accepted": accepted, "said": said, "mark": mark, "rank": 4}


def _what(kind: str, details: Mapping[str, str | float | bool | None]) -> Message | None:
    """Return what was asked for with its values; None where it has none."""
    output, value = str(details.get("output") or ""), details.get("value")
    if kind == "model":
        return Message("history-ask_model", {"file": str(details.get("text") or "")})
    if kind == "trim":
        asked = {"output": output, "value": value, "length": details.get("duration_s")}
        return Message("history-ask_trim", asked)
    if kind == "diameter":
        return Message(
            "history-ask_no_diameter" if value is None else "history-ask_diameter", {"value": value}
        )
    return None


def events_of(
    reader: "HistoryReader",
    span: tuple[datetime, datetime],
    kinds: Sequence[str] = (),
    newest: int = MOST_EVENTS,
) -> tuple[list[EventRecord], bool]:
    """Return the events of a span, and whether there are more."""
    found = list(reader.events(*span, kinds=kinds, newest=newest + 1))
    return found[-newest:], len(found) > newest


# ---- the operator's trend -----------------------------------------------------------------------


def trend8(
    reader: "HistoryReader",
    now: datetime,
    cycle_s: float,
    columns: Sequence[str],
) -> Json:
    """Return the last hours of what acted and of key temperatures, with events.

    The span begins with what is recorded in them, so that a machine that was just started is not
    drawn as a stroke at the edge.
    """
    span = now - timedelta(hours=TREND_H), now
    series = lines_of(reader, columns, span, cycle_s, TREND_POINTS)
    begins = [line["t"][0] for line in series.values() if line["t"]]
    recorded = timedelta(milliseconds=to_ms(now) - min(begins, default=to_ms(now)))
    span = now - min(max(recorded + _MARGIN, _SHORTEST), now - span[0]), now
    if recorded < _FINE:  # steps of a minute would be few
        series = lines_of(reader, columns, span, cycle_s, TREND_POINTS)
    events, more = events_of(reader, span, MARKED, 200)
    return {
        "first": to_ms(span[0]),
        "last": to_ms(now),
        "series": series,
        "events": events,
        "more_events": more,
    }


def acting_column(configuration: MachineConfiguration, output: str) -> str:
    """Return the column of what acts: effective where the machine tells that, else accepted."""
    from thermaxis.runtime.history import output_column  # noqa: PLC0415 - heavy

    settings = configuration.outputs.get(output)
    told = configuration.sink.kind == "linuxcnc" or bool(settings and settings.effective_node)
    return output_column(output, "effective" if told else "accepted")


def touch_columns(outputs: Iterable[str]) -> tuple[str, ...]:
    """Return the columns of what touches add at outputs, and of its standard uncertainty."""
    from thermaxis.runtime.history import output_column  # noqa: PLC0415 - heavy

    quantities = ("offset", "offset_std")
    return tuple(output_column(name, one) for name in outputs for one in quantities)


def names_now(status: Mapping[str, Any], table: str, configured: Sequence[str]) -> tuple[str, ...]:
    """Return the names of outputs or inputs, of the loop or, while it is silent, of the file."""
    told = status.get(table)
    if isinstance(told, Mapping) and told:
        return tuple(str(name) for name in cast("Mapping[object, object]", told))
    return tuple(configured)
