"""The process beside the loop is believed no more than a stranger, and never waited for."""

import asyncio
import json
import os
import pickle
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable
from contextlib import asynccontextmanager, suppress
from dataclasses import asdict, replace
from datetime import UTC, datetime
from pathlib import Path
from types import SimpleNamespace
from typing import Any, BinaryIO

import pytest
from asyncua import Client, ua

from tests.proofs import quick_first
from tests.unit.runtime.machine_files import machine_file
from tests.unit.runtime.status_server_parts import status, viewers
from thermaxis.codes import Message, Place, value_as_json
from thermaxis.compensation import AnswerCode, Request, RequestKind
from thermaxis.runtime import EventRecord, RequestOutcome, SystemClock, read_machine
from thermaxis.runtime.config import MetricsSettings
from thermaxis.runtime.history import HistoryReader
from thermaxis.runtime.publish import Publisher, _publisher, _servers, serve
from thermaxis.runtime.status import NAMESPACE, StatusServer
from thermaxis.runtime.status._fields import Kind
from thermaxis.runtime.status._requests import Argument
from thermaxis.runtime.status._tree import values_of

READY = b'{"url": "opc.tcp://here", "metrics_port": 0, "unrecorded": null}\n'
ASKED = Request(RequestKind.TRIM, "Eve", output="Z_um", value=1.0, duration_s=60.0)


@pytest.fixture(autouse=True)
def _soon(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(_publisher, "_PAUSE_S", 0.01)
    configured = [("server.certificate", Path("server.pem"))]
    monkeypatch.setattr(_publisher, "certificates_of", lambda _: configured)


def unpickled(data: bytes) -> Any:
    """Return what this test itself, or its copy, has pickled."""
    return pickle.loads(data)  # noqa: S301 - our own


def frame(stream: BinaryIO) -> list[Any]:
    """Return one list that the acting process says; an empty one at the end."""
    header = stream.read(4)
    return unpickled(stream.read(int.from_bytes(header))) if header else []


def frames(connected: socket.socket) -> list[Any]:
    """Return everything that the acting process says until it says no more."""
    found: list[Any] = []
    with connected.makefile("rb") as stream:
        while said := frame(stream):
            found += said
    return found


@asynccontextmanager
async def beside(folder: Path, serve: Callable[[socket.socket], object]) -> Any:
    """Begin a process that serves as is stated, with a loop that says yes to everything."""

    def copied(_configuration: object, _clock: object, connected: socket.socket) -> None:
        connected.setblocking(True)
        connected.sendall(READY)
        serve(connected)

    asked: list[Request] = []

    async def submit(request: Request) -> RequestOutcome:
        asked.append(request)
        return RequestOutcome(accepted=True, code=AnswerCode.ENABLED)

    configuration = read_machine(machine_file(folder))
    historian = replace(configuration.historian, largest_waiting_bytes=200_000)
    one = Publisher(replace(configuration, historian=historian), SystemClock(), copied)
    one.loop = SimpleNamespace(submit=submit, certificates={})
    assert (await one.begin()).url == "opc.tcp://here"
    try:
        yield one, asked
    finally:
        await one.close(1.0)


def event(number: int) -> EventRecord:
    return EventRecord.of(
        datetime.now(UTC), "alarm", "", Message("event-users_readable", {"n": number})
    )


async def test_a_request_comes_to_the_loop_and_its_answer_goes_back(tmp_path: Path) -> None:
    def serve(connected: socket.socket) -> None:
        ends = json.dumps({"certificates": {"server.certificate": "2030-01-01T00:00:00+00:00"}})
        line = json.dumps({"request": asdict(ASKED), "number": 7})
        connected.sendall(f"{ends}\n{line}\n".encode())
        said = frames(connected)
        (tmp_path / "said").write_bytes(pickle.dumps(said))

    async with beside(tmp_path, serve) as (one, asked):
        while not asked:
            await asyncio.sleep(0.01)
        one.event(event(0))
        assert one.loop.certificates == {"server.certificate": datetime(2030, 1, 1, tzinfo=UTC)}
    assert asked == [ASKED]
    answer, told = unpickled((tmp_path / "said").read_bytes())
    assert answer == (7, RequestOutcome(accepted=True, code=AnswerCode.ENABLED))
    assert told.values == {"n": 0}


async def test_many_requests_at_once_are_all_answered(tmp_path: Path) -> None:
    def serve(connected: socket.socket) -> None:
        lines = (json.dumps({"request": asdict(ASKED), "number": n}) for n in range(120))
        connected.sendall("".join(f"{line}\n" for line in lines).encode())
        frames(connected)

    async with beside(tmp_path, serve) as (one, asked):
        while len(asked) < 120:
            await asyncio.sleep(0.01)
        assert one.status.storing


def test_a_text_of_a_call_fits_the_line_that_it_comes_in() -> None:
    texts = [ua.Variant("\N{GRINNING FACE}" * 20_000, ua.VariantType.String)] * 2
    values, wrong = values_of(
        [Argument("one", Kind.TEXT, ""), Argument("two", Kind.TEXT, "")], texts
    )
    assert not wrong
    assert 200 < len(values[0])
    assert len(json.dumps(values)) < 50_000


def failure(values: bytes, code: bytes = b"failure-history_unwritable") -> bytes:
    return b'{"historian": [false, 1, 0, {"code": "%s", "values": %s}]}\n' % (code, values)


@pytest.mark.parametrize(
    "line",
    quick_first(
        4,
        [
            b'{"request": {"kind": "trim", "value": "much"}, "number": 1}\n',
            b'{"certificates": {"server.certificate": "soon"}}\n',
            b'{"certificates": {"nobody.certificate": "2030-01-01T00:00:00+00:00"}}\n',
            b'{"historian": [false, 1%s, 0, null]}\n' % (b"0" * 400),
            b'{"historian": [false, Infinity, 0, null]}\n',
            b'{"historian": [true, 1, -1, null]}\n',
            failure(b'{"lasts_s": 1%s}' % (b"0" * 400)),
            failure(b'{"detail": %s1%s}' % (b'{"a":' * 300, b"}" * 300)),
            failure(b'{"detail": "%s"}' % (b"a" * 5000)),
            failure(b"{}", b"event-enabled"),
            b"[]\n",
            b"[" * 50_000 + b"\n",
            b"[" * 200_000,
        ],
    ),
)
async def test_what_is_no_request_ends_the_process_that_said_it(
    tmp_path: Path, line: bytes
) -> None:
    said = tmp_path / "said"

    def serve(connected: socket.socket) -> None:
        if not said.exists():
            said.touch()
            connected.sendall(line)
            time.sleep(60.0)
        frames(connected)

    async with beside(tmp_path, serve) as (one, asked):
        while one.status.storing:
            await asyncio.sleep(0.01)
        assert one.status.failure == Message("failure-publisher_ended")
        while not one.status.storing:
            await asyncio.sleep(0.01)
    assert asked == []


async def test_why_nothing_is_stored_comes_as_it_was_said(tmp_path: Path) -> None:
    why = Message(
        "failure-history_unwritable",
        {"n": 3, "lasts_s": 1.5, "detail": "no", "why": Message("error-x", {"n": 1})},
        Place(key="historian.url"),
    )

    def serve(connected: socket.socket) -> None:
        line = json.dumps({"historian": (False, 2, 1, value_as_json(why))})
        connected.sendall(f"{line}\n".encode())
        frames(connected)

    async with beside(tmp_path, serve) as (one, _):
        while one.status.storing:
            await asyncio.sleep(0.01)
        assert one.status == (False, 2, 1, why)
        assert type(one.status.failure.values["n"]) is int


async def test_a_process_that_cannot_begin_is_begun_later_and_signals_stay_heard(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    fork, refused = os.fork, [11]
    heard = signal.pthread_sigmask(signal.SIG_BLOCK, [])

    def forked() -> int:
        if refused:
            raise BlockingIOError(refused.pop())
        return fork()

    began = tmp_path / "began"

    def serve(connected: socket.socket) -> None:
        if began.exists():
            frames(connected)
        began.touch()

    async with beside(tmp_path, serve) as (one, _):
        monkeypatch.setattr(os, "fork", forked)
        while one.status.failure != Message("error-publisher_unbegun"):
            await asyncio.sleep(0.001)
        assert signal.pthread_sigmask(signal.SIG_BLOCK, []) == heard
        while not one.status.storing:
            await asyncio.sleep(0.01)


async def test_what_a_killed_process_had_not_stored_is_counted_and_told(tmp_path: Path) -> None:
    first = tmp_path / "first"

    def serve(connected: socket.socket) -> None:
        if not first.exists():
            first.write_text(f"{os.nice(0)} {Path('/proc/self/oom_score_adj').read_text('ascii')}")
            with connected.makefile("rb") as stream:
                while 9 not in [one.values["n"] for one in frame(stream)]:
                    pass
            connected.sendall(b'{"historian": [true, 3, 2, null], "stored": 6}\n')
            time.sleep(60.0)
        (tmp_path / "said").write_bytes(pickle.dumps(frames(connected)))

    async with beside(tmp_path, serve) as (one, _):
        for number in range(10):
            one.event(event(number))
            await asyncio.sleep(0.0)
            await asyncio.sleep(0.0)
        while one.status.lost != 2 or one.status.waiting != 3:
            await asyncio.sleep(0.01)
        os.kill(int(Path("/proc/thread-self/children").read_text("ascii").split()[-1]), 9)
        while one.status.storing:
            await asyncio.sleep(0.001)
        lost = one.status.lost
        while not one.status.storing:
            await asyncio.sleep(0.01)
        one.event(event(11))
    told = unpickled((tmp_path / "said").read_bytes())
    (stated,) = (record.values for record in told if record.kind == "loss")
    assert (lost, stated["events"]) == (2 + 4, 4)
    nice, score = map(int, first.read_text().split())
    assert (nice, score) == (min(19, os.nice(0) + 10), 500)


async def test_it_is_closed_between_two_processes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(_publisher, "_PAUSE_S", 60.0)
    async with beside(tmp_path, lambda _: None) as (one, _):
        while one.status.storing:
            await asyncio.sleep(0.01)
        await one.close(1.0)


async def test_what_a_process_that_stands_still_does_not_take_is_counted_and_told(
    tmp_path: Path,
) -> None:
    goes_on = tmp_path / "go on"

    def serve(connected: socket.socket) -> None:
        while not goes_on.exists():
            time.sleep(0.01)
        told = [one for one in frames(connected) if isinstance(one, EventRecord)]
        (tmp_path / "said").write_bytes(pickle.dumps(told))

    async with beside(tmp_path, serve) as (one, _):
        for number in range(4000):
            one.event(event(number))
            await asyncio.sleep(0.0)
        lost = one.status.lost
        assert 0 < one.status.waiting < 4000 - lost
        goes_on.touch()
        while one.status.waiting:
            await asyncio.sleep(0.01)
    told = unpickled((tmp_path / "said").read_bytes())
    stated = [one for one in told if one.kind == "loss"]
    assert sum(one.values["events"] for one in stated) == lost
    assert len(told) - len(stated) == 4000 - lost
    assert told[-2].values == {"n": 3999} or told[-1].values == {"n": 3999}


@pytest.mark.proof
async def test_a_status_server_that_cannot_tell_is_begun_anew_beside_the_history(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    failed, tell = tmp_path / "failed", StatusServer._tell_changes

    async def fail_once(server: StatusServer, tree: Any, *, everything: bool) -> None:
        if not failed.exists():
            failed.touch()
            raise RuntimeError("a subscription that is broken")
        await tell(server, tree, everything=everything)

    monkeypatch.setattr(StatusServer, "_tell_changes", fail_once)
    monkeypatch.setattr(_servers, "_SERVERS_EVERY", 10**9)  # but at once after the first end
    with socket.create_server(("127.0.0.1", 0)) as free:
        settings = replace(viewers(), port=free.getsockname()[1])
    configuration = replace(read_machine(machine_file(tmp_path)), server=settings)
    one = Publisher(configuration, SystemClock(), serve)
    url = (await one.begin()).url
    while not failed.exists():
        await asyncio.sleep(0.01)
    shown = None
    while shown != "Active":
        one.publish(status())
        with suppress(OSError, ua.UaError):
            async with Client(url) as asking:
                space = await asking.get_namespace_index(NAMESPACE)
                shown = await asking.get_node(ua.NodeId("Status/State", space)).read_value()
    assert one.status.storing, "it lives on"
    await one.close(5.0)
    with HistoryReader(configuration.historian.url) as reader:
        codes = [event.code for event in reader.events()]
    assert codes == ["event-status_server_ended"]


def test_a_server_that_is_not_configured_is_not_loaded() -> None:
    unwanted = {"prometheus_client", "asyncua.server.standard_address_space.standard_address_space"}
    code = f"""
import sys
from thermaxis.runtime.publish import serve
print(sorted({unwanted!r} & set(sys.modules)))
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


async def test_history_is_kept_while_a_server_that_was_begun_anew_cannot_open(
    tmp_path: Path,
) -> None:
    configuration = read_machine(machine_file(tmp_path))
    with socket.create_server(("127.0.0.1", 0)) as free:
        port = free.getsockname()[1]
    metrics = MetricsSettings(address="127.0.0.1", port=port)
    one = Publisher(replace(configuration, metrics=metrics), SystemClock(), serve)
    assert (await one.begin()).metrics_port == port
    child = Path("/proc/thread-self/children").read_text("ascii").split()[-1]
    os.kill(int(child), signal.SIGKILL)
    while one.status.storing:
        await asyncio.sleep(0.01)
    with socket.create_server(("127.0.0.1", port)):
        while not one.status.storing:
            await asyncio.sleep(0.01)
        one.event(event(7))
        await one.close(5.0)
    with HistoryReader(configuration.historian.url) as reader:
        told = {event.code: event.values for event in reader.events()}
    assert told["event-users_readable"] == {"n": 7}
    reason = told["event-server_unopened"]["reason"]
    assert isinstance(reason, Message)
    assert (reason.code, reason.values["port"]) == ("error-cannot_listen", port)
