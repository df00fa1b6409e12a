"""The line through corrections at positions: least squares, bounded, taken over, read back.

`numpy.polyfit` and the law of the control, K(P) = K0 + slope (P - P0) with the axis moving
against K, are the second ways.
"""

import math
import re
from collections.abc import Iterator
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from tests.refusals import refused
from tests.unit.plc.small_programs import unused
from thermaxis.compensation import (
    STATED,
    Compensation,
    CompensationModel,
    Limits,
    Output,
    Part,
    Section,
    SensorRules,
    SupervisorRules,
    SupervisorState,
)
from thermaxis.plc import (
    BlockInstance,
    CallSequence,
    GuideFacts,
    LineSettings,
    PlcSettings,
    PlcStep,
    Target,
    build_line_program,
    check_program,
    export_settings,
    guide_text,
    print_c,
    print_scl,
    print_st,
    vectors_of,
)
from thermaxis.plc.blocks import at_position, bound_texts
from thermaxis.plc.tree import executable, stored
from thermaxis.plc.vectors import LINE_LIMITED, by_variable

TOTAL_UM = 40.0


def settings_at(
    positions_mm: tuple[float, ...], *, double: bool = True, cycle_s: float = 1.0
) -> PlcSettings:
    outputs = tuple(
        Output(
            at_position(p),
            (Part(f"p{k}", "T", "", 1.0 + k, (Section(3.0 * k - 5.0, 100.0 + k),)),),
        )
        for k, p in enumerate(positions_mm)
    )
    model = CompensationModel(outputs=outputs, reference=STATED, reference_c={"T": 20.0})
    quick = SupervisorRules(settle_s=5.0, hold_operator_s=60.0, at_limit_s=60.0)
    compensation = Compensation(
        model=model,
        sensors={"T": SensorRules(lowest_c=1.0, highest_c=90.0)},
        limits={output.name: Limits(TOTAL_UM, 1.0) for output in outputs},
        supervisor=quick,
    )
    return export_settings(compensation, cycle_s=cycle_s, name="x axis", double=double)


POSITIONS = st.lists(st.integers(-2000, 2000), min_size=2, max_size=6, unique=True).map(
    lambda found: tuple(float(p) for p in found)
)


@settings(max_examples=60, deadline=None)
@given(POSITIONS, st.data(), st.booleans(), st.integers(-500, 500))
def test_the_line_is_that_of_polyfit_and_the_axis_that_moves_against_it_is_corrected(
    positions: tuple[float, ...], data: st.DataObject, away: bool, reference: int
) -> None:
    line = LineSettings(positions_mm=positions, away=away, reference_mm=float(reference))
    corrections_um = np.array([data.draw(st.floats(-300.0, 300.0)) for _ in positions])
    k0_weights, slope_weights = (np.array(w) for w in line.weights())
    k0_mm, slope = k0_weights @ corrections_um, slope_weights @ corrections_um
    at = np.array(positions)
    steepness, level = np.polyfit(at - reference, corrections_um, 1)
    moved_mm = -(k0_mm + slope * (at - reference))  # the control moves the axis against K
    tool_um = moved_mm * 1000.0 * (1.0 if away else -1.0)
    scale = 1e-9 * (1.0 + 1e3 * np.max(np.abs(corrections_um)))
    assert tool_um == pytest.approx(level + steepness * (at - reference), abs=scale)
    if len(positions) == 2:
        assert tool_um == pytest.approx(corrections_um, abs=scale)


def course_of(block: BlockInstance, exported: PlcSettings) -> Iterator[PlcStep]:
    return CallSequence(exported, seed=3, block=block, near_share=0.4).steps()


@pytest.mark.parametrize(
    ("positions", "double"), [((100.0, 900.0), True), ((-50.5, 300.3, 1200.0), False)]
)
def test_the_block_with_a_line_is_the_plain_one_with_the_line_as_its_law_says(
    positions: tuple[float, ...], double: bool
) -> None:
    """The law is written in the arithmetic of numpy; the plain block is proven against `cycle`."""
    f = np.float64 if double else np.float32
    exported = settings_at(positions, double=double, cycle_s=8.0)
    line = LineSettings(positions_mm=positions, away=False, reference_mm=50.1)
    with_line, plain = BlockInstance(exported, line), BlockInstance(exported)
    names = exported.names.outputs
    at, factor, origin = np.array(positions, f), f(1000.0), f(50.1)
    ways = np.array([p - float(origin) for p in at.astype(float)], f)
    weights = [np.array(w, f) for w in line.weights()]
    force, written = np.zeros(len(at), f), (f(0.0), f(0.0))
    states: set[int] = set()
    for inputs, _ in course_of(with_line, exported):
        values = with_line.values()
        if inputs.restart:
            force, written = np.zeros(len(at), f), (f(0.0), f(0.0))
        read = [f(values[f"read_{name}"]) for name in ("k0_mm", "slope", "reference_mm")]
        if all(abs(r) <= 1e6 for r in read):
            there = read[0] + read[1] * (at - read[2])
            reported = force + (there - (written[0] + written[1] * ways)) * factor
        else:
            reported = force + f(1e7)
        # In Off, and once after a lost connection, the plain block goes on from what it reads.
        told = inputs._replace(read_um=tuple(map(float, reported)))
        said = by_variable(exported.names, plain.step(told))
        force = np.array([said[f"correction_{name}"] for name in names], f)
        written = tuple(sum((w * c for w, c in zip(ws, force, strict=True)), f(0.0))
                        for ws in weights)  # fmt: skip
        residual = np.max(np.abs(force - (written[0] + written[1] * ways) * factor))
        wanted = {**said, "k0_mm": written[0], "slope": written[1], "residual_um": residual}
        assert {name: values[name] for name in wanted} == wanted
        assert values["line_limited"] is False
        states.add(said["state"])
    assert states == set(range(len(SupervisorState)))


def driven(block: object, **inputs: object) -> None:
    """Call a block once with these inputs; those not named keep their values."""
    for name, value in inputs.items():
        assert hasattr(block, name), name
        setattr(block, name, value)
    block.step()


WELL = {
    "cycle_time_s": 1.0,
    "enable": True,
    "t_t": 20.0,
    "ok_t": True,
    "interlocks_met": True,
    "connected": True,
    "read_ok": True,
}


def started(block: object, **inputs: object) -> None:
    """Call a block for the first time: it is not enabled yet."""
    driven(block, **WELL | {"enable": False}, **inputs)


def test_a_line_that_stands_in_the_control_is_taken_over_and_not_jumped() -> None:
    positions = (0.0, 500.0, 1000.0)
    exported = settings_at(positions)
    line = LineSettings(positions_mm=positions, away=True)
    block = executable(build_line_program(exported, line))()
    standing = {"read_k0_mm": 0.012, "read_slope": 1e-5, "read_reference_mm": 250.0}
    driven(block, **WELL, **standing)
    there_mm = [0.012 + 1e-5 * (p - 250.0) for p in positions]
    here_mm = [block.k0_mm + block.slope * (p - block.reference_mm) for p in positions]
    assert here_mm == pytest.approx(there_mm, abs=1e-12)
    assert block.correction_at_500 == pytest.approx(-1000.0 * there_mm[1], abs=1e-9)


def test_a_line_that_is_changed_while_it_is_off_is_taken_over_though_it_is_beyond_its_bounds() -> (
    None
):
    line = LineSettings(positions_mm=(0.0, 1000.0), away=True)
    block = executable(build_line_program(settings_at((0.0, 1000.0)), line))()
    driven(block, **{**WELL, "enable": False}, read_slope=0.0, read_reference_mm=500.0)
    for k0_mm in (5.0, 5.0, 0.25, 0.0):
        driven(block, read_k0_mm=k0_mm)
        assert block.k0_mm == pytest.approx(k0_mm, abs=1e-12)
        assert block.line_limited is False
    assert (block.k0_mm, block.state) == (0.0, 0)


def test_a_control_that_keeps_another_slope_is_a_fault_and_one_that_follows_is_none() -> None:
    positions = (0.0, 1000.0)
    line = LineSettings(positions_mm=positions, away=True)
    for factor, expected in ((1.0, SupervisorState.ACTIVE), (0.5, SupervisorState.FAULT)):
        block = executable(build_line_program(settings_at(positions), line))()
        started(block, read_k0_mm=0.0, read_slope=0.0, read_reference_mm=500.0)
        for k in range(120):
            driven(
                block,
                enable=True,
                t_t=20.0 + min(0.05 * k, 4.0),
                read_k0_mm=block.k0_mm,
                read_slope=factor * block.slope,
            )
        assert block.state == list(SupervisorState).index(expected)


@pytest.mark.parametrize(
    ("name", "odd"),
    [("read_k0_mm", math.nan), ("read_slope", math.inf), ("read_reference_mm", -1e30)],
)
def test_what_is_no_line_counts_as_not_read(name: str, odd: float) -> None:
    line = LineSettings(positions_mm=(0.0, 1000.0), away=True)
    block = executable(build_line_program(settings_at((0.0, 1000.0)), line))()
    read = {"read_k0_mm": 0.01, "read_slope": 1e-5, "read_reference_mm": 500.0}
    started(block, **{**read, name: odd})
    assert (block.k0_mm, block.slope, block.linked) == (0.0, 0.0, False)
    driven(block, **read, enable=True)
    assert block.linked
    assert (block.k0_mm, block.slope) == pytest.approx((0.01, 1e-5), rel=1e-12)
    for _ in range(20):
        driven(block, **{name: odd})
    assert block.state == list(SupervisorState).index(SupervisorState.FAULT)


def test_the_line_goes_to_zero_at_the_rate_of_the_corrections_when_it_is_switched_off() -> None:
    positions = (0.0, 1000.0)
    line = LineSettings(positions_mm=positions, away=True)
    block = executable(build_line_program(settings_at(positions), line))()
    started(block, read_k0_mm=0.0, read_slope=0.0, read_reference_mm=500.0)
    largest_step_um, last_um, reached_um = 0.0, (0.0, 0.0), 0.0
    for k in range(200):
        at_rest = k > 120
        driven(
            block,
            enable=not at_rest,
            t_t=20.0 + min(0.05 * k, 6.0),
            read_k0_mm=block.k0_mm,
            read_slope=block.slope,
        )
        now_um = tuple(-1000.0 * (block.k0_mm + block.slope * (p - 500.0)) for p in positions)
        step_um = max(abs(a - b) for a, b in zip(now_um, last_um, strict=True))
        largest_step_um, last_um = max(largest_step_um, step_um), now_um
        reached_um = max(reached_um, *(abs(u) for u in now_um))
    assert largest_step_um == pytest.approx(1.0, abs=1e-9)  # reached, never passed
    assert reached_um > 5.0
    assert (block.k0_mm, block.slope, block.state) == (0.0, 0.0, 0)


def test_the_bounds_are_what_the_limits_of_the_corrections_allow_and_no_more() -> None:
    line = LineSettings(positions_mm=(0.0, 250.0, 1000.0), away=True, reference_mm=0.0)
    k0_mm, slope = line.bounds((TOTAL_UM,) * 3)
    corners = np.array(np.meshgrid(*[[-TOTAL_UM, TOTAL_UM]] * 3)).reshape(3, -1).T
    fits = np.array([np.polyfit(line.positions_mm, c, 1) for c in corners]) / 1000.0
    assert k0_mm == pytest.approx(np.max(np.abs(fits[:, 1])), rel=2e-6)
    assert slope == pytest.approx(np.max(np.abs(fits[:, 0])), rel=2e-6)
    assert k0_mm > np.max(np.abs(fits[:, 1]))


@pytest.mark.parametrize("double", [True, False])
def test_the_bounds_are_said_outward_with_the_same_digits_wherever_they_stand(double: bool) -> None:
    positions = (0.0, 533.0)
    exported = settings_at(positions, double=double)
    line = LineSettings(positions_mm=positions, away=True)
    program = build_line_program(exported, line)
    said = bound_texts(exported, line)
    (block,) = [b for b in program.blocks if b.name == "tx_line"]
    held = {v.name: stored(float(v.start), double=double) for v in block.constants}
    for text, name in zip(said, ("largest_k0_mm", "largest_slope"), strict=True):
        assert held[name] <= float(text) <= held[name] * (1.0 + 1.1e-5)
        assert len(text.strip("0.").replace(".", "")) <= 6
    target = Target("sinumerik-tempcomp", "s7-1500" if double else "s7-300")
    guide = guide_text(exported, program, GuideFacts(target, ("x",), "v", (), line))
    k0_mm, slope = said
    assert f"Largest K0 {k0_mm} mm, largest slope {slope} mm/mm" in "\n".join(program.head)
    assert f"larger than {k0_mm} mm and {slope} mm/mm" in guide
    assert f"| mm/mm | {slope} | DOUBLE" in guide
    assert f"| mm | {k0_mm} | DOUBLE" in guide


def test_the_guide_names_how_far_the_line_moves_in_one_call_and_it_moves_no_further() -> None:
    positions = (0.0, 250.0, 1000.0)
    exported = settings_at(positions, cycle_s=8.0)
    line = LineSettings(positions_mm=positions, away=True, reference_mm=0.0)
    program = build_line_program(exported, line)
    target = Target("sinumerik-tempcomp", "s7-1500")
    guide = guide_text(exported, program, GuideFacts(target, ("x",), "v", (), line))
    (said,) = re.findall(r"at most ([0-9.]+) mm of K0 and ([0-9.]+) mm/mm of slope", guide)
    k0_step_mm, slope_step = map(float, said)
    corners = np.array(np.meshgrid(*[[-8.0, 8.0]] * 3)).reshape(3, -1).T
    fits = np.abs([np.polyfit(positions, c, 1) for c in corners]) / 1000.0
    assert k0_step_mm == pytest.approx(np.max(fits[:, 1]), rel=2e-5)
    assert slope_step == pytest.approx(np.max(fits[:, 0]), rel=2e-5)
    block = BlockInstance(exported, line)
    calls = [(inputs.restart, block.values()) for inputs, _ in course_of(block, exported)]
    moved = [
        (abs(now["k0_mm"] - before["k0_mm"]), abs(now["slope"] - before["slope"]))
        for (_, before), (restart, now) in pairwise(calls)
        if before["linked"] and now["linked"] and not restart
        if before["state"] and now["state"]
    ]
    largest = np.max(np.array(moved), axis=0)
    assert 0.1 * k0_step_mm < largest[0] <= k0_step_mm
    assert 0.1 * slope_step < largest[1] <= slope_step


def test_a_bound_that_never_acts_is_named_among_what_is_not_in_the_rows() -> None:
    exported = settings_at((0.0, 500.0), cycle_s=8.0)
    line = LineSettings(positions_mm=(0.0, 500.0), away=True)
    found = vectors_of(exported, line)
    assert LINE_LIMITED in found.missing
    assert f"# not in the rows: {LINE_LIMITED}" in found.text
    assert not any("line_limited" in text for text in vectors_of(exported, most_rows=20).missing)


def test_the_residual_is_the_largest_distance_from_the_line() -> None:
    positions = (0.0, 500.0, 1000.0)
    line = LineSettings(positions_mm=positions, away=True)
    block = executable(build_line_program(settings_at(positions), line))()
    started(block, read_k0_mm=0.0, read_slope=0.0, read_reference_mm=500.0)
    driven(block, enable=True)
    trims = dict(zip((f"trim_at_{p:g}" for p in positions), (-2.0, 4.0, -2.0), strict=True))
    for _ in range(40):
        driven(block, **trims, read_k0_mm=block.k0_mm, read_slope=block.slope)
    corrections = [getattr(block, f"correction_at_{p:g}") for p in positions]
    fit = np.polyfit(positions, corrections, 1)
    away = np.abs(np.array(corrections) - np.polyval(fit, positions))
    assert corrections == pytest.approx([-2.0, 4.0, -2.0], abs=1e-9)
    assert block.residual_um == pytest.approx(np.max(away), abs=1e-9)
    assert block.residual_um == pytest.approx(4.0, abs=1e-9)


@pytest.mark.parametrize("double", [True, False])
def test_the_program_keeps_every_rule_and_is_printed_in_every_dialect(double: bool) -> None:
    exported = settings_at((-100.5, 250.25), double=double)
    program = build_line_program(exported, LineSettings(positions_mm=(-100.5, 250.25), away=True))
    check_program(program)
    assert not [name for name in unused(program) if "line" in name]
    assert {b.name for b in program.blocks} >= {"tx_line", "tx_line_back"}
    texts = (
        print_st(program),
        print_scl(program, "s7-1500" if double else "s7-300"),
        *print_c(program),
    )
    for text in texts:
        assert text.isascii()
        assert max(map(len, text.splitlines())) <= 100
    assert "at_m100_5" in texts[0]


def test_vectors_have_a_column_for_everything_and_are_the_same_twice() -> None:
    exported = settings_at((0.0, 500.0))
    line = LineSettings(positions_mm=(0.0, 500.0), away=True)
    text = vectors_of(exported, line, most_rows=50).text
    assert text == vectors_of(exported, line, most_rows=50).text
    lines = [row for row in text.splitlines() if not row.startswith("#")]
    program = build_line_program(exported, line)
    names = lines[0].split(",")
    main = program.blocks[-1]
    assert [n for n in names if n not in {"call", "calls", "restart"}] == [
        v.name for v in (*main.inputs, *main.outputs) if not v.name.startswith("model_id")
    ]
    assert {len(row.split(",")) for row in lines} == {len(names)}
    assert len(lines) == 51


def test_positions_that_make_no_line_are_refused() -> None:
    for positions, code in [
        ((100.0,), "too_few_positions"),
        ((100.0, 100.5), "positions_too_close"),
        ((100.0, math.nan), "outside_range"),
        ((100.0, 2e5), "outside_range"),
    ]:
        with refused(code):
            LineSettings(positions_mm=positions, away=True)


def test_limits_that_allow_a_slope_which_the_control_does_not_follow_are_refused() -> None:
    exported = settings_at((0.0, 2.0))
    with refused("slope_too_large"):
        build_line_program(exported, LineSettings(positions_mm=(0.0, 2.0), away=True))
    with refused("one_position_per_output"):
        build_line_program(exported, LineSettings(positions_mm=(0.0, 200.0, 400.0), away=True))
