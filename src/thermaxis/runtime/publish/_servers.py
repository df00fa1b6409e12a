"""The process that publishes: history, status server and metrics, fed by the acting process.

A server that is not configured is not loaded: `status` is named whole.
"""

import asyncio
import json
import pickle
import socket
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import asdict, replace
from functools import partial
from itertools import count
from typing import TYPE_CHECKING, Final, TypeAlias, cast, final

from thermaxis.codes import Message, value_as_json
from thermaxis.compensation import Request
from thermaxis.errors import ConfigurationError
from thermaxis.runtime import status
from thermaxis.runtime._ports import Clock, CycleRecord, EventRecord, RequestOutcome, SystemClock
from thermaxis.runtime.config import MachineConfiguration, certificate_ends
from thermaxis.runtime.history import SqlHistorian, check_database
from thermaxis.runtime.publish._publisher import HEADER

if TYPE_CHECKING:
    from thermaxis.runtime.status import MetricsServer, StatusServer

TOLD_EVERY_S: Final = 0.5
"""How the history fares is told so often. [s]"""
_SERVERS_EVERY: Final = round(60.0 / TOLD_EVERY_S)  # at most: one that has ended is opened at once
_CERTIFICATES_EVERY: Final = round(3600.0 / TOLD_EVERY_S)
STORE_S: Final = 5.0
"""Time in which what is left must be stored at the end. [s]"""

_Server: TypeAlias = "StatusServer | MetricsServer"
_Makers: TypeAlias = Mapping[str, Callable[[], _Server]]
_SERVER, _METRICS = "server", "metrics"


@final
class _Loop:
    """The acting process, as the status server asks it."""

    def __init__(self, writer: asyncio.StreamWriter) -> None:
        self._writer = writer
        self.taken = 0
        self._numbers = count()
        self._waiting: dict[int, asyncio.Future[RequestOutcome]] = {}

    def say(self, said: Mapping[str, object]) -> None:
        """Say something, as a line of JSON."""
        self._writer.write(json.dumps(said).encode() + b"\n")

    async def submit(self, request: Request) -> RequestOutcome:
        """Hand in a request and wait for its answer."""
        number = next(self._numbers)
        answer = asyncio.get_running_loop().create_future()
        self._waiting[number] = answer
        try:
            self.say({"request": asdict(request), "number": number})
            return await answer
        finally:
            del self._waiting[number]

    def answer(self, number: int, outcome: RequestOutcome) -> None:
        """Take an answer, if anybody waits for it still."""
        waits = self._waiting.get(number)
        if waits is not None and not waits.done():
            waits.set_result(outcome)


def serve(configuration: MachineConfiguration, clock: Clock, connected: socket.socket) -> None:
    """Publish what comes, until nothing more comes."""
    asyncio.run(_serve(configuration, clock, connected))


async def _serve(
    configuration: MachineConfiguration, records: Clock, connected: socket.socket
) -> None:
    reader, writer = await asyncio.open_connection(sock=connected)
    loop, clock = _Loop(writer), SystemClock()
    history = SqlHistorian(configuration.historian, records)
    makers: dict[str, Callable[[], _Server]] = {}
    if configuration.server is not None:
        given = configuration.server, loop, clock
        tokens = configuration.state_file.with_suffix(".tokens")
        makers[_SERVER] = partial(status.StatusServer, *given, audit=history.event, tokens=tokens)
    if configuration.metrics is not None:
        makers[_METRICS] = partial(status.MetricsServer, configuration.metrics, clock)
    opened: dict[str, _Server] = {}
    servers = opened.values()
    refused = await _open(makers, opened)
    unrecorded = None if refused else await asyncio.to_thread(_unrecorded, configuration)
    loop.say(
        {
            "url": cast("StatusServer", opened[_SERVER]).url if _SERVER in opened else "",
            "metrics_port": opened[_METRICS].port if _METRICS in opened else 0,
            "unrecorded": value_as_json(unrecorded),
            "refused": value_as_json(refused),
        }
    )
    if refused is not None:
        message = Message("event-server_unopened", {"reason": refused})
        history.event(EventRecord.of(records.utc(), "alarm", "", message))
    outputs = [output.name for output in configuration.compensation.model.outputs]
    headlines = status.Headlines()
    telling = asyncio.create_task(_tell(loop, history, configuration, makers, opened))
    with suppress(OSError, asyncio.IncompleteReadError):
        while True:
            size = int.from_bytes(await reader.readexactly(HEADER))
            await history.open(outputs)  # who is refused at first is fed nothing
            for item in pickle.loads(await reader.readexactly(size)):  # noqa: S301 - from the acting process
                loop.taken += isinstance(item, CycleRecord | EventRecord)
                if isinstance(item, CycleRecord):
                    history.record(item)
                elif isinstance(item, EventRecord):
                    history.event(item)
                elif isinstance(item, status.RuntimeStatus):
                    headline, since = headlines.headline_of(item)
                    told = replace(item, headline=headline, headline_since=since)
                    for server in servers:
                        server.publish(told)
                else:
                    loop.answer(*item)
    telling.cancel()
    await asyncio.gather(*(server.close() for server in servers), history.close(STORE_S))
    _tell_history(loop, history)  # what is lost at the end
    await writer.drain()


def _closed(makers: _Makers, opened: Mapping[str, _Server]) -> Sequence[str]:
    """Return those that are not open, or have failed."""
    return [name for name in makers if name not in opened or not opened[name].port]


async def _open(makers: _Makers, opened: dict[str, _Server]) -> Message | None:
    """Open those that are not, or have failed, and return why one does not open."""
    refused = None
    for name in _closed(makers, opened):
        if name in opened:
            await opened[name].close()  # what failed may still have the port
        server = makers[name]()
        try:
            await server.open()
        except ConfigurationError as error:
            refused = error.message
        else:
            opened[name] = server
            if name == _SERVER:
                status.forget_standard()
    return refused


async def _tell(
    loop: _Loop,
    history: SqlHistorian,
    configuration: MachineConfiguration,
    makers: _Makers,
    opened: dict[str, _Server],
) -> None:
    """Say how the history fares, and until when certificates are valid; try servers again."""
    opened_at = -_SERVERS_EVERY
    for number in count():
        if number % _CERTIFICATES_EVERY == 0:
            ends = await asyncio.to_thread(certificate_ends, configuration)
            loop.say({"certificates": {key: end.isoformat() for key, end in ends.items()}})
        if number >= opened_at + _SERVERS_EVERY and _closed(makers, opened):
            opened_at = number
            await _open(makers, opened)
        _tell_history(loop, history)
        await asyncio.sleep(TOLD_EVERY_S)


def _tell_history(loop: _Loop, history: SqlHistorian) -> None:
    storing, waiting, lost, failure = history.status
    fares = storing, waiting, lost, value_as_json(failure)
    loop.say({"historian": fares, "stored": max(0, loop.taken - waiting)})


def _unrecorded(configuration: MachineConfiguration) -> Message | None:
    """Return why no history can be kept there; a database out of reach is waited for."""
    settings = configuration.historian
    try:
        with suppress(OSError):
            check_database(settings.url, settings.password.reveal())
    except ConfigurationError as error:
        return error.message
    return None
