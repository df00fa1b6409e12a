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


def _keys(*names: str) -> list[sa.Column[int]]:
    """Return columns of the primary key."""
    return [sa.Column(n, _INTEGER, primary_key=True, autoincrement=False) for n in names]


def _numbers(*names: str) -> list[sa.Column[int]]:
    """Return columns of whole numbers."""
    return [sa.Column(name, _INTEGER, nullable=False) for name in names]


def _texts(*names: str) -> list[sa.Column[str]]:
    """Return columns of text."""
    return [sa.Column(name, sa.Text, nullable=False) for name in names]


version = sa.Table(
    "thermaxis_version",
    metadata,
    sa.Column("name", sa.Text, primary_key=True),
    *_numbers("value"),
)
run = sa.Table(
    "thermaxis_run",
    metadata,
    *_keys("id"),
    sa.Column("key", sa.Text, nullable=False, unique=True),
    *_numbers("utc_us"),
    *_texts("program"),
)
word = sa.Table("thermaxis_word", metadata, *_keys("run", "code"), *_texts("text"))
layout = sa.Table("thermaxis_layout", metadata, *_keys("run", "code"), *_texts("text"))
cycle = sa.Table(
    "thermaxis_cycle",
    metadata,
    *_keys("id"),
    *_numbers("run", "seq", "layout", "utc_us"),
    sa.Column("row", sa.LargeBinary, nullable=False),
    sa.Column("text", sa.Text),
)
block = sa.Table(
    "thermaxis_block",
    metadata,
    *_keys("id"),
    *_numbers("run", "last_seq", "layout", "entries", "utc_min_us", "utc_max_us"),
    sa.Column("rows", sa.LargeBinary, nullable=False),
    sa.Column("texts", sa.Text),
    sa.Index("thermaxis_block_utc", "utc_max_us", "utc_min_us"),
    sa.Index("thermaxis_block_run", "run", "last_seq"),
)
series = sa.Table(
    "thermaxis_series",
    metadata,
    *_keys("id"),
    sa.Column("name", sa.Text, nullable=False, unique=True),
    *_texts("unit"),
)
trend = sa.Table(
    "thermaxis_trend",
    metadata,
    *_keys("series", "minute"),
    *_numbers("entries"),
    *(sa.Column(name, _REAL, nullable=False) for name in ("lowest", "highest", "total")),
    sqlite_with_rowid=False,
)
event = sa.Table(
    "thermaxis_event",
    metadata,
    *_keys("id"),
    *_numbers("run", "seq", "cycle_id", "utc_us"),
    *_texts("kind", "who", "text", "details"),
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
