"""The operator's page with NiceGUI and with starlette and uvicorn: what each costs, side by side.

Both (benchmarks/screen_candidates.py) show the same made-up status every second: state, one axis,
six inputs, two alarms, a trend of three lines of 500 points. Both run at the same time, so that a
busy computer slows both. The viewers are plain clients: of web sockets, and of socket.io for
NiceGUI, which take the page, do the handshake and acknowledge as NiceGUI's own script does. They
draw nothing, and what is measured is the server; what a page does when its server dies, or only
its data stop, is seen in Chromium. Bytes are counted by a relay between browser and server.

    python benchmarks/screen_choice.py [--nicegui-python PYTHON] [--minutes 5] [--viewers 20]

The interpreter that `--nicegui-python` names is of an environment of its own (python -m venv, then
pip install nicegui); without it only our own page is measured. `--minutes 1` is a trial.
"""

import argparse
import asyncio
import json
import os
import shutil
import signal
import socket
import statistics
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, field
from importlib import metadata
from pathlib import Path
from typing import Any
from urllib.error import URLError
from urllib.request import urlopen

from playwright.sync_api import BrowserContext, Error as BrowserError, Page, sync_playwright

CANDIDATES = Path(__file__).with_name("screen_candidates.py")
KILLED_WITH_US = ("setpriv", "--pdeathsig", "KILL")
STARTS = 5
"""Starts of which the median is told. [1]"""
OURS = ("starlette", "uvicorn", "websockets", "jinja2", "plotly")
"""What our own page needs; the packages that they need are counted too."""


def free_port() -> int:
    """Return a port that nobody has. [1]"""
    with socket.socket() as one:
        one.bind(("127.0.0.1", 0))
        return int(one.getsockname()[1])


def rss_mb(pid: int) -> float:
    """Return the memory that a program holds. [MB]"""
    text = Path(f"/proc/{pid}/status").read_text(encoding="ascii")
    return int(text.partition("VmRSS:")[2].split()[0]) * 1024 / 1e6


def cpu_s(pid: int) -> float:
    """Return the processor time that a program has had. [s]"""
    fields = Path(f"/proc/{pid}/stat").read_text(encoding="ascii").rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def packages(needed: Sequence[str], place: Sequence[str]) -> tuple[int, float]:
    """Return how many packages these need, themselves included, and their size. [1], [MB]"""
    found: dict[str, metadata.Distribution] = {}
    installed = {
        str(one.metadata["Name"]).lower().replace("_", "-"): one
        for one in metadata.distributions(path=list(place))
    }
    ahead = [name.lower() for name in needed]
    while ahead:
        name = ahead.pop().replace("_", "-")
        if name in found or name not in installed:
            continue
        found[name] = installed[name]
        for text in found[name].requires or []:
            requirement, _, marker = text.partition(";")
            if "extra" not in marker:
                ahead.append(_name_of(requirement))
    files = [
        Path(str(file.locate()))
        for one in found.values()
        for file in one.files or []
        if not file.name.endswith(".pyc")
    ]
    return len(found), sum(file.stat().st_size for file in files if file.is_file()) / 1e6


def _name_of(requirement: str) -> str:
    end = next((k for k, c in enumerate(requirement) if c in " [<>=!~("), len(requirement))
    return requirement[:end].strip().lower()


class Relay:
    """Passes bytes on between browser and server, and counts those that the server sent."""

    def __init__(self, to: int) -> None:
        self.to, self.sent = to, 0
        self.port = 0
        self._ready = threading.Event()
        self._loop = asyncio.new_event_loop()
        threading.Thread(target=self._live, daemon=True).start()
        self._ready.wait(10.0)

    def _live(self) -> None:
        async def begin() -> None:
            server = await asyncio.start_server(self._pass, "127.0.0.1", 0)
            self.port = server.sockets[0].getsockname()[1]
            self._ready.set()

        self._loop.run_until_complete(begin())
        self._loop.run_forever()

    async def _pass(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        try:
            there, back = await asyncio.open_connection("127.0.0.1", self.to)
        except OSError:
            writer.close()
            return
        first = asyncio.create_task(self._copy(reader, back, count=False))
        second = asyncio.create_task(self._copy(there, writer, count=True))
        await asyncio.wait({first, second}, return_when=asyncio.FIRST_COMPLETED)
        for task in (first, second):
            task.cancel()
        for end in (back, writer):
            end.close()

    async def _copy(
        self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter, *, count: bool
    ) -> None:
        try:
            while found := await reader.read(65536):
                self.sent += len(found) if count else 0
                writer.write(found)
                await writer.drain()
        except OSError:
            return


@dataclass
class Candidate:
    """One of the two, running or not."""

    kind: str
    """own or nicegui."""
    python: str
    """Its interpreter."""
    folder: Path
    """Where it notes things."""
    found: dict[str, float | str] = field(default_factory=dict)
    """What was measured, by sentence."""

    def __post_init__(self) -> None:
        self.port, self.held = free_port(), self.folder / f"{self.kind}.held"
        self.relay = Relay(self.port)
        self.popen: subprocess.Popen[bytes] | None = None
        self.viewers: subprocess.Popen[str] | None = None

    @property
    def server(self) -> subprocess.Popen[bytes]:
        """The server that runs."""
        if self.popen is None:
            raise RuntimeError(f"{self.kind} was not started")
        return self.popen

    def launch(self, *arguments: str, python: str = "", **more: Any) -> subprocess.Popen[Any]:
        """Start a program of the candidates; it ends with this one."""
        command = [*KILLED_WITH_US, python or self.python, str(CANDIDATES), *arguments]
        errors = (self.folder / f"{self.kind}.errors").open("ab")
        with errors:
            return subprocess.Popen(command, cwd=self.folder, stderr=errors, **more)

    def start(self, policy: str = "") -> float:
        """Start the server; return how long it took to serve its page. [s]"""
        began_s = time.monotonic()
        self.popen = self.launch(self.kind, str(self.port), str(self.held), policy)
        while True:
            try:
                with urlopen(f"http://127.0.0.1:{self.port}/") as answer:
                    answer.read()
                return time.monotonic() - began_s
            except (URLError, ConnectionError):
                if self.popen.poll() is not None or time.monotonic() - began_s > 60.0:
                    errors = (self.folder / f"{self.kind}.errors").read_text(encoding="utf-8")
                    raise RuntimeError(f"{self.kind} does not start: {errors[-2000:]}") from None
                time.sleep(0.01)

    def kill(self) -> None:
        """End the server at once."""
        if self.popen is not None:
            self.popen.kill()
            self.popen.wait(10.0)

    def look(self, python: str, viewers: int) -> None:
        """Let so many viewers look."""
        self.viewers = self.launch(
            f"view-{self.kind}",
            str(self.port),
            str(viewers),
            python=python,
            stdout=subprocess.PIPE,
            text=True,
        )

    def end_viewers(self) -> tuple[int, int]:
        """End the viewers; return the fewest updates that one had, and those of all. [1]"""
        if self.viewers is None:
            raise RuntimeError("nobody looked")
        self.viewers.terminate()
        said = self.viewers.communicate(timeout=10.0)[0].splitlines()
        fewest, every = json.loads(said[-1])
        return int(fewest), int(every)

    def end(self) -> None:
        """End everything of it."""
        for one in (self.popen, self.viewers):
            if one is not None and one.poll() is None:
                one.kill()
                one.wait(10.0)


def wait_for(what: str, condition: Callable[[], bool], limit_s: float = 60.0) -> float:
    """Wait until something is so; return how long it took. [s]"""
    began_s = time.monotonic()
    while not condition():
        if time.monotonic() - began_s > limit_s:
            raise RuntimeError(f"not within {limit_s:g} s: {what}")
        time.sleep(0.02)
    return time.monotonic() - began_s


def measure_cost(candidates: Sequence[Candidate], viewer_python: str, arguments: Any) -> None:
    """Measure starts, memory, its growth and processor time, all at the same time."""
    for one in candidates:
        starts: list[float] = []
        for _ in range(STARTS):
            one.kill()
            starts.append(one.start())
        one.found["start to the first page [s]"] = statistics.median(starts)
    time.sleep(3.0)
    for one in candidates:
        one.found["memory after one page [MB]"] = rss_mb(one.server.pid)
        one.look(viewer_python, arguments.viewers)
    time.sleep(15.0)
    before = {
        one.kind: (rss_mb(one.server.pid), cpu_s(one.server.pid), time.monotonic())
        for one in candidates
    }
    time.sleep(60.0 * arguments.minutes)
    for one in candidates:
        rss, cpu, at_s = before[one.kind]
        spent_s, lasted_s = cpu_s(one.server.pid) - cpu, time.monotonic() - at_s
        one.found[f"memory with {arguments.viewers} viewers [MB]"] = rss
        one.found[f"growth in {arguments.minutes:g} min [%]"] = 100.0 * (
            rss_mb(one.server.pid) / rss - 1
        )
        shown = lasted_s * arguments.viewers
        one.found["processor time for one update of one viewer [ms]"] = 1e3 * spent_s / shown
    for one in candidates:
        fewest, every = one.end_viewers()
        one.found["updates of the slowest viewer, each second [1]"] = fewest / (
            60.0 * arguments.minutes + 15.0
        )
        one.found["updates of all viewers [1]"] = every


def number_on(page: Page) -> str:
    """Return the number that a page shows; empty while it shows none."""
    try:
        return str(page.locator("#said").first.text_content(timeout=500) or "")
    except BrowserError:
        return ""


def age_on(page: Page) -> str:
    """Return whether a page says that it has data."""
    try:
        return str(page.locator("#age").first.text_content(timeout=500) or "")
    except BrowserError:
        return ""


def measure_page(one: Candidate, context: BrowserContext, url: str) -> None:
    """See what the page costs on the wire, and what it does without its server or its data."""
    page = context.new_page()
    reloads: list[str] = []
    page.on("framenavigated", lambda frame: reloads.append(frame.url))
    before = one.relay.sent
    page.goto(url)
    wait_for("a first number", lambda: number_on(page) != "")
    page.wait_for_load_state("networkidle" if one.kind == "own" else "load")
    page.wait_for_selector(".main-svg")
    opened = one.relay.sent - before
    first, began = number_on(page), one.relay.sent
    wait_for("ten updates", lambda: int(number_on(page)) >= int(first) + 10)
    one.found["bytes to open the page [kB]"] = opened / 1e3
    one.found["bytes of one update [B]"] = (one.relay.sent - began) / 10.0

    one.held.touch()
    one.found["only the data stop: the page says so after [s]"] = _seen(
        lambda: age_on(page) == "NO DATA", 15.0
    )
    one.held.unlink()
    wait_for("data again", lambda: age_on(page) == "data")

    one.server.send_signal(signal.SIGSTOP)
    told = _seen(lambda: age_on(page) == "NO DATA" or _popup(page), 20.0)
    one.server.send_signal(signal.SIGCONT)
    one.found["the server stands still (SIGSTOP): the page says so after [s]"] = told
    wait_for("data after it goes on", lambda: age_on(page) == "data")
    time.sleep(2.0)

    reloads.clear()
    one.kill()
    told = _seen(lambda: age_on(page) == "NO DATA" or _popup(page), 20.0)
    one.found["the server is killed: the page says so after [s]"] = told
    one.start()
    came = _seen(lambda: age_on(page) == "data" and int(number_on(page) or 9999) < 530, 60.0)
    one.found["... and shows new values so long after it serves again [s]"] = came
    one.found["... the page loaded itself anew [times]"] = len(reloads)
    page.close()


def _popup(page: Page) -> bool:
    """Whether NiceGUI's page says that its connection is lost."""
    try:
        return bool(
            page.evaluate("document.getElementById('popup')?.getAttribute('aria-hidden')==='false'")
        )
    except BrowserError:
        return False


def _seen(condition: Callable[[], bool], limit_s: float) -> float | str:
    try:
        return wait_for("", condition, limit_s)
    except RuntimeError:
        return f"not within {limit_s:g} s"


POLICIES = {
    "strict": "default-src 'self'; style-src 'self' 'unsafe-inline'; img-src 'self' data:",
    "and inline scripts": (
        "default-src 'self'; script-src 'self' 'unsafe-inline';"
        " style-src 'self' 'unsafe-inline'; img-src 'self' data:"
    ),
    "and eval": (
        "default-src 'self'; script-src 'self' 'unsafe-inline' 'unsafe-eval';"
        " style-src 'self' 'unsafe-inline'; img-src 'self' data:"
    ),
}
"""Content security policies from strict to lax."""


def measure_policy(one: Candidate, context: BrowserContext, url: str) -> None:
    """Find the strictest policy under which the page shows values and its trend."""
    for name, policy in POLICIES.items():
        one.kill()
        one.start(policy)
        page = context.new_page()
        page.goto(url)
        shown = _seen(lambda page=page: number_on(page) != "" and _drawn(page), 10.0)
        page.close()
        if isinstance(shown, float):
            one.found["strictest policy under which it works"] = name
            return
    one.found["strictest policy under which it works"] = "none of them"


def _drawn(page: Page) -> bool:
    return page.locator("#trend .main-svg, .js-plotly-plot .main-svg").count() > 0


def show(candidates: Sequence[Candidate]) -> None:
    """Print what was measured, and the ratio."""
    own = candidates[0].found
    print(f"{'':62}" + "".join(f"{one.kind:>20}" for one in candidates) + f"{'ratio':>8}")
    for name in own:
        cells = [one.found.get(name, "") for one in candidates]
        line = "".join(f"{_cell(cell):>20}" for cell in cells)
        both = [cell for cell in cells if isinstance(cell, int | float)]
        ratio = f"{both[1] / both[0]:.1f}" if len(both) == 2 and both[0] > 0 else ""
        print(f"{name:62}{line}{ratio:>8}")


def _cell(cell: float | str) -> str:
    if isinstance(cell, str):
        return cell
    return f"{cell:.3f}" if abs(cell) < 1 else f"{cell:.1f}" if abs(cell) < 1e4 else f"{cell:.0f}"


def main() -> int:
    """Measure both and print them side by side."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--nicegui-python", metavar="PYTHON", help="interpreter with NiceGUI")
    parser.add_argument("--minutes", type=float, default=5.0, help="time of growth (default: 5)")
    parser.add_argument("--viewers", type=int, default=20, help="viewers of each (default: 20)")
    arguments = parser.parse_args()
    other = arguments.nicegui_python
    with tempfile.TemporaryDirectory() as name, ExitStack() as stack:
        candidates = [Candidate("own", sys.executable, Path(name))]
        if other:
            candidates.append(Candidate("nicegui", other, Path(name)))
        for one in candidates:
            stack.callback(one.end)
        candidates[0].found |= _sizes(OURS, sys.executable)
        if other:
            candidates[1].found |= _sizes(("nicegui",), other)
        measure_cost(candidates, other or sys.executable, arguments)
        with sync_playwright() as playwright:
            browser = playwright.chromium.launch(
                executable_path=shutil.which("chromium"), args=["--no-sandbox"]
            )
            for one in candidates:
                context = browser.new_context()
                measure_page(one, context, f"http://127.0.0.1:{one.relay.port}/")
                context.close()
                context = browser.new_context()
                measure_policy(one, context, f"http://127.0.0.1:{one.port}/")
                context.close()
            browser.close()
        show(candidates)
    return 0


def _sizes(needed: Sequence[str], python: str) -> dict[str, float | str]:
    place = subprocess.run(
        [python, "-c", "import json, sys; print(json.dumps([p for p in sys.path if p]))"],
        check=True,
        capture_output=True,
        text=True,
    ).stdout
    count, size = packages(needed, json.loads(place))
    return {"packages [1]": count, "installed size [MB]": size}


if __name__ == "__main__":
    sys.exit(main())
