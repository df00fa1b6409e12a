"""What the columns of a thermal log mean, and how a table of them becomes a log."""

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from typing import TypeAlias, final

import numpy as np
from numpy.typing import NDArray

from thermaxis.errors import DataError, MeasurementFileError
from thermaxis.files.settings import ColumnMapping, ThermalMapping
from thermaxis.files.table import (
    MOMENT_REMEDY,
    NUMBER_LIMIT,
    Role,
    clean_text,
    decoded,
    first_few,
    is_number,
    parse_heading,
    parse_moment,
    unprotected,
)
from thermaxis.positioning import FloatArray
from thermaxis.thermal import ThermalLog
from thermaxis.thermal.log import (
    MOST_CELLS,
    StraightTimes,
    block_means,
    block_numbers,
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
_MISSING = """
    nan na n/a null none - -- --- #n/a #num! #value! #div/0! err error overflow overrange ol bad
    open fault inf +inf -inf infinity
"""
MISSING_WORDS = frozenset(_MISSING.split())
"""Words that stand for a value that was not measured, in lower case; so does an empty cell."""
TIME_UNITS_S = {"us": 1e-6, "ms": 1e-3, "s": 1.0, "min": 60.0, "h": 3600.0, "d": 86400.0}
"""Length of the units of a column of times. [s]"""

_EPOCH = datetime(1970, 1, 1, tzinfo=UTC)
_SINCE_1970_S = (9.4e8, 4.2e9)
"""Seconds of this size are counted from 1970: the years 1999 to 2103. [s]"""
_MOST_TIME = 1e19
"""A time beyond this, in any unit, is no time. [1]"""
_IN_BRACKETS = re.compile(r"(.+?)\s*[\[(]\s*([^\[\]()]*?)\s*[\])]", re.DOTALL)
_BEHIND_SLASH = re.compile(r"(.+?)\s*/\s*([^/]+?)\s*", re.DOTALL)
_SHORT_TIME = re.compile(r"t(?=$|[\s_(\[])")
_DATE_WORDS = frozenset({"date", "datum", "day", "tag", "den"})

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
    """Name of the channel."""
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
    """Name in the log."""
    unit: str
    """Unit in the log."""
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
    """The other columns."""
    mapping: ThermalMapping
    """The mapping that was given, or an empty one."""
    remarks: tuple[str, ...]
    """What was noticed, in words."""


@final
@dataclass(frozen=True, slots=True)
class LogTable:
    """Columns of a file, read when they are asked for."""

    path: str
    """The file, with a sheet or group where it has several, for errors."""
    headings: tuple[str, ...]
    """Headings in the order of the columns."""
    rows: int
    """Number of rows. [1]"""
    read: Callable[[int], ColumnValues]
    """Gives the values of a column by its index."""
    place: Callable[[int], str]
    """Says where a row stands in the file, by its index."""
    remarks: tuple[str, ...] = ()
    """What the reader noticed."""
    start: datetime | None = None
    """Time of day of the first row, if the file states it beside the columns."""
    origin_s: float = 0.0
    """What the recorder's clock showed at the first row, if the file states it. [s]"""

    def error(
        self, what: str, *, column: int | None = None, row: int | None = None, remedy: str
    ) -> MeasurementFileError:
        """Make the error that says what is wrong in this file."""
        place = self.path if row is None else f"{self.path}, {self.place(row)}"
        name = None if column is None else (self.headings[column] or str(column + 1))
        return MeasurementFileError(what, path=place, column=name, remedy=remedy)


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
        return None, None
    rank = 1 if heading.seconds is not None else 2
    return rank + (2 if short else 0), heading.seconds


def plan_columns(
    path: str, headings: Sequence[str], mapping: ThermalMapping | None = None
) -> ColumnPlan:
    """Decide which columns of a file are times and which are channels."""
    mapping = mapping or ThermalMapping()
    if len(headings) > MOST_COLUMNS:
        raise MeasurementFileError(
            f"the file has {len(headings)} columns, more than {MOST_COLUMNS}",
            path=path,
            remedy="Export one channel per column and one row per time",
        )
    parsed = [parse_log_heading(heading) for heading in headings]
    _check_mapping(path, headings, parsed, mapping)
    time, seconds = _time_column(path, headings, parsed, mapping)
    date = _date_column(headings, time)
    remarks: list[str] = []
    channels: list[Channel] = []
    for index, heading in enumerate(parsed):
        if index in {time, date}:
            continue
        wanted = mapping.columns.get(headings[index].strip()) or mapping.columns.get(heading.name)
        if wanted is None:
            name = heading.name or f"column {index + 1}"
            if len(name) < len(headings[index].strip()) and len(name) >= LONGEST_HEADING:
                remarks.append(f"the heading of column {index + 1} was cut to its first characters")
            channels.append(Channel(index, name, heading.unit))
        elif not wanted.leave_out:
            channels.append(_mapped(index, heading, wanted))
    _check_names(path, channels)
    return ColumnPlan(time, seconds, date, tuple(channels), mapping, tuple(remarks))


def _mapped(index: int, heading: LogHeading, wanted: ColumnMapping) -> Channel:
    name = wanted.name or heading.name
    unit = wanted.unit
    if unit is None:
        unit = (unit_of_name(wanted.name) if wanted.name else "") or heading.unit
    return Channel(index, name, unit, wanted.factor, wanted.offset)


def _check_mapping(
    path: str, headings: Sequence[str], parsed: Sequence[LogHeading], mapping: ThermalMapping
) -> None:
    known = {text.strip() for text in headings} | {heading.name for heading in parsed}
    wanted = [*mapping.columns, *([mapping.time_column] if mapping.time_column else [])]
    for name in wanted:
        if name not in known:
            raise MeasurementFileError(
                f"the mapping names a column '{name}' that is not there",
                path=path,
                remedy=f"The columns are {first_few([t.strip() for t in headings], shown=8)}",
            )


def _time_column(
    path: str, headings: Sequence[str], parsed: Sequence[LogHeading], mapping: ThermalMapping
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
        raise MeasurementFileError(
            "there is no column of times",
            path=path,
            remedy="Name it time_s (seconds) or time (ISO 8601), or name the column or the sample"
            " time in a mapping",
        )
    index = ranked[0][1]
    return index, TIME_UNITS_S.get(mapping.time_unit or "", parsed[index].seconds)


def _date_column(headings: Sequence[str], time: int | None) -> int | None:
    for index, text in enumerate(headings):
        if index != time and text.strip().casefold() in _DATE_WORDS:
            return index
    return None


def _check_names(path: str, channels: Sequence[Channel]) -> None:
    if not channels:
        raise MeasurementFileError(
            "there is no channel beside the times",
            path=path,
            remedy="Export at least one temperature or displacement",
        )
    seen: dict[str, int] = {}
    for channel in channels:
        if channel.name in seen:
            raise MeasurementFileError(
                f"columns {seen[channel.name] + 1} and {channel.column + 1} have the same name"
                f" {channel.name}",
                path=path,
                remedy="Rename one of them in the file",
            )
        seen[channel.name] = channel.column


def build_log(
    table: LogTable,
    plan: ColumnPlan,
    *,
    name: str,
    sample_time_s: float | None = None,
) -> ThermalLog:
    """Make a log of a table, column by column."""
    if table.rows == 0:
        raise table.error("there is no row below the headings", remedy="Export the log again")
    if table.rows > MOST_ROWS:
        raise table.error(
            f"the file has {table.rows} rows, more than {MOST_ROWS}",
            remedy="Split the log into several files",
        )
    raw, start, local = _times(table, plan)
    try:
        straight = straighten_times(raw, local=local)
    except DataError as error:
        raise table.error(error.what, column=plan.time, remedy=error.remedy) from None
    origin = float(straight.time_s[0])
    if start is not None:
        start += timedelta(seconds=origin - float(raw[np.isfinite(raw)][0]))
    time_s = straight.time_s - origin
    remarks = [*table.remarks, *plan.remarks, *straight.remarks]
    if bool((np.diff(time_s) <= 0.0).any()):
        raise table.error(
            "times are too large to be told apart",
            column=plan.time,
            remedy="Write times in seconds from the start of the log",
        )
    if sample_time_s is None and time_s.size * len(plan.channels) > MOST_CELLS:
        raise table.error(
            f"{time_s.size} rows of {len(plan.channels)} channels are more than"
            f" {MOST_CELLS // 1_000_000} million values",
            remedy="Reduce the log while reading it, with a sample time such as 60 s",
        )
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
    remarks: list[str],
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
            numbers = block_means(numbers, block, int(block[-1]) + 1)
        columns[channel.name], units[channel.name] = numbers, channel.unit
    words_left = [name for name in words_left if not re.fullmatch(r"column [0-9]+", name)]
    if words_left:
        remarks.append(f"columns without numbers were left out: {first_few(words_left)}")
    if not columns:
        raise table.error(
            "no channel holds numbers", remedy="Export temperatures and displacements as numbers"
        )
    return columns, units


def _within_limits(values: FloatArray, channel: Channel, remarks: list[str]) -> FloatArray:
    """Take what no sensor can measure as missing."""
    values = np.asarray(values, dtype=np.float64)
    with np.errstate(invalid="ignore"):
        beyond = np.abs(values) > NUMBER_LIMIT
    count = int(np.count_nonzero(beyond))
    if not count:
        return values
    remarks.append(
        f"column {channel.name}: {count} values beyond 1e9 in magnitude are no measured values and"
        " count as missing"
    )
    return np.where(beyond, np.nan, values)


def _times(table: LogTable, plan: ColumnPlan) -> tuple[FloatArray, datetime | None, bool]:
    """Return the times of all rows [s], the time of day of the first one, and if it is local."""
    if plan.time is None:
        step = plan.mapping.sample_time_s or 1.0
        return np.arange(table.rows, dtype=np.float64) * step, None, False
    values = table.read(plan.time)
    if isinstance(values, Moments):
        return _of_moments(values)
    if isinstance(values, np.ndarray):
        return _of_numbers(table, plan, np.asarray(values, dtype=np.float64))
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
        raise table.error(
            f"the first time, {first:g} s, is more than three thousand years",
            column=plan.time,
            remedy="State the unit of the times, such as time_ms or time_us",
        )
    if _SINCE_1970_S[0] < first < _SINCE_1970_S[1]:
        return seconds - first, _EPOCH + timedelta(seconds=first), False
    return seconds, None, False


def _of_texts(
    table: LogTable, plan: ColumnPlan, texts: Texts, dates: ColumnValues | None
) -> tuple[FloatArray, datetime | None, bool]:
    if dates is not None and not isinstance(dates, np.ndarray | Moments):
        pairs = zip(dates, texts, strict=True)
        texts = [None if day is None or text is None else f"{day} {text}" for day, text in pairs]
    result = np.full(len(texts), np.nan)
    start: datetime | None = None
    for row, text in enumerate(texts):
        if text is None or text.casefold() in MISSING_WORDS:
            continue
        moment = _moment(text, plan.mapping.time_format)
        if moment is None:
            raise table.error(
                f"'{text}' is not a date with time", column=plan.time, row=row, remedy=MOMENT_REMEDY
            )
        start = moment if start is None else start
        if (moment.tzinfo is None) != (start.tzinfo is None):
            raise table.error(
                "times with and without a zone are mixed",
                column=plan.time,
                row=row,
                remedy="Write all times with a zone, such as +01:00, or all without",
            )
        result[row] = (moment - start).total_seconds()
    return result, start, start is not None and start.tzinfo is None


def _moment(text: str, form: str | None) -> datetime | None:
    if form is None:
        return parse_moment(text)
    try:
        return datetime.strptime(text, form)  # noqa: DTZ007  the form may state a zone
    except ValueError:
        return None
