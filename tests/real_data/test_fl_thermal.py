"""The public record FL_THERMAL: temperatures chosen and models learned without seeing the end."""

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from thermaxis.thermal._experiment import Experiment
from thermaxis.thermal._selection import SelectionOptions, SelectionResult, select
from thermaxis.thermal._selection_sensors import SensorFault, check_candidates, sensor_noise_k
from thermaxis.thermal._thermal_model import simulate_modal

pytestmark = pytest.mark.real_data

Array = NDArray[np.float64]
STEP_S = 15.0
CHANNELS = tuple(f"ch{i}_um" for i in range(1, 6))
CANDIDATES = tuple(f"t{i}_C" for i in range(1, 17))
LEARN, LAST = 6669, 8892
WANTED_UM = 3.0
PUBLISHED_UM = np.array([3.56, 3.76, 3.70, 3.46, 4.28])
"""Attention model of the record's authors. [µm]"""


@pytest.fixture(scope="module")
def record(real_data: Path) -> dict[str, Array]:
    path = real_data / "thermal/fl_thermal/fl_thermal_15s_rows_0_8891.csv"
    with path.open(encoding="utf-8") as stream:
        heading = stream.readline().strip().split(",")
        values = np.loadtxt(stream, delimiter=",")
    return dict(zip(heading, values.T, strict=True))


@pytest.fixture(scope="module")
def u(record: dict[str, Array]) -> Array:
    raw = np.column_stack([record[name] for name in CANDIDATES])
    return raw - raw[:20].mean(axis=0)


@pytest.fixture(scope="module")
def y(record: dict[str, Array]) -> Array:
    raw = np.column_stack([record[name] for name in CHANNELS])
    return raw - raw[:20].mean(axis=0)


def means(values: Array, rows: int) -> Array:
    count = values.shape[0] // rows
    return values[: count * rows].reshape(count, rows, -1).mean(axis=1)


def learned(
    u: Array, y: Array, step_s: float = STEP_S, options: SelectionOptions | None = None
) -> SelectionResult:
    outputs = {name: [Experiment(step_s, u, y[:, i])] for i, name in enumerate(CHANNELS)}
    return select(outputs, candidate_names=CANDIDATES, options=options)


def errors_um(
    result: SelectionResult, u: Array, y: Array, judge: slice, step_s: float = STEP_S
) -> Array:
    found = []
    for i, name in enumerate(CHANNELS):
        model = result.outputs[name].model
        columns = [CANDIDATES.index(part.input_name) for part in model.parts]
        residual = y[:, i] - simulate_modal(model, step_s, u[:, columns])
        found.append(np.mean(np.abs(residual[judge])))
    return np.array(found)


@pytest.mark.parametrize("rows", [1, 4, 20])
def test_all_channels_stay_within_three_micrometres_in_free_run(
    u: Array, y: Array, rows: int
) -> None:
    a, b, step_s = means(u, rows), means(y, rows), STEP_S * rows
    last = LEARN // rows
    result = learned(a[:last], b[:last], step_s)
    found = errors_um(result, a, b, slice(-(-LEARN // rows), None), step_s)
    assert np.all(found <= WANTED_UM), found
    assert np.all(found < PUBLISHED_UM)
    assert result.stable
    assert all(len(part.gains) <= 3 for o in result.outputs.values() for part in o.model.parts)


def test_nothing_after_the_rows_learned_from_changes_the_models(u: Array, y: Array) -> None:
    other = u.copy()
    other[LEARN:] = 99.0
    a, b = learned(u[:LEARN], y[:LEARN]), learned(other[:LEARN], y[:LEARN])
    assert errors_um(a, u, y, slice(0, LEARN)) == pytest.approx(errors_um(b, u, y, slice(0, LEARN)))


@pytest.mark.parametrize(("learn", "judge"), [((0, 4445), (4445, 6669)), ((0, 5557), (5557, 7780))])
def test_other_splits_are_on_average_as_good_as_the_best_baseline(
    u: Array, y: Array, learn: tuple[int, int], judge: tuple[int, int]
) -> None:
    rows, wanted = slice(*learn), slice(*judge)
    own = errors_um(learned(u[rows], y[rows]), u, y, wanted)
    static = learned(u[rows], y[rows], options=SelectionOptions(lag_sets_s=((),)))
    fixed = SelectionOptions(lag_sets_s=((300.0, 1200.0, 3600.0, 10800.0),))
    averages = learned(u[rows], y[rows], options=fixed)
    held = np.mean(np.abs(y[wanted] - y[learn[1] - 1]), axis=0)
    baselines = [errors_um(static, u, y, wanted), errors_um(averages, u, y, wanted), held]
    assert np.mean(own) <= 1.02 * min(float(np.mean(b)) for b in baselines)
    assert np.max(own / np.min(baselines, axis=0)) < 1.7


def test_the_static_baseline_is_ridge_regression(u: Array, y: Array) -> None:
    options = SelectionOptions(lag_sets_s=((),), sensor_uncertainties_k=(0.1,), mean_s=STEP_S)
    result = learned(u[:LEARN], y[:LEARN], options=options)
    noise = sensor_noise_k([Experiment(STEP_S, u[:LEARN], y[:LEARN, 0])])
    left = u[:LEARN].T @ u[:LEARN] / LEARN + np.diag(0.01 + noise**2)
    gains = np.linalg.solve(left, u[:LEARN].T @ y[:LEARN] / LEARN)
    for i, name in enumerate(CHANNELS):
        found = {p.input_name: p.direct_gain for p in result.outputs[name].model.parts}
        np.testing.assert_allclose([found[c] for c in CANDIDATES], gains[:, i], rtol=1e-8)


def test_the_noisy_sensor_of_the_record_is_the_only_finding(u: Array, y: Array) -> None:
    own = Experiment(STEP_S, u[:LEARN], y[:LEARN, 0])
    findings = check_candidates([own], CANDIDATES)
    assert [(f.name, f.fault) for f in findings] == [("t16_C", SensorFault.NOISY)]
    noise = dict(zip(CANDIDATES, sensor_noise_k([own]), strict=True))
    assert 0.08 < noise.pop("t16_C") < 0.13
    assert max(noise.values()) < 0.021


@pytest.mark.parametrize("column", range(16))
def test_a_frozen_sensor_is_found_and_its_harm_is_bounded(u: Array, y: Array, column: int) -> None:
    broken = u.copy()
    broken[2200:4400, column] = broken[2200, column]
    result = learned(broken[:LEARN], y[:LEARN])
    assert [f.name for f in result.findings if f.left_out] == [CANDIDATES[column]]
    healthy = learned(u[:LEARN], y[:LEARN])
    judge = slice(LEARN, LAST)
    before, after = errors_um(healthy, u, y, judge), errors_um(result, broken, y, judge)
    assert np.all(after < np.maximum(2.5 * before, 1.5 * WANTED_UM))


def test_two_exchanged_sensors_are_named(u: Array, y: Array, record: dict[str, Array]) -> None:
    start = np.array([record[name][:20].mean() for name in CANDIDATES])
    absolute = u + start
    absolute[3000:, [4, 8]] = absolute[3000:, [8, 4]]
    own = Experiment(STEP_S, (absolute - start)[:LEARN], y[:LEARN, 0])
    findings = {f.name: f.fault for f in check_candidates([own], CANDIDATES)}
    assert findings["t5_C"] is SensorFault.EXCHANGED
    assert findings["t9_C"] is SensorFault.EXCHANGED
