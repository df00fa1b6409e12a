"""One program per machine: a lock beside the state file."""

from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path

from thermaxis.errors import ConfigurationError


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
        If another program holds it, or the folder cannot be written to.
    """
    import fcntl  # noqa: PLC0415 - not on every system; only what acts on a machine needs it

    path = state_file.with_name(f"{state_file.name}.lock")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        file = path.open("a", encoding="utf-8")
    except OSError as error:
        raise ConfigurationError(
            f"the folder of the state cannot be written to: {error.strerror}",
            where=str(path.parent),
            remedy="State another state_file, or grant the right",
        ) from None
    with file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            raise ConfigurationError(
                f"another program already runs {machine}",
                where=str(path),
                remedy="End it first: two would fight over one offset",
            ) from None
        yield
