"""Verify a compensation model on logs: free run, with limits beside it, and figures of both."""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache, partial
from typing import final

import numpy as np
from numpy.typing import NDArray

from thermaxis.codes import Message, Place, Value
from thermaxis.compensation import CompensationModel, Limits, Outcome, gain_of
from thermaxis.errors import ConfigurationError, DataError
from thermaxis.thermal._arrays import FloatArray, significant
from thermaxis.thermal.log import REFERENCE_S, LogLike, ThermalLog, as_thermal_logs
from thermaxis.thermal.transfer_function import held
from thermaxis.thermal.verification._far_touches import SPARSE, far_touches
from thermaxis.thermal.verification._free_run import (
    SimulatedLog,
    model_columns,
    simulate_log,
)
from thermaxis.thermal.verification._limited_run import LimitedRun, limited_run
from thermaxis.thermal.verification._start import LogStart, StartOfLog, start_of_log
from thermaxis.thermal.verification._touched_run import (
    LEAST_FAR_UM,
    Displaced,
    TouchFigures,
    TouchPlan,
    far_message,
    touched_run,
)

AT_REFERENCE = 0.15
"""First value over the root mean square of an input up to which a log begins at its reference, as
in the training. [1]"""
FEWEST_ROWS = 100
"""Measured rows before those that count that say how a log began. [1]"""
HOUR_S = 3600.0
"""ISO 230-3 states the displacement after 60 minutes. [s]"""
HOUR_TOLERANCE_S = 600.0
"""The first row after 60 minutes counts if it is at most so much later. [s]"""
OUTSIDE_SHARE = 0.05
"""Share of the rows outside the training range from which on a warning is given. [1]"""
OUTSIDE_WIDTH = 0.01
"""Less than this share of the training range is the noise at its edge. [1]"""
MOST_CONTRADICT = 0.5
"""Where more of the touches than this share are excluded, their sign, unit or clock may be wrong.
[1]"""
MOST_NAMED = 4
"""So many far touches, or runs of them, are named. [1]"""
LEAST_WITHIN, SURE = 0.85, 3.0
"""A smaller share of the innovations within two sigma is said, and of few touches only where it is
so many standard deviations below 0.95, as in one log of 100 by chance. [1]"""
STANDSTILL_RPM = 1.0
"""Below this a speed counts as standstill. [1/min]"""


@final
@dataclass(frozen=True, slots=True)
class MeasuredOutput:
    """A measured channel and what of the model it is compared with."""

    channel: str
    output: str
    diameter_mm: float | None = None
    """Workpiece diameter at which it was measured; None for the tool centre point. [mm]"""

    @property
    def name(self) -> str:
        """Name in results: the channel."""
        return self.channel


# ---- figures ------------------------------------------------------------------------------------


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class VerificationFigures:
    """Figures of one output: measured against free run, both relative to the start of the log."""

    rows: int
    """Rows in which the output was measured and simulated. [1]"""
    fit_percent: float | None
    """Equation (4) with the mean of the measured output; None if that is constant. [%]"""
    uncompensated_um: float
    """Peak-to-peak of the measured displacement. [µm]"""
    residual_um: float
    """Peak-to-peak of measured minus simulated. [µm]"""
    rmse_um: float
    """Root mean square of the residual. [µm]"""
    mae_um: float
    """Mean absolute residual. [µm]"""
    max_um: float
    """Largest absolute residual. [µm]"""
    after_60_min_um: tuple[float, float] | None
    """Measured and residual displacement after 60 minutes; None in a shorter log. [µm]"""
    at_end_um: tuple[float, float]
    """Measured and residual displacement at the last measured row. [µm]"""
    persistence_rmse_um: float | None
    """Root mean square of measured minus its value one row before: one step ahead, 'nothing
    changes'; None with one row. [µm]"""
    static_rmse_um: float | None
    """Root mean square left by the static regression on the model's inputs that the model carries
    from its training; where it carries none, by one that is fitted to this very log, which is
    better than any that was known before; None where there is neither. [µm]"""

    @property
    def reduction(self) -> float:
        """Uncompensated over residual peak-to-peak; infinite where nothing is left. [1]"""
        return self.uncompensated_um / self.residual_um if self.residual_um > 0 else float("inf")


@final
@dataclass(frozen=True, slots=True, eq=False)
class VerifiedOutput:
    """One measured output of one log."""

    measured: MeasuredOutput
    log: str
    time_s: FloatArray
    """Times, (n,). [s]"""
    input_k: FloatArray
    """Input of every part, not relative to anything, (n, parts). [K]"""
    figures: VerificationFigures
    measured_um: FloatArray
    """Measured displacement relative to the start, (n,); NaN where not measured. [µm]"""
    simulated_um: FloatArray
    """Simulated displacement relative to the start, (n,). [µm]"""
    contribution_um: FloatArray
    """Contribution of every part relative to the start, (n, parts). [µm]"""
    parts: tuple[str, ...]
    counted: NDArray[np.bool_]
    """Rows that count in the figures, (n,)."""
    start: StartOfLog
    failed: tuple[Message, ...]
    """How many rows of the log do not count, as an input had failed for too long; else empty."""
    start_rows: int
    """Measured rows that say so, none where a steady one was asked for: those before the
    rows that count, where there are enough. [1]"""
    limited: VerificationFigures | None = None
    """The figures with the correction within limits, begun at rest as the machine begins, whatever
    `start` is; None where none were stated."""
    touched: TouchFigures | None = None
    """What touches are worth, begun likewise; None where none were asked for."""

    @property
    def residual_um(self) -> FloatArray:
        """Measured minus simulated: the compensated machine, (n,). [µm]"""
        return self.measured_um - self.simulated_um

    @property
    def start_remarks(self) -> tuple[Message, ...]:
        """How the log began, told where the rows show that it was not at rest and it matters."""
        if not (self.start.matters and self.start_rows):
            return ()
        values = {
            "channel": self.measured.channel,
            "zero_um": self.start.zero_um,
            "rows": self.start_rows,
        }
        return (Message(f"remark-start_{self.start.start}", values),)


@final
@dataclass(frozen=True, slots=True, eq=False)
class VerifiedLog:
    """One log."""

    name: str
    time_s: FloatArray
    """Times, (n,). [s]"""
    outputs: tuple[VerifiedOutput, ...]
    environmental: bool
    """Whether no spindle or table turned: then the ranges are ETVE (ISO 230-3)."""
    outside: Mapping[str, tuple[float, float]]
    """As of `SimulatedLog`."""
    warnings: tuple[Message, ...]
    """What the reader must know."""
    reference_s: float | None
    """As of `ThermalLog.start_of`. [s]"""


@final
@dataclass(frozen=True, slots=True, eq=False)
class Verification:
    """A model against logs."""

    pooled: Mapping[str, VerificationFigures]
    """Figures over all logs, by measured channel."""
    logs: tuple[VerifiedLog, ...]
    warnings: tuple[Message, ...]
    """What the reader must know."""

    @property
    def mean_fit_percent(self) -> float | None:
        """Mean of the pooled fits, as below the paper's Table 3; None without a fit. [%]"""
        fits = [f.fit_percent for f in self.pooled.values() if f.fit_percent is not None]
        return float(np.mean(fits)) if fits else None


def verify(
    model: CompensationModel,
    logs: LogLike | Sequence[LogLike],
    measured: Sequence[MeasuredOutput] | None = None,
    *,
    reference_s: float | None = None,
    rows: tuple[int, int] | None = None,
    limits: Mapping[str, Limits] | None = None,
    start: LogStart | None = None,
    touches: TouchPlan | None = None,
) -> Verification:
    """Compare the free run of a model with what logs measured.

    Every log starts the model anew. Measured and simulated displacement are both taken relative
    to their mean over the first time of the log; where the output was not measured then, to the
    first measured row.

    Parameters
    ----------
    logs : ThermalLog or frame, or a sequence of such
        As of `as_thermal_log`.
    measured : sequence of MeasuredOutput, optional
        What is compared. Default: the channels that are named as the model's outputs.
    reference_s : float, optional
        The first time. Default: a minute. Temperatures count from `ThermalLog.start_of`. [s]
    rows : tuple of int, optional
        Rows that count in the figures, from 0, half open; the free run begins at the first row
        of the log all the same. Default: all. [1]

    limits : mapping of str to Limits, optional
        Limits of the correction by output of the model; the figures with the limited correction
        then stand beside those without limits. Default: none.
    start : LogStart, optional
        State of the machine at the first row. Default: at rest, as `cycle` starts, unless the
        measured rows make another start 20 times more likely. A fitted start takes states and
        zero from the rows before those that count, or from all where these are too few.
    touches : TouchPlan, optional
        When the machine is touched; what that is worth then stands beside. Default: never.

    Returns
    -------
    Verification
        Figures per log and pooled.

    Raises
    ------
    DataError
        If a log lacks a channel, or an output was measured in no row.
    ConfigurationError
        If there is no log, or no output to compare.

    References
    ----------
    Mareš and Horejš 2021, equation (4), Table 3, figures 10 to 13; ISO 230-3:2020 for the value
    after 60 minutes and ETVE (from memory).
    """
    logs = as_thermal_logs(logs)
    if not logs:
        raise ConfigurationError("no_log", key="logs")
    if rows is not None and not 0 <= rows[0] < rows[1]:
        raise ConfigurationError("no_span", first=rows[0], last=rows[1], key="rows")
    verified = tuple(
        _verify_log(
            _Comparison(
                model,
                _measured_in(model, log, measured),
                reference_s,
                rows,
                limits or {},
                start,
                touches,
            ),
            log,
        )
        for log in logs
    )
    names = dict.fromkeys(output.measured.name for log in verified for output in log.outputs)
    pooled = {
        name: pooled_figures(
            [o for log in verified for o in log.outputs if o.measured.name == name]
        )
        for name in names
    }
    warnings = [
        replace(w, place=w.place._replace(file=log.name)) for log in verified for w in log.warnings
    ]
    told = tuple(w for k, w in enumerate(warnings) if w not in warnings[:k])
    return Verification(pooled, verified, told)


def _measured_in(
    model: CompensationModel, log: ThermalLog, measured: Sequence[MeasuredOutput] | None
) -> tuple[MeasuredOutput, ...]:
    names = [output.name for output in model.outputs]
    if measured is None:
        known = {channel.casefold() for channel in log.columns}
        found = tuple(MeasuredOutput(name, name) for name in names if name.casefold() in known)
        if not found:
            raise ConfigurationError("no_output_column", names=tuple(names), file=log.name)
        return found
    for entry in measured:
        if entry.output not in names:
            raise ConfigurationError(
                "unknown_name",
                name=entry.output,
                known=tuple(names),
                key="measured",
                channel=entry.channel,
            )
    return tuple(measured)


@final
@dataclass(frozen=True, slots=True)
class _Comparison:
    """What is compared, and how."""

    model: CompensationModel
    measured: Sequence[MeasuredOutput]
    reference_s: float | None
    rows: tuple[int, int] | None
    limits: Mapping[str, Limits]
    start: LogStart | None
    touches: TouchPlan | None


def _verify_log(asked: _Comparison, log: ThermalLog) -> VerifiedLog:
    model, reference_s = asked.model, asked.reference_s
    runs: dict[float | None, SimulatedLog] = {}
    warm: dict[float | None, Callable[[], SimulatedLog]] = {}
    limited: dict[float | None, LimitedRun] = {}
    outputs: list[VerifiedOutput] = []
    for entry in asked.measured:
        d_mm = entry.diameter_mm
        if d_mm not in runs:
            runs[d_mm] = simulate_log(model, log, diameter_mm=d_mm, reference_s=reference_s)
            warm[d_mm] = cache(
                partial(
                    simulate_log,
                    *(model, log),
                    diameter_mm=d_mm,
                    reference_s=reference_s,
                    steady=True,
                )
            )
            limited[d_mm] = limited_run(
                model, log, asked.limits, diameter_mm=d_mm, reference_s=reference_s
            )
        outputs.append(_verify_output(asked, log, entry, runs[d_mm], warm[d_mm], limited[d_mm]))
    any_run = next(iter(runs.values()))
    return VerifiedLog(
        name=log.name,
        time_s=log.time_s,
        outputs=tuple(outputs),
        environmental=_standstill(log),
        outside=any_run.outside,
        warnings=(
            *_warnings(runs),
            *_stopped(limited.values()),
            *(remark for output in outputs for remark in output.start_remarks),
            *(r for output in outputs for r in _touch_remarks(asked.touches, log, output)),
        ),
        reference_s=reference_s,
    )


def _standstill(log: ThermalLog) -> bool:
    """Whether the log has speeds and none of them turned."""
    speeds = [log.columns[c] for c, unit in log.units.items() if unit == "rpm"]
    return bool(speeds) and all(
        bool(np.all(np.abs(v[~np.isnan(v)]) < STANDSTILL_RPM)) for v in speeds
    )


def _warnings(runs: Mapping[float | None, SimulatedLog]) -> tuple[Message, ...]:
    said: list[Message] = []
    run = next(iter(runs.values()))
    for name, (share, beyond) in run.outside.items():
        if (share >= OUTSIDE_SHARE and beyond >= OUTSIDE_WIDTH) or beyond >= OUTSIDE_SHARE:
            values = {
                "name": name,
                "share_percent": 100.0 * share,
                "beyond_percent": 100.0 * beyond,
            }
            said.append(Message("remark-outside_training", values))
    said += _failed(run.bad)
    for outcome in (Outcome.GAP, Outcome.CLOCK_BACKWARD):
        count = run.outcomes.get(outcome, 0)
        if count:
            said.append(Message(f"remark-{outcome}", {"count": count}))
    said += [
        Message(f"outcome-{outcome}")
        for outcome in (Outcome.DIAMETER_HELD, Outcome.DIAMETER_UNKNOWN)
        if any(outcome in r.outcomes for r in runs.values())
    ]
    return tuple(said)


def _failed(bad: NDArray[np.bool_]) -> tuple[Message, ...]:
    values = {"rows": int(np.sum(bad)), "share_percent": 100.0 * float(np.mean(bad))}
    return (Message("remark-input_failed", values),) if values["rows"] else ()


def _stopped(runs: Iterable[LimitedRun]) -> tuple[Message, ...]:
    faults = max((run.faults for run in runs), default=0)
    return (Message("remark-limits_too_narrow", {"count": faults}),) if faults else ()


def _touch_remarks(
    plan: TouchPlan | None, log: ThermalLog, output: VerifiedOutput
) -> Iterator[Message]:
    """Yield why touches of this log are worth less than on a machine, or say less of it."""
    if plan is None or (found := output.touched) is None or not found.touches:
        return
    channel = {"channel": output.measured.channel}
    values = {**channel, "touches": found.touches, "excluded": found.excluded}
    share = float(np.mean(~np.isnan(log.column(output.measured.channel))))
    if plan.by_itself and share <= SPARSE:
        yield Message("remark-touches_touched", {**channel, "share_percent": 100.0 * share})
    if found.untimely == found.touches:
        yield Message("remark-touches_untimely", values)
        return
    own, likely = found.rules, found.likely
    within = found.within_two_sigma
    if found.off is not None:
        yield Message(f"touch-{found.off}", place=Place(channel=output.measured.channel))
    far = [one for one in found.far if found.many_excluded or abs(one[1]) >= LEAST_FAR_UM]
    if far and (found.many_excluded or not plan.by_itself):
        named = tuple(far_message(log, *one) for one in far[:MOST_NAMED])
        code = "remark-touches_excluded" if found.many_excluded else "remark-touches_far"
        yield Message(code, {**values, "far": named})
    if found.excluded > MOST_CONTRADICT * found.touches:
        yield Message("remark-touches_contradict", channel)
    if found.moved:
        named = tuple(far_message(log, *one) for one in found.moved[:MOST_NAMED])
        yield Message("remark-touches_datum", {**channel, "touches": named})
    if likely is not None and not found.tell_little:
        errors = found.with_offset.mae_um, found.free_run.mae_um
        wide = likely.drift_um_per_root_h < own.drift_um_per_root_h
        code = "remark-touches_worse" if wide and errors[0] > errors[1] else ""
        chance = 0.95 - SURE * (0.95 * 0.05 / max(found.judged, 1)) ** 0.5
        if within is not None and within < min(LEAST_WITHIN, chance):
            code = "remark-touches_beyond"
        rules: dict[str, Value] = {
            "drift_um": significant(own.drift_um_per_root_h, 2),
            "discrepancy_um": significant(own.discrepancy_um, 2),
            "likely_drift_um": significant(likely.drift_um_per_root_h, 2),
            "likely_discrepancy_um": significant(likely.discrepancy_um, 2),
        }
        figures: dict[str, Value] = {
            **channel,
            "percent": within and significant(100.0 * within, 2),
            "offset_um": significant(errors[0], 3),
            "model_um": significant(errors[1], 3),
            "likeliest": Message("touches-likeliest", rules),
        }
        if code:
            yield Message(code, figures)


def _verify_output(
    asked: _Comparison,
    log: ThermalLog,
    entry: MeasuredOutput,
    run: SimulatedLog,
    steady_run: Callable[[], SimulatedLog],
    within: LimitedRun,
) -> VerifiedOutput:
    """Compare one output; runs are from rest and from the steady state of the first row."""
    model, reference_s, rows = asked.model, asked.reference_s, asked.rows
    rest = run.outputs[entry.output]
    measured = np.array(log.column(entry.channel, unit="um"))
    both = ~(np.isnan(measured) | np.isnan(rest.displacement_um) | run.bad)
    if not bool(np.any(both)):
        raise DataError("not_measured_with_model", file=log.name, channel=entry.channel)
    at_start = both & (log.time_s <= (reference_s or REFERENCE_S))
    if not bool(np.any(at_start)):
        at_start = np.zeros_like(both)
        at_start[np.flatnonzero(both)[0]] = True
    zero_um = float(np.mean(measured[at_start]))
    measured -= zero_um
    counted, number = both, np.arange(both.size)
    if rows is not None:
        counted = both & (rows[0] <= number) & (number < rows[1])
        if not bool(np.any(counted)):
            raise DataError(
                "not_measured_in_rows",
                first=rows[0],
                last=rows[1],
                file=log.name,
                channel=entry.channel,
            )
    before = both & (number < np.argmax(counted))
    known = before if int(np.sum(before)) >= FEWEST_ROWS else both
    inputs = _inputs_of(model, entry.output, log)
    part, fading_of = _fading_of(model, entry, log.time_s, at_start)
    simulated, level = rest, at_start
    start, steady = StartOfLog(LogStart.REST, np.zeros(0), 0.0), None
    if asked.start is not LogStart.REST:
        rise = inputs - _first_of(inputs, at_start)
        rms_k = np.sqrt(np.nansum(rise**2, axis=0) / np.maximum(np.sum(~np.isnan(rise), axis=0), 1))
        first_k = np.abs(rise[np.flatnonzero(np.all(~np.isnan(rise), axis=1))[:1]])
        if asked.start is LogStart.STEADY or bool(np.any(first_k > AT_REFERENCE * rms_k)):
            steady = steady_run().outputs[entry.output]
        left = [measured - one.displacement_um for one in (rest, steady) if one is not None]
        left = [(e - np.mean(e[at_start]))[known] for e in left]
        start = start_of_log(
            log.time_s[known], measured[known], left, fading_of(known), part @ rms_k, asked.start
        )
        simulated = steady if steady and start.start is LogStart.STEADY else rest
        level = known if start.start is LogStart.FITTED else at_start
    displacement = simulated.displacement_um - float(np.mean(simulated.displacement_um[at_start]))
    contribution = simulated.contribution_um - np.mean(simulated.contribution_um[at_start], axis=0)
    if start.start is LogStart.FITTED:
        fading = fading_of(np.ones_like(both))
        displacement += fading @ start.states_k + start.zero_um
        contribution += (fading * start.states_k) @ part
    static = _static_of(model, entry, held(inputs)[0])
    static_rmse = (
        _own_static_rmse(measured[counted], held(inputs)[0][counted])
        if static is None
        else _rmse((e := measured - static)[counted] - _first_of(e[:, None], level)[0])
    )
    times, seen = [log.time_s[counted]], [measured[counted]]
    limited: VerificationFigures | None = None
    if entry.output in within.taken_um:
        allowed = within.taken_um[entry.output]
        allowed = allowed - float(np.mean(allowed[at_start]))
        limited = _figures(times, seen, [allowed[counted]], static_rmse)
    return VerifiedOutput(
        measured=entry,
        log=log.name,
        time_s=log.time_s,
        input_k=inputs,
        figures=_figures(times, seen, [displacement[counted]], static_rmse),
        measured_um=measured,
        simulated_um=displacement,
        contribution_um=contribution,
        parts=simulated.parts,
        counted=counted,
        start=start,
        failed=_failed(run.bad),
        start_rows=0 if asked.start is LogStart.STEADY else int(np.sum(known)),
        limited=limited,
        touched=_touched(
            asked, log, entry, measured, zero_um, rest.displacement_um[at_start], counted, inputs
        ),
    )


def _touched(
    asked: _Comparison,
    log: ThermalLog,
    entry: MeasuredOutput,
    measured: FloatArray,
    zero_um: float,
    begun_um: FloatArray,
    counted: NDArray[np.bool_],
    inputs: FloatArray,
) -> TouchFigures | None:
    """Return what touches are worth for an output; None where it is not touched.

    What the model says at the start is `begun_um`; what is measured begins at a zero there.
    """
    plan, level_um = asked.touches, float(np.mean(begun_um))
    if plan is None or not (plan.by_itself or entry.output in plan.channels):
        return None
    if not plan.by_itself:
        touched = log.column(plan.channels[entry.output], unit="um") - zero_um
    else:
        number = [one.channel for one in asked.measured].index(entry.channel)
        touched = np.random.default_rng((plan.seed, number)).normal(measured, plan.rules.noise_um)
    found = touched_run(
        plan,
        replace(
            asked.model, outputs=tuple(o for o in asked.model.outputs if o.name == entry.output)
        ),
        log,
        Displaced(touched + level_um, measured + level_um, level_um, counted),
        asked.limits.get(entry.output),
        diameter_mm=entry.diameter_mm,
        reference_s=asked.reference_s,
    )
    if plan.by_itself:
        return found
    since_s = log.time_s[~np.isnan(touched)]
    moves = far_touches(log.time_s, inputs - _first_of(inputs, counted), touched)[1]
    return replace(found, moved=tuple((float(since_s[k]), um) for k, um in sorted(moves.items())))


def _first_of(inputs: FloatArray, at_start: NDArray[np.bool_]) -> FloatArray:
    """Return the mean of each column at the start, or its first value where it has none there."""
    found = np.zeros(inputs.shape[1])
    for k, column in enumerate(inputs.T):
        known = ~np.isnan(column)
        there = column[known & at_start]
        found[k] = np.mean(there) if there.size else next(iter(column[known]), 0.0)
    return found


def _fading_of(
    model: CompensationModel,
    entry: MeasuredOutput,
    time_s: FloatArray,
    at_start: NDArray[np.bool_],
) -> tuple[FloatArray, Callable[[NDArray[np.bool_]], FloatArray]]:
    """Return to which part each lag belongs, (j, parts), and what one kelvin of it does in rows.

    That is relative to the mean at the start, (n, j).
    """
    parts = next(o.parts for o in model.outputs if o.name == entry.output)
    lags = [
        (k, section.gain_um_per_k * gain_of(part, entry.diameter_mm), section.time_constant_s)
        for k, part in enumerate(parts)
        for section in part.sections
    ]
    number, gains, taus_s = np.array(lags).reshape(-1, 3).T

    def fading(rows: NDArray[np.bool_]) -> FloatArray:
        return gains * np.exp(-(time_s[rows, None] - time_s[0]) / taus_s)

    zero = np.mean(fading(at_start), axis=0)
    return np.eye(len(parts))[number.astype(np.intp)], lambda rows: fading(rows) - zero


def _inputs_of(model: CompensationModel, output: str, log: ThermalLog) -> FloatArray:
    """Return the inputs of an output, not relative to anything, (n, parts)."""
    columns = dict(zip(model.channels, model_columns(model, log), strict=True))
    parts = next(o.parts for o in model.outputs if o.name == output)
    return np.stack(
        [columns[p.plus] - (columns[p.minus] if p.minus else 0.0) for p in parts], axis=1
    )


def _figures(
    times_s: Sequence[FloatArray],
    measured: Sequence[FloatArray],
    simulated: Sequence[FloatArray],
    static_rmse_um: float | None,
) -> VerificationFigures:
    """Return the figures of one or several runs; each spread is about its own run's mean."""
    residuals = [y - s for y, s in zip(measured, simulated, strict=True)]
    y, e = np.concatenate(measured), np.concatenate(residuals)
    about_mean = np.concatenate([m - np.mean(m) for m in measured])
    spread = float(np.linalg.norm(about_mean))
    fit = None
    if spread > 0:
        fit = 100.0 * (1.0 - float(np.linalg.norm(e)) / spread)
    steps = np.concatenate([np.diff(m) for m in measured])
    late = (times_s[0] >= HOUR_S) & (times_s[0] <= HOUR_S + HOUR_TOLERANCE_S)
    after = None
    if len(measured) == 1 and bool(np.any(late)):
        k = int(np.argmax(late))
        after = (float(measured[0][k]), float(residuals[0][k]))
    return VerificationFigures(
        rows=y.size,
        fit_percent=fit,
        uncompensated_um=float(np.ptp(y)),
        residual_um=float(np.ptp(e)),
        rmse_um=float(np.sqrt(np.mean(e**2))),
        mae_um=float(np.mean(np.abs(e))),
        max_um=float(np.max(np.abs(e))),
        after_60_min_um=after,
        at_end_um=(float(measured[-1][-1]), float(residuals[-1][-1])),
        persistence_rmse_um=float(np.sqrt(np.mean(steps**2))) if steps.size else None,
        static_rmse_um=static_rmse_um,
    )


def _static_of(
    model: CompensationModel, entry: MeasuredOutput, inputs: FloatArray
) -> FloatArray | None:
    """Return what the static regression of the training says, None where the model has none."""
    parts = next(o.parts for o in model.outputs if o.name == entry.output)
    gains = [part.static_gain_um_per_k for part in parts]
    if any(gain is None for gain in gains):
        return None
    by_diameter = [gain_of(part, entry.diameter_mm) for part in parts]
    total = np.array([g or 0.0 for g in gains]) * np.array(by_diameter)
    return np.asarray(inputs @ total, dtype=np.float64)


def _rmse(values: FloatArray) -> float | None:
    present = values[~np.isnan(values)]
    return float(np.sqrt(np.mean(present**2))) if present.size else None


def _own_static_rmse(measured: FloatArray, inputs: FloatArray) -> float | None:
    """Return what the best static regression leaves of the log that it is fitted to."""
    present = ~np.any(np.isnan(inputs), axis=1)
    if int(np.sum(present)) <= inputs.shape[1] + 1:
        return None
    u = inputs[present] - np.mean(inputs[present], axis=0)
    y = measured[present] - np.mean(measured[present])
    factor, triangle = np.linalg.qr(u)
    if float(np.min(np.abs(np.diag(triangle)))) < 1e-9 * float(np.max(np.abs(triangle))):
        return None
    left: FloatArray = y - factor @ (factor.T @ y)
    return _rmse(left)


def pooled_figures(outputs: Sequence[VerifiedOutput]) -> VerificationFigures:
    """Return figures over several runs, each about its own mean.

    Values at the end are those of the last run; values after 60 minutes only one run has.
    """
    if len(outputs) == 1:
        return outputs[0].figures
    present = [o.counted for o in outputs]
    statics = [(o.figures.static_rmse_um, o.figures.rows) for o in outputs]
    pooled: float | None = None
    if all(value is not None for value, _ in statics):
        squares = sum((v or 0.0) ** 2 * n for v, n in statics)
        pooled = float(np.sqrt(squares / sum(n for _, n in statics)))
    return replace(
        _figures(
            [np.zeros(1)],
            [o.measured_um[p] for o, p in zip(outputs, present, strict=True)],
            [o.simulated_um[p] for o, p in zip(outputs, present, strict=True)],
            pooled,
        ),
        after_60_min_um=None,
    )
