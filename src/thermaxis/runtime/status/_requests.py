"""What a client of the status server may ask: methods, their arguments, and who may call them."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple, final

from thermaxis.compensation import Request, RequestKind
from thermaxis.runtime.status._fields import Kind
from thermaxis.runtime.users import Role


class Argument(NamedTuple):
    """One argument of a method."""

    name: str
    """Its name, with its unit."""
    kind: Kind
    """A number or a text."""
    text: str
    """What it means, with its unit in brackets."""
    means: str = ""
    """What it is in a `Request`."""


@final
@dataclass(frozen=True, slots=True)
class Ask:
    """One method."""

    name: str
    """Its name; the last part of its node id."""
    kind: RequestKind
    """What it asks the loop for."""
    text: str
    arguments: tuple[Argument, ...] = ()
    role: Role = Role.OPERATOR
    """Role that a caller has at least."""

    def request(self, who: str, values: Sequence[float | str]) -> Request:
        """Return the request of somebody with these arguments."""
        stated: dict[str, Any] = {
            argument.means: value for argument, value in zip(self.arguments, values, strict=True)
        }
        return Request(self.kind, who, **stated)


_K, _Number, _Text = RequestKind, Kind.NUMBER, Kind.TEXT
_TRIM = (
    Argument("output", _Text, "Name of the output.", "output"),
    Argument("value_um", _Number, "The amount. [µm]", "value"),
    Argument("duration_s", _Number, "Time until it expires. [s]", "duration_s"),
)
_TOUCH = (
    Argument("output", _Text, "Name of the output.", "output"),
    Argument("value_um", _Number, "What it showed, positive away from the workpiece. [µm]",
             "value"),
    Argument("age_s", _Number, "Time since it was touched. [s]", "duration_s"),
)  # fmt: skip
_DIAMETER = (Argument("diameter_mm", _Number, "Clamping diameter. [mm]", "value"),)
_FILE = (Argument("file", _Text, "Its file name, without a folder.", "text"),)
ASKS = (
    Ask("Enable", _K.ENABLE, "Compensate as soon as everything that it needs is there."),
    Ask("Disable", _K.DISABLE, "Fade the correction out and stay off."),
    Ask("Hold", _K.HOLD, "Keep the correction as it is."),
    Ask("Resume", _K.RESUME, "End a hold."),
    Ask("Acknowledge", _K.ACKNOWLEDGE, "Say that a fault was seen and its cause removed."),
    Ask("Trim", _K.TRIM, "Add a bounded amount to one output until it expires; 0 ends a trim.",
        _TRIM),
    Ask("Touch", _K.TOUCH, "Take a touch that was read by hand.", _TOUCH),
    Ask("Datum", _K.DATUM,
        "Say that a datum was set, or an axis referenced, anew: touches have taught nothing yet."),
    Ask("Diameter", _K.DIAMETER, "State the clamping diameter of the workpiece.", _DIAMETER),
    Ask("NoDiameter", _K.DIAMETER, "State that the tool centre point counts, not a diameter."),
    Ask("ChooseModel", _K.MODEL, "Take another model of the configured folder.", _FILE,
        Role.ENGINEER),
)  # fmt: skip
"""Every method that asks for something, in the order in which they are shown."""
