"""What is asked as JSON, and refused in the language of who asks."""

import json
from typing import cast

from starlette.requests import HTTPConnection, Request
from starlette.responses import Response

from thermaxis.codes import Value
from thermaxis.web._language import LANGUAGE_COOKIE, LanguageOfParts, language_of
from thermaxis.web._plain_page import mistake_of, refusal

_MISTAKE = 500


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


async def json_of(request: Request) -> object:
    """Return the JSON value of a request."""
    try:
        return json.loads(await request.body(), object_pairs_hook=_single)
    except RecursionError:
        return None
    except ValueError:  # no JSON, no text, or an integer of more digits than are read
        return None


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
