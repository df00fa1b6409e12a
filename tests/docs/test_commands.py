"""Every command and every option is described, and nothing is described that does not exist."""

import argparse
import re
from pathlib import Path

import pytest

from thermaxis.cli import COMMANDS, build_parser


@pytest.fixture(scope="module")
def parsers() -> dict[str, argparse.ArgumentParser]:
    found = [
        action
        for action in build_parser()._actions
        if isinstance(action, argparse._SubParsersAction)
    ]
    return dict(found[0].choices)


def options_of(parser: argparse.ArgumentParser) -> list[argparse.Action]:
    return [a for a in parser._actions if a.option_strings and "--help" not in a.option_strings]


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_is_in_the_documentation_and_in_the_readme(
    root: Path, documentation: str, section_of: dict[str, str], command: str
) -> None:
    words = f"thermaxis {command}"
    assert words in documentation
    assert words in (root / "README.md").read_text(encoding="utf-8")
    assert words in section_of


@pytest.mark.parametrize("command", COMMANDS)
def test_every_option_is_described_with_its_command(
    parsers: dict[str, argparse.ArgumentParser], section_of: dict[str, str], command: str
) -> None:
    section = section_of[f"thermaxis {command}"]
    rows = [line for line in section.splitlines() if line.startswith("| `-")]
    for action in options_of(parsers[command]):
        named = [re.compile(rf"`{name}[ `]") for name in action.option_strings]
        mine = [row for row in rows if all(name.search(row) for name in named)]
        assert len(mine) == 1, f"{action.option_strings} has {len(mine)} rows of its own"
        for choice in action.choices or ():
            assert f"`{choice}`" in mine[0]
        if action.metavar is not None:
            assert str(action.metavar).replace("|", r"\|") in mine[0]


@pytest.mark.parametrize("command", COMMANDS)
def test_no_option_is_described_that_the_command_does_not_have(
    parsers: dict[str, argparse.ArgumentParser], section_of: dict[str, str], command: str
) -> None:
    section = section_of[f"thermaxis {command}"]
    known = {name for action in options_of(parsers[command]) for name in action.option_strings}
    first_cells = [line.split("|")[1] for line in section.splitlines() if line.startswith("| `-")]
    described = {name for cell in first_cells for name in re.findall(r"`(--?[a-z][a-z-]*)", cell)}
    assert described == known


@pytest.mark.parametrize("command", COMMANDS)
def test_every_option_has_a_help_text(
    parsers: dict[str, argparse.ArgumentParser], command: str
) -> None:
    for action in parsers[command]._actions:
        assert action.help, f"{command} {action.option_strings or action.dest}"


def test_the_options_of_the_program_are_described(root: Path) -> None:
    page = (root / "docs" / "commands.md").read_text(encoding="utf-8")
    for action in build_parser(only="")._actions:
        for name in action.option_strings:
            assert f"`{name}`" in page
