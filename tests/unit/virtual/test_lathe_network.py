"""The network of heat capacities: exact against Runge-Kutta, no heat lost, no step too large."""

import numpy as np
import pytest
from hypothesis import given, strategies as st
from scipy.linalg import expm

from thermaxis.virtual.lathe._network import ThermalNetwork


def random_network(seed: int, *, boundaries: int = 2) -> tuple[ThermalNetwork, np.ndarray]:
    """A network of 2 to 9 nodes with time constants from seconds to days."""
    rng = np.random.default_rng(seed)
    n = int(rng.integers(2, 10))
    between = np.exp(rng.uniform(np.log(1.0), np.log(500.0), (n, n))) * (rng.random((n, n)) < 0.6)
    between = np.triu(between, 1)
    outside = np.exp(rng.uniform(np.log(1.0), np.log(200.0), (n, boundaries)))
    outside *= rng.random((n, boundaries)) < 0.5
    if boundaries:
        outside[0, 0] = 20.0
    capacity = np.exp(rng.uniform(np.log(1e3), np.log(5e6), n))
    return ThermalNetwork(capacity, between + between.T, outside), rng.uniform(10.0, 40.0, n)


def by_runge_kutta(
    network: ThermalNetwork,
    start: np.ndarray,
    heat: np.ndarray,
    boundary: np.ndarray,
    time_s: float,
) -> np.ndarray:
    """Classic fourth order, each conductance written out, far below the fastest mode."""
    c, g, b = network.capacity_j_per_k, network.conductance_w_per_k, network.boundary_w_per_k
    n = c.size

    def slope(t: np.ndarray) -> np.ndarray:
        flow = heat.copy()
        for i in range(n):
            flow[i] += sum(g[i, j] * (t[j] - t[i]) for j in range(n))
            flow[i] += sum(b[i, k] * (boundary[k] - t[i]) for k in range(boundary.size))
        return flow / c

    steps = int(np.ceil(time_s * network.rate_per_s[-1] / 0.1)) + 1
    h, t = time_s / steps, start.copy()
    for _ in range(steps):
        k1 = slope(t)
        k2 = slope(t + h / 2 * k1)
        k3 = slope(t + h / 2 * k2)
        k4 = slope(t + h * k3)
        t = t + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
    return t


def test_a_step_is_what_fine_runge_kutta_gives() -> None:
    for seed in range(4):
        network, start = random_network(seed)
        heat = np.linspace(0.0, 900.0, start.size)
        boundary = np.array([18.0, 25.0])
        time_s = 20.0 / network.rate_per_s[-1]
        exact = network.after(start, heat, boundary, time_s)
        fine = by_runge_kutta(network, start, heat, boundary, time_s)
        assert exact == pytest.approx(fine, abs=1e-4 * float(np.ptp(fine - start)) + 1e-9)


@given(seed=st.integers(0, 10_000), exponent=st.floats(-2.0, 7.0))
def test_a_step_of_any_length_is_the_matrix_exponential(seed: int, exponent: float) -> None:
    network, start = random_network(seed)
    heat, boundary = np.full(start.size, 100.0), np.array([20.0, -5.0])
    c, b = network.capacity_j_per_k, network.boundary_w_per_k
    n, time_s = start.size, 10.0**exponent
    k = np.diag(network.conductance_w_per_k.sum(axis=1) + b.sum(axis=1))
    a = (network.conductance_w_per_k - k) / c[:, None]
    whole = np.zeros((n + 1, n + 1))
    whole[:n, :n], whole[:n, n] = a, (heat + b @ boundary) / c
    expected = (expm(whole * time_s) @ np.append(start, 1.0))[:n]
    assert network.after(start, heat, boundary, time_s) == pytest.approx(expected, rel=1e-6)


@given(seed=st.integers(0, 10_000))
def test_a_network_without_a_boundary_keeps_all_its_heat(seed: int) -> None:
    network, start = random_network(seed, boundaries=1)
    alone = ThermalNetwork(
        network.capacity_j_per_k,
        network.conductance_w_per_k,
        np.zeros((start.size, 1)),
    )
    heat = np.linspace(0.0, 300.0, start.size)
    end = alone.after(start, heat, np.array([0.0]), 5000.0)
    stored = float(alone.capacity_j_per_k @ (end - start))
    assert stored == pytest.approx(float(np.sum(heat)) * 5000.0, rel=1e-7)


@given(seed=st.integers(0, 10_000), shares=st.lists(st.floats(0.01, 1.0), min_size=1, max_size=6))
def test_the_end_does_not_depend_on_how_the_time_is_divided(seed: int, shares: list[float]) -> None:
    network, start = random_network(seed)
    heat, boundary = np.full(start.size, 40.0), np.array([20.0, 10.0])
    times = 7200.0 * np.array(shares) / sum(shares)
    divided = start
    for time_s in times:
        divided = network.after(divided, heat, boundary, float(time_s))
    assert divided == pytest.approx(network.after(start, heat, boundary, 7200.0), rel=1e-9)


@given(seed=st.integers(0, 10_000), exponent=st.floats(-1.0, 7.0))
def test_without_heat_no_node_leaves_the_range_of_what_is_around_it(
    seed: int, exponent: float
) -> None:
    network, start = random_network(seed)
    boundary = np.array([18.0, 22.0])
    end = network.after(start, np.zeros(start.size), boundary, 10.0**exponent)
    assert end.max() <= max(start.max(), 22.0) + 1e-9
    assert end.min() >= min(start.min(), 18.0) - 1e-9


def test_everything_ends_at_the_steady_state() -> None:
    network, start = random_network(3)
    heat, boundary = np.full(start.size, 80.0), np.array([20.0, 24.0])
    long_s = 40.0 / network.rate_per_s[0]
    assert network.after(start, heat, boundary, long_s) == pytest.approx(
        network.steady(heat, boundary)
    )


@pytest.mark.proof
def test_the_answer_to_a_swinging_boundary_is_the_one_that_small_steps_settle_to() -> None:
    network, start = random_network(5)
    period = 2.0 / network.rate_per_s[0]
    omega = np.array([2.0 * np.pi / period])
    steps = 4000
    t = start
    for k in range(steps * 10):
        middle = (k + 0.5) / steps * period
        boundary = np.array([np.sin(omega[0] * middle), 0.0])
        t = network.after(t, np.zeros(start.size), boundary, period / steps)
    phasor = network.swing(0, omega)[:, 0]
    expected = np.imag(phasor * np.exp(1j * omega[0] * 10.0 * period))
    assert t == pytest.approx(expected, abs=2e-5)


def test_what_is_no_network_is_refused() -> None:
    for capacity, between, outside in (
        ([1.0, 0.0], [[0, 1], [1, 0]], [[1.0], [0.0]]),
        ([1.0, 1.0], [[0, 1], [2, 0]], [[1.0], [0.0]]),
        ([1.0, 1.0], [[1, 1], [1, 0]], [[1.0], [0.0]]),
        ([1.0, 1.0], [[0, -1], [-1, 0]], [[1.0], [0.0]]),
        ([1.0, 1.0], [[0, 1], [1, 0]], [[np.nan], [0.0]]),
        ([1.0, 1.0], [[0, 1], [1, 0]], [[1.0]]),
        ([1.0], [[0, 1], [1, 0]], [[1.0]]),
        ([], np.zeros((0, 0)), np.zeros((0, 1))),
    ):
        with pytest.raises(ValueError, match=r"network|capacity|conductance"):
            ThermalNetwork(np.array(capacity), np.array(between), np.array(outside))
