"""Evaluate positioning runs: numbers in, frozen results out."""

from thermaxis.positioning._positioning_test import (
    APPROACHES,
    BACKWARD,
    FORWARD,
    Cycle,
    FloatArray,
    PositioningTest,
    StartEnd,
    TimeSource,
)

__all__ = [
    "APPROACHES",
    "BACKWARD",
    "FORWARD",
    "Cycle",
    "FloatArray",
    "PositioningTest",
    "StartEnd",
    "TimeSource",
]
