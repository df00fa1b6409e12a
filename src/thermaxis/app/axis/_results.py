"""What an evaluated run shows, and for how long it is kept for the person who asked."""

import asyncio
import secrets
from collections.abc import Mapping
from datetime import datetime
from typing import TYPE_CHECKING, Any, Final, NamedTuple, cast, final

from thermaxis.app._rooms import Json, Owner, RoomHost
from thermaxis.positioning import FIGURE_KEYS
from thermaxis.web.work import WorkFolder

if TYPE_CHECKING:
    from thermaxis.app.axis._room import Asked

KEPT_S: Final = 3600.0
"""Time for which a result is kept. [s]"""
MOST_OF_A_PERSON: Final = 10
"""Results that one person keeps; the oldest goes. [1]"""
MOST_BYTES: Final = 400_000_000
"""Largest sum of what lies in the folders of all results; the oldest go. [byte]"""
SWEEP_S: Final = 5.0
"""Time after which results are gone with the log-in of their owner. [s]"""
_MOST_TEXTS: Final = 200
_LONGEST_TEXT: Final = 2000


class Result(NamedTuple):
    """One evaluated run."""

    id: str
    """128 random bits: part of its address."""
    person: Owner
    """Who asked, and alone may see it."""
    name: str
    """Name of the file as the person's computer calls it, fit to be shown."""
    at_s: float
    """When it was made, monotonic. [s]"""
    at_utc: datetime
    """The same by the calendar."""
    shown: Json
    """What the page shows."""
    asked: "Asked"
    """What was asked for."""
    folder: WorkFolder
    """Where the run is, what went along, and what is made of it."""

    @property
    def size_bytes(self) -> int:
        """What lies in its folder. [byte]"""
        files = self.folder.path.rglob("*")
        return sum(file.stat().st_size for file in files if file.is_file())


@final
class KeptResults:
    """Results by their owner: few, for an hour at most, and gone with the session at the loop."""

    def __init__(self, clock: RoomHost) -> None:
        self._clock = clock
        self._results: dict[str, Result] = {}
        self._sweeps: asyncio.TimerHandle | None = None

    def keep(
        self, person: Owner, name: str, shown: Json, asked: "Asked", folder: WorkFolder
    ) -> Result:
        """Keep a result with its folder."""
        key, now_s = secrets.token_hex(16), self._clock.monotonic_s()
        made = Result(key, person, name, now_s, self._clock.utc(), shown, asked, folder)
        self._results[key] = made
        self.sweep()
        if self._sweeps is None:
            self._sweep_on()
        return made

    def _sweep_on(self) -> None:
        """Look again and again while there are results: a log-in ends without a question here."""
        self.sweep()
        loop = asyncio.get_running_loop()
        self._sweeps = loop.call_later(SWEEP_S, self._sweep_on) if self._results else None

    def of(self, person: Owner | None, key: str) -> Result | None:
        """Return a result to its owner."""
        self.sweep()
        found = self._results.get(key)
        return found if found is not None and found.person is person else None

    def all_of(self, person: Owner | None) -> list[Result]:
        """Return the results of a person, the latest first."""
        self.sweep()
        return [one for one in reversed(self._results.values()) if one.person is person]

    def sweep(self) -> None:
        """Drop what is old, whose owner has left, or what is too much."""
        now_s = self._clock.monotonic_s()
        for one in list(self._results.values()):
            if now_s - one.at_s > KEPT_S or one.person.ended:
                self._drop(one)
        owners = {id(one.person): one.person for one in self._results.values()}
        for person in owners.values():
            own = [one for one in self._results.values() if one.person is person]
            for one in own[:-MOST_OF_A_PERSON]:
                self._drop(one)
        while self._size_bytes() > MOST_BYTES and len(self._results) > 1:
            self._drop(next(iter(self._results.values())))

    def _size_bytes(self) -> int:
        return sum(one.size_bytes for one in self._results.values())

    def _drop(self, result: Result) -> None:
        del self._results[result.id]
        result.folder.remove()


def shown_of(evaluated: Mapping[str, Any]) -> Json:
    """Return what the page shows of an evaluation."""
    test, iso230_2 = evaluated["test"], evaluated["iso230_2"]
    check = evaluated["limits"]
    found = cast("list[Json]", _part(evaluated, "drift").get("diagnosis", []))
    return {
        "version": evaluated["version"],
        "sha256": evaluated["input"]["sha256"],
        "kind": test["kind"],
        "targets": len(test["targets"]),
        "cycles": test["cycles"],
        "cycle": test["cycle"],
        "unidirectional": test["unidirectional"],
        "machine": _text(test["header"].get("machine")),
        "axis": _text(test["header"].get("axis")),
        "start": test["start"],
        "edition": iso230_2["edition"],
        "figures": [_figure(key, evaluated) for key in FIGURE_KEYS],
        "verdict": None if check is None else check["verdict"],
        "decision_rule": None if check is None else check["decision_rule"],
        "left_out": _part(evaluated, "uncertainty", "measured").get("left_out_codes", []),
        "other": _other(evaluated),
        "drift": _drift(evaluated["drift"]),
        "anomalies": _anomalies(evaluated),
        "diagnosis": [one["message"] for one in found[:_MOST_TEXTS]],
        "warnings": _texts(evaluated["warnings"]),
        "levels": iso230_2["targets"],
        "levels_drift_free": {
            name: _part(evaluated, "drift").get(f"levels_{name}", [])
            for name in ("forward", "backward")
        },
    }


def _part(table: Mapping[str, Any], *keys: str) -> Json:
    """Return a table within tables; an empty one where there is none on the way."""
    found: object = table
    for key in keys:
        found = cast("Json", found).get(key) or {}
    return cast("Json", found)


def _figure(key: str, evaluated: Mapping[str, Any]) -> Json:
    row = next(one for one in evaluated["figure_table"] if one["figure"] == key)
    return {
        "key": key,
        "measured": row["value"],
        "measured_within": row["expanded_uncertainty"],
        "drift_free": row["drift_free"],
        "drift_free_within": row["drift_free_expanded_uncertainty"],
        "limit": row["limit"],
        "verdict": row["verdict"],
    }


def _other(evaluated: Mapping[str, Any]) -> Json | None:
    """Return the figures of the other standard, if one was asked for."""
    for name in ("iso230_2_1988", "vdi3441"):
        found = cast("dict[str, Any] | None", evaluated[name])
        if found is not None:
            figures = {key: one for key, one in found.items() if isinstance(one, int | float)}
            return {"name": name, "figures": figures, "mark": _text(found.get("mark"))}
    return None


def _drift(drift: Mapping[str, Any] | None) -> Json | None:
    if drift is None:
        return None
    names = ("model", "significant", "total", "total_within", "total_per_m", "total_per_m_within")
    return {name: drift[name] for name in (*names, "reference_time_s")}


def _anomalies(evaluated: Mapping[str, Any]) -> list[Json]:
    rows: list[Json] = []
    for approach in ("forward", "backward"):
        found = _part(evaluated, "adjacent_difference", approach).get("anomalies", [])
        rows += [
            {
                "approach": approach,
                "position": one["position"],
                "target": one["position_mm"],
                "statistic": one["statistic"],
            }
            for one in cast("list[Json]", found)
        ]
    return rows[:_MOST_TEXTS]


def _texts(texts: list[str]) -> list[str]:
    return [_text(text) for text in texts[:_MOST_TEXTS]]


def _text(text: object) -> str:
    return "" if text is None else str(text)[:_LONGEST_TEXT]
