"""Failed log-ins at the screen, counted by the address that they came from."""

import ipaddress
from collections import Counter, deque
from collections.abc import Generator
from contextlib import contextmanager
from typing import Final, final

from thermaxis.runtime import FAILURES_IN_ALL, REFUSED_S

FAILURES_BY_ADDRESS: Final = FAILURES_IN_ALL // 3
"""Failures within a minute after which an address is refused for a while. Origin: a whole shop may
stand behind one address, so it is twice what a name may; three addresses must fail together
before everybody is refused. [1]"""
IPV6_NETWORK_BITS: Final = 64
"""Addresses of IPv6 are counted by their network of so many bits: one computer may take every
address of it. Origin: RFC 4291, 2.5.1. [1]"""
_LONGEST_ADDRESS: Final = 64


def counted_as(address: str) -> str:
    """Return under what the failures from an address are counted.

    References
    ----------
    RFC 4291, 2.5.1 (interface identifiers of 64 bits) and 2.5.5.2 (IPv4-mapped addresses).
    """
    try:
        found = ipaddress.ip_address(address.partition("%")[0])
    except ValueError:
        return address[:_LONGEST_ADDRESS]
    if isinstance(found, ipaddress.IPv4Address):
        return str(found)
    if found.ipv4_mapped is not None:
        return str(found.ipv4_mapped)
    return str(ipaddress.ip_network((found, IPV6_NETWORK_BITS), strict=False))


@final
class FailuresByAddress:
    """Gives every address a share of the failures that are allowed to all.

    Without it, one address can use up what everybody may fail in a minute, and nobody else can log
    in. The share is a third: one address leaves two thirds to the others. It is not less, since a
    whole shop may stand behind one address (a proxy, a terminal server, the panel itself), and it
    is no more than that shop's: who is logged in is not touched, and neither are other addresses.
    A log-in that succeeds takes nothing back, or whoever has an account could guess on and on.
    An attempt whose password is being looked at counts as a failure until it is known, or several
    at once would pass the share.

    Only failures of the last minute are kept, each once, and no more than the limit for all with
    what is looked at meanwhile: whatever the number of addresses, the memory is bounded.

    Not protected: three addresses together reach the limit for all, and whoever shares an address
    with a guesser waits with the guesser.
    """

    def __init__(self) -> None:
        self._failures: deque[tuple[float, str]] = deque(maxlen=2 * FAILURES_IN_ALL)
        self._under_way: Counter[str] = Counter()

    def left_s(self, address: str, now_s: float) -> float | None:
        """Return for how long an address is refused."""
        times = self._times(counted_as(address), now_s)
        if len(times) < FAILURES_BY_ADDRESS:
            return None
        return times[-FAILURES_BY_ADDRESS] + REFUSED_S - now_s

    def taken(self, address: str, now_s: float) -> bool:
        """Return whether what an address may still fail is being tried at this moment."""
        counted = counted_as(address)
        failed = len(self._times(counted, now_s))
        return failed + self._under_way[counted] >= FAILURES_BY_ADDRESS

    @contextmanager
    def under_way(self, address: str) -> Generator[None]:
        """Count an attempt while its password is looked at."""
        counted = counted_as(address)
        self._under_way[counted] += 1
        try:
            yield
        finally:
            self._under_way[counted] -= 1
            if not self._under_way[counted]:
                del self._under_way[counted]

    def _times(self, counted: str, now_s: float) -> list[float]:
        """Return when an address has failed in the last minute; forget what is older. [s]"""
        while self._failures and self._failures[0][0] <= now_s - REFUSED_S:
            self._failures.popleft()
        return [time_s for time_s, one in self._failures if one == counted]

    def failed(self, address: str, now_s: float) -> None:
        """Count a failure."""
        self._failures.append((now_s, counted_as(address)))

    def __len__(self) -> int:
        """Return how many failures are kept. [1]"""
        return len(self._failures)
