"""What the columns of a thermal log mean, and how a table of them becomes a log."""

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from typing import TypeAlias, final

import numpy as np
from numpy.typing import NDArray

from thermaxis.codes import Message, Place, remark
from thermaxis.errors import DataError, MeasurementFileError
from thermaxis.files.settings import TIME_UNITS_S, ColumnMapping, ThermalMapping
from thermaxis.files.table import (
    MISSING_WORDS,
    NUMBER_LIMIT,
    Role,
    RunMapping,
    clean_text,
    decoded,
    first_few,
    is_date_name,
    is_number,
    parse_heading,
    seconds_since,
    stamp_moments,
    unprotected,
)
from thermaxis.positioning import FloatArray
from thermaxis.thermal import ThermalLog
from thermaxis.thermal.log import (
    MOST_CELLS,
    StraightTimes,
    block_means,
    block_numbers,
    measured_values,
    straighten_times,
    unit_named,
    unit_of_name,
)

MOST_COLUMNS = 4096
"""Largest number of columns of a log. [1]"""
MOST_ROWS = 200_000_000
"""Largest number of rows of a file: six years at 1 Hz. [1]"""
LONGEST_HEADING = 200
"""Longest heading of a column. [character]"""
_EPOCH = datetime(1970, 1, 1, tzinfo=UTC)
_SINCE_1970_S = (9.4e8, 4.2e9)
"""Seconds of this size are counted from 1970: the years 1999 to 2103. [s]"""
_NO_YEAR = datetime.strptime("0", "%S").year  # noqa: DTZ007 - what a form without a date gives
_LENGTHS = (("d", 86400.0), ("h", 3600.0), ("min", 60.0), ("s", 1.0))
_MOST_TIME = 1e19
"""A time beyond this, in any unit, is no time. [1]"""
_IN_BRACKETS = re.compile(r"(.+?)\s*[\[(]\s*([^\[\]()]*?)\s*[\])]", re.DOTALL)
_BEHIND_SLASH = re.compile(r"(.+?)\s*/\s*([^/]+?)\s*", re.DOTALL)
_SHORT_TIME = re.compile(r"t(?=$|[\s_(\[])")
_LOOSE_TIME = re.compile(
    r"(?:(?:elapsed|run|up)?[\s_-]*(?:time|zeit|čas|cas)|elapsed|uptime)"
    r"(?:[\s_/,(\[]+(?:in\s+|v\s+)?(?P<unit>[^\W_]+)[)\]]?)?"
    r"|(?P<alone>seconds|minutes|hours|sekunden|minuten|stunden|sekundy|minuty|hodiny)",
    re.IGNORECASE,
)

Texts: TypeAlias = Sequence[str | None]


@final
@dataclass(frozen=True, slots=True, eq=False)
class Moments:
    """A column of dates with time."""

    time_us: NDArray[np.float64]
    """Microseconds since 1970, NaN where missing, (n,). [µs]"""
    aware: bool
    """Whether the zone is known; the times are then UTC."""


ColumnValues: TypeAlias = FloatArray | Moments | Texts
"""A column: numbers (NaN where missing), dates, or texts (None where empty)."""


@final
@dataclass(frozen=True, slots=True)
class LogHeading:
    """The heading of one column of a log."""

    name: str
    unit: str
    """Its unit; empty if none is stated."""
    time_rank: int | None
    """How surely the column holds times, from 0 (surest); None if it does not."""
    seconds: float | None
    """Length of the unit of the times; None if it is not stated. [s]"""


@final
@dataclass(frozen=True, slots=True)
class Channel:
    """A column that is kept."""

    column: int
    """Its index in the file, from 0. [1]"""
    name: str
    unit: str
    factor: float = 1.0
    """What a value of the file is multiplied by."""
    offset: float = 0.0
    """What is added then. [unit]"""


@final
@dataclass(frozen=True, slots=True)
class ColumnPlan:
    """Which columns of a file are times and which are channels."""

    time: int | None
    """Index of the column of times, None if the mapping gives the sample time."""
    seconds: float | None
    """Length of the unit of the times; None if it is not stated. [s]"""
    date: int | None
    """Index of a column of dates beside one of times of the day."""
    channels: tuple[Channel, ...]
    mapping: ThermalMapping
    """The mapping that was given, or an empty one."""
    remarks: tuple[Message, ...]
    """What was noticed, in words."""


@final
@dataclass(frozen=True, slots=True)
class LogTable:
    """Columns of a file, read when they are asked for."""

    place: Place
    """The file, with a sheet or group where it has several."""
    headings: tuple[str, ...]
    """Headings in the order of the columns."""
    rows: int
    """Number of rows. [1]"""
    read: Callable[[int], ColumnValues]
    """Gives the values of a column by its index."""
    place_of: Callable[[int], Place] | None = None
    """Says where a row stands in the file, by its index. Default: rows count from 1."""
    remarks: tuple[Message, ...] = ()
    start: datetime | None = None
    """Time of day of the first row, if the file states it beside the columns."""
    origin_s: float = 0.0
    """What the recorder's clock showed at the first row, if the file states it. [s]"""

    def at(self, row: int | None = None, column: int | None = None) -> Place:
        """Return the place of a cell, a row or a column."""
        place = self.place
        if row is not None:
            place = self.place_of(row) if self.place_of else place._replace(row=row + 1)
        if column is None:
            return place
        return place._replace(column=self.headings[column] or str(column + 1))


def parse_log_heading(text: str) -> LogHeading:
    """Find name, unit and role of a column of a log."""
    text = text.strip()
    rank, seconds = _time_role(text)
    for form in (_IN_BRACKETS, _BEHIND_SLASH):
        match = form.fullmatch(text)
        if match is None or len(text) > LONGEST_HEADING:
            continue
        unit = "" if not match[2] else unit_named(match[2])
        if unit is not None:
            return LogHeading(_plain(match[1].strip()), unit, rank, seconds)
    name = _plain(text)
    return LogHeading(name, unit_of_name(name), rank, seconds)


def _plain(text: str) -> str:
    return clean_text(decoded(unprotected(text)), limit=LONGEST_HEADING)


def are_headings(cells: Sequence[str], mapping: ThermalMapping | None) -> bool:
    """Say whether cells are the headings of a log: one of them names the times."""
    if sum(1 for cell in cells if cell) < 1 or any(len(c) > 10 * LONGEST_HEADING for c in cells):
        return False
    if mapping is not None and mapping.time_column is not None:
        return mapping.time_column in {*cells, *(parse_log_heading(cell).name for cell in cells)}
    if mapping is not None and mapping.sample_time_s is not None:
        return not any(is_number(cell) for cell in cells)
    return len(cells) > 1 and any(parse_log_heading(c).time_rank is not None for c in cells)


def _time_role(text: str) -> tuple[int | None, float | None]:
    if text == "time_s":
        return 0, 1.0
    short = _SHORT_TIME.match(text) is not None
    heading = parse_heading(_SHORT_TIME.sub("time", text, count=1) if short else text)
    if heading.role is not Role.TIME:
        loose = _LOOSE_TIME.fullmatch(text)
        if loose is None:
            return None, None
        unit = loose["unit"] or loose["alone"]
        heading = parse_heading(f"time [{unit}]" if unit else "time")
        return (None, None) if heading.role is not Role.TIME else (5, heading.seconds)
    rank = 1 if heading.seconds is not None else 2
    return rank + (2 if short else 0), heading.seconds


def plan_columns(
    place: Place, headings: Sequence[str], mapping: ThermalMapping | None = None
) -> ColumnPlan:
    """Decide which columns of a file are times and which are channels."""
    mapping = mapping or ThermalMapping()
    if len(headings) > MOST_COLUMNS:
        raise MeasurementFileError("too_many_columns", most=MOST_COLUMNS, place=place)
    parsed = [parse_log_heading(heading) for heading in headings]
    _check_mapping(place, headings, parsed, mapping)
    time, seconds = _time_column(place, headings, parsed, mapping)
    date = _date_column(headings, time)
    remarks: list[Message] = []
    channels: list[Channel] = []
    for index, heading in enumerate(parsed):
        if index in {time, date}:
            continue
        wanted = mapping.columns.get(headings[index].strip()) or mapping.columns.get(heading.name)
        if wanted is None:
            name = heading.name or f"column {index + 1}"
            if len(name) < len(headings[index].strip()) and len(name) >= LONGEST_HEADING:
                remarks.append(remark("heading_cut", column=index + 1))
            channels.append(Channel(index, name, heading.unit))
        elif not wanted.leave_out:
            channels.append(_mapped(index, heading, wanted))
    _check_names(place, channels)
    return ColumnPlan(time, seconds, date, tuple(channels), mapping, tuple(remarks))


def _mapped(index: int, heading: LogHeading, wanted: ColumnMapping) -> Channel:
    name = wanted.name or heading.name
    unit = wanted.unit
    if unit is None:
        unit = (unit_of_name(wanted.name) if wanted.name else "") or heading.unit
    return Channel(index, name, unit, wanted.factor, wanted.offset)


def _check_mapping(
    place: Place, headings: Sequence[str], parsed: Sequence[LogHeading], mapping: ThermalMapping
) -> None:
    known = {text.strip() for text in headings} | {heading.name for heading in parsed}
    wanted = [*mapping.columns, *([mapping.time_column] if mapping.time_column else [])]
    for name in wanted:
        if name not in known:
            raise MeasurementFileError(
                "no_such_column",
                name=name,
                known=tuple(text.strip() for text in headings[:8]),
                place=place,
            )


def _time_column(
    place: Place, headings: Sequence[str], parsed: Sequence[LogHeading], mapping: ThermalMapping
) -> tuple[int | None, float | None]:
    if mapping.sample_time_s is not None:
        return None, None
    if mapping.time_column is not None:
        index = next(
            k
            for k, text in enumerate(headings)
            if mapping.time_column in {text.strip(), parsed[k].name}
        )
        seconds = parsed[index].seconds
        return index, TIME_UNITS_S.get(mapping.time_unit or "", seconds)
    ranked = sorted(
        (heading.time_rank, k) for k, heading in enumerate(parsed) if heading.time_rank is not None
    )
    if not ranked:
        raise MeasurementFileError("no_time_column", place=place)
    index = ranked[0][1]
    return index, TIME_UNITS_S.get(mapping.time_unit or "", parsed[index].seconds)


def _date_column(headings: Sequence[str], time: int | None) -> int | None:
    for index, text in enumerate(headings):
        if index != time and is_date_name(text.strip()):
            return index
    return None


def _check_names(place: Place, channels: Sequence[Channel]) -> None:
    if not channels:
        raise MeasurementFileError("no_channel_in_log", place=place)
    seen: dict[str, int] = {}
    for channel in channels:
        if channel.name in seen:
            raise MeasurementFileError(
                "columns_of_same_name",
                name=channel.name,
                first=seen[channel.name] + 1,
                second=channel.column + 1,
                place=place,
            )
        seen[channel.name] = channel.column


def build_log(
    table: LogTable, plan: ColumnPlan, *, name: str, sample_time_s: float | None = None
) -> ThermalLog:
    """Make a log of a table, column by column."""
    if table.rows == 0:
        raise MeasurementFileError("no_rows", place=table.at())
    if table.rows > MOST_ROWS:
        raise MeasurementFileError("too_many_rows_to_read", most=MOST_ROWS, place=table.at())
    assumed: list[Message] = []
    raw, start, local = _times(table, plan, assumed)
    try:
        straight = straighten_times(
            raw, local=local, undated=start is not None and start.year == _NO_YEAR
        )
    except DataError as error:
        raise error.at(table.at(column=plan.time)) from None
    origin = float(straight.time_s[0])
    if start is not None:
        start += timedelta(seconds=origin - float(raw[np.isfinite(raw)][0]))
    time_s = straight.time_s - origin
    remarks = [*assumed, *table.remarks, *plan.remarks, *straight.remarks]
    if bool((np.diff(time_s) <= 0.0).any()):
        raise MeasurementFileError("times_not_apart", place=table.at(column=plan.time))
    if sample_time_s is None and time_s.size * len(plan.channels) > MOST_CELLS:
        raise MeasurementFileError("log_too_large", most=MOST_CELLS, place=table.at())
    columns, units = _channels(table, plan, straight, time_s, sample_time_s, remarks)
    if sample_time_s is not None:
        time_s = np.arange(next(iter(columns.values())).size, dtype=np.float64) * sample_time_s
    origin_s = 0.0 if start is not None else origin
    return ThermalLog(
        time_s=time_s,
        columns=columns,
        units=units,
        start=table.start if start is None else start,
        origin_s=origin_s + table.origin_s,
        name=name,
        remarks=tuple(remarks),
    )


def _channels(
    table: LogTable,
    plan: ColumnPlan,
    straight: StraightTimes,
    time_s: FloatArray,
    sample_time_s: float | None,
    remarks: list[Message],
) -> tuple[dict[str, FloatArray], dict[str, str]]:
    """Read, convert and reduce one column after the other: only one is whole in memory."""
    block = None if sample_time_s is None else block_numbers(time_s, sample_time_s)
    columns: dict[str, FloatArray] = {}
    units: dict[str, str] = {}
    words_left: list[str] = []
    for channel in plan.channels:
        values = table.read(channel.column)
        if not isinstance(values, np.ndarray):
            words_left.append(channel.name)
            continue
        if not table.headings[channel.column].strip() and not bool(np.isfinite(values).any()):
            continue  # every row ends in a separator
        numbers = _within_limits(values, channel, remarks)
        if (channel.factor, channel.offset) != (1.0, 0.0):
            numbers = numbers * channel.factor + channel.offset
        numbers = straight.take(numbers)
        if block is not None:
            numbers = measured_values(channel.name, numbers, channel.unit, remarks)
            numbers = block_means(numbers, block, int(block[-1]) + 1)
        columns[channel.name], units[channel.name] = numbers, channel.unit
    words_left = [name for name in words_left if not re.fullmatch(r"column [0-9]+", name)]
    if words_left:
        remarks.append(remark("columns_left_out", names=first_few(words_left)))
    if not columns:
        raise MeasurementFileError("no_channel_in_log", place=table.at())
    return columns, units


def _within_limits(values: FloatArray, channel: Channel, remarks: list[Message]) -> FloatArray:
    """Take what no sensor can measure as missing."""
    values = np.asarray(values, dtype=np.float64)
    with np.errstate(invalid="ignore"):
        beyond = np.abs(values) > NUMBER_LIMIT
    count = int(np.count_nonzero(beyond))
    if not count:
        return values
    remarks.append(remark("values_beyond", name=channel.name, count=count))
    return np.where(beyond, np.nan, values)


def _lasting(lasts_s: float) -> str:
    """Return a length of time as a person would check it."""
    unit, length = next((u, n) for u, n in _LENGTHS if lasts_s >= 2.0 * n or n == 1.0)
    return f"{lasts_s / length:.3g} {unit}"


def _times(
    table: LogTable, plan: ColumnPlan, remarks: list[Message]
) -> tuple[FloatArray, datetime | None, bool]:
    """Return the times of all rows [s], the time of day of the first one, and if it is local."""
    if plan.time is None:
        step = plan.mapping.sample_time_s or 1.0
        return np.arange(table.rows, dtype=np.float64) * step, None, False
    values = table.read(plan.time)
    if isinstance(values, Moments):
        return _of_moments(values)
    if isinstance(values, np.ndarray):
        seconds, start, local = _of_numbers(table, plan, np.asarray(values, dtype=np.float64))
        if plan.seconds is None and start is None and bool(np.isfinite(seconds).any()):
            lasts_s = float(np.nanmax(seconds) - np.nanmin(seconds))
            name = table.headings[plan.time].strip()
            remarks.append(remark("seconds_assumed", column=name, lasts=_lasting(lasts_s)))
        return seconds, start, local
    dates = None if plan.date is None else table.read(plan.date)
    return _of_texts(table, plan, values, dates)


def _of_moments(values: Moments) -> tuple[FloatArray, datetime | None, bool]:
    given = np.flatnonzero(np.isfinite(values.time_us))
    if given.size == 0:
        return values.time_us, None, False
    first_us = float(values.time_us[given[0]])
    try:
        start = _EPOCH + timedelta(microseconds=first_us)
    except OverflowError:
        return np.full(values.time_us.shape, np.nan), None, False
    start = start if values.aware else start.replace(tzinfo=None)
    return (values.time_us - first_us) / 1e6, start, not values.aware


def _of_numbers(
    table: LogTable, plan: ColumnPlan, values: FloatArray
) -> tuple[FloatArray, datetime | None, bool]:
    possible = np.isfinite(values) & (np.abs(values) < _MOST_TIME)
    seconds = np.where(possible, values, np.nan) * (plan.seconds or 1.0)
    given = seconds[np.isfinite(seconds)]
    if given.size == 0:
        return seconds, None, False
    first = float(given[0])
    if abs(first) > 1e11:
        raise MeasurementFileError("time_too_large", time_s=first, place=table.at(column=plan.time))
    if _SINCE_1970_S[0] < first < _SINCE_1970_S[1]:
        return seconds - first, _EPOCH + timedelta(seconds=first), False
    return seconds, None, False


def _of_texts(
    table: LogTable, plan: ColumnPlan, texts: Texts, dates: ColumnValues | None
) -> tuple[FloatArray, datetime | None, bool]:
    if dates is not None and not isinstance(dates, np.ndarray | Moments):
        pairs = zip(dates, texts, strict=True)
        texts = [None if day is None or text is None else f"{day} {text}" for day, text in pairs]
    given = [None if text and text.casefold() in MISSING_WORDS else text for text in texts]
    stated = plan.mapping
    moments = stamp_moments(
        given,
        lambda row: table.at(row, plan.time),
        RunMapping(date_order=stated.date_order, time_format=stated.time_format),
        "not_a_moment_of_log",
    )
    start = next((moment for moment in moments if moment is not None), None)
    if start is None:
        return np.full(len(texts), np.nan), None, False
    return seconds_since(start, moments), start, start.tzinfo is None
