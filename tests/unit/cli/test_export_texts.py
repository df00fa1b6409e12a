"""Text from people in an export: every piece passes `remark_text` once and only once, everywhere.

The filter is replaced by one that puts marks around what passed, so that a second pass shows too.
"""

import argparse
import re
from collections import Counter
from dataclasses import replace
from functools import partial
from pathlib import Path
from sys import modules

import pytest

from tests.proofs import quick_first
from thermaxis import plc
from thermaxis.cli.exchange import _export_files, export
from thermaxis.cli.exchange._export_settings import Exported
from thermaxis.compensation import CompensationModel, Output, Part, Provenance, Section, TrainingLog
from thermaxis.files import write_model

FILTER = "remark_text"
DIALECTS = {
    "st": (),
    "scl": (),
    "scl of an S7-300": ("--cpu", "s7-300"),
    "st of TwinCAT": ("--flavour", "twincat"),
    "c": (),
    "sinumerik-tempcomp": ("--at", "PEOPLEa=100", "--at", "PEOPLEb=900", "--positive", "away"),
    "sinumerik-tempcomp of offsets": ("--positive", "away"),
}


def hostile(letter: str) -> str:
    """Return a text that would end a remark; what is left of it shows whether it passed."""
    return f"PEOPLE{letter} *) */ // (* END_VAR ; $ ' \" |"


def marked(text: str, longest: int = 60) -> str:
    """Stand in for the filter: whoever passes twice is marked twice."""
    assert longest >= 60
    return f"ZQ{re.sub('[^A-Za-z0-9]', '', text)}QZ"


def a_model(path: Path) -> Path:
    spindle, column, part_a, part_b = map(hostile, "cdef")
    parts = (
        Part(part_a, spindle, column, 1.0, (Section(2.0, 300.0),), delay_s=2.4),
        Part(part_b, column, "", 0.5, lowest_k=-5.0, highest_k=9.0),
    )
    model = CompensationModel(
        # Outputs of a line are named on the command line.
        outputs=(Output("PEOPLEa", parts), Output("PEOPLEb", (Part("PEOPLEk", spindle, "", 1.0),))),
        warnings=(hostile("g"),),
        provenance=Provenance(
            method=hostile("h"),
            program=hostile("i"),
            date=hostile("j"),
            logs=(TrainingLog(hostile("l"), "0" * 64, 100),),
            figures={hostile("m"): 1.5},
        ),
    )
    write_model(model, path)
    return path


def texts_of(dialect: str, folder: Path, monkeypatch: pytest.MonkeyPatch) -> dict[str, str]:
    """Return the files of an export, with the marks."""
    plain = _export_files.exported_of

    def of_a_machine(arguments: argparse.Namespace, *, tempcomp: bool) -> Exported:
        exported = plain(arguments, tempcomp=tempcomp)
        named = replace(exported.compensation, interlocks=(hostile("n"), hostile("o")))
        return exported._replace(machine=hostile("p"), compensation=named)

    parser = argparse.ArgumentParser()
    export.add_arguments(parser)
    path = a_model(folder / "m.json")
    words = [str(path), "--dialect", dialect.partition(" ")[0], "--cycle-s", "1"]
    words += [*DIALECTS[dialect], "--name", hostile("q"), "-o", str(folder / "plc")]
    words += ["--limit", "20", "--rate", "0.5", "--plausible", "5:80"]
    monkeypatch.setattr(_export_files, "exported_of", of_a_machine)
    for function in ("vectors_of", "self_test_of"):
        monkeypatch.setattr(plc, function, partial(getattr(plc, function), most_calls=50))
    files = _export_files.export_of(parser.parse_args(words)).files
    return {name: content.decode("utf-8") for name, content in files.items()}


@pytest.mark.parametrize("dialect", quick_first(2, DIALECTS))
def test_every_text_from_people_passes_the_filter_once_and_only_once(
    dialect, tmp_path, monkeypatch
):
    patched = 0
    for name, module in list(modules.items()):
        if name.startswith("thermaxis.") and hasattr(module, FILTER):
            monkeypatch.setattr(module, FILTER, marked)
            patched += 1
    assert patched >= 5
    files = texts_of(dialect, tmp_path, monkeypatch)
    seen = Counter[str]()
    for name, text in files.items():
        if name.endswith(".json"):
            continue  # JSON escapes what it must, and has the names as they are
        # Names of variables are in lower case; the guard of a C header is one in capitals.
        for found in re.finditer(r"(?<!TX_)PEOPLE", text):
            begin, end = found.span()
            assert text[begin - 2 : begin] == "ZQ", (name, text[begin - 40 : end + 20])
            assert text[begin - 4 : begin] != "ZQZQ", (name, text[begin - 40 : end + 20])
            seen[text[end]] += 1
        # Outputs of a line are named after their positions, which pass it too.
        passed = len(re.findall(r"(?<!TX_)PEOPLE|ZQat\d", text))
        assert text.count("ZQ") == text.count("QZ") == passed, name
    # Positions take the place of a line's outputs; what was read of it is of the model.
    lost = {"a", "b"} if "--at" in DIALECTS[dialect] else set[str]()
    assert set(seen) == set("abcdefghijklmnopq") - lost
