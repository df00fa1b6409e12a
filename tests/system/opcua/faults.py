"""Faults drawn at random, one after the other, against a loop and a server of others.

The server writes down every write of an offset, with where the offset stood just before; nothing
of what the loop says of itself is needed to judge its steps.
"""

import json
import random
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Generator, Iterable, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, NamedTuple

from tests.system.opcua.client import OUTPUTS, USERS
from tests.system.opcua.compensated import LATE_CYCLES, Rules, make_site, read_history
from tests.system.opcua.foreign_server import ForeignServer
from tests.system.opcua.relay import Relay
from tests.system.programs import Program

AXES = tuple(axis for axis, _, _ in OUTPUTS.values())
RULES: Final = Rules(
    rate_um_per_s=5.0,
    supervisor={
        "settle_s": 1.0,
        "input_timeout_s": 0.3,
        "hold_input_s": 1.5,
        "hold_connection_s": 1.5,
        "read_back_s": 3.0,
        "ask_enables": "true",
    },
)
TOLERANCE_UM: Final = 0.5
"""What another writer changes by less is not noticed. [µm]"""
ROUNDED_UM: Final = 0.11
"""Tenths of a micrometre, rounded twice. [µm]"""


class Happened(NamedTuple):
    """One fault."""

    name: str
    began_s: float
    """Time of day. [s]"""
    ended_s: float


@dataclass
class Trial:
    """A loop, a network and a machine, and what goes wrong between them."""

    machine: ForeignServer
    relay: Relay
    configuration: Path
    chance: random.Random

    def begin(self) -> None:
        """Start the loop, and wait until it compensates."""
        self.loop = Program(["run", self.configuration, "--enable"], self.configuration.parent)
        self.settle()

    def settle(self, limit_s: float = 90.0) -> None:
        """Wait until it compensates; a fault is acknowledged as soon as that is taken."""
        until_s = time.monotonic() + limit_s
        while time.monotonic() < until_s:
            time.sleep(0.5)
            state = self.state()
            if state == "Active":
                return
            if state == "Fault":
                self.ask("acknowledge")
            elif state in {"Off", "Fading"}:
                self.ask("enable")
        raise RuntimeError(f"not active again: {self.loop.tail()}")

    def state(self) -> str:
        """Return the state that the loop printed last."""
        while not self.loop._lines.empty():
            line = self.loop._lines.get()
            if line is None:
                raise RuntimeError(f"it has ended: {self.loop.tail()}")
            self.loop.said.append(line)
        words = [line.text.split()[1:2] for line in self.loop.said if "correction:" in line.text]
        return words[-1][0].rstrip(";") if words else ""

    def ask(self, what: str) -> None:
        """Ask at the computer itself, as a person would."""
        command = [sys.executable, "-m", "thermaxis", "ask", str(self.configuration), what]
        subprocess.run(command, capture_output=True, check=False, timeout=30.0)

    def suffer(self, name: str) -> Happened:
        """Let one thing go wrong, and wait until the loop compensates again."""
        began_s = time.time()
        FAULTS[name](self)
        time.sleep(self.chance.uniform(0.3, 1.0))
        ended_s = time.time()
        self.machine.tell(fault="none", channel="Temp1", late_s=0.0)
        self.relay.delay_s = 0.0
        self.settle()
        return Happened(name, began_s, ended_s)

    # ---- what goes wrong ------------------------------------------------------------------------

    def other(self) -> None:
        """Somebody sets one offset to anything, far outside as well."""
        um = self.chance.choice((5.0, 12.0, 40.0, 100.0)) * self.chance.choice((-1.0, 1.0))
        self.machine.tell(others_um={self.chance.choice(AXES): um})
        time.sleep(1.0)

    def others(self) -> None:
        """Another program writes all the time."""
        for _ in range(12):
            axes = dict.fromkeys(AXES, self.chance.uniform(-20.0, 20.0))
            self.machine.tell(others_um=axes)
            time.sleep(0.3)

    def late(self) -> None:
        """The PLC takes offsets over late for a while."""
        self.machine.tell(late_s=self.chance.choice((0.05, 0.2, 0.5, 1.0, 1.5)))
        time.sleep(5.0)

    def stuck(self) -> None:
        """What acts stands while what is accepted moves, until that is a fault."""
        self.machine.tell(fault="stuck", channel="none")
        time.sleep(self.chance.choice((1.0, 5.0)))

    def delayed(self) -> None:
        """The network is slow."""
        self.relay.delay_s = self.chance.choice((0.02, 0.1, 0.3, 0.8))
        time.sleep(2.0)

    def hole(self) -> None:
        """The network holds everything, and delivers it later."""
        seconds = self.chance.choice((0.3, 0.8, 1.5, 3.0, 5.0))
        self.relay.hold(seconds)
        time.sleep(seconds)

    def reset(self) -> None:
        """Connections are dropped."""
        self.relay.reset()

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

    def _fault(self, fault: str, seconds: tuple[float, ...]) -> None:
        self.machine.tell(fault=fault, channel="Temp1")
        time.sleep(self.chance.choice(seconds))

    def sensor(self) -> None:
        """A sensor fails."""
        self._fault(self.chance.choice(("bad", "nan", "null", "frozen")), (1.6, 4.0))

    def refused(self) -> None:
        """The server refuses offsets."""
        self._fault("refuse", (1.6, 5.0))

    def deaf(self) -> None:
        """The PLC does not see the heartbeat."""
        self._fault("deaf", (1.5, 6.0))

    def interlock(self) -> None:
        """The emergency stop is pressed."""
        self.machine.tell(flags={"EmergencyStop": True})
        time.sleep(1.5)
        self.machine.tell(flags={"EmergencyStop": False})


FAULTS: Final[Mapping[str, Callable[[Trial], None]]] = {
    name: getattr(Trial, name)
    for name in (
        *("other", "others", "late", "stuck", "delayed", "hole", "reset", "frozen_server"),
        *("frozen_loop", "killed_loop", "sensor", "refused", "deaf", "interlock"),
    )
}
OFTEN: Final = {"other": 5, "others": 1, "late": 4, "hole": 4, "delayed": 3}
"""How often a fault is drawn, where not twice."""
EXPECTED: Final = {
    "other": {"alarm-another_writer", "alarm-offset_mismatch", "alarm-fault_offset_outside"},
    "others": {"alarm-fault_double_compensation", "alarm-fault_offset_outside"},
    "killed_loop": {"event-saved_state"},
    "sensor": {"alarm-sensor_bad", "alarm-sensor_unread", "input_bad"},
    "refused": {"alarm-write_refused", "event-sink_reason"},
    "interlock": {"interlock_open"},
}
"""Of these codes one at least must stand in the history; a connection that is reset and made again
between two cycles is not felt."""


def drawn(count: int, seed: int) -> list[str]:
    """Return so many faults."""
    chance = random.Random(seed)  # noqa: S311 - repeatable
    urn = [name for name in FAULTS for _ in range(OFTEN.get(name, 2))]
    return [chance.choice(urn) for _ in range(count)]


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
            machine_rate_um_per_s=200.0,
            watchdog_s=1.0,
        ) as machine,
        Relay(machine.port) as relay,
    ):
        configuration = make_site(folder, machine, RULES)
        text = configuration.read_text(encoding="utf-8")
        text = text.replace(f":{machine.port}/", f":{relay.port}/")
        configuration.write_text(text, encoding="utf-8")
        chance = random.Random(seed)  # noqa: S311 - repeatable
        one = Trial(machine, relay, configuration, chance)
        one.begin()
        try:
            yield one
        finally:
            one.loop.end()


# ---- the judgement ------------------------------------------------------------------------------


class Steps(NamedTuple):
    """What the machine was told. [µm]"""

    writes: int
    """How many offsets were written. [1]"""
    largest_um: float
    """Largest step of a write against what stood in the machine just before."""
    beyond_um: float
    """By how much a write went outward beyond the largest magnitude."""
    late_um: float
    """Largest step of a write that came after the watchdog had tripped, against what acted."""


def steps_of(record: Path) -> Steps:
    """Judge every write by what stood in the machine just before it."""
    count, largest_um, beyond_um, late_um = 0, 0.0, float("-inf"), 0.0
    for text in record.read_text(encoding="utf-8").splitlines():
        line = json.loads(text)
        if line["kind"] != "write":
            continue
        count += 1
        told_um, node_um, took_um = line["told_um"], line["node_um"], line["took_um"]
        stood_um = min((node_um, took_um, line["acts_um"]), key=lambda um: abs(told_um - um))
        if line["met"]:
            largest_um = max(largest_um, abs(told_um - stood_um))
        else:
            late_um = max(late_um, abs(told_um - line["acts_um"]))
        if abs(told_um) > abs(stood_um):
            beyond_um = max(beyond_um, abs(told_um) - RULES.largest_um)
    return Steps(count, largest_um, beyond_um, late_um)


def allowed_um(slow: float = 1.0) -> float:
    """Return the largest step that a write may make: a late cycle's. [µm]"""
    return RULES.rate_um_per_s * LATE_CYCLES * RULES.cycle_s * slow + TOLERANCE_UM + ROUNDED_UM


def untold(folder: Path, happened: Iterable[Happened]) -> list[str]:
    """Return the faults of which the history does not say what they were."""
    events = read_history(folder).events
    missing: list[str] = []
    for one in happened:
        wanted = EXPECTED.get(one.name)
        if wanted is None:
            continue
        codes: set[str] = set()
        for event in events:
            at_s = event.utc.timestamp()
            if one.began_s - 0.2 <= at_s <= one.ended_s + 5.0:
                codes |= _codes(event.code, event.values)
        if not codes & wanted:
            missing.append(f"{one.name}: {sorted(codes)}")
    return missing


def _codes(code: str, values: Mapping[str, Any]) -> set[str]:
    found = {code}
    for value in values.values():
        if hasattr(value, "code"):
            found |= _codes(value.code, value.values)
        elif isinstance(value, list | tuple):
            found |= {str(one) for one in value}
        else:
            found.add(str(value))
    return found
