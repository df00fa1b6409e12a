"""What an OPC UA connection needs to know, and secrets that do not show themselves."""

import hmac
from dataclasses import dataclass
from pathlib import Path
from typing import Final, final
from urllib.parse import SplitResult, urlsplit

from thermaxis.codes import Place
from thermaxis.errors import ConfigurationError, require_range

SECURITIES: Final = ("none", "Basic256Sha256", "Aes128Sha256RsaOaep", "Aes256Sha256RsaPss")
"""Security policies that are offered; all but ``none`` sign and encrypt every message. The older
Basic128Rsa15 and Basic256 are withdrawn and never used."""
CERTIFICATE_WARNED_DAYS: Final = 30
"""The end of a certificate is told so early. [d]"""
DEFAULT_PORT: Final = 4840
"""Port of an address that names none, as registered for opc.tcp. [1]"""
SHORTEST_TIMEOUT_S: Final = 0.01
"""Shortest time of a request. [s]"""
LONGEST_TIMEOUT_S: Final = 60.0
"""Longest time that a request may be given. [s]"""


@final
class Secret:
    """A text that is never shown: in messages, logs and tracebacks it is three stars.

    Parameters
    ----------
    text : str
        The secret.
    """

    __slots__ = ("_text",)

    def __init__(self, text: str) -> None:
        self._text = text

    def reveal(self) -> str:
        """Return the secret itself, for the one place that sends it."""
        return self._text

    def __bool__(self) -> bool:
        return bool(self._text)

    def __repr__(self) -> str:
        return "Secret('***')" if self._text else "Secret('')"

    def __str__(self) -> str:
        return "***" if self._text else ""

    def __format__(self, format_spec: str) -> str:
        return format(str(self), format_spec)

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Secret):
            return NotImplemented
        return hmac.compare_digest(self._text.encode(), other._text.encode())

    def __hash__(self) -> int:
        return hash((Secret, self._text))

    def __reduce__(self) -> str | tuple[object, ...]:
        raise TypeError("a secret is not stored")


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class ConnectionSettings:
    """One OPC UA connection.

    Raises
    ------
    ConfigurationError
        If the address is none, contains a user, or its path is no plain text; if the security
        policy is not offered; if a user is stated without encryption, a password without a user,
        or encryption without certificates; if a time is out of its range.
    """

    name: str
    """Name of the connection, for messages."""
    url: str
    """Where the server is, such as ``opc.tcp://192.168.214.241:4840``."""
    security: str
    """``none``, or the policy by which every message is signed and encrypted: see `SECURITIES`."""
    user: str = ""
    """User name; empty: anonymous."""
    password: Secret = Secret("")  # noqa: RUF009 - it cannot change
    """Password of the user. It is never sent without encryption."""
    certificate: Path | None = None
    """Own certificate, DER or PEM."""
    private_key: Path | None = None
    """Its private key, PEM or DER, readable by its owner only."""
    server_certificate: Path | None = None
    """The server's certificate, DER or PEM: no other is accepted."""
    application_uri: str = "urn:thermaxis:client"
    """Must equal the address in the own certificate. Default: what ``thermaxis certificate new``
    puts there."""
    timeout_s: float = 1.0
    """Longest time of a request. Default: 400 times the measured 2.4 ms of a write. [s]"""
    retry_s: float = 0.5
    """Shortest time between two attempts to connect. Default: a server that returned was read
    again after 0.1 to 0.5 s. [s]"""

    def __post_init__(self) -> None:
        """Check what contradicts itself."""
        self._check_url()
        self._check_security()
        for name in ("timeout_s", "retry_s"):
            key = f"{self._place.key}.{name}"
            require_range(key, getattr(self, name), SHORTEST_TIMEOUT_S, LONGEST_TIMEOUT_S)

    @property
    def encrypted(self) -> bool:
        """Whether every message is signed and encrypted."""
        return self.security != "none"

    @property
    def host(self) -> str:
        """Name or address of the server's computer."""
        return urlsplit(self.url).hostname or ""

    @property
    def port(self) -> int:
        """Port of the server. [1]"""
        return urlsplit(self.url).port or DEFAULT_PORT

    @property
    def full_url(self) -> str:
        """The address with its port."""
        parts = urlsplit(self.url)
        if parts.port is not None:
            return self.url
        host = f"[{self.host}]" if ":" in self.host else self.host
        return SplitResult(parts.scheme, f"{host}:{DEFAULT_PORT}", parts.path, "", "").geturl()

    @property
    def _place(self) -> Place:
        return Place(key=f"connection.{self.name}")

    def _check_url(self) -> None:
        try:
            parts = urlsplit(self.url)
            known = parts.scheme == "opc.tcp" and bool(parts.hostname) and parts.port != 0
        except ValueError:
            raise self._no_address() from None
        if parts.username is not None or parts.password is not None:
            raise ConfigurationError("user_in_address", place=self._place)
        if not known or not self.url.isprintable() or " " in self.url:
            raise self._no_address()

    def _no_address(self) -> ConfigurationError:
        return ConfigurationError("no_opcua_address", place=self._place)

    def _check_security(self) -> None:
        if self.security not in SECURITIES:
            raise ConfigurationError(
                "unknown_choice", name=self.security, known=SECURITIES, place=self._place
            )
        if self.password and not self.user:
            raise ConfigurationError("password_without_user", place=self._place)
        if not self.encrypted and self.user:
            raise ConfigurationError("user_unencrypted", place=self._place)
        for key in ("certificate", "private_key", "server_certificate"):
            if self.encrypted and getattr(self, key) is None:
                raise ConfigurationError("certificate_missing", name=key, place=self._place)
