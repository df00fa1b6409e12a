"""What an identified model says along its training records: free run, parts, what is left over."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import final

import numpy as np

from thermaxis.errors import DataError
from thermaxis.messages import sentence_of
from thermaxis.positioning import FloatArray
from thermaxis.thermal import (
    IdentifiedOutput,
    Linearity,
    Records,
    ResidualAnalysis,
    ThermalModel,
    analyse_residuals,
    check_linearity,
    simulate_from_rest,
)
from thermaxis.thermal.log import block_means
from thermaxis.thermal.transfer_function import held

_ANALYSED_ROWS = 400
"""Means of a record on which residuals are analysed: 25 lags of them are a sixteenth of it. [1]"""


@final
@dataclass(frozen=True, slots=True, eq=False)
class FittedExperiment:
    """A model along one training record."""

    name: str
    """Name of the record."""
    time_s: FloatArray
    """Times, (n,). [s]"""
    measured_um: FloatArray
    """Displacement, (n,); NaN where not measured. [µm]"""
    simulated_um: FloatArray
    """Free run, (n,). [µm]"""
    contributions_um: Mapping[str, FloatArray]
    """Contribution by input, (n,) each. [µm]"""
    inputs: FloatArray
    """The model's inputs, missing ones held, (n, k). [K]"""

    @property
    def residual_um(self) -> FloatArray:
        """Measured minus simulated, (n,). [µm]"""
        return self.measured_um - self.simulated_um


def input_names_of(output: IdentifiedOutput) -> tuple[str, ...]:
    """Return the inputs of a model, in its order; none where it is not stable."""
    if output.model is not None:
        return output.model.input_names
    return () if output.polynomials is None else tuple(output.polynomials.model.input_names)


def fitted_experiments(output: IdentifiedOutput, records: Records) -> tuple[FittedExperiment, ...]:
    """Return the free run of a stable model along each of its records."""
    model = output.model
    if model is None:
        return ()
    names = [definition.name for definition in records.inputs]
    columns = [names.index(name) for name in model.input_names]
    found: list[FittedExperiment] = []
    for experiment in records.experiments[output.name]:
        u, _ = held(experiment.u[:, columns])
        step_s = experiment.sample_time_s
        parts = {
            part.input_name: simulate_from_rest(ThermalModel((part,)), step_s, u[:, [k]])
            for k, part in enumerate(model.parts)
        }
        found.append(
            FittedExperiment(
                name=experiment.name,
                time_s=np.arange(experiment.y.size) * np.float64(step_s),
                measured_um=experiment.y,
                simulated_um=np.sum(list(parts.values()), axis=0) + model.offset_um,
                contributions_um=parts,
                inputs=u,
            )
        )
    return tuple(found)


@final
@dataclass(frozen=True, slots=True, eq=False)
class Leftover:
    """Residual analysis of one output."""

    analysis: ResidualAnalysis
    """Correlations and their bands."""
    step_s: float
    """Means over so much time were analysed. [s]"""


def leftover_of(experiments: Sequence[FittedExperiment]) -> Leftover | str:
    """Analyse what a model left over, on means of its records."""
    longest = max(experiment.time_s.size for experiment in experiments)
    block = max(1, longest // _ANALYSED_ROWS)
    step_s = block * float(experiments[0].time_s[1] - experiments[0].time_s[0])
    residuals: list[FloatArray] = []
    inputs: list[FloatArray] = []
    for experiment in experiments:
        numbers = np.arange(experiment.time_s.size, dtype=np.int64) // block
        blocks = int(numbers[-1]) + 1
        residuals.append(block_means(experiment.residual_um, numbers, blocks))
        columns = [block_means(column, numbers, blocks) for column in experiment.inputs.T]
        inputs.append(np.stack(columns, axis=1))
    try:
        return Leftover(analyse_residuals(residuals, inputs), step_s)
    except DataError as error:
        return sentence_of(error.message).rstrip(".")


def linearity_of(
    output: IdentifiedOutput, records: Records, experiments: Sequence[FittedExperiment]
) -> Linearity | str:
    """Compare the gains in heating and in cooling."""
    try:
        return check_linearity(
            records.experiments[output.name], [e.simulated_um for e in experiments]
        )
    except DataError as error:
        return sentence_of(error.message).rstrip(".")
