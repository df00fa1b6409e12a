from ._block import Block as Block
from ._fmu import (
    FMI_VERSIONS as FMI_VERSIONS,
    fmu_files as fmu_files,
)
from ._interface import (
    NEVER_OUTCOMES as NEVER_OUTCOMES,
    NEVER_QUALITIES as NEVER_QUALITIES,
    Interface as Interface,
    Kind as Kind,
    Variable as Variable,
    interface_of as interface_of,
)
from ._library import (
    LIBRARY as LIBRARY,
    LIBRARY_VERSION as LIBRARY_VERSION,
    SINUMERIK as SINUMERIK,
    TOUCH as TOUCH,
    SclCpu as SclCpu,
    StFlavour as StFlavour,
    c_library as c_library,
    scl_text as scl_text,
    sinumerik_library as sinumerik_library,
    st_library as st_library,
)
from ._line import (
    LineSettings as LineSettings,
    at_position as at_position,
    line_bounds as line_bounds,
    require_apart as require_apart,
)
from ._names import (
    PlcNames as PlcNames,
    remark_text as remark_text,
)
from ._plcopen import plcopen_xml as plcopen_xml
from ._settings import (
    PlcSettings as PlcSettings,
    export_settings as export_settings,
)
from ._template import (
    remark_of as remark_of,
)
from ._warnings import (
    restart_warning as restart_warning,
    setting_warnings as setting_warnings,
)
from .guide import (
    GuideFacts as GuideFacts,
    ReportFacts as ReportFacts,
    Target as Target,
    guide_text as guide_text,
    report_of as report_of,
    report_text as report_text,
)
from .vectors import (
    TOLERANCE_UM as TOLERANCE_UM,
    CallSequence as CallSequence,
    CycleBlock as CycleBlock,
    PlcStep as PlcStep,
    SelfTest as SelfTest,
    Vectors as Vectors,
    self_test_of as self_test_of,
    vectors_of as vectors_of,
)
