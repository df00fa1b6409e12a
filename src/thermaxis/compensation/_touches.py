"""What touches of the machine's own probe add: an offset per output, by a scalar Kalman filter.

What the model leaves of a displacement is an offset b that no input explains: a random walk, of
which nothing is known at first but that it is of the size sigma0 (Kalman 1960; this and Page 1954
from memory). Beside it is e, what the model leaves for less time than lies between touches, such as
the first minutes of another speed: new at every touch, so that none tells of the next::

    b(t + dt) = b(t) + v          var v = q dt                                                  (1)

A touch shows what is left while the correction c is in force, with the model's y beside it::

    m = y + b + e + c + n         var e = d^2   var n = noise^2   R = d^2 + noise^2             (2)

so that z = m - (c + y) is the offset, touched. Between touches, and by a touch::

    P- = min(P + q dt, sigma0^2)  r = z - b   S = P- + R                                        (3)
    K = P- / S                    b += K r    P = (1 - K) P-         where r^2 <= gate^2 S       (4)

The tool point is known by sqrt(P- + d^2). A touch beyond the gate changes nothing: a chip, another
datum, another workpiece. It waits for a second one, and two that agree are believed, the second by
(4) with the first as what was known. Where three more were excluded than believed, what was known
is void, and from ten on the offset is off: another unit, a probe that is loose.

Whether touches see the correction at all shows between two of them: what they should show has
changed by D = (c + y)before - (c + y)now. Where they do, r is N(0, S); where they do not (another
axis) it is about N(D, S), and with the wrong sign N(2 D, S). So does a machine that drifts by D in
that time: only touches that follow each other soon prove something. The evidence grows by the
logarithm of the likelihood ratio, D (r - D/2) / (S + (ramp dt)^2), and never falls below zero (Page
1954). That is why a touch that was confirmed wants another one when its offset has arrived.

Over hours D proves nothing, but then a wrong sign shows by size. With o in force of the offset,
c = o - y, a probe that takes the sign of m away shows z = -(b + 2 o); the filter answers by o
towards -z, so that the distance of o from -b doubles at a gain of 1, grows at any, until o stands
at its limit, o = s L with s = 1 or -1. There it does harm, |b + o| > |b|, where s b > -L/2, and

    |z| = |s b + 2 L| > 3/2 L                                                                  (5)

So what is believed beyond 3/2 L ends the offset: one that stands at its limit by the wrong sign and
is not ended makes no error larger. With another factor g, z = g (b + o) - o, and (5) holds wherever
such an offset does harm for g <= -1 and g >= 5. A healthy machine that lacks so much would lack a
third of it with the offset, too: its model fits no more.

Standard library only; no clock, no exception. `cycle` does the rest.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import NamedTuple, final

from thermaxis.compensation._limits import LARGEST_LIMIT_UM, Limits, limit_step
from thermaxis.compensation._step import number
from thermaxis.errors import require_range

MOST_EXPECTED = 64
"""So many times are remembered at which it is known what a touch should show. [1]"""
MOST_EXCLUDED = 3
"""So many touches excluded more than believed void what was known: a model that runs away would
else keep an old offset. [1]"""
SMALLEST_NOISE_UM = 0.01
"""No touch is better than that. [µm]"""
LARGEST_EVIDENCE = 7.5
"""One touch says no more for or against touches that see the correction. [1]"""
TRIP_EVIDENCE = 15.0
"""Evidence that touches do not see the correction from which on the offset is off: two touches
at least, and healthy ones reach it once in exp(15), three million, or less. [1]"""

TRIP_EXCLUDED = 10
"""Touches excluded more than believed from which on the offset is off: where one in ten is excluded
that is one healthy touch in three billion. [1]"""
_FARTHEST = 1.5
"""Share of its limit that touches may show beside the offset: equation (5). [1]"""
_HOUR_S = 3600.0
_Floats = tuple[float, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class TouchFilter:
    """How touches at an output are believed.

    Raises
    ------
    ConfigurationError
        If a number is out of its range.
    """

    noise_um: float = 1.0
    """Standard deviation of a touch that states none. Default: that of a touch probe. [µm]"""
    drift_um_per_root_h: float = 2.0
    """Standard deviation by which the offset drifts in one hour, the root of q. Default: what a
    model from touches leaves on FL_THERMAL. [µm/√h]"""
    discrepancy_um: float = 0.0
    """Standard deviation d of what the model leaves anew at every touch, which no offset mends.
    Default: none. [µm]"""
    start_um: float = 5.0
    """Standard deviation sigma0 of what the model leaves where nothing was touched for long;
    nothing is ever known worse. Default: with it a single touch that is off by 50 µm lies three
    times beyond the gate. [µm]"""
    gate: float = 3.0
    """A touch further from what is known, in standard deviations, asks for a second one. Default:
    three, one healthy touch in 370. [1]"""
    ramp_um_per_h: float = 10.0
    """Steady drift that proves nothing against the touches. Default: what a poor model loses in
    an hour of warming. [µm/h]"""
    confirm_s: float = 86_400.0
    """Time within which a second touch confirms the first. Default: a day, so that touches confirm
    each other at any pace: a wrong sign shows no sooner. [s]"""
    oldest_s: float = 0.0
    """A touch that becomes known later is not used: what was in force is remembered for so long, in
    64 steps, a line between two. Without it: 64 cycles, each as it was. [s]"""
    acts: bool = False
    """Whether the offset is added to the correction, or only shown. Default: shown, until its sign
    and size were proven on the machine."""

    def __post_init__(self) -> None:
        """Check the numbers."""
        for name in ("noise_um", "drift_um_per_root_h", "start_um", "gate"):
            require_range(name, getattr(self, name), SMALLEST_NOISE_UM, 1000.0)
        require_range("ramp_um_per_h", self.ramp_um_per_h, 0.0, 1000.0)
        require_range("discrepancy_um", self.discrepancy_um, 0.0, 1000.0)
        require_range("confirm_s", self.confirm_s, 0.0, 86_400.0)
        require_range("oldest_s", self.oldest_s, 0.0, 3600.0)


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class TouchRules(TouchFilter):
    """How touches at an output are believed, and how far their offset may go.

    Not protected: whether what was touched is where it was. A workpiece that is put in anew, a
    worn tool and a datum that was set look like a drift: the correction follows them within these
    limits, and from half as much again on the offset goes. Touches of another axis that stay within
    half the limit look like a drift, too, and half or twice the unit like a poor model. A trim is
    added on top: whoever trims away what a touch has shown does it twice.
    """

    limits: Limits
    """Limit and rate of the offset, inside those of the correction; there is no default."""


class Touch(NamedTuple):
    """One probing. Whatever a source sends, `cycle` survives it."""

    output: str
    """Output that it is a displacement of."""
    value_um: float
    """Tool point relative to workpiece while the correction was in force, positive away. [µm]"""
    time_s: float
    """When it was taken, on the clock of the cycle. [s]"""
    number: int | None = None
    """Its number: one that has the number of the last one is that one again, and any other is a new
    one; without a number the time decides. [1]"""
    noise_um: float | None = None
    """Its standard deviation; None for that of the rules. [µm]"""


class TouchOutcome(StrEnum):
    """What became of a touch."""

    BELIEVED = "believed"
    """The offset was renewed by it."""
    CONFIRMED = "confirmed"
    """It agrees with the one before, which was excluded: both are believed, and another touch is
    wanted when the offset has arrived."""
    EXCLUDED = "excluded"
    """What is known excludes it: a second touch is wanted. One changes nothing; where three more
    are excluded than believed, what was known is void."""
    REPEATED = "repeated"
    """It is the last one again, by its number or, where none is stated, not newer than that."""
    UNTIMELY = "untimely"
    """What was in force at its time is not known: too late, too early, or the machine not read."""
    UNUSABLE = "unusable"
    """It is no number, or nothing that a machine can show."""
    UNKNOWN_OUTPUT = "unknown_output"
    """It belongs to no output that is touched."""
    NO_EFFECT = "no_effect"
    """Touches do not see the correction, or with the wrong sign: the offset goes to zero at its
    rate, and stays off until somebody acknowledges."""
    TOO_FAR = "too_far"
    """They show more than half as much again as the offset may mend: it is off likewise."""
    TOO_MANY_EXCLUDED = "too_many_excluded"
    """`TRIP_EXCLUDED` more were excluded than believed: it is off likewise."""


class Belief(NamedTuple):
    """What is known of an offset: b and P of equations (1) to (4)."""

    offset_um: float
    """Displacement that the model lacks. [µm]"""
    variance_um2: float
    """Its variance at that time. [µm²]"""
    time_s: float
    """When it was touched last. [s]"""


class OffsetState(NamedTuple):
    """What a cycle leaves of the touches of one output."""

    belief: Belief | None = None
    """What is known; None before the first touch."""
    suspect: Belief | None = None
    """A touch that was excluded and waits for a second one."""
    excluded: int = 0
    """Touches that were excluded more than believed, from none on. [1]"""
    in_force_um: float = 0.0
    """What is added to the correction, on its way to minus the offset. [µm]"""
    off: TouchOutcome | None = None
    """Why the offset is off, which nobody has acknowledged; None where it is not."""
    evidence: float = 0.0
    """Evidence that they do not. [1]"""
    expected_um: float = 0.0
    """c + y at the last touch that was believed. [µm]"""
    touched_s: float = -math.inf
    """Time of the last touch, believed or not. [s]"""
    number: int | None = None
    """Its number. [1]"""

    def anew(self, off: TouchOutcome | None = None) -> "OffsetState":
        """Return the state in which nothing is known; the offset in force leaves at its rate."""
        return OffsetState(in_force_um=self.in_force_um, off=off or self.off, number=self.number)

    def shifted(self, by_s: float) -> "OffsetState":
        """Return the state on another clock."""
        belief, suspect = (one and one._replace(time_s=one.time_s + by_s) for one in self[:2])
        return self._replace(belief=belief, suspect=suspect, touched_s=self.touched_s + by_s)


def offset_std_um(rules: TouchRules, state: OffsetState, time_s: float) -> float:
    """Return the standard uncertainty of the tool point, as it grows since the last touch. [µm]

    What touches show beyond the limit of the offset is known, and not in it.
    """
    return math.sqrt(_known(rules, state.belief, time_s).variance_um2 + rules.discrepancy_um**2)


def touch_step(
    rules: TouchRules, state: OffsetState, touch: Touch, expected_um: float
) -> tuple[OffsetState, TouchOutcome]:
    """Believe one touch, or not.

    Parameters
    ----------
    rules : TouchRules
        How touches are believed.
    state : OffsetState
        What the last touch left.
    touch : Touch
        The touch: of this output, of numbers, taken in the past.
    expected_um : float
        c + y: correction and model at its time. [µm]

    Returns
    -------
    state : OffsetState
        With the new offset.
    outcome : TouchOutcome
        What became of it.
    """
    older = touch.time_s <= state.touched_s
    if state.off or (older if touch.number is None else touch.number == state.number):
        return state, state.off or TouchOutcome.REPEATED
    noise_um = rules.noise_um if touch.noise_um is None else touch.noise_um
    variance_um2 = noise_um**2 + rules.discrepancy_um**2
    touched = Belief(touch.value_um - expected_um, variance_um2, touch.time_s)  # (2)
    known = _known(rules, state.belief, touch.time_s)
    evidence = state.evidence
    if state.belief is not None:
        ramp_um = rules.ramp_um_per_h * ((touch.time_s - state.belief.time_s) / _HOUR_S)
        evidence += _evidence(rules, known, touched, state.expected_um - expected_um, ramp_um)
    evidence = max(0.0, evidence)
    state = state._replace(touched_s=touch.time_s, number=touch.number, evidence=evidence)
    if evidence >= TRIP_EVIDENCE:
        return state.anew(TouchOutcome.NO_EFFECT), TouchOutcome.NO_EFFECT
    outcome = TouchOutcome.BELIEVED
    if not _agree(rules, known, touched):
        first, outcome = state.suspect, TouchOutcome.CONFIRMED
        soon = first is not None and abs(touch.time_s - first.time_s) <= rules.confirm_s
        known = _known(rules, first, touch.time_s)
        if not soon or not _agree(rules, known, touched):
            excluded = state.excluded + 1
            if excluded >= TRIP_EXCLUDED:
                return state.anew(TouchOutcome.TOO_MANY_EXCLUDED), TouchOutcome.TOO_MANY_EXCLUDED
            belief = state.belief if excluded < MOST_EXCLUDED else None
            state = state._replace(belief=belief, suspect=touched, excluded=excluded)
            return state, TouchOutcome.EXCLUDED
    gain = known.variance_um2 / (known.variance_um2 + touched.variance_um2)  # (4)
    offset_um = known.offset_um + gain * (touched.offset_um - known.offset_um)
    if abs(offset_um) > _FARTHEST * rules.limits.largest_um:  # (5)
        return state.anew(TouchOutcome.TOO_FAR), TouchOutcome.TOO_FAR
    belief = Belief(offset_um, (1.0 - gain) * known.variance_um2, touch.time_s)
    excluded = max(0, state.excluded - 1)
    state = state._replace(belief=belief, suspect=None, excluded=excluded, expected_um=expected_um)
    return state, outcome


def _known(rules: TouchRules, belief: Belief | None, time_s: float) -> Belief:
    """Return what is known at a time: equation (3), left."""
    largest_um2 = rules.start_um**2
    if belief is None:
        return Belief(0.0, largest_um2, time_s)
    grown_um2 = rules.drift_um_per_root_h**2 * max(0.0, time_s - belief.time_s) / _HOUR_S
    return Belief(belief.offset_um, min(belief.variance_um2 + grown_um2, largest_um2), time_s)


def _agree(rules: TouchRules, known: Belief, touched: Belief) -> bool:
    """Whether a touch is within the gate of what is known."""
    r, s = touched.offset_um - known.offset_um, known.variance_um2 + touched.variance_um2
    return r * r <= rules.gate**2 * s


def _evidence(
    rules: TouchRules, known: Belief, touched: Belief, d_um: float, ramp_um: float
) -> float:
    """Return what a touch says for touches that do not see the correction."""
    r, s = touched.offset_um - known.offset_um, known.variance_um2 + touched.variance_um2
    if abs(r) > 2.0 * abs(d_um) + rules.gate * math.sqrt(s):
        return 0.0  # nor does a wrong sign explain it
    ratio = d_um * (r - 0.5 * d_um) / (s + ramp_um * ramp_um)
    return min(max(ratio, -LARGEST_EVIDENCE), LARGEST_EVIDENCE)


def offset_step(rules: TouchRules, state: OffsetState, elapsed_s: float) -> OffsetState:
    """Return the state with what is added to the correction next: minus the offset, limited."""
    wanted_um, largest_um = 0.0, rules.limits.largest_um
    if rules.acts and state.belief is not None:
        wanted_um = min(max(-state.belief.offset_um, -largest_um), largest_um)
    in_force_um = limit_step(rules.limits, state.in_force_um, wanted_um, elapsed_s)
    return state._replace(in_force_um=in_force_um)


# ---- what a cycle does ---------------------------------------------------------------------------

Expected = tuple[tuple[float, _Floats], ...]
"""Time, and c + y by output from then on, of the last cycles, the newest first."""


def note_step(
    rules: Sequence[TouchRules | None], expected: Expected, time_s: float, row: _Floats
) -> Expected:
    """Return what is remembered with a new row: older ones lie so far apart as is stated."""
    apart_s = _longest_s(rules) / MOST_EXPECTED
    if len(expected) > 1 and expected[0][0] - expected[1][0] < apart_s:
        expected = expected[1:]
    return ((time_s, row), *expected[: MOST_EXPECTED - 1])


def _longest_s(rules: Sequence[TouchRules | None]) -> float:
    return max((own.oldest_s for own in rules if own is not None), default=0.0)


def _expected_at(
    rules: Sequence[TouchRules | None], expected: Expected, time_s: float
) -> _Floats | None:
    """Return c + y by output at a time; None where that is not known."""
    newer: tuple[float, _Floats] | None = None
    for since_s, row in expected:
        if since_s > time_s:
            newer = since_s, row
        elif newer is None or not _longest_s(rules):
            return row
        else:
            share = (time_s - since_s) / (newer[0] - since_s)
            return tuple(a + share * (b - a) for a, b in zip(row, newer[1], strict=True))
    return None


def touches_step(
    rules: Sequence[TouchRules | None],
    names: Sequence[str],
    offsets: Sequence[OffsetState],
    expected: Expected,
    touches: Sequence[object],
    time_s: float,
) -> tuple[list[OffsetState], tuple[TouchOutcome, ...]]:
    """Return the states after the touches of a cycle, and what became of each.

    Rules, names, states and the numbers of `expected` are by output; touches may be anything.
    """
    states, outcomes = list(offsets), list[TouchOutcome]()
    known = {name: own for name, own in zip(names, rules, strict=True) if own is not None}
    for touch in touches:
        if not isinstance(touch, Touch) or not _usable(touch):
            outcome = TouchOutcome.UNUSABLE
        elif touch.output not in known:
            outcome = TouchOutcome.UNKNOWN_OUTPUT
        else:
            k, own, outcome = names.index(touch.output), known[touch.output], TouchOutcome.UNTIMELY
            row = _expected_at(rules, expected, touch.time_s)
            if row is not None and touch.time_s <= time_s:
                states[k], outcome = touch_step(own, states[k], touch, row[k])
        outcomes.append(outcome)
    return states, tuple(outcomes)


def _usable(touch: Touch) -> bool:
    """Whether a touch holds what it should, whatever a source sent."""
    noise_um = SMALLEST_NOISE_UM if touch.noise_um is None else touch.noise_um
    sizes = [number(one, LARGEST_LIMIT_UM) for one in (touch.value_um, noise_um)]
    named = isinstance(touch.output, str) and (touch.number is None or type(touch.number) is int)  # pyright: ignore[reportUnnecessaryIsInstance] - whatever is sent
    return named and None not in (*sizes, number(touch.time_s)) and noise_um >= SMALLEST_NOISE_UM
