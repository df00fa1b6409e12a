from ._life import (
    LifeCounter as LifeCounter,
)
from ._nodes import (
    HAL as HAL,
    NodeSettings as NodeSettings,
    check_node as check_node,
)
from ._probed import (
    ProbedSource as ProbedSource,
)
from .linuxcnc import (
    THREAD_TIME as THREAD_TIME,
    LinuxCncSource as LinuxCncSource,
)
from .opcua import (
    OpcUaSource as OpcUaSource,
)
from .replay import (
    ReplayClock as ReplayClock,
    ReplaySource as ReplaySource,
)
