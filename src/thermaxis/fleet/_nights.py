"""The nights of a fleet: only what is missing is done, and each is stored once, as it comes."""

import time
from collections.abc import Callable, Iterable, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from datetime import date
from typing import Final, NamedTuple, final

from thermaxis.codes import Message, remark
from thermaxis.errors import ThermaxisError
from thermaxis.files import parse_model
from thermaxis.fleet._engine import Engine, results_of
from thermaxis.fleet._lake import Lake
from thermaxis.fleet._night import NightOutcome, NightResult, night
from thermaxis.fleet._registry import FleetMachine, Registry

Report = Callable[[str, int, int], None]
_BATCH, _BATCH_S = 100, 1.0
_LISTED_AT_ONCE = 16
LONGEST_ERROR: Final = 300
"""Longest text of an error that is kept. [character]"""


class NightJob(NamedTuple):
    """A night that is to be done; it needs nothing but the lake."""

    machine: FleetMachine
    """The machine with its model."""
    day: date
    """The day."""
    days_back: int
    """Days before it from which the model runs. [1]"""
    lake: str
    """Folder or URL of the lake."""


def work(job: NightJob) -> NightResult | None:
    """Do a night; return None where the day was not shipped.

    Raises
    ------
    ThermaxisError
        If the lake cannot be read, or the model is none.
    """
    machine, lake = job.machine, Lake(job.lake)
    seen = lake.last_id(machine.name, job.day, machine.formerly)  # before: what comes now is late
    found = night(
        machine.name,
        parse_model(machine.model, name=machine.name),
        lake.minutes(machine.name, job.day, job.days_back, machine.formerly),
        job.day,
        channels=machine.channels,
    )
    return None if found is None else replace(found, last_id=seen)


def late_nights(registry: Registry, day: date) -> list[FleetMachine]:
    """Return the machines whose night is stored, and of whose day the lake has more by now.

    Raises
    ------
    DataError
        If the lake cannot be read.
    """
    lake, seen = Lake(registry.lake), registry.seen(day)
    stored = [one for one in registry.machines() if seen.get(one.name)]

    def is_late(one: FleetMachine) -> bool:
        return seen[one.name] < lake.last_id(one.name, day, one.formerly)

    with ThreadPoolExecutor(_LISTED_AT_ONCE) as pool:  # a bucket answers slowly, but many at once
        return [one for one, late in zip(stored, pool.map(is_late, stored), strict=True) if late]


@final
@dataclass(frozen=True, slots=True)
class Nights:
    """What was done."""

    asked: int
    """Nights that were missing. [1]"""
    stored: int
    """Of them stored now. [1]"""
    not_shipped: tuple[str, ...]
    """Machines of them without a minute in the lake: they stay missing."""
    set_aside: int
    """Of them failed twice, and stored with their error. [1]"""
    unread: Mapping[str, Message]
    """Why a machine's lake or model could not be read; its night stays missing."""


def do_nights(
    registry: Registry,
    jobs: Iterable[NightJob],
    engine: Engine,
    *,
    report: Report = lambda _step, _done, _total: None,
) -> Nights:
    """Do nights and store each as it comes.

    Ended at any time and called again with what is missing then, the results are the same. Of two
    programs at once each night is stored by one.

    Parameters
    ----------
    registry : Registry
        Where they are stored.
    jobs : iterable of NightJob
        What is to be done.
    engine : Engine
        What does the work.
    report : callable
        Called with step, nights done and their number.

    Returns
    -------
    Nights
        What was done.

    Raises
    ------
    DataError
        If engine or registry are lost; what was stored stays.
    """
    asked = list(jobs)
    ready: list[NightResult] = []
    not_shipped: list[str] = []
    stored = set_aside = 0
    unread: dict[str, Message] = {}
    flushed_s = time.monotonic()
    for number, (job, found) in enumerate(results_of(engine, work, asked), start=1):
        report("nights", number, len(asked))
        if isinstance(found, ThermaxisError):
            unread[job.machine.name] = found.message
        elif isinstance(found, BaseException):
            set_aside += 1
            ready.append(_set_aside(job, found))
        elif found is None:
            not_shipped.append(job.machine.name)
        else:
            ready.append(found)
        if len(ready) >= _BATCH or time.monotonic() > flushed_s + _BATCH_S:
            stored += registry.record(ready)
            ready.clear()
            flushed_s = time.monotonic()
    stored += registry.record(ready)
    return Nights(len(asked), stored, tuple(not_shipped), set_aside, unread)


def _set_aside(job: NightJob, error: BaseException) -> NightResult:
    failure = f"{type(error).__name__}: {error}"[:LONGEST_ERROR]
    return NightResult(
        machine=job.machine.name,
        day=job.day,
        model_sha256=job.machine.model_sha256,
        outcome=NightOutcome.SET_ASIDE,
        remarks=(remark("night_failed", failure=failure),),
    )
