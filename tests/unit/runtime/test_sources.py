"""What stands between a reading and its being believed: life counters, time stamps, pins of HAL."""

import asyncio
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

import pytest
from asyncua import ua

from tests.opcua_server import NAMESPACE, Machine, until
from tests.unit.runtime.linuxcnc_hal import MemoryHal
from tests.unit.runtime.machine_files import machine_file
from thermaxis.cli.machine._machine_parts import build_parts
from thermaxis.codes import Message
from thermaxis.runtime import (
    NOT_READ,
    ConnectionSettings,
    Finding,
    OpcUaSession,
    SourceSample,
    SystemClock,
    VirtualClock,
    examine_machine,
    read_machine,
    run_in_virtual_time,
    self_test,
)
from thermaxis.runtime.sources import LifeCounter, LinuxCncSource, NodeSettings, OpcUaSource

COUNTER = f"nsu={NAMESPACE};s=OffsetInt"
STANDS = Message("error-life_stands", {"node": COUNTER, "within_s": 5.0})


@dataclass
class HandClock:
    """A clock that a test winds."""

    now_s: float = 100.0

    def monotonic_s(self) -> float:
        return self.now_s

    def utc(self) -> datetime:
        return datetime(2026, 11, 21, tzinfo=UTC)

    async def sleep_until(self, monotonic_s: float) -> None:
        self.now_s = monotonic_s


class Plc:
    """A source of two temperatures, the second of them stamped on change, and a life counter."""

    def __init__(self, machine: Machine) -> None:
        self.machine, self.clock, self.count = machine, HandClock(), 0
        url = f"opc.tcp://127.0.0.1:{machine.port}/machine"
        session = OpcUaSession(
            ConnectionSettings(name="machine", url=url, security="none"), SystemClock()
        )
        life = LifeCounter(COUNTER, 5.0, self.clock)
        nodes = {
            name: NodeSettings(
                node=f"nsu={NAMESPACE};s={name}", unit="degC", on_change=name == "T2"
            )
            for name in ("T1", "T2")
        }
        self.source = OpcUaSource(session, nodes, life)

    async def open(self) -> None:
        await self.source.open()
        await until(lambda: self.source.session.connected)

    def lives(self, passed_s: float, *, status: int = 0) -> None:
        """Let time pass, and the counter count then."""
        self.clock.now_s += passed_s
        self.count += 1
        self.machine.put("OffsetInt", self.count, status=status)

    async def read(self) -> tuple[list[float | None], list[float | None], Message | None]:
        samples = await self.source.read(5.0)
        assert self.source.connected is (self.source.failure is None)
        found = [samples[name] for name in ("T1", "T2")]
        return [s.value for s in found], [s.age_s for s in found], self.source.failure


@pytest.fixture
def plc(runner: asyncio.Runner, machine: Machine) -> Iterator[Plc]:
    plc = Plc(machine)
    runner.run(plc.open())
    yield plc
    runner.run(plc.source.close())


async def test_nothing_is_believed_before_the_life_counter_has_moved_and_after_it_stands(
    plc: Plc,
) -> None:
    plc.machine.put("T1", 20.0)
    plc.machine.put("T2", 21.0)
    nothing = ([None, None], [None, None], STANDS)
    assert await plc.read() == nothing
    plc.lives(1.0)
    assert (await plc.read())[::2] == ([20.0, 21.0], None)
    plc.clock.now_s += 5.0
    plc.machine.put("T1", 20.5)  # a gateway stamps anew what its PLC does not change any more
    assert (await plc.read())[::2] == ([20.5, 21.0], None)
    plc.clock.now_s += 0.01
    assert await plc.read() == nothing
    plc.lives(60.0)
    assert (await plc.read())[::2] == ([20.5, 21.0], None)


async def test_a_bad_value_of_the_counter_is_no_sign_of_life(plc: Plc) -> None:
    plc.lives(0.0)
    await plc.read()
    for _ in range(3):
        plc.lives(1.0, status=ua.StatusCodes.BadNoCommunication)
        assert (await plc.read())[2] == STANDS


async def test_a_value_that_is_stamped_on_change_is_as_old_as_the_last_sign_of_life(
    plc: Plc,
) -> None:
    plc.lives(0.0)
    await plc.read()
    plc.machine.put("T1", 20.0, age_s=3600.0)
    plc.machine.put("T2", 21.0, age_s=3600.0)
    plc.lives(1.0)
    for passed_s in (0.0, 2.0, 2.0):
        plc.clock.now_s += passed_s
        values, ages, _ = await plc.read()
        assert values == [20.0, 21.0]
        assert ages[0] == pytest.approx(3600.0, abs=2.0)  # which the rules call too old
        assert ages[1] == plc.clock.now_s - 101.0


# ---- LinuxCNC -----------------------------------------------------------------------------------

PINS = (
    ('kind = "opcua"\nconnection = "control"\n\n[sink]', 'kind = "linuxcnc"\n\n[sink]'),
    (
        'kind = "opcua"\nconnection = "control"\nheartbeat_node = "ns=2;s=Heartbeat"',
        'kind = "dry"\nhalcmd = "/opt/halcmd"',
    ),
    ("ns=2;s=T_spindle_2", "hal:thermo.1"),
    ("ns=2;s=T_spindle", "hal:thermo.0"),
    ("ns=2;s=T_column", "hal:thermo.2"),
    ('node = "ns=2;s=Z_referenced"', 'node = "hal:status.word"\nbit = 1'),
    ("ns=2;s=EmergencyStop", "hal:motion.motion-enabled"),
    ("ns=2;s=OwnCompensation", "hal:own.on"),
    ("ns=2;s=Diameter", "hal:lathe.diameter"),
)


class Lathe:
    """A LinuxCNC in memory with what a configuration reads of it."""

    def __init__(self, folder: Path) -> None:
        self.clock = VirtualClock()
        self.hal = MemoryHal("loadrt threadtest names=motion\naddf motion.increment servo-thread")
        self.hal.values["motion.servo.last-period"] = 0.0
        self.hal.kinds["motion.servo.last-period"] = "u32"
        self.hal.behaviour["motion.increment"] = self._period
        self.hal._pins("thermo", {"0": 31.5, "1": 31.75, "2": 294.5})
        self.hal._pins("motion", {"motion-enabled": 0.0}, "bit")
        self.hal._pins("own", {"on": 0.0}, "bit")
        self.hal._pins("status", {"word": 2.0}, "u32")
        self.hal._pins("lathe", {"diameter": 250.0})
        self.configuration = read_machine(machine_file(folder, *PINS))
        parts = build_parts(self.configuration, self.clock)
        assert isinstance(parts.pins, LinuxCncSource)
        assert parts.ports.source is parts.pins
        assert parts.pins._program == "/opt/halcmd"
        self.source = parts.pins
        self.source._open_hal = self.hal.attach
        self.parts = parts

    def _period(self) -> None:
        self.hal.values["motion.servo.last-period"] += 1.0

    async def tested(self) -> tuple[Finding, ...]:
        return await self_test(self.configuration, {}, self.parts.sink, pins=self.source)

    async def wait(self, for_s: float) -> Mapping[str, SourceSample]:
        await self.clock.sleep_until(self.clock.monotonic_s() + for_s)
        return await self.source.read(0.5)


def test_a_configuration_of_pins_gives_temperatures_interlocks_and_the_diameter(
    tmp_path: Path,
) -> None:
    async def look() -> None:
        lathe = Lathe(tmp_path)
        await lathe.source.read(0.5)
        samples = await lathe.wait(0.1)
        assert {name: sample.value for name, sample in samples.items()} == {
            "T_spindle_C": 31.5,
            "T_spindle_C.redundant": 31.75,
            "T_column_C": pytest.approx(294.5 - 273.15),
            "interlock.referenced": 1.0,
            "interlock.emergency_stop": 0.0,
            "other_compensation": 0.0,
            "diameter": 250.0,
        }
        assert all(sample.good and sample.age_s == 0.0 for sample in samples.values())
        lathe.hal.values["status.word"] = 5.0
        del lathe.hal.values["thermo.2"]
        samples = await lathe.wait(0.1)
        assert samples["interlock.referenced"].value == 0.0
        assert samples["T_column_C"] == (None, False, "BadNodeIdUnknown", None, None)
        await lathe.source.close()

    run_in_virtual_time(look())


def test_pins_of_a_thread_that_stands_are_not_believed_and_looked_for_anew(tmp_path: Path) -> None:
    async def look() -> None:
        lathe = Lathe(tmp_path)
        await lathe.source.read(0.5)
        assert (await lathe.wait(0.1))["T_spindle_C"].value == 31.5
        lathe.hal.thread_runs = False
        assert (await lathe.wait(4.9))["T_spindle_C"].value == 31.5
        assert (await lathe.wait(0.2))["T_spindle_C"] == NOT_READ
        assert lathe.source._hal is None  # memory of a LinuxCNC that has ended
        lathe.hal.running = False
        await lathe.wait(1.0)
        assert lathe.source.failure == Message("error-linuxcnc_not_running")
        lathe.hal.running = lathe.hal.thread_runs = True
        await lathe.wait(1.0)
        assert (await lathe.wait(0.1))["T_spindle_C"].value == 31.5
        assert lathe.source.failure is None
        lathe.hal.answers = False
        assert (await lathe.wait(0.1))["T_spindle_C"] == NOT_READ
        assert not lathe.source.connected
        await lathe.source.close()

    run_in_virtual_time(look())


def test_the_self_test_looks_at_every_pin(tmp_path: Path) -> None:
    async def look() -> None:
        lathe = Lathe(tmp_path)
        lathe.hal.before_answer = lambda _command: lathe._period()
        found = await lathe.tested()
        assert {(f.message.code, f.message.place.key) for f in found} == {
            ("self_test-input_age", "input.T_spindle_C"),
            ("self_test-input_age", "input.T_spindle_C.redundant_node"),
            ("self_test-input_age", "input.T_column_C"),
            ("self_test-interlock_met", "interlock.referenced"),
            ("self_test-interlock_met", "interlock.emergency_stop"),
            ("self_test-other_compensation_off", "other_compensation"),
            ("self_test-diameter", "diameter"),
            ("self_test-pins", "source"),
        }
        del lathe.hal.values["thermo.2"]
        lathe.hal.kinds["status.word"] = "float"
        found = await lathe.tested()
        codes = {f.message.place.key: f.message.code for f in found}
        assert codes["input.T_column_C"] == "self_test-no_node"
        assert codes["interlock.referenced"] == "self_test-node_no_bit"
        lathe.hal.running = False
        (said,) = await lathe.tested()
        assert said.message.code == "self_test-pins_unread"
        await lathe.source.close()

    run_in_virtual_time(look())


def test_a_pin_stands_where_pins_are_read_and_a_node_where_a_server_is(tmp_path: Path) -> None:
    for changes, code, key in (
        ([*PINS, ("hal:thermo.2", "ns=2;s=T")], "no_hal_pin", "input.T_column_C.node"),
        ([*PINS, ("hal:thermo.2", "hal:T column")], "no_hal_pin", "input.T_column_C.node"),
        ([("ns=2;s=T_column", "hal:thermo.2")], "hal_pin", "input.T_column_C.node"),
        ([("ns=2;s=Z_offset", "hal:thermo.2")], "hal_pin", "output.Z_um.node"),
    ):
        found = examine_machine(machine_file(tmp_path, *changes))
        assert isinstance(found, tuple)
        assert (f"error-{code}", key) in {(one.code, one.place.key) for one in found}, found
