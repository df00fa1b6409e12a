"""The room of measured runs, opened to engineers at the machine."""

from collections.abc import Sequence
from datetime import datetime
from typing import final

from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import BaseRoute

from thermaxis.app import Endpoint
from thermaxis.app.axis import AxisRoom
from thermaxis.runtime import Role
from thermaxis.screen.access import (
    ScreenParts,
    UserSession,
    needs,
    render,
    visitor_of,
)


@final
class _Host:
    """The screen, as a room sees it: results belong to a log-in."""

    settings = None

    def __init__(self, parts: ScreenParts) -> None:
        self._clock = parts.clock
        self.longest_s = parts.settings.evaluation_s

    def monotonic_s(self) -> float:
        return self._clock.monotonic_s()

    def utc(self) -> datetime:
        return self._clock.utc()

    def guarded(self, endpoint: Endpoint) -> Endpoint:
        return needs(Role.ENGINEER, named=True)(endpoint)

    def paged(self, endpoint: Endpoint) -> Endpoint:
        return needs(Role.VIEWER, page=True)(endpoint)

    def owner_of(self, request: Request) -> UserSession | None:
        visitor = visitor_of(request)
        return visitor.person if visitor.role.at_least(Role.ENGINEER) else None

    def page(self, request: Request, template: str, *, page: str, **context: object) -> Response:
        return render(request, template, page=page, **context)


def routes(parts: ScreenParts) -> Sequence[BaseRoute]:
    """Return the routes of the page."""
    return AxisRoom(_Host(parts)).routes()
