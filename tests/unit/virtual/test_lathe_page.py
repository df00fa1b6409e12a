"""The page on the virtual lathe: its commands run or parse, its sentences are faults."""

import argparse
import re
import shlex
from pathlib import Path

import pytest

from thermaxis.cli.machine import machine
from thermaxis.virtual import FAULTY, SCENARIOS, SIGNALS, FaultKind, parse_fault


@pytest.fixture(scope="module")
def page(root: Path) -> str:
    pages = (root / "docs" / folder / "virtual-lathe.md" for folder in ("how-to", "theory"))
    return "".join(page.read_text(encoding="utf-8") for page in pages)


@pytest.mark.proof
def test_every_log_command_runs_and_every_other_is_understood(
    page: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    parser = argparse.ArgumentParser()
    machine.add_arguments(parser)
    written = served = 0
    for line in re.findall(r"^\$ thermaxis machine (.*)$", page, re.MULTILINE):
        arguments = parser.parse_args(shlex.split(line))
        if arguments.log is None:
            machine._check_options(arguments)
            [parse_fault(text, FAULTY) for text in arguments.fault]
            served += 1
            continue
        arguments.log = min(arguments.log, 7200.0)  # two hours of what may be a year
        assert machine.run(arguments) == 0
        assert arguments.output.stat().st_size > 5_000
        written += 1
    assert (written, served) == (6, 2)


def test_every_kind_of_fault_stands_in_the_table_and_its_sentence_is_one(page: str) -> None:
    sentences = re.findall(r"^\| `([a-z]+ [^`]*)` \|", page, re.MULTILINE)
    assert {parse_fault(text, FAULTY).kind for text in sentences} == set(FaultKind)


def test_every_scenario_and_every_kind_of_node_is_named(page: str) -> None:
    for name in SCENARIOS:
        assert f"`{name}`" in page
    for name in SIGNALS:
        shown = f"`{name}`" in page or re.search(r"_D\d+_(true|uncorrected)_um", name)
        assert shown, name
