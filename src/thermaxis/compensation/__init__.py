"""What may act on a machine: the model, one cycle of it, its quality. Standard library only."""

from thermaxis.compensation._limits import Limits, limit_step
from thermaxis.compensation._model_step import (
    ModelOutput,
    Reading,
    ThermalState,
    gain_of,
    initial_state,
    model_step,
)
from thermaxis.compensation._quality import Outcome, Quality
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
    "CompensationModel",
    "GainPoint",
    "Limits",
    "ModelOutput",
    "Outcome",
    "Output",
    "Part",
    "Provenance",
    "Quality",
    "Reading",
    "Section",
    "ThermalState",
    "TrainingLog",
    "gain_of",
    "initial_state",
    "limit_step",
    "model_step",
]
