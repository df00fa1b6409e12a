"""What a failed connection means and what to do, in words."""

import socket
import struct
from collections.abc import Collection, Mapping
from typing import Final, NamedTuple

from asyncua import ua
from asyncua.crypto.uacrypto import (
    InvalidSignature as WrongSignature,  # pyright: ignore[reportPrivateImportUsage] - its own
)
from asyncua.ua.status_codes import StatusCodes
from cryptography.exceptions import InvalidSignature

from thermaxis.codes import printable
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


class _Words(NamedTuple):
    what: str
    remedy: str


_TRUST = _Words(
    "the server does not trust the own certificate",
    "Trust {certificate} on the machine (it often lies among the rejected ones there), then it"
    " connects by itself",
)
_OTHER_SERVER = _Words(
    "the server answers with another certificate than the stored one",
    "If the machine was really renewed, fetch its certificate with thermaxis certificate fetch and"
    " compare the fingerprint; otherwise somebody stands in between",
)
_USER = _Words(
    "the server refuses user {user}",
    "Check name and password, and the rights of the user on the machine",
)
_EXPIRED = _Words(
    "the server says that a certificate is not valid at this time",
    "Look at the dates with thermaxis certificate show, and at the clocks of both computers",
)
_NO_POLICY = _Words(
    "the server does not offer {security} with signing and encryption",
    "Enable it on the machine, or choose a policy that it offers",
)
_FULL = _Words(
    "the server has no session left",
    "Close other clients, or wait until the sessions of dead ones expire",
)
_BY_NAME: Final = {
    "BadUserAccessDenied": _USER,
    "BadIdentityTokenRejected": _Words(
        "the server refuses the way of logging in",
        "Check name and password; some controls want a certificate from their users",
    ),
    "BadIdentityTokenInvalid": _Words(
        "the server refuses the way of logging in, such as coming without a user",
        "State a user and password with encryption, or allow anonymous access on the machine",
    ),
    "BadCertificateUriInvalid": _Words(
        "the address in the own certificate is not {application_uri}",
        "Set application_uri to the address that thermaxis certificate show prints, or make a new"
        " certificate",
    ),
    "BadCertificateUntrusted": _TRUST,
    "BadSecurityChecksFailed": _TRUST,
    "BadCertificateIssuerRevocationUnknown": _TRUST,
    "BadCertificateChainIncomplete": _TRUST,
    "BadCertificateTimeInvalid": _EXPIRED,
    "BadCertificateIssuerTimeInvalid": _EXPIRED,
    "BadCertificateHostNameInvalid": _Words(
        "the server misses its name or ours in a certificate",
        "Make a new own certificate with --host and the name of this computer",
    ),
    "BadTcpInternalError": _OTHER_SERVER,
    "BadCertificateInvalid": _OTHER_SERVER,
    "BadTooManySessions": _FULL,
    "BadTcpNotEnoughResources": _FULL,
    "BadTcpServerTooBusy": _FULL,
    "BadSecurityPolicyRejected": _NO_POLICY,
    "BadSecurityModeRejected": _NO_POLICY,
    "BadSecurityModeInsufficient": _NO_POLICY,
    "BadTcpEndpointUrlInvalid": _Words(
        "the server does not know the address {url}",
        "Write the address as the machine shows it, path included",
    ),
    "BadTooManyOperations": _Words(
        "the server takes fewer nodes in one request than are asked for",
        "Read fewer nodes, or raise the limit on the machine",
    ),
    "BadTimeout": _Words(
        "no answer within {timeout_s:g} s", "Check whether the server still runs, and the network"
    ),
}


def explain(error: BaseException, settings: ConnectionSettings) -> str:
    """Say what a failure means and what to do."""
    if isinstance(error, ThermaxisError):
        return str(error)
    return _sentence(_words(error), settings)


def refuse(error: BaseException, settings: ConnectionSettings) -> ConfigurationError:
    """Return a failure as an error, for a command that does not try again."""
    if isinstance(error, ConfigurationError):
        return error
    words = _filled(_words(error), settings)
    return ConfigurationError(words.what, where=settings.url, remedy=words.remedy)


def _sentence(words: _Words, settings: ConnectionSettings) -> str:
    what, remedy = _filled(words, settings)
    return printable(f"{settings.name}: {what}. {remedy}.", 500)


def _filled(words: _Words, settings: ConnectionSettings) -> _Words:
    places = {
        "certificate": settings.certificate,
        "user": printable(settings.user) or "(anonymous)",
        "security": settings.security,
        "application_uri": settings.application_uri,
        "url": settings.url,
        "host": settings.host,
        "port": settings.port,
        "timeout_s": settings.timeout_s,
    }
    return _Words(*[_masked(word.format_map(places), settings) for word in words])


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
) -> str:
    """Say what an encrypted connection failed for, by what the server offers."""
    if not any(settings.security in policies for policies in offered.values()):
        return _sentence(_NO_POLICY, settings)
    if pinned not in offered:
        return _sentence(_OTHER_SERVER, settings)
    return ""


def _masked(text: str, settings: ConnectionSettings) -> str:
    secret = settings.password.reveal()
    return text.replace(secret, "***") if len(secret) > 2 else text


def _words(error: BaseException) -> _Words:
    if isinstance(error, AssertionError) and not error.args:
        return _TRUST
    if isinstance(error, (WrongSignature, InvalidSignature)):
        return _OTHER_SERVER
    if isinstance(error, ua.UaError):
        return _opcua_words(error)
    if isinstance(error, OSError):
        return _network_words(error)
    return _Words(
        f"the server's answer is not understood ({type(error).__name__})",
        "Check that the address belongs to an OPC UA server",
    )


def _opcua_words(error: ua.UaError) -> _Words:
    if isinstance(error, ua.UaStatusCodeError):
        name = ua.StatusCode(ua.UInt32(error.code)).name
        remedy = "Look the name up in the control's manual"
        return _BY_NAME.get(name, _Words(f"the server answers {name}", remedy))
    text = _braces(str(error))
    if "certificate mismatch" in text:
        return _OTHER_SERVER
    if "No matching endpoints" in text or "No matching policy" in text:
        return _NO_POLICY
    return _Words(
        f"the connection failed ({text})", "Check that the address belongs to an OPC UA server"
    )


def _braces(text: str) -> str:
    return text.replace("{", "(").replace("}", ")")


def _network_words(error: OSError) -> _Words:
    if isinstance(error, TimeoutError):
        return _BY_NAME["BadTimeout"]
    if isinstance(error, ConnectionRefusedError):
        return _Words(
            "nothing listens on port {port} of {host}",
            "Start the server on the machine, or correct the address",
        )
    if isinstance(error, socket.gaierror):
        return _Words(
            "the name {host} is not known in the network", "Correct the address, or give a number"
        )
    if isinstance(error, ConnectionError):
        return _Words(
            "the server closed the connection",
            "If it stays so, the server may have no connection left, or does not trust the own"
            " certificate",
        )
    return _Words(
        f"the network failed ({_braces(error.strerror or type(error).__name__)})",
        "Check cables, address and firewall",
    )
