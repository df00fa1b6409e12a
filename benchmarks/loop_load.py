"""The load of a large machine: 53 sensors and 4 outputs at 10 Hz on a server that others wrote.

    python -m benchmarks.loop_load [--seconds 60]

Each output has a part for each sensor but the reference, 208 altogether. While the compensation is
active the time of the processor and the memory of the loop and of whatever it started are read
from /proc, the time divided by the cycles that its history holds; each page that programs share
counts in parts. The exit code is 1 beyond the limits.
Linux only.
"""

import argparse
import os
import tempfile
import time
from pathlib import Path
from typing import NamedTuple

from tests.system.opcua.client import USERS
from tests.system.opcua.compensated import (
    INPUT,
    OUTPUT,
    Rules,
    make_site,
    read_history,
)
from tests.system.opcua.foreign_server import ForeignServer, install
from tests.system.programs import compensating
from thermaxis.compensation import CompensationModel, Output, Part, Section, SupervisorState
from thermaxis.files import write_model
from thermaxis.runtime import AWAY

SENSORS, CYCLE_S = 53, 0.1
MOST_SHARE, MOST_MEMORY_MB = 0.04, 120.0
RULES = Rules(cycle_s=CYCLE_S, rate_um_per_s=5.0, supervisor={"settle_s": 2.0})


def model() -> CompensationModel:
    """Return a model in which every temperature acts on every output."""

    def part(name: str) -> Part:
        sections = (Section(0.05, 600.0), Section(0.02, 3600.0))
        return Part(name, name, "Temp3", sections=sections, lowest_k=-30.0, highest_k=30.0)

    names = [f"Temp{k}" for k in range(1, SENSORS + 1) if k != 3]
    parts = tuple(part(name) for name in names)
    return CompensationModel(outputs=tuple(Output(f"{a}_um", parts) for a in "ZXYW"))


def make_large_site(folder: Path, machine: ForeignServer) -> Path:
    """Write the configuration; return it."""
    path = make_site(folder, machine, RULES)
    write_model(model(), folder / "model.json")
    text = path.read_text(encoding="utf-8")
    for k in range(4, SENSORS + 1):
        text += INPUT.format(name=f"Temp{k}", node=machine.node(f"Temp{k}"), rate_k_per_s=2.0)
    nodes = {key.lower(): machine.node(f"{key}W") for key in ("Offset", "Accepted", "Effective")}
    text += OUTPUT.format(
        name="W_um",
        **nodes,
        unit="mm",
        sign=AWAY,
        largest_um=RULES.largest_um,
        rate_um_per_s=RULES.rate_um_per_s,
    )
    path.write_text(text, encoding="utf-8")
    return path


class Cost(NamedTuple):
    """What a program has used so far."""

    cpu_s: float
    """Time of the processor, all threads. [s]"""
    memory_mb: float
    """Memory that it holds. [MB]"""


def cost_of(pid: int) -> Cost:
    """Return what a running program has used."""
    fields = Path(f"/proc/{pid}/stat").read_text(encoding="ascii").rpartition(")")[2].split()
    ticks = int(fields[11]) + int(fields[12])
    words = Path(f"/proc/{pid}/smaps_rollup").read_text(encoding="ascii").split()
    memory_mb = int(words[words.index("Pss:") + 1]) * 1.024e-3
    return Cost(ticks / os.sysconf("SC_CLK_TCK"), memory_mb)


def family(pid: int) -> list[Cost]:
    """Return what a program and all that it started have used."""
    found = [cost_of(pid)]
    for thread in Path(f"/proc/{pid}/task").iterdir():
        for child in (thread / "children").read_text(encoding="ascii").split():
            found += family(int(child))
    return found


def main() -> int:
    """Measure, print, and return 1 beyond a limit."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=60.0)
    seconds = parser.parse_args().seconds
    install()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        with (
            ForeignServer(
                folder / "machine", users=USERS, swing_k=2.0, temperatures=SENSORS
            ) as machine,
            compensating(make_large_site(folder, machine), "--enable") as loop,
        ):
            loop.wait_for_state(SupervisorState.ACTIVE, 90.0)
            time.sleep(10.0)
            began_s, began = time.monotonic(), family(loop.popen.pid)
            time.sleep(seconds)
            ended_s, ended = time.monotonic(), family(loop.popen.pid)
            code = loop.stop(120.0)
        cycles = [c for c in read_history(folder).cycles if began_s <= c.monotonic_s < ended_s]
    used = [after.cpu_s - before.cpu_s for before, after in zip(began, ended, strict=False)]
    used_s = sum(one.cpu_s for one in ended) - sum(one.cpu_s for one in began)
    share, memory_mb = used_s / len(cycles) / CYCLE_S, sum(one.memory_mb for one in ended)
    print(f"{SENSORS} sensors, 4 outputs, 208 parts; {len(cycles)} cycles in {seconds:g} s")
    each = ", ".join(f"{1e3 * one / len(cycles):.2f}" for one in used)
    total_ms = 1e3 * used_s / len(cycles)
    print(f"processor {total_ms:.2f} ms a cycle ({each}): {share:.2%} of a core at 10 Hz")
    each = ", ".join(f"{one.memory_mb:.1f}" for one in ended)
    print(f"memory {memory_mb:.1f} MB ({each}); exit code {code}")
    return 0 if share <= MOST_SHARE and memory_mb <= MOST_MEMORY_MB and code == 0 else 1


if __name__ == "__main__":
    raise SystemExit(main())
