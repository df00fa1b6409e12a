"""The tree against `cycle()`: the same numbers, bit for bit, whatever comes."""

import math
import random
from collections.abc import Callable, Iterable
from dataclasses import replace
from functools import lru_cache, partial
from itertools import pairwise
from typing import Any

import numpy as np
import pytest

from tests.unit.plc.plc_scenarios import (
    DURATIONS,
    REASONS,
    STATES,
    CycleBlock,
    CycleDriver,
    MoodPlant,
    as_block,
    quiet_inputs,
    random_settings,
    tell,
)
from tests.unit.plc.small_programs import unused
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
    BlockInstance,
    CallSequence,
    PlcInputs,
    PlcOutputs,
    PlcSettings,
    PlcStep,
    Program,
    build_program,
    check_program,
    export_settings,
)
from thermaxis.plc.blocks import (
    NEVER_OUTCOMES,
    NEVER_QUALITIES,
    number_of,
)
from thermaxis.plc.tree import (
    Assign,
    If,
    Minus,
    Name,
    Statement,
    Two,
    executable,
)
from thermaxis.plc.vectors import by_variable, variable_names

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
    return replace(plain, compensation=changed)


class ProgramBlock:
    """A program executed, such as one with a mistake."""

    def __init__(self, settings: PlcSettings, program: Program) -> None:
        self._make, self._names = executable(program), settings.names
        self._block = self._make()
        self._said = variable_names(settings.names, PlcOutputs._fields).values()

    def step(self, inputs: PlcInputs) -> PlcOutputs:
        if inputs.restart:
            self._block = self._make()
        tell(self._block, by_variable(self._names, inputs))
        self._block.step()
        of = partial(getattr, self._block)
        return PlcOutputs(*(of(n) if isinstance(n, str) else tuple(map(of, n)) for n in self._said))


def run(
    settings: PlcSettings, steps: Callable[[BlockInstance], Iterable[PlcStep]]
) -> list[CycleOutput]:
    """Run block and `cycle()` side by side, and fail at the first difference."""
    driver = CycleDriver(settings)
    said: list[CycleOutput] = []
    for call, (inputs, got) in enumerate(steps(BlockInstance(settings))):
        said.append(driver.step(inputs))
        wanted = as_block(said[-1], driver)
        assert got == wanted, (call, inputs)
    return said


def moods(settings: PlcSettings, calls: int, seed: int) -> list[CycleOutput]:
    return run(settings, lambda block: MoodPlant(settings, seed).steps(block, calls))


# ---- equality -----------------------------------------------------------------------------------


def test_the_tree_equals_the_cycle_bit_for_bit_whatever_comes() -> None:
    states: set[tuple[SupervisorState, SupervisorState]] = set()
    reasons: set[Reason] = set()
    outcomes: set[Outcome] = set()
    samples: set[SampleQuality] = set()
    qualities: set[Quality] = set()
    refused: set[str] = set()
    refusals: set[str] = set()
    moved = limited = weighted = 0
    for seed in (*range(12), 51):  # the last finds an offset outside its limits
        said = moods(some_settings(seed), 700, 1000 + seed)
        states |= {(a.state, b.state) for a, b in pairwise(said)}
        for output in said:
            reasons |= set(output.reasons)
            outcomes |= set(output.outcomes)
            samples |= set(output.qualities)
            qualities.add(output.quality)
            refused |= {a.request.kind for a in output.answers if not a.accepted}
            refusals |= {a.code for a in output.answers if not a.accepted}
            moved += output.correction_um != output.before_um
            limited += any(output.at_limit)
            weighted += any(0.0 < w < 1.0 for w in output.weight)
    assert {a for a, _ in states} == set(SupervisorState)
    assert reasons == set(Reason)
    assert "offset_outside" in refusals
    assert outcomes == set(Outcome) - NEVER_OUTCOMES
    assert samples == set(SampleQuality) - NEVER_QUALITIES
    assert qualities == set(Quality)
    assert refused >= {"enable", "hold", "trim", "diameter", "acknowledge"}
    assert moved > 1000
    assert limited > 100
    assert weighted > 50
    state = SupervisorState
    assert states >= {
        (state.OFF, state.WARMING),
        (state.WARMING, state.ACTIVE),
        (state.WARMING, state.FADING),
        (state.ACTIVE, state.HOLDING),
        (state.ACTIVE, state.FADING),
        (state.ACTIVE, state.FAULT),
        (state.HOLDING, state.ACTIVE),
        (state.HOLDING, state.FADING),
        (state.FADING, state.OFF),
        (state.FADING, state.WARMING),
        (state.FADING, state.ACTIVE),
        (state.FAULT, state.FADING),
        (state.FAULT, state.OFF),
    }


@pytest.mark.parametrize(("seed", "cycle_s"), [(0, 10.0), (3, 10.0), (5, 1.0)])
def test_the_sequence_of_the_test_vectors_is_what_the_cycle_does(seed: int, cycle_s: float) -> None:
    settings = random_settings(seed, cycle_s=cycle_s)
    said = run(settings, lambda block: CallSequence(settings, seed=1, block=block).steps())
    assert {output.state for output in said} == set(SupervisorState)


@pytest.mark.parametrize("seed", range(2))
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
    block, driver = executable(build_program(settings))(), CycleDriver(settings)
    values = [20.0] * len(settings.names.channels)
    sent = (0.0,) * len(settings.names.outputs)
    active = 0
    for call in range(600):
        values = [v + rng.uniform(0.0, 0.02) for v in values]
        told = quiet_inputs(settings, values, sent) | {"enable": call > 0}
        tell(block, told)
        block.step()
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


def test_a_large_model_equals_the_cycle_and_keeps_the_rules_of_the_tree() -> None:
    settings = a_large_model()
    program = build_program(settings)
    check_program(program)
    assert unused(program) == ()
    states = {output.state for output in moods(settings, 200, 3)}
    assert len(states) > 2


@pytest.mark.parametrize("seed", range(2))
def test_in_real_only_the_lag_and_the_rounding_differ_from_the_program_that_equals_the_cycle(
    seed: int,
) -> None:
    single, double = (build_program(some_settings(seed, double=kind)) for kind in (False, True))
    for one, other in zip(single.blocks, double.blocks, strict=True):
        if one.name != "tx_lag":
            # The largest number there is differs with its kind.
            kept = [v for v in one.constants if v.name != "largest_number"]
            assert kept == [v for v in other.constants if v.name != "largest_number"]
            assert replace(one, constants=()) == replace(other, constants=())


def test_the_lag_in_real_is_kahans_sum_of_increments_bit_for_bit() -> None:
    program = build_program(one_section(double=False))
    lag = executable(replace(program, name="tx_lag", blocks=program.blocks[:1]))()
    rng, f = random.Random(1), np.float32  # noqa: S311 - a seeded input
    lag.alpha, lag.start, lag.start_k, lag.u_k = 1e-3, True, 9.0, 9.0
    lag.step()
    lag.start = False
    x, lost, alpha = f(9.0), f(0.0), f(1e-3)
    for _ in range(2000):
        lag.u_k = rng.uniform(8.0, 12.0)
        lag.step()
        d = alpha * (f(lag.u_k) - x) - lost
        x, lost = x + d, (x + d - x) - d
        assert lag.x_k == float(x)


# ---- the program --------------------------------------------------------------------------------


@pytest.mark.parametrize("double", [True, False])
@pytest.mark.parametrize("seed", range(2))
def test_every_program_keeps_the_rules_of_the_tree_and_has_nothing_that_is_not_used(
    seed: int, double: bool
) -> None:
    program = build_program(some_settings(seed, double=double))
    check_program(program)
    assert unused(program) == ()
    assert program.double is double
    assert all(len(line) <= 90 for line in program.head)
    assert all(len(line) <= 90 for block in program.blocks for line in block.remarks)


def test_the_block_has_the_inputs_and_outputs_that_the_interface_names() -> None:
    settings = one_section(double=True)
    main = build_program(settings).blocks[-1]
    assert [v.name for v in main.inputs] == [
        "cycle_time_s", "enable", "hold", "reset", "diameter_mm", "diameter_known", "t_spindle",
        "ok_spindle", "trim_z_um", "interlocks_met", "connected", "other_compensation",
        "read_z_um", "read_ok",
    ]  # fmt: skip
    assert [v.name for v in main.outputs] == [
        "correction_z_um", "model_z_um", "wanted_z_um", "weight_z_um", "limit_z_um",
        "added_z_um", "part_spindle", "quality_spindle", "state", "enabled", "held", "linked",
        "fault_word", "model_quality", "outcome_word", "refused", "heartbeat", "model_id_1",
        "model_id_2",
    ]  # fmt: skip


def test_the_block_says_the_first_digits_of_the_hash_of_its_model() -> None:
    block = executable(build_program(one_section(double=True)))()
    block.step()
    assert (block.model_id_1, block.model_id_2) == (0xABC, 0xDEF)
    texts = {v.name: v.text for v in build_program(one_section(double=True)).blocks[-1].outputs}
    assert texts["model_id_1"] == "hexadecimal digits 1 to 3 of the hash of the model, as a number"
    assert texts["model_id_2"] == "hexadecimal digits 4 to 6 of the hash of the model, as a number"


def test_the_head_says_where_the_model_comes_from_and_how_its_numbers_are_meant() -> None:
    head = "\n".join(build_program(one_section(double=False)).head)
    for said in (
        "tx_z_axis",
        "abcdef",
        "Model date: 2026-11-21",
        "Method: output error",
        "Training log: warm up.csv, 3600 rows",
        "Figure Z_um.fit_percent = 93.25",
        "Warning: the log is short",
        "every 1 s",
        "10 percent",
        "REAL (binary32)",
        "gain 8 um/K, time constant 1200 s",
        "delay 3 cycles = 3 s",
        "Changed by the export: delay of spindle: 3.2 s in the model, 3 s here",
        "Reference of spindle: 20 degC",
        "positive away from it. The correction is minus the model.",
        "0 Off, 1 Warming, 2 Active",
        "Not protected",
    ):
        assert said in head, said


def test_no_output_can_take_the_name_of_another_variable_of_the_block() -> None:
    """An output with the rest of any name behind one of the prefixes still gets its own name."""
    plain = one_section(double=True)
    prefixes = ("correction_", "model_", "wanted_", "weight_", "limit_", "trim_", "read_")
    main = build_program(plain).blocks[-1]
    variables = (*main.inputs, *main.outputs, *main.states, *main.temporaries, *main.constants)
    rests = {
        v.name.removeprefix(p) for v in variables for p in prefixes if v.name.startswith(p)
    } - {"z_um"}
    assert rests >= {"ok", "quality", "runs", "id_1", "id_2"}
    for rest in sorted(rests):
        output = replace(plain.compensation.model.outputs[0], name=rest)
        model = replace(plain.compensation.model, outputs=(output,))
        limits = {rest: Limits(1.0, 1.0)}
        renamed = replace(plain.compensation, model=model, limits=limits)
        check_program(
            build_program(export_settings(renamed, cycle_s=1.0, name="z", model_sha256="ab" * 32))
        )


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
    block = executable(build_program(settings))()
    sent = (0.0,)
    for call in range(3000):
        told = quiet_inputs(settings, [20.0 if call < 10 else 30.0], sent) | {"enable": call > 0}
        tell(block, told)
        block.step()
        sent = (block.correction_z_um,)
        seconds = max(call - 13, -1)
        response = 0.0 if seconds < 0 else 2.0 + 8.0 * (1.0 - math.exp(-seconds / 1200.0))
        assert block.model_z_um == pytest.approx(10.0 * response, abs=1e-10 if double else 2e-4), (
            call
        )
    assert block.correction_z_um == -block.model_z_um


def test_a_slow_section_in_real_comes_to_its_end_where_a_plain_increment_would_not() -> None:
    settings = one_section(double=False, tau_s=36_000.0, cycle_s=0.125)
    program = build_program(settings)
    lag = executable(replace(program, name="tx_lag", blocks=program.blocks[:1]))()
    lag.alpha, lag.start, lag.u_k = -math.expm1(-0.125 / 36_000.0), False, 10.0
    steps = 600_000
    for _ in range(steps):
        lag.step()
    wanted = 10.0 * -math.expm1(-steps * 0.125 / 36_000.0)
    assert lag.x_k == pytest.approx(wanted, abs=3e-6)


def heartbeat_of(block: Any) -> int:
    block.step()
    return block.heartbeat


def test_the_heartbeat_counts_to_32767_and_begins_at_zero() -> None:
    block = executable(build_program(one_section(double=True)))()
    beats = [heartbeat_of(block) for _ in range(32_770)]
    assert beats[:2] == [1, 2]
    assert beats[32_765:] == [32_766, 32_767, 0, 1, 2]


def test_a_longest_delay_fits_and_the_program_is_made_in_a_moment() -> None:
    plain = one_section(double=True).compensation
    part = replace(plain.model.outputs[0].parts[0], delay_s=10_000.0)
    model = replace(plain.model, outputs=(replace(plain.model.outputs[0], parts=(part,)),))
    program = build_program(export_settings(replace(plain, model=model), cycle_s=1.0, name="z"))
    check_program(program)
    assert any(v.length == 10_000 for block in program.blocks for v in block.states)


def side_by_side(
    settings: PlcSettings,
    rows: list[dict[str, Any]],
    values: list[float],
    program: Program | None = None,
) -> list[CycleOutput]:
    """Run block and `cycle()` over quiet inputs with some that differ; the machine obeys.

    It is enabled from the second call on: the level of the first asks for nothing.
    """
    block, driver = executable(program or build_program(settings))(), CycleDriver(settings)
    said: list[CycleOutput] = []
    sent = (0.0,) * len(settings.names.outputs)
    for call, row in enumerate(rows):
        told = quiet_inputs(settings, values, sent) | {"enable": call > 0} | row
        tell(block, told)
        block.step()
        said.append(driver.told(told))
        wanted = driver.by_name(said[-1])
        assert {name: getattr(block, name) for name in wanted} == wanted, call
        sent = said[-1].correction_um
    return said


def test_whatever_comes_and_goes_a_hold_ends() -> None:
    """The connection comes back again and again, never for as long as it takes to heal."""
    plain = one_section(double=True).compensation
    rules = SupervisorRules(settle_s=2.0, recovery_delay_s=5.0, input_timeout_s=1.0,
                            hold_connection_s=20.0, hold_input_s=4.0,
                            hold_operator_s=4.0)  # fmt: skip
    settings = export_settings(replace(plain, supervisor=rules), cycle_s=1.0, name="z")
    rows: list[dict[str, Any]] = [{}] * 10
    rows += [{"connected": k % 6 >= 3} for k in range(60)]
    said = side_by_side(settings, rows, [24.0])
    states = [output.state for output in said]
    assert states[9] is SupervisorState.ACTIVE
    held = states.count(SupervisorState.HOLDING)
    assert held == rules.max_hold_s + 1.0
    assert states[10 + held] is SupervisorState.FADING


def test_an_allowance_beyond_two_steps_stays() -> None:
    """A sensor that was lost for long may have moved far, and that does not shrink by a jump."""
    plain = one_section(double=True).compensation
    rules = SensorRules(lowest_c=1.0, highest_c=90.0, step_k=0.5, largest_rate_k_per_s=0.1,
                        frozen_s=0.0)  # fmt: skip
    settings = export_settings(replace(plain, sensors={"spindle": rules}), cycle_s=1.0, name="z")
    lost, jumped = {"ok_spindle": False}, {"t_spindle": 60.0}
    rows: list[dict[str, Any]] = [*[{}] * 3, *[lost] * 30, *[jumped] * 5]
    rows += [{"t_spindle": 23.4}, {"t_spindle": 27.0}]
    said = side_by_side(settings, rows, [20.0])
    assert [output.qualities[0] for output in said[-7:]] == [
        *[SampleQuality.TOO_FAST] * 5,
        SampleQuality.GOOD,
        SampleQuality.TOO_FAST,
    ]


LATE: dict[str, Any] = {"cycle_time_s": 5.0}
LOST: dict[str, Any] = {"ok_spindle": False}
OTHER: dict[str, Any] = {"t_spindle": 24.0}
# Rows before the quiet ones, the call from which the value stands still, and the call that is
# frozen: a call that comes too late has the time of the last one that came in time.
FROZEN_FROM: tuple[tuple[str, list[dict[str, Any]], int], ...] = (
    ("from the first call", [], 11),
    ("first call too late: from the second", [LATE], 12),
    ("too late, then lost: from its return in call 4", [LATE, LOST, LOST, LOST], 15),
    ("too late, lost in time, too late: from call 2", [LATE, LATE, LOST, LATE], 14),
    ("changed in a late call 3, with the time of call 2", [OTHER, OTHER, OTHER, LATE], 14),
    ("acknowledged before any call in time: from call 2", [LATE, LATE | {"reset": True}], 13),
)


@pytest.mark.parametrize(("words", "rows", "first"), FROZEN_FROM)
def test_a_value_is_frozen_when_it_stood_still_for_longer_than_its_time_since_a_call_in_time(
    words: str, rows: list[dict[str, Any]], first: int
) -> None:
    """A second a call and ten seconds: in the eleventh call after the one it counts from."""
    plain = one_section(double=True).compensation
    rules = SensorRules(lowest_c=1.0, highest_c=90.0, step_k=50.0, frozen_s=10.0)
    settings = export_settings(replace(plain, sensors={"spindle": rules}), cycle_s=1.0, name="z")
    said = side_by_side(settings, [*rows, *[{}] * 20], [20.0])
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


def test_an_offset_beyond_the_total_after_a_lost_connection_is_a_fault_until_it_has_come_back() -> (
    None
):
    rows: list[dict[str, Any]] = [{}] * 10
    rows += [{"connected": False}, {"read_z_um": 1000.5}, {"reset": True}, {}]
    rows += [{"reset": True}, *[{"enable": False}] * 3]
    said = side_by_side(slow_settings(), rows, [20.0])
    assert said[9].state is SupervisorState.ACTIVE
    assert [output.reasons for output in said[11:14]] == [(Reason.OFFSET_OUTSIDE,)] * 3
    assert [output.correction_um[0] for output in said[11:14]] == [1000.25, 1000.0, 999.75]
    assert [output.answers[0].accepted for output in (said[12], said[14])] == [False, True]
    assert said[14].state is SupervisorState.FADING


# ---- a switch that is wired to hold -------------------------------------------------------------


def test_hold_is_a_level_that_holds_whatever_is_enabled_and_is_refused_at_its_rise_alone() -> None:
    settings = slow_settings()
    block, driver = executable(build_program(settings))(), CycleDriver(settings)
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
            tell(block, told)
            block.step()
            output = driver.told(told)
            wanted = driver.by_name(output)
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
    block = executable(build_program(settings))()
    sent: tuple[float, ...] = (0.0,)
    rows: list[dict[str, Any]] = [{"enable": False}, {"trim_z_um": 4.0}]
    other = {"other_compensation": True}
    rows += [other | {"trim_z_um": um} for um in (4.0, 3.0, 0.0, 2.0, 0.0)]
    trimmed: list[tuple[int, float, bool]] = []
    for row in rows:
        told = quiet_inputs(settings, [20.0], sent) | row
        tell(block, told)
        block.step()
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


def largest_jump_um(program: Program, seed: int, calls: int) -> tuple[float, float]:
    """Return the largest change of an axis that has what it is written, and the longest way.

    The axis takes the correction where it is linked and not Off. While it cannot be reached, or is
    Off, somebody may set another offset; the PLC is switched off and on now and then, and reading
    fails by chance.
    """
    rng = random.Random(seed)  # noqa: S311 - a seeded world
    settings = slow_settings()
    made = executable(program)
    block, first = made(), True
    axis_um, temperature_c = rng.uniform(-30.0, 30.0), 20.0
    connected = read_ok = True
    largest_um = way_um = 0.0
    for _ in range(calls):
        if rng.random() < 0.004:
            block, first = made(), True
        connected = rng.random() < (0.97 if connected else 0.1)
        read_ok = rng.random() < (0.97 if read_ok else 0.3)
        off = first or block.state == 0
        if (not connected and rng.random() < 0.05) or (off and rng.random() < 0.3):
            axis_um = rng.uniform(-30.0, 30.0)
        temperature_c += rng.uniform(-0.05, 0.05)
        told = quiet_inputs(settings, [temperature_c], (axis_um if read_ok else 0.0,))
        told |= {"connected": connected, "read_ok": read_ok, "reset": rng.random() < 0.02}
        wanted = not first and rng.random() < (0.3 if off else 0.98)
        tell(block, told | {"enable": wanted})
        block.step()
        first = False
        assert block.linked <= connected
        if block.linked and block.state != 0:
            largest_um = max(largest_um, abs(block.correction_z_um - axis_um))
            way_um += abs(block.correction_z_um - axis_um)
            axis_um = block.correction_z_um
    return largest_um, way_um


@pytest.mark.parametrize("seed", range(2))
def test_an_axis_never_jumps_whatever_stands_there_after_losses_and_restarts(seed: int) -> None:
    largest_um, way_um = largest_jump_um(build_program(slow_settings()), seed, 4000)
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
    block = executable(build_program(settings))()
    standing = {"enable": True, "hold": True, "reset": True, "trim_z_um": 5.0}
    told = quiet_inputs(settings, [20.0], (0.0,)) | standing
    for _ in range(20):
        tell(block, told)
        block.step()
        said = (block.state, block.enabled, block.refused, block.correction_z_um)
        assert said == (0, False, False, 0.0)
    for enable in (False, True):
        tell(block, told | {"enable": enable, "hold": False})
        block.step()
    assert (block.state, block.enabled, block.wanted_z_um) == (1, True, 0.0)
    tell(block, told | {"hold": False, "trim_z_um": 4.0})
    block.step()
    assert block.wanted_z_um == 4.0
    tell(block, told)
    block.step()
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
    main = build_program(one_section(double=True)).blocks[-1]
    texts = {v.name: v.text for v in main.outputs}
    assert texts["state"] == "0 Off 1 Warming 2 Active 3 Holding 4 Fading 5 Fault"
    assert texts["model_quality"] == "0 good 1 held 2 bad"


# ---- mutants ------------------------------------------------------------------------------------


def changed(program: Program, block: str, edit: Any) -> Program:
    """Return a program in which every assignment of a block went through an edit."""

    def body(statements: tuple[Statement, ...]) -> tuple[Statement, ...]:
        return tuple(one(s) for s in statements)

    def one(statement: Statement) -> Statement:
        if isinstance(statement, If):
            branches = tuple((c, body(inner)) for c, inner in statement.branches)
            return If(branches, body(statement.otherwise))
        return edit(statement)

    def block_of(b: Block) -> Block:
        return replace(b, body=body(b.body)) if b.name == block else b

    return replace(program, blocks=tuple(block_of(b) for b in program.blocks))


@lru_cache
def of_cycle(seed: int) -> tuple[Program, PlcSettings, list[PlcStep]]:
    """Return a program, and what `cycle()` is told and says in a plant of its own."""
    settings = some_settings(seed)
    steps = MoodPlant(settings, 77 + seed).steps(CycleBlock(settings), 400)
    return build_program(settings), settings, list(steps)


def differs(program: Program, settings: PlcSettings, steps: list[PlcStep]) -> bool:
    """Whether a mutant differs; to read what was never written is a difference too."""
    block = ProgramBlock(settings, program)
    try:
        return any(block.step(inputs) != wanted for inputs, wanted in steps)
    except (AttributeError, TypeError):
        return True


def statements_of(program: Program, block: str) -> dict[str, str]:
    """Return the assignments of a block: each as text, with its short words."""
    found: dict[str, str] = {}

    def seen(statement: Statement) -> Statement:
        if isinstance(statement, Assign):
            found[repr(statement)] = named(statement)
        return statement

    changed(program, block, seen)
    return found


# Statements that only repeat what stands there already, or that no input can reach.
REPEATS = {
    "tx_sensor": {
        "allowance_k = most_allowance_k",  # a million kelvin are never reached
        "most_k = allowance_k",  # by name in test_an_allowance_beyond_two_steps_stays
    },
    "tx_supervisor": {
        "state = state_before",  # the output still has it
        "fault = fault_before",
        "fault_word = fault",
        "fault = 2048",  # by name in test_an_offset_beyond_the_total_after_a_lost_connection
        "fault_word = 2048",
        "fault = 0",  # only read in the state Fault
        "running_s = settle_s",  # how far beyond the limit is counted does not matter
        "ready_s = recovery_delay_s",
        "running_s = zero",  # it is zero before the model starts, and then runs for ever
        "halted_s = halted_s",  # by name in test_whatever_comes_and_goes_a_hold_ends
    },
    "tx_limit": {
        "goal_um = goal_before_um",  # the output still has it
        "after_um = total_um",  # what is wanted lies within the total already
        "after_um = total_um with the other sign",
    },
    "tx_requests": {"in_fault = False"},  # by name in test_hold_is_a_level
    "tx_trim": {"left_s = zero"},  # without a trim in force nothing reads it
}


def named(statement: Assign) -> str:
    """Return an assignment in short words: its target, and what its value begins with."""
    value, end = statement.value, ""
    if isinstance(value, Two):
        value = value.left
    if isinstance(value, Minus):
        value, end = value.of, " with the other sign"
    shown = value.name if isinstance(value, Name) else getattr(value, "value", value)
    return f"{getattr(statement.target, 'name', statement.target)} = {shown}{end}"


@pytest.mark.system
@pytest.mark.parametrize(
    "block",
    ["tx_lag", "tx_sensor", "tx_requests", "tx_supervisor", "tx_read_back", "tx_wanted",
     "tx_limit", "tx_trim"],
)  # fmt: skip
def test_every_statement_that_is_left_out_is_noticed(block: str) -> None:
    # The last one trims beyond a total, and by no number and back.
    rows = [of_cycle(seed) for seed in (*range(10), 21)]
    assert all(block in {b.name for b in program.blocks} for program, *_ in rows)
    missed: list[str] = []
    for text, short in statements_of(rows[0][0], block).items():
        if short in REPEATS.get(block, set()):
            continue

        def without(statement: Statement, text: str = text) -> Statement:
            if isinstance(statement, Assign) and repr(statement) == text:
                return Assign(statement.target, statement.target)
            return statement

        if not any(differs(changed(p, block, without), *rest) for p, *rest in rows):
            missed.append(f"{short}: {text}")
    assert missed == []
