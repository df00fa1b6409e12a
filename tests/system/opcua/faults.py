"""Faults drawn at random, one after the other, against loops and servers of others.

The server writes down every write of an offset by its own clock, with where the offset stood just
before, and looks every 10 ms. Each write is held against the cycle of the history that it came
from: what was under way while somebody else wrote, or while the watchdog took the offset back, no
loop could know. Nothing is judged by how fast the computer is: what must be told lasts until it is,
and the next fault comes when the loop has written a few times since.
"""

import json
import math
import random
import re
import signal
import time
from bisect import bisect_right
from collections.abc import Callable, Generator, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path
from typing import Any, Final, NamedTuple

from tests.system.loop_stand import read_runs
from tests.system.opcua.client import OUTPUTS, USERS
from tests.system.opcua.compensated import LATE_CYCLES, Rules, make_site, read_history
from tests.system.opcua.foreign_server import ForeignServer
from tests.system.opcua.relay import Relay
from tests.system.programs import Program, Recorded, gaps
from thermaxis.codes import Message
from thermaxis.compensation import RequestKind
from thermaxis.errors import ConfigurationError
from thermaxis.runtime import EventRecord, read_machine
from thermaxis.runtime.config import keep_touch_proof, state_file_of
from thermaxis.runtime.history import HistoryReader
from thermaxis.runtime.host import ask_loop

AXES = tuple(axis for axis, _, _ in OUTPUTS.values())
READ_BACK_S: Final = 3.0
"""A machine may take an offset over so late. [s]"""
RULES: Final = Rules(
    rate_um_per_s=10.0,
    supervisor={
        "settle_s": 1.0,
        "input_timeout_s": 0.3,
        "hold_input_s": 1.5,
        "hold_connection_s": 1.5,
        "read_back_s": READ_BACK_S,
        "ask_enables": "true",
    },
)
TOUCH_S: Final = 1.5
TOUCHED: Final = """
[probe.Z_um]
node = "{touch}"
unit = "um"
counter_node = "{counter}"
largest_um = 4.0
largest_rate_um_per_s = 5.0
drift_um_per_root_h = 100.0
acts = true
"""
"""Touches at one output, far more often and faster than on any machine."""
LONGEST_STEP_S: Final = LATE_CYCLES * RULES.cycle_s
TOLERANCE_UM: Final = 0.5
"""What another writer changes by less is not noticed. [µm]"""
ROUNDED_UM: Final = 0.11
"""Tenths of a micrometre, rounded twice. [µm]"""
MACHINE_RATE_UM_PER_S: Final = 1e4
"""The machine goes where it is told at once. [µm/s]"""
TOLD_WITHIN_S: Final = 60.0
"""What must be told lasts no longer. [s]"""
WRITES_BETWEEN: Final = 9
"""Writes between two faults, three of each offset: a cycle lies wholly between them. [1]"""
UNDER_WAY_S: Final = 15.0
"""A write is no longer under way than a network held it. [s]"""
PLC_S: Final = 0.01
"""It looks so often. [s]"""


class Happened(NamedTuple):
    """One fault, and its monotonic time. [s]"""

    name: str
    began_s: float


@dataclass
class Trial:
    """A loop, a network and a machine, and what goes wrong between them."""

    machine: ForeignServer
    relay: Relay
    configuration: Path
    chance: random.Random
    happened: list[Happened] = field(default_factory=list[Happened])

    def begin(self) -> None:
        """Start the loop, and wait until it compensates."""
        self.loop = Program(["run", self.configuration, "--enable"], self.configuration.parent)
        self.settle()

    def settle(self, limit_s: float = 120.0) -> None:
        """Wait until it compensates, as the machine saw; a fault is acknowledged once it may be."""
        until_s, enough = time.monotonic() + limit_s, self.writes() + WRITES_BETWEEN
        while time.monotonic() < until_s:
            time.sleep(0.5)
            state = self.loop.state()
            if state == "Active" and self.writes() >= enough:
                return
            if state in {"Fault", "Off", "Fading"}:
                kind = RequestKind.ACKNOWLEDGE if state == "Fault" else RequestKind.ENABLE
                with suppress(ConfigurationError):  # it is not there yet
                    ask_loop(state_file_of(self.configuration), kind)
        raise RuntimeError(f"not active again: {self.loop.tail()}")

    def writes(self) -> int:
        """Return how many offsets the machine was told."""
        path = self.machine.record_path
        return path.read_bytes().count(b'"write"') if path.is_file() else 0

    def told(self) -> bool:
        """Whether the history says what the last fault was."""
        last = self.happened[-1]
        with HistoryReader(f"sqlite:///{self.configuration.parent / 'history.db'}") as reader:
            return not EXPECTED[last.name].isdisjoint(_told(reader.events(), last.began_s))

    def last_until_told(self) -> None:
        """Wait until the history says what the fault is; the judge finds it if that never comes."""
        until_s = time.monotonic() + TOLD_WITHIN_S
        while not self.told() and time.monotonic() < until_s:
            time.sleep(0.3)

    def suffer(self, name: str) -> None:
        """Wait until the loop compensates, and let one thing go wrong."""
        self.settle()
        self.happened.append(Happened(name, time.monotonic()))
        FAULTS[name](self)
        time.sleep(self.chance.uniform(0.3, 1.0))
        self.machine.tell(fault="none", channel="Temp1", late_s=0.0)
        self.relay.delay_s = 0.0

    # ---- what goes wrong ------------------------------------------------------------------------

    def other(self) -> None:
        """Somebody sets one offset to anything, far outside as well."""
        um = self.chance.choice((5.0, 12.0, 40.0, 100.0)) * self.chance.choice((-1.0, 1.0))
        self.machine.tell(others_um={self.chance.choice(AXES): um})
        time.sleep(1.0)

    def others(self) -> None:
        """Another program writes all the time."""
        until_s = time.monotonic() + TOLD_WITHIN_S
        while not self.told() and time.monotonic() < until_s:
            axes = dict.fromkeys(AXES, self.chance.uniform(-20.0, 20.0))
            self.machine.tell(others_um=axes)
            time.sleep(0.3)

    def late(self) -> None:
        """The PLC takes offsets over late for a while."""
        self.machine.tell(late_s=self.chance.choice((0.05, 0.2, 0.5, 1.0, 1.5)))
        time.sleep(5.0)

    def delayed(self) -> None:
        """The network is slow."""
        self.relay.delay_s = self.chance.choice((0.02, 0.1, 0.3, 0.8))
        time.sleep(2.0)

    def hole(self) -> None:
        """The network holds everything, and delivers it later."""
        seconds = self.chance.choice((0.3, 0.8, 1.5, 3.0, 5.0))
        self.relay.hold(seconds)
        time.sleep(seconds)

    def frozen_server(self) -> None:
        """The server stands still."""
        self.machine.freeze()
        time.sleep(self.chance.choice((0.5, 1.5, 3.0)))
        self.machine.thaw()

    def frozen_loop(self) -> None:
        """The loop stands still."""
        self.loop.signal(signal.SIGSTOP)
        time.sleep(self.chance.choice((0.3, 1.0, 3.0, 6.0)))
        self.loop.signal(signal.SIGCONT)

    def killed_loop(self) -> None:
        """The loop is killed, and started again."""
        self.loop.kill()
        time.sleep(self.chance.choice((0.0, 3.0)))
        self.begin()

    def interlock(self) -> None:
        """The emergency stop is pressed."""
        self.machine.tell(flags={"EmergencyStop": True})
        self.last_until_told()
        self.machine.tell(flags={"EmergencyStop": False})

    def has(self, fault: str, *seconds: float) -> None:
        """Let the machine have a fault of its own."""
        self.machine.tell(fault=fault, channel="Temp1")
        time.sleep(self.chance.choice(seconds))
        if self.happened[-1].name in {"sensor", "refused"}:
            self.last_until_told()


_MADE_HERE = "other others late delayed hole frozen_server frozen_loop killed_loop interlock"
FAULTS: Final[Mapping[str, Callable[[Trial], None]]] = {
    **{name: getattr(Trial, name) for name in _MADE_HERE.split()},
    "reset": lambda trial: trial.relay.reset(),
    "frozen_server": Trial.frozen_server,
    "frozen_loop": Trial.frozen_loop,
    "killed_loop": Trial.killed_loop,
    "interlock": Trial.interlock,
    "sensor": lambda t: t.has(t.chance.choice(("bad", "nan", "null", "frozen")), 1.6, 4.0),
    "refused": lambda trial: trial.has("refuse", 1.6, 5.0),
    "deaf": lambda trial: trial.has("deaf", 1.5, 6.0),  # the PLC does not see the heartbeat
    "stuck": lambda trial: trial.has("stuck", 1.0, 5.0),  # what acts stands
}
OFTEN: Final = {"other": 5, "others": 1, "late": 4, "hole": 4, "delayed": 3}
"""How often a fault is drawn, where not twice."""
LOST: Final = {f"{k}-{w}_lost" for k in ("event", "alarm") for w in ("sink", "source")}
EXPECTED: Final = {
    "other": {"alarm-another_writer", "alarm-offset_mismatch", "alarm-fault_offset_outside"},
    "others": {"alarm-fault_double_compensation", "alarm-fault_offset_outside"},
    "killed_loop": {"event-saved_state"},
    "sensor": {"alarm-sensor_bad", "alarm-sensor_unread", "input_bad"},
    "refused": {"alarm-write_refused", "event-sink_reason"},
    "interlock": {"interlock_open"},
    "frozen_loop": {"alarm-late"},
    "deaf": {"alarm-offset_mismatch", "alarm-no_effect", "alarm-fault_read_back_differs"},
    **dict.fromkeys(("delayed", "hole", "reset", "frozen_server"), LOST),
}
"""Of these codes one at least must stand in the history, if the fault could be felt."""
OTHERS_CODES: Final = {"alarm-another_writer", "alarm-fault_double_compensation"}
"""What must not be told but of other writers."""


def drawn(count: int, seed: int) -> list[str]:
    """Return so many faults."""
    chance = random.Random(seed)  # noqa: S311 - repeatable
    urn = [name for name in FAULTS for _ in range(OFTEN.get(name, 2))]
    return [chance.choice(urn) for _ in range(count)]


def campaign(folder: Path, count: int, seed: int, machines: int) -> "list[Judged]":
    """Deal faults to machines side by side, each with a loop of its own; judge each of them.

    Each kind comes once at least, and what takes a minute to acknowledge last.
    """
    names = sorted([*FAULTS, *drawn(count - len(FAULTS), seed)])

    def one(k: int) -> Judged:
        dealt = names[k::machines]
        random.Random(seed + k).shuffle(dealt)  # noqa: S311 - repeatable
        own = folder / f"machine-{k}"
        own.mkdir()
        return suffered(own, seed + k, lambda _: sorted(dealt, key="others".__eq__))

    with ThreadPoolExecutor(machines) as pool:
        return list(pool.map(one, range(machines)))


def suffered(folder: Path, seed: int, names: Callable[[Trial], Iterable[str]]) -> "Judged":
    """Let one machine have faults, end its loop, and judge."""
    with trial(folder, seed) as tried:
        for name in names(tried):
            tried.suffer(name)
        if tried.happened[-1].name != "others":  # a fault, for a minute
            tried.settle()
        code = tried.loop.stop(180.0)
    lines = (folder / "machine" / "offsets.jsonl").read_text(encoding="utf-8").splitlines()
    events = read_history(folder).events
    found = judged(list(map(json.loads, lines)), read_runs(folder), events, tried.happened)
    return found._replace(breaches=found.breaches + [f"exit code {code}"] * (code != 0))


@contextmanager
def trial(folder: Path, seed: int) -> Generator[Trial]:
    """Yield a loop that compensates a machine through a network; it is ended in the end."""
    with (
        ForeignServer(
            folder / "machine",
            users=USERS,
            swing_k=2.0,
            swing_s=12.0,
            record_writes=True,
            life_s=5400.0,
            plc_s=PLC_S,
            machine_rate_um_per_s=MACHINE_RATE_UM_PER_S,
            watchdog_s=1.0,
            touch_s=TOUCH_S,
        ) as machine,
        Relay(machine.port) as relay,
    ):
        touched = TOUCHED.format(touch=machine.node("TouchZ"), counter=machine.node("Touches"))
        configuration = make_site(folder, machine, RULES, touched)
        text = configuration.read_text(encoding="utf-8")
        text = text.replace(f":{machine.port}/", f":{relay.port}/")
        configuration.write_text(text, encoding="utf-8")
        keep_touch_proof(read_machine(configuration), "Z_um", proven=True)
        chance = random.Random(seed)  # noqa: S311 - repeatable
        one = Trial(machine, relay, configuration, chance)
        one.begin()
        try:
            yield one
        finally:
            one.loop.end()


# ---- the judgement ------------------------------------------------------------------------------


class Write(NamedTuple):
    """An offset that the machine was told: when it arrived, by the server; when the cycle began
    that commanded it, NaN where the history does not have it; for how long its rate may have moved
    it since the cycle before; its step against the nearest of what stood in the machine, and the
    furthest out of that; whether the machine's watchdog was satisfied."""

    axis: str
    at_s: float
    began_s: float
    step_s: float
    told_um: float
    step_um: float
    stood_um: float
    met: bool


class Moved(NamedTuple):
    """An offset that something else moved."""

    axis: str
    um: float
    at_s: float
    until_s: float


class Judged(NamedTuple):
    """What the machine was told, and what the history says: the largest step of a write against
    what stood just before; by how much a write was ahead of the rate, and beyond the magnitude;
    larger steps while something else had moved the offset, which no loop could know; what a kill
    has cost of the history."""

    happened: Sequence[Happened]
    writes: int
    largest_um: float
    ahead_um: float
    beyond_um: float
    unknown_um: tuple[float, ...]
    lost_s: float
    breaches: list[str]


def judged(
    lines: Sequence[Mapping[str, Any]],
    runs: Sequence[Sequence[Recorded]],
    events: Sequence[EventRecord],
    happened: Sequence[Happened],
) -> Judged:
    """Judge what was recorded on both sides."""
    cycles = [cycle for run in runs for cycle in run]
    writes = list(_writes(lines, cycles))
    moves = list(_moves(lines, writes, happened))
    breaches = [f"no cycles {gaps(run)[:5]} in the history" for run in runs if gaps(run)]
    allowed_um = RULES.rate_um_per_s * LONGEST_STEP_S + TOLERANCE_UM + ROUNDED_UM
    largest_um, ahead_um, beyond_um, lost_s = 0.0, -math.inf, -math.inf, 0.0
    unknown_um: list[float] = []
    last: dict[str, Write] = {}
    for one in writes:
        if math.isnan(one.began_s):
            kills = (h.began_s - one.at_s for h in happened if h.name == "killed_loop")
            lost_s = max(lost_s, min((s for s in kills if s > -1.0), default=1e3))
        before = last.get(one.axis, one)
        last[one.axis] = one
        mine = [m for m in moves if m.axis == one.axis and m.at_s < one.at_s]
        if any(one.began_s < m.until_s for m in mine):
            unknown_um.extend([one.step_um] * (one.step_um > allowed_um))
            continue
        largest_um = max(largest_um, one.step_um)
        if abs(one.told_um) > abs(one.stood_um):
            beyond_um = max(beyond_um, abs(one.told_um) - RULES.largest_um)
        if one.step_um > allowed_um * (1 if one.met else 2):  # the last one may not be taken yet
            breaches.append(f"a step of {one.step_um:.2f} of {allowed_um:.2f} um: {one}")
        one_after = before.met and one.met and one.began_s - before.began_s == one.step_s
        if one_after and not any(before.began_s < m.until_s for m in mine):
            moved_um = abs(one.told_um - before.told_um) - RULES.rate_um_per_s * one.step_s
            if moved_um > ROUNDED_UM:
                breaches.append(f"{moved_um:.2f} um ahead of the rate: {one}, after {before}")
            ahead_um = max(ahead_um, moved_um)
    if beyond_um > ROUNDED_UM:
        breaches.append(f"a write is {beyond_um:.2f} um beyond the limit")
    breaches += untold(cycles, events, happened, writes, moves)
    row = (largest_um, ahead_um, beyond_um, tuple(unknown_um), lost_s)
    return Judged(happened, len(writes), *row, breaches)


def _writes(lines: Sequence[Mapping[str, Any]], cycles: Sequence[Recorded]) -> Iterator[Write]:
    """Yield the writes with the latest cycle that may have commanded them."""
    rows = pairwise([*cycles[:1], *cycles])  # written or not is unknown where no answer came
    acted = [c for before, c in rows if c.written or c.correction_um != before.correction_um]
    began_s, step_s = math.nan, LONGEST_STEP_S
    for line in lines:
        if line["kind"] != "write":
            continue
        told_um, at_s = line["told_um"], line["monotonic_s"]
        if line["axis"] == "Z":  # the first of a write, and not rounded by the machine
            began_s, step_s = (
                _commanded(acted, told_um, at_s)
                or _commanded(cycles, told_um, at_s)
                or (math.nan, LONGEST_STEP_S)
            )
        places = [line["acts_um"]] + [line["node_um"], line["took_um"]] * line["met"]
        step_um = min(abs(told_um - um) for um in places)
        stood_um = max(places, key=abs)
        yield Write(line["axis"], at_s, began_s, step_s, told_um, step_um, stood_um, line["met"])


def _commanded(
    cycles: Sequence[Recorded], told_um: float, at_s: float
) -> tuple[float, float] | None:
    """Return when the latest cycle began that may have commanded a write, and its step. [s]"""
    k = bisect_right(cycles, at_s, key=lambda cycle: cycle.monotonic_s) - 1
    while k >= 0 and at_s - cycles[k].monotonic_s < UNDER_WAY_S:
        if abs(cycles[k].correction_um[0] - told_um) <= 0.001:
            began_s = cycles[k].monotonic_s
            after_one = k >= 1 and cycles[k].number > 1
            step_s = began_s - cycles[k - 1].monotonic_s if after_one else LONGEST_STEP_S
            return began_s, min(LONGEST_STEP_S, step_s)
        k -= 1
    return None


def _moves(
    lines: Iterable[Mapping[str, Any]], writes: Sequence[Write], happened: Sequence[Happened]
) -> Iterator[Moved]:
    """Yield what others wrote, and what the watchdog took back and gave again.

    A value of others on the way that a control may take by itself cannot be told from that, nor
    an old one that acts again: it lasts until the next write.
    """
    for line in lines:
        at_s = line["monotonic_s"]
        trips, others_um = line.get("met") is False, line.get("others_um", {})
        for axis in AXES if line["kind"] == "watchdog" else others_um:
            mine = [one for one in writes if one.axis == axis]
            after_s = next((one.at_s for one in mine if one.at_s > at_s), at_s)
            um = others_um.get(axis, 0.0)
            until_s = at_s + 2.0 * PLC_S
            if not trips and (not others_um or _on_the_way(um, at_s, mine, happened)):
                until_s = after_s
            yield Moved(axis, um, at_s, until_s)


def _on_the_way(
    um: float, at_s: float, mine: Sequence[Write], happened: Sequence[Happened]
) -> bool:
    """Whether a value lies among those written shortly before, or what a watchdog may do."""
    since_s = at_s - READ_BACK_S - 1.0
    before = [one for one in mine if since_s - UNDER_WAY_S < one.at_s <= at_s]
    recent = [one.told_um for one in before if one.at_s >= since_s]
    lost = any(b.at_s - a.at_s > 1.5 * RULES.cycle_s for a, b in pairwise(before))
    if lost or any(0.0 < at_s - h.began_s < UNDER_WAY_S for h in happened if h.name == "reset"):
        recent = [0.0, *(one.told_um for one in before)]
    nearest_um = min(max(um, min(recent, default=um)), max(recent, default=um))
    return abs(um - nearest_um) <= TOLERANCE_UM + ROUNDED_UM


def untold(
    cycles: Sequence[Recorded],
    events: Sequence[EventRecord],
    happened: Sequence[Happened],
    writes: Sequence[Write],
    moves: Sequence[Moved],
) -> list[str]:
    """Return the faults of which the history does not say what they were, or something else."""
    wrong = [f"no words for {e.code}" for e in events if not e.text or e.code in e.text]
    for one, (_, end_s) in pairwise([*happened, Happened("", math.inf)]):
        codes = _told(events, one.began_s, end_s, standing=False)
        own = [cycle for cycle in cycles if one.began_s <= cycle.monotonic_s < end_s]
        moved = [m for m in moves if one.began_s <= m.at_s < end_s]
        wanted = EXPECTED.get(one.name, set())
        told = _told(events, one.began_s, end_s)
        if wanted and not told & wanted and _felt(one.name, own, moved, writes):
            wrong.append(f"{one.name}: {sorted(codes)}")
        if one.name not in {"other", "others"} and codes & OTHERS_CODES:
            wrong.append(f"{one.name}: {sorted(codes & OTHERS_CODES)}")
    return wrong


def _told(
    events: Iterable[EventRecord], began_s: float, end_s: float = math.inf, *, standing: bool = True
) -> set[str]:
    """Return what the history says between two times, and which alarms stood before."""
    shift_s = time.time() - time.monotonic()
    codes: set[str] = set()
    stood: set[str] = set()
    for event in events:
        at_s = event.utc.timestamp() - shift_s
        gone = event.code == "event-alarm_gone"
        if at_s < began_s:
            stood = stood - _codes(event) if gone else stood | _codes(event)
        elif at_s < end_s and not gone and event.kind != "request":  # whose answer names old alarms
            codes |= _codes(event)
    return codes | {code for code in stood if standing and code.startswith("alarm-")}


def _felt(
    name: str, own: Sequence[Recorded], moved: Sequence[Moved], writes: Sequence[Write]
) -> bool:
    """Whether the loop could notice: a connection is made again between two cycles at times."""
    if name == "frozen_loop":
        return any(b.monotonic_s - a.monotonic_s > 1.2 for a, b in pairwise(own))
    if name in {"delayed", "hole", "reset", "frozen_server"}:
        return not all(cycle.written for cycle in own)
    if name in {"deaf", "other"}:  # nobody looks at what is written over before a look
        for one in moved:
            mine = [w for w in writes if w.axis == one.axis]
            after = next((w for w in mine if w.at_s > one.at_s), None)
            told_um = [w.told_um for w in mine if w.at_s <= one.at_s][-1]
            far = abs(told_um - one.um) > TOLERANCE_UM + ROUNDED_UM
            if far and after is not None and after.began_s > one.until_s:
                return True
        return False
    return True


def _codes(value: object) -> set[str]:
    """Return the codes and words of a message, and of those within."""
    if isinstance(value, EventRecord | Message):
        return {value.code}.union(*map(_codes, value.values.values()))
    return set(re.findall(r"[\w-]+", str(value)))
