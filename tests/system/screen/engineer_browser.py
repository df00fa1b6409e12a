"""Pages in a real browser without a server: requests go to the application in this program."""

import json
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from typing import Any

from playwright.sync_api import Browser, BrowserContext, Page, Route, WebSocketRoute
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import Route as HttpRoute
from starlette.testclient import TestClient

from tests.system.screen.stand import wait_until
from tests.unit.screen.stand import Feed, application
from thermaxis.screen.access import ScreenParts, render
from thermaxis.screen.feed import said_status
from thermaxis.screen.pages import sensors_page as _sensors_page
from thermaxis.screen.pages.model import page as _model_page
from thermaxis.web import Assets

HOST = "http://screen.test"
CSP = (
    "default-src 'none'; script-src 'self'; style-src 'self'; "
    "img-src 'self' data: blob:; connect-src 'self' ws://screen.test; font-src 'self'; "
    "form-action 'self'; base-uri 'none'"
)

NO_SENSOR: Mapping[str, Any] = {
    "channels": [],
    "interlocks": [],
    "other_compensation": None,
    "diameter_read": False,
    "others": [],
}
"""Facts of a page that has all that charts need, and none of its own."""


class Pages:
    """The engineer's pages, answered here; every fault of a script is remembered."""

    def __init__(self, parts: ScreenParts, feed: Feed) -> None:
        self.feed = feed
        self.faults: list[str] = []
        self.asked: list[tuple[str, Any]] = []
        self.answer: Mapping[str, Any] = {"answer": "accepted", "reason": ""}
        self.language = "en"
        self._sockets: list[WebSocketRoute] = []
        assets = Assets()

        async def blank(request: Request) -> Response:
            return render(request, "sensors.html", page="sensors", **NO_SENSOR)

        async def ask(request: Request) -> Response:
            self.asked.append((request.headers["x-thermaxis-token"], await request.json()))
            return Response(json.dumps(self.answer), media_type="application/json")

        person = parts.persons.of("anybody")
        who = {"name": "", "role": "viewer"}
        if person is not None:
            who = {"name": person.name, "role": person.role.value}
        self._hello = {"kind": "hello", "program": parts.program, **who}
        routes = [
            HttpRoute("/static/{name:path}", assets.answer),
            HttpRoute("/ask", ask, methods=["POST"]),
            HttpRoute("/blank", blank),
            *_model_page.routes(parts),
            *_sensors_page.routes(parts),
        ]
        self._client = TestClient(application(parts, routes), base_url=HOST)

    def attach(self, context: BrowserContext) -> Page:
        page = context.new_page()
        page.on("console", self._console)
        page.on("pageerror", lambda error: self.faults.append(str(error)))
        page.route("**/*", self._serve)
        page.route_web_socket("**/live", self._live)
        return page

    def _console(self, message: Any) -> None:
        if message.type in {"error", "warning"}:
            self.faults.append(message.text)

    def _serve(self, route: Route) -> None:
        request = route.request
        if not request.url.startswith(HOST):
            self.faults.append(f"another host was asked: {request.url}")
            route.abort()
            return
        headers = {k: v for k, v in request.headers.items() if k != "accept-encoding"}
        answer = self._client.request(
            request.method,
            request.url.removeprefix(HOST),
            content=request.post_data_buffer,
            headers={**headers, "accept-encoding": "identity"},
        )
        route.fulfill(
            status=answer.status_code,
            body=answer.content,
            headers={**dict(answer.headers), "content-security-policy": CSP},
        )

    def _live(self, socket: WebSocketRoute) -> None:
        self._sockets = [socket]
        socket.send(json.dumps(self._hello))
        self.tell()

    def tell(self) -> None:
        """Send what the feed knows to the open page."""
        status = self.feed.status
        message = (
            {
                "kind": "status",
                "age_s": 0.1,
                "sent_s": time.monotonic(),
                "status": said_status(status, self.language),
            }
            if status is not None and not self.feed.why
            else {"kind": "no_data", "key": "feed-no_connection", "text": "gone", "since": None}
        )
        for socket in self._sockets:
            socket.send(json.dumps(message))

    def tell_until(self, page: Page, fulfilled: Callable[[], bool]) -> None:
        """Send again and again until something is so, as the server does each second."""

        def told() -> bool:
            self.tell()
            page.wait_for_timeout(50)
            return fulfilled()

        wait_until("what the page was told is shown", told)


@contextmanager
def opened(browser: Browser, pages: Pages, path: str, **context: Any) -> Iterator[Page]:
    """Open a page in a browser of its own settings; close it afterwards."""
    made = browser.new_context(timezone_id="Europe/Prague", **context)
    try:
        pages.language = str(context.get("locale", "en"))[:2]
        page = pages.attach(made)
        page.goto(HOST + path)
        yield page
    finally:
        made.close()
