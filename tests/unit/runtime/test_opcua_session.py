"""The OPC UA connection, source and sink against servers in the same program, trap by trap."""

import asyncio
import logging
import math
import random
from collections.abc import Iterator
from datetime import UTC, datetime, timedelta

import pytest
from asyncua import ua
from asyncua.client.client import Client
from asyncua.client.ua_session import UaSession

from tests.opcua_server import NAMESPACE, Cable, Machine, until
from tests.refusals import refused
from thermaxis.runtime import AWAY, TOWARDS, ConnectionSettings, OpcUaSession, SystemClock
from thermaxis.runtime.opcua._failures import within
from thermaxis.runtime.opcua._link import discard
from thermaxis.runtime.sinks import OpcUaOutput, OpcUaSink
from thermaxis.runtime.sinks.opcua import HEARTBEAT
from thermaxis.runtime.sources import NodeSettings, OpcUaSource

NODE = f"nsu={NAMESPACE};s="
DEADLINE_S = 5.0
STATUS = ua.StatusCodes


class Wire:
    """A session on a cable to a machine."""

    def __init__(self, machine: Machine, timeout_s: float = 1.0, retry_s: float = 0.02) -> None:
        self.machine, self.times = machine, {"timeout_s": timeout_s, "retry_s": retry_s}
        self.cable = Cable()
        self.users = 1

    async def open(self) -> None:
        self.cable.plug(self.machine)
        await self.cable.mend()
        url = self.cable.url
        settings = ConnectionSettings(name="machine", url=url, security="none", **self.times)
        self.session = OpcUaSession(settings, SystemClock())
        await self.session.open()
        await until(lambda: self.session.connected)

    async def close(self) -> None:
        for _ in range(self.users):
            await self.session.close()
        await self.cable.cut()

    async def source(self, **nodes: NodeSettings) -> OpcUaSource:
        source = OpcUaSource(self.session, nodes)
        await source.open()
        self.users += 1
        return source

    async def sink(
        self, heartbeat: str | None = NODE + "Beat", **outputs: OpcUaOutput
    ) -> OpcUaSink:
        sink = OpcUaSink(self.session, outputs, heartbeat)
        await sink.open()
        self.users += 1
        return sink


@pytest.fixture
def wire(
    runner: asyncio.Runner, machine: Machine, request: pytest.FixtureRequest
) -> Iterator[Wire]:
    """A session on a cable to a machine; nothing of it may run on."""
    wire = Wire(machine, **getattr(request, "param", {}))
    before = asyncio.all_tasks(runner.get_loop())
    runner.run(wire.open())
    yield wire
    runner.run(wire.close())
    loop = runner.get_loop()
    runner.run(until(lambda: len(asyncio.all_tasks(loop) - before) <= 1))  # who asks


def degrees(name: str, **changes) -> NodeSettings:
    return NodeSettings(node=NODE + name, **{"unit": "degC", **changes})


def why(failed: OpcUaSink | OpcUaSession) -> str:
    """Return the code of the last failure; empty where all is well."""
    return "" if failed.failure is None else failed.failure.code.removeprefix("error-")


def flag(name: str) -> NodeSettings:
    return NodeSettings(node=NODE + name, unit="bool")


def offset(name: str = "Offset", unit: str = "mm", sign: str = AWAY, **nodes: str) -> OpcUaOutput:
    others = {key: NODE + node for key, node in nodes.items()}
    return OpcUaOutput(node=NODE + name, unit=unit, sign=sign, **others)


@pytest.fixture
def requests(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Requests that were sent, one word each."""
    sent: list[str] = []
    for name in ("read", "write"):
        real = getattr(UaSession, name)

        async def counted(self, parameters, real=real, name=name):
            sent.append(name)
            return await real(self, parameters)

        monkeypatch.setattr(UaSession, name, counted)
    return sent


# ---- reading: the traps -------------------------------------------------------------------------


async def test_a_value_is_read_with_status_age_and_time_stamp_and_a_frozen_one_grows_old(
    wire: Wire,
) -> None:
    wire.machine.put("T1", 31.25, age_s=100.0)
    source = await wire.source(a=degrees("T1"))
    sample = (await source.read(DEADLINE_S))["a"]
    assert sample[:3] == (31.25, True, "Good")
    assert sample.age_s == pytest.approx(100.0, abs=0.5)
    assert sample.source_time is not None
    assert sample.source_time.tzinfo is not None
    assert source.connected
    assert not source.ended
    await asyncio.sleep(0.05)
    second = (await source.read(DEADLINE_S))["a"].age_s
    assert 0.04 <= second - sample.age_s <= 2.0


NULL = {"kind": ua.VariantType.Null}
READ = {
    "a failed sensor sends zero": (
        *("T1", 0.0, {"status": STATUS.BadSensorFailure}),
        (None, False, "BadSensorFailure"),
    ),
    "an uncertain value": (
        *("T1", 21.0, {"status": STATUS.UncertainSensorNotAccurate}),
        (21.0, False, "UncertainSensorNotAccurate"),
    ),
    "no communication": (
        *("T1", None, {"status": STATUS.BadNoCommunication, **NULL}),
        (None, False, "BadNoCommunication"),
    ),
    "nothing though it is good": ("T2", None, NULL, (None, False, "BadTypeMismatch")),
    "no number": ("T1", math.nan, {}, (None, True, "Good")),
    "infinity": ("T1", -math.inf, {}, (None, True, "Good")),
    "too large for its unit": ("T1", 1e308, {}, (None, True, "Good")),
    "a text": ("Text", "on", {}, (None, False, "BadTypeMismatch")),
    "a row": ("Row", [1.0, 2.0], {}, (None, False, "BadTypeMismatch")),
    "a truth value as a number": ("Referenced", True, {}, (None, False, "BadTypeMismatch")),
}
"""Node, what stands in it, with which status and type, and what is read of it."""


async def test_whatever_a_server_sends_no_value_is_read_that_is_none(wire: Wire) -> None:
    nodes = {case: degrees(node) for case, (node, *_) in READ.items()}
    nodes["too large for its unit"] = degrees("T1", scale=1e10)
    source = await wire.source(good=degrees("T3", scale=0.1), **nodes)
    for case, (node, value, how, expected) in READ.items():
        wire.machine.reset()
        wire.machine.put(node, value, **how)
        found = await source.read(DEADLINE_S)
        assert found[case][:3] == expected, case
        assert found["good"][:3] == (22.5, True, "Good"), case


async def test_an_unknown_node_does_not_spoil_the_others(wire: Wire) -> None:
    source = await wire.source(
        a=degrees("Nowhere"),
        b=degrees("T1"),
        c=NodeSettings(node="nsu=urn:nobody;s=T1", unit="degC"),
        d=degrees("T2"),
    )
    found = await source.read(DEADLINE_S)
    assert found["a"][:3] == (None, False, "BadNodeIdUnknown")
    assert found["c"][:3] == (None, False, "BadNodeIdUnknown")
    assert (found["b"].value, found["d"].value) == (20.5, 21.5)


async def test_a_missing_or_senseless_time_stamp_is_an_unknown_age_and_never_fresh(
    wire: Wire,
) -> None:
    wire.machine.put("T1", 20.0, stamped=False)
    wire.machine.put("T2", 20.0, age_s=-3600.0)
    beginning = (datetime.now(UTC) - datetime(1601, 1, 1, tzinfo=UTC)) / timedelta(seconds=1)
    wire.machine.put("T3", 200, age_s=beginning)
    source = await wire.source(a=degrees("T1"), b=degrees("T2"), c=degrees("T3"))
    found = await source.read(DEADLINE_S)
    assert [found[name].age_s for name in "abc"] == [None, None, None]
    assert [found[name].source_time for name in "abc"] == [None, None, None]


async def test_truth_values_are_booleans_or_zero_and_one_and_nothing_else(wire: Wire) -> None:
    source = await wire.source(a=flag("Referenced"), b=flag("On"))
    assert [s.value for s in (await source.read(DEADLINE_S)).values()] == [1.0, 1.0]
    wire.machine.put("Referenced", False)
    wire.machine.put("On", 0)
    assert [s.value for s in (await source.read(DEADLINE_S)).values()] == [0.0, 0.0]
    wire.machine.put("On", 2)
    source = await wire.source(text=flag("Text"), two=flag("On"), number=flag("T1"))
    for name, sample in (await source.read(DEADLINE_S)).items():
        assert sample[:3] == (None, False, "BadTypeMismatch"), name


async def test_units_are_converted(wire: Wire) -> None:
    for unit, scale, raw, expected in (
        ("degC", 0.1, 205.0, 20.5),
        ("K", 1.0, 293.15, 20.0),
        ("degF", 0.1, -400.0, -40.0),
        ("mm", 1.0, 1500.0, 1500.0),
        ("inch", 1.0, 10.0, 254.0),
        ("1", 2.0, 3.0, 6.0),
    ):
        wire.machine.put("T1", raw)
        source = await wire.source(a=degrees("T1", unit=unit, scale=scale))
        found = (await source.read(DEADLINE_S))["a"].value
        assert found == pytest.approx(expected, abs=1e-9), unit
        await source.close()


def test_settings_of_a_node_that_cannot_be_are_refused() -> None:
    for changes, code in (
        ({"unit": "C"}, "unknown_choice"),
        ({"scale": 0.0}, "scale_unusable"),
        ({"scale": math.nan}, "scale_unusable"),
        ({"node": "T1"}, "no_node_id"),
    ):
        with refused(code):
            NodeSettings(**{"node": NODE + "T1", "unit": "degC", **changes})


async def test_a_cycle_is_one_read_one_write_and_one_read_back(
    wire: Wire, requests: list[str]
) -> None:
    source = await wire.source(a=degrees("T1"), b=degrees("T2"), c=flag("On"))
    sink = await wire.sink(z=offset(read_back_node="Accepted", effective_node="Effective"))
    assert await sink.found(DEADLINE_S) is not None
    requests.clear()
    for cycle in range(5):
        await source.read(DEADLINE_S)
        await sink.found(DEADLINE_S)
        assert await sink.write({"z": float(cycle)}, DEADLINE_S)
        await sink.read_back(DEADLINE_S)
    assert requests == ["read", "write", "read"] * 5


# ---- two clocks ---------------------------------------------------------------------------------


async def test_ages_do_not_depend_on_how_the_two_clocks_differ(wire: Wire) -> None:
    source = await wire.source(a=degrees("T1"))
    for step_s in (3600.0, 0.0, -7200.0):  # the machine's clock is set while it runs
        wire.machine.clock_ahead_s = step_s
        wire.machine.put("T1", 20.0, age_s=1.0)
        assert (await source.read(DEADLINE_S))["a"].age_s == pytest.approx(1.0, abs=0.5)
        assert wire.session.clock_difference_s == pytest.approx(step_s, abs=0.5)


async def test_a_clock_that_is_told_in_steps_of_a_second_does_not_make_values_young(
    wire: Wire,
) -> None:
    source = await wire.source(a=degrees("T1"))
    wire.machine.put("T1", 20.0, age_s=2.0)
    wire.machine.clock_ahead_s = -0.9  # what it tells now is nine tenths of a second old
    assert (await source.read(DEADLINE_S))["a"].age_s == pytest.approx(2.0, abs=0.5)


async def test_without_the_machines_time_every_age_is_unknown(wire: Wire) -> None:
    wire.machine.tells_time = False
    await wire.cable.cut()
    await until(lambda: not wire.session.connected)
    assert wire.session.clock_difference_s is None
    await wire.cable.mend()
    await until(lambda: wire.session.connected)
    source = await wire.source(a=degrees("T1"))
    sample = (await source.read(DEADLINE_S))["a"]
    assert (sample.value, sample.age_s) == (20.5, None)
    assert wire.session.clock_difference_s is None


# ---- writing: the traps -------------------------------------------------------------------------


async def test_every_type_is_written_exactly_and_in_the_machines_unit(wire: Wire) -> None:
    sink = await wire.sink(
        a=offset("Offset", "mm", TOWARDS),
        b=offset("OffsetFloat", "um", AWAY),
        c=offset("OffsetInt", "0.1 um", AWAY),
    )
    assert await sink.found(DEADLINE_S) == {"a": 0.0, "b": 0.0, "c": 0.0}
    assert await sink.write({"a": 34.5, "b": 12.25, "c": -7.04}, DEADLINE_S)
    value = wire.machine.value
    assert value("Offset") == pytest.approx(-0.0345, abs=1e-15)
    assert value("OffsetFloat") == 12.25
    assert (value("OffsetInt"), type(value("OffsetInt"))) == (-70, int)
    applied = await sink.read_back(DEADLINE_S)
    assert applied["a"].requested_um == 34.5
    assert applied["a"].accepted_um == pytest.approx(34.5, abs=1e-12)
    assert applied["c"] == (-7.04, -7.0, None)


async def test_requested_accepted_and_effective_are_three_numbers(wire: Wire) -> None:
    sink = await wire.sink(
        z=offset(sign=TOWARDS, read_back_node="Accepted", effective_node="Effective")
    )
    wire.machine.put("Accepted", -0.030)
    wire.machine.put("Effective", -0.020)
    assert await sink.found(DEADLINE_S) == {"z": pytest.approx(20.0)}  # what acts now
    assert await sink.write({"z": 40.0}, DEADLINE_S)
    applied = (await sink.read_back(DEADLINE_S))["z"]
    assert applied == (40.0, pytest.approx(30.0), pytest.approx(20.0))
    wire.machine.put("Accepted", 0.0, status=STATUS.BadNoCommunication)
    wire.machine.put("Effective", math.nan)
    assert (await sink.read_back(DEADLINE_S))["z"] == (40.0, None, None)


async def test_what_is_no_number_is_never_sent_and_nothing_lives_then(
    wire: Wire, requests: list[str]
) -> None:
    sink = await wire.sink(z=offset(), y=offset("OffsetFloat"))
    await sink.found(DEADLINE_S)
    requests.clear()
    for number in (math.nan, math.inf, -math.inf):
        assert not await sink.write({"z": 1.0, "y": number}, DEADLINE_S)
        codes = await wire.session.write([(NODE + "Offset", number)], DEADLINE_S)
        assert codes == ["BadOutOfRange"]
    assert "write" not in requests
    assert wire.machine.value("Beat") == 7
    assert why(sink) == "no_finite_correction"


async def test_a_number_that_does_not_fit_the_type_is_not_sent_nor_are_the_others(
    wire: Wire,
) -> None:
    sink = await wire.sink(z=offset(), y=offset("OffsetInt", "0.1 um"))
    await sink.found(DEADLINE_S)
    assert not await sink.write({"z": 1.0, "y": 4000.0}, DEADLINE_S)
    assert sink.refused == {
        "z": "BadRequestCancelledByClient",
        "y": "BadOutOfRange",
        HEARTBEAT: "BadRequestCancelledByClient",
    }
    assert (wire.machine.value("Offset"), wire.machine.value("Beat")) == (0.0, 7)
    codes = await wire.session.write([(NODE + "Text", 1.0), (NODE + "Offset", 2.0)], DEADLINE_S)
    assert codes == ["BadTypeMismatch", "BadRequestCancelledByClient"]


async def test_a_partly_refused_write_says_which_one_and_what_to_do(wire: Wire) -> None:
    sink = await wire.sink(z=offset(), y=offset("ReadOnly"))
    await sink.found(DEADLINE_S)
    assert not await sink.write({"z": 5.0, "y": 6.0}, DEADLINE_S)
    assert set(sink.refused) == {"y"}
    assert sink.refused["y"] in {"BadUserAccessDenied", "BadNotWritable"}
    assert wire.machine.value("Offset") == pytest.approx(0.005)
    applied = await sink.read_back(DEADLINE_S)
    assert (applied["z"].requested_um, applied["y"].requested_um) == (5.0, None)
    assert wire.session.connected  # a refused write is a state to show, no reason to leave
    assert await sink.write({"z": 6.0}, DEADLINE_S)
    assert (sink.refused, why(sink)) == ({}, "")


async def test_the_heartbeat_moves_with_every_write_in_its_nodes_type(wire: Wire) -> None:
    for node, beats in (
        (None, [7, 7]),  # no heartbeat: offsets alone are written
        ("Beat", [8, 9]),
        ("BeatByte", [255, 0]),
        ("BeatBool", [True, False]),
        ("T1", [21.0, 22.0]),
    ):
        sink = await wire.sink(None if node is None else NODE + node, z=offset())
        await sink.found(DEADLINE_S)
        seen = []
        for _ in beats:
            assert await sink.write({"z": 1.0}, DEADLINE_S)  # the same offset again
            seen.append(wire.machine.value(node or "Beat"))
        assert seen == beats, node
        await sink.close()


async def test_whole_units_coarser_than_a_micrometre_are_refused(wire: Wire) -> None:
    for unit in ("mm", "inch"):
        sink = await wire.sink(z=offset("OffsetInt", unit))
        assert await sink.found(DEADLINE_S) is None
        assert why(sink) == "unit_too_coarse", unit
        assert not await sink.write({"z": 1.0}, DEADLINE_S)
        await sink.close()


async def test_an_offset_that_cannot_be_read_is_no_news_and_keeps_everything_unwritten(
    wire: Wire,
) -> None:
    wire.machine.put("OffsetFloat", 0.0, status=STATUS.BadWaitingForInitialData)
    sink = await wire.sink(z=offset(), y=offset("OffsetFloat"))
    for _ in range(3):
        assert await sink.found(DEADLINE_S) is None
        assert not await sink.write({"z": 1.0}, DEADLINE_S)
    assert why(sink) == "offset_of_unreadable"
    wire.machine.put("OffsetFloat", 0.25)
    assert await sink.found(DEADLINE_S) == {"z": 0.0, "y": 250.0}
    assert await sink.write({"z": 1.0}, DEADLINE_S)


async def test_an_unknown_output_and_no_output_are_refused(wire: Wire) -> None:
    sink = await wire.sink(z=offset())
    await sink.found(DEADLINE_S)
    assert not await sink.write({"z": 1.0, "w": 2.0}, DEADLINE_S)
    assert not await sink.write({}, DEADLINE_S)
    assert (wire.machine.value("Offset"), wire.machine.value("Beat")) == (0.0, 7)


async def test_a_write_is_sent_without_status_and_time_which_plcs_refuse(
    wire: Wire, monkeypatch
) -> None:
    sent: list[ua.WriteParameters] = []
    real = UaSession.write

    async def seen(self, parameters):
        sent.append(parameters)
        return await real(self, parameters)

    monkeypatch.setattr(UaSession, "write", seen)
    assert await wire.session.write([(NODE + "Offset", 1.0)], DEADLINE_S) == ["Good"]
    value = sent[0].NodesToWrite[0].Value
    assert (value.StatusCode, value.SourceTimestamp, value.ServerTimestamp) == (None,) * 3


# ---- losing and finding the server --------------------------------------------------------------


@pytest.mark.parametrize("wire", [{"timeout_s": 1.0, "retry_s": 0.5}], indirect=True)
async def test_reading_works_again_soon_after_the_servers_return(wire: Wire) -> None:
    source = await wire.source(a=degrees("T1"))
    await wire.cable.cut()
    await until(lambda: not wire.session.connected)
    assert not (await source.read(DEADLINE_S))["a"].good
    await until(lambda: why(wire.session) == "nothing_listens")
    await wire.cable.mend()
    loop = asyncio.get_running_loop()
    began_s = loop.time()
    while not (await source.read(DEADLINE_S))["a"].good:
        await asyncio.sleep(0.01)
    assert loop.time() - began_s < 1.5  # the second for other work on this computer
    assert why(wire.session) == ""


async def test_a_lost_connection_is_seen_at_once_and_tried_again_for_ever(wire: Wire) -> None:
    assert wire.session.generation == 1
    for generation in range(2, 6):
        await wire.cable.cut()
        assert await until(lambda: not wire.session.connected) < 1.0
        await wire.cable.mend()
        await until(lambda: wire.session.connected)
        assert wire.session.generation == generation


async def test_after_a_return_namespaces_types_and_offsets_are_learned_anew(
    wire: Wire, other
) -> None:
    source = await wire.source(a=degrees("T1"))
    sink = await wire.sink(z=offset())
    assert await sink.found(DEADLINE_S) == {"z": 0.0}
    assert await sink.write({"z": 10.0}, DEADLINE_S)
    await wire.cable.cut()
    assert other.index != wire.machine.index
    other.put("T1", 33.0)
    other.put("Offset", 0.0625)
    wire.cable.plug(other)
    await wire.cable.mend()
    await until(lambda: wire.session.connected)
    assert (await source.read(DEADLINE_S))["a"].value == 33.0
    assert not await sink.write({"z": 11.0}, DEADLINE_S)  # found was not read yet
    assert other.value("Offset") == 0.0625
    assert await sink.found(DEADLINE_S) == {"z": 62.5}
    assert await sink.found(DEADLINE_S) is None
    assert await sink.write({"z": 62.0}, DEADLINE_S)
    assert other.value("Offset") == pytest.approx(0.062, abs=1e-6)  # now a Float
    assert wire.machine.value("Offset") == pytest.approx(0.010)


@pytest.mark.parametrize("wire", [{"timeout_s": 30.0}], indirect=True)
async def test_a_frozen_server_costs_a_cycle_its_deadline_and_no_more(wire: Wire) -> None:
    source = await wire.source(a=degrees("T1"))
    sink = await wire.sink(z=offset())
    await sink.found(DEADLINE_S)
    wire.cable.stop()
    loop = asyncio.get_running_loop()
    began_s = loop.time()
    found = await source.read(0.05)
    assert found["a"][:3] == (None, False, "BadNoCommunication")
    assert not await sink.write({"z": 1.0}, 0.05)
    assert (await sink.read_back(0.05))["z"].accepted_um is None
    assert loop.time() - began_s < 10.0  # a request may take thirty
    await wire.cable.mend()


async def test_a_server_that_stays_frozen_costs_the_connection_which_heals(wire: Wire) -> None:
    source = await wire.source(a=degrees("T1"))
    wire.cable.stop()
    while wire.session.connected:
        assert not (await source.read(0.05))["a"].good
    assert why(wire.session) == "no_answer_in_time"
    await wire.cable.mend()
    await until(lambda: wire.session.connected)
    assert (await source.read(5.0))["a"].good


@pytest.mark.parametrize("wire", [{"timeout_s": 2.0}], indirect=True)
async def test_a_short_pause_costs_values_but_not_the_connection_and_no_old_value_comes(
    wire: Wire,
) -> None:
    source = await wire.source(a=degrees("T1"))
    wire.cable.stop()
    assert not (await source.read(0.05))["a"].good
    wire.machine.put("T1", 99.0)
    await wire.cable.mend()
    await asyncio.sleep(0.05)
    assert (await source.read(DEADLINE_S))["a"].value == 99.0
    assert wire.session.generation == 1


@pytest.mark.parametrize("wire", [{"timeout_s": 2.0}], indirect=True)
async def test_one_write_at_most_is_on_its_way(wire: Wire, requests: list[str]) -> None:
    sink = await wire.sink(z=offset())
    await sink.found(DEADLINE_S)
    requests.clear()
    wire.cable.stop()
    for number in range(5):
        assert not await sink.write({"z": float(number)}, 0.02)
    assert requests == ["write"]
    await wire.cable.mend()
    await until(lambda: wire.machine.value("Beat") == 8)
    await asyncio.sleep(0.02)
    assert wire.machine.value("Offset") == 0.0
    assert await sink.write({"z": 9.0}, DEADLINE_S)


@pytest.fixture
def soon_idle(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("thermaxis.runtime.opcua._session.IDLE_S", 0.05)


@pytest.mark.parametrize("wire", [{"timeout_s": 0.3}], indirect=True)
async def test_a_connection_that_nobody_uses_is_tried_so_that_a_frozen_server_is_found(
    soon_idle: None, wire: Wire
) -> None:
    await asyncio.sleep(0.2)
    assert wire.session.generation == 1
    wire.cable.stop()
    await until(lambda: not wire.session.connected)


async def test_a_server_that_limits_the_nodes_of_a_request_is_not_connected_to_again_and_again(
    wire: Wire, monkeypatch: pytest.MonkeyPatch
) -> None:
    async def refused(self, parameters):
        raise ua.UaStatusCodeError(STATUS.BadTooManyOperations)

    with monkeypatch.context() as patch:
        patch.setattr(UaSession, "read", refused)
        assert await wire.session.read([NODE + "T1"], DEADLINE_S) is None
    assert wire.session.connected
    assert why(wire.session) == "too_many_nodes"


async def test_an_answer_of_another_length_costs_the_connection(
    wire: Wire, monkeypatch: pytest.MonkeyPatch
) -> None:
    for number, answer in enumerate(([], [ua.DataValue()] * 5), start=2):

        async def wrong(self, parameters, answer=answer):
            return list(answer)

        with monkeypatch.context() as patch:
            patch.setattr(UaSession, "read", wrong)
            assert await wire.session.read([NODE + "T1", NODE + "T2"], DEADLINE_S) is None
        await until(lambda n=number: wire.session.generation == n and wire.session.connected)


async def test_two_who_share_a_connection_close_it_with_the_last_one(wire: Wire) -> None:
    source = await wire.source(a=degrees("T1"))
    sink = await wire.sink(z=offset())
    assert wire.machine.sessions == 1
    await wire.session.close()  # the wire's own use
    await source.close()
    assert await sink.found(DEADLINE_S) == {"z": 0.0}
    await sink.close()
    assert not wire.session.connected
    await until(lambda: wire.machine.sessions == 0)


async def test_an_answer_at_the_moment_of_the_time_limit_is_late_and_ends_nothing() -> None:
    class WithResult(asyncio.CancelledError):
        """What the library's own wait raises then."""

    async def answered_as_it_is_cancelled() -> None:
        try:
            await asyncio.sleep(10.0)
        except asyncio.CancelledError:
            raise WithResult from None

    with pytest.raises(TimeoutError):
        async with within(0.01):
            await answered_as_it_is_cancelled()
    task = asyncio.ensure_future(answered_as_it_is_cancelled())
    await asyncio.sleep(0)
    task.cancel()
    with pytest.raises(asyncio.CancelledError):
        async with within(5.0):
            await task


async def test_a_write_that_still_waits_in_this_computer_is_not_sent_once_it_was_given_up() -> None:
    taken: asyncio.Queue[asyncio.StreamReader] = asyncio.Queue()

    async def take(reader: asyncio.StreamReader, _: asyncio.StreamWriter) -> None:
        await taken.put(reader)

    server = await asyncio.start_server(take, "127.0.0.1", 0, limit=1024)
    port = server.sockets[0].getsockname()[1]
    client = Client(f"opc.tcp://127.0.0.1:{port}")
    await client.connect_socket()
    assert client.uaclient.protocol is not None
    client.uaclient.protocol.transport.write(bytes(32 * 1024 * 1024))  # more than a socket takes
    reader = await taken.get()
    await discard(client)
    with pytest.raises(ConnectionResetError):
        await reader.readexactly(32 * 1024 * 1024)
    server.close()


def test_a_session_that_never_found_its_server_ends_at_once(runner) -> None:
    async def life() -> None:
        settings = ConnectionSettings(name="a", url="opc.tcp://127.0.0.1:1/x", security="none")
        session = OpcUaSession(settings, SystemClock())
        await session.open()
        await until(lambda: why(session) == "nothing_listens")
        assert await session.read([NODE + "T1"], 1.0) is None
        assert await session.write([(NODE + "T1", 1.0)], 1.0) is None
        assert await session.describe(NODE + "T1", 1.0) is None
        assert (session.connected, session.generation) == (False, 0)
        await session.close()
        await session.close()

    runner.run(life())


def test_what_listens_and_is_no_opcua_server_is_said_so_and_tried_again(
    runner, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level(logging.CRITICAL)
    answers = [b"", b"HTTP/1.1 400 Bad Request\r\n\r\n", b"ACKF\xff\xff\xff\xff", b"\x00" * 64] * 2
    visits = 0

    async def serve(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        nonlocal visits
        await reader.read(10)
        writer.write(answers[visits % len(answers)])
        visits += 1
        writer.close()
        await writer.wait_closed()

    async def life() -> None:
        server = await asyncio.start_server(serve, "127.0.0.1", 0)
        port = server.sockets[0].getsockname()[1]
        settings = ConnectionSettings(
            name="a",
            url=f"opc.tcp://127.0.0.1:{port}",
            security="none",
            timeout_s=0.1,
            retry_s=0.05,
        )
        session = OpcUaSession(settings, SystemClock())
        async with server:
            await session.open()
            await until(lambda: visits >= len(answers))
            assert why(session)
            assert not session.connected
            await session.close()

    runner.run(life())


@pytest.mark.parametrize("seed", [1, 2])
@pytest.mark.parametrize("wire", [{"timeout_s": 0.3}], indirect=True)
async def test_answers_with_wrong_bytes_cost_a_connection_at_most(
    wire: Wire, seed: int, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level(logging.CRITICAL, "asyncua")
    chance = random.Random(seed)  # noqa: S311 - the same damage every time

    def spoil(chunk: bytes) -> bytes:
        spoiled = bytearray(chunk)
        if chance.random() < 0.2:
            spoiled[chance.randrange(len(spoiled))] = chance.randrange(256)
        if chance.random() < 0.05:
            del spoiled[chance.randrange(len(spoiled)) :]
        return bytes(spoiled)

    source = await wire.source(a=degrees("T1"), b=flag("On"))
    sink = await wire.sink(z=offset())
    wire.cable.spoil = spoil
    loop = asyncio.get_running_loop()
    end_s = loop.time() + 0.7
    while loop.time() < end_s:
        found = await source.read(0.02)
        assert set(found) == {"a", "b"}
        await sink.found(0.02)
        await sink.write({"z": 1.0}, 0.02)
        await sink.read_back(0.02)
        await asyncio.sleep(0)
    wire.cable.spoil = bytes
    await until(lambda: wire.session.connected)
    while not (await source.read(1.0))["a"].good:
        await asyncio.sleep(0.01)


def test_a_mistake_in_the_program_is_not_taken_for_a_lost_machine(
    runner, monkeypatch: pytest.MonkeyPatch
) -> None:
    async def broken(*_):
        raise NotImplementedError("a mistake")

    monkeypatch.setattr("thermaxis.runtime.opcua._session.connect_once", broken)

    async def life() -> None:
        settings = ConnectionSettings(name="a", url="opc.tcp://127.0.0.1:1/x", security="none")
        session = OpcUaSession(settings, SystemClock())
        await session.open()
        await asyncio.sleep(0)
        with pytest.raises(NotImplementedError, match="a mistake"):
            await session.read([NODE + "T1"], 1.0)
        with pytest.raises(NotImplementedError, match="a mistake"):
            await session.close()

    runner.run(life())


# ---- what a server says of a node ---------------------------------------------------------------


async def test_a_node_is_described(wire: Wire) -> None:
    one = await wire.session.describe(NODE + "OffsetFloat", DEADLINE_S)
    assert (one.exists, one.status, one.data_type) == (True, "Good", "Float")
    assert (one.readable, one.writable, one.value) == (True, True, 0.0)
    assert one.age_s == pytest.approx(0.0, abs=1.0)
    locked = await wire.session.describe(NODE + "ReadOnly", DEADLINE_S)
    assert (locked.readable, locked.writable) == (True, False)
    text = await wire.session.describe(NODE + "Text", DEADLINE_S)
    assert (text.exists, text.data_type, text.value) == (True, "String", None)
    for node in (NODE + "Nowhere", "nsu=urn:nobody;s=T1"):
        missing = await wire.session.describe(node, DEADLINE_S)
        assert (missing.exists, missing.status) == (False, "BadNodeIdUnknown")
    folder = await wire.session.describe("i=85", DEADLINE_S)
    assert (folder.exists, folder.readable, folder.writable) == (True, False, False)


async def test_types_are_read_once_per_connection(wire: Wire, requests: list[str]) -> None:
    nodes = [NODE + "Offset", NODE + "OffsetInt", "nsu=urn:nobody;s=x"]
    expected = dict(zip(nodes, ["Double", "Int16", ""], strict=True))
    assert await wire.session.types(nodes, DEADLINE_S) == expected
    requests.clear()
    assert await wire.session.types(nodes, DEADLINE_S) == expected
    assert requests == []
