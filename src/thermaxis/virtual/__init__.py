"""Virtual machines: physics of their own, to make runs whose truth is known."""

from thermaxis.virtual._positioning_run import (
    PAPER_X_AXIS,
    PAPER_Y_AXIS,
    AxisGeometry,
    AxisThermal,
    GeneratedRun,
    LocalSpread,
    ReadingScatter,
    RunPlan,
    VirtualAxis,
    WarmUp,
    generate_positioning_run,
    paper_x_axis,
    paper_y_axis,
)

__all__ = [
    "PAPER_X_AXIS",
    "PAPER_Y_AXIS",
    "AxisGeometry",
    "AxisThermal",
    "GeneratedRun",
    "LocalSpread",
    "ReadingScatter",
    "RunPlan",
    "VirtualAxis",
    "WarmUp",
    "generate_positioning_run",
    "paper_x_axis",
    "paper_y_axis",
]
