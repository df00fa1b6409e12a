"""TLS of our own web servers: a certificate, PEM or DER, and its key, PEM, into one context."""

import ssl
import tempfile
from pathlib import Path

from thermaxis.errors import ConfigurationError
from thermaxis.runtime.host._private_files import read_limited, refuse_readable

LARGEST_FILE_BYTES = 1_000_000
"""Largest certificate, with its chain. [byte]"""


def server_context(certificate: Path, private_key: Path) -> ssl.SSLContext:
    """Return the context of a server that speaks TLS 1.2 or later."""
    content = read_limited(certificate, limit_bytes=LARGEST_FILE_BYTES)
    refuse_readable(private_key)
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    context.minimum_version = ssl.TLSVersion.TLSv1_2
    try:
        if b"-----BEGIN" in content:
            context.load_cert_chain(certificate, private_key, password=_no_password)
        else:
            with tempfile.NamedTemporaryFile(suffix=".pem") as pem:  # the library takes PEM only
                pem.write(ssl.DER_cert_to_PEM_cert(content).encode())
                pem.flush()
                context.load_cert_chain(pem.name, private_key, password=_no_password)
    except (OSError, ValueError) as error:
        raise ConfigurationError(
            "pair_unusable", key_file=str(private_key), cause=str(error), file=certificate
        ) from None
    return context


def _no_password() -> bytes:
    """Refuse a locked key; without this the library asks on the terminal."""
    raise ValueError("the key is locked by a password")
