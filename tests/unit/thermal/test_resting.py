"""Which sensors of coarse steps rest, and beside what: learnt from a log."""

import numpy as np
import pytest

from thermaxis.thermal import ThermalLog, find_resting

DAY_S = 86_400.0


def log_of(days: float = 3.0, **columns: np.ndarray) -> ThermalLog:
    return ThermalLog.from_columns(columns, time_s=60.0 * np.arange(int(days * 1440)))


def air(days: float = 3.0) -> np.ndarray:
    """Return air that swings by 0.4 K three times an hour, and by 1 K a day."""
    time_s = 60.0 * np.arange(int(days * 1440))
    slow = np.sin(2.0 * np.pi * time_s / DAY_S)
    return np.round(22.0 + 0.5 * slow + 0.4 * np.sin(2.0 * np.pi * time_s / 1200.0), 1)


def column(days: float = 3.0) -> np.ndarray:
    time_s = 60.0 * np.arange(int(days * 1440))
    return np.round(22.0 + 0.25 * np.sin(2.0 * np.pi * (time_s - 7200.0) / DAY_S), 1)


def test_a_column_of_coarse_steps_moves_with_the_air_and_the_air_with_nothing() -> None:
    (found,) = find_resting(log_of(T_column_C=column(), T_air_C=air()))
    assert (found.name, found.moves_with) == ("T_column_C", "T_air_C")
    assert found.resolution_k == pytest.approx(0.1)
    assert found.rests_s > 3.0 * 3600.0
    assert 0.1 < found.rests_k < 1.0, "less than the air goes in a day"


def test_nothing_is_said_of_a_short_log_or_beside_what_tells_nothing() -> None:
    flat = np.full(column().size, 21.0)
    beside = np.round(20.0 + 0.1 * (np.arange(flat.size) // 7 % 2), 1)
    nothing = (
        log_of(0.9, T_column_C=column(0.9), T_air_C=air(0.9)),
        log_of(T_column_C=column(), T_flat_C=flat),
        log_of(T_column_C=column(), Z_um=air()),
        log_of(T_a_C=column(), T_b_C=column()),
        log_of(T_column_C=column() + 1e-4 * np.arange(flat.size) ** 0.5, T_air_C=air()),
    )
    assert [find_resting(log) for log in nothing] == [()] * len(nothing)
    assert len(find_resting(log_of(T_column_C=column(), T_flicker_C=beside))) == 0


def test_a_column_that_another_recorder_wrote_less_often_stood_as_long() -> None:
    seldom = np.where(np.arange(column().size) % 10 == 0, column(), np.nan)
    (whole,) = find_resting(log_of(T_column_C=column(), T_air_C=air()))
    (found,) = find_resting(log_of(T_column_C=seldom, T_air_C=air()))
    assert found.rests_s == pytest.approx(whole.rests_s, abs=1200.0)


def test_missing_values_and_sentinels_are_no_movements() -> None:
    whole = find_resting(log_of(T_column_C=column(), T_air_C=air()))
    holes, sentinel = air(), column()
    holes[500:520] = np.nan
    sentinel[1000:1010] = -999.0
    found = find_resting(log_of(T_column_C=sentinel, T_air_C=holes))
    assert found[0].rests_k == pytest.approx(whole[0].rests_k, rel=0.2)
