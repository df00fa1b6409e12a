"""Whether a run was measured as the standard asks: warnings in words, never a refusal."""

import numpy as np

from thermaxis.positioning.run import (
    APPROACHES,
    Cycle,
    FloatArray,
    PositioningTest,
)
from thermaxis.positioning.standard._iso230_2 import LONG_AXIS_MM, is_single_run_axis
from thermaxis.quantities import AxisKind

RUNS_PER_DIRECTION = 5
"""Runs in each direction on axes up to 2000 mm; from a secondary source. [1]"""
MINIMUM_TARGETS = 5
TARGETS_PER_METRE = 5
"""On axes up to 2000 mm; both from a secondary source. [1]"""
LONG_AXIS_INTERVAL_MM = 250.0
ROTARY_TARGETS = ((90.0, 3), (180.0, 5), (360.0, 8))
"""Smallest number of targets up to a measured angle [deg]; from memory, to be checked."""


def check_test_conditions(test: PositioningTest) -> tuple[str, ...]:
    """Compare a run with the test conditions of ISO 230-2.

    Parameters
    ----------
    test : PositioningTest
        The measured run.

    Returns
    -------
    tuple of str
        One sentence for each condition that the run does not meet. Empty if it meets all.

    References
    ----------
    ISO 230-2:2014, test conditions, from secondary sources (linear axes up to 2000 mm, interval
    on longer axes) and from memory (rotary axes); GOST ISO 230-2-2016, clause 6.2 (axes over
    2000 mm); equation (1) of Stejskal et al. 2017 for the random part of the targets.
    """
    return (
        *_number_of_targets(test),
        *_number_of_cycles(test),
        *_spacing(test),
        *_cycle_kind(test),
        *_missing_readings(test),
        *_travel(test),
    )


def _required_targets(test: PositioningTest) -> tuple[int, str]:
    length = test.measured_length
    if test.kind is AxisKind.ROTARY:
        for angle, count in ROTARY_TARGETS:
            if length <= angle:
                return count, f"a rotary axis measured over {length:g}° (rule from memory)"
        turns = int(np.ceil(length / 360.0))
        return 8 * turns, f"a rotary axis measured over {length:g}° (rule from memory)"
    if length > LONG_AXIS_MM:
        return 0, ""
    per_length = int(np.ceil(TARGETS_PER_METRE * length / 1000.0))
    return max(MINIMUM_TARGETS, per_length), f"a linear axis measured over {length:g} mm"


def _number_of_targets(test: PositioningTest) -> list[str]:
    required, axis = _required_targets(test)
    if test.target.size >= required:
        return []
    return [
        f"{test.target.size} targets are fewer than the {required} that ISO 230-2 asks of {axis}"
    ]


def _number_of_cycles(test: PositioningTest) -> list[str]:
    if is_single_run_axis(test):
        return []
    asked = f"the {RUNS_PER_DIRECTION} that ISO 230-2 asks for"
    readings = test.readings[:, test.approaches]
    if float(np.ptp(readings)) == 0.0 and float(readings[0, 0]) < RUNS_PER_DIRECTION:
        runs = int(readings[0, 0])
        return [f"{runs} cycles, {runs} readings of every target, are fewer than {asked}"]
    warnings: list[str] = []
    for approach in test.approaches:
        count = test.readings[:, approach]
        fewest = int(np.min(count))
        if fewest < RUNS_PER_DIRECTION:
            target = int(np.argmin(count)) + 1
            short = f"target {target} has {fewest} readings {APPROACHES[approach]}"
            warnings.append(f"{short}, fewer than {asked}")
    if not warnings and test.cycles > RUNS_PER_DIRECTION:
        longer = f"{test.cycles} cycles are more than {asked}: the figures follow its formulas,"
        warnings.append(f"{longer} but on a longer test, in which the machine warms up more")
    return warnings


def _spacing(test: PositioningTest) -> list[str]:
    interval = np.diff(test.target)
    if interval.size < 2:
        return []
    unit = test.kind.units.position
    warnings: list[str] = []
    mean = float(np.mean(interval))
    if float(np.ptp(interval)) < 1e-3 * mean:
        warnings.append(
            f"the targets are equidistant ({mean:g} {unit}), without the random part of"
            " equation (1): periodic errors of the axis may stay hidden"
        )
    largest = float(np.max(interval))
    if is_single_run_axis(test) and largest > LONG_AXIS_INTERVAL_MM:
        warnings.append(
            f"the largest interval between targets is {largest:g} mm; ISO 230-2 asks for at most"
            f" {LONG_AXIS_INTERVAL_MM:g} mm on an axis over {LONG_AXIS_MM:g} mm"
        )
    elif largest > 2.0 * mean:
        i = int(np.argmax(interval))
        warnings.append(
            f"the interval after target {i + 1} ({largest:g} {unit}) is more than twice the mean"
            f" interval ({mean:g} {unit}): the axis is sampled unevenly"
        )
    return warnings


def _cycle_kind(test: PositioningTest) -> list[str]:
    if test.cycle is Cycle.STEP:
        step = "step cycle (Annex B of ISO 230-2:2014): not for acceptance unless agreed; it hides"
        return [step + " part of the drift that a standard cycle shows"]
    if test.cycle is Cycle.PILGRIM:
        pilgrim = "pilgrim-step cycle: not the standard test cycle of ISO 230-2; not for acceptance"
        return [pilgrim + " unless agreed"]
    return []


def _missing_readings(test: PositioningTest) -> list[str]:
    warnings: list[str] = []
    for approach in test.approaches:
        missing = np.argwhere(np.isnan(test.deviation[:, :, approach]))
        if not missing.size:
            continue
        named = ", ".join(f"target {i + 1} in cycle {j + 1}" for i, j in missing[:3].tolist())
        more = f" and {len(missing) - 3} more" if len(missing) > 3 else ""
        warnings.append(
            f"{len(missing)} reading(s) {APPROACHES[approach]} are missing ({named}{more}):"
            " every target keeps its own number of readings"
        )
    return warnings


def _travel(test: PositioningTest) -> list[str]:
    """Check that forward runs travel up and backward runs down, where the order is stated."""
    if test.order is None or test.order_deduced or test.cycle is not Cycle.STANDARD:
        return []
    warnings: list[str] = []
    for approach, sign in enumerate((1.0, -1.0)):
        wrong = [
            j + 1
            for j in range(test.cycles)
            if not _travels(test.order[:, j, approach], test.deviation[:, j, approach], sign)
        ]
        if wrong:
            shown = ", ".join(str(j) for j in wrong[:5]) + (" ..." if len(wrong) > 5 else "")
            direction = "upwards" if sign > 0 else "downwards"
            warnings.append(
                f"the {APPROACHES[approach]} readings of cycle {shown} were not taken one after the"
                f" other {direction}, as a standard test cycle does: check the directions, or name"
                " the kind of cycle"
            )
    if _cycles_interleave(test.order):
        warnings.append(
            "readings of one cycle were taken among those of another, as in a step cycle and not"
            " in a standard test cycle: name the kind of cycle"
        )
    return warnings


def _cycles_interleave(order: FloatArray) -> bool:
    """Return whether a cycle begins before the one before it has ended."""
    known = np.any(~np.isnan(order), axis=(0, 2))
    first = np.nanmin(order[:, known], axis=(0, 2))
    last = np.nanmax(order[:, known], axis=(0, 2))
    return bool(np.any(first[1:] < last[:-1]))


def _travels(order: FloatArray, deviation: FloatArray, sign: float) -> bool:
    visited = order[~np.isnan(deviation)]
    return bool(np.all(sign * np.diff(visited) > 0))
