"""Who remembers: every cycle in SQLite or PostgreSQL, and what reads it again."""

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from thermaxis.runtime.historian._condition import Condition, check_history, copy_history
    from thermaxis.runtime.historian._export import Export, export_history
    from thermaxis.runtime.historian._reading import HistoryReader, Piece, Trend
    from thermaxis.runtime.historian._settings import HistorianSettings
    from thermaxis.runtime.historian._sql import SqlHistorian
    from thermaxis.runtime.historian.none import NoHistorian

__all__ = [
    "Condition",
    "Export",
    "HistorianSettings",
    "HistoryReader",
    "NoHistorian",
    "Piece",
    "SqlHistorian",
    "Trend",
    "check_history",
    "copy_history",
    "export_history",
]

_MODULES = {
    "Condition": "_condition",
    "Export": "_export",
    "HistorianSettings": "_settings",
    "HistoryReader": "_reading",
    "NoHistorian": "none",
    "Piece": "_reading",
    "SqlHistorian": "_sql",
    "Trend": "_reading",
    "check_history": "_condition",
    "copy_history": "_condition",
    "export_history": "_export",
}


def __getattr__(name: str) -> object:
    """Import a part when it is first asked for: SQLAlchemy takes its time."""
    if name not in _MODULES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_MODULES[name]}"), name)
