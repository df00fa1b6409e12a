"""Start an OPC UA server written by others (node-opcua), break it, and leave nothing behind.

The server stands for a machine: see ``server.js``. It binds 127.0.0.1 only, keeps keys and
certificates in the folder of its test, writes down every offset that it accepts, and ends with
the program that started it, or after a hard life time. Only processes that were started here are
ended, by their ids.
"""

import contextlib
import fcntl
import hashlib
import json
import os
import queue
import shutil
import signal
import ssl
import subprocess
import tempfile
import threading
import time
from collections.abc import Generator, Mapping, Sequence
from pathlib import Path
from types import TracebackType
from typing import NamedTuple, Self

from tests.in_time import LONGEST_S

FOLDER = Path(__file__).parent
MODULES = FOLDER / "node_modules"
STAMP = MODULES / ".installed-from"
OLDEST_NODE = 18
INSTALLATION_S = 300.0
START_S = 120.0
"""Time allowed for a start; it takes 1 to 3 s on an idle computer."""
WATCH_S = 30.0
"""Time allowed for the server to notice a certificate that was moved; it takes 3 s."""
NAMESPACE_URI = "urn:thermaxis:test:machine:plc"
PROGRAMS = ("node", "npm", "setpriv")
NO_ROOM = "the foreign server gave no answer"


def missing(programs: Sequence[str] = PROGRAMS) -> str:
    """Return why node-opcua cannot run here; empty if nothing is missing."""
    absent = [program for program in programs if shutil.which(program) is None]
    if absent:
        return (
            f"{', '.join(absent)} not found, and these tests need an OPC UA server written by"
            " others, which runs on Node.js. On Debian 12 or later: apt-get install"
            " --no-install-recommends nodejs npm"
        )
    version = subprocess.run(["node", "--version"], capture_output=True, text=True, check=True)
    if int(version.stdout.strip().lstrip("v").split(".")[0]) < OLDEST_NODE:
        return f"Node.js {version.stdout.strip()} is too old: {OLDEST_NODE} or later is needed"
    return ""


def install() -> None:
    """Install the packages of the lock file beside the server, once.

    Raises
    ------
    RuntimeError
        If npm cannot.
    """
    wanted = hashlib.sha256((FOLDER / "package-lock.json").read_bytes()).hexdigest()
    with one_at_a_time():
        if STAMP.is_file() and STAMP.read_text(encoding="ascii") == wanted:
            return
        npm = subprocess.run(
            ["npm", "ci", "--ignore-scripts", "--prefer-offline", "--omit=dev"],
            cwd=FOLDER,
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            timeout=INSTALLATION_S,
            check=False,
        )
        if npm.returncode != 0:
            raise RuntimeError(f"npm cannot install node-opcua:\n{npm.stderr[-2000:]}")
        STAMP.write_text(wanted, encoding="ascii")


@contextlib.contextmanager
def one_at_a_time() -> Generator[None]:
    """Hold the lock of the installation."""
    name = hashlib.sha256(bytes(FOLDER)).hexdigest()[:16]
    path = Path(tempfile.gettempdir()) / f"thermaxis-npm-{name}.lock"
    lock = os.open(path, os.O_RDONLY | os.O_CREAT | os.O_NOFOLLOW, 0o644)
    try:
        fcntl.flock(lock, fcntl.LOCK_EX)
        yield
    finally:
        os.close(lock)


class Line(NamedTuple):
    """One line of the machine's record."""

    kind: str
    """``start``, ``accepted``, ``watchdog``."""
    monotonic_s: float
    """Monotonic time of this computer, the same as Python's. [s]"""
    accepted_um: Mapping[str, float]
    """Offsets of the machine by axis, in its own sign; empty in a line of the watchdog. [µm]"""
    effective_um: Mapping[str, float]
    """What acts on the tool at that time. [µm]"""
    heartbeat: int | None
    """Heartbeat by which they were accepted. [1]"""
    writes: int | None
    """Writes of offsets since the server's start. [1]"""
    met: bool | None
    """Whether the watchdog is met, in its lines."""


class ForeignServer:
    """One server with its folder. It comes back at the same port and with the same keys.

    Parameters
    ----------
    folder : Path
        Folder of its keys and its record; made if it is not there.
    settings : object
        What differs from the settings at the head of ``server.js``.
    """

    def __init__(self, folder: Path, **settings: object) -> None:
        self.folder = folder
        self.pki = folder / "pki"
        self.record_path = folder / "offsets.jsonl"
        self.settings: dict[str, object] = {
            "pki": str(self.pki),
            "record": str(self.record_path),
            "origin_s": time.monotonic(),
            **settings,
        }
        self.url = ""
        self.ready_s = float("nan")
        self.starts = 0
        self._running: _Process | None = None
        self._standby: _Process | None = None
        (self.pki / "trusted" / "certs").mkdir(parents=True)

    def __enter__(self) -> Self:
        """Start."""
        try:
            self.start()
        except BaseException:
            self.end()
            raise
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """End whatever was started, whatever state it is in."""
        self.end()

    # ---- life ----------------------------------------------------------------------------------

    def start(self) -> None:
        """Start and wait until it listens."""
        self._running = self._launch(standby=False)
        self._take_ready(self._running.wait_for("READY", START_S))

    def prepare(self) -> None:
        """Begin to prepare a successor, so that the next return takes no time.

        Call it in the main thread: the kernel ends the server with the thread that started it.
        """
        self._standby = self._launch(standby=True)

    def wait_for_successor(self) -> None:
        """Wait until the successor needs only be told to listen."""
        if self._standby is None:
            raise RuntimeError("no successor was prepared")
        self._standby.wait_for("STANDBY", START_S)

    def listen(self) -> None:
        """Let the successor listen."""
        if self._standby is None:
            raise RuntimeError("no successor was prepared")
        self._running, self._standby = self._standby, None
        self._running.tell({"listen": True})
        self._take_ready(self._running.wait_for("READY", START_S))

    def kill(self) -> float:
        """End it at once (SIGKILL); return when. [s]"""
        return self._end_by(signal.SIGKILL)

    def terminate(self) -> float:
        """End it by SIGTERM; return when. [s]"""
        return self._end_by(signal.SIGTERM)

    def wait_for_end(self, limit_s: float = LONGEST_S) -> int:
        """Wait until it has ended by itself; return its exit code."""
        code = self.running.popen.wait(limit_s)
        self.running.end()
        self._running = None
        return code

    def freeze(self) -> None:
        """Stop it (SIGSTOP): its sockets stay open and nobody answers."""
        os.kill(self.running.popen.pid, signal.SIGSTOP)

    def thaw(self) -> None:
        """Let it go on."""
        os.kill(self.running.popen.pid, signal.SIGCONT)

    def end(self) -> None:
        """End everything that was started."""
        for process in (self._running, self._standby):
            if process is not None:
                process.end()
        self._running = self._standby = None

    @property
    def running(self) -> "_Process":
        """The process that listens."""
        if self._running is None:
            raise RuntimeError("the foreign server does not run")
        return self._running

    @property
    def port(self) -> int:
        """Its port. [1]"""
        port = self.settings["port"]
        assert isinstance(port, int)
        return port

    # ---- the machine behind it -----------------------------------------------------------------

    def tell(self, **command: object) -> None:
        """Tell the machine something, such as ``fault="nan"`` or ``flags={"Referenced": False}``.

        See `obey` in ``server.js``. Returns when it has been done.
        """
        self.running.tell(command)
        self.running.wait_for("DONE", START_S)

    def node(self, name: str) -> str:
        """Return the node id of a variable, its namespace by name."""
        return f"nsu={NAMESPACE_URI};s=/Plc/{name}"

    def record(self) -> list[Line]:
        """Return what the machine wrote down, over all starts."""
        if not self.record_path.is_file():
            return []
        return [_line(row) for row in self.record_path.read_text(encoding="utf-8").splitlines()]

    # ---- certificates --------------------------------------------------------------------------

    def trust(self, certificate: Path) -> None:
        """Put a client's certificate (PEM or DER) where the server trusts it.

        A running server notices within 3 s; one that is started later knows it at once.
        """
        der = _der(certificate.read_bytes())
        (self.pki / "trusted" / "certs" / f"{certificate.stem}.der").write_bytes(der)

    def rejected(self) -> list[Path]:
        """Return the certificates that it refused."""
        folder = self.pki / "rejected"
        return sorted(p for p in folder.glob("*") if p.is_file()) if folder.is_dir() else []

    def trust_rejected(self) -> None:
        """Do what an operator does on a control: move what was refused to the trusted ones."""
        for path in self.rejected():
            path.rename(self.pki / "trusted" / "certs" / path.name)

    def write_certificate(self, path: Path) -> Path:
        """Write the server's own certificate (DER) to a file, as it is handed over for pinning."""
        own = self.pki / "own" / "certs" / "certificate.pem"
        path.write_bytes(_der(own.read_bytes()))
        return path

    # ---- inside --------------------------------------------------------------------------------

    def _launch(self, *, standby: bool) -> "_Process":
        self.starts += 1
        path = self.folder / f"settings-{self.starts}.json"
        path.touch(0o600)
        path.write_text(json.dumps({**self.settings, "standby": standby}), encoding="utf-8")
        return _Process(path, self.folder / f"server-{self.starts}.log")

    def _take_ready(self, ready: dict[str, object]) -> None:
        self.url = str(ready["endpoint"])
        monotonic_s, port = ready["monotonic_s"], ready["port"]
        assert isinstance(monotonic_s, float)
        assert isinstance(port, int)
        self.ready_s = monotonic_s
        self.settings["port"] = port

    def _end_by(self, number: signal.Signals) -> float:
        at_s = time.monotonic()
        self.running.end(number)
        self._running = None
        return at_s


class _Process:
    """A started server and what it says."""

    def __init__(self, settings: Path, log: Path) -> None:
        self._log = log
        self._said: queue.SimpleQueue[str] = queue.SimpleQueue()
        with log.open("wb") as errors:
            self.popen = subprocess.Popen(  # ended by the kernel if this program is killed
                ["setpriv", "--pdeathsig", "KILL", "node", str(FOLDER / "server.js"), settings],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=errors,
                env={**os.environ, "HOME": str(settings.parent), "NODE_NO_WARNINGS": "1"},
            )
        self._reader = threading.Thread(target=self._listen, daemon=True)
        self._reader.start()

    def _listen(self) -> None:
        assert self.popen.stdout is not None
        for line in self.popen.stdout:
            self._said.put(line.decode("utf-8", "replace"))
        self._said.put("")

    def tell(self, command: Mapping[str, object]) -> None:
        """Write one command."""
        assert self.popen.stdin is not None
        self.popen.stdin.write(json.dumps(command).encode() + b"\n")
        self.popen.stdin.flush()

    def wait_for(self, word: str, limit_s: float) -> dict[str, object]:
        """Return what it says after a word.

        Raises
        ------
        RuntimeError
            If it fails, ends, or says nothing for too long.
        """
        until_s = time.monotonic() + limit_s
        while True:
            try:
                line = self._said.get(timeout=max(0.0, until_s - time.monotonic()))
            except queue.Empty:
                raise RuntimeError(f"{NO_ROOM}: no {word} within {limit_s:g} s") from None
            if line.startswith(f"{word} "):
                return json.loads(line[len(word) + 1 :])
            if line == "" or line.startswith("FAILED "):
                log = self._log.read_text(encoding="utf-8", errors="replace")
                raise RuntimeError(f"{NO_ROOM} but: {line}\n{log[-2000:]}")

    def end(self, number: signal.Signals = signal.SIGKILL) -> None:
        """End it, frozen or not, and wait for the end."""
        if self.popen.poll() is None:
            self.popen.send_signal(number)
            try:
                self.popen.wait(LONGEST_S)
            except subprocess.TimeoutExpired:
                self.popen.kill()
                self.popen.wait(LONGEST_S)
        self._reader.join(10.0)
        assert self.popen.stdin is not None
        assert self.popen.stdout is not None
        with contextlib.suppress(BrokenPipeError):
            self.popen.stdin.close()
        self.popen.stdout.close()


def _line(row: str) -> Line:
    read = json.loads(row)

    def offsets(key: str) -> dict[str, float]:
        return {axis: float(value) for axis, value in read.get(key, {}).items()}

    return Line(
        kind=read["kind"],
        monotonic_s=read["monotonic_s"],
        accepted_um=offsets("accepted_um"),
        effective_um=offsets("effective_um"),
        heartbeat=read.get("heartbeat"),
        writes=read.get("writes"),
        met=read.get("met"),
    )


def _der(certificate: bytes) -> bytes:
    if certificate.startswith(b"-----BEGIN"):
        return ssl.PEM_cert_to_DER_cert(certificate.decode("ascii"))
    return certificate
