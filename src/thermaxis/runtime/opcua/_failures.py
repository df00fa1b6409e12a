"""What a failed connection means, as a code with values."""

import asyncio
import socket
import struct
from collections.abc import AsyncGenerator, Collection, Mapping
from contextlib import asynccontextmanager
from dataclasses import replace
from typing import Final

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


_BY_NAME: Final = {
    "BadUserAccessDenied": "user_refused",
    "BadIdentityTokenRejected": "log_in_refused",
    "BadIdentityTokenInvalid": "log_in_way_refused",
    "BadCertificateUriInvalid": "application_uri_refused",
    "BadCertificateUntrusted": "certificate_not_trusted",
    "BadSecurityChecksFailed": "certificate_not_trusted",
    "BadCertificateIssuerRevocationUnknown": "certificate_not_trusted",
    "BadCertificateChainIncomplete": "certificate_not_trusted",
    "BadCertificateTimeInvalid": "certificate_not_valid_now",
    "BadCertificateIssuerTimeInvalid": "certificate_not_valid_now",
    "BadCertificateHostNameInvalid": "host_not_in_certificate",
    "BadTcpInternalError": "other_server_certificate",
    "BadCertificateInvalid": "other_server_certificate",
    "BadTooManySessions": "no_session_left",
    "BadTcpNotEnoughResources": "no_session_left",
    "BadTcpServerTooBusy": "no_session_left",
    "BadSecurityPolicyRejected": "security_not_offered",
    "BadSecurityModeRejected": "security_not_offered",
    "BadSecurityModeInsufficient": "security_not_offered",
    "BadTcpEndpointUrlInvalid": "address_refused",
    "BadTooManyOperations": "too_many_nodes",
    "BadTimeout": "no_answer_in_time",
}
_BY_KIND: Final[Mapping[type[Exception], str]] = {
    TimeoutError: "no_answer_in_time",
    ConnectionRefusedError: "nothing_listens",
    socket.gaierror: "unknown_host",
    ConnectionError: "connection_closed",
    WrongSignature: "other_server_certificate",
    InvalidSignature: "other_server_certificate",
}
_BY_WORDS: Final = {
    "certificate mismatch": "other_server_certificate",
    "No matching endpoints": "security_not_offered",
    "No matching policy": "security_not_offered",
}
"""What the library's own errors have in their text."""
_SAID: Final[Mapping[str, tuple[str, ...]]] = {
    "certificate_not_trusted": ("certificate",),
    "user_refused": ("user",),
    "application_uri_refused": ("application_uri",),
    "security_not_offered": ("security",),
    "address_refused": ("url",),
    "no_answer_in_time": ("timeout_s",),
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
    return ConfigurationError.of(replace(explain(error, settings), place=Place(settings.url)))


def _message(code: str, values: Mapping[str, str], settings: ConnectionSettings) -> Message:
    every: dict[str, Value] = {}
    for name in _SAID.get(code, ()):
        found: object = getattr(settings, name)
        every[name] = found if isinstance(found, int | float) else str(found or "")
    if "user" in every:
        every["user"] = every["user"] or "(anonymous)"
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
        return _message("security_not_offered", {}, settings)
    return None if pinned in offered else _message("other_server_certificate", {}, settings)


def _masked(text: str, settings: ConnectionSettings) -> str:
    secret = settings.password.reveal()
    return text.replace(secret, "***") if len(secret) > 2 else text


def _meaning(error: BaseException) -> tuple[str, Mapping[str, str]]:
    """Return a code, and what its sentence says beside the settings."""
    if isinstance(error, AssertionError) and not error.args:
        return "certificate_not_trusted", {}
    for kind, code in _BY_KIND.items():
        if isinstance(error, kind):
            return code, {}
    if isinstance(error, ua.UaStatusCodeError):
        name = ua.StatusCode(ua.UInt32(error.code)).name
        return (_BY_NAME[name], {}) if name in _BY_NAME else ("server_answers", {"status": name})
    if isinstance(error, ua.UaError):
        text = str(error)
        known = (code for words, code in _BY_WORDS.items() if words in text)
        code = next(known, "connection_failed")
        return code, {"cause": text} if code == "connection_failed" else {}
    if isinstance(error, OSError):
        return "network_failed", {"cause": error.strerror or type(error).__name__}
    return "answer_not_understood", {"kind": type(error).__name__}


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
