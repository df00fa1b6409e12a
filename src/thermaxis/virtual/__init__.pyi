from ._thermal_run import (
    GeneratedThermalTest as GeneratedThermalTest,
    Heating as Heating,
    Lags as Lags,
    ThermalTestPlan as ThermalTestPlan,
    generate_thermal_test as generate_thermal_test,
)
from .axis import *
from .lathe import *
