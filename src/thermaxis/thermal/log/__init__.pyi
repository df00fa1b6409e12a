from ._clock import (
    StraightTimes as StraightTimes,
    straighten_times as straighten_times,
)
from ._experiment import (
    FEWEST_READINGS as FEWEST_READINGS,
    REFERENCE_S as REFERENCE_S,
    Experiment as Experiment,
    common_shape as common_shape,
)
from ._faults import (
    mask_rows as mask_rows,
    measured_values as measured_values,
    without_faults as without_faults,
)
from ._frames import (
    Frame as Frame,
    LogLike as LogLike,
    as_thermal_log as as_thermal_log,
    as_thermal_logs as as_thermal_logs,
)
from ._input import (
    InputDefinition as InputDefinition,
    check_inputs as check_inputs,
    evaluate_input as evaluate_input,
    parse_input as parse_input,
    start_of_input as start_of_input,
)
from ._merge import (
    ShiftResult as ShiftResult,
    find_shift as find_shift,
    join_rates as join_rates,
    merge_logs as merge_logs,
    shift_displacements as shift_displacements,
)
from ._quality import (
    TEMPERATURES as TEMPERATURES,
    FindingKind as FindingKind,
    LogFinding as LogFinding,
    check_log as check_log,
    resolution_of as resolution_of,
)
from ._resample import (
    block_means as block_means,
    block_numbers as block_numbers,
    even_step_s as even_step_s,
)
from ._rests import (
    RestingSensor as RestingSensor,
    find_resting as find_resting,
)
from ._suggestion import (
    quantity_of as quantity_of,
    suggest_inputs as suggest_inputs,
)
from ._thermal_log import (
    MOST_CELLS as MOST_CELLS,
    ThermalLog as ThermalLog,
    common_names as common_names,
    unit_named as unit_named,
    unit_of_name as unit_of_name,
)
