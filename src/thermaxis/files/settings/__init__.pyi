from ._document import write_document as write_document
from ._lines import with_lines as with_lines
from ._mistakes import schema_of as schema_of
from ._moments import day_of as day_of, duration_of as duration_of, moment_of as moment_of
from ._problems import (
    nearest as nearest,
    placed as placed,
    problem as problem,
    refuse as refuse,
)
from ._reading import (
    parse_toml as parse_toml,
    read_json_object as read_json_object,
    read_toml as read_toml,
    read_tree as read_tree,
    tree_of as tree_of,
)
from .budget_toml import BUDGET_KEYS as BUDGET_KEYS, read_budget as read_budget
from .correction_limits_toml import read_correction_limits as read_correction_limits
from .figure_limits_toml import (
    DecisionRule as DecisionRule,
    FigureLimits as FigureLimits,
    read_figure_limits as read_figure_limits,
)
from .header_toml import (
    HEADER_FIELDS as HEADER_FIELDS,
    HEADER_GROUPS as HEADER_GROUPS,
    LONGEST_COMMENT as LONGEST_COMMENT,
    LONGEST_TEXT as LONGEST_TEXT,
    NORMALISED as NORMALISED,
    HeaderField as HeaderField,
    number_of as number_of,
    read_header as read_header,
)
from .heating_toml import read_heating_conditions as read_heating_conditions
from .model_json import (
    format_model as format_model,
    model_sha256 as model_sha256,
    parse_model as parse_model,
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
from .regions_toml import read_regions as read_regions
from .run_mapping_toml import read_run_mapping as read_run_mapping
from .thermal_mapping_toml import (
    TIME_UNITS_S as TIME_UNITS_S,
    ColumnMapping as ColumnMapping,
    ThermalMapping as ThermalMapping,
    read_thermal_mapping as read_thermal_mapping,
)
from .thermal_test_plan_json import (
    read_any_plan as read_any_plan,
    read_thermal_test_plan as read_thermal_test_plan,
    thermal_test_plan_sha256 as thermal_test_plan_sha256,
    write_thermal_test_plan as write_thermal_test_plan,
)
from .thermal_test_toml import read_thermal_test_setup as read_thermal_test_setup
