"""Learn a model anew from a machine's touches, and judge it by newer ones beside the one in force.

Candidates are the model in force with gains and time constants of its parts scaled, by touches of
the last days or of more (a change is known by what came after it), and one that is identified anew
from all of them. None has seen the touches on which it is compared with the model in force: in free
run, and by its innovations as touches renew the offset. It must be better by a margin, as a model
in force is never quite right, but not where the machine has changed since.
"""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from math import log
from typing import final

import numpy as np
from numpy.typing import NDArray

from thermaxis.codes import Message
from thermaxis.compensation import CompensationModel, Output, Part, TouchFilter
from thermaxis.errors import ConfigurationError, DataError, require_range
from thermaxis.thermal._arrays import FloatArray
from thermaxis.thermal.identification import (
    NOT_FIT,
    SIMPLE,
    VERDICTS,
    Records,
    compensation_model,
    identify,
    records_of,
    simple_model,
    without_far_touches,
)
from thermaxis.thermal.log import InputDefinition, ThermalLog, check_log
from thermaxis.thermal.modal import ModalOptions, modal
from thermaxis.thermal.relearning._innovations import (
    CLIPPED,
    Comparison,
    compared,
    innovations_of,
)
from thermaxis.thermal.selection import select
from thermaxis.thermal.transfer_function import ThermalModel
from thermaxis.thermal.verification import likeliest_drift, simulate_log

DAY_S = 86_400.0
LEARNT_S = (DAY_S, 2.0 * DAY_S, 4.0 * DAY_S, float("inf"))
"""Touches of so long before the newest stretch, and of the other one, scale the model. [s]"""
BLOCK_S = 3600.0
"""Innovations further apart are independent. [s]"""
FEWEST_LEARNT, FEWEST_JUDGED, FEWEST_BLOCKS = 12, 12, 4
"""With fewer touches, in each stretch alike, or fewer blocks nothing is proposed. [1]"""
GAIN_STD, TIME_STD = 0.2, 0.3
"""Prior standard deviations of the logarithms by which gains and time constants changed. [1]"""
FOLDS = 2
"""What judges is cut into so many stretches; each judges models that have not seen it. [1]"""
ANEW = 1.7
"""The margin is so many times as large for a model identified anew: it differs in everything, and
from some days is better than another by chance for as many. [1]"""
CHANGED_S = tuple(days * DAY_S for days in (1.0, 2.0, 3.0, 4.0, 7.0))
"""The machine is asked whether it changed so long before the last touch. [s]"""
FREE_RUN = 1.25
"""The free run of what is proposed leaves no more than so many times what that in force leaves and
what drifts beside it: it is judged by few touches. [1]"""
MOST_INPUTS = 4
"""Among more inputs is chosen, as `identify --candidates` does. [1]"""
_BRIEF = ModalOptions(intervals=False)
_DATUM = "datum"
_STEPS, _DELTA, _LARGEST_STEP, _LEAST = 6, 0.02, 0.5, 1e-9


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class RelearnOptions:
    """How a model is learnt anew, and what makes it a proposal."""

    judged_s: float = 2.0 * DAY_S
    """The newest touches, of so long, judge. [s]"""
    margin: float = 0.15
    """Innovations of the new model are smaller by this share at least. [1]"""
    false_rate: float = 0.002
    """How often another model is proposed, at one look and by each of its two ways (a margin, or a
    change), while that in force is right. [1]"""
    filters: Mapping[str, TouchFilter] = field(default_factory=dict[str, TouchFilter])
    """How touches are believed, by output. Default: that of `TouchFilter`."""

    def __post_init__(self) -> None:
        require_range("judged_s", self.judged_s, 3600.0, 100.0 * DAY_S)
        require_range("margin", self.margin, 0.0, 0.3)
        require_range("false_rate", self.false_rate, 1e-6, 0.5)


@final
@dataclass(frozen=True, slots=True)
class Candidate:
    """Another model of one output, on touches that neither has seen."""

    output: Output
    """The model, of all touches but those of the last stretch that judges."""
    learnt_s: float | None
    """It is the model in force, scaled by touches of so long before the newest stretch, infinite
    for all of them; None where it was identified anew. [s]"""
    comparison: Comparison
    """By innovations, as touches renew the offset."""
    free_run_um: tuple[float, float]
    """Root mean square error of the free run of the model in force, and its own. [µm]"""
    better: bool
    """Whether it is the better one by the margin, with the confidence that was asked for."""


@final
@dataclass(frozen=True, slots=True)
class RelearnedOutput:
    """What became of one output."""

    name: str
    """Its name."""
    touches: tuple[int, int]
    """Touches that were learnt from, and that judge. [1]"""
    candidates: tuple[Candidate, ...]
    """What was compared."""
    taken: Candidate | None
    """What is proposed; None for the part of the model in force."""
    why: Message
    """Why."""


@final
@dataclass(frozen=True, slots=True)
class Proposal:
    """What a look at a machine's touches has come to."""

    model: CompensationModel | None
    """What is proposed, without provenance; None where the model in force stays."""
    outputs: tuple[RelearnedOutput, ...]
    """Every output that was touched."""


def relearn(
    log: ThermalLog, model: CompensationModel, options: RelearnOptions | None = None
) -> Proposal:
    """Propose a better model where touches show one.

    Parameters
    ----------
    log : ThermalLog
        Temperatures by rows of even times, such as minutes, and in columns named as the outputs of
        the model the displacement without correction where a touch was taken, else NaN. A column
        `datum` is 1 where one was set anew: the first touch after that tells nothing.
    model : CompensationModel
        The model in force.
    options : RelearnOptions, optional
        How.

    Returns
    -------
    Proposal
        The model, or none, and why.

    Raises
    ------
    DataError
        If the log lacks a channel of the model, or has no touch of any output.

    Notes
    -----
    Not protected: what touches cannot tell from the model, such as a drift that follows an input.
    """
    asked = options or RelearnOptions()
    names = [o.name for o in model.outputs if _has_touches(log, o.name)]
    if not names:
        raise DataError(
            "no_output_column", names=tuple(o.name for o in model.outputs), file=log.where
        )
    doubtful, log = _doubtful(log, model), _cleaned(log, model, names)
    outputs = [
        _Output(log, model, output, asked, len(names)).judged(doubtful)
        for output in model.outputs
        if output.name in names
    ]
    new = {o.name: o.taken.output for o in outputs if o.taken is not None}
    proposed = replace(model, outputs=tuple(new.get(o.name, o) for o in model.outputs))
    return Proposal(proposed if new else None, tuple(outputs))


def _has_touches(log: ThermalLog, name: str) -> bool:
    known = {column.casefold(): column for column in log.columns}
    column = known.get(name.casefold())
    return column is not None and not bool(np.all(np.isnan(log.columns[column])))


def _doubtful(log: ThermalLog, model: CompensationModel) -> tuple[str, ...]:
    """Return channels of the model whose sensors must be looked at first."""
    findings = check_log(log.select([log.name_of(c) for c in model.channels]))
    return tuple(dict.fromkeys(f.channel for f in findings if f.certain))


def _records(log: ThermalLog, cut_s: float, model: CompensationModel, name: str) -> Records | None:
    """Return what one output is learnt from, with the inputs of the model; None without rows."""
    learnt = log.span(0, max(int(np.searchsorted(log.time_s, cut_s)), 1))
    try:
        return records_of([learnt], _inputs(model), [name])
    except DataError:
        return None


def _cleaned(log: ThermalLog, model: CompensationModel, names: Sequence[str]) -> ThermalLog:
    """Return a log without touches that the others exclude, as far as there are enough."""
    try:
        return without_far_touches(records_of([log], _inputs(model), names))[0].logs[0]
    except DataError:
        return log


def _inputs(model: CompensationModel) -> list[InputDefinition]:
    inputs = {
        part.name: InputDefinition(part.name, part.plus, part.minus or None)
        for output in model.outputs
        for part in output.parts
    }
    return list(inputs.values())


def _identified(records: Records) -> ThermalModel:
    """Identify anew what the records have."""
    names = [definition.name for definition in records.inputs]
    if len(names) > MOST_INPUTS:
        return select(records.experiments, candidate_names=names).model
    (experiments,) = records.experiments.values()
    return modal(experiments, input_names=names, options=_BRIEF).model


_Model = tuple[Output, FloatArray]
"""A model, and what it says at the touches. [µm]"""


@final
class _Output:
    """One output with its touches."""

    def __init__(
        self,
        log: ThermalLog,
        model: CompensationModel,
        output: Output,
        asked: RelearnOptions,
        outputs: int,
    ) -> None:
        self._log, self._model, self._output = log, model, output
        self._asked, self._outputs = asked, outputs
        run = simulate_log(replace(model, outputs=(output,)), log, steady=True)
        shown_um = log.column(output.name, unit="um")
        said_um = run.outputs[output.name].displacement_um
        self._rows = np.flatnonzero(~(np.isnan(shown_um - said_um) | run.bad))
        self._time_s = log.time_s[self._rows]
        self._shown_um = shown_um[self._rows]
        self._left_um = self._shown_um - said_um[self._rows]
        datums = np.flatnonzero(log.columns.get(_DATUM, np.zeros(0)) == 1.0)
        self._anew = np.diff(np.searchsorted(datums, self._rows, side="right"), prepend=0) > 0
        self._since = np.maximum.accumulate(np.where(self._anew, np.arange(self._anew.size), 0))
        ends_s = float(log.time_s[-1]) - asked.judged_s * np.linspace(1.0, 0.0, FOLDS + 1)
        self._cuts_s: list[float] = ends_s[:-1].tolist()
        self._fold = np.searchsorted(ends_s[:-1], self._time_s, side="right") - 1
        self._runs: dict[tuple[int, float], FloatArray] = {}

    def judged(self, doubtful: tuple[str, ...]) -> RelearnedOutput:
        """Return the better model, or why there is none."""
        seen = self._fold < 0
        learnt = int(np.count_nonzero(seen))
        touches = learnt, seen.size - learnt
        blocks = np.unique(self._time_s[~seen] // BLOCK_S).size
        counts = {"learnt": touches[0], "judged": touches[1]}
        judging = FOLDS * int(np.min(np.bincount(self._fold[~seen], minlength=FOLDS)))
        if min(learnt - FEWEST_LEARNT, judging - FEWEST_JUDGED, blocks - FEWEST_BLOCKS) < 0:
            return self._none(touches, (), Message("relearn-few_touches", counts))
        rules = self._asked.filters.get(self._output.name, TouchFilter())
        told = self._time_s[seen], self._left_um[seen]
        self._drift_um_per_root_h, more_um = likeliest_drift(*told, rules.noise_um)
        noise_um = float(np.hypot(rules.noise_um, more_um))
        self._filter = innovations_of(self._time_s, noise_um, self._drift_um_per_root_h, self._anew)
        changed = self._evidence_of_change() > -log(self._asked.false_rate / self._outputs)
        newest = dict(self._candidates(FOLDS - 1, anew=True))
        anew = None in newest and self._leaves_less(newest[None][1])
        folds = [dict(self._candidates(k, anew=anew)) for k in range(FOLDS - 1)]
        folds.append(newest)
        keys = [key for key in newest if all(key in fold for fold in folds)]
        false_rate = self._asked.false_rate / (max(len(newest), 1) * self._outputs)
        every = (
            self._compared(key, [fold[key] for fold in folds], false_rate, changed=changed)
            for key in keys
        )
        candidates = [one for one in every if one is not None]
        better = [one for one in candidates if one.better]
        if not better:
            return self._none(touches, candidates, Message("relearn-no_better", counts))
        best = min(better, key=lambda one: one.comparison.new_um)
        if doubtful:
            why = Message("relearn-sensors_first", {"names": ", ".join(doubtful)})
            return self._none(touches, candidates, why)
        if (rule := self._condemned(best)) is not None:
            return self._none(touches, candidates, Message("relearn-condemned", {"rule": rule}))
        values = {"old_um": best.comparison.old_um, "new_um": best.comparison.new_um, **counts}
        why = Message("relearn-better", values)
        return RelearnedOutput(self._output.name, touches, tuple(candidates), best, why)

    def _none(
        self, touches: tuple[int, int], candidates: Sequence[Candidate], why: Message
    ) -> RelearnedOutput:
        return RelearnedOutput(self._output.name, touches, tuple(candidates), None, why)

    # ---- candidates -----------------------------------------------------------------------------

    def _leaves_less(self, said_um: FloatArray) -> bool:
        """Whether a model leaves less of the newest stretch: else the others are not asked."""
        newest = self._fold == FOLDS - 1
        each = (self._left_um, self._shown_um - said_um)
        old, new = (float(np.sum(self._filter.of(left)[newest] ** 2)) for left in each)
        return new < old

    def _candidates(self, judging: int, *, anew: bool) -> Iterator[tuple[float | None, _Model]]:
        """Yield models of the touches without a stretch, by how long before the newest one. [s]

        The one anew, None, is of those before the stretch.
        """
        for learnt_s in LEARNT_S:
            used = (self._fold != judging) & (self._time_s >= self._cuts_s[-1] - learnt_s)
            if int(np.count_nonzero(used)) >= FEWEST_LEARNT:
                factors = np.exp(self._scaled(used)[0])
                parts = zip(self._output.parts, factors, strict=True)
                output = replace(self._output, parts=tuple(_part(p, *f) for p, f in parts))
                yield learnt_s, (output, self._said_um(factors))
        cut_s, name = self._cuts_s[judging], self._output.name
        records = _records(self._log, cut_s, self._model, name) if anew else None
        if records is not None:
            with suppress(DataError, ConfigurationError, np.linalg.LinAlgError):
                found = {self._output.name: _identified(records)}
                model = compensation_model(found, records)
                (output,) = model.outputs
                known = {part.name: part for part in self._output.parts}
                parts = tuple(_widened(p, known.get(p.name, p)) for p in output.parts)
                yield None, (replace(output, parts=parts), self._run_um(model))

    def _run_um(self, model: CompensationModel) -> FloatArray:
        run = simulate_log(model, self._log, steady=True)
        return run.outputs[model.outputs[0].name].displacement_um[self._rows]

    def _contribution_um(self, number: int, factor: float) -> FloatArray:
        """Return what a part contributes at the touches with its time constants scaled."""
        if (number, factor) not in self._runs:
            part = _part(self._output.parts[number], 1.0, factor)
            alone = Output(self._output.name, (part,))
            self._runs[number, factor] = self._run_um(replace(self._model, outputs=(alone,)))
        return self._runs[number, factor]

    def _said_um(self, factors: NDArray[np.float64]) -> FloatArray:
        parts = [g * self._contribution_um(k, f) for k, (g, f) in enumerate(factors.tolist())]
        return self._output.offset_um + np.sum(parts, axis=0)

    def _scaled(
        self, used: NDArray[np.bool_], about: FloatArray | None = None
    ) -> tuple[FloatArray, FloatArray]:
        """Return the likeliest logarithms of factors of gains and time constants, (parts, 2).

        And what touches tell of them, (2 parts, 2 parts), over what the prior does. Gauss and
        Newton's steps, each with a normal prior about others, or about none; far innovations weigh
        as little as they do in the comparison.
        """
        parts = len(self._output.parts)
        logarithms = middle = np.zeros((parts, 2)) if about is None else about
        left = np.zeros((1, 2 * parts))
        std = np.tile([GAIN_STD, TIME_STD], parts)
        for _ in range(_STEPS):
            factors = np.exp(logarithms)
            slopes: list[FloatArray] = []
            for k, (gain, factor) in enumerate(factors.tolist()):
                own = self._contribution_um(k, factor)
                more = self._contribution_um(k, factor * float(np.exp(_DELTA)))
                slopes += [gain * own, gain * (more - own) / _DELTA]
            table = np.column_stack([*slopes, self._shown_um - self._said_um(factors)])
            rows = self._filter.of(table)[used]
            weight = np.minimum(1.0, CLIPPED / np.maximum(np.abs(rows[:, -1]), 1e-9))[:, None]
            left, right = rows[:, :-1] * std, rows[:, -1:] * weight
            solved = std * np.linalg.solve(
                (left * weight).T @ left + np.eye(std.size),
                (left.T @ right)[:, 0] - (logarithms - middle).ravel() / std,
            )
            step = np.clip(solved, -_LARGEST_STEP, _LARGEST_STEP).reshape(parts, 2)
            logarithms = logarithms + step
            if float(np.max(np.abs(step))) < _DELTA:
                break
        return logarithms, left.T @ left

    # ---- change ---------------------------------------------------------------------------------

    def _evidence_of_change(self) -> float:
        """Return how much likelier the newest touches are if the machine changed, a logarithm.

        Neither the model in force nor what the touches before say of it, with another noise than
        theirs, makes them as likely. That a change at a given time passes log(1 / p) on any night
        is less likely than p by chance (Ville 1939), as far as what was before is known.
        """
        ends_s, evidence = float(self._log.time_s[-1]), 0.0
        for since_s in CHANGED_S:
            late = self._time_s >= ends_s - since_s
            newest = late & ~self._anew
            n = int(np.count_nonzero(newest))
            if min(n, int(np.count_nonzero(~late))) < FEWEST_LEARNT:
                continue
            before, _ = self._scaled(~late)
            after, told = self._scaled(newest, before)
            known, left = (self._squares(self._said_um(np.exp(b)), newest) for b in (before, after))
            moved = (after - before) / np.array([GAIN_STD, TIME_STD])
            known = min(known, self._squares(self._shown_um - self._left_um, newest))
            known, left = max(known, _LEAST), max(left, _LEAST)
            spread = float(np.linalg.slogdet(np.eye(moved.size) + told * n / left)[1])
            likelier = n * log(known / left) - float(np.sum(moved**2)) - spread
            evidence = max(evidence, 0.5 * likelier)
        return evidence

    def _squares(self, said_um: FloatArray, used: NDArray[np.bool_]) -> float:
        """Return the sum of squares of what touches add beside a model, far ones clipped."""
        left = self._filter.of(self._shown_um - said_um)[used]
        return float(np.sum(np.clip(left, -CLIPPED, CLIPPED) ** 2))

    # ---- comparison -----------------------------------------------------------------------------

    def _compared(
        self,
        learnt_s: float | None,
        models: Sequence[_Model],
        false_rate: float,
        *,
        changed: bool,
    ) -> Candidate | None:
        """Compare the models of each stretch, by its touches, with the one in force."""
        judged = (self._fold >= 0) & ~self._anew
        old, new = self._filter.of(self._left_um), np.zeros_like(self._left_um)
        free, since_h = np.zeros((2, judged.size)), np.zeros(judged.size)
        for k, (_, said_um) in enumerate(models):
            left_um, own = self._shown_um - said_um, self._fold == k
            last = int(np.count_nonzero(self._fold < k)) - 1
            since_h[own] = (self._time_s[own] - self._time_s[last]) / 3600.0
            new[own] = self._filter.of(left_um)[own]
            for row, each in enumerate((self._left_um, left_um)):
                before_um = np.mean(each[max(self._since[last], last - 2) : last + 1])
                later = self._fold[self._since[own]] == k  # a datum within the stretch
                free[row, own] = each[own] - np.where(later, each[self._since[own]], before_um)
        block = (self._time_s[judged] // BLOCK_S).astype(np.intp).tolist()
        found = compared(old[judged], new[judged], self._filter.std_um[judged], block, false_rate)
        if found is None:
            return None
        margin = self._asked.margin * (ANEW if learnt_s is None else 1.0)
        old_um, new_um = np.sqrt(np.mean(free[:, judged] ** 2, axis=1)).tolist()
        drift_um2 = self._drift_um_per_root_h**2 * float(np.mean(since_h[judged]))
        surely = found.least_share > 0.0 and found.new_um <= (1.0 - margin) * found.old_um
        less = found.share > 0.5 and new_um**2 <= (FREE_RUN * old_um) ** 2 + drift_um2
        other = changed and learnt_s is not None and found.new_um < found.old_um
        better = less and (surely or other)
        return Candidate(models[-1][0], learnt_s, found, (old_um, new_um), better)

    def _condemned(self, best: Candidate) -> str | None:
        """Return what does for the newest touches what the model does, or why it is not fit."""
        newest = (self._fold == FOLDS - 1) & ~self._anew
        records = _records(self._log, self._cuts_s[-1], self._model, self._output.name)

        def left_by(model: CompensationModel) -> float:
            return self._squares(self._run_um(model), newest)

        if not bool(np.any(newest)):
            return None
        new = left_by(replace(self._model, outputs=(best.output,)))
        if new >= self._squares(np.zeros_like(self._shown_um), newest):
            return "nothing"
        if records is None:
            return None
        if best.learnt_s is None:
            choose = len(records.inputs) > MOST_INPUTS
            (one,) = identify(records, choose=choose, modal_options=_BRIEF).outputs
            if verdicts := [w.code for w in one.warnings if w.code in VERDICTS]:
                return verdicts[0]
        for method, times in NOT_FIT.items():
            simple = {self._output.name: simple_model(records, self._output.name, SIMPLE[method])}
            if new > times**2 * left_by(compensation_model(simple, records)):
                return str(method)
        return None


def _part(part: Part, gain: float, factor: float) -> Part:
    """Return a part with gains and time constants multiplied."""
    return replace(
        part,
        direct_gain_um_per_k=gain * part.direct_gain_um_per_k,
        sections=tuple(
            replace(
                s,
                gain_um_per_k=gain * s.gain_um_per_k,
                time_constant_s=factor * s.time_constant_s,
            )
            for s in part.sections
        ),
    )


def _widened(part: Part, known: Part) -> Part:
    """Return a part with the range of the one in force as well: a log begins at any temperature."""
    ends = ((min, part.lowest_k, known.lowest_k), (max, part.highest_k, known.highest_k))
    low, high = (b if a is None else a if b is None else far(a, b) for far, a, b in ends)
    return replace(part, lowest_k=low, highest_k=high)
