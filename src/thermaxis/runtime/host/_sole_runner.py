"""One program per machine: a lock beside the state file."""

from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path

from thermaxis.codes import Place
from thermaxis.errors import ConfigurationError
from thermaxis.runtime.host._lock import FileLock


@contextmanager
def sole_runner(state_file: Path, machine: str) -> Generator[None]:
    """Hold the lock of a machine: two programs that write one offset fight each other.

    Not protected: a second program on another computer, or with another configuration file for
    the same machine. The self-test and the read-back notice it.

    Parameters
    ----------
    state_file : Path
        The machine's state file; the lock stands beside it.
    machine : str
        Name of the machine.

    Yields
    ------
    None
        While the lock is held.

    Raises
    ------
    ConfigurationError
        If another program holds it, the folder cannot be written to, or there are no locks here.
    """
    path = state_file.with_name(f"{state_file.name}.lock")
    taken = ConfigurationError("machine_in_use", machine=machine, place=Place(str(path)))
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        lock = FileLock(path, taken, required=True)
    except OSError as error:
        raise ConfigurationError(
            "folder_unwritable",
            cause=error.strerror or type(error).__name__,
            place=Place(str(path.parent)),
        ) from None
    with lock:
        yield
