"""A frame where a log is expected: of polars, and by the names that those of pandas have."""

from collections.abc import Sequence
from datetime import datetime, timedelta
from typing import Any

import numpy as np
import polars as pl
import pytest
from hypothesis import given, strategies as st

from tests.refusals import refused
from thermaxis.files import read_model, read_thermal_log
from thermaxis.thermal import (
    ThermalLog,
    as_thermal_log,
    check_log,
    parse_input,
    records_of,
    simulate_log,
    verify,
)

START = datetime(2026, 3, 1, 8, 0)  # noqa: DTZ001 - a local time, as files have it
TIMES = [START + timedelta(seconds=10 * k) for k in range(3)]
MISSING = object()
"""Stands for the missing value of pandas, which is no float."""


class Column:
    """What is used of a series of pandas, whose brackets ask its index."""

    def __init__(self, values: Sequence[Any], name: str | None = None) -> None:
        self.iloc, self.name = list(values), name

    def __len__(self) -> int:
        return len(self.iloc)

    def __array__(self, *_: object, **__: object) -> np.ndarray:
        gaps = bool(self.iloc) and isinstance(self.iloc[0], timedelta)
        return np.array(self.iloc, dtype="timedelta64[us]" if gaps else object)

    def __sub__(self, first: datetime) -> np.ndarray:
        return np.array([value - first for value in self.iloc], dtype="timedelta64[us]")

    def astype(self, _: object) -> None:
        raise NotImplementedError

    def to_numpy(self, dtype: str, na_value: float) -> np.ndarray:
        return np.array([na_value if v is MISSING else v for v in self.iloc], dtype=dtype)


class Table:
    """What is used of a frame of pandas."""

    def __init__(
        self, columns: dict[str, Sequence[Any]], index: Sequence[Any], name: str | None = None
    ) -> None:
        self.columns = list(columns)
        self.index = Column(index, name)
        self._columns = {name: Column(values) for name, values in columns.items()}

    def __getitem__(self, name: str) -> Column:
        return self._columns[name]


def test_a_log_stays_what_it_is() -> None:
    log = ThermalLog.from_columns({"T_C": [1.0, 2.0]}, sample_time_s=1.0)
    assert as_thermal_log(log) is log


@given(
    steps=st.lists(st.floats(0.001, 1e6), min_size=1, max_size=20),
    first_s=st.floats(-1e6, 1e6),
    missing=st.integers(0, 20),
)
def test_a_log_goes_to_polars_and_back_the_same(steps, first_s, missing) -> None:
    time_s = first_s + np.cumsum([0.0, *steps])
    values = np.where(np.arange(time_s.size) == missing, np.nan, time_s**2)
    log = ThermalLog.from_columns({"T_a_C": values, "Z_um": -values}, time_s=time_s)
    frame = log.to_polars()
    assert frame.columns == ["time_s", "T_a_C", "Z_um"]
    assert frame["Z_um"].null_count() == np.isnan(values).sum()
    back = as_thermal_log(frame)
    assert np.array_equal(back.time_s, log.time_s)
    for name in log.columns:
        assert np.array_equal(back.columns[name], log.columns[name], equal_nan=True)
    assert back.units == log.units == {"T_a_C": "degC", "Z_um": "um"}
    from_first = frame.with_columns(time_s=pl.Series(time_s))
    assert as_thermal_log(from_first).origin_s == first_s


@pytest.mark.parametrize("zone", [None, "UTC", "Europe/Prague"])
def test_dates_of_polars_are_times_and_the_first_one_is_the_start(zone) -> None:
    when = pl.Series("when", TIMES).dt.replace_time_zone(zone)
    frame = pl.DataFrame({"T_C": [1, None, 3], "when": when, "on": [True, None, False]})
    log = as_thermal_log(frame, name="mill")
    assert log.time_s.tolist() == [0.0, 10.0, 20.0]
    assert log.start == when[0]
    assert (log.start.tzinfo is None) == (zone is None)
    assert log.columns["T_C"].tolist() == pytest.approx([1.0, np.nan, 3.0], nan_ok=True)
    assert log.columns["on"].tolist() == pytest.approx([1.0, np.nan, 0.0], nan_ok=True)
    assert log.name == "mill"


def test_a_frame_as_of_pandas_has_its_times_in_a_column_or_in_the_index() -> None:
    values = {"T_C": [1.0, MISSING, 3.0]}
    for frame in (Table(values, TIMES), Table({**values, "when": TIMES}, range(3))):
        log = as_thermal_log(frame)
        assert log.time_s.tolist() == [0.0, 10.0, 20.0]
        assert log.start == START
        assert list(log.columns) == ["T_C"]
        assert log.columns["T_C"].tolist() == pytest.approx([1.0, np.nan, 3.0], nan_ok=True)


def test_an_index_of_seconds_or_of_time_differences_has_the_times() -> None:
    values = {"T_C": [1.0, 2.0, 3.0]}
    gaps = [timedelta(seconds=s) for s in (5, 15, 25)]
    for frame in (Table(values, [5.0, 15.0, 25.0], "time_s"), Table(values, gaps)):
        log = as_thermal_log(frame)
        assert (log.time_s.tolist(), log.start, log.origin_s) == ([0.0, 10.0, 20.0], None, 5.0)


def test_a_column_of_seconds_counts_before_dates_which_give_the_start() -> None:
    frame = pl.DataFrame({"time_s": [5.0, 6.0, 8.0], "when": TIMES, "T_C": [1.0, 2.0, 3.0]})
    log = as_thermal_log(frame)
    assert log.time_s.tolist() == [0.0, 1.0, 3.0]
    assert (log.start, log.origin_s) == (START, 0.0)
    assert list(log.columns) == ["T_C"]


@pytest.mark.parametrize(
    ("frame", "code", "column"),
    [
        (pl.DataFrame({"T_C": [1.0, 2.0]}), "frame_without_times", ""),
        (pl.DataFrame({"when": TIMES, "T_C": TIMES[:3]}), "not_numbers", "T_C"),
        (pl.DataFrame({"when": TIMES, "T_C": ["a", "b", "c"]}), "not_numbers", "T_C"),
        (pl.DataFrame({"when": TIMES[::-1], "T_C": [1.0, 2.0, 3.0]}), "times_not_rising", "time_s"),
        (Table({"T_C": [1.0, 2.0]}, range(2)), "frame_without_times", ""),
        (pl.DataFrame({"T_C": [1.0], "time": ["8:00"]}), "frame_times_as_text", "time"),
        (Table({"T_C": [1.0], "time": ["8:00"]}, range(1)), "frame_times_as_text", "time"),
        (pl.DataFrame({"time_s": [], "T_C": []}), "frame_without_rows", ""),
        (pl.LazyFrame({"time_s": [1.0], "T_C": [1.0]}), "no_frame", ""),
        (np.zeros((2, 2)), "no_frame", ""),
    ],
)
def test_a_frame_that_is_no_log_is_refused_by_its_column(frame, code, column) -> None:
    with refused(code, file="mill", column=column):
        as_thermal_log(frame, name="mill")


def test_a_frame_stands_wherever_a_log_does(root) -> None:
    log = read_thermal_log(root / "examples" / "lathe_spindle.csv").resample(60.0)
    frame = log.to_polars()
    model = read_model(root / "examples" / "models" / "eps1.json")
    definition = parse_input("spindle=T_spindle_C-T_column_C")
    found = [
        (
            simulate_log(model, one).outputs["Z_um"].displacement_um[-1],
            verify(model, [one]).pooled["Z_um"].rmse_um,
            records_of([one], [definition], ["Z_um"]).highest_k[0],
            [finding.kind for finding in check_log(one, reference=one)],
        )
        for one in (log, frame)
    ]
    assert found[0] == found[1]


def test_a_frame_or_log_alone_is_taken_as_the_only_one(root) -> None:
    log = read_thermal_log(root / "examples" / "lathe_spindle.csv").resample(60.0)
    model = read_model(root / "examples" / "models" / "eps1.json")
    definition = parse_input("spindle=T_spindle_C-T_column_C")
    for one in (log, log.to_polars()):
        assert len(records_of(one, [definition], ["Z_um"]).logs) == 1
        assert len(verify(model, one).logs) == 1
    with refused("no_frame", file="frame"):
        records_of(np.zeros((2, 2)), [definition], ["Z_um"])
