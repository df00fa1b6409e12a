"""Responses to a step and a sine are their formulas, their bands what sets of lags leave open."""

from functools import cache

import numpy as np
import pytest
from scipy.signal import freqs, lfilter

from thermaxis.thermal import (
    Experiment,
    ModalOptions,
    ModalPart,
    ModalResult,
    ThermalModel,
    frequency_response,
    modal,
    step_response,
)
from thermaxis.thermal.modal._average import tempered_weights
from thermaxis.thermal.modal._lags import columns_of, prior_precision

HZ = np.geomspace(1e-6, 1e-2, 9)


def lagged(u: np.ndarray, tau_s: float, step_s: float) -> np.ndarray:
    alpha = -np.expm1(-step_s / tau_s)
    return lfilter([0.0, alpha], [1.0, alpha - 1.0], u)


@cache
def found(lags: int = 2) -> ModalResult:
    rng = np.random.default_rng(1)
    u = lagged(np.repeat(rng.random(8) > 0.5, 60) * 8.0, 1200.0, 60.0)[:, None]
    y = 3.0 * u[:, 0] + 25.0 * lagged(u[:, 0], 4000.0, 60.0) + rng.normal(0.0, 0.4, u.size)
    options = ModalOptions(most_lags=lags, delays_s=(120.0,))
    return modal([Experiment(60.0, u, y)], input_names=["a"], options=options)


def test_gain_and_phase_are_those_of_the_closed_form_and_of_another_library() -> None:
    late = ModalPart("late", 0.0, np.array([5.0]), np.array([600.0]), delay_s=90.0)
    two = ModalPart("two", 1.5, np.array([4.0, -7.0]), np.array([300.0, 5000.0]))
    response = frequency_response(ThermalModel((late, two)), HZ)
    turn = 2.0 * np.pi * HZ * 600.0
    np.testing.assert_allclose(np.abs(response[:, 0]), 5.0 / np.sqrt(1.0 + turn**2))
    phase = -np.arctan(turn) - 2.0 * np.pi * HZ * 90.0
    np.testing.assert_allclose(np.angle(response[:, 0] * np.exp(-1j * phase)), 0.0, atol=1e-12)
    # 1.5 + 4 / (1 + 300 s) - 7 / (1 + 5000 s) over one denominator
    numerator = np.polyadd(
        1.5 * np.polymul([300.0, 1.0], [5000.0, 1.0]),
        np.polysub([4.0 * 5000.0, 4.0], [7.0 * 300.0, 7.0]),
    )
    denominator = np.polymul([300.0, 1.0], [5000.0, 1.0])
    _, wanted = freqs(numerator, denominator, worN=2.0 * np.pi * HZ)
    np.testing.assert_allclose(response[:, 1], wanted)


@pytest.mark.proof
def test_an_input_that_never_moved_has_no_band() -> None:
    u = np.stack([np.repeat([0.0, 8.0, 0.0, 5.0], 60), np.zeros(240)], axis=1)
    y = 3.0 * lagged(u[:, 0], 4000.0, 60.0) + np.random.default_rng(0).normal(0.0, 0.2, 240)
    result = modal([Experiment(60.0, u, y)], input_names=["a", "still"])
    assert result.posterior is not None
    plain, _ = result.posterior.deviations(lambda tau_s: np.ones((1, tau_s.size)))
    stated = [one.dc_gain is not None for one in result.std]
    assert stated == [True, False]
    assert (~np.isnan(plain[0])).tolist() == stated


def test_the_band_of_a_step_ends_at_the_interval_of_the_dc_gain() -> None:
    result = found()
    square, _ = result.posterior.deviations(lambda tau_s: -np.expm1(-1e9 / tau_s)[None, :])
    assert result.std[0].dc_gain is not None
    assert np.sqrt(square[0, 0]) == pytest.approx(result.std[0].dc_gain, rel=1e-6)
    lasting, _ = result.posterior._means(lambda tau_s: np.ones((1, tau_s.size)))
    assert np.sqrt(lasting[0, 0]) == pytest.approx(result.std[0].dc_gain, rel=0.03)  # all sets


def test_the_band_is_the_scatter_of_responses_that_are_drawn_set_by_set() -> None:
    result, rng = found(1), np.random.default_rng(3)
    posterior, times_s = result.posterior, np.array([0.0, 600.0, 3600.0, 40_000.0])
    rows = [
        (c, k, w)
        for c, weights in _weights(posterior)
        if c.moves is None
        for k, w in enumerate(weights)
        if w > 0.0
    ]
    share = np.array([w for _, _, w in rows])
    stated = step_response(result.model, times_s + 120.0)[:, 0]
    drawn = []
    for number in rng.choice(len(rows), size=600, p=share / share.sum()):
        c, k, _ = rows[number]
        members = c.compared.subsets.members[k]
        gains, covariance = _gains_of(c, k)
        g = posterior.unit[0] * rng.multivariate_normal(gains, covariance, check_valid="ignore")
        tau_s = c.time_constants_s[members]
        drawn.append(g[0] - np.expm1(-times_s[:, None] / tau_s) @ g[1:] - stated)
    on_grid = type(posterior)(
        tuple(c for c in posterior.components if c.moves is None),
        posterior.model,
        posterior.unit,
        posterior.dc_std,
    )
    square, _ = on_grid._means(lambda tau_s: -np.expm1(-times_s[:, None] / tau_s))
    scatter = np.sqrt(np.mean(np.square(drawn), axis=0))
    np.testing.assert_allclose(np.sqrt(square[:, 0]), scatter, rtol=0.15)


def _weights(posterior):
    return zip(posterior.components, tempered_weights(posterior.components), strict=True)


@cache
def products_of(design, noise) -> np.ndarray:
    return design.products(noise)[0]


def _gains_of(component, row: int) -> tuple[np.ndarray, np.ndarray]:
    """Return mean and covariance of the gains of a set, from the rows of its regressors."""
    design, item = component.design, component.compared
    members = item.subsets.members[[row]]
    gram = products_of(design, item.sizes.noise)
    columns = columns_of(design, members)[0]
    unit = np.ones(gram.shape[0])
    if item.unit is not None:
        unit[: design.gains] = item.unit
    kept = np.ones(columns.size, dtype=bool)
    kept[: members.size + 1] = item.subsets.gains[row, 0] != 0.0
    prior = prior_precision(design, item.sizes, members.size)[kept] / unit[columns[kept]] ** 2
    own = columns[kept]
    precision = gram[np.ix_(own, own)] + np.diag(prior)
    solved = np.linalg.solve(precision, gram[own, -1])
    variance = (gram[-1, -1] - gram[own, -1] @ solved) / design.readings
    mean, covariance = np.zeros(columns.size), np.zeros((columns.size,) * 2)
    mean[kept] = solved
    covariance[np.ix_(kept, kept)] = variance * np.linalg.inv(precision)
    wide = members.size + 1
    np.testing.assert_allclose(mean[:wide], item.subsets.gains[row, 0], rtol=1e-5, atol=1e-9)
    return mean[:wide], covariance[:wide, :wide]
