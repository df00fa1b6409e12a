"""Thermal logs as Parquet: read column by column, and reduced while reading."""

from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from thermaxis.errors import MeasurementFileError
from thermaxis.files.logs._columns import ColumnValues, LogTable, Moments, build_log, plan_columns
from thermaxis.files.settings import ThermalMapping
from thermaxis.thermal import ThermalLog

if TYPE_CHECKING:
    import polars as pl

FILE_LIMIT_BYTES = 20_000_000_000
"""Largest Parquet file. [byte]"""


def read_thermal_parquet(
    path: Path | str,
    *,
    mapping: ThermalMapping | None = None,
    sample_time_s: float | None = None,
) -> ThermalLog:
    """Read a thermal log from Parquet.

    Only the times and one channel are whole in memory at once: with a sample time, a year at 1 Hz
    is read in a small part of the memory that the record would take.
    """
    import polars as pl  # noqa: PLC0415  takes a tenth of a second

    name = str(path)
    check_file(path, FILE_LIMIT_BYTES, b"PAR1", "a Parquet file")
    with _damage_named(name):
        frame = pl.scan_parquet(Path(path), glob=False)
        names = frame.collect_schema().names()
        rows = int(frame.select(pl.len()).collect().item())
    plan = plan_columns(name, names, mapping)

    def read(index: int) -> ColumnValues:
        with _damage_named(name):
            return _values_of(frame.select(pl.nth(index)).collect().to_series())

    table = LogTable(
        path=name,
        headings=tuple(names),
        rows=rows,
        read=read,
        place=lambda row: f"row {row + 1}",
    )
    return build_log(table, plan, name=Path(path).stem, sample_time_s=sample_time_s)


def check_file(path: Path | str, limit_bytes: int, start: bytes, seems: str) -> None:
    """Check size and first bytes of a binary file before it is read."""
    name = str(path)
    try:
        if not Path(path).is_file():
            what = "this is no regular file" if Path(path).exists() else "there is no such file"
            raise MeasurementFileError(what, path=name, remedy="Check the name and the folder")
        size = Path(path).stat().st_size
        with Path(path).open("rb") as stream:
            begins = stream.read(len(start))
    except (OSError, ValueError) as error:
        raise MeasurementFileError(
            f"the file cannot be read ({type(error).__name__})",
            path=name,
            remedy="Check the name, the permissions and whether another program holds it open",
        ) from error
    if size == 0:
        raise MeasurementFileError("the file is empty", path=name, remedy="Export the log again")
    if size > limit_bytes:
        raise MeasurementFileError(
            f"the file has {size / 1e6:.0f} MB, more than the limit of {limit_bytes / 1e6:.0f} MB",
            path=name,
            remedy="Split the log into several files, or write it as Parquet",
        )
    if begins != start:
        raise MeasurementFileError(
            f"this is not {seems}", path=name, remedy="Check the file, or export the log again"
        )


@contextmanager
def _damage_named(path: str) -> Generator[None]:
    """Turn what the Parquet reader raises into the error of a damaged file."""
    import polars as pl  # noqa: PLC0415

    # A damaged file can make the reader panic: that error is no Exception.
    panic = pl.exceptions.PanicException
    try:
        yield
    except (
        pl.exceptions.PolarsError,
        panic,
        OSError,
        ValueError,
        TypeError,
        OverflowError,
        MemoryError,
    ) as error:
        reason = str(error).partition("\n")[0] or type(error).__name__
        raise MeasurementFileError(
            f"the Parquet file is damaged or of an unknown kind ({reason[:150]})",
            path=path,
            remedy="Copy or export the file again",
        ) from error


def _values_of(series: "pl.Series") -> ColumnValues:
    """Return numbers, dates or texts of a column; other types count as texts without a word."""
    import polars as pl  # noqa: PLC0415

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
