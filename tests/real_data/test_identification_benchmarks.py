"""Published identification results, reproduced from their data.

The data sets are no part of the project; the expected numbers are facts about them.
"""

from pathlib import Path

import numpy as np
import pytest

from tests.polynomials import simulate_from_fitted_start
from tests.simple_rules import simulate_baseline
from thermaxis.thermal import (
    Baseline,
    Experiment,
    OeOptions,
    PolynomialResult,
    Start,
    arx,
    fit_baseline,
    fit_percent,
    oe,
    simulate_polynomial,
)

pytestmark = pytest.mark.real_data


@pytest.fixture
def thermal(real_data: Path) -> Path:
    return real_data / "thermal"


def dryer(thermal: Path) -> np.ndarray:
    return np.loadtxt(thermal / "daisy" / "dryer.dat")


def first_300(thermal: Path) -> tuple[PolynomialResult, np.ndarray]:
    rows = dryer(thermal)[:300]
    rows = rows - rows.mean(axis=0)
    return arx([Experiment(0.08, rows[:, :1], rows[:, 1])], 2, 2, 3), rows


def test_the_hair_dryer_gives_every_printed_digit(thermal: Path) -> None:
    result, rows = first_300(thermal)
    b_1, b_2, a_3, a_4 = result.parameters
    assert f"{b_1:.3f} {b_2:.4f} {a_3:.5f} {a_4:.5f}" == "-1.274 0.3935 0.06662 0.04448"
    np.testing.assert_allclose(
        result.parameters, [-1.27373875, 0.39354608, 0.06661788, 0.04448188], atol=5e-9
    )
    assert result.rows == 296
    assert result.mean_square == pytest.approx(0.00168531, abs=5e-9)
    at_rest = simulate_polynomial(result.model, rows[:, :1], start=Start.REST)
    assert fit_percent(rows[:, 1], at_rest) == pytest.approx(88.74, abs=5e-3)
    assert result.stable


def test_the_hair_dryer_is_validated_with_fitted_and_with_zero_state(thermal: Path) -> None:
    result, _ = first_300(thermal)
    rows = dryer(thermal)[799:900]
    rows = rows - rows.mean(axis=0)
    fitted = simulate_from_fitted_start(result.model, rows[:, :1], rows[:, 1])
    zero = simulate_polynomial(result.model, rows[:, :1], start=Start.REST)
    assert fit_percent(rows[:, 1], fitted) == pytest.approx(88.43, abs=5e-3)
    assert fit_percent(rows[:, 1], zero) == pytest.approx(67.35, abs=5e-3)


def test_the_hair_dryer_with_the_means_of_all_rows_gives_the_second_set(thermal: Path) -> None:
    all_rows = dryer(thermal)
    rows = all_rows - all_rows.mean(axis=0)
    result = arx([Experiment(0.08, rows[:500, :1], rows[:500, 1])], 2, 2, 3)
    np.testing.assert_allclose(
        result.parameters, [-1.27769592, 0.39733261, 0.06518310, 0.04496966], atol=5e-9
    )
    own = all_rows[:500] - all_rows[:500].mean(axis=0)
    other = arx([Experiment(0.08, own[:, :1], own[:, 1])], 2, 2, 3)
    np.testing.assert_allclose(other.parameters[:2], [-1.27653875, 0.39671061], atol=5e-9)


@pytest.mark.parametrize(
    ("nf", "published", "second_way", "tolerance"),
    [
        (2, [-0.53, -0.37, -0.51, -0.57, -0.01], [-0.530, -0.371, -0.511, -0.566, 0.013], 0.0025),
        (1, None, [-0.529, -0.380, -0.520, -0.549], 0.0015),
    ],
)
def test_the_gas_furnace_gives_the_transfer_function_of_the_book(
    thermal: Path,
    nf: int,
    published: list[float] | None,
    second_way: list[float],
    tolerance: float,
) -> None:
    rows = np.loadtxt(thermal / "seriesJ" / "seriesJ.csv", delimiter=",", skiprows=1)
    rows = rows - rows.mean(axis=0)
    test = Experiment(9.0, rows[:, :1], rows[:, 1])
    result = oe([test], nf, 3, 3, options=OeOptions(noise_order=2, lead_in_rows=5))
    count = 3 + nf
    np.testing.assert_allclose(result.parameters[:count], second_way, atol=tolerance)
    if published is not None:
        assert np.all(np.abs(result.parameters[:4] - published[:4]) < 0.006)
        # the book's last coefficient is one fifth of a standard error from zero
        assert abs(result.parameters[4] - published[4]) < 0.2 * result.std[4]
    else:
        np.testing.assert_allclose(result.std[:4], [0.075, 0.103, 0.108, 0.038], atol=6e-4)
    np.testing.assert_allclose(result.noise_coefficients, [1.53, -0.63], atol=0.005)
    assert result.mean_square == pytest.approx(0.0576, abs=3e-4)
    assert result.stable


def test_the_simulated_arx_record_gives_its_truth_within_three_deviations(thermal: Path) -> None:
    rows = np.loadtxt(thermal / "sysid_R" / "arxsim.csv", delimiter=",", skiprows=1)
    result = arx([Experiment(1.0, rows[:, 1:], rows[:, 0])], 1, 2, 2)
    assert np.all(np.abs(result.parameters - [-0.5, 0.6, -0.2]) < 3.0 * result.std)
    np.testing.assert_allclose(result.parameters, [-0.5260, 0.5881, -0.2256], atol=5e-5)
    assert result.std[0] == pytest.approx(0.016, abs=5e-4)
    assert result.noise_variance == pytest.approx(0.1034, abs=2e-4)


def test_the_simulated_output_error_record_gives_its_truth_and_biases_arx(thermal: Path) -> None:
    all_rows = np.loadtxt(thermal / "sysid_R" / "oesim.csv", delimiter=",", skiprows=1)
    rows = all_rows[:1533]
    test = Experiment(1.0, rows[:, 1:], rows[:, 0])
    result = oe([test], 1, 2, 2, options=OeOptions(start=Start.REST))
    assert np.all(np.abs(result.parameters - [0.6, -0.2, -0.5]) < 3.0 * result.std)
    np.testing.assert_allclose(result.parameters, [0.6026, -0.2157, -0.5162], atol=6e-5)
    np.testing.assert_allclose(result.std, [0.004, 0.015, 0.017], atol=6e-4)
    assert result.noise_variance == pytest.approx(0.0103, abs=6e-5)
    biased = arx([Experiment(1.0, all_rows[:, 1:], all_rows[:, 0])], 1, 2, 2)
    assert biased.parameters[0] == pytest.approx(-0.2902, abs=5e-5)
    assert "warning-residuals_not_white" in [w.code for w in biased.warnings]


def test_the_heating_system_follows_its_output_error_model(thermal: Path) -> None:
    rows = np.loadtxt(thermal / "daisy" / "heating_system.dat")
    u, y = rows[:, 1:2] - 6.0, rows[:, 2] - rows[0, 2]
    result = oe([Experiment(2.0, u[:400], y[:400])], 2, 2, 1, options=OeOptions(start=Start.REST))
    a_1, a_2, b_1, b_2 = result.parameters
    np.testing.assert_allclose([a_1, a_2], [0.869819, -0.846801], atol=2e-4)
    np.testing.assert_allclose([b_1, b_2], [-1.910756, 0.911795], atol=2e-4)
    assert result.fit_percent == pytest.approx(96.88, abs=0.01)
    on = simulate_polynomial(result.model, u, start=Start.REST)[400:]
    assert fit_percent(y[400:], on) == pytest.approx(80.82, abs=0.05)


def test_simple_models_on_the_machining_centre_are_those_of_the_reference(thermal: Path) -> None:
    path = thermal / "fl_thermal" / "fl_thermal_15s_rows_0_8891.csv"
    names = path.read_text(encoding="utf-8").splitlines()[0].split(",")
    rows = np.loadtxt(path, delimiter=",", skiprows=1)
    rows = rows - rows[:20].mean(axis=0)
    u = rows[:, [i for i, name in enumerate(names) if name.endswith("_C")]]
    assert u.shape[1] == 16
    held, averaged = [], []
    for channel in range(1, 6):
        y = rows[:, names.index(f"ch{channel}_um")]
        train = [Experiment(15.0, u[:6669], y[:6669])]
        for baseline, errors in ((Baseline.PERSISTENCE, held), (Baseline.AVERAGES_RIDGE, averaged)):
            simulated = simulate_baseline(fit_baseline(baseline, train), u, 15.0)
            errors.append(np.nanmean(np.abs(y[6669:] - simulated[6669:])))
    np.testing.assert_allclose(held, [11.57, 8.73, 48.38, 47.93, 4.56], atol=6e-3)
    np.testing.assert_allclose(averaged, [4.34, 3.27, 5.72, 5.91, 3.10], rtol=0.02)
