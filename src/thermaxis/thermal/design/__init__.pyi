from ._conditions import (
    HeatingConditions as HeatingConditions,
    HeatSource as HeatSource,
    KnownModel as KnownModel,
    LagRange as LagRange,
    ReadingNoise as ReadingNoise,
    SourceSwitch as SourceSwitch,
    SwitchKind as SwitchKind,
    UseSpectrum as UseSpectrum,
    Wanted as Wanted,
)
from ._exchange import (
    CustomaryTest as CustomaryTest,
    allowed as allowed,
    by_duration_um as by_duration_um,
    customary as customary,
    customary_um as customary_um,
    designed as designed,
    exchanged as exchanged,
    random_sequence as random_sequence,
)
from ._foresight import (
    Foresight as Foresight,
    foresight as foresight,
    foresight_of as foresight_of,
    spectra_of_use as spectra_of_use,
)
from ._next_test import (
    NextTest as NextTest,
    PossibleTest as PossibleTest,
    next_test as next_test,
)
from ._plan import (
    PlannedKnowledge as PlannedKnowledge,
    PlannedStep as PlannedStep,
    ThermalTestPlan as ThermalTestPlan,
    planned as planned,
)
from ._prior import (
    GainsPrior as GainsPrior,
    prior_of as prior_of,
)
from ._reached import (
    ReachedTest as ReachedTest,
    reached as reached,
)
from ._responses import (
    noise_covariance as noise_covariance,
    pulses as pulses,
)
