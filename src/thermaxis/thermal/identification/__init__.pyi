from ._clocks import (
    with_one_clock as with_one_clock,
)
from ._far_touches import (
    without_far_touches as without_far_touches,
)
from ._figures import (
    NOT_FIT as NOT_FIT,
    SIMPLE as SIMPLE,
    simple_model as simple_model,
)
from ._identification import (
    identify as identify,
    identify_joint as identify_joint,
)
from ._joint_gains import (
    JointGains as JointGains,
    joint_gains as joint_gains,
)
from ._records import (
    Records as Records,
    compensation_model as compensation_model,
    records_of as records_of,
    usual_step_of as usual_step_of,
)
from ._result import (
    VERDICTS as VERDICTS,
    HeldOut as HeldOut,
    Identification as Identification,
    IdentifiedOutput as IdentifiedOutput,
    Method as Method,
    Regimes as Regimes,
)
