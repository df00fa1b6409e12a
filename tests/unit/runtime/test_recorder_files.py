"""Files of a recording: whole lines, no overwritten file, on full disks and after a kill."""

import errno
import os
import resource
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest
from hypothesis import given, settings as settings_of, strategies as st

from tests.unit.runtime.recording import START, at, channel, lines_of, marks_of, rows_of, settings
from thermaxis.codes import Message
from thermaxis.errors import ConfigurationError
from thermaxis.runtime import RecordSettings
from thermaxis.runtime._backlog import to_us
from thermaxis.runtime.record import RecordingFiles, sole_writer
from thermaxis.runtime.record._clock import as_text
from thermaxis.runtime.record._files import Entry, mark

NAME = "lathe-2026-11-21.csv"
BEGAN = Message("recording-began", {"version": "1"})


def us(seconds: float, start: datetime = START) -> int:
    return to_us(start + timedelta(seconds=seconds))


def row(seconds: float, value: float = 1.0, start: datetime = START) -> Entry:
    time = as_text(us(seconds, start))
    log, sources = f"{time},{value:g}\n", f"{time},Good,{time},\n"
    return Entry(us(seconds, start), log.encode(), sources.encode())


def store(files: RecordingFiles, *entries: Entry) -> tuple[int, str]:
    """Store entries as long as the disk takes them; return how many, and what it said then."""
    for done, entry in enumerate(entries):
        try:
            files.store(entry)
        except OSError as error:
            return done, error.strerror
    return len(entries), ""


def recording(folder: Path, **more: object) -> RecordingFiles:
    return RecordingFiles(one_channel(**more), folder)


def one_channel(**more: object) -> RecordSettings:
    return settings(channel("T_a_C"), **more)


def times(path: Path) -> list[str]:
    return [cells[0] for cells in rows_of(path)]


def test_rows_of_a_day_are_in_one_file_and_those_of_the_next_in_another(tmp_path: Path) -> None:
    files = recording(tmp_path)
    start = datetime(2026, 11, 21, 23, 59, 58, tzinfo=UTC)
    stored = store(files, *(row(k, start=start) for k in range(5)))
    files.close()
    assert stored == (5, "")
    assert times(tmp_path / NAME) == [at(k, start) for k in range(2)]
    assert times(tmp_path / "lathe-2026-11-22.csv") == [at(k, start) for k in range(2, 5)]
    assert files.written == [tmp_path / NAME, tmp_path / "lathe-2026-11-22.csv"]
    assert sorted(p.name for p in (tmp_path / "sources").iterdir()) == [
        NAME,
        "lathe-2026-11-22.csv",
    ]


def test_several_days_share_a_file_where_that_is_wanted(tmp_path: Path) -> None:
    files = recording(tmp_path, days_per_file=2)
    store(files, *(row(k * 3600.0) for k in range(49)))
    files.close()
    again = recording(tmp_path, days_per_file=2)  # on the second day of the second file
    store(again, row(49 * 3600.0))
    again.close()
    assert [p.name for p in files.written] == [NAME, "lathe-2026-11-23.csv"]
    assert again.written == files.written[1:]


def test_a_file_that_is_large_enough_is_followed_by_another(tmp_path: Path) -> None:
    files = recording(tmp_path, largest_mb=0.003)
    store(files, *(row(k) for k in range(200)))
    files.close()
    paths = files.written
    assert [p.name for p in paths[:3]] == [NAME, "lathe-2026-11-21-2.csv", "lathe-2026-11-21-3.csv"]
    assert [t for p in paths for t in times(p)] == [at(k) for k in range(200)]
    for path in paths:
        assert (tmp_path / "sources" / path.name).stat().st_size <= 3000


def test_a_recording_goes_on_in_the_file_of_the_day_and_marks_the_gap(tmp_path: Path) -> None:
    first = recording(tmp_path)
    store(first, *(row(k) for k in range(3)))
    first.close()
    second = recording(tmp_path)
    store(second, mark(us(100), BEGAN), row(100), row(101))
    second.close()
    assert second.written == [tmp_path / NAME]
    assert rows_of(tmp_path / NAME) == [
        *([at(k), "1"] for k in range(3)),
        [at(3), ""],
        [at(100), "1"],
        [at(101), "1"],
    ]
    assert f"gap: no row since {at(2)}, 98.000 s before" in marks_of(tmp_path / NAME)
    assert rows_of(tmp_path / "sources" / NAME)[3] == [at(3), "", "", ""]


def test_a_pause_within_the_usual_step_is_no_gap(tmp_path: Path) -> None:
    files = recording(tmp_path)
    store(files, row(0), row(2.5), row(5.0))
    files.close()
    assert len(rows_of(tmp_path / NAME)) == 3
    assert marks_of(tmp_path / NAME) == []


def test_another_set_of_channels_begins_another_file(tmp_path: Path) -> None:
    store(recording(tmp_path), row(0))
    other = RecordingFiles(settings(channel("T_b_C")), tmp_path)
    store(other, row(10))
    assert other.written == [tmp_path / "lathe-2026-11-21-2.csv"]
    assert times(tmp_path / NAME) == [at(0)]


def test_a_recording_that_would_go_back_in_time_begins_another_file(tmp_path: Path) -> None:
    store(recording(tmp_path), row(3600))
    later = recording(tmp_path)
    store(later, row(0), row(1))
    assert times(tmp_path / NAME) == [at(3600)]
    assert times(tmp_path / "lathe-2026-11-21-2.csv") == [at(0), at(1)]


@pytest.mark.parametrize("where", ["", "sources"])
def test_a_file_of_somebody_else_is_never_touched(tmp_path: Path, where: str) -> None:
    (tmp_path / where).mkdir(exist_ok=True)
    foreign = tmp_path / where / NAME
    foreign.write_text("mine\n")
    files = recording(tmp_path)
    store(files, row(0))
    files.close()
    assert foreign.read_text() == "mine\n"
    assert files.written == [tmp_path / "lathe-2026-11-21-2.csv"]


def test_a_file_that_appears_at_the_last_moment_is_not_written_to(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    foreign = tmp_path / NAME
    foreign.write_text("mine\n")
    monkeypatch.setattr(RecordingFiles, "_names", lambda *_some, **_more: [])
    assert store(recording(tmp_path), row(0)) == (0, "File exists")
    assert foreign.read_text() == "mine\n"
    assert list((tmp_path / "sources").iterdir()) == []


def test_the_number_of_a_file_that_only_its_parquet_has_is_not_used_again(tmp_path: Path) -> None:
    (tmp_path / "lathe-2026-11-21-4.parquet").write_bytes(b"")
    files = recording(tmp_path)
    store(files, row(0))
    assert files.written == [tmp_path / "lathe-2026-11-21-5.csv"]


def test_a_file_that_was_moved_away_while_it_is_written_is_begun_anew(tmp_path: Path) -> None:
    files = recording(tmp_path)
    store(files, row(0))
    (tmp_path / NAME).rename(tmp_path / "taken.csv")
    assert store(files, row(1)) == (1, "")
    files.close()
    assert times(tmp_path / "taken.csv") == [at(0)]
    assert times(tmp_path / "lathe-2026-11-21-2.csv") == [at(1)]


@pytest.mark.parametrize("torn", [b"2026-11-21T12:00:03.000Z,1", b"\x00" * 4096])
def test_a_torn_end_is_cut_off_and_said(tmp_path: Path, torn: bytes) -> None:
    store(recording(tmp_path), *(row(k) for k in range(3)))
    with (tmp_path / NAME).open("ab") as stream:
        stream.write(torn)
    with (tmp_path / "sources" / NAME).open("ab") as stream:
        stream.write(b"2026-11-21T12:00:03.000Z,Go")
    files = recording(tmp_path)
    store(files, row(3))
    files.close()
    assert times(tmp_path / NAME) == [at(k) for k in range(4)]
    assert marks_of(tmp_path / NAME) == [
        f"repaired: {len(torn)} bytes of a torn last line are gone"
    ]
    assert rows_of(tmp_path / "sources" / NAME)[-1] == [at(3), "Good", at(3), ""]


@pytest.mark.parametrize("line", [b"1,2,3\n", b"\x00\n", b"2026-11-21T12:00:03.000,1\n"])
def test_a_log_that_ends_in_a_line_of_somebody_else_is_left_alone(
    tmp_path: Path, line: bytes
) -> None:
    store(recording(tmp_path), *(row(k) for k in range(3)))
    with (tmp_path / NAME).open("ab") as stream:
        stream.write(line)
    before = (tmp_path / NAME).read_bytes()
    files = recording(tmp_path)
    store(files, row(3))
    assert (tmp_path / NAME).read_bytes() == before
    assert times(tmp_path / "lathe-2026-11-21-2.csv") == [at(3)]


@settings_of(max_examples=20)
@given(keep=st.integers(0, 400))
def test_wherever_a_log_is_torn_rows_that_were_whole_stay_and_all_lines_are_whole(
    tmp_path_factory: pytest.TempPathFactory, keep: int
) -> None:
    folder = tmp_path_factory.mktemp("torn")
    store(recording(folder), *(row(k) for k in range(8)))
    whole = (folder / NAME).read_bytes()
    (folder / NAME).write_bytes(whole[:keep])
    files = recording(folder)
    store(files, row(20))
    files.close()
    found = [time for path in files.written for time in times(path)]
    head = whole.index(b"time,T_a_C\n") + len(b"time,T_a_C\n")
    kept = whole[head:keep].count(b"\n") if keep >= head else 0
    expected = [at(k) for k in range(kept)]
    gap = [at(kept)] if kept else []
    assert found == [*expected, *gap, at(20)]
    for path in files.written:
        assert path.read_bytes().endswith(b"\n")
        if path.name != NAME:
            assert (folder / NAME).read_bytes() == whole[:keep]


def test_only_one_recording_of_a_name_may_write_into_a_folder(tmp_path: Path) -> None:
    with sole_writer(tmp_path, "lathe"):
        with sole_writer(tmp_path, "mill"):
            pass
        with (
            pytest.raises(ConfigurationError, match="nother recording"),
            sole_writer(tmp_path, "lathe"),
        ):
            pass
    with sole_writer(tmp_path, "lathe"):
        pass


def test_a_folder_that_cannot_be_made_is_said_in_words(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with (
        pytest.raises(ConfigurationError, match="cannot be written"),
        sole_writer(tmp_path / "file" / "x", "a"),
    ):
        pass


def test_old_files_are_deleted_and_those_of_others_stay(tmp_path: Path) -> None:
    files = recording(tmp_path, keep_days=2)
    store(files, *(row(86400.0 * k) for k in (0, 1, 2, 3, 3650)))  # the clock jumps by ten years
    (tmp_path / "lathe-notes.csv").write_text("mine")
    (tmp_path / "lathe-2026-11-20.txt").write_text("mine")
    files.close()
    assert len(list((tmp_path / "sources").iterdir())) == 3
    left = sorted(p.name for p in tmp_path.iterdir() if p.is_file())
    assert left == [
        "lathe-2026-11-20.txt",
        "lathe-2026-11-23.csv",
        "lathe-2026-11-24.csv",
        "lathe-2036-11-18.csv",
        "lathe-notes.csv",
    ]


def test_a_row_of_the_log_that_a_kill_leaves_has_its_status_and_time_stamp(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    class Killed(BaseException):
        pass

    files, write, ends = recording(tmp_path), os.write, list[int]()
    store(files, row(0))

    def write_once(descriptor: int, content: bytes) -> int:
        if ends:
            raise Killed
        ends.append(write(descriptor, content))
        return ends[0]

    monkeypatch.setattr(os, "write", write_once)
    with pytest.raises(Killed):
        files.store(row(1))
    monkeypatch.undo()
    again = recording(tmp_path)
    store(again, row(2))
    assert times(tmp_path / NAME) == [at(0), at(2)]
    assert {at(0), at(2)} <= set(times(tmp_path / "sources" / NAME))


# Full disks --------------------------------------------------------------------------------------


class Disk:
    """Lets `os.write` fail as a disk with so many bytes left does."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.left = 10**9
        self._write, self._cut = os.write, os.truncate
        monkeypatch.setattr(os, "write", self.write)
        monkeypatch.setattr(os, "ftruncate", self.cut)
        monkeypatch.setattr(os, "truncate", self.cut)

    def cut(self, file: int | Path, size: int) -> None:
        self.left += os.stat(file).st_size - size  # noqa: PTH116 - of a number as well
        self._cut(file, size)

    def write(self, descriptor: int, content: bytes | memoryview) -> int:
        if self.left <= 0:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        count = self._write(descriptor, content[: self.left])
        self.left -= count
        return count


@settings_of(max_examples=20)
@given(room=st.lists(st.integers(0, 700), min_size=1, max_size=12))
def test_whatever_room_a_disk_has_every_line_is_whole_and_every_row_is_there_once(
    tmp_path_factory: pytest.TempPathFactory, room: list[int]
) -> None:
    folder = tmp_path_factory.mktemp("disk")
    with pytest.MonkeyPatch.context() as patch:
        disk = Disk(patch)
        files = recording(folder)
        waiting: list[Entry] = []
        for k, bytes_left in enumerate([*room, 10**9]):
            disk.left = bytes_left
            waiting += [row(2 * k), row(2 * k + 1)]
            done, error = store(files, *waiting)
            waiting = waiting[done:]
            assert bool(error) == bool(waiting)
            for path in [p for p in folder.rglob("*.csv") if p.stat().st_size]:
                assert path.read_bytes().endswith(b"\n")
        files.close()
    assert waiting == []
    assert len(set(files.written)) == 1
    assert times(files.written[0]) == [at(k) for k in range(2 * len(room) + 2)]
    assert times(folder / "sources" / NAME) == times(files.written[0])
    assert len(list(folder.rglob("*.csv"))) == 2


def test_rows_that_fit_are_written_before_a_disk_is_full(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    files = recording(tmp_path)
    store(files, row(0))
    disk = Disk(monkeypatch)
    disk.left = 50_000
    done, error = store(files, *(row(k) for k in range(1, 1000)))
    assert error == os.strerror(errno.ENOSPC)
    assert len(times(tmp_path / NAME)) == done + 1
    assert disk.left < row(1).size


def test_a_limit_that_no_file_may_pass_leaves_no_empty_files(tmp_path: Path) -> None:
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    files = recording(tmp_path)
    try:
        resource.setrlimit(resource.RLIMIT_FSIZE, (0, hard))
        for _ in range(5):
            assert store(files, row(0))[1] == os.strerror(errno.EFBIG)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    assert list(tmp_path.rglob("*.csv")) == []
    assert store(files, row(0)) == (1, "")
    assert files.written == [tmp_path / NAME]


def test_a_line_about_what_happened_is_one_line_of_plain_letters() -> None:
    hostile = {"name": "gone \n evil\r\x1b[2J 23°C", "why": "x"}
    entry = mark(us(0), Message("recording-connection_lost", hostile))
    assert entry.log.startswith(b"# 2026-11-21T12:00:00.000Z connection gone ")
    assert entry.log.isascii()
    assert [c for c in entry.log if c < 32] == [10]
    assert not entry.is_row


def test_lines_of_a_log_begin_with_what_is_recorded(tmp_path: Path) -> None:
    files = recording(tmp_path)
    store(files, row(0))
    assert lines_of(tmp_path / NAME)[:4] == [
        "# thermaxis record 1: lathe",
        "# connection control: opc.tcp://127.0.0.1:4840, security none",
        "# channel T_a_C: ns=2;s=T_a_C of control, unit degC, every 1 s",
        "time,T_a_C",
    ]
