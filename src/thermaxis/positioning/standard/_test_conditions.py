"""Whether a run was measured as the standard asks: warnings, never a refusal."""

from collections.abc import Iterable

import numpy as np

from thermaxis.codes import Message
from thermaxis.positioning.run import APPROACHES, Cycle, FloatArray, PositioningTest
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


def check_test_conditions(test: PositioningTest) -> tuple[Message, ...]:
    """Compare a run with the test conditions of ISO 230-2.

    Returns
    -------
    tuple of Message
        A warning for each condition that the run does not meet. Empty if it meets all.

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
        *missing_readings(test.deviation, test.approaches, "warning-readings_missing"),
        *_travel(test),
    )


def _required_targets(test: PositioningTest) -> int:
    length = test.measured_length
    if test.kind is AxisKind.ROTARY:
        enough = [count for angle, count in ROTARY_TARGETS if length <= angle]
        return enough[0] if enough else 8 * int(np.ceil(length / 360.0))
    per_length = int(np.ceil(TARGETS_PER_METRE * length / 1000.0))
    return 0 if length > LONG_AXIS_MM else max(MINIMUM_TARGETS, per_length)


def _number_of_targets(test: PositioningTest) -> list[Message]:
    required = _required_targets(test)
    if test.target.size >= required:
        return []
    rotary = test.kind is AxisKind.ROTARY
    code = "warning-few_targets_rotary" if rotary else "warning-few_targets_linear"
    values = {"targets": test.target.size, "required": required, "length": test.measured_length}
    return [Message(code, values)]


def _number_of_cycles(test: PositioningTest) -> list[Message]:
    if is_single_run_axis(test):
        return []
    asked = {"required": RUNS_PER_DIRECTION}
    readings = test.readings[:, test.approaches]
    if float(np.ptp(readings)) == 0.0 and float(readings[0, 0]) < RUNS_PER_DIRECTION:
        return [Message("warning-few_cycles", {"cycles": int(readings[0, 0]), **asked})]
    few = [
        Message(
            "warning-few_readings",
            {
                "target": int(np.argmin(count)) + 1,
                "readings": int(np.min(count)),
                "approach": APPROACHES[approach],
                **asked,
            },
        )
        for approach, count in zip(test.approaches, readings.T, strict=True)
        if np.min(count) < RUNS_PER_DIRECTION
    ]
    if not few and test.cycles > RUNS_PER_DIRECTION:
        return [Message("warning-many_cycles", {"cycles": test.cycles, **asked})]
    return few


def _spacing(test: PositioningTest) -> list[Message]:
    interval = np.diff(test.target)
    if interval.size < 2:
        return []
    largest, mean = float(np.max(interval)), float(np.mean(interval))
    values = {"interval": largest, "mean": mean, "unit": test.kind.units.position}
    warnings: list[Message] = []
    if float(np.ptp(interval)) < 1e-3 * mean:
        warnings.append(Message("warning-targets_equidistant", values))
    if is_single_run_axis(test) and largest > LONG_AXIS_INTERVAL_MM:
        values = {"interval": largest, "most_mm": LONG_AXIS_INTERVAL_MM, "length_mm": LONG_AXIS_MM}
        warnings.append(Message("warning-interval_too_long", values))
    elif largest > 2.0 * mean:
        values |= {"target": int(np.argmax(interval)) + 1}
        warnings.append(Message("warning-interval_uneven", values))
    return warnings


def _cycle_kind(test: PositioningTest) -> list[Message]:
    if test.cycle is Cycle.STEP:
        return [Message("warning-step_cycle")]
    return [Message("warning-pilgrim_cycle")] if test.cycle is Cycle.PILGRIM else []


def missing_readings(deviation: FloatArray, approaches: Iterable[int], code: str) -> list[Message]:
    """Return a warning for each approach of which readings are missing, with the first of them."""
    warnings: list[Message] = []
    for approach in approaches:
        missing = np.argwhere(np.isnan(deviation[:, :, approach]))
        if missing.size:
            i, j = missing[0].tolist()
            values = {"count": len(missing), "target": i + 1, "cycle": j + 1}
            warnings.append(Message(code, {**values, "approach": APPROACHES[approach]}))
    return warnings


def _travel(test: PositioningTest) -> list[Message]:
    """Check that forward runs travel up and backward runs down, where the order is stated."""
    if test.order is None or test.order_deduced or test.cycle is not Cycle.STANDARD:
        return []
    warnings: list[Message] = []
    for approach, sign in enumerate((1.0, -1.0)):
        wrong = [
            str(j + 1)
            for j in range(test.cycles)
            if not _travels(test.order[:, j, approach], test.deviation[:, j, approach], sign)
        ]
        if wrong:
            shown = ", ".join(wrong[:5]) + (" ..." if len(wrong) > 5 else "")
            values = {"approach": APPROACHES[approach], "cycles": shown}
            warnings.append(Message("warning-travel_reversed", values))
    if _cycles_interleave(test.order):
        warnings.append(Message("warning-cycles_interleave"))
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
