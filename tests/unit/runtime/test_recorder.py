"""The recorder in virtual time: rates, lost connections, full disks, clocks that jump."""

import asyncio
import errno
import os
import re
from collections.abc import Callable
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest
from asyncua import ua
from hypothesis import given, settings as settings_of, strategies as st

from tests.unit.runtime.recording import (
    START,
    Recording,
    SimulatedSession,
    at,
    channel,
    good,
    marks_of,
    moving,
    rows_of,
    settings,
)
from tests.unit.runtime.simulated import freeze
from thermaxis.codes import Message
from thermaxis.files import read_thermal_log
from thermaxis.messages import sentence_of
from thermaxis.runtime import VirtualClock, run_in_virtual_time
from thermaxis.runtime.record import bytes_per_day, try_once

NAME = "lathe-2026-11-21.csv"


@pytest.fixture(autouse=True)
def _quick_disk(monkeypatch: pytest.MonkeyPatch) -> None:
    """Hours in seconds: nobody waits for the disk itself."""
    monkeypatch.setattr(os, "fsync", lambda _descriptor: None)


def column(path: Path, index: int) -> list[str]:
    return [cells[index] for cells in rows_of(path)]


def test_each_channel_is_read_at_its_rate_and_slower_ones_leave_empty_cells(
    tmp_path: Path,
) -> None:
    recording = Recording(settings(channel("T_a_C"), channel("T_b_C", 5000)), tmp_path)
    summary = recording.run(60.0)
    assert column(tmp_path / NAME, 0) == [at(k) for k in range(60)]
    assert column(tmp_path / NAME, 1) == [str(43200 + k) for k in range(60)]
    assert column(tmp_path / NAME, 2) == [str(43200 + k) if k % 5 == 0 else "" for k in range(60)]
    assert (summary.rows, summary.lost, summary.error) == (60, 0, "")
    assert [c.recorded for c in summary.channels] == [60, 12]


def test_channels_of_one_rate_are_read_with_one_request(tmp_path: Path) -> None:
    channels = [channel("T_a_C"), channel("T_b_C"), channel("T_c_C", 2000)]
    recording = Recording(settings(*channels), tmp_path)
    recording.run(4.0)
    fast, slow = ("ns=2;s=T_a_C", "ns=2;s=T_b_C"), ("ns=2;s=T_c_C",)
    assert [nodes for _, nodes in recording.sessions["control"].asked] == [
        fast, slow, fast, fast, slow, fast,
    ]  # fmt: skip


def test_readings_begin_at_full_periods_of_the_day_so_that_logs_of_two_recorders_meet(
    tmp_path: Path,
) -> None:
    start = START + timedelta(seconds=0.337)
    recording = Recording(
        settings(channel("T_a_C", 200), channel("T_b_C", 10_000)), tmp_path, start
    )
    recording.run(20.0)
    assert column(tmp_path / NAME, 0) == [at(0.4 + 0.2 * k) for k in range(100)]
    slow = [time for time, _, value in rows_of(tmp_path / NAME) if value]
    assert slow == [at(0.4), at(10), at(20)]


def test_a_recording_lasts_as_long_as_it_was_told(tmp_path: Path) -> None:
    recording = Recording(settings(channel("T_a_C", 5000)), tmp_path)
    summary = recording.run(2 * 3600.0)
    assert summary.rows == 2 * 720
    assert recording.ended == START + timedelta(hours=2)
    log = read_thermal_log(tmp_path / NAME)
    assert (log.rows, log.duration_s, log.start) == (1440, 7195.0, START)
    assert log.units == {"T_a_C": "degC"}
    assert log.remarks == ()


def test_the_recorder_waits_for_its_connections_before_the_first_row(tmp_path: Path) -> None:
    async def connect(recording: Recording) -> None:
        recording.sessions["control"].connected = False
        await asyncio.sleep(2.3)
        recording.sessions["control"].connected = True

    recording = Recording(settings(channel("T_a_C")), tmp_path)
    recording.run(3.0, connect)
    assert rows_of(tmp_path / NAME) == [[at(3 + k), str(43203 + k)] for k in range(3)]


def test_a_connection_that_is_lost_leaves_empty_cells_with_their_reason(tmp_path: Path) -> None:
    async def lose(recording: Recording) -> None:
        session = recording.sessions["control"]
        await asyncio.sleep(2.5)
        session.connected = False
        await asyncio.sleep(3.0)
        session.connected, session.generation = True, 2

    recording = Recording(settings(channel("T_a_C")), tmp_path)
    summary = recording.run(8.0, lose)
    assert column(tmp_path / NAME, 1) == ["43200", "43201", "43202", "", "", "", "43206", "43207"]
    status = column(tmp_path / "sources" / NAME, 1)
    assert status == [*["Good"] * 3, *["BadNoCommunication"] * 3, *["Good"] * 2]
    there = Message("recording-connected_ahead", {"name": "control", "by_s": 0.25})
    why = recording.sessions["control"].failure
    lost = Message("recording-connection_lost", {"name": "control", "why": why})
    assert recording.told[:3] == [there, lost, there]
    assert marks_of(tmp_path / NAME)[1:4] == [sentence_of(one) for one in recording.told[:3]]
    assert summary.channels[0].not_good == {"BadNoCommunication": 3}


def test_a_slow_connection_delays_no_other_one(tmp_path: Path) -> None:
    async def slow(recording: Recording) -> None:
        recording.sessions["slow"].delay_s = 0.9

    both = settings(channel("T_a_C", 200), channel("T_b_C", 200, connection="slow"))
    recording = Recording(both, tmp_path)
    recording.run(4.0, slow)
    fast = [moment for moment, _ in recording.sessions["control"].asked]
    assert fast == [START + timedelta(seconds=0.2 * k) for k in range(20)]
    assert column(tmp_path / NAME, 0) == [at(0.2 * k) for k in range(20)]
    assert all(column(tmp_path / NAME, 1))
    slow_rows = [time for time, _, value in rows_of(tmp_path / NAME) if value]
    assert slow_rows == [at(k) for k in range(4)]


def test_an_answer_that_comes_too_late_is_no_reading(tmp_path: Path) -> None:
    async def slow(recording: Recording) -> None:
        await asyncio.sleep(0.5)
        recording.sessions["control"].delay_s = 30.0

    recording = Recording(settings(channel("T_a_C", 2000)), tmp_path)
    summary = recording.run(6.0, slow)
    assert column(tmp_path / NAME, 1) == ["43200", "", ""]
    assert summary.channels[0].not_good == {"BadNoCommunication": 2}


def test_a_source_that_is_frozen_is_left_out_and_told(tmp_path: Path) -> None:
    def freezing(node: str, now: datetime) -> ua.DataValue:
        return moving(node, min(now, START + timedelta(seconds=10)))

    recording = Recording(settings(channel("T_a_C")), tmp_path)
    recording.run(100.0, answer=freezing)
    assert column(tmp_path / NAME, 1) == [*(str(43200 + k) for k in range(11)), *[""] * 89]
    assert column(tmp_path / "sources" / NAME, 3) == [*[""] * 11, *["unchanged"] * 89]
    assert recording.codes().count("stands_still") == 1


def test_a_source_that_is_slower_than_the_recorder_is_not_called_dead(tmp_path: Path) -> None:
    def slow(node: str, now: datetime) -> ua.DataValue:
        return moving(node, now.replace(second=now.second // 20 * 20, microsecond=0))

    recording = Recording(settings(channel("T_a_C", 100)), tmp_path)
    recording.run(120.0, answer=slow)
    assert [value for value in column(tmp_path / NAME, 1) if value] == [
        str(43200 + 20 * k) for k in range(6)
    ]
    assert "stands_still" not in recording.codes()


def test_a_counter_that_stands_makes_no_touch_of_a_stamp_that_moves(tmp_path: Path) -> None:
    def touched(node: str, now: datetime) -> ua.DataValue:
        count = int((now - START).total_seconds()) // 30
        return good(count if node == "i=9" else 1.0 + count, now)

    recording = Recording(settings(channel("Z_um", counter_node="i=9", unit="um")), tmp_path)
    recording.run(100.0, answer=touched)
    taken = {k: value for k, value in enumerate(column(tmp_path / NAME, 1)) if value}
    assert taken == {31: "2", 61: "3", 91: "4"}


def test_bad_values_are_told_once_with_their_status(tmp_path: Path) -> None:
    def broken(node: str, now: datetime) -> ua.DataValue:
        return good(0.0, now, "BadSensorFailure" if now.second % 2 else "Good")

    recording = Recording(settings(channel("T_a_C")), tmp_path)
    recording.run(6.0, answer=broken)
    assert column(tmp_path / NAME, 1) == ["0", "", "0", "", "0", ""]
    assert column(tmp_path / "sources" / NAME, 3) == ["", "sent 0"] * 3
    bad = Message("recording-not_good", {"name": "T_a_C", "status": "BadSensorFailure"})
    assert recording.told.count(bad) == 1


def test_a_recording_ends_at_once_when_it_is_told_to(tmp_path: Path) -> None:
    async def stop(recording: Recording) -> None:
        await asyncio.sleep(10.5)
        recording.stop.set()

    recording = Recording(settings(channel("T_a_C")), tmp_path)
    summary = recording.run(None, stop)
    assert summary.rows == 11
    assert recording.ended == START + timedelta(seconds=10.5)
    assert marks_of(tmp_path / NAME)[-1] == "ended"


def test_a_request_without_an_answer_does_not_keep_a_recording_from_ending(tmp_path: Path) -> None:
    async def stop(recording: Recording) -> None:
        recording.sessions["slow"].delay_s = 1e9
        await asyncio.sleep(10.5)
        recording.stop.set()

    both = settings(channel("T_a_C"), channel("T_b_C", connection="slow"))
    recording = Recording(both, tmp_path)
    summary = recording.run(None, stop)
    assert recording.ended <= START + timedelta(seconds=11.5)
    assert summary.rows == 11


# Clocks --------------------------------------------------------------------------------------


def setting(at_s: float, by_s: float) -> Callable[[Recording], object]:
    async def set_clock(recording: Recording) -> None:
        await asyncio.sleep(at_s)
        recording.clock.change_time_of_day(by_s)

    return set_clock


def test_a_clock_that_is_set_back_changes_no_time_of_the_log_and_is_marked(tmp_path: Path) -> None:
    by_s = -86_400.0 * 400
    recording = Recording(settings(channel("T_a_C")), tmp_path)
    recording.run(20.0, setting(9.5, by_s))
    assert column(tmp_path / NAME, 0) == [at(k) for k in range(20)]
    (back,) = (one for one in recording.told if "clock" in one.code)
    values = {"by_s": -by_s, "ahead_s": -by_s, "log_by_s": 0.0}
    assert back == Message("recording-clock_set_back", values)
    assert sentence_of(back) in marks_of(tmp_path / NAME)
    assert len(list(tmp_path.glob("*.csv"))) == 1


def test_a_clock_that_is_set_forward_makes_a_gap_that_a_reader_sees(tmp_path: Path) -> None:
    recording = Recording(settings(channel("T_a_C")), tmp_path)
    recording.run(20.0, setting(9.5, 7200.0))
    found = column(tmp_path / NAME, 0)
    assert found[:11] == [at(k) for k in range(11)]  # the eleventh is the marker without a value
    assert found[11:] == [at(7200 + k) for k in range(10, 20)]
    assert rows_of(tmp_path / NAME)[10] == [at(10), ""]
    jumped = Message("recording-clock_jumped", {"by_s": 7200.0})  # the words name no more
    assert sentence_of(jumped) in marks_of(tmp_path / NAME)
    log = read_thermal_log(tmp_path / NAME)
    assert max(log.time_s[1:] - log.time_s[:-1]) == pytest.approx(7200.0)


def test_a_clock_that_is_set_over_midnight_begins_a_file_and_overwrites_none(
    tmp_path: Path,
) -> None:
    async def there_and_back(recording: Recording) -> None:
        for by_s in (86_400.0, -86_400.0, 86_400.0, -86_400.0):
            await asyncio.sleep(10.0)
            recording.clock.change_time_of_day(by_s)

    recording = Recording(settings(channel("T_a_C")), tmp_path, START + timedelta(seconds=0.5))
    recording.run(50.0, there_and_back)
    first, second = tmp_path / NAME, tmp_path / "lathe-2026-11-22.csv"
    assert sorted(tmp_path.glob("*.csv")) == [first, second]
    times = column(first, 0) + column(second, 0)
    assert times == sorted(set(times))
    assert len([cells for p in (first, second) for cells in rows_of(p) if cells[1]]) == 50


def test_after_a_restart_under_a_clock_that_was_set_back_another_file_is_written(
    tmp_path: Path,
) -> None:
    Recording(settings(channel("T_a_C")), tmp_path).run(10.0)
    before = (tmp_path / NAME).read_bytes()
    earlier = START - timedelta(hours=2)
    Recording(settings(channel("T_a_C")), tmp_path, earlier).run(5.0)
    assert (tmp_path / NAME).read_bytes() == before
    assert column(tmp_path / "lathe-2026-11-21-2.csv", 0) == [at(k, earlier) for k in range(5)]


def test_a_computer_that_stalls_misses_readings_and_invents_none(tmp_path: Path) -> None:
    async def stop(recording: Recording) -> None:
        await asyncio.sleep(5.2)
        freeze(7.35)

    recording = Recording(settings(channel("T_a_C"), channel("T_b_C", 5000)), tmp_path)
    recording.run(20.0, stop)
    found = [(cells[0], cells[1]) for cells in rows_of(tmp_path / NAME) if cells[1]]
    assert [time for time, _ in found] == [
        *(at(k) for k in range(6)),
        at(12.55),  # late, and said with its own time
        *(at(k) for k in range(13, 20)),
    ]
    assert [float(value) for _, value in found][6] == pytest.approx(43212.55)
    slow = [cells[0] for cells in rows_of(tmp_path / NAME) if cells[2]]
    assert slow == [at(0), at(5), at(12.55), at(15)]


# Restarts and disks --------------------------------------------------------------------------


class FullDisk:
    """A disk that refuses everything while it is full."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.full = False
        self._write = os.write
        monkeypatch.setattr(os, "write", self.write)

    def write(self, descriptor: int, content: bytes | memoryview) -> int:
        if self.full:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        return self._write(descriptor, content)

    def between(self, first_s: float, last_s: float) -> Callable[[Recording], object]:
        async def fill(recording: Recording) -> None:
            await asyncio.sleep(first_s)
            self.full = True
            await asyncio.sleep(last_s - first_s)
            self.full = False

        return fill


def test_rows_wait_in_memory_while_the_disk_is_full(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    disk = FullDisk(monkeypatch)
    recording = Recording(settings(channel("T_a_C")), tmp_path)
    summary = recording.run(900.0, disk.between(10.5, 800.5))
    assert (summary.rows, summary.lost) == (900, 0)
    assert column(tmp_path / NAME, 1) == [str(43200 + k) for k in range(900)]
    assert [one for one in recording.told if "rows" in one.code] == [
        Message("recording-rows_unwritten", {"cause": "No space left on device"}),
        Message("recording-rows_written_again"),
    ]


def test_what_memory_cannot_hold_is_lost_from_the_oldest_on_and_stated(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    disk = FullDisk(monkeypatch)
    recording = Recording(settings(channel("T_a_C"), memory_mb=0.01), tmp_path)
    summary = recording.run(1000.0, disk.between(10.5, 800.5))
    values = [cells[1] for cells in rows_of(tmp_path / NAME) if cells[1]]
    assert len(values) == summary.rows
    assert summary.rows + summary.lost == 1000
    assert 500 < summary.lost < 790
    kept = [int(value) - 43200 for value in values]
    lost = sorted(set(range(1000)) - set(kept))
    assert kept == sorted(kept)
    assert len(lost) == summary.lost
    assert lost[0] in {10, 11}  # at most the last second was not written before
    assert lost[-1] - lost[0] <= len(lost)  # the oldest, but for one that was being written
    marks = [m for m in marks_of(tmp_path / NAME) if m.startswith("lost")]
    # More may be lost while a line that states a loss is being written: then a second one follows.
    assert sum(int(re.findall(r"\d+", mark)[0]) for mark in marks) == summary.lost
    assert all(any(at(row) in mark for mark in marks) for row in (lost[0], lost[-1]))


def test_a_disk_that_stays_full_to_the_end_is_said_with_what_is_lost(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    disk = FullDisk(monkeypatch)
    recording = Recording(settings(channel("T_a_C")), tmp_path)
    summary = recording.run(60.0, disk.between(30.5, 1000.0))
    assert summary.error == "No space left on device"
    assert summary.rows in {30, 31}
    assert summary.lost == 60 - summary.rows
    assert (tmp_path / NAME).read_bytes().endswith(b"\n")


def test_at_most_a_second_of_rows_is_not_in_the_file(tmp_path: Path) -> None:
    missing: list[float] = []

    async def look(recording: Recording) -> None:
        for _ in range(50):
            await asyncio.sleep(0.37)
            path = tmp_path / NAME
            written = [at(-1), *(column(path, 0) if path.exists() else [])][-1]
            last = datetime.fromisoformat(written)
            missing.append((recording.clock.utc() - last).total_seconds())

    recording = Recording(settings(channel("T_a_C", 100)), tmp_path)
    recording.run(20.0, look)
    assert max(missing[3:]) <= 1.2


@given(
    st.lists(
        st.tuples(
            st.floats(0.0, 40.0),
            st.sampled_from(["disk", "room", "cut", "mend", "slow", "quick", "back", "forward"]),
            st.floats(3.0, 2e5),
        ),
        max_size=25,
    )
)
@settings_of(max_examples=25)
def test_whatever_happens_lines_are_whole_times_rise_and_every_row_is_there_once_or_stated_as_lost(
    tmp_path_factory: pytest.TempPathFactory, happenings: list[tuple[float, str, float]]
) -> None:
    folder = tmp_path_factory.mktemp("any")
    with pytest.MonkeyPatch.context() as patch:
        disk = FullDisk(patch)

        async def happen(recording: Recording) -> None:
            session = recording.sessions["control"]
            for wait_s, what, size in happenings:
                await asyncio.sleep(wait_s)
                if what in {"disk", "room"}:
                    disk.full = what == "disk"
                elif what in {"cut", "mend"}:
                    session.connected = what == "mend"
                elif what in {"slow", "quick"}:
                    session.delay_s = 0.7 if what == "slow" else 0.0
                else:
                    recording.clock.change_time_of_day(size if what == "forward" else -size)
            await asyncio.sleep(5.0)
            disk.full = False
            await asyncio.sleep(3.0)
            recording.stop.set()

        some = settings(
            channel("T_a_C", 500), channel("T_b_C", 2000), memory_mb=0.004, largest_mb=0.008
        )
        recording = Recording(some, folder)
        summary = recording.run(None, happen)
    assert summary.error == ""
    times: list[str] = []
    for path in recording.files.written:
        for file in (path, folder / "sources" / path.name):
            assert file.read_bytes().endswith(b"\n")
            assert file.stat().st_size < 9000
        assert column(path, 0) == column(folder / "sources" / path.name, 0)
        times += column(path, 0)
    assert times == sorted(set(times))
    written = [
        cells
        for path in recording.files.written
        for cells in rows_of(folder / "sources" / path.name)
        if cells[1] or cells[4]
    ]
    assert len(written) == summary.rows
    asked = sorted({moment for moment, _ in recording.sessions["control"].asked})
    assert summary.rows + summary.lost >= len(asked) - 2  # answers on their way at the end
    stated = [m for path in recording.files.written for m in marks_of(path) if m[:5] == "lost:"]
    assert sum(int(m.split()[1]) for m in stated) == summary.lost


def test_the_room_that_a_day_takes_is_foretold(tmp_path: Path) -> None:
    some = settings(*(channel(f"T{k}_C", 60_000 if k else 10_000) for k in range(8)))
    Recording(some, tmp_path, datetime(2026, 11, 21, tzinfo=UTC)).run(8640.0)
    written = sum(path.stat().st_size for path in tmp_path.rglob("*.csv"))
    assert bytes_per_day(some) == pytest.approx(10.0 * written, rel=0.2)


# Trying --------------------------------------------------------------------------------------


def test_a_trial_says_what_would_be_recorded_and_whose_time_stamp_stands_still() -> None:
    def mixed(node: str, now: datetime) -> ua.DataValue:
        if node.endswith("dead"):
            return good(0.0, now, "BadSensorFailure")
        if node.endswith("still"):
            return good(3.0, START)
        if node.endswith("bare"):
            return good(4.0, None)
        return moving(node, now)

    async def tried() -> list[tuple[str, str, str, Message | None]]:
        clock = VirtualClock(START)
        names = ("moving", "dead", "still", "bare")
        touch = channel("touch", unit="", node="moving", counter_node="dead")
        found = await try_once(
            settings(*(channel(name, unit="") for name in names), touch),
            {"control": SimulatedSession(clock, mixed)},
            clock,
        )
        return [(t.settings.name, t.value, t.status, t.remark) for t in found]

    assert run_in_virtual_time(tried()) == [
        ("moving", "43202", "Good", None),
        ("dead", "", "BadSensorFailure", Message("remark-beside_value", {"said": "sent 0"})),
        ("still", "3", "Good", Message("remark-stamp_stood_still", {"lasts_s": 2.0})),
        ("bare", "4", "Good", Message("remark-no_stamp")),
        ("touch", "43202", "Good", None),
        (
            "touch counter",
            "",
            "BadSensorFailure",
            Message("remark-beside_value", {"said": "sent 0"}),
        ),
    ]
