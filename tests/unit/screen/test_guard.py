"""What the guard before every page lets through, and what it tells browsers."""

import asyncio
import contextlib
import json
from collections.abc import AsyncIterator, Callable, Iterable

import httpx2 as httpx
import pytest
from hypothesis import example, given, strategies as st
from starlette.applications import Starlette
from starlette.requests import Request
from starlette.responses import JSONResponse, PlainTextResponse, Response, StreamingResponse
from starlette.routing import Route, WebSocketRoute
from starlette.types import ASGIApp, Message, Scope
from starlette.websockets import WebSocket

from tests.scenes import scene
from thermaxis.app.axis import AxisRoom
from thermaxis.app.thermal import ThermalRoom
from thermaxis.runtime import run_in_virtual_time
from thermaxis.web import Guard
from thermaxis.web._guard import BODY_S, LARGEST_BODY_BYTES

HOSTS = ("127.0.0.1:8450", "localhost:8450", "[::1]:8450", "lathe-3.shop:8450")
HERE = "http://127.0.0.1:8450"
UPLOAD = "/positioning/upload"


async def echo(request: Request) -> Response:
    """Say how many bytes came."""
    return JSONResponse({"bytes": len(await request.body())})


async def deaf(request: Request) -> Response:
    """Answer without a look at the body."""
    return PlainTextResponse("as you wish")


async def stream(request: Request) -> Response:
    """Read the body part by part, and keep none of it."""
    count = 0
    async for part in request.stream():
        count += len(part)
    return JSONResponse({"bytes": count})


async def obstinate(request: Request) -> Response:
    """Swallow whatever goes wrong with the body."""
    with contextlib.suppress(Exception):
        await request.body()
    return PlainTextResponse("all is well")


async def early(request: Request) -> Response:
    """Begin the answer before the body has come."""

    async def parts() -> AsyncIterator[bytes]:
        yield b"begun"
        yield str(len(await request.body())).encode()

    return StreamingResponse(parts())


async def own_policy(request: Request) -> Response:
    headers = {"Content-Security-Policy": "sandbox", "X-Content-Type-Options": "whatever"}
    return Response(b"report", headers=headers)


async def asset(request: Request) -> Response:
    return Response(b"{}", headers={"Cache-Control": "public, max-age=31536000, immutable"})


async def live(socket: WebSocket) -> None:
    await socket.accept()
    await socket.send_text("hello")
    await socket.close()


def pages() -> Starlette:
    both = ["GET", "POST", "DELETE", "OPTIONS", "TRACE", "PUT", "PATCH"]
    return Starlette(
        routes=[
            Route("/", echo, methods=both),
            Route("/deaf", deaf, methods=both),
            Route("/stream", stream, methods=both),
            Route("/obstinate", obstinate, methods=both),
            Route("/early", early, methods=both),
            Route(UPLOAD, stream, methods=both),
            Route("/positioning/report/{name}", own_policy),
            Route("/static/{name:path}", asset),
            Route("/elsewhere", asset),
            WebSocketRoute("/live", live),
        ]
    )


def guarded(*, secure: bool = False, hosts: Iterable[str] = HOSTS) -> Guard:
    return Guard(pages(), tuple(hosts), secure=secure, largest_bytes=AxisRoom.largest_bytes)


def ask(
    method: str = "GET",
    path: str = "/",
    *,
    host: str | None = "127.0.0.1:8450",
    secure: bool = False,
    content: object = None,
    **headers: str,
) -> httpx.Response:
    """Send one request through httpx."""

    async def scene() -> httpx.Response:
        scheme = "https" if secure else "http"
        transport = httpx.ASGITransport(guarded(secure=secure))
        async with httpx.AsyncClient(transport=transport, base_url=f"{scheme}://x") as client:
            asked = {"host": host, **{k.replace("_", "-"): v for k, v in headers.items()}}
            return await client.request(method, path, headers=asked, content=content)

    return asyncio.run(scene())


def scope_of(
    headers: list[tuple[bytes, bytes]],
    *,
    kind: str = "http",
    method: str = "GET",
    path: str = "/",
    **more: object,
) -> Scope:
    whole: Scope = {
        "type": kind,
        "asgi": {"version": "3.0"},
        "http_version": "1.1",
        "method": method,
        "scheme": "http",
        "path": path,
        "raw_path": path.encode(),
        "query_string": b"",
        "root_path": "",
        "headers": headers,
        "client": ("127.0.0.1", 1),
        "server": ("127.0.0.1", 8450),
    }
    return {**whole, **more}


def told(
    app: ASGIApp, scope: Scope, parts: Iterable[bytes] = (), *, ends: bool = True
) -> list[Message]:
    """Run the application with raw ASGI messages; return what it sent."""
    waiting: list[Message] = []
    if scope["type"] == "websocket":
        waiting.append({"type": "websocket.connect"})
    else:
        waiting += [{"type": "http.request", "body": part, "more_body": True} for part in parts]
        if ends:
            waiting.append({"type": "http.request", "body": b"", "more_body": False})
    sent: list[Message] = []

    async def receive() -> Message:
        if waiting:
            return waiting.pop(0)
        await asyncio.sleep(3600.0)
        return {"type": "http.disconnect"}

    async def send(message: Message) -> None:
        sent.append(message)

    run_in_virtual_time(app(scope, receive, send))
    return sent


def status_of(sent: list[Message]) -> int:
    starts = [m["status"] for m in sent if m["type"].endswith("response.start")]
    assert len(starts) == 1, sent
    return starts[0]


def headers_of(sent: list[Message]) -> dict[str, str]:
    found = next(m["headers"] for m in sent if m["type"].endswith("response.start"))
    names = [key for key, _ in found]
    assert len(names) == len(set(names)), "a header stands twice"
    return {key.decode(): value.decode() for key, value in found}


GOOD_HOST = (b"host", b"127.0.0.1:8450")
GOOD_ORIGIN = (b"origin", HERE.encode())


# ---- the name of the server ---------------------------------------------------------------------


def test_what_a_proxy_hands_on_must_call_the_server_by_a_name_that_is_stated_for_others() -> None:
    who = ("X-Real-IP", "X-Client-IP", "True-Client-IP", "CF-Connecting-IP")
    for name in ("X-Forwarded-For", "x_forwarded_proto", "Forwarded", "Via", *who):
        for host in HOSTS:
            answer = ask(host=host, **{name: "10.0.0.9"})
            assert answer.status_code == (200 if "shop" in host else 421), (name, host)


def test_a_port_that_is_left_out_is_that_of_the_scheme() -> None:
    for host, secure, known in (
        ("lathe", False, "lathe:80"),
        ("lathe:443", True, "lathe"),
        ("lathe", False, "lathe"),
    ):
        scope = scope_of([(b"host", host.encode())])
        assert status_of(told(guarded(secure=secure, hosts=(known,)), scope)) == 200
        other = told(guarded(secure=not secure, hosts=(known,)), scope)
        assert status_of(other) == (200 if host == known else 421)


@pytest.mark.parametrize("known", ["", "http://x", "[::1", "x:999999", "a; b"])
def test_a_configured_name_that_is_none_is_an_error(known: str) -> None:
    with pytest.raises(ValueError, match="no name of a host"):
        guarded(hosts=(known,))


@given(
    st.text(max_size=40)
    | st.sampled_from(HOSTS).flatmap(
        lambda host: st.tuples(st.integers(0, len(host)), st.characters()).map(
            lambda cut: host[: cut[0]] + cut[1] + host[cut[0] :]
        )
    )
    | st.sampled_from(HOSTS)
)
@example("localhost:08450")
def test_a_host_is_taken_exactly_if_it_is_one_of_the_names_in_any_case(host: str) -> None:
    sent = told(guarded(), scope_of([(b"host", host.encode("utf-8", "surrogatepass"))]))
    assert status_of(sent) == (200 if host.isascii() and host.lower() in HOSTS else 421)


# ---- where a request comes from -----------------------------------------------------------------


def test_what_comes_from_a_page_of_ours_is_handed_on() -> None:
    answer = ask("POST", origin=HERE, content=b"12345")
    assert (answer.status_code, answer.json()) == (200, {"bytes": 5})
    for host in ("lathe-3.shop:8450", "[::1]:8450"):
        assert ask("POST", host=host, origin=f"http://{host}").status_code == 200
    assert ask("POST", secure=True, origin="https://127.0.0.1:8450").status_code == 200
    assert ask("POST", secure=True, origin=HERE).status_code == 403
    sent = told(guarded(), scope_of([GOOD_HOST, GOOD_ORIGIN], kind="websocket", path="/live"))
    assert [m["type"] for m in sent] == ["websocket.accept", "websocket.send", "websocket.close"]


@given(st.text(max_size=40))
def test_an_origin_is_taken_exactly_if_it_is_the_server_itself(origin: str) -> None:
    header = (b"origin", origin.encode("utf-8", "surrogatepass"))
    sent = told(guarded(), scope_of([GOOD_HOST, header], method="POST"))
    assert status_of(sent) == (200 if origin == HERE else 403)


# ---- methods and paths --------------------------------------------------------------------------


def test_a_head_is_marked_as_the_page_itself_is() -> None:
    head, page = ask("HEAD", "/deaf"), ask("GET", "/deaf")
    assert head.status_code == page.status_code == 200
    assert head.headers == page.headers
    assert head.content == b""


def test_every_plain_path_is_handed_on() -> None:
    for path in ("/", "/static/base.css", "/static/chart/draw.js"):
        assert ask("GET", path).status_code == 200
        assert ask("GET", f"{path}?first=2030-01-01T00:00:00Z&names=Z_um%2CX").status_code == 200


@given(st.text(max_size=30))
def test_whatever_the_path_is_no_part_of_what_is_handed_on_begins_with_a_dot(path: str) -> None:
    seen: list[str] = []

    async def app(scope: Scope, receive: object, send: Callable) -> None:
        seen.append(scope["path"])
        await send({"type": "http.response.start", "status": 200, "headers": []})
        await send({"type": "http.response.body", "body": b""})

    raw = f"/{path}".encode("utf-8", "surrogatepass")
    with contextlib.suppress(UnicodeDecodeError):
        whole = scope_of([GOOD_HOST], path=raw.decode())
        told(Guard(app, HOSTS, secure=False), whole)
    for handed_on in seen:
        assert handed_on.isascii()
        assert not any(part.startswith(".") for part in handed_on.split("/"))
        assert not set(handed_on) & set("\\%;\r\n\0 ")


# ---- bodies -------------------------------------------------------------------------------------


def posted(
    path: str, parts: Iterable[bytes], headers: Iterable[tuple[bytes, bytes]] = ()
) -> list[Message]:
    scope = scope_of([GOOD_HOST, GOOD_ORIGIN, *headers], method="POST", path=path)
    return told(guarded(), scope, parts)


def test_a_body_is_taken_up_to_its_bound_and_not_a_byte_more() -> None:
    whole = [b"x" * 1024] * (LARGEST_BODY_BYTES // 1024)
    assert LARGEST_BODY_BYTES == 16_384
    for path in ("/", "/stream"):
        assert status_of(posted(path, whole)) == 200
        assert status_of(posted(path, [*whole, b"x"])) == 413


def test_an_upload_may_be_larger_and_is_bounded_as_well() -> None:
    part = b"x" * 1_000_000
    sent = posted(UPLOAD, [part] * 20)
    assert status_of(sent) == 200
    assert json.loads(sent[-1]["body"] or sent[-2]["body"]) == {"bytes": 20_000_000}
    assert AxisRoom.largest_bytes[UPLOAD] == 20_000_000
    assert max({**AxisRoom.largest_bytes, **ThermalRoom.largest_bytes}.values()) == 60_000_000
    assert status_of(posted(UPLOAD, [part] * 20 + [b"x"])) == 413
    for near in (f"{UPLOAD}/", f"{UPLOAD}/x", "/positioning/uploads", "/stream"):
        assert status_of(posted(near, [part])) in {413, 404, 307}


def test_a_length_that_is_announced_is_refused_before_a_byte_is_read() -> None:
    asked = [0]

    async def app(scope: Scope, receive: object, send: object) -> None:
        asked[0] += 1

    length = (b"content-length", str(LARGEST_BODY_BYTES + 1).encode())
    scope = scope_of([GOOD_HOST, GOOD_ORIGIN, length], method="POST")
    sent = told(Guard(app, HOSTS, secure=False), scope, ends=False)
    assert status_of(sent) == 413
    assert headers_of(sent)["connection"] == "close"
    assert asked == [0]


def test_a_length_that_lies_does_not_count() -> None:
    length = (b"content-length", b"10")
    assert status_of(posted("/", [b"x" * 20_000], [length])) == 413


def test_a_length_that_is_not_plain_is_refused() -> None:
    for length in (b"-1", b"5, 5", b"0x10", b"", b"9" * 30, b"\xb2"):
        assert status_of(posted("/", [b"12345"], [(b"content-length", length)])) == 413, length


def test_a_page_that_swallows_the_refusal_cannot_answer_in_its_place() -> None:
    sent = posted("/obstinate", [b"x" * 20_000])
    assert status_of(sent) == 413
    assert b"all is well" not in b"".join(m.get("body", b"") for m in sent)


def test_an_answer_that_has_begun_is_broken_off_and_never_completed() -> None:
    async def app(scope: Scope, receive: Callable, send: Callable) -> None:
        await send({"type": "http.response.start", "status": 200, "headers": []})
        await send({"type": "http.response.body", "body": b"begun", "more_body": True})
        with contextlib.suppress(Exception):
            while (await receive())["more_body"]:
                pass
        await send({"type": "http.response.body", "body": b"all is well"})

    scope = scope_of([GOOD_HOST, GOOD_ORIGIN], method="POST")
    sent = told(Guard(app, HOSTS, secure=False), scope, [b"x" * 20_000])
    assert status_of(sent) == 200
    assert sent[-1] == {"type": "http.response.body", "body": b"begun", "more_body": True}


def test_a_page_that_streams_its_answer_is_refused_as_any_other() -> None:
    assert status_of(posted("/early", [b"x" * 20_000])) == 413


def test_a_body_that_nobody_reads_costs_nothing() -> None:
    assert status_of(posted("/deaf", [b"x" * 20_000])) == 200


def test_a_body_that_does_not_come_is_not_waited_for_longer_than_a_minute() -> None:
    async def scene() -> None:
        sent: list[Message] = []

        async def receive() -> Message:
            await asyncio.sleep(BODY_S / 3 + 1.0)
            return {"type": "http.request", "body": b"x", "more_body": True}

        async def send(message: Message) -> None:
            sent.append(message)

        began_s = asyncio.get_running_loop().time()
        scope = scope_of([GOOD_HOST, GOOD_ORIGIN], method="POST")
        await guarded()(scope, receive, send)
        assert status_of(sent) == 408
        assert asyncio.get_running_loop().time() - began_s == pytest.approx(BODY_S)

    run_in_virtual_time(scene())


def test_a_page_that_waits_after_the_body_may_wait_as_long_as_it_likes() -> None:
    async def app(scope: Scope, receive: Callable, send: Callable) -> None:
        await receive()
        gone = await receive()
        assert gone["type"] == "http.disconnect"

    sent = told(Guard(app, HOSTS, secure=False), scope_of([GOOD_HOST]))
    assert sent == []


@given(st.lists(st.binary(max_size=9000), max_size=6))
def test_the_sum_of_the_parts_decides_however_they_are_cut(parts: list[bytes]) -> None:
    whole = sum(map(len, parts))
    assert status_of(posted("/", parts)) == (200 if whole <= LARGEST_BODY_BYTES else 413)


# ---- what browsers are told ---------------------------------------------------------------------

MARKS = {
    "x-content-type-options": "nosniff",
    "referrer-policy": "no-referrer",
    "cross-origin-opener-policy": "same-origin",
    "cross-origin-resource-policy": "same-origin",
    "cache-control": "no-store",
}


def policy_of(text: str) -> dict[str, list[str]]:
    rules = [rule.split() for rule in text.split(";")]
    assert len({rule[0] for rule in rules}) == len(rules)
    return {rule[0]: rule[1:] for rule in rules}


@pytest.mark.parametrize("secure", [False, True])
def test_every_answer_carries_every_mark(secure: bool) -> None:
    for path in ("/", "/nowhere", "/static/../x", "/elsewhere"):
        headers = headers_of(told(guarded(secure=secure), scope_of([GOOD_HOST], path=path)))
        assert {name: headers[name] for name in MARKS} == MARKS, path
        assert "strict-transport-security" not in headers
        assert "camera=()" in headers["permissions-policy"]
        policy = policy_of(headers["content-security-policy"])
        for name in ("default-src", "frame-ancestors", "base-uri"):
            assert policy[name] == ["'none'"]
        for name in ("script-src", "style-src", "connect-src", "font-src", "frame-src"):
            assert policy[name] == ["'self'"]


def test_a_refusal_is_marked_as_well_and_names_no_host() -> None:
    headers = headers_of(told(guarded(), scope_of([(b"host", b"evil.example")])))
    assert "evil" not in repr(headers)
    assert {name: headers[name] for name in MARKS} == MARKS


def test_a_policy_that_a_page_has_set_stays_and_nothing_else_that_is_marked() -> None:
    headers = headers_of(told(guarded(), scope_of([GOOD_HOST], path="/positioning/report/7")))
    assert headers["content-security-policy"] == "sandbox"
    assert headers["x-content-type-options"] == "nosniff"


def test_only_what_is_static_may_be_kept_by_a_browser() -> None:
    static = headers_of(told(guarded(), scope_of([GOOD_HOST], path="/static/x.js")))
    assert static["cache-control"] == "public, max-age=31536000, immutable"
    other = headers_of(told(guarded(), scope_of([GOOD_HOST], path="/elsewhere")))
    assert other["cache-control"] == "no-store"


@scene
async def test_the_life_of_the_application_is_handed_on() -> None:
    seen: list[str] = []

    async def app(scope: Scope, receive: object, send: object) -> None:
        seen.append(scope["type"])

    await Guard(app, HOSTS, secure=False)({"type": "lifespan"}, None, None)

    assert seen == ["lifespan"]
