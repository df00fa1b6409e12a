"""A status built by hand, a box that answers, a clock set by hand: for tests of what is served."""

import asyncio
import contextlib
import ipaddress
from collections.abc import AsyncIterator, Awaitable, Callable, Sequence
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Literal

from asyncua import Client, ua
from asyncua.crypto.security_policies import SecurityPolicy, SecurityPolicyBasic256Sha256
from cryptography import x509
from cryptography.hazmat.primitives import hashes, serialization
from cryptography.hazmat.primitives.asymmetric import rsa
from cryptography.x509.oid import NameOID

from thermaxis.codes import Message
from thermaxis.compensation import (
    AnswerCode,
    Compensation,
    CompensationModel,
    CycleOutput,
    Limits,
    Outcome,
    Output,
    Part,
    Quality,
    Reason,
    Request,
    SampleQuality,
    Section,
    SensorRules,
    SupervisorState,
)
from thermaxis.runtime import (
    Alarm,
    EventRecord,
    HistorianStatus,
    RequestOutcome,
    Role,
    RuntimeStatus,
    ServerSettings,
    SourceSample,
    StatusServer,
    User,
    hash_password,
    write_users,
)
from thermaxis.runtime.status import NAMESPACE, AgedOffset, OutputOffsets, facts_of

NOW = datetime(2030, 5, 1, 6, 0, 0, tzinfo=UTC)
ANSWER_S = 40.0
"""How long a client waits for an answer: what a busy machine never needs. [s]"""
PASSWORD = "correct horse battery"  # noqa: S105 - of users that exist in tests only


class HandClock:
    """A clock that stands until it is moved."""

    def __init__(self) -> None:
        self.now_s = 100.0
        self._sleepers: list[tuple[float, asyncio.Future[None]]] = []

    def monotonic_s(self) -> float:
        return self.now_s

    def utc(self) -> datetime:
        return NOW + timedelta(seconds=self.now_s - 100.0)

    async def sleep_until(self, monotonic_s: float) -> None:
        if monotonic_s > self.now_s:
            future = asyncio.get_running_loop().create_future()
            self._sleepers.append((monotonic_s, future))
            await future

    async def move(self, by_s: float) -> None:
        """Move on, and let everything happen that is due."""
        self.now_s += by_s
        for _ in range(600):
            due = [f for at_s, f in self._sleepers if at_s <= self.now_s and not f.done()]
            self._sleepers = [(at_s, f) for at_s, f in self._sleepers if at_s > self.now_s]
            for future in due:
                future.set_result(None)
            await asyncio.sleep(0)


class Box:
    """Takes requests and answers as it is told."""

    def __init__(self) -> None:
        self.requests: list[Request] = []
        self.outcome = RequestOutcome(
            accepted=True, code=AnswerCode.HELD, values={"longest_s": 60.0}
        )
        self.gate: asyncio.Event | None = None

    async def submit(self, request: Request) -> RequestOutcome:
        self.requests.append(request)
        if self.gate is not None:
            await self.gate.wait()
        return self.outcome


def compensation(*outputs: str) -> Compensation:
    """Return a compensation of two channels with two parts for every output."""
    names = outputs or ("Z_um",)
    parts = (
        Part("spindle", "T_spindle_C", "T_column_C", sections=(Section(10.0, 600.0),)),
        Part("column", "T_column_C", sections=(Section(2.0, 3600.0),)),
    )
    model = CompensationModel(outputs=tuple(Output(name, parts) for name in names))
    rules = SensorRules(lowest_c=5.0, highest_c=90.0)
    return Compensation(
        model=model,
        sensors={"T_spindle_C": rules, "T_column_C": rules},
        limits={name: Limits(50.0, 0.5, soft_um=40.0) for name in names},
    )


def output(count: int = 1, **changes: object) -> CycleOutput:
    """Return what an undisturbed cycle says of so many outputs and two channels."""
    told: dict[str, object] = {
        "time_s": 100.0,
        "state": SupervisorState.ACTIVE,
        "since_s": 95.0,
        "reasons": (),
        "correction_um": (-12.5,) * count,
        "wanted_um": (-13.0,) * count,
        "model_um": (13.0,) * count,
        "contribution_um": ((11.0, 2.0),) * count,
        "weight": (1.0,) * count,
        "trim_um": (0.0,) * count,
        "before_um": (-12.0,) * count,
        "elapsed_s": 1.0,
        "at_limit": (False,) * count,
        "values": (31.5, 22.0),
        "qualities": (SampleQuality.GOOD, SampleQuality.GOOD),
        "quality": Quality.GOOD,
        "outcomes": (),
        "answers": (),
    }
    whole = CycleOutput(**told)
    return whole._replace(**changes)


def offsets(*values_um: float | None, age_s: float = 0.1) -> OutputOffsets:
    """Return the commanded, accepted and effective offset, all learned at one time."""
    _, accepted_um, effective_um = values_um
    acting_um = accepted_um if effective_um is None else effective_um
    rows = (AgedOffset(um, None if um is None else age_s) for um in (*values_um, acting_um))
    return OutputOffsets(*rows, tells_effective=effective_um is not None)


def status(*outputs: str, **changes: object) -> RuntimeStatus:
    """Return the status of an undisturbed loop; changes name fields of it."""
    names = outputs or ("Z_um",)
    stamped = NOW - timedelta(milliseconds=250)
    whole = RuntimeStatus(
        machine="vertical lathe",
        started=NOW - timedelta(hours=8),
        utc=NOW,
        number=28_800,
        cycle_s=1.0,
        lateness_s=0.002,
        overruns=3,
        state_since=NOW - timedelta(hours=7),
        enabled=True,
        output=output(len(names)),
        outputs=names,
        channels=("T_spindle_C", "T_column_C"),
        samples={
            "T_spindle_C": SourceSample(31.5, good=True, age_s=0.25, source_time=stamped),
            "T_column_C": SourceSample(22.0, good=True, age_s=0.25, source_time=stamped),
            "interlock.referenced": SourceSample(1.0, good=True, source_time=stamped),
        },
        offsets=dict.fromkeys(names, offsets(-12.5, -12.4, -12.0)),
        source_connected=True,
        sink_connected=True,
        model_file="lathe.json",
        model_sha256="ab" * 32,
        diameter_mm=1500.0,
        historian=HistorianStatus(),
        facts=facts_of(compensation(*names)),
        interlocks={"referenced": True},
        headline=Message("headline-active"),
        headline_since=NOW - timedelta(hours=7),
    )
    return replace(whole, **changes)


def alarm(**changes: object) -> Alarm:
    whole = Alarm(
        key="soft limit Z_um",
        priority="medium",
        since=NOW,
        code="soft_limit",
        values={"name": "Z_um", "correction_um": -45.0, "soft_um": 40.0},
    )
    return replace(whole, **changes)


FAULTY = {
    "output": output(
        state=SupervisorState.FAULT,
        reasons=(Reason.READ_BACK_DIFFERS, Reason.INPUT_BAD),
        outcomes=(Outcome.INPUT_FAILED,),
        quality=Quality.BAD,
        values=(None, 22.0),
        qualities=(SampleQuality.STATUS_BAD, SampleQuality.REDUNDANT),
    )
}


def users_file(folder: Path, *names: str) -> Path:
    """Write a file of users, each with its role as its name and one password for all."""
    known = HASHES.setdefault(PASSWORD, hash_password(PASSWORD))
    path = folder / "users.toml"
    write_users(
        [User(n, Role(n), known) for n in names or ("viewer", "operator", "engineer")], path
    )
    return path


HASHES: dict[str, str] = {}


def viewers() -> ServerSettings:
    """Return settings of a server on which everybody of this computer may look."""
    return ServerSettings("127.0.0.1", 0, None, "viewer", None, None)


@contextlib.asynccontextmanager
async def served(
    settings: ServerSettings,
    box: Box | None = None,
    clock: HandClock | None = None,
    *,
    audit: list[EventRecord] | None = None,
    tokens: Path | None = None,
) -> AsyncIterator[StatusServer]:
    """Run a status server on a free port."""
    events = [] if audit is None else audit
    server = StatusServer(
        settings, box or Box(), clock or HandClock(), audit=events.append, tokens=tokens
    )
    await server.open()
    try:
        yield server
    finally:
        await server.close()


@contextlib.asynccontextmanager
async def client(server: StatusServer) -> AsyncIterator[Client]:
    """Connect without security and without a name."""
    one = Client(server.url, timeout=ANSWER_S)
    await one.connect()
    try:
        yield one
    finally:
        await one.disconnect()


async def node_id(one: Client, path: str) -> ua.NodeId:
    return ua.NodeId(path, await one.get_namespace_index(NAMESPACE))


async def read(one: Client, path: str) -> ua.DataValue:
    """Read a node with its status and time stamps."""
    node = one.get_node(await node_id(one, path))
    return await node.read_data_value(raise_on_bad_status=False)


async def call(one: Client, method: str, *arguments: ua.Variant) -> list[object]:
    parent = one.get_node(await node_id(one, "Requests"))
    answer = await parent.call_method(await node_id(one, f"Requests/{method}"), *arguments)
    return answer if isinstance(answer, list) else [answer]


def run(scene: Callable[[], Awaitable[None]]) -> None:
    """Run a scene in real time, within a bound."""

    async def bounded() -> None:
        async with asyncio.timeout(50.0):  # less than the bound of a test
            await scene()

    asyncio.run(bounded())


def texts(values: Sequence[object]) -> list[str]:
    return [str(value) for value in values]


class Pair:
    """A certificate and its key in files, made once for a test run."""

    def __init__(self, folder: Path, name: str) -> None:
        self.certificate = folder / f"{name}.der"
        self.key = folder / f"{name}.pem"
        self.uri = f"urn:thermaxis:test:{name}"
        key = rsa.generate_private_key(public_exponent=65537, key_size=2048)
        subject = x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, name)])
        now = datetime.now(UTC)
        made = (
            x509.CertificateBuilder()
            .subject_name(subject)
            .issuer_name(subject)
            .public_key(key.public_key())
            .serial_number(x509.random_serial_number())
            .not_valid_before(now - timedelta(days=1))
            .not_valid_after(now + timedelta(days=7300))
            .add_extension(
                x509.SubjectAlternativeName(
                    [
                        x509.UniformResourceIdentifier(self.uri),
                        x509.DNSName("localhost"),
                        x509.IPAddress(ipaddress.ip_address("127.0.0.1")),
                    ]
                ),
                critical=False,
            )
            .sign(key, hashes.SHA256())
        )
        self.certificate.write_bytes(made.public_bytes(serialization.Encoding.DER))
        self.pem = folder / f"{name}.crt.pem"
        self.pem.write_bytes(made.public_bytes(serialization.Encoding.PEM))
        self.key.write_bytes(
            key.private_bytes(
                serialization.Encoding.PEM,
                serialization.PrivateFormat.PKCS8,
                serialization.NoEncryption(),
            )
        )
        self.key.chmod(0o600)


class Pairs:
    """Certificates of a server and a client, and a file of users."""

    def __init__(self, folder: Path) -> None:
        self.server = Pair(folder, "server")
        self.client = Pair(folder, "client")
        self.users = users_file(folder)

    def settings(
        self, users: Path | None = None, anonymous: Literal["none", "viewer"] = "none"
    ) -> ServerSettings:
        return ServerSettings(
            "127.0.0.1",
            0,
            users or self.users,
            anonymous,
            self.server.certificate,
            self.server.key,
        )

    async def log_in(
        self,
        server: StatusServer,
        name: str,
        password: str = PASSWORD,
        policy: type[SecurityPolicy] = SecurityPolicyBasic256Sha256,
        mode: ua.MessageSecurityMode = ua.MessageSecurityMode.SignAndEncrypt,
    ) -> Client:
        """Return a client that is logged in."""
        one = Client(server.url, timeout=ANSWER_S)
        one.application_uri = self.client.uri
        await one.set_security(
            policy,
            str(self.client.certificate),
            str(self.client.key),
            server_certificate=str(self.server.certificate),
            mode=mode,
        )
        if name:
            one.set_user(name)
            one.set_password(password)
        await one.connect()
        return one

    @contextlib.asynccontextmanager
    async def user(
        self, server: StatusServer, name: str, password: str = PASSWORD
    ) -> AsyncIterator[Client]:
        one = await self.log_in(server, name, password)
        try:
            yield one
        finally:
            await one.disconnect()
