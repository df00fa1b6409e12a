#!/usr/bin/python3
"""What an operator does: switch on, home, run the program, wait for its end.

LinuxCNC starts this file as its display and lives exactly as long as it does. What was seen goes
into ``result.json``; the end of this file is the clean end of LinuxCNC.
"""

import json
import os
import time
from collections.abc import Callable
from pathlib import Path

import linuxcnc

PAUSE_S = 0.01
SETTLE_S = 0.2
LONGEST_S = 30.0
"""What must come about is waited for so long, also on a slow computer. [s]"""


class RefusedError(Exception):
    """The control said no, or took too long."""


class Operator:
    """One person at one control."""

    def __init__(self, heeds_messages: bool) -> None:
        self.heeds_messages = heeds_messages
        self.command = linuxcnc.command()
        self.status = linuxcnc.stat()
        self.messages = linuxcnc.error_channel()
        self.said: list[str] = []

    def wait(self, what: str, reached: Callable[[], bool], limit_s: float) -> None:
        deadline = time.monotonic() + limit_s
        while time.monotonic() < deadline:
            self.status.poll()
            self.listen()
            if reached():
                return
            time.sleep(PAUSE_S)
        raise RefusedError(f"not reached within {limit_s:g} s: {what}")

    def listen(self) -> None:
        message = self.messages.poll()
        while message:
            kind, text = message
            self.said.append(str(text).strip())
            bad = kind in {linuxcnc.NML_ERROR, linuxcnc.OPERATOR_ERROR}
            if bad and self.heeds_messages:
                raise RefusedError(f"the control says: {text}")
            message = self.messages.poll()

    def switch_on(self) -> None:
        status, command = self.status, self.command
        command.state(linuxcnc.STATE_ESTOP_RESET)
        self.wait("emergency stop off", lambda: not status.estop, LONGEST_S)
        command.state(linuxcnc.STATE_ON)
        self.wait("machine on", lambda: status.task_state == linuxcnc.STATE_ON, LONGEST_S)

    def home(self) -> None:
        status, command = self.status, self.command
        command.mode(linuxcnc.MODE_MANUAL)
        command.wait_complete(LONGEST_S)
        command.teleop_enable(0)
        command.wait_complete(LONGEST_S)
        command.home(-1)
        self.wait("home", lambda: all(status.homed[: status.joints]), LONGEST_S)

    def run(self, program: Path, limit_s: float) -> None:
        status, command = self.status, self.command
        command.mode(linuxcnc.MODE_AUTO)
        command.wait_complete(LONGEST_S)
        command.program_open(str(program))
        command.wait_complete(LONGEST_S)
        command.auto(linuxcnc.AUTO_RUN, 0)
        idle = linuxcnc.INTERP_IDLE
        self.wait("start of the program", lambda: status.interp_state != idle, LONGEST_S)
        self.wait("end of the program", lambda: status.interp_state == idle, limit_s)
        self.wait("standstill", lambda: status.inpos, LONGEST_S)


def main() -> None:
    """Do the job."""
    job = json.loads(Path("job.json").read_text(encoding="ascii"))
    failure = ""
    linuxcnc.nmlfile = str(Path("machine.nml").resolve())
    operator = Operator(job["heeds_messages"])
    try:
        operator.switch_on()
        operator.home()
        operator.run(Path("program.ngc").resolve(), job["limit_s"])
        time.sleep(SETTLE_S)  # the virtual axis reads on until the last servo period
    except (RefusedError, linuxcnc.error) as error:
        failure = str(error)
    operator.status.poll()
    result = {
        "failure": failure,
        "said": operator.said,
        "user": os.getuid(),
        "outputs": operator.status.aout[:2],
    }
    Path("result.json").write_text(json.dumps(result), encoding="ascii")


if __name__ == "__main__":
    main()
