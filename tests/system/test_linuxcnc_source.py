"""Temperatures, machine on and E-stop of a real LinuxCNC, read from its pins."""

import asyncio
import subprocess
import time
from collections.abc import Callable, Sequence
from pathlib import Path

import pytest

from tests.in_time import LONGEST_S, in_time
from tests.system.linuxcnc.machine import missing, one_at_a_time
from tests.system.linuxcnc.offset_machine import OffsetMachine, main_hal, running
from tests.system.test_linuxcnc_offset import SETTINGS
from tests.unit.runtime.machine_files import machine_file
from thermaxis.cli import main
from thermaxis.cli.machine._machine_parts import build_parts
from thermaxis.runtime import (
    SourceSample,
    SystemClock,
    counter_name,
    probe_name,
    read_machine,
)
from thermaxis.runtime.sinks import hal_text
from thermaxis.runtime.sources import LinuxCncSource

pytestmark = [pytest.mark.system, pytest.mark.real_time]

SENSORS = """
loadrt constant names=spindle,column
setp spindle.value 31.5
setp column.value 294.65
addf spindle servo-thread
addf column servo-thread
"""
PINS = (
    ('kind = "opcua"\nconnection = "control"\n\n[sink]', 'kind = "linuxcnc"\n\n[sink]'),
    (
        'kind = "opcua"\nconnection = "control"\nheartbeat_node = "ns=2;s=Heartbeat"',
        'kind = "dry"',
    ),
    ('\nredundant_node = "ns=2;s=T_spindle_2"', ""),
    ("ns=2;s=T_spindle", "hal:spindle.out"),
    ("ns=2;s=T_column", "hal:column.out"),
    ("ns=2;s=Z_referenced", "hal:motion.motion-enabled"),
    (
        'node = "ns=2;s=EmergencyStop"\nmet = false',
        'node = "hal:iocontrol.0.emc-enable-in"\nmet = true',
    ),
    ('[other_compensation]\nnode = "ns=2;s=OwnCompensation"\nactive = true', ""),
    ('[diameter]\nnode = "ns=2;s=Diameter"\nunit = "mm"', ""),
)
READ = ["T_spindle_C", "T_column_C", "interlock.referenced", "interlock.emergency_stop"]


TOUCHED = """
[probe.Z_um]
node = "hal:motion.analog-out-00"
unit = "um"
counter_node = "hal:motion.analog-out-01"
largest_um = 10.0
largest_rate_um_per_s = 0.1
"""
"""Where `thermaxis program --touch` leaves value and counter."""
TOUCH = [counter_name("Z_um"), probe_name("Z_um")]


async def until(
    source: LinuxCncSource,
    reached: Callable[[list[SourceSample]], bool],
    names: Sequence[str] = READ,
) -> list[SourceSample]:
    """Read ten times a second until something is seen."""
    end_s = time.monotonic() + LONGEST_S
    while True:
        began_s = time.monotonic()
        samples = await source.read(0.5)
        assert in_time(time.monotonic() - began_s, 1.0)
        found = [samples[name] for name in names]
        if reached(found):
            return found
        assert time.monotonic() < end_s, (found, source.failure)
        await asyncio.sleep(0.1)


def values(samples: list[SourceSample]) -> list[float | None]:
    return [sample.value for sample in samples]


async def at_the_machine(source: LinuxCncSource, machine: OffsetMachine) -> None:
    await until(source, lambda found: values(found) == [31.5, pytest.approx(21.5), 0.0, 0.0])
    for verb, machine_on in (("home", 1.0), ("off", 0.0), ("on", 1.0)):  # no E-stop any more
        await asyncio.to_thread(machine.order, verb)
        found = await until(source, lambda found, on=machine_on: values(found)[2:] == [on, 1.0])
        assert all(sample.good for sample in found)
        assert in_time(max(s.age_s for s in found if s.age_s is not None), 1.0)
    for touched in ("M68 E0 Q12.5", "M68 E1 Q1"):  # as the touch program ends
        await asyncio.to_thread(machine.order, "move", text=touched)
    await until(source, lambda found: values(found) == [1.0, 12.5], TOUCH)
    subprocess.run(["/usr/bin/halcmd", "setp", "spindle.value", "31.75"], check=True)
    await until(source, lambda found: found[0].value == 31.75)


def test_pins_of_linuxcnc_are_temperatures_and_interlocks_through_its_end_and_its_return(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    reason = missing()
    if reason:
        pytest.fail(reason, pytrace=False)
    (tmp_path / "history").mkdir()
    path = machine_file(tmp_path, *PINS)
    path.write_text(path.read_text("utf-8") + TOUCHED, encoding="utf-8")
    configuration = read_machine(path)
    source = build_parts(configuration, SystemClock()).pins
    assert source is not None
    asyncio.run(through_its_end_and_return(source, path))
    assert capsys.readouterr().out.count("LinuxCNC runs, and its pins can be read.") == 2


async def through_its_end_and_return(source: LinuxCncSource, path: Path) -> None:
    with one_at_a_time():
        for _ in range(2):
            life = running(hal_text(SETTINGS), machine_hal=main_hal() + SENSORS)
            machine = await asyncio.to_thread(life.__enter__)
            try:
                await at_the_machine(source, machine)
                assert await asyncio.to_thread(main, ["check", str(path)]) == 0
            finally:
                ending = asyncio.create_task(asyncio.to_thread(life.__exit__, None, None, None))
                found = await until(source, lambda _found: not source.connected)
                await ending
            assert values(found) == [None] * 4
            assert source.failure is not None
            assert source.failure.code == "error-linuxcnc_not_running"
    await source.close()
