"""Finished parts of a history: one Parquet file for every hour, later for every day.

``machine=NAME/day=DATE/cycles-FIRST-LAST.parquet`` holds the cycles with the ids FIRST to LAST, and
``minutes-FIRST-LAST.parquet`` beside it count, least, greatest and mean of every number in every
minute. Days are UTC. A file is written under another name, read back and compared, and then put in
its place in one step; only afterwards do rows or smaller files go. A part that lies within another
one of its day has been joined to it and does not count.
"""

import os
import re
from collections.abc import Callable, Generator, Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
from datetime import date
from pathlib import Path
from typing import TYPE_CHECKING, Final, NamedTuple
from urllib.parse import quote

from thermaxis.errors import DataError
from thermaxis.runtime._ports import DATUM
from thermaxis.runtime.history._columns import TIME

if TYPE_CHECKING:
    import polars as pl

MINUTE: Final = "minute_utc"
"""Begin of a minute."""
DATUM_SET: Final = "datum_set_count"
"""Cycles of a minute in which a datum was set anew. [1]"""
_PART = re.compile(r"cycles-(\d{12})-(\d{12})\.parquet")
_SHIPPED: Final = "shipped.txt"
_ZSTD_LEVEL = 9
_GROUP_VALUES = 3_500_000  # in a row group: it bounds the memory of writing, to 230 MB in all


class Part(NamedTuple):
    """A file of cycles."""

    first: int
    """Id of its first cycle. [1]"""
    last: int
    """Id of its last one. [1]"""
    folder: Path

    @property
    def cycles(self) -> Path:
        """Its cycles."""
        return self.folder / f"cycles-{self.first:012}-{self.last:012}.parquet"

    @property
    def minutes(self) -> Path:
        """Its minutes."""
        return self.folder / f"minutes-{self.first:012}-{self.last:012}.parquet"

    def remove(self) -> None:
        """Remove it; the cycles first, so that no minute is missing of what is there."""
        self.cycles.unlink(missing_ok=True)
        self.minutes.unlink(missing_ok=True)


def machine_folder(root: Path, machine: str) -> Path:
    """Return the folder of a machine's days; other signs than letters are percent-encoded."""
    return root / f"machine={quote(machine, safe=' ')}"


def day_folder(folder: Path, day: date) -> Path:
    """Return the folder of a day."""
    return folder / f"day={day.isoformat()}"


def days_of(folder: Path) -> dict[date, Path]:
    """Return the folders of the days, by day."""
    found: dict[date, Path] = {}
    for path in sorted(folder.glob("day=*")):
        with suppress(ValueError):
            found[date.fromisoformat(path.name.removeprefix("day="))] = path
    return found


def _every_part(folder: Path) -> list[Part]:
    names = (_PART.fullmatch(path.name) for path in folder.glob("cycles-*.parquet"))
    return [Part(int(name[1]), int(name[2]), folder) for name in names if name]


def parts_of(folder: Path) -> list[Part]:
    """Return the parts of a day in the order of recording, without those joined to others."""
    return unjoined(_every_part(folder))


def unjoined(parts: Iterable[Part]) -> list[Part]:
    """Return parts of a day in the order of recording, without those that lie within another."""
    counted: list[Part] = []
    for part in sorted(parts, key=lambda part: (part.first, -part.last)):
        if not counted or part.last > counted[-1].last:
            counted.append(part)
    return counted


def last_id(folder: Path) -> int:
    """Return the greatest id in all files, 0 without any. [1]"""
    return max(
        (part.last for path in days_of(folder).values() for part in parts_of(path)), default=0
    )


def remove_remains(folder: Path) -> None:
    """Remove what a sudden end has left of files that were being written or joined."""
    for path in folder.glob("day=*/*.part"):
        path.unlink(missing_ok=True)
    for path in days_of(folder).values():
        for part in set(_every_part(path)) - set(parts_of(path)):
            part.remove()


# ---- what a lake has ----------------------------------------------------------------------------


def shipped_name(part: Part) -> str:
    """Return the name by which a part is known to have been shipped."""
    return f"{part.folder.name}/{part.cycles.name}"


def shipped_names(folder: Path) -> frozenset[str] | None:
    """Return which parts a lake has confirmed; None where nothing was ever shipped."""
    try:
        return frozenset((folder / _SHIPPED).read_text("utf-8", "replace").splitlines())
    except FileNotFoundError:
        return None


def note_shipped(parts: Sequence[Part]) -> None:
    """Take note beside the days of a machine which parts a lake has confirmed."""
    path = parts[0].folder.parent / _SHIPPED
    target = path.with_name(f"{path.name}.{os.getpid()}.part")
    try:
        target.write_text("".join(f"{shipped_name(part)}\n" for part in parts), "utf-8")
        target.replace(path)
    finally:
        target.unlink(missing_ok=True)


# ---- writing ------------------------------------------------------------------------------------


def minutes_of(cycles: "pl.LazyFrame") -> "pl.LazyFrame":
    """Return count, least, greatest and mean of every number in every minute, and datums set."""
    import polars as pl  # noqa: PLC0415 - the loop's own process does without

    schema = cycles.collect_schema().items()
    kinds = (pl.Float64(), pl.Boolean())
    numbers = [name for name, kind in schema if kind in kinds and not name.endswith("_age_s")]
    touches = [name for name, kind in schema if kind == pl.String() and name.endswith("_touch")]
    value = pl.col(numbers).cast(pl.Float64)
    datums = [pl.any_horizontal(pl.col(touches) == DATUM).sum().alias(DATUM_SET)] if touches else []
    minute = pl.col(TIME).dt.truncate("1m").alias(MINUTE)
    return (
        cycles.group_by(minute)
        .agg(
            value.count().name.suffix("_count"),
            value.min().name.suffix("_least"),
            value.max().name.suffix("_greatest"),
            value.mean().name.suffix("_mean"),
            *datums,
        )
        .sort(MINUTE)
    )


def write_part(part: Part, rows: "Iterator[pl.DataFrame]") -> Part:
    """Write the cycles of an hour with their minutes, in memory that does not grow with it.

    They come in the order of recording; the first frame has the columns and no cycle.
    """
    import polars as pl  # noqa: PLC0415 - see above

    part.folder.mkdir(parents=True, exist_ok=True)
    with _written(part.cycles, next(rows).schema, lambda: rows) as (target, number):
        if number != part.last - part.first + 1:
            raise DataError("part_incomplete", file=part.cycles)
        minutes = minutes_of(pl.scan_parquet(target, hive_partitioning=False)).collect(
            engine="streaming"
        )
        with _written(part.minutes, minutes.schema, lambda: iter([minutes])):
            pass
    return part


def join_parts(parts: Sequence[Part]) -> Part:
    """Make one part of those of a day; columns that some of them lack are null there."""
    import polars as pl  # noqa: PLC0415 - see above

    joined = Part(parts[0].first, max(part.last for part in parts), parts[0].folder)
    for kind in ("minutes", "cycles"):
        paths: list[Path] = [getattr(part, kind) for part in parts]
        none = [pl.DataFrame(schema=pl.read_parquet_schema(path)) for path in paths]
        schema = pl.concat(none, how="diagonal").schema
        with _written(getattr(joined, kind), schema, lambda p=paths, s=schema: _pieces(p, s)):
            pass
    for part in parts:
        if part[:2] != joined[:2]:
            part.remove()
    return joined


def _pieces(paths: Sequence[Path], schema: "pl.Schema") -> "Iterator[pl.DataFrame]":
    """Yield what files hold, a row group at a time, with all columns."""
    import polars as pl  # noqa: PLC0415 - see above

    size = _group_rows(schema)
    for path in paths:
        scan = pl.scan_parquet(
            path, schema=schema, missing_columns="insert", hive_partitioning=False
        )
        number = int(scan.select(pl.len()).collect().item())
        yield from (scan.slice(first, size).collect() for first in range(0, number, size))


def _group_rows(schema: "pl.Schema") -> int:
    return max(1000, _GROUP_VALUES // len(schema))


@contextmanager
def _written(
    path: Path, schema: "pl.Schema", frames: "Callable[[], Iterator[pl.DataFrame]]"
) -> Generator[tuple[Path, int]]:
    """Write frames under another name, read back, compare; put in place what raises nothing.

    Given are the file under its other name, and its rows. [1]
    """
    import polars as pl  # noqa: PLC0415 - see above
    from polars.io.plugins import register_io_source  # noqa: PLC0415 - see above

    sums = pl.len().alias(""), pl.all().hash().sum()
    total = pl.DataFrame(schema=schema).select(sums)

    def counted(*_: object) -> "Iterator[pl.DataFrame]":
        nonlocal total
        for frame in frames():
            total = pl.concat([total, frame.select(sums)]).sum()
            yield frame

    target = path.with_name(f"{path.name}.{os.getpid()}.part")
    try:
        register_io_source(counted, schema=schema).sink_parquet(
            target,
            compression="zstd",
            compression_level=_ZSTD_LEVEL,
            row_group_size=_group_rows(schema),
            sync_on_close="all",
        )
        read = [frame.select(sums) for frame in _pieces([target], schema)]
        if not pl.concat([total.clear(), *read]).sum().equals(total):
            raise DataError("part_not_read_back", file=path)
        yield target, int(total.item(0, 0))
        target.replace(path)
    finally:
        target.unlink(missing_ok=True)
    descriptor = os.open(path.parent, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
