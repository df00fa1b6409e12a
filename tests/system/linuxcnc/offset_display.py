#!/usr/bin/python3
"""A person at the control who does what is asked for in files, one after the other.

LinuxCNC starts this file as its display and lives exactly as long as it does. An order is a file
``order-N.json``; what came of it, and what the display shows then, goes into ``done-N.json``.
"""

import json
import os
import signal
import sys
import time
from pathlib import Path

import linuxcnc
from panel import LONGEST_S, PAUSE_S, Operator, RefusedError

LIFE_S = 240.0


def obey(operator: Operator, order: dict[str, str]) -> None:
    """Do what is asked for."""
    status, command = operator.status, operator.command
    verb = order["verb"]
    if verb == "home":
        operator.switch_on()
        operator.home()
    elif verb == "off":
        command.state(linuxcnc.STATE_OFF)
        operator.wait("machine off", lambda: status.task_state != linuxcnc.STATE_ON)
    elif verb == "on":
        operator.start()
    elif verb == "unhome":
        operator.by_hand()
        command.unhome(int(order["joint"]))
        operator.wait("unhomed", lambda: not status.homed[int(order["joint"])])
    elif verb == "move":
        command.mode(linuxcnc.MODE_MDI)
        command.wait_complete(LONGEST_S)
        command.mdi(order["text"])
        command.wait_complete(LONGEST_S)
        idle = linuxcnc.INTERP_IDLE
        operator.wait("end of the move", lambda: status.interp_state == idle and status.inpos)
    elif verb != "look":
        raise RefusedError(f"unknown order: {verb}")


def shown(status: linuxcnc.stat) -> dict[str, object]:
    """Return what the display shows."""
    status.poll()
    return {
        "commanded": list(status.position[:3]),
        "actual": list(status.actual_position[:3]),
        "joints": list(status.joint_actual_position[:3]),
        "user": os.getuid(),
    }


def main() -> None:
    """Obey until told to end."""
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(0))
    linuxcnc.nmlfile = str(Path("machine.nml").resolve())
    operator = Operator()
    number = 1
    deadline = time.monotonic() + LIFE_S
    Path("ready").touch()
    while time.monotonic() < deadline:
        order = Path(f"order-{number}.json")
        if not order.exists():
            time.sleep(PAUSE_S)
            continue
        failure = ""
        try:
            obey(operator, json.loads(order.read_text(encoding="ascii")))
        except (RefusedError, linuxcnc.error) as error:
            failure = str(error)
        result = {"failure": failure, **shown(operator.status)}
        part = Path(f"done-{number}.part")
        part.write_text(json.dumps(result), encoding="ascii")
        part.rename(f"done-{number}.json")
        number += 1


if __name__ == "__main__":
    main()
