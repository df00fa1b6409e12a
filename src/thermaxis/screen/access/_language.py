"""The language of a visitor."""

from typing import Final

from thermaxis.messages import LANGUAGES

LONGEST_HEADER: Final = 400
"""Longest part of a header that is looked at. [1]"""


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
