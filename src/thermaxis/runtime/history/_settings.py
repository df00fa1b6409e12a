"""What the historian is told: where to, for how long, how much it may keep in memory."""

from dataclasses import dataclass
from typing import Annotated, final

from pydantic import Field

from thermaxis.runtime._connection import Secret
from thermaxis.runtime._keys import FileName, Hidden, Own, Text


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class HistorianSettings:
    """``[historian]``: where every cycle is recorded."""

    url: Text = ""
    """`sqlite:///FILE`, or `postgresql+psycopg://user@host/database` without a password; another
    computer needs `?sslmode=verify-full` or `verify-ca`; `require` proves nothing about who
    answers, and is warned of. Default: nothing to set up. Without it: a file of SQLite with the
    configuration's name and `.history.db`."""
    password: Hidden[Secret] = Secret("")  # noqa: RUF009 - it cannot change
    """Password of the database's user."""
    password_file: FileName = None
    """File whose first line is the database's password."""
    password_environment: Text = ""
    """Environment variable that holds it."""
    folder: FileName = None
    """Folder of the finished hours and days, Parquet files. Default: stays with its database.
    Without it: `NAME.history` beside `NAME.history.db` of SQLite; with PostgreSQL
    `NAME.postgresql` beside the configuration."""
    retention_days: Annotated[int, Field(ge=1, le=36_500)] = 90
    """Days with records that are kept, 1 to 36 500; others do not count, so that a clock that is
    wrong for once deletes nothing. Where days are shipped, those that were not stay up to twice as
    many. Default: a quarter. [d]"""
    largest_waiting_bytes: Annotated[int, Field(ge=100_000, le=10**12)] = 32_000_000
    """Memory for what cannot be stored at the moment; then the oldest cycles are lost, and that is
    stated. Default: seven hours at one second with four outputs and eight channels. [byte]"""
    machine: Own[str] = "machine"
    """Name of the machine; the finished parts lie in a folder of this name."""
    batch_s: Own[float] = 0.4
    """Time for which records are gathered before they are written. Default: with the write itself
    less than a second passes from a cycle to the disk. [s]"""
    retry_s: Own[float] = 2.0
    """Time between attempts to reach a lost database. Default: two seconds. [s]"""
