"""Errors of ``thermaxis export`` are at what was typed: options, files, and keys of a machine."""

import argparse
import shutil
from collections.abc import Mapping
from pathlib import Path

import pytest

from tests.refusals import refused
from thermaxis.cli.exchange import export
from thermaxis.compensation import CompensationModel, GainPoint, Output, Part, Section
from thermaxis.files import write_model

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


def exported(words: str, folder: Path) -> None:
    """Export into a folder that stays away where the export is refused."""
    parser = argparse.ArgumentParser()
    export.add_arguments(parser)
    dialect = "" if "--dialect" in words else " --dialect st"
    try:
        export.run(parser.parse_args([*f"{words}{dialect}".split(), "-o", str(folder / "plc")]))
    finally:
        assert not (folder / "plc").exists()


@pytest.mark.parametrize(
    ("options", "key", "code"),
    [
        (f"--cycle-s 100 {STATED}", "--cycle-s", "outside_range"),
        (f"--cycle-s 0.1 {REAL} {STATED}", "--cycle-s", "cycle_not_counted"),
        (f"--cycle-s 1 --name lag {STATED}", "--name", "block_name_taken"),
        (f"--cycle-s 1 --name ??? {STATED}", "--name", "name_without_letters"),
        (
            f"--cycle-s 1 {REAL} --limit 9000 --rate 1e-4 --plausible 5:80",
            "--rate",
            "rate_lost_in_real",
        ),
        ("--cycle-s 1 --limit 0 --rate 1 --plausible 5:80", "--limit", "not_positive_up_to"),
        ("--cycle-s 1 --limit 9 --rate 1 --plausible 80:5", "--plausible", "no_range"),
    ],
)
def test_what_was_typed_wrong_is_named_as_an_option(options, key, code, tmp_path):
    model = a_model(tmp_path / "m.json")
    with refused(code) as caught:
        exported(f"{model} {options}", tmp_path)
    assert caught.value.place.key == key


MODELS: Mapping[str, tuple[dict[str, object], str, str, tuple[str, str]]] = {
    "gap": ({"longest_gap_s": 5.0}, "--cycle-s 10", "gap_within_cycle", ("longest_gap_s", "")),
    "outputs": ({"outputs": 9}, "--cycle-s 1", "outside_count", ("outputs", "")),
    "delay": ({"part": a_part(delay_s=20_000.0)}, "--cycle-s 1", "delay_too_long", ("parts", "p")),
    "diameters": (
        {"part": a_part(gain_by_diameter=CLOSE)},
        f"--cycle-s 1 {REAL}",
        "diameters_equal_in_real",
        ("parts", "p"),
    ),
    "part": ({"part": a_part("???")}, "--cycle-s 1", "name_without_letters", ("parts", "???")),
    "channel": (
        {"part": a_part("p", "?")},
        "--cycle-s 1",
        "name_without_letters",
        ("channels", "?"),
    ),
}


@pytest.mark.parametrize("what", MODELS)
def test_what_the_target_cannot_hold_of_a_model_is_named_with_its_file(what, tmp_path):
    traits, options, code, (key, channel) = MODELS[what]
    model = a_model(tmp_path / "m.json", **traits)
    with refused(code, file=model, key=key, channel=channel):
        exported(f"{model} {options} {STATED}", tmp_path)


@pytest.mark.parametrize(
    ("old", "new", "key", "code"),
    [
        (
            "highest_c = 45.0",
            "highest_c = 45.0\nfrozen_s = 900000.0",
            "input.T_column_C.frozen_s",
            "time_not_counted",
        ),
        (
            "largest_rate_um_per_s = 0.5",
            "largest_rate_um_per_s = 0.001",
            "output.Z_um.largest_rate_um_per_s",
            "rate_lost_in_real",
        ),
        ("margin_k = 5.0", "margin_k = 1e-42", "validity.margin_k", "too_small_for_plc"),
    ],
)
def test_a_rule_of_a_machine_is_named_by_file_table_and_key(old, new, key, code, root, tmp_path):
    shutil.copytree(root / "examples" / "machine", tmp_path / "machine")
    machine, model = (tmp_path / "machine" / n for n in ("lathe.toml", "models/lathe.json"))
    text = machine.read_text(encoding="utf-8")
    assert old in text
    machine.write_text(text.replace(old, new, 1), encoding="utf-8")
    with refused(code, file=machine, key=key):
        exported(f"{model} --cycle-s 0.1015625 {REAL} --machine {machine}", tmp_path)
