"""A machine on a bench: one output, 2 um per kelvin, everything well unless told otherwise."""

from typing import Any

from thermaxis.compensation import (
    AnswerCode,
    Compensation,
    CompensationModel,
    CycleOutput,
    CycleReading,
    Limits,
    Output,
    Part,
    Request,
    RequestKind,
    Sample,
    SensorRules,
    SupervisorRules,
    SupervisorState,
    cycle,
    cycle_state,
)

RATE = 1.0
LARGEST = 20.0
RULES = {
    "settle_s": 3.0,
    "recovery_delay_s": 2.0,
    "input_timeout_s": 1.0,
    "hold_input_s": 4.0,
    "hold_connection_s": 4.0,
    "hold_interlock_s": 0.0,
    "hold_operator_s": 6.0,
    "at_limit_s": 5.0,
    "read_back_s": 3.0,
}


def lathe(limits: Limits | None = None, part: Part | None = None, **options: Any) -> Compensation:
    rules = RULES | {key: options.pop(key) for key in RULES if key in options}
    part = part or Part("s", "s", "", 2.0)
    model = CompensationModel(
        outputs=(Output("Z_um", (part,)),),
        reference="stated",
        reference_c={"s": 20.0},
        longest_gap_s=options.pop("longest_gap_s", 1000.0),
        longest_hold_s=options.pop("longest_hold_s", 60.0),
    )
    sensor = options.pop("sensor", SensorRules(lowest_c=1.0, highest_c=60.0, step_k=50.0))
    return Compensation(
        model=model,
        sensors={"s": sensor},
        limits={"Z_um": limits or Limits(LARGEST, RATE)},
        supervisor=SupervisorRules(**rules),
        interlocks=("on",),
        **options,
    )


class Rig:
    """Runs cycles of a second; the machine reports what was written."""

    def __init__(self, compensation: Compensation | None = None) -> None:
        self.compensation = compensation or lathe()
        self.state = cycle_state(self.compensation)
        self.time_s = 100.0
        self.warmth_k = -5.0
        self.output: CycleOutput | None = None

    @property
    def now(self) -> SupervisorState:
        return self.state.memory.state

    @property
    def um(self) -> float:
        return self.state.correction_um[0]

    def step(self, *requests: RequestKind | Request, seconds: float = 1.0, **changes: Any) -> Any:
        self.time_s += seconds
        asked = tuple(one if isinstance(one, Request) else Request(one, "me") for one in requests)
        reading = CycleReading(
            self.time_s,
            (Sample(20.0 + self.warmth_k),),
            (),
            (True,) * len(self.compensation.interlocks),
            read_back_um=self.state.correction_um,
            requests=asked,
        )
        reading = reading._replace(**changes)
        self.state, self.output = cycle(self.compensation, self.state, reading)
        return self.output

    def steps(self, count: int, **changes: Any) -> "Rig":
        for _ in range(count):
            self.step(**changes)
        return self

    def answer(self, *requests: RequestKind | Request, **changes: Any) -> tuple[bool, AnswerCode]:
        answer = self.step(*requests, **changes).answers[-1]
        return answer.accepted, answer.code

    def to(self, state: SupervisorState) -> "Rig":
        """Bring it to a state with 5 um in force (0 in Warming), by ordinary events."""
        if state is SupervisorState.OFF:
            self.step(found_um=(5.0,))
            return self
        self.step(RequestKind.ENABLE, found_um=(0.0,))
        if state is SupervisorState.WARMING:
            return self
        self.steps(8)
        self.warmth_k = -2.5 - 0.0
        self.steps(5)
        assert self.now is SupervisorState.ACTIVE
        assert self.um == 5.0
        if state is SupervisorState.HOLDING:
            self.step(RequestKind.HOLD)
        elif state is SupervisorState.FADING:
            self.step(RequestKind.DISABLE, seconds=0.0625)
            self.step(RequestKind.ENABLE, seconds=0.0625, interlocks=(False,))
        elif state is SupervisorState.FAULT:
            self.step(other_compensation=True, seconds=0.0625)
        assert self.now is state
        return self


def away(bench: Rig) -> tuple[float, ...]:
    """Return what a machine reports that does not do what it is told."""
    return (bench.um + 3.0,)
