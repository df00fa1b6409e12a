"""Choose temperatures and lags of a compensation model among many candidate channels.

The sensors of a machine are many and move together: a subset that fits a record best often fails
on the next day. All healthy candidates are therefore kept with gains held small, as much as the
uncertainty of the temperatures asks for, and only few time constants, common to all channels.
How uncertain and which time constants is chosen by the error in free run on whole parts of the
record that were held out, for all outputs together.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import final

import numpy as np

from thermaxis.errors import ConfigurationError, DataError
from thermaxis.thermal._experiment import Experiment, common_shape
from thermaxis.thermal._field import FloatArray
from thermaxis.thermal._selection_bank import RecordPart, banks_of, record_parts
from thermaxis.thermal._selection_sensors import (
    SensorFinding,
    check_candidates,
    sensor_noise_k,
)
from thermaxis.thermal._selection_validation import Structure, Validation, validation_of
from thermaxis.thermal._thermal_model import ModalPart, ThermalModel

SENSOR_UNCERTAINTIES_K = (0.05, 0.1, 0.2, 0.4, 0.8)
"""Uncertainties of the temperatures that are tried; the first is half a count of 0.1 K. [K]"""
FIXED_TIME_CONSTANTS_S = (300.0, 1200.0, 3600.0, 10800.0)
"""Time constants of the baseline with fixed exponential averages. [s]"""
LAG_RATIO = 4.0
"""The second of two time constants is so many times the first. [1]"""
RECORD_PER_LAG = 8.0
"""A record is at least so many times longer than the largest time constant tried. [1]"""
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
    """Smallest time constant tried; the next are twice the one before. [s]"""
    lag_sets_s: tuple[tuple[float, ...], ...] | None = None
    """Sets of time constants to choose among, in place of none, one, and two. [s]"""
    parts: int = 5
    """Parts that the record is cut into. [1]"""
    mean_s: float = 300.0
    """Averaging time of displacements and lags; of a short record a hundredth of it. [s]"""
    fewest_channels: bool = False
    """Whether as many channels are left out as one standard error allows."""
    most_channels: int | None = None
    """Largest number of channels. Default: all that are healthy. [1]"""
    check_sensors: bool = True
    """Whether constant, stuck and exchanged channels are left out."""

    def __post_init__(self) -> None:
        """Check the numbers."""
        if not self.sensor_uncertainties_k or min(self.sensor_uncertainties_k) <= 0:
            raise ConfigurationError("uncertainties of temperatures must be positive")
        if self.parts < 2:
            raise ConfigurationError(
                f"{self.parts} part(s) cannot be held out", remedy="Ask for at least two parts"
            )
        if not (self.shortest_lag_s > 0 and self.mean_s > 0):
            raise ConfigurationError("the shortest lag and the averaging time must be positive")
        if self.most_channels is not None and self.most_channels < 1:
            raise ConfigurationError("at least one channel must be allowed")
        if self.lag_sets_s is not None and (
            not self.lag_sets_s or any(tau <= 0 for taus in self.lag_sets_s for tau in taus)
        ):
            raise ConfigurationError("time constants must be positive and one set at least given")


@final
@dataclass(frozen=True, slots=True)
class StructureScore:
    """Error in free run of one set of time constants, with the best of its other choices."""

    time_constants_s: tuple[float, ...]
    """Time constants, common to all channels; none for a static model. [s]"""
    sensor_uncertainty_k: float
    """Uncertainty of the temperatures. [K]"""
    offset: bool
    """Whether the model has an offset; else it is zero at the reference."""
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
    training_mae_um: float
    """Mean absolute error in free run on what it was learned from. [µm]"""
    baseline_mae_um: Mapping[str, float]
    """Errors on the same parts of `hold` (the last displacement before), `static` (ridge
    regression without lags) and `averages` (with four fixed lags), by the same rule. [µm]"""
    flags: tuple[str, ...] = ()
    """What the record does not support, in words."""


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
    """Uncertainty of the temperatures that held the gains small. [K]"""
    offset: bool
    """Whether the models have an offset."""
    structures: tuple[StructureScore, ...]
    """What was tried: one per set of time constants."""
    curve: tuple[ChannelScore, ...]
    """Error against the number of channels, from one channel to all."""
    parts: tuple[RecordPart, ...]
    """Parts of the record that were held out."""
    findings: tuple[SensorFinding, ...]
    """Candidates with a fault; those `left_out` are not in the models."""
    rule: str
    """How everything was chosen, in words."""
    warnings: tuple[str, ...] = ()
    """What the reader of the result must know, in words."""
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
            raise DataError(
                f"there are models of {len(self.outputs)} outputs", remedy="Ask for one by its name"
            )
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
        Models, what was chosen and why, baselines and faults of sensors.

    Raises
    ------
    DataError
        If names and inputs are not one each, outputs have other inputs, a displacement never
        changes, or no healthy candidate is left.

    Notes
    -----
    The record is cut into parts. Each is predicted in free run from temperatures alone, by models
    learned from all other parts, and each of the later half also from the parts before it. A ridge
    penalty is the squared uncertainty of the temperatures, plus for the direct gains the noise of
    each channel: the error to be expected where a temperature is wrong by so much. The fewest time
    constants are taken whose excess over the best is within one standard error of the difference.
    """
    settings = options or SelectionOptions()
    outputs = _by_name(experiments)
    first = next(iter(outputs.values()))
    names = tuple(candidate_names)
    _check_names(names, common_shape(first))
    _check_displacements(outputs)
    findings = check_candidates(first, names) if settings.check_sensors else ()
    wrong = {f.name for f in findings if f.left_out}
    columns = [i for i, name in enumerate(names) if name not in wrong]
    if not columns:
        raise DataError(
            "no healthy candidate is left",
            where=", ".join(sorted(wrong)),
            remedy="Repair the sensors, or name other candidates",
        )
    parts = record_parts(first, settings.parts)
    duration_s = max(e.duration_s for e in first)
    sets = settings.lag_sets_s or _lag_sets(settings.shortest_lag_s, duration_s)
    time_constants = np.unique(
        np.concatenate([[*taus] for taus in (*sets, FIXED_TIME_CONSTANTS_S)])
    )
    banks = banks_of(
        outputs, columns, time_constants, min(settings.mean_s, duration_s / 100.0), parts
    )
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
    return _result(search, tuple(outputs), parts, findings)


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
        raise DataError("there is no output", remedy="Name at least one displacement")
    return outputs


def _check_names(names: tuple[str, ...], inputs: int) -> None:
    if len(names) != inputs or len(set(names)) != len(names):
        raise DataError(
            f"there are {inputs} candidates and {len(set(names))} different names",
            remedy="Give every candidate one name of its own",
        )


def _check_displacements(outputs: Mapping[str, Sequence[Experiment]]) -> None:
    for name, experiments in outputs.items():
        y = np.concatenate([e.y for e in experiments]) if experiments else np.zeros(1)
        if not float(np.nanmax(y)) > float(np.nanmin(y)):
            raise DataError(
                "the displacement never changes",
                where=f"output {name}",
                remedy="Check the probe, or leave the output out",
            )


def _lag_sets(shortest_s: float, duration_s: float) -> tuple[tuple[float, ...], ...]:
    """Return none, one and two time constants in octaves, as far as the record supports them."""
    longest = duration_s / RECORD_PER_LAG
    count = int(np.floor(np.log2(longest / shortest_s))) + 1 if longest >= shortest_s else 0
    octaves = [shortest_s * 2.0**i for i in range(count)]
    pairs = [(tau, LAG_RATIO * tau) for tau in octaves if LAG_RATIO * tau in octaves]
    return ((), *((tau,) for tau in octaves), *pairs)


def _mean_over(values: FloatArray, axis: int) -> FloatArray:
    """Return means that leave out NaN; NaN where nothing is left."""
    present = ~np.isnan(values)
    total = np.sum(np.where(present, values, 0.0), axis=axis)
    count = np.count_nonzero(present, axis=axis)
    return np.where(count > 0, total / np.maximum(count, 1), np.nan)


def _scored(
    search: _Search, sets: Sequence[tuple[float, ...]], best_um: FloatArray | None = None
) -> tuple[list[_Scored], FloatArray]:
    """Judge sets of time constants with and without an offset, at every uncertainty."""
    every = tuple(range(len(search.channels)))
    tried: list[tuple[Structure, int, FloatArray]] = []
    for taus in sets:
        for offset in (False, True):
            structure = Structure(search.lags(taus), every, offset)
            errors = search.validation.errors(structure)
            tried += [(structure, i, errors[i]) for i in range(errors.shape[0])]
    reference_um = best_um
    if reference_um is None:
        least = np.min(np.stack([_mean_over(e, 0) for _, _, e in tried]), axis=0)
        reference_um = np.maximum(least, np.finfo(np.float64).tiny)
    return [
        _Scored(structure, i, _mean_over(e / reference_um, 1), e) for structure, i, e in tried
    ], reference_um


def _excess(own: FloatArray, best: FloatArray) -> tuple[float, float]:
    """Return mean and standard error of the difference over the splits."""
    difference = own - best
    difference = difference[~np.isnan(difference)]
    if difference.size < 2:
        return float(np.sum(difference)), 0.0
    error = float(np.std(difference, ddof=1)) / difference.size**0.5
    return float(np.mean(difference)), error


def _fewest_lags(scored: Sequence[_Scored]) -> _Scored:
    """Return the best of the structures with the fewest lags that one standard error allows."""
    best = min(scored, key=lambda s: s.score)
    for count in sorted({len(s.structure.lags) for s in scored}):
        own = min((s for s in scored if len(s.structure.lags) == count), key=lambda s: s.score)
        excess, error = _excess(own.relative, best.relative)
        if excess <= error:
            return own
    return best


def _without(
    search: _Search, chosen: _Scored, channels: tuple[int, ...], best_um: FloatArray
) -> FloatArray:
    structure = Structure(chosen.structure.lags, channels, chosen.structure.offset)
    errors = search.validation.errors(structure, chosen.position)[0]
    return _mean_over(errors / best_um, 1)


def _elimination(
    search: _Search, chosen: _Scored, best_um: FloatArray
) -> list[tuple[tuple[int, ...], FloatArray]]:
    """Leave out the least useful channel again and again; return channels and scores, fewest first.

    The channels of each entry stand in the order of their use, since each entry is the one before
    and the channel that would be left out next.
    """
    left: tuple[int, ...] = tuple(range(len(search.channels)))
    steps = [(left, chosen.relative)]
    while len(left) > 1:
        trials = [tuple(c for c in left if c != out) for out in left]
        scores = [_without(search, chosen, trial, best_um) for trial in trials]
        next_one = int(np.argmin([np.nanmean(s) for s in scores]))
        left = trials[next_one]
        steps.append((left, scores[next_one]))
    ordered: list[tuple[tuple[int, ...], FloatArray]] = []
    known: tuple[int, ...] = ()
    for channels, score in reversed(steps):
        known = (*known, *(c for c in channels if c not in known))
        ordered.append((known, score))
    return ordered


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


def _models(search: _Search, structure: Structure, gains: FloatArray) -> list[ThermalModel]:
    count = len(structure.channels)
    taus = search.time_constants_s[list(structure.lags)]
    models: list[ThermalModel] = []
    for own in gains.T:
        by_lag = own[: count * (1 + taus.size)].reshape(1 + taus.size, count)
        models.append(
            ThermalModel(
                parts=tuple(
                    ModalPart(
                        input_name=search.channels[channel],
                        direct_gain=float(by_lag[0, i]),
                        gains=by_lag[1:, i],
                        time_constants_s=taus,
                    )
                    for i, channel in enumerate(structure.channels)
                ),
                offset_um=float(own[-1]) if structure.offset else 0.0,
            )
        )
    return models


def _opposed(model: ThermalModel, correlation: FloatArray) -> list[str]:
    """Name channels that move together and act against each other."""
    dc = np.array([part.dc_gain for part in model.parts])
    floor = _OPPOSED_SHARE * float(np.max(np.abs(dc)))
    found: list[str] = []
    for i in range(dc.size):
        for j in range(i + 1, dc.size):
            strong = min(abs(dc[i]), abs(dc[j])) > floor and dc[i] * dc[j] < 0
            if strong and correlation[i, j] > _OPPOSED_CORRELATION:
                found.append(
                    f"{model.parts[i].input_name} and {model.parts[j].input_name} move together"
                    f" (correlation {correlation[i, j]:.3f}) and act against each other"
                    f" ({dc[i]:+.2f} and {dc[j]:+.2f} µm/K): only their sum is known well"
                )
    return found


def _baselines(search: _Search, best_um: FloatArray) -> dict[str, FloatArray]:
    """Return the errors of the baselines on the splits, (o,) each."""
    found = {"hold": _mean_over(search.validation.hold_errors(), 0)}
    for name, taus in (("static", ()), ("averages", FIXED_TIME_CONSTANTS_S)):
        scored, _ = _scored(search, [taus], best_um)
        found[name] = _mean_over(min(scored, key=lambda s: s.score).errors, 0)
    return found


def _structures(search: _Search, scored: Sequence[_Scored]) -> tuple[StructureScore, ...]:
    best = min(scored, key=lambda s: s.score)
    found: list[StructureScore] = []
    for taus in search.lag_sets_s:
        lags = search.lags(taus)
        own = min((s for s in scored if s.structure.lags == lags), key=lambda s: s.score)
        excess, error = _excess(own.relative, best.relative)
        uncertainty = search.settings.sensor_uncertainties_k[own.position]
        found.append(
            StructureScore(taus, uncertainty, own.structure.offset, own.score, excess, error)
        )
    return tuple(found)


def _rule(search: _Search, parts: Sequence[RecordPart], kept: int) -> str:
    settings = search.settings
    uncertainties = ", ".join(f"{u:g}" for u in settings.sensor_uncertainties_k)
    lags = ", ".join("none" if not s else "+".join(f"{t:g}" for t in s) for s in search.lag_sets_s)
    healthy = len(search.channels)
    if kept == healthy:
        channels = f"all {healthy} healthy candidates are kept"
    else:
        channels = (
            f"{kept} of {healthy} healthy candidates are kept, the least useful left out one by one"
        )
    return (
        f"The record is cut into {len(parts)} parts of {parts[0].duration_s / 3600:.1f} h. Each is"
        " predicted in free run from the temperatures by models learned from all other parts, each"
        " of the later half also from the parts before it. Tried are the time constants"
        f" {lags} s, common to all channels, uncertainties of the temperatures of {uncertainties} K"
        " as ridge penalty (and the noise of each sensor on its direct gain), with and without an"
        " offset; the smallest mean absolute error over all outputs decides, each over its best,"
        " and the fewest time constants within one standard error of the difference are taken;"
        f" {channels}."
    )


def _warnings(
    search: _Search,
    chosen: _Scored,
    parts: Sequence[RecordPart],
    findings: Sequence[SensorFinding],
) -> tuple[str, ...]:
    found = [
        f"{f.name} {f.reason}" + (": left out" if f.left_out else ": its direct gain is held back")
        for f in findings
    ]
    taus = [search.time_constants_s[i] for i in chosen.structure.lags]
    longest = max((t for s in search.lag_sets_s for t in s), default=0.0)
    if taus and max(taus) == longest:
        found.append(
            f"the largest time constant tried, {longest:g} s, was chosen: the record may be too"
            " short for the slowest one of the machine"
        )
    shortest_s = min(part.duration_s for part in parts)
    if shortest_s < SHORTEST_PART_S:
        found.append(
            f"the parts held out are {shortest_s / 60:.0f} min long: what is slower was not judged"
        )
    if chosen.position == len(search.settings.sensor_uncertainties_k) - 1:
        found.append(
            "the gains were held as small as was allowed: the temperatures hardly explain the"
            " displacement"
        )
    return tuple(found)


def _output_flags(
    model: ThermalModel, correlation: FloatArray, own_um: float, baselines: Mapping[str, float]
) -> tuple[str, ...]:
    flags = _opposed(model, correlation)
    for name, words in (("hold", "repeating the last displacement"), ("static", "a static model")):
        if baselines[name] < own_um:
            flags.append(
                f"{words} is better on the parts held out ({baselines[name]:.2f} against"
                f" {own_um:.2f} µm)"
            )
    return tuple(flags)


def _result(
    search: _Search,
    output_names: Sequence[str],
    parts: tuple[RecordPart, ...],
    findings: tuple[SensorFinding, ...],
) -> SelectionResult:
    """Search, and put the result together."""
    scored, best_um = _scored(search, search.lag_sets_s)
    chosen = _fewest_lags(scored)
    steps = _elimination(search, chosen, best_um)
    curve = _curve(search, steps)
    kept = _kept(curve, search.settings)
    structure = Structure(chosen.structure.lags, steps[kept - 1][0], chosen.structure.offset)
    validation = search.validation
    errors = _mean_over(validation.errors(structure, chosen.position)[0], 0)
    gains = validation.fit(structure, chosen.position)
    training = validation.training_errors(structure, gains)
    correlation = validation.correlation(structure.channels)
    baselines = _baselines(search, best_um)
    found: dict[str, SelectedOutput] = {}
    for i, (name, model) in enumerate(
        zip(validation.output_names, _models(search, structure, gains), strict=True)
    ):
        own = {key: float(values[i]) for key, values in baselines.items()}
        found[name] = SelectedOutput(
            model=model,
            validation_mae_um=float(errors[i]),
            training_mae_um=float(training[i]),
            baseline_mae_um=MappingProxyType(own),
            flags=_output_flags(model, correlation, float(errors[i]), own),
        )
    return SelectionResult(
        outputs=MappingProxyType({name: found[name] for name in output_names}),
        channels=curve[kept - 1].channels,
        time_constants_s=tuple(search.time_constants_s[list(structure.lags)].tolist()),
        sensor_uncertainty_k=search.settings.sensor_uncertainties_k[chosen.position],
        offset=structure.offset,
        structures=_structures(search, scored),
        curve=curve,
        parts=parts,
        findings=findings,
        rule=_rule(search, parts, kept),
        warnings=_warnings(search, chosen, parts, findings),
    )
