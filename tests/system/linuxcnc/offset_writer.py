"""A program of its own that feeds the sink, so that a test can freeze and kill it.

Arguments: what the settings are made of, as JSON; the goal in micrometres; two files. As long as
the first is there the program heeds what `found` says; without it it writes and writes. As soon as
the second is there it stops itself between two cycles, as a hung computer would stand. Each cycle
is a line of JSON on standard output.
"""

import asyncio
import json
import os
import signal
import sys
import time
from pathlib import Path

from thermaxis.compensation import Limits, limit_step
from thermaxis.messages import text_of
from thermaxis.runtime import SystemClock
from thermaxis.runtime.sinks import LinuxCncOutput, LinuxCncSettings, LinuxCncSink

CYCLE_S = 0.1
DEADLINE_S = 0.5
LIFE_S = 120.0


def settings_of(text: str) -> LinuxCncSettings:
    """Return the settings of both the writer and the test."""
    outputs = {
        name: LinuxCncOutput(joint, "mm", sign, Limits(largest_um, rate_um_per_s))
        for name, (joint, sign, largest_um, rate_um_per_s) in json.loads(text).items()
    }
    return LinuxCncSettings(outputs=outputs, cycle_s=CYCLE_S)


async def write(
    settings: LinuxCncSettings, goal_um: float, may_find: Path, must_stop: Path
) -> None:
    """Go to the goal as fast as the limits allow, from wherever the offsets stand."""
    sink = LinuxCncSink(settings, SystemClock())
    now_um: dict[str, float] = {}
    await sink.open()
    end_s = time.monotonic() + LIFE_S
    while time.monotonic() < end_s:
        found = await sink.found(DEADLINE_S) if may_find.exists() else None
        if found is not None:
            now_um = {name: value or 0.0 for name, value in found.items()}
        for name, before in now_um.items():
            now_um[name] = limit_step(settings.outputs[name].limits, before, goal_um, CYCLE_S)
        written = bool(now_um) and await sink.write(now_um, DEADLINE_S)
        back = await sink.read_back(DEADLINE_S)
        line = {
            "time_s": time.monotonic(),
            "connected": sink.connected,
            "found": found,
            "written": written,
            "applied": back,
            "error": "" if sink.failure is None else text_of(sink.failure),
            "cpu_s": time.process_time(),
            "id": os.getpid(),
        }
        print(json.dumps(line), flush=True)
        if must_stop.exists():
            os.kill(os.getpid(), signal.SIGSTOP)
        await asyncio.sleep(CYCLE_S)


if __name__ == "__main__":
    asyncio.run(write(settings_of(sys.argv[1]), float(sys.argv[2]), *map(Path, sys.argv[3:])))
