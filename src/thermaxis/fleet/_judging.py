"""Which machines need a person, and why first: what all nights of a fleet say together.

A sign is one figure of a night: how far a sensor lies from its neighbours, by what share a gain is
off, how large the residual is. It counts by how far it departs from the machine's own past beyond
what it does in its sisters in the same nights: a hot day moves all. Windows of nights that end
today are asked, so that what is small is found by lasting (cumulative sums); the spread of
departures is learnt from the machine itself, its sisters, and the same night.
"""

from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from datetime import date, timedelta
from enum import StrEnum
from itertools import groupby
from typing import Any, Final, NamedTuple, cast, final

import numpy as np
from numpy.typing import NDArray

from thermaxis.codes import Message, Place, Value
from thermaxis.fleet._registry import StoredNight
from thermaxis.fleet._signs import SignKind

_F = NDArray[np.float64]

JUDGED_DAYS: Final = 14
"""Nights of so many days are judged together: what lasts longer unmended becomes the past. [1]"""
FALSE_SHARE: Final = 0.01
"""Share of the named that is expected to be named by chance. [1]"""
SISTERS: Final = 8
"""With fewer machines of its kind a machine is compared with those of all kinds. [1]"""


@final
class Cause(StrEnum):
    """What is likely wrong, what hides others first."""

    SENSOR_FROZEN = "sensor_frozen"
    """A sensor gives one value."""
    SENSORS_SWAPPED = "sensors_swapped"
    """Two sensors have changed places."""
    SENSOR_OFFSET = "sensor_offset"
    """A sensor shows something else than its neighbours, by as much at all times."""
    GAIN = "gain"
    """The machine answers to heat more or less than its model."""
    TIME_CONSTANT = "time_constant"
    """It answers faster or slower."""
    DRIFT = "drift"
    """It moves without heat: wear, a crash, a probe."""
    UNKNOWN = "unknown"
    """Its model leaves more than before, and none of these explains it."""


CAUSES: Final = {
    SignKind.SWAP: Cause.SENSORS_SWAPPED,
    SignKind.LEVEL: Cause.SENSOR_OFFSET,
    SignKind.GAIN: Cause.GAIN,
    SignKind.TIME_CONSTANT: Cause.TIME_CONSTANT,
    SignKind.MEAN: Cause.DRIFT,
    SignKind.REST: Cause.UNKNOWN,
}
"""What a sign speaks for."""
LEAST: Final = {
    SignKind.SWAP: 0.5,
    SignKind.LEVEL: 0.5,
    SignKind.GAIN: 0.1,
    SignKind.TIME_CONSTANT: 0.12,
    SignKind.MEAN: 0.5,
    SignKind.REST: 0.25,
}
"""Smaller departures are no reason to look at a machine, in the sign's unit."""
_ALIKE = (Cause.GAIN, Cause.TIME_CONSTANT)
_STILL = frozenset({"log-stuck", "log-constant", "log-never_measured"})
_WINDOWS = (1, 2, 3, 5, 8, 14)
_PRIOR = 4.0
_NORMAL_MEDIAN, _NORMAL_90 = 1.4826, 1.6449
_STAYS = 0.3


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class Judgement:
    """What is thought of a machine on a morning."""

    machine: str
    """Its name."""
    kind: str
    """Its kind."""
    day: date
    """The day of the night that was judged last."""
    named: bool
    """Whether a person is to look at it."""
    causes: tuple[Cause, ...] = ()
    """What is likely wrong, the likeliest first; empty where it is not named."""
    q_value: float | None = None
    """Share of false names among all that depart as far or farther; None without a sign, or where
    a sensor alone is the reason. [1]"""
    cusum: float | None = None
    """How far its nights depart together, in standard deviations; None without a sign. [1]"""
    since: date | None = None
    """The day on which it began, as far as is known; None where it is not named."""
    output: str = ""
    """The output that departs; empty for sensors."""
    evidence: tuple[Message, ...] = field(default=())
    """A sentence with figures for each cause, with what to do; its place is the part or channel."""


class _Found(NamedTuple):
    """A sign that departs."""

    p_value: float
    z: float
    formal: float
    sign: SignKind
    output: str
    of: str
    departure: float
    nights: int
    since: date


_Key = tuple[SignKind, str, str]
_Row = tuple[date, float, float, float, float]
_Signs = Iterable[Mapping[str, Any]]


def judge(nights: Sequence[StoredNight], day: date) -> list[Judgement]:
    """Judge every machine that has a night of a day, by its nights and those of its sisters.

    Parameters
    ----------
    nights : sequence of StoredNight
        Nights of all machines; of those older than `JUDGED_DAYS`, after the day, or by another
        model than that of the day nothing is used.
    day : date
        The day.

    Returns
    -------
    list of Judgement
        Every machine: the named ones first, and of these the surest.

    Notes
    -----
    The departure of a sign on night i is d_i, that of its past of which the first night tells
    being taken off. Over the last w nights, with the standard deviations s_i and s of the past,
    and the weights a_i, 1 for a step and growing for a drift,

        T = sum(a d / s_i^2) / sum(a^2 / s_i^2)
        S^2 = 1 / sum(a^2 / s_i^2) + s^2 (sum(a / s_i^2) / sum(a^2 / s_i^2))^2
        z = (T - median T of the sisters) / (k S)

    with k the spread of the sisters' z in the same window, from medians and quantiles that
    machines at fault do not move, and not below that of the machine's own nights before. The
    smallest probability of all windows and signs, times their number, is the machine's; of these
    those are named that hold the share of false names at `FALSE_SHARE`.

    References
    ----------
    Lai 1995 (window-limited sums); Benjamini and Hochberg 1995; Efron 2004 (spread from the night
    itself). From memory.
    """
    histories = _histories(nights, day)
    today = {name: own[-1] for name, own in histories.items()}
    found: dict[str, list[_Found]] = defaultdict(list)
    tests: dict[str, int] = defaultdict(int)
    for key, rows in _rows_of(histories).items():
        for name, one in _departures(key, rows, {n: today[n].kind for n in rows}, day):
            tests[name] += 1
            if one is not None:
                found[name].append(one)
    names = [name for name in today if tests[name]]
    least = {name: min((f.p_value for f in found[name]), default=1.0) for name in names}
    q_values = _q_values([min(least[name] * tests[name], 1.0) for name in names])
    q_of = dict(zip(names, q_values, strict=True))
    still = _still(histories)
    judged = [
        _judged(night, found[name], q_of.get(name), tests[name], still.get(name, ()), day)
        for name, night in today.items()
    ]
    return sorted(judged, key=_worst_first)


def _worst_first(one: Judgement) -> tuple[object, ...]:
    order = [list(Cause).index(cause) for cause in one.causes[:1]]
    return (not one.named, one.q_value or 0.0, *(order or [0]), -(one.cusum or 0.0), one.machine)


def _histories(nights: Sequence[StoredNight], day: date) -> dict[str, list[StoredNight]]:
    """Return the nights of each machine by its model of the day, one a day, the earliest first."""
    begin = day - timedelta(days=JUDGED_DAYS - 1)
    ordered = sorted((n for n in nights if begin <= n.day <= day), key=lambda n: (n.machine, n.day))
    histories: dict[str, list[StoredNight]] = {}
    for name, own in groupby(ordered, key=lambda night: night.machine):
        by_day = {night.day: night for night in own}
        last = by_day.get(day)
        if last is not None:
            model = last.model_sha256
            histories[name] = [one for one in by_day.values() if one.model_sha256 == model]
    return histories


def _signs_of(night: StoredNight) -> _Signs:
    return cast("_Signs", night.result.get("signs", ()))


def _rows_of(
    histories: Mapping[str, Sequence[StoredNight]],
) -> dict[_Key, dict[str, list[_Row]]]:
    """Return days, values, values before and the deviations of both of every sign by machine."""
    rows: dict[_Key, dict[str, list[_Row]]] = {}
    for name, own in histories.items():
        for night in own:
            for s in _signs_of(night):
                key = (SignKind(s["sign"]), s["output"], s["of"])
                of_key = rows.setdefault(key, {})
                of_key.setdefault(name, []).append(
                    (night.day, s["value"], s["before"], s["std"], s["before_std"])
                )
    return rows


def _departures(
    key: _Key,
    rows: Mapping[str, Sequence[_Row]],
    kinds: Mapping[str, str],
    day: date,
) -> list[tuple[str, _Found | None]]:
    """Return how far each machine departs in one sign, None for what departs too little."""
    sign, output, of = key
    names = list(rows)
    departure, weight = np.zeros((len(names), JUDGED_DAYS)), np.zeros((len(names), JUDGED_DAYS))
    past = np.zeros(len(names))
    for k, name in enumerate(names):
        table = np.array([one[1:] for one in rows[name]])
        at = [JUDGED_DAYS - 1 - (day - one[0]).days for one in rows[name]]
        departure[k, at] = (
            _levels(table, at) if sign is SignKind.MEAN else table[:, 0] - table[0, 1]
        )
        weight[k, at] = table[:, 2] ** -2.0
        past[k] = table[0, 3]
    group = np.array([kinds[name] for name in names])
    learnt = sign in (SignKind.MEAN, SignKind.LEVEL, SignKind.REST)
    if learnt:  # the spread of six days is known badly: shrunk towards that of the sisters
        own = weight[weight > 0.0] ** -1.0
        usual = float(np.median(own))
        shrunk = np.where(weight > 0.0, 2.0 / (1.0 / np.maximum(weight, 1e-12) + usual), 0.0)
        weight, past = shrunk, np.sqrt(0.5 * (past**2 + float(np.median(past**2))))
    shapes = [(w, np.ones(w)) for w in _WINDOWS]
    if sign is SignKind.MEAN:
        shapes += [(w, (np.arange(w) + 0.5) / w) for w in _WINDOWS[2:]]
    best_z, best_t, best_w = np.zeros(len(names)), np.zeros(len(names)), np.ones(len(names), int)
    formal = np.zeros(len(names))
    last = np.array([d[np.flatnonzero(w)[-1]] for d, w in zip(departure, weight, strict=True)])
    for w, shape in shapes:
        d, g = departure[:, -w:], weight[:, -w:]
        total = np.sum(shape**2 * g, axis=1)
        known = total > 0.0
        safe = np.where(known, total, 1.0)
        t = np.sum(shape * d * g, axis=1) / safe
        s = np.sqrt(1.0 / safe + (past * np.sum(shape * g, axis=1) / safe) ** 2)
        centre, spread = _sisters(t, s, group, known)
        earlier = weight[:, :-w] > 0.0
        squares = np.minimum(departure[:, :-w] ** 2 * weight[:, :-w], 9.0 * (spread**2)[:, None])
        count = np.sum(earlier, axis=1)
        own = np.sqrt((_PRIOR * spread**2 + np.sum(squares * earlier, axis=1)) / (_PRIOR + count))
        z = np.where(known, (t - centre) / (s * np.maximum(spread, own)), 0.0)
        stays = (last * t > 0.0) & (np.abs(last) >= _STAYS * np.abs(t))
        better = (np.abs(z) > np.abs(best_z)) & (np.abs(t - centre) >= LEAST[sign]) & stays
        if sign in (SignKind.SWAP, SignKind.REST):
            better &= t > 0.0
        best_z, best_t = np.where(better, z, best_z), np.where(better, t - centre, best_t)
        best_w, formal = np.where(better, w, best_w), np.where(better, (t - centre) / s, formal)
    from scipy.special import ndtr  # noqa: PLC0415  scipy is slow to import

    p_values = np.minimum(2.0 * ndtr(-np.abs(best_z)) * len(shapes), 1.0)
    found: list[tuple[str, _Found | None]] = []
    for k, name in enumerate(names):
        since = max(day - timedelta(days=int(best_w[k]) - 1), rows[name][0][0])
        figures = (float(p_values[k]), float(best_z[k]), float(formal[k]))
        depart = (float(best_t[k]), int(best_w[k]), since)
        found.append((name, _Found(*figures, sign, output, of, *depart) if best_z[k] else None))
    return found


def _levels(table: _F, at: Sequence[int]) -> _F:
    """Return a mean residual by night against the past, from what each night says of days before.

    The zero of a free run is another one each night; the mean of the days before it has the same.
    """
    levels = np.zeros(JUDGED_DAYS + 6)
    for place, (value, before, *_) in zip(at, table.tolist(), strict=True):
        levels[place + 6] = value - before + np.mean(levels[place : place + 6])
    return levels[np.array(at) + 6]


def _sisters(t: _F, s: _F, group: NDArray[Any], known: NDArray[np.bool_]) -> tuple[_F, _F]:
    """Return where the sisters of each machine lie, and the spread of their departures."""
    centre, spread = np.zeros(t.size), np.ones(t.size)
    for kind in [None, *np.unique(group).tolist()]:
        rows = known & (group == kind) if kind is not None else known
        if np.count_nonzero(rows) < SISTERS:
            continue
        middle = float(np.median(t[rows]))
        z = np.abs(t[rows] - middle) / s[rows]
        wide = max(_NORMAL_MEDIAN * float(np.median(z)), float(np.quantile(z, 0.9)) / _NORMAL_90)
        own = rows if kind is not None else np.ones(t.size, bool)
        centre[own], spread[own] = middle, max(wide, 1.0)
    return centre, spread


def _q_values(p_values: Sequence[float]) -> list[float]:
    from scipy import stats  # noqa: PLC0415  scipy is slow to import

    return cast("Any", stats).false_discovery_control(p_values).tolist() if p_values else []


def _still(histories: Mapping[str, Sequence[StoredNight]]) -> dict[str, list[tuple[str, date]]]:
    """Return channels that stand still, with since when: not those that do in many sisters."""
    of_machine: dict[str, list[tuple[str, date]]] = {}
    share: dict[tuple[str, str], int] = defaultdict(int)
    sisters: dict[str, int] = defaultdict(int)
    for name, own in histories.items():
        sisters[own[-1].kind] += 1
        for channel in _still_channels(own[-1]):
            since = own[-1].day
            for night in reversed(own):
                if channel not in _still_channels(night):
                    break
                since = night.day
            of_machine.setdefault(name, []).append((channel, since))
            share[own[-1].kind, channel] += 1
    return {
        name: kept
        for name, channels in of_machine.items()
        if (
            kept := [
                (channel, since)
                for channel, since in channels
                if share[kind := histories[name][-1].kind, channel] <= max(2, sisters[kind] // 4)
            ]
        )
    }


def _still_channels(night: StoredNight) -> list[str]:
    codes = cast("Iterable[Mapping[str, Any]]", night.result.get("sensor_codes", ()))
    return [str(c["place"]["channel"]) for c in codes if c["code"] in _STILL]


def _judged(
    night: StoredNight,
    found: Sequence[_Found],
    q_value: float | None,
    tests: int,
    still: Sequence[tuple[str, date]],
    day: date,
) -> Judgement:
    """Name a machine that departs beyond chance, or has a sensor that stands still."""
    sure = q_value is not None and q_value <= FALSE_SHARE
    likely = [f for f in found if f.p_value * tests <= FALSE_SHARE] if sure else []
    causes: dict[Cause, tuple[Message, date, str]] = {}
    for channel, since in still:
        said = Message(f"fault-{Cause.SENSOR_FROZEN}", {"name": channel}, Place(channel=channel))
        causes.setdefault(Cause.SENSOR_FROZEN, (said, since, ""))
    for one in sorted(likely, key=_rank):
        cause = CAUSES[one.sign]
        said = Message(f"fault-{cause}", _figures(one), Place(channel=one.of or one.output))
        causes.setdefault(cause, (said, one.since, one.output))
    first = next(iter(causes.values()), None)
    return Judgement(
        machine=night.machine,
        kind=night.kind,
        day=day,
        named=first is not None,
        causes=tuple(causes),
        q_value=q_value,
        cusum=max((abs(f.z) for f in found), default=None),
        since=None if first is None else min(since for _, since, _ in causes.values()),
        output="" if first is None else first[2],
        evidence=tuple(said for said, _, _ in causes.values()),
    )


def _figures(one: _Found) -> dict[str, Value]:
    """Return what the sentence says."""
    name: dict[str, Value] = {"name": tuple(one.of.split(",")) if "," in one.of else one.of}
    match one.sign:
        case SignKind.LEVEL:
            return name | {"departure_k": one.departure}
        case SignKind.GAIN:
            return name | {"departure_percent": 100.0 * one.departure}
        case SignKind.TIME_CONSTANT:
            return name | {"departure_percent": 100.0 * float(np.expm1(one.departure))}
        case SignKind.MEAN:
            return {"departure_um": one.departure}
        case SignKind.REST:
            return {"times": float(np.exp(one.departure))}
        case SignKind.SWAP:
            return name


def _rank(one: _Found) -> tuple[int, float]:
    """Order causes by what hides what; gain and time constant by which explains more."""
    cause = CAUSES[one.sign]
    order = list(Cause).index(Cause.GAIN if cause in _ALIKE else cause)
    return order, -abs(one.formal)
