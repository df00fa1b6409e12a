"""Machine controls: NC programs of test plans and compensation tables, one file per control."""

from functools import cache
from importlib import import_module
from importlib.resources import files

from thermaxis.controls._control import (
    LARGEST_TABLE_BYTES,
    Control,
    ControlOption,
    GridRule,
    ProgramRequest,
    ReadTable,
    TableRequest,
    TableText,
    check_options,
    check_points,
    check_size,
    comment_text,
)
from thermaxis.errors import ConfigurationError, printable

__all__ = [
    "LARGEST_TABLE_BYTES",
    "Control",
    "ControlOption",
    "GridRule",
    "ProgramRequest",
    "ReadTable",
    "TableRequest",
    "TableText",
    "check_options",
    "check_points",
    "check_size",
    "comment_text",
    "control_by_name",
    "control_names",
]


@cache
def control_names() -> tuple[str, ...]:
    """Return the names of all controls: the public modules of this package."""
    modules = (entry.name for entry in files(__name__).iterdir())
    return tuple(
        sorted(
            name.removesuffix(".py").replace("_", "-")
            for name in modules
            if name.endswith(".py") and not name.startswith("_")
        )
    )


def control_by_name(name: str) -> Control:
    """Return a control."""
    if name not in control_names():
        raise ConfigurationError(
            f"there is no control '{printable(name, 40)}'",
            where="--control",
            remedy=f"Write one of {', '.join(control_names())}",
        )
    control = import_module(f"{__name__}.{name.replace('-', '_')}").CONTROL
    if not isinstance(control, Control):
        raise TypeError(f"{control!r} is no Control")
    return control
