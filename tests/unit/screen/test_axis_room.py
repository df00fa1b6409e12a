"""Runs that somebody uploads: what comes back, to whom, and what hostile ones cannot do."""

import asyncio
import io
import json
import os
import re
import sys
import tempfile
import textwrap
import zipfile
from collections.abc import AsyncIterator, Callable, Iterator, Sequence
from contextlib import AbstractContextManager
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any, Self, cast
from urllib.parse import urlencode

import httpx2 as httpx
import pytest

from tests.commands_here import WorkHere
from tests.proofs import quick_first
from tests.unit.screen.people import TOKEN, People
from tests.unit.screen.stand import application, parts
from thermaxis.app import _rooms
from thermaxis.app._rooms import file_stem, shown_name
from thermaxis.app.axis._forms import LARGEST_TABLE_BYTES
from thermaxis.app.axis._room import KEPT_S, LARGEST_BYTES, MOST_OF_A_PERSON, stored_name
from thermaxis.codes import Message, Place
from thermaxis.files import read_positioning
from thermaxis.messages import sentence, text_of
from thermaxis.positioning import (
    FIGURE_KEYS,
    evaluate_drift,
    evaluate_iso230_2,
    evaluate_vdi_dgq_3441,
    figures_by_key,
)
from thermaxis.report.charts._figures import Chart
from thermaxis.runtime import Role
from thermaxis.screen.pages import positioning_page as _positioning_page
from thermaxis.web.work._work import MOST_WAITING, Work

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="the limits are those of Linux")

EXAMPLES = Path(__file__).parents[3] / "examples"
NOW = datetime(2026, 11, 21, 9, 30, tzinfo=UTC)


class Clock:
    """A clock that a test sets."""

    def __init__(self) -> None:
        self.now_s = 0.0

    def monotonic_s(self) -> float:
        return self.now_s

    def utc(self) -> datetime:
        return NOW + timedelta(seconds=self.now_s)


class Stage:
    """The page without a socket, and somebody in front of it."""

    def __init__(
        self,
        where: Path,
        program: tuple[str, ...] | None = None,
        *,
        kind: type[Work] = Work,
        **settings: Any,
    ) -> None:
        self.where = where
        self.clock = Clock()
        self.people = People(cast("Any", self.clock)).come(Role.ENGINEER)
        given = parts(
            people=self.people,
            clock=self.clock,
            **{"view_without_login": False, **settings},
        )
        self.application = application(given, _positioning_page.routes(given))
        self.runner = asyncio.Runner()
        self.work = self.runner.run(self._made(kind, program))
        self.application.state.work = self.work
        transport = httpx.ASGITransport(self.application)
        self.http = httpx.AsyncClient(transport=transport, base_url="http://127.0.0.1:8450")

    async def _made(self, kind: type[Work], program: tuple[str, ...] | None) -> Work:
        return kind(program, where=self.where)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.runner.run(self.http.aclose())
        self.work.close()
        self.runner.close()

    async def sent(self, body: Any, headers: dict[str, str] | None = None, **asked: str) -> Any:
        return await self.http.post(
            f"/positioning/upload?{urlencode(asked)}",
            content=body,
            headers={"X-Thermaxis-Token": TOKEN} | (headers or {}),
            timeout=60.0,
        )

    def send(self, body: Any, headers: dict[str, str] | None = None, **asked: str) -> Any:
        return self.runner.run(self.sent(body, headers, **asked))

    def get(self, address: str, **headers: str) -> httpx.Response:
        return self.runner.run(self.http.get(address, headers=headers))

    def leaves(self, key: str) -> None:
        """End the log-in of whoever is in front."""
        assert self.people.in_front is not None
        self.people.end(self.people.in_front, key)

    def owners(self) -> list[str]:
        """Return who has a place."""
        return [taken.owner for taken in self.work._places]

    def folders(self) -> list[Path]:
        """Return the folders of uploads that are still there."""
        roots = self.where.glob("thermaxis-work-*")
        found = [path for root in roots for path in root.iterdir()]
        return [path for path in found if path.name not in ("lock", "settings")]


def a_program(tmp_path: Path, text: str) -> tuple[str, ...]:
    path = tmp_path / "command.py"
    path.write_text(textwrap.dedent(text))
    return (sys.executable, "-I", "-S", str(path))


def kept_places(text: str, where: Path) -> list[str]:
    """Return places of this computer that stand in an answer."""
    places = (str(where), tempfile.gettempdir(), sys.prefix, str(EXAMPLES.parent), "thermaxis-work")
    return [place for place in places if place in text]


# ---- real runs ----------------------------------------------------------------------------------


def run_of(cycles: int) -> bytes:
    """Return the first cycles of the example."""
    lines = (EXAMPLES / "x_axis_100_cycles.csv").read_text(encoding="utf-8").splitlines()
    head = [line for line in lines if not line[:1].isdigit()]
    rows = [line for line in lines[len(head) :] if int(line.split(",")[2]) <= cycles]
    return "\n".join([*head, *rows, ""]).encode("utf-8")


RUN = run_of(20)


class Real:
    """One real run with head and limits, and everything that was answered about it."""

    def __init__(self, where: Path) -> None:
        run = RUN
        head = (EXAMPLES / "header.toml").read_bytes()
        limits = (EXAMPLES / "limits.toml").read_bytes()
        with Stage(where, kind=WorkHere) as stage:
            answer = stage.send(
                run + head + limits,
                name=r"C:\Läufe\osa X <script>.csv",
                head_bytes=str(len(head)),
                limits_bytes=str(len(limits)),
                edition="vdi3441",
            )
            assert answer.status_code == 200, answer.text
            self.shown: dict[str, Any] = answer.json()
            key = self.shown["id"]
            self.again = stage.get(f"/positioning/result/{key}")
            german = stage.get(f"/positioning/result/{key}", **{"accept-language": "de"})
            self.in_german: dict[str, Any] = german.json()
            self.listed = stage.get("/positioning/results")
            self.report = stage.get(f"/positioning/report/{key}")
            self.certificate = stage.get(f"/positioning/certificate/{key}")
            stage.people.come(Role.ENGINEER)  # the same name, another log-in
            self.others = [
                stage.get(f"/positioning/{kind}/{key}")
                for kind in ("result", "report", "certificate")
            ]
            self.list_of_another = stage.get("/positioning/results")


@pytest.fixture(scope="module")
def real(
    tmp_path_factory: pytest.TempPathFactory,
    fitted_once: Callable[[], AbstractContextManager[None]],
) -> Real:
    with fitted_once(), pytest.MonkeyPatch.context() as patch:
        patch.setattr(Chart, "svg", lambda *_, **__: b'<svg xmlns="http://www.w3.org/2000/svg"/>')
        return Real(tmp_path_factory.mktemp("real"))


def test_the_figures_are_those_of_the_evaluation_itself(real: Real, tmp_path: Path) -> None:
    (tmp_path / "run.csv").write_bytes(RUN)
    test = read_positioning(tmp_path / "run.csv")
    iso230_2 = evaluate_iso230_2(test)
    assert real.shown["vdi3441"]["Pa"] == pytest.approx(evaluate_vdi_dgq_3441(test).Pa)
    drift_free = figures_by_key(evaluate_drift(test).figures)
    rows = real.shown["figure_table"]
    assert [one["figure"] for one in rows] == list(FIGURE_KEYS)
    for one in rows:
        assert one["value"] == pytest.approx(getattr(iso230_2, one["figure"]), rel=1e-12)
        assert one["drift_free"] == pytest.approx(drift_free[one["figure"]], rel=1e-9)
        assert one["expanded_uncertainty"] > 0.0
        assert one["drift_free_expanded_uncertainty"] > 0.0


def test_limits_that_go_along_decide(real: Real) -> None:
    limits = {"B": 5.0, "E": 20.0, "R": 15.0, "A": 25.0}
    figures = {one["figure"]: one for one in real.shown["figure_table"]}
    assert {key: one["limit"] for key, one in figures.items() if one["limit"]} == limits
    for key, one in figures.items():
        within = key in limits and one["value"] <= limits[key]
        assert one["verdict"] == ("pass" if within else None)
    assert real.shown["limits"]["verdict"] == "pass"
    assert real.shown["limits"]["decision_rule"] == "simple"


def test_the_facts_of_the_run_and_what_is_said_about_it_are_shown(real: Real) -> None:
    shown, german = real.shown, real.in_german
    assert shown["name"] == "osa X <script>.csv"  # without its folder
    test = shown["test"]
    assert (len(test["targets"]), test["cycles"], test["cycle"]) == (16, 20, "standard")
    assert (test["kind"], shown["iso230_2"]["edition"]) == ("linear", "2014")
    assert test["header"]["machine"] == "virtual milling machine"  # of the head that went along
    assert shown["vdi3441"]["mark"]
    for approach in ("forward", "backward"):
        found = shown["adjacent_difference"][approach]["anomalies"]
        assert 3 in {one["position"] for one in found}
    assert shown["drift"]["model"] == "smooth"
    texts = [[one["text"] for one in told["drift"]["diagnosis"]] for told in (shown, german)]
    assert any("Target 3" in text for text in texts[0])
    assert any("Zielposition 3 (40,675 mm)" in text for text in texts[1])
    left_out = shown["uncertainty"]["measured"]["left_out"]
    assert left_out == ["instrument and environment: no budget was given"]
    assert any("20 cycles" in text for text in shown["warnings"])
    assert any("20 Zyklen" in text for text in german["warnings"])
    assert real.again.json() == shown
    assert [one["id"] for one in real.listed.json()["results"]] == [shown["id"]]


def test_the_report_comes_in_a_sandbox_and_the_certificate_as_a_download(real: Real) -> None:
    assert real.report.status_code == 200
    assert "<h1" in real.report.text
    policy = real.report.headers["content-security-policy"]
    assert "sandbox" in [part.strip() for part in policy.split(";")]
    assert "default-src 'none'" in policy
    assert "script" not in policy
    assert "frame-ancestors 'self'" in policy
    assert real.certificate.content.startswith(b"%PDF-")
    assert (
        real.certificate.headers["content-disposition"]
        == 'attachment; filename="osa_X_script-certificate.pdf"'
    )


def test_no_place_of_this_computer_stands_in_what_comes_back(real: Real, tmp_path: Path) -> None:
    where = tmp_path.parent
    answers = (real.again, real.listed, real.report, real.certificate)
    for answer in answers:
        assert kept_places(answer.content.decode("latin-1"), where) == []


def test_a_result_is_not_there_for_anybody_else(real: Real) -> None:
    assert [answer.status_code for answer in real.others] == [404, 404, 404]
    assert {answer.json()["error"] for answer in real.others} == {"room-gone"}
    assert real.list_of_another.json() == {"results": []}


# ---- hostile contents, by the real program ------------------------------------------------------


def zip_bomb() -> bytes:
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as archive:
        archive.writestr("[Content_Types].xml", "<Types/>")
        archive.writestr("xl/workbook.xml", "<workbook/>")
        archive.writestr("xl/worksheets/sheet1.xml", b" " * 300_000_000)
    return packed.getvalue()


CONTENTS = {
    "no unicode": lambda: "úchylka;ěščř\n".encode("utf-16"),
    "one endless line": lambda: b"1," * 3_000_000,
    "a zip bomb": zip_bomb,
}


@pytest.mark.parametrize("content", quick_first(2, CONTENTS))
def test_what_is_no_run_is_refused_in_the_words_of_the_evaluation(
    content: str, tmp_path: Path
) -> None:
    with Stage(tmp_path) as stage:
        answer = stage.send(CONTENTS[content](), name="../../etc/lauf.xlsx")
        assert answer.status_code == 422
        found = answer.json()
        assert found["error"] == "room-refused"
        assert found["text"].startswith("This cannot be done: ")
        assert "lauf.xlsx" in found["text"]
        assert "run.xlsx" not in found["text"]
        assert not re.search(r"(^|\s)/", found["text"])
        assert kept_places(found["text"], tmp_path) == []
        assert stage.folders() == []
        assert stage.get("/positioning/results").json() == {"results": []}


def test_a_wrong_file_of_limits_is_named_as_such(tmp_path: Path) -> None:
    run = (EXAMPLES / "x_axis_100_cycles.csv").read_bytes()
    limits = b"[limits]\nQ_um = 1.0\n"
    with Stage(tmp_path, kind=WorkHere) as stage:
        answer = stage.send(
            run + limits, name="x.csv", limits_bytes=str(len(limits)), no_drift="yes"
        )
    assert answer.status_code == 422
    assert "limits.toml" in answer.json()["text"]
    assert "Q_um" in answer.json()["text"]
    assert kept_places(answer.text, tmp_path) == []


# ---- size, time and shape of an upload, with commands of the test --------------------------------

CANNED = """
import json, sys
from pathlib import Path
Path("words").write_text(json.dumps(sys.argv[1:]))
sys.stdout.write(Path({canned!r}).read_text())
if "--report=report.html" in sys.argv:
    Path("report.html").write_text("<p>report of " + Path(sys.argv[2]).read_text() + "</p>")
if "--report=certificate.pdf" in sys.argv:
    Path("certificate.pdf").write_text("%PDF-" + json.dumps(
        {{"words": sys.argv[1:],
          "files": {{p.name: p.read_text() for p in Path(".").glob("*.toml")}},
          "runs": [p.name for p in Path(".").glob("run*")]}}
    ))
for option, _, name in (word.partition("=") for word in sys.argv):
    if option == "--figures":
        Path(name).mkdir()
    if option in ("--report", "--output") and not Path(name).exists():
        Path(name).write_text(option)
"""


@pytest.fixture(scope="module")
def canned(tmp_path_factory: pytest.TempPathFactory) -> Path:
    from thermaxis.cli import main  # noqa: PLC0415 - one evaluation for all

    path = tmp_path_factory.mktemp("canned") / "result.json"
    run = EXAMPLES / "y_axis_50_cycles.rtl"
    assert main(["evaluate", str(run), "--no-drift", "--json", str(path)]) == 0
    return path


@pytest.fixture
def stage(tmp_path: Path, canned: Path) -> Iterator[Stage]:
    with Stage(tmp_path, a_program(tmp_path, CANNED.format(canned=str(canned)))) as made:
        yield made


def heard(stage: Stage, answer: Any) -> dict[str, Any]:
    """Return what the command of the test was told."""
    assert answer.status_code == 200, answer.text
    found = stage.get(f"/positioning/certificate/{answer.json()['id']}").content
    return cast("dict[str, Any]", json.loads(found.removeprefix(b"%PDF-")))


def test_run_head_and_limits_arrive_apart(stage: Stage) -> None:
    answer = stage.send(
        b"the run" + b"the head" + b"the limits", name="a.csv", head_bytes="8", limits_bytes="10"
    )
    told = heard(stage, answer)
    assert told["files"] == {"head.toml": "the head", "limits.toml": "the limits"}
    report = stage.get(f"/positioning/report/{answer.json()['id']}")
    assert report.text == "<p>report of the run</p>"


def test_options_become_words_of_a_fixed_list(stage: Stage) -> None:
    asked = {"cycle": "pilgrim", "edition": "1997", "reference_time": "2.5"}
    told = heard(stage, stage.send(b"1", name="a.rtl", full="yes", no_drift="no", **asked))
    date = (NOW.astimezone()).date().isoformat()
    assert told["words"] == [
        *("evaluate", "run.rtl", "--json=-", f"--date={date}", "--source-name=a.rtl"),
        *("--cycle=pilgrim", "--edition=1997", "--reference-time=2.5", "--full"),
        "--report=certificate.pdf",
    ]


WRONG_OPTIONS = (
    {"cycle": "--json"},
    {"edition": "2014; rm"},
    {"encoding": "../../etc/passwd"},
    {"units": "mm,um --output=x"},
    {"reference_cycle": "1" * 41},
    {"reference_cycle": "٣"},
    {"no_drift": "1"},
    {"head_bytes": "-5"},
)


def test_an_option_that_is_none_is_refused(stage: Stage) -> None:
    for asked in WRONG_OPTIONS:
        answer = stage.send(b"1", name="a.csv", **asked)
        found = answer.status_code, answer.json()["error"]
        assert found == (400, "room-bad_option"), asked
    assert stage.folders() == []


def test_an_upload_of_the_largest_size_is_taken_and_one_byte_more_is_not(stage: Stage) -> None:
    answer = stage.send(b"x" * LARGEST_BYTES, name="a.csv")
    assert answer.status_code == 200
    report = stage.get(f"/positioning/report/{answer.json()['id']}")
    assert len(report.content) == LARGEST_BYTES + len("<p>report of </p>")
    kept = stage.folders()
    answer = stage.send(b"x" * (LARGEST_BYTES + 1), name="a.csv")
    assert answer.status_code == 413
    assert answer.json()["error"] == "room-too_large"
    assert stage.folders() == kept


def test_an_endless_upload_ends_at_the_limit_though_it_states_no_length(stage: Stage) -> None:
    given = 0

    async def endless() -> AsyncIterator[bytes]:
        nonlocal given
        while given < 10 * LARGEST_BYTES:
            given += 1_000_000
            yield b"x" * 1_000_000

    answer = stage.send(endless(), name="a.csv")
    assert answer.status_code == 413
    assert given <= LARGEST_BYTES + 3_000_000
    assert stage.folders() == []


def test_an_upload_without_a_run_is_refused(stage: Stage) -> None:
    for body, asked, found in (
        (b"", {}, (400, "room-empty")),
        (b"head", {"head_bytes": "4"}, (400, "room-empty")),
        (b"12", {"limits_bytes": "60000"}, (400, "room-empty")),
        (b"x", {"head_bytes": f"{LARGEST_TABLE_BYTES + 1}"}, (413, "positioning-table_too_large")),
    ):
        answer = stage.send(body, name="a.csv", **asked)
        assert (answer.status_code, answer.json()["error"]) == found
    assert stage.folders() == []


def test_an_upload_that_does_not_come_is_given_up(
    stage: Stage, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(_rooms, "UPLOAD_S", 0.05)

    async def stuck() -> AsyncIterator[bytes]:
        yield b"begin"
        await asyncio.Event().wait()

    answer = stage.send(stuck(), name="a.csv")
    assert answer.status_code == 408
    assert stage.folders() == []


def test_nothing_stays_of_an_upload_that_breaks_off(stage: Stage) -> None:
    messages = [
        {"type": "http.request", "body": b"begin", "more_body": True},
        {"type": "http.disconnect"},
    ]
    said: list[Any] = []

    async def receive() -> Any:
        return messages.pop(0)

    async def send(message: Any) -> None:
        said.append(message)

    scope = {
        "type": "http",
        "method": "POST",
        "path": "/positioning/upload",
        "query_string": b"name=a.csv",
        "headers": [(b"x-thermaxis-token", TOKEN.encode())],
        "server": ("127.0.0.1", 8450),
        "scheme": "http",
        "http_version": "1.1",
    }
    stage.runner.run(stage.application(cast("Any", scope), receive, cast("Any", send)))
    assert said[0]["status"] == 400
    assert stage.folders() == []
    assert heard(stage, stage.send(b"1", name="a.csv"))["words"][0] == "evaluate"


def test_uploads_beyond_those_that_may_wait_are_refused(stage: Stage) -> None:
    async def crowd(names: Sequence[str]) -> list[tuple[int, str]]:
        calls: list[asyncio.Task[Any]] = []
        for name in names:
            stage.people.come(Role.ENGINEER, name)
            calls.append(asyncio.create_task(stage.sent(b"x", name="a.csv")))
            while not calls[-1].done() and stage.owners().count(name) == 0:
                await asyncio.sleep(0)  # until it has its place
        answers = await asyncio.gather(*calls)
        return [(one.status_code, one.json().get("error", "")) for one in answers]

    all_of_them = [f"engineer-{k}" for k in range(MOST_WAITING + 3)]
    in_time, too_many = (200, ""), (429, "room-busy")
    assert stage.runner.run(crowd(all_of_them)) == [in_time] * (MOST_WAITING + 1) + [too_many] * 2
    assert stage.send(b"x", name="a.csv").status_code == 200


def test_a_second_upload_of_the_same_person_is_refused_until_the_first_is_done(
    stage: Stage,
) -> None:
    async def two() -> list[tuple[int, str]]:
        calls = [stage.sent(b"x", name="a.csv") for _ in range(2)]
        answers = await asyncio.gather(*calls)
        return sorted((one.status_code, one.json().get("error", "")) for one in answers)

    assert stage.runner.run(two()) == [(200, ""), (429, "room-own")]
    assert stage.runner.run(two()) == [(200, ""), (429, "room-own")]


# ---- names --------------------------------------------------------------------------------------

NAMES = (
    "../../etc/passwd",
    "<script>alert(1)</script>.csv",
    "a" * 10_000 + ".csv",
    "bell\x07 line\nend\r\x00.csv",
    "",
    "-rf.csv",
    "\u202egpj.csv",
    'a"; filename="b.exe',
    "C:\\Windows\\system32\\run.dat",
)


@pytest.mark.proof
def test_no_name_becomes_a_path_a_word_or_a_header(stage: Stage) -> None:
    for name in NAMES:
        answer = stage.send(b"1", name=name)
        told = heard(stage, answer)
        assert re.fullmatch(r"run(_ISO230)?\.(rtl|csv|dat|xlsx|txt)", told["words"][1])
        assert told["runs"] == [told["words"][1]]
        shown = answer.json()["name"]
        assert 0 < len(shown) <= 120
        assert shown.isprintable()
        certificate = stage.get(f"/positioning/certificate/{answer.json()['id']}")
        offered = certificate.headers["content-disposition"]
        assert re.fullmatch(r'attachment; filename="[A-Za-z0-9_-]{1,60}-certificate\.pdf"', offered)


def test_names_are_stored_shown_and_offered_as_known() -> None:
    for given, stored, shown, stem in (
        ("axis X.RTL", "run.rtl", "axis X.RTL", "axis_X"),
        ("x_iso230.DAT", "run_ISO230.dat", "x_iso230.DAT", "x_iso230"),
        ("x.dat", "run.dat", "x.dat", "x"),
        ("virus.exe", "run.txt", "virus.exe", "virus"),
        ("../../etc/passwd", "run.txt", "passwd", "passwd"),
        ("/", "run.txt", "run", "run"),
        ("ěšč", "run.txt", "ěšč", "ěšč"),
    ):
        assert (stored_name(given), shown_name(given)) == (stored, shown)
        assert file_stem(shown_name(given)) == stem


# ---- commands that go wrong ---------------------------------------------------------------------

WRONG = {
    "hangs": ("import time; time.sleep(600)", "room-too_long"),
    "is ended by the system": ("import os; os.kill(os.getpid(), 9)", "room-too_hungry"),
    "eats": ("hoard = [bytes(100_000_000) for _ in range(90)]", "room-too_hungry"),
    "floods": ("while True: print('x' * 65536)", "room-too_much"),
    "raises": ("raise RuntimeError(__file__)", "room-crashed"),
    "refuses without a word": ("import sys; sys.exit(2)", "room-crashed"),
    "refuses in an odd way": ("print('[1]'); raise SystemExit(2)", "room-crashed"),
}


@pytest.mark.parametrize("kind", WRONG)
def test_a_command_that_goes_wrong_is_told_in_words_and_leaves_nothing(
    kind: str, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    text, key = WRONG[kind]
    allowed_s = 1.0 if kind == "hangs" else 50.0  # no other reaches it on a computer under load
    with Stage(tmp_path, a_program(tmp_path, text), evaluation_s=allowed_s) as stage:
        answer = stage.send(b"1", name="a.csv", headers={"Accept-Language": "de"})
        assert answer.status_code == 422
        assert answer.json()["error"] == key
        assert answer.json()["text"] == sentence(key, {"limit": f"{allowed_s:.0f}"}, language="de")
        assert kept_places(answer.text, tmp_path) == []
        assert stage.folders() == []
        assert stage.get("/positioning/results").status_code == 200  # the page goes on
    assert ("RuntimeError" in caplog.text) == (
        kind == "raises"
    )  # the log has what the page has not


def test_places_that_the_command_names_do_not_reach_the_page(tmp_path: Path) -> None:
    text = """
        import json, os, sys
        here = os.getcwd()
        values = {"cause": f"see {here}, and run.csv, not {sys.prefix}/lib", "name": [here, 3.5]}
        place = {"file": f"{here}/run.csv", "line": 3}
        error = {"code": "file_unreadable", "values": values, "place": place, "text": here}
        print(json.dumps({"error": error}))
        sys.exit(2)
        """
    with Stage(tmp_path, a_program(tmp_path, text)) as stage:
        found = stage.send(b"1", name="mine.csv").json()
    cause = "see , and mine.csv, not lib"
    said = text_of(Message("error-file_unreadable", {"cause": cause}, Place("mine.csv", line=3)))
    assert found["text"] == f"This cannot be done: {said}"
    assert cause in said


# ---- who may ------------------------------------------------------------------------------------


def test_nobody_sends_files_where_everybody_may_look(tmp_path: Path) -> None:
    with Stage(tmp_path, view_without_login=True) as stage:
        stage.people.come(None)
        assert stage.send(b"1", name="a.csv").status_code == 401
        page = stage.get("/positioning")
        assert page.status_code == 200
        assert "run-form" not in page.text


def test_an_id_that_is_none_is_not_found(stage: Stage) -> None:
    for key in ("", "x", "../../lock", "0" * 32, "%2e%2e%2flock", "ž"):
        assert stage.get(f"/positioning/report/{key}").status_code == 404, key


# ---- how long -----------------------------------------------------------------------------------


def test_results_go_after_an_hour(stage: Stage) -> None:
    key = stage.send(b"1", name="a.csv").json()["id"]
    stage.clock.now_s = KEPT_S
    assert stage.get(f"/positioning/report/{key}").status_code == 200
    stage.clock.now_s = KEPT_S + 1.0
    assert stage.get(f"/positioning/report/{key}").status_code == 404
    assert stage.folders() == []


def test_results_go_with_the_log_in_though_nobody_asks_again(
    stage: Stage, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("thermaxis.app._shelf.SWEEP_S", 0.01)
    stage.send(b"1", name="a.csv")
    stage.send(b"1", name="b.csv")
    assert len(stage.folders()) == 2
    stage.leaves("login-out")

    async def look() -> None:
        async with asyncio.timeout(20.0):
            while stage.folders():
                await asyncio.sleep(0.01)

    stage.runner.run(look())
    stage.people.come(Role.ENGINEER, "svoboda")
    assert stage.get("/positioning/results").json() == {"results": []}
    assert stage.send(b"1", name="c.csv").status_code == 200  # and it is looked after again
    stage.leaves("login-out")
    stage.runner.run(look())


def test_what_is_made_of_a_run_is_made_once_when_it_is_asked_for(stage: Stage) -> None:
    key = stage.send(b"x" * 100_000, name="a.csv").json()["id"]
    (folder,) = stage.folders()
    assert not (folder / "certificate.pdf").exists()
    made = [stage.get(f"/positioning/certificate/{key}").content for _ in range(2)]
    assert made[0] == made[1] == (folder / "certificate.pdf").read_bytes()
    for kind, name in (
        ("page", "certificate.html"),
        ("dcc", "certificate.xml"),
        ("charts", "charts.zip"),
        ("csv", "run.tidy.csv"),
        ("json", "results.json"),
    ):
        answer = stage.get(f"/positioning/{kind}/{key}")
        assert answer.headers["content-disposition"] == f'attachment; filename="a-{name}"'
        assert (folder / name).read_bytes() == answer.content


def test_a_full_disk_is_told_in_words(stage: Stage, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(_: Work) -> None:
        raise OSError(28, "No space left on device", "/srv/place")

    with monkeypatch.context() as patched:
        patched.setattr(Work, "folder", full)
        answer = stage.send(b"1", name="a.csv")
    assert (answer.status_code, answer.json()["error"]) == (507, "room-not_stored")
    assert "/srv" not in answer.text
    assert stage.send(b"1", name="a.csv").status_code == 200


def test_the_oldest_result_goes_when_there_are_too_many(stage: Stage) -> None:
    keys: list[str] = []
    for k in range(MOST_OF_A_PERSON + 1):
        stage.clock.now_s = float(k)
        keys.append(stage.send(b"1", name=f"{k}.csv").json()["id"])
    rows = stage.get("/positioning/results").json()["results"]
    assert [row["id"] for row in rows] == keys[:0:-1]
    assert rows[0]["at"] == (NOW + timedelta(seconds=MOST_OF_A_PERSON)).isoformat()
    assert len(stage.folders()) == MOST_OF_A_PERSON


def test_the_largest_sum_of_all_results_is_kept_to(
    tmp_path: Path, canned: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("thermaxis.app.axis._room.MOST_BYTES", 2_500_000)
    with Stage(tmp_path, a_program(tmp_path, CANNED.format(canned=str(canned)))) as stage:
        keys = [stage.send(b"x" * 1_000_000, name="a.csv").json()["id"] for _ in range(4)]
        rows = stage.get("/positioning/results").json()["results"]
        assert [row["id"] for row in rows] == keys[:1:-1]
        assert len(stage.folders()) == 2


# ---- page ---------------------------------------------------------------------------------------


def test_the_page_has_its_form(stage: Stage) -> None:
    page = stage.get("/positioning", **{"accept-language": "cs"}).text
    for key in ("positioning-title", "positioning-submit", "positioning-cycle_pilgrim"):
        assert sentence(key, language="cs") in page
    assert re.search(r"<iframe[^>]*\bsandbox\b(?!=)", page)
    assert 'data-largest="20000000"' in page
    assert os.sep + "tmp" not in page
