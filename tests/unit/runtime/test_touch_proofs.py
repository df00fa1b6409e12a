"""Touches act on a machine only where commissioning has proven them with this configuration."""

import asyncio
from argparse import ArgumentParser, Namespace
from dataclasses import replace
from pathlib import Path

import pytest

from tests.proofs import quick_first
from tests.unit.runtime.simulated import SimulatedSink, SimulatedSource
from tests.unit.runtime.test_touches import TABLE, Probing, configured
from thermaxis.cli.machine import commission
from thermaxis.codes import Message
from thermaxis.compensation import Compensation, Limits
from thermaxis.errors import ConfigurationError, DataError
from thermaxis.runtime import (
    START_UTC,
    CommissioningPlan,
    MachineConfiguration,
    StepProof,
    VirtualClock,
    by_touches,
    prove_step,
    read_machine,
    run_in_virtual_time,
    warnings_of,
)
from thermaxis.runtime.config import keep_touch_proof, unproven_touches, with_proven_touches

ACTING = f"{TABLE}acts = true\n"
PLAN = CommissioningPlan(output="Z_um", limits=Limits(50.0, 2.0), step_um=20.0, noise_um=1.0)


def touched(compensation: Compensation, machine: Probing) -> tuple[StepProof, int]:
    """Commission by touches that somebody takes whenever asked; one early, which is no answer."""
    clock, asked = VirtualClock(), list[Message]()

    def tell(stands: Message) -> None:
        asked.append(stands)
        machine.touch(1000.0)  # while the offset still moved
        asyncio.get_running_loop().call_later(60.0, machine.touch)

    source = SimulatedSource(machine)
    measure = by_touches(source, clock, compensation, "Z_um", tell)
    return run_in_virtual_time(prove_step(SimulatedSink(machine), clock, PLAN, measure)), len(asked)


def machine_that_sees(part: float) -> Probing:
    machine = Probing()
    machine.sees = part
    return machine


@pytest.fixture
def acting(tmp_path: Path) -> MachineConfiguration:
    return read_machine(configured(tmp_path, ACTING))


# ---- by touches ----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("part", "verdict"),
    quick_first(
        4,
        [
            (1.0, "proven"),
            (-1.0, "other_way"),
            (0.0, "without_effect"),
            (0.5, "other_size"),
            (0.9, "proven"),
            (0.001, "without_effect"),
        ],
    ),
)
def test_touches_show_sign_and_size_or_that_they_see_another_axis(
    part: float, verdict: str, acting: MachineConfiguration
) -> None:
    machine = machine_that_sees(part)
    proof, asked = touched(acting.compensation, machine)
    assert proof.verdict.code == f"event-step_{verdict}"
    assert asked == 5  # as found, a thousandth, a tenth, all of it, as found again
    assert machine.z_um == 0.0


@pytest.mark.parametrize("part", [1000.0, -1000.0])
def test_touches_that_see_a_thousand_times_the_step_end_it_at_once(
    part: float, acting: MachineConfiguration
) -> None:
    machine = machine_that_sees(part)
    with pytest.raises(DataError) as caught:
        touched(acting.compensation, machine)
    assert caught.value.code == "step_moved_otherwise"
    assert max(abs(one["Z_um"]) for one in machine.written) == pytest.approx(0.02)
    assert machine.z_um == 0.0


def test_a_machine_that_takes_no_correction_proves_nothing(acting: MachineConfiguration) -> None:
    machine = machine_that_sees(1.0)
    machine.refuses = True
    with pytest.raises(DataError):
        touched(acting.compensation, machine)
    assert machine.z_um == 0.0


def test_a_step_that_noise_may_pass_for_is_refused() -> None:
    with pytest.raises(ConfigurationError):
        replace(PLAN, step_um=9.9)


# ---- what is kept --------------------------------------------------------------------------------


def test_without_a_proof_touches_are_only_shown(acting: MachineConfiguration) -> None:
    assert acting.compensation.touches["Z_um"].acts
    shown = with_proven_touches(acting)
    assert not shown.compensation.touches["Z_um"].acts
    assert not shown.rules.touches["Z_um"].acts  # as another model of the folder gets them
    said = [one.message.code for one in warnings_of(acting, START_UTC)]
    assert "advice-touches_unproven" in said


def test_what_is_proven_acts_until_it_is_not_proven_again(acting: MachineConfiguration) -> None:
    keep_touch_proof(acting, "Z_um", proven=True)
    assert unproven_touches(acting) == ()
    assert with_proven_touches(acting) == acting
    keep_touch_proof(acting, "Z_um", proven=False)
    assert unproven_touches(acting) == ("Z_um",)


@pytest.mark.parametrize(
    "change",
    [
        ('unit = "mm"\nsign', 'unit = "um"\nsign'),
        ("moves the tool away from", "moves the tool towards"),
        ('node = "ns=2;s=Z_offset"', 'node = "ns=2;s=X_offset"'),
        ("127.0.0.1:4840", "127.0.0.1:4841"),
        ('name = "vertical lathe"', 'name = "another lathe"'),
        ('node = "ns=2;s=Touch"', 'node = "ns=2;s=Touch_X"'),
        ('counter_node = "ns=2;s=Touches"', 'counter_node = "ns=2;s=Others"'),
        ('unit = "mm"\ncounter', 'unit = "mm"\nscale = -1.0\ncounter'),
    ],
)
def test_a_changed_configuration_makes_the_proof_void(
    change: tuple[str, str], acting: MachineConfiguration
) -> None:
    keep_touch_proof(acting, "Z_um", proven=True)
    text = acting.path.read_text("utf-8")
    assert text.count(change[0]) == 1
    acting.path.write_text(text.replace(*change), encoding="utf-8")
    assert unproven_touches(read_machine(acting.path)) == ("Z_um",)


def test_what_touches_are_judged_by_leaves_it_proven(acting: MachineConfiguration) -> None:
    keep_touch_proof(acting, "Z_um", proven=True)
    with acting.path.open("a", encoding="utf-8") as file:
        file.write("noise_um = 0.5\n")
    assert unproven_touches(read_machine(acting.path)) == ()


@pytest.mark.parametrize("text", ["", "[]", "{", '{"Z_um": true}', "[" * 100_000])
def test_a_file_that_says_nothing_proves_nothing(text: str, acting: MachineConfiguration) -> None:
    acting.state_file.with_suffix(".proofs").write_text(text, encoding="utf-8")
    assert unproven_touches(acting) == ("Z_um",)


# ---- the command ---------------------------------------------------------------------------------


def test_the_command_refuses_what_is_not_touched(tmp_path: Path) -> None:
    path = configured(tmp_path, "")
    with pytest.raises(ConfigurationError) as caught:
        commission.run(_arguments(path))
    assert caught.value.code == "touches_not_read"


def test_the_step_of_touches_is_far_above_their_noise(
    acting: MachineConfiguration,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setattr("sys.stdin", None)
    monkeypatch.setattr(commission, "_asked", lambda _: False)
    assert commission.run(_arguments(acting.path)) == 1
    assert "the offset goes by +20 um" in capsys.readouterr().out


def _arguments(path: Path) -> Namespace:
    parser = ArgumentParser()
    commission.add_arguments(parser)
    return parser.parse_args([str(path), "--touch"])
