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
_NAME_REMEDY = "Check the name; relative names count from the folder of the configuration file"


def refuse_readable(path: Path, *, where: str, remedy: str = "") -> None:
    """Check that a file with a secret is there and readable by its owner only."""
    try:
        mode = path.stat().st_mode
    except (OSError, ValueError) as error:
        raise unreadable(path, error, where=where) from None
    _check(path, mode, where, remedy)


def read_private(path: Path, *, limit_bytes: int, where: str, remedy: str = "") -> bytes:
    """Return the content of a file that nobody but its owner may read."""
    content = _begin_of(path, limit_bytes, where, remedy)
    if len(content) > limit_bytes:
        raise ConfigurationError(
            f"{path} is larger than {limit_bytes} bytes", where=where, remedy="Name the file itself"
        )
    return content


def read_secret(path: Path, *, where: str) -> Secret:
    """Return the first line of a file that nobody but its owner may read."""
    content = _begin_of(path, SECRET_LIMIT_BYTES, where, "")
    try:
        text = content.decode().partition("\n")[0].removesuffix("\r")
    except UnicodeDecodeError:
        text = ""
    if not text or len(content) > SECRET_LIMIT_BYTES or "\x00" in text:
        raise ConfigurationError(
            f"{path} does not hold a secret",
            where=where,
            remedy="Write the secret as its first line, as UTF-8",
        )
    return Secret(text)


def unreadable(
    path: Path, error: OSError | ValueError, *, where: str, remedy: str = _NAME_REMEDY
) -> ConfigurationError:
    """Return the error for a file that cannot be read."""
    reason = getattr(error, "strerror", None) or type(error).__name__
    return ConfigurationError(f"{path} cannot be read ({reason})", where=where, remedy=remedy)


def _begin_of(path: Path, limit_bytes: int, where: str, remedy: str) -> bytes:
    """Return the content of a private file, cut one byte after the limit."""
    refuse_readable(path, where=where, remedy=remedy)  # before a pipe is waited for
    try:
        with path.open("rb") as stream:
            mode = os.fstat(stream.fileno()).st_mode
            content = stream.read(limit_bytes + 1)
    except OSError as error:
        raise unreadable(path, error, where=where) from None
    _check(path, mode, where, remedy)
    return content


def _check(path: Path, mode: int, where: str, remedy: str) -> None:
    if not stat.S_ISREG(mode):
        raise ConfigurationError(f"{path} is no file", where=where, remedy="Name the file itself")
    if os.name == "posix" and mode & (stat.S_IRWXG | stat.S_IRWXO):
        raise ConfigurationError(
            f"{path} can be read or changed by others than its owner",
            where=where,
            remedy=remedy
            or f"Run chmod 600 {path.name} in its folder, and consider the secret as known",
        )


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
                _keep_owner(path, stream.fileno())
                os.fchmod(stream.fileno(), mode)
        beside.replace(path)
    finally:
        with contextlib.suppress(OSError):
            beside.unlink(missing_ok=True)


def _keep_owner(old: Path, new: int) -> None:
    with contextlib.suppress(PermissionError, FileNotFoundError):
        found = old.stat()
        os.fchown(new, found.st_uid, found.st_gid)
