from ._axis import (
    OffsetRules as OffsetRules,
)
from ._faults import (
    Fault as Fault,
    FaultKind as FaultKind,
    parse_fault as parse_fault,
    parse_seconds as parse_seconds,
)
from ._hall import (
    HallSettings as HallSettings,
)
from ._log import (
    LOG_COLUMNS as LOG_COLUMNS,
    check_log_name as check_log_name,
    log_lathe as log_lathe,
    write_lathe_log as write_lathe_log,
)
from ._machine import (
    DEFAULT_SCENARIO as DEFAULT_SCENARIO,
    LatheSettings as LatheSettings,
    VirtualLathe as VirtualLathe,
)
from ._physics import (
    POSITIONS as POSITIONS,
    LatheDuty as LatheDuty,
)
from ._ports import (
    INTERLOCKS as INTERLOCKS,
    LatheSink as LatheSink,
    LatheSource as LatheSource,
    lathe_names as lathe_names,
)
from ._scenarios import (
    SCENARIOS as SCENARIOS,
    Scenario as Scenario,
    Stage as Stage,
)
from ._server import (
    LatheServer as LatheServer,
    LatheServerSettings as LatheServerSettings,
)
from ._signals import (
    FAULTY as FAULTY,
    PROBES as PROBES,
    SENSORS as SENSORS,
    SIGNALS as SIGNALS,
    TRUE as TRUE,
    UNCORRECTED as UNCORRECTED,
    LatheReading as LatheReading,
    SensorNoise as SensorNoise,
    Signal as Signal,
)
from ._tests import (
    LATHE_SEED as LATHE_SEED,
    LATHE_TESTS as LATHE_TESTS,
    generate_lathe_test as generate_lathe_test,
)
