"""The 10 um step that proves sign and size, in virtual time."""

import asyncio
import math
from collections.abc import Mapping
from itertools import pairwise

import pytest

from tests.unit.runtime.simulated import SimulatedMachine, SimulatedSink, now_s
from thermaxis.codes import Message
from thermaxis.compensation import Limits
from thermaxis.errors import ConfigurationError, DataError
from thermaxis.runtime import (
    START_S,
    CommissioningPlan,
    StepProof,
    VirtualClock,
    prove_step,
    run_in_virtual_time,
)
from thermaxis.runtime.checks._commissioning import BACK_WITHIN_S, SETTLE_S, judge_step

PLAN = CommissioningPlan(output="Z_um", limits=Limits(50.0, 2.0))


def proven(
    machine: SimulatedMachine, factor: float, plan: CommissioningPlan = PLAN, shift: float = 0.0
) -> StepProof:
    """Prove a machine whose tool point moves by a factor of the offset."""

    async def measure(_: Message) -> float:
        await asyncio.sleep(1.0)
        return shift + factor * machine.offset_um[plan.output]

    return run_in_virtual_time(prove_step(SimulatedSink(machine), VirtualClock(), plan, measure))


def test_the_verdict_names_sign_unit_or_a_dead_offset() -> None:
    for factor, verdict in (
        (1.0, "proven"),
        (0.9, "proven"),
        (-1.0, "other_way"),
        (1.3, "other_size"),
        (0.5, "other_size"),
        (0.001, "without_effect"),
    ):
        machine = SimulatedMachine({}, ("Z_um",))
        proof = proven(machine, factor, shift=123.0)
        assert proof.verdict.code == f"event-step_{verdict}", factor
        assert proof.passed is (verdict == "proven")
        assert machine.z_um == 0.0


def test_the_offset_goes_out_and_back_at_the_rate_from_where_it_was_found() -> None:
    machine = SimulatedMachine({}, ("Z_um", "X_um"))
    machine.set_offset(Z_um=-7.0, X_um=3.5)
    assert proven(machine, 1.0).found_um == -7.0
    z = [-7.0, *(w["Z_um"] for w in machine.written)]
    assert max(z) == 3.0
    assert z[-1] == -7.0
    assert max(abs(b - a) for a, b in pairwise(z)) <= 2.0 * PLAN.cycle_s + 1e-9
    assert {w["X_um"] for w in machine.written} == {3.5}


def test_what_is_no_number_or_does_not_come_back_proves_nothing() -> None:
    for moved_um, left_um in ((math.nan, 0.0), (math.inf, 0.0), (10.0, math.nan)):
        assert judge_step(10.0, moved_um, left_um) == Message("event-step_not_measured")
    assert judge_step(10.0, 10.0, 4.0) == Message("event-step_not_back", {"left_um": 4.0})


def test_a_refused_write_on_the_way_back_is_tried_again() -> None:
    machine = SimulatedMachine({}, ("Z_um",))
    sink = SimulatedSink(machine)

    async def measure(_: Message) -> float:
        value = machine.z_um
        if value > 5.0:
            asyncio.get_running_loop().call_later(1.0, setattr, machine, "refuses", True)
            asyncio.get_running_loop().call_later(6.0, setattr, machine, "refuses", False)
        return value

    proof = run_in_virtual_time(prove_step(sink, VirtualClock(), PLAN, measure))
    assert proof.passed
    assert machine.z_um == 0.0


def test_an_offset_that_does_not_come_back_is_said_with_where_it_stands() -> None:
    machine = SimulatedMachine({}, ("Z_um",))
    sink = SimulatedSink(machine)

    async def measure(_: Message) -> float:
        machine.refuses = machine.z_um > 5.0
        return machine.z_um

    async def play() -> float:
        clock = VirtualClock()
        begin_s = clock.monotonic_s()
        with pytest.raises(DataError) as caught:
            await prove_step(sink, clock, PLAN, measure)
        assert caught.value.code == "offset_not_back"
        assert caught.value.values["found_um"] == pytest.approx(10.0)
        return clock.monotonic_s() - begin_s

    assert run_in_virtual_time(play()) >= BACK_WITHIN_S


def test_a_measurement_that_fails_brings_the_offset_back() -> None:
    machine = SimulatedMachine({}, ("Z_um",))

    async def measure(_: Message) -> float:
        if machine.z_um > 5.0:
            raise DataError("no_answer_of_the_gauge")
        return 0.0

    with pytest.raises(DataError, match="no_answer_of_the_gauge"):
        run_in_virtual_time(prove_step(SimulatedSink(machine), VirtualClock(), PLAN, measure))
    assert machine.z_um == 0.0


def test_a_step_beyond_the_limits_is_refused_before_anything_moves() -> None:
    machine = SimulatedMachine({}, ("Z_um",))
    machine.set_offset(Z_um=45.0)
    with pytest.raises(DataError) as caught:
        proven(machine, 1.0)
    assert caught.value.code == "step_outside_limits"
    assert not machine.written
    with pytest.raises(ConfigurationError):
        CommissioningPlan(output="Z_um", limits=Limits(50.0, 2.0), step_um=60.0)


@pytest.mark.parametrize(
    ("wrong", "tenths", "furthest_um"),
    [(1000.0, False, 10.0), (-1000.0, False, 10.0), (1000.0, True, 100.0), (10.0, False, 10.0)],
)
def test_a_unit_that_is_wrong_by_a_thousand_moves_the_tool_by_the_step_itself(
    wrong: float, tenths: bool, furthest_um: float
) -> None:
    machine = SimulatedMachine({}, ("Z_um",))
    moved_um: list[float] = []

    class Whole(SimulatedSink):
        async def write(self, correction_um: Mapping[str, float], deadline_s: float) -> bool:
            if tenths:
                correction_um = {n: round(10.0 * um) / 10.0 for n, um in correction_um.items()}
            taken = await super().write(correction_um, deadline_s)
            moved_um.append(wrong * machine.z_um)
            return taken

    async def measure(_: Message) -> float:
        return wrong * machine.z_um

    with pytest.raises(DataError) as caught:
        run_in_virtual_time(prove_step(Whole(machine), VirtualClock(), PLAN, measure))
    assert caught.value.code == "step_moved_otherwise"
    assert max(map(abs, moved_um)) == pytest.approx(furthest_um)
    assert machine.z_um == 0.0


def test_a_unit_that_is_wrong_by_a_thousand_is_noticed_on_a_machine_that_is_late() -> None:
    machine = SimulatedMachine({}, ("Z_um",))
    moved_um: list[float] = []

    class Late(SimulatedSink):
        async def write(self, correction_um: Mapping[str, float], deadline_s: float) -> bool:
            asyncio.get_running_loop().call_later(4.0, machine.take, dict(correction_um))
            return True

    async def measure(_: Message) -> float:
        moved_um.append(1000.0 * machine.z_um)
        return moved_um[-1]

    with pytest.raises(DataError) as caught:
        run_in_virtual_time(prove_step(Late(machine), VirtualClock(), PLAN, measure))
    assert caught.value.code == "step_moved_otherwise"
    assert moved_um == [0.0, pytest.approx(10.0)]


@pytest.mark.parametrize(
    ("unit_um", "step_um", "tried_um"),
    [(0.1, 5.0, [0.1, 0.5]), (0.1, -4.0, [-0.1, -0.4]), (1.0, 5.0, [1.0])],
)
def test_the_smallest_step_that_a_coarse_machine_can_tell_is_tried_and_none_twice(
    unit_um: float, step_um: float, tried_um: list[float]
) -> None:
    machine = SimulatedMachine({}, ("Z_um",))
    asked_um: list[float] = []

    class Counts(SimulatedSink):
        async def write(self, correction_um: Mapping[str, float], deadline_s: float) -> bool:
            counted = {n: unit_um * round(um / unit_um) for n, um in correction_um.items()}
            return await super().write(counted, deadline_s)

    async def measure(stands: Message) -> float:
        asked_um.append(float(str(stands.values.get("by_um", 0.0))))
        return machine.z_um

    plan = CommissioningPlan(output="Z_um", limits=Limits(50.0, 2.0), step_um=step_um)
    proof = run_in_virtual_time(prove_step(Counts(machine), VirtualClock(), plan, measure))
    assert proof.passed
    assert asked_um == pytest.approx([0.0, *tried_um, step_um, 0.0])


def test_a_step_of_which_the_machine_reports_no_part_is_not_made() -> None:
    machine = SimulatedMachine({}, ("Z_um",))

    class Whole(SimulatedSink):
        async def write(self, correction_um: Mapping[str, float], deadline_s: float) -> bool:
            return await super().write({n: float(round(u)) for n, u in correction_um.items()}, 1.0)

    async def measure(_: Message) -> float:
        return machine.z_um

    plan = CommissioningPlan(output="Z_um", limits=Limits(50.0, 2.0), step_um=1.0)
    with pytest.raises(DataError) as caught:
        run_in_virtual_time(prove_step(Whole(machine), VirtualClock(), plan, measure))
    assert caught.value.code == "step_untold"
    assert machine.z_um == 0.0
    assert {write["Z_um"] for write in machine.written} == {0.0}


@pytest.mark.parametrize(
    ("late_s", "digits"),
    [*((late_s, 3) for late_s in (0.05, 0.3, 0.7, 1.0, 1.5, 3.0)), (1.5, 0)],
)
def test_a_control_that_takes_offsets_over_late_is_waited_for(late_s: float, digits: int) -> None:
    machine = SimulatedMachine({}, ("Z_um",))
    stood_s: list[float] = []

    class Late(SimulatedSink):
        async def write(self, correction_um: Mapping[str, float], deadline_s: float) -> bool:
            loop = asyncio.get_running_loop()
            self._requested = dict(correction_um)
            kept = {name: round(um, digits) for name, um in correction_um.items()}
            loop.call_later(late_s, machine.take, kept)
            return True

    async def measure(_: Message) -> float:
        moves_s = [write.at_s for write in machine.writes if write.after_um != write.before_um]
        stood_s.append(now_s() - max(moves_s, default=0.0))
        await asyncio.sleep(1.0)
        return machine.z_um

    async def timed() -> tuple[StepProof, float]:
        clock = VirtualClock()
        return await prove_step(Late(machine), clock, PLAN, measure), clock.monotonic_s()

    proof, ended_s = run_in_virtual_time(timed())
    assert proof.passed
    if late_s < PLAN.cycle_s:  # ten seconds at the rate, five readings of one second, some more
        assert ended_s - START_S < 15.0 + 5.0
    assert proof.accepted_um == proof.effective_um == pytest.approx(10.0)
    if digits == 0:  # what a take-over lasts is learned from a step above the tolerance, too
        assert min(stood_s) > SETTLE_S
    steps = [abs(write.after_um - write.before_um) for write in machine.writes]
    assert max(steps) <= max(2.0 * PLAN.cycle_s, 10.0**-digits) + 1e-9


@pytest.mark.parametrize("others_um", [-20.0, 7.0, 45.0])
def test_an_offset_that_somebody_else_sets_meanwhile_is_brought_back_at_the_rate(
    others_um: float,
) -> None:
    machine = SimulatedMachine({}, ("Z_um",))

    async def measure(_: Message) -> float:
        if machine.z_um > 9.0:
            machine.set_offset(Z_um=others_um)
            await asyncio.sleep(5.0)
        return machine.z_um

    with pytest.raises(DataError) as caught:
        run_in_virtual_time(prove_step(SimulatedSink(machine), VirtualClock(), PLAN, measure))
    assert caught.value.code == "offset_differs"
    assert machine.z_um == 0.0
    steps = [abs(write.after_um - write.before_um) for write in machine.writes]
    assert max(steps) <= 2.0 * PLAN.cycle_s + 1e-9


def test_a_machine_that_reports_another_offset_ends_the_step_early() -> None:
    machine = SimulatedMachine({}, ("Z_um",))

    class Clamped(SimulatedSink):
        async def write(self, correction_um: object, deadline_s: float) -> bool:
            taken = await super().write(correction_um, deadline_s)
            machine.set_offset(Z_um=min(machine.z_um, 2.0))
            return taken

    async def measure(_: Message) -> float:
        return machine.z_um

    with pytest.raises(DataError) as caught:
        run_in_virtual_time(prove_step(Clamped(machine), VirtualClock(), PLAN, measure))
    assert caught.value.code == "offset_differs"
    assert max(w["Z_um"] for w in machine.written) <= 7.0
    assert machine.z_um == 0.0
