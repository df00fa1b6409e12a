"""Files with secrets, which their owner alone may read, and files that are whole or not there."""

import contextlib
import os
import secrets
import stat
from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO, Final

from thermaxis.errors import ConfigurationError
from thermaxis.runtime._connection import Secret

SECRET_LIMIT_BYTES: Final = 4096
"""Largest file with a secret. [byte]"""


def refuse_readable(path: Path, *, key: str = "") -> None:
    """Check that a file with a secret is there and readable by its owner only."""
    try:
        mode = path.stat().st_mode
    except (OSError, ValueError) as error:
        raise unreadable(path, error, key=key) from None
    if not stat.S_ISREG(mode):
        raise ConfigurationError("not_a_file", file=path, key=key)
    if os.name == "posix" and mode & (stat.S_IRWXG | stat.S_IRWXO):
        raise ConfigurationError("file_open_to_others", file=path, key=key)


def read_limited(path: Path, *, limit_bytes: int, key: str = "") -> bytes:
    """Return the content of a file that is not larger than a limit."""
    try:
        with path.open("rb") as stream:
            content = stream.read(limit_bytes + 1)
    except (OSError, ValueError) as error:
        raise unreadable(path, error, key=key) from None
    if len(content) > limit_bytes:
        raise ConfigurationError("file_too_long", most_bytes=limit_bytes, file=path, key=key)
    return content


def read_private(path: Path, *, limit_bytes: int, key: str = "") -> bytes:
    """Return the content of a file that nobody but its owner may read."""
    refuse_readable(path, key=key)  # before a pipe is waited for
    return read_limited(path, limit_bytes=limit_bytes, key=key)


def read_secret(path: Path, *, key: str = "") -> Secret:
    """Return the first line of a file that nobody but its owner may read."""
    content = read_private(path, limit_bytes=SECRET_LIMIT_BYTES, key=key)
    try:
        text = content.decode().partition("\n")[0].removesuffix("\r")
    except UnicodeDecodeError:
        text = ""
    if not text or "\x00" in text:
        raise ConfigurationError("no_secret_in_file", file=path, key=key)
    return Secret(text)


def unreadable(path: Path, error: OSError | ValueError, *, key: str = "") -> ConfigurationError:
    """Return the error for a file that cannot be read."""
    cause: str = getattr(error, "strerror", None) or type(error).__name__
    return ConfigurationError("file_unreadable", cause=cause, file=path, key=key)


@contextmanager
def whole_file(path: Path, *, mode: int | None = None) -> Generator[BinaryIO]:
    """Write a file that is whole or not there: beside its place, and put there in one step.

    An older file of that name is replaced, and its owner stays the owner, as where an
    administrator writes a service's file.
    """
    beside = path.with_name(f".{path.name}.{secrets.token_hex(4)}.new")
    flags = os.O_WRONLY | os.O_CREAT | os.O_EXCL | getattr(os, "O_BINARY", 0)
    descriptor = os.open(beside, flags, 0o666 if mode is None else mode & 0o600)
    try:
        with os.fdopen(descriptor, "wb") as stream:
            yield stream
            stream.flush()
            os.fsync(stream.fileno())
            if mode is not None and os.name == "posix":
                with contextlib.suppress(PermissionError, FileNotFoundError):
                    found = path.stat()
                    os.fchown(stream.fileno(), found.st_uid, found.st_gid)
                os.fchmod(stream.fileno(), mode)
        beside.replace(path)
    finally:
        with contextlib.suppress(OSError):
            beside.unlink(missing_ok=True)
