"""The clock of a log follows the time of day and never goes back."""

from datetime import UTC, datetime, timedelta

import pytest
from hypothesis import given, strategies as st

from thermaxis.runtime.record._clock import LARGEST_SLEW_S, LogClock, as_text, moment_of

START = datetime(2026, 11, 21, 12, 0, 0, tzinfo=UTC)


class HandClock:
    """A clock that a test winds."""

    def __init__(self, start: datetime = START) -> None:
        self.passed_s = 0.0
        self.start = start

    def monotonic_s(self) -> float:
        return 5000.0 + self.passed_s

    def utc(self) -> datetime:
        return self.start + timedelta(seconds=self.passed_s)

    async def sleep_until(self, monotonic_s: float) -> None:
        self.passed_s = monotonic_s - 5000.0


def test_the_log_time_is_the_time_of_day() -> None:
    clock = HandClock()
    log = LogClock(clock)
    clock.passed_s = 90.5
    log_ms, change = log.read()
    assert moment_of(log_ms) == START + timedelta(seconds=90.5)
    assert change is None
    assert log.ahead_s == 0.0


def test_a_clock_set_back_leaves_the_log_going_on_and_says_so() -> None:
    clock = HandClock()
    log = LogClock(clock)
    clock.passed_s = 10.0
    clock.start -= timedelta(hours=1)
    log_ms, change = log.read()
    assert moment_of(log_ms) == START + timedelta(seconds=10)
    assert change is not None
    assert (change.by_s, change.log_by_s, change.ahead_s) == (-3600.0, 0.0, 3600.0)
    assert change.message.code == "recording-clock_set_back"
    clock.passed_s = 20.0
    log_ms, change = log.read()
    assert moment_of(log_ms) == START + timedelta(seconds=20)
    assert change is None


def test_a_clock_set_forward_takes_the_log_with_it() -> None:
    clock = HandClock()
    log = LogClock(clock)
    clock.passed_s = 10.0
    clock.start += timedelta(hours=2)
    log_ms, change = log.read()
    assert moment_of(log_ms) == START + timedelta(hours=2, seconds=10)
    assert change is not None
    assert (change.by_s, change.log_by_s, change.ahead_s) == (7200.0, 7200.0, 0.0)


@pytest.mark.parametrize(
    ("forward_s", "log_by_s", "ahead_s"),
    [(3600.0, 0.0, 0.0), (1000.0, 0.0, 2600.0), (5000.0, 1400.0, 0.0)],
)
def test_a_clock_that_was_set_back_and_forward_again_uses_up_the_lead_first(
    forward_s: float, log_by_s: float, ahead_s: float
) -> None:
    clock = HandClock()
    log = LogClock(clock)
    clock.start -= timedelta(hours=1)
    log.read()
    clock.start += timedelta(seconds=forward_s)
    log_ms, change = log.read()
    assert change is not None
    assert (change.log_by_s, change.ahead_s) == (log_by_s, ahead_s)
    assert moment_of(log_ms) == START + timedelta(seconds=log_by_s)
    code = "recording-clock_jumped" if log_by_s == forward_s else "recording-clock_jumped_partly"
    assert change.message.code == code


def test_a_small_difference_is_worked_off_slowly() -> None:
    clock = HandClock()
    log = LogClock(clock)
    clock.start += timedelta(seconds=1)
    clock.passed_s = 100.0
    log_ms, change = log.read()
    assert change is None
    assert log_ms / 1e3 - START.timestamp() == pytest.approx(100.0 + 100.0 * 5e-4, abs=1e-6)
    for _ in range(30):
        clock.passed_s += 100.0
        log_ms, change = log.read()
        assert change is None
    assert moment_of(log_ms) == clock.utc()


def test_the_monotonic_time_of_a_log_time_is_when_it_comes() -> None:
    clock = HandClock()
    log = LogClock(clock)
    now_ms, _ = log.read()
    assert log.monotonic_of(now_ms + 2500.0) == pytest.approx(5002.5)


@given(
    st.lists(
        st.tuples(
            st.floats(0.0, 5000.0),
            st.one_of(st.just(0.0), st.floats(-1e6, 1e6), st.floats(-3.0, 3.0)),
        ),
        min_size=1,
        max_size=40,
    )
)
def test_whatever_is_done_to_the_clock_the_log_time_never_goes_back(
    steps: list[tuple[float, float]],
) -> None:
    clock = HandClock()
    log = LogClock(clock)
    last_ms, _ = log.read()
    for passed_s, set_by_s in steps:
        clock.passed_s += passed_s
        clock.start += timedelta(seconds=set_by_s)
        now_ms, change = log.read()
        if passed_s > 0.001:
            assert now_ms > last_ms
        assert now_ms >= last_ms
        # The log is as far ahead of the time of day as it says, but for what is worked off.
        off_s = now_ms / 1e3 - clock.utc().timestamp() - log.ahead_s
        assert abs(off_s) <= LARGEST_SLEW_S + 1e-3
        if change is not None:
            assert abs(change.by_s) > LARGEST_SLEW_S
            assert abs(off_s) < 1e-3
        last_ms = now_ms


def test_times_are_written_with_three_decimals_in_utc() -> None:
    start_ms = START.timestamp() * 1000.0
    assert as_text(start_ms) == "2026-11-21T12:00:00.000Z"
    assert as_text(start_ms + 1.4) == "2026-11-21T12:00:00.001Z"
    assert as_text(start_ms + 999.7) == "2026-11-21T12:00:01.000Z"
