"""The paper's printed transfer functions, what their digits leave open, and models of them.

Tables 1 and 2 of Mareš and Horejš 2021, DOI 10.17973/MMSJ.2021_07_2021053; the figures stand in
docs/theory/transfer-functions.md, the models in examples/models.
"""

from dataclasses import dataclass
from itertools import product
from math import fsum, log10
from typing import final

import numpy as np
from numpy.typing import NDArray

from thermaxis.compensation import CompensationModel, Output, Part, Provenance, Section
from thermaxis.thermal import TransferFunction, equivalent_part

FloatArray = NDArray[np.float64]
MOST_CORNERS = 1 << 12
"""Largest number of corners of the rounding that are computed. [1]"""
ROUNDING_DRAWS = 20_000
"""Random roundings for the standard deviations. [1]"""
_DRAW_SEED = 2021


@final
@dataclass(frozen=True, slots=True, eq=False)
class PrintedTransferFunction:
    """A transfer function as it was printed, with what its digits leave open."""

    transfer_function: TransferFunction
    """The printed coefficients."""
    numerator_decimals: tuple[int | None, ...]
    """Decimals of each a; None where the coefficient is exact. [1]"""
    denominator_decimals: tuple[int | None, ...]
    """Decimals of each b; None where the coefficient is exact, as b_0 = 1 is. [1]"""


PAPER_SPINDLE = PrintedTransferFunction(
    TransferFunction(
        np.array([10.01220, -9.9895457, 0.0, 0.0]),
        np.array([1.0, -0.877647, 0.020108, -0.141865]),
    ),
    (5, 7, None, None),
    (None, 6, 6, 6),
)
"""Table 1 of the paper, the spindle's transfer function. Its sample time is stated nowhere."""
PAPER_TABLE = PrintedTransferFunction(
    TransferFunction(
        np.array([-82.41672, 82.41479, 0.0, 0.0]),
        np.array([1.0, -0.64533, 0.10375, -0.45835]),
    ),
    (5, 5, None, None),
    (None, 5, 5, 5),
)
"""Table 2 of the paper, the table's transfer function. Its digits do not define its DC gain."""


@final
@dataclass(frozen=True, slots=True)
class RoundingLoss:
    """What the printed digits of a transfer function leave of its DC gain and time constant."""

    dc_gain: float
    """DC gain of the printed coefficients. [µm/K]"""
    dc_gain_between: tuple[float, float]
    """Least and largest DC gain that rounds to these digits; infinite where the digits allow a
    pole at z = 1. [µm/K]"""
    dc_gain_relative_std: float
    """Standard deviation over roundings that are equally likely; NaN where one is unstable. [1]"""
    time_constant_rows: float
    """Slowest time constant of the printed coefficients. [row]"""
    time_constant_rows_between: tuple[float, float]
    """Least and largest one that rounds to these digits; infinite where unstable. [row]"""
    time_constant_relative_std: float
    """Standard deviation over equally likely roundings; NaN where one is unstable. [1]"""
    unstable_share: float
    """Share of the roundings that are unstable. [1]"""
    decimals_for_percent: float
    """Decimals of b with which its worst corner moves the DC gain by one percent. [1]"""


def rounding_loss(printed: PrintedTransferFunction) -> RoundingLoss:
    """Return what the printed digits of a transfer function leave open.

    Parameters
    ----------
    printed : PrintedTransferFunction
        Coefficients and their decimals; each true coefficient lies within half a last digit.

    Returns
    -------
    RoundingLoss
        DC gain and slowest time constant: as printed, at the worst corners, and their scatter
        over 20,000 equally likely roundings (seeded).

    """
    tf = printed.transfer_function
    half = np.array(
        [
            0.0 if d is None else 0.5 * 10.0**-d
            for d in (*printed.numerator_decimals, *printed.denominator_decimals)
        ]
    )
    centre = np.concatenate([tf.numerator, tf.denominator])
    open_at = np.flatnonzero(half)
    assert 1 << open_at.size <= MOST_CORNERS
    signs = np.zeros((1 << open_at.size, half.size))
    signs[:, open_at] = np.array(list(product((-1.0, 1.0), repeat=open_at.size)))
    at_corners = _gain_and_time_constant(centre + signs * half, tf.numerator.size)
    draws = np.random.default_rng(_DRAW_SEED).uniform(-1.0, 1.0, (ROUNDING_DRAWS, half.size))
    drawn = _gain_and_time_constant(centre + draws * half, tf.numerator.size)
    below = half[tf.numerator.size :]
    opened = int(np.count_nonzero(below))
    sum_b = abs(fsum(tf.denominator / tf.denominator[0]))
    own = _gain_and_time_constant(centre[None, :], tf.numerator.size)
    return RoundingLoss(
        dc_gain=tf.dc_gain,
        dc_gain_between=_between(at_corners[0]),
        dc_gain_relative_std=_relative_std(drawn[0], tf.dc_gain),
        time_constant_rows=float(own[1][0]),
        time_constant_rows_between=_between(at_corners[1]),
        time_constant_relative_std=_relative_std(drawn[1], float(own[1][0])),
        unstable_share=float(np.mean(np.isinf(drawn[1]))),
        decimals_for_percent=log10(0.5 * opened / (0.01 * sum_b)) if opened and sum_b else 0.0,
    )


def _gain_and_time_constant(
    coefficients: FloatArray, numerator_size: int
) -> tuple[FloatArray, FloatArray]:
    """Return DC gains and slowest time constants in rows, (r,) each, infinite where unstable."""
    below = coefficients[:, numerator_size:] / coefficients[:, numerator_size, None]
    above = coefficients[:, :numerator_size] / coefficients[:, numerator_size, None]
    order = below.shape[1] - 1
    radius = np.zeros(coefficients.shape[0])
    if order:
        companion = np.zeros((coefficients.shape[0], order, order))
        companion[:, 0, :] = -below[:, 1:]
        companion[:, np.arange(1, order), np.arange(order - 1)] = 1.0
        radius = np.max(np.abs(np.linalg.eigvals(companion)), axis=1)
    stable = radius < 1.0
    with np.errstate(divide="ignore", invalid="ignore"):
        gain = np.where(stable, np.sum(above, axis=1) / np.sum(below, axis=1), np.inf)
        rows = np.where(stable, -1.0 / np.log(radius), np.inf)
    return gain, rows


def _between(values: FloatArray) -> tuple[float, float]:
    return float(np.min(values)), float(np.max(values))


def _relative_std(values: FloatArray, centre: float) -> float:
    if not bool(np.all(np.isfinite(values))) or centre == 0.0:
        return float("nan")
    return float(np.std(values)) / abs(centre)


PAPER = "Mares and Horejs 2021, MM Science Journal, DOI 10.17973/MMSJ.2021_07_2021053"
"""Where the coefficients are printed."""
ASSUMED_SAMPLE_TIME_S = 1.0
"""The paper states no sample time; one second is assumed, and every time constant with it. [s]"""
_LARGE_LOSS = 0.01


def paper_spindle_model() -> CompensationModel:
    """Return the paper's transfer function of the spindle, epsilon 1: equation (5), table 1.

    Output ``Z_um``, part ``spindle``; direct gain and one lag that equal the printed coefficients
    after some tens of samples.
    """
    return _model("spindle", "T_spindle_C", PAPER_SPINDLE, "table 1, epsilon 1")


def paper_table_model() -> CompensationModel:
    """Return the paper's transfer function of the table, epsilon 2: equation (6), table 2.

    It warns that its printed digits do not define it.
    """
    return _model("table", "T_table_C", PAPER_TABLE, "table 2, epsilon 2")


def _model(
    name: str, channel: str, printed: PrintedTransferFunction, place: str
) -> CompensationModel:
    part = equivalent_part(printed.transfer_function, ASSUMED_SAMPLE_TIME_S, name)
    loss = rounding_loss(printed)
    low, high = sorted(loss.dc_gain_between)
    said = [
        (
            "the paper states no sample time: one second is assumed, and every time constant"
            " scales with it"
        ),
        (
            "the two fast modes of the printed coefficients are no heat conduction: their gain"
            " went into the direct gain, which differs from them in the first samples"
        ),
        f"the printed digits leave the DC gain between {low:.2f} and {high:.2f} um/K",
    ]
    if high - low > _LARGE_LOSS * abs(loss.dc_gain):
        said.append(
            "this model cannot be reproduced from its printed digits: use it as an example of a"
            " filter, never as the physics of a machine"
        )
    return CompensationModel(
        outputs=(
            Output(
                "Z_um",
                (
                    Part(
                        name=name,
                        plus=channel,
                        minus="T_column_C",
                        direct_gain_um_per_k=float(part.direct_gain),
                        sections=tuple(
                            Section(float(g), float(t))
                            for g, t in zip(part.gains, part.time_constants_s, strict=True)
                        ),
                    ),
                ),
            ),
        ),
        sample_time_s=ASSUMED_SAMPLE_TIME_S,
        provenance=Provenance(method=f"printed coefficients, {PAPER}, {place}"),
        warnings=tuple(said),
    )
