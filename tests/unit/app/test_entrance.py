"""Who gets into the app, and what hostile requests and files are told."""

import asyncio
import io
import subprocess
import sys
import tempfile
import zipfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Self, cast

import httpx2 as httpx
import pytest

from tests.commands_here import WorkHere
from thermaxis.app.axis._forms import judge
from thermaxis.app.server._server import build_app, serve_app
from thermaxis.errors import ConfigurationError
from thermaxis.messages import sentence
from thermaxis.web import Listener
from thermaxis.web.work import Work

TOKEN, PORT = "a-token-of-the-test", 8460
HERE = f"http://127.0.0.1:{PORT}"
COOKIE = f"thermaxis_app_{PORT}={TOKEN}"
UPLOAD = "/positioning/upload?name=run.csv"


class Door:
    """The app without a socket."""

    def __init__(self, where: Path) -> None:
        self.ended = 0
        self.where = where
        self.runner = asyncio.Runner()
        self.app = build_app(TOKEN, PORT, self._end)
        transport = httpx.ASGITransport(self.app)
        self.http = httpx.AsyncClient(transport=transport, base_url=HERE)

    def _end(self) -> None:
        self.ended += 1

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.runner.run(self.http.aclose())
        self.runner.close()

    def ask(self, method: str, path: str, headers: dict[str, str], body: bytes = b"") -> Any:
        request = self.http.request(method, path, headers=headers, content=body)
        return self.runner.run(request)


@pytest.fixture
def door(tmp_path: Path) -> Iterator[Door]:
    with Door(tmp_path) as made:
        yield made


GOOD = {"Host": f"127.0.0.1:{PORT}", "Origin": HERE, "Cookie": COOKIE}
PATHS = (
    *("/", "/positioning", "/positioning/results", "/positioning/result/x", "/nowhere"),
    *("/thermal", "/thermal/bench", "/thermal/progress", "/thermal/model/x"),
)
POSTS = (
    *(UPLOAD, "/positioning/trend", "/positioning/plan", "/positioning/toml", "/end"),
    *("/positioning/form/head", "/thermal/log?name=log.csv", "/thermal/identify"),
    *("/thermal/verify", "/thermal/export", "/thermal/remove"),
)
STRANGE = {
    "no cookie": {"Cookie": ""},
    "another cookie": {"Cookie": f"thermaxis_app_{PORT}=guessed"},
    "another host": {"Host": "evil.example"},
    "another port": {"Host": f"127.0.0.1:{PORT + 1}"},
}
CROSS_SITE = {
    "another site": {"Origin": "http://evil.example"},
    "no origin": {"Origin": ""},
    "the same computer, another port": {"Origin": f"http://127.0.0.1:{PORT + 1}"},
    "nobody": {"Origin": "null"},
    "a safe page's": {"Origin": f"https://127.0.0.1:{PORT}"},
}


def test_over_a_hundred_requests_of_strangers_are_refused_each_with_a_sentence(door: Door) -> None:
    asked = [("GET", path, why) for path in PATHS for why in STRANGE.values()]
    asked += [("POST", path, why) for path in POSTS for why in (*STRANGE.values(),)]
    asked += [("POST", path, why) for path in POSTS for why in CROSS_SITE.values()]
    assert len(asked) > 100
    for method, path, why in asked:
        answer = door.ask(method, path, {**GOOD, **why})
        assert answer.status_code in {403, 421}, (method, path, why)
        assert len(answer.json()["text"]) > 20
    assert door.ended == 0


def test_paths_that_lead_elsewhere_and_methods_that_are_none_end_in_words(door: Door) -> None:
    for path in (
        "/positioning/certificate/../../etc/passwd",
        "/static/../_server.py",
        "/positioning/report/%2e%2e%2flock",
        "/positioning/x/0",
        "/thermal/model/../../etc/passwd",
        "/thermal/html/%2e%2e%2fmodel.json",
        "/thermal/..%5cmodel/x",
        f"/thermal/passwd/{'0' * 32}",
        f"/thermal/model/{'0' * 32}",
        "//etc/passwd",
        "/.git",
        f"/{'a' * 5000}",
    ):
        answer = door.ask("GET", path, GOOD)
        assert answer.status_code in {404, 414}, path
    assert door.ask("PUT", "/", GOOD).status_code == 405
    assert door.ask("DELETE", "/positioning/result/x", GOOD).status_code == 405


def test_the_token_is_taken_once_at_the_first_page_alone_and_becomes_a_strict_cookie(
    door: Door,
) -> None:
    first = door.ask("GET", f"/?token={TOKEN}", {"Host": GOOD["Host"]})
    assert first.status_code == 200
    cookie = first.headers["set-cookie"]
    assert cookie.startswith(f"{COOKIE};")
    assert "HttpOnly" in cookie
    assert "SameSite=Strict" in cookie
    door.http.cookies.clear()  # who has the address alone has no more than its first page
    for path in ("/positioning", "/positioning/results"):
        assert door.ask("GET", f"{path}?token={TOKEN}", {"Host": GOOD["Host"]}).status_code == 403
    refused = door.ask("GET", "/?token=x", {"Host": GOOD["Host"], "Accept": "text/html"})
    assert refused.status_code == 403
    assert 'href="/"' not in refused.text  # it leads nowhere without the token
    assert "set-cookie" not in door.ask("GET", "/", GOOD).headers
    assert door.ask("POST", "/end", GOOD).status_code == 200
    assert door.ended == 1


def zip_bomb() -> bytes:
    """Return a workbook of some hundred kilobytes whose sheet has 200 MB."""
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as archive:
        archive.writestr("[Content_Types].xml", "<Types/>")
        archive.writestr("xl/workbook.xml", "<workbook/>")
        archive.writestr("xl/worksheets/sheet1.xml", b" " * 200_000_000)
    return packed.getvalue()


HEAD = b"time_s,T_spindle_C,Z_um\n"
RUNS = {
    "empty.csv": b"",
    "zeros.csv": b"\x00" * 10_000,
    "cut.xlsx": b"PK\x03\x04cut",
    "no.xls": b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1" + b"\xff" * 2000,
    "script.csv": b"<script>alert(1)</script>\n1,2\n",
    "title.csv": b"# title: <img src=x onerror=alert(1)>\nposition_mm\n",
    "formula.csv": b"=cmd|' /C calc'!A0,@SUM(1)\n",
    "letters.rtl": b"HEADER::\nTarget Data::\n" + b"x" * 4000,
    "nan.csv": b"cycle,direction,position_mm,deviation_um\n1,forward,NaN,inf\n",
    "huge.csv": b"cycle,direction,position_mm,deviation_um\n1,forward,1e999,9e999\n",
    "long.csv": b"1," * 200_000,
    "quotes.csv": b'"' * 50_001,
    "half.csv": b"cycle,direction\n1",
    "utf16.csv": "cycle;směr\n".encode("utf-16"),
    "one.csv": b"cycle,direction,position_mm,deviation_um\n1,forward,1,1\n",
    "json.csv": b'{"a": [1, 2]}',
    "pdf.csv": b"%PDF-1.7\n%\xe2\xe3\xcf\xd3\n",
    "exe.csv": b"MZ\x90\x00" + b"\x01" * 3000,
    "minus.csv": b"----\n----\n",
}


LOGS = {
    "empty.csv": b"",
    "letter.txt": b"Dear colleague,\nthe log follows tomorrow.\n",
    "heading.csv": HEAD,
    "picture.csv": b"\x89PNG\r\n\x1a\n" + bytes(400),
    "script.csv": b"<script>alert(1)</script>,<img src=x onerror=alert(1)>\n1,2\n",
    "twice.csv": b"time_s,Z_um,Z_um,T_C,T_C\n0,1,2,20,20\n10,1,2,20,20\n",
    "no.xlsx": b"PK\x03\x04 no workbook",
    "no.parquet": b"PAR1 no table PAR1",
    "no.mat": bytes(300),
    "no.tdms": b"TDSm" + bytes(60),
}


@pytest.mark.proof
def test_hostile_files_end_in_a_sentence_each_and_leave_nothing(door: Door) -> None:
    """In processes with limits: `tests/unit/screen/test_axis_room.py`, with the worst of them."""
    state = cast("Any", door.app)._app.state
    state.work = WorkHere(where=door.where)
    large = {"bomb.xlsx": zip_bomb()}
    wide = b",".join(b"c%d" % k for k in range(1_000_000)) + b"\n"
    runs, logs = RUNS | large, LOGS | large | {"wide.csv": wide}
    dropped = [(f"/positioning/upload?name={name}", runs[name]) for name in runs]
    dropped += [(f"/thermal/log?name={name}", logs[name]) for name in logs]
    assert len(dropped) > 30
    for path, content in dropped:
        answer = door.ask("POST", path, GOOD, content)
        assert answer.status_code in {400, 422}, (path, answer.text[:300])
        found = answer.json()
        assert len(found["text"]) > 15, path
        assert found["error"] in {"room-refused", "room-empty"}, (path, found)
        assert "Traceback" not in found["text"]
        assert str(door.where) not in found["text"]
        folders = [one for root in door.where.iterdir() for one in root.iterdir() if one.is_dir()]
        assert [one.name for one in folders] == ["settings"], path
    state.work.close()


STAND_IN = """
import os, sys
for word in sys.argv:
    if word.startswith("--report=") and word.endswith(".pdf"):
        sys.exit(open(word[9:], "w").write("hal"))
    if word.startswith("--report="):
        os.symlink("/etc/hostname", word[9:])
print("{}")
"""


def test_a_file_that_a_command_left_half_or_as_a_link_is_never_given(door: Door) -> None:
    state = cast("Any", door.app)._app.state
    state.work = Work([sys.executable, "-c", STAND_IN], where=door.where)
    run = door.ask("POST", UPLOAD, GOOD, b"x").json()["id"]
    for _ in range(2):
        assert door.ask("GET", f"/positioning/certificate/{run}", GOOD).status_code == 422
        assert door.ask("GET", f"/positioning/page/{run}", GOOD).status_code == 404
    state.work.close()


def test_a_user_without_a_home_has_pages_whose_forms_last_as_long_as_the_program(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    def none() -> Path:
        raise RuntimeError

    monkeypatch.delenv("APPDATA", raising=False)
    monkeypatch.delenv("XDG_CONFIG_HOME", raising=False)
    monkeypatch.setattr(Path, "home", none)
    with Door(tmp_path) as door:
        assert door.ask("POST", "/positioning/form/head", GOOD, b"").status_code == 200


def test_a_damaged_table_is_told_in_words(door: Door) -> None:
    for body in (b"[a\n", b"\xff\xfe", b"a = " + b"[" * 5000):
        answer = door.ask("POST", "/positioning/toml", GOOD, body)
        assert answer.status_code == 400
        assert answer.json()["text"] == sentence("positioning-no_toml")


def test_what_a_form_may_not_say_is_told_at_the_form(door: Door) -> None:
    for form, text, named in (
        ("head", '[certificate]\ndate_of_issue = "23.11.2026"\n', "date_of_issue"),
        ("limits", '[limits]\nA_um = "elf"\n', "A_um"),
        ("budget", '[device]\nresolution_um = "elf"\n', "resolution_um"),
    ):
        answer = door.ask("POST", f"/positioning/form/{form}", GOOD, text.encode())
        assert answer.status_code == 422
        assert named in answer.json()["text"]
        assert tempfile.gettempdir() not in answer.json()["text"]
    judge("limits", b"[limits]\nA_arcsec = 5.0\n")


def test_a_port_that_is_taken_is_said_with_what_to_do() -> None:
    with Listener.at("127.0.0.1", 0, "") as taken:
        taken.listen()
        port = taken.getsockname()[1]
        with pytest.raises(ConfigurationError, match="--port"):
            asyncio.run(serve_app(port, print))


def test_the_app_needs_nothing_but_the_core_installation() -> None:
    extras = ["argon2", "asyncua", "cryptography", "prometheus_client", "sqlalchemy", "websockets"]
    code = f"""
import sys
sys.modules.update(dict.fromkeys({extras!r} + ["thermaxis.runtime"]))
from thermaxis.app.server._server import build_app
build_app("token", 1, bool)
"""
    subprocess.run([sys.executable, "-c", code], check=True)
