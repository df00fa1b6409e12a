"""What a machine is compensated with: a model, rules of sensors, supervisor and touches, limits."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import final

from thermaxis.compensation._limits import Limits
from thermaxis.compensation._model import CompensationModel
from thermaxis.compensation._sensors import SensorRules
from thermaxis.compensation._supervisor import SupervisorRules
from thermaxis.compensation._touches import TouchRules
from thermaxis.errors import (
    ConfigurationError,
    require_count,
    require_known,
    require_positive,
    require_range,
    require_unique,
)

LONGEST_CYCLE_S = 60.0
"""Longest cycle. [s]"""
SHORTEST_CYCLE_S = 0.1
"""Shortest cycle. [s]"""
LONGEST_STEP_CYCLES = 2.0
"""A cycle that comes late moves the correction by no more than the rate allows in so many cycles:
time in which nothing ran is no time in which the machine may be moved. [1]"""
_MOST_INTERLOCKS = 100


def _no_touches() -> Mapping[str, TouchRules]:
    return MappingProxyType({})


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
    touches: Mapping[str, TouchRules] = field(default_factory=_no_touches)
    """How touches of the machine's probe are believed, by output of the model. Default: none is
    looked at."""
    rules: tuple[SensorRules, ...] = field(init=False, repr=False)
    """Rules in the order of `judged`."""
    bounds: tuple[Limits, ...] = field(init=False, repr=False)
    """Limits in the order of the model's outputs."""
    probed: tuple[TouchRules | None, ...] = field(init=False, repr=False)
    """Rules of touches in the order of the model's outputs; None where there are none."""
    judged: tuple[str, ...] = field(init=False, repr=False)
    """Names of everything whose samples are judged: the model's channels, then the inputs besides
    that one of them moves with."""
    witnesses: tuple[int, ...] = field(init=False, repr=False)
    """Number of the input that each of them moves with, among them; -1 for none."""

    def __post_init__(self) -> None:
        """Check the parts against each other and put them in order."""
        channels = self.model.channels
        outputs = tuple(output.name for output in self.model.outputs)
        witness = {c: self.sensors[c].moves_with for c in channels if c in self.sensors}
        named = {name for name in witness.values() if name}
        judged = (*channels, *sorted(named.difference(channels)))
        _match("sensors", judged, self.sensors)
        for name in named:
            other = name
            for _ in judged:  # no chain is longer
                other = witness.get(other, "")
            if other or not self.sensors[name].frozen_s:
                code = "moves_with_itself" if other else "witness_may_stand"
                raise ConfigurationError(code, name=name, key="sensors")
        _match("limits", outputs, self.limits)
        require_known("redundant", self.redundant, channels)
        require_known("touches", self.touches, outputs)
        for name, own in self.touches.items():
            most_um = self.limits[name].total_um
            require_range("touches.limits", own.limits.total_um, 0.0, most_um, name)
        require_range("cycle_s", self.cycle_s, SHORTEST_CYCLE_S, LONGEST_CYCLE_S)
        require_positive("validity_margin_k", self.validity_margin_k, 1e6)
        require_range("lowest_weight", self.lowest_weight, 0.0, 1.0)
        require_unique("interlocks", self.interlocks)
        require_count("interlocks", len(self.interlocks), 0, _MOST_INTERLOCKS)
        object.__setattr__(self, "sensors", MappingProxyType(dict(self.sensors)))
        object.__setattr__(self, "limits", MappingProxyType(dict(self.limits)))
        object.__setattr__(self, "touches", MappingProxyType(dict(self.touches)))
        object.__setattr__(self, "probed", tuple(self.touches.get(name) for name in outputs))
        object.__setattr__(self, "judged", judged)
        object.__setattr__(self, "rules", tuple(self.sensors[name] for name in judged))
        found = (witness.get(name) for name in judged)
        object.__setattr__(self, "witnesses", tuple(judged.index(n) if n else -1 for n in found))
        object.__setattr__(self, "bounds", tuple(self.limits[name] for name in outputs))


def _match(key: str, wanted: tuple[str, ...], given: Mapping[str, object]) -> None:
    if lacking := tuple(name for name in wanted if name not in given):
        raise ConfigurationError("entries_missing", names=lacking, key=key)
    require_known(key, given, wanted)
