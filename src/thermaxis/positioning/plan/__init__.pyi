from ._moves import (
    Move as Move,
    MoveBlock as MoveBlock,
    motion_duration_s as motion_duration_s,
    moves_of_plan as moves_of_plan,
)
from ._plan import (
    Duration as Duration,
    TargetChoice as TargetChoice,
    TestPlan as TestPlan,
    Visits as Visits,
    check_against_plan as check_against_plan,
    check_plan as check_plan,
    choose_targets as choose_targets,
    evaluate_duration as evaluate_duration,
    order_of_visits as order_of_visits,
    periodic_error_visibility as periodic_error_visibility,
    planned_test as planned_test,
    visits_of as visits_of,
)
from ._uncertainty import (
    FEWEST_CYCLES as FEWEST_CYCLES,
    LEVEL_KEY as LEVEL_KEY,
    LONGEST_RUN_S as LONGEST_RUN_S,
    ExpectedFigure as ExpectedFigure,
    ExpectedUncertainty as ExpectedUncertainty,
    RunAssumptions as RunAssumptions,
    ShortestPlan as ShortestPlan,
    SimulatedUncertainty as SimulatedUncertainty,
    expected_uncertainty as expected_uncertainty,
    shortest_plan as shortest_plan,
    simulate_uncertainty as simulate_uncertainty,
    why_nothing_is_expected as why_nothing_is_expected,
)
