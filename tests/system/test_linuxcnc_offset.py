"""Thermal offsets on a real LinuxCNC: they act on the drive, within limits, and never alone.

One campaign: a LinuxCNC is waited for and homed, a sink writes; a writer of its own is frozen,
goes on, lives through a restart of LinuxCNC, and is killed. Every servo period is recorded.
"""

import asyncio
import json
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Self

import numpy as np
import pytest

from tests.contracts.conformance import SinkRig, check_sink
from tests.in_time import LONGEST_S, in_time
from tests.refusals import said_by
from tests.system.linuxcnc.machine import missing, one_at_a_time
from tests.system.linuxcnc.offset_machine import (
    OffsetMachine,
    OffsetTrace,
    main_hal,
    running,
    wait_for,
)
from tests.system.linuxcnc.offset_writer import CYCLE_S, settings_of
from thermaxis.compensation import Limits
from thermaxis.runtime import AWAY, TOWARDS, Applied, Clock, SystemClock
from thermaxis.runtime.sinks import LinuxCncOutput, LinuxCncSettings, LinuxCncSink, hal_text

pytestmark = [pytest.mark.system, pytest.mark.real_time]

BOUND_UM, RATE_UM_PER_S, GOAL_UM = 40.0, 10.0, 30.0
STATED = json.dumps(
    {
        "Z_um": (2, AWAY, BOUND_UM, RATE_UM_PER_S),
        "X_um": (0, TOWARDS, BOUND_UM, RATE_UM_PER_S),
    }
)
SETTINGS = settings_of(STATED)
PERIOD_S = 0.001
TRIED = 5
DEADLINE_S = 0.5
EXACT_MM = 1e-12


@dataclass(slots=True)
class Campaign:
    """What was seen."""

    before_start: str = ""
    before_home: str = ""
    found: object = None
    too_early: bool = True
    shown: dict[str, object] = field(default_factory=dict)
    shifted: dict[str, Applied] = field(default_factory=dict)
    bounded: dict[str, Applied] = field(default_factory=dict)
    no_numbers: list[bool] = field(default_factory=list)
    switched: dict[str, dict[str, object]] = field(default_factory=dict)
    unhomed: str = ""
    rehomed: object = None
    stopped_s: float = 0.0
    continued_s: float = 0.0
    heeded_s: float = 0.0
    ended_s: float = 0.0
    killed_s: float = 0.0
    halcmds: tuple[int, int] = (0, 0)
    first: OffsetTrace | None = None
    second: OffsetTrace | None = None
    lines: list[dict[str, object]] = field(default_factory=list)


@pytest.fixture(scope="module")
def campaign(tmp_path_factory: pytest.TempPathFactory) -> Campaign:
    """Run the campaign once."""
    reason = missing()
    if reason:
        pytest.fail(reason, pytrace=False)
    seen = Campaign()
    with one_at_a_time(), Writer(tmp_path_factory.mktemp("writer")) as writer:
        seen.before_start = asyncio.run(alone())
        with running(hal_text(SETTINGS)) as machine:
            asyncio.run(at_the_machine(machine, seen))
            writer.start()
            freeze(machine, writer, seen)
            seen.first = machine.trace()
            seen.ended_s = time.monotonic()
        with running(hal_text(SETTINGS)) as machine:
            start_again(machine, writer, seen)
            seen.second = machine.trace()
        seen.lines = writer.lines()
    return seen


class Writer:
    """The writer as a program of its own."""

    def __init__(self, folder: Path) -> None:
        self.log = folder / "log"
        self.may_find = folder / "may-find"
        self.must_stop = folder / "must-stop"
        self.program: subprocess.Popen[bytes] | None = None

    def start(self) -> None:
        self.may_find.touch()
        program = Path(__file__).parent / "linuxcnc" / "offset_writer.py"
        with self.log.open("wb") as log:
            self.program = subprocess.Popen(
                [sys.executable, str(program), STATED, str(GOAL_UM), self.may_find, self.must_stop],
                stdin=subprocess.DEVNULL,
                stdout=log,
                stderr=subprocess.STDOUT,
            )

    def signal(self, number: int) -> float:
        self.program.send_signal(number)
        return time.monotonic()

    def stand(self) -> float:
        """Let it stop itself between two cycles; return when it stood."""
        state = Path(f"/proc/{self.program.pid}/stat")
        self.must_stop.touch()
        wait_for(
            lambda: state.read_text().rpartition(")")[2].split()[0] == "T", LONGEST_S, "a stop"
        )
        self.must_stop.unlink()
        return time.monotonic()

    def lines(self) -> list[dict[str, object]]:
        whole = self.log.read_text(encoding="utf-8").split("\n")[:-1]
        return [json.loads(line) for line in whole]

    def wait_for(self, what: str, reached: Callable[[dict[str, object]], bool]) -> None:
        def last() -> bool:
            assert self.program.poll() is None, self.log.read_text(encoding="utf-8")
            lines = self.lines()
            return bool(lines) and reached(lines[-1])

        wait_for(last, LONGEST_S, what)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        if self.program is not None and self.program.poll() is None:
            self.program.kill()
        if self.program is not None:
            self.program.wait(10.0)


def at_goal(line: dict[str, object]) -> bool:
    """Return whether a cycle of the writer says that both joints are shifted as wanted."""
    effective = [applied[2] for applied in line["applied"].values()]
    return None not in effective and bool(np.allclose(effective, GOAL_UM, rtol=1e-6))


async def alone() -> str:
    """Look for a LinuxCNC that is not there; return what is said about it."""
    before = shared_memory()
    sink = LinuxCncSink(SETTINGS, SystemClock())
    await sink.open()
    await asyncio.sleep(1.2)
    assert shared_memory() == before  # a halcmd would have made a HAL of its own
    said = said_by(sink)
    await sink.close()
    return said


def shared_memory() -> int:
    """Return how many segments there are."""
    return len(Path("/proc/sysvipc/shm").read_text(encoding="ascii").splitlines())


async def at_the_machine(machine: OffsetMachine, seen: Campaign) -> None:
    """Home beside an open sink, shift, move, ask for too much and for no number, home again."""
    sink = LinuxCncSink(SETTINGS, SystemClock())
    await sink.open()
    try:
        await until(lambda: "homed" in said_by(sink))
        seen.before_home = said_by(sink)
        await order(machine, "home")
        await until(lambda: sink.connected)
        seen.too_early = await sink.write(both(GOAL_UM), DEADLINE_S)
        seen.found = await sink.found(DEADLINE_S)
        moving = asyncio.create_task(order(machine, "move", text="G0 X5 Y-60 Z-60"))
        await hold(sink, GOAL_UM, 3.5)
        await moving
        seen.shifted = dict(await sink.read_back(DEADLINE_S))
        seen.shown = await order(machine, "look")
        await hold(sink, 2.5 * BOUND_UM, 1.5)
        seen.bounded = dict(await sink.read_back(DEADLINE_S))
        for value in (float("nan"), float("inf"), float("-inf")):
            seen.no_numbers.append(await sink.write(both(value), DEADLINE_S))
            await asyncio.sleep(0.1)
        await hold(sink, GOAL_UM, 0.5)
        for verb in ("off", "on"):
            switching = asyncio.create_task(order(machine, verb))
            await hold(sink, GOAL_UM, 0.5)
            seen.switched[verb] = await switching
        await order(machine, "unhome", joint="2")
        await until(lambda: not sink.connected)
        seen.unhomed = said_by(sink)
        await order(machine, "home")
        await until(lambda: sink.connected)
        seen.rehomed = await sink.found(DEADLINE_S)
    finally:
        await sink.close()


def freeze(machine: OffsetMachine, writer: Writer, seen: Campaign) -> None:
    """Stop the writer like a hung computer, let it go on, and at last let it heed `found`."""
    machine.order("move", text="G0 X0 Y0 Z-10")
    writer.wait_for("both offsets at the goal", at_goal)
    writer.may_find.unlink()
    time.sleep(2.0 * CYCLE_S)
    seen.stopped_s = writer.stand()
    time.sleep(2.0 + GOAL_UM / RATE_UM_PER_S + 1.0)
    seen.continued_s = writer.signal(signal.SIGCONT)
    wait_for(lambda: len(since(writer, seen.continued_s)) >= TRIED, LONGEST_S, "it tries again")
    seen.heeded_s = time.monotonic()
    writer.may_find.touch()
    writer.wait_for("both offsets at the goal again", at_goal)


def since(writer: Writer, time_s: float) -> list[dict[str, object]]:
    """Return what the writer has said later."""
    return [line for line in writer.lines() if line["time_s"] > time_s]


def start_again(machine: OffsetMachine, writer: Writer, seen: Campaign) -> None:
    """Home the second LinuxCNC under the same writer, and kill the writer."""
    machine.order("home")
    writer.wait_for("both offsets at the goal after a restart", at_goal)
    before = len(halcmds())
    seen.killed_s = writer.signal(signal.SIGKILL)
    writer.program.wait(10.0)
    time.sleep(2.0 + GOAL_UM / RATE_UM_PER_S + 0.5)
    seen.halcmds = before, len(halcmds())


def halcmds() -> list[str]:
    """Return the ids of the programs that run as a lasting halcmd."""
    found: list[str] = []
    for entry in Path("/proc").iterdir():
        if entry.name.isdigit():
            try:
                line = (entry / "cmdline").read_bytes()
            except OSError:  # it has ended meanwhile
                continue
            if line.endswith(b"halcmd\x00-k\x00-f\x00"):
                found.append(entry.name)
    return found


def both(value_um: float) -> dict[str, float]:
    return {"Z_um": value_um, "X_um": value_um}


async def order(machine: OffsetMachine, verb: str, **words: str) -> dict[str, object]:
    return await asyncio.to_thread(machine.order, verb, **words)


async def hold(sink: LinuxCncSink, value_um: float, duration_s: float) -> None:
    """Write one value again and again, and require that each is accepted."""
    for _ in range(round(duration_s / CYCLE_S)):
        assert await sink.write(both(value_um), DEADLINE_S), said_by(sink)
        await asyncio.sleep(CYCLE_S)


async def until(reached: Callable[[], bool]) -> None:
    await asyncio.to_thread(wait_for, reached, LONGEST_S, "something of the sink")


# ---- what the campaign shows --------------------------------------------------------------------


def test_a_linuxcnc_that_is_not_there_is_waited_for_and_none_is_made(campaign: Campaign) -> None:
    assert "not running" in campaign.before_start


def test_nothing_is_written_before_the_joints_are_homed_and_found_was_read(
    campaign: Campaign,
) -> None:
    assert "Not homed: joint 0; 2" in campaign.before_home
    assert not campaign.too_early
    assert campaign.found == both(0.0)
    first = campaign.first
    assert np.flatnonzero(first.armed)[0] > 0
    assert np.all(first.request[: np.flatnonzero(first.armed)[0] - 50] == 0.0)


def test_the_offset_acts_on_the_drive_and_neither_program_nor_display_sees_it(
    campaign: Campaign,
) -> None:
    for applied in campaign.shifted.values():
        assert applied == (GOAL_UM, pytest.approx(GOAL_UM), pytest.approx(GOAL_UM))
    for what in ("commanded", "actual", "joints"):
        assert campaign.shown[what] == pytest.approx([5.0, -60.0, -60.0], abs=1e-9)
    trace = campaign.first
    np.testing.assert_allclose(trace.drive - trace.commanded, trace.offset, rtol=0, atol=EXACT_MM)
    shifted = np.abs(trace.offset - 1e-3 * GOAL_UM) < 1e-9
    at_rest = shifted & (np.abs(trace.commanded + 60.0) < 1e-9)
    assert np.count_nonzero(at_rest) > 300
    np.testing.assert_allclose(trace.drive[at_rest], -59.97, rtol=0, atol=1e-8)
    np.testing.assert_allclose(trace.feedback[at_rest], -60.0, rtol=0, atol=1e-8)


def test_a_positive_correction_moves_each_joint_as_its_sentence_says(campaign: Campaign) -> None:
    trace = campaign.first
    assert np.max(trace.offset) == pytest.approx(1e-3 * BOUND_UM)
    assert np.min(trace.offset) >= 0.0
    assert np.min(trace.offset_0) == pytest.approx(-1e-3 * BOUND_UM)
    assert np.max(trace.offset_0) <= 0.0


def test_the_offset_delays_no_motion(campaign: Campaign) -> None:
    trace = campaign.first
    moving = np.flatnonzero(np.diff(trace.commanded))
    speed = np.abs(np.diff(trace.commanded)) / PERIOD_S
    assert np.max(speed) > 300.0
    assert moving.size > 100
    offset = trace.drive - trace.commanded  # in the same period
    assert np.max(np.abs(offset)) <= 1e-3 * BOUND_UM + 1e-9
    # joint 1 moved along with it, without an offset: one more period would cost 0.3 mm
    np.testing.assert_allclose(trace.following_error, trace.following_error_1, rtol=0, atol=1e-9)


def test_no_bound_is_passed_in_any_period_and_the_rate_is_used(campaign: Campaign) -> None:
    for trace in (campaign.first, campaign.second):
        for offset in (trace.offset, trace.offset_0):
            step = np.abs(np.diff(offset)) / PERIOD_S
            assert np.max(step) <= 1e-3 * RATE_UM_PER_S * (1.0 + 1e-9)
            assert np.max(step) >= 1e-3 * RATE_UM_PER_S * (1.0 - 1e-9)
            assert np.max(np.abs(offset)) <= 1e-3 * BOUND_UM * (1.0 + 1e-9)


def test_more_than_the_bound_is_accepted_as_the_bound(campaign: Campaign) -> None:
    for applied in campaign.bounded.values():
        assert applied.requested_um == 2.5 * BOUND_UM
        assert applied.accepted_um == pytest.approx(BOUND_UM)
        assert applied.effective_um == pytest.approx(BOUND_UM)


def test_what_is_no_number_never_reaches_the_machine(campaign: Campaign) -> None:
    assert campaign.no_numbers == [False, False, False]
    for trace in (campaign.first, campaign.second):
        assert np.all(np.isfinite(trace.request))
        assert np.all(np.isfinite(trace.drive))


def test_switching_off_and_on_moves_no_joint_and_takes_no_offset(campaign: Campaign) -> None:
    for shown in campaign.switched.values():
        assert shown["joints"] == pytest.approx([5.0, -60.0, -60.0], abs=1e-9)
    trace = campaign.first
    ends = np.flatnonzero(np.abs(trace.commanded + 60.0) < 1e-6)
    assert np.max(np.abs(np.diff(trace.drive[ends[0] : ends[-1] + 1]))) <= 1.001e-5


def test_a_joint_that_loses_its_reference_loses_its_offset(campaign: Campaign) -> None:
    assert "Not homed: joint 2" in campaign.unhomed
    assert campaign.rehomed is not None


def frozen(campaign: Campaign) -> tuple[OffsetTrace, int, int]:
    """Return the first trace, the last heartbeat before the freeze, and the trip behind it."""
    trace = campaign.first
    beats = np.flatnonzero(np.diff(trace.heartbeat.astype(int))) + 1
    trips = np.flatnonzero(np.diff(trace.ok.astype(int)) < 0) + 1
    trip = trips[np.searchsorted(trace.clock_s[trips], campaign.stopped_s)]
    return trace, int(beats[np.searchsorted(beats, trip) - 1]), int(trip)


def test_a_frozen_writer_trips_the_watchdog_after_two_seconds(campaign: Campaign) -> None:
    trace, beat, trip = frozen(campaign)
    assert trace.clock_s[beat] <= campaign.stopped_s + 0.1
    assert campaign.continued_s > trace.clock_s[trip]
    assert (trip - beat) * PERIOD_S == pytest.approx(2.0, abs=0.005)


def test_then_the_offset_goes_to_zero_at_the_rate_and_no_slower(campaign: Campaign) -> None:
    trace, _, trip = frozen(campaign)
    at_zero = trip + int(np.flatnonzero(trace.offset[trip:] == 0.0)[0])
    assert trace.clock_s[at_zero] < campaign.continued_s
    lasted_s = (at_zero - trip) * PERIOD_S
    least_s = GOAL_UM / RATE_UM_PER_S
    assert least_s - 0.002 <= lasted_s <= least_s + 0.1  # the acceleration costs 0.04 s twice
    assert np.all(np.diff(trace.offset[trip : at_zero + 1]) <= 0.0)


def test_it_stays_latched_until_found_was_read_and_the_watchdog_is_armed_again(
    campaign: Campaign,
) -> None:
    trace, _, trip = frozen(campaign)
    tripped = [
        line for line in campaign.lines if campaign.continued_s < line["time_s"] < campaign.heeded_s
    ]
    assert len(tripped) >= TRIED  # it wrote and wrote
    assert not any(line["written"] for line in tripped)
    assert all("watchdog" in line["error"] for line in tripped)
    rises = np.flatnonzero(np.diff(trace.ok.astype(int)) > 0) + 1
    rise = rises[np.searchsorted(rises, trip)]
    assert trace.clock_s[rise] > campaign.heeded_s
    at_zero = trip + int(np.flatnonzero(trace.offset[trip:] == 0.0)[0])
    assert np.all(trace.offset[at_zero:rise] == 0.0)
    # an edge, not a level: the bit was taken away and given again
    edges = np.flatnonzero(np.diff(trace.armed.astype(int)) > 0) + 1
    assert 0 <= rise - edges[np.searchsorted(edges, rise, side="right") - 1] <= 2
    later = [line["found"] for line in campaign.lines if line["time_s"] > campaign.heeded_s]
    assert next(found for found in later if found is not None) == both(0.0)


def test_a_linuxcnc_that_starts_again_is_found_at_zero_and_written_to_again(
    campaign: Campaign,
) -> None:
    lines = [line for line in campaign.lines if line["time_s"] > campaign.ended_s]
    lost = next(line for line in lines if not line["connected"])
    assert in_time(lost["time_s"] - campaign.ended_s, 2.0)
    news = next(line for line in lines if line["found"] is not None)
    assert news["found"] == both(0.0)
    between = [line for line in lines if lost["time_s"] < line["time_s"] < news["time_s"]]
    assert not any(line["written"] for line in between)
    assert news["written"]
    assert campaign.second.offset[0] == 0.0


def test_a_killed_writer_leaves_no_halcmd_and_no_offset(campaign: Campaign) -> None:
    assert campaign.halcmds == (1, 0)
    trace = campaign.second
    trip = int(np.flatnonzero(np.diff(trace.ok.astype(int)) < 0)[-1])
    tripped_s = trace.clock_s[trip] - campaign.killed_s
    assert tripped_s >= 1.7
    assert in_time(tripped_s - 2.0, 0.3)
    assert trace.offset[-1] == 0.0


def test_a_cycle_of_the_sink_costs_little(campaign: Campaign) -> None:
    steady = [line for line in campaign.lines if line["time_s"] < campaign.stopped_s]
    each = np.diff([line["cpu_s"] for line in steady])
    print(f"a cycle of the sink: {1e3 * np.median(each):.2f} ms of CPU")
    assert np.median(each) < 0.010  # of the 0.1 s of a cycle; measured: 0.002


# ---- the contract of every sink ------------------------------------------------------------------


class RealRig(SinkRig):
    """A LinuxCNC that stays; what was written is read by another halcmd."""

    clock: Clock = SystemClock()
    deadline_s = DEADLINE_S
    names = tuple(SETTINGS.outputs)
    resolution_um = 1e-4
    removable = False

    def __init__(self) -> None:
        self.sink = LinuxCncSink(SETTINGS, self.clock)

    def read(self, verb: str, name: str) -> str:
        command = ["/usr/bin/halcmd", verb, name]
        return subprocess.run(command, check=True, capture_output=True, text=True).stdout.strip()

    def offsets_um(self) -> dict[str, float]:
        sign = {"Z_um": 1e3, "X_um": -1e3}
        return {
            name: sign[name] * float(self.read("gets", f"thermaxis-request-{output.joint}"))
            for name, output in SETTINGS.outputs.items()
        }

    def heartbeat(self) -> float:
        return float(self.read("gets", "thermaxis-heartbeat") == "TRUE")


@contextmanager
def on(machine_hal: str, thermal_hal: str) -> Iterator[OffsetMachine]:
    reason = missing()
    if reason:
        pytest.fail(reason, pytrace=False)
    with one_at_a_time(), running(thermal_hal, machine_hal=machine_hal) as machine:
        yield machine


def test_the_sink_keeps_its_contract_on_a_real_machine() -> None:
    with on(main_hal(), hal_text(SETTINGS)) as machine:
        machine.order("home")
        asyncio.run(check_sink(RealRig()))


# ---- machines that are arranged otherwise -------------------------------------------------------


def test_a_machine_whose_hal_file_is_arranged_otherwise_is_not_written_to() -> None:
    wider = LinuxCncSettings(
        outputs={
            "Z_um": LinuxCncOutput(2, "mm", AWAY, Limits(2.0 * BOUND_UM, RATE_UM_PER_S)),
            "X_um": LinuxCncOutput(0, "mm", TOWARDS, Limits(BOUND_UM, RATE_UM_PER_S)),
        }
    )

    async def look(machine: OffsetMachine) -> str:
        await order(machine, "home")
        await order(machine, "move", text="G0 Y-60 Z-60")
        sink = LinuxCncSink(SETTINGS, SystemClock())
        await sink.open()
        await asyncio.sleep(1.0)
        assert not sink.connected
        assert await sink.found(DEADLINE_S) is None
        await sink.close()
        return said_by(sink)

    last = hal_text(wider).replace("servo-thread -3", "servo-thread")
    with on(main_hal(too_late=True), last) as machine:
        said = asyncio.run(look(machine))
        trace = machine.trace()
    assert "thermaxis-shift-0.update-feedback must run before" in said
    assert "thermaxis-limit-2.min is −0.08, not within −0.04" in said
    assert not np.any(trace.armed)
    # why: what runs before sees the position of the period before, and so does the controller
    assert np.max(np.abs(trace.drive - trace.commanded)) > 0.3
    assert np.max(np.abs(trace.following_error - trace.following_error_1)) > 0.3


def test_linuxcnc_does_not_start_while_a_joint_has_its_own_pins() -> None:
    with (
        pytest.raises(RuntimeError, match=r"joint\.2\.motor-pos-cmd.*already"),
        on(main_hal(shifted=(0,)), hal_text(SETTINGS)),
    ):
        pass
