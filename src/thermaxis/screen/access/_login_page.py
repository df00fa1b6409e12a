"""The log-in and its end, and the choice of a language."""

from http import HTTPStatus
from typing import Any

from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import BaseRoute, Route

from thermaxis.runtime import Role
from thermaxis.screen.access._access import cookie_name, cookie_of, needs, visitor_of, why_out
from thermaxis.screen.access._parts import AccessParts, access_of
from thermaxis.screen.access._render import render
from thermaxis.screen.access._user_sessions import (
    BUSY,
    FULL,
    NO_PANEL,
    NO_ROLE,
    REFUSED,
    TOO_MANY,
    TOO_MANY_FROM_HERE,
    Refusal,
)
from thermaxis.web import answer_json, choose_language, object_of, refuse

_STATUS = {
    REFUSED: HTTPStatus.UNAUTHORIZED,
    **dict.fromkeys((NO_ROLE, NO_PANEL), HTTPStatus.FORBIDDEN),
    **dict.fromkeys((TOO_MANY, TOO_MANY_FROM_HERE), HTTPStatus.TOO_MANY_REQUESTS),
    **dict.fromkeys((FULL, BUSY), HTTPStatus.SERVICE_UNAVAILABLE),
}

_OF_PINS = {
    REFUSED: "login-pin_refused",
    **dict.fromkeys((TOO_MANY, TOO_MANY_FROM_HERE), "login-pin_too_many"),
}


def login_routes(parts: AccessParts) -> list[BaseRoute]:
    """Return the routes of the log-in."""
    del parts
    return [
        Route("/login", _page, methods=["GET"]),
        Route("/login", _log_in, methods=["POST"]),
        Route("/logout", _log_out, methods=["POST"]),
        Route("/language", _choose_language, methods=["POST"]),
    ]


async def _page(request: Request) -> Response:
    panel = access_of(request).settings.takes_pin(_address(request))
    return render(request, "login.html", page="login", panel=panel, why=why_out(request))


async def _log_in(request: Request) -> Response:
    parts = access_of(request)
    said = await object_of(request)
    pin = "pin" in said
    name, password = said.get("name"), said.get("pin" if pin else "password")
    if not (isinstance(name, str) and isinstance(password, str) and name and password):
        return refuse(request, HTTPStatus.BAD_REQUEST, "login-incomplete")
    await parts.persons.log_out(cookie_of(request))
    found = await parts.persons.log_in(name, password, _address(request), pin=pin)
    if isinstance(found, Refusal):
        return _refused(request, found, pin=pin)
    secret, person = found
    answer = answer_json({"name": person.name, "role": person.role.value})
    answer.set_cookie(cookie_name(parts, request.url.port), secret, **_marks(parts))
    return answer


def _address(request: Request) -> str:
    return request.client.host if request.client is not None else ""


def _refused(request: Request, found: Refusal, *, pin: bool) -> Response:
    status = _STATUS.get(found.key, HTTPStatus.BAD_GATEWAY)
    key = _OF_PINS.get(found.key, found.key) if pin else found.key
    answer = refuse(request, status, key, seconds=found.left_s)
    if found.left_s:
        answer.headers["Retry-After"] = str(found.left_s)
    return answer


@needs(Role.NONE)
async def _log_out(request: Request) -> Response:
    parts = access_of(request)
    await parts.persons.log_out(cookie_of(request))
    answer = answer_json({})
    answer.delete_cookie(cookie_name(parts, request.url.port), **_marks(parts))
    return answer


async def _choose_language(request: Request) -> Response:
    visitor_of(request, touch=True)
    return await choose_language(request)


def _marks(parts: AccessParts) -> dict[str, Any]:
    """Return what keeps a cookie from scripts and from other sites."""
    return {"path": "/", "secure": parts.secure, "httponly": True, "samesite": "strict"}
