"""The identified model of one displacement: gains and first-order lags of every input."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import final

import numpy as np

from thermaxis.codes import Place
from thermaxis.errors import DataError
from thermaxis.thermal._arrays import (
    FloatArray,
    frozen_array,
    recursion,
    require_sample_time,
    rows_of_inputs,
)
from thermaxis.thermal.transfer_function._roots import ComplexArray


@final
@dataclass(frozen=True, slots=True, eq=False)
class ModalPart:
    """What one input contributes: a direct gain and first-order lags side by side.

    The transfer function is direct_gain + sum of gain / (1 + time constant s), each times the
    delay. Time constants are real and positive, so the part is stable and cannot oscillate.

    Raises
    ------
    DataError
        If gains and time constants are not one each, a number is not finite, a time constant is
        not positive, or the delay is negative.
    """

    input_name: str
    direct_gain: float
    """Gain without a lag. [µm/K]"""
    gains: FloatArray
    """Gains of the lags, (j,). [µm/K]"""
    time_constants_s: FloatArray
    """Time constants of the lags, (j,). [s]"""
    delay_s: float = 0.0
    """Time that the input needs to act at all. [s]"""

    def __post_init__(self) -> None:
        """Check the numbers and freeze the arrays."""
        object.__setattr__(self, "gains", frozen_array(self.gains))
        object.__setattr__(self, "time_constants_s", frozen_array(self.time_constants_s))
        place = Place(channel=self.input_name)
        if self.gains.ndim != 1 or self.gains.shape != self.time_constants_s.shape:
            raise DataError(
                "wrong_shape",
                shape=f"{self.gains.shape}, {self.time_constants_s.shape}",
                expected="(j,), (j,)",
                place=place,
            )
        numbers = np.concatenate(
            [[self.direct_gain, self.delay_s], self.gains, self.time_constants_s]
        )
        if not bool(np.all(np.isfinite(numbers))):
            raise DataError("not_finite", place=place)
        if bool(np.any(self.time_constants_s <= 0)):
            raise DataError(
                "not_positive",
                value=float(np.min(self.time_constants_s)),
                place=place._replace(key="time_constants_s"),
            )
        if self.delay_s < 0:
            raise DataError("negative", value=self.delay_s, place=place._replace(key="delay_s"))

    @property
    def dc_gain(self) -> float:
        """What a lasting change of one kelvin does in the end. [µm/K]"""
        return float(self.direct_gain + np.sum(self.gains))


@final
@dataclass(frozen=True, slots=True, eq=False)
class ThermalModel:
    """Model of one displacement: the sum of its parts and an offset.

    References
    ----------
    Mareš and Horejš 2021, equations (1) and (2), in parallel form.
    """

    parts: tuple[ModalPart, ...]
    """One part per input, in the order of the inputs."""
    offset_um: float = 0.0
    """Displacement where every input is at its reference for long. [µm]"""

    @property
    def input_names(self) -> tuple[str, ...]:
        """Names of the inputs, in their order."""
        return tuple(part.input_name for part in self.parts)


def section_response(
    u: FloatArray, time_constant_s: float, sample_time_s: float, start: float
) -> FloatArray:
    """Return the state of one first-order lag behind a held input."""
    alpha = -np.expm1(-sample_time_s / time_constant_s)
    return recursion(1.0 - float(alpha), alpha * u[:-1], start)


def delayed(u: FloatArray, delay_s: float, sample_time_s: float) -> FloatArray:
    """Return a held input that arrives later; before it arrives it has its first value."""
    rows = min(round(delay_s / sample_time_s), u.size)
    if rows == 0:
        return u
    return np.concatenate([np.full(rows, u[0]), u[: u.size - rows]])


def _checked_inputs(model: ThermalModel, sample_time_s: float, u: FloatArray) -> FloatArray:
    require_sample_time(sample_time_s)
    values = rows_of_inputs(u, len(model.parts))
    if not bool(np.all(np.isfinite(values))):
        raise DataError("input_missing", key="u")
    return values


def simulate_modal(
    model: ThermalModel,
    sample_time_s: float,
    u: FloatArray,
    initial_state: Sequence[FloatArray] | None = None,
) -> FloatArray:
    """Return the displacement that the model gives in free run.

    Parameters
    ----------
    sample_time_s : float
        Time between rows. [s]
    u : FloatArray
        Inputs relative to their reference, (n, k), each held until the next row. [K]
    initial_state : sequence of FloatArray, optional
        States of the lags of every part at the first row, (j,) each. Default: the steady state
        of the first row. [K]

    Returns
    -------
    FloatArray
        Displacement at every row, (n,). [µm]

    Raises
    ------
    DataError
        If shapes do not fit the model, the sample time is not positive, or an input is missing.
    """
    values = _checked_inputs(model, sample_time_s, u)
    if initial_state is not None and [np.shape(x) for x in initial_state] != [
        part.gains.shape for part in model.parts
    ]:
        raise DataError(
            "wrong_shape",
            shape=str([np.shape(x) for x in initial_state]),
            expected=str([part.gains.shape for part in model.parts]),
            key="initial_state",
        )
    y = np.full(values.shape[0], model.offset_um, dtype=np.float64)
    for i, part in enumerate(model.parts):
        column = delayed(np.ascontiguousarray(values[:, i]), part.delay_s, sample_time_s)
        y += part.direct_gain * column
        for j, (gain, tau_s) in enumerate(zip(part.gains, part.time_constants_s, strict=True)):
            start = column[0] if initial_state is None else initial_state[i][j]
            y += gain * section_response(column, float(tau_s), sample_time_s, float(start))
    return y


def simulate_from_rest(model: ThermalModel, sample_time_s: float, u: FloatArray) -> FloatArray:
    """Return the displacement in free run from rest at the first row."""
    at_rest = [np.zeros_like(part.gains) for part in model.parts]
    return simulate_modal(model, sample_time_s, u, at_rest)


def step_response(model: ThermalModel, times_s: FloatArray) -> FloatArray:
    """Return what a lasting step of one kelvin does, input by input, (n, k). [µm/K]

    Times are in seconds since the step, (n,).
    """
    times = np.asarray(times_s, dtype=np.float64)
    response = np.zeros((times.size, len(model.parts)))
    for i, part in enumerate(model.parts):
        since = times - part.delay_s
        rise = -np.expm1(-np.maximum(since, 0.0)[:, None] / part.time_constants_s)
        response[:, i] = np.where(since >= 0, part.direct_gain + rise @ part.gains, 0.0)
    return response


def frequency_response(model: ThermalModel, frequencies_hz: FloatArray) -> ComplexArray:
    """Return amplitude and phase of what one kelvin of a sine does, input by input, (n, k). [µm/K]

    Frequencies are in hertz, (n,): direct gain + sum of gain / (1 + 2 pi i f tau), times the delay.
    """
    s = 2j * np.pi * np.asarray(frequencies_hz, dtype=np.float64)[:, None]
    parts = [
        (p.direct_gain + (1.0 / (1.0 + s * p.time_constants_s)) @ p.gains)
        * np.exp(-s[:, 0] * p.delay_s)
        for p in model.parts
    ]
    return np.stack(parts, axis=1)
