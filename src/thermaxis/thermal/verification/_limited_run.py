"""What a correction within limits takes away along a log: row by row through `cycle`."""

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any, final

import numpy as np

from thermaxis.compensation import (
    LARGEST_RULE,
    LONGEST_CYCLE_S,
    SHORTEST_CYCLE_S,
    Compensation,
    CompensationModel,
    CycleOutput,
    CycleReading,
    CycleState,
    Limits,
    Request,
    RequestKind,
    Sample,
    SensorRules,
    SupervisorState,
    Touch,
    cycle,
    cycle_state,
)
from thermaxis.thermal._arrays import FloatArray
from thermaxis.thermal.log import ThermalLog
from thermaxis.thermal.verification._free_run import model_columns, references_of

_BELIEVED = SensorRules(
    lowest_c=-LARGEST_RULE,
    highest_c=LARGEST_RULE,
    largest_rate_k_per_s=LARGEST_RULE,
    step_k=LARGEST_RULE,
    frozen_s=0.0,
)
_ENABLE = Request(RequestKind.ACKNOWLEDGE), Request(RequestKind.ENABLE)


@final
@dataclass(frozen=True, slots=True)
class LimitedRun:
    """What a limited correction takes away along a log, and how often it stopped."""

    taken_um: Mapping[str, FloatArray]
    faults: int


def limited_run(
    model: CompensationModel,
    log: ThermalLog,
    limits: Mapping[str, Limits],
    *,
    diameter_mm: float | None,
    reference_s: float | None,
) -> LimitedRun:
    """Run the compensation along a log, as `cycle` does on a machine that obeys.

    It is enabled at the first row with an offset of zero. A row is a cycle; of rows that are
    further apart than a cycle may be, several, with the inputs held. Every finite value is
    believed, and a fault is acknowledged in the next cycle.
    """
    outputs = tuple(output for output in model.outputs if output.name in limits)
    if not outputs:
        return LimitedRun({}, 0)
    model = replace(model, outputs=outputs)
    compensation = compensation_along(
        log, model, {output.name: limits[output.name] for output in outputs}
    )
    taken: list[tuple[float, ...]] = []
    faults = 0
    along = cycles_along(compensation, log, diameter_mm=diameter_mm, reference_s=reference_s)
    for row, output in along:
        faults += output.state is SupervisorState.FAULT
        if row is not None:
            taken.append(output.correction_um)
    columns = -np.array(taken)
    return LimitedRun({o.name: columns[:, k] for k, o in enumerate(outputs)}, faults)


def _pieces(log: ThermalLog) -> int:
    """Return in how many cycles a row passes. [1]"""
    return max(1, math.ceil(log.usual_step_s / LONGEST_CYCLE_S)) if log.rows > 1 else 1


def compensation_along(
    log: ThermalLog, model: CompensationModel, limits: Mapping[str, Limits], **options: Any
) -> Compensation:
    """Return what a machine is compensated with of which every finite value is believed."""
    step_s = log.usual_step_s / _pieces(log) if log.rows > 1 else SHORTEST_CYCLE_S
    return Compensation(
        model=model,
        sensors=dict.fromkeys(model.channels, _BELIEVED),
        limits=limits,
        cycle_s=max(step_s, SHORTEST_CYCLE_S),
        **options,
    )


Touching = Callable[[int | None, CycleState, CycleOutput], tuple[Touch, ...]]
"""Touches at a row, None between rows, with what the cycle has left and said there; they are known
in the next cycle."""


def cycles_along(
    compensation: Compensation,
    log: ThermalLog,
    *,
    diameter_mm: float | None,
    reference_s: float | None,
    touching: Touching | None = None,
) -> Iterator[tuple[int | None, CycleOutput]]:
    """Yield what every cycle says along a log, on a machine that obeys, and at which row."""
    model, pieces = compensation.model, _pieces(log)
    state = cycle_state(compensation, references_of(model, log, reference_s))
    state = state._replace(diameter_mm=diameter_mm)
    before_s, held, requests, touches = float(log.time_s[0]), (), _ENABLE, ()
    table = np.stack(model_columns(model, log), axis=1).tolist()
    for k, (time_s, values) in enumerate(zip(log.time_s.tolist(), table, strict=True)):
        samples = tuple(Sample(value) for value in values)
        between = [before_s + (time_s - before_s) * j / pieces for j in range(1, pieces)]
        cycles = [*((None, at_s, held) for at_s in between if held), (k, time_s, samples)]
        for row, at_s, seen in cycles:
            reading = CycleReading(
                at_s, seen, read_back_um=state.correction_um, requests=requests, touches=touches
            )
            state, output = cycle(compensation, state, reading)
            requests = _ENABLE if output.state is SupervisorState.FAULT else ()
            touches = () if touching is None else touching(row, state, output)
            yield row, output
        before_s, held = time_s, samples
