from ._lags import (
    Refinement as Refinement,
)
from ._modal import (
    LagTrial as LagTrial,
    ModalOptions as ModalOptions,
    ModalResult as ModalResult,
    PartStd as PartStd,
    ResponseEvidence as ResponseEvidence,
    modal as modal,
    response_evidence as response_evidence,
)
from ._posterior import (
    ResponsePosterior as ResponsePosterior,
)
from ._regressors import (
    BoolArray as BoolArray,
    Segment as Segment,
    segments_of as segments_of,
)
from ._slow_noise import (
    SlowNoise as SlowNoise,
)
from ._switched import (
    SwitchedModel as SwitchedModel,
    fit_switched as fit_switched,
    simulate_switched as simulate_switched,
)
from ._validation import (
    BlockedValidation as BlockedValidation,
)
