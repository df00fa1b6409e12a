"""Evaluate positioning runs: numbers in, frozen results out."""

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

__all__ = [
    "APPROACHES",
    "BACKWARD",
    "FIGURE_KEYS",
    "FORWARD",
    "PAPER_RATIO",
    "UNVERIFIED",
    "AdjacentDifferenceApproach",
    "AdjacentDifferenceResult",
    "Cycle",
    "DifferenceMonteCarlo",
    "Edition",
    "FiguresAgainstCycles",
    "FloatArray",
    "Iso230_2Figures",
    "Iso230_2Result",
    "Iso230_2_1988Result",
    "PositioningTest",
    "RatioEstimate",
    "SpreadAnomaly",
    "StartEnd",
    "TimeSource",
    "Vdi3441Result",
    "adjacent_differences",
    "check_test_conditions",
    "evaluate_adjacent_difference",
    "evaluate_against_cycles",
    "evaluate_iso230_2",
    "evaluate_iso230_2_1988",
    "evaluate_vdi_dgq_3441",
    "find_spread_anomalies",
    "is_single_run_axis",
    "iso230_2_figures",
    "montecarlo_difference",
    "student_factor",
]
