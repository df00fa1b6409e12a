"""TLS of our own web servers: certificate and key, PEM or DER, into one context."""

import ssl
import tempfile
from pathlib import Path

from thermaxis.codes import Place
from thermaxis.errors import ConfigurationError
from thermaxis.runtime.host._private_files import read_limited, read_private

LARGEST_FILE_BYTES = 1_000_000
"""Largest certificate, with its chain, and largest key. [byte]"""
_PEM = b"-----BEGIN"


def server_context(certificate: Path, private_key: Path) -> ssl.SSLContext:
    """Return the context of a server that speaks TLS 1.2 or later.

    Not protected: a key or certificate in DER is written as PEM to a file of the temporary folder
    for a moment, as the library reads PEM files only. Nobody else may read that file, but a disk
    or a backup may keep it. Where both are PEM there is no such file.
    """
    content = read_limited(certificate, limit_bytes=LARGEST_FILE_BYTES)
    key = read_private(private_key, limit_bytes=LARGEST_FILE_BYTES)
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    context.minimum_version = ssl.TLSVersion.TLSv1_2
    try:
        if _PEM in content and _PEM in key:
            context.load_cert_chain(certificate, private_key, password=_no_password)
        else:
            _load(context, _as_pem(content), _key_as_pem(key))
    except (ssl.SSLError, ValueError, TypeError) as error:
        raise ConfigurationError(
            "pair_unusable",
            key_file=str(private_key),
            cause=str(error),
            place=Place(str(certificate)),
        ) from None
    return context


def _no_password() -> bytes:
    """Refuse a locked key; without this the library asks on the terminal."""
    raise ValueError("the key is locked by a password")


def _as_pem(content: bytes) -> bytes:
    return content if _PEM in content else ssl.DER_cert_to_PEM_cert(content).encode()


def _key_as_pem(content: bytes) -> bytes:
    """Return a key as PEM; a locked one is a TypeError or ValueError, and no question."""
    from cryptography.hazmat.primitives import serialization  # noqa: PLC0415 - only with TLS

    load = (
        serialization.load_pem_private_key
        if _PEM in content
        else serialization.load_der_private_key
    )
    return load(content, password=None).private_bytes(
        serialization.Encoding.PEM,
        serialization.PrivateFormat.PKCS8,
        serialization.NoEncryption(),
    )


def _load(context: ssl.SSLContext, certificate: bytes, key: bytes) -> None:
    """Load both; the library takes files only, so they are files for a moment, for us alone."""
    with tempfile.TemporaryDirectory() as folder:
        both = Path(folder) / "both.pem"
        both.touch(mode=0o600)
        both.write_bytes(key + b"\n" + certificate)
        context.load_cert_chain(both)
