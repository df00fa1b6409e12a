"""Which machines need a person, and why first: what all nights of a fleet say together.

A sign is one figure of a night: how far a sensor lies from its neighbours, by what share a gain is
off, how large the residual is. It counts by how far it departs from the machine's own past beyond
what it does in its sisters in the same nights: a hot day moves all. Windows of nights that end
today are asked, so that what is small is found by lasting (cumulative sums); the spread of
departures is learnt from the machine itself, its sisters, and the same night.
"""

from collections import Counter, defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from datetime import date, timedelta
from enum import StrEnum
from typing import Any, Final, NamedTuple, cast, final

import numpy as np
from numpy.typing import NDArray

from thermaxis.codes import Message, Place, Value, message_as_json, value_of_json
from thermaxis.fleet._night import StoredNight
from thermaxis.fleet._signs import SignKind

_F = NDArray[np.float64]
_B = NDArray[np.bool_]

JUDGED_DAYS: Final = 14
"""Nights of so many days are judged together: what lasts longer unmended becomes the past. [1]"""
FALSE_SHARE: Final = 0.01
"""Share of the named that is expected to be named by chance. [1]"""
SISTERS: Final = 8
"""With fewer machines of its kind a machine is compared with those of all kinds. [1]"""
MANY: Final = 50
"""The spread of fewer is known too badly: it is that of all kinds, or of all parts. [1]"""


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
SENSOR_CAUSES: Final = frozenset({Cause.SENSOR_FROZEN, Cause.SENSORS_SWAPPED, Cause.SENSOR_OFFSET})
"""Nothing that was learnt from sensors named so is accepted."""
LEAST: Final = {
    SignKind.SWAP: 0.75,
    SignKind.LEVEL: 0.5,
    SignKind.GAIN: 0.1,
    SignKind.TIME_CONSTANT: 0.12,
    SignKind.MEAN: 0.5,
    SignKind.REST: 0.25,
}
"""Smaller departures are no reason to look at a machine, in the sign's unit."""
SHARES: Final = {
    SignKind.SWAP: 0.1,
    SignKind.LEVEL: 0.1,
    SignKind.GAIN: 0.25,
    SignKind.TIME_CONSTANT: 0.25,
    SignKind.MEAN: 0.25,
    SignKind.REST: 0.05,
}
"""Of what chance may name, the share of each sign: most to what is hardest to see."""
GROWS: Final = (SignKind.SWAP, SignKind.REST)
"""Signs that count only where they grow."""
_BY_MODEL = (Cause.SENSORS_SWAPPED, Cause.GAIN, Cause.TIME_CONSTANT)
_LEARNT = (SignKind.LEVEL, SignKind.MEAN, SignKind.REST)
_STILL = frozenset({"log-stuck", "log-constant", "log-never_measured"})
_WINDOWS = (1, 2, 3, 5, 8, 14)
_WITHIN = 0.05
"""Of a machine that is named, signs that chance shows in fewer such machines are causes. [1]"""
_INDEPENDENT = 4.0
"""Windows overlap: they count as so many at most. [1]"""
_PRIOR, _FAR = 4.0, 3.0
_NORMAL_MEDIAN, _NORMAL_90 = 1.4826, 1.6449
_STAYS = 0.3
"""Of a departure so much may still be there on the last night. [1]"""
_MOST: Final = {SignKind.SWAP: 1.5, SignKind.GAIN: 1.0, SignKind.TIME_CONSTANT: 1.4}
"""What departs by more is something else. [1]"""


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
    evidence: tuple[Message, ...] = ()
    """A sentence with figures for each cause, with what to do; its place is the part or channel."""


class _History(NamedTuple):
    """What judging reads of a machine's nights."""

    kind: str
    signs: Mapping[int, _F]
    """Value, standard deviation, that of before and its own by key, (keys, 5), by days back."""
    still: Mapping[int, frozenset[str]]
    """Channels that stand still, by days back."""


class _Found(NamedTuple):
    """A sign that departs."""

    p_value: float
    z: float
    formal: tuple[float, ...]
    """By window."""
    sign: SignKind
    output: str
    of: str
    departure: float
    back: int


_Key = tuple[SignKind, str, str]


def judge(nights: Iterable[StoredNight], day: date) -> list[Judgement]:
    """Judge every machine that has a night of a day, by its nights and those of its sisters.

    Parameters
    ----------
    nights : iterable of StoredNight
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
    The departure of a sign on night i is d_i, that of its past taken off: of the first night,
    drawn towards the sisters' as far as their pasts differ by no more than their noise. Its
    covariance V is the variances of the nights, and that p^2 of the past in common. Of a change
    on the last w nights with the shape a, 1 for a step and growing for a drift, least squares say

        T = a' V^-1 d / (a' V^-1 a)
        S^2 = 1 / (a' V^-1 a)
        z = (T - median T of the sisters) / (k S)

    with k the spread of z in the same window, from medians and quantiles that machines at fault do
    not move, not below 1 nor below that of the machine's own nights before. It is that of the
    machine's kind and sign, where they are few of its kind, or of all. What S does not tell from
    nothing is not asked. The smallest probability of all windows and signs, with the share of its
    sign in `SHARES`, is the machine's; of these those are named that hold the share of false names
    at `FALSE_SHARE`.

    References
    ----------
    Lai 1995 (window-limited sums); Benjamini and Hochberg 1995; Efron 2004 (spread from the night
    itself); Genovese, Roeder and Wasserman 2006 (shares). From memory.
    """
    from scipy import stats  # noqa: PLC0415  scipy is slow to import

    keys, histories = _histories(nights, day)
    names = list(histories)
    shape = len(names), len(SignKind)
    tests, least = np.zeros(shape), np.ones(shape)
    found: dict[int, list[_Found]] = defaultdict(list)
    kinds = np.unique([history.kind for history in histories.values()], return_inverse=True)[1]
    for column, sign in enumerate(SignKind):
        of, machines, table = _table([key[0] is sign for key in keys], histories)
        if not machines.size:
            continue
        told, p_values, several = _departures(sign, table, of, kinds[machines])
        np.add.at(tests[:, column], machines, told)
        np.minimum.at(least[:, column], machines, p_values)
        for row, one in several.items():
            _, output, name = keys[int(of[row])]
            found[int(machines[row])].append(one._replace(output=output, of=name))
    tests /= [SHARES[sign] for sign in SignKind]
    p_of = np.minimum(np.min(least * np.maximum(tests, 1.0), axis=1, initial=1.0), 1.0)
    asked = np.flatnonzero(np.any(tests, axis=1))
    q_of: dict[int, float | None] = dict.fromkeys(range(len(names)))
    if asked.size:
        shares = cast("Any", stats).false_discovery_control(p_of[asked]).tolist()
        q_of |= dict(zip(asked.tolist(), shares, strict=True))
    still = _still(histories)
    judged: list[Judgement] = []
    for k, (name, history) in enumerate(histories.items()):
        q_value = q_of[k]
        sure = q_value is not None and q_value <= FALSE_SHARE
        of_sign = dict(zip(SignKind, tests[k].tolist(), strict=True))
        likely = [f for f in found[k] if sure and f.p_value * of_sign[f.sign] <= _WITHIN]
        reasons = _reasons(still.get(name, {}), likely)
        first = next(iter(reasons.values()), None)
        judged.append(
            Judgement(
                machine=name,
                kind=history.kind,
                day=day,
                named=first is not None,
                causes=tuple(reasons),
                q_value=q_value,
                cusum=max((abs(f.z) for f in found[k]), default=None),
                since=day - timedelta(max(back for back, *_ in reasons.values()))
                if first
                else None,
                output=first[1] if first else "",
                evidence=tuple(said for *_, said in reasons.values()),
            )
        )
    return sorted(judged, key=surest_first)


def surest_first(one: Judgement) -> tuple[object, ...]:
    """Return by what judgements are ordered: the named, sensors that stand still, the surest."""
    still = one.causes[:1] == (Cause.SENSOR_FROZEN,)
    return not one.named, not still, one.q_value or 0.0, -(one.cusum or 0.0), one.machine


def _histories(nights: Iterable[StoredNight], day: date) -> tuple[list[_Key], dict[str, _History]]:
    """Return all keys, and the nights of each machine by its model of the day."""
    keys: dict[_Key, int] = {}
    by_machine: dict[str, dict[int, tuple[str, str, _F, frozenset[str]]]] = defaultdict(dict)
    for night in nights:
        back = (day - night.day).days
        if 0 <= back < JUDGED_DAYS:
            result = cast("Mapping[str, Any]", night.result)
            signs = [
                (
                    keys.setdefault((SignKind(s["sign"]), s["output"], s["of"]), len(keys)),
                    *(s["value"], s["std"], s["before"], s["before_std"]),
                )
                for s in result.get("signs", ())
            ]
            codes = result.get("sensor_codes", ())
            still = frozenset(c["place"]["channel"] for c in codes if c["code"] in _STILL)
            of = (night.kind, night.model_sha256, np.array(signs).reshape(-1, 5), still)
            by_machine[night.machine][back] = of
    histories: dict[str, _History] = {}
    for name, own in by_machine.items():
        if 0 in own:
            kind, model = own[0][:2]
            same = {back: one[2:] for back, one in own.items() if one[1] == model}
            signs = {back: one[0] for back, one in same.items()}
            histories[name] = _History(kind, signs, {back: one[1] for back, one in same.items()})
    return list(keys), histories


def _table(
    asked: Sequence[bool], histories: Mapping[str, _History]
) -> tuple[NDArray[np.intp], NDArray[np.intp], _F]:
    """Return a row for each machine and key that is asked: key, machine, and figures by night.

    Figures are (rows, nights, 4), the last night at last. Where nothing is known the standard
    deviation is infinite.
    """
    every = [history.signs for history in histories.values()]
    found = [rows for signs in every for rows in signs.values()]
    values, counts = np.concatenate([np.zeros((0, 5)), *found]), [len(rows) for rows in found]
    machine = np.repeat([k for k, signs in enumerate(every) for _ in signs], counts).astype(np.intp)
    back = np.repeat([back for signs in every for back in signs], counts).astype(np.intp)
    key = values[:, 0].astype(np.intp)
    own = np.flatnonzero(np.asarray(asked, bool)[key])
    pairs, row = np.unique(key[own] * len(every) + machine[own], return_inverse=True)
    table = np.zeros((pairs.size, JUDGED_DAYS, 4))
    table[:, :, 1] = np.inf
    table[row, JUDGED_DAYS - 1 - back[own]] = values[own, 1:]
    return *np.divmod(pairs, len(every)), table


def _departures(
    sign: SignKind, table: _F, of: NDArray[np.intp], kinds: NDArray[np.intp]
) -> tuple[_B, _F, dict[int, _Found]]:
    """Return which rows are asked, how probably chance departs so far, and what departs."""
    from scipy.special import ndtr  # noqa: PLC0415  scipy is slow to import

    rows, count = np.arange(len(table)), len(table)
    known = np.isfinite(table[:, :, 1])
    first, last = np.argmax(known, axis=1), JUDGED_DAYS - 1 - np.argmax(known[:, ::-1], axis=1)
    departure, std, past = _from_past(sign, table, first, of, kinds)
    weight = std**-2.0
    total = 1.0 + past**2 * np.sum(weight, axis=1)
    squares = departure**2 / (std**2 + past[:, None] ** 2)
    shapes = [(w, np.ones(w)) for w in _WINDOWS]
    if sign is SignKind.MEAN:
        shapes = [*shapes[2:], *((w, (np.arange(w) + 0.5) / w) for w in _WINDOWS[2:])]
    asked = np.zeros(count, bool)
    best = np.zeros((count, 3))  # z, departure, window
    every = np.zeros((count, len(shapes)))
    for number, (w, shape) in enumerate(shapes):
        g = shape * weight[:, -w:]
        level = past**2 * np.sum(g, axis=1) / total
        m = np.sum(shape * g, axis=1) - level * np.sum(g, axis=1)
        seen = m > 0.0
        m = np.where(seen, m, 1.0)
        t = np.sum(g * departure[:, -w:], axis=1) - level * np.sum(weight * departure, axis=1)
        t, s = t / m, m**-0.5
        beyond, spread = _beside_sisters(t, s, of, kinds, seen)
        formal = beyond / s
        own = np.sum(np.minimum(squares[:, :-w], (_FAR * spread[:, None]) ** 2), axis=1)
        own = (_PRIOR * spread**2 + own) / (_PRIOR + np.sum(known[:, :-w], axis=1))
        z = formal / np.maximum(spread, np.sqrt(own))
        seen &= s <= LEAST[sign]
        if sign is SignKind.MEAN:  # one odd day is no drift
            seen &= np.count_nonzero(known[:, -w:], axis=1) >= _WINDOWS[2]
        asked |= seen
        better = seen & (np.abs(z) > np.abs(best[:, 0])) & (np.abs(beyond) >= LEAST[sign])
        better &= np.abs(beyond) <= _MOST.get(sign, np.inf)
        # what has gone since is no reason any more
        better &= np.sign(t) * departure[rows, last] + 2.0 * std[rows, last] >= _STAYS * np.abs(t)
        if sign in GROWS:
            better &= beyond > 0.0
        if sign is SignKind.SWAP:  # the likelihood of 1 against 0
            formal = np.sqrt(np.maximum(2.0 * t - 1.0, 0.0)) / s
        every[:, number] = formal
        candidate = np.column_stack([z, beyond, np.full(count, w)])
        best = np.where(better[:, None], candidate, best)
    windows = np.minimum(np.sum(known, axis=1), _INDEPENDENT)
    p_values = np.minimum(2.0 * ndtr(-np.abs(best[:, 0])) * windows, 1.0)
    back = np.minimum(best[:, 2] - 1, JUDGED_DAYS - 1 - first)
    found: dict[int, _Found] = {}
    for k in np.flatnonzero(best[:, 2]).tolist():
        z, beyond, _ = best[k].tolist()
        formal = tuple(np.abs(every[k]).tolist())
        found[k] = _Found(float(p_values[k]), z, formal, sign, "", "", beyond, int(back[k]))
    return asked, p_values, found


def _from_past(
    sign: SignKind,
    table: _F,
    first: NDArray[np.intp],
    of: NDArray[np.intp],
    kinds: NDArray[np.intp],
) -> tuple[_F, _F, _F]:
    """Return departures from the past by night, their standard deviations, and that of the past."""
    rows = np.arange(len(table))
    value, std, before, before_std = np.moveaxis(table, 2, 0)
    known, past = np.isfinite(std), before_std[rows, first]
    if sign in _LEARNT:  # the spread of a few days is known badly: shrunk towards the sisters'
        std = np.sqrt(0.5 * (std**2 + np.median(std[known] ** 2)))
        past = np.sqrt(0.5 * (past**2 + np.median(past**2)))
    if sign is SignKind.MEAN:
        return _levels(value, before, known), std, past
    base, seen = before[rows, first], known.any(axis=1)
    apart, spread = _beside_sisters(base, past, of, kinds, seen)
    # a past no farther from the sisters' than its noise is theirs; another one is its own
    drawn = (np.bincount(of[seen], minlength=of.max() + 1)[of] >= SISTERS) & (
        np.abs(apart) <= _FAR * spread * past
    )
    share = np.where(drawn, spread**-2.0, 0.0)
    base, past = base - share * apart, past * np.sqrt(1.0 - share)
    return np.where(known, value - base[:, None], 0.0), std, past


def _levels(value: _F, before: _F, known: _B) -> _F:
    """Return a mean residual by night against the past of the first, from night to night.

    The zero of a free run is another one each night; the mean of the night before has the same.
    """
    level, begun = np.zeros(len(value)), np.zeros(len(value), bool)
    levels = np.zeros_like(value)
    for k in range(JUDGED_DAYS):
        more = np.where(begun, level + value[:, k] - before[:, k], value[:, k])
        level, begun = np.where(known[:, k], more, level), begun | known[:, k]
        levels[:, k] = level
    return levels


def _beside_sisters(
    t: _F, s: _F, of: NDArray[np.intp], kinds: NDArray[np.intp], seen: _B
) -> tuple[_F, _F]:
    """Return how far each lies from its sisters, and how far its kind spreads, in units of s.

    A median of few is that of all kinds; a spread of few that of all kinds and keys.
    """
    apart, spread = t.copy(), np.ones(t.size)
    of_kind = of * (np.max(kinds) + 1) + kinds
    for groups in (of, of_kind):
        for group in np.unique(groups[seen]).tolist():
            rows = groups == group
            if np.count_nonzero(rows & seen) >= SISTERS:
                apart[rows] = t[rows] - np.median(t[rows & seen])
    z = np.abs(apart) / s
    for groups, fewest in ((np.zeros_like(of), SISTERS), (kinds, MANY), (of_kind, MANY)):
        for group in np.unique(groups).tolist():
            rows = groups == group
            own = z[rows & seen]
            if own.size >= fewest:
                wide = (_NORMAL_MEDIAN * np.median(own), np.quantile(own, 0.9) / _NORMAL_90)
                spread[rows] = max(*wide, 1.0)
    return apart, spread


def _still(histories: Mapping[str, _History]) -> dict[str, dict[str, int]]:
    """Return for how many days back channels stand still: not those that do in many sisters."""
    sisters = Counter(history.kind for history in histories.values())
    share = Counter((h.kind, channel) for h in histories.values() for channel in h.still[0])
    found: dict[str, dict[str, int]] = {}
    for name, history in histories.items():
        for channel in sorted(history.still[0]):
            if share[history.kind, channel] <= max(2, sisters[history.kind] // 4):
                moved = [back for back, still in history.still.items() if channel not in still]
                since = (back for back in history.still if back < min(moved, default=JUDGED_DAYS))
                found.setdefault(name, {})[channel] = max(since)
    return found


def _reasons(
    still: Mapping[str, int], likely: Sequence[_Found]
) -> dict[Cause, tuple[int, str, Message]]:
    """Return days back, output and sentence by cause, the likeliest first.

    What hides others comes first; of what a model would explain, what explains most.
    """
    by_model = [f for f in likely if CAUSES[f.sign] in _BY_MODEL]
    surest = max(by_model, key=lambda f: abs(f.z), default=None)
    same = 0 if surest is None else sum(w <= surest.back for w in _WINDOWS[:-1])
    best = max(by_model, key=lambda f: f.formal[same], default=None)  # over the same nights

    def rank(one: _Found) -> tuple[int, bool, float]:
        cause, first = CAUSES[one.sign], one is best
        if cause in _BY_MODEL and not (first and cause is Cause.SENSORS_SWAPPED):
            cause = Cause.GAIN
        return list(Cause).index(cause), not first, -abs(one.z)

    found: dict[Cause, tuple[int, str, Message]] = {}
    for channel, back in still.items():
        said = Message(f"fault-{Cause.SENSOR_FROZEN}", {"name": channel}, Place(channel=channel))
        found.setdefault(Cause.SENSOR_FROZEN, (back, "", said))
    for one in sorted(likely, key=rank):
        cause, place = CAUSES[one.sign], Place(channel=one.of or one.output)
        said = Message(f"fault-{cause}", _figures(one), place)
        found.setdefault(cause, (one.back, one.output, said))
    return found


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


def judgement_as_json(one: Judgement) -> dict[str, object]:
    """Return a judgement as JSON has it."""
    return {
        "machine": one.machine,
        "kind": one.kind,
        "day": one.day.isoformat(),
        "named": one.named,
        "causes": [str(cause) for cause in one.causes],
        "q_value": one.q_value,
        "cusum": one.cusum,
        "since": None if one.since is None else one.since.isoformat(),
        "output": one.output,
        "evidence_codes": [message_as_json(message) for message in one.evidence],
    }


def judgement_of_json(found: Mapping[str, Any]) -> Judgement:
    """Return the judgement that `judgement_as_json` wrote."""
    values = {key: found[key] for key in ("machine", "kind", "named", "q_value", "cusum", "output")}
    return Judgement(
        **values,
        day=date.fromisoformat(found["day"]),
        causes=tuple(Cause(cause) for cause in found["causes"]),
        since=None if found["since"] is None else date.fromisoformat(found["since"]),
        evidence=tuple(cast("Message", value_of_json(one)) for one in found["evidence_codes"]),
    )
