from ._uncertainty import (
    FigureUncertainty as FigureUncertainty,
    UncertaintyBudget as UncertaintyBudget,
    UncertaintyResult as UncertaintyResult,
    UncertaintyTerm as UncertaintyTerm,
    evaluate_uncertainty as evaluate_uncertainty,
)
