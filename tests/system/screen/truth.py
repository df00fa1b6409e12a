"""Faults drawn at random; what the operator's page says, against what the lathe itself knows.

The lathe lives in this program, so that its own record says at every moment which offset acts and
what is wrong. Two pages are read about twice a second: one that is looked at, and one of somebody
who has logged in and touches nothing. What they show must have been true within the time in which
they mark what is old; while a fault lasts they name it. A fault lasts until it is named.
"""

import asyncio
import json
import random
import signal
import threading
import time
from collections import Counter
from collections.abc import Callable, Generator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final, NamedTuple

from playwright.sync_api import Browser, Error as PlaywrightError, Page

from tests.in_time import slowness
from tests.system.screen.stand import NODES, PATIENCE_S, START_S, Rig
from thermaxis.compensation import RequestKind
from thermaxis.errors import ConfigurationError
from thermaxis.messages import sentence
from thermaxis.runtime import SystemClock
from thermaxis.runtime.config import state_file_of
from thermaxis.runtime.host import ask_loop
from thermaxis.virtual import (
    FAULTY,
    LatheServer,
    LatheServerSettings,
    LatheSettings,
    OffsetRules,
    VirtualLathe,
    parse_fault,
)

WATCHDOG_S: Final = 2.0
"""The lathe takes the offset back so long after the last heartbeat. [s]"""
OLD_S: Final = 5.0
"""What is shown as it is was so no longer ago: the screen's longest age and one look at the
machine. [s]"""
ROUNDED_UM: Final = 0.06
"""The page shows tenths of a micrometre. [µm]"""
NAMED_S: Final = 8.0
"""A fault is named so soon: once it is no single missed read, and has reached the page. [s]"""
LOOK_S: Final = 0.5
SEEN: Final = 3
"""So often a named fault is seen before it ends. [1]"""
ORDINARY: Final = ("headline-active", "headline-off")
"""Where nothing is out of the ordinary."""
WARMING: Final = "headline-warming"
SENSORS: Final = ("T_spindle_C", "T_table_C", "T_column_C")
INTERLOCK: Final = "no_emergency_stop"
_READ: Final = """() => {
  const one = (name) => document.querySelector(name);
  const shown = (name) => one(name)?.checkVisibility() ? one(name).textContent.trim() : "";
  const look = one("#op")?.dataset.look;
  return {
    live: document.body.dataset.live === "yes",
    lived_s: performance.now() / 1000,
    headline: look ? `headline-${look}` : "",
    words: shown("#headline"),
    number: shown(".op-value b"),
    alarms: shown("#alarm"),
    ordinary: document.body.innerText.includes(ORDINARY),
  };
}""".replace("ORDINARY", json.dumps(sentence("operator-no_alarm_more")))
UNKNOWN: Final = "?"
UNREAD: Final = ("headline-unreachable", "headline-inputs_unreachable")


class Acted(NamedTuple):
    """What the lathe itself knows."""

    at_s: float
    """Monotonic time. [s]"""
    um: float
    """Offset that acts. [µm]"""


class LivingLathe:
    """A lathe with its server in a thread of this program; its faults come and go.

    Parameters
    ----------
    port : int
        Where it serves. [1]
    """

    def __init__(self, port: int) -> None:
        rules = OffsetRules(rate_um_per_s=200.0, watchdog_s=WATCHDOG_S)
        self.lathe = VirtualLathe("verification", settings=LatheSettings(offset=rules))
        self.record: list[Acted] = []
        self._port, self._ready = port, threading.Event()
        self._thread = threading.Thread(target=lambda: asyncio.run(self._live()))
        self._thread.start()
        assert self._ready.wait(START_S)

    async def _live(self) -> None:
        self._loop, self._end = asyncio.get_running_loop(), asyncio.Event()
        started: asyncio.Future[str] = self._loop.create_future()
        settings = LatheServerSettings(port=self._port)
        serving = asyncio.create_task(LatheServer(self.lathe, settings, SystemClock()).run(started))
        await started
        self._ready.set()
        while not self._end.is_set():
            self.record.append(Acted(time.monotonic(), self.lathe.axis.effective_um))
            with suppress(TimeoutError):
                await asyncio.wait_for(self._end.wait(), 0.02)
        serving.cancel()
        with suppress(asyncio.CancelledError):
            await serving

    def suffer(self, *sentences: str) -> None:
        """Let these faults act, in place of those before."""
        faults = [parse_fault(text, FAULTY) for text in sentences]
        self._loop.call_soon_threadsafe(self.lathe.set_faults, faults)

    def acted_um(self, since_s: float, until_s: float) -> tuple[float, float]:
        """Return the smallest and the largest offset that acted in some time. [µm]"""
        found = [one.um for one in self.record[:] if since_s <= one.at_s <= until_s]
        return min(found), max(found)

    def end(self) -> None:
        """End it."""
        self._loop.call_soon_threadsafe(self._end.set)
        self._thread.join(PATIENCE_S)


class TruthRig(Rig):
    """A rig whose lathe lives in this program."""

    living: LivingLathe

    def start_lathe(self, *faults: str) -> None:
        """Start it."""
        self.living = LivingLathe(self.lathe_port)
        self.living.suffer(*faults)

    def start_loop(self, *options: str, cores: Sequence[int] = ()) -> None:
        """Start the loop; it shall compensate."""
        super().start_loop("--enable", *options, cores=cores)

    def end(self) -> None:
        """End every program, then the lathe."""
        super().end()
        if hasattr(self, "living"):
            self.living.end()


class Fault(NamedTuple):
    """Something that goes wrong, and what the page must say of it."""

    begin: Callable[["Trial"], None]
    end: Callable[["Trial"], None]
    headlines: frozenset[str]
    """One of these; empty where the page has no data, and says so."""
    name: str = ""
    """What must be named in the headline's words."""
    readable: bool = True
    """Whether anybody can know which offset acts."""
    acting_um: float | None = None
    """Where the offset goes in the end, if that is known. [µm]"""


@dataclass
class Trial:
    """Two pages of a stand, and every contradiction found on them; `missed` counts looks at which
    a page that had named its fault could not read anything."""

    stand: TruthRig
    pages: Mapping[str, Page]
    chance: random.Random
    contradictions: list[str] = field(default_factory=list[str])
    looks: int = 0
    missed: int = 0
    named_s: dict[str, list[float]] = field(default_factory=dict[str, list[float]])

    # ---- what is seen ---------------------------------------------------------------------------

    def look(self) -> list[dict[str, Any]]:
        """Read every page once, and judge its number."""
        return [self._read(name, page) for name, page in self.pages.items()]

    def _read(self, name: str, page: Page) -> dict[str, Any]:
        began_s = time.monotonic()
        for _ in range(40):
            try:
                seen = page.evaluate(_READ)
                break
            except PlaywrightError:  # it loads itself again
                page.wait_for_timeout(100)
        else:
            raise AssertionError(f"the page {name} cannot be read")
        self.looks += 1
        seen["page"], seen["at_s"] = name, time.monotonic()
        wrong = self._wrong(seen, began_s)
        self.contradictions += [f"{name}: {text}: {seen}" for text in wrong]
        page.wait_for_timeout(1e3 * LOOK_S / len(self.pages))
        return seen

    def _wrong(self, seen: Mapping[str, Any], began_s: float) -> Generator[str]:
        if not seen["headline"] or seen["number"] in {"", "–"}:
            if seen["lived_s"] > OLD_S:
                yield "state and offset are not in sight"
        elif seen["number"] != UNKNOWN:
            um = float(seen["number"].replace("−", "-"))
            for slow in (lambda: 1.0, slowness):  # which takes its time
                old_s = OLD_S * slow()
                least, most = self.stand.living.acted_um(began_s - old_s, seen["at_s"])
                if least - ROUNDED_UM <= um <= most + ROUNDED_UM:
                    break
            else:
                yield f"{um} is shown, {least} to {most} acted"
        if seen["live"] and seen["ordinary"] and seen["headline"] not in ORDINARY:
            yield "nothing is said to be out of the ordinary"

    def settle(self) -> None:
        """Wait until every page says that it compensates; a loop in Fault is acknowledged."""
        until_s = time.monotonic() + 2.0 * PATIENCE_S
        while time.monotonic() < until_s:
            seen = self.look()
            if all(one["live"] and one["headline"] == "headline-active" for one in seen):
                return
            state = self.stand.programs["run"].state()
            if state in {"Fault", "Off", "Fading"}:
                kind = RequestKind.ACKNOWLEDGE if state == "Fault" else RequestKind.ENABLE
                with suppress(ConfigurationError):  # it is not there yet
                    ask_loop(state_file_of(self.stand.configuration), kind)
        raise AssertionError(f"not active again: {seen} {self.stand.programs['run'].tail()}")

    def suffer(self, name: str) -> None:
        """Let one thing go wrong until every page has named it for a while, and the offset is where
        it leads."""
        fault = FAULTS[name](self.chance)
        fault.begin(self)
        began_s = time.monotonic()
        last_s: dict[str, float] = {}
        count: Counter[str] = Counter()
        unread: Counter[str] = Counter()
        goes_to = fault.acting_um
        while min(map(count.__getitem__, self.pages)) < SEEN or goes_to not in {
            None,
            self.stand.living.record[-1].um,
        }:
            assert time.monotonic() - began_s < PATIENCE_S, name
            for seen in self.look():
                page, took_s = seen["page"], seen["at_s"] - began_s
                if self._names(fault, seen):
                    if not count[page]:
                        self.named_s.setdefault(name, []).append(took_s)
                    count[page] += 1
                    last_s[page], unread[page] = took_s, 0
                elif (
                    count[page]
                    and _knows_less(seen)
                    and not (unread[page] and took_s > last_s[page] + OLD_S)
                ):
                    unread[page] += 1
                    self.missed += 1
                elif seen["headline"] == WARMING and seen["live"] and fault.headlines == _DEAD:
                    self.contradictions.append(f"{name}: it does not warm up: {seen}")
                elif count[page] or (took_s > NAMED_S and took_s > NAMED_S * slowness()):
                    self.contradictions.append(f"{name}, {took_s:.1f} s: {seen}")
                    count[page] = SEEN
        fault.end(self)

    def _names(self, fault: Fault, seen: Mapping[str, Any]) -> bool:
        if not fault.headlines:
            return not seen["live"] and seen["number"] in {UNKNOWN, "–", ""}
        known = seen["number"] != UNKNOWN
        return (
            seen["live"]
            and seen["headline"] in fault.headlines
            and fault.name in seen["words"]
            and known == fault.readable
        )


def _knows_less(seen: Mapping[str, Any]) -> bool:
    """Whether a page says that something could not be read: so it is now and then where others
    work on the same computer."""
    return not seen["live"] or seen["headline"] in UNREAD


# ---- what goes wrong ----------------------------------------------------------------------------


def _lathe(*sentences: str) -> Callable[[Trial], None]:
    return lambda trial: trial.stand.living.suffer(*sentences)


def _sent(part: str, number: signal.Signals) -> Callable[[Trial], None]:
    def send(trial: Trial) -> None:
        trial.stand.programs[part].signal(number)

    return send


def _killed(part: str) -> Callable[[Trial], None]:
    return lambda trial: trial.stand.kill(part)


def _unreachable(chance: random.Random) -> Fault:
    kind = chance.choice(("pause", "restart"))
    return Fault(
        _lathe(f"{kind} for 1d"),
        _lathe(),
        frozenset({"headline-unreachable"}),
        readable=False,
        acting_um=0.0,
    )


def _stop(_: random.Random) -> Fault:
    pressed = _lathe("set emergency_stop to 1")
    return Fault(pressed, _lathe(), frozenset({"headline-interlock"}), INTERLOCK)


def _deaf(_: random.Random) -> Fault:
    """What is written is accepted and read back, and the axis, which is homing, takes nothing."""
    deaf = _lathe("set homing to 1")
    return Fault(deaf, _lathe(), frozenset({"headline-not_acting"}), "Z", acting_um=0.0)


_DEAD: Final = frozenset({"headline-held_for_input", "headline-input_lost"})


def _sensor(chance: random.Random) -> Fault:
    kind, sensor = chance.choice(("bad", "nan", "missing")), chance.choice(SENSORS)
    return Fault(_lathe(f"{kind} {sensor}"), _lathe(), _DEAD, sensor.removesuffix("_C"))


def _started_with_a_dead_sensor(chance: random.Random) -> Fault:
    sensor = chance.choice(SENSORS)

    def begin(trial: Trial) -> None:
        trial.stand.kill("run")
        trial.stand.living.suffer(f"bad {sensor}")
        trial.stand.start_loop()

    return Fault(begin, _lathe(), _DEAD, sensor.removesuffix("_C"))


_NO_DATA: Final[frozenset[str]] = frozenset()
_STOPPED, _ON = signal.SIGSTOP, signal.SIGCONT
FAULTS: Final[Mapping[str, Callable[[random.Random], Fault]]] = {
    "unreachable": _unreachable,
    "emergency stop": _stop,
    "not acting": _deaf,
    "dead sensor": _sensor,
    "started with a dead sensor": _started_with_a_dead_sensor,
    "loop killed": lambda _: Fault(
        _killed("run"), lambda trial: trial.stand.start_loop(), _NO_DATA, readable=False
    ),
    "loop frozen": lambda _: Fault(
        _sent("run", _STOPPED), _sent("run", _ON), _NO_DATA, readable=False
    ),
    "screen killed": lambda _: Fault(
        _killed("screen"), lambda trial: trial.stand.start_screen(), _NO_DATA, readable=False
    ),
    "screen frozen": lambda _: Fault(
        _sent("screen", _STOPPED), _sent("screen", _ON), _NO_DATA, readable=False
    ),
}
"""The idle panel is a page that is there all the time."""


def drawn(count: int, seed: int) -> list[str]:
    """Return so many faults, each kind once at least where there is room."""
    chance = random.Random(seed)  # noqa: S311 - repeatable
    names = [*FAULTS, *(chance.choice(tuple(FAULTS)) for _ in range(count - len(FAULTS)))][:count]
    chance.shuffle(names)
    return names


@contextmanager
def trial(folder: Path, browser: Browser, seed: int) -> Generator[Trial]:
    """Yield a stand that compensates, and two pages of it; all is ended in the end."""
    stand = TruthRig(folder, view_without_login=True, more="idle_s = 60.0\n")
    text = stand.configuration.read_text(encoding="utf-8")
    stop = f'[interlock.{INTERLOCK}]\nnode = "{NODES}emergency_stop"\nmet = false\n\n'
    text = text.replace("[other_compensation]", f"{stop}[other_compensation]")
    text = text.replace("[supervisor]\n", "[supervisor]\nask_enables = true\n")
    stand.configuration.write_text(text, encoding="utf-8")
    with stand:
        contexts = [browser.new_context(locale="en-GB", reduced_motion="reduce") for _ in range(2)]
        visitor = stand.visitor()
        assert visitor.log_in("operator").status == 200
        contexts[1].add_cookies(
            [
                {"name": one.name, "value": one.value or "", "url": stand.address}
                for one in visitor.cookies
            ]
        )
        pages = {}
        for name, context in zip(("looked at", "idle"), contexts, strict=True):
            pages[name] = context.new_page()
            pages[name].goto(f"{stand.address}/")
            pages[name].wait_for_selector('body[data-live="yes"]', timeout=1e3 * PATIENCE_S)
        chance = random.Random(seed)  # noqa: S311 - repeatable
        one = Trial(stand, pages, chance)
        one.settle()
        yield one
        for context in contexts:
            context.close()
