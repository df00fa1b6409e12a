from ._linuxcnc_hal import (
    ARM as ARM,
    HEARTBEAT as HEARTBEAT,
    hal_text as hal_text,
)
from ._linuxcnc_settings import (
    HalSettings as HalSettings,
    HalUnit as HalUnit,
    LinuxCncOutput as LinuxCncOutput,
    LinuxCncSettings as LinuxCncSettings,
)
from .dry import (
    DrySink as DrySink,
)
from .linuxcnc import (
    LinuxCncSink as LinuxCncSink,
)
from .opcua import (
    OpcUaOutput as OpcUaOutput,
    OpcUaSink as OpcUaSink,
    Token as Token,
)
