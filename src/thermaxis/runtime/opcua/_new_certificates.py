"""New certificates for OPC UA connections, and files of them."""

import ipaddress
from dataclasses import dataclass
from datetime import datetime, timedelta
from enum import StrEnum
from pathlib import Path
from typing import Final, final

from cryptography import x509
from cryptography.hazmat.primitives import hashes, serialization
from cryptography.hazmat.primitives.asymmetric import rsa
from cryptography.x509.oid import ExtendedKeyUsageOID, NameOID

from thermaxis.errors import ConfigurationError, require_range
from thermaxis.runtime.host import whole_file
from thermaxis.runtime.opcua._certificates import Certificate

DEFAULT_DAYS: Final = 730
"""Validity of a new certificate, unless stated: two years, twice what other OPC UA tools give, so
that a yearly maintenance finds it in time. [day]"""
LONGEST_DAYS: Final = 3650
"""Longest validity: ten years. [day]"""
KEY_BITS: Final = 2048
"""Length of a new RSA key: the shortest that Basic256Sha256 allows, and the one that every control
takes. [bit]"""
_CLOCK_MARGIN = timedelta(days=1)


class CertificateUse(StrEnum):
    """What a new certificate is for."""

    CLIENT = "client"
    """For connections to machines."""
    SERVER = "server"
    """For the status server."""
    BOTH = "both"
    """For both."""


_CLIENT, _SERVER = ExtendedKeyUsageOID.CLIENT_AUTH, ExtendedKeyUsageOID.SERVER_AUTH
_USES: Final = {
    CertificateUse.CLIENT: [_CLIENT],
    CertificateUse.SERVER: [_SERVER],
    CertificateUse.BOTH: [_CLIENT, _SERVER],
}
_KEY_USAGE: Final = x509.KeyUsage(
    digital_signature=True,
    content_commitment=True,
    key_encipherment=True,
    data_encipherment=True,
    key_agreement=False,
    key_cert_sign=False,
    crl_sign=False,
    encipher_only=False,
    decipher_only=False,
)


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class NewCertificate:
    """What a new certificate shall say."""

    application_uri: str
    hosts: tuple[str, ...]
    """Names and addresses of the computer."""
    days: int = DEFAULT_DAYS
    """Validity. [day]"""
    organisation: str = ""
    """Whose it is; may be empty."""
    use: CertificateUse = CertificateUse.CLIENT

    def __post_init__(self) -> None:
        """Check what a certificate cannot say."""
        require_range("days", self.days, 1, LONGEST_DAYS)
        uri = self.application_uri
        if not 1 <= len(uri) <= 200 or not uri.isascii() or not uri.isprintable() or " " in uri:
            raise ConfigurationError("no_application_uri", key="uri")
        for host in self.hosts:
            if not 1 <= len(host) <= 253 or not host.isascii() or not host.isprintable():
                raise ConfigurationError("no_host_name", name=host, key="host")
        if len(self.organisation) > 64:
            raise ConfigurationError(
                "text_too_long", characters=len(self.organisation), most=64, key="organisation"
            )


def make_pair(new: NewCertificate, utc: datetime) -> tuple[bytes, bytes]:
    """Make a key and a certificate that it has signed itself: DER and PEM.

    References
    ----------
    OPC 10000-6, 6.2.2: what an application instance certificate contains.
    """
    key = rsa.generate_private_key(public_exponent=65_537, key_size=KEY_BITS)
    named = {NameOID.COMMON_NAME: "thermaxis", NameOID.ORGANIZATION_NAME: new.organisation}
    name = x509.Name([x509.NameAttribute(oid, text) for oid, text in named.items() if text])
    names = [x509.UniformResourceIdentifier(new.application_uri), *map(_host_name, new.hosts)]
    extensions = (
        x509.BasicConstraints(ca=False, path_length=None),
        x509.SubjectAlternativeName(names),
        _KEY_USAGE,
        x509.ExtendedKeyUsage(_USES[new.use]),
        x509.SubjectKeyIdentifier.from_public_key(key.public_key()),
    )
    builder = (
        x509.CertificateBuilder()
        .subject_name(name)
        .issuer_name(name)
        .public_key(key.public_key())
        .serial_number(x509.random_serial_number())
        .not_valid_before(utc - _CLOCK_MARGIN)
        .not_valid_after(utc + timedelta(days=new.days))
    )
    for extension in extensions:
        builder = builder.add_extension(extension, critical=False)
    pem = key.private_bytes(
        serialization.Encoding.PEM,
        serialization.PrivateFormat.PKCS8,
        serialization.NoEncryption(),
    )
    return builder.sign(key, hashes.SHA256()).public_bytes(serialization.Encoding.DER), pem


def _host_name(host: str) -> x509.GeneralName:
    try:
        return x509.IPAddress(ipaddress.ip_address(host))
    except ValueError:
        return x509.DNSName(host)


def write_pair(
    certificate: Path, key: Path, pair: tuple[bytes, bytes], *, replace: bool = False
) -> None:
    """Write a certificate and its key; the key is never readable by others, not for a moment."""
    if certificate.absolute() == key.absolute():
        raise ConfigurationError("same_file_twice", file=key)
    for path in (certificate, key):
        _refuse_kept(path, replace=replace)
    der, pem = pair
    _write(key, pem, mode=0o600)
    _write(certificate, der, mode=0o644)


def write_certificate(path: Path, certificate: Certificate, *, replace: bool = False) -> None:
    """Write a server's certificate, DER."""
    _refuse_kept(path, replace=replace)
    _write(path, certificate.der, mode=0o644)


def _refuse_kept(path: Path, *, replace: bool) -> None:
    if not replace and (path.exists() or path.is_symlink()):
        raise ConfigurationError("file_kept", file=path)


def _write(path: Path, content: bytes, *, mode: int) -> None:
    """Write a file, and make its folder for its owner alone where there is none."""
    path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
    with whole_file(path, mode=mode) as stream:
        stream.write(content)
