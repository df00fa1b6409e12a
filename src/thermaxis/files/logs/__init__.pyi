from ._any_log import read_thermal_log as read_thermal_log
from ._columns import parse_log_heading as parse_log_heading
from ._tidy_log import (
    format_thermal_log as format_thermal_log,
    write_thermal_log as write_thermal_log,
)
