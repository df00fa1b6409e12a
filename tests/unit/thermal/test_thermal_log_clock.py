"""Rows in order of time, whatever the clock of the recorder did."""

import numpy as np
from hypothesis import given, strategies as st

from tests.refusals import refused
from thermaxis.codes import remark
from thermaxis.thermal.log import straighten_times


def test_times_in_order_stay_as_they_are() -> None:
    found = straighten_times(np.array([0.0, 1.0, 5.0]))
    assert found.order is None
    assert found.remarks == ()


def test_a_clock_set_back_by_an_hour_goes_on_from_the_last_time() -> None:
    time_s = np.concatenate((np.arange(0, 7200.0, 10), np.arange(3600.0, 9000.0, 10)))
    found = straighten_times(time_s, local=True)
    np.testing.assert_allclose(found.time_s, np.arange(time_s.size) * 10.0)
    values = {"back_s": 3600.0, "row": 720, "usual_s": 10.0}
    assert found.remarks == (remark("daylight_saving_ended", **values),)


def test_two_set_backs_add_up() -> None:
    piece = np.arange(0.0, 1000.0)
    found = straighten_times(np.concatenate((piece, piece, piece)))
    np.testing.assert_allclose(found.time_s, np.arange(3000.0))
    assert [one.code for one in found.remarks] == ["remark-clock_set_back"] * 2


def test_single_rows_out_of_order_are_sorted_in_with_their_values() -> None:
    found = straighten_times(np.array([0.0, 1, 2, 3, 5, 4, 6, 7]))
    np.testing.assert_array_equal(found.time_s, np.arange(8.0))
    values = found.take(np.array([0.0, 1, 2, 3, 5, 4, 6, 7]))
    np.testing.assert_array_equal(values, np.arange(8.0))
    assert found.remarks == (remark("rows_sorted_in", count=1),)


def test_a_file_from_the_latest_to_the_earliest_row_is_turned_round() -> None:
    found = straighten_times(np.arange(10.0)[::-1])
    np.testing.assert_array_equal(found.take(np.arange(10.0)), np.arange(10.0)[::-1])
    assert found.remarks == (remark("rows_turned_round"),)


def test_rows_of_one_time_become_one_and_fill_each_others_blanks() -> None:
    found = straighten_times(np.array([0.0, 1.0, 1.0, 2.0]))
    values = found.take(np.array([0.0, np.nan, 7.0, 2.0]))
    np.testing.assert_array_equal(values, [0.0, 7.0, 2.0])
    np.testing.assert_array_equal(found.take(np.array([0.0, 5.0, 7.0, 2.0])), [0.0, 5.0, 2.0])
    assert found.remarks == (remark("times_repeated", count=1, at_s=1.0),)


def test_a_clock_corrected_by_some_seconds_repeats_rows_that_are_left_out() -> None:
    found = straighten_times(np.array([0.0, 1, 2, 3, 4, 5, 3, 4, 5, 6, 7, 8]))
    np.testing.assert_array_equal(found.time_s, np.arange(9.0))
    assert found.remarks == (remark("rows_repeat_times", count=3, row=6, back_s=3.0),)


def test_rows_without_a_time_are_left_out_and_counted() -> None:
    found = straighten_times(np.array([0.0, np.nan, 2.0]))
    np.testing.assert_array_equal(found.take(np.array([1.0, 2.0, 3.0])), [1.0, 3.0])
    assert found.remarks == (remark("rows_without_time", count=1),)
    with refused("no_times"):
        straighten_times(np.array([np.nan, np.nan]))


@given(st.lists(st.one_of(st.integers(-50, 50), st.just(np.nan)), min_size=1, max_size=120))
def test_the_result_rises_strictly_and_every_value_is_of_the_file(times: list[float]) -> None:
    time_s = np.array(times, dtype=np.float64)
    if np.isnan(time_s).all():
        return
    found = straighten_times(time_s)
    assert bool((np.diff(found.time_s) > 0.0).all())
    taken = found.take(np.arange(time_s.size, dtype=np.float64))
    assert taken.size == found.time_s.size
    assert np.unique(taken).size == taken.size
