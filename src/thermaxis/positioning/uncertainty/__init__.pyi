from ._uncertainty import (
    PROBABILITY as PROBABILITY,
    FigureUncertainty as FigureUncertainty,
    UncertaintyBudget as UncertaintyBudget,
    UncertaintyResult as UncertaintyResult,
    UncertaintyTerm as UncertaintyTerm,
    evaluate_uncertainty as evaluate_uncertainty,
)
