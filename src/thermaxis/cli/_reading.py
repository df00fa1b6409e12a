"""Options that say how the file of a run is read."""

import argparse
from dataclasses import replace
from pathlib import Path
from typing import TypedDict

from thermaxis.cli._arguments import AddsArguments, adder, number
from thermaxis.files import RunMapping, read_run_mapping

ABOUT_TABLES = ("--map", "--decimal", "--date-order", "--units", "--target-tolerance")
"""Options that say something of the table of a run."""


class Reading(TypedDict):
    """What `read_positioning` takes beside the file."""

    fallback_encoding: str
    mapping: RunMapping


def add_reading(to: AddsArguments, what: str = "a run") -> None:
    """Declare the options of how a run is read."""
    add = adder(to)
    add("--encoding NAME", f"of {what} that is not UTF-8 (default: cp1250)", default="cp1250")
    add("--map FILE", "what the columns of the run hold, TOML (default: as headings say)", Path)
    add("--decimal", "decimal sign (default: as the numbers show)", choices=("point", "comma"))
    add(
        "--date-order",
        "what stands first in 03/04/2026 (default: as the dates show)",
        choices=("day", "month", "year"),
    )
    add(
        "--units POSITION,DEVIATION",
        "units of columns that state none, such as mm,um (default: as the file says)",
        _two_units,
    )
    add(
        "--target-tolerance MM",
        "targets that differ by at most this are one target, in mm or degrees (default: none do)",
        number("tolerance in mm or degrees", 0.0, 1e6),
    )


def _two_units(text: str) -> tuple[str, str]:
    position, comma, deviation = text.partition(",")
    if not comma or "," in deviation:
        raise argparse.ArgumentTypeError("two units such as mm,um are expected")
    return position.strip(), deviation.strip()


def reading_of(arguments: argparse.Namespace) -> Reading:
    """Return how the arguments say that a run is read; options go before the mapping file."""
    mapping = RunMapping() if arguments.map is None else read_run_mapping(arguments.map)
    units: tuple[str, str] = arguments.units or ("", "")
    mapping = replace(
        mapping,
        decimal=arguments.decimal or mapping.decimal,
        date_order=arguments.date_order or mapping.date_order,
        position_unit=units[0] or mapping.position_unit,
        deviation_unit=units[1] or mapping.deviation_unit,
        target_tolerance=(
            mapping.target_tolerance
            if arguments.target_tolerance is None
            else arguments.target_tolerance
        ),
    )
    return {"fallback_encoding": arguments.encoding, "mapping": mapping}
