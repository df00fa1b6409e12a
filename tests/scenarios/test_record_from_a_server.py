"""``thermaxis record`` against an OPC UA server, over a cable that can be cut."""

import argparse
import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path

import pytest
from asyncua import ua

from tests.opcua_server import NAMESPACE, Cable, Machine, start_machine
from tests.unit.runtime.recording import marks_of, rows_of
from thermaxis.cli import main
from thermaxis.cli.machine import record
from thermaxis.errors import ConfigurationError
from thermaxis.files import read_thermal_log, read_thermal_test_plan
from thermaxis.runtime import Recorder, SystemClock, read_record
from thermaxis.runtime.record import RecordingFiles, _recorder
from thermaxis.thermal import ThermalTestPlan

CONFIGURATION = """
[record]
name = "mill"
every_s = 0.1
days_per_file = 2
parquet = true

[connection.control]
url = "{url}"
security = "none"
timeout_s = {timeout_s}
retry_s = 0.1

[channel.T_spindle_C]
node = "nsu={namespace};s=T1"
unit = "degC"

[channel.T_column_C]
node = "nsu={namespace};s=T2"
unit = "degC"
every_s = 0.5

[channel.T_table_C]
node = "nsu={namespace};s=T3"
unit = "degC"
factor = 0.1

[channel.on]
node = "nsu={namespace};s=On"
unit = "bool"
repeat_unchanged_s = 60
"""


def words(*given: str) -> argparse.Namespace:
    parser = argparse.ArgumentParser()
    record.add_arguments(parser)
    return parser.parse_args(given)


@asynccontextmanager
async def server(
    folder: Path, more: str = "", timeout_s: float = 20.0
) -> AsyncIterator[tuple[Machine, Cable]]:
    """A server whose values move, at the end of a cable, and its configuration."""
    machine = await start_machine(other_namespaces=1)
    cable = Cable()
    cable.plug(machine)
    await cable.mend()
    given = {"url": cable.url, "namespace": NAMESPACE, "timeout_s": timeout_s}
    text = CONFIGURATION.format(**given) + more
    (folder / "record.toml").write_text(text)
    moving = asyncio.create_task(move(machine))
    try:
        yield machine, cable
    finally:
        moving.cancel()
        await asyncio.wait({moving})
        await cable.cut()
        await machine.server.stop()


def with_server(folder: Path, *arguments: str, more: str = "") -> int:
    """Run the command in a thread beside a server; return its exit code."""

    async def run() -> int:
        async with server(folder, more):
            command = words(str(folder / "record.toml"), *arguments)
            return await asyncio.to_thread(record.run, command)

    return asyncio.run(run())


async def move(machine: Machine) -> None:
    for k in range(10**6):
        machine.put("T1", 20.0 + 0.25 * (k % 4))
        machine.put("T2", 22.3)
        machine.put("T3", 215 + k % 2)
        await asyncio.sleep(0.02)


def column(path: Path, index: int) -> list[str]:
    return [cells[index] for cells in rows_of(path)]


def test_the_values_of_a_server_are_in_a_log_that_reads_without_a_mapping(tmp_path, capsys):
    folder = tmp_path / "logs"
    assert with_server(tmp_path, "-o", str(folder), "--for", "1") == 0
    (path,) = folder.glob("*.csv")
    log = read_thermal_log(path)
    beside = folder / "sources" / path.name
    read = [cells for cells in rows_of(beside) if cells[1]]  # without rows that mark a gap
    rows = len(read)
    assert 2 <= rows <= 10  # a computer that stalls misses some
    assert log.rows == len(rows_of(beside))
    assert log.units == {"T_spindle_C": "degC", "T_column_C": "degC", "T_table_C": "degC", "on": ""}
    assert log.remarks == ()
    assert log.start is not None
    assert log.start.tzinfo is not None
    assert set(column(path, 1)) <= {"", "20", "20.25", "20.5", "20.75"}
    slow = column(path, 2)
    assert slow[0] == "22.3"
    assert set(slow) == {"22.3", ""}
    assert slow.count("22.3") <= 3
    assert set(column(path, 3)) - {""} <= {"21.5", "21.6"}
    assert set(column(path, 4)) - {""} == {"1"}
    assert {cells[1] for cells in read} == {"Good"}
    assert len({cells[2] for cells in read}) >= 2  # the server stalls with its reader
    assert "unchanged" in column(beside, 12)
    (parquet,) = folder.glob("*.parquet")
    same = read_thermal_log(parquet)
    assert same.start == log.start
    assert same.time_s.tolist() == log.time_s.tolist()
    for name, values in log.columns.items():
        assert same.columns[name].tolist() == pytest.approx(values.tolist(), nan_ok=True)
    out = capsys.readouterr()
    assert f"{rows} rows were written" in out.out
    assert f"T_spindle_C: {rows} of {rows} readings recorded" in out.out
    assert "connection control is there" in out.err


def test_a_cable_that_is_cut_and_a_sensor_that_fails_are_in_the_record(tmp_path, monkeypatch):
    monkeypatch.setattr(_recorder, "WRITE_EVERY_S", 0.1)
    folder, stop = tmp_path / "logs", asyncio.Event()

    async def until(column_of_sources: int, status: str) -> None:
        """Wait until the last row that was written has this status."""
        while True:
            rows = [row for path in folder.glob("sources/*.csv") for row in rows_of(path)]
            if rows and rows[-1][column_of_sources] == status:
                return
            await asyncio.sleep(0.02)

    async def trouble() -> None:
        async with server(tmp_path, timeout_s=0.2) as (machine, cable):
            settings, clock = read_record(tmp_path / "record.toml"), SystemClock()
            async with record._connected(settings, clock) as sessions, asyncio.TaskGroup() as tasks:
                files = RecordingFiles(settings, folder)
                tasks.create_task(Recorder(settings, sessions, clock, files).run(None, stop))
                await until(1, "Good")
                await cable.cut()
                await until(1, "BadNoCommunication")
                machine.put("On", 0, status=ua.StatusCodes.BadSensorFailure)
                await cable.mend()
                await until(10, "BadSensorFailure")
                stop.set()

    asyncio.run(trouble())
    (path,) = folder.glob("*.csv")
    beside = folder / "sources" / path.name
    status = column(beside, 1)
    lost = [k for k, word in enumerate(status) if word == "BadNoCommunication"]
    assert lost
    assert lost == list(range(lost[0], lost[-1] + 1))
    assert {column(path, 1)[k] for k in lost} == {""}
    assert status[-1] == "Good"
    assert column(beside, 10)[-1] == "BadSensorFailure"
    assert column(path, 4)[-1] == ""
    assert column(beside, 12)[-1] == "sent 0"
    words_of_connection = [m for m in marks_of(path) if m.startswith("connection")]
    assert ["is there" in m for m in words_of_connection] == [True, False, True]


@pytest.fixture
def plan(tmp_path: Path) -> Path:
    """Return the plan of a test whose displacement and temperatures the server has."""
    heat, file = tmp_path / "heat.toml", tmp_path / "plan.json"
    heat.write_text(
        "block_min = 2\nrest_min = 1\nenough_um = 1e6\n"
        "[sources.spindle]\nlevels = [0, 3000]\ninput = 'T_spindle_C-T_column_C'\n"
    )
    planned = ("thermal-test", "plan", "--machine", heat, "--duration", "4min", "-o", file)
    assert main([str(word) for word in planned]) == 0
    return file


DISPLACEMENT = f'[channel.Z_um]\nnode = "nsu={NAMESPACE};s=T3"\nunit = "um"\n'


def test_what_a_planned_test_has_reached_is_told_while_a_server_is_recorded(
    tmp_path, plan, monkeypatch
):
    """As soon as its log has enough rows: its first block counts as over at once."""
    told = list[str]()
    monkeypatch.setattr(record, "TOLD_EVERY_S", 0.2)
    monkeypatch.setattr(record, "_tell", lambda message: told.append(message.code))
    monkeypatch.setattr(ThermalTestPlan, "foreseen_at_um", lambda _plan, _time_s: 7.0)

    async def followed() -> None:
        async with server(tmp_path, DISPLACEMENT):
            settings = read_record(tmp_path / "record.toml")
            (folder := tmp_path / "test").mkdir()
            given = (settings, folder, None, read_thermal_test_plan(plan))
            recording = asyncio.create_task(record._recorded(*given))
            while "recording-plan_enough" not in told and not recording.done():
                await asyncio.sleep(0.02)
            recording.cancel()
            await asyncio.wait({recording})

    asyncio.run(followed())
    assert "recording-plan_enough" in told


def test_what_it_has_reached_is_told_at_the_end_too(tmp_path, plan, monkeypatch):
    logs = list[tuple[Path, ...]]()
    monkeypatch.setattr(record, "told_of_plan", lambda _plan, files: logs.append(files))
    folder = tmp_path / "test"
    given = ("-o", str(folder), "--for", "0.2", "--plan", str(plan))
    assert with_server(tmp_path, *given, more=DISPLACEMENT) == 0
    assert logs == [tuple(folder.glob("*.csv"))]


def test_a_trial_shows_every_node_and_writes_nothing(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(_recorder, "TRY_AGAIN_S", 0.5)
    more = f'[channel.gone]\nnode = "nsu={NAMESPACE};s=Gone"\nunit = "1"\n'
    assert with_server(tmp_path, "--try", more=more) == 1
    out = capsys.readouterr().out
    assert "BadNodeIdUnknown" in out
    assert "source time stamp stood still for 0.5 s" in out
    assert [p.name for p in tmp_path.iterdir()] == ["record.toml"]


def test_who_records_over_midnight_is_told_how_to_get_one_log(tmp_path):
    path = tmp_path / "record.toml"
    url = "opc.tcp://127.0.0.1:4840"
    path.write_text(CONFIGURATION.format(url=url, namespace=NAMESPACE, timeout_s=1))
    settings = read_record(path)
    told = record._about(settings, tmp_path, 72 * 3600.0)
    assert "recording 4 channels every 0.1 s, 0.5 s from control" in told[0]
    assert "MB a day" in told[1]
    assert told[2].endswith("write days_per_file = 4")
    assert len(record._about(settings, tmp_path, 3600.0)) == 2
    assert len(record._about(settings, tmp_path, None)) == 2


@pytest.mark.parametrize("given", [(), ("--try", "-o", "x")])
def test_a_folder_is_named_unless_nothing_is_written(given):
    with pytest.raises(ConfigurationError, match="--output"):
        record.run(words("record.toml", *given))
