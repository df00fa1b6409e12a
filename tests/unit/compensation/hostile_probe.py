"""A hostile machine with a hostile probe, and the laws of the offset that touches leave."""

import math
from dataclasses import replace
from typing import Any

from tests.unit.compensation.hostile import ODD_OBJECTS, HostilePlant, Laws, quick_lathe
from thermaxis.compensation import (
    AnswerCode,
    Compensation,
    CycleOutput,
    CycleReading,
    CycleState,
    Limits,
    OffsetState,
    Outcome,
    Touch,
    TouchOutcome,
    TouchRules,
)

RENEWED = {TouchOutcome.BELIEVED, TouchOutcome.CONFIRMED}
RENEWED |= {TouchOutcome.NO_EFFECT, TouchOutcome.TOO_FAR, TouchOutcome.TOO_MANY_EXCLUDED}
ANEW = {Outcome.STARTED, Outcome.WAITING, Outcome.GAP}
ANEW |= {Outcome.CLOCK_BACKWARD, Outcome.STATE_UNUSABLE}


def touched_lathe() -> Compensation:
    """Return a lathe with touches at both outputs, one of them quick."""
    rules = {
        "Z_um": TouchRules(limits=Limits(7.0, 0.3), acts=True, confirm_s=30.0),
        "X_um": TouchRules(limits=Limits(9.0, 5.0), acts=True, start_um=50.0, gate=5.0),
    }
    return replace(quick_lathe(), touches=rules)


class HostileProbe(HostilePlant):
    """A machine of which touches come wrong, late, doubled, out of order, and of another axis."""

    def __init__(self, compensation: Compensation, seed: int) -> None:
        super().__init__(compensation, seed)
        self.offset_um = [self.rng.uniform(-8.0, 8.0) for _ in self.outputs]
        self.taken: list[Any] = []
        self.share = self.rng.choice((0.05, 0.3, 1.0))
        self.unit = self.rng.choice((*[1.0] * 7, 1000.0))

    def reading(self, last: CycleOutput | None) -> CycleReading:
        reading = super().reading(last)
        touches: list[Any] = []
        while last is not None and self.rng.random() < self.share and len(touches) < 4:
            touches.append(self.touch(last))
        return reading._replace(touches=tuple(touches))

    def touch(self, last: CycleOutput) -> Any:
        rng = self.rng
        k = rng.randrange(len(self.outputs))
        value_um = last.model_um[k] + self.offset_um[k] + self.machine[k] + rng.gauss(0.0, 1.0)
        time_s = self.time_s - rng.uniform(0.0, 1.0) * self.compensation.cycle_s
        touch: Any = Touch(self.outputs[k], self.unit * value_um, time_s, len(self.taken))
        mood = self.mood(
            "touch",
            "true",
            "chip",
            "late",
            "again",
            "odd",
            "axis",
            "sign",
            "unit",
            "object",
            "datum",
        )
        if mood == "datum" and rng.random() < 0.2:
            self.offset_um[k] = rng.uniform(-12.0, 12.0)
        if mood == "chip":
            touch = touch._replace(value_um=value_um + rng.choice((-50.0, 50.0, 900.0)))
        elif mood == "late":
            touch = touch._replace(time_s=time_s + rng.choice((-5.0, -100.0, 30.0)))
        elif mood == "again" and self.taken:
            touch = rng.choice(self.taken[-5:])
        elif mood == "odd":
            field = rng.choice(Touch._fields)
            touch = touch._replace(**{field: rng.choice(ODD_OBJECTS)})
        elif mood == "axis":
            touch = touch._replace(output=rng.choice((*self.outputs, "Y_um", "")))
        elif mood == "sign":
            touch = touch._replace(value_um=-value_um)
        elif mood == "unit":
            touch = touch._replace(value_um=value_um * rng.choice((1e-3, 1e3)))
        elif mood == "object":
            touch = rng.choice((None, 1.0, "Z_um", tuple(touch)))
        self.taken.append(touch)
        return touch


class TouchLaws(Laws):
    """The laws of every cycle, and those of the offset."""

    def __init__(self, compensation: Compensation) -> None:
        super().__init__(compensation)
        self.before = (OffsetState(),) * len(compensation.bounds)
        self.outcomes: set[TouchOutcome] = set()

    def check(self, reading: CycleReading, state: CycleState, output: CycleOutput) -> None:
        super().check(reading, state, output)
        assert len(output.touch_outcomes) == len(reading.touches)
        self.outcomes |= set(output.touch_outcomes)
        step_s = min(output.elapsed_s, 2.0 * self.compensation.cycle_s)
        renewed = {
            getattr(touch, "output", None)
            for touch, outcome in zip(reading.touches, output.touch_outcomes, strict=True)
            if outcome in RENEWED
        }
        forgotten = AnswerCode.TOUCHES_FORGOTTEN in {answer.code for answer in output.answers}
        rows = zip(
            self.compensation.probed, self.before, state.offsets, output.offset_std_um, strict=True
        )
        for name, (rules, was, now, std_um) in zip(self.compensation.limits, rows, strict=True):
            assert rules is not None
            limits = rules.limits
            assert abs(now.in_force_um) <= limits.largest_um
            moved_um = abs(now.in_force_um - was.in_force_um)
            assert moved_um <= limits.largest_rate_um_per_s * step_s + 1e-9
            assert std_um is not None
            assert 0.0 <= std_um <= rules.start_um
            if name not in renewed and not (forgotten or ANEW & set(output.outcomes)):
                assert now.belief == was.belief or (now.belief is None and now.excluded >= 3)
            if now.off:
                assert now.belief is None
            if now.belief is not None:
                assert math.isfinite(sum(now.belief))
        self.before = state.offsets
