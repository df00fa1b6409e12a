"""A frame of pandas or polars where a log is expected: by its names and columns, neither needed."""

from collections.abc import Iterable, Sequence
from contextlib import suppress
from datetime import datetime
from typing import Any, Protocol, TypeAlias

import numpy as np

from thermaxis.codes import Place
from thermaxis.errors import DataError
from thermaxis.thermal._arrays import FloatArray
from thermaxis.thermal.log._thermal_log import TIME_COLUMN, ThermalLog


class Frame(Protocol):
    """Columns by name, as frames of pandas and polars have them."""

    @property
    def columns(self) -> Iterable[str]:
        """Names of the columns."""
        ...

    def __getitem__(self, name: str, /) -> Any:
        """Return a column."""
        ...


LogLike: TypeAlias = ThermalLog | Frame
"""A log, or a frame that `as_thermal_log` makes one of."""


def as_thermal_log(data: LogLike, *, name: str = "frame") -> ThermalLog:
    """Return a log as it is, and a frame of pandas or polars as a log.

    Times are the column `time_s`, else the first column of dates with time, else an index of
    such, of time differences, or named `time_s`. The end of a column's name states its unit.
    A missing value is not measured.

    Parameters
    ----------
    name : str
        Name of a frame's log, for messages.

    Raises
    ------
    DataError
        If it is no frame, has no rows or no times, another column than that of the times does not
        hold numbers, or the log cannot be one.
    """
    if isinstance(data, ThermalLog):
        return data
    if hasattr(data, "collect") or not hasattr(data, "columns"):  # a lazy frame has no values
        raise DataError("no_frame", type=type(data).__name__, file=name)
    columns = {str(key): data[key] for key in data.columns}
    if any(len(column) == 0 for column in columns.values()):
        raise DataError("frame_without_rows", file=name)
    index: Any = getattr(data, "index", ())
    dated = next((key for key, column in columns.items() if _date(column)), None)
    times: Any = columns.pop(dated) if dated else index
    start = _date(times)
    if TIME_COLUMN in columns:
        time_s = _numbers(columns.pop(TIME_COLUMN), Place(name, column=TIME_COLUMN))
    elif start is not None:
        time_s = np.asarray(times - start) / np.timedelta64(1, "s")
    elif np.asarray(index).dtype.kind == "m":
        time_s = np.asarray(index) / np.timedelta64(1, "s")
    elif getattr(index, "name", None) == TIME_COLUMN:
        time_s = _numbers(index, Place(name, column=TIME_COLUMN))
    else:
        for key, column in columns.items():
            if isinstance(_first(column), str):
                raise DataError("frame_times_as_text", place=Place(name, column=key))
        raise DataError("frame_without_times", file=name)
    values = {key: _numbers(column, Place(name, column=key)) for key, column in columns.items()}
    return ThermalLog.from_columns(values, time_s=time_s, start=start, name=name)


def as_thermal_logs(data: LogLike | Sequence[LogLike]) -> list[ThermalLog]:
    """Return logs and frames as logs, and one alone as the only one."""
    return [as_thermal_log(one) for one in (data if isinstance(data, Sequence) else [data])]


def _first(column: Any) -> object:
    return getattr(column, "iloc", column)[0] if len(column) else None  # not by the index


def _date(column: Any) -> datetime | None:
    """Return the first value of a column of dates with time, and None of another one."""
    first = _first(column)
    plain = getattr(first, "to_pydatetime", None)
    return None if not isinstance(first, datetime) else first if plain is None else plain()


def _numbers(column: Any, place: Place) -> FloatArray:
    if np.asarray(column).dtype.kind not in "mM":  # moments are no numbers
        with suppress(TypeError, ValueError):
            if hasattr(column, "astype"):  # pandas has a missing value that is no float
                return np.asarray(column.to_numpy("float64", na_value=np.nan))
            return np.asarray(column, dtype=np.float64)
    raise DataError("not_numbers", place=place)
