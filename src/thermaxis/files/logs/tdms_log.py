"""Thermal logs in ``.tdms`` files of LabVIEW: groups of channels, each with its own rate."""

import logging
from collections.abc import Generator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, cast

import numpy as np

from thermaxis.codes import Place
from thermaxis.errors import DataError, MeasurementFileError
from thermaxis.files.logs._columns import (
    ColumnValues,
    LogTable,
    Moments,
    build_log,
    parse_log_heading,
    plan_columns,
)
from thermaxis.files.settings import ColumnMapping, ThermalMapping
from thermaxis.files.table import damage_named, read_start
from thermaxis.thermal import ThermalLog, join_rates
from thermaxis.thermal.log import unit_named

FILE_LIMIT_BYTES = 2_000_000_000
"""Largest file. [byte]"""
MOST_VALUES = 200_000_000
"""Largest number of values of all channels. [1]"""
_MOST_GROUPS = 200
_TIME = "time_s"


def read_thermal_tdms(
    path: Path | str, *, mapping: ThermalMapping | None = None, sample_time_s: float | None = None
) -> ThermalLog:
    """Read a thermal log from a file of LabVIEW.

    Each group has its own times: a channel of times, or the increment of its waveforms. The
    groups share the union of all times. A name that several groups use gets the group before it.
    """
    name = str(path)
    read_start(path, 0, limit_bytes=FILE_LIMIT_BYTES)
    try:
        import nptdms  # noqa: PLC0415 - an extra
    except ImportError:
        raise MeasurementFileError("package_missing", package="nptdms", file=name) from None
    with (
        damage_named(Place(name)),
        # The reader does not close what it opened where the file is damaged.
        Path(path).open("rb") as stream,
        _silent(),
        cast("Any", nptdms).TdmsFile.open(stream) as file,
    ):
        groups = _groups(name, file)
        logs = [_group_log(name, *entry, mapping) for entry in groups]
    if not logs:
        raise MeasurementFileError("no_channel_in_log", file=name)
    try:
        log = join_rates(logs)
    except DataError as error:
        raise error.at(Place(name)) from None
    return log if sample_time_s is None else log.resample(sample_time_s)


@contextmanager
def _silent() -> Generator[None]:
    """Keep the reader from writing about damage: what matters becomes an error."""
    loggers = [logging.getLogger(n) for n in logging.root.manager.loggerDict if "nptdms" in n]
    before = [logger.disabled for logger in loggers]
    for logger in loggers:
        logger.disabled = True
    try:
        yield
    finally:
        for logger, disabled in zip(loggers, before, strict=True):
            logger.disabled = disabled


def _groups(path: str, file: Any) -> list[tuple[str, dict[str, ColumnValues], dict[str, str]]]:
    """Return the columns of every part of the file that has one axis of time, and their units."""
    groups = [group for group in file.groups() if group.channels()]
    if len(groups) > _MOST_GROUPS:
        raise MeasurementFileError(
            "too_many_groups", groups=len(groups), most=_MOST_GROUPS, file=path
        )
    total = sum(len(channel) for group in groups for channel in group.channels())
    if total > MOST_VALUES:
        raise MeasurementFileError("log_too_large", most=MOST_VALUES, file=path)
    names = [str(channel.name) for group in groups for channel in group.channels()]
    result: list[tuple[str, dict[str, ColumnValues], dict[str, str]]] = []
    for group in groups:
        result += _axes(str(group.name), list(group.channels()), names)
    return result


def _axes(
    group: str, channels: Sequence[Any], names: Sequence[str]
) -> list[tuple[str, dict[str, ColumnValues], dict[str, str]]]:
    """Split a group into parts of equal times: by length, start and increment of the waveform."""
    columns = {str(c.name): _values_of(c) for c in channels if len(c)}
    times = [n for n in columns if parse_log_heading(n).time_rank is not None]
    parts: dict[tuple[int, object, object], dict[str, ColumnValues]] = {}
    units: dict[str, str] = {}
    for channel in channels:
        name = str(channel.name)
        if name not in columns or name in times:
            continue
        properties = cast("Mapping[str, object]", channel.properties)
        key = (
            (len(channel), None, None)
            if times
            else (
                len(channel),
                properties.get("wf_increment"),
                (str(properties.get("wf_start_time")), properties.get("wf_start_offset")),
            )
        )
        part = parts.get(key)
        if part is None:
            part = {n: columns[n] for n in times if len(_sized(columns[n])) == len(channel)}
            if not part:
                part = _waveform_times(properties, len(channel))
            parts[key] = part
        wanted = name if names.count(name) == 1 else f"{group}.{name}"
        part[wanted] = columns[name]
        stated = unit_named(str(properties.get("unit_string", "")))
        if stated is not None and stated:
            units[wanted] = stated
    return [(group, part, units) for part in parts.values()]


def _sized(values: ColumnValues) -> Sequence[object]:
    return cast("Sequence[object]", values.time_us if isinstance(values, Moments) else values)


def _waveform_times(properties: Mapping[str, object], rows: int) -> dict[str, ColumnValues]:
    step = properties.get("wf_increment")
    if isinstance(step, bool) or not isinstance(step, int | float) or not 0.0 < step < 1e9:
        return {}
    offset = properties.get("wf_start_offset", 0.0)
    begin = float(offset) if isinstance(offset, int | float) and abs(offset) < 1e12 else 0.0
    seconds = np.arange(rows, dtype=np.float64) * float(step) + begin
    start = properties.get("wf_start_time")
    if isinstance(start, np.datetime64):
        start_us = float(start.astype("datetime64[us]").astype(np.int64))
    elif isinstance(start, datetime):
        start = start.replace(tzinfo=UTC) if start.tzinfo is None else start
        start_us = start.timestamp() * 1e6
    else:
        return {_TIME: seconds}
    if start_us < 0.0:  # an empty time stamp is the year 1904
        return {_TIME: seconds}
    return {_TIME: Moments(start_us + seconds * 1e6, aware=True)}


def _values_of(channel: Any) -> ColumnValues:
    values = channel[:]
    if not isinstance(values, np.ndarray):
        return [str(value) for value in cast("Sequence[object]", values)]
    array = cast("np.ndarray[Any, np.dtype[Any]]", values)
    if array.dtype.kind == "M":
        micros = array.astype("datetime64[us]").astype(np.int64).astype(np.float64)
        micros[np.isnat(array)] = np.nan
        return Moments(micros, aware=True)
    if array.dtype.kind in "bifu":
        return array.astype(np.float64)
    return [str(value) for value in array]


def _group_log(
    path: str,
    group: str,
    columns: dict[str, ColumnValues],
    units: dict[str, str],
    mapping: ThermalMapping | None,
) -> ThermalLog:
    headings = tuple(columns)
    rows = max(len(_sized(values)) for values in columns.values())
    here = _mapping_of_group(headings, units, mapping)
    place = Place(path, channel=group)
    plan = plan_columns(place, headings, here)
    table = LogTable(
        place=place, headings=headings, rows=rows, read=lambda index: columns[headings[index]]
    )
    return build_log(table, plan, name=Path(path).stem)


def _mapping_of_group(
    headings: Sequence[str], units: Mapping[str, str], mapping: ThermalMapping | None
) -> ThermalMapping:
    """Return what the mapping says of this group, and the units that the file states."""
    given = mapping or ThermalMapping()
    columns: dict[str, ColumnMapping] = {}
    for heading in headings:
        if heading in given.columns:
            columns[heading] = given.columns[heading]
        elif heading in units and not parse_log_heading(heading).unit:
            columns[heading] = ColumnMapping(unit=units[heading])
    time_column = given.time_column if given.time_column in headings else None
    return replace(given, columns=columns, time_column=time_column)
