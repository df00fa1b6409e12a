from ._probed import (
    ProbedSource as ProbedSource,
)
from .opcua import (
    NodeSettings as NodeSettings,
    OpcUaSource as OpcUaSource,
)
from .replay import (
    ReplayClock as ReplayClock,
    ReplaySource as ReplaySource,
)
