"""Answers packed for the network."""

from typing import Final, final

from starlette.middleware.gzip import GZipMiddleware
from starlette.types import ASGIApp, Receive, Scope, Send

PACKED_BYTES: Final = 1000
"""Answers that are no shorter are packed. [byte]"""
PACKING: Final = 4
"""How hard they are packed: a month of history in some milliseconds. [1]"""
_FILES = ("/history/export", "/positioning/")


@final
class Packed(GZipMiddleware):
    """Answers packed, but for files: their length is announced, so that it shows if one is cut."""

    def __init__(self, app: ASGIApp) -> None:
        super().__init__(app, PACKED_BYTES, PACKING)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer."""
        if scope["type"] == "http" and scope["path"].startswith(_FILES):
            await self.app(scope, receive, send)
        else:
            await super().__call__(scope, receive, send)
