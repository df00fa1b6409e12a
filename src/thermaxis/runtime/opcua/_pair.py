"""What an encrypted connection needs of files: read once, and again only when one has changed.

To read and check a private key takes a tenth of a second [run: 0.09 s for RSA 2048], and a
connection is tried twice a second while the server is away: the loop would be late each time.
"""

from functools import lru_cache
from pathlib import Path
from typing import NamedTuple

from cryptography.hazmat.primitives.asymmetric import rsa

from thermaxis.runtime._connection import ConnectionSettings
from thermaxis.runtime.opcua._certificates import (
    Certificate,
    certificate_of,
    check_own_pair,
    private_key_of,
)


class LoadedPair(NamedTuple):
    """Certificates and key of a connection, ready for use."""

    own: Certificate
    key: rsa.RSAPrivateKey
    server: Certificate
    """Stored certificate of the server."""


def load_pair(settings: ConnectionSettings) -> LoadedPair:
    """Return what stands in the files of a connection; it may take a tenth of a second."""
    own, key, server = settings.certificate, settings.private_key, settings.server_certificate
    if own is None or key is None or server is None:
        raise ValueError("the settings let nobody encrypt without certificates")
    stamps = _stamp(own), _stamp(key), _stamp(server)
    return _loaded(own, key, server, settings.application_uri, stamps)


@lru_cache(maxsize=8)
def _loaded(
    own_file: Path, key_file: Path, server_file: Path, application_uri: str, stamps: object
) -> LoadedPair:
    del stamps  # another one is another call
    pair = LoadedPair(
        certificate_of(own_file), private_key_of(key_file), certificate_of(server_file)
    )
    check_own_pair(pair.own, pair.key, application_uri, file=str(own_file))
    return pair


def _stamp(path: Path) -> object:
    """Return what changes with a file's content and its permissions; None where there is none."""
    try:
        found = path.stat()
    except OSError:
        return None
    return found.st_mtime_ns, found.st_ctime_ns, found.st_size, found.st_ino, found.st_mode
