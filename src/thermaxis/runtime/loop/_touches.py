"""Touches in what was read: every number of a probing cycle once, and what became of each."""

from collections.abc import Mapping
from datetime import datetime
from typing import final

from thermaxis.compensation import Compensation, CycleOutput, CycleState, Touch
from thermaxis.runtime._ports import NOT_READ, SourceSample, counter_name, probe_name
from thermaxis.runtime.loop._journal import Journal
from thermaxis.runtime.status import OutputTouches

_NO_PROBE = SourceSample(None, good=True, status="GoodNoData", age_s=None)


@final
class Touches:
    """Takes a touch when its counter has risen, and stands at the next look.

    The look after is what its value is taken from: a server that samples its nodes one after the
    other may tell a new counter beside an old value. The time is that of the first look. The first
    number that is seen is no touch, nor is one that has fallen: a control that was started anew
    counts from zero. Between touches the probe has no value: the last one was taken while another
    correction acted.

    Not protected: a counter that a gateway stamps anew when it comes back has risen then.
    """

    def __init__(self, *, replayed: bool = False) -> None:
        self._replayed = replayed
        self._seen: dict[str, tuple[float, float]] = {}  # counter, and when it was seen first [s]
        self._taken: dict[str, float] = {}
        self._count = 0
        self._last: dict[str, OutputTouches] = {}
        self.outcomes: dict[str, str] = {}
        """What became of a touch in this cycle, by output."""

    def take(
        self,
        compensation: Compensation,
        samples: Mapping[str, SourceSample],
        state: CycleState,
        now_s: float,
    ) -> tuple[Mapping[str, SourceSample], tuple[Touch, ...]]:
        """Return what was read, with probes that have a value at a touch only, and new touches."""
        if not compensation.touches:
            return samples, ()
        touches: list[Touch] = []
        left = dict(samples)
        for output, own in zip(compensation.model.outputs, compensation.probed, strict=True):
            if own is None:
                continue
            name, sample = output.name, samples.get(probe_name(output.name), _NO_PROBE)
            at_s = self._risen(name, samples.get(counter_name(name), NOT_READ), now_s)
            left[probe_name(name)] = sample._replace(value=None)
            if at_s is None or sample.value is None or not sample.good:
                continue
            self._taken[name] = self._seen[name][0]
            value_um = sample.value
            if self._replayed:  # the log's machine was not corrected
                value_um += state.correction_um[compensation.model.outputs.index(output)]
            self._count += 1
            touches.append(Touch(name, value_um, at_s, self._count))
            left[probe_name(name)] = SourceSample(
                value_um, good=True, age_s=now_s - at_s, source_time=sample.source_time
            )
        return left, tuple(touches)

    def _risen(self, name: str, counter: SourceSample, now_s: float) -> float | None:
        """Return when a counter was seen to rise, while its touch is not taken. [s]"""
        count = counter.value if counter.good else None
        if count is None or not count.is_integer():
            return None
        if count <= self._taken.setdefault(name, count):
            self._taken[name] = count
            return None
        seen, at_s = self._seen.get(name, (None, now_s))
        if seen != count:
            at_s = now_s - max(counter.age_s or 0.0, 0.0)
            self._seen[name] = count, at_s
            return at_s if self._replayed else None
        return at_s

    def judged(
        self, journal: Journal, touches: tuple[Touch, ...], output: CycleOutput, utc: datetime
    ) -> None:
        """Keep and tell what became of the touches of a cycle."""
        self.outcomes = {}
        for touch, outcome in zip(touches, output.touch_outcomes, strict=True):
            name, value_um = touch.output, touch.value_um
            self.outcomes[name] = outcome.value
            self._last[name] = OutputTouches(outcome=outcome, touched=utc, value_um=value_um)
            values = {"name": name, "value_um": value_um, "outcome": outcome.value}
            journal.event("touch", "event-touch", values)

    def told(
        self, compensation: Compensation, state: CycleState, output: CycleOutput
    ) -> dict[str, OutputTouches]:
        """Return what is known of touches, by the outputs at which they are looked at."""
        outputs = compensation.model.outputs
        rows = zip(outputs, state.offsets, output.offset_um, output.offset_std_um, strict=False)
        return {
            of.name: self._last.get(of.name, OutputTouches())._replace(
                offset_um=um,
                std_um=std_um,
                known_um=None if one.belief is None else one.belief.offset_um,
                again=one.excluded > 0,
                void=one.off,
                acts=compensation.touches[of.name].acts,
            )
            for of, one, um, std_um in rows
            if of.name in compensation.touches
        }
