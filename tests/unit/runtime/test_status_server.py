"""The status server, as a client sees it: values with quality and time, methods by role."""

import asyncio
import contextlib
import json
import math
import subprocess
import sys
from collections.abc import AsyncIterator
from dataclasses import replace
from datetime import timedelta
from pathlib import Path
from typing import Any

import pytest
from asyncua import Client, Node, ua
from asyncua.crypto.security_policies import (
    SecurityPolicyAes128Sha256RsaOaep,
    SecurityPolicyAes256Sha256RsaPss,
    SecurityPolicyBasic256Sha256,
)

from tests.scenes import scene
from tests.unit.runtime.status_server_parts import (
    FAULTY,
    NOW,
    PASSWORD,
    Box,
    HandClock,
    Pairs,
    alarm,
    call,
    client,
    node_id,
    offsets,
    output,
    read,
    run,
    served,
    status,
    users_file,
    viewers,
)
from thermaxis.compensation import AnswerCode, Request, RequestKind, SupervisorState
from thermaxis.errors import ConfigurationError
from thermaxis.runtime import (
    EventRecord,
    RequestOutcome,
    Role,
    StatusServer,
    User,
    read_users,
    write_users,
)
from thermaxis.runtime.host import is_loopback
from thermaxis.runtime.status import NAMESPACE, leaves_of, shape_of


@pytest.fixture(scope="module")
def pairs(tmp_path_factory: pytest.TempPathFactory) -> Pairs:
    return Pairs(tmp_path_factory.mktemp("pairs"))


HELD = [True, "it is held, for at most 1\N{NO-BREAK SPACE}min", "held", '{"longest_s": 60.0}']
"""What `Box` answers, as it comes back."""


def number(value: float) -> ua.Variant:
    return ua.Variant(value, ua.VariantType.Double)


def text(value: str) -> ua.Variant:
    return ua.Variant(value, ua.VariantType.String)


@contextlib.asynccontextmanager
async def watched() -> AsyncIterator[tuple[StatusServer, Client, HandClock]]:
    """Serve a status to everybody of this computer, with a client that has connected."""
    clock = HandClock()
    async with served(viewers(), clock=clock) as server, client(server) as one:
        server.publish(status())
        await clock.move(0.2)
        yield server, one, clock


async def paths_below(node: Node) -> AsyncIterator[str]:
    """Yield the paths of all values below a node, as a client browses to them."""
    for child in await node.get_children():
        if await child.read_node_class() is ua.NodeClass.Variable:
            yield str(child.nodeid.Identifier)
        elif child.nodeid.Identifier != "Requests":
            async for path in paths_below(child):
                yield path


# ---- values -----------------------------------------------------------------------------------


@scene
async def test_a_client_reads_the_values_of_the_last_cycle_with_its_time() -> None:
    async with served(viewers()) as server, client(server) as one:
        server.publish(status())
        server.publish(status(number=28_801, utc=NOW + timedelta(seconds=1)))
        state = await read(one, "Status/State")
        beat = await read(one, "Status/Heartbeat")
        assert state.Value.Value == "Active"
        assert state.StatusCode.is_good()
        assert state.SourceTimestamp == NOW + timedelta(seconds=1)
        assert (beat.Value.Value, beat.Value.VariantType) == (28_801, ua.VariantType.UInt32)


@scene
async def test_every_value_can_be_read_browsed_to_and_has_the_type_that_is_promised() -> None:
    async with watched() as (_, one, _):
        leaves = leaves_of(shape_of(status())).shown
        root = one.get_node(await node_id(one, "Thermaxis"))
        for leaf in leaves.values():
            # by names, as a person finds it, and by id, as a configuration does
            names = [f"{root.nodeid.NamespaceIndex}:{part}" for part in leaf.path.split("/")]
            node = await root.get_child(names)
            assert node.nodeid == await node_id(one, leaf.path)
            value = await node.read_data_value(raise_on_bad_status=False)
            assert not value.StatusCode.is_bad(), leaf.path
            promised = await node.read_data_type_as_variant_type()
            if value.Value.Value is not None:
                assert value.Value.VariantType == promised, leaf.path
                assert value.Value.is_array == leaf.field.kind.value.endswith("[]"), leaf.path
            assert (await node.read_description()).Text == leaf.field.text
            assert value.ServerTimestamp is not None
        assert {path async for path in paths_below(root)} == set(leaves)


@scene
async def test_an_output_shows_what_is_wanted_accepted_and_effective_apart() -> None:
    async with watched() as (server, one, _):
        shown = {
            short: (await read(one, f"Outputs/Z_um/{short}")).Value.Value
            for short in ("Correction", "Wanted", "Requested", "Accepted", "Effective", "Rate")
        }
        assert shown == {
            "Correction": -12.5,
            "Wanted": -13.0,
            "Requested": -12.5,
            "Accepted": -12.4,
            "Effective": -12.0,
            "Rate": -0.5,
        }
        assert (await read(one, "Outputs/Z_um/Limit")).Value.Value == 50.0
        assert (await read(one, "Outputs/Z_um/SoftLimit")).Value.Value == 40.0
        assert (await read(one, "Outputs/Z_um/Parts")).Value.Value == [11.0, 2.0]
        assert (await read(one, "Outputs/Z_um/PartNames")).Value.Value == ["spindle", "column"]
        server.publish(status(offsets={"Z_um": offsets(-12.5, None, None)}))
        accepted = await read(one, "Outputs/Z_um/Accepted")
        assert accepted.StatusCode.name == "BadNoCommunication"
        effective = await read(one, "Outputs/Z_um/Effective")
        assert effective.StatusCode.name == "GoodNoData"
        assert effective.Value.Value is None


@scene
async def test_a_bad_input_has_a_bad_status_and_no_value_and_a_redundant_is_uncertain() -> None:
    async with watched() as (server, one, _):
        good = await read(one, "Inputs/T_spindle_C/Value")
        assert (good.Value.Value, good.StatusCode.name) == (31.5, "Good")
        assert good.SourceTimestamp == NOW - timedelta(milliseconds=250)
        server.publish(status(**FAULTY))
        bad = await read(one, "Inputs/T_spindle_C/Value")
        assert (bad.Value.Value, bad.StatusCode.name) == (None, "BadSensorFailure")
        redundant = await read(one, "Inputs/T_column_C/Value")
        assert redundant.Value.Value == 22.0
        assert redundant.StatusCode.name == "UncertainSubNormal"
        quality = await read(one, "Inputs/T_spindle_C/Quality")
        assert quality.Value.Value == "status_bad"
        reasons = (await read(one, "Status/Reasons")).Value.Value
        assert reasons == [r.value for r in FAULTY["output"].reasons]


@scene
async def test_a_number_that_is_none_is_never_shown_as_good() -> None:
    async with watched() as (server, one, _):
        for value in (math.nan, -math.inf):
            server.publish(status(output=output(correction_um=(value,), values=(value, 22.0))))
            for path in ("Outputs/Z_um/Correction", "Inputs/T_spindle_C/Value"):
                shown = await read(one, path)
                assert shown.StatusCode.is_bad()
                assert shown.Value.Value is None
            whole = json.loads((await read(one, "Status/Everything")).Value.Value)
            assert whole["outputs"]["Z_um"]["correction_um"] is None


@scene
async def test_everything_in_one_text_says_the_same_as_the_single_values() -> None:
    clock = HandClock()
    async with served(viewers(), clock=clock) as server, client(server) as one:
        server.publish(status(alarms=(alarm(),), trim_owner={"Z_um": "novak"}))
        await clock.move(0.2)
        whole = json.loads((await read(one, "Status/Everything")).Value.Value)
        assert whole["format"] == "thermaxis-status"
        assert whole["state"] == (await read(one, "Status/State")).Value.Value
        for short, key in (
            ("Correction", "correction_um"),
            ("Accepted", "accepted_um"),
            ("Weight", "weight"),
            ("TrimOwner", "trim_owner"),
        ):
            shown = (await read(one, f"Outputs/Z_um/{short}")).Value.Value
            assert whole["outputs"]["Z_um"][key] == shown
        assert whole["outputs"]["Z_um"]["parts_um"] == {"spindle": 11.0, "column": 2.0}
        assert whole["outputs"]["Z_um"]["limits"]["largest_um"] == 50.0
        assert whole["inputs"]["T_spindle_C"]["value_c"] == 31.5
        assert whole["signals"]["interlock.referenced"]["read"] == 1.0
        assert whole["alarms"][0]["remedy"] == "Watch it; compare with a probe measurement."
        assert whole["utc"] == "2030-05-01T06:00:00.000+00:00"
        lines = (await read(one, "Alarms/Texts")).Value.Value
        assert lines[0].startswith("medium: The correction of Z is −45.0 µm, beyond")


@scene
async def test_before_the_first_cycle_nothing_is_claimed() -> None:
    async with served(viewers()) as server, client(server) as one:
        state = await read(one, "Status/State")
        assert state.StatusCode.name == "BadWaitingForInitialData"
        assert state.Value.Value is None


@scene
async def test_a_loop_that_stands_still_makes_every_value_uncertain_until_it_goes_on() -> None:
    clock = HandClock()
    async with served(viewers(), clock=clock) as server, client(server) as one:
        server.publish(status())
        clock.now_s += 3.0
        assert (await read(one, "Status/State")).StatusCode.name == "Good"
        clock.now_s += 0.001
        state = await read(one, "Status/State")
        assert state.StatusCode.name == "UncertainLastUsableValue"
        assert state.Value.Value == "Active"
        server.publish(status())
        assert (await read(one, "Status/State")).StatusCode.name == "Good"


@scene
async def test_another_model_brings_its_channels_and_the_old_ones_have_no_value() -> None:
    async with watched() as (server, one, clock):
        server.publish(status(channels=("T_spindle_C", "T_bed_C")))
        await clock.move(0.2)
        assert (await read(one, "Inputs/T_bed_C/Value")).Value.Value == 22.0
        old = await read(one, "Inputs/T_column_C/Value")
        assert (old.Value.Value, old.StatusCode.name) == (None, "BadNoData")
        moved = await read(one, "Signals/T_column_C/Read")
        assert moved.Value.Value == 22.0


HOSTILE = (
    "../../etc/passwd",
    "<script>alert(1)</script>",
    "a/b",
    "Value",
    "%2F",
    "\x1b[2J\x00\n",
    "\u202e",
    "ž" * 300,
    "'; DROP TABLE cycles; --",
)


@scene
async def test_hostile_names_and_texts_are_values_and_nothing_more() -> None:
    clock = HandClock()
    async with served(viewers(), clock=clock) as server, client(server) as one:
        said = status(
            *HOSTILE,
            machine=HOSTILE[1],
            configuration_sha256=HOSTILE[5],
            model_file=HOSTILE[0],
            alarms=(alarm(key=HOSTILE[3], values={"name": HOSTILE[5]}, code=HOSTILE[1]),),
            trim_owner=dict.fromkeys(HOSTILE, HOSTILE[6]),
        )
        server.publish(said)
        await clock.move(0.2)
        folder = one.get_node(await node_id(one, "Outputs"))
        names = {(await n.read_browse_name()).Name for n in await folder.get_children()}
        assert names == {n.replace("%", "%25").replace("/", "%2F") for n in HOSTILE}
        whole = json.loads((await read(one, "Status/Everything")).Value.Value)
        assert set(whole["outputs"]) == set(HOSTILE)
        assert whole["machine"] == HOSTILE[1]
        assert (await read(one, "Status/ConfigurationSha256")).Value.Value == HOSTILE[5]


@scene
async def test_no_value_can_be_written_and_no_node_made_or_deleted(pairs: Pairs) -> None:
    async with served(pairs.settings()) as server:
        server.publish(status())
        async with pairs.user(server, "engineer") as one:
            node = one.get_node(await node_id(one, "Status/State"))
            with pytest.raises(ua.UaStatusCodeError) as caught:
                await node.write_value("Off")
            assert caught.value.code == ua.StatusCodes.BadServiceUnsupported
            objects = one.nodes.objects
            with pytest.raises(ua.UaStatusCodeError):
                await objects.add_folder(node.nodeid.NamespaceIndex, "mine")
            with pytest.raises(ua.UaStatusCodeError):
                await one.delete_nodes([node])
            assert (await read(one, "Status/State")).Value.Value == "Active"


# ---- subscriptions ----------------------------------------------------------------------------


class Listener:
    """Collects what a subscription brings."""

    def __init__(self) -> None:
        self.told: list[tuple[str | int, object, str]] = []
        self._more = asyncio.Event()

    def datachange_notification(self, node: Any, val: object, data: Any) -> None:
        code = data.monitored_item.Value.StatusCode.name
        self.told.append((node.nodeid.Identifier, val, code))
        self._more.set()

    async def until(self, path: str | int, value: object, code: str = "Good") -> None:
        while (path, value, code) not in self.told:
            self._more.clear()
            await self._more.wait()


@scene
async def test_a_subscriber_is_told_of_a_state_at_once_and_of_numbers_within_a_second() -> None:
    async with watched() as (server, one, clock):
        listener = Listener()
        subscription = await one.create_subscription(100, listener)
        await subscription.subscribe_data_change(
            [
                one.get_node(await node_id(one, path))
                for path in ("Status/State", "Outputs/Z_um/Correction")
            ]
        )
        await listener.until("Status/State", "Active")
        await listener.until("Outputs/Z_um/Correction", -12.5)
        changed = output(state=SupervisorState.HOLDING, correction_um=(-12.0,))
        server.publish(status(output=changed))
        await clock.move(0.2)
        await listener.until("Status/State", "Holding")
        assert ("Outputs/Z_um/Correction", -12.0, "Good") not in listener.told
        for _ in range(4):
            await clock.move(0.2)
            server.publish(status(output=changed))
        await listener.until("Outputs/Z_um/Correction", -12.0)
        # a loop that stands still is told as well
        for _ in range(20):
            await clock.move(0.2)
        await listener.until("Status/State", "Holding", "UncertainLastUsableValue")
        await subscription.delete()


@scene
async def test_a_server_that_cannot_tell_ends_with_its_connections_instead_of_deceiving(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    async def fail(*_: object, **__: object) -> None:
        raise RuntimeError("a subscription that is broken")

    clock, events = HandClock(), list[EventRecord]()
    async with served(viewers(), clock=clock, audit=events) as server:
        server.publish(status())
        await clock.move(0.2)
        monkeypatch.setattr(StatusServer, "_tell_changes", fail)
        host, port = "127.0.0.1", server.port
        reader, writer = await asyncio.open_connection(host, port)
        await clock.move(0.2)
        async with asyncio.timeout(30.0):
            assert await reader.read() == b""
        writer.close()
        assert server.port == 0
        with pytest.raises(ConnectionRefusedError):
            await asyncio.open_connection(host, port)
        (alarm,) = [event.text for event in events if event.kind == "alarm"]
        assert "a subscription that is broken" in alarm
        server.publish(status())  # the loop goes on as if nobody looked


@scene
async def test_nobody_is_told_the_same_value_again() -> None:
    async with watched() as (server, one, clock):
        listener = Listener()
        subscription = await one.create_subscription(100, listener)
        nodes = [one.get_node(await node_id(one, "Status/State"))]
        await subscription.subscribe_data_change(nodes)
        await listener.until("Status/State", "Active")
        for i in range(20):
            server.publish(status(number=i, utc=NOW + timedelta(seconds=i)))
            await clock.move(0.2)
        server.publish(status(output=output(state=SupervisorState.OFF)))
        await clock.move(0.2)
        await listener.until("Status/State", "Off")
        assert [value for _, value, _ in listener.told] == ["Active", "Off"]
        await subscription.delete()


@scene
async def test_a_filter_that_does_not_fit_harms_nobody_else() -> None:
    async with watched() as (server, one, clock):
        odd, plain = Listener(), Listener()
        state = one.get_node(await node_id(one, "Status/State"))
        with_deadband = await one.create_subscription(100, odd)
        await with_deadband.deadband_monitor(state, 1.0)
        without = await one.create_subscription(100, plain)
        await without.subscribe_data_change([state])
        await plain.until("Status/State", "Active")
        server.publish(status(output=output(state=SupervisorState.OFF)))
        await clock.move(0.2)
        await plain.until("Status/State", "Off")
        await with_deadband.delete()
        await without.delete()


# ---- requests and roles -----------------------------------------------------------------------

ASKED = (
    ("Enable", (), Request(RequestKind.ENABLE, "operator")),
    ("Disable", (), Request(RequestKind.DISABLE, "operator")),
    ("Hold", (), Request(RequestKind.HOLD, "operator")),
    ("Resume", (), Request(RequestKind.RESUME, "operator")),
    ("Acknowledge", (), Request(RequestKind.ACKNOWLEDGE, "operator")),
    (
        "Trim",
        (text("Z_um"), number(-2.5), number(600.0)),
        Request(RequestKind.TRIM, "operator", "Z_um", -2.5, 600.0),
    ),
    (
        "Diameter",
        (ua.Variant(1500, ua.VariantType.Int32),),
        Request(RequestKind.DIAMETER, "operator", value=1500.0),
    ),
    ("NoDiameter", (), Request(RequestKind.DIAMETER, "operator")),
)


@scene
async def test_every_request_of_an_operator_reaches_the_loop_with_the_operators_name(
    pairs: Pairs,
) -> None:
    box = Box()
    async with served(pairs.settings(), box) as server, pairs.user(server, "operator") as one:
        for method, arguments, _ in ASKED:
            assert await call(one, method, *arguments) == HELD
    assert box.requests == [request for _, _, request in ASKED]


@scene
async def test_the_loops_refusal_comes_back_with_its_reason_and_code(pairs: Pairs) -> None:
    box = Box()
    box.outcome = RequestOutcome(accepted=False, code=AnswerCode.IN_FAULT)
    async with served(pairs.settings(), box) as server, pairs.user(server, "operator") as one:
        answer = await call(one, "Trim", text("Z_um"), number(7.0), number(60.0))
        assert answer == [False, "it is in the state Fault", "in_fault", "{}"]


@scene
async def test_a_viewer_may_ask_for_nothing_and_an_operator_for_no_other_model(
    pairs: Pairs,
) -> None:
    box, events = Box(), list[EventRecord]()
    async with served(pairs.settings(), box, audit=events) as server:
        async with pairs.user(server, "viewer") as one:
            for method, arguments, _ in ASKED:
                with pytest.raises(ua.UaStatusCodeError) as caught:
                    await call(one, method, *arguments)
                assert caught.value.code == ua.StatusCodes.BadUserAccessDenied
            assert await call(one, "WhoAmI") == ["viewer", "viewer"]
        async with pairs.user(server, "operator") as one:
            with pytest.raises(ua.UaStatusCodeError) as caught:
                await call(one, "ChooseModel", text("other.json"))
            assert caught.value.code == ua.StatusCodes.BadUserAccessDenied
        assert box.requests == []
        async with pairs.user(server, "engineer") as one:
            assert (await call(one, "ChooseModel", text("other.json")))[0] is True
    assert box.requests == [Request(RequestKind.MODEL, "engineer", text="other.json")]
    refused = [e for e in events if e.kind == "request"]
    assert [e.who for e in refused] == ["viewer"] * len(ASKED) + ["operator"]
    assert refused[-1].text == "ChooseModel refused: operator may not, it needs engineer"


@scene
async def test_somebody_without_a_name_may_look_where_that_is_configured_and_nothing_else() -> None:
    box = Box()
    async with served(viewers(), box) as server, client(server) as one:
        assert await call(one, "WhoAmI") == ["", "viewer"]
        for method, arguments, _ in ASKED:
            with pytest.raises(ua.UaStatusCodeError) as caught:
                await call(one, method, *arguments)
            assert caught.value.code == ua.StatusCodes.BadUserAccessDenied
    assert box.requests == []


UNFIT: tuple[tuple[str, tuple[ua.Variant, ...], str], ...] = (
    ("Trim", (text("Z_um"), number(1.0)), "BadArgumentsMissing"),
    ("Enable", (number(1.0),), "BadTooManyArguments"),
    ("Trim", (number(1.0), number(1.0), number(1.0)), "BadInvalidArgument"),
    ("Trim", (text("Z_um"), text("1.0"), number(1.0)), "BadInvalidArgument"),
    ("Diameter", (ua.Variant([1.0], ua.VariantType.Double),), "BadInvalidArgument"),
    ("Diameter", (ua.Variant(True, ua.VariantType.Boolean),), "BadInvalidArgument"),
    ("Diameter", (ua.Variant(None, ua.VariantType.Null),), "BadInvalidArgument"),
    ("WhoAmI", (number(1.0),), "BadTooManyArguments"),
)


@scene
async def test_arguments_of_another_number_or_type_do_not_reach_the_loop(
    pairs: Pairs,
) -> None:
    box = Box()
    async with served(pairs.settings(), box) as server, pairs.user(server, "engineer") as one:
        for method, arguments, code in UNFIT:
            with pytest.raises(ua.UaStatusCodeError) as caught:
                await call(one, method, *arguments)
            assert ua.StatusCode(caught.value.code).name == code
    assert box.requests == []


@scene
async def test_two_callers_at_the_same_time_keep_their_own_names(pairs: Pairs) -> None:
    box = Box()
    box.gate = asyncio.Event()
    async with (
        served(pairs.settings(), box) as server,
        pairs.user(server, "operator") as one,
        pairs.user(server, "engineer") as other,
    ):
        calls = [
            asyncio.create_task(call(who, method))
            for who, method in ((one, "Hold"), (other, "Resume"))
        ]
        while len(box.requests) < 2:
            await asyncio.sleep(0)
        box.gate.set()
        await asyncio.gather(*calls)
    assert sorted((r.kind, r.who) for r in box.requests) == [
        (RequestKind.HOLD, "operator"),
        (RequestKind.RESUME, "engineer"),
    ]


@scene
async def test_a_loop_that_does_not_answer_is_said_and_does_not_hold_the_caller_for_ever(
    pairs: Pairs, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("thermaxis.runtime.status._server._ANSWER_S", 0.05)

    box = Box()
    box.gate = asyncio.Event()
    async with served(pairs.settings(), box) as server, pairs.user(server, "operator") as one:
        accepted, reason, code, _ = await call(one, "Hold")
        assert (accepted, code) == (False, "no_answer")
        assert "may still take effect" in str(reason)


@scene
async def test_a_role_that_is_taken_away_ends_what_a_running_session_may_do(
    pairs: Pairs, tmp_path: Path
) -> None:
    path = users_file(tmp_path)
    box, events = Box(), list[EventRecord]()
    async with (
        served(pairs.settings(path), box, audit=events) as server,
        pairs.user(server, "operator") as one,
    ):
        assert (await call(one, "Hold"))[0] is True
        known = read_users(path)
        write_users([User(u.name, Role.VIEWER, u.hash) for u in known], path)
        with pytest.raises(ua.UaStatusCodeError):
            await call(one, "Resume")
        assert await call(one, "WhoAmI") == ["operator", "viewer"]
        path.chmod(0o644)
        assert await call(one, "WhoAmI") == ["operator", "none"]
        assert await call(one, "WhoAmI") == ["operator", "none"]
        path.chmod(0o600)
        assert await call(one, "WhoAmI") == ["operator", "viewer"]
    told = [e.text for e in events if e.kind == "alarm"]
    assert len(told) == 2
    assert told[0].startswith("nobody is known: ")
    assert "by others than its owner" in told[0]
    assert told[1] == "the file of users is read again"
    assert [r.kind for r in box.requests] == [RequestKind.HOLD]


# ---- ways in ----------------------------------------------------------------------------------


@scene
async def test_every_policy_that_is_offered_lets_a_user_in(pairs: Pairs) -> None:
    async with served(pairs.settings()) as server:
        for policy in (
            SecurityPolicyBasic256Sha256,
            SecurityPolicyAes128Sha256RsaOaep,
            SecurityPolicyAes256Sha256RsaPss,
        ):
            one = await pairs.log_in(server, "operator", policy=policy)
            assert await call(one, "WhoAmI") == ["operator", "operator"]
            await one.disconnect()


WRONG = (
    ("operator", "wrong password"),
    ("operator", PASSWORD + "x"),
    ("nobody", PASSWORD),
    ("Operator", PASSWORD),
    ("operator\x00", PASSWORD),
    ("\x1b[2J\nforged line", PASSWORD),
    ("x" * 5000, PASSWORD),
    ("engineer", "x" * 5000),
)


def test_a_wrong_name_or_password_is_refused_and_told_to_nobody_but_the_audit(
    pairs: Pairs, caplog: pytest.LogCaptureFixture
) -> None:
    events: list[EventRecord] = []

    async def scene() -> None:
        async with served(pairs.settings(), audit=events) as server:
            for name, password in WRONG:
                with pytest.raises(ua.UaStatusCodeError) as caught:
                    await pairs.log_in(server, name, password)
                assert caught.value.code == ua.StatusCodes.BadUserAccessDenied

    with caplog.at_level("DEBUG"):
        run(scene)
    # the library's client shows the password at this level; the server, and what is ours, must not
    own = "".join(r.getMessage() for r in caplog.records if not r.name.startswith("asyncua.client"))
    assert own
    for event, (name, password) in zip(events, WRONG, strict=True):
        assert event.kind == "connection"
        assert event.text.endswith("was refused by the status server")
        assert event.text.isprintable()
        assert len(event.text) < 120
        assert event.who.startswith(name[:3]) or not name.isprintable()
        assert password not in event.text
        assert password not in own


@scene
async def test_without_a_name_nobody_comes_in_unless_that_is_configured(pairs: Pairs) -> None:
    async with served(pairs.settings()) as server:
        with pytest.raises(ua.UaStatusCodeError):
            await pairs.log_in(server, "")
        with pytest.raises(ua.UaStatusCodeError):
            async with client(server):
                pass


@scene
async def test_an_anonymous_viewer_and_users_live_side_by_side(pairs: Pairs) -> None:
    async with served(pairs.settings(anonymous="viewer")) as server:
        async with client(server) as plain, pairs.user(server, "operator") as named:
            assert await call(plain, "WhoAmI") == ["", "viewer"]
            assert await call(named, "WhoAmI") == ["operator", "operator"]
        hidden = await pairs.log_in(server, "")
        assert await call(hidden, "WhoAmI") == ["", "viewer"]
        await hidden.disconnect()


@scene
async def test_the_server_takes_the_name_in_its_certificate_as_its_own(pairs: Pairs) -> None:
    async with served(pairs.settings()) as server, pairs.user(server, "viewer") as one:
        (own,) = {e.Server.ApplicationUri for e in await one.get_endpoints()}
        assert own == pairs.server.uri
        assert NAMESPACE in await one.get_namespace_array()
        modes = {e.SecurityMode for e in await one.get_endpoints()}
        assert modes == {ua.MessageSecurityMode.SignAndEncrypt}


@scene
async def test_a_pem_certificate_will_do(pairs: Pairs) -> None:
    settings = replace(pairs.settings(), certificate=pairs.server.pem)
    async with served(settings) as server, pairs.user(server, "viewer") as one:
        assert await call(one, "WhoAmI") == ["viewer", "viewer"]


def test_settings_that_would_let_the_wrong_ones_in_are_refused(pairs: Pairs) -> None:
    right = pairs.settings(anonymous="viewer")
    unencrypted: dict[str, Any] = {"certificate": None, "private_key": None}
    for changes, said in (
        ({"address": "0.0.0.0"}, "anonymous_from_outside"),  # noqa: S104 - named, not bound
        ({"address": "192.168.1.7", "users": None}, "users_needed"),
        ({"address": "::", "users": None, **unencrypted}, "users_needed"),
        ({"address": "plant.example", "users": None}, "users_needed"),
        (unencrypted, "certificate_for_users_missing"),
        ({"private_key": None}, "pair_incomplete"),
        ({"users": None, "anonymous_role": "none"}, "nobody_can_connect"),
    ):
        with pytest.raises(ConfigurationError) as caught:
            replace(right, **changes)
        assert caught.value.code == said
    for changes in (
        {"address": "0.0.0.0", "anonymous_role": "none"},  # noqa: S104 - as above
        {"users": None, **unencrypted},
        {"anonymous_role": "none"},
        {"address": "::1"},
        {"address": "localhost"},
    ):
        replace(right, **changes)


def test_only_an_address_of_this_computer_itself_is_its_own() -> None:
    for address in ("127.0.0.1", "127.8.8.8", "::1", "localhost"):
        assert is_loopback(address)
    for address in ("0.0.0.0", "::", "10.0.0.1", "localhost.example", "127.0.0.1.example", ""):  # noqa: S104 - named
        assert not is_loopback(address), address


FORGETTING = """
import asyncio, sys
from tests.unit.runtime.status_server_parts import served, viewers
from thermaxis.runtime.status import forget_standard

async def served_again():
    for _ in range(2):
        async with served(viewers()):
            forget_standard()
            print(sum("standard_address_space_services" in name for name in sys.modules))

asyncio.run(served_again())
"""


@pytest.mark.proof
def test_servers_are_opened_after_what_makes_the_standards_nodes_was_forgotten() -> None:
    words = [sys.executable, "-c", FORGETTING]
    said = subprocess.run(words, capture_output=True, encoding="utf-8", check=True)
    assert said.stdout.split() == ["0", "0"]


@scene
async def test_a_port_that_is_taken_is_said_in_words_and_leaves_nothing_running() -> None:
    async with served(viewers()) as server:
        second = StatusServer(replace(viewers(), port=server.port), Box(), HandClock())
        with pytest.raises(ConfigurationError) as caught:
            await second.open()
        assert caught.value.code == "cannot_listen"
        await second.close()


@scene
async def test_a_server_that_was_closed_can_be_opened_again() -> None:
    server = StatusServer(viewers(), Box(), HandClock())
    for _ in range(2):
        await server.open()
        server.publish(status())
        async with client(server) as one:
            assert (await read(one, "Status/State")).Value.Value == "Active"
        await server.close()
    await server.close()
