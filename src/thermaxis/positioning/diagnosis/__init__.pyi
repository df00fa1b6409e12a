from ._diagnosis import (
    COMMON_PITCHES_MM as COMMON_PITCHES_MM,
    Finding as Finding,
    diagnose as diagnose,
)
