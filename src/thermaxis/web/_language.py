"""The language of a visitor."""

import re
from typing import Final, Protocol

from thermaxis.messages import LANGUAGES

LANGUAGE_COOKIE: Final = "thermaxis_language"
"""Cookie with the language that somebody has chosen."""
LONGEST_HEADER: Final = 400
"""Longest part of a header that is looked at. [1]"""
_LIKED: Final = re.compile(r"\s*([a-z]+)(?:-[a-z0-9-]+)?\s*(?:;\s*q\s*=\s*([01](?:\.\d*)?)\s*)?")


class LanguageOfParts(Protocol):
    """What the parts of a program tell its pages, as ``app.state.parts``."""

    @property
    def language(self) -> str:
        """Language of who has chosen none and asks for none that there is."""
        ...


def language_of(cookie: str | None, accept_language: str | None, default: str) -> str:
    """Return the language of a visitor.

    References
    ----------
    RFC 9110, 12.5.4 (Accept-Language) and 12.4.2 (weights).
    """
    if cookie in LANGUAGES:
        return cookie
    entries = (accept_language or "")[:LONGEST_HEADER].lower().split(",")
    found = [entry for entry in map(_LIKED.fullmatch, entries) if entry and entry[1] in LANGUAGES]
    liked = [(float(entry[2] or 1.0), entry[1]) for entry in found]
    weight, language = max(liked, key=lambda one: one[0], default=(0.0, default))
    return language if weight else default
