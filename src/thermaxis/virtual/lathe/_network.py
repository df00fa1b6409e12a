"""A network of lumped heat capacities, solved exactly over any time.

Every node has one temperature, a heat capacity, conductances to its neighbours and to boundaries
whose temperature is given. While heat and boundaries are constant,

    C dT/dt = -K T + p,   K = Kᵀ,

and with S = C^(-1/2) K C^(-1/2) = Q diag(λ) Qᵀ each mode has its closed solution: there is no time
step that could be too large, and no heat is lost.
"""

from dataclasses import dataclass, field
from typing import TypeAlias, final

import numpy as np
from numpy.typing import ArrayLike, NDArray

FloatArray: TypeAlias = NDArray[np.float64]

_SMALL = 1e-3
"""Below this product of rate and time the closed forms lose digits, and their series is used."""


@final
@dataclass(frozen=True, slots=True, eq=False)
class ThermalNetwork:
    """Lumped heat capacities with conductances between them and to boundaries."""

    capacity_j_per_k: FloatArray
    """Heat capacities, (n,). [J/K]"""
    conductance_w_per_k: FloatArray
    """Conductances between nodes, (n, n), symmetric, zeros on the diagonal. [W/K]"""
    boundary_w_per_k: FloatArray
    """Conductances from nodes to boundaries, (n, m). [W/K]"""
    rate_per_s: FloatArray = field(init=False)
    """Rates of the modes, (n,), rising; their reciprocals are the time constants. [1/s]"""
    _modes: FloatArray = field(init=False, repr=False)
    _root: FloatArray = field(init=False, repr=False)
    _into: FloatArray = field(init=False, repr=False)
    _outof: FloatArray = field(init=False, repr=False)

    def __post_init__(self) -> None:
        """Check the network and find its modes."""
        capacity = _array(self.capacity_j_per_k)
        between = _array(self.conductance_w_per_k)
        outside = _array(self.boundary_w_per_k)
        _check(capacity, between, outside)
        root = np.sqrt(capacity)
        stiffness = np.diag(between.sum(axis=1) + outside.sum(axis=1)) - between
        rate, modes = np.linalg.eigh(stiffness / np.outer(root, root))
        for name, values in (
            ("capacity_j_per_k", capacity),
            ("conductance_w_per_k", between),
            ("boundary_w_per_k", outside),
            ("rate_per_s", np.maximum(rate, 0.0)),
            ("_modes", modes),
            ("_root", root),
            ("_into", modes.T / root),
            ("_outof", modes / root[:, None]),
        ):
            values.setflags(write=False)
            object.__setattr__(self, name, values)

    def after(
        self, start_c: FloatArray, heat_w: FloatArray, boundary_c: FloatArray, time_s: float
    ) -> FloatArray:
        """Return the temperatures after some time of constant heat and boundaries."""
        z = self._modes.T @ (self._root * start_c)
        force = self._into @ (heat_w + self.boundary_w_per_k @ boundary_c)
        x = self.rate_per_s * time_s
        return np.asarray(self._outof @ (z * np.exp(-x) + force * time_s * _first(x)))

    def steady(self, heat_w: FloatArray, boundary_c: FloatArray) -> FloatArray:
        """Return the temperatures that constant heat and boundaries lead to."""
        force = self._into @ (heat_w + self.boundary_w_per_k @ boundary_c)
        return np.asarray(self._outof @ (force / self.rate_per_s))

    def swing(self, boundary: int, frequency_per_s: FloatArray) -> NDArray[np.complex128]:
        """Return how the nodes follow a boundary that swings by one kelvin for ever."""
        force = self._into @ self.boundary_w_per_k[:, boundary]
        lag = self.rate_per_s[:, None] + 1j * frequency_per_s[None, :]
        return np.asarray(self._outof @ (force[:, None] / lag), dtype=np.complex128)


def _array(values: ArrayLike) -> FloatArray:
    return np.array(values, dtype=np.float64, order="C")


def _check(capacity: FloatArray, between: FloatArray, outside: FloatArray) -> None:
    n = capacity.size
    if (
        n == 0
        or capacity.shape != (n,)
        or between.shape != (n, n)
        or outside.ndim != 2
        or outside.shape[0] != n
    ):
        raise ValueError("the shapes of a thermal network differ")
    if not bool(np.isfinite(capacity).all()) or bool((capacity <= 0.0).any()):
        raise ValueError("a heat capacity is not positive")
    for conductance in (between, outside):
        if not bool(np.isfinite(conductance).all()) or bool((conductance < 0.0).any()):
            raise ValueError("a conductance is negative or not finite")
    if not np.array_equal(between, between.T) or bool(np.diag(between).any()):
        raise ValueError("conductances are not symmetric with an empty diagonal")


def _first(x: FloatArray) -> FloatArray:
    """Return (1 - exp(-x)) / x."""
    series = 1.0 - x / 2.0 + x**2 / 6.0 - x**3 / 24.0
    safe = np.where(x < _SMALL, 1.0, x)
    return np.where(x < _SMALL, series, -np.expm1(-safe) / safe)
