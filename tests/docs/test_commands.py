"""The page of commands is what the program's arguments say."""

import re

from tests.docs.refresh_commands import PAGE, options_of, parsers, refreshed
from thermaxis.cli import COMMANDS, build_parser


def test_the_page_is_what_the_script_makes_of_the_arguments():
    page = PAGE.read_text(encoding="utf-8")
    assert refreshed(page) == page
    for words, parser in parsers().items():
        if options_of(parser) or " " not in words:
            assert f"# `thermaxis {words}`\n" in page


def test_the_readme_names_no_command_that_is_none(root):
    readme = (root / "README.md").read_text(encoding="utf-8")
    named = set(
        re.findall(r"^(?:.*&& )?(?:\.venv/bin/|\$ )?thermaxis ([a-z-]+)", readme, re.MULTILINE)
    )
    assert {"evaluate", "run", "fleet"} < named <= set(COMMANDS)


def test_every_argument_has_a_help_text():
    for words, parser in parsers().items():
        lacking = [a.dest for a in parser._actions if not a.help and a.dest != "action"]
        assert lacking == [], words


def test_the_options_of_the_program_are_described():
    page = PAGE.read_text(encoding="utf-8")
    names = [name for a in build_parser(())._actions for name in a.option_strings]
    assert [name for name in names if f"`{name}`" not in page] == []
