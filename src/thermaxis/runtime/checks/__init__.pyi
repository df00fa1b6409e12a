from ._commissioning import (
    CommissioningPlan as CommissioningPlan,
    Measure as Measure,
    StepProof as StepProof,
    prove_step as prove_step,
)
from ._self_test import (
    reasons_against as reasons_against,
    self_test as self_test,
)
