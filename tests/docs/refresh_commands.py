"""Write the commands, their usage and their options into docs/commands.md.

``python tests/docs/refresh_commands.py`` after a change of an option; what stands between the
tables is written by hand.
"""

import argparse
import re
from collections.abc import Iterator
from pathlib import Path

from thermaxis.cli import GROUPS, TITLES, build_parser

PAGE = Path(__file__).resolve().parents[2] / "docs" / "commands.md"
TABLE = re.compile(r"^\| option \|.*?(?=^(?!\|))", re.DOTALL | re.MULTILINE)
USAGE = re.compile(r"^```\nthermaxis .*?^```$", re.DOTALL | re.MULTILINE)
INDEX = re.compile(r"^\| [^|]+ \| what it does \|.*?(?=^\| option of)", re.DOTALL | re.MULTILINE)
JSON = {"evaluate": "json.md"} | {
    name: f"json.md#{name}"
    for name in re.findall(
        r"^## `([\w-]+)`$", PAGE.with_name("json.md").read_text(encoding="utf-8"), re.MULTILINE
    )
}


def actions_of(parser: argparse.ArgumentParser) -> dict[str, argparse.ArgumentParser]:
    found = [a for a in parser._actions if isinstance(a, argparse._SubParsersAction)]
    return dict(found[0].choices) if found else {}


def parsers() -> dict[str, argparse.ArgumentParser]:
    """Return the parser of every command and of every action, by its words."""
    commands = actions_of(build_parser())
    return commands | {
        f"{command} {action}": parser
        for command, its in commands.items()
        for action, parser in actions_of(its).items()
    }


def options_of(parser: argparse.ArgumentParser) -> list[argparse.Action]:
    return [a for a in parser._actions if a.option_strings and "--help" not in a.option_strings]


def written(text: str) -> str:
    return text.replace("|", r"\|").replace("%%", "%")


def value_of(option: argparse.Action) -> str:
    if option.nargs == 0:
        return ""
    return f" {option.metavar or '|'.join(map(str, option.choices or ()))}"


def table_of(words: str, parser: argparse.ArgumentParser) -> str:
    lines = ["| option | meaning |", "|---|---|"]
    keys = JSON.get(words.replace(" ", "-"), JSON.get(words.rsplit(" ", maxsplit=1)[-1]))
    for option in options_of(parser):
        *short, name = option.option_strings
        names = [*(f"`{one}`" for one in short), f"`{written(name + value_of(option))}`"]
        needed = "; required" if option.required else ""
        link = f" ([keys]({keys}))" if name == "--json" and keys else ""
        lines.append(f"| {', '.join(names)} | {written(option.help or '')}{needed}{link} |")
    return "\n".join(lines) + "\n"


def usage_of(words: str, parser: argparse.ArgumentParser) -> Iterator[str]:
    actions = actions_of(parser)
    for action, its in actions.items():
        yield from usage_of(f"{words} {action}", its)
    if actions:
        return
    options = options_of(parser)
    said = [words]
    for one in parser._actions:
        if not one.option_strings:
            name = str(one.metavar or "|".join(map(str, one.choices or ())))
            said.append(f"{name}..." if one.nargs == "+" else name)
    said += [f"{o.option_strings[0]}{value_of(o)}" for o in options if o.required]
    yield " ".join([*said, *(["[options]"] if any(not o.required for o in options) else [])])


def index() -> str:
    blocks: list[str] = []
    for group, commands in GROUPS.items():
        blocks.append(f"| {TITLES[group]} | what it does |\n|---|---|")
        blocks[-1] += "".join(
            f"\n| [`thermaxis {name}`](#thermaxis-{name}) | {summary} |"
            for name, summary in commands.items()
        )
    return "\n\n".join(blocks) + "\n\n"


def section(words: str, parser: argparse.ArgumentParser, text: str) -> str:
    usage = "\n".join(usage_of(f"thermaxis {words}", parser))
    text = USAGE.sub(lambda _: f"```\n{usage}\n```", text, count=1)
    return TABLE.sub(lambda _: table_of(words, parser), text, count=1)


def refreshed(page: str) -> str:
    """Return the page with the commands and options of today."""
    head, *rest = re.split(r"^(?=##)", page, flags=re.MULTILINE)
    known, parts = parsers(), [INDEX.sub(lambda _: index(), head)]
    for part in rest:
        words = part.splitlines()[0].strip("# `").removeprefix("thermaxis ")
        parts.append(section(words, known[words], part) if words in known else part)
    return "".join(parts)


if __name__ == "__main__":
    PAGE.write_text(refreshed(PAGE.read_text(encoding="utf-8")), encoding="utf-8")
