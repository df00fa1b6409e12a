"""What one cycle of the compensation costs, beside a function that does nothing.

Two inputs, four outputs of two parts with a section each, steady in the state Active: values
change in every cycle, offsets are read back, all readings are made beforehand. Measured by the
time of the thread in loops of the same form, in turns, the best of several counts: what another
program takes is not in it.

    python benchmarks/cycle_cost.py
"""

import sys
import time
from collections.abc import Callable
from typing import Any

from thermaxis.compensation import (
    Compensation,
    CompensationModel,
    CycleReading,
    CycleState,
    Limits,
    Output,
    Part,
    Request,
    RequestKind,
    Sample,
    Section,
    SensorRules,
    SupervisorState,
    cycle,
    cycle_state,
)

CYCLES, TIMES = 10_000, 15
LARGEST_RATIO = 250.0
"""The promise: a cycle in so many passes of the empty function with the same signature."""


def lathe() -> Compensation:
    """Return two inputs, four outputs and eight sections."""
    outputs = tuple(
        Output(
            f"O{k}_um",
            (
                Part("spindle", "s", "", 2.0, (Section(3.0, 600.0),)),
                Part("table", "t", "", 1.0, (Section(2.0, 3600.0),)),
            ),
        )
        for k in range(4)
    )
    model = CompensationModel(outputs=outputs)
    rules = SensorRules(lowest_c=1.0, highest_c=90.0)
    return Compensation(
        model=model,
        sensors=dict.fromkeys(model.channels, rules),
        limits={output.name: Limits(100.0, 1.0) for output in outputs},
        interlocks=("referenced",),
    )


def readings(compensation: Compensation) -> tuple[CycleState, list[CycleReading]]:
    """Return an active state and the readings that follow it."""
    samples = Sample(20.0), Sample(21.0)
    met = (True,) * len(compensation.interlocks)
    first = CycleReading(0.0, samples, (), met, found_um=compensation.zeros)
    state, _ = cycle(
        compensation,
        cycle_state(compensation),
        first._replace(requests=(Request(RequestKind.ENABLE),)),
    )
    for k in range(1, 300):
        reading = first._replace(time_s=float(k), found_um=None, read_back_um=state.correction_um)
        state, _ = cycle(compensation, state, reading)
    begin, made = state, []
    for k in range(CYCLES):
        samples = Sample(20.0 + 0.1 * (k % 7)), Sample(21.0 + 0.1 * (k % 5))
        reading = CycleReading(300.0 + k, samples, (), met, read_back_um=state.correction_um)
        state, output = cycle(compensation, state, reading)
        assert output.state is SupervisorState.ACTIVE  # noqa: S101 - what is measured
        made.append(reading)
    return begin, made


def empty(
    compensation: Compensation,  # noqa: ARG001 - the signature of the cycle
    state: CycleState,
    reading: CycleReading,
) -> tuple[CycleState, CycleReading]:
    """Return what it got."""
    return state, reading


def nothing() -> None:
    """Do nothing."""


def passes(function: Callable[..., Any]) -> Callable[..., float]:
    """Return the time of one loop over the readings with a function of the cycle's signature."""

    def seconds(compensation: Any, state: Any, made: list[Any]) -> float:
        begun = time.thread_time()
        for reading in made:
            state, _ = function(compensation, state, reading)
        return time.thread_time() - begun

    return seconds


def bare(*given: Any) -> float:
    """Return the time of one loop over the readings that calls a bare function."""
    made: list[Any] = given[-1]
    begun = time.thread_time()
    for _ in made:
        nothing()
    return time.thread_time() - begun


def main() -> int:
    """Print the costs; return 1 where the promise is broken."""
    compensation = lathe()
    state, made = readings(compensation)
    loops = {"cycle": passes(cycle), "empty": passes(empty), "bare": bare}
    best = dict.fromkeys(loops, float("inf"))
    for _ in range(TIMES):
        for name, loop in loops.items():
            best[name] = min(best[name], loop(compensation, state, made) / CYCLES)
    ratio = best["cycle"] / best["empty"]
    print(f"one cycle                                     {1e6 * best['cycle']:8.2f} us")
    print(f"pass with an empty function, same signature   {1e9 * best['empty']:8.1f} ns")
    print(f"pass with f()                                 {1e9 * best['bare']:8.1f} ns")
    print(
        f"cycle / empty function, same signature        {ratio:8.0f}  (at most {LARGEST_RATIO:g})"
    )
    print(f"cycle / f()                                   {best['cycle'] / best['bare']:8.0f}")
    return int(ratio > LARGEST_RATIO)


if __name__ == "__main__":
    sys.exit(main())
