"""What a log may be meant for: a first guess from names and units, which a person changes."""

import re
from typing import Final

import numpy as np

from thermaxis.thermal.log._input import InputDefinition
from thermaxis.thermal.log._quality import LENGTHS, TEMPERATURES
from thermaxis.thermal.log._thermal_log import ThermalLog

LEAST_SHARE: Final = 0.1
"""A temperature that moves less than this share of the one that moves most is no input. [1]"""
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

    Parameters
    ----------
    log : ThermalLog
        The log.

    Returns
    -------
    tuple of InputDefinition
        In the order of the columns; empty where no temperature moves.
    """
    measured = {
        name: values
        for name, values in log.columns.items()
        if log.units[name] in TEMPERATURES and not np.isnan(values).all()
    }
    moves = {name: float(np.nanmax(v) - np.nanmin(v)) for name, v in measured.items()}
    least = LEAST_SHARE * max(moves.values(), default=0.0)
    about = next((name for name in measured if _SURROUNDINGS.search(name)), None)
    moving = [name for name, span in moves.items() if span > 0.0 and span >= least]
    chosen = [name for name in moving if name != about] or moving
    found: dict[str, InputDefinition] = {}
    for name in chosen:
        alike = about is not None and about != name and log.units[about] == log.units[name]
        stem = _PREFIX.sub("", name)
        short = stem.rpartition("_")[0] or stem
        label = name if short in found else short
        found[label] = InputDefinition(label, name, about if alike else None)
    return tuple(found.values())
