"""The OPC UA client against a server written by others: node-opcua, in a program of its own.

The server stands for a machine with string node ids, users, certificates, a small PLC that takes
an offset over only when the heartbeat moved, and faults on request: ``opcua/server.js``. What the
machine was told stands in its own record, so that limits are judged from the machine's side.
"""

import asyncio
import math
import time
from collections.abc import Awaitable, Callable, Iterator
from dataclasses import replace
from pathlib import Path

import pytest
from asyncua import ua
from asyncua.client.client import Client
from asyncua.common.node import Node

from tests.in_time import LONGEST_S, in_time
from tests.refusals import said_by
from tests.system.opcua.client import (
    CHANNELS,
    DEADLINE_S,
    URI,
    USERS,
    Identity,
    Link,
    linked,
    make_identity,
    open_settings,
    secured_settings,
    until,
)
from tests.system.opcua.foreign_server import (
    NAMESPACE_URI,
    WATCH_S,
    ForeignServer,
    install,
    missing,
)
from thermaxis.runtime import ConnectionSettings, Secret, SourceSample

pytestmark = [pytest.mark.system, pytest.mark.real_time]

WARM_K = 13.0
"""So far the machine's sensors rise in the end. [K]"""


@pytest.fixture(scope="module", autouse=True)
def _node_opcua() -> None:
    """Fail, in CI and elsewhere, where there is no node-opcua: a skipped proof proves nothing."""
    reason = missing()
    if reason:
        pytest.fail(reason, pytrace=False)
    install()


@pytest.fixture(scope="module")
def open_machine(tmp_path_factory: pytest.TempPathFactory) -> Iterator[ForeignServer]:
    """A machine that anybody may write to, as it is found in test halls only."""
    folder = tmp_path_factory.mktemp("open") / "machine"
    with ForeignServer(folder, unsecured=True, secured=False, anonymous=True) as server:
        yield server


@pytest.fixture
def machine(open_machine: ForeignServer) -> Iterator[ForeignServer]:
    """The same without a fault."""
    open_machine.tell(fault="none", channel="Temp1")
    yield open_machine
    open_machine.tell(fault="none", channel="Temp1")


# ---- the foreign server is what it claims -------------------------------------------------------


def test_a_missing_node_is_named_with_the_command_that_installs_it() -> None:
    reason = missing(("node-that-nobody-has",))
    assert "node-that-nobody-has not found" in reason
    assert "apt-get install" in reason
    assert missing() == ""


async def nodes_of(client: Client, *names: str) -> list[Node]:
    """Return the machine's nodes, by the library alone."""
    index = await client.get_namespace_index(NAMESPACE_URI)
    return [client.get_node(f"ns={index};s=/Plc/{name}") for name in names]


async def values(machine: ForeignServer, *names: str) -> list[ua.DataValue]:
    """Read with the library alone, as a second way beside the project's client."""
    async with Client(machine.url) as client:
        return await client.read_attributes(await nodes_of(client, *names))


def test_the_foreign_server_refuses_every_type_but_the_nodes_own(machine: ForeignServer) -> None:
    kinds = {
        "OffsetZ": ua.VariantType.Double,
        "OffsetX": ua.VariantType.Float,
        "OffsetY": ua.VariantType.Int32,
        "Heartbeat": ua.VariantType.UInt32,
    }

    async def attempt() -> dict[tuple[str, ua.VariantType], str]:
        said: dict[tuple[str, ua.VariantType], str] = {}
        async with Client(machine.url) as client:
            for name, node in zip(kinds, await nodes_of(client, *kinds), strict=True):
                for kind in kinds.values():
                    try:
                        await node.write_value(ua.DataValue(ua.Variant(0, kind)))
                        said[name, kind] = "Good"
                    except ua.UaStatusCodeError as error:
                        said[name, kind] = type(error).__name__
        return said

    said = asyncio.run(attempt())
    for (name, kind), status in said.items():
        assert status == ("Good" if kind is kinds[name] else "BadTypeMismatch"), (name, kind)


FAULTS = {
    "none": ("Good", 21.0),
    "bad": ("BadSensorFailure", 0.0),
    "uncertain": ("UncertainSensorNotAccurate", 21.0),
    "nan": ("Good", math.nan),
    "null": ("BadNoCommunication", None),
    "jump": ("Good", 36.0),
}


def test_the_machine_takes_an_offset_over_only_when_the_heartbeat_moves(
    machine: ForeignServer,
) -> None:
    async def write(name: str, value: float, kind: ua.VariantType) -> None:
        async with Client(machine.url) as client:
            (node,) = await nodes_of(client, name)
            await node.write_value(ua.DataValue(ua.Variant(value, kind)))

    def accepted() -> list[float]:
        return [line.accepted_um["Z"] for line in machine.record() if line.kind == "accepted"]

    before = accepted()
    asyncio.run(write("OffsetZ", 0.0123, ua.VariantType.Double))
    machine.tell(plc_cycle=True)
    assert accepted() == before
    asyncio.run(write("Heartbeat", 77, ua.VariantType.UInt32))
    machine.tell(plc_cycle=True)
    assert accepted() == [*before, pytest.approx(12.3)]


def test_the_record_names_every_start_and_the_offset_that_was_kept(tmp_path: Path) -> None:
    with ForeignServer(tmp_path / "machine", unsecured=True, anonymous=True) as machine:
        began_s, port = machine.ready_s, machine.port
        machine.prepare()
        machine.wait_for_successor()
        killed_s = machine.kill()
        machine.listen()
        assert machine.port == port
        assert in_time(machine.ready_s - killed_s, 2.0)
        machine.tell(fault="exit")
        assert machine.wait_for_end() == 1
        first, second = machine.record()
    assert (first.kind, second.kind) == ("start", "start")
    assert in_time(abs(first.monotonic_s - began_s), 0.1)
    assert in_time(abs(second.monotonic_s - machine.ready_s), 0.1)
    assert second.accepted_um == {"Z": 0.0, "X": 0.0, "Y": 0.0}


# ---- values -------------------------------------------------------------------------------------


def within(
    settings: ConnectionSettings,
    machine: ForeignServer,
    steps: Callable[[Link], Awaitable[None]],
    *names: str,
) -> None:
    """Run steps with the project's client, once it is connected."""

    async def run() -> None:
        async with linked(settings, machine, *names) as link:
            await link.connected()
            await steps(link)

    asyncio.run(run())


async def sample(link: Link, name: str, of: Callable[[SourceSample], bool]) -> SourceSample:
    """Read until a sample is as it should be, and return it."""
    began_s = time.monotonic()
    while True:
        found = (await link.source.read(DEADLINE_S))[name]
        if of(found):
            return found
        if time.monotonic() - began_s > LONGEST_S:
            pytest.fail(f"{name} stays {found}")
        await asyncio.sleep(0.02)


def test_every_value_comes_with_its_status_and_a_fresh_time(machine: ForeignServer) -> None:
    machine.tell(diameter_mm=1500.0, flags={"Referenced": True, "EmergencyStop": False})

    async def steps(link: Link) -> None:
        found = await link.source.read(DEADLINE_S)
        assert link.source.connected
        for channel in CHANNELS:
            assert found[channel].good
            assert found[channel].status == "Good"
            assert found[channel].value == pytest.approx(27.0, abs=WARM_K)
            age_s = found[channel].age_s
            assert age_s is not None
            assert age_s >= 0.0
            assert in_time(age_s, 0.3)
        assert found["Diameter"].value == 1500.0
        flags = {name: found[name].value for name in ("Referenced", "M5.0", "EmergencyStop")}
        assert flags == {"Referenced": 1.0, "M5.0": 1.0, "EmergencyStop": 0.0}
        assert (found["State"].value, found["State"].status) == (None, "BadTypeMismatch")
        machine.tell(flags={"Referenced": False, "EmergencyStop": True})
        await sample(link, "Referenced", lambda s: s.value == 0.0)
        await sample(link, "M5.0", lambda s: s.value == 0.0)
        await sample(link, "EmergencyStop", lambda s: s.value == 1.0)

    try:
        within(open_settings(machine), machine, steps)
    finally:
        machine.tell(diameter_mm=0.0, flags={"Referenced": True, "EmergencyStop": False})


def test_a_faulty_value_is_never_taken_for_a_good_one(machine: ForeignServer) -> None:
    """What the machine sends is read by the library alone too, as a second way."""

    async def steps(link: Link) -> None:
        for fault, (status, value) in FAULTS.items():
            machine.tell(fault=fault, channel="Temp1")
            machine.tell(sample=True)
            (sent, _) = await values(machine, "Temp1", "Temp2")
            assert sent.StatusCode is not None
            assert sent.StatusCode.name == status
            raw = sent.Value.Value if sent.Value is not None else None
            assert raw == pytest.approx(value, abs=WARM_K, nan_ok=True)
            found = await link.source.read(DEADLINE_S)
            assert found["Temp1"].good is (status == "Good"), fault
            assert found["Temp1"].status == status
            usable = not status.startswith("Bad") and value is not None and not math.isnan(value)
            wanted = pytest.approx(raw, abs=2.0) if usable else None
            assert found["Temp1"].value == wanted
            assert found["Temp2"].good
        machine.tell(fault="none", channel="Temp1")
        machine.tell(sample=True)
        assert (await link.source.read(DEADLINE_S))["Temp1"].good

    within(open_settings(machine), machine, steps)


def test_a_frozen_value_grows_old_while_its_neighbours_stay_fresh(machine: ForeignServer) -> None:
    async def steps(link: Link) -> None:
        machine.tell(fault="frozen", channel="Temp1")
        began_s = time.monotonic()
        old = await sample(link, "Temp1", lambda s: s.age_s is not None and s.age_s > 1.0)
        assert time.monotonic() - began_s > 0.8
        assert old.good
        other = (await link.source.read(DEADLINE_S))["Temp2"].age_s
        assert other is not None
        assert in_time(other, 0.3)

    within(open_settings(machine), machine, steps)


@pytest.mark.parametrize("ahead_s", [3600.0, -3600.0])
def test_a_machine_whose_clock_is_wrong_by_an_hour_sends_values_of_the_right_age(
    ahead_s: float, tmp_path: Path
) -> None:
    async def steps(link: Link) -> None:
        assert link.session.clock_difference_s == pytest.approx(ahead_s, abs=0.5)
        age_s = (await link.source.read(DEADLINE_S))["Temp1"].age_s
        assert age_s is not None
        assert age_s >= 0.0
        assert in_time(age_s, 0.3)

    with ForeignServer(
        tmp_path / "machine",
        unsecured=True,
        secured=False,
        anonymous=True,
        clock_shift_s=ahead_s,
    ) as machine:
        within(open_settings(machine), machine, steps)


# ---- offsets ------------------------------------------------------------------------------------


def test_offsets_of_three_types_and_both_signs_arrive_exactly(machine: ForeignServer) -> None:
    correction_um = {"Z_um": -12.3456, "X_um": 7.25, "Y_um": 3.14}

    async def steps(link: Link) -> None:
        assert await link.written(**correction_um)
        applied = await link.sink.read_back(DEADLINE_S)
        for name, value in correction_um.items():
            assert applied[name].requested_um == value
        await until(lambda: machine.record()[-1].accepted_um["X"] == -7.25, LONGEST_S, "accepted")

    within(open_settings(machine), machine, steps)
    accepted = machine.record()[-1].accepted_um
    assert accepted["Z"] == pytest.approx(-12.3456, abs=1e-9)
    assert accepted["X"] == -7.25  # towards the workpiece
    assert accepted["Y"] == pytest.approx(3.1, abs=1e-9)  # the machine counts tenths


def test_every_write_moves_the_heartbeat_and_none_is_lost(machine: ForeignServer) -> None:
    async def steps(link: Link) -> None:
        before = await values(machine, "WriteCount")
        await link.sink.found(DEADLINE_S)
        for k in range(100):
            assert await link.sink.write({"Z_um": 0.01 * k}, DEADLINE_S)
        after = await values(machine, "WriteCount")
        assert after[0].Value is not None
        assert before[0].Value is not None
        assert after[0].Value.Value - before[0].Value.Value == 100
        machine.tell(plc_cycle=True)

    within(open_settings(machine), machine, steps, "Z_um")
    last = machine.record()[-1]
    assert last.accepted_um["Z"] == pytest.approx(0.99)
    beats = [line.heartbeat for line in machine.record() if line.heartbeat is not None]
    assert len(set(beats[-3:])) == len(beats[-3:])


def test_what_is_no_finite_number_is_never_sent(machine: ForeignServer) -> None:
    async def steps(link: Link) -> None:
        assert await link.written(Z_um=1.0, X_um=2.0, Y_um=3.0)
        (before,) = await values(machine, "WriteCount")
        for wrong in (math.nan, math.inf, -math.inf):
            whole = {"Z_um": 1.0, "X_um": wrong, "Y_um": 3.0}
            assert not await link.sink.write(whole, DEADLINE_S)
            assert "X_um" in said_by(link.sink)
        (after,) = await values(machine, "WriteCount")
        assert before.Value is not None
        assert after.Value is not None
        assert after.Value.Value == before.Value.Value

    within(open_settings(machine), machine, steps)


def test_a_refused_offset_is_named_with_its_reason_and_is_no_loss_of_the_connection(
    machine: ForeignServer,
) -> None:
    async def steps(link: Link) -> None:
        assert await link.written(Z_um=1.0, X_um=1.0)
        generation = link.session.generation
        assert not await link.sink.write({"Z_um": 600.0, "X_um": 2.0}, DEADLINE_S)
        assert link.sink.refused == {"Z_um": "BadOutOfRange"}
        assert "Z_um" in said_by(link.sink)
        machine.tell(plc_cycle=True)
        applied = await link.sink.read_back(DEADLINE_S)
        assert applied["Z_um"].accepted_um == pytest.approx(1.0)
        assert applied["X_um"].accepted_um == pytest.approx(2.0)  # a request is not atomic
        machine.tell(fault="refuse", channel="none")
        assert not await link.sink.write({"Z_um": 1.0}, DEADLINE_S)
        assert link.sink.refused == {"Z_um": "BadNotWritable"}
        machine.tell(fault="none")
        assert await link.sink.write({"Z_um": 1.5}, DEADLINE_S)
        assert link.sink.failure is None
        assert link.session.generation == generation

    within(open_settings(machine), machine, steps)


def test_a_machine_that_says_yes_and_applies_nothing_is_seen_in_what_it_accepted(
    machine: ForeignServer,
) -> None:
    async def steps(link: Link) -> None:
        assert await link.written(Z_um=1.0)
        machine.tell(fault="deaf", channel="none")
        assert await link.sink.write({"Z_um": 9.0}, DEADLINE_S)
        machine.tell(plc_cycle=True)
        applied = (await link.sink.read_back(DEADLINE_S))["Z_um"]
        assert applied.requested_um == 9.0
        assert applied.accepted_um == pytest.approx(1.0)

    within(open_settings(machine), machine, steps)


# ---- certificates and users ---------------------------------------------------------------------


@pytest.fixture(scope="module")
def guarded(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[ForeignServer, Identity]]:
    """A machine with users that trusts one certificate only."""
    folder = tmp_path_factory.mktemp("guarded")
    with ForeignServer(folder / "machine", users=USERS) as machine:
        server = machine.write_certificate(folder / "control.der")
        identity = make_identity(folder, "own", server)
        machine.trust(identity.certificate)

        async def ready() -> None:
            async with linked(secured_settings(machine, identity), machine) as link:
                await link.connected(WATCH_S)

        asyncio.run(ready())
        yield machine, identity


def refusal(settings: ConnectionSettings, machine: ForeignServer) -> str:
    """Return why a connection is not made."""

    async def run() -> str:
        async with linked(settings, machine) as link:
            await until(lambda: bool(link.session.last_error), LONGEST_S, "a reason")
            assert not link.session.connected
            assert not (await link.source.read(0.1))["Temp1"].good
            assert not await link.sink.write({"Z_um": 1.0}, 0.1)
            return link.session.last_error

    return asyncio.run(run())


def test_a_user_with_a_certificate_reads_and_writes_encrypted(
    guarded: tuple[ForeignServer, Identity],
) -> None:
    machine, identity = guarded

    async def steps(link: Link) -> None:
        assert (await link.source.read(DEADLINE_S))["Temp1"].good
        assert await link.written(Z_um=4.2, X_um=-1.0, Y_um=0.5)

    within(secured_settings(machine, identity), machine, steps)


def test_a_viewer_reads_and_is_told_that_he_must_not_write(
    guarded: tuple[ForeignServer, Identity],
) -> None:
    machine, identity = guarded

    async def steps(link: Link) -> None:
        assert (await link.source.read(DEADLINE_S))["Temp1"].good
        await link.sink.found(DEADLINE_S)
        assert not await link.sink.write({"Z_um": 1.0}, DEADLINE_S)
        assert link.sink.refused["Z_um"] == "BadUserAccessDenied"
        assert "right" in said_by(link.sink)

    within(secured_settings(machine, identity, "viewer"), machine, steps)


def test_a_wrong_password_is_said_so_and_never_shown(
    guarded: tuple[ForeignServer, Identity],
) -> None:
    machine, identity = guarded
    said = refusal(secured_settings(machine, identity, password="guessed-wrong"), machine)  # noqa: S106 - a wrong one
    assert "refuses the user operator" in said
    assert "guessed-wrong" not in said


def test_nobody_enters_without_a_user(guarded: tuple[ForeignServer, Identity]) -> None:
    machine, identity = guarded
    anonymous = replace(secured_settings(machine, identity), user="", password=Secret(""))
    assert "without a user" in refusal(anonymous, machine)


def test_a_server_without_an_open_door_is_not_entered_without_encryption(
    guarded: tuple[ForeignServer, Identity],
) -> None:
    machine, _ = guarded
    assert "control: " in refusal(open_settings(machine), machine)


def test_another_server_than_the_one_whose_certificate_is_stored_gets_no_password(
    guarded: tuple[ForeignServer, Identity], tmp_path: Path
) -> None:
    machine, identity = guarded
    foreign = make_identity(tmp_path, "somebody-else", identity.server_certificate)
    swapped = replace(identity, server_certificate=foreign.certificate)
    said = refusal(secured_settings(machine, swapped), machine)
    assert "certificate" in said
    assert "compensates" not in said


def test_an_application_uri_that_the_certificate_does_not_hold_is_found_before_the_machine_is_asked(
    guarded: tuple[ForeignServer, Identity],
) -> None:
    machine, identity = guarded
    other = replace(secured_settings(machine, identity), application_uri=f"{URI}:other")

    async def run() -> None:
        async with linked(other, machine):
            pytest.fail("it was opened")

    with pytest.raises(Exception, match="certificate") as caught:
        asyncio.run(run())
    assert URI in str(caught.value)


def test_a_certificate_that_the_operator_trusts_later_connects_by_itself(
    guarded: tuple[ForeignServer, Identity], tmp_path: Path
) -> None:
    machine, identity = guarded
    new = make_identity(tmp_path, "new", identity.server_certificate)

    async def run() -> None:
        async with linked(secured_settings(machine, new), machine) as link:
            await until(lambda: bool(link.session.last_error), LONGEST_S, "a reason")
            assert "does not trust the own certificate" in link.session.last_error
            assert str(new.certificate) in link.session.last_error
            await until(
                lambda: bool(machine.rejected()), LONGEST_S, "the machine shows whom it refused"
            )
            machine.trust_rejected()
            await link.connected(WATCH_S)
            assert link.session.last_error == ""
            assert await link.written(Z_um=1.0)

    asyncio.run(run())


def test_a_machine_without_a_free_session_says_so_and_lets_the_next_one_in(
    tmp_path: Path,
) -> None:
    async def run(machine: ForeignServer) -> None:
        async with linked(open_settings(machine), machine) as first:
            await first.connected()
            async with linked(open_settings(machine), machine) as second:
                await until(lambda: bool(second.session.last_error), LONGEST_S, "a reason")
                assert "no session left" in second.session.last_error
                assert (await first.source.read(DEADLINE_S))["Temp1"].good
                await first.sink.close()
                await first.source.close()
                await second.connected()
                assert (await second.source.read(DEADLINE_S))["Temp1"].good

    with ForeignServer(
        tmp_path / "machine", unsecured=True, secured=False, anonymous=True, sessions=1
    ) as machine:
        asyncio.run(run(machine))


# ---- losing and finding the machine -------------------------------------------------------------

WORKS_AGAIN_S = 1.0


async def works_again(link: Link, returned_s: Callable[[], float]) -> float:
    """Read until values are good again; return the time since the machine's return. [s]"""
    began_s = time.monotonic()
    while not (await link.source.read(DEADLINE_S))["Temp1"].good:
        assert time.monotonic() - began_s < LONGEST_S, link.session.last_error
        await asyncio.sleep(0.01)
    return time.monotonic() - returned_s()


async def succession(machine: ForeignServer) -> None:
    """Prepare the machine's return while the client goes on."""
    machine.prepare()
    await asyncio.to_thread(machine.wait_for_successor)


def test_a_killed_server_that_returns_is_read_again_within_a_second_each_time(
    guarded: tuple[ForeignServer, Identity],
) -> None:
    machine, identity = guarded
    took_s: list[float] = []

    async def steps(link: Link) -> None:
        assert await link.written(Z_um=12.0)
        for down_s in (0.0, 0.3, 1.2):
            generation = link.session.generation
            await succession(machine)
            assert (await link.source.read(DEADLINE_S))["Temp1"].good
            machine.kill()
            lost_s = await until(lambda: not link.session.connected, 0.5, "the loss is seen")
            assert in_time(lost_s, 0.5)
            began_s = time.monotonic()
            while time.monotonic() - began_s < down_s:
                found = await link.source.read(DEADLINE_S)
                assert not any(one.good for one in found.values())
                assert not link.source.connected
                assert not await link.sink.write({"Z_um": 12.0}, DEADLINE_S)
                await asyncio.sleep(0.05)
            await asyncio.to_thread(machine.listen)
            took_s.append(await works_again(link, lambda: machine.ready_s))
            assert link.session.generation == generation + 1
            assert not await link.sink.write({"Z_um": 12.0}, DEADLINE_S)  # not read before
            found_um = await link.sink.found(DEADLINE_S)
            assert found_um is not None
            assert found_um["Z_um"] == pytest.approx(12.0, abs=1e-6)
            assert await link.sink.found(DEADLINE_S) is None
            assert await link.sink.write({"Z_um": 12.0}, DEADLINE_S)

    within(secured_settings(machine, identity), machine, steps)
    print("working again after", [f"{one:.2f} s" for one in took_s])
    assert in_time(max(took_s), WORKS_AGAIN_S)
    told = [line.accepted_um["Z"] for line in machine.record()[-4:] if line.accepted_um]
    assert told == pytest.approx([12.0] * len(told))


def test_an_offset_that_a_restart_lost_is_found_as_zero_before_anything_is_written(
    tmp_path: Path,
) -> None:
    with ForeignServer(
        tmp_path / "machine", unsecured=True, secured=False, anonymous=True, offset_at_start=0.0
    ) as machine:

        async def steps(link: Link) -> None:
            assert await link.written(Z_um=30.0, X_um=-10.0, Y_um=5.0)
            await succession(machine)
            machine.kill()
            await asyncio.to_thread(machine.listen)
            await works_again(link, lambda: machine.ready_s)
            found_um = await link.sink.found(DEADLINE_S)
            assert found_um == pytest.approx({"Z_um": 0.0, "X_um": 0.0, "Y_um": 0.0})

        within(open_settings(machine), machine, steps)
        started = [line for line in machine.record() if line.kind == "start"][-1]
        after = machine.record()[machine.record().index(started) + 1 :]
        assert not [line for line in after if line.kind == "accepted"]


def test_a_server_that_returns_with_other_namespace_indices_is_read_and_written_rightly(
    tmp_path: Path,
) -> None:
    with ForeignServer(
        tmp_path / "machine", unsecured=True, secured=False, anonymous=True
    ) as machine:

        async def steps(link: Link) -> None:
            assert await link.written(Z_um=5.0)
            machine.settings["names_before"] = 3
            await succession(machine)
            machine.kill()
            await asyncio.to_thread(machine.listen)
            await works_again(link, lambda: machine.ready_s)
            assert await link.written(Z_um=6.0, X_um=1.0, Y_um=2.0)

        within(open_settings(machine), machine, steps)
        assert machine.record()[-1].accepted_um["Z"] == pytest.approx(6.0)


def test_a_frozen_server_costs_no_cycle_its_deadline_and_works_again_within_a_second(
    guarded: tuple[ForeignServer, Identity],
) -> None:
    machine, identity = guarded
    longest_s = 0.0

    async def steps(link: Link) -> None:
        nonlocal longest_s
        assert await link.written(Z_um=3.0)
        machine.freeze()
        began_s = time.monotonic()
        try:
            while time.monotonic() - began_s < 3.0:
                asked_s = time.monotonic()
                found = await link.source.read(0.1)
                assert not any(one.good for one in found.values())
                assert not await link.sink.write({"Z_um": 3.0}, 0.1)
                longest_s = max(longest_s, time.monotonic() - asked_s)
                await asyncio.sleep(0.05)
            assert not link.session.connected
            assert "no answer" in link.session.last_error
        finally:
            machine.thaw()
        thawed_s = time.monotonic()
        took_s = await works_again(link, lambda: thawed_s)
        print(f"working again after {took_s:.2f} s; the longest cycle took {longest_s:.2f} s")
        assert in_time(took_s, WORKS_AGAIN_S)
        found_um = await link.sink.found(DEADLINE_S)
        assert found_um is not None
        assert await link.sink.write({"Z_um": 3.0}, DEADLINE_S)

    within(secured_settings(machine, identity), machine, steps)
    assert in_time(longest_s, 0.2 + 0.1)


def test_a_server_that_is_busy_for_a_while_is_not_believed_late(machine: ForeignServer) -> None:
    machine.tell(busy_s=0.6)

    async def steps(link: Link) -> None:
        generation = link.session.generation
        machine.tell(fault="busy")
        await asyncio.sleep(0.1)
        asked_s = time.monotonic()
        found = await link.source.read(0.2)
        assert in_time(time.monotonic() - asked_s, 0.3)
        assert not any(one.good for one in found.values())
        again = await sample(link, "Temp1", lambda s: s.good)  # an old one, and it says so
        assert again.age_s is not None
        await sample(link, "Temp1", lambda s: s.age_s is not None and s.age_s < 0.3)
        assert link.session.generation == generation  # a late answer is no lost connection

    within(open_settings(machine), machine, steps)


def test_lost_connections_do_not_use_up_the_machines_sessions(tmp_path: Path) -> None:
    """A control has five or ten; each pause of the network leaves one behind until it expires."""
    with ForeignServer(
        tmp_path / "machine", unsecured=True, secured=False, anonymous=True, sessions=3
    ) as machine:

        async def steps(link: Link) -> None:
            for _ in range(5):
                generation = link.session.generation
                machine.freeze()
                try:
                    await link.source.read(0.1)
                    await until(lambda: not link.session.connected, LONGEST_S, "the loss is seen")
                finally:
                    machine.thaw()
                thawed_s = time.monotonic()
                assert in_time(await works_again(link, lambda: thawed_s), 12.0)  # noqa: B023 - at once
                assert link.session.generation > generation

        within(open_settings(machine), machine, steps)


def test_a_channel_is_renewed_without_a_lost_cycle(tmp_path: Path) -> None:
    """Tokens live for ten minutes and more; here for two seconds, so that many are renewed."""
    with ForeignServer(tmp_path / "machine", users=USERS, token_life_s=2.0) as machine:
        server = machine.write_certificate(tmp_path / "control.der")
        identity = make_identity(tmp_path, "own", server)
        machine.trust(identity.certificate)

        async def steps(link: Link) -> None:
            await link.sink.found(DEADLINE_S)
            generation, began_s, cycles = link.session.generation, time.monotonic(), 0
            while time.monotonic() - began_s < 9.0:
                assert (await link.source.read(DEADLINE_S))["Temp1"].good
                assert await link.sink.write({"Z_um": 1.0}, DEADLINE_S)
                cycles += 1
                await asyncio.sleep(0.1)
            assert cycles > 50
            assert link.session.generation == generation

        async def run() -> None:
            async with linked(secured_settings(machine, identity), machine) as link:
                await link.connected(WATCH_S)
                await steps(link)

        asyncio.run(run())
