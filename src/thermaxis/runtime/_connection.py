"""What an OPC UA connection needs to know, and secrets that do not show themselves."""

import hmac
from dataclasses import dataclass
from typing import Annotated, Final, Literal, final, get_args
from urllib.parse import SplitResult, urlsplit

from pydantic import Field

from thermaxis.codes import Place
from thermaxis.errors import ConfigurationError, require_range
from thermaxis.runtime._keys import FileName, Hidden, Own, Text

Security = Literal["none", "Basic256Sha256", "Aes128Sha256RsaOaep", "Aes256Sha256RsaPss"]
SECURITIES: Final[tuple[str, ...]] = get_args(Security)
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

    name: Own[str] = ""
    """Name of the connection, for messages."""
    url: Annotated[str, Field(max_length=1000)]
    """Address of the server, `opc.tcp://host:4840/path`, without a user."""
    security: Security
    """`none`, `Basic256Sha256`, `Aes128Sha256RsaOaep` or `Aes256Sha256RsaPss`; all but `none` sign
    and encrypt every message. Default: nobody goes without encryption by mistake."""
    user: Annotated[str, Field(max_length=200)] = ""
    """User name; only with encryption. Without it: anonymous."""
    password: Hidden[Secret] = Secret("")  # noqa: RUF009 - it cannot change
    """Password of the user. It is never sent without encryption."""
    password_file: FileName = None
    """File whose first line is the password."""
    password_environment: Text = ""
    """Environment variable that holds it."""
    certificate: FileName = None
    """Own certificate, DER or PEM; required with encryption."""
    private_key: FileName = None
    """Its key; mode 0600; required with encryption."""
    server_certificate: FileName = None
    """The server's certificate: no other is accepted, as one that is fetched unseen proves
    nothing; required with encryption."""
    application_uri: Annotated[str, Field(min_length=1, max_length=500)] = "urn:thermaxis:client"
    """Must equal the address in the own certificate, else the server answers
    BadCertificateUriInvalid [run]. Default: what `thermaxis certificate new` writes."""
    timeout_s: Annotated[float, Field(ge=0.05, le=60.0)] = 1.0
    """Longest time of one request, 0.05 to 60. Default: 400 times the measured 2.4 ms of a write
    [run]. [s]"""
    retry_s: Annotated[float, Field(ge=0.1, le=60.0)] = 0.5
    """Pause before a lost connection is tried again, 0.1 to 60. Default: a server that returned
    was read again after 0.1 to 0.5 s [run]. [s]"""

    def __post_init__(self) -> None:
        """Check what contradicts itself."""
        self._check_url()
        self._check_security()
        for name in ("timeout_s", "retry_s"):
            key = self._at(name).key
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

    def _at(self, key: str = "") -> Place:
        table = f"connection.{self.name}" if self.name else ""
        return Place(key=f"{table}.{key}".strip("."))

    def _check_url(self) -> None:
        try:
            parts = urlsplit(self.url)
            known = parts.scheme == "opc.tcp" and bool(parts.hostname) and parts.port != 0
        except ValueError:
            raise self._no_address() from None
        if parts.username is not None or parts.password is not None:
            raise ConfigurationError("user_in_address", place=self._at())
        if not known or not self.url.isprintable() or " " in self.url:
            raise self._no_address()

    def _no_address(self) -> ConfigurationError:
        return ConfigurationError("no_opcua_address", place=self._at())

    def _check_security(self) -> None:
        if self.security not in SECURITIES:
            raise ConfigurationError(
                "unknown_choice", name=self.security, known=SECURITIES, place=self._at()
            )
        named = self.password_file is not None or bool(self.password_environment)
        if self.password_file is not None and self.password_environment:
            place = self._at("password_environment")
            raise ConfigurationError("stated_twice", name="password", place=place)
        if self.user and not (self.password or named):
            raise ConfigurationError("user_needs_password", place=self._at("user"))
        if not self.user and (self.password or named):
            raise ConfigurationError("password_without_user", place=self._at())
        if not self.encrypted and self.user:
            raise ConfigurationError("user_unencrypted", place=self._at())
        for key in ("certificate", "private_key", "server_certificate"):
            stated = getattr(self, key) is not None
            if self.encrypted and not stated:
                raise ConfigurationError("certificate_missing", name=key, place=self._at())
            if stated and not self.encrypted:
                raise ConfigurationError("certificate_unused", place=self._at(key))
