"""Inputs of a model: a channel of a log, or the difference of two."""

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from typing import final

import numpy as np

from thermaxis.codes import Message, Place
from thermaxis.errors import ConfigurationError, DataError, require_unique
from thermaxis.thermal._arrays import FloatArray
from thermaxis.thermal.log._thermal_log import ThermalLog

_TEMPERATURES = {"degC", "K"}


@final
@dataclass(frozen=True, slots=True)
class InputDefinition:
    """What an input is made of."""

    name: str
    """Name of the input, in models and reports."""
    plus: str
    """Channel that counts as it is."""
    minus: str | None = None
    """Channel that is subtracted, None if there is none."""

    @property
    def channels(self) -> tuple[str, ...]:
        """The channels that it needs."""
        return (self.plus,) if self.minus is None else (self.plus, self.minus)

    @property
    def expression(self) -> str:
        """The right side of the definition, as it is written."""
        return self.plus if self.minus is None else f"{self.plus}-{self.minus}"


def parse_input(text: str, *, channels: Collection[str] = ()) -> InputDefinition:
    """Read the definition of an input.

    Parameters
    ----------
    text : str
        `name=channel` or `name=channel-channel`; without a name the expression is the name.
    channels : collection of str
        Channels that are there. They decide where a minus belongs to a name.

    Returns
    -------
    InputDefinition
        Name and channels as written.

    Raises
    ------
    ConfigurationError
        If a name or a channel is missing, more than two channels are written, or an input is the
        difference of a channel with itself.
    """
    left, sign, right = text.partition("=")
    expression = (right if sign else left).strip()
    name = left.strip() if sign else expression
    if not name or not expression:
        raise ConfigurationError("no_input_definition", text=text, key="input")
    plus, minus = _split(text, expression, channels)
    if minus is not None and plus.casefold() == minus.casefold():
        values = {"name": name, "channel": plus}
        raise ConfigurationError.of(Message("error-input_minus_itself", values, Place(key="input")))
    return InputDefinition(name, plus, minus)


def evaluate_input(log: ThermalLog, definition: InputDefinition) -> FloatArray:
    """Return the values of an input in a log.

    Temperatures in K or degC stay as they are, those in °F become degC; the difference of one in
    K and one in degC is taken in degC.

    Returns
    -------
    FloatArray
        Values, (n,); NaN where one of its channels was not measured. [unit of the channels]

    Raises
    ------
    DataError
        If a channel is not in the log, was never measured, or the two have different units.
    """
    plus = log.name_of(definition.plus)
    unit = _common_unit(log, definition)
    values = log.column(plus, unit=unit)
    if definition.minus is not None:
        values = values - log.column(definition.minus, unit=unit)
    if bool(np.isnan(values).all()):
        raise DataError(
            "input_without_value",
            name=definition.name,
            expression=definition.expression,
            file=log.where,
        )
    return values


def start_of_input(
    log: ThermalLog, definition: InputDefinition, reference_s: float | None = None
) -> float:
    """Return the level of an input at the begin of a log: that of its channel, or of both.

    A free run counts from the levels of its channels, and the level of a difference is another.
    """
    unit = _common_unit(log, definition)
    plus, *minus = (
        log.start_of(log.column(c, unit=unit), reference_s) for c in definition.channels
    )
    return plus - sum(minus)


def check_inputs(definitions: Sequence[InputDefinition]) -> None:
    """Refuse inputs of a model of which there is none, or two have the same name."""
    if not definitions:
        raise ConfigurationError("no_input", key="input")
    require_unique("input", [definition.name for definition in definitions])


def _split(text: str, expression: str, channels: Collection[str]) -> tuple[str, str | None]:
    known = {channel.casefold() for channel in channels}
    if expression.casefold() in known:
        return expression, None
    parts = expression.split("-")
    cuts = [
        ("-".join(parts[:k]).strip(), "-".join(parts[k:]).strip()) for k in range(1, len(parts))
    ]
    fitting = [cut for cut in cuts if cut[0].casefold() in known and cut[1].casefold() in known]
    if len(fitting) == 1:
        return fitting[0]
    if not cuts:
        return expression, None
    if len(cuts) > 1 or not all(cuts[0]):
        raise ConfigurationError("ambiguous_difference", text=text, key="input")
    return cuts[0]


def _common_unit(log: ThermalLog, definition: InputDefinition) -> str:
    units = {log.units[log.name_of(channel)] for channel in definition.channels}
    if "degF" in units or units == _TEMPERATURES:
        return "degC"
    stated = units - {""}
    if len(stated) > 1:
        raise DataError(
            "units_differ",
            name=definition.name,
            plus=definition.plus,
            minus=definition.minus,
            units=tuple(sorted(stated)),
            file=log.where,
        )
    return ""
