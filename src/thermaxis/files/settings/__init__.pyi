from ._settings_file import (
    as_table as as_table,
    read_toml as read_toml,
    unknown_key as unknown_key,
)
from .correction_limits_toml import (
    read_correction_limits as read_correction_limits,
)
from .model_json import (
    format_model as format_model,
    model_sha256 as model_sha256,
    read_model as read_model,
    write_model as write_model,
)
from .plan_json import (
    format_plan as format_plan,
    plan_as_json as plan_as_json,
    plan_sha256 as plan_sha256,
    read_plan as read_plan,
    write_plan as write_plan,
)
from .thermal_mapping_toml import (
    ColumnMapping as ColumnMapping,
    ThermalMapping as ThermalMapping,
    read_thermal_mapping as read_thermal_mapping,
)
