"""The example's lathe with a loop in virtual time, and its pages without a socket."""

import asyncio
import json
from collections.abc import Mapping
from datetime import datetime
from pathlib import Path
from typing import Any, cast

import numpy as np
from starlette.applications import Starlette
from starlette.routing import BaseRoute

from tests.unit.runtime.simulated import (
    SimulatedHistorian,
    SimulatedMachine,
    SimulatedSink,
    SimulatedSource,
)
from tests.unit.screen.frame_parts import settings_with
from tests.unit.screen.people import People
from thermaxis.compensation import Compensation, Request, RequestKind
from thermaxis.runtime import (
    Borders,
    CompensationLoop,
    LoopSettings,
    MachineConfiguration,
    Role,
    VirtualClock,
    interlock_name,
    read_machine,
    redundant_name,
    run_in_virtual_time,
)
from thermaxis.runtime.status import Snapshot, as_json, facts_of
from thermaxis.screen.access import ScreenParts
from thermaxis.screen.feed import Told
from thermaxis.screen.feed._status_feed import parse_status

EXAMPLE = Path(__file__).parents[3] / "examples" / "machine" / "lathe.toml"
CHANNELS = ("T_spindle_C", "T_table_C", "T_column_C")


def lathe() -> MachineConfiguration:
    return read_machine(EXAMPLE)


def told_by_a_loop(
    configuration: MachineConfiguration,
    end_c: Mapping[str, float],
    *,
    compensation: Compensation | None = None,
    seconds: int = 200,
) -> dict[str, Any]:
    """Return what a real loop says after its temperatures went from 20 degrees to an end."""
    values = dict.fromkeys(CHANNELS, 20.0)
    values |= {redundant_name(name): 20.0 for name in CHANNELS}
    for name, flag in configuration.interlocks.items():
        values[interlock_name(name)] = float(flag.value)
    values |= {"other_compensation": 0.0, "diameter": 1200.0, "probe.Z_um": -3.0}
    machine = SimulatedMachine(values, ("Z_um",))
    rules = compensation or configuration.compensation
    found: list[str] = []

    async def script() -> None:
        loop = CompensationLoop(
            rules,
            LoopSettings(
                machine=configuration.name,
                model_file=configuration.model.path.name,
                model_sha256=configuration.model.sha256,
                reads_diameter=True,
                interlocks_met={n: f.value for n, f in configuration.interlocks.items()},
            ),
            Borders(
                SimulatedSource(machine),
                SimulatedSink(machine),
                SimulatedHistorian(),
                VirtualClock(),
            ),
        )
        stop = asyncio.Event()
        async with asyncio.TaskGroup() as group:
            group.create_task(loop.run(stop))
            await loop.submit(Request(RequestKind.ENABLE, "novak"))
            for k in range(seconds):
                for name in CHANNELS:
                    value = 20.0 + (end_c[name] - 20.0) * (k + 1) / seconds
                    machine.values[name] = machine.values[redundant_name(name)] = value
                await asyncio.sleep(1.0)
            assert loop.status is not None
            found.append(as_json(Snapshot(loop.status, facts_of(rules))))
            stop.set()

    run_in_virtual_time(script())
    return cast("dict[str, Any]", json.loads(found[0]))


class KnownFeed:
    """Says what it was given; a new number and time with every look."""

    def __init__(self, status: Mapping[str, Any] | None) -> None:
        self.status = status
        self.raw: dict[str, tuple[tuple[float, float], ...]] = {}
        self.number = 1
        self.live = status is not None

    @property
    def latest(self) -> Told:
        if self.status is None:
            return Told(1, "", {}, 0.0, None, live=False, why="feed-no_connection")
        text = json.dumps(self.status)
        parsed = parse_status(text)
        why = "" if self.live else "feed-no_connection"
        utc = datetime.fromisoformat(parsed["utc"])
        return Told(self.number, text, parsed, 1000.0, utc, live=self.live, why=why)

    def recent(self, name: str) -> tuple[tuple[float, float], ...]:
        return self.raw.get(name, ())

    def fill(self, names: tuple[str, ...], level_c: float, deviation_k: float, count: int) -> None:
        drawn = np.random.default_rng(7)
        for name in names:
            self.raw[name] = tuple(
                (
                    1000.0 - count + 1 + k,
                    level_c + 0.002 * k + float(drawn.normal(0.0, deviation_k)),
                )
                for k in range(count)
            )


def parts_with(
    configuration: MachineConfiguration, feed: KnownFeed, role: Role | None = None, **settings: Any
) -> ScreenParts:
    return ScreenParts(
        configuration=configuration,
        settings=settings_with(**{"view_without_login": True, **settings}),
        clock=VirtualClock(),
        feed=cast("Any", feed),
        persons=cast("Any", People().come(role)),
        program="p1",
    )


def application(parts: ScreenParts, routes: list[BaseRoute]) -> Starlette:
    found = Starlette(routes=routes)
    found.state.parts = parts
    return found
