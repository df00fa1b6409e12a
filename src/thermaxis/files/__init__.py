"""Read and write measurement files: one module per format."""

from importlib import import_module
from typing import TYPE_CHECKING

from thermaxis.files._recognition import read_positioning, read_positioning_with_sha256
from thermaxis.files._source import FALLBACK_ENCODING

if TYPE_CHECKING:
    from thermaxis.files.correction_limits_toml import read_correction_limits
    from thermaxis.files.field_csv import format_field_csv, read_field_csv, write_field_csv
    from thermaxis.files.flir import read_flir
    from thermaxis.files.iso230_dat import read_iso230_dat
    from thermaxis.files.model_json import format_model, model_sha256, read_model, write_model
    from thermaxis.files.plan_json import (
        format_plan,
        plan_as_json,
        plan_sha256,
        read_plan,
        write_plan,
    )
    from thermaxis.files.rtl import read_rtl, write_rtl
    from thermaxis.files.thermal_log import read_thermal_log
    from thermaxis.files.thermal_log_csv import format_thermal_log, write_thermal_log
    from thermaxis.files.thermal_mapping_toml import (
        ColumnMapping,
        ThermalMapping,
        read_thermal_mapping,
    )
    from thermaxis.files.tidy_csv import format_tidy_csv, read_tidy_csv, write_tidy_csv
    from thermaxis.files.wide_csv import read_wide_csv
    from thermaxis.files.xlsx import read_xlsx

__all__ = [
    "FALLBACK_ENCODING",
    "ColumnMapping",
    "ThermalMapping",
    "format_field_csv",
    "format_model",
    "format_plan",
    "format_thermal_log",
    "format_tidy_csv",
    "model_sha256",
    "plan_as_json",
    "plan_sha256",
    "read_correction_limits",
    "read_field_csv",
    "read_flir",
    "read_iso230_dat",
    "read_model",
    "read_plan",
    "read_positioning",
    "read_positioning_with_sha256",
    "read_rtl",
    "read_thermal_log",
    "read_thermal_mapping",
    "read_tidy_csv",
    "read_wide_csv",
    "read_xlsx",
    "write_field_csv",
    "write_model",
    "write_plan",
    "write_rtl",
    "write_thermal_log",
    "write_tidy_csv",
]

_MODULES = {
    "read_correction_limits": "correction_limits_toml",
    "format_thermal_log": "thermal_log_csv",
    "read_thermal_mapping": "thermal_mapping_toml",
    "ThermalMapping": "thermal_mapping_toml",
    "ColumnMapping": "thermal_mapping_toml",
    "format_field_csv": "field_csv",
    "format_model": "model_json",
    "model_sha256": "model_json",
    "read_model": "model_json",
    "write_model": "model_json",
    "read_thermal_log": "thermal_log",
    "write_thermal_log": "thermal_log_csv",
    "plan_as_json": "plan_json",
    "read_flir": "flir",
    "format_plan": "plan_json",
    "plan_sha256": "plan_json",
    "read_plan": "plan_json",
    "write_plan": "plan_json",
    "read_field_csv": "field_csv",
    "write_field_csv": "field_csv",
    "format_tidy_csv": "tidy_csv",
    "read_iso230_dat": "iso230_dat",
    "read_rtl": "rtl",
    "read_tidy_csv": "tidy_csv",
    "read_wide_csv": "wide_csv",
    "read_xlsx": "xlsx",
    "write_rtl": "rtl",
    "write_tidy_csv": "tidy_csv",
}


def __getattr__(name: str) -> object:
    """Import a format when it is first asked for: most runs of the program read one file."""
    if name not in _MODULES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_MODULES[name]}"), name)
