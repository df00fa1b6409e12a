"""A history as one run of the program leaves it."""

from collections.abc import Sequence
from pathlib import Path

from tests.unit.runtime.history_records import CHANNELS, OUTPUTS, CountingClock, url_of
from thermaxis.runtime import CycleRecord, EventRecord
from thermaxis.runtime.historian import (
    Backlog,
    HistorianSettings,
    RowPacker,
    Writer,
    pack_event,
    parse_url,
)


def write_history(
    path: Path,
    records: Sequence[CycleRecord],
    events: Sequence[EventRecord] = (),
    *,
    outputs: Sequence[str] = OUTPUTS,
    channels: Sequence[str] = CHANNELS,
) -> None:
    """Write a history."""
    packer, backlog = RowPacker(), Backlog(10**9)
    packer.outputs, packer.channels = tuple(outputs), tuple(channels)
    for record in records:
        backlog.add_cycle(packer.pack(record))
    for event in events:
        backlog.add_event(pack_event(event))
    writer = Writer(parse_url(url_of(path)), HistorianSettings(), CountingClock(), backlog, packer)
    assert writer.attempt()
    writer.close()
