"""Encryption, users and certificates, against a server that asks for all of them."""

import asyncio
import base64
import hashlib
import logging
import os
import socket
from collections.abc import AsyncIterator, Callable, Iterator
from contextlib import AbstractAsyncContextManager, asynccontextmanager
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import TypeAlias

import pytest
from asyncua import ua
from asyncua.client.client import Client
from asyncua.common.utils import ServiceError
from asyncua.crypto import uacrypto
from asyncua.crypto.uacrypto import check_certificate
from cryptography import x509
from cryptography.hazmat.primitives import serialization
from cryptography.hazmat.primitives.asymmetric import ec

from tests.opcua_server import NAMESPACE, Cable, Machine, OneUser, start_machine, until
from tests.refusals import refused
from thermaxis.errors import ConfigurationError
from thermaxis.messages import LANGUAGES, keys, text_of
from thermaxis.runtime import (
    AWAY,
    CertificateUse,
    ConnectionSettings,
    OpcUaSession,
    Secret,
    SystemClock,
)
from thermaxis.runtime.opcua import (
    DEFAULT_DAYS,
    FAILURES,
    NewCertificate,
    certificate_of,
    check_own_pair,
    explain,
    fetch_offers,
    load_pair,
    make_pair,
    private_key_of,
    validity_warning,
    write_certificate,
    write_pair,
)
from thermaxis.runtime.opcua._certificates import certificate_from
from thermaxis.runtime.opcua._new_certificates import KEY_BITS
from thermaxis.runtime.sinks import OpcUaOutput, OpcUaSink
from thermaxis.runtime.sources import NodeSettings, OpcUaSource

URI = "urn:thermaxis:client"
NODE = f"nsu={NAMESPACE};s="
Connect: TypeAlias = Callable[..., AbstractAsyncContextManager[tuple[OpcUaSession, Cable]]]
USER, PASSWORD = "fitter-Seven", "v3ry-Secret-w0rd"
NOW = datetime.now(UTC)


def pair_in(folder: Path, name: str, **changes: object) -> tuple[Path, Path]:
    """Make a certificate and its key in a folder."""
    utc = changes.pop("utc", NOW)
    wanted = {"application_uri": URI, "hosts": (socket.gethostname(), "127.0.0.1"), **changes}
    certificate, key = folder / f"{name}.der", folder / f"{name}.pem"
    write_pair(certificate, key, make_pair(NewCertificate(**wanted), utc), replace=True)
    return certificate, key


@pytest.fixture(scope="module")
def pki(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("pki")
    pair_in(folder, "own")
    pair_in(folder, "stranger")
    pair_in(folder, "server", application_uri="urn:test:server", use=CertificateUse.BOTH)
    return folder


@pytest.fixture(scope="module")
def machine(runner: asyncio.Runner, pki: Path) -> Iterator[Machine]:
    files = str(pki / "server.der"), str(pki / "server.pem")
    machine = runner.run(start_machine(user=OneUser(USER, PASSWORD), pki=files))
    yield machine
    runner.run(machine.stop())


@pytest.fixture
def connect(machine: Machine, pki: Path) -> Connect:
    """Return what opens a session on a cable, with changed settings."""

    @asynccontextmanager
    async def connected(**changes: object) -> AsyncIterator[tuple[OpcUaSession, Cable]]:
        cable = Cable()
        cable.plug(machine)
        await cable.mend()
        given = {
            "name": "lathe",
            "url": cable.url,
            "security": "Basic256Sha256",
            "user": USER,
            "password": Secret(PASSWORD),
            "certificate": pki / "own.der",
            "private_key": pki / "own.pem",
            "server_certificate": pki / "server.der",
            "timeout_s": 5.0,
            "retry_s": 0.02,
            **changes,
        }
        session = OpcUaSession(ConnectionSettings(**given), SystemClock())
        try:
            await session.open()
            yield session, cable
        finally:
            await session.close()
            await cable.cut()

    return connected


def why(session: OpcUaSession) -> str:
    """Return the code of the last failure; empty where all is well."""
    return "" if session.failure is None else session.failure.code.removeprefix("error-")


async def refused_for(session: OpcUaSession, code: str) -> None:
    """Wait until the connection was refused for a reason."""
    await until(lambda: why(session) == code)
    assert not session.connected


# ---- connections --------------------------------------------------------------------------------


async def test_a_user_reads_and_writes_through_an_encrypted_connection(connect, machine) -> None:
    async with connect() as (session, _):
        await until(lambda: session.connected)
        found = await session.read([NODE + "T1"], 5.0)
        assert found[0].Value.Value == 20.5
        assert await session.write([(NODE + "Offset", 0.25)], 5.0) == ["Good"]
        assert machine.value("Offset") == 0.25


async def test_nothing_on_the_wire_can_be_read(connect, monkeypatch: pytest.MonkeyPatch) -> None:
    sent = bytearray()
    real = asyncio.StreamWriter.write

    def heard(self, data):
        sent.extend(data)
        real(self, data)

    monkeypatch.setattr(asyncio.StreamWriter, "write", heard)

    async with connect() as (session, _):
        await until(lambda: session.connected)
        await session.read([NODE + "T1"], 5.0)
    assert len(sent) > 4000
    assert b"Basic256Sha256" in sent  # what is in the open is seen, so the ear works
    for word in (PASSWORD, USER):
        assert word.encode() not in sent
    # With its length before it, as a string goes over the wire: two letters alone come by chance.
    assert b"\x02\x00\x00\x00T1" not in sent


def test_files_are_read_again_only_when_they_have_changed(
    pki: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    reads: list[Path] = []

    def counted(path: Path) -> object:
        reads.append(path)
        return private_key_of(path)

    monkeypatch.setattr("thermaxis.runtime.opcua._pair.private_key_of", counted)
    for name in ("own.der", "own.pem", "server.der"):
        (tmp_path / name).write_bytes((pki / name).read_bytes())
    key = tmp_path / "own.pem"
    key.chmod(0o600)
    settings = plain_settings(
        security="Basic256Sha256",
        certificate=tmp_path / "own.der",
        private_key=key,
        server_certificate=tmp_path / "server.der",
    )
    first = load_pair(settings)
    assert load_pair(settings) is first
    assert len(reads) == 1
    key.chmod(0o640)
    for _ in range(2):  # a refusal is not remembered as a success
        with refused("file_open_to_others"):
            load_pair(settings)
    key.chmod(0o600)
    (tmp_path / "server.der").write_bytes((pki / "stranger.der").read_bytes())
    changed = load_pair(settings)
    assert changed.server == certificate_of(pki / "stranger.der") != first.server
    (tmp_path / "own.der").unlink()
    with refused("file_unreadable"):
        load_pair(settings)


async def test_a_lost_connection_comes_back_without_parsing_a_key(
    connect, monkeypatch: pytest.MonkeyPatch
) -> None:
    async with connect() as (session, cable):
        await until(lambda: session.connected)
        monkeypatch.setattr("thermaxis.runtime.opcua._pair.private_key_of", None)
        monkeypatch.setattr(uacrypto, "load_private_key", None)
        await cable.cut()
        await until(lambda: not session.connected)
        await cable.mend()
        await until(lambda: session.generation == 2)
        assert await session.write([(NODE + "Offset", 0.5)], 5.0) == ["Good"]


def test_the_library_is_quiet_unless_somebody_has_set_its_level() -> None:
    library = logging.getLogger("asyncua")
    before = library.level
    try:
        for stated, then in ((logging.NOTSET, logging.CRITICAL), (logging.INFO, logging.INFO)):
            library.setLevel(stated)
            OpcUaSession(plain_settings(), SystemClock())
            assert library.level == then
    finally:
        library.setLevel(before)


async def test_no_password_appears_in_any_log(connect, caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level(logging.DEBUG, logger="asyncua")

    async with connect() as (session, _):
        await until(lambda: session.connected)
    assert "Sending" in caplog.text
    assert PASSWORD not in caplog.text
    assert str(PASSWORD.encode()) not in caplog.text


async def test_a_wrong_password_is_said_without_being_repeated(connect, caplog) -> None:
    caplog.set_level(logging.DEBUG, logger="asyncua")

    async with connect(password=Secret("wrong-word")) as (session, _):
        source = OpcUaSource(session, {"s": NodeSettings(node="ns=2;s=s", unit="degC")})
        output = OpcUaOutput(node="ns=2;s=Z", unit="um", sign=AWAY)
        sink = OpcUaSink(session, {"Z_um": output})
        await refused_for(session, "user_refused")
        assert "wrong-word" not in session.last_error + caplog.text
        assert not await sink.found(1.0)
        assert source.failure == sink.failure == session.failure is not None


@pytest.mark.parametrize(
    ("changes", "code"),
    [
        ({"user": "", "password": Secret("")}, "log_in_refused"),
        ({"server_certificate": "stranger.der", "timeout_s": 1.0}, "other_server_certificate"),
        ({"security": "Aes256Sha256RsaPss", "timeout_s": 1.0}, "security_not_offered"),
    ],
)
async def test_a_server_that_wants_another_log_in_certificate_or_policy_is_not_used(
    connect, pki: Path, changes: dict[str, object], code: str
) -> None:
    async with connect(
        **{k: pki / v if v == "stranger.der" else v for k, v in changes.items()}
    ) as (session, _):
        await refused_for(session, code)
        assert session.generation == 0


async def test_an_own_certificate_that_the_machine_does_not_trust_is_said_so_until_it_does(
    connect, machine: Machine
) -> None:
    trusted = False

    async def validate(certificate: object, application: object) -> None:
        if not trusted:
            raise ServiceError(ua.StatusCodes.BadCertificateUntrusted)

    machine.server.set_certificate_validator(validate)
    try:
        async with connect() as (session, _):
            await refused_for(session, "certificate_not_trusted")
            assert "own.der" in session.last_error
            trusted = True
            await until(lambda: session.connected)
            assert why(session) == ""
    finally:
        machine.server.iserver.certificate_validator = None


async def test_a_server_that_lost_its_encryption_gets_no_password(
    started: Machine, connect, monkeypatch: pytest.MonkeyPatch
) -> None:
    logins: list[object] = []
    real = Client.activate_session

    async def seen(self, *arguments, **named):
        logins.append(named)
        return await real(self, *arguments, **named)

    monkeypatch.setattr(Client, "activate_session", seen)

    async with connect(timeout_s=1.0) as (session, cable):
        await until(lambda: session.connected)
        assert len(logins) == 1
        await cable.cut()
        cable.plug(started)  # the same address, without encryption
        await cable.mend()
        await refused_for(session, "security_not_offered")
        assert len(logins) == 1


async def test_a_renewed_own_certificate_is_used_at_the_next_connection(
    connect, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    certificate, key = pair_in(tmp_path, "mine")

    async with connect(certificate=certificate, private_key=key) as (session, cable):
        await until(lambda: session.connected)
        pair_in(tmp_path, "mine", organisation="renewed")
        await cable.cut()
        await until(lambda: not session.connected)
        await cable.mend()
        await until(lambda: session.connected)
        key.chmod(0o644)
        await cable.cut()
        await cable.mend()
        await refused_for(session, "file_open_to_others")


async def test_certificates_and_keys_that_cannot_be_used_refuse_the_start(
    connect, pki: Path
) -> None:
    stranger = pki / "stranger.pem"
    stranger.chmod(0o640)
    for changes, code in (
        ({"application_uri": "urn:other"}, "application_uri_differs"),
        ({"certificate": pki / "stranger.der"}, "pair_differs"),
        ({"certificate": pki / "own.pem"}, "no_certificate"),
        ({"private_key": stranger}, "file_open_to_others"),
        ({"server_certificate": pki / "missing.der"}, "file_unreadable"),
    ):
        with refused(code):
            async with connect(**changes):
                pytest.fail("it was opened")


# ---- failures in words --------------------------------------------------------------------------


def plain_settings(**changes: object) -> ConnectionSettings:
    return ConnectionSettings(
        **{"name": "lathe", "url": "opc.tcp://10.0.0.9:4840", "security": "none", **changes}
    )


FAILED = {
    "nothing_listens": (ConnectionRefusedError(), {"port": 4840, "host": "10.0.0.9"}),
    "connection_closed": (ConnectionResetError(), {}),
    "unknown_host": (socket.gaierror(-2, "x"), {"host": "10.0.0.9"}),
    "network_failed": (OSError(113, "No route to host"), {"cause": "No route to host"}),
    "no_answer_in_time": (TimeoutError(), {"timeout_s": 1.0}),
    "certificate_not_trusted": (AssertionError(), {"certificate": ""}),
    "other_server_certificate": (ua.UaError("Server certificate mismatch"), {}),
    "security_not_offered": (ua.UaError("No matching endpoints: 3"), {"security": "none"}),
    "connection_failed": (ua.UaError("odd {thing}"), {"cause": "odd {thing}"}),
    "answer_not_understood": (ValueError("x"), {"kind": "ValueError"}),
    "no_certificate": (ConfigurationError("no_certificate"), {}),
}
BY_STATUS = {
    "BadUserAccessDenied": ("user_refused", {"user": "(anonymous)"}),
    "BadIdentityTokenInvalid": ("log_in_way_refused", {}),
    "BadIdentityTokenRejected": ("log_in_refused", {}),
    "BadCertificateUriInvalid": (
        "application_uri_refused",
        {"application_uri": "urn:thermaxis:client"},
    ),
    "BadTcpInternalError": ("other_server_certificate", {}),
    "BadTooManySessions": ("no_session_left", {}),
    "BadSecurityChecksFailed": ("certificate_not_trusted", {"certificate": ""}),
    "BadCertificateTimeInvalid": ("certificate_not_valid_now", {}),
    "BadTimeout": ("no_answer_in_time", {"timeout_s": 1.0}),
    "BadShutdown": ("server_answers", {"status": "BadShutdown"}),
}


def test_every_failure_has_a_code_and_a_sentence_in_every_language() -> None:
    cases = [(error, code, values) for code, (error, values) in FAILED.items()]
    for name, (code, values) in BY_STATUS.items():
        cases.append((ua.UaStatusCodeError(getattr(ua.StatusCodes, name)), code, values))
    for error, code, values in cases:
        found = explain(error, plain_settings())
        assert (found.code, dict(found.values)) == (f"error-{code}", values)
        assert text_of(found).isprintable()
        for language in LANGUAGES if isinstance(error, FAILURES[:6]) else ("en",):
            assert {found.code, f"{found.code}.remedy"} <= keys(language), (code, language)
        assert isinstance(error, (*FAILURES, ConfigurationError))


def test_what_a_server_says_is_shown_and_not_obeyed_and_no_secret_is_in_it() -> None:
    settings = plain_settings(
        security="Basic256Sha256",
        user="a\x1b[31m",
        password=Secret(PASSWORD),
        certificate=Path("a"),
        private_key=Path("b"),
        server_certificate=Path("c"),
    )
    said = text_of(explain(ua.UaError(f"\x1b[2J {PASSWORD}"), settings))
    assert "\x1b" not in said
    assert PASSWORD not in said
    said = text_of(explain(ua.UaStatusCodeError(ua.StatusCodes.BadUserAccessDenied), settings))
    assert "\x1b" not in said


# ---- certificates -------------------------------------------------------------------------------


def test_a_new_certificate_says_what_was_asked_for_and_its_key_is_for_its_owner_alone(
    tmp_path: Path,
) -> None:
    before = os.umask(0)
    try:
        certificate, key = pair_in(
            *(tmp_path, "a"),
            application_uri="urn:a:b",
            hosts=("lathe", "10.0.0.9"),
            organisation="Works",
        )
    finally:
        os.umask(before)
    assert key.stat().st_mode & 0o777 == 0o600
    assert certificate.stat().st_mode & 0o777 == 0o644
    assert sorted(p.name for p in tmp_path.iterdir()) == ["a.der", "a.pem"]
    content, found = certificate.read_bytes(), certificate_of(certificate)
    assert found.application_uris == ("urn:a:b",)
    assert found.hosts == ("lathe", "10.0.0.9")
    assert "Works" in found.subject
    assert found.days_left(NOW) == pytest.approx(DEFAULT_DAYS, abs=1e-4)
    assert found.not_before < NOW - timedelta(hours=23)
    assert found.parsed.public_key().key_size == KEY_BITS
    assert found.der == content
    sha1 = hashlib.sha1(content, usedforsecurity=False).hexdigest()
    assert found.sha256.replace(":", "").lower() == hashlib.sha256(content).hexdigest()
    assert found.sha1.replace(":", "").lower() == sha1
    check_own_pair(found, private_key_of(key), "urn:a:b", file="a")


def test_pem_and_chains_are_read_as_their_first_certificate(tmp_path: Path, pki: Path) -> None:
    own, stranger = (pki / "own.der").read_bytes(), (pki / "stranger.der").read_bytes()
    assert certificate_from(own + stranger, file="x").der == own
    text = base64.encodebytes(own).decode()
    pem = f"-----BEGIN CERTIFICATE-----\n{text}-----END CERTIFICATE-----\n".encode()
    assert certificate_from(pem, file="x").der == own
    path = tmp_path / "own.crt"
    path.write_bytes(b"\n" + pem)
    assert certificate_of(path).der == own


def test_what_is_no_certificate_is_refused() -> None:
    for content in (b"", b"0\x82", b"0\x82\x00\x05hello", b"-----BEGIN X", b"a" * 99):
        with refused("no_certificate"):
            certificate_from(content, file="x")


def test_a_damaged_certificate_is_refused_wherever_the_damage_is(pki: Path) -> None:
    content = (pki / "own.der").read_bytes()
    for position in range(0, len(content), 29):
        damaged = bytearray(content)
        damaged[position] ^= 0xFF
        try:
            found = certificate_from(bytes(damaged), file="x")
        except ConfigurationError:
            continue
        assert found.sha256 != certificate_from(content, file="x").sha256


def test_a_file_without_an_end_is_not_read_whole(tmp_path: Path) -> None:
    path = tmp_path / "big.der"
    path.write_bytes(b"0" * 70_000)
    with refused("file_too_long", most_bytes=65_536):
        certificate_of(path)


def test_a_locked_or_foreign_key_is_refused(tmp_path: Path, pki: Path) -> None:
    curve = ec.generate_private_key(ec.SECP256R1())
    kinds = {
        "no_rsa_key": serialization.NoEncryption(),
        "key_locked": serialization.BestAvailableEncryption(b"x"),
    }
    for words, encryption in kinds.items():
        path = tmp_path / "key.pem"
        path.write_bytes(
            curve.private_bytes(
                serialization.Encoding.PEM, serialization.PrivateFormat.PKCS8, encryption
            )
        )
        path.chmod(0o600)
        with refused(words):
            private_key_of(path)


def test_the_end_of_a_certificate_is_warned_of_30_days_before(pki: Path) -> None:
    certificate = certificate_of(pki / "own.der")
    for days, code in (
        (31.0, None),
        (29.5, "expires"),
        (-0.5, "expired"),
        (DEFAULT_DAYS + 2.0, "not_yet_valid"),
    ):
        utc = certificate.not_after - timedelta(days=days)
        warning = validity_warning(certificate, utc, pki / "own.der")
        said = None if warning is None else (warning.code, warning.values["file"])
        assert said == (None if code is None else (f"event-certificate_{code}", "own.der")), days


def test_what_a_certificate_cannot_say_is_refused() -> None:
    for changes, code, key in (
        ({"days": 0}, "outside_range", "days"),
        ({"days": 3651}, "outside_range", "days"),
        ({"application_uri": ""}, "no_application_uri", "uri"),
        ({"application_uri": "urn:a b"}, "no_application_uri", "uri"),
        ({"application_uri": "urn:ä"}, "no_application_uri", "uri"),
        ({"hosts": ("",)}, "no_host_name", "host"),
        ({"hosts": ("a\n",)}, "no_host_name", "host"),
        ({"organisation": "x" * 65}, "text_too_long", "organisation"),
    ):
        with refused(code, key=key):
            NewCertificate(**{"application_uri": URI, "hosts": ("a",), **changes})


def test_nothing_is_overwritten_unless_asked(tmp_path: Path, pki: Path) -> None:
    certificate, key = pair_in(tmp_path, "a")
    before = certificate.read_bytes(), key.read_bytes()
    pair = make_pair(NewCertificate(application_uri=URI, hosts=()), NOW)
    for paths in ((certificate, tmp_path / "b.pem"), (tmp_path / "b.der", key)):
        with refused("file_kept"):
            write_pair(*paths, pair)
    with refused("file_kept"):
        write_certificate(certificate, certificate_of(pki / "own.der"))
    with refused("same_file_twice"):
        write_pair(certificate, certificate, pair, replace=True)
    assert (certificate.read_bytes(), key.read_bytes()) == before
    assert len(list(tmp_path.iterdir())) == 2
    write_pair(certificate, key, pair, replace=True)
    assert certificate.read_bytes() == pair[0]


def test_the_library_takes_our_certificates_for_valid_ones(pki: Path) -> None:
    parsed = x509.load_der_x509_certificate((pki / "own.der").read_bytes())
    assert check_certificate(parsed, URI, socket.gethostname()) is False  # no objection
    usage = parsed.extensions.get_extension_for_class(x509.KeyUsage).value
    assert usage.digital_signature
    assert usage.data_encipherment
    assert not usage.key_cert_sign


# ---- fetching -----------------------------------------------------------------------------------


def test_the_certificate_of_a_server_is_fetched_with_what_it_offers(runner, machine, pki) -> None:
    offers = runner.run(fetch_offers(f"opc.tcp://127.0.0.1:{machine.port}/machine", 5.0))
    assert [offer.certificate for offer in offers] == [certificate_of(pki / "server.der")]
    assert offers[0].policies == ("Basic256Sha256",)
    assert offers[0].users == ("user and password",)


def test_a_server_that_is_not_there_is_said_so(runner: asyncio.Runner) -> None:
    with refused("nothing_listens"):
        runner.run(fetch_offers("opc.tcp://127.0.0.1:1", 1.0))
    with refused("no_opcua_address"):
        runner.run(fetch_offers("127.0.0.1:1", 1.0))


# ---- the page -----------------------------------------------------------------------------------


def test_the_page_names_the_failures_as_they_are_said(root: Path) -> None:
    page = (root / "docs/how-to/opc-ua-security.md").read_text(encoding="utf-8")
    table = page.partition("## When it does not connect")[2].partition("## Not protected")[0]
    rows = [line.split("|")[1].strip() for line in table.splitlines() if line.startswith("| ")]
    codes = [
        *("BadCertificateUntrusted", "BadTcpInternalError", "BadUserAccessDenied"),
        *("BadIdentityTokenInvalid", "BadCertificateUriInvalid", "BadSecurityPolicyRejected"),
        *("BadCertificateTimeInvalid", "BadTooManySessions"),
    ]
    errors = [
        *(ua.UaStatusCodeError(getattr(ua.StatusCodes, code)) for code in codes),
        *(ConnectionRefusedError(), ConnectionResetError(), TimeoutError()),
    ]
    said = [text_of(explain(error, plain_settings())) for error in errors]
    assert [row for row in rows[1:] if not any(row in text for text in said)] == []
    assert [text for text in said if not any(row in text for row in rows)] == []
