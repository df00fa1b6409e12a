"""Figures of the loop for Prometheus, made when they are asked for, in threads."""

import asyncio
import contextlib
import hmac
import socket
import ssl
import threading
from collections.abc import Callable, Iterable, Iterator, Mapping
from datetime import datetime
from functools import partial
from socketserver import TCPServer, ThreadingMixIn
from typing import TYPE_CHECKING, Any, cast, final
from urllib.parse import urlsplit
from wsgiref.simple_server import WSGIRequestHandler, WSGIServer

from prometheus_client import CollectorRegistry, make_wsgi_app  # pyright: ignore[reportUnknownVariableType] - no types
from prometheus_client.core import CounterMetricFamily, GaugeMetricFamily, Metric

from thermaxis.codes import printable
from thermaxis.compensation import SampleQuality, SupervisorState
from thermaxis.errors import ConfigurationError
from thermaxis.runtime._ports import Clock
from thermaxis.runtime.config import MetricsSettings
from thermaxis.runtime.host import is_loopback, server_context
from thermaxis.runtime.status._alarms import PRIORITIES
from thermaxis.runtime.status._fields import Leaf, leaves_of, shape_of
from thermaxis.runtime.status._status import RuntimeStatus

if TYPE_CHECKING:
    from wsgiref.types import StartResponse, WSGIEnvironment

SILENT_S = 5.0
"""A client that is silent for so long is left. [s]"""
MOST_CONNECTIONS = 8
"""Connections at once. [1]"""
_LONGEST_LABEL = 200


def metrics_of(status: RuntimeStatus | None, age_s: float) -> Iterator[Metric]:
    """Yield every metric of a status; what is not known has no sample."""
    yield _metric("up", "1 while the loop has published a cycle.", [({}, status is not None)])
    if status is None:
        return
    yield _metric("status_age_seconds", "Time since the last cycle was published.", [({}, age_s)])
    about = {
        "machine": status.machine,
        "model": status.model_file,
        "model_sha256": status.model_sha256,
    }
    yield _metric("loop", "What runs; always 1.", [(about, 1.0)])
    output = status.output
    yield _metric(
        "state",
        "1 for the state that the compensation is in, 0 for the others.",
        [({"state": s.value}, s is output.state) for s in SupervisorState],
    )
    yield _metric(
        "connected",
        "1 while the machine of the values (source) or of the offsets (sink) is reached.",
        [
            ({"border": "source"}, status.source_connected),
            ({"border": "sink"}, status.sink_connected),
        ],
    )
    yield _metric(
        "alarms",
        "Alarms that stand, by priority.",
        [({"priority": p}, sum(a.priority == p for a in status.alarms)) for p in PRIORITIES],
    )
    yield _metric(
        "certificate_expiry_timestamp_seconds",
        "Until when a certificate is valid.",
        [({"certificate": key}, end) for key, end in status.certificates.items()],
    )
    yield _metric(
        "input_good",
        "1 while nothing is wrong with a channel.",
        [
            ({"channel": name}, quality is SampleQuality.GOOD)
            for name, quality in zip(status.channels, output.qualities, strict=False)
        ],
    )
    leaves = leaves_of(shape_of(status))
    for leaf in leaves.loop:
        yield from _of_fields("", [leaf], status)
    for label, table in (("output", "outputs"), ("channel", "inputs")):
        for same in zip(*leaves.tables[table].values(), strict=True):
            yield from _of_fields(label, same, status)


def _of_fields(label: str, same: Iterable[Leaf], status: RuntimeStatus) -> Iterator[Metric]:
    """Yield the metric of one field, with a sample for every output or channel."""
    first, *_ = same
    if first.field.metric:
        read = [(leaf.owner.name, leaf.read(status)) for leaf in same]
        samples = [
            ({label: name} if label else {}, None if said.quality.startswith("Bad") else said.value)
            for name, said in read
        ]
        yield _metric(first.field.metric, first.field.meaning, samples)


def _metric(name: str, text: str, samples: Iterable[tuple[Mapping[str, str], object]]) -> Metric:
    family = CounterMetricFamily if name.endswith("_total") else GaugeMetricFamily
    metric = family(f"thermaxis_{name}", text)
    for labels, value in samples:
        if value is not None:
            shown = {key: printable(one, _LONGEST_LABEL) for key, one in labels.items()}
            number = value.timestamp() if isinstance(value, datetime) else cast("float", value)
            metric.add_sample(f"thermaxis_{name}", shown, float(number))
    return metric


class _Handler(WSGIRequestHandler):
    """Answers without a log."""

    timeout = SILENT_S

    def log_message(self, format: str, *args: object) -> None:  # noqa: A002 - the library's name
        """Log nothing."""


class _HttpServer(ThreadingMixIn, WSGIServer):
    """Answers each connection in a thread of its own, few at once."""

    daemon_threads = True
    request_queue_size = 2 * MOST_CONNECTIONS  # what comes at once waits no second

    def __init__(
        self, address: tuple[str, int], app: Callable[..., Any], context: ssl.SSLContext | None
    ) -> None:
        self.address_family = socket.AF_INET6 if ":" in address[0] else socket.AF_INET
        self._context = context
        self._free = threading.Semaphore(MOST_CONNECTIONS)
        super().__init__(address, _Handler)
        self.set_app(app)

    def server_bind(self) -> None:
        """Bind without a search for the computer's name, which takes long where nobody knows it."""
        TCPServer.server_bind(self)
        self.server_name, self.server_port = self.socket.getsockname()[:2]
        self.setup_environ()

    def verify_request(self, request: Any, client_address: Any) -> bool:
        """Return whether there is a place; what is too many is closed."""
        del request, client_address
        return self._free.acquire(blocking=False)

    def finish_request(self, request: Any, client_address: Any) -> None:
        """Answer, after the handshake where there is a certificate."""
        with contextlib.ExitStack() as ending, contextlib.suppress(OSError):
            ending.callback(self._free.release)
            if self._context is not None:
                request = self._context.wrap_socket(
                    request, server_side=True, do_handshake_on_connect=False
                )
            with request:
                super().finish_request(request, client_address)


@final
class MetricsServer:
    """Serves the figures at ``/metrics``, and nothing else.

    Not protected: figures are readable by every program on this computer, unless a token is set.
    Whoever reaches the port can keep others from the page by many connections, not the loop from
    its work: they are few at once.

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
        self._published: tuple[RuntimeStatus | None, float] = None, 0.0
        self._server: _HttpServer | None = None
        registry = CollectorRegistry(auto_describe=False)
        registry.register(cast("Any", self))
        self._page: Callable[..., Iterable[bytes]] = make_wsgi_app(registry)

    @property
    def port(self) -> int:
        """Port at which it listens, 0 while it does not. [1]"""
        return 0 if self._server is None else self._server.server_port

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
            address = (settings.address, settings.port)
            self._server = await asyncio.to_thread(_HttpServer, address, self._answer, context)
        except OSError as error:
            raise ConfigurationError(
                "cannot_listen",
                cause=error.strerror or str(error),
                port=settings.port,
                file=settings.address,
                key="metrics",
            ) from None
        serve = partial(self._server.serve_forever, poll_interval=0.1)
        threading.Thread(target=serve, name="metrics", daemon=True).start()

    def publish(self, status: RuntimeStatus) -> None:
        """Keep a status until somebody asks. Returns at once."""
        self._published = status, self._clock.monotonic_s()

    def collect(self) -> Iterator[Metric]:
        """Yield every metric, for the library's registry."""
        status, published_s = self._published
        return metrics_of(status, self._clock.monotonic_s() - published_s)

    async def close(self) -> None:
        """End; no connection is taken any more, and none is waited for."""
        server, self._server = self._server, None
        if server is not None:
            await asyncio.to_thread(server.shutdown)
            server.socket.close()

    def _answer(self, asked: "WSGIEnvironment", begin: "StartResponse") -> Iterable[bytes]:
        """Refuse who does not know the token, and pages of elsewhere in a browser of here."""
        token = self._settings.token.reveal()
        given = str(asked.get("HTTP_AUTHORIZATION", "")).encode("latin-1", "replace")
        if token and not hmac.compare_digest(given, f"Bearer {token}".encode()):
            return _refuse(begin, "401 Unauthorized", ("WWW-Authenticate", "Bearer"))
        if is_loopback(self._settings.address) and not is_loopback(_host_of(asked)):
            return _refuse(begin, "421 Misdirected Request")
        if asked["PATH_INFO"] != "/metrics":
            return _refuse(begin, "404 Not Found")
        return self._page(asked, begin)


def _host_of(asked: "WSGIEnvironment") -> str:
    """Return the name by which a client calls this computer; empty where it is none."""
    try:
        return urlsplit(f"//{asked.get('HTTP_HOST', '')}").hostname or ""
    except ValueError:
        return ""


def _refuse(begin: "StartResponse", line: str, *header: tuple[str, str]) -> list[bytes]:
    begin(line, [("Content-Type", "text/plain; charset=utf-8"), *header])
    return [line.encode()]
