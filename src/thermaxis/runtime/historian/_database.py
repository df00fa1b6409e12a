"""Addresses of databases, and connections to them: SQLite by default, PostgreSQL by URL."""

import sqlite3
from collections.abc import Callable
from pathlib import Path

import sqlalchemy as sa
from sqlalchemy import event
from sqlalchemy.engine import URL, make_url
from sqlalchemy.exc import ArgumentError

from thermaxis.codes import Place
from thermaxis.errors import ConfigurationError
from thermaxis.runtime.historian._url import check_encryption

_URL = Place(key="historian.url")
_SQLITE = "sqlite"
_POSTGRESQL = "postgresql"
_BUSY_S = 5.0


def parse_url(url: str, password: str = "") -> URL:
    """Return the address of a database."""
    try:
        parsed = make_url(url)
    except (ArgumentError, ValueError) as error:
        raise ConfigurationError("no_database_url", place=_URL) from error
    kind = parsed.get_backend_name()
    if kind == _SQLITE:
        if not parsed.database or parsed.database == ":memory:" or parsed.query:
            raise ConfigurationError("no_file_in_url", place=_URL)
        return parsed
    if kind != _POSTGRESQL or parsed.drivername not in {_POSTGRESQL, f"{_POSTGRESQL}+psycopg"}:
        raise ConfigurationError("unknown_database", kind=parsed.drivername, place=_URL)
    parsed = parsed.set(drivername=f"{_POSTGRESQL}+psycopg")
    if password:
        parsed = parsed.set(password=password)
    check_encryption(url, key=_URL.key)
    return parsed


def sqlite_path(url: URL) -> Path | None:
    """Return the file of a database, None where it is no SQLite."""
    return Path(str(url.database)) if url.get_backend_name() == _SQLITE else None


def file_identity(path: Path) -> tuple[int, int] | None:
    """Return what tells a file from another one of the same name."""
    try:
        found = path.stat()
    except OSError:
        return None
    return found.st_dev, found.st_ino


def shown_url(url: URL) -> str:
    """Return an address without its password."""
    path = sqlite_path(url)
    return str(path) if path is not None else url.render_as_string(hide_password=True)


def writing_engine(url: URL) -> sa.Engine:
    """Return an engine for the one writer of a database. Nothing is opened yet.

    SQLite: write-ahead log, and every commit is on the disk before it counts (synchronous FULL):
    with NORMAL a loss of power would take everything since the last checkpoint, minutes, not the
    last second. A commit a second costs a disk nothing.
    """
    path = sqlite_path(url)
    if path is None:
        return sa.create_engine(url, poolclass=sa.NullPool, connect_args=_postgresql_arguments())

    def connect() -> sqlite3.Connection:
        connection = sqlite3.connect(
            path, timeout=_BUSY_S, isolation_level=None, check_same_thread=False
        )
        for pragma in ("journal_mode=WAL", "synchronous=FULL", "journal_size_limit=16777216"):
            connection.execute(f"PRAGMA {pragma}").close()
        return connection

    return _sqlite_engine(connect, begin="BEGIN IMMEDIATE")


def reading_engine(url: URL) -> sa.Engine:
    """Return an engine that cannot write."""
    path = sqlite_path(url)
    if path is None:
        arguments = _postgresql_arguments()
        arguments["options"] = f"{arguments['options']} -c default_transaction_read_only=on"
        return sa.create_engine(url, poolclass=sa.NullPool, connect_args=arguments)
    if not path.is_file():
        raise ConfigurationError("file_not_found", place=Place(str(path)))
    # A folder that cannot be written to has no place for the log's index; a file without a log
    # needs none.
    alone = not path.with_name(path.name + "-wal").exists()

    def connect() -> sqlite3.Connection:
        address = f"{path.resolve().as_uri()}?mode=ro"
        connection = sqlite3.connect(
            address, uri=True, timeout=_BUSY_S, isolation_level=None, check_same_thread=False
        )
        try:
            connection.execute("SELECT count(*) FROM sqlite_master").fetchone()
        except sqlite3.OperationalError:
            connection.close()
            if not alone:
                raise
            return sqlite3.connect(
                f"{address}&immutable=1", uri=True, isolation_level=None, check_same_thread=False
            )
        return connection

    return _sqlite_engine(connect, begin="BEGIN")


def _sqlite_engine(connect: Callable[[], sqlite3.Connection], begin: str) -> sa.Engine:
    engine = sa.create_engine("sqlite://", creator=connect, poolclass=sa.NullPool)

    def begun(connection: sa.Connection) -> None:
        connection.exec_driver_sql(begin)

    event.listen(engine, "begin", begun)
    return engine


def _postgresql_arguments() -> dict[str, str | int]:
    """Let no call of the database's library wait for ever."""
    return {
        "connect_timeout": 5,
        "keepalives_idle": 5,
        "keepalives_interval": 2,
        "keepalives_count": 3,
        "tcp_user_timeout": 10_000,
        "application_name": "thermaxis",
        "options": "-c statement_timeout=30000 -c lock_timeout=5000",
    }
