"""The virtual lathe's OPC UA server, with a real client on this computer."""

import asyncio
import itertools
import math
from collections.abc import Awaitable, Callable
from contextlib import suppress
from datetime import timedelta
from pathlib import Path
from typing import Any
from unittest.mock import Mock
from urllib.parse import urlsplit

import pytest
from asyncua import Client, ua
from asyncua.crypto.cert_gen import setup_self_signed_certificate
from asyncua.crypto.security_policies import SecurityPolicyBasic256Sha256
from cryptography.x509.oid import ExtendedKeyUsageOID

from tests.refusals import refused
from thermaxis.errors import ConfigurationError
from thermaxis.runtime import Secret, VirtualClock, run_in_virtual_time
from thermaxis.virtual import (
    FAULTY,
    SIGNALS,
    LatheServer,
    LatheServerSettings,
    VirtualLathe,
    parse_fault,
)
from thermaxis.virtual.lathe._server import APPLICATION, NAMESPACE, unit_of

SPEED = 60.0


async def served(lathe: VirtualLathe, work: Callable[[str], Awaitable[None]], **more: Any) -> None:
    """Serve a lathe on a free port while something is done with it, in virtual time."""
    clock = more.pop("clock", None) or VirtualClock()
    settings = LatheServerSettings(port=0, speed=SPEED, **more)
    started: asyncio.Future[str] = asyncio.get_running_loop().create_future()
    serving = asyncio.create_task(LatheServer(lathe, settings, clock).run(started))
    try:
        await asyncio.wait({serving, started}, return_when=asyncio.FIRST_COMPLETED)
        if serving.done():
            await serving
        await work(started.result())
    finally:
        serving.cancel()
        with suppress(asyncio.CancelledError):
            await serving


def test_another_speed_goes_on_from_the_machines_time() -> None:
    async def live() -> None:
        clock, lathe = VirtualClock(), lathe_with()
        server = LatheServer(lathe, LatheServerSettings(port=0), clock)
        serving = asyncio.create_task(server.run())
        for speed, until_s in ((1.0, 10.0), (60.0, 610.0), (1.0, 620.0)):
            server.set_speed(speed)
            await clock.sleep_until(clock.monotonic_s() + 10.0)
            assert lathe.time_s == pytest.approx(until_s, abs=0.2 * SPEED)
        with pytest.raises(ConfigurationError):
            server.set_speed(0.0)
        serving.cancel()
        with suppress(asyncio.CancelledError):
            await serving

    run_in_virtual_time(live())


def lathe_with(*sentences: str) -> VirtualLathe:
    return VirtualLathe(
        "calibration-spindle", 1, faults=[parse_fault(s, FAULTY) for s in sentences]
    )


async def index_of(client: Client) -> int:
    return await client.get_namespace_index(NAMESPACE)


async def every_signal(url: str) -> None:
    async with Client(url) as client:
        index = await index_of(client)
        nodes = {n: client.get_node(ua.NodeId(n, index)) for n in SIGNALS}
        await asyncio.sleep(0.5)
        found = dict(
            zip(
                nodes,
                await client.read_attributes(list(nodes.values()), ua.AttributeIds.Value),
                strict=True,
            )
        )
        assert found["T_column_C"].Value.Value == 0.0
        assert found["T_column_C"].StatusCode.name == "BadSensorFailure"
        assert math.isnan(found["T_bed_C"].Value.Value)
        assert found["T_bed_C"].StatusCode.is_good()
        assert found["T_hall_C"].Value.Value is None
        assert found["T_hall_C"].StatusCode.name == "BadNoCommunication"
        fresh = found["T_spindle_C"]
        late = fresh.SourceTimestamp - found["T_table_C"].SourceTimestamp
        machine_s = found["time_s"].Value.Value
        assert machine_s > 20.0
        assert late.total_seconds() == pytest.approx((machine_s - 10.0) / SPEED, abs=0.01)
        assert abs(fresh.ServerTimestamp - fresh.SourceTimestamp) < timedelta(seconds=0.1)
        kinds = {"bool": ua.VariantType.Boolean, "1": ua.VariantType.UInt32}
        for name, signal in SIGNALS.items():
            expected = kinds.get(signal.unit, ua.VariantType.Double)
            assert await nodes[name].read_data_type_as_variant_type() == expected, name
            if found[name].Value.Value is not None:
                assert found[name].Value.VariantType == expected
            level = await nodes[name].get_user_access_level()
            assert (ua.AccessLevel.CurrentWrite in level) is signal.writable
        text = (await nodes["T_spindle_C"].read_description()).Text
        assert text == SIGNALS["T_spindle_C"].text
        units = await (await nodes["Z_um"].get_child("0:EngineeringUnits")).read_value()
        assert units == unit_of("um")


async def offset(url: str) -> None:
    async with Client(url) as client:
        index = await index_of(client)

        def node(name: str) -> object:
            return client.get_node(ua.NodeId(name, index))

        for beat in range(1, 9):
            codes = await client.write_values(
                [node("offset_mm"), node("heartbeat")],
                [
                    ua.DataValue(ua.Variant(-0.03, ua.VariantType.Double)),
                    ua.DataValue(ua.Variant(beat, ua.VariantType.UInt32)),
                ],
                raise_on_partial_error=False,
            )
            assert all(code.is_good() for code in codes)
            # what is accepted is there in the very next read
            assert await node("offset_accepted_mm").read_value() == pytest.approx(-0.03)
            await asyncio.sleep(0.1)
        assert await node("watchdog_alive").read_value()
        assert await node("offset_effective_mm").read_value() == pytest.approx(-0.03)
        true = await node("Z_true_um").read_value()
        drifted = await node("Z_uncorrected_um").read_value()
        assert true - drifted == pytest.approx(-30.0, abs=0.5)

        with pytest.raises(ua.UaStatusCodeError, match="type"):
            await node("offset_mm").write_value(ua.Variant(1, ua.VariantType.Int64))
        with pytest.raises(ua.UaStatusCodeError, match="type"):
            await node("offset_mm").write_value(ua.Variant(1.0, ua.VariantType.Float))
        await node("offset_mm").write_value(math.nan)  # accepted as Good, and not taken
        assert await node("offset_mm").read_value() == -0.03
        with pytest.raises(ua.UaStatusCodeError):
            await node("T_spindle_C").write_value(20.0)
        await node("diameter_mm").write_value(1500.0)
        assert await node("diameter_mm").read_value() == 1500.0
        await node("touch_asked").write_value(True)
        assert await node("touch_count").read_value() == 1
        value, count = [await node(n).read_data_value() for n in ("touch_um", "touch_count")]
        assert value.Value.Value == pytest.approx(await node("Z_true_um").read_value(), abs=5.0)
        assert value.SourceTimestamp == count.SourceTimestamp


def test_signals_have_type_unit_status_and_stamps_and_a_written_offset_moves_the_tool() -> None:
    """A client finds every signal; an offset with a moving heartbeat is reported."""
    lathe = lathe_with("bad T_column", "nan T_bed", "missing T_hall", "stale T_table at 10s")

    async def work(url: str) -> None:
        await every_signal(url)
        await offset(url)
        assert lathe.diameter_mm == 1500.0

    run_in_virtual_time(served(lathe, work))


class Told:
    """Remembers what a subscription brought."""

    def __init__(self) -> None:
        self.values: list[float] = []

    def datachange_notification(self, node: object, val: float, data: object) -> None:
        self.values.append(val)


def test_subscribers_are_told_and_a_restart_and_a_pause_are_felt() -> None:
    """At 60 times real time: gone for half a second, then silent for half a second."""
    lathe = lathe_with("restart at 72s for 30s", "pause at 150s for 30s")

    async def work(url: str) -> None:
        async with Client(url) as client:
            index = await index_of(client)
            told = Told()
            subscription = await client.create_subscription(50, told)
            await subscription.subscribe_data_change(client.get_node(ua.NodeId("time_s", index)))
            others = await client.create_subscription(50, Told())
            names = ("T_spindle_C", "offset_mm", "diameter_mm", "heartbeat")
            await others.subscribe_data_change(
                [client.get_node(ua.NodeId(name, index)) for name in names]
            )
            await asyncio.sleep(0.6)
            assert len(told.values) >= 3
            assert told.values == sorted(told.values)
            assert (lathe.diameter_mm, lathe.axis.written_mm, lathe.axis.heartbeat) == (0.0, 0.0, 0)
            await until(lambda: not lathe.reachable)
            await asyncio.sleep(0.15)
            with pytest.raises(OSError, match=r"[Cc]onnect"):
                await asyncio.open_connection("127.0.0.1", urlsplit(url).port)
            with pytest.raises((ConnectionError, ua.UaError, TimeoutError)):
                await client.get_node(ua.NodeId("time_s", index)).read_value()
            with suppress(ConnectionError, ua.UaError, TimeoutError):
                await client.disconnect()
        await until(lambda: lathe.reachable)
        await asyncio.sleep(0.15)
        async with Client(url) as client:
            node = client.get_node(ua.NodeId("time_s", await index_of(client)))
            assert await node.read_value() > 100.0
            await until(lambda: not lathe.reachable)
            await asyncio.sleep(0.15)
            begin = asyncio.get_running_loop().time()
            assert await node.read_value() > 175.0  # answered when the network moves again
            assert asyncio.get_running_loop().time() - begin > 0.1

    async def until(met: Callable[[], bool]) -> None:
        async with asyncio.timeout(30.0):
            while not met():
                await asyncio.sleep(0.01)

    run_in_virtual_time(served(lathe, work))


def test_a_touch_is_stamped_once_however_late_the_time_of_day_is_read() -> None:
    lathe = lathe_with()
    clock, late_us = VirtualClock(), itertools.cycle((28, 3, 60))
    slow = Mock(wraps=clock)
    slow.utc = lambda: clock.utc() + timedelta(microseconds=next(late_us))

    async def work(url: str) -> None:
        stamps: list[list[object]] = []
        async with Client(url) as client:
            index = await index_of(client)
            names = ("touch_um", "touch_count", "T_spindle_C")
            nodes = [client.get_node(ua.NodeId(name, index)) for name in names]
            for _ in range(20):
                await asyncio.sleep(0.137)
                read = await client.read_attributes(nodes, ua.AttributeIds.Value)
                stamps.append([one.SourceTimestamp for one in read])
        assert [len(set(one)) for one in zip(*stamps, strict=True)] == [1, 1, 20]

    run_in_virtual_time(served(lathe, work, clock=slow))


def test_a_machine_that_has_lived_before_goes_on_from_its_time() -> None:
    lathe = lathe_with()
    lathe.step(7200.0)

    async def work(url: str) -> None:
        async with Client(url) as client:
            node = client.get_node(ua.NodeId("time_s", await index_of(client)))
            await asyncio.sleep(1.0)
            assert await node.read_value() == pytest.approx(7200.0 + SPEED, abs=0.5 * SPEED)

    run_in_virtual_time(served(lathe, work))


def test_with_a_certificate_only_its_user_is_let_in_and_everything_is_encrypted(
    tmp_path: Path,
) -> None:
    paths = {}

    async def certify(name: str, uri: str, purpose: ExtendedKeyUsageOID) -> None:
        key, certificate = tmp_path / f"{name}.pem", tmp_path / f"{name}.der"
        paths[name] = (certificate, key)
        await setup_self_signed_certificate(
            key, certificate, uri, "localhost", [purpose], {"commonName": name}
        )

    async def connect(url: str, name: str, password: str, *, encrypted: bool = True) -> float:
        client = Client(url)
        client.application_uri = "urn:client"
        if name:
            client.set_user(name)
            client.set_password(password)
        if encrypted:
            certificate, key = paths["client"]
            await client.set_security(SecurityPolicyBasic256Sha256, certificate, key)
        async with client:
            node = client.get_node(ua.NodeId("T_spindle_C", await index_of(client)))
            return await node.read_value()

    async def work(url: str) -> None:
        assert 15.0 < await connect(url, "anna", "right") < 45.0
        for name, password, encrypted in (
            ("anna", "wrong", True),
            ("otto", "right", True),
            ("", "", True),
            ("anna", "right", False),
        ):
            with pytest.raises((ua.UaError, ConnectionError)):
                await connect(url, name, password, encrypted=encrypted)

    async def run() -> None:
        await certify("server", APPLICATION, ExtendedKeyUsageOID.SERVER_AUTH)
        await certify("client", "urn:client", ExtendedKeyUsageOID.CLIENT_AUTH)
        certificate, key = paths["server"]
        more = {"certificate": certificate, "private_key": key}
        await served(lathe_with(), work, user="anna", password=Secret("right"), **more)

    run_in_virtual_time(run())


def test_the_number_of_a_unit_is_its_code_read_as_bytes() -> None:
    """°C is CEL: 4408652 in the list of OPC UA."""
    units = unit_of("degC")
    assert units is not None
    assert units.UnitId == 4408652
    assert unit_of("bool") is None


def test_without_encryption_no_password_goes_out_and_nobody_elsewhere_is_served() -> None:
    for wrong, code in (
        ({"speed": math.inf}, "not_positive_up_to"),
        ({"address": "0.0.0.0"}, "other_computer"),  # noqa: S104 - refused
        ({"address": "lathe.plant.example"}, "other_computer"),
        ({"certificate": Path("a")}, "certificate_without_key"),
        ({"user": "anna"}, "user_without_password"),
        ({"user": "anna", "password": Secret("x")}, "password_unencrypted"),
    ):
        with refused(code):
            LatheServerSettings(**wrong)
