"""Whether SQLite's file is sound, what becomes of one that is not, and who may write to it."""

import sqlite3
from datetime import datetime
from pathlib import Path

from filelock import BaseFileLock

from thermaxis.errors import ConfigurationError
from thermaxis.runtime.host import file_lock

_DAMAGE = (sqlite3.SQLITE_CORRUPT, sqlite3.SQLITE_NOTADB)


def is_damage(error: BaseException | None) -> bool:
    """Return whether an error of SQLite says that the file is damaged."""
    code = getattr(error, "sqlite_errorcode", None)
    return isinstance(error, sqlite3.Error) and code is not None and code & 0xFF in _DAMAGE


def check_file(path: Path) -> str:
    """Look through SQLite's file; return what is wrong, empty if nothing is."""
    if not path.exists() or path.stat().st_size == 0:
        return ""
    with path.open("rb") as stream:
        if b"\0" not in stream.read(4096):
            raise ConfigurationError("text_no_database", file=path)
    # Reading only: what a sudden end has left in the log is looked at where it is.
    address = f"{path.resolve().as_uri()}?mode=ro"
    connection = sqlite3.connect(address, uri=True, timeout=5.0, isolation_level=None)
    try:
        lines = [str(row[0]) for row in connection.execute("PRAGMA quick_check(3)")]
    except sqlite3.Error as error:
        if is_damage(error):
            return str(error)
        raise
    finally:
        connection.close()
    return "" if lines == ["ok"] else "; ".join(lines)[:300]


def put_aside(path: Path, utc: datetime) -> Path:
    """Rename a damaged file, with its log, so that a new one can be begun."""
    target = path.with_name(f"{path.name}.damaged-{utc:%Y%m%dT%H%M%S.%fZ}")
    for suffix in ("-wal", ""):
        part = path.with_name(path.name + suffix)
        if part.exists():
            part.rename(target.with_name(target.name + suffix))
    path.with_name(path.name + "-shm").unlink(missing_ok=True)
    return target


def writer_lock(path: Path) -> BaseFileLock:
    """Keep a second program from writing to the same file.

    Not protected: on systems without locks on files, and on network drives that do not pass them
    on.
    """
    taken = ConfigurationError("history_in_use", file=path)
    return file_lock(path.with_name(path.name + ".lock"), taken, required=False)
