"""Values of a machine that is an OPC UA server."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import final

from asyncua import ua

from thermaxis.codes import Message, Place
from thermaxis.errors import ConfigurationError
from thermaxis.runtime._machine_values import VALUE_UNITS, converted, flag_of
from thermaxis.runtime._ports import NOT_READ, Source, SourceSample
from thermaxis.runtime.opcua import WRONG_TYPE, OpcUaSession, parse_node, plain_number


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class NodeSettings:
    """Where one value comes from."""

    node: str
    """The node, such as ``ns=2;s=T_spindle``."""
    unit: str
    """Unit of the value on the machine after the scale, a key of `VALUE_UNITS`."""
    scale: float = 1.0
    """What the raw number is multiplied by first; 0.1 where a PLC counts tenths. [1]"""

    def __post_init__(self) -> None:
        """Check what cannot be read."""
        parse_node(self.node)
        if self.unit not in VALUE_UNITS:
            raise ConfigurationError(
                "unknown_choice",
                name=self.unit,
                known=tuple(VALUE_UNITS),
                place=Place(key="unit", channel=self.node),
            )
        if not math.isfinite(self.scale) or self.scale == 0.0:
            raise ConfigurationError("scale_unusable", place=Place(key="scale", channel=self.node))


@final
class OpcUaSource(Source):
    """Reads all values with one request per cycle, each with its status and its age.

    Notes
    -----
    A value whose status is bad is not passed on: servers send 0.0 with it. An uncertain one is
    passed on, marked as not good. A text, an array and a truth value where a number is expected
    have no value and the status ``BadTypeMismatch``, and so has a number other than 0 and 1 where
    a truth value is expected.

    Not protected: a server that stamps an old value as new is believed.
    """

    def __init__(self, session: OpcUaSession, nodes: Mapping[str, NodeSettings]) -> None:
        self.session = session
        self._nodes = dict(nodes)
        self._ids = tuple(settings.node for settings in self._nodes.values())
        self._lost = dict.fromkeys(self._nodes, NOT_READ)
        self._reached = False

    async def open(self) -> None:
        """Begin to connect."""
        await self.session.open()

    async def read(self, deadline_s: float) -> Mapping[str, SourceSample]:
        """Read every value by its name."""
        found = await self.session.read(self._ids, deadline_s)
        self._reached = found is not None
        if found is None:
            return self._lost
        return {
            name: self._sample(settings, value)
            for (name, settings), value in zip(self._nodes.items(), found, strict=True)
        }

    @property
    def connected(self) -> bool:
        """Whether the last read reached the server."""
        return self._reached and self.session.connected

    @property
    def failure(self) -> Message | None:
        """Why the server is not reached."""
        return None if self.connected else self.session.failure

    async def close(self) -> None:
        """End the connection, unless a sink still uses it."""
        self._reached = False
        await self.session.close()

    def _sample(self, settings: NodeSettings, value: ua.DataValue) -> SourceSample:
        code = value.StatusCode
        status = "Good" if code is None or not code.value else code.name
        good = code is None or code.is_good()
        age_s = self.session.age_s(value)
        stamp = None if age_s is None else value.SourceTimestamp
        if code is not None and code.is_bad():
            return SourceSample(None, good=False, status=status, age_s=age_s, source_time=stamp)
        number, fits = _number_in(value, settings)
        if not fits:
            return SourceSample(None, good=False, status=WRONG_TYPE, age_s=age_s, source_time=stamp)
        return SourceSample(number, good=good, status=status, age_s=age_s, source_time=stamp)


def _number_in(value: ua.DataValue, settings: NodeSettings) -> tuple[float | None, bool]:
    """Return the value in its unit, None where it is not finite, and whether its type fits."""
    raw = plain_number(value)
    if raw is None:
        return None, False
    if settings.unit == "bool":
        flag = flag_of(raw)
        return (None if flag is None else float(flag)), flag is not None
    if isinstance(raw, bool):
        return None, False
    try:
        number = converted(float(raw) * settings.scale, settings.unit)
    except OverflowError:
        return None, True
    return (number if math.isfinite(number) else None), True
