"""Errors of ``thermaxis export`` name what was typed: options, files, and keys of a machine."""

import shutil
from collections.abc import Mapping
from pathlib import Path

import pytest

from thermaxis.cli import main
from thermaxis.compensation import CompensationModel, GainPoint, Output, Part, Section
from thermaxis.files import write_model
from thermaxis.plc import PlcSettings

STATED = "--limit 280 --rate 0.5 --plausible 5:80"
REAL = "--real 32"
CLOSE = (GainPoint(100.0, 1.0), GainPoint(100.000001, 2.0))


def a_part(name: str = "p", channel: str = "T", **traits: object) -> Part:
    traits = {"sections": (Section(5.0, 300.0),), **traits}
    return Part(name, channel, "", 2.0, **traits)


def a_model(path: Path, part: Part | None = None, outputs: int = 1, **traits: object) -> Path:
    parts = (part or a_part(),)
    made = tuple(Output(f"X{k}_um", parts) for k in range(outputs))
    write_model(CompensationModel(outputs=made, **traits), path)
    return path


def said(words: str, folder: Path, capsys: pytest.CaptureFixture[str]) -> str:
    """Return what a refused export says, without the name of the program."""
    dialect = "" if "--dialect" in words else " --dialect st"
    capsys.readouterr()
    assert main(["export", *f"{words}{dialect}".split(), "-o", str(folder / "plc")]) == 2
    begin = "thermaxis: error: "
    error = capsys.readouterr().err
    assert error.startswith(begin)
    assert not (folder / "plc").exists()
    return error.removeprefix(begin).rstrip("\n")


OPTIONS = {
    f"--cycle-s 100 {STATED}": (
        "--cycle-s: 100 is not from 0.1 to 60. Write --cycle-s with 0.1 to 60 seconds."
    ),
    f"--cycle-s 0.1 {REAL} {STATED}": (
        "--cycle-s: in REAL times are not counted exactly with a cycle of 0.1 s. Write --cycle-s"
        " with a multiple of 1/128 s, such as 0.1015625, or --real 64."
    ),
    f"--cycle-s 0.1 --dialect scl --cpu s7-300 {STATED}": "or --cpu s7-1500 --real 64.",
    f"--cycle-s 1 --name lag {STATED}": (
        "--name: tx_lag is a name that the program needs itself. Write --name NAME, such as that"
        " of its axis."
    ),
    f"--cycle-s 1 --name ??? {STATED}": "--name: the name has no letter and no digit",
    f"--cycle-s 1 --name z_step {STATED}": "--name: a name may not end in _init, _step, _h. Write",
    f"--cycle-s 1 {REAL} --limit 9000 --rate 1e-4 --plausible 5:80": (
        "--rate of X0_um: in REAL its rate is lost in rounding: 0.0001 um in a cycle, of a total"
        " of 9000 um. Allow 0.977 um in a cycle or more: a longer --cycle-s, a higher --rate or a"
        " smaller --limit; or --real 64."
    ),
    "--cycle-s 1 --limit 0 --rate 1 --plausible 5:80": (
        "--limit: 0 is not above 0 and at most 10000. Write --limit OUTPUT=UM, such as --limit 100."
    ),
    "--cycle-s 1 --limit 9 --rate 0 --plausible 5:80": (
        "--rate: 0 is not above 0 and at most 1000. Write --rate OUTPUT=UM_PER_S, such as --rate"
        " 0.5."
    ),
    "--cycle-s 1 --limit 9 --rate 1 --plausible 80:5": (
        "--plausible: 80 to 5 is no range. Write --plausible CHANNEL=LOW:HIGH, such as --plausible"
        " 5:80."
    ),
}


@pytest.mark.parametrize("options", OPTIONS)
def test_what_was_typed_wrong_is_named_as_an_option(
    options: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    model = a_model(tmp_path / "m.json")
    error = said(f"{model} {options}", tmp_path, capsys)
    assert OPTIONS[options] in error
    assert error.startswith("--")


MODELS: Mapping[str, tuple[dict[str, object], str, str]] = {
    "gap": (
        {"longest_gap_s": 5.0},
        "--cycle-s 10",
        (
            "m.json, longest_gap_s: the model starts anew after 5 s, within a cycle. Export it"
            " with a shorter --cycle-s."
        ),
    ),
    "outputs": ({"outputs": 9}, "--cycle-s 1", "m.json, outputs: the model has 9 outputs, of"),
    "delay": (
        {"part": a_part(delay_s=20_000.0)},
        "--cycle-s 1",
        (
            "m.json, part p: its delay is 20000 cycles, longer than 10000. Export it with a longer"
            " --cycle-s."
        ),
    ),
    "tiny": (
        {"part": Part("p", "T", "", 1e-40)},
        f"--cycle-s 1 {REAL}",
        "m.json, part p: 1e-40 is too small for REAL. Export it with --real 64, or choose a unit",
    ),
    "diameters": (
        {"part": a_part(gain_by_diameter=CLOSE)},
        f"--cycle-s 1 {REAL}",
        (
            "m.json, part p: two diameters of its gains are one number in REAL. Export it with"
            " --real 64."
        ),
    ),
    "part": ({"part": a_part("???")}, "--cycle-s 1", "m.json, part ???: the name has no letter"),
    "channel": ({"part": a_part("p", "?")}, "--cycle-s 1", "m.json, channel ?: the name has no"),
}


@pytest.mark.parametrize("what", MODELS)
def test_what_the_target_cannot_hold_of_a_model_is_named_with_its_file(
    what: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    traits, options, words = MODELS[what]
    model = a_model(tmp_path / "m.json", **traits)
    error = said(f"{model} {options} {STATED}", tmp_path, capsys)
    assert error.startswith(str(tmp_path / words[:6]))
    assert words in error


def test_a_name_that_comes_from_the_file_is_named_as_the_file(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    model = a_model(tmp_path / "lag.json")
    assert said(f"{model} --cycle-s 1 {STATED}", tmp_path, capsys) == (
        f"{model}: tx_lag is a name that the program needs itself. Write --name NAME, such as that"
        " of its axis."
    )


KEYS = {
    ("highest_c = 45.0", "highest_c = 45.0\nfrozen_s = 900000.0"): (
        ", [input.T_column_C], frozen_s: 900000 s are more than the 131072 s that REAL counts"
        " exactly. Choose shorter times or a --cycle-s of whole seconds, or --real 64."
    ),
    ("largest_rate_um_per_s = 0.5", "largest_rate_um_per_s = 0.001"): (
        ", [output.Z_um], largest_rate_um_per_s: in REAL its rate is lost in rounding"
    ),
    ("deadband_um = 0.5", "deadband_um = 1e-42"): (
        ", [output.Z_um], deadband_um: 1e-42 is too small for REAL. Export it with --real 64, or"
    ),
    ("margin_k = 5.0", "margin_k = 1e-42"): (
        ", [validity], margin_k: 1e-42 is too small for REAL. Export it with --real 64, or"
    ),
}


@pytest.mark.parametrize("changed", KEYS)
def test_a_rule_of_a_machine_is_named_by_file_table_and_key(
    changed: tuple[str, str], root: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    shutil.copytree(root / "examples" / "machine", tmp_path / "machine")
    machine, model = (tmp_path / "machine" / n for n in ("lathe.toml", "models/lathe.json"))
    text = machine.read_text(encoding="utf-8")
    assert changed[0] in text
    machine.write_text(text.replace(*changed, 1), encoding="utf-8")
    words = f"{model} --cycle-s 0.1015625 {REAL} --machine {machine}"
    error = said(words, tmp_path, capsys)
    assert error.startswith(f"{machine}{KEYS[changed]}")
    if "rate" in changed[0]:
        assert "a higher largest_rate_um_per_s or a smaller total_um; or --real 64." in error


def test_a_sensor_that_the_machine_has_not_is_said_with_the_table_that_is_missing(
    root: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    machine = root / "examples" / "machine" / "lathe.toml"
    model = a_model(tmp_path / "m.json")
    assert said(f"{model} --cycle-s 1 --machine {machine}", tmp_path, capsys) == (
        f"{machine}: There is no entry for T. Give it a table [input.CHANNEL] for"
        " each, or leave --machine out and state everything."
    )


def test_a_slope_beyond_what_the_control_adds_names_limits_and_positions(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    models = " ".join(str(a_model(tmp_path / f"{k}.json")) for k in (1, 2))
    line = "--dialect sinumerik-tempcomp --positive away --at 1 --at 2.5"
    error = said(f"{models} --cycle-s 1 {line} {STATED}", tmp_path, capsys)
    assert error.startswith("--limit, --at: the limits allow a slope of 0.373 mm/mm")
    assert "State a smaller --limit, or take positions that lie further apart." in error


def test_a_rate_of_a_line_names_no_output_that_the_machine_does_not_have(
    root: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    shutil.copytree(root / "examples" / "machine", tmp_path / "machine")
    machine = tmp_path / "machine" / "lathe.toml"
    text = machine.read_text(encoding="utf-8")
    rate = "largest_rate_um_per_s = "
    machine.write_text(text.replace(f"{rate}0.5", f"{rate}0.001"), encoding="utf-8")
    model = tmp_path / "machine" / "models" / "lathe.json"
    line = "--dialect sinumerik-tempcomp --positive away --at 0 --at 900"
    words = f"{model} {model} --cycle-s 1 {REAL} {line} --machine {machine}"
    error = said(words, tmp_path, capsys)
    assert error.startswith(f"{machine}, [output], largest_rate_um_per_s: in REAL its rate")


def test_an_error_that_names_a_file_or_an_option_stays_as_it_is(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = f"{tmp_path / 'none.json'} --cycle-s 1 {STATED}"
    assert str(tmp_path / "none.json") in said(words, tmp_path, capsys)
    model = a_model(tmp_path / "m.json")
    error = said(f"{model} --cycle-s 1 --cpu s7-300 {STATED}", tmp_path, capsys)
    assert error == "--cpu: This option belongs to SCL. Leave it out."


def test_no_place_of_an_error_is_a_field_of_the_settings(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    fields = set(PlcSettings.__dataclass_fields__) | {"cycle_s", "largest_um", "parts", "outputs"}
    model = a_model(tmp_path / "m.json")
    for options in OPTIONS:
        place = said(f"{model} {options}", tmp_path, capsys).partition(":")[0]
        assert place not in fields
