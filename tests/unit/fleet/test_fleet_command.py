"""``thermaxis fleet`` from the first machine to its nights."""

import json
import shutil
from datetime import UTC, datetime, timedelta

import pytest

from tests.unit.fleet.fleet_machines import GAIN, LAST, Truth, model_of, shipped
from thermaxis.cli import main
from thermaxis.files import model_sha256, read_model, write_model

TRUTHS = {"good": Truth(), "frozen": Truth(2, frozen=True), "wrong": Truth(1)}


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """Return a folder with a registry of four machines, of which one has not shipped."""
    folder = tmp_path_factory.mktemp("fleet")
    (folder / "lake").mkdir()
    write_model(model_of(), folder / "model.json")
    write_model(model_of(1.5 * GAIN), folder / "wrong.json")
    registry = str(folder / "registry.db")
    assert main(["fleet", "init", registry, str(folder / "lake")]) == 0
    for name in (*TRUTHS, "away"):
        model = str(folder / ("wrong.json" if name == "wrong" else "model.json"))
        assert main(["fleet", "add", registry, name, model, "--kind", "mill"]) == 0
        if name in TRUTHS:
            shipped(folder / "machines", folder / "lake", name, TRUTHS[name])
    return folder


@pytest.fixture
def fleet(made, tmp_path, monkeypatch):
    for name in ("registry.db", "model.json"):
        shutil.copy(made / name, tmp_path)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def answer(capsys, *words: str, code: int = 0) -> dict:
    capsys.readouterr()
    assert main(["fleet", *words, "--json", "-"]) == code
    return json.loads(capsys.readouterr().out)


@pytest.mark.proof
def test_the_morning_shows_sensors_and_models_that_need_a_look_before_the_others(fleet, capsys):
    night = ("night", "registry.db", "--day", LAST.isoformat(), "--days-back", "2")
    planned = answer(capsys, *night, "--dry-run")
    assert planned == {
        "day": LAST.isoformat(),
        "again": [],
        "missing": ["away", "frozen", "good", "wrong"],
    }
    done = answer(capsys, *night)
    assert (done["asked"], done["stored"], done["not_shipped"]) == (4, 3, ["away"])
    again = answer(capsys, *night)
    assert (again["asked"], done["named"], again["named"]) == (1, 1, 1)
    shown = answer(capsys, "show", "registry.db")
    assert [one["machine"] for one in shown["nights"]] == ["frozen", "wrong", "good"]
    assert shown["without"] == ["away"]
    (named,) = shown["named"]
    assert (named["machine"], named["causes"]) == ("frozen", ["sensor_frozen"])
    assert named["since"] == shown["day"] == LAST.isoformat()
    left = {one["machine"]: one["outputs"]["Z_um"]["rmse_um"] for one in shown["nights"]}
    assert left["wrong"] > 5.0 * left["good"]
    assert main(["fleet", "show", "registry.db"]) == 0
    said = capsys.readouterr().out
    few = "Machines with a night of the day: 3. Fewer than 8 are judged by their own past alone."
    assert few in said
    assert "touches of 2 days" in " ".join(said.split())
    assert "frozen: T_spindle gives one value while other sensors move. Look at" in said
    assert main(["fleet", *night]) == 0
    said = capsys.readouterr().out
    assert few in said
    assert said.endswith("named 1 machine: frozen\n")


@pytest.mark.proof
def test_a_machine_is_shown_with_its_models_and_nights(fleet, capsys):
    assert main(["fleet", "add", "registry.db", "wrong", "model.json", "--why", "mended"]) == 0
    night = ["night", "registry.db", "--day", LAST.isoformat(), "--machine", "wrong"]
    assert main(["fleet", *night]) == 0
    shown = answer(capsys, "machine", "registry.db", "wrong")
    assert [one["why"] for one in shown["models"]] == ["added", "mended"]
    assert shown["models"][1]["parent_sha256"] == shown["models"][0]["sha256"]
    assert [one["model_sha256"] for one in shown["nights"]] == [shown["model_sha256"]]
    assert main(["fleet", "machine", "registry.db", "wrong"]) == 0
    assert "mended" in capsys.readouterr().out


def test_a_registry_is_made_once_and_has_no_night_first(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "lake").mkdir()
    for said in ("made", "there"):
        assert main(["fleet", "init", "r.db", "lake"]) == 0
        assert f"The registry is {said}; its lake" in capsys.readouterr().out
    assert main(["fleet", "show", "r.db"]) == 0
    assert "No night has been done yet" in capsys.readouterr().out


def test_a_person_accepts_a_proposal_and_has_its_model_to_choose_at_the_machine(fleet, capsys):
    night = ["night", "registry.db", "--day", LAST.isoformat(), "--machine", "wrong"]
    assert main(["fleet", *night]) == 0
    (night_shown,) = answer(capsys, "show", "registry.db")["nights"]
    decide = ["fleet", "accept", "registry.db", "wrong", "--who", "Anna", "--why", "cold days"]
    assert main([*decide, "-o", "model.json"]) == 2  # nothing is written over
    with pytest.raises(SystemExit):  # a decision is somebody's, and has a reason
        main([*decide, "--who", " "])
    assert main([*decide, "-o", "better.json"]) == 0
    better = read_model("better.json")
    assert model_sha256(better) == night_shown["proposal_sha256"]
    shown = answer(capsys, "machine", "registry.db", "wrong")
    (proposal,) = shown["proposals"]
    assert (proposal["accepted"], proposal["who"]) == (True, "Anna")
    assert shown["model_sha256"] == night_shown["model_sha256"]  # the machine has it not yet
    assert main(["fleet", "reject", *decide[2:]]) == 2
    assert "decided on already" in capsys.readouterr().err
    assert main(["fleet", "machine", "registry.db", "wrong"]) == 0
    assert "accepted" in capsys.readouterr().out


def test_a_night_is_done_again_once_more_of_its_day_was_shipped(fleet, capsys):
    lake, untouched = fleet / "lake", Truth(touch_every=0)
    lake.mkdir()
    model = str(fleet / "model.json")
    assert main(["fleet", "init", "late.db", str(lake)]) == 0
    assert main(["fleet", "add", "late.db", "A", model]) == 0
    following = (LAST + timedelta(days=1)).isoformat()

    def minutes() -> int:
        (night,) = answer(capsys, "show", "late.db", "--day", LAST.isoformat())["nights"]
        return night["minutes"]

    shipped(fleet / "some", lake, "A", untouched, last=700)
    night = ("night", "late.db", "--day", LAST.isoformat())
    assert answer(capsys, *night)["again"] == []
    assert minutes() == 700
    assert answer(capsys, *night)["asked"] == 0
    shipped(fleet / "all", lake, "A", untouched)
    done = answer(capsys, "night", "late.db", "--day", following)  # that of the day before, too
    assert (done["again"], done["stored"]) == ([f"A, {LAST}"], 1)
    assert minutes() == 1440
    assert answer(capsys, *night)["asked"] == 0


def test_a_name_under_which_nothing_was_shipped_is_said(fleet, capsys):
    for name, said in (("../good", True), ("good", False)):
        assert main(["fleet", "add", "registry.db", name, "model.json"]) == 0
        assert ("Nothing was shipped under this name" in capsys.readouterr().out) == said


def test_another_name_of_a_machine_is_said(fleet, capsys):
    renamed = ["fleet", "add", "registry.db", "Lathe 4", "model.json", "--renames"]
    assert main([*renamed, "good"]) == 0
    assert "Lathe 4 was called good" in capsys.readouterr().out
    assert main([*renamed, "wrong"]) == 0
    assert "Lathe 4 is one with it" in capsys.readouterr().out
    shown = answer(capsys, "machine", "registry.db", "good")
    assert (shown["name"], shown["formerly"]) == ("Lathe 4", ["good", "wrong"])


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("night", "registry.db", "--day", datetime.now(UTC).date().isoformat()), "not over"),
        (("night", "registry.db", "--machine", "nobody"), "nobody"),
        (("night", "registry.db", "--workers", "1", "--scheduler", "tcp://x"), "exclude"),
        (("add", "registry.db", "good", "model.json", "--channel", "T_x=y"), "T_spindle_C"),
        (("init", "registry.db", "no lake"), "no such folder"),
        (("init", "registry.db", "."), "--move-lake"),
        (("add", "registry.db", "good", "machine.toml"), "not a model"),
        (("show", "nothing.db"), "thermaxis fleet init"),
        (("machine", "registry.db", "good", "--password-file", "x"), "URL"),
    ],
)
def test_what_is_wrong_is_said(fleet, words, said, capsys):
    assert main(["fleet", *words]) == 2
    assert said in capsys.readouterr().err
