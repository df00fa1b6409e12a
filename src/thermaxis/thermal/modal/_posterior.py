"""How sure responses are: mean square deviations over all sets of lags, in time or frequency."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias, final

import numpy as np
from numpy.typing import NDArray

from thermaxis.thermal._arrays import FloatArray
from thermaxis.thermal.modal._average import Component, tempered_weights
from thermaxis.thermal.modal._evidence import Design
from thermaxis.thermal.modal._lags import columns_of, prior_precision
from thermaxis.thermal.modal._slow_noise import SlowNoise
from thermaxis.thermal.transfer_function import ComplexArray, ThermalModel

Basis: TypeAlias = Callable[[FloatArray], FloatArray | NDArray[np.complexfloating[Any, Any]]]
"""What lags of given time constants, (j,), do to an input at times or frequencies, (t, j). [1]"""

KEPT_WEIGHT = 0.999
"""Share of the weight of all sets that counts: those left out are thousands. [1]"""
_DELTA = 1e-3
_Products: TypeAlias = dict[tuple[int, SlowNoise], FloatArray]


@final
@dataclass(frozen=True, slots=True, eq=False)
class ResponsePosterior:
    """What a record leaves open of the responses of a model."""

    components: tuple[Component, ...]
    model: ThermalModel
    """The model that is stated."""
    unit: FloatArray
    """One scaled gain of every input, (k,). [µm/K]"""
    dc_std: FloatArray
    """Standard deviation of the DC gains, (k,); NaN, as of all deviations, where it is not stated.
    [µm/K]"""

    def deviations(self, basis: Basis) -> tuple[FloatArray, ComplexArray]:
        """Return the means of |d|^2 and of d^2 of the deviations d from the responses, (t, k) each.

        Notes
        -----
        With gains g of mean m and covariance C in a set, their responses w and the stated response
        r, E d^2 = w' (C + m m') w - 2 r w' m + r^2, averaged over the sets with their weights; lags
        between the points of the grid add what their time constants leave open, to first order. At
        DC this is the variance of the stated interval, to which it is scaled: sets of the least
        weight are left out. [µm²/K²]
        """
        plain, square = self._means(basis)
        lasting, _ = self._means(lambda taus_s: np.ones((1, taus_s.size)))
        scale = self.dc_std**2 / np.maximum(lasting[0], 1e-300)
        return scale * plain, scale * square

    def _means(self, basis: Basis) -> tuple[FloatArray, ComplexArray]:
        responses = [p.direct_gain + basis(p.time_constants_s) @ p.gains for p in self.model.parts]
        stated = np.stack(responses, axis=1) / self.unit
        plain = np.zeros(stated.shape)
        square = np.zeros(stated.shape, dtype=np.complex128)
        total, products = 0.0, _Products()
        for component, weight in _kept(self.components):
            rows, whole = np.flatnonzero(weight), float(np.sum(weight))
            if whole == 0.0:
                continue
            lags = basis(component.time_constants_s)
            w = np.hstack([np.ones((lags.shape[0], 1)), lags])
            first, second = _moments(component, rows, weight[rows], products)
            mean = w @ first.T
            told = np.tensordot(w, second, (1, 2))
            quadratic = np.sum(told * w[:, None, :], axis=2)
            hermitian = np.sum(told * np.conj(w)[:, None, :], axis=2).real
            plain += hermitian - 2.0 * (np.conj(stated) * mean).real + whole * np.abs(stated) ** 2
            square += quadratic - 2.0 * stated * mean + whole * stated**2
            if component.moves is not None and component.moving is not None:
                bend = basis(component.time_constants_s * (1.0 + _DELTA)) - lags
                slopes = np.tensordot(w, component.moving, (1, 1))
                slopes = slopes + (first[:, 1:] / whole) * bend[:, None, :] / _DELTA
                spread = slopes @ component.moves
                plain += whole * np.sum(spread * np.conj(slopes), axis=2).real
                square += whole * np.sum(spread * slopes, axis=2)
            total += whole
        return self.unit**2 * plain / total, self.unit**2 * square / total


def _kept(components: Sequence[Component]) -> list[tuple[Component, FloatArray]]:
    """Return components with the weights of their sets, zero where these count no more."""
    weights = tempered_weights(components)
    every = np.sort(np.concatenate(weights))[::-1]
    share = np.cumsum(every) / np.sum(every)
    least = every[np.searchsorted(share, KEPT_WEIGHT)]
    return [(c, np.where(w >= least, w, 0.0)) for c, w in zip(components, weights, strict=True)]


def _moments(
    component: Component, rows: NDArray[np.intp], weight: FloatArray, known: _Products
) -> tuple[FloatArray, FloatArray]:
    """Return weighted sums of gains, (k, 1 + j), and of their products, (k, 1 + j, 1 + j)."""
    design, item = component.design, component.compared
    members = item.subsets.members[rows]
    gains, covariance = _gains_of(design, component, rows, known)
    first = np.zeros((design.inputs, 1 + design.lags))
    second = np.zeros((design.inputs, 1 + design.lags, 1 + design.lags))
    at = np.hstack([np.zeros((rows.size, 1), dtype=np.intp), 1 + members])
    for i in range(design.inputs):
        g = gains[:, i]
        np.add.at(first[i], at, weight[:, None] * g)
        products = covariance[:, i] + g[:, :, None] * g[:, None, :]
        np.add.at(second[i], (at[:, :, None], at[:, None, :]), weight[:, None, None] * products)
    return first, second


def _gains_of(
    design: Design, component: Component, rows: NDArray[np.intp], known: _Products
) -> tuple[FloatArray, FloatArray]:
    """Return gains of sets, (m, k, 1 + j), and their covariance, (m, k, 1 + j, 1 + j)."""
    item = component.compared
    key = (id(design), item.sizes.noise)
    if key not in known:
        known[key], _ = design.products(item.sizes.noise)
    scale = np.ones(known[key].shape[0])
    if item.unit is not None:
        scale[: design.gains] = item.unit
    gram = known[key] * scale * scale[:, None]
    members, gains = item.subsets.members[rows], item.subsets.gains[rows]
    columns, wide = columns_of(design, members), 1 + members.shape[1]
    free = np.ones(columns.shape, dtype=np.bool_)
    free[:, : design.inputs * wide] = gains.reshape(rows.size, -1) != 0.0
    precision = gram[columns[:, :, None], columns[:, None, :]]
    own = np.arange(int(columns.shape[1]))
    precision[:, own, own] += prior_precision(design, item.sizes, wide - 1)
    both = free[:, :, None] & free[:, None, :]
    inverse = np.linalg.inv(np.where(both, precision, np.eye(own.size))) * both
    right = gram[columns, -1] * free
    left = gram[-1, -1] - np.einsum("mi,mij,mj->m", right, inverse, right)
    inverse *= (np.maximum(left, 0.0) / design.readings)[:, None, None]
    units = scale[columns]
    inverse *= units[:, :, None] * units[:, None, :]
    blocks = [
        inverse[:, s, s] for s in (slice(i * wide, (i + 1) * wide) for i in range(design.inputs))
    ]
    return gains, np.stack(blocks, axis=1)
