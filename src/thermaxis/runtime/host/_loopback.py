"""Which addresses are reached from this computer only."""

import ipaddress


def is_loopback(address: str) -> bool:
    """Return whether an address is reached from this computer only."""
    if address == "localhost":
        return True
    try:
        return ipaddress.ip_address(address).is_loopback
    except ValueError:
        return False
