"""What a server offers before anybody trusts it: its certificates and security policies."""

import asyncio
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, final

from asyncua import ua
from asyncua.client.client import Client

from thermaxis.runtime._connection import SECURITIES, ConnectionSettings
from thermaxis.runtime.opcua._certificates import Certificate, certificate_from
from thermaxis.runtime.opcua._failures import FAILURES, refuse, within

MOST_ENDPOINTS = 100
"""More endpoints than this are not looked at. [1]"""


@final
@dataclass(frozen=True, slots=True)
class ServerOffer:
    """One certificate of a server, and for what it offers it."""

    certificate: Certificate
    policies: tuple[str, ...]
    """Policies of `SECURITIES` that it offers with signing and encryption."""
    users: tuple[str, ...]
    """How a client may say who it is: ``anonymous``, ``user and password``, ``certificate``."""


async def fetch_offers(url: str, timeout_s: float) -> tuple[ServerOffer, ...]:
    """Ask a server for its certificates, without encryption and without a user.

    Not protected: whoever stands between can answer in the server's place. The fingerprint must
    be compared with what the machine itself shows.
    """
    settings = ConnectionSettings(name="the server", url=url, security="none", timeout_s=timeout_s)
    client = Client(settings.full_url, timeout=timeout_s)
    try:
        async with within(4.0 * timeout_s):
            endpoints = await client.connect_and_get_server_endpoints()
    except FAILURES as error:
        raise refuse(error, settings) from None
    finally:
        client.disconnect_socket()
        await asyncio.sleep(0)
    return _offers(endpoints[:MOST_ENDPOINTS], url)


def _offers(endpoints: Iterable[Any], url: str) -> tuple[ServerOffer, ...]:
    found: dict[bytes, tuple[Certificate, list[str], list[str]]] = {}
    for endpoint in endpoints:
        content: bytes | None = endpoint.ServerCertificate
        if not content:
            continue
        certificate = certificate_from(content, file=url)
        _, policies, users = found.setdefault(certificate.der, (certificate, [], []))
        uri: str | None = endpoint.SecurityPolicyUri
        policy = (uri or "").rpartition("#")[2]
        encrypts: bool = endpoint.SecurityMode == ua.MessageSecurityMode.SignAndEncrypt
        if encrypts and policy in SECURITIES:
            policies.append(policy)
            users.extend(_users(endpoint))
    offers = [
        ServerOffer(certificate, tuple(dict.fromkeys(policies)), tuple(dict.fromkeys(users)))
        for certificate, policies, users in found.values()
    ]
    return tuple(sorted(offers, key=lambda offer: not offer.policies))


def _users(endpoint: Any) -> list[str]:
    words = {
        ua.UserTokenType.Anonymous: "anonymous",
        ua.UserTokenType.UserName: "user and password",
        ua.UserTokenType.Certificate: "certificate",
    }
    kinds: list[ua.UserTokenType] = [token.TokenType for token in endpoint.UserIdentityTokens or ()]
    return [words[kind] for kind in kinds if kind in words]
