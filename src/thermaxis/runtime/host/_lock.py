"""A lock on a file: what one program does, a second one must not do at the same time."""

import os
from collections.abc import Generator
from contextlib import AbstractContextManager, contextmanager
from pathlib import Path
from typing import Self, final

from thermaxis.codes import Place
from thermaxis.errors import ConfigurationError


@final
class FileLock:
    """Holds a file for this program; gone with the program, however it ends.

    Not protected: another computer, and a network drive that does not pass locks on. Where the
    system has no such locks at all, only what `required` says keeps a second program out.
    """

    def __init__(self, path: Path, taken: ConfigurationError, *, required: bool) -> None:
        self._descriptor = os.open(
            path, os.O_RDWR | os.O_CREAT | getattr(os, "O_CLOEXEC", 0), 0o644
        )
        failure = _lock(self._descriptor)
        if failure is None:
            return
        if isinstance(failure, BlockingIOError):
            self.release()
            raise taken
        if required:
            self.release()
            raise _unlocked(failure, Place(str(path)))

    def release(self) -> None:
        """Let others have it."""
        if self._descriptor >= 0:
            os.close(self._descriptor)
            self._descriptor = -1

    def __enter__(self) -> Self:
        """Return the lock, which is held."""
        return self

    def __exit__(self, *_: object) -> None:
        """Let others have it."""
        self.release()


def _lock(descriptor: int) -> OSError | ImportError | None:
    """Lock an open file; return why it is not locked."""
    try:
        import fcntl  # noqa: PLC0415 - not on every system

        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except (OSError, ImportError) as error:
        return error
    return None


def _unlocked(failure: OSError | ImportError, place: Place) -> ConfigurationError:
    if isinstance(failure, ImportError):
        return ConfigurationError("no_file_locks", place=place)
    cause = failure.strerror or type(failure).__name__
    return ConfigurationError("disk_without_locks", cause=cause, place=place)


@contextmanager
def held_lock(path: Path, taken: ConfigurationError, *, required: bool) -> Generator[None]:
    """Hold a lock; its folder is made where it is missing."""
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        lock = FileLock(path, taken, required=required)
    except OSError as error:
        cause = error.strerror or type(error).__name__
        place = Place(str(path.parent))
        raise ConfigurationError("folder_unwritable", cause=cause, place=place) from None
    with lock:
        yield


def sole_runner(state_file: Path, machine: str) -> AbstractContextManager[None]:
    """Hold the lock of a machine: two programs that write one offset fight each other.

    Not protected: a second program on another computer, or with another configuration file for
    the same machine. The self-test and the read-back notice it.
    """
    path = state_file.with_name(f"{state_file.name}.lock")
    taken = ConfigurationError("machine_in_use", machine=machine, place=Place(str(path)))
    return held_lock(path, taken, required=True)
