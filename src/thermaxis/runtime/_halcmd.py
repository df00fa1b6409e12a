"""LinuxCNC's HAL through one lasting ``halcmd``, so that any Python reaches it.

The modules `hal` and `linuxcnc` exist for the distribution's own Python alone and are GPL; a
``halcmd`` that reads its commands from a pipe is a program of its own, and a set with its
confirming get takes tens of microseconds. Its answers carry no number: a good ``sets`` says
nothing, a bad one says one line or two. Here a ``print`` stands after every command, and what comes
before its text is the answer to that command and to no other.
"""

import asyncio
import contextlib
import math
import os
import shutil
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Final, NamedTuple, Protocol, final

from thermaxis.codes import Place
from thermaxis.errors import ThermaxisError

SHARED_MEMORY = Path("/proc/sysvipc/shm")
"""Where Linux lists the shared memory; HAL lives in one of its segments."""
HAL_KEY = 0x48414C32
"""Key of HAL's shared memory, fixed in LinuxCNC. It exists as long as LinuxCNC runs."""
_END_S = 0.5
_LONGEST_BATCH = 40
"""So many commands are shorter than what a pipe takes at once or not at all (4096 bytes): none is
cut when this program is frozen."""


LINUXCNC: Final = Place("LinuxCNC")
"""Where its errors are."""


@final
class HalRefusedError(ThermaxisError):
    """HAL answered, but not what was expected; the pipe is still in step."""


@final
class HalLostError(ThermaxisError):
    """HAL cannot be reached: not running, ended, or the pipe is out of step."""


class HalInstance(NamedTuple):
    """The HAL that runs on this computer; there is one at most."""

    number: int
    """Number of its shared memory: another number is another start of LinuxCNC. [1]"""
    user: int
    """Number of the user who started it; only that user and root reach it. [1]"""
    creator: int
    """Number of the program that made the shared memory. [1]"""


class Hal(Protocol):
    """What source and sink need of HAL: answers to commands, in time, or an error."""

    async def ask(self, commands: Sequence[str], deadline_s: float) -> list[tuple[str, ...]]:
        """Give commands and return the lines of each answer."""
        ...

    def there(self) -> bool:
        """Return whether the LinuxCNC runs for which it was opened."""
        ...

    async def close(self) -> None:
        """End."""
        ...


def running_instance(table: Path = SHARED_MEMORY) -> HalInstance | None:
    """Return the HAL that runs, or None; looks only, since ``halcmd`` would make one."""
    try:
        rows = table.read_text(encoding="ascii").splitlines()
    except OSError:
        return None
    if not rows:
        return None
    names = rows[0].split()
    for row in rows[1:]:
        column = dict(zip(names, row.split(), strict=False))
        if int(column.get("key", "0")) & 0xFFFFFFFF == HAL_KEY:
            return HalInstance(int(column["shmid"]), int(column["uid"]), int(column["cpid"]))
    return None


@final
class HalPipe:
    """One lasting ``halcmd``.

    A command that was not answered in time, or whose waiting was cancelled, leaves the pipe out of
    step: every later call raises, and the owner makes a new one. Nothing is repeated by itself,
    since a command that arrives late is worse than none.

    Not protected: HAL does what it is told. Whoever may start ``halcmd`` may set any pin.
    """

    def __init__(
        self,
        commands: asyncio.StreamWriter,
        answers: asyncio.StreamReader,
        program: asyncio.subprocess.Process | None = None,
        there: Callable[[], bool] = lambda: True,
    ) -> None:
        self.there = there
        self._commands = commands
        self._answers = answers
        self._program = program
        self._lock = asyncio.Lock()
        self._count = 0
        self._in_step = True

    async def ask(self, commands: Sequence[str], deadline_s: float) -> list[tuple[str, ...]]:
        """Give commands and return the lines of each answer."""
        try:
            async with asyncio.timeout(deadline_s), self._lock:
                if not self._in_step:
                    raise HalLostError("halcmd_out_of_step", place=LINUXCNC)
                answers: list[tuple[str, ...]] = []
                for first in range(0, len(commands), _LONGEST_BATCH):
                    answers += await self._exchange(commands[first : first + _LONGEST_BATCH])
                return answers
        except TimeoutError:
            raise HalLostError("halcmd_silent", deadline_s=deadline_s, place=LINUXCNC) from None
        except (OSError, ValueError) as error:
            raise HalLostError("halcmd_pipe_broken", cause=str(error), place=LINUXCNC) from None

    async def _exchange(self, commands: Sequence[str]) -> list[tuple[str, ...]]:
        first = self._count + 1
        self._count += len(commands)
        lines = [
            f"{command}\nprint {_token(number)}\n"
            for number, command in enumerate(commands, start=first)
        ]
        batch = "".join(lines).encode("ascii")
        self._in_step = False
        self._commands.write(batch)
        await self._commands.drain()
        answers = [await self._answer(_token(first + i)) for i in range(len(commands))]
        self._in_step = True
        return answers

    async def _answer(self, token: str) -> tuple[str, ...]:
        lines: list[str] = []
        while True:
            line = (await self._answers.readline()).decode("ascii", errors="replace")
            if not line.endswith("\n"):
                said = "; ".join([*lines, line]).strip("; ")
                raise HalLostError("halcmd_ended", said=said or "-", place=LINUXCNC)
            line = line.rstrip("\n")
            if line.endswith(f"HALCMD MSG: {token}"):
                return tuple(lines)
            lines.append(line)

    async def close(self) -> None:
        """End the program: gently while it is in step, since it may hold HAL's lock; else at once.

        A program that is out of step may have commands before it that nobody wants any more.
        """
        program, self._program = self._program, None
        if not self._in_step and program is not None:
            with contextlib.suppress(ProcessLookupError):
                program.kill()
        self._in_step = False
        self._commands.close()
        with contextlib.suppress(OSError):
            await self._commands.wait_closed()
        if program is None:
            return
        try:
            async with asyncio.timeout(_END_S):
                await program.wait()
        except TimeoutError:
            with contextlib.suppress(ProcessLookupError):
                program.kill()
            await program.wait()


def _token(number: int) -> str:
    return f"={number}."


async def open_pipe(program: str, table: Path = SHARED_MEMORY) -> HalPipe:
    """Start ``halcmd`` beside the LinuxCNC that runs."""
    before = running_instance(table)
    if before is None:
        raise HalLostError("linuxcnc_not_running", place=LINUXCNC)
    if os.geteuid() not in {0, before.user}:
        raise HalLostError("linuxcnc_of_other_user", user=before.user, place=LINUXCNC)
    path = shutil.which(program)
    if path is None:
        raise HalLostError("no_halcmd", program=program, place=LINUXCNC)
    child = await asyncio.create_subprocess_exec(
        path,
        "-k",
        "-f",
        stdin=asyncio.subprocess.PIPE,
        stdout=asyncio.subprocess.PIPE,
        stderr=asyncio.subprocess.STDOUT,
        env={**os.environ, "LC_ALL": "C"},  # numbers with a point
        start_new_session=True,  # an interrupt from the keyboard is for the loop alone
    )
    if child.stdin is None or child.stdout is None:
        raise HalLostError("halcmd_out_of_step", place=LINUXCNC)
    pipe = HalPipe(child.stdin, child.stdout, child, lambda: running_instance(table) == before)
    try:
        await pipe.ask(["status lock"], _END_S)
    except BaseException:
        await pipe.close()
        raise
    if not pipe.there():  # halcmd made an empty HAL of its own, and removes it
        await pipe.close()
        raise HalLostError("linuxcnc_changed", place=LINUXCNC)
    return pipe


# ---- what answers mean --------------------------------------------------------------------------


def number_of(answer: Sequence[str], what: str) -> float:
    """Return the finite number that a get answers."""
    try:
        value = float(answer[0]) if len(answer) == 1 else math.nan
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise _unexpected(answer, what)
    return value


def bit_of(answer: Sequence[str], what: str) -> bool:
    """Return the bit that a get answers."""
    if tuple(answer) == ("TRUE",):
        return True
    if tuple(answer) == ("FALSE",):
        return False
    raise _unexpected(answer, what)


def confirm_silence(answer: Sequence[str], what: str) -> None:
    """Raise if a set said anything."""
    if answer:
        raise _unexpected(answer, what)


def _unexpected(answer: Sequence[str], what: str) -> HalRefusedError:
    said = "; ".join(answer) or "-"
    return HalRefusedError("hal_answers", said=said, place=LINUXCNC._replace(channel=what))
