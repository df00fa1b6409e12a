"""What a log may be meant for: a first guess from names and units, which a person changes."""

import re
from typing import Final

import numpy as np

from thermaxis.thermal.log._input import InputDefinition
from thermaxis.thermal.log._quality import LENGTHS, TEMPERATURES
from thermaxis.thermal.log._thermal_log import ThermalLog

LEAST_SHARE: Final = 0.1
"""An input that moves less than this share of the one that moves most is none. [1]"""
_SURROUNDINGS = re.compile(
    r"ambient|room|air|column|bed|frame|umgebung|luft|st(ä|ae)nder|bett|okol|vzduch|stojan|lo(ž|z)e",
    re.IGNORECASE,
)
_PREFIX = re.compile(r"^(t|temp)[_ ](?=.)", re.IGNORECASE)


def quantity_of(unit: str) -> str:
    """Return what is measured in a unit: `displacement`, `temperature` or `other`."""
    if unit in LENGTHS:
        return "displacement"
    return "temperature" if unit in TEMPERATURES else "other"


def suggest_inputs(log: ThermalLog) -> tuple[InputDefinition, ...]:
    """Return inputs with which an identification may begin.

    Temperatures that move, each relative to the part of the machine or the air around it that is
    named as such, if there is one with the same unit.

    Returns
    -------
    tuple of InputDefinition
        In the order of the columns; empty where no temperature moves.
    """
    measured = [
        name
        for name, values in log.columns.items()
        if log.units[name] in TEMPERATURES and np.fmax.reduce(values) > np.fmin.reduce(values)
    ]
    about = next((name for name in measured if _SURROUNDINGS.search(name)), None)
    found: dict[str, InputDefinition] = {}
    for name in [name for name in measured if name != about] or measured:
        alike = about is not None and about != name and log.units[about] == log.units[name]
        stem = _PREFIX.sub("", name)
        short = stem.rpartition("_")[0] or stem
        label = name if short in found else short
        found[label] = InputDefinition(label, name, about if alike else None)
    moves = {label: _range_of(log, one) for label, one in found.items()}
    least = LEAST_SHARE * max(moves.values(), default=0.0)
    return tuple(found[label] for label, span in moves.items() if span >= least)


def _range_of(log: ThermalLog, definition: InputDefinition) -> float:
    values = log.columns[definition.plus]
    if definition.minus is not None:
        beside = values - log.columns[definition.minus]
        if not np.all(np.isnan(beside)):  # two recorders may share no row
            values = beside
    return float(np.fmax.reduce(values) - np.fmin.reduce(values))
