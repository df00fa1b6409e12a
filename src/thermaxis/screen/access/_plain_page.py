"""Small pages without script, picture or template: for what is refused before any page is made."""

import base64
import hashlib
import re
import traceback
from html import escape
from pathlib import Path
from typing import Final, cast

_HTML = re.compile(r"(?:^|,)\s*text/html\s*(?:;|,|$)", re.IGNORECASE)
_STYLE = (
    ":root{color-scheme:light dark;font:1.1rem/1.5 system-ui,sans-serif}"
    "body{margin:3rem auto;max-width:36rem;padding:0 1rem}"
    "a{display:inline-block;padding:.8rem 1.2rem;border:2px solid;color:inherit}"
)
STYLE_SOURCE: Final = (
    f"'sha256-{base64.b64encode(hashlib.sha256(_STYLE.encode()).digest()).decode()}'"
)
"""By which a policy allows the style of a plain page, and no other that stands in a page."""


def wants_page(accept: str | None) -> bool:
    """Return whether somebody looks at the answer, and not a script."""
    return accept is not None and _HTML.search(accept) is not None


def plain_page(language: str, title: str, text: str, *, back: str = "") -> bytes:
    """Return a page that says one thing."""
    link = f'<p><a href="/">{escape(back)}</a></p>' if back else ""
    return (
        f'<!doctype html><html lang="{escape(language)}"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f"<title>{escape(title)}</title><style>{_STYLE}</style></head>"
        f"<body><h1>{escape(title)}</h1><p>{escape(text)}</p>{link}</body></html>"
    ).encode()


def reference_of(error: BaseException) -> str:
    """Return a short name of a mistake in the program, the same whenever it happens again."""
    return hashlib.sha256("|".join(_ways(error)).encode()).hexdigest()[:8]


def place_of_mistake(error: BaseException) -> str:
    """Return file and line of a mistake, without the folder."""
    frames = traceback.extract_tb(_first(error).__traceback__)
    return f"{Path(frames[-1].filename).name}, line {frames[-1].lineno}" if frames else ""


def kind_of_mistake(error: BaseException) -> str:
    """Return the kind of a mistake; of several at once, that of the first."""
    return type(_first(error)).__name__


def _ways(error: BaseException) -> list[str]:
    """Return kind and innermost lines of a mistake: the outer ones depend on who has caught it."""
    first = _first(error)
    frames = traceback.extract_tb(first.__traceback__)[-2:]
    lines = [f"{Path(frame.filename).name}:{frame.lineno}" for frame in frames]
    return [type(first).__name__, *lines]


def _first(error: BaseException) -> BaseException:
    first = error
    while isinstance(first, BaseExceptionGroup):
        first = cast("BaseExceptionGroup[BaseException]", first).exceptions[0]
    return first
