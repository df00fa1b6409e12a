"""What is read, as a configuration names it, and what its number means."""

import math
import re
from dataclasses import dataclass
from typing import Final, final

from thermaxis.errors import ConfigurationError
from thermaxis.runtime._machine_values import VALUE_UNITS, converted, flag_of
from thermaxis.runtime.opcua import parse_node

HAL: Final = "hal:"
"""Begin of a pin of LinuxCNC's HAL, where a node of a server would stand."""
_PIN = re.compile(r"hal:[A-Za-z0-9_.-]{1,47}")


def check_node(text: str) -> None:
    """Refuse what is neither a node of OPC UA nor a pin of HAL."""
    if not text.startswith(HAL):
        parse_node(text)
    elif _PIN.fullmatch(text) is None:
        raise ConfigurationError("no_hal_pin", text=text)


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class NodeSettings:
    """Where one value comes from."""

    node: str
    """The node, such as ``ns=2;s=T_spindle``, or the pin, such as ``hal:thermo.0.value``."""
    unit: str
    """Unit of the value on the machine after the scale, a key of `VALUE_UNITS`."""
    scale: float = 1.0
    """What the raw number is multiplied by first; 0.1 where a PLC counts tenths. [1]"""
    bit: int | None = None
    """The bit of a whole number that is the truth value, from 0. [1]"""
    on_change: bool = False
    """Whether its time stamp says when it changed, and not when it was measured."""

    def __post_init__(self) -> None:
        """Check what cannot be read."""
        check_node(self.node)
        if self.unit not in VALUE_UNITS:
            raise ConfigurationError(
                "unknown_choice",
                name=self.unit,
                known=tuple(VALUE_UNITS),
                key="unit",
                channel=self.node,
            )
        if not math.isfinite(self.scale) or self.scale == 0.0:
            raise ConfigurationError("scale_unusable", key="scale", channel=self.node)

    def value_of(self, raw: float | bool | None, bits: int) -> tuple[float | None, bool]:  # noqa: FBT001 - what a node holds
        """Return a raw value in its unit, None where it is not finite, and whether its kind fits.

        `bits` are those of its type, 0 where it is no whole number.
        """
        if self.unit == "bool":
            flag = bit_of(raw, self.bit, bits) if self.bit is not None else flag_of(raw)
            return (None if flag is None else float(flag)), flag is not None
        if raw is None or isinstance(raw, bool):
            return None, False
        try:
            number = converted(float(raw) * self.scale, self.unit)
        except OverflowError:
            return None, True
        return (number if math.isfinite(number) else None), True


def bit_of(raw: float | bool | None, bit: int, bits: int) -> bool | None:  # noqa: FBT001 - what a node holds
    """Return a bit of a whole number; None where its type has no such bit."""
    if isinstance(raw, bool) or not isinstance(raw, int) or bit >= bits:
        return None
    return bool(raw >> bit & 1)
