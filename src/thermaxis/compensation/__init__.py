"""What may act on a machine: the model, one cycle of it, its quality. Standard library only."""

from thermaxis.compensation._compensation import (
    LONGEST_CYCLE_S as LONGEST_CYCLE_S,
    LONGEST_STEP_CYCLES as LONGEST_STEP_CYCLES,
    SHORTEST_CYCLE_S as SHORTEST_CYCLE_S,
    Compensation as Compensation,
)
from thermaxis.compensation._cycle import (
    CycleOutput as CycleOutput,
    CycleReading as CycleReading,
    CycleState as CycleState,
    cycle as cycle,
    cycle_state as cycle_state,
    shifted as shifted,
    with_compensation as with_compensation,
)
from thermaxis.compensation._limits import (
    FASTEST_LIMIT_UM_PER_S as FASTEST_LIMIT_UM_PER_S,
    LARGEST_LIMIT_UM as LARGEST_LIMIT_UM,
    SETTLED_UM as SETTLED_UM,
    Limits as Limits,
    limit_step as limit_step,
)
from thermaxis.compensation._model import (
    START as START,
    STATED as STATED,
    CompensationModel as CompensationModel,
    GainPoint as GainPoint,
    Output as Output,
    Part as Part,
    Provenance as Provenance,
    Section as Section,
    TrainingLog as TrainingLog,
)
from thermaxis.compensation._requests import (
    LARGEST_DIAMETER_MM as LARGEST_DIAMETER_MM,
    Answer as Answer,
    AnswerCode as AnswerCode,
    Request as Request,
    RequestKind as RequestKind,
    Trim as Trim,
)
from thermaxis.compensation._sensors import (
    LARGEST_RULE as LARGEST_RULE,
    LONGEST_REST as LONGEST_REST,
    WITNESS_S as WITNESS_S,
    Sample as Sample,
    SampleQuality as SampleQuality,
    SensorRules as SensorRules,
    SensorState as SensorState,
    validate_sample as validate_sample,
)
from thermaxis.compensation._step import (
    LARGEST_VALUE as LARGEST_VALUE,
    ModelOutput as ModelOutput,
    Outcome as Outcome,
    Quality as Quality,
    Reading as Reading,
    ThermalState as ThermalState,
    gain_of as gain_of,
    initial_state as initial_state,
    model_step as model_step,
)
from thermaxis.compensation._supervisor import (
    Memory as Memory,
    Reason as Reason,
    Signals as Signals,
    SupervisorRules as SupervisorRules,
    SupervisorState as SupervisorState,
    supervisor_step as supervisor_step,
)
from thermaxis.compensation._touches import (
    MOST_EXCLUDED as MOST_EXCLUDED,
    MOST_EXPECTED as MOST_EXPECTED,
    OffsetState as OffsetState,
    Touch as Touch,
    TouchFilter as TouchFilter,
    TouchOutcome as TouchOutcome,
    TouchRules as TouchRules,
    touch_step as touch_step,
)
