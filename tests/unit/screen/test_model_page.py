"""The model's page: the model in force, or in words why nothing is shown."""

import asyncio
import json
import re
import shutil
import threading
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from markupsafe import escape
from starlette.testclient import TestClient

from tests.opcua_server import until
from tests.unit.screen.engineer_bench import CHANNELS, told_by_a_loop
from tests.unit.screen.stand import Feed, client, copied_lathe, lathe, parts
from thermaxis.compensation import GainPoint
from thermaxis.errors import ThermaxisError
from thermaxis.files import read_model, write_model
from thermaxis.messages import END_OF_ISOLATE, ISOLATE, sentence_of
from thermaxis.runtime import MachineConfiguration, Role, VirtualClock
from thermaxis.screen.pages.model import page as _model_page
from thermaxis.screen.pages.model._choices import (
    LARGEST_JUDGED_BYTES,
    MOST_JUDGED,
    MOST_LISTED,
    Choice,
    ModelChoices,
)
from thermaxis.screen.pages.model.page import (
    HANGS,
    NO_FILE,
    OTHER_FILE,
    Found,
    ReadModels,
    model_in_force,
)

STATUS = told_by_a_loop(lathe(), dict.fromkeys(CHANNELS, 21.0), seconds=20)


@pytest.fixture
def machine(tmp_path: Path) -> MachineConfiguration:
    """The example in a folder that may be changed."""
    return copied_lathe(tmp_path)


def change_model(path: Path) -> None:
    text = path.read_text("utf-8").replace('"date": "2026-11-21"', '"date": "2026-11-22"')
    found = json.loads(text)
    del found["sha256"]
    path.write_text(json.dumps(found), "utf-8")


def looking(
    machine: MachineConfiguration,
    status: dict[str, Any] | None = STATUS,
    role: Role | None = None,
) -> TestClient:
    return client(parts(machine, Feed(status), role), _model_page.routes)


def options(found: dict[str, Any]) -> dict[str, str]:
    """Return the files that may be chosen, with the hash by which a page sees which is in force."""
    shown = re.findall(r'<option data-sha256="(\w*)"[^>]*>(.*?)<', found["choices"])
    return {name: sha256 for sha256, name in shown}


def test_the_model_in_force_is_shown_when_its_hash_is_the_loops(
    machine: MachineConfiguration,
) -> None:
    found = looking(machine).get("/model/values").json()
    assert found["sha256"] == machine.model.sha256 == STATUS["model_sha256"]
    assert [output["name"] for output in found["model"]["outputs"]] == ["Z_um"]
    assert found["model"]["diameter_mm"] == STATUS["diameter_mm"] == 1200.0
    assert found["text"] == ""
    assert options(found) == {"lathe.json": machine.model.sha256}


def test_nothing_is_shown_of_a_file_that_is_another_one_than_the_model_in_force(
    machine: MachineConfiguration,
) -> None:
    change_model(machine.model.path)
    found = looking(machine).get("/model/values").json()
    assert found["model"] is None
    assert f"lathe.json, sha256 {machine.model.sha256[:16]}" in found["text"]
    assert "goes on with the model that it has read" in found["text"]
    assert "has been changed since" in found["text"]
    for place in ('"sources_um", "spindle"', '"limits", "largest_um"'):
        assert f'[["outputs", "Z_um", {place}]]' in found["html"]  # what the loop itself tells
    assert "2026-11-22" not in json.dumps(found)


def test_a_file_that_is_gone_or_no_model_is_said_in_words(machine: MachineConfiguration) -> None:
    machine.model.path.write_text("{}", "utf-8")
    found = looking(machine).get("/model/values").json()
    assert found["model"] is None
    assert "cannot be read" in found["text"]
    assert "thermaxis-compensation-model" in found["text"]
    assert str(machine.model.path.parent) not in json.dumps(found)
    machine.model.path.unlink()
    found = looking(machine).get("/model/values").json()
    assert found["model"] is None
    assert "cannot be read" in found["text"]
    assert found["choices"] == ""


def test_a_model_chosen_from_the_folder_is_found_there(machine: MachineConfiguration) -> None:
    assert machine.machine.model_folder is not None
    other = machine.machine.model_folder / "other.json"
    shutil.copy(machine.model.path, other)
    change_model(other)
    write_model(read_model(other), other)
    sha256 = json.loads(other.read_text("utf-8"))["sha256"]
    found = model_in_force(machine, "other.json", sha256)
    assert found.file is not None
    assert found.file.path == other
    assert found.file.sha256 != machine.model.sha256
    assert model_in_force(machine, "other.json", machine.model.sha256).file is None


def test_a_name_of_the_status_never_leads_out_of_the_folder(machine: MachineConfiguration) -> None:
    for name in ("../lathe.toml", "/etc/hostname", "..\\lathe.json", "a\x00b", "C:x"):
        found = model_in_force(machine, name, machine.model.sha256)
        assert (found.file, found.key) == (None, NO_FILE), name


def test_before_the_loop_has_said_which_model_is_in_force_none_is_shown(
    machine: MachineConfiguration,
) -> None:
    found = looking(machine, None).get("/model/values").json()
    assert found["model"] is None
    assert "has not told yet" in found["text"]


def test_diameters_of_gains_are_told_as_they_were_stated(machine: MachineConfiguration) -> None:
    model = read_model(machine.model.path)
    (output,) = model.outputs
    points = (GainPoint(0.0, 1.0), GainPoint(1200.25, 1.5))
    parts_ = tuple(replace(part, gain_by_diameter=points) for part in output.parts)
    write_model(replace(model, outputs=(replace(output, parts=parts_),)), machine.model.path)
    sha256 = json.loads(machine.model.path.read_text("utf-8"))["sha256"]
    for language, shown in (("en", "1200.25"), ("de", "1200,25")):
        asker = looking(machine, {**STATUS, "model_sha256": sha256})
        html = asker.get("/model/values", headers={"accept-language": language}).json()["html"]
        assert re.findall(r'<td\s+class="number">([\d.,]+)</td><td', html)[:2] == ["0", shown]


def test_what_the_model_says_of_itself_stands_on_the_page(
    machine: MachineConfiguration,
) -> None:
    model = read_model(machine.model.path)
    provenance = replace(model.provenance, method="by <hand>")
    write_model(replace(model, warnings=("a & b",), provenance=provenance), machine.model.path)
    sha256 = json.loads(machine.model.path.read_text("utf-8"))["sha256"]
    asker = looking(machine, {**STATUS, "model_sha256": sha256})
    html = asker.get("/model/values").json()["html"]
    assert '<li lang="en">a &amp; b</li>' in html
    assert "<dd>by &lt;hand&gt;</dd>" in html
    assert html.count('<td class="number">855</td>') == 2
    assert re.search(r'fit in free run.*?</td><td\s+class="number">96.34<', html)
    assert '<span class="live">1.470</span>' in html  # at 1200 mm of 0.985 at 0, 1.591 at 1500 mm


def test_a_name_in_a_model_is_text_of_the_page_and_nothing_else(
    machine: MachineConfiguration,
) -> None:
    name = """<b id='x'>"{{ 1 }}"""
    told = {"Z_um": {"parts_um": {name: 1.0}}}
    html = looking(machine, {**STATUS, "model_sha256": "0" * 64, "outputs": told})
    found = html.get("/model/values").json()["html"]
    assert "<b id" not in found
    assert f"<td>{escape(name)}</td>" in found
    places = [json.loads(place) for place in re.findall("data-at='(.*?)'", found)]
    assert [["outputs", "Z_um", "sources_um", name]] in places


def test_only_an_engineer_may_choose_another_model(machine: MachineConfiguration) -> None:
    for role in Role:
        answer = looking(machine, role=role).get("/model/values")
        if answer.status_code == 200:
            may = role is Role.ENGINEER
            shown = answer.json()["choices"]
            assert (shown.count(" disabled"), "choose-why" in shown) == (2 - 2 * may, not may), role
        else:
            assert role is Role.NONE


def test_a_model_is_read_once_for_all_who_look_and_told_for_the_diameter_of_now(
    machine: MachineConfiguration, monkeypatch: pytest.MonkeyPatch
) -> None:
    read: list[Path] = []
    read_model_file = _model_page.read_model_file

    def counted(path: Path) -> Any:
        read.append(path)
        return read_model_file(path)

    monkeypatch.setattr(_model_page, "read_model_file", counted)
    status = dict(STATUS)
    with looking(machine, status) as browser:
        first = browser.get("/model/values").json()
        assert all(browser.get("/model/values").json() == first for _ in range(5))
        status["diameter_mm"] = 50.0
        assert browser.get("/model/values").json()["model"]["diameter_mm"] == 50.0
    assert len(read) == 1


def test_what_cannot_be_shown_is_looked_for_again(machine: MachineConfiguration) -> None:
    content = machine.model.path.read_bytes()
    machine.model.path.unlink()
    with looking(machine) as browser:
        assert browser.get("/model/values").json()["model"] is None
        machine.model.path.write_bytes(content)
        assert browser.get("/model/values").json()["model"] is not None


def test_hidden_files_and_names_that_nobody_could_ask_for_are_not_offered(
    machine: MachineConfiguration,
) -> None:
    assert machine.machine.model_folder is not None
    for name in (".lathe.json", ".json", "a\nb.json", "C:lathe.json", "a\\b.json", "b lathe.json"):
        shutil.copy(machine.model.path, machine.machine.model_folder / name)
    assert machine.models_to_choose() == ("b lathe.json", "lathe.json")
    for name in machine.models_to_choose():
        assert machine.other_model(name)[1] == machine.model.sha256


def test_a_file_that_is_no_model_or_does_not_fit_is_listed_with_why_before_it_is_chosen(
    machine: MachineConfiguration,
) -> None:
    folder = machine.model.path.parent
    (folder / "notes.json").write_text("{}", "utf-8")
    foreign = json.loads(machine.model.path.read_text("utf-8").replace("Z_um", "X_um"))
    del foreign["sha256"]
    (folder / "foreign.json").write_text(json.dumps(foreign), "utf-8")
    (folder / "large.json").write_bytes(b" " * (LARGEST_JUDGED_BYTES + 1))
    for language, not_read in (
        ("en", "not checked"),
        ("de", "nicht vorab"),
        ("cs", "nebyl předem"),
    ):
        asked = looking(machine).get("/model/values", headers={"accept-language": language}).json()
        assert list(options(asked).items()) == [
            ("large.json", ""),
            ("lathe.json", machine.model.sha256),
        ]
        rows = re.findall("<li><b>(.*?)</b>: (.*?)</li>", asked["choices"])
        assert [name for name, _ in rows] == ["foreign.json", "large.json", "notes.json"]
        why = dict(rows)
        assert not_read in why["large.json"]
        for name in ("foreign.json", "notes.json"):
            with pytest.raises(ThermaxisError) as refused:  # the loop would say the same
                machine.other_model(name)
            message = refused.value.message
            said = sentence_of(message, language=language)
            assert escape(said.strip(ISOLATE + END_OF_ISOLATE)) in why[name]
            assert ('<span lang="en">' in why[name]) is (ISOLATE in said)
        assert ('<span lang="en">' in why["foreign.json"]) is (language != "en")
        assert "X_um" in why["foreign.json"]
        assert str(folder) not in json.dumps(asked)


def test_a_file_is_read_for_the_list_once_for_each_content_and_little_at_once(
    machine: MachineConfiguration, monkeypatch: pytest.MonkeyPatch
) -> None:
    read: list[str] = []
    other_model = MachineConfiguration.other_model

    def counted(configuration: MachineConfiguration, name: str) -> object:
        read.append(name)
        return other_model(configuration, name)

    monkeypatch.setattr(MachineConfiguration, "other_model", counted)
    folder = machine.model.path.parent
    for k in range(7):
        (folder / f"padded{k}.json").write_text("{}" + " " * 900_000, "utf-8")
    choices = ModelChoices(machine)
    looks = [choices.look() for _ in range(4)]
    assert looks[0][5:] == tuple(Choice(f"padded{k}.json") for k in (4, 5, 6))
    assert all(choice.refused or choice.sha256 for choice in looks[1])
    assert looks[1] == looks[2] == looks[3]
    assert sorted(read) == sorted(choice.name for choice in looks[1]), "each once"
    shutil.copy(machine.model.path, folder / "padded3.json")
    assert Choice("padded3.json", machine.model.sha256) in choices.look()
    (folder / "padded0.json").unlink()
    assert "padded0.json" not in [choice.name for choice in choices.look()]
    assert len(read) == len(looks[1]) + 1


def test_a_folder_that_hangs_stops_nobody_and_leaves_few_threads_behind(
    machine: MachineConfiguration, monkeypatch: pytest.MonkeyPatch
) -> None:
    answers, hung = threading.Event(), threading.Event()
    look, read = ModelChoices.look, _model_page.read_model_file

    def left_behind() -> int:
        return sum(thread.name == "worker" for thread in threading.enumerate())

    def waits() -> None:
        if hung.is_set():
            answers.wait(20.0)

    def slow_look(choices: ModelChoices) -> tuple[Choice, ...]:
        waits()
        return look(choices)

    def slow_read(path: Path) -> Any:
        waits()
        return read(path)

    monkeypatch.setattr(ModelChoices, "look", slow_look)
    monkeypatch.setattr(_model_page, "read_model_file", slow_read)
    monkeypatch.setattr(_model_page, "KEPT_S", 0.0)
    in_force, other = ("lathe.json", machine.model.sha256), ("lathe.json", "0" * 64)

    async def scene() -> None:
        models = ReadModels(machine, VirtualClock(), limit_s=50.0)

        def wait_for(limit_s: float) -> None:
            models._looking._limit_s = models._reading._limit_s = limit_s

        before = await models.of(*in_force)
        choices = await models.choices()
        assert choices
        hung.set()
        wait_for(0.05)
        async with asyncio.timeout(10.0):
            known = await asyncio.gather(*(models.of(*in_force) for _ in range(20)))
            unknown = await asyncio.gather(*(models.of(*other) for _ in range(20)))
            assert await models.choices() == choices
        assert all(one == before for one in known)
        assert all(one == Found(None, NO_FILE, HANGS) for one in unknown)
        assert left_behind() == 2  # one that looks, one that reads
        answers.set()
        wait_for(50.0)
        await until(lambda: left_behind() == 0)
        assert (await models.of(*other)).key == OTHER_FILE

    asyncio.run(scene())


def test_only_so_many_files_of_a_folder_are_listed_and_fewer_judged(
    machine: MachineConfiguration,
) -> None:
    for k in range(MOST_LISTED + 5):
        (machine.model.path.parent / f"{k:03d}.json").write_text("{}", "utf-8")
    found = ModelChoices(machine).look()
    assert [choice.name for choice in found] == [f"{k:03d}.json" for k in range(MOST_LISTED)]
    assert sum(choice.refused is not None for choice in found) == MOST_JUDGED
    assert sum(choice == Choice(choice.name) for choice in found) == MOST_LISTED - MOST_JUDGED
    assert len(machine.models_to_choose()) == MOST_LISTED + 6
