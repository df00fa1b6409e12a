"""What a user says about the file of a run; it goes before what the file says."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Literal, TypeAlias, final

Direction: TypeAlias = Literal["forward", "backward"]


@final
@dataclass(frozen=True, slots=True)
class RunColumn:
    """What one column of the file of a run holds."""

    role: (
        Literal["target", "measured", "deviation", "cycle", "run", "direction", "order", "time"]
        | None
    ) = None
    """What its cells are; None if the heading says it, or if it holds one pass."""
    unit: str = ""
    """Unit of its numbers; empty: as the heading says."""
    cycle: int | None = None
    """Cycle of the pass whose deviations it holds. [1]"""
    direction: Direction | None = None
    leave_out: bool = False
    """Whether it is not read."""


def _no_columns() -> Mapping[str, RunColumn]:
    return MappingProxyType({})


def _no_directions() -> Mapping[str, Direction]:
    return MappingProxyType({})


@final
@dataclass(frozen=True, slots=True)
class RunMapping:
    """What a user says about the table of a run; it goes before the headings."""

    columns: Mapping[str, RunColumn] = field(default_factory=_no_columns)
    """By the heading in the file; columns that are not named stay as they are."""
    directions: Mapping[str, Direction] = field(default_factory=_no_directions)
    """Meaning of words in the column of directions."""
    decimal: Literal["point", "comma"] | None = None
    """Decimal sign of the numbers; None: as they show it."""
    date_order: Literal["day", "month", "year"] | None = None
    """What stands first in dates such as 03/04/2026; None: as they show it."""
    time_format: str | None = None
    """Form of the times, as strptime understands it; None: as they show it."""
    position_unit: str = ""
    """Unit of targets and measured positions whose headings state none."""
    deviation_unit: str = ""
    """Unit of deviations whose headings state none."""
    target_tolerance: float | None = None
    """Targets that differ by at most this are one target. [mm or deg]"""
    transposed: bool | None = None
    """Whether the headings stand in the first column; None: as they show it."""
    last_row: int | None = None
    """Last row of the file that is read; None: all. [1]"""


NO_MAPPING = RunMapping()
