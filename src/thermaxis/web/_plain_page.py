"""Answers that refuse: a small page without a template for a person, JSON for a script."""

import hashlib
import json
import traceback
from html import escape
from pathlib import Path
from typing import Any, NamedTuple, cast, final

from starlette.requests import HTTPConnection
from starlette.responses import HTMLResponse, JSONResponse, Response

from thermaxis.codes import Value
from thermaxis.messages import sentence

_MISDIRECTED = 421


@final
class _Json(JSONResponse):
    """An answer that can be written whatever texts it is made of."""

    def render(self, content: Any) -> bytes:
        """Return the JSON; half a pair of surrogates, which is no text, as a question mark."""
        text = json.dumps(content, ensure_ascii=False, allow_nan=False, separators=(",", ":"))
        return text.encode("utf-8", "replace")


def answer_json(value: object, status: int = 200) -> JSONResponse:
    """Return an answer as JSON."""
    return _Json(value, status)


def wants_page(connection: HTTPConnection) -> bool:
    """Return whether somebody looks at the answer, and not a script."""
    return "text/html" in connection.headers.get("accept", "").lower()


def refusal(
    connection: HTTPConnection, language: str, status: int, key: str, **values: Value
) -> Response:
    """Return why something is not answered, in words."""
    text = sentence(key, values, language=language)
    if not wants_page(connection):
        return answer_json({"error": key, "text": text}, status)
    own = status != _MISDIRECTED and key != "app-no_token"  # there is a page to go back to
    back = sentence("common-to_the_first_page", language=language) if own else ""
    title = sentence("common-not_shown", language=language)
    return HTMLResponse(plain_page(language, title, text, back=back), status)


def plain_page(language: str, title: str, text: str, *, back: str = "") -> bytes:
    """Return a page that says one thing."""
    link = f'<p><a class="button" href="/">{escape(back)}</a></p>' if back else ""
    return (
        f'<!doctype html><html lang="{escape(language)}"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        '<link rel="stylesheet" href="/static/base.css"><script src="/static/theme.js"></script>'
        f"<title>{escape(title)}</title></head>"
        f'<body><main id="content"><section class="login"><h1>{escape(title)}</h1>'
        f"<p>{escape(text)}</p>{link}</section></main></body></html>"
    ).encode()


class Mistake(NamedTuple):
    """A mistake in the program, without a folder; of several at once, the first."""

    reference: str
    """Short name, the same whenever it happens again."""
    kind: str
    place: str


def mistake_of(error: BaseException) -> Mistake:
    """Return what is told of a mistake in the program."""
    while isinstance(error, BaseExceptionGroup):
        error = cast("BaseExceptionGroup[BaseException]", error).exceptions[0]
    *_, frame = traceback.extract_tb(error.__traceback__) or [None]
    place = "" if frame is None else f"{Path(frame.filename).name}, line {frame.lineno}"
    kind = type(error).__name__
    return Mistake(hashlib.sha256(f"{kind} {place}".encode()).hexdigest()[:8], kind, place)
