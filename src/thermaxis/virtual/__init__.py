"""Virtual machines: physics of their own, to make runs whose truth is known."""

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from thermaxis.virtual._lathe_axis import OffsetRules
    from thermaxis.virtual._lathe_faults import Fault, FaultKind, parse_fault
    from thermaxis.virtual._lathe_hall import HallSettings
    from thermaxis.virtual._lathe_log import log_lathe, write_lathe_log
    from thermaxis.virtual._lathe_machine import DEFAULT_SCENARIO, LatheSettings, VirtualLathe
    from thermaxis.virtual._lathe_physics import POSITIONS, LatheDuty
    from thermaxis.virtual._lathe_ports import LatheSink, LatheSource
    from thermaxis.virtual._lathe_scenarios import SCENARIOS, Scenario, Stage
    from thermaxis.virtual._lathe_server import LatheServer, LatheServerSettings
    from thermaxis.virtual._lathe_signals import (
        FAULTY,
        SENSORS,
        SIGNALS,
        LatheReading,
        SensorNoise,
        Signal,
    )
    from thermaxis.virtual._lathe_tests import LATHE_SEED, generate_lathe_test
    from thermaxis.virtual._lathe_tests import TESTS as LATHE_TESTS
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
    "DEFAULT_SCENARIO",
    "FAULTY",
    "LATHE_SEED",
    "LATHE_TESTS",
    "PAPER_X_AXIS",
    "PAPER_Y_AXIS",
    "POSITIONS",
    "SCENARIOS",
    "SENSORS",
    "SIGNALS",
    "AxisGeometry",
    "AxisThermal",
    "Fault",
    "FaultKind",
    "GeneratedRun",
    "GeneratedThermalTest",
    "HallSettings",
    "Heating",
    "Lags",
    "LatheDuty",
    "LatheReading",
    "LatheServer",
    "LatheServerSettings",
    "LatheSettings",
    "LatheSink",
    "LatheSource",
    "LocalSpread",
    "OffsetRules",
    "ReadingScatter",
    "RunPlan",
    "Scenario",
    "SensorNoise",
    "Signal",
    "Stage",
    "ThermalTestPlan",
    "VirtualAxis",
    "VirtualLathe",
    "VirtualTable",
    "WarmUp",
    "generate_lathe_test",
    "generate_positioning_run",
    "generate_thermal_field",
    "generate_thermal_test",
    "log_lathe",
    "paper_x_axis",
    "paper_y_axis",
    "parse_fault",
    "true_temperature_c",
    "write_example_fields",
    "write_lathe_log",
]

_MODULES = {
    "DEFAULT_SCENARIO": "_lathe_machine",
    "FAULTY": "_lathe_signals",
    "LATHE_SEED": "_lathe_tests",
    "LATHE_TESTS": "_lathe_tests",
    "PAPER_X_AXIS": "_positioning_run",
    "PAPER_Y_AXIS": "_positioning_run",
    "POSITIONS": "_lathe_physics",
    "SCENARIOS": "_lathe_scenarios",
    "SENSORS": "_lathe_signals",
    "SIGNALS": "_lathe_signals",
    "AxisGeometry": "_positioning_run",
    "AxisThermal": "_positioning_run",
    "Fault": "_lathe_faults",
    "FaultKind": "_lathe_faults",
    "GeneratedRun": "_positioning_run",
    "GeneratedThermalTest": "_thermal_run",
    "HallSettings": "_lathe_hall",
    "Heating": "_thermal_run",
    "Lags": "_thermal_run",
    "LatheDuty": "_lathe_physics",
    "LatheReading": "_lathe_signals",
    "LatheServer": "_lathe_server",
    "LatheServerSettings": "_lathe_server",
    "LatheSettings": "_lathe_machine",
    "LatheSink": "_lathe_ports",
    "LatheSource": "_lathe_ports",
    "LocalSpread": "_positioning_run",
    "OffsetRules": "_lathe_axis",
    "ReadingScatter": "_positioning_run",
    "RunPlan": "_positioning_run",
    "Scenario": "_lathe_scenarios",
    "SensorNoise": "_lathe_signals",
    "Signal": "_lathe_signals",
    "Stage": "_lathe_scenarios",
    "ThermalTestPlan": "_thermal_run",
    "VirtualAxis": "_positioning_run",
    "VirtualLathe": "_lathe_machine",
    "VirtualTable": "_thermal_field",
    "WarmUp": "_positioning_run",
    "generate_lathe_test": "_lathe_tests",
    "generate_positioning_run": "_positioning_run",
    "generate_thermal_field": "_thermal_field",
    "generate_thermal_test": "_thermal_run",
    "log_lathe": "_lathe_log",
    "paper_x_axis": "_positioning_run",
    "paper_y_axis": "_positioning_run",
    "parse_fault": "_lathe_faults",
    "true_temperature_c": "_thermal_field",
    "write_example_fields": "_thermal_field",
    "write_lathe_log": "_lathe_log",
}
_NAMES = {"LATHE_TESTS": "TESTS"}


def __getattr__(name: str) -> object:
    """Import a machine when it is first asked for: the server needs asyncua, the axis does not."""
    if name not in _MODULES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_MODULES[name]}"), _NAMES.get(name, name))
