from ._positioning_run import (
    PAPER_X_AXIS as PAPER_X_AXIS,
    PAPER_Y_AXIS as PAPER_Y_AXIS,
    AxisGeometry as AxisGeometry,
    AxisThermal as AxisThermal,
    GeneratedRun as GeneratedRun,
    LocalSpread as LocalSpread,
    ReadingScatter as ReadingScatter,
    RunPlan as RunPlan,
    VirtualAxis as VirtualAxis,
    WarmUp as WarmUp,
    generate_positioning_run as generate_positioning_run,
    paper_x_axis as paper_x_axis,
    paper_y_axis as paper_y_axis,
)
from ._thermal_field import (
    VirtualTable as VirtualTable,
    generate_thermal_field as generate_thermal_field,
    true_temperature_c as true_temperature_c,
    write_example_fields as write_example_fields,
)
