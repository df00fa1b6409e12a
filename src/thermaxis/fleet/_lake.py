"""A lake: the finished parts of many machines, in a folder or wherever fsspec reaches.

``machine=NAME/day=DATE/`` has the files of a history as they were closed, and for every part
``FIRST-LAST.sha256``, the sums of its two files as ``sha256sum -c`` reads them. It is written last:
a part counts once it is there. A part that lies within another one of its day does not count.
Nothing is ever deleted.
"""

import hashlib
import io
import os
import re
from collections.abc import Callable, Generator, Sequence
from contextlib import contextmanager, suppress
from datetime import date, timedelta
from pathlib import Path, PurePosixPath
from typing import Any, BinaryIO, Final, cast, final

import fsspec.core
import polars as pl
from fsspec.implementations.local import LocalFileSystem

from thermaxis.errors import ConfigurationError, DataError, ThermaxisError
from thermaxis.runtime.history import Part, machine_folder, printable_cause, unjoined

_SUMS: Final = re.compile(r"(\d{12})-(\d{12})\.sha256")
_LINE: Final = re.compile(r"([0-9a-f]{64})  (\S+)")
_BLOCK: Final = 1 << 20
_opened: Callable[[str], tuple[Any, str]] = cast("Any", fsspec.core).url_to_fs


@final
class Lake:
    """A lake.

    Parameters
    ----------
    target : str
        Its folder, or a URL of fsspec such as ``s3://bucket/fleet``.

    Raises
    ------
    ConfigurationError
        If there is no such folder, or the URL needs a package that is not installed.
    """

    def __init__(self, target: str) -> None:
        self.where = target
        """Its folder or URL."""
        try:
            found = _opened(target)
        except (ImportError, ValueError) as error:
            raise ConfigurationError("lake_protocol", cause=str(error), file=target) from error
        self._fs, self._root = found
        self._fs.invalidate_cache()  # others write there, too
        if isinstance(self._fs, LocalFileSystem) and not Path(self._root).is_dir():
            # a disk that is not mounted is not begun anew
            raise ConfigurationError("folder_not_found", file=target)

    def sums(self, folder: str, part: Part) -> dict[str, str]:
        """Return the sums of a part by file, empty where it is not there."""
        try:
            text = self._read(f"{folder}/{_sums_name(part)}").decode("ascii", "replace")
        except FileNotFoundError:
            return {}
        return {line[2]: line[1] for line in _LINE.finditer(text)}

    def parts(self, folder: str) -> list[Part]:
        """Return the parts of a day."""
        with self._errors_named(folder):
            try:
                paths: list[str] = self._fs.ls(f"{self._root}/{folder}", detail=False)
            except FileNotFoundError:
                return []
        names = (_SUMS.fullmatch(PurePosixPath(path).name) for path in paths)
        return [Part(int(name[1]), int(name[2]), Path(folder)) for name in names if name]

    def size(self, path: str) -> int | None:
        """Return the size of a file, None where there is none. [byte]"""
        with self._errors_named(path):
            try:
                return int(self._fs.info(f"{self._root}/{path}")["size"])
            except FileNotFoundError:
                return None

    def _read(self, path: str) -> bytes:
        with self._errors_named(path):
            content: bytes = self._fs.cat_file(f"{self._root}/{path}")
            return content

    def put(self, part: Part, folder: str) -> None:
        """Write a part: under other names, read back, put in place; its sums at last.

        Raises
        ------
        DataError
            If the lake cannot be written, or what is read back is something else. What was put in
            place stays, and is gone on from.
        """
        lines: list[str] = []
        with self._errors_named(folder):
            self._fs.makedirs(f"{self._root}/{folder}", exist_ok=True)
        for path in (part.minutes, part.cycles):
            with path.open("rb") as source:
                total = self._written(source, f"{folder}/{path.name}")
            lines.append(f"{total}  {path.name}\n")
        self._written(io.BytesIO("".join(lines).encode("ascii")), f"{folder}/{_sums_name(part)}")

    def _written(self, source: BinaryIO, path: str) -> str:
        target = f"{self._root}/{path}"
        other = f"{target}.part"
        total = hashlib.sha256()
        with self._errors_named(path):
            try:
                with self._fs.open(other, "wb") as stream:
                    while block := source.read(_BLOCK):
                        total.update(block)
                        stream.write(block)
                    stream.flush()
                    with suppress(AttributeError, OSError):  # where there is a disk
                        os.fsync(stream.fileno())
                self._confirm(other, total.hexdigest(), path)
                self._fs.mv(other, target)
            except BaseException:
                with suppress(OSError):
                    self._fs.rm_file(other)
                raise
        return total.hexdigest()

    def _confirm(self, other: str, total: str, path: str) -> None:
        with self._fs.open(other, "rb") as stream:
            if hashlib.file_digest(stream, "sha256").hexdigest() != total:
                raise DataError("lake_not_read_back", file=f"{self.where}/{path}")

    def days(self, machine: str) -> list[date]:
        """Return the days of a machine that have parts, the earliest first."""
        folder = str(machine_folder(Path(self._root), machine))
        with self._errors_named(folder):
            try:
                paths: list[str] = self._fs.ls(folder, detail=False)
            except FileNotFoundError:
                return []
        found: list[date] = []
        for path in paths:
            with suppress(ValueError):
                found.append(date.fromisoformat(PurePosixPath(path).name.removeprefix("day=")))
        return sorted(found)

    def minutes(
        self, machine: str, day: date, days_back: int = 0, formerly: Sequence[str] = ()
    ) -> list[pl.DataFrame]:
        """Return the minutes of a day and of those before it, a frame for every part.

        Parameters
        ----------
        machine : str
            Its name.
        day : date
            The last day.
        days_back : int
            Days before it. [1]
        formerly : sequence of str
            Other names of the machine; of parts with the same ids that of its name counts.

        Returns
        -------
        list of polars.DataFrame
            Minutes in the order of recording; empty where nothing was shipped.

        Raises
        ------
        DataError
            If a file is not what its sum says, or the lake cannot be read.
        """
        days = (day - timedelta(days=back) for back in range(days_back, -1, -1))
        names = [*formerly, machine]
        return [
            self.frame(str(part.folder), part) for one in days for part in self._day(names, one)
        ]

    def last_id(self, machine: str, day: date, formerly: Sequence[str] = ()) -> int:
        """Return the id of the last cycle of a day, 0 where nothing was shipped. [1]"""
        return max((part.last for part in self._day([*formerly, machine], day)), default=0)

    def _day(self, names: Sequence[str], day: date) -> list[Part]:
        folders = [f"{machine_folder(Path(), name)}/day={day.isoformat()}" for name in names]
        found = {part[:2]: part for folder in folders for part in self.parts(folder)}
        return unjoined(found.values())

    def frame(self, folder: str, part: Part) -> pl.DataFrame:
        """Return the minutes of a part, checked against their sum."""
        name = part.minutes.name
        try:
            content = self._read(f"{folder}/{name}")
        except FileNotFoundError:
            content = b""
        if hashlib.sha256(content).hexdigest() != self.sums(folder, part).get(name):
            raise DataError("lake_damaged", file=f"{self.where}/{folder}/{name}")
        return pl.read_parquet(io.BytesIO(content))

    @contextmanager
    def _errors_named(self, path: str) -> Generator[None]:
        try:
            yield
        except (FileNotFoundError, ThermaxisError):
            raise
        except Exception as error:  # of botocore no error is an OSError
            raise DataError(
                "lake_out_of_reach", cause=printable_cause(error), file=f"{self.where}/{path}"
            ) from error


def _sums_name(part: Part) -> str:
    return f"{part.first:012}-{part.last:012}.sha256"
