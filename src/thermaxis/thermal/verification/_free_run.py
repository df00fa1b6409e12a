"""A model in free run along a log: row by row through `model_step`, as `cycle` does."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import final

import numpy as np
from numpy.typing import NDArray

from thermaxis.compensation import (
    STATED,
    CompensationModel,
    Outcome,
    Quality,
    Reading,
    initial_state,
    model_step,
)
from thermaxis.thermal._arrays import FloatArray
from thermaxis.thermal.log import ThermalLog

REFERENCE_S = 60.0
"""Relative coordinates refer to the mean of this first time of a log. [s]"""


@final
@dataclass(frozen=True, slots=True, eq=False)
class SimulatedOutput:
    """An output of the model in free run along a log."""

    displacement_um: FloatArray
    """Displacement, (n,); NaN before the model could start. [µm]"""
    contribution_um: FloatArray
    """What every part contributes, (n, parts). [µm]"""
    parts: tuple[str, ...]
    """Names of the parts."""


@final
@dataclass(frozen=True, slots=True, eq=False)
class SimulatedLog:
    """A model in free run along a log."""

    time_s: FloatArray
    """Times, (n,). [s]"""
    outputs: Mapping[str, SimulatedOutput]
    """Outputs by name."""
    outside: Mapping[str, tuple[float, float]]
    """For inputs that left their training range: share of the rows, and by how much at most,
    relative to the width of the range."""
    bad: NDArray[np.bool_]
    """Rows in which an input had failed for too long, (n,)."""
    outcomes: Mapping[Outcome, int]
    """How often something was out of the ordinary."""

    @property
    def bad_share(self) -> float:
        """Share of the rows in which an input had failed for too long. [1]"""
        return float(np.mean(self.bad))


def references_of(
    model: CompensationModel, log: ThermalLog, reference_s: float
) -> dict[str, float]:
    """Return the mean of every channel over the first time of the log."""
    if model.reference == STATED:
        return dict(model.reference_c)
    first = log.time_s <= reference_s
    found: dict[str, float] = {}
    for channel, column in zip(model.channels, model_columns(model, log), strict=True):
        values = column[first]
        present = values[~np.isnan(values)]
        if present.size:
            found[channel] = float(np.mean(present))
    return found


def simulate_log(
    model: CompensationModel,
    log: ThermalLog,
    *,
    diameter_mm: float | None = None,
    reference_s: float = REFERENCE_S,
) -> SimulatedLog:
    """Run a model along a log, row by row through `model_step`, as `cycle` does.

    Parameters
    ----------
    model : CompensationModel
        The model.
    log : ThermalLog
        The log; it needs every channel of the model.
    diameter_mm : float, optional
        Clamping diameter of the workpiece. Default: the tool centre point. [mm]
    reference_s : float
        References are the mean of this first time of the log, unless the model states them.
        Default: the first minute. [s]

    Returns
    -------
    SimulatedLog
        Displacement and contributions, one row per row of the log.

    Raises
    ------
    DataError
        If the log lacks a channel of the model.

    References
    ----------
    Mareš and Horejš 2021, equations (3) and (8).
    """
    columns = model_columns(model, log)
    names = model.channels
    state = initial_state(model, references_of(model, log, reference_s))
    said: list[tuple[float, ...]] = []
    shares: list[tuple[tuple[float, ...], ...]] = []
    waiting: list[bool] = []
    bad: list[bool] = []
    outcomes: dict[Outcome, int] = {}
    table = np.stack(columns, axis=1).tolist()
    for time_s, row in zip(log.time_s.tolist(), table, strict=True):
        reading = Reading(time_s, dict(zip(names, row, strict=True)), diameter_mm)
        state, output = model_step(model, state, reading)
        said.append(output.model_um)
        shares.append(output.contribution_um)
        waiting.append(state.time_s is None)
        if output.outcomes:
            for outcome in output.outcomes:
                outcomes[outcome] = outcomes.get(outcome, 0) + 1
        bad.append(output.quality is Quality.BAD)
    displacement = np.array(said)
    displacement[np.array(waiting)] = np.nan
    outputs = {
        output.name: SimulatedOutput(
            displacement[:, o],
            np.array([row[o] for row in shares]),
            tuple(part.name for part in output.parts),
        )
        for o, output in enumerate(model.outputs)
    }
    return SimulatedLog(
        time_s=log.time_s,
        outputs=outputs,
        outside=_outside(model, log, reference_s),
        bad=np.array(bad, dtype=np.bool_),
        outcomes=outcomes,
    )


def model_columns(model: CompensationModel, log: ThermalLog) -> list[FloatArray]:
    """Return the channels of the model, temperatures in degC whatever the log's unit."""
    return [log.plain_column(channel) for channel in model.channels]


def _outside(
    model: CompensationModel, log: ThermalLog, reference_s: float
) -> dict[str, tuple[float, float]]:
    """Return which inputs leave their training range, how often and by how much."""
    reference = references_of(model, log, reference_s)
    relative = {
        channel: values - reference.get(channel, np.nan)
        for channel, values in zip(model.channels, model_columns(model, log), strict=True)
    }
    found: dict[str, tuple[float, float]] = {}
    for output in model.outputs:
        for part in output.parts:
            if part.lowest_k is None or part.highest_k is None:
                continue
            u = relative[part.plus] - (relative[part.minus] if part.minus else 0.0)
            beyond = np.maximum(part.lowest_k - u, u - part.highest_k)
            share = float(np.mean(beyond > 0))
            if share > 0:
                width = max(part.highest_k - part.lowest_k, 1e-9)
                known = found.get(part.name, (0.0, 0.0))
                far = float(np.nanmax(beyond)) / width
                found[part.name] = (max(share, known[0]), max(far, known[1]))
    return found
