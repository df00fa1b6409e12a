from ._status_feed import (
    PATIENCE_S as PATIENCE_S,
    REQUESTS as REQUESTS,
    WHO_AM_I as WHO_AM_I,
    StatusFeed as StatusFeed,
    Told as Told,
    role_in as role_in,
)
