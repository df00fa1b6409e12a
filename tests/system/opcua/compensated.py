"""A whole machine, compensated: ``thermaxis run`` in a program of its own, the foreign server.

What is checked is taken from three sides: the machine's own record of what it was told, the
history that the loop left, and the lines that it printed.
"""

from collections import deque
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

from tests.in_time import slowness
from tests.system.opcua.client import OUTPUTS, USERS, make_identity
from tests.system.opcua.foreign_server import ForeignServer, Line
from tests.system.programs import Recorded, recorded_cycles
from thermaxis.compensation import (
    CompensationModel,
    Output,
    Part,
    Section,
    SupervisorState,
)
from thermaxis.files import write_model
from thermaxis.runtime import EventRecord
from thermaxis.runtime.history import HistoryReader

LATE_CYCLES = 2.0
"""A late cycle may move an offset by what the rate allows in so many cycles."""
INPUT = """
[input.{name}]
node = "{node}"
unit = "degC"
lowest_c = 5.0
highest_c = 90.0
largest_rate_k_per_s = {rate_k_per_s}
longest_age_s = 1.0
"""
OUTPUT = """
[output.{name}]
node = "{offset}"
read_back_node = "{accepted}"
effective_node = "{effective}"
unit = "{unit}"
sign = "{sign}"
largest_um = {largest_um}
largest_rate_um_per_s = {rate_um_per_s}
"""
CONFIGURATION = """\
[machine]
name = "machine by others"
cycle_s = {cycle_s}
model = "model.json"

[connection.control]
url = "{url}"
security = "Basic256Sha256"
user = "operator"
password_file = "password"
certificate = "own.der"
private_key = "own.pem"
server_certificate = "control.der"

[source]
kind = "opcua"
connection = "control"

[sink]
kind = "opcua"
connection = "control"
heartbeat_node = "{heartbeat}"

[interlock.referenced]
node = "{referenced}"
met = true

[interlock.no_emergency_stop]
node = "{emergency_stop}"
met = false

{more}
[historian]
url = "sqlite:///history.db"
retention_days = 1

[server]
port = 0
anonymous_role = "viewer"

[supervisor]
"""


@dataclass(frozen=True, kw_only=True)
class Rules:
    """What the compensation of the machine may do."""

    cycle_s: float = 0.1
    """Cycle. [s]"""
    largest_um: float = 20.0
    """Largest magnitude of every offset. [µm]"""
    rate_um_per_s: float = 2.0
    """Largest rate of every offset. [µm/s]"""
    temperature_rate_k_per_s: float = 2.0
    """Fastest plausible change of a temperature. [K/s]"""
    supervisor: Mapping[str, float | str] | None = None
    """Keys of ``[supervisor]``."""


def model() -> CompensationModel:
    """Return a model of three outputs, fast enough for tests."""
    gains = {"Z_um": (6.0, 4.0), "X_um": (-5.0, -3.0), "Y_um": (2.0, 8.0)}
    return CompensationModel(
        outputs=tuple(
            Output(
                name,
                (
                    Part(
                        "spindle",
                        "Temp1",
                        "Temp3",
                        direct_gain_um_per_k=direct,
                        sections=(Section(slow, 5.0),),
                        lowest_k=-30.0,
                        highest_k=30.0,
                    ),
                    Part(
                        "table",
                        "Temp2",
                        "Temp3",
                        sections=(Section(slow, 30.0), Section(direct, 120.0)),
                        lowest_k=-30.0,
                        highest_k=30.0,
                    ),
                ),
            )
            for name, (direct, slow) in gains.items()
        )
    )


def make_site(folder: Path, machine: ForeignServer, rules: Rules, more: str = "") -> Path:
    """Write certificates, password, model and configuration with more tables; return the last."""
    server = machine.write_certificate(folder / "control.der")
    identity = make_identity(folder, "own", server)
    machine.trust(identity.certificate)
    password = folder / "password"
    password.touch(0o600)
    password.write_text(USERS["operator"]["password"] + "\n", encoding="utf-8")
    write_model(model(), folder / "model.json")
    text = CONFIGURATION.format(
        cycle_s=rules.cycle_s,
        url=machine.url,
        heartbeat=machine.node("Heartbeat"),
        referenced=machine.node("Referenced"),
        emergency_stop=machine.node("EmergencyStop"),
        more=more,
    )
    for key, value in (rules.supervisor or {}).items():
        text += f"{key} = {value}\n"
    for name in ("Temp1", "Temp2", "Temp3"):
        rate = rules.temperature_rate_k_per_s
        text += INPUT.format(name=name, node=machine.node(name), rate_k_per_s=rate)
    for name, (axis, unit, sign) in OUTPUTS.items():
        text += OUTPUT.format(
            name=name,
            offset=machine.node(f"Offset{axis}"),
            accepted=machine.node(f"Accepted{axis}"),
            effective=machine.node(f"Effective{axis}"),
            unit=unit,
            sign=sign,
            largest_um=rules.largest_um,
            rate_um_per_s=rules.rate_um_per_s,
        )
    path = folder / "machine.toml"
    path.write_text(text, encoding="utf-8")
    return path


# ---- what was recorded --------------------------------------------------------------------------


class History(NamedTuple):
    """What the loop left."""

    cycles: list[Recorded]
    """Every cycle."""
    events: list[EventRecord]
    """Every event."""


def read_history(folder: Path) -> History:
    """Read the history of a run that has ended."""
    with HistoryReader(f"sqlite:///{folder / 'history.db'}") as reader:
        return History(recorded_cycles(folder / "history.db"), list(reader.events()))


class Stay(NamedTuple):
    """A time in one state."""

    state: SupervisorState
    """The state."""
    begin_s: float
    """Monotonic time of its first cycle. [s]"""
    end_s: float
    """Monotonic time of the first cycle after it, or of its last. [s]"""


def stays(cycles: Sequence[Recorded]) -> list[Stay]:
    """Return the states one after the other."""
    found: list[Stay] = []
    for cycle in cycles:
        state, at_s = cycle.state, cycle.monotonic_s
        if found and found[-1].state is state:
            found[-1] = found[-1]._replace(end_s=at_s)
        else:
            if found:
                found[-1] = found[-1]._replace(end_s=at_s)
            found.append(Stay(state, at_s, at_s))
    return found


# ---- the machine's side -------------------------------------------------------------------------


class Excess(NamedTuple):
    """By how much the machine saw a limit passed; at most zero where it was kept. [µm]"""

    magnitude_um: float
    """Beyond the largest magnitude."""
    return_um: float
    """Beyond what a late cycle may move, from where the machine stood after its return to the
    first offset that it was told."""
    rate_um: float
    """Beyond what the rate allows between any two times, a late cycle granted."""


def excess(
    lines: Sequence[Line],
    axis: str,
    rules: Rules,
    *,
    effective: bool = False,
    busy: float | None = None,
) -> Excess:
    """Hold what the machine was told, or what acted on the tool, against the limits.

    A start of the machine begins anew: where the offset stands then is the machine's doing. On a
    busy computer the machine notes later what it was told, and a late cycle is longer.
    """
    late_um = rules.rate_um_per_s * LATE_CYCLES * rules.cycle_s
    found = _excess(lines, axis, rules, late_um, effective=effective)
    if max(found) > 0.0:
        found = _excess(lines, axis, rules, late_um * (busy or slowness()), effective=effective)
    return found


def _excess(
    lines: Sequence[Line], axis: str, rules: Rules, late_um: float, *, effective: bool
) -> Excess:
    rate = rules.rate_um_per_s
    magnitude = back = ahead = float("-inf")
    begins, before, lowest, lowest_down = True, 0.0, 0.0, 0.0
    for line in lines:
        offsets = line.effective_um if effective else line.accepted_um
        if not offsets:
            continue
        value = offsets[axis]
        if line.kind == "start":
            begins, before = True, value
            continue
        up, down = value - rate * line.monotonic_s, -value - rate * line.monotonic_s
        magnitude = max(magnitude, abs(value) - rules.largest_um)
        if begins:
            back = max(back, abs(value - before) - late_um)
            begins, lowest, lowest_down = False, up, down
        ahead = max(ahead, up - lowest - late_um, down - lowest_down - late_um)
        lowest, lowest_down = min(lowest, up), min(lowest_down, down)
    return Excess(magnitude, back, ahead)


def fastest_um_per_s(lines: Sequence[Line], axis: str, over_s: float) -> float:
    """Return the largest mean rate over a time, as the machine saw it. [µm/s]"""
    fastest = 0.0
    window: deque[tuple[float, float]] = deque()
    for line in lines:
        if line.kind == "start":
            window.clear()
        if line.kind != "accepted":
            continue
        at_s, value = line.monotonic_s, line.accepted_um[axis]
        window.append((at_s, value))
        while len(window) > 1 and window[1][0] <= at_s - over_s:
            window.popleft()
        began_s, began = window[0]
        if at_s - began_s >= over_s:
            fastest = max(fastest, abs(value - began) / (at_s - began_s))
    return fastest
