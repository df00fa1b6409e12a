"""Tell systemd that the loop lives, so that a loop that hangs is started anew."""

import contextlib
import os
import socket
from typing import Final, final

from thermaxis.runtime.status import RuntimeStatus

VARIABLE: Final = "NOTIFY_SOCKET"
"""Variable by which systemd says where it listens."""
EVERY_S: Final = 1.0
"""It is told so often. [s]"""


@final
class SignOfLife:
    """Sends a sign of life after cycles, where the program was started by systemd.

    Notes
    -----
    Not protected: systemd starts the loop anew after its own time; until then the machine's
    watchdog is what takes the offset back.

    References
    ----------
    .. [1] sd_notify(3): READY=1, WATCHDOG=1, STATUS=.
    """

    def __init__(self, address: str | None = None) -> None:
        given = os.environ.get(VARIABLE, "") if address is None else address
        self._address = "\0" + given[1:] if given.startswith("@") else given
        self._told = ""
        self._at = float("-inf")

    def tell(self, status: RuntimeStatus) -> None:
        """Send a sign of life; a failure to send is no failure of the loop."""
        now_s = status.output.time_s
        if not self._address or (now_s - self._at < EVERY_S and now_s >= self._at):
            return
        self._at = now_s
        lines = ["WATCHDOG=1"]
        if not self._told:
            lines.insert(0, "READY=1")
        text = str(status.output.state)
        if text != self._told:
            self._told = text
            lines.append(f"STATUS={text}")
        with (
            contextlib.suppress(OSError),
            socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM | socket.SOCK_NONBLOCK) as sender,
        ):
            sender.sendto("\n".join(lines).encode(), self._address)
