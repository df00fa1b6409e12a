from ._loop import (
    SHORTEST_WAIT_S as SHORTEST_WAIT_S,
    UNREAD_AFTER_S as UNREAD_AFTER_S,
    CompensationLoop as CompensationLoop,
)
from ._proposals import (
    PROPOSAL_SUFFIX as PROPOSAL_SUFFIX,
    choosable_name as choosable_name,
    model_folder as model_folder,
    model_in_force as model_in_force,
    write_proposal as write_proposal,
)
from ._saved_state import (
    SavedState as SavedState,
    StateFile as StateFile,
)
from ._self_test import (
    SELF_TEST as SELF_TEST,
    TESTED_EVERY_S as TESTED_EVERY_S,
)
from ._settings import (
    AtStop as AtStop,
    LoopSettings as LoopSettings,
    Models as Models,
    Ports as Ports,
)
from ._systemd import (
    SignOfLife as SignOfLife,
)
from ._touches import Touches as Touches
