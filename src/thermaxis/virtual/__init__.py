"""Virtual machines: physics of their own, to make runs whose truth is known."""

from thermaxis.virtual._lathe_tests import (
    LATHE_SEED,
    generate_lathe_test,
)
from thermaxis.virtual._lathe_tests import (
    TESTS as LATHE_TESTS,
)
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
from thermaxis.virtual._thermal_field import (
    VirtualTable,
    generate_thermal_field,
    true_temperature_c,
    write_example_fields,
)
from thermaxis.virtual._thermal_run import (
    GeneratedThermalTest,
    Heating,
    Lags,
    ThermalTestPlan,
    generate_thermal_test,
)

__all__ = [
    "LATHE_SEED",
    "LATHE_TESTS",
    "PAPER_X_AXIS",
    "PAPER_Y_AXIS",
    "AxisGeometry",
    "AxisThermal",
    "GeneratedRun",
    "GeneratedThermalTest",
    "Heating",
    "Lags",
    "LocalSpread",
    "ReadingScatter",
    "RunPlan",
    "ThermalTestPlan",
    "VirtualAxis",
    "VirtualTable",
    "WarmUp",
    "generate_lathe_test",
    "generate_positioning_run",
    "generate_thermal_field",
    "generate_thermal_test",
    "paper_x_axis",
    "paper_y_axis",
    "true_temperature_c",
    "write_example_fields",
]
