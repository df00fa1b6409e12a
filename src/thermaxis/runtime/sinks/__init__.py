"""Where corrections go: OPC UA nodes, LinuxCNC, or nowhere."""

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from thermaxis.runtime.sinks._linuxcnc_hal import (
        ARM,
        HEARTBEAT,
        LinuxCncOutput,
        LinuxCncSettings,
        hal_text,
    )
    from thermaxis.runtime.sinks.dry import DrySink
    from thermaxis.runtime.sinks.linuxcnc import LinuxCncSink
    from thermaxis.runtime.sinks.opcua import OpcUaOutput, OpcUaSink

__all__ = [
    "ARM",
    "HEARTBEAT",
    "DrySink",
    "LinuxCncOutput",
    "LinuxCncSettings",
    "LinuxCncSink",
    "OpcUaOutput",
    "OpcUaSink",
    "hal_text",
]

_MODULES = {
    "ARM": "_linuxcnc_hal",
    "HEARTBEAT": "_linuxcnc_hal",
    "DrySink": "dry",
    "LinuxCncOutput": "_linuxcnc_hal",
    "LinuxCncSettings": "_linuxcnc_hal",
    "LinuxCncSink": "linuxcnc",
    "OpcUaOutput": "opcua",
    "OpcUaSink": "opcua",
    "hal_text": "_linuxcnc_hal",
}


def __getattr__(name: str) -> object:
    """Import a sink when it is first asked for: a dry run needs no OPC UA."""
    if name not in _MODULES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_MODULES[name]}"), name)
