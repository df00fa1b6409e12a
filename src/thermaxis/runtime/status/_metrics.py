"""Figures of the loop for Prometheus: a page of text, made when it is asked for.

The page is the text format 0.0.4, written here: a handful of gauges and counters of one program
needs no registry, and a library's multiprocess mode is known to lose collectors [src].
"""

import asyncio
import hmac
import math
import ssl
from collections.abc import Iterable, Iterator
from typing import NamedTuple, final
from urllib.parse import urlsplit

from thermaxis.codes import Place, printable
from thermaxis.errors import ConfigurationError
from thermaxis.runtime._ports import NOT_READ, Clock
from thermaxis.runtime.config import MetricsSettings
from thermaxis.runtime.host import is_loopback, server_context
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
_STATES = ("Off", "Warming", "Active", "Holding", "Fading", "Fault")
_PRIORITIES = ("critical", "high", "medium", "low")


class _Figure(NamedTuple):
    """One metric with all its samples."""

    name: str
    """Its name, with its unit, as Prometheus names them."""
    kind: str
    """``gauge`` or ``counter``."""
    text: str
    """What it means."""
    samples: Iterable[tuple[dict[str, str], float | None]]
    """Labels and value; a value that is none is left out."""


def format_metrics(status: RuntimeStatus | None, age_s: float) -> str:
    """Return the page.

    Parameters
    ----------
    status : RuntimeStatus or None
        Status of the last cycle; None before the first.
    age_s : float
        Time since it was published. [s]

    Returns
    -------
    str
        The text format 0.0.4; every metric begins with ``thermaxis_``.
    """
    lines: list[str] = []
    for figure in _figures(status, age_s):
        name = f"thermaxis_{figure.name}"
        rows = [
            f"{name}{_labels(labels)} {_number(value)}"
            for labels, value in figure.samples
            if value is not None
        ]
        if rows:
            lines += [f"# HELP {name} {figure.text}", f"# TYPE {name} {figure.kind}", *rows]
    return "\n".join([*lines, ""])


def _labels(labels: dict[str, str]) -> str:
    if not labels:
        return ""
    shown = (
        f'{key}="{printable(value, _LONGEST_LABEL).translate(_ESCAPES)}"'
        for key, value in labels.items()
    )
    return "{" + ",".join(shown) + "}"


_ESCAPES = str.maketrans({"\\": "\\\\", '"': '\\"'})


def _number(value: float) -> str:
    if math.isnan(value):
        return "NaN"
    if math.isinf(value):
        return "+Inf" if value > 0.0 else "-Inf"
    return repr(float(value))


def _one(value: float | None) -> list[tuple[dict[str, str], float | None]]:
    return [({}, value)]


def _figures(status: RuntimeStatus | None, age_s: float) -> Iterator[_Figure]:
    if status is None:
        yield _Figure("up", "gauge", "1 while the loop has published a cycle.", _one(0.0))
        return
    yield _Figure("up", "gauge", "1 while the loop has published a cycle.", _one(1.0))
    yield _Figure(
        "status_age_seconds", "gauge", "Time since the last cycle was published.", _one(age_s)
    )
    yield from _of_the_loop(status)
    yield from _of_outputs(status)
    yield from _of_inputs(status)


def _of_the_loop(status: RuntimeStatus) -> Iterator[_Figure]:
    output, historian = status.output, status.historian
    about = {
        "machine": status.machine,
        "model": status.model_file,
        "model_sha256": status.model_sha256,
    }
    yield _Figure("loop", "gauge", "What runs; always 1.", [(about, 1.0)])
    yield _Figure(
        "start_time_seconds",
        "gauge",
        "When the loop was started, as Unix time.",
        _one(status.started.timestamp()),
    )
    yield _Figure("cycles_total", "counter", "Cycles since the start.", _one(status.number))
    yield _Figure("cycle_seconds", "gauge", "Nominal cycle.", _one(status.cycle_s))
    yield _Figure(
        "lateness_seconds", "gauge", "How late the last cycle began.", _one(status.lateness_s)
    )
    yield _Figure(
        "overruns_total",
        "counter",
        "Cycles that were missed since the start.",
        _one(status.overruns),
    )
    yield _Figure(
        "state",
        "gauge",
        "1 for the state that the compensation is in, 0 for the others.",
        [({"state": s}, 1.0 if output.state.value == s else 0.0) for s in _STATES],
    )
    yield _Figure(
        "enabled", "gauge", "1 while somebody has enabled the compensation.", _one(status.enabled)
    )
    yield _Figure(
        "connected",
        "gauge",
        "1 while the machine of the values (source) or of the offsets (sink) is reached.",
        [
            ({"border": "source"}, float(status.source_connected)),
            ({"border": "sink"}, float(status.sink_connected)),
        ],
    )
    yield _Figure(
        "alarms",
        "gauge",
        "Alarms that stand, by priority.",
        [
            ({"priority": p}, float(sum(a.priority == p for a in status.alarms)))
            for p in _PRIORITIES
        ],
    )
    yield _Figure(
        "historian_storing", "gauge", "1 while records are stored.", _one(historian.storing)
    )
    yield _Figure(
        "historian_waiting_records",
        "gauge",
        "Records that are kept until they can be stored.",
        _one(historian.waiting),
    )
    yield _Figure(
        "historian_lost_records_total",
        "counter",
        "Records that were lost since the start.",
        _one(historian.lost),
    )
    yield _Figure(
        "workpiece_diameter_millimetres",
        "gauge",
        "Clamping diameter; absent for the tool centre point.",
        _one(status.diameter_mm),
    )


def _of_outputs(status: RuntimeStatus) -> Iterator[_Figure]:
    output, names = status.output, status.outputs

    def by_output(values: Iterable[float | None]) -> list[tuple[dict[str, str], float | None]]:
        return [({"output": n}, v) for n, v in zip(names, values, strict=False)]

    applied = [status.applied.get(name) for name in names]
    yield _Figure(
        "correction_micrometres",
        "gauge",
        "Correction in force; positive moves the tool point away from the workpiece.",
        by_output(output.correction_um),
    )
    yield _Figure(
        "wanted_micrometres",
        "gauge",
        "Correction before rate and supervisor.",
        by_output(output.wanted_um),
    )
    yield _Figure(
        "accepted_micrometres",
        "gauge",
        "What the machine reports as set; absent where it cannot be read.",
        by_output(a.accepted_um if a is not None else None for a in applied),
    )
    yield _Figure(
        "effective_micrometres",
        "gauge",
        "What the machine reports as acting now; absent where it does not say.",
        by_output(a.effective_um if a is not None else None for a in applied),
    )
    yield _Figure(
        "model_micrometres", "gauge", "Displacement by the model.", by_output(output.model_um)
    )
    yield _Figure(
        "weight_ratio",
        "gauge",
        "Weight of the model; below 1 outside the range of its training logs.",
        by_output(output.weight),
    )
    yield _Figure("trim_micrometres", "gauge", "A person's addition.", by_output(output.trim_um))
    yield _Figure(
        "at_limit",
        "gauge",
        "1 while the model asks for more than the output limit allows.",
        by_output(output.at_limit),
    )


def _of_inputs(status: RuntimeStatus) -> Iterator[_Figure]:
    output, names = status.output, status.channels

    def by_channel(values: Iterable[float | None]) -> list[tuple[dict[str, str], float | None]]:
        return [({"channel": n}, v) for n, v in zip(names, values, strict=False)]

    yield _Figure(
        "input_celsius",
        "gauge",
        "Value that the model was given; absent where there was none.",
        by_channel(output.values),
    )
    yield _Figure(
        "input_good",
        "gauge",
        "1 while nothing is wrong with a channel.",
        by_channel(float(q.value == "good") for q in output.qualities),
    )
    yield _Figure(
        "input_age_seconds",
        "gauge",
        "Time since the source stamped the value; absent without a time stamp.",
        by_channel(status.samples.get(name, NOT_READ).age_s for name in names),
    )


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
        """Keep a status until somebody asks. Returns at once.

        Parameters
        ----------
        status : RuntimeStatus
            Status after a cycle.
        """
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
