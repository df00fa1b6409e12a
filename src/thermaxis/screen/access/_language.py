"""The language of a visitor, and the sentences of its pages."""

from functools import cache
from typing import Final

from thermaxis.messages import LANGUAGES, keys, template

LONGEST_HEADER: Final = 400
"""Longest part of a header that is looked at. [1]"""
_OF_PAGES: Final = (
    "common",
    "ask",
    "chart",
    "event_kind",
    "history",
    "login",
    "model",
    "operator",
    "positioning",
    "probe",
    "sensors",
)
"""Kinds of sentences that scripts fill with what they know themselves, such as local times."""


@cache
def sentences_of_pages(language: str) -> dict[str, str]:
    """Return by key what a page's scripts show, with ``{name}`` for what they fill in."""
    return {
        key: template(key, language=language)
        for key in keys(LANGUAGES[0])
        if key.partition("-")[0] in _OF_PAGES and "." not in key
    }


def language_of(cookie: str | None, accept_language: str | None, default: str) -> str:
    """Return the language of a visitor.

    References
    ----------
    RFC 9110, 12.5.4 (Accept-Language) and 12.4.2 (weights).
    """
    if cookie in LANGUAGES:
        return cookie
    liked: dict[str, float] = {}
    for entry in (accept_language or "")[:LONGEST_HEADER].split(","):
        tag, *parameters = (part.strip().lower() for part in entry.split(";"))
        language = tag.split("-")[0]
        if language in LANGUAGES:
            liked[language] = max(liked.get(language, 0.0), _weight(parameters))
    best = max(liked, key=lambda one: liked[one], default=None)
    return best if best is not None and liked[best] > 0.0 else default


def _weight(parameters: list[str]) -> float:
    """Return the weight of an entry; 0 where it is none."""
    for parameter in parameters:
        name, _, text = parameter.partition("=")
        if name.strip() == "q":
            try:
                weight = float(text)
            except ValueError:
                return 0.0
            return weight if 0.0 <= weight <= 1.0 else 0.0
    return 1.0
