"""The experiment that estimators take."""

import numpy as np
import pytest

from tests.refusals import refused
from thermaxis.thermal import Experiment
from thermaxis.thermal.log import common_shape


def _experiment(rows: int = 20, inputs: int = 2) -> Experiment:
    rng = np.random.default_rng(0)
    return Experiment(10.0, rng.normal(size=(rows, inputs)), rng.normal(size=rows), "calibration")


def test_an_experiment_does_not_change_with_the_array_it_was_made_of():
    u, y = np.zeros((10, 1)), np.arange(10.0)
    experiment = Experiment(1.0, u, y)
    u[0, 0], y[0] = 5.0, 7.0
    assert experiment.u[0, 0] == 0.0
    assert experiment.y[0] == 0.0
    with pytest.raises(ValueError, match="read-only"):
        experiment.y[0] = 1.0


def test_an_experiment_lasts_until_the_end_of_its_last_row_and_may_miss_values():
    u, y = np.zeros((20, 2)), np.arange(20.0)
    u[3, 1], y[5] = np.nan, np.nan
    experiment = Experiment(10.0, u, y)
    assert experiment.duration_s == 200.0
    assert np.isnan(experiment.u[3, 1])
    assert np.isnan(experiment.y[5])


def test_a_wrong_experiment_is_refused_with_its_name():
    for sample_time_s, u, y, says in (
        (0.0, np.zeros((9, 1)), np.zeros(9), "not_positive"),
        (np.nan, np.zeros((9, 1)), np.zeros(9), "not_positive"),
        (1.0, np.zeros(9), np.zeros(9), "wrong_shape"),
        (1.0, np.zeros((9, 0)), np.zeros(9), "wrong_shape"),
        (1.0, np.zeros((8, 1)), np.zeros(9), "wrong_shape"),
        (1.0, np.full((9, 1), np.inf), np.zeros(9), "infinite_value"),
        (1.0, np.zeros((9, 1)), np.array([-np.inf, *np.zeros(8)]), "infinite_value"),
        (1.0, np.full((9, 1), np.nan), np.zeros(9), "input_never_measured"),
        (1.0, np.zeros((9, 1)), np.array([np.nan, np.nan, *np.zeros(7)]), "too_few_measured"),
        (1.0, np.zeros((5, 1)), np.zeros(5), "too_few_rows"),
    ):
        with refused(says) as caught:
            Experiment(sample_time_s, u, y, "monday")
        assert caught.value.place.file == "monday"


def test_experiments_belong_together_only_with_the_same_inputs():
    assert common_shape([_experiment(), _experiment(30)]) == 2
    with refused("inputs_differ"):
        common_shape([_experiment(), _experiment(inputs=1)])
    with refused("no_log", key="experiments"):
        common_shape([])
