"""The loop's status as the screen gets it."""

from thermaxis.screen.feed._said_status import said_code, said_status
from thermaxis.screen.feed._status_feed import (
    PATIENCE_S,
    REQUESTS,
    WHO_AM_I,
    StatusFeed,
    StatusSnapshot,
    parse_status,
    role_in,
)

__all__ = [
    "PATIENCE_S",
    "REQUESTS",
    "WHO_AM_I",
    "StatusFeed",
    "StatusSnapshot",
    "parse_status",
    "role_in",
    "said_code",
    "said_status",
]
