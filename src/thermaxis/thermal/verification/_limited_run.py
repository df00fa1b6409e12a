"""What a correction within limits takes away along a log: row by row through `cycle`."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import final

import numpy as np

from thermaxis.compensation import (
    LARGEST_RULE,
    LONGEST_CYCLE_S,
    SHORTEST_CYCLE_S,
    Compensation,
    CompensationModel,
    CycleReading,
    Limits,
    Request,
    RequestKind,
    Sample,
    SensorRules,
    SupervisorState,
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
    step_s = log.usual_step_s if log.rows > 1 else SHORTEST_CYCLE_S
    pieces = max(1, math.ceil(step_s / LONGEST_CYCLE_S))
    compensation = Compensation(
        model=model,
        sensors=dict.fromkeys(model.channels, _BELIEVED),
        limits={output.name: limits[output.name] for output in outputs},
        cycle_s=max(step_s / pieces, SHORTEST_CYCLE_S),
    )
    state = cycle_state(compensation, references_of(model, log, reference_s))
    state = state._replace(diameter_mm=diameter_mm)
    taken: list[tuple[float, ...]] = []
    faults, before_s, held, requests = 0, float(log.time_s[0]), (), _ENABLE
    table = np.stack(model_columns(model, log), axis=1).tolist()
    for time_s, row in zip(log.time_s.tolist(), table, strict=True):
        samples = tuple(Sample(value) for value in row)
        between = [before_s + (time_s - before_s) * k / pieces for k in range(1, pieces)]
        for at_s, seen in [*((at_s, held) for at_s in between if held), (time_s, samples)]:
            reading = CycleReading(at_s, seen, read_back_um=state.correction_um, requests=requests)
            state, output = cycle(compensation, state, reading)
            fault = output.state is SupervisorState.FAULT
            requests, faults = _ENABLE if fault else (), faults + fault
        before_s, held = time_s, samples
        taken.append(state.correction_um)
    columns = -np.array(taken)
    return LimitedRun({o.name: columns[:, k] for k, o in enumerate(outputs)}, faults)
