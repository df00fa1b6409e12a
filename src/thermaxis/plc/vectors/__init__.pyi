from ._call_sequence import (
    MOST_CALLS as MOST_CALLS,
    CallSequence as CallSequence,
)
from ._phases import (
    ODD as ODD,
)
from ._reference import (
    CycleBlock as CycleBlock,
    PlcStep as PlcStep,
)
from ._self_test import (
    SelfTest as SelfTest,
    self_test_of as self_test_of,
)
from ._vectors import (
    LINE_LIMITED as LINE_LIMITED,
    TOLERANCE_UM as TOLERANCE_UM,
    Vectors as Vectors,
    vectors_of as vectors_of,
)
