"""The one type that every reader returns: shapes, freezing, consistency."""

import numpy as np
import pytest

from tests.refusals import refused
from thermaxis.positioning import PositioningTest, TimeSource
from thermaxis.quantities import AxisKind

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
