"""A control that takes offsets over late, at its own rate and in whole tenths, and a loop beside.

The loop is made of the pure steps alone, so that hours at ten cycles a second take seconds.
"""

import math
from collections import deque
from dataclasses import dataclass, field
from datetime import UTC, datetime, timedelta
from typing import NamedTuple

from thermaxis.compensation import (
    Compensation,
    CycleReading,
    CycleState,
    Request,
    RequestKind,
    Sample,
    SupervisorState,
    cycle,
    cycle_state,
)
from thermaxis.runtime._offsets import (
    Look,
    OffsetMismatch,
    OffsetsState,
    OutputOffset,
    look_step,
    offset_rules,
    rest_step,
    write_step,
)
from thermaxis.runtime._ports import Applied

NOON = datetime(2026, 11, 23, 12, tzinfo=UTC)
PERIOD_S = 120.0
"""The spindle warms up and cools so fast that a control that is late is waited for. [s]"""


@dataclass
class LateControl:
    """Takes over what was written a while ago, and goes there at a rate; the tool follows."""

    late_s: float = 0.0
    """A PLC that copies what is written so often, or a gateway that delays every value. [s]"""
    sampled: bool = True
    """Whether it copies the present value, rather than every value late."""
    rate_um_per_s: float = math.inf
    """How fast what is accepted goes there. [µm/s]"""
    follow_s: float = 0.0
    """Time constant by which what acts follows what is accepted. [s]"""
    tenths: bool = False
    """Whether it keeps whole tenths of a micrometre, as an Int16 does."""
    watchdog_s: float = math.inf
    """After so long without a new value it goes to zero. [s]"""
    node_um: float = 0.0
    accepted_um: float = 0.0
    effective_um: float = 0.0
    _goal_um: float = 0.0
    _queue: deque[tuple[float, float]] = field(default_factory=deque[tuple[float, float]])
    _copied_s: float = -math.inf
    _beat_s: float = 0.0

    def write(self, um: float, now_s: float) -> None:
        self.node_um = round(10.0 * um) / 10.0 if self.tenths else um
        self._queue.append((now_s + self.late_s, self.node_um))

    def advance(self, now_s: float, elapsed_s: float) -> None:
        if self.sampled and now_s - self._copied_s >= self.late_s - 1e-9:
            self._copied_s, self._goal_um = now_s, self.node_um
            self._beat_s = now_s if self._queue else self._beat_s
            self._queue.clear()
        while not self.sampled and self._queue and self._queue[0][0] <= now_s + 1e-9:
            self._beat_s, self._goal_um = now_s, self._queue.popleft()[1]
        if now_s - self._beat_s > self.watchdog_s:
            self._goal_um = 0.0
        step_um = self.rate_um_per_s * elapsed_s
        to_go_um = self._goal_um - self.accepted_um
        self.accepted_um += min(max(to_go_um, -step_um), step_um)
        share = 1.0 if self.follow_s == 0.0 else -math.expm1(-elapsed_s / self.follow_s)
        self.effective_um += share * (self.accepted_um - self.effective_um)

    def said(self) -> Applied:
        if not self.tenths:
            return Applied(None, self.accepted_um, self.effective_um)
        said = (round(10.0 * um) / 10.0 for um in (self.accepted_um, self.effective_um))
        return Applied(None, *said)


class Shift(NamedTuple):
    """What was seen in so many hours."""

    told: list[OffsetMismatch]
    states: set[SupervisorState]
    furthest_um: float
    """Largest correction. [µm]"""
    stale: int
    """Cycles in which the correction waited for the control. [1]"""
    changed: list[float]
    """Where the correction went on from somewhere else than its newest write: the steps. [µm]"""


def compensate(
    compensation: Compensation,
    control: LateControl,
    hours: float,
    freeze_s: float = 0.0,
    other: tuple[float, float] = (math.inf, 0.0),
) -> Shift:
    """Compensate a machine whose spindle warms up and cools; the loop stands still at 40 s.

    Another writer sets a value once, just after a time.
    """
    rules, cycle_s = offset_rules(compensation), compensation.cycle_s
    state: CycleState = cycle_state(compensation)
    offsets = OffsetsState((OutputOffset(),))
    told: list[OffsetMismatch] = []
    states: set[SupervisorState] = set()
    furthest_um, stale = 0.0, 0
    changed: list[float] = []
    written_um, written_s = 0.0, 0.0
    news: dict[str, float | None] | None = {"Z_um": 0.0}
    requests: tuple[Request, ...] = (Request(RequestKind.ENABLE, "Jana"),)
    for number in range(1, round(3600.0 * hours / cycle_s)):
        now_s = number * cycle_s
        at = now_s, NOON + timedelta(seconds=now_s)
        if now_s - cycle_s <= other[0] < now_s:
            control.write(other[1], other[0])
        control.advance(now_s, cycle_s)
        if 40.0 < now_s < 40.0 + freeze_s:
            continue
        look = Look(number, *at, connected=True, news_um=news, applied={"Z_um": control.said()})
        offsets, found = look_step(rules, offsets, look)
        told.extend(found.told)
        warm_c = 20.0 + 2.5 * (1.0 - math.cos(2.0 * math.pi * now_s / PERIOD_S))
        column_c = 20.0 + 1e-3 * (number % 2)  # a value that never moves counts as frozen
        samples = tuple(Sample(c, good=True, age_s=0.0) for c in (warm_c, column_c))
        reading = CycleReading(
            now_s,
            samples,
            interlocks=(True,),
            read_back_um=found.read_back_um,
            found_um=found.found_um,
            other_compensation=found.other_writer,
            requests=requests,
        )
        state, output = cycle(compensation, state, reading)
        news, requests = None, ()
        states.add(output.state)
        furthest_um = max(furthest_um, abs(output.correction_um[0]))
        stale += output.correction_um == output.before_um
        if output.state is SupervisorState.OFF:
            offsets = rest_step(offsets, off=True)
            continue
        if found.rests:
            continue
        (um,) = output.correction_um
        allowed_um = compensation.bounds[0].largest_rate_um_per_s * (now_s - written_s)
        if abs(um - written_um) > allowed_um + rules.tolerance_um:
            changed.append(um - written_um)
        written_um, written_s = um, now_s
        control.write(um, now_s)
        offsets = write_step(rules, offsets, output.correction_um, at)
    return Shift(told, states, furthest_um, stale, changed)
