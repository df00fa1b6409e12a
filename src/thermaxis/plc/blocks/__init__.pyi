from ._build import (
    build_program as build_program,
)
from ._head import (
    NEVER_OUTCOMES as NEVER_OUTCOMES,
    NEVER_QUALITIES as NEVER_QUALITIES,
    head_of as head_of,
    wrapped as wrapped,
)
from ._library import (
    number_of as number_of,
)
from ._tempcomp import (
    LARGEST_READ as LARGEST_READ,
    UNREAD_UM as UNREAD_UM,
    LineSettings as LineSettings,
    at_position as at_position,
    bound_texts as bound_texts,
    build_line_program as build_line_program,
    require_apart as require_apart,
)
from ._warnings import (
    restart_warning as restart_warning,
    setting_warnings as setting_warnings,
)
