"""Virtual time: hours pass at once, in the right order, and nothing real is skipped."""

import asyncio
import time
from datetime import UTC, datetime, timedelta

import pytest
from hypothesis import given, strategies as st

from thermaxis.runtime import START_S, START_UTC, VirtualClock, run_in_virtual_time


def test_thirty_days_pass_at_once() -> None:
    async def wait() -> float:
        clock = VirtualClock()
        await clock.sleep_until(START_S + 30 * 86_400.0)
        return clock.monotonic_s()

    began_s = time.monotonic()
    assert run_in_virtual_time(wait()) == pytest.approx(START_S + 30 * 86_400.0, abs=1e-6)
    assert time.monotonic() - began_s < 5.0


@given(st.lists(st.floats(0.0, 1e5), min_size=1, max_size=20))
def test_sleepers_wake_in_the_order_of_their_times(delays: list[float]) -> None:
    woken: list[float] = []

    async def sleeper(clock: VirtualClock, until_s: float) -> None:
        await clock.sleep_until(until_s)
        assert clock.monotonic_s() == pytest.approx(until_s, abs=1e-6)
        woken.append(until_s)

    async def all_of_them() -> None:
        clock = VirtualClock()
        async with asyncio.TaskGroup() as group:
            for delay in delays:
                group.create_task(sleeper(clock, START_S + delay))

    run_in_virtual_time(all_of_them())
    assert woken == sorted(woken)
    assert len(woken) == len(delays)


def test_a_time_that_has_passed_is_not_waited_for() -> None:
    async def wait() -> float:
        clock = VirtualClock()
        await clock.sleep_until(0.0)
        return clock.monotonic_s()

    assert run_in_virtual_time(wait()) == START_S


def test_work_takes_no_virtual_time() -> None:
    async def work() -> float:
        clock = VirtualClock()
        for _ in range(1000):
            await asyncio.sleep(0)
        return clock.monotonic_s()

    assert run_in_virtual_time(work()) == START_S


def test_a_timeout_fires_at_its_time_and_not_before() -> None:
    async def wait() -> float:
        clock = VirtualClock()
        with pytest.raises(TimeoutError):
            async with asyncio.timeout(3600.0):
                await asyncio.Event().wait()
        return clock.monotonic_s()

    assert run_in_virtual_time(wait()) == pytest.approx(START_S + 3600.0)


def test_a_thread_is_waited_for_and_no_timeout_fires_meanwhile() -> None:
    async def wait() -> tuple[str, float]:
        clock = VirtualClock()
        async with asyncio.timeout(0.001):
            answer = await asyncio.to_thread(lambda: time.sleep(0.05) or "done")
        return answer, clock.monotonic_s()

    assert run_in_virtual_time(wait()) == ("done", START_S)


def test_sockets_inside_the_program_work_without_time_going_by() -> None:
    async def echo(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        writer.write(await reader.readexactly(4))
        writer.close()
        await writer.wait_closed()

    async def talk() -> tuple[bytes, float]:
        server = await asyncio.start_server(echo, "127.0.0.1", 0)
        host, port = server.sockets[0].getsockname()
        async with server:
            reader, writer = await asyncio.open_connection(host, port)
            async with asyncio.timeout(0.001):
                writer.write(b"ping")
                answer = await reader.readexactly(4)
            writer.close()
            await writer.wait_closed()
        return answer, VirtualClock().monotonic_s()

    assert run_in_virtual_time(talk()) == (b"ping", START_S)


def test_waiting_for_ever_is_an_error_and_no_hanging_test(monkeypatch) -> None:
    monkeypatch.setattr("thermaxis.runtime._virtual_time.LONGEST_STANDSTILL_S", 0.05)

    async def wait() -> None:
        await asyncio.Event().wait()

    with pytest.raises(RuntimeError, match="nothing will ever happen"):
        run_in_virtual_time(wait())


def test_the_time_of_day_can_be_set_and_the_monotonic_time_stays() -> None:
    async def change() -> None:
        clock = VirtualClock()
        assert clock.utc() == START_UTC
        await clock.sleep_until(START_S + 60.0)
        assert clock.utc() == START_UTC + timedelta(minutes=1)
        clock.change_time_of_day(-3600.0)
        assert clock.utc() == START_UTC - timedelta(minutes=59)
        assert clock.monotonic_s() == START_S + 60.0

    run_in_virtual_time(change())


def test_a_clock_begins_where_it_is_told() -> None:
    async def read() -> datetime:
        return VirtualClock(datetime(2026, 5, 1, tzinfo=UTC)).utc()

    assert run_in_virtual_time(read()) == datetime(2026, 5, 1, tzinfo=UTC)
