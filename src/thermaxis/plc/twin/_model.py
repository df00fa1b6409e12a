"""The thermal model once more, plainly, in the numbers of the target."""

import math
from collections.abc import Sequence
from itertools import pairwise
from math import expm1
from typing import NamedTuple, final

from thermaxis.compensation import START, STATED, CompensationModel, Outcome, Part, Quality
from thermaxis.plc.twin._numbers import Rounding, to_double


@final
class LagTwin:
    """A first-order lag: x += alpha (u - x).

    In REAL the sum loses what is smaller than half a unit in the last place of x; the lost part
    is kept and given back with the next increment.

    References
    ----------
    Kahan 1965, Further remarks on reducing truncation errors, CACM 8(1).
    """

    def __init__(
        self, cycle_s: float, time_constant_s: float, rounded: Rounding, *, compensated: bool
    ) -> None:
        self._r = rounded
        self._alpha = rounded(-expm1(-cycle_s / time_constant_s))
        self._compensated = compensated
        self.x = 0.0
        self._lost = 0.0

    def begin(self, x: float) -> None:
        """Start from a state."""
        self.x, self._lost = x, 0.0

    def advance(self, u: float) -> None:
        """Go on by a cycle in which an input acts."""
        r, x = self._r, self.x
        d = r(self._alpha * r(u - x))
        if not self._compensated:
            self.x = r(x + d)
            return
        d = r(d - self._lost)
        t = r(x + d)
        self._lost = r(r(t - x) - d)
        self.x = t


class ModelSaid(NamedTuple):
    """What the model says in a call."""

    model_um: tuple[float, ...]
    """Displacement by output. [µm]"""
    parts_um: tuple[float, ...]
    """What every part contributes. [µm]"""
    quality: Quality
    """Whether it may be used."""
    outcomes: tuple[Outcome, ...]
    """What was out of the ordinary."""
    outside_k: tuple[float, ...]
    """By output: how far its inputs are outside their ranges. [K]"""


@final
class _PartTwin:
    """One part: direct gain, sections, delay, gain by diameter."""

    def __init__(self, part: Part, wire: int, cycle_s: float, rounded: Rounding) -> None:
        self._r = rounded
        compensated = rounded is not to_double
        self.wire = wire
        self.delay_cycles = round(part.delay_s / cycle_s)
        self._direct = rounded(part.direct_gain_um_per_k)
        self._gains = [rounded(s.gain_um_per_k) for s in part.sections]
        self.sections = [
            LagTwin(cycle_s, s.time_constant_s, rounded, compensated=compensated)
            for s in part.sections
        ]
        points = part.gain_by_diameter
        self.gained = bool(points)
        self._tool_gain = rounded(part.tool_gain)
        self._diameters = [rounded(p.diameter_mm) for p in points]
        self._factors = [rounded(p.gain) for p in points]
        self._spans_mm = [rounded(b.diameter_mm - a.diameter_mm) for a, b in pairwise(points)]
        self._spans = [rounded(b.gain - a.gain) for a, b in pairwise(points)]
        self.lowest_k = None if part.lowest_k is None else rounded(part.lowest_k)
        self.highest_k = None if part.highest_k is None else rounded(part.highest_k)

    def said(self, u: float, diameter_mm: float | None) -> float:
        """Return the contribution for an input. [µm]"""
        r = self._r
        y = r(self._direct * u)
        for gain, section in zip(self._gains, self.sections, strict=True):
            y = r(y + r(gain * section.x))
        return r(y * self._gain(diameter_mm)) if self.gained else y

    def outside_table(self, diameter_mm: float | None) -> bool:
        """Return whether a diameter lies outside the table of gains."""
        if not self.gained or diameter_mm is None:
            return False
        return not self._diameters[0] <= diameter_mm <= self._diameters[-1]

    def outside_k(self, u: float) -> float:
        """Return how far an input is outside the range of the training logs. [K]"""
        if self.lowest_k is None or self.highest_k is None:
            return 0.0
        return max(0.0, self._r(self.lowest_k - u), self._r(u - self.highest_k))

    def _gain(self, diameter_mm: float | None) -> float:
        if diameter_mm is None:
            return self._tool_gain
        if diameter_mm <= self._diameters[0]:
            return self._factors[0]
        r = self._r
        for k, span_mm in enumerate(self._spans_mm):
            if diameter_mm <= self._diameters[k + 1]:
                share = r(r(diameter_mm - self._diameters[k]) / span_mm)
                return r(self._factors[k] + r(share * self._spans[k]))
        return self._factors[-1]


@final
class ModelTwin:
    """The model, from call to call.

    Not protected: the output is neither limited nor ramped here.
    """

    def __init__(self, model: CompensationModel, cycle_s: float, rounded: Rounding) -> None:
        self._r, self._cycle_s = rounded, rounded(cycle_s)
        self._hold_s = rounded(model.longest_hold_s)
        self._at_rest = model.reference == START
        channels = model.channels
        self._reference = [
            rounded(model.reference_c[c]) if model.reference == STATED else math.nan
            for c in channels
        ]
        layout = model.layout
        self._wires = layout.wires
        self._parts = [
            _PartTwin(part, wire, cycle_s, rounded)
            for part, wire in zip(layout.parts, layout.driven, strict=True)
        ]
        self._spans = layout.spans
        self._offsets_um = [rounded(offset_um) for _, _, offset_um in layout.spans]
        self._filters: list[LagTwin] = []
        if model.input_filter_s > 0.0:
            compensated = rounded is not to_double
            self._filters = [
                LagTwin(cycle_s, model.input_filter_s, rounded, compensated=compensated)
                for _ in self._wires
            ]
        self._deepest = max(part.delay_cycles for part in self._parts)
        self._running = False
        self._value = [math.nan] * len(channels)
        self._since_good_s = [math.inf] * len(channels)
        self._raw: list[float] = []
        self._past: list[list[float]] = []

    def advance(self, values: Sequence[float | None], diameter_mm: float | None) -> ModelSaid:
        """Go on by a cycle and say what the present inputs make."""
        outcomes: list[Outcome] = []
        quality = self._held(values, outcomes)
        if not self._running and quality is Quality.BAD:
            return self._nothing((*outcomes, Outcome.WAITING))
        if not self._running:
            self._reference = [
                v if math.isnan(ref) else ref
                for ref, v in zip(self._reference, self._value, strict=True)
            ]
        raw = [self._input(plus, minus) for plus, minus in self._wires]
        outside_k = [part.outside_k(raw[part.wire]) for part in self._parts]
        if any(self._is_outside(part, raw[part.wire]) for part in self._parts):
            outcomes.append(Outcome.OUTSIDE_VALIDITY)
        if self._running:
            self._go_on()
        else:
            self._start(raw)
            outcomes.append(Outcome.STARTED)
        self._raw = raw
        self._remember()
        if any(part.outside_table(diameter_mm) for part in self._parts):
            outcomes.append(Outcome.DIAMETER_HELD)
        widest = [max(outside_k[first:behind]) for first, behind, _ in self._spans]
        return self._said(diameter_mm, quality, tuple(outcomes), tuple(widest))

    def stand(self, diameter_mm: float | None) -> ModelSaid:
        """Say the last once more, as bad: a call with a wrong cycle time says nothing new."""
        if not self._running:
            return self._nothing((Outcome.CLOCK_UNUSABLE,))
        outcomes = [Outcome.CLOCK_UNUSABLE]
        if any(part.outside_table(diameter_mm) for part in self._parts):
            outcomes.append(Outcome.DIAMETER_HELD)
        inside = (0.0,) * len(self._spans)
        return self._said(diameter_mm, Quality.BAD, tuple(outcomes), inside)

    def _held(self, values: Sequence[float | None], outcomes: list[Outcome]) -> Quality:
        failed = False
        for k, value in enumerate(values):
            if value is None:
                self._since_good_s[k] = self._r(self._since_good_s[k] + self._cycle_s)
                failed = failed or self._since_good_s[k] > self._hold_s
            else:
                self._value[k], self._since_good_s[k] = value, 0.0
        if None not in values:
            return Quality.GOOD
        outcomes.append(Outcome.INPUT_FAILED if failed else Outcome.INPUT_HELD)
        return Quality.BAD if failed else Quality.HELD

    def _input(self, plus: int, minus: int) -> float:
        r = self._r
        u = r(self._value[plus] - self._reference[plus])
        return u if minus < 0 else r(u - r(self._value[minus] - self._reference[minus]))

    @staticmethod
    def _is_outside(part: _PartTwin, u: float) -> bool:
        if part.lowest_k is None or part.highest_k is None:
            return False
        return not part.lowest_k <= u <= part.highest_k

    def _start(self, raw: list[float]) -> None:
        self._running = True
        for part in self._parts:
            for section in part.sections:
                section.begin(0.0 if self._at_rest else raw[part.wire])
        for lag, u in zip(self._filters, raw, strict=False):
            lag.begin(u)
        self._raw = raw

    def _go_on(self) -> None:
        """Advance sections, then filters, with what has acted since the last call."""
        for part in self._parts:
            u = self._acting(part)
            for section in part.sections:
                section.advance(u)
        for lag, u in zip(self._filters, self._raw, strict=False):
            lag.advance(u)

    def _acting(self, part: _PartTwin) -> float:
        """Return what acts on a part as of the newest remembered row, behind its delay. [K]"""
        return self._past[max(len(self._past) - 1 - part.delay_cycles, 0)][part.wire]

    def _remember(self) -> None:
        self._past.append([lag.x for lag in self._filters] if self._filters else self._raw)
        if len(self._past) > self._deepest + 1:
            del self._past[0]

    def _said(
        self,
        diameter_mm: float | None,
        quality: Quality,
        outcomes: tuple[Outcome, ...],
        outside_k: tuple[float, ...],
    ) -> ModelSaid:
        r = self._r
        parts_um = tuple([part.said(self._acting(part), diameter_mm) for part in self._parts])
        model_um: list[float] = []
        for (first, behind, _), offset_um in zip(self._spans, self._offsets_um, strict=True):
            y_um = 0.0
            for k in range(first, behind):
                y_um = r(y_um + parts_um[k])
            model_um.append(r(offset_um + y_um))
        return ModelSaid(tuple(model_um), parts_um, quality, outcomes, outside_k)

    def _nothing(self, outcomes: tuple[Outcome, ...]) -> ModelSaid:
        zeros = (0.0,) * len(self._spans)
        return ModelSaid(zeros, (0.0,) * len(self._parts), Quality.BAD, outcomes, zeros)
