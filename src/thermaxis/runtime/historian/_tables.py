"""The tables of the history, and which version of them this program writes.

=====================  ==========================================================================
``thermaxis_version``  version of the schema
``thermaxis_run``      one row for each start of a historian
``thermaxis_word``     words of a run by number: states, statuses, reasons
``thermaxis_layout``   layouts of a run by number, JSON
``thermaxis_cycle``    the newest cycles, one row each
``thermaxis_block``    all other cycles, many in a row
``thermaxis_series``   names of numbers, such as ``Z_um.correction``
``thermaxis_trend``    least, greatest, sum and count of a number in a minute
``thermaxis_event``    events
=====================  ==========================================================================

Times are microseconds since 1970 in UTC; ``id`` of cycles counts in the order of recording and is
what history is ordered by, whatever a clock did.
"""

from typing import Final

import sqlalchemy as sa

from thermaxis.codes import Place
from thermaxis.errors import ConfigurationError

SCHEMA: Final = 3
"""Version of the schema that is written. [1]"""

metadata = sa.MetaData()
_INTEGER = sa.BigInteger().with_variant(sa.Integer(), "sqlite")  # SQLite: INTEGER is the row's id
_REAL: sa.Double[float] = sa.Double()

version = sa.Table(
    "thermaxis_version",
    metadata,
    sa.Column("name", sa.Text, primary_key=True),
    sa.Column("value", _INTEGER, nullable=False),
)
run = sa.Table(
    "thermaxis_run",
    metadata,
    sa.Column("id", _INTEGER, primary_key=True, autoincrement=False),
    sa.Column("key", sa.Text, nullable=False, unique=True),
    sa.Column("utc_us", _INTEGER, nullable=False),
    sa.Column("program", sa.Text, nullable=False),
)
word = sa.Table(
    "thermaxis_word",
    metadata,
    sa.Column("run", _INTEGER, primary_key=True, autoincrement=False),
    sa.Column("code", _INTEGER, primary_key=True, autoincrement=False),
    sa.Column("text", sa.Text, nullable=False),
)
layout = sa.Table(
    "thermaxis_layout",
    metadata,
    sa.Column("run", _INTEGER, primary_key=True, autoincrement=False),
    sa.Column("code", _INTEGER, primary_key=True, autoincrement=False),
    sa.Column("text", sa.Text, nullable=False),
)
cycle = sa.Table(
    "thermaxis_cycle",
    metadata,
    sa.Column("id", _INTEGER, primary_key=True, autoincrement=False),
    sa.Column("run", _INTEGER, nullable=False),
    sa.Column("seq", _INTEGER, nullable=False),
    sa.Column("layout", _INTEGER, nullable=False),
    sa.Column("utc_us", _INTEGER, nullable=False),
    sa.Column("row", sa.LargeBinary, nullable=False),
    sa.Column("text", sa.Text),
)
block = sa.Table(
    "thermaxis_block",
    metadata,
    sa.Column("id", _INTEGER, primary_key=True, autoincrement=False),
    sa.Column("run", _INTEGER, nullable=False),
    sa.Column("last_seq", _INTEGER, nullable=False),
    sa.Column("layout", _INTEGER, nullable=False),
    sa.Column("entries", _INTEGER, nullable=False),
    sa.Column("utc_min_us", _INTEGER, nullable=False),
    sa.Column("utc_max_us", _INTEGER, nullable=False),
    sa.Column("rows", sa.LargeBinary, nullable=False),
    sa.Column("texts", sa.Text),
    sa.Index("thermaxis_block_utc", "utc_max_us", "utc_min_us"),
    sa.Index("thermaxis_block_run", "run", "last_seq"),
)
series = sa.Table(
    "thermaxis_series",
    metadata,
    sa.Column("id", _INTEGER, primary_key=True, autoincrement=False),
    sa.Column("name", sa.Text, nullable=False, unique=True),
    sa.Column("unit", sa.Text, nullable=False),
)
trend = sa.Table(
    "thermaxis_trend",
    metadata,
    sa.Column("series", _INTEGER, primary_key=True, autoincrement=False),
    sa.Column("minute", _INTEGER, primary_key=True, autoincrement=False),
    sa.Column("entries", _INTEGER, nullable=False),
    sa.Column("lowest", _REAL, nullable=False),
    sa.Column("highest", _REAL, nullable=False),
    sa.Column("total", _REAL, nullable=False),
    sqlite_with_rowid=False,
)
event = sa.Table(
    "thermaxis_event",
    metadata,
    sa.Column("id", _INTEGER, primary_key=True, autoincrement=False),
    sa.Column("run", _INTEGER, nullable=False),
    sa.Column("seq", _INTEGER, nullable=False),
    sa.Column("cycle_id", _INTEGER, nullable=False),
    sa.Column("utc_us", _INTEGER, nullable=False),
    sa.Column("kind", sa.Text, nullable=False),
    sa.Column("who", sa.Text, nullable=False),
    sa.Column("text", sa.Text, nullable=False),
    sa.Column("details", sa.Text, nullable=False),
    sa.Index("thermaxis_event_utc", "utc_us"),
    sa.Index("thermaxis_event_run", "run", "seq"),
)


def stored_schema(connection: sa.Connection) -> int | None:
    """Return the version of the tables in a database."""
    if not sa.inspect(connection).has_table(version.name):
        return None
    return connection.execute(
        sa.select(version.c.value).where(version.c.name == "schema")
    ).scalar_one_or_none()


def require_known_schema(found: int, where: str) -> None:
    """Refuse a database that another version of the program has written."""
    if found != SCHEMA:
        raise ConfigurationError("history_version", found=found, known=SCHEMA, place=Place(where))


def make_tables(connection: sa.Connection, where: str) -> None:
    """Make the tables where there are none."""
    with connection.begin():
        found = stored_schema(connection)
        if found is None:
            metadata.create_all(connection)
            connection.execute(sa.insert(version).values(name="schema", value=SCHEMA))
            return
    require_known_schema(found, where)
