"""Laws that the figures of ISO 230-2 obey for any run."""

import numpy as np
from hypothesis import given, settings, strategies as st
from hypothesis.extra.numpy import arrays

from thermaxis.positioning import Iso230_2Figures, iso230_2_figures

SCALARS = ("B", "M", "E", "R", "A")


@st.composite
def runs(draw: st.DrawFn) -> np.ndarray:
    m = draw(st.integers(2, 8))
    n = draw(st.integers(2, 6))
    return draw(arrays(np.float64, (m, n, 2), elements=st.floats(-1e3, 1e3, width=32)))


def close(a: object, b: object, scale: float = 1e3) -> bool:
    return bool(np.allclose(np.asarray(a), np.asarray(b), rtol=1e-9, atol=1e-9 * scale))


def at_most(a: object, b: object) -> bool:
    return bool(np.all(np.asarray(a) <= np.asarray(b) + 1e-9))


def same(f: Iso230_2Figures, g: Iso230_2Figures) -> bool:
    return all(close(getattr(f, k), getattr(g, k)) for k in (*SCALARS, "B_mean"))


@settings(derandomize=True, max_examples=40, deadline=None)
@given(runs())
def test_the_order_of_the_figures(x: np.ndarray) -> None:
    f = iso230_2_figures(x)
    assert at_most(f.M, f.E)
    assert at_most(f.E, f.A)
    assert at_most(f.E_unidirectional, f.E)
    assert at_most(f.A_unidirectional, f.A)
    assert at_most(f.E_unidirectional, f.A_unidirectional)
    assert at_most(f.R_unidirectional, f.A_unidirectional)
    assert at_most(f.R_unidirectional, f.R)
    assert at_most(f.R, f.A)
    assert at_most(abs(f.B_mean), f.B)
    assert at_most(f.B, min(float(f.R), float(f.E)))
    assert at_most(f.A, f.E + np.max(f.R_unidirectional))


@settings(derandomize=True, max_examples=40, deadline=None)
@given(runs(), st.floats(-1e3, 1e3))
def test_a_constant_offset_changes_nothing(x: np.ndarray, offset: float) -> None:
    assert same(iso230_2_figures(x), iso230_2_figures(x + offset))


@settings(derandomize=True, max_examples=40, deadline=None)
@given(runs(), st.floats(-10, 10))
def test_a_scale_error_changes_neither_reversal_nor_repeatability(
    x: np.ndarray, slope: float
) -> None:
    position = np.arange(x.shape[0])[:, None, None]
    f, g = iso230_2_figures(x), iso230_2_figures(x + slope * position)
    assert close(f.B, g.B)
    assert close(f.R, g.R)
    assert close(f.s, g.s)


@settings(derandomize=True, max_examples=40, deadline=None)
@given(runs())
def test_exchange_of_the_approaches_only_turns_the_mean_reversal(x: np.ndarray) -> None:
    f, g = iso230_2_figures(x), iso230_2_figures(x[:, :, ::-1])
    assert close(f.B_mean, -g.B_mean)
    assert all(close(getattr(f, k), getattr(g, k)) for k in SCALARS)
    assert close(f.E_unidirectional, g.E_unidirectional[::-1])
    assert close(f.R_unidirectional, g.R_unidirectional[::-1])
    assert close(f.A_unidirectional, g.A_unidirectional[::-1])


@settings(derandomize=True, max_examples=40, deadline=None)
@given(runs(), st.randoms(use_true_random=False))
def test_the_order_of_cycles_and_of_targets_changes_nothing(x: np.ndarray, random: object) -> None:
    rng = np.random.default_rng(random.randrange(2**31))  # hypothesis gives a random.Random
    f = iso230_2_figures(x)
    assert same(f, iso230_2_figures(x[:, rng.permutation(x.shape[1])]))
    assert same(f, iso230_2_figures(x[rng.permutation(x.shape[0])]))


@settings(derandomize=True, max_examples=40, deadline=None)
@given(runs(), st.floats(-20, 20))
def test_scaling_the_readings_scales_every_figure(x: np.ndarray, factor: float) -> None:
    f, g = iso230_2_figures(x), iso230_2_figures(factor * x)
    assert all(close(abs(factor) * getattr(f, k), getattr(g, k), 1e5) for k in SCALARS)
    assert close(factor * f.B_mean, g.B_mean, 1e5)


@settings(derandomize=True, max_examples=40, deadline=None)
@given(st.lists(runs(), min_size=1, max_size=1), st.integers(1, 4))
def test_many_runs_at_once_are_the_single_runs(xs: list[np.ndarray], k: int) -> None:
    batch = np.stack([xs[0] * (i + 1) for i in range(k)])
    together = iso230_2_figures(batch)
    for i in range(k):
        alone = iso230_2_figures(batch[i])
        assert all(getattr(together, key)[i] == getattr(alone, key) for key in SCALARS)


@settings(derandomize=True, max_examples=40, deadline=None)
@given(runs(), st.data())
def test_a_missing_reading_leaves_the_others_as_they_are(
    x: np.ndarray, data: st.DataObject
) -> None:
    """A cycle that is missing throughout one target equals that target without the cycle."""
    i = data.draw(st.integers(0, x.shape[0] - 1))
    j = data.draw(st.integers(0, x.shape[1] - 1))
    holed = x.copy()
    holed[i, j, :] = np.nan
    f = iso230_2_figures(holed)
    left = np.delete(x[i], j, axis=0)
    assert close(f.mean[i], left.mean(axis=0))
    if left.shape[0] > 1:
        assert close(f.s[i], left.std(axis=0, ddof=1))
    others = [k for k in range(x.shape[0]) if k != i]
    g = iso230_2_figures(x)
    assert close(f.mean[others], g.mean[others])
    assert close(f.s[others], g.s[others])
