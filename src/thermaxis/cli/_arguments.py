"""Arguments of commands, declared as their usage reads, and kinds that several commands take."""

import argparse
import re
from collections.abc import Callable
from datetime import date
from pathlib import Path
from typing import Any, Protocol, TypeAlias

from thermaxis.errors import ConfigurationError

UNITS_S = {"s": 1.0, "min": 60.0, "h": 3600.0, "d": 86400.0}
"""Units in which a time may be written. [s]"""
TIME = re.compile(r"(?P<number>-?\d+(?:\.\d*)?|-?\.\d+)?(?P<unit>s|min|h|d)?")
"""A time, or a bare number."""

Kind: TypeAlias = Callable[[str], object]


class AddsArguments(Protocol):
    """A parser, or a group of one."""

    def add_argument(self, *names: str, **options: Any) -> argparse.Action:
        """Declare one argument."""
        ...


def adder(to: AddsArguments) -> Callable[..., None]:
    """Return what declares arguments: ``add("-o, --output FILE", "the table", Path)``.

    An option without a value is a flag; one of which there are `many` is a list.
    """

    def add(usage: str, text: str, kind: Kind = str, *, many: bool = False, **more: object) -> None:
        words = usage.split(" ")
        count = max(1, sum(word.startswith("-") for word in words))
        if "type" in more:
            raise TypeError("the kind of a value is the third argument")
        names, metavar = [word.rstrip(",") for word in words[:count]], " ".join(words[count:])
        if kind is bool:
            more["action"] = "store_true"
        else:
            more["type"] = kind
        if metavar:
            more["metavar"] = metavar
        if many:
            more |= {"action": "append", "default": []}
        to.add_argument(*names, help=text, **more)

    return add


# ---- options of several commands ----------------------------------------------------------------


def add_json(to: AddsArguments) -> None:
    """Declare ``--json``."""
    adder(to)("--json FILE|-", "write the result as JSON; - for standard output alone")


def add_report(to: AddsArguments, what: str = "report", formats: str = ".pdf or .html") -> None:
    """Declare ``--report``."""
    text = f"write the {what}, {formats}; may be given more than once"
    adder(to)("--report FILE", text, Path, many=True)


def add_figures(to: AddsArguments, what: str = "the charts as PNG and SVG, and CSV") -> None:
    """Declare ``--figures``."""
    adder(to)("--figures DIR", f"write {what}", Path)


def add_mapping(to: AddsArguments) -> None:
    """Declare ``--mapping``."""
    text = "names, units and factors of the columns (TOML); default: the ends of their names"
    adder(to)("--mapping FILE", text, Path)


# ---- kinds of values ----------------------------------------------------------------------------


def number(what: str, least: float, most: float) -> Callable[[str], float]:
    """Return the kind of a number from `least` to `most`; `what` completes "is no ..."."""

    def kind(text: str) -> float:
        try:
            value = float(text)
        except ValueError:
            value = float("nan")
        if not least <= value <= most:
            raise argparse.ArgumentTypeError(f"'{text}' is no {what}")
        return value

    return kind


def count(what: str, least: int) -> Callable[[str], int]:
    """Return the kind of a whole number from `least` up, of at most seven digits."""

    def kind(text: str) -> int:
        digits = text.isdecimal() and text.isascii() and len(text) <= 7
        if not digits or int(text) < least:
            raise argparse.ArgumentTypeError(f"'{text}' is no {what} from {least} on")
        return int(text)

    return kind


hours = number("number of hours from 0 on", 0.0, 1e6)
position = number("position in mm or degrees", -1e6, 1e6)
diameter = number("diameter in mm, such as 1500", 0.0, 1e6)


def day(text: str) -> str:
    """Return a date as it is written on the command line."""
    try:
        return date.fromisoformat(text).isoformat()
    except ValueError:
        raise argparse.ArgumentTypeError("a date such as 2026-03-31 is expected") from None


def positive_seconds(text: str) -> float:
    """Return a time in seconds as it is written on the command line."""
    match = TIME.fullmatch(text.replace(" ", ""))
    number = -1.0 if match is None or match["number"] is None else float(match["number"])
    seconds = number * UNITS_S[(match["unit"] if match else None) or "s"]
    if not 0.0 < seconds <= 1e9:
        raise argparse.ArgumentTypeError(f"'{text}' is no positive time; write 60, 5min, 1h or 2d")
    return seconds


# ---- options that do not go together ------------------------------------------------------------


def _stated(arguments: argparse.Namespace, option: str) -> bool:
    value = getattr(arguments, option.lstrip("-").replace("-", "_"))
    return value is not None and value is not False and value not in ("", [])


def refuse_both(arguments: argparse.Namespace, one: str, other: str) -> None:
    """Refuse two options that exclude each other."""
    if _stated(arguments, one) and _stated(arguments, other):
        raise ConfigurationError("options_exclude", key=one, one=one, other=other)


def refuse_alone(arguments: argparse.Namespace, needed: str, *options: str) -> None:
    """Refuse options that mean something only together with another one."""
    for option in options:
        if _stated(arguments, option) and not _stated(arguments, needed):
            raise ConfigurationError("option_needs", key=option, option=option, needed=needed)


def refuse_foreign(arguments: argparse.Namespace, what: str, *options: str) -> None:
    """Refuse options that belong to something else."""
    for option in options:
        if _stated(arguments, option):
            raise ConfigurationError("option_belongs_to", key=option, what=what)
