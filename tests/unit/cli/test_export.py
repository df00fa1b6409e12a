"""``thermaxis export``: what is written, what is refused in which words, and that vectors hold."""

import argparse
import json
import re
import subprocess
from dataclasses import replace
from functools import partial
from hashlib import sha256
from io import BytesIO
from pathlib import Path
from zipfile import ZipFile

import numpy as np
import pytest

from tests.unit.cli.refusals import code_of, refusal
from tests.unit.plc.equal_parts import CBlock, CLibrary, c_library
from tests.unit.plc.st_to_c import st_as_c
from thermaxis import plc
from thermaxis.cli.exchange import export
from thermaxis.compensation import (
    CompensationModel,
    GainPoint,
    Output,
    Part,
    Provenance,
    Section,
)
from thermaxis.errors import ConfigurationError
from thermaxis.files import model_sha256, read_model, write_model
from thermaxis.plc import vectors_of

STATED = ("--limit", "280", "--rate", "0.5", "--plausible", "5:80")
FILES = {
    "scl": {"scl"},
    "st": {"st"},
    "c": {"c", "h"},
    "fmu": {"fmi2.fmu", "fmi3.fmu"},
    "plcopen": {"xml"},
}


@pytest.fixture(autouse=True)
def few_rows(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    """Cut the vectors, which cost most of the time, where they are not what is tested."""
    calls = 2000 if "more_vectors" in request.fixturenames else 500
    monkeypatch.setattr(plc, "vectors_of", partial(vectors_of, most_calls=calls))
    monkeypatch.setattr(plc, "self_test_of", partial(plc.self_test_of, most_calls=5))


@pytest.fixture
def more_vectors() -> None:
    """Leave vectors enough to tell whether a text is right."""


@pytest.fixture
def lathe(root: Path) -> Path:
    return root / "examples" / "machine" / "models" / "lathe.json"


def words(*parts: object) -> argparse.Namespace:
    parser = argparse.ArgumentParser(allow_abbrev=False)
    export.add_arguments(parser)
    return parser.parse_args([str(part) for part in parts])


def run(*parts: object) -> int:
    return export.run(words(*parts))


def contents(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in folder.iterdir()}


def unpacked(files: dict[str, bytes]) -> dict[str, bytes]:
    """Return files with the members of units in place of the units."""
    found: dict[str, bytes] = {}
    for name, content in files.items():
        if not name.endswith(".fmu"):
            found[name] = content
            continue
        with ZipFile(BytesIO(content)) as unit:
            found |= {member.rpartition("/")[2]: unit.read(member) for member in unit.namelist()}
    return found


def small_model(path: Path, **changed: object) -> Path:
    part = Part("p", "T", "", 2.0, (Section(5.0, 300.0),))
    model = CompensationModel(outputs=(Output("X_um", (part,)),), **changed)
    write_model(model, path)
    return path


# ---- what is written ----------------------------------------------------------------------------


C_WORDS = [
    *((*real, *alone) for real in ((), ("--real", "32")) for alone in ((), ("--model-only",))),
    ("--name", "z axis"),
]


@pytest.mark.proof
@pytest.mark.parametrize("dialect", ["c", "fmu"])
@pytest.mark.parametrize("options", C_WORDS, ids=" ".join)
def test_every_exported_source_compiles_alone_without_a_warning(
    root, tmp_path, capsys, dialect, options
):
    """But for the source of a unit that calls FMI, whose headers the tool brings."""
    folder, model = tmp_path / "plc", root / "examples" / "models" / "spindle_table.json"
    command = (model, "--dialect", dialect, "--cycle-s", "1", *STATED, *options, "-o", folder)
    assert run(*command) == 0
    found = unpacked(contents(folder))
    sources = {name: text for name, text in found.items() if name.endswith((".c", ".h"))}
    for name, text in sources.items():
        (tmp_path / name).write_bytes(text)
    alone = [name for name in sources if name.endswith(".c") and name != "fmu.c"]
    assert len(alone) == 2
    for name in alone:
        gcc = ("gcc", "-std=c99", "-pedantic", "-Werror", "-c", name, "-o", "alone.o")
        built = subprocess.run(gcc, cwd=tmp_path, capture_output=True, text=True, check=False)
        assert (built.returncode, built.stderr) == (0, ""), name


@pytest.mark.parametrize("dialect", FILES)
def test_a_dialect_gets_its_program_vectors_guide_and_report(
    lathe, root, tmp_path, capsys, dialect
):
    machine = root / "examples" / "machine" / "lathe.toml"
    folder = tmp_path / "plc"
    assert run(
        *(lathe, "--dialect", dialect, "--cycle-s", "1.0", "--machine", machine, "-o", folder)
    ) == 0  # fmt: skip
    said = capsys.readouterr().out
    found = contents(folder)
    ends = {*FILES[dialect], "vectors.csv", "guide.md", "report.json"}
    apart = FILES[dialect] - {"xml", "fmi2.fmu", "fmi3.fmu"}
    library = {f"thermaxis_lib.{end}" for end in apart}
    tested = {f"tx_lathe_selftest.{end}" for end in apart - {"c"}}
    assert set(found) == {f"tx_lathe.{end}" for end in ends} | library | tested
    report = json.loads(found.pop("tx_lathe.report.json"))
    assert report["files"] == {name: sha256(text).hexdigest() for name, text in found.items()}
    assert report["model_sha256"] == model_sha256(read_model(lathe))
    assert report["models"] == [{"name": "lathe.json", "sha256": report["model_sha256"]}]
    assert report["limits"]["Z_um"]["largest_um"] == 280.0
    assert report["limits"]["Z_um"]["deadband_um"] == 0.5
    assert report["sensors"]["T_column_C"]["highest_c"] == 45.0
    # What is packed is not compressed, so that it is the same everywhere, and can be searched.
    headed = {"c": "h", "fmu": "fmi3.fmu", "plcopen": "xml"}.get(dialect, dialect)
    head = found[f"tx_lathe.{headed}"].decode("latin-1")
    vectors_hash = sha256(found["tx_lathe.vectors.csv"]).hexdigest()
    assert vectors_hash in head
    assert report["machine"]
    assert f"machine {report['machine']}" in head
    assert "Z_um: at most 280 µm and 0.5 µm/s, at most 0.5 µm in one call" in said
    assert "configuration of the machine" not in said
    assert "interlocks_met is one input for referenced, machine_on" in said
    for name in (*found, "tx_lathe.report.json"):
        assert f"written: {folder / name}" in said
    assert ("acceptance by STEP 7 or TIA Portal not checked" in said) == (dialect == "scl")


def warned_everywhere(folder: Path, said: str) -> str:
    """Return what is warned of in the summary, and look for it in head, guide and report."""
    (program,) = (path for path in folder.glob("tx_*.st") if "_selftest" not in path.name)
    head = program.read_text(encoding="ascii").partition("VAR_INPUT")[0]
    plain = " ".join(re.sub(r"[(*)]+", " ", head).split())
    guide = next(folder.glob("*.guide.md")).read_text(encoding="ascii")
    report = json.loads(next(folder.glob("*.report.json")).read_text(encoding="ascii"))
    lines = [line.removeprefix("warning: ") for line in said.splitlines() if "warning: " in line]
    for line in lines:
        if "interlocks_met" not in line and "redundant sensors" not in line:
            assert line in guide
            assert re.sub(r"[()]+", "", line) in re.sub(r" (?=[,:])", "", plain)
            assert any(line in text for text in report["warnings"])
    return "\n".join(lines)


def test_a_machine_with_another_cycle_or_for_another_model_is_warned_of_everywhere(
    lathe, root, tmp_path, capsys
):
    machine = root / "examples" / "machine" / "lathe.toml"
    other = tmp_path / "other.json"
    model = read_model(lathe)
    output = model.outputs[0]
    write_model(replace(model, outputs=(replace(output, offset_um=1.0),)), other)
    warned: dict[tuple[str, str], str] = {}
    for path in (lathe, other):
        for cycle_s in ("1.0", "10"):
            folder = tmp_path / f"{path.stem} {cycle_s}"
            order = ("--dialect", "st", "--reference", "stated", "--cycle-s", cycle_s)
            run(path, *order, "--machine", machine, "-o", folder)
            said = warned_everywhere(folder, capsys.readouterr().out)
            warned[path.name, cycle_s] = said
            assert ("the cycle is 10 s here and 1 s in the configuration" in said) == (
                cycle_s == "10"
            )
            assert ("a call may move the correction 10 times as far" in said) == (cycle_s == "10")
            assert ("is for the model lathe.json" in said) == (path is other)
    both = [f"{p.name} ({model_sha256(read_model(p))[:12]})" for p in (lathe, other)]
    assert all(name in warned["other.json", "1.0"] for name in both)


def test_the_same_words_give_the_same_bytes_wherever_they_are_written(lathe, tmp_path):
    folders = [tmp_path / "one", tmp_path / "two"]
    words = ("--dialect", "scl", "--cycle-s", "1", *STATED)
    for folder in folders:
        run(lathe, *words, "-o", folder)
    assert contents(folders[0]) == contents(folders[1])
    whole = b"".join(contents(folders[0]).values())
    assert str(tmp_path).encode() not in whole
    again = folders[0]
    run(lathe, *words, "-o", again)
    assert contents(again) == contents(folders[1])
    assert sorted(path.name for path in tmp_path.iterdir()) == ["one", "two"]


def test_json_alone_goes_to_standard_output_and_is_the_report(tmp_path, capsys):
    model = small_model(tmp_path / "x.json")
    folder = tmp_path / "plc"
    run(model, "--dialect", "c", "--cycle-s", "1", *STATED, "--json", "-", "-o", folder)
    printed = json.loads(capsys.readouterr().out)
    assert printed == json.loads((folder / "tx_x.report.json").read_text(encoding="ascii"))
    assert printed["numbers"] == "LREAL"
    assert printed["arithmetic"]["tolerance_um"] is None
    assert printed["instance_bytes"] is None


@pytest.mark.proof
def test_an_s7_300_gets_real_by_itself_and_the_tolerance_is_said(tmp_path):
    model = small_model(tmp_path / "x.json")
    for name, option in (("a", ("--cpu", "s7-300")), ("b", ("--real", "32"))):
        folder = tmp_path / name
        run(model, "--dialect", "scl", *option, "--cycle-s", "1", *STATED, "-o", folder)
        report = json.loads((folder / "tx_x.report.json").read_text(encoding="ascii"))
        assert (report["numbers"], report["variant"]) == ("REAL", "s7-300")
        assert report["arithmetic"]["tolerance_um"] == 0.002
        for scl in folder.glob("*.scl"):
            assert "LREAL" not in scl.read_text(encoding="ascii")
    asked = ("export", model, "--dialect", "scl", "--cpu", "s7-300", "--real", "64")
    assert code_of(*asked, "--cycle-s", "1", *STATED, "-o", tmp_path / "c") == "no_lreal_in_cpu"


def test_how_long_a_temperature_may_stand_is_stated_or_told(tmp_path, capsys):
    model = small_model(tmp_path / "x.json")
    order = (model, "--dialect", "c", "--cycle-s", "1", *STATED, "-o", tmp_path / "plc")
    run(*order)
    assert "without any change for 4 h" in capsys.readouterr().out
    run(*order, "--frozen-s", "7200", "--moves-with", "T=air:0.5", "--real", "32")
    assert "without any change" not in capsys.readouterr().out
    sensors = json.loads(contents(tmp_path / "plc")["tx_x.report.json"])["sensors"]
    rows = {name: (s["frozen_s"], s["moves_with"], s["rests_k"]) for name, s in sensors.items()}
    assert rows == {"T": (7200.0, "air", 0.5), "air": (7200.0, "", 0.0)}


@pytest.mark.proof
def test_a_delay_is_rounded_to_cycles_and_a_size_too_large_for_an_s7_300_is_warned_of(
    tmp_path, capsys
):
    sizes: list[int] = []
    for delay_s in (0.0, 100.4, 9000.0):
        part = Part("p", "T", "", 2.0, (Section(5.0, 300.0),), delay_s=delay_s)
        path = tmp_path / f"d{delay_s:.0f}.json"
        write_model(CompensationModel(outputs=(Output("X_um", (part,)),)), path)
        folder = tmp_path / f"plc{delay_s:.0f}"
        capsys.readouterr()
        run(path, "--dialect", "scl", "--cpu", "s7-300", "--cycle-s", "1", *STATED, "-o", folder)
        warned = "the instance data take" in capsys.readouterr().out
        report = json.loads(next(folder.glob("*.report.json")).read_text(encoding="ascii"))
        sizes.append(report["instance_bytes"])
        assert warned == (delay_s == 9000.0)
        changed = ["delay of p: 100.4 s in the model, 100 s here"] if delay_s == 100.4 else []
        assert report["changed"] == changed
    assert 100 < sizes[0] < 1000
    assert 400 <= sizes[1] - sizes[0] < 450  # 100 numbers of 4 bytes, and where they stand
    assert sizes[2] - sizes[1] == 4 * 8900


def test_a_model_that_counts_from_its_start_warns_everywhere_with_its_hours(tmp_path, capsys):
    parts = (Part("p", "T", "", 2.0, (Section(5.0, 300.0), Section(1.0, 12_000.0))),)
    path = tmp_path / "w.json"
    write_model(CompensationModel(outputs=(Output("X_um", parts),)), path)
    run(path, "--dialect", "st", "--cycle-s", "1", *STATED, "-o", tmp_path / "plc")
    said = capsys.readouterr().out
    report = json.loads((tmp_path / "plc" / "tx_w.report.json").read_text(encoding="ascii"))
    guide = (tmp_path / "plc" / "tx_w.guide.md").read_text(encoding="ascii")
    head = (tmp_path / "plc" / "tx_w.st").read_text(encoding="ascii").partition("VAR_INPUT")[0]
    plain = " ".join(re.sub(r"[(*)]+", " ", head).split())
    for text in (said, guide, plain, " ".join(report["warnings"])):
        assert "about three of its slowest time constants, 10 h" in text
    assert report["reference"] == "start"


def test_a_model_that_its_identification_condemns_is_refused_unless_somebody_insists(
    tmp_path, capsys
):
    verdict = "do not use it, it explains nothing: it leaves 10.4 um (of 9.8 um); give another test"
    figures = {"X_um.fit_percent": -6.0, "X_um.condemned": 1.0}
    path = small_model(
        tmp_path / "w.json", provenance=Provenance(figures=figures), warnings=(verdict,)
    )
    words = (path, "--dialect", "st", "--cycle-s", "1", *STATED, "-o", tmp_path / "plc")
    assert refusal("export", *words).code == "condemned"
    assert not (tmp_path / "plc").exists()
    run(*words, "--condemned")
    said = [line for line in capsys.readouterr().out.splitlines() if "warning: " in line]
    assert said[0] == f"warning: {verdict}"
    head = (tmp_path / "plc" / "tx_w.st").read_text(encoding="ascii").partition("VAR_INPUT")[0]
    plain = " ".join(re.sub(r"[(*)]+", " ", head).split())
    first = plain.partition("Warning: ")[2]
    assert first.startswith(
        "do not use it - it explains nothing. it leaves 10.4 um of 9.8 um. give another test"
    )


def test_stated_references_that_a_model_has_make_what_a_stated_model_makes(tmp_path, capsys):
    (tmp_path / "a").mkdir()
    (tmp_path / "b").mkdir()
    begins = small_model(tmp_path / "a" / "x.json", reference="start", reference_c={"T": 21.5})
    states = small_model(tmp_path / "b" / "x.json", reference="stated", reference_c={"T": 21.5})
    order = ("--dialect", "st", "--cycle-s", "1", *STATED)
    run(begins, *order, "--reference", "stated", "-o", tmp_path / "one")
    said = capsys.readouterr().out
    run(states, *order, "-o", tmp_path / "two")
    one, two = contents(tmp_path / "one"), contents(tmp_path / "two")
    assert one["tx_x.vectors.csv"] == two["tx_x.vectors.csv"]
    code = [files["tx_x.st"].partition(b"\nVAR_INPUT\n")[2] for files in (one, two)]
    assert code[0] == code[1] != b""
    assert "changed: references: those that the model states" in said
    assert "slowest time constants" not in said
    report = json.loads(one["tx_x.report.json"])
    assert report["model_sha256"] == model_sha256(read_model(states))
    assert report["models"][0]["sha256"] == model_sha256(read_model(begins))
    lacking = small_model(tmp_path / "y.json")
    asked = (*order, "--reference", "stated", "-o", tmp_path / "three")
    assert code_of("export", lacking, *asked) == "no_stated_reference"


@pytest.mark.proof
def test_hostile_names_leave_a_text_of_legal_signs_and_short_lines(tmp_path):
    hostile = "*) END_FUNCTION_BLOCK; // /* \\ \" ' `; <b> | # öß {0}"
    parts = tuple(
        Part(f"{hostile}{k}", f"T{hostile}{k}", "", 1.0, (Section(1.0, 50.0 + k),)) for k in (1, 2)
    )
    model = CompensationModel(outputs=(Output(f"Step {hostile}", parts),), warnings=(hostile,))
    path = tmp_path / "h.json"
    write_model(model, path)
    for dialect in FILES:
        folder = tmp_path / dialect
        name = "ärger; DROP */ (* if"
        run(path, "--dialect", dialect, "--name", name, "--cycle-s", "0.3", *STATED, "-o", folder)
        for found, content in unpacked(contents(folder)).items():
            assert content.isascii(), found
            if found.startswith("tx_") and found.endswith((".scl", ".st", ".c", ".h")):
                lines = content.decode("ascii").splitlines()
                assert max(map(len, lines)) <= 100
                for line in lines:
                    assert line.count("(*") == line.count("*)")
                    assert line.count("/*") == line.count("*/")
                    assert "DROP */" not in line
    assert (tmp_path / "st" / "tx_arger_drop_if.st").exists()


# ---- the folder ---------------------------------------------------------------------------------


def test_nothing_else_in_the_folder_is_overwritten(tmp_path):
    model = small_model(tmp_path / "x.json")
    folder = tmp_path / "plc"
    order = (model, "--dialect", "c", "--cycle-s", "1", *STATED, "-o", folder)
    run(*order)
    (folder / "mine.c").write_text("int x;", encoding="ascii")
    before = contents(folder)
    error = refusal("export", *order)
    assert (error.code, error.values["name"]) == ("folder_holds_foreign_file", "mine.c")
    assert contents(folder) == before
    (folder / "mine.c").unlink()
    (folder / "tx_x.c").write_text("int x;", encoding="ascii")
    error = refusal("export", *order)
    assert (error.code, error.values["name"]) == ("exported_file_changed", "tx_x.c")
    assert (folder / "tx_x.c").read_text(encoding="ascii") == "int x;"
    (folder / "tx_x.c").write_bytes(before["tx_x.c"])
    report = before["tx_x.report.json"].replace(b'"cycle_s": 1.0', b'"cycle_s": 2.0')
    (folder / "tx_x.report.json").write_bytes(report)
    assert code_of("export", *order) == "exported_file_changed"


def test_a_folder_with_a_report_that_is_none_is_refused(tmp_path):
    model = small_model(tmp_path / "x.json")
    order = (model, "--dialect", "c", "--cycle-s", "1", *STATED, "-o")
    for k, text in enumerate(("[]", "{", '{"format": "other"}', "[" * 100_000)):
        folder = tmp_path / f"f{k}"
        folder.mkdir()
        (folder / "tx_x.report.json").write_text(text, encoding="ascii")
        assert code_of("export", *order, folder) == "folder_holds_foreign_file"


def test_a_file_a_link_and_a_place_that_does_not_exist_are_refused(tmp_path):
    model = small_model(tmp_path / "x.json")
    order = (model, "--dialect", "c", "--cycle-s", "1", *STATED, "-o")
    (tmp_path / "real").mkdir()
    (tmp_path / "link").symlink_to(tmp_path / "real")
    for place, code in (
        (model, "not_a_folder"),
        (tmp_path / "link", "not_a_folder"),
        (tmp_path / "none" / "plc", "folder_missing"),
    ):
        assert code_of("export", *order, place) == code
    assert list((tmp_path / "real").iterdir()) == []


@pytest.mark.parametrize("ends", [KeyboardInterrupt, OSError(28, "No space left on device")])
def test_whatever_ends_the_swap_puts_the_older_export_back(tmp_path, monkeypatch, ends):
    model = small_model(tmp_path / "x.json")
    folder = tmp_path / "plc"
    order = (model, "--dialect", "c", *STATED, "-o", folder)
    run(*order, "--cycle-s", "1")
    before = contents(folder)
    moved = Path.replace

    def ending(path: Path, target: Path) -> Path:
        if path.name == "new":
            raise ends
        return moved(path, target)

    monkeypatch.setattr(Path, "replace", ending)
    with pytest.raises((KeyboardInterrupt, ConfigurationError)) as caught:
        run(*order, "--cycle-s", "2")
    assert getattr(caught.value, "code", "") in {"", "folder_unwritable"}
    assert contents(folder) == before
    assert sorted(path.name for path in tmp_path.iterdir()) == ["plc", "x.json"]


def test_what_somebody_puts_there_during_the_swap_is_found_and_kept(tmp_path, monkeypatch):
    model = small_model(tmp_path / "x.json")
    folder = tmp_path / "plc"
    order = (model, "--dialect", "c", *STATED, "-o", folder)
    run(*order, "--cycle-s", "1")
    moved = Path.replace

    def late(path: Path, target: Path) -> Path:
        if path.name == "plc":
            (path / "mine.c").write_text("int x;", encoding="ascii")
        return moved(path, target)

    monkeypatch.setattr(Path, "replace", late)
    assert code_of("export", *order, "--cycle-s", "2") == "folder_holds_foreign_file"
    assert (folder / "mine.c").read_text(encoding="ascii") == "int x;"
    assert (folder / "tx_x.c").exists()


def test_an_empty_folder_is_taken_and_another_name_replaces_the_older_export(tmp_path):
    model = small_model(tmp_path / "x.json")
    folder = tmp_path / "plc"
    folder.mkdir()
    order = (model, "--dialect", "c", "--cycle-s", "1", *STATED, "-o", folder)
    run(*order, "--name", "one")
    run(*order, "--name", "two")
    stems = {name.partition(".")[0] for name in contents(folder)}
    assert stems == {"tx_two", "tx_two_selftest", "thermaxis_lib"}


# ---- what is refused ----------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("options", "code", "key"),
    [
        (("--rate", "0.5", "--plausible", "5:80"), "not_stated_for", "--limit"),
        ((*STATED, "--limit", "Y_um=3"), "unknown_name", "--limit"),
        ((*STATED, "--rate", "0.7"), "stated_twice", "--rate"),
        ((*STATED, "--at", "3"), "option_belongs_to", "--at"),
        ((*STATED, "--moves-with", "Y=air:0.5"), "unknown_name", "--moves-with"),
        ((*STATED, "--moves-with", "T=T:0.5"), "moves_with_itself", "--moves-with"),
        ((*STATED, "--moves-with", "T=air:0"), "not_positive_up_to", "--moves-with"),
        ((*STATED, "--frozen-s", "-1"), "outside_range", "--frozen-s"),
        ((*STATED, "--frozen-s", "9", "--model-only"), "option_belongs_to", "--frozen-s"),
        ((*STATED, "--cpu", "s7-300"), "option_belongs_to", "--cpu"),
    ],
)
def test_what_is_missing_or_contradicts_is_named(tmp_path, options, code, key):
    folder = tmp_path / "plc"
    model = small_model(tmp_path / "x.json")
    order = ("export", model, "--dialect", "c", "--cycle-s", "1", "-o", folder)
    error = refusal(*order, *options)
    assert (error.code, error.place.key) == (code, key)
    assert not folder.exists()


def test_a_name_becomes_one_of_the_plc_or_is_refused(tmp_path):
    model = small_model(tmp_path / "x.json")
    order = (model, "--dialect", "c", "--cycle-s", "1", "-o", tmp_path / "plc", *STATED)
    for name in ("***", "sensor"):
        refusal("export", *order, "--name", name)
        assert not (tmp_path / "plc").exists()
    run(*order, "--name", "öß*")
    assert (tmp_path / "plc").exists()


def test_rules_of_a_machine_and_stated_ones_exclude_each_other(lathe, root, tmp_path):
    machine = root / "examples" / "machine" / "lathe.toml"
    order = (lathe, "--dialect", "c", "--cycle-s", "1", "--machine", machine)
    error = refusal("export", *order, "--limit", "3", "-o", tmp_path / "plc")
    assert (error.code, error.place.key) == ("options_exclude", "--limit")
    other = small_model(tmp_path / "x.json")
    assert ", input: " in str(refusal("export", other, *order[1:], "-o", tmp_path / "plc"))


def test_a_range_that_is_none_is_refused(capsys):
    for text in ["a=b", "5", "5:", "nan:3", "T=5:inf"]:
        with pytest.raises(SystemExit):
            words("m.json", "--dialect", "c", "--cycle-s", "1", "-o", "d", f"--plausible={text}")
        assert "--plausible" in capsys.readouterr().err
    with pytest.raises(SystemExit):
        words("m.json", "--dialect", "c", "--cycle-s", "1", "-o", "d", "--moves-with", "T=air")


# ---- positions of an axis -----------------------------------------------------------------------


def test_models_at_positions_become_one_block_with_a_line(root, tmp_path, capsys):
    models = [root / "examples" / "models" / f"eps{k}.json" for k in (1, 2)]
    places = ("--at", "-100", "--at", "900.5", "--positive", "towards")
    folder = tmp_path / "plc"
    order = (*models, "--dialect", "sinumerik-tempcomp", "--cycle-s", "1", *places, *STATED)
    assert run(*order, "--real", "32", "-o", folder) == 0
    report = json.loads((folder / "tx_z.report.json").read_text(encoding="ascii"))
    assert report["line"]["positions_mm"] == [-100.0, 900.5]
    assert report["line"]["largest_slope"] == pytest.approx(0.56 / 1000.5, rel=1e-5)
    assert [entry["name"] for entry in report["models"]] == ["eps1.json", "eps2.json"]
    assert report["variant"] == "s7-300"
    text = (folder / "tx_z.scl").read_text(encoding="ascii")
    assert "read_k0_mm" in text
    head = " ".join(text.partition("VAR_INPUT")[0].replace("*)\n(*", "").split())
    k0_mm, slope = re.findall(r"Largest K0 ([0-9.]+) mm, largest slope ([0-9.]+) mm/mm", head)[0]
    assert 0.0 < report["line"]["largest_slope"] <= float(slope)
    assert 0.0 < report["line"]["largest_k0_mm"] <= float(k0_mm)
    guide = (folder / "tx_z.guide.md").read_text(encoding="ascii")
    for said in (guide, capsys.readouterr().out):
        assert f" {k0_mm} mm" in said
        assert f" {slope} mm/mm" in said


def test_outputs_of_one_model_may_be_the_positions(tmp_path):
    part = Part("p", "T", "", 2.0, (Section(5.0, 300.0),))
    names = ("k0_mm", "slope", "unused_um")
    path = tmp_path / "m.json"
    write_model(CompensationModel(outputs=tuple(Output(name, (part,)) for name in names)), path)
    order = (path, "--dialect", "sinumerik-tempcomp", "--cycle-s", "1", "--positive", "away")
    limits = ("--limit", "20", "--rate", "slope=2", "--rate", "1", "--plausible", "5:80")
    places = ("--at", "slope=800", "--at", "k0_mm=100")
    run(*order, *limits, *places, "-o", tmp_path / "plc")
    report = json.loads((tmp_path / "plc" / "tx_m.report.json").read_text(encoding="ascii"))
    rates = {name: one["largest_rate_um_per_s"] for name, one in report["limits"].items()}
    assert rates == {"at_800": 2.0, "at_100": 1.0}


def test_one_position_or_none_makes_an_offset_with_the_block_that_brings_it_to_the_control(
    tmp_path,
):
    part = Part("p", "T", "", 2.0, (Section(5.0, 300.0),))
    path = tmp_path / "m.json"
    write_model(CompensationModel(outputs=(Output("X_um", (part,)), Output("Z_um", (part,)))), path)
    order = (path, "--dialect", "sinumerik-tempcomp", "--cycle-s", "1", *STATED)
    folder = tmp_path / "plc"
    run(*order, "--positive", "away", "--positive", "Z_um=towards", "-o", folder)
    block = folder / "tx_m.scl"
    assert {p.name for p in folder.glob("*.scl")} == {
        *("thermaxis_lib.scl", "thermaxis_sinumerik.scl", block.name, "tx_m_selftest.scl")
    }
    said = [re.findall(r"um_per_mm := (\S+),", p.read_text("ascii")) for p in folder.glob("*.md")]
    assert said == [["-1000.0", "1000.0"]]
    other = tmp_path / "other"
    run(path, "--dialect", "scl", "--cycle-s", "1", *STATED, "-o", other)
    assert block.read_bytes() == (other / block.name).read_bytes()
    run(small_model(path), *order[1:], "--at", "5", "--positive", "X_um=away", "-o", tmp_path / "x")
    assert (tmp_path / "x" / "thermaxis_sinumerik.scl").exists()
    for words_, code in (
        ((), "direction_not_stated"),
        (("--positive", "Y_um=away"), "unknown_name"),
        (("--positive", "away", "--at", "Y_um=1"), "unknown_name"),
        (("--positive", "away", "--reference-position", "5"), "option_belongs_to"),
        (("--positive", "away", "--model-only"), "option_belongs_to"),
    ):
        assert code_of("export", *order, *words_, "-o", tmp_path / "no") == code


def test_a_direction_that_is_none_is_refused(capsys):
    for text in ["up", "Z_um=", "away=Z_um"]:
        with pytest.raises(SystemExit):
            words("m.json", "--dialect", "c", "--cycle-s", "1", "-o", "d", "--positive", text)
        assert "is no direction; write away or towards" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("options", "code"),
    [
        (("--at", "1", "--at", "900"), "direction_not_stated"),
        (("--at", "1", "--at", "900", "--positive", "X_um=away"), "direction_not_stated"),
        (("--at", "100", "--positive", "away"), "models_and_positions_differ"),
        (("--at", "1", "--at", "1.5", "--positive", "away"), None),
    ],
)
def test_positions_that_are_missing_or_impossible_are_named(tmp_path, options, code):
    models = [small_model(tmp_path / f"{k}.json") for k in (1, 2)]
    order = (*models, "--dialect", "sinumerik-tempcomp", "--cycle-s", "1", *STATED)
    error = refusal("export", *order, *options, "-o", tmp_path / "plc")
    assert code is None or error.code == code
    assert not (tmp_path / "plc").exists()


def test_models_that_refer_to_other_temperatures_make_no_line(tmp_path):
    one = small_model(tmp_path / "1.json", reference="stated", reference_c={"T": 20.0})
    two = small_model(tmp_path / "2.json", reference="stated", reference_c={"T": 21.0})
    three = small_model(tmp_path / "3.json")
    places = ("--at", "0", "--at", "900", "--positive", "away", *STATED)
    order = ("--dialect", "sinumerik-tempcomp", "--cycle-s", "1", *places, "-o", tmp_path / "p")
    error = refusal("export", one, two, *order)
    assert (error.code, error.place.file, error.place.channel) == (
        *("reference_temperatures_differ", "2.json", "T"),
    )
    assert (error.values["value_c"], error.values["other_c"]) == (21.0, 20.0)
    assert code_of("export", one, three, *order) == "models_begin_differently"
    alone = ("--dialect", "st", "--cycle-s", "1", *STATED, "-o", tmp_path / "p")
    assert code_of("export", one, two, *alone) == "block_has_one_model"


# ---- the vectors, as a user would run them ------------------------------------------------------


@pytest.mark.proof
@pytest.mark.usefixtures("more_vectors")
@pytest.mark.parametrize(
    ("dialect", "bits"),
    [
        ("scl", "32"),
        *(
            pytest.param(dialect, "64", marks=pytest.mark.proof)
            for dialect in ("st", "c", "sinumerik-tempcomp")
        ),
    ],
)
def test_the_exported_text_says_what_the_exported_vectors_say(root, tmp_path, dialect, bits):
    sections = tuple(Section(1.0 + k, 100.0 * 2.5**k) for k in range(8))
    gains = (GainPoint(0.0, 1.0), GainPoint(1000.0, 2.0))
    parts = (
        Part("p", "T1", "T2", 2.0, sections, gain_by_diameter=gains),
        Part("q", "T2", "", 0.0, (Section(-4.0, 700.0),), delay_s=20.0),
    )
    path = tmp_path / "m.json"
    write_model(CompensationModel(outputs=(Output("X_um", parts), Output("Y_um", parts[:1]))), path)
    models = [root / "examples" / "models" / f"x_at_{mm}.json" for mm in (100, 500, 900)]
    line = ("--at", "100", "--at", "500", "--at", "900", "--positive", "away")
    order = (*models, *line) if dialect == "sinumerik-tempcomp" else (path,)
    folder = tmp_path / "plc"
    limits = ("--limit", "20", "--rate", "0.5", "--plausible", "5:80")
    kind = ("--dialect", dialect, "--real", bits, "--name", "m", "--cycle-s", "10")
    run(*order, *kind, *limits, "-o", folder)
    if dialect == "c":
        files = tuple(
            (p.name, p.read_text("ascii")) for p in folder.iterdir() if p.suffix in ".h.c"
        )
    else:
        texts = [p for p in folder.iterdir() if p.suffix in {".scl", ".st"}]
        made = sorted(p for p in texts if p.name != f"tx_m_selftest{p.suffix}")
        c = st_as_c([p.read_text("ascii") for p in made], "tx_m")
        files = (("tx_m.h", c.header), ("tx_m.c", c.source))
    vectors = (folder / "tx_m.vectors.csv").read_text(encoding="ascii")
    names, *rows = [row.split(",") for row in vectors.splitlines() if not row.startswith("#")]
    ends = names.index("read_ok") + 1
    calls = [int(row[1]) for row in rows]
    told = [
        tuple(map(float, row[3:ends])) for row, n in zip(rows, calls, strict=True) for _ in range(n)
    ]
    starts = [k == 0 for k in range(len(told))]
    block = CBlock(files, tuple(names[3:ends]), tuple(names[ends:]))
    library = CLibrary(c_library({"tx_m": block}, tmp_path / "built", "-O1"))
    said = library.called("tx_m", told, starts, len(names) - ends)
    wanted = np.array([row[ends:] for row in rows], dtype=float)
    judged = np.array([row[2] == "1" for row in rows])
    away = np.abs(said[np.cumsum(calls) - 1] - wanted)[judged]
    assert np.max(away) <= (0.0 if bits == "64" else 0.002)
    assert np.mean(judged) > 0.97
    assert wanted.size > 6000


# ---- the page -----------------------------------------------------------------------------------


def test_the_page_names_every_key_of_the_report(root, tmp_path):
    page = (root / "docs" / "how-to" / "export-to-a-plc.md").read_text(encoding="utf-8")
    model = small_model(tmp_path / "x.json")
    run(model, "--dialect", "c", "--cycle-s", "1", *STATED, "-o", tmp_path / "plc")
    report = json.loads((tmp_path / "plc" / "tx_x.report.json").read_text(encoding="ascii"))
    table = page.partition("## The report")[2].partition("## Not protected")[0]
    named = {
        key.partition(".")[0]
        for row in re.findall(r"^\| (`.*?) \|", table, re.MULTILINE)
        for key in re.findall(r"`([^`]+)`", row)
    }
    assert named == set(report)
    for key in report["arithmetic"]:
        assert f"`arithmetic.{key}`" in table
