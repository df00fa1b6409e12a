"""Transfer functions of the paper, with numerator a and denominator b, and their simulation."""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from math import fsum
from typing import final

import numpy as np

from thermaxis.codes import Message
from thermaxis.errors import DataError
from thermaxis.thermal._arrays import (
    FloatArray,
    frozen_array,
    require_sample_time,
    rows_of_inputs,
)
from thermaxis.thermal.log import Experiment
from thermaxis.thermal.transfer_function._cascade import filtered, output_of
from thermaxis.thermal.transfer_function._roots import ComplexArray, distances_from_one

MOST_COEFFICIENTS = 64
"""Largest number of coefficients of a numerator or denominator. [1]"""


class Start(StrEnum):
    """What is known of the time before the first row."""

    STEADY = "steady"
    """The inputs were for long what they are in the first row."""
    REST = "rest"
    """Inputs and displacement were zero: the paper's relative coordinates."""
    FREE = "free"
    """Nothing: the initial state is estimated, or fitted to the measured displacement."""


@final
@dataclass(frozen=True, slots=True, eq=False)
class TransferFunction:
    """A discrete transfer function: numerator a_0 ... a_n over denominator b_0 ... b_m.

    Ljung writes B for this numerator and A (ARX) or F (output error) for this denominator. A
    delay is leading zeros of the numerator.

    Raises
    ------
    DataError
        If a coefficient is not finite, b_0 is zero, or one of both has no or more than 64
        coefficients.

    References
    ----------
    Mareš and Horejš 2021, equation (2).
    """

    numerator: FloatArray
    """a_0 ... a_n, (n + 1,). [µm/K times the unit of b]"""
    denominator: FloatArray
    """b_0 ... b_m, (m + 1,). [1]"""

    def __post_init__(self) -> None:
        """Check the coefficients and freeze them."""
        object.__setattr__(self, "numerator", frozen_array(self.numerator))
        object.__setattr__(self, "denominator", frozen_array(self.denominator))
        for name, values in (("numerator", self.numerator), ("denominator", self.denominator)):
            if values.ndim != 1 or not 1 <= values.size <= MOST_COEFFICIENTS:
                raise DataError(
                    "wrong_shape",
                    shape=str(values.shape),
                    expected=f"(1,) to ({MOST_COEFFICIENTS},)",
                    key=name,
                )
            if not bool(np.all(np.isfinite(values))):
                raise DataError("not_finite", key=name)
        if self.denominator[0] == 0.0:
            raise DataError("leading_coefficient_zero", key="denominator")

    @property
    def dc_gain(self) -> float:
        """Sum of a over sum of b; infinite where the sum of b is zero. [µm/K]"""
        above, below = fsum(self.numerator), fsum(self.denominator)
        return above / below if below != 0.0 else float(np.copysign(np.inf, above))

    @property
    def distances_from_one(self) -> ComplexArray:
        """One minus each pole, slowest first, (m,). [1]"""
        return distances_from_one(self.denominator)

    @property
    def poles(self) -> ComplexArray:
        """Roots of the denominator in z, slowest first, (m,). [1]"""
        return 1.0 - self.distances_from_one

    @property
    def zeros(self) -> ComplexArray:
        """Roots of the numerator in z, with those at z = 0, (<= max(n, m),). [1]"""
        nonzero = np.flatnonzero(self.numerator)
        if nonzero.size == 0:
            return np.zeros(0, dtype=np.complex128)
        last = int(nonzero[-1])
        roots = 1.0 - distances_from_one(self.numerator[nonzero[0] : last + 1])
        poles_elsewhere = int(np.flatnonzero(self.denominator)[-1])
        at_origin = max(poles_elsewhere - last, 0)
        return np.concatenate([roots, np.zeros(at_origin, dtype=np.complex128)])

    @property
    def stable(self) -> bool:
        """Whether every pole lies inside the unit circle."""
        return bool(np.all(np.abs(self.poles) < 1.0))

    def time_constants_s(self, sample_time_s: float) -> FloatArray:
        """Return the time constant of every pole by its modulus, slowest first, (m,). [s]

        Infinite for a pole on or outside the unit circle, 0 for one at z = 0.
        """
        w = self.distances_from_one
        # |z|^2 = 1 - 2 Re w + |w|^2, which keeps the digits of a slow pole
        with np.errstate(divide="ignore"):
            rate = -0.5 * np.log1p(np.maximum(-2.0 * w.real + np.abs(w) ** 2, -1.0))
            return np.where(rate > 0, sample_time_s / rate, np.inf)


def simulate_transfer_function(
    transfer_function: TransferFunction,
    u: FloatArray,
    *,
    past_u: Sequence[float] | FloatArray = (),
    past_y: Sequence[float] | FloatArray = (),
) -> FloatArray:
    """Return the displacement by the difference equation of the paper.

    Parameters
    ----------
    transfer_function : TransferFunction
        Numerator a and denominator b; b_0 need not be one.
    u : FloatArray
        Input relative to its reference, (n,). [K]
    past_u : sequence of float
        Inputs before the first row, newest first. Default: zero. [K]
    past_y : sequence of float
        Displacements before the first row, newest first. Default: zero. [µm]

    Returns
    -------
    FloatArray
        y(k) = (sum of a_i u(k - i) - sum over i >= 1 of b_i y(k - i)) / b_0, (n,). [µm]

    Raises
    ------
    DataError
        If the input has another shape or a value is missing or infinite.

    References
    ----------
    Mareš and Horejš 2021, equation (3).
    """
    values = np.asarray(u, dtype=np.float64)
    if values.ndim != 1:
        raise DataError("wrong_shape", shape=str(values.shape), expected="(n,)", key="u")
    if not bool(np.all(np.isfinite(values))):
        raise DataError("input_missing", key="u")
    a, b = transfer_function.numerator, transfer_function.denominator
    before_u = _past(past_u, a.size - 1)
    before_y = _past(past_y, b.size - 1)
    state = np.zeros(max(a.size, b.size) - 1)
    for i in range(state.size):  # transposed direct form: what past rows still contribute
        state[i] = a[i + 1 :] @ before_u[: max(a.size - 1 - i, 0)]
        state[i] -= b[i + 1 :] @ before_y[: max(b.size - 1 - i, 0)]
    return filtered(a / b[0], b / b[0], values, state / b[0])


def _past(values: Sequence[float] | FloatArray, size: int) -> FloatArray:
    given = np.asarray(values, dtype=np.float64)
    if given.ndim != 1 or not bool(np.all(np.isfinite(given))):
        raise DataError("not_finite", key="past_u, past_y")
    past = np.zeros(size)
    past[: min(size, given.size)] = given[:size]
    return past


@final
@dataclass(frozen=True, slots=True, eq=False)
class PolynomialModel:
    """Model of one displacement: one transfer function per input, summed, and an offset.

    Raises
    ------
    DataError
        If names and transfer functions are not one each, there is none, or the sample time is
        not positive.

    References
    ----------
    Mareš and Horejš 2021, equations (1) and (2).
    """

    input_names: tuple[str, ...]
    """Names of the inputs, in their order."""
    transfer_functions: tuple[TransferFunction, ...]
    sample_time_s: float
    """Time between rows for which the coefficients hold. [s]"""
    offset_um: float = 0.0
    """Displacement where every input is at its reference for long. [µm]"""

    def __post_init__(self) -> None:
        """Check that names and transfer functions belong together."""
        if len(self.input_names) != len(self.transfer_functions) or not self.input_names:
            raise DataError(
                "count_not_inputs",
                count=len(self.input_names),
                inputs=len(self.transfer_functions),
                key="input_names",
            )
        require_sample_time(self.sample_time_s)

    @property
    def stable(self) -> bool:
        """Whether every pole of every part lies inside the unit circle."""
        return all(part.stable for part in self.transfer_functions)


def held(u: FloatArray) -> tuple[FloatArray, int]:
    """Replace missing inputs by the last measured one, at the start by the first measured one."""
    missing = np.isnan(u)
    count = int(np.count_nonzero(missing))
    if count == 0:
        return u, 0
    rows = np.arange(u.shape[0], dtype=np.int64)[:, None]
    last = np.maximum.accumulate(np.where(missing, -1, rows), axis=0)
    first = np.argmin(missing, axis=0)
    source = np.where(last < 0, first[None, :], last)
    return np.take_along_axis(u, source, axis=0), count


def simulate_polynomial(
    model: PolynomialModel, u: FloatArray, *, start: Start = Start.STEADY
) -> FloatArray:
    """Return the displacement that the model gives in free run.

    Parameters
    ----------
    u : FloatArray
        Inputs relative to their reference at the sample time of the model, (n, k); a missing one
        (NaN) is held at its last value. [K]
    start : Start
        STEADY (default, as `simulate_modal`) or REST (the paper).

    Returns
    -------
    FloatArray
        Displacement at every row, (n,). [µm]

    Raises
    ------
    DataError
        If the shape does not fit the model, an input is infinite or never measured, the start is
        FREE, or a steady start is asked of a model that has none.
    """
    values = _checked_inputs(model, u)
    if start is Start.FREE:
        raise DataError("free_start_unmeasured", key="start")
    y = np.full(values.shape[0], model.offset_um)
    for name, part, column in zip(
        model.input_names, model.transfer_functions, values.T, strict=True
    ):
        first = float(column[0]) if start is Start.STEADY else 0.0
        if first != 0.0 and not np.isfinite(part.dc_gain):
            raise DataError("no_steady_state", channel=name)
        b0 = part.denominator[0]
        y += output_of(part.numerator / b0, part.denominator / b0, column, first)
    return y


def _checked_inputs(model: PolynomialModel, u: FloatArray) -> FloatArray:
    values = rows_of_inputs(u, len(model.input_names))
    if bool(np.any(np.isinf(values))):
        raise DataError("infinite_value", key="u")
    never = np.flatnonzero(np.all(np.isnan(values), axis=0))
    if never.size:
        raise DataError("never_measured", channel=model.input_names[int(never[0])])
    return held(values)[0]


def names_of_inputs(experiments: Sequence[Experiment], names: Sequence[str]) -> tuple[str, ...]:
    """Return the names of the inputs, u1, u2, ... where none are given."""
    count = experiments[0].inputs
    given = tuple(names) if names else tuple(f"u{i + 1}" for i in range(count))
    if len(given) != count or len(set(given)) != count:
        raise DataError("count_not_inputs", count=len(set(given)), inputs=count, key="input_names")
    return given


def common_sample_time_s(experiments: Sequence[Experiment]) -> float:
    """Return the sample time that all experiments share."""
    first = experiments[0].sample_time_s
    for experiment in experiments:
        if abs(experiment.sample_time_s - first) > 1e-6 * first:
            raise DataError(
                "sample_times_differ",
                first_s=first,
                sample_time_s=experiment.sample_time_s,
                file=experiment.name,
            )
    return first


@final
@dataclass(frozen=True, slots=True)
class OrderTrial:
    """One pair of orders of the default search."""

    numerator_order: int
    """n of every input. [1]"""
    denominator_order: int
    """m. [1]"""
    rmse_um: float
    """Root mean square error of the free run in blocks that the fit did not see; infinite where a
    fit was unstable or impossible. [µm]"""
    chosen: bool
    """Whether these orders were taken."""


@final
@dataclass(frozen=True, slots=True, eq=False)
class PolynomialResult:
    """An identified polynomial model and how sure it is."""

    method: str
    """`arx` or `oe`."""
    model: PolynomialModel
    """Numerators and denominators; of ARX the denominators are one and the same."""
    parameter_names: tuple[str, ...]
    """Names of the free parameters, such as `b_1`, `a_0 spindle`, `offset`, `phi_1`."""
    parameters: FloatArray
    """Their values, (d,). [µm/K, 1 or µm]"""
    covariance_root: FloatArray
    """Root of their covariance, (d, r): slow models lose the covariance of sums of coefficients in
    the covariance itself. [their units]"""
    numerator_at: tuple[tuple[int, ...], ...]
    """Where the numerator of each input stands among the parameters. [1]"""
    denominator_at: tuple[tuple[int, ...], ...]
    """Where b_1 ... b_m of each input stand among the parameters. [1]"""
    delays: tuple[int, ...]
    """Delay of each input: leading zeros of its numerator that were not estimated. [row]"""
    noise_coefficients: FloatArray
    """phi of the noise, v(k) = sum of phi_i v(k - i) + e(k), (p,); empty for white noise. [1]"""
    noise_variance: float
    """Variance of e: sum of squares over rows less parameters. [µm²]"""
    mean_square: float
    """Sum of squares of e over rows, what the estimator made small. [µm²]"""
    rows: int
    """Rows that were used. [1]"""
    simulated_um: tuple[FloatArray, ...]
    """Free run of each experiment from its first row, (n,) each. [µm]"""
    fit_percent: float
    """Fit of the free run over all experiments, equation (4). [%]"""
    search: tuple[OrderTrial, ...]
    """The orders that were tried; empty where they were given."""
    warnings: tuple[Message, ...]
    """What the reader of the result must know."""

    @property
    def stable(self) -> bool:
        """Whether every pole lies inside the unit circle."""
        return self.model.stable

    @property
    def std(self) -> FloatArray:
        """Standard deviations of the parameters, (d,). [their units]"""
        return np.linalg.norm(self.covariance_root, axis=1)

    @property
    def noise_std_um(self) -> float:
        """Standard deviation of e. [µm]"""
        return float(np.sqrt(self.noise_variance))

    @property
    def numerators(self) -> tuple[FloatArray, ...]:
        """a_0 ... a_n of every input. [µm/K]"""
        return tuple(part.numerator for part in self.model.transfer_functions)

    @property
    def denominators(self) -> tuple[FloatArray, ...]:
        """b_0 ... b_m of every input; b_0 is one. [1]"""
        return tuple(part.denominator for part in self.model.transfer_functions)

    @property
    def dc_gain(self) -> FloatArray:
        """DC gain of every input, (k,). [µm/K]"""
        return np.array([part.dc_gain for part in self.model.transfer_functions])

    @property
    def dc_gain_std(self) -> FloatArray:
        """Its standard deviation to first order, (k,). [µm/K]"""
        deviations: list[float] = []
        for part, a_at, b_at in zip(
            self.model.transfer_functions, self.numerator_at, self.denominator_at, strict=True
        ):
            below = fsum(part.denominator)
            gradient = np.zeros(self.parameters.size)
            if below != 0.0:
                gradient[list(a_at)] = 1.0 / below
                gradient[list(b_at)] = -part.dc_gain / below
            deviation = float(np.linalg.norm(gradient @ self.covariance_root))
            deviations.append(deviation if below != 0.0 else np.inf)
        return np.array(deviations)
