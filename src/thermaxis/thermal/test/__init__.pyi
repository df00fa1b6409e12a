from ._evaluation import evaluate_thermal_test as evaluate_thermal_test
from ._figures import (
    END_SHARE as END_SHARE,
    EndCriterion as EndCriterion,
    RangeFigure as RangeFigure,
    SpeedClass as SpeedClass,
    ThermalTest as ThermalTest,
    ThermalTestQuantity as ThermalTestQuantity,
    ThermalTestTemperature as ThermalTestTemperature,
    UncertaintyCause as UncertaintyCause,
)
from ._left import left_by_model as left_by_model
from ._ranges import largest_ranges as largest_ranges
from ._setup import (
    MotionTargets as MotionTargets,
    Probes as Probes,
    ThermalTestBudget as ThermalTestBudget,
    ThermalTestKind as ThermalTestKind,
    ThermalTestMotion as ThermalTestMotion,
    ThermalTestSetup as ThermalTestSetup,
)
