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
from collections.abc import Callable
from pathlib import Path

import linuxcnc

PAUSE_S = 0.01
LIFE_S = 240.0
LONGEST_S = 30.0
"""What must come about is waited for so long, also on a slow computer. [s]"""


class RefusedError(Exception):
    """The control said no, or took too long."""


class Operator:
    """One person at one control."""

    def __init__(self) -> None:
        self.command = linuxcnc.command()
        self.status = linuxcnc.stat()
        self.messages = linuxcnc.error_channel()

    def wait(self, what: str, reached: Callable[[], bool], limit_s: float = LONGEST_S) -> None:
        deadline = time.monotonic() + limit_s
        while time.monotonic() < deadline:
            self.status.poll()
            message = self.messages.poll()
            if message and message[0] in {linuxcnc.NML_ERROR, linuxcnc.OPERATOR_ERROR}:
                raise RefusedError(f"the control says: {message[1]}")
            if reached():
                return
            time.sleep(PAUSE_S)
        raise RefusedError(f"not reached within {limit_s:g} s: {what}")

    def obey(self, order: dict[str, str]) -> None:
        status, command = self.status, self.command
        verb = order["verb"]
        if verb == "home":
            command.state(linuxcnc.STATE_ESTOP_RESET)
            self.wait("emergency stop off", lambda: not status.estop)
            command.state(linuxcnc.STATE_ON)
            self.wait("machine on", lambda: status.task_state == linuxcnc.STATE_ON)
            self.manual()
            command.home(-1)
            self.wait("home", lambda: all(status.homed[: status.joints]))
        elif verb == "off":
            command.state(linuxcnc.STATE_OFF)
            self.wait("machine off", lambda: status.task_state != linuxcnc.STATE_ON)
        elif verb == "on":
            command.state(linuxcnc.STATE_ON)
            self.wait("machine on", lambda: status.task_state == linuxcnc.STATE_ON)
        elif verb == "unhome":
            self.manual()
            command.unhome(int(order["joint"]))
            self.wait("unhomed", lambda: not status.homed[int(order["joint"])])
        elif verb == "move":
            command.mode(linuxcnc.MODE_MDI)
            command.wait_complete(LONGEST_S)
            command.mdi(order["text"])
            command.wait_complete(LONGEST_S)
            idle = linuxcnc.INTERP_IDLE
            self.wait("end of the move", lambda: status.interp_state == idle and status.inpos)
        elif verb != "look":
            raise RefusedError(f"unknown order: {verb}")

    def manual(self) -> None:
        self.command.mode(linuxcnc.MODE_MANUAL)
        self.command.wait_complete(LONGEST_S)
        self.command.teleop_enable(0)
        self.command.wait_complete(LONGEST_S)

    def shown(self) -> dict[str, object]:
        self.status.poll()
        return {
            "commanded": list(self.status.position[:3]),
            "actual": list(self.status.actual_position[:3]),
            "joints": list(self.status.joint_actual_position[:3]),
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
            operator.obey(json.loads(order.read_text(encoding="ascii")))
        except (RefusedError, linuxcnc.error) as error:
            failure = str(error)
        result = {"failure": failure, **operator.shown()}
        part = Path(f"done-{number}.part")
        part.write_text(json.dumps(result), encoding="ascii")
        part.rename(f"done-{number}.json")
        number += 1


if __name__ == "__main__":
    main()
