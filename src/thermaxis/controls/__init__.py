"""Machine controls: NC programs of test plans and compensation tables, one file per control."""

import re
from collections.abc import Mapping
from functools import cache
from importlib import import_module
from importlib.resources import files

from thermaxis.controls._control import (
    LARGEST_TABLE_BYTES,
    TRAVEL_UNSTATED,
    Control,
    ControlOption,
    GridRule,
    HeatingRequest,
    HeatingWords,
    ProgramRequest,
    ReadTable,
    TableRequest,
    TableText,
    TouchRequest,
    advice,
    check_options,
    check_points,
    check_size,
    comment_text,
    finding,
)
from thermaxis.errors import require_known

__all__ = [
    "LARGEST_TABLE_BYTES",
    "TRAVEL_UNSTATED",
    "Control",
    "ControlOption",
    "GridRule",
    "HeatingRequest",
    "HeatingWords",
    "ProgramRequest",
    "ReadTable",
    "TableRequest",
    "TableText",
    "TouchRequest",
    "advice",
    "check_options",
    "check_points",
    "check_size",
    "comment_text",
    "control_by_name",
    "control_names",
    "finding",
]


@cache
def _modules() -> Mapping[str, str]:
    """Return the module of every control by its name, as the folder of this package has them."""
    found: dict[str, str] = {}
    for entry in files(__name__).iterdir():
        names = [entry.name.removesuffix(".py")] if entry.name.endswith(".py") else []
        if entry.is_dir():
            inner = sorted(e.name for e in entry.iterdir() if e.name.endswith(".py"))
            own = [n.removesuffix(".py") for n in inner if not n.startswith("_")]
            names = [f"{entry.name}.{n}" for n in own] or [entry.name]
        for name in names:
            if not name.startswith("_"):
                found[re.sub("[._]", "-", name)] = name
    return found


def control_names() -> tuple[str, ...]:
    """Return the names of all controls, sorted; none of them is imported.

    Returns
    -------
    tuple of str
        Public modules of this package, and of the folder of a maker; a folder without public
        modules is one control.
    """
    return tuple(sorted(_modules()))


def control_by_name(name: str) -> Control:
    """Return a control."""
    require_known("--control", [name], control_names(), "unknown_choice")
    control = import_module(f"{__name__}.{_modules()[name]}").CONTROL
    if not isinstance(control, Control):
        raise TypeError(f"{control!r} is no Control")
    return control
