"""What may act on a machine: the model, one cycle of it, its quality. Standard library only."""

from thermaxis.compensation._compensation import Compensation
from thermaxis.compensation._cycle import (
    CycleOutput,
    CycleReading,
    CycleState,
    Trim,
    cycle,
    cycle_state,
    with_compensation,
)
from thermaxis.compensation._limits import Limits, limit_step
from thermaxis.compensation._model_step import (
    ModelOutput,
    Reading,
    ThermalState,
    gain_of,
    initial_state,
    model_step,
)
from thermaxis.compensation._quality import (
    Outcome,
    Quality,
    Sample,
    SampleQuality,
    SensorRules,
    SensorState,
    judge,
)
from thermaxis.compensation._requests import Answer, Request, RequestKind
from thermaxis.compensation._supervisor import (
    Memory,
    Reason,
    Signals,
    SupervisorRules,
    SupervisorState,
    supervisor_step,
)
from thermaxis.compensation._thermal_model import (
    START,
    STATED,
    CompensationModel,
    GainPoint,
    Output,
    Part,
    Provenance,
    Section,
    TrainingLog,
)

__all__ = [
    "START",
    "STATED",
    "Answer",
    "Compensation",
    "CompensationModel",
    "CycleOutput",
    "CycleReading",
    "CycleState",
    "GainPoint",
    "Limits",
    "Memory",
    "ModelOutput",
    "Outcome",
    "Output",
    "Part",
    "Provenance",
    "Quality",
    "Reading",
    "Reason",
    "Request",
    "RequestKind",
    "Sample",
    "SampleQuality",
    "Section",
    "SensorRules",
    "SensorState",
    "Signals",
    "SupervisorRules",
    "SupervisorState",
    "ThermalState",
    "TrainingLog",
    "Trim",
    "cycle",
    "cycle_state",
    "gain_of",
    "initial_state",
    "judge",
    "limit_step",
    "model_step",
    "supervisor_step",
    "with_compensation",
]
