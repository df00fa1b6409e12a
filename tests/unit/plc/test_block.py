"""The exported block against `cycle`: the same numbers, bit for bit; single laws."""

import math
import random
from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from enum import StrEnum
from itertools import pairwise
from typing import Any

import pytest

from tests.proofs import quick_first
from tests.unit.plc.compiled import Compiled, compiled
from tests.unit.plc.plc_scenarios import (
    DURATIONS,
    REASONS,
    STATES,
    CycleDriver,
    MoodPlant,
    quiet_inputs,
    random_settings,
    with_witness,
)
from thermaxis.compensation import (
    STATED,
    Compensation,
    CompensationModel,
    CycleOutput,
    GainPoint,
    Limits,
    Outcome,
    Output,
    Part,
    Provenance,
    Quality,
    Reason,
    SampleQuality,
    Section,
    SensorRules,
    SupervisorRules,
    SupervisorState,
    TrainingLog,
)
from thermaxis.plc import (
    Block,
    CallSequence,
    CycleBlock,
    PlcSettings,
    PlcStep,
    export_settings,
    interface_of,
)

EXACT_CYCLES_S = (1.0, 10.0, 0.5, 0.125, 2.0)


# ---- settings and blocks ------------------------------------------------------------------------


def some_settings(seed: int, *, double: bool = True) -> PlcSettings:
    """Return a random model whose rules are a few cycles long, each of them by chance."""
    rng = random.Random(seed)  # noqa: S311 - a test that can be repeated
    cycle_s = EXACT_CYCLES_S[seed % len(EXACT_CYCLES_S)]
    plain = random_settings(seed, cycle_s=cycle_s, double=double)
    cycles = {name: rng.choice((0.0, 1.0, 2.5, 4.0, 7.0, 12.0)) for name in DURATIONS}
    held_s = rng.choice((0.0, 3.0, 4.5)) * cycle_s
    compensation = plain.compensation
    sensors = {
        channel: replace(
            sensor,
            largest_rate_k_per_s=rng.choice((0.1, 0.37)) / cycle_s,
            frozen_s=rng.choice((0.0, 6.0, 20.0)) * cycle_s,
        )
        for channel, sensor in compensation.sensors.items()
    }
    limits = {
        name: Limits(
            rng.choice((4.0, 9.0, 30.0)),
            rng.choice((0.3, 2.0, 11.0)) / cycle_s,
            rng.choice((0.0, 31.0)),
            rng.choice((0.0, 0.4)),
            largest_trim_um=3.0,
        )
        for name in compensation.limits
    }
    changed = replace(
        compensation,
        model=replace(compensation.model, longest_hold_s=held_s),
        supervisor=SupervisorRules(**{name: n * cycle_s for name, n in cycles.items()}),
        sensors=sensors,
        limits=limits,
        validity_margin_k=rng.choice((0.7, 5.0)),
    )
    return with_witness(replace(plain, compensation=changed), seed)


def number_of(member: StrEnum) -> int:
    """Return the number that the block says for a member: a bit of a word, or its place."""
    place = list(type(member)).index(member)
    return 2**place if isinstance(member, Reason | Outcome) else place


# ---- equality -----------------------------------------------------------------------------------


def run(
    settings: PlcSettings, steps: Callable[[CycleBlock], Iterable[PlcStep]]
) -> list[Mapping[str, Any]]:
    """Run `cycle` and the exported block side by side, and fail at the first difference."""
    block = compiled(settings)
    said: list[Mapping[str, Any]] = []
    for call, (inputs, wanted) in enumerate(steps(CycleBlock(settings))):
        said.append(block.step(inputs))
        assert said[-1] == wanted, (call, inputs)
    return said


def moods(settings: PlcSettings, calls: int, seed: int) -> list[Mapping[str, Any]]:
    return run(settings, lambda block: MoodPlant(settings, seed).steps(block, calls))


@pytest.mark.parametrize("seed", quick_first(2, range(6)))
def test_the_block_equals_the_cycle_bit_for_bit_whatever_comes(seed: int) -> None:
    assert len({output["state"] for output in moods(some_settings(seed), 600, 100 + seed)}) > 3


@pytest.mark.proof
@pytest.mark.parametrize(("seed", "cycle_s"), [(0, 10.0), (3, 10.0)])
def test_the_sequence_of_the_test_vectors_is_what_the_block_does(seed: int, cycle_s: float) -> None:
    settings = random_settings(seed, cycle_s=cycle_s)
    said = run(settings, lambda block: CallSequence(settings, block=block).steps())
    assert {output["state"] for output in said} == set(range(len(STATES)))


@pytest.mark.parametrize("seed", quick_first(1, range(2)))
def test_with_a_cycle_that_binary_numbers_do_not_hold_the_first_minute_differs_by_rounding_only(
    seed: int,
) -> None:
    """No time limit is met within it, so that only the elapsed times differ in their last bit."""
    cycle_s = 0.1
    rng = random.Random(seed)  # noqa: S311 - a seeded world
    plain = random_settings(seed, cycle_s=cycle_s).compensation
    rules = {c: replace(r, frozen_s=0.0) for c, r in plain.sensors.items()}
    quiet = SupervisorRules(settle_s=0.25, recovery_delay_s=0.15)
    settings = export_settings(
        replace(plain, sensors=rules, supervisor=quiet), cycle_s=cycle_s, name="axis"
    )
    block, driver = compiled(settings), CycleDriver(settings)
    values = [20.0] * len(settings.names.channels)
    sent = (0.0,) * len(settings.names.outputs)
    active = 0
    for call in range(600):
        values = [v + rng.uniform(0.0, 0.02) for v in values]
        told = quiet_inputs(settings, values, sent) | {"enable": call > 0}
        block.tell(told)
        output = driver.told(told)
        sent = output.correction_um
        for stem, wanted in zip(settings.names.outputs, output.model_um, strict=True):
            assert getattr(block, f"model_{stem}") == pytest.approx(wanted, rel=1e-12, abs=1e-12)
        active += output.state is SupervisorState.ACTIVE and block.state == 2
    assert active > 590


def a_large_model() -> PlcSettings:
    """Return nearly as much as a block takes: 8 outputs, 48 parts, 96 sections, 32 channels."""
    rng = random.Random(1)  # noqa: S311 - a seeded world
    points = tuple(GainPoint(100.0 * j, 1.0 + j) for j in range(5))
    outputs = tuple(
        Output(
            f"axis {axis} um",
            tuple(
                Part(
                    f"part {k}",
                    f"T{(6 * axis + k) % 32}",
                    f"T{(6 * axis + k + 5) % 32}",
                    1.0,
                    tuple(Section(rng.uniform(-5, 5), rng.uniform(60, 9000)) for _ in range(2)),
                    delay_s=float(k % 3),
                    gain_by_diameter=points,
                    lowest_k=-3.0,
                    highest_k=5.0,
                )
                for k in range(6)
            ),
        )
        for axis in range(8)
    )
    model = CompensationModel(outputs=outputs, input_filter_s=10.0)
    rules = SensorRules(lowest_c=1.0, highest_c=90.0)
    compensation = Compensation(
        model=model,
        sensors=dict.fromkeys(model.channels, rules),
        limits={output.name: Limits(50.0, 1.0) for output in outputs},
    )
    return export_settings(compensation, cycle_s=1.0, name="every axis")


def test_a_large_model_equals_the_cycle() -> None:
    assert len({output["state"] for output in moods(a_large_model(), 200, 3)}) > 2


def test_the_block_has_the_inputs_and_outputs_that_the_interface_names() -> None:
    face = interface_of(one_section(double=True))
    assert [v.name for v in face.inputs] == [
        "init", "cycle_time_s", "enable", "hold", "reset", "diameter_mm", "diameter_known",
        "t_spindle", "ok_spindle", "trim_z_um", "interlocks_met", "connected", "other_compensation",
        "read_z_um", "read_ok",
    ]  # fmt: skip
    assert [v.name for v in face.outputs] == [
        "correction_z_um", "model_z_um", "wanted_z_um", "weight_z_um", "limit_z_um",
        "added_z_um", "to_go_z_um", "part_spindle", "quality_spindle", "state", "enabled", "held",
        "linked", "settled", "standing", "fault_word", "model_quality", "outcome_word", "refused",
        "heartbeat",
    ]  # fmt: skip
    assert [(v.name, v.start) for v in face.identity] == [
        ("library_version", 3.0), ("model_id_1", float(0xABC)), ("model_id_2", float(0xDEF)),
    ]  # fmt: skip


# ---- single laws --------------------------------------------------------------------------------


def one_section(*, double: bool, tau_s: float = 1200.0, cycle_s: float = 1.0) -> PlcSettings:
    part = Part("spindle", "spindle", "", 2.0, (Section(8.0, tau_s),), delay_s=3.2 * cycle_s)
    model = CompensationModel(
        outputs=(Output("Z_um", (part,)),),
        reference=STATED,
        reference_c={"spindle": 20.0},
        provenance=Provenance(
            method="output error",
            program="thermaxis",
            date="2026-11-21",
            logs=(TrainingLog("warm up.csv", "", 3600),),
            figures={"Z_um.fit_percent": 93.25},
        ),
        warnings=("the log is short",),
    )
    compensation = Compensation(
        model=model,
        sensors={"spindle": SensorRules(lowest_c=1.0, highest_c=90.0, step_k=50.0, frozen_s=0.0)},
        limits={"Z_um": Limits(1000.0, 1000.0)},
        supervisor=SupervisorRules(settle_s=2.0, recovery_delay_s=1.0),
    )
    return export_settings(
        compensation,
        cycle_s=cycle_s,
        name="Z axis",
        double=double,
        model_sha256="abcdef" + "0" * 58,
    )


@pytest.mark.parametrize("double", [True, False])
def test_a_delayed_step_answers_as_its_closed_form_says(double: bool) -> None:
    settings = one_section(double=double)
    block = compiled(settings)
    sent = (0.0,)
    for call in range(3000):
        told = quiet_inputs(settings, [20.0 if call < 10 else 30.0], sent) | {"enable": call > 0}
        block.tell(told)
        sent = (block.correction_z_um,)
        seconds = max(call - 13, -1)
        response = 0.0 if seconds < 0 else 2.0 + 8.0 * (1.0 - math.exp(-seconds / 1200.0))
        assert block.model_z_um == pytest.approx(10.0 * response, abs=1e-10 if double else 2e-4), (
            call
        )
    assert block.correction_z_um == -block.model_z_um


def heartbeat_of(block: Compiled) -> int:
    block.call()
    return block.heartbeat


@pytest.mark.proof
def test_the_heartbeat_counts_to_32767_and_begins_at_zero() -> None:
    block = compiled(one_section(double=True))
    beats = [heartbeat_of(block) for _ in range(32_770)]
    assert beats[:2] == [1, 2]
    assert beats[32_765:] == [32_766, 32_767, 0, 1, 2]


def test_a_longest_delay_is_one_array_and_the_block_says_the_same() -> None:
    plain = one_section(double=True).compensation
    part = replace(plain.model.outputs[0].parts[0], delay_s=10_000.0)
    model = replace(plain.model, outputs=(replace(plain.model.outputs[0], parts=(part,)),))
    settings = export_settings(replace(plain, model=model), cycle_s=1.0, name="z")
    assert "ARRAY[0..9999] OF LREAL" in Block(settings=settings).st()["tx_z.st"]
    side_by_side(settings, [{}] * 5, [24.0])


def side_by_side(
    settings: PlcSettings,
    rows: list[dict[str, Any]],
    values: list[float],
) -> list[CycleOutput]:
    """Run block and `cycle()` over quiet inputs with some that differ; the machine obeys.

    It is enabled from the second call on: the level of the first asks for nothing.
    """
    block, driver = compiled(settings), CycleDriver(settings)
    said: list[CycleOutput] = []
    sent = (0.0,) * len(settings.names.outputs)
    for call, row in enumerate(rows):
        told = quiet_inputs(settings, values, sent) | {"enable": call > 0} | row
        block.tell(told)
        said.append(driver.told(told))
        wanted = driver.by_name()
        assert {name: getattr(block, name) for name in wanted} == wanted, call
        sent = said[-1].correction_um
    return said


Stated = tuple[PlcSettings, list[dict[str, Any]], list[float]]


def held_again() -> Stated:
    """The connection comes back again and again, never for as long as it takes to heal."""
    plain = one_section(double=True).compensation
    rules = SupervisorRules(settle_s=2.0, recovery_delay_s=5.0, input_timeout_s=1.0,
                            hold_connection_s=20.0, hold_input_s=4.0,
                            hold_operator_s=4.0)  # fmt: skip
    settings = export_settings(replace(plain, supervisor=rules), cycle_s=1.0, name="z")
    rows: list[dict[str, Any]] = [{}] * 10
    rows += [{"connected": k % 6 >= 3} for k in range(60)]
    return settings, rows, [24.0]


def test_whatever_comes_and_goes_a_hold_ends() -> None:
    settings, rows, values = held_again()
    rules = settings.compensation.supervisor
    said = side_by_side(settings, rows, values)
    states = [output.state for output in said]
    assert states[9] is SupervisorState.ACTIVE
    held = states.count(SupervisorState.HOLDING)
    assert held == rules.max_hold_s + 1.0
    assert states[10 + held] is SupervisorState.FADING


def jumped_after_a_loss() -> Stated:
    """A sensor that was lost for long may have moved far, and that does not shrink by a jump.

    Before, it jumps by less than twice its step and waits, and so again on its way back.
    """
    plain = one_section(double=True).compensation
    rules = SensorRules(lowest_c=1.0, highest_c=90.0, step_k=0.5, largest_rate_k_per_s=0.1,
                        frozen_s=0.0)  # fmt: skip
    settings = export_settings(replace(plain, sensors={"spindle": rules}), cycle_s=1.0, name="z")
    lost, jumped = {"ok_spindle": False}, {"t_spindle": 60.0}
    rows: list[dict[str, Any]] = [*[{}] * 3, *[{"t_spindle": 21.2}] * 10, *[{}] * 10]
    rows += [*[lost] * 30, *[jumped] * 5, {"t_spindle": 23.4}, {"t_spindle": 27.0}]
    return settings, rows, [20.0]


def test_an_allowance_beyond_two_steps_stays() -> None:
    said = side_by_side(*jumped_after_a_loss())
    assert [output.qualities[0] for output in said[-7:]] == [
        *[SampleQuality.TOO_FAST] * 5,
        SampleQuality.GOOD,
        SampleQuality.TOO_FAST,
    ]


LATE: dict[str, Any] = {"cycle_time_s": 5.0}
LOST: dict[str, Any] = {"ok_spindle": False}
OTHER: dict[str, Any] = {"t_spindle": 24.0}
GAP: dict[str, Any] = {"cycle_time_s": 64.0 * 3600.0}
# Rows before the quiet ones, the call from which the value stands still, and the call that is
# frozen: a call that comes too late has the time of the last one that came in time.
FROZEN_FROM: tuple[tuple[str, list[dict[str, Any]], int], ...] = (
    ("from the first call", [], 11),
    ("first call too late: from the second", [LATE], 12),
    ("too late, then lost: from its return in call 4", [LATE, LOST, LOST, LOST], 15),
    ("too late, lost in time, too late: from call 2", [LATE, LATE, LOST, LATE], 14),
    ("changed in a late call 3, with the time of call 2", [OTHER, OTHER, OTHER, LATE], 14),
    ("acknowledged before any call in time: from call 2", [LATE, LATE | {"reset": True}], 13),
    ("a weekend in call 5 is not counted", [*[{}] * 5, GAP], 12),
    ("begun anew in call 5", [*[{}] * 5, {"init": True}], 16),
)


def standing_still(rows: list[dict[str, Any]]) -> Stated:
    plain = one_section(double=True).compensation
    rules = SensorRules(lowest_c=1.0, highest_c=90.0, step_k=50.0, frozen_s=10.0)
    settings = export_settings(replace(plain, sensors={"spindle": rules}), cycle_s=1.0, name="z")
    return settings, [*rows, *[{}] * 20], [20.0]


@pytest.mark.parametrize(("words", "rows", "first"), FROZEN_FROM)
def test_a_value_is_frozen_when_it_stood_still_for_longer_than_its_time_since_a_call_in_time(
    words: str, rows: list[dict[str, Any]], first: int
) -> None:
    """A second a call and ten seconds: in the eleventh call after the one it counts from."""
    said = side_by_side(*standing_still(rows))
    frozen = [k for k, output in enumerate(said) if SampleQuality.FROZEN in output.qualities]
    assert frozen == list(range(first, len(said))), words


# ---- an offset that is taken over ---------------------------------------------------------------


def slow_settings() -> PlcSettings:
    """Return settings in which a correction moves by a quarter of a micrometre in a call."""
    plain = one_section(double=True).compensation
    limits = {"Z_um": Limits(1000.0, 0.25, 1000.0)}
    return export_settings(replace(plain, limits=limits), cycle_s=1.0, name="z")


# Connected before anything is read, then lost while it is off and while it is active.
LOST_AND_FOUND: list[dict[str, Any]] = [
    {"read_z_um": 30.0, "read_ok": False},
    {"read_z_um": 30.0, "connected": False},
    {"read_z_um": math.nan},
    {"read_z_um": 30.0, "read_ok": False, "reset": True},
    *[{"read_z_um": 30.0}] * 2,
    *[{}] * 20,
    *[{"connected": False, "read_z_um": 20.0}] * 3,
    {"read_z_um": 20.0, "read_ok": False},
    {"read_z_um": 19.0},
    *[{}] * 10,
    *[{"connected": False, "enable": False, "read_z_um": 5.0}] * 200,
    {"read_z_um": 7.0, "enable": False},
    *[{}] * 5,
]


def test_an_offset_is_taken_over_as_soon_as_it_is_read_and_after_every_lost_connection() -> None:
    said = side_by_side(slow_settings(), LOST_AND_FOUND, [20.0])
    assert [output.correction_um[0] for output in said[:4]] == [0.0] * 4
    assert said[4].before_um[0] == 30.0
    assert Reason.CONNECTION_LOST in said[3].reasons
    assert said[25].state is SupervisorState.ACTIVE
    assert (said[30].before_um[0], said[-6].before_um[0]) == (19.0, 7.0)


def found_outside() -> Stated:
    rows: list[dict[str, Any]] = [{}] * 10
    rows += [{"connected": False}, {"read_z_um": 1000.5}, {"reset": True}, {}]
    rows += [{"reset": True}, *[{"enable": False}] * 3]
    return slow_settings(), rows, [20.0]


def test_an_offset_beyond_the_total_after_a_lost_connection_is_a_fault_until_it_has_come_back() -> (
    None
):
    said = side_by_side(*found_outside())
    assert said[9].state is SupervisorState.ACTIVE
    assert [output.reasons for output in said[11:14]] == [(Reason.OFFSET_OUTSIDE,)] * 3
    assert [output.correction_um[0] for output in said[11:14]] == [1000.25, 1000.0, 999.75]
    assert [output.answers[0].accepted for output in (said[12], said[14])] == [False, True]
    assert said[14].state is SupervisorState.FADING


# ---- a switch that is wired to hold -------------------------------------------------------------


def test_hold_is_a_level_that_holds_whatever_is_enabled_and_is_refused_at_its_rise_alone() -> None:
    settings = slow_settings()
    block, driver = compiled(settings), CycleDriver(settings)
    warm, other = {"t_spindle": 24.0}, {"other_compensation": True}
    held, off = warm | {"hold": True}, {"enable": False}
    rows: list[tuple[str, dict[str, Any], int]] = [
        ("off", warm | off, 2),
        ("held while off", held | off, 3),
        ("enabled while held", held, 12),
        ("let go", warm, 12),
        ("held", held, 3),
        ("disabled while held", held | off, 2),
        ("enabled anew while held", held, 3),
        ("a fault while held", held | other | off, 3),
        ("let go in fault", warm | off, 1),
        ("held in fault", held | off, 3),
        ("acknowledged and enabled in one call", held | {"reset": True}, 1),
        ("held after that", held, 3),
    ]
    seen: dict[str, list[tuple[int, bool, bool, bool]]] = {}
    sent: tuple[float, ...] = (0.0,)
    for words, row, calls in rows:
        for _ in range(calls):
            told = quiet_inputs(settings, [20.0], sent) | row
            block.tell(told)
            output = driver.told(told)
            wanted = driver.by_name()
            assert {name: getattr(block, name) for name in wanted} == wanted, words
            moved = output.correction_um != output.before_um
            seen.setdefault(words, []).append((block.state, block.held, block.refused, moved))
            sent = output.correction_um
    assert [one[1:3] for one in seen["held while off"]] == [(False, True), *[(False, False)] * 2]
    assert {one[1:] for one in seen["enabled while held"]} == {(True, False, False)}
    assert {one[0] for one in seen["enabled while held"]} == {1}  # Warming: nothing moves
    assert seen["let go"][-1] == (2, False, False, True)
    assert seen["held"] == [(3, True, False, False)] * 3
    assert {one[1] for one in seen["disabled while held"]} == {False}
    assert {one[1:3] for one in seen["enabled anew while held"]} == {(True, False)}
    assert [one[2] for one in seen["held in fault"]] == [True, False, False]
    assert seen["acknowledged and enabled in one call"][0][1:3] == (True, False)
    assert {one[1] for one in seen["held after that"]} == {True}


# ---- a trim in the state Fault ------------------------------------------------------------------


@pytest.mark.parametrize("double", [True, False])
def test_a_trim_is_taken_back_in_the_state_fault_and_none_is_given_there(double: bool) -> None:
    settings = one_section(double=double)
    block = compiled(settings)
    sent: tuple[float, ...] = (0.0,)
    rows: list[dict[str, Any]] = [{"enable": False}, {"trim_z_um": 4.0}]
    other = {"other_compensation": True}
    rows += [other | {"trim_z_um": um} for um in (4.0, 3.0, 0.0, 2.0, 0.0)]
    trimmed: list[tuple[int, float, bool]] = []
    for row in rows:
        told = quiet_inputs(settings, [20.0], sent) | row
        block.tell(told)
        trimmed.append((block.state, block.wanted_z_um, block.refused))
        sent = (block.correction_z_um,)
    off, warming, fault = (STATES.index(s) for s in (SupervisorState.OFF, SupervisorState.WARMING,
                                                     SupervisorState.FAULT))  # fmt: skip
    assert trimmed == [
        (off, 0.0, False),
        (warming, 4.0, False),
        (fault, 4.0, False),
        (fault, 4.0, True),
        (fault, 0.0, False),
        (fault, 0.0, True),
        (fault, 0.0, False),
    ]


# ---- the axis -----------------------------------------------------------------------------------


def largest_jump_um(seed: int, calls: int) -> tuple[float, float]:
    """Return the largest change of an axis that has what it is written, and the longest way.

    The axis takes the correction where it is linked and not Off. While it cannot be reached, or is
    Off, somebody may set another offset; the PLC is switched off and on now and then, and reading
    fails by chance.
    """
    rng = random.Random(seed)  # noqa: S311 - a seeded world
    settings = slow_settings()
    block, first = compiled(settings), True
    axis_um, temperature_c = rng.uniform(-30.0, 30.0), 20.0
    connected = read_ok = True
    largest_um = way_um = 0.0
    for _ in range(calls):
        if rng.random() < 0.004:
            block.switch_on()
            first = True
        connected = rng.random() < (0.97 if connected else 0.1)
        read_ok = rng.random() < (0.97 if read_ok else 0.3)
        off = first or block.state == 0
        if (not connected and rng.random() < 0.05) or (off and rng.random() < 0.3):
            axis_um = rng.uniform(-30.0, 30.0)
        temperature_c += rng.uniform(-0.05, 0.05)
        told = quiet_inputs(settings, [temperature_c], (axis_um if read_ok else 0.0,))
        told |= {"connected": connected, "read_ok": read_ok, "reset": rng.random() < 0.02}
        wanted = not first and rng.random() < (0.3 if off else 0.98)
        block.tell(told | {"enable": wanted})
        first = False
        assert block.linked <= connected
        if block.linked and block.state != 0:
            largest_um = max(largest_um, abs(block.correction_z_um - axis_um))
            way_um += abs(block.correction_z_um - axis_um)
            axis_um = block.correction_z_um
    return largest_um, way_um


@pytest.mark.parametrize("seed", range(2))
def test_an_axis_never_jumps_whatever_stands_there_after_losses_and_restarts(seed: int) -> None:
    largest_um, way_um = largest_jump_um(seed, 4000)
    assert largest_um == pytest.approx(0.25, abs=1e-12)  # reached, never passed
    assert way_um > 50.0


NEAR_UM = 0.4


def reset_in_every_state() -> list[dict[str, Any]]:
    """Return rows in which reset rises in every state but Off, while the machine says otherwise.

    What it says is within the tolerance: only to take it over would make a difference.
    """
    rows: list[dict[str, Any]] = [{}, {"t_spindle": 20.0}, {"t_spindle": 24.0, "near": True}]
    rows += [{"t_spindle": 24.0}] * 18 + [{"t_spindle": 24.0, "near": True}]
    held = {"t_spindle": 24.0, "hold": True}
    rows += [held, held, held | {"near": True}, held]
    rows += [{"t_spindle": 24.0}] * 3
    other = {"t_spindle": 24.0, "other_compensation": True}
    rows += [other, other | {"near": True}, other, {"t_spindle": 24.0, "near": True}]
    off = {"t_spindle": 24.0, "enable": False}
    return [*rows, off, off | {"near": True}, off]


def with_read_back(rows: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Return the rows with reset and a read-back beside what `cycle()` alone says before."""
    driver, settings = CycleDriver(slow_settings()), slow_settings()
    sent, made = (0.0,), list[dict[str, Any]]()
    for row in rows:
        told = {name: value for name, value in row.items() if name != "near"}
        if "near" in row:
            told |= {"reset": True, "read_z_um": sent[0] + NEAR_UM}
        made.append(told)
        enable = {"enable": driver.calls > 0}
        sent = driver.told(quiet_inputs(settings, [20.0], sent) | enable | told).correction_um
    return made


def test_reset_takes_no_offset_over_in_any_other_state_than_off() -> None:
    rows = with_read_back(reset_in_every_state())
    said = side_by_side(slow_settings(), rows, [20.0])
    # The state that the call before has left, and whether the correction went on from its own.
    seen = {
        before.state: output.before_um == before.correction_um
        for before, output, row in zip(said, said[1:], rows[1:], strict=False)
        if row.get("reset")
    }
    assert seen == dict.fromkeys(set(SupervisorState) - {SupervisorState.OFF}, True)


# ---- the first call ------------------------------------------------------------------------------


@pytest.mark.parametrize("double", [True, False])
def test_levels_that_stand_when_the_plc_starts_ask_for_nothing_until_they_change(
    double: bool,
) -> None:
    settings = one_section(double=double)
    block = compiled(settings)
    standing = {"enable": True, "hold": True, "reset": True, "trim_z_um": 5.0}
    told = quiet_inputs(settings, [20.0], (0.0,)) | standing
    for _ in range(20):
        block.tell(told)
        said = (block.state, block.enabled, block.refused, block.correction_z_um)
        assert said == (0, False, False, 0.0)
    for enable in (False, True):
        block.tell(told | {"enable": enable, "hold": False})
    assert (block.state, block.enabled, block.wanted_z_um) == (1, True, 0.0)
    block.tell(told | {"hold": False, "trim_z_um": 4.0})
    assert block.wanted_z_um == 4.0
    block.tell(told)
    assert (block.wanted_z_um, block.fault_word & 2 ** REASONS.index(Reason.OPERATOR_HOLD)) == (
        5.0,
        2 ** REASONS.index(Reason.OPERATOR_HOLD),
    )


# ---- the numbers that a PLC program is written against ------------------------------------------


def test_the_numbers_of_the_words_are_those_that_are_published() -> None:
    states = ["Off", "Warming", "Active", "Holding", "Fading", "Fault"]
    assert [number_of(SupervisorState(name)) for name in states] == [0, 1, 2, 3, 4, 5]
    assert {reason.name: number_of(reason) for reason in Reason} == {
        "DISABLED": 1,
        "SETTLING": 2,
        "RECOVERING": 4,
        "INPUT_BAD": 8,
        "CONNECTION_LOST": 16,
        "INTERLOCK_OPEN": 32,
        "OPERATOR_HOLD": 64,
        "HOLD_EXPIRED": 128,
        "READ_BACK_DIFFERS": 256,
        "LONG_AT_LIMIT": 512,
        "DOUBLE_COMPENSATION": 1024,
        "OFFSET_OUTSIDE": 2048,
    }
    assert {quality.name: number_of(quality) for quality in SampleQuality} == {
        "GOOD": 0,
        "REDUNDANT": 1,
        "MISSING": 2,
        "STATUS_BAD": 3,
        "OLD": 4,
        "NO_TIME_STAMP": 5,
        "OUT_OF_RANGE": 6,
        "TOO_FAST": 7,
        "FROZEN": 8,
        "DISAGREES": 9,
    }
    assert {outcome.name: number_of(outcome) for outcome in Outcome} == {
        "STARTED": 1,
        "WAITING": 2,
        "CLOCK_BACKWARD": 4,
        "CLOCK_UNUSABLE": 8,
        "CLOCK_STILL": 16,
        "STATE_UNUSABLE": 32,
        "GAP": 64,
        "INPUT_HELD": 128,
        "INPUT_FAILED": 256,
        "DIAMETER_HELD": 512,
        "DIAMETER_UNKNOWN": 1024,
        "OUTSIDE_VALIDITY": 2048,
    }
    assert {str(quality): number_of(quality) for quality in Quality} == {
        "good": 0,
        "held": 1,
        "bad": 2,
    }
    texts = {v.name: v.text for v in interface_of(one_section(double=True)).outputs}
    assert texts["state"] == "0 Off, 1 Warming, 2 Active, 3 Holding, 4 Fading, 5 Fault"
    assert texts["model_quality"] == "0 good, 1 held, 2 bad"


def opened_at_zero() -> Stated:
    """An interlock opens while it is active and the correction is zero."""
    return slow_settings(), [*[{}] * 10, *[{"interlocks_met": False}] * 3, *[{}] * 10], [20.0]


def test_an_interlock_that_opens_at_zero_fades_and_then_warms_up_again() -> None:
    states = [output.state for output in side_by_side(*opened_at_zero())]
    active, fading, warming = (SupervisorState(s) for s in ("Active", "Fading", "Warming"))
    assert states[9:13] == [active, fading, warming, warming]
    assert states[-1] is active


def acknowledged_while_it_differs() -> Stated:
    """A fault by another compensation is acknowledged while the read-back has differed for long."""
    differs = {"read_z_um": 5.0}
    rows: list[dict[str, Any]] = [*[{}] * 8, *[{"other_compensation": True}] * 2]
    rows += [*[differs] * 15, differs | {"reset": True}, *[differs] * 4]
    return slow_settings(), rows, [20.0]


def test_after_a_fault_is_acknowledged_the_read_back_may_differ_for_its_time_again() -> None:
    said = side_by_side(*acknowledged_while_it_differs())
    assert said[24].state is SupervisorState.FAULT
    assert {output.state for output in said[25:]} == {SupervisorState.OFF}  # and no new fault


def acknowledged_with_every_request() -> Stated:
    """Faults are acknowledged while the hold stands, and with enable and a trim in one call."""
    other, off = {"other_compensation": True}, {"enable": False}
    held = {"hold": True}
    rows: list[dict[str, Any]] = [*[{}] * 8, held, held | other, held | {"reset": True}]
    rows += [*[held] * 2, {}, off, *[{}] * 4, other, off]
    rows += [{"reset": True, "trim_z_um": 0.5}, *[{"trim_z_um": 0.5}] * 3]
    return slow_settings(), rows, [20.0]


def test_reset_enable_and_a_trim_in_one_call_are_taken_in_this_order_and_hold_is_forgotten() -> (
    None
):
    said = side_by_side(*acknowledged_with_every_request())
    states = [output.state for output in said]
    assert states[9] is SupervisorState.FAULT
    assert states[19] is SupervisorState.FAULT
    assert said[-1].trim_um == (0.5,)
    assert states[-1] is SupervisorState.ACTIVE


def differs_for_less_than_a_cycle() -> Stated:
    """The read-back may differ for half a cycle: a fault follows from the second one."""
    settings = slow_settings()
    rules = replace(settings.compensation.supervisor, read_back_s=0.5)
    rows: list[dict[str, Any]] = [*[{}] * 8, {"read_z_um": 5.0}, *[{}] * 3]
    rows += [{"read_z_um": 5.0}] * 3
    changed = replace(settings.compensation, supervisor=rules)
    return replace(settings, compensation=changed), rows, [20.0]


def test_no_fault_follows_from_one_cycle_in_which_the_read_back_differs() -> None:
    states = [output.state for output in side_by_side(*differs_for_less_than_a_cycle())]
    assert states[8:14] == [SupervisorState.ACTIVE] * 5 + [SupervisorState.FAULT]


def found_after_long_fading() -> Stated:
    """An offset is found when it has faded for longer than anything is held, and is at zero."""
    settings = slow_settings()
    rules = SupervisorRules(settle_s=2.0, recovery_delay_s=5.0, input_timeout_s=1.0,
                            hold_input_s=3.0, hold_connection_s=3.0,
                            hold_operator_s=3.0)  # fmt: skip
    warm = {"t_spindle": 28.0}
    opened = warm | {"interlocks_met": False}
    rows: list[dict[str, Any]] = [*[warm] * 60, *[opened] * 60]
    rows += [warm | {"connected": False}, warm | {"read_z_um": 5.0}, *[warm] * 3]
    changed = replace(settings.compensation, supervisor=rules)
    return replace(settings, compensation=changed), rows, [20.0]


def test_what_is_found_after_long_fading_fades_too() -> None:
    said = side_by_side(*found_after_long_fading())
    assert said[59].state is SupervisorState.ACTIVE
    warming, fading = SupervisorState.WARMING, SupervisorState.FADING
    assert [output.state for output in said[114:122]] == [fading, *[warming] * 6, fading]


def read_on_the_other_side() -> Stated:
    """The control reports an offset on the other side of zero until that is a fault, and on."""
    rows: list[dict[str, Any]] = []
    for value_c, read_um in ((12.0, -5.0), (28.0, 5.0)):
        warm = {"t_spindle": value_c}
        begun = {"init": True, "enable": False, "read_z_um": -0.02 * read_um}
        rows += [warm | begun, *[warm] * 20, *[warm | {"read_z_um": read_um}] * 40]
    return slow_settings(), rows, [20.0]


def test_after_a_fault_no_correction_goes_beyond_zero_to_what_is_reported() -> None:
    said = side_by_side(*read_on_the_other_side())
    for last, sign in ((60, 1.0), (121, -1.0)):
        assert said[last].state is SupervisorState.FAULT
        assert sign * said[last].correction_um[0] >= 0.0


def late_while_fading() -> Stated:
    """A call comes too late while a correction fades, on both sides of zero."""
    rows: list[dict[str, Any]] = []
    for value_c in (28.0, 12.0):
        warm, off = {"t_spindle": value_c}, {"t_spindle": value_c, "enable": False}
        rows += [*[warm] * 20, *[off] * 2, off | LATE, *[off] * 30]
    return slow_settings(), rows, [20.0]


def test_in_a_call_that_comes_too_late_a_correction_fades_on_at_its_rate_on_both_sides() -> None:
    said = side_by_side(*late_while_fading())
    for late in (22, 75):
        states = {output.state for output in said[late - 1 : late + 2]}
        fading = [abs(output.correction_um[0]) for output in said[late - 1 : late + 2]]
        assert states == {SupervisorState.FADING}
        assert [fading[0] - um for um in fading] == [0.0, 0.25, 0.5]


# ---- a start and a gap --------------------------------------------------------------------------


def at_its_limit_after_a_gap() -> Stated:
    """The model asks for more than the limit after a gap that is longer than it may."""
    settings = slow_settings()
    limits = {"Z_um": Limits(5.0, 1000.0)}
    hot = {"t_spindle": 28.0}
    rows: list[dict[str, Any]] = [*[{}] * 8, hot | {"cycle_time_s": 7200.0}, *[hot] * 6]
    compensation = replace(settings.compensation, limits=limits)
    return replace(settings, compensation=compensation), rows, [20.0]


def test_no_fault_follows_from_a_gap_alone_and_one_from_the_call_after_it() -> None:
    states = [output.state for output in side_by_side(*at_its_limit_after_a_gap())]
    assert states[7] is SupervisorState.ACTIVE
    assert SupervisorState.FAULT not in states[:9]
    assert states[9] is SupervisorState.FAULT


def begun_anew() -> Stated:
    """It begins anew after long losses that go on, and in a call that comes at a wrong time."""
    settings = slow_settings()
    rules = replace(
        settings.compensation.supervisor, settle_s=5.0, hold_interlock_s=20.0, hold_input_s=20.0
    )
    rows: list[dict[str, Any]] = [{}] * 40
    for lost in ({"interlocks_met": False}, {"ok_spindle": False}):
        rows += [*[lost] * 30, lost | {"init": True, "enable": False}, *[lost] * 10, *[{}] * 20]
    late = {"cycle_time_s": 5.0}
    rows += [late | {"init": True, "enable": False}, late, *[{}] * 20]
    changed = replace(settings.compensation, supervisor=rules)
    return replace(settings, compensation=changed), rows, [25.0]


def called_after_gaps() -> Stated:
    """It is called at the borders of a cycle and of a gap, and with a trim for a shift."""
    settings = slow_settings()
    gap_s = settings.compensation.model.longest_gap_s
    times_s = [settings.shortest_cycle_s, settings.longest_cycle_s, gap_s, 2.0 * gap_s, 2.0 * gap_s]
    rows: list[dict[str, Any]] = [{}] * 5
    for time_s in (*times_s, math.inf):
        rows += [{"cycle_time_s": time_s}, *[{}] * 10]
    return (
        settings,
        [row | {"trim_z_um": 3.0 * (call > 1)} for call, row in enumerate(rows)],
        [25.0],
    )


def fading_late() -> Stated:
    """It is called too late and too early while it is active, fades, and has a fault."""
    late, early, off = {"cycle_time_s": 1.2}, {"cycle_time_s": 0.8}, {"enable": False}
    rows: list[dict[str, Any]] = [*[{}] * 30, late, late, {}, {}, off, *[off | late] * 8]
    rows += [*[off | early] * 3, off | {"cycle_time_s": math.nan}, *[off | late] * 30]
    stuck = late | {"read_z_um": -20.0}
    rows += [off, *[{}] * 30, *[stuck] * 15, *[late | {"read_z_um": 2.0}] * 5]
    return slow_settings(), rows, [25.0]


def made_up_for() -> Stated:
    """Calls come too late, also while a temperature is lost, for longer than a gap together."""
    settings = slow_settings()
    model = replace(settings.compensation.model, longest_gap_s=100.0)
    lost: dict[str, Any] = {"ok_spindle": False}
    rows: list[dict[str, Any]] = [*[{}] * 20, *[{"cycle_time_s": 46.5}, *[{}] * 8] * 2]
    rows += [{"cycle_time_s": 25.0}, *[lost] * 3, {}, *[lost] * 2, *[{}] * 5]
    rows += [*[{"cycle_time_s": 0.5}] * 5, *[{}] * 3, *[{"cycle_time_s": 60.0}] * 2, *[{}] * 15]
    rows += [{"cycle_time_s": 100.0}, {}, {"cycle_time_s": 101.0}, *[{}] * 5]
    rows += [{"cycle_time_s": 30.0}, {"init": True, "enable": False}, *[{}] * 10]
    changed = replace(settings.compensation, model=model)
    warm = [{"t_spindle": 20.0 + 0.05 * call} | row for call, row in enumerate(rows)]
    return replace(settings, compensation=changed), warm, [20.0]


def test_the_time_of_late_calls_is_made_up_for_as_the_reference_does() -> None:
    side_by_side(*made_up_for())


def test_a_call_that_comes_too_late_goes_on_towards_zero_alone() -> None:
    said = side_by_side(*fading_late())
    moved_um = [round(b.correction_um[0] - a.correction_um[0], 9) for a, b in pairwise(said)]
    assert moved_um[29:31] == [0.0, 0.0], "active"
    assert moved_um[33:46] == [0.25] * 9 + [0.0] * 4, "fading, but not too early"
    ends = next(k for k in range(46, len(said)) if said[k].correction_um == (0.0,))
    assert set(moved_um[46 : ends - 1]) == {0.25}
    assert SupervisorState.OFF in {one.state for one in said[ends : ends + 3]}


def test_a_block_that_begins_anew_has_lost_nothing_yet() -> None:
    said = side_by_side(*begun_anew())
    anew = [call for call, row in enumerate(begun_anew()[1]) if row.get("init")]
    assert [said[call].state for call in anew] == [SupervisorState.OFF] * 3
    assert [said[call + 1].state for call in anew] == [SupervisorState.WARMING] * 3
    assert Reason.SETTLING in said[anew[2] + 1].reasons


def test_a_gap_is_longer_than_the_longest_gap_and_a_trim_expires_by_it() -> None:
    said = side_by_side(*called_after_gaps())
    gaps = [call for call, output in enumerate(said) if Outcome.GAP in output.outcomes]
    assert gaps == [38, 49, 60]
    assert [said[call].trim_um[0] for call in gaps] == [3.0, 3.0, 0.0]


def resting() -> Stated:
    """A sensor stands beside another one that stands, goes up and down, and is lost."""
    plain = one_section(double=True, cycle_s=60.0)
    own = replace(plain.compensation.sensors["spindle"], frozen_s=600.0)
    sensors = {"spindle": replace(own, moves_with="air", rests_k=0.2), "air": own}
    rows: list[dict[str, Any]] = []
    air_c = 20.0
    for calls, spindle_c, change_k, first in (
        (70, 25.0, 0.001, {}),
        (40, 25.0, 0.05, {"reset": True}),
        (30, 25.5, 0.05, {}),
        (60, 26.0, -0.1, {}),
        (70, 26.0, 0.001, {"init": True}),
        (25, 25.0, 0.0, {}),
        (15, 24.0, 0.001, {}),
        (3, 24.0, 0.0, GAP),
    ):
        for call in range(calls):
            air_c += change_k
            told = {"t_spindle": spindle_c, "t_air": air_c, "ok_air": change_k != 0.0}
            rows.append(told | (first if call == 0 else {}))
    compensation = replace(plain.compensation, sensors=sensors)
    return replace(plain, compensation=compensation), rows, [25.0, 20.0]


def test_a_sensor_may_stand_for_longer_beside_one_that_hardly_moves() -> None:
    rows = resting()[1]
    frozen = [one.qualities[0] is SampleQuality.FROZEN for one in side_by_side(*resting())]
    begins = [k for k in range(1, len(rows)) if frozen[k] and not frozen[k - 1]]
    assert begins[0] == 61, "six times as long"
    assert 70 + 11 < begins[1] < 70 + 40, "when the average of the other has gone further"
    assert begins[-1] == len(rows) - 43 + 11, "not beside one that is lost, but in a gap"
    assert len(begins) == 6


def beside_one_that_moves_slowly() -> Stated:
    """A sensor changes while another one moves on, so far in all that it would be frozen."""
    settings, _, values = resting()
    rows = [{"t_spindle": 25.0 + (call > 30), "t_air": 20.0 + 0.02 * call} for call in range(46)]
    return settings, rows, values


def test_how_far_the_other_sensor_has_gone_counts_from_the_last_change() -> None:
    qualities = {one.qualities[0] for one in side_by_side(*beside_one_that_moves_slowly())}
    assert qualities == {SampleQuality.GOOD}


def every_stated() -> list[Stated]:
    """Return the rows that are stated call by call, for the mutants of the library."""
    reset = with_read_back(reset_in_every_state())
    return [
        held_again(),
        jumped_after_a_loss(),
        found_outside(),
        opened_at_zero(),
        acknowledged_while_it_differs(),
        begun_anew(),
        called_after_gaps(),
        fading_late(),
        made_up_for(),
        resting(),
        beside_one_that_moves_slowly(),
        acknowledged_with_every_request(),
        late_while_fading(),
        read_on_the_other_side(),
        differs_for_less_than_a_cycle(),
        found_after_long_fading(),
        at_its_limit_after_a_gap(),
        *(standing_still(rows) for _, rows, _ in FROZEN_FROM),
        (slow_settings(), LOST_AND_FOUND, [20.0]),
        (slow_settings(), reset, [20.0]),
    ]
