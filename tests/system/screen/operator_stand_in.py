"""The operator's page over made-up statuses: real templates, scripts and web socket, no loop."""

import asyncio
import contextlib
import json
import threading
import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

import uvicorn
from starlette.applications import Starlette
from starlette.requests import Request
from starlette.responses import JSONResponse, Response
from starlette.routing import BaseRoute, Route

from tests.unit.screen.people import People
from tests.unit.screen.stand import application as around, parts
from thermaxis.codes import Message
from thermaxis.compensation import Limits, TouchRules
from thermaxis.runtime import EventRecord, Role, read_machine
from thermaxis.screen import _live_socket
from thermaxis.screen.access import Outcome, login_routes
from thermaxis.screen.feed import StatusSnapshot
from thermaxis.screen.pages import operator_page as _operator_page
from thermaxis.screen.pages.history import said_event
from thermaxis.web import Assets, spoken

EXAMPLE = Path(__file__).parents[3] / "examples" / "machine" / "lathe.toml"
STARTED = datetime.now(UTC) - timedelta(hours=2)
"""When the loop was started: all that is made up is told by one and the same."""
START = datetime(2026, 11, 21, 9, 0, tzinfo=UTC)

HEADLINES = {
    "Off": "headline-off",
    "Warming": "headline-warming",
    "Active": "headline-active",
    "Holding": "headline-held_by_person",
    "Fading": "headline-fading",
    "Fault": "headline-fault",
}
"""What is the matter in each state, if nothing else is said."""
VALUES = {
    "Warming": {"left_s": 720.0},
    "Holding": {"who": "novak"},
    "Fault": {"reason": "long_at_limit"},
}
"""What is said with it."""


def made_up(
    *,
    outputs: Sequence[str] = ("Z_um",),
    inputs: Sequence[str] = ("T_spindle_C", "T_table_C", "T_column_C"),
    state: str = "Active",
    reasons: Sequence[str] = (),
    alarms: Sequence[Mapping[str, object]] = (),
    sha256: str = "",
    **changed: Any,
) -> dict[str, Any]:
    """Return a status as the loop would tell it, with what is stated put in."""
    since = datetime.now(UTC) - timedelta(hours=1, minutes=24)
    found: dict[str, Any] = {
        "format": "thermaxis-status",
        "version": 3,
        "machine": "virtual lathe",
        "started": STARTED.isoformat(),
        "utc": datetime.now(UTC).isoformat(timespec="milliseconds"),
        "number": 51234,
        "cycle_s": 1.0,
        "lateness_s": 0.001,
        "overruns": 0,
        "state": state,
        "state_since": since.isoformat(),
        "in_state_s": 5040.0,
        "enabled": state != "Off",
        "reasons": list(reasons),
        "headline": {"code": HEADLINES[state], "values": VALUES.get(state, {})},
        "headline_since": since.isoformat(),
        "open_interlocks": [],
        "text": state,
        "quality": "good",
        "outcomes": [],
        "source_connected": True,
        "sink_connected": True,
        "model_file": "lathe.json",
        "model_sha256": sha256,
        "diameter_mm": 1500.0,
        "outputs": {name: an_output(k) for k, name in enumerate(outputs)},
        "inputs": {name: an_input(k) for k, name in enumerate(inputs)},
        "signals": {},
        "alarms": list(alarms),
        "historian": {"storing": True, "waiting": 0, "lost": 0, "text": ""},
    }
    return found | changed


def an_output(k: int = 0, **changed: Any) -> dict[str, Any]:
    """Return what is told of one output."""
    correction_um = -35.2 + 7.3 * k
    found: dict[str, Any] = {
        "correction_um": correction_um,
        "wanted_um": correction_um - 0.3,
        "rate_um_per_s": -0.01,
        "requested_um": correction_um,
        "requested_age_s": 0.3,
        "accepted_um": correction_um,
        "accepted_age_s": 0.3,
        "effective_um": correction_um + 0.1,
        "effective_age_s": 0.3,
        "acting_um": correction_um + 0.1,
        "acting_age_s": 0.3,
        "acting_known": True,
        "model_um": -correction_um,
        "weight": 1.0,
        "at_limit": False,
        "at_soft_limit": False,
        "trim_um": 0.0,
        "trim_owner": "",
        "trim_left_s": 0.0,
        "parts_um": {"spindle": 30.1, "table": 5.1 - 7.3 * k},
        "sources_um": {"spindle": -30.1, "table": -5.1 + 7.3 * k},
        "differences_k": {"spindle": 6.8, "table": 1.9},
        "rest_um": 0.0,
        "limits": {
            "largest_um": 280.0,
            "soft_um": 224.0,
            "total_um": 300.0,
            "largest_rate_um_per_s": 0.5,
            "deadband_um": 0.5,
            "largest_trim_um": 20.0,
        },
    }
    return found | changed


def an_input(k: int = 0, **changed: Any) -> dict[str, Any]:
    """Return what is told of one input."""
    return {
        "value_c": 27.4 + k,
        "quality": "good",
        "read": 27.4 + k,
        "status": "Good",
        "good": True,
        "age_s": 0.4,
        "source_time": None,
    } | changed


def _with(told: dict[str, Any], code: str, output: Mapping[str, Any], **values: Any) -> Any:
    """Return a status with another headline, and its first output changed."""
    told["outputs"]["Z_um"] |= output
    told["headline"] = {"code": f"headline-{code}", "values": values}
    return told


def looks() -> dict[str, dict[str, Any]]:
    """Return a status for everything that may be the matter, by its headline."""
    still = {"correction_um": 0.0, "acting_um": 0.0, "wanted_um": 0.0, "rest_um": 35.2}
    over = {"correction_um": -280.0, "acting_um": -280.0, "wanted_um": -280.0, "at_limit": True}
    far = {"sources_um": {"spindle": -301.0, "table": -15.2}, "rest_um": 36.2}
    trim = {"trim_um": 5.0, "trim_owner": "svoboda", "trim_left_s": 2400.0}
    fades = {"correction_um": -20.2, "acting_um": -20.7, "wanted_um": 0.0, "rest_um": 15.0}
    gone = {"acting_known": False, "acting_age_s": 61.0, "acting_um": -30.5}
    open_ = {"reasons": ["interlock_open"], "open_interlocks": ["drives_on"]}
    bad = {"reasons": ["input_bad"], "quality": "held"}
    table = {"name": "T_table_C", "then": "wait"}
    found = {
        "off": _with(made_up(state="Off", reasons=["disabled"]), "off", still),
        "warming": _with(made_up(state="Warming"), "warming", still, left_s=720.0),
        "active": made_up(),
        "at_limit": _with(made_up(), "at_limit", over | far, name="Z_um"),
        "held_by_person": _with(
            made_up(state="Holding", reasons=["operator_hold"]),
            "held_by_person",
            trim | {"correction_um": -30.2, "acting_um": -30.1, "wanted_um": -30.3},
            who="novak",
        ),
        "held_for_input": _with(made_up(state="Holding", **bad), "held_for_input", {}, **table),
        "input_lost": _with(made_up(state="Warming", **bad), "input_lost", still, **table),
        "fading": _with(made_up(state="Fading"), "fading", fades),
        "interlock": _with(
            made_up(state="Holding", **open_),
            "interlock",
            {},
            name="drives_on",
            names=["drives_on"],
            then="resume_anew",
        ),
        "fault": _with(
            made_up(state="Fault", **open_ | {"reasons": ["double_compensation"]}),
            "fault",
            {},
            reason="double_compensation",
        ),
        "unreachable": _with(
            made_up(state="Holding", reasons=["connection_lost"], sink_connected=False),
            "unreachable",
            gone,
        ),
        "not_acting": _with(
            made_up(), "not_acting", {"acting_um": 0.0, "effective_um": 0.0}, names=["Z_um"]
        ),
        "inputs_unreachable": _with(
            made_up(state="Holding", source_connected=False), "inputs_unreachable", {}, then="wait"
        ),
    }
    for name in ("held_for_input", "input_lost"):
        found[name]["inputs"]["T_table_C"] |= {"quality": "implausible"}
    return found


@dataclass
class StandIn:
    """What the page is told, and what it asked."""

    status: dict[str, Any] = field(default_factory=made_up)
    """What the loop says."""
    live: bool = True
    """Whether it says it now."""
    people: People = field(default_factory=lambda: People().come(Role.OPERATOR))
    """Whoever looks."""
    address: str = ""
    """Where the page is."""
    old_s: float = 0.0
    """How long ago the loop said it. [s]"""
    looks: int = 0

    # ---- as StatusFeed

    @property
    def latest(self) -> StatusSnapshot:
        """Return the present look."""
        self.looks += 1
        if self.live:
            self.status["number"] += 1
            self.status["utc"] = datetime.now(UTC).isoformat(timespec="milliseconds")
        why = "" if self.live else "feed-no_connection"
        now_s = time.monotonic() - self.old_s
        text = json.dumps(self.status)
        return StatusSnapshot(self.looks, text, self.status, now_s, START, self.live, why)

    async def after(self, number: int) -> StatusSnapshot:
        """Return the next look."""
        del number
        await asyncio.sleep(0.2)
        return self.latest

    # ---- who looks, and asks

    @property
    def role(self) -> Role:
        """Role of whoever looks."""
        person = self.people.in_front
        return Role.NONE if person is None else person.role

    @role.setter
    def role(self, role: Role) -> None:
        self.people.come(None if role is Role.NONE else role)

    @property
    def answer(self) -> Outcome:
        """How the next question is answered."""
        return self.people.answer

    @answer.setter
    def answer(self, answer: Outcome) -> None:
        self.people.answer = answer

    @property
    def asked(self) -> list[tuple[str, tuple[float | str, ...]]]:
        """What was asked."""
        return [(method, arguments) for _, method, arguments in self.people.asked]


def trend(status: Mapping[str, Any], language: str) -> dict[str, Any]:
    """Return eight hours of a machine that warms up."""
    now = datetime.now(UTC)
    times = [int(1000 * (now - timedelta(minutes=2 * k)).timestamp()) for k in range(239, -1, -1)]
    stems = [name.removesuffix("_um") for name in status["outputs"]]
    names = [f"{stem}_effective_um" for stem in stems] + list(status["inputs"])
    series = {
        name: {
            "unit": "µm" if name.endswith("_um") else "°C",
            "t": times,
            "mean": [
                (-35.0 + 7.3 * k if name.endswith("_um") else 7.0) * (1 - 0.99**m)
                + (0.0 if name.endswith("_um") else 20.4 + k)
                if m not in range(100, 110)
                else None
                for m in range(240)
            ],
        }
        for k, name in enumerate(names)
    }
    alarm = Message("alarm-late", {"lateness_s": 2.0})
    moments = [datetime.fromtimestamp(times[k] / 1000, UTC) for k in (60, 120, 180)]
    events = [
        EventRecord.of(moments[0], "state", "", Message("event-state", {"state": "Active"})),
        EventRecord.of(
            moments[1], "alarm", "", Message("event-alarm", {"priority": "high", "alarm": alarm})
        ),
        EventRecord.of(
            moments[2],
            "request",
            "novak",
            Message("event-request_accepted", {"request": "trim", "answer": None}),
            {"kind": "trim", "accepted": True},
        ),
    ]
    said = [said_event(event, language) for event in events]
    return {"first": times[0], "last": times[-1], "series": series, "events": said}


def application(stand_in: StandIn) -> Starlette:
    """Return the application around a stand-in."""
    found = read_machine(EXAMPLE)
    rules = TouchRules(limits=Limits(20.0, 0.05), acts=True)
    touched = replace(found.compensation, touches={"Z_um": rules})
    configuration = replace(found, compensation=touched)
    assert configuration.screen is not None
    looks = configuration.screen.view_without_login
    given = parts(configuration, stand_in, people=stand_in.people, view_without_login=looks)
    assets = Assets()

    async def trend8(request: Request) -> Response:
        return JSONResponse(trend(stand_in.status, spoken(request)))

    async def helps(_: Request) -> Response:
        figures = {"ratio": 0.2, "compensated_um": 8.2, "uncompensated_um": 41.4}
        return JSONResponse(dict.fromkeys(stand_in.status["outputs"], figures))

    if not stand_in.status["model_sha256"]:
        stand_in.status["model_sha256"] = configuration.model.sha256
    own: list[BaseRoute] = [
        Route("/static/{name:path}", assets.answer),
        Route("/trend8", trend8),
        Route("/helps", helps),
    ]
    pages = (_operator_page, _live_socket)
    shown = (route for page in pages for route in page.routes(given))
    return around(given, [*own, *login_routes(given), *shown])


@contextlib.contextmanager
def served(stand_in: StandIn) -> Iterator[StandIn]:
    """Serve a stand-in on a free port while the block runs."""
    server = uvicorn.Server(
        uvicorn.Config(
            application(stand_in), host="127.0.0.1", port=0, log_level="error", lifespan="off"
        )
    )
    thread = threading.Thread(target=server.run, daemon=True)
    thread.start()
    while not server.started:
        time.sleep(0.02)
    port = server.servers[0].sockets[0].getsockname()[1]
    stand_in.address = f"http://127.0.0.1:{port}"
    try:
        yield stand_in
    finally:
        server.should_exit = True
        server.force_exit = True
        thread.join(10.0)
