"""Requests of people at the computer itself: a socket that the loop's user alone can reach."""

import asyncio
import json
import os
import pwd
import socket
import struct
from collections.abc import Generator
from contextlib import contextmanager, suppress
from dataclasses import replace
from pathlib import Path
from typing import Final, NamedTuple, final

from pydantic import TypeAdapter

from thermaxis.codes import Message, message_as_json, values_of_json
from thermaxis.compensation import Request, RequestKind
from thermaxis.errors import ConfigurationError
from thermaxis.runtime._ports import LoopAnswer, RequestBox, RequestOutcome

ASKED_HERE: Final = tuple(
    RequestKind(kind)
    for kind in ("acknowledge", "disable", "hold", "touch", "datum", "resume", "enable")
)
"""What can be asked for; the last two where the configuration allows it, as another model is."""
_STARTS: Final = {RequestKind.RESUME, RequestKind.ENABLE, RequestKind.MODEL}
LONGEST_ANSWER_S: Final = 70.0
"""An answer comes within a cycle, a minute at most. [s]"""
_LONGEST_BYTES = 100_000
_ASKED_WITHIN_S = 5.0
_TOLD = TypeAdapter[str | tuple[str, float, float]](str | tuple[str, float, float])
_CREDENTIALS = "3i"


@final
class RequestSocket:
    """Hands the loop what is asked at a socket of mode 0600 beside the state file.

    The one who asks sends a word, behind it what belongs to it as JSON, and a line's end; the
    answer is a line of JSON.

    Not protected: every program of the loop's user, and root.
    """

    def __init__(self, state_file: Path, box: RequestBox, *, may_start: bool) -> None:
        self._path = _socket_of(state_file)
        self._box = box
        self._may_start = may_start
        self._server: asyncio.Server | None = None

    async def open(self) -> None:
        """Begin to listen; what a killed program has left is replaced: the state is locked."""
        self._path.unlink(missing_ok=True)
        listening = socket.socket(socket.AF_UNIX)
        with _reached(self._path) as name:
            listening.bind(name)
        self._path.chmod(0o600)  # nobody is let in before it listens
        self._server = await asyncio.start_unix_server(
            self._asked, sock=listening, limit=_LONGEST_BYTES
        )

    async def close(self) -> None:
        """End."""
        if self._server is not None:
            self._server.close()
            self._path.unlink(missing_ok=True)

    async def _asked(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        with suppress(OSError, TimeoutError, ValueError):
            async with asyncio.timeout(_ASKED_WITHIN_S):
                word, _, told = (await reader.readline()).decode().partition(" ")
                request = Request(RequestKind(word.strip()), _peer(writer))
                said = _TOLD.validate_json(told) if told else ""
            if isinstance(said, str):
                request = replace(request, text=said)
            else:
                request = replace(request, output=said[0], value=said[1], duration_s=said[2])
            outcome = await self._outcome(request)
            answer = message_as_json(outcome.message) | {"accepted": outcome.accepted}
            writer.write(json.dumps(answer).encode() + b"\n")
            await writer.drain()
        writer.close()

    async def _outcome(self, request: Request) -> RequestOutcome:
        kind = request.kind
        known = kind in ASKED_HERE or kind is RequestKind.MODEL
        if not known or (kind in _STARTS and not self._may_start):
            return RequestOutcome(accepted=False, code=LoopAnswer.NOT_AT_COMPUTER)
        return await self._box.submit(request)


class LocalAnswer(NamedTuple):
    """How the loop has answered."""

    accepted: bool
    message: Message
    """Why not, or what follows."""


def ask_loop(
    state_file: Path, kind: RequestKind, told: str | tuple[str, float, float] | None = None
) -> LocalAnswer:
    """Ask the loop that keeps its state in a file, and wait for its next cycle.

    What is told of a touch is its output, value [µm] and age [s]; of a model its file's name.
    """
    path = _socket_of(state_file)
    try:
        with _reached(path) as name, socket.socket(socket.AF_UNIX) as asking:
            asking.settimeout(LONGEST_ANSWER_S)
            asking.connect(name)
            behind = "" if told is None else f" {json.dumps(told)}"
            asking.sendall(f"{kind}{behind}\n".encode())
            with asking.makefile("rb") as stream:
                said = json.loads(stream.readline(_LONGEST_BYTES))
    except (OSError, ValueError) as error:
        cause: str = getattr(error, "strerror", None) or "no answer"
        raise ConfigurationError("loop_not_asked", cause=cause, file=path) from None
    return LocalAnswer(said["accepted"], Message(said["code"], values_of_json(said["values"])))


def _socket_of(state_file: Path) -> Path:
    return state_file.with_name(f"{state_file.name}.socket")


@contextmanager
def _reached(path: Path) -> Generator[str]:
    """Yield a name that a socket can have, 107 bytes at most, however long its folder's is."""
    folder = os.open(path.parent, os.O_RDONLY)
    try:
        yield f"/proc/self/fd/{folder}/{path.name}"
    finally:
        os.close(folder)


def _peer(writer: asyncio.StreamWriter) -> str:
    """Return the name of the user who asks."""
    found: bytes = writer.get_extra_info("socket").getsockopt(
        socket.SOL_SOCKET, socket.SO_PEERCRED, struct.calcsize(_CREDENTIALS)
    )
    user: int = struct.unpack(_CREDENTIALS, found)[1]
    try:
        return f"{pwd.getpwuid(user).pw_name} at the computer"
    except KeyError:
        return f"user {user} at the computer"
