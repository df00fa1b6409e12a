from ._c import (
    CText as CText,
    print_c as print_c,
)
from ._scl import (
    SclCpu as SclCpu,
    print_scl as print_scl,
)
from ._st import (
    StFlavour as StFlavour,
    print_st as print_st,
)
