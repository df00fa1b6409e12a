"""What the historian is told: where to, for how long, how much it may keep in memory."""

from dataclasses import dataclass
from pathlib import Path
from typing import final

from thermaxis.codes import Place
from thermaxis.errors import ConfigurationError
from thermaxis.runtime._connection import Secret

_NONE = Secret("")


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class HistorianSettings:
    """Settings of a historian; all have safe defaults.

    Raises
    ------
    ConfigurationError
        If a number is out of its range.
    """

    machine: str = "machine"
    """Name of the machine; the finished parts lie in a folder of this name."""
    folder: Path | None = None
    """Folder of the finished parts; None for one beside SQLite's file, named like it."""
    retention_days: int = 90
    """Days with records that are kept. Days on which nothing was recorded do not count, so that a
    clock that is wrong for once deletes nothing. Default: a quarter. [d]"""
    password: Secret = _NONE
    """Password of the database's user; empty where none is needed."""
    largest_waiting_bytes: int = 32_000_000
    """Memory for what cannot be stored at the moment; then the oldest cycles are lost. Default:
    seven hours at one second with eight channels and four outputs. [byte]"""
    batch_s: float = 0.4
    """Time for which records are gathered before they are written. Default: with the write itself
    less than a second passes from a cycle to the disk. [s]"""
    retry_s: float = 2.0
    """Time between attempts to reach a lost database. Default: two seconds. [s]"""

    def __post_init__(self) -> None:
        """Check the numbers."""
        _require(self.retention_days, 1, 36_500, "retention_days")
        _require(self.largest_waiting_bytes, 100_000, 10**12, "largest_waiting_bytes")
        _require(self.batch_s, 0.0, 10.0, "batch_s")
        _require(self.retry_s, 0.01, 3600.0, "retry_s")


def _require(value: float, lowest: float, highest: float, key: str) -> None:
    if not lowest <= value <= highest:
        raise ConfigurationError(
            "outside_range", value=value, least=lowest, most=highest, place=Place(key=key)
        )
