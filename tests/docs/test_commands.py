"""Every command and every option is described, and nothing is described that does not exist."""

import argparse
import re
from pathlib import Path

from thermaxis.cli import COMMANDS, build_parser


def subparsers_of(parser: argparse.ArgumentParser) -> dict[str, argparse.ArgumentParser]:
    found = [a for a in parser._actions if isinstance(a, argparse._SubParsersAction)]
    return dict(found[0].choices) if found else {}


def parsers_of(parser: argparse.ArgumentParser) -> dict[str, argparse.ArgumentParser]:
    """Return the parsers that take options, by their words: ``evaluate``, ``history export``."""
    found: dict[str, argparse.ArgumentParser] = {}
    for command, its in subparsers_of(parser).items():
        actions = subparsers_of(its)
        found |= {f"{command} {word}": action for word, action in actions.items()}
        if not actions:
            found[command] = its
    return found


PARSERS = parsers_of(build_parser())


def section_for(words: str, section_of: dict[str, str]) -> str:
    """Return the text on a command, or on one of its actions if it has some."""
    command, _, action = words.partition(" ")
    text = section_of[f"thermaxis {command}"]
    if not action:
        return text
    parts = re.split(r"^### (.*)$", text, flags=re.MULTILINE)
    actions = dict(zip(parts[1::2], parts[2::2], strict=True))
    return actions.get(f"`thermaxis {words}`", "")


def options_of(parser: argparse.ArgumentParser) -> list[argparse.Action]:
    return [a for a in parser._actions if a.option_strings and "--help" not in a.option_strings]


def test_every_command_is_in_the_documentation_and_in_the_readme(
    root: Path, documentation: str, section_of: dict[str, str]
) -> None:
    readme = (root / "README.md").read_text(encoding="utf-8")
    for words in (f"thermaxis {command}" for command in COMMANDS):
        assert words in documentation
        assert words in readme
        assert words in section_of


def test_every_option_is_described_with_its_command(section_of: dict[str, str]) -> None:
    for words, parser in PARSERS.items():
        section = section_for(words, section_of)
        rows = [line for line in section.splitlines() if line.startswith("| `-")]
        for action in options_of(parser):
            named = [re.compile(rf"`{name}[ `]") for name in action.option_strings]
            mine = [row for row in rows if all(name.search(row) for name in named)]
            assert len(mine) == 1, f"{words} {action.option_strings} has {len(mine)} rows"
            shown = [f"`{choice}`" for choice in action.choices or ()]
            shown += [] if action.metavar is None else [str(action.metavar).replace("|", r"\|")]
            assert [word for word in shown if word not in mine[0]] == [], words


def test_nothing_is_described_that_a_command_does_not_have(section_of: dict[str, str]) -> None:
    for words, parser in PARSERS.items():
        rows = [r for r in section_for(words, section_of).splitlines() if r.startswith("| `-")]
        cells = [row.split("|")[1] for row in rows]
        described = {name for cell in cells for name in re.findall(r"`(--?[a-z][a-z-]*)", cell)}
        assert described == {n for a in options_of(parser) for n in a.option_strings}, words


def test_every_option_has_a_help_text_and_every_action_stands_in_the_usage(
    section_of: dict[str, str],
) -> None:
    for words, parser in PARSERS.items():
        assert [a.dest for a in parser._actions if not a.help] == [], words
        command, _, action = words.partition(" ")
        usage = section_of[f"thermaxis {command}"].split("```")[1]
        assert not action or re.search(rf"(?:thermaxis {command} |\|){action}\b", usage), words


def test_the_options_of_the_program_are_described(root: Path) -> None:
    page = (root / "docs" / "commands.md").read_text(encoding="utf-8")
    for action in build_parser(only="")._actions:
        for name in action.option_strings:
            assert f"`{name}`" in page
