"""Dates and times as people type them into a head."""

import datetime as dt


def moment_of(text: str) -> dt.datetime | None:
    """Return the date and time that a text states in ISO form; None if it is another text."""
    if ":" not in text:
        return None
    try:
        return dt.datetime.fromisoformat(text.strip())
    except ValueError:
        return None


def day_of(text: str) -> dt.date | None:
    """Return the day with which a text in ISO form begins; None if it is another text."""
    try:
        return dt.date.fromisoformat(text.strip()[:10])
    except ValueError:
        return None


def duration_of(start: dt.datetime | None, end: dt.datetime | None) -> float | None:
    """Return the time from start to end; None where one of them is unknown. [s]"""
    if start is None or end is None:
        return None
    if (start.tzinfo is None) != (end.tzinfo is None):
        start, end = start.replace(tzinfo=None), end.replace(tzinfo=None)
    return (end - start).total_seconds()
