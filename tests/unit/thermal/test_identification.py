"""What identification refuses: records that do not determine the numbers of a model."""

from collections.abc import Mapping

import numpy as np
import pytest
from numpy.typing import NDArray

from tests.refusals import refused
from thermaxis.thermal import (
    Method,
    Records,
    ThermalLog,
    identify,
    identify_joint,
    parse_input,
    records_of,
)

Array = NDArray[np.float64]
ROWS = 400
WALK = 0.1 * np.cumsum(np.random.default_rng(0).normal(size=ROWS))
OTHER = 0.1 * np.cumsum(np.random.default_rng(1).normal(size=ROWS))
LAST_ROW = np.where(np.arange(ROWS) == ROWS - 1, 1.0, 0.0)


def records(a_c: Array, b_c: Array, outputs: Mapping[str, Array]) -> Records:
    time_s = 10.0 * np.arange(float(ROWS))
    columns = {"A_c": a_c, "B_c": b_c, **outputs}
    log = ThermalLog.from_columns(columns, time_s=time_s)
    return records_of([log], [parse_input("a=A_c"), parse_input("b=B_c")], list(outputs))


@pytest.mark.filterwarnings("ignore::RuntimeWarning")
def test_numbers_that_cannot_be_solved_for_are_an_error_in_words() -> None:
    for temperature_c, method in ((1e160 * WALK, Method.MODAL), (LAST_ROW, Method.OE)):
        with refused("rows_not_determining"):
            identify(records(temperature_c, np.zeros(ROWS), {"Z_um": WALK}), method=method)
    seen = records(WALK, 1e160 * OTHER, {"Z0_um": WALK, "Z1_um": 2.0 * WALK})
    with refused("rows_not_determining"):
        identify_joint(seen, "Z_um", "a", {"Z0_um": 0.0, "Z1_um": 1500.0})
