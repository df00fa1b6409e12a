"""Work that is none of the screen's: one command at a time, in a process of its own with limits."""

import asyncio
import contextlib
import json
import math
import os
import shutil
import signal
import stat
import sys
import tempfile
import time
import weakref
from collections.abc import Callable, Collection, Generator, Mapping, Sequence
from enum import StrEnum
from pathlib import Path
from types import MappingProxyType
from typing import IO, Final, NamedTuple, cast, final

from filelock import FileLock, Timeout
from starlette.datastructures import State
from starlette.requests import HTTPConnection

MEMORY_BYTES: Final = 2 << 30
"""Address space of a command: an evaluation of 20 MB needs a part of it. [byte]"""
FILE_BYTES: Final = 64_000_000
"""Largest file that a command may write. [byte]"""
FOLDER_BYTES: Final = 160_000_000
"""Largest sum of the files in its folder. [byte]"""
SAID_BYTES: Final = 256_000
"""Most that a command may print. [byte]"""
NICE: Final = 10
"""Steps by which a command stands back behind the loop and the pages. [1]"""
PROGRESS: Final = ".progress"
"""File in which a command that runs writes its step, as JSON."""
MOST_WAITING: Final = 3
"""Commands that wait while one runs; further ones are refused. [1]"""
_PREFIX = "thermaxis-work-"
_LOCK = "lock"
_SETTINGS = "settings"
_YOUNG_S = 60.0
_LOOK_S = 0.25
_ALARM_AFTER_S = 10
_GONE_S = 5.0
_START = Path(__file__).with_name("_work_start.py")
_KEPT_VARIABLES = ("TZ", "SYSTEMROOT")
_ONE_THREAD = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "POLARS_MAX_THREADS", "RAYON_NUM_THREADS")


class Ending(StrEnum):
    """How a command ended."""

    DONE = "done"
    """By itself; its code says how."""
    TOO_LONG = "too long"
    """It was stopped at the limit of its time, by the clock or of the processor."""
    TOO_MUCH = "too much"
    """It was stopped because it wrote or printed more than it may."""
    KILLED = "killed"
    """Something else ended it: a signal, or the system for want of memory."""


class Limits(NamedTuple):
    """What a command may use."""

    longest_s: float
    """Time by the clock, and of the processor. [s]"""
    memory_bytes: int = MEMORY_BYTES
    """Address space. [byte]"""
    file_bytes: int = FILE_BYTES
    """Largest file. [byte]"""
    folder_bytes: int = FOLDER_BYTES
    """Sum of the files in its folder. [byte]"""
    said_bytes: int = SAID_BYTES
    """What it prints. [byte]"""


class BusyError(Exception):
    """So many commands wait, or one of the same person, that one more is refused."""

    def __init__(self, *, own: bool) -> None:
        super().__init__(own)
        self.own = own


class _Place(NamedTuple):
    """A place that is taken."""

    owner: str
    """Whose it is; empty for nobody's."""
    kind: str


class WorkFolder:
    """A private folder of one command, which exists until it is removed."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self._remove = weakref.finalize(self, shutil.rmtree, path, ignore_errors=True)

    def remove(self) -> None:
        """Remove it with everything in it; again is no error."""
        self._remove()

    def leave_only(self, kept: Collection[Path]) -> None:
        """Remove everything in it but some files."""
        names = {path.name for path in kept}
        for path in self.path.iterdir():
            if path.name in names:
                continue
            if path.is_dir() and not path.is_symlink():
                shutil.rmtree(path, ignore_errors=True)
            else:
                path.unlink(missing_ok=True)


class Outcome(NamedTuple):
    """What came of a command."""

    ending: Ending
    code: int | None
    """Its exit code, minus the signal where one ended it; None where it was stopped here."""
    printed: str
    """What it wrote to its standard output, at most `Limits.said_bytes`."""
    said: str
    """What it wrote to its standard error."""
    files: Mapping[str, Path]
    """The files that it was to make, by their names; only those that are there."""
    folder: WorkFolder
    """Where they are; whoever asked for the command removes it."""


class _Run(NamedTuple):
    """A command that runs."""

    program: asyncio.subprocess.Process
    """Its process, first of a group of its own."""
    folder: Path
    streams: tuple[IO[bytes], IO[bytes]]
    limits: Limits


@final
class Work:
    """Runs commands of this program, one at a time, so that none can touch the screen or the loop.

    A command has a process and a group of processes of its own, a private folder, no variable of
    the environment but a few, and limits: time by the clock and of the processor, memory, size of
    each file and of all, and what it prints. It stands back behind everything else by its
    priority. It ends with the screen, also where that is killed.

    Not protected: a command that leaves its group of processes on purpose, and the network, which
    stays reachable: the words are ours, only the content of the files is not. It runs as the user
    of the screen, who is that of the loop: code that the content of a file smuggled into it could
    read the loop's keys, its configuration and the history. The number of processes is not
    limited here, as the system counts those of the loop with them (RLIMIT_NPROC is per user):
    ``TasksMax`` of the service bounds it. Where the system is not Linux, a killed screen leaves a
    command until its time is over; where it is not POSIX, the limits of processor, memory and
    single files and the priority do not exist.
    """

    def __init__(
        self,
        program: Sequence[str] | None = None,
        *,
        waiting: int = MOST_WAITING,
        where: Path | None = None,
        nice: int = NICE,
    ) -> None:
        python = [sys.executable, "-I", "-X", "utf8", "-m", "thermaxis"]
        self._program = list(program or python)
        self._most = waiting + 1
        self._nice = nice
        self._where = Path(tempfile.gettempdir()) if where is None else where
        self._turn = asyncio.Lock()
        self._places: list[_Place] = []
        self._root: Path | None = None
        self._close: Callable[[], object] = bool

    def close(self) -> None:
        """Remove every folder; also done when the program ends."""
        self._close()
        self._root = None

    def folder(self) -> WorkFolder:
        """Return a new folder that nobody else can read."""
        return WorkFolder(Path(tempfile.mkdtemp(dir=self._private())))

    def is_held_by(self, owner: str) -> bool:
        """Return whether something of somebody runs or waits."""
        return any(taken.owner == owner for taken in self._places)

    @contextlib.contextmanager
    def place(self, owner: str = "", *, kind: str = "", most: int | None = None) -> Generator[None]:
        """Take a place among those that run or wait, from before an upload until after its run."""
        kinds = sum(taken.kind == kind for taken in self._places)
        has_one = bool(owner) and self.is_held_by(owner)
        if has_one or len(self._places) >= self._most or (most is not None and kinds >= most):
            raise BusyError(own=has_one)
        mine = _Place(owner, kind)
        self._places.append(mine)
        try:
            yield
        finally:
            self._places.remove(mine)

    async def run_command(
        self,
        words: Sequence[str],
        *,
        limits: Limits,
        inputs: Mapping[str, bytes | Path] | None = None,
        outputs: Sequence[str] = (),
        folder: WorkFolder | None = None,
    ) -> Outcome:
        """Run a command when it is its turn."""
        with self.place() if folder is None else contextlib.nullcontext():
            mine = folder or self.folder()
            with contextlib.ExitStack() as undone:
                if folder is None:
                    undone.callback(remove_aside, mine)
                await asyncio.to_thread(_put, mine.path, inputs or {})
                async with self._turn:
                    outcome = await self._outcome_of(words, mine, outputs, limits)
                undone.pop_all()
            return outcome

    async def _outcome_of(
        self, words: Sequence[str], folder: WorkFolder, outputs: Sequence[str], limits: Limits
    ) -> Outcome:
        with _printed_file(folder.path) as printed, _printed_file(folder.path) as said:
            program = await asyncio.create_subprocess_exec(
                *self._words(words, limits),
                stdin=asyncio.subprocess.DEVNULL,
                stdout=printed,
                stderr=said,
                cwd=folder.path,
                env=self._environment(folder.path),
                start_new_session=True,
            )
            run = _Run(program, folder.path, (printed, said), limits)
            ending = await _ending_of(run)
            texts = [_text_of(stream, limits.said_bytes) for stream in run.streams]
        found = {name: folder.path / name for name in outputs}
        files = {name: path for name, path in found.items() if is_file(path)}
        ended = ending in (Ending.DONE, Ending.KILLED)
        code = program.returncode if ended else None
        return Outcome(ending, code, texts[0], texts[1], MappingProxyType(files), folder)

    def _words(self, words: Sequence[str], limits: Limits) -> list[str]:
        if os.name != "posix":
            return [*self._program, *words]
        longest_s = math.ceil(limits.longest_s)
        told = {
            "processor_s": longest_s,
            "memory_bytes": limits.memory_bytes,
            "file_bytes": limits.file_bytes,
            "nice": self._nice,
            "alarm_s": longest_s + _ALARM_AFTER_S,
            "parent": os.getpid(),
        }
        starter = [sys.executable, "-I", "-S", str(_START), json.dumps(told)]
        return [*starter, *self._program, *words]

    def _environment(self, folder: Path) -> dict[str, str]:
        kept = {name: os.environ[name] for name in _KEPT_VARIABLES if name in os.environ}
        return {
            **kept,
            "PATH": os.defpath,
            "LANG": "C.UTF-8",
            "HOME": str(folder),
            "USERPROFILE": str(folder),
            "TMPDIR": str(folder),
            "MPLCONFIGDIR": str(self._private() / _SETTINGS),  # its list of fonts takes a second
            "THERMAXIS_PROGRESS": str(folder / PROGRESS),
            **dict.fromkeys(_ONE_THREAD, "1"),
        }

    def _private(self) -> Path:
        """Return the folder of all folders; it is made, and locked, when it is first needed."""
        if self._root is None:
            root = Path(tempfile.mkdtemp(prefix=_PREFIX, dir=self._where))
            lock = _lock_of(root)
            with contextlib.suppress(OSError):  # a disk without locks: it goes with this program
                lock.acquire()
            self._close = weakref.finalize(self, _remove_locked, root, lock)
            (root / _SETTINGS).mkdir(mode=0o700)
            self._root = root
        return self._root


def remove_aside(folder: WorkFolder) -> None:
    """Remove a folder in a thread, so that a large one stops no page; nobody waits for it."""
    asyncio.get_running_loop().run_in_executor(None, folder.remove)


def work_of(connection: HTTPConnection) -> Work:
    """Return the work that all pages share; it is made at the first question."""
    state = connection.app.state
    if not hasattr(state, "work"):
        state.work = Work()
    return cast("Work", state.work)


def close_work(state: State) -> None:
    """Remove every folder of a program that ends, if anything was ever worked on."""
    if hasattr(state, "work"):
        cast("Work", state.work).close()


def remove_leftovers(where: Path | None = None) -> int:
    """Remove the folders of screens that were killed; those of living ones stay."""
    if os.name != "posix":
        return 0
    place = Path(tempfile.gettempdir()) if where is None else where
    return sum(_remove_if_left(path) for path in place.glob(f"{_PREFIX}*"))


def _remove_if_left(root: Path) -> bool:
    """Remove a folder of ours that no living program holds."""
    try:
        status = root.lstat()
        owner = os.getuid() if os.name == "posix" else status.st_uid
        ours = stat.S_ISDIR(status.st_mode) and status.st_uid == owner
        if not ours or status.st_mode & (stat.S_IRWXG | stat.S_IRWXO):
            return False
        if not (root / _LOCK).exists() and time.time() - status.st_mtime < _YOUNG_S:
            return False  # being made just now
        with _lock_of(root):
            shutil.rmtree(root, ignore_errors=True)
    except (OSError, Timeout):
        return False
    return True


def _lock_of(root: Path) -> FileLock:
    """Return the lock of a folder, not yet held; gone with the program, however it ends."""
    return FileLock(root / _LOCK, blocking=False, thread_local=False, fallback_to_soft=False)


def _remove_locked(root: Path, lock: FileLock) -> None:
    shutil.rmtree(root, ignore_errors=True)
    lock.release()
    shutil.rmtree(root, ignore_errors=True)  # where an open file cannot be removed


def _put(folder: Path, inputs: Mapping[str, bytes | Path]) -> None:
    for name, content in inputs.items():
        target = folder / name
        if target.parent != folder or name.startswith("."):
            raise ValueError(name)
        if isinstance(content, Path):
            shutil.copyfile(content, target)
        else:
            target.write_bytes(content)


def _printed_file(folder: Path) -> IO[bytes]:
    """Return a file without a name: a pipe would make the screen read as fast as it is flooded."""
    return tempfile.TemporaryFile(dir=folder)


async def _ending_of(run: _Run) -> Ending:
    """Wait for a command, look at what it uses, and end what is left of it in any case."""
    try:
        ending = await _watch(run)
    finally:
        _kill(run.program.pid)
        with contextlib.suppress(TimeoutError):
            async with asyncio.timeout(_GONE_S):
                await run.program.wait()
    return ending


async def _watch(run: _Run) -> Ending:
    loop = asyncio.get_running_loop()
    end_s = loop.time() + run.limits.longest_s
    while True:
        with contextlib.suppress(TimeoutError):
            async with asyncio.timeout(_LOOK_S):
                code = await run.program.wait()
                # it may have failed at the size of a file, sooner than it was looked at
                too_much = bool(code) and await asyncio.to_thread(_wrote_too_much, run)
                return Ending.TOO_MUCH if too_much else _judged(code)
        if await asyncio.to_thread(_wrote_too_much, run):
            return Ending.TOO_MUCH
        if loop.time() >= end_s:
            return Ending.TOO_LONG


def _judged(code: int) -> Ending:
    if code >= 0:
        return Ending.DONE
    if -code in (getattr(signal, "SIGXCPU", None), getattr(signal, "SIGALRM", None)):
        return Ending.TOO_LONG
    return Ending.TOO_MUCH if -code == getattr(signal, "SIGXFSZ", None) else Ending.KILLED


def _wrote_too_much(run: _Run) -> bool:
    said = sum(os.fstat(stream.fileno()).st_size for stream in run.streams)
    if said > run.limits.said_bytes:
        return True
    written = 0
    for place, _, names in os.walk(run.folder):
        for name in names:
            with contextlib.suppress(OSError):  # it may have gone meanwhile
                written += Path(place, name).lstat().st_size
    return written > run.limits.folder_bytes


def _kill(first: int) -> None:
    """End a group of processes; there may be none of it left."""
    with contextlib.suppress(ProcessLookupError, PermissionError):
        if os.name == "posix":
            os.killpg(first, signal.SIGKILL)
        else:
            os.kill(first, signal.SIGTERM)


def _text_of(stream: IO[bytes], limit_bytes: int) -> str:
    stream.seek(0)
    return stream.read(limit_bytes).decode("utf-8", "replace")


def is_file(path: Path) -> bool:
    """Return whether a path is a regular file, itself and no link to one."""
    try:
        return stat.S_ISREG(path.lstat().st_mode)
    except OSError:
        return False
