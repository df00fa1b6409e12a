"""Locks: what one program does, a second one must not do at the same time."""

import errno
import hashlib
import os
import socket
import struct
import sys
import tempfile
from collections.abc import Generator, Iterable
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import replace
from pathlib import Path
from typing import Final

from filelock import BaseFileLock, FileLock, Timeout

from thermaxis.codes import printable
from thermaxis.errors import ConfigurationError

_NO_LOCKS: Final = {errno.ENOLCK, errno.ENOSYS, errno.EOPNOTSUPP}
_UNKNOWN: Final = "unknown"
_LONGEST_PID: Final = 10


def file_lock(path: Path, taken: ConfigurationError, *, required: bool) -> BaseFileLock:
    """Hold a file for this program until it is released; gone with the program, however it ends.

    Not protected: another computer, and a network drive that does not pass locks on. Where a disk
    has no locks, only what is `required` is refused.
    """
    lock = FileLock(
        path, blocking=False, thread_local=False, fallback_to_soft=False, on_acquired=_sign
    )
    try:
        lock.acquire()
    except Timeout:
        raise _held_by(taken, _signed(path)) from None
    except OSError as error:
        if error.errno not in _NO_LOCKS:
            raise
        if required:
            cause = error.strerror or type(error).__name__
            raise ConfigurationError("disk_without_locks", cause=cause, file=path) from None
    return lock


def _sign(descriptor: int) -> None:
    """Write who holds the file, if there is place: a full disk is no reason to hold nothing."""
    with suppress(OSError):
        os.ftruncate(descriptor, 0)
        os.write(descriptor, str(os.getpid()).encode())


def _signed(path: Path) -> str:
    """Return the process that holds a file."""
    try:
        with path.open("rb") as stream:
            found = stream.read(_LONGEST_PID)
    except OSError:
        return _UNKNOWN
    return found.decode() if found.isdigit() else _UNKNOWN


def _held_by(taken: ConfigurationError, pid: str) -> ConfigurationError:
    """Return the error with the process, where its sentence has a place for it."""
    known = {"pid": pid} if "pid" in taken.values else {}
    return ConfigurationError.of(replace(taken.message, values=taken.values | known))


@contextmanager
def held_lock(path: Path, taken: ConfigurationError, *, required: bool) -> Generator[None]:
    """Hold a file for a while; its folder is made where it is missing."""
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        lock = file_lock(path, taken, required=required)
    except OSError as error:
        cause = error.strerror or type(error).__name__
        raise ConfigurationError("folder_unwritable", cause=cause, file=path.parent) from None
    try:
        yield
    finally:
        lock.release()


@contextmanager
def sole_runner(state_file: Path, machine: str, offsets: Iterable[str] = ()) -> Generator[None]:
    """Hold a machine and its offsets: two programs that write one offset fight each other.

    Not protected: a second program on another computer or in another container, or one that
    knows the server or the node by another name. The read-back notices what it writes.
    """
    path = state_file.with_name(f"{state_file.name}.lock")
    taken = ConfigurationError("machine_in_use", machine=machine, pid="", file=path)
    with ExitStack() as held:
        held.enter_context(held_lock(path, taken, required=True))
        for offset in offsets:
            held.enter_context(_held_name(offset))
        yield


@contextmanager
def _held_name(offset: str) -> Generator[None]:
    """Hold the name of an offset on this computer, in whatever folder its configuration lies.

    On Linux it is an abstract socket: services that see neither one another's temporary files nor
    a common folder that they may write to share these names, and the kernel frees them.
    """
    name = f"thermaxis-{hashlib.sha256(offset.encode()).hexdigest()}"
    taken = ConfigurationError("offset_in_use", offset=printable(offset), pid="", key="sink")
    if sys.platform != "linux":
        with held_lock(Path(tempfile.gettempdir()) / f"{name}.lock", taken, required=True):
            yield
        return
    with socket.socket(socket.AF_UNIX) as held:
        try:
            held.bind(f"\0{name}")
        except OSError as error:
            if error.errno != errno.EADDRINUSE:
                raise
            raise _held_by(taken, _listener(f"\0{name}")) from None
        held.listen(socket.SOMAXCONN)  # so that the next one is told who holds it
        yield


def _listener(address: str) -> str:
    """Return the process that listens at a socket."""
    with socket.socket(socket.AF_UNIX) as asking:
        asking.settimeout(0.0)
        try:
            asking.connect(address)
        except OSError:
            return _UNKNOWN
        found = asking.getsockopt(socket.SOL_SOCKET, socket.SO_PEERCRED, struct.calcsize("3i"))
    pid, _, _ = struct.unpack("3i", found)
    return str(pid)
