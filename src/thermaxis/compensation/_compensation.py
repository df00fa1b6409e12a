"""What a machine is compensated with: a model, rules of sensors and supervisor, limits."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import final

from thermaxis.compensation._limits import Limits
from thermaxis.compensation._model import CompensationModel
from thermaxis.compensation._sensors import SensorRules
from thermaxis.compensation._supervisor import SupervisorRules
from thermaxis.errors import ConfigurationError

LONGEST_CYCLE_S = 60.0
"""Longest cycle. [s]"""
SHORTEST_CYCLE_S = 0.1
"""Shortest cycle. [s]"""
LONGEST_STEP_CYCLES = 2.0
"""A cycle that comes late moves the correction by no more than the rate allows in so many cycles:
time in which nothing ran is no time in which the machine may be moved. [1]"""
_MOST_INTERLOCKS = 100


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class Compensation:
    """Everything that `cycle` needs besides the reading.

    Not protected: whether a channel is wired to the sensor that the model means, whether the sign
    of an axis is right, and whether the machine obeys: the first two are proven at commissioning,
    the last by reading back.

    Raises
    ------
    ConfigurationError
        If a channel has no rules or an output no limits, if rules or limits belong to nothing, or
        a number is out of its range.
    """

    model: CompensationModel
    """The model."""
    sensors: Mapping[str, SensorRules]
    """Rules by channel of the model."""
    limits: Mapping[str, Limits]
    """Limits by output of the model."""
    supervisor: SupervisorRules = field(default_factory=SupervisorRules)
    """Rules of the supervisor."""
    cycle_s: float = 1.0
    """Nominal time from cycle to cycle, 0.1 to 60. [s]"""
    redundant: frozenset[str] = frozenset()
    """Channels that have a redundant sensor."""
    interlocks: tuple[str, ...] = ()
    """Names of the conditions that must be met: axis referenced, machine on, not homing, no
    emergency stop."""
    validity_margin_k: float = 5.0
    """Outside the range of the training logs a part's output loses its weight; none is left so
    far outside. Default: five kelvin. [K]"""
    lowest_weight: float = 0.0
    """Weight that is left far outside. Default: none. [1]"""
    rules: tuple[SensorRules, ...] = field(init=False, repr=False)
    """Rules in the order of the model's channels."""
    bounds: tuple[Limits, ...] = field(init=False, repr=False)
    """Limits in the order of the model's outputs."""

    def __post_init__(self) -> None:
        """Check the parts against each other and put them in order."""
        channels = self.model.channels
        outputs = tuple(output.name for output in self.model.outputs)
        _match(channels, self.sensors, "sensor rules", "channel")
        _match(outputs, self.limits, "limits", "output")
        for name in self.redundant:
            if name not in channels:
                raise ConfigurationError(f"the model has no channel {name}", where="redundant")
        if not SHORTEST_CYCLE_S <= self.cycle_s <= LONGEST_CYCLE_S:
            raise ConfigurationError(
                f"the cycle is not from {SHORTEST_CYCLE_S:g} to {LONGEST_CYCLE_S:g} s",
                where="cycle_s",
            )
        if not 0.0 < self.validity_margin_k <= 1e6:
            raise ConfigurationError("not a positive number", where="validity_margin_k")
        if not 0.0 <= self.lowest_weight <= 1.0:
            raise ConfigurationError("not a number from 0 to 1", where="lowest_weight")
        if len(set(self.interlocks)) != len(self.interlocks):
            raise ConfigurationError("two interlocks have the same name", where="interlocks")
        if len(self.interlocks) > _MOST_INTERLOCKS:
            raise ConfigurationError("too many interlocks", where="interlocks")
        object.__setattr__(self, "sensors", MappingProxyType(dict(self.sensors)))
        object.__setattr__(self, "limits", MappingProxyType(dict(self.limits)))
        object.__setattr__(self, "rules", tuple(self.sensors[name] for name in channels))
        object.__setattr__(self, "bounds", tuple(self.limits[name] for name in outputs))


def _match(wanted: tuple[str, ...], given: Mapping[str, object], what: str, of: str) -> None:
    lacking = [name for name in wanted if name not in given]
    if lacking:
        raise ConfigurationError(f"there are no {what} of {of} {', '.join(lacking)}", where=of)
    foreign = [name for name in given if name not in wanted]
    if foreign:
        raise ConfigurationError(
            f"{what} are stated for {', '.join(foreign)}, of which the model knows nothing",
            where=of,
            remedy=f"The model has {', '.join(wanted)}",
        )
