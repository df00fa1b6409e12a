"""Evaluate positioning runs: numbers in, frozen results out."""

from importlib import import_module
from typing import TYPE_CHECKING

from thermaxis.positioning._adjacent_difference import (
    AdjacentDifferenceApproach,
    AdjacentDifferenceResult,
    adjacent_differences,
    evaluate_adjacent_difference,
    student_factor,
)
from thermaxis.positioning._against_cycles import FiguresAgainstCycles, evaluate_against_cycles
from thermaxis.positioning._iso230_2 import (
    FIGURE_KEYS,
    Edition,
    Iso230_2Figures,
    Iso230_2Result,
    evaluate_iso230_2,
    figures_by_key,
    is_single_run_axis,
    iso230_2_figures,
)
from thermaxis.positioning._montecarlo import (
    PAPER_RATIO,
    DifferenceMonteCarlo,
    RatioEstimate,
    montecarlo_difference,
)
from thermaxis.positioning._other_standards import (
    UNVERIFIED,
    Iso230_2_1988Result,
    Vdi3441Result,
    evaluate_iso230_2_1988,
    evaluate_vdi_dgq_3441,
)
from thermaxis.positioning._positioning_test import (
    APPROACHES,
    BACKWARD,
    FORWARD,
    Cycle,
    FloatArray,
    PositioningTest,
    StartEnd,
    TimeSource,
)
from thermaxis.positioning._spread_anomaly import SpreadAnomaly, find_spread_anomalies
from thermaxis.positioning._test_conditions import check_test_conditions

if TYPE_CHECKING:
    from thermaxis.positioning._diagnosis import (
        Finding,
        diagnose,
    )
    from thermaxis.positioning._drift import (
        DriftModel,
        DriftResult,
        Outlier,
        evaluate_drift,
        evaluate_drift_at,
    )
    from thermaxis.positioning._plan import (
        Duration,
        TargetChoice,
        TestPlan,
        Visits,
        check_against_plan,
        check_plan,
        choose_targets,
        evaluate_duration,
        order_of_visits,
        periodic_error_visibility,
        planned_test,
    )
    from thermaxis.positioning._plan_uncertainty import (
        FEWEST_CYCLES,
        LEVEL_KEY,
        LONGEST_RUN_S,
        ExpectedFigure,
        ExpectedUncertainty,
        RunAssumptions,
        ShortestPlan,
        SimulatedUncertainty,
        expected_uncertainty,
        shortest_plan,
        simulate_uncertainty,
        why_nothing_is_expected,
    )
    from thermaxis.positioning._uncertainty import (
        FigureUncertainty,
        UncertaintyBudget,
        UncertaintyResult,
        UncertaintyTerm,
        evaluate_uncertainty,
    )

__all__ = [
    "APPROACHES",
    "BACKWARD",
    "FEWEST_CYCLES",
    "FIGURE_KEYS",
    "FORWARD",
    "LEVEL_KEY",
    "LONGEST_RUN_S",
    "PAPER_RATIO",
    "UNVERIFIED",
    "AdjacentDifferenceApproach",
    "AdjacentDifferenceResult",
    "Cycle",
    "DifferenceMonteCarlo",
    "DriftModel",
    "DriftResult",
    "Duration",
    "Edition",
    "ExpectedFigure",
    "ExpectedUncertainty",
    "FigureUncertainty",
    "FiguresAgainstCycles",
    "Finding",
    "FloatArray",
    "Iso230_2Figures",
    "Iso230_2Result",
    "Iso230_2_1988Result",
    "Outlier",
    "PositioningTest",
    "RatioEstimate",
    "RunAssumptions",
    "ShortestPlan",
    "SimulatedUncertainty",
    "SpreadAnomaly",
    "StartEnd",
    "TargetChoice",
    "TestPlan",
    "TimeSource",
    "UncertaintyBudget",
    "UncertaintyResult",
    "UncertaintyTerm",
    "Vdi3441Result",
    "Visits",
    "adjacent_differences",
    "check_against_plan",
    "check_plan",
    "check_test_conditions",
    "choose_targets",
    "diagnose",
    "evaluate_adjacent_difference",
    "evaluate_against_cycles",
    "evaluate_drift",
    "evaluate_drift_at",
    "evaluate_duration",
    "evaluate_iso230_2",
    "evaluate_iso230_2_1988",
    "evaluate_uncertainty",
    "evaluate_vdi_dgq_3441",
    "expected_uncertainty",
    "figures_by_key",
    "find_spread_anomalies",
    "is_single_run_axis",
    "iso230_2_figures",
    "montecarlo_difference",
    "order_of_visits",
    "periodic_error_visibility",
    "planned_test",
    "shortest_plan",
    "simulate_uncertainty",
    "student_factor",
    "why_nothing_is_expected",
]

_MODULES = {
    "FEWEST_CYCLES": "_plan_uncertainty",
    "LEVEL_KEY": "_plan_uncertainty",
    "LONGEST_RUN_S": "_plan_uncertainty",
    "ExpectedFigure": "_plan_uncertainty",
    "ExpectedUncertainty": "_plan_uncertainty",
    "RunAssumptions": "_plan_uncertainty",
    "ShortestPlan": "_plan_uncertainty",
    "SimulatedUncertainty": "_plan_uncertainty",
    "expected_uncertainty": "_plan_uncertainty",
    "shortest_plan": "_plan_uncertainty",
    "simulate_uncertainty": "_plan_uncertainty",
    "why_nothing_is_expected": "_plan_uncertainty",
    "DriftModel": "_drift",
    "DriftResult": "_drift",
    "Outlier": "_drift",
    "evaluate_drift": "_drift",
    "evaluate_drift_at": "_drift",
    "FigureUncertainty": "_uncertainty",
    "UncertaintyBudget": "_uncertainty",
    "UncertaintyResult": "_uncertainty",
    "UncertaintyTerm": "_uncertainty",
    "evaluate_uncertainty": "_uncertainty",
    "Finding": "_diagnosis",
    "diagnose": "_diagnosis",
    "Duration": "_plan",
    "TargetChoice": "_plan",
    "TestPlan": "_plan",
    "Visits": "_plan",
    "check_against_plan": "_plan",
    "check_plan": "_plan",
    "choose_targets": "_plan",
    "evaluate_duration": "_plan",
    "order_of_visits": "_plan",
    "periodic_error_visibility": "_plan",
    "planned_test": "_plan",
}


def __getattr__(name: str) -> object:
    """Import what needs scipy when it is first asked for: scipy takes longer than a whole run."""
    if name not in _MODULES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_MODULES[name]}"), name)
