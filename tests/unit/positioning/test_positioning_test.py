"""The one type that every reader returns: shapes, freezing, consistency."""

import numpy as np
import pytest

from tests.refusals import refused
from thermaxis.positioning import PositioningTest, TimeSource
from thermaxis.quantities import AxisKind

from .builders import run

X = np.zeros((3, 4, 2))
P = np.array([0.0, 1.0, 2.0])


def make(**fields: object) -> PositioningTest:
    return PositioningTest(**{"kind": AxisKind.LINEAR, "target": P, "deviation": X, **fields})


def test_a_wrong_run_is_an_error() -> None:
    for fields, words in (
        ({"target": P[:2]}, "wrong_shape"),
        ({"deviation": np.zeros((3, 2, 4))}, "wrong_shape"),
        ({"deviation": np.zeros((3, 0, 2))}, "no_readings"),
        ({"deviation": np.full((3, 4, 2), np.nan)}, "no_readings"),
        ({"target": np.array([0.0, 2.0, 1.0])}, "not_rising"),
        ({"target": np.array([0.0, 1.0, 1.0])}, "not_rising"),
        ({"target": np.array([0.0, 1.0, np.nan])}, "not_rising"),
        ({"target": np.zeros((3, 1))}, "wrong_shape"),
        ({"deviation": np.full((3, 4, 2), np.inf)}, "not_finite"),
        ({"channels": {"t": np.zeros(3)}}, "wrong_shape"),
        ({"time_source": TimeSource.FILE}, "time_source_unfit"),
        ({"time_s": X, "order": X}, "time_source_unfit"),
        ({"time_source": TimeSource.ORDER, "order": np.zeros((3, 4, 1))}, "wrong_shape"),
        (
            {"time_source": TimeSource.ORDER, "order": np.full((3, 4, 2), np.nan)},
            "value_missing_for_reading",
        ),
    ):
        with refused(words):
            make(**fields)


def test_a_run_cannot_be_changed_from_outside() -> None:
    source = X.copy()
    test = make(deviation=source, header={"axis": "X"})
    source[0, 0, 0] = 9.0
    assert test.deviation[0, 0, 0] == 0.0
    with pytest.raises(ValueError, match="read-only"):
        test.deviation[0, 0, 0] = 1.0
    with pytest.raises(TypeError):
        test.header["axis"] = "Y"


def test_the_resolution_is_that_of_the_readings_whatever_few_of_them_do() -> None:
    rng = np.random.default_rng(1)
    level = np.round(rng.normal(0.0, 3.0, (6, 1, 2)), 1) * np.ones((6, 5, 2))
    assert run(level).repeats_exactly
    within_rounding = level * (1.0 + 1e-15 * rng.integers(-3, 4, level.shape))
    assert run(within_rounding).repeats_exactly
    assert run(within_rounding).resolution == pytest.approx(0.1)
    one_out = level.copy()
    one_out[2, 2, 0] += 30.0
    assert run(one_out).resolution == pytest.approx(0.1)
    assert run(np.round(level + rng.normal(0.0, 0.4, level.shape))).resolution == 1.0
