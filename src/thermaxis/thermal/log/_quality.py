"""Look for wrong sensors and wrong clocks before a model is blamed.

Every check compares a channel with itself and with the other channels of its unit; none of them
knows the machine. A finding is a suspicion: a code, its values, and the rows to look at.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from itertools import combinations
from typing import Final, TypeAlias, final

import numpy as np
from numpy.typing import NDArray

from thermaxis.codes import Message, Place, Value
from thermaxis.thermal._arrays import FloatArray, significant
from thermaxis.thermal.log._frames import LogLike, as_thermal_log
from thermaxis.thermal.log._thermal_log import ThermalLog, common_names

Flags: TypeAlias = NDArray[np.bool_]

TEMPERATURE_RANGE_C = (-60.0, 250.0)
"""Temperatures outside are no machine's. [degC]"""
DISPLACEMENT_LIMIT_UM = 20_000.0
"""A displacement beyond is no thermal one. [µm]"""
SENTINELS: Final = (-999.0, -9999.0, 9999.0, 999.0, 999.9, 850.0, 85.0, -127.0, 0.0)
"""Values that recorders and sensors write instead of a measurement; -0.0 counts as 0."""
LEAST_TEMPERATURE_STEP_K = 0.05
"""Steps of a temperature from here on are named as quantised. [K]"""
LEAST_DISPLACEMENT_STEP_UM = 0.5
"""Steps of a displacement from here on are named as quantised. [µm]"""
LONG_GAP_STEPS = 2.5
"""A time between rows of more usual steps than this is a gap. [1]"""
LEAST_JUMP_K, LEAST_JUMP_UM = 2.0, 20.0
"""Smaller changes from row to row are never called a jump. [K, µm]"""
_JUMP_SCALES = 25.0
"""A jump is so many times the usual change from row to row. [1]"""
_NOISY = 5.0
"""Noise so many times the median of the other channels of its unit is named. [1]"""
_STUCK_ROWS = 20
_STUCK_SHARE = 0.01
_FEW_LARGE = 0.01
_RUN_BLOCKS = 20
_PEER_STEPS = 3.0
_NORMAL_MEDIAN = 1.4826
_MOST_PAIRED = 64
TEMPERATURES = ("degC", "K", "degF")
LENGTHS = {"um": 1.0, "mm": 1e-3, "nm": 1e3, "m": 1e-6}
"""Units of a displacement, and how many of each are a micrometre. [1]"""


class FindingKind(StrEnum):
    """What is wrong, the most important first."""

    NEVER_MEASURED = "never_measured"
    """No value in any row."""
    OUT_OF_RANGE = "out_of_range"
    """Values that no sensor of its kind measures, or that stand for a fault."""
    SWAPPED = "swapped"
    """Two channels exchange places."""
    STUCK = "stuck"
    """One value for long while other channels move."""
    CONSTANT = "constant"
    """One value throughout."""
    JUMP = "jump"
    """A change from row to row that heat cannot make."""
    NOISY = "noisy"
    """Much more noise than other channels of its unit."""
    CLOCK = "clock"
    """The clock may have been set forward."""
    GAP = "gap"
    """Rows are missing."""
    MISSING = "missing"
    """Values of one channel are missing."""
    QUANTISED = "quantised"
    """Values come in coarse steps."""
    HELD = "held"
    """Values are repeated between measurements."""
    RARE = "rare"
    """The channel is seen now and then only."""
    UNEVEN = "uneven"
    """Times between rows vary."""


_Place: TypeAlias = tuple[tuple[int, int], tuple[float, float]]
_ORDER = {kind: place for place, kind in enumerate(FindingKind)}


@final
@dataclass(frozen=True, slots=True)
class LogFinding:
    """One suspicion about a log."""

    kind: FindingKind
    message: Message
    """What was found, with its values; its place is the channel."""
    rows: tuple[int, int] | None = None
    """First row and the one behind the last, from zero, if it has a place. [1]"""
    time_s: tuple[float, float] | None = None
    """Times of the first and the last of these rows, from the first row of the log. [s]"""
    extent: float = 0.0
    """Share of the rows that it concerns: orders findings of one kind. [1]"""
    certain: bool = False
    """Whether the rows are masked where a log is mended: a sensor that is stuck."""

    @property
    def channel(self) -> str:
        """Its column; two with a comma between them where they are swapped; empty for times."""
        return self.message.place.channel

    @property
    def serious(self) -> bool:
        """Whether a model of this channel would be wrong."""
        return _ORDER[self.kind] <= _ORDER[FindingKind.JUMP]


def _finding(
    kind: FindingKind,
    channel: str,
    values: Mapping[str, Value],
    at: _Place | None = None,
    extent: float = 1.0,
    code: str = "",
) -> LogFinding:
    """Return a finding; ``log-`` and its code, or else its kind, is the sentence's key."""
    shown = {k: significant(v) if isinstance(v, float) else v for k, v in values.items()}
    named = {"name": channel, **shown} if channel else shown
    message = Message(f"log-{code or kind}", named, Place(channel=channel))
    rows, time_s = at or (None, None)
    return LogFinding(kind, message, rows, time_s, extent)


@final
@dataclass(frozen=True, slots=True, eq=False)
class _Channel:
    """The measured values of a channel, and what is usual for it."""

    name: str
    unit: str
    rows: NDArray[np.int64]
    """Rows in which it was measured."""
    time_s: FloatArray
    values: FloatArray
    suspect: Flags
    """Values that are out of range, (len(values),)."""
    step: float
    """Median time between measurements. [s]"""
    change: float
    """Usual change from one measurement to the next: standard deviation of a normal law."""
    resolution: float
    """Least difference of two values that occurs."""
    noise: float
    """Standard deviation of what the neighbours do not explain."""
    spread: float
    """Standard deviation of all good values."""

    @property
    def is_temperature(self) -> bool:
        return self.unit in TEMPERATURES

    @property
    def is_length(self) -> bool:
        return self.unit in LENGTHS


def check_log(log: LogLike, *, reference: LogLike | None = None) -> tuple[LogFinding, ...]:
    """Look for gaps, dead, stuck, swapped, coarse and noisy channels.

    Parameters
    ----------
    log : ThermalLog or frame
        As of `as_thermal_log`.
    reference : ThermalLog or frame, optional
        An earlier log of the same machine whose channels are known to be right: names that seem
        exchanged against it are found.

    Returns
    -------
    tuple of LogFinding
        The most important first; empty if nothing is suspicious.
    """
    log = as_thermal_log(log)
    findings = _check_times(log)
    channels: list[_Channel] = []
    for name in log.columns:
        channel = _channel(log, name)
        if channel is None:
            findings.append(_finding(FindingKind.NEVER_MEASURED, name, {}))
            continue
        channels.append(channel)
    peers = {unit: [c for c in channels if c.unit == unit] for unit in {c.unit for c in channels}}
    for channel in channels:
        findings += _check_channel(channel, peers[channel.unit], log)
    for group in peers.values():
        findings += _check_noise(group)
        findings += _find_exchanges(group)
    if reference is not None:
        findings += _compare_names(log, as_thermal_log(reference))
    findings = _without_consequences(findings)
    return tuple(sorted(findings, key=lambda f: (_ORDER[f.kind], -f.extent, f.channel)))


def _channel(log: ThermalLog, name: str) -> _Channel | None:
    column, unit = log.columns[name], log.units[name]
    rows = np.flatnonzero(~np.isnan(column))
    if rows.size == 0:
        return None
    values, time_s = column[rows], log.time_s[rows]
    suspect = out_of_range(values, unit)
    good = values[~suspect] if not bool(suspect.all()) else values
    steps = np.diff(time_s)
    change = np.abs(np.diff(good))
    moving = change[change > 0.0]
    bends = np.abs(np.diff(good, n=2))
    return _Channel(
        name=name,
        unit=unit,
        rows=rows.astype(np.int64),
        time_s=time_s,
        values=values,
        suspect=suspect,
        step=float(np.median(steps)) if steps.size else float("nan"),
        change=_NORMAL_MEDIAN * float(np.median(moving)) if moving.size else 0.0,
        resolution=resolution_of(good),
        noise=_NORMAL_MEDIAN * float(np.median(bends)) / np.sqrt(6.0) if bends.size else 0.0,
        spread=float(np.std(good)),
    )


def _in_celsius(values: FloatArray, unit: str) -> FloatArray:
    return values - 273.15 if unit == "K" and float(np.median(values)) > 200.0 else values


def out_of_range(values: FloatArray, unit: str) -> Flags:
    """Return which values no sensor measures, and which are a sentinel far from the others."""
    if unit in TEMPERATURES:
        celsius = _in_celsius(values, unit)
        low, high = TEMPERATURE_RANGE_C
        beyond = (celsius < low) | (celsius > high)
        least = LEAST_JUMP_K
    elif unit in LENGTHS:
        beyond = np.abs(values) > DISPLACEMENT_LIMIT_UM * LENGTHS[unit]
        if unit != "um" and bool(np.mean(beyond) > 0.5):  # a position of an axis, or a diameter
            beyond = np.zeros(values.size, dtype=np.bool_)
        least = LEAST_JUMP_UM * LENGTHS[unit]
    else:
        return np.zeros(values.size, dtype=np.bool_)
    for sentinel in SENTINELS:
        here = (values == sentinel) & ~beyond
        if bool(here.any()) and _is_sentinel(values, here, beyond, least):
            beyond = beyond | here
    return beyond


def _is_sentinel(values: FloatArray, here: Flags, beyond: Flags, least: float) -> bool:
    """Say whether the values enter and leave one number by jumps."""
    others = ~(here | beyond)
    rest = values[others]
    if rest.size < 3:
        return False
    sentinel = float(values[here][0])
    usual = _NORMAL_MEDIAN * float(np.median(np.abs(np.diff(rest))))
    edges = np.flatnonzero(here[1:] != here[:-1])
    if edges.size == 0:
        return False
    sizes = np.abs(values[edges + 1] - values[edges])
    spread = np.abs(rest - np.median(rest))
    far = abs(sentinel - float(np.median(rest))) > 3.0 * float(np.quantile(spread, 0.95))
    return far and bool(np.min(sizes) > max(least, _JUMP_SCALES * usual))


def resolution_of(values: FloatArray) -> float:
    """Return the step of the values if all of them are multiples of one, else 0."""
    different = np.unique(values[:200_000])
    if different.size < 3 or different.size > max(5000, values.size // 4):
        return 0.0
    gaps = np.diff(different)
    size = max(abs(float(different[0])), abs(float(different[-1])), 1e-12)
    gaps = gaps[gaps > 1e-9 * size]
    if gaps.size == 0:
        return 0.0
    step = float(np.min(gaps))
    counts = gaps / step
    return step if bool(np.all(np.abs(counts - np.rint(counts)) < 0.02 * counts + 0.01)) else 0.0


def _place(channel: _Channel, first: int, last: int) -> _Place:
    """Return rows and times of the measurements from one index to another, both included."""
    rows = int(channel.rows[first]), int(channel.rows[last]) + 1
    return rows, (float(channel.time_s[first]), float(channel.time_s[last]))


def _check_times(log: ThermalLog) -> list[LogFinding]:
    steps = np.diff(log.time_s)
    if steps.size < 2:
        return []
    usual = float(np.median(steps))
    findings: list[LogFinding] = []
    gaps = np.flatnonzero(steps > LONG_GAP_STEPS * usual)
    for row in map(int, gaps[np.abs(steps[gaps] - 3600.0 - usual) <= 1.5 * usual][:3]):
        at = (row, row + 2), (float(log.time_s[row]), float(log.time_s[row + 1]))
        values = {"row": row + 1, "at_s": at[1][0]}
        findings.append(_finding(FindingKind.CLOCK, "", values, at, 0.0))
    if gaps.size and gaps.size <= 0.2 * steps.size:
        lost = float(np.sum(steps[gaps] - usual))
        longest = int(gaps[np.argmax(steps[gaps])])
        at = (longest, longest + 2), (float(log.time_s[longest]), float(log.time_s[longest + 1]))
        values = {"count": gaps.size, "lost_s": lost, "row": longest}
        values |= {"longest_s": float(steps[longest])}
        share = lost / max(log.duration_s, usual)
        findings.append(_finding(FindingKind.GAP, "", values, at, share))
    ordinary = np.delete(steps, gaps)
    uneven = float(np.mean(np.abs(ordinary - usual) > 0.2 * usual))
    if uneven > 0.05:
        values = {"percent": 100.0 * uneven, "usual_s": usual}
        findings.append(_finding(FindingKind.UNEVEN, "", values, extent=uneven))
    return findings


def _check_channel(
    channel: _Channel, peers: Sequence[_Channel], log: ThermalLog
) -> list[LogFinding]:
    findings = _report_range(channel)
    constant = _report_constant(channel)
    if constant is not None:
        return [*findings, constant]
    findings += _find_stuck(channel, peers)
    findings += _find_jumps(channel)
    findings += _report_missing(channel, log)
    findings += _report_steps(channel)
    return findings


def _report_range(channel: _Channel) -> list[LogFinding]:
    count = int(np.count_nonzero(channel.suspect))
    if not count:
        return []
    index = np.flatnonzero(channel.suspect)
    seen, counts = np.unique(channel.values[index], return_counts=True)
    at = _place(channel, int(index[0]), int(index[-1]))
    example = float(seen[np.argmax(counts)])
    values = {"count": count, "example": example, "unit": channel.unit, "row": at[0][0]}
    extent = count / channel.values.size
    return [_finding(FindingKind.OUT_OF_RANGE, channel.name, values, at, extent)]


def _report_constant(channel: _Channel) -> LogFinding | None:
    if channel.values.size < 3 or float(np.ptp(channel.values)) > 0.0:
        return None
    at = _place(channel, 0, channel.values.size - 1)
    values = {"value": float(channel.values[0]), "unit": channel.unit, "rows": channel.values.size}
    return _finding(FindingKind.CONSTANT, channel.name, values, at)


def runs(values: FloatArray) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return the first index of every run of equal values, and its length. [1]"""
    begins = np.flatnonzero(np.concatenate(([True], np.diff(values) != 0.0)))
    return begins, np.diff(np.concatenate((begins, [values.size])))


def _find_stuck(channel: _Channel, peers: Sequence[_Channel]) -> list[LogFinding]:
    """Find the longest run of one value that noise, resolution and the peers do not allow."""
    if not (channel.is_temperature or channel.is_length):
        return []
    begins, lengths = runs(channel.values)
    order = np.argsort(lengths)[::-1][:3]
    others = [p for p in peers if p is not channel and p.spread > 0.0]
    findings: list[LogFinding] = []
    for number in map(int, order):
        begin, length = int(begins[number]), int(lengths[number])
        if length < max(_STUCK_ROWS, _STUCK_SHARE * channel.values.size):
            break
        run = _Run(channel, others, begin, begin + length - 1, np.delete(lengths, number))
        if bool(channel.suspect[begin]) or _begins_at_rest(run) or not _should_have_moved(run):
            continue
        at = _place(channel, begin, run.end)
        values = {"value": float(channel.values[begin]), "unit": channel.unit, "row": at[0][0]}
        values |= {"lasts_s": at[1][1] - at[1][0]}
        extent = length / channel.values.size
        stuck = _finding(FindingKind.STUCK, channel.name, values, at, extent)
        findings.append(replace(stuck, certain=_never_rests(run)))
    return findings


@final
@dataclass(frozen=True, slots=True, eq=False)
class _Run:
    """A run of one value of a channel."""

    channel: _Channel
    others: Sequence[_Channel]
    """Other channels of its unit that move."""
    begin: int
    end: int
    """First and last measurement of the run."""
    rest: NDArray[np.int64]
    """Lengths of the channel's other runs. [1]"""

    @property
    def length(self) -> int:
        return self.end + 1 - self.begin

    def seen_by(self, other: _Channel) -> FloatArray:
        """Return the good values of another channel during the run."""
        first_s, last_s = self.channel.time_s[[self.begin, self.end]]
        inside = (other.time_s >= first_s) & (other.time_s <= last_s)
        return other.values[inside & ~other.suspect]

    def means(self) -> list[tuple[_Channel, list[float]]]:
        """Return means of the other channels over parts of the run."""
        seen = [(other, self.seen_by(other)) for other in self.others]
        return [
            (other, [float(np.mean(block)) for block in np.array_split(values, _RUN_BLOCKS)])
            for other, values in seen
            if values.size >= _STUCK_ROWS
        ]


def _should_have_moved(run: _Run) -> bool:
    """Say whether a run is longer than noise allows, or the other channels moved during it."""
    channel, rest, expected = run.channel, run.rest, _expected(run)
    if rest.size and float(np.quantile(rest, 0.99)) * 10.0 < run.length:
        lively = float(np.mean(rest)) < 3.0  # noise changes nearly every value outside the run
        if lively and not _is_coarse(run):
            return True
        if lively and expected > _PEER_STEPS * channel.resolution:
            return not _carries_on(run)
    if not run.others or not channel.spread or _carries_on(run):
        return False
    if not channel.resolution and np.unique(channel.values).size == 2:  # one step, seen once
        went = [max(m) - min(m) for _, m in run.means()]
        return bool(went) and min(went) > _PEER_STEPS * float(np.ptp(channel.values))
    moved: list[float] = []
    for other in run.others:
        seen = run.seen_by(other)
        if seen.size > 1:
            slow = float(np.quantile(seen, 0.95) - np.quantile(seen, 0.05))
            # A single step of a coarse channel is no movement.
            slow = slow - 4.0 * other.noise if slow > 1.01 * other.resolution else 0.0
            moved.append(max(slow, 0.0) / other.spread)
    if not moved:
        return False
    expected = float(np.median(moved)) * channel.spread
    return expected > max(5.0 * channel.resolution, 8.0 * channel.noise, 0.3 * channel.spread)


def _begins_at_rest(run: _Run) -> bool:
    """Say whether a run without noise, from the first row on, ends in steps that are alike."""
    steps = np.abs(np.diff(run.channel.values[run.end : run.end + 2 + _STUCK_ROWS // 4]))
    return run.begin == 0 and steps.size > 1 and bool(steps[0] <= 2.0 * np.max(steps[1:]))


def _never_rests(run: _Run) -> bool:
    """Say whether a channel, outside a run, leaves its step in every quarter of the run's time."""
    if run.rest.size and 4 * int(np.max(run.rest)) > run.length:
        return False
    channel, length = run.channel, max(run.length // 4, 2)
    outside = (channel.values[: run.begin], channel.values[run.end + 1 :])
    parts = [v[: v.size // length * length].reshape(-1, length) for v in outside]
    went = np.ptp(np.concatenate(parts), axis=1)
    return went.size > 1 and bool(np.all(went > 1.01 * channel.resolution))


def _is_coarse(run: _Run) -> bool:
    """Say whether noise moves the rounded values by a step at most, outside a run.

    Such a channel flickers near the border of two steps, and rests between the borders.
    """
    channel = run.channel
    if not channel.resolution:
        return False
    change = np.abs(np.diff(channel.values))
    outside = np.concatenate((change[: max(run.begin - 1, 0)], change[run.end + 1 :]))
    return bool(np.mean(outside > 1.5 * channel.resolution) < _FEW_LARGE) if outside.size else True


def _expected(run: _Run) -> float:
    """Return by how much channels that move as this one does moved in a run.

    Without other channels a rest must be far longer than all others.
    """
    channel = run.channel
    if not run.others:
        far = run.rest.size and 10 * int(np.max(run.rest)) < run.length
        return np.inf if far else 0.0
    own = np.delete(channel.values, slice(run.begin, run.end + 1))
    first_s, last_s = channel.time_s[[run.begin, run.end]]
    expected: list[float] = []
    for other, means in run.means():
        outside = other.values[(other.time_s < first_s) | (other.time_s > last_s)]
        alike = float(np.std(own)) / max(float(np.std(outside)), 1e-12) if outside.size else 1.0
        expected.append((max(means) - min(means)) * min(alike, 1.0))
    return float(np.median(expected)) if expected else 0.0


def _carries_on(run: _Run) -> bool:
    """Say whether a channel goes on behind a run within a step, as if it had seen all of it.

    A dead sensor that lives again shows at once what it missed.
    """
    channel = run.channel
    behind = channel.values[run.end + 1 : run.end + 1 + _STUCK_ROWS // 4]
    step = max(channel.resolution, channel.change)
    return behind.size > 0 and bool(np.all(np.abs(behind - channel.values[run.end]) <= 1.5 * step))


def _find_jumps(channel: _Channel) -> list[LogFinding]:
    if not (channel.is_temperature or channel.is_length) or channel.values.size < 10:
        return []
    factor = LENGTHS.get(channel.unit, 1.0)
    least = LEAST_JUMP_K if channel.is_temperature else LEAST_JUMP_UM * factor
    good = np.flatnonzero(~channel.suspect)
    if good.size < 10:
        return []
    values, time_s = channel.values[good], channel.time_s[good]
    change, steps = np.abs(np.diff(values)), np.diff(time_s)
    close = steps <= 3.0 * channel.step
    usual = max(channel.change, channel.resolution, channel.noise)
    # Fast but real movement comes in several rows: its neighbours are nearly as large.
    beside = np.maximum(np.concatenate(([0.0], change[:-1])), np.concatenate((change[1:], [0.0])))
    back = np.zeros(change.size, dtype=np.bool_)
    back[:-1] |= np.abs(values[2:] - values[:-2]) < 0.3 * change[:-1]
    back[1:] |= np.abs(values[2:] - values[:-2]) < 0.3 * change[1:]
    limit = max(least, _JUMP_SCALES * usual)
    jumps = np.flatnonzero(close & (change > limit) & (back | (beside < 0.25 * change)))
    if jumps.size == 0:
        return []
    largest = int(jumps[np.argmax(change[jumps])])
    first = int(good[largest])
    at = _place(channel, first, min(int(good[largest + 1]), channel.values.size - 1))
    values = {"count": jumps.size, "size": float(change[largest]), "usual": usual}
    values |= {"unit": channel.unit, "row": at[0][0], "next_row": at[0][1] - 1}
    extent = jumps.size / channel.values.size
    return [_finding(FindingKind.JUMP, channel.name, values, at, extent)]


def _report_missing(channel: _Channel, log: ThermalLog) -> list[LogFinding]:
    steps = np.diff(channel.time_s)
    if steps.size < 2 or not channel.step > 0.0:
        return []
    log_steps = np.diff(log.time_s)
    own = np.flatnonzero(steps > LONG_GAP_STEPS * channel.step)
    if own.size == 0:
        return []
    # A gap of the whole log is the log's finding.
    before = log_steps[np.minimum(channel.rows[own], log_steps.size - 1)]
    own = own[before < 0.9 * steps[own]]
    if own.size == 0:
        return []
    lost = float(np.sum(steps[own] - channel.step))
    share = lost / max(log.duration_s, channel.step)
    longest = int(own[np.argmax(steps[own])])
    visits = own.size + 1
    if share > 0.5 and visits > 2:
        length = float(np.median(np.diff(np.concatenate(([0], own + 1, [channel.values.size])))))
        lasts_s = max(length - 1.0, 0.0) * channel.step
        values = {"count": visits, "lasts_s": lasts_s}
        return [_finding(FindingKind.RARE, channel.name, values, extent=share)]
    at = _place(channel, longest, longest + 1)
    values = {"count": own.size, "lost_s": lost, "row": at[0][0]}
    return [_finding(FindingKind.MISSING, channel.name, values, at, share)]


def _report_steps(channel: _Channel) -> list[LogFinding]:
    """Name coarse steps, and values that a recorder holds between measurements."""
    least = (
        LEAST_TEMPERATURE_STEP_K
        if channel.is_temperature
        else LEAST_DISPLACEMENT_STEP_UM
        if channel.unit == "um"
        else np.inf
    )
    if channel.resolution > 0.999 * least:
        values = {"step": channel.resolution, "unit": channel.unit}
        return [_finding(FindingKind.QUANTISED, channel.name, values)]
    _, lengths = runs(channel.values)
    if not (channel.is_temperature or channel.is_length) or lengths.size < 20:
        return []
    usual = int(np.median(lengths[1:-1]))
    alike = float(np.mean(np.abs(lengths[1:-1] - usual) <= max(1.0, 0.1 * usual)))
    if usual < 3 or alike <= 0.8:
        return []
    values = {"rows": usual, "lasts_s": usual * channel.step}
    return [_finding(FindingKind.HELD, channel.name, values, extent=alike)]


def _check_noise(group: Sequence[_Channel]) -> list[LogFinding]:
    if len(group) < 3 or not (group[0].is_temperature or group[0].is_length):
        return []
    noises = [max(channel.noise, 0.3 * channel.resolution) for channel in group]
    usual = float(np.median(noises))
    return [
        _finding(
            FindingKind.NOISY,
            channel.name,
            {"noise": significant(noise, 2), "unit": channel.unit, "times": noise / usual},
            extent=min(noise / usual / 1000.0, 1.0),
        )
        for channel, noise in zip(group, noises, strict=True)
        if usual > 0.0 and noise > _NOISY * usual
    ]


def _find_exchanges(group: Sequence[_Channel]) -> list[LogFinding]:
    """Find rows at which two channels of one unit take each other's place."""
    if not group or not (group[0].is_temperature or group[0].is_length):
        return []
    candidates = [c for c in group if c.values.size > 10 and c.spread > 0.0][:_MOST_PAIRED]
    large = {c.name: _large_changes(c) for c in candidates}
    findings: list[LogFinding] = []
    for a, b in combinations(candidates, 2):
        for row in sorted(large[a.name] & large[b.name]):
            found = _exchange_at(a, b, row)
            if found is not None:
                findings.append(found)
                break
    return findings


def _large_changes(channel: _Channel) -> set[int]:
    """Return the rows that a channel enters with an unusual change."""
    change = np.abs(np.diff(channel.values))
    usual = max(channel.change, channel.resolution, channel.noise)
    entered = np.flatnonzero(change > 6.0 * usual) + 1
    entered = entered[np.argsort(change[entered - 1])[::-1][:2000]]
    return {int(row) for row in channel.rows[entered]}


def _exchange_at(a: _Channel, b: _Channel, row: int) -> LogFinding | None:
    """Compare levels before and after a row, as they are and exchanged."""
    ia, ib = int(np.searchsorted(a.rows, row)), int(np.searchsorted(b.rows, row))
    count = min(5, ia, ib, a.values.size - ia, b.values.size - ib)
    if count < 3:
        return None
    if a.time_s[ia] - a.time_s[ia - 1] > 10.0 * a.step:
        return None
    a0, a1 = np.median(a.values[ia - count : ia]), np.median(a.values[ia : ia + count])
    b0, b1 = np.median(b.values[ib - count : ib]), np.median(b.values[ib : ib + count])
    kept = abs(float(a1 - a0)) + abs(float(b1 - b0))
    crossed = abs(float(a1 - b0)) + abs(float(b1 - a0))
    usual = max(a.change, b.change, a.noise, b.noise, a.resolution, b.resolution)
    if crossed > 0.2 * kept or min(abs(float(a1 - a0)), abs(float(b1 - b0))) < 6.0 * usual:
        return None
    at, share = _place(a, ia, a.values.size - 1), (a.values.size - ia) / a.values.size
    values = {"row": row, "unit": a.unit, "first_before": float(a0), "second_before": float(b0)}
    values |= {"first_after": float(a1), "second_after": float(b1)}
    return _finding(FindingKind.SWAPPED, f"{a.name},{b.name}", values, at, share)


def _without_consequences(findings: Sequence[LogFinding]) -> list[LogFinding]:
    """Leave out jumps into or out of another fault, and noise of a channel out of range."""
    exchanged = {
        (name, f.rows[0])
        for f in findings
        if f.kind is FindingKind.SWAPPED and f.rows is not None
        for name in f.channel.split(",")
    }
    ended = {
        (f.channel, f.rows[1])
        for f in findings
        if f.kind is FindingKind.STUCK and f.rows is not None
    }
    broken = {f.channel for f in findings if f.kind is FindingKind.OUT_OF_RANGE}
    kept: list[LogFinding] = []
    for finding in findings:
        place = None if finding.rows is None else (finding.channel, finding.rows[1] - 1)
        is_exchange = finding.kind is FindingKind.JUMP and place in (exchanged | ended)
        if not is_exchange and not (
            finding.kind is FindingKind.NOISY and finding.channel in broken
        ):
            kept.append(finding)
    return kept


def _compare_names(log: ThermalLog, reference: ThermalLog) -> list[LogFinding]:
    """Find two names that are exchanged, from how the channels move with one another.

    Which channel follows which, and which moves most, is much the same in every test of a machine.
    Two names are exchanged if the log fits the reference much better that way.
    """
    names = [
        name
        for name in common_names((log, reference))
        if log.units[name] in TEMPERATURES and _varies(log, name) and _varies(reference, name)
    ][:_MOST_PAIRED]
    if len(names) < 3:
        return []
    here, there = _behaviour(log, names), _behaviour(reference, names)
    found: list[tuple[float, int, int]] = []
    for i, j in combinations(range(len(names)), 2):
        order = np.arange(len(names))
        as_named = _distance(here, there, order, (i, j))
        order[[i, j]] = j, i
        exchanged = _distance(here, there, order, (i, j))
        if exchanged < 0.5 * as_named and as_named - exchanged > 0.3:
            found.append((exchanged - as_named, i, j))
    if not found:
        return []
    _, i, j = min(found)
    pair, values = f"{names[i]},{names[j]}", {"reference": reference.where}
    return [_finding(FindingKind.SWAPPED, pair, values, code="swapped_names")]


def _varies(log: ThermalLog, name: str) -> bool:
    values = log.columns[name]
    measured = values[~np.isnan(values)]
    return measured.size > 20 and float(np.ptp(measured)) > 0.0


def _behaviour(log: ThermalLog, names: Sequence[str]) -> tuple[FloatArray, FloatArray]:
    """Return correlations between channels, (k, k), and logarithms of their spreads, (k,)."""
    small = log.select(names).resample(max(log.duration_s / 400.0, log.usual_step_s))
    values = np.stack([small.columns[name] for name in names])
    values = values[:, ~np.isnan(values).any(axis=0)]
    if values.shape[1] < 10 or bool((np.ptp(values, axis=1) == 0.0).any()):
        return np.eye(len(names)), np.zeros(len(names))
    spread = np.log(np.std(values, axis=1))
    return np.asarray(np.corrcoef(values)), spread - np.median(spread)


def _distance(
    a: tuple[FloatArray, FloatArray],
    b: tuple[FloatArray, FloatArray],
    order: NDArray[np.int64],
    pair: tuple[int, int],
) -> float:
    """Return how far two channels of a log, put in another order, are from the reference."""
    rows = np.array(pair)
    correlations = a[0][np.ix_(order[rows], order)] - b[0][rows]
    return float(np.sum(correlations**2) + np.sum((a[1][order[rows]] - b[1][rows]) ** 2))
