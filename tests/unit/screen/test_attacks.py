"""Hostile requests to the whole screen behind its web server, and to the loop behind it.

Each says what it must be answered. None may reach the loop, be logged in by, be told what it sent,
or make the program fail.
"""

import asyncio
import contextlib
import hashlib
import json
import logging
from collections.abc import Iterator
from dataclasses import replace
from typing import Any, Final, NamedTuple

import pytest

from tests import scenes
from tests.unit.screen.person_parts import PASSWORD, Shop, Stage, shop
from tests.unit.screen.stand import lathe, parts, settings_with
from tests.unit.screen.web_server import served
from thermaxis.runtime import Role, hash_pin, read_users, write_users
from thermaxis.runtime.status import ASKS
from thermaxis.screen._application import build_application

PIN: Final = "481516"
PANEL: Final = "127.0.0.3"
NAME: Final = "lathe-3.shop"
"""By which the screen is known beside its address; so it stands for others than this computer."""
OPERATOR: Final = "Cookie: NAME=COOKIE\nX-Thermaxis-Token: TOKEN"
VIEWER: Final = "Cookie: NAME=V_COOKIE\nX-Thermaxis-Token: V_TOKEN"
ENGINEER: Final = "Cookie: NAME=E_COOKIE\nX-Thermaxis-Token: E_TOKEN"
HOLD: Final = '{"method":"Hold","arguments":[]}'
LOG_IN: Final = '{"name":"novak","password":"PASSWORD"}'


class Attack(NamedTuple):
    """A request, and what it must be answered."""

    what: str
    status: int
    """Status of HTTP; 400 is the web server's own where it is no HTTP. [1]"""
    sent: str
    """Lines of the head, an empty one, and the body; words in capitals stand for secrets."""
    address: str = ""
    """Where it comes from; empty: an address of its own."""


def look(path: str = "/", *lines: str, host: str = "HERE", method: str = "GET") -> str:
    head = [f"{method} {path} HTTP/1.1", f"Host: {host}", "Connection: close", *lines]
    return "\n".join(head) + "\n\n"


def post(
    path: str, body: str = "", *lines: str, origin: str = "http://HERE", host: str = "HERE"
) -> str:
    own = {line.partition(":")[0] for line in lines}
    length = () if own & {"Content-Length", "Transfer-Encoding"} else ("Content-Length: LENGTH",)
    kind = () if "Content-Type" in own else ("Content-Type: application/json",)
    from_ = (f"Origin: {origin}",) if origin else ()
    return look(path, *from_, *kind, *lines, *length, host=host, method="POST") + body


def ask(who: str, body: str = HOLD, *lines: str, **more: str) -> str:
    return post("/ask", body, *filter(None, (who, *lines)), **more)


def socket(path: str = "/live", origin: str = "http://HERE", host: str = "HERE") -> str:
    return (
        f"GET {path} HTTP/1.1\nHost: {host}\nConnection: Upgrade\nUpgrade: websocket\n"
        "Sec-WebSocket-Version: 13\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\n"
        + (f"Origin: {origin}\n" if origin else "")
        + "\n"
    )


def of_other_names() -> Iterator[Attack]:
    """Yield requests that call the server by no name of its own."""
    for host in (
        *("evil.example", "evil.example:PORT", "HERE.evil.example", "x.lathe-3.shop:PORT"),
        *("127.0.0.1", "127.0.0.1:1", "127.1:PORT", "127.0.0.1:0PORT", "localhost.:PORT"),
        *("HERE@evil.example", "HERE,evil.example", "http://HERE", "[::1%25eth0]:PORT"),
    ):
        yield Attack(f"host {host}", 421, look(host=host))
    yield Attack("no host in 1.0", 421, "GET / HTTP/1.0\n\n")
    yield Attack("no host in 1.1", 400, "GET / HTTP/1.1\n\n")
    yield Attack("two hosts", 400, look("/", "Host: evil.example"))
    yield Attack("an empty host", 421, look(host=""))
    yield Attack("host of a path", 404, look("http://evil.example/"))
    yield Attack("host forged for a proxy", 421, look("/", "X-Forwarded-Host: HERE", host="evil"))
    for line in ("X-Forwarded-For: 127.0.0.1", "Forwarded: for=127.0.0.1", "Via: 1.1 evil"):
        yield Attack(f"through a proxy: {line}", 421, look("/login", line))
    yield Attack("log-in from another name", 421, post("/login", LOG_IN, host="evil.example"))


def of_other_pages() -> Iterator[Attack]:
    """Yield what a page of another site makes the browser of somebody logged in send."""
    for origin in (
        *("", "null", "*", "http://evil.example", "https://HERE", "http://HERE/", "HTTP://HERE"),
        *("http://127.0.0.1", "http://localhost:PORT", "http://HERE.evil.example"),
        *("http://user@HERE", "http://HERE, http://evil.example", "http://evil.example#HERE"),
    ):
        yield Attack(f"origin {origin}", 403, ask(OPERATOR, origin=origin))
        yield Attack(f"socket of {origin}", 403, socket(origin=origin))
    yield Attack("two origins", 403, ask(OPERATOR, HOLD, "Origin: http://evil.example"))
    yield Attack("referer alone", 403, ask(OPERATOR, HOLD, "Referer: http://HERE/", origin=""))
    for path in ("/login", "/logout", "/language", "/history/export"):
        yield Attack(f"post to {path}", 403, post(path, "{}", OPERATOR, origin="http://evil"))
    for kind in ("text/plain", "application/x-www-form-urlencoded", "application/json5", ""):
        yield Attack(f"kind {kind}", 415, ask(OPERATOR, HOLD, f"Content-Type: {kind}"))
    yield Attack("a form logs in", 415, post("/login", LOG_IN, "Content-Type: text/plain"))
    yield Attack("socket of another name", 403, socket(host="evil.example"))
    yield Attack("socket at another path", 403, socket("/live/../ask"))
    yield Attack("an asset as a page's own", 200, look("/alive", "Origin: http://evil.example"))


def of_odd_http() -> Iterator[Attack]:
    """Yield methods, paths and lengths that no page sends."""
    for method in ("OPTIONS", "PUT", "DELETE", "PATCH", "TRACE", "PROPFIND", "get"):
        yield Attack(f"method {method}", 405, look("/ask", method=method))
    yield Attack("a look at what is asked", 405, look("/ask"))
    yield Attack("a star", 405, look("*", method="OPTIONS"))
    yield Attack("a tunnel", 405, look("evil.example:443", method="CONNECT"))
    for path in (
        *("/static/../../etc/passwd", "/static/%2e%2e/%2e%2e/etc/passwd", "/static/%252e%252e/x"),
        *("/static/..%5cx", "/static/..%2f_access.py", "/static/.hidden", "/%73tatic/base.css"),
        *("//evil.example/x", "/static/base.css%00.png", "/static/a;b", "/static/%c0%ae/x"),
        *("/nowhere", "/static/../_access.py", "/positioning/report/..", "/static//etc/passwd"),
        "/static/a%0d%0aSet-Cookie:evil=1",
    ):
        yield Attack(f"path {path}", 404, look(path))
    yield Attack("a long path", 414, look("/" + "x" * 1024))
    yield Attack("a long query", 414, look("/?" + "x" * 4097))
    yield Attack("a line in a header", 400, look("/", "X: a\r b\x00"))
    yield Attack("an announced body", 413, ask(OPERATOR, "", "Content-Length: 16385"))
    yield Attack("a body without an end", 413, ask(OPERATOR, CHUNKS, "Transfer-Encoding: chunked"))
    yield Attack("a large upload", 413, post("/positioning/upload?name=x", "", LARGE, ENGINEER))
    for length in ("-1", "0x10", "5, 6", "9" * 30):
        yield Attack(f"length {length}", 400, ask(OPERATOR, HOLD, f"Content-Length: {length}"))
    smuggled = ("Transfer-Encoding: chunked", "Content-Length: 5")
    yield Attack("a smuggled request", 400, ask(OPERATOR, f"0\r\n\r\n{look('/x')}", *smuggled))


CHUNKS: Final = ("400\r\n" + "x" * 0x400 + "\r\n") * 17
LARGE: Final = "Content-Length: 20000001"


def of_forged_log_ins() -> Iterator[Attack]:
    """Yield cookies and tokens that are not somebody's own."""
    yield Attack("nobody asks", 401, ask(""))
    for name, cookie in (
        ("a guess", "x" * 43),
        ("its hash", "HASH"),
        ("the token of the pages", "TOKEN"),
        ("the token of the loop", "LOOP"),
        ("one letter less", "CUT"),
        ("one that is logged out", "GONE"),
        ("a long one", "x" * 4000),
        ("a script", "<script>evil</script>"),
        ("a name", "novak"),
        ("odd signs", '\xff\\355"%ED%A0%80'),
    ):
        line = f"Cookie: NAME={cookie}\nX-Thermaxis-Token: TOKEN"
        yield Attack(f"cookie: {name}", 401, ask(line))
    yield Attack("a cookie of another port", 401, ask("Cookie: thermaxis_1=COOKIE"))
    for name, token in (
        ("none", ""),
        ("of another", "X-Thermaxis-Token: V_TOKEN"),
        ("its beginning", "X-Thermaxis-Token: TOK"),
        ("odd signs", "X-Thermaxis-Token: t\xf6ken"),
        ("the cookie", "X-Thermaxis-Token: COOKIE"),
        ("of the loop", "X-Thermaxis-Token: LOOP"),
    ):
        cookie = ("Cookie: NAME=COOKIE", *filter(None, (token,)))
        yield Attack(f"token: {name}", 403, ask("\n".join(cookie)))
    yield Attack("token in the address", 403, post("/ask?token=TOKEN", HOLD, "Cookie: NAME=COOKIE"))
    yield Attack("a log-out by another page", 403, post("/logout", "{}", "Cookie: NAME=COOKIE"))
    for path in ("/model/values", "/history/series", "/trend8", "/helps", "/positioning/results"):
        yield Attack(f"nobody looks at {path}", 401, look(path))
    yield Attack("nobody exports", 401, post("/history/export?format=csv"))


def of_roles() -> Iterator[Attack]:
    """Yield what somebody who is logged in may not."""
    of_operators = [one for one in ASKS if one.role is Role.OPERATOR]
    for one in of_operators:
        body = json.dumps({"method": one.name, "arguments": []})
        yield Attack(f"a viewer asks {one.name}", 403, ask(VIEWER, body))
    chosen = '{"method":"ChooseModel","arguments":["evil.json"]}'
    yield Attack("an operator chooses", 403, ask(OPERATOR, chosen))
    for who in (VIEWER, OPERATOR):
        yield Attack("an upload", 403, post("/positioning/upload?name=x.csv", "1;2", who))
        yield Attack("results", 403, look("/positioning/results", who))
    for name, body in (
        ("a method of ours", '{"method":"IssueToken","arguments":[]}'),
        ("a dunder", '{"method":"__class__","arguments":[]}'),
        ("another key", '{"method":"Hold","arguments":[],"role":"engineer"}'),
        ("a name for another", '{"method":"Hold","arguments":[],"who":"dvorak"}'),
        ("a key twice", '{"method":"Hold","method":"Enable","arguments":[]}'),
        ("an object", '{"method":"Hold","arguments":{"evil":1}}'),
        ("not finite", '{"method":"Trim","arguments":["Z_um",1e999999999,[]]}'),
        ("a number of many digits", '{"method":"Trim","arguments":[' + "9" * 9000 + "]}"),
        ("depth", "[" * 9000),
        ("half a pair", '{"method":"Trim","arguments":["\\ud800",1,1]}'),
        ("no text", "\xff\xfe{}"),
        ("nothing", ""),
    ):
        yield Attack(f"asked: {name}", 400, ask(OPERATOR, body))


def of_passwords() -> Iterator[Attack]:
    """Yield log-ins that nobody has."""
    for name, status, body in (
        ("wrong", 401, {"name": "novak", "password": "wrong"}),
        ("nobody", 401, {"name": "nobody", "password": "PASSWORD"}),
        ("other letters", 401, {"name": "NOVAK", "password": "PASSWORD"}),
        ("a name with an end", 401, {"name": "novak\0", "password": "PASSWORD"}),
        ("a script", 401, {"name": "<script>evil", "password": "PASSWORD"}),
        ("a command", 401, {"name": "novak\r\nevil: 1", "password": "PASSWORD"}),
        ("half a pair", 401, {"name": "novak", "password": "\ud800"}),
        ("a long one", 401, {"name": "novak", "password": "x" * 1025}),
        ("the stored hash", 401, {"name": "novak", "password": "ARGON"}),
        ("the hash of the loop's token", 401, {"name": "novak", "password": "STORED"}),
        ("another's token of the loop", 401, {"name": "dvorak", "password": "LOOP"}),
        ("a token of the loop that has ended", 401, {"name": "svoboda", "password": "ENDED"}),
        ("no object", 400, []),
        ("none", 400, {"name": "novak"}),
        ("an empty one", 400, {"name": "novak", "password": ""}),
        ("a list", 400, {"name": ["novak"], "password": {"evil": 1}}),
        ("a PIN as a password", 401, {"name": "novak", "password": PIN}),
        ("a PIN under its mark", 401, {"name": "novak", "password": f"\0pin:{PIN}"}),
        ("a PIN from elsewhere", 403, {"name": "novak", "pin": PIN}),
    ):
        yield Attack(f"log-in: {name}", status, post("/login", json.dumps(body)))
    twice = '{"name":"nobody","name":"novak","password":"PASSWORD"}'
    for name, body in (("nothing", ""), ("depth", "[" * 9000), ("a key twice", twice)):
        yield Attack(f"log-in: {name}", 400, post("/login", body))
    for name, status, body in (
        ("a wrong PIN", 401, {"name": "novak", "pin": "000000"}),
        ("the PIN of an engineer", 401, {"name": "dvorak", "pin": PIN}),
        ("the PIN of a viewer", 401, {"name": "host", "pin": PIN}),
        ("a password as a PIN", 401, {"name": "novak", "pin": "PASSWORD"}),
        (
            "a PIN in no digits",
            401,
            {"name": "novak", "pin": "\u0664\u0668\u0661\u0665\u0661\u0666"},
        ),
    ):
        yield Attack(f"at the panel: {name}", status, post("/login", json.dumps(body)), PANEL)
    said = json.dumps({"name": "novak", "pin": PIN})
    forged = "X-Real-IP: 127.0.0.3"
    yield Attack("a PIN from a forged panel", 421, post("/login", said, forged))
    through = post(
        "/login",
        said,
        "X-Forwarded-For: 127.0.0.3",
        host=f"{NAME}:PORT",
        origin=f"http://{NAME}:PORT",
    )
    yield Attack("a PIN through a proxy", 403, through)


ATTACKS: Final = (
    *of_other_names(),
    *of_other_pages(),
    *of_odd_http(),
    *of_forged_log_ins(),
    *of_roles(),
    *of_passwords(),
)


async def answered(port: int, sent: bytes, address: str) -> tuple[int, bytes]:
    """Send bytes; return the status and all that came."""
    reader, writer = await asyncio.open_connection("127.0.0.1", port, local_addr=(address, 0))
    answer = b""
    writer.write(sent)
    with contextlib.suppress(ConnectionError):
        while part := await reader.read(65_536):
            answer += part
    writer.close()
    with contextlib.suppress(ConnectionError):
        await writer.wait_closed()
    return int(answer.split(b" ", 2)[1]), answer


async def secrets_of(place: Shop, port: int) -> dict[str, str]:
    """Log people in, one of them out again, and return what an attacker may know or steal."""
    users = place.pairs.users
    known = read_users(users)
    write_users([replace(one, pin=hash_pin(PIN)) for one in known], users)
    cookie, novak = await place.log_in("novak")
    v_cookie, viewer = await place.log_in("host")
    e_cookie, engineer = await place.log_in("dvorak")
    gone, svoboda = await place.log_in("svoboda")
    ended, loop = svoboda.session.token.reveal(), novak.session.token.reveal()
    await place.persons.log_out(gone)
    return {
        "V_COOKIE": v_cookie,
        "V_TOKEN": viewer.token,
        "E_COOKIE": e_cookie,
        "E_TOKEN": engineer.token,
        "COOKIE": cookie,
        "TOKEN": novak.token,
        "HASH": hashlib.sha256(cookie.encode()).hexdigest(),
        "CUT": cookie[:-1],
        "GONE": gone,
        "ENDED": ended,
        "LOOP": loop,
        "STORED": hashlib.sha256(loop.encode()).hexdigest(),
        "ARGON": known[0].hash,
        "PASSWORD": PASSWORD,
        "NAME": f"thermaxis_{port}",
        "HERE": f"127.0.0.1:{port}",
        "PORT": str(port),
    }


def filled(sent: str, secrets: dict[str, str]) -> bytes:
    for word, secret in secrets.items():
        sent = sent.replace(word, secret)
    head, _, body = sent.partition("\n\n")
    content = body.encode("latin-1", "replace")
    head = head.replace("LENGTH", str(len(content))).replace("\n", "\r\n")
    return f"{head}\r\n\r\n".encode("latin-1") + content


def test_no_attack_is_answered_otherwise_than_it_must_be(
    runner: asyncio.Runner, loops_stage: Stage, caplog: pytest.LogCaptureFixture
) -> None:
    settings: dict[str, Any] = {"hosts": (NAME,), "pin_from": (PANEL,), "view_without_login": False}
    takes_pin = settings_with(**settings).takes_pin

    async def scene() -> None:
        async with (
            asyncio.timeout(scenes.LONGEST_S),
            shop(loops_stage, takes_pin=takes_pin) as place,
        ):
            given = parts(lathe(), people=place.persons, **settings)

            def application(port: int) -> Any:
                return build_application(given, (f"127.0.0.1:{port}", f"{NAME}:{port}"))

            async with served(application) as (port, _):
                known = await secrets_of(place, port)
                wrong: list[object] = []
                for number, attack in enumerate(ATTACKS):
                    own = f"127.1.{number // 200}.{number % 200 + 1}"
                    sent = filled(attack.sent, known)
                    status, answer = await answered(port, sent, attack.address or own)
                    told = b"evil" in answer or b"set-cookie" in answer.lower()
                    bare = status != 400 and b"content-security-policy" not in answer.lower()
                    if (status, told, bare and "socket" not in attack.what) != (
                        attack.status,
                        False,
                        False,
                    ):
                        wrong.append((attack.what, attack.status, answer[:300]))
                assert wrong == []
                assert place.box.requests == []
                assert place.persons.count == 3
                status, _ = await answered(port, filled(ask(OPERATOR), known), PANEL)
                assert (status, len(place.box.requests)) == (200, 1)  # what is right goes through

    with caplog.at_level(logging.ERROR):
        runner.run(scene())
    assert [one for one in caplog.records if one.levelno >= logging.ERROR] == []
