"""What is known of every machine, in SQLite or PostgreSQL: the only durable state of a fleet.

============  =====================================================================================
``registry``  what is known of the whole, by name: version of the tables, lake
``machines``  name, kind, sensor map, and the model in force
``models``    every model that was ever in force, with its parent and why; none is changed
``nights``    what a night has found; once for machine, day, model and version of the program
``proposals`` models that nights have proposed, once for machine, parent and model
``decisions`` who has accepted or rejected one, when and why; the first decision stands
============  =====================================================================================

Unique keys decide between programs that write at once: the first one is kept.
"""

import json
import sqlite3
from collections.abc import Generator, Iterable, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from datetime import UTC, date, datetime
from typing import Any, Final, Self, final

import sqlalchemy as sa
from sqlalchemy.dialects import postgresql, sqlite
from sqlalchemy.exc import DBAPIError, SQLAlchemyError

from thermaxis import __version__
from thermaxis.codes import Place
from thermaxis.errors import ConfigurationError, DataError
from thermaxis.files import format_model, model_sha256
from thermaxis.fleet._night import NightResult, night_as_json
from thermaxis.runtime.history import check_url, printable_cause, writing_engine

VERSION: Final = 2
"""Version of the tables that this program writes."""
_ALTERATIONS: Final[Mapping[int, Sequence[str]]] = {}
"""What makes tables of the version before those of a version, beside new tables."""
_LOCK_KEY: Final = 0x7468_6572_666C_6565  # "therflee"
_ID = sa.BigInteger().with_variant(sa.Integer(), "sqlite")
_MOMENT = sa.DateTime(timezone=True)

metadata = sa.MetaData()
_registry = sa.Table(
    "registry",
    metadata,
    sa.Column("name", sa.Text, primary_key=True),
    sa.Column("value", sa.Text, nullable=False),
)
_machines = sa.Table(
    "machines",
    metadata,
    sa.Column("id", _ID, primary_key=True),
    sa.Column("name", sa.Text, nullable=False, unique=True),
    sa.Column("kind", sa.Text, nullable=False),
    sa.Column("channels", sa.Text, nullable=False),
    sa.Column("model_sha256", sa.Text, nullable=False),
    sa.Column("added_utc", _MOMENT, nullable=False),
)
_models = sa.Table(
    "models",
    metadata,
    sa.Column("id", _ID, primary_key=True),
    sa.Column("machine_id", _ID, sa.ForeignKey("machines.id"), nullable=False),
    sa.Column("sha256", sa.Text, nullable=False),
    sa.Column("parent_sha256", sa.Text),
    sa.Column("why", sa.Text, nullable=False),
    sa.Column("content", sa.Text, nullable=False),
    sa.Column("added_utc", _MOMENT, nullable=False),
    sa.UniqueConstraint("machine_id", "sha256"),
)
_nights = sa.Table(
    "nights",
    metadata,
    sa.Column("id", _ID, primary_key=True),
    sa.Column("machine_id", _ID, sa.ForeignKey("machines.id"), nullable=False),
    sa.Column("day", sa.Date, nullable=False, index=True),
    sa.Column("model_sha256", sa.Text, nullable=False),
    sa.Column("version", sa.Text, nullable=False),
    sa.Column("outcome", sa.Text, nullable=False),
    sa.Column("result", sa.Text, nullable=False),
    sa.Column("added_utc", _MOMENT, nullable=False),
    sa.UniqueConstraint("machine_id", "day", "model_sha256", "version"),
)
_proposals = sa.Table(
    "proposals",
    metadata,
    sa.Column("id", _ID, primary_key=True),
    sa.Column("machine_id", _ID, sa.ForeignKey("machines.id"), nullable=False),
    sa.Column("parent_sha256", sa.Text, nullable=False),
    sa.Column("sha256", sa.Text, nullable=False),
    sa.Column("day", sa.Date, nullable=False),
    sa.Column("content", sa.Text, nullable=False),
    sa.Column("added_utc", _MOMENT, nullable=False),
    sa.UniqueConstraint("machine_id", "parent_sha256", "sha256"),
)
_decisions = sa.Table(
    "decisions",
    metadata,
    sa.Column("id", _ID, primary_key=True),
    sa.Column("proposal_id", _ID, sa.ForeignKey("proposals.id"), nullable=False, unique=True),
    sa.Column("accepted", sa.Boolean, nullable=False),
    sa.Column("who", sa.Text, nullable=False),
    sa.Column("why", sa.Text, nullable=False),
    sa.Column("added_utc", _MOMENT, nullable=False),
)


@final
@dataclass(frozen=True, slots=True)
class FleetMachine:
    """A machine of the fleet."""

    name: str
    """Its name, as its folder in the lake has it."""
    kind: str
    """Machines of one kind are sisters."""
    model: str
    """The model in force, as the text of its file."""
    model_sha256: str
    """Its hash."""
    channels: Mapping[str, str] = field(default_factory=dict[str, str])
    """Column of its history by channel or output of the model, where it has another name."""


@final
@dataclass(frozen=True, slots=True)
class StoredModel:
    """A model that is or was in force."""

    sha256: str
    """Its hash."""
    parent_sha256: str | None
    """Hash of the one before it; None for the first."""
    why: str
    """Why it was taken."""
    added_utc: datetime
    """When."""


@final
@dataclass(frozen=True, slots=True)
class StoredNight:
    """A night of a machine."""

    machine: str
    """Its name."""
    kind: str
    """Its kind."""
    day: date
    """The day that was looked at."""
    model_sha256: str
    """The model that was in force."""
    version: str
    """Version of the program."""
    result: Mapping[str, object]
    """What it has found, as JSON."""


@final
@dataclass(frozen=True, slots=True)
class StoredProposal:
    """A model that a night has proposed, and what became of it."""

    sha256: str
    """Its hash."""
    parent_sha256: str
    """Hash of the model that it is to replace."""
    day: date
    """Day of the night."""
    content: str
    """The model, as the text of its file."""
    accepted: bool | None
    """What a person has decided; None while nobody has."""
    who: str | None
    """Who."""
    why: str | None
    """Why."""


@final
class Registry:
    """A registry, opened. Used by one thread, closed with `close` or ``with``.

    Parameters
    ----------
    url : str
        ``sqlite:///FILE`` or ``postgresql+psycopg://user@host/database``.
    password : str
        Password of the database's user.

    Raises
    ------
    ConfigurationError
        If the URL is wrong, or the tables are of another version.
    DataError
        If the database cannot be reached, or has no registry.
    """

    def __init__(self, url: str, password: str = "") -> None:
        self._place = _checked(url, made=True)
        self._engine = writing_engine(url, password)
        with self._asked() as connection:
            known = _known(connection)
            found = int(known.get("version", "0"))
            if not found:
                raise DataError("no_registry", place=self._place)
            if found != VERSION:
                _refuse_newer(found, self._place)
                place = self._place
                raise ConfigurationError("registry_older", found=found, known=VERSION, place=place)
        self.lake = known["lake"]
        """Its lake."""

    @classmethod
    def make(cls, url: str, lake: str, password: str = "") -> Self:
        """Make the tables that are missing, or those of this version of older ones, and open them.

        Nothing of what is there is lost; the lake is the one that is stated.
        """
        place = _checked(url, made=False)
        engine = writing_engine(url, password)
        try:
            with _errors_named(place), engine.begin() as connection:
                if connection.dialect.name == "postgresql":  # one at a time; SQLite has begun so
                    lock = sa.func.pg_advisory_xact_lock(_LOCK_KEY)
                    connection.execute(sa.select(lock)).all()
                found = int(_known(connection).get("version", VERSION))
                _refuse_newer(found, place)
                for version in range(found + 1, VERSION + 1):
                    for statement in _ALTERATIONS.get(version, ()):
                        connection.execute(sa.text(statement))
                metadata.create_all(connection)
                for name, value in (("version", str(VERSION)), ("lake", lake)):
                    connection.execute(sa.delete(_registry).where(_registry.c.name == name))
                    connection.execute(sa.insert(_registry).values(name=name, value=value))
        finally:
            engine.dispose()
        return cls(url, password)

    def __enter__(self) -> Self:
        """Return itself."""
        return self

    def __exit__(self, *_: object) -> None:
        """Close it."""
        self.close()

    def close(self) -> None:
        """Close it."""
        self._engine.dispose()

    @contextmanager
    def _asked(self) -> Generator[sa.Connection]:
        with _errors_named(self._place), self._engine.begin() as connection:
            yield connection

    # ---- machines -------------------------------------------------------------------------------

    def add(self, machine: FleetMachine, why: str) -> bool:
        """Add a machine, or give one another kind, sensor map and model; return whether it is new.

        A model that was in force before, too, keeps the parent and the reason that it had.
        """
        now = datetime.now(UTC)
        changed = {
            "kind": machine.kind,
            "channels": json.dumps(dict(machine.channels)),
            "model_sha256": machine.model_sha256,
        }
        with self._asked() as connection:
            row = {"name": machine.name, "added_utc": now, **changed}
            new = _inserted(connection, _machines, [row]) == 1
            own = sa.select(_machines).where(_machines.c.name == machine.name)
            before = connection.execute(own).one()
            model = {
                "machine_id": before.id,
                "sha256": machine.model_sha256,
                "parent_sha256": None if new else before.model_sha256,
                "content": machine.model,
                "why": why,
                "added_utc": now,
            }
            _inserted(connection, _models, [model])
            if not new:
                query = sa.update(_machines).where(_machines.c.id == before.id)
                connection.execute(query.values(**changed))
        return new

    def machines(self, names: Sequence[str] = ()) -> list[FleetMachine]:
        """Return machines by name, all of them where none is named.

        Raises
        ------
        ConfigurationError
            If one is not known.
        """
        c = _machines.c
        both = (_models.c.machine_id == c.id) & (_models.c.sha256 == c.model_sha256)
        query = (
            sa.select(c.name, c.kind, _models.c.content, c.model_sha256, c.channels)
            .join(_models, both)
            .order_by(c.name)
        )
        with self._asked() as connection:
            rows = connection.execute(query).all()
        every = [FleetMachine(*row[:4], channels=json.loads(row[4])) for row in rows]
        known = {machine.name: machine for machine in every}
        for name in names:
            if name not in known:
                raise ConfigurationError(
                    "unknown_name", name=name, known=", ".join(known), place=self._place
                )
        return [known[name] for name in names] or every

    def models(self, machine: str) -> list[StoredModel]:
        """Return the models of a machine, the first one first."""
        c = _models.c
        query = (
            sa.select(c.sha256, c.parent_sha256, c.why, c.added_utc)
            .join(_machines, _machines.c.id == c.machine_id)
            .where(_machines.c.name == machine)
            .order_by(c.id)
        )
        with self._asked() as connection:
            return [StoredModel(*row[:3], _utc(row[3])) for row in connection.execute(query)]

    # ---- nights ---------------------------------------------------------------------------------

    def missing(self, day: date) -> list[FleetMachine]:
        """Return the machines of which this program has not stored the night of their model."""
        night, c = _nights.c, _machines.c
        done = sa.select(c.name).join(
            _nights,
            (night.machine_id == c.id)
            & (night.model_sha256 == c.model_sha256)
            & (night.day == day)
            & (night.version == __version__),
        )
        with self._asked() as connection:
            names = set(connection.execute(done).scalars())
        return [machine for machine in self.machines() if machine.name not in names]

    def record(self, results: Iterable[NightResult]) -> int:
        """Store nights, all or nothing; return how many nobody had stored before. [1]"""
        every, now = list(results), datetime.now(UTC)
        c = _machines.c
        with self._asked() as connection:
            named = c.name.in_({result.machine for result in every})
            ids = {
                row.name: row.id for row in connection.execute(sa.select(c.name, c.id).where(named))
            }
            known = [(ids[result.machine], result) for result in every if result.machine in ids]
            proposed = [
                {
                    "machine_id": machine_id,
                    "parent_sha256": result.model_sha256,
                    "sha256": model_sha256(result.proposal),
                    "day": result.day,
                    "content": format_model(result.proposal),
                    "added_utc": now,
                }
                for machine_id, result in known
                if result.proposal is not None
            ]
            _inserted(connection, _proposals, proposed)
            rows = [
                {
                    "machine_id": machine_id,
                    "day": result.day,
                    "model_sha256": result.model_sha256,
                    "version": __version__,
                    "outcome": str(result.outcome),
                    "result": json.dumps(night_as_json(result), allow_nan=False),
                    "added_utc": now,
                }
                for machine_id, result in known
            ]
            return _inserted(connection, _nights, rows)

    def nights(self, day: date | None = None, machine: str | None = None) -> list[StoredNight]:
        """Return nights of a day or of a machine, in the order of days and names."""
        night, c = _nights.c, _machines.c
        query = sa.select(
            *(c.name, c.kind, night.day, night.model_sha256, night.version, night.result)
        ).join(_machines, c.id == night.machine_id)
        if day is not None:
            query = query.where(night.day == day)
        if machine is not None:
            query = query.where(c.name == machine)
        with self._asked() as connection:
            rows = connection.execute(query.order_by(night.day, c.name, night.id)).all()
        return [StoredNight(*row[:5], result=json.loads(row[5])) for row in rows]

    def last_day(self) -> date | None:
        """Return the newest day that has a night, None without any."""
        with self._asked() as connection:
            return connection.execute(sa.select(sa.func.max(_nights.c.day))).scalar_one()

    # ---- proposals ------------------------------------------------------------------------------

    def proposals(self, machine: str) -> list[StoredProposal]:
        """Return what was proposed for a machine, the first one first."""
        with self._asked() as connection:
            rows: Sequence[Any] = connection.execute(_of_machine(machine)).all()
        return [StoredProposal(*row[1:]) for row in rows]

    def decide(self, machine: str, *, accepted: bool, who: str, why: str) -> StoredProposal:
        """Accept or reject the newest proposal for the model that a machine has in force.

        Nothing changes on a machine, nor what is in force here: that is what the machine has.

        Raises
        ------
        ConfigurationError
            If there is none, or it was decided on already.
        """
        (known,) = self.machines([machine])
        decision = {"accepted": accepted, "who": who, "why": why, "added_utc": datetime.now(UTC)}
        with self._asked() as connection:
            rows: Sequence[Any] = connection.execute(_of_machine(machine)).all()
            found = [row for row in rows if row.parent_sha256 == known.model_sha256]
            if not found:
                raise ConfigurationError("no_proposal", name=machine, place=self._place)
            row = {"proposal_id": found[-1].id, **decision}
            if not _inserted(connection, _decisions, [row]):
                raise ConfigurationError("proposal_decided", name=machine, place=self._place)
        return replace(StoredProposal(*found[-1][1:]), accepted=accepted, who=who, why=why)


def _of_machine(name: str) -> Any:
    c, d = _proposals.c, _decisions.c
    return (
        sa.select(c.id, c.sha256, c.parent_sha256, c.day, c.content, d.accepted, d.who, d.why)
        .join(_machines, _machines.c.id == c.machine_id)
        .outerjoin(_decisions, d.proposal_id == c.id)
        .where(_machines.c.name == name)
        .order_by(c.id)
    )


def _checked(url: str, *, made: bool) -> Place:
    path = check_url(url, key="REGISTRY")
    if made and path is not None and not path.is_file():
        raise ConfigurationError("file_not_found", place=Place(str(path)))
    if path is not None and not path.absolute().parent.is_dir():
        raise ConfigurationError("folder_not_found", place=Place(str(path.parent)))
    return Place(str(path or url))


def _known(connection: sa.Connection) -> dict[str, str]:
    if not sa.inspect(connection).has_table(_registry.name):
        return {}
    return {row.name: row.value for row in connection.execute(sa.select(_registry))}


def _refuse_newer(found: int, place: Place) -> None:
    if found > VERSION:
        raise ConfigurationError("registry_newer", found=found, known=VERSION, place=place)


def _inserted(connection: sa.Connection, table: sa.Table, rows: Sequence[dict[str, Any]]) -> int:
    """Insert rows that no unique key refuses; return their number."""
    dialects = {"sqlite": sqlite.insert, "postgresql": postgresql.insert}
    if not rows:
        return 0
    query = dialects[connection.dialect.name](table).on_conflict_do_nothing()
    return len(connection.execute(query.returning(table.c.id), rows).all())


@contextmanager
def _errors_named(place: Place) -> Generator[None]:
    try:
        yield
    except (SQLAlchemyError, sqlite3.Error) as error:
        cause = error.orig if isinstance(error, DBAPIError) else error
        text = printable_cause(cause or error)
        raise DataError("registry_out_of_reach", cause=text, place=place) from error


def _utc(moment: datetime) -> datetime:
    return moment.replace(tzinfo=UTC) if moment.tzinfo is None else moment.astimezone(UTC)
