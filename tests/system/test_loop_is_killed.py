"""``thermaxis run`` is killed, frozen and ended beside a virtual lathe that somebody watches.

Limits are judged from the machine's side, by what acted on the tool.
"""

import signal
import time
from pathlib import Path

import pytest

from tests.in_time import LONGEST_S, in_time
from tests.system.loop_stand import (
    CYCLE_S,
    RATE_UM_PER_S,
    ROUNDED_UM,
    Watcher,
    broken_promises,
    campaign,
    excess,
    fastest_um_per_s,
    judge,
    lathe,
    read_runs,
    write_site,
)
from tests.system.programs import compensating, gaps
from thermaxis.compensation import SupervisorState

pytestmark = [pytest.mark.system, pytest.mark.real_time]

FROZEN_S = 5.0


def assert_two_seconds(tripped_s: float) -> None:
    """Assert that the watchdog acted when it should: a busy computer may be late, never early."""
    assert tripped_s >= 1.6
    assert in_time(tripped_s - 2.0, 0.4)


@pytest.mark.parametrize(("watchdog", "kills"), [("off", 5), ("2s", 4)])
def test_a_loop_killed_at_random_moments_moves_nothing_too_fast_and_forgets_a_second_at_most(
    tmp_path: Path, watchdog: str, kills: int
) -> None:
    seen = campaign(tmp_path, kills, watchdog=watchdog, seed=7)
    found = judge(seen)
    print(found)
    assert found.kills == kills
    assert found.active_when_killed
    assert found.moving_when_killed
    assert broken_promises(found) == {}
    assert seen.exit_code == 0
    assert abs(seen.looks[-1].effective_um) <= ROUNDED_UM


def test_a_frozen_loop_looks_before_it_writes_and_goes_on_from_where_the_watchdog_left_the_offset(
    tmp_path: Path,
) -> None:
    with lathe(tmp_path, watchdog="2s") as url, Watcher(url) as watcher:
        configuration = write_site(tmp_path, url)
        with compensating(configuration, "--enable") as loop:
            loop.wait_for_state(SupervisorState.ACTIVE, LONGEST_S)
            watcher.wait_until("it has gone somewhere", LONGEST_S, at_least_um=9.0)
            frozen_s = loop.signal(signal.SIGSTOP)
            time.sleep(FROZEN_S)
            assert watcher.last.effective_um == 0.0
            assert not watcher.last.alive
            thawed_s = loop.signal(signal.SIGCONT)
            watcher.wait_until("it is there again", LONGEST_S, at_least_um=9.0)
            loop.signal(signal.SIGTERM)
            assert loop.wait(60.0) == 0
    (cycles,) = read_runs(tmp_path)
    found = excess(watcher.looks)
    print(found)
    assert found.magnitude_um <= 0.0
    assert found.rate_um <= ROUNDED_UM
    assert found.step_um <= ROUNDED_UM
    assert found.return_um <= ROUNDED_UM
    assert gaps(cycles) == []
    tripped = next(look for look in watcher.looks if look.at_s > frozen_s and not look.alive)
    assert_two_seconds(tripped.at_s - frozen_s)
    first = next(look for look in watcher.looks if look.at_s > thawed_s and look.alive)
    began_um = abs(first.accepted_um) - RATE_UM_PER_S * (first.at_s - thawed_s)
    assert began_um <= 9.0 / 2.0  # from zero, a late cycle's way allowed; not from where it stood
    states = {c.state for c in cycles if c.monotonic_s > thawed_s}
    assert SupervisorState.ACTIVE in states
    assert SupervisorState.FAULT not in states


def test_a_loop_that_is_asked_to_end_fades_at_its_rate_and_at_once_when_it_is_asked_again(
    tmp_path: Path,
) -> None:
    with lathe(tmp_path, watchdog="off") as url, Watcher(url) as watcher:
        configuration = write_site(tmp_path, url)
        with compensating(configuration, "--enable") as loop:
            watcher.wait_until("it has gone somewhere", LONGEST_S, at_least_um=9.0)
            asked_s = loop.signal(signal.SIGTERM)
            assert loop.wait(LONGEST_S) == 0
            faded_s = time.monotonic() - asked_s
        time.sleep(0.2)
        assert watcher.last.effective_um == 0.0
        asked = next(look for look in watcher.looks if look.at_s >= asked_s - 0.1)
        shortest_s = abs(asked.effective_um) / RATE_UM_PER_S
        assert faded_s >= shortest_s - 2.0 * CYCLE_S
        assert in_time(faded_s - shortest_s, 3.0)
        with compensating(configuration) as loop:  # enabled as before
            loop.wait_for_state(SupervisorState.ACTIVE, LONGEST_S)
            watcher.wait_until("it has gone somewhere", LONGEST_S, at_least_um=9.0)
            loop.signal(signal.SIGTERM)
            loop.wait_for("it is being ended", LONGEST_S)
            asked_s = loop.signal(signal.SIGTERM)
            assert loop.wait(LONGEST_S) == 1
            assert in_time(time.monotonic() - asked_s, 3.0)
            assert "stands in the machine" in loop.tail()
        time.sleep(0.2)
        left_um = watcher.last.effective_um
        assert abs(left_um) > 5.0
        with compensating(configuration) as loop:
            loop.wait_for_state(SupervisorState.ACTIVE, LONGEST_S)
            loop.signal(signal.SIGTERM)
            assert loop.wait(60.0) == 0
    found = excess(watcher.looks)
    assert found.magnitude_um <= 0.0
    assert found.rate_um <= ROUNDED_UM
    assert found.step_um <= ROUNDED_UM
    assert fastest_um_per_s(watcher.looks) > 0.8 * RATE_UM_PER_S
    assert all(gaps(run) == [] for run in read_runs(tmp_path))


def test_a_second_loop_of_one_machine_is_refused_and_the_first_goes_on(tmp_path: Path) -> None:
    with lathe(tmp_path, watchdog="2s") as url, Watcher(url) as watcher:
        configuration = write_site(tmp_path, url)
        with compensating(configuration, "--enable") as first:
            first.wait_for_state(SupervisorState.ACTIVE, LONGEST_S)
            with compensating(configuration, "--enable") as second:
                assert second.wait(LONGEST_S) != 0
                assert f"(process {first.popen.pid}) already runs virtual lathe" in second.tail()
            beat = watcher.last.heartbeat
            time.sleep(5.0 * CYCLE_S)
            assert watcher.last.heartbeat > beat
            first.signal(signal.SIGTERM)
            assert first.wait(60.0) == 0
    assert excess(watcher.looks).rate_um <= ROUNDED_UM


def test_a_loop_whose_lines_nobody_reads_any_more_goes_on(tmp_path: Path) -> None:
    with lathe(tmp_path, watchdog="2s") as url, Watcher(url) as watcher:
        configuration = write_site(tmp_path, url)
        with compensating(configuration, "--enable") as loop:
            loop.wait_for("Z ", LONGEST_S)
            loop.stop_reading()
            watcher.wait_until("it works", LONGEST_S, at_least_um=9.0)
            loop.signal(signal.SIGTERM)
            assert loop.popen.wait(60.0) == 0
        assert watcher.last.alive or watcher.last.effective_um == 0.0
