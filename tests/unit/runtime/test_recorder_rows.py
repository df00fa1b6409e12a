"""Cells of a log: values that were measured, and nothing else."""

import math
import struct
from datetime import UTC, datetime, timedelta
from decimal import Decimal

from asyncua import ua
from hypothesis import given, strategies as st

from tests.unit.runtime.recording import channel, good
from thermaxis.runtime.record._rows import Cells, ChannelReader

NOON = datetime(2026, 11, 21, 12, 0, 0, 123456, tzinfo=UTC)
STAMP = "2026-11-21T12:00:00.123Z"


def read(answer: ua.DataValue, **more: float) -> Cells:
    return ChannelReader(channel("T_a_C", **more)).read(answer, 0)


def test_what_is_a_good_number_is_recorded_and_everything_else_left_out_with_its_reason() -> None:
    bad, uncertain = "BadSensorFailure", "UncertainSensorNotAccurate"
    for value, status, expected in (
        (22.5, "Good", ("22.5", "")),
        (True, "Good", ("1", "")),
        (7, "Good", ("7", "")),
        (1e-7, "Good", ("1e-07", "")),
        (2**60, "Good", ("1152921504606846976", "")),
        (0.0, bad, ("", "sent 0")),
        (0.0, uncertain, ("", "sent 0")),
        (math.nan, "Good", ("", "no number; sent nan")),
        (math.inf, "Good", ("", "no number; sent inf")),
        ("22,5\n# x", "Good", ("", "no number; sent 22_5___x")),
        ([1.0, 2.0], "Good", ("", "no number; sent _1_0__2_0_")),
        (None, "Good", ("", "no value")),
    ):
        cells = read(good(value, NOON, status))
        if value == 2**60:
            assert float(cells.value) == float(value)
        else:
            assert cells == Cells(expected[0], status, STAMP, expected[1]), value


@given(st.floats(width=32, allow_nan=False, allow_infinity=False))
def test_a_number_of_32_bits_is_written_as_the_decimal_that_was_meant(number: float) -> None:
    answer = ua.DataValue(Value=ua.Variant(number, ua.VariantType.Float))
    text = read(answer).value
    back = struct.unpack("f", struct.pack("f", float(text)))[0]
    assert back == number
    assert len(Decimal(text).normalize().as_tuple().digits) <= 9


def test_22_3_degrees_of_32_bits_are_22_3() -> None:
    single = struct.unpack("f", struct.pack("f", 22.3))[0]
    answer = ua.DataValue(Value=ua.Variant(single, ua.VariantType.Float))
    assert read(answer).value == "22.3"


def test_tenths_become_degrees_without_digits_that_nobody_measured() -> None:
    assert [read(good(n, NOON), factor=0.1).value for n in (3, 223, 221, 219)] == [
        "0.3",
        "22.3",
        "22.1",
        "21.9",
    ]
    assert read(good(295.15, NOON), offset=-273.15).value == "22"


def test_the_same_source_time_again_is_no_new_measurement() -> None:
    reader = ChannelReader(channel("T_a_C"))
    assert reader.read(good(22.5, NOON), 0).value == "22.5"
    for k in range(1, 4):
        again = reader.read(good(22.5, NOON), 1_000_000 * k)
        assert again == Cells("", "Good", STAMP, "unchanged")
    assert reader.read(good(22.5, NOON + timedelta(seconds=9)), 4_000_000).value == "22.5"
    assert (reader.asked, reader.recorded, reader.unchanged) == (5, 2, 3)


def test_an_unchanged_value_may_count_again_for_as_long_as_it_is_allowed() -> None:
    reader = ChannelReader(channel("T_a_C", repeat_unchanged_s=2.0))
    found = [reader.read(good(22.5, NOON), 1_000_000 * k) for k in range(5)]
    assert [cells.value for cells in found] == ["22.5", "22.5", "22.5", "", ""]
    assert [cells.remark for cells in found] == ["", *["unchanged"] * 4]


def test_a_touch_is_recorded_once_a_look_after_its_counter_has_risen() -> None:
    reader = ChannelReader(channel("touch_um", counter_node="i=9"))
    looks = ((4, 1.5), (4, 1.5), (5, 1.5), (5, 2.5), (5, 2.5), (None, 3.5), (6, 3.5), (0, 3.5))
    found = [
        reader.read(
            good(value, NOON + timedelta(seconds=k)),
            1_000_000 * k,
            good(count, NOON, "Good" if count is not None else "BadNoCommunication"),
        )
        for k, (count, value) in enumerate(looks)
    ]
    assert [cells.value for cells in found] == ["", "", "", "2.5", "", "", "", ""]
    assert [cells.remark for cells in found][4:6] == ["unchanged", "no counter"]
    assert reader.recorded == 1


def test_a_value_that_moves_under_one_source_time_was_measured_anew() -> None:
    reader = ChannelReader(channel("T_a_C"))
    reader.read(good(22.5, NOON), 0)
    moved = reader.read(good(22.6, NOON), 1_000_000)
    assert moved == Cells("22.6", "Good", STAMP, "source time unchanged")


def test_without_a_source_time_every_good_value_is_recorded() -> None:
    reader = ChannelReader(channel("T_a_C"))
    unset = datetime(1601, 1, 1), datetime(1970, 1, 1)  # noqa: DTZ001 - as servers send it
    for k, stamp in enumerate((None, None, *unset)):
        assert reader.read(good(22.5, stamp), 1_000_000 * k) == Cells("22.5", "Good", "", "")
    assert reader.unstamped == 4


def test_no_answer_is_an_empty_cell_with_its_reason() -> None:
    reader = ChannelReader(channel("T_a_C"))
    assert reader.read(None, 0) == Cells("", "BadNoCommunication", "", "")
    assert reader.not_good == {"BadNoCommunication": 1}


def test_a_status_that_nobody_has_heard_of_is_recorded_all_the_same() -> None:
    answer = ua.DataValue(Value=ua.Variant(1.0), StatusCode=ua.StatusCode(0x80AB0400))
    cells = read(answer)
    assert cells.value == ""
    assert cells.status.startswith("Bad")
