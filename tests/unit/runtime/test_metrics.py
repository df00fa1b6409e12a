"""Figures for Prometheus: what the page says, and who gets it."""

import asyncio
import contextlib
import json
import math
import socket
import ssl
from collections.abc import AsyncIterator
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from hypothesis import given, strategies as st
from prometheus_client import generate_latest
from prometheus_client.parser import text_string_to_metric_families

from tests.scenes import scene
from tests.unit.runtime.status_server_parts import (
    FAULTY,
    NOW,
    HandClock,
    Pair,
    alarm,
    offsets,
    output,
    status,
)
from thermaxis.codes import Message
from thermaxis.compensation import SupervisorState
from thermaxis.errors import ConfigurationError
from thermaxis.runtime import (
    HistorianStatus,
    MetricsServer,
    MetricsSettings,
    RuntimeStatus,
    Secret,
)
from thermaxis.runtime.status import _metrics, as_json
from thermaxis.runtime.status._metrics import metrics_of

TOKEN = "0123456789abcdef0123"  # noqa: S105 - of tests only


@pytest.fixture(scope="module")
def pair(tmp_path_factory: pytest.TempPathFactory) -> Pair:
    return Pair(tmp_path_factory.mktemp("metrics"), "metrics")


def parsed(page: str) -> dict[tuple[str, frozenset[tuple[str, str]]], float]:
    """Read a page with the reader of the format's makers."""
    return {
        (sample.name.removeprefix("thermaxis_"), frozenset(sample.labels.items())): sample.value
        for family in text_string_to_metric_families(page)
        for sample in family.samples
    }


def page_of(told: RuntimeStatus | None, age_s: float = 0.5) -> str:
    return generate_latest(SimpleNamespace(collect=lambda: metrics_of(told, age_s))).decode()


def figures(told: RuntimeStatus | None, age_s: float = 0.5) -> dict[Any, float]:
    return parsed(page_of(told, age_s))


def at(name: str, **labels: str) -> tuple[str, frozenset[tuple[str, str]]]:
    return name, frozenset(labels.items())


# ---- the page ---------------------------------------------------------------------------------


def test_the_page_says_what_the_status_says() -> None:
    found = figures(status(alarms=(alarm(), alarm(key="other"))))
    assert found[at("up")] == 1.0
    assert found[at("status_age_seconds")] == 0.5
    assert found[at("cycles_total")] == 28_800.0
    assert found[at("overruns_total")] == 3.0
    assert found[at("computed_micrometres", output="Z_um")] == -12.5
    assert found[at("commanded_micrometres", output="Z_um")] == -12.5
    assert found[at("commanded_age_seconds", output="Z_um")] == 0.1
    assert found[at("acting_micrometres", output="Z_um")] == -12.0
    assert found[at("acting_known", output="Z_um")] == 1.0
    assert found[at("accepted_micrometres", output="Z_um")] == -12.4
    assert found[at("effective_micrometres", output="Z_um")] == -12.0
    assert found[at("input_celsius", channel="T_spindle_C")] == 31.5
    assert found[at("input_age_seconds", channel="T_spindle_C")] == 0.25
    assert found[at("alarms", priority="medium")] == 2.0
    assert found[at("alarms", priority="critical")] == 0.0
    assert found[at("workpiece_diameter_millimetres")] == 1500.0
    assert found[at("start_time_seconds")] == NOW.timestamp() - 8 * 3600.0
    about = at("loop", machine="vertical lathe", model="lathe.json", model_sha256="ab" * 32)
    assert found[about] == 1.0


def test_one_state_is_one_and_the_others_are_zero() -> None:
    for state in SupervisorState:
        found = figures(status(output=output(state=state)))
        states = {s: found[at("state", state=s.value)] for s in SupervisorState}
        assert states == {s: float(s is state) for s in SupervisorState}


def test_figures_and_json_agree_on_every_number_that_both_have() -> None:
    told = status(
        **FAULTY,
        historian=HistorianStatus(False, 7, 2, Message("failure-historian_ended")),
        diameter_mm=None,
    )
    found, whole = figures(told), json.loads(as_json(told))
    for key, name in (
        ("correction_um", "computed_micrometres"),
        ("wanted_um", "wanted_micrometres"),
        ("accepted_um", "accepted_micrometres"),
        ("model_um", "model_micrometres"),
        ("weight", "weight_ratio"),
        ("trim_um", "trim_micrometres"),
    ):
        assert found[at(name, output="Z_um")] == whole["outputs"]["Z_um"][key]
    for channel, entry in whole["inputs"].items():
        assert found.get(at("input_celsius", channel=channel)) == entry["value_c"]
        assert found[at("input_good", channel=channel)] == float(entry["quality"] == "good")
    assert found[at("historian_waiting_records")] == whole["historian"]["waiting"]
    assert found[at("historian_lost_records_total")] == whole["historian"]["lost"]
    assert at("workpiece_diameter_millimetres") not in found


def test_the_end_of_a_certificate_is_a_time_since_1970() -> None:
    found = figures(status(certificates={"metrics.certificate": NOW}))
    name = at("certificate_expiry_timestamp_seconds", certificate="metrics.certificate")
    assert found[name] == NOW.timestamp()


def test_what_the_machine_does_not_say_is_absent_and_not_zero() -> None:
    found = figures(status(offsets={"Z_um": offsets(-12.5, None, None)}))
    assert at("accepted_micrometres", output="Z_um") not in found
    assert at("effective_micrometres", output="Z_um") not in found
    assert at("accepted_micrometres", output="Z_um") not in figures(status(offsets={}))
    unreachable = figures(status(sink_connected=False))
    assert at("acting_micrometres", output="Z_um") not in unreachable, "its watchdog may act"
    assert unreachable[at("acting_known", output="Z_um")] == 0.0


def test_before_the_first_cycle_the_page_says_so() -> None:
    assert figures(None) == {at("up"): 0.0}


@given(st.text(max_size=60), st.text(min_size=1, max_size=60), st.floats())
def test_any_text_and_any_number_make_a_page_that_can_be_read(
    machine: str, name: str, value: float
) -> None:
    told = status(name, machine=machine, output=output(correction_um=(value,)))
    page = page_of(told, 0.0)
    found = parsed(page)
    read = [v for (n, _), v in found.items() if n == "computed_micrometres"]
    assert read == ([value] if math.isfinite(value) else [])
    assert sum(n == "loop" for n, _ in found) == 1
    names = {metric.name for metric in metrics_of(told, 0.0)}
    # one line for each sample, one each for the help and the type of every metric
    assert page.count("\n") == len(found) + 2 * len(names)


# ---- the server -------------------------------------------------------------------------------


def settings(**changes: Any) -> MetricsSettings:
    return replace(MetricsSettings(port=0), **changes)


@contextlib.asynccontextmanager
async def serving(of: MetricsSettings | None = None) -> AsyncIterator[MetricsServer]:
    clock = HandClock()
    server = MetricsServer(of or settings(), clock)
    await server.open()
    server.publish(status())
    clock.now_s += 2.5
    try:
        yield server
    finally:
        await server.close()


async def exchange(
    server: MetricsServer, request: bytes, tls: ssl.SSLContext | None = None
) -> tuple[str, dict[str, str], str]:
    """Send a request; return the first line, the header and the body."""
    reader, writer = await asyncio.open_connection("127.0.0.1", server.port, ssl=tls)
    writer.write(request)
    answer = await reader.read()
    writer.close()
    await writer.wait_closed()
    head, _, body = answer.decode().partition("\r\n\r\n")
    first, *rest = head.split("\r\n")
    return first, dict(line.split(": ", 1) for line in rest), body


def get(path: str = "/metrics", *lines: str, method: str = "GET", host: str = "localhost") -> bytes:
    return "\r\n".join([f"{method} {path} HTTP/1.1", f"Host: {host}", *lines, "", ""]).encode()


@scene
async def test_the_page_is_served_over_http(monkeypatch: pytest.MonkeyPatch) -> None:
    # to search for the computer's name takes long where nobody knows it
    monkeypatch.setattr(socket, "getfqdn", lambda *_: pytest.fail("nobody's name is searched for"))
    async with serving() as server:
        first, header, body = await exchange(server, get())
        assert first == "HTTP/1.0 200 OK"
        assert header["Content-Type"] == "text/plain; version=0.0.4; charset=utf-8"
        assert int(header["Content-Length"]) == len(body.encode())
        assert parsed(body) == figures(status(), 2.5)


ASKED = (
    (get("/"), "404"),
    (get("/metrics/../secrets"), "404"),
    (get(method="POST"), "405"),
    (b"\xff\xfe\x00 \x80 HTTP/1.1\r\nHost: localhost\r\n\r\n", "404"),
    (get("/metrics", f"X: {'a' * 70_000}"), "431"),
    (get("/metrics", *("X: a" for _ in range(200))), "431"),
    (b"GET /metrics HTTP/1.0\r\n\r\n", "421"),
    (get(host="evil.example"), "421"),
    (get(host="127.0.0.1.evil.example:80"), "421"),
    (get(host="[::1"), "421"),
    (get(host="127.0.0.1:9180"), "200"),
    (get(host="[::1]:9180"), "200"),
)


@scene
async def test_anything_else_is_refused() -> None:
    async with serving() as server:
        for sent, answer in ASKED:
            first, _, body = await exchange(server, sent)
            assert first.startswith(f"HTTP/1.0 {answer} "), sent
            assert answer == "200" or "thermaxis_" not in body


@scene
async def test_a_token_is_asked_for_where_one_is_set() -> None:
    async with serving(settings(token=Secret(TOKEN))) as server:
        for line in (
            "X: y",
            "Authorization: Bearer ",
            f"Authorization: Bearer {TOKEN[:-1]}",
            f"Authorization: Bearer {TOKEN}x",
            f"Authorization: Basic {TOKEN}",
            "Authorization: Bearer \xff\xff",
        ):
            first, header, body = await exchange(server, get("/metrics", line))
            assert first == "HTTP/1.0 401 Unauthorized"
            assert header["WWW-Authenticate"] == "Bearer"
            assert "thermaxis_" not in body
            assert TOKEN not in body
        right = get("/metrics", f"authorization: Bearer {TOKEN}")
        first, _, body = await exchange(server, right)
        assert first == "HTTP/1.0 200 OK"
        assert "thermaxis_up 1.0" in body


@scene
async def test_the_page_is_served_over_tls_and_not_without_it(pair: Pair) -> None:
    of = settings(token=Secret(TOKEN), certificate=pair.pem, private_key=pair.key)
    context = ssl.create_default_context(cafile=str(pair.pem))
    async with serving(of) as server:
        right = get("/metrics", f"Authorization: Bearer {TOKEN}")
        first, _, body = await exchange(server, right, context)
        assert first == "HTTP/1.0 200 OK"
        assert "thermaxis_up 1.0" in body
        plain = ""
        with contextlib.suppress(ConnectionError):
            plain, _, _ = await exchange(server, right)
        assert plain == ""


@scene
async def test_a_client_that_is_silent_is_left_after_a_while(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(_metrics._Handler, "timeout", 0.05)

    async with serving() as server:
        for begin in (b"", b"GET /metrics HTTP/1.1\r\nHost: local"):
            reader, writer = await asyncio.open_connection("127.0.0.1", server.port)
            writer.write(begin)
            with contextlib.suppress(ConnectionError):
                assert await reader.read() == b""
            writer.close()
        assert (await exchange(server, get()))[0] == "HTTP/1.0 200 OK"


@scene
async def test_connections_are_bounded_and_a_freed_place_is_free() -> None:
    async with serving() as server:
        held = [
            await asyncio.open_connection("127.0.0.1", server.port)
            for _ in range(_metrics.MOST_CONNECTIONS)
        ]
        async with asyncio.timeout(10.0):
            while server._server._free._value > 0:
                await asyncio.sleep(0.001)
        reader, writer = await asyncio.open_connection("127.0.0.1", server.port)
        async with asyncio.timeout(_metrics.SILENT_S / 2.0):
            assert await reader.read() == b""  # at once, not for want of a request
        writer.close()
        for _, one in held:
            one.close()
        async with asyncio.timeout(10.0):
            while server._server._free._value < len(held):
                await asyncio.sleep(0.001)
        assert (await exchange(server, get()))[0] == "HTTP/1.0 200 OK"


@scene
async def test_the_end_does_not_wait_for_somebody_who_keeps_silent() -> None:
    async with serving() as server:
        _, writer = await asyncio.open_connection("127.0.0.1", server.port)
        async with asyncio.timeout(10.0):
            while server._server._free._value == _metrics.MOST_CONNECTIONS:
                await asyncio.sleep(0.001)
        async with asyncio.timeout(_metrics.SILENT_S / 2.0):
            await server.close()
        assert server.port == 0
        writer.close()


def test_settings_that_would_show_the_figures_to_everybody_are_refused() -> None:
    token, outside = {"token": Secret(TOKEN)}, {"address": "10.0.0.1"}
    pair_of_files = {"certificate": Path("a"), "private_key": Path("b")}
    for changes, code in (
        ({"address": "0.0.0.0"}, "token_needed"),  # noqa: S104 - named, not bound
        ({**outside, **token}, "token_needed"),
        ({**outside, **pair_of_files}, "token_needed"),
        ({"certificate": Path("a")}, "pair_incomplete"),
        ({"private_key": Path("b")}, "pair_incomplete"),
        ({"token": Secret("short")}, "token_unusable"),
        ({"token": Secret("a token with a line\nend")}, "token_unusable"),
        ({"token": Secret("ž" * 20)}, "token_unusable"),
    ):
        with pytest.raises(ConfigurationError) as caught:
            settings(**changes)
        assert caught.value.code == code
        assert "token" not in changes or changes["token"].reveal() not in str(caught.value)
    for changes in (token, {}, {**outside, **token, **pair_of_files}):
        settings(**changes)


@scene
async def test_a_port_or_a_certificate_that_cannot_be_used_is_said_in_words(pair: Pair) -> None:
    async with serving() as server:
        taken = MetricsServer(settings(port=server.port), HandClock())
        with pytest.raises(ConfigurationError) as caught:
            await taken.open()
        assert caught.value.code == "cannot_listen"
        await taken.close()
    swapped = MetricsServer(settings(certificate=pair.key, private_key=pair.key), HandClock())
    with pytest.raises(ConfigurationError) as caught:
        await swapped.open()
    assert caught.value.code == "pair_unusable"
    await swapped.close()
