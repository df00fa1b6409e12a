"""A program of its own that closes a part: ``python -m thermaxis.runtime.history._closing``.

It reads what to do as JSON from standard input. It works beside the loop, so that neither its
memory nor its computing is the loop's.
"""

import json
import os
import subprocess
import sys
from contextlib import suppress
from datetime import date
from pathlib import Path
from typing import Final, NamedTuple, final

from sqlalchemy.exc import SQLAlchemyError

from thermaxis.errors import ThermaxisError
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
from thermaxis.runtime.history._tables import read_rows

_NICENESS: Final = 10


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
    """Write rows as a part, and join the parts of finished days."""
    folder = Path(order.folder)
    remove_remains(folder)
    engine = reading_engine(parse_url(order.url, password))
    try:
        with engine.connect() as connection:
            cycles = read_rows(connection, order.table, ids=(order.first, order.last))
    finally:
        engine.dispose()
    write_part(cycles, day_folder(folder, date.fromisoformat(order.day)))
    del cycles
    for day, path in days_of(folder).items():
        if day.isoformat() != order.open_day and may_join(parts := parts_of(path)):
            join_parts(parts)


@final
class Closing:
    """The program at work."""

    def __init__(self, order: Order, password: str = "") -> None:
        self.order = order
        self._child = subprocess.Popen(  # noqa: S603 - this interpreter, a module of ours
            [sys.executable, "-m", __name__],
            env={"POLARS_MAX_THREADS": "1", **os.environ},  # least memory, and one core at most
            stdin=subprocess.PIPE,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            text=True,
        )
        if self._child.stdin is not None:
            with suppress(BrokenPipeError):
                self._child.stdin.write(json.dumps({"order": order, "password": password}))
                self._child.stdin.close()

    def failure(self, wait_s: float = 0.0) -> str | None:
        """Return why it has failed, an empty text if it has not, None while it works."""
        try:
            code = self._child.wait(wait_s)
        except subprocess.TimeoutExpired:
            return None
        said = "" if self._child.stderr is None else self._child.stderr.read()
        if self._child.stderr is not None:
            self._child.stderr.close()
        if code == 0:
            return ""
        return said.strip().rpartition("\n")[2][:300] or f"exit code {code}"

    def end(self) -> None:
        """End it; what it has begun is done again."""
        self._child.kill()
        self.failure(10.0)


def _main() -> int:
    os.nice(_NICENESS)
    with suppress(OSError):  # where memory runs out it is this program that goes, never the loop
        Path("/proc/self/oom_score_adj").write_text("1000", encoding="ascii")
    asked = json.load(sys.stdin)
    try:
        close(Order(*asked["order"]), asked["password"])
    except (ThermaxisError, SQLAlchemyError, OSError) as error:
        sys.stderr.write(f"{printable_cause(error)}\n")
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(_main())
