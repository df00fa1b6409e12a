"""Figures of an identified model: its free run as it is written, simple rules run alike beside it.

There is one way to a figure: the model that the file would hold goes through `verify` on the logs.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from thermaxis.codes import Message, Place
from thermaxis.compensation import CompensationModel
from thermaxis.errors import ConfigurationError, DataError
from thermaxis.thermal._arrays import FloatArray, significant
from thermaxis.thermal.identification._records import Records, has_output, records_of
from thermaxis.thermal.identification._result import (
    HeldOut,
    Identification,
    IdentifiedOutput,
    Method,
)
from thermaxis.thermal.log import ThermalLog
from thermaxis.thermal.transfer_function import ModalPart, ThermalModel
from thermaxis.thermal.verification import (
    SPARSE,
    Baseline,
    MeasuredOutput,
    VerificationFigures,
    VerifiedOutput,
    fit_baseline,
    pooled_figures,
    verify,
)

LEARNT_SHARE = 0.7
"""Share of the measured rows of a single log that is learnt from where the rest is held out. [1]"""
FEWEST_HELD_OUT = 20
"""Fewer measured rows judge nothing. [1]"""
MOST_FOLDS = 4
"""Several logs are held out one after the other, in as many groups at most. [1]"""
SEEN_SHARE = 0.5
"""A run judges others' models where these saw so much of the range of every input. [1]"""
LEAST_LEFT = 0.2
"""Rows held out condemn no model that leaves less of them than this share of the displacement's
standard deviation in the training: what averages leave of it is then luck. [1]"""
SIMPLE = {Method.AVERAGES: Baseline.AVERAGES_RIDGE, Method.STATIC: Baseline.RIDGE}
"""Methods that are simple rules."""
NOT_FIT = {Method.AVERAGES: 2.0, Method.STATIC: 1.1}
"""More than so many times what a simple rule leaves of rows held out condemns a model. Default:
two, as the later part of one run often leaves 1.5 times of a model that is better on another run;
no lags at all are rarely a tenth better by chance. [1]"""
FEW = 2.0
"""The same for every rule where few measured rows are held out in stretches: what is left of a few
dozen touches differs by a quarter by chance. [1]"""
LESS = 1.1
"""More than so many times is said, though it ranks none on another log. [1]"""
_MOST_GAIN = 1e5
"""An input that hardly moves may get gains that no model file holds. [µm/K]"""


def simple_model(records: Records, name: str, rule: Baseline) -> ThermalModel:
    """Return a ridge on the inputs of an output, or on their averages too, as a model that runs."""
    fitted = fit_baseline(rule, records.experiments[name], offset=False)
    taus_s = np.array(fitted.lags_s)
    gains = np.clip(fitted.gains_um_per_k, -_MOST_GAIN, _MOST_GAIN)
    pairs = zip(records.inputs, gains, strict=True)
    return ThermalModel(tuple(ModalPart(d.name, float(g[0]), g[1:], taus_s) for d, g in pairs))


def static_gains(records: Records, name: str) -> FloatArray:
    """Return the gains of the static regression of an output, one per input. [µm/K]"""
    return np.array([p.direct_gain for p in simple_model(records, name, Baseline.RIDGE).parts])


_Runs = dict[str, list[VerifiedOutput]]
_Left = dict[str, list[FloatArray]]
_Judge = tuple[ThermalLog, tuple[int, int] | None]
"""A log along which a model runs, and the rows that count, None for all."""


def _runs(
    model: CompensationModel,
    measured: Sequence[MeasuredOutput],
    judges: Sequence[_Judge],
    reference_s: float | None,
) -> _Runs:
    """Return the free run along every log that has an output, by output of the model."""
    found: _Runs = {}
    for log, rows in judges:
        there = [m for m in measured if has_output(log, m.channel)]
        if there:
            one = verify(model, [log], there, reference_s=reference_s, rows=rows)
            for run in one.logs[0].outputs:
                found.setdefault(run.measured.output, []).append(run)
    return found


def _both_runs(
    found: Identification, records: Records, judges: Sequence[_Judge]
) -> tuple[_Runs, _Left]:
    """Return the free runs of the models as written, and what averages leave of their rows."""
    able = [output for output in found.outputs if output.model is not None]
    if not able:
        return {}, {}
    measured = [m for output in able for m in found.measured_of(output.name)]
    rule = Baseline.AVERAGES_RIDGE
    averages = [
        replace(o, model=simple_model(records, found.reference_of(o.name), rule)) for o in able
    ]

    def run(outputs: Sequence[IdentifiedOutput]) -> _Runs:
        model = replace(found, outputs=tuple(outputs)).to_compensation_model(records)
        return _runs(model, measured, judges, records.reference_s)

    own = run(able)
    left = {
        name: [a.residual_um[o.counted] for a, o in zip(runs, own[name], strict=True)]
        for name, runs in run(averages).items()
    }
    return own, left


def with_figures(
    found: Identification, records: Records, again: Callable[[Records], Identification]
) -> Identification:
    """Return an identification with its figures: on the training rows, and on rows held out.

    `again` identifies from other records as the first time.
    """
    own, beside = _both_runs(found, records, [(log, None) for log in records.logs])
    judged = _held_out(found, records, [run for runs in own.values() for run in runs], again)
    outputs: list[IdentifiedOutput] = []
    for output in found.outputs:
        runs, held_out = own.get(output.name), judged.get(output.name)
        if runs:
            trained = pooled_figures(runs)
            averages = _left_um(beside[output.name])
            output = replace(  # noqa: PLW2901 - the same output, with its figures
                output,
                trained=trained,
                runs=tuple(runs),
                training_rmse_um=_rmse(trained, averages, one_step=trained.persistence_rmse_um),
                held_out=held_out,
                warnings=(
                    *output.warnings,
                    *(
                        replace(r, place=Place(run.log))
                        for run in runs
                        for r in (*run.failed, *run.start_remarks)
                    ),
                    *_verdict(found.method, held_out, trained, _drift_um(output)),
                    *_trained_badly(
                        found.method, output, held_out, (trained.rmse_um, averages), records.logs
                    ),
                ),
            )
        outputs.append(output)
    return replace(found, outputs=tuple(outputs))


def _left_um(left: Sequence[FloatArray]) -> float:
    """Return the root mean square of what is left of the rows that count. [µm]"""
    return float(np.sqrt(np.nanmean(np.concatenate(left) ** 2)))


def _rmse(
    model: VerificationFigures, averages_um: float, **others: float | None
) -> dict[str, float]:
    static = model.static_rmse_um
    every = {"model": model.rmse_um, "static": static, "averages": averages_um, **others}
    return {name: value for name, value in every.items() if value is not None}


def _held_out(
    found: Identification,
    records: Records,
    runs: Sequence[VerifiedOutput],
    again: Callable[[Records], Identification],
) -> dict[str, HeldOut]:
    """Fit anew without part of the rows, and judge there; outputs of the same logs together."""
    groups: dict[tuple[int, ...], list[str]] = {}
    for output in found.outputs:
        channels = [m.channel for m in found.measured_of(output.name)]
        have = [any(has_output(log, c) for c in channels) for log in records.logs]
        groups.setdefault(tuple(np.flatnonzero(have).tolist()), []).extend(channels)
    judged: dict[str, HeldOut] = {}
    for numbers, channels in groups.items():
        logs = [records.logs[k] for k in numbers]
        try:
            judged |= _group(channels, logs, records, runs, again)
        except (DataError, ConfigurationError):
            continue  # what is left of the rows allows no model: nothing is promised
    return judged


_Fold = tuple[list[ThermalLog], list[_Judge]]
"""Logs to learn from, and what is judged."""


def _other_runs(logs: Sequence[ThermalLog]) -> list[_Fold]:
    groups = np.array_split(np.arange(len(logs)), min(len(logs), MOST_FOLDS))
    return [
        ([log for k, log in enumerate(logs) if k not in group], [(logs[k], None) for k in group])
        for group in groups
    ]


def _later_part(
    channels: Sequence[str], logs: Sequence[ThermalLog], trained: Sequence[VerifiedOutput]
) -> list[_Fold]:
    learnt: list[ThermalLog] = []
    judges: list[_Judge] = []
    for log in logs:
        rows = _measured_rows(channels, log, trained)
        first = int(LEARNT_SHARE * rows.size)
        if min(first, rows.size - first) >= FEWEST_HELD_OUT:
            cut = int(rows[first])
            learnt.append(log.span(0, cut))
            judges.append((log, (cut, log.rows)))
    return [(learnt, judges)] if learnt else []


def _stretches(
    channels: Sequence[str], logs: Sequence[ThermalLog], trained: Sequence[VerifiedOutput]
) -> list[_Fold]:
    """Hide one stretch of the measured rows after the other, but never the first one: the zero."""
    measured = [_measured_rows(channels, log, trained)[1:] for log in logs]
    count = sum(rows.size for rows in measured)
    if not FEWEST_HELD_OUT <= count <= SPARSE * sum(log.rows for log in logs):
        return []
    folds: list[_Fold] = []
    for k in range(MOST_FOLDS):
        learnt: list[ThermalLog] = []
        judges: list[_Judge] = []
        for log, rows in zip(logs, measured, strict=True):
            hidden = np.array_split(rows, MOST_FOLDS)[k]
            columns = dict(log.columns)
            if hidden.size:
                first, behind = int(hidden[0]), int(hidden[-1]) + 1
                judges.append((log, (first, behind)))
                for name in (log.name_of(c) for c in channels if has_output(log, c)):
                    seen = np.arange(log.rows)
                    seen = (seen < first) | (seen >= behind)
                    columns[name] = np.where(seen, log.columns[name], np.nan)
            learnt.append(replace(log, columns=columns))
        folds.append((learnt, judges))
    return folds


def _measured_rows(
    channels: Sequence[str], log: ThermalLog, trained: Sequence[VerifiedOutput]
) -> NDArray[np.intp]:
    own = [run for run in trained if run.time_s is log.time_s]
    there = [run.counted for run in own if run.measured.channel in channels]
    return np.flatnonzero(np.any(there, axis=0)) if there else np.zeros(0, dtype=np.intp)


def _group(
    channels: Sequence[str],
    logs: Sequence[ThermalLog],
    records: Records,
    trained: Sequence[VerifiedOutput],
    again: Callable[[Records], Identification],
) -> dict[str, HeldOut]:
    """Judge by other runs where each shows most of what an input does, else by later parts."""

    def part_of(learnt: Sequence[ThermalLog]) -> Records:
        return records_of(
            learnt,
            records.inputs,
            channels,
            sample_time_s=records.sample_time_s,
            reference_s=records.reference_s,
        )

    what = Message("held_out-other_runs", {"runs": len(logs)})
    alike = len(logs) > 1 and all(has_output(log, c) for log in logs for c in channels)
    folds = [(part_of(learnt), judges) for learnt, judges in (_other_runs(logs) if alike else [])]
    range_k = records.highest_k - records.lowest_k
    seen = [np.all(p.highest_k - p.lowest_k >= SEEN_SHARE * range_k) for p, _ in folds]
    if not (seen and all(seen)):
        what = Message("held_out-later_part", {"percent": round(100 * (1 - LEARNT_SHARE))})
        rows = _later_part(channels, logs, trained)
        if not rows:
            what = Message("held_out-stretches", {"count": MOST_FOLDS})
            rows = _stretches(channels, logs, trained)
        folds = [(part_of(learnt), judges) for learnt, judges in rows]
    own: _Runs = {}
    beside: _Left = {}
    for part, judges in folds:
        runs_of, left_of = _both_runs(again(part), part, judges)
        for name, runs in runs_of.items():
            own.setdefault(name, []).extend(runs)
            beside.setdefault(name, []).extend(left_of[name])
    judged: dict[str, HeldOut] = {}
    for name, runs in own.items():
        figures = pooled_figures(runs)
        hold_um, mean_um = _constants(runs)
        rmse = _rmse(figures, _left_um(beside[name]), hold=hold_um)
        starts = tuple(run.start.start for run in runs)
        judged[name] = HeldOut(what, figures.fit_percent, rmse, min(hold_um, mean_um), starts)
    return judged


def _constants(runs: Sequence[VerifiedOutput]) -> tuple[float, float]:
    """Return what the last displacement before the rows that count leaves, and their mean. [µm]"""
    left: list[tuple[FloatArray, FloatArray]] = []
    for run in runs:
        before = run.measured_um[: int(np.argmax(run.counted))]
        known = before[~np.isnan(before)]
        there = run.measured_um[run.counted]
        last, mean = (known[-1], np.mean(known)) if known.size else (0.0, 0.0)
        left.append((there - last, there - mean))
    hold, mean = (float(np.sqrt(np.mean(np.concatenate(e) ** 2))) for e in zip(*left, strict=True))
    return hold, mean


def _drift_um(output: IdentifiedOutput) -> float:
    """Return how far a probe drifted in a log: a model rightly leaves that of its rows. [µm]"""
    found = [w.values["drift_um"] for w in output.warnings if w.code == "warning-probe_drift"]
    return max((abs(um) for um in found if isinstance(um, float)), default=0.0)


def _trained_badly(
    method: Method,
    output: IdentifiedOutput,
    held_out: HeldOut | None,
    left_um: tuple[float, float],
    logs: Sequence[ThermalLog],
) -> tuple[Message, ...]:
    """Return a warning where averages explain the very rows better that a model is learnt from.

    Of few rows averages explain the noise, and condemn nothing.
    """
    model_um, simple_um = left_um
    least_um = max(NOT_FIT[Method.AVERAGES] * simple_um, _drift_um(output))
    if method in SIMPLE or model_um < least_um:
        return ()
    if held_out is None or held_out.in_stretches:
        return ()
    drifts = any(remark.code.endswith("_drifts") for log in logs for remark in log.remarks)
    values = {"model_um": significant(model_um, 3), "simple_um": significant(simple_um, 3)}
    return (Message("warning-trained_badly", {**values, "drifts": "yes" if drifts else "no"}),)


def _verdict(
    method: Method, held_out: HeldOut | None, trained: VerificationFigures, drift_um: float
) -> tuple[Message, ...]:
    """Return a warning where a simple rule, or none, does for rows held out what the model does.

    By equation (4), what is left is (1 - fit) times the standard deviation.
    """
    if held_out is None or held_out.fit_percent is None or trained.fit_percent is None:
        return ()
    left_um = held_out.rmse_um
    rmse = {name: significant(value, 3) for name, value in left_um.items()}
    worse = left_um["model"]
    constant_um = held_out.constant_um
    std_um = trained.rmse_um / max(1.0 - trained.fit_percent / 100.0, 1e-9)
    others = {rule: left_um.get(rule, constant_um) for rule in NOT_FIT if rule is not method}
    less = [rule for rule, um in others.items() if um < constant_um and worse > LESS * um]
    few = FEW if held_out.in_stretches else 0.0
    unfit = [rule for rule in less if worse > max(NOT_FIT[rule], few) * others[rule]]
    much = worse > LEAST_LEFT * std_um
    if not less and not (much and worse >= constant_um):
        return ()
    if worse < drift_um:
        return (Message("warning-drift_held_out"),)
    if less:
        best = min(less, key=lambda rule: left_um[rule])
        values = {"model_um": rmse["model"], "method": str(best), "simple_um": rmse[best]}
        code = "warning-not_fit" if much and unfit else "warning-simple_left_less"
        return (Message(code, values),)
    values = {"model_um": rmse["model"], "constant_um": significant(constant_um, 3)}
    return (Message("warning-explains_nothing", values),)
