"""The clock of a log follows the time of day and never goes back."""

from datetime import UTC, datetime, timedelta

import pytest
from hypothesis import given, strategies as st

from thermaxis.runtime._backlog import from_us, to_us
from thermaxis.runtime.record._clock import SMALLEST_JUMP_S, LogClock, as_text

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


@pytest.mark.parametrize(
    ("set_by_s", "log_s", "said"),
    [
        ([0.0], 10.0, None),
        ([0.2], 10.2, None),
        ([-0.2], 10.0, None),
        ([-3600.0], 10.0, ("clock_set_back", {"by_s": 3600.0, "ahead_s": 3600.0})),
        ([7200.0], 7210.0, ("clock_jumped", {"by_s": 7200.0})),
        ([-3600.0, 1000.0], 10.0, ("clock_jumped_partly", {"log_by_s": 0.0, "ahead_s": 2600.0})),
        ([-3600.0, 5000.0], 1410.0, ("clock_jumped_partly", {"log_by_s": 1400.0, "ahead_s": 0.0})),
    ],
)
def test_the_log_follows_the_time_of_day_forward_and_uses_up_its_lead_first(
    set_by_s: list[float], log_s: float, said: tuple[str, dict[str, float]] | None
) -> None:
    clock = HandClock()
    log = LogClock(clock)
    clock.passed_s = 10.0
    log_us, change = log.read()
    for by_s in set_by_s:
        clock.start += timedelta(seconds=by_s)
        log_us, change = log.read()
    assert from_us(log_us) == START + timedelta(seconds=log_s)
    assert (change is None) == (said is None)
    if change is not None and said is not None:
        assert change.code == f"recording-{said[0]}"
        assert dict(change.values) | said[1] == dict(change.values)
    assert log.read() == (log_us, None)


def test_the_monotonic_time_of_a_log_time_is_when_it_comes() -> None:
    clock = HandClock()
    log = LogClock(clock)
    now_us, _ = log.read()
    assert log.monotonic_of(now_us + 2_500_000) == pytest.approx(5002.5)


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
def test_whatever_is_done_to_the_clock_the_log_time_never_goes_back_and_is_never_behind(
    steps: list[tuple[float, float]],
) -> None:
    clock = HandClock()
    log = LogClock(clock)
    last_us, _ = log.read()
    for passed_s, set_by_s in steps:
        clock.passed_s += passed_s
        clock.start += timedelta(seconds=set_by_s)
        now_us, change = log.read()
        assert now_us >= last_us
        assert now_us / 1e6 >= clock.utc().timestamp() - 1e-3
        # It passes as quickly as time does, unless the time of day jumps.
        if change is None or set_by_s < 0.0:
            assert now_us - last_us <= (passed_s + SMALLEST_JUMP_S) * 1e6 + 1000
        last_us = now_us


def test_times_are_written_with_three_decimals_in_utc() -> None:
    assert as_text(to_us(START)) == "2026-11-21T12:00:00.000Z"
    assert as_text(to_us(START) + 1_400) == "2026-11-21T12:00:00.001Z"
