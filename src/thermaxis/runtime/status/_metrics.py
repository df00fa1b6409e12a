"""Figures of the loop for Prometheus: a page of text, made when it is asked for.

The page is the text format 0.0.4, written here: a handful of gauges and counters of one program
needs no registry, and a library's multiprocess mode is known to lose collectors [src].
"""

import asyncio
import hmac
import math
import ssl
from collections.abc import Iterable, Iterator, Mapping, Sequence
from datetime import datetime
from typing import cast, final
from urllib.parse import urlsplit

from thermaxis.codes import Place, printable
from thermaxis.compensation import SampleQuality, SupervisorState
from thermaxis.errors import ConfigurationError
from thermaxis.runtime._ports import Clock
from thermaxis.runtime.config import MetricsSettings
from thermaxis.runtime.host import is_loopback, server_context
from thermaxis.runtime.status._alarms import PRIORITIES
from thermaxis.runtime.status._nodes import Leaf, Snapshot, Value, leaves_of, shape_of
from thermaxis.runtime.status._status import RuntimeStatus

CONTENT_TYPE = "text/plain; version=0.0.4; charset=utf-8"
"""Content type of the page."""
LARGEST_REQUEST_BYTES = 8192
"""Largest request: line and header. [byte]"""
REQUEST_S = 5.0
"""Time in which a request must have come, and its answer have been taken. [s]"""
MOST_CONNECTIONS = 8
"""Connections at once. [1]"""
_LONGEST_LABEL = 200

Samples = Iterable[tuple[Mapping[str, str], Value]]
"""Labels and value; a value that is none is left out."""


def format_metrics(status: RuntimeStatus | None, age_s: float) -> str:
    """Return the page in the text format 0.0.4; every metric begins with ``thermaxis_``."""
    lines: list[str] = []
    for figure, text, samples in _figures(status, age_s):
        name = f"thermaxis_{figure}"
        rows = [
            f"{name}{_labels(labels)} {_number(value)}"
            for labels, value in samples
            if value is not None
        ]
        if rows:
            kind = "counter" if figure.endswith("_total") else "gauge"
            lines += [f"# HELP {name} {text}", f"# TYPE {name} {kind}", *rows]
    return "\n".join([*lines, ""])


def _labels(labels: Mapping[str, str]) -> str:
    if not labels:
        return ""
    shown = (
        f'{key}="{printable(value, _LONGEST_LABEL).translate(_ESCAPES)}"'
        for key, value in labels.items()
    )
    return "{" + ",".join(shown) + "}"


_ESCAPES = str.maketrans({"\\": "\\\\", '"': '\\"'})


def _number(value: Value) -> str:
    number = value.timestamp() if isinstance(value, datetime) else float(cast("float", value))
    if math.isnan(number):
        return "NaN"
    if math.isinf(number):
        return "+Inf" if number > 0.0 else "-Inf"
    return repr(number)


def _figures(status: RuntimeStatus | None, age_s: float) -> Iterator[tuple[str, str, Samples]]:
    """Yield name, meaning and samples of every metric, most of them as the leaves name them."""
    yield "up", "1 while the loop has published a cycle.", [({}, status is not None)]
    if status is None:
        return
    yield "status_age_seconds", "Time since the last cycle was published.", [({}, age_s)]
    about = {
        "machine": status.machine,
        "model": status.model_file,
        "model_sha256": status.model_sha256,
    }
    yield "loop", "What runs; always 1.", [(about, 1.0)]
    now, leaves = Snapshot(status), leaves_of(shape_of(status))
    for leaf in leaves.loop:
        if leaf.metric:
            yield leaf.metric, leaf.meaning, [({}, leaf.value(now))]
    yield (
        "state",
        "1 for the state that the compensation is in, 0 for the others.",
        [({"state": s.value}, s is status.output.state) for s in SupervisorState],
    )
    yield (
        "connected",
        "1 while the machine of the values (source) or of the offsets (sink) is reached.",
        [
            ({"border": "source"}, status.source_connected),
            ({"border": "sink"}, status.sink_connected),
        ],
    )
    yield (
        "alarms",
        "Alarms that stand, by priority.",
        [({"priority": p}, sum(a.priority == p for a in status.alarms)) for p in PRIORITIES],
    )
    yield from _by_name("output", leaves.outputs, now)
    yield from _by_name("channel", leaves.inputs, now)
    yield (
        "input_good",
        "1 while nothing is wrong with a channel.",
        [
            ({"channel": name}, quality is SampleQuality.GOOD)
            for name, quality in zip(status.channels, status.output.qualities, strict=False)
        ],
    )


def _by_name(
    label: str, leaves: Mapping[str, Sequence[Leaf]], now: Snapshot
) -> Iterator[tuple[str, str, Samples]]:
    """Yield the metrics of all outputs or channels, each with a sample for every name."""
    for same in zip(*leaves.values(), strict=True):
        first = same[0]
        if first.metric:
            told = zip(leaves, same, strict=True)
            samples = [({label: name}, leaf.value(now)) for name, leaf in told]
            yield first.metric, first.meaning, samples


class _RefusalError(Exception):
    """A request that is not answered with the page."""

    def __init__(self, line: str, header: str = "") -> None:
        super().__init__(line)
        self.line = line
        self.header = header


@final
class MetricsServer:
    """Serves the page at ``/metrics``, and nothing else.

    Not protected: figures are readable by every program on this computer, unless a token is set.

    Parameters
    ----------
    settings : MetricsSettings
        Address, token and certificate.
    clock : Clock
        Time.

    """

    def __init__(self, settings: MetricsSettings, clock: Clock) -> None:
        self._settings = settings
        self._clock = clock
        self._status: RuntimeStatus | None = None
        self._published_s = 0.0
        self._server: asyncio.Server | None = None
        self._serving: set[asyncio.Task[None]] = set()

    @property
    def port(self) -> int:
        """Port at which it listens, 0 while it does not. [1]"""
        if self._server is None or not self._server.sockets:
            return 0
        return int(self._server.sockets[0].getsockname()[1])

    async def open(self) -> None:
        """Begin to listen.

        Raises
        ------
        ConfigurationError
            If certificate or key cannot be read, others may read the key, the address is not this
            computer's, or the port is taken.
        """
        settings = self._settings
        context = None
        if settings.certificate is not None and settings.private_key is not None:
            context = server_context(settings.certificate, settings.private_key)
        try:
            self._server = await asyncio.start_server(
                self._connected,
                settings.address,
                settings.port,
                ssl=context,
                ssl_handshake_timeout=None if context is None else REQUEST_S,
                limit=LARGEST_REQUEST_BYTES,
            )
        except OSError as error:
            raise ConfigurationError(
                "cannot_listen",
                cause=error.strerror or str(error),
                port=settings.port,
                place=Place(settings.address, key="metrics"),
            ) from None

    def publish(self, status: RuntimeStatus) -> None:
        """Keep a status until somebody asks. Returns at once."""
        self._status = status
        self._published_s = self._clock.monotonic_s()

    async def close(self) -> None:
        """End; every connection is closed."""
        if self._server is None:
            return
        self._server.close()
        for task in tuple(self._serving):
            task.cancel()
        await asyncio.gather(*self._serving, return_exceptions=True)
        await self._server.wait_closed()
        self._server = None

    def _connected(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        if len(self._serving) >= MOST_CONNECTIONS:
            writer.close()
            return
        task = asyncio.create_task(self._serve(reader, writer))
        self._serving.add(task)
        task.add_done_callback(self._serving.discard)

    async def _serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        try:
            async with asyncio.timeout(REQUEST_S):
                writer.write(await self._answer(reader))
                await writer.drain()
            writer.close()
        except (TimeoutError, ConnectionError, ssl.SSLError):
            pass
        finally:
            if not writer.is_closing():
                writer.transport.abort()

    async def _answer(self, reader: asyncio.StreamReader) -> bytes:
        try:
            page = await self._page(reader)
        except _RefusalError as refusal:
            body = refusal.line.encode()
            return _response(refusal.line, body, "text/plain; charset=utf-8", refusal.header)
        return _response("200 OK", page, CONTENT_TYPE)

    async def _page(self, reader: asyncio.StreamReader) -> bytes:
        try:
            head = await reader.readuntil(b"\r\n\r\n")
        except asyncio.LimitOverrunError:
            raise _RefusalError("431 Request Header Fields Too Large") from None
        except asyncio.IncompleteReadError:
            raise _RefusalError("400 Bad Request") from None
        words, header = _parsed(head)
        self._check(header)
        if words[1].partition("?")[0] != "/metrics":
            raise _RefusalError("404 Not Found")
        if words[0] not in {"GET", "HEAD"}:
            raise _RefusalError("405 Method Not Allowed", "Allow: GET\r\n")
        age_s = self._clock.monotonic_s() - self._published_s
        page = format_metrics(self._status, age_s).encode("utf-8", "replace")
        return page if words[0] == "GET" else b""

    def _check(self, header: dict[str, str]) -> None:
        """Refuse who does not know the token, and pages of elsewhere in a browser of here."""
        token = self._settings.token.reveal()
        given = header.get("authorization", "").encode("utf-8", "replace")
        if token and not hmac.compare_digest(given, f"Bearer {token}".encode()):
            raise _RefusalError("401 Unauthorized", "WWW-Authenticate: Bearer\r\n")
        if is_loopback(self._settings.address) and not is_loopback(_host_of(header)):
            raise _RefusalError("421 Misdirected Request")


def _parsed(head: bytes) -> tuple[list[str], dict[str, str]]:
    """Return the words of a request's first line, and its header."""
    lines = head.decode("latin-1").split("\r\n")
    words = lines[0].split(" ")
    if len(words) != 3 or not words[2].startswith("HTTP/1."):
        raise _RefusalError("400 Bad Request")
    header: dict[str, str] = {}
    for line in lines[1:]:
        key, colon, value = line.partition(":")
        if colon:
            header.setdefault(key.strip().lower(), value.strip())
    return words, header


def _host_of(header: dict[str, str]) -> str:
    """Return the name by which a client calls this computer; empty where it is none."""
    try:
        return urlsplit("//" + header.get("host", "")).hostname or ""
    except ValueError:
        return ""


def _response(line: str, body: bytes, content_type: str, header: str = "") -> bytes:
    head = (
        f"HTTP/1.1 {line}\r\nContent-Type: {content_type}\r\nContent-Length: {len(body)}\r\n"
        f"{header}Cache-Control: no-store\r\nConnection: close\r\n\r\n"
    )
    return head.encode("ascii") + body
