"""What the web server says in the terminal: one line in words, and the same line rarely."""

import asyncio
import logging
import time
from collections.abc import Callable
from typing import Final, final

from thermaxis.codes import printable
from thermaxis.web._plain_page import mistake_of

SAME_LINE_S: Final = 60.0
"""The same line is not told again for so long. [s]"""
LOGGERS: Final = ("uvicorn.error", "asyncio")
"""Whose lines are put into words."""
_MOST_LINES: Final = 256


@final
class PlainLines(logging.Filter):
    """Makes one line of a mistake with its trace, and drops a line that was told a moment ago.

    What others send in halves or in no HTTP at all would fill the terminal otherwise, and hide what
    somebody should read.
    """

    def __init__(self, now: Callable[[], float] = time.monotonic) -> None:
        super().__init__()
        self._now = now
        self._told: dict[str, float] = {}

    def filter(self, record: logging.LogRecord) -> bool:
        """Put a record into words; return whether it is told."""
        error = record.exc_info[1] if record.exc_info else None
        if isinstance(error, asyncio.CancelledError):
            return False  # work that the end of the program gave up
        text = record.getMessage() if error is None else words_of_mistake(error)
        record.msg, record.args = printable(text, 400), ()
        record.exc_info = record.exc_text = record.stack_info = None
        now_s = self._now()
        if now_s - self._told.get(record.msg, now_s - SAME_LINE_S) < SAME_LINE_S:
            return False
        self._told.pop(record.msg, None)
        self._told[record.msg] = now_s
        if len(self._told) > _MOST_LINES:
            del self._told[next(iter(self._told))]
        return True


def words_of_mistake(error: BaseException) -> str:
    """Return one line about a mistake in the program, with the reference that its page shows."""
    reference, kind, place = mistake_of(error)
    return (
        f"screen: a mistake in the program, reference {reference}: {kind} in {place}"
        f" ({printable(str(error), 160)}); the pages go on"
    )


def speak_plainly() -> None:
    """Put the web server's lines into words from now on."""
    for name in LOGGERS:
        logger = logging.getLogger(name)
        if not any(isinstance(one, PlainLines) for one in logger.filters):
            logger.addFilter(PlainLines())
