"""Finished parts of a history: one Parquet file for every hour, later for every day.

``machine=NAME/day=DATE/cycles-FIRST-LAST.parquet`` holds the cycles with the ids FIRST to LAST, and
``minutes-FIRST-LAST.parquet`` beside it count, least, greatest and mean of every number in every
minute. Days are UTC. A file is written under another name, read back and compared, and then put in
its place in one step; only afterwards do rows or smaller files go. A part that lies within another
one of its day has been joined to it and does not count.
"""

import os
import re
from collections.abc import Sequence
from contextlib import suppress
from datetime import date
from pathlib import Path
from typing import TYPE_CHECKING, Final, NamedTuple
from urllib.parse import quote

from thermaxis.codes import Place
from thermaxis.errors import DataError
from thermaxis.runtime.history._columns import ID, TIME

if TYPE_CHECKING:
    import polars as pl

MINUTE: Final = "minute_utc"
"""Begin of a minute."""
STATISTICS: Final = ("count", "least", "greatest", "mean")
"""What is kept of every number in a minute, as the ends of the columns' names."""
_PART = re.compile(r"cycles-(\d{12})-(\d{12})\.parquet")
_ZSTD_LEVEL = 9
_ROW_GROUP = 16_000  # less memory than larger ones, and hardly more bytes
_MOST_JOINED = 150_000_000  # values; they take some 700 MB of memory
_COMPARED_AT_ONCE = 50


class Part(NamedTuple):
    """A file of cycles."""

    first: int
    """Id of its first cycle. [1]"""
    last: int
    """Id of its last one. [1]"""
    folder: Path
    """Folder of its day."""

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


def parts_of(folder: Path) -> list[Part]:
    """Return the parts of a day in the order of recording, without those joined to others."""
    names = (_PART.fullmatch(path.name) for path in folder.glob("cycles-*.parquet"))
    every = [Part(int(name[1]), int(name[2]), folder) for name in names if name]
    every.sort(key=lambda part: (part.first, -part.last))
    counted: list[Part] = []
    for part in every:
        if not counted or part.last > counted[-1].last:
            counted.append(part)
    return counted


def last_id(folder: Path) -> int:
    """Return the greatest id in all files, 0 without any. [1]"""
    return max(
        (part.last for path in days_of(folder).values() for part in parts_of(path)), default=0
    )


# ---- writing ------------------------------------------------------------------------------------


def minutes_of(cycles: "pl.LazyFrame") -> "pl.LazyFrame":
    """Return count, least, greatest and mean of every number in every minute."""
    import polars as pl  # noqa: PLC0415 - the loop's own process does without

    numbers = [
        name
        for name, kind in cycles.collect_schema().items()
        if kind in {pl.Float64(), pl.Boolean()} and not name.endswith("_age_s")
    ]
    minute = pl.col(TIME).dt.truncate("1m").alias(MINUTE)
    values = [pl.col(name).cast(pl.Float64) for name in numbers]
    return (
        cycles.group_by(minute)
        .agg(
            *[value.count().name.suffix("_count") for value in values],
            *[value.min().name.suffix("_least") for value in values],
            *[value.max().name.suffix("_greatest") for value in values],
            *[value.mean().name.suffix("_mean") for value in values],
        )
        .sort(MINUTE)
    )


def write_part(cycles: "pl.DataFrame", folder: Path) -> Part:
    """Write the cycles of an hour with their minutes.

    Parameters
    ----------
    cycles : polars.DataFrame
        Cycles of one day and one layout, in the order of recording.
    folder : Path
        Folder of the day; it is made.

    Returns
    -------
    Part
        The part, on the disk and read back.

    Raises
    ------
    DataError
        If cycles are missing, or what was read back is not what was written.
    OSError
        If it cannot be written.
    """
    part = Part(int(cycles[ID][0]), int(cycles[ID][-1]), folder)
    if cycles.height != part.last - part.first + 1:
        raise DataError("part_incomplete", place=Place(str(part.cycles)))
    folder.mkdir(parents=True, exist_ok=True)
    minutes = minutes_of(cycles.lazy()).collect()
    for frame, path in ((minutes, part.minutes), (cycles, part.cycles)):
        with _replacing(path) as target:
            _write(frame.lazy(), target)
            _require_equal(frame, target)
    return part


def may_join(parts: Sequence[Part]) -> bool:
    """Return whether there are parts to join, and memory for all their values."""
    import polars as pl  # noqa: PLC0415 - see above

    if len(parts) < 2:
        return False
    width = len(pl.read_parquet_schema(parts[-1].cycles))
    return width * sum(part.last - part.first + 1 for part in parts) <= _MOST_JOINED


def join_parts(parts: Sequence[Part]) -> Part:
    """Make one part of those of a day; columns that some of them lack are null there."""
    import polars as pl  # noqa: PLC0415 - see above

    joined = Part(parts[0].first, max(part.last for part in parts), parts[0].folder)
    for kind in ("minutes", "cycles"):
        sources = [getattr(part, kind) for part in parts]
        scans = [pl.scan_parquet(path, hive_partitioning=False) for path in sources]
        every = pl.concat(scans, how="diagonal")
        with _replacing(getattr(joined, kind)) as target:
            _write(every, target)
            written = pl.scan_parquet(target, hive_partitioning=False)
            sums = [scan.select(pl.len(), pl.all().hash().sum()) for scan in (every, written)]
            found = [one.collect(engine="streaming") for one in sums]
            if not found[0].equals(found[1]):
                raise DataError("part_not_read_back", place=Place(str(target)))
    for part in parts:
        if part[:2] != joined[:2]:
            part.remove()
    return joined


class _replacing:  # noqa: N801 - used as a word of a with statement
    """Gives a name to write under, and puts the file in its place when all went well."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._target = path.with_name(f"{path.name}.{os.getpid()}.part")

    def __enter__(self) -> Path:
        """Return the name to write under."""
        return self._target

    def __exit__(self, kind: object, *_: object) -> None:
        """Put it in place, or away."""
        if kind is not None:
            self._target.unlink(missing_ok=True)
            return
        self._target.replace(self._path)
        descriptor = os.open(self._path.parent, os.O_RDONLY)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)


def _write(frame: "pl.LazyFrame", target: Path) -> None:
    frame.sink_parquet(
        target,
        compression="zstd",
        compression_level=_ZSTD_LEVEL,
        row_group_size=_ROW_GROUP,
        sync_on_close="all",
    )


def _require_equal(frame: "pl.DataFrame", path: Path) -> None:
    """Read a file back, some columns at a time."""
    import polars as pl  # noqa: PLC0415 - see above

    for first in range(0, frame.width, _COMPARED_AT_ONCE):
        some = frame.columns[first : first + _COMPARED_AT_ONCE]
        if not pl.read_parquet(path, columns=some, hive_partitioning=False).equals(frame[some]):
            raise DataError("part_not_read_back", place=Place(str(path)))


def remove_remains(folder: Path) -> None:
    """Remove what a sudden end has left of files that were being written or joined."""
    for path in folder.glob("day=*/*.part"):
        path.unlink(missing_ok=True)
    for path in days_of(folder).values():
        kept = {part.cycles for part in parts_of(path)}
        for file in path.glob("cycles-*.parquet"):
            name = _PART.fullmatch(file.name)
            if name and file not in kept:
                Part(int(name[1]), int(name[2]), path).remove()
