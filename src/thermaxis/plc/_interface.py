"""Inputs and outputs of the exported block, by which the program, its vectors and tests know it."""

from collections.abc import Iterable
from enum import Enum
from typing import NamedTuple, final

from thermaxis.compensation import Outcome, Quality, SampleQuality, SupervisorState, TouchOutcome
from thermaxis.plc._library import LIBRARY_VERSION
from thermaxis.plc._line import LineSettings
from thermaxis.plc._names import remark_text
from thermaxis.plc._settings import PlcSettings
from thermaxis.plc._template import rendered

NEVER_OUTCOMES = frozenset(
    {
        Outcome.CLOCK_BACKWARD,
        Outcome.CLOCK_STILL,
        Outcome.STATE_UNUSABLE,
        Outcome.DIAMETER_UNKNOWN,
    }
)
"""Outcomes that a block never has, whose clock is the time since the last call."""
NEVER_QUALITIES = frozenset(
    {
        SampleQuality.REDUNDANT,
        SampleQuality.OLD,
        SampleQuality.NO_TIME_STAMP,
        SampleQuality.DISAGREES,
    }
)
"""Qualities of what a block has not: redundant sensors and time stamps."""


NEVER_TOUCHED = frozenset({TouchOutcome.REPEATED, TouchOutcome.UNKNOWN_OUTPUT})
"""What never becomes of a touch whose counter has changed, at an output of its own."""


class Kind(Enum):
    """Kind of a variable."""

    NUMBER = "number"
    """LREAL or REAL, one for the whole program."""
    BOOL = "BOOL"
    INT = "INT"


@final
class Variable(NamedTuple):
    """An input or output of the block."""

    name: str
    """Lower case, at most 24 signs."""
    kind: Kind
    text: str
    """What it means, for the remark beside it."""
    unit: str = ""
    start: float = 0.0
    """Value before the first call."""

    @property
    def remark(self) -> str:
        """What stands beside it: text and unit."""
        return f"{self.text} [{self.unit}]" if self.unit else self.text


@final
class Interface(NamedTuple):
    """Inputs and outputs of a block, in their order."""

    inputs: tuple[Variable, ...]
    """What a caller states in every call."""
    outputs: tuple[Variable, ...]
    """What a caller may read."""
    identity: tuple[Variable, ...]
    """Outputs that never change: library and model."""


def interface_of(
    settings: PlcSettings, line: LineSettings | None = None, *, model_only: bool = False
) -> Interface:
    """Return inputs and outputs of the block of a compensation.

    Parameters
    ----------
    line : LineSettings, optional
        The line in the control. Default: there is none.
    model_only : bool
        Whether it is the model with limits and rate alone. Default: it is not.

    Returns
    -------
    Interface
        The variables, as the template ``interface.j2`` lists them.
    """
    compensation, names = settings.compensation, settings.names
    model = compensation.model
    qualities = list(Quality)

    def named(stems: tuple[str, ...], texts: Iterable[str]) -> list[tuple[str, str]]:
        return [(stem, remark_text(text)) for stem, text in zip(stems, texts, strict=True)]

    outputs = named(names.outputs, (output.name for output in model.outputs))
    sensors = named(names.channels, compensation.judged)
    values = {
        "alone": model_only,
        "line": line,
        "gained": model.layout.gained,
        "sensors": sensors,
        "channels": sensors[: len(model.channels)],
        "outputs": outputs,
        "touched": [one for one, own in zip(outputs, compensation.probed, strict=True) if own],
        "parts": named(names.parts, (part.name for part in model.layout.parts)),
        "states": ", ".join(f"{k} {state}" for k, state in enumerate(SupervisorState)),
        "qualities": ", ".join(f"{k} {quality}" for k, quality in enumerate(qualities)),
        "bad": qualities.index(Quality.BAD),
        "library_version": LIBRARY_VERSION,
        "sha256": settings.model_sha256,
    }
    groups: list[list[Variable]] = [[]]
    for row in rendered("interface.j2", values).splitlines():
        name, *about = row.split(" | ")
        if about:
            groups[-1].append(_variable(name, *about))
        else:
            groups.append([])
    return Interface(*map(tuple, groups))


def _variable(name: str, kind: str, text: str, start: str = "0.0") -> Variable:
    """Return a variable from a row of the template: a number has a unit in place of its kind."""
    if kind in {"BOOL", "INT"}:
        return Variable(name, Kind(kind), text, "", float(start))
    return Variable(name, Kind.NUMBER, text, kind, float(start))
