from ._address_space import (
    forget_standard as forget_standard,
)
from ._alarms import (
    ALARMS as ALARMS,
    PRIORITIES as PRIORITIES,
    alarms_of as alarms_of,
    alarms_of_found as alarms_of_found,
    is_mismatch as is_mismatch,
    sensor_key as sensor_key,
)
from ._fields import (
    FIELDS as FIELDS,
    Field as Field,
    Kind as Kind,
    Leaf as Leaf,
    Shape as Shape,
    StatusValue as StatusValue,
    as_json as as_json,
    leaves_of as leaves_of,
    shape_of as shape_of,
)
from ._headline import (
    Headlines as Headlines,
)
from ._metrics import (
    MetricsServer as MetricsServer,
)
from ._requests import (
    ASKS as ASKS,
    Ask as Ask,
)
from ._server import (
    NAMESPACE as NAMESPACE,
    StatusServer as StatusServer,
)
from ._status import (
    AgedOffset as AgedOffset,
    Alarm as Alarm,
    OutputFacts as OutputFacts,
    OutputOffsets as OutputOffsets,
    OutputTouches as OutputTouches,
    RuntimeStatus as RuntimeStatus,
    facts_of as facts_of,
    state_message as state_message,
)
