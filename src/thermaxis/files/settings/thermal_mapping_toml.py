"""Mapping file, TOML: what the columns of a log are called and what their numbers mean."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from types import MappingProxyType
from typing import Literal, final

from thermaxis.codes import Place, printable
from thermaxis.errors import ConfigurationError
from thermaxis.files.settings._reading import LARGEST_TOML_BYTES, as_table, parse_toml, settings_of
from thermaxis.files.table import read_text
from thermaxis.thermal.log import unit_named

TIME_UNITS_S = {"us": 1e-6, "ms": 1e-3, "s": 1.0, "min": 60.0, "h": 3600.0, "d": 86400.0}
"""Length of the units of a column of times. [s]"""


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
    date_order: Literal["day", "month", "year"] | None = None
    """What stands first in dates such as 03/04/2026; None: as they show it."""
    time_format: str | None = None
    """Form of times that are text, as strptime understands it; None: as they show it."""
    sample_time_s: float | None = None
    """Time between rows of a file without times. [s]"""


def read_thermal_mapping(path: Path | str) -> ThermalMapping:
    """Read a mapping file.

    Parameters
    ----------
    path : Path or str
        The file: a table `[columns]` with one entry per heading (name, unit, factor, offset,
        leave_out), and a table `[time]` (column, unit, date_order, format, sample_time_s).

    Raises
    ------
    MeasurementFileError
        If the file cannot be read or is no text.
    ConfigurationError
        If it is no TOML, a key is not known, or a value has the wrong type or makes no sense.
    """
    text = read_text(path)
    file = text.path
    if len(text.text) > LARGEST_TOML_BYTES:
        size_mb, most_mb = len(text.text) / 1e6, LARGEST_TOML_BYTES / 1e6
        raise ConfigurationError("file_too_large", size_mb=size_mb, most_mb=most_mb, file=file)
    tables = parse_toml(text.text, file=file)
    columns = {
        heading: {"name": entry} if isinstance(entry, str) else entry  # a text is the name
        for heading, entry in as_table(file, "columns", tables.get("columns", {})).items()
    }
    stated = settings_of(_Mapping, {**tables, "columns": columns}, file=file)
    _check_time(stated.time, file)
    read = {heading: _checked(one, heading, file) for heading, one in stated.columns.items()}
    names = [one.name for one in read.values() if one.name]
    for name in names:
        if names.count(name) > 1:
            raise ConfigurationError("stated_twice", name=printable(name), file=file, key="columns")
    return ThermalMapping(
        columns=MappingProxyType(read),
        time_column=None if stated.time.column is None else stated.time.column.strip(),
        time_unit=stated.time.unit,
        date_order=stated.time.date_order,
        time_format=stated.time.format,
        sample_time_s=stated.time.sample_time_s,
    )


@dataclass(frozen=True, slots=True)
class _Time:
    column: str | None = None
    unit: str | None = None
    date_order: Literal["day", "month", "year"] | None = None
    format: str | None = None
    sample_time_s: float | None = None


@dataclass(frozen=True, slots=True)
class _Mapping:
    columns: dict[str, ColumnMapping] = field(default_factory=dict[str, ColumnMapping])
    time: _Time = field(default_factory=_Time)


def _check_time(time: _Time, file: str) -> None:
    if time.unit is not None and time.unit not in TIME_UNITS_S:
        name, place = printable(time.unit, 60), Place(file, key="time.unit")
        raise ConfigurationError("unknown_choice", name=name, known=(*TIME_UNITS_S,), place=place)
    step = time.sample_time_s
    if step is not None and not 0.0 < step <= 1e9:
        raise ConfigurationError("not_positive", value=step, file=file, key="time.sample_time_s")
    if step is not None and time.column is not None:
        raise ConfigurationError("times_stated_twice", file=file, key="time.column")


def _checked(one: ColumnMapping, heading: str, file: str) -> ColumnMapping:
    """Return what is said of a column, with its unit as logs name it."""
    key = f"columns.{printable(heading)}"
    unit = unit_named(one.unit) if one.unit else one.unit
    if one.unit and unit is None:
        raise ConfigurationError(
            "unknown_unit", unit=printable(one.unit, 60), file=file, key=f"{key}.unit"
        )
    if one.factor == 0.0:
        raise ConfigurationError("factor_zero", file=file, key=f"{key}.factor")
    return replace(one, name=one.name.strip(), unit=unit)
