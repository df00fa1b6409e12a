"""The log-in and its end, and the choice of a language."""

import json
from http import HTTPStatus

from starlette.requests import Request
from starlette.responses import JSONResponse, Response
from starlette.routing import BaseRoute, Route

from thermaxis.runtime._users import LONGEST_NAME, LONGEST_PASSWORD, Role
from thermaxis.screen._access import (
    LANGUAGE_COOKIE,
    cookie_name,
    needs,
    parts_of,
    refuse,
    visitor_of,
)
from thermaxis.screen._parts import ScreenParts
from thermaxis.screen._persons import BUSY, FULL, NO_ROLE, REFUSED, TOO_MANY, Refusal
from thermaxis.screen._words import LANGUAGES

_YEAR_S = 31_536_000
_STATUS = {
    REFUSED: HTTPStatus.UNAUTHORIZED,
    NO_ROLE: HTTPStatus.FORBIDDEN,
    TOO_MANY: HTTPStatus.TOO_MANY_REQUESTS,
    FULL: HTTPStatus.SERVICE_UNAVAILABLE,
    BUSY: HTTPStatus.SERVICE_UNAVAILABLE,
}


def routes(parts: ScreenParts) -> list[BaseRoute]:
    """Return the routes of the log-in.

    Parameters
    ----------
    parts : ScreenParts
        What the pages share.

    Returns
    -------
    list of BaseRoute
        ``/login``, ``/logout`` and ``/language``.
    """

    async def page(request: Request) -> Response:
        return parts.render(request, "login.html", page="login")

    return [
        Route("/login", page, methods=["GET"]),
        Route("/login", _log_in, methods=["POST"]),
        Route("/logout", _log_out, methods=["POST"]),
        Route("/language", _choose_language, methods=["POST"]),
    ]


async def _log_in(request: Request) -> Response:
    parts = parts_of(request)
    said = await _object_of(request)
    name, password = said.get("name"), said.get("password")
    if not (isinstance(name, str) and isinstance(password, str) and name and password):
        return refuse(request, HTTPStatus.BAD_REQUEST, "login.incomplete")
    if len(name) > LONGEST_NAME or len(password.encode()) > LONGEST_PASSWORD:
        return refuse(request, HTTPStatus.UNAUTHORIZED, REFUSED)
    await parts.persons.log_out(_cookie(request))
    address = request.client.host if request.client is not None else ""
    found = await parts.persons.log_in(name, password, address)
    if isinstance(found, Refusal):
        status = _STATUS.get(found.key, HTTPStatus.BAD_GATEWAY)
        return refuse(request, status, found.key)
    secret, person = found
    answer = JSONResponse({"name": person.name, "role": person.role.value})
    answer.set_cookie(
        cookie_name(parts, request.url.port),
        secret,
        path="/",
        secure=parts.secure,
        httponly=True,
        samesite="strict",
    )
    return answer


@needs(Role.NONE)
async def _log_out(request: Request) -> Response:
    parts = parts_of(request)
    await parts.persons.log_out(_cookie(request))
    answer = JSONResponse({})
    answer.delete_cookie(
        cookie_name(parts, request.url.port),
        path="/",
        secure=parts.secure,
        httponly=True,
        samesite="strict",
    )
    return answer


async def _choose_language(request: Request) -> Response:
    language = (await _object_of(request)).get("language")
    if not isinstance(language, str) or language not in LANGUAGES:
        return refuse(request, HTTPStatus.BAD_REQUEST, "login.no_language")
    visitor_of(request, touch=True)
    answer = JSONResponse({"language": language})
    answer.set_cookie(
        LANGUAGE_COOKIE,
        language,
        max_age=_YEAR_S,
        path="/",
        secure=parts_of(request).secure,
        httponly=True,
        samesite="strict",
    )
    return answer


def _cookie(request: Request) -> str | None:
    return request.cookies.get(cookie_name(parts_of(request), request.url.port))


async def _object_of(request: Request) -> dict[str, object]:
    """Return the JSON object of a request, an empty one where it has none."""
    try:
        found: object = json.loads(await request.body())
    except (json.JSONDecodeError, UnicodeDecodeError, RecursionError):
        return {}
    return {str(key): value for key, value in found.items()} if isinstance(found, dict) else {}  # pyright: ignore[reportUnknownVariableType, reportUnknownArgumentType] - JSON
