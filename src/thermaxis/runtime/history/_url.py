"""Addresses of databases, and who can listen on the way: without the database's library."""

from enum import StrEnum
from pathlib import Path
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


def check_url(url: str, *, key: str) -> Path | None:
    """Return the file of SQLite, None for PostgreSQL; refuse what no history can be kept in.

    Nobody between this computer and PostgreSQL may read along: the mode has to be stated, as
    PostgreSQL's own default falls back to none.
    """
    kind, place = _split(url).scheme, Place(key=key)
    if not kind:
        raise ConfigurationError("no_database_url", place=place)
    path = sqlite_path(url)
    if path is not None:
        if path.name in {"", ":memory:"} or "?" in path.name:
            raise ConfigurationError("no_file_in_url", place=place)
    elif kind not in {"postgresql", "postgresql+psycopg"}:
        raise ConfigurationError("unknown_database", kind=kind, place=place)
    elif encryption_of(url) is Encryption.NONE:
        raise ConfigurationError("database_unencrypted", place=place)
    return path


def sqlite_path(url: str) -> Path | None:
    """Return the file of a database, None where it is no SQLite."""
    return Path(url.partition(":///")[2]) if _split(url).scheme == "sqlite" else None


def history_folder(url: str, folder: Path | None) -> Path:
    """Return where finished parts are kept: beside SQLite's file unless it is stated."""
    path = sqlite_path(url)
    if folder is not None:
        return folder
    if path is None:
        raise ConfigurationError("history_folder_missing", key="historian.folder")
    return path.with_suffix("") if path.suffix else path.with_name(f"{path.name}.parts")


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


def refuse_password(url: str, *, key: str) -> None:
    """Check that a URL has no password: addresses are shown, stored and listed by the system."""
    parts = _split(url)
    try:
        password = parts.password
    except ValueError:
        raise ConfigurationError("no_database_url", key=key) from None
    if password is not None or "password" in parse_qs(parts.query, keep_blank_values=True):
        raise ConfigurationError("password_in_address", key=key)


def _split(url: str) -> SplitResult:
    try:
        return urlsplit(url)
    except ValueError:
        raise ConfigurationError("no_database_url", key="url") from None
