"""Failed log-ins: who is refused for them without a look at the password, and for how long."""

import ipaddress
from typing import Final, NamedTuple, final

from thermaxis.runtime.host import parsed_address

FAILURES_BY_NAME: Final = 5
"""Failures of a name from one address after which it is refused from there for a while, whatever
the password. [1]"""
FAILURES_BY_ADDRESS: Final = 10
"""Failures of all names from one address after which it is refused for a while: a whole shop may
stand behind one, so it is twice what a name may. [1]"""
REFUSED_S: Final = 60.0
"""For how long. [s]"""
PIN_REFUSED_S: Final = 300.0
"""For how long after failures with a PIN. [s]"""
LOCAL_SHARE: Final = 6
"""So many addresses may stand behind this computer's own, where the screen logs people in. [1]"""
IPV6_NETWORK_BITS: Final = 64
"""Addresses of IPv6 are counted by their network of so many bits: one computer may take every
address of it. Origin: RFC 4291, 2.5.1. [1]"""
_MOST_ADDRESSES = 256
_MOST_OF_ADDRESS = 300
_LONGEST_ADDRESS = 64


class Refused(NamedTuple):
    """Why no password is looked at for a while."""

    address: bool
    """Whether the address is refused, or this name from there alone."""
    left_s: float
    """For how long. [s]"""


def counted_as(address: str) -> str:
    """Return under what the failures from an address are counted.

    References
    ----------
    RFC 4291, 2.5.1 (interface identifiers of 64 bits).
    """
    found = parsed_address(address)
    if found is None:
        return address[:_LONGEST_ADDRESS]
    if isinstance(found, ipaddress.IPv4Address):
        return str(found)
    return str(ipaddress.ip_network((found, IPV6_NETWORK_BITS), strict=False))


@final
class LogInThrottle:
    """Counts log-ins that fail, by address, and by name at each address.

    Nobody is refused for what comes from elsewhere: neither a name, whether it exists or not, nor
    everybody. A log-in is counted before its password is looked at, so that many at once are no way
    around. One that succeeds clears its name at its address, not the address, or whoever has an
    account could guess on and on.

    Not protected: whoever shares an address with a guesser waits with the guesser. From many
    addresses a name can be tried five times a minute from each; the passwords must bear that.
    Where the address is empty, which is this computer at the status server, a name alone is
    refused, and later, since the screen stands behind it and counts by the addresses that it sees.

    Parameters
    ----------
    refused_s : float
        For how long failures count. [s]
    local_share : int
        So many addresses may stand behind an empty one. [1]
    """

    def __init__(self, refused_s: float = REFUSED_S, local_share: int = LOCAL_SHARE) -> None:
        self._refused_s, self._local_share = refused_s, local_share
        self._counted: dict[str, list[tuple[float, str]]] = {}

    def refused(self, name: str, address: str, now_s: float) -> Refused | None:
        """Return whether a log-in is refused without a look at its password, and how long."""
        counted = counted_as(address)
        recent = [one for one in self._counted.get(counted, ()) if one[0] > now_s - self._refused_s]
        of_name = [time_s for time_s, other in recent if other == name]
        if counted and len(recent) >= FAILURES_BY_ADDRESS:
            return Refused(
                address=True, left_s=recent[-FAILURES_BY_ADDRESS][0] + self._refused_s - now_s
            )
        most = FAILURES_BY_NAME if counted else self._local_share * FAILURES_BY_NAME
        if len(of_name) >= most:
            return Refused(address=False, left_s=of_name[-most] + self._refused_s - now_s)
        return None

    def count(self, name: str, address: str, now_s: float) -> None:
        """Count a log-in as failed, until it is known."""
        counted = counted_as(address)
        some = self._counted.pop(counted, [])
        self._counted[counted] = [*some, (now_s, name)][-_MOST_OF_ADDRESS:]
        if len(self._counted) > _MOST_ADDRESSES:
            del self._counted[next(iter(self._counted))]

    def succeeded(self, name: str, address: str) -> None:
        """Forget what was counted for a name at an address."""
        some = self._counted.get(counted_as(address), [])
        some[:] = [one for one in some if one[1] != name]

    def take_back(self, name: str, address: str, then_s: float) -> None:
        """Count a log-in no more whose password nobody has looked at."""
        some = self._counted.get(counted_as(address), [])
        if (then_s, name) in some:
            some.remove((then_s, name))
