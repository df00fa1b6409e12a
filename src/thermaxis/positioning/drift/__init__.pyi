from ._drift import (
    Change as Change,
    ChangeKind as ChangeKind,
    DriftModel as DriftModel,
    DriftResult as DriftResult,
    Outlier as Outlier,
    evaluate_drift as evaluate_drift,
    evaluate_drift_at as evaluate_drift_at,
)
from ._drift_tests import special as special
from ._smooth_terms import (
    Readings as Readings,
    Sums as Sums,
    fit as fit,
    levels_at as levels_at,
    parameters_of as parameters_of,
    penalty_of as penalty_of,
    rows_at as rows_at,
    sums_of as sums_of,
)
