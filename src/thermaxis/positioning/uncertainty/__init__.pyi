from ._budget import UncertaintyBudget as UncertaintyBudget
from ._uncertainty import (
    PROBABILITY as PROBABILITY,
    BudgetRow as BudgetRow,
    FigureUncertainty as FigureUncertainty,
    UncertaintyResult as UncertaintyResult,
    evaluate_uncertainty as evaluate_uncertainty,
)
