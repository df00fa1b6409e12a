from .images import (
    read_field_csv as read_field_csv,
    read_flir as read_flir,
)
from .logs import (
    format_thermal_log as format_thermal_log,
    read_thermal_log as read_thermal_log,
    write_thermal_log as write_thermal_log,
)
from .runs import (
    format_tidy_csv as format_tidy_csv,
    read_positioning as read_positioning,
    read_positioning_with_sha256 as read_positioning_with_sha256,
    write_rtl as write_rtl,
    write_tidy_csv as write_tidy_csv,
)
from .settings import (
    ColumnMapping as ColumnMapping,
    DecisionRule as DecisionRule,
    FigureLimits as FigureLimits,
    ThermalMapping as ThermalMapping,
    format_model as format_model,
    format_plan as format_plan,
    model_sha256 as model_sha256,
    parse_model as parse_model,
    plan_as_json as plan_as_json,
    plan_sha256 as plan_sha256,
    read_any_plan as read_any_plan,
    read_budget as read_budget,
    read_correction_limits as read_correction_limits,
    read_figure_limits as read_figure_limits,
    read_header as read_header,
    read_heating_conditions as read_heating_conditions,
    read_model as read_model,
    read_plan as read_plan,
    read_regions as read_regions,
    read_run_mapping as read_run_mapping,
    read_thermal_mapping as read_thermal_mapping,
    read_thermal_test_plan as read_thermal_test_plan,
    read_thermal_test_setup as read_thermal_test_setup,
    thermal_test_plan_sha256 as thermal_test_plan_sha256,
    write_model as write_model,
    write_plan as write_plan,
    write_thermal_test_plan as write_thermal_test_plan,
)
from .table import (
    FALLBACK_ENCODING as FALLBACK_ENCODING,
    RunColumn as RunColumn,
    RunMapping as RunMapping,
)
