from ._commissioning import (
    DEFAULT_STEP_UM as DEFAULT_STEP_UM,
    CommissioningPlan as CommissioningPlan,
    Measure as Measure,
    StepProof as StepProof,
    by_touches as by_touches,
    prove_step as prove_step,
)
from ._self_test import (
    reasons_against as reasons_against,
    self_test as self_test,
)
