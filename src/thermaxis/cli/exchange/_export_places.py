"""Where the user stated what an error of an export concerns: an option, or a key of a file."""

import argparse

from thermaxis.codes import Place

_OF_MODEL = {
    "outputs",
    "parts",
    "sections",
    "channels",
    "input_filter_s",
    "longest_gap_s",
    "longest_hold_s",
}
_OF_OUTPUT = {"largest_um", "total_um", "largest_trim_um", "largest_rate_um_per_s", "deadband_um"}
_OF_INPUT = {"lowest_c", "highest_c", "step_k", "largest_rate_k_per_s", "frozen_s"}
_OPTIONS = {
    "cycle_s": "--cycle-s",
    "largest_um": "--limit",
    "largest_rate_um_per_s": "--rate",
    "lowest_c": "--plausible",
    "highest_c": "--plausible",
    "lowest_c, highest_c": "--plausible",
    "frozen_s": "--frozen-s",
    "moves_with": "--moves-with",
    "rests_k": "--moves-with",
    "sensors": "--moves-with",
    "slope": "--limit, --at",
}
_OF_MACHINE = {
    "supervisor": "supervisor",
    "margin_k": "validity.margin_k",
    "sensors": "input",
    "limits": "output",
    "slope": "output.largest_um, --at",
}


def typed_place(place: Place, arguments: argparse.Namespace) -> Place:
    """Return the place of an error as the command line and its files have it."""
    key, channel = place.key, place.channel
    models = ", ".join(map(str, arguments.models))
    if place.file or key.startswith("--"):
        return place
    if key == "name":
        return Place(key="--name") if arguments.name is not None else Place(models)
    if key in _OF_MODEL:
        return Place(models, key=key, channel=channel)
    named = channel and (key in _OF_INPUT or not arguments.at)  # a line names outputs of its own
    table = f".{channel}" if named else ""
    of_machine = _OF_MACHINE | {k: f"output{table}.{k}" for k in _OF_OUTPUT}
    of_machine |= {k: f"input{table}.{k}" for k in _OF_INPUT}
    if key in of_machine and arguments.machine is not None:
        return Place(str(arguments.machine), key=of_machine[key])
    stated = key in _OPTIONS or key in of_machine
    return Place("" if stated else models, key=_OPTIONS.get(key, key), channel=channel)
