from ._findings import (
    LEAST_SCALE_UM_PER_M as LEAST_SCALE_UM_PER_M,
    Finding as Finding,
    diagnose as diagnose,
    is_temperature as is_temperature,
)
from ._levels import LEAST_EFFECT as LEAST_EFFECT, SPREAD_LEVEL as SPREAD_LEVEL
from ._periods import COMMON_PITCHES_MM as COMMON_PITCHES_MM
