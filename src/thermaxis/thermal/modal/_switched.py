"""Lags whose time constants and gains change with a regime, such as coolant that runs or does not.

In regime r a lag of the input u follows

    time constant_r dx/dt = gain_r u - x,        displacement = direct gains u + sum of x,

so that neither a state nor the displacement leaps where the regime changes. With time constants
given all of this is linear in the gains. Lags are chosen one by one from a grid of pairs of time
constants; a lag that does not change has one gain and one time constant. Sizes of gains and noise
are those of the highest evidence, as of `modal`.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import product
from typing import NamedTuple, final

import numpy as np

from thermaxis.errors import DataError
from thermaxis.thermal._arrays import FloatArray
from thermaxis.thermal.log import Experiment
from thermaxis.thermal.modal._evidence import (
    AT_REST,
    Design,
    Hyperprior,
    factored,
    log_evidence_of,
    most_likely_sizes,
)
from thermaxis.thermal.modal._modal import DRIFT_CORRELATION_S, response_evidence
from thermaxis.thermal.modal._regressors import BoolArray
from thermaxis.thermal.transfer_function import ModalPart, ThermalModel

GRID = 10
"""Time constants of the grid; a lag has any two of them. [1]"""
MOST_LAGS = 6
"""Lags of all inputs together. [1]"""
PER_LAG = 4.0
"""Logarithm of how much less plausible every further lag is before the record is seen. [1]"""
LONGEST_SHARE = 0.4
"""Longest time constant of the grid over the length of the record. [1]"""
CLOSER = (1.35, 1.16, 1.07)
"""Factors by which time constants then move off the grid. [1]"""
_PRIOR_GAIN = 300.0


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


class _Lag(NamedTuple):
    input: int
    taus_s: tuple[float, float]
    switched: bool

    def near(self, factor: float) -> "Iterator[_Lag]":
        """Yield it with time constants that are the same, or longer or shorter by a factor."""
        powers = (0, -1, 1)
        for p, q in product(powers, powers) if self.switched else zip(powers, powers, strict=True):
            yield self._replace(taus_s=(self.taus_s[0] * factor**p, self.taus_s[1] * factor**q))


def fit_switched(
    experiment: Experiment, on: BoolArray, input_names: Sequence[str], *, switching: bool = True
) -> SwitchedModel:
    """Estimate the lags of one experiment in two regimes.

    Parameters
    ----------
    experiment : Experiment
        Inputs and displacement.
    on : BoolArray
        Whether the regime holds at each row, (n,).
    input_names : sequence of str
        Names of the inputs.
    switching : bool
        Whether lags may change; without they are those of both regimes.

    Returns
    -------
    SwitchedModel
        The lags that the record makes most likely.

    Raises
    ------
    DataError
        If the inputs have long gaps.
    """
    evidence = response_evidence([experiment])
    if len(evidence.segments) != 1:
        raise DataError("no_complete_row")
    (segment,), whole, sizes = evidence.segments, evidence.design, evidence.sizes
    step_s, used = segment.sample_time_s, segment.count > 0
    u = np.column_stack(segment.u)
    on = np.pad(on, (0, max(len(u) - on.size, 0)), mode="edge")[: len(u)]
    gates = np.eye(2)

    def columns_of(lags: Sequence[_Lag]) -> list[FloatArray]:
        """Return means of lags of the input outside the regime and inside, or of their sum."""
        owner = np.repeat([lag.input for lag in lags], 2)
        taus_s = np.repeat(np.array([lag.taus_s for lag in lags]).T, 2, axis=1)
        gate = np.tile(gates, len(lags))[:, None, :]
        begin = np.array(segment.start)[owner] * gate[int(on[0]), 0]
        states = _lagged(u[:, owner] * gate, taus_s, step_s, on, begin)
        means = [segment.means(np.ascontiguousarray(state))[used] for state in states.T]
        pairs = zip(lags, means[::2], means[1::2], strict=True)
        return [np.column_stack([a, b] if lag.switched else [a + b]) for lag, a, b in pairs]

    at_rest = not sizes.log_transients or sizes.log_transients[0] <= AT_REST
    fading = slice(whole.gains, whole.gains if at_rest else whole.penalised, 3)
    fixed = np.hstack([segment.mean_u[used], whole.rows[0][:, fading]])
    y = whole.rows[0][:, -1:] * evidence.scales.y

    def design_of(columns: Sequence[FloatArray]) -> Design:
        x = np.hstack([fixed, *columns, np.ones_like(y), y])
        return Design(
            rows=(x,), white_variance=whole.white_variance, times_s=whole.times_s,
            inputs=x.shape[1] - 2, lags=0, transients=0, zeros=np.zeros((1, x.shape[1])),
            zero_variance=whole.zero_variance, basis=whole.basis,
        )  # fmt: skip

    shortest_s = float(evidence.time_constants_s[0])
    longest_s = LONGEST_SHARE * evidence.longest_s
    grid: list[float] = np.geomspace(shortest_s, longest_s, GRID).tolist()
    inputs = range(experiment.inputs)
    lags: list[_Lag] = [_Lag(i, (a, a), switched=False) for i in inputs for a in grid]
    lags += [
        _Lag(i, (a, b), switched=True) for i in inputs for a in grid for b in grid if switching
    ]
    correlation_s = min(DRIFT_CORRELATION_S, evidence.longest_s / 5.0)
    fast_s = float(np.sqrt(correlation_s * segment.rows * step_s))
    columns: list[FloatArray] = columns_of(lags)
    design = design_of(columns)
    for factor in (1.0, *CLOSER):
        if not lags:
            break  # the inputs say nothing
        if factor > 1.0:
            lags = list(dict.fromkeys(one for lag in lags for one in lag.near(factor)))
            columns = columns_of(lags)
        gram, _ = design_of(columns).products(sizes.noise)
        chosen = _chosen(gram, [c.shape[1] for c in columns], fixed.shape[1], whole.readings)
        lags, columns = [lags[k] for k in chosen], [columns[k] for k in chosen]
        design = design_of(columns)
        sizes = most_likely_sizes(design, Hyperprior(correlation_s, fast_s), wide=False)[0]
    products = design.products(sizes.noise)
    precision = products[0][:-1, :-1].copy()
    precision[np.diag_indices(design.inputs)] += np.exp(-2.0 * sizes.log_gain)
    gains = np.asarray(np.linalg.solve(precision, products[0][:-1, -1]), dtype=np.float64)
    last = (fixed.shape[1] + np.cumsum([c.shape[1] for c in columns]) - 1).tolist()
    value = log_evidence_of(design, products, sizes) - PER_LAG * len(lags)
    return SwitchedModel(
        (_model(0, lags, last, gains, input_names), _model(1, lags, last, gains, input_names)),
        value,
    )


def _model(
    regime: int,
    lags: Sequence[_Lag],
    last: Sequence[int],
    gains: FloatArray,
    input_names: Sequence[str],
) -> ThermalModel:
    """Return what holds in a regime, `last` being the place of a lag's gain inside it."""
    parts: list[ModalPart] = []
    for i, name in enumerate(input_names):
        own = [(lag, at) for lag, at in zip(lags, last, strict=True) if lag.input == i]
        places = np.array([at - (lag.switched and not regime) for lag, at in own], dtype=np.intp)
        taus_s = np.array([lag.taus_s[regime] for lag, _ in own])
        parts.append(ModalPart(name, float(gains[i]), gains[places], taus_s))
    return ThermalModel(tuple(parts))


def _chosen(gram: FloatArray, widths: Sequence[int], fixed: int, readings: int) -> list[int]:
    """Return the lags that raise the evidence, each exchanged for a better one if there is."""
    ends = fixed + np.cumsum(widths)
    places = [range(end - wide, end) for end, wide in zip(ends.tolist(), widths, strict=True)]

    def value(lags: Sequence[int]) -> float:
        own = [*range(fixed), *(p for lag in lags for p in places[lag])]
        own += [gram.shape[0] - 2, gram.shape[0] - 1]
        joint = gram[np.ix_(own, own)] + np.diag([_PRIOR_GAIN**-2.0] * (len(own) - 1) + [0.0])
        logs = np.log(np.diag(factored(joint)))
        size = float(logs[:-1].sum()) + len(own) * np.log(_PRIOR_GAIN)
        return -readings * float(logs[-1]) - size - PER_LAG * sum(widths[lag] for lag in lags)

    def with_best(lags: list[int]) -> list[int]:
        return max(([*lags, k] for k in range(len(widths)) if k not in lags), key=value)

    lags: list[int] = []
    while len(lags) < MOST_LAGS:
        more = with_best(lags)
        if value(more) <= value(lags):
            break
        for old in tuple(more):
            rest = [k for k in more if k != old]
            more = max(more, rest, with_best(rest), key=value)
        lags = more
    return lags
