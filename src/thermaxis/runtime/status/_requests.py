"""What a client of the status server may ask: methods, their arguments, and who may call them."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import final

from thermaxis.compensation import Request, RequestKind
from thermaxis.runtime.status._fields import Kind
from thermaxis.runtime.users import Role


@final
@dataclass(frozen=True, slots=True)
class Argument:
    """One argument of a method."""

    name: str
    """Its name, with its unit."""
    kind: Kind
    """A number or a text."""
    text: str
    """What it means, with its unit in brackets."""


@final
@dataclass(frozen=True, slots=True)
class Ask:
    """One method."""

    name: str
    """Its name; the last part of its node id."""
    role: Role
    """Role that a caller has at least."""
    text: str
    """What it asks for."""
    request: Callable[[str, Sequence[float | str]], Request] = field(repr=False)
    """The request, from the caller's name and the arguments."""
    arguments: tuple[Argument, ...] = ()
    """Its arguments."""


def _plain(kind: RequestKind) -> Callable[[str, Sequence[float | str]], Request]:
    return lambda who, _values: Request(kind, who)


def _trim(who: str, values: Sequence[float | str]) -> Request:
    output, value_um, duration_s = values
    return Request(
        RequestKind.TRIM,
        who,
        output=str(output),
        value=float(value_um),
        duration_s=float(duration_s),
    )


def _diameter(who: str, values: Sequence[float | str]) -> Request:
    return Request(RequestKind.DIAMETER, who, value=float(values[0]))


def _model(who: str, values: Sequence[float | str]) -> Request:
    return Request(RequestKind.MODEL, who, text=str(values[0]))


_OPERATOR = Role.OPERATOR
ASKS = (
    Ask(
        "Enable",
        _OPERATOR,
        "Compensate as soon as everything that it needs is there.",
        _plain(RequestKind.ENABLE),
    ),
    Ask(
        "Disable",
        _OPERATOR,
        "Fade the correction out and stay off.",
        _plain(RequestKind.DISABLE),
    ),
    Ask("Hold", _OPERATOR, "Keep the correction as it is.", _plain(RequestKind.HOLD)),
    Ask("Resume", _OPERATOR, "End a hold.", _plain(RequestKind.RESUME)),
    Ask(
        "Acknowledge",
        _OPERATOR,
        "Say that a fault was seen and its cause removed.",
        _plain(RequestKind.ACKNOWLEDGE),
    ),
    Ask(
        "Trim",
        _OPERATOR,
        "Add a bounded amount to one output until it expires; 0 ends a trim.",
        _trim,
        (
            Argument("output", Kind.TEXT, "Name of the output."),
            Argument("value_um", Kind.NUMBER, "The amount. [µm]"),
            Argument("duration_s", Kind.NUMBER, "Time until it expires. [s]"),
        ),
    ),
    Ask(
        "Diameter",
        _OPERATOR,
        "State the clamping diameter of the workpiece.",
        _diameter,
        (Argument("diameter_mm", Kind.NUMBER, "Clamping diameter. [mm]"),),
    ),
    Ask(
        "NoDiameter",
        _OPERATOR,
        "State that the tool centre point counts, not a diameter.",
        _plain(RequestKind.DIAMETER),
    ),
    Ask(
        "ChooseModel",
        Role.ENGINEER,
        "Take another model of the configured folder.",
        _model,
        (Argument("file", Kind.TEXT, "Its file name, without a folder."),),
    ),
)
"""Every method that asks for something, in the order in which they are shown."""
