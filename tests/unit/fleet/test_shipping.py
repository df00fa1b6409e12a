"""What a history ships to a lake: each part once, confirmed; contradictions are kept apart."""

import errno
import hashlib
import json
import resource
import shutil
import subprocess
from datetime import timedelta
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import polars as pl
import pytest
from fsspec.implementations.local import LocalFileSystem

from tests.unit.runtime.history_records import BEGIN, cycle_record, url_of, write_history
from thermaxis.cli import main
from thermaxis.errors import ConfigurationError, DataError
from thermaxis.fleet import Lake, Shipment, ship
from thermaxis.runtime.history import HistoryReader, unjoined

STEP_S = 4 * 3600.0
DAY = 6


def written(folder: Path, days: float = 2.5, *, shift: int = 0) -> Path:
    """Return a copy of the history of some days, whose finished days are joined."""
    shutil.copytree(made(days, shift).name, folder)
    return folder / "lathe.db"


@cache
def made(days: float, shift: int) -> TemporaryDirectory[str]:
    folder = TemporaryDirectory()
    begin = BEGIN - timedelta(hours=6)
    records = [
        cycle_record(k + shift, utc=begin + timedelta(seconds=k * STEP_S))
        for k in range(round(days * DAY))
    ]
    write_history(Path(folder.name) / "lathe.db", records)
    return folder


@pytest.fixture
def lake(tmp_path: Path) -> Path:
    folder = tmp_path / "lake"
    folder.mkdir()
    return folder


def shipped(history: Path, lake: Path | str) -> Shipment:
    with HistoryReader(url_of(history)) as reader:
        return ship(reader.parts(), Lake(str(lake)))


def files(folder: Path) -> dict[str, str]:
    """Return the sums of all files, by name below a folder."""
    return {
        str(path.relative_to(folder)): hashlib.sha256(path.read_bytes()).hexdigest()
        for path in folder.rglob("*")
        if path.is_file()
    }


def test_days_to_come_are_not_sent_as_what_a_machine_did(tmp_path: Path, lake: Path) -> None:
    history = written(tmp_path / "machine")
    (day, *_) = sorted((tmp_path / "machine").rglob("day=*"))
    day.rename(day.with_name("day=2930-01-01"))
    found = shipped(history, lake)
    assert {*codes(found)} == {"part_of_future"}
    assert found.parts - found.sent == len(found.remarks) > 0
    assert not any("2930" in name for name in files(lake))


def codes(found: Shipment) -> list[str]:
    return [one.code.removeprefix("remark-") for one in found.remarks]


def test_a_lake_has_the_files_of_a_history_and_sums_that_other_programs_check(tmp_path, lake):
    history = written(tmp_path / "machine")
    found = shipped(history, lake)
    assert found.sent == found.parts > 2
    assert found.remarks == ()
    there, own = files(lake), files(tmp_path / "machine" / "lathe")
    del own["machine=machine/shipped.txt"]
    assert {name: total for name, total in there.items() if name.endswith("parquet")} == own
    assert found.sent_bytes == sum(path.stat().st_size for path in lake.rglob("*.parquet"))
    for sums in lake.rglob("*.sha256"):
        check = ["sha256sum", "--check", "--quiet", sums.name]
        assert subprocess.run(check, cwd=sums.parent, check=False).returncode == 0


def test_what_was_shipped_is_not_shipped_again_and_a_day_goes_beside_its_hours(tmp_path, lake):
    history = written(tmp_path / "machine", 0.9)
    assert shipped(history, lake).sent == 4
    before = files(lake)
    assert shipped(history, lake).sent == 0
    shutil.rmtree(tmp_path / "machine")
    found = shipped(written(tmp_path / "machine", 1.5), lake)
    assert found.remarks == ()
    assert found.sent == 1 + 2  # the day as one file, and the finished hours of the next one
    assert before.items() <= files(lake).items()
    one = Lake(str(lake))
    folder = "machine=machine/day=2026-11-03"
    assert len(one.parts(folder)) == 5
    assert [part[:2] for part in unjoined(one.parts(folder))] == [(1, DAY)]
    minutes = pl.concat(one.minutes("machine", BEGIN.date()))
    assert minutes["T_spindle_C_count"].sum() == DAY


@pytest.mark.parametrize("name", ["cycles-000000000001-000000000006.parquet", "minutes-"])
def test_a_shipment_that_was_ended_anywhere_is_gone_on_with(tmp_path, lake, monkeypatch, name):
    """The disk is full in the middle of a file; what stands there under other names is no part."""
    history = written(tmp_path / "machine")
    opened = LocalFileSystem._open
    full = [True]

    def limited(self, path, mode="rb", **options):
        stream = opened(self, path, mode, **options)
        if full and mode == "wb" and name in path and "day=2026-11-04" not in path:
            stream.write(b"PAR1")
            stream.close()
            raise OSError(errno.ENOSPC, "No space left on device", path)
        return stream

    monkeypatch.setattr(LocalFileSystem, "_open", limited)
    with pytest.raises(DataError, match="No space left on device") as error:
        shipped(history, lake)
    assert error.value.code == "lake_out_of_reach"
    assert list(lake.rglob("*.part")) == []
    assert Lake(str(lake)).minutes("machine", BEGIN.date()) == []
    full.clear()
    assert shipped(history, lake).remarks == ()
    twin = tmp_path / "undisturbed"
    twin.mkdir()
    shipped(history, twin)
    assert files(lake) == files(twin)


def test_only_what_is_confirmed_is_noted_beside_the_history(tmp_path, lake, monkeypatch):
    history = written(tmp_path / "machine")
    noted = tmp_path / "machine" / "lathe" / "machine=machine" / "shipped.txt"
    (cut,) = noted.parent.glob("day=2026-11-03/cycles-*.parquet")
    whole = cut.read_bytes()
    cut.write_bytes(whole[:-1000])
    put = Lake.put

    def full(self, part, folder):
        if folder.endswith("day=2026-11-05"):
            raise DataError("lake_out_of_reach", cause="No space left on device")
        put(self, part, folder)

    with monkeypatch.context() as patch:
        patch.setattr(Lake, "put", full)
        with pytest.raises(DataError):
            shipped(history, lake)
    (line,) = noted.read_text().splitlines()
    assert line.startswith("day=2026-11-04/cycles-")
    cut.write_bytes(whole)
    found = shipped(history, lake)
    assert len(noted.read_text().splitlines()) == found.parts
    noted.unlink()
    noted.mkdir()
    assert codes(shipped(history, lake)) == ["shipped_unnoted"]


def test_a_disk_that_takes_no_more_is_said_and_gone_on_from(tmp_path, lake):
    """The system itself refuses what is larger than a few hundred bytes."""
    with HistoryReader(url_of(written(tmp_path / "machine", 1.5))) as reader:
        parts = reader.parts()
        limits = resource.getrlimit(resource.RLIMIT_FSIZE)
        resource.setrlimit(resource.RLIMIT_FSIZE, (500, limits[1]))
        try:
            with pytest.raises(DataError, match="File too large"):
                ship(parts, Lake(str(lake)))
        finally:
            resource.setrlimit(resource.RLIMIT_FSIZE, limits)
        assert files(lake) == {}
        assert ship(parts, Lake(str(lake))).sent == len(parts)


def test_a_lake_that_gives_back_something_else_is_not_believed(tmp_path, lake, monkeypatch):
    history = written(tmp_path / "machine", 1.5)
    opened = LocalFileSystem._open

    def forgetful(self, path, mode="rb", **options):
        if mode == "rb" and path.endswith(".part"):
            Path(path).write_bytes(b"")
        return opened(self, path, mode, **options)

    monkeypatch.setattr(LocalFileSystem, "_open", forgetful)
    with pytest.raises(DataError, match="not what was written"):
        shipped(history, lake)
    assert files(lake) == {}


@pytest.mark.proof
def test_a_history_begun_anew_is_kept_apart_once_and_said_each_time(tmp_path, lake):
    shipped(written(tmp_path / "machine", 1.5), lake)
    before = files(lake)
    for days in (1.5, 0.8):  # the same ids with other content; ids that lie within the day's
        other = written(tmp_path / f"anew{days}", days, shift=3000)
        first, again = shipped(other, lake), shipped(other, lake)
        assert set(codes(first)) == set(codes(again)) == {"part_kept_apart"}
        assert (len(first.remarks), again.sent) == (first.parts, 0)
        apart = {name for name in files(lake) if name.startswith("apart/machine=machine/day=")}
        assert len([name for name in apart if name.endswith(".sha256")]) >= first.sent > 0
    assert before.items() <= files(lake).items()


def test_a_day_that_holds_other_hours_than_were_shipped_is_kept_apart(tmp_path, lake):
    shipped(written(tmp_path / "machine", 0.9), lake)
    found = shipped(written(tmp_path / "anew", 1.5, shift=3000), lake)
    assert "part_kept_apart" in codes(found)
    minutes = pl.concat(Lake(str(lake)).minutes("machine", BEGIN.date()))
    assert minutes["T_spindle_C_count"].sum() == 4


def test_a_machine_that_was_renamed_is_read_under_both_names_and_no_part_twice(tmp_path, lake):
    shipped(written(tmp_path / "machine", 1.5), lake)
    (there,) = lake.glob("machine=*")
    shutil.copytree(there, lake / "machine=renamed")  # its folder was renamed, too, and shipped
    shutil.rmtree(there / "day=2026-11-04")
    last = BEGIN.date() + timedelta(days=1)
    minutes = pl.concat(Lake(str(lake)).minutes("renamed", last, 1, ["machine"]))
    assert minutes["T_spindle_C_count"].sum() == 1.5 * DAY - 1  # the last hour is not closed
    shutil.rmtree(lake / "machine=renamed" / "day=2026-11-03")
    again = pl.concat(Lake(str(lake)).minutes("renamed", last, 1, ["machine"]))
    assert again.equals(minutes)


def test_a_cut_file_is_said_not_sent_and_holds_nothing_up(tmp_path, lake):
    history = written(tmp_path / "machine")
    (cut,) = (tmp_path / "machine" / "lathe").glob("*/day=2026-11-03/cycles-*.parquet")
    whole = cut.read_bytes()
    cut.write_bytes(whole[: len(whole) // 2])
    found = shipped(history, lake)
    assert codes(found) == ["part_unreadable"]
    assert found.sent == found.parts - 1
    cut.write_bytes(whole)
    assert (shipped(history, lake).sent, codes(shipped(history, lake))) == (1, [])


def test_what_was_cut_in_the_lake_is_said_by_who_reads_and_replaced_by_the_machine(tmp_path, lake):
    history = written(tmp_path / "machine")
    shipped(history, lake)
    whole = files(lake)
    (cut,) = lake.glob("*/day=2026-11-03/minutes-*.parquet")
    cut.write_bytes(cut.read_bytes()[:-100])
    with pytest.raises(DataError, match="not what its sum says"):
        Lake(str(lake)).minutes("machine", BEGIN.date())
    assert codes(shipped(history, lake)) == ["part_sent_again"]
    assert files(lake) == whole


def test_a_lake_is_wherever_fsspec_reaches_and_never_a_folder_that_is_away(tmp_path):
    history = written(tmp_path / "machine", 1.5)
    assert shipped(history, "memory://fleet").sent > 1
    assert shipped(history, "memory://fleet").sent == 0
    assert Lake("memory://fleet").days("machine")[0] == BEGIN.date()
    assert Lake("memory://fleet").minutes("machine", BEGIN.date())
    with pytest.raises(ConfigurationError, match="no such folder"):
        Lake(str(tmp_path / "not mounted"))
    with pytest.raises(ConfigurationError, match="cannot be reached"):
        Lake("nothing://x")


def test_a_store_that_fails_by_errors_of_its_own_is_out_of_reach(monkeypatch):
    def failing(*_: object, **__: object) -> None:
        raise RuntimeError("Could not connect to the endpoint")

    lake = Lake("memory://fleet")
    for name in ("ls", "info", "cat_file"):
        monkeypatch.setattr(lake._fs, name, failing)
    for call in (
        lambda: lake.minutes("machine", BEGIN.date()),
        lambda: lake.size("x"),
        lambda: lake.days("machine"),
    ):
        with pytest.raises(DataError, match="Could not connect") as error:
            call()
        assert error.value.code == "lake_out_of_reach"


def test_the_command_says_what_was_sent_and_ends_with_1_where_something_is_apart(
    tmp_path, lake, capsys
):
    history = written(tmp_path / "machine", 1.5)
    assert main(["history", "ship", str(history), str(lake), "--json", "-"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["sent"] == found["parts"] > 1
    other = written(tmp_path / "anew", 1.5, shift=3000)
    assert main(["history", "ship", str(other), str(lake)]) == 1
    said = capsys.readouterr().out
    assert said.count("kept apart") == 1
    assert f"({found['parts'] - 1} more)" in said
