"""Addresses of databases, and connections to them: SQLite by default, PostgreSQL by URL."""

import sqlite3
from collections.abc import Callable
from pathlib import Path
from typing import Any, Final

import sqlalchemy as sa
from sqlalchemy import event
from sqlalchemy.engine import make_url
from sqlalchemy.exc import ArgumentError, DBAPIError, SQLAlchemyError

from thermaxis.codes import Place
from thermaxis.errors import ConfigurationError, ThermaxisError
from thermaxis.messages import sentence_of
from thermaxis.runtime.history._url import check_url, sqlite_path

_URL = Place(key="historian.url")
_BUSY_S = 5.0
_LONGEST_CAUSE: Final = 300
_TEXTS = "UTF8"


def file_identity(path: Path) -> tuple[int, int] | None:
    """Return what tells a file from another one of the same name."""
    try:
        found = path.stat()
    except OSError:
        return None
    return found.st_dev, found.st_ino


def writing_engine(url: str, password: str = "") -> sa.Engine:
    """Return an engine for the one writer of a database. Nothing is opened yet.

    SQLite: write-ahead log, and every commit is on the disk before it counts (synchronous FULL):
    with NORMAL a loss of power would take everything since the last checkpoint, minutes, not the
    last second. A commit a second costs a disk nothing.
    """
    path = sqlite_path(url)
    if path is None:
        return _postgresql_engine(url, password)

    def connect() -> sqlite3.Connection:
        connection = sqlite3.connect(
            path, timeout=_BUSY_S, isolation_level=None, check_same_thread=False
        )
        for pragma in ("journal_mode=WAL", "synchronous=FULL", "journal_size_limit=16777216"):
            connection.execute(f"PRAGMA {pragma}").close()
        return connection

    return _sqlite_engine(connect, begin="BEGIN IMMEDIATE")


def reading_engine(url: str, password: str = "") -> sa.Engine:
    """Return an engine that cannot write."""
    path = sqlite_path(url)
    if path is None:
        # One moment for both: what is closed, and the rows that are not.
        moment = "-c default_transaction_isolation=repeatable\\ read"
        return _postgresql_engine(url, password, f" -c default_transaction_read_only=on {moment}")
    if not path.is_file():
        raise ConfigurationError("history_not_there", file=path)
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


def _postgresql_engine(url: str, password: str, options: str = "") -> sa.Engine:
    """Return an engine whose calls never wait for ever, of a database that takes every text."""
    arguments = {
        "connect_timeout": 5,
        "keepalives_idle": 5,
        "keepalives_interval": 2,
        "keepalives_count": 3,
        "tcp_user_timeout": 10_000,
        "application_name": "thermaxis",
        "options": f"-c statement_timeout=30000 -c lock_timeout=5000 -c timezone=UTC{options}",
    }
    try:
        address = make_url(url).set(drivername="postgresql+psycopg")
    except (ArgumentError, ValueError) as error:
        raise ConfigurationError("no_database_url", place=_URL) from error
    address = address.set(password=password) if password else address
    engine = sa.create_engine(address, poolclass=sa.NullPool, connect_args=arguments)

    def refuse_bytes(connection: Any, _: object) -> None:
        encoding = connection.info.parameter_status("server_encoding")
        if encoding != _TEXTS:  # SQL_ASCII gives bytes where text is asked for
            connection.close()
            raise ConfigurationError("database_encoding", found=str(encoding), place=_URL)

    event.listen(engine, "connect", refuse_bytes, insert=True)  # before anything is asked
    return engine


def check_database(url: str, password: str = "") -> None:
    """Check that a database can keep a history, as far as it can be reached.

    Raises
    ------
    ConfigurationError
        If it stores no text in UTF-8, or has tables of another program.
    OSError
        If it cannot be reached.
    """
    from thermaxis.runtime.history._tables import is_history  # noqa: PLC0415 - it needs this file

    path = check_url(url, key=_URL.key)
    if path is not None and not path.exists():
        return
    engine = reading_engine(url, password)
    try:
        with engine.connect() as connection:
            is_history(connection, str(path or url))
    except (SQLAlchemyError, sqlite3.Error) as error:
        cause = error.orig if isinstance(error, DBAPIError) else error
        raise OSError(printable_cause(cause or error)) from error
    finally:
        engine.dispose()


def printable_cause(error: BaseException) -> str:
    """Return why something failed, for a message that people read.

    Returns
    -------
    str
        The first line of what the error says, without the file that it names, which is nobody's
        business who only looks; its kind where it says nothing.
    """
    if isinstance(error, ThermaxisError):
        text = sentence_of(error.message).rstrip(".")
    else:
        text = str(getattr(error, "strerror", None) or error)
    return text.strip().partition("\n")[0][:_LONGEST_CAUSE] or type(error).__name__
