"""Lags whose time constants and gains change with a regime, such as coolant that runs or does not.

In regime r a lag of the input u follows

    time constant_r dx/dt = gain_r u - x,        displacement = direct gains u + sum of x,

so that neither a state nor the displacement leaps where the regime changes. With time constants
given all of this is linear in the gains. Every input has lags over a grid of time constants that do
not change, and as many that do: their time constants in one regime are those in the other times one
ratio, which is the likeliest of a few. Sizes of gains and noise are those of the highest evidence,
as of `modal`.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import final

import numpy as np

from thermaxis.errors import DataError
from thermaxis.thermal._arrays import FloatArray
from thermaxis.thermal.log import Experiment
from thermaxis.thermal.modal._evidence import (
    AT_REST,
    Design,
    Hyperprior,
    log_evidence_of,
    most_likely_sizes,
)
from thermaxis.thermal.modal._modal import (
    DRIFT_CORRELATION_S,
    ModalOptions,
    response_evidence,
)
from thermaxis.thermal.modal._regressors import BoolArray
from thermaxis.thermal.transfer_function import ModalPart, ThermalModel

GRID = 8
"""Time constants of the grid. [1]"""
LONGEST_SHARE = 0.4
"""Longest time constant of the grid over the length of the record. [1]"""
RATIOS = (0.15, 0.3, 0.5, 1.0, 2.0, 3.3, 6.7)
"""Time constants inside the regime over those outside that are tried. [1]"""
_DRIVEN = np.array([[1.0, 1.0, 0.0], [1.0, 0.0, 1.0]])
"""Whether each regime drives a lag that does not change, one outside and one inside. [1]"""


@final
@dataclass(frozen=True, slots=True, eq=False)
class SwitchedModel:
    """Gains and lags of one displacement in two regimes."""

    models: tuple[ThermalModel, ThermalModel]
    """What holds outside the regime and inside, with the same lags in the same order."""
    log_evidence: float
    """Logarithm of the evidence of the record. [1]"""


def simulate_switched(
    models: tuple[ThermalModel, ThermalModel], sample_time_s: float, u: FloatArray, on: BoolArray
) -> FloatArray:
    """Return the displacement in free run from rest, lags keeping what they hold at a change.

    Parameters
    ----------
    models : tuple of two ThermalModel
        What holds outside the regime and inside, with the same lags in the same order.
    sample_time_s : float
        Time between rows. [s]
    u : FloatArray
        Inputs relative to their reference, (n, k), each held until the next row. [K]
    on : BoolArray
        Whether the regime holds at each row, (n,).

    Returns
    -------
    FloatArray
        Displacement at every row, (n,). [µm]
    """
    owner = [i for i, part in enumerate(models[0].parts) for _ in part.gains]
    taus_s, gains = (
        np.array([np.concatenate([getattr(part, key) for part in one.parts]) for one in models])
        for key in ("time_constants_s", "gains")
    )
    driven = u[:, owner] * gains[:, None, :]
    direct = np.array([[part.direct_gain for part in one.parts] for one in models])
    lagged = _lagged(driven, taus_s, sample_time_s, on, np.zeros(len(owner)))
    return lagged.sum(axis=1) + np.sum(u * direct[on.astype(np.intp)], axis=1)


def _lagged(
    driven: FloatArray, taus_s: FloatArray, step_s: float, on: BoolArray, start: FloatArray
) -> FloatArray:
    """Return lags, (n, j), of what drives them in each regime, (2, n, j), (2, j) time constants."""
    alphas, x = -np.expm1(-step_s / taus_s), start
    found = np.empty(driven.shape[1:])
    for row, r in enumerate(on.astype(np.intp).tolist()):
        found[row] = x
        x = x + alphas[r] * (driven[r, row] - x)
    return found


def fit_switched(
    experiment: Experiment, on: BoolArray, input_names: Sequence[str], *, switching: bool = True
) -> SwitchedModel:
    """Estimate the lags of one experiment in two regimes.

    Parameters
    ----------
    on : BoolArray
        Whether the regime holds at each row, (n,).
    input_names : sequence of str
        Names of the inputs.
    switching : bool
        Whether lags may change; without they are those of both regimes.

    Returns
    -------
    SwitchedModel
        What the record makes most likely.

    Raises
    ------
    DataError
        If the inputs have long gaps.
    """
    evidence = response_evidence([experiment], ModalOptions(intervals=False))
    if len(evidence.segments) != 1:
        raise DataError("no_complete_row")
    (segment,), whole, sizes = evidence.segments, evidence.design, evidence.sizes
    step_s, used = segment.sample_time_s, segment.count > 0
    u = np.column_stack(segment.u)
    on = np.pad(on, (0, max(len(u) - on.size, 0)), mode="edge")[: len(u)]
    longest_s = LONGEST_SHARE * evidence.longest_s
    grid = np.geomspace(float(evidence.time_constants_s[0]), longest_s, GRID)
    shape = (3 if switching else 1, experiment.inputs, GRID)
    kind, owner, place = np.indices(shape).reshape(3, -1)
    start = np.array(segment.start)[owner] * _DRIVEN[int(on[0]), kind]
    driven = u[:, owner] * _DRIVEN[:, None, kind]

    at_rest = not sizes.log_transients or sizes.log_transients[0] <= AT_REST
    fading = slice(whole.gains, whole.gains if at_rest else whole.penalised, 3)
    fixed = np.hstack([segment.mean_u[used], whole.rows[0][:, fading]])
    y = whole.rows[0][:, -1:] * evidence.scales.y
    correlation_s = min(DRIFT_CORRELATION_S, evidence.longest_s / 5.0)
    hyperprior = Hyperprior(correlation_s, float(np.sqrt(correlation_s * segment.rows * step_s)))

    def design_of(ratio: float) -> Design:
        taus_s = np.stack([grid[place], grid[place] * np.where(kind > 0, ratio, 1.0)])
        states = _lagged(driven, taus_s, step_s, on, start)
        means = [segment.means(np.ascontiguousarray(state))[used] for state in states.T]
        x = np.hstack([fixed, np.column_stack(means), np.ones_like(y), y])
        return Design(
            rows=(x,), white_variance=whole.white_variance, times_s=whole.times_s,
            inputs=x.shape[1] - 2, lags=0, transients=0, zeros=np.zeros((1, x.shape[1])),
            zero_variance=whole.zero_variance, basis=whole.basis,
        )  # fmt: skip

    design, ratio = design_of(1.0), 1.0
    likely = most_likely_sizes(design, hyperprior, wide=False)[0]
    if switching:
        designs = {one: design_of(one) for one in RATIOS} | {1.0: design}
        evidences = {
            one: log_evidence_of(each, each.products(likely.noise), likely)
            for one, each in designs.items()
        }
        ratio = max(evidences, key=evidences.__getitem__)
        design = designs[ratio]
        likely = most_likely_sizes(design, hyperprior, wide=False)[0]
    products = design.products(likely.noise)
    precision = products[0][:-1, :-1].copy()
    precision[np.diag_indices(design.inputs)] += np.exp(-2.0 * likely.log_gain)
    found = np.asarray(np.linalg.solve(precision, products[0][:-1, -1]), dtype=np.float64)
    gains = found[fixed.shape[1] : -1].reshape(shape)
    times_s = np.stack([grid, grid, ratio * grid])
    outside, inside = (
        ThermalModel(
            tuple(
                ModalPart(name, float(found[i]), gains[lags, i].ravel(), times_s[lags].ravel())
                for i, name in enumerate(input_names)
            )
        )
        for lags in ([[0, 1], [0, 2]] if switching else [[0], [0]])
    )
    return SwitchedModel((outside, inside), log_evidence_of(design, products, likely))
