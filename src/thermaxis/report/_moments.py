"""Start and end of a run: as typed into the head, and as the measured file has them."""

import datetime as dt
from collections.abc import Mapping
from typing import Protocol

from thermaxis.files.settings import duration_of, moment_of
from thermaxis.positioning import StartEnd

ZONE_NOT_STATED = "(zone not stated)"
"""Printed behind a time whose place on the globe nobody stated."""


class ReadHead(Protocol):
    """What a measured file states of the head of a certificate: texts, environment, times."""

    @property
    def header(self) -> Mapping[str, str]: ...

    @property
    def environment(self) -> Mapping[str, StartEnd]: ...

    @property
    def start(self) -> dt.datetime | None: ...

    @property
    def end(self) -> dt.datetime | None: ...


def moment_words(moment: dt.datetime) -> str:
    """Return date and time as a certificate prints them, and that a zone is missing."""
    whole = moment.microsecond == 0
    text = moment.isoformat(sep=" ", timespec="seconds" if whole else "auto")
    return text if moment.tzinfo is not None else f"{text} {ZONE_NOT_STATED}"


def same_moment(first: dt.datetime, second: dt.datetime) -> bool:
    """Return whether two statements agree; a missing zone contradicts nothing."""
    if first.tzinfo is not None and second.tzinfo is not None:
        return first == second
    return first.replace(tzinfo=None) == second.replace(tzinfo=None)


def in_file(test: ReadHead, which: str) -> dt.datetime | None:
    """Return start or end as the measured file has it."""
    known = test.start if which == "start" else test.end
    return known if known is not None else moment_of(test.header.get(which, ""))


def prevailing_moment(test: ReadHead, header: Mapping[str, str], which: str) -> dt.datetime | None:
    """Return start or end as the head states it, else as the measured file has it."""
    return moment_of(header.get(which, "")) or in_file(test, which)


def duration_words(start: dt.datetime | None, end: dt.datetime | None) -> str:
    """Return the time between start and end; empty where one of them is unknown."""
    duration_s = duration_of(start, end)
    if duration_s is None:
        return ""
    if duration_s < 0.0:
        return "none: the end lies before the start"
    hours, rest = divmod(round(duration_s), 3600)
    return f"{hours} h {rest // 60:02d} min {rest % 60:02d} s"
