"""Plan of a positioning run: targets, order of the visits, how long it takes, and its checks."""

import re
from dataclasses import dataclass
from typing import ClassVar, TypeAlias, final

import numpy as np
from numpy.typing import NDArray

from thermaxis.codes import Message, printable
from thermaxis.errors import ConfigurationError, require_count, require_positive, require_range
from thermaxis.positioning.run import (
    APPROACHES,
    BACKWARD,
    FORWARD,
    Cycle,
    FloatArray,
    PositioningTest,
    TimeSource,
)
from thermaxis.positioning.standard import check_test_conditions, missing_readings
from thermaxis.quantities import AxisKind

IndexArray: TypeAlias = NDArray[np.intp]

MOST_TARGETS = 10_000
"""Largest number of targets of a plan. [1]"""
MOST_STOPS = 1_000_000
"""Largest number of stops of a plan: the longest run that the drift evaluation is made for. [1]"""
LONGEST_TITLE = 200
"""Longest title of a plan. [character]"""
RANDOM_SHARE = 0.3
"""Largest random part of a target unless stated, as a share of the interval; what ISO 230-2:2014
gives where nothing is known of periodic errors (from memory). [1]"""
DISTANCE_FROM_MULTIPLE = 0.1
"""An interval nearer than this to a multiple of the pitch counts as a multiple of it; at this
distance ten neighbouring targets go through all phases. [pitch]"""
VISIBLE_SHARE = 0.3
"""Warn if less than this share of a periodic error's amplitude is sure to be seen. [1]"""
TARGET_TOLERANCE = 0.0015
"""Targets that differ by less are the same: a file has three decimals. [mm or deg]"""
STOP_TOLERANCE_S = 0.1
"""Stops whose median is shorter than planned by more are told. [s]"""
WHOLE_SECONDS_TOLERANCE_S = 0.6
"""The same where all times are whole seconds. [s]"""
LONG_STOP_TOLERANCE_S = 2.0
"""Stops whose median is longer than planned by more are told: acceleration and recording. [s]"""
PAUSE_S = 60.0
"""A stop that is longer than planned by more is a pause. [s]"""

_NAMED = 3  # of the same kind in a sentence
_DECIMALS = 3
_LARGEST = 1e6
_LARGEST_SEED = 2**32
_AXIS_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]{0,15}")


@final
@dataclass(frozen=True, slots=True, eq=False)
class TestPlan:
    """What is to be measured on one axis: where, in which order, how often and how fast.

    Not protected: a plan knows neither the limits of the axis nor what stands in its way. Whoever
    makes an NC program of it compares `lowest` and `highest` with the travel of the axis.

    Raises
    ------
    ConfigurationError
        If targets are not strictly increasing at a thousandth of their unit, a number is not
        finite or out of its range, or the plan has more than a million stops; `where` is the
        name of the field.

    References
    ----------
    Stejskal et al. 2017, equation (1); ISO 230-2:2014, clause 5.3 and Annex B.
    """

    __test__: ClassVar[bool] = False
    """It is no test case, whatever a collector of tests makes of its name."""

    kind: AxisKind
    """Linear (mm, µm) or rotary (deg, arcsec)."""
    axis: str
    """Name of the axis, a letter and up to 15 letters, digits or underscores."""
    target: FloatArray
    """Target positions, (m,), strictly increasing, rounded to three decimals. [mm or deg]"""
    cycles: int
    """Number of cycles n. [1]"""
    feed: float
    """Feed between targets. [mm/min or deg/min]"""
    dwell_s: float
    """Standstill before the laser records. [s]"""
    overrun: float
    """How far the axis passes a target before it comes back to it. [mm or deg]"""
    cycle: Cycle = Cycle.STANDARD
    approaches: tuple[int, ...] = (FORWARD, BACKWARD)
    """Approaches that are recorded; one of them alone makes a unidirectional run."""
    recording_s: float = 0.0
    """Time in which the laser averages at each stop; the reading bears the time of its end. [s]"""
    pitch: float | None = None
    """Pitch of the screw or period of the scale, None if not stated. [mm or deg]"""
    interval: float | None = None
    """Interval p of equation (1), None if the targets were chosen otherwise. [mm or deg]"""
    random_part: float | None = None
    """Half width of the random part r of equation (1), None as above. [mm or deg]"""
    seed: int | None = None
    """Seed of the random part, None as above. [1]"""
    title: str = ""
    """Title in free words; it is data and is escaped wherever it is shown."""

    def __post_init__(self) -> None:
        """Check the numbers and freeze the targets."""
        target = np.round(np.array(self.target, dtype=np.float64), _DECIMALS) + 0.0
        target.setflags(write=False)
        object.__setattr__(self, "target", target)
        object.__setattr__(self, "approaches", tuple(self.approaches))
        self._check_targets()
        self._check_motion()
        self._check_words()

    def _check_targets(self) -> None:
        m = self.target.size
        if self.target.ndim != 1:
            shape = str(self.target.shape)
            raise ConfigurationError("wrong_shape", shape=shape, expected="(m,)", key="target")
        require_count("target", m, 2, MOST_TARGETS)
        for value in self.target.tolist():
            require_range("target", value, -_LARGEST, _LARGEST)
        if not bool(np.all(np.diff(self.target) > 0)):
            raise ConfigurationError("targets_not_rising", key="target")
        require_count("cycles", self.cycles, 1, MOST_STOPS)
        if self.approaches not in {(FORWARD, BACKWARD), (FORWARD,), (BACKWARD,)}:
            raise ConfigurationError("no_approaches", key="approaches")
        stops = m * self.cycles * len(self.approaches)
        if stops > MOST_STOPS:
            raise ConfigurationError("too_many_stops", stops=stops, most=MOST_STOPS, key="cycles")

    def _check_motion(self) -> None:
        for name in ("feed", "overrun"):
            require_positive(name, getattr(self, name), _LARGEST)
        for name in ("dwell_s", "recording_s"):
            require_range(name, getattr(self, name), 0.0, _LARGEST)
        for name in ("pitch", "interval"):
            if getattr(self, name) is not None:
                require_positive(name, getattr(self, name), _LARGEST)
        if self.random_part is not None:
            require_range("random_part", self.random_part, 0.0, _LARGEST)
        if self.seed is not None:
            require_range("seed", self.seed, 0, _LARGEST_SEED)

    def _check_words(self) -> None:
        if _AXIS_NAME.fullmatch(self.axis) is None:
            raise ConfigurationError("no_axis_name", name=self.axis, key="axis")
        if len(self.title) > LONGEST_TITLE:
            raise ConfigurationError(
                "title_too_long", characters=len(self.title), most=LONGEST_TITLE, key="title"
            )
        for k, character in enumerate(self.title):
            if not character.isprintable():
                raise ConfigurationError(
                    "title_not_printable",
                    at=k + 1,
                    character=f"U+{ord(character):04X}",
                    key="title",
                )

    @property
    def stops(self) -> int:
        """Number of stops of the whole run. [1]"""
        return self.target.size * self.cycles * len(self.approaches)

    @property
    def lowest(self) -> float:
        """Lowest position that the axis reaches. [mm or deg]"""
        return float(self.target[0]) - self.overrun

    @property
    def highest(self) -> float:
        """Highest position that the axis reaches. [mm or deg]"""
        return float(self.target[-1]) + self.overrun


# ---- targets ------------------------------------------------------------------------------------


@final
@dataclass(frozen=True, slots=True, eq=False)
class TargetChoice:
    """Targets by equation (1) and how they were chosen."""

    target: FloatArray
    """Target positions, (m,). [mm or deg]"""
    interval: float
    """Interval p. [mm or deg]"""
    random_part: float
    """Half width of the random part r. [mm or deg]"""
    remarks: tuple[Message, ...]


def choose_targets(
    *,
    start: float,
    length: float,
    targets: int,
    pitch: float | None = None,
    random_share: float | None = None,
    seed: int = 1,
) -> TargetChoice:
    """Choose targets by equation (1) of the paper: equal steps plus a random part.

    Every target lies from `start` to `start + length`, its random part included. An interval that
    is a multiple of the pitch, within a tenth of the pitch, is made smaller, so that the targets
    meet a periodic error in all its phases.

    Parameters
    ----------
    start : float
        Lowest position of a target. [mm or deg]
    length : float
        Length within which all targets lie. [mm or deg]
    targets : int
        Number of targets m. [1]
    pitch : float, optional
        Pitch of the screw or period of the scale. Default: unknown. [mm or deg]
    random_share : float, optional
        Half width of the random part as a share of the interval, from 0 to less than 0.5.
        Default: half the pitch, but at most 0.3 of the interval; without a pitch 0.3. [1]
    seed : int
        Seed of the random part. Default: 1. [1]

    Returns
    -------
    TargetChoice
        The targets, rounded to three decimals. The same arguments give the same targets.

    Raises
    ------
    ConfigurationError
        If a number is not finite or out of its range, or targets would change places.

    References
    ----------
    Stejskal et al. 2017, equation (1); ISO 230-2:2014 for the share (from memory); Agilent 5530
    measurements reference guide, p. 1-4, for the rule of the pitch.
    """
    require_range("start", start, -_LARGEST, _LARGEST)
    require_positive("length", length, _LARGEST)
    require_count("targets", targets, 2, MOST_TARGETS)
    if pitch is not None:
        require_positive("pitch", pitch, _LARGEST)
    if random_share is not None and not 0 <= random_share < 0.5:
        raise ConfigurationError("random_share_outside", share=random_share, key="random_share")
    require_range("seed", seed, 0, _LARGEST_SEED)
    interval, amplitude = _equal_steps(length, targets, pitch, random_share)
    remarks: list[Message] = []
    if pitch is None:
        remarks.append(Message("remark-pitch_not_stated"))
    else:
        smaller = _beside_multiple(interval, pitch)
        if smaller < interval:
            left = (targets - 1) * (interval - smaller)
            values = {"before": interval, "interval": smaller, "pitch": pitch, "left": left}
            remarks.append(Message("remark-interval_made_smaller", values))
            interval = smaller
            limit = RANDOM_SHARE if random_share is None else random_share
            amplitude = min(amplitude, limit * interval)
        if random_share is None and amplitude < 0.5 * pitch * (1.0 - 1e-9):
            values = {"share": RANDOM_SHARE, "pitch": pitch}
            remarks.append(Message("remark-random_part_limited", values))
    random = np.random.default_rng(seed)
    offset = random.uniform(-amplitude, amplitude, targets)
    position = start + amplitude + interval * np.arange(targets) + offset
    target = np.round(np.clip(position, start, start + length), _DECIMALS) + 0.0
    if not bool(np.all(np.diff(target) > 0)):
        raise ConfigurationError(
            "targets_change_places", targets=targets, length=length, key="targets"
        )
    return TargetChoice(target, interval, amplitude, tuple(remarks))


def _equal_steps(
    length: float, targets: int, pitch: float | None, share: float | None
) -> tuple[float, float]:
    """Return interval and half width of the random part, so that all targets fit the length."""
    steps = targets - 1
    if share is None and pitch is not None:
        interval = (length - pitch) / steps
        if interval > 0 and 0.5 * pitch <= RANDOM_SHARE * interval:
            return interval, 0.5 * pitch
    share = RANDOM_SHARE if share is None else share
    interval = length / (steps + 2.0 * share)
    return interval, share * interval


def _beside_multiple(interval: float, pitch: float) -> float:
    """Return the interval, made smaller where it is a multiple of the pitch."""
    multiple = round(interval / pitch)
    if multiple < 1 or abs(interval / pitch - multiple) >= DISTANCE_FROM_MULTIPLE:
        return interval
    return (multiple - DISTANCE_FROM_MULTIPLE) * pitch


def periodic_error_visibility(target: FloatArray, pitch: float) -> float:
    """Return how much of a periodic error the targets show in its worst phase.

    The smallest root mean square, over all phases, of a sine with the period of the pitch at the
    targets, after a straight line was taken out, relative to that of a sine met in all phases:
    0 where it is hidden, about 1 where all phases are met. [1]
    """
    angle = 2.0 * np.pi * target / pitch
    waves = np.stack((np.cos(angle), np.sin(angle)), axis=1)
    x = (target - np.mean(target)) / np.ptp(target)
    line, _ = np.linalg.qr(np.stack((np.ones_like(x), x), axis=1))
    left = waves - line @ (line.T @ waves)
    return float(np.linalg.svd(left, compute_uv=False)[-1] / np.sqrt(target.size / 2.0))


# ---- order and time of the stops ----------------------------------------------------------------


@final
@dataclass(frozen=True, slots=True, eq=False)
class Visits:
    """All stops of a run in the order in which they are driven to."""

    target: IndexArray
    """Index of the target of each stop, from 0, (N,). [1]"""
    cycle: IndexArray
    """Index of its cycle, from 0, (N,). [1]"""
    approach: IndexArray
    """Its approach, 0 forward, 1 backward, (N,). [1]"""

    @property
    def place(self) -> tuple[IndexArray, IndexArray, IndexArray]:
        """Index of each stop in an array of readings (m, n, 2)."""
        return self.target, self.cycle, self.approach


def order_of_visits(plan: TestPlan) -> Visits:
    """Return the stops of a plan in the order in which they are driven to.

    standard
        All targets forward, then all backward, cycle after cycle.
    step
        A target from its approaches in turn, all cycles of it, before the next target.
    pilgrim
        A window of n targets, forward and back, that moves on by one target at a time; windows
        that overlap an end of the axis are cut. So every target is visited n times.

    References
    ----------
    ISO 230-2:2014, clause 5.3 and Annex B; the pilgrim step as laser software offers it.
    """
    return visits_of(plan.target.size, plan.cycles, plan.approaches, plan.cycle)


def visits_of(targets: int, cycles: int, approaches: tuple[int, ...], order: Cycle) -> Visits:
    """Return the stops of a run in the order of its visits, as `order_of_visits` says."""
    shape = (targets, cycles, len(approaches))
    index: tuple[IndexArray, ...] = np.unravel_index(
        np.arange(targets * cycles * len(approaches)), shape
    )
    i, j, k = index
    approach = np.array(approaches, dtype=np.intp)[k]
    along = np.where(approach == FORWARD, i, -i)
    keys = {
        Cycle.STANDARD: (along, approach, j),
        Cycle.STEP: (approach, j, i),
        Cycle.PILGRIM: (along, approach, i + j),  # the window starts at i + j - n + 1
    }[order]
    driven = np.lexsort(keys)
    return Visits(i[driven], j[driven], approach[driven])


@final
@dataclass(frozen=True, slots=True)
class Duration:
    """How long a plan takes, by its parts; acceleration and block changes are not in it."""

    moves_s: float
    """Travel from target to target at the feed. [s]"""
    overrun_s: float
    """Further travel to pass a target and come back to it, and to the first one. [s]"""
    dwell_s: float
    """Standstill before the laser records. [s]"""
    recording_s: float
    """Time in which the laser records. [s]"""

    @property
    def total_s(self) -> float:
        """From the start of the motion to the last reading. [s]"""
        return self.moves_s + self.overrun_s + self.dwell_s + self.recording_s


def _travel(plan: TestPlan, visits: Visits) -> tuple[FloatArray, FloatArray]:
    """Return the direct way to each stop and what is driven in addition, (N,) each.

    The axis starts one overrun before the first stop. A target that is not ahead in the wanted
    direction is passed by the overrun and then approached from there.
    """
    direction = np.where(visits.approach == FORWARD, 1.0, -1.0)
    position = plan.target[visits.target]
    turn = position - direction * plan.overrun
    before = np.concatenate((position[:1], position[:-1]))
    direct = np.abs(position - before)
    ahead = direction * (position - before) > 0
    more = np.where(ahead, 0.0, np.abs(turn - before) + plan.overrun - direct)
    more[0] = plan.overrun
    return direct, more


def evaluate_duration(plan: TestPlan) -> Duration:
    """Return how long a plan takes by its motion, dwell and recording alone.

    Returns
    -------
    Duration
        The parts of the time; the axis moves at the feed from the first instant.
    """
    direct, more = _travel(plan, order_of_visits(plan))
    minute = 60.0 / plan.feed
    return Duration(
        moves_s=float(np.sum(direct)) * minute,
        overrun_s=float(np.sum(more)) * minute,
        dwell_s=plan.stops * plan.dwell_s,
        recording_s=plan.stops * plan.recording_s,
    )


def planned_test(plan: TestPlan) -> PositioningTest:
    """Return the run that a plan asks for, as if it had been measured without any deviation.

    Returns
    -------
    PositioningTest
        Deviations are zero; times count from the first reading. [µm or arcsec, s]
    """
    visits = order_of_visits(plan)
    direct, more = _travel(plan, visits)
    time = np.cumsum((direct + more) * (60.0 / plan.feed) + plan.dwell_s + plan.recording_s)
    shape = (plan.target.size, plan.cycles, 2)
    deviation, time_s, order = (np.full(shape, np.nan) for _ in range(3))
    deviation[visits.place] = 0.0
    time_s[visits.place] = time - time[0]
    order[visits.place] = np.arange(1.0, time.size + 1.0)
    return PositioningTest(
        kind=plan.kind,
        target=plan.target,
        deviation=deviation,
        time_source=TimeSource.FILE,
        time_s=time_s,
        order=order,
        cycle=plan.cycle,
        header={"axis": plan.axis},
    )


# ---- checks -------------------------------------------------------------------------------------


def check_plan(plan: TestPlan) -> tuple[Message, ...]:
    """Compare a plan with the test conditions of ISO 230-2 and with the pitch.

    Returns
    -------
    tuple of Message
        A warning for each condition that the plan does not meet. Empty if it meets all.

    References
    ----------
    As of `check_test_conditions`; Agilent 5530 measurements reference guide, p. 1-4 (pitch).
    """
    warnings = check_test_conditions(planned_test(plan))
    if plan.pitch is None or plan.target.size < 4:
        return warnings
    visible = periodic_error_visibility(plan.target, plan.pitch)
    if visible >= VISIBLE_SHARE:
        return warnings
    unit = plan.kind.units.position
    values = {"pitch": plan.pitch, "unit": unit, "visible_percent": 100.0 * visible}
    return (*warnings, Message("warning-periodic_error_hidden", values))


def check_against_plan(test: PositioningTest, plan: TestPlan) -> tuple[Message, ...]:
    """Compare a measured run with the plan that it was to follow.

    Returns
    -------
    tuple of Message
        A warning for each difference, and for each comparison that the file does not allow.
        Empty if the run follows the plan.
    """
    if test.kind is not plan.kind:
        values = {"kind": str(test.kind), "planned": str(plan.kind)}
        return (Message("warning-other_kind", values),)
    warnings = [*_other_axis(test, plan), *_other_cycle(test, plan)]
    targets = _other_targets(test, plan)
    if targets:
        return (*warnings, *targets, Message("warning-targets_differ"))
    shared = test.deviation[:, : plan.cycles]
    approaches = [a for a in plan.approaches if a in test.approaches]
    warnings += missing_readings(shared, approaches, "warning-planned_readings_missing")
    return (*warnings, *_other_order(test, plan))


def _other_axis(test: PositioningTest, plan: TestPlan) -> list[Message]:
    stated = test.header.get("axis", "").strip()
    if not stated or stated.casefold() == plan.axis.casefold():
        return []
    values = {"axis": printable(stated, 40), "planned": plan.axis}
    return [Message("warning-other_axis", values)]


def _other_cycle(test: PositioningTest, plan: TestPlan) -> list[Message]:
    warnings: list[Message] = []
    if test.cycle is not plan.cycle:
        values = {"cycle": str(test.cycle), "planned": str(plan.cycle)}
        warnings.append(Message("warning-other_cycle", values))
    if test.cycles != plan.cycles:
        values = {"cycles": test.cycles, "planned": plan.cycles}
        warnings.append(Message("warning-other_number_of_cycles", values))
    for approach, name in enumerate(APPROACHES):
        measured, planned = approach in test.approaches, approach in plan.approaches
        if measured != planned:
            code = "warning-approach_not_planned" if measured else "warning-approach_not_measured"
            warnings.append(Message(code, {"approach": name}))
    return warnings


def _other_targets(test: PositioningTest, plan: TestPlan) -> list[Message]:
    unit = test.kind.units.position
    measured, planned = test.target, plan.target
    if measured.size == planned.size:
        off = np.flatnonzero(np.abs(measured - planned) > TARGET_TOLERANCE).tolist()
        warnings: list[Message] = []
        for i in off[:_NAMED]:
            values = {"position": float(measured[i]), "planned": float(planned[i]), "unit": unit}
            warnings.append(Message("warning-target_elsewhere", {"target": i + 1, **values}))
        if len(off) > _NAMED:
            more = {"count": len(off) - _NAMED}
            warnings.append(Message("warning-more_targets_elsewhere", more))
        return warnings
    values = {"targets": measured.size, "planned": planned.size}
    warnings = [Message("warning-other_number_of_targets", values)]
    for ours, theirs, code in (
        (planned, measured, "warning-targets_not_measured"),
        (measured, planned, "warning-targets_not_planned"),
    ):
        apart = ours[_distance(ours, theirs) > TARGET_TOLERANCE]
        if apart.size:
            values = {"count": apart.size, "position": float(apart[0]), "unit": unit}
            warnings.append(Message(code, values))
    return warnings


def _distance(ours: FloatArray, theirs: FloatArray) -> FloatArray:
    """Return the distance of each of our positions from the nearest of theirs, both ascending."""
    above = np.searchsorted(theirs, ours)
    below = np.maximum(above - 1, 0)
    above = np.minimum(above, theirs.size - 1)
    return np.minimum(np.abs(ours - theirs[below]), np.abs(ours - theirs[above]))


def _other_order(test: PositioningTest, plan: TestPlan) -> list[Message]:
    if test.order is None:
        return [Message("warning-order_not_known")]
    if test.order_deduced:
        return [Message("warning-order_deduced")]
    visits = order_of_visits(plan)
    number = np.flatnonzero(visits.cycle < test.cycles)
    place = tuple(index[number] for index in visits.place)
    number = number[~np.isnan(test.deviation[place])]
    place = tuple(index[number] for index in visits.place)
    difference = _first_difference(place, test.order[place])
    if difference is not None:
        return [difference]
    if test.time_s is None or test.time_source is not TimeSource.FILE:
        return [Message("warning-times_not_stated")]
    return _other_stops(test.time_s, plan, place, number)


def _stop(place: tuple[IndexArray, ...], k: int) -> dict[str, str | int]:
    """Return which stop the number k is."""
    i, j, a = (int(index[k]) for index in place)
    return {"target": i + 1, "cycle": j + 1, "approach": APPROACHES[a]}


def _first_difference(place: tuple[IndexArray, ...], order: FloatArray) -> Message | None:
    """Return where the measured order leaves the planned one; readings stand in planned order."""
    rank = np.argsort(order, kind="stable")
    wrong = np.flatnonzero(rank != np.arange(rank.size))
    if not wrong.size:
        return None
    k = int(wrong[0])
    measured, planned = _stop(place, int(rank[k])), _stop(place, k)
    values = {
        "reading": int(order[rank[k]]),
        **measured,
        **{f"planned_{name}": value for name, value in planned.items()},
        "count": wrong.size,
        "readings": rank.size,
    }
    return Message("warning-order_differs", values)


def _other_stops(
    time_s: FloatArray, plan: TestPlan, place: tuple[IndexArray, ...], number: IndexArray
) -> list[Message]:
    """Compare the times between readings that follow each other in the plan as well."""
    planned_s = planned_test(plan).time_s
    assert planned_s is not None  # noqa: S101 - a plan has times
    next_to = np.diff(number) == 1
    excess = (np.diff(time_s[place]) - np.diff(planned_s[place]))[next_to]
    if not excess.size:
        return []
    median, stop_s = float(np.median(excess)), plan.dwell_s + plan.recording_s
    whole = bool(np.all(time_s[place] == np.round(time_s[place])))
    warnings: list[Message] = []
    if median < -(WHOLE_SECONDS_TOLERANCE_S if whole else STOP_TOLERANCE_S):
        unit = plan.kind.units.position
        values = {"shorter_s": -median, "left_s": max(stop_s + median, 0.0), "planned_s": stop_s}
        values |= {"feed": plan.feed, "unit": unit}
        warnings.append(Message("warning-stops_shorter", values))
    elif median > LONG_STOP_TOLERANCE_S:
        values = {"longer_s": median, "planned_s": stop_s}
        warnings.append(Message("warning-stops_longer", values))
    pauses = np.flatnonzero(excess - median > PAUSE_S)
    if pauses.size:
        longest = int(pauses[np.argmax(excess[pauses])])
        after = _stop(place, int(np.flatnonzero(next_to)[longest]) + 1)
        longest_min = (float(excess[longest]) - median) / 60.0
        values = {"count": pauses.size, "longest_min": longest_min, **after}
        warnings.append(Message("warning-run_paused", values))
    return warnings
