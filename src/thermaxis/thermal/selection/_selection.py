"""Choose temperatures and lags of a compensation model among many candidate channels.

The sensors of a machine are many and move together: a subset that fits a record best often fails
on the next day, and so does the best set of time constants. All healthy candidates are therefore
kept with gains held small, as much as the uncertainty of the temperatures asks for, and models of
few time constants, common to all channels, are averaged instead of chosen. Their weights and the
uncertainty come from the error in free run on whole parts of the record that were held out, for
all outputs together. An average of such models is again one: gains and first-order lags.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import combinations, pairwise
from types import MappingProxyType
from typing import final

import numpy as np

from thermaxis.codes import Message
from thermaxis.errors import ConfigurationError, DataError
from thermaxis.thermal._arrays import FloatArray
from thermaxis.thermal.log import Experiment, common_shape
from thermaxis.thermal.selection._bank import RecordPart, banks_of, record_parts
from thermaxis.thermal.selection._sensors import sensor_noise_k
from thermaxis.thermal.selection._validation import Member, Structure, Validation, validation_of
from thermaxis.thermal.transfer_function import ModalPart, ThermalModel

SENSOR_UNCERTAINTIES_K = (0.05, 0.1, 0.2, 0.4, 0.8)
"""Uncertainties of the temperatures that are tried; the first is half a count of 0.1 K. [K]"""
FIXED_TIME_CONSTANTS_S = (300.0, 1200.0, 3600.0, 10800.0)
"""Time constants of the baseline with fixed exponential averages. [s]"""
LAG_RATIO = 4.0
"""Each time constant tried is so many times the one before: closer ones tell the same. [1]"""
LONGEST_LAG_S = 86400.0
"""Largest time constant tried, however long the record: what is slower is the season. [s]"""
LEAST_WEIGHT = 0.02
"""Models with a smaller share of the average are left out. [1]"""
RECORD_PER_LAG = 8.0
"""A record is at least so many times longer than the largest time constant tried. [1]"""
FEWEST_MEANS, MOST_MEANS = 100, 20_000
"""Means that a record is reduced to; averaging is linear and keeps the lags exact. [1]"""
SHORTEST_PART_S = 3600.0
"""Parts shorter than this say little about the free run of a warm-up. [s]"""
_OPPOSED_CORRELATION = 0.98
_OPPOSED_SHARE = 0.25


@final
@dataclass(frozen=True, slots=True)
class SelectionOptions:
    """How the selection is made.

    Raises
    ------
    ConfigurationError
        If a number is out of its range.
    """

    sensor_uncertainties_k: tuple[float, ...] = SENSOR_UNCERTAINTIES_K
    """Uncertainties of the temperatures that are tried; gains are held small accordingly. [K]"""
    shortest_lag_s: float = 300.0
    """Smallest time constant tried; each of the next is four times the one before. [s]"""
    lag_sets_s: tuple[tuple[float, ...], ...] | None = None
    """Sets of time constants of the models that are averaged, in place of none, one and two
    neighbours. [s]"""
    offset: bool = False
    """Whether a displacement at the reference is allowed. In relative coordinates it is zero."""
    parts: int = 5
    """Parts that the record is cut into. [1]"""
    mean_s: float = 300.0
    """Averaging time of displacements and lags: a hundredth of a short record, and more of one
    that is longer than two months. [s]"""
    fewest_channels: bool = False
    """Whether as many channels are left out as one standard error allows."""
    most_channels: int | None = None
    """Largest number of channels. Default: all that are healthy. [1]"""
    faulty: tuple[str, ...] = ()
    """Candidates that are not learnt from, as of `faulty_candidates`."""

    def __post_init__(self) -> None:
        if not self.sensor_uncertainties_k or min(self.sensor_uncertainties_k) <= 0:
            raise ConfigurationError(
                "not_positive",
                value=min(self.sensor_uncertainties_k, default=0.0),
                key="sensor_uncertainties_k",
            )
        if self.parts < 2:
            raise ConfigurationError("too_few_parts", parts=self.parts, key="parts")
        if not (self.shortest_lag_s > 0 and self.mean_s > 0):
            raise ConfigurationError(
                "not_positive",
                value=min(self.shortest_lag_s, self.mean_s),
                key="shortest_lag_s, mean_s",
            )
        if self.most_channels is not None and self.most_channels < 1:
            raise ConfigurationError("not_positive", value=self.most_channels, key="most_channels")
        if self.lag_sets_s is not None and (
            not self.lag_sets_s or any(tau <= 0 for taus in self.lag_sets_s for tau in taus)
        ):
            raise ConfigurationError("no_lag_sets", key="lag_sets_s")


@final
@dataclass(frozen=True, slots=True)
class StructureScore:
    """Error in free run of one set of time constants, with its best uncertainty."""

    time_constants_s: tuple[float, ...]
    """Time constants, common to all channels; none for a static model. [s]"""
    sensor_uncertainty_k: float
    """Uncertainty of the temperatures. [K]"""
    weight: float
    """Share of its model in the average; zero where it was left out. [1]"""
    score: float
    """Error over that of each output's best structure, mean over outputs and splits. [1]"""
    excess: float
    """Score less the best score. [1]"""
    excess_se: float
    """Standard error of `excess` from its scatter over the splits. [1]"""


@final
@dataclass(frozen=True, slots=True)
class ChannelScore:
    """Error in free run with the most useful channels only."""

    channels: tuple[str, ...]
    """Channels of the model, the most useful one first."""
    score: float
    """As in `StructureScore`. [1]"""
    excess: float
    """Score less the best score of any number of channels. [1]"""
    excess_se: float
    """Standard error of `excess`. [1]"""


@final
@dataclass(frozen=True, slots=True, eq=False)
class SelectedOutput:
    """Model of one displacement and what it is worth on parts that it did not see."""

    model: ThermalModel
    """The model, learned from the whole record; one part per channel."""
    validation_mae_um: float
    """Mean absolute error in free run on parts held out. [µm]"""
    baseline_mae_um: Mapping[str, float]
    """Errors on the same parts of `hold` (the last displacement before), `static` (ridge
    regression without lags) and `averages` (with four fixed lags), by the same rule. [µm]"""
    flags: tuple[Message, ...] = ()
    """What the record does not support."""


@final
@dataclass(frozen=True, slots=True, eq=False)
class SelectionResult:
    """Chosen channels and time constants, and the model of every output."""

    outputs: Mapping[str, SelectedOutput]
    """By name of the output."""
    channels: tuple[str, ...]
    """Channels of the models, the most useful one first."""
    time_constants_s: tuple[float, ...]
    """Time constants, common to all channels. [s]"""
    sensor_uncertainty_k: float
    """Uncertainty of the temperatures that held the gains small, mean by weight. [K]"""
    offset: bool
    """Whether the models have an offset."""
    structures: tuple[StructureScore, ...]
    """What was tried: one per set of time constants."""
    curve: tuple[ChannelScore, ...]
    """Error against the number of channels, from one channel to all."""
    parts: tuple[RecordPart, ...]
    """Parts of the record that were held out."""
    rule: Message
    warnings: tuple[Message, ...] = ()
    """What the reader of the result must know."""
    stable: bool = field(default=True, init=False)
    """Real positive time constants: always stable."""

    @property
    def model(self) -> ThermalModel:
        """Model of the only output.

        Raises
        ------
        DataError
            If there are several outputs.
        """
        if len(self.outputs) != 1:
            raise DataError("several_outputs", outputs=len(self.outputs))
        return next(iter(self.outputs.values())).model


@final
@dataclass(frozen=True, slots=True, eq=False)
class _Scored:
    """A structure with its errors."""

    structure: Structure
    position: int
    """Position of the uncertainty of the temperatures."""
    relative: FloatArray
    """Error over that of each output's best, mean over outputs, (splits,)."""
    errors: FloatArray
    """(splits, o). [µm]"""

    @property
    def score(self) -> float:
        return float(np.nanmean(self.relative))


def select(
    experiments: Mapping[str, Sequence[Experiment]] | Sequence[Experiment],
    *,
    candidate_names: Sequence[str],
    options: SelectionOptions | None = None,
) -> SelectionResult:
    """Choose channels and time constants, and identify the models of one or more outputs.

    Parameters
    ----------
    experiments : mapping of str to sequence of Experiment, or sequence of Experiment
        Experiments of every output by its name, with the candidates as inputs; the outputs share
        inputs and sample times. A bare sequence is the one output ``displacement``.
    candidate_names : sequence of str
        Names of the inputs, in their order.
    options : SelectionOptions, optional
        How the selection is made.

    Returns
    -------
    SelectionResult
        Models, what was chosen and why, and baselines.

    Raises
    ------
    DataError
        If names and inputs are not one each, outputs have other inputs, a displacement never
        changes or was measured in one part of the record only, or no healthy candidate is left.

    Notes
    -----
    The record is cut into parts. Each is predicted in free run from temperatures alone, by models
    learned from all other parts, and each of the later half also from the parts before it. A ridge
    penalty is the squared uncertainty of the temperatures, plus for the direct gains the noise of
    each channel: the error to be expected where a temperature is wrong by so much. Each set of time
    constants takes its best uncertainty. The weight of its model is its score to the power of minus
    the number of parts: the likelihood of errors whose scale is unknown, where each part is one
    independent observation.
    """
    settings = options or SelectionOptions()
    outputs = _by_name(experiments)
    first = next(iter(outputs.values()))
    names = tuple(candidate_names)
    _check_names(names, common_shape(first))
    _check_displacements(outputs)
    columns = [i for i, name in enumerate(names) if name not in settings.faulty]
    if not columns:
        raise DataError("no_healthy_candidate", names=names)
    parts = record_parts(first, settings.parts)
    duration_s = max(e.duration_s for e in first)
    sets = settings.lag_sets_s or _lag_sets(settings.shortest_lag_s, duration_s)
    time_constants = np.unique(
        np.concatenate([[*taus] for taus in (*sets, FIXED_TIME_CONSTANTS_S)])
    )
    banks = banks_of(outputs, columns, time_constants, _mean_s(first, settings.mean_s), parts)
    validation = validation_of(
        banks, len(parts), sensor_noise_k(first)[columns], np.array(settings.sensor_uncertainties_k)
    )
    search = _Search(
        validation=validation,
        time_constants_s=time_constants,
        channels=tuple(names[i] for i in columns),
        lag_sets_s=sets,
        settings=settings,
    )
    return _result(search, tuple(outputs), parts)


@final
@dataclass(frozen=True, slots=True, eq=False)
class _Search:
    """What the search works on."""

    validation: Validation
    time_constants_s: FloatArray
    channels: tuple[str, ...]
    lag_sets_s: tuple[tuple[float, ...], ...]
    settings: SelectionOptions

    def lags(self, time_constants_s: Sequence[float]) -> tuple[int, ...]:
        """Return the positions of time constants."""
        return tuple(np.searchsorted(self.time_constants_s, list(time_constants_s)).tolist())


def _by_name(
    experiments: Mapping[str, Sequence[Experiment]] | Sequence[Experiment],
) -> dict[str, Sequence[Experiment]]:
    if isinstance(experiments, Mapping):
        outputs = dict(experiments)
    else:
        outputs = {"displacement": experiments}
    if not outputs:
        raise DataError("no_output")
    return outputs


def _check_names(names: tuple[str, ...], inputs: int) -> None:
    if len(names) != inputs or len(set(names)) != len(names):
        raise DataError("count_not_inputs", count=len(set(names)), inputs=inputs, key="names")


def _check_displacements(outputs: Mapping[str, Sequence[Experiment]]) -> None:
    for name, experiments in outputs.items():
        y = np.concatenate([e.y for e in experiments]) if experiments else np.zeros(1)
        if not float(np.nanmax(y)) > float(np.nanmin(y)):
            raise DataError("displacement_constant", channel=name)


def _mean_s(experiments: Sequence[Experiment], wanted_s: float) -> float:
    """Return the averaging time: enough means of a short record, not too many of a long one."""
    total_s = sum(e.duration_s for e in experiments)
    longest_s = max(e.duration_s for e in experiments)
    return max(min(wanted_s, longest_s / FEWEST_MEANS), total_s / MOST_MEANS)


def _lag_sets(shortest_s: float, duration_s: float) -> tuple[tuple[float, ...], ...]:
    """Return none, one and two neighbouring time constants, as far as the record supports them."""
    taus: list[float] = []
    longest_s = min(LONGEST_LAG_S, duration_s / RECORD_PER_LAG)
    while shortest_s * LAG_RATIO ** len(taus) <= longest_s:
        taus.append(shortest_s * LAG_RATIO ** len(taus))
    return ((), *((tau,) for tau in taus), *pairwise(taus))


def _mean_over(values: FloatArray, axis: int) -> FloatArray:
    """Return means that leave out NaN; NaN where nothing is left."""
    present = ~np.isnan(values)
    total = np.sum(np.where(present, values, 0.0), axis=axis)
    count = np.count_nonzero(present, axis=axis)
    return np.where(count > 0, total / np.maximum(count, 1), np.nan)


def _scored(
    search: _Search, sets: Sequence[tuple[float, ...]], best_um: FloatArray | None = None
) -> tuple[list[_Scored], FloatArray]:
    """Judge sets of time constants, each with its best uncertainty, over each output's best."""
    every = tuple(range(len(search.channels)))
    structures = [Structure(search.lags(taus), every, search.settings.offset) for taus in sets]
    errors = [search.validation.errors(structure) for structure in structures]
    reference_um = best_um
    if reference_um is None:
        least = np.min(_mean_over(np.stack(errors), 2), axis=(0, 1))
        reference_um = np.maximum(least, np.finfo(np.float64).tiny)
    found: list[_Scored] = []
    for structure, own in zip(structures, errors, strict=True):
        relative = _mean_over(own / reference_um, 2)
        position = int(np.argmin(_mean_over(relative, 1)))
        found.append(_Scored(structure, position, relative[position], own[position]))
    return found, reference_um


def _check_judged(search: _Search, best_um: FloatArray) -> None:
    for name, least_um in zip(search.validation.output_names, best_um.tolist(), strict=True):
        if np.isnan(least_um):
            raise DataError("measured_in_one_part", channel=name)


def _excess(own: FloatArray, best: FloatArray) -> tuple[float, float]:
    """Return mean and standard error of the difference over the splits."""
    difference = own - best
    difference = difference[~np.isnan(difference)]
    if difference.size < 2:
        return float(np.sum(difference)), 0.0
    error = float(np.std(difference, ddof=1)) / difference.size**0.5
    return float(np.mean(difference)), error


def _members(scored: Sequence[_Scored], parts: int) -> tuple[Member, ...]:
    """Return the models that are averaged, by weight, the heaviest first."""
    score = np.array([s.score for s in scored])
    share = (float(np.min(score)) / score) ** parts
    share = np.where(share < LEAST_WEIGHT * np.sum(share), 0.0, share)
    share = share / np.sum(share)
    return tuple(
        Member(scored[i].structure, scored[i].position, float(share[i]))
        for i in sorted(range(len(scored)), key=lambda i: -float(share[i]))
        if share[i] > 0
    )


def _with_channels(members: Sequence[Member], channels: tuple[int, ...]) -> tuple[Member, ...]:
    """Return the same models with other channels."""
    return tuple(
        Member(Structure(m.structure.lags, channels, m.structure.offset), m.position, m.weight)
        for m in members
    )


def _relative(
    search: _Search, members: Sequence[Member], channels: tuple[int, ...], best_um: FloatArray
) -> FloatArray:
    errors = search.validation.average_errors(_with_channels(members, channels))
    return _mean_over(errors / best_um, 1)


def _elimination(
    search: _Search, members: Sequence[Member], best_um: FloatArray
) -> list[tuple[tuple[int, ...], FloatArray]]:
    """Leave out the least useful channel again and again; return channels and scores, fewest first.

    The heaviest model tells which one; the scores are those of the average. The channels of each
    entry stand in the order of their use: they are those of the entry before and the one that
    would be left out next.
    """
    heaviest = (Member(members[0].structure, members[0].position, 1.0),)
    left: tuple[int, ...] = tuple(range(len(search.channels)))
    dropped: list[int] = []
    while len(left) > 1:
        trials = [tuple(c for c in left if c != out) for out in left]
        scores = [float(np.nanmean(_relative(search, heaviest, t, best_um))) for t in trials]
        least = int(np.argmin(scores))
        dropped.append(left[least])
        left = trials[least]
    order = (*left, *reversed(dropped))
    counts = range(1, len(order) + 1)
    return [(order[:n], _relative(search, members, order[:n], best_um)) for n in counts]


def _curve(
    search: _Search, steps: Sequence[tuple[tuple[int, ...], FloatArray]]
) -> tuple[ChannelScore, ...]:
    best = min((score for _, score in steps), key=lambda s: float(np.nanmean(s)))
    found: list[ChannelScore] = []
    for channels, score in steps:
        excess, error = _excess(score, best)
        names = tuple(search.channels[c] for c in channels)
        found.append(ChannelScore(names, float(np.nanmean(score)), excess, error))
    return tuple(found)


def _kept(curve: Sequence[ChannelScore], settings: SelectionOptions) -> int:
    """Return the number of channels of the models."""
    most = min(len(curve), settings.most_channels or len(curve))
    if not settings.fewest_channels:
        return most
    within = [i + 1 for i, point in enumerate(curve) if point.excess <= point.excess_se]
    return min(most, within[0])


def _models(
    search: _Search, members: Sequence[Member], gains: Sequence[FloatArray]
) -> list[ThermalModel]:
    """Return the averages of the members' models, one per output."""
    channels = members[0].structure.channels
    lags = sorted({lag for m in members for lag in m.structure.lags})
    total = np.zeros((1 + len(lags), len(channels), gains[0].shape[1]))
    offset_um = np.zeros(gains[0].shape[1])
    for member, own in zip(members, gains, strict=True):
        rows = [0, *(1 + lags.index(lag) for lag in member.structure.lags)]
        size = len(rows) * len(channels)
        total[rows] += member.weight * own[:size].reshape(len(rows), len(channels), -1)
        if member.structure.offset:
            offset_um += member.weight * own[-1]
    taus = search.time_constants_s[lags]
    return [
        ThermalModel(
            parts=tuple(
                ModalPart(
                    input_name=search.channels[channel],
                    direct_gain=float(total[0, i, output]),
                    gains=total[1:, i, output],
                    time_constants_s=taus,
                )
                for i, channel in enumerate(channels)
            ),
            offset_um=float(offset_um[output]),
        )
        for output in range(offset_um.size)
    ]


def _opposed(model: ThermalModel, correlation: FloatArray) -> list[Message]:
    """Name channels that move together and act against each other."""
    dc = np.array([part.dc_gain for part in model.parts])
    floor = _OPPOSED_SHARE * float(np.max(np.abs(dc)))
    found: list[Message] = []
    for i, j in combinations(range(dc.size), 2):
        strong = min(abs(dc[i]), abs(dc[j])) > floor and dc[i] * dc[j] < 0
        if strong and correlation[i, j] > _OPPOSED_CORRELATION:
            values = {"first": model.input_names[i], "first_um_per_k": float(dc[i])}
            values |= {"second": model.input_names[j], "second_um_per_k": float(dc[j])}
            values |= {"correlation": float(correlation[i, j])}
            found.append(Message("warning-inputs_opposed", values))
    return found


def _time_constants(search: _Search, members: Sequence[Member]) -> tuple[float, ...]:
    lags = sorted({lag for m in members for lag in m.structure.lags})
    return tuple(search.time_constants_s[lags].tolist())


def _baselines(search: _Search, best_um: FloatArray) -> dict[str, FloatArray]:
    """Return the errors of the baselines on the splits, (o,) each."""
    found = {"hold": _mean_over(search.validation.hold_errors(), 0)}
    for name, taus in (("static", ()), ("averages", FIXED_TIME_CONSTANTS_S)):
        scored, _ = _scored(search, [taus], best_um)
        found[name] = _mean_over(scored[0].errors, 0)
    return found


def _structures(
    search: _Search, scored: Sequence[_Scored], members: Sequence[Member]
) -> tuple[StructureScore, ...]:
    best = min(scored, key=lambda s: s.score)
    weights = {m.structure: m.weight for m in members}
    found: list[StructureScore] = []
    for taus, own in zip(search.lag_sets_s, scored, strict=True):
        excess, error = _excess(own.relative, best.relative)
        found.append(
            StructureScore(
                time_constants_s=taus,
                sensor_uncertainty_k=search.settings.sensor_uncertainties_k[own.position],
                weight=weights.get(own.structure, 0.0),
                score=own.score,
                excess=excess,
                excess_se=error,
            )
        )
    return tuple(found)


def _rule(search: _Search, parts: Sequence[RecordPart], kept: int) -> Message:
    settings, healthy = search.settings, len(search.channels)
    channels = Message("rule-some_kept", {"kept": kept, "healthy": healthy})
    if kept == healthy:
        channels = Message("rule-all_kept", {"healthy": healthy})
    sets = tuple("+".join(f"{t:g}" for t in s) or "none" for s in search.lag_sets_s)
    values = {
        "parts": len(parts),
        "part_h": parts[0].duration_s / 3600,
        "lag_sets_s": sets,
        "least_percent": 100 * LEAST_WEIGHT,
        "uncertainties_k": tuple(f"{u:g}" for u in settings.sensor_uncertainties_k),
        "reference": "free" if settings.offset else "zero",
        "channels": channels,
    }
    return Message("rule-averaged", values)


def _warnings(
    search: _Search,
    members: Sequence[Member],
    parts: Sequence[RecordPart],
) -> tuple[Message, ...]:
    found: list[Message] = []
    longest = max((t for s in search.lag_sets_s for t in s), default=0.0)
    limited = LAG_RATIO * longest <= LONGEST_LAG_S
    if limited and longest in search.time_constants_s[list(members[0].structure.lags)]:
        found.append(Message("warning-largest_lag_chosen", {"time_constant_s": longest}))
    shortest_s = min(part.duration_s for part in parts)
    if shortest_s < SHORTEST_PART_S:
        found.append(Message("warning-parts_short", {"duration_min": shortest_s / 60}))
    if members[0].position == len(search.settings.sensor_uncertainties_k) - 1:
        found.append(Message("warning-gains_held_small"))
    return tuple(found)


def _result(
    search: _Search, output_names: Sequence[str], parts: tuple[RecordPart, ...]
) -> SelectionResult:
    """Search, and put the result together."""
    scored, best_um = _scored(search, search.lag_sets_s)
    _check_judged(search, best_um)
    members = _members(scored, len(parts))
    structures = _structures(search, scored, members)
    steps = _elimination(search, members, best_um)
    curve = _curve(search, steps)
    kept = _kept(curve, search.settings)
    members = _with_channels(members, steps[kept - 1][0])
    structure = members[0].structure
    validation = search.validation
    errors = _mean_over(validation.average_errors(members), 0)
    gains = [validation.fit(m.structure, m.position) for m in members]
    correlation = validation.correlation(structure.channels)
    baselines = _baselines(search, best_um)
    found: dict[str, SelectedOutput] = {}
    for i, (name, model) in enumerate(
        zip(validation.output_names, _models(search, members, gains), strict=True)
    ):
        own = {key: float(values[i]) for key, values in baselines.items()}
        found[name] = SelectedOutput(
            model=model,
            validation_mae_um=float(errors[i]),
            baseline_mae_um=MappingProxyType(own),
            flags=tuple(_opposed(model, correlation)),
        )
    return SelectionResult(
        outputs=MappingProxyType({name: found[name] for name in output_names}),
        channels=curve[kept - 1].channels,
        time_constants_s=_time_constants(search, members),
        sensor_uncertainty_k=sum(
            m.weight * search.settings.sensor_uncertainties_k[m.position] for m in members
        ),
        offset=structure.offset,
        structures=structures,
        curve=curve,
        parts=parts,
        rule=_rule(search, parts, kept),
        warnings=_warnings(search, members, parts),
    )
