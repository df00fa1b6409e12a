"""What the history's and the probe's addresses answer, to whom, and in which language."""

import asyncio
import contextlib
import json
import sys
from collections.abc import Iterator, Sequence
from datetime import timedelta
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import httpx2 as httpx
import pytest
from starlette.applications import Starlette

from tests.unit.runtime.history_records import (
    BEGIN,
    CHANNELS,
    OUTPUTS,
    CountingClock,
    url_of,
    write_history,
)
from tests.unit.screen.people import TOKEN, People
from tests.unit.screen.stand import application, parts
from tests.unit.screen.test_probe_page import measured
from thermaxis.codes import Message
from thermaxis.runtime import EventRecord, Role, Secret
from thermaxis.screen.pages import operator_page as _operator_page, probe_page as _probe_page
from thermaxis.screen.pages.history import close_history, page as _history_page, to_ms
from thermaxis.web.work import Work

NOW = BEGIN + timedelta(hours=1)
SPAN = {"first": BEGIN.isoformat(), "last": NOW.isoformat()}


class Ticking(CountingClock):
    """A clock whose monotonic time a test sets as well."""

    now_s = 0.0

    def monotonic_s(self) -> float:
        return self.now_s


class Stage:
    """The pages with a history, and somebody with a role or nobody."""

    def __init__(
        self,
        path: Path,
        role: Role = Role.VIEWER,
        *,
        probes: tuple[str, ...] = (),
        looked_at: bool = False,
        touches: Sequence[str] = (),
    ) -> None:
        self.clock = Ticking(NOW)
        outputs = tuple(SimpleNamespace(name=name) for name in OUTPUTS)
        model = SimpleNamespace(outputs=outputs, channels=CHANNELS)
        configuration = SimpleNamespace(
            name="lathe",
            path=path.with_name("machine.toml"),
            historian=SimpleNamespace(url=url_of(path), password=Secret("")),
            rules=SimpleNamespace(cycle_s=1.0),
            compensation=SimpleNamespace(model=model, cycle_s=1.0, touches=touches),
            probes=dict.fromkeys(probes),
            outputs={
                "Z_um": SimpleNamespace(effective_node=""),
                "X_um": SimpleNamespace(effective_node="s=effective"),
            },
            sink=SimpleNamespace(kind="opcua"),
            server=None,
            shown_names=lambda *_: {},
        )
        people = People(self.clock).come(None if role is Role.NONE else role, "Nováková")
        feed = SimpleNamespace(latest=SimpleNamespace(status={}))
        self.parts = parts(
            configuration, feed, people=people, clock=self.clock, view_without_login=looked_at
        )
        pages = _history_page, _probe_page, _operator_page
        routes = [route for page in pages for route in page.routes(self.parts)]
        self.application = application(self.parts, routes)

    def __enter__(self) -> "Client":
        self.runner = asyncio.Runner()
        self.client = Client(self.runner, self.application)
        return self.client

    def __exit__(self, *_: object) -> None:
        self.runner.run(close_history(self.application.state))
        self.runner.run(self.client.http.aclose())
        self.runner.close()


class Client:
    """Asks the pages in this program, one question after the other."""

    def __init__(self, runner: asyncio.Runner, application: Starlette) -> None:
        self.runner = runner
        transport = httpx.ASGITransport(application)
        self.http = httpx.AsyncClient(transport=transport, base_url="http://127.0.0.1:8450")

    def get(self, address: str, **asked: Any) -> httpx.Response:
        return self.runner.run(self.http.get(address, **asked))

    def export(self, **asked: str) -> httpx.Response:
        headers = {"x-thermaxis-token": TOKEN}
        return self.runner.run(self.http.post("/history/export", params=asked, headers=headers))


@pytest.fixture(scope="module")
def path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("history") / "h.db"
    events = [
        EventRecord.of(
            BEGIN + timedelta(minutes=1),
            "state",
            "",
            Message("event-state_reasons", {"state": "Holding", "reasons": ("input_bad",)}),
        ),
        EventRecord(BEGIN + timedelta(minutes=2), "connection", "", "<b>somebody</b>"),
        EventRecord.of(
            BEGIN + timedelta(minutes=3),
            "request",
            "Novák",
            Message(
                "event-request_accepted",
                {"request": "trim", "answer": Message("answer-trim_set")},
            ),
            {
                "kind": "trim",
                "output": "Z_um",
                "value": 2.0,
                "duration_s": 3600.0,
                "accepted": True,
            },
        ),
        *(
            EventRecord.of(
                BEGIN + timedelta(minutes=k),
                "touch",
                "",
                Message("event-touch", {"name": "Z_um", "value_um": 4.2, "outcome": outcome}),
            )
            for k, outcome in ((4, "believed"), (5, "excluded"))
        ),
    ]
    write_history(
        path,
        [
            measured(k, 1.0 + k % 2, -3.0 * (k % 2), None, wanted_um=-3.0 * (k % 2))
            for k in range(1800)
        ],
        events,
    )
    return path


@pytest.fixture
def client(path: Path) -> Iterator[Client]:
    with Stage(path, probes=("Z_um",)) as client:
        yield client


def test_who_may_look_without_a_log_in_may_not_export(path: Path) -> None:
    with Stage(path, Role.NONE, looked_at=True) as nobody:
        assert nobody.get("/history/series").status_code == 200
        assert nobody.export(**SPAN, format="csv").status_code == 401


def test_series_come_with_their_units_and_the_span_of_the_history(client: Client) -> None:
    found = client.get("/history/series").json()
    assert found["series"]["Z_correction_um"] == "µm"
    assert found["series"]["T_spindle_C"] == "°C"
    assert found["acting"] == ["Z_accepted_um", "X_effective_um"]
    assert (found["first"], found["last"]) == (to_ms(BEGIN), to_ms(BEGIN) + 1_799_000)


def test_a_trend_has_the_mean_of_what_was_recorded(client: Client) -> None:
    asked = {**SPAN, "names": ["Z_accepted_um", "T_spindle_C"], "points": "60"}
    found = client.get("/history/trend", params=asked).json()
    line = found["series"]["Z_accepted_um"]
    assert line["mean"] == [-1.5] * 30
    assert set(line["lowest"]) == {-3.0}
    assert set(line["highest"]) == {0.0}
    assert line["t"][0] == to_ms(BEGIN) + 30_000
    assert line["step_s"] == 60.0


def test_what_cannot_be_answered_is_refused_in_words(client: Client) -> None:
    for asked, key in (
        ({"names": "Z_model_um"}, "history-no_span"),
        ({**SPAN, "last": SPAN["first"], "names": "Z_model_um"}, "history-no_span"),
        ({**SPAN, "first": "yesterday", "names": "Z_model_um"}, "history-no_span"),
        ({**SPAN, "last": "2199-01-01T00:00Z", "names": "Z_model_um"}, "history-no_span"),
        (SPAN, "history-no_series"),
        ({**SPAN, "names": [str(k) for k in range(9)]}, "history-too_many"),
        ({**SPAN, "names": "Z_model_uml"}, "history-unknown_series"),
    ):
        answer = client.get("/history/trend", params=asked, headers={"accept-language": "de"})
        assert (answer.status_code, answer.json()["error"]) == (400, key), asked
        assert answer.json()["text"].endswith(".")
        assert "{" not in answer.json()["text"]
    answer = client.get("/probe/values", params={**SPAN, "name": "../X_um"})
    assert (answer.status_code, answer.json()["error"]) == (404, "probe-unknown")
    answer = client.get("/probe/values", params={"name": "Z_um"})
    assert (answer.status_code, answer.json()["error"]) == (400, "history-no_span")


def test_no_number_of_points_breaks_a_question(client: Client) -> None:
    for points in ("", "-5", "1e9", "9" * 30, "0", "99999"):
        asked = {**SPAN, "names": "Z_model_um", "points": points}
        found = client.get("/history/trend", params=asked)
        assert found.status_code == 200
        assert 1 <= len(found.json()["series"]["Z_model_um"]["t"]) <= 4000


def test_the_operators_trend_is_asked_once_in_a_quarter_of_a_minute(
    path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    stage = Stage(path, touches=("Z_um",))
    asked: list[Sequence[str]] = []
    plain = _history_page.trend8

    def counted(*words: Any) -> Any:
        asked.append(words[3])
        return plain(*words)

    monkeypatch.setattr(_history_page, "trend8", counted)
    with stage as client:
        found = [client.get("/trend8").json() for _ in range(20)]
        german = client.get("/trend8", headers={"accept-language": "de"}).json()
        assert len(asked) == 1
        stage.clock.now_s += 15.0
        client.get("/trend8")
        assert len(asked) == 2
    assert found[0] == found[-1]
    assert set(found[0]["series"]) == {"Z_accepted_um", "X_effective_um", *CHANNELS}
    assert asked[0][2:4] == ("Z_offset_um", "Z_offset_std_um")
    kinds = [event["kind"] for event in found[0]["events"]]
    assert kinds == ["state", "request", "touch", "touch"]
    believed, excluded = (event["rank"] for event in found[0]["events"][2:])
    assert believed > excluded  # what changes nothing is rare, and is named first
    assert german["events"][0]["said"] != found[0]["events"][0]["said"]
    assert german["series"] == found[0]["series"]


def test_the_probe_is_compared_over_the_address(client: Client) -> None:
    found = client.get("/probe/values", params={**SPAN, "name": "Z_um"}).json()
    assert found["figures"]["values"] == 1800
    assert found["figures"]["compensated_um"] == 1.0
    assert found["figures"]["uncompensated_um"] == 4.0  # 1 - 0 and 2 - (-3)
    assert found["figures"]["ratio"] == 0.25


def test_whether_it_helps_is_told_of_every_probe_over_the_last_shift(client: Client) -> None:
    found = client.get("/helps").json()
    asked = {"first": (NOW - timedelta(hours=8)).isoformat(), "last": NOW.isoformat()}
    assert found.keys() == {"Z_um"}
    compared = client.get("/probe/values", params={**asked, "name": "Z_um"}).json()
    assert found["Z_um"] == compared["figures"]
    assert found["Z_um"]["ratio"] == 0.25


# ---- export -------------------------------------------------------------------------------------


def temporary_folders(application: Starlette) -> list[str]:
    work = cast("Work", application.state.work)
    names = [path.name for path in work._private().iterdir()]
    return [name for name in names if name not in {"lock", "settings"}]


def test_an_export_is_the_file_that_the_command_writes(path: Path) -> None:
    stage = Stage(path)
    with stage as client:
        asked = {"first": BEGIN.isoformat(), "last": (BEGIN + timedelta(seconds=90)).isoformat()}
        answer = client.export(**asked, format="csv")
        assert answer.status_code == 200, answer.text
        name = "history-20261103T060000Z-20261103T060130Z.csv"
        assert answer.headers["content-disposition"] == f'attachment; filename="{name}"'
        lines = answer.content.decode().splitlines()
        assert sum(line[:1].isdigit() for line in lines) == 90
        assert temporary_folders(stage.application) == []


def test_an_export_that_fails_says_why(path: Path) -> None:
    stage = Stage(path)
    with stage as client:
        early = {"first": "2001-01-01T00:00:00Z", "last": "2001-01-02T00:00:00Z", "format": "csv"}
        answer = client.export(**early)
        assert (answer.status_code, answer.json()["error"]) == (503, "history-export_empty")
        assert not hasattr(stage.application.state, "work")
        assert client.export(**SPAN, format="exe").status_code == 400
        assert client.export(format="csv").status_code == 400


@pytest.mark.parametrize(
    ("program", "limits", "key"),
    [
        ("import time; time.sleep(600)", {"longest_s": 0.3}, "history-export_late"),
        (
            "open('history.csv', 'wb').write(bytes(3_000_000)); import time; time.sleep(600)",
            {"folder_bytes": 1_000_000},
            "history-export_large",
        ),
    ],
)
def test_an_export_without_an_end_is_ended(
    path: Path, monkeypatch: pytest.MonkeyPatch, program: str, limits: dict[str, Any], key: str
) -> None:
    monkeypatch.setattr(
        _history_page, "EXPORT_LIMITS", _history_page.EXPORT_LIMITS._replace(**limits)
    )
    stage = Stage(path)
    with stage as client:
        stage.application.state.work = Work([sys.executable, "-c", program])
        answer = client.export(**SPAN, format="csv")  # in real time: a process sleeps too long
        assert (answer.status_code, answer.json()["error"]) == (413, key)
        assert temporary_folders(stage.application) == []


def test_the_databases_password_goes_to_the_command_in_a_private_file(path: Path) -> None:
    looks = (
        "import json, os, sys; name = sys.argv[sys.argv.index('--password-file') + 1];"
        "print(json.dumps([sys.argv[1:], open(name).read(), os.stat(name).st_mode & 0o777,"
        " dict(os.environ)]), file=open('history.csv', 'w'))"
    )
    stage = Stage(path)
    stage.parts.configuration.historian.password = Secret("open sesame")
    with stage as client:
        stage.application.state.work = Work([sys.executable, "-c", looks])
        answer = client.export(**SPAN, format="csv")
        words, told, mode, variables = json.loads(answer.content)
    assert (told, mode) == ("open sesame", 0o600)
    assert not any("sesame" in text for text in [*words, *variables.values()])


def test_an_address_alone_or_without_the_token_of_the_page_exports_nothing(client: Client) -> None:
    for method in ("GET", "HEAD"):
        asked = client.http.request(method, "/history/export", params={**SPAN, "format": "csv"})
        assert client.runner.run(asked).status_code == 405
    answer = client.runner.run(client.http.post("/history/export", params=SPAN))
    assert (answer.status_code, answer.json()["error"]) == (403, "login-token")


def test_a_failed_export_tells_a_viewer_no_place_of_this_computer(
    path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    says = "import sys; sys.exit('thermaxis: error: /srv/h.db\\n\\x1b[2Jloop@db.shop:5432 refused')"
    stage = Stage(path)
    with stage as client:
        stage.application.state.work = Work([sys.executable, "-c", says])
        answer = client.export(**SPAN, format="csv")
    assert (answer.status_code, answer.json()["error"]) == (503, "history-export_failed")
    assert not any(word in answer.text for word in ("/srv", "loop@", "5432", str(path)))
    message = caplog.messages[-1]
    assert "loop@db.shop:5432 refused" in message
    assert message.isprintable()  # one line, and nothing that a terminal obeys


WRITES = "open('history.csv', 'wb').write(b'1' * 300_000)"


class Taker:
    """A browser that takes an export as fast as a test lets it."""

    def __init__(self, application: Starlette) -> None:
        self.application = application
        self.begun, self.go_on = asyncio.Event(), asyncio.Event()
        self.statuses: list[int] = []

    async def take(self) -> None:
        query = "&".join([*(f"{k}={v.replace('+', '%2B')}" for k, v in SPAN.items()), "format=csv"])
        scope = {
            "type": "http",
            "method": "POST",
            "path": "/history/export",
            "query_string": query.encode(),
            "headers": [(b"x-thermaxis-token", TOKEN.encode()), (b"host", b"127.0.0.1:8450")],
            "client": ("127.0.0.1", 50000),
        }

        async def receive() -> Any:
            await asyncio.Event().wait()

        async def send(message: Any) -> None:
            if message["type"] == "http.response.start":
                self.statuses.append(message["status"])
            self.begun.set()
            await self.go_on.wait()

        await self.application(scope, receive, send)


def test_an_export_holds_its_place_until_it_was_taken_and_its_folder_is_gone(path: Path) -> None:
    async def two() -> list[int]:
        first, second, third = (Taker(stage.application) for _ in range(3))
        async with asyncio.TaskGroup() as group:
            group.create_task(first.take())
            await first.begun.wait()
            assert len(temporary_folders(stage.application)) == 1
            second.go_on.set()
            await second.take()  # the same person, while the first is being sent
            first.go_on.set()
        assert temporary_folders(stage.application) == []
        third.go_on.set()
        await third.take()
        return [*first.statuses, *second.statuses, *third.statuses]

    stage = Stage(path)
    stage.application.state.work = Work([sys.executable, "-c", WRITES])
    with stage as client:
        assert client.runner.run(two()) == [200, 429, 200]


def test_an_export_that_is_not_taken_is_given_up_and_leaves_nothing(
    path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(_history_page, "SEND_S", 0.05)
    stage = Stage(path)
    work = stage.application.state.work = Work([sys.executable, "-c", WRITES])
    with stage as client:
        client.runner.run(Taker(stage.application).take())
        assert temporary_folders(stage.application) == []
        with work.place("Nováková"):
            pass


def test_exports_leave_places_to_evaluations(path: Path) -> None:
    stage = Stage(path)
    work = stage.application.state.work = Work([sys.executable, "-c", WRITES])
    with stage as client, contextlib.ExitStack() as taken:
        for name in ("novak", "svoboda")[: _history_page.EXPORTS]:
            taken.enter_context(work.place(name, kind="export"))
        answer = client.export(**SPAN, format="csv")
        assert (answer.status_code, answer.json()["error"]) == (429, "history-export_busy")
        with work.place("an engineer"), work.place("another"):
            pass
