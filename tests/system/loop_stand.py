"""A virtual lathe, its compensation and a watcher, each a program or a connection of its own.

The lathe's offset has no limits of its own worth the name, so that what the watcher sees is what
the loop did. The watcher also writes the workpiece's diameter, by which the correction is
multiplied: the goal never rests.
"""

import asyncio
import random
import signal
import threading
import time
from collections.abc import Generator, Iterable, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path
from typing import Any, Final, NamedTuple, Self

from asyncua import ua
from asyncua.client.client import Client

from tests.in_time import LONGEST_S, in_time, slowness
from tests.system.programs import (
    Program,
    Recorded,
    Said,
    compensating,
    gaps,
    recorded_cycles,
)
from thermaxis.compensation import (
    CompensationModel,
    GainPoint,
    Output,
    Part,
    Section,
    SupervisorState,
)
from thermaxis.files import write_model
from thermaxis.runtime import SHORTEST_WAIT_S

NODES: Final = "nsu=urn:thermaxis:lathe;s="
MACHINE_RATE_UM_PER_S: Final = 200.0
"""The machine follows what it is told a hundred times faster than the loop may move it. [µm/s]"""
LARGEST_UM: Final = 36.0
"""Limit of the correction; the model asks for up to 40 µm. [µm]"""
RATE_UM_PER_S: Final = 5.0
"""Rate of the correction. [µm/s]"""
CYCLE_S: Final = 0.1
"""Cycle of the loop. [s]"""
LATE_UM: Final = 2.0 * RATE_UM_PER_S * CYCLE_S
"""A late cycle may move the offset by what the rate allows in two. [µm]"""
AHEAD_UM: Final = LATE_UM + RATE_UM_PER_S * SHORTEST_WAIT_S
"""So far it may be ahead of its rate between any two moments: a write follows the begin of its
cycle by what the reading took, up to its deadline, and the next one may follow at once. [µm]"""
SETTLE_S: Final = 0.5
"""Time after which the model may act. [s]"""
HEAL_S: Final = 0.2
"""Time for which everything must be there. [s]"""
ROUNDED_UM: Final = 1e-6
"""What two roundings of an offset cost. [µm]"""
LOOKED_EVERY_S: Final = 0.05
"""The watcher looks twenty times a second. [s]"""
DIAMETERS_MM: Final = (0.0, 3000.0)
"""Between these the watcher's diameter jumps. [mm]"""
CONFIGURATION: Final = """\
[machine]
name = "virtual lathe"
cycle_s = {cycle_s}
model = "model.json"
state_file = "lathe.state.json"

[connection.lathe]
url = "{url}"
security = "none"

[source]
kind = "opcua"
connection = "lathe"

[sink]
{sink}

[input.T_spindle_C]
node = "{nodes}T_spindle_C"
unit = "degC"
lowest_c = 5.0
highest_c = 80.0

[input.T_column_C]
node = "{nodes}T_column_C"
unit = "degC"
lowest_c = 5.0
highest_c = 45.0

[interlock.referenced]
node = "{nodes}referenced"
met = true

[other_compensation]
node = "{nodes}own_compensation"
active = true

[diameter]
node = "{nodes}diameter_mm"
unit = "mm"

[output.Z_um]
{output}
largest_um = {largest_um}
largest_rate_um_per_s = {rate_um_per_s}

[supervisor]
settle_s = {settle_s}
recovery_delay_s = {recovery_delay_s}
hold_connection_s = 30.0
stop_within_s = 60.0

[historian]
url = "sqlite:///history.db"
retention_days = 1
"""
OPCUA_SINK: Final = f"""\
kind = "opcua"
connection = "lathe"
heartbeat_node = "{NODES}heartbeat"
"""
OPCUA_OUTPUT: Final = f"""\
node = "{NODES}offset_mm"
read_back_node = "{NODES}offset_accepted_mm"
effective_node = "{NODES}offset_effective_mm"
unit = "mm"
sign = "positive moves the tool away from the workpiece"
"""


def model() -> CompensationModel:
    """Return a model that asks for 10 to 40 µm on a machine at rest, by the diameter."""
    spindle = Part(
        "spindle",
        "T_spindle_C",
        "T_column_C",
        direct_gain_um_per_k=0.8,
        sections=(Section(0.2, 3.0),),
        gain_by_diameter=(GainPoint(DIAMETERS_MM[0], 1.0), GainPoint(DIAMETERS_MM[1], 4.0)),
        lowest_k=-30.0,
        highest_k=30.0,
    )
    return CompensationModel(
        outputs=(Output("Z_um", (spindle,)),),
        reference="stated",
        reference_c={"T_spindle_C": 10.5, "T_column_C": 20.5},
    )


def write_site(
    folder: Path, url: str, *, sink: str = OPCUA_SINK, output: str = OPCUA_OUTPUT, more: str = ""
) -> Path:
    """Write model and configuration into a folder; return the configuration."""
    write_model(model(), folder / "model.json")
    text = CONFIGURATION.format(
        cycle_s=CYCLE_S,
        url=url,
        nodes=NODES,
        sink=sink,
        output=output,
        largest_um=LARGEST_UM,
        rate_um_per_s=RATE_UM_PER_S,
        settle_s=SETTLE_S,
        recovery_delay_s=HEAL_S,
    )
    path = folder / "machine.toml"
    path.write_text(text + more, encoding="utf-8")
    return path


# ---- programs -----------------------------------------------------------------------------------


@contextmanager
def lathe(folder: Path, *, watchdog: str) -> Generator[str]:
    """Serve the virtual lathe on a free port; yield its address."""
    program = Program(
        [
            "machine",
            *("--scenario", "verification", "--port", "0", "--stop-after", "3600s"),
            *("--watchdog", watchdog, "--rate", f"{MACHINE_RATE_UM_PER_S:g}", "--clamp", "100"),
        ],
        folder,
    )
    try:
        yield program.wait_for("endpoint: ", 120.0).text.partition("endpoint: ")[2]
    finally:
        program.end()


# ---- the machine's side -------------------------------------------------------------------------


class Look(NamedTuple):
    """What stood in the machine at one moment."""

    at_s: float
    """When the watcher asked, monotonic. [s]"""
    server_s: float
    """Time of day of the machine's clock. [s]"""
    accepted_um: float
    """Offset as it was accepted. [µm]"""
    effective_um: float
    """Offset that acts. [µm]"""
    heartbeat: int
    """Writes so far. [1]"""
    alive: bool
    """Whether the machine's watchdog is satisfied."""


@dataclass
class Watcher:
    """A second client of the machine: looks at its offset, and keeps its goal moving."""

    url: str
    """Address of the machine."""
    seed: int = 1
    """Seed of the diameters. [1]"""
    looks: list[Look] = field(default_factory=list[Look])
    """Everything that it saw."""
    _end: threading.Event = field(default_factory=threading.Event)
    _failed: list[BaseException] = field(default_factory=list[BaseException])

    def __enter__(self) -> Self:
        self._thread = threading.Thread(target=self._live, daemon=True)
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._end.set()
        self._thread.join(LONGEST_S)
        assert not self._failed, self._failed

    def _live(self) -> None:
        try:
            asyncio.run(self._watch())
        except BaseException as error:  # noqa: BLE001 - told by the test itself
            self._failed.append(error)

    async def _watch(self) -> None:
        names = ("offset_accepted_mm", "offset_effective_mm", "heartbeat", "watchdog_alive")
        chance = random.Random(self.seed)  # noqa: S311 - repeatable
        async with Client(self.url) as client:
            index = await client.get_namespace_index("urn:thermaxis:lathe")
            nodes = [client.get_node(f"ns={index};s={name}") for name in names]
            diameter = client.get_node(f"ns={index};s=diameter_mm")
            due_s = jump_s = time.monotonic()
            jumps = 0
            while not self._end.is_set():
                at_s = time.monotonic()
                if at_s >= jump_s:
                    jump_s, jumps = at_s + chance.uniform(1.0, 6.0), jumps + 1
                    value = ua.Variant(DIAMETERS_MM[jumps % 2], ua.VariantType.Double)
                    await diameter.write_value(ua.DataValue(value))
                self._note(at_s, await client.read_attributes(nodes))
                due_s = max(due_s + LOOKED_EVERY_S, time.monotonic())
                await asyncio.sleep(max(0.0, due_s - time.monotonic()))

    def _note(self, at_s: float, found: Sequence[Any]) -> None:
        accepted, effective, heartbeat, alive = (one.Value.Value for one in found)
        self.looks.append(
            Look(
                at_s,
                found[1].ServerTimestamp.timestamp(),
                1e3 * accepted,
                1e3 * effective,
                int(heartbeat),
                bool(alive),
            )
        )

    @property
    def last(self) -> Look:
        """What it saw last."""
        self._wait(lambda: bool(self.looks), LONGEST_S)
        return self.looks[-1]

    def wait_until(self, what: str, limit_s: float, **limits: float) -> Look:
        """Wait until the effective offset's magnitude is at most, or at least, so many µm."""
        low, high = limits.get("at_least_um", 0.0), limits.get("at_most_um", float("inf"))
        begin = len(self.looks)

        def reached() -> bool:
            return any(low <= abs(look.effective_um) <= high for look in self.looks[begin:])

        assert self._wait(reached, limit_s), f"{what}: {self.looks[-3:]}"
        return self.looks[-1]

    def _wait(self, reached: Any, limit_s: float) -> bool:
        until_s = time.monotonic() + limit_s
        while not reached():
            if time.monotonic() > until_s or self._failed:
                return False
            time.sleep(0.02)
        return True


class Excess(NamedTuple):
    """By how much the machine saw a limit passed; at most zero where it was kept. [µm]"""

    magnitude_um: float
    """Beyond the largest magnitude."""
    rate_um: float
    """Beyond what the rate allows between any two moments of one stay."""
    step_um: float
    """Beyond what the writes between two looks may move, each of them a late cycle's."""
    return_um: float
    """Beyond what one late cycle may move, from where the watchdog had left the offset."""


def excess(looks: Iterable[Look]) -> Excess:
    """Hold what acted on the tool against the limits; what the watchdog takes back is not told.

    On a busy computer the machine follows later what it was told, and a late cycle is longer.
    """
    seen = list(looks)
    found = _excess(seen, LATE_UM, AHEAD_UM)
    if max(found) > 0.0:
        found = _excess(seen, LATE_UM * (slow := slowness()), AHEAD_UM * slow)
    return found


def _excess(looks: Iterable[Look], late_um: float, ahead_um: float) -> Excess:
    magnitude = ahead = step = back = float("-inf")
    lowest = lowest_down = 0.0
    before: Look | None = None
    for look in looks:
        value, due = look.effective_um, RATE_UM_PER_S * look.server_s
        magnitude = max(magnitude, abs(value) - LARGEST_UM, abs(look.accepted_um) - LARGEST_UM)
        if not look.alive:
            before = look
            continue
        if before is None or not before.alive:
            lowest, lowest_down = value - due, -value - due
            if before is not None:
                passed_um = RATE_UM_PER_S * (look.server_s - before.server_s)
                taken_um = max(0.0, abs(before.effective_um) - abs(value))
                moved_um = abs(value - before.effective_um) - taken_um
                back = max(back, moved_um - passed_um - late_um)
        else:
            writes = max(1, look.heartbeat - before.heartbeat)  # the last one may still act
            step = max(step, abs(value - before.effective_um) - writes * late_um)
        ahead = max(ahead, value - due - lowest - ahead_um, -value - due - lowest_down - ahead_um)
        lowest, lowest_down = min(lowest, value - due), min(lowest_down, -value - due)
        before = look
    return Excess(magnitude, ahead, step, back)


def fastest_um_per_s(looks: Sequence[Look], over_s: float = 1.0) -> float:
    """Return the largest mean rate over a time in which the watchdog was satisfied. [µm/s]"""
    fastest, first = 0.0, 0
    for k, look in enumerate(looks):
        if not look.alive:
            first = k + 1
            continue
        while look.server_s - looks[first].server_s > over_s + LOOKED_EVERY_S:
            first += 1
        began = looks[first]
        if look.server_s - began.server_s >= over_s:
            moved_um = abs(look.effective_um - began.effective_um)
            fastest = max(fastest, moved_um / (look.server_s - began.server_s))
    return fastest


def travelled_um(looks: Sequence[Look]) -> float:
    """Return the way that the offset has gone altogether. [µm]"""
    return sum(abs(b.effective_um - a.effective_um) for a, b in pairwise(looks))


# ---- what was recorded --------------------------------------------------------------------------


def read_runs(folder: Path) -> list[list[Recorded]]:
    """Return the recorded cycles of every run that left some, in the order of the runs."""
    runs: list[list[Recorded]] = []
    for cycle in recorded_cycles(folder / "history.db"):
        if not runs or cycle.number <= runs[-1][-1].number:
            runs.append([])
        runs[-1].append(cycle)
    return runs


# ---- kills --------------------------------------------------------------------------------------


class Life(NamedTuple):
    """One run of the loop from its start to its kill."""

    began_s: float
    """When it was started, monotonic. [s]"""
    killed_s: float
    """When it was killed. [s]"""
    first_beat: int
    """The machine's count of writes before its first one. [1]"""
    writes: int
    """How often it wrote, counted by the machine. [1]"""
    said: tuple[Said, ...]
    """What it printed."""


@dataclass
class Campaign:
    """What was seen while the loop was killed again and again."""

    lives: list[Life] = field(default_factory=list[Life])
    """Every run that was killed."""
    looks: list[Look] = field(default_factory=list[Look])
    """What the machine showed."""
    runs: list[list[Recorded]] = field(default_factory=list[list[Recorded]])
    """What the history holds, by run."""
    exit_code: int | None = None
    """Of the last run, which was asked to end."""


class Judgement(NamedTuple):
    """What a campaign proves."""

    kills: int
    """Kills. [1]"""
    active_when_killed: int
    """Runs that were active when they were killed. [1]"""
    moving_when_killed: int
    """Runs that were moving the offset when they were killed. [1]"""
    excess: Excess
    """By how much limits were passed. [µm]"""
    fastest_um_per_s: float
    """Largest rate over a second. [µm/s]"""
    travelled_um: float
    """The way of the offset. [µm]"""
    longest_to_active_s: float
    """Longest time from the first cycle with a machine to the active state. [s]"""
    longest_start_s: float
    """Longest time from the program's start to the first write. [s]"""
    never_active: int
    """Runs that lived long enough to be active, and were not. [1]"""
    gaps: int
    """Cycles that are missing between recorded ones. [1]"""
    cycles: int
    """Recorded cycles. [1]"""
    lost_cycles: int
    """Most cycles that the machine had seen written by one run and that are not recorded. [1]"""
    lost_s: float
    """Longest time between the first cycle that the machine or a printed line proves, and that is
    not recorded, and the kill. [s]"""


def campaign(folder: Path, kills: int, *, watchdog: str, seed: int) -> Campaign:
    """Kill the loop at random moments, and let it end in peace at last."""
    chance = random.Random(seed)  # noqa: S311 - repeatable
    seen = Campaign()
    with lathe(folder, watchdog=watchdog) as url, Watcher(url, seed) as watcher:
        configuration = write_site(folder, url)
        with compensating(configuration, "--enable") as first:
            first.wait_for_state(SupervisorState.ACTIVE, LONGEST_S)
            for k in range(kills):
                before = 0
                program = first
                if k:
                    before = watcher.last.heartbeat
                    program = Program(["run", configuration], folder)
                if chance.random() < 0.3:
                    time.sleep(chance.uniform(0.0, 1.5))  # at its start
                else:
                    if k:
                        program.wait_for("correction: ", LONGEST_S)
                    time.sleep(chance.uniform(0.0, 3.0))
                killed_s = program.kill()
                time.sleep(2.5 * LOOKED_EVERY_S)
                writes = watcher.last.heartbeat - before
                seen.lives.append(
                    Life(program.began_s, killed_s, before, writes, tuple(program.said))
                )
                if watchdog != "off" and chance.random() < 0.3:
                    time.sleep(2.5)  # else the watchdog would hardly ever trip
        with compensating(configuration) as last:
            last.wait_for_state(SupervisorState.ACTIVE, LONGEST_S)
            time.sleep(2.0)
            last.signal(signal.SIGTERM)
            seen.exit_code = last.wait(60.0)
        time.sleep(2.5 * LOOKED_EVERY_S)
    seen.looks, seen.runs = watcher.looks, read_runs(folder)
    return seen


def lost_s(life: Life, looks: Iterable[Look], run: Sequence[Recorded]) -> float:
    """Return how long before the kill the first cycle was that is proven and not recorded. [s]"""
    recorded = sum(cycle.written for cycle in run)
    last_s = run[-1].monotonic_s if run else life.began_s
    proven_s = [
        look.at_s - LOOKED_EVERY_S
        for look in looks
        if life.began_s <= look.at_s <= life.killed_s
        and look.heartbeat - life.first_beat > recorded
    ]
    # A line is read a moment after its cycle began, which may be a recorded one.
    proven_s += [
        said.at_s
        for said in life.said
        if "correction: " in said.text and said.at_s > last_s + 2.0 * CYCLE_S
    ]
    return life.killed_s - min(proven_s, default=life.killed_s)


def judge(seen: Campaign) -> Judgement:
    """Hold a campaign against what the loop promises."""
    moving = active = never = lost_cycles = 0
    to_active = start = lost = 0.0
    for life in seen.lives:
        run: list[Recorded] = []
        for one in seen.runs:
            if life.began_s <= one[0].monotonic_s <= life.killed_s:
                run = one
        with_machine = [cycle for cycle in run if cycle.written]
        lost_cycles = max(lost_cycles, life.writes - len(with_machine))
        lost = max(lost, lost_s(life, seen.looks, run))
        if not with_machine:
            continue
        start = max(start, with_machine[0].monotonic_s - life.began_s)
        first_s = with_machine[0].monotonic_s
        found = [c for c in with_machine if c.state is SupervisorState.ACTIVE]
        if found:
            to_active = max(to_active, found[0].monotonic_s - first_s)
        elif with_machine[-1].monotonic_s - first_s > SETTLE_S + HEAL_S:
            never += 1
        active += run[-1].state is SupervisorState.ACTIVE
        moving += run[-1].correction_um != run[max(len(run) - 2, 0)].correction_um
    return Judgement(
        len(seen.lives),
        active,
        moving,
        excess(seen.looks),
        fastest_um_per_s(seen.looks),
        travelled_um(seen.looks),
        to_active,
        start,
        never,
        sum(len(gaps(run)) for run in seen.runs),
        sum(len(run) for run in seen.runs),
        lost_cycles,
        lost,
    )


def broken_promises(found: Judgement) -> Mapping[str, object]:
    """Return what a judgement holds that must not be, by a sentence."""
    promises: dict[str, tuple[bool, object]] = {
        "the offset stayed within its limit": (
            found.excess.magnitude_um <= ROUNDED_UM,
            found.excess,
        ),
        "no step beyond the rate": (found.excess.rate_um <= ROUNDED_UM, found.excess),
        "no step of a write beyond that of a late cycle": (
            found.excess.step_um <= ROUNDED_UM,
            found.excess,
        ),
        "it goes on where the watchdog left it": (
            found.excess.return_um <= ROUNDED_UM,
            found.excess,
        ),
        "it moved as fast as it may": (
            found.fastest_um_per_s > 0.8 * RATE_UM_PER_S,
            found.fastest_um_per_s,
        ),
        "every run that lived was active again": (found.never_active == 0, found.never_active),
        "it was active within its time": (
            in_time(found.longest_to_active_s, SETTLE_S + HEAL_S + 3.0 * CYCLE_S),
            found.longest_to_active_s,
        ),
        "no gap in the history": (found.gaps == 0, found.gaps),
        "nothing older than a second was lost": (in_time(found.lost_s, 1.0), found.lost_s),
        "no more cycles were lost than a second has": (
            in_time(found.lost_cycles * CYCLE_S, 1.0),
            found.lost_cycles,
        ),
    }
    return {sentence: value for sentence, (kept, value) in promises.items() if not kept}
