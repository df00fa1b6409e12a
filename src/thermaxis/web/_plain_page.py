"""Answers that refuse: a small page without a template for a person, JSON for a script."""

import hashlib
import json
import traceback
from html import escape
from pathlib import Path
from typing import Any, cast, final

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
    own = status != _MISDIRECTED
    back = sentence("common-to_the_machine", language=language) if own else ""
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


def reference_of(error: BaseException) -> str:
    """Return a short name of a mistake in the program, the same whenever it happens again."""
    named = f"{kind_of_mistake(error)} {place_of_mistake(error)}"
    return hashlib.sha256(named.encode()).hexdigest()[:8]


def place_of_mistake(error: BaseException) -> str:
    """Return file and line of a mistake, without the folder."""
    frames = traceback.extract_tb(_first(error).__traceback__)
    return f"{Path(frames[-1].filename).name}, line {frames[-1].lineno}" if frames else ""


def kind_of_mistake(error: BaseException) -> str:
    """Return the kind of a mistake; of several at once, that of the first."""
    return type(_first(error)).__name__


def _first(error: BaseException) -> BaseException:
    first = error
    while isinstance(first, BaseExceptionGroup):
        first = cast("BaseExceptionGroup[BaseException]", first).exceptions[0]
    return first
