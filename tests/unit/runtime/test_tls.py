"""Certificates of our own web servers: whatever form they have, and whoever can read the key."""

import socket
import ssl
import threading
from pathlib import Path

import pytest
from cryptography.hazmat.primitives import serialization
from cryptography.hazmat.primitives.asymmetric import ec

from tests.refusals import refused
from tests.unit.runtime.status_server_parts import Pair
from thermaxis.errors import ConfigurationError
from thermaxis.runtime.host import server_context


@pytest.fixture(scope="module")
def pair(tmp_path_factory: pytest.TempPathFactory) -> Pair:
    return Pair(tmp_path_factory.mktemp("pair"), "page")


def peer_of(context: ssl.SSLContext) -> bytes:
    """Return the certificate that a client is shown, as DER."""
    trusting = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
    trusting.check_hostname, trusting.verify_mode = False, ssl.CERT_NONE
    with socket.create_server(("127.0.0.1", 0)) as listener:

        def serve() -> None:
            plain, _ = listener.accept()
            with context.wrap_socket(plain, server_side=True) as served:
                served.recv(1)

        thread = threading.Thread(target=serve)
        thread.start()
        with (
            socket.create_connection(listener.getsockname()) as plain,
            trusting.wrap_socket(plain) as client,
        ):
            found = client.getpeercert(binary_form=True)
            client.send(b"x")
        thread.join(10.0)
    assert found is not None
    return found


def test_a_certificate_is_taken_as_der_and_as_pem(pair: Pair) -> None:
    for certificate in (pair.certificate, pair.pem):
        assert peer_of(server_context(certificate, pair.key)) == pair.certificate.read_bytes()


def test_without_room_for_a_copy_pem_is_taken_and_der_is_said_to_be_unusable(
    pair: Pair, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path / "none"))
    assert peer_of(server_context(pair.pem, pair.key)) == pair.certificate.read_bytes()
    with refused("pair_unusable", file=pair.certificate):
        server_context(pair.certificate, pair.key)


def test_old_versions_of_tls_are_not_spoken(pair: Pair) -> None:
    context = server_context(pair.certificate, pair.key)
    assert context.minimum_version >= ssl.TLSVersion.TLSv1_2


def key_file(path: Path, password: bytes = b"", mode: int = 0o600) -> Path:
    """Write the key of another certificate, locked by a password where there is one."""
    locked = serialization.BestAvailableEncryption(password) if password else None
    content = ec.generate_private_key(ec.SECP256R1()).private_bytes(
        serialization.Encoding.PEM,
        serialization.PrivateFormat.PKCS8,
        locked or serialization.NoEncryption(),
    )
    path.write_bytes(content)
    path.chmod(mode)
    return path


def test_a_key_that_cannot_be_used_is_said_in_words(pair: Pair, tmp_path: Path) -> None:
    noise = key_file(tmp_path / "noise.pem")
    noise.write_bytes(b"\x30\x82" + bytes(range(200)))
    for key, code in (
        (key_file(tmp_path / "locked.pem", b"secret"), "pair_unusable"),
        (key_file(tmp_path / "foreign.pem"), "pair_unusable"),
        (key_file(tmp_path / "open.pem", mode=0o644), "file_open_to_others"),
        (noise, "pair_unusable"),
    ):
        with refused(code) as caught:
            server_context(pair.certificate, key)
        assert str(key) in str(caught.value)


def test_a_locked_key_is_never_asked_for_its_password(pair: Pair, tmp_path: Path) -> None:
    with pytest.raises(ConfigurationError, match="locked by a password"):
        server_context(pair.pem, key_file(tmp_path / "key.pem", b"secret"))


def test_what_is_larger_than_any_certificate_is_refused(pair: Pair, tmp_path: Path) -> None:
    large = tmp_path / "large.pem"
    large.write_bytes(pair.pem.read_bytes() + b"\n" * 1_000_000)
    with refused("file_too_long", file=large):
        server_context(large, pair.key)


def test_a_certificate_that_is_none_is_said_in_words(pair: Pair, tmp_path: Path) -> None:
    certificate = tmp_path / "page.crt"
    with refused("file_unreadable"):
        server_context(certificate, pair.key)
    for content in (b"", b"no certificate", b"\x30" * 50):
        certificate.write_bytes(content)
        with refused("pair_unusable", file=certificate):
            server_context(certificate, pair.key)
