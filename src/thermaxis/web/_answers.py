"""What is asked as JSON, and refused in the language of who asks."""

import json
from typing import Any, cast

from starlette.exceptions import HTTPException
from starlette.requests import HTTPConnection, Request
from starlette.responses import Response

from thermaxis.codes import Value
from thermaxis.messages import LANGUAGES
from thermaxis.web._language import LANGUAGE_COOKIE, LanguageOfParts, language_of
from thermaxis.web._plain_page import answer_json, mistake_of, refusal

_BAD_REQUEST, _NOT_FOUND, _MISTAKE = 400, 404, 500
_YEAR_S = 31_536_000


class RefusedError(Exception):
    """A request is refused in words."""

    def __init__(self, status: int, key: str, **values: Value) -> None:
        super().__init__(key)
        self.status = status
        self.key = key
        self.values = values


def spoken(connection: HTTPConnection) -> str:
    """Return the language of who asks, known without a look at who it is."""
    return language_of(
        connection.cookies.get(LANGUAGE_COOKIE),
        connection.headers.get("accept-language"),
        cast("LanguageOfParts", connection.app.state.parts).language,
    )


async def object_of(request: Request) -> dict[str, object]:
    """Return the JSON object of a request, an empty one where it has none."""
    try:
        found = json.loads(await request.body(), object_pairs_hook=_single)
    except (RecursionError, ValueError):  # no JSON, no text, or an integer of too many digits
        return {}
    return cast("dict[str, object]", found) if isinstance(found, dict) else {}


def _single(pairs: list[tuple[str, object]]) -> dict[str, object]:
    found = dict(pairs)
    if len(found) != len(pairs):
        raise ValueError("a key stands twice")
    return found


def refuse(connection: HTTPConnection, status: int, key: str, **values: Value) -> Response:
    """Return a refusal in the language of who asks."""
    return refusal(connection, spoken(connection), status, key, **values)


async def answer_mistake(request: Request, error: Exception) -> Response:
    """Answer where the program has made a mistake: in words, with the log's reference, no trace."""
    return refuse(request, _MISTAKE, "common-mistake", reference=mistake_of(error).reference)


async def answer_no_route(request: Request, error: Exception) -> Response:
    """Answer what no route takes, in words."""
    status = error.status_code if isinstance(error, HTTPException) else _NOT_FOUND
    key = "common-no_page" if status == _NOT_FOUND else "common-refused_method"
    return refuse(request, status, key)


async def choose_language(request: Request) -> Response:
    """Keep the language that somebody has chosen."""
    language = (await object_of(request)).get("language")
    if language not in LANGUAGES:
        return refuse(request, _BAD_REQUEST, "login-no_language")
    answer = answer_json({"language": language})
    secure = request.url.scheme == "https"
    marks: dict[str, Any] = {"secure": secure, "httponly": True, "samesite": "strict"}
    answer.set_cookie(LANGUAGE_COOKIE, str(language), max_age=_YEAR_S, **marks)
    return answer
