"""An emergency stop freezes the offset that acts: it is no fault, and nothing is let go after."""

import asyncio
from dataclasses import replace
from itertools import pairwise
from typing import NamedTuple

import pytest

from tests.unit.runtime.simulated import SimulatedHistorian
from thermaxis.compensation import (
    Compensation,
    CompensationModel,
    Limits,
    Output,
    Part,
    Request,
    RequestKind,
    SensorRules,
    SupervisorRules,
    SupervisorState,
)
from thermaxis.runtime import (
    AtStop,
    CompensationLoop,
    LoopSettings,
    Ports,
    RuntimeStatus,
    VirtualClock,
    run_in_virtual_time,
)
from thermaxis.runtime.status import Headlines
from thermaxis.virtual import LatheSettings, LatheSink, LatheSource, OffsetRules, VirtualLathe

RATE_UM_PER_S = 0.5
PRESSED_S = 900.0
RULES = SupervisorRules(settle_s=5.0)
CHANNELS = ("T_spindle_C", "T_column_C")


class Seen(NamedTuple):
    """What was so after a cycle."""

    at_s: float
    status: RuntimeStatus
    effective_um: float
    pressed: bool

    @property
    def state(self) -> SupervisorState:
        return self.status.output.state


def compensation(*, hold_s: float) -> Compensation:
    part = Part("spindle", *CHANNELS, direct_gain_um_per_k=9.0)
    return Compensation(
        model=CompensationModel(
            outputs=(Output("Z_um", (part,)),),
            reference="stated",
            reference_c={"T_spindle_C": 15.0, "T_column_C": 20.0},
        ),
        sensors={c: SensorRules(lowest_c=5.0, highest_c=80.0) for c in CHANNELS},
        limits={"Z_um": Limits(280.0, RATE_UM_PER_S)},
        supervisor=replace(RULES, hold_interlock_s=hold_s),
        interlocks=("no emergency stop",),
    )


def pressed_for(duration_s: float, *, machine_rate_um_per_s: float, hold_s: float) -> list[Seen]:
    """Press the emergency stop of a compensated lathe; return every cycle from before it on."""
    rules = OffsetRules(watchdog_s=60.0, rate_um_per_s=machine_rate_um_per_s)
    lathe = VirtualLathe("calibration-spindle", 1, settings=LatheSettings(offset=rules))
    seen: list[Seen] = []

    async def play() -> None:
        clock = VirtualClock()
        loop = CompensationLoop(
            compensation(hold_s=hold_s),
            LoopSettings(machine="lathe", model_file="", model_sha256="", at_stop=AtStop.LEAVE),
            Ports(LatheSource(lathe, clock), LatheSink(lathe, clock), SimulatedHistorian(), clock),
        )

        def look(told: RuntimeStatus) -> None:
            status = replace(told, headline=headlines.headline_of(told)[0])
            at_s = status.output.time_s - loop_began_s
            pressed = PRESSED_S <= at_s < PRESSED_S + duration_s
            lathe.set_flag("emergency_stop", value=pressed)
            seen.append(Seen(at_s, status, lathe.axis.effective_um, pressed))

        headlines, loop_began_s = Headlines(), clock.monotonic_s()
        loop.listeners.append(look)
        running = asyncio.ensure_future(
            loop.run(asyncio.Event(), cycles=int(PRESSED_S + duration_s + 120.0))
        )
        assert (await loop.submit(Request(RequestKind.ENABLE, "test"))).accepted
        await running

    run_in_virtual_time(play())
    return [one for one in seen if one.at_s >= PRESSED_S - 5.0]


@pytest.mark.parametrize(  # each value of one with each of another
    ("duration_s", "machine_rate_um_per_s", "hold_s"),
    [
        *((4.0, 2.0, 0.0), (11.0, 2.0, 3600.0), (200.0, 2.0, 0.0)),
        *((4.0, 1e3, 3600.0), (11.0, 1e3, 0.0), (200.0, 1e3, 3600.0)),
    ],
)
def test_an_emergency_stop_is_no_fault_and_lets_nothing_go_when_it_is_released(
    duration_s: float, machine_rate_um_per_s: float, hold_s: float
) -> None:
    seen = pressed_for(duration_s, machine_rate_um_per_s=machine_rate_um_per_s, hold_s=hold_s)
    assert abs(seen[0].effective_um) > 20.0, "there is something that could be let go"
    assert SupervisorState.FAULT not in {one.state for one in seen}
    assert seen[-1].state is SupervisorState.ACTIVE
    stood = {one.effective_um for one in seen if one.pressed and one.at_s > PRESSED_S + 1.0}
    assert len(stood) == 1, "drives that are off move nothing"
    # what an offset that is not followed may be ahead: a silence, a cycle, and the tolerance
    bound_um = RATE_UM_PER_S * 3.0 + RULES.read_back_tolerance_um
    steps_um = [abs(b.effective_um - a.effective_um) for a, b in pairwise(seen)]
    assert max(steps_um) <= bound_um
    for one in seen:
        if one.pressed and one.at_s > PRESSED_S + 1.0:
            assert one.status.headline.code == "headline-interlock"
            assert one.status.headline.values["name"] == "no emergency stop"
            assert one.status.offsets["Z_um"].acting.um == pytest.approx(one.effective_um)
            assert "no_effect" not in {alarm.code for alarm in one.status.alarms}
