"""Touches that are no measurement of the machine are left out of what a model is learnt from."""

from dataclasses import replace

import numpy as np

from thermaxis.codes import Message, Place
from thermaxis.thermal._arrays import FloatArray
from thermaxis.thermal.identification._records import Records, has_output, records_of
from thermaxis.thermal.log import ThermalLog
from thermaxis.thermal.verification import far_message, far_touches

_EARLIER, _MOST_NAMED = 0.01, 8


def without_far_touches(records: Records) -> tuple[Records, dict[str, tuple[Message, ...]]]:
    """Return records without far touches, and what was left out or moved, by output."""
    said: dict[str, tuple[Message, ...]] = {}
    logs = list(records.logs)
    for name, experiments in records.experiments.items():
        own = [k for k, log in enumerate(logs) if has_output(log, name)]
        for number, one in zip(own, experiments, strict=True):
            rows = np.flatnonzero(~np.isnan(one.y))
            even_s: FloatArray = one.sample_time_s * np.arange(one.y.size, dtype=np.float64)
            chips, moves = far_touches(even_s, one.u, one.y)
            if not chips and not moves:
                continue
            log, column = logs[number], logs[number].name_of(name)
            row = np.floor(log.time_s / one.sample_time_s + _EARLIER)
            values = log.column(name, unit="um").copy()
            values[np.isin(row, rows[list(chips)])] = np.nan
            for k, um in moves.items():
                values[row >= rows[k]] -= um
            columns, units = {**log.columns, column: values}, {**log.units, column: "um"}
            logs[number] = replace(log, columns=columns, units=units)
            told = _messages(log, "touches_excluded", even_s[rows], chips)
            told += _messages(log, "datum_moved", even_s[rows], moves)
            said[name] = said.get(name, ()) + told
    if not said:
        return records, said
    cleaned = records_of(
        logs,
        records.inputs,
        list(records.experiments),
        sample_time_s=records.sample_time_s,
        reference_s=records.reference_s,
    )
    return cleaned, said


def _messages(
    log: ThermalLog, code: str, time_s: FloatArray, far: dict[int, float]
) -> tuple[Message, ...]:
    """Return a message that names touches with their times, or none."""
    first = sorted(far.items())[:_MOST_NAMED]
    named = tuple(far_message(log, float(time_s[k]), um) for k, um in first)
    values = {"count": len(far), "touches": named}
    return (Message(f"warning-{code}", values, Place(log.where)),) if far else ()
