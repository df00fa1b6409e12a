"""Certificates of OPC UA connections: read, check, and say when they expire."""

from dataclasses import dataclass, field
from datetime import datetime, timedelta
from pathlib import Path
from typing import Final, final

from cryptography import x509
from cryptography.exceptions import UnsupportedAlgorithm
from cryptography.hazmat.primitives import hashes, serialization
from cryptography.hazmat.primitives.asymmetric import rsa

from thermaxis.codes import Message, Place, printable
from thermaxis.errors import ConfigurationError
from thermaxis.runtime._connection import CERTIFICATE_WARNED_DAYS
from thermaxis.runtime.host import read_limited, read_private

LARGEST_FILE_BYTES: Final = 65_536
"""Largest certificate or key. [byte]"""
_PEM = b"-----BEGIN"


@final
@dataclass(frozen=True, slots=True)
class Certificate:
    """What a certificate says."""

    parsed: x509.Certificate = field(repr=False)
    der: bytes = field(repr=False)
    """The same, DER, without those that may follow it."""
    subject: str
    application_uris: tuple[str, ...]
    hosts: tuple[str, ...]
    """Names and addresses of its computer."""
    not_before: datetime
    """First moment of its validity, aware, in UTC."""
    not_after: datetime
    """Last moment, aware, in UTC."""
    sha256: str
    """Fingerprint: hexadecimal digits in pairs."""
    sha1: str
    """The older fingerprint, which OPC UA and many controls call thumbprint."""

    def days_left(self, utc: datetime) -> float:
        """Return for how long it is still valid; negative once it has expired. [day]"""
        return (self.not_after - utc) / timedelta(days=1)


def certificate_of(path: Path) -> Certificate:
    """Read a certificate."""
    return certificate_from(read_limited(path, limit_bytes=LARGEST_FILE_BYTES), file=str(path))


def certificate_from(content: bytes, *, file: str) -> Certificate:
    """Return what a certificate says."""
    try:
        if content.lstrip().startswith(_PEM):
            parsed = x509.load_pem_x509_certificate(content)
        else:
            parsed = x509.load_der_x509_certificate(_first_of_chain(content))
        return _said_by(parsed)  # decodes its parts only now
    except (ValueError, TypeError, x509.DuplicateExtension, UnsupportedAlgorithm):
        raise ConfigurationError("no_certificate", file=file) from None


def _said_by(parsed: x509.Certificate) -> Certificate:
    try:
        names = parsed.extensions.get_extension_for_class(x509.SubjectAlternativeName).value
    except x509.ExtensionNotFound:
        names = x509.SubjectAlternativeName([])
    hosts = [
        *names.get_values_for_type(x509.DNSName),
        *map(str, names.get_values_for_type(x509.IPAddress)),
    ]
    uris = names.get_values_for_type(x509.UniformResourceIdentifier)
    parsed.public_key()  # decoded only now
    return Certificate(
        parsed=parsed,
        der=parsed.public_bytes(serialization.Encoding.DER),
        subject=printable(parsed.subject.rfc4514_string()),
        application_uris=tuple(map(printable, uris)),
        hosts=tuple(map(printable, hosts)),
        not_before=parsed.not_valid_before_utc,
        not_after=parsed.not_valid_after_utc,
        sha256=_pairs(parsed.fingerprint(hashes.SHA256())),
        sha1=_pairs(parsed.fingerprint(hashes.SHA1())),  # noqa: S303 - as controls show it
    )


def _first_of_chain(content: bytes) -> bytes:
    """Cut a chain after its first certificate, whose length stands in its bytes 2 and 3."""
    if content[:2] != b"\x30\x82" or len(content) < 4:
        return content
    return content[: int.from_bytes(content[2:4], "big") + 4]


def _pairs(digest: bytes) -> str:
    return digest.hex(":").upper()


def private_key_of(path: Path) -> rsa.RSAPrivateKey:
    """Read a private key that nobody but its owner can read."""
    content = read_private(path, limit_bytes=LARGEST_FILE_BYTES)
    try:
        if content.lstrip().startswith(_PEM):
            key = serialization.load_pem_private_key(content, password=None)
        else:
            key = serialization.load_der_private_key(content, password=None)
    except TypeError:
        raise ConfigurationError("key_locked", file=path) from None
    except ValueError:
        key = None
    if not isinstance(key, rsa.RSAPrivateKey):
        raise ConfigurationError("no_rsa_key", file=path)
    return key


def check_own_pair(
    certificate: Certificate, key: rsa.RSAPrivateKey, application_uri: str, *, file: str
) -> None:
    """Check that an own certificate fits its key and the address of the application."""
    if certificate.parsed.public_key() != key.public_key():
        raise ConfigurationError("pair_differs", file=file)
    if application_uri not in certificate.application_uris:
        raise ConfigurationError(
            "application_uri_differs",
            found=certificate.application_uris,
            stated=application_uri,
            file=file,
        )


def validity_warning(certificate: Certificate, utc: datetime, path: Path) -> Message | None:
    """Return what a person should know about the validity of the certificate in a file."""
    days = certificate.days_left(utc)
    if utc < certificate.not_before:
        code, moment = "not_yet_valid", certificate.not_before
    elif days < 0.0:
        code, moment = "expired", certificate.not_after
    elif days < CERTIFICATE_WARNED_DAYS:
        code, moment = "expires", certificate.not_after
    else:
        return None
    values = {"file": path.name, "date": moment.strftime("%Y-%m-%d")}
    return Message(f"event-certificate_{code}", values, Place(str(path)))
