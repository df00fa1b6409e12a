from ._bank import (
    RecordPart as RecordPart,
)
from ._places import (
    PlacesError as PlacesError,
    PlacesResult as PlacesResult,
    best_places as best_places,
)
from ._selection import (
    FIXED_TIME_CONSTANTS_S as FIXED_TIME_CONSTANTS_S,
    ChannelScore as ChannelScore,
    SelectedOutput as SelectedOutput,
    SelectionOptions as SelectionOptions,
    SelectionResult as SelectionResult,
    StructureScore as StructureScore,
    select as select,
)
from ._sensors import (
    faulty_candidates as faulty_candidates,
    sensor_noise_k as sensor_noise_k,
)
