"""Try loop and pages at a virtual lathe, with a shift of history, and break things.

Buttons break a sensor, network, server and loop, press the emergency stop, and let an hour pass
in a minute. One command, no file. It binds 127.0.0.1 only; its users are valid for its virtual
lathe only; what it writes lies in a private temporary folder that goes with it, or with the next
start where it was killed. Ctrl+C ends everything.
"""

import argparse
import asyncio
import logging
import random
import secrets
import signal
import socket
import subprocess
import sys
import threading
import webbrowser
from collections.abc import Mapping
from contextlib import closing, suppress
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Final, final

from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import BaseRoute, Route

from thermaxis import files, runtime, virtual
from thermaxis.cli._arguments import adder
from thermaxis.cli.machine.rehearse import build_rehearsal, rehearse
from thermaxis.compensation import CompensationModel, Output, Part, Section
from thermaxis.runtime import CertificateUse, Role, User, opcua, probe_name
from thermaxis.runtime.config import keep_touch_proof
from thermaxis.runtime.history import SqlHistorian
from thermaxis.screen import serve
from thermaxis.screen.access import needs, render
from thermaxis.web import answer_json, object_of, page_of, refuse
from thermaxis.web.work import Work, remove_leftovers

SHIFT_H: Final = 8.0
"""Length of the history that is there at the start. [h]"""
SHIFT_CYCLE_S: Final = 10.0
"""Cycle of the loop in that shift, which takes place in virtual time. [s]"""
WATCHDOG_S: Final = 10.0
"""Without a heartbeat for so long the lathe takes the offset back. [s]"""
RATE_UM_PER_S: Final = 3.0
"""Rate of the correction and of the lathe's axis: what the model asks for at most while time is
fast. [µm/s]"""
FAST: Final = 60.0
"""An hour in a minute. [1]"""
PEOPLE: Final = (Role.VIEWER, Role.OPERATOR, Role.ENGINEER)
"""Users for trial; their names are their roles."""
_EVER: Final = "for 10000d"
_CHIP: Final = "chip"
_TIME: Final = "time"


BREAKS: Final = {
    "sensor": "bad T_spindle_C",
    "network": f"pause {_EVER}",
    "server": f"restart {_EVER}",
    "stop": "set emergency_stop to 1",
    _CHIP: "jump touch_um by 50",
    "loop": "",
    _TIME: "",
}
"""Fault of the lathe by the name of its button; empty where the loop's program is killed, and
where time is made fast."""

_LAGS_S: Final = (169.1, 807.1, 3314.0, 10806.0)
_SPINDLE: Final = tuple(map(Section, (-2.026, -5.082, -11.26, 2.642), _LAGS_S))
_TABLE: Final = tuple(map(Section, (-2.017, 15.76, -1.502, -5.774), _LAGS_S))
_MODEL: Final = CompensationModel(
    outputs=(
        Output(
            "Z_um",
            (
                Part("spindle", "T_spindle_C", "T_column_C", -0.513, _SPINDLE),
                Part("table", "T_table_C", "T_column_C", 0.0, _TABLE),
            ),
        ),
    ),
    longest_hold_s=180.0,
)
"""What `identify` makes of the lathe's calibration tests, as the tutorial shows, rounded."""

_CONFIGURATION: Final = """\
[machine]
name = "demo: virtual lathe"
cycle_s = 1.0
model = "models/{model}"
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
heartbeat_node = "{ns}heartbeat"

[input.T_spindle_C]
name = {{ en = "Spindle", de = "Spindel", cs = "Vřeteno" }}
node = "{ns}T_spindle_C"
{believed}

[input.T_table_C]
name = {{ en = "Table", de = "Tisch", cs = "Stůl" }}
node = "{ns}T_table_C"
{believed}

[input.T_column_C]
name = {{ en = "Column", de = "Ständer", cs = "Stojan" }}
node = "{ns}T_column_C"
{believed}

[interlock.no_emergency_stop]
node = "{ns}emergency_stop"
met = false
name = {{ en = "Emergency stop", de = "Not-Halt", cs = "Nouzové zastavení" }}

[probe.Z_um]
node = "{ns}touch_um"
counter_node = "{ns}touch_count"
unit = "um"
largest_um = 20.0
largest_rate_um_per_s = 0.5
acts = true

[output.Z_um]
node = "{ns}offset_mm"
read_back_node = "{ns}offset_accepted_mm"
effective_node = "{ns}offset_effective_mm"
unit = "mm"
sign = "positive moves the tool away from the workpiece"
largest_um = 280.0
largest_rate_um_per_s = {rate}
largest_trim_um = 20.0

[supervisor]
settle_s = 5.0
stop_within_s = 200.0

[validity]
margin_k = 5.0

[historian]
url = "sqlite:///history.db"

[server]
port = {server}
users = "users.toml"
certificate = "server.der"
private_key = "server.pem"
anonymous_role = "viewer"

[screen]
port = {screen}
client_certificate = "client.der"
client_private_key = "client.pem"
"""
_BELIEVED: Final = """\
unit = "degC"
lowest_c = 5.0
highest_c = 80.0
largest_rate_k_per_s = 1.0"""
_PAGE: Final = """\
{% extends "base.html" %}
{% block title %}{{ word("demo-title") }}{% endblock %}
{% block scripts %}<script type="module" src="/demo/demo.js"></script>{% endblock %}
{% block content %}
<h1>{{ word("demo-title") }}</h1>
<p>{{ word("demo-what") }} <a href="/" target="operator">{{ word("demo-open") }}</a></p>
<p id="demo-told" role="status"></p>
<table>{% for name in breaks %}
<tr><td><button type="button" data-break="{{ name }}" aria-pressed="{{
  'true' if name in broken else 'false' }}">{{ word("demo-" ~ name) }}</button></td>
  <td>{{ word("demo-" ~ name ~ "_follows") }}</td></tr>
{% endfor %}</table>
<h2>{{ word("demo-people") }}</h2>
<table>{% for name, password in passwords.items() %}
<tr><td>{{ name }}</td><td><code>{{ password }}</code></td></tr>
{% endfor %}</table>
{% endblock %}
"""
_SCRIPT: Final = """\
const buttons = document.querySelectorAll("[data-break]");
for (const button of buttons) {
  button.addEventListener("click", async () => {
    const broken = button.getAttribute("aria-pressed") !== "true";
    const body = JSON.stringify({ name: button.dataset.break, broken });
    const answer = await fetch("/demo/break", { method: "POST", body });
    const told = await answer.json();
    document.getElementById("demo-told").textContent = told.text ?? "";
    for (const one of answer.ok ? buttons : []) {
      one.setAttribute("aria-pressed", String(told.broken.includes(one.dataset.break)));
    }
  });
}
document.addEventListener("visibilitychange", () => { if (!document.hidden) location.reload(); });
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of the command."""
    add = adder(parser)
    add("--no-browser", "print the address, open nothing", bool)


def run(arguments: argparse.Namespace) -> int:
    """Run the demo until Ctrl+C."""
    logging.getLogger("asyncua").setLevel(logging.CRITICAL)
    signal.signal(signal.SIGTERM, signal.default_int_handler)  # until the pages have their own
    hung_up = getattr(signal, "SIGHUP", None)  # Windows has none
    if hung_up is not None and signal.getsignal(hung_up) is signal.SIG_DFL:
        signal.signal(hung_up, _end)
    remove_leftovers()
    with closing(Work()) as work:
        folder = work.folder()
        sys.stdout.write(f"a shift of {SHIFT_H:g} h at a virtual lathe is being made ...\n")
        sys.stdout.flush()
        passwords = {str(role.value): secrets.token_hex(4) for role in PEOPLE}
        paces = _make_site(folder.path, passwords)
        demo = _Demo(paces, _shift(paces[1.0]), passwords)
        asyncio.run(demo.live(browser=not arguments.no_browser))
    sys.stdout.write("ended; nothing of it is left\n")
    return 0


def _end(*_: object) -> None:
    signal.raise_signal(signal.SIGTERM)


# ---- before the pages ---------------------------------------------------------------------------


def _make_site(
    folder: Path, passwords: Mapping[str, str]
) -> Mapping[float, runtime.MachineConfiguration]:
    """Write configuration and model, users and certificates; return the configuration by pace.

    They differ in the model's time constants alone: all else keeps to the time of the day.
    """
    ports = dict(zip(("lathe", "server", "screen"), _free_ports(3), strict=True))
    (folder / "models").mkdir()
    users = [User(n, Role(n), runtime.hash_password(word)) for n, word in passwords.items()]
    runtime.write_users(users, folder / "users.toml")
    for use in (CertificateUse.SERVER, CertificateUse.CLIENT):
        new = opcua.NewCertificate(
            application_uri=f"urn:thermaxis:{use.value}", hosts=("127.0.0.1",), use=use
        )
        pair = opcua.make_pair(new, datetime.now(UTC))
        opcua.write_pair(folder / f"{use.value}.der", folder / f"{use.value}.pem", pair)
    paces = dict[float, runtime.MachineConfiguration]()
    for pace, name in ((1.0, "lathe"), (FAST, f"lathe, time x {FAST:g}")):
        files.write_model(_faster(_MODEL, pace), folder / "models" / f"{name}.json")
        text = _CONFIGURATION.format(
            ns="nsu=urn:thermaxis:lathe;s=",
            model=f"{name}.json",
            believed=_BELIEVED,
            rate=RATE_UM_PER_S,
            **ports,
        )
        path = folder / f"{name}.toml"
        path.write_text(text, encoding="utf-8")
        paces[pace] = runtime.read_machine(path)
        keep_touch_proof(paces[pace], "Z_um", proven=True)
    return paces


def _faster(model: CompensationModel, pace: float) -> CompensationModel:
    """Return a model of the same machine where time is faster."""
    (output,) = model.outputs
    parts = (
        replace(
            p,
            sections=tuple(Section(s.gain_um_per_k, s.time_constant_s / pace) for s in p.sections),
        )
        for p in output.parts
    )
    return replace(model, outputs=(replace(output, parts=tuple(parts)),))


def _free_ports(count: int) -> list[int]:
    """Return ports that nobody has, below those that are handed out to connections. [1]"""
    found = list[int]()
    for port in random.SystemRandom().sample(range(20_000, 32_000), 1000):
        with socket.socket() as one, suppress(OSError):
            one.bind(("127.0.0.1", port))
            found.append(port)
        if len(found) == count:
            break
    return found


def _shift(configuration: runtime.MachineConfiguration) -> virtual.VirtualLathe:
    """Let the loop compensate a shift that ends now; return the lathe as it stands then."""
    rules = virtual.OffsetRules(rate_um_per_s=RATE_UM_PER_S, watchdog_s=WATCHDOG_S)
    lathe = virtual.VirtualLathe("verification", settings=virtual.LatheSettings(offset=rules))
    slower = replace(configuration.compensation, cycle_s=SHIFT_CYCLE_S)

    async def play() -> None:
        clock = runtime.VirtualClock(datetime.now(UTC) - timedelta(hours=SHIFT_H))
        historian = SqlHistorian(configuration.historian, clock)
        state = runtime.StateFile(configuration.state_file, every_s=3600.0)
        shift = replace(configuration, compensation=slower)
        names = {**{name: name for name in configuration.inputs}, probe_name("Z_um"): "Z_um"}
        await rehearse(build_rehearsal(shift, lathe, clock, historian, state, names), SHIFT_H)

    runtime.run_in_virtual_time(play())
    return lathe


# ---- the pages and what can be broken -----------------------------------------------------------


@final
class _Demo:
    """Lathe and screen in this program, the loop in another one."""

    def __init__(
        self,
        paces: Mapping[float, runtime.MachineConfiguration],
        lathe: virtual.VirtualLathe,
        passwords: Mapping[str, str],
    ) -> None:
        self.paces, self.lathe, self.passwords = paces, lathe, passwords
        self.configuration = paces[1.0]
        self.broken: list[str] = []
        self._loop: subprocess.Popen[bytes] | None = None
        settings = virtual.LatheServerSettings(port=self.configuration.connections["lathe"].port)
        self._server = virtual.LatheServer(lathe, settings, runtime.SystemClock())

    async def live(self, *, browser: bool) -> None:
        """Serve until a signal asks for the end."""
        running = asyncio.get_running_loop()
        started: asyncio.Future[str] = running.create_future()
        serving = asyncio.create_task(self._server.run(started))

        def tell(address: str) -> None:
            said = [f"  log in as {name}, password {word}" for name, word in self.passwords.items()]
            first = f"demo: {address}demo   operator's page: {address}"
            sys.stdout.write("\n".join([first, *said, "Ctrl+C ends everything", ""]))
            sys.stdout.flush()
            if browser:
                page = (f"{address}demo",)
                threading.Thread(target=webbrowser.open, args=page, daemon=True).start()

        try:
            await asyncio.wait({serving, started}, return_when=asyncio.FIRST_COMPLETED)
            if not started.done():
                await serving  # says why not
            self.lathe.write_heartbeat(self.lathe.axis.heartbeat + 1)  # a start takes its time
            self._start_loop()
            await serve(self.paces[1.0], runtime.SystemClock(), tell, self._routes())
        finally:
            self._kill_loop()
            serving.cancel()
            with suppress(asyncio.CancelledError):
                await serving

    def _routes(self) -> list[BaseRoute]:
        template = page_of(_PAGE)

        @needs(Role.VIEWER, page=True)
        async def page(request: Request) -> Response:
            told = {"breaks": BREAKS, "broken": self.broken, "passwords": self.passwords}
            return render(request, template, page="demo", **told)

        async def breaks(
            request: Request,
        ) -> Response:  # whoever logs in meanwhile: from here alone
            given = await object_of(request)
            name, broken = given.get("name"), given.get("broken")
            if not isinstance(name, str) or name not in BREAKS or not isinstance(broken, bool):
                return refuse(request, 400, "operator-ask_form")
            self._break(name, broken=broken)
            return answer_json({"broken": self.broken})

        async def script(_: Request) -> Response:
            return Response(_SCRIPT, media_type="text/javascript")

        return [
            Route("/demo", page, methods=["GET"]),
            Route("/demo/break", breaks, methods=["POST"]),
            Route("/demo/demo.js", script, methods=["GET"]),
        ]

    def _break(self, name: str, *, broken: bool) -> None:
        """Break something, or mend it."""
        self.broken = [one for one in BREAKS if (broken if one == name else one in self.broken)]
        faults = [BREAKS[one] for one in self.broken]
        self.lathe.set_faults([virtual.parse_fault(f, virtual.FAULTY) for f in faults if f])
        if name == _CHIP:
            self.lathe.ask_touch()
        self._set_pace(FAST if _TIME in self.broken else 1.0)
        if "loop" in self.broken:
            self._kill_loop()
        elif self._loop is None:
            self._start_loop()

    def _set_pace(self, pace: float) -> None:
        """Let the lathe live at a pace, and the loop go on with the model for it where it was."""
        before, now = self.configuration, self.paces[pace]
        if now is before:
            return
        self._kill_loop()
        self._server.set_speed(pace)
        file = runtime.StateFile(now.state_file)
        saved, _ = file.load(before.compensation)
        if saved is not None:  # lags are as far at either pace
            sha256, name = now.model.sha256, now.model.path.name
            file.save(replace(saved, model_sha256=sha256, model_file=name), now.compensation)
        self.configuration = now

    def _start_loop(self) -> None:
        """Let the loop go on as it was left: enabled after the shift, off if somebody disabled."""
        command = ("run", "--quiet", str(self.configuration.path))
        with self.configuration.path.with_name("loop.errors").open("ab") as errors:
            self._loop = subprocess.Popen(  # noqa: S603 - our own program
                [sys.executable, "-m", "thermaxis.cli.machine._with_parent", *command],
                stdin=subprocess.PIPE,
                stderr=errors,
                start_new_session=True,
            )

    def _kill_loop(self) -> None:
        if self._loop is not None:
            self._loop.kill()
            self._loop.communicate()  # closes its pipe too
            self._loop = None
