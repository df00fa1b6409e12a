"""What an encrypted connection needs of files: read once, and again only when one has changed.

To read and check a private key takes a tenth of a second [run: 0.09 s for RSA 2048], and a
connection is tried twice a second while the server is away: the loop would be late each time.
"""

import asyncio
from pathlib import Path
from typing import NamedTuple, final

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
    """Own certificate."""
    key: rsa.RSAPrivateKey
    """Its key."""
    server: Certificate
    """Stored certificate of the server."""


@final
class PairFiles:
    """Files of a connection, with what was last read from them."""

    def __init__(self, settings: ConnectionSettings) -> None:
        self._settings = settings
        self._stamps: tuple[object, ...] = ()
        self._loaded: LoadedPair | None = None

    def load(self) -> LoadedPair:
        """Return what stands in the files; it is read only if one of them has changed."""
        own_file, key_file, server_file = self._places()
        stamps = tuple(_stamp(path) for path in (own_file, key_file, server_file))
        if self._loaded is not None and stamps == self._stamps:
            return self._loaded
        self._loaded = None
        own, key = certificate_of(own_file), private_key_of(key_file)
        loaded = LoadedPair(own, key, certificate_of(server_file))
        check_own_pair(own, key, self._settings.application_uri, file=str(own_file))
        self._stamps, self._loaded = stamps, loaded
        return loaded

    async def load_aside(self) -> LoadedPair:
        """Do the same as `load`, in a thread where something has to be read."""
        stamps = tuple(_stamp(path) for path in self._places())
        if self._loaded is not None and stamps == self._stamps:
            return self._loaded
        return await asyncio.to_thread(self.load)

    def _places(self) -> tuple[Path, Path, Path]:
        settings = self._settings
        if not (settings.certificate and settings.private_key and settings.server_certificate):
            raise ValueError("the settings let nobody encrypt without certificates")
        return settings.certificate, settings.private_key, settings.server_certificate


def _stamp(path: Path) -> object:
    """Return what changes with a file's content and its permissions; None where there is none."""
    try:
        found = path.stat()
    except OSError:
        return None
    return found.st_mtime_ns, found.st_ctime_ns, found.st_size, found.st_ino, found.st_mode
