"""The tables of a history, and their rows as frames.

=============  ====================================================================================
``history``    what is known of the whole, by name: version, machine, folder of the finished parts
``cycles``     the newest cycles: one row each, one column for each value
``events``     events
=============  ====================================================================================

A model or a configuration with other columns begins a new table; the one before it is called
``cycles_until_ID`` until its rows have become a part. Times are UTC; ``id`` counts in the order of
recording and is what a history is ordered by, whatever a clock did.
"""

from collections.abc import Iterator, Sequence
from datetime import datetime
from typing import TYPE_CHECKING, Any, Final

import sqlalchemy as sa

from thermaxis.errors import ConfigurationError
from thermaxis.runtime.history._columns import ID, TIME, Column

if TYPE_CHECKING:
    import polars as pl

VERSION: Final = "1"
"""Version of the tables that this program writes."""
CYCLES: Final = "cycles"
"""Table of the newest cycles."""
CLOSED: Final = "closed_id"
"""Name under which `history` has the id of the last cycle that is in a file."""
BEFORE: Final = "cycles_until_"
"""How the name of a table begins that has the cycles of an earlier model."""
_EARLIER = "thermaxis_version"
_ROWS_AT_ONCE = 500
_TYPES: Final[dict[str, sa.types.TypeEngine[Any]]] = {
    "number": sa.Double(),
    "whole": sa.BigInteger(),
    "flag": sa.Boolean(),
    "text": sa.Text(),
}

metadata = sa.MetaData()
_INTEGER = sa.BigInteger().with_variant(sa.Integer(), "sqlite")  # SQLite: INTEGER is the row's id
_TIME = sa.DateTime(timezone=True)

history = sa.Table(
    "history",
    metadata,
    sa.Column("name", sa.Text, primary_key=True),
    sa.Column("value", sa.Text, nullable=False),
)
events = sa.Table(
    "events",
    metadata,
    sa.Column(ID, _INTEGER, primary_key=True, autoincrement=False),
    sa.Column("cycle_id", _INTEGER, nullable=False),
    sa.Column(TIME, _TIME, nullable=False, index=True),
    *(sa.Column(name, sa.Text, nullable=False) for name in ("kind", "who", "code", "text")),
    sa.Column("details", sa.Text, nullable=False),
)


def cycles_table(columns: Sequence[Column], first: int) -> sa.Table:
    """Return a table for cycles from an id on."""
    return sa.Table(
        CYCLES,
        sa.MetaData(),
        sa.Column(ID, _INTEGER, primary_key=True, autoincrement=False),
        sa.Column(TIME, _TIME, nullable=False),
        *(sa.Column(column.name, _TYPES[column.kind]) for column in columns),
        sa.Index(f"cycles_time_{first}", TIME),
    )


def named(name: str) -> sa.TableClause:
    """Return a table of cycles by its name."""
    return sa.table(name, sa.column(ID, _INTEGER), sa.column(TIME, _TIME))


def stored_table(connection: sa.Connection, name: str) -> sa.Table:
    """Return a table of cycles as it is in the database."""
    return sa.Table(name, sa.MetaData(), autoload_with=connection)


def cycle_tables(connection: sa.Connection) -> list[str]:
    """Return the names of the tables with cycles, in the order of recording."""
    names = sa.inspect(connection).get_table_names()
    before = [name for name in names if name.startswith(BEFORE)]
    before.sort(key=lambda name: int(name.removeprefix(BEFORE)))
    return before + [CYCLES] * (CYCLES in names)


def known_of(connection: sa.Connection) -> dict[str, str]:
    """Return what is known of the whole history."""
    return {row.name: row.value for row in connection.execute(sa.select(history))}


def is_history(connection: sa.Connection, where: str) -> bool:
    """Return whether a database has a history; refuse one that another program has written."""
    names = sa.inspect(connection).get_table_names()
    if _EARLIER in names:
        raise ConfigurationError("history_earlier", file=where)
    if history.name not in names:
        return False
    found = known_of(connection).get("version", "")
    if found != VERSION:
        raise ConfigurationError("history_version", found=found, known=VERSION, file=where)
    return True


def rows(
    connection: sa.Connection,
    name: str,
    ids: tuple[int, int],
    span: tuple[datetime | None, datetime | None] = (None, None),
    columns: Sequence[str] | None = None,
) -> "Iterator[pl.DataFrame]":
    """Yield rows in the order of recording, some at a time; first a frame with none.

    Ids are those of the first and the last row; ids and times come with the columns that are
    wanted, where the table has them.
    """
    import polars as pl  # noqa: PLC0415 - the loop's own process does without

    table = stored_table(connection, name)
    wanted = [c for c in table.c if columns is None or c.name in {ID, TIME, *columns}]
    query = sa.select(*wanted).where(table.c[ID].between(*ids)).order_by(table.c[ID])
    first, last = span
    if first is not None:
        query = query.where(table.c[TIME] >= first)
    if last is not None:
        query = query.where(table.c[TIME] < last)
    schema = {c.name: _dtype_of(c) for c in wanted}
    yield pl.DataFrame(schema=schema)
    yield from pl.read_database(
        query.execution_options(stream_results=True),
        connection,
        iter_batches=True,
        batch_size=_ROWS_AT_ONCE,
        schema_overrides=schema,
    )


def _dtype_of(column: "sa.Column[Any]") -> "pl.DataType":
    import polars as pl  # noqa: PLC0415 - see above

    if isinstance(column.type, sa.DateTime):
        return pl.Datetime("us", "UTC")
    if isinstance(column.type, sa.Boolean):
        return pl.Boolean()
    if isinstance(column.type, sa.Integer):
        return pl.Int64()
    return pl.String() if isinstance(column.type, sa.Text) else pl.Float64()
