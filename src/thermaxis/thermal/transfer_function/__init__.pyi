from ._arx import (
    arx as arx,
    block_means as block_means,
    solve_triangle as solve_triangle,
    triangle as triangle,
)
from ._conversion import (
    ModalForm as ModalForm,
    OtherMode as OtherMode,
    equivalent_part as equivalent_part,
    modal_form as modal_form,
    modal_part as modal_part,
    thermal_model_of as thermal_model_of,
)
from ._figures import (
    fit_percent as fit_percent,
)
from ._linearity import (
    Linearity as Linearity,
    check_linearity as check_linearity,
)
from ._oe import (
    OeOptions as OeOptions,
    oe as oe,
)
from ._polynomial_model import (
    OrderTrial as OrderTrial,
    PolynomialModel as PolynomialModel,
    PolynomialResult as PolynomialResult,
    Start as Start,
    TransferFunction as TransferFunction,
    held as held,
    simulate_polynomial as simulate_polynomial,
    simulate_transfer_function as simulate_transfer_function,
)
from ._residuals import (
    PoleZeroMap as PoleZeroMap,
    ResidualAnalysis as ResidualAnalysis,
    StepResponses as StepResponses,
    analyse_residuals as analyse_residuals,
    frequency_deviations as frequency_deviations,
    pole_zero_map as pole_zero_map,
    step_responses as step_responses,
)
from ._roots import (
    LEAST_LOG_RATIO as LEAST_LOG_RATIO,
    ComplexArray as ComplexArray,
)
from ._superposition import (
    DiameterGain as DiameterGain,
    combine_models as combine_models,
    parse_gain as parse_gain,
)
from ._thermal_model import (
    ModalPart as ModalPart,
    ThermalModel as ThermalModel,
    delayed as delayed,
    frequency_response as frequency_response,
    section_response as section_response,
    simulate_from_rest as simulate_from_rest,
    simulate_modal as simulate_modal,
    step_response as step_response,
)
