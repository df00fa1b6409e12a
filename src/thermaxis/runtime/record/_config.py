"""Configuration of a recording: ``record.toml`` to frozen values.

.. code-block:: toml

    [record]
    name = "lathe"
    every_s = 1.0

    [connection.control]
    url = "opc.tcp://192.168.214.241:4840"
    security = "none"

    [channel.T_spindle_C]
    node = "ns=2;s=/Plc/T_spindle"
    unit = "degC"
"""

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Annotated, Final, TypeAlias, final

from pydantic import Field

from thermaxis.codes import Message, Place
from thermaxis.errors import ConfigurationError
from thermaxis.files.logs import parse_log_heading
from thermaxis.files.settings import problem, read_tree, refuse
from thermaxis.runtime._connection import ConnectionSettings
from thermaxis.runtime._keys import Checked, Factor, Own
from thermaxis.runtime.config import open_connection
from thermaxis.runtime.opcua import parse_node
from thermaxis.thermal.log import unit_named, unit_of_name

MOST_CHANNELS: Final = 1000
"""Largest number of channels of one recording. [1]"""
SHORTEST_PERIOD_S: Final = 0.1
"""Shortest time between two readings of a channel. [s]"""
LONGEST_PERIOD_S: Final = 3600.0
"""Longest time between two readings of a channel. [s]"""
NO_UNIT: Final = frozenset({"1", "bool"})
"""Units of numbers that have none: a count, a share, a switch (recorded as 0 and 1)."""

_CHANNEL_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_.\-]{0,99}")
_FILE_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9_.\-]{0,59}")
_RESERVED = frozenset({"date", "datum", "day", "tag", "den"})
_Period: TypeAlias = Annotated[float, Field(ge=SHORTEST_PERIOD_S, le=LONGEST_PERIOD_S)]
_Repeat: TypeAlias = Annotated[float, Field(ge=0.0, le=1e7)]


@final
@dataclass(frozen=True, kw_only=True)
class ChannelSettings:
    """``[channel.NAME]``: a channel; its name is the column's, and must not state another unit."""

    name: Own[str] = ""
    """Name in the log."""
    heading: Own[str] = ""
    """Heading of its column, from which readers take name and unit."""
    period_ms: Own[int] = 0
    """Time between two readings. [ms]"""
    node: str
    """Node id, such as `ns=2;s=/Plc/T_spindle` or `nsu=urn:machine;s=T_spindle`."""
    counter_node: str | None = None
    """Of a touch: node that counts them. A value is recorded when it has moved, else none."""
    unit: str
    """Unit in the log: degC, K, um, mm, rpm, ..., 1 for a number without a unit, bool for a
    switch."""
    connection: str = ""
    """Name of the connection; may be left out where there is only one."""
    every_s: _Period | None = None
    """Time between two readings, 0.1 to 3600. Without it: that of the recording. [s]"""
    factor: Factor = 1.0
    """What a value of the node is multiplied by to get the unit, such as 0.1 for tenths."""
    offset: Annotated[float, Field(ge=-1e9, le=1e9)] = 0.0
    """What is added then. [unit]"""
    repeat_unchanged_s: _Repeat | None = None
    """As in the table `[record]`, for this channel. Without it: that of the recording. [s]"""


@final
@dataclass(frozen=True, kw_only=True)
class RecordSettings:
    """``[record]``: files, and what holds for all channels."""

    name: str = "log"
    """Begin of the file names: letters, digits, `_`, `-` and points."""
    every_s: _Period = 1.0
    """Time between two readings of a channel that states none, 0.1 to 3600. Default: the cycle of
    the compensation. [s]"""
    days_per_file: Annotated[int, Field(ge=1, le=366)] = 1
    """UTC days that one file covers. Default: a file a day. [d]"""
    largest_mb: Annotated[float, Field(ge=0.01, le=900.0)] = 200.0
    """Size at which a new file begins, of the log and of its sources, each. Default: what is
    read in seconds; the reader's limit is 1000. [MB]"""
    memory_mb: Annotated[float, Field(ge=0.01, le=10_000.0)] = 64.0
    """Rows that wait in memory while the disk is full. Default: 20 channels for 16 h at 1 s.
    [MB]"""
    keep_days: Annotated[int, Field(ge=2, le=36_600)] | None = None
    """Once a file is complete, the files before it are deleted but for the newest so many recorded
    days. Without it: nothing is deleted. [d]"""
    parquet: bool = False
    """Whether each file that is complete is written as Parquet as well."""
    repeat_unchanged_s: _Repeat = 0.0
    """For how long a value counts as measured again while its source time stamp does not move.
    Default: not at all, the cell stays empty. [s]"""
    channels: Own[tuple[ChannelSettings, ...]] = ()
    """Channels in the order of the file."""
    connections: Own[Mapping[str, ConnectionSettings]] = field(
        default_factory=dict[str, ConnectionSettings]
    )
    """Connections that channels use."""

    @property
    def fastest_ms(self) -> int:
        """Shortest time between two readings. [ms]"""
        return min(channel.period_ms for channel in self.channels)


@final
@dataclass(frozen=True, kw_only=True)
class RecordFile:
    """A whole file ``record.toml``."""

    record: RecordSettings = RecordSettings()
    """Files and what holds for all channels."""
    connections: Annotated[dict[str, Checked[ConnectionSettings]], Field(alias="connection")]
    """OPC UA connections by their name."""
    channels: Annotated[dict[str, ChannelSettings], Field(alias="channel")]
    """Channels by the name of their column."""


def read_record(path: Path | str) -> RecordSettings:
    """Read the configuration of a recording."""
    file = read_tree(RecordFile, Path(path))
    if isinstance(file, list):
        raise refuse(file, path)
    wrong = [next(_wrong(name, entry, file), None) for name, entry in file.channels.items()]
    problems = [*_wrong_file(file), *filter(None, wrong)]
    if problems:
        raise refuse(problems, path)
    channels = tuple(_complete(name, entry, file) for name, entry in file.channels.items())
    used = {channel.connection for channel in channels}
    try:
        connections = {
            name: open_connection(name, entry)
            for name, entry in file.connections.items()
            if name in used
        }
    except ConfigurationError as error:
        raise refuse([error.message], path) from None
    return replace(file.record, channels=channels, connections=connections)


def _complete(name: str, entry: ChannelSettings, file: RecordFile) -> ChannelSettings:
    """Return a channel with what it takes from elsewhere."""
    every_s, repeat_s = entry.every_s, entry.repeat_unchanged_s
    unit, heading = _unit_and_heading(name, entry.unit)
    return replace(
        entry,
        name=name,
        heading=heading,
        period_ms=round(1000.0 * (file.record.every_s if every_s is None else every_s)),
        unit=unit or "",
        connection=entry.connection or next(iter(file.connections)),
        repeat_unchanged_s=file.record.repeat_unchanged_s if repeat_s is None else repeat_s,
    )


def _unit_and_heading(name: str, word: str) -> tuple[str | None, str]:
    """Return the unit (None if it is not known) and a heading that states name and unit."""
    unit = "" if word in NO_UNIT else unit_named(word)
    return unit, name if unit == unit_of_name(name) else f"{name} [{unit or ''}]"


def _wrong_file(file: RecordFile) -> Iterator[Message]:
    """Yield what is wrong with the file as a whole."""
    if _FILE_NAME.fullmatch(file.record.name) is None:
        yield problem("no_file_name", "record.name")
    if not file.connections:
        yield problem("no_connection", "connection")
    if not 1 <= len(file.channels) <= MOST_CHANNELS:
        yield problem("channels", "channel", channels=len(file.channels), most=MOST_CHANNELS)
    seen: dict[str, str] = {}
    for name in file.channels:
        other = seen.setdefault(name.casefold(), name)
        if other != name:
            yield problem("same_but_case", f"channel.{name}", other=other)


def _wrong(name: str, entry: ChannelSettings, file: RecordFile) -> Iterator[Message]:
    """Yield what is wrong with a channel."""
    table, known = f"channel.{name}", tuple(file.connections)
    unit, heading = _unit_and_heading(name, entry.unit)
    in_name, read = unit_of_name(name), parse_log_heading(heading)
    if _CHANNEL_NAME.fullmatch(name) is None:
        yield problem("no_channel_name", table)
    if unit is None:
        yield problem("unknown_unit", f"{table}.unit", unit=entry.unit)
    if in_name and in_name != unit:
        yield problem("unit_differs", f"{table}.unit", in_name=in_name, unit=unit or entry.unit)
    if read.time_rank is not None or name.casefold() in _RESERVED:
        yield problem("name_of_times", table)
    if (read.name, read.unit) != (name, unit):
        yield problem("name_read_otherwise", table)
    if entry.connection and entry.connection not in known:
        yield problem("unknown_name", f"{table}.connection", name=entry.connection, known=known)
    if not entry.connection and len(known) > 1:
        yield problem("connection_unstated", f"{table}.connection", known=known)
    for key, node in (("node", entry.node), ("counter_node", entry.counter_node)):
        try:
            if node is not None:
                parse_node(node)
        except ConfigurationError as error:
            yield error.at(Place(key=f"{table}.{key}")).message
    every_ms = 1000.0 * (entry.every_s or file.record.every_s)
    if abs(round(every_ms) - every_ms) > 1e-6:
        yield problem("no_whole_milliseconds", f"{table}.every_s")
