"""What stands before every page: who may be spoken to by which name, from where, and how long.

A browser is a deputy of everybody whose page is open in it. So a request counts only if it names
this server as it is known (a name that somebody else lets point here is refused), if what changes
something comes from a page of ours, and if it is no larger than it may be; and every answer tells
the browser to take nothing from elsewhere.
"""

import asyncio
import re
from collections.abc import Collection, Iterable, Iterator, Mapping
from typing import Final, final

from starlette.datastructures import Headers, MutableHeaders
from starlette.requests import ClientDisconnect, HTTPConnection
from starlette.responses import Response
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from thermaxis.web._language import LANGUAGE_COOKIE, language_of
from thermaxis.web._plain_page import refusal

LARGEST_BODY_BYTES: Final = 16 * 1024
"""Largest body of a request; a log-in or a request to the loop has some hundred. [byte]"""
BODY_S: Final = 60.0
"""Time in which a body must have come. [s]"""
LONGEST_PATH: Final = 1024
"""Longest path. [1]"""
LONGEST_QUERY: Final = 4096
"""Longest query. [1]"""
FORWARDED: Final = re.compile(
    "forwarded|via|x-forwarded-.*|(x-real|x-client|true-client|cf-connecting)-ip"
)
"""Headers by which a proxy says that it stands between."""

_SAFE: Final = frozenset({"GET", "HEAD"})
_METHODS: Final = frozenset({*_SAFE, "POST"})
_NAME: Final = re.compile(r"(?:\[[0-9a-f:.]+\]|[a-z0-9][a-z0-9._-]*)(?::[0-9]{1,5})?")
_HERE: Final = re.compile(r"(?:localhost|127\.[0-9.]+|\[::1\])(?::[0-9]+)?")
_PATH: Final = re.compile(r"(?:/[A-Za-z0-9_~-][A-Za-z0-9._~-]*)+/?|/")
_POLICY_VIOLATION: Final = 1008
_FEATURES: Final = (
    *("accelerometer", "camera", "display-capture", "geolocation", "gyroscope", "microphone"),
    *("midi", "payment", "serial", "usb"),
)
_POLICY: Final = (
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data: blob:; "
    "connect-src 'self'; font-src 'self'; frame-src 'self'; form-action 'self'; "
    "frame-ancestors 'none'; base-uri 'none'"
)
_MARKS: Final = {
    "content-security-policy": _POLICY,
    "x-content-type-options": "nosniff",
    "referrer-policy": "no-referrer",
    "cross-origin-opener-policy": "same-origin",
    "cross-origin-resource-policy": "same-origin",
    "permissions-policy": ", ".join(f"{feature}=()" for feature in _FEATURES),
    "cache-control": "no-store",
}

_NONE: Final[Mapping[str, int]] = {}
_Wrong = tuple[int, str]
"""Why a request is refused: status of HTTP [1] and key of the words."""
_HOST_WRONG: Final = 421, "login-host"
_ORIGIN_WRONG: Final = 403, "common-refused_origin"
_PATH_WRONG: Final = 404, "common-no_page"
_LONG: Final = 414, "common-refused_long"
_METHOD_WRONG: Final = 405, "common-refused_method"
_KIND_WRONG: Final = 415, "common-refused_kind"
_TOO_LARGE: Final = 413, "common-refused_large"
_TOO_SLOW: Final = 408, "common-refused_slow"


@final
class Guard:
    """Refuses what no page of the screen would send, and bounds and marks every answer.

    The header ``Host`` must stand once and name the server as `hosts` do, else 421; so must it if
    a proxy says that it stands between, and the name is this computer's own: then a proxy has put
    it there, and whoever comes through it is not at this computer. What is no
    GET and no HEAD, and every web socket, must carry an ``Origin`` that is exactly this server,
    else 403; methods other than GET, HEAD and POST are 405. A path consists of plain letters,
    digits and ``. _ ~ -``, without anything encoded and without a part that begins with a dot,
    else 404. A web socket is refused with 403 for each of these. A body is counted while it is
    read: 413 beyond `LARGEST_BODY_BYTES` or what `largest_bytes` says for its path, and 408 where
    it takes longer than `BODY_S`. What comes to `json_paths` must be called ``application/json``,
    as no form of a page elsewhere can, else 415. A request whose sender goes away is answered
    nothing.

    Not protected: a program that is no browser can send any ``Host`` and ``Origin`` it likes; what
    it may do is decided by the log-in and its token. What else forwarded headers say is not looked
    at, so that a reverse proxy must keep ``Host`` and scheme as they are. How many connections
    there are, and how slowly a header comes, `_connections` bounds. A browser is not told to ask
    by TLS alone from now on (``Strict-Transport-Security``): with a certificate that is signed by
    itself it would let nobody pass the warning any more, and it holds for every port of the
    computer.

    References
    ----------
    OWASP Cheat Sheets on cross-site request forgery and on HTTP headers; Fetch standard, 3.2.
    """

    def __init__(
        self,
        app: ASGIApp,
        hosts: Iterable[str],
        *,
        secure: bool,
        language: str = "en",
        largest_bytes: Mapping[str, int] = _NONE,
        json_paths: Collection[str] = (),
    ) -> None:
        self._app, self._largest_bytes, self._json_paths = app, largest_bytes, json_paths
        self._scheme, self._own_port = ("https", ":443") if secure else ("http", ":80")
        self._language = language
        for host in hosts:
            if _NAME.fullmatch(host) is None:
                raise ValueError(f"{host!r} is no name of a host")
        self._hosts = frozenset(host.removesuffix(self._own_port) for host in hosts)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer or hand on a request, a web socket, or the life of the application."""
        if scope["type"] == "lifespan":
            await self._app(scope, receive, send)
            return
        wrong = next((wrong for refused, wrong in self._rules(scope) if refused), None)
        if scope["type"] == "http":
            await self._answer(scope, _Body(receive, self._largest(scope["path"]), wrong), send)
        elif wrong is None:
            await self._app(scope, receive, send)
        else:  # before it is one: the web server answers 403, and logs no error
            await receive()
            await send({"type": "websocket.close", "code": _POLICY_VIOLATION})

    def _rules(self, scope: Scope) -> Iterator[tuple[bool, _Wrong]]:
        """Yield by what a request is refused before it is read, each after the ones before."""
        headers, path, method = Headers(scope=scope), scope["path"], scope.get("method", "GET")
        names, raw = headers.getlist("host"), scope.get("raw_path") or path.encode()
        host = names[0].lower().removesuffix(self._own_port) if len(names) == 1 else ""
        forwarded = any(map(FORWARDED.fullmatch, headers))
        yield host not in self._hosts, _HOST_WRONG
        yield forwarded and _HERE.fullmatch(host) is not None, _HOST_WRONG
        yield method not in _METHODS, _METHOD_WRONG
        yield len(raw) > LONGEST_PATH or len(scope["query_string"]) > LONGEST_QUERY, _LONG
        yield not _PATH.fullmatch(path) or path.encode() != raw, _PATH_WRONG
        looks = method in _SAFE and scope["type"] == "http"
        ours = headers.getlist("origin") == [f"{self._scheme}://{host}"]
        yield not (looks or ours), _ORIGIN_WRONG
        length = headers.get("content-length", "0")[:18]
        yield not length.isdecimal() or int(length) > self._largest(path), _TOO_LARGE
        kind = headers.get("content-type", "").partition(";")[0].strip().lower()
        yield not looks and path in self._json_paths and kind != "application/json", _KIND_WRONG

    def _largest(self, path: str) -> int:
        return self._largest_bytes.get(path, LARGEST_BODY_BYTES)

    async def _answer(self, scope: Scope, body: "_Body", send: Send) -> None:
        """Mark an answer, and refuse in its place where the body must not be read, or read on."""
        started = False

        async def marked(message: Message) -> None:
            if message["type"] == "http.response.start":
                _mark(message, scope["path"])
            await send(message)

        async def answered(message: Message) -> None:
            nonlocal started
            if body.wrong is None:
                started = True
                await marked(message)
            elif not started:
                started = True
                await self._refusal(body.wrong, scope)(scope, body.receive, marked)

        try:
            if body.wrong is None:
                await self._app(scope, body.receive, answered)
        except* ClientDisconnect:
            pass
        if body.wrong is not None:
            await answered({})

    def _refusal(self, wrong: _Wrong, scope: Scope) -> Response:
        status, key = wrong
        asked = HTTPConnection(scope)
        chosen, liked = asked.cookies.get(LANGUAGE_COOKIE), asked.headers.get("accept-language")
        found = refusal(asked, language_of(chosen, liked, self._language), status, key)
        found.headers["connection"] = "close"  # what is left of the request is not read
        if wrong == _METHOD_WRONG:
            found.headers["allow"] = "GET, HEAD, POST"
        return found


@final
class _Body:
    """The body of a request, counted while it is read."""

    def __init__(self, receive: Receive, largest: int, wrong: _Wrong | None) -> None:
        self._receive = receive
        self._left = largest
        self._end_s: float | None = asyncio.get_running_loop().time() + BODY_S
        self.wrong = wrong

    async def receive(self) -> Message:
        """Return the next part; that the sender is gone where it is too much, or too late."""
        if self.wrong is None:
            try:
                async with asyncio.timeout_at(self._end_s):
                    message = await self._receive()
            except TimeoutError:
                self.wrong = _TOO_SLOW
            else:
                self._left -= len(message.get("body", b""))
                if self._left >= 0:
                    self._end_s = self._end_s if message.get("more_body", False) else None
                    return message
                self.wrong = _TOO_LARGE
        return {"type": "http.disconnect"}


def _mark(message: Message, path: str) -> None:
    """Put our marks on an answer; a policy that a page has set for itself stays."""
    headers = MutableHeaders(raw=message.setdefault("headers", []))
    kept = {"content-security-policy", *(("cache-control",) if path.startswith("/static/") else ())}
    for name, value in _MARKS.items():
        if name not in kept or name not in headers:
            headers[name] = value
