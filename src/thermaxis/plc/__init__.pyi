from ._settings import (
    PlcSettings as PlcSettings,
    export_settings as export_settings,
)
from ._texts import (
    remark_of as remark_of,
)
from .blocks import (
    LineSettings as LineSettings,
    build_line_program as build_line_program,
    build_program as build_program,
)
from .guide import (
    Difference as Difference,
    GuideFacts as GuideFacts,
    ReportFacts as ReportFacts,
    Target as Target,
    guide_text as guide_text,
    report_of as report_of,
    report_text as report_text,
)
from .printers import (
    CText as CText,
    SclCpu as SclCpu,
    StFlavour as StFlavour,
    print_c as print_c,
    print_scl as print_scl,
    print_st as print_st,
)
from .tree import (
    Block as Block,
    PlcNames as PlcNames,
    Program as Program,
    ProgramError as ProgramError,
    check_program as check_program,
    with_own_names as with_own_names,
)
from .vectors import (
    BlockInstance as BlockInstance,
    CallSequence as CallSequence,
    PlcInputs as PlcInputs,
    PlcOutputs as PlcOutputs,
    PlcStep as PlcStep,
    Vectors as Vectors,
    scenario_steps as scenario_steps,
    vectors_of as vectors_of,
)
