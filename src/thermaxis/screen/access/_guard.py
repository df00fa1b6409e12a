"""What stands before every page: who may be spoken to by which name, from where, and how long.

A browser is a deputy of everybody whose page is open in it. So a request counts only if it names
this server as it is known (a name that somebody else lets point here is refused), if what changes
something comes from a page of ours, and if it is no larger than it may be; and every answer tells
the browser to take nothing from elsewhere.
"""

import asyncio
import json
import re
from collections.abc import Iterable, Mapping, Sequence
from typing import Final, NamedTuple, NoReturn, final

from starlette.requests import ClientDisconnect, cookie_parser
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from thermaxis.messages import sentence
from thermaxis.screen.access._access import LANGUAGE_COOKIE
from thermaxis.screen.access._language import language_of
from thermaxis.screen.access._plain_page import STYLE_SOURCE, plain_page, wants_page

LARGEST_BODY_BYTES: Final = 16 * 1024
"""Largest body of a request; a log-in or a request to the loop has some hundred. [byte]"""
LARGEST_BODIES: Final[Mapping[str, int]] = {"/positioning/upload": 20 * 1000 * 1000}
"""Larger ones, by path. [byte]"""
JSON_PATHS: Final = frozenset({"/ask", "/login"})
"""What is sent here must call itself JSON, as no form of a page elsewhere can."""
BODY_S: Final = 60.0
"""Time in which a body must have come. [s]"""
LONGEST_PATH: Final = 1024
"""Longest path. [1]"""
LONGEST_QUERY: Final = 4096
"""Longest query. [1]"""

_METHODS: Final = ("GET", "HEAD", "POST")
_SAFE: Final = frozenset({"GET", "HEAD"})
_NAME: Final = r"(\[[0-9a-f:.]{2,45}\]|[a-z0-9](?:[a-z0-9._-]{0,251}[a-z0-9])?)"
_HOST: Final = re.compile(rf"{_NAME}(?::([0-9]{{1,5}}))?")
_ORIGIN: Final = re.compile(rf"(https?)://{_NAME}(?::([0-9]{{1,5}}))?")
_PATH: Final = re.compile(r"(?:/[A-Za-z0-9_~-][A-Za-z0-9._~-]*)+/?|/")
_DIGITS: Final = re.compile(rb"[0-9]{1,18}")
_ODD: Final = re.compile(rb"[\x00-\x08\x0a-\x1f\x7f]")
_POLICY_VIOLATION: Final = 1008
_PERMISSIONS: Final = ", ".join(
    f"{feature}=()"
    for feature in (
        "accelerometer",
        "camera",
        "display-capture",
        "geolocation",
        "gyroscope",
        "microphone",
        "midi",
        "payment",
        "serial",
        "usb",
    )
)

Headers = list[tuple[bytes, bytes]]
"""Headers as ASGI has them."""


class _Wrong(NamedTuple):
    """Why a request is refused."""

    status: int
    """Status of HTTP. [1]"""
    error: str
    """Short name of the reason."""
    key: str
    """Key of the words."""


_HOST_WRONG = _Wrong(421, "login-host", "login-host")
_ORIGIN_WRONG = _Wrong(403, "origin", "common-refused_origin")
_PATH_WRONG = _Wrong(404, "path", "common-no_page")
_LONG = _Wrong(414, "long", "common-refused_long")
_METHOD_WRONG = _Wrong(405, "method", "common-refused_method")
_LENGTH_WRONG = _Wrong(400, "length", "common-refused_length")
_KIND_WRONG = _Wrong(415, "kind", "common-refused_kind")
_TOO_LARGE = _Wrong(413, "large", "common-refused_large")
_TOO_SLOW = _Wrong(408, "slow", "common-refused_slow")


class Place(NamedTuple):
    """A server as a browser names it."""

    name: str
    """Its name or number, in small letters."""
    port: int
    """Its port; the scheme's own where none was stated. [1]"""


def place_of(text: str, *, secure: bool) -> Place | None:
    """Return what a header ``Host`` names.

    References
    ----------
    RFC 9110, 7.2; RFC 3986, 3.2.2 and 3.2.3.
    """
    found = _HOST.fullmatch(text.lower()) if text.isascii() else None
    return None if found is None else _place(found[1], found[2], secure=secure)


def _place(name: str, port: str | None, *, secure: bool) -> Place | None:
    number = int(port) if port is not None else _port_of(secure=secure)
    return Place(name, number) if 0 < number < 65536 else None


def _port_of(*, secure: bool) -> int:
    return 443 if secure else 80


def _values(headers: Iterable[tuple[bytes, bytes]], name: bytes) -> list[bytes]:
    return [value for key, value in headers if key.lower() == name]


def _only(headers: Iterable[tuple[bytes, bytes]], name: bytes) -> str | None:
    """Return the value of a header that stands once, as it must; None otherwise."""
    found = _values(headers, name)
    return found[0].decode("latin-1") if len(found) == 1 else None


class _BodyRefusedError(Exception):
    """The rest of a body is not read."""


@final
class Guard:
    """Refuses what no page of the screen would send, and bounds and marks every answer.

    The header ``Host`` must stand once and name the server as `hosts` do, else 421. What is no
    GET and no HEAD, and every web socket, must carry an ``Origin`` that is exactly this server,
    else 403; methods other than GET, HEAD and POST are 405. A path consists of plain letters,
    digits and ``. _ ~ -``, without anything encoded and without a part that begins with a dot,
    else 404. A web socket is refused with 403 for each of these. A body is counted while it is
    read: 413, and 408 where it takes longer than `BODY_S`. What comes to `JSON_PATHS` must be
    called ``application/json``, else 415. A refusal is a small page in the language of who asks
    where a browser wants a page, JSON otherwise. A request whose sender goes away is answered
    nothing.

    Not protected: a program that is no browser can send any ``Host`` and ``Origin`` it likes; what
    it may do is decided by the log-in and its token. Forwarded headers are not looked at, so that
    a reverse proxy must keep ``Host`` and scheme as they are. How many connections there are, and
    how slowly a header comes, `_connections` bounds. A browser is not told to ask by TLS alone
    from now on (``Strict-Transport-Security``): with a certificate that is signed by itself it
    would let nobody pass the warning any more, and it holds for every port of the computer.

    References
    ----------
    OWASP Cheat Sheets on cross-site request forgery and on HTTP headers; Fetch standard, 3.2.
    """

    def __init__(
        self,
        app: ASGIApp,
        hosts: Sequence[str],
        *,
        secure: bool,
        language: str = "en",
    ) -> None:
        self._app = app
        self._secure = secure
        self._language = language
        self._places: set[Place] = set()
        for host in hosts:
            place = place_of(host, secure=secure)
            if place is None:
                raise ValueError(f"{host!r} is no name of a host")
            self._places.add(place)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer or hand on a request, a web socket, or the life of the application."""
        if scope["type"] == "lifespan":
            await self._app(scope, receive, send)
            return
        headers: Headers = list(scope["headers"])
        host = _only(headers, b"host")
        place = None if host is None else place_of(host, secure=self._secure)
        if place is None or place not in self._places:
            marks = self._marks("")
            wrong: _Wrong | None = _HOST_WRONG
        else:
            marks = self._marks(self._shown(place))
            wrong = self._wrong(scope, headers, place)
        if scope["type"] == "websocket":
            if wrong is None:
                await self._app(scope, receive, send)
            else:
                await _deny(receive, send)
        elif wrong is not None:
            await _Answer(send, marks, "", self._refusal(scope, headers)).refuse(wrong)
        else:
            await self._answer(scope, receive, send, marks)

    def _wrong(self, scope: Scope, headers: Headers, place: Place) -> _Wrong | None:
        """Return why a request that names this server is refused, or None."""
        if scope["type"] == "http" and scope["method"] not in _METHODS:
            return _METHOD_WRONG
        raw: bytes = scope.get("raw_path") or scope["path"].encode()
        if len(raw) > LONGEST_PATH or len(scope.get("query_string", b"")) > LONGEST_QUERY:
            return _LONG
        if not _PATH.fullmatch(scope["path"]) or scope["path"].encode() != raw:
            return _PATH_WRONG
        needs_origin = scope["type"] == "websocket" or scope["method"] not in _SAFE
        if needs_origin and not self._is_ours(_only(headers, b"origin"), place):
            return _ORIGIN_WRONG
        wrong = _wrong_length(headers, _largest(scope["path"]))
        if wrong is None and scope["type"] == "http" and scope["method"] not in _SAFE:
            wrong = _wrong_kind(headers, scope["path"])
        return wrong

    def _is_ours(self, origin: str | None, place: Place) -> bool:
        found = None if origin is None else _ORIGIN.fullmatch(origin)
        if found is None or (found[1] == "https") is not self._secure:
            return False
        return _place(found[2], found[3], secure=self._secure) == place

    def _shown(self, place: Place) -> str:
        name, port = place
        return name if port == _port_of(secure=self._secure) else f"{name}:{port}"

    def _marks(self, host: str) -> dict[bytes, bytes]:
        """Return what every answer carries; the host is one of our own names, or none."""
        socket = f" {'wss' if self._secure else 'ws'}://{host}" if host else ""
        policy = (
            f"default-src 'none'; script-src 'self'; style-src 'self' {STYLE_SOURCE}; "
            f"img-src 'self' data: blob:; connect-src 'self'{socket}; font-src 'self'; "
            "frame-src 'self'; form-action 'self'; frame-ancestors 'none'; base-uri 'none'"
        )
        marks = {
            "content-security-policy": policy,
            "x-content-type-options": "nosniff",
            "referrer-policy": "no-referrer",
            "cross-origin-opener-policy": "same-origin",
            "cross-origin-resource-policy": "same-origin",
            "permissions-policy": _PERMISSIONS,
            "cache-control": "no-store",
        }
        return {key.encode(): value.encode() for key, value in marks.items()}

    async def _answer(
        self, scope: Scope, receive: Receive, send: Send, marks: Mapping[bytes, bytes]
    ) -> None:
        refusal = self._refusal(scope, list(scope["headers"]))
        answer = _Answer(send, marks, scope["path"], refusal)
        body = _Body(receive, answer, _largest(scope["path"]))
        try:
            await self._app(scope, body.receive, answer.send)
        except* _BodyRefusedError:  # a page that streams has a group of tasks, and so of errors
            if answer.wrong is not None and not answer.started:
                await answer.refuse(answer.wrong)
        except* ClientDisconnect:
            pass  # nobody is there to be answered

    def _refusal(self, scope: Scope, headers: Headers) -> "_Refusal":
        """Return how a refusal is told to who asks."""
        cookies = cookie_parser(_only(headers, b"cookie") or "")
        language = language_of(
            cookies.get(LANGUAGE_COOKIE), _only(headers, b"accept-language"), self._language
        )
        page = scope["method"] in _SAFE and wants_page(_only(headers, b"accept"))
        return _Refusal(language, page)


def _largest(path: str) -> int:
    return LARGEST_BODIES.get(path, LARGEST_BODY_BYTES)


def _wrong_length(headers: Headers, largest: int) -> _Wrong | None:
    found = _values(headers, b"content-length")
    if not found:
        return None
    if len(found) > 1 or _DIGITS.fullmatch(found[0]) is None:
        return _LENGTH_WRONG
    return _TOO_LARGE if int(found[0]) > largest else None


def _wrong_kind(headers: Headers, path: str) -> _Wrong | None:
    if path not in JSON_PATHS:
        return None
    kind = (_only(headers, b"content-type") or "").partition(";")[0].strip().lower()
    return None if kind == "application/json" else _KIND_WRONG


class _Refusal(NamedTuple):
    """How a refusal is told."""

    language: str
    """In which language."""
    page: bool
    """Whether a browser wants a page."""

    def told(self, wrong: _Wrong) -> tuple[bytes, bytes]:
        """Return kind and content of the answer."""
        text = sentence(wrong.key, language=self.language)
        if not self.page:
            return b"application/json", json.dumps({"error": wrong.error, "text": text}).encode()
        title = sentence("common-not_shown", language=self.language)
        own = wrong.status != _HOST_WRONG.status
        back = sentence("common-to_the_machine", language=self.language) if own else ""
        return b"text/html; charset=utf-8", plain_page(self.language, title, text, back=back)


@final
class _Answer:
    """An answer on its way: it is marked, and replaced where the body must not be read on."""

    def __init__(
        self, send: Send, marks: Mapping[bytes, bytes], path: str, refusal: _Refusal
    ) -> None:
        self._send = send
        self._marks = marks
        self._path = path
        self._refusal = refusal
        self.started = False
        self.wrong: _Wrong | None = None

    async def send(self, message: Message) -> None:
        """Send what the application answers, unless its request was refused meanwhile."""
        if self.wrong is not None:
            if not self.started:
                await self.refuse(self.wrong)
            return
        if message["type"] == "http.response.start":
            self.started = True
            message = {**message, "headers": self._marked(message.get("headers", ()))}
        await self._send(message)

    def _marked(self, given: Iterable[tuple[bytes, bytes]]) -> Headers:
        """Return headers with our marks; a policy that a page has set for itself stays."""
        kept = {b"content-security-policy"}
        if self._path.startswith("/static/"):
            kept.add(b"cache-control")
        headers = [(key.lower(), value) for key, value in given if not (_ODD.search(key + value))]
        own = {key for key, _ in headers if key in kept}
        headers = [(key, value) for key, value in headers if key in own or key not in self._marks]
        return headers + [(key, value) for key, value in self._marks.items() if key not in own]

    async def refuse(self, wrong: _Wrong) -> None:
        """Answer with a refusal in place of everything else."""
        self.started = True
        kind, body = self._refusal.told(wrong)
        headers = _refusal_headers(wrong, kind, body, self._marks)
        await self._send(
            {"type": "http.response.start", "status": wrong.status, "headers": headers}
        )
        await self._send({"type": "http.response.body", "body": body})


def _refusal_headers(
    wrong: _Wrong, kind: bytes, body: bytes, marks: Mapping[bytes, bytes]
) -> Headers:
    headers = [
        (b"content-type", kind),
        (b"content-length", str(len(body)).encode()),
        (b"connection", b"close"),  # what is left of the request is not read
        *marks.items(),
    ]
    if wrong is _METHOD_WRONG:
        headers.append((b"allow", ", ".join(_METHODS).encode()))
    return headers


@final
class _Body:
    """The body of a request, counted while it is read."""

    def __init__(self, receive: Receive, answer: _Answer, largest: int) -> None:
        self._receive = receive
        self._answer = answer
        self._left = largest
        self._end_s = asyncio.get_running_loop().time() + BODY_S
        self._whole = False

    async def receive(self) -> Message:
        """Return the next part; refuse the request where there is too much of it, or too late."""
        if self._whole:
            return await self._receive()
        if self._answer.wrong is not None:
            raise _BodyRefusedError
        try:
            async with asyncio.timeout_at(self._end_s):
                message = await self._receive()
        except TimeoutError:
            self._refuse(_TOO_SLOW)
        if message["type"] == "http.request":
            self._left -= len(message.get("body", b""))
            if self._left < 0:
                self._refuse(_TOO_LARGE)
            self._whole = not message.get("more_body", False)
        return message

    def _refuse(self, wrong: _Wrong) -> NoReturn:
        self._answer.wrong = wrong
        raise _BodyRefusedError


async def _deny(receive: Receive, send: Send) -> None:
    """Refuse a web socket before it is one; the web server answers 403, and logs no error."""
    await receive()
    await send({"type": "websocket.close", "code": _POLICY_VIOLATION})
