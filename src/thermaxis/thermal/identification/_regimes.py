"""Tell that gains and time constants change while a log runs, as where coolant is switched on.

The evidence of lags that change with a regime is compared with that of lags that do not, and of
the regime as one more input: what heats or cools by itself is no other time constant.
"""

from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import replace

import numpy as np

from thermaxis.codes import Message, Value
from thermaxis.errors import DataError
from thermaxis.thermal._arrays import significant
from thermaxis.thermal.identification._records import Records, even_log, has_output, records_of
from thermaxis.thermal.identification._result import IdentifiedOutput, Regimes
from thermaxis.thermal.log import Experiment, InputDefinition, ThermalLog
from thermaxis.thermal.modal import (
    BoolArray,
    ModalOptions,
    fit_switched,
    response_evidence,
    simulate_switched,
)
from thermaxis.thermal.transfer_function import ThermalModel, held

LEAST_EVIDENCE = 20.0
"""Gain of the logarithm of the evidence from which two regimes are told. Default: healthy logs of
four machines show up to 4, coolant that changes one time constant of three shows 130 to 320. [1]"""
GOOD_FIT_PERCENT = 95.0
"""A model that fits its log better has one regime. [%]"""
LEARNT_SHARE = 0.7
"""Share of the measured rows that is learnt from where the rest is simulated. [1]"""
CLEARLY_LESS = 0.8
"""Gains are told where models that switch leave so much of what one model leaves at most. [1]"""
LEAST_SHARE = 0.05
"""A regime holds in so much of the rows at least. [1]"""
STRETCHES = 16
"""Stretches of a log that are told apart where no column tells the regime. [1]"""
_MOST_ROWS = 1500
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
    reference_s: float | None,
) -> IdentifiedOutput:
    step_s = max(log.usual_step_s, log.duration_s / _MOST_ROWS)
    records = records_of(
        [log], inputs, [output.name], sample_time_s=step_s, reference_s=reference_s
    )
    (one,) = records.experiments[output.name]
    used = {log.name_of(channel) for definition in inputs for channel in definition.channels}
    columns = {name: on for name, on in _two_valued(log, step_s) if name not in used}
    gained = {name: _gained(one, on) for name, on in columns.items()}
    best = max(gained, key=gained.__getitem__, default="")
    if best and gained[best] >= LEAST_EVIDENCE:
        values = log.columns[best]
        low, high = float(np.nanmin(values)), float(np.nanmax(values))
        told = {"column": best, "low": low, "high": high, "log": log.where}
        rows = _spans(values > (low + high) / 2.0)
        said = [Message("warning-two_regimes_by", {**told, **rows})]
        found = None
        with suppress(DataError, np.linalg.LinAlgError):  # too little to learn from and to judge
            found = _judged(one, columns[best], output, [definition.name for definition in inputs])
        if found is None:
            return replace(output, warnings=(*output.warnings, *said))
        models, rmse_um, one_um = found
        regimes = Regimes(log.where, best, (low, high), models, rmse_um, one_um)
        gains = tuple(
            Message(
                "two_regimes-gains",
                {
                    "input": part.input_name,
                    "low_um_per_k": significant(part.dc_gain, 3),
                    "high_um_per_k": significant(other.dc_gain, 3),
                },
            )
            for part, other in zip(models[0].parts, models[1].parts, strict=True)
        )
        left = {"rmse_um": significant(rmse_um, 3), "one_um": significant(one_um, 3)}
        said.append(Message("warning-two_regimes_gains", {**told, "gains": gains, **left}))
        return replace(
            output,
            regimes=(*output.regimes, regimes),
            warnings=(*output.warnings, *said),
        )
    if _gained(one, _likely_rows(one)) < LEAST_EVIDENCE:
        return output
    message = Message("warning-two_regimes", {"log": log.where})
    return replace(output, warnings=(*output.warnings, message))


def _judged(
    one: Experiment, on: BoolArray, output: IdentifiedOutput, names: Sequence[str]
) -> tuple[tuple[ThermalModel, ThermalModel], float, float] | None:
    """Return models that switch, what they and what one leaves of rows held out; else None."""
    measured = np.flatnonzero(~np.isnan(one.y))
    cut = int(measured[int(LEARNT_SHARE * measured.size)])
    part = replace(one, u=one.u[:cut], y=one.y[:cut], ambient_k=None)
    left: list[float] = []
    for switching in (True, False):
        learnt = fit_switched(part, on[:cut], names, switching=switching).models
        rest = one.y - simulate_switched(learnt, one.sample_time_s, held(one.u)[0], on)
        left.append(float(np.sqrt(np.nanmean((rest[cut:] - np.nanmean(rest[:cut])) ** 2))))
    if output.held_out is not None and output.held_out.what.code == "held_out-later_part":
        left.append(output.held_out.rmse_um["model"])
    if left[0] > CLEARLY_LESS * min(left[1:]):
        return None
    return fit_switched(one, on, names).models, left[0], left[1]


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
    added = replace(one, u=np.column_stack([one.u, regime]), ambient_k=None)
    without = [fit_switched(e, on, names[: e.inputs], switching=False) for e in (one, added)]
    switched = fit_switched(one, on, names[:-1]).log_evidence
    return switched - max(each.log_evidence for each in without)


def _likely_rows(one: Experiment) -> BoolArray:
    """Return the stretches with other gains that make the log most likely.

    They show that gains change; where, they do not: as many rows are wrong as are right.
    """
    stretch = np.arange(one.y.size) * STRETCHES // one.y.size
    early, each = stretch[:, None] < STRETCHES // 2, np.arange(STRETCHES)
    halves = replace(one, u=np.hstack([one.u * early, one.u * ~early]), ambient_k=None)
    gated = response_evidence([halves], ModalOptions(intervals=False)).gated(one, stretch)

    def likely(on: BoolArray) -> float:
        return gated(on) if 0 < np.count_nonzero(on) < STRETCHES else -np.inf

    ends = [(i, j) for i in range(STRETCHES) for j in range(i + 1, STRETCHES)]
    best = max(((i <= each) & (each < j) for i, j in ends), key=likely)
    while True:
        near = max((best ^ (each == k) for k in range(STRETCHES)), key=likely)
        if likely(near) <= likely(best):
            return best[stretch]
        best = near


def _spans(on: BoolArray) -> dict[str, Value]:
    """Return how many stretches there are, and rows of the longest."""
    edges = np.flatnonzero(np.diff(on.astype(np.int8), prepend=0, append=0)).tolist()
    spans = sorted(zip(edges[::2], edges[1::2], strict=True), key=lambda s: s[0] - s[1])
    longest = sorted(spans[:_MOST_NAMED])
    rows = tuple(Message("two_regimes-rows", {"first": a, "last": b - 1}) for a, b in longest)
    return {"rows": rows, "stretches": len(spans)}
