from ._numbers import (
    rounding as rounding,
)
from ._tempcomp import (
    LineInputs as LineInputs,
    LineOutputs as LineOutputs,
    LineTwin as LineTwin,
)
from ._twin import (
    PlcInputs as PlcInputs,
    PlcOutputs as PlcOutputs,
    Twin as Twin,
)
