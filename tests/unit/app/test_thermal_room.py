"""Logs that somebody drops: what is kept, what is refused in a sentence, what is made of them."""

import asyncio
import io
import json
import math
import zipfile
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any, cast
from urllib.parse import urlencode

import pytest

from tests.commands_here import WorkHere
from tests.unit.app.test_entrance import GOOD, HEAD, Door
from thermaxis import plc
from thermaxis.app._rooms import spoken_as, words_of
from thermaxis.app._shelf import Entry, Shelf
from thermaxis.app.server._server import AppHost
from thermaxis.app.thermal._room import identify_words
from thermaxis.codes import Message, message_as_json, value_as_json
from thermaxis.messages import LANGUAGES, sentence, sentence_of, text_of
from thermaxis.report import _style
from thermaxis.web.work import WorkFolder

EXAMPLES = Path(__file__).parents[3] / "examples"
SPINDLE = EXAMPLES / "lathe_spindle.csv"
INPUT = {"name": "spindle", "plus": "T_spindle_C", "minus": "T_column_C"}
OTHER, OK, REFUSED = {**GOOD, "Accept-Language": "de"}, 200, 422


class Bench(Door):
    """The room without a socket."""

    def drop(self, name: str, content: bytes) -> Any:
        return self.ask("POST", f"/thermal/log?{urlencode({'name': name})}", GOOD, content)

    def post(self, what: str, **asked: Any) -> Any:
        return self.ask("POST", f"/thermal/{what}", GOOD, json.dumps(asked).encode())

    def entries(self, headers: dict[str, str] = GOOD) -> list[dict[str, Any]]:
        return self.ask("GET", "/thermal/bench", headers).json()["entries"]

    def log(self) -> str:
        """Drop every twelfth row of the example."""
        head, *rows = SPINDLE.read_bytes().splitlines(keepends=True)
        return self.drop("lathe.csv", head + b"".join(rows[::12])).json()["id"]

    def model(self, log: str, method: str = "modal") -> Any:
        asked = {"outputs": ["Z_um"], "inputs": [INPUT], "method": method}
        return self.post("identify", logs=[log], **asked)


@pytest.fixture
def bench(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, one_clock_and_regime: None
) -> Iterator[Bench]:
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    monkeypatch.setattr("tempfile.tempdir", None)
    for name in ("vectors_of", "self_test_of"):  # whole ones: tests/unit/cli/test_export.py
        monkeypatch.setattr(plc, name, partial(getattr(plc, name), most_calls=50))
    monkeypatch.setattr(_style, "_settle", lambda figure: figure.set_layout_engine(None))
    with Bench(tmp_path) as made:
        cast("Any", made.app)._app.state.work = WorkHere()
        yield made


UNFIT = {
    "one_row.csv": HEAD + b"0,20,0\n",
    "nan.csv": HEAD + b"0,NaN,NaN\n10,inf,NaN\n20,NaN,-inf\n",
    "words.csv": HEAD + b"0,warm,0\n10,hot,1\n",
    "still.csv": HEAD + b"".join(b"%d,20,%d\n" % (10 * k, k) for k in range(300)),
    "no_length.csv": b"time_s,T_a_C,T_b_C\n"
    + b"".join(b"%d,%d,%d\n" % (10 * k, 20 + k, k) for k in range(60)),
    "wrong_unit.csv": b"time_s,T_spindle_C,Z_bar\n"
    + b"".join(b"%d,%d,%d\n" % (10 * k, 20 + k, k) for k in range(60)),
}


@pytest.mark.parametrize("name", UNFIT)
def test_a_log_of_which_no_model_can_be_made_says_why(bench: Bench, name: str) -> None:
    dropped = bench.drop(name, UNFIT[name])
    assert dropped.status_code == OK, dropped.text
    column = UNFIT[name].split(b"\n", 1)[0].decode().split(",")[1:]
    asked = {"outputs": [column[-1]], "inputs": [{"plus": column[0]}]}
    answer = bench.post("identify", logs=[dropped.json()["id"]], **asked)
    if name == "no_length.csv":  # then another temperature was asked for as the displacement
        assert answer.status_code in (OK, REFUSED)
    else:
        assert answer.status_code == REFUSED, answer.text
        assert len(answer.json()["text"]) > 40


HOSTILE: list[dict[str, Any]] = [
    {"outputs": ["Z_um\n--model=/etc/x"], "inputs": [INPUT]},
    {"outputs": "Z_um", "inputs": [INPUT]},
    {"outputs": ["Z_um"], "inputs": ["spindle"]},
    {"outputs": ["Z_um"] * 2, "inputs": [{"plus": 7}]},
    {"outputs": ["Z_um"], "inputs": [INPUT], "method": "--report=/tmp/x.pdf"},
    {"outputs": ["Z_um"], "inputs": [INPUT], "sample_time": ["60"]},
    {"outputs": ["Z_um"], "inputs": [INPUT] * 41},
]


def test_what_the_page_never_asks_for_is_refused(bench: Bench) -> None:
    log = bench.log()
    for asked in HOSTILE:
        answer = bench.post("identify", logs=[log], **asked)
        assert answer.status_code == 400, asked
        assert len(answer.json()["text"]) > 20


def test_a_name_is_shown_as_it_is_and_no_command_obeys_it(bench: Bench) -> None:
    names = ("--report=x.csv", "../../etc/passwd", "<b>x.csv", "-o.csv", "x.csv", "x.csv")
    for name in names:
        assert bench.drop(name, HEAD + b"0,20,0\n10,21,1\n20,22,2\n").status_code == OK
    kept = bench.entries()
    assert [one["name"] for one in kept][2:] == list(names)[2:]
    files = [one["told"]["logs"][0]["name"] for one in kept]
    assert len(set(files)) == len(files)
    assert not any(one.startswith("-") for one in files)


@pytest.mark.proof
def test_everything_of_a_model_can_be_taken_along_and_goes_with_its_log(bench: Bench) -> None:
    log = bench.log()
    model = bench.model(log).json()["id"]
    told = bench.ask("GET", f"/thermal/model/{model}", GOOD)
    assert told.json()["provenance"]["logs"][0]["name"] == "lathe.csv"
    assert bench.ask("GET", f"/thermal/html/{model}", GOOD).text.startswith("<!")
    limits = {"cycle_s": "1", "limit": "100", "rate": "1", "plausible": "5:60"}
    refused = bench.post("export", model=model, dialect="st", **{**limits, "cycle_s": "900"})
    assert refused.status_code == REFUSED
    exported = bench.post("export", model=model, dialect="st", **limits)
    assert exported.status_code == OK, exported.text
    packed = bench.ask("GET", f"/thermal/plc/{model}", GOOD).content
    names = zipfile.ZipFile(io.BytesIO(packed)).namelist()
    assert any(name.endswith(".st") for name in names)
    for kind in ("lathe.csv", "../model", "%2e%2e%2fmodel", "passwd", "csv"):
        assert bench.ask("GET", f"/thermal/{kind}/{model}", GOOD).status_code == 404
    assert bench.ask("GET", f"/thermal/plc/{log}", GOOD).status_code == 404
    assert bench.post("remove", id=log).json() == {"entries": []}
    assert bench.ask("GET", f"/thermal/model/{model}", GOOD).status_code == 404


@pytest.mark.proof
def test_a_saved_model_comes_back_and_is_verified_on_another_log(bench: Bench) -> None:
    log = bench.log()
    model = bench.model(log).json()["id"]
    saved = bench.ask("GET", f"/thermal/model/{model}", GOOD)
    assert "model-1-model.json" in saved.headers["Content-Disposition"]
    cut = b'{"format": "thermaxis-compensation-model", "version": 1'
    for content in (b'{"a": 1}', b"[" * 9000, cut, b"\xff", saved.content.replace(b"1", b"2")):
        refused = bench.drop("Fräse.json", content)
        assert refused.status_code == REFUSED
        assert refused.json()["text"].startswith(sentence("room-refused", {"said": "Fräse.json"}))
    again = bench.drop("Fräse.json", saved.content).json()["id"]
    made, found = bench.entries()[-2:]
    assert (found["kind"], found["name"], found["made_of"]) == ("model", "Fräse", [])
    part, same = (one["told"]["outputs"]["Z_um"]["parts"][0] for one in (made, found))
    assert {key: part[key] for key in same} == same
    assert found["told"]["trained_on"] == [bench.entries()[0]["told"]["logs"][0]["sha256"]]
    figures = [
        bench.post("verify", model=one, logs=[log]).status_code == OK
        and bench.entries()[-1]["told"]["outputs"]
        for one in (model, again)
    ]
    assert figures[0] == figures[1]
    assert bench.ask("GET", f"/thermal/pdf/{again}", GOOD).status_code == 404  # of no known logs
    assert bench.ask("GET", f"/thermal/log/{again}", GOOD).status_code == 404
    name = bench.ask("GET", f"/thermal/model/{again}", GOOD).headers["Content-Disposition"]
    assert name == "attachment; filename*=utf-8''Fr%C3%A4se-model.json"


@pytest.mark.proof
def test_two_models_are_compared_and_two_recorders_joined(bench: Bench) -> None:
    log = bench.log()
    models = [bench.model(log, one).json()["id"] for one in ("modal", "static")]
    compared = bench.post("compare", logs=[log], models=models)
    assert compared.status_code == OK, compared.text
    told = bench.entries()[-1]["told"]
    assert [one["name"] for one in told["models"]] == ["model-1.json", "model-2.json"]
    rows = b"".join(b"%d,%d\n" % (60 * k, k) for k in range(40))
    pair = [
        bench.drop(name, b"time_s," + what + b"\n" + rows).json()["id"]
        for name, what in (("a.csv", b"T_a_C"), ("b.csv", b"Z_um"))
    ]
    refused = bench.post("join", logs=pair)
    assert "shift" in refused.json()["text"]  # for which the page has a field
    assert bench.post("join", logs=pair, shift="0").status_code == OK
    joined = bench.entries()[-1]["told"]["logs"][0]
    assert [one["name"] for one in joined["channels"]] == ["T_a_C", "Z_um"]
    assert bench.post("join", logs=pair[:1]).status_code == 400


def test_logs_whose_columns_were_told_differently_are_not_read_as_if_they_were_alike(
    bench: Bench,
) -> None:
    logs: list[Any] = []
    for mapping in (b"", b"[columns]\nZ_um = {unit = 'um'}\n"):
        path = f"/thermal/log?name=a.csv&map_bytes={len(mapping)}"
        logs.append(bench.ask("POST", path, GOOD, HEAD + b"0,20,0\n10,21,1\n" + mapping).json())
    ids = [one["id"] for one in logs]
    answer = bench.post("identify", logs=ids, outputs=["Z_um"], inputs=[INPUT])
    assert answer.json()["error"] == "thermal-maps_differ"
    assert bench.post("remove").status_code == 404  # nothing is named


def test_what_the_page_states_of_a_log_goes_into_the_mapping_that_came_with_it(
    bench: Bench,
) -> None:
    rows = "".join(f"03/04/2026 08:{k},{20 + k},{k},{k}\n" for k in range(10, 40)).encode()
    mapping = b"[columns]\nT = 'T_a_C'\nprobe = {name = 'Z', unit = 'mm', factor = -1}\n"
    mapping += b"\"x.\xc3\xa4\" = {name = 'spare', leave_out = false}\n"

    def drop(stated: bytes) -> Any:
        sizes = {"map_bytes": len(mapping), "stated_bytes": len(stated)}
        path = f"/thermal/log?{urlencode({'name': 'a.csv', **sizes})}"
        head = "time,T,probe,x.ä\n".encode()
        return bench.ask("POST", path, GOOD, head + rows + mapping + stated)

    unclear = drop(b"")
    assert (unclear.status_code, unclear.json()["error"]) == (REFUSED, "room-refused")
    day = b"[time]\ndate_order = 'day'\n"
    for stated in (day, day + b"[columns.spare]\nunit = 'degC'\n"):
        answer = drop(stated)
        assert answer.status_code == OK, answer.text
        t, z, spare = bench.entries()[-1]["told"]["logs"][0]["channels"]
        assert (t["name"], t["unit"]) == ("T_a_C", "degC")
        assert (z["name"], z["quantity"], z["highest"]) == ("Z", "displacement", -10.0)
        assert (spare["name"], spare["unit"]) == ("spare", "degC" if b"degC" in stated else "")
    assert drop(b"[time]\nunit = 7\n").status_code == REFUSED


def test_what_is_full_refuses_more_and_keeps_what_other_things_are_made_of(tmp_path: Path) -> None:
    shelf = Shelf(AppHost(), longest_s=math.inf, most=3, most_bytes=10, sheds=False)
    owner = AppHost().owner_of(cast("Any", None))

    async def keep(name: str, *made_of: str) -> str:
        folder = WorkFolder(tmp_path / name)
        folder.path.mkdir()
        (folder.path / "file").write_bytes(b"12345")
        return shelf.keep(Entry(owner, "log", name, (), folder, {}, made_of=made_of)).id

    async def fill() -> None:
        log = await keep("log")
        assert not shelf.is_full(owner)
        await keep("model", log)
        assert shelf.is_full(owner)
        await keep("one that was being made")
        assert len(shelf.all_of(owner)) == 3

    asyncio.run(fill())


def test_an_output_may_be_called_as_what_a_result_says() -> None:
    told = {"outputs": {"Z_code": {"fit": 1}, "code": {"fit": 2}, "text": {}, "X_codes": {}}}
    assert spoken_as(told, "de") == told


def test_a_text_without_a_code_stays_before_those_that_have_one() -> None:
    said = Message("outcome-diameter_held")
    told = {"warnings": ["the clocks", "old"], "warning_codes": [value_as_json(said)]}
    assert spoken_as(told, "cs")["warnings"] == ["the clocks", text_of(said, language="cs")]


def test_what_is_doubtful_of_sensors_stands_among_the_findings_and_not_in_the_warnings_too() -> (
    None
):
    said, verdict = Message("outcome-diameter_held"), Message("outcome-gap")
    told: dict[str, Any] = {
        "warnings": ["a: noticed", "a: T_x_C stays", "old"],
        "warning_codes": [value_as_json(verdict)],
        "reading_codes": [{"log": "a", "text": "noticed", **message_as_json(said)}],
    }
    own = [f"a: {sentence_of(said, language='de')}", text_of(verdict, language="de")]
    assert spoken_as({**told, "findings": []}, "de")["warnings"] == own
    assert spoken_as(told, "de")["warnings"] == [own[0], "a: T_x_C stays", own[1]]


def test_the_program_chooses_among_both_sides_of_a_difference() -> None:
    inputs = [INPUT, {"plus": "T_air_C", "minus": "T_column_C"}]
    words = identify_words({"outputs": ["Z_um"], "inputs": inputs, "choose": True})
    chosen = [word for word in words if word.startswith("--candidates")]
    assert chosen == [f"--candidates=T_{one}_C" for one in ("spindle", "column", "air")]


def test_units_are_asked_for_as_the_page_writes_them() -> None:
    for units in ("mm,µm", "mm, um", "°,″"):
        assert words_of({"units": units}, ["units"]) == [f"--units={units}"]


def test_what_a_log_shows_is_said_in_the_language_of_the_page(bench: Bench) -> None:
    bench.log()
    texts = [
        [one["text"] for one in bench.entries(h)[0]["told"]["findings"]] for h in (GOOD, OTHER)
    ]
    assert texts[0]
    assert all(a != b for a, b in zip(*texts, strict=True))


@pytest.mark.parametrize("language", LANGUAGES)
def test_the_page_comes_in_every_language(bench: Bench, language: str) -> None:
    page = bench.ask("GET", "/thermal", {**GOOD, "Accept-Language": language}).text
    assert sentence("thermal-identify", language=language) in page
