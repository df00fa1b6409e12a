from ._adjacent_difference import (
    AdjacentDifferenceApproach as AdjacentDifferenceApproach,
    AdjacentDifferenceResult as AdjacentDifferenceResult,
    adjacent_differences as adjacent_differences,
    evaluate_adjacent_difference as evaluate_adjacent_difference,
    student_factor as student_factor,
)
from ._against_cycles import (
    FiguresAgainstCycles as FiguresAgainstCycles,
    evaluate_against_cycles as evaluate_against_cycles,
)
from ._iso230_2 import (
    FIGURE_KEYS as FIGURE_KEYS,
    Edition as Edition,
    Iso230_2Figures as Iso230_2Figures,
    Iso230_2Result as Iso230_2Result,
    arrays_by_key as arrays_by_key,
    evaluate_iso230_2 as evaluate_iso230_2,
    figures_by_key as figures_by_key,
    figures_of as figures_of,
    is_single_run_axis as is_single_run_axis,
    iso230_2_figures as iso230_2_figures,
    mean_and_s as mean_and_s,
    require_readings as require_readings,
)
from ._montecarlo import (
    PAPER_RATIO as PAPER_RATIO,
    DifferenceMonteCarlo as DifferenceMonteCarlo,
    RatioEstimate as RatioEstimate,
    montecarlo_difference as montecarlo_difference,
)
from ._other_standards import (
    UNVERIFIED as UNVERIFIED,
    Iso230_2_1988Result as Iso230_2_1988Result,
    Vdi3441Result as Vdi3441Result,
    evaluate_iso230_2_1988 as evaluate_iso230_2_1988,
    evaluate_vdi_dgq_3441 as evaluate_vdi_dgq_3441,
)
from ._spread_anomaly import (
    MOST_POSITIONS as MOST_POSITIONS,
    SMALLEST_RATIO as SMALLEST_RATIO,
    SpreadAnomaly as SpreadAnomaly,
    find_spread_anomalies as find_spread_anomalies,
    local_deviation_contrasts as local_deviation_contrasts,
)
from ._test_conditions import (
    RUNS_PER_DIRECTION as RUNS_PER_DIRECTION,
    check_test_conditions as check_test_conditions,
    missing_readings as missing_readings,
)
