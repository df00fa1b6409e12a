"""What was recorded is in the database exactly, whatever happens to the database meanwhile."""

import asyncio
from collections.abc import Callable, Coroutine
from datetime import timedelta
from pathlib import Path

from tests.unit.runtime.history_records import (
    BEGIN,
    CHANNELS,
    OUTPUTS,
    CountingClock,
    cycle_record,
    event_record,
    url_of,
)
from thermaxis.runtime.historian import HistorianSettings, HistoryReader, SqlHistorian

QUICK = HistorianSettings(batch_s=0.005, retry_s=0.02)


def historian(path: Path, settings: HistorianSettings = QUICK) -> SqlHistorian:
    return SqlHistorian(url_of(path), settings, CountingClock())


def run(scene: Callable[[], Coroutine[object, object, None]]) -> None:
    asyncio.run(scene())


async def opened(path: Path, settings: HistorianSettings = QUICK) -> SqlHistorian:
    made = historian(path, settings)
    await made.open(OUTPUTS, CHANNELS)
    return made


def test_cycles_and_events_come_back_exactly(tmp_path: Path) -> None:
    path = tmp_path / "a.db"
    records = [cycle_record(k) for k in range(700)]  # two full blocks and a rest
    events = [event_record("started", kind="start"), event_record("Warming -> Active")]

    async def scene() -> None:
        one = await opened(path)
        one.event(events[0])
        for record in records:
            one.record(record)
        one.event(events[1])
        assert await one.drain(20.0)
        with HistoryReader(url_of(path)) as reader:  # beside the writer
            assert list(reader.cycles()) == records
            assert reader.events() == events
        assert one.status == (True, 0, 0, None)
        await one.close(5.0)
        assert one.status == (True, 0, 0, None)

    run(scene)
    with HistoryReader(url_of(path)) as reader:
        assert list(reader.cycles()) == records
        assert reader.events(kinds=["start"]) == events[:1]
        assert reader.events(newest=1) == events[1:]
        assert reader.span() == (records[0].utc, records[-1].utc)
        first, last = BEGIN + timedelta(seconds=200.5), BEGIN + timedelta(seconds=300)
        assert list(reader.cycles(first, last)) == records[201:300]
