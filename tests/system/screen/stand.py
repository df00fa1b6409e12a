"""A virtual lathe, its loop, its status server with users, and the screen, in a folder of its own.

Every part is a program of its own, restartable alone, and ends with whoever started it at the
latest. Ports are free ones and stay the same when a part is started again, as those of a machine
do. To look by hand:

    python -m tests.system.screen.stand --minutes 30
"""

import argparse
import asyncio
import http.cookiejar
import json
import os
import random
import secrets
import signal
import socket
import ssl
import subprocess
import sys
import tempfile
import time
import urllib.error
import urllib.request
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, suppress
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Final, NamedTuple, Self

from asyncua.client.client import Client

from tests.in_time import LONGEST_S
from tests.system.loop_stand import NODES
from tests.system.programs import Program
from thermaxis.compensation import CompensationModel, GainPoint, Output, Part, Section
from thermaxis.files import read_model, write_model
from thermaxis.runtime import (
    CertificateUse,
    Role,
    User,
    hash_password,
    opcua,
    write_users,
)

ROOT: Final = Path(__file__).resolve().parents[3]
EXAMPLE: Final = ROOT / "examples" / "machine" / "models" / "lathe.json"
LARGEST_UM: Final = 60.0
"""Limit of the correction. [µm]"""
RATE_UM_PER_S: Final = 5.0
"""Rate of the correction. [µm/s]"""
TRIM_UM: Final = 10.0
"""Largest trim. [µm]"""
CYCLE_S: Final = 0.5
"""Cycle of the loop. [s]"""
START_S: Final = LONGEST_S
"""Longest start of a program. [s]"""
AHEAD: Final = -10
"""Priority of the loop, its machine and its screen, whose times the tests look at. [1]"""
PATIENCE_S: Final = LONGEST_S
"""What must come about is waited for so long. [s]"""
NO_DATA_STATUS: Final = 409
"""Nothing is asked while the screen has no data. [1]"""
PEOPLE: Final = ("viewer", "operator", "engineer")
"""Names of the log-ins, which are their roles too."""
OTHER_MODEL: Final = "lathe.json"
"""A model that an engineer may choose."""
_CONFIGURATION: Final = """\
[machine]
name = "virtual lathe"
cycle_s = {cycle_s}
model = "models/quick.json"
model_folder = "models"
state_file = "lathe.state.json"

[connection.lathe]
url = "opc.tcp://127.0.0.1:{lathe}/lathe"
security = "none"

[source]
kind = "opcua"
connection = "lathe"

[sink]
kind = "opcua"
connection = "lathe"
heartbeat_node = "{nodes}heartbeat"

[input.T_spindle_C]
node = "{nodes}T_spindle_C"
unit = "degC"
lowest_c = 5.0
highest_c = 80.0

[input.T_table_C]
node = "{nodes}T_table_C"
unit = "degC"
lowest_c = 5.0
highest_c = 80.0

[input.T_column_C]
node = "{nodes}T_column_C"
unit = "degC"
lowest_c = 5.0
highest_c = 45.0

[interlock.referenced]
node = "{nodes}referenced"
met = true

[other_compensation]
node = "{nodes}own_compensation"
active = true

[probe.Z_um]
node = "{nodes}Z_um"
unit = "um"

[output.Z_um]
node = "{nodes}offset_mm"
read_back_node = "{nodes}offset_accepted_mm"
effective_node = "{nodes}offset_effective_mm"
unit = "mm"
sign = "positive moves the tool away from the workpiece"
largest_um = {largest_um}
largest_rate_um_per_s = {rate_um_per_s}
largest_trim_um = {trim_um}

[supervisor]
settle_s = 2.0
recovery_delay_s = 0.5
hold_connection_s = 120.0
stop_within_s = 60.0

[historian]
url = "sqlite:///history.db"
retention_days = 40

[server]
address = "127.0.0.1"
port = {server}
users = "users.toml"
certificate = "server.der"
private_key = "server.pem"
anonymous_role = "{anonymous}"

[screen]
address = "127.0.0.1"
port = {screen}
client_certificate = "client.der"
client_private_key = "client.pem"
{more}
"""
_FEED: Final = """\
user = "screen"
password_file = "screen.password"
"""
_TLS: Final = """\
certificate = "page.crt"
private_key = "page.key"
"""


class Answer(NamedTuple):
    """What the screen answered to a request without a browser."""

    status: int
    """HTTP status. [1]"""
    headers: Mapping[str, str]
    """Headers, their names in small letters."""
    body: bytes
    """Body."""

    def json(self) -> dict[str, Any]:
        """Return the body as JSON."""
        found: dict[str, Any] = json.loads(self.body)
        return found


def free_port() -> int:
    """Return a port that nobody has; below those that are handed out to connections. [1]"""
    chance = random.SystemRandom()
    while True:
        port = chance.randrange(20_000, 32_000)
        with socket.socket() as one:
            try:
                one.bind(("127.0.0.1", port))
            except OSError:
                continue
            return port


def wait_until(what: str, condition: Callable[[], Any], limit_s: float = PATIENCE_S) -> float:
    """Wait until something is so; return how long it took. [s]

    Raises
    ------
    AssertionError
        If it does not become so in time.
    """
    began_s = time.monotonic()
    while not condition():
        if time.monotonic() - began_s > limit_s:
            raise AssertionError(f"not within {limit_s:g} s: {what}")
        time.sleep(0.03)
    return time.monotonic() - began_s


def quick_model() -> CompensationModel:
    """Return a model that asks a cold lathe for some -25 µm at once, and for a little more later.

    Its provenance and warnings are those of the example's model.
    """
    spindle = Part(
        "spindle",
        "T_spindle_C",
        "T_column_C",
        direct_gain_um_per_k=5.0,
        sections=(Section(4.0, 3.0), Section(3.0, 900.0), Section(1.5, 5400.0)),
        lowest_k=-2.0,
        highest_k=14.0,
        static_gain_um_per_k=12.0,
    )
    table = Part(
        "table",
        "T_table_C",
        "T_column_C",
        direct_gain_um_per_k=2.0,
        sections=(Section(3.0, 2.0), Section(-1.0, 2400.0)),
        gain_by_diameter=(GainPoint(0.0, 1.0), GainPoint(1500.0, 1.6), GainPoint(3000.0, 2.2)),
        lowest_k=-2.0,
        highest_k=9.0,
        static_gain_um_per_k=4.0,
    )
    example = read_model(EXAMPLE)
    return replace(
        example,
        outputs=(Output("Z_um", (spindle, table)),),
        sample_time_s=1.0,
        reference="stated",
        reference_c={"T_spindle_C": 18.6, "T_table_C": 19.6, "T_column_C": 20.5},
    )


class Rig:
    """The lathe, its loop and its screen.

    Parameters
    ----------
    folder : Path
        Where everything lies.
    view_without_login : bool
        As in ``[screen]``. Default: not.
    secure : bool
        Whether the pages go through TLS. Default: not.
    anonymous : bool
        Whether the screen reads the status without a name. Default: as the user ``screen``.
    more : str
        Further keys of ``[screen]``.
    speed : float
        How much faster than real time the lathe lives. [1]
    """

    def __init__(
        self,
        folder: Path,
        *,
        view_without_login: bool = False,
        secure: bool = False,
        anonymous: bool = False,
        more: str = "",
        speed: float = 1.0,
    ) -> None:
        self.folder, self.secure, self.speed = folder, secure, speed
        self.lathe_port, self.server_port, self.screen_port = (free_port() for _ in range(3))
        self.lathe_url = f"opc.tcp://127.0.0.1:{self.lathe_port}/lathe"
        self.address = f"{'https' if secure else 'http'}://127.0.0.1:{self.screen_port}"
        self.passwords = {name: secrets.token_urlsafe(9) for name in PEOPLE}
        self.configuration = folder / "machine.toml"
        self.programs: dict[str, Program] = {}
        self._write(
            more=(_TLS if secure else "")
            + ("" if anonymous else _FEED)
            + f"view_without_login = {str(view_without_login).lower()}\n"
            + more,
            anonymous="viewer" if anonymous else "none",
        )

    # ---- life ---------------------------------------------------------------------------------

    def _write(self, *, more: str, anonymous: str) -> None:
        models = self.folder / "models"
        models.mkdir()
        write_model(quick_model(), models / "quick.json")
        (models / OTHER_MODEL).write_bytes(EXAMPLE.read_bytes())
        text = _CONFIGURATION.format(
            cycle_s=CYCLE_S,
            lathe=self.lathe_port,
            server=self.server_port,
            screen=self.screen_port,
            nodes=NODES,
            largest_um=LARGEST_UM,
            rate_um_per_s=RATE_UM_PER_S,
            trim_um=TRIM_UM,
            anonymous=anonymous,
            more=more,
        )
        self.configuration.write_text(text, encoding="utf-8")
        feed = secrets.token_urlsafe(12)
        words = [*((name, Role(name), self.passwords[name]) for name in PEOPLE)]
        words.append(("screen", Role.VIEWER, feed))
        users = [User(name, role, hash_password(word)) for name, role, word in words]
        write_users(users, self.folder / "users.toml")
        password = self.folder / "screen.password"
        password.touch(mode=0o600)
        password.write_text(f"{feed}\n", encoding="utf-8")
        self._certify("server.der", "server.pem", CertificateUse.SERVER)
        self._certify("client.der", "client.pem", CertificateUse.CLIENT)
        if self.secure:
            self._certify("page.crt", "page.key", CertificateUse.SERVER)

    def _certify(self, certificate: str, key: str, use: CertificateUse) -> None:
        new = opcua.NewCertificate(
            application_uri="urn:thermaxis:client", hosts=("127.0.0.1",), use=use
        )
        pair = opcua.make_pair(new, datetime.now(UTC))
        opcua.write_pair(self.folder / certificate, self.folder / key, pair)

    def command(self, *arguments: str) -> str:
        """Run a command of thermaxis in the folder and return what it printed.

        Raises
        ------
        RuntimeError
            If it fails.
        """
        ended = subprocess.run(
            [sys.executable, "-m", "thermaxis", *arguments],
            cwd=self.folder,
            capture_output=True,
            text=True,
            timeout=PATIENCE_S,
            check=False,
        )
        if ended.returncode:
            raise RuntimeError(f"thermaxis {' '.join(arguments)}: {ended.stderr}")
        return ended.stdout

    def __enter__(self) -> Self:
        try:
            self.start_lathe()
            self.start_loop()
            self.start_screen()
        except BaseException:
            self.end()
            raise
        return self

    def __exit__(self, *_: object) -> None:
        self.end()

    def end(self) -> None:
        """End every program, the screen first; the loop does not fade a lathe that is gone."""
        for name in ("screen", "run", "machine"):
            if name in self.programs:
                self.programs.pop(name).end()

    def _started(self, arguments: Sequence[str | Path]) -> Program:
        """Start a program; where that is allowed, it goes before all that is not of a machine."""
        program = Program(arguments, self.folder)
        with suppress(PermissionError):
            os.setpriority(os.PRIO_PROCESS, program.popen.pid, AHEAD)
        return program

    def start_lathe(self, *faults: str) -> None:
        """Start the lathe; each fault as the command takes it."""
        said = [word for fault in faults for word in ("--fault", fault)]
        self.programs["machine"] = program = self._started(
            [
                *("machine", "--scenario", "verification", "--port", str(self.lathe_port)),
                *("--speed", f"{self.speed:g}", "--stop-after", "7200s"),
                *("--rate", "200", "--watchdog", "10s", *said),
            ]
        )
        program.wait_for("endpoint: ", START_S)

    def start_loop(self, *options: str, cores: Sequence[int] = ()) -> None:
        """Start the loop, on these cores only if they are stated; wait for its first cycle."""
        self.programs["run"] = program = self._started(["run", self.configuration, *options])
        if cores:
            os.sched_setaffinity(program.popen.pid, cores)
        program.wait_for("Z_um", START_S)

    def start_screen(self, cores: Sequence[int] = ()) -> None:
        """Start the screen, on these cores only if they are stated; wait for its address."""
        self.programs["screen"] = program = self._started(["screen", self.configuration])
        if cores:
            os.sched_setaffinity(program.popen.pid, cores)
        program.wait_for("screen: ", START_S)

    def kill(self, name: str, number: signal.Signals = signal.SIGKILL) -> None:
        """End ``machine``, ``run`` or ``screen`` by a signal, and wait for its end."""
        program = self.programs.pop(name)
        program.signal(number)
        program.wait(70.0)

    # ---- what others see ----------------------------------------------------------------------

    def offset_um(self) -> float:
        """Return the offset that acts in the lathe, read from the lathe itself. [µm]"""
        return 1e3 * self.lathe_values("offset_effective_mm")[0]

    def lathe_values(self, *names: str) -> list[float]:
        """Return values of the lathe's nodes, read by a client of their own."""
        with ThreadPoolExecutor(1) as own:  # a test with a browser has a loop in its thread
            return own.submit(lambda: asyncio.run(self._read(names))).result(PATIENCE_S)

    def wait_cycles(self, count: int) -> None:
        """Wait until the loop has written so many times more: it has seen what is so now."""
        (first,) = self.lathe_values("heartbeat")
        wait_until(
            f"{count} cycles of the loop",
            lambda: abs(self.lathe_values("heartbeat")[0] - first) >= count,
        )

    async def _read(self, names: Sequence[str]) -> list[float]:
        client = Client(self.lathe_url, timeout=0.5 * PATIENCE_S)
        client.session_timeout = 60_000
        async with client:
            index = await client.get_namespace_index("urn:thermaxis:lathe")
            nodes = [client.get_node(f"ns={index};s={name}") for name in names]
            return [float(await node.read_value()) for node in nodes]

    def events(self) -> list[dict[str, Any]]:
        """Return what the historian tells of events, by the command that people use."""
        said = self.command("history", "events", str(self.configuration), "--json", "-")
        found: list[dict[str, Any]] = json.loads(said)["events"]
        return found

    def visitor(self) -> "Visitor":
        """Return a visitor without a browser, who has not logged in."""
        return Visitor(self)


class _NoRedirect(urllib.request.HTTPRedirectHandler):
    def redirect_request(self, *_: object) -> None:
        return None


class Visitor:
    """Somebody who asks without a browser, with cookies of their own.

    Parameters
    ----------
    stand : Rig
        Whose screen.
    """

    def __init__(self, stand: Rig) -> None:
        self.stand, self.token = stand, ""
        self.cookies = http.cookiejar.CookieJar()
        self._context = None
        if stand.secure:
            der = (stand.folder / "page.crt").read_bytes()
            self._context = ssl.create_default_context(cadata=der)

    def ask(
        self,
        path: str,
        given: object = None,
        *,
        method: str = "",
        headers: Mapping[str, str] | None = None,
        token: bool = True,
    ) -> Answer:
        """Ask for a path; something given is sent as JSON, bytes as they are.

        Origin and token are those of the pages unless ``headers`` say otherwise.
        """
        body = given if isinstance(given, bytes) or given is None else json.dumps(given).encode()
        sent = {"Origin": self.stand.address}
        if self.token and token:
            sent["X-Thermaxis-Token"] = self.token
        if body is not None:
            sent["Content-Type"] = "application/json"
        sent |= headers or {}
        request = urllib.request.Request(  # noqa: S310 - our own address
            f"{self.stand.address}{path}",
            body,
            {name: value for name, value in sent.items() if value},
            method=method or ("GET" if body is None else "POST"),
        )
        handlers: list[urllib.request.BaseHandler] = [
            _NoRedirect(),
            urllib.request.HTTPCookieProcessor(self.cookies),
            urllib.request.ProxyHandler({}),
        ]
        if self._context is not None:
            handlers.append(urllib.request.HTTPSHandler(context=self._context))
        try:
            with urllib.request.build_opener(*handlers).open(request, timeout=PATIENCE_S) as answer:
                return Answer(answer.status, _small(answer.headers), answer.read())
        except urllib.error.HTTPError as error:
            with error:
                return Answer(error.code, _small(error.headers), error.read())

    def log_in(self, name: str, password: str | None = None) -> Answer:
        """Log in, by default with the right password, and take the token from a page."""
        password = self.stand.passwords[name] if password is None else password
        answer = self.ask("/login", {"name": name, "password": password})
        if answer.status == 200:
            page = self.ask("/").body.decode()
            self.token = page.partition('data-token="')[2].partition('"')[0]
        return answer

    def request(self, method: str, *arguments: float | str) -> dict[str, Any]:
        """Ask something of the loop, as soon as the screen has data; return the answer."""
        given = {"method": method, "arguments": list(arguments)}
        answers: list[Answer] = []

        def answered() -> bool:
            answers.append(self.ask("/ask", given))
            return answers[-1].status != NO_DATA_STATUS

        wait_until("the screen has data", answered)
        return answers[-1].json()

    def enable(self) -> None:
        """Enable the compensation, as soon as the loop has read what it must know before."""
        wait_until("it is enabled", lambda: self.request("Enable")["answer"] == "accepted")

    @property
    def cookie(self) -> str:
        """The cookies as a header of a web socket."""
        return "; ".join(f"{one.name}={one.value}" for one in self.cookies)


def _small(headers: Any) -> dict[str, str]:
    return {name.lower(): value for name, value in headers.items()}


def main() -> int:
    """Start a stand and tell how to look at it, until the time is over or Ctrl-C."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--minutes", type=float, default=30.0, help="life (default: 30)")
    parser.add_argument("--speed", type=float, default=1.0, help="of the lathe (default: 1)")
    parser.add_argument("--view-without-login", action="store_true", help="anybody may look")
    parser.add_argument("--secure", action="store_true", help="TLS")
    arguments = parser.parse_args()
    with ExitStack() as stack:
        folder = stack.enter_context(tempfile.TemporaryDirectory())
        stand = stack.enter_context(
            Rig(
                Path(folder),
                view_without_login=arguments.view_without_login,
                secure=arguments.secure,
                speed=arguments.speed,
            )
        )
        print(f"screen:  {stand.address}/   ({stand.configuration})")
        print(f"lathe:   {stand.lathe_url}")
        for name, password in stand.passwords.items():
            print(f"log-in:  {name} / {password}", flush=True)
        try:
            time.sleep(60.0 * arguments.minutes)
        except KeyboardInterrupt:
            print("ended")
    return 0


if __name__ == "__main__":
    sys.exit(main())
