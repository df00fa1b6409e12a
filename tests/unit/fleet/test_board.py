"""The morning board: what it says of a registry, who decides there, and what it refuses."""

import asyncio
import re
from collections.abc import Iterator
from dataclasses import replace
from datetime import timedelta
from html import unescape
from pathlib import Path
from typing import Any
from urllib.parse import quote

import httpx2 as httpx
import pytest

from tests.unit.fleet.axis_histories import history
from tests.unit.fleet.fleet_machines import GAIN, LAST, machine_of, model_of
from tests.unit.runtime.status_server_parts import HandClock
from thermaxis.board import MOST_LINES, Need, board_application, board_settings, lines_of
from thermaxis.codes import Message, Place, remark
from thermaxis.errors import ConfigurationError
from thermaxis.files import model_sha256, parse_model
from thermaxis.fleet import ADDED, SISTERS, Cause, NightOutcome, NightResult, OutputNight, Registry
from thermaxis.messages import LANGUAGES, sentence
from thermaxis.runtime import Role, User, hash_password, write_users
from thermaxis.screen.access._user_sessions import KEEP_ALIVE_S

HOST = "127.0.0.1:8470"
HERE = f"http://{HOST}"
PASSWORD = "right horse staple"  # noqa: S105 - of users who do not exist
HASH = hash_password(PASSWORD)
MARKUP = "Mill <b>7</b> & co"
STUCK = Message(
    "log-stuck",
    {"name": "T_spindle_C", "value": 24.1, "unit": "degC", "lasts_s": 86400.0, "row": 1},
    Place(channel="T_spindle_C"),
)
FIGURES = OutputNight(
    rows=1440,
    fit_percent=80.0,
    uncompensated_um=20.0,
    rmse_um=1.25,
    mae_um=1.0,
    mean_um=-0.5,
    max_um=4.0,
    touches=96,
    held_mae_um=1.5,
    offset_mae_um=0.75,
    within_two_sigma=0.95,
)


def night_of(name: str, days: int = 0, **found: Any) -> NightResult:
    """Return a night of a machine, so many days before the last one."""
    usual: dict[str, Any] = {"outcome": NightOutcome.VERIFIED, "outputs": {"Z_um": FIGURES}}
    return NightResult(
        machine=name,
        day=LAST - timedelta(days=days),
        model_sha256=machine_of(name).model_sha256,
        **{**usual, **found},
    )


@pytest.fixture
def registry(tmp_path: Path) -> Iterator[Registry]:
    """Five machines: sound, frozen, set aside, with a proposal, and without any night."""
    with Registry.make(f"sqlite:///{tmp_path / 'registry.db'}", "lake") as made:
        for name in ("sound", MARKUP, "aside", "better", "new"):
            made.add(replace(machine_of(name), kind="lathe" if name == "new" else "mill"), "first")
        made.record([night_of("better", 1), night_of("better", proposal=model_of(1.1 * GAIN))])
        failed = remark("night_failed", failure="ValueError: <script>")
        made.record(
            [
                night_of("sound"),
                night_of("sound", 1, sensors=(STUCK,)),
                night_of(MARKUP, sensors=(STUCK,)),
                night_of("aside", outcome=NightOutcome.SET_ASIDE, outputs=None, remarks=(failed,)),
            ]
        )
        yield made


class Browser:
    """Somebody who looks at the board, without a socket."""

    def __init__(self, registry: Registry, users: Path | None = None) -> None:
        self.runner, self.clock, self.token = asyncio.Runner(), HandClock(), ""
        settings = board_settings()
        self.app = board_application(registry, settings, [HOST], users, self.clock)
        self.http = httpx.AsyncClient(transport=httpx.ASGITransport(self.app), base_url=HERE)
        self.runner.run(self._open())

    async def _open(self) -> None:
        begun, self.end = asyncio.Event(), asyncio.Event()
        said = iter(("lifespan.startup", "lifespan.shutdown"))

        async def receive() -> dict[str, str]:
            kind = next(said)
            if kind == "lifespan.shutdown":
                await self.end.wait()
            return {"type": kind}

        async def send(message: Any) -> None:
            assert not message["type"].endswith("failed"), message
            begun.set()

        scope = {"type": "lifespan", "asgi": {"version": "3.0"}}
        self.task = asyncio.create_task(self.app(scope, receive, send))
        await begun.wait()

    async def _close(self) -> None:
        await self.http.aclose()
        self.end.set()
        await self.task

    def close(self) -> None:
        self.runner.run(self._close())
        self.runner.close()

    def get(self, path: str, language: str = "en", page: bool = True) -> Any:
        headers = {"accept-language": language, **({"accept": "text/html"} if page else {})}
        return self.runner.run(self.http.get(path, headers=headers))

    def post(self, path: str, body: Any, **headers: str) -> Any:
        marks = {"origin": HERE, "x-thermaxis-token": self.token, **headers}
        return self.runner.run(self.http.post(path, json=body, headers=marks))

    def log_in(self, name: str, password: str = PASSWORD) -> Any:
        answer = self.post("/login", {"name": name, "password": password})
        found = re.search(r'data-token="([^"]*)"', self.get("/").text)
        self.token = found[1] if found else ""
        return answer


@pytest.fixture
def browser(registry: Registry) -> Iterator[Browser]:
    made = Browser(registry)
    yield made
    made.close()


@pytest.fixture
def users(tmp_path: Path) -> Path:
    path = tmp_path / "users.toml"
    write_users([User("anna", Role.ENGINEER, HASH), User("jan", Role.OPERATOR, HASH)], path)
    return path


@pytest.fixture
def crew(registry: Registry, users: Path) -> Iterator[Browser]:
    made = Browser(registry, users)
    yield made
    made.close()


def text_of(html: str) -> str:
    return unescape(re.sub(r"\s+", " ", re.sub("<[^>]*>", " ", html)))


# ---- what it shows ------------------------------------------------------------------------------


def test_who_needs_a_look_comes_first_and_only_the_newest_night_counts(registry: Registry) -> None:
    lines = lines_of(registry.standings())
    assert [(line.machine, tuple(line.needs)) for line in lines] == [
        ("aside", (Need.SET_ASIDE,)),
        (MARKUP, (Need.SENSORS,)),
        ("better", (Need.PROPOSAL,)),
        ("new", ()),
        ("sound", ()),
    ]
    by_name = {line.machine: line for line in lines}
    assert by_name[MARKUP].needs[Need.SENSORS] == (STUCK,)
    assert by_name["new"].day is None
    assert by_name["sound"].worst["rmse_um"] == 1.25
    assert by_name["better"].proposed_sha256 == model_sha256(model_of(1.1 * GAIN))
    unwatched = {line.machine for line in lines_of(registry.standings(), day=LAST) if line.needs}
    assert unwatched == {"aside", MARKUP, "better", "new"}


def test_the_board_says_it_in_every_language_and_markup_of_names_is_text(browser: Browser) -> None:
    for language in LANGUAGES:
        page = browser.get("/", language).text
        assert "Mill &lt;b&gt;7&lt;/b&gt; &amp; co" in page
        assert "<script>" not in page
        assert "<b>7" not in page
        said = text_of(page)
        count = {"count": 3, "all": 5}
        for text in (
            sentence("fleet-named", count, language=language),
            sentence("fleet-title", {"day": LAST.isoformat()}, language=language),
            sentence("fleet-few", {"count": 4, "least": SISTERS}, language=language),
            sentence("log-stuck.remedy", language=language),
            sentence("fleet-outcome_none", language=language),
        ):
            assert text in said
        assert re.search(r">[a-z]+-[a-z_]+<", page) is None
    assert "1.25" in browser.get("/", "en").text
    assert "1,25" in browser.get("/", "cs").text


def test_a_named_machine_stands_with_its_cause_and_one_sensor_is_said_once(
    browser: Browser, registry: Registry
) -> None:
    registry.judge(LAST)
    (frozen,) = registry.judgements(LAST)
    wear = replace(frozen, machine="sound", causes=(Cause.DRIFT,), evidence=())
    lines = lines_of(registry.standings(), [wear, frozen])
    assert [(line.machine, tuple(line.needs)) for line in lines[:4]] == [
        ("aside", (Need.SET_ASIDE,)),
        ("sound", (Need.NAMED,)),
        (MARKUP, (Need.NAMED,)),
        ("better", (Need.PROPOSAL,)),
    ]
    registry.record([night_of("sound", -1)])  # nights of the next day begin to come
    page = browser.get(f"/machine?name={quote(MARKUP)}").text
    assert page.count(sentence("fleet-mark_named", {"cause": "sensor stands still"})) == 1
    for language in LANGUAGES:
        said = text_of(browser.get("/", language).text)
        assert sentence("cause-sensor_frozen", language=language) in said
        assert sentence("fault-sensor_frozen.remedy", language=language) in said
        assert sentence("log-stuck.remedy", language=language) not in said


def test_nothing_is_accepted_beside_a_sensor_that_is_named_and_the_page_says_so(
    crew: Browser, registry: Registry
) -> None:
    proposed = model_of(1.2 * GAIN)
    registry.record([night_of(MARKUP, 1, sensors=(STUCK,)), night_of("sound", 1)])
    stuck = replace(night_of("better", -1, sensors=(STUCK,)), proposal=proposed)
    registry.record([stuck, *(night_of(name, -1) for name in ("sound", "aside", MARKUP))])
    registry.judge(LAST + timedelta(days=1))
    crew.log_in("anna")
    for page in (crew.get("/").text, crew.get("/machine?name=better").text):
        assert sentence("fleet-sensors_first") in text_of(page)
        assert 'value="accept"' not in page
    asked = {**ASKED, "sha256": model_sha256(proposed)}
    assert crew.post("/decide", asked).status_code == 409
    assert crew.post("/decide", {**asked, "accepted": False}).status_code == 200


def test_what_is_decided_is_no_proposal_any_more_and_what_is_old_is_called_so(
    browser: Browser, registry: Registry
) -> None:
    old, new = PROPOSED[:12], model_sha256(model_of(1.2 * GAIN))[:12]
    unfit = Message("relearn-condemned", {"rule": "warning-not_fit"}, Place(channel="Z_um"))
    registry.record([night_of("better", -1, proposal=model_of(1.2 * GAIN))])
    registry.record([night_of("sound", -1, relearned=(unfit,))])
    registry.add(machine_of("added"), ADDED)
    for language in LANGUAGES:
        said = text_of(browser.get("/machine?name=better", language).text)
        for key, sha256 in (("fleet-superseded", old), ("fleet-open", new)):
            assert sentence(key, {"sha256": sha256}, language=language) in said
        why = sentence("unfit-warning-not_fit", language=language)
        assert why in text_of(browser.get("/machine?name=sound", language).text)
        page = browser.get("/machine?name=added", language).text
        assert text_of(page).count(f", {sentence('fleet-why_added', language=language)}") == 1
    registry.decide("better", accepted=False, who="Eva", why="worn")
    page = browser.get("/machine?name=better").text
    assert sentence("fleet-mark_proposed", {"sha256": new}) not in page
    assert sentence("fleet-mark_rejected", {"sha256": new, "who": "Eva", "why": "worn"}) in page


def test_the_axes_of_a_machine_stand_with_their_runs_and_what_changes(
    browser: Browser, registry: Registry
) -> None:
    for run in history([5.0, 7.0, 9.0, 11.0, 13.0]):
        registry.add_axis_run(replace(run, machine="sound"))
    page = browser.get("/machine?name=sound").text
    assert re.findall(r'<tr><td class="fleet-day">(\d{4})-', page)[:5] == [
        "2024",
        "2023",
        "2022",
        "2021",
        "2020",
    ]
    assert "X: B " in text_of(page)
    assert "Axis X" not in browser.get("/machine?name=new").text


@pytest.mark.proof
def test_kind_and_text_choose_and_what_is_too_many_is_said(
    browser: Browser, registry: Registry
) -> None:
    def named(query: str) -> list[str]:
        found = re.findall(r'href="/machine\?name=([^"]+)"', browser.get(f"/?{query}").text)
        return [unescape(one) for one in found]

    assert named("kind=lathe") == ["new"]
    assert named("text=BETT") == ["better"]
    assert named("kind=lathe&text=BETT") == []
    for k in range(MOST_LINES):
        registry.add(machine_of(f"M{k:03}"), "first")
    for more, said in ((3, True), (4, False)):  # beside four others
        registry.record([night_of(f"M{k:03}") for k in range(more)])
        few = sentence("fleet-few", {"count": 4 + more, "least": SISTERS})
        assert (few in text_of(browser.get("/?kind=lathe").text)) == said
    assert len(named("")) == MOST_LINES + 3
    assert sentence("fleet-more", {"count": 2}) in text_of(browser.get("/").text)


def test_a_machine_has_its_whole_story(browser: Browser, registry: Registry) -> None:
    page = browser.get("/machine?name=better").text
    proposed = model_sha256(model_of(1.1 * GAIN))[:12]
    said = text_of(page)
    for text in (proposed, machine_of("better").model_sha256[:12], "first", "−0.50", "0.75"):
        assert text in said
    story = re.search(r'id="story">(.*?)</script>', page)
    assert story is not None
    assert '"rmse":[1.25,1.25]' in story[1]
    assert f"model {proposed} proposed" in story[1]
    for gain, in_force in ((2.0, machine_of("better", 2.0)), (GAIN, machine_of("better"))):
        registry.add(machine_of("better", gain), "chosen at the machine")
        head = text_of(browser.get("/machine?name=better").text.split("</section>")[0])
        assert in_force.model_sha256[:12] in head
    assert browser.get("/machine?name=nobody").status_code == 404
    assert browser.get("/machine").status_code == 404


# ---- who decides --------------------------------------------------------------------------------

PROPOSED = model_sha256(model_of(1.1 * GAIN))
ASKED = {"machine": "better", "sha256": PROPOSED, "accepted": True, "why": "new spindle"}


def test_without_a_file_of_users_it_shows_and_nobody_decides(
    browser: Browser, registry: Registry
) -> None:
    assert sentence("fleet-nobody_decides") in text_of(browser.get("/machine?name=better").text)
    assert sentence("login-no_users") in text_of(browser.get("/login").text)
    assert browser.log_in("anna").status_code == 401
    assert browser.post("/decide", ASKED).status_code == 401
    assert registry.proposals("better")[0].accepted is None


def test_an_engineer_accepts_what_was_seen_and_the_model_can_be_taken_along(
    crew: Browser, registry: Registry
) -> None:
    model = f"/model?name=better&sha256={PROPOSED}"
    assert 'id="decide"' not in crew.get("/machine?name=better").text
    assert crew.log_in("anna", "wrong password").status_code == 401
    assert crew.log_in("anna").json() == {"name": "anna", "role": "engineer"}
    assert f'data-sha256="{PROPOSED}"' in crew.get("/machine?name=better").text
    assert crew.get(model).status_code == 404
    assert crew.post("/decide", ASKED, **{"x-thermaxis-token": "x"}).status_code == 403
    assert crew.post("/decide", {**ASKED, "why": "  "}).json()["error"] == "fleet-no_why"
    assert crew.post("/decide", {**ASKED, "accepted": "yes"}).status_code == 400
    assert crew.post("/decide", {**ASKED, "sha256": "0" * 64}).status_code == 409
    assert registry.proposals("better")[0].accepted is None
    assert crew.post("/decide", ASKED).status_code == 200
    (decided,) = registry.proposals("better")
    assert (decided.accepted, decided.who, decided.why) == (True, "anna", "new spindle")
    answer = crew.get(model)
    assert parse_model(answer.text, name="better") == model_of(1.1 * GAIN)
    assert "attachment" in answer.headers["content-disposition"]
    said = text_of(crew.get("/machine?name=better").text)
    words = {"who": "anna", "why": "new spindle", "sha256": PROPOSED[:12]}
    assert sentence("fleet-mark_accepted", words) in said
    assert not any(line.needs for line in lines_of(registry.standings("better")))
    registry.withdraw("better", who="Eva", why="too cold")
    page = crew.get("/machine?name=better").text
    assert sentence("fleet-mark_withdrawn", {**words, "who": "Eva", "why": "too cold"}) in text_of(
        page
    )
    assert "/model?" not in page
    assert crew.get(model).status_code == 404


def test_of_two_people_the_first_one_decides_and_the_second_one_is_told(
    crew: Browser, registry: Registry
) -> None:
    crew.log_in("anna")
    registry.decide("better", accepted=False, who="Eva", why="probe was worn")
    answer = crew.post("/decide", ASKED)
    assert (answer.status_code, answer.json()["error"]) == (409, "fleet-decided_before")
    assert registry.proposals("better")[0].who == "Eva"


def test_only_engineers_decide_and_who_is_struck_off_does_no_more(
    crew: Browser, registry: Registry, users: Path
) -> None:
    crew.log_in("jan")
    assert sentence("fleet-who_decides") in text_of(crew.get("/machine?name=better").text)
    assert crew.post("/decide", ASKED).status_code == 403
    crew.log_in("anna")
    write_users([User("jan", Role.OPERATOR, HASH)], users)
    crew.runner.run(crew.clock.move(KEEP_ALIVE_S))
    while crew.token in crew.get("/").text:  # the file is read in a thread
        pass
    assert crew.post("/decide", ASKED).status_code == 401
    assert registry.proposals("better")[0].accepted is None


# ---- what it refuses ----------------------------------------------------------------------------


def test_the_guard_of_all_pages_stands_before_it(browser: Browser) -> None:
    assert browser.post("/decide", ASKED, origin="http://elsewhere").status_code == 403
    assert browser.post("/decide", {**ASKED, "why": "x" * 20_000}).status_code == 413
    assert browser.runner.run(browser.http.request("PUT", "/")).status_code == 405
    for path in ("/machine/%2e%2e/x", "/static/../x", "/nothing"):
        assert browser.get(path).status_code == 404
    other = browser.runner.run(browser.http.get("/", headers={"host": "elsewhere:8470"}))
    assert other.status_code == 421


def test_a_registry_that_cannot_answer_is_said_without_its_place(
    browser: Browser, registry: Registry, tmp_path: Path
) -> None:
    registry.close()
    for file in tmp_path.glob("registry.db*"):
        file.write_bytes(b"no database" * 1000)
    answer = browser.get("/", page=False)
    assert (answer.status_code, answer.json()["error"]) == (503, "fleet-no_registry")
    assert str(tmp_path) not in answer.text


def test_it_is_not_served_to_other_computers_without_tls_and_names() -> None:
    with pytest.raises(ConfigurationError, match="certificate is missing"):
        board_settings("10.0.0.5")
    with pytest.raises(ConfigurationError, match="name of a computer"):
        board_settings(hosts=["no name"])
