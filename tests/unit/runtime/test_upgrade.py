"""A machine that stands at 40 um, compensated by an earlier program, is taken over without a step.

``state_of_fbbf9642.json`` was written by the program of that commit beside the virtual lathe,
7052 s after the start of its scenario ``verification``,
configured as ``examples/machine/lathe.toml``.
"""

import asyncio
import shutil
from dataclasses import replace
from pathlib import Path

import pytest

from tests.proofs import quick_first
from tests.unit.runtime.simulated import (
    SimulatedHistorian,
    SimulatedMachine,
    SimulatedSink,
    SimulatedSource,
)
from thermaxis.cli.machine._machine_parts import loop_settings
from thermaxis.codes import Message
from thermaxis.compensation import SupervisorState
from thermaxis.runtime import (
    OTHER_COMPENSATION,
    START_UTC,
    AtStop,
    CompensationLoop,
    Ports,
    StateFile,
    VirtualClock,
    interlock_name,
    read_machine,
    redundant_name,
    run_in_virtual_time,
)

STOOD_UM, RATE_UM_PER_S, CYCLE_S = 40.309710545320804, 0.5, 1.0
VALUES = {"T_spindle_C": 24.9, "T_column_C": 20.6, "T_table_C": 20.5}
ABSENT_S = 20.0
LATE_CYCLES = 2.0
"""A cycle that is late may move an offset by what the rate allows in so many. [1]"""


@pytest.mark.parametrize("stands_um", quick_first(1, [STOOD_UM, 0.0, -15.0]))
def test_no_step_is_larger_than_the_rate_allows(
    root: Path, tmp_path: Path, stands_um: float
) -> None:
    configuration = read_machine(root / "examples/machine/lathe.toml")
    state = tmp_path / "lathe.state.json"
    shutil.copy(root / "tests/unit/runtime/state_of_fbbf9642.json", state)
    flags = {interlock_name(name): True for name in configuration.compensation.interlocks}
    settings = loop_settings(configuration)
    flags |= {interlock_name(name): met for name, met in settings.interlocks_met.items()}
    machine = SimulatedMachine(
        {
            **VALUES,
            **{redundant_name(name): value for name, value in VALUES.items()},
            **{name: float(met) for name, met in flags.items()},
            OTHER_COMPENSATION: 0.0,
        }
    )
    machine.set_offset(Z_um=stands_um)
    historian = SimulatedHistorian()
    clock = VirtualClock(START_UTC.replace(hour=1, minute=57, second=32 + round(ABSENT_S)))

    async def go_on() -> SupervisorState:
        ports = Ports(SimulatedSource(machine), SimulatedSink(machine), historian, clock)
        loop = CompensationLoop(
            configuration.compensation,
            replace(settings, at_stop=AtStop.LEAVE),
            ports,
            state_file=StateFile(state),
        )
        await loop.run(asyncio.Event(), 300)
        assert loop.status is not None
        return loop.status.output.state

    assert run_in_virtual_time(go_on()) is SupervisorState.ACTIVE
    (taken,) = [e for e in historian.events if e.code == "event-saved_state"]
    resumed = taken.values["resumed"]
    assert isinstance(resumed, Message)
    assert resumed.code == "resumed-enabled"
    assert resumed.values["kept"] == Message("kept-sections"), "it is the same model"
    assert taken.values["age_s"] == ABSENT_S
    steps = [write.after_um - write.before_um for write in machine.writes]
    assert machine.writes[0].before_um == stands_um
    assert abs(steps[0]) <= RATE_UM_PER_S * LATE_CYCLES * CYCLE_S + 1e-9, "20 s after the last"
    assert max(map(abs, steps[1:])) <= RATE_UM_PER_S * CYCLE_S + 1e-9
    assert STOOD_UM < machine.z_um < STOOD_UM + 8.0, "the sections go on to their values"
