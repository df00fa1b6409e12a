"""Half a pair of surrogates is no text: JSON can say it, and nothing can write it."""

import json
import os
import sys
from pathlib import Path
from typing import cast

import httpx2 as httpx
import pytest
from starlette.applications import Starlette

from tests.unit.screen.people import HERE, People
from tests.unit.screen.stand import Feed, client, copied_lathe, parts
from tests.unit.screen.test_failed_log_ins import Door, played
from thermaxis.runtime import FAILURES_BY_ADDRESS, LONGEST_NAME, LONGEST_PASSWORD
from thermaxis.screen.access import _login_page, login_routes
from thermaxis.screen.access._user_sessions import REFUSED, TOO_MANY_FROM_HERE
from thermaxis.screen.pages.model import page as _model_page
from thermaxis.web import answer_json

SCREEN = Path(_login_page.__file__).parents[1]
WRONG = {
    "a password": ("novak{}", "\ud800"),
    "the end of a password": ("novak{}", "right horse staple\udfff"),
    "a name": ("novak{}\ud800", "right horse staple"),
    "a long name": ("{}" + "n" * LONGEST_NAME, "right horse staple"),
    "a long password": ("novak{}", "x" * (LONGEST_PASSWORD + 1)),
}


@pytest.mark.parametrize("what", WRONG)
def test_a_log_in_that_nobody_can_have_is_refused_and_counted_as_any_wrong_one(what: str) -> None:
    name, password = WRONG[what]
    said: list[tuple[int, str]] = []

    async def act(door: Door) -> None:
        given = parts()
        app = Starlette(routes=login_routes(given))
        app.state.parts = given
        people = cast("People", given.persons)
        people.log_in = door.persons.log_in
        way = httpx.ASGITransport(app, client=(HERE, 4000))
        async with httpx.AsyncClient(transport=way, base_url="http://127.0.0.1:8450") as browser:
            for i in range(FAILURES_BY_ADDRESS + 1):
                body = json.dumps({"name": name.format(i), "password": password})
                answer = await browser.post("/login", content=body)
                said.append((answer.status_code, answer.json()["error"]))

    played(act)
    assert said == [(401, REFUSED)] * FAILURES_BY_ADDRESS + [(429, TOO_MANY_FROM_HERE)]


def test_an_answer_is_text_whatever_it_is_made_of() -> None:
    answer = answer_json({"\ud800": ["\udcff", "Mareš"]})
    assert json.loads(bytes(answer.body)) == {"?": ["?", "Mareš"]}


@pytest.mark.skipif(sys.platform != "linux", reason="other systems have no such file names")
def test_a_file_whose_name_is_no_text_is_not_offered_as_a_model(tmp_path: Path) -> None:
    machine = copied_lathe(tmp_path)
    (tmp_path / "models" / os.fsdecode(b"odd\xff.json")).write_bytes(b"{}")
    answer = client(parts(machine, Feed(None)), _model_page.routes).get("/model/values")
    assert answer.status_code == 200
    assert "odd" not in answer.text


def test_every_answer_as_json_is_made_in_the_one_way_that_writes_any_text() -> None:
    folders = (SCREEN, SCREEN.with_name("web"), SCREEN.with_name("app"))
    files = [path for folder in folders for path in folder.rglob("*.py")]
    modules = {path.name: path.read_text("utf-8") for path in files}
    assert len(modules) > 20
    assert [name for name, text in modules.items() if "JSONResponse(" in text] == []
