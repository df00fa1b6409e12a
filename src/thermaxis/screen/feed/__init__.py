"""The loop's status as the screen gets it."""

from thermaxis.screen.feed._said_status import (
    NO_NAMES as NO_NAMES,
    called as called,
    said_code as said_code,
    said_status as said_status,
)
from thermaxis.screen.feed._status_feed import (
    PATIENCE_S as PATIENCE_S,
    REQUESTS as REQUESTS,
    StatusFeed as StatusFeed,
    StatusSnapshot as StatusSnapshot,
    parse_status as parse_status,
    role_in as role_in,
)
