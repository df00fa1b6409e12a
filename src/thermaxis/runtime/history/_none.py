"""A historian that keeps nothing, for rehearsals."""

from collections.abc import Sequence
from typing import final

from thermaxis.runtime._ports import CycleRecord, EventRecord, Historian, HistorianStatus


@final
class NoHistorian(Historian):
    """Takes everything and keeps nothing."""

    async def open(self, outputs: Sequence[str]) -> None:
        """Begin."""

    def record(self, record: CycleRecord) -> None:
        """Take a cycle."""

    def event(self, event: EventRecord) -> None:
        """Take an event."""

    @property
    def status(self) -> HistorianStatus:
        """It has no trouble."""
        return HistorianStatus()

    async def close(self, deadline_s: float) -> None:
        """End."""
