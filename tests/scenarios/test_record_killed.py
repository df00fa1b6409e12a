"""``thermaxis record`` as a program of its own: killed, started again, ended by a signal."""

import asyncio
import random
import sys
import time
from datetime import UTC, datetime
from pathlib import Path

import pytest

from tests.opcua_server import NAMESPACE, start_machine
from tests.unit.runtime.recording import marks_of, rows_of
from thermaxis.files import read_thermal_log

PROGRAM = """
import argparse, sys
from thermaxis.cli.machine import record
parser = argparse.ArgumentParser()
record.add_arguments(parser)
sys.exit(record.run(parser.parse_args()))
"""
CONFIGURATION = """
[record]
every_s = 0.1
days_per_file = 2
[connection.control]
url = "opc.tcp://127.0.0.1:{port}/machine"
security = "none"
[channel.T_spindle_C]
node = "nsu={namespace};s=T1"
unit = "degC"
"""
KILLS = 5

pytestmark = pytest.mark.system


async def recorded(folder: Path) -> list[float]:
    """Kill a recording several times and end it once; return what each kill cost. [s]"""
    machine = await start_machine()
    configuration = folder / "record.toml"
    configuration.write_text(CONFIGURATION.format(port=machine.port, namespace=NAMESPACE))
    moving = asyncio.create_task(move(machine))
    cost: list[float] = []
    chance = random.Random(6)  # noqa: S311 - moments, not secrets
    try:
        for number in range(KILLS + 1):
            program = await asyncio.create_subprocess_exec(
                sys.executable, "-c", PROGRAM, str(configuration), "-o", str(folder / "logs"),
                stdout=asyncio.subprocess.DEVNULL, stderr=asyncio.subprocess.DEVNULL,
            )  # fmt: skip
            before = len(all_rows(folder))
            while len(all_rows(folder)) < before + 5:
                assert program.returncode is None
                await asyncio.sleep(0.02)
            await asyncio.sleep(chance.uniform(0.0, 1.5))
            if number < KILLS:
                program.kill()
                killed = time.time()
                await program.wait()
                last = datetime.fromisoformat(all_rows(folder)[-1][0])
                cost.append(killed - last.replace(tzinfo=UTC).timestamp())
            else:
                program.terminate()
                assert await program.wait() == 0
    finally:
        moving.cancel()
        await asyncio.wait({moving})
        await machine.server.stop()
    return cost


async def move(machine) -> None:
    for k in range(10**6):
        machine.put("T1", 20.0 + k % 100)
        await asyncio.sleep(0.02)


def all_rows(folder: Path) -> list[list[str]]:
    found = [path for path in sorted((folder / "logs").glob("*.csv")) if path.stat().st_size]
    return [
        cells
        for path in found
        for cells in rows_of(path)
        if len(cells) == 2 and len(cells[0]) == 24
    ]


def test_a_recording_that_is_killed_loses_a_second_and_goes_on_in_its_file(tmp_path):
    cost = asyncio.run(recorded(tmp_path))
    (path,) = (tmp_path / "logs").glob("*.csv")
    assert max(cost) < 1.5  # a second, and what a busy computer is late
    times = [cells[0] for cells in rows_of(path)]
    assert times == sorted(set(times))
    assert all(len(cells) == 2 for cells in rows_of(path))
    marks = marks_of(path)
    assert sum(m.startswith("began") for m in marks) == KILLS + 1
    assert sum(m.startswith("gap") for m in marks) >= KILLS
    assert marks[-1] == "ended"
    log = read_thermal_log(path)
    assert log.remarks == ()
    assert log.rows == len(times)
