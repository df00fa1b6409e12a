"""From logs to experiments, and from an identified model to one that may run on the machine."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import final

import numpy as np

from thermaxis.compensation import (
    CompensationModel,
    Output,
    Part,
    Provenance,
    Section,
)
from thermaxis.errors import DataError
from thermaxis.thermal._arrays import FloatArray
from thermaxis.thermal.log import (
    REFERENCE_S,
    Experiment,
    InputDefinition,
    LogLike,
    ThermalLog,
    as_thermal_logs,
    evaluate_input,
    even_step_s,
    start_of_input,
)
from thermaxis.thermal.transfer_function import ThermalModel

SHORTEST_HOLD_S = 60.0
"""An input that fails is held so long at least. [s]"""
SHORTEST_GAP_S = 3600.0
"""After a longer gap the model starts anew; ten holds where they are longer. [s]"""
HELD_STEPS = 3.0
"""An input that fails is held for so many of the usual steps of the slowest channel. [1]"""
_UNEVEN = 1e-6


@final
@dataclass(frozen=True, slots=True, eq=False)
class Records:
    """Logs as experiments, by output, with what a model must remember of them."""

    experiments: Mapping[str, tuple[Experiment, ...]]
    """Experiments by output, in the order of the logs; a log without the output has none."""
    inputs: tuple[InputDefinition, ...]
    """The inputs, in the order of the columns of every experiment."""
    sample_time_s: float
    """Sample time of the experiments. [s]"""
    reference_c: Mapping[str, float]
    """References of the channels, of the first log. [degC]"""
    input_step_s: float
    """Longest usual time between two values of an input's channels, over all logs. [s]"""
    left_out: tuple[str, ...]
    """Logs that have none of the outputs and serve no experiment, by name."""
    lowest_k: FloatArray
    """Lowest value of every input over all logs, (k,). [K]"""
    highest_k: FloatArray
    """Highest value, (k,). [K]"""
    logs: tuple[ThermalLog, ...]
    """The logs themselves: figures are those of the written model's free run along them."""
    reference_s: float | None
    """As of `ThermalLog.start_of`. [s]"""


def records_of(
    logs: LogLike | Sequence[LogLike],
    inputs: Sequence[InputDefinition],
    outputs: Sequence[str],
    *,
    sample_time_s: float | None = None,
    reference_s: float | None = None,
) -> Records:
    """Return logs as experiments in relative coordinates.

    Channels of every log are taken relative to `ThermalLog.start_of`. A channel that every input
    is taken relative to is the ambient of the experiments.

    Parameters
    ----------
    logs : ThermalLog or frame, or a sequence of such
        As of `as_thermal_log`.
    sample_time_s : float, optional
        Means over so much time are taken first; means of both sides of a linear model leave the
        model as it is. Default: the usual step of the logs, or that of bursts of rows. [s]
    reference_s : float, optional
        The first time, as of `ThermalLog.start_of`. [s]

    Raises
    ------
    DataError
        If there is no log, one lacks a channel, or no log has an output.

    References
    ----------
    Mareš and Horejš 2021, section 3.2 (relative coordinates).
    """
    logs = as_thermal_logs(logs)
    if not logs:
        raise DataError("no_log", key="logs")
    step_s = sample_time_s or float(np.median([even_step_s(log.time_s) for log in logs]))
    found: dict[str, list[Experiment]] = {output: [] for output in outputs}
    lowest, highest = np.full(len(inputs), np.inf), np.full(len(inputs), -np.inf)
    left_out: list[str] = []
    references = {definition.minus for definition in inputs}
    for log in logs:
        rises = [evaluate_input(log, d) - start_of_input(log, d, reference_s) for d in inputs]
        u = np.stack(rises, axis=1)
        lowest = np.fmin(lowest, np.nanmin(u, axis=0))
        highest = np.fmax(highest, np.nanmax(u, axis=0))
        names = [output for output in found if has_output(log, output)]
        if not names:
            left_out.append(log.where)
            continue
        columns = {f"u{k}": u[:, k] for k in range(len(inputs))}
        if len(references) == 1 and (reference := next(iter(references))) is not None:
            ambient = log.column(reference)
            columns["ambient"] = ambient - log.start_of(ambient, reference_s)
        for name in names:
            y = log.column(name, unit="um")
            columns[f"y {name}"] = y - log.start_of(y, reference_s)
        even = even_log(ThermalLog.from_columns(columns, time_s=log.time_s, name=log.name), step_s)
        inputs_even = np.stack([even.columns[f"u{k}"] for k in range(len(inputs))], axis=1)
        ambient_even = even.columns.get("ambient")
        for name in names:
            y = even.columns[f"y {name}"]
            first_s = reference_s or REFERENCE_S
            one = Experiment(step_s, inputs_even, y, log.name, ambient_even, first_s)
            found[name].append(one)
    for output, experiments in found.items():
        if not experiments:
            raise DataError(
                "output_never_measured",
                output=output,
                channels=tuple(
                    [name for name in logs[0].columns if has_output(logs[0], name)][:12]
                ),
                file=", ".join(log.where for log in logs[:3]),
            )
    return Records(
        experiments={output: tuple(experiments) for output, experiments in found.items()},
        inputs=tuple(inputs),
        sample_time_s=step_s,
        input_step_s=max(usual_step_of(log, inputs) for log in logs),
        left_out=tuple(left_out),
        reference_c=_references(logs[0], inputs, reference_s),
        lowest_k=lowest,
        highest_k=highest,
        logs=tuple(logs),
        reference_s=reference_s,
    )


def has_output(log: ThermalLog, output: str) -> bool:
    """Whether a log has a channel that was measured at least once."""
    names = [name for name in log.columns if name.casefold() == output.casefold()]
    return any(not bool(np.all(np.isnan(log.columns[name]))) for name in names)


def even_log(log: ThermalLog, step_s: float) -> ThermalLog:
    """Return the log at even times of the wanted step; as it is where it has them already."""
    steps = np.diff(log.time_s)
    if steps.size and bool(np.all(np.abs(steps - step_s) <= _UNEVEN * step_s)):
        return log
    return log.resample(step_s)


def usual_step_of(log: ThermalLog, inputs: Sequence[InputDefinition]) -> float:
    """Return the median time from value to value of the slowest of the inputs' channels. [s]

    0 where no channel has two values.
    """
    steps = [0.0]
    for definition in inputs:
        for channel in definition.channels:
            measured = ~np.isnan(log.columns[log.name_of(channel)])
            if int(np.count_nonzero(measured)) > 1:
                steps.append(float(np.median(np.diff(log.time_s[measured]))))
    return max(steps)


def _references(
    log: ThermalLog, inputs: Sequence[InputDefinition], reference_s: float | None
) -> dict[str, float]:
    channels = [channel for definition in inputs for channel in definition.channels]
    found = {c: log.start_of(log.plain_column(c), reference_s) for c in channels}
    return {channel: value for channel, value in found.items() if not np.isnan(value)}


def compensation_model(
    models: Mapping[str, ThermalModel],
    records: Records,
    *,
    static_gains_um_per_k: Mapping[str, FloatArray] | None = None,
    provenance: Provenance | None = None,
    warnings: Sequence[str] = (),
) -> CompensationModel:
    """Return identified models, by output, as one that may run on the machine.

    Parts are found among the inputs of the records by their names. An input is held for three usual
    steps of the slowest channel (a minute at least), delays are rounded to the sample time, and
    every input has the range that it had in the logs. Limits belong to a machine, not to its model.
    The gains of the static regression, by output and one per input, are the baseline of a
    verification.
    """
    definitions = {definition.name: k for k, definition in enumerate(records.inputs)}
    slowest_s = HELD_STEPS * max(records.sample_time_s, records.input_step_s)
    outputs: list[Output] = []
    for name, model in models.items():
        parts: list[Part] = []
        for part in model.parts:
            k = definitions[part.input_name]
            definition = records.inputs[k]
            static = (static_gains_um_per_k or {}).get(name)
            parts.append(
                Part(
                    name=definition.name,
                    plus=definition.plus,
                    minus=definition.minus or "",
                    direct_gain_um_per_k=float(part.direct_gain),
                    sections=tuple(
                        Section(float(gain), float(tau))
                        for gain, tau in zip(part.gains, part.time_constants_s, strict=True)
                    ),
                    delay_s=round(part.delay_s / records.sample_time_s) * records.sample_time_s,
                    lowest_k=float(records.lowest_k[k]),
                    highest_k=float(records.highest_k[k]),
                    static_gain_um_per_k=None if static is None else float(static[k]),
                )
            )
        outputs.append(Output(name, tuple(parts), float(model.offset_um)))
    return CompensationModel(
        outputs=tuple(outputs),
        sample_time_s=records.sample_time_s,
        longest_hold_s=max(SHORTEST_HOLD_S, slowest_s),
        longest_gap_s=max(SHORTEST_GAP_S, 10.0 * slowest_s),
        reference_c=records.reference_c,
        provenance=provenance or Provenance(),
        warnings=tuple(warnings),
    )
