"""A program of its own that closes a part: ``python -m thermaxis.runtime.history._closing``.

It reads what to do as JSON from standard input. It works beside the loop, so that neither its
memory nor its computing is the loop's.
"""

import json
import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import suppress
from datetime import date
from pathlib import Path
from typing import Final, NamedTuple, final

from sqlalchemy.exc import SQLAlchemyError

from thermaxis.errors import DataError, ThermaxisError
from thermaxis.runtime.history._database import printable_cause, reading_engine
from thermaxis.runtime.history._parts import (
    Part,
    day_folder,
    days_of,
    join_parts,
    parts_of,
    remove_remains,
    write_part,
)
from thermaxis.runtime.history._tables import CLOSED, known_of, rows

_NICENESS: Final = 10
_LONGEST_S: Final = 1800
_LEAST: Final = {  # one core at most, and memory that is given back at once
    "POLARS_MAX_THREADS": "1",
    "POLARS_ROW_GROUP_PREFETCH_SIZE": "1",
    "_RJEM_MALLOC_CONF": "dirty_decay_ms:0,muzzy_decay_ms:0",
}
WRITTEN: Final = "written"
"""What it says once the rows are in a file."""


class Order(NamedTuple):
    """What is to be closed."""

    url: str
    """The database, without a password."""
    table: str
    first: int
    """Id of the first row. [1]"""
    last: int
    """Id of the last one. [1]"""
    day: str
    """Day of the rows, in UTC."""
    open_day: str
    """Day that is not finished: its parts are not joined."""
    folder: str


def done(order: Order, password: str = "") -> Iterator[str]:
    """Write rows as a part and say so; join finished days and say which cannot be: they stay."""
    import polars as pl  # noqa: PLC0415 - the loop's own process does without

    folder = Path(order.folder)
    remove_remains(folder)
    engine = reading_engine(order.url, password)
    try:
        with engine.connect() as connection:
            if known_of(connection)[CLOSED] != "0" and not folder.is_dir():  # a disk is away
                raise DataError("history_folder_lost", file=order.folder)
            part = Part(order.first, order.last, day_folder(folder, date.fromisoformat(order.day)))
            write_part(part, rows(connection, order.table, (order.first, order.last)))
    finally:
        engine.dispose()
    yield WRITTEN
    for day, path in days_of(folder).items():
        try:
            if day.isoformat() != order.open_day and len(parts := parts_of(path)) > 1:
                join_parts(parts)
        except (ThermaxisError, OSError, pl.exceptions.PolarsError) as error:
            yield f"{day}: {printable_cause(error)}"


@final
class Closing:
    """The program at work."""

    def __init__(self, order: Order, password: str = "") -> None:
        self.order = order
        self._child = subprocess.Popen(  # noqa: S603 - this interpreter, a module of ours
            [sys.executable, "-P", "-m", __name__],  # -P: no file of the working folder
            env={**_LEAST, **os.environ},
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        )
        asked = json.dumps({"order": order, "password": password, "longest_s": _LONGEST_S})
        if self._child.stdin is not None:
            with suppress(BrokenPipeError):
                self._child.stdin.write(asked)
                self._child.stdin.close()
            self._child.stdin = None  # what `communicate` would flush

    def ended(self) -> bool:
        """Return whether it has ended."""
        return self._child.poll() is not None

    def result(self) -> list[str]:
        """Return what it has said once it has ended: first whether the part is written."""
        said = self._child.communicate()[0].strip().splitlines()
        if self._child.returncode == -signal.SIGALRM:
            return [*said, f"not done after {_LONGEST_S} s"]
        return said or [f"exit code {self._child.returncode}"]

    def end(self) -> None:
        """End it; what it has begun is done again."""
        self._child.kill()
        self._child.communicate()


def _main() -> int:
    os.nice(_NICENESS)
    with suppress(OSError):  # where memory runs out it is this program that goes, never the loop
        Path("/proc/self/oom_score_adj").write_text("1000", encoding="ascii")
    asked = json.load(sys.stdin)
    signal.alarm(asked["longest_s"])  # one that hangs is ended by the system
    try:
        for line in done(Order(*asked["order"]), asked["password"]):
            print(line, flush=True)  # noqa: T201 - what follows may fail, and undoes nothing of it
    except (ThermaxisError, SQLAlchemyError, OSError) as error:
        print(printable_cause(error))  # noqa: T201 - as above
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(_main())
