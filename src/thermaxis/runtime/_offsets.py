"""Where the offsets stand: a pure step from what the machine says to where a cycle goes on.

Between two writes the machine shows each offset at A (accepted) and, where it tells, at E (acting).
A control may take offsets over late and go there at its own rate, but in the order in which they
were written: A lies on a path that begins at b, where A was seen, and leads over all w that were
written since, of which those that A has passed are forgotten. So, by the tolerance t,

    min(b, w) - t <= A <= max(b, w) + t,

and E lies between where it was seen and the A of then and of now. What lies outside has moved by
itself, and the correction goes on from there. After a silence, a lost connection or a cycle
without a write nothing kept the offset, so that it is found anew as well. For a while then what had
been written may still arrive, and a watchdog take it away: what lies between it and zero is waited
for where writes are answered, and is no other writer's; from zero itself the correction goes on.
"""

import math
from collections.abc import Collection, Mapping, Sequence
from datetime import datetime, timedelta
from typing import Final, NamedTuple

from thermaxis.compensation import Compensation
from thermaxis.runtime._ports import Applied

SILENCE_CYCLES: Final = 1.5
"""After a silence of so many cycles the machine may have taken its offset back. [1]"""
SHORTEST_SILENCE_S: Final = 0.5
"""A silence is at least so long. [s]"""
LARGEST_FOUND_UM: Final = 1e5
"""A found offset of a hundred millimetres and more is a wrong unit: nothing is written. [µm]"""
OTHERS_WITHIN_S: Final = 60.0
"""Another writer is a fault when it is seen `MOST_OTHERS` times within so long. [s]"""
MOST_OTHERS: Final = 3
"""So often. [1]"""
OTHERS_APART_S: Final = 1.0
"""What another writer changes within so long counts once: the control may go there slowly. [s]"""
PROGRESS: Final = 0.1
"""Share of the tolerance that a machine's rounding takes: half of a tenth, and a whole one for an
acting offset that comes nearer. Values of a path that differ by no more are kept as one. [1]"""
_UNKNOWN = Applied(None, None)


class OffsetMismatch(NamedTuple):
    """An offset that was not where the loop had left it."""

    output: str
    """Name of the output."""
    found_um: float
    """Where it was found. [µm]"""
    left_um: float
    """Where it was left. [µm]"""
    number: int
    """Number of the cycle that found it. [1]"""
    another: bool = False
    """Whether nothing but another writer explains it."""

    @property
    def key(self) -> str:
        """What tells it from others; each time is an alarm of its own."""
        return f"offset mismatch {self.output} {self.number}"


class OffsetRules(NamedTuple):
    """What the step needs of a compensation."""

    names: tuple[str, ...]
    total_um: tuple[float, ...]
    tolerance_um: float
    read_back_s: float
    silence_s: float


class Span(NamedTuple):
    """Values of a path that differ by next to nothing."""

    since_s: float
    low_um: float
    high_um: float


class Path(NamedTuple):
    """Where an offset was seen, and where it is led from there."""

    begin_um: float
    spans: tuple[Span, ...] = ()

    @property
    def hull_um(self) -> tuple[float, float]:
        """The least and the greatest of it. [µm]"""
        low_um = min([self.begin_um, *(span.low_um for span in self.spans)])
        return low_um, max([self.begin_um, *(span.high_um for span in self.spans)])

    def beyond_um(self, um: float) -> float:
        """By how much a value lies outside. [µm]"""
        low_um, high_um = self.hull_um
        return max(low_um - um, um - high_um)

    def further(self, um: float, time_s: float, rules: "OffsetRules") -> "Path":
        """Return the path led on; what was passed over for ``read_back_s`` is forgotten."""
        ended = sum(span.since_s < time_s - rules.read_back_s for span in self.spans[1:])
        spans = self.spans[ended:]
        if spans:
            since_s, low_um, high_um = spans[-1]
            low_um, high_um = min(low_um, um), max(high_um, um)
            if high_um - low_um <= PROGRESS * rules.tolerance_um:
                return Path(self.begin_um, (*spans[:-1], Span(since_s, low_um, high_um)))
        return Path(self.begin_um, (*spans, Span(time_s, um, um)))

    def reached(self, um: float, rules: "OffsetRules") -> "Path":
        """Return the path that is left once a value was seen, by its earliest place there."""
        rounding_um = PROGRESS * rules.tolerance_um
        if abs(um - self.begin_um) <= rounding_um:
            return self
        low_um = high_um = self.begin_um
        for k, span in enumerate(self.spans):
            low_um, high_um = min(low_um, span.low_um), max(high_um, span.high_um)
            if max(low_um - um, um - high_um) <= rounding_um:
                return Path(um, self.spans[k:])
        return self


class OutputOffset(NamedTuple):
    """What is known of one offset."""

    written: Path | None = None
    """Path of what is accepted: what was written since it was found; None for nothing."""
    acts: Path | None = None
    """Where it was seen to act, and what was accepted then; None where the machine is silent."""
    earlier: Span | None = None
    """Zero, and all that was written before it was found: it may still be on its way."""
    left_um: float | None = None
    """Last written offset that was answered, or the one that was found. [µm]"""
    effective_um: float | None = None
    """Where it was seen to act, and to follow. [µm]"""
    followed_s: float = float("-inf")
    """When that was. [s]"""
    moving: bool = False
    """Whether it was not where it had been left at the last look either."""


class OffsetsState(NamedTuple):
    """What one cycle leaves for the next one."""

    outputs: tuple[OutputOffset, ...]
    known: bool = False
    """Whether the offsets were read since the connection, and can be offsets."""
    doubtful: bool = False
    """Whether nothing has kept them since."""
    late: bool = False
    """Whether the last write was not answered well: the machine's watchdog may have tripped."""
    touched_s: float = float("inf")
    """When the machine was last looked at, or written to. [s]"""
    touched: datetime | None = None
    """The same as time of day, which goes on while a computer sleeps."""
    others_s: tuple[float, ...] = ()
    """When another writer was seen. [s]"""
    mismatches: tuple[OffsetMismatch, ...] = ()
    """What nobody has acknowledged yet, the last of every output."""


class Look(NamedTuple):
    """What the machine shows before a write."""

    number: int
    """Number of the cycle. [1]"""
    time_s: float
    """When it was asked, monotonic. [s]"""
    utc: datetime
    """The same as time of day."""
    connected: bool
    """Whether it can be written to."""
    news_um: Mapping[str, float | None] | None
    """Offsets that were found at a connection, if it is news. [µm]"""
    applied: Mapping[str, Applied]
    """What it says about every offset."""


class Found(NamedTuple):
    """Where a cycle goes on."""

    found_um: tuple[float | None, ...] | None = None
    """Offsets that are not where they were left; None where the written ones stand. [µm]"""
    read_back_um: tuple[float | None, ...] | None = None
    """What the machine reports of those that stand; None where nothing could be read. [µm]"""
    told: tuple[OffsetMismatch, ...] = ()
    """Mismatches that are new."""
    unusable: bool = False
    """Whether what was found can be no offset, and has just been so."""
    other_writer: bool = False
    """Whether another writer was seen too often."""


def offset_rules(compensation: Compensation) -> OffsetRules:
    """Return what the step needs of a compensation."""
    rules = compensation.supervisor
    return OffsetRules(
        tuple(output.name for output in compensation.model.outputs),
        tuple(limits.total_um for limits in compensation.bounds),
        rules.read_back_tolerance_um,
        rules.read_back_s,
        max(SILENCE_CYCLES * compensation.cycle_s, SHORTEST_SILENCE_S),
    )


def is_silent(rules: OffsetRules, state: OffsetsState, time_s: float, utc: datetime) -> bool:
    """Whether the machine has not been looked at or written to for too long."""
    by_day_s = 0.0 if state.touched is None else (utc - state.touched) / timedelta(seconds=1)
    return max(time_s - state.touched_s, by_day_s) > rules.silence_s


def look_step(rules: OffsetRules, state: OffsetsState, look: Look) -> tuple[OffsetsState, Found]:
    """Compare what the machine shows with what was written; say where the cycle goes on.

    Not protected: between the look and the write, some milliseconds, nothing is noticed; nor is an
    offset that was moved by less than the tolerance, or put back before the look. What was found
    is not saved: a restart tells of it no more, and only the history has it.
    """
    recent = tuple(s for s in state.others_s if look.time_s - s <= OTHERS_WITHIN_S)
    state = state._replace(others_s=recent)
    if not look.connected:
        state, found = state._replace(known=False, doubtful=False), Found()
    else:
        silent = state.known and is_silent(rules, state, look.time_s, look.utc)
        if look.news_um is not None or state.doubtful or silent or not state.known:
            state, found = _find(rules, state._replace(doubtful=state.doubtful or silent), look)
        else:
            state, found = _follow(rules, state, look)
    for one in found.told:
        others = tuple(m for m in state.mismatches if m.output != one.output)
        state = state._replace(mismatches=(*others, one))
    return state, found._replace(other_writer=len(state.others_s) >= MOST_OTHERS)


def write_step(
    rules: OffsetRules,
    state: OffsetsState,
    written_um: Sequence[float],
    at: tuple[float, datetime],
    *,
    answered: bool,
) -> OffsetsState:
    """Note a write that was begun at a time; without an answer it may have arrived all the same."""
    outputs = tuple(
        one._replace(
            written=(one.written or Path(um)).further(um, at[0], rules),
            left_um=um if answered or one.left_um is None else one.left_um,
        )
        for one, um in zip(state.outputs, written_um, strict=True)
    )
    return state._replace(outputs=outputs, late=not answered, touched_s=at[0], touched=at[1])


def rest_step(state: OffsetsState, *, off: bool) -> OffsetsState:
    """Note a cycle without a write: nothing keeps an offset, and switched off it is anybody's."""
    outputs = (OutputOffset(),) * len(state.outputs) if off else state.outputs
    return state._replace(outputs=outputs, doubtful=state.doubtful or state.known, late=False)


def acknowledged(state: OffsetsState, shown: Collection[str]) -> OffsetsState:
    """Return the state without the mismatches that somebody has seen."""
    return state._replace(mismatches=tuple(m for m in state.mismatches if m.key not in shown))


# ---- found anew ---------------------------------------------------------------------------------


def _find(rules: OffsetRules, state: OffsetsState, look: Look) -> tuple[OffsetsState, Found]:
    """Take the offsets as they stand: what acts where the machine tells, else what it accepted."""
    said = [look.applied.get(name, _UNKNOWN) for name in rules.names]
    row = [one.accepted_um if one.effective_um is None else one.effective_um for one in said]
    if look.news_um is not None:
        row = [look.news_um.get(name) for name in rules.names]
    elif not (state.known or state.doubtful):  # the sink has not told what it found yet
        return state, Found()
    known = all(um is not None and abs(um) <= LARGEST_FOUND_UM for um in row)
    unusable = not known and not state.doubtful
    found = Found(tuple(_snapped(rules, k, um) for k, um in enumerate(row)), unusable=unusable)
    state = state._replace(known=known, doubtful=not known, late=False)
    if not known:
        return state, found
    told: list[OffsetMismatch] = []
    outputs: list[OutputOffset] = []
    for k, one in enumerate(state.outputs):
        um = row[k] or 0.0
        paths = [path.beyond_um(um) for path in (one.written, one.acts) if path is not None]
        moves = min(paths, default=-math.inf) > rules.tolerance_um
        if moves and not (one.moving and look.news_um is None):
            told.append(_mismatch(rules, k, one, um, look.number))
        at_s, moving = look.time_s, moves and look.news_um is None
        outputs.append(_standing(rules, one, um, said[k], at_s, moving=moving, since_s=at_s))
    state = state._replace(outputs=tuple(outputs), touched_s=look.time_s, touched=look.utc)
    return state, found._replace(told=tuple(told))


def _snapped(rules: OffsetRules, k: int, um: float | None) -> float | None:
    """Return an offset that is beyond its total by a rounding of the machine as the total."""
    total_um = rules.total_um[k]
    if um is None or not total_um < abs(um) <= total_um + rules.tolerance_um:
        return um
    return math.copysign(total_um, um)


def _standing(
    rules: OffsetRules,
    one: OutputOffset,
    um: float,
    said: Applied,
    time_s: float,
    *,
    moving: bool,
    since_s: float | None,
) -> OutputOffset:
    """Return an offset that goes on from where it was found.

    What was written may be on its way since a time; after another writer it is no proof any more.
    """
    _, accepted_um, effective_um = said
    begin_um = um if accepted_um is None else accepted_um
    path = None if effective_um is None else Path(effective_um).further(begin_um, time_s, rules)
    earlier = None
    if one.written is not None and since_s is not None:
        _, *ends_um = one.earlier or Span(since_s, 0.0, 0.0)
        ends_um += one.written.hull_um
        earlier = Span(since_s, min(ends_um), max(ends_um))
    return OutputOffset(
        written=Path(begin_um).further(um, time_s, rules),
        acts=path,
        earlier=earlier,
        left_um=um,
        effective_um=effective_um,
        followed_s=time_s,
        moving=moving,
    )


# ---- looked at between two writes ---------------------------------------------------------------


def _follow(rules: OffsetRules, state: OffsetsState, look: Look) -> tuple[OffsetsState, Found]:
    """Judge offsets that were written in the last cycle."""
    said = [look.applied.get(name, _UNKNOWN) for name in rules.names]
    if any(one.accepted_um is None for one in said):
        return state._replace(doubtful=True), Found()
    told: list[OffsetMismatch] = []
    outputs: list[OutputOffset] = []
    found: list[float | None] = []
    others_s = state.others_s
    apart = not others_s or look.time_s - others_s[-1] >= OTHERS_APART_S
    for k, one in enumerate(state.outputs):
        if one.earlier is not None and look.time_s - one.earlier.since_s > rules.read_back_s:
            one = one._replace(earlier=None)  # noqa: PLW2901
        um = _moved_to(rules, one, said[k], late=state.late)
        found.append(_snapped(rules, k, um))
        if um is None:
            outputs.append(_followed(rules, one, said[k], look.time_s))
            continue
        another = um == said[k].accepted_um and not _explained(rules, one, um, late=state.late)
        if (apart if another else not one.moving) and len(others_s) < MOST_OTHERS:
            told.append(_mismatch(rules, k, one, um, look.number, another=another))
        if another and apart:
            state = state._replace(others_s=(*others_s, look.time_s)[-MOST_OTHERS:])
        since_s = look.time_s if one.earlier is None else one.earlier.since_s
        since_s = None if another else since_s
        outputs.append(
            _standing(rules, one, um, said[k], look.time_s, moving=True, since_s=since_s)
        )
    state = state._replace(outputs=tuple(outputs), touched_s=look.time_s, touched=look.utc)
    moved = any(um is not None for um in found)
    read_back = tuple(
        _believed(rules, *row, look.time_s) for row in zip(outputs, said, strict=True)
    )
    return state, Found(tuple(found) if moved else None, read_back, tuple(told))


def _moved_to(rules: OffsetRules, one: OutputOffset, said: Applied, *, late: bool) -> float | None:
    """Return where an offset has gone by itself: accepted, or acting alone; None if it has not."""
    _, accepted_um, effective_um = said
    if accepted_um is None or one.written is None:
        return accepted_um
    if one.written.beyond_um(accepted_um) > rules.tolerance_um:
        at_zero = abs(accepted_um) <= rules.tolerance_um
        waited = not (late or at_zero) and _explained(rules, one, accepted_um, late=False)
        return None if waited else accepted_um
    if effective_um is None or one.acts is None:
        return None
    beyond_um = one.acts.further(accepted_um, 0.0, rules).beyond_um(effective_um)
    return effective_um if beyond_um > rules.tolerance_um else None


def _explained(rules: OffsetRules, one: OutputOffset, um: float, *, late: bool) -> bool:
    """Whether it is the watchdog's zero, the way there, or an own write that came late."""
    spans = () if one.earlier is None else (one.earlier,)
    if late and one.written is not None:
        spans = (*spans, Span(0.0, *one.written.hull_um))
    return Path(0.0, spans).beyond_um(um) <= rules.tolerance_um


def _followed(rules: OffsetRules, one: OutputOffset, said: Applied, time_s: float) -> OutputOffset:
    """Note where an offset is seen, and whether what acts has come nearer to what was accepted."""
    _, accepted_um, effective_um = said
    if accepted_um is None or one.written is None:
        return one
    one = one._replace(written=one.written.reached(accepted_um, rules), moving=False)
    if effective_um is None:
        return one._replace(acts=None, effective_um=None)
    one = one._replace(acts=Path(effective_um).further(accepted_um, time_s, rules))
    before_um = effective_um if one.effective_um is None else one.effective_um
    gone_um, to_go_um = effective_um - before_um, accepted_um - before_um
    nearer = gone_um * to_go_um > 0.0 and abs(gone_um) >= PROGRESS * rules.tolerance_um
    if nearer or abs(effective_um - accepted_um) <= rules.tolerance_um:
        return one._replace(effective_um=effective_um, followed_s=time_s)
    return one


def _believed(rules: OffsetRules, one: OutputOffset, said: Applied, time_s: float) -> float | None:
    """Return what counts as read back: what acts, too, where it stands and should move."""
    _, accepted_um, effective_um = said
    if accepted_um is None or effective_um is None or one.left_um is None:
        return accepted_um
    if abs(effective_um - accepted_um) <= rules.tolerance_um:
        return accepted_um
    if time_s - one.followed_s <= rules.silence_s:
        return accepted_um
    left_um = one.left_um
    return max(accepted_um, effective_um, key=lambda um: abs(um - left_um))


# ---- parts --------------------------------------------------------------------------------------


def _mismatch(
    rules: OffsetRules, k: int, one: OutputOffset, um: float, number: int, *, another: bool = False
) -> OffsetMismatch:
    left_um = um if one.left_um is None else one.left_um
    return OffsetMismatch(rules.names[k], um, left_um, number, another)
