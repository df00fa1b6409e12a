"""Answers packed for the network."""

from typing import Final, final

from starlette.middleware.gzip import GZipMiddleware
from starlette.types import ASGIApp, Receive, Scope, Send

PACKED_BYTES: Final = 1000
"""Answers that are no shorter are packed. [byte]"""
PACKING: Final = 4
"""How hard they are packed: a month of history in some milliseconds. [1]"""


@final
class Packed(GZipMiddleware):
    """Answers packed, but for files: their length is announced, so that it shows if one is cut.

    What is below the paths of `files` may be one.
    """

    def __init__(self, app: ASGIApp, files: tuple[str, ...]) -> None:
        super().__init__(app, PACKED_BYTES, PACKING)
        self._files = files

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer."""
        if scope["type"] == "http" and scope["path"].startswith(self._files):
            await self.app(scope, receive, send)
        else:
            await super().__call__(scope, receive, send)
