"""The start-up self-test, beside the cycles: what it finds forbids a correction."""

import asyncio
from collections.abc import Awaitable, Callable, Sequence
from dataclasses import replace
from typing import final

from thermaxis.codes import Message, Place, printable
from thermaxis.compensation import Compensation
from thermaxis.errors import ConfigurationError
from thermaxis.runtime.loop._journal import Journal

SELF_TEST = "self-test passed"
"""Interlock that the loop adds: the start-up self-test found nothing that forbids a correction, and
no offset mismatch is latched."""
TESTED_EVERY_S = 5.0
"""A self-test that failed is tried again so often. [s]"""


@final
class SelfTest:
    """Tests the machine once it is there, and again as long as something forbids."""

    def __init__(
        self, test: Callable[[], Awaitable[Sequence[Message]]] | None, journal: Journal
    ) -> None:
        self.forbidden: tuple[Message, ...] | None = None if test else ()
        """What forbids a correction; None before the first test."""
        self._test, self._journal = test, journal
        self._task: asyncio.Future[Sequence[Message]] | None = None
        self._tested_s = float("-inf")

    @property
    def passed(self) -> bool:
        """Whether nothing forbids a correction."""
        return self.forbidden == ()

    def watch(self, now_s: float, *, there: bool) -> None:
        """Start the test, or take its findings."""
        if self._test is None:
            return
        if self._task is not None:
            if self._task.done():
                error, done = self._task.exception(), self._task
                self._task, self._tested_s = None, now_s
                self._take((_failed(error),) if error else tuple(done.result()))
            return
        again = bool(self.forbidden) and now_s - self._tested_s >= TESTED_EVERY_S
        if there and (self.forbidden is None or again):
            self._task = asyncio.ensure_future(self._test())

    def _take(self, findings: tuple[Message, ...]) -> None:
        # their numbers change with every look
        if self.forbidden is None or _kinds(findings) != _kinds(self.forbidden):
            for finding in findings:
                self._journal.event("alarm", "event-self_test", {"finding": finding})
            if not findings:
                self._journal.event("start", "event-self_test_passed")
        self.forbidden = findings

    def cancel(self) -> None:
        """End a test that still runs."""
        if self._task is not None:
            self._task.cancel()


def with_self_test(compensation: Compensation) -> Compensation:
    """Return the compensation with the self-test as its first interlock."""
    if len(compensation.interlocks) and compensation.interlocks[0] == SELF_TEST:
        return compensation
    if SELF_TEST in compensation.interlocks:
        raise ConfigurationError("reserved_name", name=SELF_TEST, key="interlock")
    return replace(compensation, interlocks=(SELF_TEST, *compensation.interlocks))


def _kinds(findings: Sequence[Message]) -> list[tuple[str, Place]]:
    return [(finding.code, finding.place) for finding in findings]


def _failed(error: BaseException) -> Message:
    """Return the finding of a test that found nothing because it failed itself."""
    cause = printable(f"{type(error).__name__}: {error}", 200)
    return Message("self_test-failed", {"cause": cause})
