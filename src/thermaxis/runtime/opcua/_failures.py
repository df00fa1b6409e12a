"""What a failed connection means, as a code with values."""

import asyncio
import socket
import struct
from collections.abc import AsyncGenerator, Collection, Mapping
from contextlib import asynccontextmanager
from dataclasses import replace
from typing import Final, TypeAlias

from asyncua import ua
from asyncua.crypto.uacrypto import (
    InvalidSignature as WrongSignature,  # pyright: ignore[reportPrivateImportUsage] - its own
)
from asyncua.ua.status_codes import StatusCodes
from cryptography.exceptions import InvalidSignature

from thermaxis.codes import Message, Place, Value
from thermaxis.errors import ConfigurationError, ThermaxisError
from thermaxis.runtime._connection import ConnectionSettings

FAILURES: Final = (
    OSError,
    TimeoutError,
    ua.UaError,
    AssertionError,
    WrongSignature,
    InvalidSignature,
    ThermaxisError,
    ArithmeticError,
    AttributeError,
    LookupError,
    TypeError,
    ValueError,
    struct.error,
)
"""How a connection fails. The first four are how asyncua says so; a wrong key and an answer that
it cannot decode come through as what its code stumbled over; a certificate that cannot be read any
more is an error of the project."""

LASTING: Final = frozenset(
    {
        StatusCodes.BadTooManyOperations,
        StatusCodes.BadRequestTooLarge,
        StatusCodes.BadResponseTooLarge,
        StatusCodes.BadEncodingLimitsExceeded,
        StatusCodes.BadServiceUnsupported,
    }
)
"""Answers that a new connection would not change."""


_TRUST: Final = "certificate_not_trusted"
_OTHER_SERVER: Final = "other_server_certificate"
_EXPIRED: Final = "certificate_not_valid_now"
_NO_POLICY: Final = "security_not_offered"
_FULL: Final = "no_session_left"
_NO_ANSWER: Final = "no_answer_in_time"
_BY_NAME: Final = {
    "BadUserAccessDenied": "user_refused",
    "BadIdentityTokenRejected": "log_in_refused",
    "BadIdentityTokenInvalid": "log_in_way_refused",
    "BadCertificateUriInvalid": "application_uri_refused",
    "BadCertificateUntrusted": _TRUST,
    "BadSecurityChecksFailed": _TRUST,
    "BadCertificateIssuerRevocationUnknown": _TRUST,
    "BadCertificateChainIncomplete": _TRUST,
    "BadCertificateTimeInvalid": _EXPIRED,
    "BadCertificateIssuerTimeInvalid": _EXPIRED,
    "BadCertificateHostNameInvalid": "host_not_in_certificate",
    "BadTcpInternalError": _OTHER_SERVER,
    "BadCertificateInvalid": _OTHER_SERVER,
    "BadTooManySessions": _FULL,
    "BadTcpNotEnoughResources": _FULL,
    "BadTcpServerTooBusy": _FULL,
    "BadSecurityPolicyRejected": _NO_POLICY,
    "BadSecurityModeRejected": _NO_POLICY,
    "BadSecurityModeInsufficient": _NO_POLICY,
    "BadTcpEndpointUrlInvalid": "address_refused",
    "BadTooManyOperations": "too_many_nodes",
    "BadTimeout": _NO_ANSWER,
}
_BY_KIND: Final[Mapping[type[OSError], str]] = {
    TimeoutError: _NO_ANSWER,
    ConnectionRefusedError: "nothing_listens",
    socket.gaierror: "unknown_host",
    ConnectionError: "connection_closed",
}
_SAID: Final[Mapping[str, tuple[str, ...]]] = {
    _TRUST: ("certificate",),
    "user_refused": ("user",),
    "application_uri_refused": ("application_uri",),
    _NO_POLICY: ("security",),
    "address_refused": ("url",),
    _NO_ANSWER: ("timeout_s",),
    "nothing_listens": ("port", "host"),
    "unknown_host": ("host",),
}
"""What a sentence says of the settings, by code."""


def explain(error: BaseException, settings: ConnectionSettings) -> Message:
    """Return what a failure means, at the connection's name."""
    if isinstance(error, ThermaxisError):
        return error.message
    return _message(*_meaning(error), settings)


def refuse(error: BaseException, settings: ConnectionSettings) -> ConfigurationError:
    """Return a failure as an error, for a command that does not try again."""
    if isinstance(error, ConfigurationError):
        return error
    said = _message(*_meaning(error), settings)
    return ConfigurationError.of(replace(said, place=Place(settings.url)))


def _message(code: str, values: Mapping[str, str], settings: ConnectionSettings) -> Message:
    named = {
        "certificate": str(settings.certificate or ""),
        "user": settings.user or "(anonymous)",
        "security": settings.security,
        "application_uri": settings.application_uri,
        "url": settings.url,
        "host": settings.host,
        "port": settings.port,
        "timeout_s": settings.timeout_s,
    }
    every: dict[str, Value] = {name: named[name] for name in _SAID.get(code, ())}
    every |= {name: _masked(text, settings) for name, text in values.items()}
    return Message(f"error-{code}", every, Place(key=settings.name))


def is_ambiguous(error: BaseException) -> bool:
    """Return whether a failure of an encrypted connection may mean several things.

    Some servers close the connection of a client whose certificate or policy they refuse, some
    are silent.
    """
    if isinstance(error, OSError):
        return isinstance(error, TimeoutError | ConnectionError) and not isinstance(
            error, ConnectionRefusedError
        )
    return not isinstance(error, ua.UaStatusCodeError | ThermaxisError)


def explain_offer(
    offered: Mapping[bytes, Collection[str]], pinned: bytes, settings: ConnectionSettings
) -> Message | None:
    """Say what an encrypted connection failed for, by what the server offers."""
    if not any(settings.security in policies for policies in offered.values()):
        return _message(_NO_POLICY, {}, settings)
    return None if pinned in offered else _message(_OTHER_SERVER, {}, settings)


def _masked(text: str, settings: ConnectionSettings) -> str:
    secret = settings.password.reveal()
    return text.replace(secret, "***") if len(secret) > 2 else text


_Meaning: TypeAlias = tuple[str, Mapping[str, str]]
"""A code, and what its sentence says beside the settings."""


def _meaning(error: BaseException) -> _Meaning:
    if isinstance(error, AssertionError) and not error.args:
        return _TRUST, {}
    if isinstance(error, (WrongSignature, InvalidSignature)):
        return _OTHER_SERVER, {}
    if isinstance(error, ua.UaError):
        return _opcua_meaning(error)
    if isinstance(error, OSError):
        return _network_meaning(error)
    return "answer_not_understood", {"kind": type(error).__name__}


def _opcua_meaning(error: ua.UaError) -> _Meaning:
    if isinstance(error, ua.UaStatusCodeError):
        name = ua.StatusCode(ua.UInt32(error.code)).name
        known = _BY_NAME.get(name)
        return (known, {}) if known else ("server_answers", {"status": name})
    text = str(error)
    if "certificate mismatch" in text:
        return _OTHER_SERVER, {}
    if "No matching endpoints" in text or "No matching policy" in text:
        return _NO_POLICY, {}
    return "connection_failed", {"cause": text}


def _network_meaning(error: OSError) -> _Meaning:
    for kind, code in _BY_KIND.items():
        if isinstance(error, kind):
            return code, {}
    return "network_failed", {"cause": error.strerror or type(error).__name__}


@asynccontextmanager
async def within(seconds: float) -> AsyncGenerator[None]:
    """Limit the time of what the library does; raise `TimeoutError` when it is over.

    Where an answer comes at the moment of the limit the library raises a cancellation of its own
    kind, which `asyncio.timeout` takes for that of the whole task.
    """
    async with asyncio.timeout(seconds):
        try:
            yield
        except asyncio.CancelledError as error:
            raise asyncio.CancelledError from error
