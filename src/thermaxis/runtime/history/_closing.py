"""A program of its own that closes a part: ``python -m thermaxis.runtime.history._closing``.

It reads what to do as JSON from standard input. It works beside the loop, so that neither its
memory nor its computing is the loop's.
"""

import json
import os
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import suppress
from datetime import date
from pathlib import Path
from typing import Final, NamedTuple, final

from sqlalchemy.exc import SQLAlchemyError

from thermaxis.codes import Place
from thermaxis.errors import DataError, ThermaxisError
from thermaxis.runtime.history._database import parse_url, printable_cause, reading_engine
from thermaxis.runtime.history._parts import (
    day_folder,
    days_of,
    join_parts,
    may_join,
    parts_of,
    remove_remains,
    write_part,
)
from thermaxis.runtime.history._tables import CLOSED_IN, known_of, read_rows

_NICENESS: Final = 10
_LONGEST_S: Final = 600.0
_WRITTEN: Final = "written"


class Order(NamedTuple):
    """What is to be closed."""

    url: str
    """The database, without a password."""
    table: str
    """Table of the rows."""
    first: int
    """Id of the first row. [1]"""
    last: int
    """Id of the last one. [1]"""
    day: str
    """Day of the rows, in UTC."""
    open_day: str
    """Day that is not finished: its parts are not joined."""
    folder: str
    """Folder of the machine."""


def close(order: Order, password: str = "") -> None:
    """Write rows as a part."""
    folder = Path(order.folder)
    remove_remains(folder)
    engine = reading_engine(parse_url(order.url, password))
    try:
        with engine.connect() as connection:
            if known_of(connection).get(CLOSED_IN) == order.folder and not folder.is_dir():
                raise DataError("history_folder_lost", place=Place(order.folder))  # a disk is away
            cycles = read_rows(connection, order.table, ids=(order.first, order.last))
    finally:
        engine.dispose()
    write_part(cycles, day_folder(folder, date.fromisoformat(order.day)))


def join_days(order: Order) -> Iterator[str]:
    """Join the parts of finished days; yield why one cannot be joined; its parts stay."""
    import polars as pl  # noqa: PLC0415 - the loop's own process does without

    for day, path in days_of(Path(order.folder)).items():
        try:
            if day.isoformat() != order.open_day and may_join(parts := parts_of(path)):
                join_parts(parts)
        except (ThermaxisError, OSError, pl.exceptions.PolarsError) as error:
            yield f"{day}: {printable_cause(error)}"


@final
class Closing:
    """The program at work."""

    def __init__(self, order: Order, password: str = "") -> None:
        self.order = order
        self._end_s = time.monotonic() + _LONGEST_S
        self._late = False
        self._child = subprocess.Popen(  # noqa: S603 - this interpreter, a module of ours
            [sys.executable, "-P", "-m", __name__],  # -P: no file of the working folder
            env={"POLARS_MAX_THREADS": "1", **os.environ},  # least memory, and one core at most
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        if self._child.stdin is not None:
            with suppress(BrokenPipeError):
                self._child.stdin.write(json.dumps({"order": order, "password": password}))
                self._child.stdin.close()
            self._child.stdin = None  # what `communicate` would flush

    def ended(self) -> bool:
        """Return whether it has ended; one that hangs is ended."""
        going = self._child.poll() is None
        if going and time.monotonic() >= self._end_s:
            self._late = True
            self._child.kill()
        return not going

    def result(self) -> tuple[bool, str]:
        """Return whether the part is written, and what else has failed; once it has ended."""
        said, failed = self._child.communicate(timeout=10.0)
        written, _, why = said.strip().replace("\n", "; ").partition("; ")
        if self._late:
            why = f"not done after {_LONGEST_S:g} s"
        elif self._child.returncode:
            why = failed.strip().rpartition("\n")[2] or f"exit code {self._child.returncode}"
        return written == _WRITTEN, why[:300]

    def end(self) -> None:
        """End it; what it has begun is done again."""
        self._child.kill()
        with suppress(subprocess.TimeoutExpired):
            self.result()


def _main() -> int:
    os.nice(_NICENESS)
    with suppress(OSError):  # where memory runs out it is this program that goes, never the loop
        Path("/proc/self/oom_score_adj").write_text("1000", encoding="ascii")
    asked = json.load(sys.stdin)
    try:
        close(order := Order(*asked["order"]), asked["password"])
    except (ThermaxisError, SQLAlchemyError, OSError) as error:
        sys.stderr.write(f"{printable_cause(error)}\n")
        return 1
    print(_WRITTEN, flush=True)  # noqa: T201 - what follows may fail, and undoes nothing of it
    for why in join_days(order):
        print(why, flush=True)  # noqa: T201 - as above
    return 0


if __name__ == "__main__":
    sys.exit(_main())
