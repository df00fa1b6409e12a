"""The example's lathe with a loop in virtual time."""

import asyncio
import json
from collections.abc import Mapping
from typing import Any, cast

from tests.unit.runtime.simulated import (
    SimulatedHistorian,
    SimulatedMachine,
    SimulatedSink,
    SimulatedSource,
)
from thermaxis.compensation import Compensation, Request, RequestKind
from thermaxis.runtime import (
    CompensationLoop,
    LoopSettings,
    MachineConfiguration,
    Ports,
    VirtualClock,
    interlock_name,
    redundant_name,
    run_in_virtual_time,
)
from thermaxis.runtime.status import as_json

CHANNELS = ("T_spindle_C", "T_table_C", "T_column_C")


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
            Ports(
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
            found.append(as_json(loop.status))
            stop.set()

    run_in_virtual_time(script())
    return cast("dict[str, Any]", json.loads(found[0]))
