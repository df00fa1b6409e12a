from ._positioning_test import (
    APPROACHES as APPROACHES,
    BACKWARD as BACKWARD,
    FORWARD as FORWARD,
    Cycle as Cycle,
    FloatArray as FloatArray,
    PositioningTest as PositioningTest,
    StartEnd as StartEnd,
    TimeSource as TimeSource,
    freeze_arrays as freeze_arrays,
    placed as placed,
    require_shape as require_shape,
)
