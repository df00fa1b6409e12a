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

from collections.abc import Sequence
from datetime import datetime
from typing import TYPE_CHECKING, Any, Final, cast

import sqlalchemy as sa

from thermaxis.codes import Place
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
ORDERED: Final = "ordered_id"
"""Name under which `history` has the id of the last cycle that was to be put in a file."""
CLOSED_IN: Final = "closed_in"
"""Name of the folder of the last file."""
_EARLIER = "thermaxis_version"
_BEFORE = "cycles_until_"
_ROWS_AT_ONCE = 2000
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


def named(name: str, *columns: str) -> sa.TableClause:
    """Return a table of cycles by its name."""
    return sa.table(name, sa.column(ID, _INTEGER), sa.column(TIME, _TIME), *map(sa.column, columns))


def stored_table(connection: sa.Connection, name: str) -> sa.Table:
    """Return a table of cycles as it is in the database."""
    return sa.Table(name, sa.MetaData(), autoload_with=connection)


def cycle_tables(connection: sa.Connection) -> list[str]:
    """Return the names of the tables with cycles, in the order of recording."""
    names = sa.inspect(connection).get_table_names()
    before = [name for name in names if name.startswith(_BEFORE)]
    before.sort(key=lambda name: int(name.removeprefix(_BEFORE)))
    return before + [CYCLES] * (CYCLES in names)


def table_before(next_id: int) -> str:
    """Return what a table is called that has the cycles before an id."""
    return f"{_BEFORE}{next_id}"


def known_of(connection: sa.Connection) -> dict[str, str]:
    """Return what is known of the whole history."""
    return {row.name: row.value for row in connection.execute(sa.select(history))}


def is_history(connection: sa.Connection, where: str) -> bool:
    """Return whether a database has a history; refuse one that another program has written."""
    names = sa.inspect(connection).get_table_names()
    if _EARLIER in names:
        raise ConfigurationError("history_earlier", place=Place(where))
    if history.name not in names:
        return False
    found = known_of(connection).get("version", "")
    if found != VERSION:
        raise ConfigurationError("history_version", found=found, known=VERSION, place=Place(where))
    return True


def make_tables(connection: sa.Connection, where: str) -> None:
    """Make the tables where there are none."""
    if not is_history(connection, where):
        metadata.create_all(connection)
        connection.execute(sa.insert(history).values(name="version", value=VERSION))


# ---- rows as frames -----------------------------------------------------------------------------


def read_rows(
    connection: sa.Connection,
    name: str,
    *,
    ids: tuple[int, int],
    span: tuple[datetime | None, datetime | None] = (None, None),
    columns: Sequence[str] | None = None,
    bare: bool = False,
) -> "pl.DataFrame":
    """Return rows in the order of recording; ids and times of columns are always among them.

    Parameters
    ----------
    connection : sqlalchemy.Connection
        The database.
    name : str
        Table.
    ids : tuple of int
        Ids of the first and the last row that may be returned. [1]
    span : tuple of datetime
        Begin, and end that is not included.
    columns : sequence of str, optional
        Columns that are wanted where the table has them. Default: all.
    bare : bool
        Whether the columns alone are wanted, and no row. Default: no.

    Returns
    -------
    polars.DataFrame
        The rows.
    """
    import polars as pl  # noqa: PLC0415 - the loop's own process does without

    table = stored_table(connection, name)
    wanted = [c for c in table.c if columns is None or c.name in {ID, TIME, *columns}]
    query = sa.select(*wanted).order_by(table.c[ID]).limit(_ROWS_AT_ONCE)
    first, last = span
    if first is not None:
        query = query.where(table.c[TIME] >= first)
    if last is not None:
        query = query.where(table.c[TIME] < last)
    schema = {c.name: _dtype_of(c) for c in wanted}
    frames = [pl.DataFrame(schema=schema)]
    before = ids[0] - 1
    while True:
        more = query.where(table.c[ID].between(before + 1, ids[1]))
        rows: Sequence[sa.Row[Any]] = () if bare else connection.execute(more).all()
        if not rows:
            return pl.concat(frames).with_columns(pl.col(TIME).dt.replace_time_zone("UTC"))
        before = cast("int", rows[-1][0])
        frames.append(
            pl.DataFrame(
                [
                    pl.Series(name, _plain(name, values), dtype)
                    for (name, dtype), values in zip(
                        schema.items(), zip(*rows, strict=True), strict=True
                    )
                ]
            )
        )


def _plain(name: str, values: tuple[Any, ...]) -> Sequence[Any]:
    """Return times as polars takes them: UTC without saying so."""
    if name != TIME or values[0].tzinfo is None:
        return values
    return [value.replace(tzinfo=None) for value in values]


def _dtype_of(column: "sa.Column[Any]") -> "pl.DataType":
    import polars as pl  # noqa: PLC0415 - see above

    if isinstance(column.type, sa.DateTime):
        return pl.Datetime("us")
    if isinstance(column.type, sa.Boolean):
        return pl.Boolean()
    if isinstance(column.type, sa.Integer):
        return pl.Int64()
    return pl.String() if isinstance(column.type, sa.Text) else pl.Float64()
