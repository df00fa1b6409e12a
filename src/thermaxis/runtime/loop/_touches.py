"""Touches in what was read: every number of a probing cycle once, and what became of each."""

import math
from collections.abc import Mapping, Sequence
from datetime import datetime, timedelta
from typing import final

from thermaxis.compensation import (
    MOST_EXCLUDED,
    Answer,
    AnswerCode,
    Compensation,
    CycleOutput,
    CycleState,
    OffsetState,
    Request,
    Touch,
    TouchOutcome,
    TouchRules,
)
from thermaxis.runtime._ports import DATUM, SourceSample, counter_name, probe_name
from thermaxis.runtime.loop._journal import Journal
from thermaxis.runtime.loop._settings import LoopSettings
from thermaxis.runtime.status import OutputTouches

_BELIEVED = {TouchOutcome.BELIEVED, TouchOutcome.CONFIRMED}
_NO_PROBE = SourceSample(None, good=True, status="GoodNoData", age_s=None)
_ALONE = LoopSettings(machine="", model_file="", model_sha256="")
_TYPED_ONCE_S = 5.0  # nobody touches, reads and types sooner: two clicks


@final
class Touches:
    """Takes a touch when its counter has risen, and stands at the next look.

    The look after is what its value is taken from: a server that samples its nodes one after the
    other may tell a new counter beside an old value. The time is what the counter's age says, and
    without an age the last look at which it had not risen: what was in force then still was. The
    first number that is seen is no touch, nor is one that has fallen, as in a control that was
    started anew, nor one that comes back with its value. Between touches a probe with a counter has
    no value: the last one was taken while another correction acted.

    Not protected: a counter that a gateway stamps anew when it comes back has risen then.
    """

    def __init__(self, settings: LoopSettings = _ALONE) -> None:
        self._settings, self._names = settings, tuple[str, ...]()
        self._seen: dict[str, tuple[float, float]] = {}  # counter, and when it was seen first [s]
        self._taken: dict[str, float] = {}
        self._stood_s: dict[str, float] = {}  # when the counter had not risen yet
        self._shown: dict[str, tuple[float, float]] = {}  # counter and value of the last touch
        self._count, self._typed = 0, Touch("", 0.0, -math.inf)
        self._last: dict[str, OutputTouches] = {}
        self.outcomes: dict[str, str] = {}
        """What became of a touch in this cycle, or `DATUM`, by output."""

    def take(
        self,
        compensation: Compensation,
        samples: Mapping[str, SourceSample],
        state: CycleState,
        now_s: float,
        typed: Sequence[Request] = (),
    ) -> tuple[Mapping[str, SourceSample], tuple[Touch, ...]]:
        """Return what was read, with probes that have a value at a touch only, and new touches.

        Those that somebody has typed are the last; one that is typed twice is that one again.
        """
        if not compensation.touches:
            return samples, ()
        touches: list[Touch] = []
        left, before, self._names = dict(samples), self._count, tuple(compensation.touches)
        outputs = [output.name for output in compensation.model.outputs]
        for name in self._names:
            sample = samples.get(probe_name(name), _NO_PROBE)
            if counter_name(name) not in samples:  # touches are typed alone
                continue
            at_s = self._risen(name, samples[counter_name(name)], now_s)
            left[probe_name(name)] = sample._replace(value=None)
            value_um = sample.value if sample.good else None
            if at_s is None or value_um is None or not math.isfinite(value_um):
                continue
            self._taken[name] = self._seen[name][0]
            shown, self._shown[name] = self._shown.get(name), (self._taken[name], value_um)
            if shown == self._shown[name]:
                continue
            if self._settings.replayed:  # the log's machine was not corrected
                value_um += state.correction_um[outputs.index(name)]
            delay_s = self._settings.touch_delay_s.get(name, 0.0)
            touches.append(self._new(name, value_um, at_s - delay_s))
        for t in typed:
            touch = self._new(t.output, t.value or 0.0, now_s - (t.duration_s or 0.0))
            apart_s = abs(touch.time_s - self._typed.time_s)
            if touch[:2] != self._typed[:2] or apart_s > max(_TYPED_ONCE_S, compensation.cycle_s):
                self._typed = touch
            touches.append(self._typed)
        for touch in touches:
            if touch.output in compensation.touches and (touch.number or 0) > before:
                sample = SourceSample(touch.value_um, good=True, age_s=now_s - touch.time_s)
                left[probe_name(touch.output)] = sample
        return left, tuple(touches)

    def _new(self, name: str, value_um: float, time_s: float) -> Touch:
        self._count += 1
        return Touch(name, value_um, time_s, self._count)

    def _risen(self, name: str, counter: SourceSample, now_s: float) -> float | None:
        """Return when a counter was seen to rise, while its touch is not taken. [s]"""
        count = counter.value if counter.good else None
        if count is None or not float(count).is_integer():
            return None
        if count <= self._taken.setdefault(name, count):
            self._taken[name], self._stood_s[name] = count, now_s
            self._seen.pop(name, None)
            return None
        seen, at_s = self._seen.get(name, (None, now_s))
        if seen != count:
            age_s = counter.age_s
            at_s = self._stood_s[name] if age_s is None else now_s - max(age_s, 0.0)
            self._seen[name] = count, at_s
            return at_s if self._settings.replayed else None
        return at_s

    def judged(
        self, journal: Journal, touches: tuple[Touch, ...], output: CycleOutput, utc: datetime
    ) -> None:
        """Keep and tell what became of the touches of a cycle, and that a datum was set anew."""
        anew = any(answer.code is AnswerCode.TOUCHES_FORGOTTEN for answer in output.answers)
        self.outcomes = dict.fromkeys(self._names, DATUM) if anew else {}
        for (name, value_um, at_s, *_), outcome in zip(touches, output.touch_outcomes, strict=True):
            if outcome is TouchOutcome.UNKNOWN_OUTPUT:
                continue
            if outcome is not TouchOutcome.REPEATED:
                self.outcomes[name] = outcome.value
                at = utc - timedelta(seconds=min(max(0.0, output.time_s - at_s), 1e9))
                self._last[name] = OutputTouches(outcome=outcome, touched=at, value_um=value_um)
            values = {"name": name, "value_um": value_um, "outcome": outcome.value}
            journal.event("touch", "event-touch", values)

    def _wants_more(self, rules: TouchRules, name: str, one: OffsetState, std_um: float) -> bool:
        """Whether a touch would pay: the last one asks for another, or was too long ago.

        Not where so many did not fit that another one tells nothing: the alarm says why.
        """
        confirmed = self._last.get(name, OutputTouches()).outcome == TouchOutcome.CONFIRMED
        if confirmed and one.belief is not None and rules.acts:  # wanted when it has arrived
            most_um, to_um = rules.limits.largest_um, -one.belief.offset_um
            to_um = min(max(to_um, -most_um), most_um)
            confirmed = abs(one.in_force_um - to_um) < rules.noise_um
        late = std_um > self._settings.wanted_std_um.get(name, math.inf)
        return not one.off and (one.excluded < MOST_EXCLUDED if one.suspect else late or confirmed)

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
                again=one.suspect is not None,
                now=self._wants_more(compensation.touches[of.name], of.name, one, std_um or 0.0),
                void=one.off or "",
                acts=compensation.touches[of.name].acts,
            )
            for of, one, um, std_um in rows
            if of.name in compensation.touches
        }


def judged_touches(typed: Sequence[Request], output: CycleOutput) -> list[Answer]:
    """Return the answers to touches that were typed: the last ones of a cycle."""
    outcomes = output.touch_outcomes[len(output.touch_outcomes) - len(typed) :]
    return [
        Answer(request, outcome in _BELIEVED, AnswerCode.TOUCHED, {"outcome": outcome.value})
        for request, outcome in zip(typed, outcomes, strict=True)
    ]
