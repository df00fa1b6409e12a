"""Thermal logs as Parquet: read column by column, and reduced while reading."""

from contextlib import AbstractContextManager
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from thermaxis.codes import Place
from thermaxis.files.logs._columns import ColumnValues, LogTable, Moments, build_log, plan_columns
from thermaxis.files.settings import ThermalMapping
from thermaxis.files.table import DAMAGE, damage_named
from thermaxis.thermal import ThermalLog

if TYPE_CHECKING:
    import polars as pl


def read_thermal_parquet(
    path: Path | str, *, mapping: ThermalMapping | None = None, sample_time_s: float | None = None
) -> ThermalLog:
    """Read a thermal log from Parquet.

    Only the times and one channel are whole in memory at once: with a sample time, a year at 1 Hz
    is read in a small part of the memory that the record would take.
    """
    import polars as pl  # noqa: PLC0415  takes a tenth of a second

    name = str(path)
    with _damage_named(name):
        frame = pl.scan_parquet(Path(path), glob=False)
        names = frame.collect_schema().names()
        rows = int(frame.select(pl.len()).collect().item())
    plan = plan_columns(Place(name), names, mapping)

    def read(index: int) -> ColumnValues:
        with _damage_named(name):
            return _values_of(frame.select(pl.nth(index)).collect().to_series())

    table = LogTable(place=Place(name), headings=tuple(names), rows=rows, read=read)
    return build_log(table, plan, name=Path(path).stem, sample_time_s=sample_time_s)


def _damage_named(path: str) -> AbstractContextManager[None]:
    import polars as pl  # noqa: PLC0415 - as above

    return damage_named(
        Place(path),
        # A damaged file can make the reader panic: that error is no Exception.
        damage=(*DAMAGE, pl.exceptions.PolarsError, pl.exceptions.PanicException),
    )


def _values_of(series: "pl.Series") -> ColumnValues:
    """Return numbers, dates or texts of a column; other types count as texts without a word."""
    import polars as pl  # noqa: PLC0415 - as above

    kind = series.dtype
    if kind.is_numeric() or kind == pl.Boolean():
        numbers = series.cast(pl.Float64())
        if numbers.null_count():
            numbers = numbers.fill_null(float("nan"))
        return numbers.to_numpy()
    if isinstance(kind, pl.Datetime | pl.Date):
        aware = isinstance(kind, pl.Datetime) and kind.time_zone is not None
        micros = series.cast(pl.Datetime("us", "UTC" if aware else None)).cast(pl.Int64())
        return Moments(micros.cast(pl.Float64()).fill_null(float("nan")).to_numpy(), aware=aware)
    if isinstance(kind, pl.Duration):
        micros = series.cast(pl.Duration("us")).cast(pl.Int64()).cast(pl.Float64())
        return np.asarray(micros.fill_null(float("nan")).to_numpy() / 1e6)
    if kind == pl.String() or isinstance(kind, pl.Categorical | pl.Enum):
        return series.cast(pl.String()).to_list()
    return [None] * series.len()
