"""The adjacent-difference method of Stejskal et al. 2017, equations (4) to (6)."""

from dataclasses import dataclass
from typing import TypeAlias, final

import numpy as np
from numpy.typing import NDArray

from thermaxis.codes import Message, Place
from thermaxis.errors import DataError
from thermaxis.positioning.run import (
    APPROACHES,
    BACKWARD,
    FORWARD,
    FloatArray,
    PositioningTest,
    freeze_arrays,
    require_shape,
)
from thermaxis.positioning.standard._iso230_2 import mean_and_s
from thermaxis.positioning.standard._spread_anomaly import (
    SpreadAnomaly,
    find_spread_anomalies,
    spread_can_be_tested,
)

BoolArray: TypeAlias = NDArray[np.bool_]

STUDENT_CYCLES = 30
"""From this number of cycles on the paper uses 2 in place of Student's factor. [1]"""
COVERAGE_LEVEL = 0.9545
"""Two-sided probability within two standard deviations of a normal distribution. [1]"""
OUTLYING = 6.0
"""A difference this many robust standard deviations from the median is an outlier. [1]"""
REFERENCE_TIME_S = 7200.0
"""The paper takes its reference after at least two hours of measuring. [s]"""
FALSE_ALARM_LEVEL = 0.05
"""Largest probability that a run without anomaly gets one named. [1]"""


@final
@dataclass(frozen=True, slots=True, eq=False)
class AdjacentDifferenceApproach:
    """Adjacent differences of one approach; pair i holds positions i and i + 1 (from 1)."""

    mean_difference: FloatArray
    """Mean mutual deviation, mean over the cycles of x_i - x_(i+1), equation (4), (m - 1,).
    [µm or arcsec]"""
    standard_uncertainty: FloatArray
    """Equation (6): standard uncertainty of that mean, divisor n (n - 1), (m - 1,). The paper
    calls it a sample standard deviation. [µm or arcsec]"""
    standard_deviation: FloatArray
    """Sample standard deviation of the difference, divisor n - 1, (m - 1,). [µm or arcsec]"""
    s_ratio: FloatArray
    """s of the standard at position i + 1 over the standard deviation of pair (i, i + 1),
    (m - 1,); NaN where the latter is zero but for round-off. The paper prints 3.09 at its
    position 4. [1]"""
    cycles: FloatArray
    """Number of cycles with both readings, per pair, (m - 1,). [1]"""
    chart: FloatArray
    """Deviation chart by progressive addition from the reference, (m,). [µm or arcsec]"""
    bound: FloatArray
    """Half width of the bounds of the chart, (m,): the factor times the standard uncertainty of
    the pair before; position 1 as position 2. [µm or arcsec]"""
    anomalies: tuple[SpreadAnomaly, ...]
    """Positions whose spread stands out."""
    anomalies_tested: bool
    """Whether there were enough positions and complete cycles to look for them."""

    def __post_init__(self) -> None:
        freeze_arrays(self)


@final
@dataclass(frozen=True, slots=True, eq=False)
class AdjacentDifferenceResult:
    """Result of the adjacent-difference method for both approaches."""

    target: FloatArray
    """Target positions, (m,). [mm or deg]"""
    reference_cycle: int
    """Cycle whose reading anchors the deviation chart, from 1. [1]"""
    reference_position: int
    """Position whose reading anchors the deviation chart, from 1. [1]"""
    student_factor: float | None
    """Factor of the bounds: Student's t at 95.45 % below 30 cycles, else 2; None for one. [1]"""
    forward: AdjacentDifferenceApproach | None
    """Forward approach; None if it was not measured."""
    backward: AdjacentDifferenceApproach | None
    """Backward approach; None if it was not measured."""
    warnings: tuple[Message, ...]
    """What the reader of the result must know."""

    def __post_init__(self) -> None:
        freeze_arrays(self)

    @property
    def approaches(
        self,
    ) -> tuple[AdjacentDifferenceApproach | None, AdjacentDifferenceApproach | None]:
        """Both approaches, forward first."""
        return self.forward, self.backward

    @property
    def measured(self) -> list[tuple[int, AdjacentDifferenceApproach]]:
        """Those that were measured, each with its index."""
        return [(a, found) for a, found in enumerate(self.approaches) if found is not None]


def student_factor(cycles: int) -> float | None:
    """Return the factor from a standard uncertainty to the bounds of the deviation chart.

    Two-sided t for 95.45 % with n - 1 degrees of freedom for n < 30, 2 from 30 cycles on, None for
    fewer than two. [1]

    References
    ----------
    Stejskal et al. 2017 (30 repetitions, else Student's distribution); the level is that of
    k = 2.
    """
    if cycles < 2:
        return None
    if cycles >= STUDENT_CYCLES:
        return 2.0
    from scipy.special import stdtrit  # noqa: PLC0415  it takes longer to import than a whole run

    return float(stdtrit(cycles - 1, 0.5 + COVERAGE_LEVEL / 2.0))


def adjacent_differences(deviation: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return mean, standard uncertainty and number of the differences of neighbours, (m - 1,) each.

    `deviation` is that of one approach, (m, n), NaN where a reading is missing; the uncertainty is
    NaN for fewer than two cycles. [µm or arcsec]

    References
    ----------
    Stejskal et al. 2017, equations (4) and (6).
    """
    require_shape(deviation, "(m, n)", Place(key="deviation"), fits=deviation.ndim == 2)
    difference = deviation[:-1] - deviation[1:]
    mean, s = mean_and_s(difference[..., None])
    n = np.asarray(np.sum(~np.isnan(difference), axis=1), dtype=np.float64)
    return mean[:, 0], s[:, 0] / np.sqrt(np.maximum(n, 1.0)), n


def _anchored(mean_difference: FloatArray, reference: int, anchor: float) -> FloatArray:
    """Add the mean mutual deviations progressively to the anchor at the reference position."""
    chart = np.empty(mean_difference.size + 1)
    chart[reference] = anchor
    chart[reference + 1 :] = anchor - np.cumsum(mean_difference[reference:])
    chart[:reference] = anchor + np.cumsum(mean_difference[:reference][::-1])[::-1]
    return chart


def _evaluate_approach(
    test: PositioningTest,
    approach: int,
    *,
    reference: tuple[int, int],
    factor: float | None,
    level: float,
) -> AdjacentDifferenceApproach:
    deviation = test.deviation[:, :, approach]
    mean_difference, uncertainty, n = adjacent_differences(deviation)
    standard_deviation = uncertainty * np.sqrt(n)
    _, s = mean_and_s(deviation[..., None])
    # below the round-off of the readings an s is zero, and nothing is a multiple of it
    size = float(np.max(np.abs(deviation), initial=0.0, where=np.isfinite(deviation)))
    spread = standard_deviation > 16.0 * np.finfo(np.float64).eps * size
    s_ratio = np.full(standard_deviation.size, np.nan)
    np.divide(s[1:, 0], standard_deviation, out=s_ratio, where=spread)
    position, cycle = reference
    pair_before = np.concatenate((uncertainty[:1], uncertainty))
    bound = np.full(pair_before.size, np.nan) if factor is None else factor * pair_before
    return AdjacentDifferenceApproach(
        mean_difference=mean_difference,
        standard_uncertainty=uncertainty,
        standard_deviation=standard_deviation,
        s_ratio=s_ratio,
        cycles=n,
        chart=_anchored(mean_difference, position, float(deviation[position, cycle])),
        bound=bound,
        anomalies=find_spread_anomalies(test.target, deviation, level=level),
        anomalies_tested=spread_can_be_tested(deviation),
    )


def _first_cycle_from(test: PositioningTest, time_s: float, usable: BoolArray) -> int | None:
    """Return the first usable cycle that starts at or after a time."""
    if test.time_s is None:
        return None
    start = np.min(np.where(np.isnan(test.deviation), np.inf, test.time_s), axis=(0, 2))
    late = np.flatnonzero((start >= time_s) & np.isfinite(start) & usable)
    return int(late[0]) if late.size else None


def _choose_reference_cycle(
    test: PositioningTest, position: int, cycle: int | None, time_s: float | None
) -> int:
    # the reference position must have been read in every approach
    usable = ~np.any(np.isnan(test.deviation[position][:, test.approaches]), axis=1)
    if cycle is not None:
        if not 1 <= cycle <= test.cycles:
            raise DataError(
                "outside_range", value=cycle, least=1, most=test.cycles, key="reference cycle"
            )
        if not usable[cycle - 1]:
            raise DataError(
                "cycle_without_reference", cycle=cycle, position=position + 1, key="reference cycle"
            )
        return cycle - 1
    if time_s is not None:
        if test.time_s is None:
            raise DataError("readings_without_times", key="reference time")
        chosen, end_s = _first_cycle_from(test, time_s, usable), float(np.nanmax(test.time_s))
        if chosen is None and time_s <= end_s and np.any(usable):
            return int(np.flatnonzero(usable)[-1])
        if chosen is None:
            raise DataError(
                "no_cycle_after",
                position=position + 1,
                time_h=time_s / 3600.0,
                duration_h=end_s / 3600.0,
                key="reference time",
            )
        return chosen
    after_two_hours = _first_cycle_from(test, REFERENCE_TIME_S, usable)
    if after_two_hours is not None:
        return after_two_hours
    if not np.any(usable):
        raise DataError(
            "reference_never_read", position=position + 1, key="reference of the deviation chart"
        )
    return int(np.flatnonzero(usable)[0])


def _warning_of_anchor(
    test: PositioningTest, approach: int, position: int, cycle: int
) -> list[Message]:
    """Warn where the reading that anchors the chart is itself far out."""
    deviation = test.deviation[:, :, approach]
    neighbour = position + 1 if position + 1 < deviation.shape[0] else position - 1
    difference = deviation[position] - deviation[neighbour]
    known = difference[~np.isnan(difference)]
    if known.size < 5 or np.isnan(difference[cycle]):
        return []
    centre = float(np.median(known))
    spread = 1.4826 * float(np.median(np.abs(known - centre)))
    if abs(float(difference[cycle]) - centre) <= OUTLYING * spread:
        return []
    values = {"position": position + 1, "approach": APPROACHES[approach], "cycle": cycle + 1}
    return [Message("warning-anchor_outlying", values)]


def _warnings(
    test: PositioningTest, pairs: list[tuple[int, int, int]], factor: float | None
) -> list[Message]:
    """Warn of pairs without spread, and of bounds that few cycles widen."""
    if test.cycles < 2:
        return [Message("warning-one_cycle")]
    warnings = [
        Message("warning-pair_without_spread", _pair(approach, i))
        for n, approach, i in pairs
        if n == 1
    ]
    if factor is None:
        return [*warnings, Message("warning-no_pair_twice")]
    fewest, approach, i = min(pair for pair in pairs if pair[0] > 1)
    values = {"cycles": fewest, "enough": STUDENT_CYCLES, "factor": factor}
    if fewest == test.cycles < STUDENT_CYCLES:
        warnings.append(Message("warning-student_factor", values))
    elif fewest < STUDENT_CYCLES:
        values |= _pair(approach, i)
        warnings.append(Message("warning-student_factor_of_pair", values))
    return warnings


def _pair(approach: int, i: int) -> dict[str, str | int]:
    return {"position": i, "next": i + 1, "approach": APPROACHES[approach]}


def _complete_cycles_of_pairs(test: PositioningTest) -> list[tuple[int, int, int]]:
    """Return how many cycles have both readings of each pair, its approach and first position."""
    counts: list[tuple[int, int, int]] = []
    for approach in test.approaches:
        read = ~np.isnan(test.deviation[:, :, approach])
        complete = np.sum(read[:-1] & read[1:], axis=1).tolist()
        for i, n in enumerate(complete, start=1):
            if n == 0:
                raise DataError("no_pair", approach=APPROACHES[approach], position=i, next=i + 1)
            counts.append((n, approach, i))
    return counts


def evaluate_adjacent_difference(
    test: PositioningTest,
    *,
    reference_cycle: int | None = None,
    reference_time_s: float | None = None,
    reference_position: int = 1,
) -> AdjacentDifferenceResult:
    """Evaluate a run by the differences of adjacent positions.

    Parameters
    ----------
    test : PositioningTest
        The measured run, at least two targets.
    reference_cycle : int, optional
        Cycle whose reading anchors the deviation chart, from 1. Default: the first cycle that
        starts two hours or more after the first reading, else the first. [1]
    reference_time_s : float, optional
        Take the first cycle that starts at or after this time instead; the last cycle, where
        the run ends before another one starts. [s]
    reference_position : int
        Position whose reading anchors the chart, from 1. Default 1, as in the paper. [1]

    Returns
    -------
    AdjacentDifferenceResult
        For every measured approach. A cycle counts for a pair when both readings exist.

    Raises
    ------
    DataError
        If the run has one target only, no pair has a complete cycle, the reference cycle,
        time or position does not exist, or both cycle and time are given.

    Notes
    -----
    The chart of means telescopes: relative to the reference it is the classical mean curve.
    The method's gain is in the spread, from which drift slower than two stops drops out.
    Figures of this method are not results of ISO 230-2.

    The anomaly test names at most 5 % of the runs in which every position scatters alike and
    normally; the level is shared equally between the measured approaches.

    References
    ----------
    Stejskal et al. 2017, equations (4), (5), (6), figures 10 to 13.
    """
    m = test.target.size
    if m < 2:
        raise DataError("too_few_targets", targets=m, needed=2)
    if not 1 <= reference_position <= m:
        raise DataError(
            "outside_range", value=reference_position, least=1, most=m, key="reference position"
        )
    if reference_cycle is not None and reference_time_s is not None:
        raise DataError("only_one_of", names=("reference cycle", "reference time"), key="reference")
    position = reference_position - 1
    cycle = _choose_reference_cycle(test, position, reference_cycle, reference_time_s)
    pairs = _complete_cycles_of_pairs(test)
    factor = student_factor(min((n for n, *_ in pairs if n > 1), default=1))
    level = FALSE_ALARM_LEVEL / len(test.approaches)
    far_out = [
        warning
        for approach in test.approaches
        for warning in _warning_of_anchor(test, approach, position, cycle)
    ]
    found = {
        approach: _evaluate_approach(
            test, approach, reference=(position, cycle), factor=factor, level=level
        )
        for approach in test.approaches
    }
    return AdjacentDifferenceResult(
        target=test.target,
        reference_cycle=cycle + 1,
        reference_position=reference_position,
        student_factor=factor,
        forward=found.get(FORWARD),
        backward=found.get(BACKWARD),
        warnings=(*_warnings(test, pairs, factor), *far_out),
    )
