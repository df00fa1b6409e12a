from ._baselines import (
    AVERAGE_LAGS_S as AVERAGE_LAGS_S,
    Baseline as Baseline,
    BaselineModel as BaselineModel,
    fit_baseline as fit_baseline,
)
from ._far_touches import (
    SPARSE as SPARSE,
    far_touches as far_touches,
)
from ._free_run import (
    SimulatedLog as SimulatedLog,
    SimulatedOutput as SimulatedOutput,
    simulate_log as simulate_log,
)
from ._left_over import (
    LeftOver as LeftOver,
    left_over as left_over,
    left_over_messages as left_over_messages,
    runs_of as runs_of,
)
from ._start import (
    LogStart as LogStart,
    StartOfLog as StartOfLog,
)
from ._touched_run import (
    LEAST_FAR_UM as LEAST_FAR_UM,
    MOST_FAR_SHARE as MOST_FAR_SHARE,
    TouchError as TouchError,
    TouchFigures as TouchFigures,
    TouchPlan as TouchPlan,
    far_message as far_message,
    likeliest_drift as likeliest_drift,
    touch_interval_s as touch_interval_s,
)
from ._verification import (
    OUTSIDE_SHARE as OUTSIDE_SHARE,
    MeasuredOutput as MeasuredOutput,
    Verification as Verification,
    VerificationFigures as VerificationFigures,
    VerifiedLog as VerifiedLog,
    VerifiedOutput as VerifiedOutput,
    pooled_figures as pooled_figures,
    verify as verify,
)
