"""Answers to requests: each is a code with its values, and each code is given."""

from typing import Any

from tests.unit.runtime.status_server_parts import compensation
from thermaxis.compensation import (
    AnswerCode,
    CycleReading,
    Request,
    RequestKind,
    Sample,
    cycle,
    cycle_state,
)


def good(time_s: float, *requests: Request, **changes: Any) -> CycleReading:
    of = compensation()
    samples = tuple(Sample(20.0 + time_s * 1e-3) for _ in of.model.channels)
    reading = CycleReading(
        time_s,
        samples,
        interlocks=(True,) * len(of.interlocks),
        read_back_um=(0.0,) * len(of.bounds),
        requests=requests,
    )
    return reading._replace(**changes)


def codes_of_the_cycle() -> set[AnswerCode]:
    """Return what the cycle answers, in every situation that has an answer of its own."""
    of = compensation()
    said: set[AnswerCode] = set()
    state = cycle_state(of)

    def ask(kind: RequestKind, reading: dict[str, Any] | None = None, **request: Any) -> None:
        nonlocal state, time_s
        time_s += 1.0
        changes = {"read_back_um": state.correction_um, **(reading or {})}
        state, output = cycle(of, state, good(time_s, Request(kind, "novak", **request), **changes))
        said.update(answer.code for answer in output.answers)

    def fault(**reading: Any) -> None:
        nonlocal state, time_s
        state, time_s = cycle_state(of), 0.0
        ask(RequestKind.ENABLE)
        for _ in range(30):
            time_s += 1.0
            changes = {"read_back_um": state.correction_um, **reading}
            state, _ = cycle(of, state, good(time_s, **changes))
        assert state.memory.fault is not None
        ask(RequestKind.ENABLE, reading)
        ask(RequestKind.TRIM, reading, output="Z_um", value=1.0, duration_s=60.0)
        ask(RequestKind.HOLD, reading)
        ask(RequestKind.ACKNOWLEDGE, reading)

    time_s = 0.0
    ask(RequestKind.HOLD)
    ask(RequestKind.MODEL)
    ask(RequestKind.ENABLE, {"other_compensation": None})
    ask(RequestKind.ENABLE, {"other_compensation": True})
    ask(RequestKind.ENABLE, {"found_um": (1e6,)})
    state = cycle_state(of)
    for kind in (RequestKind.ENABLE, RequestKind.ENABLE, RequestKind.HOLD, RequestKind.RESUME):
        ask(kind)
    ask(RequestKind.TRIM, output="Q")
    ask(RequestKind.TRIM, output="Z_um", value=1e9, duration_s=60.0)
    ask(RequestKind.TRIM, output="Z_um", value=1.0)
    ask(RequestKind.TRIM, output="Z_um", value=1.0, duration_s=60.0)
    ask(RequestKind.TRIM, output="Z_um", value=2.0, duration_s=60.0)
    ask(RequestKind.TRIM, output="Z_um", value=0.0)
    ask(RequestKind.DIAMETER, value=-1.0)
    ask(RequestKind.DIAMETER, value=500.0)
    ask(RequestKind.ACKNOWLEDGE)
    ask(RequestKind.DISABLE)
    fault(other_compensation=True)
    ask(RequestKind.ACKNOWLEDGE)
    fault(read_back_um=(30.0,))
    fault(found_um=(1e6,), read_back_um=(1e6,))
    return said


def test_every_answer_is_given_in_some_situation() -> None:
    assert codes_of_the_cycle() == set(AnswerCode)


def test_an_answer_has_the_values_that_its_sentence_needs() -> None:
    of = compensation()
    asked = [
        Request(RequestKind.TRIM, output="Q"),
        Request(RequestKind.TRIM, output="Z_um", value=1e9, duration_s=60.0),
        Request(RequestKind.TRIM, output="Z_um", value=1.0),
        Request(RequestKind.DIAMETER, value=-1.0),
    ]
    _, output = cycle(of, cycle_state(of), good(0.0, *asked))
    limit_um, longest_s = of.bounds[0].largest_trim_um, of.supervisor.longest_trim_s
    assert [(answer.code, dict(answer.values)) for answer in output.answers] == [
        (AnswerCode.UNKNOWN_OUTPUT, {"names": ("Z_um",)}),
        (AnswerCode.TRIM_RANGE, {"lowest_um": -limit_um, "largest_um": limit_um}),
        (AnswerCode.TRIM_DURATION, {"longest_s": longest_s}),
        (AnswerCode.DIAMETER_RANGE, {"largest_mm": 1e5}),
    ]
