"""Mapping file, TOML: what the columns of a log are called and what their numbers mean."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType
from typing import final

from thermaxis.errors import ConfigurationError
from thermaxis.files.settings._settings_file import as_table, parse_toml, unknown_key
from thermaxis.files.table import read_text
from thermaxis.thermal.log import unit_named

_TABLES = ("time", "columns")
_TIME_KEYS = ("column", "unit", "format", "sample_time_s")
_COLUMN_KEYS = ("name", "unit", "factor", "offset", "leave_out")
_TIME_UNITS = ("us", "ms", "s", "min", "h", "d")
_LIMIT_BYTES = 1_000_000


@final
@dataclass(frozen=True, slots=True)
class ColumnMapping:
    """What a mapping says about one column."""

    name: str = ""
    """Name in the log; empty: as in the file."""
    unit: str | None = None
    """Unit in the log, after factor and offset; None: as the name states."""
    factor: float = 1.0
    """What a value of the file is multiplied by."""
    offset: float = 0.0
    """What is added then. [unit]"""
    leave_out: bool = False
    """Whether the column is not read."""


def _no_columns() -> Mapping[str, ColumnMapping]:
    return MappingProxyType({})


@final
@dataclass(frozen=True, slots=True)
class ThermalMapping:
    """What a user says about the columns of a log; it goes before the headings."""

    columns: Mapping[str, ColumnMapping] = field(default_factory=_no_columns)
    """By the heading in the file; columns that are not named stay as they are."""
    time_column: str | None = None
    """Heading of the column of times; None: as the headings say."""
    time_unit: str | None = None
    """Unit of times that are numbers: us, ms, s, min, h or d."""
    time_format: str | None = None
    """Form of times that are text, as strptime understands it; None: ISO 8601."""
    sample_time_s: float | None = None
    """Time between rows of a file without times. [s]"""


def read_thermal_mapping(path: Path | str) -> ThermalMapping:
    """Read a mapping file.

    Parameters
    ----------
    path : Path or str
        The file: a table `[columns]` with one entry per heading (name, unit, factor, offset,
        leave_out), and a table `[time]` (column, unit, format, sample_time_s).

    Returns
    -------
    ThermalMapping
        What it says.

    Raises
    ------
    MeasurementFileError
        If the file cannot be read or is no text.
    ConfigurationError
        If it is no TOML, a key is not known, or a value has the wrong type or makes no sense.
    """
    text = read_text(path)
    if len(text.text) > _LIMIT_BYTES:
        raise ConfigurationError(
            "the mapping is longer than a million characters",
            where=text.path,
            remedy="Name the mapping file itself",
        )
    remedy = 'Write entries such as [columns."Temp 1"] and name = "T_spindle_c"'
    tables = parse_toml(text.text, where=text.path, remedy=remedy)
    _check_keys(tables, _TABLES, text.path)
    time = as_table(text.path, "time", tables.get("time", {}))
    columns = as_table(text.path, "columns", tables.get("columns", {}))
    return _time_mapping(
        time,
        {name: _column(entry, text.path, f"columns.{name}") for name, entry in columns.items()},
        f"{text.path}, [time]",
    )


def _time_mapping(
    time: Mapping[str, object], columns: dict[str, ColumnMapping], where: str
) -> ThermalMapping:
    _check_keys(time, _TIME_KEYS, where)
    unit = _text(time, "unit", where)
    if unit is not None and unit not in _TIME_UNITS:
        raise ConfigurationError(
            f"the unit of the times is '{unit}'",
            where=where,
            remedy=f"Write one of {', '.join(_TIME_UNITS)}; leave it out for dates",
        )
    step = _number(time, "sample_time_s", where)
    if step is not None and not 0.0 < step <= 1e9:
        raise ConfigurationError(
            f"the sample time is {step:g} s", where=where, remedy="Write a positive time in seconds"
        )
    column = _text(time, "column", where)
    if step is not None and column is not None:
        raise ConfigurationError(
            "both a column of times and a sample time are given",
            where=where,
            remedy="Leave one of them out",
        )
    names: set[str] = set()
    for entry in columns.values():
        if entry.name and entry.name in names:
            raise ConfigurationError(
                f"two columns get the name {entry.name}",
                where=where.removesuffix(", [time]"),
                remedy="Give every column a name of its own",
            )
        names.add(entry.name)
    return ThermalMapping(
        columns=MappingProxyType(columns),
        time_column=column,
        time_unit=unit,
        time_format=_text(time, "format", where),
        sample_time_s=step,
    )


def _column(value: object, path: str, name: str) -> ColumnMapping:
    where = f"{path}, [{name}]"
    entry = {"name": value} if isinstance(value, str) else as_table(path, name, value)
    _check_keys(entry, _COLUMN_KEYS, where)
    stated = _text(entry, "unit", where)
    unit = None if stated is None else (unit_named(stated) if stated else "")
    if stated and unit is None:
        raise ConfigurationError(
            f"the unit '{stated}' is not known",
            where=where,
            remedy="Write one such as degC, K, um, mm or rpm, and convert with factor and offset",
        )
    leave_out = entry.get("leave_out", False)
    if not isinstance(leave_out, bool):
        raise ConfigurationError(
            "leave_out is neither true nor false", where=where, remedy="Write true or false"
        )
    factor = _number(entry, "factor", where)
    if factor == 0.0:
        raise ConfigurationError(
            "the factor is zero", where=where, remedy="Write leave_out = true to leave a column out"
        )
    return ColumnMapping(
        name=_text(entry, "name", where) or "",
        unit=unit,
        factor=1.0 if factor is None else factor,
        offset=_number(entry, "offset", where) or 0.0,
        leave_out=leave_out,
    )


def _check_keys(table: Mapping[str, object], known: tuple[str, ...], where: str) -> None:
    unknown = next((key for key in table if key not in known), None)
    if unknown is not None:
        raise unknown_key(where, unknown, known)


def _text(table: Mapping[str, object], key: str, where: str) -> str | None:
    value = table.get(key)
    if value is None:
        return None
    if not isinstance(value, str):
        raise ConfigurationError(
            f"{key} is not a text", where=where, remedy="Write it in quotation marks"
        )
    return value.strip()


def _number(table: Mapping[str, object], key: str, where: str) -> float | None:
    value = table.get(key)
    if value is None:
        return None
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise ConfigurationError(f"{key} is not a number", where=where, remedy="Write a number")
    number = float(value) if abs(value) < 1e300 else math.inf
    if not math.isfinite(number) or abs(number) > 1e12:
        raise ConfigurationError(
            f"{key} is too large or not finite", where=where, remedy="Check the digits"
        )
    return number
