"""What is known of every machine, in SQLite or PostgreSQL: the only durable state of a fleet.

============  =====================================================================================
``registry``  what is known of the whole, by name: version of the tables, lake, day judged last
``machines``  name, kind, sensor map, and the model in force
``formerly``  other names by which a machine was known, or under which it was merged
``models``    every model that was ever in force, with its parent and why; none is changed
``nights``    what a night has found; once for machine, day, model and version of the program
``judged``    what the nights of a day say of each machine that is named; made anew with them
``proposals`` models that nights have proposed, once for machine, parent and model
``decisions`` who has accepted or rejected one, when and why; the first decision stands
``steps``     what became of an accepted one: fetched, in force, withdrawn; each once
``axis_runs`` positioning runs of axes over the years, each file once
============  =====================================================================================

Unique keys decide between programs that write at once: the first one is kept.
"""

import json
import sqlite3
from collections.abc import Generator, Iterable, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from datetime import UTC, date, datetime, timedelta
from enum import StrEnum
from operator import attrgetter
from typing import Any, Final, Self, final

import sqlalchemy as sa
from sqlalchemy.dialects import postgresql, sqlite
from sqlalchemy.exc import DBAPIError, SQLAlchemyError

from thermaxis import __version__
from thermaxis.codes import Place
from thermaxis.compensation import CompensationModel
from thermaxis.errors import ConfigurationError, DataError
from thermaxis.files import format_model, model_sha256
from thermaxis.fleet._axes import AxisRun, axis_run_as_json, axis_run_of_json
from thermaxis.fleet._judging import (
    JUDGED_DAYS,
    SENSOR_CAUSES,
    Judgement,
    judge,
    judgement_as_json,
    judgement_of_json,
    surest_first,
)
from thermaxis.fleet._night import NightOutcome, NightResult, StoredNight, night_as_json
from thermaxis.runtime.history import check_url, printable_cause, writing_engine

VERSION: Final = 3
"""Version of the tables that this program writes."""
_ALTERATIONS: Final[Mapping[int, Sequence[str]]] = {
    3: ["ALTER TABLE nights ADD COLUMN last_id BIGINT NOT NULL DEFAULT 0"]
}
"""What makes tables of the version before those of a version, beside new tables."""
_LAST_JUDGED: Final = "last_judged"
_LOCK_KEY: Final = 0x7468_6572_666C_6565  # "therflee"
_ID = sa.BigInteger().with_variant(sa.Integer(), "sqlite")
_MOMENT = sa.DateTime(timezone=True)

metadata = sa.MetaData()


def _texts(*names: str) -> list[sa.Column[str]]:
    return [sa.Column(name, sa.Text, nullable=False) for name in names]


def _of(table: str) -> sa.Column[int]:
    return sa.Column(f"{table}_id", _ID, sa.ForeignKey(f"{table}s.id"), nullable=False)


def _day() -> sa.Column[date]:
    return sa.Column("day", sa.Date, nullable=False)


def _table(name: str, *columns: sa.schema.SchemaItem) -> sa.Table:
    """Return a table whose rows have a number and the time at which they were added."""
    added = sa.Column("added_utc", _MOMENT, nullable=False)
    return sa.Table(name, metadata, sa.Column("id", _ID, primary_key=True), *columns, added)


def _named(table: str, column: sa.Column[Any]) -> sa.Table:
    return sa.Table(table, metadata, sa.Column("name", sa.Text, primary_key=True), column)


_registry = _named("registry", sa.Column("value", sa.Text, nullable=False))
_formerly = _named("formerly", _of("machine"))
_machines = _table(
    "machines", *_texts("name", "kind", "channels", "model_sha256"), sa.UniqueConstraint("name")
)
_models = _table(
    "models",
    _of("machine"),
    *_texts("sha256", "why", "content"),
    sa.Column("parent_sha256", sa.Text),
    sa.UniqueConstraint("machine_id", "sha256"),
)
_nights = _table(
    "nights",
    _of("machine"),
    _day(),
    *_texts("model_sha256", "version", "outcome", "result"),
    sa.Column("last_id", sa.BigInteger, nullable=False, server_default="0"),
    sa.UniqueConstraint("machine_id", "day", "model_sha256", "version"),
    sa.Index("ix_nights_day", "day"),
)
_judged = sa.Table(
    "judged",
    metadata,
    sa.Column("id", _ID, primary_key=True),
    _of("machine"),
    _day(),
    *_texts("judgement"),
    sa.UniqueConstraint("machine_id", "day"),
    sa.Index("ix_judged_day", "day"),
)
_proposals = _table(
    "proposals",
    _of("machine"),
    _day(),
    *_texts("parent_sha256", "sha256", "content"),
    sa.UniqueConstraint("machine_id", "parent_sha256", "sha256"),
)
_decisions = _table(
    "decisions",
    _of("proposal"),
    sa.Column("accepted", sa.Boolean, nullable=False),
    *_texts("who", "why"),
    sa.UniqueConstraint("proposal_id"),
)
_steps = _table(
    "steps",
    _of("proposal"),
    *_texts("step", "who", "why"),
    sa.UniqueConstraint("proposal_id", "step"),
)
_axis_runs = _table(
    "axis_runs",
    _of("machine"),
    *_texts("axis", "sha256", "result"),
    sa.Column("start_utc", _MOMENT, nullable=False),
    sa.UniqueConstraint("sha256"),
    sa.UniqueConstraint("machine_id", "axis", "start_utc"),
)


@final
class ProposalState(StrEnum):
    """What has become of a proposal; of an accepted one what was reached last."""

    OPEN = "open"
    """Nobody has decided on what the newest night proposes."""
    SUPERSEDED = "superseded"
    """Nobody has decided, and a newer night or model has made it old, or an accepted model is on
    its way."""
    REJECTED = "rejected"
    """A person has rejected it."""
    ACCEPTED = "accepted"
    """A person has accepted it: it may be fetched."""
    FETCHED = "fetched"
    """It lies in the machine's folder of models, or is about to."""
    IN_FORCE = "in_force"
    """The machine has had it in force."""
    WITHDRAWN = "withdrawn"
    """A person has taken it back."""


ADDED: Final = "added"
"""Why a model is in force, where nobody says it."""
IN_FORCE: Final = "in force at the machine"
"""Why another one is, of which the registry learns by a fetch."""


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
    formerly: tuple[str, ...] = ()
    """Other names by which it was known."""


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
class StoredProposal:
    """A model that a night has proposed, and what became of it."""

    machine: str
    """Name of the machine."""
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
    state: ProposalState = ProposalState.OPEN
    """What has become of it."""
    withdrawn: tuple[str, str] | None = None
    """Who has withdrawn it, and why."""
    decided_utc: datetime | None = None
    """When it was decided on."""


@final
@dataclass(frozen=True, slots=True)
class Standing:
    """How a machine stands."""

    machine: str
    """Its name."""
    kind: str
    """Its kind."""
    night: StoredNight | None
    """Its newest night; None without any."""
    proposed_sha256: str | None
    """Hash of the newest proposal for its model, where it waits for a decision."""
    model_sha256: str = ""
    """Hash of the model in force."""


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
        self._url, self._place = url, _checked(url, made=True)
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
    def make(cls, url: str, lake: str, password: str = "", *, move_lake: bool = False) -> Self:
        """Make the tables that are missing, or those of this version of older ones, and open them.

        Nothing of what is there is lost.

        Raises
        ------
        ConfigurationError
            If it is there with another lake, and this one is not to take its place.
        """
        place = _checked(url, made=False)
        engine = writing_engine(url, password)
        try:
            with _errors_named(place), engine.begin() as connection:
                if connection.dialect.name == "postgresql":  # one at a time; SQLite has begun so
                    lock = sa.func.pg_advisory_xact_lock(_LOCK_KEY)
                    connection.execute(sa.select(lock)).all()
                known = _known(connection)
                found = int(known.get("version", VERSION))
                _refuse_newer(found, place)
                former = known.get("lake", lake)
                if former != lake and not move_lake:
                    raise ConfigurationError("lake_differs", known=former, place=place)
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
        _checked(self._url, made=True)  # a file that was moved away is not made anew, empty
        with _errors_named(self._place), self._engine.begin() as connection:
            yield connection

    # ---- machines -------------------------------------------------------------------------------

    def add(self, machine: FleetMachine, why: str) -> bool:
        """Add a machine, or give one another kind, sensor map and model; return whether it is new.

        A model that was in force before, too, keeps the parent and the reason that it had.

        Raises
        ------
        ConfigurationError
            If the machine has another name by now.
        """
        now = datetime.now(UTC)
        changed = {
            "kind": machine.kind,
            "channels": json.dumps(dict(machine.channels)),
            "model_sha256": machine.model_sha256,
        }
        with self._asked() as connection:
            now_called = _renamed(connection).get(machine.name)
            if now_called is not None:
                raise ConfigurationError(
                    "machine_renamed", name=machine.name, other=now_called, place=self._place
                )
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
                sha256 = machine.model_sha256
                _step(connection, machine.name, ProposalState.IN_FORCE, machine.name, "", sha256)
        return new

    def report(self, machine: str, model: CompensationModel) -> str | None:
        """Take note of the model that a machine has in force; return another one's hash, as known.

        It is None where that model was known.

        Raises
        ------
        ConfigurationError
            If the machine is not known, or the model is known as another machine's alone.
        """
        (known,) = self.machines([machine])
        told = replace(known, model=format_model(model), model_sha256=model_sha256(model))
        if told.model_sha256 == known.model_sha256:
            return None
        known_as = {one.sha256: one.why for one in self.proposals(machine) if one.accepted}
        query = sa.select(_machines.c.name).join(_models)
        with self._asked() as connection:
            renamed = _renamed(connection)
            query = query.where(_models.c.sha256 == told.model_sha256)
            names: Sequence[str] = connection.execute(query).scalars().all()
        others = {renamed.get(name, name) for name in names}
        if others and known.name not in others and told.model_sha256 not in known_as:
            raise ConfigurationError(
                "model_of_other_machine", name=machine, other=min(others), place=self._place
            )
        self.add(told, known_as.get(told.model_sha256) or IN_FORCE)
        return known.model_sha256

    def rename(self, former: str, name: str) -> bool:
        """Give a machine another name; return whether another one has it and takes its place.

        What is stored goes on under the other name. Where a machine has that already, the two are
        one: it keeps what is stored of it, and what is stored of the former stays under its own.

        Raises
        ------
        ConfigurationError
            If no machine has the former name, or the other is a former one of a third machine.
        """
        (known,) = self.machines([former])
        former = known.name
        if former == name:
            return False
        c, f = _machines.c, _formerly.c
        with self._asked() as connection:
            every = sa.select(c.name, c.id).where(c.name.in_([former, name]))
            ids = {row.name: row.id for row in connection.execute(every)}
            third = _renamed(connection).get(name, former)
            if third != former:
                raise ConfigurationError(
                    "machine_renamed", name=name, other=third, place=self._place
                )
            merged = name in ids
            if not merged:
                connection.execute(sa.update(_machines).where(c.name == former).values(name=name))
            kept = {"machine_id": ids.get(name, ids.get(former))}
            own = f.machine_id == ids.get(former)
            connection.execute(sa.update(_formerly).where(own).values(**kept))
            connection.execute(sa.delete(_formerly).where(f.name.in_([former, name])))
            connection.execute(sa.insert(_formerly).values(name=former, **kept))
        return merged

    def machines(self, names: Sequence[str] = ()) -> list[FleetMachine]:
        """Return machines by name, also by a former one, all of them where none is named.

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
            .where(_alive())
            .order_by(c.name)
        )
        with self._asked() as connection:
            renamed = _renamed(connection)
            names = [renamed.get(name, name) for name in names]
            rows = connection.execute(query.where(c.name.in_(names)) if names else query).all()
            missing = sorted({*names} - {row.name for row in rows})
            if missing:
                every = connection.execute(sa.select(c.name).where(_alive()).order_by(c.name))
                registered = ", ".join(every.scalars()) or "none"
                raise ConfigurationError(
                    "unknown_name", name=missing[0], known=registered, place=self._place
                )
        formerly: dict[str, list[str]] = {}
        for former, name in renamed.items():
            formerly.setdefault(name, []).append(former)
        known = {
            row.name: FleetMachine(*row[:4], json.loads(row[4]), tuple(formerly.get(row.name, ())))
            for row in rows
        }
        return [known[name] for name in names or known]

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

    def missing(self, day: date, *, again: bool = False) -> list[FleetMachine]:
        """Return the machines of which this program has not stored the night of their model.

        Again: also those of which it was set aside.
        """
        stored = self.seen(day)
        done = {name for name, last_id in stored.items() if last_id or not again}
        return [machine for machine in self.machines() if machine.name not in done]

    def seen(self, day: date) -> dict[str, int]:
        """Return the last cycle of a day that this program's nights have seen, by machine. [1]"""
        night, c = _nights.c, _machines.c
        query = sa.select(c.name, night.last_id).join(
            _nights,
            (night.machine_id == c.id)
            & (night.model_sha256 == c.model_sha256)
            & (night.day == day)
            & (night.version == __version__),
        )
        with self._asked() as connection:
            return {row.name: row.last_id for row in connection.execute(query)}

    def record(self, results: Iterable[NightResult]) -> int:
        """Store nights, all or nothing; return how many are stored or take another one's place.

        The first one stays, unless one comes that has seen later cycles of the same day. [1]
        """
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
                    "last_id": result.last_id,
                    "added_utc": now,
                }
                for machine_id, result in known
            ]
            return _inserted(connection, _nights, rows, unless="last_id")

    def nights(self, day: date | None = None, machine: str | None = None) -> list[StoredNight]:
        """Return nights of a day or of a machine, in the order of days and names."""
        night, c = _nights.c, _machines.c
        query = sa.select(
            *(c.name, c.kind, night.day, night.model_sha256, night.version, night.result)
        ).join(_machines, c.id == night.machine_id)
        if day is not None:
            query = query.where(night.day == day)
        query = query.where(_alive() if machine is None else c.name == machine)
        with self._asked() as connection:
            rows = connection.execute(query.order_by(night.day, c.name, night.id)).all()
        return [_night_of(row) for row in rows]

    def standings(self, machine: str | None = None) -> list[Standing]:
        """Return how every machine stands, or one, by name."""
        night, c, own = _nights.c, _machines.c, _nights.alias().c
        newest = sa.select(own.id).where(own.machine_id == c.id)
        newest = newest.order_by(own.day.desc(), own.id.desc()).limit(1).scalar_subquery()
        query = (
            sa.select(
                *(c.name, c.kind, night.day, night.model_sha256, night.version, night.result),
                c.model_sha256,
            )
            .select_from(_machines)
            .outerjoin(_nights, night.id == newest)
            .order_by(c.name)
        )
        query = query.where(_alive() if machine is None else c.name == machine)
        with self._asked() as connection:
            rows = connection.execute(query).all()
            some = _proposals_of(connection, machine, in_force=True).values()
        proposed = {one.machine: one.sha256 for one in some if one.state is ProposalState.OPEN}
        return [
            Standing(
                *row[:2],
                night=_night_of(row) if row[2] else None,
                proposed_sha256=proposed.get(row.name),
                model_sha256=row[6],
            )
            for row in rows
        ]

    def last_day(self) -> date | None:
        """Return the newest day that has a night, None without any."""
        with self._asked() as connection:
            return connection.execute(sa.select(sa.func.max(_nights.c.day))).scalar_one()

    # ---- judgements -----------------------------------------------------------------------------

    def judge(self, day: date) -> list[Judgement]:
        """Judge every machine by the nights up to a day, and store who is named."""
        before = (day - timedelta(days=back) for back in range(JUDGED_DAYS - 1, -1, -1))
        every = judge((night for one in before for night in self.nights(one)), day)
        named = {one.machine: judgement_as_json(one) for one in every if one.named}
        with self._asked() as connection:
            query = sa.select(_machines.c.id, _machines.c.name)
            known = [(row.id, named.get(row.name)) for row in connection.execute(query)]
            rows = [
                {"machine_id": key, "day": day, "judgement": json.dumps(one, allow_nan=False)}
                for key, one in known
                if one is not None
            ]
            connection.execute(sa.delete(_judged).where(_judged.c.day == day))
            _inserted(connection, _judged, rows)
            name, value = _registry.c.name, _registry.c.value
            _inserted(connection, _registry, [{"name": _LAST_JUDGED, "value": day.isoformat()}])
            older = (name == _LAST_JUDGED) & (value < day.isoformat())
            connection.execute(sa.update(_registry).where(older).values(value=day.isoformat()))
        return every

    def last_judged(self) -> date | None:
        """Return the newest day that was judged, None without any: nights of one may come yet."""
        with self._asked() as connection:
            found = _known(connection).get(_LAST_JUDGED)
        return None if found is None else date.fromisoformat(found)

    def judgements(self, day: date | None = None, machine: str | None = None) -> list[Judgement]:
        """Return who was named on a day, the surest first, or when a machine was, by day."""
        query = sa.select(_judged.c.judgement, _machines.c.name)
        query = query.join(_machines, _machines.c.id == _judged.c.machine_id)
        query = query.where(_alive() if machine is None else _machines.c.name == machine)
        if day is not None:
            query = query.where(_judged.c.day == day)
        with self._asked() as connection:
            rows = connection.execute(query).all()
        found = (judgement_of_json(json.loads(row[0]) | {"machine": row[1]}) for row in rows)
        return sorted(found, key=lambda one: (one.day, surest_first(one)))

    # ---- proposals ------------------------------------------------------------------------------

    def proposals(self, machine: str | None = None) -> list[StoredProposal]:
        """Return what was proposed for a machine, or for all, the first one first."""
        with self._asked() as connection:
            return list(_proposals_of(connection, machine).values())

    def decide(
        self, machine: str, *, accepted: bool, who: str, why: str, sha256: str = ""
    ) -> StoredProposal:
        """Accept or reject what the newest night proposes for the model a machine has in force.

        With a hash, only if it is still that one: a person decides on what was seen.

        Nothing changes on a machine, nor what is in force here: that is what the machine has.

        Raises
        ------
        ConfigurationError
            If there is none, it was decided on already, an accepted one is on its way, or one is
            to be accepted while the machine is named for a sensor.
        """
        (known,) = self.machines([machine])
        machine, day = known.name, self.last_judged()
        named = () if day is None else self.judgements(day, machine)
        if accepted and any(not SENSOR_CAUSES.isdisjoint(one.causes) for one in named):
            raise ConfigurationError("sensors_first", name=machine, place=self._place)
        with self._asked() as connection:
            every = _proposals_of(connection, machine)
            is_open = [i for i, one in every.items() if one.state is ProposalState.OPEN]
            if not is_open or sha256 not in {"", every[is_open[0]].sha256}:
                same = [o for o in every.values() if o.parent_sha256 == known.model_sha256]
                decided = [o for o in same if o.decided_utc] if not is_open else []
                last = max(decided, key=attrgetter("decided_utc"), default=None)
                code = "no_proposal" if last is None else "proposal_decided"
                if last is not None and last.state is ProposalState.WITHDRAWN:
                    code = "proposal_withdrawn"
                raise ConfigurationError(code, name=machine, place=self._place)
            if not _decided(connection, is_open[0], accepted=accepted, who=who, why=why):
                raise ConfigurationError("proposal_decided", name=machine, place=self._place)
            return _proposals_of(connection, machine)[is_open[0]]

    def to_fetch(self, machine: str) -> StoredProposal | None:
        """Return what a machine is to fetch: what was accepted last, unless it was withdrawn.

        None, too, where the machine has had it in force.
        """
        accepted = [one for one in self.proposals(machine) if one.accepted]
        found = max(accepted, key=attrgetter("decided_utc"), default=None)
        return found if found is not None and found.state in _TO_FETCH else None

    def fetched(self, machine: str, sha256: str) -> bool:
        """Take note that a machine fetches what it was to fetch; return whether it still may."""
        with self._asked() as connection:
            _step(connection, machine, ProposalState.FETCHED, machine, "", sha256)
        found = self.to_fetch(machine)
        return found is not None and found.sha256 == sha256

    def withdraw(self, machine: str, *, who: str, why: str) -> list[StoredProposal]:
        """Withdraw what was accepted and is not in force yet, else what was and is in force.

        Returns
        -------
        list of StoredProposal
            What is withdrawn, as it was before.

        Raises
        ------
        ConfigurationError
            If the machine is not known, or nothing was accepted.
        """
        (known,) = self.machines([machine])
        machine = known.name
        with self._asked() as connection:
            every = list(_proposals_of(connection, machine).values())
            found = [one for one in every if one.state in _TO_FETCH] or [
                one
                for one in every
                if one.state is ProposalState.IN_FORCE and one.sha256 == known.model_sha256
            ]
            if not found:
                raise ConfigurationError("nothing_to_withdraw", name=machine, place=self._place)
            for one in found:
                _step(connection, machine, ProposalState.WITHDRAWN, who, why, one.sha256)
        return found

    def roll_back(self, machine: str, *, who: str, why: str) -> StoredProposal:
        """Accept the model before the one in force as what is to be fetched; withdraw all others.

        Raises
        ------
        ConfigurationError
            If the machine is not known, or had no other model before.
        """
        (known,) = self.machines([machine])
        machine = known.name
        m, p = _models.c, _proposals.c
        with self._asked() as connection:
            own = connection.execute(
                sa.select(m.machine_id, m.sha256, m.parent_sha256, m.content)
                .join(_machines, _machines.c.id == m.machine_id)
                .where(_machines.c.name == machine)
            ).all()
            models = {row.sha256: row for row in own}
            before = models.get(models[known.model_sha256].parent_sha256 or "")
            if before is None:
                raise ConfigurationError("no_model_before", name=machine, place=self._place)
            ids = {"machine_id": before.machine_id, "parent_sha256": known.model_sha256}
            now = datetime.now(UTC)
            row = {**ids, "sha256": before.sha256, "content": before.content, "added_utc": now}
            _inserted(connection, _proposals, [{**row, "day": now.date()}])
            key = [p[name] == row[name] for name in ("machine_id", "parent_sha256", "sha256")]
            chosen = connection.execute(sa.select(p.id).where(*key)).scalar_one()
            earlier = _proposals_of(connection, machine)[chosen]
            if earlier.decided_utc is not None and earlier.state not in _TO_FETCH:
                _begun_anew(connection, chosen, now)
            _decided(connection, chosen, accepted=True, who=who, why=why)
            every = _proposals_of(connection, machine)
            for one in every.values():
                if one.accepted and one.sha256 != before.sha256:
                    _step(connection, machine, ProposalState.WITHDRAWN, who, why, one.sha256)
        return every[chosen]

    # ---- axes -----------------------------------------------------------------------------------

    def add_axis_run(self, run: AxisRun) -> bool:
        """Store a positioning run; return whether neither its file nor its start was known.

        The start tells that one run lies there in two formats.

        Raises
        ------
        ConfigurationError
            If the machine is not known, or the file was stored as another machine's.
        """
        c = _machines.c
        with self._asked() as connection:
            renamed = _renamed(connection)
            name = renamed.get(run.machine, run.machine)
            machine_id = connection.execute(sa.select(c.id).where(c.name == name)).scalar()
            row = {
                "machine_id": machine_id,
                "axis": run.axis,
                "start_utc": run.start,
                "sha256": run.sha256,
                "result": json.dumps(axis_run_as_json(run), allow_nan=False),
                "added_utc": datetime.now(UTC),
            }
            new = machine_id is not None and _inserted(connection, _axis_runs, [row]) == 1
            joined = sa.select(c.name).join(_axis_runs, _axis_runs.c.machine_id == c.id)
            of_file = joined.where(_axis_runs.c.sha256 == run.sha256)
            owner = connection.execute(of_file).scalar() or name
        if machine_id is None:
            self.machines([name])  # says which are known
        if renamed.get(owner, owner) != name:
            raise ConfigurationError("run_of_other_machine", name=owner, file=run.name)
        return new

    def axis_runs(self, machine: str, sha256: str | None = None) -> list[AxisRun]:
        """Return the positioning runs of a machine, also by a former name, by axis and start.

        With a hash, only that of this file.
        """
        run, c = _axis_runs.c, _machines.c
        with self._asked() as connection:
            renamed = _renamed(connection)
            machine = renamed.get(machine, machine)
            names = [machine, *(old for old, new in renamed.items() if new == machine)]
            query = (
                sa.select(run.result)
                .join(_machines, c.id == run.machine_id)
                .where(c.name.in_(names))
                .where(sa.true() if sha256 is None else run.sha256 == sha256)
                .order_by(run.axis, run.start_utc)
            )
            rows = connection.execute(query).scalars().all()
        return [axis_run_of_json(machine, json.loads(row)) for row in rows]


def _night_of(row: Sequence[Any]) -> StoredNight:
    return StoredNight(*row[:5], result=json.loads(row[5]))


_TO_FETCH = frozenset({ProposalState.ACCEPTED, ProposalState.FETCHED})
_DECIDED = {
    None: ProposalState.OPEN,
    False: ProposalState.REJECTED,
    True: ProposalState.ACCEPTED,
}
_STEPS = (ProposalState.FETCHED, ProposalState.IN_FORCE, ProposalState.WITHDRAWN)


def _decided(connection: sa.Connection, key: int, *, accepted: bool, who: str, why: str) -> bool:
    """Store a decision; return whether it is the first one."""
    now = datetime.now(UTC)
    row = {"proposal_id": key, "accepted": accepted, "who": who, "why": why, "added_utc": now}
    return bool(_inserted(connection, _decisions, [row]))


def _step(
    connection: sa.Connection, machine: str, step: ProposalState, who: str, why: str, sha256: str
) -> None:
    """Take note of a step of every accepted proposal of one model."""
    every = _proposals_of(connection, machine)
    ids = [i for i, one in every.items() if one.accepted and one.sha256 == sha256]
    rest = {"step": str(step), "who": who, "why": why, "added_utc": datetime.now(UTC)}
    _inserted(connection, _steps, [{"proposal_id": i, **rest} for i in ids])


def _begun_anew(connection: sa.Connection, key: int, now: datetime) -> None:
    """Let a proposal be decided on again; what became of it stays as steps of other names."""
    d, s, until = _decisions.c, _steps.c, f" until {now.isoformat()}"
    kept = sa.update(_steps).where(s.proposal_id == key, s.step.in_(_STEPS))
    connection.execute(kept.values(step=s.step + until))
    own = d.proposal_id == key
    row = connection.execute(sa.select(d.who, d.why, d.added_utc, d.accepted).where(own)).one()
    step = _DECIDED[row.accepted] + until
    rest = {"who": row.who, "why": row.why, "added_utc": row.added_utc}
    _inserted(connection, _steps, [{"proposal_id": key, "step": step, **rest}])
    connection.execute(sa.delete(_decisions).where(own))


def _proposals_of(
    connection: sa.Connection, machine: str | None = None, *, in_force: bool = False
) -> dict[int, StoredProposal]:
    """Return proposals by their id, the first one first.

    Only those for the model in force: without their content.
    """
    m, c, d, s = _machines.c, _proposals.c, _decisions.c, _steps.c
    for_model = c.parent_sha256 == m.model_sha256
    own = (sa.true() if machine is None else m.name == machine) & (for_model | (not in_force))
    joined = _proposals.join(_machines, m.id == c.machine_id)
    query = (
        sa.select(
            *(c.id, m.name, c.sha256, c.parent_sha256, c.day),
            sa.literal("") if in_force else c.content,
            *(d.accepted, d.who, d.why, d.added_utc),
        )
        .select_from(joined.outerjoin(_decisions, d.proposal_id == c.id))
        .where(own)
        .order_by(c.id)
    )
    taken = sa.select(s.proposal_id, s.step, s.who, s.why).select_from(
        joined.join(_steps, s.proposal_id == c.id)
    )
    steps: dict[int, dict[str, tuple[str, str]]] = {}
    for row in connection.execute(taken.where(own)):
        steps.setdefault(row.proposal_id, {})[row.step] = (row.who, row.why)
    proposed = _proposed_last(connection, own)
    found: dict[int, StoredProposal] = {}
    rows: Sequence[Any] = connection.execute(query).all()
    for row in rows:
        reached = steps.get(row.id, {})
        state = _DECIDED[row.accepted]
        for step in _STEPS:
            state = step if step in reached else state
        found[row.id] = StoredProposal(
            *row[1:-1],
            state=state,
            withdrawn=reached.get(ProposalState.WITHDRAWN),
            decided_utc=None if row[-1] is None else _utc(row[-1]),
        )
    moving = {(o.machine, o.parent_sha256) for o in found.values() if o.state in _TO_FETCH}
    for i, one in found.items():
        newest = proposed.get(one.machine) == (one.parent_sha256, one.sha256)
        if one.accepted is None and (not newest or (one.machine, one.parent_sha256) in moving):
            found[i] = replace(one, state=ProposalState.SUPERSEDED)
    return found


def _proposed_last(
    connection: sa.Connection, own: sa.ColumnElement[bool]
) -> dict[str, tuple[str, str | None]]:
    """Return the model in force and what was proposed for it by the newest night that judged it.

    Of machines alone for whose model something is proposed that nobody has decided on. A night
    without touches judges no model; one with doubtful sensors proposes none.
    """
    m, p, n = _machines.c, _proposals.c, _nights.c
    undecided = (
        sa.select(p.machine_id, sa.func.max(p.day).label("day"))
        .join(_machines, m.id == p.machine_id)
        .outerjoin(_decisions, _decisions.c.proposal_id == p.id)
        .where(own, p.parent_sha256 == m.model_sha256, _decisions.c.id.is_(None))
        .group_by(p.machine_id)
        .subquery()
    )
    query = (
        sa.select(m.name, n.model_sha256, n.outcome, n.result)
        .join(_machines, (m.id == n.machine_id) & (m.model_sha256 == n.model_sha256))
        .join(undecided, (undecided.c.machine_id == m.id) & (n.day >= undecided.c.day))
        .order_by(n.day, n.id)
    )
    found: dict[str, tuple[str, str | None]] = {}
    for row in connection.execute(query):
        result = json.loads(row.result)
        if row.outcome == NightOutcome.VERIFIED or result["sensor_codes"]:
            found[row.name] = row.model_sha256, result["proposal_sha256"]
    return found


def _alive() -> sa.ColumnElement[bool]:
    """Choose machines that were not merged with another one."""
    return _machines.c.name.not_in(sa.select(_formerly.c.name))


def _renamed(connection: sa.Connection) -> dict[str, str]:
    """Return the names of today by former ones."""
    query = sa.select(_formerly.c.name, _machines.c.name).join(_machines)
    return {row[0]: row[1] for row in connection.execute(query.order_by(_formerly.c.name))}


def _checked(url: str, *, made: bool) -> Place:
    path = check_url(url, key="REGISTRY")
    if made and path is not None and not path.is_file():
        raise ConfigurationError("registry_not_found", file=path)
    if path is not None and not path.absolute().parent.is_dir():
        raise ConfigurationError("folder_not_found", file=path.parent)
    return Place(str(path or url))


def _known(connection: sa.Connection) -> dict[str, str]:
    if not sa.inspect(connection).has_table(_registry.name):
        return {}
    return {row.name: row.value for row in connection.execute(sa.select(_registry))}


def _refuse_newer(found: int, place: Place) -> None:
    if found > VERSION:
        raise ConfigurationError("registry_newer", found=found, known=VERSION, place=place)


def _inserted(
    connection: sa.Connection, table: sa.Table, rows: Sequence[dict[str, Any]], unless: str = ""
) -> int:
    """Insert rows that no unique key refuses; return their number.

    One that is refused takes the other's place where it has more in the column `unless`.
    """
    dialects = {"sqlite": sqlite.insert, "postgresql": postgresql.insert}
    if not rows:
        return 0
    plain = dialects[connection.dialect.name](table)
    query = plain.on_conflict_do_nothing()
    if unless:
        (key,) = (one for one in table.constraints if isinstance(one, sa.UniqueConstraint))
        query = plain.on_conflict_do_update(
            index_elements=list(key.columns),
            set_={name: plain.excluded[name] for name in rows[0]},
            where=plain.excluded[unless] > table.c[unless],
        )
    return len(connection.execute(query.returning(*table.primary_key), rows).all())


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
