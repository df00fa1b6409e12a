"""Mapping file, TOML: what the columns of a log are called and what their numbers mean."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from types import MappingProxyType
from typing import final

from thermaxis.errors import ConfigurationError
from thermaxis.files.settings._document import Form, SettingsTable, read_all
from thermaxis.files.settings._settings_file import parse_toml
from thermaxis.files.table import read_text
from thermaxis.thermal.log import unit_named

_FORM = Form("mapping")
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
    return read_all(SettingsTable(_FORM, text.path, "", tables), _mapping)


def _mapping(of: SettingsTable) -> ThermalMapping:
    columns = of.tables("columns", _column, short="name")
    names = [entry.name for entry in columns.values() if entry.name]
    for name in names:
        if names.count(name) > 1:
            raise of.wrong("columns", f"the name {name} for two of them", "Name each differently")
    return of.inner("time", partial(_with_times, columns=columns))


def _with_times(of: SettingsTable, *, columns: Mapping[str, ColumnMapping]) -> ThermalMapping:
    unit = of.word_or_none("unit")
    if unit is not None and unit not in _TIME_UNITS:
        raise of.wrong("unit", f"'{unit}'", f"Write one of {', '.join(_TIME_UNITS)}, or no unit")
    step = of.number_or_none("sample_time_s")
    if step is not None and not 0.0 < step <= 1e9:
        raise of.wrong("sample_time_s", f"{step:g}", "Write a positive time in seconds")
    column = of.word_or_none("column")
    if step is not None and column is not None:
        raise of.wrong("column", "stated beside sample_time_s", "Leave one of them out")
    return ThermalMapping(
        columns=MappingProxyType(dict(columns)),
        time_column=None if column is None else column.strip(),
        time_unit=unit,
        time_format=of.word_or_none("format"),
        sample_time_s=step,
    )


def _column(of: SettingsTable) -> ColumnMapping:
    stated = of.word_or_none("unit")
    unit = unit_named(stated) if stated else stated
    if stated and unit is None:
        raise of.wrong(
            "unit",
            f"'{stated}', which is not known",
            "Write one such as degC, K, um, mm or rpm, and convert with factor and offset",
        )
    factor = of.number("factor", 1.0)
    if factor == 0.0:
        raise of.wrong("factor", "zero", "Write leave_out = true to leave a column out")
    return ColumnMapping(
        name=of.word("name", "").strip(),
        unit=unit,
        factor=factor,
        offset=of.number("offset", 0.0),
        leave_out=of.flag("leave_out"),
    )
