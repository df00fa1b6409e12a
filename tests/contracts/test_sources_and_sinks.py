"""Every source and every sink of the project on its stand: the contract holds for all of them."""

import asyncio
import math
from collections.abc import Iterator, Mapping
from typing import final

import numpy as np
import pytest

from tests.contracts.conformance import SinkRig, SourceRig, check_sink, check_source
from tests.opcua_server import NAMESPACE, Cable, Machine, start_machine
from tests.unit.runtime.linuxcnc_hal import MemoryHal
from thermaxis.compensation import Limits
from thermaxis.runtime import (
    AWAY,
    START_S,
    TOWARDS,
    Clock,
    ConnectionSettings,
    OpcUaSession,
    SystemClock,
    VirtualClock,
    interlock_name,
    run_in_virtual_time,
)
from thermaxis.runtime.sinks import (
    DrySink,
    LinuxCncOutput,
    LinuxCncSettings,
    LinuxCncSink,
    OpcUaOutput,
    OpcUaSink,
    hal_text,
)
from thermaxis.runtime.sources import (
    LifeCounter,
    LinuxCncSource,
    NodeSettings,
    OpcUaSource,
    ReplayClock,
    ReplaySource,
)
from thermaxis.thermal import ThermalLog
from thermaxis.virtual import Fault, FaultKind, LatheSink, LatheSource, VirtualLathe

NODE = f"nsu={NAMESPACE};s="
THREAD = "thread"


@pytest.fixture(scope="module")
def runner() -> Iterator[asyncio.Runner]:
    with asyncio.Runner() as runner:
        yield runner


@pytest.fixture(scope="module")
def machine(runner: asyncio.Runner) -> Iterator[Machine]:
    machine = runner.run(start_machine())
    yield machine
    runner.run(machine.stop())


def session_of(cable: Cable) -> OpcUaSession:
    settings = ConnectionSettings(
        name="machine", url=cable.url, security="none", timeout_s=1.0, retry_s=0.02
    )
    return OpcUaSession(settings, SystemClock())


class OpcUaStand:
    clock: Clock = SystemClock()
    deadline_s = 2.0

    async def take_away(self) -> None:
        await self.cable.cut()

    async def bring_back(self) -> None:
        await self.cable.mend()

    cable: Cable


@final
class OpcUaSourceStand(OpcUaStand, SourceRig):
    def __init__(self, cable: Cable) -> None:
        self.cable = cable
        nodes = {
            "T1": NodeSettings(node=NODE + "T1", unit="degC"),
            "T3": NodeSettings(node=NODE + "T3", unit="degC", scale=0.1),
            "referenced": NodeSettings(node=NODE + "Referenced", unit="bool"),
        }
        self.names = tuple(nodes)
        self.source = OpcUaSource(session_of(cable), nodes)


@final
class OpcUaSinkStand(OpcUaStand, SinkRig):
    """One offset in mm towards the workpiece, one counted in tenths of a micrometre."""

    resolution_um = 0.05

    def __init__(self, cable: Cable, machine: Machine) -> None:
        self.cable, self.machine = cable, machine
        outputs = {
            "Z_um": OpcUaOutput(node=NODE + "Offset", unit="mm", sign=TOWARDS),
            "X_um": OpcUaOutput(node=NODE + "OffsetInt", unit="0.1 um", sign=AWAY),
        }
        self.names = tuple(outputs)
        self.sink = OpcUaSink(session_of(cable), outputs, NODE + "Beat")

    def offsets_um(self) -> Mapping[str, float]:
        value = self.machine.value
        return {"Z_um": -1e3 * float(value("Offset")), "X_um": 0.1 * float(value("OffsetInt"))}

    def set_offset_um(self, name: str, offset_um: float) -> None:
        if name == "Z_um":
            self.machine.put("Offset", -1e-3 * offset_um)
        else:
            self.machine.put("OffsetInt", round(10 * offset_um))

    def heartbeat(self) -> float | None:
        return float(self.machine.value("Beat"))


async def on_a_cable(machine: Machine, check) -> None:
    cable = Cable()
    cable.plug(machine)
    await cable.mend()
    try:
        await check(cable)
    finally:
        await cable.cut()


def test_the_opcua_source_keeps_its_contract(runner: asyncio.Runner, machine: Machine) -> None:
    runner.run(on_a_cable(machine, lambda cable: check_source(OpcUaSourceStand(cable))))


def test_the_opcua_sink_keeps_its_contract(runner: asyncio.Runner, machine: Machine) -> None:
    runner.run(on_a_cable(machine, lambda cable: check_sink(OpcUaSinkStand(cable, machine))))


class LatheStand:
    """A virtual lathe whose network pauses every ten seconds, for five."""

    def __init__(self) -> None:
        self.clock = VirtualClock()
        pause = Fault(FaultKind.PAUSE, at_s=5.0, for_s=5.0, every_s=10.0)
        self.lathe = VirtualLathe("day", faults=[pause])

    async def take_away(self) -> None:
        while self.lathe.reachable:
            await self._wait()

    async def bring_back(self) -> None:
        while not self.lathe.reachable:
            await self._wait()

    async def _wait(self) -> None:
        await self.clock.sleep_until(self.clock.monotonic_s() + 1.0)
        self.lathe.step_to(self.clock.monotonic_s() - START_S)


@final
class LatheSourceStand(LatheStand, SourceRig):
    def __init__(self) -> None:
        super().__init__()
        self.source = LatheSource(self.lathe, self.clock)
        self.names = ("T_spindle_C", interlock_name("referenced"))


@final
class LatheSinkStand(LatheStand, SinkRig):
    settable = False

    def __init__(self) -> None:
        super().__init__()
        self.sink = LatheSink(self.lathe, self.clock)
        self.names = ("Z_um",)

    def offsets_um(self) -> Mapping[str, float]:
        return {"Z_um": 1e3 * self.lathe.axis.written_mm}

    def heartbeat(self) -> float | None:
        return float(self.lathe.axis.heartbeat)


@final
class LinuxCncStand(SinkRig):
    """A HAL in memory: what acts follows what is written at the rate of the machine."""

    resolution_um = 0.2

    def __init__(self) -> None:
        self.clock = VirtualClock()
        limits = Limits(100.0, 10.0)
        settings = LinuxCncSettings(
            outputs={
                "Z_um": LinuxCncOutput(2, "mm", AWAY, limits),
                "X_um": LinuxCncOutput(0, "inch", TOWARDS, limits),
            }
        )
        self.hal = MemoryHal(hal_text(settings))
        self.names = tuple(settings.outputs)
        self.sink = LinuxCncSink(settings, self.clock, self.hal.attach)

    settable = False

    async def take_away(self) -> None:
        self.hal.running = False

    async def bring_back(self) -> None:
        self.hal.running = True

    def offsets_um(self) -> Mapping[str, float]:
        return {
            "Z_um": 1e3 * self.hal.pin("thermaxis-limit-2.in"),
            "X_um": -25_400.0 * self.hal.pin("thermaxis-limit-0.in"),
        }

    def standing_um(self) -> Mapping[str, float]:
        return {
            "Z_um": 1e3 * self.hal.pin("thermaxis-shift-2.offset"),
            "X_um": -25_400.0 * self.hal.pin("thermaxis-shift-0.offset"),
        }

    def heartbeat(self) -> float | None:
        return self.hal.pin("watchdog.input-0")


@final
class LinuxCncSourceStand(SourceRig):
    def __init__(self) -> None:
        self.clock = VirtualClock()
        self.hal = MemoryHal(
            f"loadrt threadtest names={THREAD}\naddf {THREAD}.increment servo-thread"
        )
        self.hal._pins("thermo", {"value": 31.5})
        self.hal._pins("motion", {"motion-enabled": 1.0}, "bit")
        nodes = {
            "T1": NodeSettings(node="hal:thermo.value", unit="degC"),
            "on": NodeSettings(node="hal:motion.motion-enabled", unit="bool"),
        }
        self.names = tuple(nodes)
        life = LifeCounter(f"hal:{THREAD}.count", 2.0, self.clock)
        self.source = LinuxCncSource(nodes, life, self.clock, open_hal=self.hal.attach)

    async def take_away(self) -> None:
        self.hal.running = False

    async def bring_back(self) -> None:
        self.hal.running = True


@final
class ReplayStand(SourceRig):
    removable = False

    def __init__(self) -> None:
        time_s = np.arange(0.0, 10.0)
        log = ThermalLog(time_s=time_s, columns={"T_C": 20.0 + time_s})
        self.clock = ReplayClock()
        self.source = ReplaySource(log, {"T_C": "degC"}, self.clock)
        self.names = ("T_C",)


@final
class DryStand(SinkRig):
    removable = False

    def __init__(self) -> None:
        self.clock = VirtualClock()
        self.names = ("Z_um", "X_um")
        self.sink = DrySink(self.names)

    def offsets_um(self) -> Mapping[str, float]:
        return self.sink._correction_um


@pytest.mark.parametrize("stand", [LatheSourceStand, LinuxCncSourceStand, ReplayStand])
def test_every_source_keeps_its_contract(stand) -> None:
    async def check() -> None:
        await check_source(stand())

    run_in_virtual_time(check())


@pytest.mark.parametrize("stand", [LatheSinkStand, LinuxCncStand, DryStand])
def test_every_sink_keeps_its_contract(stand) -> None:
    async def check() -> None:
        await check_sink(stand())

    run_in_virtual_time(check())


def altered(part, call: str, *, asked=lambda told: told, said=lambda result: result) -> None:
    """Give a call of a source or a sink a fault in what it takes or in what it says."""
    right = getattr(part, call)

    async def wrong(first, *rest):
        return said(await right(asked(first), *rest))

    setattr(part, call, wrong)


def every(**changes):
    return lambda samples: {name: one._replace(**changes) for name, one in samples.items()}


@pytest.mark.parametrize(
    ("said", "sentence"),
    [
        (every(value=20.0), "had a value before its machine was there"),
        (every(good=False), "did not find its machine"),
        (every(value=math.nan), "is nan"),
        (every(age_s=-1.0), "the age of .* is -1.0"),
        (every(status=""), "has no status"),
        (lambda _: {}, "read left out"),
    ],
)
def test_a_source_with_a_fault_is_found(said, sentence) -> None:
    stand = LinuxCncSourceStand()
    altered(stand.source, "read", said=said)
    with pytest.raises(AssertionError, match=sentence):
        run_in_virtual_time(check_source(stand))


@pytest.mark.parametrize(
    ("call", "fault", "sentence"),
    [
        ("write", {"said": lambda _: True}, "a write succeeded before its machine was there"),
        ("write", {"said": lambda _: False}, "a write failed"),
        ("write", {"asked": lambda um: {n: -v for n, v in um.items()}}, "the machine has .* was"),
        ("write", {"asked": lambda um: {n: max(-9.0, min(v, 9.0)) for n, v in um.items()}},
         "nan was accepted|inf was accepted"),
        ("found", {"said": lambda news: news or {}}, "there was news of the machine before"),
        ("found", {"said": lambda news: news and dict.fromkeys(news, 55.0)}, "found says 55.0 um"),
        ("read_back", {"said": lambda _: {}}, "read_back left out"),
    ],
)  # fmt: skip
def test_a_sink_with_a_fault_is_found(call, fault, sentence) -> None:
    stand = LinuxCncStand()
    altered(stand.sink, call, **fault)
    with pytest.raises(AssertionError, match=sentence):
        run_in_virtual_time(check_sink(stand))
