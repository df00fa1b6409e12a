"""Events of the history as pages show them, and the operator's trend that is marked with them."""

from collections.abc import Mapping, Sequence
from datetime import datetime, timedelta
from typing import TYPE_CHECKING, Any, Final, cast

from thermaxis.runtime import EventRecord
from thermaxis.screen.pages.history._series import Json, lines_of, shortened, to_ms

if TYPE_CHECKING:
    from thermaxis.runtime.historian import HistoryReader
    from thermaxis.screen._words import Words

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
    """Return an event for a page.

    Parameters
    ----------
    event : EventRecord
        The event.

    Returns
    -------
    dict
        ``t`` [ms since 1970], ``kind``, ``who``, ``text`` as recorded, in English, and what a page
        needs to say it in another language: of a state ``state`` and ``reasons``, of an alarm
        ``priority`` (empty once it is gone) and ``alarm``, of a request ``request``, ``output``,
        ``value``, ``duration_s``, ``accepted`` and ``reason``.
    """
    found: Json = {
        "t": to_ms(event.utc),
        "kind": event.kind,
        "who": event.who,
        "text": event.text,
    }
    head, _, tail = event.text.partition(": ")
    if event.kind == "state":
        found |= {"state": head, "reasons": tail.split("; ") if tail else []}
    elif event.kind == "alarm" and head in {"critical", "high", "medium", "low", "gone"}:
        found |= {"priority": "" if head == "gone" else head, "alarm": tail}
    elif event.kind == "request" and "accepted" in event.details:
        details = event.details
        found |= {
            "request": str(details.get("kind") or ""),
            "output": str(details.get("output") or ""),
            "value": _number(details.get("value")),
            "duration_s": _number(details.get("duration_s")),
            "file": str(details.get("text") or ""),
            "accepted": details["accepted"] is True,
            "reason": tail.partition(", ")[2],
        }
    return found


def said_in(language: str, words: "Words", events: Sequence[Json]) -> list[Json]:
    """Return events with what happened in a language as well.

    Parameters
    ----------
    language : str
        The language.
    words : Words
        Texts in every language.
    events : sequence of dict
        As `event_json` says.

    Returns
    -------
    list of dict
        The same with ``said``, and of a request ``said_reason``; English where there is no
        translation, and then what of it is English as ``english``.
    """
    found: list[Json] = []
    for event in events:
        said = words.phrase(language, f"event_{event['kind']}", event["text"])
        found.append({**event, "said": said})
        english = words.left_in_english(language, f"event_{event['kind']}", event["text"])
        if "reason" in event:
            found[-1]["said_reason"] = words.phrase(language, "answer", event["reason"])
            english = words.left_in_english(language, "answer", event["reason"])
        if english:
            found[-1]["english"] = english
    return found


def _number(value: object) -> float | None:
    return shortened(float(value)) if isinstance(value, int | float) else None


def events_of(
    reader: "HistoryReader",
    span: tuple[datetime, datetime],
    kinds: Sequence[str] = (),
    newest: int = MOST_EVENTS,
) -> tuple[list[Json], bool]:
    """Return the events of a span.

    Parameters
    ----------
    reader : HistoryReader
        The history.
    span : tuple of datetime
        Begin and end.
    kinds : sequence of str
        Kinds that are wanted. Default: all.
    newest : int
        Only so many, the newest. [1]

    Returns
    -------
    events : list of dict
        As `event_json` says, in the order of recording.
    more : bool
        Whether there are older ones in the span that are not given.
    """
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
    """Return the last hours of corrections and key temperatures, with events.

    Parameters
    ----------
    reader : HistoryReader
        The history.
    now : datetime
        The end, aware.
    cycle_s : float
        Time from cycle to cycle. [s]
    outputs : sequence of str
        Outputs of the model.
    channels : sequence of str
        Its channels.

    Returns
    -------
    dict
        ``first`` and ``last`` [ms since 1970], ``series`` as `line_of` says by name
        (``Z_um.correction``, ``T_spindle_C``), ``events`` as `event_json` says.
    """
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
    """Return the names of outputs or inputs: those of the loop, or of the file while it is silent.

    Parameters
    ----------
    status : mapping
        What the loop told; may be empty.
    table : str
        ``outputs`` or ``inputs``.
    configured : sequence of str
        Names in the configuration.

    Returns
    -------
    tuple of str
        The names.
    """
    told = status.get(table)
    if isinstance(told, Mapping) and told:
        return tuple(str(name) for name in cast("Mapping[object, object]", told))
    return tuple(configured)
