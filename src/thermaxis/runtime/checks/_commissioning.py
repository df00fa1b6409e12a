"""Prove sign and size of an offset on the machine: out and back by a small step.

The step goes out and comes back at the allowed rate, with the heartbeat moved in every cycle and
the offset looked at before each write, as the loop does it. The thousandth part of it comes first,
or the smallest that the machine can tell, then the tenth: a unit that is wrong by a thousand moves
the tool by the step itself. What the tool point did is measured by somebody or something else: a
dial gauge that a person reads, a probe that the control shows, or the machine's own touches.
"""

import asyncio
import math
from collections.abc import Awaitable, Callable, Mapping
from dataclasses import dataclass
from datetime import datetime
from typing import Final, final

from thermaxis.codes import Message
from thermaxis.compensation import (
    Compensation,
    Limits,
    SupervisorRules,
    cycle_state,
    limit_step,
)
from thermaxis.errors import DataError, require_range
from thermaxis.runtime._offsets import (
    Look,
    OffsetRules,
    OffsetsState,
    OutputOffset,
    look_step,
    write_step,
)
from thermaxis.runtime._ports import Applied, Clock, Sink, Source
from thermaxis.runtime.loop import Touches

DEFAULT_STEP_UM = 10.0
"""Size of the step: seen by any dial gauge, and smaller than a finishing allowance. [µm]"""
SMALLEST_STEP_UM = 1.0
"""Smallest step that proves anything. [µm]"""
SETTLE_S = 3.0
"""Time for which the offset stands before it is measured, where nobody tells that it acts. [s]"""
SOONEST_S = 0.5
"""Time for which it stands at least. [s]"""
TAKEOVERS = 3.0
"""It stands so many times longer than the first step took until it was seen to act. [1]"""
SIZE_TOLERANCE = 0.25
"""Share by which the measured step may differ: gauge, friction and drift, no wrong unit. [1]"""
BACK_WITHIN_S = 60.0
"""Time for which the way back is tried again when the machine does not take it. [s]"""
TRIED_SHARES = (0.001, 0.1)
"""Shares of the step that are tried first. The first becomes larger where the machine keeps its
offset more coarsely. [1]"""
FAR_UM = 3.0
"""What noise and drift of gauge or probe may add to it. [µm]"""
LEAST_STEP_PER_NOISE = 10.0
"""The step is at least so many times the noise of a touch, which alone then passes for the step
once in ten million. [1]"""
PROVEN: Final = "event-step_proven"
"""Sign and size are right."""
LOOK_S = 0.2
"""Time from look to look for a touch. [s]"""
_RULES: Final = SupervisorRules()
_WAIT_S = 1.0
_SHORTEST_CYCLE_S = 0.05
_LONGEST_CYCLE_S = 60.0


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class CommissioningPlan:
    """What is done to one output.

    Raises
    ------
    ConfigurationError
        If the step is no number from 1 µm, or ten times the noise, to the output limit, or the
        cycle is not positive.
    """

    output: str
    limits: Limits
    """Its limits: the step keeps to them."""
    step_um: float = DEFAULT_STEP_UM
    """Size of the step; positive moves the tool away from the workpiece. [µm]"""
    cycle_s: float = 0.2
    """Time from write to write. [s]"""
    tolerance_um: float = _RULES.read_back_tolerance_um
    """Difference of read-back and written offset that is believed. [µm]"""
    read_back_s: float = _RULES.read_back_s
    """Time within which the machine must report what was written. [s]"""
    noise_um: float = 0.0
    """Standard deviation of one measurement, beyond that of a gauge that stands. [µm]"""

    def __post_init__(self) -> None:
        largest_um = self.limits.largest_um
        least_um = max(SMALLEST_STEP_UM, LEAST_STEP_PER_NOISE * self.noise_um)
        require_range("step_um", abs(self.step_um), least_um, largest_um, self.output)
        require_range("cycle_s", self.cycle_s, _SHORTEST_CYCLE_S, _LONGEST_CYCLE_S)


@final
@dataclass(frozen=True, slots=True)
class StepProof:
    """What a step showed."""

    output: str
    asked_um: float
    """Step that was asked for; positive moves the tool away from the workpiece. [µm]"""
    found_um: float
    """Offset that stood in the machine before, and stands there again. [µm]"""
    accepted_um: float | None
    """What the machine reported as set while the step stood. [µm]"""
    effective_um: float | None
    """What it reported as acting; None where it does not say. [µm]"""
    out_um: float
    """Displacement that was measured from before to the step. [µm]"""
    back_um: float
    """Displacement that was left after the way back. [µm]"""
    verdict: Message

    @property
    def passed(self) -> bool:
        """Whether sign and size are proven."""
        return self.verdict.code == PROVEN


Measure = Callable[[Message], Awaitable[float]]
"""Returns the tool point's displacement [µm], positive away from the workpiece; gets what stands
now."""


def by_touches(
    source: Source,
    clock: Clock,
    compensation: Compensation,
    output: str,
    tell: Callable[[Message], object],
) -> Measure:
    """Return what measures by the next touch of an output, taken as the loop takes it.

    It waits for as long as nobody touches; what was touched before it was asked is no answer.
    """
    state = cycle_state(compensation)

    async def measure(stands: Message) -> float:
        touches, asked_s = Touches(), clock.monotonic_s()
        tell(stands)
        while True:
            samples, now_s = await source.read(_WAIT_S), clock.monotonic_s()
            for touch in touches.take(compensation, samples, state, now_s)[1]:
                if touch.output == output and touch.time_s >= asked_s:
                    return touch.value_um
            await clock.sleep_until(now_s + LOOK_S)

    return measure


async def _try_a_little(
    mover: "_Mover", plan: CommissioningPlan, measure: Measure, before_um: float
) -> None:
    """Move by little first, and go no further where the tool point moved by far more."""
    found_um, tried_um = mover.now_um, 0.0
    for share in TRIED_SHARES:
        little_um = share * plan.step_um
        if abs(little_um) <= tried_um:
            continue
        while not await mover.told_of(found_um, little_um):
            digits = math.floor(math.log10(abs(little_um)) + 1e-9)  # units are powers of ten
            little_um = math.copysign(10.0 ** (digits + 1), plan.step_um)
            if abs(little_um) >= abs(plan.step_um):
                raise DataError("step_untold", channel=plan.output)
        tried_um = abs(little_um)
        moved_um = await mover.measured(measure, "further", by_um=little_um)
        far_um = FAR_UM + 5.0 * (plan.noise_um + abs(little_um))
        if not abs(moved_um - before_um) <= far_um:
            raise DataError(
                "step_moved_otherwise",
                moved_um=moved_um - before_um,
                asked_um=little_um,
                channel=plan.output,
            )


async def prove_step(
    sink: Sink, clock: Clock, plan: CommissioningPlan, measure: Measure
) -> StepProof:
    """Move the offset out and back, and say what the tool point did.

    Whatever happens on the way, the offset is brought back to where it was found, at the allowed
    rate.

    Not protected: nothing else moves the axis meanwhile, only because somebody sees to it. The
    machine must stand still, and nothing may touch the workpiece.

    Parameters
    ----------
    sink : Sink
        The machine; open and connected.

    Raises
    ------
    DataError
        If the machine is not there, does not take the offset or reports another one, the offset
        found plus the step lies outside the limits, or a small part of it moved far more or is
        not reported.
    """
    found = await sink.found(_WAIT_S) or {}
    found_um = found.get(plan.output)
    if found_um is None or any(offset is None for offset in found.values()):
        raise DataError("offset_unreadable", channel=plan.output)
    goal_um = found_um + plan.step_um
    if abs(goal_um) > plan.limits.total_um or abs(found_um) > plan.limits.total_um:
        raise DataError("step_outside_limits", found_um=found_um, channel=plan.output)
    mover = _Mover(sink, clock, plan, {n: o for n, o in found.items() if o is not None})
    try:
        await mover.stand(SOONEST_S)
        before_um = await mover.measured(measure, "as_found")
        await _try_a_little(mover, plan, measure, before_um)
        await mover.go_to(goal_um)
        await mover.stand()
        applied = mover.applied
        out_um = await mover.measured(measure, "further", by_um=plan.step_um)
    finally:
        await mover.come_back(found_um)
    await mover.stand()
    after_um = await mover.measured(measure, "as_found_again")
    moved_um, left_um = out_um - before_um, after_um - before_um
    return StepProof(
        output=plan.output,
        asked_um=plan.step_um,
        found_um=found_um,
        accepted_um=applied.accepted_um,
        effective_um=applied.effective_um,
        out_um=moved_um,
        back_um=left_um,
        verdict=judge_step(plan.step_um, moved_um, left_um),
    )


def judge_step(asked_um: float, moved_um: float, left_um: float) -> Message:
    """Return what follows from a step [µm], the measured displacement, and what was left of it."""
    values = {"moved_um": moved_um, "asked_um": asked_um}
    if not math.isfinite(moved_um) or not math.isfinite(left_um):
        return Message("event-step_not_measured")
    ratio = moved_um / asked_um
    if abs(ratio) < SIZE_TOLERANCE:
        return Message("event-step_without_effect", values)
    if ratio < 0.0:
        return Message("event-step_other_way", {"moved_um": moved_um})
    if abs(ratio - 1.0) > SIZE_TOLERANCE:
        return Message("event-step_other_size", {**values, "times": ratio})
    if abs(left_um) > SIZE_TOLERANCE * abs(asked_um):
        return Message("event-step_not_back", {"left_um": left_um})
    return Message(PROVEN, values)


def _shown(found_um: float, by_um: float, *told_um: float | None) -> bool:
    """Whether the machine reports a step, wherever it tells, or keeps its offset more coarsely."""
    return all(um is None or abs(um - found_um) > 0.5 * abs(by_um) for um in told_um)


class _Mover:
    """Moves one offset at its rate, heartbeat included; the other offsets stay as found."""

    def __init__(
        self, sink: Sink, clock: Clock, plan: CommissioningPlan, found_um: Mapping[str, float]
    ) -> None:
        self.sink, self.clock, self.plan = sink, clock, plan
        self.offsets_um = dict(found_um)
        self.applied = Applied(None, None)
        self.returning = False
        self._settle_s: float | None = None
        self._agreed_s = clock.monotonic_s()
        self._news: Mapping[str, float | None] | None = found_um
        total_um = (plan.limits.total_um,) * len(found_um)
        silence_s = 2.0 * plan.cycle_s + _WAIT_S
        self._rules = OffsetRules(
            tuple(found_um), total_um, plan.tolerance_um, plan.read_back_s, silence_s
        )
        self._state = OffsetsState((OutputOffset(),) * len(found_um))

    @property
    def now_um(self) -> float:
        return self.offsets_um[self.plan.output]

    @property
    def agrees(self) -> bool:
        """Whether the machine was seen to report what stands, and to act by it where it tells."""
        _, accepted_um, effective_um = self.applied
        seen = (self.now_um if um is None else um for um in (accepted_um, effective_um))
        return all(abs(um - self.now_um) <= self.plan.tolerance_um for um in seen)

    async def go_to(self, goal_um: float) -> None:
        """Go there, and wait until the machine agrees."""
        while self.now_um != goal_um or not self.agrees:
            await self._cycle(goal_um)

    async def told_of(self, found_um: float, by_um: float) -> bool:
        """Go by so much; wait as long as the machine may take, and say whether it reports it."""
        goal_um = found_um + by_um
        way_s = abs(goal_um - self.now_um) / self.plan.limits.largest_rate_um_per_s
        begin_s = self.clock.monotonic_s() + max(way_s, self.plan.cycle_s)
        await self.go_to(goal_um)  # which waits for a step above the tolerance
        now_s = self.clock.monotonic_s()
        while now_s - begin_s < self.plan.read_back_s:
            await self._cycle(self.now_um)
            _, accepted_um, effective_um = self.applied
            if _shown(found_um, by_um, accepted_um, effective_um):
                if self._settle_s is None and effective_um is not None:
                    self._settle_s = min(SETTLE_S, SOONEST_S + TAKEOVERS * (now_s - begin_s))
                break
            now_s = self.clock.monotonic_s()
        await self.stand()
        return _shown(found_um, by_um, self.applied.accepted_um)

    async def come_back(self, goal_um: float) -> None:
        """Go back whatever happens: what fails is tried again for a bounded time."""
        self.returning = True
        until_s = self.clock.monotonic_s() + BACK_WITHIN_S
        while self.now_um != goal_um or not self.agrees:
            try:
                await self._cycle(goal_um)
            except DataError:
                await self.clock.sleep_until(self.clock.monotonic_s() + self.plan.cycle_s)
            if self.clock.monotonic_s() >= until_s:
                raise DataError(
                    "offset_not_back",
                    goal_um=goal_um,
                    found_um=self.applied.accepted_um,
                    channel=self.plan.output,
                )

    async def stand(self, seconds: float | None = None) -> None:
        """Keep the offset, by default until it has settled, with the heartbeat moving."""
        until_s = self.clock.monotonic_s() + (seconds or self._settle_s or SETTLE_S)
        while self.clock.monotonic_s() < until_s:
            await self._cycle(self.now_um)

    async def measured(self, measure: Measure, stands: str, **values: float) -> float:
        """Measure while the heartbeat keeps moving."""
        task = asyncio.ensure_future(measure(Message(f"offset-{stands}", values)))
        try:
            while not task.done():
                await self._cycle(self.now_um)
        finally:
            task.cancel()
        return task.result()

    async def _cycle(self, goal_um: float) -> None:
        """Look, judge, write, as the loop does; nothing moves while the machine differs."""
        begin_s = self.clock.monotonic_s()
        at = begin_s, self.clock.utc()
        moved = await self._look(at)
        if self.agrees:
            self._agreed_s = begin_s
        late = begin_s - self._agreed_s > self.plan.read_back_s
        if (moved or late) and not self.returning:
            raise DataError(
                "offset_differs",
                reported_um=self.applied.accepted_um,
                written_um=goal_um if moved else self.now_um,
                channel=self.plan.output,
            )
        wanted_um = self.now_um
        if self.agrees or self.returning:
            wanted_um = limit_step(self.plan.limits, self.now_um, goal_um, self.plan.cycle_s)
        offsets_um = {**self.offsets_um, self.plan.output: wanted_um}
        known = self._state.known and not self._state.doubtful
        if not known or not await self.sink.write(offsets_um, _WAIT_S):
            raise DataError("offset_refused", written_um=wanted_um, channel=self.plan.output)
        self.offsets_um = offsets_um
        self._state = write_step(self._rules, self._state, tuple(offsets_um.values()), at)
        await self.clock.sleep_until(begin_s + self.plan.cycle_s)

    async def _look(self, at: tuple[float, datetime]) -> bool:
        """Look where the offsets stand, and go on from there; return whether one has moved."""
        news = self._news if self._news is not None else await self.sink.found(_WAIT_S)
        first, self._news = self._news is not None, None
        applied = await self.sink.read_back(_WAIT_S)
        self.applied = applied.get(self.plan.output, Applied(None, None))
        look = Look(0, *at, self.sink.connected, news, applied)
        self._state, found = look_step(self._rules, self._state, look)
        stand_um = zip(self._rules.names, found.found_um or (), strict=False)
        self.offsets_um.update({name: um for name, um in stand_um if um is not None})
        return not first and found.found_um is not None
