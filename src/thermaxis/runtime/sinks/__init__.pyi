from ._linuxcnc_hal import (
    ARM as ARM,
    HEARTBEAT as HEARTBEAT,
    HalUnit as HalUnit,
)
from .dry import (
    DrySink as DrySink,
)
from .linuxcnc import (
    LinuxCncOutput as LinuxCncOutput,
    LinuxCncSettings as LinuxCncSettings,
    LinuxCncSink as LinuxCncSink,
    hal_text as hal_text,
)
from .opcua import (
    OpcUaOutput as OpcUaOutput,
    OpcUaSink as OpcUaSink,
)
