"""Until when the certificates of a configuration are valid, as a loop looks while it runs."""

from collections.abc import Iterator
from contextlib import suppress
from datetime import datetime
from pathlib import Path

from thermaxis.errors import ConfigurationError
from thermaxis.runtime.config._configuration import MachineConfiguration
from thermaxis.runtime.config._tables import tables_of


def certificate_ends(configuration: MachineConfiguration) -> dict[str, datetime]:
    """Return until when every certificate is valid, by its key; without those that none can read.

    They are read now: a file that was renewed while the loop runs counts as it is.
    """
    from thermaxis.runtime.opcua import certificate_of  # noqa: PLC0415 - cryptography is heavy

    ends: dict[str, datetime] = {}
    for key, path in certificates_of(configuration):
        with suppress(ConfigurationError):
            ends[key] = certificate_of(path).not_after
    return ends


def certificates_of(configuration: MachineConfiguration) -> Iterator[tuple[str, Path]]:
    """Yield every certificate, own ones and those of others, with its key."""
    for table, settings in tables_of(configuration):
        for name in ("server_certificate", "certificate", "client_certificate"):
            path: Path | None = getattr(settings, name, None)
            if path is not None:
                yield f"{table}.{name}", path
