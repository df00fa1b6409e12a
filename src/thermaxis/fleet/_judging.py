"""Which machines need a person, and why first: what all nights of a fleet say together.

A sign is one figure of a night: how far a sensor lies from its neighbours, by what share a gain is
off, how large the residual is. It counts by how far it departs from the machine's own past beyond
what it does in its sisters in the same nights: a hot day moves all. Windows of nights that end
today are asked, so that what is small is found by lasting (cumulative sums); the spread of
departures is learnt from the machine itself, its sisters, and the same night.
"""

from collections import Counter, defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import date, timedelta
from enum import StrEnum
from typing import Any, Final, NamedTuple, cast, final

import numpy as np
from numpy.typing import NDArray

from thermaxis.codes import Message, Place, Value, message_as_json, value_of_json
from thermaxis.fleet._night import StoredNight
from thermaxis.fleet._signs import KNOWN, SignKind, equations_of, without_mean

_F = NDArray[np.float64]
_B = NDArray[np.bool_]

JUDGED_DAYS: Final = 14
"""Nights of so many days are judged together: what lasts longer unmended becomes the past. [1]"""
FALSE_SHARE: Final = 0.03
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
TELLS: Final = LEAST | {SignKind.SWAP: 0.25, SignKind.GAIN: 0.05}
"""A sign is asked where it is not less sure: on a weekend nothing tells of heat."""
SHARES: Final = {
    SignKind.SWAP: 0.08,
    SignKind.LEVEL: 0.03,
    SignKind.GAIN: 0.12,
    SignKind.TIME_CONSTANT: 0.35,
    SignKind.MEAN: 0.4,
    SignKind.REST: 0.02,
}
"""Of what chance may name, the share of each sign: most to what is hardest to see."""
GROWS: Final = (SignKind.SWAP, SignKind.REST)
"""Signs that count only where they grow."""
_BY_MODEL = (Cause.SENSORS_SWAPPED, Cause.GAIN, Cause.TIME_CONSTANT)
_STILL = frozenset({"log-stuck", "log-constant", "log-never_measured"})
_WINDOWS = (1, 2, 3, 5, 8, 14)
_DRIFTS = _WINDOWS[2:]
"""One odd day is no drift."""
_OF_DRIFT = range(2, len(_WINDOWS) + len(_DRIFTS))
"""Shapes that a drift may have."""
_WITHIN = 0.05
"""Of a machine that is named, signs that chance shows in fewer such machines are causes. [1]"""
_INDEPENDENT, _SURE = 4.0, 4.0
"""Windows count as so many at most, and as few as overlap there, in standard deviations. [1]"""
_PRIOR, _FAR = 4.0, 3.0
_TOLD: Final = 1e-9
"""Of what nights say of an unknown less is rounding. [1]"""
_NORMAL_MEDIAN, _NORMAL_90 = 1.4826, 1.6449
_FORMAL: Final = 10.0
"""Degrees of freedom of the standard deviations themselves. [1]"""
_EFFICIENCY: Final = 0.5
"""Medians and quantiles tell a spread as well as the standard deviation of so large a part. [1]"""
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
    signs: Mapping[int, Sequence[Mapping[str, Any]]]
    """Figures, by days back."""
    touched: Mapping[int, Sequence[Mapping[str, Any]]]
    """Normal equations, by days back."""
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
    The touches of night i leave normal equations A_i x = b_i of what may have changed, and the
    first night A_0, b_0 of the days before; a figure of a sensor with the standard deviation s
    leaves A = 1/s^2, b = x/s^2. P says how well a model is known at least; where the days before
    are as it says, A_0 counts twice, but for the mean: it was learnt from as much. A change of
    unknown j on the last w nights with the shape a, 1 for a step and growing for a drift, is by
    least squares beside mean, ambient, gains and time constants of the machine as it was

        M = P + 2 A_0 + sum A_i,  v = b_0 + sum b_i,  c = sum a_i A_i e_j
        S^2 = 1 / (sum a_i^2 A_i,jj - c' M^-1 c)
        T = S^2 (sum a_i b_i,j - c' M^-1 v)
        z = (T - median T of the sisters) / (k S)

    with k the spread of z in the same window, from medians and quantiles that machines at fault do
    not move, not below 1 nor below that of the machine's own nights before. It is that of the
    machine's kind and sign, where they are few of its kind, or of all; z then has Student's
    distribution with half as many degrees of freedom, and ten. What S does not tell from
    nothing is not asked. A sign counts once for each window, as far as that does not overlap the
    one most like it, on one side if it only grows. The smallest probability of all windows and
    signs, with the share of its sign in `SHARES`, is the machine's; of these those are named that
    hold the share of false names at `FALSE_SHARE`.

    References
    ----------
    Lai 1995 (window-limited sums); Benjamini and Hochberg 1995; Efron 2004 (spread from the night
    itself); Genovese, Roeder and Wasserman 2006 (shares); Worsley 1982 (overlap). From memory.
    """
    from scipy import stats  # noqa: PLC0415  scipy is slow to import

    histories = _histories(nights, day)
    names = list(histories)
    shape = len(names), len(SHARES)
    tests, least = np.zeros(shape), np.ones(shape)
    found: dict[int, list[_Found]] = defaultdict(list)
    kinds = np.unique([history.kind for history in histories.values()], return_inverse=True)[1]
    of_sign: dict[SignKind, list[_Rows]] = defaultdict(list)
    for one in (*_figures_of(histories), *_touches_of(histories)):
        of_sign[one.sign].append(one)
    for column, sign in enumerate(SHARES):
        if not of_sign[sign]:
            continue
        rows = _joined(of_sign[sign])
        told, p_values, several = _departures(rows, kinds[rows.machine])
        np.add.at(tests[:, column], rows.machine, told)
        np.minimum.at(least[:, column], rows.machine, p_values)
        for row, departs in several.items():
            output, name = rows.names[int(rows.of[row])]
            found[int(rows.machine[row])].append(departs._replace(output=output, of=name))
    tests /= list(SHARES.values())
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
        asked_of = dict(zip(SHARES, tests[k].tolist(), strict=True))
        likely = [f for f in found[k] if sure and f.p_value * asked_of[f.sign] <= _WITHIN]
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


def _histories(nights: Iterable[StoredNight], day: date) -> dict[str, _History]:
    """Return the nights of each machine by its model of the day."""
    by_machine: dict[str, dict[int, StoredNight]] = defaultdict(dict)
    for night in nights:
        if 0 <= (day - night.day).days < JUDGED_DAYS:
            by_machine[night.machine][(day - night.day).days] = night
    found: dict[str, _History] = {}
    for name, own in by_machine.items():
        if 0 not in own:
            continue
        signs, touched, still = {}, {}, {}
        for back, night in own.items():
            if night.model_sha256 == own[0].model_sha256:
                result = cast("Mapping[str, Any]", night.result)
                signs[back], touched[back] = result.get("signs", ()), result.get("touched", ())
                codes = result.get("sensor_codes", ())
                still[back] = frozenset(c["place"]["channel"] for c in codes if c["code"] in _STILL)
        found[name] = _History(own[0].kind, signs, touched, still)
    return found


class _Equations(NamedTuple):
    """Normal equations of nights, a row for each machine: the last night at last."""

    matrix: _F
    """Of each night, zero where there is none, (rows, nights, p, p)."""
    vector: _F
    before: tuple[_F, _F]
    """Of the days before the first night."""

    @classmethod
    def of(cls, rows: int, unknowns: int) -> "_Equations":
        """Return equations that say nothing."""
        shape = rows, JUDGED_DAYS, unknowns
        matrix, vector = np.zeros((*shape, unknowns)), np.zeros(shape)
        return cls(matrix, vector, (matrix[:, 0].copy(), vector[:, 0].copy()))


class _Changes(NamedTuple):
    """Least squares of what has changed, a row for each machine and unknown."""

    size: _F
    """T of each shape, (rows, shapes)."""
    std: _F
    """S, infinite where nothing is known."""
    last: _F
    """By how much the last night alone departs from the machine as it was, (rows, shapes)."""
    last_std: _F
    """Its standard deviation, infinite where that night says nothing, (rows,)."""
    alike: _F
    """Correlations of the sizes, (rows, shapes, shapes)."""
    each: _F
    """How far each night departs from those before it, in standard deviations, (rows, nights); NaN
    where it says nothing."""

    def of(self, unknown: int) -> "_Changes":
        """Return the rows of one unknown, where each has a row of its own."""
        return _Changes(*(one[:, unknown] for one in self))


class _Rows(NamedTuple):
    """The changes of one sign."""

    sign: SignKind
    names: Sequence[tuple[str, str]]
    """Outputs with part or channel."""
    of: NDArray[np.intp]
    """Which of the names a row has."""
    machine: NDArray[np.intp]
    changes: _Changes


_SHAPES = np.array(
    [
        *(np.arange(JUDGED_DAYS) >= JUDGED_DAYS - w for w in _WINDOWS),
        *(np.maximum(np.arange(JUDGED_DAYS) - JUDGED_DAYS + w + 0.5, 0.0) / w for w in _DRIFTS),
    ],
    dtype=np.float64,
)


def _changes(equations: _Equations, base: int, prior: _F) -> _Changes:
    """Return the changes of each row and unknown, (rows, p, ...); see `judge`.

    The first unknowns, as many as `base`, are those of the machine as it was, with the precision
    `prior`.
    """
    matrix, vector, (before, before_vector) = equations
    known = np.diag(prior) + (np.cumsum(matrix, axis=1) + before[:, None])[..., :base, :base]
    inverse = np.asarray(np.linalg.inv(known), np.float64)  # (rows, nights, a, b)
    was = (np.cumsum(vector, axis=1) + before_vector[:, None])[..., :base]
    was = np.einsum("rnab,rnb->rna", inverse, was)
    own = np.einsum("rnjj->rjn", matrix)
    c = np.einsum("rnaj->rjna", matrix[:, :, :base])
    night = own - np.einsum("rjna,rnab,rjnb->rjn", c, inverse, c, optimize=True)
    each = np.einsum("rnj->rjn", vector) - np.einsum("rjna,rna->rjn", c, was)
    told = night > _TOLD * own
    each = np.where(told, each, np.nan) / np.sqrt(np.where(told, night, 1.0))
    inverse, was = inverse[:, -1], was[:, -1]
    of_shape = np.einsum("kn,rjna->rjka", _SHAPES, c)
    solved = np.einsum("rjka,rab->rjkb", of_shape, inverse, optimize=True)
    of_own = np.einsum("kn,ln,rjn->rjkl", _SHAPES, _SHAPES, own, optimize=True)
    both = of_own - np.einsum("rjka,rjla->rjkl", solved, of_shape, optimize=True)
    of_own, total = (np.einsum("rjkk->rjk", one) for one in (of_own, both))
    size = np.einsum("kn,rnj->rjk", _SHAPES, vector) - np.einsum("rjka,ra->rjk", of_shape, was)
    seen = total > _TOLD * of_own
    total = np.where(seen, total, 1.0)
    root = np.sqrt(total)
    size = np.where(seen, size / total, 0.0)
    as_it_was = was[:, None, None] - solved * size[..., None]
    last = vector[:, -1, :, None] - np.einsum("rja,rjka->rjk", c[:, :, -1], as_it_was)
    said = own[..., -1] > 0.0
    weight = np.where(said, own[..., -1], 1.0)
    return _Changes(
        size,
        np.where(seen, 1.0 / root, np.inf),
        last / weight[..., None],
        np.where(said, weight**-0.5, np.inf),
        np.clip(both / root[..., None] / root[..., None, :], 0.0, 1.0),
        each,
    )


def _figures_of(histories: Mapping[str, _History]) -> Iterator[_Rows]:
    """Yield the changes of the figures of sensors and innovations."""
    keys: dict[tuple[str, str, str], dict[tuple[int, int], Sequence[float]]] = defaultdict(dict)
    for machine, history in enumerate(histories.values()):
        for back, signs in history.signs.items():
            for one in signs:
                figures = one["value"], one["std"], one["before"], one["before_std"]
                keys[one["sign"], one["output"], one["of"]][machine, back] = figures
    for (sign, output, of), rows in keys.items():
        at = np.array(list(rows))
        machines, row = np.unique(at[:, 0], return_inverse=True)
        night, first = JUDGED_DAYS - 1 - at[:, 1], np.zeros(machines.size, np.intp)
        np.maximum.at(first, row, at[:, 1])
        value, std, before, before_std = np.array(list(rows.values())).T
        # the spread of a few days is known badly: shrunk towards the sisters'
        weight, weight_before = (2.0 / (each**2 + np.median(each**2)) for each in (std, before_std))
        found = _Equations.of(machines.size, 1)
        found.matrix[row, night, 0, 0], found.vector[row, night, 0] = weight, weight * value
        begin = at[:, 1] == first[row]
        found.before[0][row[begin], 0, 0] = weight_before[begin]
        found.before[1][row[begin], 0] = (weight_before * before)[begin]
        changes = _changes(found, 1, np.zeros(1)).of(0)
        zero = np.zeros(machines.size, np.intp)
        yield _Rows(SignKind(sign), [(output, of)], zero, machines, changes)


def _touches_of(histories: Mapping[str, _History]) -> Iterator[_Rows]:
    """Yield the changes of what touches tell."""
    groups: dict[tuple[str, tuple[tuple[str, str], ...]], dict[int, dict[int, Any]]]
    groups = defaultdict(lambda: defaultdict(dict))
    for machine, history in enumerate(histories.values()):
        for back, touched in history.touched.items():
            for one in touched:
                columns = tuple((kind, of) for kind, of in one["columns"])
                groups[one["output"], columns][machine][back] = one
    for (output, columns), machines in groups.items():
        found = _Equations.of(len(machines), len(columns))
        for row, nights in enumerate(machines.values()):
            datum = min((back for back, one in nights.items() if one["datum_set"]), default=None)
            for back, one in nights.items():
                older = datum is not None and back > datum
                k = row, JUDGED_DAYS - 1 - back
                found.matrix[k], found.vector[k] = equations_of(one["day"], mean=not older)
                if back == max(nights):
                    past = equations_of(one["before"], mean=datum is None)
                    found.before[0][row], found.before[1][row] = past
        kinds = [SignKind(kind) for kind, _ in columns]
        base = sum(kind is SignKind.MEAN or kind in KNOWN for kind in kinds)
        prior = np.array([KNOWN.get(kind, np.inf) for kind in kinds[:base]]) ** -2.0 + 1e-9
        changes = _changes(_with_what_model_learnt(found, base, prior), base, prior)
        of = np.array(list(machines), np.intp)
        for j, (kind, (_, name)) in enumerate(zip(kinds, columns, strict=True)):
            if kind in SHARES:
                yield _Rows(kind, [(output, name)], np.zeros_like(of), of, changes.of(j))


def _with_what_model_learnt(found: _Equations, base: int, prior: _F) -> _Equations:
    """Count the days before twice, but for the mean: the model was learnt from as much.

    Not where they say that it is another machine: its past is its own.
    """
    matrix, vector = without_mean(*found.before)
    known = np.asarray(np.linalg.inv(matrix[:, :base, :base] + np.diag(prior)), np.float64)
    own = vector[:, :base]
    far = np.einsum("ra,rab,rb->r", own, known, own, optimize=True) > _FAR**2 * base
    matrix[far] = 0.0
    return found._replace(before=(found.before[0] + matrix, found.before[1]))


def _joined(several: Sequence[_Rows]) -> _Rows:
    """Return all rows of a sign."""
    return _Rows(
        several[0].sign,
        [one.names[0] for one in several],
        np.concatenate([one.of + k for k, one in enumerate(several)]),
        np.concatenate([one.machine for one in several]),
        _Changes(*map(np.concatenate, zip(*(one.changes for one in several), strict=True))),
    )


def _departures(rows: _Rows, kinds: NDArray[np.intp]) -> tuple[_B, _F, dict[int, _Found]]:
    """Return which rows are asked, how probably chance departs so far, and what departs."""
    from scipy.special import erf, stdtr  # noqa: PLC0415  scipy is slow to import

    sign, of, count = rows.sign, rows.of, len(rows.of)
    size, std, last, last_std, alike, each = rows.changes
    known = ~np.isnan(each)
    asked = np.zeros((count, len(_SHAPES)), bool)
    best = np.zeros((count, 4))  # z, departure, window, degrees of freedom of the spread
    best[:, 3] = 1.0
    every = np.zeros((count, len(_SHAPES)))
    for number in _OF_DRIFT if sign is SignKind.MEAN else range(len(_WINDOWS)):
        w = (*_WINDOWS, *_DRIFTS)[number]
        t, s = size[:, number], std[:, number]
        seen = np.isfinite(s)
        beyond, spread, sisters = _beside_sisters(t, s, of, kinds, seen)
        formal = beyond / s
        own = np.nansum(np.minimum(each[:, :-w] ** 2, (_FAR * spread[:, None]) ** 2), axis=1)
        own = (_PRIOR * spread**2 + own) / (_PRIOR + np.sum(known[:, :-w], axis=1))
        z = formal / np.maximum(spread, np.sqrt(own))
        seen &= s <= TELLS[sign]
        if sign is SignKind.MEAN:
            seen &= np.count_nonzero(known[:, -w:], axis=1) >= _DRIFTS[0]
        asked[:, number] = seen
        better = seen & (np.abs(z) > np.abs(best[:, 0])) & (np.abs(beyond) >= LEAST[sign])
        better &= np.abs(beyond) <= _MOST.get(sign, np.inf)
        # what has gone since is no reason any more
        better &= np.sign(t) * last[:, number] + 2.0 * last_std >= _STAYS * np.abs(t)
        if sign in GROWS:
            better &= beyond > 0.0
        if sign is SignKind.SWAP:  # the likelihood of 1 against 0
            formal = np.sqrt(np.maximum(2.0 * t - 1.0, 0.0)) / s
        every[:, number] = formal
        candidate = np.column_stack([z, beyond, np.full(count, w), _FORMAL + _EFFICIENCY * sisters])
        best = np.where(better[:, None], candidate, best)
    # how likely each passes a bound that the one most like it does not pass (Worsley 1982)
    like = np.max(np.tril(np.where(asked[:, None, :], alike, 0.0), -1), axis=2)
    windows = np.sum(asked * erf(_SURE * np.sqrt(0.5 * (1.0 - like) / (1.0 + like))), axis=1)
    windows = np.clip(windows, 1.0, _INDEPENDENT) * (1.0 if sign in GROWS else 2.0)
    p_values = np.minimum(stdtr(best[:, 3], -np.abs(best[:, 0])) * windows, 1.0)
    back = np.minimum(best[:, 2] - 1, JUDGED_DAYS - 1 - np.argmax(known, axis=1))
    found: dict[int, _Found] = {}
    for k in np.flatnonzero(best[:, 2]).tolist():
        z, beyond, *_ = best[k].tolist()
        formal = tuple(np.abs(every[k]).tolist())
        found[k] = _Found(float(p_values[k]), z, formal, sign, "", "", beyond, int(back[k]))
    return np.any(asked, axis=1), p_values, found


def _beside_sisters(
    t: _F, s: _F, of: NDArray[np.intp], kinds: NDArray[np.intp], seen: _B
) -> tuple[_F, _F, _F]:
    """Return how far each lies from its sisters, how far these spread in units of s, and how many.

    A median of few is that of all kinds; a spread of few that of all kinds and keys.
    """
    apart, spread, count = t.copy(), np.ones(t.size), np.zeros(t.size)
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
                spread[rows], count[rows] = max(*wide, 1.0), own.size
    return apart, spread, count


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
        case _:  # exchanged channels; the ambient is not judged
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
