import time
from collections.abc import Mapping

import numpy as np
import pytest

from thermaxis.errors import MeasurementFileError
from thermaxis.files.runs._assemble import Assembled, assemble_readings, check_enough_readings
from thermaxis.positioning import BACKWARD, FORWARD, PositioningTest
from thermaxis.quantities import AxisKind


def listed(
    *rows: tuple[int, int, int, float],
    order: list[float] | None = None,
    channels: Mapping[str, np.ndarray] | None = None,
    targets: int = 2,
) -> Assembled:
    """Assemble rows of target index, cycle, approach and deviation, in lines 10, 11, 12 ..."""
    index, cycle, approach, deviation = zip(*rows, strict=True)
    return assemble_readings(
        path="run.csv",
        target=np.arange(targets) * 100.0,
        target_index=np.array(index),
        cycle=np.array(cycle),
        approach=np.array(approach),
        deviation=np.array(deviation, dtype=np.float64),
        line=np.arange(10, 10 + len(rows)),
        order=None if order is None else np.array(order),
        channels=channels,
    )


def run_of(deviation: np.ndarray, length: float = 100.0) -> PositioningTest:
    target = np.linspace(0.0, length, deviation.shape[0])
    return PositioningTest(AxisKind.LINEAR, target, deviation)


def test_every_reading_lands_at_its_target_cycle_and_approach() -> None:
    rows = [(i, j + 1, a, 100.0 * i + 10 * j + a) for j in (1, 0) for a in (1, 0) for i in range(2)]
    deviation = listed(*rows).deviation
    assert deviation.shape == (2, 2, 2)
    for i, j, a in np.ndindex(2, 2, 2):
        assert deviation[i, j, a] == 100 * i + 10 * j + a


def test_a_missing_reading_stays_missing() -> None:
    deviation = listed((0, 1, FORWARD, 1.0), (1, 2, BACKWARD, 2.0)).deviation
    assert np.count_nonzero(~np.isnan(deviation)) == 2
    assert np.isnan(deviation[0, 1, BACKWARD])


def test_order_and_channels_follow_their_readings() -> None:
    assembled = listed(
        (1, 1, BACKWARD, 5.0),
        (0, 1, FORWARD, 6.0),
        order=[2.0, 1.0],
        channels={"motor": np.array([30.0, 31.0])},
    )
    assert assembled.order is not None
    assert assembled.order[1, 0, BACKWARD] == 2.0
    assert assembled.channels["motor"][0, 0, FORWARD] == 31.0
    assert np.isnan(assembled.order[0, 0, BACKWARD])


def test_a_reading_given_twice_is_an_error_that_names_both_lines() -> None:
    with pytest.raises(
        MeasurementFileError, match=r"cycle 2, backward, target 100 .* line 11 and line 13"
    ):
        listed((0, 1, 0, 1.0), (1, 2, 1, 1.0), (0, 2, 1, 1.0), (1, 2, 1, 1.0))


def test_a_row_that_lists_a_reading_as_missing_does_not_hide_the_reading() -> None:
    for rows in ([(0, 1, 0, 1.5), (0, 1, 0, np.nan)], [(0, 1, 0, np.nan), (0, 1, 0, 1.5)]):
        assert listed(*rows).deviation[0, 0, 0] == 1.5


def test_cycles_count_from_one() -> None:
    with pytest.raises(MeasurementFileError, match="cycle 0 in line 11: cycles count from 1"):
        listed((0, 1, 0, 1.0), (0, 0, 0, 1.0))


def test_a_cycle_without_readings_stays_and_is_named() -> None:
    assembled = listed((0, 2, 0, 1.0), (1, 4, 0, 1.0))
    assert assembled.deviation.shape == (2, 4, 2)
    assert assembled.remarks == ("cycles without any reading: 1, 3",)


def test_no_readings_at_all_are_an_error() -> None:
    with pytest.raises(MeasurementFileError, match="no readings"):
        listed((0, 1, 0, np.nan))


def test_a_mistyped_cycle_number_is_refused_before_memory_is_taken() -> None:
    begin = time.process_time()
    with pytest.raises(MeasurementFileError, match=r"1000000000 \(line 11\) do not fit 2 readings"):
        listed((0, 1, 0, 1.0), (0, 10**9, 0, 1.0))
    assert time.process_time() - begin < 0.5


def test_thousands_of_further_columns_are_refused_before_memory_is_taken() -> None:
    one = np.array([1.0, 2.0])
    channels = {str(k): one for k in range(4000)}
    rows = [(0, 1, 0, 1.0), (1, 5000, 0, 1.0)]
    with pytest.raises(MeasurementFileError, match="4000 columns of further readings"):
        listed(*rows, channels=channels)


def test_a_million_readings_are_assembled_within_a_second() -> None:
    m, n = 100, 5000
    i, j, a = (k.reshape(-1) for k in np.indices((m, n, 2)))
    shuffled = np.random.default_rng(3).permutation(i.size)
    begin = time.process_time()
    assembled = assemble_readings(
        path="run.csv",
        target=np.arange(float(m)),
        target_index=i[shuffled],
        cycle=j[shuffled] + 1,
        approach=a[shuffled],
        deviation=(i * 2.0 + a)[shuffled],
        line=np.arange(i.size),
    )
    assert time.process_time() - begin < 1.0
    np.testing.assert_array_equal(assembled.deviation[7, :, 1], np.full(n, 15.0))


def test_two_readings_per_target_and_measured_approach_are_enough() -> None:
    deviation = np.full((3, 4, 2), np.nan)
    deviation[:, :2, FORWARD] = 1.0
    check_enough_readings(run_of(deviation), "run.csv")


def test_one_reading_where_two_are_needed_is_an_error_that_names_target_and_direction() -> None:
    deviation = np.zeros((3, 2, 2))
    deviation[1, 0, BACKWARD] = np.nan
    with pytest.raises(MeasurementFileError, match=r"target 2 \(50 mm\) has 1 reading backward"):
        check_enough_readings(run_of(deviation), "run.csv")
    deviation[1, 1, BACKWARD] = np.nan
    with pytest.raises(MeasurementFileError, match=r"target 2 \(50 mm\) has no reading backward"):
        check_enough_readings(run_of(deviation), "run.csv")


def test_one_run_is_enough_on_an_axis_over_two_metres_only() -> None:
    single = np.zeros((9, 1, 2))
    check_enough_readings(run_of(single, 2000.5), "run.csv")
    with pytest.raises(MeasurementFileError, match="at least 2"):
        check_enough_readings(run_of(single, 2000.0), "run.csv")
    single[4, 0, FORWARD] = np.nan
    with pytest.raises(MeasurementFileError, match=r"no reading forward; .* at least 1"):
        check_enough_readings(run_of(single, 2500.0), "run.csv")


def test_a_rotary_axis_has_no_such_rule() -> None:
    target = np.linspace(0.0, 2500.0, 9)
    test = PositioningTest(AxisKind.ROTARY, target, np.zeros((9, 1, 2)))
    with pytest.raises(MeasurementFileError, match="at least 2"):
        check_enough_readings(test, "run.csv")


def test_a_single_target_is_no_run() -> None:
    with pytest.raises(MeasurementFileError, match="only one target"):
        check_enough_readings(run_of(np.zeros((1, 5, 2))), "run.csv")


def test_an_axis_of_more_than_ten_thousand_targets_is_refused() -> None:
    for count, refused in ((10_000, False), (10_001, True)):
        index = np.repeat(np.arange(count), 2)
        cycle = np.tile([1, 2], count)
        columns = {
            "target": np.arange(float(count)),
            "target_index": index,
            "cycle": cycle,
            "approach": np.zeros_like(cycle),
            "deviation": np.ones(cycle.size),
            "line": np.arange(cycle.size),
        }
        if refused:
            with pytest.raises(MeasurementFileError, match="10001 different target positions"):
                assemble_readings(path="run.csv", **columns)
        else:
            assert assemble_readings(path="run.csv", **columns).deviation.shape == (count, 2, 2)
