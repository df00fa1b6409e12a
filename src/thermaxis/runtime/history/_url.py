"""What the URL of a database gives away, and who can listen: without the database's library."""

from enum import StrEnum
from typing import Final, final
from urllib.parse import SplitResult, parse_qs, unquote, urlsplit

from thermaxis.codes import Place
from thermaxis.errors import ConfigurationError
from thermaxis.runtime.host import is_loopback

_MODES: Final = {"require": "unproven", "verify-ca": "proven", "verify-full": "proven"}


@final
class Encryption(StrEnum):
    """How a connection to a database is kept from others."""

    LOCAL = "local"
    """It does not leave this computer."""
    NONE = "none"
    """It may go to another computer unencrypted."""
    UNPROVEN = "unproven"
    """It is encrypted, but whoever answers is believed to be the database."""
    PROVEN = "proven"
    """It is encrypted, and the database proves by its certificate who it is."""


def encryption_of(url: str) -> Encryption:
    """Return how a connection to PostgreSQL is kept from others: the weakest of its modes.

    Hosts count wherever they stand: as an authority, also a list, and as the keys ``host`` and
    ``hostaddr``.

    References
    ----------
    PostgreSQL, libpq, 34.19.4 "Protection Provided in Different Modes" of ``sslmode`` [src].
    """
    parts = _split(url)
    query = parse_qs(parts.query, keep_blank_values=True)
    names = [_without_port(name) for name in parts.netloc.rpartition("@")[2].split(",")]
    for key in ("host", "hostaddr"):
        names += [_without_port(name) for value in query.get(key, ()) for name in value.split(",")]
    if all(not name or is_loopback(name) or name.startswith("/") for name in names):
        return Encryption.LOCAL
    modes = {_MODES.get(mode, "none") for mode in query.get("sslmode", ("",))}
    return next(one for one in Encryption if one.value in modes)


def _without_port(name: str) -> str:
    if name.startswith("["):
        return name[1:].partition("]")[0]
    plain = unquote(name)
    return plain if plain.count(":") > 1 else plain.partition(":")[0]


def check_encryption(url: str, *, key: str) -> None:
    """Check that nobody between this computer and a database of PostgreSQL can read along.

    The mode has to be stated, as PostgreSQL's own default falls back to none.
    """
    if encryption_of(url) is Encryption.NONE:
        raise ConfigurationError("database_unencrypted", place=Place(key=key))


def refuse_password(url: str, *, key: str) -> None:
    """Check that a URL has no password: addresses are shown, stored and listed by the system."""
    parts = _split(url)
    try:
        password = parts.password
    except ValueError:
        raise _no_url(key) from None
    if password is not None or "password" in parse_qs(parts.query, keep_blank_values=True):
        raise ConfigurationError("password_in_address", place=Place(key=key))


def _split(url: str) -> SplitResult:
    try:
        return urlsplit(url)
    except ValueError:
        raise _no_url("url") from None


def _no_url(key: str) -> ConfigurationError:
    return ConfigurationError("no_database_url", place=Place(key=key))
