"""Pages for files that are dropped: no machine, no log-in, nothing leaves the computer."""

from thermaxis.app._rooms import (
    Endpoint as Endpoint,
    Json as Json,
    RoomHost as RoomHost,
)
from thermaxis.app.server import serve_app as serve_app
