"""Where the offsets stand: a pure step from what the machine says to where a cycle goes on.

Between two writes the machine shows each offset at A (accepted) and, where it tells, at E (acting).
A control may take offsets over late and go there at its own rate, but in the order in which they
were written: A lies on a path that begins at b, where A was seen, and leads over all w that were
written since, of which those that A has passed are forgotten. So, by the tolerance t,

    min(b, w) - t <= A <= max(b, w) + t,

and E lies between where it followed last and the A of then and of now. What lies outside has moved
by itself, and the correction goes on from there; after a silence, a lost connection or a cycle
without a write nothing kept the offset, so that it is found anew as well. What had been written
before may still arrive for `read_back_s`; until something newer is seen the control may yet take
that over, and it is waited for. Zero is a watchdog's doing, and so are values that come nearer to
it look by look; any other A is another writer's.

While own writes may still be under way, by the largest time that one took so far, A outside of the
path says nothing of what will stand: nothing is written until A is back on the path, or has stood
still for as long; then the correction goes on from the newest own write, or from A.
"""

import math
from collections.abc import Collection, Iterable, Mapping, Sequence
from datetime import datetime, timedelta
from itertools import pairwise
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
ROUNDING: Final = 0.1
"""Share of the tolerance that a machine's rounding takes: half of a tenth, and a whole one for an
acting offset that comes nearer. [1]"""
FOLLOWS_S: Final = 10.0
"""What acts stands when it has come no nearer to what was accepted for so long. [s]"""
REST_SHARE: Final = 1.5
"""An own write may be under way for so many times the largest time that one took. [1]"""
STOOD_SHARE: Final = 0.5
"""Drives are off, and what acts is no more late, when it has stood for this share of `read_back_s`
while an interlock is open. [1]"""
_UNKNOWN = Applied(None, None)


class OffsetMismatch(NamedTuple):
    """An offset that was not where the loop had left it."""

    output: str
    found_um: float
    left_um: float
    number: int  # of the cycle that found it
    another: bool | None = False
    """Whether nothing but another writer explains it; None where the next look tells."""
    utc: datetime | None = None

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

    @property
    def rounding_um(self) -> float:
        """What a machine rounds. [µm]"""
        return ROUNDING * self.tolerance_um


class Mark(NamedTuple):
    """Where an offset was seen or led, and since when."""

    since_s: float
    um: float


class OutputOffset(NamedTuple):
    """What is known of one offset."""

    path: tuple[Mark, ...] = ()
    """Where what is accepted was seen, and what was written since; empty for nothing known."""
    late: tuple[Mark, ...] = ()
    """Ends of what had been written when it was found anew: it may be on its way."""
    followed: Mark | None = None
    """Where it acted when it was last seen to follow; None where the machine is silent."""
    moved: OffsetMismatch | None = None
    """Where it had gone by itself at the last look; None where it had not."""
    resting: Mark | None = None
    """Since when nothing is written as it is off its path, and where it was seen last."""
    aside: Mark | None = None
    """Where it was accepted off its path; what acts may still go there."""


class OffsetsState(NamedTuple):
    """What one cycle leaves for the next one."""

    outputs: tuple[OutputOffset, ...]
    known: bool = False
    """Whether the offsets were read since the connection, and can be offsets."""
    doubtful: bool = False
    """Whether nothing has kept them since."""
    touched_s: float = float("inf")
    """When the machine was last looked at, or written to. [s]"""
    touched: datetime | None = None
    """The same as time of day, which goes on while a computer sleeps."""
    others_s: tuple[float, ...] = ()
    """When another writer was seen. [s]"""
    mismatches: tuple[OffsetMismatch, ...] = ()
    """What nobody has acknowledged yet, the last of every output."""
    written_s: float = -math.inf
    """When the newest offsets were written. [s]"""
    late_s: float | None = None
    """Largest time for which a write was not seen yet; None where none was seen. [s]"""


class Look(NamedTuple):
    """What the machine shows before a write, and when it was asked."""

    number: int
    time_s: float
    utc: datetime
    connected: bool
    """Whether it can be written to."""
    news_um: Mapping[str, float | None] | None
    """Offsets that were found at a connection, if it is news. [µm]"""
    applied: Mapping[str, Applied]
    interlocked: bool = False
    """Whether an interlock is open, or was a moment ago: drives that are off follow nothing."""


class Found(NamedTuple):
    """Where a cycle goes on."""

    found_um: tuple[float | None, ...] | None = None
    """Offsets that are not where they were left; None where the written ones stand. [µm]"""
    read_back_um: tuple[float | None, ...] | None = None
    """What the machine reports of those that stand; None where nothing could be read. [µm]"""
    told: tuple[OffsetMismatch, ...] = ()
    unusable: bool = False
    """Whether what was found can be no offset, and has just been so."""
    other_writer: bool = False
    """Whether another writer was seen too often."""
    rests: bool = False
    """Whether nothing may be written, as own writes may be under way."""


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


def is_stale(rules: OffsetRules, state: OffsetsState, time_s: float, utc: datetime) -> bool:
    """Whether the offsets may have been taken back since they were looked at or written."""
    by_day_s = 0.0 if state.touched is None else (utc - state.touched) / timedelta(seconds=1)
    silent = max(time_s - state.touched_s, by_day_s) > rules.silence_s
    return state.doubtful or (state.known and silent)


def standing(rules: OffsetRules, state: OffsetsState) -> frozenset[str]:
    """Return the offsets of which what acts does not follow what was accepted."""
    marks = zip(rules.names, (one.followed for one in state.outputs), strict=True)
    return frozenset(
        name for name, mark in marks if mark and state.touched_s - mark.since_s > FOLLOWS_S
    )


# ---- the steps ----------------------------------------------------------------------------------


def look_step(rules: OffsetRules, state: OffsetsState, look: Look) -> tuple[OffsetsState, Found]:
    """Compare what the machine shows with what was written; say where the cycle goes on.

    Not protected: between the look and the write, some milliseconds, nothing is noticed; nor is an
    offset that was moved by less than the tolerance, or put back before the look. A watchdog's way
    that one look alone sees counts as another writer's.
    """
    recent = tuple(s for s in state.others_s if look.time_s - s <= OTHERS_WITHIN_S)
    state = state._replace(others_s=recent)
    if look.connected:
        state, found = _looked(rules, state, look)
    else:
        state, found = state._replace(known=False, doubtful=False), Found()
    for one in found.told:
        others = tuple(m for m in state.mismatches if m.output != one.output)
        state = state._replace(mismatches=(*others, one))
    return state, found._replace(other_writer=len(state.others_s) >= MOST_OTHERS)


def write_step(
    rules: OffsetRules,
    state: OffsetsState,
    written_um: Sequence[float],
    at: tuple[float, datetime],
) -> OffsetsState:
    """Note a write that was begun at a time; without an answer it may have arrived all the same."""
    outputs = tuple(
        one._replace(path=_led(rules, one.path, um, at[0]))
        for one, um in zip(state.outputs, written_um, strict=True)
    )
    return state._replace(outputs=outputs, touched_s=at[0], touched=at[1], written_s=at[0])


def rest_step(state: OffsetsState, *, off: bool) -> OffsetsState:
    """Note a cycle without a write: nothing keeps an offset, and switched off it is anybody's."""
    outputs = (OutputOffset(),) * len(state.outputs) if off else state.outputs
    return state._replace(outputs=outputs, doubtful=state.doubtful or state.known)


def acknowledged(state: OffsetsState, shown: Collection[str]) -> OffsetsState:
    """Return the state without the mismatches that somebody has seen."""
    return state._replace(mismatches=tuple(m for m in state.mismatches if m.key not in shown))


# ---- all offsets --------------------------------------------------------------------------------


def _looked(rules: OffsetRules, state: OffsetsState, look: Look) -> tuple[OffsetsState, Found]:
    said = [look.applied.get(name, _UNKNOWN) for name in rules.names]
    stale = is_stale(rules, state, look.time_s, look.utc)
    anew = stale or not state.known or look.news_um is not None
    row = [one.effective_um if anew and one.effective_um is not None else one[1] for one in said]
    if look.news_um is not None:
        row = [look.news_um.get(name) for name in rules.names]
    elif not (state.known or stale):  # the sink has not told yet what it found
        return state, Found()
    rested = any(one.resting is not None for one in state.outputs)
    if not anew and None in row:
        return state._replace(doubtful=True), Found(rests=rested)
    if anew:
        known = all(um is not None and abs(um) <= LARGEST_FOUND_UM for um in row)
        state = state._replace(known=known, doubtful=not known)
        if not known:
            return state, Found(_snapped(rules, row), unusable=not stale)
    state, gone, told = _compared(rules, state, look, said, row if anew else None)
    if anew:
        return state, Found(_snapped(rules, row), told=told)
    rests = any(one.resting is not None for one in state.outputs)
    if rests or rested:
        newest_um = _snapped(rules, (one.path[-1].um for one in state.outputs))
        return state, Found(newest_um, told=told, rests=rests)
    pairs = zip(state.outputs, said, strict=True)
    read_back = tuple(_believed(rules, *pair, look.time_s) for pair in pairs)
    if look.interlocked:  # it goes on from where it acts, so that nothing is let go afterwards
        rows = zip(gone, state.outputs, said, read_back, strict=True)
        gone = [
            _stood_um(rules, one, told, read_um, look.time_s) if um is None else um
            for um, one, told, read_um in rows
        ]
    found_um = _snapped(rules, gone) if any(um is not None for um in gone) else None
    return state, Found(found_um, read_back, told)


def _compared(
    rules: OffsetRules,
    state: OffsetsState,
    look: Look,
    said: Sequence[Applied],
    anew_um: Sequence[float | None] | None,
) -> tuple[OffsetsState, list[float | None], tuple[OffsetMismatch, ...]]:
    """Compare every output; return also where each has gone by itself, and what is to be told."""
    apart = not state.others_s or look.time_s - state.others_s[-1] >= OTHERS_APART_S
    outputs: list[OutputOffset] = []
    gone: list[float | None] = []
    told: list[OffsetMismatch] = []
    late_s, until_s = state.late_s, state.written_s + _rest_s(rules, state.late_s)
    for k, one in enumerate(state.outputs):
        um, mismatch = _judged(
            rules, k, one, said[k], look, None if anew_um is None else anew_um[k]
        )
        goes_on = one.resting is not None and anew_um is None  # it is told already
        if goes_on and um is not None and one.moved is not None:
            um = _rested_um(rules, one, said[k], look.time_s, um)
            mismatch = one.moved._replace(found_um=um)
        if anew_um is None and _rests(rules, one, said[k], look.time_s, until_s):
            outputs.append(_resting(rules, one, said[k], look.time_s, mismatch))
            gone.append(None)
        else:
            outputs.append(_going_on(rules, one, said[k], look.time_s, um, mismatch))
            gone.append(um)
            if um is None and len(one.path) > 1 and not one.late:  # else it may be another's
                times_s = look.time_s, state.written_s
                late_s = max(late_s or 0.0, _late_s(rules, one, said[k][1], times_s))
        begins = one.moved is None or look.news_um is not None
        if mismatch is not None and not (goes_on and um is not None):
            told += [mismatch] if (apart if mismatch.another else begins) else []
    others_s = state.others_s
    if any(one.another for one in told):
        others_s = (*others_s, look.time_s)[-MOST_OTHERS:]
    if len(state.others_s) >= MOST_OTHERS:  # the fault says it
        told = [one for one in told if anew_um is not None]
    state = state._replace(
        outputs=tuple(outputs),
        touched_s=look.time_s,
        touched=look.utc,
        others_s=others_s,
        late_s=late_s,
    )
    return state, gone, tuple(told)


def _snapped(rules: OffsetRules, row: Iterable[float | None]) -> tuple[float | None, ...]:
    """Return offsets of which those beyond their total by a rounding of the machine are there."""
    return tuple(
        math.copysign(total_um, um)
        if um is not None and total_um < abs(um) <= total_um + rules.tolerance_um
        else um
        for um, total_um in zip(row, rules.total_um, strict=True)
    )


# ---- one offset ---------------------------------------------------------------------------------


def _judged(
    rules: OffsetRules, k: int, one: OutputOffset, said: Applied, look: Look, anew_um: float | None
) -> tuple[float | None, OffsetMismatch | None]:
    """Return where an offset goes on, if not as it was led, and what that is no consequence of."""
    if anew_um is None:
        um, another = _gone(rules, one, said, look.time_s)
        if um is None and another and one.moved is not None:
            return None, one.moved._replace(another=True)
    else:
        um, another = anew_um, False
        ways_um = [mark.um for mark in (*one.path, one.followed) if mark is not None]
        if not ways_um or _beyond_um(ways_um, um) <= rules.tolerance_um:
            return um, None
    if um is None:
        return None, None
    left_um = one.path[-1].um if one.path else um
    return um, OffsetMismatch(rules.names[k], um, left_um, look.number, another, look.utc)


def _gone(
    rules: OffsetRules, one: OutputOffset, said: Applied, time_s: float
) -> tuple[float | None, bool | None]:
    """Return where an offset has gone by itself, or None, and whether another moved it."""
    um = said.accepted_um
    if um is None:
        return None, False
    path_um, tolerance_um = [mark.um for mark in one.path], rules.tolerance_um
    beyond_um, moved = _beyond_um(path_um, um), one.moved
    if moved is not None and beyond_um > rules.rounding_um and not moved.another:
        nearer_um = abs(moved.found_um) - abs(um)
        if nearer_um > rules.rounding_um and _beyond_um((0.0, moved.found_um), um) <= tolerance_um:
            return um, False  # a watchdog's way
    if beyond_um > tolerance_um:
        pairs = zip(one.late[::2], one.late[1::2], strict=True)
        own = any(_beyond_um((low.um, high.um), um) <= tolerance_um for low, high in pairs)
        if own or abs(um) <= tolerance_um:
            newer = one.path[0].since_s > max((mark.since_s for mark in one.late), default=0.0)
            return um if newer or abs(um) <= tolerance_um else None, False
        nearer = _beyond_um((0.0, *path_um), um) <= tolerance_um
        return um, None if nearer and moved is None else True
    if moved is not None and moved.another is None:  # it went there at once, and stays or follows
        follows = abs(um - moved.found_um) > rules.rounding_um >= beyond_um
        return None, follows or time_s - one.path[0].since_s > rules.read_back_s
    return _astray_um(rules, one, said), False


def _going_on(
    rules: OffsetRules,
    one: OutputOffset,
    said: Applied,
    time_s: float,
    um: float | None,
    mismatch: OffsetMismatch | None,
) -> OutputOffset:
    """Return an offset that goes on as it was led, or from where it has gone."""
    _, accepted_um, effective_um = said
    late = tuple(mark for mark in one.late if time_s - mark.since_s <= rules.read_back_s)
    followed = _followed(rules, one, said, time_s)
    if um is None:
        path = one.path if accepted_um is None else _reached(rules, one.path, accepted_um, time_s)
        undecided = mismatch is None and one.moved is not None and one.moved.another is None
        kept = one.aside is not None and time_s - one.aside.since_s <= rules.read_back_s
        return OutputOffset(
            path,
            late,
            followed,
            one.moved if undecided else None,
            aside=one.aside if kept else None,
        )
    begin = Mark(time_s, um if accepted_um is None else accepted_um)
    others = mismatch is not None and mismatch.another is not False
    if others and one.resting is None:  # own writes had all arrived
        late = ()
    elif one.path:
        own_um = [mark.um for mark in one.path[1:] or one.path]
        if not others:  # on its way from zero, too
            own_um.append(0.0)
        late += (Mark(time_s, min(own_um)), Mark(time_s, max(own_um)))
    followed = None if effective_um is None else Mark(time_s, effective_um)
    return OutputOffset(_led(rules, (begin,), um, time_s), late, followed, mismatch)


def _rest_s(rules: OffsetRules, late_s: float | None) -> float:
    """Return for how long an own write may be under way. [s]"""
    if late_s is None:
        return rules.read_back_s
    longest_s = REST_SHARE * (late_s + rules.silence_s) if late_s > 0.0 else 0.0
    return min(longest_s, rules.read_back_s)


def _late_s(
    rules: OffsetRules, one: OutputOffset, um: float | None, times_s: tuple[float, float]
) -> float:
    """Return for how long a write was not seen: until now, or until the newest one. [s]"""
    time_s, newest_s = times_s
    if um is None:
        return 0.0
    if abs(um - one.path[0].um) <= rules.rounding_um:  # it has not gone on
        far = (m for m in one.path[1:] if abs(m.um - um) > 2.0 * rules.rounding_um)
        return time_s - next(far, Mark(time_s, um)).since_s
    seen = min(one.path[1:], key=lambda mark: abs(mark.um - um))
    near = abs(seen.um - um) <= rules.rounding_um
    return newest_s - seen.since_s if near else 0.0


def _astray_um(rules: OffsetRules, one: OutputOffset, said: Applied) -> float | None:
    """Return what is accepted, or acts, where it lies outside of what was led."""
    _, um, effective_um = said
    path_um = [mark.um for mark in one.path]
    if um is None or not path_um or _beyond_um(path_um, um) > rules.tolerance_um:
        return um if path_um else None
    if effective_um is None or one.followed is None:
        return None
    way_um = [one.followed.um, path_um[0], um]
    if one.aside is not None:
        way_um.append(one.aside.um)
    return effective_um if _beyond_um(way_um, effective_um) > rules.tolerance_um else None


def _rests(
    rules: OffsetRules, one: OutputOffset, said: Applied, time_s: float, until_s: float
) -> bool:
    """Whether an offset is astray while own writes may be under way."""
    um = _astray_um(rules, one, said)
    if um is None:
        return False
    if one.resting is None:
        return time_s < until_s
    moves = abs(um - one.resting.um) > rules.rounding_um
    return (moves or time_s < until_s) and time_s - one.resting.since_s <= rules.read_back_s


def _resting(
    rules: OffsetRules,
    one: OutputOffset,
    said: Applied,
    time_s: float,
    mismatch: OffsetMismatch | None,
) -> OutputOffset:
    """Return an offset that is astray and may come back to its path."""
    um = _astray_um(rules, one, said)
    if um is None:
        return one
    first = one.resting is None
    return one._replace(
        followed=_followed(rules, one, said, time_s),
        moved=mismatch if first else one.moved,
        resting=Mark(time_s if one.resting is None else one.resting.since_s, um),
        aside=one.aside if um != said.accepted_um else Mark(time_s, um),
    )


def _rested_um(
    rules: OffsetRules, one: OutputOffset, said: Applied, time_s: float, um: float
) -> float:
    """Return what acts where a watchdog took it back while nothing was written."""
    if said.effective_um is None or one.followed is None:
        return um
    stood = time_s - one.followed.since_s > rules.silence_s
    return said.effective_um if stood or abs(said.effective_um) <= rules.tolerance_um else um


def _followed(rules: OffsetRules, one: OutputOffset, said: Applied, time_s: float) -> Mark | None:
    """Return where what acts was last seen to have come nearer to what was accepted."""
    _, accepted_um, effective_um = said
    if accepted_um is None or effective_um is None:
        return None
    seen = Mark(time_s, effective_um)
    before_um = effective_um if one.followed is None else one.followed.um
    gone_um, to_go_um = effective_um - before_um, accepted_um - before_um
    nearer = gone_um * to_go_um > 0.0 and abs(gone_um) >= rules.rounding_um
    there = abs(effective_um - accepted_um) <= rules.tolerance_um
    return seen if nearer or there or one.followed is None else one.followed


def _believed(rules: OffsetRules, one: OutputOffset, said: Applied, time_s: float) -> float | None:
    """Return what counts as read back: what acts, too, where it stands and should move."""
    _, accepted_um, effective_um = said
    if accepted_um is None or effective_um is None or one.followed is None:
        return accepted_um
    there = abs(effective_um - accepted_um) <= rules.tolerance_um
    if there or time_s - one.followed.since_s <= rules.silence_s:
        return accepted_um
    return max(accepted_um, effective_um, key=lambda um: abs(um - one.path[-1].um))


def _stood_um(
    rules: OffsetRules, one: OutputOffset, said: Applied, read_um: float | None, time_s: float
) -> float | None:
    """Return what acts, if it has stood long though what was written was accepted."""
    accepted_um = said.accepted_um
    if one.followed is None or time_s - one.followed.since_s <= STOOD_SHARE * rules.read_back_s:
        return None  # it may be late
    if accepted_um is None or abs(accepted_um - one.path[-1].um) > rules.tolerance_um:
        return None
    return None if read_um == accepted_um else read_um


# ---- a path -------------------------------------------------------------------------------------


def _led(rules: OffsetRules, path: tuple[Mark, ...], um: float, time_s: float) -> tuple[Mark, ...]:
    """Return the path led on; what was passed over for ``read_back_s`` is forgotten."""
    if not path:
        return (Mark(time_s, um),)
    ended = sum(mark.since_s < time_s - rules.read_back_s for mark in path[2:])
    path = (path[0], *path[1 + ended :])
    return path if path[-1].um == um else (*path, Mark(time_s, um))


def _reached(
    rules: OffsetRules, path: tuple[Mark, ...], um: float, time_s: float
) -> tuple[Mark, ...]:
    """Return the path that is left once a value was seen, by its earliest place there."""
    if abs(um - path[0].um) <= rules.rounding_um:
        return path
    for k, (one, other) in enumerate(pairwise(path), 1):
        if _beyond_um((one.um, other.um), um) <= rules.rounding_um:
            return (Mark(time_s, um), *path[k:])
    return path


def _beyond_um(values_um: Sequence[float], um: float) -> float:
    """Return by how much a value lies outside of others. [µm]"""
    return max(min(values_um) - um, um - max(values_um))
