"""Tokens: what a screen logs somebody in with again after a loss, in place of the password."""

import hmac
import re
import secrets
from contextlib import suppress
from dataclasses import dataclass
from datetime import datetime, timedelta
from hashlib import sha256
from pathlib import Path
from typing import Annotated, Final, final

from pydantic import AwareDatetime, Field, TypeAdapter

from thermaxis.errors import ConfigurationError
from thermaxis.runtime.host import read_private, whole_file

TOKEN_S: Final = 28_800.0
"""A token ends after so long. Origin: a shift. [s]"""
TOKEN_BYTES: Final = 32
"""Random bytes of a token. Origin: as many as its hash has; nobody guesses them, so that they need
no slow hash as passwords do. [byte]"""
MOST_TOKENS: Final = 100
"""Tokens that are known at once; with the next one the oldest ends. [1]"""
MOST_OF_HOLDER: Final = 8
"""... of one person: nobody ends the tokens of others. [1]"""
_FORM = re.compile(f"[A-Za-z0-9_-]{{{len(secrets.token_urlsafe(TOKEN_BYTES))}}}")
_LARGEST_FILE_BYTES = 100_000
_Text = Annotated[str, Field(max_length=64)]


@final
@dataclass(frozen=True, slots=True)
class IssuedToken:
    """What is kept of a token."""

    sha256: _Text
    holder: _Text
    """Hash of name, role and password hash of whom it was issued to."""
    until: AwareDatetime


_FILE: TypeAdapter[list[IssuedToken]] = TypeAdapter(list[IssuedToken])


@final
class IssuedTokens:
    """The tokens that a loop has issued, kept as hashes in a file that only its owner reads.

    A file that is damaged, or that others may read, holds no token: people log in again. One that
    cannot be written is removed, and tokens end with the program.

    Not protected: whoever may write the file, or reads the memory of the program that holds a
    token, is that person until the token ends; nor, after a restart, is one that was revoked while
    the file could be neither written nor removed.
    """

    def __init__(self, path: Path | None) -> None:
        self._path = path
        self._issued: list[IssuedToken] = []

    def read(self) -> None:
        """Read the file."""
        self._issued = []
        if self._path is not None:
            with suppress(ConfigurationError, ValueError):
                content = read_private(self._path, limit_bytes=_LARGEST_FILE_BYTES)
                self._issued = _FILE.validate_json(content)[-MOST_TOKENS:]

    def issue(self, holder: str, now: datetime) -> str:
        """Return a new token for somebody."""
        token = secrets.token_urlsafe(TOKEN_BYTES)
        until = now + timedelta(seconds=TOKEN_S)
        own = [one for one in self._issued if one.holder == holder][1 - MOST_OF_HOLDER :]
        valid = [
            one
            for one in self._issued
            if _stands(one, now) and (one.holder != holder or one in own)
        ]
        self._keep([*valid, IssuedToken(_hash(token), holder, until)][-MOST_TOKENS:])
        return token

    def find(self, token: str, now: datetime) -> IssuedToken | None:
        """Return what is kept of a token that has not ended; None if there is none."""
        known = _hash(token)
        found = [one for one in self._issued if hmac.compare_digest(one.sha256, known)]
        return found[0] if found and _stands(found[0], now) else None

    def stands(self, one: IssuedToken, now: datetime) -> bool:
        """Return whether a token has not ended, nor anybody ended it."""
        return one in self._issued and _stands(one, now)

    def revoke(self, token: str, holder: str) -> None:
        """End a token of somebody."""
        one = _hash(token), holder
        kept = [kept for kept in self._issued if (kept.sha256, kept.holder) != one]
        if len(kept) < len(self._issued):
            self._keep(kept)

    def _keep(self, issued: list[IssuedToken]) -> None:
        self._issued = issued
        if self._path is not None:
            try:
                with whole_file(self._path, mode=0o600) as stream:
                    stream.write(_FILE.dump_json(issued))
            except OSError:  # what stands there may hold one that was revoked
                with suppress(OSError):
                    self._path.unlink()


def may_be_token(text: str) -> bool:
    """Return whether a text has the length and the letters of a token."""
    return _FORM.fullmatch(text) is not None


def _stands(one: IssuedToken, now: datetime) -> bool:
    """Whether a token has not ended, nor a clock that was set back makes it last longer."""
    return now < one.until <= now + timedelta(seconds=TOKEN_S)


def _hash(text: str) -> str:
    return sha256(text.encode("utf-8", "replace")).hexdigest()
