from ._call_sequence import (
    MOST_ROWS as MOST_ROWS,
    CallSequence as CallSequence,
    course_steps as course_steps,
)
from ._instance import (
    BlockInstance as BlockInstance,
    PlcInputs as PlcInputs,
    PlcOutputs as PlcOutputs,
    by_variable as by_variable,
    variable_names as variable_names,
)
from ._scenario import (
    scenario as scenario,
    scenario_steps as scenario_steps,
)
from ._simulated_plant import (
    ODD as ODD,
    PlcStep as PlcStep,
    SimulatedPlant as SimulatedPlant,
    odd_values as odd_values,
)
from ._vectors import (
    LINE_LIMITED as LINE_LIMITED,
    Vectors as Vectors,
    line_vectors_csv as line_vectors_csv,
    vectors_csv as vectors_csv,
    vectors_of as vectors_of,
)
