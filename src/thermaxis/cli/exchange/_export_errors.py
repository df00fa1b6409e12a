"""Errors of an export in the words of whoever typed the command: options, files and their keys."""

import argparse
import re
from typing import NamedTuple

from thermaxis.errors import ConfigurationError


class _Place(NamedTuple):
    """A place in the words of the export, and in those of the user."""

    where: str
    """Pattern of the whole place."""
    stated: str
    """What it is where limits and rules were stated; ``{models}`` and groups are filled in."""
    machine: str = ""
    """What it is where they are those of a machine; as stated where it is empty."""


_PLACES = (
    _Place("cycle_s", "--cycle-s"),
    _Place("name", "{name}"),
    _Place(
        r"(outputs|parts|sections|channels|longest_\w+_s|input_filter_s|(output|part|channel) .+)",
        "{models}, {0}",
    ),
    _Place("largest_um", "--limit"),
    _Place("largest_rate_um_per_s", "--rate"),
    _Place("lowest_c, highest_c", "--plausible"),
    _Place("rate of (.+)", "--rate of {0}", "{machine}, [output.{0}], largest_rate_um_per_s"),
    _Place("frozen_s of (.+)", "frozen_s of {0}", "{machine}, [input.{0}], frozen_s"),
    _Place("supervisor", "supervisor", "{machine}, [supervisor]"),
    _Place("slope", "--limit, --at", "{machine}, largest_um, and --at"),
    _Place("(sensors|limits)", "{0}", "{machine}"),
    # Constants that only the building of the block computes: block, name, and what it is.
    _Place(r"tx_\w+, (margin_k): .*", "{models}, {0}", "{machine}, [validity], margin_k"),
    _Place(
        r"tx_\w+, deadband[0-9]+_um: (.+): .*",
        "deadband_um of {0}",
        "{machine}, [output.{0}], deadband_um",
    ),
    _Place(r"tx_\w+, \w+: (.+)", "{models}, {0}", "{machine}, {0}"),
)


def as_typed(error: ConfigurationError, arguments: argparse.Namespace) -> ConfigurationError:
    """Return an error of an export in the words of whoever typed the command."""
    models = ", ".join(map(str, arguments.models))
    names = {
        "models": models,
        "name": models if arguments.name is None else "--name",
        "machine": str(arguments.machine),
    }
    for place in _PLACES:
        found = re.fullmatch(place.where, error.where)
        if found is not None:
            stated = arguments.machine is None or not place.machine
            form = place.stated if stated else place.machine
            if arguments.at:  # outputs of a line have names of the export's own
                form = form.replace("[output.{0}]", "[output]")
            where = form.format(*found.groups(), **names)
            return ConfigurationError(error.what, where=where, remedy=_remedy(error, arguments))
    return error


def _remedy(error: ConfigurationError, arguments: argparse.Namespace) -> str:
    if error.where == "name":
        return "Write --name NAME, such as that of its axis"
    if error.where == "sensors" and arguments.machine is not None:
        return (
            "Give it a table [input.CHANNEL] for each, or leave --machine out and state everything"
        )
    if error.remedy:
        return _in_options(error.remedy, arguments)
    return {
        "cycle_s": "Write --cycle-s with 0.1 to 60 seconds",
        "largest_um": "Write --limit OUTPUT=UM, such as --limit 100",
        "largest_rate_um_per_s": "Write --rate OUTPUT=UM_PER_S, such as --rate 0.5",
        "lowest_c, highest_c": "Write --plausible CHANNEL=LOW:HIGH, such as --plausible 5:80",
    }.get(error.where, "")


def _in_options(remedy: str, arguments: argparse.Namespace) -> str:
    """Return a remedy in which settings of the block are options, or keys of the machine."""
    stated = arguments.machine is None
    for setting, named in (
        (r"\bLREAL\b", f"{'--cpu s7-1500 ' * (arguments.cpu == 's7-300')}--real 64"),
        (r"\b(longer|shorter) cycle\b", r"\1 --cycle-s"),
        (r"\ba cycle of\b", "a --cycle-s of"),
        (r"\bhigher rate\b", f"higher {'--rate' if stated else 'largest_rate_um_per_s'}"),
        (r"\bsmaller total\b", f"smaller {'--limit' if stated else 'total_um'}"),
        (r"\bnarrower limits\b", f"a smaller {'--limit' if stated else 'largest_um'}"),
        ("^Choose a multiple", "Write --cycle-s with a multiple"),
    ):
        remedy = re.sub(setting, named, remedy)
    return remedy
