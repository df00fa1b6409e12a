"""The LinuxCNC sink beside a HAL in memory: nothing unproven is written, nothing latches unseen.

The HAL is made from the very text that is written for the machine, by a reader of its own.
"""

import asyncio
import math
import re
import tomllib
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from itertools import pairwise
from pathlib import Path

import pytest
from hypothesis import given, settings, strategies as st

from tests.refusals import said_by
from tests.unit.runtime.linuxcnc_hal import PERIOD_S, MemoryHal
from tests.unit.runtime.simulated import freeze
from thermaxis.codes import Message, Place
from thermaxis.compensation import Limits
from thermaxis.errors import ConfigurationError
from thermaxis.runtime import AWAY, TOWARDS, VirtualClock, run_in_virtual_time
from thermaxis.runtime._halcmd import (
    HalLostError,
    HalPipe,
    HalRefusedError,
    bit_of,
    confirm_silence,
    number_of,
    open_pipe,
    running_instance,
)
from thermaxis.runtime.sinks import LinuxCncOutput, LinuxCncSettings, LinuxCncSink, hal_text

BOUND_UM, RATE_UM_PER_S = 100.0, 10.0
LIMITS = Limits(BOUND_UM, RATE_UM_PER_S)
Z = LinuxCncOutput(2, "mm", AWAY, LIMITS)
X = LinuxCncOutput(0, "inch", TOWARDS, LIMITS)
SETTINGS = LinuxCncSettings(outputs={"Z_um": Z, "X_um": X})
DEADLINE_S = 0.5
VIRTUAL_TIME = True
HEARTBEAT, ARM = "thermaxis-heartbeat", "thermaxis-arm"


@pytest.fixture
def hal() -> MemoryHal:
    return MemoryHal(hal_text(SETTINGS))


@asynccontextmanager
async def beside(hal: MemoryHal) -> AsyncIterator[LinuxCncSink]:
    """Open a sink beside a HAL, and close it."""
    sink = LinuxCncSink(SETTINGS, VirtualClock(), hal.attach)
    await sink.open()
    try:
        await asyncio.sleep(0.2)
        yield sink
    finally:
        await sink.close()


async def write_for(
    sink: LinuxCncSink, duration_s: float, z_um: float, x_um: float = 0.0
) -> list[bool]:
    """Write ten times a second, as a loop does; return what was accepted."""
    written: list[bool] = []
    for _ in range(round(10.0 * duration_s)):
        await sink.found(DEADLINE_S)
        written.append(await sink.write({"Z_um": z_um, "X_um": x_um}, DEADLINE_S))
        await asyncio.sleep(0.1)
    return written


def why(sink: LinuxCncSink) -> str:
    """Return the code of the last failure; empty where all is well."""
    return "" if sink.failure is None else sink.failure.code.removeprefix("error-")


def edges(hal: MemoryHal, signal: str) -> int:
    """Return how often a signal was set from false to true."""
    values = [0.0, *(value for _, name, value in hal.sets if name == signal)]
    return sum(b > a for a, b in pairwise(values))


# ---- the way of an offset -----------------------------------------------------------------------


def code_of(sink: LinuxCncSink) -> str:
    return "" if sink.failure is None else sink.failure.code


async def test_nothing_is_written_before_found_was_read(hal: MemoryHal) -> None:
    async with beside(hal) as sink:
        assert sink.connected
        assert not await sink.write({"Z_um": 5.0, "X_um": 0.0}, DEADLINE_S)
        assert hal.sets == []
        assert await sink.found(DEADLINE_S) == {"Z_um": 0.0, "X_um": 0.0}
        assert await sink.found(DEADLINE_S) is None
        assert hal.sets == []
        assert await sink.write({"Z_um": 5.0, "X_um": 0.0}, DEADLINE_S)
    assert edges(hal, ARM) == 1


async def test_requested_accepted_and_effective_are_three_numbers(hal: MemoryHal) -> None:
    async with beside(hal) as sink:
        assert (await sink.read_back(DEADLINE_S))["Z_um"] == (None, 0.0, 0.0)
        await write_for(sink, 1.0, 30.0)
        z = (await sink.read_back(DEADLINE_S))["Z_um"]
        assert z.requested_um == 30.0
        assert z.accepted_um == pytest.approx(30.0, rel=1e-6)
        assert z.effective_um == pytest.approx(RATE_UM_PER_S * 1.0, abs=0.2)
        await write_for(sink, 3.0, 30.0)
        z = (await sink.read_back(DEADLINE_S))["Z_um"]
        assert z.effective_um == pytest.approx(30.0, rel=1e-6)


@settings(max_examples=20)
@given(
    z_um=st.floats(-BOUND_UM, BOUND_UM),
    x_um=st.floats(-BOUND_UM, BOUND_UM),
)
def test_sign_and_unit_of_each_joint_are_those_of_its_sentence(z_um: float, x_um: float) -> None:
    hal = MemoryHal(hal_text(SETTINGS))

    async def life() -> None:
        async with beside(hal) as sink:
            await write_for(sink, 0.2, z_um, x_um)
            back = await sink.read_back(DEADLINE_S)
            assert back["Z_um"].accepted_um == pytest.approx(z_um, rel=1e-6, abs=1e-9)
            assert back["X_um"].accepted_um == pytest.approx(x_um, rel=1e-6, abs=1e-9)

    run_in_virtual_time(life())
    assert hal.pin("thermaxis-limit-2.in") == pytest.approx(z_um / 1000.0, rel=1e-12)
    assert hal.pin("thermaxis-limit-0.in") == pytest.approx(-x_um / 25400.0, rel=1e-12)


async def test_the_drive_is_shifted_and_the_controller_does_not_see_it(hal: MemoryHal) -> None:
    hal.put("joint.2.motor-pos-cmd", -10.0)

    async with beside(hal) as sink:
        await write_for(sink, 4.0, 30.0)
    assert hal.pin("thermaxis-shift-2.out") == pytest.approx(-10.0 + 0.030, abs=1e-12)
    assert hal.pin("joint.2.motor-pos-fb") == pytest.approx(-10.0, abs=1e-12)


async def test_every_write_moves_the_heartbeat_once(hal: MemoryHal) -> None:
    async with beside(hal) as sink:
        assert all(await write_for(sink, 2.0, 1.0))
    beats = [value for _, name, value in hal.sets if name == HEARTBEAT]
    assert len(beats) == 20
    assert all(a != b for a, b in pairwise(beats))


async def test_what_is_no_number_stops_the_heartbeat_and_the_machine_takes_the_offset_back(
    hal: MemoryHal,
) -> None:
    async with beside(hal) as sink:
        await write_for(sink, 2.0, 10.0)
        before = list(hal.sets)
        nothing = [{"X_um": 0.0, "Z_um": value} for value in (math.nan, math.inf, -math.inf)]
        for wanted in ({"X_um": 0.0}, *nothing):
            for _ in range(10):
                assert not await sink.write(wanted, DEADLINE_S)
                assert why(sink) == "no_finite_correction", wanted
                await asyncio.sleep(0.1)
        assert hal.sets == before
        assert (await sink.read_back(DEADLINE_S))["Z_um"] == (10.0, 0.0, 0.0)


# ---- the watchdog -------------------------------------------------------------------------------


async def test_a_writer_that_pauses_finds_the_offset_on_its_way_and_arms_once_more(
    hal: MemoryHal,
) -> None:
    async with beside(hal) as sink:
        await write_for(sink, 6.0, 50.0)
        await asyncio.sleep(4.0)
        for _ in range(10):  # it stays tripped however often a write is tried
            assert not await sink.write({"Z_um": 50.0, "X_um": 0.0}, DEADLINE_S)
        assert code_of(sink) == "error-watchdog_tripped"
        back = (await sink.read_back(DEADLINE_S))["Z_um"]
        assert back.accepted_um == 0.0
        found = await sink.found(DEADLINE_S)
        assert found is not None
        assert found["Z_um"] == back.effective_um
        # two seconds of patience, then the rate: 4.1 s after the last write
        assert found["Z_um"] == pytest.approx(50.0 - RATE_UM_PER_S * 2.1, abs=0.2)
        assert edges(hal, ARM) == 1
        assert await sink.write({"Z_um": found["Z_um"] or 0.0, "X_um": 0.0}, DEADLINE_S)
        assert sink.failure is None
    assert edges(hal, ARM) == 2


async def test_the_request_stands_before_the_watchdog_is_armed(hal: MemoryHal) -> None:
    async with beside(hal) as sink:
        await write_for(sink, 6.0, 50.0)
        await asyncio.sleep(10.0)
        await sink.write({"Z_um": 50.0, "X_um": 0.0}, DEADLINE_S)
        assert hal.pin("thermaxis-shift-2.offset") == 0.0
        assert (await sink.found(DEADLINE_S)) == {"Z_um": 0.0, "X_um": 0.0}
        await sink.write({"Z_um": 0.5, "X_um": 0.0}, DEADLINE_S)
    names = [name for _, name, _ in hal.sets]
    last_edge = max(i for i, (_, name, value) in enumerate(hal.sets) if name == ARM and value)
    request = max(i for i, name in enumerate(names) if name == "thermaxis-request-2")
    assert request < last_edge
    assert hal.sets[request][2] == pytest.approx(0.0005)


def test_a_successor_in_time_goes_on_without_an_edge_and_a_late_one_needs_it() -> None:
    for pause_s, wanted in ((1.0, 1), (5.0, 2)):
        hal = MemoryHal(hal_text(SETTINGS))

        async def act(sink: LinuxCncSink) -> None:
            assert all(await write_for(sink, 1.0, 5.0))

        async def lives(hal: MemoryHal = hal, pause_s: float = pause_s) -> None:
            for _ in range(2):
                sink = LinuxCncSink(SETTINGS, VirtualClock(), hal.attach)
                await sink.open()
                await asyncio.sleep(0.1)
                await act(sink)
                await sink.close()
                await asyncio.sleep(pause_s)

        run_in_virtual_time(lives())
        assert edges(hal, ARM) == wanted


async def test_a_watchdog_that_does_not_start_is_no_accepted_write(hal: MemoryHal) -> None:
    async with beside(hal) as sink:
        hal.behaviour["watchdog.process"] = lambda: None
        assert not any(await write_for(sink, 1.0, 10.0))
        assert code_of(sink) == "error-watchdog_not_started"


@pytest.mark.parametrize(
    "frozen_in", ["gets thermaxis-ok", "gets thermaxis-request-0", "gets thermaxis-arm"]
)
async def test_what_a_frozen_program_comes_back_to_is_not_written_late(
    hal: MemoryHal, frozen_in: str
) -> None:
    async with beside(hal) as sink:
        await sink.found(DEADLINE_S)
        hal.freezes[frozen_in] = 5.0
        assert not await sink.write({"Z_um": 10.0, "X_um": 0.0}, DEADLINE_S)
        assert hal.freezes == {}
        assert code_of(sink) == "error-hal_too_slow"
        assert hal.pin(ARM) == 0.0
        assert hal.pin("thermaxis-shift-2.offset") == 0.0


# ---- a machine that is not there, goes, or is not as it must be ---------------------------------


async def test_a_machine_that_is_not_there_is_waited_for(hal: MemoryHal) -> None:
    hal.running = False

    async with beside(hal) as sink:
        assert not sink.connected
        assert code_of(sink) == "error-linuxcnc_not_running"
        assert await sink.found(DEADLINE_S) is None
        assert not await sink.write({"Z_um": 1.0, "X_um": 0.0}, DEADLINE_S)
        assert await sink.read_back(DEADLINE_S) == {"Z_um": (None, None, None), "X_um": (None,) * 3}
        hal.running = True
        await asyncio.sleep(SETTINGS.retry_s + 0.1)
        assert sink.connected
        assert await sink.found(DEADLINE_S) is not None


async def test_after_each_return_of_the_machine_found_is_news_once(hal: MemoryHal) -> None:
    async with beside(hal) as sink:
        for _ in range(3):
            assert all(await write_for(sink, 0.5, 1.0))
            hal.running = False
            assert not await sink.write({"Z_um": 1.0, "X_um": 0.0}, DEADLINE_S)
            assert not sink.connected
            back = await sink.read_back(DEADLINE_S)
            assert back["Z_um"] == (1.0, None, None)
            hal.running = True
            await asyncio.sleep(1.0)
            assert sink.connected
            before = len(hal.sets)
            assert not await sink.write({"Z_um": 1.0, "X_um": 0.0}, DEADLINE_S)
            assert len(hal.sets) == before
            assert await sink.found(DEADLINE_S) is not None
            assert await sink.found(DEADLINE_S) is None


async def test_a_machine_that_does_not_answer_costs_no_more_than_the_deadline(
    hal: MemoryHal,
) -> None:
    async with beside(hal) as sink:
        loop = asyncio.get_running_loop()
        await write_for(sink, 0.5, 1.0)
        hal.answers = False
        for call in (
            lambda: sink.write({"Z_um": 1.0, "X_um": 0.0}, DEADLINE_S),
            lambda: sink.read_back(DEADLINE_S),
            lambda: sink.found(DEADLINE_S),
        ):
            begin_s = loop.time()
            await call()
            assert loop.time() - begin_s <= DEADLINE_S + 1e-9
        assert not sink.connected
        hal.answers = True
        await asyncio.sleep(3.0)
        assert sink.connected


async def test_a_servo_thread_that_stands_still_is_a_lost_connection(hal: MemoryHal) -> None:
    async with beside(hal) as sink:
        await write_for(sink, 0.5, 1.0)
        hal.thread_runs = False
        assert not (await write_for(sink, 1.0, 2.0))[-1]
        assert not sink.connected
        assert code_of(sink) == "error-servo_thread_stands_still"
        await asyncio.sleep(5.0)
        assert not sink.connected
        hal.thread_runs = True
        await asyncio.sleep(2.0)
        assert sink.connected


async def test_the_period_counter_may_begin_again(hal: MemoryHal) -> None:
    hal.put("thermaxis-count.count", 2.0**32 - 100.0)

    async with beside(hal) as sink:
        assert all(await write_for(sink, 1.0, 1.0))
        assert hal.pin("thermaxis-count.count") < 400.0


async def test_a_joint_that_is_not_homed_takes_no_offset(hal: MemoryHal) -> None:
    hal.values["joint.2.homed"] = 0.0

    async with beside(hal) as sink:
        assert not sink.connected
        assert sink.failure == Message(
            "error-joint_not_homed", {"joints": ("2",)}, Place("LinuxCNC")
        )
        assert not await sink.write({"Z_um": 1.0, "X_um": 0.0}, DEADLINE_S)
        hal.values["joint.2.homed"] = 1.0
        await asyncio.sleep(0.6)
        assert sink.connected
        assert sink.failure is None
        assert all(await write_for(sink, 3.0, 20.0))
        hal.values["joint.2.homed"] = 0.0
        before = len(hal.sets)
        assert not any(await write_for(sink, 5.0, 20.0))
        assert len(hal.sets) == before
        assert hal.pin("thermaxis-shift-2.offset") == 0.0
        hal.values["joint.2.homed"] = 1.0
        await asyncio.sleep(0.6)
        assert not await sink.write({"Z_um": 1.0, "X_um": 0.0}, DEADLINE_S)
        assert await sink.found(DEADLINE_S) == {"Z_um": 0.0, "X_um": 0.0}


WRONG = {
    "a wider clamp": (r"(limit-2\.max) 0\.1", r"\1 0.11", "limit-2.max is 0.11"),
    "no clamp": (r"setp \S+limit-2\.min .*\n", "", "limit-2.min is −1e+20"),
    "an inverted clamp": (r"(limit-2\.max) 0\.1", r"\1 -0.1", "limit-2.max is −0.1"),
    "a faster rate": (r"(limit-2\.maxv) .*", r"\1 1.0", "limit-2.maxv is 1"),
    "no rate": (r"setp \S+limit-2\.maxv .*\n", "", "limit-2.maxv is 1e+20"),
    "no timeout": (r"setp watchdog.timeout-0 .*\n", "", "time is 0 s, too short"),
    "a long timeout": (r"(watchdog.timeout-0) .*", r"\1 60", "time is 60 s, more than 2 s"),
    "no watchdog in the thread": (r"addf watchdog.process.*\n", "", "not run watchdog.process"),
    "no limit in the thread": (r"addf thermaxis-limit-2 .*\n", "", "not run thermaxis-limit-2"),
    "feedback behind the controller": (r"servo-thread -3", "servo-thread", "must run before"),
    "a clamp before the controller": (
        r"(addf thermaxis-limit-2 servo-thread)",
        r"\1 1",
        "must run after motion-controller",
    ),
    "the watchdog behind the limit": (
        r"addf watchdog.process servo-thread\n([\s\S]*update-output servo-thread\n)",
        r"\1addf watchdog.process servo-thread\n",
        "order in servo-thread",
    ),
    "a limit that nothing disables": (r" thermaxis-limit-2\.enable", "", "Not connected"),
    "an offset without its limit": (r"net thermaxis-offset-2.*\n", "", "shift-2.offset"),
    "another signal for the request": (
        r"net thermaxis-request-2 =>",
        "net other =>",
        "signal thermaxis-request-2",
    ),
    "a jump": (r"(loadrt watchdog)", r"\1", "load is used"),
    "a jump by a signal": (r"(loadrt watchdog)", r"\1", "load is used"),
    "no drive": (r"", "", "shift-2.out leads nowhere"),
    "a pin that is not there": (r"", "", "thermaxis-count.count"),
    "a pin of a joint that is not there": (r"", "", "joint.2.homed"),
}


async def test_a_machine_that_is_arranged_otherwise_is_not_written_to() -> None:
    text = hal_text(SETTINGS)

    for name, (pattern, other, fault) in WRONG.items():
        changed = re.sub(pattern, other, text)
        hal = MemoryHal(changed)
        if name == "a jump":
            hal.values["thermaxis-limit-2.load"] = 1.0
        elif name == "a jump by a signal":
            hal.signal_of["thermaxis-limit-2.load"] = "thermaxis-ok"
        elif name == "no drive":
            del hal.signal_of["thermaxis-shift-2.out"], hal.signal_of["thermaxis-shift-2.fb-in"]
        elif name.startswith("a pin"):
            hal.hidden.add(fault)
        else:
            assert changed != text
        async with beside(hal) as sink:
            assert not any(await write_for(sink, 1.0, 1.0)), name
            assert not sink.connected
            assert fault in said_by(sink), name
            assert hal.sets == []


async def test_a_set_that_is_not_confirmed_is_no_accepted_write(hal: MemoryHal) -> None:

    def other_value(command: str) -> None:
        if command == "gets thermaxis-request-2" and hal.sets:
            hal.values["thermaxis-request-2"] = 0.001

    async with beside(hal) as sink:
        await sink.found(DEADLINE_S)
        hal.before_answer = other_value
        assert not await sink.write({"Z_um": 5.0, "X_um": 0.0}, DEADLINE_S)
        assert code_of(sink) == "error-hal_value_differs"
        assert edges(hal, HEARTBEAT) == edges(hal, ARM) == 0


@pytest.mark.parametrize("signal", [HEARTBEAT, ARM])
async def test_a_bit_that_is_not_confirmed_is_no_accepted_write(
    hal: MemoryHal, signal: str
) -> None:

    def other_value(command: str) -> None:
        if command == f"gets {signal}":
            hal.values[signal] = 1.0 - hal.values[signal]

    async with beside(hal) as sink:
        await sink.found(DEADLINE_S)
        hal.before_answer = other_value
        assert not await sink.write({"Z_um": 5.0, "X_um": 0.0}, DEADLINE_S)
        assert code_of(sink) == "error-hal_bit_differs"
        assert sink.failure is not None
        assert sink.failure.place.channel == signal


async def test_a_refused_set_is_no_accepted_write_though_the_value_stands_there_already(
    hal: MemoryHal,
) -> None:
    async with beside(hal) as sink:
        await sink.found(DEADLINE_S)
        hal.source_of["thermaxis-request-2"] = "another.out"
        assert not await sink.write({"Z_um": 0.0, "X_um": 0.0}, DEADLINE_S)
        assert code_of(sink) == "error-hal_answers"


EVENTS = st.one_of(
    st.tuples(st.just("write"), st.floats(allow_nan=True, allow_infinity=True)),
    st.tuples(st.just("write"), st.floats(-BOUND_UM, BOUND_UM)),
    st.tuples(st.just("pause"), st.floats(0.0, 6.0)),
    st.tuples(st.just("freeze"), st.floats(0.0, 6.0)),
    st.tuples(st.sampled_from(("gone", "unhomed", "still", "mute")), st.floats(0.0, 2.0)),
    st.tuples(st.sampled_from(("found", "foreign", "read")), st.just(0.0)),
)


@settings(max_examples=20)
@given(st.lists(EVENTS, max_size=25))
def test_whatever_happens_the_bounds_hold_and_arming_follows_found(
    events: list[tuple[str, float]],
) -> None:
    hal = MemoryHal(hal_text(SETTINGS))
    offsets = [0.0]
    update = hal.behaviour["thermaxis-shift-2.update-output"]
    told = [0]

    def record() -> None:
        update()
        offsets.append(hal.pin("thermaxis-shift-2.offset"))

    hal.behaviour["thermaxis-shift-2.update-output"] = record

    async def happen(sink: LinuxCncSink, what: str, value: float) -> None:
        if what == "write":
            written = await sink.write({"Z_um": value, "X_um": 0.0}, DEADLINE_S)
            assert not written or math.isfinite(value)
        elif what == "found":
            told[0] += await sink.found(DEADLINE_S) is not None
        elif what == "read":
            assert (await sink.read_back(DEADLINE_S)).keys() == {"Z_um", "X_um"}
        elif what == "foreign":
            hal.values["thermaxis-request-2"] = 0.07
        elif what == "freeze":
            freeze(value)
        else:
            flags = {"gone": "running", "still": "thread_runs", "mute": "answers"}
            hal.values["joint.2.homed"] = float(what != "unhomed")
            if what in flags:
                setattr(hal, flags[what], False)
            await asyncio.sleep(value)
            hal.values["joint.2.homed"] = 1.0
            hal.running = hal.thread_runs = hal.answers = True
        assert edges(hal, ARM) <= told[0]

    async def life() -> None:
        async with beside(hal) as sink:
            for what, value in [("found", 0.0), ("write", 40.0), *events]:
                await happen(sink, what, value)
                await asyncio.sleep(0.05)

    run_in_virtual_time(life())
    assert all(math.isfinite(value) for _, _, value in hal.sets)
    step = max(abs(b - a) for a, b in pairwise(offsets))
    assert step <= 1.000001e-3 * RATE_UM_PER_S * PERIOD_S
    assert max(map(abs, offsets)) <= 1.000001e-3 * BOUND_UM


# ---- settings and text --------------------------------------------------------------------------


def test_the_machine_gets_the_limits_of_the_configuration_in_its_unit() -> None:
    text = hal_text(SETTINGS)
    values = dict(re.findall(r"^setp (\S+) (\S+)$", text, re.MULTILINE))
    assert {pin: float(value) for pin, value in values.items()} == {
        "watchdog.timeout-0": 2.0,
        "thermaxis-limit-2.min": pytest.approx(-0.1),
        "thermaxis-limit-2.max": pytest.approx(0.1),
        "thermaxis-limit-2.maxv": pytest.approx(0.01),
        "thermaxis-limit-2.maxa": pytest.approx(0.25),
        "thermaxis-limit-0.min": pytest.approx(-0.1 / 25.4),
        "thermaxis-limit-0.max": pytest.approx(0.1 / 25.4),
        "thermaxis-limit-0.maxv": pytest.approx(0.01 / 25.4),
        "thermaxis-limit-0.maxa": pytest.approx(0.25 / 25.4),
    }


def test_no_name_breaks_out_of_its_comment() -> None:
    settings = LinuxCncSettings(outputs={"Z\nloadrt x\r#um": Z})
    text = hal_text(settings, "a\nb.hal")
    assert text.isascii()
    verbs = {line.split()[0] for line in text.splitlines() if line and not line.startswith("#")}
    assert verbs == {"loadrt", "addf", "setp", "net"}
    assert not re.search(r"^loadrt x", text, re.MULTILINE)


def test_the_watchdog_lets_one_late_write_pass() -> None:
    for cycle_s, wanted in ((0.1, 2.0), (10.0, 20.0)):
        settings = LinuxCncSettings(outputs={"Z_um": Z}, cycle_s=cycle_s)
        assert settings.watchdog_s == wanted
        assert f"setp watchdog.timeout-0 {wanted}" in hal_text(settings)


def test_settings_that_cannot_be_are_refused() -> None:
    def settings(**changes: object) -> Callable[[], object]:
        return lambda: LinuxCncSettings(**{"outputs": {"Z_um": Z}, **changes})

    def output(*given: object) -> Callable[[], object]:
        return lambda: LinuxCncOutput(*given)

    for make, where in (
        *((output(joint, "mm", AWAY, LIMITS), "joint") for joint in (-1, 16)),
        (output(2, "um", AWAY, LIMITS), "unit"),
        (output(2, "mm", "up", LIMITS), "sign"),
        *((output(2, "mm", AWAY, LIMITS, a), "acceleration") for a in (-1.0, math.inf, math.nan)),
        (settings(outputs={}), "output"),
        (settings(outputs={"Z_um": Z, "X_um": Z}), "output"),
        (settings(cycle_s=100.0), "cycle_s"),
        *((settings(watchdog_s=time_s), "watchdog_s") for time_s in (1.0, 1000.0, math.nan)),
        (settings(retry_s=0.0), "retry_s"),
        (settings(thread="a\nb"), "thread"),
    ):
        with pytest.raises(ConfigurationError) as caught:
            make()
        place = caught.value.place
        assert where in f"{place.key} {place.channel}"


# ---- the pipe -----------------------------------------------------------------------------------


class Commands:
    """What a program would read; for each batch it may answer."""

    def __init__(self, answers: asyncio.StreamReader, answer: Callable[[str], str]) -> None:
        self.answers, self.answer = answers, answer
        self.sizes: list[int] = []
        self.line = 0
        self.silent = self.ends = self.closed = False

    def write(self, batch: bytes) -> None:
        self.sizes.append(len(batch))
        if self.ends:
            self.answers.feed_eof()
        if self.silent or self.ends:
            return
        for command in batch.decode("ascii").splitlines():
            self.line += 1
            if command.startswith("print "):
                text = f"<stdin>:{self.line}: HALCMD MSG: {command.removeprefix('print ')}\n"
            else:
                text = self.answer(command)
            self.answers.feed_data(text.encode("ascii"))

    async def drain(self) -> None:
        await asyncio.sleep(0)

    def close(self) -> None:
        self.closed = True

    async def wait_closed(self) -> None:
        if self.ends:
            raise BrokenPipeError


@asynccontextmanager
async def piped(answer: Callable[[str], str]) -> AsyncIterator[tuple[HalPipe, Commands]]:
    """Open a pipe whose program answers by a function, and close it."""
    reader = asyncio.StreamReader()
    commands = Commands(reader, answer)
    pipe = HalPipe(commands, reader)
    yield pipe, commands
    await pipe.close()
    assert commands.closed


async def test_lines_of_an_error_shift_no_later_answer() -> None:
    said = {"bad": "<stdin>:1: not found\n<stdin>:1: setp failed\n", "getp a": "1\n", "quiet": ""}

    async with piped(said.__getitem__) as (pipe, _):
        answers = await pipe.ask(["getp a", "bad", "quiet", "getp a"], 1.0)
        assert answers == [
            ("1",),
            ("<stdin>:1: not found", "<stdin>:1: setp failed"),
            (),
            ("1",),
        ]
        assert await pipe.ask(["getp a"], 1.0) == [("1",)]


async def test_many_commands_are_given_in_batches_that_a_pipe_takes_whole() -> None:
    sizes: list[int] = []

    async with piped(lambda command: f"{command}\n") as (pipe, commands):
        asked = [f"show pin thermaxis-shift-15.update-{i:04d}" for i in range(300)]
        assert await pipe.ask(asked, 1.0) == [(command,) for command in asked]
        sizes.extend(commands.sizes)
    assert len(sizes) > 1
    assert max(sizes) <= 4096


async def test_a_pipe_that_was_not_answered_in_time_is_out_of_step_for_good() -> None:
    async with piped(lambda _: "1\n") as (pipe, commands):
        commands.silent = True
        with pytest.raises(HalLostError, match=r"within 0\.5 s"):
            await pipe.ask(["getp a"], 0.5)
        commands.silent = False
        with pytest.raises(HalLostError, match="out of step"):
            await pipe.ask(["getp a"], 0.5)


async def test_a_cancelled_exchange_leaves_the_pipe_out_of_step() -> None:
    async with piped(lambda _: "1\n") as (pipe, commands):
        commands.silent = True
        task = asyncio.create_task(pipe.ask(["getp a"], 5.0))
        await asyncio.sleep(0.1)
        task.cancel()
        with pytest.raises(asyncio.CancelledError):
            await task
        with pytest.raises(HalLostError, match="out of step"):
            await pipe.ask(["getp a"], 0.5)


async def test_a_program_that_ends_is_said_to_have_ended_with_its_last_words() -> None:
    async with piped(lambda _: "1\n") as (pipe, commands):
        commands.answers.feed_data(b"HAL: ERROR: no memory\n")
        commands.ends = True
        with pytest.raises(HalLostError, match="has ended: HAL: ERROR: no memory"):
            await pipe.ask(["getp a"], 0.5)


async def test_two_who_ask_at_once_get_their_own_answers() -> None:
    async with piped(lambda command: f"{command}\n") as (pipe, _):
        asked = [[f"getp {who}{i}" for i in range(20)] for who in "abc"]
        answers = await asyncio.gather(*(pipe.ask(commands, 1.0) for commands in asked))
        assert answers == [[(command,) for command in commands] for commands in asked]


def test_only_one_finite_number_is_a_number_and_only_true_and_false_are_bits() -> None:
    for answer in ((), ("nan",), ("inf",), ("1", "2"), ("TRUE",), ("x not found",)):
        with pytest.raises(HalRefusedError, match="a pin"):
            number_of(answer, "a pin")
    for answer in ((), ("1",), ("true",), ("TRUE", "TRUE")):
        with pytest.raises(HalRefusedError, match="a pin"):
            bit_of(answer, "a pin")
    with pytest.raises(HalRefusedError, match="a pin"):
        confirm_silence(("said",), "a pin")


# ---- the instance -------------------------------------------------------------------------------

HEAD = "       key      shmid perms                  size  cpid  lpid nattch   uid   gid\n"


def test_the_instance_that_runs_is_found_without_asking_it(tmp_path: Path) -> None:
    table = tmp_path / "shm"
    assert running_instance(table) is None
    table.write_text("", encoding="ascii")
    assert running_instance(table) is None
    table.write_text(f"{HEAD}         0    77   600      16  11  12   2  1000  1000\n", "ascii")
    assert running_instance(table) is None
    key = int.from_bytes(b"HAL2", "big")
    row = f"{key}    78   600 1048576  11  12   2  1000  1000\n"
    table.write_text(HEAD + row, encoding="ascii")
    assert running_instance(table) == (78, 1000, 11)


def test_halcmd_is_not_started_without_a_linuxcnc_of_the_same_user(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    table = tmp_path / "shm"
    with pytest.raises(HalLostError, match="not running"):
        run_in_virtual_time(open_pipe("halcmd", table))
    key = int.from_bytes(b"HAL2", "big")
    table.write_text(f"{HEAD}{key} 78 600 1048576 11 12 2 1000 1000\n", encoding="ascii")
    monkeypatch.setattr("os.geteuid", lambda: 1001)
    with pytest.raises(HalLostError, match="as the user who starts LinuxCNC"):
        run_in_virtual_time(open_pipe("halcmd", table))
    monkeypatch.setattr("os.geteuid", lambda: 1000)
    with pytest.raises(HalLostError, match="no program /nowhere/halcmd"):
        run_in_virtual_time(open_pipe("/nowhere/halcmd", table))


# ---- the how-to ---------------------------------------------------------------------------------


def test_the_how_to_shows_the_head_of_the_file_that_its_configuration_makes(root: Path) -> None:
    page = (root / "docs" / "how-to" / "compensate-linuxcnc.md").read_text(encoding="utf-8")
    stated, _ = re.findall(r"^```toml\n(.*?)^```", page, re.MULTILINE | re.DOTALL)
    (shown,) = re.findall(r"^```hal\n(.*?)^```", page, re.MULTILINE | re.DOTALL)
    outputs = {
        name: LinuxCncOutput(
            table["joint"],
            table["unit"],
            table["sign"],
            Limits(table["largest_um"], table["largest_rate_um_per_s"]),
        )
        for name, table in tomllib.loads(stated)["output"].items()
    }
    assert shown.count("\n") > 12
    assert hal_text(LinuxCncSettings(outputs=outputs)).startswith(shown)
