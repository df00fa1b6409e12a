"""Who looks at a page, in which language, and what they may do."""

import hmac
from collections.abc import Awaitable, Callable
from functools import wraps
from typing import NamedTuple
from urllib.parse import quote

from starlette.requests import HTTPConnection, Request
from starlette.responses import RedirectResponse, Response

from thermaxis.codes import Message
from thermaxis.runtime import Role
from thermaxis.screen.access._parts import AccessParts, access_of
from thermaxis.screen.access._user_sessions import UserSession
from thermaxis.web import RefusedError, refuse, spoken

TOKEN_HEADER = "x-thermaxis-token"  # noqa: S105 - the header's name
"""Header that proves that a request comes from one of our pages."""
STARTED_ANEW = "login-started_anew"
"""Key of the words for a cookie that this run of the screen has never given, or long forgotten."""
_SAFE = frozenset({"GET", "HEAD"})
_UNAUTHORIZED, _FORBIDDEN = 401, 403

Endpoint = Callable[[Request], Awaitable[Response]]
"""What answers a request."""


class Visitor(NamedTuple):
    """Somebody who looks at a page."""

    name: str
    """Name of the log-in; empty without one."""
    role: Role
    """What they may do; the loop's status server decides again on every request."""
    language: str
    """``en``, ``de`` or ``cs``."""
    token: str
    """What a request of theirs must carry; empty without a log-in."""
    person: UserSession | None
    """The log-in, if there is one."""


def cookie_name(parts: AccessParts, port: int | None) -> str:
    """Return the name of the log-in's cookie.

    Cookies know no ports: two screens of one computer would log each other out.
    """
    prefix = "__Host-" if parts.secure else ""
    return f"{prefix}thermaxis_{port or 0}"


def cookie_of(connection: HTTPConnection) -> str | None:
    """Return the cookie of a log-in."""
    return connection.cookies.get(cookie_name(access_of(connection), connection.url.port))


def visitor_of(connection: HTTPConnection, *, touch: bool = False) -> Visitor:
    """Return who looks."""
    parts = access_of(connection)
    person = parts.persons.of(cookie_of(connection), touch=touch)
    language = spoken(connection)
    if person is not None:
        return Visitor(person.name, person.role, language, person.token, person)
    role = Role.VIEWER if parts.settings.view_without_login else Role.NONE
    return Visitor("", role, language, "", None)


def why_out(connection: HTTPConnection) -> str:
    """Return why somebody has to log in anew."""
    persons, cookie = access_of(connection).persons, cookie_of(connection)
    if cookie is None or persons.of(cookie) is not None:
        return ""
    return persons.why_ended(cookie) or STARTED_ANEW


def needs(role: Role, *, named: bool = False, page: bool = False) -> Callable[[Endpoint], Endpoint]:
    """Let only those through who may; others are sent to the log-in, or refused in words.

    What the endpoint itself refuses by a `RefusedError` is answered here.
    """

    def decorate(endpoint: Endpoint) -> Endpoint:
        @wraps(endpoint)
        async def guarded(request: Request) -> Response:
            unsafe = request.method not in _SAFE
            visitor = visitor_of(request, touch=page or unsafe)
            if visitor.person is None and (named or not visitor.role.at_least(role)):
                if page:
                    here = request.url.path + (f"?{request.url.query}" if request.url.query else "")
                    return RedirectResponse(f"/login?next={quote(here)}", 303)
                return refuse(request, _UNAUTHORIZED, why_out(request) or "login-needed")
            refusal = _refusal(request, visitor, role)
            if refusal is not None:
                return refusal
            try:
                return await endpoint(request)
            except RefusedError as error:
                return refuse(request, error.status, error.key, **error.values)

        return guarded

    return decorate


def _refusal(request: Request, visitor: Visitor, role: Role) -> Response | None:
    """Return why somebody may not, by the role or by the token; None for who may."""
    if not visitor.role.at_least(role):
        needed = Message(f"common-role_{role.value}")
        return refuse(request, _FORBIDDEN, "login-role_too_low", needed=needed)
    if request.method not in _SAFE and visitor.person is not None:
        token = request.headers.get(TOKEN_HEADER, "")
        if not hmac.compare_digest(token.encode(), visitor.token.encode()):
            return refuse(request, _FORBIDDEN, "login-token")
    return None
