"""One record of temperatures, speeds and displacements, whatever file it came from."""

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from datetime import datetime, timedelta
from difflib import get_close_matches
from types import MappingProxyType
from typing import TYPE_CHECKING, Final, final

import numpy as np
from numpy.typing import ArrayLike

from thermaxis.codes import Message, Place
from thermaxis.errors import DataError
from thermaxis.thermal._arrays import FloatArray, require_sample_time
from thermaxis.thermal.log._experiment import REFERENCE_S
from thermaxis.thermal.log._resample import block_means, block_numbers, usual_step_s

if TYPE_CHECKING:
    import polars as pl

TIME_COLUMN: Final = "time_s"
"""Name of the column of times in mappings and in files that are written here."""
MOST_CELLS = 400_000_000
"""Largest number of rows times columns of a log: 3.2 GB. [1]"""

FEWEST_OF_LINE, PLAIN = 5, 0.05
"""Rows that show a line, and share of still channels, of any number of rows, that seem to move.
Default: a line too many adds a noise of no weight, one too few half a minute's rise. [1]"""

_UNIT_WORDS = {
    "degC": "c degc celsius °c ℃ gradc",
    "degF": "f degf fahrenheit °f",
    "K": "k kelvin",
    "mK": "mk",
    "um": "um µm μm micron microns micrometer",
    "mm": "mm",
    "nm": "nm",
    "m": "m",
    "rpm": "rpm 1/min min-1 u/min ot/min",
    "s": "s sec",
    "ms": "ms",
    "min": "min",
    "h": "h",
    "arcsec": "arcsec",
    "deg": "deg °",
    "A": "a",
    "V": "v",
    "W": "w",
    "kW": "kw",
    "bar": "bar",
    "%": "% pct percent",
    "l/min": "l/min lpm",
    "Hz": "hz",
}
UNITS: Final[Mapping[str, str]] = MappingProxyType(
    {word: unit for unit, words in _UNIT_WORDS.items() for word in words.split()}
)
"""Unit by the word that names it, in lower case."""

# What a value is multiplied by to get the second unit; temperatures have an offset beside it.
_FACTORS = {
    ("mm", "um"): 1e3,
    ("m", "um"): 1e6,
    ("nm", "um"): 1e-3,
    ("um", "mm"): 1e-3,
    ("m", "mm"): 1e3,
    ("nm", "mm"): 1e-6,
}
_TO_CELSIUS = {"degC": (1.0, 0.0), "K": (1.0, -273.15), "degF": (5.0 / 9.0, -160.0 / 9.0)}


def unit_of_name(name: str) -> str:
    """Return the unit that the end of a column's name states."""
    if name.casefold() == "rpm":
        return "rpm"
    stem, underscore, word = name.rpartition("_")
    return UNITS.get(word.casefold(), "") if underscore and stem else ""


def unit_named(word: str) -> str | None:
    """Return a unit by one of its names."""
    return UNITS.get(word.strip().casefold())


def _no_units() -> Mapping[str, str]:
    return MappingProxyType({})


def _frozen(values: ArrayLike) -> FloatArray:
    array = np.asarray(values, dtype=np.float64)
    if array.flags.writeable or not array.flags.c_contiguous:
        array = np.array(array, dtype=np.float64, order="C")
        array.setflags(write=False)
    return array


@final
@dataclass(frozen=True, slots=True, eq=False)
class ThermalLog:
    """A record of channels over time; channels of different rates share the union of times.

    Raises
    ------
    DataError
        If there is no row or no column, times do not rise strictly from zero, a column has
        another length than the times, a value is infinite, or rows times columns pass 400
        million.
    """

    time_s: FloatArray
    """Time of each row since the first one, (n,), strictly increasing from zero. [s]"""
    columns: Mapping[str, FloatArray]
    """Values by the name of the column, each (n,); NaN where not measured. [unit in `units`]"""
    units: Mapping[str, str] = field(default_factory=_no_units)
    """Unit of each column (`degC`, `K`, `um`, `rpm`, ...); empty where it is not stated."""
    start: datetime | None = None
    """Time of day of the first row; aware if the file states a zone."""
    origin_s: float = 0.0
    """What the recorder's own clock showed at the first row; 0 if times are dates. [s]"""
    name: str = ""
    """Name of the file, or one that was given: for messages."""
    remarks: tuple[Message, ...] = ()

    def __post_init__(self) -> None:
        """Check lengths and times, and freeze every array."""
        set_field = object.__setattr__
        set_field(self, "time_s", _frozen(self.time_s))
        set_field(
            self, "columns", MappingProxyType({k: _frozen(v) for k, v in self.columns.items()})
        )
        units = {name: self.units.get(name, unit_of_name(name)) for name in self.columns}
        set_field(self, "units", MappingProxyType(units))
        set_field(self, "remarks", tuple(self.remarks))
        self._check_times()
        self._check_columns()

    def _check_times(self) -> None:
        time_s = self.time_s
        if time_s.ndim != 1 or time_s.size == 0:
            raise DataError(
                "wrong_shape", shape=str(time_s.shape), expected="(n,)", place=self.place("time_s")
            )
        if not bool(np.isfinite(time_s).all()) or bool((np.diff(time_s) <= 0.0).any()):
            raise DataError("times_not_rising", place=self.place("time_s"))
        if float(time_s[0]) != 0.0:
            raise DataError(
                "first_time_not_zero", first_s=float(time_s[0]), place=self.place("time_s")
            )
        if not np.isfinite(self.origin_s):
            raise DataError("not_finite", place=self.place("origin_s"))

    def _check_columns(self) -> None:
        if not self.columns:
            raise DataError("no_columns", place=self.place())
        if self.time_s.size * len(self.columns) > MOST_CELLS:
            raise DataError(
                "too_many_values",
                rows=self.time_s.size,
                columns=len(self.columns),
                most_million=MOST_CELLS // 1_000_000,
                place=self.place(),
            )
        for name, values in self.columns.items():
            if values.shape != self.time_s.shape:
                raise DataError(
                    "wrong_shape",
                    shape=str(values.shape),
                    expected=str(self.time_s.shape),
                    place=self.place(name),
                )
            if bool(np.isinf(values).any()):
                raise DataError("infinite_value", place=self.place(name))

    @classmethod
    def from_columns(
        cls,
        columns: Mapping[str, ArrayLike],
        *,
        time_s: ArrayLike | None = None,
        sample_time_s: float | None = None,
        units: Mapping[str, str] | None = None,
        start: datetime | None = None,
        name: str = "",
    ) -> "ThermalLog":
        """Make a log of arrays.

        Parameters
        ----------
        columns : mapping of str to array
            Values by name, each (n,); NaN where not measured. The end of a name states its unit.
        time_s : array, optional
            Times from any origin, (n,), strictly increasing. Default: the column `time_s`. [s]
        sample_time_s : float, optional
            Time between rows, instead of times. [s]
        units : mapping of str to str, optional
            Units of columns whose name does not state them.
        start : datetime, optional
            Time of day of the first row.
        name : str
            Name of the log, for messages.

        Returns
        -------
        ThermalLog
            With times from the first row on.

        Raises
        ------
        DataError
            If times are given twice or not at all, a value is no number, or the log cannot be
            one; the error says why.
        """
        values = {key: _numbers(key, column) for key, column in columns.items()}
        if time_s is None and sample_time_s is None:
            given = values.pop(TIME_COLUMN, None)
        else:
            given = None if time_s is None else _numbers("time_s", time_s)
        if (given is None) == (sample_time_s is None):
            raise DataError("times_twice" if given is not None else "times_missing", file=name)
        if given is None:
            given = _even_times(values, sample_time_s or 0.0, name)
        origin = float(given[0]) if given.ndim == 1 and given.size else 0.0
        return cls(
            time_s=given - origin,
            columns=values,
            units=units or {},
            start=start,
            origin_s=0.0 if start is not None else origin,
            name=name,
        )

    @property
    def where(self) -> str:
        """Name of the log for an error. [text]"""
        return self.name or "log"

    def place(self, column: str = "") -> Place:
        """Return the place of an error in this log, or in one of its columns."""
        return Place(self.where, column=column)

    @property
    def rows(self) -> int:
        """Number of rows n. [1]"""
        return int(self.time_s.size)

    @property
    def duration_s(self) -> float:
        """Time from the first to the last row. [s]"""
        return float(self.time_s[-1])

    @property
    def usual_step_s(self) -> float:
        """Median time from one row to the next; NaN with one row. [s]"""
        return usual_step_s(self.time_s)

    def name_of(self, name: str) -> str:
        """Return the name of a column as the log writes it.

        Parameters
        ----------
        name : str
            Name, in upper or lower case; the exact one goes first.

        Returns
        -------
        str
            A key of `columns`.

        Raises
        ------
        DataError
            If there is no such column, or several that differ only in case.
        """
        if name in self.columns:
            return name
        found = [known for known in self.columns if known.casefold() == name.casefold()]
        if len(found) == 1:
            return found[0]
        if found:
            raise DataError("column_ambiguous", name=name, known=tuple(found), place=self.place())
        near = get_close_matches(name, list(self.columns), n=3, cutoff=0.5)
        known = tuple(near or list(self.columns)[:8])
        raise DataError("unknown_column", name=name, known=known, place=self.place())

    def column(self, name: str, *, unit: str = "") -> FloatArray:
        """Return the values of a column, in a wanted unit.

        Parameters
        ----------
        name : str
            Name of the column, in upper or lower case.
        unit : str
            `degC`, `um` or `mm`; the values are converted from the column's unit. Default: the
            column's own unit.

        Returns
        -------
        FloatArray
            Values, (n,); NaN where not measured. [unit]

        Raises
        ------
        DataError
            If there is no such column, or its unit cannot be converted. A column without a
            stated unit is taken to have the wanted one.
        """
        known = self.name_of(name)
        values, own = self.columns[known], self.units[known]
        if own in {"", unit} or not unit:
            return values
        if unit == "degC" and own in _TO_CELSIUS:
            factor, offset = _TO_CELSIUS[own]
            return values * factor + offset
        if (own, unit) in _FACTORS:
            return values * _FACTORS[own, unit]
        raise DataError("wrong_unit", unit=own, needed=unit, place=self.place(known))

    def plain_column(self, name: str) -> FloatArray:
        """Return the values of a column, temperatures in degC, others in their own unit, (n,)."""
        known = self.name_of(name)
        return self.column(known, unit="degC" if self.units[known] in _TO_CELSIUS else "")

    def start_of(self, values: FloatArray, reference_s: float | None = None) -> float:
        """Return the level of a series at the begin of the log, by its rows over the first time.

        Relative coordinates refer to it. It is the mean over a first time that is given. Without
        one it is the mean over a minute, or where the rows plainly move, as a spindle
        that heats from the first row on, what their line has at the first row: a mean would lie
        above a machine that began at rest. Plain is a slope that a still channel has once in 20
        logs, by Student's t. Where nothing was measured then it is the first value; NaN where there
        is none.
        """
        present = ~np.isnan(values)
        early = present & (self.time_s <= (reference_s or REFERENCE_S))
        since_s: FloatArray = self.time_s[early] - self.time_s[0]
        own = values[early]
        if not own.size:
            return float(values[present][0]) if bool(np.any(present)) else float("nan")
        mean_s, mean = float(np.mean(since_s)), float(np.mean(own))
        if reference_s is not None or own.size < FEWEST_OF_LINE:
            return mean
        about_s = since_s - mean_s
        slope = float(about_s @ own / (about_s @ about_s))
        left = own - mean - slope * about_s
        std = float(np.sqrt(left @ left / (own.size - 2) / (about_s @ about_s)))
        from scipy.special import stdtrit  # noqa: PLC0415  scipy is slow to import

        plain = float(stdtrit(own.size - 2, 1.0 - 0.5 * PLAIN))
        return mean - slope * mean_s if abs(slope) > plain * std else mean

    def names_matching(self, pattern: str) -> tuple[str, ...]:
        """Return the columns whose name fits a pattern, in their order.

        Parameters
        ----------
        pattern : str
            A name in which `*` stands for any characters and `?` for one; upper and lower case
            make no difference.

        Returns
        -------
        tuple of str
            Names; empty if none fits.
        """
        parts = ({"*": ".*", "?": "."}.get(c, re.escape(c)) for c in re.sub(r"\*+", "*", pattern))
        form = re.compile("".join(parts), re.IGNORECASE | re.DOTALL)
        return tuple(name for name in self.columns if form.fullmatch(name) is not None)

    def select(self, names: Sequence[str]) -> "ThermalLog":
        """Return the log with some of its columns.

        Parameters
        ----------
        names : sequence of str
            Their names, in the wanted order.

        Raises
        ------
        DataError
            If there is no such column.
        """
        known = [self.name_of(name) for name in names]
        return replace(self, columns={name: self.columns[name] for name in known})

    def span(self, first: int, last: int) -> "ThermalLog":
        """Return some rows, with times from the first of them on.

        Parameters
        ----------
        first, last : int
            First row and the one behind the last, counted from zero; negative numbers count
            from the end, as in slices. [1]

        Returns
        -------
        ThermalLog
            A log of its own, whose start is that of its first row.

        Raises
        ------
        DataError
            If no row lies in the span.
        """
        begin, end, _ = slice(first, last).indices(self.rows)
        if begin >= end:
            raise DataError(
                "no_row_in_span", first=first, last=last, rows=self.rows, place=self.place()
            )
        return self._rows(slice(begin, end))

    def between(self, first_s: float, last_s: float) -> "ThermalLog":
        """Return the rows from one time up to, but without, another.

        Parameters
        ----------
        first_s, last_s : float
            Times since the first row. [s]

        Returns
        -------
        ThermalLog
            A log of its own, whose start is that of its first row.

        Raises
        ------
        DataError
            If no row lies between the times.
        """
        begin, end = (int(np.searchsorted(self.time_s, t)) for t in (first_s, last_s))
        if not begin < end:
            raise DataError(
                "no_row_between",
                first_s=first_s,
                last_s=last_s,
                duration_s=self.duration_s,
                place=self.place(),
            )
        return self._rows(slice(begin, end))

    def resample(self, sample_time_s: float) -> "ThermalLog":
        """Return means over equal blocks of time.

        Row k is the mean of what was measured from k to k + 1 times the sample time (a row
        stands for the time until the next one); a block without a value is NaN. The mean is the
        anti-alias filter, and part of every model that is identified on the result.

        Parameters
        ----------
        sample_time_s : float
            Length of a block. [s]

        Returns
        -------
        ThermalLog
            Even times from zero on.

        Raises
        ------
        DataError
            If the sample time is not positive and finite, or there would be more than 50 million
            blocks.
        """
        block = block_numbers(self.time_s, sample_time_s)
        blocks = int(block[-1]) + 1
        return replace(
            self,
            time_s=np.arange(blocks) * sample_time_s,
            columns={n: block_means(v, block, blocks) for n, v in self.columns.items()},
        )

    def to_polars(self) -> "pl.DataFrame":
        """Return `time_s` and the columns as a frame; what was not measured is null."""
        import polars as pl  # noqa: PLC0415  takes a tenth of a second

        columns = {TIME_COLUMN: self.time_s, **self.columns}
        return pl.DataFrame(columns, nan_to_null=True)

    def _rows(self, rows: slice) -> "ThermalLog":
        time_s = self.time_s[rows]
        begin = float(time_s[0])
        return replace(
            self,
            time_s=time_s - begin,
            columns={name: values[rows] for name, values in self.columns.items()},
            start=None if self.start is None else self.start + timedelta(seconds=begin),
            origin_s=self.origin_s + (begin if self.start is None else 0.0),
        )


def common_names(logs: Iterable[ThermalLog]) -> tuple[str, ...]:
    """Return the names of the columns that all logs have, in the order of the first one."""
    names: list[str] | None = None
    for log in logs:
        names = [n for n in (log.columns if names is None else names) if n in log.columns]
    return tuple(names or ())


def _numbers(name: str, values: ArrayLike) -> FloatArray:
    try:
        return np.asarray(values, dtype=np.float64)
    except (TypeError, ValueError):
        raise DataError("not_numbers", column=name) from None


def _even_times(columns: Mapping[str, FloatArray], sample_time_s: float, name: str) -> FloatArray:
    require_sample_time(sample_time_s, Place(name))
    rows = next((v.shape[0] for v in columns.values() if v.ndim == 1), 0)
    return np.arange(rows, dtype=np.float64) * sample_time_s
