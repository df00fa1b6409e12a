from ._lags import (
    Refinement as Refinement,
)
from ._modal import (
    ModalOptions as ModalOptions,
    ModalResult as ModalResult,
    PartStd as PartStd,
    modal as modal,
    response_evidence as response_evidence,
)
from ._regressors import (
    Segment as Segment,
    segments_of as segments_of,
)
from ._slow_noise import (
    SlowNoise as SlowNoise,
)
from ._validation import (
    BlockedValidation as BlockedValidation,
)
