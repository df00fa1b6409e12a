"""Names on the command line that lead to a control: its own, and that of an axis on it."""

import re

from thermaxis.codes import printable
from thermaxis.controls import control_names
from thermaxis.errors import ConfigurationError

_AXIS_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]{0,15}")


def listed_controls() -> str:
    """Return the names of all controls, for a help text; no control is imported for it."""
    return ", ".join(control_names())


def is_axis_name(text: str) -> bool:
    """Return whether a text may name an axis: a letter and up to 15 letters, digits or ``_``."""
    return _AXIS_NAME.fullmatch(text) is not None


def axis_name(text: str) -> str:
    """Return a stated name of an axis."""
    if not is_axis_name(text):
        raise ConfigurationError(
            f"'{printable(text, 40)}' is no name of an axis",
            where="--axis",
            remedy="Write a letter and up to 15 letters, digits or underscores, such as X or AX1",
        )
    return text
