"""Numerator and denominator to gains and time constants and back."""

from dataclasses import dataclass
from math import fsum, log
from typing import final

import numpy as np

from thermaxis.codes import Place
from thermaxis.errors import DataError
from thermaxis.thermal._arrays import FloatArray, frozen_array, require_sample_time
from thermaxis.thermal.transfer_function._polynomial_model import (
    PolynomialModel,
    TransferFunction,
)
from thermaxis.thermal.transfer_function._roots import (
    ComplexArray,
    distances_from_one,
    lags_among,
)
from thermaxis.thermal.transfer_function._thermal_model import ModalPart, ThermalModel

FOLDED_ROWS = 3.0
"""A mode that is no lag goes into the direct gain if it falls to 1/e within so many rows: the
printed pairs of the paper do, in 1.02 and 2.56. [row]"""
SAME_POLE = 1e-7
"""Poles that are closer than this share of their distance from one count as a double pole. [1]"""


@final
@dataclass(frozen=True, slots=True)
class OtherMode:
    """A mode that is no lag: a complex pair, a negative pole, or one that does not decay."""

    pole: complex
    """Pole in z; of a pair the one with positive imaginary part. [1]"""
    gain: complex
    """Gain of c (1 - p) / (z - p); a pair contributes this and its conjugate. [µm/K]"""

    @property
    def pair(self) -> bool:
        """Whether the mode is a complex pair."""
        return self.pole.imag != 0.0

    @property
    def modulus(self) -> float:
        """Distance of the pole from zero: what remains from one row to the next. [1]"""
        return abs(self.pole)

    @property
    def dc_gain(self) -> float:
        """What the mode contributes to the DC gain. [µm/K]"""
        return (2.0 if self.pair else 1.0) * self.gain.real


@final
@dataclass(frozen=True, slots=True, eq=False)
class ModalForm:
    """A transfer function as parallel modes, nothing left out.

    y(k) = direct_gain u(k) + sum of gain x(k) + other modes + sum of late_gains[i] u(k - 1 - i),
    everything after the delay.
    """

    sample_time_s: float
    """Time between rows. [s]"""
    direct_gain: float
    """Gain without a lag. [µm/K]"""
    gains: FloatArray
    """Gains of the lags, (j,), slowest first. [µm/K]"""
    time_constants_s: FloatArray
    """Their time constants, (j,). [s]"""
    other_modes: tuple[OtherMode, ...]
    """Modes that are no lags."""
    late_gains: FloatArray
    """Gains of u(k - 1), u(k - 2), ... where the numerator is longer than the denominator.
    [µm/K]"""
    delay_rows: int
    """Delay. [row]"""

    @property
    def dc_gain(self) -> float:
        """Sum of all gains. [µm/K]"""
        others = sum(mode.dc_gain for mode in self.other_modes)
        return self.direct_gain + fsum(self.gains) + fsum(self.late_gains) + others

    @property
    def stable(self) -> bool:
        """Whether every mode decays."""
        return all(mode.modulus < 1.0 for mode in self.other_modes)


def modal_form(transfer_function: TransferFunction, sample_time_s: float) -> ModalForm:
    """Decompose a transfer function into parallel modes.

    Parameters
    ----------
    sample_time_s : float
        Time between rows for which they hold. [s]

    Returns
    -------
    ModalForm
        Lags for poles between 0 and 1; complex pairs, negative poles and poles that do not decay
        are reported as such.

    Raises
    ------
    DataError
        If the sample time is not positive, two poles coincide, or a pole lies at z = 1.

    Notes
    -----
    Poles are found as their distances from one, so slow ones keep their digits.
    """
    require_sample_time(sample_time_s)
    b0 = transfer_function.denominator[0]
    below = _without_zeros_at_end(transfer_function.denominator) / b0
    above = _without_zeros_at_end(transfer_function.numerator) / b0
    order = below.size - 1
    delay, above = _split_delay(above, order)
    above, late = _split_late_gains(above, below)
    direct = float(above[0])
    rest = np.zeros(max(order, 1))
    padded = np.zeros(order + 1)
    padded[: above.size] = above
    rest[:order] = (padded - direct * below)[1:]
    gains, distances = _mode_gains(rest, below)
    is_lag = lags_among(distances)
    others = tuple(
        OtherMode(pole=complex(1.0 - w), gain=complex(c))
        for w, c in zip(distances[~is_lag], gains[~is_lag], strict=True)
        if w.imag <= 0.0  # of a pair the pole with positive imaginary part
    )
    return ModalForm(
        sample_time_s=sample_time_s,
        direct_gain=direct,
        gains=frozen_array(gains[is_lag].real),
        time_constants_s=frozen_array(-sample_time_s / np.log1p(-distances[is_lag].real)),
        other_modes=others,
        late_gains=frozen_array(late),
        delay_rows=delay,
    )


def _without_zeros_at_end(coefficients: FloatArray) -> FloatArray:
    nonzero = np.flatnonzero(coefficients)
    return coefficients[: int(nonzero[-1]) + 1] if nonzero.size else coefficients[:1]


def _split_delay(above: FloatArray, order: int) -> tuple[int, FloatArray]:
    """Take leading zeros off a numerator; one may stay where lags without direct gain have it."""
    nonzero = np.flatnonzero(above)
    leading = int(nonzero[0]) if nonzero.size else 0
    if leading == 0:
        return 0, above
    short = above[leading:]
    if short.size <= order:
        return leading - 1, above[leading - 1 :]
    return leading, short


def _split_late_gains(above: FloatArray, below: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Divide off what makes the numerator longer than the denominator."""
    excess = above.size - below.size
    if excess <= 0:
        return above, np.zeros(0)
    left, late = above.copy(), np.zeros(excess)
    for i in range(excess, 0, -1):
        late[i - 1] = left[i + below.size - 1] / below[-1]
        left[i : i + below.size] -= late[i - 1] * below
    return left[: below.size], late


def _mode_gains(rest: FloatArray, below: FloatArray) -> tuple[ComplexArray, ComplexArray]:
    """Return c of every c (1 - p) / (z - p) and the distances 1 - p, slowest first."""
    distances = distances_from_one(below)
    order = distances.size
    if order == 0:
        return np.zeros(0, dtype=np.complex128), distances
    if bool(np.any(distances == 0.0)):
        raise DataError("pole_at_one", key="denominator")
    gaps = distances[None, :] - distances[:, None]  # p_i - p_j
    np.fill_diagonal(gaps, 1.0)
    nearest = np.abs(gaps) + np.where(np.eye(order, dtype=bool), np.inf, 0.0)
    if bool(np.any(nearest < SAME_POLE * np.abs(distances)[:, None])):
        raise DataError("poles_coincide", key="denominator")
    values = _at_distances(rest, distances)
    return values / (distances * np.prod(gaps, axis=1)), distances


def _at_distances(coefficients: FloatArray, distances: ComplexArray) -> ComplexArray:
    """Return a polynomial in falling powers of z at z = 1 - w, without cancellation near one."""
    derived = np.asarray(coefficients, dtype=np.float64)
    value = np.zeros(distances.size, dtype=np.complex128)
    power = np.ones(distances.size, dtype=np.complex128)
    for _ in range(coefficients.size):
        value = value + fsum(derived) * power
        power = -power * distances
        derived = np.cumsum(derived)[:-1]  # synthetic division by z - 1
    return value


def modal_part(form: ModalForm, input_name: str) -> ModalPart:
    """Return direct gain and lags of a modal form.

    A mode that is no lag is gone within a few rows and goes into the direct gain, or lags side by
    side cannot carry it: a DataError with the code ``pole_unstable`` or ``mode_no_lag``.
    """
    place = Place(channel=input_name)
    if not form.stable:
        worst = max(mode.modulus for mode in form.other_modes)
        raise DataError("pole_unstable", modulus=worst, place=place)
    lasting = [("late", float(form.late_gains.size))]
    for mode in form.other_modes:
        rows = -1.0 / log(mode.modulus) if mode.modulus else 0.0
        lasting.append(("oscillates" if mode.pair else "alternates", rows))
    what, rows = max(lasting, key=lambda mode: mode[1])
    if rows > FOLDED_ROWS:
        lasts_s = rows * form.sample_time_s
        raise DataError("mode_no_lag", what=what, rows=rows, lasts_s=lasts_s, place=place)
    folded = fsum(mode.dc_gain for mode in form.other_modes) + fsum(form.late_gains)
    return ModalPart(
        input_name=input_name,
        direct_gain=form.direct_gain + folded,
        gains=form.gains,
        time_constants_s=form.time_constants_s,
        delay_s=form.delay_rows * form.sample_time_s,
    )


def equivalent_part(
    transfer_function: TransferFunction, sample_time_s: float, input_name: str
) -> ModalPart:
    """Return direct gain and lags that do what a transfer function does at a sample time.

    Errors and what other modes become are those of `modal_form` and `modal_part`.
    """
    return modal_part(modal_form(transfer_function, sample_time_s), input_name)


def thermal_model_of(model: PolynomialModel) -> ThermalModel:
    """Return direct gains and lags that do what numerators and denominators do, as `modal_part`."""
    return ThermalModel(
        parts=tuple(
            equivalent_part(part, model.sample_time_s, name)
            for name, part in zip(model.input_names, model.transfer_functions, strict=True)
        ),
        offset_um=model.offset_um,
    )
