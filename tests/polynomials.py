"""Numerators and denominators of gains and time constants: the other way round than the product."""

from functools import reduce

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from thermaxis.thermal import (
    ModalPart,
    PolynomialModel,
    Start,
    ThermalModel,
    TransferFunction,
    simulate_polynomial,
)


def product(poles: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the product of all 1 - pole / z."""
    return reduce(np.convolve, ([1.0, -pole] for pole in poles), np.ones(1))


def transfer_function_of(part: ModalPart, sample_time_s: float) -> TransferFunction:
    """Return one fraction that is exact for an input that is held between rows."""
    poles = np.exp(-sample_time_s / part.time_constants_s)
    below = product(poles)
    above = part.direct_gain * below
    for i, (gain, tau_s) in enumerate(zip(part.gains, part.time_constants_s, strict=True)):
        above[1:] += -np.expm1(-sample_time_s / tau_s) * gain * product(np.delete(poles, i))
    delay = np.zeros(round(part.delay_s / sample_time_s))
    return TransferFunction(np.concatenate([delay, above]), below)


def polynomial_model_of(model: ThermalModel, sample_time_s: float) -> PolynomialModel:
    """Return the fraction of every part."""
    parts = tuple(transfer_function_of(part, sample_time_s) for part in model.parts)
    return PolynomialModel(model.input_names, parts, sample_time_s, model.offset_um)


def simulate_from_fitted_start(
    model: PolynomialModel, u: NDArray[np.float64], measured_um: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return the free run whose unknown past, one number per state, suits what was measured."""
    y = simulate_polynomial(model, u, start=Start.REST)
    past = [
        lfilter([1.0], part.denominator, np.eye(1, y.size, k)[0])
        for part in model.transfer_functions
        for k in range(max(part.denominator.size, part.numerator.size) - 1)
    ]
    free, known = np.stack(past, axis=1), ~np.isnan(measured_um)
    state, *_ = np.linalg.lstsq(free[known], (measured_um - y)[known], rcond=None)
    return np.asarray(y + free @ state)
