"""The same operator's page twice, and the viewers of each; `screen_choice.py` measures them.

Both show a made-up status that changes every second: state, one axis with a bar, six inputs, two
alarms and a trend of three lines of 500 points, of which each update brings one more. Every page
is a visitor's own, as language and role ask for. A program of its own for each, which ends with
the one that started it.

    python screen_candidates.py own|nicegui PORT HELD POLICY      a server with this content
        security policy, or none; no news while the file HELD is there
    python screen_candidates.py view-own|view-nicegui PORT VIEWERS
"""

import ast
import asyncio
import gzip
import json
import math
import re
import sys
import time
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any, Final

POINTS: Final = 500
"""Points of the trend. [1]"""
LINES: Final = ("Z", "spindle", "column")
"""Lines of the trend."""
INPUTS: Final = tuple(
    f"T_{place}" for place in ("spindle", "column", "table", "base", "oil", "air")
)
"""Inputs that are shown."""
EVERY_S: Final = 1.0
"""An update so often. [s]"""
LIMIT_UM: Final = 60.0
"""Limit of the made-up axis. [µm]"""


def status_of(number: int) -> dict[str, Any]:
    """Return the made-up status of a cycle."""
    warm = 1.0 - math.exp(-number / 900.0)
    temperature = {
        name: round(20.0 + 3.0 * (k + 1) * warm + 0.1 * math.sin(number / (7.0 + k)), 2)
        for k, name in enumerate(INPUTS)
    }
    return {
        "number": number,
        "state": "Active",
        "state_since": "2026-03-02T06:12:40.000+00:00",
        "text": "Active.",
        "correction_um": round(-42.0 * warm + math.sin(number / 11.0), 2),
        "rate_um_per_s": round(-42.0 / 900.0 * (1.0 - warm), 4),
        "inputs": {
            name: {"value_c": value, "quality": "good", "age_s": 0.2}
            for name, value in temperature.items()
        },
        "alarms": [
            {
                "priority": "medium",
                "text": "The model is outside the range of its logs.",
                "remedy": "Measure, or extend the model.",
            },
            {
                "priority": "low",
                "text": f"The trim of Z ends in {600 - number % 600} s.",
                "remedy": "Renew it, or let it end.",
            },
        ],
    }


def point_of(status: dict[str, Any]) -> tuple[float, ...]:
    """Return what the trend gets of a status."""
    inputs = status["inputs"]
    return (status["correction_um"], inputs["T_spindle"]["value_c"], inputs["T_column"]["value_c"])


def past() -> list[tuple[float, ...]]:
    """Return the trend before the first look."""
    return [point_of(status_of(number)) for number in range(POINTS)]


async def _follow(held: Path, tell: Callable[[dict[str, Any]], None]) -> None:
    """Tell a status every second, as the loop does; nothing while it is held."""
    number = POINTS
    while True:
        await asyncio.sleep(EVERY_S)
        if not held.exists():
            number += 1
            tell(status_of(number))


# ---- starlette and uvicorn, as the screen is built ----------------------------------------------

_PAGE = """\
<!doctype html><html lang="{{ language }}"><head><meta charset="utf-8"><title>Lathe</title>
<script src="/plotly.min.js" defer></script><script type="module" src="/page.js"></script></head>
<body><h1 id="state"></h1><p id="since"></p><p id="said"></p><p id="age">NO DATA</p>
<p><b id="correction"></b> um, <span id="rate"></span> um/s</p>
<meter id="bar" min="-{{ limit }}" max="{{ limit }}" value="0"></meter>
<table id="inputs">{% for name in inputs %}<tr><th>{{ name }}</th><td></td><td></td><td></td></tr>
{% endfor %}</table><ul id="alarms"></ul><div id="trend"></div></body></html>
"""
_SCRIPT = """\
// @ts-check
const show = (id, text) => { document.getElementById(id).textContent = String(text); };
let good = -Infinity;
const names = ["Z", "spindle", "column"];
async function begin() {
  const past = await (await fetch("/past")).json();
  Plotly.newPlot("trend", names.map((name, k) => ({ name, y: past.map((row) => row[k]) })),
    { height: 300 });
}
function told(status) {
  good = performance.now();
  show("state", status.state);
  show("since", status.state_since);
  show("said", status.number);
  show("correction", status.correction_um);
  show("rate", status.rate_um_per_s);
  document.getElementById("bar").value = status.correction_um;
  [...document.querySelectorAll("#inputs tr")].forEach((row) => {
    const input = status.inputs[row.cells[0].textContent];
    row.cells[1].textContent = input.value_c;
    row.cells[2].textContent = input.quality;
    row.cells[3].textContent = input.age_s;
  });
  document.getElementById("alarms").replaceChildren(...status.alarms.map((alarm) => {
    const line = document.createElement("li");
    line.textContent = `${alarm.priority}: ${alarm.text} ${alarm.remedy}`;
    return line;
  }));
  const inputs = status.inputs;
  const point = [status.correction_um, inputs.T_spindle.value_c, inputs.T_column.value_c];
  if (document.getElementById("trend").data) {
    Plotly.extendTraces("trend", { y: point.map((value) => [value]) }, [0, 1, 2], 500);
  }
}
function connect() {
  const socket = new WebSocket(`ws://${location.host}/live`);
  socket.onmessage = (message) => told(JSON.parse(message.data));
  socket.onclose = () => setTimeout(connect, 500);
}
setInterval(() => {
  show("age", performance.now() - good > 3000 ? "NO DATA" : "data");
}, 250);
addEventListener("load", begin);
connect();
"""


def serve_own(port: int, held: Path, policy: str) -> None:
    """Serve the page with starlette and uvicorn."""
    import jinja2
    import plotly
    import uvicorn
    from starlette.applications import Starlette
    from starlette.requests import Request
    from starlette.responses import (
        HTMLResponse,
        JSONResponse,
        Response,
    )
    from starlette.routing import Route, WebSocketRoute
    from starlette.websockets import WebSocket, WebSocketDisconnect

    template = jinja2.Environment(autoescape=True).from_string(_PAGE)
    chart = Path(plotly.__file__).parent / "package_data" / "plotly.min.js"
    packed = gzip.compress(chart.read_bytes(), 6)
    queues: set[asyncio.Queue[str]] = set()

    def tell(status: dict[str, Any]) -> None:
        text = json.dumps(status, separators=(",", ":"))
        for queue in queues:
            queue.put_nowait(text)

    async def page(_: Request) -> Response:
        text = template.render(language="en", limit=LIMIT_UM, inputs=INPUTS)
        return HTMLResponse(text, headers={"Content-Security-Policy": policy} if policy else None)

    async def script(_: Request) -> Response:
        return Response(_SCRIPT, media_type="text/javascript")

    async def plot(_: Request) -> Response:
        headers = {"Content-Encoding": "gzip"}
        return Response(packed, media_type="text/javascript", headers=headers)

    async def before(_: Request) -> Response:
        return JSONResponse(past())

    async def live(socket: WebSocket) -> None:
        await socket.accept()
        queue: asyncio.Queue[str] = asyncio.Queue()
        queues.add(queue)
        try:
            while True:
                await socket.send_text(await queue.get())
        except (WebSocketDisconnect, RuntimeError):
            pass
        finally:
            queues.discard(queue)

    @asynccontextmanager
    async def life(_: Starlette) -> AsyncIterator[None]:
        task = asyncio.create_task(_follow(held, tell))
        yield
        task.cancel()

    routes = [
        Route("/", page),
        Route("/page.js", script),
        Route("/plotly.min.js", plot),
        Route("/past", before),
        WebSocketRoute("/live", live),
    ]
    application = Starlette(routes=routes, lifespan=life)
    uvicorn.run(application, host="127.0.0.1", port=port, log_level="warning")


# ---- NiceGUI ------------------------------------------------------------------------------------


def _guard(app: Any, policy: str) -> None:
    @app.middleware("http")
    async def guard(request: Any, following: Any) -> Any:
        answer = await following(request)
        answer.headers["Content-Security-Policy"] = policy
        return answer


def serve_nicegui(port: int, held: Path, policy: str) -> None:
    """Serve the page with NiceGUI; the trend is extended in the browser, not sent whole."""
    from nicegui import Client, app, ui

    pages: dict[str, tuple[Client, Callable[[dict[str, Any]], None]]] = {}

    def tell(status: dict[str, Any]) -> None:
        for client, told in list(pages.values()):
            if client.has_socket_connection:
                told(status)

    @ui.page("/")
    def page(client: Client) -> None:
        ui.page_title("Lathe")
        state, since, said = ui.label(), ui.label(), ui.label().props("id=said")
        age = ui.label("NO DATA").props("id=age")
        correction, rate = ui.label(), ui.label()
        bar = ui.linear_progress(0.0, show_value=False)
        rows = {}
        with ui.grid(columns=4):
            for name in INPUTS:
                ui.label(name)
                rows[name] = (ui.label(), ui.label(), ui.label())
        alarms = ui.column()
        before = past()
        lines = [{"name": n, "y": [row[k] for row in before]} for k, n in enumerate(LINES)]
        trend = ui.plotly({"data": lines, "layout": {"height": 300}})
        last = [time.monotonic()]

        def told(status: dict[str, Any]) -> None:
            last[0] = time.monotonic()
            state.text, since.text = status["state"], status["state_since"]
            said.text = str(status["number"])
            correction.text, rate.text = str(status["correction_um"]), str(status["rate_um_per_s"])
            bar.value = 0.5 + 0.5 * status["correction_um"] / LIMIT_UM
            for name, cells in rows.items():
                found = status["inputs"][name]
                for cell, value in zip(cells, found.values(), strict=True):
                    cell.text = str(value)
            alarms.clear()
            with alarms:
                for alarm in status["alarms"]:
                    ui.label(f"{alarm['priority']}: {alarm['text']} {alarm['remedy']}")
            point = {"y": [[value] for value in point_of(status)]}
            trend.run_plot_method("extendTraces", point, [0, 1, 2], POINTS)

        def judge() -> None:
            age.text = "NO DATA" if time.monotonic() - last[0] > 3.0 else "data"

        ui.timer(0.25, judge)
        pages[client.id] = (client, told)
        client.on_delete(lambda: pages.pop(client.id, None))

    if policy:
        _guard(app, policy)

    app.on_startup(lambda: asyncio.create_task(_follow(held, tell)))
    ui.run(host="127.0.0.1", port=port, reload=False, show=False, show_welcome_message=False)


# ---- viewers ------------------------------------------------------------------------------------


async def _view_own(port: int, count: Callable[[int], None]) -> None:
    from urllib.request import urlopen

    from websockets.asyncio.client import connect

    url = f"http://127.0.0.1:{port}/"
    past_url = f"http://127.0.0.1:{port}/past"
    await asyncio.to_thread(lambda: urlopen(url).read())
    await asyncio.to_thread(lambda: urlopen(past_url).read())
    async with connect(f"ws://127.0.0.1:{port}/live", proxy=None) as socket:
        async for message in socket:
            count(len(message))


async def _view_nicegui(port: int, count: Callable[[int], None]) -> None:
    """Take the page and its socket as the browser's script does, and acknowledge as it does."""
    import uuid
    from urllib.parse import urlencode
    from urllib.request import urlopen

    import socketio

    url = f"http://127.0.0.1:{port}"
    page = await asyncio.to_thread(lambda: urlopen(url).read().decode())
    found = re.search(r"query: (\{.*?\}),", page)
    if found is None:
        raise RuntimeError("the page names no query")
    query = ast.literal_eval(found.group(1))
    query |= {"document_id": str(uuid.uuid4()), "tab_id": str(uuid.uuid4())}
    implicit = bool(query.get("implicit_handshake"))
    query["implicit_handshake"] = str(implicit).lower()
    client = socketio.AsyncClient()
    following = query["next_message_id"]

    def hear(event: str, message: Any) -> None:
        nonlocal following
        if isinstance(message, dict) and "_id" in message:
            following = message["_id"] + 1
        count(len(json.dumps(message)) if event == "update" else 0)

    client.on("*", hear)
    await client.connect(
        f"{url}?{urlencode(query)}",
        socketio_path="/_nicegui_ws/socket.io",
        transports=["websocket"],
    )
    if not implicit:
        await client.emit("handshake", query)
    while True:
        await asyncio.sleep(3.0)
        acknowledged = {"client_id": query["client_id"], "next_message_id": following}
        await client.emit("ack", acknowledged)


async def _view(kind: str, port: int, viewers: int) -> None:
    """Look with many viewers; tell every second how many updates each had."""
    updates = [0] * viewers
    one = _view_own if kind == "own" else _view_nicegui

    def counter(k: int) -> Callable[[int], None]:
        def count(size: int) -> None:
            updates[k] += size > 0

        return count

    async def tell() -> None:
        while True:
            await asyncio.sleep(1.0)
            print(json.dumps([min(updates), sum(updates)]), flush=True)

    async with asyncio.TaskGroup() as group:
        for k in range(viewers):
            group.create_task(one(port, counter(k)))
        group.create_task(tell())


def main() -> None:
    """Serve, or look."""
    kind, port = sys.argv[1], int(sys.argv[2])
    if kind == "own":
        serve_own(port, Path(sys.argv[3]), sys.argv[4])
    elif kind == "nicegui":
        serve_nicegui(port, Path(sys.argv[3]), sys.argv[4])
    else:
        asyncio.run(_view(kind.removeprefix("view-"), port, int(sys.argv[3])))


if __name__ in {"__main__", "__mp_main__"}:
    main()
