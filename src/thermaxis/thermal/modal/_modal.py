"""Estimate gains and time constants of a thermal error: the default estimator `modal`.

    displacement = sum over inputs of (direct gain + sum of gain / (1 + time constant s)) input
                   + offset + transients from an unknown start + slow drift + white noise

1. Inputs are filtered by the lags of a grid of time constants at the log's own rate and averaged
   over blocks of about two minutes, and so is the displacement: exact, as averaging is linear.
2. The sizes of gains, transients and slow drift are those of the highest evidence.
3. All sets of up to four time constants of the grid are compared from one matrix of products, the
   best of every number refined between the points of the grid (variable projection).
4. The number of lags is chosen by the free run over blocks that the fit has not seen; the gains
   are those that carry the average response of all sets, each weighted by its evidence, on more
   lags where those cannot hold it.
"""

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import final

import numpy as np
from numpy.typing import NDArray

from thermaxis.codes import Message
from thermaxis.errors import ConfigurationError, DataError, require_range
from thermaxis.thermal._arrays import FloatArray, significant
from thermaxis.thermal.log import Experiment, common_shape
from thermaxis.thermal.modal._average import (
    LARGER_GAINS,
    Average,
    Compared,
    Component,
    averaged,
    best_of,
    compare_grids,
    compare_sets,
    compare_sparse,
    log_prior_of,
    refined_components,
    tempered_variance,
)
from thermaxis.thermal.modal._delays import LONGEST_DELAY_S, likely_delays
from thermaxis.thermal.modal._evidence import (
    AT_REST,
    MOST_LOG_GAIN,
    Design,
    Hyperprior,
    Scales,
    Sizes,
    design_of,
    factored,
    log_evidence_of,
    log_prior_variance,
    most_likely_sizes,
    scales_of,
)
from thermaxis.thermal.modal._lags import Refined, Refinement, compared
from thermaxis.thermal.modal._posterior import ResponsePosterior
from thermaxis.thermal.modal._regressors import BoolArray, Segment, segments_of
from thermaxis.thermal.modal._slow_noise import SlowNoise
from thermaxis.thermal.modal._validation import BlockedValidation, validated
from thermaxis.thermal.transfer_function import LEAST_LOG_RATIO, ModalPart, ThermalModel

GRID = 16
"""Time constants of the grid. [1]"""
LONGEST_SHARE = 0.8
"""Longest time constant over the length of the longest experiment. [1]"""
SUPPORTED_SHARE = 1.0 / 3.0
"""Share of the longest experiment beyond which a time constant is not supported. [1]"""
BLOCK_S = 180.0
"""Length of the blocks that are averaged, for tests of some hours. [s]"""
FEWEST_BLOCKS, MOST_BLOCKS = 100, 1500
"""Blocks that the longest experiment is cut into, at least and at most. [1]"""
FEW_BLOCKS = MOST_BLOCKS // 3
SHORT_LAG = 0.6
"""Shortest time constant over the length of the blocks below which records of fewer blocks than
these are cut into shorter ones. Default: what a steam generator asked for. [1]"""
CARRYING_COST, LOST_FIT_PERCENT = 1.3, 0.1
"""What gains that carry the average may leave of a record over what the fit of the same lags leaves
[1], and points of fit that do not count beside it: where more is left more lags are taken. [%]"""
AVERAGE_WEIGHT = 30.0
"""By how much the average weighs more than its variance says: of 0.3, 1, 3, 10 and 30 the best on
tests of 8 h; on those of 72 h all are alike. [1]"""
DRIFT_CORRELATION_S = 5400.0
"""Most plausible correlation time of a slow drift: what machines in halls show. [s]"""
FASTEST_DRIFT_UM_PER_H = 3.0
"""Fastest drift of a probe [M]: what rises faster is heat. [µm/h]"""
DRIFT_FROM_S = 86400.0
"""Length of a record from which a probe that drifts is told from slow heat: at 8 h it never was.
[s]"""
LEAST_DRIFT = 0.1
"""Drift of a probe that is told, over the spread of the displacement. [1]"""
LARGEST_LOG_STD = 0.4
"""Standard deviation of a time constant's logarithm beyond which it is not supported. [1]"""
AGAINST = 10.0
"""Logarithm of how much less likely given lags make a record that speaks against them. [1]"""
FEWEST_READINGS = 2
"""Fewer for each number of the model tell no noise. [1]"""
_ROUNDS = 3
MOST_GIVEN, LONGEST_S = 6, 1e7
"""Time constants that are given for one input, at most [1], and the longest. [s]"""
LARGEST_DC_SHARE = 1.0 / 3.0
"""Standard deviation of a DC gain over its size beyond which it is not supported. [1]"""


@final
@dataclass(frozen=True, slots=True)
class ModalOptions:
    """What a user may ask of `modal`.

    Raises
    ------
    ConfigurationError
        If a number of lags, a time or a delay cannot be.
    """

    most_lags: int = 4
    """Largest number of lags that is tried, up to 5. Default: more were never told apart. [1]"""
    time_constants_s: tuple[tuple[float, ...], ...] | None = None
    """Time constants of every input; None for those that the record shows. [s]"""
    delays_s: tuple[float | None, ...] | None = None
    """Delay of every input, None for the most likely one; None for none at all. [s]"""
    steady_start: bool = False
    """Whether every experiment starts in the steady state of its first row; else it is free."""
    block_s: float | None = None
    """Length of the blocks that are averaged; None chooses by the record's length. [s]"""
    intervals: bool = True
    """Whether DC gains get a standard deviation, which takes nearly half of the time."""

    def __post_init__(self) -> None:
        """Check that the options can be met."""
        require_range("most_lags", self.most_lags, 1, 5)
        times = [
            *(delay_s or 0.0 for delay_s in self.delays_s or ()),
            self.block_s if self.block_s is not None else 1.0,
        ]
        if not all(math.isfinite(t) and t >= 0 for t in times) or self.block_s == 0:
            raise ConfigurationError("not_a_time", key="delays_s, block_s")
        for given in self.time_constants_s or ():
            ordered = sorted(given)
            if not 0 < len(given) <= MOST_GIVEN or not 0 < ordered[0] <= ordered[-1] <= LONGEST_S:
                raise _not_possible(ordered, 0.0, LONGEST_S)
            ratio = math.exp(LEAST_LOG_RATIO)
            for one_s, next_s in pairwise(ordered):
                if next_s < one_s * ratio:
                    raise ConfigurationError(
                        "lags_too_close", first_s=one_s, second_s=next_s, ratio=ratio, key="lags"
                    )


def _not_possible(
    given_s: Sequence[float], shortest_s: float, longest_s: float
) -> ConfigurationError:
    return ConfigurationError(
        "lags_not_possible",
        given_s=", ".join(f"{tau_s:g}" for tau_s in given_s),
        most=MOST_GIVEN,
        shortest_s=shortest_s,
        longest_s=longest_s,
        key="lags",
    )


@final
@dataclass(frozen=True, slots=True)
class LagTrial:
    """One set of time constants that was tried, common to the inputs or given for each."""

    time_constants_s: tuple[float, ...]
    """The time constants, rising. [s]"""
    log_evidence: float
    """Logarithm of the record's density: sizes and gains integrated out, and the time constants
    unless they are given. Only differences mean anything. [1]"""
    held_out_um: float | None
    """Root mean square of the free-run error over blocks that the fit has not seen, their start
    and zero fitted; None where the record is too short for two blocks. [µm]"""
    given: bool
    """Whether the time constants were given."""
    chosen: bool
    """Whether the model has them."""


@final
@dataclass(frozen=True, slots=True)
class PartStd:
    """Standard deviations of one part's numbers; None where the record does not support one."""

    direct_gain: float | None
    """Of the direct gain. [µm/K]"""
    gains: tuple[float | None, ...]
    """Of the gains of the lags. [µm/K]"""
    time_constants_s: tuple[float | None, ...]
    """Of the time constants; None also where they were given. [s]"""
    dc_gain: float | None
    """Of the DC gain. [µm/K]"""
    flags: tuple[Message, ...]
    """What the record does not support."""
    delay_interval_s: tuple[float, float] | None = None
    """95 % interval of a delay that was estimated. [s]"""


@final
@dataclass(frozen=True, slots=True, eq=False)
class ModalResult:
    """A model with what the record says of its numbers."""

    model: ThermalModel
    """The model, without an offset: at the reference of its inputs it says zero."""
    std: tuple[PartStd, ...]
    """Standard deviations, one per part."""
    noise_std_um: float | None
    """White noise of one reading of the displacement, standard deviation; None, as the next, where
    fewer than two readings for each number of the model cannot tell. [µm]"""
    slow_noise_std_um: float | None
    """Slow drift that no input explains, standard deviation; None too where touches lie too far
    apart to tell it from the noise, which then has it. [µm]"""
    slow_noise_correlation_s: float
    """Time in which the drift's correlation falls to 1/e. [s]"""
    fit_percent: float
    """Fit of the free run to the record, with its offsets and starts. [%]"""
    offsets_um: tuple[float, ...]
    """Offset of every experiment: where its displacement's zero lies, noise and drift of its
    begin included; no property of the machine, so the model does not hold it. [µm]"""
    validation: BlockedValidation
    """How the number of lags was chosen."""
    trials: tuple[LagTrial, ...]
    """The best set of every number of lags, and the given one behind them."""
    posterior: ResponsePosterior | None
    """How sure its responses are; None where intervals were not asked for."""
    evidence: "ResponseEvidence"
    """What the record says before lags are chosen."""
    warnings: tuple[Message, ...]
    """What a user must know."""
    stable: bool = True
    """Always: time constants are real and positive."""

    @property
    def flags(self) -> tuple[tuple[Message, ...], ...]:
        """What the record does not support, per part."""
        return tuple(s.flags for s in self.std)


@final
@dataclass(frozen=True, slots=True, eq=False)
class ResponseEvidence:
    """Steps one and two: gains over the grid, which need no choice of lags."""

    segments: tuple[Segment, ...]
    scales: Scales
    """Spreads of inputs and displacement."""
    time_constants_s: FloatArray
    """The grid, (j,). [s]"""
    design: Design
    sizes: Sizes
    """Sizes of the highest evidence."""
    wide_sizes: Sizes | None
    """The same with all that a drift may be, for intervals; None where there are to be none."""
    longest_s: float
    """Length of the longest experiment. [s]"""

    def gains(self) -> tuple[FloatArray, FloatArray, float]:
        """Return mean and factor of the covariance of the gains, and the white noise. [µm/K, µm]

        Input after input, (k (1 + j),) and square, with all that a drift may be.

        Notes
        -----
        With the gains' precision A (`log_evidence_of`; transients and offsets integrated out) and
        the variance v of the white noise the covariance is v A^-1.
        """
        design, sizes, own = self.design, self.wide_sizes or self.sizes, self.design.gains
        gram, _ = design.products(sizes.noise)
        prior = np.exp(-log_prior_variance(design, sizes, design.lags))
        precision = gram[:-1, :-1] + np.diag(prior)
        mean = np.asarray(np.linalg.solve(precision, gram[:-1, -1]), dtype=np.float64)
        left = max(float(gram[-1, -1] - gram[:-1, -1] @ mean), 0.0)
        unit_um = self.scales.y * math.sqrt(left / design.readings)
        cross = precision[own:, :own]
        alone = precision[:own, :own] - cross.T @ np.linalg.solve(precision[own:, own:], cross)
        scale = 1.0 / np.repeat(self.scales.u, 1 + design.lags)
        factor = unit_um * scale[:, None] * np.linalg.inv(factored(alone)).T
        return self.scales.y * scale * mean[:own], factor, unit_um

    def log_evidence(
        self, experiments: Sequence[Experiment] = (), delays_s: Sequence[float] = ()
    ) -> float:
        """Return the logarithm of the density, per block, of the record or of others alike. [1]"""
        design = self.design
        if experiments:
            rows = self.segments[0].rows * self.segments[0].sample_time_s
            segments = segments_of(experiments, rows, delays_s or (0.0,) * design.inputs)
            design = design_of(
                segments,
                self.time_constants_s,
                self.scales,
                free_start=design.transients > 0,
                experiments=len(experiments),
            )
        products = design.products(self.sizes.noise)
        return log_evidence_of(design, products, self.sizes) / design.readings

    def with_ramps(self, experiment: Experiment, added: FloatArray) -> FloatArray:
        """Return the same of a record to which a steady rise was added, by row of `added`, (m,).

        Its columns are the rise over the record of each input, and of the displacement, (m, k + 1).
        All columns are linear in it, so that their products are taken once.
        """
        design, (count, inputs) = self.design, (1 + self.design.lags, self.design.inputs)
        ramp = np.linspace(0.0, 1.0, experiment.y.size)[:, None]
        risen = replace(experiment, u=np.hstack([experiment.u, ramp]), ambient_k=None)
        rows = self.segments[0].rows * self.segments[0].sample_time_s
        wide = design_of(
            segments_of([risen], rows, (0.0,) * (inputs + 1)),
            self.time_constants_s,
            replace(self.scales, u=np.append(self.scales.u, 1.0)),
            free_start=design.transients > 0,
            experiments=1,
        )
        gram, log_determinant = wide.products(self.sizes.noise)
        own = np.delete(np.eye(len(gram)), np.s_[inputs * count : (inputs + 1) * count], axis=1)
        found: list[float] = []
        for row in added / np.append(self.scales.u, self.scales.y):
            columns = own.copy()
            block = columns[inputs * count : (inputs + 1) * count]
            block[:, : inputs * count] = np.kron(row[:-1], np.eye(count))
            block[0, -1] = row[-1]
            products = columns.T @ gram @ columns, log_determinant
            found.append(log_evidence_of(design, products, self.sizes) / design.readings)
        return np.array(found)

    def gated(
        self, experiment: Experiment, stretch: NDArray[np.intp]
    ) -> Callable[[BoolArray], float]:
        """Return the same of each input cut in two, by which stretches belong to the first, (s,).

        `stretch` has the number of each row, rising. All columns are sums of those of single
        stretches, so that their products are taken once.
        """
        inputs, rows = experiment.inputs, self.segments[0].rows * self.segments[0].sample_time_s
        count, wide = int(stretch[-1]) + 1, inputs * (1 + self.design.lags)
        parts = [experiment.u * (stretch == k)[:, None] for k in range(count)]
        cut = replace(experiment, u=np.hstack(parts), ambient_k=None)
        design = design_of(
            segments_of([cut], rows, (0.0,) * (count * inputs)),
            self.time_constants_s,
            replace(self.scales, u=np.ones(count * inputs)),
            free_start=self.design.transients > 0,
            experiments=1,
        )
        gram, log_determinant = design.products(self.sizes.noise)
        own, cross = gram[: count * wide, : count * wide], gram[: count * wide, count * wide :]
        own, cross = own.reshape(count, wide, count, wide), cross.reshape(count, wide, -1)
        scale = np.repeat(self.scales.u, 1 + self.design.lags)[:, None]

        def log_evidence(first: BoolArray) -> float:
            half = np.stack([first, ~first]).astype(np.float64)
            both = np.tensordot(half, np.tensordot(own, half, ((2,), (1,))), ((1,), (0,)))
            gains = both.transpose(0, 1, 3, 2).reshape(2 * wide, 2 * wide) / scale / scale.T
            others = np.tensordot(half, cross, ((1,), (0,))).reshape(2 * wide, -1) / scale
            rest = gram[count * wide :, count * wide :]
            products = np.block([[gains, others], [others.T, rest]]), log_determinant
            return log_evidence_of(self.design, products, self.sizes) / self.design.readings

        return log_evidence


def default_block_s(experiments: Sequence[Experiment]) -> float:
    """Return the length of blocks that suits the longest experiment. [s]"""
    longest = max(e.duration_s for e in experiments)
    return float(np.clip(BLOCK_S, longest / MOST_BLOCKS, longest / FEWEST_BLOCKS))


def response_evidence(
    experiments: Sequence[Experiment],
    options: ModalOptions | None = None,
    *,
    lasting_drift: bool = True,
) -> ResponseEvidence:
    """Return gains over a grid of time constants with the evidence of the record.

    Without a lasting drift in the noise what lasts is left for the inputs to explain, so that a
    record shows that they do not.
    """
    chosen = options or ModalOptions()
    no_delay = (0.0,) * common_shape(experiments)
    delays = tuple(delay_s or 0.0 for delay_s in chosen.delays_s or no_delay)
    block_s = chosen.block_s or default_block_s(experiments)
    segments = segments_of(experiments, block_s, delays)
    longest = max(e.duration_s for e in experiments)
    block_s = max(s.rows * s.sample_time_s for s in segments)
    longest_tau = LONGEST_SHARE * longest
    shortest_tau = min(0.8 * block_s, longest_tau / 4.0)
    grid = np.geomspace(shortest_tau, longest_tau, GRID)
    scales = scales_of(segments)
    if np.ptp(np.concatenate([s.y[s.count > 0] for s in segments])) == 0.0:
        raise DataError("displacement_constant")
    design = design_of(
        segments,
        grid,
        scales,
        free_start=not chosen.steady_start,
        experiments=len(experiments),
    )
    if not lasting_drift:
        design = replace(design, basis=())
    if design.readings < 3 + design.offsets:
        raise DataError("too_few_blocks", blocks=design.readings, needed=3 + design.offsets)
    correlation_s = min(DRIFT_CORRELATION_S, longest / 5.0)
    hours = longest / 3600.0 if longest >= DRIFT_FROM_S else 0.0
    largest_line = FASTEST_DRIFT_UM_PER_H * hours / scales.y
    hyperprior = Hyperprior(correlation_s, math.sqrt(correlation_s * block_s), largest_line)
    may_rest = [segment.start_s == 0.0 for segment in segments] if design.transients else []
    sizes = most_likely_sizes(design, hyperprior, may_rest, wide=chosen.intervals)
    return ResponseEvidence(segments, scales, grid, design, *sizes, float(longest))


def modal(
    experiments: Sequence[Experiment],
    *,
    input_names: Sequence[str],
    options: ModalOptions | None = None,
) -> ModalResult:
    """Estimate direct gains, lags and their intervals from one or several experiments.

    Parameters
    ----------
    experiments : sequence of Experiment
        With the same inputs; sample times may differ.
    input_names : sequence of str
        Names of the inputs, in their order.
    options : ModalOptions, optional
        Defaults suit thermal tests of hours to days.

    Returns
    -------
    ModalResult
        Always stable. Numbers that the record does not support have no standard deviation and a
        flag.

    Raises
    ------
    DataError
        If names, inputs and experiments do not belong together, or too little was measured.
    ConfigurationError
        If the options do not fit the inputs.

    References
    ----------
    Golub and Pereyra 1973 (variable projection); Rasmussen and Williams 2006, section 5.4
    (evidence); Hoeting et al. 1999 (averaging over models); Mareš and Horejš 2021, equations (1)
    to (3).
    """
    chosen = options or ModalOptions()
    counted = {
        "input_names": input_names,
        "time_constants_s": chosen.time_constants_s,
        "delays_s": chosen.delays_s,
    }
    for key, entries in counted.items():
        inputs = common_shape(experiments)
        if entries is not None and len(entries) != inputs:
            raise DataError("count_not_inputs", count=len(entries), inputs=inputs, key=key)
    step_s, longest_s = (
        max(e.sample_time_s for e in experiments),
        max(e.duration_s for e in experiments),
    )
    for given in chosen.time_constants_s or ():
        if not step_s <= min(given) <= max(given) <= longest_s:
            raise _not_possible(sorted(given), step_s, longest_s)
    if chosen.delays_s is None:
        return _estimated(experiments, input_names, chosen)
    delays_s, ends_s = _delays(experiments, chosen.delays_s, chosen)
    result = _estimated(experiments, input_names, replace(chosen, delays_s=delays_s))
    std = list(result.std)
    for k, ends in enumerate(ends_s):
        if ends is not None:
            low_s, likeliest_s, high_s = ends
            code = "flag-gains_given_delay" if delays_s[k] else "flag-delay_not_shown"
            values = {"highest_s": high_s, "likeliest_s": likeliest_s, "used_s": delays_s[k]}
            flags = [*std[k].flags, Message(code, {"input": input_names[k], **values})]
            if high_s >= _longest_delay_s(experiments):
                flags.append(Message("flag-delay_may_be_longer", {"highest_s": high_s}))
            std[k] = replace(std[k], delay_interval_s=(low_s, high_s), flags=tuple(flags))
    rounded = [
        Message("warning-delay_rounded", {"input": name, "given_s": given_s, "used_s": used_s})
        for name, given_s, used_s in zip(input_names, chosen.delays_s, delays_s, strict=True)
        if given_s is not None and abs(given_s - used_s) > 1e-6 * (1.0 + used_s)
    ]
    return replace(result, std=tuple(std), warnings=(*result.warnings, *rounded))


def _longest_delay_s(experiments: Sequence[Experiment]) -> float:
    step_s, longest_s = experiments[0].sample_time_s, max(e.duration_s for e in experiments)
    return step_s * int(min(LONGEST_DELAY_S, longest_s / 4.0) / step_s)


def _delays(
    experiments: Sequence[Experiment], wanted: Sequence[float | None], options: ModalOptions
) -> tuple[tuple[float, ...], list[tuple[float, float, float] | None]]:
    """Return all delays in whole rows; of those not given ends of 95 %, likeliest between. [s]"""
    longest_s, step_s = (max(e.duration_s for e in experiments), experiments[0].sample_time_s)
    longest_given_s = max(delay_s or 0.0 for delay_s in wanted)
    if longest_given_s > longest_s / 2.0:
        raise ConfigurationError(
            "delay_beyond_record", delay_s=longest_given_s, longest_s=longest_s, key="delay"
        )
    late = [round((delay_s or 0.0) / step_s) for delay_s in wanted]
    open_, ends = [delay_s is None for delay_s in wanted], [None] * len(late)
    brief, farthest = replace(options, intervals=False), _longest_delay_s(experiments) / step_s
    for _ in range(_ROUNDS if any(open_) else 0):
        delays_s = tuple(step_s * rows for rows in late)
        evidence = response_evidence(experiments, replace(brief, delays_s=delays_s))

        def log_evidence(rows: Sequence[int], its: ResponseEvidence = evidence) -> float:
            return its.design.readings * its.log_evidence(experiments, [step_s * r for r in rows])

        before, block = late, evidence.segments[0].rows
        late, ends = likely_delays(log_evidence, late, open_, round(farthest), block)
        if late == before:
            break
    in_seconds = [
        None if e is None else (step_s * e[0], step_s * e[1], step_s * e[2]) for e in ends
    ]
    return tuple(step_s * row for row in late), in_seconds


def _estimated(
    experiments: Sequence[Experiment], input_names: Sequence[str], chosen: ModalOptions
) -> ModalResult:
    evidence = response_evidence(experiments, chosen)
    found = _sets(evidence, evidence.sizes, chosen)
    candidates = _refined_sets(evidence, found, chosen)
    every = [candidates[n] for n in sorted(candidates)]
    if chosen.time_constants_s is not None:
        every.append(_given(evidence, evidence.sizes, chosen))
    validation = validated(every)
    if chosen.time_constants_s is not None:
        _, refined = _given(evidence, evidence.wide_sizes or evidence.sizes, chosen)
        wide = 1 + refined.time_constants_s.size
        parts = [slice(k * wide, (k + 1) * wide) for k in range(len(input_names))]
        dc_variance = np.array([np.sum(refined.covariance[part, part]) for part in parts])
        carried = (*every[-1], every[-1][1].gains)
        return _result(evidence, input_names, chosen, dc_variance, carried, every, validation)
    lags = validation.chosen
    block_s = max(s.rows * s.sample_time_s for s in evidence.segments)
    blocks = sum(s.blocks for s in evidence.segments)
    shortest_s = float(candidates[lags][1].time_constants_s[0])
    if chosen.block_s is None and shortest_s < SHORT_LAG * block_s and blocks < FEW_BLOCKS:
        shorter = replace(chosen, block_s=block_s / 3.0)
        return _estimated(experiments, input_names, shorter)
    average = averaged(_components(evidence, evidence.sizes, found, candidates.values()))
    carried = _carried([candidates[n] for n in sorted(candidates) if n >= lags], average)
    dc_variance, components = np.full(len(input_names), np.nan), list[Component]()
    if evidence.wide_sizes is not None:
        wide = _sets(evidence, evidence.wide_sizes, chosen)
        components = _components(evidence, evidence.wide_sizes, wide, candidates.values())
        dc_variance = tempered_variance(components, carried[2].sum(axis=1))
    return _result(
        evidence, input_names, chosen, dc_variance, carried, every, validation, components
    )


def _given(
    evidence: ResponseEvidence, sizes: Sizes, options: ModalOptions
) -> tuple[Refinement, Refined]:
    """Return the fit of time constants that are given, at the most likely size of gains."""
    given = options.time_constants_s or ()
    taus_s = np.array(sorted({tau_s for each in given for tau_s in each}))
    acting = np.array([[True, *(tau_s in each for tau_s in taus_s.tolist())] for each in given])
    tried = [_problem(evidence, sizes.enlarged(one), options, acting) for one in LARGER_GAINS]
    best = max(tried, key=lambda problem: _log_evidence(problem, taus_s))
    return best, best.refined(taus_s, steps=0)


def _log_evidence(problem: Refinement, taus_s: FloatArray) -> float:
    """Return the logarithm of the record's density with these time constants. [1]"""
    design = problem.design_at(taus_s)
    members = np.arange(taus_s.size, dtype=np.intp)[None, :]
    without = None if problem.acting is None else ~problem.acting.reshape(1, -1)
    products = design.products(problem.sizes.noise)
    return float(compared(design, products, problem.sizes, members, without).log_evidence[0])


def _trials(
    evidence: ResponseEvidence,
    tried: Sequence[tuple[Refinement, Refined]],
    chosen: Refined,
    validation: BlockedValidation,
) -> tuple[LagTrial, ...]:
    span = float(np.log(evidence.time_constants_s[-1] / evidence.time_constants_s[0]))
    found: list[LagTrial] = []
    for (problem, refined), rms in zip(tried, validation.rmse.tolist(), strict=True):
        given = problem.acting is not None
        log_evidence = _log_evidence(problem, refined.time_constants_s)
        found.append(
            LagTrial(
                time_constants_s=tuple(refined.time_constants_s.tolist()),
                log_evidence=log_evidence + (0.0 if given else log_prior_of(refined, span)),
                held_out_um=evidence.scales.y * rms if math.isfinite(rms) else None,
                given=given,
                chosen=refined is chosen,
            )
        )
    return tuple(found)


def _sets(evidence: ResponseEvidence, sizes: Sizes, options: ModalOptions) -> list[Compared]:
    """Return all sets of lags of the grid under given sizes."""
    products = evidence.design.products(sizes.noise)
    grid_s = evidence.time_constants_s
    return compare_sets(evidence.design, products, sizes, grid_s, options.most_lags)


def _components(
    evidence: ResponseEvidence,
    sizes: Sizes,
    found: Sequence[Compared],
    candidates: Iterable[tuple[Refinement, Refined]],
) -> list[Component]:
    """Return what is averaged over under given sizes: sets, sparse ones, grids, refined lags."""
    design, grid_s = evidence.design, evidence.time_constants_s
    products = design.products(sizes.noise)
    every = [
        *found,
        *compare_sparse(design, products, sizes, found),
        *compare_grids(design, products, sizes, grid_s),
    ]
    nothing = np.zeros(design.inputs)
    components = [Component(design, item, nothing, grid_s) for item in every]
    span = float(np.log(grid_s[-1] / grid_s[0]))
    for problem, refined in candidates:
        components += refined_components(problem, refined, sizes, span)
    return components


def _problem(
    evidence: ResponseEvidence,
    sizes: Sizes,
    options: ModalOptions,
    acting: BoolArray | None = None,
) -> Refinement:
    grid_s = evidence.time_constants_s
    return Refinement(
        segments=evidence.segments,
        scales=evidence.scales,
        sizes=sizes,
        free_start=not options.steady_start,
        experiments=evidence.design.offsets,
        bounds_s=(float(grid_s[0]) / 4.0, float(grid_s[-1])),
        acting=acting,
    )


def _refined_sets(
    evidence: ResponseEvidence,
    found: Sequence[Compared],
    options: ModalOptions,
) -> dict[int, tuple[Refinement, Refined]]:
    """Return the best set of every number of lags, moved between the points of the grid."""
    refined: dict[int, tuple[Refinement, Refined]] = {}
    for number in sorted({c.lags for c in found}):
        members, sizes = best_of(found, number)
        problem = _problem(evidence, sizes, options)
        refined[number] = (problem, problem.refined(evidence.time_constants_s[members]))
    return refined


def _carried(
    candidates: Sequence[tuple[Refinement, Refined]], average: Average
) -> tuple[Refinement, Refined, FloatArray]:
    """Return the fewest lags that carry the average response, and their gains, (k, 1 + j).

    A single candidate that cannot carry it keeps the gains of its own fit.
    """
    found: list[tuple[float, Refinement, Refined, FloatArray]] = []
    for problem, refined in candidates:
        gains = _gains_carrying(problem, refined, average)
        left, own = (100.0 - _fit_percent(problem, refined, g) for g in (gains, refined.gains))
        found.append((left - own, problem, refined, gains))
        if left <= CARRYING_COST * (own + LOST_FIT_PERCENT):
            break
    else:
        if len(candidates) == 1:
            return (*candidates[0], candidates[0][1].gains)
    return min(found, key=lambda one: one[0])[1:]


def _gains_carrying(problem: Refinement, refined: Refined, average: Average) -> FloatArray:
    """Return gains of the refined lags that carry the average response, (k, 1 + j).

    Notes
    -----
    With the sum of squares S of `Refinement.solved`, the white variance v, the n rows F of an
    input, its average response a and DC gain d of variance s, they are the least of

        S / v + sum over inputs of w / s ((1 + j) |F g - a|^2 / n + (sum of g - d)^2):

    of all gains that explain the record alike those next to the average. A plain projection of the
    average can lose half of the record: one set of lags holds no other's response.
    """
    own = problem.design_at(refined.time_constants_s)
    gram, _ = own.products(problem.sizes.noise)
    precision = gram[:-1, :-1] + np.diag(problem.prior(own))
    right = gram[:-1, -1].copy()
    rows, wide = np.vstack([r[:, : own.gains] for r in own.rows]), 1 + own.lags
    for i, variance in enumerate(average.dc_variance.tolist()):
        part = slice(i * wide, (i + 1) * wide)
        weight = AVERAGE_WEIGHT * refined.variance / max(variance, refined.variance * 1e-6)
        columns, share = rows[:, part], wide / own.readings
        precision[part, part] += weight * (share * columns.T @ columns + 1.0)
        right[part] += weight * (
            share * columns.T @ average.contribution[:, i] + average.dc_gain[i]
        )
    gains = np.linalg.solve(precision, right)[: own.gains].reshape(own.inputs, wide)
    return np.asarray(gains, dtype=np.float64)


def _part_std(
    refined: Refined,
    number: int,
    unit: float,
    dc_variance: FloatArray,
    dc_gain: float,
    evidence: ResponseEvidence,
    acting: BoolArray | None,
) -> PartStd:
    longest_s = evidence.longest_s
    inputs, wide = refined.gains.shape
    every = np.ones(wide - 1, dtype=np.bool_)
    kept = np.flatnonzero(every if acting is None else acting[number, 1:])
    spread = np.sqrt(np.maximum(np.diag(refined.covariance), 0.0))
    gains = unit * spread[number * wide + np.append(0, 1 + kept)]
    taus_s, log_tau = refined.time_constants_s[kept], spread[inputs * wide + kept]
    supported = (log_tau < LARGEST_LOG_STD) & (taus_s <= SUPPORTED_SHARE * longest_s)
    flags = [
        Message("flag-time_constant", {"time_constant_s": tau_s})
        for tau_s, found in zip(taus_s.tolist(), supported, strict=True)
        if not found
    ]
    dc_std = unit * math.sqrt(float(dc_variance[number]))
    known = 0.0 < dc_std <= LARGEST_DC_SHARE * abs(dc_gain)  # 0: it never moved
    if not known and not math.isnan(dc_std):  # NaN: no intervals were asked for
        flags.append(Message("flag-dc_gain"))
    return PartStd(
        direct_gain=float(gains[0]),
        gains=tuple(
            float(g) if k else None for g, k in zip(gains[1:], supported.tolist(), strict=True)
        ),
        time_constants_s=tuple(
            float(t * s) if k and acting is None else None
            for t, s, k in zip(taus_s, log_tau, supported.tolist(), strict=True)
        ),
        dc_gain=dc_std if known else None,
        flags=tuple(flags),
    )


def _result(
    evidence: ResponseEvidence,
    input_names: Sequence[str],
    options: ModalOptions,
    dc_variance: FloatArray,
    carried: tuple[Refinement, Refined, FloatArray],
    tried: Sequence[tuple[Refinement, Refined]],
    validation: BlockedValidation,
    components: Sequence[Component] = (),
) -> ModalResult:
    problem, refined, gains = carried
    trials = _trials(evidence, tried, refined, validation)
    acting = np.ones(gains.shape, dtype=np.bool_) if problem.acting is None else problem.acting
    units = evidence.scales.y / evidence.scales.u
    scales, delays = evidence.scales, options.delays_s or (0.0,) * len(input_names)
    few = evidence.design.readings < FEWEST_READINGS * (gains.size + refined.time_constants_s.size)
    untold = few and evidence.sizes.log_gain >= MOST_LOG_GAIN
    parts: list[ModalPart] = []
    stds: list[PartStd] = []
    for i, name in enumerate(input_names):
        unit = float(units[i])
        part = ModalPart(
            input_name=name,
            direct_gain=float(unit * gains[i, 0]),
            gains=unit * gains[i, 1:][acting[i, 1:]],
            time_constants_s=refined.time_constants_s[acting[i, 1:]],
            delay_s=delays[i] or 0.0,
        )
        parts.append(part)
        stds.append(
            _part_std(
                refined,
                i,
                unit,
                dc_variance + math.inf if untold else dc_variance,
                part.dc_gain,
                evidence,
                problem.acting,
            )
        )
    others = _starts_and_offsets(problem, refined, gains)
    zeros = problem.design_at(refined.time_constants_s).zeros
    at_zero = zeros[:, -1] - zeros[:, :-1] @ np.concatenate([gains.ravel(), others])
    offsets = scales.y * (at_zero + others[others.size - refined.offsets.size :])
    drift = _probe_drift(problem, refined, np.concatenate([gains.ravel(), others]), scales.y)
    warnings = (*_warnings(evidence, stds), *drift)
    against = _lags_against(trials)
    if against or untold:  # intervals hold if the lags do, and where something is left
        none = (None,) * max(part.gains.size for part in parts)
        stds = [
            replace(s, direct_gain=None, gains=none[: len(s.gains)], dc_gain=None) for s in stds
        ]
        warnings = (*([against] if against else []), *warnings)
    model = ThermalModel(tuple(parts))
    noise_std, slow_std = _noise(evidence, problem.sizes.noise)
    block_std = scales.y * math.sqrt(refined.variance)
    dc_std = np.array([np.nan if s.dc_gain is None else s.dc_gain for s in stds])
    return ModalResult(
        model=model,
        std=tuple(stds),
        noise_std_um=None if few else block_std * noise_std,
        slow_noise_std_um=None if few or slow_std is None else block_std * slow_std,
        slow_noise_correlation_s=problem.sizes.noise.correlation_s,
        fit_percent=_fit_percent(problem, refined, gains),
        offsets_um=tuple(offsets.tolist()),
        validation=validation,
        posterior=ResponsePosterior(tuple(components), model, units, dc_std)
        if components
        else None,
        evidence=evidence,
        trials=trials,
        warnings=warnings,
    )


def _noise(evidence: ResponseEvidence, noise: SlowNoise) -> tuple[float, float | None]:
    """Return the noise of one reading and the slow drift, over that of a full block's mean. [1]

    Where readings are touches with empty blocks between, they do not tell what correlates for less
    than two of their intervals from noise: it is noise of a touch.
    """
    rows = float(np.median([s.rows for s in evidence.segments]))
    apart = [np.diff(np.flatnonzero(s.count)) * s.rows * s.sample_time_s for s in evidence.segments]
    apart_s = float(np.median(np.concatenate(apart))) if any(a.size for a in apart) else 0.0
    if apart_s <= max(s.rows * s.sample_time_s for s in evidence.segments):
        return math.sqrt(rows), math.sqrt(noise.ratio)
    alike = sum(ratio for ratio, tau_s in noise.parts if tau_s < 2.0 * apart_s)
    told = noise.correlation_s >= 2.0 * apart_s
    return math.sqrt(rows + alike), math.sqrt(noise.ratio) if told else None


def _lags_against(trials: Sequence[LagTrial]) -> Message | None:
    """Return a warning where the record speaks against lags that were given."""
    best = max(trials, key=lambda trial: trial.log_evidence)
    less = best.log_evidence - trials[-1].log_evidence
    if not trials[-1].given or less < AGAINST:
        return None
    own_s = ", ".join(f"{tau_s:.4g}" for tau_s in best.time_constants_s)
    values = {"less": significant(less, 2), "own_s": own_s}
    return Message("warning-lags_against_record", values)


def _warnings(evidence: ResponseEvidence, stds: Sequence[PartStd]) -> tuple[Message, ...]:
    """Return what a user must know of the record as a whole."""
    warnings: list[Message] = []
    started = {
        segment.experiment
        for segment, size in zip(
            evidence.segments, evidence.sizes.log_transients or (), strict=False
        )
        if size > AT_REST
    }
    count = 1 + max(s.experiment for s in evidence.segments)
    if len(started) == count:
        warnings.append(Message("warning-no_steady_start"))
    if any(flag.code == "flag-dc_gain" for s in stds for flag in s.flags):
        warnings.append(Message("warning-dc_gains_not_supported"))
    return tuple(warnings)


def _probe_drift(
    problem: Refinement, refined: Refined, coefficients: FloatArray, unit_um: float
) -> tuple[Message, ...]:
    """Return a warning where the evidence found a line: the largest, its most likely size.

    With the line b of ratio R and what the model leaves r it is b' K^-1 r / (b' K^-1 b + 1 / R).
    """
    own, noise = problem.design_at(refined.time_constants_s), problem.sizes.noise
    if noise.trend_ratio == 0.0 or not own.basis:
        return ()
    line, left = own.rows[0].shape[1], np.append(-coefficients, 1.0)
    grams = [one.gram[line] for one in own.joint(noise.stationary)]
    ends = [float(g[:line] @ left) / (float(g[line]) + 1.0 / noise.trend_ratio) for g in grams]
    drift_um = unit_um * max(ends, key=abs)
    if abs(drift_um) < LEAST_DRIFT * unit_um:
        return ()
    share, end_s = max((b[-1, 0], t[-1]) for b, t in zip(own.basis, own.times_s, strict=True))
    span_h = float(end_s / share) / 3600.0
    values = {"drift_um": significant(drift_um, 3), "um_per_h": significant(drift_um / span_h, 3)}
    return (Message("warning-probe_drift", {**values, "span_h": significant(span_h, 3)}),)


def _starts_and_offsets(problem: Refinement, refined: Refined, gains: FloatArray) -> FloatArray:
    """Return the transients and offsets that suit given gains, scaled, (s j + e,). [1]"""
    own = problem.design_at(refined.time_constants_s)
    gram, _ = own.products(problem.sizes.noise)
    kept, fixed = slice(own.gains, -1), slice(0, own.gains)
    prior = problem.prior(own)[own.gains :]
    right = gram[kept, -1] - gram[kept, fixed] @ gains.ravel()
    solved = np.linalg.solve(gram[kept, kept] + np.diag(prior), right)
    return np.asarray(solved, dtype=np.float64)


def _fit_percent(problem: Refinement, refined: Refined, gains: FloatArray) -> float:
    """Return the fit over the block means of all experiments, with their starts and offsets. [%]"""
    own = problem.design_at(refined.time_constants_s)
    others = _starts_and_offsets(problem, refined, gains)
    coefficients = np.concatenate([gains.ravel(), others])
    left, spread = 0.0, 0.0
    for rows in own.rows:
        y = rows[:, -1]
        left += float(np.sum((y - rows[:, :-1] @ coefficients) ** 2))
        spread += float(np.sum((y - np.mean(y)) ** 2))
    return 100.0 * (1.0 - math.sqrt(left / spread))
