"""Where values come from: OPC UA servers, and logs that are played."""

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from thermaxis.runtime.sources.opcua import NodeSettings, OpcUaSource
    from thermaxis.runtime.sources.replay import ReplayClock, ReplaySource

__all__ = [
    "NodeSettings",
    "OpcUaSource",
    "ReplayClock",
    "ReplaySource",
]

_MODULES = {
    "NodeSettings": "opcua",
    "OpcUaSource": "opcua",
    "ReplayClock": "replay",
    "ReplaySource": "replay",
}


def __getattr__(name: str) -> object:
    """Import a source when it is first asked for: a replay needs no OPC UA."""
    if name not in _MODULES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_MODULES[name]}"), name)
