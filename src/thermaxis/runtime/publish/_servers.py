"""The process that publishes: history, status server and metrics, fed by the acting process."""

import asyncio
import json
import pickle
import socket
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import asdict
from itertools import count
from typing import Final, final

from thermaxis.codes import Message, value_as_json
from thermaxis.compensation import Request
from thermaxis.errors import ConfigurationError
from thermaxis.runtime._ports import Clock, CycleRecord, EventRecord, RequestOutcome, SystemClock
from thermaxis.runtime.config import MachineConfiguration, certificate_ends
from thermaxis.runtime.history import SqlHistorian, check_database
from thermaxis.runtime.publish._publisher import HEADER
from thermaxis.runtime.status import MetricsServer, RuntimeStatus, StatusServer

TOLD_EVERY_S: Final = 0.5
"""How the history fares is told so often. [s]"""
_CERTIFICATES_EVERY: Final = round(3600.0 / TOLD_EVERY_S)
STORE_S: Final = 5.0
"""Time in which what is left must be stored at the end. [s]"""


@final
class _Loop:
    """The acting process, as the status server asks it."""

    def __init__(self, writer: asyncio.StreamWriter) -> None:
        self._writer = writer
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
    status = metrics = None
    if configuration.server is not None:
        status = StatusServer(configuration.server, loop, clock, audit=history.event)
    if configuration.metrics is not None:
        metrics = MetricsServer(configuration.metrics, clock)
    servers = [server for server in (status, metrics) if server is not None]
    try:
        for server in servers:
            await server.open()
    except ConfigurationError as error:
        loop.say({"error": value_as_json(error.message)})
        await writer.drain()
        return
    unrecorded = await asyncio.to_thread(_unrecorded, configuration)
    await history.open([output.name for output in configuration.compensation.model.outputs])
    loop.say(
        {
            "url": status.url if status else "",
            "metrics_port": metrics.port if metrics else 0,
            "unrecorded": value_as_json(unrecorded),
        }
    )
    telling = asyncio.create_task(_tell(loop, history, configuration))
    with suppress(OSError, asyncio.IncompleteReadError):
        while True:
            size = int.from_bytes(await reader.readexactly(HEADER))
            for item in pickle.loads(await reader.readexactly(size)):  # noqa: S301 - from the acting process
                if isinstance(item, CycleRecord):
                    history.record(item)
                elif isinstance(item, EventRecord):
                    history.event(item)
                elif isinstance(item, RuntimeStatus):
                    for server in servers:
                        server.publish(item)
                else:
                    loop.answer(*item)
    telling.cancel()
    await asyncio.gather(*(server.close() for server in servers), history.close(STORE_S))


async def _tell(loop: _Loop, history: SqlHistorian, configuration: MachineConfiguration) -> None:
    """Say how the history fares, and until when certificates are valid."""
    for number in count():
        if number % _CERTIFICATES_EVERY == 0:
            ends = await asyncio.to_thread(certificate_ends, configuration)
            loop.say({"certificates": {key: end.isoformat() for key, end in ends.items()}})
        storing, waiting, lost, failure = history.status
        loop.say({"historian": (storing, waiting, lost, value_as_json(failure))})
        await asyncio.sleep(TOLD_EVERY_S)


def _unrecorded(configuration: MachineConfiguration) -> Message | None:
    """Return why no history can be kept there; a database out of reach is waited for."""
    settings = configuration.historian
    try:
        with suppress(OSError):
            check_database(settings.url, settings.password.reveal())
    except ConfigurationError as error:
        return error.message
    return None
