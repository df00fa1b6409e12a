"""What an operator does at a LinuxCNC: switch on, home, wait for what comes about."""

import time
from collections.abc import Callable

import linuxcnc

PAUSE_S = 0.01
LONGEST_S = 30.0
"""What must come about is waited for so long, also on a slow computer. [s]"""


class RefusedError(Exception):
    """The control said no, or took too long."""


class Operator:
    """One person at one control."""

    def __init__(self, *, heeds_messages: bool = True) -> None:
        self.heeds_messages = heeds_messages
        self.command = linuxcnc.command()
        self.status = linuxcnc.stat()
        self.messages = linuxcnc.error_channel()
        self.said: list[str] = []

    def wait(self, what: str, reached: Callable[[], bool], limit_s: float = LONGEST_S) -> None:
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
        self.command.state(linuxcnc.STATE_ESTOP_RESET)
        self.wait("emergency stop off", lambda: not self.status.estop)
        self.start()

    def start(self) -> None:
        self.command.state(linuxcnc.STATE_ON)
        self.wait("machine on", lambda: self.status.task_state == linuxcnc.STATE_ON)

    def home(self) -> None:
        self.by_hand()
        self.command.home(-1)
        self.wait("home", lambda: all(self.status.homed[: self.status.joints]))

    def by_hand(self) -> None:
        self.command.mode(linuxcnc.MODE_MANUAL)
        self.command.wait_complete(LONGEST_S)
        self.command.teleop_enable(0)
        self.command.wait_complete(LONGEST_S)
