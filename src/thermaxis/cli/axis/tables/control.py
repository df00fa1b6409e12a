"""Names on the command line that lead to a control: its own, and that of an axis on it."""

import argparse
import re

from thermaxis.cli._arguments import adder
from thermaxis.controls import control_names
from thermaxis.errors import ConfigurationError

_AXIS_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]{0,15}")


def add_control(parser: argparse.ArgumentParser) -> None:
    """Declare the control and its options."""
    parser.epilog = f"controls: {', '.join(control_names())}"
    add = adder(parser)
    add("--control CONTROL", "the control, one of those below", required=True)
    add(
        "--set NAME=VALUE",
        "an option that only this control has; may be given more than once; an unknown NAME"
        " lists them all, a NAME alone says what it means",
        many=True,
    )


def is_axis_name(text: str) -> bool:
    """Return whether a text may name an axis: a letter and up to 15 letters, digits or ``_``."""
    return _AXIS_NAME.fullmatch(text) is not None


def axis_name(text: str) -> str:
    """Return a stated name of an axis."""
    if not is_axis_name(text):
        raise ConfigurationError("not_an_axis_name", key="--axis", name=text)
    return text
