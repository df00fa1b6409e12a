"""Tell that gains and time constants change while a log runs, as where coolant is switched on.

The evidence of lags that change with a regime is compared with that of lags that do not, and of
the regime as one more input: what heats or cools by itself is no other time constant.
"""

from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import replace

import numpy as np

from thermaxis.codes import Message
from thermaxis.errors import DataError
from thermaxis.thermal._arrays import significant
from thermaxis.thermal.identification._records import Records, even_log, has_output, records_of
from thermaxis.thermal.identification._result import IdentifiedOutput, Regimes
from thermaxis.thermal.log import Experiment, InputDefinition, ThermalLog
from thermaxis.thermal.modal import (
    BoolArray,
    fit_switched,
    response_evidence,
    simulate_switched,
)
from thermaxis.thermal.transfer_function import held

LEAST_EVIDENCE = 20.0
"""Gain of the logarithm of the evidence from which two regimes are told. Default: healthy logs of
four machines show up to 6, coolant that changes one time constant of three shows 60 to 180. [1]"""
GOOD_FIT_PERCENT = 95.0
"""A model that fits its log better has one regime. [%]"""
LEARNT_SHARE = 0.7
"""Share of the rows that is learnt from where the rest is simulated. [1]"""
LEAST_SHARE = 0.05
"""A regime holds in so much of the rows at least. [1]"""
STRETCHES = 16
"""Stretches of a log that are told apart where no column tells the regime. [1]"""
_MOST_ROWS, _MOST_STEP_S = 5000, 120.0
_MOST_NAMED, _MOST_INPUTS = 4, 6


def with_regimes(output: IdentifiedOutput, records: Records) -> IdentifiedOutput:
    """Return an output whose model fits badly with what tells that no one model fits its logs."""
    fit, model = output.fit_percent, output.model
    inputs = [d for d in records.inputs if model is not None and d.name in model.input_names]
    if fit is None or fit >= GOOD_FIT_PERCENT or len(inputs) > _MOST_INPUTS:
        return output
    for log in records.logs:
        if has_output(log, output.name):
            with suppress(DataError, np.linalg.LinAlgError):  # too little was measured to tell
                output = _told(log, inputs, output, records.reference_s)
    return output


def _told(
    log: ThermalLog,
    inputs: Sequence[InputDefinition],
    output: IdentifiedOutput,
    reference_s: float,
) -> IdentifiedOutput:
    step_s = min(max(log.usual_step_s, log.duration_s / _MOST_ROWS), _MOST_STEP_S)
    records = records_of(
        [log], inputs, [output.name], sample_time_s=step_s, reference_s=reference_s
    )
    (one,) = records.experiments[output.name]
    used = {log.name_of(channel) for definition in inputs for channel in definition.channels}
    columns = {name: on for name, on in _two_valued(log, step_s) if name not in used}
    gained = {name: _gained(one, on) for name, on in columns.items()}
    best = max(gained, key=gained.__getitem__, default="")
    if best and gained[best] >= LEAST_EVIDENCE:
        names = [definition.name for definition in inputs]
        on, cut = columns[best], int(LEARNT_SHARE * one.y.size)
        part = Experiment(step_s, one.u[:cut], one.y[:cut])
        learnt = fit_switched(part, on[:cut], names).models
        run = simulate_switched(learnt, step_s, held(one.u)[0], on)[cut:]
        values = log.columns[best]
        regimes = Regimes(
            best,
            (float(np.nanmin(values)), float(np.nanmax(values))),
            fit_switched(one, on, names).models,
            float(np.sqrt(np.nanmean((one.y[cut:] - run) ** 2))),
        )
        parts = zip(*(model.parts for model in regimes.models), strict=True)
        gains = (f"{a.input_name} {a.dc_gain:.3g} / {b.dc_gain:.3g}" for a, b in parts)
        message = Message(
            "warning-two_regimes_by",
            {
                "column": best,
                "low": regimes.values[0],
                "high": regimes.values[1],
                "rows": _spans(values > np.mean(regimes.values)),
                "log": log.where,
                "gains": ", ".join(gains),
                "rmse_um": significant(regimes.held_out_rmse_um, 3),
            },
        )
        return replace(output, regimes=regimes, warnings=(*output.warnings, message))
    if _gained(one, _likely_rows(one)) < LEAST_EVIDENCE:
        return output
    message = Message("warning-two_regimes", {"log": log.where})
    return replace(output, warnings=(*output.warnings, message))


def _two_valued(log: ThermalLog, step_s: float) -> Iterator[tuple[str, BoolArray]]:
    """Yield columns of two values, and where at even times each has the larger one."""
    for name, column in log.columns.items():
        values, counts = np.unique(column[~np.isnan(column)], return_counts=True)
        if values.size == 2 and counts.min() >= max(LEAST_SHARE * log.rows, 2):
            whole = held(column[:, None])[0][:, 0]
            even = even_log(ThermalLog.from_columns({name: whole}, time_s=log.time_s), step_s)
            yield name, held(even.columns[name][:, None])[0][:, 0] > values.mean()


def _gained(one: Experiment, on: BoolArray) -> float:
    """Return the evidence that lags that change have beyond all that do not. [1]"""
    names = [str(k) for k in range(one.inputs + 1)]
    regime = (on.astype(np.float64) - on[0]) * float(np.sqrt(np.nanmean(one.u**2)))
    added = Experiment(one.sample_time_s, np.column_stack([one.u, regime]), one.y)
    steady = [fit_switched(e, on, names[: e.inputs], switching=False) for e in (one, added)]
    switched = fit_switched(one, on, names[:-1])
    return switched.log_evidence - max(model.log_evidence for model in steady)


def _likely_rows(one: Experiment) -> BoolArray:
    """Return the stretches with other gains that make the log most likely.

    They show that gains change; where, they do not: as many rows are wrong as are right.
    """
    stretch = np.arange(one.y.size) * STRETCHES // one.y.size

    def gated(on: BoolArray) -> list[Experiment]:
        u = np.hstack([one.u * on[:, None], one.u * ~on[:, None]])
        return [Experiment(one.sample_time_s, u, one.y)]

    found = response_evidence(gated(stretch < STRETCHES // 2))

    def likely(on: BoolArray) -> float:
        return found.log_evidence(gated(on)) if 0 < np.count_nonzero(on) < on.size else -np.inf

    ends = [(i, j) for i in range(STRETCHES) for j in range(i + 1, STRETCHES)]
    best = max(((i <= stretch) & (stretch < j) for i, j in ends), key=likely)
    while True:
        near = max((best ^ (stretch == k) for k in range(STRETCHES)), key=likely)
        if likely(near) <= likely(best):
            return best
        best = near


def _spans(on: BoolArray) -> str:
    """Return rows as spans, the longest of many."""
    edges = np.flatnonzero(np.diff(on.astype(np.int8), prepend=0, append=0)).tolist()
    spans = sorted(zip(edges[::2], edges[1::2], strict=True), key=lambda s: s[0] - s[1])
    more = f" (+{len(spans) - _MOST_NAMED})" if len(spans) > _MOST_NAMED else ""
    return ", ".join(f"{a}..{b - 1}" for a, b in sorted(spans[:_MOST_NAMED])) + more
